"""The kernels that viscopade exports: the functions of its headers, with what is proven of their errors."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace

import viscopade
from viscopade.arithmetic.formats import DOUBLE, FLOAT, Format
from viscopade.arrays.checked import FloatArray
from viscopade.arrays.double import exact_of_speed
from viscopade.kernels import requests
from viscopade.kernels.forms import last_place
from viscopade.kernels.forms.minimax import MinimaxKernel
from viscopade.kernels.forms.speed_table import OCTAVES
from viscopade.kernels.forms.speed_table_last_place import LastPlaceTable, ulp_of_w
from viscopade.kernels.prove_lacunary import speed_kernel
from viscopade_lab.bench.contender import ARRAY, Contender, ProvenError
from viscopade_lab.bench.rivals import of_v_star
from viscopade_lab.bench.speed_range import PAIRS, SpeedRange

TIERS = ("1e-5", "1e-10", "full")
WITH_PAIRS = "1e-5"  # the tier whose functions with a table of pairs and with one beta per element are measured, too
MINIMAX_END = 5.0

# Half an ulp of float, and less than a thousandth of it for what double is off.
_ROUNDED_TO_FLOAT = 0.501


def contenders(speeds: SpeedRange) -> Iterator[Contender]:
    """Yield the contenders that are meant for a range of speeds."""
    for tier in TIERS:
        yield from _of_tier(tier, speeds)
    if speeds.v_star_max <= MINIMAX_END:
        for kernel in requests.RECOMMENDED.quotients():
            if isinstance(kernel, MinimaxKernel):
                yield _minimax(kernel)
    yield of_v_star(
        "full",
        "pow + full",
        lambda form: f"viscopade_epsilon_full{form.suffix}(v_star)",
        _eps,
        group="ours",
        header="viscopade_full.h",
        formats=(DOUBLE,),
        slack=16,
        floor=0,
        proven={"double": ProvenError(ulps=float(last_place.largest_ulp(DOUBLE, "epsilon")), of_v_star=True)},
    )
    yield Contender(
        "vp.restitution",
        "vp.restitution",
        "ours",
        _eps,
        formats=(DOUBLE,),
        measures=("memory",),
        slack=8,
        floor=0,
        python=_restitution,
    )


def _eps(speed: FloatArray, beta: FloatArray) -> FloatArray:
    return exact_of_speed(speed, beta)[0]


def _restitution(speed: FloatArray, beta: float) -> tuple[float, FloatArray]:
    begin = time.perf_counter_ns()
    epsilon = viscopade.restitution(speed, beta)
    return float(time.perf_counter_ns() - begin), epsilon


def _of_tier(tier: str, speeds: SpeedRange) -> Iterator[Contender]:
    """Yield a kernel from speed to eps, and the functions with several betas of one tier."""
    kernel = speed_kernel(tier)
    name, table = kernel.name, kernel.table
    formats = (DOUBLE, FLOAT)
    if isinstance(table, LastPlaceTable):
        ulps = float(table.proven.ulp + ulp_of_w())
        bound, proven = 0.0, {"double": ProvenError(ulps=ulps), "float": ProvenError(ulps=_ROUNDED_TO_FLOAT)}
    else:
        # The tables end at 2^(first + OCTAVES) in w = v*^10.
        inside = speeds.v_star_max**10 < 2.0 ** (table.first + OCTAVES)
        own = {form: form if form in kernel.formats else DOUBLE for form in formats}
        last = {form: 0.5 if form in kernel.formats else _ROUNDED_TO_FLOAT for form in formats}
        bound = float(kernel.bound)
        proven = (
            {form.name: ProvenError(float(table.inside(own[form])), last[form]) for form in formats} if inside else {}
        )
    main = Contender(
        f"speed-{tier}",
        f"from speed, {tier}",
        "ours",
        _eps,
        header=f"viscopade_speed_{tier.replace('-', 'm')}.h",
        scalar=f"viscopade_restitution_{name}",
        array=f"viscopade_restitution_array_{name}",
        bound=bound,
        slack=8,
        floor=0,
        proven=proven,
    )
    yield main
    if tier == WITH_PAIRS:
        each = replace(
            main,
            id=f"{main.id}-each",
            label=f"{main.label}, beta of each",
            scalar="",
            array=f"viscopade_restitution_each_{name}",
            measures=ARRAY,
            beta="each",
        )
        yield replace(
            each,
            id=f"{main.id}-by-pair",
            label=f"{main.label}, beta of {PAIRS} pairs",
            array=f"viscopade_restitution_by_pair_{name}",
            beta="pair",
        )
        yield each


def _minimax(kernel: MinimaxKernel) -> Contender:
    """Return a best quotient of v*, for which pow makes v*."""

    def error(form: Format) -> tuple[float, float]:
        (variant,) = (variant for variant in kernel.variants if variant.form == form)
        return float(variant.certificate.bound), float(variant.rounding)

    formats = tuple(variant.form for variant in kernel.variants)
    return Contender(
        f"minimax-{kernel.variants[0].certificate.bound}",
        f"pow + minimax, {kernel.variants[0].certificate.bound}",
        "ours",
        _eps,
        header="viscopade_minimax.h",
        scalar=f"viscopade_restitution_{kernel.name}",
        formats=formats,
        bound=max(error(form)[0] for form in formats),
        slack=300,
        proven={form.name: ProvenError(sum(error(form)), of_v_star=True) for form in formats},
    )
