"""The exporters: Kernel, C header (compiled), Python module (executed), tables (parsed back)."""

from __future__ import annotations

import csv
import ctypes
import io
import json
import math
import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from decimal import Context, Decimal
from fractions import Fraction
from functools import cache
from itertools import accumulate
from operator import mul
from types import SimpleNamespace

import mpmath
import pytest
from flint import fmpq, fmpq_poly
from hypothesis import given
from hypothesis import strategies as st

from tests import compiled
from viscopade.arithmetic.balls import working
from viscopade.arithmetic.formats import DOUBLE, FLOAT, Format, decimal_value
from viscopade.generated import END_CONDITION
from viscopade.kernels import prove_rational
from viscopade.kernels.forms.quotient import PadeKernel
from viscopade.kernels.requests import PAPER_DEGREES
from viscopade.kernels.targets import c, python, tables
from viscopade.theory.pade import exact_roots, pade

COMMAND = "viscopade export c --pade 3/6 --pade 1/4"
SOURCE = "Müller and Pöschel 2011, eq:padeDef"

# The tests' kernels: those of the paper's table (tab:padeCoeffs), and rational functions made up.


def digits40(number: Fraction) -> str:
    return str(Context(prec=40).divide(Decimal(number.numerator), Decimal(number.denominator)))


def decimals_of(texts: Iterable[str]) -> tuple[Decimal, ...]:
    return tuple(map(Decimal, texts))


def first_root(values: tuple[Decimal, ...]) -> Decimal | None:
    """Return the smallest positive root of a polynomial, to the digits of a double; None if there is none."""
    rational = fmpq_poly([fmpq(*value.as_integer_ratio()) for value in values])
    with working(64):
        positive = [root for root in exact_roots(rational) if root.positive]
    return Decimal(repr(float(positive[0].value.real.mid()))) if positive else None


def kernel(a: str, b: str, next_term: str = "-0.0125") -> PadeKernel:
    numerator, denominator = decimals_of(a.split()), decimals_of(b.split())
    degrees = len(numerator) - 1, len(denominator) - 1
    ends = first_root(denominator), first_root(numerator)
    return PadeKernel(*degrees, numerator, denominator, Decimal(next_term), *ends, SOURCE)


def product(numbers: Iterator[Fraction]) -> str:
    """Return the coefficients of prod (1 + x number), of which none cancels another."""
    coefficients = [Fraction(1)]
    for number in numbers:
        coefficients = [u + number * v for u, v in zip([*coefficients, 0], [0, *coefficients], strict=True)]
    return " ".join(map(digits40, coefficients))


def exp_pade(m: int, n: int) -> PadeKernel:
    """Return the Padé approximant of exp(-x), exactly known; its high coefficients are tiny."""
    a = [Fraction(math.comb(m, i) * math.factorial(m + n - i), math.factorial(m + n)) for i in range(m + 1)]
    b = [Fraction(math.comb(n, i) * math.factorial(m + n - i), math.factorial(m + n)) for i in range(n + 1)]
    return kernel(" ".join(digits40((-1) ** i * x) for i, x in enumerate(a)), " ".join(map(digits40, b)))


def of_the_paper(m: int, n: int) -> PadeKernel:
    """Return an approximant of the paper's table to 40 digits, without the proof of its error."""
    found = prove_rational.without_proof(pade(m, n, 40))
    zero = found.zero and Decimal(repr(float(found.zero)))  # as first_root gives it
    return replace(found, next_term=Decimal("-0.0125"), zero=zero, source=SOURCE)


PAPER = tuple(of_the_paper(m, n) for m, n in PAPER_DEGREES)
ARTIFICIAL = (
    kernel("1", "1"),
    kernel("1 2", "1"),
    kernel("1", "1 -0.4"),
    kernel("1 0 0.5 0.25", "1 3"),
    kernel("1 0.1 3", "1 0.7 7", next_term="0"),
    kernel("1 0.5 0.25 0.125 0", "1 2 0.3 0"),
    kernel("1 0 0 0 0 1e-20", "1 0 0 1e15"),
    kernel("1 -3 2.25", "1 0 0 1e-30"),
    kernel(
        product(Fraction(31 + i, 97) for i in range(60)),
        product(Fraction(35 + i, 101) for i in range(63)),
    ),
    exp_pade(25, 28),
)
KERNELS = PAPER + ARTIFICIAL
IDS = [each.label for each in KERNELS]

each_kernel = pytest.mark.parametrize("sample", KERNELS, ids=IDS)
each_form = pytest.mark.parametrize("form", [DOUBLE, FLOAT], ids=["double", "float"])


def header(*kernels: PadeKernel) -> str:
    return c.render(kernels, COMMAND)


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> compiled.Library:
    return compiled.build(tmp_path_factory.mktemp("kernels"), [header(*KERNELS)])


def execute(*kernels: PadeKernel) -> SimpleNamespace:
    names: dict[str, object] = {"__name__": "generated"}
    exec(python.render(kernels, COMMAND), names)
    return SimpleNamespace(**names)


@pytest.fixture(scope="module")
def module() -> SimpleNamespace:
    return execute(*KERNELS)


# The true value, and how far rounding may take a computed one from it. (100 digits are enough where the bound
# says something at all: then no sum loses more than the digits of a double to cancellation.)


def mpf(number: Fraction) -> mpmath.mpf:
    return mpmath.mpf(number.numerator) / number.denominator


@cache
def numbers(values: tuple[Fraction, ...]) -> list[mpmath.mpf]:
    with mpmath.workdps(100):
        return list(map(mpf, values))


def terms(values: tuple[Fraction, ...], x: mpmath.mpf) -> list[mpmath.mpf]:
    powers = accumulate([mpmath.mpf(x)] * (len(values) - 1), mul, initial=mpmath.mpf(1))
    return [coefficient * power for coefficient, power in zip(numbers(values), powers, strict=True)]


def value_and_bound(sample: PadeKernel, x: mpmath.mpf, form: Format) -> tuple[mpmath.mpf, mpmath.mpf] | None:
    """Return the true value and a bound of |computed - true| from a running error analysis.

    Each term c_i x^i is rounded once in c_i, twice a step in Horner's rule, and once a power in 1/x; then
    follow the quotient and the powers left over. Relative errors of terms are magnified by the condition
    number, sum |c_i x^i| / |sum c_i x^i|. Underflow adds the smallest number once an operation, and once more
    for 1/x where that is subnormal.

    Returns
    -------
    tuple or None
        None at or near a pole, where the bound says nothing.
    """
    a, b = sample.reduced
    left = abs(len(a) - len(b))
    with mpmath.workdps(100):
        unit = (3 * max(len(a), len(b)) + 2 * left + 2) * mpmath.ldexp(1, -form.precision)
        gamma = unit / (1 - unit)
        parts = [terms(values, x) for values in (a, b)]
        numerator, denominator = (mpmath.fsum(part) for part in parts)
        above, below = (gamma * mpmath.fsum(part, absolute=True) for part in parts)
        if below >= abs(denominator):
            return None
        true = numerator / denominator
        largest = (abs(numerator) + above) * (1 + gamma) / (abs(denominator) - below)
        underflow = (left + 1 + abs(mpf(a[-1]) / mpf(b[-1]))) * smallest(form)
        return true, largest - abs(true) + underflow


def smallest(form: Format) -> float:
    """Return the smallest positive number of a format."""
    return math.ldexp(1.0, 2 - form.largest - form.precision)


def greatest(form: Format) -> float:
    """Return the greatest finite number of a format."""
    return math.ldexp(2.0 - 2.0 ** (1 - form.precision), form.largest)


def deviation(sample: PadeKernel, x: float, computed: float, form: Format) -> str:
    """Return what is wrong with a computed value, "" if nothing is."""
    known = value_and_bound(sample, x, form)
    if known is None:
        return ""
    true, margin = known
    if math.isinf(computed):
        overflows = abs(true) + margin >= mpmath.ldexp(1, form.largest + 1)
        return "" if overflows and (computed > 0) == (true > 0) else f"{computed} at {x}"
    with mpmath.workdps(100):
        error = abs(computed - true)
    return "" if error <= margin else f"{computed!r} at {x!r}: {float(error / margin):.3g} times the bound"


def grid(sample: PadeKernel, form: Format) -> list[float]:
    """Return 0 to 1e6, extremes and the neighbourhood of the threshold, as values of the format."""
    points = [i / 16 for i in range(160)] + [10 ** (i / 19) for i in range(-5 * 19, 6 * 19 + 1)]
    points += [1e-300, 1e-40, 1e-30, 1e10, 1e30, 1e60, 1e105, 1e150, 1e300, 1e307, 1.7e308, 3.4e38, 2e37]
    threshold = 2.0 ** sample.threshold(form)
    points += [threshold * factor for factor in (0.5, 1 - 2.0**-20, 1, 1 + 2.0**-20, 1.5, 2, 1000)]
    points += [greatest(form), math.ldexp(1.0, 1 - form.largest)]
    inside = (x for x in points if math.ldexp(1.0, 1 - form.largest) <= x <= greatest(form))
    return [0.0, smallest(form), *(form.nearest(Fraction(x)) for x in inside)]


def faults(sample: PadeKernel, function: Callable[[float], float], form: Format) -> list[str]:
    """Return all that is wrong with a function of v* on the grid and at special values."""
    wrong = [text for x in grid(sample, form) if (text := deviation(sample, x, function(x), form))]
    for x in (0.0, -0.0, smallest(form), 1e-320 if form is DOUBLE else 1e-40):
        if function(x) != 1.0:
            wrong.append(f"{function(x)} at {x}")
    for x in (-smallest(form), -1.0, -1e30, -math.inf, math.nan):
        if not math.isnan(function(x)):
            wrong.append(f"{function(x)} at {x}")
    if function(math.inf) != pytest.approx(limit(sample), rel=2.0 ** (2 - form.precision), abs=0):
        wrong.append(f"{function(math.inf)} at infinity")
    return wrong


def limit(sample: PadeKernel) -> float:
    a, b = sample.reduced
    quotient = float(a[-1] / b[-1])
    if len(a) == len(b):
        return quotient
    return math.copysign(math.inf, quotient) if len(a) > len(b) else 0.0


# Kernel


def test_domain_ends_at_the_first_pole_or_zero() -> None:
    assert ARTIFICIAL[2].domain == "0 <= v* < 2.5 (there the formula has a pole)"
    # The paper speaks of a pole of [2/5] at 5.6801: with its own digits it is a zero of the numerator.
    table = kernel("1. 0.553528 -0.128445", "1. 0.553528 1.025 0.638466 0.384023 0.027908")
    assert table.pole is None
    assert table.domain.startswith("0 <= v* < 5.6801")
    assert table.domain.endswith("(there the formula has a zero)")
    both = kernel("1 -1", "1 -0.25")
    assert both.end == ("zero", 1)


def test_leading_zeros_are_dropped() -> None:
    assert PAPER[0].reduced == ((1,), PAPER[0].b[:3])
    assert PAPER[0].rounded(DOUBLE) == ((1.0,), (1.0, 0.0, float(PAPER[0].b[2])))


NEGATIVE = decimals_of(["1", "-1", "0", "0", "0", "0", "0"])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"m": 4}, r"\[4/6\] has 5 coefficients a_i, not 4"),
        ({"a": decimals_of(["1.1", "0", "0", "0"])}, "a_0 is 1.1, it must be 1"),
        ({"b": (Decimal(0), *PAPER[3].b[1:])}, "b_0 is 0, it must be 1"),
        ({"a": decimals_of(["1", "nan", "0", "0"])}, "NaN is not a finite number"),
        ({"pole": Decimal("3.5")}, r"\[3/6\] has no positive pole at v\* = 3.5"),
        ({"zero": Decimal("3.5")}, r"\[3/6\] has no positive zero at v\* = 3.5"),
        ({"b": NEGATIVE}, r"\[3/6\] has a positive pole, but pole is None"),
        ({"m": 6, "a": NEGATIVE}, r"\[6/6\] has a positive zero, but zero is None"),
        ({"b": NEGATIVE, "pole": Decimal("1.00000000001")}, r"\[3/6\] has no positive pole at v\* = 1.0"),
        ({"b": decimals_of("1100000"), "pole": Decimal(-1)}, r"\[3/6\] has no positive pole at v\* = -1"),
    ],
)
def test_contradictions_are_refused(changes: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message) as caught:
        replace(PAPER[3], **changes)  # type: ignore[arg-type]
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("changes", [{"m": 3.0}, {"a": [*PAPER[3].a]}, {"a": (1, 0, 0, 0)}, {"next_term": "1"}])
def test_wrong_types_are_refused(changes: dict[str, object]) -> None:
    with pytest.raises(TypeError):
        replace(PAPER[3], **changes)  # type: ignore[arg-type]


# Binary formats

decimals = st.decimals(allow_nan=False, allow_infinity=False, places=None).map(str)
normal = st.floats(allow_nan=False, allow_infinity=False).filter(lambda x: not x or abs(x) > 1e-300)


@given(
    st.integers(-(10**40), 10**40).filter(bool),
    st.integers(-300, 260),
)
def test_doubles_are_rounded_as_by_the_interpreter(mantissa: int, exponent: int) -> None:
    text = f"{mantissa}e{exponent}"
    assert DOUBLE.nearest(decimal_value(text)) == float(text)


@given(st.integers(-(10**40), 10**40).filter(bool), st.integers(-37, -3))
def test_floats_are_rounded_as_by_the_c_library(mantissa: int, exponent: int) -> None:
    strtof = getattr(ctypes.CDLL(None), "strtof", None)
    if strtof is None:
        pytest.skip("the C library's strtof cannot be reached")
    strtof.restype, strtof.argtypes = ctypes.c_float, [ctypes.c_char_p, ctypes.c_void_p]
    text = f"{mantissa}e{exponent}"
    assert FLOAT.nearest(decimal_value(text)) == strtof(text.encode(), None)


def test_a_float_is_rounded_once() -> None:
    number = 1 + Fraction(2) ** -24 + Fraction(2) ** -70
    assert float(number) == 1 + 2.0**-24, "by way of a double it is a tie, and goes down to 1"
    assert FLOAT.nearest(number) == 1 + 2.0**-23


@each_form
def test_rounding_at_the_ends_of_the_range(form: Format) -> None:
    largest = Fraction(2) ** (form.largest + 1)
    smallest = Fraction(2) ** (1 - form.largest)
    assert form.nearest(largest * (1 - Fraction(2) ** -form.precision)) == largest * (
        1 - Fraction(2) ** -form.precision
    )
    assert form.nearest(smallest) == smallest
    for number in (
        largest,
        largest * (1 - Fraction(2) ** (-form.precision - 1)),
        smallest / 2,
        -smallest / 3,
    ):
        with pytest.raises(ValueError, match=f"is not a normal number of type {form.name}"):
            form.nearest(number)


@given(normal)
def test_literals_of_doubles_read_back(x: float) -> None:
    assert float.fromhex(DOUBLE.hexadecimal(x)) == x
    assert float(DOUBLE.decimal(x)) == x


@given(st.floats(width=32, allow_nan=False, allow_infinity=False, allow_subnormal=False))
def test_literals_of_floats_read_back(x: float) -> None:
    assert float.fromhex(FLOAT.hexadecimal(x).removesuffix("f")) == x
    assert FLOAT.nearest(decimal_value(FLOAT.decimal(x).removesuffix("f"))) == x


@pytest.mark.parametrize(
    ("sample", "form"),
    [(sample, DOUBLE) for sample in KERNELS] + [(sample, FLOAT) for sample in KERNELS[:-1]],
    ids=[*(f"{label}-double" for label in IDS), *(f"{label}-float" for label in IDS[:-1])],
)
def test_threshold_is_the_largest_that_is_safe(sample: PadeKernel, form: Format) -> None:
    t = sample.threshold(form)
    limit = Fraction(2) ** (form.largest - 8)
    assert largest_sum(sample, Fraction(2) ** t) <= limit
    assert largest_sum(sample, Fraction(2) ** (t + 1)) > limit or t == form.largest


def largest_sum(sample: PadeKernel, x: Fraction) -> Fraction:
    return max(sum(abs(c) * x**i for i, c in enumerate(values)) for values in sample.reduced)


# C


@each_kernel
def test_double_functions(sample: PadeKernel, library: compiled.Library) -> None:
    assert not faults(sample, library[f"epsilon_{sample.name}"], DOUBLE)


@each_kernel
def test_float_functions(sample: PadeKernel, library: compiled.Library) -> None:
    if f"epsilon_{sample.name}f" not in library:
        assert sample is KERNELS[-1]
        return
    assert not faults(sample, library[f"epsilon_{sample.name}f"], FLOAT)


def test_what_fits_no_double_is_refused() -> None:
    with pytest.raises(ValueError, match=r"\[1/1\]: b_1 = 1.5e-400 is not a normal number of type double"):
        header(kernel("1 1", "1 1.5e-400"))
    with pytest.raises(ValueError, match=r"\[1/1\]: b_1 = 1.00000e\+400 is not a normal number"):
        header(kernel("1 1", "1 1e400"))
    with pytest.raises(ValueError, match=r"\[1/1\]: the coefficients are too large"):
        header(kernel("1 1", "1 1e307"))


# Python


def test_python_refuses_what_is_outside_the_domain(module: SimpleNamespace) -> None:
    pole = module.epsilon_pade_0_1
    assert pole(math.nextafter(2.5, 0)) > 1e15
    for x in (2.5, 3.0, 1e300, math.inf):
        with pytest.raises(ValueError, match=r"v_star = .* is at or beyond 2\.5, a pole of \[0/1\]$"):
            pole(x)
    with pytest.raises(ValueError, match=r" is beyond 5\.68.*, a zero of \[2/5\]$"):
        module.epsilon_pade_2_5(5.7)
    zero = next(sample for sample in PAPER if sample.label == "[2/5]").end[1]
    last = DOUBLE.nearest(Fraction(zero), math.floor)
    assert 0 < module.epsilon_pade_2_5(last) < 1e-15
    with pytest.raises(ValueError, match="a zero of"):
        module.epsilon_pade_2_5(math.nextafter(last, 6))


def test_python_computes_in_powers_of_u_where_the_domain_reaches_so_far() -> None:
    """The zero at 1e200 is beyond the threshold, at which v*^4 might overflow."""
    assert execute(kernel("1 0 0 1 -1e-200", "1 0 0 0 1")).epsilon_pade_4_4(1e100) == pytest.approx(1e-100, rel=1e-15)
    for sample in PAPER:
        assert ("u = 1.0 / v_star" in python.render([sample], COMMAND)) == (sample.end is None)


def test_python_refuses_a_denominator_lost_to_rounding() -> None:
    epsilon = execute(kernel("1", "1 -3 3 -1")).epsilon_pade_0_3
    lost = 0
    for x in (1 - i * 1e-7 for i in range(1, 200)):
        if 1.0 + x * (-3.0 + x * (3.0 + x * -1.0)) <= 0:
            lost += 1
            with pytest.raises(ValueError, match=r"^v_star = 0\.9999\d+ is too close to a pole of the formula$"):
                epsilon(x)
    assert lost


# Tables


def parse_csv(text: str) -> tuple[list[str], list[dict[str, str]]]:
    lines = text.splitlines(keepends=True)
    comments = [line for line in lines if line.startswith("#")]
    assert lines[: len(comments)] == comments, "comments come first"
    return comments, list(csv.DictReader(io.StringIO("".join(lines[len(comments) :]))))


def test_csv_reads_back() -> None:
    _, rows = parse_csv(tables.csv_table(KERNELS, COMMAND))
    expected = [
        {"m": str(each.m), "n": str(each.n), "symbol": symbol, "index": str(i), "value": str(value).lower()}
        for each in KERNELS
        for symbol, values in (("a", each.a), ("b", each.b))
        for i, value in enumerate(values)
    ]
    assert rows == expected


def test_json_reads_back() -> None:
    text = json.loads(tables.json_table(KERNELS, COMMAND))
    assert (text["command"], text["source"], text["end_condition"]) == (COMMAND, SOURCE, END_CONDITION)
    kernels = [
        PadeKernel(
            *(each[key] for key in ("m", "n")),
            *(decimals_of(each[key]) for key in "ab"),
            Decimal(each["next_term"]),
            *(None if each[key] is None else Decimal(each[key]) for key in ("pole", "zero")),
            each["source"],
        )
        for each in text["approximants"]
    ]
    assert tuple(kernels) == KERNELS
    assert [each["domain"] for each in text["approximants"]] == [each.domain for each in KERNELS]


def parse_latex(text: str) -> dict[tuple[int, int], dict[str, str]]:
    """Return (m, n) to the cells of its rows, as symbol to number."""
    found: dict[tuple[int, int], dict[str, str]] = {}
    rows = [line.removesuffix(r" \\").split(" & ") for line in text.splitlines() if "=" in line and line[0] != "%"]
    for m, n, *cells in rows:
        if m:
            degrees = int(m.strip("$")), int(n.strip("$"))
        for match in (re.fullmatch(r"\$([ab])_\{(\d+)\}=(.*)\$", cell) for cell in cells if cell):
            assert match
            found.setdefault(degrees, {})[match[1] + match[2]] = match[3]
        assert len(cells) == 3
    return found


def number(latex: str) -> Decimal:
    return Decimal(re.sub(r"\\times10\^\{(.*)\}", r"e\1", latex))


@pytest.mark.parametrize("digits", [1, 6, 15, 30])
def test_latex_reads_back(digits: int) -> None:
    found = parse_latex(tables.latex_table(KERNELS, COMMAND, digits))
    for each in KERNELS:
        cells = found[each.m, each.n]
        values = {f"{symbol}{i}": value for symbol in "ab" for i, value in enumerate(getattr(each, symbol))}
        assert set(cells) == set(values)
        for name, value in values.items():
            assert number(cells[name]) == Context(prec=digits).create_decimal(value)


def test_latex_has_the_layout_of_the_paper() -> None:
    table = kernel("1. 0.501086", "1. 0.501086 1.15345 0.577977 0.532178")
    assert tables.latex_table([table], COMMAND).splitlines()[-6:] == [
        r"$m$ & $n$ & $a_i$ & $b_i$ & \\",
        r"\hline",
        r"$1$ & $4$ & $a_{0}=1$ & $b_{0}=1$ & $b_{3}=0.577977$ \\",
        r" &  & $a_{1}=0.501086$ & $b_{1}=0.501086$ & $b_{4}=0.532178$ \\",
        r" &  &  & $b_{2}=1.15345$ &  \\",
        r"\end{tabular}",
    ]


H = ("1", "0", "-1.15344885809528707", "0", "0.798266555", "0.2666666666666666666666667", "1.5e-7")


def test_series_tables_read_back() -> None:
    _, rows = parse_csv(tables.series_csv(H, COMMAND))
    assert [(row["k"], row["h_k"]) for row in rows] == [(str(k), text) for k, text in enumerate(H)]
    text = json.loads(tables.series_json(H, COMMAND))
    assert (text["order"], tuple(text["h"])) == (6, H)
    with pytest.raises(ValueError, match="not a finite decimal number"):
        tables.series_csv(("1", "nan"), COMMAND)


# What all files have in common
