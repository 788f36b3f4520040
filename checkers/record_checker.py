"""Check the package's records of kernels (JSON files) by fractions and mpmath, without the package or FLINT.

    python checkers/record_checker.py src/viscopade/data/kernels [--every N --start K]

Each record is the result of a function of the package; its key begins with a name, and `CHECKS` has a check for each
name. With `--every N`, each N-th row, panel or part is checked, from number K on.

The program proves again the certificates of formulas, the monotonicity of tables, and the choice of powers. It samples
the errors of table rows and rounding errors: every operation is rounded to nearest in fractions, roots are changed by
their largest error in units in the last place, and the result is compared with the exact formula. The reference is a
text file with polynomials for eps and 1 - eps and a bound of their relative errors, which is assumed to be right.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from random import Random
from typing import Any, NamedTuple, TypeVar

from mpmath import mp

import certificate_checker
import interval_checker
from certificate_checker import DATA, ERROR, LAST, REFERENCE, Wrong, number, panel_ends
from table_checker import (
    PRECISION,
    Header,
    Point,
    exponent_of,
    falls,
    rises,
    rounded,
    share_of_formula,
    ulp,
    unpacked,
)

SLOPE = Fraction(10, 3)  # the largest |d ln eps/d ln v*| and |d ln(1 - eps)/d ln v*|
LARGEST = {"double": 1024, "float": 128}  # exponent of the power of 2 beyond the largest number
ROOTS = 4  # units in the last place that cbrt, pow, log2 and exp2 may be off
PLACES = {
    "host double": {},
    "host float": {},
    "device float": {
        "root": Fraction(5, 2),
        "power": Fraction(9, 2),
        "quotient": Fraction(5, 2),
        "log2": Fraction(1, 2**22) + Fraction(1, 2**25),
    },
}
"""By name of an arithmetic: units in the last place that log2 and exp2, and quotients, may be off; an absolute error of
log2."""
LIKE = Fraction(21, 20)  # by which a bound may exceed the same bound with a slope that is rounded up
Item = TypeVar("Item")

mp.prec = 300


class Sample(NamedTuple):
    """Each `spacing`-th item, from number `start` on."""

    spacing: int = 1
    start: int = 0

    def select(self, items: Sequence[Item]) -> Sequence[Item]:
        """Return the chosen items; one at least."""
        return items[self.start % min(self.spacing, max(len(items), 1)) :: self.spacing]

    @property
    def random(self) -> Random:
        """Random numbers, others for each start."""
        return Random(self.start)


def claim(holds: bool, what: str) -> None:
    """Raise `Wrong` if something does not hold."""
    if not holds:
        raise Wrong(what)


# --- exact values -----------------------------------------------------------------------------------------------------


def fraction(value: Any) -> Fraction:
    """Return the exact value of a number of mpmath."""
    sign, mantissa, exponent, _ = value._mpf_
    whole = int(-mantissa if sign else mantissa)
    return Fraction(whole << exponent) if exponent >= 0 else Fraction(whole, 1 << -exponent)


def real(value: Fraction) -> Any:
    """Return a number of mpmath, to its precision."""
    return mp.mpf(value.numerator) / value.denominator


@lru_cache(maxsize=1)
def reference() -> dict[tuple[str, int], certificate_checker.Coefficients]:
    """Return the reference's polynomials."""
    return certificate_checker.rows(REFERENCE)


def place(v_star: Any) -> tuple[int, Any]:
    """Return the panel of a v* below 2^23, and where on it v* is."""
    v = fraction(v_star)
    claim(0 <= v < LAST, f"v* = {float(v):g} is beyond the reference")
    exponent = exponent_of(v) if v else -1000
    panel = 0 if exponent < -4 else 1 + 8 * (exponent + 4) + int((v / Fraction(2) ** exponent - 1) * 8)
    _, centre, half = panel_ends(panel)
    return panel, (v_star - real(centre)) / real(half)


def truth(v_star: Any) -> dict[str, Fraction]:
    """Return eps and 1 - eps at a v* below 2^23, to the reference's accuracy."""
    panel, z = place(v_star)
    values = {}
    for name in ("epsilon", "one_minus_epsilon"):
        total = mp.mpf(0)
        for c in reversed(reference()[name, panel]):
            total = total * z + real(c)
        values[name] = fraction(total)
    return values


def point(w: Fraction) -> Point:
    """Return enclosures of eps and 1 - eps at w = v*^10."""
    exact = truth(mp.root(real(w), 10))
    ends = [(x * (1 - 2 * ERROR), x * (1 + 2 * ERROR)) for x in (exact["epsilon"], exact["one_minus_epsilon"])]
    return Point(w, *ends)


# --- rounded arithmetic -----------------------------------------------------------------------------------------------


class Machine:
    """Arithmetic of a type, every operation rounded to nearest; roots are off by up to some units in the last place."""

    def __init__(self, place: str, random: Random) -> None:
        self.precision, self.random, self.off = PRECISION[place.split()[-1]], random, PLACES.get(place, {})

    def __call__(self, value: Fraction) -> Fraction:
        """Return the nearest number."""
        return rounded(value, self.precision)

    def rounded(self, coefficients: Mapping[int, Fraction]) -> dict[int, Fraction]:
        """Return coefficients in the type."""
        return {k: self(c) for k, c in coefficients.items()}

    def root(self, exact: Any, name: str = "root") -> Fraction:
        """Return a result of a function of the library, which may be off by some units."""
        value = fraction(exact)
        if not value:
            return value
        error = Fraction(self.random.randrange(-1000, 1001), 1000) * (self.off.get(name, Fraction(ROOTS)) - 1)
        return self(value + error * ulp(value, self.precision))

    def power(self, y: Fraction, n: int) -> Fraction:
        """Return y^n by squares and products."""
        result = Fraction(1)
        for bit in f"{n:b}":
            result = self(result * result)
            result = self(result * y) if bit == "1" else result
        return result

    def horner(self, coefficients: Mapping[int, Fraction], y: Fraction) -> Fraction:
        """Return a sum of c_k y^k."""
        exponents = sorted(coefficients, reverse=True)
        total = coefficients[exponents[0]]
        for above, k in pairwise(exponents):
            total = self(self(total * self.power(y, above - k)) + coefficients[k])
        return self(total * self.power(y, exponents[-1]))

    def quotient(self, x: Fraction, y: Fraction) -> Fraction:
        """Return x/y; in CUDA it may be off as well."""
        return self.root(real(x / y), "quotient") if "quotient" in self.off else self(x / y)


def polynomial(coefficients: Mapping[int, Fraction], y: Any) -> Any:
    """Return the same sum, exactly enough."""
    return mp.fsum(real(c) * y**k for k, c in coefficients.items())


def dense(values: Sequence[str]) -> dict[int, Fraction]:
    """Return coefficients by their powers."""
    return {k: number(text) for k, text in enumerate(values) if number(text)}


def within(computed: Fraction, exact: Any, bound: Fraction, what: str) -> None:
    """Check a relative error."""
    share = abs(real(computed) / exact - 1) / real(bound)
    claim(share <= 1, f"{what}: the error is {mp.nstr(share, 4)} of the bound")


# --- formulas ---------------------------------------------------------------------------------------------------------

Value = Any


def entry_of(bound: Mapping[str, Any], formula: Mapping[str, Any]) -> dict[str, Any]:
    """Return a certificate as the files in exports/ have it."""
    return {
        **formula,
        **bound,
        "v_star_min": bound["low"],
        "v_star_max": None if bound["high"] == "inf" else bound["high"],
        "reference": REFERENCE,
        "reference_error": float(ERROR).hex(),
    }


Bounds = Sequence[Mapping[str, str]]


def bounds_of(bounds: Bounds, result: str, place: str | None = None) -> Bounds:
    """Return the bounds of a result, in one arithmetic or in all; omitted parts of a bound are 0."""
    return [b for b in bounds if b["result"] == result and place in (None, b.get("arithmetic", "host double"))]


def part(bound: Mapping[str, str], name: str) -> Fraction:
    """Return a part of a bound."""
    return Fraction(bound.get(name, "0"))


def check_pade(key: Sequence[Any], value: Value, sample: Sample) -> None:
    """Check a Padé approximant: certificates, and rounding with that of coefficients."""
    m, n = key
    claim(len(value["a"]) == m + 1 and len(value["b"]) == n + 1, "wrong degrees")
    for proof in sample.select(value["certificates"]):
        certificate_checker.Checker(entry_of(proof, {"a": value["a"], "b": value["b"]})).check()
    check_quotient(value, value["certificates"], value["bounds"], sample)


def check_best(key: Sequence[Any], value: Value, sample: Sample) -> None:
    """Check a best approximant: its certificates, rounding, and that it is accurate enough."""
    accuracy, *interval = key
    (first,) = bounds_of(value["bounds"], "epsilon", "host double")
    claim(part(first, "formula") + part(first, "last") <= Fraction(accuracy), "the error exceeds the wanted accuracy")
    proof = value["certificate"]
    claim([proof["low"], proof["high"], proof["measure"]] == [*interval, "both"], "another interval or measure")
    certificate_checker.Checker(entry_of(proof, value)).check()
    check_quotient(value, [proof], value["bounds"], sample)


def places(sample: Sample, low: Fraction, high: Fraction, count: int = 12) -> Iterator[Fraction]:
    """Yield floats, one from each part of an interval that is cut evenly by logarithms."""
    random = sample.random
    for share in (real(Fraction(i + Fraction(random.random()))) / count for i in range(count)):
        yield rounded(fraction(real(low) * (real(high) / real(low)) ** share), PRECISION["float"])


def check_quotient(value: Value, proofs: Sequence[Any], bounds: Bounds, sample: Sample) -> None:
    """Check the bounds of a quotient of polynomials, from v* and from the speed.

    Coefficients that are no numbers of the type are rounded, too.
    """
    coefficients = [dense(value[letter]) for letter in "ab"]
    stated = {(proof["low"], proof["high"], proof["bound"]) for proof in proofs}
    for place in {b.get("arithmetic", "host double") for b in bounds}:
        bounds_of_eps, machine = bounds_of(bounds, "epsilon", place), Machine(place, sample.random)
        claim(
            {(b["low"], b["high"], b["formula"]) for b in bounds_of_eps} == stated,
            "another bound than that of the proof",
        )
        bound = min(part(b, "last") for b in bounds_of_eps)
        numbers = [machine.rounded(terms) for terms in coefficients]
        for v in places(sample, Fraction(1, 2**20), max(Fraction(b["high"]) for b in bounds_of_eps)):
            exact = polynomial(coefficients[0], real(v)) / polynomial(coefficients[1], real(v))
            computed = machine.quotient(*(machine.horner(terms, v) for terms in numbers))
            within(computed, exact, bound, f"rounding at v* = {float(v):g}, {place}")
        check_speed_of_quotient(numbers, bounds_of_eps, bounds_of(bounds, "restitution", place), machine, place)


def check_speed_of_quotient(
    numbers: Sequence[Powers], of_eps: Bounds, of_speed: Bounds, machine: Machine, place: str
) -> None:
    """Check the bounds of a quotient of v* = sqrt(beta) pow(speed, 0.1): they have the rounding of v*, and hold."""
    claim(len(of_speed) == 2 * len(of_eps), f"a bound for usual speeds or for all is missing, {place}")
    roundings = [Fraction(text) for text in roundings_of_v_star(place)]
    for bound in of_speed:
        least = min(roundings) if "speeds" in bound else max(roundings)
        claim(part(bound, "rounding") >= least, f"the rounding of v* is not in a bound, {place}")
        high = Fraction(bound["high"])
        for v in places(Sample(1, machine.random.randrange(100)), high / 2**10, high, 3):
            speed = machine(v**10)  # for beta = 1
            v_star = mp.root(real(speed), 10)
            if fraction(v_star) <= high:
                exact, rounded_v_star = truth(v_star), power(machine, speed, Fraction(1, 10))
                computed = machine.quotient(*(machine.horner(terms, rounded_v_star) for terms in numbers))
                off = abs(computed - exact["epsilon"])
                allowed = (part(bound, "formula") + part(bound, "rounding")) * min(exact.values())
                allowed += part(bound, "last") * exact["epsilon"]
                claim(off <= allowed, f"eps of the speed {float(speed):g} is too far off, {place}")


def roundings_of_v_star(place: str) -> list[str]:
    """Return what the rounding of v* does to eps by the records, for usual speeds and for all."""
    keyed = [(record["key"], record["value"]) for record in records() if record["key"][0] == "rounding of v_star"]
    return [value for key, value in keyed if (key[1] if len(key) > 1 else "host double") == place]


def check_compact(key: Sequence[Any], value: Value, sample: Sample) -> None:
    """Check a kernel for all v* >= 0: its certificates on a part of the panels, and the rounding of its functions."""
    check_in_powers({"kind": "halfline", "root": "1/3"}, key[0], value, sample)
    for place in {b.get("arithmetic", "host double") for b in value["bounds"]}:
        check_speeds(value, key[0], place, sample)
        if place.startswith("host"):
            check_half_line(value, key[0], place, sample)


def check_half_line(value: Value, powers: Any, place: str, sample: Sample) -> None:
    """Check the rounding of eps and 1 - eps from v*, with cbrt."""
    machine = Machine(place, sample.random)
    top, bottom = (by_power(powers[p], value[c]) for p, c in (("top", "a"), ("bottom", "b")))
    for v in places(sample, Fraction(1, 2**12), Fraction(2**12)):
        y = mp.cbrt(real(v))
        elastic, lost = polynomial(bottom, y), real(v) ** 2 * polynomial(top, y)
        exact = {"epsilon": elastic / (elastic + lost), "one_minus_epsilon": lost / (elastic + lost)}
        numbers = machine.rounded(top), machine.rounded(bottom)
        parts = near_half_line(machine, *numbers, v) if v <= 1 else far_half_line(machine, *numbers, v)
        for name, share in zip(exact, parts, strict=True):
            computed = machine(share / machine(sum(parts, Fraction(0))))
            for bound in bounds_of(value["bounds"], name, place):
                within(computed, exact[name], of_rounding(bound, "last"), f"rounding of {name} at {float(v):g}")


def of_rounding(bound: Mapping[str, str], name: str) -> Fraction:
    """Return a part of a bound, relative to the formula's value instead of the exact one."""
    return part(bound, name) / (1 + part(bound, "formula"))


def by_power(exponents: Sequence[int], values: Sequence[str]) -> dict[int, Fraction]:
    """Return coefficients by their powers."""
    return dict(zip(exponents, map(number, values), strict=True))


Powers = dict[int, Fraction]


def near_half_line(machine: Machine, top: Powers, bottom: Powers, v: Fraction) -> tuple[Fraction, Fraction]:
    """Return the two parts of the sum for v* <= 1, with y = v*^(1/3)."""
    y = machine.root(mp.cbrt(real(v)))
    return machine.horner(bottom, y), machine(machine(v * v) * machine.horner(top, y))


def far_half_line(machine: Machine, top: Powers, bottom: Powers, v: Fraction) -> tuple[Fraction, Fraction]:
    """Return them for v* > 1, with w = 1/v* and u = w^(1/3): both divided by v*^2 y^(deg N)."""
    w = machine(1 / v)
    u = machine.root(mp.cbrt(real(w)))
    top, bottom = ({max(part) - k: c for k, c in part.items()} for part in (top, bottom))
    scale = machine(machine(machine(w * w) * w) * u)
    return machine(scale * machine.horner(bottom, u)), machine.horner(top, u)


def check_inverse(key: Sequence[Any], value: Value, sample: Sample) -> None:
    """Check a kernel of v*(eps) on (0, 1]: its certificates on a part of the panels, and rounding."""
    check_in_powers({"kind": "inverse", "root": "1/10"}, key[0], value, sample)
    top, bottom = (by_power(key[0][p], value[c]) for p, c in (("top", "a"), ("bottom", "b")))
    for place in {b.get("arithmetic", "host double") for b in value["bounds"]}:
        machine = Machine(place, sample.random)
        (of_v_star,), (of_loss,), (of_beta,) = (
            bounds_of(value["bounds"], name, place) for name in ("v_star", "v_star_from_loss", "beta")
        )
        claim(of_v_star["rounding"] == of_loss["rounding"], "v* of 1 - eps has another bound")
        for epsilon in places(sample, Fraction(1, 2**10), 1 - Fraction(1, 2**10)):
            y = mp.root(real((1 - epsilon) / epsilon), 10)
            exact = y**5 * polynomial(top, y) / polynomial(bottom, y)
            computed = inverse(machine, machine.rounded(top), machine.rounded(bottom), epsilon)
            what = f"at eps = {float(epsilon):g}, {place}"
            within(computed, exact, of_rounding(of_v_star, "rounding"), f"rounding of v* {what}")
            speed = Fraction(3)
            beta = machine.quotient(machine(computed * computed), power(machine, speed, Fraction(1, 5)))
            exact = exact**2 / mp.root(real(speed), 5)
            within(beta, exact, of_rounding(of_beta, "rounding"), f"rounding of beta {what}")


def power(machine: Machine, x: Fraction, exponent: Fraction) -> Fraction:
    """Return pow(x, exponent)."""
    return machine.root(real(x) ** real(machine(exponent)), "power")


def inverse(machine: Machine, top: Powers, bottom: Powers, epsilon: Fraction) -> Fraction:
    """Return v* of y = ((1 - eps)/eps)^(1/10), and for eps < 1/2 of u = 1/y."""
    loss, tenth = machine(1 - epsilon), Fraction(1, 10)
    if loss <= epsilon:
        y = power(machine, machine.quotient(loss, epsilon), tenth)
        upper = machine(machine.power(y, 5) * machine.horner(top, y))
        return machine.quotient(upper, machine.horner(bottom, y))
    u = power(machine, machine.quotient(epsilon, loss), tenth)
    more = 5 + max(top) - max(bottom)
    top, bottom = ({max(part) - k: c for k, c in part.items()} for part in (top, bottom))
    return machine.quotient(machine.horner(top, u), machine(machine.power(u, more) * machine.horner(bottom, u)))


def check_in_powers(head: Mapping[str, Any], powers: Any, value: Value, sample: Sample) -> None:
    """Check the certificates of a kernel in powers of a root."""
    proof = value["certificate"]
    entry = entry_of(proof, {**head, **powers, "a": value["a"], "b": value["b"]})
    interval_checker.Checker(entry).check(sample.spacing, sample.start % sample.spacing)
    error = Fraction(proof["bound"])
    errors = {"dissipation": error * (1 + error / 2), "beta": (1 + error) ** 2 - 1}
    stated = all(part(b, "formula") == errors.get(b["result"], error) for b in value["bounds"])
    claim(stated, "a bound of the formula is not that of the proof")


def check_choice(maker: str, result: str) -> Callable[[Sequence[Any], Value, Sample], None]:
    """Return the check of a choice of powers: a record has the kernel, and its error is within the wanted accuracy."""

    def check(key: Sequence[Any], value: Value, sample: Sample) -> None:
        (accuracy,) = key
        chosen = [record for record in records() if record["key"] == [maker, value]]
        claim(len(chosen) == 1, "there is no record of the kernel that was chosen")
        first = bounds_of(chosen[0]["value"]["bounds"], result)[0]
        total = sum(part(first, name) for name in ("formula", "rounding", "last"))
        claim(total <= Fraction(accuracy), "the error exceeds the wanted accuracy")

    return check


@lru_cache(maxsize=1)
def paths(folder: Path) -> list[Path]:
    """Return the files of records with something proven: array tables of laws and the table of falls are sampled."""
    sampled = "curve_tables-", "weight_table"
    return [path for path in sorted(folder.glob("*.json")) if not path.name.startswith(sampled)]


def records() -> list[dict[str, Any]]:
    """Return all records of the package with something proven."""
    return [json.loads(path.read_text()) for path in paths(DATA / "data" / "kernels")]


def check_speeds(value: Value, powers: Any, place: str, sample: Sample) -> None:
    """Check the rounding of functions of the speed, y = exp2(log2(w)/30), with errors of the machine's functions."""
    machine = Machine(place, sample.random)
    absolute = machine.off.get("log2", Fraction(0))
    top, bottom = by_power(powers["top"], value["a"]), by_power(powers["bottom"], value["b"])
    upper, lower = machine.rounded(top), machine.rounded(bottom)
    thirtieth = machine(Fraction(1, 30))
    lowest, highest = (-126, 120) if place.endswith("float") else (-220, 220)
    for speed in places(sample, Fraction(2) ** lowest, Fraction(2) ** highest):
        shift = absolute * machine.random.choice((-1, 1)) / 2  # with the other error and the rounding, within both
        exponent = machine(machine.root(mp.log(real(speed), 2) + real(shift)) * thirtieth)
        y = machine.root(mp.mpf(2) ** real(exponent))
        exact_y = mp.root(real(speed), 30)
        elastic, lost = machine.horner(lower, y), machine(machine.power(y, 6) * machine.horner(upper, y))
        whole = polynomial(bottom, exact_y), exact_y**6 * polynomial(top, exact_y)
        epsilon = whole[0] / mp.fsum(whole)
        result = machine.quotient(elastic, machine(elastic + lost))
        inverse_sum = machine.quotient(Fraction(1), machine(elastic + lost))
        second = machine(1 + machine(elastic * inverse_sum))
        results = {
            "restitution": (result, epsilon),
            "rebound": (machine(result * speed), epsilon * real(speed)),
            "dissipation": (machine(machine(lost * inverse_sum) * second), whole[1] / mp.fsum(whole) * (1 + epsilon)),
        }
        v_star, smaller = fraction(mp.root(real(speed), 10)), fraction(min(epsilon, 1 - epsilon) / epsilon)
        for name, (computed, exact) in results.items():
            for bound in bounds_of(value["bounds"], name, place):
                if Fraction(bound["low"]) <= v_star <= Fraction(bound["high"]):
                    share = smaller if bound["relative_to"] == "smaller" else 1
                    size = of_rounding(bound, "last") + of_rounding(bound, "rounding") * share
                    within(computed, exact, size, f"rounding of {name} at w = {float(speed):g}, {place}")


# --- tables -----------------------------------------------------------------------------------------------------------


def record_of(*key: Any) -> Any:
    """Return the value of a record, by its key."""
    return next(record["value"] for record in records() if record["key"] == list(key))


def table_of(key: Mapping[str, Any], value: Value) -> Header:
    """Return a table with its bounds; the value of a record is one of both."""
    listed = value if isinstance(value, list) else record_of("speed table rows", key)
    proven = value if isinstance(value, dict) else record_of("speed table bounds", key)
    rows = tuple(tuple(map(number, row)) for row in listed)
    stated = {name: Fraction(text) for name, text in proven.items()}
    kind = key["form"]
    octaves, left = divmod(len(rows), 1 << key["split"])
    claim((octaves, left) == (128, 0), "the table has not 128 octaves")
    claim(all(rounded(c, PRECISION[kind]) == c for row in rows for c in row), f"a number is not a {kind}")
    full = "ulp" in stated
    halves = not full and key["degree"] % 2 == 0
    rows = tuple(map(unpacked, rows)) if halves else rows
    return Header(f"table {key}", full, halves, kind, key["first"], octaves, 1 << key["split"], rows, stated)


def check_table(key: Sequence[Any], value: Value, sample: Sample) -> None:
    """Check rows of a table: their errors at both ends and three places, in the middle of the row and between."""
    table = table_of(key[0], value)
    rounding = [(kind, bound) for kind, bound in table.bounds.items() if kind in PRECISION]
    for index in sample.select(range(len(table.rows))):
        exponent, low, high = table.interval(index)
        for share in (Fraction(0), Fraction(1, 7), Fraction(1, 2), Fraction(6, 7), 1 - Fraction(1, 2**30)):
            m = low + (high - low) * share
            exact = point(m * Fraction(2) ** exponent)
            part = share_of_formula(table, exact)
            claim(part <= 1, f"row {index}: the error is {float(part):.4g} of the bound")
            if not table.full:
                check_sums(*table.polynomial(index), m, min(exact.epsilon[1], exact.loss[1]), rounding, f"row {index}")
            else:
                error = exact.error(table.p(index, m), table.base(index)) / (
                    exact.epsilon[0] if not table.base(index) else exact.loss[0]
                )
                claim(error <= table.bounds["relative"], f"row {index}: the relative error is larger than recorded")


def check_sums(
    row: Sequence[Fraction],
    origin: Fraction,
    m: Fraction,
    smaller: Fraction,
    stated: Sequence[tuple[str, Fraction]],
    what: str,
) -> None:
    """Check the effect of rounding on a row's sum near m, of which the origin is subtracted, in each type."""
    for kind, bound in stated:
        machine = Machine(kind, Random(0))
        near = machine(m) - origin
        exact = sum((c * near**k for k, c in enumerate(row)), Fraction(0))
        off = abs(in_pairs(machine, row, near) - exact) / smaller
        # The smaller of eps and 1 - eps changes by less than 2^-20 of it from m to its neighbour in the type.
        claim(off <= bound * (1 + Fraction(1, 2**20)), f"{what}: rounding in type {kind} exceeds its bound")


def check_slope(key: Sequence[Any], value: Value, sample: Sample) -> None:
    """Check that rows fall, and how far eps rises from one row to the next: all of them, exactly."""
    table = table_of(key[0], value)
    if not table.full:
        for index in sample.select(range(len(table.rows))):
            claim(falls(table, index), f"row {index} does not fall")
        claim(max(0, *rises(table)) == table.bounds["rise"], "the largest rise is another one")


# --- full accuracy ----------------------------------------------------------------------------------------------------


def in_pairs(machine: Machine, c: Sequence[Fraction], t: Fraction) -> Fraction:
    """Return (c_0 + t c_1) + t^2 ((c_2 + t c_3) + …), the last pair perhaps one number."""
    square = machine(t * t)
    pairs = [machine(machine(t * c[n + 1]) + c[n]) if n + 1 < len(c) else c[n] for n in range(0, len(c), 2)]
    total = pairs.pop()
    for pair in reversed(pairs):
        total = machine(pair + machine(square * total))
    return total


def full_value(function: str, v: Fraction) -> Fraction:
    """Return the result of the code of full accuracy for 2^-4 <= v* < 2^20, by the rows in the records."""
    machine, loss = Machine("double", Random(0)), function == "one_minus_epsilon"
    exponent = exponent_of(v)
    panel = 16 * (exponent + 4) + int((v / Fraction(2) ** exponent - 1) * 16)
    centre, high, slope, low, second, *a = map(number, record_of("full rows")[1 + panel])
    cleared = Fraction(int(v / Fraction(2) ** (exponent - 26))) * Fraction(2) ** (exponent - 26)
    t, t_1, t_2 = v - centre, cleared - centre, v - cleared
    claim(machine(t) == t and machine(high + slope * t_1) == high + slope * t_1, "a step that must be exact is not")
    more = machine(second + machine(t * in_pairs(machine, a, t)))
    rest = machine(machine(low + machine(slope * t_2)) + machine(t * more))
    head_part = high + slope * t_1
    base = Fraction(int(head_part < 0))
    if loss:
        base, head_part, rest = 1 - base, -head_part, -rest
    head = machine(base + head_part)
    lost = machine(machine(base - head) + head_part)
    return machine(head + machine(lost + rest))


def check_ulps(key: Sequence[Any], value: Value, sample: Sample) -> None:
    """Check the errors of full accuracy in units in the last place, at a random number of each panel below 2^20."""
    for function, bounds in value.items():
        claim(len(bounds) == 1 + 16 * 27, "the panels end too early")
        for panel in sample.select(range(16 * 24)):
            share = Fraction(Random(f"{sample.start} {panel}").randrange(1, 2**20), 2**20)
            v = rounded(Fraction(2) ** (panel // 16 - 4) * (1 + (panel % 16 + share) / 16), PRECISION["double"])
            exact = truth(real(v))[function]
            error = abs(full_value(function, v) - exact) - 2 * ERROR * exact
            claim(
                error <= Fraction(bounds[1 + panel]) * ulp(exact, PRECISION["double"]),
                f"v* = {float(v).hex()}: too far off",
            )


def check_full_rows(key: Sequence[Any], value: Value, sample: Sample) -> None:
    """Check that rows of full accuracy are doubles and nearly the function, at three places of each."""
    claim(
        all(rounded(number(text), 53) == number(text) for row in value for text in row),
        "a number is not a double",
    )
    claim(len(value) == 1 + 16 * 27, "the panels end too early")
    for panel in sample.select(range(16 * 24)):
        for share in (Fraction(1, 9), Fraction(1, 2), Fraction(8, 9)):
            v = rounded(Fraction(2) ** (panel // 16 - 4) * (1 + (panel % 16 + share) / 16), PRECISION["float"])
            for function in ("epsilon", "one_minus_epsilon"):
                exact = truth(real(v))[function]
                error = abs(full_value(function, v) - exact)
                claim(error <= ulp(exact, PRECISION["double"]), f"v* = {float(v).hex()}: the row is wrong")


# --- from the speed ---------------------------------------------------------------------------------------------------


def check_of_v_star(key: Sequence[Any], value: Value, sample: Sample) -> None:
    """Check the effect on eps of rounding v* = sqrt(beta) pow(speed, 0.1): the sum of its parts times the slope."""
    place, largest = (key[0] if key else "host double"), (key[1] if len(key) > 1 else None)  # defaults are no part
    kind = place.split()[-1]
    unit, tenth = Fraction(1, 2 ** PRECISION[kind]), Fraction(1, 10)
    exponent = abs(rounded(tenth, PRECISION[kind]) - tenth)
    farthest = mp.log(2) * (LARGEST[kind] + PRECISION[kind] - 1) if largest is None else mp.log(real(Fraction(largest)))
    size = exponent * fraction(farthest)
    size += 2 * unit + 2 * unit * (Fraction(9, 2) if place == "device float" else ROOTS)
    like(Fraction(value), size * SLOPE)


def check_of_w(key: Sequence[Any], value: Value, sample: Sample) -> None:
    """Check the effect of the rounding of w = beta^5 speed on eps: five roundings times a tenth of the slope."""
    like(Fraction(value), 5 * Fraction(1, 2 ** PRECISION[key[0]]) * SLOPE / 10)


def like(bound: Fraction, size: Fraction) -> None:
    """Check that a bound is not below a size, and hardly above it and the reference's error."""
    claim(size <= bound <= LIKE * size + 8 * ERROR, f"the bound {float(bound):.6g} is not like {float(size):.6g}")


CHECKS: dict[str, tuple[Callable[[Sequence[Any], Value, Sample], None], ...]] = {
    "pade": (check_pade,),
    "minimax": (check_best,),
    "compact": (check_compact,),
    "compact powers": (check_choice("compact", "restitution"),),
    "inverse": (check_inverse,),
    "inverse powers": (check_choice("inverse", "v_star"),),
    "speed table rows": (check_table,),
    "speed table bounds": (check_table, check_slope),
    "full rows": (check_full_rows,),
    "full bounds": (check_ulps,),
    "rounding of v_star": (check_of_v_star,),
    "rounding of w": (check_of_w,),
}


def check(record: Mapping[str, Any], sample: Sample) -> str:
    """Check a record; return the line that says so.

    Raises
    ------
    Wrong
        If something does not hold, or no check knows such a record.
    """
    name, *key = record["key"]
    claim(name in CHECKS, f"no check knows a record of {name!r}")
    for one in CHECKS[name]:
        one(key, record["value"], sample)
    return f"{' '.join(part if isinstance(part, str) else json.dumps(part) for part in record['key'])[:90]} holds"


def main(arguments: list[str]) -> None:
    """Check all records in a folder, and print the results."""
    options = {}
    for name, field in (("--every", "spacing"), ("--start", "start")):
        if name in arguments:
            position = arguments.index(name)
            options[field] = int(arguments[position + 1])
            del arguments[position : position + 2]
    for path in paths(Path(arguments[0])):
        try:
            print(check(json.loads(path.read_text()), Sample(**options)), flush=True)
        except Wrong as reason:
            raise Wrong(f"{path.name}: {reason}") from None


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except Wrong as reason:
        sys.exit(f"wrong: {reason}")
