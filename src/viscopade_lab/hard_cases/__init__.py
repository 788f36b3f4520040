"""Hard cases: scripts that measure viscopade at its numerically hardest inputs and compare with bounds."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from textwrap import fill

from viscopade.generated import marker_lines
from viscopade.progress import quietly, track
from viscopade_lab.hard_cases import compilers, extremes, pade_systems, rounded_data, rounding, truncated_series
from viscopade_lab.hard_cases.case import Case, Finding, Row, number, svg

__all__ = ["CASES", "HEADER", "PAGE", "Case", "Finding", "Row", "files", "measured", "named", "rows"]

CASES = tuple(
    Case.of(module.__name__, module.__doc__ or "", module.measure)
    for module in (truncated_series, pade_systems, rounded_data, rounding, extremes, compilers)
)
HEADER = ("case", "question", "closest to its bound", "measured", "bound", "holds")
PAGE = "hard-cases.md"
_SPECIAL = {ord(character): "\\" + character for character in "\\|*_<>[]#~$"}  # commands of Markdown


def named(names: Iterable[str]) -> tuple[Case, ...]:
    """Return the cases of these names; all if there is no name.

    Raises
    ------
    ValueError
        If there is no case of a name.
    """
    known = {case.name: case for case in CASES}
    wanted = list(dict.fromkeys(names)) or list(known)
    for name in wanted:
        if name not in known:
            raise ValueError(f"there is no hard case {name!r}: expected one of {', '.join(known)}")
    return tuple(known[name] for name in wanted)


def measured(cases: Sequence[Case], thorough: bool) -> list[Finding]:
    """Run cases."""
    found = []
    for i in track(range(len(cases)), "hard cases"):
        with quietly():
            found.append(cases[i].measure(thorough))
    return found


def rows(cases: Sequence[Case], findings: Sequence[Finding]) -> list[tuple[str, ...]]:
    """Return the rows of the table with `HEADER`: for each case the number closest to its bound."""
    return [
        (case.name, case.question, *_cells(finding.worst)[:3], "yes" if finding.holds else "NO")
        for case, finding in zip(cases, findings, strict=True)
    ]


def files(cases: Sequence[Case], findings: Sequence[Finding], command: str) -> dict[str, str | bytes]:
    """Return the page and its pictures, by name.

    Raises
    ------
    ModuleNotFoundError
        Without Matplotlib.
    """
    pairs = list(zip(cases, findings, strict=True))
    broken = sum(not finding.holds for finding in findings)
    parts = [
        "<!-- " + "\n".join(marker_lines(command)) + " -->\n\n# Hard cases\n",
        _text(
            f"{'No bound fails' if not broken else f'{broken} of {len(cases)} cases fail'} where the numerics of "
            f"viscopade are hardest. `{command}` measures everything again and fails if a number exceeds its bound."
        ) + "\n",
        _table(
            ("question", "closest to its bound", "measured", "bound", "holds"),
            ((f"[{_escaped(case.question)}](#{case.name})", *map(_escaped, row[2:]))
             for case, row in zip(cases, rows(cases, findings), strict=True)),
        ),
    ]  # fmt: skip
    for case, finding in pairs:
        parts += [
            f'<a id="{case.name}"></a>\n\n## {_escaped(case.title)}\n',
            _text(finding.summary) + "\n",
            f"![{_escaped(case.title)}]({case.name}.svg)\n",
            _table(("measured", "value", "bound", "holds"), (map(_escaped, _cells(row)) for row in finding.rows)),
        ]
    return {PAGE: "\n".join(parts)} | {f"{case.name}.svg": svg(case, finding) for case, finding in pairs}


def _cells(row: Row) -> tuple[str, str, str, str]:
    bound, holds = ("–", "–") if row.bound == math.inf else (number(row.bound), "yes" if row.holds else "NO")
    return row.what, number(row.measured), bound, holds


def _table(head: Sequence[str], lines: Iterable[Iterable[str]]) -> str:
    return "".join(f"| {' | '.join(line)} |\n" for line in (head, ["---"] * len(head), *lines))


def _escaped(text: str) -> str:
    return text.translate(_SPECIAL)


def _text(text: str) -> str:
    return fill(_escaped(text), 120, break_on_hyphens=False, break_long_words=False)
