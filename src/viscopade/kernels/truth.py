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
"""Bits of the middles of balls. Panels are proven to 60 bits, and 22 digits are 73; chosen by hand well above both."""
SHARP_DIGITS = 22
"""Five more than the 17 that tell doubles apart: which double is nearest stays unknown for one value in 10^5."""
SHARP = Fraction(1, 10**1000), Fraction(10) ** 100
"""The w for which `exact` is asked for more digits. Beyond, v* < 1e-100 or v* > 1e10, and the formulas of the two ends
are right to 1e-199 (8 v*^2) and 1e-31 (`panel_proof.tail`)."""


@lru_cache(maxsize=4096)  # the functions of a kernel are compared at the same hundreds of w, one after the other
def portions_of_w(w: Fraction) -> Portions:
    """Return balls of eps and 1 - eps, fields `epsilon` and `loss`, at w = v*^10 > 0."""
    return exact_portions(ball_of(w).root(10))


def exact_portions(v_star: arb) -> Portions:
    """Return eps and 1 - eps at a narrow ball of v* > 0."""
    if v_star < ball_of(panel_proof.ELASTIC):
        # 1 - eps = lambda_1 v*^2 (1 ± 8 v*^2) for v*^2 <= 2^-20 (docs/theory/exact-function.md, step 8), and ELASTIC is
        # 2^-36.
        loss = panel_proof.lambda_1_ball() * v_star**2 * (1 + arb(0, 8 * v_star**2))
        return Portions(1 - loss, loss)
    if not v_star < ball_of(panel_proof.END):
        # eps = (3/2)^(2/3) v*^(-10/3) up to a factor e^(±tail), same step; v*^(10/3) = v*^3 v*^(1/3).
        epsilon = panel_proof.asymptotic_factor() / v_star**3 / v_star.root(3) * arb(0, panel_proof.tail(v_star)).exp()
        return Portions(epsilon, 1 - epsilon)
    # On a panel both (NAMES[:2]: "epsilon", "one_minus_epsilon") are polynomials in z = (v* - centre)/(half width).
    panel, _ = panels.index_of(float(v_star))
    z = (v_star - arb(float(panels.CENTRES[panel]))) / arb(float(panels.HALF_WIDTHS[panel]))
    # The bound is twice what is proven of the panel; so it also covers a z that is beyond its end by an error of v*.
    error = 1 + arb(0, panel_proof.proven_error())
    return Portions(*(panel_proof.panel_rows()[name, panel].poly()(z) * error for name in panels.NAMES[:2]))


def sharp_portions(w: Fraction) -> Portions:
    """Return eps and 1 - eps at w = v*^10 > 0 to `SHARP_DIGITS` digits."""
    if not SHARP[0] <= w <= SHARP[1]:
        return portions_of_w(w)
    # v* = beta^(1/2) speed^(1/10), so that a speed of w with beta = 1 has v*^10 = w.
    collision = exact.collision(beta=1, speed=w, digits=SHARP_DIGITS)
    return Portions(collision.epsilon, collision.one_minus_epsilon)


@lru_cache(maxsize=256)  # v* and beta of the inverse kernels are compared at the same eps
def exact_v_star(epsilon: Fraction) -> arb:
    """Return a ball of the v* at which eps is `epsilon`, 0 < epsilon < 1."""
    loss = ball_of(1 - epsilon)
    # 1 - eps = lambda_1 v*^2 (1 ± 8 v*^2): v* = near (1 ± 8 v*^2)^(-1/2), which is within near (1 ± 8 near^2). With
    # twice `near` below ELASTIC v* surely is.
    near = (loss / panel_proof.lambda_1_ball()).sqrt()
    if 2 * near < ball_of(panel_proof.ELASTIC):
        return near * (1 + arb(0, 8 * near**2))
    # ln v* = 3/10 (ln((3/2)^(2/3)/eps) ± tail), so that a whole tail is more than enough. The factor 2 puts v* surely
    # beyond END, where `tail` holds.
    far = (panel_proof.asymptotic_factor() / ball_of(epsilon)).log() * 3 / 10
    if far > ball_of(2 * panel_proof.END).log():
        return (far + arb(0, panel_proof.tail(ball_of(panel_proof.END)))).exp()
    return exact.invert(epsilon=epsilon, digits=SHARP_DIGITS).v_star
