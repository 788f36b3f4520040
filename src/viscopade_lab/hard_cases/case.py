"""Hard case: a question, what was measured, bounds that have to hold, and one picture."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SIZE = (7.3, 3.1)  # inches: 730 pixels of a page, at a hundred to the inch
STYLE: Any = {"font.size": 9, "axes.labelsize": 9, "axes.titlesize": 9, "xtick.labelsize": 8, "ytick.labelsize": 8}


class Row(NamedTuple):
    """A measured number with the bound that it must not exceed."""

    what: str
    measured: float
    bound: float

    @property
    def holds(self) -> bool:
        """Whether the bound holds; a NaN meets none."""
        return self.measured <= self.bound

    @property
    def part(self) -> float:
        """The measured number as a part of its bound."""
        if math.isnan(self.measured):
            return math.inf
        return self.measured / self.bound if self.bound else math.inf if self.measured > 0 else 0.0


class Finding(NamedTuple):
    """What running a case gave: its rows, a summary with numbers, and how the picture is drawn."""

    rows: tuple[Row, ...]
    summary: str
    draw: Callable[[Figure], None]

    @property
    def worst(self) -> Row:
        """The row that comes nearest to its bound, or exceeds it most."""
        return max(self.rows, key=lambda row: row.part)

    @property
    def holds(self) -> bool:
        """Whether all bounds hold."""
        return all(row.holds for row in self.rows)


class Case(NamedTuple):
    """A hard case; `measure` takes whether to be thorough, which needs minutes instead of seconds."""

    name: str
    title: str
    question: str
    measure: Callable[[bool], Finding]

    @classmethod
    def of(cls, module: str, text: str, measure: Callable[[bool], Finding]) -> Case:
        """Return the case of a module, whose docstring has the title, and then the question as a paragraph."""
        title, question = text.split("\n\n")[:2]
        name = module.rpartition(".")[2].replace("_", "-")
        return cls(name, title.strip().removesuffix("."), " ".join(question.split()), measure)


def number(value: float) -> str:
    """Return a number with four digits, a count in full."""
    return f"{value:.0f}" if value < 1e6 and value == int(value) else f"{value:.4g}"


def svg(case: Case, finding: Finding) -> bytes:
    """Return the picture of a case.

    Raises
    ------
    ModuleNotFoundError
        Without Matplotlib.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure as Sheet

    from viscopade.plots import sheet

    with sheet.styled(), rc_context(STYLE):
        figure = Sheet(figsize=SIZE)
        finding.draw(figure)
        return sheet.saved(figure, case.title, f"viscopade hardcases --only {case.name}", "svg")
