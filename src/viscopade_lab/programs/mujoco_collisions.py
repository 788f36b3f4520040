"""Collisions in MuJoCo for the audit: a sphere flies against a plane, without gravity.

The Python package `mujoco` is needed. `python -m viscopade_lab.programs.audit` runs all collisions.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

from viscopade.audit.measured import Measurement
from viscopade_lab.programs import audit_cases
from viscopade_lab.programs.audit_cases import AuditCase

FREQUENCY = 100.0  # rad/s: of the undamped contact
FLAT = "0.9 0.9 0.001"
"""A `solimp` of which the impedance is constant."""
_MODEL = """
<mujoco>
  <option timestep="{step!r}" gravity="0 0 0" integrator="{integrator}"/>
  <default><geom solref="{solref}" solimp="{solimp}" condim="{condim}"/></default>
  <worldbody>
    <geom type="plane" size="1 1 .1"/>
    <body><freejoint/><geom type="sphere" size="0.1" mass="3"/></body>
  </worldbody>
</mujoco>
"""


program = partial(audit_cases.package, "mujoco", "mujoco")
"""Return the package, or raise RuntimeError if it is not installed."""


def rebound(
    solref: str,
    step: float,
    phase: float = 0.5,
    *,
    speed: float = 1.0,
    integrator: str = "Euler",
    solimp: str = FLAT,
    condim: int = 1,
) -> float:
    """Return eps of a sphere that hits a plane at a speed, after a part `phase` of the first step."""
    mujoco = program()
    options = {"integrator": integrator, "solref": solref, "solimp": solimp, "condim": condim}
    model = mujoco.MjModel.from_xml_string(_MODEL.format(step=step, **options))
    data = mujoco.MjData(model)
    data.qpos[2], data.qvel[2] = 0.1 + phase * step * speed, -speed
    longest = data.time + 60 / FREQUENCY
    while data.qvel[2] <= 0 or data.qpos[2] <= 0.1:
        mujoco.mj_step(model, data)
        if data.time > longest:
            raise RuntimeError("a collision of the audit has not ended in MuJoCo")
    return float(data.qvel[2]) / speed


def solref(name: str, parameter: float) -> str:
    """Return the attribute that a formula of the audit has with its parameter."""
    if name.startswith("solref = timeconst"):
        return f"{1 / (FREQUENCY * parameter)!r} {parameter!r}"
    return f"{-(FREQUENCY**2)!r} {-FREQUENCY * parameter!r}"


def measured(case: AuditCase, parameter: float) -> float:
    """Return the eps of a case's time step and phase with a parameter."""
    name = case.formula.name
    step = case.seconds(1.0, FREQUENCY**2, 1.0)
    integrator = "RK4" if "RK4" in name else "Euler"
    return rebound(solref(name, parameter), step, case.phase, integrator=integrator)


def audit_measurements(some: Sequence[AuditCase] | None = None) -> Iterator[Measurement]:
    """Yield the collisions of the audit, or some of them.

    Raises
    ------
    RuntimeError
        If MuJoCo is not there, or a collision has not ended.
    """
    version = program().__version__
    for case in some or audit_cases.all_cases("mujoco"):
        yield case.measured(version, measured(case, case.parameter))
