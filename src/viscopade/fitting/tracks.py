"""Coefficients of restitution of a body whose position was recorded over time, by a camera or a simulation.

Between contacts the body falls freely: its height is h - D(t - a), with the height h and the time a of the apex and the
distance D of `Flight.fall`. Each flight's h and a are fitted to its frames, without the frames of contacts. At the
point where the curves of two successive flights meet, their slopes are the speeds before and after the contact.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy import signal, sparse

from viscopade.arguments import without_unit
from viscopade.arrays.checked import Accepted, FloatArray, array
from viscopade.fitting.bounces import MOST_INSTANTS, TooFew
from viscopade.fitting.contacts import ContactTime, lasting, weight_speed
from viscopade.fitting.flight import Flight
from viscopade.fitting.points import Points

_FINITE = Accepted("a finite number", np.isfinite)
_ROUNDS, _CLOSE = 6, 1e-7  # number of Newton steps, and the relative size of the last one
_CLEAR = 8.0  # least rise after a contact, in standard errors
_LEAST_RISE = 0.01  # least rise after a contact, as a fraction of the range of positions
_OFF = 5.0  # standard errors: a frame farther off belongs to no free flight
_FEWEST = 5  # frames of a flight
_INNER = ((0.2, 0.75), (0.25, 0.75), (0.25, 0.8))  # parts of the first, other and last flights far from contacts
_SURE, _WRONG_UNIT = 0.2, 0.25  # relative errors of the acceleration: small enough, and due to a wrong unit
_USUAL_EPSILON = 0.8  # a guess; contact times hardly depend on it
_NORMAL = 0.6745  # median of the absolute value of a standard normal variable


@dataclass(frozen=True)
class _Curve:
    """Free flight fitted to frames: the time a and the height h of its apex, and their covariance for errors of 1."""

    flight: Flight
    apex: FloatArray
    covariance: FloatArray
    frames: slice

    def residuals(self, time: FloatArray, height: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the residuals at times, and the variances that frames outside the fit have for errors of 1."""
        distance, speed, _ = self.flight.fall(time - self.apex[0])
        slopes = np.stack([speed, np.ones_like(speed)])
        return height - self.apex[1] + distance, 1 + np.einsum("ik,ij,jk->k", slopes, self.covariance, slopes)


def of_track(
    time: FloatArray,
    position: FloatArray,
    labels: Sequence[str],
    flight: Flight,
    *,
    sigma: float | FloatArray = 0.0,
    contact_time: ContactTime = 0.0,
) -> Points:
    """Return the points of the contacts of a body that falls on a plane.

    Parameters
    ----------
    time, position : array
        In SI units, times in ascending order. Positions grow upward or downward.
    labels : sequence of str
        Names of the frames.
    flight : Flight
    sigma : float or array
        Standard errors of positions, whose mean square is used; if 0, the residuals give it.
    contact_time : float or Pair
        As for `bounces.of_times`.

    Raises
    ------
    ValueError
        If times do not ascend, or the body does not fall with this gravity.
    TooFew
        If no contact has a free flight before and after it.
    """
    time, position = (
        array(name, without_unit(name, values, unit), _FINITE)
        for name, values, unit in (("time", time, "s"), ("position", position, "m"))
    )
    sigma = np.asarray(without_unit("sigma", sigma, "m"), dtype=np.float64)
    if (late := np.diff(time) <= 0).any():
        raise ValueError(f"{labels[int(np.argmax(late)) + 1]}: the time is not later than the one before")
    if len(time) < 2 * _FEWEST:
        raise TooFew(f"the track has {len(time)} frames: expected {2 * _FEWEST} or more")
    noise = max(float(np.median(np.abs(np.diff(position, 3)))) / _NORMAL / 20**0.5, 1e-5 * float(np.ptp(position)))
    height = _upward(time, position, flight, noise)
    rise = max(_CLEAR * noise, _LEAST_RISE * float(np.ptp(height)))
    contacts = signal.find_peaks(-height, prominence=rise)[0]
    if len(contacts) > MOST_INSTANTS:
        raise ValueError(f"the track has {len(contacts)} contacts: expected up to {MOST_INSTANTS}")
    tops = np.array([height[i:j].max() for i, j in pairwise([0, *contacts])])
    fast, usual = np.sqrt(2 * flight.gravity * (tops - height[contacts])), np.full(len(contacts), _USUAL_EPSILON)
    of_weight = weight_speed(contact_time, flight.gravity, fast, usual)
    last = lasting(contact_time, fast, usual, of_weight)
    begin = [0, *np.searchsorted(time, time[contacts] + last).tolist()]
    end = [*np.searchsorted(time, time[contacts] - last).tolist(), len(time) - 1]
    kinds = [0, *[1] * (len(contacts) - 1), 2][: len(begin)]
    curves = [_curve(time, height, flight, part, noise) for part in zip(begin, end, kinds, strict=True)]
    fitted = [curve for curve in curves if curve]
    squares = [curve.residuals(time[curve.frames], height[curve.frames])[0] ** 2 for curve in fitted]
    free = sum(map(len, squares)) - 2 * len(fitted)
    of_residuals = float(np.sqrt(sum(square.sum() for square in squares) / max(free, 1)))
    error = float(np.sqrt(np.mean(np.square(sigma)))) or of_residuals
    pairs = [(k, a, b) for k, (a, b) in enumerate(pairwise(curves)) if a and b]
    if not pairs:
        raise TooFew(
            f"the track has {len(contacts)} contacts: expected one or more, with free flights before and after"
        )
    speed, epsilon = np.empty((2, len(pairs)))
    slopes = np.empty((2, len(pairs), 2, 2))  # of speed and eps, for each pair by the errors of both its curves
    for i, (k, before, after) in enumerate(pairs):
        speed[i], epsilon[i], of_apex = _collision(before, after, float(time[contacts[k]]), contact_time, of_weight)
        for j, curve in enumerate((before, after)):
            slopes[:, i, j] = of_apex[:, j] @ np.linalg.cholesky(curve.covariance) * error
    columns = np.array([[2 * k, 2 * k + 1, 2 * k + 2, 2 * k + 3] for k, _, _ in pairs])
    rows = np.repeat(np.arange(len(pairs)), 4)
    speed_errors, epsilon_errors = (
        sparse.csr_array((each.ravel(), (rows, columns.ravel())), shape=(len(pairs), 2 * len(curves)))
        for each in slopes
    )
    names = tuple(labels[contacts[k]] for k, _, _ in pairs)
    return Points(speed, epsilon, speed_errors, epsilon_errors, names, weight_speed=of_weight)


def _upward(time: FloatArray, position: FloatArray, flight: Flight, noise: float) -> FloatArray:
    """Return the positions as heights, by the sign of the acceleration, which is downward in most frames."""
    lag, acceleration, error = 1, 0.0, math.inf
    while not error < _SURE * abs(acceleration) and 4 * lag < len(time):
        low, middle, high = (slice(k, len(time) - 2 * lag + k) for k in (0, lag, 2 * lag))
        rates = [(position[b] - position[a]) / (time[b] - time[a]) for a, b in ((low, middle), (middle, high))]
        every = 2 * (rates[1] - rates[0]) / (time[high] - time[low])
        error = noise * math.sqrt(6) / float(np.median(time[high] - time[low]) / 2) ** 2
        moving = every[np.abs(every) > 3 * error]
        acceleration = float(np.median(moving)) if 3 * len(moving) > len(every) else 0.0  # fewer are contacts
        lag *= 2
    if not abs(abs(acceleration) / flight.gravity - 1) < _WRONG_UNIT:
        raise ValueError(
            f"the body falls with {abs(acceleration):.3g} m/s^2: expected about {flight.gravity:.3g}; are the units "
            "of time and position right? (--rate, --length-per-unit, --gravity)"
        )
    return position if acceleration < 0 else -position


def _curve(
    time: FloatArray, height: FloatArray, flight: Flight, part: tuple[int, int, int], noise: float
) -> _Curve | None:
    """Return the fit of a flight between two frames; None if it has too few.

    The fit begins with frames far from contacts and grows to both sides, up to the first frame that is off.
    """
    first, last, kind = part
    start, end = float(time[first]), float(time[last])
    if kind != 1:  # the body may be held at first and at the end: the height gives the time of its fall or rise
        fall = float(
            np.sqrt(2 * abs(height[first : last + 1].max() - height[last if kind == 0 else first]) / flight.gravity)
        )
        start, end = (max(start, end - fall), end) if kind == 0 else (start, min(end, start + fall))
    low, high = _INNER[kind]
    i, j = (int(np.searchsorted(time, start + part * (end - start))) for part in (low, high))
    curve = None
    while j - i >= _FEWEST:
        curve = _fitted(time, height, flight, slice(i, j), curve)
        off, variance = curve.residuals(time[first : last + 1], height[first : last + 1])
        good = np.abs(off) <= _OFF * noise * np.sqrt(variance)
        # The first flight does not grow backward: its first frames look like those of a body that is held.
        before, after = good[: i - first][::-1][: kind * len(good)], good[j - first : last - first]
        step = max((j - i) // 2, 2)  # as far as the fit predicts well
        left, right = (min(step, len(side) if side.all() else int(np.argmin(side))) for side in (before, after))
        if not left and not right:
            return curve
        i, j = i - left, j + right
    return None


def _fitted(time: FloatArray, height: FloatArray, flight: Flight, frames: slice, near: _Curve | None) -> _Curve:
    """Return a curve fitted to frames by Gauss-Newton steps, from a curve near it or from the parabola."""
    t, y = time[frames], height[frames]
    if near:
        apex = near.apex
    else:
        middle = t.mean()
        slope = np.polynomial.polynomial.polyfit(t - middle, y + flight.gravity * (t - middle) ** 2 / 2, 1)[1]
        apex = np.array([middle + slope / flight.gravity, y.max()])
    for _ in range(_ROUNDS):
        distance, speed, _ = flight.fall(t - apex[0])
        slopes = np.stack([speed, np.ones_like(speed)])
        covariance = np.linalg.inv(slopes @ slopes.T)
        change = covariance @ slopes @ (y - apex[1] + distance)
        apex = apex + change
        if abs(change[0]) * flight.gravity < _CLOSE * abs(speed).max():
            break
    return _Curve(flight, apex, covariance, frames)


def _collision(
    before: _Curve, after: _Curve, time: float, contact_time: ContactTime, of_weight: float
) -> tuple[float, float, FloatArray]:
    """Return the speed before a contact, eps, and the derivatives of both with respect to a and h of both flights."""
    last = 0.0
    for _ in range(_ROUNDS):
        t = np.array([time - before.apex[0], time + last - after.apex[0]])
        distance, speed, acceleration = before.flight.fall(t)
        gap = (before.apex[1] - distance[0]) - (after.apex[1] - distance[1])
        time += gap / (speed[0] - speed[1])
        last = float(lasting(contact_time, speed[:1], -speed[1:] / speed[:1], of_weight)[0])
    epsilon = -speed[1] / speed[0]
    of_time = np.array([[speed[0], 1.0], [-speed[1], -1.0]]) / (speed[0] - speed[1])
    of_speed = acceleration[0] * (of_time - [[1, 0], [0, 0]])
    of_rebound = -acceleration[1] * (of_time - [[0, 0], [1, 0]])
    return float(speed[0]), float(epsilon), np.array([of_speed, (of_rebound - epsilon * of_speed) / speed[0]])
