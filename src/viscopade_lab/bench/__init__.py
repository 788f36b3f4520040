"""Benchmark: all kernels and their rivals in one run, on the same speeds, in C compiled for this machine.

The times belong to one machine and one compiler; the ratios carry over.
"""

from __future__ import annotations

import platform
from collections.abc import Callable, Iterator, Mapping, Sequence
from importlib.metadata import version

import numpy as np

from viscopade.arithmetic.decimals import at_most
from viscopade.arithmetic.formats import Format
from viscopade.arrays.checked import FloatArray
from viscopade.generated import marker_lines
from viscopade.progress import track
from viscopade_lab.bench import libraries, ours, rivals
from viscopade_lab.bench.contender import Contender
from viscopade_lab.bench.harness import CACHE, BenchError, Harness, Key, Sizes, in_rounds, proven_error
from viscopade_lab.bench.result import Row
from viscopade_lab.bench.rivals import COPY, PADE
from viscopade_lab.bench.speeds import BETA, SPEED_MAX, SPEED_MIN

__all__ = ["QUICK", "BenchError", "Sizes", "contenders", "run"]

QUICK = Sizes(memory=1 << 14, scalar=1 << 9, duration=2e4, sampled=1 << 12)
"""Few elements, to see whether the benchmark runs; the times have no meaning."""


def contenders(only: Sequence[str] = ()) -> list[Contender]:
    """Return kernels and rivals: all, or those with one of these ids or beginnings of ids.

    The scaled copy and pow + [3/6] are always included, because all others are compared with them.

    Raises
    ------
    ValueError
        If a name matches no kernel and no rival.
    """
    known = [*ours.contenders(), *rivals.contenders()]
    chosen = {COPY, PADE}
    for name in only:
        begun = {contender.id for contender in known if f"{contender.id}-".startswith(f"{name}-")}
        if not begun:
            ids = ", ".join(contender.id for contender in known)
            reasons = "".join(f"; {line}" for line in rivals.absent())
            raise ValueError(f"there is no kernel {name!r}: expected one of {ids}, or the beginning of some{reasons}")
        chosen |= begun
    return [contender for contender in known if not only or contender.id in chosen]


def run(
    wanted: Sequence[Contender], read: Callable[[str], str], rounds: int, sizes: Sizes, cc: str | None = None
) -> tuple[list[str], list[Row]]:
    """Compile, check and measure; return comments on machine and conditions, and the rows.

    Parameters
    ----------
    wanted : sequence of Contender
    read : callable
        From the name of an exported header to its text.
    rounds : int
        Measurements of each kernel.
    sizes : Sizes
    cc : str or None
        Command of the C compiler. None: the environment's CC, or cc.

    Raises
    ------
    ToolchainError
        If there is no compiler, or it fails.
    BenchError
        If a kernel computes wrong results, or an error contradicts its proof.
    ValueError
        If a header cannot be read.
    """
    compiler = libraries.find_compiler(cc)
    files = list(dict.fromkeys(contender.header for contender in wanted if contender.header))
    headers = {files[i]: read(files[i]) for i in track(range(len(files)), "headers")}
    harness = Harness(wanted, headers, compiler, sizes)
    cases = [(contender, form) for contender in wanted for form in contender.formats]
    errors = [harness.errors(*cases[i]) for i in track(range(len(cases)), "checking the results")]
    times = in_rounds(harness.tasks(), rounds)
    rows = [row for case, error in zip(cases, errors, strict=True) for row in _rows(times, *case, error)]
    # The machine and the settings, without names of hosts or paths.
    system = " ".join([platform.system(), platform.machine(), *platform.libc_ver()]).strip()
    flags = (" ".join(compiler.flags(library)) for library in ("scalar", "array"))
    comments = [
        *marker_lines("viscopade bench"),
        f"{libraries.processor()}; {compiler.version}; {system}; Python {platform.python_version()}, "
        f"NumPy {version('numpy')}",
        "{} rounds; scalar {}; arrays {}, {} elements in the cache, {} from memory".format(
            rounds, *flags, CACHE, sizes.memory
        ),
        f"beta = {BETA:g}, speeds from {SPEED_MIN:g} to {SPEED_MAX:g}, log-uniform",
        *rivals.absent(),
    ]
    return comments, rows


def _rows(
    times: Mapping[Key, FloatArray], contender: Contender, form: Format, errors: tuple[float, float] | None
) -> Iterator[Row]:
    """Yield the rows of a contender in one format."""
    relative, loss = errors or (None, None)
    bound, proof = None, contender.proven.get(form.name)
    if proof is not None:  # the file has four digits
        bound = float(at_most(proven_error(proof, form), 4))
    for key, values in times.items():
        if (key.id, key.format) == (contender.id, form.name):
            low, median, high = np.percentile(values, [25, 50, 75]).tolist()
            others = (times.get(key._replace(id=other)) for other in (PADE, COPY))
            to_pade, to_copy = (None if other is None else float(np.median(values / other)) for other in others)
            yield Row(
                contender.id, contender.label, contender.group, key.format, key.measure,
                float(values.min()), median, (high - low) / median, to_pade, to_copy, relative, loss, bound,
            )  # fmt: skip
