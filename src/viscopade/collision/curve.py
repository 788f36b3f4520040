r"""The exact functions of any law of contact in double precision, on NumPy arrays.

`curve` reads the table of a named law, which is a record of the package, and makes the table of another law when it is
first needed. With s = ln kappa,

    L(s) = ln((1 - eps)/eps) - s,    X(s) = ln x_max,    T(s) = tau_c/x_max

are smooth, and constant for small kappa. For large kappa ln eps, X and T are straight lines.
Between these ends they are interpolated by Chebyshev polynomials on panels, and L likewise as a function of
ln((1 - eps)/eps), for the inverse.

The values at the nodes come from collisions at chosen k, so no equation is solved for them: ln kappa itself is first
interpolated as a function of ln k. Errors are sampled (`ERROR`), in contrast to `exact.collision`, which proves digits.
For the paper's law `arrays.double` is more accurate.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial import chebyshev

from viscopade.arrays import checked
from viscopade.arrays.checked import Accepted, FloatArray, Values
from viscopade.collision import exact
from viscopade.collision.flow import Motion
from viscopade.progress import track
from viscopade.store import recorded
from viscopade.theory.law import Law, law_of

ERROR = 2e-13
"""Largest relative error of all results (sampled: tests/collision/test_curve.py)."""

# NODES, PANELS and NARROWEST are choices: panels are halved until the last coefficients are small whatever they are.
NODES = 28  # on a panel
PANELS = 6  # number of panels before any is halved
SMALL = 1e-14  # size of the last coefficients, relative to the largest one, or to 1: about 50 roundings
NARROWEST = 2.0**-8  # length of a panel; what is not smooth down there is noise
# Below ln kappa = -CONSTANT times a power, L, X and T are constant to double precision: e^-38 = 3e-17 < 2^-53.
CONSTANT = 38.0
STRAIGHT = 48.0  # beyond ln k = STRAIGHT/2 they are straight lines, up to terms of order ln k/k^2: e^-48 = 1e-21
BISECTIONS = 24  # before steps by the slope of a secant: to 2^-25 of the span
STEP = 2.0**-12  # for differences: their error is the square, 6e-8, and only the slope of Newton's method has it
# End of the table if contact ends against an attractive force: a choice, because slower bodies creep back to x = 0,
# which takes ever more pieces to integrate.
LEAST_EPSILON = "1e-3"

_PORTIONS = Accepted("a number >= 0 and <= 1", lambda x: (x >= 0) & (x <= 1))


@dataclass(frozen=True)
class Interpolant:
    """Functions interpolated by Chebyshev polynomials on panels; constant before them, straight lines after them.

    Attributes
    ----------
    ends : tuple of float
        Ends of the panels, ascending.
    coefficients : tuple
        For each function and panel, the coefficients of the Chebyshev polynomials.
    slopes : tuple of float
        For each function, its slope after the last panel.
    """

    ends: tuple[float, ...]
    coefficients: tuple[tuple[tuple[float, ...], ...], ...]
    slopes: tuple[float, ...]

    def __call__(self, function: int, s: FloatArray) -> FloatArray:
        """Return the values of a function, by its number, at places s."""
        # The panel of each place, and z from -1 to 1 on it. `searchsorted` counts the ends up to a place: panel i
        # begins at end i, and there is one panel less than ends. Places outside get the value of the first or last end,
        # and behind the last end the slope.
        ends, table = np.array(self.ends), np.array(self.coefficients[function]).T
        inside = np.clip(s, ends[0], ends[-1])
        panel = np.clip(np.searchsorted(ends, inside, side="right") - 1, 0, len(ends) - 2)
        low, high = ends[panel], ends[panel + 1]
        z = (2 * inside - low - high) / (high - low)
        slope, value = self.slopes[function], np.asarray(chebyshev.chebval(z, table[:, panel], tensor=False))
        return value + slope * np.maximum(s - ends[-1], 0) if slope else value


@dataclass(frozen=True)
class Tables:
    """Tables of a law for `curve`.

    Attributes
    ----------
    of_s : Interpolant
        L, X and T as functions of s = ln kappa.
    of_odds : Interpolant
        -L as a function of ln((1 - eps)/eps).
    """

    of_s: Interpolant
    of_odds: Interpolant


class Curve:
    """The functions of one law: eps, 1 - eps, x_max and tau_c of kappa, and kappa of eps.

    Each method takes a number, a list or an array, and returns a float or an array with relative errors of at most
    `ERROR` (sampled). It raises TypeError for anything except real numbers, and ValueError for a number that is
    negative, NaN, or beyond `kappa_max`.

    Attributes
    ----------
    law : Law
    kappa_max : float
        Largest kappa of eps: infinite, except for an end at x = 0 against an attractive force.
    kappa_max_of_course : float
        Largest kappa of x_max and tau_c: finite for an end at x = 0, because contact then takes longer and longer.
    """

    def __init__(self, law: Law, tables: Tables) -> None:
        """Keep a law's tables. Attractive laws have no eps, others no x_max and tau_c, beyond the last panel."""
        self.law, self._tables = law, tables
        self._decay = 1.0 if law.decay is None else float(law.decay)  # None: kappa never exceeds the last panel
        last = math.exp(tables.of_s.ends[-1])
        self.kappa_max = last if Motion.from_law(law).attractive else math.inf
        self.kappa_max_of_course = math.inf if law.delayed else last

    def epsilon(self, kappa: Values) -> Values:
        """Return the coefficient of restitution at kappa >= 0."""
        return self._function_of_kappa(lambda s: 1 / (1 + np.exp(self._log_odds(s))), kappa, self.kappa_max)

    def one_minus_epsilon(self, kappa: Values) -> Values:
        """Return 1 - eps, without cancellation at small kappa."""
        return self._function_of_kappa(lambda s: 1 / (1 + np.exp(-self._log_odds(s))), kappa, self.kappa_max)

    def x_max(self, kappa: Values) -> Values:
        """Return the maximal compression in units of `Law.length_scale`."""
        return self._function_of_kappa(lambda s: np.exp(self._tables.of_s(1, s)), kappa, self.kappa_max_of_course)

    def tau_c(self, kappa: Values) -> Values:
        """Return the contact's duration in units of `Law.time_scale`."""
        return self._function_of_kappa(self._tau_c, kappa, self.kappa_max_of_course)

    def kappa_from(self, epsilon: Values | None = None, *, one_minus_epsilon: Values | None = None) -> Values:
        """Return the kappa whose coefficient of restitution is `epsilon`, or one minus `one_minus_epsilon`.

        Raises
        ------
        TypeError
            If not exactly one of the two is given.
        """
        if (epsilon is None) == (one_minus_epsilon is None):
            raise TypeError("expected exactly one of epsilon and one_minus_epsilon")
        # `elementwise` checks the numbers, and applies a function of arrays to a number, a list or an array.
        if epsilon is not None:
            return checked.elementwise(lambda e: self._kappa(1 - e, e), "epsilon", epsilon, self._portions(False))
        assert one_minus_epsilon is not None
        return checked.elementwise(
            lambda loss: self._kappa(loss, 1 - loss), "one_minus_epsilon", one_minus_epsilon, self._portions(True)
        )

    def _portions(self, loss: bool) -> Accepted:
        """Return which eps, or which 1 - eps if `loss`, the tables reach."""
        # From 0 to 1, or eps >= LEAST_EPSILON against an attractive force.
        if not Motion.from_law(self.law).attractive:
            return _PORTIONS
        least = float(LEAST_EPSILON)
        if loss:
            return Accepted(f"a number >= 0 and <= {1 - least}", lambda x: (x >= 0) & (x <= 1 - least))
        return Accepted(f"a number >= {least} and <= 1", lambda x: (x >= least) & (x <= 1))

    def _function_of_kappa(self, function: Callable[[FloatArray], FloatArray], kappa: Values, largest: float) -> Values:
        """Return a function of s = ln kappa at kappa from 0 to `largest`."""
        accepted = Accepted(
            "a number >= 0, or inf"
            if largest == math.inf
            else f"a number >= 0 and <= {largest:.6g}, for the law {self.law} with end {self.law.end!r}",
            lambda x: (x >= 0) & (x <= largest),
        )

        # kappa = 0 and infinity have s = -inf and inf, where the functions have their limits.
        def from_kappa(kappa: FloatArray) -> FloatArray:
            with np.errstate(divide="ignore", over="ignore", under="ignore", invalid="ignore"):
                return function(np.log(kappa))

        return checked.elementwise(from_kappa, "kappa", kappa, accepted)

    def _log_odds(self, s: FloatArray) -> FloatArray:
        """Return ln((1 - eps)/eps) at s = ln kappa."""
        # Up to the last panel s + L(s). Beyond, eps falls like kappa^-decay: ln eps is a straight line from its value
        # there, ln eps = -ln(1 + e^odds), and ln((1 - eps)/eps) = ln(-expm1(ln eps)) - ln eps.
        last = np.array(self._tables.of_s.ends[-1])
        near = np.where(s == -np.inf, s, np.minimum(s, last) + self._tables.of_s(0, s))
        log_epsilon = -np.logaddexp(0, near) - self._decay * np.maximum(s - last, 0)
        return np.where(s <= last, near, np.log(-np.expm1(log_epsilon)) - log_epsilon)

    def _tau_c(self, s: FloatArray) -> FloatArray:
        """Return tau_c = x_max T at s = ln kappa; its limit for infinite kappa is 0."""
        table = self._tables.of_s  # L, ln x_max and tau_c/x_max
        return np.where(s == np.inf, 0.0, np.exp(table(1, s)) * table(2, s))

    def _kappa(self, loss: FloatArray, epsilon: FloatArray) -> FloatArray:
        """Return kappa from `loss` = 1 - eps and `epsilon`, of which the smaller one must be accurate."""
        # ln kappa = odds - L up to the last panel; beyond, ln eps falls by decay for each ln kappa, as in `_log_odds`.
        with np.errstate(divide="ignore", over="ignore", under="ignore", invalid="ignore"):
            log_odds = np.log(loss) - np.log(epsilon)
            last = np.array(self._tables.of_odds.ends[-1])
            near = np.minimum(log_odds, last) + self._tables.of_odds(0, log_odds)
            beyond = np.maximum(np.logaddexp(0, log_odds) - np.logaddexp(0, last), 0) / self._decay
            return np.exp(np.where(np.isinf(log_odds), log_odds, near + beyond))


def curve(law: Law | str) -> Curve:
    """Return the functions of a law of contact in double precision.

    The tables of the named laws come with the package. For another law, the first call takes seconds to a minute.

    Parameters
    ----------
    law : Law or str
        Law of contact, or its name or exponents (`law_of`).

    Raises
    ------
    TypeError, ValueError
        If the law is not known.

    Examples
    --------
    >>> import viscopade as vp
    >>> vp.curve("hunt-crossley").epsilon([0, 1, 10]).round(12).tolist()
    [1.0, 0.59362426004, 0.099981624753]
    """
    return _curve(law_of(law))


@lru_cache(maxsize=32)
def _curve(law: Law) -> Curve:
    return Curve(law, curve_tables(law))


@recorded("curve_tables")
def curve_tables(law: Law) -> Tables:
    """Return the tables of a law, made from collisions at chosen k (`exact.at_k`)."""
    # At ln k: ln(kappa/k), L, ln x_max and tau_c/x_max. From them ln kappa and ln((1 - eps)/eps), which grow with ln k.
    power = 1 / float(law.damping + 1)
    span = np.array(_ends_of_k(law))
    functions_of_k = interpolant(lambda log_k: np.array([exact.at_k(x, law) for x in log_k]).T, span)

    def log_kappa(log_k: FloatArray) -> FloatArray:
        """Return ln kappa."""
        return log_k + functions_of_k(0, log_k)

    def log_odds(log_k: FloatArray) -> FloatArray:
        """Return ln((1 - eps)/eps) = ln kappa + L."""
        return log_kappa(log_k) + functions_of_k(1, log_k)

    def functions_of_s(s: FloatArray) -> FloatArray:
        """Return L, X and T at s = ln kappa, the functions 1 to 3 of `at_k`."""
        log_k = _solved(log_kappa, s, span)
        return np.array([functions_of_k(i, log_k) for i in (1, 2, 3)])

    def minus_l_of_odds(odds: FloatArray) -> FloatArray:
        """Return -L at ln((1 - eps)/eps), as an array of one function."""
        return -functions_of_k(1, _solved(log_odds, odds, span))[None]

    # For large kappa ln x_max falls like -power ln kappa, power = 1/(b+1), and tau_c/x_max grows by 2 nu power for each
    # ln kappa (the time of creep); L is not used there (`Curve._log_odds`).
    table_of_s = interpolant(functions_of_s, log_kappa(span), (0.0, -power, 2 * float(law.nu) * power))
    return Tables(table_of_s, interpolant(minus_l_of_odds, log_odds(span)))


def _ends_of_k(law: Law) -> tuple[float, float]:
    """Return the table's ends in ln k for a law.

    At the first, L, X and T become constant; at the last, they become straight lines, or contact no longer ends.
    """
    motion = Motion.from_law(law)
    # The first corrections are of order kappa or, with delayed recovery, kappa^(n_b/d) of L and r_c^m of T.
    slow = CONSTANT * max(1.0, law.d / law.n_b, motion.d / motion.m)
    first = exact.log_k_of(-slow, law)
    if law.delayed:
        return first, STRAIGHT / 2
    if motion.attractive:
        return first, exact.log_k_of_epsilon(LEAST_EPSILON, law)
    # The effect of the initial motion on creeping bodies decays like exp(-k^2/(2 n)).
    return first, math.log(2 * max(motion.n_b, 2 * motion.n_b - motion.n_a) * CONSTANT) / 2


def _solved(function: Callable[[FloatArray], FloatArray], target: FloatArray, span: FloatArray) -> FloatArray:
    """Return x within the ends `span` with function(x) = target, for an increasing function.

    By bisection, then by the secant's slope; `target` is an array.
    """
    low, high = (np.full_like(target, end) for end in span)
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        below = function(middle) < target
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    x = (low + high) / 2
    # Two steps of Newton's method, with a central difference as the slope: from 2^-25 each squares the error, and a
    # slope off by 1e-7 adds 7 digits.
    for _ in range(2):
        inside = np.clip(x, *(span + np.array([1, -1]) * STEP))
        slope = (function(inside + STEP) - function(inside - STEP)) / (2 * STEP)
        x = np.clip(x + (target - function(x)) / slope, *span)
    return x


def interpolant(
    functions: Callable[[FloatArray], FloatArray], span: FloatArray, slopes: tuple[float, ...] = ()
) -> Interpolant:
    """Return functions interpolated over `span`, its two ends, on panels that are halved until it is accurate.

    `functions` returns an array whose first axis is the function. `slopes` are those behind the last panel, or 0.
    """
    # Chebyshev coefficients from values at the Chebyshev nodes: c_k = 2/N sum_j f(cos t_j) cos(k t_j), half for k = 0.
    angles = np.pi * (np.arange(NODES) + 0.5) / NODES
    transform = 2 / NODES * np.cos(np.outer(np.arange(NODES), angles))
    transform[0] /= 2
    starts = np.linspace(span[0], span[1], PANELS + 1)
    ends, panels = [float(span[0])], list[FloatArray]()
    for i in track(range(PANELS), "panels"):
        waiting = [(starts[i], starts[i + 1])]
        while waiting:
            left, right = waiting.pop()
            values = functions((left + right) / 2 + (right - left) / 2 * np.cos(angles))
            coefficients = values @ transform.T
            size = np.maximum(np.abs(coefficients).max(axis=1), 1.0)
            # The last two coefficients estimate the error: one of them vanishes for even or odd functions.
            if (np.abs(coefficients[:, -2:]).max(axis=1) > SMALL * size).any() and right - left > NARROWEST:
                waiting += [((left + right) / 2, right), (left, (left + right) / 2)]
                continue
            ends.append(float(right))
            panels.append(coefficients)
    rows = np.array(panels).transpose(1, 0, 2).tolist()
    table = tuple(tuple(tuple(row) for row in function) for function in rows)
    return Interpolant(tuple(ends), table, slopes or (0.0,) * len(table))
