"""Coefficients of restitution of a body whose position was recorded over time, by a camera or a simulation.

Between contacts the body falls freely: its height is h - s D(t - a), with the height h and the time a of the apex, the
distance D of `Flight.fall`, and a scale s, which is 1 if the units are right. A flight is a run of frames that obey
such a curve with the acceleration s g that most flights share; frames in which the body is held do not. At the point
where the curves of two successive flights meet, their slopes are the speeds before and after the contact.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy import sparse

from viscopade.arguments import without_unit
from viscopade.arrays.checked import Accepted, FloatArray, array
from viscopade.fitting.bounces import MOST_INSTANTS, TooFew
from viscopade.fitting.contacts import ContactTime, lasting, weight_speed
from viscopade.fitting.flight import Flight
from viscopade.fitting.points import Points
from viscopade.quantity import uncertain

FEWEST = 5
"""Smallest number of frames of a flight."""

_FINITE = Accepted("a finite number", np.isfinite)
_ROUNDS, _CLOSE = 6, 1e-7  # number of Newton steps, and the relative size of the last one: choices
_OFF = 5.0  # standard errors: a frame farther off belongs to no free flight; a choice
_CURVED = 5.0  # standard errors of the acceleration of a body that falls, and is not held; a choice
_SAME = 3.0, 0.15  # standard errors, and relative difference, of accelerations that flights share; choices
_DIFFERENT = 3.0  # standard errors by which the acceleration differs from g because of a wrong unit; a choice
_CLEAR = (
    8.0,
    0.01,
)  # least rise after a contact, in standard errors and as a fraction of the range of positions; choices
_GAP = 3.5, 0.1  # frames, and part of a flight, that lie between two flights and belong to a contact; choices
_JITTER = 0.1  # of the time from frame to frame, besides its last digit; a choice
_USUAL_EPSILON = 0.8  # a guess; contact times hardly depend on it
_MOVING = 0.1  # of large displacements in three frames: smaller ones are those of a body that is held; a choice
_QUANTILE, _OF_NORMAL = 0.3, 0.3853  # of third differences, most of which lie in flights; that of |z| for a normal z


@dataclass(frozen=True)
class FreeFlight:
    """A flight of a track: the labels of its first and last frame, its acceleration and the standard error of this."""

    first: str
    last: str
    acceleration: float
    standard_error: float


@dataclass(frozen=True)
class Track:
    """Contacts in a track, and the flights between them.

    Attributes
    ----------
    points : Points
    flights : tuple of FreeFlight
    left_out : tuple
        Labels of contacts that give no eps, each with the reason.
    acceleration, standard_error : float
        That of all flights together.
    agrees : bool
        Whether it agrees with g. If not, the speeds have a wrong unit, and eps is fitted with this acceleration.
    """

    points: Points
    flights: tuple[FreeFlight, ...]
    left_out: tuple[tuple[str, str], ...]
    acceleration: float
    standard_error: float
    agrees: bool

    def warning(self, gravity: float, length: float, rate: float | None) -> str:
        """Return a warning that the acceleration is not g, for positions in units of a length, at a frame rate."""
        # The positions are too small by g/a; or the frames come faster by its root, because a ~ length/time^2.
        ratio = gravity / self.acceleration
        frames = f", or --rate {rate * math.sqrt(ratio):.4g}," if rate else ""
        measured = f"{uncertain(self.acceleration, self.standard_error)} m/s^2, not {gravity:.4g}"
        scale = f"--length-per-unit '{1000 * length * ratio:.3g} mm'{frames} gives this"
        return (
            f"the flights accelerate with {measured}: {scale}; "
            "eps is fitted with their own acceleration, but the speeds are wrong if gravity is right"
        )


@dataclass(frozen=True)
class _Parabola:
    """Parabola c_0 + c_1 (t - m) + c_2 (t - m)^2 of a run of frames, with the covariance for errors of 1."""

    frames: slice
    middle: float
    c: FloatArray
    covariance: FloatArray
    residual: float  # the root of the sum of squares
    passed: float  # the height that a body with this acceleration falls in this time

    @classmethod
    def fitted(cls, time: FloatArray, height: FloatArray, frames: slice) -> _Parabola:
        """Fit a parabola to frames."""
        # Least squares in powers of t - m, 1 to t^2: the pseudoinverse P gives c = P y, and its covariance is P P^T.
        t = time[frames] - time[frames].mean()
        powers = np.vander(t, 3, increasing=True)
        inverse = np.linalg.pinv(powers)
        c = inverse @ height[frames]
        residual = float(np.linalg.norm(height[frames] - powers @ c))
        middle, passed = float(time[frames].mean()), float(abs(c[2]) * np.ptp(t) ** 2)
        return cls(frames, middle, c, inverse @ inverse.T, residual, passed)

    def obeyed(self, time: FloatArray, height: FloatArray, noise: float) -> FloatArray:
        """Return whether frames obey it."""
        powers = np.vander(time - self.middle, 3, increasing=True)
        # The variance of a frame outside the fit: 1 of the frame, and that of the parabola.
        variance = 1 + np.einsum("ki,ij,kj->k", powers, self.covariance, powers)
        return np.asarray(np.abs(height - powers @ self.c) <= _OFF * noise * np.sqrt(variance))

    def slope(self, time: float) -> tuple[float, float]:
        """Return its slope, and the standard error of this for errors of 1."""
        powers = np.array([0, 1, 2 * (time - self.middle)])
        return float(powers @ self.c), math.sqrt(powers @ self.covariance @ powers)

    @property
    def acceleration(self) -> float:
        """Its second derivative."""
        # h'' = 2 c_2
        return float(2 * self.c[2])

    @property
    def error(self) -> float:
        """Standard error of the acceleration for errors of 1."""
        return float(2 * math.sqrt(self.covariance[2, 2]))


@dataclass(frozen=True)
class _Curve:
    """Free flight fitted to frames: the time a and the height h of its apex, and their covariance for errors of 1."""

    flight: Flight
    apex: FloatArray
    covariance: FloatArray
    frames: slice

    def residuals(self, time: FloatArray, height: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the residuals at times, and the variances that frames outside the fit have for errors of 1."""
        # r = y - (h - D(t - a)); the curve's derivatives are D' with respect to a, and 1 to h
        distance, speed, _ = self.flight.fall(time - self.apex[0])
        slopes = np.stack([speed, np.ones_like(speed)])
        return height - self.apex[1] + distance, 1 + np.einsum("ik,ij,jk->k", slopes, self.covariance, slopes)


class _Contact(NamedTuple):
    """A contact: its beginning, the speed before it, eps, and the derivatives of both by a and h of both flights."""

    time: float
    speed: float
    epsilon: float
    slopes: FloatArray


def frame_times(time: FloatArray, labels: Sequence[str], digit: float) -> FloatArray:
    """Return the times of frames without the rounding to their last digit, if they are those of a fixed rate.

    Raises
    ------
    ValueError
        If they are not evenly spaced, up to their last digit and gaps of whole frames.
    """
    spans, reason = np.diff(time), f"there are {len(time)} frames"
    frame = float(np.median(spans)) if len(spans) else 0.0
    off = np.abs(spans - frame * np.maximum(np.round(spans / frame), 1)) if frame > 0 else np.ones_like(spans)
    if (uneven := off > digit + _JITTER * frame).any():
        k = int(np.argmax(uneven))
        reason = f"{labels[k + 1]} is {spans[k]:.3g} s after the one before, usually it is {frame:.3g} s"
    if len(time) < 2 * FEWEST or uneven.any():
        raise ValueError(
            f"{reason}: expected {2 * FEWEST} or more evenly spaced frames of a track; --column position=- reads the "
            "times of bounces alone, and --column time=- the heights alone"
        )
    # A fixed rate is a straight line through the times of numbered frames, within their last digit.
    frame = float(spans[spans < 1.5 * frame].mean())
    number = np.append(0.0, np.cumsum(np.maximum(np.round(spans / frame), 1)))
    regular = np.polynomial.Polynomial.fit(number, time, 1)(number)
    return np.asarray(regular) if np.abs(regular - time).max() <= digit else time


def of_track(
    time: FloatArray,
    position: FloatArray,
    labels: Sequence[str],
    flight: Flight,
    *,
    sigma: float | FloatArray = 0.0,
    contact_time: ContactTime = 0.0,
) -> Track:
    """Return the contacts of a body that falls on a plane, and its flights.

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
        If times do not ascend, or there are too many contacts.
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
    if len(time) < 2 * FEWEST:
        raise TooFew(f"the track has {len(time)} frames: expected {2 * FEWEST} or more")

    # Runs of frames that obey a parabola; those that share the acceleration of most are flights.
    noise = _noise(position)
    runs = _falling(time, position, noise)
    if not runs:
        raise TooFew("the track has no free flight: expected frames that obey a parabola")
    common = float(np.median([run.acceleration for run in runs]))
    height = position if common < 0 else -position
    runs = _flights(time, height, [_Parabola.fitted(time, height, run.frames) for run in runs], noise)

    # Each flight is fitted with their acceleration, and again with g, or with what the fits give if that is not g.
    # Between flights, the lowest frame is left out at first; then frames belong to the flight on their side.
    scale, frame = abs(common) / flight.gravity, float(np.median(np.diff(time)))
    instants = _lows(time, height, runs)
    for fewest in (FEWEST - 2, FEWEST):
        scaled = replace(flight, gravity=scale * flight.gravity, terminal_speed=scale * flight.terminal_speed)
        curves, unit_load_speed = _curves(time, height, scaled, runs, instants, noise, contact_time, fewest)
        if not any(curves):
            raise TooFew(f"the track has no free flight of {FEWEST} frames or more")
        pairs = []
        for k, (before, after) in enumerate(pairwise(curves)):
            meet = before and after and _follows(time, before.frames, after.frames)
            if before and after and meet and before.apex[0] < instants[k] < after.apex[0]:
                contact = _collision(before, after, instants[k], contact_time, unit_load_speed)
                if abs(contact.time - instants[k]) <= 2 * frame and contact.epsilon > 0:
                    pairs.append((k, contact))
                    instants[k] = contact.time
        flights, error = _accelerations([curve for curve in curves if curve], time, height, labels)
        # The weighted mean of accelerations; its error grows if they scatter more than their errors.
        weights, accelerations = np.array([[f.standard_error**-2, f.acceleration] for f in flights]).T
        mean = float(weights @ accelerations / weights.sum())
        spread = float(weights @ (accelerations - mean) ** 2) / max(len(accelerations) - 1, 1)
        mean_error = math.sqrt(max(spread, 1.0) / float(weights.sum()))
        agrees = abs(mean - flight.gravity) <= _DIFFERENT * mean_error
        scale = 1.0 if agrees else mean / flight.gravity
    error = float(np.sqrt(np.mean(np.square(sigma)))) or error

    left_out = _without_epsilon(time, height, labels, curves, [contact.time for _, contact in pairs], noise)
    if len(pairs) > MOST_INSTANTS:
        raise ValueError(f"the track has {len(pairs)} contacts: expected up to {MOST_INSTANTS}")
    if not pairs:
        why = "".join(f"; {label}: {reason}" for label, reason in left_out[:3])
        raise TooFew(f"no contact has a free flight of {FEWEST} frames or more before and after it{why}")

    # The errors of both curves, by their parameters, give those of the speed and of eps; a measured acceleration has an
    # error, too, which g has not.
    gravity_ratio = 1.0 if agrees else 1 + mean_error / mean
    other = replace(
        scaled, gravity=gravity_ratio * scaled.gravity, terminal_speed=gravity_ratio * scaled.terminal_speed
    )
    slopes, changes = np.empty((2, len(pairs), 2, 2)), np.empty((2, len(pairs)))
    for i, (k, contact) in enumerate(pairs):
        both = [curve for curve in curves[k : k + 2] if curve]
        for j, curve in enumerate(both):
            slopes[:, i, j] = contact.slopes[:, j] @ np.linalg.cholesky(curve.covariance) * error
        before, after = (_fitted(time, height, other, curve.frames, curve) for curve in both)
        again = _collision(before, after, contact.time, contact_time, unit_load_speed)
        changes[:, i] = (again.speed - contact.speed, again.epsilon - contact.epsilon) if gravity_ratio > 1 else 0.0
    columns = np.array([[2 * k, 2 * k + 1, 2 * k + 2, 2 * k + 3] for k, _ in pairs])
    rows, shape = np.repeat(np.arange(len(pairs)), 4), (len(pairs), 2 * len(curves))
    speed_errors, epsilon_errors = (
        sparse.hstack(
            [sparse.csr_array((derivatives.ravel(), (rows, columns.ravel())), shape), sparse.diags_array(change)]
        )
        for derivatives, change in zip(slopes, changes, strict=True)
    )
    speed, epsilon, instant = np.array([[contact.speed, contact.epsilon, contact.time] for _, contact in pairs]).T
    names = tuple(labels[int(np.argmin(np.abs(time - t)))] for t in instant)
    errors = (sparse.csr_array(speed_errors), sparse.csr_array(epsilon_errors))
    points = Points(speed, epsilon, *errors, names, weight_speed=unit_load_speed)
    return Track(points, tuple(flights), tuple(left_out), mean, mean_error, agrees)


def _noise(position: FloatArray) -> float:
    """Return the standard error of positions, from third differences, to which a parabola adds nothing.

    A body that is held may be seen more sharply, so only frames in which it moves count. Differences across a contact
    are large: a low quantile leaves them out.
    """
    # A third difference of errors sigma has the variance (1 + 9 + 9 + 1) sigma^2.
    third, moved = np.abs(np.diff(position, 3)), np.abs(position[3:] - position[:-3])
    moving = third[moved > _MOVING * np.quantile(moved, 0.9)]
    noise = float(np.quantile(moving if len(moving) else third, _QUANTILE)) / _OF_NORMAL / math.sqrt(20)
    return max(noise, 1e-5 * float(np.ptp(position)))


def _runs(time: FloatArray, height: FloatArray, noise: float) -> list[_Parabola]:
    """Return successive runs of frames that obey a parabola, from the first frame on, each as long as possible."""
    runs, i = [], 0
    while i + FEWEST <= len(time):
        run = _Parabola.fitted(time, height, slice(i, i + FEWEST))
        if run.residual > _OFF * noise:
            i += 1
            continue
        while (j := run.frames.stop) < len(time):
            ahead = slice(j, j + max((j - i) // 2, 1))  # as far as the fit predicts well
            good = run.obeyed(time[ahead], height[ahead], noise)
            if not good[0]:
                break
            run = _Parabola.fitted(time, height, slice(i, j + (len(good) if good.all() else int(np.argmin(good)))))
        runs.append(run)
        i = run.frames.stop - 1  # the frame of a contact may belong to both flights
    return runs


def _falling(time: FloatArray, height: FloatArray, noise: float) -> list[_Parabola]:
    """Return the runs with the acceleration that most runs share, counted by the heights that they pass through.

    Frames of a contact may lie at the ends of a run: then its inner part has this acceleration.
    """
    curved = [run for run in _runs(time, height, noise) if abs(run.acceleration) > _CURVED * noise * run.error]
    cores = [_Parabola.fitted(time, height, part) for part in _inner(curved)]
    groups = []
    for run in curved:
        within = max(_SAME[0] * noise * run.error, _SAME[1] * abs(run.acceleration))
        near = [
            any(abs(part.acceleration - run.acceleration) < within + noise * part.error for part in parts)
            for parts in zip(curved, cores, strict=True)
        ]
        groups.append([other for other, agrees in zip(curved, near, strict=True) if agrees])
    return max(groups, key=lambda group: sum(run.passed for run in group), default=[])


def _follows(time: FloatArray, before: slice, after: slice) -> bool:
    """Return whether only the frames of a contact lie between two flights."""
    start, end = time[before.stop - 1], time[after.start]
    shorter = min(start - time[before.start], time[after.stop - 1] - end)
    return bool(end - start <= _GAP[0] * np.median(np.diff(time)) + _GAP[1] * shorter)


def _flights(time: FloatArray, height: FloatArray, runs: Sequence[_Parabola], noise: float) -> list[_Parabola]:
    """Return the runs as whole flights: two runs without a contact between them are one."""
    flights: list[_Parabola] = []
    for run in runs:
        if flights and _follows(time, flights[-1].frames, run.frames):
            middle = (time[flights[-1].frames.stop - 1] + time[run.frames.start]) / 2
            (before, error), (after, other) = flights[-1].slope(middle), run.slope(middle)
            if not before < 0 < after or after - before < _OFF * noise * math.hypot(error, other):
                flights[-1] = _Parabola.fitted(time, height, slice(flights[-1].frames.start, run.frames.stop))
                continue
        flights.append(run)
    return flights


def _inner(runs: Sequence[_Parabola]) -> list[slice]:
    """Return the frames of runs that are far from contacts."""
    lengths = [run.frames.stop - run.frames.start for run in runs]
    cut = [length // 4 if length >= 2 * FEWEST else int(length > FEWEST) for length in lengths]
    return [slice(run.frames.start + n, run.frames.stop - n) for run, n in zip(runs, cut, strict=True)]


def _lows(time: FloatArray, height: FloatArray, runs: Sequence[_Parabola]) -> list[float]:
    """Return the instants of the lowest frames between successive runs."""
    between = [slice(one.stop - 1, max(two.start, one.stop) + 1) for one, two in pairwise(_inner(runs))]
    return [float(time[gap.start + int(np.argmin(height[gap]))]) for gap in between]


def _curves(
    time: FloatArray,
    height: FloatArray,
    flight: Flight,
    runs: Sequence[_Parabola],
    instants: Sequence[float],
    noise: float,
    contact_time: ContactTime,
    fewest: int,
) -> tuple[list[_Curve | None], float]:
    """Return the curve of each flight, None if it has too few frames, and the speed at which the load is 1."""
    fast = np.array([abs(run.slope(instant)[0]) for run, instant in zip(runs, instants, strict=False)])
    usual = np.full(len(fast), _USUAL_EPSILON)
    unit_load_speed = weight_speed(contact_time, flight.gravity, fast, usual) if len(fast) else 0.0
    last = lasting(contact_time, fast, usual, unit_load_speed)
    begin = [0, *np.searchsorted(time, instants + last, side="right").tolist()]
    end = [*np.searchsorted(time, instants - last).tolist(), len(time)]
    curves: list[_Curve | None] = []
    for part, low, high in zip(_inner(runs), begin, end, strict=True):
        curve = _grown(time, height, flight, part, low, high, noise)
        # After a body was held, the flight does not grow backward: its first frames look like those before.
        follows = curve and curves and curves[-1] and _follows(time, curves[-1].frames, curve.frames)
        if not follows:
            curve = _grown(time, height, flight, part, max(part.start, low), high, noise)
        curves.append(curve if curve and curve.frames.stop - curve.frames.start >= fewest else None)
    return curves, unit_load_speed


def _grown(
    time: FloatArray, height: FloatArray, flight: Flight, part: slice, low: int, high: int, noise: float
) -> _Curve | None:
    """Return the fit of a flight, which grows from its middle to both sides, up to the first frame that is off."""
    i, j, curve = max(part.start, low), min(part.stop, high), None
    while j - i > 2:  # two frames are on every curve
        curve = _fitted(time, height, flight, slice(i, j), curve)
        off, variance = curve.residuals(time[low:high], height[low:high])
        good = np.abs(off) <= _OFF * noise * np.sqrt(np.maximum(variance, 1.0))
        step = max((j - i) // 2, 2)  # as far as the fit predicts well
        before, after = good[: max(i - low, 0)][::-1], good[max(j - low, 0) :]
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
        # y + g t^2/2 is a straight line; its slope over g is the time from the middle to the apex.
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


def _accelerations(
    curves: Sequence[_Curve], time: FloatArray, height: FloatArray, labels: Sequence[str]
) -> tuple[list[FreeFlight], float]:
    """Return the acceleration of each flight, fitted to its own frames, and the standard error of positions."""
    flights, squares, free = [], 0.0, 0
    for curve in curves:
        t, y, (a, h), s = time[curve.frames], height[curve.frames], curve.apex, 1.0
        for _ in range(_ROUNDS):
            # Gauss-Newton steps for a, h and the scale s of y = h - s D(t - a).
            distance, speed, _ = curve.flight.fall(t - a)
            slopes = np.stack([s * speed, np.ones_like(t), -distance])
            covariance = np.linalg.pinv(slopes @ slopes.T)
            off = y - h + s * distance
            a, h, s = np.array([a, h, s]) + covariance @ slopes @ off
        squares, free = squares + float(off @ off), free + len(t) - 3
        ends = labels[curve.frames.start], labels[curve.frames.stop - 1]
        g = curve.flight.gravity
        flights.append(FreeFlight(*ends, float(s * g), g * math.sqrt(covariance[2, 2])))
    # sigma^2 = sum r^2/(number of frames - 3 a flight)
    error = max(math.sqrt(squares / max(free, 1)), 1e-9 * float(np.ptp(height)))
    return [replace(free_flight, standard_error=error * free_flight.standard_error) for free_flight in flights], error


def _collision(
    before: _Curve, after: _Curve, time: float, contact_time: ContactTime, unit_load_speed: float
) -> _Contact:
    """Return the contact at which the curves of two flights meet, from a time near it."""
    last = 0.0
    for _ in range(_ROUNDS):
        # Newton's method for the time at which the heights of both curves are equal, the second after the contact.
        t = np.array([time - before.apex[0], time + last - after.apex[0]])
        distance, speed, acceleration = before.flight.fall(t)
        gap = (before.apex[1] - distance[0]) - (after.apex[1] - distance[1])
        time += gap / (speed[0] - speed[1])
        last = float(lasting(contact_time, speed[:1], -speed[1:] / speed[:1], unit_load_speed)[0])
    # eps = -v_2/v_1, with downward speeds
    epsilon = -speed[1] / speed[0]
    # Derivatives by a and h of both flights: those of the time at which the curves meet, and by them of both speeds.
    time_slopes = np.array([[speed[0], 1.0], [-speed[1], -1.0]]) / (speed[0] - speed[1])
    speed_slopes = acceleration[0] * (time_slopes - [[1, 0], [0, 0]])
    rebound_slopes = -acceleration[1] * (time_slopes - [[0, 0], [1, 0]])
    slopes = np.array([speed_slopes, (rebound_slopes - epsilon * speed_slopes) / speed[0]])
    return _Contact(time, float(speed[0]), float(epsilon), slopes)


def _without_epsilon(
    time: FloatArray,
    height: FloatArray,
    labels: Sequence[str],
    curves: Sequence[_Curve | None],
    instants: Sequence[float],
    noise: float,
) -> list[tuple[str, str]]:
    """Return the contacts that give no eps, each with the reason: lows on the plane or beside a flight."""
    from scipy.signal import find_peaks  # imported here, because it takes a third of a second

    fallen, frame = float(np.ptp(height)), float(np.median(np.diff(time)))
    rise = max(_CLEAR[0] * noise, _CLEAR[1] * fallen)
    lows = find_peaks(-height, prominence=rise)[0].tolist()
    seen = [m for m in lows if any(abs(time[m] - instant) <= _GAP[0] * frame for instant in instants)]
    # The lowest frame may be above the plane by the way in a frame at the largest speed.
    way = frame * math.sqrt(2 * next(curve.flight.gravity for curve in curves if curve) * fallen)
    level = max((height[m] for m in seen), default=-math.inf) + rise + way
    left_out = []
    for m in sorted({*lows} - {*seen}):
        # Whether a flight ends just before the low, and whether one begins just after it.
        sides = {
            "before": any(abs(time[m] - time[curve.frames.stop - 1]) <= _GAP[0] * frame for curve in curves if curve),
            "after": any(abs(time[curve.frames.start] - time[m]) <= _GAP[0] * frame for curve in curves if curve),
        }
        if height[m] <= level or any(sides.values()):
            missing = " and ".join(side for side, has_flight in sides.items() if not has_flight)
            left_out.append(
                (labels[m], f"no free flight of {FEWEST} frames or more {missing or 'that meets another'} it")
            )
    return left_out
