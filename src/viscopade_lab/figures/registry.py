"""All figures by name, and their files as SVG, PDF or PNG.

The same versions of Matplotlib and of this package make the same bytes. Matplotlib is loaded only by drawing, its
settings are left as they were, and no display is needed.
"""

from __future__ import annotations

import io
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING

from viscopade.generated import marker_line
from viscopade.plots.sheet import PNG_DPI, STYLE, metadata, picture
from viscopade.progress import quietly, track
from viscopade.theory.law import VISCOELASTIC, Law
from viscopade_lab.figures import FORMATS, audit, cooling, laws, paper
from viscopade_lab.figures.paper import Figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Sheet

FIGURES: Mapping[str, Figure] = {**paper.FIGURES, **cooling.FIGURES, **laws.FIGURES, **audit.FIGURES}


def render(names: Iterable[str] | None = None, formats: Iterable[str] = ("svg",)) -> dict[str, bytes]:
    """Return file name and content of figures.

    Parameters
    ----------
    names : iterable of str, optional
        Keys of `FIGURES`; all of them if left out.
    formats : iterable of str
        Some of `FORMATS`.

    Raises
    ------
    ValueError
        For an unknown name or format.
    ModuleNotFoundError
        Without Matplotlib.
    """
    names, formats = list(FIGURES if names is None else names), list(formats)
    _refuse_unknown("figure", names, FIGURES)
    _refuse_unknown("format", formats, FORMATS)
    files = {}
    for i in track(range(len(names)), "figures"):
        with quietly(), drawn(names[i]) as sheet:
            for kind in formats:
                files[f"{names[i]}.{kind}"] = content(sheet, names[i], kind)
    return files


def render_law(law: Law, formats: Iterable[str] = ("svg",)) -> dict[str, bytes]:
    """Return file name and content of the figure of a law's series and approximants; formats and errors as above."""
    formats = list(formats)
    _refuse_unknown("format", formats, FORMATS)
    ends = "" if law.end == "force" else f"_{law.end}"
    exponents = f"a{law.elastic}_b{law.damping}".replace("/", "o")
    name = f"approximants_{'viscoelastic' if law == VISCOELASTIC else exponents}{ends}"
    of, command = laws.approximants_of(law), f"viscopade figures --law {law} --end {law.end}"
    with quietly():
        return {f"{name}.{kind}": picture(of.draw, of.description, command, kind) for kind in formats}


@contextmanager
def drawn(name: str) -> Iterator[Sheet]:
    """Draw a figure, and keep Matplotlib's settings as they must be for saving it within a `with` block."""
    from matplotlib import style

    with style.context(["default", dict(STYLE)]):
        sheet = FIGURES[name].draw()
        sheet.draw_without_rendering()
        sheet.set_layout_engine("none")  # what has been laid out stays so, the same for every format
        yield sheet


def _refuse_unknown(what: str, given: Iterable[str], known: Iterable[str]) -> None:
    for name in given:
        if name not in known:
            raise ValueError(f"{what} is {name!r}: accepted are {', '.join(known)}")


def content(sheet: Sheet, name: str, kind: str) -> bytes:
    """Return a drawn figure as a file's content; to be called within `drawn`."""
    buffer = io.BytesIO()
    made_by = marker_line(f"viscopade figures --only {name} --format {kind}")
    sheet.savefig(buffer, format=kind, dpi=PNG_DPI, metadata=metadata(FIGURES[name].description, made_by, kind))
    return buffer.getvalue()
