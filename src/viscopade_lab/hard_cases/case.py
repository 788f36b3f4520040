"""Hard case: a question, measured numbers with their bounds, the result in words, and one picture."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SIZE = (7.3, 3.6)  # inches: the width of a page is 730 pixels, 100 to the inch
STYLE: Any = dict.fromkeys(("font.size", "axes.labelsize", "axes.titlesize", "legend.fontsize"), 10)
STYLE |= {"xtick.labelsize": 9.5, "ytick.labelsize": 9.5, "legend.frameon": False}


class Row(NamedTuple):
    """A measured number, with the bound that it must not exceed if there is one."""

    what: str
    measured: float
    bound: float = math.inf

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
    """The result of a case: its rows, a summary in words, and a function that draws the picture."""

    rows: tuple[Row, ...]
    summary: str
    draw: Callable[[Figure], None]

    @property
    def worst(self) -> Row:
        """The row closest to its bound, or farthest above it."""
        return max(self.rows, key=lambda row: row.part)

    @property
    def holds(self) -> bool:
        """Whether all bounds hold."""
        return all(row.holds for row in self.rows)


class Case(NamedTuple):
    """A hard case; its function `measure` takes minutes if thorough, else seconds."""

    name: str
    title: str
    question: str
    measure: Callable[[bool], Finding]

    @classmethod
    def of(cls, module: str, text: str, measure: Callable[[bool], Finding]) -> Case:
        """Return the case of a module; its docstring begins with the title and a paragraph with the question."""
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

    with sheet.style_context(), rc_context(STYLE):
        figure = Sheet(figsize=SIZE)
        finding.draw(figure)
        return sheet.file_content(figure, case.title, f"viscopade hardcases --only {case.name}", "svg")
