"""Which files `exports/` holds, and the command that makes each: `viscopade reproduce` writes all of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from viscopade.balls import known_decimal
from viscopade.kernels import Kernel, c, python, tables
from viscopade.pade import Pade, pade
from viscopade.paper import TABLE
from viscopade.series import series

DIGITS = 40
SERIES_ORDER, SERIES_DIGITS = 60, 50
PAPER_DEGREES = tuple(TABLE)

# Plain ASCII: it stands in source files that compilers with other character sets read.
SOURCE = (
    "Pade approximant (eq:padeDef) of the exact series (eq:epsSeriesAdvanced), derived from the equation of "
    f"motion; coefficients proven to {DIGITS} digits"
)

RENDERERS: Mapping[str, Callable[[Sequence[Kernel], str], str]] = {
    "c": c.render,
    "python": python.render,
    "csv": tables.csv,
    "json": tables.json,
    "latex": tables.latex,
}

_FILES = {
    "viscopade_pade.h": "c",
    "viscopade_pade.py": "python",
    "pade_table.csv": "csv",
    "pade_table.json": "json",
    "pade_table.tex": "latex",
}


def kernel(approximant: Pade) -> Kernel:
    """Return the exporters' description of an approximant, with `DIGITS` digits."""
    a, b = approximant.decimals(DIGITS)
    pole = approximant.positive_pole
    # The exporters state [m/n] - eps at order m + n + 1, whether or not the approximant does better.
    better = approximant.contact_order > approximant.m + approximant.n
    return Kernel(
        m=approximant.m,
        n=approximant.n,
        a=a,
        b=b,
        next_term="0" if better else known_decimal(-approximant.next_term, 10),
        pole=None if pole is None else pole.decimals(DIGITS)[0],
        source=SOURCE,
    )


def render(target: str, degrees: Sequence[tuple[int, int]] = PAPER_DEGREES) -> str:
    """Return the text that `viscopade export TARGET --pade …` makes.

    Parameters
    ----------
    target : str
        A key of `RENDERERS`.
    degrees : sequence of (m, n)

    Raises
    ------
    ValueError
        For an unknown target, an approximant that does not exist, or the same one twice.
    """
    if target not in RENDERERS:
        raise ValueError(f"target is {target!r}: accepted are {', '.join(RENDERERS)}")
    command = " ".join(["viscopade export", target, *(f"--pade {m}/{n}" for m, n in degrees)])
    return RENDERERS[target]([kernel(pade(m, n, DIGITS)) for m, n in degrees], command)


def render_series(target: str, order: int, digits: int) -> str:
    """Return the table of h_0 … h_order as CSV or JSON, with its provenance."""
    command = f"viscopade export series-{target} --order {order} --digits {digits}"
    renderer = {"csv": tables.series_csv, "json": tables.series_json}[target]
    return renderer(series(order, digits).decimals(), command)


def files() -> dict[str, str]:
    """Return name and text of every file in `exports/`."""
    texts = {name: render(target) for name, target in _FILES.items()}
    for target in ("csv", "json"):
        texts[f"series.{target}"] = render_series(target, SERIES_ORDER, SERIES_DIGITS)
    return texts
