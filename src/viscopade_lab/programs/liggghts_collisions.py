"""Two spheres collide in LIGGGHTS with the generated commands, against the eps that they promise.

Run as `python -m viscopade_lab.programs.liggghts_collisions`, or with `--format json`; needs the program `liggghts` (a
Debian package). The laws: `hertz/stiffness`, which is the viscoelastic law, at three speeds; `hertz` with our
`coefficientRestitution`; and with eps itself as `coefficientRestitution`, as one would write it without thinking.
"""

from __future__ import annotations

from viscopade.simulators import liggghts
from viscopade.simulators.setup import Setup
from viscopade.simulators.stated import program_number
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


main = validation(PROGRAM, rows)


if __name__ == "__main__":
    main()
