"""Two spheres collide in LIGGGHTS with the generated commands, against the eps that they promise.

Run as `python -m viscopade_lab.programs.liggghts_collisions`, or with `--format json`; needs the program `liggghts` (a
Debian package). The laws: `hertz/stiffness`, which is the viscoelastic law, at three speeds; `hertz` with our
`coefficientRestitution`; and with eps itself as `coefficientRestitution`, as one would write it without thinking.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from collections.abc import Iterator, Sequence

from viscopade.audit.measured import Measurement
from viscopade.simulators import liggghts
from viscopade.simulators.setup import Setup
from viscopade.simulators.stated import program_number
from viscopade_lab.programs import audit_cases
from viscopade_lab.programs.audit_cases import AuditCase
from viscopade_lab.programs.two_spheres import (
    RADIUS,
    RESTITUTIONS,
    SPEED,
    STEPS,
    CollisionRow,
    run_program,
    setup,
    steps_until_apart,
    time_step,
    validation,
)

PROGRAM = "liggghts"
COMMAND = "viscopade_lab.programs.liggghts_collisions"
_INPUT = """
atom_style granular
atom_modify map array
boundary f f f
newton off
communicate single vel yes
units si
region box block {low} {high} {low} {high} {low} {high} units box
create_box 1 box
neighbor {radius} bin
neigh_modify delay 0
include contacts.in
create_atoms 1 single -{radius} 0 0
create_atoms 1 single {radius} 0 0
set group all diameter {diameter} mass {mass}
set atom 1 vx {forwards}
set atom 2 vx {backwards}
fix move all nve/sphere
timestep {step}
thermo {run}
run {run}
variable difference equal vx[2]-vx[1]
print "RESULT ${{difference}}"
"""


def collide(case: Setup, text: str, speed: float, steps: int) -> float:
    """Return the program's eps for two balls and generated commands."""
    ball = case.bodies["ball"]
    commands = _INPUT.format(
        low=-10 * RADIUS,
        high=10 * RADIUS,
        radius=repr(ball.radius),
        diameter=repr(2 * ball.radius),
        mass=repr(ball.mass),
        forwards=repr(speed / 2),
        backwards=repr(-speed / 2),
        step=repr(time_step(case, speed, steps)),
        run=steps_until_apart(case, speed, steps),
    )
    return run(commands, text) / speed


def run(commands: str, text: str) -> float:
    """Return what an input that includes `contacts.in`, the generated commands, prints as its result."""
    words = [PROGRAM, "-in", "in.collision", "-log", "none"]
    return float(run_program(words, {"contacts.in": text, "in.collision": commands}).split()[0])


def row(case: Setup, law: str, parameter: str, text: str, speed: float, wanted: float) -> CollisionRow:
    """Return a row of collisions at one speed."""
    return CollisionRow(law, parameter, speed, wanted, tuple(collide(case, text, speed, steps) for steps in STEPS))


def rows() -> list[CollisionRow]:
    """Return all rows."""
    found = []
    for epsilon in RESTITUTIONS:
        case = setup(epsilon)
        (contact,) = case.contacts
        text = liggghts.render(case, COMMAND)
        gamman = f"gamman {liggghts.stiffness(contact.pair).gamman:.6g}"
        for speed in (contact.slowest, contact.typical, contact.fastest):
            found.append(row(case, "hertz/stiffness", gamman, text, speed, contact.pair.epsilon(speed)))
    for epsilon in RESTITUTIONS:
        case = setup(epsilon)
        (contact,) = case.contacts
        limited = liggghts.limits_force(case.contacts)
        text = liggghts.render(case, COMMAND, "hertz")
        coefficient = liggghts.hertz_restitution(contact, limited).coefficient
        law = f"hertz, limitForce {'on' if limited else 'off'}"
        found.append(row(case, law, f"ours {coefficient:.6f}", text, SPEED, epsilon))
        naive = text.replace(f"\n    {program_number(coefficient)}\n", f"\n    {program_number(epsilon)}\n")
        naive = naive.replace("limitForce off", "limitForce on")
        found.append(row(case, "hertz, limitForce on", f"naive {epsilon:.6f}", naive, SPEED, epsilon))
    return found


# --- for the audit ---------------------------------------------------------------------------------------------------

_YOUNG, _CHARACTERISTIC = 1e8, 2.0
_AUDIT = """
clear
atom_style granular
atom_modify map array
boundary f f f
newton off
communicate single vel yes
units si
region box block -5 5 -5 5 -5 5 units box
create_box 1 box
neighbor 1 bin
neigh_modify delay 0
fix young all property/global youngsModulus peratomtype {young}
fix poisson all property/global poissonsRatio peratomtype 0
fix restitution all property/global coefficientRestitution peratomtypepair 1 {number}
fix speed all property/global characteristicVelocity scalar {characteristic}
fix kn all property/global kn peratomtypepair 1 {young}
fix kt all property/global kt peratomtypepair 1 0
fix gamman all property/global gamman peratomtypepair 1 {number}
fix gammat all property/global gammat peratomtypepair 1 0
pair_style gran model {model} tangential off limitForce {limit}
pair_coeff * *
create_atoms 1 single 0 0 {first}
create_atoms 1 single 0 0 {second}
set group all diameter 1 mass 2
set atom 1 vz 0.5
set atom 2 vz -0.5
fix move all nve/sphere
timestep {step}
thermo {run}
run {run}
variable rebound equal vz[2]-vz[1]
variable gap equal z[2]-z[1]-1
print "RESULT ${{rebound}} ${{gap}}"
"""


def audit_measurements(some: Sequence[AuditCase] | None = None) -> Iterator[Measurement]:
    """Yield the collisions of the audit, or some of them: two spheres of diameter 1 and mass 2 at the speed 1.

    Raises
    ------
    RuntimeError
        If LIGGGHTS is not there, or a collision has not ended.
    """
    if shutil.which(PROGRAM) is None:
        raise RuntimeError("there is no program liggghts: it is in Debian's package liggghts")
    release = version()
    for case in some or audit_cases.all_cases(PROGRAM):
        words = [PROGRAM, "-in", "in.collision", "-log", "none"]
        rebound, gap = map(float, run_program(words, {"in.collision": _audit_script(case)}).split())
        if gap <= 0:
            raise RuntimeError("a collision of the audit has not ended in LIGGGHTS")
        yield case.measured(release, rebound)


def version() -> str:
    """Return what the program says of itself."""
    words = [PROGRAM, "-log", "none", "-h"]
    with tempfile.TemporaryDirectory() as folder:  # where it writes a log all the same
        done = subprocess.run(words, cwd=folder, capture_output=True, text=True, timeout=60, check=False)
    found = re.search(r"Version (\S+ \S+),", done.stdout)
    return "unknown" if found is None else found[1]


def _audit_script(case: AuditCase) -> str:
    """Return the commands of one collision; R_eff is 1/4, m_eff 1, the impact speed 1, and E_eff half of _YOUNG."""
    model, *limited = case.formula.name.split(", ")
    k = {
        "hertz": 4 / 3 * _YOUNG / 2 * 0.5,
        "hertz/stiffness": _YOUNG * 0.5,
        "hooke": 16 / 15 * 0.5 * _YOUNG / 2 * (15 * _CHARACTERISTIC**2 / (16 * 0.5 * _YOUNG / 2)) ** 0.2,
    }[model]
    step = case.seconds(1, k, 1)
    apart = 0.5 + case.phase * step / 2
    number = case.parameter * k**0.6 / 0.5 if model == "hertz/stiffness" else case.parameter
    return _AUDIT.format(
        model=model,
        limit="on" if limited else "off",
        young=_YOUNG,
        characteristic=_CHARACTERISTIC,
        number=repr(number),
        first=-apart,
        second=apart,
        step=repr(step),
        run=case.number_of_steps,
    )


main = validation(PROGRAM, rows)


if __name__ == "__main__":
    main()
