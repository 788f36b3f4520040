"""The direct integration of the collision: against itself, the proven series, expansions, and SciPy."""

import math
from fractions import Fraction
from functools import cache
from itertools import starmap

import numpy as np
import pytest
from mpmath import mp, mpf

from viscopade.arithmetic.balls import to_mpf
from viscopade.theory.series import lambda_coefficients, series
from viscopade_lab.studies.direct import LARGEST_FOR_POSITION, Direct, collide

QUANTITIES = ("epsilon", "one_minus_epsilon", "x_max", "tau_c", "x_c")
V_STARS = ("1e-6", "1e-3", "0.3", "1", "3", "30", "1e4")
WORK = 100  # digits for comparing, more than any result here has


def relative_error(value: mpf, reference: mpf) -> mpf:
    with mp.workdps(WORK):
        return abs(value / reference - 1)


def largest_error(a: Direct, b: Direct) -> mpf:
    return max(starmap(relative_error, ((getattr(a, name), getattr(b, name)) for name in QUANTITIES)))


@cache
def at_30_digits(v_star: str) -> Direct:
    return collide(v_star, 30)


# --- against itself -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("v_star", V_STARS)
def test_other_digits_and_another_order_agree(v_star: str):
    more = collide(v_star, 40, terms_per_digit=1)
    assert largest_error(at_30_digits(v_star), more) < mpf(10) ** -32


@pytest.mark.slow
def test_the_end_is_found_at_many_speeds():
    """The zero of the force that ends contact has a neighbour at s < 0, 2 v* away; it must never be taken instead."""
    for i in range(-60, 41):
        v_star = mpf(10) ** (mpf(i) / 10)
        assert largest_error(collide(v_star, 15), collide(v_star, 20)) < mpf(10) ** -17


@pytest.mark.parametrize("v_star", V_STARS)
def test_the_force_vanishes_at_the_end(v_star: str):
    """x_c and epsilon come from two polynomials evaluated at the end; that x_c = kappa epsilon is not imposed."""
    collision = at_30_digits(v_star)
    with mp.workdps(WORK):
        assert relative_error(collision.x_c / mpf(v_star) ** 2, collision.epsilon) < mpf(10) ** -32


# --- against what is proven, or known in closed form --------------------------------------------------------------


@pytest.mark.parametrize(("v_star", "digits"), [("1e-6", 60), ("0.01", 58), ("0.1", 29)])
def test_against_the_proven_series(v_star: str, digits: int):
    """The first term left out, h_31 v*^31, limits the agreement."""
    collision = collide(v_star, 60)
    h = series(order=30, digits=75).mpf()
    with mp.workdps(WORK):
        v = mpf(v_star)
        rest = mp.fsum(-h[k] * v**k for k in range(1, 31))
        assert relative_error(collision.epsilon, 1 - rest) < mpf(10) ** -digits
        assert relative_error(collision.one_minus_epsilon, rest) < mpf(10) ** (2 - digits)


def test_against_the_odd_series_of_ln_eps0():
    """At x = 0, ln eps0 = -Lambda(kappa eps0^(1/10)) (derivation 6)."""
    eps0 = collide("0.1", 40, end="position").epsilon
    coefficients = [to_mpf(ball) for ball in lambda_coefficients(12, 60)]
    with mp.workdps(WORK):
        nu = mpf("0.1") ** 2 * eps0 ** (mpf(1) / 10)
        exponent = mp.fsum(c * nu ** (2 * i + 1) for i, c in enumerate(coefficients))
        assert relative_error(eps0, mp.exp(-exponent)) < mpf(10) ** -40


def test_large_v_star_to_the_older_end():
    """All that creeps to x = 0 forgets how it began, so eps0 v*^10 tends to a constant exponentially in kappa^(5/3)."""
    constants = []
    for v_star in (4, 5):
        older = collide(v_star, 20, end="position")
        assert older.x_c == 0
        with mp.workdps(WORK):
            constants.append(older.epsilon * mpf(v_star) ** 10)
    assert relative_error(*constants) < mpf(10) ** -22


# --- against SciPy ---------------------------------------------------------------------------------------------------


def scipy_epsilon(v_star: float) -> float:
    """Return epsilon from SciPy's DOP853 on (x, x') with an event, in double precision."""
    solve_ivp = pytest.importorskip("scipy.integrate").solve_ivp

    kappa = v_star * v_star

    def motion(_: float, y: tuple[float, float]) -> tuple[float, float]:
        x, v = y
        return v, -math.sqrt(max(x, 0.0)) * (x + kappa * v)

    def force(_: float, y: tuple[float, float]) -> float:
        x, v = y
        return x + kappa * v

    force.terminal, force.direction = True, -1
    solution = solve_ivp(motion, (0, 10), (0.0, 1.0), method="DOP853", rtol=1e-13, atol=1e-16, events=force)
    return float(-np.asarray(solution.y_events[0])[0, 1])


@pytest.mark.parametrize("v_star", [0.01, 0.1, 1.0, 3.0, 30.0])
def test_against_scipy(v_star: float):
    assert relative_error(mpf(scipy_epsilon(v_star)), collide(v_star, 15).epsilon) < 1e-11


# --- arguments ------------------------------------------------------------------------------------------------------


def test_the_argument_is_taken_exactly():
    expected = collide(Fraction(1, 10), 17)
    assert collide("1e-1", 17) == expected
    with mp.workdps(40):
        assert collide(mpf(0.1), 17) == collide(0.1, 17) != expected
        assert collide(mpf(2), 17) == collide(2, 17)


def test_the_global_precision_is_left_alone():
    with mp.workdps(17):
        before = mp.prec
        collide(1, 20)
        assert mp.prec == before


@pytest.mark.parametrize(
    "v_star", [0, -1, "-0.5", mpf(0), mpf("inf"), mpf("nan"), "nan", float("inf"), float("nan"), "one"]
)
def test_no_collision(v_star: object):
    with pytest.raises(ValueError):
        collide(v_star)


def test_refusals():
    with pytest.raises(ValueError, match="positive"):
        collide(1, digits=0)
    with pytest.raises(ValueError, match="unknown end"):
        collide(1, end="never")
    with pytest.raises(ValueError, match="too many steps"):
        collide(LARGEST_FOR_POSITION + 1, end="position")
