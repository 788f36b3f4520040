"""Contacts with a neck, which pulls until it breaks: energy, closed forms, SciPy, and a plain loop of steps."""

import math

import numpy as np
import pytest
from mpmath import mp
from scipy.integrate import quad, solve_ivp

from viscopade import Contact
from viscopade.collision.adhesion import sticking
from viscopade.collision.contact import damping_factor
from viscopade.collision.schemes import IMPLICIT, RUNGE_KUTTA, SEMI_IMPLICIT

# JKR in units of a_0^2/R and 4 E a_0^3/(3 R): x = z^4 - z and F = z^6 - 3/2 z^3 with z = (a/a_0)^(1/2)
TURN, PULL = 0.25 ** (1 / 3), 0.75 ** (1 / 3)  # z where dx/dz = 0, and where the pull is largest
BREAKS = {name: z**4 - z for name, z in {"dx/da = 0": TURN, "largest pull": PULL}.items()}


def root(x):
    """Return z of a compression by bisection, which shares nothing with the quartic's formulas."""
    low, high = np.full_like(x, TURN), 2 + np.abs(x) ** 0.25
    for _ in range(60):
        z = (low + high) / 2
        low, high = np.where(z**4 - z < x, z, low), np.where(z**4 - z < x, high, z)
    return (low + high) / 2


def jkr(x, v):
    return damped(0)(x, v)


def damped(c):
    """JKR with a damping in proportion to the contact radius."""
    return lambda x, v: (z := root(x)) ** 6 - 1.5 * z**3 + c * z**2 * v


def work(z):
    """Return the work of the neck from a z to 1, which is first contact, by quadrature in z."""
    return -quad(lambda z: (z**6 - 1.5 * z**3) * (4 * z**3 - 1), z, 1, epsabs=1e-15)[0]


@pytest.mark.parametrize(("name", "z"), [("dx/da = 0", TURN), ("largest pull", PULL)])
def test_an_elastic_neck_costs_its_energy(name, z):
    contact, lost = Contact(jkr, end="break", break_at=BREAKS[name]), work(z)
    assert contact.neck_energy == pytest.approx(lost, rel=1e-11)
    slowest = math.sqrt(2 * lost)
    assert sticking(lambda speed: contact, 1.0) == pytest.approx((slowest, lost), rel=1.01e-4)
    for speed in (1.00001 * slowest, 1.0, 1e4):
        collision = contact.collide(speed)
        assert collision.epsilon == pytest.approx(math.sqrt(1 - 2 * lost / speed**2), abs=1e-9)
        assert collision.errors["epsilon"] < 1e-8
    below = contact.collide(0.99 * slowest)
    assert (below.epsilon, below.parts, below.duration) == (0, False, math.inf)


@pytest.mark.parametrize("ratio", [0.0, 0.01, 0.1, 0.3])
@pytest.mark.parametrize("length", [1e-6, 0.1, 0.4])
def test_a_linear_spring_has_a_closed_form(ratio, length):
    """x = exp(-ratio t) sin(w t)/w holds through x = 0 as far as the neck holds."""
    collision = Contact(lambda x, v: x + 2 * ratio * v, end="break", break_at=-length).collide()
    with mp.workdps(30):
        w = mp.sqrt(1 - mp.mpf(ratio) ** 2)
        position = lambda t: mp.exp(-ratio * t) * mp.sin(w * t) / w  # noqa: E731
        least = (mp.pi + mp.acos(mp.mpf(ratio))) / w  # time of the second turn
        if position(least) > -length:
            assert not collision.parts
            return
        time = mp.findroot(lambda t: position(t) + length, (mp.pi / w, least), solver="anderson")
        epsilon = -mp.diff(position, time)
    assert collision.epsilon == pytest.approx(float(epsilon), abs=1e-11)
    assert collision.duration == pytest.approx(float(time), rel=1e-9)


def second_route(contact, speed):
    """Return eps by SciPy's integrator, stopped at x = 0, at turns and where the neck breaks."""
    neck = contact.break_at if callable(contact.break_at) else lambda x, v: x - contact.break_at
    g, x, v, returns = contact.load / contact.mass, contact.begin, speed, False

    def rates(t, state):
        return state[1], g - float(contact.force(*np.reshape(state, (2, 1)))[0]) / contact.mass

    def event(function, direction):
        function.terminal, function.direction = True, direction
        return function

    level = event(lambda t, state: state[0], 0)
    turn, turn_back = (event(lambda t, state: state[1], direction) for direction in (-1, 1))
    breaks = event(lambda t, state: 1 if state[0] >= contact.begin else neck(*state), -1)
    while not (returns and x < contact.begin and neck(x, v) <= 0):
        events = (level, breaks, turn_back) if returns else (level, turn)
        run = solve_ivp(rates, (0, 99), (x, v), method="DOP853", rtol=1e-13, atol=1e-15, events=events, first_step=1e-6)
        x, v = run.y[:, -1]
        if run.t_events[0].size:
            x = 1e-13 * v  # on the other side of x = 0
        elif not returns:
            returns, v = True, -1e-300
        elif not run.t_events[1].size:
            return 0.0
        else:
            break
    return math.sqrt(v * v - 2 * g * (x - contact.begin)) / speed


def hertz(x):
    return np.maximum(x, 0) ** 1.5


NECKS = {
    "damped JKR": Contact(damped(0.1), end="break", break_at=BREAKS["largest pull"]),
    "damped JKR, dx/da = 0": Contact(damped(0.05), end="break", break_at=BREAKS["dx/da = 0"]),
    "with a load": Contact(damped(0.05), 2.0, 0.2, end="break", break_at=BREAKS["largest pull"]),
    "with a load that lifts": Contact(damped(0.05), load=-0.2, end="break", break_at=BREAKS["largest pull"]),
    "a kink at x = 0": Contact(
        lambda x, v: hertz(x) - 0.2 * np.where(x > 0, 1, 1 + 2 * x) + 0.1 * v, end="break", break_at=-0.5
    ),
    "the same way back": Contact(
        lambda x, v: hertz(x) - 0.2 * np.where(x > 0, 1, 1 + 2 * x) + 0.1 * v, end="break", begin=-0.5, break_at=-0.5
    ),
    "a gap": Contact(lambda x, v: x - 0.2 + 0.1 * v, end="break", begin=0.1, break_at=-0.3),
    "a function": Contact(damped(0.05), end="break", break_at=lambda x, v: x + 0.1 + 0.05 * v),
}


@pytest.mark.parametrize("name", NECKS)
def test_necks_agree_with_scipy(name):
    contact = NECKS[name]
    for speed in (1.3, 4.0):
        collision, theirs = contact.collide(speed), second_route(contact, speed)
        assert collision.parts
        assert abs(collision.epsilon - theirs) < 3e-12
        assert collision.errors["epsilon"] < 1e-10


@pytest.mark.parametrize("name", ["damped JKR", "a kink at x = 0", "the same way back", "a gap", "a function"])
@pytest.mark.parametrize("scheme", [SEMI_IMPLICIT, RUNGE_KUTTA], ids=lambda scheme: scheme.name)
def test_fine_steps_lead_to_the_equation_of_motion(name, scheme):
    """Runge-Kutta's method is of first order here, too: no step ends where contact begins, or where the neck breaks."""
    contact, h = NECKS[name], 1e-2 if "JKR" in name or "function" in name else 1e-3
    stepped = contact.collide(1.3, step=h, scheme=scheme, phases=[0.2, 0.7])
    assert stepped.epsilon == pytest.approx(contact.collide(1.3).epsilon, abs=0.3 * h)


@pytest.mark.parametrize(("begin", "phase"), [(0.0, 0.3), (0.0, 0.9), (-0.2, 0.5)])
def test_steps_remember_that_a_neck_has_formed(begin, phase):
    """A drift and a kick, as velocity Verlet with a history: approaching bodies feel nothing at x < begin."""
    c, h, break_at, speed = 0.05, 0.02, -0.22, 1.2
    x, v, formed = begin - phase * h * speed, speed, False
    while v > 0 or formed:
        x += h * v
        formed = x > begin or (formed and x > break_at)
        if formed:
            v -= h * float(damped(c)(np.array([x]), np.array([v]))[0])
    contact = Contact(damped(c), end="break", begin=begin, break_at=break_at)
    assert contact.rebounds(speed, h, phase).epsilon == pytest.approx(-v / speed, rel=1e-12)


@pytest.mark.parametrize(
    ("function", "lowest"),
    [
        (lambda x, v: x - 0.1, 0.0),
        (lambda x, v: v + 0.5, 0.0),
        (lambda x, v: np.nan * x, 0.0),
        (lambda x, v: np.where(x > -0.3, 1, np.nan), -0.3),
    ],
)
def test_a_neck_without_value_is_broken_and_none_breaks_before_it_has_formed(function, lowest):
    """An elastic spring loses x^2/2 up to the lowest compression; what the function says at x > 0 does not count."""
    contact = Contact(lambda x, v: x, end="break", break_at=function)
    assert contact.collide(1.0).epsilon == pytest.approx(math.sqrt(1 - lowest**2), abs=1e-10)
    assert contact.collide(1.0, step=1e-3, phases=[0.3]).epsilon == pytest.approx(math.sqrt(1 - lowest**2), abs=1e-3)


def test_a_longer_contact_and_the_damping_of_an_eps():
    contact = NECKS["damped JKR"]
    assert contact.softened(3.0).collide(1.3).epsilon == pytest.approx(contact.collide(1.3).epsilon, abs=1e-11)
    longer = NECKS["a function"].softened(3.0).collide(1.3)
    assert longer.epsilon == pytest.approx(NECKS["a function"].collide(1.3).epsilon, abs=1e-11)
    elastic = Contact(jkr, end="break", break_at=BREAKS["largest pull"])
    assert contact.contact_time(1.3) == pytest.approx(elastic.collide(1.3).duration, rel=1e-12)
    c = damping_factor(lambda c: Contact(damped(c), end="break", break_at=BREAKS["largest pull"]), 0.5, 0.1, speed=1.3)
    assert second_route(Contact(damped(c), end="break", break_at=BREAKS["largest pull"]), 1.3) == pytest.approx(0.5)


def spring(**arguments):
    return Contact(lambda x, v: x, **arguments)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: spring(end="break"), "end is 'break', begin 0, break_at None: expected begin and break_at with"),
        (lambda: spring(break_at=-0.1), "end is 'force', begin 0, break_at -0.1: expected"),
        (lambda: spring(end="return", begin=0.1), "end is 'return', begin 0.1, break_at None: expected"),
        (lambda: spring(end="break", break_at=0.1), "break_at is 0.1: expected a finite number < 0, or a function"),
        (lambda: spring(end="break", break_at=-0.1, begin=-0.2), "begin is -0.2: expected at least break_at, -0.1"),
        (lambda: spring(end="break", break_at=-0.1, begin=math.nan), "begin is nan: expected a finite number"),
        (
            lambda: spring(end="break", break_at=-0.1).collide(step=0.1, scheme=IMPLICIT),
            "implicit Euler, and the contact has a neck: expected an explicit scheme",
        ),
        (
            lambda: Contact(lambda x, v: hertz(x), end="break", break_at=lambda x, v: 0 * x + 1).collide(),
            "break_at is still > 0 at compression -.* and rate -.*: expected a function that is 0 where a neck breaks",
        ),
        (
            lambda: spring(end="break", break_at=lambda x, v: x > 0 and v).collide(),
            "The truth value of an array|ambiguous",
        ),
        (lambda: spring(end="break", break_at=lambda x, v: "no").collide(), "break_at is .*expected a real number"),
        (lambda: spring(end="break", break_at=lambda x, v: x).neck_energy, "break_at is a function: expected a comp"),
    ],
)
def test_refusals(make, message):
    with pytest.raises(ValueError, match=message):
        make()
