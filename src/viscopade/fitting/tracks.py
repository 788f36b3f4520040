"""Coefficients of restitution of a body whose position was recorded over time, by a camera or a simulation.

Between contacts the body falls freely: its height is h - s D(t - a), with the height h and the time a of the apex, the
distance D of `Flight.fall`, and a scale s, which is 1 if the units are right. A flight is a run of frames that obey
such a curve with the acceleration s g that most flights share; frames in which the body is held do not. At the point
where the curves of two successive flights meet, their slopes are the speeds before and after the contact.

Names in all functions: `time` and `height` (or `position`) are arrays of all frames, in s and m, `noise` is the
standard error of a position, and `labels` are the frames' names for messages. A flight is a slice of these arrays.
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
from viscopade.fitting.contacts import ContactTime, contact_durations, weight_speed
from viscopade.fitting.flight import Flight
from viscopade.fitting.points import Points
from viscopade.quantity import uncertain

FEWEST = 5
"""Smallest number of frames of a flight: a parabola has three constants, and two more frames show whether it holds."""

# The limits below were chosen by hand; tests/fitting/test_tracks.py holds them to synthetic tracks of 33 to 200 frames
# a second, in which a hand holds or lifts the ball, and to 300 tracks whose intervals must cover the true values.
_FINITE = Accepted("a finite number", np.isfinite)
# Number of Newton or Gauss-Newton steps, at most, and the relative size of the last one. Newton's method squares the
# error in each step, so that after a step of 1e-7 it is at round-off; from 0.1, four steps get there, and six are by
# hand.
_ROUNDS, _CLOSE = 6, 1e-7
# Standard errors: a frame farther off belongs to no free flight, and a smaller jump of the slope to no contact. Noise
# does that once in two million frames.
_OFF = 5.0
_CURVED = 5.0  # standard errors of the acceleration of a body that falls, and is not held
# Accelerations that flights share: they differ by less than three standard errors, or than 15 %, if this is more (drag
# makes a parabola of a fast flight differ from one of a slow flight).
_SHARED_ERRORS, _SHARED_RATIO = 3.0, 0.15
_DIFFERENT = 3.0  # standard errors by which the acceleration differs from g because of a wrong unit: 1 in 370 by chance
# Least rise after a contact, in standard errors and as a fraction of the range of positions: less is noise, or the end
# of a series of bounces, in which nothing can be measured.
_CLEAR_ERRORS, _CLEAR_FRACTION = 8.0, 0.01
# The last frame of a flight and the first of the next are at most three frames apart, so that two lie between them
# (3.5, for jitter), and besides that 0.1 of the shorter flight, for contacts that last.
_GAP_FRAMES, _GAP_FRACTION = 3.5, 0.1
_JITTER = 0.1  # of the time from frame to frame, besides its last digit: cameras are steadier, missing frames are whole
_USUAL_EPSILON = 0.8  # a guess; contact times depend on it weakly, and shorter than a frame they matter little
_MOVING = 0.1  # of large displacements in three frames: smaller ones are those of a body that is held
# Quantile of third differences for the noise: at least 0.3 of them lie in flights even if the body is mostly held or in
# contact. P(|z| < 0.3853) = 0.3 for a normal z.
_QUANTILE, _NORMAL_QUANTILE = 0.3, 0.3853


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
        """Return a warning that the acceleration is not g.

        Parameters
        ----------
        gravity : float
            g in m/s^2.
        length : float
            Length in metres of one unit of the file's positions.
        rate : float or None
            Frames per second, if the file has numbers of frames.
        """
        # The positions are too small by g/a; or the frames come faster by its root, because a ~ length/time^2.
        ratio = gravity / self.acceleration
        # In millimetres, to three digits; the rate to four, because its relative error is half as large.
        frames = f", or --rate {rate * math.sqrt(ratio):.4g}," if rate else ""
        measured = f"{uncertain(self.acceleration, self.standard_error)} m/s^2, not {gravity:.4g}"
        scale = f"--length-per-unit '{1000 * length * ratio:.3g} mm'{frames} gives this"
        return (
            f"the flights accelerate with {measured}: {scale}; "
            "eps is fitted with their own acceleration, but the speeds are wrong if gravity is right"
        )


@dataclass(frozen=True)
class _Parabola:
    """Parabola c_0 + c_1 (t - m) + c_2 (t - m)^2 of a run of frames.

    Attributes
    ----------
    frames : slice
    middle : float
        The time m.
    c : array
        c_0, c_1 and c_2.
    covariance : array
        That of c for errors of 1 in each height.
    residual : float
        The root of the sum of squares of the residuals.
    fall : float
        c_2 T^2 for a run of the duration T, the height that a body with this acceleration falls in this time.
    """

    frames: slice
    middle: float
    c: FloatArray
    covariance: FloatArray
    residual: float
    fall: float

    @classmethod
    def fit(cls, time: FloatArray, height: FloatArray, frames: slice) -> _Parabola:
        """Return the parabola of least squares for some of the frames."""
        # In powers of t - m, 1 to t^2, the pseudoinverse P gives c = P y, and its covariance is P P^T.
        t = time[frames] - time[frames].mean()
        powers = np.vander(t, 3, increasing=True)
        inverse = np.linalg.pinv(powers)
        c = inverse @ height[frames]
        residual = float(np.linalg.norm(height[frames] - powers @ c))
        middle, fall = float(time[frames].mean()), float(abs(c[2]) * np.ptp(t) ** 2)
        return cls(frames, middle, c, inverse @ inverse.T, residual, fall)

    def is_near(self, time: FloatArray, height: FloatArray, noise: float) -> FloatArray:
        """Return for each frame of these times and heights whether the parabola predicts it within its errors."""
        # The three powers 1, t - m and (t - m)^2 of each frame. The variance of a frame outside the fit for errors of
        # 1: 1 of the frame, and that of the parabola.
        powers = np.vander(time - self.middle, 3, increasing=True)
        variance = 1 + np.einsum("ki,ij,kj->k", powers, self.covariance, powers)
        # Near: off by _OFF, five, standard errors or less
        return np.asarray(np.abs(height - powers @ self.c) <= _OFF * noise * np.sqrt(variance))

    def slope(self, time: float) -> tuple[float, float]:
        """Return its slope at a time, in m/s, and the standard error of this for errors of 1 in each height."""
        # h' = c_1 + 2 c_2 (t - m)
        powers = np.array([0, 1, 2 * (time - self.middle)])
        return float(powers @ self.c), math.sqrt(powers @ self.covariance @ powers)

    @property
    def acceleration(self) -> float:
        """Its second derivative, in m/s^2; below 0 if the heights are upward."""
        # h'' = 2 c_2
        return float(2 * self.c[2])

    @property
    def acceleration_error(self) -> float:
        """Standard error of the acceleration, in 1/s^2, for errors of 1 in each height."""
        return float(2 * math.sqrt(self.covariance[2, 2]))


@dataclass(frozen=True)
class _Curve:
    """Free flight fitted to frames: the time a and the height h of its apex, and their covariance for errors of 1."""

    flight: Flight
    apex: FloatArray  # a and h
    covariance: FloatArray
    frames: slice

    @property
    def apex_time(self) -> float:
        """The time a of the apex."""
        return float(self.apex[0])

    @property
    def apex_height(self) -> float:
        """The height h of the apex."""
        return float(self.apex[1])

    def residuals(self, time: FloatArray, height: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the residuals at times, and the variances that frames outside the fit have for errors of 1."""
        # r = y - (h - D(t - a)); the curve's derivatives are D' with respect to a, and 1 to h
        distance, speed, _ = self.flight.fall(time - self.apex_time)
        slopes = np.stack([speed, np.ones_like(speed)])
        # 1 of the frame itself, and the variance of the curve
        return height - self.apex_height + distance, 1 + np.einsum("ik,ij,jk->k", slopes, self.covariance, slopes)


class _Contact(NamedTuple):
    """A contact: its beginning, the speed before it, and eps.

    `slopes` has the derivatives of speed and eps (first axis) by the constants of the flights before and after (second
    axis), which are a and h (third axis).
    """

    time: float
    speed: float
    epsilon: float
    slopes: FloatArray


class _ContactOfFlights(NamedTuple):
    """The contact between flight k and flight k + 1."""

    k: int
    contact: _Contact


def frame_times(time: FloatArray, labels: Sequence[str], digit: float) -> FloatArray:
    """Return the times of frames without the rounding to their last digit, if they are those of a fixed rate.

    `digit` is one unit in the last digit of the times, in s; `labels` name the frames.

    Raises
    ------
    ValueError
        If they are not evenly spaced, up to their last digit and gaps of whole frames.
    """
    # Spans between successive frames are whole multiples of the usual one, up to the last digit; a multiple is 1 at
    # least.
    spans, reason = np.diff(time), f"there are {len(time)} frames"
    frame = float(np.median(spans)) if len(spans) else 0.0
    misfits = np.abs(spans - frame * np.maximum(np.round(spans / frame), 1)) if frame > 0 else np.ones_like(spans)
    if (uneven := misfits > digit + _JITTER * frame).any():
        k = int(np.argmax(uneven))
        reason = f"{labels[k + 1]} is {spans[k]:.3g} s after the one before, usually it is {frame:.3g} s"
    if len(time) < 2 * FEWEST or uneven.any():
        raise ValueError(
            f"{reason}: expected {2 * FEWEST} or more evenly spaced frames of a track; --column position=- reads the "
            "times of bounces alone, and --column time=- the heights alone"
        )
    # 2 * FEWEST: two flights, for one contact. A fixed rate is a straight line (degree 1) through the times of numbered
    # frames, within their last digit. The mean of single spans (below 1.5 of the usual one, halfway to the 2 of a gap)
    # is more exact than the rounded median.
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
    runs = _falling_runs(time, position, noise)
    if not runs:
        raise TooFew("the track has no free flight: expected frames that obey a parabola")
    common = float(np.median([run.acceleration for run in runs]))
    height = position if common < 0 else -position  # upward: a body that falls has h'' < 0
    runs = _merge_runs(time, height, [_Parabola.fit(time, height, run.frames) for run in runs], noise)

    # Each flight is fitted with their acceleration, and again with g, or with what the fits give if that is not g.
    # Between flights, the lowest frame is left out at first; then frames belong to the flight on their side. A flight
    # may have lost a frame at each end at first: the first pass admits flights of FEWEST - 2 frames.
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
            if before and after and meet and before.apex_time < instants[k] < after.apex_time:
                contact = _collision(before, after, instants[k], contact_time, unit_load_speed)
                # The curves meet within two frames of the lowest one, or else they are not those of one contact.
                if abs(contact.time - instants[k]) <= 2 * frame and contact.epsilon > 0:
                    pairs.append(_ContactOfFlights(k, contact))
                    instants[k] = contact.time
        flights, position_error = _accelerations([curve for curve in curves if curve], time, height, labels)
        # The weighted mean of accelerations a_i, with weights 1/sigma_i^2. Its variance is 1/sum w, times chi^2 over
        # the degrees of freedom (Birge's ratio) if they scatter more than their errors.
        weights, accelerations = np.array([[f.standard_error**-2, f.acceleration] for f in flights]).T
        mean = float(weights @ accelerations / weights.sum())
        spread = float(weights @ (accelerations - mean) ** 2) / max(len(accelerations) - 1, 1)
        mean_error = math.sqrt(max(spread, 1.0) / float(weights.sum()))
        agrees = abs(mean - flight.gravity) <= _DIFFERENT * mean_error
        scale = 1.0 if agrees else mean / flight.gravity
    # The root mean square of the given standard errors of positions; without them that of the residuals
    position_error = float(np.sqrt(np.mean(np.square(sigma)))) or position_error

    # Contacts without an eps are reported, and too many or none are refused.
    left_out = _without_epsilon(time, height, labels, curves, [pair.contact.time for pair in pairs], noise)
    if len(pairs) > MOST_INSTANTS:
        raise ValueError(f"the track has {len(pairs)} contacts: expected up to {MOST_INSTANTS}")
    if not pairs:
        why = "".join(f"; {label}: {reason}" for label, reason in left_out[:3])  # three are enough in one line
        raise TooFew(f"no contact has a free flight of {FEWEST} frames or more before and after it{why}")

    # The errors of both curves, by their parameters, give those of the speed and of eps; a measured acceleration has an
    # error, too, which g has not: fit both curves again with an acceleration that is larger by its standard error.
    gravity_ratio = 1.0 if agrees else 1 + mean_error / mean
    shifted_flight = replace(
        scaled, gravity=gravity_ratio * scaled.gravity, terminal_speed=gravity_ratio * scaled.terminal_speed
    )
    # First axis: speed and eps; then the contact, the flight before or after it, and the flight's independent errors.
    slopes, changes = np.empty((2, len(pairs), 2, 2)), np.empty((2, len(pairs)))
    for i, (k, contact) in enumerate(pairs):
        flight_curves = [curve for curve in curves[k : k + 2] if curve]
        # The covariance V = L L^T of a and h stands for two independent errors, the columns of L.
        for j, curve in enumerate(flight_curves):
            slopes[:, i, j] = contact.slopes[:, j] @ np.linalg.cholesky(curve.covariance) * position_error
        before, after = (_fit_curve(time, height, shifted_flight, curve.frames, curve) for curve in flight_curves)
        shifted = _collision(before, after, contact.time, contact_time, unit_load_speed)
        changes[:, i] = (shifted.speed - contact.speed, shifted.epsilon - contact.epsilon) if gravity_ratio > 1 else 0.0
    # Columns of the Jacobian matrices: two errors of each flight, so that contact k has 2 k to 2 k + 3, four in all.
    # Then one column for each contact, with the change by the acceleration.
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
    """Return the standard error of positions in m, from third differences, to which a parabola adds nothing.

    A body that is held may be seen more sharply, so only frames in which it moves count. Differences across a contact
    are large: a low quantile leaves them out.
    """
    # A third difference y_0 - 3 y_1 + 3 y_2 - y_3 of errors sigma has the variance (1 + 9 + 9 + 1) sigma^2.
    third, moved = np.abs(np.diff(position, 3)), np.abs(position[3:] - position[:-3])
    # Large displacements are those at the quantile 0.9, by hand: outliers of a few frames are above it, and fast
    # flights are among the rest. `_QUANTILE` of the differences is 0.3853 of their standard deviation, 20^(1/2) sigma.
    moving = third[moved > _MOVING * np.quantile(moved, 0.9)]
    noise = float(np.quantile(moving if len(moving) else third, _QUANTILE)) / _NORMAL_QUANTILE / math.sqrt(20)
    # Data of a simulation have no noise; 1e-5 of the range is the rounding of a file with five digits, by hand.
    return max(noise, 1e-5 * float(np.ptp(position)))


def _parabolic_runs(time: FloatArray, height: FloatArray, noise: float) -> list[_Parabola]:
    """Return successive runs of frames that obey a parabola, from the first frame on, each as long as possible.

    `time` and `height` are all frames of the track, in s and m, and `noise` is the standard error of a height.
    """
    runs, i = [], 0
    while i + FEWEST <= len(time):
        # A run begins with the fewest frames that obey a parabola.
        run = _Parabola.fit(time, height, slice(i, i + FEWEST))
        if run.residual > _OFF * noise:
            i += 1
            continue
        # It grows up to the first frame that the fit does not predict, by half its length at a time: so far ahead, the
        # error of the fitted parabola is still a few times that of a frame.
        while (j := run.frames.stop) < len(time):
            ahead = slice(j, j + (j - i) // 2)  # two frames or more: a run has FEWEST, five, or more
            is_near = run.is_near(time[ahead], height[ahead], noise)
            if not is_near[0]:
                break
            # Up to the first frame that is not near, or all of them
            run = _Parabola.fit(
                time, height, slice(i, j + (len(is_near) if is_near.all() else int(np.argmin(is_near))))
            )
        runs.append(run)
        i = run.frames.stop - 1  # the frame of a contact may belong to both flights
    return runs


def _falling_runs(time: FloatArray, height: FloatArray, noise: float) -> list[_Parabola]:
    """Return the runs with the acceleration that most runs share, counted by the heights that they fall.

    Frames of a contact may lie at the ends of a run: then its inner part has this acceleration.
    """
    # Runs with an acceleration above its errors (run.acceleration_error is for errors of 1), and their inner parts
    runs = _parabolic_runs(time, height, noise)
    curved = [run for run in runs if abs(run.acceleration) > _CURVED * noise * run.acceleration_error]
    cores = [_Parabola.fit(time, height, frames) for frames in _inner(curved)]
    # For each run the group of runs whose acceleration, or that of their inner part, agrees with its own; the group
    # that falls farthest is that of the flights.
    groups = []
    for run in curved:
        tolerance = max(_SHARED_ERRORS * noise * run.acceleration_error, _SHARED_RATIO * abs(run.acceleration))
        agrees = [
            any(
                abs(fit.acceleration - run.acceleration) < tolerance + noise * fit.acceleration_error
                for fit in run_and_core
            )
            for run_and_core in zip(curved, cores, strict=True)
        ]
        groups.append([member for member, is_near in zip(curved, agrees, strict=True) if is_near])
    return max(groups, key=lambda group: sum(run.fall for run in group), default=[])


def _follows(time: FloatArray, before: slice, after: slice) -> bool:
    """Return whether only the frames of a contact lie between two flights, given by their frames."""
    # The gap from the last frame of one to the first frame of the other, against the frames and the shorter flight
    start, end = time[before.stop - 1], time[after.start]
    shorter = min(start - time[before.start], time[after.stop - 1] - end)
    return bool(end - start <= _GAP_FRAMES * np.median(np.diff(time)) + _GAP_FRACTION * shorter)


def _merge_runs(time: FloatArray, height: FloatArray, runs: Sequence[_Parabola], noise: float) -> list[_Parabola]:
    """Return the runs as whole flights: two runs without a contact between them are one."""
    flights: list[_Parabola] = []
    for run in runs:
        if flights and _follows(time, flights[-1].frames, run.frames):
            # In a contact the slope jumps from below 0 to above 0, by more than its errors; else it is one flight.
            middle = (time[flights[-1].frames.stop - 1] + time[run.frames.start]) / 2
            (slope, error), (next_slope, next_error) = flights[-1].slope(middle), run.slope(middle)
            if not slope < 0 < next_slope or next_slope - slope < _OFF * noise * math.hypot(error, next_error):
                flights[-1] = _Parabola.fit(time, height, slice(flights[-1].frames.start, run.frames.stop))
                continue
        flights.append(run)
    return flights


def _inner(runs: Sequence[_Parabola]) -> list[slice]:
    """Return for each run its inner frames, which are far from contacts: the middle half of a long run.

    A run of fewer than 2 FEWEST = 10 frames loses one frame at each end, and one of FEWEST frames none. By hand: most
    contacts last for a frame or two, and what is left has the three frames of a parabola or more.
    """
    lengths = [run.frames.stop - run.frames.start for run in runs]
    cut = [length // 4 if length >= 2 * FEWEST else int(length > FEWEST) for length in lengths]
    return [slice(run.frames.start + n, run.frames.stop - n) for run, n in zip(runs, cut, strict=True)]


def _lows(time: FloatArray, height: FloatArray, runs: Sequence[_Parabola]) -> list[float]:
    """Return the instants, in s, of the lowest frames between the inner parts of successive runs.

    Contacts are there, within a frame or two.
    """
    between = [slice(run.stop - 1, max(next_run.start, run.stop) + 1) for run, next_run in pairwise(_inner(runs))]
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
    """Return the curve of each flight, None if it has too few frames, and the speed at which the load is 1.

    Parameters
    ----------
    flight : Flight
        With the acceleration that the flights have in the units of the track.
    runs : sequence of _Parabola
        The flights found so far.
    instants : sequence of float
        The contact after each of them, except for the last one.
    contact_time : float or Pair
        As for `of_track`.
    fewest : int
        The smallest number of frames of a flight.
    """
    # The speeds of impact give the contact times; no frame of a contact, before or after its instant, is in a flight.
    fast = np.array([abs(run.slope(instant)[0]) for run, instant in zip(runs, instants, strict=False)])
    usual = np.full(len(fast), _USUAL_EPSILON)
    unit_load_speed = weight_speed(contact_time, flight.gravity, fast, usual) if len(fast) else 0.0
    durations = contact_durations(contact_time, fast, usual, unit_load_speed)
    begin = [0, *np.searchsorted(time, instants + durations, side="right").tolist()]
    end = [*np.searchsorted(time, instants - durations).tolist(), len(time)]
    # Each flight grows from the inner frames of its run, within these limits.
    curves: list[_Curve | None] = []
    for inner, low, high in zip(_inner(runs), begin, end, strict=True):
        curve = _grow_curve(time, height, flight, inner, low, high, noise)
        # After a body was held, the flight does not grow backward: its first frames look like those before.
        follows = curve and curves and curves[-1] and _follows(time, curves[-1].frames, curve.frames)
        if not follows:
            curve = _grow_curve(time, height, flight, inner, max(inner.start, low), high, noise)
        curves.append(curve if curve and curve.frames.stop - curve.frames.start >= fewest else None)
    return curves, unit_load_speed


def _grow_curve(
    time: FloatArray, height: FloatArray, flight: Flight, inner: slice, low: int, high: int, noise: float
) -> _Curve | None:
    """Return the fit of a flight, which grows from its `inner` frames to both sides, up to the first frame that is off.

    Its frames are from `low` up to `high` (not included). None: fewer than three are left. `flight` has the
    acceleration of free fall and the drag.
    """
    i, j, curve = max(inner.start, low), min(inner.stop, high), None
    while j - i > 2:  # a curve has two constants, a and h: two frames are on every curve
        curve = _fit_curve(time, height, flight, slice(i, j), curve)
        residuals, variance = curve.residuals(time[low:high], height[low:high])
        # The variance is 1 plus a square; below 1 it is round-off, which would fail in the root.
        is_near = np.abs(residuals) <= _OFF * noise * np.sqrt(np.maximum(variance, 1.0))
        # It grows by half its length at a time (three frames by one): so far ahead, the error of the curve is below
        # twice that of a frame. Frames before it are in reverse order, the nearest first.
        step = (j - i) // 2
        before, after = is_near[: i - low][::-1], is_near[j - low :]
        left, right = (min(step, len(side) if side.all() else int(np.argmin(side))) for side in (before, after))
        if not left and not right:
            return curve
        i, j = i - left, j + right
    return None


def _fit_curve(time: FloatArray, height: FloatArray, flight: Flight, frames: slice, near: _Curve | None) -> _Curve:
    """Return the curve y = h - D(t - a) of least squares for some frames, by Gauss-Newton steps for a and h.

    D is that of `flight`. They start from the curve `near` it, or else from the parabola without drag.
    """
    t, y = time[frames], height[frames]
    if near:
        apex = near.apex
    else:
        middle = t.mean()
        # y + g t^2/2 is a straight line; its slope over g is the time from the middle to the apex.
        slope = np.polynomial.polynomial.polyfit(t - middle, y + flight.gravity * (t - middle) ** 2 / 2, 1)[1]
        apex = np.array([middle + slope / flight.gravity, y.max()])
    for _ in range(_ROUNDS):
        # Residuals r = y - h + D(t - a), and the derivatives J of the curve by a and h: D' and 1. The step is
        # (J J^T)^-1 J r.
        distance, speed, _ = flight.fall(t - apex[0])
        slopes = np.stack([speed, np.ones_like(speed)])
        covariance = np.linalg.inv(slopes @ slopes.T)
        change = covariance @ slopes @ (y - apex[1] + distance)
        apex = apex + change
        # A change of a by da changes speeds by g da.
        if abs(change[0]) * flight.gravity < _CLOSE * abs(speed).max():
            break
    return _Curve(flight, apex, covariance, frames)


def _accelerations(
    curves: Sequence[_Curve], time: FloatArray, height: FloatArray, labels: Sequence[str]
) -> tuple[list[FreeFlight], float]:
    """Return the acceleration of each flight, fitted to its own frames, and the standard error of positions.

    `curves` are the flights, fitted with a common acceleration.
    """
    flights, squares, degrees = [], 0.0, 0
    for curve in curves:
        t, y, (a, h), s = time[curve.frames], height[curve.frames], curve.apex, 1.0
        for _ in range(_ROUNDS):
            # Gauss-Newton steps for a, h and the scale s of y = h - s D(t - a), whose derivatives are s D', 1 and -D.
            distance, speed, _ = curve.flight.fall(t - a)
            slopes = np.stack([s * speed, np.ones_like(t), -distance])
            covariance = np.linalg.pinv(slopes @ slopes.T)
            residuals = y - h + s * distance
            a, h, s = np.array([a, h, s]) + covariance @ slopes @ residuals
        # Each flight takes three degrees of freedom from its frames: a, h and s.
        squares, degrees = squares + float(residuals @ residuals), degrees + len(t) - 3
        ends = labels[curve.frames.start], labels[curve.frames.stop - 1]
        g = curve.flight.gravity
        flights.append(FreeFlight(*ends, float(s * g), g * math.sqrt(covariance[2, 2])))
    # sigma^2 = sum r^2/(number of frames - 3 a flight). Exact data keep an error above 0, 1e-9 of the range, above
    # round-off, so that later divisions by it are defined.
    error = max(math.sqrt(squares / max(degrees, 1)), 1e-9 * float(np.ptp(height)))
    return [replace(free_flight, standard_error=error * free_flight.standard_error) for free_flight in flights], error


def _collision(
    before: _Curve, after: _Curve, time: float, contact_time: ContactTime, unit_load_speed: float
) -> _Contact:
    """Return the contact at which the curves of the flights before and after it meet, from a `time` near it.

    `contact_time` is as for `of_track`, and `unit_load_speed` is v_G, at which the load of the weight is 1.
    """
    duration = 0.0
    for _ in range(_ROUNDS):
        # Newton's method for the time T at which the heights of both curves are equal, the second after the contact:
        # h_1 - D(T - a_1) = h_2 - D(T + t_c - a_2), with the derivative -(v_1 - v_2) of the difference. Speeds are
        # downward: v_1 > 0 > v_2.
        t = np.array([time - before.apex_time, time + duration - after.apex_time])
        (distance_1, distance_2), (v_1, v_2), (acceleration_1, acceleration_2) = before.flight.fall(t)
        gap = (before.apex_height - distance_1) - (after.apex_height - distance_2)
        time += gap / (v_1 - v_2)
        durations = contact_durations(contact_time, np.array([v_1]), np.array([-v_2 / v_1]), unit_load_speed)
        duration = float(durations[0])
    # eps = -v_2/v_1
    epsilon = -v_2 / v_1
    # Derivatives by a and h (columns) of both flights (rows). Of T: dT/da_1 = v_1/(v_1 - v_2), dT/dh_1 = 1/(v_1 - v_2),
    # and the same for flight 2 with -v_2 and -1. Of v_1 = D'(T - a_1): D'' (dT - da_1); of the rebound -v_2 likewise.
    time_slopes = np.array([[v_1, 1.0], [-v_2, -1.0]]) / (v_1 - v_2)
    speed_slopes = acceleration_1 * (time_slopes - [[1, 0], [0, 0]])
    rebound_slopes = -acceleration_2 * (time_slopes - [[0, 0], [1, 0]])
    # d eps = (d(-v_2) - eps d v_1)/v_1
    slopes = np.array([speed_slopes, (rebound_slopes - epsilon * speed_slopes) / v_1])
    return _Contact(time, float(v_1), float(epsilon), slopes)


def _without_epsilon(
    time: FloatArray,
    height: FloatArray,
    labels: Sequence[str],
    curves: Sequence[_Curve | None],
    instants: Sequence[float],
    noise: float,
) -> list[tuple[str, str]]:
    """Return the contacts that give no eps, each with the reason: lows on the plane or beside a flight.

    `curves` are the flights, and `instants` the contacts that give an eps. A low is a frame, by its index m.
    """
    from scipy.signal import find_peaks  # imported here, because it takes a third of a second

    # Lows of the track, and those that are contacts with an eps
    fallen, frame = float(np.ptp(height)), float(np.median(np.diff(time)))
    rise = max(_CLEAR_ERRORS * noise, _CLEAR_FRACTION * fallen)
    lows = find_peaks(-height, prominence=rise)[0].tolist()
    contact_lows = [m for m in lows if any(abs(time[m] - instant) <= _GAP_FRAMES * frame for instant in instants)]
    # The lowest frame may be above the plane by the way in a frame at the largest speed, (2 g h)^(1/2). No low above
    # `level`, the highest contact and this way, is on the plane.
    way = frame * math.sqrt(2 * next(curve.flight.gravity for curve in curves if curve) * fallen)
    level = max((height[m] for m in contact_lows), default=-math.inf) + rise + way
    left_out = []
    for m in sorted({*lows} - {*contact_lows}):
        # Whether a flight ends just before the low, and whether one begins just after it.
        gap, flights = _GAP_FRAMES * frame, [curve.frames for curve in curves if curve]
        sides = {
            "before": any(abs(time[m] - time[frames.stop - 1]) <= gap for frames in flights),
            "after": any(abs(time[frames.start] - time[m]) <= gap for frames in flights),
        }
        if height[m] <= level or any(sides.values()):
            sides_without_flight = " and ".join(side for side, has_flight in sides.items() if not has_flight)
            left_out.append(
                (
                    labels[m],
                    f"no free flight of {FEWEST} frames or more {sides_without_flight or 'that meets another'} it",
                )
            )
    return left_out
