"""Table of the collision of a viscoelastic sphere that falls on a plane, in kappa and the load G.

A fit of many bounces needs eps and the contact time at each of them, thousands of times, and `Contact.collide` takes
10 ms. The collisions at the nodes are a record of the package, and sampled. In p = x^(1/2) and dt = 2 p dsigma the
scaled equation and the loss of energy kappa L are polynomial, so Taylor series in sigma solve it for all nodes at once:

    p' = v,    v' = 2 p (G - p^3) - 2 kappa p^2 v,    t' = 2 p,    L' = 4 p^2 v^2.

Contact ends where p^2 + kappa v = 0. The sphere then rebounds at w and is still compressed by x_c = kappa w. With the
energy of the spring, which is lost, eps^2 = w^2 - 2 G x_c = 1 - kappa D, where D = L + 4/5 x_c^(5/2)/kappa. A load
above G_s keeps the sphere down. There w = 2 G kappa, and the motion from it back to the first contact gives
G_s(kappa). The table has ln D and the contact time as splines in ln kappa and G/G_s.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from viscopade.arrays import double
from viscopade.arrays.checked import FloatArray
from viscopade.store import recorded

LEAST, LARGEST = 9e-4, 6.5
"""Range of kappa in the table: eps without weight is 0.999 and 0.05. Below it D hardly changes with kappa."""

# Numbers of nodes in ln kappa and in arcsin (G/G_s)^(1/2), and the degree of the splines, chosen by hand: eps and the
# duration are then within 1e-8 of `Contact.collide` (tests/fitting/test_weight_table.py). Fewer nodes or a lower degree
# show as a larger error in this test.
_NODES = 81, 53
_DEGREE = 5
# Order of the Taylor series, and its step over the time scale of the motion, chosen by hand together: the terms that
# are left out are about 0.2^17 = 1e-12, far below the 1e-8 of the splines.
_ORDER, _STEP = 16, 0.2
_HALVINGS = 50  # of an interval in which a zero is sought: 2^-50 = 1e-15 of it remain, near round-off
_CLOSE = 1e-14  # error of a kappa, relative, and of eps: about 50 units of round-off, so that the search always ends


Row = tuple[float, ...]


class Nodes(NamedTuple):
    """Collisions at the nodes of the table: G_s at each kappa; ln D and the duration by kappa and G/G_s."""

    kappa: Row
    sticking: Row
    loss: tuple[Row, ...]
    duration: tuple[Row, ...]


class _Table(NamedTuple):
    """Splines: ln G_s in ln kappa; ln D and the duration in ln kappa and arcsin (G/G_s)^(1/2)."""

    sticking: Callable[..., FloatArray]
    loss: Callable[..., FloatArray]
    duration: Callable[..., FloatArray]


def load_at(speed: FloatArray, unit_speed: float) -> FloatArray:
    """Return the loads G at impact speeds of one body on one plane, from the speed v_G at which the load is 1."""
    # G = (F0/m) (rho/m)^(-2/5) v^(-6/5) = (v_G/v)^(6/5)
    return np.asarray((unit_speed / speed) ** 1.2)


def epsilon(kappa: FloatArray, load: FloatArray) -> FloatArray:
    """Return eps at each kappa and load G; 0 for a sphere that stays down.

    Beyond the table weight is assumed to change eps by the same factor as at its largest kappa.
    """
    place = _place(kappa, load)
    k = place.kappa
    # eps^2 = 1 - kappa D, with the D of the nearest kappa k in the table
    squares = 1 - np.minimum(kappa, k) * np.exp(_table().loss(np.log(k), place.arcsine))
    rebound = np.sqrt(np.where(place.stays_down, 0.0, np.maximum(squares, 0.0)))
    # Beyond: eps(kappa, G) = eps(k, G) eps(kappa, 0)/eps(k, 0), without weight at v* = kappa^(1/2)
    beyond = kappa > k
    return (
        rebound * double.epsilon(np.sqrt(kappa)) / double.epsilon(np.sqrt(np.minimum(kappa, k)))
        if beyond.any()
        else rebound
    )


def duration(kappa: FloatArray, load: FloatArray) -> FloatArray:
    """Return the scaled time tau_c during which the force acts; for a sphere that stays down, its value at G_s.

    Times are in units of the contact's time scale (rho/m)^(-2/5) v^(-1/5).
    """
    place = _place(kappa, load)
    return _table().duration(np.log(place.kappa), place.arcsine)


def return_time(kappa: FloatArray, load: FloatArray) -> FloatArray:
    """Return the scaled time (in the unit of `duration`) from first contact until the sphere is back at that height.

    When the force vanishes, the sphere is still lower by x_c = kappa w, and rises at the speed w; at that height its
    speed is eps.
    """
    rebound, pull = epsilon(kappa, load), kappa * load
    # eps^2 = w^2 - 2 G x_c with x_c = kappa w gives w = kappa G + ((kappa G)^2 + eps^2)^(1/2).
    w = pull + np.hypot(pull, rebound)
    # The rise x_c at the mean speed (w + eps)/2 takes 2 kappa w/(w + eps) under the load. The least double, instead of
    # 0, is for a sphere that stays down without a load.
    return duration(kappa, load) + 2 * kappa * w / np.maximum(w + rebound, np.finfo(float).tiny)


def kappa_from(target: FloatArray, load: FloatArray) -> FloatArray:
    """Return the kappa that gives each eps (`target`) at each load; 0 for an eps of 1 or more, and infinite for 0."""
    # An eps of 0 has no finite v*; the last line gives it infinity. 1e-300 stands for it: any tiny double would do.
    inside = np.clip(target, 1e-300, 1.0)
    # The root lies between a and b. Weight increases the loss, so kappa is at most the one without weight, v*^2. In the
    # table kappa >= LEAST; below it 1 - eps^2 = kappa D, where D is that at LEAST, and so at most 1/LEAST, because
    # kappa D <= 1. So kappa >= (1 - eps^2) LEAST. Half of it, and 1 % more than v*^2, are margins against round-off, by
    # hand: wider ones only cost rounds. Between, Chandrupatla's method (1997).
    a, b = (1 - inside**2) * LEAST / 2, 1.01 * np.asarray(double.v_star_from(inside)) ** 2
    fa, fb = epsilon(a, load) - target, epsilon(b, load) - target
    # t, as in his paper, is the share of the interval at which the next point lies: first a bisection
    t = np.full_like(b, 0.5)
    # 15 rounds are enough in the range of the table (measured); _HALVINGS, 50, would be enough for bisection alone.
    for _ in range(_HALVINGS):
        # A new point x between a and b: it is the next a, and the b is the old a or b on the other side of the root; c
        # is the one given up. A body whose search has ended has t = 0, so that x = a.
        x = a + t * (b - a)
        fx = epsilon(x, load) - target
        same_sign = (fx > 0) == (fa > 0)
        c, fc = np.where(same_sign, (a, fa), (b, fb))
        b, fb = np.where(same_sign, (b, fb), (a, fa))
        a, fa = x, fx
        with np.errstate(all="ignore"):
            # The relative tolerance of a, as a share of the interval: the next point is at least so far from both ends.
            # 1/2, the largest share that two sides allow, if the interval is as small.
            t_tolerance = np.fmin(_CLOSE * a / np.abs(b - a), 0.5)
            xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb)
            # Inverse quadratic interpolation through a, b and c gives this t. It is monotone between a and b, so that
            # the new point lies there, if phi^2 < xi and (1 - phi)^2 < 1 - xi; else bisection, t = 1/2.
            t_quadratic = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
        converged = (t_tolerance == 0.5) | (np.abs(fa) <= _CLOSE)
        if converged.all():
            break
        monotone = (phi**2 < xi) & ((1 - phi) ** 2 < 1 - xi)
        t_next = np.clip(np.where(monotone, t_quadratic, 0.5), t_tolerance, 1 - t_tolerance)
        t = np.where(converged, 0.0, t_next)
    return np.where(target <= 0, math.inf, a)


class _Place(NamedTuple):
    """A place in the table: kappa, arcsin (G/G_s)^(1/2), and whether the sphere stays down, G >= G_s."""

    kappa: FloatArray
    arcsine: FloatArray
    stays_down: npt.NDArray[np.bool_]


def _place(kappa: FloatArray, load: FloatArray) -> _Place:
    """Return the place in the table of each kappa, or of the nearest one in it, and each load G.

    Equally spaced nodes of this arcsine are dense near both ends, G = 0 and G = G_s, as Chebyshev's are: splines of
    high degree are good there, too.
    """
    k, load = np.broadcast_arrays(np.clip(kappa, LEAST, LARGEST), load)
    load_over_sticking = load / np.exp(_table().sticking(np.log(k)))
    return _Place(k, np.arcsin(np.sqrt(np.minimum(load_over_sticking, 1.0))), load_over_sticking >= 1)


@cache
def _table() -> _Table:
    """Return the splines through the collisions at the nodes."""
    from scipy.interpolate import InterpolatedUnivariateSpline, RectBivariateSpline  # imported here: SciPy is optional

    nodes = collisions_at_nodes()
    ends = np.log(nodes.kappa), _arcsines_at_nodes()
    surfaces = (
        RectBivariateSpline(*ends, values, kx=_DEGREE, ky=_DEGREE).ev for values in (nodes.loss, nodes.duration)
    )
    return _Table(InterpolatedUnivariateSpline(ends[0], np.log(nodes.sticking), k=_DEGREE), *surfaces)


def _arcsines_at_nodes() -> FloatArray:
    """Return the values of arcsin (G/G_s)^(1/2) at the nodes: from 0, no load, to pi/2, G = G_s."""
    return np.linspace(0, math.pi / 2, _NODES[1])


@recorded("weight_table")
def collisions_at_nodes() -> Nodes:
    """Compute the collisions at the nodes: first the load G_s that just keeps a sphere down, then lesser loads."""
    # At G_s the sphere rebounds at w = 2 G kappa and comes to rest at x = 0: there w^2 = 2 G x_c with x_c = kappa w.
    # The motion backward from this end, p = x_c^(1/2) = kappa (2 G)^(1/2), gives the speed at first contact, which
    # scales kappa and G. So any guess of the load will do. In this one, kappa^(-6/11) is the law for small kappa: under
    # large loads x ~ G^(2/3) and x' ~ G^(5/6), so that the loss is kappa L ~ kappa G^(11/6). The other numbers were
    # fitted to G_s: the speed is then 0.6 to 1 (measured), and the nodes are nearly where kappa was taken. The factor
    # 1.2 keeps the last one above LARGEST after scaling: it is 7.01.
    kappa = np.geomspace(LEAST, 1.2 * LARGEST, _NODES[0])
    load = 0.375 * kappa ** (-6 / 11) * (1 + 0.8 * kappa) ** -2.2
    start = np.array([kappa * np.sqrt(2 * load), -2 * load * kappa, 0 * kappa, 0 * kappa])
    # Backward to p = 0, where x = 0. Scaled to a speed 1 at first contact, kappa changes by v^(1/5) and G by v^(-6/5).
    speed = _motion(start, kappa, load, -1, lambda p, v, k: p).v
    kappa, sticking = kappa * speed**0.2, load * speed**-1.2

    # From first contact (p = 0, v = 1) at each kappa and load, to the instant at which the force vanishes: p^2 + kappa
    # v = 0, or p = 0 without damping.
    shares = np.sin(_arcsines_at_nodes()) ** 2  # G/G_s
    k, g = (values.ravel() for values in np.broadcast_arrays(kappa[:, None], sticking[:, None] * shares))
    start = np.array([0 * k, 0 * k + 1, 0 * k, 0 * k])
    end = _motion(start, k, g, 1, lambda p, v, k: np.minimum(p, p**2 + k * v))
    # ln D: D = L + 4/5 x_c^(5/2)/kappa, with x_c = kappa |w|
    log_d = np.log(end.dissipation + 0.8 * k**1.5 * np.abs(end.v) ** 2.5)
    rows = (tuple(map(tuple, values.reshape(_NODES).tolist())) for values in (log_d, end.t))
    return Nodes(tuple(kappa.tolist()), tuple(sticking.tolist()), *rows)


class _State(NamedTuple):
    """p = x^(1/2), v = x', the scaled time t, and L of each body: the energy that the damper took is kappa L."""

    p: FloatArray
    v: FloatArray
    t: FloatArray
    dissipation: FloatArray


def _motion(
    state: FloatArray,
    kappa: FloatArray,
    load: FloatArray,
    direction: int,
    event: Callable[..., FloatArray],
) -> _State:
    """Return the state of each body at the first zero of an event, a function of p, v and kappa.

    `state` has the rows p, v, t and L at the start; `load` is G, and `direction` 1 forward or -1 backward in time.
    """
    event_state = np.empty_like(state)
    # Near p = 0 the load gives p'' = 2 G p, so the time (2 G)^(-1/2); 1 for the force and kappa for the damping were
    # added by hand. The step is a share of this time; if it were too long, the test against `Contact.collide` would
    # fail.
    step, moving = direction * _STEP / np.sqrt(1 + 2 * load + kappa), np.arange(len(kappa))
    while len(moving):
        # A step of all bodies whose event has not occurred yet.
        series = _series(state, kappa[moving], load[moving])
        state = _sum(series, step[moving])
        ends = event(*state[:2], kappa[moving]) <= 0
        if ends.any():
            stopped, stopped_series = moving[ends], series[:, :, ends]
            # Bisection in the step's own series: before the zero at `low`, behind it at `high`.
            low, high = np.zeros(len(stopped)), step[stopped]
            for _ in range(_HALVINGS):
                middle = (low + high) / 2
                is_before = event(*_sum(stopped_series[:, :2], middle), kappa[stopped]) > 0  # 2 rows: p and v
                low, high = np.where(is_before, middle, low), np.where(is_before, high, middle)
            event_state[:, stopped] = _sum(stopped_series, high)
        state, moving = state[:, ~ends], moving[~ends]
    return _State(*event_state)


def _series(state: FloatArray, kappa: FloatArray, load: FloatArray) -> FloatArray:
    """Return the Taylor coefficients of p, v, t and L (second axis) of each body, their orders in the first axis.

    `state` has the rows p, v, t and L at the start of the step, and `load` is G.
    """
    # Seven series: the four of the state, and the products p^2, p^4 and p^2 v.
    p, v, t, dissipation, p2, p4, p2v = np.zeros((7, _ORDER + 1, len(kappa)))
    p[0], v[0], t[0], dissipation[0] = state
    for i in range(_ORDER):
        # Orders i + 1 from the orders up to i: p' = v, t' = 2 p, L' = 4 p^2 v^2, v' = 2 (p (G - p^3) - kappa p^2 v).
        # The coefficient of order i + 1 is that of the derivative, of order i, over i + 1.
        p2[i] = _product_term(p, p, i)
        p4[i], p2v[i] = _product_term(p2, p2, i), _product_term(p2, v, i)
        p[i + 1], t[i + 1] = v[i] / (i + 1), 2 * p[i] / (i + 1)
        dissipation[i + 1] = 4 * _product_term(p2v, v, i) / (i + 1)
        v[i + 1] = 2 * (load * p[i] - p4[i] - kappa * p2v[i]) / (i + 1)
    return np.swapaxes([p, v, t, dissipation], 0, 1)


def _product_term(f: FloatArray, g: FloatArray, i: int) -> FloatArray:
    """Return the coefficient of order i of the product of two series: sum_(k <= i) f_k g_(i - k)."""
    return np.asarray(np.einsum("ij,ij->j", f[: i + 1], g[i::-1]))


def _sum(series: FloatArray, step: FloatArray) -> FloatArray:
    """Return the values of series at a step."""
    # Horner's scheme, from the highest order down
    value = series[-1]
    for coefficient in series[-2::-1]:
        value = value * step + coefficient
    return np.asarray(value)
