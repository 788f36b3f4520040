"""Collisions in Drake for the audit: a sphere flies against a half space, without gravity.

The Python package `drake` is needed. `python -m viscopade_lab.programs.audit` runs all collisions.
"""

from __future__ import annotations

import importlib.metadata
import math
from collections.abc import Iterator, Sequence
from functools import partial

from viscopade.audit.measured import Measurement
from viscopade_lab.programs import audit_cases
from viscopade_lab.programs.audit_cases import AuditCase

STIFFNESS, MASS, RADIUS = 2e4, 2.0, 0.1
DISCRETE = ("lagged", "similar", "tamsi", "sap")
_ACCURACY = 1e-10  # of the integrator where there is no time step
_CONTACT_TIMES = 60


program = partial(audit_cases.package, "pydrake.all", "drake")
"""Return the package, or raise RuntimeError if it is not installed."""


def rebound(
    step: float,
    phase: float = 0.5,
    *,
    approximation: str = "lagged",
    dissipation: float = 0.0,
    relaxation_time: float = 0.0,
    speed: float = 1.0,
    stiffness: float = STIFFNESS,
) -> float:
    """Return eps of a sphere that hits a half space at a speed; a time step of 0 is none.

    Both materials have twice the stiffness that is theirs in contact, the dissipation, and half of the relaxation
    time.
    """
    drake = program()
    builder = drake.DiagramBuilder()
    config = drake.MultibodyPlantConfig(time_step=step, discrete_contact_approximation=approximation)
    plant, _ = drake.AddMultibodyPlant(config, builder)
    plant.mutable_gravity_field().set_gravity_vector([0, 0, 0])
    inertia = drake.SpatialInertia(MASS, [0, 0, 0], drake.UnitInertia.SolidSphere(RADIUS))
    ball = plant.AddRigidBody("ball", inertia)
    plant.AddJoint(drake.PrismaticJoint("z", plant.world_frame(), ball.body_frame(), [0, 0, 1]))
    material = drake.ProximityProperties()
    drake.AddContactMaterial(
        dissipation=dissipation,
        point_stiffness=2 * stiffness,
        friction=drake.CoulombFriction(0, 0),
        properties=material,
    )
    material.AddProperty("material", "relaxation_time", relaxation_time / 2)
    for body, shape in ((ball, drake.Sphere(RADIUS)), (plant.world_body(), drake.HalfSpace())):
        plant.RegisterCollisionGeometry(body, drake.RigidTransform(), shape, "contact", material)
    plant.Finalize()
    simulator = drake.Simulator(builder.Build())
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    unit = math.pi * math.sqrt(MASS / stiffness)
    plant.SetPositions(context, [RADIUS + phase * speed * (step or unit / 100)])
    plant.SetVelocities(context, [-speed])
    if not step:
        simulator.get_mutable_integrator().set_target_accuracy(_ACCURACY)
    simulator.Initialize()
    for i in range(1, 4 * _CONTACT_TIMES):
        simulator.AdvanceTo(i * unit / 4)
        velocity = float(plant.GetVelocities(context)[0])
        if velocity > 0 and plant.GetPositions(context)[0] > RADIUS:
            return velocity / speed
    raise RuntimeError("a collision of the audit has not ended in Drake")


def measured(case: AuditCase, parameter: float, approximation: str = "lagged") -> float:
    """Return the eps of a case's time step and phase with a parameter."""
    frequency = math.sqrt(STIFFNESS / MASS)
    if case.formula.scheme is None:
        return rebound(0.0, dissipation=parameter)
    step = case.seconds(1.0, STIFFNESS, MASS)
    if case.formula.name.startswith("sap"):
        return rebound(step, case.phase, approximation="sap", relaxation_time=parameter / frequency)
    return rebound(step, case.phase, approximation=approximation, dissipation=parameter)


def audit_measurements(some: Sequence[AuditCase] | None = None) -> Iterator[Measurement]:
    """Yield the collisions of the audit, or some of them.

    Raises
    ------
    RuntimeError
        If Drake is not there, or a collision has not ended.
    """
    program()
    version = importlib.metadata.version("drake")
    for case in some or audit_cases.all_cases("drake"):
        yield case.measured(version, measured(case, case.parameter))
