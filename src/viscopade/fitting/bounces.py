"""Coefficients of restitution of a body that bounces on a plane, from instants of bounces or from heights."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from scipy import sparse

from viscopade.arguments import without_unit
from viscopade.arrays import double
from viscopade.arrays.checked import Accepted, FloatArray, array, number
from viscopade.collision.spheres import Pair
from viscopade.fitting.flight import Flight
from viscopade.fitting.points import Points

MOST_INSTANTS = 20_000
"""Of bounces in a file."""

ContactTime = float | Callable[[FloatArray, FloatArray], FloatArray]

_FINITE = Accepted("a finite number", np.isfinite)
_ERRORS = Accepted("a number >= 0", lambda x: x >= 0)
_ROUNDS = 8  # until the contact times of bounces are those of their speeds
_LAW_ROUNDS = 40  # until a speed and its eps give the speed after the bounce: each divides the error by at least 3


def contact_time_of(pair: Pair) -> Callable[[FloatArray, FloatArray], FloatArray]:
    """Return the duration of contact of a pair of bodies as a function of v and eps: tau_c(v*(eps)) times its unit."""
    return lambda speed, epsilon: np.asarray(double.tau_c(double.v_star_from(epsilon)) * pair.time_scale(speed))


def of_times(
    drops: Sequence[tuple[FloatArray, Sequence[str]]],
    flight: Flight,
    *,
    sigma: float | Sequence[FloatArray] = 0.0,
    contact_time: ContactTime = 0.0,
) -> Points:
    """Return the points of bounces whose contacts begin at given instants.

    Between two of them are a contact and a flight. The first and the last bounce of a drop give no point: the speed
    before the first and that after the last are not known.

    Parameters
    ----------
    drops : sequence
        For each drop of the body the instants, in ascending order, and their labels.
    flight : Flight
        In units of these instants.
    sigma : float or sequence of array
        Standard error of the instants, or of each of them by drop.
    contact_time : float or callable
        Duration of contact, or a function of arrays of v and eps that returns it.

    Raises
    ------
    ValueError
        If instants do not ascend, a flight has no time, a rebound is higher than what came before, or there are fewer
        than three instants in every drop.
    """
    parts = []
    lasting = contact_time if callable(contact_time) else number("contact_time", contact_time, _ERRORS)
    for i, (given, labels) in enumerate(drops):
        instants = array("instants", given, _FINITE)
        if (late := np.diff(instants) <= 0).any():
            k = int(np.argmax(late))
            raise ValueError(
                f"{labels[k + 1]}: the bounce is at {instants[k + 1]:g}: accepted is later than the one before"
            )
        if len(instants) > 2:
            parts.append(_of_drop(instants, labels, flight, _errors(sigma, i, instants, "s"), lasting))
    if not parts:
        raise ValueError("no drop has three bounces: accepted are three instants or more, for one eps")
    return _together(parts)


def _of_drop(
    instants: FloatArray, labels: Sequence[str], flight: Flight, sigma: FloatArray, contact_time: ContactTime
) -> Points:
    spans = np.diff(instants)
    contacts = np.full_like(spans, 0.0 if callable(contact_time) else float(contact_time))
    for _ in range(_ROUNDS if callable(contact_time) else 1):
        if (short := contacts >= spans).any():
            k = int(np.argmax(short))
            raise ValueError(
                f"{labels[k + 1]}: {spans[k]:.6g} after the bounce before: accepted is more than the contact time"
            )
        launch = flight.launch(spans - contacts)
        speed = flight.impact(launch[:-1])
        epsilon = np.minimum(launch[1:] / speed, 1.0)
        if callable(contact_time):
            speed = np.append(_first_speed(launch[0], speed, epsilon), speed)
            contacts = contact_time(speed, np.minimum(launch / speed, 1.0))
    # A late instant lengthens the flight before, and shortens the one after.
    of_span = sparse.diags_array([-1.0, 1.0], offsets=[0, 1], shape=(len(spans), len(instants)))
    return _points(flight, launch, _rows(flight.launch_slope(launch)) @ of_span @ _rows(sigma), labels[1:-1])


def _first_speed(launch: float, speed: FloatArray, epsilon: FloatArray) -> float:
    """Return the impact speed of a drop's first bounce by the law, given the speed after it and the other bounces."""
    beta = np.median(np.asarray(double.v_star_from(epsilon)) ** 2 * speed**-0.2)
    first = launch
    for _ in range(_LAW_ROUNDS):
        first = launch / float(double.epsilon(math.sqrt(beta) * first**0.1))
    return first


def of_heights(
    drops: Sequence[tuple[FloatArray, Sequence[str]]], flight: Flight, *, sigma: float | Sequence[FloatArray] = 0.0
) -> Points:
    """Return the points of a body that rises to given heights between bounces, the first being that of its release.

    Parameters and errors are those of `of_times`, for heights instead of instants.
    """
    parts = []
    for i, (given, labels) in enumerate(drops):
        heights = array("heights", given, _FINITE)
        if (low := heights <= 0).any():
            k = int(np.argmax(low))
            raise ValueError(f"{labels[k]}: the height is {heights[k]:g}: accepted is a number > 0")
        if len(heights) < 2:
            continue
        errors = _errors(sigma, i, heights, "m")
        launch = flight.launch_to(heights)
        parts.append(_points(flight, launch, _rows(flight.launch_to_slope(heights) * errors), labels[1:]))
    if not parts:
        raise ValueError("no drop has two heights: accepted are the height of release and a rebound, or more")
    return _together(parts)


def _errors(sigma: float | Sequence[FloatArray], drop: int, values: FloatArray, unit: str) -> FloatArray:
    """Return the standard errors of a drop's values."""
    given = without_unit("sigma", sigma, unit)
    of_drop = given[drop] if isinstance(given, Sequence) or np.ndim(given) else given
    return np.broadcast_to(array("sigma", without_unit("sigma", of_drop, unit), _ERRORS), values.shape)


def _points(flight: Flight, launch: FloatArray, of_launch: sparse.sparray, labels: Sequence[str]) -> Points:
    """Return the points of successive flights from their first speeds and the errors of these."""
    speed = flight.impact(launch[:-1])
    epsilon = launch[1:] / speed
    of_launch = sparse.csr_array(of_launch)
    of_speed = _rows(flight.impact_slope(launch[:-1])) @ of_launch[:-1]
    of_epsilon = _rows(1 / speed) @ (of_launch[1:] - _rows(epsilon) @ of_speed)
    return Points(speed, epsilon, sparse.csr_array(of_speed), sparse.csr_array(of_epsilon), tuple(labels))


def _rows(values: FloatArray) -> sparse.sparray:
    """Return a diagonal matrix."""
    return sparse.diags_array(values)


def _together(parts: Sequence[Points]) -> Points:
    """Return the points of several drops, whose errors are independent."""
    return Points(
        np.concatenate([part.speed for part in parts]),
        np.concatenate([part.epsilon for part in parts]),
        sparse.block_diag([part.speed_errors for part in parts], format="csr"),
        sparse.block_diag([part.epsilon_errors for part in parts], format="csr"),
        tuple(label for part in parts for label in part.labels),
    )
