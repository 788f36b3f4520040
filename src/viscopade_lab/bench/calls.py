"""`viscopade.restitution` on a NumPy array, beside the C function for arrays that it should be as fast as."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np

import viscopade
from viscopade.arithmetic.formats import DOUBLE
from viscopade_lab.bench.contender import Contender
from viscopade_lab.bench.harness import BenchError, Harness, Task
from viscopade_lab.bench.result import CALL, Key
from viscopade_lab.bench.speed_range import Distribution
from viscopade_lab.bench.times import Times

ELEMENTS = 1_000_000
PYTHON, C = "vp.restitution", "speed-full"
_SPEEDS: Distribution = "log-uniform"
_ULPS = 4  # by which the two may differ: a compiler may contract products and sums


def tasks(harness: Harness, contenders: Sequence[Contender]) -> list[Task]:
    """Return the two calls to be compared, or none if that of C is not wanted.

    Raises
    ------
    BenchError
        If they do not return the same.
    """
    contender = next((contender for contender in contenders if contender.id == C), None)
    if contender is None:
        return []
    elements = min(ELEMENTS, harness.sizes.most)
    speed, beta = harness.speeds(DOUBLE, _SPEEDS, elements), harness.range.beta

    def call_python(passes: int) -> float:
        begin = time.perf_counter_ns()
        for _ in range(passes):
            viscopade.restitution(speed, beta)
        return float(time.perf_counter_ns() - begin)

    def call_c(passes: int) -> float:
        return harness.run(contender, DOUBLE, _SPEEDS, "memory", elements, passes)

    call_c(1)
    expected = harness.results(DOUBLE, elements)
    if not np.allclose(viscopade.restitution(speed, beta), expected, rtol=_ULPS * DOUBLE.epsilon, atol=0):
        raise BenchError(f"{PYTHON} and the C kernel {C} return different results")
    both = {PYTHON: call_python, C: call_c}
    return [Task(Key(name, DOUBLE.name, _SPEEDS, CALL), run, elements, 1) for name, run in both.items()]


def ratio(times: Times) -> float | None:
    """Return the median over the rounds of Python's time over C's, or None if it was not measured."""
    python, c = (times.get(Key(name, DOUBLE.name, _SPEEDS, CALL)) for name in (PYTHON, C))
    return None if python is None or c is None else float(np.median(python / c))
