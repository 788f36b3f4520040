"""The cases in examples/verification: known numbers by other routes, and each case run in LAMMPS as its tests would."""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.simulators.two_balls import need
from viscopade.collision import exact
from viscopade.theory.law import law_of
from viscopade_lab.runs import simulators

FILES = {path.name: path.read_text() for path in (Path(__file__).parents[2] / "examples" / "verification").iterdir()}
WHOLE = json.loads(FILES["viscoelastic.json"])
CASES, ON_PLANE = ({case["name"]: case for case in WHOLE[key]} for key in ("cases", "on_a_plane"))


def block(text, key):
    """Lines of a block of the YAML file."""
    return re.search(rf"^{key}: \|-?\n((?:  .*\n)+)", text, re.MULTILINE)[1].replace("\n  ", "\n").strip().splitlines()


def value(text, key):
    return re.search(rf"^{key}: (.*)$", text, re.MULTILINE)[1]


def variables(text):
    return dict(line.split(maxsplit=1) for line in block(text, "variables"))


def test_the_files_are_the_cases():
    scripts = {f"in.{name}" for name in ON_PLANE}
    assert set(FILES) == {f"{name}.yaml" for name in CASES} | scripts | {"viscoelastic.json"}
    assert (len(CASES), len(ON_PLANE)) == (12, 6)
    for name, case in CASES.items():
        text = FILES[f"{name}.yaml"]
        assert value(text, "analytic_model") == "collision_restitution"
        assert value(text, "analytic_tol") == case["epsilon"]["tolerance"]
        assert ("limit_damping" in block(text, "pair_coeff")[0]) == (case["end"] == "force")
        assert variables(text)["en"] == case["epsilon"]["value"]


@pytest.mark.parametrize("name", CASES)
def test_the_numbers_by_integration_in_time(name):
    """Newton's equation with the physical numbers of the case."""
    case = CASES[name]
    radii = [diameter / 2 for diameter in case["diameters"]]
    masses = [4 / 3 * math.pi * r**3 * case["density"] for r in radii]
    assert case["masses"] == pytest.approx(masses, rel=1e-14)
    mass, radius = (a * b / (a + b) for a, b in (masses, radii))
    k = 4 / 3 * case["young_modulus"] / (2 * (1 - case["poisson_ratio"] ** 2)) * math.sqrt(radius)
    c = case["eta_n0"] * mass * math.sqrt(radius)
    assert c == pytest.approx(1.5 * case["dissipative_constant"] * k, rel=1e-12)

    def motion(_, y):
        x = max(y[0], 0.0)
        return [y[1], -(k * x**1.5 + c * math.sqrt(x) * y[1]) / mass]

    def end(_, y):
        return k * y[0] + c * y[1] if case["end"] == "force" else y[0]

    end.terminal, end.direction = True, -1
    speed = 2 * case["half_speed"]
    assert speed == pytest.approx(sum(case["speeds"]), rel=1e-14)
    assert np.dot(masses, (case["speeds"][0], -case["speeds"][1])) == pytest.approx(0, abs=1e-16)
    scale = float(case["contact_time"]["value"])
    events = end, lambda _, y: y[1]
    small = speed * scale * 1e-12, speed * 1e-12
    found = solve_ivp(motion, (0, 3 * scale), (0, speed), "DOP853", events=events, rtol=1e-11, atol=small)
    assert -found.y[1, -1] / speed == pytest.approx(float(case["epsilon"]["value"]), rel=1e-7)
    assert found.t[-1] == pytest.approx(scale, rel=1e-7)
    assert found.y_events[1][0][0] == pytest.approx(float(case["peak_overlap"]["value"]), rel=1e-8)


def script(name):
    """The commands of a case in the order of LAMMPS's test driver, with the overlap and the force at every step."""
    text, case = FILES[f"{name}.yaml"], CASES[name]
    settings = variables(text)
    (segments,) = block(text, "run_segments")
    radii = "+".join(repr(diameter / 2) for diameter in case["diameters"])
    return [
        "clear",
        *(f"variable {key} delete" for key in settings),
        *(f"variable {key} index {number}" for key, number in settings.items()),
        *block(text, "pre_commands"),
        f"pair_style {value(text, 'pair_style')}",
        *(f"pair_coeff {line}" for line in block(text, "pair_coeff")),
        *block(text, "post_commands"),
        f"variable overlap equal {radii}-(x[2]-x[1])",
        "variable force equal -fx[1]",
        "thermo 1",
        "thermo_style custom step v_overlap v_force",
        "thermo_modify format float %.12g",
        f'print "case {name}"',
        *(f"run {segment}" for segment in segments.split()),
        "variable rebound equal -(vx[1]-vx[2])/(2*${vin})",
        'print "rebound $(v_rebound:%.15g)"',
    ]


@pytest.fixture(scope="module")
def runs():
    """What LAMMPS prints for each case."""
    need("lammps")
    lines = [line for name in CASES for line in script(name)]
    # The driver's commands know no atoms by their identity; the variables above do.
    text = "\n".join(line.replace("atom_style sphere", "atom_style sphere\natom_modify map array") for line in lines)
    printed = simulators.lammps(text + "\n")
    return dict(re.findall(r"^case (\S+)\n(.*?^rebound \S+)$", printed, re.MULTILINE | re.DOTALL))


@pytest.mark.parametrize("name", CASES)
def test_lammps_delivers_the_numbers(runs, name):
    case, printed = CASES[name], runs[name]
    rebound = float(re.search(r"^rebound (\S+)$", printed, re.MULTILINE)[1])
    rows = re.findall(r"^ *(\d+) +(\S+) +(\S+) *$", printed, re.MULTILINE)
    step, overlap, force = np.array([[float(cell) for cell in row] for row in rows]).T
    touched = np.flatnonzero(overlap > 0)
    over = next(i for i in range(len(step)) if i > touched[0] and (force[i] == 0 or overlap[i] <= 0))
    begin = step[touched[0]] - overlap[touched[0]] / (2 * case["half_speed"] * case["time_step"])
    found = {
        "epsilon": rebound,
        "peak_overlap": overlap.max(),
        "contact_time": (step[over] - begin) * case["time_step"],
    }
    for what, number in found.items():
        expected, tolerance = float(case[what]["value"]), float(case[what]["tolerance"])
        assert abs(number / expected - 1) < tolerance, what


@pytest.mark.parametrize("name", CASES)
def test_the_tolerance_finds_the_other_end_and_another_mass(name):
    """A program with contact that ends elsewhere, or with half of A, as by a wrong effective mass, is found out."""
    case = CASES[name]
    wanted, tolerance = float(case["epsilon"]["value"]), float(case["epsilon"]["tolerance"])
    law = law_of("viscoelastic", case["end"])
    kappa = exact.invert(case["epsilon"]["value"], 12, law=law).mpf()["v_star"] ** law.d
    other = law_of("viscoelastic", "return" if case["end"] == "force" else "force")
    for damping, wrong in ((kappa, other), (kappa / 2, law)):
        found = exact.collision(kappa=damping, law=wrong, digits=12).floats()["epsilon"]
        assert abs(found / wanted - 1) > 10 * tolerance


# --- a sphere and a plane ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ON_PLANE)
def test_a_sphere_on_a_plane_by_integration_in_time(name):
    """Newton's equations with weight and Coulomb's friction, along the plane and for the spin, too."""
    case = ON_PLANE[name]
    radius, mass, g, mu = case["diameter"] / 2, case["mass"], case["gravity"], case["friction"]
    assert mass == pytest.approx(4 / 3 * math.pi * radius**3 * case["density"], rel=1e-14)
    k = 4 / 3 * case["young_modulus"] / (2 * (1 - case["poisson_ratio"] ** 2)) * math.sqrt(radius)
    c = case["eta_n0"] * mass * math.sqrt(radius)

    def force(x, v):
        found = k * max(x, 0) ** 1.5 + c * math.sqrt(max(x, 0)) * v
        return max(found, 0) if case["end"] == "force" else found

    def motion(_, y):  # overlap and its rate, speed along the plane, spin times radius
        normal = force(y[0], y[1])
        return [y[1], g - normal / mass, -mu * normal / mass, 5 / 2 * mu * normal / mass]

    back = lambda _, y: y[0]  # noqa: E731
    back.terminal, back.direction = True, -1
    begin = (0, case["speed"], case["speed_along"], 0)
    longest, step = 5 * float(case["contact_time"]["value"]), case["time_step"] / 4
    found = solve_ivp(motion, (0, longest), begin, "DOP853", events=back, rtol=1e-11, atol=1e-16, max_step=step)
    x, v, along, spin = found.y
    assert not mu or along.min() > spin.max()  # it slides all the time
    expected = {"epsilon": -v[-1] / case["speed"], "peak_overlap": x.max()}
    expected |= {"change_along": case["speed_along"] - along[-1], "surface_spin": spin[-1]}
    for what, number in expected.items():
        assert float(case[what]["value"]) == pytest.approx(number, rel=2e-6), what
    lost = (1 + float(case["epsilon"]["value"])) * case["speed"] * mu
    assert float(case["change_along"]["value"]) == pytest.approx(lost, rel=1e-10)


def test_weight_takes_more_than_the_tolerance():
    for name, case in ON_PLANE.items():
        if case["gravity"]:
            without = float(f"0.{name.split('-')[1][2:]}")
            assert without - float(case["epsilon"]["value"]) > 10 * float(case["epsilon"]["tolerance"])


@pytest.fixture(scope="module")
def falls():
    """What LAMMPS prints for each input."""
    need("lammps")
    return {name: simulators.lammps(FILES[f"in.{name}"]) for name in ON_PLANE}


@pytest.mark.parametrize("name", ON_PLANE)
def test_lammps_delivers_a_sphere_on_a_plane(falls, name):
    case, printed = ON_PLANE[name], falls[name]
    rows = re.findall(r"^ *(\d+) +(\S+) +(\S+) *$", printed, re.MULTILINE)
    step, overlap, force = np.array([[float(cell) for cell in row] for row in rows]).T
    touched = np.flatnonzero(overlap > 0)
    over = next(i for i in range(len(step)) if i > touched[0] and (abs(force[i]) < 1e-12 or overlap[i] <= 0))
    begin = step[touched[0]] - overlap[touched[0]] / (case["speed"] * case["time_step"])
    words = {
        "epsilon": "epsilon",
        "change_along": "change of the speed along the plane",
        "surface_spin": "spin times radius",
    }
    found = {
        what: float(re.search(rf"^{text} (\S+) expected", printed, re.MULTILINE)[1]) for what, text in words.items()
    }
    found |= {"peak_overlap": overlap.max(), "contact_time": (step[over] - begin) * case["time_step"]}
    for what, number in found.items():
        expected, tolerance = float(case[what]["value"]), float(case[what]["tolerance"])
        assert abs(number - expected) <= tolerance * expected, what
