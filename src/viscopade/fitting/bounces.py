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
from viscopade.fitting.contacts import LEAST_EPSILON, ContactTime, contact_durations, weight_speed
from viscopade.fitting.flight import Flight
from viscopade.fitting.points import Points

MOST_INSTANTS = 20_000
"""Largest number of instants of bounces in a file.

Chosen by hand: the costs of `audible_bounces`, four kinds and 231 ratios for each instant, then take 150 MB.
"""

_FINITE = Accepted("a finite number", np.isfinite)
_ERRORS = Accepted("a number >= 0", lambda x: x >= 0)
# Speeds give contact times, which shorten the flights and change the speeds. Each round makes the change smaller by
# about the share of the contact in the flight, below 1/10 in real bounces: eight rounds leave 1e-8 of a contact time.
_ROUNDS = 8
_SETTLED = 1e-12  # relative change that ends an iteration: a few thousand roundings, so it is always reached
# Rounds until a speed and its eps give the speed after the bounce: each divides the error by 3 or more, so that 3^-40 =
# 1e-19 of it would be left.
_LAW_ROUNDS = 40

HEARING = 1e-3
"""Standard error in seconds that `audible_bounces` assumes for instants, chosen by hand for recorded sounds."""
# Costs are squares of deviations in standard errors, as chi^2 is. The four numbers were chosen together by hand, with
# simulated series of eight bounces: with them 95 % of the eps between three recorded bounces are found, and at most 1 %
# of the series have a wrong eps for eps of 0.8 and 0.9, 3 % for 0.7 (tests/fitting/test_bounces.py).
_LOST = 16.0  # cost of an echo, and of a bounce that was not heard: as unlikely as four standard errors
_UNLIKE = 35.0  # cost of two flights of different drops: above the 32 of an echo and a missed bounce together
_DISTINCT = 9.0  # a sound is ambiguous if the costs of two of its roles differ by less: three standard errors
_VARIATION = 0.04  # standard deviation of ln(T_2/T_1), so of eps from bounce to bounce, relative
# Repeated drops from one height: the first rebound loses more than 5 % of the speed, which a fit can tell from errors,
# and the next ones lose less than 0.3 of this. A body that bounces on loses about the same share each time. By hand.
_LOSS, _LIKE = 0.05, 0.3
_RISE = 3.0  # standard errors by which a rebound may be higher than the height before it: 1 of 700 does by chance
# Times of the frames of a recording, in contrast to bounces, whose spans get shorter: five spans or more; their range
# is at most 0.4 of their mean, as eps of 0.9 gives in four bounces; and their mean hardly changes, by less than 1e-3 a
# span, which is less than a real body loses. All three were chosen by hand.
_FEWEST_SPANS, _RANGE_OF_SPANS, _CHANGE_OF_SPANS = 5, 0.4, 1e-3
# Ratios r of two successive flights, about eps: from 0.1, where a third bounce can hardly be heard, to 1, in steps of
# 1 %, a quarter of `_VARIATION`. (arange stops before its end; 1e-9 includes ln 1 = 0 up to round-off.)
_RATIOS = np.exp(np.arange(math.log(0.1), 1e-9, 0.01))
# Four kinds of intervals between two bounces that are heard: 0, one flight; 1, one flight with an echo in it; 2, two
# flights, because the bounce between them was not heard; 3, two flights and an echo. `_STEP` is the number of sounds
# from one bounce to the next.
_STEP, _MISSED = np.array([1, 2, 1, 2]), np.array([[False], [False], [True], [True]])
_COST = np.array([[0.0], [_LOST], [_LOST], [2 * _LOST]])
# Heights: the exponents p of the laws that a fit compares, and standard deviations of ln eps up to `_VARIATION`. With
# smaller ones a change of eps would be an unseen rebound. By hand, with the simulated drops of test_bounces.py.
_EXPONENTS_OF_LOSS, _SCATTERS = (0.0, 0.2, 1.0), (0.01, 0.02, _VARIATION)
_UNSEEN = "a rebound before it was not measured"
# Roles of a sound. Less than 16: a bounce; the number is 4 times the kind of interval before it plus the kind after it.
_ECHO, _END_OF_DROP = 16, 17


class TooFew(ValueError):
    """There are not enough bounces or heights for one eps."""


def audible_bounces(instants: FloatArray, sigma: float = HEARING) -> tuple[list[list[int]], list[tuple[int, str]]]:
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
    if n < 3:  # an eps needs two flights, which are three bounces
        return [], []
    # Before the first sound and after the last one there are none: there, costs are NaN, which fmin and nanmin skip. An
    # interval has up to two steps, so two instants are added at each end, and `padded[j + 2]` is that of sound j.
    padded = np.concatenate([[math.nan] * 2, instants, [math.nan] * 2])
    # An interval with a missed bounce has the flights T and r T: the last is r/(1 + r) of it, the first 1/(1 + r).
    last_share, first_share = (np.where(_MISSED, flight / (1 + r), 1.0) for flight in (r, np.ones_like(r)))
    kinds = np.arange(4)  # of intervals, as `_STEP` has them

    def pair_costs(j: int) -> FloatArray:
        """Return the costs of the two flights next to sound j, (ln(T_2/(r T_1))/s)^2.

        The axes are the kind of interval before it, the kind after it, and r.
        """
        # 1/T_1 and 1/T_2, of the flights next to the sound
        rate_before = 1 / ((padded[j + 2] - padded[j + 2 - _STEP])[:, None] * last_share)[:, None]
        rate_after = 1 / ((padded[j + 2 + _STEP] - padded[j + 2])[:, None] * first_share)
        with np.errstate(over="ignore"):
            # s^2 = 0.04^2 + sigma^2 (1/T_1^2 + 1/T_2^2 + (1/T_1 + 1/T_2)^2): ln T_2 - ln T_1 changes by 1/T_1 + 1/T_2
            # with the instant between the flights, and by 1/T_1 and 1/T_2 with the other two. A span near 0 may give an
            # infinite variance, and the cost 0.
            variance = (
                _VARIATION**2
                + np.square(sigma * rate_before)
                + np.square(sigma * rate_after)
                + np.square(sigma * (rate_before + rate_after))
            )
        # (ln(T_2/(r T_1))/s)^2
        return np.asarray(np.log(rate_before / (rate_after * r)) ** 2 / variance)

    # Forward: the least cost of all sounds before, if the sound is a bounce. It adds up along the shortest path: the
    # cost up to a bounce, of its pair of flights, and of the interval after it. The first sound is a bounce.
    cost_to = np.full((n + 2, 4, len(r)), math.inf)  # least cost up to a sound, by the kind of interval before it
    cost_to[_STEP, kinds] = _COST
    for j in range(1, n - 1):
        cost_by_kind_after = (cost_to[j][:, None] + np.fmin(pair_costs(j), _UNLIKE)).min(axis=0) + _COST
        cost_to[j + _STEP, kinds] = np.minimum(cost_to[j + _STEP, kinds], cost_by_kind_after)
    # Backward: the same from the last sound on. Both together are the least cost of a reading with a role of the sound.
    cost_from = np.full((2, 4, len(r)), math.inf)  # least cost from the next sound and the one after it, by the same
    cost_from[0] = 0.0
    roles = []
    for j in range(n - 2, 0, -1):
        pairs, cost_after = pair_costs(j), _COST + cost_from[_STEP - 1, kinds]
        # As a bounce, it costs what is before, the pair of flights, and what is after; or 35 instead of the pair.
        bounce_costs = cost_to[j][:, None] + cost_after
        # As an echo, it lies in an interval of two steps, between the sounds next to it.
        echo_costs = (cost_to[j + 1] + cost_from[0])[_STEP == 2]
        # The order is that of the roles' numbers: the minimum over r (axis 2) for each of 16 bounces, then the others.
        costs = [
            *np.nanmin(bounce_costs + pairs, axis=2, initial=math.inf).ravel(),
            echo_costs.min(),
            bounce_costs.min() + _UNLIKE,
        ]
        roles.append(np.array(costs))
        cost_from = np.array([(np.fmin(pairs, _UNLIKE) + cost_after).min(axis=1), cost_from[0]])
    return _runs(roles[::-1])


def _runs(roles: Sequence[FloatArray]) -> tuple[list[list[int]], list[tuple[int, str]]]:
    """Return the runs of bounces, and the sounds that are left out, each with the reason; sounds are given by index.

    `roles` has for each sound, from the second to the last but one, the costs of its 18 roles (see `_ECHO`).
    """
    runs: list[list[int]] = []
    left_out = []
    for j, costs in enumerate(roles, 1):
        # The cheapest role decides, if it is cheaper than the second one by enough.
        best, second = np.argsort(costs)[:2].tolist()
        before, after = divmod(best, 4)  # kinds of the intervals
        if costs[second] < costs[best] + _DISTINCT:
            left_out.append((j, f"ambiguous: {_role_in_words(best)}, or {_role_in_words(second)}"))
        elif best in (_ECHO, _END_OF_DROP) or _MISSED[before] or _MISSED[after]:
            left_out.append((j, _role_in_words(best)))
        # The bounce has whole flights on both sides: it belongs to the run whose last flight ends here, or begins one.
        elif runs and runs[-1][-2:] == [int(j - _STEP[before]), j]:
            runs[-1].append(int(j + _STEP[after]))
        else:
            runs.append([int(j - _STEP[before]), j, int(j + _STEP[after])])
    return runs, left_out


def _role_in_words(role: int) -> str:
    """Return a sound's role, a number as beside `_ECHO`, in words."""
    if role in (_ECHO, _END_OF_DROP):
        return "an echo or another sound" if role == _ECHO else "the first or last bounce of a drop"
    # role = 4 (kind of the interval before) + (kind after), because there are four kinds
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
    points_by_drop = []
    contact = contact_time if isinstance(contact_time, Pair) else number("contact_time", contact_time, _ERRORS)
    for i, (drop_instants, labels) in enumerate(drops):
        instants = array("instants", drop_instants, _FINITE)
        require_ascending(instants, labels)
        if len(instants) > 2:  # two flights, for one eps
            measured = array("contact_time", durations[i], _ERRORS) if len(durations) else None
            errors = _standard_errors(sigma, i, instants, "s")
            points_by_drop.append(_of_drop(instants, labels, flight, errors, contact, measured, of_flights))
    if not points_by_drop:
        raise TooFew("no drop has three bounces: expected three instants or more, for one eps")
    return _with_weight(concatenate(points_by_drop), contact, flight)


def require_ascending(instants: FloatArray, labels: Sequence[str]) -> None:
    """Raise ValueError if instants do not ascend; `labels` are their names for the message, such as "line 7"."""
    if (late := np.diff(instants) <= 0).any():
        k = int(np.argmax(late))
        text = f"{labels[k + 1]}: the bounce is at {instants[k + 1]:g}: expected later than the one before"
        # Positive numbers of which most fall are times of flight, which get shorter.
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
    """Raise ValueError if a body rises above the height that it fell from, by more than the errors of the heights.

    `heights` are successive ones in metres, `labels` their names, `sigma` their standard errors, and `advice` the end
    of the message.
    """
    # The difference of two heights has the error hypot of theirs; without errors, any rise is refused.
    if (high := np.diff(heights) > _RISE * np.hypot(sigma[1:], sigma[:-1])).any():
        k = int(np.argmax(high))
        text = f"the height {heights[k + 1]:.6g} m is above the one before it, {heights[k]:.6g} m: {advice}"
        raise ValueError(f"{labels[k + 1]}: {text}; --resolution gives the error of the heights")


def require_successive(drops: Sequence[FloatArray]) -> None:
    """Raise ValueError if rebounds hardly differ from each other, but from the drop: they are repetitions.

    `drops` has for each drop the height of release and those of the rebounds.
    """
    # Losses 1 - eps, with eps = (h_(k+1)/h_k)^(1/2): of the first rebounds (k = 0), and of all later ones.
    first, later = (
        [1 - math.sqrt(drop[k + 1] / drop[k]) for drop in drops for k in range(len(drop) - 1) if bool(k) == is_later]
        for is_later in (False, True)
    )
    # A real body loses about as much in later rebounds as in the first one. _LOSS, 5 %, and _LIKE, 0.3, are by hand.
    if later and np.median(first) > _LOSS and np.median(later) < _LIKE * np.median(first):
        text = "the rebounds hardly lose height after the first one: are they repetitions, from one height?"
        raise ValueError(f"{text} Then expected a row for each, with the columns H and h")


def unseen_rebounds(drops: Sequence[tuple[FloatArray, FloatArray]]) -> list[list[tuple[int, str]]]:
    """Return the heights of drops before which a rebound was not measured, or may not have been.

    Two successive heights are those of one bounce, or of two, with a rebound between them that was not measured, which
    costs 16. Losses are -ln eps = a v^p, with one a, p and scatter of all drops. The difference of a measured loss from
    it costs its square in standard errors, plus the logarithm of their square, as in -2 ln L. The sum is minimised over
    a, p and the scatter. A height is ambiguous, and also returned, if the other number of bounces costs less than 9
    more.

    Parameters
    ----------
    drops : sequence
        For each drop the heights and their standard errors.

    Returns
    -------
    list of list of tuple
        For each drop the index of each such height, and the reason in words.
    """
    falls = np.concatenate([heights[:-1] for heights, _ in drops])
    ratios = np.concatenate([heights[1:] / heights[:-1] for heights, _ in drops])
    # eps = (h_(k+1)/h_k)^(1/2), so that half of the relative variances of both heights is that of ln eps
    relative = [np.square(sigma / heights) for heights, sigma in drops]
    measured_variance = np.concatenate([(square[1:] + square[:-1]) / 4 for square in relative])
    losses, ln_speed = -np.log(ratios) / 2, np.log(falls / falls[0]) / 2
    ln_speed -= ln_speed.mean()
    # Costs of each pair of heights as one bounce and as two, minimised over all parameters with that number for it.
    cost_as = np.full((2, len(losses)), math.inf)
    for p in _EXPONENTS_OF_LOSS:
        # The second bounce is slower: v^p is less by the factor eps^p, where eps is the root of the measured one.
        one = -np.log(_RATIOS)[:, None] * np.exp(p * ln_speed)
        two = one * (1 + ratios ** (p / 4))
        for scatter in _SCATTERS:
            variance = scatter**2 + measured_variance
            costs = np.array([(losses - one) ** 2, (losses - two) ** 2]) / variance + np.log(variance)
            costs[1] += _LOST
            least = costs.min(axis=0)
            total = least.sum(axis=1, keepdims=True)
            cost_as = np.minimum(cost_as, (total - least + costs).min(axis=1))
    more_as_two = cost_as[1] - cost_as[0]
    unseen_by_drop, begin = [], 0
    for heights, _ in drops:
        differences = more_as_two[begin : (begin := begin + len(heights) - 1)]
        unseen_by_drop.append(
            [
                (int(k) + 1, _UNSEEN if differences[k] < -_DISTINCT else f"ambiguous: {_UNSEEN}, or more was lost")
                for k in np.flatnonzero(differences < _DISTINCT)
            ]
        )
    return unseen_by_drop


def evenly_spaced(times: FloatArray, digit: float = 0.0) -> bool:
    """Return whether times are those of a recording: the flights of a body that bounces get shorter.

    `digit` is one unit in the last digit of the times.
    """
    # Enough spans, of nearly equal length (times beside a column e need not ascend: their mean span may be below 0)
    spans, half = np.diff(times), (len(times) - 1) // 2
    if len(spans) < _FEWEST_SPANS or not np.ptp(spans) <= _RANGE_OF_SPANS * abs(spans.mean()):
        return False
    # First half and second half of the recording, whose middles are about `half` spans apart: the mean spans of a fixed
    # rate are equal, up to their last digit. The first and the last time of a half may each miss it by a unit: 2 digits
    # over its duration, half times the mean span.
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
    """Return the points of the bounces of one drop, except for the first and the last one.

    `instants` are those of impacts, `labels` their names, and `sigma` their standard errors. Contacts last for
    `contact_time`, or are those of a Pair, or the measured `durations`. `of_flights`: `sigma` are independent errors of
    the flights that end there.
    """
    spans = np.diff(instants)
    contact = contact_time if durations is None else durations[:-1]  # no flight follows the last bounce
    contacts = np.zeros_like(spans) + (0.0 if isinstance(contact, Pair) else contact)
    # Speeds give contact times, which shorten the flights and so change the speeds: iterate. A number is fixed.
    for _ in range(1 if isinstance(contact, float) else _ROUNDS):
        if (short := contacts >= spans).any():
            k = int(np.argmax(short))
            cause = "are the radius and Young's modulus" if isinstance(contact, Pair) else "is the contact time"
            text = f"the bounce is {spans[k]:.4g} s after the last one, but a contact takes {contacts[k]:.4g} s"
            raise ValueError(f"{labels[k + 1]}: {text}: {cause} right?")
        launch = flight.launch(spans - contacts)
        speed = flight.impact(launch[:-1])
        # The body launched after a contact lands at `impact`: eps is the next launch over this. Only contact times use
        # it here, and the law has them for eps up to 1.
        epsilon = np.clip(launch[1:] / speed, LEAST_EPSILON, 1.0)
        # Only bounces with a flight on both sides have an eps; the first speed comes from the law.
        if not isinstance(contact, float):
            inner_contact = contact if durations is None else durations[1:-1]
            unit_load_speed = weight_speed(inner_contact, flight.gravity, speed, epsilon)
            speed = np.append(_first_speed(launch[0], speed, epsilon, unit_load_speed), speed)
            last_contacts, contacts = contacts, contact_durations(contact, speed, launch / speed, unit_load_speed)
            if np.all(np.abs(contacts - last_contacts) <= _SETTLED * contacts):
                break
    # The errors of spans (rows) by those of instants (columns). Span i is t_(i+1) - t_i. A late instant lengthens the
    # flight before, and shortens the one after, unless the end of contact was measured: then the end has an error of
    # its own.
    ends, starts = (
        sparse.diags_array([sign], offsets=[k], shape=(len(spans), len(instants))) @ _diagonal(sigma)
        for sign, k in ((1.0, 1), (-1.0, 0))
    )
    span_errors = ends if of_flights else ends + starts if durations is None else sparse.hstack([ends, starts])
    points = _points_of_flights(flight, launch, _diagonal(flight.launch_slope(launch)) @ span_errors, labels[1:-1])
    return points if durations is None else replace(points, contact_time=durations[1:-1])


def _first_speed(launch: float, speed: FloatArray, epsilon: FloatArray, unit_load_speed: float) -> float:
    """Return the impact speed v of a drop's first bounce, by the viscoelastic law.

    `launch` is the speed after it, `speed` and `epsilon` are those of the other bounces, and `unit_load_speed` is v_G,
    at which the load of the weight is 1.
    """
    # kappa = beta v^(1/5) at the kappa of each measured eps: the other bounces give beta, by their median.
    beta = np.median(weight_table.kappa_from(epsilon, weight_table.load_at(speed, unit_load_speed)) * speed**-0.2)
    # Solve v eps(v) = launch by v = launch/eps(v), from v = launch. Without weight eps falls at most as v^(-1/3), its
    # limit for fast impacts, so each round divides the error by 3 or more. A tiny LEAST_EPSILON replaces an eps of 0.
    first = np.array(launch)
    for _ in range(_LAW_ROUNDS):
        rebound = weight_table.epsilon(beta * first**0.2, weight_table.load_at(first, unit_load_speed))
        last_first, first = first, launch / np.maximum(rebound, LEAST_EPSILON)
        if abs(first - last_first) <= _SETTLED * first:
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

    Parameters and errors are as in `of_times`, with heights in place of instants (in the units of `flight`): `drops`
    has the heights of each drop and their labels, `sigma` their standard errors. `contact_time` gives the load of the
    weight.
    """
    contact = contact_time if isinstance(contact_time, Pair) else number("contact_time", contact_time, _ERRORS)
    points_by_drop = []
    for i, (drop_heights, labels) in enumerate(drops):
        heights = array("heights", drop_heights, _FINITE)
        if (low := heights <= 0).any():
            k = int(np.argmax(low))
            raise ValueError(f"{labels[k]}: the height is {heights[k]:g}: expected a number > 0")
        if len(heights) < 2:  # a fall and a rebound, for one eps
            continue
        # A body that falls from a height lands as fast as one that was launched to this height.
        launch, errors = flight.launch_to(heights), _standard_errors(sigma, i, heights, "m")
        launch_errors = _diagonal(flight.launch_to_slope(heights) * errors)
        points_by_drop.append(_points_of_flights(flight, launch, launch_errors, labels[1:]))
    if not points_by_drop:
        raise TooFew("no drop has two heights: expected the height of release and a rebound, or more")
    return _with_weight(concatenate(points_by_drop), contact, flight)


def _with_weight(points: Points, contact: ContactTime, flight: Flight) -> Points:
    """Return the points with v_G, the speed at which the load of the body's weight during the contact is 1."""
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
    """Return the points of collisions from the speeds before and `after`.

    `sigma` and `sigma_after` are their standard errors, in the unit of the speeds; `labels` name the points.
    """
    epsilon = after / speed
    errors, errors_after = (
        _diagonal(np.broadcast_to(standard_error, speed.shape)) for standard_error in (sigma, sigma_after)
    )
    # d eps = d v_after/v - eps d v/v: columns with the errors of all v, then those of all v_after
    epsilon_errors = sparse.hstack(
        [_diagonal(-epsilon / speed) @ errors, _diagonal(1 / speed) @ errors_after], format="csr"
    )
    speed_errors = sparse.hstack([errors, errors * 0], format="csr")
    return Points(speed, epsilon, sparse.csr_array(speed_errors), sparse.csr_array(epsilon_errors), tuple(labels))


def _standard_errors(sigma: float | Sequence[FloatArray], drop: int, values: FloatArray, unit: str) -> FloatArray:
    """Return the standard error of each value in a drop; `sigma` is one number, or an array for each drop."""
    sigmas = sigma if isinstance(sigma, list | tuple) else without_unit("sigma", sigma, unit)
    drop_sigma = sigmas[drop] if isinstance(sigmas, Sequence) or np.ndim(sigmas) else sigmas
    return np.broadcast_to(array("sigma", without_unit("sigma", drop_sigma, unit), _ERRORS), values.shape)


def _points_of_flights(
    flight: Flight, launch: FloatArray, launch_errors: sparse.sparray, labels: Sequence[str]
) -> Points:
    """Return the points of the bounces between successive flights.

    `launch` has the speeds u at which the flights start, and `launch_errors` the change of u of each flight (row) by
    one standard deviation of each independent error (column). `labels` name the bounces.
    """
    speed = flight.impact(launch[:-1])
    epsilon = launch[1:] / speed
    launch_errors = sparse.csr_array(launch_errors)
    # d v = (dv/du) d u of the flight before, d eps = (d u_after - eps d v)/v
    speed_errors = _diagonal(flight.impact_slope(launch[:-1])) @ launch_errors[:-1]
    epsilon_errors = _diagonal(1 / speed) @ (launch_errors[1:] - _diagonal(epsilon) @ speed_errors)
    return Points(speed, epsilon, sparse.csr_array(speed_errors), sparse.csr_array(epsilon_errors), tuple(labels))


def _diagonal(values: FloatArray) -> sparse.sparray:
    """Return the sparse diagonal matrix of values: on the left of another matrix it multiplies its rows."""
    return sparse.diags_array(values)


def concatenate(tables: Sequence[Points]) -> Points:
    """Return the points of several tables or drops, whose errors are independent, as one table."""
    # Either all tables have complete errors, or none: the fit has one scatter.
    completeness = {table.errors_complete for table in tables}
    if len(completeness) > 1:
        raise ValueError("only some tables have a column sigma_epsilon: expected all or none of them, or --scatter")
    times = [table.contact_time for table in tables if table.contact_time is not None]
    return Points(
        np.concatenate([table.speed for table in tables]),
        np.concatenate([table.epsilon for table in tables]),
        # Each table has errors of its own: blocks on the diagonal.
        sparse.block_diag([table.speed_errors for table in tables], format="csr"),
        sparse.block_diag([table.epsilon_errors for table in tables], format="csr"),
        tuple(label for table in tables for label in table.labels),
        np.concatenate(times) if len(times) == len(tables) else None,
        completeness.pop(),
        masked=sum(table.masked for table in tables),
        # The geometric mean of v_G, weighted with the numbers of points; 0 if a table has none.
        weight_speed=math.prod(table.weight_speed ** (len(table) / sum(map(len, tables))) for table in tables),
    )
