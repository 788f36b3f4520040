"""Collisions in OpenSim, and so in Simbody, for the audit: a sphere flies against a half space, without gravity.

The Python package `opensim` is needed. `python -m viscopade_lab.programs.audit` runs all collisions.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import partial

from viscopade.audit.measured import Measurement
from viscopade_lab.programs import audit_cases
from viscopade_lab.programs.audit_cases import AuditCase

RADIUS, MASS, STIFFNESS = 0.1, 2.0, 1e6
_ACCURACY = 1e-9  # of the integrator
_INTERVAL, _LONGEST = 0.01, 2.0  # s: times at which the sphere is looked at; a contact takes some 0.02 s


program = partial(audit_cases.package, "opensim", "opensim")
"""Return the package, or raise RuntimeError if it is not installed."""


def collided(
    dissipation: float, speed: float = 1.0, *, stiffness: float = STIFFNESS, interval: float = _INTERVAL
) -> tuple[float, float]:
    """Return eps, and the deepest penetration seen, of a sphere that hits a half space at a speed."""
    opensim = program()
    opensim.Logger.setLevelString("Off")
    zero, upright = opensim.Vec3(0), opensim.Vec3(0, 0, math.pi / 2)
    model = opensim.Model()
    model.setGravity(zero)
    ball = opensim.Body("ball", MASS, zero, opensim.Inertia(1, 1, 1))
    joint = opensim.SliderJoint("slider", model.getGround(), zero, upright, ball, zero, upright)
    floor = opensim.ContactHalfSpace(zero, opensim.Vec3(0, 0, -math.pi / 2), model.getGround(), "floor")
    force = opensim.HuntCrossleyForce()
    force.setStiffness(stiffness)
    force.setDissipation(dissipation)
    for name in ("floor", "sphere"):
        force.addGeometry(name)
    model.addBody(ball)
    model.addJoint(joint)
    model.addContactGeometry(floor)
    model.addContactGeometry(opensim.ContactSphere(RADIUS, zero, ball, "sphere"))
    model.addForce(force)
    state = model.initSystem()
    height = joint.get_coordinates(0)
    height.setValue(state, RADIUS + 0.001)
    height.setSpeedValue(state, -speed)
    manager = opensim.Manager(model)
    manager.setIntegratorAccuracy(_ACCURACY)
    manager.initialize(state)
    deepest = 0.0
    for i in range(1, round(_LONGEST / interval)):
        state = manager.integrate(i * interval)
        velocity, depth = float(height.getSpeedValue(state)), RADIUS - float(height.getValue(state))
        deepest = max(deepest, depth)
        if velocity > 0 and depth < 0:
            return velocity / speed, deepest
    raise RuntimeError("a collision of the audit has not ended in OpenSim")


def rebound(dissipation: float, speed: float = 1.0) -> float:
    """Return eps of a sphere that hits a half space at a speed."""
    return collided(dissipation, speed)[0]


def measured(_: AuditCase, parameter: float) -> float:
    """Return the eps with a parameter."""
    return rebound(parameter)


def audit_measurements(some: Sequence[AuditCase] | None = None) -> Iterator[Measurement]:
    """Yield the collisions of the audit, or some of them.

    Raises
    ------
    RuntimeError
        If OpenSim is not there, or a collision has not ended.
    """
    version = f"OpenSim {program().GetVersion()}"
    for case in some or audit_cases.all_cases("simbody"):
        yield case.measured(version, rebound(case.parameter))
