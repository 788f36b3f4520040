r"""Cooling of a granular gas of viscoelastic spheres, by simulation (DSMC) and by quadrature.

A simulation shows the effect of an approximant's error. This is the simplest one: a homogeneous gas of equal,
smooth spheres without forces. `cool` simulates it with random numbers; `maxwellian` has no noise, but takes the
velocities as Maxwellian at all times, which they are only nearly. In both, eps is any function of the impact speed,
which is the normal component v = |g . e| of the relative velocity g.

Temperature. T = <c^2>/3, the variance of one component of the velocities, a (length/time)^2: the granular temperature
over the mass of a particle. For Maxwellian velocities impact speeds are distributed like v exp(-v^2/(4 T)).

Time. Its unit is the mean time between two collisions of one particle at the start (`mean_collision_time`), so that
neither density nor diameter occur. Then C, the collisions that a particle has taken part in on average, grows like
dC/dt = sqrt(T/T_0), and with u = v^2/(4 T)

    d ln T/dt = -(L/3) sqrt(T/T_0),   L = integral_0^infinity (1 - eps^2) u e^(-u) du.

`derivations/13_haff.py` derives that, and Haff's laws: T ~ t^(-2) for constant eps, T ~ t^(-5/3) for viscoelastic
spheres.

DSMC. At a steady rate a pair of particles and a direction e, uniform on the sphere, are drawn, and collide with the
probability |g . e|/V, where V is above any |g . e|: Bird's method without a time counter, in one cell. Events only
depend on earlier ones with which they share a particle. So those of a batch are computed together in a few waves, with
the same results as one after the other: there is no time step whose size is an error.
"""

from __future__ import annotations

import math
import numbers
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from viscopade.arrays import checked
from viscopade.arrays.checked import Accepted, FloatArray, Number

RestitutionFunction = Callable[[FloatArray], FloatArray]
"""eps of an array of impact speeds, in the units of the square root of the temperature."""

_POSITIVE = Accepted("a finite number > 0", lambda x: (x > 0) & (x < math.inf))
_NON_NEGATIVE = Accepted("a finite number >= 0", lambda x: (x >= 0) & (x < math.inf))

LEAST_PARTICLES = 10
_CANDIDATES_PER_PARTICLE = 1  # in a batch; some 12 % of them collide

_LEAST_TEMPERATURE = 1e-290  # squares of velocities soon lose their digits

# The average over impact speeds: u e^(-u) ends at U_MAX; in y = u^(1/20), which is proportional to v*, eps is analytic.
_U_MAX = 50.0
_ROOT = 20
NODES = 80
"""Of the quadrature over impact speeds, enough for double precision where eps is an analytic function of v*."""

_LARGEST_STEP = 0.04  # of ln(1 + t)


@dataclass(frozen=True, eq=False)
class Cooling:
    """History of a simulated gas, one entry for the start and one for each batch.

    Attributes
    ----------
    times : array
        In units of the mean collision time at the start.
    temperatures : array
        T, in the units of the initial one.
    collisions : array
        Collisions that a particle has taken part in, on average: twice the number of collisions over that of particles.
    sonine : array
        a_2 = <c^4>/(15 T^2) - 1, the first sign that velocities are not Maxwellian.
    impact_speeds : array
        Of all collisions in their order, the normal component of the relative velocity.
    velocities : array
        At the end, shape (particles, 3).
    """

    times: FloatArray
    temperatures: FloatArray
    collisions: FloatArray
    sonine: FloatArray
    impact_speeds: FloatArray
    velocities: FloatArray

    def temperature_at(self, times: FloatArray) -> FloatArray:
        """Return T at times between the first and the last, interpolated.

        Raises
        ------
        TypeError
            If a time is not a real number.
        ValueError
            If a time lies outside the simulated ones.
        """
        end = float(self.times[-1])
        within = Accepted(f"a number from 0 to {end!r}, the end of the simulation", lambda t: (t >= 0) & (t <= end))
        # By Haff's law 1/sqrt(T) grows linearly while eps is constant.
        root = np.interp(checked.array("times", times, within), self.times, self.temperatures**-0.5)
        value: FloatArray = root**-2.0
        return value


def mean_collision_time(temperature: Number, number_density: Number, diameter: Number) -> float:
    """Return the mean time between two collisions of one particle, the unit of time of this module.

    Parameters
    ----------
    temperature : float
        T = <c^2>/3, a (length/time)^2.
    number_density : float
        Particles per volume. For a gas that is not dilute, times the pair distribution function at contact.
    diameter : float
        Of a particle, a length.

    Returns
    -------
    float
        1/(4 sqrt(pi T) number_density diameter^2), a time.

    Raises
    ------
    TypeError
        If an argument is not a real number.
    ValueError
        If an argument is not positive and finite.
    """
    thermal = math.sqrt(math.pi * checked.number("temperature", temperature, _POSITIVE))
    density = checked.number("number_density", number_density, _POSITIVE)
    return 1 / (4 * thermal * density * checked.number("diameter", diameter, _POSITIVE) ** 2)


def pair_correlation(volume_fraction: float) -> float:
    """Return Carnahan and Starling's pair correlation of spheres at contact, (1 - phi/2)/(1 - phi)^3."""
    return (1 - volume_fraction / 2) / (1 - volume_fraction) ** 3


def cool(
    restitution: RestitutionFunction,
    *,
    particles: int = 4000,
    temperature: Number = 1.0,
    time: Number | None = None,
    collisions: Number | None = None,
    seed: int = 0,
) -> Cooling:
    """Simulate a cooling gas that is Maxwellian at the start.

    The same seed gives the same velocities at the start and the same candidates for collisions, whatever eps is; so the
    same results to the last bit where eps is the same. With a slightly different eps the temperatures differ slightly,
    until a pair collides in one gas and not in the other: the fewer particles and the smaller the difference, the
    later. From then on they differ by noise, which only averages over seeds reduce.

    Parameters
    ----------
    restitution : callable
        eps of an array of impact speeds, in the units of sqrt(temperature); 0 <= eps <= 1.
    particles : int
        At least 10.
    temperature : float
        T at the start.
    time, collisions : float
        Exactly one of the two: when to end, in mean collision times of the start; or after how many collisions per
        particle, at the end of a batch.
    seed : int
        Of the random numbers.

    Returns
    -------
    Cooling

    Raises
    ------
    TypeError
        If an argument is not of the type stated, or not exactly one of time and collisions is given.
    ValueError
        If an argument is out of range, restitution returns something else than eps from 0 to 1, one for each speed,
        or the temperature falls below 1e-290.

    Examples
    --------
    >>> gas = cool(lambda speed: np.full_like(speed, 0.9), particles=1000, collisions=10)
    >>> bool(gas.temperatures[-1] < 0.6)
    True
    """
    if (time is None) == (collisions is None):
        given = "neither" if time is None else "both"
        raise TypeError(f"time and collisions: {given} given, accepted is exactly one of them")
    end = math.inf if time is None else checked.number("time", time, _NON_NEGATIVE)
    most = math.inf if collisions is None else checked.number("collisions", collisions, _NON_NEGATIVE)
    gas = _Gas(
        restitution,
        _integer("particles", particles, LEAST_PARTICLES),
        checked.number("temperature", temperature, _POSITIVE),
        _integer("seed", seed, 0),
    )
    records = [gas.record()]
    while gas.time < end and gas.collisions < most:
        gas.advance(end)
        records.append(gas.record())
    times, temperatures, per_particle, sonine = np.array(records).T
    impacts = np.concatenate([np.empty(0), *gas.impacts])
    return Cooling(times, temperatures, per_particle, sonine, impacts, gas.velocities.T)


def loss(restitution: RestitutionFunction, temperature: Number | FloatArray, nodes: int = NODES) -> FloatArray:
    """Return L, the mean of 1 - eps^2 over collisions weighted by energy, for Maxwellian velocities.

    Parameters
    ----------
    restitution : callable
        eps of an array of impact speeds, of any shape.
    temperature : float or array
        T > 0.
    nodes : int
        Of the quadrature. 80 are enough for a function that is analytic in v*; a table with steps needs more.

    Raises
    ------
    TypeError
        If an argument is not of the type stated.
    ValueError
        If an argument is out of range.
    """
    y, weights = _rule(_integer("nodes", nodes, 1))
    given = checked.array("temperature", temperature, _POSITIVE)
    value: FloatArray = _mean_loss(restitution, given, y, weights)
    return value


def maxwellian(
    restitution: RestitutionFunction, times: FloatArray, *, temperature: Number = 1.0, nodes: int = NODES
) -> FloatArray:
    """Return T at given times for a gas whose velocities stay Maxwellian: without noise, to about 1e-8.

    Parameters
    ----------
    restitution : callable
        eps of an array of impact speeds.
    times : array
        One-dimensional, >= 0 and not decreasing, in mean collision times of the start.
    temperature : float
        T at time 0.
    nodes : int
        As for `loss`.

    Raises
    ------
    TypeError
        If an argument is not of the type stated.
    ValueError
        If an argument is out of range, or times are not in order.
    """
    at = checked.array("times", times, _NON_NEGATIVE)
    if at.ndim != 1 or np.any(np.diff(at) < 0):
        raise ValueError(checked.refusal("times", times, "a one-dimensional array that does not decrease"))
    start = math.log(checked.number("temperature", temperature, _POSITIVE))
    y, weights = _rule(_integer("nodes", nodes, 1))

    def slope(log_time: float, log_temperature: float) -> float:
        """Return d ln T/d ln(1 + t)."""
        of_pairs = _mean_loss(restitution, np.exp(np.array(log_temperature)), y, weights)
        return -float(of_pairs) / 3 * math.exp((log_temperature - start) / 2 + log_time)

    x, log_temperature, found = 0.0, start, []
    for target in np.log1p(at):
        steps = math.ceil((target - x) / _LARGEST_STEP)
        for _ in range(steps):
            h = (target - x) / steps
            log_temperature += _runge_kutta(slope, x, log_temperature, h)
            x, steps = x + h, steps - 1
        x = float(target)
        found.append(log_temperature)
    value: FloatArray = np.exp(np.array(found))
    return value


class _Gas:
    """A gas at a time."""

    def __init__(self, restitution: RestitutionFunction, particles: int, temperature: float, seed: int) -> None:
        self.restitution = restitution
        self.particles = particles
        self.random = np.random.default_rng(seed)
        self.time = 0.0
        self.number = 0  # of collisions
        self.impacts: list[FloatArray] = []
        c = self.random.normal(size=(3, particles))
        c -= c.mean(axis=1)[:, None]
        self.velocities = c * math.sqrt(temperature / np.mean(c**2))
        self.thermal = math.sqrt(temperature)  # at the start: what the unit of time is made of
        self.candidates = particles * _CANDIDATES_PER_PARTICLE

    @property
    def collisions(self) -> float:
        """Per particle, of which there are two in a collision."""
        return 2 * self.number / self.particles

    def record(self) -> tuple[float, float, float, float]:
        """Return time, temperature, collisions per particle and a_2."""
        squares = np.sum((self.velocities - self.velocities.mean(axis=1)[:, None]) ** 2, axis=0)
        temperature = float(np.mean(squares)) / 3
        if temperature < _LEAST_TEMPERATURE:
            raise ValueError(f"the temperature falls below {_LEAST_TEMPERATURE}: accepted is an earlier end")
        sonine = float(np.mean((squares / temperature) ** 2)) / 15 - 1
        return self.time, temperature, self.collisions, sonine

    def advance(self, end: float) -> None:
        """Let a batch of candidates collide, fewer if the time is over before."""
        first = self.random.integers(self.particles, size=self.candidates)
        second = self.random.integers(self.particles - 1, size=self.candidates)
        second += second >= first  # any particle but the first
        direction = self.random.normal(size=(3, self.candidates))
        direction /= np.sqrt(np.sum(direction**2, axis=0))
        # No pair is faster. (Collisions within the batch could make a faster particle, which practically never meets
        # another one of that kind head-on before the next batch.)
        limit = 2 * math.sqrt(float(np.max(np.sum(self.velocities**2, axis=0))))
        threshold = self.random.random(self.candidates) * limit
        # A pair collides at the rate 2 pi d^2 n/N |g . e|, averaged over e.
        step = 4 * self.thermal / (math.sqrt(math.pi) * (self.particles - 1) * limit)
        number = int(min(self.candidates, (end - self.time) / step))
        for wave in waves(first[:number], second[:number], self.particles):
            self._collide(first[wave], second[wave], direction[:, wave], threshold[wave])
        self.time = end if number < self.candidates else self.time + number * step

    def _collide(self, first: Indices, second: Indices, direction: FloatArray, threshold: FloatArray) -> None:
        """Let those of some pairs without common particles collide that are fast enough."""
        normal = np.sum((self.velocities[:, first] - self.velocities[:, second]) * direction, axis=0)
        (chosen,) = np.nonzero(np.abs(normal) > threshold)
        first, second, normal = first[chosen], second[chosen], normal[chosen]
        speed = np.abs(normal)
        exchanged = (1 + _checked(self.restitution, speed)) / 2 * normal * direction[:, chosen]
        self.velocities[:, first] -= exchanged
        self.velocities[:, second] += exchanged
        self.impacts.append(speed)
        self.number += len(speed)


Indices = np.typing.NDArray[np.intp]


def waves(first: Indices, second: Indices, particles: int) -> Iterator[Indices]:
    """Divide a sequence of pairs into waves: pairs of a wave share no particle, and each particle's order is kept.

    Parameters
    ----------
    first, second : array of int
        The particles of each pair.
    particles : int
        Their number.

    Yields
    ------
    array of int
        Indices of pairs, each after all earlier pairs that one of its particles belongs to.
    """
    earliest = np.empty(particles, dtype=np.intp)
    waiting = np.arange(len(first))
    while waiting.size:
        one, other = first[waiting], second[waiting]
        earliest.fill(len(first))
        np.minimum.at(earliest, one, waiting)
        np.minimum.at(earliest, other, waiting)
        free = (earliest[one] == waiting) & (earliest[other] == waiting)
        yield waiting[free]
        waiting = waiting[~free]


def _checked(restitution: RestitutionFunction, speed: FloatArray) -> FloatArray:
    """Return eps of impact speeds, or refuse it."""
    epsilon = np.asarray(restitution(speed))
    if epsilon.shape != speed.shape or epsilon.dtype.kind != "f":
        returned = f"{epsilon.dtype} of shape {epsilon.shape} for speeds of shape {speed.shape}"
        raise ValueError(f"restitution returns {returned}: accepted is an array of eps, one for each speed")
    refused = ~((epsilon >= 0) & (epsilon <= 1))
    if refused.any():
        at, value = float(speed[refused][0]), float(epsilon[refused][0])
        raise ValueError(f"restitution returns {value!r} at speed {at!r}: accepted is 0 <= eps <= 1")
    return epsilon


@lru_cache(maxsize=8)
def _rule(nodes: int) -> tuple[FloatArray, FloatArray]:
    """Return v/sqrt(T) = 2 sqrt(u) and the weights of an average over u e^(-u)."""
    z, w = np.polynomial.legendre.leggauss(nodes)
    length = _U_MAX ** (1 / _ROOT) / 2
    y = length * (z + 1)
    return 2 * y ** (_ROOT / 2), length * w * _ROOT * y ** (2 * _ROOT - 1) * np.exp(-(y**_ROOT))


def _mean_loss(
    restitution: RestitutionFunction, temperature: FloatArray, y: FloatArray, weights: FloatArray
) -> FloatArray:
    epsilon = _checked(restitution, np.multiply.outer(np.sqrt(temperature), y))
    value: FloatArray = ((1 - epsilon) * (1 + epsilon)) @ weights
    return value


def _runge_kutta(slope: Callable[[float, float], float], x: float, y: float, h: float) -> float:
    """Return by how much y grows in a step h of x, by the classical method of fourth order."""
    k1 = slope(x, y)
    k2 = slope(x + h / 2, y + h / 2 * k1)
    k3 = slope(x + h / 2, y + h / 2 * k2)
    k4 = slope(x + h, y + h * k3)
    return h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)


def _integer(name: str, value: object, least: int) -> int:
    """Return an integer that is large enough."""
    accepted = f"an integer >= {least}"
    if isinstance(value, bool | np.bool_) or not isinstance(value, numbers.Integral):
        raise TypeError(checked.refusal(name, value, accepted))
    if value < least:
        raise ValueError(checked.refusal(name, value, accepted))
    return int(value)
