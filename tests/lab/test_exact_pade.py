"""Padé approximants of series with rational coefficients: closed forms, multiple roots, nothing missed."""

from fractions import Fraction
from math import comb, factorial

import pytest

from viscopade.theory.pade import DegenerateError, pade
from viscopade.theory.series import series
from viscopade_lab.hard_cases.exact_pade import rational_pade


def test_rational_pade_of_the_exponential_has_its_closed_form():
    m, n = 3, 4
    p = rational_pade([Fraction(1, factorial(k)) for k in range(m + n + 3)], m, n, 25)
    for c, degree, sign in ((p.decimals()[0], m, 1), (p.decimals()[1], n, -1)):
        for j, c_j in enumerate(c):
            exact = Fraction(comb(degree, j) * factorial(m + n - j), factorial(m + n)) * sign**j
            assert abs(Fraction(c_j) / exact - 1) < Fraction(1, 10**24)
    assert p.contact_order == 7


def test_rational_pade_of_the_printed_series_is_pade():
    h = [Fraction(x) for x in series(12, 60).decimals()]
    assert rational_pade(h, 3, 6, 20).decimals() == pade(3, 6, 20).decimals()


def test_rational_pade_knows_multiple_roots():
    """(1 + x)^2 / (1 - x/2)^3 is its own [2/3]."""
    h = [Fraction((k + 1) * (k + 2), 2) / 2**k for k in range(12)]  # (1 - x/2)^-3
    h = [h[k] + 2 * (h[k - 1] if k else 0) + (h[k - 2] if k > 1 else 0) for k in range(12)]
    p = rational_pade(h, 2, 3, 20)
    (pole,), (zero,) = p.poles, p.zeros
    assert (pole.multiplicity, pole.decimals(5), pole.positive) == (3, ("2.0000", "0"), True)
    assert (zero.multiplicity, zero.decimals(5), zero.positive) == (2, ("-1.0000", "0"), False)
    assert (p.contact_order, p.next_term) == (11, 0)
    with pytest.raises(DegenerateError, match="singular"):
        rational_pade(h, 3, 4, 20)


def test_rational_pade_of_a_long_series_needs_no_digits_to_see_what_it_misses():
    """In balls of few digits the first coefficient that [40/43] misses could not be told from zero."""
    h = [Fraction(x) for x in series(92, 60).decimals(40)]
    p, q = (rational_pade(h[:length], 40, 43, 1) for length in (93, 84))
    assert (p.contact_order, q.contact_order) == (83, 83)
    assert float(p.next_term) == pytest.approx(float(rational_pade(h, 40, 43, 60).next_term), rel=1e-12, abs=0)
    assert (p.decimals(), q.next_term) == (q.decimals(), 0)


@pytest.mark.parametrize("h", [[Fraction(1, 3)] * 3, [1.0, 0.75, 0.375]])
def test_an_exact_solution_loses_no_digits(h):
    """Nor do balls that are exact, as those of doubles are, count as infinitely accurate."""
    h = [Fraction(h_k) + k for k, h_k in enumerate(h)]
    assert rational_pade(h, 1, 1, 5).digits_lost == 0


def test_rational_pade_refuses():
    with pytest.raises(TypeError, match="expected integers and Fractions"):
        rational_pade([1, 0.5], 0, 1)
    with pytest.raises(ValueError, match="h has 2 coefficients"):
        rational_pade([1, 2], 1, 1)
    with pytest.raises(ValueError, match="h_0 > 0"):
        rational_pade([-1, 1], 0, 1)
