r"""Tables written as LaTeX, CSV and JSON, and read back by readers that share nothing with the writers.

The reader of LaTeX does what LaTeX does with the few things that tables contain: "\\" takes a following "*" or "[…]"
for itself, even from the next line; "%" begins a comment; lines' ends and several spaces are one space.
"""

from __future__ import annotations

import io
import json
import re
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import redirect_stdout
from decimal import ROUND_HALF_EVEN, Context, Decimal
from itertools import chain
from typing import Any, NamedTuple

import numpy as np

from viscopade.kernels import names, requests
from viscopade.kernels.requests import Request
from viscopade.kernels.targets import tables
from viscopade.theory.series import series
from viscopade_lab.hard_cases.finding import Cell, Check, ResultTable

Rows = list[list[str]]

_COMMANDS = {r"\textbackslash": "\\", r"\textasciitilde": "~", r"\textasciicircum": "^"}
_TOKEN = re.compile(r"\\\\|\\[A-Za-z]+|\\.|\$[^$]*\$|\{\}|\s+|.", re.DOTALL)
_BODY = re.compile(r"\\begin\{tabular\}\{(l+)\}(.*)\\end\{tabular\}", re.DOTALL)
_FORBIDDEN = frozenset("#_^{}")  # without a backslash they mean something else
_TERM = re.compile(r"\$([ab])_\{(\d+)\}=(-?[0-9.]+)(?:\\times10\^\{(-?\d+)\})?\$")

# What LaTeX and CSV take for something else, and what only looks so.
HOSTILE = (
    *"[]*&%$#_{}\\~^,\"'-+=| x0üéε",
    *('""', "[0/3]", "\\\\", "1e-300", "-1.5", "100%", "v*^2", "a_0", "{}[", "10⁻³", "\\hline"),
    f"-0.{'1234567890' * 100}e-17",  # 1,000 digits
)


class ReadBack(NamedTuple):
    """How many cells of some tables were compared, and how many changed."""

    name: str
    form: str
    cells: int
    changed: int


# --- readers ----------------------------------------------------------------------------------------------------------


def read_latex(text: str, formula: Callable[[str], str] = str) -> Rows:
    """Return the cells of a tabular, as LaTeX would set them.

    Parameters
    ----------
    text : str
    formula : callable
        What a formula is read as; by default it stays as it is, between dollar signs.

    Raises
    ------
    ValueError
        If it is none, or a character in it would stop LaTeX.
    """
    found = _BODY.search(_without_comments(text))
    if found is None:
        raise ValueError("there is no tabular")
    rows: Rows = []
    cells = [""]
    tokens = [match[0] for match in _TOKEN.finditer(found[2])]
    place = 0
    while place < len(tokens):
        token = tokens[place]
        place += 1
        if token == r"\\":
            rows.append([" ".join(cell.split()) for cell in cells])
            cells = [""]
            place = _after_line_end(tokens, place)
        elif token == "&":
            cells.append("")
        elif token != r"\hline":
            cells[-1] += formula(token) if len(token) > 1 and token[0] == "$" else _character(token)
    if any(map(str.strip, cells)):
        raise ValueError("the last row has no end")
    if any(len(row) != len(found[1]) for row in rows):
        raise ValueError("a row has too many or too few cells")
    return rows


def as_text(formula: str) -> str:
    """Return a formula as the cell was before it became one: -1.5, 2e-5, v*^2, a_10.

    Raises
    ------
    ValueError
        If it is none of these.
    """
    text = re.sub(r"\\times10\^\{(-?\d+)\}$", r"e\1", formula.strip("$"))
    text = re.sub(r"([_^])\{(-?[0-9.]+|[A-Za-z]+)\}", r"\1\2", text.replace("v_*", "v*"))
    if not re.fullmatch(r"[|<>]|\[m/n\]|[+-]?[0-9.]+(e-?\d+)?|[\w*.-]+(\^[\w.-]+)?", text):
        raise ValueError(f"{formula!r} is no number, and no symbol with an index or a power")
    return text


def _without_comments(text: str) -> str:
    return re.sub(r"(?<!\\)((?:\\\\)*)%.*\n?", r"\1", text)


def _after_line_end(tokens: Sequence[str], place: int) -> int:
    r"""Return the place after what "\\" takes for its star and its argument."""
    for beginning, end in (("*", "*"), ("[", "]")):
        ahead = place
        while ahead < len(tokens) and tokens[ahead].isspace():
            ahead += 1
        if ahead < len(tokens) and tokens[ahead] == beginning:
            while ahead < len(tokens) and tokens[ahead] != end:
                ahead += 1
            place = ahead + 1
    return place


def _character(token: str) -> str:
    """Return what a token prints."""
    if token == "{}":
        return ""
    if token in _COMMANDS:
        return _COMMANDS[token]
    if len(token) == 2 and token[0] == "\\" and token[1] in "&%$#_{}":
        return token[1]
    if token in _FORBIDDEN or token.startswith("\\") or token == "$":
        raise ValueError(f"LaTeX would stop at {token!r}")
    return "\N{NO-BREAK SPACE}" if token == "~" else token


def read_csv(text: str) -> Rows:
    """Return the fields of CSV text (RFC 4180)."""
    rows: Rows = []
    row, cell, quoted = [], "", False
    place = 0
    while place < len(text):
        character = text[place]
        place += 1
        if character == '"':
            if quoted and text[place : place + 1] == '"':
                cell += '"'
                place += 1
            else:
                quoted = not quoted
        elif quoted or character not in ",\n":
            cell += character
        else:
            row.append(cell)
            cell = ""
            if character == "\n":
                rows.append(row)
                row = []
    if row or cell or quoted:
        raise ValueError("the last line has no end")
    return rows


def without_head(text: str) -> str:
    """Return an exported CSV file without the lines of comment that it begins with."""
    return re.sub(r"\A(?:#.*\n)*", "", text)


def read_coefficients(text: str) -> dict[tuple[int, int], dict[str, Decimal]]:
    """Return the numbers in an exported LaTeX table by degrees and name."""
    found: dict[tuple[int, int], dict[str, Decimal]] = {}
    terms: dict[str, Decimal] = {}
    for m, n, *cells in read_latex(text)[1:]:
        if m:
            terms = found.setdefault((int(m.strip("$")), int(n.strip("$"))), {})
        for cell in filter(None, cells):
            match = _TERM.fullmatch(cell)
            if match is None:
                raise ValueError(f"{cell!r} is no coefficient")
            terms[f"{match[1]}_{match[2]}"] = Decimal(f"{match[3]}e{match[4] or 0}")
    return found


# --- trips ------------------------------------------------------------------------------------------------------------


def changed(found: Iterable[Sequence[str]], wanted: Iterable[Sequence[str]]) -> tuple[int, int]:
    """Return how many cells were wanted, and how many are not as wanted; rows that are missing or too many count."""
    got, asked = list(map(tuple, found)), list(map(tuple, wanted))
    cells = sum(map(len, asked))
    if len(got) != len(asked):
        return cells, cells
    wrong = 0
    for row, other in zip(got, asked, strict=True):
        wrong += len(other) if len(row) != len(other) else sum(x != y for x, y in zip(row, other, strict=True))
    return cells, wrong


def shown(style: str, rows: Sequence[Sequence[str]]) -> str:
    """Return what the command line would print of a table; the first row is its header."""
    from viscopade.cli.console import show

    whole = {"header": list(rows[0]), "rows": [list(row) for row in rows[1:]]}
    with redirect_stdout(io.StringIO()) as printed:
        show(style, rows[0], rows[1:], whole)
    return printed.getvalue()


def read(style: str, text: str) -> Rows:
    """Return the rows of a table that `shown` printed."""
    if style == "latex":
        return read_latex(text, as_text)
    if style == "csv":
        return read_csv(text)
    whole = json.loads(text)
    return [whole["header"], *whole["rows"]]


def shown_and_back(style: str, rows: Sequence[Sequence[str]]) -> tuple[int, int]:
    """Return how many cells of a table were printed and read, and how many changed (all if it cannot be read)."""
    try:
        return changed(read(style, shown(style, rows)), rows)
    except ValueError:
        cells = sum(map(len, rows))
        return cells, cells


def hostile_table(generator: np.random.Generator) -> Rows:
    """Return a table of cells that LaTeX or CSV could misread."""
    columns = int(generator.integers(1, 5))

    def cell() -> str:
        return " ".join("".join(generator.choice(HOSTILE, generator.integers(1, 5))).split())

    return [[cell() for _ in range(columns)] for _ in range(int(generator.integers(2, 6)))]


def hostile(generator: np.random.Generator, number: int) -> Iterator[ReadBack]:
    """Print and read tables at random."""
    drawn = [hostile_table(generator) for _ in range(number)]
    for style in ("latex", "csv", "json"):
        counts = [shown_and_back(style, rows) for rows in drawn]
        yield ReadBack("tables of hostile cells", style, sum(c for c, _ in counts), sum(w for _, w in counts))


_SCRIPT = """
import contextlib, io, json, sys
from viscopade.cli.main import command
outputs = []
for words in json.load(sys.stdin):
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        command(words, standalone_mode=False)
    outputs.append(printed.getvalue())
json.dump(outputs, sys.stdout)
"""


def command_outputs(commands: Sequence[Sequence[str]]) -> list[str]:
    """Return what commands print, run one after the other in a process of their own."""
    run = subprocess.run(
        [sys.executable, "-c", _SCRIPT], input=json.dumps(commands), capture_output=True, text=True, check=True
    )
    return list(json.loads(run.stdout))


def from_commands(thorough: bool) -> Iterator[ReadBack]:
    """Run commands in every format, and compare what is read with each other and with the numbers themselves."""
    asked = [["coefficients", "--order", "30", "--digits", "50"], ["pade", "0", "3", "--digits", "20"], ["reproduce"]]
    if thorough:
        asked += [["coefficients", "--order", "4", "--digits", "1000"]]
        asked += [["pade", "2", "3", "--digits", "1000"], ["pade", "20", "23", "--digits", "50"]]
        asked += [["pade", "3", "6", "--digits", "40"]]
        asked += [["coefficients", "--order", "160", "--digits", "100"]]
    styles = "csv", "latex", "json"
    texts = iter(command_outputs([[*words, "--format", style] for words in asked for style in styles]))
    for words in asked:
        csv, latex, whole = (next(texts) for _ in styles)
        rows = read_csv(csv)
        name = f"viscopade {' '.join(words)}"
        yield ReadBack(name, "latex, csv", *_guarded(latex, rows))
        wanted = _in_json(words, json.loads(whole))
        yield ReadBack(name, "json, csv", *changed(_in_table(words, rows), wanted))
        if words[0] == "coefficients":
            h = series(int(words[2]), int(words[4])).decimals()
            yield ReadBack(name, "csv, numbers", *changed(rows[1:], [(str(k), value) for k, value in enumerate(h)]))


def _guarded(latex: str, rows: Rows) -> tuple[int, int]:
    try:
        return changed(read_latex(latex, as_text), rows)
    except ValueError:
        cells = sum(map(len, rows))
        return cells, cells


def _in_json(words: Sequence[str], whole: dict[str, list[Any]]) -> list[list[str]]:
    """Return the numbers of a command's JSON output as rows."""
    keys = {"coefficients": ["h"], "pade": ["a", "b"], "reproduce": ["entries"]}[words[0]]
    numbers = chain.from_iterable(whole[key] for key in keys)
    return [[entry["ours"] if isinstance(entry, dict) else str(entry) for entry in numbers]]


def _in_table(words: Sequence[str], rows: Rows) -> list[list[str]]:
    """Return the same numbers from the rows of its CSV output."""
    if words[0] == "coefficients":
        return [[row[1] for row in rows[1:]]]
    if words[0] == "reproduce":
        return [[row[4] for row in rows[1:]]]
    return [[row[2] for row in rows[1:] if row[0] in ("a", "b")]]


def from_exports(degrees: requests.Degrees) -> Iterator[ReadBack]:
    """Read the exported tables of Padé approximants, and of the series."""
    request = Request(pade=degrees)
    kernels = request.quotients()
    wanted = {
        (k.m, k.n): {f"{letter}_{i}": c for letter, part in zip("ab", k.texts, strict=True) for i, c in enumerate(part)}
        for k in kernels
    }
    rows = [[str(m), str(n), *_split(name), c] for (m, n), terms in wanted.items() for name, c in terms.items()]
    yield ReadBack("exported coefficients", "csv", *changed(read_csv(without_head(request.render("csv")))[1:], rows))
    records = json.loads(request.render("json"))["approximants"]
    found = [
        [str(r["m"]), str(r["n"]), letter, str(i), c]
        for r in records
        for letter in "ab"
        for i, c in enumerate(r[letter])
    ]
    yield ReadBack("exported coefficients", "json", *changed(found, rows))
    for digits in (1, 5, 15, 40):
        context = Context(prec=digits, rounding=ROUND_HALF_EVEN)
        read_numbers = read_coefficients(tables.latex_table(kernels, request.command("latex"), digits))
        pairs = [(numbers.get(name), context.create_decimal(c)) for key, terms in wanted.items()
                 for numbers in [read_numbers.get(key, {})] for name, c in terms.items()]  # fmt: skip
        wrong = sum(got != asked for got, asked in pairs) + abs(sum(map(len, read_numbers.values())) - len(pairs))
        yield ReadBack("exported coefficients", f"latex, {digits} digits", len(pairs), wrong)
    order, digits = names.SERIES_ORDER, names.SERIES_DIGITS
    h = series(order, digits).decimals()
    rows = [[str(k), value] for k, value in enumerate(h)]
    found = read_csv(without_head(requests.render_series("csv", order, digits)))[1:]
    yield ReadBack("exported series", "csv", *changed(found, rows))
    again = json.loads(requests.render_series("json", order, digits))["h"]
    yield ReadBack("exported series", "json", *changed([[value] for value in again], [[value] for value in h]))


def _split(name: str) -> list[str]:
    return name.split("_")


def all_trips(generator: np.random.Generator, number: int, thorough: bool) -> list[ReadBack]:
    """Make all tables and read them."""
    degrees = (*requests.PAPER_DEGREES, *(((6, 9), (10, 13), (4, 4), (9, 7)) if thorough else ()))
    return [*hostile(generator, number), *from_commands(thorough), *from_exports(degrees)]


# --- what is shown ----------------------------------------------------------------------------------------------------


def table(found: Sequence[ReadBack]) -> ResultTable:
    """Return the numbers of cells by kind of table."""
    rows: list[tuple[Cell, ...]] = [(t.name, t.form, t.cells, t.changed) for t in found]
    return ResultTable("Tables written and read back", ("table", "formats", "cells", "changed"), tuple(rows))


def checks(found: Sequence[ReadBack]) -> tuple[Check, ...]:
    """Return what must hold."""
    groups = {
        "tables of hostile cells": "cells of hostile text that change in LaTeX, CSV or JSON as commands print them",
        "viscopade": "cells that differ between the formats of a command's output, or from the numbers themselves",
        "exported": "numbers in exported LaTeX, CSV and JSON tables that are not those of what was exported",
    }
    return tuple(
        Check.never(statement, sum(t.changed for t in found if t.name.startswith(name)))
        for name, statement in groups.items()
    )
