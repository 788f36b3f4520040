"""Hard cases: a suite that tries to break every part of the package, measures what happens, and says it.

A module a case; each has a `CASE`, whose `run` computes everything anew. `check` runs them, `from_json` reads what was
found before.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from viscopade.progress import quietly, track
from viscopade_lab.hard_cases import (
    always,
    compilers,
    data_precision,
    extremes,
    kernel_rounding,
    near_elastic,
    overflow,
    pade_systems,
    printed_digits,
    processors,
    round_trips,
    rounding_modes,
    truncated_series,
)
from viscopade_lab.hard_cases.finding import Case, Chart, ChartCurve, Check, Finding, Outcome, ResultTable, from_json

__all__ = [
    "CASES",
    "Case",
    "Chart",
    "ChartCurve",
    "Check",
    "Finding",
    "Outcome",
    "ResultTable",
    "check",
    "command",
    "from_json",
    "merged",
    "named",
]

CASES: tuple[Case, ...] = (
    truncated_series.CASE,
    pade_systems.CASE,
    data_precision.CASE,
    printed_digits.CASE,
    kernel_rounding.CASE,
    overflow.CASE,
    near_elastic.CASE,
    extremes.CASE,
    round_trips.CASE,
    always.CASE,
    compilers.CASE,
    processors.CASE,
    rounding_modes.CASE,
)


def check(names: Iterable[str] | None = None, *, thorough: bool = False) -> tuple[Finding, ...]:
    """Run the cases of these names; None means all.

    Parameters
    ----------
    names : iterable of str, optional
        Of `CASES`.
    thorough : bool
        More points, higher orders, more inputs: minutes instead of seconds.

    Raises
    ------
    ValueError
        If there is no case of a name.
    """
    cases = named(names)
    return tuple(_found(cases[i], thorough) for i in track(range(len(cases)), "hard cases"))


def named(names: Iterable[str] | None = None) -> tuple[Case, ...]:
    """Return the cases of these names, as `check` takes them."""
    by_name = {case.name: case for case in CASES}
    wanted = list(by_name) if names is None else list(dict.fromkeys(names))
    for name in wanted:
        if name not in by_name:
            raise ValueError(f"there is no hard case {name!r}: accepted are {', '.join(by_name)}")
    return tuple(by_name[name] for name in wanted)


def merged(known: Iterable[Finding], fresh: Iterable[Finding]) -> tuple[Finding, ...]:
    """Return findings with those of the same cases that were found afresh in their place, in the order of `CASES`."""
    by_name = {finding.name: finding for finding in (*known, *fresh)}
    order = [case.name for case in CASES if case.name in by_name]
    return tuple(by_name[name] for name in dict.fromkeys([*order, *by_name]))


def command(findings: Sequence[Finding]) -> str:
    """Return the command that finds these again."""
    names = [finding.name for finding in findings]
    only = [] if names == [case.name for case in CASES] else [f"--only {name}" for name in names]
    thorough = ["--thorough"] if any(finding.thorough for finding in findings) else []
    return " ".join(["viscopade hardcases", *only, *thorough])


def _found(case: Case, thorough: bool) -> Finding:
    """Run a case; the progress of its parts would be shown within that of the whole."""
    with quietly():
        return Finding(case.name, case.title, case.question, thorough, _result(case, thorough))


def _result(case: Case, thorough: bool) -> Outcome:
    """Run a case; what it cannot bear is a failure, and the other cases are still run."""
    try:
        return case.run(thorough)
    except Exception as error:
        summary = f"The case stopped in {type(error).__name__}: {' '.join(str(error).split())}"
        return Outcome(summary, (), (), (Check("The case runs to its end: exceptions", 1, "==", 0),))
