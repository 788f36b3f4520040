"""The exported kernels as contenders: functions of the headers, with their proven errors."""

from __future__ import annotations

import time
from collections.abc import Iterator

import viscopade
from viscopade.arithmetic.decimals import at_most
from viscopade.arithmetic.formats import DOUBLE, FORMATS
from viscopade.arrays.checked import FloatArray
from viscopade.kernels import catalogue
from viscopade.kernels.bound import ErrorBound
from viscopade.kernels.kernel import Kernel
from viscopade_lab.bench.contender import Contender
from viscopade_lab.bench.rivals import expression_contender, tenth_root


def contenders() -> Iterator[Contender]:
    """Yield the kernels from speed to eps, those of v* with pow before them, and the array function of Python."""
    speed_kernels = [_tier_contender(tier) for tier in catalogue.TIERS]
    yield from speed_kernels
    for entry in catalogue.group("minimax"):
        yield _minimax_contender(entry.kernel)
    yield expression_contender(
        "full",
        "pow + full",
        lambda form: f"viscopade_epsilon_full{form.suffix}(v_star)",
        root=tenth_root,
        group="ours",
        header="viscopade_full.h",
        formats=(DOUBLE,),
        proven=_proven(catalogue.kernel("full"), "epsilon"),
    )
    yield Contender(  # the extension has the functions of the header for full accuracy
        "vp.restitution",
        "vp.restitution",
        "ours",
        formats=(DOUBLE,),
        measures=("memory",),
        proven=speed_kernels[-1].proven,
        python=_restitution,
    )


def _restitution(speed: FloatArray, beta: float) -> tuple[float, FloatArray]:
    """Return the nanoseconds that `vp.restitution` takes for an array of speeds, and its eps."""
    begin = time.perf_counter_ns()
    epsilon = viscopade.restitution(speed, beta)
    return float(time.perf_counter_ns() - begin), epsilon


def _proven(kernel: Kernel, function: str) -> dict[str, ErrorBound]:
    """Return the proven errors of a kernel's function by format; of a speed table those inside the table.

    The benchmark's speeds lie in the table, and in the first range of v* for which a kernel of v* has a bound.
    """
    if kernel.argument == "v_star":
        return {form: kernel.bound(function, "host", form)[0] for form in kernel.formats}
    return {form: kernel.table_bound(function, form) for form in kernel.formats}


def _tier_contender(tier: str) -> Contender:
    """Return the kernel from speed to eps of an accuracy, such as "1e-5" or "full": a speed table with its header."""
    # Headers name functions by the kernel, "1em5" for the accuracy 1e-5; they have a scalar and an array function.
    kernel = catalogue.kernel(f"speed {tier}")
    return Contender(
        f"speed-{tier}",
        f"from speed, {tier}",
        "ours",
        header=f"viscopade_speed_{kernel.name}.h",
        scalar=f"viscopade_restitution_{kernel.name}",
        array=f"viscopade_restitution_array_{kernel.name}",
        proven=_proven(kernel, "restitution"),
    )


def _minimax_contender(kernel: Kernel) -> Contender:
    """Return a best quotient of v* as a function of speed, which computes v* = sqrt(beta) speed^(1/10) by pow.

    Its name has its accuracy, the proven error of the formula in double.
    """
    error = at_most(kernel.bound("epsilon", "host", "double")[0].formula)
    return Contender(
        f"minimax-{error}",
        f"pow + minimax, {error}",
        "ours",
        header="viscopade_minimax.h",
        scalar=f"viscopade_restitution_{kernel.name}",
        formats=tuple(FORMATS[name] for name in kernel.formats),
        proven=_proven(kernel, "epsilon"),
    )
