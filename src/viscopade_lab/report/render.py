"""The files of the report: one self-contained HTML page, and the picture of time against error as SVG and PNG."""

from __future__ import annotations

from collections.abc import Iterable

from viscopade.arithmetic.formats import FORMATS as NUMBERS
from viscopade.progress import track
from viscopade_lab.bench.result import Result
from viscopade_lab.report import FORMATS
from viscopade_lab.report.choice import PicturePanel, panels
from viscopade_lab.report.page import html, titles
from viscopade_lab.report.picture import NARROW, WIDE, content, drawn_curves, drawn_panels, inline

PICTURE = "speed_against_error"
LAYOUTS = {"wide": WIDE, "narrow": NARROW}


def render(result: Result, formats: Iterable[str] = FORMATS) -> dict[str, str | bytes]:
    """Return file name and content of the report's files.

    Parameters
    ----------
    result : Result
    formats : iterable of str
        Some of `FORMATS`, for the pictures beside the page.

    Returns
    -------
    dict of str to str or bytes
        report.html, and for each format speed_against_error and, where single precision was measured,
        speed_against_error_float.

    Raises
    ------
    ValueError
        For an unknown format.
    ModuleNotFoundError
        Without Matplotlib.
    """
    formats = list(formats)
    for kind in formats:
        if kind not in FORMATS:
            raise ValueError(f"format is {kind!r}: accepted are {', '.join(FORMATS)}")
    files: dict[str, str | bytes] = {}
    pictures: dict[str, list[str]] = {}
    names = tuple(NUMBERS)
    for i in track(range(len(names)), "pictures"):
        form = names[i]
        shown = panels(result, form)
        if shown:
            name = PICTURE if form == "double" else f"{PICTURE}_{form}"
            pictures[form] = _picture(form, shown, name, formats, files)
    curves = _curves(result) if result.curves else []
    return {"report.html": html(result, pictures, curves), **files}


def _picture(
    form: str, shown: list[PicturePanel], name: str, formats: list[str], files: dict[str, str | bytes]
) -> list[str]:
    """Draw time against error: add it to `files`, and return it for the page, one for each layout."""
    title = f"Time against error of eps(v), {form} precision"
    alternative = f"{title}. The tables below hold its numbers."
    elements = []
    for size, layout in LAYOUTS.items():
        with drawn_panels(shown, layout) as sheet:
            elements.append(inline(sheet, size, f"time-{form}", alternative, titles(shown)))
            if size == "wide":
                files |= {f"{name}.{kind}": content(sheet, kind, title) for kind in formats}
    return elements


def _curves(result: Result) -> list[str]:
    """Draw the error curves, for each layout."""
    alternative = "Relative error of eps against v*, one curve for each kernel."
    elements = []
    for size, layout in LAYOUTS.items():
        with drawn_curves(result.curves, result.conditions.range, layout) as sheet:
            elements.append(inline(sheet, size, "curves", alternative, {}))
    return elements
