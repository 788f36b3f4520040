"""Rounding error of v* = sqrt(beta) pow(speed, 0.1) in functions of the speed, and its effect on eps."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from viscopade.arithmetic.balls import ball_of, exact_middle, working
from viscopade.arithmetic.decimals import at_most
from viscopade.arithmetic.formats import Format
from viscopade.collision import panel_proof
from viscopade.kernels import formulas
from viscopade.kernels.arithmetic import HOST, HOSTS, Arithmetic
from viscopade.kernels.rounding_bounds import BITS, ULPS, of_powers
from viscopade.store import recorded

_DECADES = 30
USUAL = Fraction(10) ** _DECADES
"""Speeds from 1/USUAL to USUAL have a bound of their own: 0.1 is no binary number, which costs more beyond."""
USUAL_TEXT = f"1e-{_DECADES} <= speed <= 1e{_DECADES}"


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


def stated(forms: Sequence[Format]) -> str:
    """Return the sentences that state `of_v_star` in a file whose functions `restitution` are of these types."""
    usual, every = (
        " and ".join(f"{at_most(of_v_star(HOSTS[form.name], largest), 2)} in type {form.name}" for form in forms)
        for largest in (USUAL, None)
    )
    return (
        "speed: restitution computes v* = sqrt(beta) pow(speed, 0.1), and the rounding of v* changes eps, relative to "
        f"min(eps, 1 - eps), by at most {usual} for {USUAL_TEXT}, and by at most {every} for every other speed "
        "(proven). That adds to the error and to the rounding of eps at the v* computed."
    )


def assumed(roots: str) -> str:
    """Return the assumptions on the functions of math.h that a file calls."""
    return (
        f"assumed: sqrt rounds correctly; the results of {roots}, in type float as well, are within {ULPS} units in "
        "the last place (the largest errors known of glibc's are not larger)"
    )
