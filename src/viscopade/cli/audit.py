"""Command that prints the eps that programs and formulas deliver: audit."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import click

from viscopade.cli.console import STYLE, Real, say, show

if TYPE_CHECKING:
    from viscopade.audit.program import Audit, Program

_FIGURES = 6  # of a number in a table
_MEASURED = ("epsilon", "time_step", "phase", "predicted", "version")


@click.command()
@click.option("--program", metavar="NAME", help="One program only; a wrong name prints the list.")
@click.option("--epsilon", help="The wanted eps, > 0 and <= 1.  [default: 0.9, 0.75, 0.5, 0.3, 0.1]")
@click.option("--time-step", type=Real("time-step"), help="Time step, in units of the undamped contact time.")
@click.option("--contact-time", type=Real("contact-time"), help="That time, if the time step is in seconds.")
@STYLE
def audit(
    program: str | None, epsilon: str | None, time_step: float | None, contact_time: float | None, style: str
) -> None:
    """Print the eps that programs deliver if they are asked for one, why, and what to write instead.

    Numbers without a time step are those of the equation of motion, and every digit is proven. With a time step, the
    program's own sequence of steps is computed for 64 places where in a step contact may begin: the eps is a range.
    """
    from viscopade import arguments
    from viscopade.audit.program import ASKED
    from viscopade.audit.programs import PROGRAMS, program_of

    step = _in_contact_times(time_step, contact_time)
    chosen = PROGRAMS if program is None else (program_of(program),)
    if epsilon is not None:
        arguments.exact_number("epsilon", epsilon, "a number > 0 and <= 1", lambda number: 0 < number <= 1)
    wanted = ASKED if epsilon is None else (epsilon.strip(),)
    found = list(_rows(chosen, wanted, step))
    whole = {"rows": [_json(row) for row in found]}
    if epsilon is None:
        _show_table(style, wanted, found, whole)
    else:
        header = ("program", "formula", "end", "written", "delivered", "at the time step", "instead", "why")
        show(style, header, map(_row, found), whole, title=f"eps = {epsilon} is asked for")
    if style == "text":
        say("instead: the number to write, so that the eps asked for is delivered" if epsilon else "delivered eps")


def _in_contact_times(time_step: float | None, contact_time: float | None) -> float | None:
    """Return the time step in units of the undamped contact time."""
    if time_step is None:
        if contact_time is not None:
            raise click.UsageError("--contact-time is given: accepted with it is --time-step")
        return None
    step = time_step / (1 if contact_time is None else contact_time) if contact_time != 0 else 0
    if not 1e-5 <= step <= 1:
        raise ValueError(f"time-step is {step:.4g} contact times: accepted is 1e-5 to 1")
    return step


def _rows(programs: Sequence[Program], wanted: Sequence[str], step: float | None) -> Iterator[Audit]:
    """Yield the audits; formulas that do not accept an eps are left out.

    Raises
    ------
    ValueError
        If none accepts it, or none can deliver it.
    """
    from viscopade.audit.program import audited

    refused, useful = [], False
    for program in programs:
        for formula in program.formulas:
            for asked in wanted:
                try:
                    row = audited(program, formula, asked, step)
                except ValueError as error:
                    refused.append(error)
                    continue
                useful = True
                yield row
    if not useful:
        raise refused[0]


def _row(row: Audit) -> tuple[str, ...]:
    at_step = ""
    if row.stepped is not None:
        at_step = (
            f"{row.stepped.mean:.{_FIGURES}g} ({row.stepped.least:.{_FIGURES}g} to {row.stepped.largest:.{_FIGURES}g})"
        )
    instead = "" if row.instead is None else f"{row.formula.parameter} = {row.instead:.10g}"
    written = f"{row.formula.parameter} = {row.written:.{_FIGURES}g}"
    names = row.program.title, row.formula.name, row.formula.law.end
    return (*names, written, _number(row.delivered), at_step, instead, " ".join(row.reasons))


def _number(delivered: Any) -> str:
    return "never parts" if delivered is None else f"{float(delivered):.{_FIGURES}g}"


def _show_table(style: str, wanted: Sequence[str], found: Sequence[Audit], whole: dict[str, Any]) -> None:
    """Print one row a formula and one column an eps asked for."""
    cells: dict[tuple[str, str], dict[str, str]] = {}
    for row in found:
        value = _number(row.delivered) if row.stepped is None else f"{row.stepped.mean:.{_FIGURES}g}"
        cells.setdefault((row.program.title, row.formula.name), {})[row.asked] = value
    header = ("program", "formula", *(f"eps = {asked}" for asked in wanted))
    rows = [(*names, *(values.get(asked, "refused") for asked in wanted)) for names, values in cells.items()]
    show(style, header, rows, whole, title="eps delivered, for the eps asked for")


def _json(row: Audit) -> dict[str, Any]:
    from mpmath import mp

    from viscopade.audit.measured import finest
    from viscopade.audit.program import DIGITS

    formula, stepped = row.formula, row.stepped
    found = finest(row.program.name, formula.name, row.asked)
    return {
        "program": row.program.name,
        "formula": formula.name,
        "asked": row.asked,
        "written": {formula.parameter: row.written},
        "delivered": None if row.delivered is None else mp.nstr(row.delivered, DIGITS),
        "end": formula.law.end,
        "law": str(formula.law),
        "time_step": row.time_step,
        "at_time_step": stepped and {"mean": stepped.mean, "least": stepped.least, "largest": stepped.largest},
        "why": list(row.reasons),
        "instead": None if row.instead is None else {formula.parameter: row.instead},
        "measured": None if found is None else {name: getattr(found, name) for name in _MEASURED},
        "source": f"{formula.source}, {row.program.version}",
    }


COMMANDS = (audit,)
