"""The report on hard cases: a page in Markdown, its figures, and the numbers for programs, from the findings alone."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from textwrap import fill

from viscopade.generated import environment, marker_line
from viscopade_lab.hard_cases import Finding, command
from viscopade_lab.hard_cases.finding import Cell
from viscopade_lab.hard_cases.picture import svg

PAGE, NUMBERS = "hard-cases.md", "hard-cases.json"
CHECKS = ("statement", "measured", "limit", "holds")
LONG = ("case", "statement", "measured", "relation", "limit", "holds")
WIDTH = 120  # columns of text
DIGITS = 3  # of measured numbers in text; JSON has all of them
WARNING = "Not all checks hold, so these words may not, either:"
COUNTS = 1e15  # whole numbers below this are shown in full

# A list of numbers only, over several lines, which no text within has; it fits on one.
_LIST = re.compile(r'\[\n\s*([^\[\]"{}]+?)\n\s*\]')

# A code span, and what stands for a space within it while lines are broken.
_CODE, _KEPT = re.compile("`[^`]*`"), "\0"

# What Markdown would take for a command.
_SPECIAL = {ord(character): "\\" + character for character in "\\|*_<>[]#~$"}


def names(cases: Iterable[str]) -> list[str]:
    """Return the names of the files that `files` returns for cases of these names."""
    return [PAGE, NUMBERS, *(f"{name}.svg" for name in dict.fromkeys(cases))]


def files(findings: Sequence[Finding]) -> dict[str, str | bytes]:
    """Return file name and content of the whole report.

    Raises
    ------
    ModuleNotFoundError
        Without Matplotlib.
    """
    pictures = {f"{finding.name}.svg": svg(finding) for finding in findings if finding.result.charts}
    return {PAGE: markdown(findings), NUMBERS: numbers(findings), **pictures}


def numbers(findings: Sequence[Finding]) -> str:
    """Return the findings as one JSON object."""
    whole = {
        "generated_by": marker_line(command(findings)),
        "passes": all(finding.result.passes for finding in findings),
        "cases": [finding.to_json() for finding in findings],
    }
    text = json.dumps(whole, ensure_ascii=False, indent=1, allow_nan=False) + "\n"
    return _LIST.sub(lambda match: f"[{' '.join(match[1].split())}]", text)


def markdown(findings: Sequence[Finding]) -> str:
    """Return the page."""
    jinja = environment(__name__)
    jinja.filters |= {"wrapped": _prose, "cell": _cell}
    made_by = command(findings)
    return jinja.get_template("page.md.jinja").render(
        marker=marker_line(made_by),
        command=made_by,
        findings=findings,
        verdict=verdict,
        checks=checks,
        header=CHECKS,
        paragraph=paragraph,
    )


def verdict(finding: Finding) -> str:
    """Return in words how many checks of a case hold."""
    outcomes = [check.holds for check in finding.result.checks]
    failed = outcomes.count(False)
    return f"fails: {failed} of {len(outcomes)} checks do not hold" if failed else f"all {len(outcomes)} checks hold"


def introduction(finding: Finding, width: int | None = None) -> str:
    """Return the words before a case's tables, for a terminal of this width."""
    words = [f"{finding.name}: {finding.title}", *_words(finding)]
    columns = min(width or WIDTH, WIDTH)
    return "\n\n".join(fill(text, columns, break_on_hyphens=False, break_long_words=False) for text in words)


def paragraph(finding: Finding) -> str:
    """Return the question of a case and its answer, as one paragraph of the page."""
    return " ".join(_words(finding))


def _words(finding: Finding) -> list[str]:
    warning = [] if finding.result.passes else [WARNING]
    return [finding.question, *warning, finding.result.summary]


def checks(finding: Finding) -> Iterator[tuple[str, str, str, str]]:
    """Yield the rows of the table of what must hold, for `CHECKS`."""
    for check in finding.result.checks:
        holds = "yes" if check.holds else "NO"
        yield check.statement, number(check.measured), f"{check.relation} {number(check.limit)}", holds


def long(findings: Iterable[Finding], shown: Callable[[float], str]) -> Iterator[tuple[str, ...]]:
    """Yield the rows of what must hold in all cases, for `LONG`, with numbers as a function shows them."""
    for finding in findings:
        for check in finding.result.checks:
            numbers = shown(check.measured), check.relation, shown(check.limit)
            yield finding.name, check.statement, *numbers, "yes" if check.holds else "NO"


def number(value: float) -> str:
    """Return a measured number as people read it."""
    if abs(value) < COUNTS and value == int(value):
        return f"{int(value):,}"
    return f"{value:.{DIGITS}g}"


def _prose(text: str) -> str:
    """Return a text in lines that break at no space within a code span."""
    whole = _CODE.sub(lambda span: span[0].replace(" ", _KEPT), _cell(text))
    return fill(whole, WIDTH, break_on_hyphens=False, break_long_words=False).replace(_KEPT, " ")


def _cell(value: Cell) -> str:
    return str(value).translate(_SPECIAL)
