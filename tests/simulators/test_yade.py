"""YADE: the code executed with stand-ins, and collisions in the program if it is there."""

import json
import math
import shutil
from types import SimpleNamespace

import pytest

from tests.simulators.two_balls import GLASS, RUBBER, SETUP, SMALL, run_of, setup, yade_names
from viscopade import Pair
from viscopade.simulators import input_file
from viscopade.simulators.input_file import render
from viscopade_lab.runs.simulators import run_program

COMMAND = "viscopade simulators yade scene.toml"
PRESENT = pytest.mark.skipif(shutil.which("yade") is None, reason="the program yade is not installed")


def test_materials_and_pairs():
    names = yade_names(render("yade", SETUP, COMMAND), vn=False)
    materials = names["O"].materials.all
    assert [m["young"] for m in materials] == [2e9, 5e8, 1e6]
    assert [m["poisson"] for m in materials] == [0.2, 0.3, 0.48]
    assert materials[0]["density"] == pytest.approx(2500)
    assert "density" not in materials[1]
    assert names["materials"] == {"glass": 0, "floor 1": 1, 'rubber "soft"': 2}
    assert set(names["physics"].values) == {"betan"}
    assert set(names["physics"].values["betan"]) == {(0, 0), (2, 1)}
    assert set(yade_names(render("yade", SETUP, COMMAND), vn=True)["physics"].values) == {"en", "vn"}
    shortest = Pair(SMALL, SMALL).contact_time(1.0)
    assert names["O"].dt == pytest.approx(shortest / input_file.STEPS, rel=1e-5)


def test_the_function_that_makes_the_force_viscoelastic():
    """With its betan the damping is A kn, whether both bodies move or one."""
    names = yade_names(render("yade", SETUP, COMMAND), vn=False)

    def body(material, mass, radius=None):
        shape = SimpleNamespace() if radius is None else names["Sphere"](radius)
        return SimpleNamespace(
            material=SimpleNamespace(id=material),
            state=SimpleNamespace(mass=mass),
            shape=shape,
            dynamic=radius is not None,
        )

    names["O"].bodies = [
        body(0, GLASS.mass, 0.01),
        body(0, 2 * GLASS.mass, 0.03),
        body(1, 0.0),
        body(2, RUBBER.mass, 0.02),
    ]
    contacts = [
        SimpleNamespace(id1=a, id2=b, phys=SimpleNamespace(kn=kn, betan=None), geom=SimpleNamespace(refR1=r1, refR2=r2))
        for a, b, kn, r1, r2 in ((0, 1, 3e4, 0.01, 0.03), (2, 3, 5e3, 0.04, 0.02))
    ]
    names["O"].interactions = contacts
    names["viscoelastic"]()
    wanted = (SETUP.contacts[0].pair.A, SETUP.contacts[1].pair.A * 1.5**0.2)  # the facet's R_eff is 2/3 R
    for contact, a, mass in zip(contacts, wanted, (GLASS.mass * 2 / 3, RUBBER.mass), strict=True):
        kn = contact.phys.kn
        assert 2 * math.sqrt(mass * kn) * contact.phys.betan == pytest.approx(a * kn, rel=1e-11)


SCRIPT = """
import json

text = open("contacts.py").read()
case = json.load(open("case.json"))
found = []
for step, run in case["steps"]:
    O.reset()
    exec(text)
    if case["law"] == "constant":
        physics = Ip2_FrictMat_FrictMat_MindlinPhys(betan=matches(betan))
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
print("RESULT", found)
"""


def run(script, text, **files):
    """Return the numbers that a script prints as its result, run beside the generated code."""
    words = ["yade", "-j1", "-x", "-n", "collision.py"]
    printed = run_program(words, {"contacts.py": text, "collision.py": script, **files})
    return json.loads(printed.split("RESULT ")[-1].splitlines()[0])


def collide(case, text, law, speed, steps):
    """Return the program's eps for two balls and generated code, for each number of steps in a contact."""
    runs = [run_of(case, speed, n) for n in steps]
    values = {"law": law, "speed": speed, "radius": case.bodies["ball"].radius, "steps": runs}
    return run(SCRIPT, text, **{"case.json": json.dumps(values)})


@PRESENT
def test_collisions_in_the_program():
    case = setup(0.5)
    (contact,) = case.contacts
    text = render("yade", case, COMMAND)
    for speed in (contact.slowest, contact.fastest):
        exact = contact.pair.epsilon(speed)
        coarse, fine = collide(case, text, "viscoelastic", speed, (400, 1600))
        assert fine == pytest.approx(exact, rel=1e-3)
        assert abs(fine - exact) < abs(coarse - exact) / 3
        assert fine + (fine - coarse) / 3 == pytest.approx(exact, rel=1e-4)


@PRESENT
@pytest.mark.parametrize("epsilon", [0.9, 0.3])
def test_a_constant_eps_in_the_program(epsilon):
    case = setup(epsilon)
    text = render("yade", case, COMMAND)
    for speed in (0.1, 1.0):
        (found,) = collide(case, text, "constant", speed, (3200,))
        assert found == pytest.approx(epsilon, rel=3e-4)


@PRESENT
def test_the_text_runs_as_it_is_and_refuses_pairs_that_are_not_listed():
    text = render("yade", SETUP, COMMAND)
    script = """
exec(open("contacts.py").read())
first = O.bodies.append(sphere((-0.01, 0, 0), 0.01, material=materials["glass"]))
second = O.bodies.append(sphere((0.01, 0, 0), 0.01, material=materials[OTHER]))
O.bodies[first].state.vel = (0.1, 0, 0)
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb()]),
    InteractionLoop([Ig2_Sphere_Sphere_ScGeom()], [physics], [Law2_ScGeom_MindlinPhys_Mindlin()]),
    NewtonIntegrator(damping=0),
]
O.run(3000, True)
print("RESULT", [float(O.bodies[second].state.vel[0] - O.bodies[first].state.vel[0]) / 0.1])
"""
    (eps,) = run(script.replace("OTHER", "'glass'"), text)
    contact = SETUP.contacts[0]
    assert eps == pytest.approx(contact.pair.epsilon(contact.typical), rel=2e-3)
    with pytest.raises(RuntimeError, match="MatchMaker"):
        run(script.replace("OTHER", "'rubber \"soft\"'"), text)


@PRESENT
@pytest.mark.parametrize("law", ["betan", "viscoelastic()"])
def test_walls_and_facets_in_the_program(law):
    text = render("yade", SETUP, COMMAND)
    contact = SETUP.contacts[1]
    script = """
exec(open("contacts.py").read())
found = []
for obstacle in (
    wall(0, axis=2, material=materials["floor 1"]),
    facet([(-1, -1, 0), (1, -1, 0), (0, 2, 0)], material=materials["floor 1"]),
):
    O.bodies.clear()
    O.bodies.append(obstacle)
    ball = O.bodies.append(sphere((0, 0, 0.02), 0.02, material=materials['rubber "soft"']))
    O.bodies[ball].state.vel = (0, 0, -SPEED)
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb(), Bo1_Facet_Aabb()]),
        *([PyRunner(iterPeriod=1, command=LAW)] if "(" in LAW else []),
        InteractionLoop(
            [Ig2_Wall_Sphere_ScGeom(), Ig2_Facet_Sphere_ScGeom()], [physics], [Law2_ScGeom_MindlinPhys_Mindlin()]
        ),
        NewtonIntegrator(damping=0),
    ]
    O.run(40000, True)
    found.append(float(O.bodies[ball].state.vel[2]) / SPEED)
print("RESULT", found)
"""
    # Off the typical speed, where the two laws differ.
    script = script.replace("SPEED", repr(contact.fastest)).replace("LAW", repr(law))
    typical, fastest = (contact.pair.epsilon(speed) for speed in (contact.typical, contact.fastest))
    wanted = typical if law == "betan" else fastest
    assert abs(typical / fastest - 1) > 0.02
    assert run(script, text) == pytest.approx([wanted, wanted], rel=1e-3)
