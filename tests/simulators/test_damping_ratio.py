"""Damping ratios of springs whose eps does not depend on the speed: closed forms, and the motion integrated in time."""

import math

import mpmath
import pytest

from tests.simulators.two_balls import integrated, setup
from viscopade import Pair, Sphere
from viscopade.collision import exact
from viscopade.simulators import input_file
from viscopade.simulators.formula import (
    LINEAR,
    LINEAR_RETURN,
    TSUJI,
    TSUJI_RETURN,
    DampingFormula,
    kappa_for_epsilon,
    law_epsilon,
    ratio_at_force_end,
    ratio_for_return,
)
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
@pytest.mark.parametrize("law", [LINEAR, LINEAR_RETURN, TSUJI, TSUJI_RETURN], ids=lambda law: f"{law} {law.end}")
def test_closed_forms_against_the_proven_integration(epsilon, law):
    """That of the equation of motion of each law, which knows no closed form."""
    if law.end == "return" and epsilon == 1e-30:
        return  # contact lasts too long to be integrated
    kappa = exact.invert(repr(epsilon), 20, law=law).mpf()["kappa"]
    assert float(kappa_for_epsilon(law, repr(epsilon)) / kappa - 1) == pytest.approx(0, abs=1e-17)
    assert float(law_epsilon(law, kappa) / mpmath.mpf(repr(epsilon)) - 1) == pytest.approx(0, abs=1e-15)
    assert kappa_for_epsilon(law, "1") == ratio_at_force_end(mpmath.mpf(1)) == 0


def test_a_linear_spring_from_the_critical_damping_on_never_returns():
    assert float(law_epsilon(LINEAR, mpmath.mpf(2))) == math.exp(-2)
    with pytest.raises(ValueError, match="damping ratio is not below 1"):
        law_epsilon(LINEAR_RETURN, mpmath.mpf(2))


@pytest.mark.parametrize(
    ("kappa", "wanted", "expected"),
    [
        (lambda x: 3 * x**2, 12, 2),
        (lambda x: 1 / (x + mpmath.mpf("1e-9")) - 1, 9, 0.1 - 1e-9),  # falls, and is steep at an end
        (lambda x: x**3, 1e-3, 0.1),
        (lambda x: x if x < 5 else x + 3, 6, 5),  # jumps over it
        (lambda x: x, 0, 0),
        (lambda x: x, 10, 10),
        (lambda x: x, 11, None),
    ],
)
def test_the_parameter_that_gives_a_kappa(kappa, wanted, expected):
    formula = DampingFormula("f", LINEAR, "x", kappa, ("0", "10"), "exact", "a file")
    found = formula.parameter_of(mpmath.mpf(wanted))
    assert found == expected if expected is None else float(found) == pytest.approx(expected, rel=1e-15)


BALL = Sphere(radius=0.01, density=2500, young_modulus=1e8, poisson_ratio=0.3, dissipative_constant=2e-5)
LARGE = Sphere(radius=0.02, density=2500, young_modulus=1e8, poisson_ratio=0.3, dissipative_constant=2e-5)
SIZES = (Pair(LARGE, LARGE), Pair(BALL, BALL))


def test_the_shortest_contact_is_that_of_the_smallest_sizes():
    contact = NamedContact("a", "a", Pair(LARGE, LARGE), 0.01, 0.2, 5.0, SIZES)
    both = Setup("t", {"a": LARGE}, (contact,))
    assert input_file.shortest_contact(both) == Pair(BALL, BALL).contact_time(5.0)
