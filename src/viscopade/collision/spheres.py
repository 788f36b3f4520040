"""Spheres and pairs with physical parameters: rho, beta, v* and the units of the scaled equation of motion.

Two smooth spheres press on each other with the force of the paper's Eq. 2. For all materials, their collision
depends on one number only, v* = beta^(1/2) v^(1/10) (the paper's Eq. 8). This module computes v*, and the units of
length and time of the scaled equation.

Units: any consistent system (SI, CGS, a simulation's own); results have the units of the arguments. Only
`beta_cgs_from_si` and `beta_si_from_cgs` convert, because beta is a (time/length)^(1/5). No intermediate result
overflows or underflows if the result is in the range of double precision.

Unequal materials: the paper's Eq. 3 is written for two spheres of one material. Here rho = 4/3 E_eff sqrt(R_eff)
with Hertz's 1/E_eff = D_1 + D_2, D_i = (1 - nu_i^2)/Y_i, which is the paper's Eq. 3 when the materials are equal.
The dissipative constant of the pair is the mean weighted with these compliances,

    A = (D_1 A_1 + D_2 A_2)/(D_1 + D_2),

because the softer body has the larger share of the compression. `derivations/02_unequal_materials.py` derives
both, the second in the quasi-static approximation of the paper's Eq. 2, to first order in A_1 and A_2. It is not the
only choice: programs often use the arithmetic mean, and there is a theory for different materials beyond the
quasi-static approximation (Goldobin, Susloparov,
Pimenova and Brilliantov, "Collision of viscoelastic bodies: Rigorous derivation of dissipative force", Eur.
Phys. J. E). To use another A for a pair, give both spheres that A.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any, cast

import numpy as np

from viscopade.arguments import refusal
from viscopade.arrays import checked, double
from viscopade.arrays.checked import Accepted, FloatArray, Number, Values
from viscopade.arrays.double import v_star_from
from viscopade.collision.contact import Contact

_BALL = 4 / 3 * math.pi  # volume of a ball over the cube of its radius
_BETA_SI_PER_CGS = 100**0.2  # (s/m)^(1/5) is 100^(-1/5) (s/cm)^(1/5)
_LEAST_NORMAL = 2.0**-1022  # smaller doubles have fewer digits

_POSITIVE = Accepted("a finite number > 0", lambda x: (x > 0) & (x < math.inf))
_NON_NEGATIVE = Accepted("a finite number >= 0", lambda x: (x >= 0) & (x < math.inf))
_EXTENT = Accepted("a number > 0, or inf for a wall", lambda x: x > 0)
_PORTION = Accepted("a number >= 0 and <= 1", lambda x: (x >= 0) & (x <= 1))
_POISSON = Accepted("a number > -1 and <= 1/2", lambda x: (x > -1) & (x <= 0.5))


@dataclass(frozen=True, kw_only=True, init=False)
class Sphere:
    """A homogeneous viscoelastic sphere, or a plane wall (`Sphere.wall`). All arguments are keywords.

    Parameters
    ----------
    radius : float
        Radius R, a length.
    mass, density : float
        Exactly one of the two, in units of mass and of mass per volume; the other follows from
        mass = 4/3 pi R^3 density.
    young_modulus : float
        Young modulus Y, a pressure.
    poisson_ratio : float
        Poisson ratio nu, > -1 and <= 1/2.
    dissipative_constant : float
        A of the paper's Eq. 2, a time; 0 for a perfectly elastic material.

    Raises
    ------
    TypeError
        If a value is not a real number (a bool or a string is not).
    ValueError
        If a value is unphysical, or not exactly one of mass and density is given.

    Notes
    -----
    The density follows from the other attributes: comparisons and the repr ignore it, and `dataclasses.replace`
    does not change the mass.

    Examples
    --------
    >>> ball = Sphere(
    ...     radius=0.01, density=1000, young_modulus=1e7, poisson_ratio=0.3, dissipative_constant=1e-4
    ... )
    >>> f"{ball.mass:.6f}"
    '0.004189'
    """

    radius: float
    mass: float
    density: float = field(init=False, compare=False, repr=False)
    young_modulus: float
    poisson_ratio: float
    dissipative_constant: float

    def __init__(
        self,
        *,
        radius: Number,
        mass: Number | None = None,
        density: Number | None = None,
        young_modulus: Number,
        poisson_ratio: Number,
        dissipative_constant: Number,
    ) -> None:
        """Check the arguments, which the class describes, and compute the mass or the density."""
        r = checked.number("radius", radius, _EXTENT)
        m, d = _mass_and_density(r, mass, density)
        values = {
            "radius": r,
            "mass": m,
            "density": d,
            "young_modulus": checked.number("young_modulus", young_modulus, _POSITIVE),
            "poisson_ratio": checked.number("poisson_ratio", poisson_ratio, _POISSON),
            "dissipative_constant": checked.number("dissipative_constant", dissipative_constant, _NON_NEGATIVE),
        }
        for name, value in values.items():
            object.__setattr__(self, name, value)  # the class is frozen
        # Every pair needs this modulus, which a ratio near -1 makes large.
        _in_range("young_modulus / (1 - poisson_ratio^2)", self.plane_strain_modulus)

    @classmethod
    def wall(cls, *, young_modulus: Number, poisson_ratio: Number, dissipative_constant: Number) -> Sphere:
        """Return a plane, immovable wall: the limit of a huge and heavy sphere.

        Its radius and mass are infinite, its density is NaN. The material (Young modulus, a pressure, Poisson ratio,
        dissipative constant A, a time) is that of a `Sphere`, with the same errors.
        """
        return cls(
            radius=math.inf,
            mass=math.inf,
            young_modulus=young_modulus,
            poisson_ratio=poisson_ratio,
            dissipative_constant=dissipative_constant,
        )

    @property
    def is_wall(self) -> bool:
        """Whether this is a plane wall."""
        return math.isinf(self.radius)

    @property
    def plane_strain_modulus(self) -> float:
        """Y/(1 - nu^2), a pressure: the inverse of the compliance D in the module's docstring."""
        return self.young_modulus / ((1 - self.poisson_ratio) * (1 + self.poisson_ratio))


@dataclass(frozen=True)
class Pair:
    """A colliding pair: two spheres, or a sphere and a wall. Their order does not matter, to the last bit.

    Parameters
    ----------
    first, second : Sphere
        The colliding bodies, in the same units; at most one is a wall.

    Raises
    ------
    TypeError
        If one of them is not a `Sphere`.
    ValueError
        If both are walls, or if rho or beta is outside the range of double precision in these units.

    Examples
    --------
    A ball on a wall of the same material, in SI units:

    >>> material = {"young_modulus": 1e10, "poisson_ratio": 0.3, "dissipative_constant": 1e-6}
    >>> pair = Pair(Sphere(radius=0.025, density=917, **material), Sphere.wall(**material))
    >>> f"{pair.beta:.6f} {pair.v_star(0.01):.6f}"
    '0.019513 0.088137'
    """

    first: Sphere
    second: Sphere

    def __post_init__(self) -> None:
        """Refuse a pair without a finite mass, or whose rho or beta is no normal double in these units."""
        for name, value in (("first", self.first), ("second", self.second)):
            if not isinstance(value, Sphere):
                raise TypeError(refusal(name, value, "a Sphere"))
        if self.first.is_wall and self.second.is_wall:
            raise ValueError("first and second are walls: expected at most one wall")
        _in_range("rho", self.rho)
        if self.A > 0:  # beta = 0 is right without dissipation
            _in_range("beta", self.beta)

    @property
    def m_eff(self) -> float:
        """Effective mass m_1 m_2/(m_1 + m_2) (the paper's Eq. 1); the sphere's mass if the other is a wall."""
        return _reduced(self.first.mass, self.second.mass)

    @property
    def R_eff(self) -> float:
        """Effective radius R_1 R_2/(R_1 + R_2) (the paper's Eq. 3), a length; the sphere's radius at a wall."""
        return _reduced(self.first.radius, self.second.radius)

    @property
    def E_eff(self) -> float:
        """Hertz's effective modulus, a pressure: 1/E_eff = (1 - nu_1^2)/Y_1 + (1 - nu_2^2)/Y_2."""
        return _reduced(self.first.plane_strain_modulus, self.second.plane_strain_modulus)

    @property
    def rho(self) -> float:
        """Elastic constant of F = -rho xi^(3/2), in force/length^(3/2); the paper's Eq. 3 for equal materials."""
        return self.E_eff * math.sqrt(self.R_eff) * (4 / 3)

    @property
    def A(self) -> float:
        """Dissipative constant of the pair, a time: the mean weighted with the compliances of both bodies."""
        # A decides between equally soft bodies, so that their order never does.
        bodies = (self.first, self.second)
        soft, stiff = sorted(bodies, key=lambda body: (body.plane_strain_modulus, body.dissipative_constant))
        # The stiffer body's share D_stiff/(D_soft + D_stiff) is at most 1/2: nothing cancels below.
        share = 1 / (1 + stiff.plane_strain_modulus / soft.plane_strain_modulus)
        return soft.dissipative_constant + share * (stiff.dissipative_constant - soft.dissipative_constant)

    @property
    def beta(self) -> float:
        """Return 3/2 A (rho/m_eff)^(2/5) (the paper's Eq. 8), in (time/length)^(1/5); 0 if A is 0."""
        # 3/2 is the exponent of Hertz's force: the damping is A times the derivative of rho xi^(3/2).
        return self.A * self._stiffness * 1.5

    @property
    def _stiffness(self) -> float:
        """(rho/m_eff)^(2/5), power by power because rho/m_eff may overflow."""
        return float(self.rho**0.4 / self.m_eff**0.4)

    def v_star(self, speed: Values) -> Values:
        """Return v* of an impact speed or an array of them, by the function `v_star` with this beta."""
        return v_star(speed, self.beta)

    def speed(self, v_star: Values) -> Values:
        """Return the impact speed of a v* or an array of them, by `speed_from_v_star` with this beta."""
        return speed_from_v_star(v_star, self.beta)

    def contact(self, gravity: Number = 0.0) -> Contact:
        """Return the contact with a weight; `Contact.collide` gives eps, depth and duration in the units of the bodies.

        Parameters
        ----------
        gravity : float
            Acceleration of a sphere towards the wall that it hits, >= 0, a length/time^2. Of two spheres that fall
            together, neither presses on the other.

        Raises
        ------
        TypeError, ValueError
            If gravity is negative or not finite, or is above 0 for two spheres.
        """
        g = checked.number("gravity", gravity, _NON_NEGATIVE)
        if g and not (self.first.is_wall or self.second.is_wall):
            raise ValueError(f"gravity is {g:g} for two spheres: expected 0, or a sphere and a wall")
        # The paper's Eq. 2: F = rho (xi^(3/2) + 3/2 A sqrt(xi) xi'); the weight m_eff g presses the sphere on the wall.
        rho, damping = self.rho, 1.5 * self.A * self.rho
        return Contact(lambda x, v: rho * x**1.5 + damping * np.sqrt(x) * v, mass=self.m_eff, load=self.m_eff * g)

    def epsilon(self, speed: Values, gravity: Number = 0.0) -> Values:
        """Return the coefficient of restitution (the paper's Eq. 5) at an impact speed or an array of them.

        Parameters
        ----------
        speed : float or array
            Impact speed v >= 0, a length/time.
        gravity : float
            As for `contact`: the weight acts during the contact. With gravity, eps is sampled (`Contact.collide`),
            which takes about 10 ms for each speed, and is 0 for a sphere that stays on the wall.

        Returns
        -------
        float or array
            Without gravity 1 at speed 0.

        Raises
        ------
        TypeError
            If a speed is not a real number.
        ValueError
            If a speed is negative, infinite or NaN.

        Examples
        --------
        >>> ice = {"young_modulus": 1e10, "poisson_ratio": 0.3, "dissipative_constant": 1e-5}
        >>> pair = Pair(Sphere(radius=0.025, density=917, **ice), Sphere.wall(**ice))
        >>> f"{pair.epsilon(0.01):.6f} {pair.contact_time(0.01):.3e} {pair.max_compression(0.01):.3e}"
        '0.915376 6.122e-04 2.039e-06'
        >>> f"{pair.epsilon(0.01, gravity=9.81):.6f}"
        '0.882587'
        """
        # Without a weight eps is a function of v*; with one each collision is computed. A sphere at rest stays at rest.
        if gravity == 0:
            return double.epsilon(self.v_star(speed))
        contact = self.contact(gravity)

        def loaded(speeds: FloatArray) -> FloatArray:
            values = [contact.collide(v).epsilon if v else 0.0 for v in speeds.ravel().tolist()]
            return np.reshape(np.array(values), speeds.shape)

        return checked.elementwise(loaded, "speed", speed, _NON_NEGATIVE)

    def one_minus_epsilon(self, speed: Values) -> Values:
        """Return 1 - eps without cancellation; arguments and errors as for `epsilon`."""
        return double.one_minus_epsilon(self.v_star(speed))

    def contact_time(self, speed: Values) -> Values:
        """Return the duration of contact t_c (the paper's Eq. 6), a time, inf at speed 0; arguments as `epsilon`."""
        return double.tau_c(self.v_star(speed)) * self.time_scale(speed)

    def max_compression(self, speed: Values) -> Values:
        """Return the maximal compression, a length; arguments and errors as for `epsilon`."""
        return double.x_max(self.v_star(speed)) * self.length_scale(speed)

    def calibrated(
        self, speed: Number, epsilon: float | None = None, *, one_minus_epsilon: float | None = None
    ) -> Pair:
        """Return this pair with the dissipative constant A that gives the wanted eps at a speed.

        Parameters
        ----------
        speed : float
            Impact speed v > 0, a length/time.
        epsilon, one_minus_epsilon : float
            Exactly one of the two, as for `beta_from_restitution`.

        Returns
        -------
        Pair
            The same spheres, both with the same new A.

        Raises
        ------
        TypeError, ValueError
            As for `beta_from_restitution`.

        Examples
        --------
        >>> material = {"young_modulus": 1e7, "poisson_ratio": 0.3, "dissipative_constant": 0}
        >>> ball = Sphere(radius=0.01, density=2500, **material)
        >>> pair = Pair(ball, ball).calibrated(speed=1.0, epsilon=0.9)
        >>> f"{pair.A:.6e} {pair.epsilon(1.0):.12f}"
        '3.921873e-05 0.900000000000'
        """
        v = checked.number("speed", speed, _POSITIVE)
        portions = {"epsilon": epsilon, "one_minus_epsilon": one_minus_epsilon}
        eps_or_loss = {name: checked.number(name, x, _PORTION) for name, x in portions.items() if x is not None}
        # eps and the speed give beta, and beta gives A by the paper's Eq. 8.
        beta: Any = beta_from_restitution(v, **eps_or_loss)
        return self.damped(self.dissipative_constant(beta))

    def damped(self, dissipative_constant: float) -> Pair:
        """Return a pair of the same spheres, both with a new dissipative constant A, a time."""
        first, second = (
            replace(sphere, dissipative_constant=dissipative_constant) for sphere in (self.first, self.second)
        )
        return Pair(first, second)

    def length_scale(self, speed: Values) -> Values:
        """Return the unit of length of the scaled equation, (rho/m_eff)^(-2/5) v^(4/5).

        Multiplied by x it is the compression xi (the scaling given with the paper's Eq. 9). Arguments and
        errors are those of `epsilon`.
        """
        return checked.elementwise(lambda v: v**0.8 / self._stiffness, "speed", speed, _NON_NEGATIVE)

    def time_scale(self, speed: Values) -> Values:
        """Return the unit of time of the scaled equation, (rho/m_eff)^(-2/5) v^(-1/5).

        Multiplied by tau it is the time t (the scaling given with the paper's Eq. 9).
        It is infinite at speed 0. Arguments and errors are those of `epsilon`.
        """
        return checked.elementwise(lambda v: v**-0.2 / self._stiffness, "speed", speed, _NON_NEGATIVE)

    def dissipative_constant(self, beta: Values) -> Values:
        """Return the A that gives a pair of this rho and m_eff the wanted beta: the paper's Eq. 8 solved for A.

        Parameters
        ----------
        beta : float or array
            In (time/length)^(1/5), >= 0.

        Returns
        -------
        float or array
            A = 2/3 beta (rho/m_eff)^(-2/5), a time: the pair's constant, and each sphere's if both have the
            same.

        Raises
        ------
        TypeError
            If a beta is not a real number.
        ValueError
            If a beta is negative, infinite or NaN.
        """
        return checked.elementwise(lambda b: b / self._stiffness * (2 / 3), "beta", beta, _NON_NEGATIVE)


def beta_from_restitution(
    speed: float | Values, epsilon: float | Values | None = None, *, one_minus_epsilon: float | Values | None = None
) -> Values:
    """Return the beta that gives a coefficient of restitution at a speed: beta = v*^2 v^(-1/5).

    Parameters
    ----------
    speed : float or array
        Impact speed v > 0, a length/time.
    epsilon, one_minus_epsilon : float or array
        Exactly one of the two: eps > 0 and <= 1, or 1 - eps >= 0 and < 1, for nearly elastic collisions. Arrays are
        broadcast. Inverted exactly (`viscopade.arrays.double.v_star_from`).

    Returns
    -------
    float or array
        In (time/length)^(1/5) of the speed's units; 0 where eps is 1.

    Raises
    ------
    TypeError
        If not exactly one of epsilon and one_minus_epsilon is given, or one is not made of real numbers.
    ValueError
        If an argument is out of range anywhere.
    """
    v_stars: Any = v_star_from(epsilon, one_minus_epsilon=one_minus_epsilon)  # type: ignore[type-var]
    if np.asarray(np.isinf(v_stars)).any():
        raise ValueError("epsilon is 0: expected a number > 0 and <= 1")
    beta = checked.Elementwise(lambda v, v_star: v_star**2 / v**0.2, {"speed": _POSITIVE, "v_star": _NON_NEGATIVE})
    return cast(Values, beta(speed, v_stars))


def v_star(speed: float | Values, beta: float | Values) -> Values:
    """Return v* = beta^(1/2) v^(1/10), the only parameter of the paper's Eq. 9.

    Parameters
    ----------
    speed : float or array
        Impact speed v >= 0 along the line of centres.
    beta : float or array
        Damping (the paper's Eq. 8), >= 0, in (time/length)^(1/5) of the same units. Arrays are broadcast.

    Returns
    -------
    float or array
        Without units; 0 where the speed or beta is 0.

    Raises
    ------
    TypeError
        If an argument is not made of real numbers.
    ValueError
        If an argument is negative, infinite or NaN anywhere.
    """
    function = checked.Elementwise(lambda v, b: np.sqrt(b) * v**0.1, {"speed": _NON_NEGATIVE, "beta": _NON_NEGATIVE})
    return cast(Values, function(speed, beta))


def speed_from_v_star(v_star: float | Values, beta: float | Values) -> Values:
    """Return the impact speed v = v*^10/beta^5, the inverse of `v_star` (the paper's Eq. 8).

    Parameters
    ----------
    v_star : float or array
        Without units, >= 0.
    beta : float or array
        > 0, in (time/length)^(1/5); without dissipation every speed has v* = 0. Arrays are broadcast.

    Returns
    -------
    float or array
        In the units of length/time that beta has; inf where it is beyond double precision.

    Raises
    ------
    TypeError
        If an argument is not made of real numbers.
    ValueError
        If v_star is negative, or beta not positive, or either infinite or NaN anywhere.
    """
    # The power comes last: v*^10 and beta^5 overflow long before their quotient does.
    function = checked.Elementwise(lambda v, b: (v / np.sqrt(b)) ** 10, {"v_star": _NON_NEGATIVE, "beta": _POSITIVE})
    return cast(Values, function(v_star, beta))


def restitution_error(v_star: float, relative_error: float) -> float:
    """Return the standard error of eps at a v*, to first order in the relative error of beta, or of A."""
    # eps (d ln eps/d ln v*) d ln v*, and v* ~ beta^(1/2): half of the relative error of beta.
    return abs(double.epsilon(v_star) * double.slope(v_star)) / 2 * relative_error


def beta_cgs_from_si(beta: Values) -> Values:
    """Convert beta from (s/m)^(1/5) to (s/cm)^(1/5): the number shrinks by 100^(1/5).

    Raises
    ------
    TypeError
        If a beta is not a real number.
    ValueError
        If a beta is negative, infinite or NaN.
    """
    return checked.elementwise(lambda b: b / _BETA_SI_PER_CGS, "beta", beta, _NON_NEGATIVE)


def beta_si_from_cgs(beta: Values) -> Values:
    """Convert beta from (s/cm)^(1/5) to (s/m)^(1/5): the number grows by 100^(1/5).

    Raises
    ------
    TypeError
        If a beta is not a real number.
    ValueError
        If a beta is negative, infinite or NaN.
    """
    return checked.elementwise(lambda b: b * _BETA_SI_PER_CGS, "beta", beta, _NON_NEGATIVE)


def _mass_and_density(radius: float, mass: Number | None, density: Number | None) -> tuple[float, float]:
    """Return mass and density of a ball of a checked radius, from the one that is not None; a wall's density is NaN."""
    if (mass is None) == (density is None):
        which = "neither" if mass is None else "both"
        raise ValueError(f"mass and density: {which} given, expected exactly one of them")
    m = math.nan if mass is None else checked.number("mass", mass, _EXTENT)
    d = math.nan if density is None else checked.number("density", density, _POSITIVE)
    if math.isinf(radius) != math.isinf(m):
        infinite, other = ("radius", "mass") if math.isinf(radius) else ("mass", "radius")
        raise ValueError(f"{infinite} is inf: expected a finite number > 0 or, for a wall, {other} = inf too")
    if math.isinf(radius):
        return m, d
    # With one factor of the radius at a time, the intermediate results lie between the given value and the result.
    if mass is None:
        return _in_range("mass", d * radius * radius * radius * _BALL), d
    return m, _in_range("density", m / radius / radius / radius / _BALL)


def _reduced(a: float, b: float) -> float:
    """Return a b/(a + b), safe from overflow; the other one if one is infinite."""
    small, large = min(a, b), max(a, b)
    return small / (1 + small / large)


def _in_range(name: str, value: float) -> float:
    """Return the computed positive quantity `name`; raise ValueError if `value` is out of the range of doubles."""
    # Not below 2^-1022, where doubles have fewer and fewer digits, nor infinite.
    if not _LEAST_NORMAL <= value < math.inf:
        subnormal = 0 < value < _LEAST_NORMAL
        expected = (
            f"at least {_LEAST_NORMAL:.3g}, because smaller numbers lose digits" if subnormal else _POSITIVE.words
        )
        raise ValueError(f"{name} is {value} in these units: expected {expected}; use other units")
    return value
