"""One collision of any contact: against the proven eps, SciPy's DOP853, closed forms, and numbers seen in programs."""

import math
import random
import time
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq
from scipy.special import lambertw

from viscopade.collision import exact
from viscopade.collision.contact import PHASES, Contact, damping_factor, resolving_factor
from viscopade.collision.schemes import FORWARD, IMPLICIT, RUNGE_KUTTA, SCHEMES, SEMI_IMPLICIT, TAYLOR
from viscopade.theory.law import Law, law_of

NAMED = [
    law_of(name, end)
    for name in ("viscoelastic", "linear", "tsuji", "hunt-crossley:1", "hunt-crossley", "3/2,0", "5/4,1/4")
    for end in ("force", "return")
]
KEYS = {"epsilon": "epsilon", "depth": "x_max", "duration": "tau_c"}


def identity(law):
    return f"{law}-{law.end}"


def proven(law, kappa):
    return exact.collision(kappa=kappa, law=law, digits=15).floats()


def kappa_of(law, epsilon):
    return exact.invert(epsilon, law=law, digits=15).floats()["v_star"] ** law.d


def second_route(contact, speed=1.0, longest=200.0):
    """Return eps by SciPy's integrator in x and v, stopped and started where the force vanishes or acts again."""
    g, x, v, acts = contact.load / contact.mass, 1e-12 * speed, speed, True
    clock, before = 0.0, 1e-12

    def force(state):
        return float(contact.force(np.array([max(state[0], 0.0)]), np.array([state[1]]))[0]) / contact.mass

    def ends(t, state):
        return state[0]

    def turns(t, state):
        return state[1]

    def switches(t, state):
        return force(state) if contact.end == "force" else 1.0

    for event in (ends, turns, switches):
        event.terminal = True
    ends.direction, turns.direction = -1, -1
    while clock < longest:
        found = solve_ivp(
            lambda t, y, acts=acts: (y[1], g - (force(y) if acts else 0.0)),
            (0, longest),
            (x, v),
            method="DOP853",
            rtol=3e-14,
            atol=1e-16,
            events=(ends, turns, switches),
            first_step=before,
        )
        (x, v), clock = found.y[:, -1], clock + found.t[-1]
        if found.t_events[0].size or (v < 0 and x < 1e-12):
            return -v / speed
        if found.t_events[1].size:
            if turns.direction > 0:
                return 0.0
            turns.direction = 1
        if found.t_events[2].size:
            acts = not acts
        x, v, before = x + 1e-9 * v, v + 1e-9 * (g - (force((x, v)) if acts else 0)), 1e-9
    return 0.0


@pytest.mark.parametrize("law", NAMED, ids=identity)
def test_power_laws_without_load_agree_with_the_exact_function(law):
    for kappa in (1e-3, 0.03, 0.4, 1.5, 10):
        if law.bounded and kappa > 1:
            continue
        true, found = proven(law, kappa), Contact.of_law(law, kappa).collide()
        assert found.parts
        assert found.status == "sampled"
        assert found.epsilon == pytest.approx(true["epsilon"], rel=1e-12, abs=1e-14)
        assert found.depth == pytest.approx(true["x_max"], rel=1e-12)
        assert found.duration == pytest.approx(true["tau_c"], rel=1e-9)
        assert found.least == found.largest == found.epsilon


@pytest.mark.parametrize("seed", range(5))
def test_the_true_error_is_within_the_estimate(seed):
    """Of eps, depth and duration, for laws at random; force and return, a force that vanishes just before x = 0 too."""
    numbers = random.Random(seed)
    done = 0
    while done < 12:
        parts = numbers.randint(1, 5)
        elastic, damping = numbers.randint(1, 3 * parts), numbers.randint(0, 2 * parts)
        try:
            law = Law(f"{elastic}/{parts}", f"{damping}/{parts}", numbers.choice(("force", "return")))
            kappa = 10 ** numbers.uniform(-3, 1)
            true = proven(law, kappa)
        except ValueError:  # no law, or no end
            continue
        found = Contact.of_law(law, kappa).collide()
        for ours, theirs in KEYS.items():
            bound = 100 * found.errors[ours] + 1e-12
            assert abs(getattr(found, ours) - true[theirs]) < bound, (law, law.end, kappa, ours)
        done += 1


@pytest.mark.parametrize("law", NAMED, ids=identity)
def test_the_true_error_with_a_load_is_within_the_estimate(law):
    for kappa, load in ((0.001, 1e-4), (0.02, 0.01), (0.05, 0.3), (0.4, 0.1), (0.4, -0.2), (1.2, 0.03)):
        contact = Contact.of_law(law, kappa, load)
        found, theirs = contact.collide(), second_route(contact)
        assert abs(found.epsilon - theirs) < min(100 * found.errors["epsilon"] + 1e-12, 1e-11)


def test_a_force_that_acts_again_before_the_bodies_part():
    """Damping at some depths only: it would pull there while the bodies part, and the spring acts again above."""
    contact = Contact(lambda x, v: x + 4 * np.exp(-(((x - 0.3) / 0.05) ** 2)) * v, load=0.02)
    found = contact.collide()
    assert found.parts
    assert found.epsilon == pytest.approx(second_route(contact), abs=1e-8)
    assert found.epsilon != pytest.approx(Contact(contact.force, load=0.1, end="return").collide().epsilon, abs=1e-3)


FORCES = {
    "damping while approaching": lambda x, v: x + 0.6 * np.maximum(v, 0),
    "two springs": lambda x, v: x + 3 * np.maximum(x - 0.4, 0) + 0.2 * x * v,
    "a cubic step": lambda x, v: x**1.5 + (lambda t: t * t * (3 - 2 * t))(np.clip(x / 0.3, 0, 1)) * v,
    "unloading on a softer spring": lambda x, v: np.where(v > 0, 1.0, 0.36) * x,
    "a dashpot from a depth on": lambda x, v: x + np.where(x > 0.3, 0.3, 0.0) * v,
    "stairs": lambda x, v: np.ceil(20 * x) / 20 + 0.1 * v,
}


@pytest.mark.parametrize("name", FORCES)
def test_forces_with_kinks_and_jumps(name):
    contact = Contact(FORCES[name])
    found, halves = contact.collide(), [contact.collide(step=1 / n, phases=np.arange(0.5, 8) / 8) for n in (1000, 2000)]
    expected = 2 * halves[1].epsilon - halves[0].epsilon
    assert found.epsilon == pytest.approx(expected, abs=1e-4)
    assert found.errors["epsilon"] < 1e-7
    if name == "damping while approaching":  # eps needs the depth alone
        zeta = 0.3
        w = math.sqrt(1 - zeta**2)
        assert found.epsilon == pytest.approx(math.exp(-zeta / w * math.atan(w / zeta)), abs=1e-13)
        assert found.epsilon == pytest.approx(found.depth, abs=1e-13)
    if name == "unloading on a softer spring":
        assert found.epsilon == pytest.approx(0.6, abs=1e-13)


def test_a_force_with_a_jump():
    """Little damping, so the loss is the work of the damping along the motion without it."""
    k, c, jump, f, mass, speed = 613.4, 0.1838, 1.67e-5, 0.739, 0.0725, 0.12
    contact = Contact(lambda x, v: k * x**2 + c * x * v + np.where(x > jump, f, 0), mass)

    def square(x):
        return speed**2 - 2 / mass * (k * x**3 / 3 + f * max(x - jump, 0))

    deepest = brentq(square, jump, 1)
    work = 2 * quad(lambda x: c * x * math.sqrt(max(square(x), 0)), 0, deepest)[0]
    assert 1 - contact.collide(speed).epsilon == pytest.approx(work / mass / speed**2, rel=1e-3)


@pytest.mark.parametrize(
    ("force", "speed", "g", "end", "deepest", "duration"),
    [
        (lambda x, v: np.where(x < 1e-3, 1e5 * x, 0), 0.1, 0, "force", 0.1 / 1e5**0.5, math.pi / 1e5**0.5),
        (lambda x, v: np.where(x < 1e-3, 2e6 * x, 0), 1, 0, "return", 1 / 2e6**0.5, math.pi / 2e6**0.5),
        (lambda x, v: np.where(x < 1e-3, 501, 0), 1, 0, "force", 0.5 / 501, 2 / 501),
        (lambda x, v: np.where(x < 1e-3, 600, 0), 1, 9.81, "force", 0.5 / 590.19, 2 / 590.19),
        (lambda x, v: np.where((x > 0.1) & (x < 0.2), 10, 0), 1, 0, "return", 0.15, 0.1 + 2 / 10),
        (lambda x, v: np.where(x > 1, 1e3, 0), 1, 0, "force", 1 + 0.5e-3, 1 + 2 / 1e3),
        (lambda x, v: np.where(x > 1, 1e5 * x, 0), 1, 0, "force", (1 + 1e-5) ** 0.5, 1 + 2e-5),
    ],
)
def test_a_force_of_finite_range_or_with_a_gap(force, speed, g, end, deepest, duration):
    """Springs and constant forces without damping: eps is 1, and the bodies turn where their energy is used up."""
    found = Contact(force, load=g, end=end).collide(speed)
    assert found.epsilon == pytest.approx(1, abs=1e-6)
    assert found.depth == pytest.approx(deepest, rel=1e-9)
    assert found.duration == pytest.approx(duration, rel=1e-6)


def test_a_load_of_a_million_times_the_force():
    found = Contact(lambda x, v: x, load=1e6).collide()
    assert found.epsilon == pytest.approx(1, abs=1e-3)
    assert found.depth == pytest.approx(1e6 + math.hypot(1e6, 1), rel=1e-9)


@pytest.mark.parametrize("start", [0.04, 0.1, 10])
@pytest.mark.parametrize("g", [0, 9.81])
@pytest.mark.parametrize("c", [0, 40])
def test_a_spring_from_some_compression_on(start, g, c):
    """Free flight to the spring; there SciPy's integrator, up to where the force vanishes; free flight to x = 0."""
    k, before = 1e5, math.sqrt(1 + 2 * g * start)

    def turns(t, y):
        return y[1]

    def vanishes(t, y):
        return k * y[0] + c * y[1] if y[1] < 0 else 1.0

    vanishes.terminal = True
    path = solve_ivp(
        lambda t, y: (y[1], g - k * y[0] - c * y[1]),
        (0, 1),
        (0, before),
        events=(turns, vanishes),
        rtol=1e-11,
        atol=1e-14,
    )
    x, v = path.y[:, -1]
    square = v * v - 2 * g * (start + x)
    found = Contact(lambda x, v: np.where(x > start, k * (x - start) + c * v, 0), load=g).collide()
    assert found.parts == (square > 0)
    assert found.epsilon == pytest.approx(math.sqrt(max(square, 0)), abs=1e-6)
    assert found.depth == pytest.approx(start + path.y_events[0][0][0], rel=1e-8)
    if found.parts:
        flight = (before - 1) / g if g else start
        assert found.duration == pytest.approx(flight + path.t[-1], rel=1e-5)


@pytest.mark.parametrize("step", [None, 1e-4])
@pytest.mark.parametrize("force", [lambda x, v: 499, lambda x, v: 100 + 600 * v], ids=["constant", "damping"])
def test_a_force_of_finite_range_that_does_not_stop_a_body(force, step):
    """In 1 mm they take less than the body's 0.5 J; with v = 1, which falls, the second would take 0.7 J."""
    contact = Contact(lambda x, v: np.where(x < 1e-3, force(x, v), 0))
    with pytest.raises(ValueError, match="force does not stop a body of mass 1 at speed 1"):
        contact.collide(step=step)


@pytest.mark.parametrize("mass", [1.0, 2.0])
@pytest.mark.parametrize("load", [0.0, 3.0])
def test_a_force_of_the_approach_alone_does_not_part_bodies(mass, load):
    contact = Contact(lambda x, v: np.where(v < 0, 0, 1e5 * x), mass, load)
    found = contact.collide()
    assert (found.epsilon, found.parts, found.duration) == (0, False, math.inf)
    deepest = (load + math.sqrt(load**2 + 1e5 * mass)) / 1e5
    assert found.depth == pytest.approx(deepest, rel=1e-9)


@pytest.mark.parametrize("kappa", [10, 38, 50, 1e3, 1e6])
@pytest.mark.parametrize(("k", "mass", "speed"), [(1, 1, 1), (5e5, 1, 1), (106.4, 3.09, 1.1), (2.4e8, 1e-6, 0.15)])
def test_strong_damping(kappa, k, mass, speed):
    """Hunt-Crossley: the speed tends to that at which the force vanishes, v/kappa; eps by Lambert's function."""
    true = (1 + lambertw(-(1 + kappa) * math.exp(-(1 + kappa))).real) / kappa
    c = k * kappa / speed
    found = Contact(lambda x, v: k * x + c * x * v, mass).collide(speed)
    assert found.epsilon == pytest.approx(true, rel=1e-10)
    assert found.duration + found.errors["duration"] > kappa * found.depth / speed


@pytest.mark.parametrize(("epsilon", "least"), [("0.9", 1.24), ("0.7", 0.50), ("0.5", 0.25)])
def test_enough_weight_keeps_a_body_down(epsilon, least):
    law = law_of("viscoelastic", "return")
    kappa = kappa_of(law, epsilon)
    assert Contact.of_law(law, kappa, 0.97 * least).collide().parts
    down = Contact.of_law(law, kappa, 1.04 * least).collide()
    assert (down.parts, down.epsilon, down.duration) == (False, 0, math.inf)
    stepped = Contact.of_law(law, kappa, 1.04 * least).collide(step=0.02)
    assert (stepped.parts, stepped.epsilon, stepped.duration) == (False, 0, math.inf)


@pytest.mark.parametrize(
    "contact",
    [
        Contact.of_law(law_of("linear", "return"), 2.5),
        Contact.of_law(law_of("3/2,0", "return"), 3),
        Contact.of_law(law_of("linear", "return"), 3, 0.5),
        Contact(lambda x, v: 2.0 * v),
    ],
)
def test_bodies_that_creep_do_not_part(contact):
    found = contact.collide()
    assert (found.parts, found.epsilon) == (False, 0)


@pytest.mark.parametrize("name", ["viscoelastic", "linear", "3/2,0"])
@pytest.mark.parametrize("end", ["force", "return"])
def test_heavy_bodies_and_strong_damping(name, end):
    for kappa in (1e-2, 1, 100):
        for load in (1e3, 1e6):
            found = Contact.of_law(law_of(name, end), kappa, load).collide()
            assert (found.parts, found.epsilon) == (False, 0)
        pulled = Contact.of_law(law_of(name, end), kappa, -1e3).collide()
        assert pulled.parts
        assert pulled.epsilon == pytest.approx(1, abs=1e-2 * kappa)


def test_units_change_nothing():
    scaled = Contact.of_law("viscoelastic", 0.4, 0.05).collide()
    mass, rho, speed = 3e-6, 4e5, 0.02
    length = (mass / rho) ** 0.4 * speed**0.8
    force = mass * speed**2 / length
    c = 0.4 * force / length**0.5 / speed
    found = Contact(lambda x, v: rho * x**1.5 + c * np.sqrt(x) * v, mass=mass, load=0.05 * force).collide(speed)
    assert found.epsilon == pytest.approx(scaled.epsilon, rel=1e-12)
    assert found.depth == pytest.approx(scaled.depth * length, rel=1e-12)
    assert found.duration == pytest.approx(scaled.duration * length / speed, rel=1e-12)


def test_a_call_is_quick():
    contact = Contact.of_law("viscoelastic", 0.4, 0.05)
    spent = []
    for _ in range(10):
        start = time.process_time()
        contact.collide()
        spent.append(time.process_time() - start)
    assert min(spent) < 0.02


# --- integrators ------------------------------------------------------------------------------------------------------

NEWTON = Contact(lambda x, v: 1e5 * x + 1e3 * np.maximum(v, 0))


def test_semi_implicit_euler_is_what_newton_computes():
    """Newton 1.8.0's semi-implicit solver, a sphere on a plane, ke = 1e5, kd = 1e3, m = 1 kg, 1 m/s."""
    assert NEWTON.collide().epsilon == pytest.approx(0.263964, abs=1e-6)
    for step, expected in ((1e-4, (0.2522, 0.2392, 0.2653)), (1e-3, (0.1601, 0.0025, 0.3177))):
        found = NEWTON.collide(step=step, phases=PHASES)
        assert (found.epsilon, found.least, found.largest) == pytest.approx(expected, abs=6e-5)
    falls = Contact(NEWTON.force, load=9.81).collide(step=1e-4)
    assert (falls.epsilon, falls.least, falls.largest) == pytest.approx((0.2248, 0.2116, 0.2380), abs=1e-3)


@pytest.mark.parametrize("g", [0.0, 9.81])
def test_the_range_over_all_phases_is_that_of_a_plain_loop(g):
    """Newton's map at 1 ms, with the limits of first contact at both ends of a step."""
    h, found = 1e-3, []
    for before in h * np.concatenate(([0], np.linspace(1e-4, 1 - 1e-12, 3000))):
        x, v, force = g / 2 * before**2 - before, 1 - g * before + g * h / 2, 1.0
        for _ in range(100):
            x += h * v
            force = 1e5 * x + 1e3 * max(v, 0) if x > 0 else 0.0
            v += h * (g - force)
            if x <= 0 and v < 0:
                found.append(math.sqrt((v - g * h / 2) ** 2 - 2 * g * x))
                break
        else:
            found.append(0.0)
    collision = Contact(NEWTON.force, load=g).collide(step=h)
    assert (collision.least, collision.largest) == pytest.approx((min(found), max(found)), abs=2e-4)
    assert collision.least <= min(found) + 1e-9
    assert collision.largest >= max(found) - 1e-9


@pytest.mark.parametrize("scheme", [SEMI_IMPLICIT, IMPLICIT, RUNGE_KUTTA], ids=lambda scheme: scheme.name)
@pytest.mark.parametrize("law", NAMED[::3], ids=identity)
def test_no_phase_is_outside_of_the_range(law, scheme):
    for step, load in ((0.1, 0.0), (0.5, 0.1), (1.5, 0.0)):
        contact = Contact.of_law(law, 0.4, load)
        found = contact.collide(step=step, scheme=scheme)
        epsilon = contact.rebounds(1.0, step, np.linspace(0, 1 - 1e-12, 3001), scheme).epsilon
        assert found.least - 5e-6 < epsilon.min() < found.least + 2e-3
        assert found.largest - 2e-3 < epsilon.max() < found.largest + 5e-6


def test_time_steps_do_not_need_the_solution_without_them(monkeypatch):
    expected = NEWTON.collide(step=1e-3)
    monkeypatch.delattr("viscopade.collision.contact._without_steps")
    assert NEWTON.collide(step=1e-3) == expected


def test_forward_euler_is_what_kratos_computes():
    """Kratos's own restitution test, a Hertz contact with e = 0.5, in steps of 0.0163813 contact times."""
    kappa, step = kappa_of(law_of("tsuji"), "0.5"), 0.0163813 * 3.218
    found = Contact.of_law("tsuji", kappa).collide(step=step, scheme=FORWARD)
    assert (found.epsilon, found.least, found.largest) == pytest.approx((0.5459, 0.5446, 0.5485), abs=6e-5)
    assert Contact.of_law("tsuji", kappa).collide(step=step).epsilon == pytest.approx(0.4983, abs=6e-5)


def test_velocity_verlet_that_carries_its_force_is_the_same_map():
    """And the kick and the drift in the other order: the first step is shorter, the map is the same."""
    assert SCHEMES["velocity-verlet"] is SEMI_IMPLICIT
    kappa, h, g, phase = 0.4, 0.05, 0.02, 0.3
    x, v, a = -phase * h + g / 2 * (phase * h) ** 2, 1 - g * phase * h, g
    while x > 0 or v > 0:
        half = v + h / 2 * a
        x += h * half
        a = g - (max(x**1.5 + kappa * x**0.5 * half, 0) if x > 0 else 0)
        v = half + h / 2 * a
    found = Contact.of_law("viscoelastic", kappa, g).collide(step=h, phases=[phase])
    assert found.epsilon == pytest.approx(math.sqrt(v * v - 2 * g * x), rel=1e-12)


@pytest.mark.parametrize(
    "scheme", [SEMI_IMPLICIT, FORWARD, TAYLOR, IMPLICIT, RUNGE_KUTTA], ids=lambda scheme: scheme.name
)
@pytest.mark.parametrize("load", [0.0, 0.05])
def test_fine_steps_lead_to_the_equation_of_motion(scheme, load):
    contact = Contact.of_law("hunt-crossley:1", 0.4, load)
    limit = contact.collide()
    coarse, fine = (contact.collide(step=h, scheme=scheme) for h in (8e-3, 4e-3))
    assert 2 * fine.epsilon - coarse.epsilon == pytest.approx(limit.epsilon, abs=4e-5)
    assert fine.depth == pytest.approx(limit.depth, abs=4e-3)
    assert fine.duration == pytest.approx(limit.duration, abs=1.2e-2)


def test_free_flight_changes_no_eps():
    """Without damping, and where the load is of the size of the step's kick: eps is 1 to the order of the scheme."""
    for scheme in (SEMI_IMPLICIT, RUNGE_KUTTA):
        found = Contact.of_law("linear", 0, 0.3).collide(step=0.01, scheme=scheme)
        assert max(found.largest - 1, 1 - found.least) < 5e-5


def test_implicit_steps_are_solved():
    """A step of a Hunt-Crossley contact is a quadratic equation for the velocity after it."""
    x, v, h, kappa = np.array([0.4]), np.array([0.7]), np.array([0.5]), 1.4
    after_x, w, newest = IMPLICIT.step(x, v, h, lambda x, v: -np.where(x > 0, np.maximum(x + kappa * x * v, 0), 0))
    assert after_x == pytest.approx(x + h * w)
    assert newest == pytest.approx((w - v) / h, abs=1e-13)
    roots = np.roots([h[0] ** 2 * kappa, 1 + h[0] * (h[0] + kappa * x[0]), h[0] * x[0] - v[0]])
    assert w[0] == pytest.approx(max(roots), abs=1e-14)


def test_substeps_are_shorter_steps():
    contact = Contact.of_law("linear", 0.4)
    assert contact.collide(step=0.2, substeps=10) == contact.collide(step=0.02)


@pytest.mark.parametrize("law", NAMED[:8], ids=identity)
@pytest.mark.parametrize("step", [0.05, 0.4])
def test_the_range_over_phases_is_within_its_estimate(law, step):
    contact = Contact.of_law(law, 0.4)
    found, many = contact.collide(step=step), contact.collide(step=step, phases=np.arange(0.5, 4096) / 4096)
    assert found.least <= found.epsilon <= found.largest
    for name in ("epsilon", "least", "largest", "depth", "duration"):
        assert abs(getattr(found, name) - getattr(many, name)) < 100 * found.errors[name] + 1e-12


def test_the_undamped_contact_time():
    """Of a linear spring pi sqrt(m/k), of Hertz's 2.9432751 x_max/v."""
    linear = Contact(lambda x, v: 5e5 * x * (1 + 50 * v), mass=2.0, load=3.0)
    assert linear.contact_time(0.3) == pytest.approx(math.pi * math.sqrt(2 / 5e5), rel=1e-9)
    hertz = Contact(lambda x, v: 1e6 * x**1.5 + np.sqrt(x) * v, mass=0.1)
    deepest = (5 / 4 * 0.1 * 0.3**2 / 1e6) ** 0.4
    assert hertz.contact_time(0.3) == pytest.approx(2.9432751 * deepest / 0.3, rel=1e-7)
    late = Contact(lambda x, v: 1e5 * np.maximum(x - 10, 0), load=9.81)
    assert late.contact_time(1.0) == pytest.approx(math.pi / math.sqrt(1e5), rel=1e-4)


def test_a_contact_that_a_step_resolves():
    def family(c):
        return Contact(lambda x, v: 2500 * x + c * v)

    step = 0.01
    c = damping_factor(family, 0.5, 10.0, step=step)
    found = family(c).collide(step=step)
    assert found.largest - found.least > 0.02
    factor = resolving_factor(family, 0.5, c, 0.02, step=step)

    def longer(c):  # mass over stiffness, and mass over damping, grow
        return Contact(lambda x, v: 2500 / factor**2 * x + c * v)

    c = damping_factor(longer, 0.5, 10 / factor, step=step)
    found = longer(c).collide(step=step)
    assert found.epsilon == pytest.approx(0.5, abs=1e-9)
    assert 0.01 < found.largest - found.least <= 0.02


# --- the inverse ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("law", NAMED[:8], ids=identity)
def test_the_damping_of_an_eps(law):
    found = damping_factor(lambda kappa: Contact.of_law(law, kappa), 0.5, near=1.0)
    again = damping_factor(lambda kappa: Contact.of_law(law, kappa), 0.5, near=1.0001 * found)
    assert [found, again] == pytest.approx([kappa_of(law, "0.5")] * 2, rel=1e-11)
    heavy = damping_factor(lambda kappa: Contact.of_law(law, kappa, 0.1), 0.5, near=1.0)
    assert Contact.of_law(law, heavy, 0.1).collide().epsilon == pytest.approx(0.5, abs=1e-12)
    stepped = damping_factor(lambda kappa: Contact.of_law(law, kappa), 0.5, near=1.0, step=0.1)
    assert Contact.of_law(law, stepped).collide(step=0.1).epsilon == pytest.approx(0.5, abs=1e-12)


def test_an_eps_that_no_damping_gives():
    with pytest.raises(ValueError, match=r"epsilon is 0.9: expected at most 0\.\d+"):
        damping_factor(lambda c: Contact.of_law("linear", c), 0.9, near=0.1, step=0.5, scheme=IMPLICIT)


# --- the user's function ----------------------------------------------------------------------------------------------


def in_place(x, v):
    """Damping of the approach, by a function that changes its arguments."""
    np.maximum(v, 0, out=v)
    x += 0.3 * v
    return x


@pytest.mark.parametrize("step", [None, 0.02])
def test_a_force_that_changes_its_arguments(step):
    expected = Contact(lambda x, v: x + 0.3 * np.maximum(v, 0)).collide(step=step)
    assert Contact(in_place).collide(step=step) == expected
    assert expected.epsilon > 0.8


@pytest.mark.parametrize("step", [None, 0.02])
@pytest.mark.parametrize("load", [0.0, 0.05])
def test_a_force_in_single_precision(step, load):
    def force(x, v):
        return x**1.5 + 0.4 * np.sqrt(x) * v

    def single(x, v):
        return force(x.astype(np.float32), v.astype(np.float32))

    found = Contact(single, np.float32(1), load).collide(np.float32(1), step=step and np.float32(step))
    expected = Contact(force, load=load).collide(step=step)
    assert found.epsilon == pytest.approx(expected.epsilon, abs=1e-6)
    assert abs(found.epsilon - expected.epsilon) < 100 * found.errors["epsilon"]


@pytest.mark.parametrize("step", [None, 0.02])
@pytest.mark.parametrize(
    "force",
    [
        lambda x, v: x + 0.1j * v,
        lambda x, v: 10**400,
        lambda x, v: "1",
        lambda x, v: x.astype(np.float16),
        lambda x, v: [1.0, 2.0],
        lambda x, v: [object()] * len(x),
    ],
)
def test_what_is_no_force(force, step):
    with pytest.raises(
        ValueError, match=r"the force is .*: expected a real number in single or double precision"
    ) as error:
        Contact(force).collide(step=step)
    assert "\n" not in str(error.value)


# --- refusals ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Contact(lambda x, v: x, mass=-1), "mass is -1.*a finite number > 0"),
        (lambda: Contact(lambda x, v: x, mass=math.inf), "mass is inf"),
        (lambda: Contact(lambda x, v: x, load=math.nan), "load is nan.*a finite number"),
        (lambda: Contact(lambda x, v: x, end="late"), "end is 'late'.*'force', 'return' or 'break'"),
        (lambda: Contact(lambda x, v: x).collide(0), "speed is 0.*a finite number > 0"),
        (lambda: Contact(lambda x, v: x).collide(1e-200), "speed is 1e-200, mass is 1: expected m v"),
        (lambda: Contact(lambda x, v: x, mass=1e-100).collide(1e200), r"speed is 1e\+200, mass is 1e-100: expected"),
        (lambda: Contact(lambda x, v: x, mass=1e-250).collide(1e-60), "speed is 1e-60, mass is 1e-250: expected"),
        (lambda: Contact(lambda x, v: x).collide(step=1e-9), "step is 1e-09: expected a number >= .* 100000 steps"),
        (lambda: Contact(lambda x, v: x).collide(step=math.nan), "step is nan"),
        (lambda: Contact(lambda x, v: x).collide(step=0.1, phases=[2]), "phases is 2.0"),
        (lambda: Contact(lambda x, v: x).collide(step=0.1, phases=[]), "phases is empty"),
        (lambda: Contact(lambda x, v: 1e300 * x).collide(step=1e300), r"step is 1e\+300: expected a smaller one"),
        (lambda: Contact(lambda x, v: x).collide(step=0.1, substeps=0), "substeps is 0.*an integer from 1"),
        (lambda: damping_factor(lambda c: Contact.of_law("linear", c), 1.0, near=0.1), "epsilon is 1.0.*> 0 and < 1"),
        (lambda: damping_factor(lambda c: Contact.of_law("linear", c), 0.5, near=0), "near is 0.*finite number > 0"),
        (
            lambda: Contact(lambda x, v: 0 * x).collide(),
            "force does not stop a body of mass 1 at speed 1: expected a function",
        ),
        (lambda: Contact(lambda x, v: x, load=1e300).collide(1e-3), "force"),
        (lambda: Contact(lambda x, v: np.where(x < 0.5, x, np.nan)).collide(), "force"),
        (
            lambda: Contact(lambda x, v: np.where(x > 1, 1e10 * x, 0)).collide(),
            r"gives eps = .* with an error of 0\.\d+ at speed 1: expected a smoother force, or a time step",
        ),
    ],
)
def test_refusals(make, message):
    with pytest.raises(ValueError, match=message):
        make()
    with pytest.raises(TypeError, match="force is 3: expected a function"):
        Contact(3)
    with pytest.raises(TypeError, match="scheme is 'verlet': expected a Scheme, such as SCHEMES"):
        Contact(lambda x, v: x).collide(step=0.1, scheme="verlet")
    with pytest.raises(TypeError, match=r"substeps is 2\.5: expected an integer"):
        Contact(lambda x, v: x).collide(step=0.1, substeps=2.5)


def test_bodies_that_stay_are_seen_to_stay_before_long():
    """With 200 steps in a contact: a body that oscillates, and one that creeps."""
    counted = []
    scheme = replace(SEMI_IMPLICIT, step=lambda *state: counted.append(1) or SEMI_IMPLICIT.step(*state))
    for damping, most in ((20, 1200), (2000, 20_000)):
        contact = Contact(lambda x, v, c=damping: 1e5 * x + c * v, load=1e3)
        counted.clear()
        found = contact.collide(0.05, step=5e-5, scheme=scheme, phases=PHASES)
        assert (found.epsilon, found.parts) == (0, False)
        assert len(counted) < most
