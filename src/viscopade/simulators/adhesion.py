"""Contacts that adhere, as programs have them: how they pull, where contact begins and ends, and what that costs.

    pair_coeff * * jkr 5e6 3e6 0.3 0.035 tangential linear_nohistory 0 0 damping viscoelastic

LAMMPS, at commit 07b704c (src/GRANULAR/gran_sub_mod_normal_kernel.h, and gran_sub_mod_normal.cpp in the release of
22 Jul 2025, which the tests run). Its gamma is half of the work of adhesion, w = 2 gamma.

- `jkr`: JKR's force. Contact forms at x = 0, and the neck breaks at the largest pull, at -x =
  (3 pi^2/16 R gamma^2/E^2)^(1/3) (`GranSubModNormalJKR::pulloff_distance`). Free spheres would pull it longer, to
  dx/da = 0: elastic spheres lose 3.50 (w^5 R^4/E^2)^(1/3) in LAMMPS, and 7.09 in theory.
- `dmt`: Hertz' force and the constant pull 4 pi gamma R at x > 0. Elastic spheres lose nothing.
- Dampings are velocity, mass_velocity and viscoelastic, the last in proportion to the contact radius of the model.
  tsuji, coeff_restitution and limit_damping are refused with both (`GranularModel::init`).

    set particle wall contact force method = JKR

Lethe, at commit 01b3ebc (source/dem/particle_wall_jkr_force.cc) and 0092035 (include/dem/
particle_particle_contact_force.h, `hertz_JKR`): JKR's force with the work of adhesion w = g1 + g2 - (sqrt(g1) -
sqrt(g2))^2, which is 2 sqrt(g1 g2), and the damping of Hertz' contact, at x > 0 only: there is no neck.

PhasicFlow has no adhesion (src/Interaction/Models/contactForce at commit 080f7de). CabanaPD (src/force_models/
CabanaPD_HertzianJKR.hpp at commit 1db2dc7) has a JKR force without damping, whose neck breaks at dx/da = 0. Its contact
radius is that of the work of adhesion 2 (1 - nu^2) w, and its modulus has (1 - nu)^2 for 1 - nu^2: it is none of these.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import ArrayLike

from viscopade.arrays.checked import FloatArray
from viscopade.collision.adhesion import JKR, LARGEST_PULL
from viscopade.collision.contact import Contact
from viscopade.simulators import native

LAMMPS_NORMALS = ("jkr", "dmt")
"""Normal models of LAMMPS that adhere."""


def lammps_contact(
    values: Mapping[str, object], E_eff: float, damping: float, gamma: float, impact: native.Impact
) -> Contact:
    """Return the contact of a line `pair_coeff * * jkr …` or `dmt`.

    Parameters
    ----------
    values : mapping
        The words of the line: "normal", "damping" and "limit_damping".
    E_eff : float
        Hertz' effective modulus, in Pa.
    damping : float
        The coefficient of the damping model: in N s/m (velocity), 1/s (mass_velocity), 1/(m s) (viscoelastic).
    gamma : float
        LAMMPS's gamma, half of the work of adhesion, in J/m^2.
    impact : Impact
        With the effective mass and radius, and the gravity that presses the bodies together.

    Raises
    ------
    ValueError
        If LAMMPS refuses the line, or nothing adheres.
    """
    if values["limit_damping"] == "yes":
        raise ValueError(f"limit_damping is yes: expected no, because LAMMPS refuses it with {values['normal']}")
    mass, R = impact.effective_mass, impact.effective_radius
    # Damping force over rate, in N s/m, as a function of the contact radius a.
    dampings: dict[object, Callable[[FloatArray], ArrayLike]] = {
        "velocity": lambda a: damping,
        "mass_velocity": lambda a: damping * mass,
        "viscoelastic": lambda a: damping * mass * a,
    }
    if values["damping"] not in dampings:
        accepted = f"{', '.join(dampings)}, because LAMMPS refuses others with {values['normal']}"  # type: ignore[arg-type]
        raise ValueError(f"damping is {values['damping']}: expected {accepted}")
    if not gamma > 0:
        raise ValueError(f"coefficients has gamma {gamma:g}: expected a number > 0, or hertz/material without it")
    if values["normal"] == "jkr":
        # JKR's force of the work of adhesion w = 2 gamma, whose neck breaks at the largest pull
        return JKR(E_eff, R, 2 * gamma, LARGEST_PULL).contact(mass, dampings[values["damping"]], mass * impact.gravity)

    # DMT: Hertz' contact radius, a^2 = R x, and the constant pull 2 pi w R = 4 pi gamma R
    def force(x: FloatArray, v: FloatArray) -> FloatArray:
        a = np.sqrt(R * x)
        # 4/3 E a x - 4 pi gamma R + c(a) v
        return 4 / 3 * E_eff * a * x - 4 * math.pi * gamma * R + np.asarray(dampings[values["damping"]](a)) * v

    return Contact(force, mass, mass * impact.gravity, "return")


def lethe_contact(
    E_eff: float, hertz: native.Power, surface_energies: tuple[float, float], impact: native.Impact
) -> Contact:
    """Return Lethe's contact: JKR's force at x > 0, with the damping of Hertz' contact.

    Parameters
    ----------
    E_eff : float
        Hertz' effective modulus, in Pa.
    hertz : Power
        The contact without adhesion, of whose force k x^a + c x^b v the damping counts.
    surface_energies : tuple of float
        g1 and g2 of both bodies, in J/m^2.
    impact : Impact
        With the effective mass and radius, and the gravity that presses the bodies together.

    Raises
    ------
    ValueError
        If nothing adheres.
    """
    g1, g2 = surface_energies
    if not g1 * g2 > 0:
        raise ValueError(
            f"surface energy is {g1:g} {g2:g}: expected numbers > 0, or a contact force method without JKR"
        )
    # The work of adhesion is 2 sqrt(g1 g2).
    spheres = JKR(E_eff, impact.effective_radius, 2 * math.sqrt(g1 * g2))
    b = float(hertz.law.damping)

    def force(x: FloatArray, v: FloatArray) -> FloatArray:
        return spheres.force(spheres.contact_radius(x)) + hertz.c * x**b * v

    mass = impact.effective_mass
    return Contact(force, mass, mass * impact.gravity, "return")
