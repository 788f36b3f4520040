"""Data to fit, without errors, from independent programs: collisions and bounces in LAMMPS and MuJoCo.

Two spheres of diameter `2 RADIUS` collide in LAMMPS at many speeds, with viscoelastic damping, and with another law. A
ball bounces on a plane in LAMMPS, with viscoelastic damping, and in MuJoCo, whose contact has nearly a constant eps.
`viscopade_lab.studies.coverage` adds errors to them. The packages `lammps` and `mujoco` are needed.

`python -m viscopade_lab.runs.fit_data collisions|drop` prints an example's data, with Gaussian errors, as CSV.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import click
import numpy as np

from viscopade.arrays.checked import FloatArray
from viscopade_lab.runs import simulators

# Any ball and contact would do: these have eps from 0.95 to 0.86 at the speeds below.
RADIUS, DENSITY = 0.01, 2500.0  # m, kg/m^3: a marble
MASS = 4 / 3 * math.pi * RADIUS**3 * DENSITY  # kg
STIFFNESS = 5e9
"""K of Hertz' force K sqrt(R_eff) x^(3/2), in Pa: 4/3 E_eff."""
DAMPING = 4e6
"""eta of the force eta m_eff sqrt(R_eff x) x', in 1/(m s)."""
LINEAR = 1e5
"""Stiffness of the linear spring, in N/m; its dashpot has 200/s."""
GRAVITY = 9.81  # m/s^2
SPEEDS = np.geomspace(0.02, 8, 49)  # m/s: beyond all data of the study; 19 to a decade, for splines in ln v
_STEPS = 1500  # in a contact: the error of eps by velocity Verlet, of second order in the step, is below 1e-5
# Steps in a contact; every 40th is printed. In free flight the gap between two lines is known to the parabola, and a
# bounce's instant follows from the last line before contact.
_BOUNCE_STEPS, _EVERY = 600, 40
_HEIGHT = 0.5  # m, from which the ball falls
_BOUNCES, _DURATION = 7, 2.35  # in LAMMPS: that many bounces are used, and end within the duration, s
_MUJOCO_DURATION = 3.2  # s, for MuJoCo's nearly constant eps

_CONTACT = f"hertz {STIFFNESS} {DAMPING} {simulators.FRICTIONLESS} damping viscoelastic limit_damping"


def beta(radius_eff: float, mass_eff: float) -> float:
    """Return beta (the paper's Eq. 8), in (s/m)^(1/5), of LAMMPS's contact with these R_eff (m) and m_eff (kg).

    beta = 3/2 A (rho/m_eff)^(2/5) with 3/2 A rho = eta m_eff sqrt(R_eff) and rho = K sqrt(R_eff).
    """
    rho = STIFFNESS * math.sqrt(radius_eff)
    return float(DAMPING * math.sqrt(radius_eff) * (rho / mass_eff) ** -0.6)


PAIR_BETA = beta(RADIUS / 2, MASS / 2)  # two equal balls: R_eff = R/2, m_eff = m/2
WALL_BETA = beta(RADIUS, MASS)  # a ball and a plane


@dataclass(frozen=True, eq=False)
class Collisions:
    """Collisions of two spheres in a program: speeds in m/s, eps, durations of contact in s."""

    speed: FloatArray
    epsilon: FloatArray
    contact_time: FloatArray

    def interpolated(self, speed: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return eps and the duration at other speeds, by cubic splines of eps and ln(duration) in ln v."""
        from scipy.interpolate import CubicSpline

        both = CubicSpline(np.log(self.speed), np.array([self.epsilon, np.log(self.contact_time)]).T)(np.log(speed)).T
        return both[0], np.exp(both[1])


def collisions(viscoelastic: bool = True) -> Collisions:
    """Return collisions in LAMMPS at `SPEEDS`; without viscoelastic damping, those of a linear spring and dashpot."""
    # A time step for each speed: a part of about the contact time. Undamped: t_c = 2.94 (m_eff/rho)^(2/5) v^(-1/5) or,
    # of the spring, pi sqrt(m_eff/k).
    if viscoelastic:
        law, damping = f"hertz {STIFFNESS!r} {DAMPING!r}", "viscoelastic"
        duration = 3 * ((MASS / 2) / (STIFFNESS * math.sqrt(RADIUS / 2))) ** 0.4 * SPEEDS**-0.2
    else:
        law, damping = f"hooke {LINEAR!r} 200", "mass_velocity"
        duration = np.full_like(SPEEDS, math.pi * math.sqrt(MASS / 2 / LINEAR))
    style = f"{law} {simulators.FRICTIONLESS} damping {damping} limit_damping"
    steps = duration / _STEPS
    # 3 contact times from first contact: damped contacts last longer than undamped ones.
    script = "".join(
        simulators.lammps_spheres(
            style, step=step, run=3 * _STEPS, diameter=2 * RADIUS, mass=MASS, speed=speed, every=1
        )
        for speed, step in zip(SPEEDS.tolist(), steps.tolist(), strict=True)
    )
    # A row for each step: force, and relative velocity over the impact speed, which ends as eps.
    outputs = simulators.lammps(script).split("\ncollision ")[:-1]
    runs = [np.array(simulators.LINE.findall(output), dtype=float) for output in outputs]
    if len(runs) != len(SPEEDS) or any(run[-1, 0] for run in runs):
        raise RuntimeError("collisions have not ended in LAMMPS")
    durations = np.array([np.count_nonzero(run[:, 0]) for run in runs]) * steps
    return Collisions(SPEEDS, np.array([run[-1, 1] for run in runs]), durations)


def _instants(gap: FloatArray, speed: FloatArray, step: float) -> FloatArray:
    """Return the instants at which a body first touches the plane, from its last gap and speed before.

    `gap` (m) and `speed` (m/s, upwards) are given every `step` seconds from time 0.
    """
    begin = np.flatnonzero((gap[:-1] > 0) & (gap[1:] <= 0))
    # The rest of the gap at constant speed; gravity changes it by g step/2, too little to be seen in 0.5 ms.
    return np.asarray(begin * step - gap[begin] / speed[begin])


def lammps_bounces() -> FloatArray:
    """Return the instants (s) at which a ball that falls from 0.5 m touches the plane in LAMMPS, viscoelastic.

    The time step is a part of about the first contact's time, as in `collisions`; sqrt(2 g h) is the impact speed.
    """
    duration = 3 * (MASS / (STIFFNESS * math.sqrt(RADIUS))) ** 0.4 * math.sqrt(2 * GRAVITY * _HEIGHT) ** -0.2
    step = duration / _BOUNCE_STEPS
    ((gap, speed),) = simulators.lammps_falls(
        [(_HEIGHT, 0.0)],
        _CONTACT,
        radius=RADIUS,
        mass=MASS,
        gravity=GRAVITY,
        step=step,
        run=round(_DURATION / step),
        every=_EVERY,
    )
    return _instants(gap, speed, step * _EVERY)[:_BOUNCES]


def mujoco_bounces() -> tuple[FloatArray, float]:
    """Return the instants (s) of bounces in MuJoCo, and the mean duration (s) of their contacts."""
    mujoco = simulators.package("mujoco")
    step = 2e-6  # s: some 150 steps in a contact of 0.3 ms
    # solref = -k -c per mass: k = 1e8/s^2 makes contacts of pi/sqrt(k) = 0.3 ms, short against flights; c = 1250/s is
    # the damping ratio c/(2 sqrt(k)) = 1/16, an eps of about 0.83.
    model, data = simulators.mujoco_model(
        solref="-1e8 -1250", step=step, radius=RADIUS, mass=MASS, gravity=GRAVITY, integrator="implicitfast"
    )
    data.qpos[2] = _HEIGHT + RADIUS
    gap, speed = [], []
    for _ in range(round(_MUJOCO_DURATION / step)):
        mujoco.mj_step(model, data)
        gap.append(float(data.qpos[2]) - RADIUS)
        speed.append(float(data.qvel[2]))
    instants = _instants(np.array(gap), np.array(speed), step)
    return instants, np.count_nonzero(np.array(gap) <= 0) * step / len(instants)


EXAMPLES: Mapping[str, str] = {
    "collisions": "# Two balls collide in LAMMPS at twelve speeds; added: Gaussian errors, 0.01 in eps, 2 % in times.",
    "drop": "# A ball bounces on a plane in LAMMPS: instants of contact, with Gaussian errors of 0.5 ms.",
}


def example(name: str) -> str:
    """Return the CSV file of an example."""
    random = np.random.default_rng(2026)  # any seed: the year makes the file the same in each run
    if name == "drop":
        instants = lammps_bounces()
        # Errors of 0.5 ms, printed to 0.1 ms.
        lines = [f"{1000 * t:.1f}" for t in instants + 5e-4 * random.standard_normal(len(instants))]
        return "\n".join([EXAMPLES[name], "time (ms)", *lines, ""])
    # Twelve speeds from 5 cm/s to 3 m/s, as in the study; errors of 0.01 in eps and of 2 % in contact times, as
    # `EXAMPLES` says, printed with a digit more.
    speed = np.geomspace(0.05, 3, 12)
    epsilon, duration = collisions().interpolated(speed)
    epsilon = epsilon + 0.01 * random.standard_normal(12)
    duration = duration * (1 + 0.02 * random.standard_normal(12))
    rows = zip(speed.tolist(), epsilon.tolist(), duration.tolist(), strict=True)  # printed in cm/s and us
    lines = [f"{100 * v:.4g},{e:.3f},0.01,{1e6 * t:.4g}" for v, e, t in rows]
    return "\n".join([EXAMPLES[name], "speed (cm/s),epsilon,sigma_epsilon,contact_time (us)", *lines, ""])


@click.command()
@click.argument("name", type=click.Choice(list(EXAMPLES)))
def main(name: str) -> None:
    """Print an example's data."""
    click.echo(example(name), nl=False)


if __name__ == "__main__":
    main()
