"""Hard cases: scripts that measure viscopade at its numerically hardest inputs, and hold it to bounds."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from textwrap import fill

from viscopade.generated import marker_line
from viscopade.progress import quietly, track
from viscopade_lab.hard_cases import compilers, extremes, pade_systems, rounded_data, rounding, truncated_series
from viscopade_lab.hard_cases.case import Case, Finding, Row, number, svg

__all__ = ["CASES", "HEADER", "PAGE", "Case", "Finding", "Row", "files", "measured", "named", "rows"]

CASES = tuple(
    Case.of(module.__name__, module.__doc__ or "", module.measure)
    for module in (truncated_series, pade_systems, rounded_data, rounding, extremes, compilers)
)
HEADER = ("case", "question", "nearest to its bound", "measured", "bound", "holds")
PAGE = "hard-cases.md"
_SPECIAL = {ord(character): "\\" + character for character in "\\|*_<>[]#~$"}  # Markdown takes them for commands


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
    """Return the one table, for `HEADER`: of each case the row that is nearest to its bound."""
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
    parts = [
        f"<!-- {marker_line(command)} -->\n\n# Hard cases\n\n" + _text(
            "Each section tests a part of viscopade at its numerically hardest inputs. A row of a table has a measured "
            "number, and the bound that it must not exceed."
        ) + f"\n`{command}` measures everything again, and fails if a bound does not hold.\n"
    ]  # fmt: skip
    for case, finding in pairs:
        parts += [
            f'<a id="{case.name}"></a>\n\n## {_escaped(case.title)}\n',
            _text(f"{case.question} {finding.summary}") + "\n",
            f"![{_escaped(case.title)}]({case.name}.svg)\n",
            "| measured | value | bound | holds |\n|---|---|---|---|\n"
            + "".join(f"| {' | '.join(map(_escaped, _cells(row)))} |\n" for row in finding.rows),
        ]
    return {PAGE: "\n".join(parts)} | {f"{case.name}.svg": svg(case, finding) for case, finding in pairs}


def _cells(row: Row) -> tuple[str, str, str, str]:
    return row.what, number(row.measured), number(row.bound), "yes" if row.holds else "NO"


def _escaped(text: str) -> str:
    return text.translate(_SPECIAL)


def _text(text: str) -> str:
    return fill(_escaped(text), 120, break_on_hyphens=False, break_long_words=False)
