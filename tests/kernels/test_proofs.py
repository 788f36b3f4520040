"""Kernels with their proofs: bounds, rounding, names, and what is left out with a reason."""

import json
import math
import re
from decimal import Decimal
from fractions import Fraction
from functools import cache

import pytest

from certificate_checker import Checker
from viscopade.approximation import minimax
from viscopade.arithmetic.formats import DOUBLE, FLOAT
from viscopade.kernels import prove_rational, rounding_bounds
from viscopade.kernels.certificate import prove
from viscopade.kernels.forms import exact_formulas
from viscopade.kernels.targets import c, python
from viscopade.theory.pade import pade


@cache
def small():
    return prove_rational.of_minimax(1, 4, 5)


@cache
def kernels():
    return [
        prove_rational.of_pade(3, 6),
        prove_rational.of_pade(1, 4),
        small(),
        prove_rational.of_minimax(2, 5, 2, Fraction(1, 10), "relative"),
    ]


# --- Padé -------------------------------------------------------------------------------------------------------------


def test_pade_bounds_are_those_of_the_exact_formula():
    kernel = prove_rational.of_pade(3, 6)
    assert [bound.high for bound in kernel.bounds] == [Fraction(1, 2), 1, 2, 5]
    assert all((bound.low, bound.measure) == (0, "both") for bound in kernel.bounds)
    a, b = kernel.exact
    assert kernel.bounds[1].bound == prove(exact_formulas.quotient_formula(a, b), Fraction(0), Fraction(1)).bound
    bounds = [Fraction(bound.bound) for bound in kernel.bounds]
    assert bounds == sorted(bounds)
    assert Fraction("1e-6") < bounds[0] < Fraction("1e-5")


def test_pade_rounding_covers_that_of_the_coefficients():
    kernel = prove_rational.of_pade(3, 6)
    assert [name for name, _ in kernel.rounding] == ["double", "float"]
    a, b = kernel.exact
    for form, (_, size) in zip((DOUBLE, FLOAT), kernel.rounding, strict=True):
        without = float(rounding_bounds.quotient_rounding(a, b, form, Fraction(0), Fraction(5)))
        with_them = float(rounding_bounds.quotient_rounding(a, b, form, Fraction(0), Fraction(5), coefficients=True))
        assert with_them <= float(size) <= 1.2 * with_them
        assert with_them > 1.05 * without


def test_pade_bounds_end_before_the_first_pole_or_zero():
    kernel = prove_rational.of_pade(5, 6)
    full = prove_rational.without_proof(pade(5, 6, prove_rational.DIGITS))
    assert (kernel.a, kernel.b, kernel.end) == (full.a, full.b, full.end)
    if kernel.end is not None:
        assert all(bound.high < Fraction(kernel.end[1]) for bound in kernel.bounds)
    poles = prove_rational.of_pade(3, 5)
    assert float(poles.end[1]) < 0.5
    assert poles.bounds == poles.rounding == ()
    assert poles.proven == ()


@pytest.mark.parametrize(("m", "n"), [(2, 5), (3, 5), (4, 2), (3, 6)])
def test_poles_and_zeros_are_those_that_theory_proves(m, n):
    approximant, kernel = pade(m, n, prove_rational.DIGITS), prove_rational.of_pade(m, n)
    ends = {"pole": kernel.pole, "zero": kernel.zero}
    for kind, roots in (("pole", approximant.poles), ("zero", approximant.zeros)):
        positive = [Decimal(root.decimals(prove_rational.DIGITS)[0]) for root in roots if root.positive]
        assert ends[kind] == min(positive, default=None)
    assert (kernel.end is None) == (approximant.domain_end is None)
    record = kernel.record()
    assert record["zero"] == (kernel.zero and repr(float(kernel.zero)))
    assert (record["a"], record["b"]) == tuple(map(list, approximant.decimals(prove_rational.DIGITS)))


@pytest.mark.parametrize(("m", "n"), [(2, 5), (4, 2), (5, 6)])
def test_python_ends_at_the_last_double_before_the_zero(m, n):
    kernel = prove_rational.of_pade(m, n)
    end = float(re.search(r"if v_star > (\S+):", python.render([kernel], "viscopade export python"))[1])
    assert Decimal(end) <= kernel.zero < Decimal(math.nextafter(end, math.inf))


def test_types_whose_range_is_too_small_have_no_rounding_bound():
    """[30/60] in float changes to powers of 1/v* at v* = 4, before 5: nothing is proven of that."""
    kernel = prove_rational.of_pade(3, 6)
    assert 2 ** kernel.threshold(FLOAT) > 5
    prove_rational._require_horner(kernel.label, *kernel.exact, FLOAT, Fraction(5))
    with pytest.raises(ValueError, match="float"):
        prove_rational._require_horner(kernel.label, *kernel.exact, FLOAT, Fraction(2 ** (kernel.threshold(FLOAT) + 1)))


# --- minimax ----------------------------------------------------------------------------------------------------------


def test_minimax_variants_are_proven_with_their_own_coefficients():
    kernel = small()
    assert [v.form for v in kernel.variants] == [DOUBLE, FLOAT]
    for variant in kernel.variants:
        a, b = (tuple(map(Fraction, values)) for values in (variant.a, variant.b))
        found = prove(exact_formulas.quotient_formula(a, b), Fraction(0), Fraction(5))
        assert variant.certificate.bound == found.bound
        relative = rounding_bounds.quotient_rounding(a, b, variant.form, Fraction(0), Fraction(5))
        # Relative to eps, not to the formula, and rounded up to two digits.
        assert float(relative) * (1 + float(found.bound)) <= float(variant.rounding) <= 1.11 * float(relative)


def test_rounding_is_relative_to_eps_and_not_to_the_formula():
    kernel = prove_rational.of_minimax(0, 3, 1000)
    (variant, *_) = kernel.variants
    a, b = (tuple(map(Fraction, values)) for values in (variant.a, variant.b))
    relative = float(rounding_bounds.quotient_rounding(a, b, DOUBLE, Fraction(0), Fraction(1000)))
    assert float(variant.certificate.bound) > 0.5
    assert float(variant.rounding) >= relative * (1 + float(variant.certificate.bound))


def test_names_tell_degrees_interval_and_measure():
    assert small().name == "minimax_1_4_v5"
    other = kernels()[3]
    assert other.name == "minimax_2_5_v0p1to2_relative"
    assert other.interval == (Fraction(1, 10), 2)


@pytest.mark.parametrize("wanted", ["1e-2", "1e-5"])
def test_accuracy_is_met_by_bound_and_rounding_together(wanted):
    kernel = prove_rational.accurate(wanted, 2)
    for variant in kernel.variants:
        assert Fraction(variant.certificate.bound) + Fraction(variant.rounding) <= Fraction(wanted)
    first = kernel.variants[0]
    assert first.form == DOUBLE


def test_accuracy_is_met_where_rounding_counts():
    """What is wanted is just above what the best approximant alone would have, but below its sum with rounding."""
    best = prove_rational.of_minimax(2, 5, 1)
    bound, size = (Fraction(x) for x in (best.variants[0].certificate.bound, best.variants[0].rounding))
    wanted = bound + size / 2
    kernel = prove_rational.accurate(str(float(wanted)), 1)
    assert Fraction(kernel.variants[0].certificate.bound) + Fraction(kernel.variants[0].rounding) <= wanted


def test_a_float_that_would_miss_the_accuracy_is_left_out_with_a_reason():
    kernel = prove_rational.accurate("1e-7", 1)
    assert [v.form for v in kernel.variants] == [DOUBLE]
    ((name, reason),) = kernel.missing
    assert name == "float"
    assert "error would be" in reason
    header = c.render([kernel], "test")
    assert f"viscopade_epsilon_{kernel.name}(" in header
    assert f"viscopade_epsilon_{kernel.name}f(" not in header
    assert "float" in header.split("VISCOPADE_INLINE double viscopade_epsilon")[0]


@pytest.mark.slow
def test_a_float_much_worse_than_the_double_is_left_out():
    """The best [6/9] in double precision is far better than rounded coefficients of float allow."""
    kernel = prove_rational.of_minimax(6, 9, 2)
    assert [name for name, _ in kernel.missing] == ["float"]
    kept = small()
    assert kept.missing == ()
    assert Fraction(kept.variants[1].certificate.bound) <= 2 * Fraction(kept.variants[0].certificate.bound)


@pytest.mark.parametrize("accuracy", ["0", "1e-16", "1", "-1", "nan"])
def test_accuracies_that_are_refused(accuracy):
    with pytest.raises(ValueError, match="accuracy"):
        prove_rational.accurate(accuracy, 5)


def test_certificates_of_all_kernels_are_accepted_by_the_checker():
    for kernel in (prove_rational.of_pade(1, 4), kernels()[3]):
        for entry in kernel.certificates()[:1]:
            assert Checker(json.loads(json.dumps(entry))).check() > 0


def test_the_measure_is_the_one_asked_for():
    relative = kernels()[3]
    assert relative.bounds[0].measure == "relative"
    assert "/ eps <=" in " ".join(relative.facts)
    assert "min(eps, 1 - eps)" in " ".join(small().facts)
    assert minimax.fit(1, 4, 5).measure == "both"
