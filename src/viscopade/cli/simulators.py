"""Command for the contact parameters of other programs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from viscopade.cli.console import (
    EFFECTIVE_MASS,
    GRAVITY,
    OUTPUT,
    FilePath,
    OneOf,
    Quantity,
    Real,
    command_line,
    examples,
    limits_of,
    material,
    pair_with,
    write_or_print,
)
from viscopade.cli.generate import read_scene
from viscopade.kernels.catalogue import TIERS
from viscopade.simulators import OWN_LAW, SIMULATORS, TARGETS, TYPED, simulator_with

if TYPE_CHECKING:
    from viscopade.scene.description import Scene
    from viscopade.simulators.setup import Setup

_OF_OWN_LAW = ("law", "stiffness", "contact_time", "penetration", "mass", "time_step", "step_error")
"""Options of programs whose contacts have a law of their own."""
_LONG = 10  # s; a longer contact time probably lacks its unit
_AUDITED = {
    name: f"there is no file for {name}; viscopade audit {name} prints the number to write"
    for name, own in SIMULATORS.items()
    if not own
}


class SpeedRange(click.ParamType):  # type: ignore[type-arg]
    """Type of an option: two speeds, such as "1:20 cm/s"."""

    name = "MIN:MAX"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[float, float]:
        """Parse two speeds; the first may have no unit, and then has the unit of the second."""
        first, colon, second = value.partition(":")
        if not colon:
            raise ValueError(f'--speeds is {value!r}: expected the lowest and the highest speed, such as "1:20 cm/s"')
        unit = second.lstrip("+-.0123456789eE ")
        if first.strip(" +-.0123456789eE") == "" and unit:
            first += f" {unit}"
        low, high = (float(Quantity("speed").decimal(text.strip(), "--speeds")) for text in (first, second))
        return low, high


@click.command(
    "simulators",
    epilog=examples(
        'viscopade simulators lammps --epsilon 0.9 --speed "1 m/s" --radius "1 cm" \\\n'
        "    --density 2500 --young-modulus 1e7 --poisson-ratio 0.3"
    ),
)
@click.argument("target", metavar="PROGRAM", type=OneOf(TARGETS, _AUDITED))
@click.argument("file", type=FilePath(), required=False)
@click.option("--epsilon", type=Real(), help="Wanted eps at --speed, instead of a scene or A.")
@click.option("--speed", type=Quantity("speed"), help="Impact speed, instead of a scene.")
@click.option("--law", metavar="NAME|A,B", help="Law of contact with that eps at --speed.  [default: viscoelastic]")
@click.option("--speeds", type=SpeedRange(), help="Range of speeds, for which the file states the error of eps.")
@material("young_modulus", "poisson_ratio", "density", "dissipative_constant", "yield_strength")
@click.option("--stiffness", help="Stiffness k, such as '1e5 N/m', or k/m, such as '1e5 1/s^2'.")
@click.option("--contact-time", type=Quantity("time"), help="Duration of a contact at --speed.")
@click.option("--penetration", type=Quantity("length"), help="Penetration in the fastest impact.")
@EFFECTIVE_MASS
@click.option("--time-step", type=Quantity("time", " > 0"), help="Time step, whose error the damping compensates.")
@click.option("--step-error", type=Real(), help="Relative error of eps for the longest time step.  [default: 0.01]")
@GRAVITY
@click.option("--tier", type=click.Choice(TIERS), help="Accuracy of the kernel in REBOUND.  [default: 1e-5]")
@OUTPUT
def simulators_command(target: str, file: Path | None, tier: str | None, output: Path | None, **options: Any) -> None:
    """Print the contact parameters of a simulation program.

    PROGRAM is one of the following. lammps, rebound-c, rebound-python, mercurydpm, yade and liggghts compute the
    viscoelastic law, or the nearest law that they have. Give either a scene as FILE, or a material, --speed, and either
    --epsilon or A.

    mujoco, drake, simbody (OpenSim), chrono and jaxdem have their own laws of contact, whose damping is exact at one
    speed. Give a scene, a material, or only --epsilon and --speed. --stiffness, --contact-time or --penetration sets
    the stiffness; the default is the contact time of the viscoelastic spheres, or else 20 time steps. A plain
    --stiffness is what the file has: over the effective mass for MuJoCo, not so for the others. --law names the law
    that your data follow; `viscopade fit` prints its name.

    With --gravity a body that falls on a plane has the wanted eps and contact time. During the contact its weight
    presses it against the plane, and it loses more energy. Two spheres that fall together have no weight in their
    frame.

    Quantities may have units, such as "10 cm/s"; plain numbers are in SI units.
    """
    words = command_line()
    given = {name: options.pop(name) for name in _OF_OWN_LAW}
    if target not in OWN_LAW and any(value is not None for value in given.values()):
        flag = next(name for name, value in given.items() if value is not None)
        raise click.UsageError(f"--{flag.replace('_', '-')} is given for {target}: expected {', '.join(OWN_LAW)}")
    if tier is not None and not target.startswith("rebound"):
        raise click.UsageError(
            f"--tier is given for {target}, which computes the force: expected rebound-c or rebound-python"
        )
    found = _given(file, options.pop("gravity") or None, classes=target in TYPED, **options)
    if target in OWN_LAW:
        text = _own_law_text(target, found, words, given)
    elif found.setup is not None:
        from viscopade.simulators.input_file import render

        text = render(target, found.setup, words, **({} if tier is None else {"tier": tier}))
    else:
        raise click.UsageError(
            f"{target} needs a material: expected a scene, or --radius, --density, --young-modulus and --poisson-ratio"
        )
    write_or_print(text, output)


@dataclass(frozen=True)
class _Given:
    """The collisions that the options describe: a setup, or only an eps at a speed."""

    setup: Setup | None
    scene: Scene | None = None
    epsilon: float | None = None
    speed: float = 1.0
    speeds: tuple[float, float] | None = None
    gravity: float | None = None


def _given(
    file: Path | None,
    gravity: float | None,
    classes: bool,
    epsilon: float | None,
    speed: float | None,
    speeds: tuple[float, float] | None,
    yield_strength: float | None,
    **options: Any,
) -> _Given:
    from viscopade.scene.sense import setup

    constant = options["dissipative_constant"]
    without = {name: value for name, value in options.items() if name != "dissipative_constant"}
    has_material = bool(without["radii"]) or any(value not in (None, False, ()) for value in without.values())
    if file is not None:
        if has_material or any(value is not None for value in (epsilon, speed, speeds, constant, yield_strength)):
            raise click.UsageError(
                "a scene and a material are given: expected either a scene or a material with --speed"
            )
        scene = read_scene(file)
        return _Given(setup(scene, gravity, classes=classes), scene)
    if (epsilon is None) == (constant is None):
        given = "neither" if constant is None else "both"
        raise click.UsageError(
            f"--epsilon and --dissipative-constant: {given} given, expected a scene, or a material with --speed and "
            "exactly one of them"
        )
    if speed is None:
        raise click.UsageError("a material also needs --speed, the impact speed that matters")
    if speeds is not None and not 0 < speeds[0] <= speed <= speeds[1]:
        raise ValueError(f"--speeds is {speeds[0]:g}:{speeds[1]:g} m/s: expected 0 < MIN <= {speed:g} <= MAX")
    if not has_material and constant is None and yield_strength is None:
        return _Given(None, None, epsilon, speed, speeds, gravity)
    return _Given(_setup_of_material(epsilon, speed, speeds, yield_strength, gravity, options))


def _setup_of_material(
    epsilon: float | None,
    speed: float,
    speeds: tuple[float, float] | None,
    yield_strength: float | None,
    gravity: float | None,
    options: dict[str, Any],
) -> Setup:
    """Return one pair of bodies with the given A, or with the A that gives eps at the speed."""
    from viscopade.simulators.setup import pair_setup

    pair = pair_with(epsilon, speed, gravity, **options)
    fastest = speed if speeds is None else speeds[1]
    return pair_setup(pair, speed, speeds, tuple(limits_of(pair, fastest, yield_strength)), gravity)


def _own_law_text(target: str, found: _Given, words: str, given: dict[str, Any]) -> str:
    from viscopade.scene.units import Scale
    from viscopade.simulators.own_law import STEP_ERROR, Softness, Wanted, render_own_law
    from viscopade.simulators.setup import SI
    from viscopade.simulators.simulator import OwnLaw
    from viscopade.theory.law import VISCOELASTIC, law_of

    law = VISCOELASTIC if given["law"] is None else law_of(given["law"])
    if given["law"] is not None and found.epsilon is None:
        raise click.UsageError(
            "--law and a scene or a material are given: expected --law with --epsilon and --speed alone"
        )
    error = STEP_ERROR if given["step_error"] is None else given["step_error"]
    if given["step_error"] is not None and given["time_step"] is not None:
        raise click.UsageError("--step-error has no effect with --time-step: expected one of them")
    own = simulator_with(target).texts[target]
    assert isinstance(own, OwnLaw)
    if given["step_error"] is not None and simulator_with(target).formula(own.formula).scheme is None:
        raise click.UsageError(f"--step-error has no effect for {target}, which chooses its own steps: leave it out")
    if not 1e-8 <= error <= 1:
        raise ValueError(f"--step-error is {error:.4g}: expected 1e-08 to 1")
    if given["mass"] is not None and found.setup is not None:
        raise click.UsageError("--mass and bodies with masses are given: expected one of them")
    scale = Scale() if found.scene is None else found.scene.scale
    if given["stiffness"] is not None and found.setup is not None and found.setup.units != SI:
        raise click.UsageError(
            "--stiffness is in SI units and the scene is not: expected --contact-time or --penetration"
        )
    time, length, step = (
        None if value is None else value / unit
        for value, unit in (
            (given["contact_time"], scale.time),
            (given["penetration"], scale.length),
            (given["time_step"], scale.time),
        )
    )
    if (given["contact_time"] or 0) > _LONG:
        click.echo(f"Warning: contact-time is {given['contact_time']:g} s: is a unit missing?", err=True)
    stiffness = _stiffness(target, given, found.setup is not None or given["mass"] is not None)
    softness = Softness(**stiffness, contact_time=time, penetration=length)
    unknown = softness == Softness() or (softness.stiffness is not None and given["mass"] is None)
    if given["step_error"] is not None and found.setup is None and unknown:
        raise click.UsageError(
            "--step-error has no effect, as nothing says how long contact lasts: expected --contact-time with it"
        )
    if found.setup is None:
        assert found.epsilon is not None
        wanted = [Wanted.at(found.epsilon, found.speed, found.speeds, given["mass"], found.gravity, law)]
        of = "" if law == VISCOELASTIC else f", and at other speeds that of the law {law}"
        opening, units = [f"A contact with eps = {found.epsilon:g} at {found.speed:g} m/s{of}"], SI
    else:
        wanted = [Wanted.of(contact, found.setup.weighty) for contact in found.setup.contacts]
        opening, units = found.setup.heading, found.setup.units
    return render_own_law(
        target,
        wanted,
        words,
        opening=opening,
        softness=softness,
        time_step=step,
        step_error=error,
        units=units,
    )


def _stiffness(target: str, given: Mapping[str, Any], has_mass: bool) -> dict[str, float]:
    """Return the wanted k, or k/m, under its name in `Softness`: a plain number is what the program's file has.

    Raises
    ------
    click.UsageError
        If a mass is missing that makes one of the other, or one is given that has no effect.
    """
    from viscopade import arguments, quantity
    from viscopade.simulators.simulator import OwnLaw

    program, text, mass = simulator_with(target), given["stiffness"], given["mass"]
    own = program.texts[target]
    assert isinstance(own, OwnLaw)
    k_unit = program.formula(own.formula).law.stiffness_unit
    units = {"stiffness": k_unit, "stiffness_over_mass": "1/s^2" if k_unit == "N/m" else f"{k_unit}/kg"}
    in_file = "stiffness_over_mass" if own.per_mass else "stiffness"
    found: dict[str, float] = {}
    if text is not None:
        try:
            found[in_file] = float(arguments.exact_number("--stiffness", text, "", lambda k: k > 0))
            if own.per_mass and mass is not None:
                raise click.UsageError(
                    f"--stiffness is {text}: a plain number is per mass ({units[in_file]}) and needs no mass; write "
                    f'"{text} {k_unit}"'
                )
        except ValueError:
            for name, unit in units.items():
                number = quantity.decimal_in(text, unit)
                if number is not None and number > 0:
                    found[name] = float(number)
            if not found:
                raise click.UsageError(
                    f'--stiffness is {text!r}: expected k, such as "1e5 {units["stiffness"]}", or k over the effective '
                    f'mass, such as "1e5 {units["stiffness_over_mass"]}"; a plain number is in {units[in_file]}'
                ) from None
        if in_file not in found and not has_mass:
            raise click.UsageError(f"{program.title} has the stiffness in {units[in_file]}: expected --mass with it")
    converted = any(given[name] is not None for name in ("stiffness", "contact_time", "penetration", "time_step"))
    if mass is not None and ("stiffness" not in found if own.per_mass else not converted):
        needs = (
            f'--stiffness, such as "1e5 {k_unit}"' if own.per_mass else "--contact-time, --penetration or --stiffness"
        )
        raise click.UsageError(f"--mass has no effect: expected {needs} with it")
    return found


COMMANDS = (simulators_command,)
