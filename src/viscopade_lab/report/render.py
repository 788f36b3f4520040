"""The files of the report: one self-contained HTML page, and the picture of time against error as SVG and PNG."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from viscopade.progress import track
from viscopade_lab.report import FORMATS
from viscopade_lab.report.choice import Panel, panels
from viscopade_lab.report.page import html, titles
from viscopade_lab.report.picture import NARROW, WIDE, content, drawn_curves, drawn_panels, inline
from viscopade_lab.report.result import FORMATS as NUMBERS
from viscopade_lab.report.result import Result, checked

PICTURE = "speed_against_error"
LAYOUTS = {"wide": WIDE, "narrow": NARROW}


def render(
    result: dict[str, Any], formats: Iterable[str] = FORMATS, *, source: str = "result"
) -> dict[str, str | bytes]:
    """Return file name and content of the report's files.

    Parameters
    ----------
    result : dict
        What `viscopade bench` measured; `from_json` reads it from a file.
    formats : iterable of str
        Some of `FORMATS`, for the pictures beside the page.
    source : str
        Name of the result's file, for messages.

    Returns
    -------
    dict of str to str or bytes
        report.html, and for each format speed_against_error and, where single precision was measured,
        speed_against_error_float.

    Raises
    ------
    ValueError
        For an unknown format, or one line that says what is wrong with the result.
    ModuleNotFoundError
        Without Matplotlib.
    """
    formats = list(formats)
    for kind in formats:
        if kind not in FORMATS:
            raise ValueError(f"format is {kind!r}: accepted are {', '.join(FORMATS)}")
    whole = checked(result, source)
    files: dict[str, str | bytes] = {}
    pictures: dict[str, list[str]] = {}
    for i in track(range(len(NUMBERS)), "pictures"):
        form = NUMBERS[i]
        shown = panels(whole, form)
        if shown:
            name = PICTURE if form == "double" else f"{PICTURE}_{form}"
            pictures[form] = _picture(form, shown, name, formats, files)
    curves = _curves(whole) if whole.curves else []
    return {"report.html": html(whole, pictures, curves), **files}


def _picture(form: str, shown: list[Panel], name: str, formats: list[str], files: dict[str, str | bytes]) -> list[str]:
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
        with drawn_curves(result.curves, result.settings.scene, layout) as sheet:
            elements.append(inline(sheet, size, "curves", alternative, {}))
    return elements
