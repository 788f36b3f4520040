"""Command that prints the eps that programs and formulas deliver: audit."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import click

from viscopade import arguments
from viscopade.cli.console import STYLE, Quantity, Real, double, say, show
from viscopade.simulators import simulator_of, simulators

if TYPE_CHECKING:
    from viscopade.simulators.audit import Audit
    from viscopade.simulators.simulator import Simulator

_LEAST_STEP, _LEAST_ERROR = 1e-3, 1e-8
_FIGURES = 6  # of a number in a table
_MEASURED = ("epsilon", "time_step", "phase", "predicted", "version")


@click.command()
@click.option("--program", metavar="NAME", help="One program only; a wrong name prints the list.")
@click.option("--epsilon", help="The wanted eps, > 0 and <= 1.  [default: 0.9, 0.75, 0.5, 0.3, 0.1]")
@click.option("--time-step", help="Time step, in units of the undamped contact time.")
@click.option("--contact-time", type=Quantity("contact-time", "time"), help="That time, if the time step is one, too.")
@click.option("--step-error", type=Real("step-error"), help="Print the largest time step with this relative error.")
@STYLE
def audit(
    program: str | None,
    epsilon: str | None,
    time_step: str | None,
    contact_time: str | None,
    step_error: float | None,
    style: str,
) -> None:
    """Print the eps that programs deliver if they are asked for one, why, and what to write instead.

    Numbers without a time step are those of the equation of motion, and every digit is proven. With a time step, the
    program's own sequence of steps is computed for 64 places where in a step contact may begin: the eps is a range.
    The number to write instead then makes its mean the eps asked for.

    The contact time is that without damping, as `viscopade epsilon` prints it for a material with A = 0.
    """
    from viscopade.simulators.audit import ASKED

    unit = 1.0 if contact_time is None else double("contact-time", contact_time)
    step = _in_contact_times(time_step, unit, contact_time is not None)
    chosen = simulators() if program is None else (simulator_of(program),)
    if epsilon is not None:
        arguments.exact_number("epsilon", epsilon, "a number from 0.001 to 1", lambda e: Fraction(1, 1000) <= e <= 1)
    if step_error is not None and not _LEAST_ERROR <= step_error <= 1:
        raise ValueError(f"step-error is {step_error:.4g}: accepted is {_LEAST_ERROR:g} to 1")
    wanted = ASKED if epsilon is None else (epsilon.strip(),)
    found, refused = _audits(chosen, wanted, step, step_error)
    whole = {"rows": [_json(row) for row in found], "refused": refused}
    if epsilon is None:
        _show_table(style, wanted, found, whole)
    else:
        columns = [_columns(row, unit) for row in found]
        used = [name for name in columns[0] if any(each[name] for each in columns)]
        rows = [[each[name] for name in used] for each in columns]
        show(style, used, rows, whole, title=f"eps = {epsilon} is asked for")
    if style == "text":
        for line in refused:
            say(line)
    if style == "text" and time_step is not None:
        for line in _integrators(found):
            say(line)
        say(f"time step: {step:.6g} undamped contact times; eps on average, and its range over where contact begins")


def _in_contact_times(time_step: str | None, contact_time: float, is_time: bool) -> float | None:
    """Return the time step in units of the undamped contact time; it may be a time, such as "2 ms"."""
    if time_step is None:
        if is_time:
            raise click.UsageError("--contact-time is given: accepted with it is --time-step")
        return None
    if is_time:
        time_step = Quantity("time-step", "time").convert(time_step, None, None)
    accepted = "a number of contact times, or a time with --contact-time"
    step = float(arguments.exact_number("time-step", time_step, accepted, lambda x: abs(x) < 10**300))
    step = step / contact_time if contact_time else 0
    if not _LEAST_STEP <= step <= 1:
        raise ValueError(f"time-step is {step:.4g} contact times: accepted is {_LEAST_STEP:g} to 1")
    return step


def _audits(
    programs: Sequence[Simulator], wanted: Sequence[str], step: float | None, step_error: float | None
) -> tuple[list[Audit], list[str]]:
    """Return the audits, and why formulas do not accept an eps.

    Raises
    ------
    ValueError
        If none accepts one.
    """
    from viscopade.simulators.audit import audited

    found, refused = [], []
    for program in programs:
        for formula in program.formulas:
            for asked in wanted:
                try:
                    found.append(audited(program, formula, asked, step, step_error))
                except ValueError as error:
                    refused.append(f"{program.title}: {error}")
    if not found:
        raise ValueError(refused[0])
    return found, refused


def _columns(row: Audit, contact_time: float) -> dict[str, str]:
    """Return the cells of a row by the heads of their columns."""
    stepped, advice, parameter = row.stepped, row.advice, row.formula.parameter
    return {
        "program": row.program.title,
        "formula": row.formula.name,
        "end": row.formula.law.end,
        "written": f"{parameter} = {row.written:.{_FIGURES}g}",
        "delivered": _number(row.delivered),
        "with the time step": "" if stepped is None else f"{stepped.epsilon:.{_FIGURES}g}",
        "from": "" if stepped is None else f"{stepped.least:.{_FIGURES}g}",
        "to": "" if stepped is None else f"{stepped.largest:.{_FIGURES}g}",
        "write instead": "" if row.instead is None else f"{row.instead:.{10 if stepped is None else _FIGURES}g}",
        "largest time step": "" if advice is None else f"{advice.largest_step * contact_time:.4g}",
        "d eps/d step": "" if advice is None else f"{advice.slope / contact_time:.3g}",
        "why": " ".join(row.reasons),
    }


def _integrators(found: Sequence[Audit]) -> Iterator[str]:
    """Yield a line for each integrator: its name, and the simulators that are taken to use it."""
    users: dict[str, dict[str, None]] = {}
    for row in found:
        if row.formula.scheme is not None:
            users.setdefault(row.formula.scheme.name, {})[row.program.title] = None
    for name, titles in users.items():
        yield f"integrator: {name} ({', '.join(titles)})"


def _number(delivered: Any) -> str:
    return "never parts" if delivered is None else f"{float(delivered):.{_FIGURES}g}"


def _show_table(style: str, wanted: Sequence[str], found: Sequence[Audit], whole: dict[str, Any]) -> None:
    """Print one row a formula and one column an eps asked for."""
    cells: dict[tuple[str, str], dict[str, str]] = {}
    for row in found:
        value = _number(row.delivered) if row.stepped is None else f"{row.stepped.epsilon:.{_FIGURES}g}"
        cells.setdefault((row.program.title, row.formula.name), {})[row.asked] = value
    header = ("program", "formula", *(f"eps = {asked}" for asked in wanted))
    rows = [(*names, *(values.get(asked, "refused") for asked in wanted)) for names, values in cells.items()]
    show(style, header, rows, whole, title="eps delivered, for the eps asked for")


def _json(row: Audit) -> dict[str, Any]:
    from mpmath import mp

    from viscopade.simulators.formula import DIGITS
    from viscopade.simulators.measured import finest

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
        "integrator": formula.scheme and formula.scheme.name,
        "at_time_step": stepped and {"mean": stepped.epsilon, "least": stepped.least, "largest": stepped.largest},
        "advice": row.advice and asdict(row.advice),
        "why": list(row.reasons),
        "instead": None if row.instead is None else {formula.parameter: row.instead},
        "measured": None if found is None else {name: getattr(found, name) for name in _MEASURED},
        "source": f"{formula.source}, {row.program.version}",
    }


COMMANDS = (audit,)
