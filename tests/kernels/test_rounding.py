"""The bound of rounding errors: never exceeded by exact emulations of the code; not vacuous."""

import math
import random
from fractions import Fraction
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from flint import arb

from viscopade.approximation.lacunary import Powers
from viscopade.arithmetic.balls import ball_of, working
from viscopade.arithmetic.formats import DOUBLE, FLOAT, Format
from viscopade.kernels import formulas, quotient, rounding_bounds
from viscopade.kernels.arithmetic import DEVICE, HOST, HOSTS
from viscopade.kernels.expressions import (
    Call,
    CodeBranch,
    Literal,
    Name,
    Reading,
    Run,
    Statement,
    by_powers,
    evaluate,
    powers,
)
from viscopade.kernels.rounding import Rounded, rounded_results
from viscopade.kernels.rounding_bounds import BITS, powers_error
from viscopade.kernels.speed_table import LAST_ULPS, TABLES

ULPS = float(HOST.functions)
LOOSE = 12  # how much larger the bound may be than the largest error found
A, B = (Fraction(1), Fraction(1, 4)), (Fraction(1), Fraction(1, 4), Fraction(23, 20), Fraction(1, 8), Fraction(1, 5))
FORMS = {"double": (DOUBLE, np.float64), "float": (FLOAT, np.float32)}


def quotient_rounding(a, b, form, *ends):
    return quotient.quotient_rounding(a, b, HOSTS[form.name], *ends)


@cache
def machine(name):
    """Return the coefficients as numbers of the format."""
    form, _ = FORMS[name]
    return tuple(tuple(Fraction(form.nearest(c)) for c in values) for values in (A, B))


def value(coefficients, v_star):
    return sum(c * v_star**i for i, c in enumerate(coefficients))


def computed(a, b, kind, v_star):
    """Evaluate as exported: Horner's rule, each operation rounded, then a division."""
    v_star = v_star.astype(kind)
    return sum_of(a, kind, v_star) / sum_of(b, kind, v_star)


def sum_of(values, kind, v_star):
    total = np.full_like(v_star, kind(float(values[-1])))
    for c in reversed(values[:-1]):
        total = (kind(float(c)) + (v_star * total).astype(kind)).astype(kind)
    return total


def nearest(number: Fraction, form) -> Fraction:
    """Round a fraction to nearest, even; numbers are far from under- and overflow."""
    return Fraction(form.nearest(number))


def largest_error(a, b, kind, low, high, number, exact_pair=None):
    """Return the largest relative error at random numbers of the format."""
    draw = np.random.default_rng(3)
    v_star = draw.uniform(float(low), float(high), number).astype(kind)
    found = computed(a, b, kind, v_star)
    if kind is np.float32 and exact_pair is None:  # long doubles or doubles are exact enough
        x = v_star.astype(np.float64)
        n, d = (np.polynomial.polynomial.polyval(x, [float(c) for c in values]) for values in (a, b))
        return float(np.max(np.abs(found.astype(np.float64) / (n / d) - 1)))
    top, bottom = exact_pair or (a, b)
    pairs = zip(map(Fraction, v_star.tolist()), map(Fraction, found.tolist()), strict=True)
    return max(float(abs(y * value(bottom, x) / value(top, x) - 1)) for x, y in pairs)


@pytest.mark.parametrize(("name", "number"), [("double", 4000), ("float", 400_000)])
@pytest.mark.parametrize(("low", "high"), [("0", "5"), ("0.1", "1/3"), ("3", "1000")])
def test_the_bound_holds_and_is_not_vacuous(name, number, low, high):
    form, kind = FORMS[name]
    a, b = machine(name)
    bound = float(quotient_rounding(a, b, form, Fraction(low), Fraction(high)))
    error = largest_error(a, b, kind, Fraction(low), Fraction(high), number)
    assert error <= bound <= LOOSE * error


def test_the_bound_holds_for_devices_as_bad_as_assumed():
    """Quotients are off by 2 units more."""
    draw, (a, b) = np.random.default_rng(5), machine("float")
    v_star = draw.uniform(0, 5, 100_000).astype(np.float32)
    ratio = sum_of(a, np.float32, v_star) / sum_of(b, np.float32, v_star).astype(float)
    found = (ratio + draw.uniform(-1.99, 1.99, len(ratio)) * np.ldexp(1.0, np.frexp(ratio)[1] - 24)).astype(np.float32)
    exact = np.divide(*(np.polynomial.polynomial.polyval(v_star.astype(float), [*map(float, c)]) for c in (a, b)))
    error = np.abs(found / exact - 1).max()
    assert error <= float(quotient.quotient_rounding(a, b, DEVICE, Fraction(0), Fraction(5))) <= LOOSE * error


@pytest.mark.parametrize("name", FORMS)
def test_rounded_coefficients_are_in_the_bound(name):
    """Also those that are a third of a unit off, all in the worst direction: b is below a number, a above one."""
    form, kind = FORMS[name]
    (a, b), third = machine(name), Fraction(1, 3 * 2**form.precision)
    low, high = Fraction(0), Fraction(5)
    bare = quotient_rounding(a, b, form, low, high)
    off = (tuple(c * (1 + s * third) for c in values) for s, values in ((1, a), (-1, b)))
    for exact in ((A, B), tuple(off)):
        assert [nearest(c, form) for c in (*exact[0], *exact[1])] == [*a, *b]
        bound = quotient_rounding(*exact, form, low, high)
        assert bound > bare
        error = largest_error(a, b, kind, low, high, 3000, exact)
        assert error <= float(bound) <= LOOSE * error
    assert bound > bare + 2 * arb(third.numerator) / third.denominator * (1 - 1e-6)


def numerator(coefficients, form, v_star):
    """Return the sum by Horner's rule at one v*; to be called within `working`."""
    given = formulas.dense(a=coefficients, b=(Fraction(1),))
    numbers = {name: Rounded(ball_of(c), form) for name, c in given.items()} | {"v_star": Rounded(v_star, form)}
    branch, _ = formulas.epsilon_branches(given)
    return rounded_results(branch._replace(results={"sum": Name("numerator")}), ["sum"], numbers, form)["sum"]


def test_the_absolute_bound_counts_units_in_the_last_place():
    """3 + 2 * 5: the product is below 16, so rounding moves it by half a unit of 8 at most; so it is with the sum."""
    with working(200):
        half = arb(2) ** (3 - 24)
        total = numerator([Fraction(3), Fraction(2)], FLOAT, arb(5))
        assert total.value == 13
        assert total.absolute == 2 * half
        assert abs(total.relative - 2 * half / 13) < 1e-50
        assert total.underflow == 0


def test_the_relative_bound_counts_roundings():
    """(1 + theta)^2 for a product of products, where the size is not known, and theta^2 is counted."""
    with working(200):
        u = arb(2) ** -4
        short = Format("short", "", 4, 127, 2)
        x = Rounded(arb(3, 3), short)
        once, twice = x * x, x * x * x
        assert once.relative == u
        assert abs(twice.relative - (2 * u + u**2)) < 1e-30
        assert once.underflow == arb(2) ** (1 - 127 - 4)


def test_either_bound_helps_the_other():
    """A sum of positive numbers has the larger relative error, and what it is small against has the absolute one."""
    with working(200):
        u = arb(2) ** -53
        x = Rounded(arb(1), DOUBLE, 100 * u)
        total = x + Rounded(arb(2), DOUBLE)
        assert abs(total.relative - 102 * u / 3) < 1e-30
        product = Rounded(arb(0, 1), DOUBLE, 100 * u) * x
        assert 200 * u < product.relative < 202 * u
        assert 200 * u < product.absolute < 202 * u


@pytest.mark.parametrize("name", FORMS)
def test_underflow_is_in_the_bound(name):
    """Denormal products: half the smallest denormal number is added, and the relative error stays about one unit."""
    form, kind = FORMS[name]
    tiny = float(np.finfo(kind).smallest_subnormal)
    with working(2200):
        product = Rounded(arb(tiny), form) * Rounded(arb(0.5), form)
        assert product.absolute == arb(tiny) / 2
        assert numerator([Fraction(0), Fraction(1, 2)], form, arb(tiny)).absolute == arb(tiny) / 2
    assert kind(0.5) * kind(tiny) == 0  # an error of half of it


def test_an_operation_off_by_units_is_off_by_as_many_where_it_underflows():
    """A device's quotient is wrong by 5/2 units, which are the smallest positive number there; a host's by a half."""
    smallest = 2.0**-149  # of float
    tiny = Rounded(arb(1000 * smallest), FLOAT)
    for units in (0.25, 0.5, 2.5):
        bound = tiny.with_error(arb(units * 2.0**-23)).absolute
        assert max(units, 0.5) <= float(bound.abs_lower()) / smallest < max(units, 0.5) + 0.01


def test_what_is_exact_adds_no_error():
    with working(200):
        x, y = Rounded(arb(3), DOUBLE), Rounded(arb(7), DOUBLE)
        assert (x.exact_sum(y).absolute, x.exact_product(y).absolute, x.exact_quotient(y).absolute) == (0, 0, 0)
        assert min((x + y).absolute, (x * y).absolute, (x / y).absolute) > 0
        assert ((x - y).value, (x - y).absolute) == (-4, arb(2) ** -51)


@pytest.mark.parametrize("name", FORMS)
def test_denominators_that_nearly_vanish_are_refused(name):
    form, _ = FORMS[name]
    root = Fraction(3)
    for b in ((Fraction(1), -1 / root), (Fraction(9), Fraction(-6), Fraction(1))):
        with pytest.raises(ArithmeticError, match="vanish"):
            quotient_rounding((Fraction(1),), b, form, Fraction(2), Fraction(4))
        with pytest.raises(ArithmeticError, match="vanish"):
            quotient_rounding(b, (Fraction(1),), form, Fraction(2), Fraction(4))


@pytest.mark.parametrize(
    ("top", "bottom"),
    [(machine("float")[1], (Fraction(1),)), ((Fraction(1),), machine("float")[1]), machine("float")],
)
def test_the_errors_of_both_sums_are_in_the_bounds(top, bottom):
    """Where v* is one number."""
    low, u = Fraction(2), 2.0**-24
    ends = low, low + Fraction(1, 2**40)
    with working(200):
        first, second = (float(numerator(c, FLOAT, arb(2)).relative) for c in (top, bottom))
        size = float(value(top, low) / value(bottom, low))
    assert first + second > 2 * u
    half_unit = 2.0 ** (np.floor(np.log2(size)) - 24) / size
    assert float(quotient_rounding(top, bottom, FLOAT, *ends)) == pytest.approx(first + second + half_unit, rel=1e-4)


@pytest.mark.parametrize("name", FORMS)
def test_the_bound_of_beta_is_that_of_its_operations(name):
    """v* twice, a product, a quotient, and pow with its exponent 0.2, which is no binary number."""
    form, _ = FORMS[name]
    unit, largest = 2.0**-form.precision, (form.largest + form.precision) * math.log(2)
    of_exponent = float(abs(Fraction(form.nearest(Fraction(1, 5))) - Fraction(1, 5)))
    for of_v_star in (0.0, 10 * unit, 1000 * unit):
        by_hand = 2 * of_v_star + 2 * unit + 2 * ULPS * unit + of_exponent * largest
        with working(BITS):
            found = float(
                powers_error(formulas.beta_branch(), "beta", HOSTS[form.name], {"speed": 0, "v_star": arb(of_v_star)})
            )
        assert by_hand < found < by_hand * (1 + 2000 * unit)


@pytest.mark.parametrize("name", FORMS)
@pytest.mark.parametrize("largest", [Fraction(1), Fraction(10) ** 30, None])
def test_the_bound_of_v_star_is_that_of_its_operations(name, largest):
    """Half of beta's error, sqrt, a product, and pow with its exponent, within any speeds and those of the type."""
    form, _ = FORMS[name]
    unit, log = 2.0**-form.precision, (form.largest + form.precision) * math.log(2)
    log = log if largest is None else math.log(largest)
    of_exponent = float(abs(Fraction(form.nearest(Fraction(1, 10))) - Fraction(1, 10)))
    by_hand = 4 * unit + 2 * ULPS * unit + of_exponent * log + 2 * unit
    with working(BITS):
        ends = None if largest is None else arb(int(largest)).log()
        found = float(
            powers_error(
                formulas.v_star_branch(), "v_star", HOSTS[form.name], {"speed": 0, "beta": arb(8 * unit)}, ends
            )
        )
    assert by_hand <= found * (1 + 1e-15)
    assert found <= by_hand * (1 + 2000 * unit)


def test_a_root_loses_more_below_than_above():
    with working(BITS):
        found = powers_error(formulas.v_star_branch(), "v_star", HOST, {"speed": 0, "beta": arb(0.5)}, arb(0))
        assert found > 1 - arb(0.5).sqrt()


@pytest.mark.parametrize("name", FORMS)
def test_the_error_of_a_root_is_that_of_its_operations(name):
    """A quotient, 1 - eps or 1/v*, has its roundings; a root divides them, and adds its own."""
    form, _ = FORMS[name]
    unit = 2.0**-form.precision
    near, far = formulas.half_line_branches(Powers((0, 4), (0,)))
    wanted = {"near": 2 * ULPS * unit, "far": (2 * ULPS + 1 / 3) * unit}
    with working(BITS):
        found = {
            "near": powers_error(near, "y", HOSTS[form.name], {"v_star": 0}),
            "far": powers_error(far, "u", HOSTS[form.name], {"v_star": 0}),
        }
        for root in (Fraction(1, 2), Fraction(1, 3), Fraction(2, 5), Fraction(1, 6), Fraction(1, 7)):
            odds, power = Name("loss") / Name("epsilon"), Literal(str(float(root)))
            call = Call("sqrt", (odds,)) if root == Fraction(1, 2) else Call("pow", (odds, power))
            branch = CodeBranch(None, (Statement("y", call),), {})
            of_exponent = 700 * float(abs(Fraction(form.nearest(root)) - root))
            of_call = 1.0 if root == Fraction(1, 2) else 2.0 * ULPS + of_exponent / unit
            wanted[str(root)] = (2 * float(root) + of_call) * unit
            found[str(root)] = powers_error(
                branch, "y", HOSTS[form.name], {"epsilon": 0, "loss": arb(unit)}, arb(700), root
            )
    for key, by_hand in wanted.items():
        assert by_hand * (1 - 1e-6) <= float(found[key]) <= by_hand * (1 + 1000 * unit + 1e-6), key


def test_errors_of_sums_are_refused():
    with working(BITS), pytest.raises(ValueError, match="expected products and quotients"):
        powers_error(formulas.beta_of_radii_branch(), "shape", HOST, dict.fromkeys(("densities", "ratio"), 0))


def of_parts(program, expression, parts, form, **exact):
    """Return the largest relative rounding error of a result in units of roundoff, over parts of its inputs."""
    worst = 0.0
    with working(BITS):
        for given in parts:
            balls = {name: arb(low).union(arb(high)) for name, (low, high) in given.items()}
            numbers = {name: Rounded(value, form) for name, value in (balls | exact).items()}
            branch = CodeBranch(None, program, {"result": expression})
            worst = max(worst, float(rounded_results(branch, ["result"], numbers, form)["result"].relative))
    return worst * 2.0**form.precision


@pytest.mark.parametrize("name", FORMS)
def test_the_stated_units_cover_the_last_operations(name):
    """By the one analysis; a unit in the last place is one to two units of roundoff."""
    form, _ = FORMS[name]
    branch = TABLES["1e-5"].sums()
    marks = [2.0**-k * (1 + j / 16) for k in range(40, 1, -1) for j in range(16)] + [0.5]
    found = {}
    for base, sign in ((1, -1), (0, 1)):
        parts = [{"p": sorted((sign * low, sign * high)), "speed": (1, 2)} for low, high in pairwise(marks)]
        exact = {"base": arb(base), "rest_of_base": arb(1 - base)}
        for result in ("dissipation", "rebound"):
            found[result, base] = of_parts(branch.program, branch.results[result], parts, form, **exact)
    of = formulas.lost_energy(Name("epsilon"), Name("loss"))
    grid = [*pairwise(i / 256 for i in range(1, 256))]
    found["of_epsilon"] = of_parts((), of["of_epsilon"], [{"epsilon": part} for part in grid], form)
    found["of_loss"] = of_parts((), of["of_loss"], [{"loss": part} for part in grid], form)
    small, large = of["of_both"].met, of["of_both"].otherwise
    found["of_both, small"] = of_parts((), small, [{"epsilon": part} for part in grid if part[1] <= 0.5], form)
    both = [{"epsilon": part, "loss": (1 - part[1], 1 - part[0])} for part in grid if part[0] >= 0.5]
    found["of_both, large"] = of_parts((), large, both, form)
    assert all(1 <= size <= LAST_ULPS for size in found.values()), found
    assert max(found.values()) > LAST_ULPS - 1
    assert max(found.values()) < 4  # roundings that are counted of the table of full accuracy


# --- slopes, and the largest bound of all parts -----------------------------------------------------------------------


def random_float(generator, low, high):
    return float(np.float32(generator.uniform(low, high)))


def test_bounds_of_rounding_errors_hold():
    """Random programs of type float: no error beyond the bound, and some not far below."""
    generator, closest = random.Random(3), 0.0
    lacunary_sum = by_powers("y", ((0, "a"), (2, "b"), (7, "c")))
    program_ = (*powers("y", {2, 5}), Statement("sum", lacunary_sum))
    branch = CodeBranch(None, program_, {"result": Name("sum") / (Name("a") + Name("y5") * Name("y2"))})
    for _ in range(400):
        low = generator.uniform(0, 1)
        part = (low, low + generator.uniform(0, 0.05))
        a, b, c = (random_float(generator, *ends) for ends in ((0.5, 2), (-2, 2), (-2, 2)))
        with working(128):
            given = {k: Rounded(arb(x), FLOAT) for k, x in (("a", a), ("b", b), ("c", c))}
            y = arb(part[0]).union(arb(part[1]))
            try:
                found = rounded_results(branch, ["result"], given | {"y": Rounded(y, FLOAT, slope=1)}, FLOAT)
                bound = found["result"].with_error_of_y(arb(0))
            except ArithmeticError:  # the sum vanishes
                continue
        for _ in range(20):
            x = random_float(generator, *part)
            inputs = {"a": a, "b": b, "c": c, "y": x}
            found, true = (
                evaluate(
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


@pytest.mark.parametrize(("start", "end"), [("0", "5"), ("1e-6", "1e-3"), ("1/1000", "2"), ("3", "1000")])
def test_parts_cover_the_interval_without_gaps(start, end):
    parts = list(rounding_bounds.parts_from(Fraction(start), Fraction(end)))
    assert (parts[0][0], parts[-1][1]) == (Fraction(start), Fraction(end))
    assert all(low < high for low, high in parts)
    assert all(left[1] == right[0] for left, right in pairwise(parts))


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
        found = rounding_bounds.largest_bound(on, [(Fraction(0), Fraction(1))], bound)
        assert 0.25 <= found <= 0.25 * (1 + 1 / 16)


def test_what_has_no_bound_is_refused(monkeypatch):
    monkeypatch.setattr(rounding_bounds, "MOST_PARTS", 30)
    whole = [(Fraction(0), Fraction(1))]

    def never(part):
        raise ArithmeticError("never")

    with pytest.raises(ArithmeticError, match="never"):
        rounding_bounds.largest_bound(never, whole, lambda _: arb(1))
    with pytest.raises(ArithmeticError, match="there is no bound from 0 to "):
        rounding_bounds.largest_bound(lambda part: part, whole, lambda part: arb.nan() if part[0] == 0 else arb(1))
