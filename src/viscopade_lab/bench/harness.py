"""Run the compiled contenders on the same speeds, check their results, and time them."""

from __future__ import annotations

import ctypes
import random
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import groupby
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from viscopade.arithmetic.formats import DOUBLE, FLOAT, FORMATS, Format
from viscopade.arrays import double
from viscopade.arrays.checked import FloatArray
from viscopade.collision import spheres
from viscopade.generated import marker_line, template
from viscopade.kernels.arithmetic import HOSTS
from viscopade.kernels.bound import ErrorBound
from viscopade.kernels.v_star import eps_error_from_v_star
from viscopade.progress import track
from viscopade_lab.bench import libraries
from viscopade_lab.bench.contender import Contender, Measure
from viscopade_lab.bench.libraries import Compiler, Library
from viscopade_lab.bench.speeds import BETA, SPEED_MAX, SPEED_MIN, speeds

CACHE = 2048
"""Elements of an array in the cache: speeds and results of doubles are 32 KB, as much as a usual first-level cache."""
SLOW = 10.0
"""Ns per collision from which the speed of the memory does not matter: 16 bytes in 10 ns are 1.6 GB/s, a fraction of
what one core reads and writes."""
MOST_OF_SLOW = 1 << 20
"""Largest number of elements from memory for such functions, so that a run is short: 10 ms or more. A choice."""
RUNS = 3
"""Runs of a measurement, of which the fastest counts; a choice, as all is repeated in every round, too."""
_PROBE = 64  # calls from which the time of a contender is estimated; rough is enough, to find the number of passes
_SEED = 1  # of the order of measurements; any would do

DTYPE: Mapping[Format, type[np.float64] | type[np.float32]] = {DOUBLE: np.float64, FLOAT: np.float32}
"""NumPy's names of the formats."""

Array = npt.NDArray[np.floating]


class BenchError(RuntimeError):
    """Unreliable result of the benchmark; the message is one line."""


class _Work(ctypes.Structure):
    """struct bench_work of bench.c: number of speeds, passes over them, pointers to speeds and results, beta."""

    _fields_ = (
        ("n", ctypes.c_size_t),
        ("passes", ctypes.c_size_t),
        ("speed", ctypes.c_void_p),
        ("out", ctypes.c_void_p),
        ("beta", ctypes.c_double),
    )


@dataclass(frozen=True)
class Sizes:
    """Sizes of one measurement. The defaults are choices.

    Arrays from memory have 64 MB as doubles, more than most caches have. The other measures run for 2 ms, 1/10^5 of
    which is the resolution of a clock; their arrays of 128 KB are many random speeds for the prediction of branches.

    Attributes
    ----------
    memory, scalar : int
        Elements of an array.
    duration : float
        Shortest time of a measurement in nanoseconds; shorter runs are repeated.
    sampled : int
        Speeds at which results are checked and errors are sampled.
    """

    memory: int = 1 << 23
    scalar: int = 1 << 14
    duration: float = 2e6
    sampled: int = 1 << 17


class Key(NamedTuple):
    """Key of a measurement: contender, format and measure."""

    id: str
    format: str
    measure: Measure


@dataclass(frozen=True)
class Task:
    """A measurement that each round repeats: `run` gives the nanoseconds of a number of passes over `elements`."""

    key: Key
    run: Callable[[int], float]
    elements: int
    passes: int

    def measure(self) -> float:
        """Return nanoseconds per collision, the least of several runs, because other work may disturb one of them.

        At the start all arrays are in the cache, except those from memory.
        """
        if self.key.measure != "memory":
            self.run(1)
        return min(self.run(self.passes) for _ in range(RUNS)) / (self.passes * self.elements)


class Harness:
    """The compiled contenders, and the arrays they run on.

    Parameters
    ----------
    contenders : sequence of Contender
    headers : mapping of str to str
        The exported headers that they include, by name.
    compiler : Compiler
    sizes : Sizes
    """

    def __init__(
        self, contenders: Sequence[Contender], headers: Mapping[str, str], compiler: Compiler, sizes: Sizes
    ) -> None:
        """Compile the contenders, and make the arrays."""
        self.contenders, self.sizes = contenders, sizes
        # Each library that a measure needs is bench.c with a macro that selects its loops.
        used: set[Library] = {c.loaded_from(measure) for c in contenders if c.python is None for measure in c.measures}
        units = {
            library: {"part.c": f'#define BENCH_LIBRARY_{library.upper()}\n#include "bench.c"\n'}
            for library in sorted(used)
        }
        self._libraries = libraries.build_libraries(compiler, units, {**headers, "bench.c": c_file(contenders)})
        # One array of speeds and one of results for each format; measurements take their beginnings.
        length = max(sizes.memory, CACHE, sizes.scalar, sizes.sampled)
        self._speed: dict[str, Array] = {form.name: speeds(length).astype(DTYPE[form]) for form in FORMATS.values()}
        self._out: dict[str, Array] = {form.name: np.zeros(length, DTYPE[form]) for form in FORMATS.values()}

    def run(self, contender: Contender, form: Format, measure: Measure, elements: int, passes: int = 1) -> float:
        """Return the nanoseconds that some passes over the first `elements` speeds take, in all.

        Afterwards the results are in the array `_out` of the format.
        """
        speed, out = self._speed[form.name], self._out[form.name]
        if contender.python is not None:
            # A function in Python measures its own time.
            nanoseconds = 0.0
            for _ in range(passes):
                pass_nanoseconds, out[:elements] = contender.python(speed[:elements].astype(np.float64), BETA)
                nanoseconds += pass_nanoseconds
            return nanoseconds
        function = self._libraries[contender.loaded_from(measure)][contender.function(measure, form)]
        function.restype = ctypes.c_double
        work = _Work(elements, passes, speed.ctypes.data, out.ctypes.data, BETA)
        return float(function(ctypes.byref(work)))

    # --- what they return ---------------------------------------------------------------------------------------------

    def errors(self, contender: Contender, form: Format) -> tuple[float, float] | None:
        """Check the results of every measured function of a contender, in one format.

        Returns
        -------
        (float, float) or None
            The largest |d eps|/eps and |d eps|/(1 - eps) over sampled speeds, or None if there is no error.

        Raises
        ------
        BenchError
            If results differ from the expected ones by more than the tolerance, or an error contradicts its proof.
        """
        # beta as the format rounds it, and the exact eps and 1 - eps at the speeds of the format.
        size, beta = min(contender.most, self.sizes.sampled), float(DTYPE[form](BETA))
        largest = [0.0, 0.0]
        speed = self._speed[form.name][:size].astype(np.float64)
        eps, loss = double.exact_of_speed(speed, np.full(size, beta))
        low, high = contender.valid or (0.0, np.inf)
        valid = (low <= speed) & (speed <= high)
        for measure in contender.measures:
            out = self._out[form.name][:size]
            out[:] = np.nan  # an element that a contender does not write is noticed
            self.run(contender, form, measure, size)
            results = out.astype(np.float64)
            # A rival is compared with the same formula in NumPy, within its slack: it is an approximation of eps. An
            # exported kernel is compared with eps itself, within its proven bound.
            expected = eps if contender.expected is None else contender.expected(speed, beta)
            tolerance = contender.slack * form.epsilon * np.maximum(np.abs(expected), 1.0)
            if contender.expected is None:
                tolerance = allowed_error(contender.proven[form.name], form) * np.minimum(eps, loss)
            # Written so that NaN is wrong.
            wrong = ~(np.abs(results - expected) <= tolerance)
            if wrong.any():
                i = int(wrong.argmax())
                what = "contradicts its proof" if contender.expected is None else "computes rubbish"
                raise BenchError(
                    f"{contender.id} ({form.name}, {measure}) {what}: {results[i]:.17g} at speed {speed[i]:.17g}, "
                    f"where it should be {expected[i]:.17g} within {tolerance[i]:.3g}"
                )
            if contender.group != "limit" and valid.any():
                error = np.abs(results - eps)[valid]
                errors = (float((error / reference[valid]).max()) for reference in (eps, loss))
                largest = [max(pair) for pair in zip(largest, errors, strict=True)]
        return (largest[0], largest[1]) if max(largest) > 0 else None

    # --- how long they take -------------------------------------------------------------------------------------------

    def tasks(self) -> list[Task]:
        """Return all measurements, each with enough passes to last `Sizes.duration`."""
        return [
            self._task(contender, form, measure)
            for contender in self.contenders
            for form in contender.formats
            for measure in contender.measures
        ]

    def _task(self, contender: Contender, form: Format, measure: Measure) -> Task:
        """Return a measurement with its numbers of elements and of passes."""
        # The first run warms up; the second one estimates the time of a call.
        probe = min(contender.most, _PROBE)
        self.run(contender, form, measure, probe)
        ns_per_call = self.run(contender, form, measure, probe) / probe
        length = {"memory": self.sizes.memory, "cache": CACHE}.get(measure, self.sizes.scalar)
        elements = min(contender.most, length, MOST_OF_SLOW if measure == "memory" and ns_per_call > SLOW else length)
        # One pass over arrays from memory lasts long enough; over others there are as many as fill the shortest time.
        passes = 1 if measure == "memory" else max(1, round(self.sizes.duration / (ns_per_call * elements)))

        def run(passes: int) -> float:
            """Return the nanoseconds of some passes."""
            return self.run(contender, form, measure, elements, passes)

        return Task(Key(contender.id, form.name, measure), run, elements, passes)


def ulp_of_eps(form: Format) -> float:
    """Return the largest ulp of eps over the benchmark's speeds, relative to the smaller of eps and 1 - eps."""
    # epsilon is the distance from 1 to the next number of the format. Below 1/2, an ulp of eps is at most epsilon eps.
    # From 1/2 on it is epsilon/2, and 1 - eps is least at the lowest speed.
    return max(form.epsilon, form.epsilon / 2 / float(double.one_minus_epsilon(spheres.v_star(SPEED_MIN, BETA))))


def proven_error(bound: ErrorBound, form: Format) -> Fraction:
    """Return a proven bound over the benchmark's speeds as one number, relative to the smaller of eps and 1 - eps.

    Of a bound, `relative` is relative to that smaller one, `last` to eps, and `ulps` are ulp of eps.
    """
    # 1 - eps is least at the lowest speed, where it is 0.3: there eps is 2.4 times as large.
    ratio = 1 / Fraction(float(double.one_minus_epsilon(spheres.v_star(SPEED_MIN, BETA)))) - 1
    return bound.relative + bound.last * max(ratio, Fraction(1)) + bound.ulps * Fraction(ulp_of_eps(form))


def allowed_error(bound: ErrorBound, form: Format) -> float:
    """Return the largest error that does not contradict a proof, relative to the smaller of eps and 1 - eps.

    `bound` is the proven bound of a kernel in a format.
    """
    # A kernel of v* gets v* = sqrt(beta) pow(speed, 1/10), rounded: what that adds, for speeds from 1/r to r.
    v_star_error = (
        eps_error_from_v_star(HOSTS[form.name], Fraction(max(SPEED_MAX, 1 / SPEED_MIN)))
        if bound.result == "epsilon"
        else 0
    )
    # Errors multiply: (1 + e_1)(1 + e_2) - 1. The eps that is compared with is rounded, too.
    return float((1 + proven_error(bound, form)) * (1 + v_star_error) - 1) + double.ULP["epsilon"] * ulp_of_eps(DOUBLE)


def in_rounds(tasks: Sequence[Task], rounds: int) -> dict[Key, FloatArray]:
    """Return the nanoseconds per collision of all tasks by key, an array with a number for each of `rounds`.

    Tasks are measured in turn. Tasks to be compared (of one format and measure) follow each other, in an order that
    changes from round to round, so that a drift affects all alike.
    """

    def block(task: Task) -> tuple[str, ...]:
        """Return format and measure, without the contender."""
        return task.key[1:]

    # Blocks, and the tasks in each, are shuffled anew for every round.
    times: dict[Key, list[float]] = {task.key: [] for task in tasks}
    order = random.Random(_SEED)
    blocks = [list(compared) for _, compared in groupby(sorted(tasks, key=block), block)]
    for _ in track(range(rounds), "measuring"):
        order.shuffle(blocks)
        for compared in blocks:
            order.shuffle(compared)
            for task in compared:
                times[task.key].append(task.measure())
    return {key: np.asarray(values) for key, values in times.items()}


def c_file(contenders: Sequence[Contender]) -> str:
    """Return the text of bench.c: headers, the contenders' code, and the timed loops of each library."""
    # Lines of C by library; the same lines, headers and sources are written once.
    loops: dict[Library, list[str]] = {"scalar": [], "array": [], "vector": []}
    for contender in contenders:
        if contender.python is None:
            for measure in contender.measures:
                loops[contender.loaded_from(measure)] += (contender.loop(measure, form) for form in contender.formats)
    return template(__name__, "bench.c.jinja").render(
        marker=marker_line("viscopade bench"),
        formats=tuple(FORMATS.values()),
        headers=list(dict.fromkeys(contender.header for contender in contenders if contender.header)),
        sources=list(dict.fromkeys(contender.source for contender in contenders if contender.source)),
        loops={library: list(dict.fromkeys(lines)) for library, lines in loops.items()},
    )
