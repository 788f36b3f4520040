"""Kernels from speed to eps, compiled: errors, arrays, odd inputs, flags against IEEE rules, monotonicity, indices."""

from __future__ import annotations

import itertools
import math
import re
from fractions import Fraction
from functools import cache

import numpy as np
import pytest

from tests import daily
from tests.compiled import compiler, machine_flags
from tests.kernels.speed_headers import (
    FORMS,
    FUNCTIONS,
    SUFFIXES,
    Functions,
    Header,
    Truth,
    header,
    in_table,
    spacing,
)
from viscopade.kernels import catalogue, speed_table
from viscopade_lab.studies import exhaustive

FUSED = ("-ffp-contract=fast",)
PLAIN = ("-ffp-contract=off",)
BUILDS = {
    "O0": ("cc", "c++17", ("-O0", *PLAIN)),
    "plain": ("cc", "c99", ("-O2", *PLAIN)),
    "native": ("cc", "c11", ("-O3", *machine_flags(), *FUSED)),
    "clang-O0": ("clang", "c17", ("-O0", *PLAIN)),
    "clang": ("clang", "c++17", ("-O3", *machine_flags(), *FUSED)),
    "fast": ("cc", "c99", ("-O3", *machine_flags(), "-ffast-math")),
    "clang-fast": ("clang", "c99", ("-O3", *machine_flags(), "-ffast-math")),
}
IEEE = tuple(name for name in BUILDS if "fast" not in name)

slow = pytest.mark.slow
each_tier = pytest.mark.parametrize("tier", catalogue.TIERS)
each_form = pytest.mark.parametrize("form", FORMS)


FEW = {
    "O0": ("1e-5", "full"),
    "native": ("1e-5", "full"),
    "clang-O0": (daily.chosen(catalogue.TIERS),),
    "clang": ("1e-5",),
    "fast": ("1e-5", "full"),
    "clang-fast": ("1e-5",),
}
"""Builds that take long or give the bits of another, and those of their kernels that are tested always."""


def few(builds):
    """Return all pairs of build and tier, most of those that take long being marked as slow."""
    return [
        pytest.param(build, tier, marks=slow if tier not in FEW.get(build, catalogue.TIERS) else ())
        for build, tier in itertools.product(builds, catalogue.TIERS)
    ]


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """Return a function that gives the functions of a header, by build and tier."""
    folder = tmp_path_factory.mktemp("speed")

    @cache
    def functions(build, tier):
        name, standard, flags = BUILDS[build]
        return Functions(folder, header(tier), compiler(standard, name, flags))

    return functions


# --- inputs -----------------------------------------------------------------------------------------------------------


def integers_of(form):
    return np.int64 if form == "double" else np.int32


def bits(form, numbers):
    return np.asarray(numbers, dtype=FORMS[form]).view(integers_of(form))


def near(form, numbers, reach=2):
    """Return each number with its neighbours."""
    steps = np.arange(-reach, reach + 1, dtype=integers_of(form))
    return np.unique(bits(form, numbers)[:, None] + steps).view(FORMS[form])


def borders(given):
    """Return the w where rows begin, both ends of the table included."""
    row = np.arange(((given.end - given.first) << given.split) + 1)
    part = row & ((1 << given.split) - 1)
    return np.ldexp(1 + part / 2.0**given.split, given.first + (row >> given.split))


def extremes(form):
    limits = np.finfo(FORMS[form])
    return [*near(form, [limits.tiny, 1.0]).tolist(), float(limits.smallest_subnormal), float(limits.max)]


def positive(form, numbers):
    with np.errstate(over="ignore", under="ignore"):
        found = np.asarray(numbers).astype(FORMS[form])
    return found[(found > 0) & np.isfinite(found)]


def sizes(given, form, generator, number):
    """Return w of all sizes, most of them in the table."""
    low, high = (-1074, 1024) if form == "double" else (-149, 128)
    ends = (max(given.first - 3, low), min(given.end + 3, high))
    wide, inside = generator.uniform(low, high, number // 3), generator.uniform(*ends, number)
    return np.exp2(np.concatenate([wide, inside]).astype(np.longdouble))


@cache
def inputs(tier, form, number=4000):
    """Return speed and beta: w around all rows' ends, of all sizes, any bits; and where beta^5 is no normal number."""
    given, generator = header(tier), np.random.default_rng(3)
    every = np.concatenate([near(form, borders(given), 1), positive(form, sizes(given, form, generator, number))])
    every = np.concatenate([every, positive(form, extremes(form))])
    pairs = [(every, np.ones_like(every))]
    kind, limits = FORMS[form], np.finfo(FORMS[form])
    w = generator.permutation(every)[: 3 * number].astype(np.longdouble)
    fifth = math.log2(float(limits.max)) / 5
    for low, high in ((-20, 20), (-fifth - 4, -fifth + 4), (fifth - 4, fifth + 4)):
        beta = np.exp2(generator.uniform(low, high, w.size)).astype(kind)
        pairs.append((w / beta.astype(np.longdouble) ** 5, beta))
    # As large and as small as they come, with w still in the table or next to it.
    end = generator.uniform(0.5, 1, number).astype(np.longdouble)
    speeds = np.concatenate([float(limits.max) * end, float(limits.smallest_subnormal) * (1 + 40 * end)])
    w = np.exp2(generator.uniform(given.first - 2, given.end + 2, speeds.size)).astype(np.longdouble)
    pairs.append((speeds, ((w / speeds) ** (np.longdouble(1) / 5)).astype(kind)))
    # 1 - eps is subnormal, or next to it: nearly beta. The first is off by 0.84 of the smallest numbers.
    small = generator.integers(1, 2 * bits(form, [limits.tiny])[0], number, dtype=integers_of(form)).view(kind)
    pairs.append((np.ones_like(small), np.append(small[1:], kind(9.9998886718268301e-321))))
    anything = generator.integers(1, bits(form, [math.inf])[0], (2, number), dtype=integers_of(form)).view(kind)
    pairs.append((anything[0], anything[1]))
    return together(form, pairs)


def together(form, pairs):
    """Return pairs of arrays one after the other, as numbers of the type, without those that are none."""
    with np.errstate(over="ignore", under="ignore"):
        values, beta = (np.concatenate([np.asarray(p[i]).astype(FORMS[form]) for p in pairs]) for i in (0, 1))
    good = (values > 0) & np.isfinite(values) & (beta > 0) & np.isfinite(beta)
    return np.ascontiguousarray(values[good]), np.ascontiguousarray(beta[good])


@cache
def truth(tier, form):
    return Truth(*inputs(tier, form))


LIMITS = ("smallest_subnormal", "tiny", "max")
SPECIAL = {
    form: [
        *(0.0, -0.0, math.inf, -math.inf, math.nan, 1.0, -1.0, 0.3, 1e30, 1e-30),
        *(sign * float(getattr(np.finfo(kind), name)) for sign in (1, -1) for name in LIMITS),
    ]
    for form, kind in FORMS.items()
}


def same(found, expected):
    """Whether two arrays are the same bit for bit, any NaN being like any other."""
    whole = f"u{found.itemsize}"
    both_nan = np.isnan(found) & np.isnan(expected)
    return found.dtype == expected.dtype and bool(np.all(both_nan | (found.view(whole) == expected.view(whole))))


# --- errors -----------------------------------------------------------------------------------------------------------


def part(found, true, bound):
    error = np.abs(found.astype(np.longdouble) - true)
    return np.where(error == 0, 0, error / bound)


@cache
def truth_and_bound(tier, form, function, more=0, flushed=False):
    true = truth(tier, form)
    return true.of(function), true.bound(function, header(tier), form, more, flushed)


@pytest.mark.parametrize(("build", "tier"), few(IEEE))
def test_errors_are_within_the_stated_bounds(built, build, tier):
    functions = built(build, tier)
    for form, function in itertools.product(FORMS, FUNCTIONS):
        found = functions("single", function, *inputs(tier, form))
        parts = part(found, *truth_and_bound(tier, form, function))
        worst = int(np.argmax(parts))
        values, beta = inputs(tier, form)
        assert parts[worst] <= 1, (form, function, float(values[worst]).hex(), float(beta[worst]).hex())
        if function == "restitution" and tier != "full":
            inside = truth(tier, form).in_table(header(tier), form)
            assert parts[inside].max() > 0.6  # no bound is far too large
            assert not inside.all()


# --- arrays -----------------------------------------------------------------------------------------------------------


def batch(tier, form, generator, length, odd=0.0):
    """Return speeds in the table for beta of about 1, a part of them replaced by odd ones."""
    given = header(tier)
    low, high = max(given.first, -100) + 12, given.end - 12
    values = np.exp2(generator.uniform(low, high, length)).astype(FORMS[form])
    wrong = generator.random(length) < odd
    values[wrong] = generator.choice(SPECIAL[form], int(wrong.sum()))
    beta = np.exp2(generator.uniform(-2, 2, length)).astype(FORMS[form])
    wrong = generator.random(length) < odd / 2
    beta[wrong] = generator.choice(SPECIAL[form], int(wrong.sum()))
    return values, beta


@pytest.mark.parametrize(("build", "tier"), few(("plain", "native", "clang")))
def test_arrays_of_every_length_and_in_place_are_the_single_results(built, build, tier):
    """Inputs at any address, results between guards; some blocks hold odd speeds."""
    functions, generator = built(build, tier), np.random.default_rng(5)
    for length in (*range(131), 159, 160, 161, 191, 192, 193, 1000):
        for form, function in itertools.product(FORMS, FUNCTIONS):
            start, odd = length % 7, generator.choice([0, 0, 0.02, 0.3])
            values, beta = (x[start:] for x in batch(tier, form, generator, length + start, odd))
            pair = generator.integers(0, max(length, 1), length, dtype=np.intc)
            table = np.append(beta, FORMS[form](1.5))
            one = FORMS[form](generator.choice([1.5, 1.5, 1.5, *SPECIAL[form]]))
            calls = {
                "each": (values, beta),
                "by_pair": (values, table, pair),
                "array": (values, one),
            }
            for kind, arguments in calls.items():
                of_each = {"each": beta, "by_pair": table[pair], "array": np.full(length, one)}[kind]
                room = np.full(length + 8, 7.5, dtype=FORMS[form])
                functions(kind, function, *arguments, out=room[3 : length + 3])
                assert same(room[3 : length + 3], functions("single", function, values, of_each)), (kind, length)
                assert np.all(room[:3] == 7.5)
                assert np.all(room[length + 3 :] == 7.5)
                own = values.copy()
                functions(kind, function, own, *arguments[1:], out=own)
                assert same(own, room[3 : length + 3]), (kind, length, "in place")


NEW, OLD = "#if __has_builtin.*", r"#if defined\(__GNUC__\) && !defined\(VISCOPADE_JOINED\)"  # of compilers


@pytest.mark.parametrize("without", [(), (NEW,), (NEW, OLD)], ids=["new", "old", "none"])
@pytest.mark.parametrize("flags", [(), machine_flags()], ids=["baseline", "native"])
@pytest.mark.parametrize("four", [daily.chosen(("", 0, 1)), *(pytest.param(four, marks=slow) for four in ("", 0, 1))])
def test_arrays_by_other_shuffles(tmp_path, without, four, flags):
    """As by older compilers, by those that have none, and for machines with other vectors: the same bits."""
    given, tier = header("1e-10"), "1e-10"
    text = given.text
    for condition in without:
        text = changed(Header(text, tier), condition, "#if 0").text
    text = text if four == "" else f"#define VISCOPADE_BY_FOUR {four}\n{text}"
    functions = Functions(tmp_path, Header(text, tier), compiler("c99", flags=("-O2", *flags, *PLAIN)))
    for form, function in itertools.product(FORMS, FUNCTIONS):
        values, beta = batch(tier, form, np.random.default_rng(7), 1999, 0.01)
        assert same(functions("each", function, values, beta), functions("single", function, values, beta))


HIDDEN = {"avx512": (), "avx2": ("avx512bf16",), "compiled": ("avx512bf16", "avx2")}
"""What a processor must not have, so that array functions choose an instruction set."""


@pytest.mark.parametrize("maker", ["cc", "clang"])
@pytest.mark.parametrize("hidden", HIDDEN.values(), ids=HIDDEN)
@pytest.mark.parametrize(
    "tier", [daily.chosen(catalogue.TIERS), *(pytest.param(tier, marks=slow) for tier in catalogue.TIERS)]
)
def test_arrays_by_every_instruction_set_that_is_chosen(tmp_path, tier, hidden, maker):
    """The bits of single calls, which have no fused operations, though the compiler may contract products and sums."""
    text = header(tier).text
    for name in hidden:
        assert f'__builtin_cpu_supports("{name}")' in text
        text = text.replace(f'__builtin_cpu_supports("{name}")', "0")
    functions = Functions(tmp_path, Header(text, tier), compiler("c11", maker, ("-O2", *FUSED)))
    for form, function in itertools.product(FORMS, FUNCTIONS):
        values, beta = batch(tier, form, np.random.default_rng(11), 1999, 0.01)
        single = functions("single", function, values, beta)
        assert same(functions("each", function, values, beta), single)
        assert same(functions("by_pair", function, values, beta, np.arange(1999, dtype=np.intc)), single)
        single = functions("single", function, values, np.full_like(beta, 1.3))
        assert same(functions("array", function, values, FORMS[form](1.3)), single)


# --- -ffast-math, and subnormal numbers set to 0 ----------------------------------------------------------------------


def normal_inputs(tier, form):
    """Return which inputs are normal numbers: others count as 0 where subnormal numbers are set to 0."""
    least = np.finfo(FORMS[form]).tiny
    values, beta = inputs(tier, form)
    return (values >= least) & (beta >= least)


@pytest.mark.parametrize("flushed", [False, True], ids=["subnormal", "flushed"])
@pytest.mark.parametrize(("build", "tier"), few(("plain", "fast", "clang-fast")))
def test_errors_without_the_rules_of_ieee(built, build, tier, flushed):
    """A few units in the last place more are allowed, and what is subnormal may be 0."""
    functions = built(build, tier)
    for form, function, kind in itertools.product(FORMS, FUNCTIONS, ("single", "each")):
        good = normal_inputs(tier, form)
        values, beta = (np.ascontiguousarray(x[good]) for x in inputs(tier, form))
        undo = functions.flushed() if flushed else lambda: None
        try:
            found = functions(kind, function, values, beta)
        finally:
            undo()
        true, bound = (x[good] for x in truth_and_bound(tier, form, function, 4, flushed))
        parts = part(found, true, bound)
        worst = int(np.argmax(parts))
        assert parts[worst] <= 1, (form, function, kind, float(values[worst]).hex(), float(beta[worst]).hex())
        if function == "restitution":
            assert np.all((found >= 0) & (found <= 1))


# --- monotonicity -----------------------------------------------------------------------------------------------------


def rises(functions, tier, form, values, beta):
    """Return by how much eps rises from each speed (in order) to the next, and whether both are in one table."""
    given = header(tier)
    values = np.unique(values)
    beta = np.full_like(values, beta)
    eps = functions("each", "restitution", values, beta).astype(np.longdouble)
    inside = in_table(given, form, values, beta)
    return np.diff(eps), eps[1:], inside[1:] & inside[:-1]


def allowed_rise(given, form, values, beta, eps, inside):
    """Return how much eps may rise from a speed to the next: by both errors, in a table as is proven of its rows."""
    error = Truth(np.unique(values), beta).bound("restitution", given, form)
    both, proven = error[1:] + error[:-1], speed_table.table_bounds(given.layout)
    if "rise" not in proven:
        return both
    table = given.kernel.table_bound("restitution", form)
    rise = float(proven["rise"] * (1 + proven["error"]) + 2 * (table.rounding + table.last))
    return np.where(inside, rise * np.minimum(eps, 1 - eps) + 2 * spacing(eps, FORMS[form]), both)


def ordered_speeds(given, form, beta, number):
    """Return speeds whose w are consecutive around rows' ends, and random ones."""
    generator = np.random.default_rng(12)
    w = np.concatenate([borders(given).astype(np.longdouble), sizes(given, form, generator, number)])
    values = positive(form, w / np.longdouble(beta) ** 5)
    return np.concatenate([near(form, values[: borders(given).size], 4), values])


@pytest.mark.parametrize("number", [30_000, pytest.param(1_000_000, marks=slow)])
@each_form
@each_tier
def test_eps_rises_by_no_more_than_stated(built, tier, form, number):
    given = header(tier)
    for build, beta in (("plain", 1.0), ("plain", FORMS[form](0.731)), ("native", 1.0)):
        if build == "native" and number < 1_000_000 and tier not in FEW[build]:
            continue
        values = ordered_speeds(given, form, beta, number)
        found, eps, inside = rises(built(build, tier), tier, form, values, beta)
        allowed = allowed_rise(given, form, values, beta, eps, inside)
        assert np.all(found <= allowed), float(values[np.argmax(found)]).hex()
        assert np.count_nonzero(found < 0) > found.size / 4


# --- places in the table ----------------------------------------------------------------------------------------------


def layout(given, form):
    """Return which numbers of a type say what is read: begin, end, shift of the ends, and sizes of tables by shift."""
    s = SUFFIXES[form]
    code = given.text
    at = rf"viscopade_place_{given.name}{s}\(.*?viscopade_bits\w?\(w\) - UINT\d+_C\((\w+)\)"
    begin = int(re.search(at, code, re.DOTALL)[1], 16)
    one, block = (code.split(f" viscopade_{part}_{given.name}{s}(")[1].split("\n}")[0] for part in ("one", "block"))
    end = int(re.search(r"place < UINT\d+_C\((\w+)\)", one)[1], 16)
    ends = int(re.search(r"beyond >> (\d+)\) == 0", block)[1])
    reads = {(table, int(shift)) for table, shift in re.findall(r"(viscopade_\w+)\[place >> (\d+)\]", one)}
    block = re.sub(r"place\[i( \+ [123])?\]", "place", block)  # rows are read one by one, or by four
    block = re.sub(r"\[index\]", lambda _: f"[{re.search(r'index = (place >> [0-9]+)', block)[1]}]", block)
    reads |= {(table, int(shift)) for table, shift in re.findall(r"(viscopade_table_\w+)\[place >> (\d+)\]", block)}
    assert {f"viscopade_table_{given.name}"} <= {table for table, _ in reads}
    sizes = [(int(re.search(rf"{table}\[(\d+)\][^;=]* = \{{", code)[1]), shift) for table, shift in reads]
    return begin, end, ends, sizes


def reads_within(end, ends, sizes):
    """Whether place < end says the same as place >> ends = 0, and the last index is the last of each table."""
    return end == 1 << ends and all((end - 1) >> shift == size - 1 for size, shift in sizes)


@each_tier
def test_no_row_beyond_the_table_is_read(tier):
    """By reasoning, for all places: x < 2^k if and only if x >> k is 0, so x | y < 2^k too; x >> shift is monotonic."""
    given = header(tier)
    for form in given.native:
        begin, end, ends, sizes = layout(given, form)
        assert reads_within(end, ends, sizes)
        assert (given.layout.size, np.finfo(FORMS[form]).nmant - given.split) in sizes
        assert begin == int(bits(form, [2.0**given.first])[0])
        assert begin + end == int(bits(form, [2.0**given.end])[0])


# --- the checks themselves --------------------------------------------------------------------------------------------


def test_the_truth_is_that_of_the_proofs():
    w = np.exp2(np.random.default_rng(1).uniform(-100, 66, 40))
    true = Truth(w, 1.0)
    for base, found in ((0, true.eps), (1, true.loss)):
        for x, y in zip(w, found, strict=True):
            exactly = abs(speed_table._exact_p(Fraction(x), base))
            assert abs(Fraction(int(np.ldexp(y, 150))) / 2**150 / exactly - 1) < Fraction(1, 2**58)


def changed(given, old, new, times=1):
    """Return a header with a mistake; `old` is a regular expression."""
    text, number = re.subn(old, new, given.text)
    assert number >= times, f"nothing to change: {old}"
    return Header(text, given.tier)


BEYOND = {
    "shift": (r"\[place >> 46\]", "[place >> 45]"),
    "end": (r"place < UINT64_C\(0x800000000000000\)", "place < UINT64_C(0x810000000000000)"),
    "ends of blocks": (r"beyond >> 59", "beyond >> 60"),
}


@pytest.mark.parametrize(("old", "new"), BEYOND.values(), ids=BEYOND)
def test_a_read_beyond_the_table_is_noticed(old, new):
    assert not reads_within(*layout(changed(header("1e-5"), old, new), "double")[1:])


# --- all floats -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("step", [9973, pytest.param(1, marks=slow)])
def test_all_floats(step):
    """The program that tests all positive floats, with the bounds that the header states."""
    compiler("c11")  # or skip
    results, differ = exhaustive.floats(header("1e-5").text, "fused", step)
    assert differ == 0
    assert [errors.function for errors in results] == list(FUNCTIONS)
    for errors in results:
        assert errors.total == -(-(2**31 - 2**23 - 1) // step)
        assert errors.noted == 0, errors
        assert 0.3 < errors.largest <= 1
