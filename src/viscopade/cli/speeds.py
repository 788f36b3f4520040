"""Commands that show eps against the impact speed: plot and table."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from viscopade import arguments
from viscopade.cli.console import (
    ADHESION,
    GRAVITY,
    NO_FALL,
    STYLE,
    Degrees,
    FilePath,
    Quantity,
    Real,
    Whole,
    command_line,
    examples,
    limits_of,
    material,
    pair_with,
    picture_kind,
    say,
    show,
    with_options,
)
from viscopade.cli.generate import read_scene
from viscopade.cli.writer import check_targets, write_all
from viscopade.extras import require

if TYPE_CHECKING:
    from viscopade.collision.spheres import Pair
    from viscopade.plots.speeds import SpeedCurve, Weight

_FIGURES = 6  # of a number in a table
_MOST_ROWS = 10_000
_INCH, _LETTERS = 0.0254, 7.5  # m; points
_DRAWN = 160  # points of a curve
_DRAWN_WITH_WEIGHT = 64  # each takes about 20 ms
_MOST_WITH_WEIGHT = 100


class _Length(Quantity):
    """Type of an option that takes two lengths: what begins with a minus is the next option."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Parse a length."""
        if str(value).startswith("-"):
            raise click.UsageError("--size needs two lengths, such as '8.6 cm' '6 cm'")
        return super().convert(value, param, ctx)


_CURVES = (
    click.argument("file", type=FilePath(), required=False),
    click.option("--from", "slowest", type=Quantity("speed"), help="Lowest speed.  [default: 0.001]"),
    click.option("--to", "fastest", type=Quantity("speed"), help="Highest speed.  [default: 10]"),
    click.option("--beta", help="Damping beta, such as '1.3 (s/cm)^(1/5)', instead of a material."),
    click.option("--epsilon", type=Real(), help="eps at --speed, instead of --beta or A."),
    click.option("--speed", type=Quantity("speed", " > 0"), help="Speed at which all curves have the same eps."),
    material("young_modulus", "poisson_ratio", "density", "dissipative_constant", "yield_strength"),
    click.option("--law", "laws", multiple=True, metavar="NAME|A,B", help="Add this law of contact; repeatable."),
    click.option("--pade", "approximants", type=Degrees(), multiple=True, help="Add this approximant; repeatable."),
    click.option("--program", "programs", multiple=True, help="Add this program of `viscopade audit`; repeatable."),
    GRAVITY,
    ADHESION,
)
"""The argument and the options of `_curves`."""


@click.command(epilog=examples("viscopade plot --law linear --law tsuji --epsilon 0.8 --speed 1 -o laws.svg"))
@with_options(*_CURVES)
@click.option("--data", type=FilePath(), help="Measured data to draw, as for `viscopade fit`.")
@click.option("--title", help="Title above the picture.")
@click.option("--size", type=_Length("length"), nargs=2, help="Width and height, such as '8.6 cm' '6 cm'.")
@click.option("--font-size", type=Real(), help="Font size in points.  [default: 7.5]")
@click.option("-o", "--output", required=True, type=FilePath(), help="File to write: .svg, .png or .pdf.")
def plot(
    file: Path | None,
    data: Path | None,
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
    units.

    With --gravity the sphere falls on a wall (a material with --wall, or a scene), and its weight acts during the
    contact. eps is 0 where the sphere stays down, and --epsilon includes the weight. At --speed, contacts of --law and
    --program have the duration and the eps of the viscoelastic contact without weight.

    With --adhesion the surfaces of a material, or of a scene, adhere (JKR): eps falls to 0 at the sticking speed.
    """
    require("plot", "matplotlib", *(["scipy"] if data is not None else []))
    kind = picture_kind("--output", output)
    check_targets([output])
    import numpy as np

    from viscopade.plots import sheet, speeds

    page = sheet.Page(title, _inches(size), _points(font_size))
    curves, ends, pair, of_v_star = _curves(file, **options)
    if of_v_star and data is not None:
        raise click.UsageError("--data needs spheres: expected a scene, a material, --beta, or --epsilon with --speed")
    points = None
    if data is not None:
        from viscopade import files
        from viscopade.fitting import read

        points = read.recording([(files.content(data, "CSV or a spreadsheet"), str(data))]).points
    over = {"over": sheet.V_STAR} if of_v_star else {}
    number = _DRAWN if options["gravity"] is options["adhesion"] is None else _DRAWN_WITH_WEIGHT
    draw = partial(speeds.draw_speeds, curves, np.geomspace(*ends, number), points, **over)
    write_all({output: sheet.picture(draw, "eps against the impact speed", command_line(), kind, page)})
    say(f"wrote {output}")
    for text in [] if pair is None else limits_of(pair, ends[1], options["yield_strength"], options["adhesion"]):
        say(f"Warning: {text}.")


def _inches(size: tuple[float, float] | None) -> tuple[float, float] | None:
    """Return width and height in inches, each from 2 cm to 2 m."""
    if size is None:
        return None
    width, height = map(float, size)
    if not 0.02 <= min(width, height) <= max(width, height) <= 2:
        raise ValueError(f"size is {width:g} m, {height:g} m: expected width and height from 2 cm to 2 m")
    return width / _INCH, height / _INCH


def _points(font_size: float | None) -> float:
    """Return the font size in points."""
    if font_size is not None and not 3 <= font_size <= 72:
        raise ValueError(f"font-size is {font_size:g}: expected 3 to 72 points")
    return _LETTERS if font_size is None else font_size


@click.command("table", epilog=examples("viscopade table --from 0.1 --to 10"))
@with_options(*_CURVES)
@click.option("--points", type=Whole(2, _MOST_ROWS), help="Number of speeds.  [default: three per decade]")
@STYLE
def table_command(points: int | None, style: str, **options: Any) -> None:
    """Print eps against the impact speed, or against v*.

    It takes the options of `viscopade plot`. For a material without --gravity and --adhesion the table also has the
    contact time and the maximal compression. All numbers are in SI units and in double precision.
    """
    import numpy as np

    from viscopade.collision.adhesion import adhesive, sticking
    from viscopade.collision.weight import falling

    curves, ends, pair, of_v_star = _curves(**options)
    work = options["adhesion"]
    if (work is not None or options["gravity"] is not None) and points is not None and points > _MOST_WITH_WEIGHT:
        with_option = "--gravity" if work is None else "--adhesion"
        raise ValueError(f"points is {points}: expected at most {_MOST_WITH_WEIGHT} with {with_option}")
    number = max(2, round(3 * float(np.log10(ends[1] / ends[0]))) + 1) if points is None else points
    speeds = np.geomspace(*ends, number)
    key = "v_star" if of_v_star else "speed"
    columns: list[tuple[str, Any]] = [("v*" if of_v_star else "speed (m/s)", speeds)]
    columns += [("eps" if len(curves) == 1 else each.name, each.epsilon(speeds)) for each in curves]
    weight = options["gravity"] and float(options["gravity"])
    is_proven = not weight and work is None
    if pair is not None and is_proven:
        columns.append(("contact time (s)", pair.contact_time(speeds)))
        columns.append(("max compression (m)", pair.max_compression(speeds)))
    warnings: list[str] = []
    rows = [
        [f"{number:.{_FIGURES}g}" for number in row] for row in zip(*(values for _, values in columns), strict=True)
    ]
    whole: dict[str, Any] = {
        **({} if pair is None else {"A": pair.A, "beta": pair.beta}),
        key: speeds.tolist(),
        "curves": [
            {"name": each.name, "epsilon": [e if e == e else None for e in values.tolist()]}
            for each, (_, values) in zip(curves, columns[1:], strict=False)
        ],
    }
    if pair is not None:
        warnings = limits_of(pair, ends[1], options["yield_strength"], options["adhesion"])
        if is_proven:
            whole |= {"contact_time": columns[-2][1].tolist(), "max_compression": columns[-1][1].tolist()}
        whole["warnings"] = warnings
    slowest = None
    if work is not None and pair is not None:
        contact = adhesive(pair, work, weight or 0.0)
        bond = sticking(lambda _: contact, ends[0])
        slowest = bond and bond.speed
    if not is_proven:
        whole |= {"gravity": weight, "adhesion": work, "sticking_speed": slowest, "status": "sampled"}
    show(style, [name for name, _ in columns], rows, whole)
    if style == "text":
        if pair is not None:
            say(f"A = {pair.A:.{_FIGURES}g} s, beta = {pair.beta:.{_FIGURES}g} (s/m)^(1/5)")
        if slowest is not None:
            say(f"With adhesion (sampled): below {slowest:.4g} m/s the bodies stay together, eps = 0.")
        if weight and pair is not None and work is None:
            for sentence in falling(pair, ends[1], weight).sentences(*ends, user_set_gravity=True):
                say(f"{sentence}.")
        for text in warnings:
            say(f"Warning: {text}.")


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
) -> tuple[list[SpeedCurve], tuple[float, float], Pair | None, bool]:
    """Return the curves, the ends of their axis, the pair of a single material, and whether the axis is v*.

    Raises
    ------
    ValueError
        If the options do not describe spheres, a name is not known, or the speeds are not in order.
    """
    import numpy as np

    from viscopade.plots import speeds

    nothing = file is None and beta is None and epsilon is None and speed is None
    if nothing and all(value in (None, False, ()) for value in body.values()):
        if gravity is not None:
            raise click.UsageError(NO_FALL)
        if adhesion is not None:
            raise click.UsageError(_NO_SURFACES)
        if laws or programs:
            raise click.UsageError("--law and --program need spheres: expected --epsilon with --speed, or a material")
        without_spheres = [speeds.over_v_star(), *(speeds.approximant(m, n, None) for m, n in approximants)]
        return without_spheres, _ends(slowest, fastest, 0.01, 10.0), None, True
    found, pair, ends = _viscoelastic(file, beta, epsilon, speed, body, gravity)
    at = ends[2] if speed is None and file is not None else speed
    if adhesion is not None:
        if laws or programs or approximants or epsilon is not None:
            other = "--law" if laws else "--program" if programs else "--pade" if approximants else "--epsilon"
            raise click.UsageError(f"{other} and --adhesion are given: expected one of them")
        for _, of in found:
            _weight(gravity, 1.0, of)
        spheres = [(name, of) for name, of in found if not isinstance(of, float)]
        if len(spheres) < len(found):
            raise click.UsageError(_NO_SURFACES)
        curves = [speeds.adhesive_spheres(name, of, adhesion, gravity or 0.0) for name, of in spheres]
        return curves, _ends(slowest, fastest, *ends[:2]), pair, False
    if (laws or programs) and at is None:
        raise click.UsageError("--law and --program need --speed, at which their eps is that of the spheres")
    typical = ends[2] if at is None else at
    weights = [_weight(gravity, typical, of) for _, of in found]
    betas = [of if isinstance(of, float) else float(of.beta) for _, of in found]
    named = zip(found, betas, weights, strict=True)
    curves = [speeds.viscoelastic(name, value, weight) for (name, _), value, weight in named]
    if at is not None:
        value = float(speeds.viscoelastic("", betas[0]).epsilon(np.array([at]))[0])
        curves += [speeds.of_law(law, value, at, weights[0]) for law in laws]
        for program in programs:
            curves += speeds.of_program(program, value, at, weights[0])
    if approximants and gravity is not None:
        raise click.UsageError("--pade and --gravity are given: expected one of them")
    curves += [speeds.approximant(m, n, betas[0]) for m, n in approximants]
    if len(curves) > speeds.MOST:
        raise ValueError(f"there are {len(curves)} curves: expected up to {speeds.MOST}")
    return curves, _ends(slowest, fastest, *ends[:2]), pair, False


_NO_SURFACES = "--adhesion needs surfaces: expected a material with --dissipative-constant, or a scene"


def _weight(gravity: float | None, speed: float, of: float | Pair) -> Weight | None:
    """Return the weight of the sphere of a curve, if it is a pair and not only a beta."""
    from viscopade.plots.speeds import Weight

    if gravity is None:
        return None
    if isinstance(of, float) or not of.second.is_wall:
        raise click.UsageError(NO_FALL)
    return Weight(gravity, speed, float(of.contact_time(speed)))


def _ends(slowest: float | None, fastest: float | None, low: float, high: float) -> tuple[float, float]:
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
) -> tuple[list[tuple[str, float | Pair]], Pair | None, tuple[float, float, float]]:
    """Return names with pairs or betas, the pair of a material, and the lowest, highest and typical speed."""
    constant = body.pop("dissipative_constant")
    has_body = bool(body["radii"]) or any(value not in (None, False, ()) for value in body.values())
    given = (file is not None) + (beta is not None) + (constant is not None) + (epsilon is not None)
    if given != 1 or (epsilon is None) == (speed is not None and file is None and beta is None and constant is None):
        raise click.UsageError(
            "the options do not describe spheres: expected a scene, or --beta, or --epsilon with --speed, or a "
            "material with either --dissipative-constant or --epsilon and --speed"
        )
    ends = (1e-3, 10.0, 1.0)
    if file is not None:
        if has_body:
            raise click.UsageError("a scene and a material are given: expected one of them")
        return _of_scene(file, gravity is not None)
    if beta is not None:
        if has_body:
            raise click.UsageError("--beta and a material are given: expected one of them")
        return [("viscoelastic", _in_si(beta))], None, ends
    if not has_body:
        if epsilon is None:
            raise click.UsageError("--dissipative-constant needs a material: expected its radius, density, …")
        assert speed is not None
        from viscopade.plots import speeds

        return [("viscoelastic", speeds.beta_of(epsilon, speed))], None, ends
    pair = pair_with(epsilon, speed or 0.0, gravity, dissipative_constant=constant, **body)
    return [("viscoelastic", pair)], pair, ends


def _of_scene(
    file: Path, falling: bool
) -> tuple[list[tuple[str, float | Pair]], Pair | None, tuple[float, float, float]]:
    """Return the curves of a scene, or those of spheres that fall on walls."""
    scene = read_scene(file)
    met = [(meeting, scene.pair(meeting)) for meeting in scene.meetings]
    if falling:
        met = [(meeting, pair) for meeting, pair in met if pair.second.is_wall] or met
    pairs = [pair for _, pair in met]
    speeds = [meeting.speeds for meeting, _ in met]
    found: list[tuple[str, float | Pair]] = [(meeting.name, pair) for meeting, pair in met]
    slowest, fastest = min(speed.slowest for speed in speeds), max(speed.fastest for speed in speeds)
    if slowest == fastest:
        slowest, fastest = slowest / 10, fastest * 10
    return found, pairs[0] if len(pairs) == 1 else None, (slowest, fastest, met[0][0].known_at or speeds[0].typical)


def _in_si(beta: str) -> float:
    from viscopade import quantity

    parts = quantity.beta_decimal(beta)
    if parts is None:
        accepted = 'a number >= 0 in (s/m)^(1/5), or one with its unit, such as "1.3 (s/cm)^(1/5)"'
        return float(arguments.exact_number("beta", beta, accepted, lambda b: 0 <= b < 10**300))
    number, _, scale = parts
    return float(number) / math.pow(float(scale), 0.2)


COMMANDS = (plot, table_command)
