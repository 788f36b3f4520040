"""Exported kernels in powers of a root: programs, bounds of rounding, C (compiled), Python (executed), records."""

from __future__ import annotations

import math
import random
import re
from fractions import Fraction
from functools import cache
from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest
from flint import arb

from tests import compiled
from viscopade import store
from viscopade.approximation import half_line, inverse
from viscopade.approximation.lacunary import Powers, full_powers
from viscopade.arithmetic.balls import ball_of, working
from viscopade.arithmetic.formats import DOUBLE, FLOAT
from viscopade.kernels import expressions, formulas, prove_lacunary, rounding_bounds
from viscopade.kernels.expressions import (
    Literal,
    Name,
    Reading,
    Run,
    Select,
    both,
    by_horner,
    by_powers,
    chain,
    in_pairs,
    powers,
)
from viscopade.kernels.forms.lacunary_kernels import HalfLineKernel, InverseKernel, interval_start
from viscopade.kernels.rounding import Rounded, of_branch
from viscopade.kernels.targets.c import half_line_functions
from viscopade.kernels.targets.c import render as render_c
from viscopade.kernels.targets.syntax import MATH_MODULE, of_c, text

COMMAND = "viscopade export c --inverse 1e-3"
FORMS = {"double": DOUBLE, "float": FLOAT}
TYPES = {"double": np.float64, "float": np.float32}
EPSILON_MIN = Fraction("0.3")
MIXED_SIGNS = Powers((0, 4, 12, 19), (0, 4, 6, 8, 15))
SMALL = Powers((0, 4, 8), (0, 4))
WHOLE = Powers((0, 16), (0, 10, 18))
NOT_IN_FLOAT = Powers((0, 6, 12, 13, 17, 18, 26), (0, 6, 8, 9, 10, 22))


@cache
def kernels():
    """Return one kernel of each kind; that of half-line "both" has sums of mixed signs."""
    return (
        prove_lacunary.of_half_line(MIXED_SIGNS, "both"),
        prove_lacunary.of_half_line(SMALL, "relative"),
        prove_lacunary.of_inverse(WHOLE),
        prove_lacunary.of_inverse(full_powers(2, 2), epsilon_min=EPSILON_MIN),
    )


def half_lines():
    return kernels()[:2]


def inverses():
    return kernels()[2:]


each_form = pytest.mark.parametrize("form", ["double", "float"])


BUILDS = {"plain": [], "contracted": ["-ffp-contract=fast", *compiled.FMA]}


@cache
def header():
    """Return all functions: those of half-line kernels are in headers with tables, in type double."""
    return render_c(inverses(), COMMAND) + half_line_functions(half_lines())


@pytest.fixture(scope="module")
def libraries(tmp_path_factory):
    directory = tmp_path_factory.mktemp("lacunary")
    return {name: compiled.build(directory, [header()], flags=flags) for name, flags in BUILDS.items()}


def suffix(form):
    return FORMS[form].suffix


# --- programs ---------------------------------------------------------------------------------------------------------


def test_chains_of_powers():
    steps = chain(frozenset({7, 15, 4}))
    have = {1}
    for step in steps:
        assert {step.left, step.right} <= have
        assert step.power == step.left + step.right
        have.add(step.power)
    assert {7, 15, 4} <= have
    # The shortest addition chains: Knuth, section 4.6.3.
    assert [len(chain(frozenset({n}))) for n in (1, 2, 3, 7, 15, 23, 32, 47)] == [0, 1, 2, 4, 5, 6, 5, 8]
    with pytest.raises(ValueError, match="whole numbers >= 1"):
        chain(frozenset({0, 3}))


def test_text_keeps_the_order_of_evaluation():
    generator = random.Random(1)
    names = {name: generator.uniform(0.5, 2) for name in "abcde"}

    def expression(depth):
        if depth == 0:
            return Name(generator.choice("abcde")) if generator.random() < 0.8 else Literal("0.1")
        left, right = expression(depth - generator.randint(1, depth)), expression(depth - 1)
        return generator.choice([left + right, left * right, left / right, right / left])

    for _ in range(300):
        made = expression(4)
        value = expressions.evaluate(made, names, Reading(float))
        assert eval(text(made, MATH_MODULE), dict(names)) == value
        assert eval(text(made, of_c(DOUBLE)), dict(names)) == value


@pytest.mark.parametrize("parts", [*product((False, True), repeat=3)], ids=str)
def test_choices_in_python_within_each_other(parts):
    one, two, three, four = map(Literal, "1234")
    x, y, z = (Name(name) for name in "xyz")
    given = dict(zip("xyz", parts, strict=True))
    for made in (
        Select(x, Select(y, one, two), Select(z, three, four)),
        Select(Select(x, y, z), one, two) + three,
        Select(both(both(x, y), z), one, two),
    ):
        assert eval(text(made, MATH_MODULE), dict(given)) == expressions.evaluate(made, given, Reading(float))


def test_horner_with_gaps():
    assert text(by_powers("y", formulas.named("a", (0, 4, 8))), MATH_MODULE) == "a0 + y4 * (a4 + y4 * a8)"
    assert text(by_powers("y", formulas.named("a", (0, 1, 3))), MATH_MODULE) == "a0 + y * (a1 + y2 * a3)"
    assert text(by_horner("v", formulas.named("a", (0, 1, 3))), MATH_MODULE) == "a0 + v * (a1 + v * (v * a3))"
    assert text(in_pairs("m", "mm", "abcde"), MATH_MODULE) == "(a + m * b) + mm * ((c + m * d) + mm * e)"
    values = Run(powers("y", {3, 5}), {"y": Fraction(2)}, Reading(Fraction))
    assert (values["y3"], values["y5"]) == (8, 32)


def test_programs_are_the_formulas():
    """In exact numbers, given the root: both branches of all kernels."""
    y = Fraction(3, 5)
    for kernel in kernels():
        variant = kernel.variants[0]
        numbers = {k: Fraction(c) for k, c in formulas.constants(kernel.powers, variant.a, variant.b).items()}
        parts = ((kernel.powers.top, variant.a), (kernel.powers.bottom, variant.b))
        for variable, branch in zip("yu", kernel.branches, strict=False):
            at = y if variable == "y" else 1 / y
            given = {**numbers, variable: y, "v_star": at**3}
            values = Run(branch.program, given, Reading(Fraction))
            found = {k: expressions.evaluate(e, values, Reading(Fraction)) for k, e in branch.results.items()}
            n, d = (sum(Fraction(c) * at**k for k, c in zip(*part, strict=True)) for part in parts)
            if isinstance(kernel, HalfLineKernel):
                assert found["epsilon"] == d / (d + at**6 * n) == found.get("limit", 0) / at**10 or "limit" not in found
                assert found["one_minus_epsilon"] == at**6 * n / (d + at**6 * n)
            else:
                assert found["v_star"] == at ** int(1 / (2 * kernel.root)) * n / d


# --- bounds of rounding errors ----------------------------------------------------------------------------------------


def random_float(generator, low, high):
    return float(np.float32(generator.uniform(low, high)))


def test_bounds_of_rounding_errors_hold():
    """Random programs of type float: no error beyond the bound, and some not far below."""
    generator, closest = random.Random(3), 0.0
    lacunary_sum = by_powers("y", ((0, "a"), (2, "b"), (7, "c")))
    program_ = (*powers("y", {2, 5}), expressions.Statement("sum", lacunary_sum))
    branch = expressions.CodeBranch(None, program_, {"result": Name("sum") / (Name("a") + Name("y5") * Name("y2"))})
    for _ in range(400):
        low = generator.uniform(0, 1)
        part = (low, low + generator.uniform(0, 0.05))
        a, b, c = (random_float(generator, *ends) for ends in ((0.5, 2), (-2, 2), (-2, 2)))
        with working(128):
            given = {k: Rounded(arb(x), FLOAT) for k, x in (("a", a), ("b", b), ("c", c))}
            y = arb(part[0]).union(arb(part[1]))
            try:
                found = of_branch(branch, ["result"], given | {"y": Rounded(y, FLOAT, slope=1)}, FLOAT)
                bound = found["result"].with_error_of_y(arb(0))
            except ArithmeticError:  # the sum vanishes
                continue
        for _ in range(20):
            x = random_float(generator, *part)
            inputs = {"a": a, "b": b, "c": c, "y": x}
            found, true = (
                expressions.evaluate(
                    branch.results["result"],
                    Run(program_, {k: kind(v) for k, v in inputs.items()}, Reading(kind)),
                    Reading(kind),
                )
                for kind in (np.float32, Fraction)
            )
            error = abs(Fraction(float(found)) - true)
            assert bound.value.contains(arb(true.numerator) / true.denominator) or not part[0] <= x <= part[1]
            assert error <= Fraction(float(bound.relative)) * abs(true) + Fraction(float(bound.underflow))
            closest = max(closest, float(error / abs(true)) / float(bound.relative))
    assert closest > 0.1


def test_a_sum_that_may_vanish_is_refused():
    with working(128):
        one, y = Rounded(arb(1), FLOAT), Rounded(arb(-1, 0.5), FLOAT, relative=1e-3, slope=1)
        vanishing = one + y
        assert not vanishing.relative.is_finite()
        assert 1e-3 < vanishing.absolute < 2e-3
        with pytest.raises(ArithmeticError, match="may vanish"):
            vanishing.with_error_of_y(arb(0))
        with pytest.raises(ArithmeticError, match="may vanish"):
            one / vanishing
        assert (one + vanishing).relative > 1e-3


def test_slopes():
    """d ln/d ln y of y^5/(1 + 2 y^3) at y = 1/2: 5 - 3/5."""
    with working(128):
        y = Rounded(arb("0.5"), DOUBLE, slope=1)
        one, two = Rounded(arb(1), DOUBLE), Rounded(arb(2), DOUBLE)
        cube = y * y * y
        result = cube * y * y / (one + two * cube)
        assert abs(result.slope - arb(22) / 5) < 1e-30
        assert result.with_error_of_y(arb(1e-3)).relative > 4.4e-3


@pytest.mark.parametrize("sign", [1, -1])
def test_slopes_of_sums_with_one_large_term_are_close_on_wide_parts(sign):
    """y^16/(y^16 + sign) goes with 16; between 3.9 and 4.1 y^16 changes by more than a factor 2."""
    with working(128):
        y = Rounded(arb(4, 0.1), DOUBLE, slope=1)
        power = y * y
        for _ in range(3):
            power = power * power
        for total in (power + Rounded(arb(sign), DOUBLE), Rounded(arb(sign), DOUBLE) + power):
            for at in (arb("3.91"), arb(4), arb("4.09")):
                assert total.slope.contains(16 * at**16 / (at**16 + sign))
            assert total.slope.rad() < 1e-6
            assert total.relative < 17 * arb(2) ** -53


def test_the_error_of_a_sum_that_nearly_vanishes_stays_absolute():
    """On a part where a sum is from 1/1000 to 1/10, what is added to it decides how much its error counts."""
    with working(128):
        y = Rounded(arb("0.9495", "0.0495"), DOUBLE, relative=1e-9, slope=1)
        small = Rounded(arb(1), DOUBLE) + Rounded(arb(-1), DOUBLE) * y
        assert small.value.abs_lower() > 0.0009
        total = Rounded(arb(1), DOUBLE) + small
        assert 0.9e-9 < total.relative < 1.1e-9


def test_the_part_with_the_largest_bound_is_halved():
    """x (1 - x) on [0, 1], with bounds that are too large by the width of the part, and none for wide ones."""

    def on(part):
        if part[1] - part[0] > Fraction(1, 10):
            raise ArithmeticError("too wide")
        return part

    def bound(part):
        nearest = min(max(Fraction(1, 2), part[0]), part[1])
        return ball_of(nearest * (1 - nearest) + part[1] - part[0])

    with working(64):
        found = rounding_bounds.largest(on, [(Fraction(0), Fraction(1))], bound)
        assert 0.25 <= found <= 0.25 * (1 + 1 / 16)


def test_what_has_no_bound_is_refused(monkeypatch):
    monkeypatch.setattr(rounding_bounds, "MOST_PARTS", 30)
    whole = [(Fraction(0), Fraction(1))]

    def never(part):
        raise ArithmeticError("never")

    with pytest.raises(ArithmeticError, match="never"):
        rounding_bounds.largest(never, whole, lambda _: arb(1))
    with pytest.raises(ArithmeticError, match="there is no bound from 0 to "):
        rounding_bounds.largest(lambda part: part, whole, lambda part: arb.nan() if part[0] == 0 else arb(1))


def test_bounds_for_all_arguments_are_nearly_the_largest_for_one(monkeypatch):
    """A search that stops later finds hardly less."""
    kernel = prove_lacunary.inverse_kernel("1e-5")
    for variant in kernel.variants:
        given = kernel.powers, kernel.form, Fraction(0), variant.a, variant.b, variant.form
        monkeypatch.setattr(rounding_bounds, "_NEARLY", Fraction(1, 1024))
        least = float(rounding_bounds.inverse_sizes.__wrapped__(*given)["v_star"].relative)
        assert 0.9 < least / float(dict(variant.sizes)["v_star"].relative) <= 1


def test_what_underflow_does_is_counted():
    with working(128):
        tiny = Rounded(arb(2) ** -1000, DOUBLE)
        square = tiny * tiny
        assert square.underflow == arb(2) ** -1075
    assert DOUBLE.smallest == Fraction(5e-324)
    assert FLOAT.smallest == Fraction(1, 2**149)


@each_form
def test_math_h_is_as_accurate_as_assumed(form, tmp_path):
    """A sample: cbrt and pow of this machine against exact powers."""
    source = (
        "#include <math.h>\n"
        "static inline double viscopade_cbrt(double x) { return cbrt(x); }\n"
        "static inline double viscopade_pow(double x) { return pow(x, 0.1); }\n"
        "static inline float viscopade_cbrtf(float x) { return cbrtf(x); }\n"
        "static inline float viscopade_powf(float x) { return powf(x, 0.1f); }\n"
    )
    library = compiled.build(tmp_path, [re.sub(r"\) \{ (.*) \}", r")\n{ \1 }", source)])
    generator = random.Random(7)
    exponent = {"cbrt": Fraction(1, 3), "pow": Fraction(FORMS[form].nearest(Fraction("0.1")))}
    for name in ("cbrt", "pow"):
        worst = 0.0
        for _ in range(3000):
            x = float(TYPES[form](2.0 ** generator.uniform(-120, 120)))
            found = library[name + suffix(form)](x)
            with working(128):
                true = (arb(x).log() * exponent[name].numerator / exponent[name].denominator).exp()
                ulp = float(np.spacing(TYPES[form](found)))
                worst = max(worst, float(abs(found - true) / ulp))
        assert 0.3 < worst < rounding_bounds.ULPS


# --- compiled code ----------------------------------------------------------------------------------------------------


def formula_ball(kernel, variant, x):
    """Return the exact formula's values in type `variant`, of v* or of (epsilon, 1 - epsilon), at 300 bits."""
    top, bottom = (
        [(k, arb(c)) for k, c in zip(exponents, values, strict=True)]
        for exponents, values in ((kernel.powers.top, variant.a), (kernel.powers.bottom, variant.b))
    )
    if isinstance(kernel, HalfLineKernel):
        y = arb(x).root(3)
    else:
        odds = x[1] / x[0]
        y = odds.sqrt() if kernel.epsilon_min else odds.root(10)
    n, d = (sum((c * y**k for k, c in part), arb(0)) for part in (top, bottom))
    if isinstance(kernel, HalfLineKernel):
        return {"epsilon": d / (d + y**6 * n), "one_minus_epsilon": y**6 * n / (d + y**6 * n)}
    return {"v_star": y ** int(1 / (2 * kernel.root)) * n / d}


def arguments(kernel, form, generator):
    """Return arguments of a kernel: of all sizes, where branches change, and where results underflow."""
    kind, near = TYPES[form], [float(np.nextafter(TYPES[form](1), TYPES[form](side))) for side in (0, 2)]
    if isinstance(kernel, HalfLineKernel):
        subnormal, tiny_loss = {"double": ((92, 97), (-162, -154)), "float": ((11, 13.6), (-22.5, -19))}[form]
        found = [10.0 ** generator.uniform(*ends) for ends in (subnormal, tiny_loss) * 3]
        return [float(kind(x)) for x in (*found, *(2.0 ** generator.uniform(-15, 15) for _ in range(2000)), *near, 1.0)]
    low = max(float(kernel.epsilon_low), float(np.finfo(kind).tiny))
    found = [low, 0.5, near[0], *(low ** generator.random() for _ in range(300))]
    return [float(kind(x)) for x in found if low <= kind(x) <= 1]


@pytest.mark.parametrize(
    ("which", "form"), [(0, "double"), (1, "double"), *product((2, 3), FORMS)], ids=lambda value: str(value)
)
@pytest.mark.parametrize("build", BUILDS)
def test_rounding_is_within_its_bound(libraries, which, form, build):
    kernel = kernels()[which]
    variant = kernel.variant(FORMS[form])
    generator, kind, closest = random.Random(5), TYPES[form], 0.0
    for x in arguments(kernel, form, generator):
        with working(300):
            exactly = formula_ball(kernel, variant, x if isinstance(kernel, HalfLineKernel) else (arb(x), 1 - arb(x)))
            for function, value in exactly.items():
                sizes = dict(variant.sizes)[function]
                found = libraries[build][f"{function}_{kernel.name}{suffix(form)}"](x)
                error, allowed = abs(found - value), arb(sizes.relative) * value
                assert error <= allowed + arb(sizes.underflow) * float(FORMS[form].smallest), (
                    function,
                    x.hex(),
                )
                if value > float(np.finfo(kind).tiny):
                    closest = max(closest, float(error / allowed))
    assert closest > 0.03


@each_form
def test_ends_of_an_interval_are_within(libraries, form):
    """0.3 in decimal is a little below or above 3/10 in binary: it belongs to the interval, as does 1 - 0.3."""
    kernel = inverses()[1]
    assert kernel.epsilon_min == Fraction("0.3")
    v_star, from_loss = (libraries["plain"][f"{n}_{kernel.name}{suffix(form)}"] for n in ("v_star", "v_star_from_loss"))
    kind = TYPES[form]
    for x in (0.3, float(kind(0.3))):
        assert v_star(x) > 1
    for x in (0.7, float(kind(0.7)), float(kind(1) - kind(0.3))):
        assert from_loss(x) > 1
    least = float(kernel.domain.split()[0])  # as stated
    assert v_star(least) > 1
    assert math.isnan(v_star(float(np.nextafter(kind(least), kind(0)))))
    assert math.isnan(from_loss(float(np.nextafter(kind(1 - least), kind(1)))))
    for low in (Fraction("0.3"), Fraction("0.1"), Fraction(1, 3), Fraction(1, 5000)):
        start = interval_start(low)
        assert 0 <= low - start < Fraction(1, 2**24)
        assert all(Fraction(float(np.float32(float(x)))) == x for x in (start, 1 - start))


# --- text -------------------------------------------------------------------------------------------------------------


def test_a_kernel_that_is_proven_again_has_the_same_record():
    rounding_bounds.half_line_sizes.cache_clear()
    with store.anew():
        assert prove_lacunary.of_half_line(MIXED_SIGNS, "both") == kernels()[0]


# --- constructors -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("accuracy", "measure"), [("1e-3", "relative"), (3.5e-6, "both")])
def test_the_fewest_coefficients_that_are_accurate_enough(accuracy, measure):
    kernel = prove_lacunary.half_line_kernel(accuracy, measure)
    total = kernel.variants[0].total(kernel.checked)
    assert Fraction(kernel.variants[0].certificate.bound) < total <= Fraction(accuracy)
    best = half_line.BEST[measure]
    before = best[: best.index(kernel.powers)]
    assert all(half_line.fit_half_line(powers_, measure).error > float(accuracy) for powers_ in before)


def test_inverse_constructor():
    fewest = next(powers for powers in inverse.WHOLE if inverse.fit_whole(powers).error <= 1e-3)
    assert prove_lacunary.inverse_kernel("1e-3").powers.coefficients == fewest.coefficients
    kernel = prove_lacunary.inverse_kernel("1e-3", 0.5)
    assert isinstance(kernel, InverseKernel)
    assert kernel.variants[0].total(kernel.checked) <= Fraction("1e-3")
    count = kernel.powers.coefficients
    for m in range(count - 1):
        assert inverse.fit_interval(m, count - 2 - m, "0.5").error > 1e-3


def test_what_is_said_to_be_accepted_is_accepted():
    with pytest.raises(ValueError) as refused:
        prove_lacunary.half_line_kernel(1e-9)
    accuracy = re.search(r">= (\S+),", str(refused.value))[1]
    assert prove_lacunary.half_line_kernel(accuracy).variants[0].total(("epsilon",)) <= Fraction(accuracy)


def test_a_refusal_names_an_error_that_a_proof_reaches():
    """Candidates without a proof are passed over; the nearest miss with one is named if no other candidate has one."""
    proven, made = {"near": "1.1e-11", "far": "1e-20"}, []

    def make(choice):
        made.append(choice)
        if choice.startswith("unproven"):
            raise ArithmeticError
        return SimpleNamespace(checked=(), variant=lambda _: SimpleNamespace(total=lambda _: Fraction(proven[choice])))

    sampled = [(1e-10, "far"), (2e-12, "near"), (1e-12, "unproven miss"), (6e-14, "unproven")]
    with pytest.raises(ValueError, match=r"^accuracy is 1e-13: accepted is a number >= 1\.1e-11, "):
        prove_lacunary._first(Fraction("1e-13"), sampled, make)
    assert made == ["unproven", "unproven miss", "near"]


def test_a_float_that_is_much_less_accurate_is_left_out():
    kernel = prove_lacunary.of_half_line(NOT_IN_FLOAT, "both")
    assert [v.form for v in kernel.variants] == [DOUBLE]
    with pytest.raises(ValueError, match="the error would be"):
        kernel.variant(FLOAT)


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (
            lambda: prove_lacunary.half_line_kernel(1e-9),
            ValueError,
            "accuracy is 1e-09: accepted is a number >= 2.8.*e-8",
        ),
        (
            lambda: prove_lacunary.half_line_kernel(0.1, "absolute"),
            ValueError,
            "measure is 'absolute': accepted is 'both' or 'relative'",
        ),
        (lambda: prove_lacunary.half_line_kernel(None), TypeError, "accuracy is None: accepted is a number from"),
        (lambda: prove_lacunary.inverse_kernel(0.1, 1), ValueError, "epsilon_min is 1: accepted is 0, or a number"),
        (
            lambda: prove_lacunary.inverse_kernel(1e-12),
            ValueError,
            "accuracy of the inverse is 1e-12: accepted is a number >=",
        ),
    ],
)
def test_bad_input(call, error, message):
    with pytest.raises(error, match=message):
        call()


def test_kernels_that_contradict_themselves_cannot_be_made():
    both, relative, _, interval = kernels()
    with pytest.raises(ValueError, match="wrong number of coefficients"):
        HalfLineKernel(SMALL, both.variants, (), both.source, None)
    with pytest.raises(ValueError, match="one interval and one measure"):
        HalfLineKernel(both.powers, (*both.variants, *relative.variants), (), both.source, None)
    with pytest.raises(ValueError, match="for all v"):
        HalfLineKernel(interval.powers, interval.variants, (), both.source, None)
    with pytest.raises(ValueError, match="must be one of v"):
        InverseKernel(both.powers, both.variants, (), both.source, None, Fraction(0))
    variant = both.variants[1]
    with pytest.raises(ValueError, match="not a number of type float"):
        type(variant)(FLOAT, (0.1, *variant.a[1:]), variant.b, variant.certificate, variant.sizes)
    with pytest.raises(ValueError, match="b_0 must be 1"):
        type(variant)(FLOAT, variant.a, (2.0, *variant.b[1:]), variant.certificate, variant.sizes)
