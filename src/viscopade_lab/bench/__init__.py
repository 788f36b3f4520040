"""Measure all kernels and their rivals in one run, on the same speeds, in C that is compiled on the spot.

The numbers are those of one machine and one compiler; what carries over are the ratios.
"""

from __future__ import annotations

import platform
from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from importlib.metadata import version

import numpy as np

from viscopade.arithmetic.decimals import at_most
from viscopade.arithmetic.formats import DOUBLE, Format
from viscopade.arrays import double
from viscopade.arrays.checked import FloatArray
from viscopade.generated import marker_line
from viscopade.kernels import toolchain
from viscopade.kernels.v_star import of_v_star
from viscopade.progress import track
from viscopade_lab.bench import ours, rivals
from viscopade_lab.bench.contender import Contender
from viscopade_lab.bench.harness import ArraySizes, BenchError, Harness, Key, in_rounds
from viscopade_lab.bench.result import Row
from viscopade_lab.bench.rivals import COPY, PADE
from viscopade_lab.bench.speed_range import SpeedRange

__all__ = ["QUICK", "ArraySizes", "BenchError", "SpeedRange", "contenders", "run"]

QUICK = ArraySizes(memory=1 << 14, scalar=1 << 9, duration=2e4, sampled=1 << 10)
"""Too few elements for numbers that mean something: to see whether it runs."""


def contenders(speeds: SpeedRange, only: Sequence[str] = ()) -> list[Contender]:
    """Return kernels and rivals: all, or those whose ids, or beginnings of ids, are asked for.

    The scaled copy and pow + [3/6], to which all are compared, are always among them.

    Raises
    ------
    ValueError
        If there is none of a name.
    """
    known = [*ours.contenders(speeds), *rivals.contenders(speeds)]
    for name in only:
        if not any(_begins(name, contender.id) for contender in known):
            ids = ", ".join(contender.id for contender in known)
            raise ValueError(f"there is no kernel {name!r}: expected one of {ids}, or the beginning of some")
    return [c for c in known if not only or c.id in (COPY, PADE) or any(_begins(name, c.id) for name in only)]


def _begins(name: str, ident: str) -> bool:
    """Return whether a name is an id, or its beginning up to a hyphen."""
    return f"{ident}-".startswith(f"{name}-")


def run(
    wanted: Sequence[Contender],
    speeds: SpeedRange,
    read: Callable[[str], str],
    rounds: int,
    sizes: ArraySizes,
    cc: str | None = None,
) -> tuple[list[str], list[Row]]:
    """Compile, check and measure; return comments on machine and conditions, and the rows.

    Parameters
    ----------
    wanted : sequence of Contender
    speeds : SpeedRange
    read : callable
        From the name of an exported header to its text.
    rounds : int
        Measurements of each kernel.
    sizes : ArraySizes
    cc : str or None
        Command of the C compiler. None: the environment's CC, or cc.

    Raises
    ------
    toolchain.ToolchainError
        If there is no compiler, or it fails.
    BenchError
        If a kernel computes wrong results, or an error contradicts its proof.
    ValueError
        If a header cannot be read.
    """
    compiler = toolchain.find_compiler(cc)
    files = list(dict.fromkeys(contender.header for contender in wanted if contender.header))
    headers = {files[i]: read(files[i]) for i in track(range(len(files)), "headers")}
    harness = Harness(wanted, headers, compiler, speeds, sizes)
    harness.check()
    times = in_rounds(harness.tasks(), rounds)
    rows: list[Row] = []
    for i in track(range(len(wanted)), "errors"):
        for form in wanted[i].formats:
            rows += _rows(times, wanted[i], form.name, _errors(harness, wanted[i], form))
    # Where and how it was measured, without names of hosts or paths.
    system = " ".join([platform.system(), platform.machine(), *platform.libc_ver()]).strip()
    flags = (" ".join(compiler.flags(library)) for library in ("scalar", "array"))
    comments = [
        marker_line("viscopade bench"),
        f"{toolchain.processor()}; {compiler.version}; {system}; Python {platform.python_version()}, "
        f"NumPy {version('numpy')}",
        "{} rounds; scalar {}; arrays {}, {} elements in the cache, {} from memory".format(
            rounds, *flags, sizes.cache, sizes.memory
        ),
        f"beta = {speeds.beta:g}, speeds from {speeds.speed_min:g} to {speeds.speed_max:g}",
    ]
    return comments, rows


def _errors(harness: Harness, contender: Contender, form: Format) -> tuple[float | None, float | None, float | None]:
    """Return the sampled errors, and what is proven of both."""
    relative, loss = harness.largest_errors(contender, form) or (None, None)
    proof = contender.proven.get(form.name)
    if proof is None or relative is None or loss is None:
        return relative, loss, None
    bound = proof.relative + proof.ulps * _ulp(form, harness.range)
    largest = Fraction(max(harness.range.speed_max, 1 / harness.range.speed_min))
    root = float(of_v_star(form, largest)) if proof.of_v_star else 0.0
    # The eps that it is compared with is rounded, too.
    allowed = (1 + bound) * (1 + root) - 1 + double.ULP["epsilon"] * _ulp(DOUBLE, harness.range)
    if max(relative, loss) > allowed:
        raise BenchError(
            f"{contender.id} ({form.name}) contradicts its proof: the error is {max(relative, loss):.4g}, where it "
            f"should be at most {allowed:.4g}"
        )
    return relative, loss, float(at_most(Fraction(bound), 4))  # the file has four digits


def _ulp(form: Format, speeds: SpeedRange) -> float:
    """Return the most that an ulp of eps can be over the speeds, relative to the smaller of eps and 1 - eps."""
    # Below 1/2, an ulp of eps is at most epsilon eps. From 1/2 on it is epsilon/2, and 1 - eps is least at the lowest
    # speed.
    return max(form.epsilon, form.epsilon / 2 / float(double.one_minus_epsilon(speeds.v_star(speeds.speed_min))))


def _rows(
    times: Mapping[Key, FloatArray], contender: Contender, form: str, errors: tuple[float | None, ...]
) -> Iterator[Row]:
    """Yield the statistics of a contender's times in a type."""
    for key, values in times.items():
        if (key.id, key.format) == (contender.id, form):
            low, median, high = np.percentile(values, [25, 50, 75]).tolist()
            others = (times.get(key._replace(id=other)) for other in (PADE, COPY))
            ratios = (None if other is None else float(np.median(values / other)) for other in others)
            yield Row(
                contender.id, contender.label, contender.group, form, key.speeds, key.measure,
                float(values.min()), median, (high - low) / median, *ratios, *errors,
            )  # fmt: skip
