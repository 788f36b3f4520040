"""Proven errors of the exported kernels as numbers: headers say the same in words.

The quantities of a kernel in a type:

    formula                     largest error of the formula, relative to the smaller of eps and 1 - eps (of v*, for an
                                inverse), up to each `end` in v* if there is one; of a table, in the table
    rounding of FUNCTION        what rounding adds, relative to the function
    underflow                   what is added where results are subnormal, in the type's smallest numbers
    ulps of FUNCTION            largest error, in units in the last place: all of it

and of one from speed to eps, which has a table over w = beta^5 speed = v*^10:

    low, high                   the v* of the table
    elsewhere                   the kernel that serves other speeds
    rounding                    what rounding adds to eps, relative to the smaller of eps and 1 - eps; half a unit in
                                the last place comes on top
    of v*                       what the rounding of v* does to eps elsewhere, relative to the smaller of the two
    ulps, ulps of w             largest error of eps(w), and what the rounding of w adds
    ulps elsewhere              largest error beyond the table: all of it
    relative, relative of w     the same of dissipation and rebound in the table, relatively

A type without quantities of its own is computed in type double, and then rounded.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple

from viscopade.arithmetic.decimals import at_most, below
from viscopade.arithmetic.formats import DOUBLE, FORMATS
from viscopade.kernels import requests
from viscopade.kernels.forms import last_place
from viscopade.kernels.forms.lacunary_kernels import HalfLineKernel, InverseKernel
from viscopade.kernels.forms.minimax import MinimaxKernel
from viscopade.kernels.forms.quotient import PadeKernel, Quotient
from viscopade.kernels.forms.speed_kernel import SpeedKernel
from viscopade.kernels.forms.speed_table import OCTAVES, of_w
from viscopade.kernels.forms.speed_table_last_place import LastPlaceTable, ulp_of_w
from viscopade.kernels.names import FAST, TIERS
from viscopade.kernels.prove_lacunary import speed_kernel
from viscopade.kernels.targets.speed import ulps_elsewhere
from viscopade.kernels.v_star import of_v_star

_UNIT = Fraction(1, 1 << DOUBLE.precision)


class ProvenNumber(NamedTuple):
    """A quantity of a kernel in a type, perhaps up to an end in v*."""

    kernel: str
    format: str
    quantity: str
    end: str
    value: str


@lru_cache(maxsize=1)
def numbers() -> tuple[ProvenNumber, ...]:
    """Return the proven numbers of all exported kernels."""
    return tuple(_numbers())


def _numbers() -> Iterator[ProvenNumber]:
    for quotient in [*requests.PAPER.quotients(), *requests.RECOMMENDED.quotients()]:
        yield from _of_quotient(quotient)
    for request in (requests.HALF_LINE, requests.INVERSE):
        for kernel in request.in_powers_of_a_root():
            yield from _in_powers_of_a_root(kernel)
    yield from _of_full()
    for tier in TIERS:
        yield from _of_speed(speed_kernel(tier, FAST))


def _of_quotient(kernel: Quotient) -> Iterator[ProvenNumber]:
    if isinstance(kernel, PadeKernel):
        for form, rounding in kernel.rounding:
            for bound in kernel.bounds:
                yield ProvenNumber(kernel.name, form, "formula", below(bound.high or Fraction(0)), bound.bound)
            yield ProvenNumber(kernel.name, form, "rounding of epsilon", "", rounding)
    if isinstance(kernel, MinimaxKernel):
        for variant in kernel.variants:
            form, proof = variant.form.name, variant.certificate
            yield ProvenNumber(kernel.name, form, "formula", below(proof.high or Fraction(0)), proof.bound)
            yield ProvenNumber(kernel.name, form, "rounding of epsilon", "", variant.rounding)


def _in_powers_of_a_root(kernel: HalfLineKernel | InverseKernel) -> Iterator[ProvenNumber]:
    for variant in kernel.variants:
        yield ProvenNumber(kernel.name, variant.form.name, "formula", "", variant.certificate.bound)
        for function in kernel.checked:
            yield ProvenNumber(
                kernel.name, variant.form.name, f"rounding of {function}", "", variant.rounding(function)
            )
        if isinstance(kernel, HalfLineKernel):
            underflow = max((size.underflow for _, size in variant.sizes), key=Fraction)
            yield ProvenNumber(kernel.name, variant.form.name, "underflow", "", underflow)


def _of_full() -> Iterator[ProvenNumber]:
    for form in FORMATS.values():
        for function in last_place.FUNCTIONS:
            ulps = last_place.largest_ulp(form, function)
            yield ProvenNumber("full", form.name, f"ulps of {function}", "", _shown(ulps))
    yield ProvenNumber("full", DOUBLE.name, "underflow", "", _shown(last_place.largest_subnormal(DOUBLE)))


def _shown(ulps: Fraction) -> str:
    """Return a number of units in the last place so that its distance from 1/2 is seen: two digits of that."""
    more = Fraction(at_most(ulps - Fraction(1, 2), 2))
    return below(Fraction(1, 2) + more)


def _of_speed(kernel: SpeedKernel) -> Iterator[ProvenNumber]:
    table, name = kernel.table, kernel.name
    double = DOUBLE.name
    for quantity, exponent in (("low", table.first), ("high", table.first + OCTAVES)):
        yield ProvenNumber(name, double, quantity, "", f"{2.0 ** (exponent / 10):.3g}")
    if isinstance(table, LastPlaceTable):
        bounds = table.proven
        yield ProvenNumber(name, double, "ulps", "", at_most(bounds.ulp))
        yield ProvenNumber(name, double, "ulps of w", "", at_most(ulp_of_w()))
        yield ProvenNumber(name, double, "ulps elsewhere", "", at_most(ulps_elsewhere()))
        yield ProvenNumber(name, double, "relative", "", at_most(bounds.relative + 4 * _UNIT, 2))
        yield ProvenNumber(name, double, "relative of w", "", at_most(of_w(DOUBLE), 2))
        return
    yield ProvenNumber(name, double, "elsewhere", "", "full" if kernel.slow is None else kernel.slow.name)
    yield ProvenNumber(name, double, "of v*", "", at_most(of_v_star()))
    for form in kernel.formats:
        yield ProvenNumber(name, form.name, "formula", "", at_most(table.proven.error))
        yield ProvenNumber(name, form.name, "rounding", "", at_most(table.rounding(form), 2))
