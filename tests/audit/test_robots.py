"""MuJoCo, Drake and OpenSim: they do what is predicted, and deliver eps = 0.5 with the number instead."""

import importlib.util
import math
import statistics
from dataclasses import replace

import pytest

from viscopade.audit.program import audited
from viscopade.audit.programs import program_of
from viscopade_lab.programs import (
    audit_cases,
    drake_collisions,
    kratos_collisions,
    mujoco_collisions,
    opensim_collisions,
)

MODULES = {
    "mujoco": ("mujoco", mujoco_collisions),
    "drake": ("pydrake", drake_collisions),
    "simbody": ("opensim", opensim_collisions),
}
WANTED = "0.5"


def runner(program):
    package, module = MODULES[program]
    if importlib.util.find_spec(package) is None:
        pytest.skip(f"there is no Python package {package}")
    return module


def some(program, step):
    cases = (case for case in audit_cases.cases(program) if case.asked == WANTED and case.phase != 0.75)
    return [case for case in cases if case.formula.scheme is None or case.time_step == step]


@pytest.mark.parametrize("program", MODULES)
@pytest.mark.parametrize("step", [0.1, 0.02])
def test_collisions_are_what_is_predicted(program, step):
    module = runner(program)
    for found in module.audit_measurements(some(program, step)):
        assert found.epsilon == pytest.approx(found.predicted, abs=1e-6)


@pytest.mark.parametrize("program", MODULES)
def test_the_number_instead_delivers(program):
    """On average over where in a step of a fiftieth of the contact time the contact begins."""
    module = runner(program)
    for case in [case for case in some(program, 0.02) if "1/(e v)" not in case.formula.name]:
        number = audited(program_of(program), case.formula, WANTED, case.time_step).instead
        phases = (0.5,) if case.formula.scheme is None else [(i + 0.5) / 8 for i in range(8)]
        mean, before = (
            statistics.fmean(module.measured(replace(case, phase=phase), parameter) for phase in phases)
            for parameter in (number, case.parameter)
        )
        assert mean == pytest.approx(0.5, abs=1e-3)
        assert abs(before - 0.5) > 0.01


@pytest.mark.parametrize("approximation", ["similar", "tamsi"])
def test_three_approximations_of_drake_are_one_in_head_on_collisions(approximation):
    module = runner("drake")
    values = (module.rebound(1e-3, approximation=name, dissipation=1.4) for name in ("lagged", approximation))
    assert next(values) == pytest.approx(next(values), abs=1e-6)


@pytest.mark.parametrize("integrator", ["implicit", "implicitfast"])
def test_implicit_integrators_of_mujoco_are_euler_in_contact(integrator):
    module = runner("mujoco")
    solref, step = module.solref("solref = -stiffness -damping", 0.43), 1e-3
    assert module.rebound(solref, step, integrator=integrator) == pytest.approx(module.rebound(solref, step), abs=1e-12)


def test_the_default_solimp_of_mujoco_changes_little():
    """Largest where the penetration is about the width of the impedance, 1 mm; 10 mm is the first here."""
    module = runner("mujoco")
    solref, step = module.solref("solref = -stiffness -damping", 0.43), math.pi / module.FREQUENCY / 500
    flat = module.rebound(solref, step)
    changes = [
        abs(module.rebound(solref, step, speed=speed, solimp="0.9 0.95 0.001 0.5 2") - flat)
        for speed in (1, 0.3, 0.1, 0.01, 0.001)
    ]
    assert 2e-3 < max(changes) < 5e-3
    assert max(changes[0], changes[-1]) < 1e-3


@pytest.mark.parametrize(("condim", "changed"), [(3, False), (4, True), (6, True)])
def test_pyramids_with_torsion_have_another_eps(condim, changed):
    module = runner("mujoco")
    solref = module.solref("solref = -stiffness -damping", 0.43)
    difference = module.rebound(solref, 1e-4) - module.rebound(solref, 1e-4, condim=condim)
    assert (difference > 1e-3) == changed


def test_the_time_constant_of_mujoco_is_two_steps_at_least():
    module = runner("mujoco")
    clipped, honest = (module.rebound(f"{timeconst} 0.3", 0.01) for timeconst in (0.001, 0.02))
    assert clipped == pytest.approx(honest, abs=1e-12)


def test_kratos_does_what_is_predicted():
    """The bisection of the program leaves 1e-4 of the linear law's damping ratio."""
    pytest.importorskip("KratosMultiphysics", reason="there is no Python package KratosMultiphysics")
    pytest.importorskip("KratosMultiphysics.DEMApplication", reason="there is no Python package KratosDEMApplication")
    for found in kratos_collisions.audit_measurements(some("kratos", 0.1)):
        assert found.epsilon == pytest.approx(found.predicted, abs=1e-10 if "Hertz" in found.formula else 1e-4)
