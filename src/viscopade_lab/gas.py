r"""Cooling of a granular gas of equal, smooth spheres, by simulation (DSMC) and by quadrature.

`cool` simulates a homogeneous gas with random numbers; `maxwellian` has no noise, but assumes that the velocities are
Maxwellian at all times, which is nearly true. In both, eps is any function of an array of impact speeds, the
normal components v = |g . e| of the relative velocities g.

Temperature. T = <c^2>/3, the variance of one component of the velocities, a (length/time)^2.

Time. Its unit is the mean time between two collisions of one particle at the start, 1/(4 n d^2 sqrt(pi T_0)), so that
neither density nor diameter occur. With u = v^2/(4 T)

    d ln T/dt = -(L/3) sqrt(T/T_0),   L = integral_0^infinity (1 - eps^2) u e^(-u) du.

`derivations/13_haff.py` derives this, and Haff's laws: T ~ t^(-2) for constant eps, T ~ t^(-5/3) for viscoelastic
spheres.

DSMC. At a steady rate a pair of particles and a direction e, uniform on the sphere, are drawn, and collide with the
probability |g . e|/V, where V is above any |g . e|: Bird's method without a time counter, in one cell. Events only
depend on earlier events that share a particle with them. So the events of a batch are computed in a few waves, with
the same results as one after the other: no time step causes an error.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from viscopade.arrays.checked import FloatArray

RestitutionFunction = Callable[[FloatArray], FloatArray]
Indices = np.typing.NDArray[np.intp]

NODES = 80
"""Of the quadrature over impact speeds, enough for double precision where eps is an analytic function of v*."""


@dataclass(frozen=True, eq=False)
class Cooling:
    """History of a simulated gas, one entry for the start and one for each batch.

    Attributes
    ----------
    times : array
        In units of the mean collision time at the start.
    temperatures : array
    collisions : array
        Mean number of collisions of a particle: twice the number of collisions / number of particles.
    sonine : array
        a_2 = <c^4>/(15 T^2) - 1, the first sign that velocities are not Maxwellian.
    impact_speeds : array
        Of all collisions in their order.
    """

    times: FloatArray
    temperatures: FloatArray
    collisions: FloatArray
    sonine: FloatArray
    impact_speeds: FloatArray

    def temperature_at(self, times: FloatArray) -> FloatArray:
        """Return T at times until the last; by Haff's law 1/sqrt(T) grows linearly while eps is constant."""
        root = np.interp(times, self.times, self.temperatures**-0.5)
        value: FloatArray = root**-2.0
        return value


def cool(
    restitution: RestitutionFunction,
    *,
    particles: int = 4000,
    temperature: float = 1.0,
    time: float = math.inf,
    collisions: float = math.inf,
    seed: int = 0,
) -> Cooling:
    """Simulate a cooling gas that is Maxwellian at the start, until a time, or for so many collisions per particle.

    The same seed gives the same velocities at the start and the same candidates for collisions, whatever eps is. With a
    slightly different eps the temperatures differ slightly, until a pair collides in one gas and not in the other. From
    then on they differ by noise, which only averages over seeds reduce.
    """
    random = np.random.default_rng(seed)
    c = random.normal(size=(3, particles))
    c -= c.mean(axis=1)[:, None]
    velocities = c * math.sqrt(temperature / np.mean(c**2))
    thermal = math.sqrt(temperature)  # at the start; it defines the unit of time
    candidates = particles  # in a batch; some 12 % of them collide
    now, number = 0.0, 0
    impacts: list[FloatArray] = [np.empty(0)]
    records = [(now, *_moments(velocities), 0.0)]
    while now < time and 2 * number / particles < collisions:
        first = random.integers(particles, size=candidates)
        second = random.integers(particles - 1, size=candidates)
        second += second >= first  # any particle but the first
        direction = random.normal(size=(3, candidates))
        direction /= np.sqrt(np.sum(direction**2, axis=0))
        # No pair is faster. (Collisions within the batch could make a faster particle, which practically never meets
        # another one of that kind head-on before the next batch.)
        limit = 2 * math.sqrt(float(np.max(np.sum(velocities**2, axis=0))))
        threshold = random.random(candidates) * limit
        # A pair collides at the rate 2 pi d^2 n/N |g . e|, averaged over e.
        step = 4 * thermal / (math.sqrt(math.pi) * (particles - 1) * limit)
        within = int(min(candidates, (time - now) / step))
        for wave in waves(first[:within], second[:within], particles):
            i, j, e = first[wave], second[wave], direction[:, wave]
            normal = np.sum((velocities[:, i] - velocities[:, j]) * e, axis=0)
            (chosen,) = np.nonzero(np.abs(normal) > threshold[wave])
            i, j, normal = i[chosen], j[chosen], normal[chosen]
            speed = np.abs(normal)
            exchanged = (1 + restitution(speed)) / 2 * normal * e[:, chosen]
            velocities[:, i] -= exchanged
            velocities[:, j] += exchanged
            impacts.append(speed)
            number += len(speed)
        now = time if within < candidates else now + within * step
        records.append((now, *_moments(velocities), 2 * number / particles))
    times, temperatures, sonine, per_particle = np.array(records).T
    return Cooling(times, temperatures, per_particle, sonine, np.concatenate(impacts))


def _moments(velocities: FloatArray) -> tuple[float, float]:
    """Return T and a_2."""
    squares = np.sum((velocities - velocities.mean(axis=1)[:, None]) ** 2, axis=0)
    temperature = float(np.mean(squares)) / 3
    return temperature, float(np.mean((squares / temperature) ** 2)) / 15 - 1


def waves(first: Indices, second: Indices, particles: int) -> Iterator[Indices]:
    """Divide a sequence of pairs into waves: pairs of a wave share no particle, and each particle's order is kept."""
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


@lru_cache(maxsize=8)
def _rule(nodes: int) -> tuple[FloatArray, FloatArray]:
    """Return v/sqrt(T) = 2 sqrt(u) and the weights of an average over u e^(-u).

    The integral ends at u = 50. In y = u^(1/20), which is proportional to v*, eps is analytic.
    """
    z, w = np.polynomial.legendre.leggauss(nodes)
    length = 50.0 ** (1 / 20) / 2
    y = length * (z + 1)
    return 2 * y**10.0, length * w * 20 * y**39 * np.exp(-(y**20))


def loss(restitution: RestitutionFunction, temperature: float | FloatArray, nodes: int = NODES) -> FloatArray:
    """Return L, the mean of 1 - eps^2 over collisions weighted by energy; a table with steps needs more nodes."""
    y, weights = _rule(nodes)
    epsilon = restitution(np.multiply.outer(np.sqrt(temperature), y))
    value: FloatArray = ((1 - epsilon) * (1 + epsilon)) @ weights
    return value


def maxwellian(
    restitution: RestitutionFunction, times: FloatArray, *, temperature: float = 1.0, nodes: int = NODES
) -> FloatArray:
    """Return T at times, which do not decrease, for a gas whose velocities stay Maxwellian: to about 1e-8."""
    start = math.log(temperature)

    def slope(log_time: float, log_temperature: float) -> float:
        """Return d ln T/d ln(1 + t)."""
        of_pairs = loss(restitution, np.exp(np.array(log_temperature)), nodes)
        return -float(of_pairs) / 3 * math.exp((log_temperature - start) / 2 + log_time)

    x, y, found = 0.0, start, []
    for target in np.log1p(times):
        steps = math.ceil((target - x) / 0.04)
        for _ in range(steps):  # Runge and Kutta's of fourth order
            h = (target - x) / steps
            k1 = slope(x, y)
            k2 = slope(x + h / 2, y + h / 2 * k1)
            k3 = slope(x + h / 2, y + h / 2 * k2)
            k4 = slope(x + h, y + h * k3)
            y += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
            x, steps = x + h, steps - 1
        x = float(target)
        found.append(y)
    value: FloatArray = np.exp(np.array(found))
    return value
