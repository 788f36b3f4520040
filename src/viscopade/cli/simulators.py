"""Command for the contact parameters of other programs.

    viscopade simulators lammps --epsilon 0.9 --speed "1 m/s" --radius "1 cm" --density 2500 --young-modulus 1e7 …
    viscopade simulators mujoco --epsilon 0.8 --speed "1 m/s" --contact-time "20 ms"

Programs of the first kind compute the viscoelastic law; those of the second have a law of their own, `OwnLaw`, whose
damping is set for one speed.
"""

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
    Command,
    FilePath,
    OneOf,
    Quantity,
    Real,
    command_line,
    examples,
    limits_of,
    material,
    option,
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
_LONG = 10  # s; a longer contact time probably lacks its unit. Chosen by hand; it only decides on a warning
_AUDITED = {
    name: f"there is no file for {name}; viscopade audit {name} prints the number to write"
    for name, targets in SIMULATORS.items()
    if not targets
}
"""The sentence for each program whose parameters are audited, but not written."""


class SpeedRange(click.ParamType):  # type: ignore[type-arg]
    """Type of an option: two speeds, such as "1:20 cm/s"."""

    name = "MIN:MAX"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[float, float]:
        """Return two speeds in m/s; the first may have no unit, and then has the unit of the second.

        `value` is the typed text, "1:20 cm/s"; Click also passes the option `param` and the running command `ctx`.
        """
        first, colon, second = value.partition(":")
        if not colon:
            raise ValueError(f'--speeds is {value!r}: expected the lowest and the highest speed, such as "1:20 cm/s"')
        # The unit is what follows the characters of a number; no unit of a speed begins with "e".
        unit = second.lstrip("+-.0123456789eE ")
        if first.strip(" +-.0123456789eE") == "" and unit:
            first += f" {unit}"
        low, high = (float(Quantity("speed").decimal(text.strip(), "--speeds")) for text in (first, second))
        return low, high


# The defaults in the help are choices: 20 time steps in a contact of unknown duration, a relative error of eps of 0.01
# for the longest time step, and the kernel with an error of 1e-5 in REBOUND.
@click.command(
    "simulators",
    cls=Command,
    epilog=examples(
        'viscopade simulators lammps --epsilon 0.9 --speed "1 m/s" --radius "1 cm" \\\n'
        "    --density 2500 --young-modulus 1e7 --poisson-ratio 0.3"
    ),
)
@click.argument("target", metavar="PROGRAM", type=OneOf(TARGETS, _AUDITED))
@click.argument("file", type=FilePath(), required=False)
@option("--epsilon", type=Real(), help="Goal eps at --speed, instead of a scene or A.")
@option("--speed", type=Quantity("speed"), help="Impact speed, instead of a scene.")
@option(
    "--law",
    group="Other laws",
    metavar="NAME|A,B",
    help="Law of contact with that eps at --speed.  [default: viscoelastic]",
)
@option(
    "--speeds", group="Output", type=SpeedRange(), help="Range of speeds, for which the file states the error of eps."
)
@material("young_modulus", "poisson_ratio", "density", "dissipative_constant", "yield_strength")
@option("--stiffness", help="Stiffness k, such as '1e5 N/m', or k/m, such as '1e5 1/s^2'.")
@option("--contact-time", type=Quantity("time"), help="Duration of a contact at --speed.")
@option("--penetration", group="Advanced", type=Quantity("length"), help="Penetration in the fastest impact.")
@EFFECTIVE_MASS
@option("--time-step", type=Quantity("time", " > 0"), help="Time step, whose error the damping compensates.")
@option(
    "--step-error",
    group="Advanced",
    type=Real(),
    help="Relative error of eps for the longest time step.  [default: 0.01]",
)
@GRAVITY
@option("--tier", group="Output", type=click.Choice(TIERS), help="Accuracy of the kernel in REBOUND.  [default: 1e-5]")
@OUTPUT
def simulators_command(target: str, file: Path | None, tier: str | None, output: Path | None, **options: Any) -> None:
    """Print the contact parameters of a simulation program.

    PROGRAM is one of the following. lammps, rebound-c, rebound-python, mercurydpm, yade and liggghts compute the
    viscoelastic law, or the nearest law that they have. Give either a scene as FILE, or a material, --speed, and either
    --epsilon or A.

    mujoco, drake, simbody (OpenSim), chrono and jaxdem have their own laws of contact, whose damping is exact at one
    speed. Give a scene, a material, or only --epsilon and --speed. --stiffness, --contact-time or --penetration sets
    the stiffness; the default is the contact time of the viscoelastic spheres, or else 20 time steps. A plain
    --stiffness is the number in the file. For MuJoCo this number is a stiffness over the effective mass. --law names
    the law that your data follow; `viscopade fit` prints this name.

    With --gravity a body that falls on a plane has the wanted eps and contact time. During the contact the weight
    presses this body against the plane, and the body loses more energy. Two spheres that fall together have no weight
    in their frame.

    Quantities may have units, such as "10 cm/s"; plain numbers are in SI units.
    """
    # `target` is the program, `file` a scene. Refuse options that only other programs have.
    words = command_line()
    of_own_law = {name: options.pop(name) for name in _OF_OWN_LAW}
    if target not in OWN_LAW and any(value is not None for value in of_own_law.values()):
        flag = next(name for name, value in of_own_law.items() if value is not None)
        raise click.UsageError(f"--{flag.replace('_', '-')} is given for {target}: expected {', '.join(OWN_LAW)}")
    if tier is not None and not target.startswith("rebound"):
        raise click.UsageError(
            f"--tier is given for {target}, which computes the force: expected rebound-c or rebound-python"
        )
    # Programs with a law of their own need only eps at a speed; the others need bodies. TYPED are the programs whose
    # files give parameters to types of particles: a distribution of sizes becomes some classes there.
    collisions = _read_collisions(file, options.pop("gravity") or None, classes=target in TYPED, **options)
    if target in OWN_LAW:
        text = _own_law_text(target, collisions, words, of_own_law)
    elif collisions.setup is not None:
        from viscopade.simulators.input_file import render

        text = render(target, collisions.setup, words, **({} if tier is None else {"tier": tier}))
    else:
        raise click.UsageError(
            f"{target} needs a material: expected a scene, or --radius, --density, --young-modulus and --poisson-ratio"
        )
    write_or_print(text, output)


@dataclass(frozen=True)
class _Collisions:
    """The collisions that the options describe: bodies of a scene or a material, or only an eps at a speed.

    Attributes
    ----------
    setup : Setup or None
        Materials, bodies and speeds; None if there is only an eps.
    scene : Scene or None
        Where the setup comes from, unless it is a material.
    epsilon : float or None
        The wanted eps without bodies, at `speed` (m/s); `speeds` are the lowest and the highest, in m/s.
    gravity : float or None
        Acceleration in m/s^2 of a body that falls on a plane.
    """

    setup: Setup | None
    scene: Scene | None = None
    epsilon: float | None = None
    speed: float = 1.0
    speeds: tuple[float, float] | None = None
    gravity: float | None = None


def _read_collisions(
    file: Path | None,
    gravity: float | None,
    classes: bool,
    epsilon: float | None,
    speed: float | None,
    speeds: tuple[float, float] | None,
    yield_strength: float | None,
    **options: Any,
) -> _Collisions:
    """Return the collisions that the options describe.

    Parameters
    ----------
    file : Path or None
        A scene.
    gravity : float or None
        Acceleration in m/s^2; None without weight.
    classes : bool
        Whether each class of sizes becomes a body of its own, as in programs with types of particles.
    epsilon, speed, speeds
        The wanted eps, the speed at which it holds, and the range of speeds, in m/s.
    yield_strength : float or None
        Of the material, in Pa, for a warning.
    **options : Any
        Further options of a material, as for `pair_of`.

    Raises
    ------
    click.UsageError, ValueError
        If options are missing or do not belong together.
    """
    from viscopade.scene.model_limits import setup

    # A scene has materials, bodies and speeds: no other option may say them.

    constant = options["dissipative_constant"]
    of_bodies = {name: value for name, value in options.items() if name != "dissipative_constant"}
    has_material = bool(of_bodies["radii"]) or any(value not in (None, False, ()) for value in of_bodies.values())
    if file is not None:
        if has_material or any(value is not None for value in (epsilon, speed, speeds, constant, yield_strength)):
            raise click.UsageError(
                "a scene and a material are given: expected either a scene or a material with --speed"
            )
        scene = read_scene(file)
        return _Collisions(setup(scene, gravity, classes=classes), scene)

    # Without a scene the damping is an eps at a speed, or the A of a material.
    if (epsilon is None) == (constant is None):
        which = "neither" if constant is None else "both"
        raise click.UsageError(
            f"--epsilon and --dissipative-constant: {which} given, expected a scene, or a material with --speed and "
            "exactly one of them"
        )
    if speed is None:
        raise click.UsageError("a material also needs --speed, the impact speed that matters")
    if speeds is not None and not 0 < speeds[0] <= speed <= speeds[1]:
        raise ValueError(f"--speeds is {speeds[0]:g}:{speeds[1]:g} m/s: expected 0 < MIN <= {speed:g} <= MAX")
    if not has_material and constant is None and yield_strength is None:
        return _Collisions(None, None, epsilon, speed, speeds, gravity)

    # A material: one pair of bodies with this A, or with the A that gives eps at the speed, and sentences on the limits
    # of the model in the fastest impact.
    from viscopade.simulators.setup import pair_setup

    pair = pair_with(epsilon, speed, gravity, **options)
    fastest = speed if speeds is None else speeds[1]
    return _Collisions(pair_setup(pair, speed, speeds, tuple(limits_of(pair, fastest, yield_strength)), gravity))


def _own_law_text(target: str, collisions: _Collisions, words: str, options: dict[str, Any]) -> str:
    """Return the text for a program whose contacts have a law of their own.

    Parameters
    ----------
    target : str
        The program.
    collisions : _Collisions
        Bodies, or an eps at a speed.
    words : str
        The command line, for the head of the file.
    options : dict
        Values of `_OF_OWN_LAW` by name, in SI units (the stiffness as a text); None for those that are not typed.

    Raises
    ------
    click.UsageError, ValueError
        If options do not belong together, or have no effect.
    """
    from viscopade.scene.units import Scale
    from viscopade.simulators.own_law import STEP_ERROR, Goal, Softness, render_own_law
    from viscopade.simulators.setup import SI
    from viscopade.simulators.simulator import OwnLaw
    from viscopade.theory.law import VISCOELASTIC, law_of

    # Refuse options that contradict each other. `text_writer` says in which terms the program's file has its numbers.
    law = VISCOELASTIC if options["law"] is None else law_of(options["law"])
    if options["law"] is not None and collisions.epsilon is None:
        raise click.UsageError(
            "--law and a scene or a material are given: expected --law with --epsilon and --speed alone"
        )
    error = STEP_ERROR if options["step_error"] is None else options["step_error"]
    if options["step_error"] is not None and options["time_step"] is not None:
        raise click.UsageError("--step-error has no effect with --time-step: expected one of them")
    text_writer = simulator_with(target).texts[target]
    assert isinstance(text_writer, OwnLaw)
    if options["step_error"] is not None and simulator_with(target).formula(text_writer.formula).scheme is None:
        raise click.UsageError(f"--step-error has no effect for {target}, which chooses its own steps: leave it out")
    # 1e-8 as in `viscopade audit`: chosen by hand, it asks for about 1e8 steps in a contact, more than any user has.
    if not 1e-8 <= error <= 1:
        raise ValueError(f"--step-error is {error:.4g}: expected 1e-08 to 1")
    if options["mass"] is not None and collisions.setup is not None:
        raise click.UsageError("--mass and bodies with masses are given: expected one of them")
    scale = Scale() if collisions.scene is None else collisions.scene.scale
    if options["stiffness"] is not None and collisions.setup is not None and collisions.setup.units != SI:
        raise click.UsageError(
            "--stiffness is in SI units and the scene is not: expected --contact-time or --penetration"
        )

    # Times and lengths in the units of the scene, SI without one.
    time, length, step = (
        None if value is None else value / unit
        for value, unit in (
            (options["contact_time"], scale.time),
            (options["penetration"], scale.length),
            (options["time_step"], scale.time),
        )
    )
    if (options["contact_time"] or 0) > _LONG:
        click.echo(f"Warning: contact-time is {options['contact_time']:g} s: is a unit missing?", err=True)

    # How soft contacts are: by a stiffness, a contact time or a penetration. A step for an error needs the duration,
    # which neither nothing nor a stiffness without a mass says.
    stiffness = _stiffness(target, options, collisions.setup is not None or options["mass"] is not None)
    softness = Softness(**stiffness, contact_time=time, penetration=length)
    unknown = softness == Softness() or (softness.stiffness is not None and options["mass"] is None)
    if options["step_error"] is not None and collisions.setup is None and unknown:
        raise click.UsageError(
            "--step-error has no effect, as nothing says how long contact lasts: expected --contact-time with it"
        )

    # The eps that each contact is to have, and the first lines of the file.
    if collisions.setup is None:
        assert collisions.epsilon is not None
        targets = [
            Goal.from_epsilon(
                collisions.epsilon, collisions.speed, collisions.speeds, options["mass"], collisions.gravity, law
            )
        ]
        elsewhere = "" if law == VISCOELASTIC else f", and at other speeds that of the law {law}"
        opening = [f"A contact with eps = {collisions.epsilon:g} at {collisions.speed:g} m/s{elsewhere}"]
        units = SI
    else:
        targets = [Goal.from_contact(contact, collisions.setup.weighty) for contact in collisions.setup.contacts]
        opening, units = collisions.setup.heading, collisions.setup.units
    return render_own_law(
        target,
        targets,
        words,
        opening=opening,
        softness=softness,
        time_step=step,
        step_error=error,
        units=units,
    )


def _stiffness(target: str, options: Mapping[str, Any], has_mass: bool) -> dict[str, float]:
    """Return the wanted k, or k/m, under its name in `Softness`: a plain number is what the program's file has.

    It is empty without --stiffness. `target` is the program, `options` as for `_own_law_text`, and `has_mass` says
    whether a mass is known, with which k and k/m follow from each other.

    Raises
    ------
    click.UsageError
        If a mass is missing that makes one of the other, or one is given that has no effect.
    """
    from viscopade import arguments, quantity
    from viscopade.simulators.simulator import OwnLaw

    # The units of k in the program's law, such as N/m^(3/2), and of k/m; N/m over kg is 1/s^2.
    program, text, mass = simulator_with(target), options["stiffness"], options["mass"]
    text_writer = program.texts[target]
    assert isinstance(text_writer, OwnLaw)
    k_unit = program.formula(text_writer.formula).law.stiffness_unit
    units = {"stiffness": k_unit, "stiffness_over_mass": "1/s^2" if k_unit == "N/m" else f"{k_unit}/kg"}
    in_file = "stiffness_over_mass" if text_writer.per_mass else "stiffness"
    number_by_name: dict[str, float] = {}
    if text is not None:
        # A plain number, or one with the unit of k or of k/m: a text fits one of them at most.
        try:
            number_by_name[in_file] = float(arguments.exact_number("--stiffness", text, "", lambda k: k > 0))
            if text_writer.per_mass and mass is not None:
                raise click.UsageError(
                    f"--stiffness is {text}: a plain number is per mass ({units[in_file]}) and needs no mass; write "
                    f'"{text} {k_unit}"'
                )
        except ValueError:
            for name, unit in units.items():
                number = quantity.decimal_in(text, unit)
                if number is not None and number > 0:
                    number_by_name[name] = float(number)
            if not number_by_name:
                raise click.UsageError(
                    f'--stiffness is {text!r}: expected k, such as "1e5 {units["stiffness"]}", or k over the effective '
                    f'mass, such as "1e5 {units["stiffness_over_mass"]}"; a plain number is in {units[in_file]}'
                ) from None
        if in_file not in number_by_name and not has_mass:
            raise click.UsageError(f"{program.title} has the stiffness in {units[in_file]}: expected --mass with it")

    # A mass has an effect only if something is converted with it.
    converted = any(options[name] is not None for name in ("stiffness", "contact_time", "penetration", "time_step"))
    per_mass = text_writer.per_mass
    if mass is not None and ("stiffness" not in number_by_name if per_mass else not converted):
        needs = f'--stiffness, such as "1e5 {k_unit}"' if per_mass else "--contact-time, --penetration or --stiffness"
        raise click.UsageError(f"--mass has no effect: expected {needs} with it")
    return number_by_name


COMMANDS = (simulators_command,)
