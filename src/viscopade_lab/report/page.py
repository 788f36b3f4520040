"""The report's page: HTML with everything in it, nothing to be fetched, no script."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from decimal import Decimal
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from viscopade.arithmetic.decimals import at_most
from viscopade.arithmetic.formats import FORMATS
from viscopade.arrays import double
from viscopade.collision import panel_proof
from viscopade.generated import environment, marker_line
from viscopade.theory.paper import CITATION
from viscopade_lab.bench.contender import ARRAY, MEASURES
from viscopade_lab.bench.result import Error, Result, Timing
from viscopade_lab.bench.speed_range import DISTRIBUTIONS, SpeedRange
from viscopade_lab.report.choice import PicturePanel, Point, Recommendation, choices, frontier, panel, title

if TYPE_CHECKING:
    from markupsafe import Markup

PageTable = dict[str, Any]

MARKS = {"ours": "●", "rival": "◆", "limit": "▲"}
GROUPS = {"ours": "this package", "rival": "another method", "limit": "a limit"}
PRECISION = {"double": "double precision", "float": "single precision (float)"}
SPEEDS_TEXT = {
    "log-uniform": "speeds spread evenly over the logarithm",
    "maxwell": "speeds of a Maxwellian gas",
    "equal": "all speeds equal",
}
MEASURE_TEXT = {
    "latency": "Each collision waits for the result of the one before, as in an event-driven simulation.",
    "throughput": "Collisions that do not wait for each other, with one function call for each.",
    "cache": "One call for an array that stays in the processor's cache.",
    "memory": "One call for an array that is read from memory and written back.",
}


def html(result: Result, pictures: Mapping[str, Sequence[str]], curves: Sequence[str]) -> str:
    """Return the page.

    Parameters
    ----------
    result : Result
        What was measured.
    pictures : mapping of str to sequence of str
        For each format the picture of time against error, as elements of the page.
    curves : sequence of str
        The picture of the error curves, likewise; empty if there are none.
    """
    from markupsafe import Markup

    jinja = environment(__name__, autoescape=True)
    jinja.filters |= {
        "plain": plain,
        "significant": significant,
        "error": scientific,
        "percent": percent,
        "unbroken": unbroken,
    }
    page = jinja.get_template("report.html.jinja").render(
        marker=marker_line("viscopade report"),
        result=result,
        ends=_ends(result.conditions.range),
        pictures={form: [Markup(element) for element in elements] for form, elements in pictures.items()},
        curves=[Markup(element) for element in curves],
        precision=PRECISION,
        marks=MARKS,
        groups=GROUPS,
        measures={m: MEASURE_TEXT[m] for m in MEASURES if any(row.measure == m for row in result.rows)},
        titles={measure: title(result, measure) for measure in MEASURES},
        speeds={s: SPEEDS_TEXT[s] for s in DISTRIBUTIONS if any(row.speeds == s for row in result.rows)},
        chosen=[table for form in FORMATS if (table := _choice_table(result, form))],
        times=[table for measure in MEASURES if (table := _time_table(result, measure))],
        alarms=_alarms(result),
        of_root=_of_root(result),
        steepest=at_most(panel_proof.steepest(), 2),
        unrated=_unrated(result),
        citation=CITATION,
    )
    return page.replace("\r", "")


def plain(value: float) -> str:
    """Return a number as short as possible: 0.01, 1e-6."""
    mantissa, _, exponent = f"{value:g}".partition("e")
    return f"{mantissa}e{int(exponent)}" if exponent else mantissa


def significant(value: float | None, digits: int = 4) -> str:
    """Return a number with so many digits, and without an exponent unless it is tiny; a dash for None."""
    if value is None:
        return "–"
    if value == 0:
        return "0"
    places = digits - 1 - math.floor(math.log10(float(f"{value:.{digits - 1}e}")))
    return f"{value:,.{max(0, places)}f}" if value >= 1e-3 else scientific(value, digits)


def scientific(value: float | None, digits: int = 3) -> str:
    """Return an error, rounded up: 6.70e-6; a dash for None."""
    if not value:
        return "–" if value is None else "0"
    # The shortest decimal that is this double: what is written in a result is not rounded at all.
    bound = Decimal(at_most(Fraction(repr(value)), digits))
    mantissa, _, exponent = f"{bound:.{digits - 1}e}".partition("e")
    return f"{mantissa}e{int(exponent)}"


def percent(value: float) -> str:
    """Return a part of 1 as percent."""
    return f"{significant(100 * value, 3)} %"


def unbroken(text: str) -> Markup:
    """Return text as HTML in which no line ends after a hyphen, such as in 1e-5 or -O2."""
    from markupsafe import Markup, escape

    words = (escape(word) for word in text.split(" "))
    return Markup(" ").join(Markup('<span class="word">{}</span>').format(w) if "-" in w else w for w in words)


def titles(panels: Sequence[PicturePanel]) -> dict[str, str]:
    """Return what the marks of a picture show when the pointer rests on them."""
    return {
        f"point-{number}-{i}": f"{point.row.label}: {significant(point.time)} ns{_error_text(point)}"
        for number, panel in enumerate(panels)
        for i, point in enumerate(panel.points)
    }


def _error_text(point: Point) -> str:
    if point.error is None:
        return ""
    return f", error {scientific(point.error)} ({'proven' if point.proven else 'sampled'})"


def _ends(speeds: SpeedRange) -> dict[str, Any]:
    """Return v* and eps at both ends of the range."""
    ends = [speeds.v_star(speed) for speed in (speeds.speed_min, speeds.speed_max)]
    epsilon = [float(double.epsilon(v_star)) for v_star in ends]
    return {"v_star": [significant(v, 3) for v in ends], "epsilon": [significant(e, 3) for e in epsilon]}


def _choice_table(result: Result, form: str) -> PageTable:
    """Return which kernel to take, for one format; nothing if none was measured."""
    found = [each for measure in MEASURES if (each := panel(result, form, measure)) is not None]
    chosen = choices(found)
    if not chosen:
        return {}
    columns = [each.title for each in found]
    rows = [{"need": _need(choice), "cells": [_cell(point) for point in choice.fastest]} for choice in chosen]
    best = sorted({point.row.label for each in found for point in frontier(each.points)})
    return {"format": form, "columns": columns, "rows": rows, "frontier": best}


def _need(choice: Recommendation) -> str:
    return "about the smallest" if choice.need is None else scientific(choice.need, 1)


def _cell(point: Point | None) -> dict[str, Any] | None:
    if point is None:
        return None
    return {
        "row": point.row,
        "time": f"{significant(point.time, 3)}\N{NO-BREAK SPACE}ns",
        "beside": _beside(point.row),
        "error": f"error {scientific(point.error, 2)}, {'proven' if point.proven else 'sampled'}",
    }


def _beside(row: Timing) -> str:
    """Return how a time compares: arrays with a copy, the rest with pow + [3/6]."""
    if row.measure in ARRAY:
        return "" if row.ratio_to_copy is None else f"{significant(row.ratio_to_copy, 3)} times a copy"
    if row.ratio_to_3_6 is None:
        return ""
    faster = row.ratio_to_3_6 <= 1
    factor = 1 / row.ratio_to_3_6 if faster else row.ratio_to_3_6
    words = f"{factor:.{1 if factor < 100 else 0}f} times {'faster' if faster else 'slower'} than"
    return f"{words} pow\N{NO-BREAK SPACE}+\N{NO-BREAK SPACE}[3/6]"


def _time_table(result: Result, measure: str) -> PageTable:
    """Return all times of one measure, the fastest first; nothing if there are none."""
    bodies = []
    for form in FORMATS:
        for speeds in DISTRIBUTIONS:
            rows = [r for r in result.rows if (r.measure, r.format, r.speeds) == (measure, form, speeds)]
            if rows:
                rows.sort(key=lambda row: (row.median, row.id))
                lines = [{"row": row, "error": _shown(result.error(row))} for row in rows]
                name = f"{PRECISION[form].capitalize()}; {SPEEDS_TEXT[speeds]}"
                bodies.append({"title": name, "lines": lines})
    return {"measure": measure, "title": title(result, measure), "bodies": bodies} if bodies else {}


def _shown(error: Error | None) -> str:
    return scientific(None if error is None else error.value)


def _alarms(result: Result) -> list[str]:
    """Return where a sampled error contradicts a proof."""
    return [
        f"{error.label} ({error.format}): the sampled error {scientific(error.sampled)} is larger than the proven "
        f"bound {error.proven}{f' ({error.note})' if error.note else ''}, and than {scientific(error.allowed)}, the "
        "most that it can be with the roundings that the proof leaves out."
        for error in result.errors
        if error.contradicts_proof
    ]


def _of_root(result: Result) -> list[str]:
    """Return which sampled errors are larger than a bound of eps(v*), as the rounding of v* allows."""
    return [
        f"{error.label} ({error.format}): sampled {scientific(error.sampled)}; proven of the kernel {error.proven}, "
        f"which is {scientific(error.bound)} or less; with the rounding of v* at most {scientific(error.allowed)}"
        for error in result.errors
        if error.exceeds_proof and not error.contradicts_proof
    ]


def _unrated(result: Result) -> list[str]:
    """Return the methods without a known error."""
    return list(
        dict.fromkeys(
            f"{row.label} ({row.format})"
            for row in result.rows
            if row.group != "limit" and ((error := result.error(row)) is None or error.value is None)
        )
    )
