"""The page's computations, run by node, against the package: two routes for every number and sentence."""

import json
import math
import random
import re
import shutil
import subprocess

import numpy as np
import pytest

import viscopade as vp
from tests.cli import called
from tests.daily import chosen
from tests.patience import HANGS
from tools import calculator_tables
from viscopade import quantity
from viscopade.calculator import page, tables
from viscopade.collision import adhesion, exact, limits, weight
from viscopade.collision.contact import Contact
from viscopade.simulators import TARGETS

SYSTEM = "SI (m, kg, s)"
GLASS = {"radius": 0.01, "density": 2500.0, "young": 7e10, "poisson": 0.22}
INPUT = {
    "law": "viscoelastic", "end": "force", "speed": 1.0, "by": "epsilon", "damping": 0.9, "at": 1.0,
    "bodies": [GLASS, GLASS], "strength": None, "second": None, "system": SYSTEM,
}  # fmt: skip
LAWS = [pytest.param(name, law, id=tables.key(law).replace(" ", "-")) for name, law in tables.laws()]


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Return a function that applies an expression in JavaScript, of the argument `x`, to values."""
    node = shutil.which("node")
    if node is None:
        pytest.skip("node is not installed")
    folder = tmp_path_factory.mktemp("calculator")
    (folder / "functions.mjs").write_text(page.functions(), "utf-8")

    def apply(expression, values):
        code = f"""
import * as page from "./functions.mjs";
import {{ readFileSync }} from "node:fs";
const {{ calculate, FACTS }} = page;
const revived = (key, value) => (value === "Infinity" ? Infinity : value === "NaN" ? NaN : value);
const found = JSON.parse(readFileSync("values.json", "utf8"), revived).map((x) => {{
  try {{
    return {expression};
  }} catch (error) {{
    if (error.field === undefined) throw error;
    return {{ refused: error.message }};
  }}
}});
console.log(JSON.stringify(found));
"""
        (folder / "values.json").write_text(json.dumps(values), "utf-8")
        (folder / "main.mjs").write_text(code, "utf-8")
        done = subprocess.run([node, "main.mjs"], cwd=folder, capture_output=True, text=True, timeout=HANGS)
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    return apply


def of(**changes):
    return INPUT | changes


def log_uniform(low, high, number, seed):
    generator = random.Random(seed)
    return [math.exp(generator.uniform(math.log(low), math.log(high))) for _ in range(number)]


# --- eps ----------------------------------------------------------------------------------------------------------


def test_epsilon_is_within_the_stated_bound(run):
    speeds, betas = log_uniform(1e-9, 1e9, 1000, 1), log_uniform(1e-6, 1e3, 1000, 2)
    inputs = [of(by="beta", damping=b, speed=v, bodies=None) for v, b in zip(speeds, betas, strict=True)]
    v_star = np.sqrt(betas) * np.array(speeds) ** 0.1
    eps, loss = vp.epsilon(v_star), vp.one_minus_epsilon(v_star)
    found = run("calculate(x)", inputs)
    both = float(page._facts()["kernels"][-1]["bound"])
    own = 2e-14  # of vp.epsilon at a v* that is rounded
    limit = (both + own) * np.minimum(eps, loss)
    assert (abs([each["epsilon"] for each in found] - eps) <= limit + 1e-15 * eps).all()
    assert (abs([each["loss"] for each in found] - loss) <= limit + 1e-15 * loss).all()


@pytest.mark.parametrize(("name", "law"), LAWS)
def test_laws_against_exact_collisions(run, name, law):
    table = tables.stored_tables()[tables.key(law)]
    largest = min(table["largest_of_course"] or 1e4, 1e4)
    kappas = [1e-9, *log_uniform(1e-4, largest * 0.999, 5, name), largest * 0.999]
    text = "page.restitutionOf(FACTS.laws.find(({ name }) => name === x[0]), x[1], x[2], true)"
    eps = run(text, [(name, law.end, kappa) for kappa in kappas])
    course = run(
        "calculate(x).scaled",
        [of(law=name, end=law.end, by="kappa", damping=math.sqrt(k) if name == "viscoelastic" else k) for k in kappas],
    )
    for kappa, of_eps, of_course in zip(kappas, eps, course, strict=True):
        true = exact.collision(kappa=repr(kappa), law=law, digits=17).floats()
        # The square root above costs a digit, and near the end of an attractive contact kappa matters much.
        assert of_course["compression"] == pytest.approx(true["x_max"], rel=tables.ERROR)
        assert of_course["duration"] == pytest.approx(true["tau_c"], rel=tables.ERROR)
        assert of_eps["epsilon"] == pytest.approx(true["epsilon"], rel=tables.ERROR)
        assert of_eps["loss"] == pytest.approx(true["one_minus_epsilon"], rel=tables.ERROR)


def test_todays_table_is_made_again():
    _, law = chosen(list(tables.laws()))
    made, stored = calculator_tables.made(law), tables.stored_tables()[tables.key(law)]
    assert made.keys() == stored.keys()
    assert made["ends"] == pytest.approx(stored["ends"], rel=1e-12)
    for new, old in zip(made["coefficients"], stored["coefficients"], strict=True):
        for one, other in zip(new, old, strict=True):
            size = max(len(one), len(other))
            padded = [np.pad(row, (0, size - len(row))) for row in (one, other)]
            assert abs(padded[0] - padded[1]).sum() < 2e-12
    for key in ("slopes", "largest", "largest_of_course", "decay"):
        assert made[key] == (stored[key] if stored[key] is None else pytest.approx(stored[key], rel=1e-9))


@pytest.mark.parametrize(("name", "law"), LAWS)
def test_inverse_round_trips(run, name, law):
    wanted = [0.9999999, 0.5, 0.002]
    inputs = [of(law=name, end=law.end, damping=e, speed=2.0, at=2.0) for e in wanted]
    for eps, answer in zip(wanted, run("calculate(x)", inputs), strict=True):
        true = exact.collision(kappa=repr(answer["kappa"]), law=law, digits=17).floats()
        assert true["one_minus_epsilon"] == pytest.approx(1 - eps, rel=1e-9)
        assert true["epsilon"] == pytest.approx(eps, rel=1e-9)


def test_curves_have_the_same_eps_at_the_speed_and_those_of_the_package_elsewhere(run):
    speeds = [0.001, 0.1, 1.0, 7.0]
    curves = [{"kind": "law", "name": name} for name in ("linear", "viscoelastic")]
    curves += [{"kind": "pade", "name": name} for name in ("[0/3]", "[1/4]", "[2/5]", "[3/6]", "[5/8]")]
    curves += [{"kind": "kernel", "name": each["name"]} for each in page._facts()["kernels"]] + [{"kind": "reference"}]
    text = "page.curveAt(x[0], calculate(x[1]), x[1], x[2])"
    found = run(text, [(curve, of(damping=0.4), speeds) for curve in curves])
    beta = vp.beta_from_restitution(1.0, 0.4)
    v_star = np.sqrt(beta) * np.array(speeds) ** 0.1
    true = vp.epsilon(v_star)
    assert found[0] == pytest.approx([0.4] * 4, rel=1e-10)
    assert found[1] == pytest.approx(true, rel=1e-10)
    assert found[-1] == pytest.approx(true, rel=1e-10)
    for curve, values in zip(curves, found, strict=True):
        if curve["kind"] == "pade":
            m, n = map(int, curve["name"].strip("[]").split("/"))
            assert values == pytest.approx(vp.pade(m, n)(v_star), rel=1e-10)
    for each, values in zip(page._facts()["kernels"], found[7:], strict=False):
        assert (abs(values - true) <= 1.0001 * float(each["bound"]) * np.minimum(true, 1 - true)).all()


# --- bodies -------------------------------------------------------------------------------------------------------


def some_pairs(number, seed):
    """Yield inputs of the page with bodies and their A, and the `Pair`."""
    generator = random.Random(seed)

    def log(low, high):
        return math.exp(generator.uniform(math.log(low), math.log(high)))

    for _ in range(number):
        kind = generator.choice(("same", "size", "wall", "sphere", "otherwall"))
        bodies, constants = [], []
        for _ in range(2):
            body = {"radius": log(1e-4, 1), "density": log(100, 1e4), "young": log(1e6, 1e12)}
            bodies.append(body | {"poisson": generator.uniform(-0.5, 0.5)})
            constants.append(log(1e-9, 1e-3))
        first, second = bodies
        if kind in ("same", "size", "wall"):
            second, constants[1] = {**first, "radius": second["radius"] if kind == "size" else first["radius"]}, None
        own = [constants[0], constants[0] if constants[1] is None else constants[1]]
        spheres = [
            {"young_modulus": body["young"], "poisson_ratio": body["poisson"], "dissipative_constant": a}
            for body, a in zip((first, second), own, strict=True)
        ]
        wall = kind in ("wall", "otherwall")
        one = vp.Sphere(radius=first["radius"], density=first["density"], **spheres[0])
        two = (
            vp.Sphere.wall(**spheres[1])
            if wall
            else vp.Sphere(radius=second["radius"], density=second["density"], **spheres[1])
        )
        if wall:
            second = second | {"radius": "Infinity", "density": "NaN"}
        bodies = {"bodies": [first, second], "by": "A", "damping": constants[0], "second": constants[1]}
        speed, strength = log(1e-4, 1e3), generator.choice((None, log(1e5, 1e10)))
        yield of(**bodies, speed=speed, strength=strength), vp.Pair(one, two)


def test_bodies_and_warnings(run):
    cases = list(some_pairs(300, 5))
    found = run("calculate(x)", [given for given, _ in cases])
    said = set()
    for (given, pair), answer in zip(cases, found, strict=True):
        speed = given["speed"]
        for key, value in (
            ("beta", pair.beta),
            ("A", pair.A),
            ("contactTime", pair.contact_time(speed)),
            ("compression", pair.max_compression(speed)),
            ("overlap", limits.overlap(pair, speed)),
        ):
            assert answer[key] == pytest.approx(value, rel=2 * tables.ERROR), key
        warnings = list(limits.violations(pair, speed, yield_strength=given["strength"]))
        assert answer["warnings"] == warnings
        said |= {name for name, text in limits.SENTENCES.items() for w in warnings if text.split("}")[-1] in w}
    assert said == {*limits.SENTENCES}


@pytest.mark.parametrize(("name", "law"), LAWS)
def test_weight(run, name, law):
    """eps with a load, as the page integrates it, against the collision of the package; 0 where bodies stay down."""
    kappa = float(exact.invert("0.6", law=law, digits=12).mpf()["v_star"] ** law.d)
    loads = [0.0, 1e-3, 0.05, 0.2, 0.35, 1.0, 5.0]
    text = "page.withLoad(FACTS.laws.find(({ name }) => name === x[0]), x[1], x[2], x[3])"
    found = run(text, [(name, law.end, kappa, load) for load in loads])
    true = [Contact.of_law(law, kappa, load).collide().epsilon for load in loads]
    assert found == pytest.approx(true, abs=1e-7)
    assert true[-1] == 0


def test_a_sphere_that_falls(run):
    given = of(speed=0.05, at=0.05, damping=0.7, bodies=[GLASS | {"young": 1e7}] * 2, gravity=9.81)
    assert "fall" not in run("calculate(x)", [given])[0]
    wall = given["bodies"][0] | {"radius": "Infinity", "density": "NaN"}
    (found,) = run("calculate(x)", [given | {"bodies": [given["bodies"][0], wall]}])
    material = {"young_modulus": 1e7, "poisson_ratio": 0.22, "dissipative_constant": found["A"]}
    pair = vp.Pair(vp.Sphere(radius=0.01, density=2500, **material), vp.Sphere.wall(**material))
    body = weight.falling(pair, 0.05, 9.81)
    assert found["fall"]["epsilon"] == pytest.approx(pair.epsilon(0.05, gravity=9.81), abs=1e-7)
    assert found["epsilon"] == pytest.approx(0.7, rel=1e-7)
    assert found["fall"]["share"] == pytest.approx(body.share(0.05), rel=1e-9)
    assert found["fall"]["sticking"] == pytest.approx(body.sticking_speed, rel=1e-3)


@pytest.mark.parametrize(("name", "law"), LAWS)
def test_a_drop_with_a_contact_time(run, name, law):
    """eps with the weight is sqrt(h/H), by the package's collision of the same kappa, load and contact time."""
    speed, time = (2 * 9.81 * 0.3) ** 0.5, 0.02
    given = of(law=name, end=law.end, by="drop", damping=0.1, height=0.3, speed=speed, gravity=9.81, bodies=None)
    (found,) = run("calculate(x)", [given | {"contactTime": time}])
    kappa = found["kappa"]
    unit = time / exact.collision(kappa=repr(kappa), law=law, digits=17).floats()["tau_c"]
    assert Contact.of_law(law, kappa, 9.81 * unit / speed).collide().epsilon == pytest.approx(3**-0.5, abs=1e-6)
    assert found["fall"]["epsilon"] == pytest.approx(3**-0.5, abs=1e-7)
    assert found["contactTime"] == pytest.approx(time)


@pytest.mark.parametrize(
    ("speed", "gravity"), [(0.08, 0.0), (0.3, 0.0), (3.0, 0.0), (0.05, 0.0), (0.08, 500.0), (50, 9.81)]
)
def test_spheres_that_adhere(run, speed, gravity):
    """The page integrates in z = (a/a_0)^(1/2), the package in the compression."""
    sphere = {"radius": 1e-4, "density": 2500.0, "young": 5e7, "poisson": 0.3}
    bodies = [sphere, sphere | {"radius": "Infinity", "density": "NaN"}]
    given = of(speed=speed, by="A", damping=1e-6, bodies=bodies, gravity=gravity or None, adhesion=0.07)
    found, alone, other = run(
        "calculate(x)", [given, given | {"adhesion": None}, given | {"law": "linear", "by": "kappa"}]
    )
    material = {"young_modulus": 5e7, "poisson_ratio": 0.3, "dissipative_constant": 1e-6}
    pair = vp.Pair(vp.Sphere(radius=1e-4, density=2500, **material), vp.Sphere.wall(**material))
    contact = adhesion.adhesive(pair, 0.07, gravity)
    assert found["adhesion"]["epsilon"] == pytest.approx(contact.collide(speed).epsilon, abs=1e-7)
    assert found["adhesion"]["sticking"] == pytest.approx(adhesion.sticking(lambda _: contact, speed).speed, rel=1e-3)
    assert "adhesion" not in alone
    assert "adhesion" not in other
    curve = 'page.curveAt({ kind: "adhesion" }, calculate(x), x, [0.01, 1])'
    assert run(curve, [given])[0] == pytest.approx([0, contact.collide(1.0).epsilon], abs=1e-7)


# --- text ---------------------------------------------------------------------------------------------------------


def test_numbers_are_written_as_python_writes_them(run):
    generator = random.Random(7)
    numbers = [0.0, 1.0, 10.0, 1e-5, 123456.0, 999999.5, 0.0001, 99.95, -2.5]
    numbers += [generator.choice((-1, 1)) * 10 ** generator.uniform(-30, 30) for _ in range(500)]
    cases = [(x, digits) for x in numbers for digits in (1, 2, 3, 7, 15)]
    for (x, digits), text in zip(cases, run("page.general(x[0], x[1])", cases), strict=True):
        # JavaScript rounds halves of decimals away from zero, Python to even.
        assert text == f"{x:.{digits}g}" or float(text) == pytest.approx(x, rel=0.51 * 10 ** (1 - digits))


def test_units_are_those_of_the_command_line(run):
    texts = [
        ("2.5 mm", "length"), ("70GPa", "pressure"), ("1e-3 cm/s", "speed"), (".5 g/cm^3", "density"), ("3. s", "time"),
        ("2.5 g/cm3", "density"), ("2500 kg/m³", "density"), ("9 lb / ft**3", "density"), ("7e10 N/m^2", "pressure"),
        ("7 kg m^-1 s^-2", "pressure"), ("3 µm", "length"), ("3 μm", "length"), ("70 mJ/m²", "energy per area"),
        ("5 erg/cm2", "energy per area"), ("5 km/h", "speed"), ("981 cm/s^2", "acceleration"), ("2 in", "length"),
    ]  # fmt: skip
    sizes = {(1, 0, 0): "m", (0, 1, 0): "kg", (0, 0, 1): "s", (1, 1, -2): "N", (-1, 1, -2): "Pa", (2, 1, -2): "J"}
    for powers, units in page._UNITS.items():
        assert all(quantity.decimal_in(f"1 {unit}", sizes[powers]) is not None for unit in units)
    found = run(f"page.parseQuantity('f', 'f', x[0], x[1], {SYSTEM!r})", texts)
    for (text, dimension), value in zip(texts, found, strict=True):
        assert value == pytest.approx(float(quantity.si_decimal(text, dimension)), rel=1e-15)
    written = ["7*10^10", "7 × 10^10 Pa", "7,0e10", "7·10**10"]
    assert run(f"page.parseQuantity('f', 'f', x, 'pressure', {SYSTEM!r})", written) == pytest.approx([7e10] * 4)
    assert run(f"page.parseQuantity('f', 'f', x, '', {SYSTEM!r})", ["70 %", "−0,2"]) == pytest.approx([0.7, -0.2])
    betas = ["1.307 (s/cm)^(1/5)", "1.307", "2 (us/um)^(1/5)"]
    found = run(f"page.parseQuantity('f', 'f', x, 'beta', {SYSTEM!r})", betas)
    assert found == pytest.approx([1.307 * 100**0.2, 1.307, 2.0], rel=1e-14)


@pytest.mark.parametrize(
    ("text", "dimension", "refusal"),
    [
        ("1,250", "length", 'f is "1,250", which has two meanings: expected 1.250 or 1250'),
        ("1.000,5", "length", 'f is "1.000,5": expected a number, in m unless it has a unit'),
        ("sqrt(0.7)", "", 'f is "sqrt(0.7)": expected a number'),
        ("0.7/1", "", 'f is "0.7/1": expected a number'),
        ("70 cm", "", 'f has the unit "cm": expected none, or %'),
        ("70 %", "length", 'f has the unit "%": expected a unit such as m or mm'),
        ("5 kg/m", "density", 'f has the unit "kg/m": expected a unit such as kg/m^3 or g/cm^3'),
        ("5 constructor", "time", 'f has the unit "constructor": expected a unit such as s or us'),
        ("5 s/m", "beta", 'f has the unit "s/m": expected a unit such as (s/m)^(1/5)'),
    ],
)
def test_other_texts_are_refused_in_a_line(run, text, dimension, refusal):
    assert run(f"page.parseQuantity('f', 'f', x, {dimension!r}, {SYSTEM!r})", [text]) == [{"refused": refusal}]


@pytest.mark.parametrize(
    "changes",
    [
        {"by": "kappa", "damping": 3.0, "law": "linear", "end": "return"},
        {"by": "beta", "damping": 1e300},
    ],
)
def test_what_has_no_answer_is_refused_in_a_line(run, changes):
    (found,) = run("calculate(x)", [of(**changes)])
    assert set(found) == {"refused"}
    assert "expected" in found["refused"]
    assert "NaN" not in found["refused"]


# --- for programs ----------------------------------------------------------------------------------------------------

ALSO = {"wall": [GLASS, GLASS | {"radius": "Infinity", "density": "NaN"}], "size": [GLASS, GLASS | {"radius": 0.03}]}


@pytest.mark.parametrize("kind", ["same", "wall", "size"])
def test_lines_for_simulators_have_the_numbers_of_their_files(run, kind):
    given = of(damping=0.6, bodies=ALSO.get(kind, [GLASS, GLASS]))
    programs = [each["name"] for each in page._facts()["programs"]]
    found = run("page.linesOf(x[0], calculate(x[1]), x[1])", [(name, given) for name in programs])
    lines = 0
    for name, answer in zip(programs, found, strict=True):
        if kind == "wall" and name.startswith("rebound"):
            assert answer["command"] is None
            continue
        done = called(*answer["command"].split()[1:])
        assert done.returncode == 0, done.stderr
        if "line" not in answer:
            assert "command writes it" in answer["reason"]
            continue
        lines += 1
        there = [float(x) for x in re.findall(r"\d+\.?\d*(?:[eE][+-]?\d+)?", done.stdout)]
        for x in re.findall(r"(?<![\w.])\d+\.?\d*(?:e[+-]?\d+)?(?![\w/])", answer["line"].partition("#")[0]):
            near = min(there, key=lambda y: abs(y - float(x)))
            assert near == pytest.approx(float(x), rel=1e-7), (answer["line"], x)
    assert lines == {"same": 8, "size": 8, "wall": 6}[kind]
    assert programs == [*TARGETS]


@pytest.mark.parametrize(
    ("program", "radius", "step", "begin", "advice"),
    [
        ("mujoco", 0.01, 2e-3, "MuJoCo's default step of 2 ms", '; --contact-time "40 ms" makes a contact'),
        ("drake", 0.01, 1e-3, "Drake's default step of 1 ms", '; --contact-time "20 ms" makes a contact'),
        ("mujoco", 10, 2e-3, "MuJoCo's default step of 2 ms", ", and the line is not exact: the command adapts"),
        ("lammps", 1e-6, 1e-8, "LAMMPS's default step of 10 ns", ": write a step of "),
        ("mujoco", 1000, None, "", ""),
        ("lammps", 0.01, None, "", ""),
        ("simbody", 0.01, None, "", ""),
    ],
)
def test_the_default_step_of_a_program_is_compared_with_the_contact(run, program, radius, step, begin, advice):
    """A ball of 1 cm has contacts of 0.06 ms; they are in proportion to the radius."""
    given = of(damping=0.6, bodies=[GLASS | {"radius": radius}] * 2)
    ((answer, lines),) = run(f"[calculate(x), page.linesOf({program!r}, calculate(x), x)]", [given])
    if step is None:
        assert lines["warning"] == ""
    else:
        steps = answer["contactTime"] / step
        assert lines["warning"].startswith(f"Warning: with {begin} a contact lasts {steps:.2g} steps{advice}")
        assert lines["command"].endswith(f" --time-step {step:g}") == ("not exact" in advice)
