"""Published curves eps(v), fitted as if they were data: how far each is from the viscoelastic law.

They are CURVES that authors drew through measurements. The measurements are not publicly available. Each is taken
at equally spaced ln v in the range given, with an assumed standard error of `SIGMA`.

- Bridges, Hatzes and Lin, Nature 309 (1984) 333: balls of ice, 0.32 (v/(cm/s))^-0.234, as Müller and Pöschel (2011)
  cite it.
- The same curve with the factor 0.34, at most 1, as N-body codes for planetary rings have it.
- Durda et al., Icarus 211 (2011) 849: spheres of granite, 0.83 +- 0.06 without a trend.

Run as `python -m viscopade_lab.studies.published`, or with `--format json`, or `--markdown`, for docs/results/fit.md.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import click
import numpy as np
from rich.table import Table

from viscopade import Points, fit
from viscopade.arrays.checked import FloatArray
from viscopade_lab.figures.paper import FIT_EXPONENT, FIT_FACTOR, FIT_SPEEDS
from viscopade_lab.script import command, console

NUMBER, SIGMA = 24, 0.02


@dataclass(frozen=True)
class Published:
    """A curve that was published: where it is from, its speeds in m/s, its standard error."""

    name: str
    slowest: float
    fastest: float
    epsilon: Callable[[FloatArray], FloatArray]
    sigma: float = SIGMA


CURVES = (
    Published(
        "ice: factor 0.32, power -0.234 of v in cm/s",
        FIT_SPEEDS[0] / 100,
        FIT_SPEEDS[1] / 100,
        lambda v: np.asarray(FIT_FACTOR * (100 * v) ** FIT_EXPONENT),
    ),
    Published(
        "ice in ring codes: factor 0.34, same power",
        FIT_SPEEDS[0] / 100,
        FIT_SPEEDS[1] / 100,
        lambda v: np.asarray(np.minimum(0.34 * (100 * v) ** FIT_EXPONENT, 1.0)),
    ),
    Published("granite: 0.83", 0.1, 1.5, lambda v: np.full_like(v, 0.83), 0.06),
)


@dataclass(frozen=True)
class PublishedRow:
    """What the fit of a curve says: the verdict, the exponent p with its error, the largest distance of eps."""

    curve: str
    verdict: str
    beta: float
    exponent: float
    exponent_error: float
    largest_difference: float


def row(curve: Published) -> PublishedRow:
    """Return what the fit of a curve says."""
    speed = np.geomspace(curve.slowest, curve.fastest, NUMBER)
    found = fit(Points.measured(speed, curve.epsilon(speed), sigma_epsilon=curve.sigma))
    free = next(each for each in found.laws if each.model.exponent is None)
    return PublishedRow(
        curve.name,
        found.verdict.word,
        found.beta,
        free.exponent,
        float(free.covariance[1, 1] ** 0.5),
        float(np.abs(found.main.residuals).max()),
    )


def measure(markdown: bool) -> dict[str, Any]:
    """Return a row for each curve."""
    return {"markdown": markdown, "rows": [asdict(row(curve)) for curve in CURVES]}


HEADER = ("curve", "verdict", "exponent p", "largest difference of eps to the law")


def show(result: dict[str, Any]) -> None:
    """Print the result for people."""
    rows = [
        (
            each["curve"],
            each["verdict"],
            f"{each['exponent']:.2f} +- {each['exponent_error']:.2f}",
            f"{each['largest_difference']:.3f}",
        )
        for each in result["rows"]
    ]
    if result["markdown"]:
        click.echo("| " + " | ".join(HEADER) + " |\n" + "|---" * len(HEADER) + "|")
        for cells in rows:
            click.echo("| " + " | ".join(cells) + " |")
        return
    table = Table(*HEADER)
    for cells in rows:
        table.add_row(*cells)
    console().print(table)


main = command(
    measure, show, click.option("--markdown", is_flag=True, help="Print a table in Markdown."), needs="scipy"
)


if __name__ == "__main__":
    main()
