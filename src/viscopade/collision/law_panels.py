r"""Panels of any law of contact: eps and v* as functions of one parameter z, for a whole interval at once, proven.

On a panel k = u^d with u linear in z, and `parametric_flow` encloses F, P and the work W for all z: with them

    v*^d = kappa = (2 m)^(1/nu-1) k F^(2/nu-1),    eps = P/F,
    (1 - eps)/kappa = (k^(n_b/d) P^(n_a/d)/n_a + W)/((2 m)^(1/nu-1) F^(2/nu+1) (1 + eps)),

the first term for delayed recovery only (section 2.9 and docs/theory/exact-function.md, step 12). Eps knows only nu, so
n_a, n_b and d are those of nu in lowest terms, and m = n_b/(b + 1), a fraction. The first panel begins at u = 0, with
0 <= z <= 1: nothing is singular there.

`arrays.panels` is the same for the paper's law, as a table of polynomials in v*.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import lru_cache
from math import exp, log, log2
from typing import NamedTuple

from flint import arb, arb_poly, arb_series, fmpz_poly

from viscopade.arithmetic.balls import ball_of, rational_power, working
from viscopade.collision import exact
from viscopade.collision.flow import Motion
from viscopade.collision.parametric_flow import (
    ParametricBranch,
    ParametricEnds,
    Scaled,
    integrated,
    parametric_ends,
    parametric_work,
)
from viscopade.progress import track
from viscopade.theory.law import Law

ACCURACY, DEGREE, GAP = 64, 30, 46
BITS = 128
WANTED = 2.0**-36
"""Largest error of a panel; a panel that is worse is halved."""
SMALL = 0.4  # u up to which panels may be long, as singularities in u are of order 1
HALF = 0.25  # of other panels in k, relative to their middle
BITS_OF_U = 30
SHORTEST = 2.0**-12  # panel, relative to u


_FIRST = {1: 0.4, 2: 0.1}  # end of the panel at the origin, by d
_LEAST = 2.0**-20  # for larger d


class Course(NamedTuple):
    """v*, eps and (1 - eps)/v*^d as series, whose coefficients hold for every true collision on the panel.

    v* = root stem^power: stem is y on the panel at the origin, and 1 on all others.
    """

    v_star: arb_series
    epsilon: arb_series
    loss_ratio: arb_series
    root: arb_series
    stem: arb_series


class LawPanel(NamedTuple):
    """A panel: k(z), and what is proven of both branches. With `origin`, z runs from 0, else from -1, to 1."""

    law: Law
    origin: bool
    k: Scaled
    loading: ParametricEnds
    unloading: ParametricEnds
    work: tuple[tuple[arb_poly, arb_poly], ...]
    """For each branch twice the work times the scale of time, and twice the scale; none where eps is below 1/2."""

    @property
    def start(self) -> Fraction:
        """The least z."""
        return Fraction(0 if self.origin else -1)

    @property
    def error(self) -> arb:
        """Bound the relative error of the approximate P/F, as its logarithm."""
        return -(1 - self.loading.error - self.unloading.error).log()

    def course(self, y: arb_series, power: int = 1, true: bool = True) -> Course:
        """Return the course at z = y^power on the panel at the origin, at z = y on others. To be called in `working`.

        If not `true`, it is the approximate one.
        """
        z, stem = (y**power, y) if self.origin else (y, y * 0 + 1)
        law, order = self.law, self.law.d if self.origin else 0
        f, p = (
            _at(e.slope, z) / _at(e.step, z) * (arb(1, e.error) if true else 1) for e in (self.loading, self.unloading)
        )
        reduced = _at(arb_poly(self.k.poly().coeffs()[order:]), z)  # k/z^order
        epsilon = p / f
        scale = rational_power(2 * ball_of(law.n_b / (law.damping + 1)), 1 / law.nu - 1)
        root = power_of_series(reduced * scale * power_of_series(f, 2 * law.c), Fraction(1, law.d))
        v_star = root * (z if self.origin else 1)
        if not self.work:
            return Course(v_star, epsilon, (1 - epsilon) / v_star**law.d, root, stem)
        lost = sum((_at(top, z) / _at(bottom, z) for top, bottom in self.work), z * 0)
        if law.delayed:
            inner = (
                power_of_series(reduced, Fraction(law.n_b, law.d))
                * power_of_series(p, Fraction(law.n_a, law.d))
                / law.n_a
            )
            lost = lost + inner * (z**law.n_b if self.origin else 1)
        loss_ratio = lost / (scale * power_of_series(f, 2 * law.c + 2) * (1 + epsilon))
        return Course(v_star, epsilon, loss_ratio, root, stem)


def _at(polynomial: arb_poly, z: arb_series) -> arb_series:
    return series_at(polynomial.coeffs(), z)


def series_at(coefficients: Sequence[arb], z: arb_series) -> arb_series:
    """Return the polynomial with ascending coefficients at z."""
    total = z * 0
    for c in reversed(coefficients):
        total = total * z + c
    return total


def power_of_series(series: arb_series, exponent: Fraction) -> arb_series:
    """Return a power of a series with a positive constant term."""
    if exponent.denominator == 1:
        return series ** int(exponent)
    return (series.log() * ball_of(exponent)).exp()


@lru_cache(maxsize=8)
def law_panels(law: Law, high: Fraction) -> tuple[LawPanel, ...]:
    """Return proven panels that cover 0 <= v* <= high.

    Raises
    ------
    ValueError
        If contact ends against an attractive force, or no panel at the origin is proven, however short.
    ArithmeticError
        If other panels become too short.
    """
    if law.nu > 1 and not law.delayed:
        raise ValueError(f"the end is {law.end!r}: accepted for proofs on an interval, for the law {law} is 'force'")
    ends = _layout(law, _u_beyond(law, high))
    found = list[LawPanel]()
    for i in track(range(len(ends) - 1), f"proof of the law {law}"):
        waiting = [(ends[i], ends[i + 1])]
        while waiting:
            left, right = waiting.pop()
            try:
                found.append(panel(law, left, right))
            except ArithmeticError as error:
                if right - left < max(SHORTEST * right, SHORTEST**2):
                    if left:
                        raise
                    raise ValueError(
                        f"the law is {law}: accepted for proofs on an interval is for instance nu <= 2, as for "
                        f"nu = {law.nu} none was found at v* = 0 ({error})"
                    ) from None
                middle = _dyadic(float((left + right) / 2 if left else right / 4))  # exact ends: no gap between panels
                waiting += [(middle, right), (left, middle)]
    with working(BITS, 1):
        if not found[-1].course(arb_series([arb(1)])).v_star.coeffs()[0] > ball_of(high):
            raise ArithmeticError("the panels end too early")
    return tuple(found)


def _u_beyond(law: Law, v_star: Fraction) -> Fraction:
    """Return u at a v* that is larger by a little."""
    reduced = Fraction(law.n_a, Motion.of(law).n_a)  # k is proportional to sqrt(n_a)
    u = exp((exact.log_k(v_star**law.d, law) + log(reduced) / 2) / law.d)
    return _dyadic(u * (1 + 1e-8)) + Fraction(1, 2**BITS_OF_U)


def limit(law: Law, v_star: arb) -> arb:
    """Enclose eps kappa^nu (b+1)^(1-nu), whose limit is 1, for all v* from `v_star` on (docs/theory/exact-function.md).

    To be called within `working`.

    Raises
    ------
    ValueError
        If eps does not go like kappa^-nu, or v* is so small that nothing is known.
    """
    if not (law.delayed or law.nu == 1):
        raise ValueError(f"the law is {law} with end {law.end!r}: accepted is nu > 1 with end 'force', or nu = 1")
    a = rational_power(v_star**law.d, law.nu) / rational_power(ball_of(law.damping + 1), law.nu - 1)
    if not a > 40:
        raise ValueError(f"v* is {v_star}: accepted is kappa^nu > 40 (b+1)^(nu-1)")
    theta = (1 + a).log() / a
    delta = 1 - theta if law.nu == 1 else a.log() / a
    least = rational_power(1 - theta - delta, law.nu - 1) if law.nu > 1 else arb(1)
    least = (least * (1 - (-delta * a).exp())).lower()
    return arb((1 + least) / 2, ((1 - least) / 2).abs_upper())


def _layout(law: Law, end: Fraction) -> list[Fraction]:
    """Return the ends of panels in u."""
    ends = [Fraction(0), min(end, _dyadic(_FIRST.get(law.d, _LEAST)))]
    while ends[-1] < end:
        # Where u is small, k = u^d must be seen to be positive.
        half = HALF / law.d if ends[-1] >= SMALL else 0.95 * (2 ** (1 / law.d) - 1)
        longest = float(ends[-1]) * (1 + half) / (1 - half)
        ends.append(min(end, _dyadic(longest if ends[-1] >= SMALL else min(longest, SMALL))))
    return ends


def _dyadic(value: float) -> Fraction:
    return Fraction(round(value * 2**BITS_OF_U), 2**BITS_OF_U)


def panel(law: Law, left: Fraction, right: Fraction) -> LawPanel:
    """Integrate and prove the panel left <= u <= right.

    Raises
    ------
    ArithmeticError
        If the errors are not small.
    """
    motion, origin = Motion(law.n_a, law.n_b, 1, law.delayed), left == 0
    unit = 2 ** (BITS_OF_U + 1)
    u = fmpz_poly(
        [0, int(right * unit)] if origin else [int((left + right) * unit) // 2, int((right - left) * unit) // 2]
    )
    k = Scaled(u**law.d, -(BITS_OF_U + 1) * law.d)
    # Where a branch is left, the force is about d (k p)^(1-1/d) 2^-GAP, but at the origin only 2^(-GAP d).
    more = GAP * law.d if origin else (law.d - 1) * max(0.0, -log2(float(left)))
    accuracy = ACCURACY + (round(more) if law.delayed else 0)
    branches = [integrated(k, unloading, accuracy, DEGREE, GAP, motion) for unloading in (False, True)]
    loading, unloading = (parametric_ends(branch, origin) for branch in branches)
    if not max(loading.error, unloading.error) < WANTED:
        raise ArithmeticError("the errors are not small")
    found = LawPanel(law, origin, k, loading, unloading, ())
    with working(BITS, 1):  # eps falls: it is largest where the panel begins
        inelastic = not origin and found.course(arb_series([ball_of(found.start)])).epsilon.coeffs()[0] < arb(1) / 2
    if inelastic:
        return found
    works = tuple(_work(branch, of) for branch, of in zip(branches, (loading, unloading), strict=True))
    return found._replace(work=works)


def _work(branch: ParametricBranch, of: ParametricEnds) -> tuple[arb_poly, arb_poly]:
    total = parametric_work(branch, of)
    with working(branch.bits + 64):
        first, size = total[0], abs(total[0].mid())
        if not abs(first - first.mid()) < size * WANTED:
            raise ArithmeticError("the work of the contact force is enclosed too widely")
        return total, branch.scale.poly() * 2
