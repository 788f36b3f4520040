"""Contender: a C function from speed to eps that the benchmark builds, checks and times."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal, get_args

from viscopade.arithmetic.formats import DOUBLE, FLOAT, Format
from viscopade.arrays.checked import FloatArray
from viscopade.kernels.bound import ErrorBound
from viscopade_lab.bench.libraries import Library

Group = Literal["ours", "rival", "limit"]
Measure = Literal["latency", "throughput", "cache", "memory"]
MEASURES: tuple[Measure, ...] = get_args(Measure)
SCALAR: tuple[Measure, ...] = ("latency", "throughput")
ARRAY: tuple[Measure, ...] = ("cache", "memory")


@dataclass(frozen=True)
class Contender:
    """A function, its forms in C, and its expected results.

    Attributes
    ----------
    id : str
        Short name; letters, digits and _ + - / [ ].
    label : str
        Description for the reader.
    group : "ours", "rival" or "limit"
        "limit" is a yardstick that does not compute eps.
    source : str
        C code that defines the functions.
    header : str
        Exported file that it includes.
    scalar, array : str
        Names of the C functions (of speed and beta; of n, speed, beta, out) without the suffix of the format. Without
        `array` the array is a loop over `scalar`.
    takes_root : bool
        The functions take sqrt(beta), computed once before the loop, for beta.
    formats : tuple of Format
    measures : tuple of Measure
    expected : callable or None
        From speeds and a beta to the expected results, computed in another way. None: eps, within its bound.
    slack : float
        Tolerance of that comparison, in units of the format's epsilon, relative to the larger of the result and 1.
    proven : mapping of str to ErrorBound
        By format; for a function of v* (its result is "epsilon") without the rounding of v*.
    fast_math : bool
        Build the array function with -ffast-math, too.
    valid : (float, float) or None
        Speeds for which an error makes sense, if not all.
    most : int
        Largest number of elements, for slow functions.
    python : callable or None
        Instead of C: from speeds and a beta to the nanoseconds taken and the results.
    """

    id: str
    label: str
    group: Group
    source: str = ""
    header: str = ""
    scalar: str = ""
    array: str = ""
    takes_root: bool = False
    formats: tuple[Format, ...] = (DOUBLE, FLOAT)
    measures: tuple[Measure, ...] = MEASURES
    expected: Callable[[FloatArray, float], FloatArray] | None = None
    slack: float = 100.0
    proven: Mapping[str, ErrorBound] = field(default_factory=dict)
    fast_math: bool = False
    valid: tuple[float, float] | None = None
    most: int = 1 << 40
    python: Callable[[FloatArray, float], tuple[float, FloatArray]] | None = None

    def loaded_from(self, measure: Measure) -> Library:
        """Return the library (they differ in compiler flags) that contains the function of a measure."""
        if measure in SCALAR:
            return "scalar"
        return "vector" if self.fast_math else "array"

    def function(self, measure: Measure, form: Format) -> str:
        """Return the C name of the function that runs the timed loop in a format; cache and memory share one."""
        kind = measure if measure in SCALAR else "array"
        return f"bench_{kind}_{identifier(self.id)}_{form.name}"

    def loop(self, measure: Measure, form: Format) -> str:
        """Return the line of C that defines the timed loop of a measure in a format: a macro of bench.c with arguments.

        BENCH_LATENCY makes each call wait for the one before, by `bench_after`; in BENCH_THROUGHPUT no call waits.
        BENCH_ARRAY calls the contender's array function, BENCH_LOOP its scalar one for each element.
        """
        # What is computed from beta before the loop: its root, or nothing.
        prepare = f"sqrt{form.suffix}" if self.takes_root else "BENCH_AS_IT_IS"
        start = f"({self.function(measure, form)}, {form.name}, {prepare}, "
        if measure == "latency":
            return f"BENCH_LATENCY{start}{self.scalar}{form.suffix}, bench_after{form.suffix})"
        if measure == "throughput":
            return f"BENCH_THROUGHPUT{start}{self.scalar}{form.suffix})"
        if self.array:
            return f"BENCH_ARRAY{start}{self.array}{form.suffix})"
        return f"BENCH_LOOP{start}{self.scalar}{form.suffix})"


def identifier(ident: str) -> str:
    """Return an id in letters that a name in C may have."""
    return "".join(character if character.isalnum() else "_" for character in ident)
