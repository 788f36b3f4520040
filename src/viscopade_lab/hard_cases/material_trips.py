"""Trips from materials to beta, v* and eps and back, and between systems of units, with all roundings counted."""

from __future__ import annotations

import math
from collections.abc import Callable
from decimal import Decimal
from fractions import Fraction
from functools import lru_cache, partial
from typing import Any, NamedTuple, cast

import numpy as np

from viscopade.collision import spheres
from viscopade.collision.spheres import Pair, Sphere
from viscopade.kernels import native
from viscopade.kernels.forms.rounding_bounds import ULPS
from viscopade.kernels.registry import entries
from viscopade.quantity import DIMENSIONS, quantity
from viscopade.records import Node
from viscopade.scene.units import Scale
from viscopade_lab.hard_cases.double_trips import UNIT, change_of_portion, ulp_of

POW = 2 * ULPS * UNIT  # what is assumed of pow
# The doubles 0.1, 0.2 and 0.4 exceed 1/10, 1/5 and 2/5 by this factor, less 1.
EXPONENT_OFF = float(Fraction(0.1) * 10 - 1)
_SMALL_SHARE = 1e-9  # of the counted roundings, for their products

Step = tuple[float, float]
"""A relative error and its limit."""

SYSTEMS = {"cgs": (1e-2, 1e-3, 1.0), "µm, ng, µs": (1e-6, 1e-12, 1e-6)}
"""Units of length, mass and time in SI units."""


def _off(back: float, start: float) -> float:
    """Return the relative error; the difference of two numbers that near is exact."""
    return abs(back - start) / start


def beta_and_back(pair: Pair) -> Step:
    """Go from A to beta and back: two products, a quotient, a product, and the constant 2/3, each rounded once."""
    back = pair.dissipative_constant(pair.beta)
    return _off(back, pair.A), 5 * UNIT


def calibrated(pair: Pair, speed: float, *, epsilon: float | None = None, loss: float | None = None) -> Step:
    """Go from eps (or 1 - eps) to A and back to eps.

    v* is off by 5 units (2.5 ulp), beta by 10 + 1 (square) + 1 (quotient) and a power, A by 3 more, the new beta by 2
    more, the new v* by half of that, and by 2 and another power. That 0.1 and 0.2 are no doubles cancels.
    """
    new = pair.calibrated(speed, epsilon, one_minus_epsilon=loss)
    v_star = np.array(new.v_star(speed))
    log_error = ((5 * 2 + 2 + 3 + 2) * UNIT + POW) / 2 + 2 * UNIT + POW
    if epsilon is not None:
        name, wanted, back = "epsilon", epsilon, new.epsilon(speed)
    else:
        name, wanted, back = "one_minus_epsilon", cast(float, loss), new.one_minus_epsilon(speed)
    limit = change_of_portion(v_star, np.array(1 - wanted), log_error) + ulp_of(name, np.array(wanted)) / wanted
    return _off(back, wanted), float(limit)


def by_restitution(speed: float, epsilon: float) -> Step:
    """Go from eps to beta, and back by `restitution`, whose error is proven (`registry`)."""
    beta = spheres.beta_from_restitution(speed, epsilon)
    v_star = spheres.v_star(speed, beta)
    low, high = Fraction(v_star) * Fraction(999, 1000), Fraction(v_star) * Fraction(1001, 1000)
    both, last = proven_restitution(low, high)
    log_error = ((5 * 2 + 2) * UNIT + POW) / 2 + EXPONENT_OFF * abs(math.log(speed)) / 10
    limit = change_of_portion(np.array(v_star), np.array(1 - epsilon), log_error)
    back = float(native.restitution(speed, beta))
    return _off(back, epsilon), float(limit) * (1 + 1e-9) + both * min(1.0, 1 / epsilon - 1) + last


@lru_cache(maxsize=1)
def _entry() -> Any:
    return next(e for e in entries() if (e.kind, e.tier, e.format) == ("speed", "full", "double"))


def proven_restitution(low: Fraction, high: Fraction) -> tuple[float, float]:
    """Return the proven error of `restitution` on a range of v*: relative to min(eps, 1 - eps), and to eps."""
    return float(_entry().error(low, high)), float(_entry().rounding)


def speed_and_back(speed: float, beta: float) -> Step:
    """Go from a speed to v* and back.

    v* has the error of a power and of a product; there is a quotient, and all of that 10 times; then a power. v^(1/10)
    is taken with the double 0.1.
    """
    back = spheres.speed_from_v_star(spheres.v_star(speed, beta), beta)
    limit = 10 * (POW + 2 * UNIT) + POW + EXPONENT_OFF * abs(math.log(speed))
    return _off(back, speed), limit


def units_of_beta(beta: float) -> Step:
    """Go from SI units to cgs and back, and the other way: a product and a quotient with one constant."""
    first = spheres.beta_si_from_cgs(spheres.beta_cgs_from_si(beta))
    second = spheres.beta_cgs_from_si(spheres.beta_si_from_cgs(beta))
    return max(_off(first, beta), _off(second, beta)), 2 * UNIT


def mass_and_back(sphere: Sphere) -> Step:
    """Go from the density to the mass and back: four products, and four operations that undo them."""
    again = Sphere(
        radius=sphere.radius,
        mass=sphere.mass,
        young_modulus=sphere.young_modulus,
        poisson_ratio=sphere.poisson_ratio,
        dissipative_constant=sphere.dissipative_constant,
    )
    return _off(again.density, sphere.density), 8 * UNIT


# Roundings of v* that follow from those of a pair's numbers, in units: E_eff 7 and R_eff 3 (halved, and a root) make
# 12.5 of rho; with 2/5 of these, of the 3 of m_eff, of a quotient, of A (4) and of two products there are 14.2 of beta.
_V_STAR_UNITS = (0.4 * (12.5 + 3) + 1 + 4 + 2) / 2 + 2
_V_STAR_POWERS = 2 / 2 + 1
# Of the numbers in other units: 1 of R (2/5 of a half of it), 4 of Y, 1 of m (2/5), 1 of A, 2 of the speed (1/10).
_SCALED_UNITS = (0.4 * (0.5 + 4 + 1) + 1) / 2 + 0.2


def other_units(pair: Pair, speed: float, scale: Scale) -> Step:
    """Compare v* in two systems of units; powers of numbers that differ by large factors differ as 0.1 does from 1/10.

    Raises
    ------
    ValueError
        If the other system's numbers are beyond double precision.
    """
    other, faster = scale.pair(pair), speed / scale.length * scale.time
    first, second = pair.v_star(speed), other.v_star(faster)
    ratios = [math.log(p.rho) - math.log(p.m_eff) for p in (pair, other)]
    exponents = EXPONENT_OFF * (abs(ratios[1] - ratios[0]) / 5 + abs(math.log(faster) - math.log(speed)) / 10)
    limit = 2 * (_V_STAR_UNITS * UNIT + _V_STAR_POWERS * POW) + _SCALED_UNITS * UNIT + exponents
    return _off(second, first), limit


def text_and_back(value: float, dimension: str, unit: str) -> bool:
    """Whether a quantity is the same, to the bit, after it was written in a unit with 17 digits, and read."""
    size = Decimal(repr(quantity(Node("trip", "", f"1 {unit}"), dimension)))
    text = f"{Decimal(value) / size:.16e} {unit}"
    return quantity(Node("trip", "", text), dimension) == value


def random_pair(generator: np.random.Generator) -> Pair:
    """Return two spheres, or a sphere and a wall, of materials between dust and steel, in SI units."""

    def material() -> dict[str, float]:
        return {
            "young_modulus": 10 ** generator.uniform(4, 12),
            "poisson_ratio": generator.uniform(-0.99, 0.5),
            "dissipative_constant": 10 ** generator.uniform(-9, -1),
        }

    def sphere() -> Sphere:
        return Sphere(radius=10 ** generator.uniform(-6, 1), density=10 ** generator.uniform(1, 5), **material())

    return Pair(sphere(), Sphere.wall(**material()) if generator.uniform() < 1 / 3 else sphere())


def random_scale(generator: np.random.Generator) -> Scale:
    """Return units of length, mass and time between 1e-200 and 1e200 of the SI's."""
    reach = generator.uniform(0, 200)
    return Scale(*(10 ** generator.uniform(-reach, reach) for _ in range(3)))


class Tally(NamedTuple):
    """The errors of one kind of trip with materials, and how many were refused as beyond double precision."""

    steps: list[Step]
    refused: int

    @property
    def worst(self) -> float:
        """The largest error in terms of its limit."""
        return max((error / (limit * (1 + _SMALL_SHARE)) for error, limit in self.steps), default=math.inf)


def tally(trip: Callable[[], Step], number: int) -> Tally:
    """Take a trip from so many starts."""
    steps, refused = [], 0
    for _ in range(number):
        try:
            steps.append(trip())
        except ValueError:
            refused += 1
    return Tally(steps, refused)


def all_trips(generator: np.random.Generator, number: int) -> dict[str, Tally]:
    """Return all trips with materials, each from `number` starts."""

    def speed() -> float:
        return float(10 ** generator.uniform(-6, 3))

    def portion() -> float:
        return float(10 ** generator.uniform(-12, -1e-3))

    def any_number() -> float:
        return float(10 ** generator.uniform(-290, 290))

    def pair() -> Pair:
        return random_pair(generator)

    def scaled() -> Pair:
        return random_scale(generator).pair(pair())

    trips: dict[str, Callable[[], Step]] = {
        "A -> beta -> A": lambda: beta_and_back(pair()),
        "A -> beta -> A, any units": lambda: beta_and_back(scaled()),
        "eps -> A -> eps": lambda: calibrated(pair(), speed(), epsilon=portion()),
        "1 - eps -> A -> 1 - eps": lambda: calibrated(pair(), speed(), loss=portion()),
        "eps -> beta -> restitution": lambda: by_restitution(speed(), portion()),
        "speed -> v* -> speed": lambda: speed_and_back(any_number(), any_number()),
        "beta in SI units and cgs": lambda: units_of_beta(any_number()),
        "density -> mass -> density": lambda: mass_and_back(pair().first),
        "v* in SI units and in any": lambda: other_units(pair(), speed(), random_scale(generator)),
    }
    for name, factors in SYSTEMS.items():
        trips[f"v* in SI units and in {name}"] = partial(_in_units, pair, speed, Scale(*factors))
    return {name: tally(trip, number) for name, trip in trips.items()}


def _in_units(pair: Callable[[], Pair], speed: Callable[[], float], scale: Scale) -> Step:
    return other_units(pair(), speed(), scale)


def changed_quantities(generator: np.random.Generator, number: int) -> tuple[int, int]:
    """Return how many quantities were written and read, and how many changed."""
    changed = total = 0
    for dimension, units in DIMENSIONS.items():
        for unit in units:
            values = 10 ** generator.uniform(-30, 30, number)
            changed += sum(not text_and_back(float(value), dimension, unit) for value in values)
            total += number
    return total, changed
