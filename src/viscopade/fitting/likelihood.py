"""Fit of one law to measured points, by maximum likelihood, with SciPy.

A law is a curve eps = E(kappa) with kappa = b (v/v_0)^p. If the load of the body's weight is known, eps changes as in
the viscoelastic contact that has the same eps without weight (`weight_table`). The residuals eps_i - E(v_i)
have the covariance

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
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from scipy import linalg, optimize, special

from viscopade.arrays import double
from viscopade.arrays.checked import FloatArray
from viscopade.collision.curve import curve
from viscopade.fitting import weight_table
from viscopade.fitting.points import Points
from viscopade.theory.law import VISCOELASTIC, Law

Shape = Callable[[FloatArray], FloatArray]

_STEP = 1e-4  # of ln v, for slopes: a choice
_ROUNDS = 40  # of fits with a new C, at most: a choice
_CLOSE = 1e-7  # relative change of parameters that ends them: a choice
_EXPONENTS = (-3.0, 5.0)  # of a free law: a choice
_DEGREES = 4.0  # of freedom, of Student's t
_LARGEST = 1e12  # kappa: a choice
_LEAST = 1e-10  # least scatter: that of data that follow a law to rounding errors
_NO_LOAD = np.zeros(1)
_GRID = 60  # number of values of the scatter, besides 0: a choice


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
        """Return E, changed by loads."""
        kappa = np.minimum(kappa, _LARGEST)
        if not load.any():
            return _shape(self.law)(kappa)
        if self.law != VISCOELASTIC:
            kappa = kappa_of(VISCOELASTIC, _shape(self.law)(kappa))
        return weight_table.epsilon(kappa, load)

    def kappa(self, epsilon: FloatArray, load: FloatArray = _NO_LOAD) -> FloatArray:
        """Return the kappa that gives each eps."""
        if not load.any():
            return kappa_of(self.law, epsilon)
        kappa = weight_table.kappa_from(epsilon, load)
        return kappa if self.law == VISCOELASTIC else kappa_of(self.law, _shape(VISCOELASTIC)(kappa))

    @property
    def parameters(self) -> int:
        """Number of fitted parameters, without the scatter."""
        return 1 if self.exponent is not None else 2


@lru_cache(maxsize=16)
def _shape(law: Law) -> Shape:
    if law == VISCOELASTIC:
        return lambda kappa: double.epsilon(np.sqrt(kappa))
    return curve(law).epsilon


def kappa_of(law: Law, epsilon: FloatArray) -> FloatArray:
    """Return the kappa that gives each eps."""
    if law == VISCOELASTIC:
        return np.asarray(double.v_star_from(epsilon)) ** 2
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

    def at(self, speed: FloatArray, parameters: FloatArray | None = None) -> FloatArray:
        """Return eps of the law at speeds, with the fitted parameters or others."""
        parameters = self.parameters if parameters is None else parameters
        power = parameters[1] if self.model.exponent is None else self.model.exponent
        with np.errstate(over="ignore"):
            # kappa = b (v/v_0)^p
            kappa = np.asarray(parameters[0] * (speed / self.middle) ** power)
        return self.model.epsilon(kappa, self.points.load(speed))

    @cached_property
    def residuals(self) -> FloatArray:
        """eps_i - E(v_i)."""
        return self.points.epsilon - self.at(self.points.speed)

    @cached_property
    def _measured(self) -> FloatArray:
        return _band(self.points, self)

    @cached_property
    def _factor(self) -> FloatArray:
        return _cholesky(self._measured, self.scatter, self.points.counts)

    @property
    def standard_errors(self) -> FloatArray:
        """Standard deviations of the residuals, if the law is true."""
        return np.asarray(np.sqrt(self._measured[0] + _squared(self.scatter, self.points.counts)))

    @property
    def chi2(self) -> float:
        """r^T C^-1 r."""
        return float(np.sum(_whitened(self._factor, self.residuals) ** 2))

    @property
    def degrees(self) -> int:
        """Number of points minus number of parameters."""
        return len(self.points) - self.model.parameters

    @cached_property
    def misfit(self) -> float:
        """Minus twice the logarithm of the likelihood, at the scatter that maximises it."""
        misfit = Misfit(self._measured, self.residuals, self.points.counts, self.robust)
        deviance = misfit.deviance(0.0 if self.points.known else misfit.scatter(0.0), 1.0)
        return deviance + len(self.points) * math.log(2 * math.pi)

    @cached_property
    def aic(self) -> float:
        """Akaike's criterion with the correction for few points; infinite if the points are too few for it."""
        n, k = len(self.points), self.model.parameters + (not self.points.known)
        # AIC = -2 ln L + 2 k + 2 k (k + 1)/(n - k - 1)
        return self.misfit + 2 * k + (2 * k * (k + 1) / (n - k - 1) if n > k + 1 else math.inf)

    @cached_property
    def covariance(self) -> FloatArray:
        """Covariance of the parameters, at the fitted scatter."""
        return _covariance(self._factor, self._slopes, self.robust)

    def standard_error(self, parameter: int = 0) -> float:
        """Return the standard error of a parameter."""
        if self._mixture is None:
            return math.sqrt(self.covariance[parameter, parameter])
        weights, means, variances = (values[..., parameter] if values.ndim > 1 else values for values in self._mixture)
        # The variance of a mixture is the mean of the variances plus the variance of the means.
        middle = float(weights @ means)
        return math.sqrt(float(weights @ (variances + (means - middle) ** 2)))

    @cached_property
    def _mixture(self) -> tuple[FloatArray, FloatArray, FloatArray] | None:
        """Values of the scatter: their weights, and the means and variances of the parameters at each.

        None if all errors are known, or if the scatter is the only error. The weights are the restricted likelihood,
        exp(-D/2) ds: few points may have a scatter that does not show.
        """
        if self.points.known or not self._measured.any():
            return None
        # Values of s around the root mean square of residuals and errors; the range is a choice.
        root = math.sqrt(float(np.mean(self.residuals**2)) + float(np.mean(self._measured[0])))
        grid = np.concatenate([[0.0], root * np.geomspace(1e-3, 30, _GRID)])
        expansions = [self._at_scatter(s) for s in grid.tolist()]
        deviances = np.array([deviance for deviance, _, _ in expansions])
        if not math.isfinite(deviances.min()):  # eps does not depend on p if b is 0
            return None
        # exp(-D/2) ds, over its largest value, which cancels
        weights = np.exp(-(deviances - deviances.min()) / 2) * np.gradient(grid)
        means, variances = (np.array([expansion[i] for expansion in expansions]) for i in (1, 2))
        return weights / weights.sum(), means, variances

    def _at_scatter(self, scatter: float) -> tuple[float, FloatArray, FloatArray]:
        """Return the restricted D, and the parameters and their variances at a scatter, to first order."""
        k = len(self.parameters)
        try:
            factor = _cholesky(self._measured, scatter, self.points.counts)
        except ValueError:
            return math.inf, self.parameters, np.zeros(k)
        # A Gauss-Newton step with the slopes J: shift = (J^T C^-1 J)^-1 J^T C^-1 r.
        covariance = _covariance(factor, self._slopes, robust=False)
        whitened = _whitened(factor, self.residuals)
        slopes = np.array([_whitened(factor, column) for column in self._slopes.T])
        shift = covariance @ slopes @ whitened
        squares = (whitened - shift @ slopes) ** 2
        # D = sum rho + ln det C + ln det J^T C^-1 J; ln det C is twice the sum of ln L_ii.
        deviance = np.sum(_rho(squares, self.robust)) + 2 * np.sum(np.log(factor[0])) - np.linalg.slogdet(covariance)[1]
        return float(deviance), self.parameters + shift, np.diag(_covariance(factor, self._slopes, self.robust))

    @cached_property
    def _slopes(self) -> FloatArray:
        """Derivatives of eps at all points (rows) with respect to the parameters."""
        slopes = np.empty((len(self.points), len(self.parameters)))
        for i, value in enumerate(self.parameters):
            # Central differences, with a step of 1e-4 of the parameter; b stays >= 0.
            low, high, step = self.parameters.copy(), self.parameters.copy(), 1e-4 * max(abs(value), 1e-3)
            high[i] += step
            low[i] -= step if i else min(step, value)
            slopes[:, i] = (self.at(self.points.speed, high) - self.at(self.points.speed, low)) / (high[i] - low[i])
        return slopes

    def quantile(self, level: float) -> float:
        """Return the half-width, in standard errors, of an interval of a confidence level.

        It is a quantile of the normal distribution, or of Student's t if the scatter is fitted.
        """
        # Both tails together have the probability 1 - level.
        tail = (1 + level) / 2
        return float(special.ndtri(tail) if self.points.known else special.stdtrit(self.degrees, tail))

    def interval(self, level: float, parameter: int = 0) -> tuple[float, float]:
        """Return the confidence interval of a parameter by profile likelihood; b is not negative.

        It ends where D, minimised over the other parameter, has grown by the square of `quantile`. If eps has a scatter
        and known errors, the interval comes from a mixture over the scatter instead (`_mixture`).
        """
        if self._mixture is not None:
            low, high = (self._mixed(parameter, tail) for tail in ((1 - level) / 2, (1 + level) / 2))
            return (low if parameter else max(low, 0.0)), high
        best, limit = self.parameters[parameter], self.quantile(level) ** 2
        least = self._misfit(self.parameters)
        step = max(math.sqrt(self.covariance[parameter, parameter]), 1e-12 * max(abs(best), 1e-6))

        def excess(value: float) -> float:
            return self._profile(parameter, value) - least - limit

        def end(sign: int) -> float:
            # The distance from the best value doubles until D has grown enough; then the end lies between the last two.
            inner, reach = best, sign * step * math.sqrt(limit)
            while _EXPONENTS[0] < inner + reach < _EXPONENTS[1] if parameter else abs(inner + reach) < _LARGEST:
                outer = inner + reach if parameter else max(inner + reach, 0.0)
                if excess(outer) > 0:
                    return float(optimize.brentq(excess, *sorted((inner, outer)), rtol=1e-9))
                if parameter == 0 and outer == 0:
                    return 0.0
                inner, reach = outer, 2 * reach
            return sign * math.inf

        return end(-1), end(1)

    def _mixed(self, parameter: int, tail: float) -> float:
        """Return a quantile of a parameter, over the values of the scatter."""
        assert self._mixture is not None
        weights, means, variances = self._mixture
        positive = weights > 0
        centre, width = means[positive, parameter], np.sqrt(variances[positive, parameter])

        def missing(value: float) -> float:
            return float(weights[positive] @ special.ndtr((value - centre) / width)) - tail

        # At 12 standard deviations a Gaussian's tail is below round-off.
        ends = float((centre - 12 * width).min()), float((centre + 12 * width).max())
        return float(optimize.brentq(missing, *ends, xtol=1e-12, rtol=1e-9))

    def _profile(self, parameter: int, value: float) -> float:
        if len(self.parameters) == 1:
            return self._misfit(np.array([value]))
        other = 1 - parameter

        def all_parameters(free: FloatArray) -> FloatArray:
            values = np.empty(2)
            values[parameter], values[other] = value, free[0]
            return values

        minimum = optimize.least_squares(
            lambda free: _whitened(
                self._factor, self.points.epsilon - self.at(self.points.speed, all_parameters(free))
            ),
            self.parameters[[other]],
            bounds=([_EXPONENTS[0]], [_EXPONENTS[1]]) if other else ([0], [np.inf]),
            loss=_student if self.robust else "linear",
            x_scale="jac",
        )
        return 2 * float(minimum.cost)

    def _misfit(self, parameters: FloatArray) -> float:
        whitened = _whitened(self._factor, self.points.epsilon - self.at(self.points.speed, parameters))
        return float(np.sum(_rho(whitened**2, self.robust)))


def fitted(points: Points, model: Model, *, robust: bool = False) -> LawFit:
    """Fit a law to points.

    Raises
    ------
    ValueError
        If there are not more points than parameters, or all speeds are equal.
    """
    if len(points) < 3:
        raise ValueError(f"there are {len(points)} points with a speed and an eps: expected 3 or more")
    if np.ptp(points.speed) <= 1e-9 * points.speed.max():
        raise ValueError(
            f"all speeds are {points.speed[0]:.6g}: expected at least two different ones; `viscopade invert` gives "
            "the damping for one eps at one speed"
        )
    middle = float(np.exp(np.mean(np.log(points.speed))))
    # A free exponent may be positive or negative: the better of two searches counts.
    starts = [model.exponent] if model.exponent is not None else [0.2, -0.2]
    return min((_from(points, model, middle, start, robust) for start in starts), key=lambda fit: fit.misfit)


def _from(points: Points, model: Model, middle: float, start: float, robust: bool) -> LawFit:
    # kappa of all points gives b = kappa (v/v_0)^-p; their median is the first guess.
    kappa = model.kappa(np.clip(points.epsilon, 1e-6, 1.0), points.load(points.speed))
    guesses = kappa * (points.speed / middle) ** -start
    first = np.array([max(float(np.median(guesses)), 1e-9), start][: model.parameters])
    fit = LawFit(points, model, middle, first, float(np.std(points.epsilon)) + 1e-9, robust)
    lower, upper = np.array([0.0, _EXPONENTS[0]]), np.array([np.inf, _EXPONENTS[1]])
    for _ in range(_ROUNDS):
        # C depends on the law through G, and on s: fit the parameters for this C, then compute C again.
        measured = _band(points, fit)
        misfit = Misfit(measured, fit.residuals, points.counts, robust, points.resolution)
        scatter = 0.0 if points.known else misfit.scatter(model.parameters / len(points))
        factor = _cholesky(measured, scatter, points.counts)
        solution = optimize.least_squares(
            lambda values, fit=fit, factor=factor: _whitened(factor, points.epsilon - fit.at(points.speed, values)),
            fit.parameters,
            bounds=(lower[: model.parameters], upper[: model.parameters]),
            loss=_student if robust else "linear",
            x_scale="jac",
            xtol=1e-12,
            ftol=1e-12,
            gtol=1e-12,
        )
        before, fit = fit, LawFit(points, model, middle, solution.x, scatter, robust)
        moved = np.max(np.abs(fit.parameters - before.parameters) / (np.abs(fit.parameters) + 1e-9))
        if moved <= _CLOSE and abs(scatter - before.scatter) <= 1e-5 * (scatter + 1e-12):
            break
    return fit


# --- the band of the covariance ---------------------------------------------------------------------------------------


def _band(points: Points, fit: LawFit) -> FloatArray:
    """Return G G^T as its diagonals, the main one first."""
    low, high = (fit.at(points.speed * factor) for factor in np.exp([-_STEP, _STEP]))
    # E' = dE/d ln v/v
    slope = (high - low) / (2 * _STEP) / points.speed
    # G = d eps - E'(v) d v
    errors = points.epsilon_errors - points.speed_errors.multiply(slope[:, None]).tocsr()
    whole = errors @ errors.T
    rows, columns = whole.nonzero()
    width = int(np.max(rows - columns, initial=0))
    band = np.zeros((width + 1, len(points)))
    for k in range(width + 1):
        band[k, : len(points) - k] = whole.diagonal(-k)
    return band


def _covariance(factor: FloatArray, slopes: FloatArray, robust: bool) -> FloatArray:
    """Return the covariance of parameters on which eps depends with these slopes."""
    whitened = np.array([_whitened(factor, column) for column in slopes.T]).T
    # (J^T C^-1 J)^-1; columns are scaled to length 1, so that the inverse hardly depends on units.
    size = np.sqrt(np.sum(whitened**2, axis=0))
    size[size == 0] = 1.0
    # Ratio of the Fisher information of a Gaussian to that of Student's t of the same scale.
    scale = (_DEGREES + 3) / (_DEGREES + 1) if robust else 1.0
    return np.asarray(np.linalg.pinv((whitened / size).T @ (whitened / size)) / np.outer(size, size) * scale)


def _squared(scatter: float, counts: FloatArray | None) -> float | FloatArray:
    return scatter**2 if counts is None else scatter**2 / counts


def _cholesky(measured: FloatArray, scatter: float, counts: FloatArray | None) -> FloatArray:
    whole = measured.copy()
    whole[0] += _squared(scatter, counts)
    if len(whole) == 1:
        return np.asarray(np.sqrt(np.maximum(whole, _LEAST**2)))
    try:
        return np.asarray(linalg.cholesky_banded(whole, lower=True))
    except np.linalg.LinAlgError:
        raise ValueError(
            "the standard errors are 0 for some combination of points: expected a standard error for each point"
        ) from None


def _whitened(factor: FloatArray, values: FloatArray) -> FloatArray:
    """Return L^-1 of values."""
    if len(factor) == 1:
        return np.asarray(values / factor[0])
    return np.asarray(linalg.solve_banded((len(factor) - 1, 0), factor, values))


def _rho(squares: FloatArray, robust: bool) -> FloatArray:
    return (_DEGREES + 1) * np.log1p(squares / _DEGREES) if robust else squares


def _student(squares: FloatArray) -> FloatArray:
    """Return rho and its two derivatives, in SciPy's form."""
    # rho = (d + 1) ln(1 + u/d)
    inner = 1 + squares / _DEGREES
    slope = (_DEGREES + 1) / _DEGREES
    return np.array([(_DEGREES + 1) * np.log(inner), slope / inner, -slope / _DEGREES / inner**2])


@dataclass(frozen=True, eq=False)
class Misfit:
    """Residuals of a law, as a function D of the scatter."""

    measured: FloatArray
    residuals: FloatArray
    counts: FloatArray | None
    robust: bool
    resolution: float = 0.0

    def deviance(self, scatter: float, share: float) -> float:
        """Return D, with the factor `share` before ln det C."""
        try:
            factor = _cholesky(self.measured, scatter, self.counts)
        except ValueError:  # no scatter, and no error of some points
            return math.inf
        squares = _whitened(factor, self.residuals) ** 2
        return float(np.sum(_rho(squares, self.robust)) + 2 * share * np.sum(np.log(factor[0])))

    def scatter(self, taken: float) -> float:
        """Return the scatter that minimises D; `taken` is the number of parameters over that of points."""
        weights = 1.0 if self.counts is None else self.counts
        root = math.sqrt(float(np.mean(weights * self.residuals**2)))
        if not self.measured.any() and not self.robust:
            # s^2 = sum w r^2/(n - k)
            return max(root / math.sqrt(1 - taken), _LEAST)
        # With Student's t, equal values of rounded data would look like data without any scatter.
        # Rounding to a unit has the standard deviation 1/sqrt(12) of it.
        floor = max(1e-6 * root, self.resolution / math.sqrt(12)) if self.robust else 1e-6 * root
        # The search for ln s ends at ten times the root mean square, a choice.
        top, bottom = math.log(10 * max(root, floor) + _LEAST), math.log(floor + _LEAST)
        minimum = optimize.minimize_scalar(
            lambda log_scatter: self.deviance(math.exp(log_scatter), 1 - taken),
            bounds=(bottom, top),
            method="bounded",
            options={"xatol": 1e-7},
        )
        if self.measured[0].all() and self.deviance(0.0, 1 - taken) <= float(minimum.fun):
            return 0.0
        return math.exp(float(minimum.x))
