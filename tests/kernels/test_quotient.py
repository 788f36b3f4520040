"""Quotient kernels: Padé and best approximants, their domains, bounds, names, and values as code computes them."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from decimal import Context, Decimal
from fractions import Fraction
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from flint import fmpq, fmpq_poly

from viscopade.arithmetic.balls import ball_of, exact_middle, working
from viscopade.arithmetic.formats import DOUBLE, FLOAT, FORMATS
from viscopade.collision import exact
from viscopade.kernels import formulas, machine, quotient, truth
from viscopade.kernels.arithmetic import ARITHMETICS, HOST, HOST_FLOAT
from viscopade.kernels.certificate import prove
from viscopade.kernels.expressions import Reading, Run, evaluate
from viscopade.kernels.machine import TYPES
from viscopade.kernels.quotient import ProvenPade, proven_pade, threshold, without_proof
from viscopade.theory.law import law_of
from viscopade.theory.pade import pade
from viscopade.theory.paper import TABLE
from viscopade_lab.hard_cases.exact_pade import exact_roots

HIGH = (Fraction(1, 2), Fraction(1), Fraction(2), Fraction(5))


def epsilon_bounds(kernel, place=HOST):
    return [bound for bound in kernel.bounds if (bound.result, bound.arithmetic) == ("epsilon", place)]


# --- approximants, the paper's and rational functions made up ---------------------------------------------------------


def digits40(number):
    return str(Context(prec=40).divide(Decimal(number.numerator), Decimal(number.denominator)))


def first_root(values):
    """Return the smallest positive root of a polynomial, to the digits of a double; None if there is none."""
    with working(64):
        roots = exact_roots(fmpq_poly([fmpq(*value.as_integer_ratio()) for value in values]))
        positive = [root for root in roots if root.positive]
    return Decimal(repr(float(positive[0].value.real.mid()))) if positive else None


def made_up(a, b, next_term="-0.0125"):
    top, bottom = (tuple(map(Decimal, texts.split())) for texts in (a, b))
    return ProvenPade(top, bottom, Decimal(next_term), first_root(bottom), first_root(top))


def product(numbers):
    """Return the coefficients of prod (1 + x number), of which none cancels another."""
    coefficients = [Fraction(1)]
    for number in numbers:
        coefficients = [u + number * v for u, v in zip([*coefficients, 0], [0, *coefficients], strict=True)]
    return " ".join(map(digits40, coefficients))


def exp_pade(m, n):
    """Return the Padé approximant of exp(-x), exactly known; its high coefficients are tiny."""
    a, b = (
        [Fraction(math.comb(k, i) * math.factorial(m + n - i), math.factorial(m + n)) for i in range(k + 1)]
        for k in (m, n)
    )
    return made_up(" ".join(digits40((-1) ** i * x) for i, x in enumerate(a)), " ".join(map(digits40, b)))


PAPER = tuple(without_proof(pade(m, n, quotient.PADE_DIGITS)) for m, n in TABLE)
ARTIFICIAL = (
    made_up("1", "1"),
    made_up("1 2", "1"),
    made_up("1", "1 -0.4"),
    made_up("1 0 0.5 0.25", "1 3"),
    made_up("1 0.1 3", "1 0.7 7", next_term="0"),
    made_up("1 0.5 0.25 0.125 0", "1 2 0.3 0"),
    made_up("1 0 0 0 0 1e-20", "1 0 0 1e15"),
    made_up("1 -3 2.25", "1 0 0 1e-30"),
    made_up("1 0 0 1 -1e-200", "1 0 0 0 1"),
    made_up(product(Fraction(31 + i, 97) for i in range(60)), product(Fraction(35 + i, 101) for i in range(63))),
    exp_pade(25, 28),
)
SAMPLES = PAPER + ARTIFICIAL
each_sample = pytest.mark.parametrize("sample", SAMPLES, ids=[each.label for each in SAMPLES])


EXACTLY = Reading(Fraction)


@each_sample
@pytest.mark.parametrize("form", [DOUBLE, FLOAT], ids=["double", "float"])
def test_programs_are_the_formula_and_nan_outside_its_domain(sample, form):
    """In exact numbers, on each branch; in those of the type nothing overflows to NaN."""
    kernel = sample.kernel()
    if form.name not in kernel.formats:
        assert sample in (ARTIFICIAL[-1], ARTIFICIAL[-3])
        assert "not a normal number in float" in kernel.missing["float"]
        return
    constants, function = kernel.constants[form.name], kernel.function("epsilon")
    high, taken = constants.get("high", math.inf), []
    places = (Fraction(1, 7), Fraction(3, 7), Fraction(7, 3), Fraction(constants.get("threshold", 1)) * 3)
    for x in (x for x in places if x <= high):
        given = {"v_star": x, **{name: Fraction(c) for name, c in constants.items()}}
        taken += [next(b for b in function.branches if b.guard is None or evaluate(b.guard, given, EXACTLY))]
        run = Run((*function.start, *taken[-1].program), given, EXACTLY)
        top, bottom = (sum(Fraction(c) * x**i for i, c in enumerate(c)) for c in sample.rounded(form))
        assert evaluate(taken[-1].results["epsilon"], run, EXACTLY) == top / bottom
    assert {*map(id, taken)} == {*map(id, function.branches)}
    kind, ends = TYPES[form.name], (math.ldexp(1.0, 1 - form.largest), math.ldexp(1.0, form.largest))
    x = [*np.geomspace(*ends, 2000), np.finfo(kind).max, high, np.nextafter(kind(high), kind(0))]
    found = machine.function_values(kernel, "epsilon", x, form=form)
    assert (np.isnan(found) == (np.array(x) > high)).all()
    small = [0.0, -0.0, float(form.smallest), 1e-320 if form is DOUBLE else 1e-40]
    assert (machine.function_values(kernel, "epsilon", small, form=form) == 1).all()
    outside = [-float(form.smallest), -1.0, -1e30, -math.inf, math.nan]
    assert np.isnan(machine.function_values(kernel, "epsilon", outside, form=form)).all()
    if "high" not in constants:
        a, b = sample.reduced
        limit = float(a[-1] / b[-1]) if len(a) == len(b) else 0.0 if len(a) < len(b) else math.inf
        far = machine.function_values(kernel, "epsilon", math.inf, form=form)
        assert far == pytest.approx(limit, rel=2.0 ** (2 - form.precision), abs=0)


@each_sample
def test_the_threshold_is_the_largest_that_is_safe(sample):
    def largest_sum(x):
        return max(sum(abs(c) * x**i for i, c in enumerate(values)) for values in sample.reduced)

    for form in (FORMATS[name] for name in sample.kernel().formats):
        t, limit = threshold(sample.label, *sample.reduced, form), Fraction(2) ** (form.largest - 8)
        assert largest_sum(Fraction(2) ** t) <= limit
        assert largest_sum(Fraction(2) ** (t + 1)) > limit or t == form.largest


def test_the_domain_ends_at_the_first_pole_or_zero():
    assert ARTIFICIAL[2].domain == "0 <= v* < 2.5 (there the formula has a pole)"
    # The paper speaks of a pole of [2/5] at 5.6801: with its own digits it is a zero of the numerator.
    table = made_up("1. 0.553528 -0.128445", "1. 0.553528 1.025 0.638466 0.384023 0.027908")
    assert table.pole is None
    assert table.domain.startswith("0 <= v* < 5.6801")
    assert table.domain.endswith("(there the formula has a zero)")
    assert made_up("1 -1", "1 -0.25").end == ("zero", 1)
    for m, n in ((2, 5), (4, 2), (5, 6)):
        found = without_proof(pade(m, n, quotient.PADE_DIGITS))
        end = found.kernel().constants["double"]["high"]
        assert Decimal(end) <= found.zero < Decimal(math.nextafter(end, math.inf))


def test_leading_zeros_are_dropped():
    assert PAPER[0].reduced == ((1,), tuple(map(Fraction, PAPER[0].b[:3])))
    assert PAPER[0].rounded(DOUBLE) == ((1.0,), (1.0, 0.0, float(PAPER[0].b[2])))


NEGATIVE = tuple(map(Decimal, ["1", "-1", "0", "0", "0", "0", "0"]))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"a": tuple(map(Decimal, ["1.1", "0", "0", "0"]))}, "a_0 and b_0 must be 1, not 11/10"),
        ({"b": (Decimal(0), *PAPER[3].b[1:])}, "a_0 and b_0 must be 1, not 0"),
        ({"a": tuple(map(Decimal, ["1", "nan", "0", "0"]))}, "NaN is not a finite number"),
        ({"pole": Decimal("3.5")}, r"\[3/6\] has no positive pole at v\* = 3.5"),
        ({"zero": Decimal("3.5")}, r"\[3/6\] has no positive zero at v\* = 3.5"),
        ({"b": NEGATIVE}, r"\[3/6\] has a positive pole, but pole is None"),
        ({"a": NEGATIVE}, r"\[6/6\] has a positive zero, but zero is None"),
        ({"b": NEGATIVE, "pole": Decimal("1.00000000001")}, r"\[3/6\] has no positive pole at v\* = 1.0"),
        ({"b": tuple(map(Decimal, "1100000")), "pole": Decimal(-1)}, r"\[3/6\] has no positive pole at v\* = -1"),
    ],
)
def test_contradictions_are_refused(changes, message):
    with pytest.raises(ValueError, match=message) as caught:
        replace(PAPER[3], **changes)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("b", "message"),
    [
        ("1 1.5e-400", r"\[1/1\]: b_1 = 1.5e-400 is not a normal number in double"),
        ("1 1e400", r"\[1/1\]: b_1 = 1.00000e\+400 is not a normal number"),
        ("1 1e307", r"\[1/1\]: the coefficients are too large"),
    ],
)
def test_what_fits_no_double_is_refused(b, message):
    with pytest.raises(ValueError, match=message):
        made_up("1 1", b).kernel()


# --- Padé approximants with proofs ------------------------------------------------------------------------------------


def test_pade_bounds_are_those_of_the_exact_formula():
    kernel, found = quotient.pade_quotient(3, 6), proven_pade(3, 6)
    for place in ARITHMETICS.values():
        bounds = epsilon_bounds(kernel, place)
        assert [(b.low, b.high, b.relative_to) for b in bounds] == [(0, high, "smaller") for high in HIGH]
        assert all(left.formula < right.formula for left, right in pairwise(bounds))
        assert bounds[1].formula == prove(quotient.quotient_formula(*found.reduced), Fraction(0), Fraction(1)).bound
        assert Fraction("1e-6") < bounds[0].formula < Fraction("1e-5")


@pytest.mark.parametrize("place", ARITHMETICS.values(), ids=ARITHMETICS)
def test_pade_rounding_covers_that_of_the_coefficients(place):
    found, ends = proven_pade(3, 6), (Fraction(0), Fraction(5))
    exactly = (tuple(map(Fraction, values)) for values in found.rounded(place.form))
    without, with_them = (float(quotient.quotient_rounding(*c, place, *ends)) for c in (exactly, found.reduced))
    assert 1.03 * without < with_them <= float(epsilon_bounds(quotient.pade_quotient(3, 6), place)[0].last)


def test_bounds_of_the_speed_have_the_rounding_of_v_star():
    of_eps, *_ = epsilon_bounds(quotient.pade_quotient(3, 6))
    usual, every = (
        b for b in quotient.pade_quotient(3, 6).bound("restitution", "host", "double") if b.formula == of_eps.formula
    )
    assert usual.speeds == (Fraction(1, 10**30), 10**30)
    assert every.speeds is None
    assert usual.high == every.high == of_eps.high
    assert 4e-15 < usual.rounding < 6e-15 < 1.6e-14 < every.rounding < 1.8e-14
    assert of_eps.last < usual.last < of_eps.last * Fraction(1001, 1000)


@pytest.mark.parametrize("form", FORMATS.values(), ids=FORMATS)
@pytest.mark.parametrize(("m", "n"), TABLE)
def test_bounds_of_the_speed_hold_up_to_their_ends_where_the_computed_v_star_is_beyond(m, n, form):
    kernel, generator, beyond = quotient.pade_quotient(m, n), np.random.default_rng(7), 0
    for end, speed in itertools.product(HIGH, 10.0 ** generator.uniform(-20, 20, 40)):
        speed = form.rounded(Fraction(speed))
        with working(truth.BITS):  # the largest beta within the end
            beta = form.rounded(exact_middle(ball_of(end**10 / Fraction(speed)).root(5)), math.floor)
        w = Fraction(beta) ** 5 * Fraction(speed)
        assert end**10 * (1 - 10 * form.epsilon) < w <= end**10
        beyond += machine.branch_value(formulas.v_star_branch(), "v_star", given(form, speed, beta), form) > end
        with working(truth.BITS):
            epsilon, loss = truth.portions_of_w(w)
            smaller = exact_middle(min(epsilon, loss))
            off = abs(machine.function_values(kernel, "restitution", speed, beta, form=form) - epsilon)
            bounds = [b for b in kernel.bound("restitution", "host", form.name) if b.high == end and b.speeds]
            assert all(off < ball_of(b.allowed(exact_middle(epsilon), smaller, Fraction(speed))) for b in bounds)
            assert len(bounds) == 1
    assert beyond > 10


def given(form, speed, beta):
    return {"speed": TYPES[form.name](speed), "beta": TYPES[form.name](beta)}


def test_beyond_an_end_a_formula_that_falls_faster_than_eps_has_a_larger_bound():
    """[0/3] is far above eps at v* = 5, where it falls faster than eps may, relative to eps."""
    of_eps = epsilon_bounds(quotient.pade_quotient(0, 3))[-1]
    steepness = quotient._beyond(proven_pade(0, 3), of_eps).steepness
    slope = (machine.function_values(quotient.pade_quotient(0, 3), "epsilon", 5 * (1 + x)) for x in (-1e-4, 1e-4))
    relative = -np.subtract.reduce([*slope][::-1]) / 2e-4 / float(truth.portions_of_w(Fraction(5) ** 10).epsilon)
    assert 1 < relative / (10 / 3) < steepness < 10
    assert quotient._beyond(proven_pade(3, 6), epsilon_bounds(quotient.pade_quotient(3, 6))[0]).steepness == 1


def test_bounds_of_the_speed_end_before_the_domain_does():
    for bound in small().bounds:
        if bound.result == "restitution" and bound.arithmetic == HOST:
            assert 5 * (1 - Fraction(1, 10**12)) < bound.high < 5


def test_bounds_end_before_the_first_pole_or_zero():
    found = proven_pade(5, 6)
    full = without_proof(pade(5, 6, quotient.PADE_DIGITS))
    assert (found.a, found.b, found.end) == (full.a, full.b, full.end)
    if found.end is not None:
        assert all(proof.high < Fraction(found.end[1]) for proof in found.certificates)
    poles = proven_pade(3, 5)
    assert float(poles.end[1]) < 0.5
    assert poles.certificates == poles.bounds == poles.kernel().bounds == ()


@pytest.mark.parametrize(("m", "n"), [(2, 5), (3, 5), (4, 2), (3, 6)])
def test_poles_and_zeros_are_those_that_theory_proves(m, n):
    approximant, found = pade(m, n, quotient.PADE_DIGITS), proven_pade(m, n)
    for at, roots in ((found.pole, approximant.poles), (found.zero, approximant.zeros)):
        positive = [Decimal(root.decimals(quotient.PADE_DIGITS)[0]) for root in roots if root.positive]
        assert at == min(positive, default=None)
    assert (found.end is None) == (approximant.domain_end is None)
    record = quotient.pade_quotient(m, n).record
    assert record["zero"] == (found.zero and repr(float(found.zero)))
    assert (record["a"], record["b"]) == tuple(map(list, approximant.decimals(quotient.PADE_DIGITS)))


def test_types_whose_range_is_too_small_have_no_bound():
    """[30/60] in float changes to powers of 1/v* at v* = 4, before 5: nothing is proven of that."""
    found = proven_pade(3, 6)
    (proof,) = found.certificates[-1:]
    assert [*quotient._bounds(found.label, *found.reduced, [proof], HOST_FLOAT)]
    far = replace(proof, high=Fraction(2 ** (threshold(found.label, *found.reduced, FLOAT) + 1)))
    with pytest.raises(ValueError, match="float"):
        next(quotient._bounds(found.label, *found.reduced, [far], HOST_FLOAT))


@pytest.mark.parametrize(("law", "m", "n"), [("tsuji", 1, 3), ("hunt-crossley:1", 2, 3)])
def test_sampled_errors_of_other_laws(law, m, n):
    law, low = law_of(law), 0.0
    approximant = pade(m, n, quotient.PADE_DIGITS, law)
    for high, error in quotient.sampled_errors(approximant, law):
        for share in (0.37, 0.81, 0.999):
            v_star = low + (float(high) - low) * share
            top, bottom = (sum(float(c) * v_star**i for i, c in enumerate(p)) for p in (approximant.a, approximant.b))
            true = exact.collision(Fraction(v_star), 20, law=law).floats()
            off = abs(top / bottom - true["epsilon"]) / min(true["epsilon"], true["one_minus_epsilon"])
            assert off <= 1.001 * float(error) + 1e-13
        low = float(high)
    assert low >= 1


def test_samples_end_where_contact_does():
    """By a linear spring with the end x = 0 contact ends below kappa = 2 only."""
    law = law_of("linear", "return")
    approximant = pade(2, 2, 20, law)
    (one, first), (two, second) = quotient.sampled_errors(approximant, law)
    assert (one, two) == (Fraction(1, 2), 1)
    with pytest.raises(ValueError, match="does not end at x = 0"):
        quotient.sampled_errors(approximant, law, 3)
    ((end, between),) = quotient.sampled_errors(approximant, law, "0.75")
    assert end == Fraction(3, 4)
    assert first < between < second


# --- best approximants ------------------------------------------------------------------------------------------------


@cache
def small():
    return quotient.best_fit(1, 4, 5)


@cache
def between():
    return quotient.best_fit(2, 5, 2, Fraction(1, 10))


@pytest.mark.parametrize("place", [HOST, HOST_FLOAT], ids=["double", "float"])
def test_the_doubles_are_proven_and_floats_are_rounded_doubles(place):
    kernel, named = small(), [*(f"a{i}" for i in range(2)), *(f"b{i}" for i in range(5))]
    exact, own = ([Fraction(kernel.constants[form][name]) for name in named] for form in ("double", place.form.name))
    assert own == [place.form.nearest(c) for c in exact]
    (bound,) = epsilon_bounds(kernel, place)
    assert bound.formula == prove(quotient.quotient_formula(exact[:2], exact[2:]), Fraction(0), Fraction(5)).bound
    # Relative to eps, not to the formula, and rounded up to two digits; with the rounding of the coefficients.
    size, less = (quotient.quotient_rounding(c[:2], c[2:], place, Fraction(0), Fraction(5)) for c in (exact, own))
    assert float(size) * (1 + float(bound.formula)) <= float(bound.last) <= 1.11 * float(size)
    assert size > less or place == HOST


def test_rounding_is_relative_to_eps_and_not_to_the_formula():
    kernel = quotient.best_fit(0, 3, 1000)
    (bound,) = epsilon_bounds(kernel)
    coefficients = (
        [Fraction(kernel.constants["double"].get(f"{c}{i}", 0)) for i in range(n)] for c, n in (("a", 1), ("b", 4))
    )
    size = float(quotient.quotient_rounding(*coefficients, HOST, Fraction(0), Fraction(1000)))
    assert float(bound.formula) > 0.5
    assert float(bound.last) >= size * (1 + float(bound.formula))


def test_names_tell_degrees_and_interval():
    assert small().name == "minimax_1_4_v5"
    assert between().name == "minimax_2_5_v0p1to2"
    (bound,) = epsilon_bounds(between())
    assert (bound.low, bound.high, bound.relative_to) == (Fraction(1, 10), 2, "smaller")
    inside = machine.function_values(between(), "epsilon", [0.09999, 0.1001, 1.999, 2.0001])
    assert np.isnan(inside).tolist() == [True, False, False, True]


def test_accuracy_is_met_where_rounding_counts():
    """What is wanted is just above what the best approximant alone would have, but below its sum with rounding."""
    (best,) = epsilon_bounds(quotient.best_fit(2, 5, 1))
    wanted = best.formula + best.last / 2
    (bound,) = epsilon_bounds(quotient.accurate_quotient(str(float(wanted)), 1))
    assert bound.relative + bound.last <= wanted


def test_a_float_that_would_miss_the_accuracy_or_is_much_worse_is_left_out_with_a_reason():
    """The best [6/9] in double precision is far better than floats allow."""
    for kernel in (quotient.accurate_quotient("1e-7", 1), quotient.best_fit(6, 9, 2)):
        assert kernel.formats == ("double",)
        assert "the error would be" in kernel.missing["float"]
    assert small().missing == {}


@pytest.mark.parametrize("accuracy", ["0", "1e-16", "1", "-1", "nan"])
def test_accuracies_that_are_refused(accuracy):
    with pytest.raises(ValueError, match="accuracy"):
        quotient.accurate_quotient(accuracy, 5)
