"""Two spheres collide in YADE with the generated code, against the eps that it promises.

Run as `python -m viscopade_lab.programs.yade_collisions`, or with `--format json`; needs the program `yade` (a Debian
package). The laws: the viscoelastic one, as the program's own where it has `vn` and by the generated function where it
has not, at three speeds; a constant eps with our `betan`; and with eps itself as `en`, as the program's manual says.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Literal

from viscopade.simulators import yade
from viscopade.simulators.setup import Setup
from viscopade_lab.programs.two_spheres import (
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

PROGRAM = "yade"
COMMAND = "viscopade_lab.programs.yade_collisions"
Law = Literal["viscoelastic", "constant", "naive"]
_SCRIPT = """
import json

text = open("contacts.py").read()
case = json.load(open("case.json"))
found = []
for step, run in case["steps"]:
    O.reset()
    exec(text)
    if case["law"] != "viscoelastic":
        values = {{"betan": matches(betan)}} if case["law"] == "constant" else {{"en": matches(case_en)}}
        physics = Ip2_FrictMat_FrictMat_MindlinPhys(**values)
    runner = [PyRunner(iterPeriod=1, command="viscoelastic()")] if case["law"] == "viscoelastic" else []
    native = "vn" in Ip2_FrictMat_FrictMat_MindlinPhys().dict()
    balls = [
        O.bodies.append(sphere((sign * case["radius"], 0, 0), case["radius"], material=materials["ball"]))
        for sign in (-1, 1)
    ]
    for ball, sign in zip(balls, (1, -1)):
        O.bodies[ball].state.vel = (sign * case["speed"] / 2, 0, 0)
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb()]),
        *([] if native else runner),
        InteractionLoop([Ig2_Sphere_Sphere_ScGeom()], [physics], [Law2_ScGeom_MindlinPhys_Mindlin()]),
        NewtonIntegrator(damping=0),
    ]
    O.dt = step
    O.run(run, True)
    first, second = (O.bodies[ball].state.vel[0] for ball in balls)
    found.append(float(second - first) / case["speed"])
print("RESULT " + json.dumps(found))
"""


def collide(case: Setup, text: str, law: Law, speed: float, steps: Sequence[int]) -> tuple[float, ...]:
    """Return the program's eps for two balls and generated code, for each number of steps in a contact."""
    values = {
        "law": law,
        "speed": speed,
        "radius": case.bodies["ball"].radius,
        "steps": [(time_step(case, speed, n), steps_until_apart(case, speed, n)) for n in steps],
    }
    epsilon = case.contacts[0].pair.epsilon(case.contacts[0].typical)
    script = _SCRIPT.format().replace("case_en", f'{{("ball", "ball"): {epsilon!r}}}')
    return run(script, {"contacts.py": text, "case.json": json.dumps(values)})


def run(script: str, files: Mapping[str, str]) -> tuple[float, ...]:
    """Return the numbers that a script prints as its result, run where there are these files."""
    words = [PROGRAM, "-j1", "-x", "-n", "collision.py"]
    return tuple(json.loads(run_program(words, {**files, "collision.py": script})))


def rows() -> list[CollisionRow]:
    """Return all rows."""
    found = []
    for epsilon in RESTITUTIONS:
        case = setup(epsilon)
        (contact,) = case.contacts
        text = yade.render(case, COMMAND)
        for speed in (contact.slowest, contact.typical, contact.fastest):
            measured = collide(case, text, "viscoelastic", speed, STEPS)
            wanted = contact.pair.epsilon(speed)
            found.append(CollisionRow("viscoelastic", f"A {contact.pair.A:.6g}", speed, wanted, measured))
    for epsilon in RESTITUTIONS:
        case = setup(epsilon)
        text = yade.render(case, COMMAND)
        betan = f"betan {yade.betan(epsilon):.6f}"
        found.append(CollisionRow("constant", betan, SPEED, epsilon, collide(case, text, "constant", SPEED, STEPS)))
        naive = collide(case, text, "naive", SPEED, STEPS)
        found.append(CollisionRow("constant", f"naive en {epsilon:g}", SPEED, epsilon, naive))
    return found


main = validation(PROGRAM, rows)


if __name__ == "__main__":
    main()
