"""The kernels that viscopade exports: the functions of its headers, with what is proven of their errors."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from decimal import ROUND_CEILING, Context, Decimal

from viscopade.arithmetic.formats import DOUBLE, FORMATS, Format
from viscopade.arrays.checked import FloatArray
from viscopade.arrays.double import exact_of_speed
from viscopade_lab import proven
from viscopade_lab.bench.contender import ARRAY, Contender
from viscopade_lab.bench.sources import render
from viscopade_lab.bench.speed_range import PAIRS, SpeedRange

TIERS = {
    "1e-3": "viscopade_speed_1em3.h",
    "1e-5": "viscopade_speed_1em5.h",
    "1e-7": "viscopade_speed_1em7.h",
    "1e-10": "viscopade_speed_1em10.h",
    "full": "viscopade_speed_full.h",
}
WITH_PAIRS = "1e-5"  # the tier whose functions with a table of pairs and with one beta per element are measured, too
_BY_ROOT = {"half-line": "viscopade_half_line.h", "minimax": "viscopade_minimax.h"}
_FULL = "viscopade_full.h"
MINIMAX_END = 5.0

_NAME = re.compile(r"\bdouble viscopade_restitution_(\w+)\(double speed, double beta\)")
_LOOKUP = "lookup_"
_GATHER = "#define VISCOPADE_OPAQUE_OF_TWO(index) ((void)0)"  # what keeps compilers from gathers is taken away
_LOADS = "#define VISCOPADE_OPAQUE_OF_TWO(index) VISCOPADE_OPAQUE(index)"
# Half an ulp of float, and less than a thousandth of it for what double is off.
_ROUNDED_TO_FLOAT = "0.501 ulp"


def tier_id(tier: str) -> str:
    """Return the id of a kernel from speed to eps."""
    return f"speed-{tier}"


FILES = {tier_id(tier): name for tier, name in TIERS.items()} | _BY_ROOT | {"full": _FULL}
"""By id, or the beginning of it, the header."""


def contenders(texts: Mapping[str, str], speeds: SpeedRange) -> list[Contender]:
    """Return the contenders of some headers that are meant for a range of speeds.

    Parameters
    ----------
    texts : mapping of str to str
        By name, the headers.
    speeds : SpeedRange
    """
    found: list[Contender] = []
    for tier, file in TIERS.items():
        if file in texts:
            found.extend(_of_tier(tier, file, texts[file], speeds))
    for kind, file in _BY_ROOT.items():
        if file in texts and (kind != "minimax" or speeds.v_star_max <= MINIMAX_END):
            found += (_by_root(kind, name, file, texts[file]) for name in _names(texts[file]))
    if _FULL in texts:
        found.append(_full())
    return found


def _names(text: str) -> list[str]:
    return list(dict.fromkeys(_NAME.findall(text)))


def _formats(text: str, function: str) -> tuple[Format, ...]:
    """Return the types that a function exists in."""
    return tuple(form for form in FORMATS.values() if f"{form.name} {function}{form.suffix}(" in text)


def _eps(speed: FloatArray, beta: FloatArray) -> FloatArray:
    return exact_of_speed(speed, beta)[0]


def _of_tier(tier: str, file: str, text: str, speeds: SpeedRange) -> list[Contender]:
    """Return a kernel from speed to eps, and the functions with several betas of one tier."""
    (name,) = (name for name in _names(text) if name.startswith(_LOOKUP))
    scalar, array = f"viscopade_restitution_{name}", f"viscopade_restitution_array_{name}"
    formats = _formats(text, scalar)
    label = f"speed to eps, {tier if tier == 'full' else 'to ' + tier}"

    main = Contender(
        tier_id(tier),
        label,
        "ours",
        _eps,
        headers=(file,),
        scalar=scalar,
        array=array,
        formats=formats,
        bound=_formula(name),
        slack=8,
        floor=0,
        proven={form.name: proven_of_speed(name, form, speeds.v_star_max) for form in formats},
    )
    if tier != WITH_PAIRS:
        return [main]
    arrays = replace(main, scalar="", measures=ARRAY)
    pair, each = (f"viscopade_restitution_{how}_{name}" for how in ("by_pair", "each"))
    return [
        main,
        replace(arrays, id=f"{main.id}-gather", label=f"{label}, rows by gather instructions", before=_GATHER),
        replace(arrays, id=f"{main.id}-loads", label=f"{label}, rows by single loads", before=_LOADS),
        replace(arrays, id=f"{main.id}-by-pair", label=f"{label}, beta of {PAIRS} pairs", array=pair, beta="pair"),
        replace(arrays, id=f"{main.id}-each", label=f"{label}, beta of each", array=each, beta="each"),
    ]


def _by_root(kind: str, name: str, file: str, text: str) -> Contender:
    """Return a kernel of v*, for which pow makes v*."""
    scalar = f"viscopade_restitution_{name}"
    formats = _formats(text, scalar)
    error = named(name)
    return Contender(
        f"{kind}-{error}",
        f"pow + {kind} kernel, {error}",
        "ours",
        _eps,
        headers=(file,),
        scalar=scalar,
        formats=formats,
        bound=_formula(name),
        slack=300,
        proven={form.name: proven_of_v_star(name, form) for form in formats},
        proven_of="v_star",
        note="proven of eps(v*); what pow adds is not in it" + (", for v* <= 5" if kind == "minimax" else ""),
    )


def _full() -> Contender:
    """Return the kernel of full accuracy of v*."""
    source = render("full.c.jinja", formats=tuple(FORMATS.values()))
    return Contender(
        "full",
        "pow + full kernel",
        "ours",
        _eps,
        source,
        headers=(_FULL,),
        scalar="ours_full",
        takes_root=True,
        slack=16,
        floor=0,
        proven={form.name: f"{proven.of('full', form.name).text('ulps of epsilon')} ulp" for form in FORMATS.values()},
        proven_of="v_star",
        note="proven of eps(v*); what pow adds is not in it",
    )


# --- what is proven ---------------------------------------------------------------------------------------------------


def named(name: str) -> str:
    """Return the error in a kernel's name: ..._6p7em6 is 6.7e-6."""
    match = re.search(r"_([0-9]+)(?:p([0-9]+))?em([0-9]+)$", name)
    if match is None:
        return name
    return f"{match[1]}{'.' + match[2] if match[2] else ''}e-{match[3]}"


def _formula(name: str) -> float:
    """Return the largest error of a kernel's formula in any type, or 0 if it is known in ulp only."""
    double = proven.of(name, DOUBLE.name)
    names = [name, *([double.text("elsewhere")] if double.has("elsewhere") else [])]
    found = [proven.of(each, form) for each in names for form in FORMATS]
    return max((each.number("formula") for each in found if each.has("formula")), default=0.0)


def proven_of_v_star(name: str, form: Format) -> str:
    """Return the proven error of a kernel of v*, rounding included, relative to the smaller of eps and 1 - eps."""
    found = proven.of(name, form.name)
    return _sum(found.text("formula"), found.text("rounding of epsilon"))


def proven_of_speed(name: str, form: Format, v_star_max: float) -> str:
    """Return the proven error of a kernel from speed to eps, rounding included, or "" beyond its table.

    The first number is relative to the smaller of eps and 1 - eps, an ulp is that of eps.
    """
    double, found = proven.of(name, DOUBLE.name), proven.of(name, form.name)
    if double.has("ulps"):
        ulps = Decimal(double.text("ulps")) + Decimal(double.text("ulps of w"))
        return f"{ulps} ulp" if found else _ROUNDED_TO_FLOAT
    if v_star_max >= double.number("high"):
        return ""
    own = found or double
    return f"{_sum(own.text('formula'), own.text('rounding'))} + {'0.5 ulp' if found else _ROUNDED_TO_FLOAT}"


def _sum(a: str, b: str) -> str:
    """Return the sum, rounded up to three digits."""
    return f"{Context(prec=3, rounding=ROUND_CEILING).add(Decimal(a), Decimal(b)):.2e}"
