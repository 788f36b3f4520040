"""Damping from measured points: beta with its uncertainty, the verdict on the law, and the material's constants."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from viscopade.arguments import refusal
from viscopade.arrays import double
from viscopade.arrays.checked import Accepted, FloatArray, number
from viscopade.collision.spheres import Pair, Sphere, restitution_error
from viscopade.extras import require
from viscopade.fitting import weight_table
from viscopade.fitting.points import Points
from viscopade.quantity import uncertain
from viscopade.theory.law import VISCOELASTIC, Law, law_of

if TYPE_CHECKING:
    from viscopade.fitting.likelihood import LawFit
    from viscopade.fitting.verdict import ContactLaw, Verdict

_SPEEDS = Accepted("a finite number >= 0", lambda x: 0 <= x < math.inf)
LEVELS = (0.68, 0.95)
"""Confidence levels of reported intervals: about one and two standard errors of a Gaussian."""
MANY, GROUPS = 20_000, 4096
"""Largest number of points that are fitted one by one, and the least number of groups into which more are averaged.

Both were chosen by hand for the time of a fit: 6 s for 20,000 points, 0.4 s for groups. Means lose no information as
long as a law is a straight line within a group, whose width `Points.grouped` limits.
"""


@dataclass(frozen=True)
class Constant:
    """A fitted constant of the material, and its standard error."""

    value: float
    standard_error: float


@dataclass(frozen=True, eq=False)
class DampingFit:
    """Damping fitted to measured points, with the verdict on the law.

    Attributes
    ----------
    points : Points
    laws : tuple of LawFit
        The viscoelastic law first.
    verdict : Verdict
    outliers : tuple
        Labels of points far from any law, each with its distance in standard errors.
    """

    points: Points
    laws: tuple[LawFit, ...]
    verdict: Verdict
    outliers: tuple[tuple[str, float], ...]

    def __str__(self) -> str:
        """Return beta, the verdict and the number of points in one line."""
        beta = uncertain(self.beta, self.beta_standard_error)
        return f"beta: {beta} (time/length)^(1/5). {self.verdict.sentence}. {self.number.capitalize()}."

    @property
    def number(self) -> str:
        """The number of points, and of masked ones, in words."""
        counts, masked = self.points.counts, self.points.masked
        shown = f"{len(self.points)} points" if counts is None else f"{counts.sum():.0f} points in {len(counts)} groups"
        return shown + (f", {masked} masked" if masked else "")

    @property
    def main(self) -> LawFit:
        """The fit of the viscoelastic law."""
        return self.laws[0]

    @property
    def contact_law(self) -> ContactLaw:
        """The law of contact to use in `viscopade invert` and `viscopade simulators`."""
        from viscopade.fitting.verdict import contact_law

        return contact_law(self.laws, self.verdict)

    @property
    def _unit(self) -> float:
        """The ratio of beta to the fitted parameter b: kappa = b (v/v_0)^(1/5) = beta v^(1/5), so it is v_0^(-1/5)."""
        return float(self.main.middle ** float(-2 * VISCOELASTIC.c))

    @property
    def beta(self) -> float:
        """The damping beta (the paper's Eq. 8), (time/length)^(1/5)."""
        return float(self.main.parameters[0]) * self._unit

    @property
    def beta_standard_error(self) -> float:
        """Standard error of beta."""
        return self.main.standard_error() * self._unit

    def interval(self, level: float) -> tuple[float, float]:
        """Return the confidence interval of beta, from its profile likelihood."""
        low, high = self.main.interval(level)
        return low * self._unit, high * self._unit

    @cached_property
    def betas(self) -> FloatArray:
        """Damping of each point alone; if the law holds, it does not depend on the speed.

        It is 0 for a measured eps of 1 or more, and infinite for 0.
        """
        speed, epsilon = self.points.speed, np.minimum(self.points.epsilon, 1.0)
        betas, rebounds = np.full(len(speed), math.inf), epsilon > 0
        kappa = self.main.model.kappa(epsilon[rebounds], self.points.load(speed[rebounds]))
        # beta = kappa v^(-1/5), with the kappa of the point's eps, under the load of the weight
        betas[rebounds] = kappa / speed[rebounds] ** 0.2
        return betas

    def epsilon(self, speed: float) -> tuple[float, float]:
        """Return eps of the viscoelastic law at a speed, without weight, and its standard error."""
        # v* = beta^(1/2) v^(1/10); the error of eps is |d eps/d ln beta| sigma_beta/beta
        v_star = math.sqrt(self.beta) * number("speed", speed, _SPEEDS) ** 0.1
        value = float(double.epsilon(v_star))
        return value, restitution_error(v_star, self.beta_standard_error / self.beta if self.beta else 0.0)

    def dissipative_constant(self, pair: Pair) -> Constant:
        """Return A of a pair of bodies of known stiffness; A is proportional to beta, and so is its error."""
        a = pair.dissipative_constant(self.beta)
        return Constant(a, a * self.beta_standard_error / self.beta if self.beta else 0.0)

    def stiffness(self, sphere: Sphere, wall: bool) -> tuple[Constant, Constant]:
        """Return A and Y of a sphere that hits a wall or another one of its kind, from the measured contact times.

        Contact times are t_c = tau_c(v*) (rho/m)^(-2/5) v^(-1/5). The scatter of (rho/m)^(2/5) among the points gives
        its standard error. The Young modulus of `sphere` is not used. `wall`: whether it hits a wall of its material.

        Raises
        ------
        ValueError
            If no contact times were measured.
        """
        times = self.points.contact_time
        if times is None:
            raise ValueError("there are no contact times: expected a column contact_time")

        speed, loads = self.points.speed, self.points.load(self.points.speed)

        def log_q_by_point(beta: float) -> FloatArray:
            """Return ln q of each point, q = (rho/m)^(2/5)."""
            # kappa = v*^2 = beta v^(1/5)
            kappa = beta * speed**0.2
            scaled = weight_table.duration(kappa, loads) if loads.any() else double.tau_c(np.sqrt(kappa))
            # ln q = ln tau_c(v*) - 1/5 ln v - ln t_c
            return np.asarray(np.log(scaled) - 0.2 * np.log(speed) - np.log(times))

        log_qs = log_q_by_point(self.beta)
        # The mean of ln q, and its standard error from the scatter: one degree of freedom is the mean itself.
        log_q, log_q_error = float(log_qs.mean()), float(log_qs.std(ddof=1)) / math.sqrt(len(log_qs))
        beta_relative_error = self.beta_standard_error / self.beta
        # d ln q/d ln beta, because tau_c depends on beta: a central difference with steps of 0.1 %. Truncation, about
        # 1e-6, and round-off, about 1e-13, are far below the errors of A and Y.
        difference = np.mean(log_q_by_point(self.beta * 1.001) - log_q_by_point(self.beta / 1.001))
        slope = float(difference) / (2 * math.log(1.001))
        # beta = 3/2 A (rho/m)^(2/5), so A = 2/3 beta/q; its errors are (1 - slope) d ln beta and that of ln q
        a = 2 / 3 * self.beta * math.exp(-log_q)
        a_relative_error = math.hypot((1 - slope) * beta_relative_error, log_q_error)
        # q = (rho/m)^(2/5), and rho is proportional to Y, so with the rho of Y = 1: Y = q^(5/2) m/rho, and
        # d ln Y = 5/2 d ln q.
        wall_of_unit_modulus = Sphere.wall(young_modulus=1, poisson_ratio=sphere.poisson_ratio, dissipative_constant=0)
        sphere_of_unit_modulus = replace(sphere, young_modulus=1)
        pair = Pair(sphere_of_unit_modulus, wall_of_unit_modulus if wall else sphere_of_unit_modulus)
        young = math.exp(2.5 * log_q) * pair.m_eff / pair.rho
        return Constant(a, a * a_relative_error), Constant(
            young, young * 2.5 * math.hypot(slope * beta_relative_error, log_q_error)
        )


def fit(points: Points, *, laws: Sequence[Law | str] = (), robust: bool = False) -> DampingFit:
    """Fit the damping to measured points, with its uncertainty and a verdict on the viscoelastic law.

    Parameters
    ----------
    points : Points
        `Points.measured` of speeds and eps, or `bounces.of_times`, or `bounces.of_heights`.
    laws : sequence of Law or str
        Other laws of contact to compare with.
    robust : bool
        Whether errors are assumed to follow Student's t with 4 degrees of freedom, so that outliers count less.

    Returns
    -------
    DampingFit
        If there are more than `MANY` points with independent errors, its points are means of groups (`Points.grouped`).

    Raises
    ------
    TypeError, ValueError
        If there are fewer than three points, all speeds are equal, or a law is not known.
    MissingPackage
        If SciPy is not installed; the message has the command that installs it.

    Examples
    --------
    >>> import viscopade as vp
    >>> points = vp.Points.measured([0.03, 0.1, 0.3, 1, 3], [0.949, 0.938, 0.918, 0.901, 0.874])
    >>> damping = vp.fit(points)
    >>> f"{damping.beta:.3f} +- {damping.beta_standard_error:.3f}", damping.verdict.word
    ('0.094 +- 0.001', 'holds')
    """
    if not isinstance(points, Points):
        raise TypeError(refusal("points", points, "Points, such as vp.Points.measured(speed, epsilon)"))
    require("fit", "scipy")
    from viscopade.fitting import verdict  # imported here, because it loads SciPy
    from viscopade.fitting.likelihood import Model

    # Student's t is a distribution of one error of each point: it needs points that share none, one by one.
    if robust and not points.of_independent_errors:
        raise ValueError(
            "bounces share errors: expected speeds and eps with --robust; use --without to leave a bounce out"
        )
    if robust and len(points) > MANY:
        raise ValueError(f"there are {len(points)} points: expected at most {MANY} with --robust")
    if len(points) > MANY and points.of_independent_errors:
        points = points.grouped(GROUPS)
    # The viscoelastic law and its rivals, then the verdict and the points that are far from any law
    models = [Model.from_law(str(law), law_of(law)) for law in laws]
    fits, judgement = verdict.judged(points, models, robust=robust)
    return DampingFit(fits[0].points, fits, judgement, tuple(verdict.outliers(points)))
