"""Functions of the speed by kernels of v* = sqrt(beta) pow(speed, 0.1), and what the rounding of v* does to eps."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from typing import NamedTuple

from viscopade.arithmetic.balls import ball_of, magnitude, working
from viscopade.collision import panel_proof
from viscopade.kernels import formulas
from viscopade.kernels.arithmetic import HOST, Arithmetic
from viscopade.kernels.bound import INFINITY, ErrorBound
from viscopade.kernels.expressions import CodeBranch, Statement
from viscopade.kernels.formulas import W_ACCEPTED
from viscopade.kernels.kernel import Function
from viscopade.kernels.rounding_bounds import BITS, powers_error
from viscopade.store import recorded

USUAL = Fraction(10) ** 30
"""Speeds from 1/USUAL to USUAL, in any unit, have a bound of their own. pow(speed, 0.1) has an exponent that is no
binary number, which costs |ln speed| times its error; for double's extreme speeds that is three times as much."""


@recorded("rounding of v_star")
def eps_error_from_v_star(machine: Arithmetic = HOST, largest: Fraction | None = None) -> Fraction:
    """Return a bound of the relative errors of eps and 1 - eps by the rounding of v*.

    Parameters
    ----------
    machine : Arithmetic
        What is assumed of sqrt, pow and products.
    largest : Fraction or None
        The bound holds for 1/largest <= speed <= largest; None for every positive speed of the type.
    """
    # Rows are polynomials on panels of v*, proven to be near eps and 1 - eps; `steepest` bounds |d ln row/d ln v*|.
    # The margin of 2^-20 covers what is of second order: the change times the rows' errors of 2^-60.
    slope = panel_proof.steepest() * (1 + Fraction(1, 2**20))
    with working(BITS):
        # v* = sqrt(beta) pow(speed, 0.1) as computed, for exact speed and beta; |d ln v*| <= -ln(1 - relative).
        log = None if largest is None else ball_of(largest).log()
        relative = powers_error(formulas.v_star_branch(), "v_star", machine, {"speed": 0, "beta": 0}, log)
        ln_v_star_error = magnitude((1 - relative).log())
        change = magnitude(ball_of(ln_v_star_error * slope).exp() - 1)
    # A row's error counts at the exact and at the computed v*. If v* is rounded into the next panel, the rows of both
    # panels count at their border, too: 2 + 2.
    return change + 4 * Fraction(panel_proof.proven_error())


def restitution_function(branches: tuple[CodeBranch, ...], result: str = "epsilon") -> Function:
    """Return eps as a function of the speed and beta, given its branches in v*; 0 times infinity gives NaN.

    `branches` are the programs of eps for parts of v*, with guards, and `result` is the name of eps in them.
    """
    v_star = Statement("v_star", formulas.v_star_branch().results["v_star"])
    return Function("restitution", ("speed", "beta"), "eps", W_ACCEPTED, (v_star,), branches, result)


class JustBeyond(NamedTuple):
    """What holds of a formula R on V <= v* <= V (1 + change), just beyond the end of a bound."""

    steepness: Fraction
    """|dR/d ln v*| over the largest slope that the true function may have (`STEEPEST`); at least 1."""
    last: Fraction
    """The part `last` of the bound, for these v* as well."""


def speed_bounds(bound: ErrorBound, beyond: JustBeyond | None = None) -> Iterator[ErrorBound]:
    """Yield the bounds of eps from the speed, given the bound of eps from v*, as v* is rounded.

    There is one for the `USUAL` speeds and one for all. A computed v* may be beyond an end V, and v* not. With what
    holds there the bound is one up to V. From v* to V the true function changes, from V to the computed v* the formula;
    both changes together are at most `steepness` times as large as the true function's change. Without `beyond` the
    bound ends just before V, as at the end of a function's domain.
    """
    machine = bound.arithmetic
    for usual, largest in (((1 / USUAL, USUAL), USUAL), (None, None)):
        # Of eps or 1 - eps, relative to the smaller one; larger than the relative error of v*, as slopes reach 10/3.
        change = eps_error_from_v_star(machine, largest)
        # From v* = low (1 + change) on the computed v*, which is off by less than a third of change, is above low.
        low, high, last = bound.low * (1 + change), bound.high, bound.last
        if beyond is not None:
            change, last = change * beyond.steepness, beyond.last
        elif high != INFINITY:
            high = Fraction(high) / (1 + change)
        # The formula's error and the last rounding are relative to eps at the computed v*: a factor 1 + change.
        yield replace(
            bound, result="restitution", low=low, high=high, rounding=bound.rounding + change * (1 + bound.relative),
            last=last * (1 + change), speeds=usual,
        )  # fmt: skip
