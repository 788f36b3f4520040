"""What a hard case is, and what running it found: measured numbers, tables and curves, and checks with their limits.

A finding is plain data: it goes to JSON and back, and the page and the figures are made from it alone.
"""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal, TypeVar, cast, get_args

import numpy as np

from viscopade.arrays.checked import FloatArray
from viscopade.records import Node

Relation = Literal["<=", ">=", "=="]
Look = Literal["line", "bound", "points"]
Scale = Literal["linear", "log"]
Cell = str | int | float
Made = TypeVar("Made")

_NAME = re.compile(r"[a-z0-9-]{1,40}")
_HOLDS: Mapping[str, Callable[[float, float], bool]] = {"<=": operator.le, ">=": operator.ge, "==": operator.eq}


@dataclass(frozen=True)
class Check:
    """A statement on one measured number that has to hold.

    Attributes
    ----------
    statement : str
        What must be so, in words.
    measured : float
    relation : str
        "<=", ">=" or "==".
    limit : float
        Where it comes from is said in the statement; it is not tuned to what was measured.
    """

    statement: str
    measured: float
    relation: Relation
    limit: float

    def __post_init__(self) -> None:
        if self.relation not in _HOLDS:
            raise ValueError(f"relation is {self.relation!r}: accepted are {', '.join(_HOLDS)}")
        if not math.isfinite(self.limit):
            raise ValueError(f"limit is {self.limit!r}: accepted is a finite number")

    @classmethod
    def within(cls, statement: str, part: float) -> Check:
        """Return the check that an error is within its bound; `part` is their quotient."""
        return cls(statement, part, "<=", 1)

    @classmethod
    def never(cls, statement: str, count: int) -> Check:
        """Return the check that what is counted does not occur."""
        return cls(statement, count, "==", 0)

    @property
    def holds(self) -> bool:
        """Whether it does; with a NaN it does not."""
        return _HOLDS[self.relation](self.measured, self.limit)


@dataclass(frozen=True)
class ResultTable:
    """Measured numbers in rows; every row has a cell for each column."""

    title: str
    header: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]

    def __post_init__(self) -> None:
        if any(len(row) != len(self.header) for row in self.rows):
            raise ValueError(f"table {self.title!r}: every row needs {len(self.header)} cells")


@dataclass(frozen=True)
class ChartCurve:
    """Points of a chart, joined ("line"), joined as a proven or expected bound ("bound"), or not ("points")."""

    name: str
    x: tuple[float, ...]
    y: tuple[float, ...]
    look: Look = "line"

    def __post_init__(self) -> None:
        if len(self.x) != len(self.y) or not self.x:
            raise ValueError(f"curve {self.name!r}: x and y need the same length, and at least one point")
        if not all(map(math.isfinite, (*self.x, *self.y))):
            raise ValueError(f"curve {self.name!r}: every coordinate must be finite")
        if self.look not in get_args(Look):
            raise ValueError(f"curve {self.name!r}: look is {self.look!r}: accepted are {', '.join(get_args(Look))}")


@dataclass(frozen=True)
class Chart:
    """One panel of the case's figure. Points that a logarithmic axis cannot show are left out when it is drawn."""

    title: str
    x_label: str
    y_label: str
    curves: tuple[ChartCurve, ...]
    x_scale: Scale = "log"
    y_scale: Scale = "log"


@dataclass(frozen=True)
class Outcome:
    """What running a case gave.

    Attributes
    ----------
    summary : str
        A few sentences with the numbers that matter.
    tables : tuple of ResultTable
    charts : tuple of Chart
        At least one, unless a check fails.
    checks : tuple of Check
        At least one; the case passes if all hold.
    """

    summary: str
    tables: tuple[ResultTable, ...]
    charts: tuple[Chart, ...]
    checks: tuple[Check, ...]

    def __post_init__(self) -> None:
        if not self.checks:
            raise ValueError("a result needs at least one check")
        if self.passes and not self.charts:
            raise ValueError("a result that passes needs at least one chart")

    @property
    def passes(self) -> bool:
        """Whether all checks hold."""
        return all(check.holds for check in self.checks)


@dataclass(frozen=True)
class Case:
    """A hard case.

    Attributes
    ----------
    name : str
        Unique, such as "truncated-series".
    title : str
    question : str
        What is tried, and what must not happen.
    run : callable
        Takes whether to be thorough: a quick run takes seconds, a thorough one minutes; both make the same checks.
    """

    name: str
    title: str
    question: str
    run: Callable[[bool], Outcome]


@dataclass(frozen=True)
class Finding:
    """The name, title and question of a case with what running it gave, thoroughly or not.

    The name is one of a file, too, so it has lower-case letters, digits and hyphens only.
    """

    name: str
    title: str
    question: str
    thorough: bool
    result: Outcome

    def __post_init__(self) -> None:
        if not _NAME.fullmatch(self.name):
            raise ValueError(f"name is {self.name!r}: accepted are lower-case letters, digits and hyphens")

    def to_json(self) -> dict[str, Any]:
        """Return everything as a dictionary that JSON can hold; what is no finite number becomes null."""
        whole = asdict(self) | {"passes": self.result.passes}
        for check in whole["result"]["checks"]:
            check["measured"] = check["measured"] if math.isfinite(check["measured"]) else None
        return whole


def curve(name: str, x: Iterable[Any], y: Iterable[Any], look: Look = "line") -> ChartCurve:
    """Return the curve through the finite ones of these points, with as many digits as a figure can show."""
    points = [(float(f"{float(p):.7g}"), float(f"{float(q):.7g}")) for p, q in zip(x, y, strict=True)]
    finite = [point for point in points if all(map(math.isfinite, point))]
    return ChartCurve(name, tuple(p for p, _ in finite), tuple(q for _, q in finite), look)


def binned(x: FloatArray, y: FloatArray, edges: FloatArray) -> tuple[list[float], list[float]]:
    """Return the middle of each interval between edges (log10 of x), and the largest y of the points there."""
    place = np.digitize(np.log10(x), edges) - 1
    found = np.full(len(edges) - 1, -np.inf)
    inside = (place >= 0) & (place < len(found))
    np.maximum.at(found, place[inside], y[inside])
    middles = 10 ** ((edges[1:] + edges[:-1]) / 2)
    taken = np.isfinite(found)
    return middles[taken].tolist(), found[taken].tolist()


def signed(value: float) -> str:
    """Return a number with a sign that stands apart, to be added in a formula."""
    return f"{'-' if value < 0 else '+'} {abs(value):.1f}"


def from_json(text: str | bytes, source: str) -> tuple[Finding, ...]:
    """Return the findings in what `viscopade hardcases --format json` printed.

    Raises
    ------
    ValueError
        If it is something else; the message names `source` and the place.
    """
    return tuple(map(_finding, Node.of_json(text, source)["cases"].items()))


def _finding(node: Node) -> Finding:
    name, title, question = (node[key].text() for key in ("name", "title", "question"))
    return _made(node, Finding, name, title, question, node["thorough"].flag(), _result(node["result"]))


def _result(node: Node) -> Outcome:
    parts = (_table, "tables"), (_chart, "charts"), (_check, "checks")
    tables, charts, checks = (tuple(map(read, node[key].items())) for read, key in parts)
    return _made(node, Outcome, node["summary"].text(), tables, charts, checks)


def _table(node: Node) -> ResultTable:
    rows = tuple(tuple(map(_cell, row.items())) for row in node["rows"].items())
    header = tuple(name.text(empty=True) for name in node["header"].items())
    return _made(node, ResultTable, node["title"].text(), header, rows)


def _cell(node: Node) -> Cell:
    if isinstance(node.value, str):
        return node.value
    if isinstance(node.value, bool) or not isinstance(node.value, int | float) or not math.isfinite(node.value):
        raise node.refuse("text or a finite number")  # JSON has no other
    return node.value


def _chart(node: Node) -> Chart:
    scales = [cast(Scale, node[key].choice(get_args(Scale))) for key in ("x_scale", "y_scale")]
    curves = tuple(map(_curve, node["curves"].items()))
    return Chart(node["title"].text(empty=True), node["x_label"].text(), node["y_label"].text(), curves, *scales)


def _curve(node: Node) -> ChartCurve:
    x, y = (tuple(map(_real, node[key].items())) for key in ("x", "y"))
    return _made(node, ChartCurve, node["name"].text(), x, y, node["look"].choice(get_args(Look)))


def _check(node: Node) -> Check:
    relation = node["relation"].choice(get_args(Relation))
    measured = math.nan if node["measured"].value is None else _real(node["measured"])
    return _made(node, Check, node["statement"].text(), measured, relation, _real(node["limit"]))


def _real(node: Node) -> float:
    return node.within("a number", lambda number: True)


def _made(node: Node, kind: Callable[..., Made], *parts: object) -> Made:
    """Return what is made of these parts; a refusal gets the names of the file and the key."""
    try:
        return kind(*parts)
    except ValueError as error:
        accepted = "accepted is what `viscopade hardcases --out` wrote"
        raise ValueError(f"{node.source}: {node.key}: {error}: {accepted}") from None
