"""Hard case: a question, measured numbers with their bounds, the result in words, and one picture."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class Row(NamedTuple):
    """A measured number: what it is, its value, and the bound that it must not exceed (infinite if there is none)."""

    what: str
    measured: float
    bound: float = math.inf

    @property
    def holds(self) -> bool:
        """Whether the bound holds; a NaN meets none."""
        return self.measured <= self.bound

    @property
    def ratio(self) -> float:
        """The measured number divided by its bound; infinite for NaN, and above a bound of 0."""
        if math.isnan(self.measured):
            return math.inf
        return self.measured / self.bound if self.bound else math.inf if self.measured > 0 else 0.0


class Finding(NamedTuple):
    """The result of a case: its rows, a summary in words, a function that draws the picture, and its height in inches.

    The function takes the axes of a picture of one column, 3.4 inches wide.
    """

    rows: tuple[Row, ...]
    summary: str
    draw: Callable[[Axes], None]
    height: float = 2.6
    """As other figures with one panel."""

    @property
    def worst(self) -> Row:
        """The row closest to its bound, or farthest above it."""
        return max(self.rows, key=lambda row: row.ratio)

    @property
    def holds(self) -> bool:
        """Whether all bounds hold."""
        return all(row.holds for row in self.rows)


class Case(NamedTuple):
    """A hard case: name on the command line, title, question, and the function that measures it.

    `measure` takes whether to be thorough: minutes, else seconds.
    """

    name: str
    title: str
    question: str
    measure: Callable[[bool], Finding]

    @classmethod
    def from_module(cls, module: str, docstring: str, measure: Callable[[bool], Finding]) -> Case:
        """Return the case of a module of this name.

        The docstring's first line is the title, with a full stop; its first paragraph is the question.
        """
        title, question = docstring.split("\n\n")[:2]
        name = module.rpartition(".")[2].replace("_", "-")
        return cls(name, title.strip().removesuffix("."), " ".join(question.split()), measure)


def number(value: float) -> str:
    """Return a number as text: four significant digits, or all of a whole number."""
    # Whole numbers from 10^6 on are no counts, and have four digits, too.
    return f"{value:.0f}" if value < 1e6 and value == int(value) else f"{value:.4g}"


def svg(case: Case, finding: Finding) -> bytes:
    """Return the picture of a case, with its `finding`, as the content of an SVG file.

    Raises
    ------
    ModuleNotFoundError
        Without Matplotlib.
    """
    from viscopade.plots import sheet

    with sheet.style_context():
        figure, (axes,) = sheet.new_sheet(finding.height)
        finding.draw(axes)
        return sheet.file_content(figure, case.title, f"viscopade hardcases --only {case.name}", "svg")
