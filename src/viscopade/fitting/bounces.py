"""Coefficients of restitution of a body that bounces on a plane, from instants of bounces or from heights."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import sparse

from viscopade.arguments import without_unit
from viscopade.arrays.checked import Accepted, FloatArray, array, number
from viscopade.collision.spheres import Pair
from viscopade.fitting import weight_table
from viscopade.fitting.contacts import LEAST_EPSILON, ContactTime, lasting, weight_speed
from viscopade.fitting.flight import Flight
from viscopade.fitting.points import Points

MOST_INSTANTS = 20_000
"""Largest number of instants of bounces in a file."""

_FINITE = Accepted("a finite number", np.isfinite)
_ERRORS = Accepted("a number >= 0", lambda x: x >= 0)
_ROUNDS = 8  # of iteration, a choice: speeds give contact times, which change the speeds
_SETTLED = 1e-12  # relative change of a speed or a contact time that ends an iteration: a choice, above round-off
_LAW_ROUNDS = 40  # until a speed and its eps give the speed after the bounce: each divides the error by at least 3

HEARING = 1e-3
"""Standard error in seconds that `heard` assumes for instants."""
# Costs are squares of deviations in standard errors, as chi^2 is.
_LOST = 16.0  # cost of an echo, and of a bounce that was not heard: four standard errors
_UNLIKE = 35.0  # cost of two flights of different drops: a choice, above the 32 of an echo and a missed bounce
_DISTINCT = 9.0  # a sound is ambiguous if the costs of two of its roles differ by less: a choice
_VARIATION = 0.04  # of eps from bounce to bounce, relative: a choice
_LOSS, _LIKE = 0.05, 0.3  # of 1 - eps: a loss that counts, and the ratio of later losses to the first one; choices
_RISE = 3.0  # standard errors by which a rebound may be higher than the height before it: a choice
# Spans between bounces get shorter; the three limits are choices.
# Fewer spans, of a larger relative range, or that shorten by more than this each, are not those of a recording.
_FEWEST_SPANS, _RANGE_OF_SPANS, _CHANGE_OF_SPANS = 5, 0.4, 1e-3
_RATIOS = np.exp(np.arange(math.log(0.1), 1e-9, 0.01))  # T_2/T_1, in steps of 1 %
# Kinds of intervals between bounces: one flight, one with an echo, two flights (a bounce was not heard), both.
_STEP, _MISSED = np.array([1, 2, 1, 2]), np.array([[False], [False], [True], [True]])
_COST = np.array([[0.0], [_LOST], [_LOST], [2 * _LOST]])
_ECHO, _END_OF_DROP = 16, 17  # roles of a sound; less than 16: a bounce, 4 times the kind before it and that after it


class TooFew(ValueError):
    """There are not enough bounces or heights for one eps."""


def heard(instants: FloatArray, sigma: float = HEARING) -> tuple[list[list[int]], list[tuple[int, str]]]:
    """Return the sounds of a recording that are bounces with whole flights between them: the reading of least cost.

    Between two bounces there may be an echo, a bounce that was not heard, or both; each costs 16. Flights T_1 and T_2
    before and after a bounce cost (ln(T_2/(r T_1))/s)^2, and at most 35, because a new drop may begin. Here s^2 is
    0.04^2 plus the variance that `sigma` causes, and r is the ratio that minimises the sum. Dynamic programming gives
    the least cost of each role that a sound may have. A sound is ambiguous, and left out, if the costs of two of its
    roles differ by less than 9.

    Parameters
    ----------
    instants : array
        In ascending order, in seconds.
    sigma : float
        Their standard error.

    Returns
    -------
    list of list of int
        Runs of successive bounces; each but the first and the last of a run gives an eps.
    list of tuple
        The other sounds, except for the first and the last one, each with the reason why it is left out.
    """
    instants = array("instants", instants, _FINITE)
    n, r = len(instants), _RATIOS
    if n < 3:
        return [], []
    # Before the first sound and after the last one there are none: there, costs are NaN, which fmin and nanmin skip.
    padded = np.concatenate([[math.nan] * 2, instants, [math.nan] * 2])
    # An interval with a missed bounce has the flights T and r T: the last is r/(1 + r) of it, the first 1/(1 + r).
    last_share, first_share = (np.where(_MISSED, part / (1 + r), 1.0) for part in (r, np.ones_like(r)))
    kinds = np.arange(4)

    def pair_costs(j: int) -> FloatArray:
        """Return the costs at sound j by the kind of interval before it, the kind after it, and r."""
        # 1/T_1 and 1/T_2, of the flights next to the sound
        rate_before = 1 / ((padded[j + 2] - padded[j + 2 - _STEP])[:, None] * last_share)[:, None]
        rate_after = 1 / ((padded[j + 2 + _STEP] - padded[j + 2])[:, None] * first_share)
        with np.errstate(over="ignore"):
            # s^2 = 0.04^2 + sigma^2 (1/T_1^2 + 1/T_2^2 + (1/T_1 + 1/T_2)^2)
            variance = (
                _VARIATION**2
                + np.square(sigma * rate_before)
                + np.square(sigma * rate_after)
                + np.square(sigma * (rate_before + rate_after))
            )
        # (ln(T_2/(r T_1))/s)^2
        return np.asarray(np.log(rate_before / (rate_after * r)) ** 2 / variance)

    # Forward: the least cost of all sounds before, if the sound is a bounce.
    cost_to = np.full((n + 2, 4, len(r)), math.inf)  # least cost up to a sound, by the kind of interval before it
    cost_to[_STEP, kinds] = _COST
    for j in range(1, n - 1):
        least = (cost_to[j][:, None] + np.fmin(pair_costs(j), _UNLIKE)).min(axis=0) + _COST
        cost_to[j + _STEP, kinds] = np.minimum(cost_to[j + _STEP, kinds], least)
    # Backward: the same from the last sound on. Both together are the least cost of a reading with a role of the sound.
    cost_from = np.full((2, 4, len(r)), math.inf)  # least cost from the next sound and the one after it, by the same
    cost_from[0] = 0.0
    roles = []
    for j in range(n - 2, 0, -1):
        pairs, rest = pair_costs(j), _COST + cost_from[_STEP - 1, kinds]
        # As a bounce, it costs what is before, the pair of flights, and what is after; or 35 instead of the pair.
        bounce_costs = cost_to[j][:, None] + rest
        # As an echo, it lies in an interval of two steps, between the sounds next to it.
        echo_costs = (cost_to[j + 1] + cost_from[0])[_STEP == 2]
        costs = [
            *np.nanmin(bounce_costs + pairs, axis=2, initial=math.inf).ravel(),
            echo_costs.min(),
            bounce_costs.min() + _UNLIKE,
        ]
        roles.append(np.array(costs))
        cost_from = np.array([(np.fmin(pairs, _UNLIKE) + rest).min(axis=1), cost_from[0]])
    return _runs(roles[::-1])


def _runs(roles: Sequence[FloatArray]) -> tuple[list[list[int]], list[tuple[int, str]]]:
    """Return the runs of bounces, and the sounds that are left out, from the costs of the roles of each sound."""
    runs: list[list[int]] = []
    left_out = []
    for j, costs in enumerate(roles, 1):
        best, second = np.argsort(costs)[:2].tolist()
        before, after = divmod(best, 4)
        if costs[second] < costs[best] + _DISTINCT:
            left_out.append((j, f"ambiguous: {_named(best)}, or {_named(second)}"))
        elif best in (_ECHO, _END_OF_DROP) or _MISSED[before] or _MISSED[after]:
            left_out.append((j, _named(best)))
        elif runs and runs[-1][-2:] == [int(j - _STEP[before]), j]:
            runs[-1].append(int(j + _STEP[after]))
        else:
            runs.append([int(j - _STEP[before]), j, int(j + _STEP[after])])
    return runs, left_out


def _named(role: int) -> str:
    """Return a sound's role in words."""
    if role in (_ECHO, _END_OF_DROP):
        return "an echo or another sound" if role == _ECHO else "the first or last bounce of a drop"
    kinds = dict(zip(("before", "after"), divmod(role, 4), strict=True))
    missed = [f"the bounce {side} it was not heard" for side, kind in kinds.items() if _MISSED[kind]]
    echoes = [f"an echo {side} it" for side, kind in kinds.items() if _STEP[kind] == 2]
    return " and ".join(missed or ["a bounce" + " with" * bool(echoes), *echoes]).replace("with and", "with")


def of_times(
    drops: Sequence[tuple[FloatArray, Sequence[str]]],
    flight: Flight,
    *,
    sigma: float | Sequence[FloatArray] = 0.0,
    contact_time: ContactTime = 0.0,
    durations: Sequence[FloatArray] = (),
    of_flights: bool = False,
) -> Points:
    """Return the points of bounces whose contacts begin at given instants.

    A contact and a flight lie between two instants. The first and the last bounce of a drop give no point, because the
    speed before the first one and the speed after the last one are not known.

    Parameters
    ----------
    drops : sequence
        For each drop of the body the instants, in ascending order, and their labels.
    flight : Flight
        In units of these instants.
    sigma : float or sequence of array
        Standard error of all instants; or an array for each drop, with one for each instant.
    contact_time : float or Pair
        Time from first contact until the body is back at that height; or the bodies that collide, from which the law
        of contact with the body's weight gives this time.
    durations : sequence of array
        Measured contact times, used in place of `contact_time`: for each drop an array with one for each instant. The
        ends of contact have the same standard errors as the instants.
    of_flights : bool
        Whether `sigma` are independent errors of the flights that end at the instants, not of the instants.

    Raises
    ------
    ValueError
        If instants do not ascend, a contact lasts until the next one, eps is much above 1, or no drop has three
        instants.
    """
    parts = []
    contact = contact_time if isinstance(contact_time, Pair) else number("contact_time", contact_time, _ERRORS)
    for i, (drop_instants, labels) in enumerate(drops):
        instants = array("instants", drop_instants, _FINITE)
        require_ascending(instants, labels)
        if len(instants) > 2:
            measured = array("contact_time", durations[i], _ERRORS) if len(durations) else None
            parts.append(
                _of_drop(instants, labels, flight, _errors(sigma, i, instants, "s"), contact, measured, of_flights)
            )
    if not parts:
        raise TooFew("no drop has three bounces: expected three instants or more, for one eps")
    return _weighted(together(parts), contact, flight)


def require_ascending(instants: FloatArray, labels: Sequence[str]) -> None:
    """Raise ValueError if instants do not ascend."""
    if (late := np.diff(instants) <= 0).any():
        k = int(np.argmax(late))
        text = f"{labels[k + 1]}: the bounce is at {instants[k + 1]:g}: expected later than the one before"
        if 2 * late.sum() > len(late) and (instants > 0).all():
            text += f"; if these are times of flight, expected {FLIGHTS}"
        raise ValueError(text)


FLIGHTS = "the name interval, or --column interval=HEADER, for a flight in each row, or the names T0, T1, … for a drop"
"""The names of columns with times of flight."""

INDEPENDENT = (
    "are these independent drops? Then expected drop_height and rebound_height, or a column drop with their numbers"
)
"""Advice for heights in a column that do not fall."""

ORDER = (
    "is the order of the columns right? Expected the drop, then its rebounds; "
    "--column drop_height=HEADER and --column rebound_height=HEADER choose two columns"
)
"""Advice for heights in a row that do not fall."""


def require_falling(heights: FloatArray, labels: Sequence[str], sigma: FloatArray, advice: str = INDEPENDENT) -> None:
    """Raise ValueError if a body rises above the height that it fell from, by more than the errors of the heights."""
    if (high := np.diff(heights) > _RISE * np.hypot(sigma[1:], sigma[:-1])).any():
        k = int(np.argmax(high))
        text = f"the height {heights[k + 1]:.6g} m is above the one before it, {heights[k]:.6g} m: {advice}"
        raise ValueError(f"{labels[k + 1]}: {text}; --resolution gives the error of the heights")


def require_successive(drops: Sequence[FloatArray]) -> None:
    """Raise ValueError if rebounds hardly differ from each other, but from the drop: they are repetitions."""
    first, later = (
        [1 - math.sqrt(drop[k + 1] / drop[k]) for drop in drops for k in range(len(drop) - 1) if bool(k) == after]
        for after in (False, True)
    )
    if later and np.median(first) > _LOSS and np.median(later) < _LIKE * np.median(first):
        text = "the rebounds hardly lose height after the first one: are they repetitions, from one height?"
        raise ValueError(f"{text} Then expected a row for each, with the columns H and h")


def evenly_spaced(times: FloatArray, digit: float = 0.0) -> bool:
    """Return whether times are those of a recording: the flights of a body that bounces get shorter.

    `digit` is one unit in the last digit of the times.
    """
    spans, half = np.diff(times), (len(times) - 1) // 2
    if len(spans) < _FEWEST_SPANS or not np.ptp(spans) <= _RANGE_OF_SPANS * abs(spans.mean()):
        return False
    # First half and second half of the recording: the mean spans of a fixed rate are equal, up to their last digit.
    change = abs(float(spans[half:].mean() / spans[:half].mean()) - 1)
    return change <= _CHANGE_OF_SPANS * half + 2 * digit / half / float(spans.mean())


def _of_drop(
    instants: FloatArray,
    labels: Sequence[str],
    flight: Flight,
    sigma: FloatArray,
    contact_time: ContactTime,
    durations: FloatArray | None,
    of_flights: bool,
) -> Points:
    spans = np.diff(instants)
    contact = contact_time if durations is None else durations[:-1]
    contacts = np.zeros_like(spans) + (0.0 if isinstance(contact, Pair) else contact)
    # Speeds give contact times, which shorten the flights and so change the speeds: iterate.
    for _ in range(1 if isinstance(contact, float) else _ROUNDS):
        if (short := contacts >= spans).any():
            k = int(np.argmax(short))
            raise ValueError(
                f"{labels[k + 1]}: the bounce is {spans[k]:.6g} after the last one: expected more than the contact time"
            )
        launch = flight.launch(spans - contacts)
        speed = flight.impact(launch[:-1])
        # The body launched after a contact lands at `impact`: eps is the next launch over this.
        epsilon = np.clip(launch[1:] / speed, LEAST_EPSILON, 1.0)
        # Only bounces with a flight on both sides have an eps; the first speed comes from the law.
        if not isinstance(contact, float):
            inner_contact = contact if durations is None else durations[1:-1]
            unit_load_speed = weight_speed(inner_contact, flight.gravity, speed, epsilon)
            speed = np.append(_first_speed(launch[0], speed, epsilon, unit_load_speed), speed)
            before, contacts = contacts, lasting(contact, speed, launch / speed, unit_load_speed)
            if np.all(np.abs(contacts - before) <= _SETTLED * contacts):
                break
    # A late instant lengthens the flight before, and shortens the one after, unless the end of contact was measured.
    ends, starts = (
        sparse.diags_array([sign], offsets=[k], shape=(len(spans), len(instants))) @ _rows(sigma)
        for sign, k in ((1.0, 1), (-1.0, 0))
    )
    span_errors = ends if of_flights else ends + starts if durations is None else sparse.hstack([ends, starts])
    made = _points(flight, launch, _rows(flight.launch_slope(launch)) @ span_errors, labels[1:-1])
    return made if durations is None else replace(made, contact_time=durations[1:-1])


def _first_speed(launch: float, speed: FloatArray, epsilon: FloatArray, unit_load_speed: float) -> float:
    """Return the impact speed of a drop's first bounce, by the law, from the speed after it and the other bounces."""
    beta = np.median(weight_table.kappa_from(epsilon, weight_table.load_at(speed, unit_load_speed)) * speed**-0.2)
    first = np.array(launch)
    for _ in range(_LAW_ROUNDS):
        rebound = weight_table.epsilon(beta * first**0.2, weight_table.load_at(first, unit_load_speed))
        before, first = first, launch / np.maximum(rebound, LEAST_EPSILON)
        if abs(first - before) <= _SETTLED * first:
            break
    return float(first)


def of_heights(
    drops: Sequence[tuple[FloatArray, Sequence[str]]],
    flight: Flight,
    *,
    sigma: float | Sequence[FloatArray] = 0.0,
    contact_time: ContactTime = 0.0,
) -> Points:
    """Return the points of a body that rises to given heights between bounces; the first one is its release height.

    Parameters and errors are as in `of_times`, with heights in place of instants. The contact time gives the load.
    """
    contact = contact_time if isinstance(contact_time, Pair) else number("contact_time", contact_time, _ERRORS)
    parts = []
    for i, (drop_heights, labels) in enumerate(drops):
        heights = array("heights", drop_heights, _FINITE)
        if (low := heights <= 0).any():
            k = int(np.argmax(low))
            raise ValueError(f"{labels[k]}: the height is {heights[k]:g}: expected a number > 0")
        if len(heights) < 2:
            continue
        errors = _errors(sigma, i, heights, "m")
        launch = flight.launch_to(heights)
        parts.append(_points(flight, launch, _rows(flight.launch_to_slope(heights) * errors), labels[1:]))
    if not parts:
        raise TooFew("no drop has two heights: expected the height of release and a rebound, or more")
    return _weighted(together(parts), contact, flight)


def _weighted(points: Points, contact: ContactTime, flight: Flight) -> Points:
    """Return the points with the load of the body's weight during contacts."""
    # The scale v_G of the load comes from measured durations of contact, if there are any.
    contact_or_times = contact if points.contact_time is None else points.contact_time
    return replace(points, weight_speed=weight_speed(contact_or_times, flight.gravity, points.speed, points.epsilon))


def of_speeds(
    speed: FloatArray,
    after: FloatArray,
    *,
    sigma: float | FloatArray,
    sigma_after: float | FloatArray,
    labels: Sequence[str],
) -> Points:
    """Return the points of collisions from the speeds before and after, with their standard errors."""
    epsilon = after / speed
    errors, errors_after = (
        _rows(np.broadcast_to(standard_error, speed.shape)) for standard_error in (sigma, sigma_after)
    )
    # d eps = d v_after/v - eps d v/v
    epsilon_errors = sparse.hstack([_rows(-epsilon / speed) @ errors, _rows(1 / speed) @ errors_after], format="csr")
    speed_errors = sparse.hstack([errors, errors * 0], format="csr")
    return Points(speed, epsilon, sparse.csr_array(speed_errors), sparse.csr_array(epsilon_errors), tuple(labels))


def _errors(sigma: float | Sequence[FloatArray], drop: int, values: FloatArray, unit: str) -> FloatArray:
    """Return the standard error of each value in a drop."""
    sigmas = sigma if isinstance(sigma, list | tuple) else without_unit("sigma", sigma, unit)
    drop_sigma = sigmas[drop] if isinstance(sigmas, Sequence) or np.ndim(sigmas) else sigmas
    return np.broadcast_to(array("sigma", without_unit("sigma", drop_sigma, unit), _ERRORS), values.shape)


def _points(flight: Flight, launch: FloatArray, launch_errors: sparse.sparray, labels: Sequence[str]) -> Points:
    """Return the points of successive flights from their launch speeds and the errors of these."""
    speed = flight.impact(launch[:-1])
    epsilon = launch[1:] / speed
    launch_errors = sparse.csr_array(launch_errors)
    # d v = (dv/du) d u of the flight before, d eps = (d u_after - eps d v)/v
    speed_errors = _rows(flight.impact_slope(launch[:-1])) @ launch_errors[:-1]
    epsilon_errors = _rows(1 / speed) @ (launch_errors[1:] - _rows(epsilon) @ speed_errors)
    return Points(speed, epsilon, sparse.csr_array(speed_errors), sparse.csr_array(epsilon_errors), tuple(labels))


def _rows(values: FloatArray) -> sparse.sparray:
    """Return a diagonal matrix."""
    return sparse.diags_array(values)


def together(parts: Sequence[Points]) -> Points:
    """Return the points of several tables or drops, whose errors are independent."""
    # Either all tables have complete errors, or none: the fit has one scatter.
    completeness = {part.known for part in parts}
    if len(completeness) > 1:
        raise ValueError("only some tables have a column sigma_epsilon: expected all or none of them, or --scatter")
    times = [part.contact_time for part in parts if part.contact_time is not None]
    return Points(
        np.concatenate([part.speed for part in parts]),
        np.concatenate([part.epsilon for part in parts]),
        sparse.block_diag([part.speed_errors for part in parts], format="csr"),
        sparse.block_diag([part.epsilon_errors for part in parts], format="csr"),
        tuple(label for part in parts for label in part.labels),
        np.concatenate(times) if len(times) == len(parts) else None,
        completeness.pop(),
        masked=sum(part.masked for part in parts),
        weight_speed=math.prod(part.weight_speed ** (len(part) / sum(map(len, parts))) for part in parts),
    )
