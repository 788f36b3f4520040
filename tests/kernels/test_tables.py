"""Tables of quotients and of the series, parsed back."""

import csv
import io
import json
import re
from decimal import Context, Decimal

import pytest

from tests.kernels.test_quotient import SAMPLES, made_up
from viscopade.generated import END_CONDITION
from viscopade.kernels import compact
from viscopade.kernels.quotient import PADE_SOURCE, ProvenPade
from viscopade.kernels.write import tables

COMMAND = "viscopade export json --pade 3/6 --pade 1/4"
KERNELS = [sample.kernel() for sample in SAMPLES]


def parse_csv(text):
    lines = text.splitlines(keepends=True)
    comments = [line for line in lines if line.startswith("#")]
    assert lines[: len(comments)] == comments, "comments come first"
    return list(csv.DictReader(io.StringIO("".join(lines[len(comments) :]))))


def test_csv_reads_back():
    assert parse_csv(tables.csv_table(KERNELS, COMMAND)) == [
        {
            "m": str(len(each.a) - 1),
            "n": str(len(each.b) - 1),
            "symbol": symbol,
            "index": str(i),
            "value": str(c).lower(),
        }
        for each in SAMPLES
        for symbol, values in (("a", each.a), ("b", each.b))
        for i, c in enumerate(values)
    ]


def test_json_reads_back():
    text = json.loads(tables.json_table(KERNELS, COMMAND))
    assert (text["command"], text["source"], text["end_condition"]) == (COMMAND, PADE_SOURCE, END_CONDITION)
    for each, sample in zip(text["approximants"], SAMPLES, strict=True):
        a, b = (tuple(map(Decimal, each[letter])) for letter in "ab")
        zero, pole = (each[kind] and Decimal(each[kind]) for kind in ("zero", "pole"))
        read = ProvenPade(a, b, Decimal(each["next_term"]), pole, zero)
        assert (read.a, read.b, read.next_term, read.pole) == (sample.a, sample.b, sample.next_term, sample.pole)
        assert float(read.zero or 0) == float(sample.zero or 0)
        assert each["domain"] == sample.domain


def parse_latex(text):
    """Return (m, n) to the cells of its rows, as symbol to number."""
    found = {}
    rows = [line.removesuffix(r" \\").split(" & ") for line in text.splitlines() if "=" in line and line[0] != "%"]
    for m, n, *cells in rows:
        if m:
            degrees = int(m.strip("$")), int(n.strip("$"))
        for match in (re.fullmatch(r"\$([ab])_\{(\d+)\}=(.*)\$", cell) for cell in cells if cell):
            found.setdefault(degrees, {})[match[1] + match[2]] = Decimal(
                re.sub(r"\\times10\^\{(.*)\}", r"e\1", match[3])
            )
        assert len(cells) == 3
    return found


@pytest.mark.parametrize("digits", [1, 6, 15, 30])
def test_latex_reads_back(digits):
    distinct = {(len(each.a) - 1, len(each.b) - 1): each for each in SAMPLES}
    found = parse_latex(tables.latex_table([each.kernel() for each in distinct.values()], COMMAND, digits))
    for degrees, each in distinct.items():
        assert found[degrees] == {
            f"{symbol}{i}": Context(prec=digits).create_decimal(value)
            for symbol, values in (("a", each.a), ("b", each.b))
            for i, value in enumerate(values)
        }


def test_latex_has_the_layout_of_the_paper():
    table = made_up("1. 0.501086", "1. 0.501086 1.15345 0.577977 0.532178").kernel()
    assert tables.latex_table([table], COMMAND).splitlines()[-6:] == [
        r"$m$ & $n$ & $a_i$ & $b_i$ & \\",
        r"\hline",
        r"$1$ & $4$ & $a_{0}=1$ & $b_{0}=1$ & $b_{3}=0.577977$ \\",
        r" &  & $a_{1}=0.501086$ & $b_{1}=0.501086$ & $b_{4}=0.532178$ \\",
        r" &  &  & $b_{2}=1.15345$ &  \\",
        r"\end{tabular}",
    ]


def test_what_is_no_quotient_has_no_table_of_coefficients():
    with pytest.raises(ValueError, match="compact_1em3 is no quotient of polynomials"):
        tables.csv_table([compact.compact("1e-3")], COMMAND)


H = ("1", "0", "-1.15344885809528707", "0", "0.798266555", "0.2666666666666666666666667", "1.5e-7")


def test_series_tables_read_back():
    rows = parse_csv(tables.series_csv(H, COMMAND))
    assert [(row["k"], row["h_k"]) for row in rows] == [(str(k), text) for k, text in enumerate(H)]
    text = json.loads(tables.series_json(H, COMMAND))
    assert (text["order"], tuple(text["h"])) == (6, H)
    with pytest.raises(ValueError, match="not a finite decimal number"):
        tables.series_csv(("1", "nan"), COMMAND)
