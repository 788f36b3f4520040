"""Lethe: `restitution coefficient` of particles and walls.

    subsection particle type 0
      set young modulus particles           = 1000000
      set restitution coefficient particles = 0.9

Read in chaos-polymtl/lethe at commit 0092035, include/dem/particle_particle_contact_force.h, of which that of walls,
particle_wall_contact_force.h (at commit 72f6c69), is the like: beta = ln e/sqrt(ln^2 e + pi^2), in constants of five
digits, with the effective mass, at a wall that of the particle.

- `linear`: the dashpot 2 |beta| sqrt(m k), and a spring whose contact is as deep as Hertz' at v_c = 1 m/s (some older
  versions: at the present speed), k = 16/15 sqrt(R) E (15/16 m v_c^2/(sqrt(R) E))^(1/5); it may pull.
- `nonlinear` of walls, and `hertz`, `hertz_mindlin_limit_overlap`, `hertz_mindlin_limit_force` of particles, which
  differ along the surface: Hertz' spring, and the dashpot sqrt(10/3) |beta| sqrt(2 E sqrt(R x) m), which is Tsuji's
  with kappa = sqrt(5) |beta|; it may pull.
- `set_effective_properties`: E is Hertz' E_eff of two types, or of a type and the wall, e their harmonic mean.
- `integrate` of source/dem/velocity_verlet_integrator.cc (commit 01b3ebc) and of explicit_euler_integrator.cc (commit
  01aaa7b): both kick with the force of the newest state and then drift, which is semi-implicit Euler's method.

- `hertz_JKR` of particles, `JKR` of walls: JKR's force in place of Hertz' at x > 0 (`viscopade.simulators.adhesion`).

`DMT` is not computed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, cast

from viscopade.collision.contact import Contact
from viscopade.collision.schemes import SEMI_IMPLICIT
from viscopade.simulators import adhesion, native
from viscopade.simulators.formula import LINEAR_RETURN, TSUJI_RETURN, formulas, linear_kappa, tsuji_kappa
from viscopade.simulators.simulator import Simulator

_HERTZ = "hertz_mindlin_limit_overlap", "hertz_mindlin_limit_force", "hertz"
_METHOD = "particle {} contact force method"
_E, _WALL = "restitution coefficient {}", "include/dem/particle_wall_contact_force.h"
_LEAST = 1e-15  # restitution that is written, in place of 0: ln 0 is no damping
_ONE = "as the other one is that of the wall"


def _force(values: native.Values, impact: native.Impact) -> native.Power | Contact:
    """Return the force k x^a + c x^b v between two types of particles, or of one and the wall; with JKR a contact.

    `values` are the numbers of the user's file by their names, pairs where both bodies have one (SI units). `impact`
    has the effective mass and radius, in kg and m.
    """
    other, source = values["other"], "set_effective_properties"

    def of_both(name: str) -> tuple[float, float]:
        """Return the numbers of both bodies: of two types of particles, or of one and the wall."""
        if other == "particle":
            return cast("tuple[float, float]", values[f"{name} particles"])
        return values.single(f"{name} particles", _ONE), values[f"{name} wall"]

    young, poisson, restitution = map(of_both, ("young modulus", "poisson ratio", "restitution coefficient"))
    modulus = native.effective_modulus(values, young, poisson, source)
    e = values.mix("restitution coefficient", native.HARMONIC, source, restitution)
    mass, stiffness = impact.effective_mass, modulus * math.sqrt(impact.effective_radius)
    # Hertz: k = 4/3 E sqrt(R). c = kappa sqrt(k m), with the kappa that the formula makes of e.
    hertz = native.power_force(SIMULATOR.formula("nonlinear"), e, 4 / 3 * stiffness, mass)
    if values[_METHOD.format(other)].endswith("JKR"):
        return adhesion.lethe_contact(modulus, hertz, of_both("surface energy"), impact)
    if values[_METHOD.format(other)] != "linear":
        return hertz
    # k = 16/15 sqrt(R) E (15/16 m v_c^2/(sqrt(R) E))^(1/5), v_c = 1 m/s
    k = 16 / 15 * stiffness * (15 / 16 * mass / stiffness) ** 0.2
    return native.power_force(SIMULATOR.formula("linear"), e, k, mass)


def _damping_values(values: native.Values, c: float, impact: native.Impact) -> Mapping[str, Any]:
    """Return one restitution exp(-c) for both bodies, by the names of the parameters; c is a damping without unit."""
    e = max(math.exp(-c), _LEAST)
    particles = {_E.format("particles"): (e, e)}
    return particles if values["other"] == "particle" else particles | {_E.format("wall"): e}


_NATIVE = native.Native(
    (
        native.Parameter("other", default="particle", words=("particle", "wall")),
        native.Parameter(_METHOD.format("particle"), default=_HERTZ[0], words=("linear", *_HERTZ, "hertz_JKR")),
        native.Parameter(_METHOD.format("wall"), default="nonlinear", words=("linear", "nonlinear", "JKR")),
        native.positive("young modulus particles", "Pa", "1e6", per_body=True),
        native.poisson_ratios("poisson ratio particles", "0.3"),
        native.restitution(_E.format("particles"), "0.1", per_body=True),
        native.Parameter("surface energy particles", "J/m^2", "0", per_body=True),
        native.positive("young modulus wall", "Pa", "1e6"),
        native.poisson_ratios("poisson ratio wall", "0.3", per_body=False),
        native.restitution(_E.format("wall"), "0.1"),
        native.Parameter("surface energy wall", "J/m^2", "0"),
    ),
    _force,
    "include/dem/particle_particle_contact_force.h",
    schemes={"velocity_verlet": SEMI_IMPLICIT, "explicit_euler": SEMI_IMPLICIT},
    integrator="integration method",
    damped_values=_damping_values,
)

SIMULATOR = Simulator(
    "lethe",
    "Lethe",
    "commits 0092035 and 72f6c69",
    formulas(
        "restitution coefficient",
        (str(_LEAST), "1"),
        _WALL,
        ("nonlinear", TSUJI_RETURN, tsuji_kappa, "exact"),
        ("linear", LINEAR_RETURN, linear_kappa, "exact"),
    ),
    native=_NATIVE,
)
