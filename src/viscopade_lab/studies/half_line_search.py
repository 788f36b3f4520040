"""The search for the smallest kernels: eps(v*) on all v* >= 0, and its inverse.

Forms that are compared. Errors are sampled; "rough" ones come from Lawson's iteration on a grid and bound what the best
coefficients reach from above, mostly to a few per cent; "levelled" ones from Remez's algorithm:

    power     eps = (N/D)^r in v*: P(v*)^(-1/3), (N/D)^(2/3), …
    odds      eps = (1 + p c v*^2 (N/D)^r)^(-1/p) in v*: for p = r = 1, 1/eps - 1 = c v*^2 N/D
    pieces    [m/n] in v* up to V, then v*^(-10/3) times a polynomial in 1/v*
    gaps      1/eps - 1 = c v*^2 N(y)/D(y), y = v*^(1/3), all choices of few powers (or, for many, a local search)
    inverse   v* = s N(s)/D(s) with s = sqrt(1 - eps) or s = sqrt((1 - eps)/eps) on [eps_min, 1]; with gaps in
              q^(1/10), q = (1 - eps)/eps, on (0, 1]

Run as `python -m viscopade_lab.studies.half_line_search --out FILE.csv`: 1 to 2 minutes, the same each time. `--deep 6`
adds a local search of so many seconds for each split of 6 and more coefficients (6 minutes in all, not the same each
time). It finds some of the powers that `half_line` and `inverse` recommend; the others come from runs that were longer.
"""

from __future__ import annotations

import csv
import random
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from itertools import combinations, pairwise
from typing import NamedTuple, TextIO

import click
import numpy as np
import numpy.typing as npt

from viscopade.approximation import half_line, inverse
from viscopade.approximation.lacunary import Powers, full_powers
from viscopade.approximation.lawson import Rough, Sample, rough
from viscopade.arrays import double
from viscopade.progress import track

FloatArray = npt.NDArray[np.float64]

BATCH = 256
EXHAUSTIVE = 5  # coefficients
DEEP = range(6, 13)
HIGHEST = 26  # power of y
KEPT = 3  # choices that are reported
MOST = 12  # coefficients of full polynomials
C = -double.one_minus_epsilon(1e-20) * -1e40


class FormRow(NamedTuple):
    """One line of the table."""

    kind: str
    form: str
    powers: str
    coefficients: int
    measure: str
    error: float
    method: str


def dense_v_star() -> FloatArray:
    """Return v* dense enough for rough fits on the half-line."""
    return half_line.half_line_sample("relative").y ** 3


def weights(measure: str, v_star: FloatArray) -> FloatArray:
    """Return the factor that makes |d eps|/eps the measure."""
    epsilon, loss = double.epsilon(v_star), double.one_minus_epsilon(v_star)
    return np.maximum(1, epsilon / loss) if measure == "both" else np.ones_like(v_star)


# --- full polynomials -------------------------------------------------------------------------------------------------


def powers_of_quotients() -> Iterator[FormRow]:
    """Eps = (N/D)^r."""
    v_star = dense_v_star()
    epsilon = double.epsilon(v_star)
    for r in (Fraction(1, 3), Fraction(2, 3), Fraction(5, 6), Fraction(10, 9), Fraction(5, 3), Fraction(10, 3)):
        more = int(Fraction(10, 3) / r)
        sample = Sample(v_star, epsilon ** float(1 / r), np.full_like(v_star, float(r)))
        for m in range((MOST - more) // 2 + 1):
            error = rough([full_powers(m, m + more)], sample).error[0]
            yield FormRow("power", f"(N/D)^({r})", f"[{m}/{m + more}]", 2 * m + more + 1, "relative", error, "rough")


def odds() -> Iterator[FormRow]:
    """Eps = (1 + p c v*^2 (N/D)^r)^(-1/p)."""
    v_star = dense_v_star()
    epsilon, loss = double.epsilon(v_star), double.one_minus_epsilon(v_star)
    cases = [("1", "1/3"), ("1", "2/3"), ("1", "4/3"), ("3/2", "1"), ("3/5", "1"), ("6/5", "1")]
    for p, r in ((Fraction(p), Fraction(r)) for p, r in cases):
        more = int((Fraction(10, 3) * p - 2) / r)
        log_epsilon = np.where(epsilon > loss, np.log1p(-np.minimum(loss, 0.9)), np.log(epsilon))
        excess = np.expm1(-float(p) * log_epsilon)
        target = (excess / (float(p) * C * v_star**2)) ** float(1 / r)
        for measure in ("relative", "both"):
            weight = float(r / p) * excess / (1 + excess) * weights(measure, v_star)
            for n in range((MOST - more) // 2 + 1):
                error = rough([full_powers(n + more, n)], Sample(v_star, target, weight)).error[0]
                form = f"(1 + {p} c v^2 (N/D)^({r}))^(-{1 / p})"
                yield FormRow("odds", form, f"[{n + more}/{n}]", 2 * n + more + 1, measure, error, "rough")


def pieces() -> Iterator[FormRow]:
    """Two pieces that meet at V."""
    for border in (3.0, 5.0, 8.0):
        inner = np.linspace(0, border, 201)[1:]
        near = Sample(inner, double.epsilon(inner), np.ones_like(inner))
        t = np.concatenate([np.geomspace(1e-6, 0.01, 30)[:-1], np.linspace(0.01, 1, 150)])
        far = Sample(t, double.epsilon(border / t) * (border / t) ** (10 / 3), np.ones_like(t))
        for m, n, degree in ((1, 4, 2), (2, 5, 4), (3, 6, 5), (4, 7, 6)):
            error = max(rough([full_powers(m, n)], near).error[0], rough([full_powers(degree, 0)], far).error[0])
            label = f"[{m}/{n}] + {degree}, V = {border:g}"
            yield FormRow("pieces", "two pieces", label, m + n + degree + 2, "relative", error, "rough")


# --- gaps -------------------------------------------------------------------------------------------------------------


class Space(NamedTuple):
    """Choices of powers: how many, and the difference of the degrees."""

    in_top: int
    in_bottom: int
    more: int
    """deg N - deg D."""
    least: int

    def contains(self, top: Sequence[int], bottom: Sequence[int]) -> bool:
        """Whether (ascending) exponents are a choice."""
        free = [*top[1:], *bottom]
        ascending = all(a < b for part in (top, bottom) for a, b in pairwise(part))
        degrees = top[-1] - (bottom[-1] if bottom else 0) == self.more
        return ascending and degrees and min(free, default=self.least) >= self.least and max(free) <= HIGHEST

    def all(self) -> Iterator[Powers]:
        """Return every choice."""
        for degree in range(self.least, HIGHEST + 1):
            highest = degree + self.more
            if not self.least <= highest <= HIGHEST:
                continue
            for top in combinations(range(self.least, highest), self.in_top - 2):
                for bottom in combinations(range(self.least, degree), self.in_bottom - 1):
                    yield Powers((0, *top, highest), (0, *bottom, degree))

    def chance(self, source: random.Random) -> Powers | None:
        """Return any choice."""
        degree = source.randint(self.least + self.in_bottom, HIGHEST - max(self.more, 0))
        highest = degree + self.more
        if highest - self.least < self.in_top - 2:
            return None
        top = sorted(source.sample(range(self.least, highest), self.in_top - 2))
        bottom = sorted(source.sample(range(self.least, degree), self.in_bottom - 1))
        return Powers((0, *top, highest), (0, *bottom, degree))

    def neighbours(self, powers: Powers) -> list[Powers]:
        """Return choices with one exponent (or both highest ones) moved by 1, 2 or 3."""
        found = []
        top, bottom = list(powers.top), list(powers.bottom[1:])
        for step in (-3, -2, -1, 1, 2, 3):
            moves = [([*top[:-1], top[-1] + step], [*bottom[:-1], bottom[-1] + step])]
            moves += [([*top[:i], top[i] + step, *top[i + 1 :]], bottom) for i in range(1, len(top) - 1)]
            moves += [(top, [*bottom[:i], bottom[i] + step, *bottom[i + 1 :]]) for i in range(len(bottom) - 1)]
            for a, b in ((sorted(x), sorted(y)) for x, y in moves):
                if self.contains(a, b):
                    found.append(Powers(tuple(a), (0, *b)))
        return found


def in_batches(choices: Sequence[Powers], sample: Sample) -> list[tuple[float, Powers]]:
    """Return choices with their rough errors, the best first."""
    errors: list[float] = []
    for start in range(0, len(choices), BATCH):
        found: Rough = rough(choices[start : start + BATCH], sample)
        errors += [float(error) for error in found.error]
    return sorted(zip(errors, choices, strict=True), key=lambda pair: pair[0])


def local_search(space: Space, sample: Sample, seconds: float, seed: int) -> list[tuple[float, Powers]]:
    """Descend from random choices, until the time is over."""
    source, end, known = random.Random(seed), time.monotonic() + seconds, {}
    while time.monotonic() < end:
        starts = [found for found in (space.chance(source) for _ in range(40)) if found is not None]
        if not starts:
            return []
        error, at = in_batches(starts, sample)[0]
        while time.monotonic() < end:
            known[at] = error
            better, there = min(in_batches(space.neighbours(at), sample), default=(error, at), key=lambda p: p[0])
            if better >= error:
                break
            error, at = better, there
    return sorted(((error, powers) for powers, error in known.items()), key=lambda pair: pair[0])


def splits(coefficients: int) -> list[tuple[int, int]]:
    """Return how many of the coefficients are in N and how many in D."""
    return [(coefficients - k, k) for k in range(1, coefficients // 2 + 1) if coefficients - k >= 2]


def gaps(deep: float) -> Iterator[FormRow]:
    """1/eps - 1 = c v*^2 N(y)/D(y), y = v*^(1/3)."""
    cases = [(k, a, b) for k in range(3, EXHAUSTIVE + 1) for a, b in splits(k)]
    for measure in half_line.BEST:
        sample = half_line.half_line_sample(measure)
        for k, a, b in (cases[i] for i in track(range(len(cases)), "exhaustive search")):
            choices = list(Space(a, b, half_line.DEGREES_MORE, 2).all())
            yield from _rows("gaps", "c v^2 N/D, y = v^(1/3)", k, measure, in_batches(choices, sample), "exhaustive")
    if deep:
        cases = [(k, a, b) for k in DEEP for a, b in splits(k) if a - b <= 4]
        for measure in half_line.BEST:
            for k, a, b in (cases[i] for i in track(range(len(cases)), "local search")):
                space = Space(a, b, half_line.DEGREES_MORE, 2)
                found = local_search(space, half_line.half_line_sample(measure), deep, k)
                yield from _rows("gaps", "c v^2 N/D, y = v^(1/3)", k, measure, found, "local search")


def _rows(
    kind: str, form: str, coefficients: int, measure: str, found: list[tuple[float, Powers]], method: str
) -> Iterator[FormRow]:
    for error, powers in found[:KEPT]:
        yield FormRow(kind, form, powers.label, coefficients, measure, error, method)


def levelled() -> Iterator[FormRow]:
    """Return what is recommended, by Remez's algorithm."""
    for measure, choices in half_line.BEST.items():
        for powers in choices:
            found = half_line.fit_half_line(powers, measure)
            form = "c v^2 N/D, y = v^(1/3)"
            yield FormRow("gaps", form, powers.label, powers.coefficients, measure, found.error, "levelled")
    for powers in inverse.WHOLE:
        error = inverse.fit_whole(powers).error
        yield FormRow(
            "inverse", "v*, q^(1/10), (0, 1]", powers.label, powers.coefficients, "relative", error, "levelled"
        )


# --- the inverse ------------------------------------------------------------------------------------------------------


VARIABLES: dict[str, Callable[[FloatArray, FloatArray], FloatArray]] = {
    "sqrt(1-eps)": lambda _, loss: np.sqrt(loss),
    "sqrt((1-eps)/eps)": lambda epsilon, loss: np.sqrt(loss / epsilon),
}


def intervals() -> Iterator[FormRow]:
    """v* on [eps_min, 1] in two variables."""
    for low in (0.5, 0.1, 0.01, 0.001):
        last = double.v_star_from(low)
        v_star = np.concatenate([np.geomspace(1e-3, 0.05, 15)[:-1], np.linspace(0.05, 1, 200)]) * last
        epsilon, loss = double.epsilon(v_star), double.one_minus_epsilon(v_star)
        for name, variable in VARIABLES.items():
            s = variable(epsilon, loss)
            sample = Sample(s, v_star * np.sqrt(C) / s, np.ones_like(s))
            for k in range(2, MOST + 1):
                tried = [(m, k - 1 - m) for m in range(k) if abs(2 * m - k + 1) <= 2]
                errors = [(float(rough([full_powers(m, n)], sample).error[0]), m, n) for m, n in tried]
                error, m, n = min(errors)
                yield FormRow("inverse", f"v*, {name}, [{low:g}, 1]", f"[{m}/{n}]", k, "relative", error, "rough")


def whole(deep: float) -> Iterator[FormRow]:
    """v* on (0, 1]."""
    form, sample = "v*, q^(1/10), (0, 1]", inverse.inverse_sample()
    for k in (4, *(DEEP if deep else ())):
        for a, b in ((k // 2, k - k // 2), (k - k // 2, k // 2)) if k % 2 else ((k // 2, k // 2),):
            space = Space(a, b, -inverse.WHOLE_FORM.degrees_less, 2)
            found = local_search(space, sample, deep, k) if k > 4 else in_batches(list(space.all()), sample)
            yield from _rows("inverse", form, k, "relative", found, "local search" if k > 4 else "exhaustive")


@click.command()
@click.option("--out", type=click.File("w"), default=None, help="CSV file; without it, the table goes to stdout.")
@click.option("--deep", type=float, default=0.0, help="Seconds of local search for each number of coefficients.")
def main(out: TextIO | None, deep: float) -> None:
    """Search, and write the table."""
    writer = csv.writer(out if out is not None else sys.stdout, lineterminator="\n")
    writer.writerow(FormRow._fields)
    parts = (powers_of_quotients(), odds(), pieces(), gaps(deep), levelled(), intervals(), whole(deep))
    for row in (row for part in parts for row in part):
        writer.writerow([f"{value:.4g}" if isinstance(value, float) else value for value in row])


if __name__ == "__main__":
    main()
