"""Compact kernels and those of v*: programs, bounds of rounding on each machine, choice of powers, refusals."""

from __future__ import annotations

import itertools
from dataclasses import replace
from fractions import Fraction
from functools import partial

import numpy as np
import pytest
from flint import arb

from viscopade.approximation import half_line
from viscopade.approximation.lacunary import Powers
from viscopade.arithmetic.balls import working
from viscopade.arithmetic.formats import DOUBLE, FLOAT, FORMATS
from viscopade.kernels import compact, formulas, machine
from viscopade.kernels.arithmetic import DEVICE, HOST, HOST_FLOAT
from viscopade.kernels.expressions import Name, Reading, Run, evaluate
from viscopade.kernels.rounding import Rounded
from viscopade.kernels.rounding_bounds import relative_error, results_on_parts

ACCURACIES = ("1e-3", "1e-5", "1e-7")
NOT_IN_FLOAT = Powers((0, 6, 12, 13, 17, 18, 26), (0, 6, 8, 9, 10, 22))
EXACTLY = Reading(Fraction, {"divide": lambda top, bottom: top / bottom})


def of(accuracy):
    """Return the powers of a kernel, and what is proven of it."""
    powers = compact.compact_powers(Fraction(accuracy))
    return powers, compact.compact_fit(powers)


def sums(powers, proven, y, number=Fraction):
    """Return N and D, evaluated term by term."""
    return (
        sum(number(c) * y**k for k, c in zip(*part, strict=True))
        for part in ((powers.top, proven.a), (powers.bottom, proven.b))
    )


# --- programs ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("accuracy", ACCURACIES)
def test_the_programs_are_the_formula(accuracy):
    """In exact numbers, given the root: of the speed, and of v* on both branches."""
    powers, proven = of(accuracy)
    numbers = {name: Fraction(c) for name, c in formulas.constants(powers, proven.a, proven.b).items()}
    y, speed = Fraction(3, 5), Fraction(7, 2)
    n, d = sums(powers, proven, y)
    eps = d / (d + y**6 * n)
    body = compact.result_branch(powers)
    run = Run(body.program, numbers | {"y": y, "speed": speed}, EXACTLY)
    found = {name: evaluate(expression, run, EXACTLY) for name, expression in body.results.items()}
    assert found == {"restitution": eps, "rebound": eps * speed, "dissipation": 1 - eps**2}
    for variable, branch in zip("yu", formulas.half_line_branches(powers), strict=True):
        at = y if variable == "y" else 1 / y
        n, d = sums(powers, proven, at)
        run = Run(branch.program, numbers | {variable: y, "v_star": at**3}, EXACTLY)
        assert evaluate(branch.results["epsilon"], run, EXACTLY) == d / (d + at**6 * n)
        assert evaluate(branch.results["one_minus_epsilon"], run, EXACTLY) == at**6 * n / (d + at**6 * n)
        if "limit" in branch.results:
            assert evaluate(branch.results["limit"], run, EXACTLY) == d / (d + at**6 * n) * at**10


def test_powers_of_another_kind_are_refused():
    with pytest.raises(ValueError, match="deg N = deg D"):
        compact.result_branch(Powers((0, 4), (0, 4)))


@pytest.mark.parametrize("form", FORMATS.values(), ids=FORMATS)
@pytest.mark.parametrize("accuracy", ACCURACIES[:2])
def test_a_body_at_rest_stays_at_rest_for_every_finite_beta(accuracy, form):
    """Where beta^5 overflows, too; w is 0 times infinity there."""
    kernel, largest = compact.compact(accuracy), float((2 - form.epsilon) * Fraction(2) ** form.largest)
    for zero, beta in itertools.product((0.0, -0.0), (0.0, 1e8, largest)):
        found = [float(machine.function_values(kernel, name, zero, beta, form=form)) for name in compact.MEANINGS]
        assert found == [1, 0, 0]
    for given in ((0.0, np.inf), (np.inf, 0.0)):
        assert np.isnan(machine.function_values(kernel, "restitution", *given, form=form))


# --- bounds of rounding -----------------------------------------------------------------------------------------------


def emulated(powers, proven, place, generator, w):
    """The program in type float, with functions whose results are moved by random errors within their bounds."""
    f32 = np.float32

    def moved(exact, ulps, absolute=0.0):
        steps = generator.uniform(-1, 1, len(w)) * np.asarray(ulps, dtype=float)
        near = np.abs(exact) <= 1
        error = np.where(near & (absolute > 0), generator.uniform(-absolute, absolute, len(w)), steps * spacing(exact))
        # A little less, as the result is rounded to a number of the type.
        return (exact + error * (1 - 2**-2)).astype(f32)

    def spacing(exact):
        return np.ldexp(1.0, np.frexp(exact)[1] - 24)

    library = float(place.functions)
    functions = {
        "log2": lambda x: moved(np.log2(x.astype(float)), library, float(place.log2_absolute)),
        "exp2": lambda x: moved(np.exp2(x.astype(float)), library),
        "divide": lambda a, b: moved(np.divide(a, b, dtype=float), max(float(place.quotient) - 0.5, 0)),
    }
    given = {k: f32(c) for k, c in formulas.constants(powers, proven.a, proven.b).items()}
    given |= {"thirtieth": f32(compact.thirtieth(FLOAT)), "speed": np.ones(len(w), f32), "w": w}
    by, body = Reading(f32, functions), compact.result_branch(powers)
    run = Run(body.program, given | {"y": evaluate(compact.root_of(Name("w")), given, by)}, by)
    return {name: evaluate(expression, run, by) for name, expression in body.results.items()}


def formula(powers, proven, w):
    """The formula with the coefficients of a type, in extended precision, with few roundings."""
    y = np.longdouble(w) ** (np.longdouble(1) / 30)
    n, d = sums(powers, proven, y, np.longdouble)
    eps, loss = d / (d + y**6 * n), y**6 * n / (d + y**6 * n)
    return {"restitution": eps, "rebound": eps, "dissipation": loss * (1 + eps)}


@pytest.mark.parametrize("place", [HOST_FLOAT, DEVICE], ids=lambda place: place.place)
@pytest.mark.parametrize("accuracy", ACCURACIES[:2])
def test_bounds_hold_for_machines_as_bad_as_assumed(place, accuracy):
    """The part of rounding, relative to the formula; the bounds of eps relative to the smaller one hold as well."""
    (powers, proven), generator = of(accuracy), np.random.default_rng(5)
    w = np.exp2(generator.uniform(-125, 119, 60_000)).astype(np.float32)
    v_star = w.astype(float) ** 0.1
    found, true = emulated(powers, proven, place, generator, w), formula(powers, proven, w)
    bounds = [b for b in proven.bounds if b.arithmetic == place and b.result in compact.MEANINGS]
    assert len(bounds) == 8
    for bound in bounds:
        inside = (v_star >= float(bound.low)) & (v_star <= float(bound.high))
        eps, value = true["restitution"][inside], true[bound.result][inside]
        reference = np.minimum(eps, 1 - eps) if bound.relative_to == "smaller" else value
        allowed = (float(bound.rounding) * reference + float(bound.last) * value) / (1 + float(bound.formula))
        share = np.abs(found[bound.result][inside] - value) / allowed
        assert 0.05 < share.max() <= 1, bound


@pytest.mark.parametrize("place", [HOST, HOST_FLOAT, DEVICE], ids=lambda place: place.name)
def test_bounds_for_all_arguments_are_nearly_the_largest_for_one(place):
    powers, proven = of("1e-5")
    exponents = np.linspace(1 - place.form.largest, compact.CUT_EXPONENT[place.form.name], 150)
    with working(128):
        parts = [Fraction(2.0**e) for e in (*(exponents / 30), *np.log2(np.linspace(0.1, 10 ** (1 / 3), 20)))]
        numbers, of_y = formulas.constants(powers, proven.a, proven.b), partial(compact._error_of_y, place)
        speed = {"speed": Rounded(arb(1), place.form)}
        on = results_on_parts(
            compact.result_branch(powers), [*compact.MEANINGS], "y", numbers, place, lambda _: speed, of_y
        )
        alone = [(y**3, {name: relative_error(name)(on((y, y))) for name in compact.MEANINGS}) for y in parts]
    for function, sizes in compact.compact_rounding(powers, proven.a, proven.b, place).items():
        common = [found for v, found in alone if compact.COMMON[0] <= v <= compact.COMMON[1]]
        assert len(sizes) == 1 + (place.form == FLOAT)
        for size, among in zip(sizes, ([found for _, found in alone], common), strict=False):
            assert 0.85 * float(size) < max(float(found[function]) for found in among) <= float(size)


def test_common_speeds_are_covered():
    low, high = compact._COMMON_Y
    assert low**3 <= compact.COMMON[0]
    assert compact.COMMON[1] <= high**3 < compact.COMMON[1] * Fraction(101, 100)
    for form in FORMATS.values():
        for ends in (compact._COMMON_Y, compact._range_of_y(form)):
            parts = list(compact._octave_parts(form, *ends))
            assert (parts[0][0], parts[-1][1]) == ends
            assert all(left[1] == right[0] for left, right in itertools.pairwise(parts))
        (low, high), (least, most) = compact._range_of_y(form), compact.v_star_range(form)
        assert low**30 <= Fraction(2) ** (1 - form.largest) < least**10
        assert most**10 < Fraction(2) ** compact.CUT_EXPONENT[form.name] <= high**30


BAD = {
    "library": replace(HOST_FLOAT, functions=Fraction(2000)),
    "log2, absolute": replace(HOST_FLOAT, log2_absolute=Fraction(1, 100)),
    "quotient": replace(HOST_FLOAT, quotient=Fraction(1000)),
}


@pytest.mark.parametrize("place", BAD.values(), ids=BAD)
def test_every_error_of_a_machine_counts(place):
    """One that is far larger than all others: results come close to the bound, and not beyond it."""
    (powers, proven), generator = of("1e-5"), np.random.default_rng(6)
    ends = (-1, 1) if place.log2_absolute else (-126, 120)
    w = np.exp2(generator.uniform(*ends, 20_000)).astype(np.float32)
    bounds = compact.compact_rounding(powers, proven.a, proven.b, place)
    found, true = emulated(powers, proven, place, generator, w), formula(powers, proven, w)
    ratio = {f: np.abs(found[f] / true[f] - 1).max() / float(bounds[f][0]) for f in compact.MEANINGS}
    assert max(ratio.values()) <= 1
    assert ratio["restitution"] > (0.1 if place.log2_absolute else 0.2)


def test_powers_that_overflow_are_refused(monkeypatch):
    powers, proven = of("1e-3")
    monkeypatch.setitem(compact.CUT_EXPONENT, "float", 150)
    with pytest.raises(ArithmeticError, match="may overflow in type float"):
        compact.compact_rounding(powers, proven.a, proven.b, DEVICE)


def arguments(form, generator):
    """Return v* of all sizes, where branches change, and where results underflow."""
    kind = np.float64 if form == DOUBLE else np.float32
    subnormal, tiny_loss = {"double": ((92, 97), (-162, -154)), "float": ((11, 13.6), (-22.5, -19))}[form.name]
    near = [float(np.nextafter(kind(1), kind(side))) for side in (0, 2)]
    found = [10.0 ** generator.uniform(*ends) for ends in (subnormal, tiny_loss) * 3]
    return np.array([*found, *2.0 ** generator.uniform(-15, 15, 1000), *near, 1.0], kind)


@pytest.mark.parametrize("form", FORMATS.values(), ids=FORMATS)
def test_rounding_of_functions_of_v_star_is_within_its_bound(form):
    (powers, proven), kernel = of("1e-5"), compact.half_line("1e-5")
    for function in compact.V_STAR_FUNCTIONS:
        bound, closest = proven.bound(function, form), 0.0
        x = arguments(form, np.random.default_rng(5))
        for at, found in zip(x.tolist(), machine.function_values(kernel, function, x, form=form).tolist(), strict=True):
            with working(300):
                n, d = sums(powers, proven, arb(at).root(3), arb)
                value = (d if function == "epsilon" else arb(at) ** 2 * n) / (d + arb(at) ** 2 * n)
                error, allowed = abs(found - value), arb(float(bound.last / (1 + bound.formula))) * value
                assert error <= allowed + float(bound.absolute * form.smallest), (function, at)
                if value > float(form.least):
                    closest = max(closest, float(error / allowed))
        assert closest > 0.03


# --- which powers -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("accuracy", ["1e-3", 3.5e-6])
def test_the_fewest_coefficients_that_are_accurate_enough(accuracy):
    powers = compact.compact_powers(Fraction(accuracy))
    proven = compact.compact_fit(powers)
    assert proven.certificate.bound < proven.error("restitution") <= Fraction(accuracy)
    before = half_line.BEST[: half_line.BEST.index(powers)]
    assert all(half_line.fit_half_line(powers_).error > float(accuracy) for powers_ in before)


def test_what_is_said_to_be_accepted_is_accepted():
    best = compact.compact(compact.BEST_ACCURACY)
    assert best.formats == ("double",)
    assert best.bounds[0].formula > compact.BEST_ACCURACY * Fraction(95, 100)
    with pytest.raises(ValueError, match=r"accuracy is 1e-09: expected a number from 2\.9e-08 to 0\.99"):
        compact.compact(1e-9)


def test_candidates_without_a_proof_are_passed_over():
    made = []

    def error_of(choice):
        made.append(choice)
        if choice == "unproven":
            raise ArithmeticError
        return Fraction({"rounded": "2e-13", "good": "9e-14"}[choice])

    sampled = [(1e-10, "far"), (6e-14, "unproven"), (7e-14, "rounded"), (8e-14, "good"), (1e-14, "later")]
    assert compact.first_accurate(Fraction("1e-13"), sampled, error_of) == "good"
    assert made == ["unproven", "rounded", "good"]


def test_a_float_whose_powers_would_overflow_is_left_out():
    found = compact.compact_fit(NOT_IN_FLOAT)
    assert found.formats == (DOUBLE,)
    assert {bound.arithmetic for bound in found.bounds} == {HOST}
    assert found.missing["float"] == "y to the power 32 may overflow in type float"


def test_a_kernel_that_is_proven_again_has_the_same_record():
    powers = compact.compact_powers(Fraction("1e-3"))
    assert compact.compact_fit(powers) == compact.compact_fit.__wrapped__(powers)


def test_bad_input():
    with pytest.raises(TypeError, match="accuracy is None: expected a number from"):
        compact.compact(None)


def test_coefficients_that_contradict_themselves_cannot_be_made():
    _, found = of("1e-5")
    with pytest.raises(ValueError, match="b_0 must be 1"):
        replace(found, b=(2.0, *found.b[1:]))
