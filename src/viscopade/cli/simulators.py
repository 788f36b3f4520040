"""Commands for other programs: their contact parameters (simulators), and cases to verify them (verification)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from viscopade.cli.console import (
    OUTPUT,
    OneOf,
    Quantity,
    Real,
    command_line,
    deliver,
    double,
    examples,
    limits_of,
    material,
    pair_of,
    say,
)
from viscopade.cli.generate import read_scene
from viscopade.cli.writer import write_all
from viscopade.kernels.catalogue import TIERS
from viscopade.simulators import SIMULATORS, TARGETS, simulator_with

if TYPE_CHECKING:
    from viscopade.scene.description import Scene
    from viscopade.simulators.setup import Setup

_SOFT = ("law", "stiffness", "contact_time", "penetration", "mass", "time_step", "step_error")
"""Options of programs whose contacts have a law of their own."""
_LONG = 10  # s, of a contact
_AUDITED = {name: f"viscopade audit {name}" for name, own in SIMULATORS.items() if not own}


class SpeedRange(click.ParamType):  # type: ignore[type-arg]
    """Type of an option: two speeds, such as "1:20 cm/s"."""

    name = "MIN:MAX"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[str, str]:
        """Parse two speeds; the unit of the second is that of the first, too, if that has none."""
        speed = Quantity("speeds", "speed")
        first, colon, second = value.partition(":")
        unit = second.lstrip("+-.0123456789eE ")
        if not colon:
            self.fail(f'speeds is {value!r}: expected a slowest and a fastest speed, such as "1:20 cm/s"')
        if first.strip(" +-.0123456789eE") == "" and unit:
            first += f" {unit}"
        return speed.convert(first.strip(), param, ctx), speed.convert(second.strip(), param, ctx)


@click.command(
    "simulators",
    epilog=examples(
        'viscopade simulators lammps --epsilon 0.9 --speed "1 m/s" --radius "1 cm" \\\n'
        "    --density 2500 --young-modulus 1e7 --poisson-ratio 0.3"
    ),
)
@click.argument("target", type=OneOf(TARGETS, _AUDITED))
@click.argument("file", type=click.Path(path_type=Path), required=False)
@click.option("--epsilon", type=Real("epsilon"), help="Wanted eps at --speed, instead of a scene or A.")
@click.option("--speed", type=Quantity("speed", "speed"), help="Impact speed, instead of a scene.")
@click.option("--law", metavar="NAME|A,B", help="Law of contact that has eps at --speed.  [default: viscoelastic]")
@click.option("--speeds", type=SpeedRange(), help="Slowest and fastest impact: the text states the error of eps there.")
@material("young_modulus", "poisson_ratio", "density", "dissipative_constant", "yield_strength")
@click.option("--stiffness", type=Real("stiffness"), help="Stiffness of a contact, in SI units; for MuJoCo per mass.")
@click.option("--contact-time", type=Quantity("contact-time", "time"), help="Duration of a contact at --speed.")
@click.option("--penetration", type=Quantity("penetration", "length"), help="Penetration in the fastest impact.")
@click.option("--mass", type=Quantity("mass", "mass"), help="Effective mass, m1 m2/(m1 + m2).")
@click.option("--time-step", type=Quantity("time-step", "time"), help="Time step for which the damping makes up.")
@click.option("--step-error", type=Real("step-error"), help="Error of eps, for the longest time step.  [default: 0.01]")
@click.option(
    "--gravity", type=Quantity("gravity", "acceleration"), help="eps is that of a body that falls on a plane."
)
@click.option("--tier", type=click.Choice(TIERS), help="Accuracy of the kernel for REBOUND.  [default: 1e-5]")
@OUTPUT
def simulators_command(target: str, file: Path | None, tier: str | None, output: Path | None, **options: Any) -> None:
    """Print the contact parameters of a simulation program.

    LAMMPS, REBOUND (C or Python), MercuryDPM, YADE and LIGGGHTS get the viscoelastic law, or what is nearest to it.
    Give either a scene as FILE, or a material and --speed with either eps or A.

    MuJoCo, Drake, Simbody (OpenSim), Chrono and JaxDEM have contacts of their own, whose damping is exact at one speed.
    Give a scene or a material, too, or just --epsilon and --speed. --stiffness, --contact-time or --penetration sets
    how soft contacts are; without them they last as long as the viscoelastic ones. --law names the law that your data
    follow; `viscopade fit` prints its name.

    With --gravity a body that falls on a plane gets eps at --speed: its weight presses it down during the contact, and
    it loses more. The direction of impact is normal to the plane. Between two spheres that fall there is no weight.

    Quantities may have units, such as "10 cm/s"; plain numbers are in SI units.
    """
    from viscopade.simulators.simulator import OwnLaw
    from viscopade.simulators.text import render

    words = command_line()
    soft = {name: options.pop(name) for name in _SOFT}
    of_soft = [each for each in TARGETS if isinstance(simulator_with(each).texts[each], OwnLaw)]
    if target not in of_soft and any(value is not None for value in soft.values()):
        flag = next(name for name, value in soft.items() if value is not None)
        raise click.UsageError(f"--{flag.replace('_', '-')} is given for {target}: expected {', '.join(of_soft)}")
    if tier is not None and not target.startswith("rebound"):
        raise click.UsageError(
            f"--tier is given for {target}, which computes the force: expected rebound-c or rebound-python"
        )
    gravity = options.pop("gravity")
    found = _given(file, None if gravity is None else double("gravity", gravity), **options)
    if target in of_soft:
        text = _soft_text(target, found, words, soft)
    elif found.setup is not None:
        text = render(target, found.setup, words, **({} if tier is None else {"tier": tier}))
    else:
        raise click.UsageError(
            f"{target} needs a material: expected a scene, or --radius, --density, --young-modulus and --poisson-ratio"
        )
    deliver(text, output)


@dataclass(frozen=True)
class _Given:
    """The collisions that the options describe: a setup, or eps at a speed between bodies of which no more is known."""

    setup: Setup | None
    scene: Scene | None = None
    epsilon: float | None = None
    speed: float = 1.0
    speeds: tuple[float, float] | None = None
    gravity: float | None = None


def _given(
    file: Path | None,
    gravity: float | None,
    epsilon: float | None,
    speed: str | None,
    speeds: tuple[str, str] | None,
    yield_strength: str | None,
    **options: Any,
) -> _Given:
    from viscopade.scene.sense import setup

    if gravity is not None and not gravity > 0:
        raise ValueError(f"gravity is {gravity:g}: expected a number > 0")
    constant = options["dissipative_constant"]
    without = {name: value for name, value in options.items() if name != "dissipative_constant"}
    has_material = bool(without["radii"]) or any(value not in (None, False, ()) for value in without.values())
    if file is not None:
        if has_material or any(value is not None for value in (epsilon, speed, speeds, constant, yield_strength)):
            raise click.UsageError(
                "a scene and a material are given: expected either a scene or a material with --speed"
            )
        scene = read_scene(file)
        return _Given(setup(scene, gravity), scene)
    if (epsilon is None) == (constant is None):
        given = "neither" if constant is None else "both"
        raise click.UsageError(
            f"--epsilon and --dissipative-constant: {given} given, expected a scene, or a material with --speed and "
            "exactly one of them"
        )
    if speed is None:
        raise click.UsageError("a material also needs --speed, the impact speed that matters")
    v = double("speed", speed)
    ends = None if speeds is None else (double("speeds", speeds[0]), double("speeds", speeds[1]))
    if ends is not None and not 0 < ends[0] <= v <= ends[1]:
        raise ValueError(f"speeds are {ends[0]:g} and {ends[1]:g} m/s: expected 0 < MIN <= {v:g} <= MAX")
    if not has_material and constant is None and yield_strength is None:
        return _Given(None, None, epsilon, v, ends, gravity)
    return _Given(_setup_of_material(epsilon, v, ends, yield_strength, gravity, options))


def _setup_of_material(
    epsilon: float | None,
    speed: float,
    speeds: tuple[float, float] | None,
    yield_strength: str | None,
    gravity: float | None,
    options: dict[str, Any],
) -> Setup:
    """Return one pair of bodies with the given A, or with the A that gives eps, with gravity to a body that falls."""
    from viscopade.collision.weight import calibrated
    from viscopade.simulators.setup import of_pair

    constant = options["dissipative_constant"]
    pair = pair_of(**options | {"dissipative_constant": 0.0 if constant is None else constant})
    assert pair is not None  # some of its options are given
    if gravity is not None and not pair.second.is_wall:
        raise click.UsageError("--gravity needs a sphere and a plane: expected --wall")
    if epsilon is not None:
        pair = pair.calibrated(speed, epsilon) if gravity is None else calibrated(pair, speed, epsilon, gravity)
    fastest = speed if speeds is None else speeds[1]
    return of_pair(pair, speed, speeds, tuple(limits_of(pair, fastest, yield_strength)), gravity)


def _soft_text(target: str, found: _Given, words: str, soft: dict[str, Any]) -> str:
    from viscopade.scene.units import Scale
    from viscopade.simulators.setup import SI
    from viscopade.simulators.soft import STEP_ERROR, Softness, Wanted
    from viscopade.simulators.text import render_own_law
    from viscopade.theory.law import VISCOELASTIC, law_of

    law = VISCOELASTIC if soft["law"] is None else law_of(soft["law"])
    if soft["law"] is not None and found.epsilon is None:
        raise click.UsageError(
            "--law and a scene or a material are given: expected --law with --epsilon and --speed alone"
        )
    time, length, step, mass = (
        None if soft[name] is None else double(name, soft[name])
        for name in ("contact_time", "penetration", "time_step", "mass")
    )
    for name, value in (("mass", mass), ("time-step", step)):
        if value is not None and value <= 0:
            raise ValueError(f"{name} is {value:g}: expected a number > 0")
    error = STEP_ERROR if soft["step_error"] is None else soft["step_error"]
    if not 1e-8 <= error <= 1:
        raise ValueError(f"step-error is {error:.4g}: expected 1e-08 to 1")
    scale = Scale() if found.scene is None else found.scene.scale
    if soft["stiffness"] is not None and found.setup is not None and found.setup.units != SI:
        raise click.UsageError(
            "--stiffness is in SI units and the scene is not: expected --contact-time or --penetration"
        )
    time, length, step = (
        None if value is None else value / unit
        for value, unit in ((time, scale.time), (length, scale.length), (step, scale.time))
    )
    if soft["contact_time"] is not None and double("contact-time", soft["contact_time"]) > _LONG:
        click.echo(f"Warning: contact-time is {float(soft['contact_time']):g} s: is a unit missing?", err=True)
    softness = Softness(soft["stiffness"], time, length)
    if found.setup is None:
        assert found.epsilon is not None
        wanted = [Wanted.at(found.epsilon, found.speed, found.speeds, mass, found.gravity, law)]
        of = "" if law == VISCOELASTIC else f", and at other speeds that of the law {law}"
        opening, units = [f"A contact with eps = {found.epsilon:g} at {found.speed:g} m/s{of}"], SI
    else:
        if mass is not None:
            raise click.UsageError("--mass and bodies with masses are given: expected one of them")
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


@click.command(epilog=examples("viscopade verification lammps --out lammps_cases"))
@click.argument("program", type=OneOf(["lammps"]))
@click.option("--out", required=True, type=click.Path(path_type=Path), help="Directory to write the cases to.")
def verification(program: str, out: Path) -> None:
    """Write collisions with known results, to verify a program.

    Two spheres collide with viscoelastic damping. The expected eps, peak overlap and contact time are exact, and the
    tolerances are those of the time step. Further cases are a sphere that falls on a plane, with its weight, and one
    that slides over it. For LAMMPS the cases are YAML files in the form of its granular unit tests, and inputs; one
    JSON file has them for any program.
    """
    from viscopade.simulators.verification import verification_files

    texts = verification_files(command_line())
    write_all({out / name: text for name, text in texts.items()}, parents=True)
    say(f"wrote {len(texts)} files to {out}")


COMMANDS = (simulators_command, verification)
