"""Our minimax fits against those of others: baryrat, SciPy's AAA, Sollya's remez and fpminimax.

Run as `python -m viscopade_lab.studies.compare_minimax`. No other program can do the problem of `minimax`, a weight
that vanishes together with the condition a_1 = b_1. So each is compared on a problem that it can do:

    baryrat   eps by [m/n] without conditions, absolute error (no weights)
    AAA       the same with m = n; it is near-best only
    Sollya    (1 - eps)/v*^2 by polynomials, relative error, which is our elastic [m/0]; then float coefficients

An error is the largest on a grid that is the same for all. A case counts as converged if its error is within 1 % of the
smallest possible one (AAA: within a factor 10, with no pole on the interval). Programs that are not installed are
skipped, with the reason: baryrat is on PyPI, Sollya a Debian package.
"""

from __future__ import annotations

import argparse
import math
import shutil
import statistics
import subprocess
import time
import warnings
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from fractions import Fraction
from functools import partial
from itertools import product
from typing import Any

import numpy as np
from flint import arb
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from viscopade.approximation import machine_coefficients, minimax, remez
from viscopade.approximation.lacunary import full_powers
from viscopade.approximation.target import target
from viscopade.arithmetic.balls import exact_middle, working
from viscopade.arithmetic.formats import FLOAT
from viscopade.arrays import double
from viscopade.arrays.checked import FloatArray
from viscopade.theory.series import series

DEGREES = ((1, 4), (3, 3), (2, 5), (3, 6), (5, 5))
SPEEDS = (1.0, 3.0, 10.0, 50.0)
CASES = tuple(product(DEGREES, SPEEDS))
DIAGONAL = tuple(case for case in CASES if case[0][0] == case[0][1])
POLYNOMIALS = tuple(product((4, 6, 8), ("0.1", "0.25")))
POINTS = 20_000
ENOUGH = 1.01
SECONDS = 60  # for a rival's single case

Evaluated = Callable[[FloatArray], FloatArray]


@dataclass
class RivalComparison:
    """One rival on one kind of problem."""

    rival: str
    problem: str
    cannot: str
    skipped: str = ""
    errors: list[tuple[float, float]] = field(default_factory=list)
    """Ours and the rival's (infinite if it gave none)."""
    seconds: list[tuple[float, float]] = field(default_factory=list)
    enough: float = ENOUGH

    def add(self, ours: tuple[float, float], other: tuple[float, float]) -> None:
        """Add the errors and the times of one more fit."""
        self.errors.append((ours[0], other[0]))
        self.seconds.append((ours[1], other[1]))

    @property
    def converged(self) -> tuple[int, int]:
        """Return the numbers of our fits, and of the rival's, that are as good as the better one."""
        least = [min(pair) for pair in self.errors]
        ours, other = zip(*self.errors, strict=True)
        return (
            sum(error <= ENOUGH * best for error, best in zip(ours, least, strict=True)),
            sum(error <= self.enough * best for error, best in zip(other, least, strict=True)),
        )

    @property
    def ratios(self) -> tuple[float, float]:
        """Medians of rival's error and time, over ours."""
        errors = [b / a for a, b in self.errors if math.isfinite(b)]
        return statistics.median(errors or [math.nan]), statistics.median(b / a for a, b in self.seconds)


def tried(run: Callable[[], Any]) -> tuple[Any, float]:
    """Return a result (None if there is none) and the seconds it took."""
    start = time.perf_counter()
    try:
        result = run()
    except (ArithmeticError, ValueError, RuntimeError, subprocess.SubprocessError):
        result = None
    return result, time.perf_counter() - start


def largest_error(approximant: Evaluated | None, v_max: float) -> float:
    """Return the largest error on the grid; infinite if there is no approximant."""
    if approximant is None:
        return math.inf
    v_star = v_max * (1 - np.cos(np.pi * np.arange(POINTS + 1) / POINTS)) / 2
    epsilon = double.epsilon(v_star)
    return float(np.max(np.abs(approximant(v_star) - epsilon)))


def rational(a: Iterable[float], b: Iterable[float]) -> Evaluated:
    """Return N/D on arrays."""
    top, bottom = np.polynomial.Polynomial(list(a)), np.polynomial.Polynomial(list(b))
    return lambda v: top(v) / bottom(v)


def ours_free(m: int, n: int, v_max: float) -> tuple[float, float]:
    """Return our error and time for [m/n] without conditions."""

    def values(v: arb) -> tuple[arb, arb]:
        return target(v).loss, arb(1)

    problem = remez.Problem(full_powers(m, n), values, (0.0, v_max))
    found, seconds = tried(lambda: remez.solve(problem))
    approximant = found and rational(map(float, found.a), map(float, found.b))
    return largest_error(approximant, v_max), seconds


# --- the rivals -------------------------------------------------------------------------------------------------------


def against_baryrat() -> RivalComparison:
    """BRASIL, in doubles."""
    result = RivalComparison(
        "baryrat.brasil", "free [m/n], absolute", "no weights, no conditions; without gmpy2 in doubles"
    )
    try:
        import baryrat  # type: ignore[import-not-found]
    except ImportError:
        result.skipped = "baryrat is not installed (pip install baryrat)"
        return result
    for (m, n), v_max in CASES:
        found, seconds = tried(lambda m=m, n=n, v=v_max: baryrat.brasil(double.epsilon, (0, v), (m, n)))  # type: ignore[misc]
        result.add(ours_free(m, n, v_max), (largest_error(found, v_max), seconds))
    return result


def against_aaa() -> RivalComparison:
    """AAA on 2001 samples."""
    result = RivalComparison(
        "scipy AAA", "free [k/k], absolute", "m = n only, not minimax, no weights, doubles", enough=10
    )
    try:
        from scipy.interpolate import AAA
    except ImportError:
        result.skipped = "SciPy is absent or older than 1.15"
        return result
    for (m, n), v_max in DIAGONAL:
        v_star = v_max * (1 - np.cos(np.pi * np.arange(2001) / 2000)) / 2
        values = double.epsilon(v_star)
        found, seconds = tried(lambda x=v_star, y=values, k=m: AAA(x, y, max_terms=k + 1, rtol=0))  # type: ignore[misc]
        poles = found.poles()
        if np.any((abs(poles.imag) < 1e-9) & (poles.real >= 0) & (poles.real <= v_max)):
            found = None
        result.add(ours_free(m, n, v_max), (largest_error(found, v_max), seconds))
    return result


def against_sollya() -> tuple[RivalComparison, RivalComparison]:
    """Sollya's remez and fpminimax for (1 - eps)/v*^2, given as a Taylor polynomial."""
    best = RivalComparison(
        "Sollya remez", "(1 - eps)/v*^2 by polynomials, relative", "polynomials only; eps is not known to it"
    )
    machine = RivalComparison("Sollya fpminimax", "the same, float coefficients", "polynomials only")
    if shutil.which("sollya") is None:
        best.skipped = machine.skipped = "sollya is not installed (Debian package sollya)"
        return best, machine
    for m, v_max in POLYNOMIALS:
        interval = minimax.interval_of(0, v_max)
        fit, fitted = tried(partial(minimax._fit.__wrapped__, m, 0, interval))
        (real, first), (rounded, second) = _by_sollya(m, v_max)
        best.add((fit.error, fitted), (_error(fit, real), first))
        ours, seconds = tried(lambda fit=fit: machine_coefficients.machine(fit, FLOAT))  # type: ignore[misc]
        as_floats = [Fraction(FLOAT.nearest(c)) for c in rounded]
        machine.add((ours.error, seconds), (_error(fit, as_floats), second))
    return best, machine


def _error(fit: minimax.Fit, loss: list[Fraction]) -> float:
    """Return the error of 1 - v*^2 (c_0 + c_1 v* + …) on the fit's interval; infinite without coefficients."""
    if not loss:
        return math.inf
    task = minimax.minimax_problem(fit.m, 0, fit.interval)
    with working(task.bits):
        a = [arb(1), arb(0), *(-arb(c.numerator) / c.denominator for c in loss)]
        return remez.sup_error(task, a, [arb(1)], fit.points)


def _by_sollya(m: int, v_max: str) -> tuple[tuple[list[Fraction], float], tuple[list[Fraction], float]]:
    """Return the coefficients of both routines, and times without Sollya's start."""
    h = series(60, 30).h
    taylor = "+".join(f"({c.numerator}/{c.denominator})*x^{k}" for k, c in enumerate(-exact_middle(x) for x in h[2:]))
    powers = "[|" + ",".join(map(str, range(m - 1))) + "|]"
    common = f"prec=165!;display=dyadic!;f={taylor};"
    runs = {
        "": common,
        "remez": f"{common}p=remez(1,{powers},[0;{v_max}],1/f);",  # of p/f - 1
        "fpminimax": f"{common}p=fpminimax(f,{powers},[|SG...|],[0;{v_max}],1,relative,floating);",
    }
    found = {}
    for name, code in runs.items():
        output = f"for i from 0 to {m - 2} do print(coeff(p,i));" if name else ""
        found[name] = tried(lambda code=code + output + "quit;": _sollya(code))  # type: ignore[misc]
    start = found[""][1]
    (real, first), (rounded, second) = (found[name] for name in ("remez", "fpminimax"))
    return (real or [], max(first - start, 1e-3)), (rounded or [], max(second - start, 1e-3))


def _sollya(code: str) -> list[Fraction]:
    """Return the dyadic numbers that a program prints."""
    run = subprocess.run(["sollya", "--warnonstderr"], input=code, capture_output=True, text=True, timeout=SECONDS)
    return [_dyadic(word) for word in run.stdout.split()]


def _dyadic(word: str) -> Fraction:
    mantissa, _, exponent = word.partition("b")
    return int(mantissa) * Fraction(2) ** int(exponent or 0)


# --- the table --------------------------------------------------------------------------------------------------------


def main() -> None:
    """Run everything, and print the table."""
    table = Table(
        *("rival", "problem", "cases", "ours", "rival's", "error", "time", "what it cannot do"),
        title="converged; rival/ours, medians",
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        results = [against_baryrat(), against_aaa(), *against_sollya()]
    for result in results:
        if result.skipped:
            table.add_row(result.rival, escape(result.problem), *["-"] * 5, f"skipped: {result.skipped}")
            continue
        numbers = (str(len(result.errors)), *map(str, result.converged), *(f"{ratio:.3g}" for ratio in result.ratios))
        table.add_row(result.rival, escape(result.problem), *numbers, result.cannot)
    Console(width=150).print(table)


if __name__ == "__main__":
    argparse.ArgumentParser(description=__doc__).parse_args()
    main()
