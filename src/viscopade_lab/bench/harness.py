"""Run the compiled contenders on the speeds of a range: what they return, and how long they take."""

from __future__ import annotations

import ctypes
import random
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from viscopade.arithmetic.formats import DOUBLE, FLOAT, FORMATS, Format
from viscopade.arrays.checked import FloatArray
from viscopade.arrays.double import exact_of_speed
from viscopade.generated import marker_line, template
from viscopade.kernels import toolchain
from viscopade.kernels.toolchain import Compiler, Library
from viscopade.progress import track
from viscopade_lab.bench.contender import Contender, Measure
from viscopade_lab.bench.speed_range import DISTRIBUTIONS, Distribution, SpeedRange

CHECKED = 4096  # results of every function that are compared with what they should be
SLOW = 10.0  # ns per collision beyond which the memory's speed does not matter
MOST_OF_SLOW = 1 << 20  # elements of these from memory
RUNS = 3  # of which the fastest counts
_PROBE = 64
_SEED = 1

DTYPE: Mapping[Format, type[np.float64] | type[np.float32]] = {DOUBLE: np.float64, FLOAT: np.float32}
"""NumPy's names of the types."""

Array = npt.NDArray[np.floating]


class BenchError(RuntimeError):
    """Error: the benchmark's result is not reliable; the message is one line."""


class _Work(ctypes.Structure):
    """struct bench_work of bench.h."""

    _fields_ = (
        ("n", ctypes.c_size_t),
        ("passes", ctypes.c_size_t),
        ("speed", ctypes.c_void_p),
        ("out", ctypes.c_void_p),
        ("beta", ctypes.c_double),
        ("pair", ctypes.c_void_p),
        ("beta_of", ctypes.c_void_p),
    )


@dataclass(frozen=True)
class ArraySizes:
    """How much is measured at once.

    Attributes
    ----------
    memory, cache, scalar : int
        Elements of an array.
    duration : float
        Nanoseconds that a measurement should take at least; shorter ones are repeated.
    sampled : int
        Speeds at which errors are sampled.
    """

    memory: int = 1 << 23
    cache: int = 2048
    scalar: int = 1 << 14
    duration: float = 2e6
    sampled: int = 1 << 17

    def of(self, measure: Measure) -> int:
        """Return the elements of a measure."""
        return {"memory": self.memory, "cache": self.cache}.get(measure, self.scalar)

    @property
    def most(self) -> int:
        """The longest array."""
        return max(self.memory, self.cache, self.scalar, self.sampled, CHECKED)


class Key(NamedTuple):
    """What is measured: a contender, in a type, on some speeds, by a measure."""

    id: str
    format: str
    speeds: Distribution
    measure: Measure


@dataclass(frozen=True)
class Task:
    """A measurement that each round repeats.

    Attributes
    ----------
    key : Key
    run : callable
        From a number of passes to the nanoseconds that they took.
    elements, passes : int
    """

    key: Key
    run: Callable[[int], float]
    elements: int
    passes: int

    def measure(self) -> float:
        """Return nanoseconds per collision, the least of several runs: others may need the processor in one.

        All but arrays from memory are in the cache when it starts.
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
        The exported headers that they include.
    compiler : Compiler
    speeds : SpeedRange
    sizes : ArraySizes
    """

    def __init__(
        self,
        contenders: Sequence[Contender],
        headers: Mapping[str, str],
        compiler: Compiler,
        speeds: SpeedRange,
        sizes: ArraySizes,
    ) -> None:
        self.contenders, self.range, self.sizes = contenders, speeds, sizes
        self._libraries = _build(contenders, headers, compiler)
        self._functions: dict[tuple[Library, str], Callable[[object], float]] = {}
        most = sizes.most
        self._speed = {
            (form.name, kind): speeds.speeds(kind, most).astype(DTYPE[form])
            for form in FORMATS.values()
            for kind in DISTRIBUTIONS
        }
        self._out: dict[str, Array] = {form.name: np.zeros(most, DTYPE[form]) for form in FORMATS.values()}
        self._pair = speeds.pairs(most)
        self._beta_of_pairs = {form.name: speeds.beta_of_pairs.astype(DTYPE[form]) for form in FORMATS.values()}
        self._beta_of_each = {kind: values[self._pair] for kind, values in self._beta_of_pairs.items()}

    def run(
        self,
        contender: Contender,
        form: Format,
        speeds: Distribution,
        measure: Measure,
        elements: int,
        passes: int = 1,
    ) -> float:
        """Run a contender; return the nanoseconds it took. The results are then in `results`."""
        if contender.python is not None:
            taken = 0.0
            for _ in range(passes):
                once, values = contender.python(self.speeds(form, speeds, elements), self.range.beta)
                self._out[form.name][:elements] = values
                taken += once
            return taken
        betas = self._beta_of_pairs if contender.beta == "pair" else self._beta_of_each
        work = _Work(
            elements,
            passes,
            self._speed[form.name, speeds].ctypes.data,
            self._out[form.name].ctypes.data,
            self.range.beta,
            self._pair.ctypes.data,
            betas[form.name].ctypes.data,
        )
        return self._function(contender, measure, form)(ctypes.byref(work))

    def _function(self, contender: Contender, measure: Measure, form: Format) -> Callable[[object], float]:
        place = contender.library(measure), contender.function(measure, form)
        if place not in self._functions:
            function = self._libraries[place[0]][place[1]]
            function.restype = ctypes.c_double
            self._functions[place] = function
        return self._functions[place]

    def results(self, form: Format, elements: int) -> FloatArray:
        """Return what the last run of a contender of this type returned."""
        return self._out[form.name][:elements].astype(np.float64)

    def forget(self, form: Format, elements: int) -> None:
        """Make the results NaN: what a contender does not write is seen."""
        self._out[form.name][:elements] = np.nan

    def speeds(self, form: Format, kind: Distribution, elements: int) -> FloatArray:
        """Return the speeds that contenders of this type get."""
        return self._speed[form.name, kind][:elements].astype(np.float64)

    def betas(self, contender: Contender, form: Format, elements: int) -> FloatArray:
        """Return the betas that a contender gets."""
        if contender.beta != "one":
            return self._beta_of_each[form.name][:elements].astype(np.float64)
        return np.full(elements, float(DTYPE[form](self.range.beta)))

    # --- what they return ---------------------------------------------------------------------------------------------

    def check(self) -> None:
        """Compare results of every function that is measured with what it should compute.

        Raises
        ------
        BenchError
            If they differ by more than the contender's tolerance.
        """
        for i in track(range(len(self.contenders)), "checking the results"):
            for form in self.contenders[i].formats:
                for speeds in DISTRIBUTIONS:
                    self._check(self.contenders[i], form, speeds)

    def _check(self, contender: Contender, form: Format, kind: Distribution) -> None:
        size = min(contender.most, CHECKED)
        speed, beta = self.speeds(form, kind, size), self.betas(contender, form, size)
        expected = contender.expected(speed, beta)
        tolerance = contender.tolerance(form, expected)
        for measure in contender.measures:
            self.forget(form, size)
            self.run(contender, form, kind, measure, size)
            found = self.results(form, size)
            wrong = ~(np.abs(found - expected) <= tolerance)
            if wrong.any():
                i = int(wrong.argmax())
                raise BenchError(
                    f"{contender.id} ({form.name}, {measure}) computes rubbish: {found[i]:.9g} at speed {speed[i]:.9g} "
                    f"and beta {beta[i]:.9g}, where it should be {expected[i]:.9g}"
                )

    def largest_errors(self, contender: Contender, form: Format) -> tuple[float, float] | None:
        """Return the largest |d eps|/eps and |d eps|/(1 - eps) over sampled speeds, or None if there are no errors."""
        if contender.group == "limit":
            return None
        size = min(contender.most, self.sizes.sampled)
        largest = [0.0, 0.0]
        for kind in DISTRIBUTIONS:
            speed = self.speeds(form, kind, size)
            low, high = contender.valid or (0.0, np.inf)
            valid = (low <= speed) & (speed <= high)
            if not valid.any():
                continue
            eps, loss = exact_of_speed(speed, self.betas(contender, form, size))
            for function in _different(contender.measures):
                self.run(contender, form, kind, function, size)
                error = np.abs(self.results(form, size) - eps)[valid]
                for i, scale in enumerate((eps, loss)):
                    largest[i] = max(largest[i], float((error / scale[valid]).max()))
        return (largest[0], largest[1]) if max(largest) > 0 else None

    # --- how long they take -------------------------------------------------------------------------------------------

    def tasks(self) -> list[Task]:
        """Return all that is to be measured, each with as many passes as fill the time."""
        return [
            self._task(contender, form, speeds, measure)
            for contender in self.contenders
            for form in contender.formats
            for speeds in DISTRIBUTIONS
            for measure in contender.measures
        ]

    def _task(self, contender: Contender, form: Format, speeds: Distribution, measure: Measure) -> Task:
        probe = min(contender.most, _PROBE)
        self.run(contender, form, speeds, measure, probe)
        each = self.run(contender, form, speeds, measure, probe) / probe
        elements = min(contender.most, self.sizes.of(measure))
        if measure == "memory" and each > SLOW:
            elements = min(elements, MOST_OF_SLOW)
        passes = 1 if measure == "memory" else max(1, round(self.sizes.duration / (each * elements)))

        def run(passes: int) -> float:
            return self.run(contender, form, speeds, measure, elements, passes)

        return Task(Key(contender.id, form.name, speeds, measure), run, elements, passes)


def in_rounds(tasks: Sequence[Task], rounds: int) -> dict[Key, FloatArray]:
    """Measure all tasks in turn, once in each round.

    Those to be compared (of one type, speeds and measure) follow each other at once, in an order that changes from
    round to round, so that what drifts hits all alike.
    """
    times: dict[Key, list[float]] = {task.key: [] for task in tasks}
    order = random.Random(_SEED)
    blocks = [list(block) for block in _blocks(tasks)]
    for _ in track(range(rounds), "measuring"):
        order.shuffle(blocks)
        for block in blocks:
            order.shuffle(block)
            for task in block:
                times[task.key].append(task.measure())
    return {key: np.asarray(values) for key, values in times.items()}


def _blocks(tasks: Sequence[Task]) -> Iterator[Iterator[Task]]:
    """Return the tasks that are compared with each other."""

    def block(task: Task) -> tuple[str, ...]:
        return task.key.format, task.key.speeds, task.key.measure

    return (group for _, group in groupby(sorted(tasks, key=block), block))


def _different(measures: Sequence[Measure]) -> list[Measure]:
    """Return one measure for each function with results of its own."""
    one_of_each: tuple[Measure, ...] = ("throughput", "cache")
    chosen = [measure for measure in one_of_each if measure in measures]
    return chosen or list(measures)


def c_file(contenders: Sequence[Contender]) -> str:
    """Return the C file with all contenders, and the loops of each library."""
    loops: dict[Library, list[str]] = {"scalar": [], "array": [], "vector": []}
    for contender in contenders:
        if contender.python is None:
            for measure in contender.measures:
                loops[contender.library(measure)] += (contender.loop(measure, form) for form in contender.formats)
    return template(__name__, "bench.c.jinja").render(
        marker=marker_line("viscopade bench"),
        headers=list(dict.fromkeys(contender.header for contender in contenders if contender.header)),
        sources=list(dict.fromkeys(contender.source for contender in contenders if contender.source)),
        loops={library: list(dict.fromkeys(lines)) for library, lines in loops.items()},
    )


def _build(
    contenders: Sequence[Contender], headers: Mapping[str, str], compiler: Compiler
) -> dict[Library, ctypes.CDLL]:
    """Compile the C file once for each library that holds a loop."""
    used = {c.library(measure) for c in contenders if c.python is None for measure in c.measures}
    units = {
        library: {"part.c": f'#define BENCH_LIBRARY_{library.upper()}\n#include "bench.c"\n'}
        for library in sorted(used)
    }
    return toolchain.build(compiler, units, {**headers, "bench.c": c_file(contenders)})
