"""A function from speed to eps in C, as the benchmark builds, checks and times it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np

from viscopade.arithmetic.formats import DOUBLE, FLOAT, Format
from viscopade.arrays.checked import FloatArray
from viscopade.kernels.toolchain import Library

Group = Literal["ours", "rival", "limit"]
TimingMeasure = Literal["latency", "throughput", "cache", "memory"]
Beta = Literal["one", "pair", "each"]
ProvenOf = Literal["speed", "v_star"]
GROUPS: tuple[Group, ...] = get_args(Group)
MEASURES: tuple[TimingMeasure, ...] = get_args(TimingMeasure)
PROVEN_OF: tuple[ProvenOf, ...] = get_args(ProvenOf)
SCALAR: tuple[TimingMeasure, ...] = ("latency", "throughput")
ARRAY: tuple[TimingMeasure, ...] = ("cache", "memory")

Expected = Callable[[FloatArray, FloatArray], FloatArray]


DTYPE: Mapping[Format, type[np.float64] | type[np.float32]] = {DOUBLE: np.float64, FLOAT: np.float32}
"""NumPy's names of the types."""


@dataclass(frozen=True)
class Contender:
    """A function, its two or three forms in C, and what its results must be.

    Attributes
    ----------
    id : str
        Short name; letters, digits and _ + - /.
    label : str
        What it is, for the reader.
    group : "ours", "rival" or "limit"
        "limit" is a yardstick that is no coefficient of restitution.
    expected : callable
        What the C code should compute, from speeds and betas, by another way.
    source : str
        C code that defines the functions.
    headers : tuple of str
        Exported files that it includes.
    scalar, array : str
        Names of the C functions (of speed and beta; of n, speed, beta, out) without the type's suffix. Without
        `scalar` there are no scalar measurements; without `array` the array is a loop over `scalar`.
    takes_root : bool
        The functions take sqrt(beta), computed once before the loop, for beta.
    beta : "one", "pair" or "each"
        What the array function takes.
    formats : tuple of Format
    measures : tuple of TimingMeasure
    bound : float
        Tolerance of the check, relative to the smaller of eps and 1 - eps.
    slack : float
        Added to it, in units of the type's epsilon, relative to the result.
    floor : float
        The least result to which `slack` is relative: where terms cancel.
    proven : mapping of str to str
        By type, the proven error.
    proven_of : "speed" or "v_star"
        Of what function that is: eps of the speed, or eps of a v*, so that the rounding of v* comes on top.
    note : str
        What the reader must know of the error.
    before : str
        C code ahead of the headers.
    fast_math : bool
        Build the array function with -ffast-math, too.
    valid : (float, float) or None
        Speeds for which an error makes sense, if not all.
    most : int
        Run on so many elements at most: slow ones.
    python : callable or None
        Instead of C: from speeds and a beta to the nanoseconds taken and the results.
    """

    id: str
    label: str
    group: Group
    expected: Expected
    source: str = ""
    headers: tuple[str, ...] = ()
    scalar: str = ""
    array: str = ""
    takes_root: bool = False
    beta: Beta = "one"
    formats: tuple[Format, ...] = (DOUBLE, FLOAT)
    measures: tuple[TimingMeasure, ...] = MEASURES
    bound: float = 0.0
    slack: float = 100.0
    floor: float = 1.0
    proven: Mapping[str, str] = field(default_factory=dict)
    proven_of: ProvenOf = "speed"
    note: str = ""
    before: str = ""
    fast_math: bool = False
    valid: tuple[float, float] | None = None
    most: int = 1 << 40
    python: Callable[[FloatArray, float], tuple[float, FloatArray]] | None = None

    def __post_init__(self) -> None:
        if self.python is None and not self.scalar and (not self.array or set(self.measures) & set(SCALAR)):
            raise ValueError(f"{self.id}: a contender needs a C function for each of its measures")

    def built_in(self, measure: TimingMeasure) -> Library:
        """Return which of the libraries, built with different flags, holds the function of a measure."""
        if measure in SCALAR:
            return "scalar"
        return "vector" if self.fast_math else "array"

    def function(self, measure: TimingMeasure, form: Format) -> str:
        """Return the name of the function that runs the loop; cache and memory share one."""
        kind = measure if measure in SCALAR else "array"
        name = "".join(character if character.isalnum() else "_" for character in self.id)
        return f"bench_{kind}_{name}_{form.name}"

    def loop(self, measure: TimingMeasure, form: Format) -> str:
        """Return the line of C that defines that function."""
        scalar, array = (name and name + form.suffix for name in (self.scalar, self.array))
        prepare = f"sqrt{form.suffix}" if self.takes_root else "BENCH_AS_IT_IS"
        start = f"({self.function(measure, form)}, {form.name}, {prepare}, "
        if measure == "latency":
            return f"BENCH_LATENCY{start}{scalar}, bench_after{form.suffix})"
        if measure == "throughput":
            return f"BENCH_THROUGHPUT{start}{scalar})"
        if not array:
            return f"BENCH_LOOP{start}{scalar})"
        return f"BENCH_{ {'one': 'ARRAY', 'pair': 'PAIR', 'each': 'EACH'}[self.beta] }{start}{array})"

    def loops(self, library: Library) -> list[str]:
        """Return all that a library holds of this contender."""
        if self.python is not None:
            return []
        measures = [measure for measure in self.measures if self.built_in(measure) == library]
        lines = [self.loop(measure, form) for measure in measures for form in self.formats]
        return list(dict.fromkeys(lines))

    def tolerance(self, form: Format, expected: FloatArray) -> FloatArray:
        """Return how far results may be from those expected."""
        least = np.minimum(np.abs(expected), np.abs(1 - expected))
        return self.bound * least + self.slack * form.epsilon * np.maximum(np.abs(expected), self.floor)
