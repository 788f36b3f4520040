"""Errors of the double kernels in units in the last place: histograms over ranges of v*, and a search for the largest.

Run as `python -m viscopade_lab.exhaustive.doubles`. The reference (exhaustive/reference.h) is
good to 0.01 ulp. The search begins at the ends of the table's panels, where eps or 1 - eps is a power of 2, and at
random; it goes on near the largest errors. The largest ones, and some at random inputs, are also taken from
`viscopade.collision.exact`.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import Any

import click
import numpy as np
import numpy.typing as npt
from rich.table import Table

from viscopade.arithmetic.formats import DOUBLE
from viscopade.kernels.forms import last_place
from viscopade.kernels.targets import last_place as header
from viscopade_lab import exhaustive
from viscopade_lab.script import console

Bits = npt.NDArray[np.uint64]

# Exponents of 2: where the form of the result changes, and the table's regions.
RANGES = {
    "epsilon": (-30, -4, -1, 0, 2, 6, 20, 23, 306, 324),
    "one_minus_epsilon": (-538, -511, -400, -30, -4, -1, 0, 2, 6, 17),
}
NORMAL = {"epsilon": (-30, 306), "one_minus_epsilon": (-511, 17)}
"""Where results are no denormal numbers, and are searched for the largest error."""
BINS = 20
PIECES = 4  # random streams to a range
ROUNDS, SURVIVORS, OFFSPRING = 12, 2000, 100
REACH = 40  # neighbours differ by less than 2^REACH units in the last place
CONFIRMED = 3


def bits_of(v_star: float) -> int:
    """Return the bits of a double."""
    (bits,) = struct.unpack("<Q", struct.pack("<d", v_star))
    return int(bits)


def double_of(bits: int) -> float:
    """Return the double of these bits."""
    (v_star,) = struct.unpack("<d", struct.pack("<Q", bits))
    return float(v_star)


def histograms(program: Path, function: str, samples: int, seed: int, jobs: int) -> Iterator[dict[str, Any]]:
    """Yield, range by range, how many errors are in each of `BINS` parts of [0, 1) ulp, and the largest."""
    exponents = RANGES[function]
    for low, high in pairwise(exponents):
        ends = (bits_of(2.0**low), bits_of(2.0**high))
        arguments = [
            (last_place.FUNCTIONS.index(function), "sample", *ends, samples // PIECES, seed + 1000 * piece, BINS)
            for piece in range(PIECES)
        ]
        lines = exhaustive.outputs(program, arguments, jobs)
        counts = np.sum([list(map(int, rest)) for word, *rest in lines if word == "bins"], axis=0)
        error, at = max((float(rest[0]), int(rest[1])) for word, *rest in lines if word == "largest")
        yield {"low": f"2^{low}", "high": f"2^{high}", "bins": counts.tolist(), "largest": error,
               "at": double_of(at).hex()}  # fmt: skip


def starts(function: str, generator: np.random.Generator) -> Bits:
    """Return the bits of the inputs that the search begins with."""
    ends = [float(panel.centre + side * panel.half) for panel in last_place.smaller_panels() for side in (-1, 0, 1)]
    ends += [v_star_at_power_of_two(function, k) for k in range(1, 60)]
    near = np.array([bits_of(end) for end in ends], dtype=np.int64)[:, None] + np.arange(-50, 51)
    low, high = NORMAL[function]
    anywhere = generator.integers(bits_of(2.0**low), bits_of(2.0**high), 100_000)
    usual = generator.integers(bits_of(2.0**-5), bits_of(2.0**10), 300_000)
    return np.concatenate([near.ravel(), anywhere, usual]).astype(np.uint64)


def v_star_at_power_of_two(function: str, k: int) -> float:
    """Return nearly the v* where the function is 2^-k."""
    low, high = 2.0**-40, 2.0**30
    falling = function == "epsilon"
    for _ in range(120):
        middle = (low * high) ** 0.5
        above = last_place.evaluated_in(DOUBLE, function, middle) > 2.0**-k
        low, high = (middle, high) if above == falling else (low, middle)
    return low


def errors(program: Path, function: str, bits: Bits) -> tuple[npt.NDArray[np.float64], list[str]]:
    """Return the errors in ulp and the results (hexadecimal) for given inputs."""
    text = "\n".join(map(str, bits.tolist()))
    lines = exhaustive.outputs(program, [(last_place.FUNCTIONS.index(function), "given")], given=text)
    rows = [rest for word, *rest in lines if word == "error"]
    return np.array([float(row[0]) for row in rows]), [row[2] for row in rows]


def search(program: Path, function: str, seed: int) -> list[dict[str, Any]]:
    """Return the largest errors that a search finds, confirmed by `viscopade.collision.exact`."""
    generator = np.random.default_rng(seed)
    pool = starts(function, generator)
    lowest, highest = (bits_of(2.0**end) for end in NORMAL[function])
    best, size = np.empty(0, dtype=np.uint64), 0
    for _ in range(ROUNDS):
        pool = np.unique(np.concatenate([best, pool]))
        size += len(pool) - len(best)
        found, _ = errors(program, function, pool)
        best = pool[np.argsort(-found)[:SURVIVORS]]
        steps = 2.0 ** generator.uniform(0, REACH, (len(best), OFFSPRING)) * generator.choice([-1, 1], OFFSPRING)
        near = best[:, None].astype(np.int64) + steps.astype(np.int64)
        pool = np.clip(near, lowest, highest).ravel().astype(np.uint64)
    sizes, results = errors(program, function, best[:CONFIRMED])
    return [
        {"at": double_of(int(at)).hex(), "result": result, "ulp": ulp, "tried": size,
         "ulp_exact": exact_error(function, double_of(int(at)), float.fromhex(result))}
        for at, ulp, result in zip(best[:CONFIRMED], sizes.tolist(), results, strict=True)
    ]  # fmt: skip


def direct(program: Path, function: str, number: int, seed: int) -> dict[str, Any]:
    """Compare with `exact` alone, at random inputs; see how far the reference of the histograms is off."""
    v_star = 2.0 ** np.random.default_rng(seed).uniform(-30, 30, number)
    found, results = errors(program, function, v_star.view(np.uint64))
    exactly = [exact_error(function, v, float.fromhex(r)) for v, r in zip(v_star.tolist(), results, strict=True)]
    return {"number": number, "largest": max(exactly), "reference_off": float(np.abs(found - np.array(exactly)).max())}


def exact_error(function: str, v_star: float, result: float) -> float:
    """Return the error of a result in units in the last place of the true value, from `viscopade.collision.exact`."""
    true = exhaustive.exact_value(function, v_star)
    return float(abs(true - Fraction(result)) / DOUBLE.ulp(true))


def measure(mode: str, samples: int, exact: int, seed: int, jobs: int) -> dict[str, Any]:
    """Return histograms and largest errors of both functions, compiled in one of `exhaustive.MODES`."""
    result: dict[str, Any] = {"mode": mode, "samples": 0, "functions": {}}
    files = {"table.h": exhaustive.reference_table(), "full.h": header.render("viscopade_lab.exhaustive.doubles")}
    with exhaustive.compiled("check_double", mode, files) as program:
        for function in last_place.FUNCTIONS:
            ranges = list(histograms(program, function, samples, seed, jobs))
            result["samples"] += sum(sum(part["bins"]) for part in ranges)
            result["functions"][function] = {
                "proven": float(last_place.largest_ulp(DOUBLE, function)),
                "proven_denormal": float(last_place.largest_subnormal(DOUBLE, function)),
                "ranges": ranges,
                "search": search(program, function, seed),
                "direct": direct(program, function, exact, seed),
            }
    return result


def show(result: dict[str, Any]) -> None:
    """Print the result for people."""
    out = console(160)
    out.print(f"{' '.join(exhaustive.MODES[result['mode']])}: {result['samples']:,} random inputs")
    for function, found in result["functions"].items():
        table = Table("v*", "at most 0.5 ulp", "0.5 to 0.55", "above", "largest error", title=function)
        for part in found["ranges"]:
            counts, total = part["bins"], sum(part["bins"])
            half = BINS // 2
            shares = (sum(counts[:half]), counts[half], sum(counts[half + 1 :]))
            table.add_row(
                f"{part['low']} … {part['high']}",
                *(f"{100 * share / total:.4f} %" for share in shares),
                f"{part['largest']:.4f} ulp at {part['at']}",
            )
        out.print(table)
        out.print(
            f"proven: {found['proven']:.5f} ulp ({found['proven_denormal']:.5f} of the least number where denormal)",
            highlight=False,
        )
        compared = found["direct"]
        out.print(
            f"{compared['number']} random inputs against viscopade.exact: at most {compared['largest']:.4f} ulp; the "
            f"reference is off by at most {compared['reference_off']:.5f} ulp",
            highlight=False,
        )
        for worst in found["search"]:
            out.print(
                f"search of {worst['tried']:,}: {worst['ulp_exact']:.5f} ulp (exact) at {worst['at']}", highlight=False
            )


@click.command()
@click.option("--samples", type=click.IntRange(PIECES), default=10_000_000, show_default=True, help="Of each range.")
@click.option(
    "--exact", type=click.IntRange(1), default=200, show_default=True, help="Inputs for viscopade.collision.exact."
)
@click.option("--seed", type=int, default=1, show_default=True)
@click.option("--jobs", type=click.IntRange(1), default=os.cpu_count() or 1, help="Processes at a time.")
@click.option("--mode", "modes", type=click.Choice(list(exhaustive.MODES)), multiple=True, default=exhaustive.MODES)
def main(samples: int, exact: int, seed: int, jobs: int, modes: tuple[str, ...]) -> None:
    """Measure, and print the errors."""
    for mode in modes:
        show(measure(mode, samples, exact, seed, jobs))


if __name__ == "__main__":
    main()
