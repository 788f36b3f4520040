"""LAMMPS: what the text says, read back and integrated by another route; and collisions in LAMMPS where it is there."""

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.simulators.two_balls import flowing, integrated, need
from tests.titles import HARD
from viscopade import Pair, Sphere
from viscopade.arrays import double
from viscopade.collision.contact import Contact
from viscopade.simulators import input_file, lammps
from viscopade.simulators.input_file import render
from viscopade.simulators.setup import NamedContact, Setup, Units
from viscopade_lab.runs import simulators

COMMAND = "viscopade simulators lammps scene.toml"
STEEL = Sphere(radius=0.005, density=7800, young_modulus=2e9, poisson_ratio=0.28, dissipative_constant=1e-5)
RUBBER = Sphere(radius=0.01, density=1100, young_modulus=1e7, poisson_ratio=0.48, dissipative_constant=3e-4)
FLOOR = Sphere.wall(young_modulus=5e8, poisson_ratio=0.2, dissipative_constant=2e-5)
LID = Sphere.wall(young_modulus=1e6, poisson_ratio=0.4, dissipative_constant=1e-4)
BODIES = {"floor": FLOOR, "steel": STEEL, "rubber": RUBBER, "lid": LID}


def scaled(sphere, factor):
    """Return a sphere of the same material and another size."""
    radius, mass = sphere.radius * factor, sphere.mass * factor**3
    return replace(sphere, radius=radius, mass=mass)


UNLIKE = Pair(STEEL, RUBBER)
BALL = Sphere(radius=0.01, density=2500, young_modulus=1e7, poisson_ratio=0.3, dissipative_constant=1)
EXTREMES = (Pair(scaled(STEEL, 1.2), scaled(RUBBER, 1.2)), Pair(scaled(STEEL, 0.8), scaled(RUBBER, 0.8)))
SETUP = Setup(
    "Steel and rubber",
    BODIES,
    (
        NamedContact("steel", "rubber", UNLIKE, 0.01, 0.3, 2.0, EXTREMES),
        NamedContact("rubber", "floor", Pair(RUBBER, FLOOR), 0.02, 0.2, 0.5),
    ),
)
TEXT = render("lammps", SETUP, COMMAND)
NUMBERS = r"hertz/material (\S+) (\S+) (\S+) tangential linear_nohistory 0.0 0.0 damping viscoelastic limit_damping"
PAIRS = re.compile(rf"^pair_coeff (\d) (\d) {NUMBERS}  # \S+-\S+$", re.MULTILINE)
WALLS = re.compile(rf"^fix (\w+)_type(\d) (\w+) wall/gran granular {NUMBERS} \$\{{(\w+)\}}  # \S+-\S+$", re.MULTILINE)


def uniform(first, second, speed=1.0):
    """Return the setup of one contact, or of one kind of bodies if they are the same."""
    contact = NamedContact("a", "a" if first == second else "b", Pair(first, second), speed, speed, speed)
    return Setup("One contact", {"a": first, contact.second: second}, (contact,))


def alike(v_star):
    """Return the setup of two like balls whose v* at the speed 1 is the wanted one."""
    factor = (v_star / Pair(BALL, BALL).v_star(1.0)) ** 2
    ball = replace(BALL, dissipative_constant=BALL.dissipative_constant * factor)
    return uniform(ball, ball)


def lines(text):
    """Return E, eta_n0 and nu of all lines by type and type or the wall's variable."""
    found = {(int(i), int(j)): tuple(map(float, rest)) for i, j, *rest in PAIRS.findall(text)}
    for variable, number, _, *rest, used in WALLS.findall(text):
        assert used == variable
        found[int(number), variable] = tuple(map(float, rest))
    return found


# The text, without LAMMPS.


@pytest.mark.parametrize(
    ("key", "first", "second"),
    [
        ((1, 1), STEEL, STEEL),
        ((1, 2), STEEL, RUBBER),
        ((2, 2), RUBBER, RUBBER),
        ((1, "wall1_floor"), STEEL, FLOOR),
        ((2, "wall1_floor"), RUBBER, FLOOR),
        ((1, "wall2_lid"), STEEL, LID),
        ((2, "wall2_lid"), RUBBER, LID),
    ],
)
@pytest.mark.parametrize("speed", [0.01, 2.0])
def test_the_numbers_in_the_text_give_the_exact_eps(key, first, second, speed):
    """The force of LAMMPS's documentation, integrated in time."""
    e, eta, nu = lines(TEXT)[key]
    pair, k = Pair(first, second), 4 / 3 * e / (2 * (1 - nu**2))
    found = integrated(
        lambda d, rate: math.sqrt(pair.R_eff * d) * (k * d + eta * pair.m_eff * rate),
        uniform(first, second),
        speed,
        "force",
    )
    assert found == pytest.approx(pair.epsilon(speed), rel=1e-7)


def test_there_is_a_line_for_every_pair_of_types_and_every_type_and_wall():
    walls = {(number, wall) for number in (1, 2) for wall in ("wall1_floor", "wall2_lid")}
    assert set(lines(TEXT)) == {(1, 1), (1, 2), (2, 2)} | walls
    meant, others, walls, other_walls = re.split(r"# Not among .*|pair_style.*|# You set", TEXT)[2:6]
    assert [len(lines(part)) for part in (meant, others, walls, other_walls)] == [1, 2, 1, 3]
    assert set(lines(meant)) | set(lines(walls)) == {(1, 2), (2, "wall1_floor")}


def test_one_material_stands_for_two_in_tangential_direction_too():
    e, _, nu = lines(TEXT)[1, 2]
    both = sum(2 * (2 - b.poisson_ratio) * (1 + b.poisson_ratio) / b.young_modulus for b in (STEEL, RUBBER))
    assert e / (4 * (2 - nu) * (1 + nu)) == pytest.approx(1 / both, rel=1e-12)


def test_the_damping_constant_is_twice_a_e_eff_over_m_eff():
    ball = Sphere(radius=0.02, mass=0.5, young_modulus=3e6, poisson_ratio=0.25, dissipative_constant=2e-3)
    # E_eff = 3e6/(2 (1 - 1/16)) = 1.6e6, m_eff = 1/4
    numbers = lammps.hertz_material(Pair(ball, ball))
    assert numbers.eta_n0 == pytest.approx(2 * 2e-3 * 1.6e6 / 0.25, rel=1e-15)
    assert numbers.k_n == pytest.approx(4 / 3 * 1.6e6, rel=1e-15)


@pytest.mark.parametrize(
    ("units", "style", "warned"),
    [(Units(), "si", False), (Units("cm", "g", "s"), "cgs", False), (Units("km", "kg", "s"), "lj", True)],
)
def test_units(units, style, warned):
    text = flowing(render("lammps", replace(SETUP, units=units), COMMAND))
    assert f"stand units {style}," in text
    assert ("no units style" in text) == warned


def test_the_file_says_that_the_default_time_step_is_too_long():
    """Balls of 1 um in pg, um, us: the contact lasts about 0.006 us, and the default step of units micro is 2 us."""
    ball = Sphere(radius=1, density=2.5, young_modulus=7e4, poisson_ratio=0.25, dissipative_constant=0)
    micro = replace(uniform(ball, ball, 1.0), units=Units("um", "pg", "us"))
    assert re.search(
        r'Warning: write "timestep \S+": a script without timestep has 2 us', flowing(render("lammps", micro, COMMAND))
    )
    assert re.search(r' Write "timestep \S+": a script without timestep has 1e-08 s', flowing(TEXT))


def test_names_of_walls_become_names_that_lammps_accepts():
    bodies = {"a": RUBBER, "the floor": FLOOR, "the-floor": LID}
    setup = Setup("Walls", bodies, (NamedContact("a", "the floor", Pair(RUBBER, FLOOR), 1, 1, 1),))
    assert re.findall(r"^variable (\w+) ", render("lammps", setup, COMMAND), re.MULTILINE) == [
        "wall1_the_floor",
        "wall2_the_floor",
    ]


def stepped(pair, speed, timestep, phases):
    """Return the eps of LAMMPS's steps."""
    contact = Contact.of_law("viscoelastic", float(pair.v_star(speed)) ** 2)
    return contact.rebounds(1.0, timestep / float(pair.time_scale(speed)), phases, longest=100).epsilon


def test_the_scheme_is_of_first_order():
    pair = UNLIKE.calibrated(speed=1.0, epsilon=0.4)
    duration = pair.contact_time(1.0)
    coarse, fine = (float(stepped(pair, 1.0, duration / n, 0.5)) / 0.4 - 1 for n in (2000, 20000))
    assert -2e-4 < coarse < -5e-5
    assert coarse / fine == pytest.approx(10, rel=0.03)


def test_errors_of_time_steps_are_reached_but_not_exceeded():
    phases = np.array(input_file.PHASES)
    for contact in SETUP.contacts:
        timestep = contact.pair.contact_time(2.0) / 100
        found = [
            np.abs(stepped(pair, speed, timestep, phases) / pair.epsilon(speed) - 1).max()
            for pair in (contact.pair, *contact.extremes)
            for speed in (contact.slowest, contact.typical, contact.fastest)
        ]
        assert input_file.timestep_error(contact, timestep) == pytest.approx(max(found), rel=0.06)


def test_the_measured_table_is_what_the_scheme_gives():
    """All columns of docs/usage/simulators/lammps.md up to 100,000 steps; the rows of two like spheres."""
    document = (Path(__file__).parents[2] / "docs" / "usage" / "simulators" / "lammps.md").read_text()
    rows = re.findall(r"^\| v\* = (\S+) \| (\S+) \| (\S+) \| (\S+) \| (\S+) \|", document, re.MULTILINE)
    assert len(rows) == 8
    v_star, epsilon, *errors = np.array(rows, float).T
    assert epsilon == pytest.approx(double.epsilon(v_star), abs=1e-8)
    contact, tau_c = Contact.of_law("viscoelastic", v_star[:, None] ** 2), double.tau_c(v_star)
    for steps, expected in zip((50, 1000, 100_000), errors, strict=True):
        phases = input_file.PHASES if steps <= 1000 else (0.5,)
        found = contact.rebounds(1.0, tau_c[:, None] / steps, phases, longest=100).epsilon
        found = found / double.epsilon(v_star)[:, None] - 1
        worst = found[np.arange(len(rows)), np.abs(found).argmax(-1)]
        assert expected == pytest.approx(worst, rel=0.06)


# LAMMPS itself.


@pytest.fixture(scope="module")
def program():
    need("lammps")


@pytest.mark.parametrize("style", lammps.DEFAULT_STEPS)
def test_the_default_time_step(program, style):
    printed = simulators.lammps(f'units {style}\nregion box block 0 1 0 1 0 1\ncreate_box 1 box\nprint "step $(dt)"\n')
    assert float(re.search(r"^step (\S+)", printed, re.MULTILINE)[1]) == lammps.DEFAULT_STEPS[style]


SCRIPT = """\
units {style}
atom_style sphere
atom_modify map array
boundary s s s
comm_modify vel yes
neighbor {skin!r} nsq
region box block -{box} {box} -{box} {box} -{box} {box}
create_box {types} box
{atoms}
{walls}
include viscopade.lammps
fix motion all nve/sphere
timestep {timestep!r}
thermo {steps}
run {steps}
variable epsilon equal {rebound}
print "epsilon ${{epsilon}} overlap $({overlap}:%.9g)"
"""


def collision_script(setup, text, contact, speed, timestep, phase=0.0, contact_times=1.5):
    """Return an input with a setup's text in which two bodies of a contact collide head-on; a wall is at z = 0."""
    pair, names = contact.pair, [name for name, body in setup.bodies.items() if not body.is_wall]
    gap, first, second = phase * speed * timestep, pair.first.radius, pair.second.radius
    if pair.second.is_wall:
        balls = [(contact.first, pair.first, first + gap, -speed)]
        rebound, overlap = f"vz[1]/{speed!r}", f"{first!r}-z[1]"
    else:
        balls = [
            (contact.first, pair.first, -first - gap / 2, speed / 2),
            (contact.second, pair.second, second + gap / 2, -speed / 2),
        ]
        rebound, overlap = f"(vz[2]-vz[1])/{speed!r}", f"{first!r}+{second!r}-(z[2]-z[1])"
    atoms = (
        f"create_atoms {names.index(name) + 1} single 0 0 {z!r} units box\nset atom {i} diameter {2 * body.radius!r}\n"
        f"set atom {i} mass {body.mass!r}\nset atom {i} vz {v!r}"
        for i, (name, body, z, v) in enumerate(balls, 1)
    )
    variables = re.findall(r"^variable (\w+) index .*# (.*)$", text, re.MULTILINE)
    walls = (
        f'variable {variable} index "zplane {"0.0" if name == contact.second else "NULL"} NULL"'
        for variable, name in variables
    )
    radii = [body.radius for _, body, _, _ in balls]
    return SCRIPT.format(
        style=re.search(r"stand units (\w+)", flowing(text))[1],
        skin=min(radii),
        box=2.5 * max(radii),
        types=len(names),
        atoms="\n".join(atoms),
        walls="\n".join(walls),
        timestep=timestep,
        steps=math.ceil(contact_times * float(pair.contact_time(speed)) / timestep) + 2,
        rebound=rebound,
        overlap=overlap,
    )


def in_lammps(setup, contact=None, speed=1.0, steps=2000, change=lambda text: text, alter=lambda text: text, **options):
    """Run a contact of a setup; `change` edits the include file, `alter` the script. Returns eps and the overlap."""
    contact, text = contact or setup.contacts[0], render("lammps", setup, COMMAND)
    script = collision_script(setup, text, contact, speed, float(contact.pair.contact_time(speed)) / steps, **options)
    printed = simulators.lammps(alter(script), **{"viscopade.lammps": change(text)})
    found = re.search(r"^epsilon (\S+) overlap (\S+)$", printed, re.MULTILINE)
    return float(found[1]), float(found[2])


@pytest.mark.parametrize("v_star", [0.1, 1.0, 5.0])
@pytest.mark.parametrize("phase", [0.0, 0.3])
def test_two_spheres(program, v_star, phase):
    case = alike(v_star)
    epsilon, _ = in_lammps(case, steps=20_000, phase=phase)
    timestep = case.contacts[0].pair.contact_time(1.0) / 20_000
    assert epsilon == pytest.approx(case.contacts[0].pair.epsilon(1.0), rel=1e-5 if v_star < 1 else 1.5e-4)
    found = float(stepped(case.contacts[0].pair, 1.0, timestep, phase))
    assert epsilon == pytest.approx(found, rel=1e-10, abs=0)


def test_no_title_changes_what_is_read(program):
    """Three quotes in a comment begin a text that goes on over lines, and "&" at its end takes the next line."""
    case = alike(1.0)
    epsilon = case.contacts[0].pair.epsilon(1.0)
    for title in HARD:
        assert in_lammps(replace(case, title=title))[0] == pytest.approx(epsilon, rel=2e-3), title


@pytest.mark.parametrize("contact", SETUP.contacts, ids=lambda contact: contact.name)
@pytest.mark.parametrize("speed", [0.05, 0.5])
def test_unlike_spheres_and_a_wall_among_others(program, contact, speed):
    """With all types, groups and walls of the file; the wall and unlike spheres are found by their own lines."""
    epsilon, _ = in_lammps(SETUP, contact, speed)
    timestep = contact.pair.contact_time(speed) / 2000
    assert epsilon == pytest.approx(contact.pair.epsilon(speed), rel=5e-4)
    assert epsilon == pytest.approx(float(stepped(contact.pair, speed, timestep, 0.0)), rel=1e-10)


def test_the_end_of_contact_is_that_of_limit_damping(program):
    """With it the spheres still overlap when they have their final velocity; without it eps is another."""
    case = alike(1.0)
    first, overlap = in_lammps(case, contact_times=1.01)
    final, _ = in_lammps(case, contact_times=3)
    assert overlap > 0
    assert first == final
    older, _ = in_lammps(case, contact_times=3, change=lambda text: text.replace(" limit_damping", ""))
    assert older < 0.9 * final


def test_hertz_with_the_stated_numbers_is_the_same_law(program):
    def hertz(text):
        assert "hertz k_n eta_n0 with k_n = 4/3 E_eff" in flowing(text)
        ((e, eta, nu),) = lines(text).values()
        same = f"hertz {4 / 3 * e / (2 * (1 - nu**2)):.15g} {eta:.15g}"
        return re.sub(r"(?<=^pair_coeff 1 1 )hertz/material \S+ \S+ \S+", same, text, flags=re.MULTILINE)

    case = alike(1.0)
    assert in_lammps(case, change=hertz)[0] == pytest.approx(in_lammps(case)[0], rel=1e-12, abs=0)


def test_other_sizes_have_the_eps_that_is_stated(program):
    """The line of the typical sizes, with spheres of the largest ones."""
    contact = replace(SETUP.contacts[0], pair=EXTREMES[0], extremes=())
    wrong = input_file.same_damping_per_mass(UNLIKE)(EXTREMES[0]).epsilon(0.3)
    assert in_lammps(SETUP, contact, 0.3)[0] == pytest.approx(wrong, rel=1e-3)
    assert abs(wrong / EXTREMES[0].epsilon(0.3) - 1) > 0.1


def test_the_constant_eps_has_the_range_that_is_stated(program):
    """For all sizes and speeds the eps of the typical sizes at the typical speed, 0.3 m/s."""
    contact, text = SETUP.contacts[0], flowing(TEXT)
    stated = re.search(r"steel-rubber +\S+ \S+ \S+ .*?(\S+) \((\S+) to (\S+) %\)", text.split("coeff_restitution")[-1])
    number, *stated_errors = stated.groups()
    wanted = UNLIKE.epsilon(0.3)
    errors = [100 * (wanted / pair.epsilon(v) - 1) for pair in (UNLIKE, *EXTREMES) for v in (0.01, 2.0)]
    assert [*map(float, stated_errors)] == pytest.approx([min(errors), max(errors)], rel=6e-3)

    def constant(text):
        """What the file says: the number in place of eta_n0, and the other damping."""
        line = r"^(pair_coeff 1 2 hertz/material \S+) \S+ (.*) viscoelastic"
        return re.sub(line, rf"\1 {number} \2 coeff_restitution", text, flags=re.MULTILINE)

    for pair, speed in ((UNLIKE, 0.3), (EXTREMES[0], 2.0)):
        found, _ = in_lammps(SETUP, replace(contact, pair=pair, extremes=()), speed, change=constant)
        assert found == pytest.approx(wanted, rel=2e-3)


POUR = """\
units si
atom_style sphere
boundary p p f
comm_modify vel yes
region box block -0.05 0.05 -0.05 0.05 -0.1 0.3
create_box 2 box
variable wall1_floor index "zplane 0.0 NULL"
variable wall2_lid index "zplane NULL 0.3"
include viscopade.lammps
fix motion all nve/sphere
fix fall all gravity 9.81 vector 0 0 -1
region slab block -0.04 0.04 -0.04 0.04 0.05 0.1
fix drops {group} pour 8 1 4767548 region slab diam one 0.01 dens 7800 7800
timestep 2e-5
compute lowest all reduce min z
thermo_style custom step atoms c_lowest
thermo_modify lost ignore
run 12000
print "atoms $(atoms) lowest $(c_lowest)"
"""


@pytest.mark.parametrize(("group", "stays"), [("viscopade_type1", True), ("all", False)])
def test_poured_spheres_stay_above_the_floor_if_they_are_poured_into_their_group(program, group, stays):
    assert '"fix ID viscopade_type1 pour N 1 ...", not into all' in flowing(TEXT)
    printed = simulators.lammps(POUR.format(group=group), **{"viscopade.lammps": TEXT})
    found = re.search(r"^atoms (\S+) lowest (\S+)$", printed, re.MULTILINE)
    assert float(found[1]) == (8 if stays else 0)  # those that fell through have left the box
    assert not stays or float(found[2]) > 0.004


def test_mindlin_without_a_stiffness_finds_that_of_unlike_spheres(program):
    """A spinning sphere: what NULL gives is what the effective shear modulus of both materials gives."""

    def spin(script):
        return re.sub(r"^(set atom 1 vz.*)$", r"\1\nset atom 1 omega 50 0 0", script, flags=re.MULTILINE).replace(
            "(vz[2]-vz[1])", "(vy[2]-vy[1])"
        )

    def mindlin(stiffness):
        return lambda text: text.replace("linear_nohistory 0.0 0.0", f"mindlin {stiffness} 0.0 10.0")

    compliance = sum(2 * (2 - b.poisson_ratio) * (1 + b.poisson_ratio) / b.young_modulus for b in (STEEL, RUBBER))
    found = [in_lammps(SETUP, change=mindlin(k), alter=spin)[0] for k in ("NULL", f"{8 / compliance:.15g}", "1e5")]
    assert found[0] == pytest.approx(found[1], rel=1e-9)
    assert abs(found[0] - found[2]) > 1e-3


def test_a_wall_is_where_the_user_says(program):
    """The definition before the file wins: a floor lower by a tenth of a radius is met later, with the same eps."""
    contact = SETUP.contacts[1]
    lowered = "variable wall1_floor index"
    here, _ = in_lammps(SETUP, contact, 0.5)
    there, overlap = in_lammps(
        SETUP,
        contact,
        0.5,
        alter=lambda script: script.replace(f'{lowered} "zplane 0.0', f'{lowered} "zplane -1e-4'),
        contact_times=3,
    )
    assert there == pytest.approx(here, rel=1e-4)
    never, overlap = in_lammps(
        SETUP, contact, 0.5, alter=lambda script: script.replace(f'{lowered} "zplane 0.0', f'{lowered} "zplane -1')
    )
    assert never == -1
    assert overlap > 0


@pytest.mark.parametrize("units", [Units("cm", "g", "s"), Units("ft", "stone", "s")], ids=["cgs", "lj"])
def test_other_units_give_the_same_eps(program, units):
    """The same collision with its numbers in cgs, under units cgs, and under units lj as for units of one's own."""
    case = alike(1.0)
    ball = case.contacts[0].pair.first
    cgs = Sphere(
        radius=100 * ball.radius,
        mass=1000 * ball.mass,
        young_modulus=10 * ball.young_modulus,
        poisson_ratio=ball.poisson_ratio,
        dissipative_constant=ball.dissipative_constant,
    )
    setup = replace(uniform(cgs, cgs, 100.0), units=units)
    expected, _ = in_lammps(case)
    assert in_lammps(setup, speed=100.0)[0] == pytest.approx(expected, rel=1e-10)
