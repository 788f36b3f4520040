r"""Proof of a bound of |N/D - eps| for any law of contact, for every v* from 0 to an end.

`law_panels` encloses eps and v* as functions of one parameter. Each panel is cut into equal parts; on a part the
deviation is a Taylor polynomial in -1 <= t <= 1 whose last coefficient is enclosed for the whole part, so that the sum
of the absolute values is a bound, as in `certificate`. Parts are halved until that does not help any more.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from flint import arb, arb_series

from viscopade import arguments
from viscopade.arithmetic.balls import ball_of, working
from viscopade.arithmetic.decimals import rounded_up
from viscopade.collision.exact import Exact
from viscopade.collision.law_panels import Course, LawPanel, law_panels, series_at
from viscopade.theory.law import Law

LARGEST, SMALLEST = 100, Fraction(1, 10**3)  # v*
BITS, ORDER = 160, 12
FEWEST_PARTS, MOST_PARTS = 4, 1 << 10
TIGHT = 0.99  # a bound that halving the parts lowers by less than this factor is tight


def error_up_to(a: Sequence[arb], b: Sequence[arb], law: Law, v_star_max: Exact) -> str:
    """Return a bound of |N/D - eps|/min(eps, 1 - eps) for 0 <= v* <= v_star_max, as a decimal string.

    Parameters
    ----------
    a, b : sequence of flint.arb
        Coefficients of N and D, ascending in v* = kappa^(1/law.d); a_i = b_i for i < law.d.
    law : Law
        With no attractive force.
    v_star_max : str, int, float, Fraction, Decimal, mpmath.mpf or NumPy scalar
        From 1e-3 to 100.

    Raises
    ------
    TypeError, ValueError
        If v_star_max is no such number, the force of the law is attractive, or nothing was proven up to there, as
        for an N/D with a pole.
    """
    accepted = f"a number from {float(SMALLEST):g} to {LARGEST}"
    high = arguments.exact_number("v_star_max", v_star_max, accepted, lambda v: SMALLEST <= v <= LARGEST)
    try:
        panels = law_panels(law, high)
    except ArithmeticError:
        raise ValueError(
            f"v_star_max is {v_star_max}: nothing was proven so far out for the law {law}; accepted is a smaller number"
        ) from None
    with working(BITS, ORDER + 1):
        bounds = [_bound(a, b, law, panel, FEWEST_PARTS) for panel in panels]
        number = [FEWEST_PARTS] * len(panels)
        while True:
            worst = max(range(len(panels)), key=lambda i: float(bounds[i]))
            finer = _bound(a, b, law, panels[worst], 2 * number[worst])
            if finer > bounds[worst] * TIGHT and finer.is_finite():
                return max((rounded_up(bound) for bound in bounds), key=Fraction)
            if number[worst] >= MOST_PARTS:
                near = panels[worst].course(arb_series([arb(0)])).v_star.coeffs()[0]
                raise ValueError(
                    f"no bound was found near v* = {float(near):.3g}: accepted is a smaller v_star_max, before a pole"
                )
            bounds[worst], number[worst] = finer, 2 * number[worst]


def _bound(a: Sequence[arb], b: Sequence[arb], law: Law, panel: LawPanel, number: int) -> arb:
    """Bound the deviation on a panel cut into parts; infinity if FLINT finds that it may be infinite."""
    half = (1 - panel.start) / (2 * number)
    centres = (panel.start + (2 * i + 1) * half for i in range(number))
    try:
        bounds = [_on_part(a, b, law, panel, ball_of(centre), ball_of(half)) for centre in centres]
    except (ZeroDivisionError, ValueError):
        return arb.pos_inf()
    return max(bounds) if all(bound.is_finite() for bound in bounds) else arb.pos_inf()


def _on_part(a: Sequence[arb], b: Sequence[arb], law: Law, panel: LawPanel, centre: arb, half: arb) -> arb:
    """Bound the deviation for |z - centre| <= half, relative to the smaller of eps and 1 - eps."""
    middle, whole = (
        _deviations(a, b, law, panel.course(arb_series([start, half]))) for start in (centre, arb(centre, half.upper()))
    )
    bound = arb(0)
    for at_centre, everywhere in zip(middle, whole, strict=True):
        if min(at_centre.prec, everywhere.prec) <= ORDER:
            raise TypeError("a series loses coefficients")
        terms = [*at_centre.coeffs()[:ORDER], *everywhere.coeffs()[ORDER:]]
        bound = bound.max(sum((abs(c) for c in terms), arb(0)).abs_upper())
    return bound


def _deviations(a: Sequence[arb], b: Sequence[arb], law: Law, course: Course) -> tuple[arb_series, arb_series]:
    """Return (N/D)/eps - 1 and (1 - N/D)/(1 - eps) - 1: 1 - N/D = v*^d S/D."""
    top, bottom = series_at(a, course.v_star), series_at(b, course.v_star)
    size = max(len(a), len(b))
    s = [(b[i] if i < len(b) else arb(0)) - (a[i] if i < len(a) else arb(0)) for i in range(law.d, size)]
    return top / (bottom * course.epsilon) - 1, series_at(s, course.v_star) / (bottom * course.loss_ratio) - 1
