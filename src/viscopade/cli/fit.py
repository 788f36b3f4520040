"""Command that fits the damping to measured data: fit.

    speed (cm/s), epsilon, +/-
    12.1, 0.913, 0.004
    25.6, 0.897, 0.005

The result is beta in (s/m)^(1/5): eps depends on v* = beta^(1/2) v^(1/10), with the impact speed v. Numbers in texts
and tables have 2 to 8 figures (`.4g`), chosen by hand to be read: an error has two or three. JSON has all digits.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from viscopade.cli.console import (
    SIZE,
    STYLE,
    TITLE,
    Command,
    FilePath,
    Quantity,
    Real,
    command_line,
    examples,
    limits_of,
    material,
    option,
    page_of,
    pair_of,
    picture_kind,
    say,
    show,
)
from viscopade.cli.writer import check_targets, write_all
from viscopade.extras import require
from viscopade.quantity import uncertain

FORMS = ("power", "table")
"""Forms of empirical functions."""

if TYPE_CHECKING:
    from viscopade.collision.spheres import Pair, Sphere
    from viscopade.fitting.contacts import ContactTime
    from viscopade.fitting.damping import Constant, DampingFit
    from viscopade.fitting.empirical import Form
    from viscopade.fitting.flight import Flight
    from viscopade.fitting.neglected_effects import WeightInContacts
    from viscopade.fitting.read import Recording

MOST_ROWS = 20
"""Most rows of a table or a list; chosen by hand for a terminal, and JSON has all."""
_UNIT = "(s/m)^(1/5)"
_BETAS = f"beta_i {_UNIT}"


class Neglected(NamedTuple):
    """Weight during contacts, if bodies fall, and sentences on drag and adhesion if they may matter."""

    weight: WeightInContacts | None
    drag: str | None
    adhesion: str | None

    @property
    def warnings(self) -> list[str]:
        """Sentences on effects that the fit neglects although they matter."""
        return [
            *([self.weight.sentence] if self.weight and self.weight.warns else []),
            *filter(None, [self.drag, self.adhesion]),
        ]


def _warnings(recording: Recording, damping_fit: DampingFit, pair: Pair | None, neglected: Neglected) -> list[str]:
    """Return sentences on units, on neglected effects and limits of the model that matter, and on eps above 1.

    `recording` is what was read of the data, `damping_fit` their fit, and `pair` the bodies, if they are known.
    """
    limits = [] if pair is None else limits_of(pair, float(damping_fit.points.speed.max()), None)
    warnings = [*recording.warnings, *limits, *neglected.warnings]
    # No collision has eps > 1: state the first one, by how many standard errors it exceeds 1, and how many there are.
    points = damping_fit.points
    above = [i for i, eps in enumerate(points.epsilon) if eps > 1]
    if not above:
        return warnings
    i, others = above[0], len(above) - 1
    # Errors as measured, or those of the fitted scatter
    excess = (points.epsilon[i] - 1) / (points.standard_errors[i] or damping_fit.main.standard_errors[i])
    more = f", and {others} more eps are" * (others > 0)
    text = f"{points.labels[i]}: eps = {points.epsilon[i]:.6g} is above 1, by {excess:.2g} standard errors"
    return [*warnings, f"{text}{more}; {'they are' if others else 'it is'} in the fit"]


class Assignment(click.ParamType):  # type: ignore[type-arg]
    """Type of an option: NAME=VALUE."""

    def __init__(self, name: str) -> None:
        self.name = name

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[str, str]:
        """Return the name of a column and its header or unit, from a typed `value` such as "speed=v (cm/s)".

        Click also passes the option `param` and the running command `ctx`.
        """
        from viscopade.fitting.forms import OPTIONS

        name, equals, rest = value.partition("=")
        if not equals or name.strip() not in OPTIONS or not rest.strip():
            self.fail(f"{value!r} is no {self.name}: expected one of the names {', '.join(OPTIONS)}")
        return name.strip(), rest.strip()


@click.command(cls=Command, epilog=examples("viscopade fit examples/collisions.csv"))
@click.argument("data", type=FilePath(), nargs=-1, required=True)
@option("--sheet", "sheets", multiple=True, metavar="NAME", help="Sheet to read; repeatable.  [default: all]")
@option(
    "--column",
    "columns",
    type=Assignment("NAME=HEADER"),
    multiple=True,
    help="Header or number of a column; - to omit it.",
)
@option("--unit", "units", type=Assignment("NAME=UNIT"), multiple=True, help="Unit of a column.")
# The defaults that helps state are those of viscopade.fitting: 9.80665 m/s^2 is the standard gravity, 0.47 the drag
# coefficient of a smooth sphere at Reynolds numbers from 1000 to 200000, and 4 degrees of freedom are a choice.
@option("--rate", group="Advanced", type=Real(" > 0"), help="Frames per second, for a column frame.")
@option(
    "--length-per-unit",
    group="Advanced",
    type=Quantity("length", " > 0"),
    help="Length of one unit of position, as a pixel.",
)
@option(
    "--resolution",
    group="Advanced",
    help='Standard error of times ("0.5 ms"), or of heights or positions ("1 mm").  '
    "[default: fitted; 1 ms for echoes among times of bounces]",
)
@option(
    "--gravity",
    group="Advanced",
    type=Quantity("acceleration", " > 0"),
    help="Gravitational acceleration.  [default: 9.80665 m/s^2]",
)
@option(
    "--air-density",
    group="Advanced",
    type=Quantity("density"),
    help="Density of the air, for its drag; needs radius and density.",
)
@option(
    "--drag-coefficient", group="Advanced", type=Real(), help="Drag coefficient of the sphere in air.  [default: 0.47]"
)
@option("--contact-time", group="Advanced", type=Quantity("time"), help="Duration of a contact, between two flights.")
@option(
    "--scatter/--no-scatter",
    group="Advanced",
    default=None,
    help="Whether eps scatters more than its standard errors.  [default: if there are none]",
)
@option(
    "--robust", group="Advanced", is_flag=True, help="Give outliers less weight: Student's t with 4 degrees of freedom."
)
@option("--without", multiple=True, metavar="[NAME:]LINE", help="Line of a file or sheet to leave out; repeatable.")
@option(
    "--law",
    "laws",
    group="Other laws",
    multiple=True,
    metavar="NAME|A,B",
    help="Law of contact to compare with; repeatable.",
)
@material(
    *("young_modulus", "poisson_ratio", "density"),
    radius="Radius of the sphere, or of both equal ones.",
    wall="Speeds are those of a sphere on a plane, not of two equal spheres; times, heights and tracks always are.",
)
@option(
    "--wall-young-modulus",
    group="Material",
    type=Quantity("pressure", " > 0"),
    help="Young modulus of the plane, if its material is not the sphere's.",
)
@option("--wall-poisson-ratio", group="Material", type=Real(), help="Its Poisson ratio.")
@option("--mass", group="Material", type=Quantity("mass", " > 0"), help="Mass of the sphere, instead of its density.")
@option(
    "--scene",
    "scene_file",
    group="Output",
    type=FilePath(),
    help="Write a scene with the fitted material to this file.",
)
@option("--plot", "picture", group="Output", type=FilePath(), help="Draw the fit into this file: .svg, .png or .pdf.")
@option(
    "--empirical",
    "code",
    group="Output",
    type=FilePath(),
    help="Write an empirical function of the data, which follows no law, to this file: .h, .py, .f90, …",
)
@option(
    "--form",
    group="Output",
    type=click.Choice(FORMS),
    default="power",
    help="Form of that function: a capped power, or a monotone table.  [default: power]",
)
@TITLE
@SIZE
@STYLE
def fit(
    data: tuple[Path, ...],
    laws: tuple[str, ...],
    robust: bool,
    scene_file: Path | None,
    picture: Path | None,
    title: str | None,
    size: tuple[float, float] | None,
    font_size: float | None,
    code: Path | None,
    form: Form,
    style: str,
    **options: Any,
) -> None:
    """Fit the damping to measured data; test the viscoelastic law.

    DATA are CSV files or spreadsheets. All sheets and files are fitted together. +/- or sigma beside a quantity is
    the error of this quantity. The headers name the columns and their units:

    \b
    speed (cm/s), epsilon, +/-   collisions; also contact_time if known
    time (s)                     times of the bounces
    height (cm)                  heights of the release and of the rebounds
    H (cm), h1 (cm), h2 (cm)     the same, a row for each drop
    time (s), y (m)              track of a ball; frame instead of time

    Exports of phyphox's "(In)elastic collision" and acoustic stopwatch work, too. Echoes and missed bounces are found.
    The first lines of the output say which columns were read, and in which units.

    The result is beta with its standard error and confidence intervals, and a verdict that compares the law with a
    constant eps, with nu = 1 and with a free exponent. --radius, --density, --poisson-ratio and --young-modulus add A,
    of two equal spheres, or with --wall of a sphere on a plane. Times, heights and tracks are those on a plane.
    With a column contact_time instead of --young-modulus the Young modulus is fitted, too. Plain numbers are in SI
    units.
    """  # noqa: D301
    # Refuse at once what would be refused after the work: packages, names of files, targets that are not ours.
    if "" in options["sheets"]:
        raise click.UsageError("--sheet is '': expected the name of a sheet")
    spreadsheet = any(file.suffix.lower() in (".xls", ".xlsx", ".ods") for file in data)
    packages = {"scipy": True, "python_calamine": spreadsheet, "matplotlib": picture is not None}
    require("fit", *(package for package, is_needed in packages.items() if is_needed))
    if picture is not None:
        picture_kind("--plot", picture)
    elif (title, size, font_size) != (None, None, None):
        option = "--title" if title is not None else "--size" if size is not None else "--font-size"
        raise click.UsageError(f"{option} is given: expected --plot with it")
    page = page_of(title, size, font_size)
    targets = [path for path in (scene_file, picture, code) if path is not None]
    if len({*targets}) < len(targets):
        raise click.UsageError("--scene, --plot and --empirical name one file twice: expected one for each")
    if targets:
        check_targets(targets)
    language = None if code is None else _language(code)
    names = ", ".join(file.name for file in data)
    words = command_line()
    recording, damping_fit, pair, constants, neglected = _fit_data(
        data, laws, robust, scene_file is not None, **options
    )

    # Make the contents of all files, then write them together.
    written: dict[Any, str | bytes] = {}
    if scene_file is not None:
        from viscopade.fitting.scene_text import scene_text

        assert pair is not None
        text = scene_text(damping_fit, pair, words, f"Spheres as in {names}")
        written[scene_file] = text
    if picture is not None:
        from viscopade.plots import fit_picture, sheet

        kind = picture_kind("--plot", picture)
        draw = partial(fit_picture.draw_fit, damping_fit, with_result=title != "")
        written[picture] = sheet.picture(draw, f"eps against speed, {names}", words, kind, page)
    if code is not None and language is not None:
        from viscopade.fitting import empirical

        # The function is named for the file, as far as a name may be.
        stem = re.sub(r"\W", "_", code.stem.lower(), flags=re.ASCII)
        written[code] = empirical.of_points(damping_fit.points, form).text(language, stem, words)
    if written:
        write_all(written)
    _show(recording, damping_fit, pair, constants, neglected, style)
    if style == "text" and written:
        say(f"wrote {', '.join(map(str, written))}")
        if scene_file is not None and damping_fit.contact_law.law != "viscoelastic":
            say(f"{scene_file} has the viscoelastic law: scenes have no other law")


def _language(code: Path) -> str:
    """Return the language of a file with code, by its ending."""
    from viscopade.kernels.write import languages

    # Of languages with the same ending the first counts: it is entered last.
    endings = {languages.language(name).ending: name for name in reversed(languages.NAMES)}
    if code.suffix not in endings:
        raise click.UsageError(f"--empirical is {code}: expected a name that ends in {', '.join(sorted(endings))}")
    return endings[code.suffix]


def _fit_data(
    data: Sequence[Path],
    laws: Sequence[str],
    robust: bool,
    for_scene: bool,
    **options: Any,
) -> tuple[Recording, DampingFit, Pair | None, Mapping[str, Constant], Neglected]:
    """Return the data, their fit, the bodies with their Young moduli, fitted constants, and what is neglected.

    Parameters
    ----------
    data : sequence of Path
        Files, which are fitted together.
    laws : sequence of str
        Further laws of contact to compare with.
    robust : bool
        Give outliers less weight.
    for_scene : bool
        Whether a scene is to be written, which needs the material.
    **options : Any
        Further options of `fit`, in SI units: of the sphere, its flight and the columns.
    """
    from dataclasses import replace

    from viscopade.collision.spheres import Pair
    from viscopade.files import content
    from viscopade.fitting import damping, read
    from viscopade.fitting import neglected_effects as effects

    # The sphere, and with its elastic constants the pair of it and the plane that it falls on.
    names = ("radii", "wall", "young_modulus", "poisson_ratio", "density", "wall_young_modulus", "wall_poisson_ratio")
    body = {name: options.pop(name) for name in names}
    plane = {name: body.pop(f"wall_{name}") for name in ("young_modulus", "poisson_ratio")}
    if (mass := options.pop("mass")) is not None:
        body["density"] = _density(body, mass)
    in_air = options["air_density"] is not None
    sphere = _sphere(body, in_air, for_scene)
    wall = _plane(sphere, plane, body["young_modulus"] is not None)
    resolution, contact_time, length = (options.pop(name) for name in ("resolution", "contact_time", "length_per_unit"))
    # The time between two flights: the typed one in s, or else that of the pair at each speed, or else 0.
    contact: ContactTime = contact_time or 0.0
    is_elastic = body["poisson_ratio"] is not None and body["young_modulus"] is not None
    if sphere is not None and wall is not None and is_elastic and contact_time is None:
        contact = Pair(sphere, wall)

    # Read the points (speed, eps and their errors) of all files, and fit beta to them.
    contents = [(content(file, "CSV or a spreadsheet"), str(file)) for file in data]
    reading = read.Options(
        dict(options.pop("columns")),
        dict(options.pop("units")),
        _flight(sphere, **{name: options.pop(name) for name in ("gravity", "air_density", "drag_coefficient")}),
        resolution,
        contact,
        length_per_unit=length,
        **options,
    )
    recording = read.recording(contents, reading)
    points = recording.points
    _require_speeds(recording, ", ".join(map(str, data)))
    damping_fit = damping.fit(points, laws=laws, robust=robust)

    # The bodies that collided: what bounces does so on a plane. A follows from beta, and a Young modulus that is not
    # typed from measured contact times.
    on_plane = body["wall"] or recording.kind != "speeds" or plane["young_modulus"] is not None
    constants: dict[str, Constant] = {}
    pair = None
    if sphere is not None and wall is not None and body["poisson_ratio"] is not None:
        if is_elastic:
            constants["dissipative_constant"] = damping_fit.dissipative_constant(
                Pair(sphere, wall if on_plane else sphere)
            )
        elif points.contact_time is not None:
            constants["dissipative_constant"], young = damping_fit.stiffness(sphere, on_plane)
            constants["young_modulus"] = young
            sphere, wall = (replace(body_or_plane, young_modulus=young.value) for body_or_plane in (sphere, wall))
        else:
            raise click.UsageError("the Young modulus is not known: expected --young-modulus, or a column contact_time")
        pair = Pair(sphere, wall if on_plane else sphere).damped(constants["dissipative_constant"].value)

    # Sentences on effects that the fit neglects, where they may matter.
    gravity = reading.flight.gravity
    drag = None if in_air else effects.drag(recording, sphere, gravity)
    weight = effects.weight_in_contacts(recording, pair if is_elastic else None, gravity)
    # A weight that matters, and is not in the fit, looks like adhesion: eps falls at low speeds.
    adhesion = None if weight and weight.warns else effects.adhesion(damping_fit.laws)
    return recording, damping_fit, pair, constants, Neglected(weight, drag, adhesion)


def _plane(sphere: Sphere | None, plane: Mapping[str, float | None], has_modulus: bool) -> Sphere | None:
    """Return the plane, without damping: of the material in `plane`, by options, or else that of a sphere.

    `has_modulus`: whether the Young modulus of the sphere is typed.
    """
    from viscopade.collision.spheres import Sphere

    if {*plane.values()} != {None} and (sphere is None or not has_modulus or None in plane.values()):
        words = "--wall-young-modulus and --wall-poisson-ratio"
        raise click.UsageError(f"a plane of another material needs {words}, and the material of the sphere")
    if sphere is None:
        return None
    constants = {name: getattr(sphere, name) if constant is None else constant for name, constant in plane.items()}
    return Sphere.wall(**constants, dissipative_constant=0)


def _require_speeds(recording: Recording, files: str) -> None:
    """Raise ValueError if the points are too few for a fit, or all have one speed; `files` are named in the message."""
    import numpy as np

    # A law with a free exponent has two parameters: 3 points leave it one degree of freedom. Speeds that differ by less
    # than 1e-9 (chosen by hand, above round-off and below any measurement) are one speed, which tells nothing of a law.
    points = recording.points
    if len(points) < 3:
        text = (
            f"{len(points)} {'points have' if len(points) > 1 else 'point has'} a speed and an eps: expected 3 or more"
        )
        if len(points) == 1 and 0 < points.epsilon[0] < 1:
            one = f"--epsilon {points.epsilon[0]:.4g} --speed {points.speed[0]:.4g}"
            text += f"; `viscopade invert {one}` gives beta for this one, and A with a scene of ball and plate"
    elif np.ptp(points.speed) <= 1e-9 * points.speed.max():  # equal but for round-off
        # The standard error of a mean: s/sqrt(n), with s from n - 1 degrees of freedom.
        mean, error = points.epsilon.mean(), points.epsilon.std(ddof=1) / math.sqrt(len(points))
        numbers = [f"{epsilon:.3f}" for epsilon in points.epsilon[:MOST_ROWS]]
        text = (
            f"all speeds are {points.speed[0]:.4g} m/s: expected two or more; `viscopade invert --epsilon {mean:.4g}` "
            f"gives the damping for the mean eps, {uncertain(mean, error)}, of {', '.join(numbers)}"
        )
    else:
        return
    # Lines and sheets that were left out may be why: (label, reason).
    reasons = [*recording.left_out, *((name, report) for name, report in recording.sheets if isinstance(report, str))]
    left_out = "".join(f"; {name} is left out: {why}" for name, why in reasons[:MOST_ROWS])
    raise ValueError(f"{files}: {text}{left_out}")


def _density(body: Mapping[str, Any], mass: float) -> float:
    """Return the density of a sphere with a mass in kg, in kg/m^3; `body` has the options of the sphere by name."""
    from viscopade.collision.spheres import Sphere

    if body["density"] is not None or len(body["radii"]) != 1:
        raise click.UsageError("--mass is given: expected one --radius with it, and no --density")
    # `Sphere` computes it, rho = m/(4/3 pi R^3); it also takes elastic constants, which do not matter here.
    unit = {"young_modulus": 1, "poisson_ratio": 0, "dissipative_constant": 0}
    return Sphere(radius=body["radii"][0], mass=mass, **unit).density


def _sphere(body: Mapping[str, Any], for_drag: bool, for_scene: bool) -> Sphere | None:
    """Return the measured sphere, with a Young modulus of 1 Pa if none is typed; None if nothing is typed of it.

    Parameters
    ----------
    body : mapping
        The sphere's options by name, in SI units.
    for_drag, for_scene : bool
        Whether the drag of air needs its radius and density, and a scene also its Poisson ratio.
    """
    typed = {name for name, value in body.items() if value is not None and value != ()} - {"wall"}
    if not typed and not for_drag and not for_scene:
        if body["wall"]:
            raise click.UsageError(
                "--wall is given: expected the sphere's --radius, --density and --poisson-ratio with it"
            )
        return None
    # Radius and density are enough for the drag. An elastic constant needs the other ones.
    needed = ["radii", "density", *(["poisson_ratio"] if for_scene or typed - {"radii", "density"} else [])]
    if missing := [name for name in needed if name not in typed]:
        flags = ", ".join("--" + name.replace("radii", "radius").replace("_", "-") for name in missing)
        flags = flags.replace("--density", "--density (or --mass)")
        raise click.UsageError(f"the sphere also needs {flags}")
    if len(body["radii"]) > 1:
        raise click.UsageError("--radius is given twice: expected one radius, of a sphere or of two alike")
    # A Young modulus that is not typed is fitted later, or not used: 1 Pa holds its place, as does the ratio 0.
    pair = pair_of(
        body["radii"],
        body["wall"],
        young_modulus=body["young_modulus"] or 1.0,
        poisson_ratio=0.0 if body["poisson_ratio"] is None else body["poisson_ratio"],
        density=body["density"],
    )
    assert pair is not None
    return pair.first


def _flight(
    sphere: Sphere | None, gravity: float | None, air_density: float | None, drag_coefficient: float | None
) -> Flight:
    """Return how the sphere flies: with a gravity in m/s^2, and with drag if the density of the air, kg/m^3, is typed.

    None stands for the standard gravity, for no drag, and for the usual drag coefficient of a sphere.
    """
    from viscopade.fitting.flight import DRAG_COEFFICIENT, STANDARD_GRAVITY, Flight

    # `_sphere` has refused an `air_density` without a radius and a density of the sphere. The default of
    # `drag_coefficient` is 0.47, of a smooth sphere at Reynolds numbers from 1000 to 200000.
    g = STANDARD_GRAVITY if gravity is None else gravity
    if air_density is None:
        if drag_coefficient is not None:
            raise click.UsageError("--drag-coefficient is given: expected --air-density with it")
        return Flight(g)
    assert sphere is not None
    drag = DRAG_COEFFICIENT if drag_coefficient is None else drag_coefficient
    return Flight.of_sphere(sphere.radius, sphere.density, air_density=air_density, gravity=g, drag_coefficient=drag)


# --- what is printed --------------------------------------------------------------------------------------------------


def _show(
    recording: Recording,
    damping_fit: DampingFit,
    pair: Pair | None,
    constants: Mapping[str, Constant],
    neglected: Neglected,
    style: str,
) -> None:
    """Print a fit.

    Parameters
    ----------
    recording : Recording
        What was read of the data, and what was left out.
    damping_fit : DampingFit
        beta with its errors, the laws that were compared, and the verdict.
    pair : Pair or None
        The bodies that collided, if their material is known.
    constants : mapping of str to Constant
        The fitted dissipative_constant and young_modulus, each a value with its standard error.
    neglected : Neglected
    style : str
        Format of the output: text, csv or json. In a text, items of a list are indented by 2 blanks.
    """
    from viscopade.fitting.damping import LEVELS

    # CSV: a row for each constant, with both confidence intervals (`LEVELS` are 0.68 and 0.95) of beta.
    units = {"dissipative_constant": "s", "young_modulus": "Pa"}
    if style != "text":
        columns = ("quantity", "value", "standard error", "68 % from", "68 % to", "95 % from", "95 % to", "unit")
        ends = [f"{end:.6g}" for level in LEVELS for end in damping_fit.interval(level)]
        rows = [("beta", f"{damping_fit.beta:.8g}", f"{damping_fit.beta_standard_error:.3g}", *ends, _UNIT)]
        for name, constant in constants.items():
            rows.append((name, f"{constant.value:.8g}", f"{constant.standard_error:.3g}", "", "", "", "", units[name]))
        show(style, columns, rows, fit_json(recording, damping_fit, pair, constants, neglected))
        return
    spans = [" … ".join(f"{end:.5g}" for end in damping_fit.interval(level)) for level in LEVELS]
    rows = [("beta", f"{damping_fit.beta:.6g}", f"{damping_fit.beta_standard_error:.2g}", *spans, _UNIT)]
    for name, constant in constants.items():
        rows.append((name, f"{constant.value:.6g}", f"{constant.standard_error:.2g}", "", "", units[name]))

    # Text begins with what was read, then the verdict with its reasons, what was left out, and warnings.
    for paragraph in read_text(recording):
        say(paragraph)
    # A unit misread by 10 or 1000 shows in the speeds, a wrong assignment of columns in eps.
    speed, epsilon = damping_fit.points.speed, damping_fit.points.epsilon
    speeds = f"speeds {speed.min():.3g} to {speed.max():.3g} m/s"
    say(f"{damping_fit.number}: {speeds}, eps {epsilon.min():.3g} to {epsilon.max():.3g}")
    click.echo()
    say(f"{damping_fit.verdict.sentence}.")
    for reason in damping_fit.verdict.reasons:
        say(f"  {reason}", 2)
    # A sheet has its number of points, or the reason why it is not read.
    for name, report in recording.sheets if len(recording.sheets) > 1 else ():
        say(f"  {name}: {report} points" if isinstance(report, int) else f"  {name} is not read: {report}", 2)
    for label, why in recording.left_out[:MOST_ROWS]:
        say(f"  {label} is left out: {why}", 2)
    if (more := len(recording.left_out) - MOST_ROWS) > 0:
        say(f"  and {more} more; --format json lists all", 2)
    for flown in recording.flights[:MOST_ROWS]:
        acceleration = uncertain(flown.acceleration, flown.standard_error)
        say(f"  flight from {flown.first} to {flown.last}: acceleration {acceleration} m/s^2", 2)
    if (more := len(recording.flights) - MOST_ROWS) > 0:
        say(f"  and {more} more; --format json lists all", 2)
    for label, off in damping_fit.outliers:
        text = f"  {label} is {abs(off):.0f} standard errors off"
        # Without errors of readings all eps count as equally exact, but an error of a height or of a time changes the
        # eps of a low bounce more: it may look like an outlier.
        if damping_fit.points.of_independent_errors and recording.kind in ("heights", "instants"):
            text += " if low bounces are as exact as high ones; else --resolution gives the error of readings"
        if not damping_fit.main.robust:
            text += "; --without leaves a line out"
            # Bounces with errors share them, and have no robust fit.
            if damping_fit.points.of_independent_errors:
                text += ", --robust counts outliers less"
        say(text, 2)
    for warning in _warnings(recording, damping_fit, pair, neglected):
        say(f"  {warning}", 2)

    # The sentence for a report, and the table of the constants; levels of intervals are printed in percent.
    click.echo()
    say(_quoted(recording, damping_fit, constants))
    if pair is not None:
        say(f"{_bodies(pair, constants)}.")
    else:
        say(
            "A also needs --radius, --density or --mass, --poisson-ratio, and --young-modulus or a column contact_time."
        )
    header = ("quantity", "value", "standard error", *(f"{100 * level:.0f} % interval" for level in LEVELS), "unit")
    show(style, header, rows, {})

    # The laws by Akaike's information criterion, the smallest first; it is infinite for too few points. Each law has
    # the damping kappa ~ v^p. chi^2 only where the errors of the points are known: with a fitted scatter it says
    # nothing about the law.
    errors_known = damping_fit.points.errors_complete
    laws = [
        (
            fit.model.name,
            f"{fit.exponent:.3g}",
            *((f"{fit.chi2:.4g}", fit.degrees) if errors_known else (f"{fit.scatter:.2g}",)),
            f"{fit.aic:.2f}" if math.isfinite(fit.aic) else "too few points",
        )
        for fit in sorted(damping_fit.laws, key=lambda fit: fit.aic)
    ]
    header = ("law", "p", *(("chi^2", "degrees of freedom") if errors_known else ("scatter of eps",)), "AIC")
    show(style, header, laws, {}, title="Laws, the best first")

    # The points, and what follows from the fit for a user of other commands.
    columns_of_points = _columns(damping_fit)
    points = list(zip(*(column for _, column in columns_of_points), strict=True))
    show(
        style,
        [name for name, _ in columns_of_points],
        [(label, *(f"{number:.4g}" for number in numbers)) for label, *numbers in points[:MOST_ROWS]],
        {},
        title="Points; beta_i grow or fall with the speed if p is not 1/5",
    )
    if len(points) > MOST_ROWS:
        say(f"and {len(points) - MOST_ROWS} more points; --format json lists all")
    for sentence in _sentences(damping_fit):
        say(sentence)
    if neglected.weight and not neglected.weight.warns:
        say(f"{neglected.weight.sentence.capitalize()}.")


def read_text(recording: Recording) -> list[str]:
    """Return what was read of a `recording`, a paragraph for all sheets with the same columns."""
    # From the sentence on columns to the sheets with these columns. Of a sheet, `recording.read` has by name its
    # quantities, each a dict with column, unit, its origin and the column of the error, and sheet, rows, lines, unused.
    sheets: dict[str, list[str]] = {}
    for sheet in recording.read:
        quantities = {name: entry for name, entry in sheet.items() if isinstance(entry, dict)}
        text = [f"{name}: {_headers(entry['column'])}{_unit(entry)}" for name, entry in quantities.items()]
        text += [f"error of {name}: {_headers(entry['error'])}" for name, entry in quantities.items() if entry["error"]]
        text.append(f"not used: {_headers(sheet['unused']) or 'none'}")
        first, last = sheet["lines"]
        sheets.setdefault("; ".join(text), []).append(
            f"{sheet['sheet']}: {sheet['rows']} rows, lines {first} to {last}"
        )
    return [f"{'; '.join(rows)}. {text}." for text, rows in sheets.items()]


def _headers(headers: str | Sequence[str]) -> str:
    """Return one header or several in quotes."""
    return ", ".join(map(repr, [headers] if isinstance(headers, str) else headers))


def _unit(read: Mapping[str, Any]) -> str:
    """Return the unit of a quantity and its origin, unless the header has it in brackets."""
    shown = read["unit_from"] == "its header" and any(bracket in _headers(read["column"]) for bracket in ")]")
    units = read["unit"] if isinstance(read["unit"], str) else ", ".join(read["unit"])
    return f" in {units} ({read['unit_from']})" if units and not shown else ""


def _quoted(recording: Recording, damping_fit: DampingFit, constants: Mapping[str, Constant]) -> str:
    """Return the sentence that a report quotes; under a condition if the flights say that the scale is wrong.

    `constants` are the fitted dissipative_constant (A) and young_modulus (Y), each a value with its standard error.
    The flights of a `recording` say so if their acceleration is not that of gravity.
    """
    # `uncertain` writes "0.873 +- 0.0040". The number of points is in words.
    names = {"dissipative_constant": ("A", "s"), "young_modulus": ("Y", "Pa")}
    numbers = [f"beta = {uncertain(damping_fit.beta, damping_fit.beta_standard_error)} {_UNIT}"]
    for name, constant in constants.items():
        numbers.append(f"{names[name][0]} = {uncertain(constant.value, constant.standard_error)} {names[name][1]}")
    verdict = damping_fit.verdict.sentence
    condition = ", if the scale were right, which the warning above doubts" * recording.doubtful_scale
    return (
        f"{', '.join(numbers)} (standard errors; {damping_fit.number}){condition}: {verdict[0].lower()}{verdict[1:]}."
    )


def _bodies(pair: Pair, constants: Mapping[str, Constant]) -> str:
    """Return a sentence, without its full stop, on the bodies whose A is among the fitted constants."""
    from dataclasses import replace

    from viscopade.collision.spheres import Pair

    first, second = pair.first, pair.second
    if not second.is_wall:
        return "A is that of two equal spheres; --wall gives that of a sphere on a plane"
    if (first.young_modulus, first.poisson_ratio) == (second.young_modulus, second.poisson_ratio):
        other = "--wall-young-modulus and --wall-poisson-ratio give the plane another one"
        return f"A is that of a sphere on a plane of its own material; {other}"
    # The weight of the sphere's A in the mean, D_1/(D_1 + D_2): it is the mean of 1 and 0.
    weight = Pair(replace(first, dissipative_constant=1.0), replace(second, dissipative_constant=0.0)).A
    a = constants["dissipative_constant"]
    alone = uncertain(a.value / weight, a.standard_error / weight)
    return (
        f"A is that of the sphere and the plane together, a mean in which the sphere's A has the weight {weight:.4g}; "
        f"if the plane has A = 0, that of the sphere is {alone} s"
    )


def _columns(damping_fit: DampingFit) -> list[tuple[str, Sequence[Any]]]:
    """Return the columns of the table of points: heads, and a value for each point."""
    # beta_i is the beta that a point alone has. A residual is eps minus that of the viscoelastic law, and its standard
    # error is that of the point with the fitted scatter.
    main = damping_fit.main
    return [
        ("point", damping_fit.points.labels),
        ("speed (m/s)", damping_fit.points.speed.tolist()),
        ("eps", damping_fit.points.epsilon.tolist()),
        (_BETAS, damping_fit.betas.tolist()),
        ("residual", main.residuals.tolist()),
        ("in standard errors", (main.residuals / main.standard_errors).tolist()),
    ]


def _sentences(damping_fit: DampingFit) -> list[str]:
    """Return sentences on eps in the middle of the speeds, on the best law, and on the scatter of eps."""
    # The fitted eps at the geometric mean of the measured speeds.
    main = damping_fit.main
    value, error = damping_fit.epsilon(main.middle)
    alone = ", without weight" if damping_fit.points.weight_speed else ""
    text = [f"eps at {main.middle:.3g} m/s{alone}: {uncertain(value, error)} (standard error)."]
    if (best := damping_fit.contact_law).law != "viscoelastic":
        text.append(f"Best law of contact, for `viscopade invert` and `viscopade simulators`: {best.options}")
    # Intervals come from Student's t where the scatter was fitted, also if the fit found none.
    if main.scatter:
        text.append(
            f"eps scatters by {main.scatter:.2g}, found from the residuals; intervals are those of Student's t."
        )
    elif not damping_fit.points.errors_complete:
        text.append("eps does not scatter beyond the errors of the measurement; intervals are those of Student's t.")
    return text


def fit_json(
    recording: Recording,
    damping_fit: DampingFit,
    pair: Pair | None,
    constants: Mapping[str, Constant],
    neglected: Neglected,
) -> dict[str, Any]:
    """Return a fit as JSON-able data, in SI units.

    Parameters
    ----------
    recording : Recording
        What was read of the data, and what was left out.
    damping_fit : DampingFit
        beta with its errors, the laws that were compared, and the verdict.
    pair : Pair or None
        The bodies that collided, if their material is known.
    constants : mapping of str to Constant
        The fitted dissipative_constant and young_modulus, each a value with its standard error.
    neglected : Neglected
    """
    # The law with a free exponent of the speed, if there is one among them. Its parameters are a prefactor (0) and the
    # exponent (1), whose standard error is the root of its variance.
    free = next((fit for fit in damping_fit.laws if fit.model.exponent is None), None)
    columns = dict(_columns(damping_fit)) | {_BETAS: _finite(damping_fit.betas.tolist())}
    main = damping_fit.main
    value, error = damping_fit.epsilon(main.middle)
    return {
        "beta": damping_fit.beta,
        "beta_standard_error": damping_fit.beta_standard_error,
        # Confidence intervals, here and of the exponent: 0.68 is about one standard error on either side, 0.95 the
        # usual level.
        "interval_68": _finite(damping_fit.interval(0.68)),
        "interval_95": _finite(damping_fit.interval(0.95)),
        # A fitted scatter makes chi^2 of any law its degrees of freedom: it says nothing.
        "chi2": main.chi2 if damping_fit.points.errors_complete else None,
        "dof": main.degrees,
        "verdict": damping_fit.verdict.word,
        "reasons": list(damping_fit.verdict.reasons),
        "deciding_ratio_of_speeds": damping_fit.verdict.ratio,
        "laws": [
            {
                "law": fit.model.name,
                "exponent": fit.exponent,
                "chi2": fit.chi2 if damping_fit.points.errors_complete else None,
                "dof": fit.degrees,
                "scatter": fit.scatter,
                "aic": _finite([fit.aic])[0],
            }
            for fit in damping_fit.laws
        ],
        "contact_law": vars(damping_fit.contact_law),
        "exponent": free
        and {
            "value": free.exponent,
            "standard_error": float(free.covariance[1, 1] ** 0.5),
            "interval_95": _finite(free.interval(0.95, 1)),
        },
        "epsilon": {"speed": main.middle, "value": value, "standard_error": error},
        "scatter": main.scatter,
        **{name: {"value": c.value, "standard_error": c.standard_error} for name, c in constants.items()},
        "bodies": pair and _bodies(pair, constants),
        "read": {**recording.read[0], "files": recording.read},
        "sheets": [
            {"sheet": name} | ({"points": report} if isinstance(report, int) else {"not_read": report})
            for name, report in recording.sheets
        ],
        "weight": neglected.weight and {"fitted": neglected.weight.fitted, "g_t_c_over_v": neglected.weight.shares},
        "warnings": _warnings(recording, damping_fit, pair, neglected),
        "masked": damping_fit.points.masked,
        "left_out": [{"line": label, "why": why} for label, why in recording.left_out],
        "flights": [vars(flight) for flight in recording.flights],
        "outliers": [{"point": label, "standard_errors": off} for label, off in damping_fit.outliers],
        "points": [
            dict(zip(("point", "speed", "epsilon", "beta", "residual", "standardized"), row, strict=True))
            for row in zip(*columns.values(), strict=True)
        ],
    }


def _finite(numbers: Sequence[float]) -> list[float | None]:
    """Return numbers for JSON, with None for the infinite end of an interval."""
    return [number if math.isfinite(number) else None for number in numbers]


COMMANDS = (fit,)
