"""The exact function beside heyoka, a compiled Taylor integrator of any precision: the time of one collision.

Run as `python -m viscopade_lab.studies.against_heyoka --out docs/bench/exact_and_heyoka.csv`: it writes the file and
prints the table of docs/results/benchmark.md; `--from FILE` prints the table of a file. heyoka is on PyPI and on
conda-forge.

heyoka gets the polynomial form of the equation of motion (`direct`), with s = sqrt(x) and dtau = 2 s dtheta,

    ds/dtheta = u,    du/dtheta = -2 s^2 (s^2 + kappa u),    s(0) = 0,  u(0) = 1,

and stops where the force vanishes, s^2 + kappa u = 0. So it needs one integration, and nothing is proven.
"""

from __future__ import annotations

import csv
import io
import platform
import statistics
import time
from collections.abc import Callable, Iterable
from dataclasses import astuple, dataclass, fields
from fractions import Fraction
from importlib.metadata import version
from pathlib import Path
from typing import Any

import click
from mpmath import mp

from viscopade.arithmetic.balls import bits_for
from viscopade.collision import exact
from viscopade.generated import marker_lines
from viscopade.progress import track
from viscopade_lab.bench.libraries import processor
from viscopade_lab.studies.laws import markdown

CASES = ((1, 30), (1, 100), (1, 300), (Fraction(1, 1000), 30), (30, 30))
"""v* and digits."""
GUARD_BITS = 20  # of heyoka's numbers: the errors of all steps add up
INSTALL = "this study needs heyoka, which is not installed: python -m pip install heyoka"


@dataclass(frozen=True)
class Comparison:
    """Times of one collision, in processor time: medians over the rounds.

    Attributes
    ----------
    v_star : float
    digits : int
    heyoka_ms, exact_ms, ratio : float
        The ratio, exact over heyoka, is the median of the ratios within a round.
    compilation_s : float
        Time to compile heyoka's integrator, once for each precision.
    difference : float
        |eps of heyoka/eps - 1|.
    """

    v_star: float
    digits: int
    heyoka_ms: float
    exact_ms: float
    ratio: float
    compilation_s: float
    difference: float


COLUMNS = tuple(field.name for field in fields(Comparison))


def collision_by_heyoka(heyoka: Any, v_star: Fraction, digits: int) -> Callable[[], Any]:
    """Return a function that integrates one collision, compiled for so many digits; it returns eps."""
    bits = bits_for(digits) + GUARD_BITS

    def real(number: int) -> Any:
        return heyoka.real(number, bits)

    s, u = heyoka.make_vars("s", "u")
    force = s * s + heyoka.par[0] * u
    kappa = real(v_star.numerator**2) / real(v_star.denominator**2)
    end = heyoka.t_event(force, fp_type=heyoka.real, direction=heyoka.event_direction.negative)
    motion = heyoka.taylor_adaptive(
        [(s, u), (u, -2 * s * s * force)], [real(0), real(1)], pars=[kappa], t_events=[end], fp_type=heyoka.real,
        prec=bits,
    )  # fmt: skip

    def run() -> Any:
        motion.state[:] = [real(0), real(1)]
        motion.time = real(0)
        motion.reset_cooldowns()
        motion.propagate_until(real(100))
        return -motion.state[1]

    return run


def _timed(run: Callable[[], Any]) -> tuple[float, Any]:
    """Return seconds of processor time, which other work disturbs little, and the result."""
    start = time.process_time()
    result = run()
    return time.process_time() - start, result


def compare(heyoka: Any, v_star: Fraction, digits: int, rounds: int) -> Comparison:
    """Measure both in turns."""
    compilation, by_heyoka = _timed(lambda: collision_by_heyoka(heyoka, v_star, digits))

    def ours() -> Any:
        return exact.epsilon(v_star, digits)

    ours(), by_heyoka()
    times = [
        [_timed(run)[0] * 1e3 for run in (by_heyoka, ours)]
        for _ in track(range(rounds), f"v* = {v_star}, {digits} digits")
    ]
    with mp.workdps(digits + 10):
        difference = abs(mp.mpf(str(by_heyoka())) / exact.epsilon(v_star, digits + 5) - 1)
        if difference > mp.mpf(10) ** -digits:
            raise ArithmeticError(
                f"heyoka and the exact function differ by {mp.nstr(difference, 3)} at {digits} digits"
            )
    first, second = (statistics.median(column) for column in zip(*times, strict=True))
    ratio = statistics.median(own / other for other, own in times)
    return Comparison(float(v_star), digits, first, second, ratio, compilation, float(difference))


def to_csv(rows: Iterable[Comparison], rounds: int, installed: str) -> str:
    """Return the file's text: comments on machine and conditions, and one line for each number of digits."""
    packages = ", ".join(f"{name} {version(name)}" for name in ("python-flint", "mpmath"))
    comments = [
        *marker_lines("python -m viscopade_lab.studies.against_heyoka"),
        f"{processor()}; Python {platform.python_version()}, {packages}, heyoka {installed}",
        f"processor time; medians of {rounds} rounds",
    ]
    buffer = io.StringIO()
    buffer.writelines(f"# {comment}\n" for comment in comments)
    cells = ([f"{x:.3g}" if isinstance(x, float) else x for x in astuple(row)] for row in rows)
    csv.writer(buffer, lineterminator="\n").writerows([COLUMNS, *cells])
    return buffer.getvalue()


def table(text: str) -> str:
    """Return the table of the page, in Markdown, from the file's text."""
    head = (
        r"$v_\ast$",
        "digits",
        "heyoka, no proof",
        "`exact.epsilon`, proven",
        "exact/heyoka",
        "heyoka compiles",
        "difference",
    )
    lines = csv.DictReader(line for line in text.splitlines() if not line.startswith("#"))
    rows = (
        [row["v_star"], row["digits"], *(f"{float(row[name]):g} ms" for name in ("heyoka_ms", "exact_ms")),
         row["ratio"], f"{row['compilation_s']} s", row["difference"]] for row in lines
    )  # fmt: skip
    return markdown(head, rows)


@click.command(help=(__doc__ or "").partition("\n\n")[0])
@click.option("--out", type=click.Path(path_type=Path), help="CSV file to write the result to.")
@click.option("--from", "result", type=click.Path(path_type=Path, exists=True), help="File of an earlier run to show.")
@click.option("--rounds", type=click.IntRange(1), default=15, show_default=True, help="Measurements of each.")
def main(out: Path | None, result: Path | None, rounds: int) -> None:
    """Measure, and print the table."""
    if result is None:
        try:
            import heyoka
        except ImportError:
            raise click.UsageError(INSTALL) from None
        text = to_csv([compare(heyoka, Fraction(v), digits, rounds) for v, digits in CASES], rounds, heyoka.__version__)
        if out is not None:
            out.write_text(text, encoding="utf-8")
    else:
        text = result.read_text(encoding="utf-8")
    click.echo(table(text))


if __name__ == "__main__":
    main()
