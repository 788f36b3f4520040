"""Collisions in Kratos for the audit: two spheres of diameter 1 and mass 2 fly against each other, without gravity.

The Python packages `KratosMultiphysics` and `KratosDEMApplication` are needed, in one folder.
`python -m viscopade_lab.programs.audit` runs all collisions.
"""

from __future__ import annotations

import contextlib
import importlib
import importlib.metadata
import json
import math
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from viscopade.audit.measured import Measurement
from viscopade_lab.programs import audit_cases
from viscopade_lab.programs.audit_cases import AuditCase

YOUNG, MASS, RADIUS = 1e6, 2.0, 0.5
STIFFNESS = {
    "DEM_D_Hertz_viscous_Coulomb": 4 / 3 * YOUNG / 2 * math.sqrt(RADIUS / 2),
    "DEM_D_Linear_viscous_Coulomb": 1.432 * YOUNG / 2 * math.pi * RADIUS / 2 * 0.31225,
}
"""k of k x^a; the second with the numbers of the program."""
_SPHERES = f"""Begin Properties 0
End Properties
Begin Nodes
1 0 0 {{low!r}}
2 0 0 {{high!r}}
End Nodes
Begin Elements SphericParticle3D
1 0 1
2 0 2
End Elements
Begin NodalData RADIUS
1 0 {RADIUS}
2 0 {RADIUS}
End NodalData
Begin NodalData VELOCITY_Z
1 0 0.5
2 0 -0.5
End NodalData
Begin SubModelPart Balls
Begin SubModelPartNodes
1
2
End SubModelPartNodes
Begin SubModelPartElements
1
2
End SubModelPartElements
End SubModelPart
"""


def program() -> Any:
    """Return the package of Kratos.

    Raises
    ------
    RuntimeError
        If it or its application is not installed.
    """
    kratos = audit_cases.package("KratosMultiphysics", "KratosMultiphysics")
    audit_cases.package("KratosMultiphysics.DEMApplication", "KratosDEMApplication")
    kratos.Logger.GetDefaultOutput().SetSeverity(kratos.Logger.Severity.WARNING)
    kratos.ParallelUtilities.SetNumThreads(1)
    return kratos


def _materials(law: str, epsilon: float) -> dict[str, Any]:
    """Return the content of the file of materials."""
    density = MASS / (4 / 3 * math.pi * RADIUS**3)
    bulk = {"PARTICLE_DENSITY": density, "YOUNG_MODULUS": YOUNG, "POISSON_RATIO": 0.0}
    friction = ("STATIC_FRICTION", "DYNAMIC_FRICTION", "FRICTION_DECAY", "ROLLING_FRICTION")
    contact = dict.fromkeys((*friction, "ROLLING_FRICTION_WITH_WALLS"), 0.0)
    named = {"COEFFICIENT_OF_RESTITUTION": epsilon, "DEM_DISCONTINUUM_CONSTITUTIVE_LAW_NAME": law}
    pair = {"material_names_list": ["ball", "ball"], "material_ids_list": [1, 1], "Variables": {**contact, **named}}
    return {
        "materials": [{"material_name": "ball", "material_id": 1, "Variables": bulk}],
        "material_relations": [pair],
        "material_assignation_table": [["SpheresPart.Balls", "ball"]],
    }


def _settings(step: float, number_of_steps: int) -> dict[str, Any]:
    """Return the parameters of a run."""
    end = step * number_of_steps
    return {
        "problem_name": "audit",
        "GravityZ": 0.0,
        "dem_inlet_option": False,
        "RotationOption": False,
        "do_print_results_option": False,
        "MaxTimeStep": step,
        "FinalTime": end,
        "NeighbourSearchFrequency": 1,
        "SearchTolerance": RADIUS / 5,
        **dict.fromkeys(("OutputTimeStep", "GraphExportFreq", "VelTrapGraphExportFreq"), 10 * end),
        "ElementType": "SphericPartDEMElement3D",
        "TranslationalIntegrationScheme": "Symplectic_Euler",
        "solver_settings": {
            "strategy": "sphere_strategy",
            "material_import_settings": {"materials_filename": "MaterialsDEM.json"},
            "RemoveBallsInitiallyTouchingWalls": False,
        },
    }


def rebound(law: str, epsilon: float, step: float, number_of_steps: int, phase: float = 0.5) -> float:
    """Return the eps of a law that is asked for one, at the impact speed 1."""
    kratos = program()
    stages = importlib.import_module("KratosMultiphysics.DEMApplication.DEM_analysis_stage")
    apart = RADIUS + phase * step / 2
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        Path("auditDEM.mdpa").write_text(_SPHERES.format(low=-apart, high=apart))
        Path("MaterialsDEM.json").write_text(json.dumps(_materials(law, epsilon)))
        settings = kratos.Parameters(json.dumps(_settings(step, number_of_steps)))
        stage = stages.DEMAnalysisStage(kratos.Model(), settings)
        stage.Initialize()
        stage.RunSolutionLoop()
        low, high = (stage.spheres_model_part.GetNode(i) for i in (1, 2))
        speed = high.GetSolutionStepValue(kratos.VELOCITY_Z) - low.GetSolutionStepValue(kratos.VELOCITY_Z)
        gap = high.Z - low.Z
        stage.Finalize()
    if gap <= 2 * RADIUS:
        raise RuntimeError("a collision of the audit has not ended in Kratos")
    return float(speed)


def measured(case: AuditCase, parameter: float) -> float:
    """Return the eps of a case's time step and phase with a parameter."""
    law = case.formula.name
    step = case.seconds(1.0, STIFFNESS[law], MASS / 2)
    return rebound(law, parameter, step, case.number_of_steps, case.phase)


def audit_measurements(some: Sequence[AuditCase] | None = None) -> Iterator[Measurement]:
    """Yield the collisions of the audit, or some of them.

    Raises
    ------
    RuntimeError
        If Kratos is not there, or a collision has not ended.
    """
    program()
    version = importlib.metadata.version("KratosDEMApplication")
    for case in some or audit_cases.all_cases("kratos"):
        yield case.measured(version, measured(case, case.parameter))
