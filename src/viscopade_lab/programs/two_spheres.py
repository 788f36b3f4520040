"""Two spheres collide in somebody else's program: what its eps is, and how it converges with the time step.

Shared by `viscopade_lab.programs.liggghts_collisions` and `viscopade_lab.programs.yade_collisions`.
"""

from __future__ import annotations

import math
import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import click
from rich.table import Table

from viscopade.collision.spheres import Pair, Sphere
from viscopade.simulators.setup import Contact, Setup
from viscopade_lab.script import command, console

SPEED = 1.0
RADIUS = 0.01
RESTITUTIONS = (0.9, 0.6, 0.3)
# Time steps in the duration of a viscoelastic contact.
STEPS = (100, 400, 1600, 6400)
_REFINEMENT = STEPS[1] // STEPS[0]


@dataclass(frozen=True)
class CollisionRow:
    """Collisions at one speed with decreasing time step.

    Attributes
    ----------
    law : str
        The program's law, and where the parameter is from.
    parameter : str
        Its name and value.
    speed : float
    wanted : float
        The eps that the law should have.
    measured : tuple of float
        The program's, for each of the numbers of steps in `STEPS`.
    """

    law: str
    parameter: str
    speed: float
    wanted: float
    measured: tuple[float, ...]

    @property
    def errors(self) -> tuple[float, ...]:
        """Relative errors of the measured values."""
        return tuple(value / self.wanted - 1 for value in self.measured)

    @property
    def limit(self) -> float:
        """What an error in proportion to the time step extrapolates to, from the last two values."""
        return self.measured[-1] + (self.measured[-1] - self.measured[-2]) / (_REFINEMENT - 1)

    @property
    def order(self) -> float:
        """Order of convergence from the last three values, whatever they converge to."""
        a, b, c = self.measured[-3:]
        return math.log(abs((b - a) / (c - b)), _REFINEMENT) if b not in (a, c) else math.nan


def setup(epsilon: float, speed: float = SPEED) -> Setup:
    """Return two equal balls with the wanted eps at a speed, slower and faster ones by a factor of 10."""
    ball = Sphere(radius=RADIUS, density=2500, young_modulus=1e8, poisson_ratio=0.25, dissipative_constant=0)
    pair = Pair(ball, ball).calibrated(speed, epsilon)
    contact = Contact("ball", "ball", pair, speed / 10, speed, speed * 10)
    return Setup(f"two balls, eps = {epsilon} at {speed} m/s", {"ball": pair.first}, (contact,))


def time_step(case: Setup, speed: float, steps: int) -> float:
    """Return a time step with which a contact at a speed takes so many."""
    return case.contacts[0].pair.contact_time(speed) / steps


def steps_until_apart(case: Setup, speed: float, steps: int) -> int:
    """Return a number of time steps after which the balls have parted, whatever the law."""
    return steps * math.ceil(3 + 2 / case.contacts[0].pair.epsilon(speed))


def integrated(
    force: Callable[[float, float], float], case: Setup, speed: float, end: Literal["force", "position"]
) -> float:
    """Return the eps of a law F(x, x'), the repulsion at a compression and its rate, integrated in time.

    Contact ends where the force vanishes on the way out, or where the compression does. A second route to what a
    program's law should give: Runge-Kutta steps in the compression itself, accurate to about 1e-7.
    """
    from scipy.integrate import solve_ivp  # the runs in other programs do without it

    pair = case.contacts[0].pair
    length, time = pair.length_scale(speed), pair.time_scale(speed)

    def rates(_: float, state: Sequence[float]) -> tuple[float, float]:
        x, u = max(state[0], 0.0), state[1]
        return u, -force(x * length, u * speed) / pair.m_eff * time / speed

    def over(_: float, state: Sequence[float]) -> float:
        x, u = float(state[0]), float(state[1])
        if u >= 0:
            return 1.0  # on the way in
        return x if end == "position" else force(max(x, 0.0) * length, u * speed) / force(length, 0)

    over.terminal, over.direction = True, -1  # type: ignore[attr-defined]
    run = solve_ivp(rates, (0, 1000), (0.0, 1.0), method="DOP853", rtol=1e-10, atol=1e-12, events=over)
    return float(-run.y[1, -1])


def run_program(words: Sequence[str], files: Mapping[str, str]) -> str:
    """Run a program where there are these files, and return what it prints as its last "RESULT".

    Raises
    ------
    RuntimeError
        If it fails.
    """
    with tempfile.TemporaryDirectory() as folder:
        for name, content in files.items():
            Path(folder, name).write_text(content)
        done = subprocess.run(
            words,
            cwd=folder,
            env={**os.environ, "HOME": folder},
            capture_output=True,
            encoding="utf-8",
            errors="replace",  # a program's messages can contain anything
            timeout=3600,
        )
    results = [line for line in done.stdout.splitlines() if line.startswith("RESULT ")]
    if done.returncode or not results:
        raise RuntimeError(f"{words[0]} failed: {(done.stdout + done.stderr)[-500:]}")
    return results[-1].removeprefix("RESULT ")


def validation(program: str, rows: Callable[[], Sequence[CollisionRow]]) -> click.Command:
    """Return the command that runs all collisions in a program, which Debian has a package of."""

    def measure() -> dict[str, Any]:
        if shutil.which(program) is None:
            raise click.ClickException(f"{program} is not installed: it is in Debian's package {program}")
        fields = ("errors", "limit", "order")
        found = [asdict(row) | {name: getattr(row, name) for name in fields} for row in rows()]
        title = f"eps in {program.upper()}, relative error for so many time steps in a contact"
        return {"title": title, "steps": STEPS, "rows": found}

    return command(measure, show)


def show(result: dict[str, Any]) -> None:
    """Print wanted and measured eps."""
    errors = (f"error, {n}" for n in STEPS)
    table = Table("law", "parameter", "speed", "wanted", *errors, "limit", "order", title=result["title"])
    for row in result["rows"]:
        numbers = (*(f"{error:+.1e}" for error in row["errors"]), f"{row['limit']:.6f}", f"{row['order']:.2f}")
        table.add_row(row["law"], row["parameter"], f"{row['speed']:g}", f"{row['wanted']:.6f}", *numbers)
    console(150).print(table)
