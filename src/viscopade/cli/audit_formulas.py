"""The part of `viscopade audit` that prints what the formulas of programs give for an eps.

    viscopade audit mujoco --epsilon 0.5
    viscopade audit --epsilon 0.9 --time-step 0.05

Times are in units of the undamped contact time, unless --contact-time says it. Numbers in sentences have 3 to 6 figures
(`.4g`), chosen by hand to be read; JSON has all digits.
"""

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

# At this step, in undamped contact times, eps is within 4e-4 of that of the continuum (measured for eps = 0.9, 0.5 and
# 0.1 and all formulas except for Drake's lagged ones, 0.004).
_LEAST_STEP = 1e-3
# Relative error of eps for --step-error. Chosen by hand: it asks for about 1e8 steps in a contact, more than any user
# has. The largest step is in proportion to so small an error, so smaller ones would teach nothing.
_LEAST_ERROR = 1e-8
_FIGURES = 6  # of a number in a table; chosen by hand, and JSON has all
_SHOWN = 3  # formulas of a program; chosen by hand, and --all prints the others


def show_formulas(
    simulator: str | None,
    epsilon: str | None,
    time_step: str | None,
    contact_time: float | None,
    step_error: float | None,
    with_all: bool,
    style: str,
) -> None:
    """Print the eps that the formulas of one simulator, or of all, give.

    Parameters
    ----------
    simulator : str or None
        Name of a program; None for all.
    epsilon : str or None
        The wanted eps, >= 0.001 and < 1; None for a table of five.
    time_step : str or None
        In units of the undamped contact time, or a time if `contact_time` is there; None for the continuum.
    contact_time : float or None
        Undamped contact time in s.
    step_error : float or None
        Relative error of eps, for which the largest time step is printed.
    with_all : bool
        Print all formulas of a program, not those three only whose eps differ most.
    style : str
        Format of the output: text, csv or json.
    """
    from viscopade.collision.weight import rule
    from viscopade.simulators.audit import ASKED

    # `unit`: the time in which the output has steps: seconds with a contact time, else contact times.
    unit = 1.0 if contact_time is None else contact_time
    step = _in_contact_times(time_step, unit, contact_time is not None)
    chosen = simulators() if simulator is None else (simulator_of(simulator),)
    # From 0.001 on all programs take 4 s. For 1e-4 they took 105 s (measured), and more contacts last too long to be
    # computed.
    if epsilon is not None:
        arguments.exact_number("--epsilon", epsilon, "a number >= 0.001 and < 1", lambda e: Fraction(1, 1000) <= e < 1)
    if step_error is not None and not _LEAST_ERROR <= step_error <= 1:
        raise ValueError(f"--step-error is {step_error:.4g}: expected {_LEAST_ERROR:g} to 1")
    # `audits`: what each formula gives for each eps, and `refused`: sentences on those that have no number for it.
    targets = ASKED if epsilon is None else (epsilon.strip(),)
    audits, refused = _audits(chosen, targets, step, step_error)
    rows_of_json = [_json(row, epsilon is not None) for row in audits] if style == "json" else []
    data = {"rows": rows_of_json, "refused": refused}
    left_out = 0
    if epsilon is None:
        _show_table(style, targets, audits, data)
    else:
        # As text, of each program the formulas whose eps differ most from the wanted one; without empty columns.
        shown = audits if with_all or style != "text" else _most_different(audits)
        left_out = len(audits) - len(shown)
        table = [_columns(row, unit, contact_time is not None) for row in shown]
        used = [name for name in table[0] if any(cells[name] for cells in table)]
        rows = [[cells[name] for name in used] for cells in table]
        show(style, used, rows, data, title=f"eps = {epsilon} is asked for")
    if style == "text":
        if left_out:
            say(f"--all prints {left_out} more, whose eps is closer to {epsilon}")
        for line in refused:
            say(line)
        laws = [row.formula.law for row in audits if not row.formula.is_impulse]
        if laws:  # weight does nothing to an impulse; `rule` says from when on it matters
            say(f"{rule(laws)}.")
    if style == "text" and time_step is not None:
        for line in _integrators(audits):
            say(line)
        say(f"time step: {step:.6g} undamped contact times; eps on average, and its range over where contact begins")


def _most_different(audits: Sequence[Audit]) -> list[Audit]:
    """Return of each program the `_SHOWN` audits whose eps differ most from the one asked for, in their order."""

    def difference(row: Audit) -> float:
        # Bodies that never part (None) have eps = 0.
        delivered = row.delivered if row.stepped is None else row.stepped.epsilon
        return abs(float(delivered or 0) - float(row.asked))

    kept: list[Audit] = []
    for program in dict.fromkeys(row.program.name for row in audits):
        rows_of_program = [row for row in audits if row.program.name == program]
        worst = sorted(rows_of_program, key=difference, reverse=True)[:_SHOWN]
        kept += [row for row in rows_of_program if row in worst]
    return kept


def _in_contact_times(time_step: str | None, contact_time: float, is_time: bool) -> float | None:
    """Return the time step in units of the undamped contact time; None if there is none.

    `is_time`: the text `time_step` is a time, such as "2 ms", because `contact_time`, in s, was given; else it is a
    number of contact times.
    """
    if time_step is None:
        if is_time:
            raise click.UsageError("--contact-time is given: expected --time-step with it")
        return None
    if is_time:
        step = float(Quantity("time").decimal(time_step, "--time-step")) / contact_time
    else:
        expected = "a number of contact times, or a time with --contact-time"
        # Below 1e300 a number is a finite double; the messages below refuse large and negative ones.
        step = float(arguments.exact_number("--time-step", time_step, expected, lambda x: abs(x) < 10**300))
    # A step longer than the contact resolves nothing. The refusal suggests 20 steps in a contact (a choice).
    if step > 1:
        from viscopade.simulators.setup import SI

        longer = f', or for 20 steps --contact-time "{SI.time_text(20 * step * contact_time)}"' if is_time else ""
        raise ValueError(f"--time-step is {step:.4g} contact times: expected at most 1{longer}")
    if step < _LEAST_STEP:
        finer = "because finer steps give the eps that is printed without --time-step"
        raise ValueError(f"--time-step is {step:.4g} contact times: expected at least {_LEAST_STEP:g}, {finer}")
    return step


def _audits(
    programs: Sequence[Simulator], targets: Sequence[str], step: float | None, step_error: float | None
) -> tuple[list[Audit], list[str]]:
    """Return the audits of all formulas of the programs, and the reasons why formulas refuse an eps.

    `targets` are the wanted eps, decimals; `step` is in undamped contact times, and `step_error` the relative error of
    eps for which an audit has the largest step.

    Raises
    ------
    ValueError
        If all refuse all.
    """
    from viscopade.simulators.audit import audit_formula

    audits, refused = [], []
    for program in programs:
        for formula in program.formulas:
            for asked in targets:
                # A program that refuses a number, such as a damping ratio above 1, has no eps for it.
                try:
                    audits.append(audit_formula(program, formula, asked, step, step_error))
                except ValueError as error:
                    refused.append(f"{program.title}: {error}")
    if not audits:
        raise ValueError(refused[0])
    return audits, refused


def _columns(row: Audit, contact_time: float, is_time: bool) -> dict[str, str]:
    """Return the cells of a row, with the heads of their columns as keys; an empty cell is "".

    The audit has times in undamped contact times; `contact_time` is that time in s if `is_time`, else 1.
    """
    from viscopade.simulators.native import SPREAD

    stepped, advice, parameter, reasons = row.stepped, row.advice, row.formula.parameter, [*row.reasons]
    # How many steps a contact needs so that eps hardly depends on where in a step it begins; None if it has them.
    steps = row.resolving_steps
    if steps is not None and row.time_step is not None:
        seconds = f" ({steps * row.time_step * contact_time:.3g} s)" if is_time else ""
        reasons.append(
            f"eps differs by more than {SPREAD:g} over where in a step contact begins, unless an undamped contact "
            f"lasts {steps} time steps{seconds}."
        )
    # The number to write instead has 10 figures where it is exact, enough to copy it, and 6 where it is sampled: it
    # then gives eps on average.
    instead_figures = 10 if stepped is None else _FIGURES
    return {
        "program": row.program.title,
        "formula": row.formula.name,
        "end": row.formula.law.end,
        "written": f"{parameter} = {row.written:.{_FIGURES}g}",
        "delivered": _number(row.delivered),
        "with the time step": "" if stepped is None else f"{stepped.epsilon:.{_FIGURES}g}",
        "from": "" if stepped is None else f"{stepped.least:.{_FIGURES}g}",
        "to": "" if stepped is None else f"{stepped.largest:.{_FIGURES}g}",
        "write instead": "" if row.instead is None else f"{row.instead:.{instead_figures}g}",
        "largest time step": "" if advice is None else f"{advice.largest_step * contact_time:.4g}",
        "d eps/d step": "" if advice is None else f"{advice.slope / contact_time:.3g}",
        "why": " ".join(reasons),
    }


def _integrators(audits: Sequence[Audit]) -> Iterator[str]:
    """Yield a line for each integrator: its name, and the simulators that use it."""
    # From an integrator's name to titles of simulators, each once and in their order: the keys of a dict.
    users: dict[str, dict[str, None]] = {}
    for row in audits:
        if row.formula.scheme is not None:
            users.setdefault(row.formula.scheme.name, {})[row.program.title] = None
    for name, titles in users.items():
        yield f"integrator: {name} ({', '.join(titles)})"


def _number(delivered: Any) -> str:
    """Return eps as a cell; None means that the bodies never part."""
    return "never parts" if delivered is None else f"{float(delivered):.{_FIGURES}g}"


def _show_table(style: str, targets: Sequence[str], audits: Sequence[Audit], json_object: dict[str, Any]) -> None:
    """Print one row for each formula and one column for each wanted eps.

    `style` is the format of the output, `targets` has the wanted eps, and `json_object` is what JSON prints.
    """
    # From program and formula to the eps that it gives, by the eps that is wanted.
    cells: dict[tuple[str, str], dict[str, str]] = {}
    for row in audits:
        value = _number(row.delivered) if row.stepped is None else f"{row.stepped.epsilon:.{_FIGURES}g}"
        cells.setdefault((row.program.title, row.formula.name), {})[row.asked] = value
    header = ("program", "formula", *(f"eps = {asked}" for asked in targets))
    rows = [(*names, *(values.get(asked, "refused") for asked in targets)) for names, values in cells.items()]
    show(style, header, rows, json_object, title="eps that programs give, for the eps asked for")


def _json(row: Audit, resolved: bool) -> dict[str, Any]:
    """Return an audit as JSON has it, times in undamped contact times; `resolved`: with the steps a contact needs.

    Each number of those steps costs a search over many collisions, and the table of five eps does not print them.
    """
    from mpmath import mp

    from viscopade.simulators.formula import DIGITS

    formula, stepped = row.formula, row.stepped
    # "delivered" has the digits that are proven. `x and y` is None where there is no x.
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
