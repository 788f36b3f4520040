"""Commands that gather evidence: claims, figures, bench, hardcases; `viscopade` loads them when needed.

A function's arguments are the command line's options, whose help says what they mean; its docstring is the help of the
command. Names and formats that may be repeated come as tuples, empty if not given; `style` is text, json or csv.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import astuple
from functools import partial
from pathlib import Path

import click

from viscopade import files
from viscopade.cli.console import (
    SIZE,
    STYLE,
    Command,
    FilePath,
    Whole,
    examples,
    option,
    page_of,
    picture_kind,
    say,
    show,
)
from viscopade.cli.writer import check_targets, write, write_all
from viscopade.extras import require
from viscopade_lab import figures


@click.command(cls=Command, epilog=examples("viscopade claims --only slow-convergence"))
@option("--only", "names", multiple=True, help="Name of a statement; repeatable.  [default: all]")
@option(
    "--verdict", type=click.Choice(["holds", "holds with a limit", "does not hold"]),
    help="Print only statements with this verdict.",
)  # fmt: skip
@STYLE
def claims(names: tuple[str, ...], verdict: str | None, style: str) -> None:
    """Check the paper's statements: verdict and evidence.

    A statement holds, holds with a limit, or does not hold.
    """
    from viscopade_lab.claims import UNCHECKED, check

    # Dictionaries with name, place, statement, verdict, summary, kind and numbers.
    findings = [finding.to_json() for finding in check(names or None)]
    findings = [finding for finding in findings if verdict in (None, finding["verdict"])]
    # One statement is of older work, not of the paper: it has a verdict, but does not count.
    counts = Counter(finding["verdict"] for finding in findings if not finding["place"].startswith("not in the paper"))
    # What cannot be checked is only listed with all claims.
    unchecked = [] if names or verdict else [entry._asdict() for entry in UNCHECKED]
    if style == "text":
        for finding in findings:
            # `say` wraps a paragraph and indents its further lines by this number: 12 letters are "  evidence: ".
            say(f"{finding['name']}  ({finding['place']})", 2)
            say(f"  claim:    {finding['statement']}", 12)
            say(f"  verdict:  {finding['verdict']} ({finding['kind']})", 12)
            say(f"  evidence: {finding['summary']}", 12)
            click.echo()
        for entry in unchecked:
            say(f"not checked: {entry['statement']} ({entry['place']}): {entry['reason']}", 2)
        listed = ", ".join(f"{kind} {number}" for kind, number in sorted(counts.items(), reverse=True))
        say(f"the paper's own statements: {listed or 'none'}")
        return
    header = ("name", "place", "statement", "verdict", "kind", "summary")
    rows = ([finding[column] for column in header] for finding in findings)
    show(style, header, rows, {"claims": findings, "unchecked": unchecked, "verdicts": counts})


@click.command("figures", cls=Command, epilog=examples("viscopade figures --only local-exponent --out pictures"))
@option("--out", type=FilePath(), required=True, help="Directory to write the figures to.")
@option(
    "--only", "names", multiple=True, type=click.Choice(figures.NAMES),
    help="Name of a figure; repeatable.  [default: all]",
)  # fmt: skip
@option(
    "--format", "formats", group="Output", multiple=True, type=click.Choice(figures.FORMATS), default=("svg",),
    show_default=True, help="Format of the figures; repeatable.",
)  # fmt: skip
@SIZE
def figures_command(
    out: Path, names: tuple[str, ...], formats: tuple[str, ...],
    size: tuple[float, float] | None, font_size: float | None,
) -> None:  # fmt: skip
    """Draw the paper's figures, and further ones."""
    from viscopade_lab.figures import registry

    require("figures", "matplotlib")  # else a message that says how to install it
    # All are drawn before the first is written.
    pictures = registry.render(names or figures.NAMES, formats, page_of(None, size, font_size))
    write_all({out / name: picture for name, picture in pictures.items()}, parents=True)
    say(f"wrote {', '.join(pictures)} to {out}")


@click.command("bench", cls=Command, epilog=examples("viscopade bench --only pow --rounds 2"))
# 10,000 rounds would take days: a larger number is a mistake.
@option("--rounds", type=Whole(1, 10_000), help="Number of measurements of each kernel.  [default: 20]")
@option("--only", multiple=True, help="Kernels and rivals whose id begins so; repeatable.  [default: all]")
@option("--cc", group="Advanced", help="C compiler.  [default: CC of the environment, or cc]")
@option(
    "--headers",
    group="Advanced",
    type=FilePath(),
    help="Directory with the exported headers.  [default: make them]",
)
@option(
    "--quick",
    group="Advanced",
    is_flag=True,
    help="Make a trial run with few rounds and elements. Such times have no meaning.",
)
@option(
    "--from", "result", type=click.Path(path_type=Path, exists=True, dir_okay=False),
    help="File of an earlier run's --output to show instead of measuring.",
)  # fmt: skip
@option("-o", "--output", group="Output", type=FilePath(), help="CSV file to write the result to.")
@option("--picture", group="Output", type=FilePath(), help="File for the figure: .svg, .pdf or .png.")
@STYLE
def bench_command(
    only: tuple[str, ...], rounds: int | None, quick: bool, cc: str | None, headers: Path | None,
    result: Path | None, output: Path | None, picture: Path | None, style: str,
) -> None:  # fmt: skip
    """Measure time and error of all kernels and their rivals.

    All are compiled on this machine and run on the same impact speeds. The figure shows error over time.
    """
    from viscopade.kernels import requests
    from viscopade_lab import bench
    from viscopade_lab.bench import libraries
    from viscopade_lab.bench import picture as drawing
    from viscopade_lab.bench.result import COLUMNS, HEADER, from_csv, table, to_csv

    # Everything that can be refused is refused before the measurement, which takes minutes: options, and files that
    # cannot be written.
    chosen_contenders = bench.contenders(only)
    if result is not None and (output is not None or only):
        raise click.UsageError("--from shows a file: expected neither --output nor --only with it")
    if picture is not None:
        require("bench --picture", "matplotlib")
        picture_kind("--picture", picture)
    check_targets([path for path in (output, picture) if path is not None])

    # Measure, or read an earlier measurement. `read` returns the header of a kernel: made now, or from a directory.
    comments: list[str] = []
    if result is not None:
        rows = from_csv(files.content(result, "what `viscopade bench --output` wrote"), str(result))
    else:
        sizes = bench.QUICK if quick else bench.Sizes()
        read = requests.file if headers is None else partial(libraries.read_from, headers)
        # 20 rounds, for a median and quartiles; 3, the fewest that have them, for a trial run.
        comments, rows = bench.run(chosen_contenders, read, rounds or (3 if quick else 20), sizes, cc)

    if output is not None:
        write(output, to_csv(comments, rows))
    if picture is not None:
        write_all({picture: drawing.draw(rows, picture.suffix[1:])})
    if style == "text":
        for comment in comments[1:]:  # the first is the mark of generated files
            say(comment)
        show(style, HEADER, table(rows), {}, title="ns per collision; ratios below 1 are faster")
    else:
        cells = [["" if cell is None else cell for cell in astuple(row)] for row in rows]
        show(style, COLUMNS, cells, {"comments": comments, "rows": [vars(row) for row in rows]})


@click.command("hardcases", cls=Command, epilog=examples("viscopade hardcases --only truncated-series"))
@option("--only", "names", multiple=True, help="Name of a case; repeatable.  [default: all]")
@option("--thorough", is_flag=True, help="Run more points, orders and compilers: minutes instead of seconds.")
@option("--out", type=FilePath(), help="Directory to write the page and its pictures to.")
@STYLE
@click.pass_context
def hardcases_command(
    context: click.Context, names: tuple[str, ...], thorough: bool, out: Path | None, style: str
) -> None:
    """Test viscopade at its numerically hardest inputs.

    The exit status is 1 if a bound does not hold.
    """
    from viscopade_lab import hard_cases

    # Before the cases run, for seconds or minutes, files that cannot be written are refused.
    cases = hard_cases.choose_cases(names)
    if out is not None:
        require("hardcases --out", "matplotlib")
        check_targets([out / hard_cases.PAGE, *(out / f"{case.name}.svg" for case in cases)], parents=True)
    findings = hard_cases.measure_cases(cases, thorough)
    if out is not None:  # before anything is printed, which may fail after all that time
        words = [*(f"--only {name}" for name in names), *["--thorough"] * thorough]
        files = hard_cases.files(cases, findings, " ".join(["viscopade hardcases", *words]))
        write_all({out / name: content for name, content in files.items()}, parents=True)
    rows = hard_cases.rows(cases, findings)
    show(style, hard_cases.HEADER, rows, {"cases": [dict(zip(hard_cases.HEADER, row, strict=True)) for row in rows]})
    if not all(finding.holds for finding in findings):
        context.exit(1)


COMMANDS = (claims, figures_command, bench_command, hardcases_command)
