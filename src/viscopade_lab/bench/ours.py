"""The kernels that viscopade exports: the functions of its headers, with what is proven of their errors."""

from __future__ import annotations

import time
from collections.abc import Iterator

import viscopade
from viscopade.arithmetic.decimals import at_most
from viscopade.arithmetic.formats import DOUBLE, FLOAT, FORMATS
from viscopade.arrays.checked import FloatArray
from viscopade.kernels import catalogue, full
from viscopade.kernels.kernel import Kernel
from viscopade.kernels.speed_table import in_table, speed_table
from viscopade_lab.bench.contender import Contender, ProvenError
from viscopade_lab.bench.rivals import of_expression, tenth_root

TIERS = ("1e-5", "1e-10", "full")

# Half an ulp of float, and less than a thousandth of it for the error of double.
_ROUNDED_TO_FLOAT = 0.501


def contenders() -> Iterator[Contender]:
    """Yield the kernels from speed to eps, those of v* with pow before them, and the array function of Python."""
    of_speed = [_of_tier(tier) for tier in TIERS]
    yield from of_speed
    for entry in catalogue.group("minimax"):
        yield _minimax(entry.kernel)
    yield of_expression(
        "full",
        "pow + full",
        lambda form: f"viscopade_epsilon_full{form.suffix}(v_star)",
        root=tenth_root,
        group="ours",
        header="viscopade_full.h",
        formats=(DOUBLE,),
        proven={"double": ProvenError(ulps=float(full.largest_ulp("epsilon")), of_v_star=True)},
    )
    yield Contender(  # the extension has the functions of the header for full accuracy
        "vp.restitution",
        "vp.restitution",
        "ours",
        formats=(DOUBLE,),
        measures=("memory",),
        proven=of_speed[-1].proven,
        python=_restitution,
    )


def _restitution(speed: FloatArray, beta: float) -> tuple[float, FloatArray]:
    begin = time.perf_counter_ns()
    epsilon = viscopade.restitution(speed, beta)
    return float(time.perf_counter_ns() - begin), epsilon


def _of_tier(tier: str) -> Contender:
    """Return a kernel from speed to eps."""
    kernel = speed_table(tier)
    proven = {}
    for form in (DOUBLE, FLOAT):
        inside = in_table(kernel, "restitution", form)
        relative, ulps = float(inside.relative + inside.last), float(inside.ulps)
        proven[form.name] = ProvenError(relative, ulps)
    return Contender(
        f"speed-{tier}",
        f"from speed, {tier}",
        "ours",
        header=f"viscopade_speed_{tier.replace('-', 'm')}.h",
        scalar=f"viscopade_restitution_{kernel.name}",
        array=f"viscopade_restitution_array_{kernel.name}",
        proven=proven,
    )


def _minimax(kernel: Kernel) -> Contender:
    """Return a best quotient of v*, for which pow makes v*."""
    bounds = {form: kernel.bound("epsilon", "host", form)[0] for form in kernel.formats}
    error = at_most(bounds["double"].formula)
    return Contender(
        f"minimax-{error}",
        f"pow + minimax, {error}",
        "ours",
        header="viscopade_minimax.h",
        scalar=f"viscopade_restitution_{kernel.name}",
        formats=tuple(FORMATS[name] for name in kernel.formats),
        proven={name: ProvenError(float(b.relative + b.last), of_v_star=True) for name, b in bounds.items()},
    )
