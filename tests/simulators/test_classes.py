"""Classes of sizes in a scene: types and contacts of each class in the files, and collisions in the programs."""

import itertools
import math
import re
import shutil
from pathlib import Path

import pytest

from tests.simulators.test_files import yade as yade_force
from tests.simulators.test_lammps import in_lammps, lines
from tests.simulators.two_balls import flowing, integrated, matrix, need, yade_names
from viscopade.scene.model_limits import setup
from viscopade.scene.read import from_toml
from viscopade.simulators.input_file import render
from viscopade.simulators.setup import NamedContact, Setup
from viscopade_lab.runs import simulators

COMMAND = "viscopade simulators PROGRAM scene.toml"
SCENE = """
[material.glass]
young_modulus = "10 MPa"
poisson_ratio = 0.25
density = 2500
dissipative_constant = "0.05 ms"
[material.steel]
young_modulus = "1 GPa"
poisson_ratio = 0.3
dissipative_constant = "1 us"
[body.bead]
material = "glass"
radius = { min = "1 mm", max = "8 mm", classes = 3 }
[body.floor]
material = "steel"
wall = true
[speed]
min = 0.1
max = 1.0
[tolerance]
epsilon = 1e-3
"""
ENDS = (1e-3, 2e-3, 4e-3, 8e-3)
"""Of three classes from 1 to 8 mm: their ends have the ratio 2."""
RADII = [math.sqrt(low * high) for low, high in itertools.pairwise(ENDS)]
PAIRS = [*itertools.combinations_with_replacement((0, 1, 2), 2), (0, None), (1, None), (2, None)]
"""Classes that meet; None is the wall."""
TYPED = setup(from_toml(SCENE, "scene.toml"), classes=True)
PROGRAMS = ("lammps", "liggghts", "yade", "mercurydpm")


def m_eff(first, second):
    """Return the effective mass of two radii, or of one at the wall."""
    masses = [4 / 3 * math.pi * 2500 * radius**3 for radius in (first, second) if radius is not None]
    return 1 / sum(1 / mass for mass in masses)


def test_classes_have_equal_ratios_and_geometric_means():
    assert list(TYPED.bodies) == ["bead_1", "bead_2", "bead_3", "floor"]
    assert [body.radius for body in TYPED.bodies.values()][:3] == pytest.approx(RADII, rel=1e-14)
    for found, ends in zip(TYPED.radii.values(), itertools.pairwise(ENDS), strict=True):
        assert found == pytest.approx(ends, rel=1e-14)
    wanted = [(f"bead_{i + 1}", "floor" if j is None else f"bead_{j + 1}") for i, j in PAIRS]
    assert [(contact.first, contact.second) for contact in TYPED.contacts] == wanted
    whole = setup(from_toml(SCENE, "scene.toml"))
    assert [contact.name for contact in whole.contacts] == ["bead-bead", "bead-floor"]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("classes = 3", f"classes = {value}", f"radius.classes is {shown}: expected an integer from 1 to 16")
        for value, shown in (("0", "0"), ("17", "17"), ("2.5", "2.5"), ("true", "True"), ('"3"', "'3'"))
    ]
    + [
        ("8 mm", "1 mm", "body.bead.radius.classes is 3: expected 1 for a single radius"),
        ("body.floor", "body.bead_2", "body.bead_2 has the name of a class of body.bead: expected another name"),
    ],
)
def test_bad_classes(old, new, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        setup(from_toml(SCENE.replace(old, new), "scene.toml"), classes=True)


def test_too_many_types():
    bodies = "".join(
        f'[body.b{i}]\nmaterial = "glass"\nradius = {{ min = 1, max = 2, classes = 16 }}\n' for i in range(4)
    )
    with pytest.raises(ValueError, match="classes make 68 types: expected at most 64"):
        setup(from_toml(SCENE + bodies, "scene.toml"), classes=True)


# Of a line of each program: 2 A E_eff/m_eff of the classes' own radii, or beta.


def test_lines_of_lammps():
    found = lines(render("lammps", TYPED, COMMAND))
    assert set(found) == {(i + 1, "wall1_floor" if j is None else j + 1) for i, j in PAIRS}
    modulus = {False: 1e7 / (2 * (1 - 0.25**2)), True: 1 / ((1 - 0.25**2) / 1e7 + (1 - 0.3**2) / 1e9)}
    a_wall = modulus[True] * (5e-5 * (1 - 0.25**2) / 1e7 + 1e-6 * (1 - 0.3**2) / 1e9)
    for i, j in PAIRS:
        a = 5e-5 if j is not None else a_wall
        eta = 2 * a * modulus[j is None] / m_eff(RADII[i], None if j is None else RADII[j])
        assert found[i + 1, "wall1_floor" if j is None else j + 1][1] == pytest.approx(eta, rel=1e-12)


def test_matrices_of_liggghts():
    gamman = matrix(render("liggghts", TYPED, COMMAND), "gamman")
    assert len(gamman) == 4
    for i, j in PAIRS[:6]:
        eta = 2 * 5e-5 * 1e7 / (2 * (1 - 0.25**2)) / m_eff(RADII[i], RADII[j])
        assert gamman[i][j] == gamman[j][i] == pytest.approx(eta, rel=1e-11)


def test_materials_of_yade():
    text = render("yade", TYPED, COMMAND)
    names = yade_names(text, vn=True)
    assert names["materials"] == {"bead_1": 0, "bead_2": 1, "bead_3": 2, "floor": 3}
    assert set(names["physics"].values["en"]) == {(i, 3 if j is None else j) for i, j in PAIRS}
    contact = TYPED.contacts[1]  # of two classes
    case = Setup("t", {"a": contact.pair.first, "b": contact.pair.second}, (contact_of(contact.pair),))
    found = integrated(yade_force(text, contact.pair, (0, 1)), case, 0.5, "force")
    assert found == pytest.approx(contact.pair.epsilon(0.5), rel=1e-7)


def contact_of(pair):
    return NamedContact("a", "b", pair, 0.5, 0.5, 0.5)


def test_species_of_mercurydpm():
    """A pair of classes has the E_eff and A of the material: the program's own law is right for all sizes."""
    text = render("mercurydpm", TYPED, COMMAND)
    mixed = r"getMixedObject\(species\.bead_(\d)_species, species\.bead_(\d)_species\), (\S+), (\S+)\);"
    found = re.findall(mixed, text)
    assert [(i, j) for i, j, *_ in found] == [("1", "2"), ("1", "3"), ("2", "3")]
    assert [float(a) for *_, a in found] == pytest.approx([5e-5] * 3, rel=1e-12)
    assert "Warning: at the ends of the sizes" not in flowing(text)


@pytest.mark.parametrize("program", PROGRAMS)
def test_a_file_says_which_radii_a_type_is_for(program):
    text = render(program, TYPED, COMMAND)
    for low, high in itertools.pairwise(ENDS):
        assert re.search(rf"bead_\d.* {low:.10g} to {high:.10g}$", text, re.MULTILINE)
    assert "bead_1 to bead_3 are the classes of sizes of bead: the ends of each have one ratio" in flowing(text)


@pytest.mark.parametrize("program", PROGRAMS)
def test_no_line_of_the_comments_stands_twice(program):
    """Of 9 contacts; only the headers of a table's parts begin alike."""
    text = render(program, TYPED, COMMAND)
    comments = [line for line in text.splitlines() if re.match(r"(#|//) +\S", line)]
    assert len(comments) == len(set(comments))
    assert len(comments) < 80  # 9 contacts in three parts of the table, 4 types, and what all have in common


def stated_error(program, typed):
    """Return the range of the one warning about sizes, and the contact."""
    text = flowing(render(program, typed, COMMAND))
    found = re.findall(r"Warning: at the ends of the sizes eps is off by (\S+) to (\S+) % \((\S+), the worst", text)
    assert len(found) == 1
    *ends, name = found[0]
    return [float(end) / 100 for end in ends], name


@pytest.mark.parametrize("program", ["lammps", "liggghts", "yade"])
@pytest.mark.parametrize("classes", [1, 3])
def test_the_warning_has_the_largest_error_at_the_ends_of_a_class(program, classes):
    """A of other sizes is in proportion to m_eff; in YADE beta is that of typical ones, at a wall, too."""
    scene = from_toml(SCENE.replace("classes = 3", f"classes = {classes}"), "scene.toml")
    typed = setup(scene, classes=True)
    worst = {}
    for contact in typed.contacts:
        typical = contact.pair
        radii = [typed.radii.get(name, (None,)) for name in (contact.first, contact.second)]
        for first, second in itertools.product(*radii):
            pair = scene.pair(scene.meetings[second is None], (first, second))
            a = pair.A * m_eff(first, second) / typical.m_eff
            own = pair.damped(a if program != "yade" else float(pair.dissipative_constant(typical.beta)))
            for speed in (0.1, 1.0):
                worst.setdefault(contact.name, []).append(float(own.epsilon(speed) / pair.epsilon(speed) - 1))
    name = max(worst, key=lambda name: max(map(abs, worst[name])))
    assert stated_error(program, typed) == (pytest.approx([min(worst[name]), max(worst[name])], rel=6e-3), name)


# Collisions in the programs.


@pytest.mark.parametrize("contact", TYPED.contacts, ids=lambda contact: contact.name)
def test_contacts_in_lammps(contact):
    """Of the file as it is: each class with each, and with the wall."""
    need("lammps")
    epsilon, _ = in_lammps(TYPED, contact, 0.5)
    assert epsilon == pytest.approx(contact.pair.epsilon(0.5), rel=3e-4)


def test_atoms_of_lammps_get_the_type_of_their_radius():
    """By the two lines of the page, here after atoms of all types' radii in one type."""
    need("lammps")
    page = (Path(__file__).parents[2] / "docs/usage/simulators/lammps.md").read_text("utf-8")
    (two_lines,) = re.findall(r"^variable class atom .*\nset type 1\*3 type v_class$", page, re.MULTILINE)
    atoms = "\n".join(
        f"create_atoms 1 single {20 * radius!r} 0 0 units box\nset atom {i} diameter {2 * radius!r}"
        for i, radius in enumerate(RADII, 1)
    )
    printed = simulators.lammps(
        "units si\natom_style sphere\natom_modify map array\nregion box block -1 1 -1 1 -1 1\ncreate_box 3 box\n"
        f'{atoms}\n{two_lines}\nprint "types $(type[1]) $(type[2]) $(type[3])"\n'
    )
    assert "types 1 2 3\n" in printed


def test_the_ends_of_a_class_in_lammps_are_off_as_the_file_says():
    need("lammps")
    (least, largest), name = stated_error("lammps", TYPED)
    (contact,) = (contact for contact in TYPED.contacts if contact.name == name)
    errors = []
    for pair, speed in itertools.product((contact.extremes[0], contact.extremes[-1]), (0.1, 1.0)):
        epsilon, _ = in_lammps(TYPED, contact_like(contact, pair), speed)
        errors.append(epsilon / pair.epsilon(speed) - 1)
    assert [min(errors), max(errors)] == pytest.approx([least, largest], abs=2e-3)


def contact_like(contact, pair):
    return NamedContact(contact.first, contact.second, pair, contact.slowest, contact.typical, contact.fastest)


@pytest.mark.skipif(shutil.which("liggghts") is None, reason="the program liggghts is not installed")
@pytest.mark.parametrize("contact", TYPED.contacts[:6], ids=lambda contact: contact.name)
def test_contacts_in_liggghts(contact):
    """Of the file as it is. LIGGGHTS wants an atom of each type: the others lie apart, by the side."""
    pair, mean = contact.pair, (contact.pair.first.radius + contact.pair.second.radius) / 2
    step, (first, second) = pair.contact_time(0.5) / 1600, (name[-1] for name in (contact.first, contact.second))
    script = simulators.liggghts_spheres("include contacts.in", step, 8000, radius=mean, mass=1.0, speed=0.5)
    sizes = "".join(
        f"set atom {i} diameter {2 * body.radius!r} mass {body.mass!r}\n"
        for i, body in enumerate((pair.first, pair.second), 1)
    )
    others = "".join(f"create_atoms {i} single {(3 * i - 7) * mean!r} {6 * mean!r} 0\n" for i in range(1, 5))
    for old, new in (
        ("create_box 1 ", "create_box 4 "),
        (f"create_atoms 1 single {-mean!r}", f"create_atoms {first} single {-mean!r}"),
        (f"create_atoms 1 single {mean!r}", f"create_atoms {second} single {mean!r}"),
        ("set group all", f"{others}set group all"),
        ("set atom 1 vx", f"{sizes}set atom 1 vx"),
    ):
        assert script.count(old) == 1
        script = script.replace(old, new)
    text = render("liggghts", TYPED, COMMAND)
    assert simulators.liggghts(script, **{"contacts.in": text}) == pytest.approx(pair.epsilon(0.5), rel=3e-4)
