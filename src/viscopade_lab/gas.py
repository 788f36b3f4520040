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
"""Nodes of the quadrature over impact speeds, for an eps that is an analytic function of v*.

80 give double precision (measured for ice: L is off by 3e-7 with 40 nodes, 5e-13 with 60, 4e-15 with 80).
"""


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
        """Return T at times (in the same unit) until the last, interpolated between entries.

        1/sqrt(T) is interpolated: by Haff's law it grows linearly while eps is constant.
        """
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
    """Return the history of a simulated gas that is Maxwellian at the start.

    It ends at `time`, in mean collision times of a particle at the start, or after so many `collisions` per particle.
    `restitution` returns eps for an array of impact speeds; `temperature` is the one at the start. The scatter of
    temperatures is of the order of 1/sqrt(particles), 1.6 % for 4000.

    The same seed gives the same velocities at the start and the same candidates for collisions, whatever eps is. With a
    slightly different eps the temperatures differ slightly, until a pair collides in one gas and not in the other. From
    then on they differ by noise, which only averages over seeds reduce.
    """
    # Velocities (x, y, z by particle): Gaussian, without a mean, and with exactly this temperature.
    random = np.random.default_rng(seed)
    c = random.normal(size=(3, particles))
    c -= c.mean(axis=1)[:, None]
    velocities = c * math.sqrt(temperature / np.mean(c**2))
    thermal = math.sqrt(temperature)  # at the start; it defines the unit of time
    # Pairs in a batch. As many as particles: few enough that no particle becomes much faster within one (see `limit`),
    # and many enough for NumPy. Some 12 % of them collide.
    candidates = particles
    clock, number = 0.0, 0  # time and number of collisions so far
    impacts: list[FloatArray] = [np.empty(0)]
    records = [(clock, *_moments(velocities), 0.0)]
    while clock < time and 2 * number / particles < collisions:  # a collision counts for two particles
        # Candidates: two particles i != j, a direction e uniform on the sphere, and a threshold for |g . e|.
        first = random.integers(particles, size=candidates)
        second = random.integers(particles - 1, size=candidates)
        second += second >= first  # any particle but the first
        direction = random.normal(size=(3, candidates))
        direction /= np.sqrt(np.sum(direction**2, axis=0))
        # V: twice the largest speed; no pair is faster. (Collisions in the batch could make a faster particle, which
        # practically never meets another one of that kind head-on before the next batch.)
        limit = 2 * math.sqrt(float(np.max(np.sum(velocities**2, axis=0))))
        threshold = random.random(candidates) * limit
        # A pair collides at the rate 2 pi d^2 n/N |g . e|, averaged over e. All N (N-1)/2 pairs have candidates
        # together at the rate pi d^2 n (N-1) V; in units of 1/(4 n d^2 sqrt(pi T_0)) one comes every `step`.
        step = 4 * thermal / (math.sqrt(math.pi) * (particles - 1) * limit)
        within = int(min(candidates, (time - clock) / step))  # candidates before the end of the simulation
        for wave in waves(first[:within], second[:within], particles):
            i, j, e = first[wave], second[wave], direction[:, wave]
            normal = np.sum((velocities[:, i] - velocities[:, j]) * e, axis=0)
            (chosen,) = np.nonzero(np.abs(normal) > threshold[wave])
            i, j, normal = i[chosen], j[chosen], normal[chosen]
            speed = np.abs(normal)
            # Equal masses exchange (1 + eps)/2 (g . e) e, so that the normal component becomes -eps g . e.
            exchanged = (1 + restitution(speed)) / 2 * normal * e[:, chosen]
            velocities[:, i] -= exchanged
            velocities[:, j] += exchanged
            impacts.append(speed)
            number += len(speed)
        clock = time if within < candidates else clock + within * step
        records.append((clock, *_moments(velocities), 2 * number / particles))
    times, temperatures, sonine, per_particle = np.array(records).T
    return Cooling(times, temperatures, per_particle, sonine, np.concatenate(impacts))


def _moments(velocities: FloatArray) -> tuple[float, float]:
    """Return T = <c^2>/3 and the Sonine coefficient a_2 = <c^4>/(15 T^2) - 1 of velocities c about their mean."""
    squares = np.sum((velocities - velocities.mean(axis=1)[:, None]) ** 2, axis=0)
    temperature = float(np.mean(squares)) / 3  # 3 components
    # <c^4> = 15 T^2 for a Maxwellian.
    return temperature, float(np.mean((squares / temperature) ** 2)) / 15 - 1


def waves(first: Indices, second: Indices, particles: int) -> Iterator[Indices]:
    """Yield indices of pairs in waves: pairs of a wave share no particle, and each particle's order is kept.

    `first` and `second` have the particles of each pair in the order of the events, numbers below `particles`.
    """
    earliest = np.empty(particles, dtype=np.intp)  # of each particle, the first of its waiting pairs
    waiting = np.arange(len(first))
    while waiting.size:
        i, j = first[waiting], second[waiting]
        earliest.fill(len(first))  # later than any pair
        np.minimum.at(earliest, i, waiting)
        np.minimum.at(earliest, j, waiting)
        # A pair that is the earliest of both its particles depends on no other one.
        independent = (earliest[i] == waiting) & (earliest[j] == waiting)
        yield waiting[independent]
        waiting = waiting[~independent]


@lru_cache(maxsize=8)  # more numbers of nodes than one session asks for
def _rule(nodes: int) -> tuple[FloatArray, FloatArray]:
    """Return v/sqrt(T) = 2 sqrt(u) at the nodes and the weights of an average over u e^(-u), u = v^2/(4 T).

    In y = u^(1/20), which is proportional to v* ~ v^(1/10), eps is analytic, so that Gauss's rule converges fast. The
    integral ends at u = 50, where what is left of it, 51 e^(-50) = 1e-20, is below rounding.
    """
    z, w = np.polynomial.legendre.leggauss(nodes)  # on -1 … 1
    length = 50.0 ** (1 / 20) / 2  # half of the interval of y
    y = length * (z + 1)
    # v/sqrt(T) = 2 u^(1/2) = 2 y^10, and u e^(-u) du = 20 y^39 exp(-y^20) dy.
    return 2 * y**10.0, length * w * 20 * y**39 * np.exp(-(y**20))


def loss(restitution: RestitutionFunction, temperature: float | FloatArray, nodes: int = NODES) -> FloatArray:
    """Return L, the mean of 1 - eps^2 over collisions weighted by energy; a table with steps needs more nodes.

    L = integral of (1 - eps^2) u e^(-u) du over u from 0 to infinity, at each temperature.
    """
    scaled_speeds, weights = _rule(nodes)
    epsilon = restitution(np.multiply.outer(np.sqrt(temperature), scaled_speeds))  # a row for each temperature
    # A sum, not a product of matrices: its last digit is that of the BLAS library for one processor.
    value: FloatArray = ((1 - epsilon) * (1 + epsilon) * weights).sum(axis=-1)
    return value


def maxwellian(
    restitution: RestitutionFunction, times: FloatArray, *, temperature: float = 1.0, nodes: int = NODES
) -> FloatArray:
    """Return T at times, which do not decrease, for a gas whose velocities stay Maxwellian: to about 1e-8.

    `times` are in mean collision times at the start, `temperature` is that at the start, `nodes` as for `loss`.
    """
    start = math.log(temperature)

    def slope(log_time: float, log_temperature: float) -> float:
        """Return d ln T/d ln(1 + t) = -(L/3) sqrt(T/T_0) (1 + t)."""
        lost = loss(restitution, np.exp(np.array(log_temperature)), nodes)
        return -float(lost) / 3 * math.exp((log_temperature - start) / 2 + log_time)

    # ln T over ln(1 + t), in which Haff's laws become straight lines.
    x, y, log_temperatures = 0.0, start, []
    for target in np.log1p(times):
        # Steps of at most 0.04: the error of the fourth-order method is 4e-9 (measured for ice; 7e-8 with 0.08).
        steps = math.ceil((target - x) / 0.04)
        for _ in range(steps):  # Runge and Kutta's classical method of fourth order
            h = (target - x) / steps
            k1 = slope(x, y)
            k2 = slope(x + h / 2, y + h / 2 * k1)
            k3 = slope(x + h / 2, y + h / 2 * k2)
            k4 = slope(x + h, y + h * k3)
            y += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
            x, steps = x + h, steps - 1
        x = float(target)  # without the rounding of the steps
        log_temperatures.append(y)
    value: FloatArray = np.exp(np.array(log_temperatures))
    return value
