"""The expansions at both ends against the series, an integration in time, closed forms and each other."""

import math

import mpmath
import pytest
from flint import arb

from viscopade.arithmetic.balls import to_mpf, working
from viscopade.theory.series import series
from viscopade_lab import asymptotics
from viscopade_lab.studies import direct


def test_one_minus_epsilon_has_the_coefficients_of_the_series():
    coefficients = dict(asymptotics.elastic(8, 30)["one_minus_epsilon"].coefficients)
    with working(200):
        for k, h_k in enumerate(series(16, 30).h[1:], 1):
            difference = h_k + coefficients.pop(k, arb(0))
            assert difference.contains(0)
            assert float(difference.abs_upper()) < 1e-25
    assert not coefficients


def test_first_terms_in_closed_form():
    closed, summed = asymptotics.elastic_in_closed_form(40), asymptotics.elastic(4, 40)
    with working(200):
        for name, expansion in closed.items():
            for (n, ours), (m, theirs) in zip(expansion.coefficients, summed[name].coefficients, strict=False):
                assert n == m
                assert ours.overlaps(theirs)
                assert float((ours - theirs).abs_upper()) < 1e-38


@pytest.mark.parametrize(("v_star", "end"), [("0.001", "slow"), ("1000", "fast")])
def test_the_difference_from_an_integration_in_time_is_the_first_omitted_term(v_star, end):
    """`viscopade_lab.studies.direct` integrates the scaled equation itself: all three results, term by term."""
    found = asymptotics.elastic(5, 40) if end == "slow" else asymptotics.viscous(3, 40)
    collision = direct.collide(v_star, 34)
    with mpmath.workdps(40), working(140):
        for name in found:
            value, left = mpmath.mpf(getattr(collision, name)), []
            for term in map(to_mpf, found[name].terms(arb(v_star))):
                left.append((value, term))
                value -= term
            resolved = [(rest, term) for rest, term in left if abs(term) > mpmath.mpf(10) ** -28 * abs(left[0][0])]
            assert len(resolved) >= 3
            assert all(abs(rest / term - 1) < 0.03 for rest, term in resolved[1:])


def test_large_v_star_has_the_first_terms_of_derivation_10():
    """S, U, A, B in doubles; the logarithm's powers are those expected."""
    a = math.log(3) / 2 - math.pi / math.sqrt(12) - 1.5
    b = 3.5 * (math.log(3) + math.pi / math.sqrt(3)) - 93 / 4
    found = asymptotics.viscous(3, 20)
    s, u = a - 1 - math.log(2), 2 * a - b + 5 * math.log(2) + 5  # at lambda = 0
    constants = {
        "epsilon": [1, -2 * s, s * s + 2 * u],
        "x_max": [1, -2 * a, a * a + 2 * (a - b)],
        "tau_c": [2 * (a + 1.5 - math.log(2))],
    }
    for name, values in constants.items():
        for polynomial, value in zip(found[name].polynomials, values, strict=False):
            assert float(polynomial(arb(0)).mid()) == pytest.approx(value, rel=1e-13, abs=0)
    degrees = {name: [p.degree() for p in expansion.polynomials] for name, expansion in found.items()}
    assert degrees == {"epsilon": [0, 1, 2, 2], "x_max": [0, 1, 2, 2], "tau_c": [1, 2, 3, 4]}


def test_more_digits_lie_within_fewer():
    """For v* -> infinity the remainders are estimated only: the estimates hold."""
    few, many = asymptotics.viscous(5, 20), asymptotics.viscous(5, 60)
    with working(300):
        for name, expansion in few.items():
            for ours, theirs in zip(expansion.polynomials, many[name].polynomials, strict=True):
                for c, d in zip(ours.coeffs(), theirs.coeffs(), strict=True):
                    assert c.overlaps(d)
                    assert float((c - d).abs_upper()) < 1e-18 * (1 + float(abs(d).abs_upper()))


def test_too_few_digits_are_noticed():
    with pytest.raises(ArithmeticError, match="too few digits"):
        asymptotics._expansion(asymptotics.arb_series([arb(1), arb(0, 1)], 2))
