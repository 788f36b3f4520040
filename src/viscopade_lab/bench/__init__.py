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
"""Few elements, to see whether the benchmark runs; the times have no meaning.

The sizes are choices: 1/512 of the usual memory, 1/100 of the time, and 1/32 of the other numbers.
"""


def contenders(only: Sequence[str] = ()) -> list[Contender]:
    """Return kernels and rivals: all, or those whose ids begin with one of the names `only`.

    A beginning ends where a "-" follows: "speed" stands for speed-1e-5 and others. The scaled copy and pow + [3/6] are
    always included, because all others are compared with them.

    Raises
    ------
    ValueError
        If a name matches no kernel and no rival.
    """
    all_contenders = [*ours.contenders(), *rivals.contenders()]
    chosen = {COPY, PADE}
    for name in only:
        matching_ids = {contender.id for contender in all_contenders if f"{contender.id}-".startswith(f"{name}-")}
        if not matching_ids:
            # The message names all ids, and the vector libraries that are not installed.
            ids = ", ".join(contender.id for contender in all_contenders)
            reasons = "".join(f"; {line}" for line in rivals.absent())
            raise ValueError(f"there is no kernel {name!r}: expected one of {ids}, or the beginning of some{reasons}")
        chosen |= matching_ids
    return [contender for contender in all_contenders if not only or contender.id in chosen]


def run(
    chosen_contenders: Sequence[Contender], read: Callable[[str], str], rounds: int, sizes: Sizes, cc: str | None = None
) -> tuple[list[str], list[Row]]:
    """Return comments on machine and conditions, and a row for each contender, format and measure.

    All contenders are compiled, their results checked, and then timed.

    Parameters
    ----------
    chosen_contenders : sequence of Contender
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
    files = list(dict.fromkeys(contender.header for contender in chosen_contenders if contender.header))
    headers = {files[i]: read(files[i]) for i in track(range(len(files)), "headers")}
    harness = Harness(chosen_contenders, headers, compiler, sizes)
    cases = [(contender, form) for contender in chosen_contenders for form in contender.formats]
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
    """Yield the rows of a contender in one format, one for each measure.

    `times` are the nanoseconds per collision of all contenders, one number a round; `errors` the largest sampled
    |d eps|/eps and |d eps|/(1 - eps), or None.
    """
    relative, loss = errors or (None, None)
    bound, proof = None, contender.proven.get(form.name)
    if proof is not None:  # the file has four digits
        bound = float(at_most(proven_error(proof, form), 4))
    for key, values in times.items():
        if (key.id, key.format) == (contender.id, form.name):
            # Quartiles: half of the rounds lie between low and high.
            low, median, high = np.percentile(values, [25, 50, 75]).tolist()
            # Ratios to the two references are taken round by round, so that a slow round does not count.
            references = (times.get(key._replace(id=reference)) for reference in (PADE, COPY))
            to_pade, to_copy = (None if ref is None else float(np.median(values / ref)) for ref in references)
            yield Row(
                contender.id, contender.label, contender.group, key.format, key.measure,
                float(values.min()), median, (high - low) / median, to_pade, to_copy, relative, loss, bound,
            )  # fmt: skip
