"""Commands that show eps against the impact speed: plot and table.

For viscoelastic spheres eps depends on v* = beta^(1/2) v^(1/10), with the impact speed v and a constant beta in
(s/m)^(1/5). Numbers in sentences have 4 to 6 figures (`.4g`), chosen by hand to be read.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from viscopade import arguments
from viscopade.cli.console import (
    ADHESION,
    GRAVITY,
    NO_FALL,
    SIZE,
    STYLE_OR_LATEX,
    TITLE,
    Command,
    Degrees,
    FilePath,
    Quantity,
    Real,
    Whole,
    check_units_of_beta,
    command_line,
    examples,
    limits_of,
    material,
    option,
    page_of,
    pair_with,
    picture_kind,
    say,
    say_below,
    show,
    typed_text,
    with_options,
)
from viscopade.cli.generate import read_scene
from viscopade.cli.writer import check_targets, write_all
from viscopade.extras import require

if TYPE_CHECKING:
    from viscopade.collision.spheres import Pair
    from viscopade.plots.speeds import SpeedCurve, Weight

# Digits of a number in a table, chosen by hand; those with which every double can be told from its neighbours; and
# those of an error, of which the size is enough. JSON has all.
_FIGURES, _OF_DOUBLES, _OF_ERRORS = 6, 17, 3
_EVEN = 11  # rows of a table with equal steps: ten steps; a choice
_MOST_ROWS = 10_000  # chosen by hand: more than anybody reads, and few enough for the memory
_DRAWN = 200  # points of a curve: 70 to an inch of the axis, closer than a line is wide (1.3 points, 55 to an inch)
# A point with weight or adhesion is an integration of about 20 ms, and a curve has fewer of them: 64 take 1.3 s. A
# table of such points may take up to 2 s a curve. Both are chosen by hand.
_DRAWN_WITH_WEIGHT = 64
_MOST_WITH_WEIGHT = 100


_CURVES = (
    click.argument("file", type=FilePath(), required=False),
    option("--from", "slowest", type=Quantity("speed"), help="Lowest speed.  [default: 0.001]"),
    option("--to", "fastest", type=Quantity("speed"), help="Highest speed.  [default: 10]"),
    option("--beta", help="Damping beta, such as '1.3 (s/cm)^(1/5)', instead of a material."),
    option("--epsilon", type=Real(), help="eps at --speed, instead of --beta or A."),
    option("--speed", type=Quantity("speed", " > 0"), help="Speed at which all curves have the same eps."),
    material("young_modulus", "poisson_ratio", "density", "dissipative_constant", "yield_strength"),
    option(
        "--law",
        "laws",
        group="Other laws",
        multiple=True,
        metavar="NAME|A,B",
        help="Add this law of contact; repeatable.",
    ),
    option(
        "--pade",
        "approximants",
        group="Other laws",
        type=Degrees(),
        multiple=True,
        help="Add this approximant; repeatable.",
    ),
    option(
        "--program",
        "programs",
        group="Other laws",
        multiple=True,
        help="Add this program of `viscopade audit`; repeatable.",
    ),
    GRAVITY,
    ADHESION,
)
"""The argument and the options of `_curves`."""
_SPEED_AXIS = option(
    "--speed-axis",
    group="Output",
    type=click.Choice(["logarithmic", "linear"]),
    default="logarithmic",
    show_default=True,
    help="Steps of the speeds, or of v*: of equal ratios, or of equal differences.",
)


@click.command(
    cls=Command, epilog=examples("viscopade plot --law linear --law tsuji --epsilon 0.8 --speed 1 -o laws.svg")
)
@with_options(*_CURVES)
@option("--data", type=FilePath(), help="Measured data to draw, as for `viscopade fit`.")
@_SPEED_AXIS
@option("--name", group="Output", help="Name of the first curve.  [default: viscoelastic, or exact, or of the scene]")
@TITLE
@SIZE
@option("-o", "--output", group="Output", required=True, type=FilePath(), help="File to write: .svg, .png or .pdf.")
def plot(
    file: Path | None,
    data: Path | None,
    speed_axis: str,
    name: str | None,
    title: str | None,
    size: tuple[float, float] | None,
    font_size: float | None,
    output: Path,
    **options: Any,
) -> None:
    """Draw eps against the impact speed.

    Give a scene as FILE, or a material, or --beta, or --epsilon with --speed. --law, --program and --pade add curves.
    At --speed (or at the scene's own speed) each law has the same eps, and each program is asked for this eps. Without
    spheres eps is drawn over v*, with each --pade. Quantities may have units, such as "1 cm/s"; plain numbers are in SI
    units. The axis has the unit of --from. `viscopade figures` draws the paper's figures.

    With --gravity the sphere falls on a wall (a material with --wall, or a scene), and its weight acts during the
    contact. eps is 0 where the sphere stays down, and --epsilon includes the weight. At --speed, contacts of --law and
    --program have the duration and the eps of the viscoelastic contact without weight.

    With --adhesion the surfaces of a material, or of a scene, adhere (JKR): eps falls to 0 at the sticking speed.
    """
    # Refuse at once what would be refused after the work: packages, and names of files.
    require("plot", "matplotlib", *(["scipy"] if data is not None else []))
    kind = picture_kind("--output", output)
    check_targets([output])
    import numpy as np

    from viscopade import quantity
    from viscopade.plots import sheet, speeds

    # The curves, and measured points (speed, eps) to draw over them.
    page = page_of(title, size, font_size)
    curves, ends, warnings, over_v_star, _ = _curves(file, **options)
    if name is not None:
        curves[0] = replace(curves[0], name=name)
    if over_v_star and data is not None:
        raise click.UsageError("--data needs spheres: expected a scene, a material, --beta, or --epsilon with --speed")
    points = None
    if data is not None:
        from viscopade import files
        from viscopade.fitting import read

        points = read.recording([(files.content(data, "CSV or a spreadsheet"), str(data))]).points

    # Draw them over v*, or over the impact speed, at points with equal ratios; on a linear axis half of them have equal
    # differences, and the others show how steeply eps falls at low speeds. Then warn where the model's limits are
    # exceeded at the highest speed.
    unit = _typed_unit() or "m/s"
    label = sheet.V_STAR if over_v_star else f"impact speed in {unit}"
    size_of_unit = 1.0 if over_v_star else float(quantity.si_decimal(f"1 {unit}", "speed") or 1)
    number = _DRAWN if options["gravity"] is options["adhesion"] is None else _DRAWN_WITH_WEIGHT
    linear = speed_axis == "linear"
    ratios, half = np.geomspace(*ends, number), number // 2
    drawn_speeds = np.union1d(np.geomspace(*ends, half), np.linspace(*ends, half)) if linear else ratios
    draw = partial(speeds.draw_speeds, curves, drawn_speeds, points, over=label, unit=size_of_unit, linear=linear)
    write_all({output: sheet.picture(draw, "eps against the impact speed", command_line(), kind, page)})
    say(f"wrote {output}")
    for text in warnings:
        say(f"Warning: {text}.")


@click.command("table", cls=Command, epilog=examples("viscopade table --from 0.1 --to 10"))
@with_options(*_CURVES)
@option(
    "--points",
    type=Whole(2, _MOST_ROWS),
    help=f"Number of speeds.  [default: three per decade, or {_EVEN} on a linear axis]",
)
@_SPEED_AXIS
@option(
    "--digits",
    group="Output",
    type=Whole(1, _OF_DOUBLES),
    default=_FIGURES,
    show_default=True,
    help="Significant digits; JSON has all.",
)
@STYLE_OR_LATEX
def table_command(points: int | None, speed_axis: str, digits: int, style: str, **options: Any) -> None:
    """Print eps against the impact speed, or against v*.

    The curves have the options of `viscopade plot`. For a material without --gravity and --adhesion the table also has
    the contact time and the maximal compression. All numbers are in SI units and in double precision. --pade also adds
    a column of the relative error, [m/n]/eps - 1. Here eps is that of the first spheres, and an error below 1e-28 is 0.
    """
    import numpy as np

    from viscopade.collision.adhesion import adhesive, sticking
    from viscopade.collision.weight import falling

    # Speeds with equal ratios, by default three a decade (such as 1, 2.2, 4.6, 10), which is coarse enough to read, or
    # with equal differences.
    curves, ends, warnings, over_v_star, pair = _curves(**options)
    work = options["adhesion"]
    if (work is not None or options["gravity"] is not None) and points is not None and points > _MOST_WITH_WEIGHT:
        with_option = "--gravity" if work is None else "--adhesion"
        raise ValueError(f"points is {points}: expected at most {_MOST_WITH_WEIGHT} with {with_option}")
    # log10 of the ratio of the ends is the number of decades.
    linear = speed_axis == "linear"
    default_number = _EVEN if linear else max(2, round(3 * float(np.log10(ends[1] / ends[0]))) + 1)
    speeds = (np.linspace if linear else np.geomspace)(*ends, default_number if points is None else points)

    # A column for each curve. Contact time and compression are those without weight and adhesion.
    key = "v_star" if over_v_star else "speed"
    columns: list[tuple[str, Any]] = [("v*" if over_v_star else "speed (m/s)", speeds)]
    columns += [("eps" if len(curves) == 1 else curve.name, curve.epsilon(speeds)) for curve in curves]
    errors = {f"error of {curve.name}": curve.error(speeds) for curve in curves if curve.error is not None}
    columns += errors.items()
    weight = options["gravity"] and float(options["gravity"])
    is_proven = not weight and work is None
    if pair is not None and is_proven:
        columns.append(("contact time (s)", pair.contact_time(speeds)))
        columns.append(("max compression (m)", pair.max_compression(speeds)))
    # In LaTeX all numbers of a column have equally many digits: # keeps the zeros at their end.
    kept = "#" * (style == "latex")
    texts = [
        [f"{number:{kept}.{_OF_ERRORS if name in errors else digits}g}".rstrip(".") for number in values]
        for name, values in columns
    ]
    rows = [*zip(*texts, strict=True)]

    # JSON also has A and beta of a material, and its warnings. NaN, of bodies that do not part (e != e), is null there.
    json_object: dict[str, Any] = {
        **({} if pair is None else {"A": pair.A, "beta": pair.beta}),
        key: speeds.tolist(),
        "curves": [
            {"name": curve.name, "epsilon": [e if e == e else None for e in values.tolist()]}
            | ({} if curve.error is None else {"error": errors[f"error of {curve.name}"].tolist()})
            for curve, (_, values) in zip(curves, columns[1:], strict=False)
        ],
    }
    if pair is not None and is_proven:
        json_object |= {"contact_time": columns[-2][1].tolist(), "max_compression": columns[-1][1].tolist()}
    if pair is not None or warnings:
        json_object["warnings"] = warnings

    # With adhesion, the speed below which the bodies stay together.
    sticking_speed = None
    if work is not None and pair is not None:
        contact = adhesive(pair, work, weight or 0.0)
        bond = sticking(lambda _: contact, ends[0])
        sticking_speed = bond and bond.speed
    if not is_proven:
        json_object |= {"gravity": weight, "adhesion": work, "sticking_speed": sticking_speed, "status": "sampled"}
    show(style, [name for name, _ in columns], rows, json_object)
    sentences = []
    if pair is not None:
        sentences.append(f"A = {pair.A:.{_FIGURES}g} s, beta = {pair.beta:.{_FIGURES}g} (s/m)^(1/5)")
    if sticking_speed is not None:
        sentences.append(f"With adhesion (sampled): below {sticking_speed:.4g} m/s the bodies stay together, eps = 0.")
    if weight and pair is not None and work is None:
        of_weight = falling(pair, ends[1], weight).sentences(*ends, user_set_gravity=True)
        sentences += [f"{sentence}." for sentence in of_weight]
    for sentence in [*sentences, *(f"Warning: {text}." for text in warnings)]:
        say_below(style, sentence)


class _Curves(NamedTuple):
    """Curves to draw or to print.

    Attributes
    ----------
    curves : list of SpeedCurve
        Each a name and a function from speeds (or v*) to eps.
    ends : (float, float)
        Lowest and highest speed in m/s, or v*.
    warnings : list of str
        Assumptions of the model that do not hold at the highest speed, and materials of a scene without damping.
    over_v_star : bool
        Whether the axis is v*.
    pair : Pair or None
        The bodies, if there is only one pair.
    """

    curves: list[SpeedCurve]
    ends: tuple[float, float]
    warnings: list[str]
    over_v_star: bool
    pair: Pair | None


class _Spheres(NamedTuple):
    """Viscoelastic spheres that the options describe.

    Attributes
    ----------
    named : list of (str, float or Pair)
        A name, and bodies or only their beta in (s/m)^(1/5).
    pair : Pair or None
        The bodies, if there is only one pair.
    ends : (float, float)
        Lowest and highest speed in m/s.
    typical_speed : float
        In m/s, between them.
    warnings : list of str
        Sentences on materials of a scene.
    """

    named: list[tuple[str, float | Pair]]
    pair: Pair | None
    ends: tuple[float, float]
    typical_speed: float
    warnings: Sequence[str] = ()


def _curves(
    file: Path | None,
    slowest: float | None,
    fastest: float | None,
    beta: str | None,
    epsilon: float | None,
    speed: float | None,
    laws: Sequence[str],
    approximants: Sequence[tuple[int, int]],
    programs: Sequence[str],
    gravity: float | None,
    adhesion: float | None,
    **body: Any,
) -> _Curves:
    """Return the curves that the options describe.

    Parameters
    ----------
    file : Path or None
        A scene.
    slowest, fastest : float or None
        Ends of the axis, in m/s (or v*); None for the default.
    beta : str or None
        A number, or one with its unit.
    epsilon, speed : float or None
        eps at a speed in m/s. At this speed (by default that of a scene) all laws and programs have the same eps.
    laws, approximants, programs : sequence
        Further curves: laws of contact, degrees (m, n), and programs of `viscopade audit`.
    gravity, adhesion : float or None
        Acceleration in m/s^2, and work of adhesion in J/m^2.
    **body : Any
        Options of a material, as for `pair_of`.

    Raises
    ------
    ValueError
        If the options do not describe spheres, a name is not known, or the speeds are not in order.
    """
    import numpy as np

    from viscopade.plots import speeds

    # No spheres: eps over v*, from 0.01, where 1 - eps is 1e-4, to 10, where eps is 6e-4.
    nothing = file is None and beta is None and epsilon is None and speed is None
    if nothing and all(value in (None, False, ()) for value in body.values()):
        if gravity is not None:
            raise click.UsageError(NO_FALL)
        if adhesion is not None:
            raise click.UsageError(_NO_SURFACES)
        if laws or programs:
            raise click.UsageError("--law and --program need spheres: expected --epsilon with --speed, or a material")
        if _typed_unit():
            raise click.UsageError("--from and --to are v*, which has no unit: expected plain numbers, or spheres")
        without_spheres = [speeds.over_v_star(), *(speeds.approximant(m, n, None) for m, n in approximants)]
        return _Curves(without_spheres, _ends(slowest, fastest, 0.01, 10.0), [], True, None)  # v*, as above
    spheres = _viscoelastic(file, beta, epsilon, speed, body, gravity)
    ends, pair = _ends(slowest, fastest, *spheres.ends), spheres.pair
    warnings = [] if pair is None else limits_of(pair, ends[1], body["yield_strength"], adhesion)
    warnings += spheres.warnings

    # Adhesion is that of one material or of a scene, and has no other law to compare with.
    if adhesion is not None:
        if laws or programs or approximants or epsilon is not None:
            other = "--law" if laws else "--program" if programs else "--pade" if approximants else "--epsilon"
            raise click.UsageError(f"{other} and --adhesion are given: expected one of them")
        for _, bodies in spheres.named:
            _weight(gravity, 1.0, bodies)  # refuses a gravity without a wall; the speed does not matter
        pairs = [(name, bodies) for name, bodies in spheres.named if not isinstance(bodies, float)]
        if len(pairs) < len(spheres.named):
            raise click.UsageError(_NO_SURFACES)
        curves = [speeds.adhesive_spheres(name, bodies, adhesion, gravity or 0.0) for name, bodies in pairs]
        return _Curves(curves, ends, warnings, False, pair)

    # The spheres, each with its weight, whose contact time is that at `same_eps_speed` or else at a typical speed.
    same_eps_speed = spheres.typical_speed if speed is None and file is not None else speed
    if (laws or programs) and same_eps_speed is None:
        raise click.UsageError("--law and --program need --speed, at which their eps is that of the spheres")
    weight_speed = spheres.typical_speed if same_eps_speed is None else same_eps_speed
    weights = [_weight(gravity, weight_speed, bodies) for _, bodies in spheres.named]
    betas = [bodies if isinstance(bodies, float) else float(bodies.beta) for _, bodies in spheres.named]
    rows = zip(spheres.named, betas, weights, strict=True)
    curves = [speeds.viscoelastic(name, beta_in_si, weight) for (name, _), beta_in_si, weight in rows]

    # Laws and programs have the eps of the first spheres at that speed.
    if same_eps_speed is not None:
        same_eps = float(speeds.viscoelastic("", betas[0]).epsilon(np.array([same_eps_speed]))[0])
        curves += [speeds.of_law(law, same_eps, same_eps_speed, weights[0]) for law in laws]
        for program in programs:
            curves += speeds.of_program(program, same_eps, same_eps_speed, weights[0])
    if approximants and gravity is not None:
        raise click.UsageError("--pade and --gravity are given: expected one of them")
    curves += [speeds.approximant(m, n, betas[0]) for m, n in approximants]
    if len(curves) > speeds.MOST:  # 24, a choice; 28 would have different looks
        raise ValueError(f"there are {len(curves)} curves: expected up to {speeds.MOST}")
    return _Curves(curves, ends, warnings, False, pair)


_NO_SURFACES = "--adhesion needs surfaces: expected a material with --dissipative-constant, or a scene"


def _typed_unit() -> str:
    """Return the unit in which --from is typed, or else --to; "" if both are plain numbers or not typed."""
    from viscopade import quantity

    return next(filter(None, (quantity.unit_of(typed_text(end) or "") for end in ("slowest", "fastest"))), "")


def _weight(gravity: float | None, speed: float, bodies: float | Pair) -> Weight | None:
    """Return the weight of the sphere of a curve: gravity in m/s^2, and the contact time at a speed in m/s.

    None without gravity. Only a sphere at a wall falls: two spheres, and a beta without bodies, are refused.
    """
    from viscopade.plots.speeds import Weight

    if gravity is None:
        return None
    if isinstance(bodies, float) or not bodies.second.is_wall:
        raise click.UsageError(NO_FALL)
    return Weight(gravity, speed, float(bodies.contact_time(speed)))


def _ends(slowest: float | None, fastest: float | None, low: float, high: float) -> tuple[float, float]:
    """Return the typed ends of the axis, in m/s (or v*); `low` and `high` stand for those that are not typed."""
    low = low if slowest is None else slowest
    high = high if fastest is None else fastest
    if not 0 < low < high:
        raise ValueError(f"--from is {low:g} and --to is {high:g}: expected 0 < --from < --to")
    return low, high


def _viscoelastic(
    file: Path | None,
    beta: str | None,
    epsilon: float | None,
    speed: float | None,
    body: dict[str, Any],
    gravity: float | None,
) -> _Spheres:
    """Return the spheres of a scene, a material, a beta, or an eps at a speed.

    Parameters
    ----------
    file : Path or None
        A scene.
    beta : str or None
        A number, or one with its unit.
    epsilon, speed : float or None
        eps at a speed in m/s.
    body : dict
        Options of a material by name, as for `pair_of`, in SI units.
    gravity : float or None
        Acceleration in m/s^2.

    Raises
    ------
    click.UsageError
        If the options describe no spheres, or more than one.
    """
    # Exactly one of four says the damping, and --speed alone belongs to an eps.
    constant = body.pop("dissipative_constant")
    has_body = bool(body["radii"]) or any(value not in (None, False, ()) for value in body.values())
    count = (file is not None) + (beta is not None) + (constant is not None) + (epsilon is not None)
    if count != 1 or (epsilon is None) == (speed is not None and file is None and beta is None and constant is None):
        raise click.UsageError(
            "the options do not describe spheres: expected a scene, or --beta, or --epsilon with --speed, or a "
            "material with either --dissipative-constant or --epsilon and --speed"
        )
    # Speeds of experiments, from 1 mm/s to 10 m/s (chosen by hand).
    ends, typical_speed = (1e-3, 10.0), 1.0
    if file is not None:
        if has_body:
            raise click.UsageError("a scene and a material are given: expected one of them")
        return _of_scene(file, gravity is not None)
    if beta is not None:
        if has_body:
            raise click.UsageError("--beta and a material are given: expected one of them")
        check_units_of_beta(beta, speed="--speed", slowest="--from", fastest="--to")
        return _Spheres([("viscoelastic", _in_si(beta))], None, ends, typical_speed)
    if not has_body:
        if epsilon is None:
            raise click.UsageError("--dissipative-constant needs a material: expected its radius, density, …")
        assert speed is not None
        from viscopade.plots import speeds

        return _Spheres([("viscoelastic", speeds.beta_of(epsilon, speed))], None, ends, typical_speed)
    pair = pair_with(epsilon, speed or 0.0, gravity, dissipative_constant=constant, **body)
    return _Spheres([("viscoelastic", pair)], pair, ends, typical_speed)


def _of_scene(file: Path, falling: bool) -> _Spheres:
    """Return the pairs of bodies that meet in the scene of a file; `falling`: those of a sphere and a wall, if any."""
    from viscopade.scene.model_limits import undamped

    scene = read_scene(file)
    meetings = [(meeting, scene.pair(meeting)) for meeting in scene.meetings]
    if falling:
        meetings = [(meeting, pair) for meeting, pair in meetings if pair.second.is_wall] or meetings
    # The axis has the speeds of all meetings. A scene with one speed gets a decade on either side (by hand).
    speeds = [meeting.speeds for meeting, _ in meetings]
    slowest, fastest = min(speed.slowest for speed in speeds), max(speed.fastest for speed in speeds)
    if slowest == fastest:
        slowest, fastest = slowest / 10, fastest * 10
    # The typical speed is that of the first meeting, at which its material's eps is known if the scene says an eps.
    typical_speed = meetings[0][0].known_at or speeds[0].typical
    only_pair = meetings[0][1] if len(meetings) == 1 else None
    named: list[tuple[str, float | Pair]] = [(meeting.name, pair) for meeting, pair in meetings]
    sentences = [text for meeting, _ in meetings for text in undamped(scene, meeting)]
    return _Spheres(named, only_pair, (slowest, fastest), typical_speed, sentences)


def _in_si(beta: str) -> float:
    """Return a typed beta in (s/m)^(1/5); a plain number is in this unit."""
    from viscopade import quantity

    # The number, its unit, and the speed of 1 in the unit's lengths and times, in m/s: 0.01 for (s/cm)^(1/5).
    parts = quantity.beta_decimal(beta)
    if parts is None:  # below 1e300 a number is a finite double
        accepted = 'a number >= 0 in (s/m)^(1/5), or one with its unit, such as "1.3 (s/cm)^(1/5)"'
        return float(arguments.exact_number("beta", beta, accepted, lambda b: 0 <= b < 10**300))
    # 1 (s/cm)^(1/5) = (0.01 m/s)^(-1/5): the exponent 1/5 is that of beta's unit.
    number, _, scale = parts
    return float(number) / math.pow(float(scale), 0.2)


COMMANDS = (plot, table_command)
