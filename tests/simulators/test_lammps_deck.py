"""Inputs of LAMMPS and LIGGGHTS: each contact that is read, run from the same lines; what is missing; hostile files."""

import math
import time

import numpy as np
import pytest

from tests.simulators.two_balls import need
from viscopade.simulators.deck import DeckOptions
from viscopade.simulators.deck_rows import contact_rows
from viscopade.simulators.lammps_deck import line_settings, read_input
from viscopade.simulators.lammps_variables import Variables
from viscopade.simulators.native import FileUnits, Impact, delivery
from viscopade_lab.runs.simulators import LINE, lammps, liggghts_run

BOX = """
atom_style sphere
atom_modify map array
boundary f f f
newton off
comm_modify vel yes
region all block -${size} ${size} -${size} ${size} -${size} ${size} units box
create_box 2 all
fix move all nve/sphere
"""
FRICTIONLESS = "tangential linear_nohistory 0 0"

# The spheres stand in a file of their own, which a run replaces by the two that collide; all other lines stay.
DECKS = {
    "hooke": f"""
units lj
variable size index 9
{BOX}
include spheres  # of the default size
variable k equal 2e4/4*8   # 4e4
variable g index 50 60
variable reduced equal "-2^2*v_k*(1 + round(1.4) - sqrt(4)/2 - 1 + 1/4)"  # a sign binds more strongly than a power
pair_style granular
pair_coeff * * hooke ${{reduced}} &
    $g {FRICTIONLESS} damping mass_velocity
fix grav all gravity 1.0 vector 0 0 -1
fix floor all wall/gran granular hooke $(v_k/(1+1):%.3f) 30.0 &
    {FRICTIONLESS} damping mass_velocity zplane 0 NULL
timestep $(0.001*PI/PI)
run 600
""",
    "hertz": f"""
units si
variable size index 1
{BOX}
include spheres
variable k index 4e6
variable w string "granular hertz ${{k}} 3e4 {FRICTIONLESS}"   # a wall in quotes
variable k delete
pair_style gran/hertz/history 1e6 NULL 3e4 NULL 0 0
pair_coeff * *
fix grav all gravity 9.81 vector 0 0 -1
fix floor all wall/gran ${{w}} zplane 0 NULL
timestep 1e-6
run 9000
""",
    "hertz/material": f"""
units si
variable size index 1
{BOX}
pair_style granular
include spheres
pair_coeff * * hertz/material 1e7 4e4 0.3 {FRICTIONLESS} limit_damping
region drum cylinder x 0 0.04 0.04 -1 1 side in units box
fix drum all wall/gran/region granular hertz/material 1e7 4e4 0.3 {FRICTIONLESS} limit_damping region drum
timestep 1e-6
run 6000
""",
    "tsuji": f"""
units si
variable size index 1
{BOX}
include spheres
pair_style granular
pair_coeff * * hooke 1 1 {FRICTIONLESS}          # replaced below
pair_coeff 1* *2 hertz 4e6 0.6 {FRICTIONLESS} damping tsuji
fix floor all wall/gran hooke 1 NULL 1 NULL 0 0 zplane 0 NULL
unfix floor
fix floor all wall/gran granular hertz 4e6 0.7 {FRICTIONLESS} damping tsuji zplane 0 NULL
timestep 1e-6
run 6000
""",
    "coeff_restitution": f"""
units si
variable size index 1
{BOX}
include spheres
pair_style hybrid gran/hooke 1e4 NULL 50 NULL 0 0 granular
pair_coeff * * granular hooke 1e4 0.5 {FRICTIONLESS} damping coeff_restitution
pair_coeff 2 2 gran/hooke
timestep 1e-6
run 4000
pair_coeff 1 2 gran/hooke
run 9000
""",
    "mixing": f"""
units si
variable size index 1
{BOX}
include spheres
pair_style granular
pair_coeff 1 1 hertz/material 1e7 0.8 0.2 {FRICTIONLESS} damping coeff_restitution
pair_coeff 2 2 hertz/material 1e6 0.4 0.4 {FRICTIONLESS} damping coeff_restitution limit_damping
fix floor all wall/gran granular hertz/material 5e6 0.6 0.3 {FRICTIONLESS} damping coeff_restitution zplane 0 NULL
timestep 1e-6
run 12000
""",
    "jkr": f"""
units si
variable size index 1
{BOX}
include spheres
pair_style granular
pair_coeff 1 1 jkr 1e7 4e4 0.2 10 {FRICTIONLESS} damping viscoelastic
pair_coeff 2 2 jkr 1e6 2e4 0.4 15 {FRICTIONLESS} damping viscoelastic
fix floor all wall/gran granular dmt 5e6 3e4 0.3 20 {FRICTIONLESS} damping viscoelastic zplane 0 NULL
timestep 1e-6
run 12000
""",
}
SPHERES = """
create_atoms 1 single 0 0 0.5
create_atoms 2 single 0 0 0.8
set group all diameter 0.02 density 2500
set type 2 diameter 0.03
"""
SPEED, PHASE = 0.5, 0.3


def deck_of(folder, text, said=None, **others):
    """Return a deck of a file with others beside it."""
    for name, content in {"in.deck": text, "spheres": SPHERES, **others}.items():
        (folder / name).write_text(content)
    return read_input(folder / "in.deck", said or DeckOptions())


def expected_epsilon(deck, run, contact, sizes):
    """Return our eps at one phase, and the impact."""
    native, units = deck.program.native, deck.units
    mass, radius = (1 / sum(1 / size[i] for size in sizes if size is not None) for i in (1, 0))
    si = FileUnits(metres=1 / units.metres, kilograms=1 / units.kilograms, seconds=1 / units.seconds)
    hit = Impact(SPEED, mass, radius, run.gravity if contact.falls else 0.0, run.step).in_units(si)
    values = native.values(contact.settings)
    hit = hit.in_units(native.units(values))
    collided = native.contact(values, hit).collide(hit.speed, step=hit.step, phases=[PHASE])
    return collided.epsilon


def spheres_of(contact, sizes, step, gravity, steps_before):
    """Return commands for the spheres of a contact, which begins at a phase of a step, and for output of the gap."""
    types = [word for word in contact.name.split() if word.isdigit()]
    before = (steps_before + PHASE) * step
    gap = before * (SPEED - gravity * before / 2)
    speed = SPEED - gravity * before
    first, second = sizes
    if second is None:
        lines = [f"create_atoms {types[0]} single 0 0 {first.radius + gap!r}", f"set atom 1 vz {-speed!r}"]
        lines += [f"variable gap equal z[1]-{first.radius!r}", "variable speed equal vz[1]"]
    else:
        # Along x, far from walls, where both fall.
        distance, height = first.radius + second.radius, 2.6 * max(first.radius, second.radius)
        lines = [f"create_atoms {types[0]} single 0 0 {height!r}"]
        lines += [f"create_atoms {types[1]} single {distance + gap!r} 0 {height!r}", f"set atom 1 vx {speed!r}"]
        lines += [f"variable gap equal x[2]-x[1]-{distance!r}", "variable speed equal vx[2]-vx[1]"]
    for i, size in enumerate(size for size in sizes if size):
        lines += [f"set atom {i + 1} diameter {2 * size.radius!r}", f"set atom {i + 1} mass {size.mass!r}"]
    lines += ["thermo_style custom step v_gap v_speed", "thermo_modify format float %.15g norm no", "thermo 20"]
    return "\n".join(lines) + "\n"


def measured_epsilon(printed, gravity):
    """Return eps from gap and speed, from the first output after the contact."""
    gap, speed = np.array(LINE.findall(printed), dtype=float).T
    after = np.flatnonzero((gap > 5e-4) & (speed > 0))[0]  # beyond the neck of spheres that adhere
    return math.sqrt(speed[after] ** 2 + 2 * gravity * gap[after]) / SPEED


@pytest.mark.parametrize("name", DECKS)
def test_contacts_are_those_of_lammps(name, tmp_path):
    need("lammps")
    spheres = SPHERES if "units si" in DECKS[name] else "create_atoms 1 single 0 0 0.5\n"
    deck = deck_of(tmp_path, DECKS[name], spheres=spheres)
    steps = [int(run.line.text.split()[1]) for run in deck.runs]
    assert not deck.missing
    assert not deck.unread
    for i, run in enumerate(deck.runs):
        for contact in run.contacts:
            for sizes in contact.sizes:
                if sizes[1] is None:  # at a curved wall the radius of a row is R_eff
                    of_type = contact.name.split(" - ")[0]
                    sphere = next(pair.sizes[0][0] for pair in run.contacts if pair.name == f"{of_type} - {of_type}")
                else:
                    sphere = sizes[0]
                gravity = run.gravity if contact.falls else 0.0
                files = {"spheres": spheres_of(contact, (sphere, sizes[1]), run.step, gravity, sum(steps[:i]))}
                printed = lammps(DECKS[name], **files)
                epsilon = expected_epsilon(deck, run, contact, sizes)
                assert measured_epsilon(printed, gravity) == pytest.approx(epsilon, abs=1e-9), contact.name


@pytest.mark.parametrize("damping", ["coeff_restitution", "tsuji"])
@pytest.mark.parametrize("name", ["type 1 - type 2", "type 2 - wall floor"])
def test_lines_to_write_instead_give_the_wanted_eps_in_lammps(name, damping, tmp_path):
    need("lammps")
    text = DECKS["mixing"].replace("coeff_restitution", damping)
    deck = deck_of(tmp_path, text)
    (run,) = deck.runs
    contact = next(contact for contact in run.contacts if contact.name == name)
    sizes = contact.sizes[0]
    mass, radius = (1 / sum(1 / size[i] for size in sizes if size is not None) for i in (1, 0))
    instead = delivery(deck.program.native, contact.settings, Impact(SPEED, mass, radius, 0, run.step), 0.42).instead
    # The wall's own line acts on all types.
    lines = "\n".join(["unfix floor" if "wall" in name else "", *contact.lines_with(instead)])
    printed = lammps(
        text.replace("timestep", f"{lines}\ntimestep"), spheres=spheres_of(contact, sizes, run.step, 0.0, 0)
    )
    assert measured_epsilon(printed, 0.0) == pytest.approx(0.42, abs=1e-4)  # the mean over phases


POURED = f"""
units si
variable size index 1
{BOX}
pair_style granular
pair_coeff * * hertz/material 1e7 0.5 0.3 {FRICTIONLESS} damping tsuji
fix floor all wall/gran granular hertz/material 1e9 0.5 0.3 {FRICTIONLESS} damping tsuji zplane 0 NULL
fix grav all gravity 9.81 vector 0 0 -1
region top block -0.9 0.9 -0.9 0.9 0.1 0.9
fix p1 all pour 10 1 4711 region top diam one 0.02 dens 2500 2500
fix p2 all pour 10 2 4711 region top diam one 0.03 dens 2500 2500
timestep 1e-5
run 1
"""


def test_one_line_for_a_wall_of_two_types(tmp_path):
    """The contact times of 2 cm and 3 cm differ, and so do the numbers, by less than eps does within a step."""
    (first, second) = contact_rows(deck_of(tmp_path, POURED), 0.5, 0.7)[3:]
    assert first.lines == second.lines
    (line,) = first.lines
    assert line.startswith("fix floor all wall/gran granular hertz/material ")
    for row in (first, second):
        falling = row.answer.falling
        assert row.reached == pytest.approx(0.7, abs=(falling.largest - falling.least) / 2)
    # A damping in proportion to the mass has other numbers: the one line gives each type its own eps.
    viscoelastic = POURED.replace("damping tsuji", "").replace("1e9 0.5 0.3", "1e9 1e5 0.3")
    (first, second) = contact_rows(deck_of(tmp_path, viscoelastic), 0.5, 0.7)[3:]
    assert first.lines == second.lines
    assert sorted((first.reached, second.reached)) == pytest.approx([0.7, 0.852], abs=0.001)


def test_poured_spheres_stay_above_a_wall_with_the_line_to_write(tmp_path):
    """The wall of a file whose spheres are poured into all: LAMMPS stops if spheres are lost."""
    need("lammps")
    text = POURED.replace("damping tsuji", "").replace("1e9 0.5 0.3", "1e9 1e5 0.3").replace("run 1", "run 60000")
    *_, row = contact_rows(deck_of(tmp_path, text), 0.5, 0.7)
    (line,) = row.lines
    printed = lammps(text.replace(row.contact.line.text, line) + 'print "atoms $(atoms)"\n')
    assert "atoms 20" in printed


def test_spheres_that_fall_through_a_wall_are_warned_of(tmp_path):
    walls = POURED.replace("fix floor all", "fix floor small").replace(
        "fix grav", f"fix floor2 large wall/gran granular hertz 1e7 50 {FRICTIONLESS} zplane 0 NULL\nfix grav"
    )
    # The fixes of the warnings, by how spheres are poured. A dynamic group takes them in.
    both, small, large = "group small type 1\ngroup large type 2\n", "fix p1 small", "fix p2 large"
    texts = {
        POURED: [],
        both + walls: ["p1", "p2"],
        both + walls.replace("fix p1 all", small): ["p2"],
        both + walls.replace("fix p1 all", small).replace("fix p2 all", large): [],
        both.replace("small type 1", "small dynamic all every 1") + walls.replace("fix p2 all", large): [],
    }
    for text, fixes in texts.items():
        warnings = deck_of(tmp_path, text).warnings
        assert [words.split()[1] for words in warnings] == fixes
        assert all("fall through the wall" in words for words in warnings)


def test_defaults_are_warned_of(tmp_path):
    deck = deck_of(tmp_path, POURED.replace("dens 2500 2500", "").replace("units si", ""))
    *pours, units = deck.warnings
    assert [text.split("(")[0] + text.split(")")[1] for text in pours] == [
        "fix pour  has no dens: the default density is 1"
    ] * 2
    assert units == "the file has no units: the default is lj"
    said = DeckOptions(densities={"1": 2500, "2": 2500})
    assert deck_of(tmp_path, POURED.replace("dens 2500 2500", ""), said).warnings == ()
    assert deck_of(tmp_path, POURED.replace("fix p1", "create_atoms 2 box\nfix p1")).warnings == (
        "spheres of type 2 have the default diameter 1 and density 1",
    )


LIGGGHTS = """
atom_style granular
atom_modify map array
boundary f f f
newton off
communicate single vel yes
soft_particles yes
units si
region all block -1 1 -1 1 -1 1 units box
create_box 3 all
neighbor 0.01 bin
neigh_modify delay 0
variable e index 0.5
fix m1 all property/global youngsModulus peratomtype 1e7 3e6 2e7
fix m2 all property/global poissonsRatio peratomtype 0.3 0.4 0.2
fix m3 all property/global coefficientRestitution peratomtypepair 3 &
    0.6 ${e} 0.7 &
    ${e} 0.3 0.8 &
    0.7 0.8 0.9
pair_style gran model hertz tangential off limitForce on
pair_coeff * *
include spheres
fix move all nve/sphere
fix floor all wall/gran model hertz tangential off primitive type 3 zplane 0
fix fall all gravity 9.81 vector 0 0 -1
timestep 1e-6
run 12000
"""


def test_contacts_are_those_of_liggghts(tmp_path):
    need("liggghts")
    deck = deck_of(tmp_path, LIGGGHTS)
    (run,) = deck.runs
    assert deck.program.name == "liggghts"
    assert [contact.settings["coefficientRestitution"] for contact in run.contacts] == [
        "0.6",
        "0.5",
        "0.3",
        "0.7",
        "0.8",
    ]
    for contact in run.contacts:
        for sizes in contact.sizes:
            gravity = run.gravity if contact.falls else 0.0
            spheres = spheres_of(contact, sizes, run.step, gravity, 0) + "create_atoms 1 single 0.5 0.5 0.5\n"
            printed = liggghts_run(LIGGGHTS, spheres=spheres)  # it needs an atom of type 1
            epsilon = expected_epsilon(deck, run, contact, sizes)
            assert measured_epsilon(printed, gravity) == pytest.approx(epsilon, abs=1e-9), contact.name


# Decks of the commands in examples of both programs, written anew; by name of a contact: line, settings, radii.

DRUM = """
variable name string two_types
atom_style sphere
variable width equal 24
variable low equal 0.2
variable small equal 2.0*${low}
region box block 0 ${width} 0 ${width} 0 40
create_box 2 box
change_box all boundary p p f
variable angle equal 0
region side cylinder z 12 12 $(v_width/2) 0 20 side in rotate v_angle 12 12 0 0 0 1
region bottom plane 12 12 0 0 0 1 side in
fix pour1 all pour 100 1 4711 region box diam range ${small} 0.8 dens 1.0 1.0
fix pour2 all pour 100 2 4711 region box diam range ${small} 0.8 dens 1.0 1.0
pair_style granular
pair_coeff 1 * hertz/material 1e5 0.2 0.3 tangential mindlin NULL 1.0 0.5 damping tsuji
pair_coeff 2 2 mdr 1e5 0.3 1e3 0.1 0.5 0.2 damping mdr 1 tangential linear_history 10 1.0 0.5 rolling sds 1e3 1 0.1
fix 3 all wall/gran/region granular hertz/material 1e5 0.1 0.3 tangential mindlin NULL 1 0.5 damping tsuji region side
fix down all gravity 10 vector 0 0 -1
timestep 0.001
compute 1 all property/atom radius
variable top atom z+c_1>0.5*20
group high dynamic all var top every 1000
run 2000
delete_atoms group high
fix 4 all wall/gran/region granular hertz/material 1e5 0.1 0.3 tangential mindlin NULL 1 0.5 damping tsuji region bottom
variable angle equal 2*PI*elapsed/20000.0
run 3000
"""
POUR = """
dimension 2
atom_style sphere
region box block 0 100 0 50 -0.5 0.5 units box
create_box 1 box
pair_style gran/hertz/history 4000.0 NULL 100.0 NULL 0.5 0
pair_coeff * *
timestep 0.001
fix 1 all nve/sphere
fix 2 all gravity 1.0 spherical 0.0 -180.0
fix sides all wall/gran hertz/history 4000.0 NULL 80.0 NULL 0 1 &
    xplane 0 100
region slab block 1 99 30 34.5 -0.5 0.5 units box
fix ins all pour 1000 1 4767548 vol 0.4 10 &
    diam range 0.5 1.0 region slab
fix 3 all enforce2d
run 25000
unfix ins
fix 2 all gravity 2.0 chute 26.0
run 25000
"""
COLLISION = """
units si
atom_style sphere
comm_modify vel yes
create_box 2 box
create_atoms 1 single 0.0 0.0 0.04
create_atoms 1 single 0.0 0.0 0.04416
set group all diameter 0.004 density 2500
pair_style granular
pair_coeff * * hertz/material 1e6 0.8 0.4 &
    tangential mindlin NULL 0.0 0.5 &
    damping coeff_restitution
#pair_coeff * * hooke 1e6 0.5 &
#    damping coeff_restitution
timestep 1e-9
group first id 1
velocity first set 0 0 1.0
compute z1 first reduce sum z
variable dz equal c_z1
thermo_style custom step ke v_dz
run 1000000
"""
CHUTE = """
atom_style granular
communicate single vel yes
units si
create_box 2 domain
fix m1 all property/global youngsModulus peratomtype 5.e6 1e8
fix m2 all property/global poissonsRatio peratomtype 0.45 0.2
fix m3 all property/global coefficientRestitution peratomtypepair 2 0.3 0.4 0.4 0.9
pair_style gran model hertz tangential history #no cohesion
pair_coeff * *
timestep 0.00001
fix down all gravity 9.81 vector 0.0 0.0 -1.0
fix chute all mesh/surface/stress file chute.stl type 2 wear finnie
fix face all mesh/surface file face.stl type 1
fix walls all wall/gran model hertz tangential history mesh n_meshes 1 meshes chute
fix top all wall/gran model hertz tangential history cohesion sjkr primitive type 2 zplane 0.15
fix small all particletemplate/sphere 15485863 atom_type 1 density constant 2500 radius constant 0.0015
fix large all particletemplate/sphere 15485867 atom_type 1 density constant 2500 radius uniform 0.002 0.0025
fix mixture all particledistribution/discrete 32452843 2 small 0.3 large 0.7
fix ins all insert/stream seed 32452867 distributiontemplate mixture &
    nparticles 6000 massrate 0.1 insertion_face face
fix grow all adapt 40 atom diameter v_grown
run 1
dump dmp all custom/vtk 200 post/chute_*.vtk id type
run 100000 upto
"""


def radii(contact):
    return [tuple(round(size.radius, 6) for size in pair if size) for pair in contact.sizes]


def test_a_drum_of_two_types(tmp_path):
    deck = deck_of(tmp_path, DRUM)
    first, second = deck.runs
    assert (first.line.number, second.line.number) == (24, 28)
    by_name = {contact.name: contact for contact in first.contacts}
    assert [*by_name] == [
        *("type 1 - type 1", "type 1 - type 2", "type 2 - type 2"),
        "type 1 - wall 3",
        "type 2 - wall 3",
    ]
    assert by_name["type 1 - type 2"].settings["coefficients"] == "1e5 0.2 0.3"
    assert by_name["type 2 - type 2"].reason == "the normal model mdr is not computed here"
    assert by_name["type 2 - type 2"].line.number == 17
    assert radii(by_name["type 1 - type 1"]) == [(0.2, 0.2), (0.2, 0.4), (0.4, 0.4)]
    # A cylinder of radius 12 has the curvature -24: 0.2*24/(24 - 0.2), 0.4*24/(24 - 0.4).
    assert radii(by_name["type 1 - wall 3"]) == [(0.201681,), (0.40678,)]
    assert {contact.name for contact in second.contacts} - set(by_name) == {"type 1 - wall 4", "type 2 - wall 4"}
    assert [line.text for line in deck.unread] == ["delete_atoms group high"]
    assert by_name["type 2 - wall 3"].lines_with({"coefficients": "1e5 0.25 0.3"}) == (
        "fix 3 all wall/gran/region granular hertz/material 1e5 0.25 0.3 tangential mindlin NULL 1 0.5 damping tsuji "
        "region side",
    )


def test_pouring_in_two_dimensions(tmp_path):
    deck = deck_of(tmp_path, POUR)
    assert [(run.line.number, run.step, run.gravity) for run in deck.runs] == [(17, 1e-3, 1.0), (20, 1e-3, 2.0)]
    pair, wall = deck.runs[0].contacts
    assert pair.settings == {
        "normal": "hertz",
        "coefficients": "4000.0 100.0",
        "damping": "viscoelastic",
        "limit_damping": "no",
        "units": "lj",
    }
    assert (wall.settings["coefficients"], wall.line.number) == ("4000.0 80.0", 11)
    # LAMMPS gives spheres to pour in two dimensions the mass of spheres: pi/6 d^3.
    masses = [tuple(round(size.mass, 6) for size in sizes if size) for sizes in wall.sizes]
    assert masses == [(0.06545,), (0.523599,)]
    assert pair.lines_with({"coefficients": "4000 120"}) == ("pair_style gran/hertz/history 4000 NULL 120 NULL 0.5 0",)


@pytest.mark.parametrize(
    ("commands", "presses"),
    [
        ("fix g all gravity 1 vector 0 0 -1", (0, 0, 1, 0)),
        ("fix g all gravity 1 vector 1 0 -1", (0.5**0.5, 0, 0.5**0.5, 0.5)),
        ("fix g all gravity -1 vector 0 0 1", (0, 0, 1, 0)),
        ("fix g all gravity 1 chute 26", (0.438371147, 0, 0.898794046, 0.309975211)),
        ("fix g all gravity 1 chute 0", (0, 0, 1, 0)),
        ("fix g all gravity 1 spherical 0 180", (0, 0, 1, 0)),
        ("fix g all gravity 1 spherical 90 90", (0, 1, 0, 0.5**0.5)),
        ("dimension 2\nfix g all gravity 1 spherical 0 -180", (0, 1, 0, 0.5**0.5)),
    ],
)
def test_the_part_of_the_weight_along_a_normal_presses(tmp_path, commands, presses):
    """It is the cosine. The fourth wall is a plane with the normal (1, 1, 0)."""
    walls = "region p plane 0 0 0 1 1 0\n" + "".join(
        f"fix {name} all wall/gran granular hooke 1 1 {shape}\n"
        for name, shape in [("x", "xplane 0 1"), ("y", "yplane 0 1"), ("z", "zplane 0 1"), ("r", "region p")]
    )
    (run,) = deck_of(tmp_path, f"create_atoms 1 box\n{commands}\n{walls}run 1\n").runs
    contacts, acceleration = run.contacts, run.gravity
    assert acceleration == 1
    # Walls on which the same part of the weight presses are one contact.
    names = [contact.name.removeprefix("type 1 - wall ").split(", ") for contact in contacts]
    assert [contact.count for contact in contacts] == [len(walls) for walls in names]
    falls = {wall: contact.falls for walls, contact in zip(names, contacts, strict=True) for wall in walls}
    assert tuple(falls[wall] for wall in "xyzr") == pytest.approx(presses, abs=2e-9)
    assert len(contacts) == len(set(presses))


def test_a_collision_of_two_atoms(tmp_path):
    deck = deck_of(tmp_path, COLLISION)
    ((contact,),) = [run.contacts for run in deck.runs]
    assert radii(contact) == [(0.002, 0.002)]
    assert contact.sizes[0][0].mass == pytest.approx(math.pi / 6 * 0.004**3 * 2500)
    assert (deck.unread, deck.warnings, contact.line.number) == ((), (), 10)


def test_a_chute_of_liggghts(tmp_path):
    deck = deck_of(tmp_path, CHUTE)
    ((pair, chute, top),) = [run.contacts for run in deck.runs]
    assert radii(pair) == [
        (0.0015,) * 2,
        (0.0015, 0.002),
        (0.0015, 0.0025),
        (0.002,) * 2,
        (0.002, 0.0025),
        (0.0025,) * 2,
    ]
    assert chute.name == "type 1 - wall chute"
    assert chute.settings == {
        "model": "hertz",
        "limitForce": "off",
        "youngsModulus": "5000000 100000000",
        "poissonsRatio": "0.45 0.2",
        "coefficientRestitution": "0.4",
    }
    assert top.reason == "cohesion sjkr: not computed here"
    assert ["fix adapt" in text for text in deck.warnings] == [True]
    line = "fix m3 all property/global coefficientRestitution peratomtypepair 2 0.3 0.25 0.25 0.9"
    assert chute.lines_with({"coefficientRestitution": "0.25"}) == (line,)


def test_walls_of_other_types_have_other_numbers_to_write(tmp_path):
    matrix = "fix e all property/global coefficientRestitution peratomtypepair 3"
    text = "units si\ncreate_box 3 b\ncreate_atoms 1 b\n"
    text += "fix y all property/global youngsModulus peratomtype 5e6 5e6 5e6\n"
    text += "fix p all property/global poissonsRatio peratomtype 0.3 0.3 0.3\n"
    text += f"{matrix} 0.9 0.7 0.7 0.7 1 1 0.7 1 1\npair_style gran model hertz\n"
    for name, number in (("w1", 2), ("w2", 3), ("w3", 2)):
        text += f"fix {name} all wall/gran model hertz primitive type {number} zplane 0\n"
    _, both, other = deck_of(tmp_path, f"{text}run 1\n").runs[0].contacts
    assert (both.name, other.name) == ("type 1 - wall w1, w3", "type 1 - wall w2")
    assert both.lines_with({"coefficientRestitution": "0.5"}) == (f"{matrix} 0.9 0.5 0.7 0.5 1 1 0.7 1 1",)
    assert other.lines_with({"coefficientRestitution": "0.5"}) == (f"{matrix} 0.9 0.7 0.5 0.7 1 1 0.5 1 1",)


def test_numbers_of_liggghts_in_cgs_are_in_si_units(tmp_path):
    """1 dyn/cm^2 is 0.1 Pa; 1/(cm s) is 100/(m s)."""
    text = "units cgs\ncreate_box 1 b\nfix 1 all property/global kn peratomtypepair 1 4e8\n"
    text += (
        "fix 2 all property/global gamman peratomtypepair 1 30\npair_style gran model hertz/stiffness tangential off\n"
    )
    deck = deck_of(tmp_path, f"{text}create_atoms 1 single 0 0 0\n")
    contact = deck.runs[0].contacts[0]
    assert (float(contact.settings["kn"]), float(contact.settings["gamman"])) == (4e7, 3000)
    assert contact.lines_with({"gamman": "4000"}) == ("fix 2 all property/global gamman peratomtypepair 1 40",)
    assert contact.sizes[0][0].mass == pytest.approx(math.pi / 6)  # the default sphere, in the units of the file


# What a file says of spheres.

GRANULAR = "pair_style granular\npair_coeff * * hooke 1e4 50 tangential linear_nohistory 0 0\nrun 1\n"


@pytest.mark.parametrize(
    ("commands", "expected"),
    [
        ("create_atoms 1 box", {1: [(0.5, 1)]}),
        ("create_atoms 1 box\nset type 1 diameter 4", {1: [(2, 1 / 64)]}),  # the mass stays
        ("create_atoms 1 box\nset type 1 diameter 4 density 2", {1: [(2, 2)]}),
        ("create_atoms 1 box\nset type * density 2", {1: [(0.5, 2)]}),
        ("create_atoms 1 box\nset group all mass 2", {1: [(0.5, 2 / (math.pi / 6))]}),
        ("create_atoms 1 box\nset group all density/disc 2", {1: [(0.5, 3)]}),  # 2 pi r^2 = 4/3 pi r^3 3
        (
            "create_atoms 1 box\nset type 1 type/fraction 2 0.5 17\nset type 2 diameter 2 density 1",
            {1: [(0.5, 1)], 2: [(1, 1)]},
        ),
        ("create_atoms 1 box\nset type 1 type 2", {2: [(0.5, 1)]}),
        ("create_atoms 1 box\nset region r diameter 2\nset region r density 3", {1: [(0.5, 1), (1, 3)]}),
        ("create_atoms 1 box\ngroup g type 1\nset group g density 3", {1: [(0.5, 3)]}),
        ("fix i all pour 9 2 17 region r diam one 0.4 dens 3 3", {2: [(0.2, 3)]}),
        ("fix i all pour 9 1 17 region r diam poly 2 0.4 0.5 0.6 0.5", {1: [(0.2, 1), (0.3, 1)]}),
        ("fix i all pour 9 1 17 vol 0.7 9 diam 0.4 0.6 dens 2 4 region r", {1: [(0.2, 2), (0.3, 4)]}),
        ("fix i all deposit 9 2 10 17 region r", {2: [(0.5, 1)]}),
        ("read_data data", {1: [(0.25, 2)], 3: [(1, 5)]}),
    ],
)
def test_commands_make_spheres(tmp_path, commands, expected):
    data = "spheres\n\n3 atom types\n\nAtoms # sphere\n\n1 1 0.5 2 0 0 0\n2 3 2 5 1 1 1 0 0 0\n"
    data += "\nVelocities\n\n1 0 0 0 0 0 0\n"
    text = f"atom_style sphere\ncreate_box 2 b\n{commands}\n{GRANULAR}"
    contacts = deck_of(tmp_path, text, data=data).runs[0].contacts
    spheres = {}
    for contact in contacts:
        first, second = contact.name.split(" - ")
        if first == second:
            sizes = dict.fromkeys(size for pair in contact.sizes for size in pair)
            spheres[int(first.split()[1])] = [(r, m / (4 / 3 * math.pi * r**3)) for r, m in sizes]
    assert spheres == {number: [pytest.approx(pair) for pair in pairs] for number, pairs in expected.items()}


@pytest.mark.parametrize(
    ("old", "new", "warning"),
    [
        ("units si", "units micro", "spheres of type 2 have 2.5e+06 kg/m^3: check density and units"),
        ("pair_style granular\n", "", "pair_coeff (in.deck:14) has no pair_style before it: it is read as granular"),
        ("create_box 2", "create_box 1", "there is a type 2, and create_box has types up to 1: LAMMPS stops"),
    ],
)
def test_what_cannot_be_meant_is_warned_of(tmp_path, old, new, warning):
    assert not deck_of(tmp_path, POURED).warnings
    assert any(text.startswith(warning) for text in deck_of(tmp_path, POURED.replace(old, new)).warnings)


def test_everything_that_is_missing_is_named_at_once(tmp_path):
    text = "units si\nread_restart old\npair_style granular\n"
    text += "pair_coeff 1 1 hooke ${k} $e tangential linear_nohistory 0 0\n"
    text += "pair_coeff 2 2 hooke $(2*v_k) 1 tangential linear_nohistory 0 0\ntimestep $t\nrun ${steps}\n"
    deck = deck_of(tmp_path, text)
    spheres = (
        "the radius of type 1 (--radius 1=0.5mm)",
        "the density of type 1 (--density 1=2500)",
        "the radius of type 2 (--radius 2=0.5mm)",
        "the density of type 2 (--density 2=2500)",
    )
    assert deck.missing == (
        "the value of the variable k (--variable k=VALUE), needed in in.deck:4",
        "the value of the variable e (--variable e=VALUE), needed in in.deck:4",
        "the value of the variable t (--variable t=VALUE), needed in in.deck:6",
        *spheres,
    )
    said = DeckOptions({"k": "1e4", "e": "50", "t": "1e-6"})
    assert deck_of(tmp_path, text, said).missing == spheres
    said = DeckOptions(said.variables, {"1": (1e-3, 2e-3), "2": (4e-3,)}, {"1": 2500.0, "2": 1000.0})
    deck = deck_of(tmp_path, text.replace("units si", "units cgs"), said)
    one, mixed, two = deck.runs[0].contacts
    assert not deck.missing
    assert two.settings["coefficients"] == "20000 1"
    assert radii(mixed) == [(0.1, 0.4), (0.2, 0.4)]  # in cm
    assert two.sizes[0][0].mass == pytest.approx(4 / 3 * math.pi * 0.4**3)  # 1 g/cm^3
    assert radii(one) == [(0.1, 0.1), (0.1, 0.2), (0.2, 0.2)]


def test_a_model_that_is_not_computed_needs_no_size(tmp_path):
    text = "create_box 1 b\nread_restart old\npair_style granular\n"
    text += "pair_coeff * * mdr 1e5 0.3 1e3 0.1 0.5 0.2 damping mdr 1\nrun 1\n"
    deck = deck_of(tmp_path, text)
    assert (deck.missing, deck.runs[0].contacts[0].reason) == ((), "the normal model mdr is not computed here")


@pytest.mark.parametrize(
    ("lines", "reason"),
    [
        ("pair_coeff 1 1 hooke 1 1 tangential linear_nohistory 0 0\n"
         "pair_coeff 2 2 hertz 1 1 tangential linear_nohistory 0 0",
         "LAMMPS does not mix hooke with hertz: expected a line pair_coeff 1 2"),
        ("pair_coeff 1 1 hooke 1 1 tangential linear_nohistory 0 0 damping velocity\n"
         "pair_coeff 2 2 hooke 1 1 tangential linear_nohistory 0 0",
         "LAMMPS does not mix velocity with viscoelastic: expected a line pair_coeff 1 2"),
        ("pair_coeff 1 1 hooke 1 1 tangential linear_nohistory 0 0", "it has no pair_coeff"),
    ],
)  # fmt: skip
def test_what_lammps_does_not_mix_is_a_row_without_a_number(tmp_path, lines, reason):
    text = f"create_atoms 1 box\ncreate_atoms 2 box\npair_style granular\n{lines}\nrun 1"
    contacts = deck_of(tmp_path, text).runs[0].contacts
    assert {contact.name: contact.reason for contact in contacts}["type 1 - type 2"] == reason


TWO_SUBSTYLES = "pair_style hybrid gran/hooke 1e4 NULL 50 NULL 0 0 gran/hooke/omp 1e4 NULL 500 NULL 0 0 granular\n"


@pytest.mark.parametrize(
    ("lines", "expected"),
    [
        # A second group adds to the first (LAMMPS 22 Jul 2025 counts both); a region may have all types.
        ("group a type 1\ngroup a type 2\nfix w a wall/gran hooke 1 NULL 9 NULL 0 0 zplane 0 NULL",
         {"type 1 - wall w": "1 9", "type 2 - wall w": "1 9"}),
        ("group a region r\ngroup a type 2\nfix w a wall/gran hooke 1 NULL 9 NULL 0 0 zplane 0 NULL",
         {"type 1 - wall w": "1 9", "type 2 - wall w": "1 9"}),
        # eps of these pairs in LAMMPS: 0.9448 and 0.5611
        (f"{TWO_SUBSTYLES}pair_coeff 1 1 gran/hooke 1\npair_coeff * 2 gran/hooke 2",
         {"type 1 - type 1": "1e4 50", "type 1 - type 2": "1e4 500", "type 2 - type 2": "1e4 500"}),
        # Mixed as one sub-style.
        (f"{TWO_SUBSTYLES}pair_coeff 1 1 gran/hooke 1\npair_coeff 2 2 gran/hooke 1",
         {"type 1 - type 1": "1e4 50", "type 1 - type 2": "1e4 50", "type 2 - type 2": "1e4 50"}),
        ("pair_style gran/hertz/history/kk 1 NULL 2 NULL 0 0\npair_coeff * *",
         {"type 1 - type 1": "1 2", "type 1 - type 2": "1 2", "type 2 - type 2": "1 2"}),
    ],
)  # fmt: skip
@pytest.mark.parametrize("mark", ["", "\ufeff"])
def test_groups_and_substyles(tmp_path, lines, expected, mark):
    deck = deck_of(tmp_path, f"{mark}units si\ncreate_atoms 1 box\ncreate_atoms 2 box\n{lines}\nrun 1\n")
    (run,) = deck.runs
    assert {contact.name: contact.settings["coefficients"] for contact in run.contacts} == expected
    assert {contact.settings["units"] for contact in run.contacts} == {"si"}
    assert not deck.unread
    written = [contact.lines_with({"coefficients": "3 4"}) for contact in run.contacts]
    assert all(line.startswith(("pair_style", "group", "fix")) for lines in written for line in lines)


def test_a_region_may_change_between_runs(tmp_path):
    text = "create_atoms 1 box\nregion r cylinder z 0 0 5 0 9 side in\n"
    text += "fix w all wall/gran/region hertz/history 1 NULL 9 NULL 0 0 region r\nrun 1\n"
    text += "region r delete\nregion r block 0 9 0 9 0 9\nrun 2\n"
    # R_eff = R R_wall/(R_wall - R), with 2*5 for R_wall
    assert [radii(run.contacts[0]) for run in deck_of(tmp_path, text).runs] == [[(0.526316,)], [(0.5,)]]


# Pasted lines.


@pytest.mark.parametrize(
    ("line", "settings"),
    [
        ("pair_coeff 1 1 hertz/material 1e6 0.8 0.4 tangential mindlin NULL 0 0.5 &\n damping coeff_restitution # g",
         ("hertz/material", "1e6 0.8 0.4", "coeff_restitution", "no")),
        ("pair_coeff * * granular hooke 10 0.5 limit_damping", ("hooke", "10 0.5", "viscoelastic", "yes")),
        ("fix 3 all wall/gran granular hertz 10 0.5 tangential linear_nohistory 0 0 damping velocity zplane 0 NULL",
         ("hertz", "10 0.5", "velocity", "no")),
        ("fix 3 all wall/gran/region hooke/history 4e3 NULL 100 NULL 0.5 1 limit_damping region r",
         ("hooke", "4e3 100", "mass_velocity", "yes")),
        ("pair_style gran/hertz/history 2e5 NULL 500 NULL 0.5 1", ("hertz", "2e5 500", "viscoelastic", "no")),
        ("pair_style gran model hertz tangential history limitForce on", ("hertz", "on")),
        ("fix z all wall/gran model hooke tangential history primitive type 1 zplane 0", ("hooke", "off")),
        ("fix z all wall/gran/hertz/history 1 0 zplane 0 1 1", ("hertz", "off")),
    ],
)  # fmt: skip
def test_a_pasted_line_says_a_contact(line, settings):
    assert tuple(line_settings(line).values()) == settings


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("pair_coeff 1 1 hoke 1 2", "'hoke' is no normal model: expected hooke, hertz, "),
        ("pair_coeff 1 1 hooke 1", "hooke has 1 numbers: expected 2"),
        ("pair_coeff 1 1 hooke 1 2 tangential mindlin NULL 1", "tangential mindlin has 2 numbers: expected 3"),
        ("pair_coeff 1 1 hertz/material 1e7 0.6 damping tsuji", "hertz/material has 2 numbers: expected 3"),
        ("pair_coeff 1 1 hooke 1 x", "a coefficient of hooke is 'x': expected a number >= 0"),
        ("pair_coeff 1 1 hooke 1 2 damping fast", "damping is 'fast': expected velocity, "),
        ("pair_coeff 1 1 hooke 1 2 sticky", "'sticky' is not known after hooke: expected damping, "),
        ("pair_coeff 1 1 hooke ${k} 2", "the value of the variable k is missing: expected a line without variables"),
        ("pair_coeff 1 1 mdr 1e5 0.3 1e3 0.1 0.5 0.2 damping mdr 1", "the normal model mdr is not computed here"),
        ("pair_coeff 1 1 hooke 1 0 damping none", "the damping model none is not computed here"),
        ("pair_coeff 1 1 hooke 1 0.5 damping tsuji synchronized_verlet", "the steps of synchronized_verlet are not"),
        ("pair_style gran model hertz cohesion sjkr2", "cohesion sjkr2: not computed here"),
        (
            "pair_style gran model luding surface multicontact",
            "model luding and surface multicontact: not computed here",
        ),
        ("timestep 1", "'timestep 1' is no line of a contact: expected pair_coeff"),
        ("", "'' is no line of a contact: expected pair_coeff"),
        ('pair_coeff "1', "a quote has no end: expected a second one"),
    ],
)
def test_a_wrong_pasted_line_is_refused(line, message):
    with pytest.raises(ValueError) as error:
        line_settings(line)
    assert str(error.value).startswith(message)


# Hostile files.

CONTACT = (
    "create_atoms 1 box\npair_style granular\npair_coeff * * hooke 1e4 $x tangential linear_nohistory 0 0\nrun 1\n"
)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("variable x equal v_x+1\n", "in.deck:4: the variable x refers to itself"),
        ("variable x equal v_y\nvariable y equal v_x\n", "in.deck:5: the variable x refers to itself"),
        ("include in.deck\n", "in.deck:1: in.deck includes itself"),
        ("include more\n", "in.deck:1: more:1: in.deck includes itself"),
        ("variable x equal 1/0\n", "in.deck:4: "),
        ("variable x equal 2*(3\n", "in.deck:4: '2*(3' is no formula"),
        ("variable x equal 2**3\n", "in.deck:4: '2**3' is no formula"),
        (f"variable x equal {'(' * 9000}1{')' * 9000}\n", "in.deck:4: '((((((((((("),
        ("variable x index 5\njump SELF end\n", "in.deck:3: the jump in in.deck:2, which is not done here, decides"),
        ("variable x index 5\nif '$x > 3' then 'jump SELF end'\n", "in.deck:3: the jump in in.deck:2"),
        ("if '$a > 3' then 'pair_style granular'\n", "in.deck:1: an if, which is not computed here, decides"),
        ("variable x index 5 6\nlabel loop\n" + CONTACT + "next x\njump SELF loop\n",
         "in.deck:7: next changes x of line 5: expected --variable x=VALUE"),
        ("variable x index five\n", "in.deck:4: a coefficient of hooke is 'five': expected a number >= 0"),
        ("variable x index '5 6 7'\n", "in.deck:4: '6' is not known after hooke"),
        ("units metal\n", "in.deck:1: units is 'metal': expected lj, si, cgs, micro, nano"),
        ("group a\n", "in.deck:1: group has too few words"),
        ("create_box 1000000000 b\npair_style gran/hooke 1 1 1 1 1 0\nrun 1\n",
         "in.deck:3: there are more than 100 types with spheres: expected fewer"),
        ("create_box 1000000000 b\nread_restart r\n", "in.deck:2: there are 1000000000 types: expected at most 1000"),
        ("create_atoms 1 b\nset type 1 diameter 0\npair_style gran/hooke 1 1 1 1 1 0\nrun 1\n",
         "in.deck:4: a sphere of type 1 has no size or no mass: expected a radius and a density > 0"),
        ("timestep 0\n", "in.deck:1: timestep is 0: expected a number > 0"),
        ("timestep\n", "in.deck:1: timestep has too few words"),
        ("timestep soon\n", "in.deck:1: the number is 'soon': expected one such as 1e-5"),
        ("pair_coeff A B hooke 1 1\n", "in.deck:1: the type is 'A': expected a number, or a range such as 1*3"),
        ("variable x string 'a\n", "in.deck:1: a quote has no end"),
    ],
)  # fmt: skip
def test_a_hostile_file_is_refused_in_one_line(tmp_path, text, message):
    with pytest.raises(ValueError) as error:
        deck_of(tmp_path, text + CONTACT, more="include in.deck\n")
    assert str(error.value).startswith(message)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("style", ["getenv HOME", "python f", "loop 5", "file numbers", "atom x", "world 1 2"])
def test_variables_that_need_a_run_or_a_shell_are_missing(tmp_path, style):
    deck = deck_of(tmp_path, f"variable x {style}\n{CONTACT}")
    option = "(--variable x=VALUE)"
    assert deck.missing == (
        f"the value of the variable x, of style {style.split()[0]} in line 1 {option}, needed in in.deck:4",
    )
    assert not deck_of(tmp_path, f"variable x {style}\n{CONTACT}", DeckOptions({"x": "5"})).missing


def test_nothing_of_a_file_is_run(tmp_path):
    text = f"shell touch {tmp_path}/made\nvariable y getenv HOME\nprint $(v_z)\npython f file f.py\n"
    text += f"variable x index 5\n{CONTACT}"
    deck = deck_of(tmp_path, text + "label end\nif 'a == b' then 'run 5'\njump SELF end\n")
    assert not (tmp_path / "made").exists()
    assert not deck.missing
    assert [line.text.split()[0] for line in deck.unread] == ["shell", "python", "if", "jump"]
    deck = deck_of(tmp_path, text.replace("run 1", "run 9 every 3 'pair_coeff 1 1 hooke 1 1'"))
    assert deck.warnings[0] == "run … every (in.deck:9): its commands are not read"


def test_a_formula_of_a_run_is_asked_for_only_where_a_contact_needs_it(tmp_path):
    deck = deck_of(
        tmp_path, f"variable x equal 2*step\nvariable y equal lx\nregion r block 0 ${{y}} 0 1 0 1\n{CONTACT}"
    )
    needs = "the value of the variable x (--variable x=VALUE): step is known only in a run, needed in in.deck:6"
    assert deck.missing == (needs,)


def test_a_gravity_of_a_run_is_asked_for(tmp_path):
    text = f"variable x index 5\nvariable g equal ramp(0,9.81)\nfix g all gravity v_g vector 0 0 -1\n{CONTACT}"
    needs = "the value of the variable g (--variable g=VALUE): ramp is known only in a run"
    assert deck_of(tmp_path, text).missing == deck_of(tmp_path, text.replace("run 1\n", "")).missing == (needs,)
    with pytest.raises(ValueError, match=r"in\.deck:7: run has too few words"):
        deck_of(tmp_path, text.replace(" v_g vector 0 0 -1", "").replace("run 1\n", ""))


def test_options_need_an_effect(tmp_path):
    for said, message in (
        (DeckOptions({"q": "1", "x": "2"}), "has no variable q"),
        (DeckOptions({"x": "2"}, {"7": (1e-3,)}), "has no type 7: expected 1"),
    ):
        with pytest.raises(ValueError, match=message):
            deck_of(tmp_path, f"units si\n{CONTACT}", said)


def test_a_file_without_contacts_is_refused(tmp_path):
    with pytest.raises(ValueError, match="has no contact: expected an input of LAMMPS or LIGGGHTS with pair_style"):
        deck_of(tmp_path, "units si\nrun 5\n")


def test_a_million_lines_are_read_in_seconds(tmp_path):
    lines = "# a comment\nvariable y equal 2*PI\nprint 'hello $y'\nset type 1 density 1\n" * 250_000
    start = time.process_time()
    deck = deck_of(tmp_path, f"variable x index 5\n{CONTACT}{lines}run 1\n")
    assert len(deck.runs) == 1
    assert time.process_time() - start < 60


def test_a_chain_of_doubled_variables_ends(tmp_path):
    """2^60 evaluations, unless each variable is computed once; and texts of 2^60 characters."""
    numbers = "variable x0 equal 1\n" + "".join(f"variable x{i + 1} equal v_x{i}+v_x{i}\n" for i in range(60))
    deck = deck_of(tmp_path, f"{numbers}variable x equal v_x60\n{CONTACT}")
    assert deck.runs[0].contacts[0].settings["coefficients"].startswith("1e4 1.1529215046068")
    texts = "variable x0 string 1\n" + "".join(f"variable x{i + 1} string ${{x{i}}}${{x{i}}}\n" for i in range(60))
    with pytest.raises(ValueError, match=r"the line has [0-9]+ characters: expected at most 100000"):
        deck_of(tmp_path, f"{texts}{CONTACT}")


def test_a_run_is_noted_only_if_it_differs(tmp_path):
    text = CONTACT.replace("$x", "5")
    text += "run 2\ntimestep 0.001\nrun 3\ntimestep 0.001\nrun 4\n"
    text += "fix w all wall/gran granular hooke 1 1 zplane 0 1\nrun 5\nunfix w\n"
    deck = deck_of(tmp_path, text + "run 6\nclear\ncreate_box 1 b\nrun 7\n")
    assert [run.line.text for run in deck.runs] == ["run 1", "run 3", "run 5", "run 6"]
    assert [len(run.contacts) for run in deck.runs] == [1, 1, 2, 1]
    assert deck_of(tmp_path, text.replace("run", "#")).runs[0].line is None


def test_the_contacts_of_a_run_in_an_if_are_shown(tmp_path):
    """The run may happen: its contacts must not be lost because the next line changes them."""
    changed = CONTACT.replace("$x", "5").replace(
        "run 1", "if 'a == b' then 'run 5'\npair_coeff * * hooke 1e4 9 tangential linear_nohistory 0 0\nrun 1"
    )
    coefficients = [run.contacts[0].settings["coefficients"] for run in deck_of(tmp_path, changed).runs]
    assert coefficients == ["1e4 5", "1e4 9"]
    with pytest.raises(ValueError, match="an if without then"):
        deck_of(tmp_path, f"if 'a == b'\n{CONTACT}")


def test_a_million_atoms_of_read_data_are_a_range(tmp_path):
    rows = "\n".join(f"{i} 1 {1 + i / 1e3!r} 2.5 0 0 0" for i in range(1, 1001))
    text = f"atom_style sphere\nread_data data\n{CONTACT.replace('$x', '5').replace('create_atoms 1 box', '')}"
    deck = deck_of(tmp_path, text, data=f"a\n\n1 atom types\n\nAtoms\n\n{rows}\n")
    assert radii(deck.runs[0].contacts[0]) == [(0.5005,) * 2, (0.5005, 1.0), (1.0,) * 2]


# Formulas, as LAMMPS computes them.

FORMULAS = (
    *("-2^2", "2^3^2", "2-3-4", "8/4/2", "-v_a*3", "2*-3", "!0+1", "1+2*3^2", "(1+2)*3", "10%4", "1.5e3+.5", "2^-1"),
    *("sqrt(2)*PI", "ln(10)", "log(1000)", "exp(1)", "abs(-3)", "sin(1)+cos(1)+tan(1)", "atan(1)", "ceil(1.2)"),
    *("floor(-1.2)", "round(2.5)", "round(-2.5)", "1<2", "(1<2)+(2<=2)+(3>4)+(4>=4)", "1==1", "1!=1", "1&&0||1"),
    *("1|^1", "ternary(1>2,5,6)", "v_b+v_c", "-(-(3))", "2+3 > 4"),
)


def test_formulas_are_those_of_lammps(tmp_path):
    need("lammps")
    definitions = "variable a equal 3\nvariable b equal v_a^2\nvariable c string 7\n"
    prints = "".join(f'variable f equal "{text}"\nprint "value $(v_f:%.15e)"\n' for text in FORMULAS)
    values = [line.split()[1] for line in lammps(definitions + prints).splitlines() if line.startswith("value ")]
    assert len(values) == len(FORMULAS)
    variables = Variables({})
    for line in definitions.splitlines():
        variables.define(*line.split()[1:], 1)
    for text, value in zip(FORMULAS, values, strict=True):
        variables.words("")  # a new line, for which variables are computed anew
        assert variables.compute(text) == pytest.approx(float(value), rel=1e-14), text


# What the other commands do.


def test_other_styles_are_rows_without_a_number_or_none_at_all(tmp_path):
    text = "create_atoms 1 b\ncreate_atoms 2 b\ncreate_atoms 3 b\n"
    text += "pair_style hybrid/overlay gran/hooke 1e4 NULL 50 NULL 0 0 lj/cut 2.5 granular\n"
    text += "pair_coeff 1 1 gran/hooke\npair_coeff 1 2 lj/cut 1 1\npair_coeff 1 3 none\n"
    text += "pair_coeff 2 2 gran/hooke\npair_coeff 2 2 lj/cut 1 1\npair_coeff 3 2 granular hooke 7 8\nrun 1\n"
    contacts = deck_of(tmp_path, text).runs[0].contacts
    assert {contact.name: contact.reason for contact in contacts} == {
        "type 1 - type 1": "",
        "type 1 - type 2": "lj/cut is no contact of spheres",
        "type 2 - type 2": "lj/cut and gran/hooke add their forces",
        "type 2 - type 3": "",
        "type 3 - type 3": "it has no pair_coeff",
    }
    first, *_, last = (contact for contact in contacts if not contact.reason)
    line = "pair_style hybrid/overlay gran/hooke 1e4 NULL 60 NULL 0 0 lj/cut 2.5 granular"
    assert first.lines_with({"coefficients": "1e4 60"}) == (line,)
    assert last.lines_with({"coefficients": "7 9"}) == ("pair_coeff 2 3 granular hooke 7 9",)


def test_files_are_sought_beside_the_input(tmp_path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "first").write_text("include parts/second\n")
    (tmp_path / "parts" / "second").write_text("variable x index 5\n\npair_style granular\n")
    deck = deck_of(tmp_path, f"include parts/first\n{CONTACT.replace('pair_style granular', '')}")
    assert deck.runs[0].contacts[0].settings["coefficients"] == "1e4 5"
    with pytest.raises(ValueError, match=r"in.deck:1: cannot read .*nothing: No such file or directory"):
        deck_of(tmp_path, "include nothing\n")


OLD_LIGGGHTS = """
units si
atom_style granular
create_box 2 b
fix 1 all property/global youngsModulus peratomtype 1e6 2e6
fix 2 all property/global poissonsRatio peratomtype 0.3 0.3
fix 3 all property/global coefficientRestitution peratomtypepair 2 0.3 0.4 0.4 0.5
pair_style gran/hertz/history 1 0
pair_coeff * *
fix cad all mesh/gran pipe.stl 2 1.0 0. 0. 0.
fix sides all wall/gran/hertz/history 1 0 mesh/gran 1 cad
fix end all wall/gran/hertz/history 1 1 zplane 0 1 2
fix t all particletemplate/sphere 1 atom_type 1 density constant 2500 radius gaussian number 0.005 0.001
fix d all particledistribution/discrete 1 1 t 1.0
fix i all pour/dev mass 30 1 distributiontemplate d
run 1
"""


def test_a_file_of_windows_is_the_same(tmp_path):
    """A mark of the order of bytes, ends of lines with a carriage return, and bytes that are no text."""
    text = CONTACT.replace("$x", "&\n 5").replace("\n", "\r\n")
    (tmp_path / "in.deck").write_bytes(b"\xef\xbb\xbf" + f"units si # \xe9\r\n{text}".encode("latin-1"))
    deck = read_input(tmp_path / "in.deck", DeckOptions())
    assert deck.runs[0].contacts[0].settings["coefficients"] == "1e4 5"
    assert deck.units.length == "m"


def test_an_old_input_of_liggghts(tmp_path):
    """A second number 1 of a style is cohesion; a wall without a mesh has its type at the end."""
    deck = deck_of(tmp_path, OLD_LIGGGHTS)
    assert deck.missing == ("the radius of type 1 (--radius 1=0.5mm)",)
    pair, side, end = deck.runs[0].contacts
    assert (pair.settings["coefficientRestitution"], side.settings["coefficientRestitution"]) == ("0.3", "0.4")
    assert (side.name, end.name) == ("type 1 - wall cad", "type 1 - wall end")
    assert end.reason == "cohesion sjkr: not computed here"
