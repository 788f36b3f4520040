"""The x^(1/4) damping: closed forms against digits from mpmath and against the motion integrated in time."""

import math

import mpmath
import pytest

from tests.simulators.two_balls import integrated, setup
from viscopade import Pair, Sphere
from viscopade.collision import tsuji
from viscopade.simulators import stated
from viscopade.simulators.setup import NamedContact, Setup

ENDS = ("force", "position")


def decrement(zeta, end):
    """-ln eps to 40 digits; of another form than the code's."""
    with mpmath.workdps(60):
        z = mpmath.mpf(zeta)
        if end == "position":
            return mpmath.pi * z / mpmath.sqrt(1 - z * z)
        if z == 1:
            return mpmath.mpf(2)
        return mpmath.re(2 * z * mpmath.acos(z) / mpmath.sqrt(mpmath.mpc(1 - z * z)))


@pytest.mark.parametrize("end", ENDS)
@pytest.mark.parametrize("zeta", [1e-300, 1e-12, 0.1, 0.5, 0.9, 1 - 1e-9, 1 - 2**-53])
def test_eps_and_its_complement_against_digits(zeta, end):
    exact = decrement(zeta, end)
    if exact < 700:  # beyond it eps is not a normal number
        assert tsuji.epsilon(zeta, end) == pytest.approx(
            float(mpmath.exp(-exact)), rel=1e-15 * (4 + float(exact)), abs=0
        )
    assert tsuji.one_minus_epsilon(zeta, end) == pytest.approx(float(-mpmath.expm1(-exact)), rel=4e-15, abs=0)


@pytest.mark.parametrize("zeta", [1.0, 1 + 2**-52, 1 + 1e-9, 1.5, 30.0, 1e10, 1e150])
def test_beyond_critical_damping_only_the_force_ends_contact(zeta):
    exact = decrement(zeta, "force") if zeta < 1e100 else 2 * mpmath.log(2 * mpmath.mpf(zeta))
    assert tsuji.epsilon(zeta) == pytest.approx(float(mpmath.exp(-exact)), rel=1e-15 * (4 + float(exact)), abs=0)
    assert tsuji.epsilon(zeta, "position") == 0
    assert tsuji.one_minus_epsilon(zeta, "position") == 1


@pytest.mark.parametrize("end", ENDS)
@pytest.mark.parametrize("epsilon", [0.97, 0.6, math.exp(-2), 0.05])
def test_the_motion_integrated_in_time(epsilon, end):
    case = setup(epsilon)
    pair = case.contacts[0].pair
    alpha = math.sqrt(5) * tsuji.damping_ratio(epsilon, end=end)

    def force(x, u):
        return pair.rho * x**1.5 + alpha * math.sqrt(pair.m_eff * pair.rho) * x**0.25 * u

    for speed in (0.01, 1.0):
        assert integrated(force, case, speed, end) == pytest.approx(epsilon, rel=1e-7)
    other = ENDS[end == "force"]
    assert abs(integrated(force, case, 1.0, other) / epsilon - 1) > 1e-4


def test_a_clipped_force_is_the_end_at_zero_force():
    zeta, h = 0.5, 1e-4
    x, u = 0.0, 1.0
    while x >= 0:
        push = x**1.5 + math.sqrt(5) * zeta * x**0.25 * (u - h / 2 * x**1.5)
        u -= h * max(0.0, push)
        x += h * u
    assert -u == pytest.approx(tsuji.epsilon(zeta), rel=1e-3)
    assert abs(-u / tsuji.epsilon(zeta, "position") - 1) > 0.5


@pytest.mark.parametrize("end", ENDS)
@pytest.mark.parametrize(
    "epsilon", [1.0, 1 - 2**-53, 1 - 1e-9, 0.9, 0.3, 0.1354, math.exp(-2), 0.1353, 0.01, 1e-30, 1e-300, 5e-324]
)
def test_the_inverse_is_the_inverse(epsilon, end):
    zeta = tsuji.damping_ratio(epsilon, end=end)
    exact = -mpmath.log(mpmath.mpf(epsilon))
    if end == "position" and epsilon < 0.01:
        assert 0.8 < zeta < 1
        with mpmath.workdps(40):
            wanted = exact / mpmath.hypot(exact, mpmath.pi)
        assert zeta == pytest.approx(float(wanted), rel=1e-15, abs=0)
        return
    assert float(decrement(zeta, end)) == pytest.approx(float(exact), rel=4e-15, abs=0)


@pytest.mark.parametrize("end", ENDS)
def test_nearly_elastic_collisions(end):
    for loss in (1e-300, 1e-17, 1e-10):
        zeta = tsuji.damping_ratio(one_minus_epsilon=loss, end=end)
        assert zeta == pytest.approx(loss / math.pi, rel=2e-10, abs=0)
        assert tsuji.one_minus_epsilon(zeta, end) == pytest.approx(loss, rel=4e-15, abs=0)
    assert tsuji.damping_ratio(one_minus_epsilon=0, end=end) == 0
    assert math.copysign(1, tsuji.damping_ratio(1.0, end=end)) == 1
    assert math.copysign(1, tsuji.damping_ratio(one_minus_epsilon=-0.0, end=end)) == 1


@pytest.mark.parametrize(
    ("call", "error", "text"),
    [
        (lambda: tsuji.epsilon(-0.1), ValueError, "damping_ratio is -0.1: expected a finite number >= 0"),
        (lambda: tsuji.epsilon(math.inf), ValueError, "finite"),
        (lambda: tsuji.epsilon("0.1"), TypeError, "damping_ratio"),
        (lambda: tsuji.epsilon(0.1, "middle"), ValueError, "end is 'middle': expected 'force' or 'position'"),
        (lambda: tsuji.damping_ratio(0.0), ValueError, "epsilon is 0.0: expected a number > 0 and <= 1"),
        (lambda: tsuji.damping_ratio(1.1), ValueError, "epsilon is 1.1"),
        (lambda: tsuji.damping_ratio(math.nan), ValueError, "epsilon is nan"),
        (lambda: tsuji.damping_ratio(one_minus_epsilon=1.0), ValueError, "one_minus_epsilon is 1.0"),
        (lambda: tsuji.damping_ratio(), TypeError, "neither given"),
        (lambda: tsuji.damping_ratio(0.5, one_minus_epsilon=0.5), TypeError, "both given"),
        (lambda: tsuji.damping_ratio(0.5, end=None), ValueError, "end is None"),
    ],
)
def test_bad_input(call, error, text):
    with pytest.raises(error, match=text):
        call()


BALL = Sphere(radius=0.01, density=2500, young_modulus=1e8, poisson_ratio=0.3, dissipative_constant=2e-5)
LARGE = Sphere(radius=0.02, density=2500, young_modulus=1e8, poisson_ratio=0.3, dissipative_constant=2e-5)
SIZES = (Pair(LARGE, LARGE), Pair(BALL, BALL))


def test_the_shortest_contact_is_that_of_the_smallest_sizes():
    contact = NamedContact("a", "a", Pair(LARGE, LARGE), 0.01, 0.2, 5.0, SIZES)
    both = Setup("t", {"a": LARGE}, (contact,))
    assert stated.shortest_contact(both) == Pair(BALL, BALL).contact_time(5.0)
