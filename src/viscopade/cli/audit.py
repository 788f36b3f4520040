"""Command that prints the eps of programs and formulas: audit."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import click

from viscopade import arguments
from viscopade.cli.console import STYLE, OneOf, Quantity, Real, examples, say, show
from viscopade.simulators import SIMULATORS, simulator_of, simulators
from viscopade.theory.law import ENDS, End

if TYPE_CHECKING:
    from viscopade.collision.contact import SampledCollision
    from viscopade.simulators.audit import Audit
    from viscopade.simulators.native import Delivery, Native
    from viscopade.simulators.simulator import Simulator

_LEAST_STEP, _LEAST_ERROR = 1e-3, 1e-8
_FIGURES = 6  # of a number in a table
_SHOWN = 3  # formulas of a program
_BETWEEN = "a number > 0 and < 1"
_QUANTITIES = {
    "speed": Quantity("speed", " > 0"),
    "mass": Quantity("mass", " > 0"),
    "radius": Quantity("length", " > 0"),
    "gravity": Quantity("acceleration", " >= 0"),
    "time-step": Quantity("time", " > 0"),
}
"""Options of --set and --force; where a program's numbers have no units, their units are refused."""


@click.command(
    epilog=examples(
        "viscopade audit mujoco --epsilon 0.5",
        'viscopade audit mujoco --set "solref=-2500 -100" --speed 1 --time-step 0.003',
    )
)
@click.argument("simulator", required=False, type=OneOf(SIMULATORS), metavar="[SIMULATOR]")
@click.option("--epsilon", help="The wanted eps, > 0 and <= 1.  [default: 0.9, 0.75, 0.5, 0.3, 0.1]")
@click.option("--time-step", help="Time step: a multiple of the undamped contact time; with --speed a time.")
@click.option(
    "--contact-time", type=Quantity("time", " > 0"), help="Undamped contact time, for a --time-step with a unit."
)
@click.option("--step-error", type=Real(), help="Print the largest time step whose eps has this relative error.")
@click.option(
    "--set",
    "settings",
    multiple=True,
    metavar="NAME=VALUE",
    help="Parameter in your file; repeatable. A wrong NAME prints all names and defaults.",
)
@click.option("--force", metavar="FORMULA", help="Force as a function of the compression x and its rate v.")
@click.option("--speed", metavar="QUANTITY", help="Impact speed, for --set and --force.")
@click.option("--mass", metavar="QUANTITY", help="Effective mass, m1 m2/(m1 + m2).")
@click.option("--radius", metavar="QUANTITY", help="Effective radius, R1 R2/(R1 + R2).")
@click.option("--gravity", metavar="QUANTITY", help="Include the weight of a body that falls on a plane.")
@click.option("--scheme", help="Integrator; a wrong name prints the list.  [default: that of the program]")
@click.option(
    "--end",
    type=click.Choice(ENDS),
    help="End of contact for --force: where the force vanishes, or at x = 0.  [default: force]",
)
@click.option("--all", "whole", is_flag=True, help="With --epsilon: print all formulas of a program, not three only.")
@STYLE
def audit(
    simulator: str | None,
    epsilon: str | None,
    time_step: str | None,
    contact_time: float | None,
    step_error: float | None,
    whole: bool,
    style: str,
    **own: Any,
) -> None:
    """Print the eps that a program gives, and what to set instead.

    There are two ways to use it. The first example starts from the eps that you want: the table has the number that the
    program's manual tells you to write, the eps that this number gives, the reason, and the number to write instead.
    Without a time step these eps are exact, and every digit is proven. With --time-step the program's own steps are
    computed. Contact may begin anywhere in a step: the result is the mean of eps and its range, and the number to write
    instead gives your eps on average. As text, three formulas of each program are printed: those whose eps differ most.

    The second example, with --speed, starts from the parameters of your file, set by --set. Other parameters have the
    program's defaults. --force replaces the program by a formula with numbers, x, v, + - * / **, min, max, abs, sqrt,
    exp, where(x < 1e-3, ..., ...) and the cubic step(x, x0, h0, x1, h1). With --epsilon the number to write for that
    eps is printed, too. These eps are sampled, not proven.

    The contact time is without damping: `viscopade epsilon` prints it for a material with A = 0. Plain numbers are in
    SI units.
    """
    of_audit = {"--contact-time": contact_time, "--step-error": step_error, "--all": whole}
    of_contact = {"--speed": own["speed"], "--set": own["settings"] or None, "--force": own["force"]}
    typed = [flag for flag, value in of_contact.items() if value is not None]
    if typed:
        _refuse(f"with {' and '.join(typed)}", of_audit)
        _show_contact(simulator, epsilon, time_step, style, **own)
    else:
        _refuse("without --speed", {f"--{name}": own[name] for name in ("mass", "radius", "gravity", "scheme", "end")})
        _show_audits(simulator, epsilon, time_step, contact_time, step_error, whole, style)


def _refuse(where: str, options: Mapping[str, object]) -> None:
    for flag, value in options.items():
        if value not in (None, False):
            raise click.UsageError(f"{flag} is given {where}: expected one of both")


def _show_audits(
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
        say(f"{rule(row.formula.law for row in found)}.")
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


def _show_contact(
    simulator: str | None,
    epsilon: str | None,
    time_step: str | None,
    style: str,
    *,
    settings: Sequence[str],
    force: str | None,
    scheme: str | None,
    end: End | None,
    **quantities: str | None,
) -> None:
    """Print the eps of the contact in a user's file, or with any force."""
    from viscopade.simulators.native import FileUnits, Impact, delivery, without_effect
    from viscopade.simulators.own_law import FEWEST_STEPS
    from viscopade.simulators.setup import SI

    title, version, native = _native(simulator, force, end)
    given = _given([*settings, *([] if scheme is None else [f"{native.integrator}={scheme}"])])
    unsized = native.units(native.values(given)).unsized
    numbers: dict[str, Any] = {}
    for name, text in {**quantities, "time-step": time_step}.items():
        number = None if text is None else _QUANTITIES[name].decimal(text, f"--{name}")
        if number != text and unsized:
            raise click.UsageError(f"--{name} has a unit, and {unsized}")
        numbers["step" if name == "time-step" else name] = None if number is None else float(number)
    if numbers["speed"] is None:
        raise click.UsageError("--speed is missing: expected the impact speed")
    numbers["gravity"] = numbers["gravity"] or 0.0
    wanted = None
    if epsilon is not None:
        wanted = float(arguments.exact_number("--epsilon", epsilon, _BETWEEN, lambda e: 0 < e < 1))
    useless = without_effect(native, given, Impact(**numbers))
    if useless is not None:
        option = f"--set {useless}" if useless in given else f"--{useless}"
        raise click.UsageError(f"{option} has no effect on this contact: expected a command without it")
    found = delivery(native, given, Impact(**numbers), wanted)
    default = None if simulator is None or time_step else simulator_of(simulator).default_step
    steps = found.collision.duration / default if default and found.units == FileUnits() else FEWEST_STEPS
    if steps < FEWEST_STEPS:
        step = SI.time_text(default or 0.0)
        long = f"{title}'s default step of {step} is {1 / steps:.2g} contacts long"
        found = replace(found, warnings=(*found.warnings, f'{long}: --time-step "{step}" computes its eps'))
    collision, units = found.collision, found.units
    fields: dict[str, Any] = {
        "simulator": simulator,
        "delivered": collision.epsilon,
        "least": collision.least,
        "largest": collision.largest,
        "depth": collision.depth or None,  # an impulse has none, and no duration
        "duration": collision.duration if 0 < collision.duration < math.inf else None,
        "parts": collision.parts,
        "instead": None if found.instead is None else dict(found.instead),
        "scheme": found.scheme if found.stepped else None,
        "source": ", ".join(filter(None, (native.source, version))),
    }
    errors = {name: error if error < math.inf else None for name, error in collision.errors.items()}
    more = {"status": collision.status, "units": {"length": units.length, "time": units.time}, "errors": errors}
    if style == "text":
        _say_contact(title, found, native, epsilon, numbers["speed"])
    else:
        fields["instead"] = fields["instead"] if style == "json" else _words(found.instead or {})
        row = ["" if value is None else value for value in fields.values()]
        mixed = {name: each._asdict() for name, each in found.values.mixed.items()}
        show(style, [*fields], [row], fields | more | {"mixed": mixed, "warnings": [*found.warnings]})


def _native(simulator: str | None, force: str | None, end: End | None) -> tuple[str, str, Native]:
    """Return the name, the version and the contact of a simulator, or of a force."""
    if (simulator is None) == (force is None):
        raise click.UsageError("expected either a simulator, such as mujoco, or --force")
    if force is not None:
        from viscopade.simulators.typed_force import native

        return "", "", native(force, end or "force")
    if end is not None:
        raise click.UsageError("--end is given for a simulator, which has its own: expected --force with it")
    program = simulator_of(str(simulator))
    if program.native is None:
        with_one = ", ".join(each.name for each in simulators() if each.native is not None)
        raise ValueError(f"{program.title} has no contact of native parameters here: expected {with_one}")
    return program.title, program.version, program.native


def _given(settings: Sequence[str]) -> dict[str, str]:
    """Return the texts of parameters by name."""
    found: dict[str, str] = {}
    for text in settings:
        name, equals, value = map(str.strip, text.partition("="))
        if not equals:
            raise click.UsageError(f'--set is {text!r}: expected NAME=VALUE, such as "solref=-2500 -100"')
        if name in found:
            raise click.UsageError(f"{name} is set twice: expected once")
        found[name] = value
    return found


def _words(values: Mapping[str, str]) -> str:
    return ", ".join(f"{name} = {value}" for name, value in values.items())


def _say_contact(title: str, found: Delivery, native: Native, epsilon: str | None, speed: float) -> None:
    """Print a collision in sentences."""
    collision, units, stepped = found.collision, found.units, found.stepped

    def eps(of: SampledCollision, why: str = "") -> str:
        if not of.parts:
            return "0"
        return f"{of.epsilon:.4f} ({of.least:.4f} to {of.largest:.4f}{why})" if stepped else f"{of.epsilon:.6g}"

    text = eps(collision, ": where in a step contact begins") if collision.parts else "0, as the bodies do not part"
    if collision.parts and found.falling is not None:
        text += f" without weight; {eps(found.falling)} for a body that falls on a plane"
    say(f"{title}{': ' if title else ''}eps = {text}, sampled")
    duration = f", duration {collision.duration:.4g} {units.time}"
    if collision.duration == math.inf:
        duration = "; if contact begins at some places in a step, the bodies do not part"
    if collision.depth:  # an impulse has none
        say(f"depth {collision.depth:.4g} {units.length}{duration if collision.parts else ''}")
    used = {name: value for name, value in found.values.items() if name != native.integrator}
    if used:
        say(f"for {_words(native.written(used))}")
    for name, mixed in found.values.mixed.items():
        say(mixed.sentence(name))
    others = [f"{name} (default)" if i == 0 else name for i, name in enumerate(native.schemes)]
    say(f"integrator: {found.scheme if stepped else 'infinitely fine steps'}; there are {', '.join(others)}")
    if found.instead is not None:
        at = f"{speed * units.seconds / units.metres:.6g} {units.speed}"
        say(f"for eps = {epsilon} at {at} write {_words(found.instead)}")
    for text in found.warnings:
        say(f"Warning: {text}.")


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


COMMANDS = (audit,)
