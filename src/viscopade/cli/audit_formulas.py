"""The part of `viscopade audit` that prints what the formulas of programs give for an eps."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import click

from viscopade import arguments
from viscopade.cli.console import Quantity, say, show
from viscopade.simulators import simulator_of, simulators

if TYPE_CHECKING:
    from viscopade.simulators.audit import Audit
    from viscopade.simulators.simulator import Simulator

_LEAST_STEP, _LEAST_ERROR = 1e-3, 1e-8
_FIGURES = 6  # of a number in a table
_SHOWN = 3  # formulas of a program


def show_formulas(
    simulator: str | None,
    epsilon: str | None,
    time_step: str | None,
    contact_time: float | None,
    step_error: float | None,
    whole: bool,
    style: str,
) -> None:
    """Print the eps that the formulas of one simulator, or of all, give."""
    from viscopade.collision.weight import rule
    from viscopade.simulators.audit import ASKED

    unit = 1.0 if contact_time is None else contact_time
    step = _in_contact_times(time_step, unit, contact_time is not None)
    chosen = simulators() if simulator is None else (simulator_of(simulator),)
    if epsilon is not None:
        arguments.exact_number("--epsilon", epsilon, "a number from 0.001 to 1", lambda e: Fraction(1, 1000) <= e <= 1)
    if step_error is not None and not _LEAST_ERROR <= step_error <= 1:
        raise ValueError(f"--step-error is {step_error:.4g}: expected {_LEAST_ERROR:g} to 1")
    wanted = ASKED if epsilon is None else (epsilon.strip(),)
    found, refused = _audits(chosen, wanted, step, step_error)
    rows_of_json = [_json(row, epsilon is not None) for row in found] if style == "json" else []
    data = {"rows": rows_of_json, "refused": refused}
    left_out = 0
    if epsilon is None:
        _show_table(style, wanted, found, data)
    else:
        # As text, of each program the formulas whose eps differ most from the wanted one.
        shown = found if whole or style != "text" else _most_different(found)
        left_out = len(found) - len(shown)
        columns = [_columns(row, unit, contact_time is not None) for row in shown]
        used = [name for name in columns[0] if any(each[name] for each in columns)]
        rows = [[each[name] for name in used] for each in columns]
        show(style, used, rows, data, title=f"eps = {epsilon} is asked for")
    if style == "text":
        if left_out:
            say(f"--all prints {left_out} more, whose eps is closer to {epsilon}")
        for line in refused:
            say(line)
        laws = [row.formula.law for row in found if not row.formula.is_impulse]
        if laws:  # weight does nothing to an impulse
            say(f"{rule(laws)}.")
    if style == "text" and time_step is not None:
        for line in _integrators(found):
            say(line)
        say(f"time step: {step:.6g} undamped contact times; eps on average, and its range over where contact begins")


def _most_different(found: Sequence[Audit]) -> list[Audit]:
    """Return of each program the formulas whose eps differ most from the one asked for, in their order."""

    def difference(row: Audit) -> float:
        delivered = row.delivered if row.stepped is None else row.stepped.epsilon
        return abs(float(delivered or 0) - float(row.asked))

    kept: list[Audit] = []
    for program in dict.fromkeys(row.program.name for row in found):
        own = [row for row in found if row.program.name == program]
        worst = sorted(own, key=difference, reverse=True)[:_SHOWN]
        kept += [row for row in own if row in worst]
    return kept


def _in_contact_times(time_step: str | None, contact_time: float, is_time: bool) -> float | None:
    """Return the time step in units of the undamped contact time; it may be a time, such as "2 ms"."""
    if time_step is None:
        if is_time:
            raise click.UsageError("--contact-time is given: expected --time-step with it")
        return None
    if is_time:
        step = float(Quantity("time").decimal(time_step, "--time-step")) / contact_time
    else:
        expected = "a number of contact times, or a time with --contact-time"
        step = float(arguments.exact_number("--time-step", time_step, expected, lambda x: abs(x) < 10**300))
    if step > 1:
        from viscopade.simulators.setup import SI

        longer = f', or for 20 steps --contact-time "{SI.time_text(20 * step * contact_time)}"' if is_time else ""
        raise ValueError(f"--time-step is {step:.4g} contact times: expected at most 1{longer}")
    if step < _LEAST_STEP:
        finer = "because finer steps give the eps that is printed without --time-step"
        raise ValueError(f"--time-step is {step:.4g} contact times: expected at least {_LEAST_STEP:g}, {finer}")
    return step


def _audits(
    programs: Sequence[Simulator], wanted: Sequence[str], step: float | None, step_error: float | None
) -> tuple[list[Audit], list[str]]:
    """Return the audits, and the reasons why formulas refuse an eps.

    Raises
    ------
    ValueError
        If all refuse all.
    """
    from viscopade.simulators.audit import audit_formula

    found, refused = [], []
    for program in programs:
        for formula in program.formulas:
            for asked in wanted:
                try:
                    found.append(audit_formula(program, formula, asked, step, step_error))
                except ValueError as error:
                    refused.append(f"{program.title}: {error}")
    if not found:
        raise ValueError(refused[0])
    return found, refused


def _columns(row: Audit, contact_time: float, is_time: bool) -> dict[str, str]:
    """Return the cells of a row, with the heads of their columns as keys."""
    from viscopade.simulators.native import SPREAD

    stepped, advice, parameter, reasons = row.stepped, row.advice, row.formula.parameter, [*row.reasons]
    steps = row.resolving_steps
    if steps is not None and row.time_step is not None:
        seconds = f" ({steps * row.time_step * contact_time:.3g} s)" if is_time else ""
        reasons.append(
            f"eps differs by more than {SPREAD:g} over where in a step contact begins, unless an undamped contact "
            f"lasts {steps} time steps{seconds}."
        )
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
        "why": " ".join(reasons),
    }


def _integrators(found: Sequence[Audit]) -> Iterator[str]:
    """Yield a line for each integrator: its name, and the simulators that use it."""
    users: dict[str, dict[str, None]] = {}
    for row in found:
        if row.formula.scheme is not None:
            users.setdefault(row.formula.scheme.name, {})[row.program.title] = None
    for name, titles in users.items():
        yield f"integrator: {name} ({', '.join(titles)})"


def _number(delivered: Any) -> str:
    return "never parts" if delivered is None else f"{float(delivered):.{_FIGURES}g}"


def _show_table(style: str, wanted: Sequence[str], found: Sequence[Audit], whole: dict[str, Any]) -> None:
    """Print one row for each formula and one column for each wanted eps."""
    cells: dict[tuple[str, str], dict[str, str]] = {}
    for row in found:
        value = _number(row.delivered) if row.stepped is None else f"{row.stepped.epsilon:.{_FIGURES}g}"
        cells.setdefault((row.program.title, row.formula.name), {})[row.asked] = value
    header = ("program", "formula", *(f"eps = {asked}" for asked in wanted))
    rows = [(*names, *(values.get(asked, "refused") for asked in wanted)) for names, values in cells.items()]
    show(style, header, rows, whole, title="eps that programs give, for the eps asked for")


def _json(row: Audit, resolved: bool) -> dict[str, Any]:
    from mpmath import mp

    from viscopade.simulators.formula import DIGITS

    formula, stepped = row.formula, row.stepped
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
        **({"resolving_steps": row.resolving_steps} if resolved else {}),
        "advice": row.advice and asdict(row.advice),
        "why": list(row.reasons),
        "instead": None if row.instead is None else {formula.parameter: row.instead},
        "source": f"{formula.source}, {row.program.version}",
    }
