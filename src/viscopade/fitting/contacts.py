"""Contacts of a body that falls on a plane: their duration, and the load of the body's weight in them.

At an impact speed v the load is G = (v_G/v)^(6/5), where v_G is the speed at which it is 1. v_G follows from a pair of
bodies, or from measured contact times and the kappa of each measured eps.
"""

from __future__ import annotations

import numpy as np

from viscopade.arrays.checked import FloatArray
from viscopade.collision.spheres import Pair
from viscopade.fitting import weight_table
from viscopade.theory.law import VISCOELASTIC

ContactTime = float | Pair
"""Time from first contact until the body is back at that height; or the bodies, from which the law gives it."""

LEAST_EPSILON = 1e-6
"""Smaller eps have the contact time of this one: it grows without bound as eps falls to 0, which noise may measure.

Chosen by hand, below any eps that is measured.
"""

# Rounds until contact times and loads agree: each divides the error by 7 or more up to G = 0.3 (measured), so that
# 1e-7 of the load is left.
_ROUNDS = 8


def weight_speed(contact: ContactTime | FloatArray, gravity: float, speed: FloatArray, epsilon: FloatArray) -> float:
    """Return v_G, the speed at which the load is 1; 0 if it is not known, or for two spheres.

    Weight does not press two spheres in free fall on each other.

    Parameters
    ----------
    contact : float, Pair or array
        As `ContactTime`; or an array with the time during which the force acts at each speed.
    gravity : float
        Acceleration of the falling body at rest, in the units of the speeds and times.
    speed, epsilon : array
        Measured impact speeds and eps.
    """
    if isinstance(contact, Pair):
        falls = contact.first.is_wall or contact.second.is_wall
        # G(v) = g T/v with the pair's time scale T ~ v^(-1/5), so G = (v_G/v)^(6/5) and, from T at v = 1,
        # v_G = G(1)^(5/6).
        return float((gravity * contact.time_scale(1.0)) ** (5 / 6)) if falls else 0.0
    is_measured = np.broadcast_to(contact, speed.shape) > 0
    if not is_measured.any():
        return 0.0
    times, v, e = np.broadcast_to(contact, speed.shape)[is_measured], speed[is_measured], epsilon[is_measured]
    # A measured duration ends where the force vanishes; a time between flights, where the body is back at its height.
    scaled_time = weight_table.duration if np.ndim(contact) else weight_table.return_time
    # The first guess is the scaled contact time without damping and weight, 3.218.
    scaled: FloatArray | float = float(VISCOELASTIC.contact_time)
    for _ in range(_ROUNDS):
        # G = g t_c/(tau_c v), where tau_c depends on kappa, and so on eps and G again
        load = gravity * times / (scaled * v)
        scaled = scaled_time(weight_table.kappa_from(e, load), load)
    # G = (v_G/v)^(6/5) gives ln v_G = ln v + ln G/1.2, the mean over the points
    return float(np.exp(np.mean(np.log(load) / 1.2 + np.log(v))))


def contact_durations(
    contact: ContactTime | FloatArray, speed: FloatArray, epsilon: FloatArray, unit_load_speed: float
) -> FloatArray:
    """Return the times from first contact until the body is back at that height.

    `contact` is such a time (one for all), or the Pair of bodies, or an array with the measured times during which the
    force acts. `speed` and `epsilon` are those of the impacts, and `unit_load_speed` is v_G.
    """
    if isinstance(contact, Pair) or np.ndim(contact):
        load = weight_table.load_at(speed, unit_load_speed)
        kappa = weight_table.kappa_from(np.clip(epsilon, LEAST_EPSILON, 1.0), load)
        scaled_return = weight_table.return_time(kappa, load)
        if isinstance(contact, Pair):
            # t = tau T(v), with the pair's time scale T(v) = (rho/m)^(-2/5) v^(-1/5)
            return np.asarray(scaled_return * contact.time_scale(speed))
        # The rise from the measured end of the force to the height of first contact, as a ratio of scaled times
        return np.asarray(contact * scaled_return / weight_table.duration(kappa, load))
    return np.full(speed.shape, contact)
