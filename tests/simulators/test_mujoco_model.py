"""Models of MuJoCo: the contacts that are read, against MuJoCo's own contacts and runs of the same models."""

import math
import re
import sys
from itertools import combinations

import numpy as np
import pytest

from viscopade.extras import MissingPackage
from viscopade.simulators import mujoco_model
from viscopade.simulators.deck import INCLINED, DeckOptions
from viscopade.simulators.mujoco import NATIVE, Surface, mixed_surface
from viscopade.simulators.native import Impact, delivery

mujoco = pytest.importorskip("mujoco")

# Five geoms, two pairs, three defaults, one priority and two values of solmix; spheres of different masses.
FIVE = """<mujoco>
  <option timestep="0.0005"/>
  <default>
    <geom solref="-5000 -30" solimp="0.9 0.9 0.001" condim="1"/>
    <default class="soft"><geom solref="0.05 0.3" solmix="3"/></default>
    <default class="rough"><geom condim="3" friction="0.7 0.005 0.0001" solimp="0.8 0.95 0.01"/></default>
  </default>
  <worldbody>
    <geom name="table" type="plane" size="1 1 1" class="soft"/>
    <body><freejoint/>
      <geom name="ball" size="0.1"/></body>
    <body><freejoint/>
      <geom name="soft" size="0.2" class="soft"/></body>
    <body><freejoint/>
      <geom name="rough" size="0.05" class="rough"/></body>
    <body><freejoint/>
      <geom name="first" size="0.1" priority="1" solref="0.02 0.5"/></body>
  </worldbody>
  <contact>
    <pair geom1="ball" geom2="soft" solref="0.03 0.2" condim="1"/>
    <pair geom1="rough" geom2="table" solref="-2000 -10" condim="4" friction="0.5 0.5 0.01 0.001 0.001"/>
  </contact>
</mujoco>
"""
BALLS = """<mujoco><option timestep="0.001" {option}>{flag}</option><default><geom size="0.1"/></default><worldbody>
<body><freejoint/><geom name="a" {a}/></body>
<body><freejoint/><geom name="b" {b}/></body>
</worldbody><contact>{contact}</contact></mujoco>"""
SPEED = 1.0


def deck_of(tmp_path, text):
    file = tmp_path / "model.xml"
    file.write_text(text)
    return mujoco_model.read_model(file, DeckOptions())


def row_of(tmp_path, **parts):
    """Return the only contact of two balls."""
    text = BALLS.format(**{"option": "", "flag": "", "a": "", "b": "", "contact": "", **parts})
    (contact,) = deck_of(tmp_path, text).runs[0].contacts
    return contact


def names_of(contact):
    """Return the pairs of geoms in the lines to write instead."""
    return [tuple(re.findall(r'geom[12]="([^"]*)"', line)) for line in contact.lines_with({"solref": "1 1"})]


def run_epsilon(text, names, phase, gravity, distance=0.0, speed=SPEED):
    """Return the eps of two geoms in MuJoCo, the second above the first, which may be a plane.

    Contact begins after a part of the first step, at a distance of the surfaces.
    """
    model = mujoco.MjModel.from_xml_string(text)
    model.opt.gravity[:] = 0, 0, -gravity
    data, step = mujoco.MjData(model), model.opt.timestep
    for k, address in enumerate(model.jnt_qposadr):
        data.qpos[address : address + 3] = 0, 100 * (k + 1), 1000  # far from each other
    low, high = (model.body_jntadr[model.geom(name).bodyid[0]] for name in names)  # joints; -1 of the world
    touch = distance + sum(model.geom(name).size[0] for name in names if model.geom(name).type[0] != 0)

    # Free flight reaches the level of first contact after `before`; semi-implicit steps end with the velocity of half
    # a step before.
    before = phase * step
    lag = 0.0 if model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4 else gravity * step / 2
    base = 0.0 if low < 0 else 500.0
    for joint, z in ((low, base), (high, base + touch + before * (speed - gravity * before / 2))):
        if joint >= 0:
            data.qpos[model.jnt_qposadr[joint] : model.jnt_qposadr[joint] + 3] = 0, 0, z
    data.qvel[model.jnt_dofadr[high] + 2] = gravity * before - speed + lag

    def flight():
        """Return the height over the level of first contact and the rate at which it grows."""
        (z, v), (z_low, v_low) = (
            (data.qpos[model.jnt_qposadr[joint] + 2], data.qvel[model.jnt_dofadr[joint] + 2]) if joint >= 0 else (0, 0)
            for joint in (high, low)
        )
        return z - z_low - touch, v - v_low - lag

    while data.time < 1:
        mujoco.mj_step(model, data)
        height, velocity = flight()
        if height > 0 and velocity > 0:
            return math.sqrt(velocity**2 + 2 * gravity * height) / speed
    return 0.0


def our_epsilon(contact, phase, step, gravity, speed=SPEED):
    values, hit = NATIVE.values(contact.settings), Impact(speed, None, None, gravity, step)
    scheme = NATIVE.schemes[values["integrator"]]
    return NATIVE.contact(values, hit).collide(speed, step=step, scheme=scheme, phases=[phase]).epsilon


@pytest.mark.parametrize("phase", [0.3, 0.8])
def test_each_pair_of_five_geoms_in_a_run(tmp_path, phase):
    run = deck_of(tmp_path, FIVE).runs[0]
    assert (run.step, run.gravity, run.line) == (0.0005, 9.81, None)
    pairs = [(contact, names) for contact in run.contacts for names in names_of(contact)]
    assert {frozenset(names) for _, names in pairs} == {
        frozenset(names) for names in combinations(("table", "ball", "soft", "rough", "first"), 2)
    }
    assert sum(contact.count for contact in run.contacts) == len(pairs) == 10
    for contact, names in pairs:
        on_table = "table" in names
        assert contact.falls == on_table
        assert (contact.sizes[0][1] is None) == on_table
        names = sorted(names, key="table".__eq__)
        for gravity in (0.0, 9.81) if on_table else (0.0,):
            measured = run_epsilon(FIVE, sorted(names, key="table".__ne__), phase, gravity)
            assert our_epsilon(contact, phase, run.step, gravity) == pytest.approx(measured, abs=1e-6), names
            assert 0.05 < measured < 0.95


@pytest.mark.parametrize("scheme", ["RK4", "implicitfast"])
@pytest.mark.parametrize(
    ("changed", "marks"),
    [
        # Override replaces what geoms and pairs say, but for condim.
        (
            {
                "flag": '<flag override="enable"/>',
                "option": 'o_solref="-9000 -50" o_solimp="0.7 0.9 0.05" o_friction="0.6 0.6 0 0 0" o_margin="0.03"',
                "a": 'condim="4" margin="0.2"',
            },
            ("o_solref, o_solimp and o_friction", "contact begins at a distance of 0.03 m (margin)"),
        ),
        # Margins add, and the contact is the same at that distance; a gap has no force.
        ({"a": 'margin="0.01" gap="0.01"', "b": 'margin="0.02"'}, ("contact begins at a distance of 0.03 m (margin)",)),
        # A pair has its own margin.
        ({"contact": '<pair geom1="a" geom2="b" margin="0.03"/>', "a": 'margin="0.5"'}, ("contact begins at",)),
        # Cones, with friction that is not the same in both directions.
        ({"contact": '<pair geom1="a" geom2="b" friction="0.4 2"/>', "option": 'impratio="3"'}, ()),
        (
            {"option": 'cone="elliptic"', "a": 'friction="0.4"', "b": 'friction="0.3"'},
            ("mixed: friction is the larger",),
        ),
        # timeconst counts as two steps, unless refsafe is disabled.
        ({"a": 'solref="0.001 1" priority="2"'}, ("mixed: solref is that of the higher priority",)),
        ({"a": 'solref="0.004 0.3"', "b": 'solref="0.001 0.3"', "flag": '<flag refsafe="disable"/>'}, ("mixed: ",)),
        ({"a": 'solref="0.02 -1" priority="2"'}, ("mixed: ", "solref has both signs: MuJoCo takes 0.02 1")),
    ],
)
def test_what_a_model_says_of_all_contacts(tmp_path, monkeypatch, changed, marks, scheme):
    monkeypatch.chdir(tmp_path)  # MuJoCo writes its warning on a solref of both signs into a file
    changed = {**changed, "option": f'{changed.get("option", "")} integrator="{scheme}"'}
    contact = row_of(tmp_path, **changed)
    assert len(contact.marks) == len(marks)
    assert all(text.startswith(start) for text, start in zip(contact.marks, marks, strict=True))
    text = BALLS.format(**{"flag": "", "a": "", "b": "", "contact": "", **changed})
    distance = 0.03 if "contact begins" in str(marks) else 0.0
    measured = run_epsilon(text, ("a", "b"), 0.4, 0.0, distance)
    assert our_epsilon(contact, 0.4, 0.001, 0.0) == pytest.approx(measured, abs=1e-6)
    assert 0.01 < measured < 0.99


def surface_of(random):
    """Return random numbers of a geom; solref of either sign, and often equal priorities."""
    solref = random.uniform((0.01, 0.1), (0.1, 1)) if random.random() < 0.7 else -random.uniform((100, 1), (9000, 90))
    return Surface(
        int(random.integers(2)),
        float(random.choice([0, 1e-16, 0.5, 1, 3])),
        int(random.choice([1, 3, 4, 6])),
        tuple(solref.tolist()),
        tuple(random.uniform((0.1, 0.5, 0.001, 0.1, 1), (0.5, 0.9, 0.1, 0.9, 4)).tolist()),
        tuple(random.uniform(0.01, 2, 3).tolist()),
    )


def test_the_rule_of_mixing_is_that_of_mujoco():
    random = np.random.default_rng(54)
    model = mujoco.MjModel.from_xml_string(BALLS.format(option="", flag="", a="", b="", contact=""))
    for _ in range(200):
        surfaces = surface_of(random), surface_of(random)
        for geom, surface in enumerate(surfaces):
            for name, value in surface._asdict().items():
                getattr(model, f"geom_{name}")[geom] = value
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)  # both balls are at the origin
        contact = data.contact[0]
        ours, _ = mixed_surface(*surfaces)
        assert ours.condim == contact.dim
        for numbers, theirs in zip(
            ours[3:], (contact.solref, contact.solimp, contact.friction[[0, 2, 3]]), strict=True
        ):
            np.testing.assert_allclose(numbers, theirs, rtol=1e-15)


def test_set_has_two_geoms():
    """The numbers of both geoms give what the mixed ones give."""
    both = {"solref": "0.02 1, 0.06 0.2", "solmix": "1 3", "friction": "0.3, 0.5 0.01", "condim": "1 3"}
    alone = {"solref": "0.05 0.4", "friction": "0.5 0.01", "condim": "3"}
    two, one = (delivery(NATIVE, settings, Impact(SPEED)) for settings in (both, alone))
    assert two.collision.epsilon == pytest.approx(one.collision.epsilon, rel=1e-12)
    assert not one.values.mixed
    sentence = "solref = 0.05 0.4, the mean, weighted by solmix, of 0.02 1 and 0.06 0.2 (mj_contactParam)"
    assert two.values.mixed["solref"].sentence("solref") == sentence
    assert [*two.values.mixed] == ["condim", "solref", "friction"]
    first = delivery(NATIVE, {**both, "priority": "1 0"}, Impact(SPEED))
    assert first.collision == delivery(NATIVE, {"solref": "0.02 1", "condim": "1"}, Impact(SPEED)).collision
    wanted = delivery(NATIVE, both, Impact(SPEED), 0.5).instead
    assert delivery(NATIVE, {**both, **wanted}, Impact(SPEED)).collision.epsilon == pytest.approx(0.5, abs=1e-6)


def random_tree(random):
    """Return a model of overlapping spheres on bodies with and without joints, with bits, excludes and pairs."""
    bodies, geoms = [], []

    def body(depth):
        joint = random.choice(["", "", "<joint type='slide'/>", "<freejoint/>" if depth == 0 else ""])
        bodies.append(f"b{len(bodies)}")
        inside = f'<body name="{bodies[-1]}">{joint}'
        for _ in range(int(random.integers(1, 3)) if depth else 1):
            geoms.append(f"g{len(geoms)}")
            bits = random.integers(1, 4, 2)
            inside += f'<geom name="{geoms[-1]}" size="1" contype="{bits[0]}" conaffinity="{bits[1] % 3}"/>'
        return inside + "".join(body(depth + 1) for _ in range(int(random.integers(0, 2 - depth // 2)))) + "</body>"

    inside = '<geom name="w" size="1"/>' + "".join(body(0) for _ in range(4))
    excluded = {tuple(sorted(random.choice(bodies, 2, replace=False).tolist())) for _ in range(3)}
    pairs = {tuple(sorted(random.choice(geoms, 2, replace=False).tolist())) for _ in range(2)}
    contact = "".join(f'<exclude body1="{a}" body2="{b}"/>' for a, b in excluded)
    contact += "".join(f'<pair geom1="{a}" geom2="{b}"/>' for a, b in pairs)
    flag = f'<option><flag filterparent="{random.choice(["enable", "disable"])}"/></option>'
    return f"<mujoco>{flag}<worldbody>{inside}</worldbody><contact>{contact}</contact></mujoco>"


@pytest.mark.parametrize("seed", range(6))
def test_geoms_that_may_touch_are_those_of_mujoco(tmp_path, seed):
    """All geoms overlap: MuJoCo has a contact for each pair that may touch."""
    text = random_tree(np.random.default_rng(seed))
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    theirs = [frozenset(model.geom(i).name for i in contact.geom) for contact in data.contact if contact.exclude != 3]
    contacts = deck_of(tmp_path, text).runs[0].contacts
    ours = [frozenset(names) for contact in contacts for names in names_of(contact)]
    assert sum(contact.count for contact in contacts) == len(ours) == len(theirs) > 5
    assert {*ours} == {*theirs}


def test_pairs_with_equal_contacts_are_one_row(tmp_path):
    """Four balls and two planes: 6 pairs of balls, 4 with either plane."""
    ball = '<body><freejoint/><geom name="{}" size="0.1"/></body>'
    planes = '<geom name="p" type="plane" size="1 1 1"/><geom name="q" type="plane" size="1 1 1" solref="-100 -1"/>'
    text = f"<mujoco><worldbody>{planes}{''.join(map(ball.format, 'abcd'))}</worldbody></mujoco>"
    rows = [(contact.name, contact.count, contact.falls) for contact in deck_of(tmp_path, text).runs[0].contacts]
    assert rows == [("a - p", 4, True), ("a - q", 4, True), ("a - b", 6, False)]


BODY = "<mujoco><option {}>{}</option><worldbody>{}</worldbody>{}</mujoco>"
BALL = '<body><freejoint/><geom name="a" size="0.1"/></body>'
FLOOR = '<geom name="f" type="plane" size="1 1 1"/>'
JOINTED = "a geom on a jointed body: eps is that of a free one"
NO_SPHERE = "a geom that is no sphere around its body's centre of mass: eps is that of such a sphere"


@pytest.mark.parametrize(
    ("world", "marks", "falls"),
    [
        (FLOOR + BALL, (), True),
        ('<geom type="box" size="1 1 1"/>' + BALL, (), True),
        ('<body mocap="true"><geom size="1"/></body>' + BALL, (), True),
        (FLOOR + BALL.replace('size="0.1"', 'type="box" size="1 1 1"'), (NO_SPHERE,), True),
        (FLOOR + BALL.replace("/></body>", '/><geom size="0.2" pos="1 0 0" contype="0"/></body>'), (NO_SPHERE,), True),
        (FLOOR + '<body><joint type="slide" axis="0 0 1"/><geom size="1"/></body>', (JOINTED,), True),
        (FLOOR + '<body><joint type="free" damping="1"/><geom size="1"/></body>', (JOINTED,), True),
        (FLOOR + BALL.replace("</body>", '<body><joint/><geom size="1" contype="0"/></body></body>'), (JOINTED,), True),
        # A vertical plane and one under 30 degrees.
        (FLOOR.replace("/>", ' zaxis="1 0 0"/>') + BALL, (), False),
        (FLOOR.replace("/>", ' euler="30 0 0"/>') + BALL, (INCLINED,), math.cos(math.radians(30))),
    ],
)
def test_marks_and_weight(tmp_path, world, marks, falls):
    (contact,) = deck_of(tmp_path, BODY.format("", "", world, "")).runs[0].contacts
    assert (contact.marks, contact.falls) == (marks, pytest.approx(float(falls), abs=1e-8))


@pytest.mark.parametrize(
    ("flag", "ball", "reason"),
    [
        ("", BALL.replace("<geom", '<geom adhesion="1"'), "adhesion pulls, which is not computed"),
        ('<flag diagexact="enable"/>', BALL, "the flag diagexact changes the pyramidal cone, which is not computed"),
    ],
)
def test_contacts_without_a_number(tmp_path, flag, ball, reason):
    (contact,) = deck_of(tmp_path, BODY.format("", flag, FLOOR + ball, "")).runs[0].contacts
    assert contact.reason == reason


@pytest.mark.parametrize(
    ("option", "pair", "message"),
    [
        ('integrator="discrete"', "", "integrator is 'discrete': expected Euler, RK4"),
        ("", '<contact><pair geom1="a" geom2="f" solref="0 -9"/></contact>', "solref is '0 -9': expected timeconst"),
    ],
)
def test_values_that_are_not_computed(tmp_path, option, pair, message):
    """A row has the message as the reason why there is no number."""
    (contact,) = deck_of(tmp_path, BODY.format(option, "", FLOOR + BALL, pair)).runs[0].contacts
    with pytest.raises(ValueError, match=message):
        NATIVE.values(contact.settings)


def test_what_is_written_instead_gives_the_wanted_eps(tmp_path):
    """Lines for a pair keep what the geoms say otherwise."""
    (contact, *_) = (contact for contact in deck_of(tmp_path, FIVE).runs[0].contacts if contact.name == "ball - rough")
    impact = Impact(SPEED, step=0.0005)
    instead = delivery(NATIVE, contact.settings, impact, 0.7).instead
    (line,) = contact.lines_with(instead)
    assert line.startswith('<pair geom1="ball" geom2="rough" ')
    rows = deck_of(tmp_path, FIVE.replace("<contact>", f"<contact>{line}")).runs[0].contacts
    (again,) = (row for row in rows if row.name == "ball - rough")
    assert {**contact.settings, **again.settings, "solref": ""} == {**contact.settings, "solref": ""}
    assert delivery(NATIVE, again.settings, impact).collision.epsilon == pytest.approx(0.7, abs=1e-6)


FALL = """<mujoco><option timestep="{step}"/><worldbody><geom name="floor" type="plane" size="2 2 .1" {geom}/>
<body><freejoint/><geom name="ball" size="0.1" {geom}/></body></worldbody>
<contact>{pair}</contact></mujoco>"""


def test_a_pair_that_is_replaced_keeps_its_name_and_class(tmp_path):
    """The class has a margin, which the pair sets to 0, and a gap; sensors and keyframes may use the name."""
    defaults = '<default><default class="foot"><pair margin="0.01" gap="0.001" condim="1"/></default></default>'
    pair = '<pair name="foot_floor" class="foot" geom1="foot" geom2="floor" margin="0"/>'
    text = (
        f'<mujoco>{defaults}<worldbody><geom name="floor" type="plane" size="1 1 1"/>'
        '<body pos="0 0 1"><freejoint/><geom name="foot" size="0.1"/></body></worldbody>'
        f"<contact>{pair}</contact></mujoco>"
    )
    (contact,) = deck_of(tmp_path, text).runs[0].contacts
    (line,) = contact.lines_with({"solref": "-2500 -10"})
    assert line.startswith('<pair geom1="foot" geom2="floor" name="foot_floor" class="foot" margin="0" ')
    (changed,) = deck_of(tmp_path, text.replace(pair, line)).runs[0].contacts
    assert changed.settings == contact.settings | {"solref": "-2500 -10"}
    assert changed.marks == contact.marks == ()


PAIR = '<pair geom1="ball" geom2="floor" condim="3" {}/>'


@pytest.mark.parametrize(("solref", "speed"), [("0.02 1", 0.1), ("0.02 0.65", 0.1), ("-20000 -50", 1.0)])
def test_the_shorter_step_that_is_advised_is_the_cure_with_weight(tmp_path, solref, speed):
    """The range over where in a step contact begins, in runs of what is written for each step."""
    ranges = []
    step = "0.002"
    while len(ranges) < 2:
        text = FALL.format(step=step, geom="", pair=PAIR.format(f'solref="{solref}"'))
        (contact,) = deck_of(tmp_path, text).runs[0].contacts
        found = delivery(NATIVE, contact.settings, Impact(speed, gravity=9.81, step=float(step)), 0.5)
        (pair,) = contact.lines_with(found.instead)
        written = FALL.format(step=step, geom="", pair=pair)
        runs = [run_epsilon(written, ("floor", "ball"), (k + 0.5) / 16, 9.81, speed=speed) for k in range(16)]
        assert np.mean(runs) == pytest.approx(0.5, abs=0.01)
        ranges.append(max(runs) - min(runs))
        advice = re.findall(r'--time-step "(\S+) s", its range is below 0\.02', " ".join(found.warnings))
        assert len(advice) == (len(ranges) == 1)
        step = advice[0] if advice else step
    assert ranges[0] > 0.03
    assert 0.014 < ranges[1] < 0.02


def test_hops_that_are_shorter_than_a_step_are_those_of_mujoco(tmp_path):
    """Of 64 phases 24 leave the plane at 0.5 m/s, by micrometres, and none below the sticking speed, 0.46 m/s."""
    geom = 'solref="0.02 0.65"'
    text = FALL.format(step=0.002, geom=geom, pair="")
    (contact,) = deck_of(tmp_path, text).runs[0].contacts
    for speed, leaving in ((0.45, 0), (0.5, 24), (0.6, 62)):
        phases = [(k + 0.5) / 64 for k in range(64)]
        measured = [run_epsilon(text, ("floor", "ball"), phase, 9.81, speed=speed) for phase in phases]
        ours = [our_epsilon(contact, phase, 0.002, 9.81, speed) for phase in phases]
        assert ours == pytest.approx(measured, abs=1e-9)
        assert sum(epsilon > 0 for epsilon in ours) == leaving
    down = delivery(NATIVE, contact.settings, Impact(0.1, gravity=9.81, step=0.002))
    assert (down.collision.parts, down.sticking.neck_energy) == (False, 0)
    assert down.sticking.speed == pytest.approx(0.462, abs=1e-3)


def test_a_pair_that_is_there_is_replaced(tmp_path):
    """The line keeps its solref for friction."""
    pair = PAIR.format('solref="-20000 -50" solreffriction="0.03 1"')
    once, twice = (deck_of(tmp_path, FALL.format(step=0.002, geom="", pair=pair * count)) for count in (1, 2))
    (contact,) = once.runs[0].contacts
    assert (contact.line.number, contact.line.text) == (3, pair + "</contact></mujoco>")
    assert 'solreffriction="0.03 1"' in contact.lines_with({"solref": "-1 -1"})[0]
    assert once.warnings == ()
    alone = "More than one <pair> acts between ball - floor: each row is one of them alone, keep one"
    assert twice.warnings == (alone,)


def test_lines(tmp_path):
    (tmp_path / "more.xml").write_text(f"<mujoco><worldbody>{BALL}</worldbody></mujoco>")
    text = (
        f'<mujoco><include file="more.xml"/><worldbody>\n{FLOOR}<body><freejoint/>\n<geom name="b"\nsize="1"/></body>'
    )
    text += '</worldbody><contact>\n\n<pair geom1="a" geom2="b"/></contact>\n<equality><joint joint1="x"/></equality>'
    text = text.replace('<freejoint/>\n<geom name="b"', '<joint name="x"/>\n<geom name="b"') + "</mujoco>"
    deck = deck_of(tmp_path, text)
    lines = {contact.name: (contact.line.number, contact.line.text) for contact in deck.runs[0].contacts}
    pair = '<pair geom1="a" geom2="b"/></contact>'
    assert lines == {"a - b": (6, pair), "a - f": (0, "<geom>"), "b - f": (3, '<geom name="b"')}
    assert [(line.number, line.text) for line in deck.unread] == [(7, "equality")]
    (contact,) = (
        deck_of(tmp_path, f"<mujoco><worldbody>{FLOOR}{BALL}<!--{'x' * 500}--></worldbody></mujoco>").runs[0].contacts
    )
    assert (contact.line.number, len(contact.line.text)) == (1, 200)
    assert deck.warnings == ("Equality constraints tie bodies together, which changes eps",)


def nested(depth):
    return "<mujoco><worldbody>" + "<body>" * depth + "</body>" * depth + "</worldbody></mujoco>"


MANY = "<replicate count='{}'><body><freejoint/><geom size='1'/></body></replicate>"
HOSTILE = {
    "itself": ('<mujoco><include file="model.xml"/></mujoco>', "already included"),
    "gone": ('<mujoco><include file="gone.xml"/></mujoco>', "gone.xml"),
    "no XML": ("units lj\n", "XML"),
    "no model": ("<robot/>", None),
    "wrong": ("<mujoco>\n<worldbody><geom size='a'/></worldbody></mujoco>", "line 2"),
    "deep": (nested(100_000), ""),
    "entities": ('<!DOCTYPE a [<!ENTITY b "c">]><mujoco model="&b;"/>', None),
    "many geoms": (BODY.format("", "", "<replicate count='6000'><geom size='1'/></replicate>", ""), None),
    "many bodies": (BODY.format("", "", MANY.format(10_000_000), ""), "expected a smaller model"),
    "long": ("<mujoco>" + "<!-- -->\n" * 1_000_000 + "</mujoco>", None),
    "memory": ('<mujoco><size memory="1000G"/></mujoco>', None),
    "no contacts": ('<mujoco><option><flag contact="disable"/></option></mujoco>', "disable all contacts"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_models(tmp_path, monkeypatch, name):
    text, message = HOSTILE[name]
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(mujoco_model, "SECONDS", 5)
    if message is None:
        assert deck_of(tmp_path, text).runs[0].contacts == ()
    else:
        with pytest.raises(ValueError) as error:
            deck_of(tmp_path, text)
        assert str(error.value).startswith(f"MuJoCo cannot read {tmp_path / 'model.xml'}: ")
        assert message in str(error.value)
        assert "\n" not in str(error.value)
    assert [file.name for file in tmp_path.iterdir()] == ["model.xml"]


def test_a_model_says_everything_itself(tmp_path):
    with pytest.raises(ValueError, match="takes no variable, radius or density: expected --speed"):
        mujoco_model.read_model(tmp_path / "model.xml", DeckOptions(densities={"a": 1000.0}))


def test_a_missing_package_is_named_before_any_work(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(
        MissingPackage, match=r"viscopade audit FILE needs mujoco.*pip install 'viscopade\[simulators\]'"
    ):
        mujoco_model.read_model(tmp_path / "gone.xml", DeckOptions())
