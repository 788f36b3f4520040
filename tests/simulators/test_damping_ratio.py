"""Damping ratios of springs whose eps does not depend on the speed: closed forms, and the motion integrated in time."""

import math

import mpmath
import pytest

from tests.simulators.two_balls import integrated, setup
from viscopade import Pair, Sphere
from viscopade.simulators import stated
from viscopade.simulators.formula import ratio_at_force_end, ratio_for_return
from viscopade.simulators.setup import NamedContact, Setup

RATIOS = {"force": ratio_at_force_end, "position": ratio_for_return}


@pytest.mark.parametrize("end", RATIOS)
@pytest.mark.parametrize("epsilon", [0.97, 0.6, math.exp(-2), 0.05])
def test_tsuji_damping_integrated_in_time(epsilon, end):
    case = setup(epsilon)
    pair = case.contacts[0].pair
    alpha = math.sqrt(5) * float(RATIOS[end](mpmath.mpf(epsilon)))

    def force(x, u):
        return pair.rho * x**1.5 + alpha * math.sqrt(pair.m_eff * pair.rho) * x**0.25 * u

    for speed in (0.01, 1.0):
        assert integrated(force, case, speed, end) == pytest.approx(epsilon, rel=1e-7)
    (other,) = RATIOS.keys() - {end}
    assert abs(integrated(force, case, 1.0, other) / epsilon - 1) > 1e-4


def test_a_clipped_force_is_the_end_at_zero_force():
    zeta, h = 0.5, 1e-4
    x, u = 0.0, 1.0
    while x >= 0:
        push = x**1.5 + math.sqrt(5) * zeta * x**0.25 * (u - h / 2 * x**1.5)
        u -= h * max(0.0, push)
        x += h * u
    assert float(ratio_at_force_end(mpmath.mpf(-u))) == pytest.approx(zeta, rel=1e-3)
    assert abs(float(ratio_for_return(mpmath.mpf(-u))) / zeta - 1) > 0.2


@pytest.mark.parametrize("epsilon", [1 - 2**-53, 1 - 1e-9, 0.9, 0.3, 0.1354, math.exp(-2), 0.1353, 0.01, 1e-30])
def test_the_ratio_at_the_force_end_against_the_closed_form(epsilon):
    zeta = ratio_at_force_end(mpmath.mpf(epsilon))
    with mpmath.workdps(60):
        closed = mpmath.re(2 * zeta * mpmath.acos(zeta) / mpmath.sqrt(mpmath.mpc(1 - zeta * zeta)))
        assert float(closed) == pytest.approx(float(-mpmath.log(mpmath.mpf(epsilon))), rel=4e-15, abs=0)
    assert ratio_at_force_end(mpmath.mpf(1)) == 0


BALL = Sphere(radius=0.01, density=2500, young_modulus=1e8, poisson_ratio=0.3, dissipative_constant=2e-5)
LARGE = Sphere(radius=0.02, density=2500, young_modulus=1e8, poisson_ratio=0.3, dissipative_constant=2e-5)
SIZES = (Pair(LARGE, LARGE), Pair(BALL, BALL))


def test_the_shortest_contact_is_that_of_the_smallest_sizes():
    contact = NamedContact("a", "a", Pair(LARGE, LARGE), 0.01, 0.2, 5.0, SIZES)
    both = Setup("t", {"a": LARGE}, (contact,))
    assert stated.shortest_contact(both) == Pair(BALL, BALL).contact_time(5.0)
