"""Exact eps and 1 - eps, with proofs: 17 digits at any finite speed, and 22 digits on the panels, in microseconds.

Functions return balls that enclose the exact values; their arguments are fractions, taken exactly. They are to be
called within `balls.working(BITS)`. Three proofs serve three ranges: the first term of the series below
`panel_proof.ELASTIC`, the panels (`panel_proof.proven_error`), and the limit for large v* (`panel_proof.tail`).
"""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache

from flint import arb

from viscopade.arithmetic.balls import ball_of
from viscopade.arrays import panels
from viscopade.collision import exact, panel_proof
from viscopade.collision.exact_table import Portions

BITS = 256
SHARP_DIGITS = 22
SHARP = Fraction(1, 10**1000), Fraction(10) ** 100
"""The w for which `exact` is asked for more digits."""


@lru_cache(maxsize=4096)
def portions_of_w(w: Fraction) -> Portions:
    """Return eps and 1 - eps at w = v*^10 > 0."""
    return portions(ball_of(w).root(10))


def portions(v_star: arb) -> Portions:
    """Return eps and 1 - eps at a narrow ball of v* > 0."""
    if v_star < ball_of(panel_proof.ELASTIC):
        loss = panel_proof.lambda_1_ball() * v_star**2 * (1 + arb(0, 8 * v_star**2))
        return Portions(1 - loss, loss)
    if not v_star < ball_of(panel_proof.END):
        epsilon = panel_proof.asymptotic_factor() / v_star**3 / v_star.root(3) * arb(0, panel_proof.tail(v_star)).exp()
        return Portions(epsilon, 1 - epsilon)
    panel, _ = panels.index_of(float(v_star))
    z = (v_star - arb(float(panels.CENTRES[panel]))) / arb(float(panels.HALF_WIDTHS[panel]))
    # The bound is twice what is proven of the panel; so it also covers a z that is beyond its end by an error of v*.
    error = 1 + arb(0, panel_proof.proven_error())
    return Portions(*(panel_proof.panel_rows()[name, panel].poly()(z) * error for name in panels.NAMES[:2]))


def sharp_portions(w: Fraction) -> Portions:
    """Return the same to `SHARP_DIGITS` digits."""
    if not SHARP[0] <= w <= SHARP[1]:
        return portions_of_w(w)
    found = exact.collision(beta=1, speed=w, digits=SHARP_DIGITS)
    return Portions(found.epsilon, found.one_minus_epsilon)


@lru_cache(maxsize=256)
def exact_v_star(epsilon: Fraction) -> arb:
    """Return v*(eps), 0 < eps < 1."""
    loss = ball_of(1 - epsilon)
    near = (loss / panel_proof.lambda_1_ball()).sqrt()
    if 2 * near < ball_of(panel_proof.ELASTIC):
        return near * (1 + arb(0, 8 * near**2))
    far = (panel_proof.asymptotic_factor() / ball_of(epsilon)).log() * 3 / 10
    if far > ball_of(2 * panel_proof.END).log():
        return (far + arb(0, panel_proof.tail(ball_of(panel_proof.END)))).exp()
    return exact.invert(epsilon=epsilon, digits=SHARP_DIGITS).v_star
