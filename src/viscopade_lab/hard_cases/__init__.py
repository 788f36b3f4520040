"""Hard cases: scripts that measure viscopade at its numerically hardest inputs and compare with bounds."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from textwrap import fill

from viscopade.generated import marker_lines
from viscopade.progress import quietly, track
from viscopade_lab.hard_cases import compilers, extremes, pade_systems, rounded_data, rounding, truncated_series
from viscopade_lab.hard_cases.case import Case, Finding, Row, number, svg

__all__ = ["CASES", "HEADER", "PAGE", "Case", "Finding", "Row", "choose_cases", "files", "measure_cases", "rows"]

CASES = tuple(
    Case.from_module(module.__name__, module.__doc__ or "", module.measure)
    for module in (truncated_series, pade_systems, rounded_data, rounding, extremes, compilers)
)
"""In the order of the page."""
HEADER = ("case", "question", "closest to its bound", "measured", "bound", "holds")
PAGE = "hard-cases.md"
# For `str.translate`: characters that are commands of Markdown, each with a backslash before it.
_ESCAPES = {ord(character): "\\" + character for character in "\\|*_<>[]#~$"}


def choose_cases(names: Iterable[str]) -> tuple[Case, ...]:
    """Return the cases of these names, in this order and each once; all if there is no name.

    Raises
    ------
    ValueError
        If there is no case of a name.
    """
    case_by_name = {case.name: case for case in CASES}
    chosen_names = list(dict.fromkeys(names)) or list(case_by_name)
    for name in chosen_names:
        if name not in case_by_name:
            raise ValueError(f"there is no hard case {name!r}: expected one of {', '.join(case_by_name)}")
    return tuple(case_by_name[name] for name in chosen_names)


def measure_cases(cases: Sequence[Case], thorough: bool) -> list[Finding]:
    """Return the findings of cases, in their order, with a bar of progress; `thorough` takes minutes, not seconds."""
    findings = []
    for i in track(range(len(cases)), "hard cases"):
        with quietly():  # cases have bars of progress of their own, which would stand within this one
            findings.append(cases[i].measure(thorough))
    return findings


def rows(cases: Sequence[Case], findings: Sequence[Finding]) -> list[tuple[str, ...]]:
    """Return the rows of the table with `HEADER`: for each case the number closest to its bound."""
    return [
        (case.name, case.question, *_cells(finding.worst)[:3], "yes" if finding.holds else "NO")
        for case, finding in zip(cases, findings, strict=True)
    ]


def files(cases: Sequence[Case], findings: Sequence[Finding], command: str) -> dict[str, str | bytes]:
    """Return the files of the page, by name: `PAGE` in Markdown, and a picture in SVG for each case.

    `findings` are those of the `cases`, in their order; `command` is the command line that made them, for the page.

    Raises
    ------
    ModuleNotFoundError
        Without Matplotlib.
    """
    pairs = list(zip(cases, findings, strict=True))
    broken = sum(not finding.holds for finding in findings)
    # Marker and title; how many cases fail; a table with a line for each case.
    parts = [
        "<!-- " + "\n".join(marker_lines(command)) + " -->\n\n# Hard cases\n",
        _text(
            f"{'No bound fails' if not broken else f'{broken} of {len(cases)} cases fail'} where the numerics of "
            f"viscopade are hardest. `{command}` measures everything again and fails if a number exceeds its bound."
        ) + "\n",
        _table(
            ("question", "holds"),
            ((f"[{_escaped(case.question)}](#{case.name})", row[-1])
             for case, row in zip(cases, rows(cases, findings), strict=True)),
        ),
    ]  # fmt: skip
    # A section for each case: title, summary, picture, and a table of all its rows.
    for case, finding in pairs:
        parts += [
            f'<a id="{case.name}"></a>\n\n## {_escaped(case.title)}\n',
            _text(finding.summary) + "\n",
            f"![{_escaped(case.title)}]({case.name}.svg)\n",
            _table(("measured", "value", "bound", "holds"), (map(_escaped, _cells(row)) for row in finding.rows)),
        ]
    return {PAGE: "\n".join(parts)} | {f"{case.name}.svg": svg(case, finding) for case, finding in pairs}


def _cells(row: Row) -> tuple[str, str, str, str]:
    """Return what was measured, its value, the bound and "yes" or "NO"; dashes if there is no bound."""
    bound, holds = ("–", "–") if row.bound == math.inf else (number(row.bound), "yes" if row.holds else "NO")
    return row.what, number(row.measured), bound, holds


def _table(head: Sequence[str], lines: Iterable[Iterable[str]]) -> str:
    """Return a table in Markdown, from the cells of its head and of its lines."""
    return "".join(f"| {' | '.join(line)} |\n" for line in (head, ["---"] * len(head), *lines))


def _escaped(text: str) -> str:
    """Return a text that Markdown shows as it is."""
    return text.translate(_ESCAPES)


def _text(text: str) -> str:
    """Return a paragraph in lines of at most 120 characters, as all files of the project have."""
    return fill(_escaped(text), 120, break_on_hyphens=False, break_long_words=False)
