"""Newton, and the module sim of Warp before it: `ke` and `kd` of shapes, or `restitution`.

    builder.add_shape_sphere(body, cfg=ModelBuilder.ShapeConfig(ke=2500, kd=100, mu=1, restitution=0.8))
    solver = SolverSemiImplicit(model)        or SolverXPBD(model, enable_restitution=True), or SolverMuJoCo(model)

Read in newton/_src/solvers of Newton 1.8.0; numbers of both shapes count by their means, except in SolverMuJoCo:

- SolverSemiImplicit, `_eval_body_contact` of semi_implicit/kernels_contact.py: the force ke x + kd max(x', 0), in each
  contact: damping acts while the bodies approach. SolverFeatherstone has the same. With zeta = kd/(2 sqrt(ke m)) < 1
  and w = sqrt(1 - zeta^2), eps = exp(-(zeta/w) atan(w/zeta)).
- SolverXPBD, xpbd/restitution_kernels.py: `viscopade.simulators.impulse.xpbd`, if `enable_restitution` is set; its
  threshold is 2 g h.
- SolverMuJoCo, mujoco/kernels.py: `convert_solref` makes a `solref` of each shape, 2/kd, kd/(2 sqrt(ke)), or 0.02 1
  without kd, so that ke and kd are per effective mass; `contact_params` takes the mean of both, and the larger mu.
- The same in force space, which needs Newton's own contacts, `use_mujoco_contacts=False`, and `solref_mode` 0 in
  `model.mujoco` for both shapes (2 is the default): `convert_newton_contacts_to_mjwarp_kernel` makes one solref of the
  means of ke and kd, times (1 - solimp[1]) times the sum of `body_invweight0`, which is 1/m of free bodies, and in the
  pyramidal cone times mu^2 (1 + mu^2)/(condim - 1) (`_normal_contact_gain_factor`). That gives a body at rest the depth
  that ke says. In a collision both are smaller by about this factor times m.

A box that falls flat has four contacts, each with the same ke and kd: in all four times of both.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from mpmath import mp

from viscopade.collision.contact import Contact
from viscopade.collision.schemes import SEMI_IMPLICIT
from viscopade.simulators import impulse, mujoco
from viscopade.simulators.formula import LINEAR, LINEAR_RETURN, DampingFormula, linear_kappa, viscoelastic_kappa
from viscopade.simulators.native import LARGER, MEAN, Impact, Impulse, Mixed, Native, Parameter, Values, restitution
from viscopade.simulators.simulator import Simulator
from viscopade.theory.law import VISCOELASTIC

_CONTACT = "newton/_src/solvers/semi_implicit/kernels_contact.py"
_EVALUATE, _PARAMS = "_eval_body_contact", "contact_params"
_CONVERT = "convert_newton_contacts_to_mjwarp_kernel"
_DEFAULT_SOLREF = 0.02, 1.0  # of SolverMuJoCo for kd = 0: timeconst in s, and dampratio
_LEAST_GAIN = 2.220446049250313e-16  # MJ_MINVAL, the least ke and kd in force space


def approach_kappa(kappa: Any) -> Any:
    """Return kappa of the linear contact up to x = 0 with the eps that damping of the approach alone gives.

    `kappa` is kd/sqrt(ke m); both are mpmath numbers.

    With zeta = kappa/2 the approach damps eps to exp(-pi s), s = (zeta/w) atan(w/zeta)/pi, and the linear contact with
    zeta' = s/sqrt(1 + s^2) has this eps.
    """
    zeta = kappa / 2
    if zeta == 0:
        return mp.mpf(0)
    w = mp.sqrt(1 - zeta**2)
    # The approach x = exp(-zeta t) sin(w t)/w stops at t = atan(w/zeta)/w, where x = exp(-zeta t); the undamped spring
    # gives all of it back, so eps = exp(-pi s). At w = 0 the limit of (zeta/w) atan(w/zeta) is 1. For zeta > 1 w and
    # the angle are imaginary, and s is real.
    s = mp.mpf(1) / mp.pi if w == 0 else mp.re(zeta / w * mp.atan(w / zeta)) / mp.pi
    return 2 * s / mp.sqrt(1 + s**2)


def _is_in_force_space(values: Values) -> bool:
    """Return whether ke and kd of SolverMuJoCo are forces: Newton's own contacts, and solref_mode 0."""
    return (values["use_mujoco_contacts"], values["solref_mode"]) == ("False", "0")


def _gain_factor(mu: float) -> float:
    """Return m times the factor of ke and kd in force space, for a coefficient of friction mu."""
    # (1 - d) q, q = mu^2 (1 + mu^2)/(condim - 1), in the pyramidal cone; MuJoCo's defaults are d = solimp[1] = 0.95 and
    # condim = 3.
    return (1 - 0.95) * mu**2 * (1 + mu**2) / (3 - 1)


def _contact(values: Values, impact: Impact) -> Contact | Impulse:
    """Return the contact of a solver, or the rebound of SolverXPBD.

    `values` are the numbers of the user's file by their names, pairs of both shapes (SI units), and `impact` has the
    effective mass in kg, the speed, g and the time step. `values.mix` makes one number of both by a rule, and remembers
    it for the answer.
    """
    solver = values["solver"]
    if solver == "SolverXPBD":
        epsilon = values.mix("restitution", MEAN, "build_restitution_manifolds")
        is_on = values["enable_restitution"] == "True"
        # Without time steps a rebound is the approach times restitution; in steps of h it has a threshold of 2 g h.
        if impact.step is None:
            return Impulse(lambda phases: np.full_like(phases, epsilon if is_on else 0))
        threshold = 2 * impact.gravity * impact.step if is_on else math.inf
        ground = impulse.Ground(epsilon, threshold, 0, impact.gravity, impact.step)
        return Impulse(lambda phases: impulse.flight_epsilon(impulse.xpbd, ground, impact.speed, phases))
    if solver == "SolverMuJoCo" and _is_in_force_space(values):
        # One solref, 2/kd, kd/(2 sqrt(ke)), of the means of ke and kd times the factor.
        mu = values.mix("mu", LARGER, _PARAMS)
        factor = _gain_factor(mu) / impact.effective_mass
        ke, kd = (max(factor * values.mix(name, MEAN, _CONVERT), _LEAST_GAIN) for name in ("ke", "kd"))
        timeconst, dampratio = 2 / kd, kd / 2 / math.sqrt(ke)
        meaning = "ke and kd times (1 - solimp[1]) mu^2 (1 + mu^2)/2/m"
        values.mixed["solref"] = Mixed((timeconst, dampratio), "made in force space", meaning, (ke, kd), _CONVERT)
        settings = {"solref": f"{timeconst!r} {dampratio!r}", "friction": repr(mu)}
        return mujoco.NATIVE.contact(mujoco.NATIVE.values(settings), impact)
    if solver == "SolverMuJoCo":
        # Each shape has a solref of its own, and MuJoCo's contact the mean of both.
        solrefs = [
            (2 / kd, kd / 2 / math.sqrt(ke)) if kd > 0 else _DEFAULT_SOLREF
            for ke, kd in zip(values["ke"], values["kd"], strict=True)
        ]
        timeconst, dampratio = (
            values.mix(name, MEAN, _PARAMS, pair)
            for name, pair in zip(("timeconst", "dampratio"), zip(*solrefs, strict=True), strict=True)
        )
        settings = {"solref": f"{timeconst!r} {dampratio!r}", "friction": repr(values.mix("mu", LARGER, _PARAMS))}
        return mujoco.NATIVE.contact(mujoco.NATIVE.values(settings), impact)
    # SolverSemiImplicit: ke x + kd max(x', 0)
    ke, kd, mass = values.mix("ke", MEAN, _EVALUATE), values.mix("kd", MEAN, _EVALUATE), impact.effective_mass
    return Contact(lambda x, v: ke * x + kd * np.maximum(v, 0), mass, mass * impact.gravity)


def _damping_values(values: Values, c: float, impact: Impact) -> dict[str, Any]:
    """Return what to write for a damping c, a number without unit, by parameter and for both shapes.

    It is kd = c sqrt(ke m), in SolverMuJoCo with the mass 1, because ke and kd are per mass, or restitution = exp(-c).
    """
    if values["solver"] == "SolverXPBD":
        switch = {} if values["enable_restitution"] == "True" else {"enable_restitution": "True"}
        return {"restitution": (math.exp(-c),) * 2} | switch
    # ke is the mean of both shapes.
    ke, mass = sum(values["ke"]) / 2, 1.0 if values["solver"] == "SolverMuJoCo" else impact.effective_mass
    if values["solver"] == "SolverMuJoCo" and _is_in_force_space(values):
        # Both are multiplied by g/m, g of `_gain_factor`, and then per mass: kd g/m = c sqrt(ke g/m).
        mass = impact.effective_mass / _gain_factor(values.mix("mu", LARGER, _PARAMS))
    return {"kd": (c * math.sqrt(ke * mass),) * 2}


def _per_mass(unit: str) -> dict[str, str]:
    """Return the unit with the solver whose numbers are per effective mass."""
    return {"SolverMuJoCo": unit}


def _warnings(values: Values, impact: Impact) -> Iterator[str]:
    """Yield warnings: restitution is off, or one of two settings makes ke and kd forces, and the other one does not."""
    if values["solver"] == "SolverXPBD" and values["enable_restitution"] == "False":
        yield "enable_restitution is off, the default: SolverXPBD then ignores restitution"
    own_contacts, forces = values["use_mujoco_contacts"] == "False", values["solref_mode"] == "0"
    if values["solver"] == "SolverMuJoCo" and own_contacts != forces:
        yield "ke and kd are per effective mass: forces need both use_mujoco_contacts=False and solref_mode=0"


_NATIVE = Native(
    (
        Parameter(
            "ke",
            "N/m",
            "2500",
            "a number > 0",
            lambda pair: min(pair) > 0,
            per_body=True,
            other_units=_per_mass("1/s^2"),
        ),
        Parameter("kd", "N s/m", "100", per_body=True, other_units=_per_mass("1/s")),
        Parameter("mu", default="1", per_body=True),
        restitution("restitution", "0", above=None, per_body=True),
        Parameter("enable_restitution", default="False", words=("False", "True")),
        Parameter("use_mujoco_contacts", default="True", words=("True", "False")),
        Parameter("solref_mode", default="2", words=("2", "0")),
    ),
    _contact,
    _CONTACT,
    schemes={"SolverSemiImplicit": SEMI_IMPLICIT, "SolverXPBD": SEMI_IMPLICIT, "SolverMuJoCo": SEMI_IMPLICIT},
    integrator="solver",
    damped_values=_damping_values,
    warnings=_warnings,
)

SIMULATOR = Simulator(
    "newton",
    "Newton and Warp",
    "Newton 1.8.0",
    (
        DampingFormula(
            "SolverSemiImplicit, damping of the approach",
            LINEAR_RETURN,
            "kd/sqrt(ke m)",
            approach_kappa,
            ("0", "1e3"),  # by hand; eps of 1e3 is 0.001
            "other law",
            _CONTACT,
            linear_kappa,
            note="The damping acts while the bodies approach.",
            scheme=None,
        ),
        DampingFormula(
            "SolverMuJoCo",
            LINEAR,
            "kd/sqrt(ke)",
            mp.mpf,
            ("0", "1e3"),
            "other end",
            "newton/_src/solvers/mujoco/kernels.py",
            linear_kappa,
            note="ke and kd are per effective mass.",
        ),
        DampingFormula(
            "SolverXPBD, restitution",
            VISCOELASTIC,
            "restitution",
            viscoelastic_kappa,
            ("1e-3", "1"),  # the least restitution of the audit, by hand
            "exact",
            "newton/_src/solvers/xpbd/restitution_kernels.py",
            scheme=None,
            is_impulse=True,
        ),
    ),
    native=_NATIVE,
)
