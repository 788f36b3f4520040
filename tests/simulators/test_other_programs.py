"""Programs of docs/usage/simulators/other-programs.md against integrations that share no code with ours."""

import math

import pytest
from scipy.integrate import solve_ivp

from tests.simulators.test_impulse import package
from viscopade.simulators import simulator_of
from viscopade.simulators.native import Impact, delivery


def rebound(force, mass, speed, gravity=0.0, *, pushes=False):
    """Return eps of m x'' = m g - F(x, x') up to x = 0; with `pushes`, F >= 0."""

    def slope(t, state):
        x, v = max(state[0], 0.0), state[1]
        pull = force(x, v)
        return [v, gravity - (max(pull, 0.0) if pushes else pull) / mass]

    leaves = lambda t, state: state[0] if t > 0 else 1.0  # noqa: E731
    leaves.terminal, leaves.direction = True, -1
    run = solve_ivp(slope, (0, 10), [0.0, speed], events=leaves, method="DOP853", rtol=1e-12, atol=1e-14)
    return -run.y[1, -1] / speed


def beta(e):
    return -math.log(e) / math.hypot(math.log(e), math.pi)


def spheres(radius, density, other=None):
    """Return the effective mass and radius of a sphere at a plane or with one of another radius."""
    masses = [4 / 3 * math.pi * r**3 * density for r in (radius, other) if r]
    return (
        (masses[0], radius) if other is None else (math.prod(masses) / sum(masses), radius * other / (radius + other))
    )


@pytest.mark.parametrize("other", [None, 0.006])
@pytest.mark.parametrize("model", ["linear", "nonLinear", "nonLinearMod"])
def test_phasicflow_damps_with_its_own_masses(model, other):
    """mi = 3*Pi/4*pow(Ri, 3)*rho, and at a wall Rj = 10000."""
    radius, density, speed, en, kn, young, eta = 0.01, 2500.0, 1.3, 0.7, 1e4, 1e6, 20.0
    mass, r_eff = spheres(radius, density, other)
    mi, mj = (3 * math.pi / 4 * r**3 * density for r in (radius, other or 10000))
    wrong = mi * mj / (mi + mj)
    hertz = 4 / 3 * young * math.sqrt(r_eff)
    forces = {
        "linear": lambda x, v: kn * x + 2 * beta(en) * math.sqrt(kn * wrong) * v,
        "nonLinear": lambda x, v: hertz * x**1.5 + 2.2664 * beta(en) * math.sqrt(wrong * hertz) * x**0.25 * v,
        "nonLinearMod": lambda x, v: hertz * x**1.5 + eta * math.sqrt(x) * v,
    }
    settings = {"contactForceModel": model, "kn": "1e4", "Yeff": "1e6", "en": "0.7", "etha_n": "20"}
    native = simulator_of("phasicflow").native
    found = delivery(native, settings, Impact(speed, mass, r_eff, 9.81), 0.6)
    assert found.collision.epsilon == pytest.approx(rebound(forces[model], mass, speed, 9.81), abs=1e-8)
    # The number to write gives 0.6 in the same force.
    ((name, text),) = found.instead.items()
    assert name == ("etha_n" if model == "nonLinearMod" else "en")
    en, eta = (float(text), eta) if name == "en" else (en, float(text))
    assert rebound(forces[model], mass, speed, 9.81) == pytest.approx(0.6, abs=1e-6)


def test_phasicflow_has_no_steps_here():
    native = simulator_of("phasicflow").native
    with pytest.raises(ValueError, match="expected none, as the steps of Adams' methods"):
        delivery(native, {"Yeff": "1e6", "en": "0.7"}, Impact(1.0, 0.01, 0.01, 0.0, 1e-5))


@pytest.mark.parametrize("wall", [None, 1.0])
def test_demengine_against_its_force(wall):
    """2 sqrt(5/6) beta sqrt(Sn m), Sn = 2 E sqrt(R x), with m of both owners: that of a mesh is 1 kg."""
    radius, mass, speed = 0.05, 1.3, 1.0
    modulus = 1 / ((1 - 0.3**2) / 1e7 + (1 - 0.2**2) / 3e7)
    damped = mass if wall is None else mass * wall / (mass + wall)

    def force(x, v):
        stiffness = 2 * modulus * math.sqrt(radius * x)
        return 2 / 3 * stiffness * x + 2 * math.sqrt(5 / 6) * beta(0.6) * math.sqrt(stiffness * damped) * v

    settings = {"E": "1e7 3e7", "nu": "0.3 0.2", "CoR": "0.7 0.5"} | ({} if wall is None else {"SetMass": "1"})
    native = simulator_of("demengine").native
    found = delivery(native, settings, Impact(speed, mass, radius, 9.81)).collision.epsilon
    assert found == pytest.approx(rebound(force, mass, speed, 9.81), abs=1e-8)


@pytest.mark.parametrize("integrator", ["EXTENDED_TAYLOR", "CENTERED_DIFFERENCE", "FORWARD_EULER"])
def test_demengine_s_steps(integrator):
    """v = old_v + v_update*0.5, old_v + v_update, or old_v; X += v*h (DEMIntegrationKernels.cu)."""
    radius, mass, modulus, speed, h, phase = 0.01, 0.01, 5e6, 1.0, 2e-5, 0.3
    part = {"EXTENDED_TAYLOR": 0.5, "CENTERED_DIFFERENCE": 1.0, "FORWARD_EULER": 0.0}[integrator]
    x, v = -phase * h * speed, speed
    for _ in range(10000):
        force = 0.0
        if x > 0:
            stiffness = 2 * modulus * math.sqrt(radius * x)
            force = 2 / 3 * stiffness * x + 2 * math.sqrt(5 / 6) * beta(0.5) * math.sqrt(stiffness * mass) * v
        change = -h * force / mass
        x, v = x + h * (v + part * change), v + change
        if x < 0 and v < 0:
            break
    native = simulator_of("demengine").native
    settings = {"E": "1e7", "nu": "0", "CoR": "0.5", "integrator": integrator}
    contact = native.contact(native.values(settings), Impact(speed, mass, radius, 0.0, h))
    found = contact.collide(speed, step=h, scheme=native.schemes[integrator], phases=[phase])
    assert found.epsilon == pytest.approx(-v, abs=1e-10)


@pytest.mark.parametrize(("p", "q"), [(0.5, 0.5), (1.0, 0.2), (0.0, 0.0)])
def test_jaxsim_against_its_force(p, q):
    """max(0, (K delta^p) delta + (D delta^q) delta')."""
    K, D, mass, speed = 1e5, 300.0, 2.0, 1.5
    native = simulator_of("jaxsim").native
    settings = {"K": "1e5", "D": "300", "p": str(p), "q": str(q)}
    found = delivery(native, settings, Impact(speed, mass), 0.4)
    expected = rebound(lambda x, v: K * x ** (1 + p) + D * x**q * v, mass, speed, pushes=True)
    assert found.collision.epsilon == pytest.approx(expected, abs=1e-7)
    D = float(found.instead["D"])
    assert rebound(lambda x, v: K * x ** (1 + p) + D * x**q * v, mass, speed, pushes=True) == pytest.approx(
        0.4, abs=1e-5
    )


# ke, kd and mu of both shapes, effective mass, speed, gravity, phase, and eps in Newton 1.8.0 in steps of 1 ms: spheres
# of 2 and 3 kg on a plane, and of 3 and 1.5 kg with each other.
FORCE_SPACE = [
    (("1e4", "100", "1"), 2.0, 1.0, 0.0, 0.5, 0.7892588),
    (("1e5", "1000", "0.5"), 2.0, 1.0, 0.0, 0.5, 0.7418698),
    (("2e5 1e5", "300 500", "0.8 0.6"), 3.0, 1.5, 9.81, 0.25, 0.8593759),
    (("2e5", "300", "1"), 1.0, 1.0, 0.0, 0.25, 0.8008135),
]


@pytest.mark.parametrize(("surfaces", "mass", "speed", "gravity", "phase", "real"), FORCE_SPACE)
def test_newton_in_force_space(surfaces, mass, speed, gravity, phase, real):
    native = simulator_of("newton").native
    settings = dict(zip(("ke", "kd", "mu"), surfaces, strict=True))
    settings |= {"solver": "SolverMuJoCo", "use_mujoco_contacts": "False", "solref_mode": "0"}
    contact = native.contact(native.values(settings), Impact(speed, mass, None, gravity, 1e-3))
    scheme = native.schemes["SolverMuJoCo"]
    assert contact.collide(speed, step=1e-3, scheme=scheme, phases=[phase]).epsilon == pytest.approx(real, abs=2e-5)


def test_newton_s_force_space_has_a_mass_and_names_its_solref():
    """timeconst = 2/kd', dampratio = kd'/(2 sqrt(ke')), with 0.05 mu^2 (1 + mu^2)/2/m = 0.025 times both at mu = 1."""
    native = simulator_of("newton").native
    per_mass = {"solver": "SolverMuJoCo", "ke": "1e4", "kd": "100"}
    forces = per_mass | {"use_mujoco_contacts": "False", "solref_mode": "0"}
    found = delivery(native, forces, Impact(1.0, 2.0), 0.6)
    assert found.values.mixed["solref"].value == pytest.approx((2 / 2.5, 2.5 / 2 / math.sqrt(250)))
    assert delivery(native, forces | found.instead, Impact(1.0, 2.0)).collision.epsilon == pytest.approx(0.6, abs=1e-6)
    with pytest.raises(ValueError, match="mass is missing: expected --mass"):
        delivery(native, forces, Impact(1.0))
    # One of both settings alone changes nothing, and is warned of.
    usual = delivery(native, per_mass, Impact(1.0)).collision
    for name, value in (("use_mujoco_contacts", "False"), ("solref_mode", "0")):
        alone = delivery(native, per_mass | {name: value}, Impact(1.0))
        assert alone.collision == usual
        assert any("forces need both" in warning for warning in alone.warnings)


BOX = """<sdf version="1.7"><model name="box"><link name="base">
<inertial><mass>4</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz><ixy>0</ixy><ixz>0</ixz><iyz>0</iyz></inertia></inertial>
<collision name="c"><geometry><box><size>1 1 1</size></box></geometry></collision></link></model></sdf>"""


@pytest.mark.parametrize(("integrator", "p"), [("SemiImplicitEuler", 0.5), ("RungeKutta4", 0.3)])
def test_a_box_in_jaxsim(integrator, p):
    """Its four lower corners have a contact each: four times K and D of one."""
    package("jaxsim")
    import jax
    import jaxsim.api as js
    from jaxsim.rbda.contacts import SoftContacts, SoftContactsParams

    jax.config.update("jax_enable_x64", True)
    speed, h, phase, gravity = 1.0, 1e-3, 0.3, 9.81
    model = js.model.JaxSimModel.build_from_model_description(
        BOX,
        is_urdf=False,
        time_step=h,
        gravity=gravity,
        contact_model=SoftContacts.build(),
        contact_params=SoftContactsParams.build(K=2e5, D=600.0, mu=0.0, p=p, q=0.5),
        integrator=getattr(js.model.IntegratorType, integrator),
    )
    native = simulator_of("jaxsim").native
    # Contact begins at this phase of the first step; the speed of Euler's method is that of the step before.
    lead = {"SemiImplicitEuler": -0.5, "RungeKutta4": 0.0}[integrator]
    fall = phase * h
    height, rate = 0.5 + fall * speed - gravity / 2 * fall**2, -(speed - gravity * fall + lead * gravity * h)
    data = js.data.JaxSimModelData.build(
        model=model, base_position=[0.0, 0.0, height], base_linear_velocity=[0.0, 0.0, rate]
    )
    step = jax.jit(lambda data: js.model.step(model=model, data=data))
    for _ in range(200):
        data = step(data)
        gap, rate = float(data.base_position[2]) - 0.5, float(data.base_velocity[2])
        if gap >= 0 and rate > 0:
            break
    real = math.hypot(rate + lead * gravity * h, math.sqrt(2 * gravity * gap)) / speed
    settings = {"K": "8e5", "D": "2400", "p": str(p), "integrator": integrator}
    contact = native.contact(native.values(settings), Impact(speed, 4.0, None, gravity, h))
    found = contact.collide(speed, step=h, scheme=native.schemes[integrator], phases=[phase])
    assert found.epsilon == pytest.approx(real, abs=1e-9)
