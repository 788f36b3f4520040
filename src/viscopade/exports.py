"""Which files `exports/` holds, and the command that makes each: `viscopade reproduce` writes all of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from viscopade import proofs
from viscopade.certificate import Measure
from viscopade.kernels import Quotient, c, full, python, tables
from viscopade.paper import TABLE
from viscopade.series import series

SERIES_ORDER, SERIES_DIGITS = 60, 50
PAPER_DEGREES = tuple(TABLE)

Degrees = Sequence[tuple[int, int]]

RENDERERS: Mapping[str, Callable[[Sequence[Quotient], str], str]] = {
    "c": c.render,
    "python": python.render,
    "csv": tables.csv,
    "json": tables.json,
    "latex": tables.latex,
    "certificates": tables.certificates,
}


@dataclass(frozen=True)
class Request:
    """What `viscopade export` is asked for: approximants, each in the words of its option.

    Attributes
    ----------
    pade, minimax : sequence of (m, n)
        Degrees of Padé and of best approximants.
    accuracy : sequence of str
        Proven errors of best approximants, whose degrees are chosen.
    v_star_max, v_star_min : str or None
        Interval of the best approximants.
    measure : "both" or "relative"
        Of their error.
    full : bool
        The kernels of full accuracy, in C, alone.
    """

    pade: Degrees = ()
    minimax: Degrees = ()
    accuracy: Sequence[str] = ()
    v_star_max: str | None = None
    v_star_min: str = "0"
    measure: Measure = "both"
    full: bool = False

    def __post_init__(self) -> None:
        if self.full and (self.pade or self.minimax or self.accuracy):
            raise ValueError("the kernels of full accuracy stand alone: accepted is nothing else with full (--full)")
        if (self.minimax or self.accuracy) and self.v_star_max is None:
            raise ValueError("a best approximant needs an interval: accepted is also v_star_max (--v-star-max)")
        if not (self.minimax or self.accuracy) and (self.v_star_max, self.v_star_min) != (None, "0"):
            raise ValueError(
                "an interval is for best approximants: accepted is also minimax or accuracy (--minimax, --accuracy)"
            )

    def command(self, target: str) -> str:
        """Return the command line."""
        words = ["viscopade export", target, *(["--full"] if self.full else [])]
        words += (f"--pade {m}/{n}" for m, n in self.pade)
        words += (f"--minimax {m}/{n}" for m, n in self.minimax)
        words += (f"--accuracy {accuracy}" for accuracy in self.accuracy)
        words += [f"--v-star-min {self.v_star_min}"] if self.v_star_min != "0" else []
        words += [f"--v-star-max {self.v_star_max}"] if self.v_star_max is not None else []
        words += [f"--measure {self.measure}"] if self.measure != "both" else []
        return " ".join(words)

    def kernels(self) -> list[Quotient]:
        """Return the kernels, with their proofs.

        Raises
        ------
        ValueError
            If an approximant does not exist, or cannot be as accurate as wanted.
        """
        ends = self.v_star_max, self.v_star_min, self.measure
        found: list[Quotient] = [proofs.of_pade(m, n) for m, n in self.pade]
        found += (proofs.of_minimax(m, n, *ends) for m, n in self.minimax)
        chosen = {kernel.name: kernel for kernel in (proofs.accurate(accuracy, *ends) for accuracy in self.accuracy)}
        return [*found, *chosen.values()]  # one kernel may be the cheapest for several accuracies

    def render(self, target: str) -> str:
        """Return the text that `viscopade export` makes.

        Raises
        ------
        ValueError
            For an unknown target, an approximant that does not exist, or the same one twice.
        """
        if target not in RENDERERS:
            raise ValueError(f"target is {target!r}: accepted are {', '.join(RENDERERS)}")
        if self.full and target != "c":
            raise ValueError(f"target is {target!r}: the kernels of full accuracy are written in C only, accepted is c")
        if self.full:
            return full.render(self.command(target))
        return RENDERERS[target](self.kernels(), self.command(target))


PAPER = Request(pade=PAPER_DEGREES)
RECOMMENDED = Request(accuracy=("1e-3", "1e-5", "1e-8"), v_star_max="5")

_FILES = {
    "viscopade_pade.h": (PAPER, "c"),
    "viscopade_pade.py": (PAPER, "python"),
    "pade_table.csv": (PAPER, "csv"),
    "pade_table.json": (PAPER, "json"),
    "pade_table.tex": (PAPER, "latex"),
    "pade_certificates.json": (PAPER, "certificates"),
    "viscopade_minimax.h": (RECOMMENDED, "c"),
    "viscopade_minimax.py": (RECOMMENDED, "python"),
    "minimax_table.json": (RECOMMENDED, "json"),
    "minimax_certificates.json": (RECOMMENDED, "certificates"),
    "viscopade_full.h": (Request(full=True), "c"),
}


def render(target: str, degrees: Degrees = PAPER_DEGREES) -> str:
    """Return the text that `viscopade export TARGET --pade …` makes; errors as for `Request.render`."""
    return Request(pade=degrees).render(target)


def render_series(target: str, order: int, digits: int) -> str:
    """Return the table of h_0 … h_order as CSV or JSON, with its provenance."""
    command = f"viscopade export series-{target} --order {order} --digits {digits}"
    renderer = {"csv": tables.series_csv, "json": tables.series_json}[target]
    return renderer(series(order, digits).decimals(), command)


def files() -> dict[str, str]:
    """Return name and text of every file in `exports/`."""
    texts = {name: request.render(target) for name, (request, target) in _FILES.items()}
    for target in ("csv", "json"):
        texts[f"series.{target}"] = render_series(target, SERIES_ORDER, SERIES_DIGITS)
    return texts
