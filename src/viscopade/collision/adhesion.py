"""JKR: elastic spheres that adhere, and the neck in which they lose energy (Johnson, Kendall and Roberts 1971).

With the contact radius a, the effective modulus E and radius R, and the work of adhesion w, an energy per area,

    F = 4 E a^3/(3 R) - sqrt(8 pi w E a^3),    x = a^2/R - sqrt(2 pi w a/E).

The bodies touch first at x = 0, where a is a_0 = (2 pi w R^2/E)^(1/3). With z = (a/a_0)^(1/2) it is

    x = (a_0^2/R) (z^4 - z),    F = 4 E a_0^3/(3 R) (z^6 - 3/2 z^3).

On the way back a neck holds at x < 0. It breaks where dx/da = 0, at z^3 = 1/4, or, in some programs, at the largest
pull, at z^3 = 3/4. `derivations/17_adhesion.py` derives these formulas. The DMT model of stiff spheres is Hertz's force
and a constant load 2 pi w R at x > 0 (`viscopade.collision.weight`).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from viscopade.arrays.checked import FloatArray
from viscopade.collision.contact import Contact, sticking_speed
from viscopade.collision.spheres import Pair

LARGEST_PULL = 0.75 ** (1 / 3)
"""z where the pull is largest, (3/2) pi w R."""
TURN_OF_COMPRESSION = 0.25 ** (1 / 3)
"""z where dx/da = 0: no neck is longer."""
_RANGE = 1e4  # of the search for a sticking speed: at much slower speeds the rounding of larger ones decides
_NEWTON = 9  # steps from above: a few to come near, where each doubles the digits; 5 from one digit to a double's 16


class JKR(NamedTuple):
    """Two elastic spheres that adhere, or a sphere and a plane, in any consistent units.

    Attributes
    ----------
    modulus : float
        Effective modulus E, 1/E = (1 - nu_1^2)/Y_1 + (1 - nu_2^2)/Y_2.
    radius : float
        Effective radius R.
    work : float
        Work of adhesion w > 0: twice the surface energy of two like bodies.
    neck : float
        z at which the neck breaks.
    """

    modulus: float
    radius: float
    work: float
    neck: float = TURN_OF_COMPRESSION

    @property
    def first_radius(self) -> float:
        """Contact radius a_0 at first contact."""
        return float((2 * math.pi * self.work * self.radius**2 / self.modulus) ** (1 / 3))

    @property
    def break_at(self) -> float:
        """Compression < 0 at which the neck breaks."""
        return self.first_radius**2 / self.radius * (self.neck**4 - self.neck)

    @property
    def pull_off_force(self) -> float:
        """The largest pull, (3/2) pi w R: -F at z^3 = 3/4, 4 E a_0^3/(3 R) (9/8 - 9/16)."""
        return 1.5 * math.pi * self.work * self.radius

    @property
    def neck_energy(self) -> float:
        """Energy that elastic bodies lose in the neck; k (w^5 R^4/E^2)^(1/3)."""
        z = self.neck
        # - int_z^1 F dx in units of 4 E a_0^5/(3 R^2): dx = (4 z^3 - 1) dz, and the integral of
        # (z^6 - 3/2 z^3) (4 z^3 - 1) is 2/5 z^10 - z^7 + 3/8 z^4, which is -9/40 at z = 1.
        lost = 9 / 40 + 2 / 5 * z**10 - z**7 + 3 / 8 * z**4
        return 4 / 3 * self.modulus * self.first_radius**5 / self.radius**2 * lost

    def sticking_speed(self, mass: float) -> float:
        """Return the speed below which elastic bodies of an effective mass stay together; eps^2 = 1 - (v_s/v)^2."""
        return math.sqrt(2 * self.neck_energy / mass)

    def contact_radius(self, x: ArrayLike) -> FloatArray:
        """Return the contact radius at compressions, which are at least that of dx/da = 0."""
        scaled = np.asarray(x, float) * (self.radius / self.first_radius**2)
        # z^4 - z - X = (z^2 + p z + (p^2 + 1/p)/2) (z^2 - p z + (p^2 - 1/p)/2), where u = p^2 is the one positive zero
        # of u^3 + 4 X u - 1. Newton's method comes down to it from above, where u^3 + 4 X u - 1 is positive and convex.
        # Above are 1 and 1/(4 X) for X > 0; for X down to -0.4725, where dx/da = 0 and the zero is 4^(1/3) = 1.587, 1.6
        # is.
        with np.errstate(divide="ignore"):
            u = np.where(scaled > 0, np.minimum(1, 0.25 / np.maximum(scaled, 0)), 1.6)
        for _ in range(_NEWTON):
            u = u - (u * (u * u + 4 * scaled) - 1) / (3 * u * u + 4 * scaled)
        p = np.sqrt(u)
        z = (p + np.sqrt(np.maximum(2 / p - u, 0))) / 2  # the root is 0 where dx/da = 0
        return np.asarray(self.first_radius * z * z)

    def force(self, a: FloatArray) -> FloatArray:
        """Return the elastic force at contact radii."""
        cube = a**3
        adhesive = np.sqrt(8 * math.pi * self.work * self.modulus * cube)
        return np.asarray(4 * self.modulus / (3 * self.radius) * cube - adhesive)

    def contact(self, mass: float, damping: Callable[[FloatArray], ArrayLike], load: float = 0.0) -> Contact:
        """Return the contact with a damping, which is a function of the contact radius: force over rate."""

        def force(x: FloatArray, v: FloatArray) -> FloatArray:
            a = self.contact_radius(x)
            return self.force(a) + np.asarray(damping(a), float) * v

        return Contact(force, mass, load, "break", break_at=self.break_at)


def adhesive(pair: Pair, work: float, gravity: float = 0.0) -> Contact:
    """Return the contact of viscoelastic spheres that adhere, whose neck breaks where dx/da = 0.

    The damping is 2 A E a v, that of Hertz' contact with the contact radius of JKR's: 3/2 A rho sqrt(x) with
    rho = 4/3 E sqrt(R) and a = sqrt(R x).

    Parameters
    ----------
    pair : Pair
    work : float
        Work of adhesion > 0.
    gravity : float
        Acceleration of a sphere that falls on a wall.
    """
    E, A, mass = pair.E_eff, pair.A, pair.m_eff
    return JKR(E, pair.R_eff, work).contact(mass, lambda a: 2 * A * E * a, mass * gravity)


class Sticking(NamedTuple):
    """What adhesion does to a contact.

    Attributes
    ----------
    speed : float or None
        Speed below which the bodies stay together, without time steps; None if none is found.
    neck_energy : float
        Energy that the neck costs without damping; 0 if there is none.
    """

    speed: float | None
    neck_energy: float


def sticking(contact: Callable[[float], Contact], speed: float) -> Sticking | None:
    """Return what adhesion does to the contact of an impact speed; None if the bodies do not adhere.

    The search for the speed below which they stay begins at that of bodies without damping, or at `speed`.
    """
    adhesive = contact(speed)
    with np.errstate(all="ignore"):  # of forces without a limit
        pull = -adhesive.forces(np.array([adhesive.begin]), np.zeros(1))
    if adhesive.end == "force" or not pull[0] > 0:
        return None
    energy = adhesive.neck_energy if adhesive.end == "break" else 0.0
    near = math.sqrt(2 * energy / adhesive.mass) or speed
    try:
        slowest = sticking_speed(lambda factor: contact(factor * near).collide(factor * near).parts, near, _RANGE)
    except ValueError:  # some speed in the search is too slow or too fast for an integration
        slowest = None
    return Sticking(slowest, energy)
