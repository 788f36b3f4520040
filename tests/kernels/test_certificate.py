"""Proven bounds of kernels: never below what dense samples of the true deviation show, and hardly above.

The independent checker accepts what is right, and refuses certificates that were tampered with.
"""

import json
import math
from contextlib import suppress
from fractions import Fraction
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from flint import arb, arb_series
from hypothesis import given
from hypothesis import strategies as st

from certificate_checker import Checker, Wrong
from viscopade.approximation import minimax
from viscopade.approximation.lacunary import LacunaryQuotient, Powers
from viscopade.arithmetic.balls import ball_of, exact_middle, working
from viscopade.arithmetic.decimals import at_least, at_most, rounded_up
from viscopade.arrays import double, panels
from viscopade.arrays.panels import CENTRES, HALF_WIDTHS
from viscopade.collision import panel_proof
from viscopade.kernels import certificate, compact, quotient, reference
from viscopade.kernels.certificate import ORDER, prove
from viscopade.kernels.reference import stretches, v_star_at

TIGHT = 1.015  # three digits, rounded up, of a bound that is tight to 0.1 %
A, B = (tuple(map(Fraction, map(float, values))) for values in minimax.fit(1, 4, 5).exact)
FORMULA = quotient.quotient_formula(A, B)
INTERVALS = [("0", "5"), ("0", "1/3"), ("0.1", "1/3"), ("1", "8"), ("1/16", "2"), ("0.01", "0.05"), ("3", "3.01")]
CASES = [(*map(Fraction, ends), measure) for ends in INTERVALS for measure in ("both", "relative")]


def sampled(low, high, measure, number=4001, coefficients=(A, B)):
    """Return the largest deviation at many points, in double precision."""
    # Points in v* and, as the largest deviation may be near 0, in its logarithm.
    v_star = np.concatenate([np.linspace(float(low), float(high), number), np.geomspace(max(float(low), 1e-3),
                             float(high), number)])  # fmt: skip
    v_star = v_star[(v_star >= max(float(low), 1e-3)) & (v_star <= float(high))]
    a, b = ([float(c) for c in values] for values in coefficients)
    n, d = (np.polynomial.polynomial.polyval(v_star, c) for c in (a, b))
    eps, loss = double.epsilon(v_star), double.one_minus_epsilon(v_star)
    size = max(len(a), len(b))
    difference = np.array(
        [y - x for x, y in zip(a + [0.0] * (size - len(a)), b + [0.0] * (size - len(b)), strict=True)]
    )
    error_of_loss = np.abs(np.polynomial.polynomial.polyval(v_star, difference) / d / loss - 1)
    error = np.abs(n / d / eps - 1)
    return float(np.max(np.where(loss < eps, error_of_loss, error) if measure == "both" else error))


# --- bounds -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("low", "high", "measure"), CASES)
def test_the_bound_holds_and_is_tight(low, high, measure):
    found = prove(FORMULA, low, high, measure)
    largest = sampled(low, high, measure)
    assert largest <= float(found.bound) * (1 + 1e-9)
    # Towards v* = 0 samples in double precision end at 1e-3, where the deviation may be a little smaller.
    assert float(found.bound) <= TIGHT * largest * (1.01 if low == 0 else 1)


@pytest.mark.parametrize("measure", ["both", "relative"])
def test_a_wrong_formula_has_a_large_bound(measure):
    coefficients = A, (*B[:4], B[4] * 2)
    wrong = quotient.quotient_formula(*coefficients)
    low, high = Fraction(0), Fraction(5)
    assert float(prove(wrong, low, high, measure).bound) >= sampled(low, high, measure, coefficients=coefficients) > 0.2


@pytest.mark.parametrize(
    ("low", "high"), [(-1, 5), (5, 5), (5, 1), (0, 8388609), (8388608, 8388609), (10**8, math.inf)]
)
def test_intervals_that_are_refused(low, high):
    with pytest.raises(ValueError, match=r"expected 0 <= low < high|low is 100000000"):
        prove(FORMULA, Fraction(low), high if high == math.inf else Fraction(high), "relative")


def test_the_largest_interval_is_accepted():
    far = prove(FORMULA, Fraction(8000000), panel_proof.END, "relative")
    assert float(far.bound) > 0.9


# --- poles ------------------------------------------------------------------------------------------------------------


def times(values, root):
    """Multiply a polynomial by 1 - v*/root."""
    shifted = (Fraction(0), *(-c / root for c in values))
    return tuple(x + y for x, y in zip((*values, Fraction(0)), shifted, strict=True))


@pytest.mark.parametrize("measure", ["both", "relative"])
@pytest.mark.parametrize("pole", [Fraction(1, 50), Fraction(33, 16), Fraction(10, 3)])
def test_a_pole_is_refused(pole, measure):
    b = times(B, pole)
    a = (Fraction(1), b[1])
    with pytest.raises(ArithmeticError, match="pole"):
        prove(quotient.quotient_formula(a, b), Fraction(0), pole * 2, measure)


@pytest.mark.parametrize("measure", ["both", "relative"])
@pytest.mark.parametrize("pole", [Fraction(1, 50), Fraction(2)])
@pytest.mark.parametrize("distance", [Fraction(0), Fraction(1, 10**9)])
def test_a_pole_that_a_zero_nearly_cancels_is_refused(pole, measure, distance):
    """Samples would hardly ever see it."""
    a, b = times(A, pole), times(B, pole * (1 + distance))
    if distance:
        a = (a[0], b[1], *a[2:])
    with pytest.raises(ArithmeticError, match="pole"):
        prove(quotient.quotient_formula(a, b), Fraction(0), pole * 2, measure)


def test_a_pole_outside_the_interval_does_not_matter():
    b = times(B, Fraction(6))
    found = prove(quotient.quotient_formula((Fraction(1), b[1]), b), Fraction(0), Fraction(2))
    assert float(found.bound) > 0


def test_a_constant_term_or_slope_that_differs_has_no_bound_relative_to_1_minus_eps():
    wrong = quotient.quotient_formula((Fraction(1), 2 * A[1]), B)
    with pytest.raises((ArithmeticError, ValueError)):
        prove(wrong, Fraction(0), Fraction(1))
    assert float(prove(wrong, Fraction(0), Fraction(1), "relative").bound) > 0.01


# --- pieces of the proof ----------------------------------------------------------------------------------------------


def deviation(formula, panel, start, end, measure="relative"):
    """Return the bound on a part of a panel."""
    with working(reference.BITS, ORDER + 1):
        return certificate._Proof(formula, measure).deviation(panel, Fraction(start), Fraction(end))


@pytest.mark.parametrize("measure", ["both", "relative"])
def test_the_error_of_the_reference_is_in_the_bound(monkeypatch, measure):
    """R = q (1 + g) and q = eps (1 + d): both may have the same sign; also for d as small as it is."""
    a, b = (Fraction(3), Fraction(0)), (Fraction(3), Fraction(0), Fraction(-1, 2))
    part = quotient.quotient_formula(a, b), 40, Fraction(-1, 10), Fraction(1, 10), measure
    for error in (2.0**-3, panel_proof.proven_error()):
        monkeypatch.setattr(panel_proof, "proven_error", lambda: 0.0)
        bare = deviation(*part)
        monkeypatch.setattr(panel_proof, "proven_error", lambda error=error: error)
        with working(reference.BITS):
            assert deviation(*part) >= (1 + bare) * (1 + arb(error)) - 1
            assert bare > 0.1


@pytest.mark.parametrize(("panel", "start", "end"), [(9, "-1/3", "4/7"), (0, "0", "1/4"), (0, "1/2", "1")])
def test_taylor_polynomials_bound_the_function(panel, start, end):
    """At points of the part, also of ends that are no binary numbers; the sum is less than twice the largest value."""
    found, ends = deviation(FORMULA, panel, start, end), (Fraction(start), Fraction(end))
    errors = []
    with working(reference.BITS):
        for z in (ends[0] + (ends[1] - ends[0]) * Fraction(p, 20) for p in range(21)):
            v_star = exact_middle(v_star_at(panel, z))
            errors.append(abs(ball(value(A, v_star) / value(B, v_star)) / ball(row("epsilon", panel)(z)) - 1))
    assert max(errors) * (1 - arb(10) ** -9) <= found <= max(errors) * 2


def value(coefficients, v_star):
    return sum(c * v_star**i for i, c in enumerate(coefficients))


def row(name, panel):
    return panel_proof.panel_rows()[name, panel]


class Exponential:
    """R = e^(-v*): a formula that is no quotient, with a remainder of every order."""

    power = 1

    def near_zero(self, result, y, v_star):
        assert result == "epsilon"
        return (-v_star).exp()


class Steep(Exponential):
    """R = e^(20 v*)."""

    def near_zero(self, result, y, v_star):
        return (20 * v_star).exp()


def test_the_remainder_is_in_the_bound_of_a_wide_part():
    v_star = float(CENTRES[30] + HALF_WIDTHS[30])
    found = deviation(Steep(), 30, -1, 1)
    assert float(found) >= float(np.exp(20 * v_star) / double.epsilon(v_star) - 1) * (1 - 1e-12)


def ball(number):
    return arb(number.numerator) / number.denominator


@given(st.fractions(0, 9), st.fractions(0, 9))
def test_parts_cover_the_interval_without_gaps(first, second):
    low, high = sorted((first, second))
    if low == high:
        return
    with working(reference.BITS):
        spans = [
            [exact_middle(v_star_at(stretch.panel, z)) for z in part]
            for stretch in stretches(low, high)
            for part in stretch.parts(3)
        ]
    assert all(abs(before[1] - after[0]) < Fraction(1, 2**100) for before, after in pairwise(spans))
    assert abs(spans[0][0] - low) + abs(spans[-1][1] - high) < Fraction(1, 2**100)


def test_where_the_smaller_of_eps_and_1_minus_eps_changes():
    half = float(double.v_star_from(0.5))
    for panel in range(1, panels.PANELS):
        low, high = (float(CENTRES[panel] + z * HALF_WIDTHS[panel]) for z in (-1, 1))
        with working(reference.BITS, ORDER + 1):
            results = certificate._Proof(FORMULA, "both")._counting_results(panel, arb(low).union(arb(high)))
        assert ("epsilon" in results, "loss_ratio" in results) == (high >= half, low <= half)


@given(st.floats(1e-300, 1e10), st.integers(1, 5))
def test_rounded_up(value, digits):
    bound = rounded_up(arb(value), digits)
    assert Fraction(value) <= bound
    assert bound <= Fraction(value) * (1 + Fraction(1, 10 ** (digits - 1))) * (1 + Fraction(1, 10**9))
    assert Fraction(at_most(bound, digits)) == bound


@pytest.mark.parametrize(("text", "up"), [("0.001", "0.00101"), ("0.00123", "0.00124"), ("2", "2.01")])
def test_a_bound_just_above_a_short_decimal_is_rounded_up(text, up):
    with working(256):
        assert rounded_up(ball(Fraction(text)) * (1 + arb(2) ** -60)) == Fraction(up)


@given(st.floats(1e-300, 1e10), st.integers(1, 5))
def test_printed_bounds_are_on_the_right_side(value, digits):
    low, high = Fraction(at_least(value, digits)), Fraction(at_most(value, digits))
    assert low <= Fraction(value) <= high
    assert high - low <= Fraction(value) / 10 ** (digits - 1)


@pytest.mark.parametrize("text", ["0.001", "1.01", "6.7e-6", "50", "0", "inf"])
def test_a_short_decimal_is_its_own_bound(text):
    number = math.inf if text == "inf" else Fraction(text)
    assert at_least(number) == at_most(number) == text


def test_record_is_what_was_proven():
    found = prove(FORMULA, Fraction(1, 3), Fraction(2))
    record = json.loads(json.dumps(found.record()))
    assert (Fraction(record["v_star_min"]), Fraction(record["v_star_max"])) == (found.low, found.high)
    assert record["measure"] == "both"
    assert Fraction(record["bound"]) == found.bound
    assert float.fromhex(record["reference_error"]) == panel_proof.proven_error() == 2.0**-60
    assert [tuple(p) for p in record["parts"]] == list(found.parts)
    assert [p for p, _ in found.parts] == [stretch.panel for stretch in stretches(found.low, found.high)]


# --- to infinity ------------------------------------------------------------------------------------------------------


class Limiting(Exponential):
    """A formula whose error on the panels is replaced, and that is off by a factor beyond."""

    def __init__(self, factor):
        self.factor = factor

    def limit(self, u, w):
        return panel_proof.asymptotic_factor() * self.factor + 0 * u


def test_beyond_the_panels_the_limit_counts(monkeypatch):
    inside = prove(FORMULA, Fraction(1), Fraction(2), "relative")
    inside = certificate.replace(inside, high=panel_proof.END)
    monkeypatch.setattr(certificate._Proof, "on_panels", lambda proof, low, high: inside)
    found = prove(Limiting(arb(3) / 2), Fraction(0), math.inf, "relative")
    assert 0.5 < float(found.bound) < 0.51
    assert found.high == math.inf
    assert found.record()["v_star_max"] is None
    assert prove(Limiting(arb(1)), Fraction(0), math.inf, "relative").bound == inside.bound
    for wrong in (arb(3), arb(0), arb.pos_inf(), arb.nan()):
        with pytest.raises(ArithmeticError, match="limit"):
            prove(Limiting(wrong), Fraction(0), math.inf, "relative")


def test_the_tail_is_in_the_bound_beyond_the_panels(monkeypatch):
    tiny = certificate.Certificate("relative", Fraction(0), panel_proof.END, Fraction(1, 10**300), ())
    monkeypatch.setattr(certificate._Proof, "on_panels", lambda proof, low, high: tiny)
    found = prove(Limiting(arb(1)), Fraction(0), math.inf, "relative")
    with working(64):
        assert arb(float(found.bound)) >= panel_proof.tail(ball(panel_proof.END)).expm1() * 0.999


# --- the independent checker ------------------------------------------------------------------------------------------


@cache
def entry(low="0", high="1", measure="both"):
    found = prove(FORMULA, Fraction(low), Fraction(high), measure)
    return json.loads(
        json.dumps({"name": "test", "type": "exact", "a": list(map(str, A)), "b": list(map(str, B)), **found.record()})
    )


@pytest.mark.parametrize(
    ("low", "high", "measure"), [("0", "1", "both"), ("0.1", "1/3", "relative"), ("3/2", "2", "both")]
)
def test_the_checker_accepts_what_is_right(low, high, measure):
    right = entry(low, high, measure)
    assert Checker(right).check() >= sum(n for _, n in right["parts"])


def tampered(**changes):
    return {**entry(), **changes}


PARTS = entry()["parts"]


@pytest.mark.parametrize(
    "wrong",
    [
        {"bound": str(Fraction(entry()["bound"]) * Fraction(98, 100))},
        {"b": [*map(str, B[:2]), str(B[2] * Fraction(101, 100)), *map(str, B[3:])]},
        {"a": ["1", str(A[1] * Fraction(1001, 1000))]},
        {"b": list(map(str, times(B, Fraction(1)))), "a": ["1", str(times(B, Fraction(1))[1])]},
        {"parts": PARTS[:-1]},
        {"parts": PARTS[1:]},
        {"parts": [*PARTS[:5], *PARTS[6:]]},
        {"parts": []},
        {"parts": [*PARTS, [PARTS[-1][0] + 1, 4]]},
        {"parts": [[p, -1] for p, _ in PARTS]},
        {"parts": [[p, 0] for p, _ in PARTS]},
        {"v_star_max": "1.001"},
        {"v_star_max": "5"},
        {"v_star_max": None},
        {"v_star_min": "-1"},
        {"v_star_min": "1", "v_star_max": "1", "parts": []},
        {"v_star_min": "5", "v_star_max": "0", "parts": []},
        {"measure": "absolute"},
        {"reference_error": (-0.5).hex(), "bound": "1e-9"},
        {"reference_error": (0.0).hex()},
        {"bound": "0"},
        {"bound": "-1"},
    ],
    ids=lambda wrong: "-".join(f"{k}={str(v)[:30]}" for k, v in wrong.items()),
)
def test_the_checker_refuses_tampered_certificates(wrong):
    with pytest.raises(Wrong):
        Checker(tampered(**wrong)).check()


class Short:
    """A formula whose power series are cut too early: e^(20 v*) as if it were a cubic."""

    power = 1

    def near_zero(self, result, y, v_star):
        return arb_series((20 * v_star).exp().coeffs()[:4], 4)


def test_series_that_lose_terms_are_not_taken_for_polynomials():
    with pytest.raises((TypeError, ArithmeticError), match="loses"):
        prove(Short(), Fraction(1), Fraction(2), "relative")


# --- no bound is no bound ---------------------------------------------------------------------------------------------


def near_pole(gap):
    """1/(1 - v^2/p^2): its pole is p = 1 + gap."""
    return [arb(1)], [arb(1), arb(0), -1 / ball_of(1 + gap) ** 2]


@pytest.mark.parametrize("gap", [Fraction(1, 10**7), Fraction(1, 10**8), Fraction(1, 10**6)])
def test_close_to_a_pole_there_is_a_large_bound_or_none(gap):
    """An infinite bound was printed as 0: FLINT's decimals of infinity are zeros."""
    a, b = near_pole(gap)
    bound = "inf"
    with suppress(ValueError):
        bound = quotient.error_up_to(a, b, 1)
    assert float(bound) > 1e6


def test_an_infinite_number_has_no_decimals():
    for number in (arb.pos_inf(), arb("nan")):
        with pytest.raises(ArithmeticError, match="is no number"):
            rounded_up(number)


def test_a_half_line_formula_has_the_right_degrees():
    wrong = LacunaryQuotient(Powers((0, 6, 16), (0, 11)), (Fraction(1),) * 3, (Fraction(1),) * 2)
    with pytest.raises(ValueError, match="deg N = deg D"):
        compact.half_line_formula(wrong)
