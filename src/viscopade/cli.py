"""The command line. Numbers go to standard output; progress and errors to standard error."""

from __future__ import annotations

import errno
import json
import logging
import os
import sys
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, TextIO, get_args

import click

from viscopade import exact, exports, figures, figures_gas, report, simulators
from viscopade.balls import known_decimal
from viscopade.certificate import Measure
from viscopade.console import (
    DIGITS,
    DIGITS_IF_EXACT,
    DIGITS_OPTION,
    ORDER,
    STYLE,
    Degrees,
    Real,
    Whole,
    keep_printing,
    material,
    need,
    pair_of,
    say,
    show,
    terminal_width,
    tracker,
)
from viscopade.kernels.speed import FAST, SMALL, TIERS
from viscopade.model import Pair
from viscopade.pade import MAX_DEGREE, Pade, Root, pade
from viscopade.paper import CITATION, Entry, approximants, compare
from viscopade.progress import shown_by
from viscopade.scene.description import Scene
from viscopade.series import series
from viscopade.simulators.setup import Setup
from viscopade.writer import check, write, write_all

if TYPE_CHECKING:
    from viscopade.hardcases import Finding

COMPARED_DIGITS = 20
LONGEST = 1 << 24  # bytes of a file that is read
LONGEST_LINE = 5000  # characters of a message
NO_ROOM = {errno.ENOSPC, errno.EFBIG, errno.EDQUOT, errno.EIO, errno.EBADF}  # for what is printed


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="viscopade")
def command() -> None:
    """Coefficient of restitution of viscoelastic spheres: proven series, Padé approximants, generated code."""


@command.command()
@click.option("--out", type=click.Path(path_type=Path), help="Write the exports to this directory.")
@STYLE
@click.pass_context
def reproduce(context: click.Context, out: Path | None, style: str) -> None:
    """Derive the paper's table, compare every printed entry, and write the exports.

    The exit status is 1 if an entry disagrees; nothing is written then.
    """
    if out is not None:
        check([out / name for name in exports.NAMES], parents=True)
    ours = approximants(COMPARED_DIGITS)
    entries = compare(ours)
    agreeing = sum(entry.agrees for entry in entries)
    header = ("[m/n]", "coefficient", "paper", "ours, rounded", "ours", "agrees")
    whole = {"agreeing": agreeing, "entries": [_entry_json(entry) for entry in entries]}
    show(style, header, map(_entry_row, entries), whole, title=CITATION)
    if style == "text":
        say(f"{agreeing} of {len(entries)} printed numbers agree")
        for approximant in ours:
            say(f"{approximant.label} {approximant.verdict}")
    if agreeing < len(entries):
        if out is not None:
            click.echo("viscopade: nothing is written, because of the disagreement", err=True)
        context.exit(1)
    if out is not None:
        texts = exports.files()
        write_all({out / name: text for name, text in texts.items()}, parents=True)
        if style == "text":
            say(f"wrote {', '.join(texts)} to {out}")


@command.command()
@click.option("--order", type=ORDER, default=20, show_default=True, help="Highest power of v*.")
@DIGITS_OPTION
@STYLE
def coefficients(order: int, digits: int, style: str) -> None:
    """Print the coefficients h_0 … h_ORDER of eps = sum h_k v*^k, every digit proven."""
    h = series(order, digits).decimals()
    show(style, ("k", "h_k"), enumerate(h), {"order": order, "digits": digits, "h": h})


# Unknown options are passed on as arguments, so that a negative degree is refused as what it is.
@command.command("pade", context_settings={"ignore_unknown_options": True})
@click.argument("m", type=Whole("m", 0, MAX_DEGREE))
@click.argument("n", type=Whole("n", 0, MAX_DEGREE))
@DIGITS_OPTION
@STYLE
def pade_command(m: int, n: int, digits: int, style: str) -> None:
    """Print the Padé approximant [M/N]: coefficients, poles, zeros, and where it may be used."""
    p = pade(m, n, digits)
    a, b = p.decimals()
    rows = [(name, i, value, "") for name, values in (("a", a), ("b", b)) for i, value in enumerate(values)]
    rows += [(kind, i, *root.decimals(digits)) for kind, roots in _roots(p) for i, root in enumerate(roots, 1)]
    show(style, ("what", "i", "value or real part", "imaginary part"), rows, _pade_json(p))
    if style == "text":
        say(f"{p.label} {p.verdict}")
        say(f"eps - {p.label} = {known_decimal(p.next_term, 10)} v*^{p.contact_order + 1} + …")
        say(f"digits lost by the linear system: {p.digits_lost}; order conditions met within {p.residual:.1e}")
        for d in p.doublets():
            pole, zero = (" + i ".join(root.decimals(min(digits, 10))) for root in (d.pole, d.zero))
            say(f"Froissart doublet: pole {pole}, zero {zero}, relative distance {d.distance:.1e}")


@command.command()
@click.option("--v-star", help="v* = beta^(1/2) v^(1/10): 0, inf, or 1e-1000 to 1e100.")
@click.option("--beta", help="With --speed, instead of --v-star: beta in (time/length)^(1/5).")
@click.option("--speed", help="Impact speed in length/time, in any consistent units.")
@material("young_modulus", "poisson_ratio", "density", "dissipative_constant")
@DIGITS_IF_EXACT
@STYLE
def epsilon(
    v_star: str | None, beta: str | None, speed: str | None, digits: int | None, style: str, **options: Any
) -> None:
    """Print the exact coefficient of restitution, maximal compression and contact time.

    At v*, or at a beta and a speed, every digit is proven; x_max and tau_c are in units of (rho/m_eff)^(-2/5) v^(4/5)
    and (rho/m_eff)^(-2/5) v^(-1/5). For spheres of a material at a speed, the numbers are double precision and in the
    units of the arguments.
    """
    pair = pair_of(**options)
    if pair is not None:
        if v_star is not None or beta is not None or digits is not None or speed is None:
            raise click.UsageError("with a material, accepted is --speed, and none of --v-star, --beta and --digits")
        _show_numbers(_at_speed(pair, Real("speed").convert(speed, None, None)), {}, style)
        return
    if (v_star is None) == (beta is None and speed is None) or (beta is None) != (speed is None):
        raise click.UsageError("accepted is either --v-star, or both --beta and --speed, or a material and --speed")
    collision = exact.collision(v_star, 30 if digits is None else digits, beta=beta, speed=speed)
    _show_numbers(collision.decimals(), {"digits": collision.digits}, style)


@command.command()
@click.option("--epsilon", help="Coefficient of restitution, > 0 and <= 1.")
@click.option("--one-minus-epsilon", help="1 - epsilon instead, for nearly elastic collisions.")
@click.option("--speed", help="Impact speed; then beta is printed, too.")
@material("young_modulus", "poisson_ratio", "density")
@DIGITS_OPTION
@STYLE
def invert(
    epsilon: str | None, one_minus_epsilon: str | None, speed: str | None, digits: int, style: str, **options: Any
) -> None:
    """Print the v* that leads to a coefficient of restitution; with a speed beta, and with a material A.

    Every digit is proven, but A is double precision and in the units of the arguments.
    """
    if (epsilon is None) == (one_minus_epsilon is None):
        raise click.UsageError("accepted is exactly one of --epsilon and --one-minus-epsilon")
    pair = pair_of(**options)
    if pair is not None and speed is None:
        raise click.UsageError("a material also needs --speed")
    collision = exact.invert(epsilon, digits, one_minus_epsilon=one_minus_epsilon, speed=speed)
    numbers = collision.decimals()
    if pair is not None:
        precise = exact.invert(epsilon, max(digits, 20), one_minus_epsilon=one_minus_epsilon, speed=speed)
        numbers["dissipative_constant"] = repr(pair.dissipative_constant(precise.floats()["beta"]))
    _show_numbers(numbers, {"digits": digits}, style)


def _at_speed(pair: Pair, speed: float) -> dict[str, str]:
    """Return what happens at a speed, in double precision."""
    numbers = {
        "beta": pair.beta,
        "v_star": pair.v_star(speed),
        "epsilon": pair.epsilon(speed),
        "one_minus_epsilon": pair.one_minus_epsilon(speed),
        "max_compression": pair.max_compression(speed),
        "contact_time": pair.contact_time(speed),
    }
    return {name: repr(float(value)) for name, value in numbers.items()}


def _show_numbers(numbers: dict[str, str], context: dict[str, Any], style: str) -> None:
    show(style, ("quantity", "value"), numbers.items(), {**context, **numbers})


@command.command()
@click.argument("target", type=click.Choice([*exports.TARGETS, "series-csv", "series-json"]))
@click.option(
    "--pade",
    type=Degrees(),
    multiple=True,
    help="A Padé approximant, such as 3/6; repeat for more. Default: the four of the paper's table.",
)
@click.option("--minimax", type=Degrees(), multiple=True, help="A best approximant on an interval, such as 1/4.")
@click.option(
    "--accuracy",
    multiple=True,
    help="Proven error, such as 1e-5: the cheapest best approximant on the interval, or, without one, the smallest "
    "kernel for all v* >= 0.",
)
@click.option("--inverse", multiple=True, help="Proven relative error of a kernel for v*(eps).")
@click.option("--epsilon-min", default="0", show_default=True, help="The inverse's end; 0: for all of (0, 1].")
@click.option("--v-star-max", help="The interval's end, for --minimax and --accuracy.")
@click.option("--v-star-min", default="0", show_default=True, help="Its beginning.")
@click.option(
    "--measure",
    type=click.Choice(get_args(Measure)),
    default="both",
    show_default=True,
    help="Error relative to the smaller of eps and 1 - eps, or to eps.",
)
@click.option("--full", is_flag=True, help="The kernels of full accuracy, in C.")
@click.option(
    "--from-speed",
    type=click.Choice(TIERS),
    multiple=True,
    help="A kernel from speed and beta to eps without a root, of this accuracy, in C.",
)
@click.option("--size", type=click.Choice((FAST, SMALL)), default=FAST, show_default=True, help="Of its table.")
@click.option("--order", type=ORDER, default=exports.SERIES_ORDER, show_default=True, help="For series-csv and -json.")
@click.option("--digits", type=DIGITS, default=exports.SERIES_DIGITS, show_default=True, help="Likewise.")
@click.option("-o", "--output", type=click.Path(path_type=Path), help="File to write; default: standard output.")
def export(target: str, order: int, digits: int, output: Path | None, **wanted: Any) -> None:
    """Generate code or tables: C, CUDA, GLSL, WGSL, JavaScript, Fortran, Rust, Julia, Python, CSV, JSON, LaTeX.

    An existing file is replaced only if viscopade generated it.
    """
    if target.startswith("series-"):
        text = exports.render_series(target.removeprefix("series-"), order, digits)
    else:
        request = exports.Request(**wanted)
        text = (request if request != exports.Request() else exports.default(target)).render(target)
    if output is None:
        click.echo(text, nl=False)
    else:
        write(output, text)


@command.command()
@click.option("--only", "names", multiple=True, help="Names of claims; repeat for more. Default: all.")
@STYLE
def claims(names: tuple[str, ...], style: str) -> None:
    """Check every statement of the paper that can be checked, and print our verdict with the evidence."""
    from viscopade.claims import UNCHECKED, check

    findings = [finding.to_json() for finding in check(names or None)]
    counts = Counter(finding["verdict"] for finding in findings)
    unchecked = [] if names else [entry._asdict() for entry in UNCHECKED]
    if style == "text":
        for finding in findings:
            say(f"{finding['name']}  ({finding['place']})", 2)
            say(f"  claim:    {finding['statement']}", 12)
            say(f"  verdict:  {finding['verdict']} ({finding['kind']})", 12)
            say(f"  evidence: {finding['summary']}", 12)
            click.echo()
        for entry in unchecked:
            say(f"not checked: {entry['statement']} ({entry['place']}): {entry['reason']}", 2)
        say(", ".join(f"{verdict}: {number}" for verdict, number in sorted(counts.items(), reverse=True)))
        return
    header = ("name", "place", "statement", "verdict", "kind", "summary")
    rows = ([finding[column] for column in header] for finding in findings)
    show(style, header, rows, {"claims": findings, "unchecked": unchecked, "verdicts": counts})


@command.command("figures")
@click.option("--out", type=click.Path(path_type=Path), required=True, help="Directory to write to.")
@click.option("--only", "names", multiple=True, type=click.Choice(list(figures_gas.FIGURES)), help="Repeat for more.")
@click.option(
    "--format", "formats", multiple=True, type=click.Choice(figures.FORMATS), default=("svg",), show_default=True,
    help="Repeat for more.",
)  # fmt: skip
def figures_command(out: Path, names: tuple[str, ...], formats: tuple[str, ...]) -> None:
    """Draw the paper's figures, and those that it could not show."""
    need("matplotlib", "figures")
    pictures = figures.render(names or None, formats)
    write_all({out / name: picture for name, picture in pictures.items()}, parents=True)
    click.echo(f"wrote {', '.join(pictures)} to {out}")


@command.command("bench")
@click.option("--rounds", type=Whole("rounds", 1, 10_000), help="Measurements of each.  [default: 20]")
@click.option(
    "--memory-elements",
    type=Whole("memory elements", 1 << 10, 1 << 28),
    help="Length of the arrays from memory.  [default: 8388608]",
)
@click.option("--beta", type=Real("beta"), help="Of the material.  [default: 1.307, ice]")
@click.option("--speed-min", type=Real("speed_min"), help="The lowest impact speed.  [default: 0.001]")
@click.option("--speed-max", type=Real("speed_max"), help="The highest impact speed.  [default: 1000]")
@click.option("--unit", help="Of the speeds.  [default: cm/s]")
@click.option("--only", multiple=True, help="Kernels or rivals by id or its beginning; repeat for more. Default: all.")
@click.option("--cc", help="Command of the C compiler. Default: the environment's CC, or cc.")
@click.option(
    "--headers",
    type=click.Path(path_type=Path),
    help="Directory with the exported headers. Default: they are made, which takes minutes.",
)
@click.option(
    "--cuda",
    type=Real("cuda"),
    help="Ratio of CUDA kernel to device copy, measured elsewhere, for the table of targets.",
)
@click.option("--quick", is_flag=True, help="Few rounds and elements: to see that it runs, not to learn times.")
@click.option("--out", type=click.Path(path_type=Path), help="Write the result to this file, as JSON.")
@STYLE
def bench_command(
    only: tuple[str, ...], rounds: int | None, memory_elements: int | None, quick: bool, cuda: float | None,
    cc: str | None, headers: Path | None, out: Path | None, style: str, **scene: Any,
) -> None:  # fmt: skip
    """Measure all kernels and their rivals on the same speeds, compiled on the spot, and how far they are off."""
    from viscopade import bench
    from viscopade.bench import compilers, tables

    given = bench.Scene(**{name: value for name, value in scene.items() if value is not None})
    if out is not None:
        check([out])
    settings = bench.Settings(rounds, memory_elements, given, only, quick, cuda)
    read = None if headers is None else partial(compilers.read_from, headers)
    measured = bench.run(settings, cc, read)
    whole = measured.to_json()
    if out is not None:
        write(out, json.dumps(whole, ensure_ascii=False, indent=1) + "\n")
    if style != "text":
        show(style, tables.HEADER, tables.long(measured), whole)
        return
    for line in tables.introduction(measured):
        say(line)
    for table in tables.tables(measured):
        show(style, table.header, table.rows, {}, title=table.title)
    for line in tables.notes(measured):
        say(line)


@command.command("report")
@click.option("--out", type=click.Path(path_type=Path), required=True, help="Directory to write to.")
@click.option(
    "--from", "result", type=click.Path(path_type=Path, exists=True, dir_okay=False),
    help="What `viscopade bench --out` wrote. Default: the benchmark is run, which takes minutes.",
)  # fmt: skip
@click.option(
    "--format", "formats", multiple=True, type=click.Choice(report.FORMATS), default=report.FORMATS, show_default=True,
    help="Of the picture beside the page; repeat for more.",
)  # fmt: skip
def report_command(out: Path, result: Path | None, formats: tuple[str, ...]) -> None:
    """Write what the benchmark found as one HTML page, and the picture of time against error."""
    need("matplotlib", "report")
    check([out / "report.html"], parents=True)
    if result is None:
        from viscopade import bench

        data, source = bench.run(bench.Settings()).to_json(), "result"
    else:
        content = read_file(result, "what `viscopade bench --out` wrote")
        data, source = report.from_json(content, str(result)), str(result)
    files = report.render(data, formats, source=source)
    write_all({out / name: content for name, content in files.items()}, parents=True)
    click.echo(f"wrote {', '.join(files)} to {out}")


@command.command("scene")
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="Directory to write the generated file to.")
@click.option(
    "--costs",
    type=click.Path(path_type=Path),
    help="What `viscopade bench --out` wrote, for times instead of counted operations.",
)
@click.option(
    "--check/--no-check",
    "checking",
    default=True,
    help="Compile and run what is generated, where the tool is there, and compare.",
)
@click.option("--cc", help="Command of the C compiler for the check. Default: the environment's CC, or cc.")
@STYLE
def scene_command(file: Path, out: Path | None, costs: Path | None, checking: bool, cc: str | None, style: str) -> None:
    """Find the cheapest kernel that is good enough for the scene in a TOML file, and generate it.

    The keys of the file are described in docs/usage/scenes.md; examples/ has ready scenes.
    """
    from viscopade.bench import compilers
    from viscopade.report.result import checked
    from viscopade.scene import check as run
    from viscopade.scene import choice, cost, render, tables

    scene = read_scene(file)
    if out is not None:
        check([out / render.file_name(scene)], parents=True)
    by = cost.Costs()
    if costs is not None:
        content = read_file(costs, "what `viscopade bench --out` wrote")
        result = checked(report.from_json(content, str(costs)), str(costs))
        by = cost.measured(result, scene.code, compilers.processor())
    found = choice.choose(scene, by)
    verdict = text = None
    if out is not None or checking:
        text = render.render(found, f"viscopade scene {file.name}")
    if checking and text is not None:
        verdict = run.check(found, text, cc)
    if out is not None and text is not None:
        write_all({out / render.file_name(scene): text}, parents=True)
    if style != "text":
        show(style, tables.KERNELS, tables.kernels(found), tables.to_json(found, verdict))
        return
    say(tables.summary(found))
    show(style, tables.PAIRS, tables.pairs(found), {}, title=scene.title)
    show(style, tables.KERNELS, tables.kernels(found), {}, title=f"Kernels, {found.costs.unit}; errors are proven")
    for line in tables.sentences(found):
        say(line)
    if verdict is not None:
        say(tables.checked(verdict))
    if out is not None:
        click.echo(f"wrote {render.file_name(scene)} to {out}")


@command.command("hardcases")
@click.option("--only", "names", multiple=True, help="Names of cases; repeat for more. Default: all.")
@click.option("--thorough", is_flag=True, help="More points, orders, inputs: half an hour instead of a minute.")
@click.option("--out", type=click.Path(path_type=Path), help="Directory for the page, its figures and the numbers.")
@click.option(
    "--from",
    "result",
    type=click.Path(path_type=Path),
    help="Show the hard-cases.json that was written before; with --only, those cases are run again and replaced.",
)
@STYLE
@click.pass_context
def hardcases_command(
    context: click.Context, names: tuple[str, ...], thorough: bool, out: Path | None, result: Path | None, style: str
) -> None:
    """Try to break every part of viscopade, and print what happened.

    The exit status is 1 if a check does not hold.
    """
    from viscopade import hardcases
    from viscopade.hardcases import page

    known = () if result is None else hardcases.from_json(read_file(result, "what `--out` wrote"), str(result))
    wanted = hardcases.named(names or None) if names or result is None else ()
    if thorough and not wanted:
        raise click.UsageError("accepted with --from and --thorough is also --only: otherwise nothing is run")
    if out is not None:
        need("matplotlib", "hardcases --out")
        cases = [finding.name for finding in known] + [case.name for case in wanted]
        check([out / name for name in page.names(cases)], parents=True)
    fresh = hardcases.check([case.name for case in wanted], thorough=thorough)
    findings = hardcases.merged(known, fresh)
    files = page.files(findings) if out is not None else {}
    if out is not None:  # before anything is printed, which may fail after all that time
        write_all({out / name: content for name, content in files.items()}, parents=True)
    if style == "json":
        click.echo(page.numbers(findings), nl=False)
    elif style == "text":
        _show_findings(findings)
        if out is not None:
            say(f"wrote {', '.join(files)} to {out}")
    else:
        show(style, page.LONG, page.long(findings, str if style == "csv" else page.number), {})
    if not all(finding.result.passes for finding in findings):
        context.exit(1)


def _show_findings(findings: Sequence[Finding]) -> None:
    from viscopade.hardcases import page

    for finding in findings:
        click.echo(page.introduction(finding, terminal_width()))
        for table in finding.result.tables:
            show("text", table.header, table.rows, {}, title=table.title)
        rows = page.checks(finding)
        show("text", page.CHECKS, rows, {}, title="What must hold")
    for finding in findings:
        say(f"{finding.name}: {page.verdict(finding)}")


@command.command("simulators")
@click.argument("target", type=click.Choice(simulators.TARGETS))
@click.argument("file", type=click.Path(path_type=Path), required=False)
@click.option("--epsilon", type=Real("epsilon"), help="Instead of a scene: eps of two spheres, at --speed.")
@click.option("--speed", type=Real("speed"), help="The impact speed at which it is known.")
@material("young_modulus", "poisson_ratio", "density", "dissipative_constant")
@click.option("--tier", type=click.Choice(TIERS), help="Of the kernel for REBOUND.  [default: 1e-5]")
@click.option("-o", "--output", type=click.Path(path_type=Path), help="File to write; default: standard output.")
def simulators_command(
    target: str,
    file: Path | None,
    epsilon: float | None,
    speed: float | None,
    tier: str | None,
    output: Path | None,
    **options: Any,
) -> None:
    """Give a simulator's own parameters for a scene, or for a material (SI units) and eps at a speed.

    LAMMPS, REBOUND (C or Python), MercuryDPM, YADE and LIGGGHTS.
    """
    if output is not None:
        check([output])
    if file is None:
        setup = _setup_of_material(epsilon, speed, options)
        words = _words(epsilon=epsilon, speed=speed, **options)
        source = f"viscopade simulators {target} {words}"
    else:
        from viscopade.scene import units

        if epsilon is not None or speed is not None or pair_of(**options) is not None:
            raise click.UsageError("accepted is either a scene or a material with --speed, not both")
        setup, source = units.setup(read_scene(file)), f"viscopade simulators {target} {file.name}"
    if tier is not None and not target.startswith("rebound"):
        raise click.UsageError("accepted is --tier for rebound-c and rebound-python only: the others compute the force")
    source += "" if tier is None else f" --tier {tier}"
    text = simulators.render(target, setup, source, tier or "1e-5")
    if output is None:
        click.echo(text, nl=False)
    else:
        write(output, text)


def _setup_of_material(epsilon: float | None, speed: float | None, options: dict[str, Any]) -> Setup:
    """Return one pair of bodies, with A or with the one that leads to eps."""
    constant = options["dissipative_constant"]
    if (epsilon is None) == (constant is None):
        raise click.UsageError(
            "accepted is a scene, or a material with --speed and either --epsilon or --dissipative-constant"
        )
    options = options | {"dissipative_constant": 0.0 if constant is None else constant}
    pair = pair_of(**options)
    if pair is None or speed is None:
        raise click.UsageError("a material also needs --speed, the impact speed that matters")
    if epsilon is not None:
        pair = pair.calibrated(speed, epsilon)
    return simulators.of_pair(pair, speed)


def _words(**options: Any) -> str:
    """Return options as they were given."""
    words = []
    for name, value in options.items():
        flag = "--" + {"radii": "radius"}.get(name, name).replace("_", "-")
        if value is True:
            words.append(flag)
        elif isinstance(value, tuple):
            words += (f"{flag} {item:g}" for item in value)
        elif value is not None and value is not False:
            words.append(f"{flag} {value:g}")
    return " ".join(words)


def read_scene(file: Path) -> Scene:
    """Return the scene in a file."""
    from viscopade.scene import from_toml

    return from_toml(read_file(file, "a scene in TOML (docs/usage/scenes.md)"), str(file))


def read_file(file: Path, accepted: str) -> bytes:
    """Return what a file holds.

    Raises
    ------
    ValueError
        If it cannot be read, or is far too long.
    """
    try:
        with file.open("rb") as stream:
            content = stream.read(LONGEST + 1)
    except OSError as error:
        raise ValueError(f"cannot read {file}: {error.strerror or error}; accepted is {accepted}") from None
    if len(content) > LONGEST:
        raise ValueError(f"{file} has more than {LONGEST} bytes: accepted is {accepted}")
    return content


def _entry_row(entry: Entry) -> tuple[str, ...]:
    agrees = "yes" if entry.agrees else "NO"
    return f"[{entry.m}/{entry.n}]", entry.name, entry.printed, entry.rounded, entry.ours, agrees


def _entry_json(entry: Entry) -> dict[str, Any]:
    fields = ("m", "n", "symbol", "index", "printed", "rounded", "ours", "agrees")
    return {name: getattr(entry, name) for name in fields}


def _roots(p: Pade) -> tuple[tuple[str, tuple[Root, ...]], ...]:
    return ("pole", p.poles), ("zero", p.zeros)


def _root_json(root: Root, digits: int) -> dict[str, Any]:
    real_part, imaginary_part = root.decimals(digits)
    result: dict[str, Any] = {
        "re": real_part,
        "im": imaginary_part,
        "multiplicity": root.multiplicity,
        "real": root.real,
        "positive": root.positive,
    }
    if root.residue is not None:
        residue = complex(root.residue)
        result["residue"] = {"re": residue.real, "im": residue.imag}
    return result


def _pade_json(p: Pade) -> dict[str, Any]:
    a, b = p.decimals()
    return {
        "m": p.m,
        "n": p.n,
        "digits": p.digits,
        "a": a,
        "b": b,
        "poles": [_root_json(root, p.digits) for root in p.poles],
        "zeros": [_root_json(root, p.digits) for root in p.zeros],
        "doublets": [
            {"pole": d.pole.decimals(p.digits), "zero": d.zero.decimals(p.digits), "distance": d.distance}
            for d in p.doublets()
        ],
        "usable": p.usable,
        "verdict": p.verdict,
        "contact_order": p.contact_order,
        "next_term": known_decimal(p.next_term, 10),
        "digits_lost": p.digits_lost,
        "residual": p.residual,
    }


def _fail(message: object, status: int) -> NoReturn:
    """Print one line, in which no character does more than to be seen and no word is endless, and exit."""
    words = (word if len(word) <= 400 else f"{word[:200]}…{word[-200:]}" for word in str(message).split())
    line = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in " ".join(words))
    try:
        click.echo(f"viscopade: {line if len(line) <= LONGEST_LINE else line[:LONGEST_LINE] + '…'}", err=True)
    except OSError:  # nobody can be told; the exit status still says it
        _forget(sys.stderr)
    sys.exit(status)


def _forget(stream: TextIO | None) -> None:
    """Let go of what cannot be printed any more; the interpreter would complain at exit."""
    if stream is not None:
        with suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _run_command() -> object:
    """Run the command that is asked for, and return its exit status, if it says one; without any, print the help."""
    try:
        return command.main(prog_name="viscopade", standalone_mode=False)
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message())
        return 2


def main() -> None:
    """Run the command line; errors are one line, and exit status 2 means that the input was at fault."""
    keep_printing()
    logging.getLogger("matplotlib").setLevel(logging.ERROR)  # where it keeps its cache is no concern of ours
    try:
        with shown_by(tracker):
            status = _run_command()
            if sys.stdout is not None:  # closed by the caller
                sys.stdout.flush()
    except click.ClickException as error:
        _fail(error.format_message(), 2)
    except (ValueError, TypeError) as error:
        _fail(error, 2)
    except ModuleNotFoundError as error:
        _fail(error, 1)
    except (ArithmeticError, RuntimeError) as error:
        _fail(error, 1)
    except MemoryError:
        _fail("there is not enough memory: accepted are fewer digits, a lower order, or fewer inputs at once", 1)
    except BrokenPipeError:  # whoever read the output has had enough
        _forget(sys.stdout)
        sys.exit(1)
    except OSError as error:  # the disk is full, for instance
        _forget(sys.stdout)
        _fail(f"cannot print: {error.strerror or error}" if error.errno in NO_ROOM else error, 1)
    except (click.Abort, KeyboardInterrupt):
        _fail("interrupted", 130)
    sys.exit(status if isinstance(status, int) else 0)
