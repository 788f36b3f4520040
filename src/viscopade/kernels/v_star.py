"""Rounding error of v* = sqrt(beta) pow(speed, 0.1) in functions of the speed, and its effect on eps."""

from __future__ import annotations

from fractions import Fraction

from viscopade.arithmetic.balls import ball_of, exact_middle, working
from viscopade.collision import panel_proof
from viscopade.kernels import formulas
from viscopade.kernels.arithmetic import HOST, Arithmetic
from viscopade.kernels.rounding_bounds import BITS, of_powers
from viscopade.store import recorded

USUAL = Fraction(10) ** 30
"""Speeds from 1/USUAL to USUAL have a bound of their own: 0.1 is no binary number, which costs more beyond."""


@recorded("rounding of v_star")
def of_v_star(machine: Arithmetic = HOST, largest: Fraction | None = None) -> Fraction:
    """Return a bound of the relative errors of eps and 1 - eps by the rounding of v*.

    Parameters
    ----------
    machine : Arithmetic
    largest : Fraction or None
        The bound holds for 1/largest <= speed <= largest; None for every positive speed of the type.
    """
    # The slope of the rows is that of eps but for their errors.
    slope = panel_proof.steepest() * (1 + Fraction(1, 2**20))
    with working(BITS):
        log = None if largest is None else ball_of(largest).log()
        relative = of_powers(formulas.v_star_branch(), "v_star", machine, {"speed": 0, "beta": 0}, log)
        of_ln_v_star = exact_middle((-(1 - relative).log()).abs_upper())
        change = exact_middle((ball_of(of_ln_v_star * slope).exp() - 1).abs_upper())
    return change + 4 * Fraction(panel_proof.proven_error())
