"""The part of `viscopade audit` that prints the eps of one contact: in a user's file, or of any force.

    viscopade audit mujoco --set "solref=-2500 -100" --speed 1 --time-step 0.003
    viscopade audit --force "k*x**1.5 + c*x**0.5*v" --constant k=1e7 --constant c=900 --mass 0.01 --speed 1

Numbers in sentences have 2 to 6 figures (`.4g`), chosen by hand to be read; JSON and CSV have all digits.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from viscopade import arguments
from viscopade.cli.console import Quantity, say, show
from viscopade.generated import printable
from viscopade.simulators import simulator_of, simulators
from viscopade.theory.law import End

if TYPE_CHECKING:
    from viscopade.collision.contact import SampledCollision
    from viscopade.simulators.native import Delivery, Impact, Native

# A line of an input of these programs, which begins with one of these commands, may be pasted after --set.
_WITH_LINES = ("lammps", "liggghts")
_COMMANDS = (["pair_coeff"], ["pair_style"], ["fix"])
BETWEEN = "a number > 0 and < 1"
QUANTITIES = {
    "speed": Quantity("speed", " > 0"),
    "mass": Quantity("mass", " > 0"),
    "radius": Quantity("length", " > 0"),
    "density": Quantity("density", " > 0"),
    "gravity": Quantity("acceleration", " >= 0"),
    "time-step": Quantity("time", " > 0"),
}
"""Options of numbers; where a program's numbers have no units, their units are refused."""


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
    radius: Sequence[str],
    density: Sequence[str],
    constants: Sequence[str],
    vary: str | None,
    **quantities: str | None,
) -> None:
    """Print the eps of the contact in a user's file, or with any force.

    Parameters
    ----------
    simulator, force : str or None
        One of both: a program's name, or a formula of the compression x and its rate v.
    epsilon : str or None
        The wanted eps: also print what to write for it.
    time_step : str or None
        A time; without it steps are infinitely fine.
    style : str
        Format of the output: text, csv or json.
    settings : sequence of str
        NAME=VALUE of the program's parameters, or pasted lines of LAMMPS or LIGGGHTS.
    scheme, end : str or None
        The program's name of an integrator; the end of contact of a force.
    radius, density : sequence of str
        Empty or one text: an effective radius, or with a density the radii of the spheres.
    constants, vary
        NAME=VALUE of constants in the formula, and the name of the one that is the damping.
    **quantities : str or None
        Texts of speed, mass and gravity.
    """
    from viscopade.simulators.deck import TSUJI_2026
    from viscopade.simulators.lammps_deck import line_settings
    from viscopade.simulators.native import FileUnits, delivery, names_without_effect
    from viscopade.simulators.own_law import FEWEST_STEPS
    from viscopade.simulators.setup import SI

    # `native`: the parameters of the program's contact and its force as a function of them.
    title, version, native = _native(simulator, force, end, constants, vary)
    if force is not None and settings:
        raise click.UsageError("--set is given with --force: expected --constant for a number in the formula")

    # A pasted line of LAMMPS or LIGGGHTS sets several parameters.
    pasted = [text for text in settings if simulator in _WITH_LINES and text.split()[:1] in _COMMANDS]
    words = [text for text in settings if text not in pasted]
    words += [] if scheme is None else [f"{native.integrator}={scheme}"]
    of_lines = [f"{name}={value}" for text in pasted for name, value in line_settings(text).items()]
    # A line does not say its release: then --set says what its `damping tsuji` means.
    if {f"damping={TSUJI_2026}", "damping=tsuji"} <= {*words, *of_lines}:
        of_lines.remove("damping=tsuji")
    texts = values_by_name("--set", [*words, *of_lines], "solref=-2500 -100")

    # A pasted fix is a wall: fix wall/gran. Plain numbers are in the units of the user's file. `sized` lists the
    # options with a unit: a pasted line does not say its file's units, which are then taken to be si, and where the
    # units have no size (lj of LAMMPS) a unit is refused.
    has_wall = any(text.split()[0] == "fix" for text in pasted)
    impact, sized = _impact(radius, density, has_wall, **quantities, **{"time-step": time_step})
    units_are_assumed = pasted and sized and "units" in native.parameters_by_name and "units" not in texts
    if units_are_assumed:
        texts["units"] = "si"
    unsized = native.units(native.values(texts)).unsized
    if sized and unsized:
        raise click.UsageError(f"--{sized[0]} has a unit, and {unsized}")
    target = None
    if epsilon is not None and force is not None and vary is None:
        raise click.UsageError(
            "--epsilon is given with --force: expected --vary NAME, the --constant that is the damping"
        )
    if epsilon is not None:
        target = float(arguments.exact_number("--epsilon", epsilon, BETWEEN, lambda e: 0 < e < 1))
    # Refuse what changes nothing: radius, mass, or a set parameter on which the contact does not depend.
    for useless in names_without_effect(native, texts, impact):
        # The mass depends on the radius of spheres; a pasted line is whole.
        if (useless == "radius" and density) or f"{useless}={texts.get(useless)}" in of_lines:
            continue
        option = f"--set {useless}" if useless in texts else "--density" if density else f"--{useless}"
        raise click.UsageError(f"{option} has no effect on this contact: expected a command without it")
    outcome = delivery(native, texts, impact, target, weight_is_known=quantities["gravity"] is not None)
    if units_are_assumed:
        text = f"units is not set, and taken to be si because --{sized[0]} has a unit: --set units=…"
        outcome = replace(outcome, warnings=(*outcome.warnings, text))
    # Without --time-step eps is that of infinitely fine steps. Warn if the program's default step is too coarse for
    # this: from FEWEST_STEPS = 10 steps in a contact on our texts compute with a step. Default steps are in SI units.
    default = None if simulator is None or time_step else simulator_of(simulator).default_step
    steps = outcome.collision.duration / default if default and outcome.units == FileUnits() else FEWEST_STEPS
    if steps < FEWEST_STEPS:
        step = SI.time_text(default or 0.0)
        long = f"{title}'s default step of {step} is {1 / steps:.2g} contacts long"
        outcome = replace(outcome, warnings=(*outcome.warnings, f'{long}: --time-step "{step}" computes its eps'))

    # The numbers of a row of CSV, and what JSON has besides.
    collision, units = outcome.collision, outcome.units
    fields: dict[str, Any] = {
        "simulator": simulator,
        "delivered": collision.epsilon,
        "least": collision.least,
        "largest": collision.largest,
        "depth": collision.depth or None,  # an impulse has none, and no duration
        "duration": collision.duration if 0 < collision.duration < math.inf else None,
        "parts": collision.parts,
        "instead": None if outcome.instead is None else dict(outcome.instead),
        "scheme": outcome.scheme if outcome.stepped else None,
        "sticking_speed": outcome.sticking and outcome.sticking.speed,
        "source": ", ".join(filter(None, (native.source, version))),
    }
    errors = {name: error if error < math.inf else None for name, error in collision.errors.items()}
    more: dict[str, Any] = {
        "status": collision.status,
        "units": {"length": units.length, "time": units.time},
        "errors": errors,
        "neck_energy": outcome.sticking and outcome.sticking.neck_energy,
    }
    if style == "text":
        hit, bodies = impact.in_units(units), ""
        if density:
            bodies = f"effective mass {hit.mass:.6g} {units.mass}, effective radius {hit.radius:.6g} {units.length}"
        line = _pasted_again(pasted, texts, outcome.instead or {})
        _say_contact(title, outcome, native, epsilon, impact.speed, bodies, line)
    else:
        fields["instead"] = fields["instead"] if style == "json" else _words(outcome.instead or {})
        row = ["" if value is None else value for value in fields.values()]
        rules = {name: mixed._asdict() for name, mixed in outcome.values.mixed.items()}
        show(style, [*fields], [row], fields | more | {"mixed": rules, "warnings": [*outcome.warnings]})


def si_number(option: str, text: str, sized: list[str]) -> float:
    """Return the number of an option in SI units; if the text has a unit, the option is added to `sized`."""
    decimal = QUANTITIES[option].decimal(text.strip(), f"--{option}")
    sized.extend([option] * (decimal != text.strip() and any(map(str.isalpha, text))))  # a plain fraction has no unit
    return float(decimal)


def _impact(
    radius: Sequence[str], density: Sequence[str], has_wall: bool, **quantities: str | None
) -> tuple[Impact, list[str]]:
    """Return the impact that options describe, in SI units, and the options that have a unit.

    Parameters
    ----------
    radius, density : sequence of str
        Empty or one text. Without a density the radius is the effective one, R1 R2/(R1 + R2). With a density it is that
        of the spheres, "1 mm", "1 mm, 2 mm" or "1 mm, wall", from which their masses follow.
    has_wall : bool
        Whether a plane is known to be the second body.
    **quantities : str or None
        Texts of speed, mass (the effective one), gravity and time-step.
    """
    from viscopade.simulators.native import Impact, effective

    sized: list[str] = []
    si = {name: None if text is None else si_number(name, text, sized) for name, text in quantities.items()}
    if si["speed"] is None:
        raise click.UsageError("--speed is missing: expected the impact speed")
    for option, texts in (("radius", radius), ("density", density)):
        if len(texts) > 1:
            raise click.UsageError(f"--{option} is given {len(texts)} times: expected once")
    if not density:
        effective_mass = si["mass"]
        effective_radius = si_number("radius", radius[0], sized) if radius else None
    elif si["mass"] is not None or not radius:
        raise click.UsageError("--density is given: expected --radius, the radius of the spheres, and no --mass")
    else:
        parts = [part.strip() for part in radius[0].split(",")]
        if parts[-1] == "wall":
            parts, has_wall = parts[:-1], True
        radii = [si_number("radius", part, sized) for part in parts]
        densities = [si_number("density", part, sized) for part in density[0].split(",")]
        if not 0 < len(densities) <= len(radii) <= 2 - has_wall:
            spheres = "one sphere" if has_wall else 'one sphere, or two, such as "1 mm, 2 mm", or "1 mm, wall"'
            raise click.UsageError(f"--radius is {radius[0]!r}, --density {density[0]!r}: expected those of {spheres}")
        # A single number is that of both spheres, a wall has none; m = 4/3 pi R^3 rho. `effective` of two numbers is
        # x1 x2/(x1 + x2), and of one, at a wall, the number itself.
        radii, densities = ((numbers * 2)[: 2 - has_wall] for numbers in (radii, densities))
        masses = [4 / 3 * math.pi * r**3 * rho for r, rho in zip(radii, densities, strict=True)]
        effective_mass, effective_radius = effective(masses), effective(radii)
    return Impact(si["speed"], effective_mass, effective_radius, si["gravity"] or 0.0, si["time-step"]), sized


def _native(
    simulator: str | None, force: str | None, end: End | None, constants: Sequence[str], vary: str | None
) -> tuple[str, str, Native]:
    """Return the title, the version and the contact (parameters and force) of a simulator, or of a force.

    Of `simulator`, a name, and `force`, a formula, one is None. `end`, the end of contact, the texts NAME=VALUE of
    `constants`, and `vary`, the constant that is the damping, belong to a force, which has neither title nor version.
    """
    if (simulator is None) == (force is None):
        raise click.UsageError("expected either a simulator, such as mujoco, or --force")
    if force is not None:
        from viscopade.simulators.typed_force import native

        return "", "", native(force, end or "force", constants, vary)
    # A program has its own end of contact and its own names of parameters.
    for flag, value in {"--end": end, "--constant": constants, "--vary": vary}.items():
        if value:
            raise click.UsageError(f"{flag} is given for a simulator, which has its own: expected --force with it")
    program = simulator_of(str(simulator))
    if program.native is None:
        with_one = ", ".join(other.name for other in simulators() if other.native is not None)
        raise ValueError(f"{program.title} has no contact of native parameters here: expected {with_one}")
    return program.title, program.version, program.native


def values_by_name(option: str, texts: Sequence[str], example: str) -> dict[str, str]:
    """Return the values of texts NAME=VALUE by name; `option` and `example` are for the refusal of another text."""
    values: dict[str, str] = {}
    for text in texts:
        # The first "=" separates; a value may have others.
        name, equals, value = map(str.strip, text.partition("="))
        if not equals:
            raise click.UsageError(f'{option} is {text!r}: expected NAME=VALUE, such as "{example}"')
        if name in values:
            raise click.UsageError(f"{name} is set twice: expected once")
        values[name] = value
    return values


def _words(values: Mapping[str, str]) -> str:
    """Return "name = value, name = value"."""
    return ", ".join(f"{name} = {value}" for name, value in values.items())


def _pasted_again(pasted: Sequence[str], texts: Mapping[str, str], instead: Mapping[str, str]) -> str:
    """Return the pasted line with the coefficients of `instead`; "" for a line without a normal model, as gran/… is.

    `texts` has the values of all parameters by name: in "pair_coeff * * hooke 1e5 50 tangential …" the parameter
    normal is "hooke" and coefficients is "1e5 50". `instead` has what to write for the wanted eps.
    """
    # Only where the coefficients are all that changes, and only behind the model's name: the same numbers may stand
    # elsewhere in the line.
    model, numbers = texts.get("normal"), texts.get("coefficients")
    lines = (" ".join(text.split()) for text in pasted if [*instead] == ["coefficients"])
    return "".join(
        line.replace(f" {model} {numbers}", f" {model} {instead['coefficients']}")
        for line in lines
        if f" {model} {numbers}" in line
    )


def _say_contact(
    title: str, outcome: Delivery, native: Native, epsilon: str | None, speed: float, bodies: str, line: str
) -> None:
    """Print a collision in sentences.

    Parameters
    ----------
    title : str
        Name of the program; "" for a force.
    outcome : Delivery
        The collision and what to write instead, in the units of the file.
    native : Native
        The contact: its integrators and the words for its parameters.
    epsilon : str or None
        The wanted eps as it was typed.
    speed : float
        Impact speed in m/s.
    bodies : str
        Effective mass and radius in words, if they follow from a density, else "".
    line : str
        The pasted line for the wanted eps, or "".
    """
    collision, units, stepped = outcome.collision, outcome.units, outcome.stepped

    def eps(sampled: SampledCollision, why: str = "") -> str:
        """Return eps in figures; with a time step its mean and its range over the phases, and why there is one."""
        if not sampled.parts:
            return "0"
        # In steps four decimals are enough: eps depends on where in a step contact begins. Else it has six figures.
        return (
            f"{sampled.epsilon:.4f} ({sampled.least:.4f} to {sampled.largest:.4f}{why})"
            if stepped
            else f"{sampled.epsilon:.6g}"
        )

    # First sentence: eps, and eps with the weight of a falling body where this was not asked for but would count.
    text = eps(collision, ": where in a step contact begins") if collision.parts else "0, as the bodies do not part"
    if collision.parts and outcome.falling is not None:
        text += f" without weight; {eps(outcome.falling)} for a body that falls on a plane"
    say(f"{title}{': ' if title else ''}eps = {text}, sampled")
    duration = f", duration {collision.duration:.4g} {units.time}"
    if collision.duration == math.inf:
        duration = "; if contact begins at some places in a step, the bodies do not part"
    if collision.depth:  # an impulse has none
        say(f"depth {collision.depth:.4g} {units.length}{duration if collision.parts else ''}")
    # The parameters on which the force depends, with the program's defaults, and how those of two types were mixed.
    used = {name: value for name, value in outcome.values.items() if name in outcome.values.read - {native.integrator}}
    if used:
        say(f"for {', '.join(filter(None, (_words(native.texts(used)), bodies)))}")
    for name, mixed in outcome.values.mixed.items():
        say(mixed.sentence(name))
    # Adhesion: the speed below which bodies stay together, and the energy of a neck, which eps loses without damping.
    if (sticking := outcome.sticking) is not None:
        below = "no speed is found below which the bodies stay together"
        if sticking.speed is not None:
            below = f"below {sticking.speed:.4g} {units.speed} the bodies stay together"
        energy = f"; without damping the neck costs {sticking.neck_energy:.4g} {units.energy}"
        say(f"{below}{energy if sticking.neck_energy else ''}")
    # The integrator of this answer, and those to choose from; the program's default is the first of its own.
    default, *others = native.schemes
    continuous = f"time steps: {'infinitely fine' if collision.depth else 'none, as there is no --time-step'}"
    say(f"integrator: {outcome.scheme}" if stepped else continuous)
    if others:
        say(f"integrators for --scheme: {', '.join([f'{default} (default)', *others])}")
    # What to write for the wanted eps: as a pasted line on its own, or in words. `seconds` and `metres` are the sizes
    # of the file's units.
    if outcome.instead is not None:
        speed_text = f"{speed * units.seconds / units.metres:.6g} {units.speed}"
        say(f"for eps = {epsilon} at {speed_text} write{'' if line else f' {_words(outcome.instead)}'}")
        if line:
            click.echo(f"    {printable(line)}")
    for text in outcome.warnings:
        say(f"Warning: {text}.")
