"""Soft contacts, which an implicit step solves: runs of the real engines, and loops that share no code with ours."""

import ctypes
import ctypes.util
import math

import numpy as np
import pytest

from tests.simulators.test_impulse import PHASES, measured, package
from viscopade.simulators import simulator_of
from viscopade.simulators.native import Impact, delivery, names_without_effect

STEPS = 400  # after which a body that has not left stays


def bullet(settings, mass, radius, gravity, step, both):
    """Return a run of PyBullet: a ball on a plane, or two balls; numbers are those of both bodies."""
    own = package("pybullet")
    own.isConnected() or own.connect(own.DIRECT)
    numbers = {name: tuple(map(float, text.split())) for name, text in settings.items() if name != "body"}

    def run(gap, rate):
        own.resetSimulation()
        own.setGravity(0, 0, -gravity)
        own.setTimeStep(step)
        kind = {"useMaximalCoordinates": settings.get("body") == "btRigidBody"}
        sphere = own.createCollisionShape(own.GEOM_SPHERE, radius=radius)
        upper = own.createMultiBody(mass, sphere, basePosition=[0, 0, radius + gap], **kind)
        if both:
            lower = own.createMultiBody(mass, sphere, basePosition=[0, 0, -radius], **kind)
        else:
            lower = own.createMultiBody(0, own.createCollisionShape(own.GEOM_PLANE), **kind)
        for i, speed in enumerate((rate / 2, -rate / 2) if both else (rate, 0)):
            body = (upper, lower)[i]
            surface = {name: pair[i] for name, pair in numbers.items() if name != "contactBreakingThreshold"}
            own.changeDynamics(body, -1, linearDamping=0, angularDamping=0, **surface)
            own.resetBaseVelocity(body, [0, 0, speed])
        for _ in range(STEPS):
            own.stepSimulation()
            places = [own.getBasePositionAndOrientation(body)[0][2] for body in (upper, lower)]
            rates = [own.getBaseVelocity(body)[0][2] for body in (upper, lower)]
            yield places[0] - places[1] - (2 if both else 1) * radius, rates[0] - rates[1]

    return run


BULLET = [  # contactStiffness, contactDamping, restitution, speed, gravity, step, whether both are balls, body
    ("1e4 1e5", "1 3", "0 0", 1.0, 9.81, 1 / 240, False, "btMultiBody"),
    ("1e3 1e18", "5 0.1", "0 0", 2.0, 0.0, 1 / 240, False, "btMultiBody"),
    ("1e4 1e5", "1 3", "0.5 0.8", 1.0, 9.81, 1 / 240, False, "btMultiBody"),
    ("1e4 1e4", "2 2", "0 0", 1.0, 9.81, 1 / 1000, False, "btRigidBody"),
    ("1e5 1e5", "0 0", "0 0", 3.0, 0.0, 1 / 1000, True, "btMultiBody"),
    ("2e4 1e5", "7 0", "0 0", 1.0, 0.0, 1 / 240, True, "btRigidBody"),
]


@pytest.mark.parametrize(("stiffness", "damping", "restitution", "speed", "gravity", "step", "both", "body"), BULLET)
def test_a_ball_in_bullet(stiffness, damping, restitution, speed, gravity, step, both, body):
    mass, radius = 0.7, 0.2
    given = {"contactStiffness": stiffness, "contactDamping": damping, "restitution": restitution, "body": body}
    if both:  # btSphereSphereCollisionAlgorithm has no margin
        given["contactBreakingThreshold"] = "0"
    real = measured(bullet(given, mass, radius, gravity, step, both), speed, gravity, step)
    native = simulator_of("bullet").native
    impact = Impact(speed, mass / 2 if both else mass, radius, gravity, step)
    found = native.contact(native.values(given), impact).epsilon(PHASES)
    assert found == pytest.approx(real, abs=1e-5)
    assert found.max() > 0.1


def linear_epsilon(stiffness, damping, mass):
    """Return eps of m x'' + c x' + k x = 0 up to where the force vanishes, for a damping ratio below 1."""
    zeta = damping / 2 / math.sqrt(stiffness * mass)
    return math.exp(-2 * zeta * math.acos(zeta) / math.sqrt(1 - zeta**2))


def test_bullet_with_short_steps_is_a_linear_spring():
    """1/k = 1/1e4 + 1/1e5, c = 1 + 3; a restitution of both makes the damper act on v + e v."""
    native = simulator_of("bullet").native
    given = {"contactStiffness": "1e4 1e5", "contactDamping": "1 3"}
    exact = linear_epsilon(1e9 / 1.1e5, 4, 0.7)
    assert delivery(native, given, Impact(1.0, 0.7)).collision.epsilon == pytest.approx(exact, abs=1e-8)
    # In steps of h implicit Euler damps by a factor exp(-pi h/2 sqrt(k/m)) more, which is 0.998.
    given["restitution"] = "0.5 0.8"
    limit = delivery(native, given, Impact(1.0, 0.7)).collision.epsilon
    stepped = delivery(native, given, Impact(1.0, 0.7, 0.2, 0.0, 1e-5)).collision.epsilon
    assert limit != pytest.approx(exact, abs=0.01)
    assert stepped == pytest.approx(limit, abs=3e-3)


def test_what_is_written_gives_the_wanted_eps_in_bullet():
    native = simulator_of("bullet").native
    given = {"contactStiffness": "2e3", "contactDamping": "1"}
    written = delivery(native, given, Impact(1.0, 0.7, 0.2, 9.81, 1 / 1000), 0.5).instead
    pairs = {name: f"{value} {value}" for name, value in (given | written).items()}
    run = bullet(pairs, 0.7, 0.2, 9.81, 1 / 1000, False)
    assert measured(run, 1.0, 9.81, 1 / 1000, (np.arange(64) + 0.5) / 64).mean() == pytest.approx(0.5, abs=1e-3)


def test_a_soft_contact_of_a_million_steps_is_that_of_infinitely_many():
    """Without damping eps is 1. All steps would take minutes."""
    native, given = simulator_of("gazebo").native, {"kp": "2", "kd": "0", "max_vel": "10"}
    impact = Impact(1.0, 1.0, None, 0.0, 1e-6)
    assert names_without_effect(native, given, impact) == ()
    found = delivery(native, given, impact, weight_is_known=True)
    assert found.collision.epsilon == pytest.approx(1, abs=1e-9)
    assert found.warnings == (
        "A contact has 3.1e+06 time steps: this is eps with infinitely many, which differs by less than 0.001",
    )


@pytest.mark.parametrize(("threshold", "warns"), [("1e5", True), ("0", False)])
def test_gazebo_says_that_its_threshold_keeps_bodies_down(threshold, warns):
    given = {"restitution_coefficient": "0.8", "threshold": threshold, "max_vel": "10"}
    found = delivery(simulator_of("gazebo").native, given, Impact(1.0, 1.0, None, 9.81, 1e-3))
    assert any("threshold is 100000 m/s: slower bodies do not rebound" in text for text in found.warnings) == warns


def test_a_stiffness_of_bullet_needs_a_mass():
    native = simulator_of("bullet").native
    with pytest.raises(ValueError, match="mass is missing: expected --mass"):
        delivery(native, {"contactStiffness": "2e3", "contactDamping": "1"}, Impact(1.0, None, 0.2, 9.81, 1 / 240))


class Surface(ctypes.Structure):  # dSurfaceParameters of ode/contact.h, in double precision
    _fields_ = [("mode", ctypes.c_int)] + [
        (name, ctypes.c_double)
        for name in (
            *("mu", "mu2", "rho", "rho2", "rhoN", "bounce", "bounce_vel", "soft_erp", "soft_cfm"),
            *("motion1", "motion2", "motionN", "slip1", "slip2"),
        )
    ]


class Geometry(ctypes.Structure):  # dContactGeom
    _fields_ = [
        ("pos", ctypes.c_double * 4),
        ("normal", ctypes.c_double * 4),
        ("depth", ctypes.c_double),
        ("geoms", ctypes.c_void_p * 2),
        ("sides", ctypes.c_int * 2),
    ]


class TouchPoint(ctypes.Structure):  # dContact
    _fields_ = [("surface", Surface), ("geom", Geometry), ("fdir1", ctypes.c_double * 4)]


def ode_library():
    name = ctypes.util.find_library("ode") or "libode.so.8"
    try:
        own = ctypes.CDLL(name)
    except OSError:
        pytest.skip("the library ODE is not installed: the engine is not run")
    if not own.dCheckConfiguration(b"ODE_double_precision"):
        pytest.skip("the library ODE is in single precision")
    own.dInitODE2(0)
    handles = "dWorldCreate", "dBodyCreate", "dCreateSphere", "dCreatePlane", "dJointGroupCreate", "dJointCreateContact"
    for function in handles:
        getattr(own, function).restype = ctypes.c_void_p
    for function in ("dBodyGetPosition", "dBodyGetLinearVel"):
        getattr(own, function).restype = ctypes.POINTER(ctypes.c_double)
    return own


def ode(settings, mass, radius, gravity, step, both):
    """Return a run of ODE: a ball on a plane, or two balls."""
    own, real, pointer = ode_library(), ctypes.c_double, ctypes.c_void_p
    numbers = {name: float(text) for name, text in settings.items() if name != "solver"}

    def run(gap, rate):
        world, group = pointer(own.dWorldCreate()), pointer(own.dJointGroupCreate(0))
        own.dWorldSetGravity(world, real(0), real(0), real(-gravity))
        own.dWorldSetContactMaxCorrectingVel(world, real(numbers.get("max_vel", math.inf)))
        own.dWorldSetContactSurfaceLayer(world, real(numbers.get("min_depth", 0)))

        def ball(height, speed):
            body, geom = pointer(own.dBodyCreate(world)), pointer(own.dCreateSphere(None, real(radius)))
            own.dMassSetSphereTotal(inertia := (real * 17)(), real(mass), real(radius))
            own.dBodySetMass(body, inertia)
            own.dGeomSetBody(geom, body)
            own.dBodySetPosition(body, real(0), real(0), real(height))
            own.dBodySetLinearVel(body, real(0), real(0), real(speed))
            return body, geom

        upper, first = ball(radius + gap, rate / 2 if both else rate)
        lower, second = ball(-radius, -rate / 2) if both else (pointer(), None)
        if not both:
            second = pointer(own.dCreatePlane(None, real(0), real(0), real(1), real(0)))
        touch = TouchPoint()
        touch.surface.mode = 0x004 | 0x008 | 0x010  # dContactBounce, dContactSoftERP, dContactSoftCFM
        touch.surface.bounce, touch.surface.bounce_vel = numbers.get("bounce", 0), numbers.get("bounce_vel", 0)
        touch.surface.soft_erp, touch.surface.soft_cfm = numbers["soft_erp"], numbers["soft_cfm"]
        for _ in range(STEPS):
            if own.dCollide(first, second, 1, ctypes.byref(touch.geom), ctypes.sizeof(Geometry)):
                own.dJointAttach(pointer(own.dJointCreateContact(world, group, ctypes.byref(touch))), upper, lower)
            getattr(own, settings.get("solver", "dWorldStep"))(world, real(step))
            own.dJointGroupEmpty(group)
            place, speed = own.dBodyGetPosition(upper)[2], own.dBodyGetLinearVel(upper)[2]
            if both:
                yield place - own.dBodyGetPosition(lower)[2] - 2 * radius, speed - own.dBodyGetLinearVel(lower)[2]
            else:
                yield place - radius, speed

    return run


ODE = [  # settings, speed, gravity, step, whether both are balls
    ({"soft_erp": "0.9", "soft_cfm": "0.01"}, 1.0, 9.81, 1e-3, False),
    ({"soft_erp": "0.5", "soft_cfm": "0.02", "min_depth": "0.001"}, 2.0, 9.81, 2e-3, False),
    ({"soft_erp": "0.9", "soft_cfm": "0.01", "max_vel": "0.7"}, 1.0, 9.81, 1e-3, False),
    ({"soft_erp": "0.2", "soft_cfm": "1e-10", "bounce": "0.8"}, 1.0, 9.81, 1e-3, False),
    ({"soft_erp": "0.6", "soft_cfm": "0.01", "bounce": "0.4", "bounce_vel": "0.5"}, 1.0, 9.81, 1e-3, False),
    ({"soft_erp": "0.9", "soft_cfm": "0.05"}, 1.0, 0.0, 1e-3, True),
    ({"soft_erp": "0.8", "soft_cfm": "0.02", "solver": "dWorldQuickStep"}, 3.0, 9.81, 1e-3, False),
]


@pytest.mark.parametrize(("settings", "speed", "gravity", "step", "both"), ODE)
def test_a_ball_in_ode(settings, speed, gravity, step, both):
    mass, radius = 0.7, 0.2
    real = measured(ode(settings, mass, radius, gravity, step, both), speed, gravity, step)
    native = simulator_of("ode").native
    impact = Impact(speed, mass / 2 if both else mass, None, gravity, step)
    found = native.contact(native.values(settings), impact).epsilon(PHASES)
    # QuickStep's iterations leave a small error.
    assert found == pytest.approx(real, abs=1e-4 if settings.get("solver") == "dWorldQuickStep" else 1e-9)
    assert found.max() > 0.1


@pytest.mark.parametrize(
    ("settings", "written"),
    [
        ({"soft_erp": "0.9", "soft_cfm": "0.005"}, {"soft_erp", "soft_cfm"}),
        ({}, {"bounce"}),  # ERP and CFM of ODE's world, which are as good as hard
    ],
)
def test_what_is_written_gives_the_wanted_eps_in_ode(settings, written):
    native = simulator_of("ode").native
    instead = delivery(native, settings, Impact(1.0, 0.7, None, 9.81, 1e-3), 0.5).instead
    assert {*instead} == written
    run = ode({"soft_erp": "0.2", "soft_cfm": "1e-10"} | settings | instead, 0.7, 0.2, 9.81, 1e-3, False)
    assert measured(run, 1.0, 9.81, 1e-3, (np.arange(64) + 0.5) / 64).mean() == pytest.approx(0.5, abs=1e-3)


def test_ode_makes_its_spring_of_a_step():
    """k = erp/(h cfm) and c = (1 - erp)/cfm, so that an uncapped contact has eps of that spring for short steps."""
    native, stiffness, damping, mass, h = simulator_of("ode").native, 1e4, 20.0, 0.7, 1e-5
    cfm = 1 / (h * stiffness + damping)
    settings = {"soft_erp": repr(h * stiffness * cfm), "soft_cfm": repr(cfm)}
    found = delivery(native, settings, Impact(1.0, mass, None, 0.0, h)).collision.epsilon
    assert found == pytest.approx(linear_epsilon(stiffness, damping, mass), abs=2e-3)
    with pytest.raises(ValueError, match="expected --time-step, of which soft_erp and soft_cfm are made"):
        delivery(native, settings, Impact(1.0, mass))


def gazebo_epsilon(kp, kd, e, cap, speed, gravity, h, phase, mass, smoothing=0.01):
    """Return eps of one ball by the iterations of Gazebo's quickstep: impulses for the way, and for the speed."""
    erp, cfm = h * kp / (h * kp + kd), 1 / (h * kp + kd) / h
    start = (phase + 2) * h  # contact begins in the third step
    z, w = start * speed - gravity / 2 * start**2, gravity * start - speed + gravity * h / 2
    for _ in range(4000):
        before = w
        ways = {"way": math.inf, "speed": cap}
        after = {}
        for kind, limit in ways.items():
            impulse = pushed = 0.0
            target = min(max(erp / h * max(-z, 0), -e * before), limit)
            for _ in range(50 if z <= 0 else 0):
                # SOR with w = 1.3 on (1/m + cfm) impulse = target - rate; the impulse of the speed is smoothed
                change = 1.3 / (1 / mass + cfm) * (target - before + gravity * h - cfm * impulse - pushed / mass)
                change = max(change, -impulse)
                pushed += change
                impulse += change * (1 - smoothing if kind == "speed" else 1)
            after[kind] = before - gravity * h + pushed / mass
        z, w = z + h * after["way"], after["speed"]
        if z >= 0 and w > gravity * h / 2:
            return math.hypot(w - gravity * h / 2, math.sqrt(2 * gravity * z)) / speed
    return 0.0


GAZEBO = [  # kp and kd of both bodies together, restitution, max_vel, speed
    (1e4, 20.0, 0.0, 10.0, 1.0),
    (1e4, 20.0, 0.0, 0.3, 1.0),
    (5e3, 2.0, 0.6, 0.5, 1.0),
    (1e12, 2.0, 0.8, 0.01, 2.0),
    (1e12, 2.0, 0.8, 5.0, 2.0),
]


@pytest.mark.parametrize(("kp", "kd", "e", "cap", "speed"), GAZEBO)
def test_gazebo_against_its_iterations(kp, kd, e, cap, speed):
    native, phases = simulator_of("gazebo").native, (np.arange(4) + 0.5) / 4
    settings = {"kp": f"{2 * kp} {2 * kp}", "kd": f"{kd / 4} {3 * kd / 4}", "max_vel": f"{cap} 20", "threshold": "0"}
    settings["restitution_coefficient"] = f"1 {e}"
    found = native.contact(native.values(settings), Impact(speed, 0.7, None, 9.81, 1e-3)).epsilon(phases)
    expected = [gazebo_epsilon(kp, kd, e, cap, speed, 9.81, 1e-3, phase, 0.7) for phase in phases]
    assert found == pytest.approx(expected, abs=1e-6)


def test_gazebo_s_restitution_needs_max_vel():
    """By default max_vel is 0.01 m/s: then a body leaves with that speed, and gains a few millimetres at most."""
    native, impact = simulator_of("gazebo").native, Impact(1.0, 0.7, None, 9.81, 1e-3)
    settings = {"restitution_coefficient": "0.8", "threshold": "0"}
    found = delivery(native, settings, impact, 0.8)
    assert found.collision.epsilon < 0.1
    assert any("max_vel is 0.01 m/s" in warning for warning in found.warnings)
    written = {name: float(value) for name, value in found.instead.items()}
    assert written["max_vel"] == pytest.approx(written["restitution_coefficient"] * 1.0)
    assert delivery(native, settings | found.instead, impact).collision.epsilon == pytest.approx(0.8, abs=1e-4)
    with pytest.raises(ValueError, match="expected --time-step, as max_vel is below the speed"):
        delivery(native, settings, Impact(1.0, 0.7))


def test_gazebo_with_short_steps_is_a_linear_spring():
    native = simulator_of("gazebo").native
    settings = {"kp": "2e4", "kd": "4 8", "max_vel": "9"}
    found = delivery(native, settings, Impact(1.0, 0.7)).collision.epsilon
    assert found == pytest.approx(linear_epsilon(1e4, 12.0, 0.7), abs=1e-8)


def bepu_epsilon(frequency, ratio, recovery, substeps, speed, gravity, frame, phase, mass=0.7):
    """Return eps of a ball by the lines of PenetrationLimit.cs, with impulses that are kept, and 3 iterations."""
    dt, omega = frame / substeps, 2 * math.pi * frequency
    to_velocity = omega / (omega * dt + 2 * ratio)
    extra = 1 / (omega * dt * (omega * dt + 2 * ratio))
    scale = 1 / (1 + extra)
    start = (phase + 2) * frame  # contact begins in the third frame
    z, w, kept = start * speed - gravity / 2 * start**2, gravity * start - speed + gravity * frame / 2, 0.0
    for _ in range(4000):
        if z > frame * abs(w - gravity * frame):
            w, kept = w - gravity * frame, 0.0
            z += frame * w
        else:
            depth = -z
            for _ in range(substeps):
                w += kept / mass - gravity * dt
                bias = min(depth / dt, min(depth * to_velocity, recovery))
                for _ in range(3):
                    change = kept * extra * scale + (w - bias) * mass * scale
                    impulse = max(0.0, kept - change)
                    w, kept = w + (impulse - kept) / mass, impulse
                depth -= w * dt
            z = -depth
        if z >= 0 and w > gravity * frame / 2:
            return math.hypot(w - gravity * frame / 2, math.sqrt(2 * gravity * z)) / speed
    return 0.0


BEPU = [  # frequency, damping ratio, MaximumRecoveryVelocity, substeps, speed, gravity
    (5.0, 0.05, 1e9, 1, 4.0, 9.81),
    (5.0, 0.0, 1e9, 8, 3.0, 9.81),
    (10.0, 0.05, 0.4, 4, 1.0, 0.0),
    (30.0, 0.2, 2.0, 8, 4.0, 9.81),
]


@pytest.mark.parametrize(("frequency", "ratio", "recovery", "substeps", "speed", "gravity"), BEPU)
def test_bepu_against_its_impulses(frequency, ratio, recovery, substeps, speed, gravity):
    native, phases = simulator_of("bepu").native, (np.arange(4) + 0.5) / 4
    settings = {"Frequency": f"{frequency}", "DampingRatio": f"{ratio}", "SubstepCount": f"{substeps}"}
    settings["MaximumRecoveryVelocity"] = f"{recovery}"
    found = native.contact(native.values(settings), Impact(speed, None, None, gravity, 1 / 60)).epsilon(phases)
    expected = [bepu_epsilon(frequency, ratio, recovery, substeps, speed, gravity, 1 / 60, phase) for phase in phases]
    assert found == pytest.approx(expected, abs=1e-9)
    assert found.max() > 0.05


def test_bepu_with_short_steps_is_a_damping_ratio():
    native = simulator_of("bepu").native
    found = delivery(native, {"Frequency": "5", "DampingRatio": "0.3"}, Impact(1.0), 0.5)
    assert found.collision.epsilon == pytest.approx(linear_epsilon(1.0, 0.6, 1.0), abs=1e-8)
    ratio = float(found.instead["DampingRatio"])
    assert linear_epsilon(1.0, 2 * ratio, 1.0) == pytest.approx(0.5, abs=1e-7)
    with pytest.raises(ValueError, match="expected --time-step, as MaximumRecoveryVelocity is below the speed"):
        delivery(native, {}, Impact(3.0))


def physx_epsilon(k, c, solver, iterations, speed, gravity, h, phase, mass=0.7, margin=0.04):
    """Return eps of a ball by computeCompliantContactCoefficients and ...TGS of DyContactPrepShared.h."""
    start = (phase + 2) * h  # contact begins in the third step
    z, w = start * speed - gravity / 2 * start**2, gravity * start - speed + gravity * h / 2
    for _ in range(4000):
        w -= gravity * h
        dt = h if solver == "PGS" else h / iterations
        damping = 0.0 if z >= 0 and not -w > z / h else c
        a = dt * (damping + dt * k)
        x = 1 / (1 + a / mass)
        if z >= margin:
            z += h * w
        elif solver == "PGS":
            kicked, impulse = w, 0.0
            for _ in range(iterations):
                # f impulseMultiplier + biasedErr - (w - kicked) velMultiplier, with biasedErr = -kicked x a - h k x z
                impulse = max(0.0, impulse * (1 - x) - kicked * x * a - h * k * x * z - (w - kicked) * x * a)
                w = kicked + impulse / mass
            z += h * w
        else:
            applied = 0.0
            for _ in range(iterations):
                # deltaF = -velMultiplier w - bias/response, bias = sep dt (-k) x response
                change = max(-x * a * w - dt * k * x * z, -applied)
                applied += change
                w += change / mass
                z += dt * w
        if z >= 0 and w > gravity * h / 2:
            return math.hypot(w - gravity * h / 2, math.sqrt(2 * gravity * z)) / speed
    return 0.0


PHYSX = [  # stiffness and damping of the contact, solver, iterations, speed, gravity, step
    (5e3, 5.0, "PGS", 4, 1.0, 9.81, 1 / 240),
    (300.0, 2.0, "PGS", 1, 2.0, 0.0, 1 / 60),
    (5e3, 5.0, "TGS", 4, 1.0, 9.81, 1 / 240),
    (2e3, 1.0, "TGS", 8, 3.0, 9.81, 1 / 60),
]


@pytest.mark.parametrize(("k", "c", "solver", "iterations", "speed", "gravity", "step"), PHYSX)
def test_compliant_contacts_of_physx(k, c, solver, iterations, speed, gravity, step):
    native, phases = simulator_of("physx").native, (np.arange(4) + 0.5) / 4
    settings = {"compliant_contact_stiffness": f"{k / 2} {3 * k / 2}", "compliant_contact_damping": f"0 {2 * c}"}
    settings |= {"solver_type": solver, "restitution": "0.9", "solver_velocity_iteration_count": "0"}
    settings["solver_position_iteration_count"] = f"{iterations}"
    found = native.contact(native.values(settings), Impact(speed, 0.7, 0.2, gravity, step)).epsilon(phases)
    expected = [physx_epsilon(k, c, solver, iterations, speed, gravity, step, phase) for phase in phases]
    assert found == pytest.approx(expected, abs=1e-9)
    assert found.min() > 0.05


@pytest.mark.parametrize(
    ("stiffness", "damping", "mode", "k", "c"),
    [
        ("100 300", "1 3", "average", 200, 2),
        ("100 300", "1 3", "min", 300, 2),  # of the restitutions -100 and -300
        ("100 300", "1 3", "max", 100, 2),
        ("100 0", "1 3", "average", 100, 3),  # one material is hard
    ],
)
def test_physx_combines_compliant_materials(stiffness, damping, mode, k, c):
    native, impact = simulator_of("physx").native, Impact(1.0, 0.7)
    settings = {"compliant_contact_stiffness": stiffness, "compliant_contact_damping": damping}
    settings["restitution_combine_mode"] = mode
    found = delivery(native, settings, impact, 0.6)
    assert found.collision.epsilon == pytest.approx(linear_epsilon(k, c, 0.7), abs=1e-8)
    assert delivery(native, settings | found.instead, impact).collision.epsilon == pytest.approx(0.6, abs=1e-6)


def test_a_compliant_contact_with_velocity_iterations_of_tgs_is_refused():
    native = simulator_of("physx").native
    settings = {"compliant_contact_stiffness": "1e4", "solver_type": "TGS"}
    with pytest.raises(ValueError, match="solver_velocity_iteration_count is 1: expected 0"):
        delivery(native, settings, Impact(1.0, 0.7, 0.2, 9.81, 1 / 60))


def test_a_warning_hides_no_option_without_effect():
    """BEPU's numbers are per mass, and Gazebo needs no radius; both warn that they were not run."""
    settings = {"Frequency": "5", "DampingRatio": "0.1", "MaximumRecoveryVelocity": "1e9"}
    assert names_without_effect(simulator_of("bepu").native, settings, Impact(4.0, 0.7, None, 0.0, 1 / 60)) == ("mass",)
    settings = {"kp": "1e4", "max_vel": "9"}
    assert names_without_effect(simulator_of("gazebo").native, settings, Impact(1.0, 0.7, 0.1, 9.81, 1e-3)) == (
        "radius",
    )


def test_the_step_itself_damps():
    """A spring of 20 and 50 steps without damping: the page's exp(-pi^2/(2 n)), which is exact for many steps."""
    native, h = simulator_of("ode").native, 1e-3
    for n, close in ((20, 0.015), (50, 0.003)):
        cfm = 1 / (h * (math.pi / (n * h)) ** 2)
        found = delivery(native, {"soft_erp": "1", "soft_cfm": repr(cfm)}, Impact(1.0, 1.0, None, 0.0, h))
        assert found.collision.epsilon == pytest.approx(math.exp(-(math.pi**2) / 2 / n), abs=close)
