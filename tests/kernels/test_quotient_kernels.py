"""Tables of quotients, parsed back."""

from __future__ import annotations

import csv
import io
import json
import math
import re
from collections.abc import Iterable, Iterator
from dataclasses import replace
from decimal import Context, Decimal
from fractions import Fraction

import pytest
from flint import fmpq, fmpq_poly

from viscopade.arithmetic.balls import working
from viscopade.generated import END_CONDITION
from viscopade.kernels import prove_rational
from viscopade.kernels.forms.quotient import PadeKernel
from viscopade.kernels.requests import PAPER_DEGREES
from viscopade.kernels.targets import tables
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
