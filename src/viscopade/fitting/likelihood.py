"""Fit of one law to measured points, by maximum likelihood, with SciPy.

A law is a curve eps = E(kappa) with kappa = b (v/v_0)^p. If the load of the body's weight is known, eps is assumed to
change as in the viscoelastic contact that has the same eps without weight (`weight_table`). The load of a point is
(v_G/v)^(6/5), where v_G is the speed at which it is 1. The residuals eps_i - E(v_i) have the covariance

    C = s^2 + G G^T,    G = d eps - E'(v) d v,

from the scatter s of eps and the measurement errors (`Points`). C is a band matrix, because successive bounces share a
flight. If a point is the mean of n measured ones, s^2/n replaces s^2. The fit minimises

    D = sum_i rho(z_i^2) + ln det C,    C = L L^T,    z = L^-1 r,

where rho(u) = u for Gaussian errors, and 5 ln(1 + u/4) for Student's t with 4 degrees of freedom, which is less
sensitive to outliers. In the fit of s, ln det C has the factor 1 - k/n for k parameters and n points: for equal errors
s^2 is then the sum of squares over n - k. G is taken at the fitted law. If eps has a scatter and known errors,
intervals come from a mixture over all s, weighted with the restricted likelihood.

SciPy does the fitting. lmfit would add little: there are one or two parameters, and its intervals take into account
neither the covariance of errors nor a known scale.

Names: b is the kappa of an impact at v_0, the geometric mean of the measured speeds; p is 1/5 for viscoelastic spheres.
n is the number of points and k that of the fitted parameters. A band matrix is an array whose row j has the j-th
diagonal below the main one, as LAPACK stores it; L is the Cholesky factor of C in this form.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from scipy import linalg, optimize, special

from viscopade.arrays import double
from viscopade.arrays.checked import FloatArray
from viscopade.collision.curve import curve
from viscopade.fitting import weight_table
from viscopade.fitting.points import Points
from viscopade.theory.law import VISCOELASTIC, Law

Shape = Callable[[FloatArray], FloatArray]
"""The curve eps = E(kappa) of a law."""

# Step of ln v in central differences: truncation, of order step^2 = 1e-8, and round-off, of order 1e-16/step = 1e-12,
# are both far below the errors of measured data.
_STEP = 1e-4
_ROUNDS = 40  # fits with a new C, at most: a guard, because the parameters are at rest after 3 to 7 (measured)
_CLOSE = 1e-7  # relative change of the parameters at rest: measured eps have five digits at most
# Range of the exponent p of a free law, chosen by hand: the theories lie in it (viscoelastic 1/5, constant 0,
# Hunt-Crossley 1), and an interval that reaches its end is reported as infinite.
_EXPONENTS = (-3.0, 5.0)
_DEGREES = 4.0  # of freedom of Student's t: the customary value in robust regression (Lange, Little, Taylor 1989)
# kappa, at most: there the compared laws have eps of 1e-12 or less, as good as 0, and the powers of much larger kappa
# would overflow.
_LARGEST = 1e12
_LEAST = 1e-10  # least scatter of eps: that of data that follow a law to rounding errors; C stays positive definite
_NO_LOAD = np.zeros(1)  # the load 0 of all points: numpy repeats the one element
# Number of values of the scatter, besides 0, in the mixture: steps of 0.17 in ln s over four decades and a half. The
# likelihood of n points has the width 1/sqrt(2 n) in ln s; a sum with steps of twice this, at n = 66, is off by 1 %.
# docs/results/fit.md has the measured coverage of the intervals for 12 and 48 points. More values only cost time.
_GRID = 60


@dataclass(frozen=True)
class Model:
    """A law as a curve eps = E(b (v/v_0)^p).

    Attributes
    ----------
    name : str
    law : Law
        The law whose curve is E.
    exponent : float or None
        The exponent p, or None if it is fitted.
    """

    name: str
    law: Law
    exponent: float | None

    @classmethod
    def from_law(cls, name: str, law: Law) -> Model:
        """Return the model of a law of contact: p = 2/nu - 1."""
        # p = 2/nu - 1 = 2 c, with c = 1/nu - 1/2
        return cls(name, law, float(2 * law.c))

    def epsilon(self, kappa: FloatArray, load: FloatArray = _NO_LOAD) -> FloatArray:
        """Return eps = E(kappa) at each kappa, the scaled damping, under the scaled load of the body's weight."""
        kappa = np.minimum(kappa, _LARGEST)
        if not load.any():
            return _shape(self.law)(kappa)
        # The table of collisions under a load is that of the viscoelastic law: for another law, take the viscoelastic
        # contact with the same eps without weight. This is an assumption, because other laws have no table.
        if self.law != VISCOELASTIC:
            kappa = kappa_of(VISCOELASTIC, _shape(self.law)(kappa))
        return weight_table.epsilon(kappa, load)

    def kappa(self, epsilon: FloatArray, load: FloatArray = _NO_LOAD) -> FloatArray:
        """Return the kappa that gives each eps under each load: the inverse of `epsilon`."""
        if not load.any():
            return kappa_of(self.law, epsilon)
        # The steps of `epsilon` backward: from eps under the load to eps without it, and to this law's kappa.
        kappa = weight_table.kappa_from(epsilon, load)
        return kappa if self.law == VISCOELASTIC else kappa_of(self.law, _shape(VISCOELASTIC)(kappa))

    @property
    def parameters(self) -> int:
        """Number of fitted parameters, without the scatter."""
        return 1 if self.exponent is not None else 2


@lru_cache(maxsize=16)  # laws: a fit compares four, and those that the user adds
def _shape(law: Law) -> Shape:
    """Return the function eps = E(kappa) of a law without load."""
    if law == VISCOELASTIC:
        # the library's function of v* = kappa^(1/2), in double precision; other laws have an interpolated curve
        return lambda kappa: double.epsilon(np.sqrt(kappa))
    return curve(law).epsilon


def kappa_of(law: Law, epsilon: FloatArray) -> FloatArray:
    """Return the kappa at which a law gives each eps, without load."""
    if law == VISCOELASTIC:
        return np.asarray(double.v_star_from(epsilon)) ** 2  # kappa = v*^2
    return curve(law).kappa_from(epsilon)


@dataclass(frozen=True, eq=False)
class LawFit:
    """A law fitted to points.

    Attributes
    ----------
    points : Points
    model : Model
    middle : float
        The speed v_0, the geometric mean of all.
    parameters : array
        b and, if it is fitted, p.
    scatter : float
        s, the standard deviation of eps beyond the errors of the measurement; 0 if there is none.
    robust : bool
        Whether the errors follow Student's t.
    """

    points: Points
    model: Model
    middle: float
    parameters: FloatArray
    scatter: float
    robust: bool

    @property
    def exponent(self) -> float:
        """The exponent p, fitted or fixed."""
        return float(self.parameters[1]) if self.model.exponent is None else self.model.exponent

    def epsilon(self, speed: FloatArray, parameters: FloatArray | None = None) -> FloatArray:
        """Return eps of the law at impact speeds, under the load of the weight; `parameters`: b and p, or the fit's."""
        parameters = self.parameters if parameters is None else parameters
        power = parameters[1] if self.model.exponent is None else self.model.exponent
        with np.errstate(over="ignore"):
            # kappa = b (v/v_0)^p; an overflow to infinity gives eps = 0
            kappa = np.asarray(parameters[0] * (speed / self.middle) ** power)
        return self.model.epsilon(kappa, self.points.load(speed))

    @cached_property
    def residuals(self) -> FloatArray:
        """eps_i - E(v_i)."""
        return self.points.epsilon - self.epsilon(self.points.speed)

    @cached_property
    def _measured(self) -> FloatArray:
        """G G^T, the covariance of the residuals by the measurement errors alone, as a band."""
        return _measurement_band(self.points, self)

    @cached_property
    def _factor(self) -> FloatArray:
        """L of C = L L^T, with the fitted scatter, as a band."""
        return _cholesky(self._measured, self.scatter, self.points.counts)

    @property
    def standard_errors(self) -> FloatArray:
        """Standard deviations of the residuals, if the law is true: the roots of the diagonal of C."""
        return np.asarray(np.sqrt(self._measured[0] + _scatter_variance(self.scatter, self.points.counts)))

    @property
    def chi2(self) -> float:
        """r^T C^-1 r = |L^-1 r|^2."""
        return float(np.sum(_whiten(self._factor, self.residuals) ** 2))

    @property
    def degrees(self) -> int:
        """Number of points minus number of parameters."""
        return len(self.points) - self.model.parameters

    @cached_property
    def misfit(self) -> float:
        """Minus twice the logarithm of the likelihood, -2 ln L = D + n ln 2 pi, at the scatter that maximises it."""
        misfit = Misfit(self._measured, self.residuals, self.points.counts, self.robust)
        # The full ln det C (share 1, no parameters taken off): Akaike's criterion needs the likelihood itself, not the
        # restricted one of the fit.
        scatter = 0.0 if self.points.errors_complete else misfit.scatter(0.0)
        return misfit.deviance(scatter, 1.0) + len(self.points) * math.log(2 * math.pi)

    @cached_property
    def aic(self) -> float:
        """Akaike's criterion with the correction for few points; infinite if the points are too few for it."""
        n, k = len(self.points), self.model.parameters + (not self.points.errors_complete)  # the scatter is one more
        # AICc = -2 ln L + 2 k + 2 k (k + 1)/(n - k - 1) (Hurvich and Tsai 1989)
        return self.misfit + 2 * k + (2 * k * (k + 1) / (n - k - 1) if n > k + 1 else math.inf)

    @cached_property
    def covariance(self) -> FloatArray:
        """Covariance of the parameters, at the fitted scatter."""
        return _covariance(self._factor, self._slopes, self.robust)

    def standard_error(self, parameter: int = 0) -> float:
        """Return the standard error of b (`parameter` 0) or of p (1)."""
        if self._mixture is None:
            return math.sqrt(self.covariance[parameter, parameter])
        weights, means, variances = self._mixture
        # The variance of a mixture is the mean of the variances plus the variance of the means.
        deviations = means[:, parameter] - float(weights @ means[:, parameter])
        return math.sqrt(float(weights @ (variances[:, parameter] + deviations**2)))

    @cached_property
    def _mixture(self) -> _Mixture | None:
        """The fits at a grid of scatters, weighted; None if all errors are known, or the scatter is the only error.

        The weights are the restricted likelihood, exp(-D/2) ds: few points may have a scatter that does not show.
        """
        if self.points.errors_complete or not self._measured.any():
            return None
        # Values of s around the root mean square of residuals and errors. Below a thousandth of it a scatter changes an
        # error of this size by less than 1e-6, and 0 stands for them all. At 30 times of it the restricted likelihood,
        # which falls as s^-(n - k), is 30^-2 of the largest for three points and one parameter. Within these bounds the
        # limits are chosen by hand.
        root = math.sqrt(float(np.mean(self.residuals**2)) + float(np.mean(self._measured[0])))
        grid = np.concatenate([[0.0], root * np.geomspace(1e-3, 30, _GRID)])
        fits = [self._refit_at_scatter(s) for s in grid.tolist()]
        deviances = np.array([fit.deviance for fit in fits])
        if not math.isfinite(deviances.min()):  # eps does not depend on p if b is 0
            return None
        # exp(-D/2) ds, over its largest value, which cancels
        weights = np.exp(-(deviances - deviances.min()) / 2) * np.gradient(grid)
        return _Mixture(
            weights / weights.sum(),
            np.array([fit.parameters for fit in fits]),
            np.array([fit.variances for fit in fits]),
        )

    def _refit_at_scatter(self, scatter: float) -> _FitAtScatter:
        """Return the fit with this standard deviation s of the scatter (of eps) instead of the fitted one.

        The law is linearised at the fit: eps = E(v) + J x for a shift x of the parameters b and p. At the fitted
        scatter x is 0, also with `robust`.
        """
        try:
            factor = _cholesky(self._measured, scatter, self.points.counts)
        except ValueError:  # C is singular without a scatter: this s is impossible, and gets the weight 0
            return _FitAtScatter(math.inf, self.parameters, np.zeros(len(self.parameters)))
        whitened = _whiten(factor, self.residuals)
        # L^-1 J, with a row for each point
        slopes = np.array([_whiten(factor, column) for column in self._slopes.T]).T
        # (J^T C^-1 J)^-1, without the factor of Student's t
        inverse = _covariance(factor, self._slopes, robust=False)
        if self.robust:
            # The least sum of rho(z^2), z = L^-1 (r - J x): no formula, but a short search from x = 0.
            shift = optimize.least_squares(
                lambda x: whitened - slopes @ x, np.zeros(len(inverse)), lambda x: -slopes, loss=_student, x_scale="jac"
            ).x
        else:
            # Least squares, in one step: x = (J^T C^-1 J)^-1 J^T C^-1 r.
            shift = inverse @ slopes.T @ whitened
        squares = (whitened - slopes @ shift) ** 2
        # The restricted D = sum rho + ln det C + ln det J^T C^-1 J (REML; Patterson and Thompson 1971). ln det C is
        # twice the sum of ln L_ii, and the last determinant is that of the inverse of `inverse`. With Student's t the
        # information is 5/7 of J^T C^-1 J (`_covariance`) at every s: a constant, which cancels in the weights.
        deviance = np.sum(_rho(squares, self.robust)) + 2 * np.sum(np.log(factor[0])) - np.linalg.slogdet(inverse)[1]
        variances = np.diag(_covariance(factor, self._slopes, self.robust))
        return _FitAtScatter(float(deviance), self.parameters + shift, variances)

    @cached_property
    def _slopes(self) -> FloatArray:
        """J, the derivatives of eps at all points (rows) with respect to the parameters (columns)."""
        slopes = np.empty((len(self.points), len(self.parameters)))
        for i, value in enumerate(self.parameters):
            # Central differences, with a step of 1e-4 of the parameter, as `_STEP`; a parameter near 0, such as p of a
            # constant eps, gets the step of 1e-3, which is 1e-7: the round-off of a slope is then about 1e-9. b stays
            # >= 0.
            low, high, step = self.parameters.copy(), self.parameters.copy(), 1e-4 * max(abs(value), 1e-3)
            high[i] += step
            low[i] -= step if i else min(step, value)
            slopes[:, i] = (self.epsilon(self.points.speed, high) - self.epsilon(self.points.speed, low)) / (
                high[i] - low[i]
            )
        return slopes

    def quantile(self, level: float) -> float:
        """Return the half-width, in standard errors, of an interval of a confidence level.

        It is a quantile of the normal distribution, or of Student's t if the scatter is fitted.
        """
        # Both tails together have the probability 1 - level: the upper end is the quantile of (1 + level)/2. stdtrit is
        # that of Student's t, with n - k degrees of freedom.
        probability = (1 + level) / 2
        return float(
            special.ndtri(probability) if self.points.errors_complete else special.stdtrit(self.degrees, probability)
        )

    def interval(self, level: float, parameter: int = 0) -> tuple[float, float]:
        """Return the confidence interval of b (`parameter` 0) or of p (1) by profile likelihood; b is not negative.

        It ends where D, minimised over the other parameter, has grown by the square of `quantile`. If eps has a scatter
        and known errors, the interval comes from a mixture over the scatter instead (`_mixture`). `level` is the
        probability of the interval, such as 0.95.
        """
        if self._mixture is not None:
            # Each of the two tails has the probability (1 - level)/2.
            low, high = (self._mixture_quantile(parameter, p) for p in ((1 - level) / 2, (1 + level) / 2))
            return (low if parameter else max(low, 0.0)), high
        best, limit = self.parameters[parameter], self.quantile(level) ** 2
        smallest = self._sum_of_rho(self.parameters)
        # The first step of the search is a standard error. Where this is 0, for data that follow the law to round-off,
        # 1e-12 of the parameter (of 1e-6, if that is 0 as well) is above its round-off of 1e-16.
        step = max(math.sqrt(self.covariance[parameter, parameter]), 1e-12 * max(abs(best), 1e-6))

        def excess(value: float) -> float:
            """Return how much D grows beyond the limit if the parameter has this value: 0 at an end."""
            return self._profile(parameter, value) - smallest - limit

        def end(sign: int) -> float:
            """Return the upper end (sign 1) or the lower one (-1); infinite if D never grows enough."""
            # The distance from the best value doubles until D has grown enough; then the end lies between the last two.
            inner, reach = best, sign * step * math.sqrt(limit)
            while _EXPONENTS[0] < inner + reach < _EXPONENTS[1] if parameter else abs(inner + reach) < _LARGEST:
                outer = inner + reach if parameter else max(inner + reach, 0.0)
                if excess(outer) > 0:
                    # Nine digits of the end: reports print six.
                    return float(optimize.brentq(excess, *sorted((inner, outer)), rtol=1e-9))
                if parameter == 0 and outer == 0:
                    return 0.0
                inner, reach = outer, 2 * reach
            return sign * math.inf

        return end(-1), end(1)

    def _mixture_quantile(self, parameter: int, probability: float) -> float:
        """Return the value below which b (`parameter` 0) or p (1) lies with this probability, over all scatters."""
        assert self._mixture is not None
        weights, means, variances = self._mixture
        positive = weights > 0
        centre, width = means[positive, parameter], np.sqrt(variances[positive, parameter])

        def excess(value: float) -> float:
            # sum_s w_s Phi((value - mean_s)/sigma_s) - probability, with the normal distribution Phi
            return float(weights[positive] @ special.ndtr((value - centre) / width)) - probability

        # At each s the parameter is taken as normal: with Gaussian errors it is, and with Student's t nearly (a test
        # has the likelihood on a grid). The root lies within 12 standard deviations of the means: a Gaussian's tail
        # beyond, 2e-33, is below round-off.
        ends = float((centre - 12 * width).min()), float((centre + 12 * width).max())
        # Nine digits, or 1e-12 near 0: reports print six.
        return float(optimize.brentq(excess, *ends, xtol=1e-12, rtol=1e-9))

    def _profile(self, parameter: int, value: float) -> float:
        """Return sum rho(z^2) for a value of one parameter, minimised over the other one, with C of the fit."""
        if len(self.parameters) == 1:
            return self._sum_of_rho(np.array([value]))
        other_parameter = 1 - parameter

        def residuals(other_value: FloatArray) -> FloatArray:
            """Return z = L^-1 r."""
            parameters = np.empty(2)
            parameters[parameter], parameters[other_parameter] = value, other_value[0]
            return _whiten(self._factor, self.points.epsilon - self.epsilon(self.points.speed, parameters))

        minimum = optimize.least_squares(
            residuals,
            self.parameters[[other_parameter]],
            bounds=([_EXPONENTS[0]], [_EXPONENTS[1]]) if other_parameter else ([0], [np.inf]),  # of p, or of b
            loss=_student if self.robust else "linear",
            x_scale="jac",
        )
        return 2 * float(minimum.cost)  # SciPy's cost is half the sum

    def _sum_of_rho(self, parameters: FloatArray) -> float:
        """Return sum rho(z^2) for values of all parameters, with C of the fit."""
        whitened = _whiten(self._factor, self.points.epsilon - self.epsilon(self.points.speed, parameters))
        return float(np.sum(_rho(whitened**2, self.robust)))


class _FitAtScatter(NamedTuple):
    """A fit with a fixed scatter: the restricted D, b and p, and their variances."""

    deviance: float
    parameters: FloatArray
    variances: FloatArray


class _Mixture(NamedTuple):
    """Fits at a grid of scatters (rows): their weights, whose sum is 1, and the means and variances of b and p."""

    weights: FloatArray
    means: FloatArray
    variances: FloatArray


def fit_law(points: Points, model: Model, *, robust: bool = False) -> LawFit:
    """Return the law of a model fitted to points; `robust` takes Student's t for errors, which outliers hardly move.

    Raises
    ------
    ValueError
        If there are fewer than three points, or all speeds are equal.
    """
    # A law has one or two parameters besides the scatter: three points leave a degree of freedom.
    if len(points) < 3:
        raise ValueError(f"there are {len(points)} points with a speed and an eps: expected 3 or more")
    # Speeds that agree to nine digits are one speed with round-off of its units: they tell nothing about a trend.
    if np.ptp(points.speed) <= 1e-9 * points.speed.max():
        raise ValueError(
            f"all speeds are {points.speed[0]:.6g}: expected at least two different ones; `viscopade invert` gives "
            "the damping for one eps at one speed"
        )
    middle = float(np.exp(np.mean(np.log(points.speed))))
    # A free exponent may be positive or negative: the better of two searches counts. They start at the viscoelastic
    # 1/5 and at its negative.
    starts = [model.exponent] if model.exponent is not None else [0.2, -0.2]
    return min((_search(points, model, middle, start, robust) for start in starts), key=lambda fit: fit.misfit)


def _search(points: Points, model: Model, middle: float, first_exponent: float, robust: bool) -> LawFit:
    """Return the fit that a search from the exponent `first_exponent` finds.

    `points`, `model` and `robust` are those of `fit_law`, and `middle` is v_0.
    """
    # kappa of all points gives b = kappa (v/v_0)^-p; their median is the first guess. An eps of 0 has no finite kappa,
    # and b = 0 no slope back: both are moved off 0, by less than any measurement tells.
    kappa = model.kappa(np.clip(points.epsilon, 1e-6, 1.0), points.load(points.speed))
    guesses = kappa * (points.speed / middle) ** -first_exponent
    first = np.array([max(float(np.median(guesses)), 1e-9), first_exponent][: model.parameters])
    # The first scatter is that of a constant eps, and above 0.
    fit = LawFit(points, model, middle, first, float(np.std(points.epsilon)) + 1e-9, robust)
    lower, upper = np.array([0.0, _EXPONENTS[0]]), np.array([np.inf, _EXPONENTS[1]])  # of b and p
    for _ in range(_ROUNDS):
        # C depends on the law through G, and on s: fit the parameters for this C, then compute C again.
        measured = _measurement_band(points, fit)
        misfit = Misfit(measured, fit.residuals, points.counts, robust, points.resolution)
        scatter = 0.0 if points.errors_complete else misfit.scatter(model.parameters / len(points))
        factor = _cholesky(measured, scatter, points.counts)
        # SciPy's tolerances of 1e-12 instead of 1e-8, so that the search ends well below `_CLOSE`.
        solution = optimize.least_squares(
            lambda values, fit=fit, factor=factor: _whiten(factor, points.epsilon - fit.epsilon(points.speed, values)),
            fit.parameters,
            bounds=(lower[: model.parameters], upper[: model.parameters]),
            loss=_student if robust else "linear",
            x_scale="jac",
            xtol=1e-12,
            ftol=1e-12,
            gtol=1e-12,
        )
        last_fit, fit = fit, LawFit(points, model, middle, solution.x, scatter, robust)
        # Changes over sizes; 1e-9 and 1e-12 let a b, p or s of 0 come to rest. s is an error itself: five digits do.
        change = np.max(np.abs(fit.parameters - last_fit.parameters) / (np.abs(fit.parameters) + 1e-9))
        if change <= _CLOSE and abs(scatter - last_fit.scatter) <= 1e-5 * (scatter + 1e-12):
            break
    return fit


# --- the band of the covariance ---------------------------------------------------------------------------------------


def _measurement_band(points: Points, fit: LawFit) -> FloatArray:
    """Return G G^T, the covariance of the residuals by the measurement errors, as its diagonals, the main one first.

    G is taken at the law of `fit`, and the speeds, eps and errors are those of `points`.
    """
    low, high = (fit.epsilon(points.speed * ratio) for ratio in np.exp([-_STEP, _STEP]))
    # E'(v) = (dE/d ln v)/v, by a central difference
    slope = (high - low) / (2 * _STEP) / points.speed
    # G = d eps - E'(v) d v
    errors = points.epsilon_errors - points.speed_errors.multiply(slope[:, None]).tocsr()
    covariance = errors @ errors.T
    # Only points near each other share errors: row k of the band is the k-th diagonal below the main one.
    rows, columns = covariance.nonzero()
    width = int(np.max(rows - columns, initial=0))
    band = np.zeros((width + 1, len(points)))
    for k in range(width + 1):
        band[k, : len(points) - k] = covariance.diagonal(-k)
    return band


def _covariance(factor: FloatArray, slopes: FloatArray, robust: bool) -> FloatArray:
    """Return the covariance of parameters on which eps depends with these slopes J; `factor` is the band of L.

    `robust`: the errors follow Student's t.
    """
    whitened = np.array([_whiten(factor, column) for column in slopes.T]).T
    # (J^T C^-1 J)^-1; columns are scaled to length 1, so that the inverse hardly depends on units. It is a
    # pseudoinverse, because eps does not depend on p if b is 0; such a column of 0 keeps the size 1.
    size = np.sqrt(np.sum(whitened**2, axis=0))
    size[size == 0] = 1.0
    # Ratio of the Fisher information of a Gaussian to that of Student's t with d degrees of freedom and the same scale:
    # 1 to (d + 1)/(d + 3).
    scale = (_DEGREES + 3) / (_DEGREES + 1) if robust else 1.0
    return np.asarray(np.linalg.pinv((whitened / size).T @ (whitened / size)) / np.outer(size, size) * scale)


def _scatter_variance(scatter: float, counts: FloatArray | None) -> float | FloatArray:
    """Return s^2, or s^2/n for points that are means of n = `counts` measured ones."""
    return scatter**2 if counts is None else scatter**2 / counts


def _cholesky(measured: FloatArray, scatter: float, counts: FloatArray | None) -> FloatArray:
    """Return L of C = s^2 + G G^T = L L^T as a band, from the band `measured` of G G^T.

    `counts` has the numbers of measured points in each mean, or is None.
    ValueError: C is singular, because some points have neither an error nor a scatter.
    """
    band = measured.copy()
    band[0] += _scatter_variance(scatter, counts)
    # Without shared errors C is diagonal; its elements are at least the square of the least scatter.
    if len(band) == 1:
        return np.asarray(np.sqrt(np.maximum(band, _LEAST**2)))
    try:
        return np.asarray(linalg.cholesky_banded(band, lower=True))
    except np.linalg.LinAlgError:
        raise ValueError(
            "the standard errors are 0 for some combination of points: expected a standard error for each point"
        ) from None


def _whiten(factor: FloatArray, values: FloatArray) -> FloatArray:
    """Return L^-1 of `values`, one of each point; `factor` is the band of L.

    Residuals become independent, with a variance of 1 if the law is true.
    """
    if len(factor) == 1:
        return np.asarray(values / factor[0])
    # L has len - 1 diagonals below the main one, and none above it.
    return np.asarray(linalg.solve_banded((len(factor) - 1, 0), factor, values))


def _rho(squares: FloatArray, robust: bool) -> FloatArray:
    """Return rho(u) of squares u = z^2: u, or (d + 1) ln(1 + u/d) for Student's t with d degrees of freedom."""
    return (_DEGREES + 1) * np.log1p(squares / _DEGREES) if robust else squares


def _student(squares: FloatArray) -> FloatArray:
    """Return rho(u) of Student's t and its first two derivatives, as rows: SciPy's form of a loss function."""
    # rho = (d + 1) ln(1 + u/d), rho' = (d + 1)/d/(1 + u/d), rho'' = -rho'/d/(1 + u/d)
    inner = 1 + squares / _DEGREES
    slope = (_DEGREES + 1) / _DEGREES
    return np.array([(_DEGREES + 1) * np.log(inner), slope / inner, -slope / _DEGREES / inner**2])


@dataclass(frozen=True, eq=False)
class Misfit:
    """Residuals of a law, as a function D of the scatter.

    Attributes
    ----------
    measured : array
        The band of G G^T.
    residuals : array
        eps_i - E(v_i).
    counts : array or None
        Number of measured points in each mean.
    robust : bool
        Whether errors follow Student's t.
    resolution : float
        One unit in the last digit of the measured eps.
    """

    measured: FloatArray
    residuals: FloatArray
    counts: FloatArray | None
    robust: bool
    resolution: float = 0.0

    def deviance(self, scatter: float, share: float) -> float:
        """Return D at a standard deviation of the scatter, with the factor `share` before ln det C: 1 - k/n, or 1."""
        try:
            factor = _cholesky(self.measured, scatter, self.counts)
        except ValueError:  # no scatter, and no error of some points
            return math.inf
        squares = _whiten(factor, self.residuals) ** 2
        # ln det C = 2 sum ln L_ii
        return float(np.sum(_rho(squares, self.robust)) + 2 * share * np.sum(np.log(factor[0])))

    def scatter(self, parameters_per_point: float) -> float:
        """Return the scatter, the standard deviation s of eps, that minimises D; `parameters_per_point` is k/n."""
        weights = 1.0 if self.counts is None else self.counts
        root = math.sqrt(float(np.mean(weights * self.residuals**2)))
        # The scatter is the only error: s^2 = sum w r^2/(n - k), in closed form.
        if not self.measured.any() and not self.robust:
            return max(root / math.sqrt(1 - parameters_per_point), _LEAST)
        # The search for ln s begins at a millionth of the root mean square residual, which is as good as no scatter.
        # With Student's t, equal values of rounded data would look like data without any scatter: it begins at the
        # rounding error. Rounding to a unit has the standard deviation 1/sqrt(12) of it.
        floor = max(1e-6 * root, self.resolution / math.sqrt(12)) if self.robust else 1e-6 * root
        # It ends at ten times the root mean square, a margin by hand that costs a step or two: with equal errors s
        # exceeds that only by 1/sqrt(1 - k/n), at most sqrt(3), with Student's t by little more.
        top, bottom = math.log(10 * max(root, floor) + _LEAST), math.log(floor + _LEAST)
        minimum = optimize.minimize_scalar(
            lambda log_scatter: self.deviance(math.exp(log_scatter), 1 - parameters_per_point),
            bounds=(bottom, top),
            method="bounded",
            options={"xatol": 1e-7},  # of ln s: a minimum is found to the root of round-off, 1e-8, at best
        )
        # No scatter at all, s = 0, is compared apart: ln s does not reach it.
        if self.measured[0].all() and self.deviance(0.0, 1 - parameters_per_point) <= float(minimum.fun):
            return 0.0
        return math.exp(float(minimum.x))
