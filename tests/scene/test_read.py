"""The reader of scenes: every key, every refusal, and nothing but one-line ValueErrors for what is no scene."""

import copy
import json
import math
import re
import string
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from viscopade import Pair, Sphere
from viscopade.kernels.write.languages import NAMES, language
from viscopade.scene import description, read
from viscopade.scene.description import Code, Sizes, Speeds, Tolerance
from viscopade.scene.units import Scale
from viscopade.simulators.setup import Units

ROOT = Path(__file__).resolve().parents[2]
FILE = "box.toml"
GONE = object()

BASE = {
    "title": "Glass and steel",
    "material": {
        "glass": {"young_modulus": "70 GPa", "poisson_ratio": 0.22, "density": 2500, "dissipative_constant": "50 ns"},
        "steel": {
            "young_modulus": 2.1e11,
            "poisson_ratio": 0.3,
            "density": "7.8 g/cm^3",
            "restitution": {"epsilon": 0.95, "speed": "1 m/s", "radius": "5 mm"},
            "yield_strength": "1 GPa",
            "source": "handbook",
        },
    },
    "body": {
        "bead": {"material": "glass", "radius": "2.5 mm"},
        "ball": {"material": "steel", "radius": {"min": "1 mm", "max": "4 mm"}},
        "floor": {"material": "steel", "wall": True},
    },
    "speed": {"min": "1 cm/s", "max": 2},
    "tolerance": {"epsilon": 1e-3},
}


def toml(value):
    """Write a value as TOML; tables within others inline."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(str(k))} = {toml(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(toml, value)) + "]"
    if isinstance(value, str):
        return json.dumps(value).replace("\x7f", "\\u007f")
    if isinstance(value, bool):
        return str(value).lower()
    return repr(value)


def text(scene):
    return "\n".join(f"{json.dumps(key)} = {toml(value)}" for key, value in scene.items()).encode()


def edited(*changes, base=BASE):
    """Return a scene with values at "a.b.c" set, or taken away."""
    scene = copy.deepcopy(base)
    for path, value in changes:
        *parents, last = path.split(".")
        table = scene
        for name in parents:
            table = table.setdefault(name, {})
        if value is GONE:
            del table[last]
        else:
            table[last] = value
    return scene


def parsed(*changes, base=BASE):
    return read.from_toml(text(edited(*changes, base=base)), FILE)


def refusal(content, source=FILE):
    """Return the message of a refusal; it is one line that begins with the file's name."""
    with pytest.raises(ValueError) as caught:
        read.from_toml(content, source)
    message = str(caught.value)
    assert message.isprintable()
    assert message.startswith(f"{source}: ")
    return message.removeprefix(f"{source}: ")


# --- what is read -----------------------------------------------------------------------------------------------------


def test_materials_are_in_si_units():
    materials = parsed().materials
    glass, steel = materials["glass"], materials["steel"]
    assert (glass.young_modulus, glass.poisson_ratio, glass.density, glass.yield_strength) == (70e9, 0.22, 2500.0, None)
    assert glass.dissipative_constant == 50e-9
    assert (steel.young_modulus, steel.density, steel.yield_strength) == (2.1e11, 7800.0, 1e9)


def test_code_gas_and_units():
    code = {"language": "python", "format": "double", "use": "batch", "argument": "v_star", "largest_table": 4096}
    units = {"length": "cm", "mass": "g", "time": "us"}
    scene = parsed(("code", code), ("gas.volume_fraction", 0.3), ("units", units))
    assert scene.code == Code("python", "double", "batch", "v_star", 4096)
    assert scene.volume_fraction == 0.3
    assert (scene.units, scene.scale) == (Units("cm", "g", "us"), Scale(0.01, 0.001, 1e-6))


def test_bodies():
    bodies = parsed().bodies
    assert list(bodies) == ["bead", "ball", "floor"]
    assert bodies["bead"] == description.Body("glass", Sizes(0.0025, 0.0025, 0.0025))
    assert bodies["floor"] == description.Body("steel", None)
    assert bodies["floor"].is_wall
    assert not bodies["bead"].is_wall


def test_defaults():
    scene = parsed(("title", GONE))
    assert (scene.source, scene.name, scene.title) == (FILE, "box", FILE)
    assert scene.code == Code("c", "double", "scalar", "speed", None)
    assert scene.volume_fraction is None
    assert (scene.units, scene.scale) == (Units("m", "kg", "s"), Scale())


@pytest.mark.parametrize(
    ("source", "name"),
    [
        ("a/b/ice-rings.v2.toml", "ice_rings"),
        ("a\\b\\Box.toml", "Box"),
        ("2balls.toml", "scene"),
        (f"{'x' * 50}.toml", "x" * 40),
        ("<stdin>", "stdin"),
    ],
)
def test_name_from_the_files(source, name):
    assert read.from_toml(text(edited(("name", GONE), base={"name": "x", **BASE})), source).name == name


def test_all_pairs_meet_but_for_walls():
    scene = parsed(("body.lid", {"material": "glass", "wall": True}))
    assert [m.name for m in scene.meetings] == [
        "bead-bead", "bead-ball", "ball-ball", "bead-floor", "bead-lid", "ball-floor", "ball-lid",
    ]  # fmt: skip
    assert {m.speeds for m in scene.meetings} == {Speeds.between(0.01, 2.0)}
    assert {(m.dissipative_constant, m.known_at) for m in scene.meetings} == {(None, None)}


def test_contacts_that_are_listed_are_all():
    own = {"between": ["floor", "ball"], "speed": {"granular_temperature": "4 cm^2/s^2", "tail": 1e-9}}
    scene = parsed(("contact", [own, {"between": ["bead", "bead"]}]))
    first, second = scene.meetings
    assert (first.first, first.second) == ("ball", "floor")
    assert first.speeds == Speeds.thermal(first.speeds.temperature, 1e-9, wall=True)
    assert first.speeds.temperature == pytest.approx(4e-4, rel=1e-15, abs=0)
    assert (second.name, second.speeds) == ("bead-bead", Speeds.between(0.01, 2.0))


@pytest.mark.parametrize("values", [{"epsilon": 1e-3}, {"dissipation": 1e-4, "absolute": 0.5}])
def test_tolerance(values):
    assert parsed(("tolerance", values)).tolerance == Tolerance(**values)
    assert parsed(("tolerance", values)).tolerance.limits() == values


@pytest.mark.parametrize("name", NAMES)
def test_languages(name):
    accepted = language(name).forms
    assert parsed(("code.language", name)).code.format == accepted[0]
    for form in ("double", "float"):
        if form in accepted:
            assert parsed(("code", {"language": name, "format": form})).code == Code(name, form)
        else:
            message = refusal(text(edited(("code", {"language": name, "format": form}))))
            assert message == f"code.format is {form!r}: expected {accepted[0]}"


@pytest.mark.parametrize(
    ("path", "value", "found"),
    [
        ("material.glass.young_modulus", " 7.0e11 dyn/cm^2 ", 70e9),
        ("material.glass.young_modulus", f"{'0' * 54}70 GPa", 70e9),
        ("material.glass.young_modulus", "70 kN/mm**2", 70e9),
        ("material.glass.young_modulus", "70000 N/mm²", 70e9),
        ("material.glass.young_modulus", "70000 N/mm2", 70e9),
        ("material.glass.density", "1.1 g/cm3", 1100),
        ("material.glass.density", "1100 kg m-3", 1100),
        ("material.glass.density", "2.5 kg/l", 2500.0),
        ("material.glass.dissipative_constant", "0.05 µs", 5e-8),
        ("material.glass.dissipative_constant", "0.05 μs", 5e-8),
        ("material.glass.poisson_ratio", -0.5, -0.5),
    ],
)
def test_quantities(path, value, found):
    material = parsed((path, value)).materials["glass"]
    assert getattr(material, path.split(".")[-1]) == found


# --- radii ------------------------------------------------------------------------------------------------------------


def sizes(radius):
    return parsed(("body.bead.radius", radius)).bodies["bead"].sizes


def test_range_of_radii():
    assert sizes({"min": "1 mm", "max": "4 mm"}) == Sizes(0.001, pytest.approx(0.002, rel=1e-15, abs=0), 0.004)
    assert sizes({"min": "1 mm", "typical": "3 mm", "max": "4 mm"}) == Sizes(0.001, 0.003, 0.004)
    assert sizes({"min": 1e-30, "max": 1e-28}).typical == pytest.approx(1e-29, rel=1e-15, abs=0)


def share_beyond(deviations):
    """The upper tail of the normal distribution; NormalDist.cdf, by 1 + erf, loses the digits of small ones."""
    return math.erfc(deviations / math.sqrt(2)) / 2


@pytest.mark.parametrize("tail", [None, 1e-12, 1e-300])
def test_distributions_of_radii(tail):
    more = {} if tail is None else {"tail": tail}
    found = sizes({"median": "2 mm", "geometric_deviation": 1.5} | more)
    assert found.typical == 2e-3
    assert share_beyond(math.log(2e-3 / found.least, 1.5)) == pytest.approx(tail or 1e-6, rel=1e-12, abs=0)
    assert found.least * found.largest == pytest.approx(4e-6, rel=1e-14, abs=0)
    if tail != 1e-300:  # or the smallest radius would be negative
        found = sizes({"mean": "2 mm", "deviation": "0.1 mm"} | more)
        assert found.typical == 2e-3
        assert share_beyond((2e-3 - found.least) / 1e-4) == pytest.approx(tail or 1e-6, rel=1e-12, abs=0)
        assert share_beyond((found.largest - 2e-3) / 1e-4) == pytest.approx(tail or 1e-6, rel=1e-12, abs=0)


# --- A from eps -------------------------------------------------------------------------------------------------------


def ball(modulus, poisson, density, radius, constant=0.0):
    return Sphere(
        radius=radius, density=density, young_modulus=modulus, poisson_ratio=poisson, dissipative_constant=constant
    )


@pytest.mark.parametrize("partner", [None, "sphere", "wall", "rigid wall"])
@pytest.mark.parametrize("name", ["epsilon", "one_minus_epsilon"])
def test_restitution_of_a_material_comes_back(name, partner):
    known = {name: 0.25, "speed": "20 cm/s", "radius": "5 mm"} | ({} if partner is None else {"partner": partner})
    a = parsed(("material.steel.restitution", known)).materials["steel"].dissipative_constant
    one = ball(2.1e11, 0.3, 7800, 5e-3, a)
    walls = {"wall": 2.1e11, "rigid wall": 1e30}
    other = one
    if partner in walls:
        other = Sphere.wall(young_modulus=walls[partner], poisson_ratio=0.3, dissipative_constant=a)
    wanted = 0.25 if name == "epsilon" else 0.75
    assert Pair(one, other).epsilon(0.2) == pytest.approx(wanted, rel=1e-13, abs=0)


def test_a_constant_and_a_restitution_that_agree():
    a = parsed().materials["steel"].dissipative_constant
    given_too = parsed(("material.steel.dissipative_constant", a * 1.009)).materials["steel"]
    assert given_too.dissipative_constant == a * 1.009


@pytest.mark.parametrize("ratio", [0, 0.98, 1.02])
def test_a_constant_and_a_restitution_that_contradict_each_other(ratio):
    a = parsed().materials["steel"].dissipative_constant
    message = refusal(text(edited(("material.steel.dissipative_constant", a * ratio))))
    assert message.startswith(
        f"material.steel.dissipative_constant is {a * ratio:.6g} s, but material.steel.restitution"
    )
    assert f"{a:.6g} s: expected one of the two" in message


def meeting(contact):
    return parsed(("contact", [{"between": ["bead", "ball"]} | contact]))


def test_a_contact_overrides_what_its_materials_lead_to():
    scene = meeting({"dissipative_constant": "3 us"})
    assert scene.meetings[0].dissipative_constant == 3e-6
    assert scene.meetings[0].known_at is None
    assert math.isclose(scene.pair(scene.meetings[0]).A, 3e-6, rel_tol=1e-15)
    mean = meeting({})
    glass, steel = (mean.materials[name] for name in ("glass", "steel"))
    d = [(1 - m.poisson_ratio**2) / m.young_modulus for m in (glass, steel)]
    expected = (d[0] * glass.dissipative_constant + d[1] * steel.dissipative_constant) / sum(d)
    assert math.isclose(mean.pair(mean.meetings[0]).A, expected, rel_tol=1e-14)


def test_restitution_of_a_contact_holds_for_typical_radii():
    scene = meeting({"restitution": {"epsilon": 0.6, "speed": "30 cm/s"}})
    found = scene.meetings[0]
    assert found.known_at == 0.3
    pair = scene.pair(found)
    assert (pair.first.radius, pair.second.radius) == (2.5e-3, pytest.approx(2e-3))
    assert pair.epsilon(0.3) == pytest.approx(0.6, rel=1e-13, abs=0)


def test_materials_need_no_constant_if_contacts_have_one():
    contact = {"between": ["bead", "bead"], "dissipative_constant": 1e-6}
    changes = [("material.glass.dissipative_constant", GONE), ("contact", [contact])]
    assert parsed(*changes).materials["glass"].dissipative_constant is None
    message = refusal(text(edited(changes[0])))
    assert message.startswith("material.glass.dissipative_constant is missing: expected dissipative_constant or")


def test_one_material_may_be_elastic_but_not_both():
    for zero in (0, 0.0, "0 s"):
        scene = parsed(("material.glass.dissipative_constant", zero), ("contact", [{"between": ["bead", "ball"]}]))
        assert scene.materials["glass"].dissipative_constant == 0
        assert scene.pair(scene.meetings[0]).A > 0
    message = refusal(text(edited(("material.glass.dissipative_constant", 0))))
    assert "bead-bead has no dissipation, eps is 1: expected dissipative_constant > 0" in message
    assert message.startswith("material.glass: ")


def test_walls_need_no_density():
    scene = parsed(("material.felt", {"young_modulus": "1 MPa", "poisson_ratio": 0, "dissipative_constant": "1 ms"}),
                   ("body.floor.material", "felt"))  # fmt: skip
    assert scene.materials["felt"].density is None


# --- what is refused --------------------------------------------------------------------------------------------------

PRESSURE = 'a pressure > 0, such as "2.5 GPa", or a number in Pa'
LENGTH = 'a length > 0, such as "2.5 mm", or a number in m'
SPEED = 'a speed > 0, such as "2.5 cm/s", or a number in m/s'
DENSITY = 'a density > 0, such as "2.5 g/cm^3", or a number in kg/m^3'
TIME = 'a time >= 0, such as "2.5 us", or a number in s'
SQUARED = 'a squared speed > 0, such as "2.5 cm^2/s^2", or a number in m^2/s^2'
NAME = "a name of up to 40 letters, digits and _ that begins with a letter"
POISSON = "a number > -1 and <= 0.5"
FRACTION = "a number > 0 and < 1"
UNKNOWN = "is not known: expected"
MISSING = "is missing: "


BETWEEN = {"between": ["bead", "bead"]}
RADIUS, RESTITUTION = "body.bead.radius", "material.steel.restitution"
REFUSED = [  # a place, what stands there, the key that the message names, a part of the message
    ("name", "2x", "name", NAME),
    ("title", "a\nb", "title", "one line of text"),
    ("tolerence", {}, "tolerence", UNKNOWN),
    ("language", "c", "language", "is not known: did you mean code.language?"),
    ("code.language", "cpp", "code.language", "c, which is the language for C++, too"),
    *((key, GONE, key, MISSING) for key in ("material", "body", "speed")),
    *((key, {}, key, "expected 1 to 40") for key in ("material", "body")),
    ("body", {f"b{i}": BASE["body"]["bead"] for i in range(41)}, "body", "expected 1 to 40"),
    *((key, 1, key, "an object") for key in ("material", "body", "tolerance", "code", "gas", "units")),
    # materials
    ("material.a-b", BASE["material"]["glass"], "material", NAME),
    ("material.glass.colour", "green", "material.glass.colour", UNKNOWN),
    *(
        (f"material.glass.{key}", GONE, f"material.glass.{key}", MISSING)
        for key in ("young_modulus", "poisson_ratio", "density")
    ),
    *(
        ("material.glass.young_modulus", value, "material.glass.young_modulus", PRESSURE)
        for value in (
            0, True, "70 m", "70", "70 parrot", "-70 GPa", "inf GPa", [1], math.nan, 10**400, "70 GPa^1000000",
            "1e999 Pa", f"{'7' * 57} GPa", "", "1e-400 Pa", "70 __class__", "70 GPa/0", "70 GPa2", "70 GPa10",
        )
    ),
    *(
        ("material.glass.poisson_ratio", value, "material.glass.poisson_ratio", POISSON)
        for value in (-1, 0.51, math.nan, "0.3", True)
    ),
    ("material.glass.density", "1 g", "material.glass.density", DENSITY),
    ("material.glass.dissipative_constant", -1e-9, "material.glass.dissipative_constant", TIME),
    # a known eps
    (f"{RESTITUTION}.speed", GONE, f"{RESTITUTION}.speed", MISSING),
    (f"{RESTITUTION}.epsilon", GONE, RESTITUTION, "exactly one of them"),
    (f"{RESTITUTION}.one_minus_epsilon", 0.05, RESTITUTION, "exactly one of them"),
    *((f"{RESTITUTION}.epsilon", value, f"{RESTITUTION}.epsilon", "a number > 0 and <= 1") for value in (0, 1.01)),
    (
        RESTITUTION, {"one_minus_epsilon": 1, "speed": 1, "radius": 1}, f"{RESTITUTION}.one_minus_epsilon",
        "a number >= 0 and < 1",
    ),
    (f"{RESTITUTION}.partner", "floor", f"{RESTITUTION}.partner", "sphere, wall"),
    ("material.steel.density", GONE, "material.steel.density", f"{RESTITUTION} needs it"),
    # bodies
    ("body.bead.material", "wood", "body.bead.material", "glass, steel"),
    (RADIUS, GONE, RADIUS, MISSING),
    ("body.bead.wall", True, RADIUS, "no radius for a wall"),
    ("body.bead.wall", 1, "body.bead.wall", "true or false"),
    (RADIUS, [1, 2], RADIUS, LENGTH),
    (RADIUS, {}, RADIUS, "a length, or one of {min, max}, {mean, deviation}"),
    (RADIUS, {"min": 1}, f"{RADIUS}.max", MISSING),
    (RADIUS, {"min": 2, "max": 1}, RADIUS, "min <= typical <= max"),
    (RADIUS, {"min": 1, "typical": 3, "max": 2}, RADIUS, "min <= typical <= max"),
    (RADIUS, {"mean": 1}, f"{RADIUS}.deviation", MISSING),
    (RADIUS, {"mean": 1, "deviation": 0.3}, f"{RADIUS}.deviation", "the smallest radius"),
    (RADIUS, {"mean": 1, "deviation": 0, "tail": 0.5}, f"{RADIUS}.tail", "and < 0.5"),
    *(
        (RADIUS, {"median": 1, "geometric_deviation": value}, f"{RADIUS}.geometric_deviation", "a number from 1 to 100")
        for value in (0.9, 101)
    ),
    (
        RADIUS, {"median": 1e300, "geometric_deviation": 100, "tail": 1e-300}, RADIUS,
        "radii in the range of double precision",
    ),
    # speeds
    ("speed", {}, "speed", "{min, max} or {granular_temperature}"),
    ("speed.min", "1 m", "speed.min", SPEED),
    ("speed.min", 3, "speed", "min <= max, or granular_temperature"),
    ("speed.granular_temperature", 1, "speed.min", UNKNOWN),
    ("speed", {"granular_temperature": "1 K"}, "speed.granular_temperature", SQUARED),
    ("speed", {"granular_temperature": 1, "tail": 0.5}, "speed.tail", "and < 0.5"),
    # contacts
    ("contact", {}, "contact", "a list"),
    ("contact", [], "contact", "at least one contact"),
    ("contact", [{"between": ["bead"]}], "contact[0].between", "a list of two bodies"),
    ("contact", [{"between": ["bead", "cup"]}], "contact[0].between[1]", "bead, ball, floor"),
    ("contact", [{"between": ["floor", "floor"]}], "contact[0].between", "at most one wall"),
    ("contact", [{"between": ["bead", "ball"]}, {"between": ["ball", "bead"]}], "contact[1].between", "each pair once"),
    ("contact", [BETWEEN | {"speed": {"min": 1}}], "contact[0].speed.max", MISSING),
    ("contact", [BETWEEN | {"restitution": {"epsilon": 0.9, "speed": 1, "radius": 1}}],
     "contact[0].restitution.radius", UNKNOWN),
    ("contact", [BETWEEN | {"restitution": {"epsilon": 1, "speed": 1}}], "contact[0]", "dissipative_constant > 0"),
    ("contact", [BETWEEN | {"dissipative_constant": 0}], "contact[0]", "dissipative_constant > 0"),
    ("contact", [BETWEEN | {"dissipative_constant": 1, "restitution": {"epsilon": 0.9, "speed": "1 m/s"}}],
     "contact[0].dissipative_constant", "is 1 s, but "),
    # tolerance
    ("tolerance", {}, "tolerance", "epsilon, dissipation, absolute"),
    *(
        (f"tolerance.{name}", value, f"tolerance.{name}", FRACTION)
        for name, value in (("epsilon", 0), ("dissipation", 1), ("absolute", "1e-3"), ("epsilon", 10**400))
    ),
    # code, gas, units
    ("code.language", "perl", "code.language", ", ".join(NAMES)),
    ("code.format", "half", "code.format", "double, float"),
    ("code", {"language": "rust", "argument": "w"}, "code.argument", "speed, v_star"),
    *(("code.largest_table", v, "code.largest_table", "a positive integer") for v in (-1, 1.5, True, 2**60)),
    ("gas.volume_fraction", 0.74, "gas.volume_fraction", "a number > 0 and < 0.74"),
    ("units.length", "g", "units.length", 'a unit of length, such as "m" or "mm"'),
    ("units.time", "2 s", "units.time", 'a unit of time, such as "s" or "us"'),
]  # fmt: skip


@pytest.mark.parametrize(("path", "value", "key", "accepted"), REFUSED)
def test_refusal(path, value, key, accepted):
    message = refusal(text(edited((path, value))))
    assert accepted in message
    named = re.match(r"(?:a name in )?([\w.\[\]-]+)", message)
    assert named[1].rstrip(":") == key
    assert len(message) < 300


def test_a_contact_without_a_speed():
    content = text(edited(("speed", GONE), ("contact", [{"between": ["bead", "bead"]}])))
    assert refusal(content) == "contact[0].speed is missing: expected a speed here, or one for the whole scene"


def test_walls_alone():
    content = text(edited(("body", {"floor": BASE["body"]["floor"]})))
    message = refusal(content)
    assert message.startswith("body is ")
    assert message.endswith("expected at least one sphere")


@pytest.mark.parametrize(
    ("content", "accepted"),
    [
        (b"\xff\xfe", "the file is not text in UTF-8: expected a scene in TOML"),
        (b"[material", "the text is not TOML: "),
        (b"", "material is missing"),
        (b"a = " + b"[" * 100_000, "nested too deeply"),
        (b"a = " + b"9" * 5000, "is not TOML"),
    ],
)
def test_what_is_no_toml(content, accepted):
    assert accepted in refusal(content)


def test_a_mark_of_the_byte_order_is_no_harm():
    plain = text(edited())
    assert read.from_toml(b"\xef\xbb\xbf" + plain, "scene.toml") == read.from_toml(plain, "scene.toml")


@pytest.mark.parametrize("size", ["0.1 mm", 1 / 3])
def test_ends_may_be_equal(size):
    speed = f"{size}/s" if isinstance(size, str) else size
    changes = ("body.bead.radius", {"min": size, "max": size}), ("speed", {"min": speed, "max": speed})
    found = read.from_toml(text(edited(*changes)), "scene.toml")
    sizes = found.bodies["bead"].sizes
    assert sizes.least == sizes.typical == sizes.largest
    speeds = found.meetings[0].speeds
    assert speeds.slowest == speeds.typical == speeds.fastest


def test_impossible_physics_names_the_key():
    assert refusal(text(edited(("body.bead.radius", 1e-150)))).startswith("body.bead: ")
    listed = edited(("body.bead.radius", 1e-150), ("contact", [{"between": ["bead", "bead"]}]))
    assert refusal(text(listed)).startswith("contact[0]: ")


# --- anything ---------------------------------------------------------------------------------------------------------

QUANTITIES = st.builds(
    "{}{}{}".format,
    st.one_of(st.floats().map(repr), st.integers().map(str), st.text(max_size=4)),
    st.sampled_from(["", " "]),
    st.one_of(
        st.sampled_from(
            ["m", "GPa", "us", "cm/s", "kg", "g/cm^3", "m^2/s^2", "degC", "dB", "%", "N/mm**2", "inch", "c"]
        ),
        st.text(string.ascii_letters + "^*/ ²µ°.-0123456789()", max_size=9),
    ),
)
TEXT = st.characters(exclude_categories=["Cs"])
LEAVES = st.one_of(
    st.booleans(),
    st.integers(),
    st.floats(),
    st.text(TEXT, max_size=8),
    QUANTITIES,
    st.sampled_from(["glass", "steel", "bead", "floor", "c", "rust", "float", "v_star", "batch"]),
)
KEYS = st.one_of(
    st.sampled_from(re.findall(r"(\w+)`", (ROOT / "docs" / "usage" / "scenes.md").read_text("utf-8"))),
    st.text(TEXT, max_size=5),
)
VALUES = st.recursive(
    LEAVES,
    lambda inner: st.one_of(st.lists(inner, max_size=3), st.dictionaries(KEYS, inner, max_size=4)),
    max_leaves=6,
)
FULL = edited(
    ("name", "box"),
    ("contact", [{"between": ["bead", "floor"], "restitution": {"epsilon": 0.9, "speed": 1}, "speed": BASE["speed"]}]),
    ("code", {"language": "c", "format": "double", "use": "batch", "argument": "speed", "largest_table": 1000}),
    ("gas", {"volume_fraction": 0.1}),
    ("units", {"length": "cm", "mass": "g", "time": "s"}),
)  # fmt: skip


def places(table, place=()):
    """Yield where values stand in a nested table or list."""
    items = table.items() if isinstance(table, dict) else enumerate(table)
    for key, value in items:
        yield (*place, key)
        if isinstance(value, dict | list):
            yield from places(value, (*place, key))


def only_one_line_refusals(content):
    message = scene = None
    try:
        scene = read.from_toml(content, FILE)
    except ValueError as error:
        message = str(error)
    if scene is None:
        assert message.startswith(f"{FILE}: ")
        assert message.isprintable(), message
        return
    assert scene.meetings
    for met in scene.meetings:
        assert scene.pair(met).beta > 0


@settings(max_examples=300, suppress_health_check=list(HealthCheck))
@given(st.lists(st.tuples(st.sampled_from(list(places(FULL))), VALUES), min_size=1, max_size=2))
def test_any_value_anywhere_is_read_or_refused_in_one_line(changes):
    scene = copy.deepcopy(FULL)
    for place, value in changes:
        table = scene
        try:
            for key in place[:-1]:
                table = table[key]
            table[place[-1]] = value
        except (TypeError, KeyError, IndexError):
            continue  # the other change has taken the place away
    only_one_line_refusals(text(scene))


@settings(max_examples=200)
@given(st.one_of(st.binary(max_size=60), st.text(max_size=60).map(lambda t: t.encode("utf-8", "surrogatepass"))))
def test_any_bytes_are_refused_in_one_line(content):
    only_one_line_refusals(content)


# --- examples and the document ----------------------------------------------------------------------------------------


DOCUMENT = (ROOT / "docs" / "usage" / "scenes.md").read_text("utf-8")
TABLE = re.findall(r"^\| (`.*?`) \|", DOCUMENT, re.MULTILINE)


def documented():
    """Return the keys in the document's tables, each as a path."""
    for cell in TABLE:
        first, *more = re.findall(r"`([^`]+)`", cell)
        yield first
        for other in more:
            yield first.rsplit(".", 1)[0] + other if other.startswith(".") else other


def accepted_by(path, value=1):
    """Return the keys that are accepted where an unknown one is put."""
    message = refusal(text(edited((f"{path}.nonsense".removeprefix("."), value), base=FULL)))
    return message.split("expected ")[1].split(", ")


@pytest.mark.parametrize(
    ("path", "shown"),
    [
        ("material.glass", "material.NAME"),
        ("material.steel.restitution", "material.NAME.restitution"),
        ("body.bead", "body.NAME"),
        *((table, table) for table in ("tolerance", "code", "gas", "units", "speed")),
    ],
)
def test_document_has_every_key(path, shown):
    keys = set(documented())
    names = accepted_by(path)
    assert names
    for name in names:
        assert any(key == f"{shown}.{name}" or key.startswith(f"{shown}.{name}.") for key in keys), (shown, name)


def test_documents_scene_is_read():
    block = re.search(r"```toml\n(.*?)```", DOCUMENT, re.DOTALL)[1]
    assert [m.name for m in read.from_toml(block.encode(), "x.toml").meetings] == ["bead-bead"]


def test_documents_refusal_is_what_is_said():
    message = refusal(text(edited(("material.glass.young_modulus", "70 m"))), "scene.toml")
    assert f"    scene.toml: {message}\n" in DOCUMENT
