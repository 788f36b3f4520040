"""The part of `viscopade audit` that prints the eps of one contact: in a user's file, or of any force."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from viscopade import arguments
from viscopade.cli.console import Quantity, say, show
from viscopade.simulators import simulator_of, simulators
from viscopade.theory.law import End

if TYPE_CHECKING:
    from viscopade.collision.contact import SampledCollision
    from viscopade.simulators.native import Delivery, Native

_BETWEEN = "a number > 0 and < 1"
_QUANTITIES = {
    "speed": Quantity("speed", " > 0"),
    "mass": Quantity("mass", " > 0"),
    "radius": Quantity("length", " > 0"),
    "gravity": Quantity("acceleration", " >= 0"),
    "time-step": Quantity("time", " > 0"),
}
"""Options of --set and --force; where a program's numbers have no units, their units are refused."""


def show_contact(
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
    for useless in without_effect(native, given, Impact(**numbers)):
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
