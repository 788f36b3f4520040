"""Reader of scenes in TOML; docs/usage/scenes.md describes the keys.

    [material.glass]
    young_modulus = "71 GPa"
    poisson_ratio = 0.22
    density = "2500 kg/m^3"
    restitution = { epsilon = 0.97, speed = "1 m/s", radius = "1.5 mm" }

    [body.bead]
    material = "glass"
    radius = "1.5 mm"

    [speed]
    min = "1 cm/s"
    max = "2 m/s"

    [tolerance]
    epsilon = 1e-3

All quantities become SI units. A `Node` is a value of the file with its key, for messages: `need` and `get` return the
node of a key in a table, `only` refuses other keys, `within` and `choice` check a value and return it, and `refuse`
makes an error that names the file, the key, the value and the expected one.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from itertools import chain, combinations_with_replacement, product
from statistics import NormalDist
from typing import TypeVar, cast, get_args

from viscopade import files
from viscopade.collision.spheres import Pair, Sphere, restitution_error
from viscopade.kernels.write.languages import NAMES
from viscopade.kernels.write.languages import language as language_of
from viscopade.quantity import factor, quantity, words
from viscopade.records import Node
from viscopade.scene.description import (
    Argument,
    Body,
    Code,
    FormatName,
    Material,
    Meeting,
    Scene,
    Sizes,
    Speeds,
    Tolerance,
    Use,
    geometric_mean,
)
from viscopade.scene.units import Scale
from viscopade.simulators.setup import Units

# Bodies or materials, and classes of a body's sizes, at most. Chosen by hand: 40 bodies have 820 pairs, each of which
# has a proof of its own, and a program needs a type for each class.
MOST_BODIES = 40
MOST_CLASSES = 16
TAIL = 1e-6  # default probability of a tail, by hand: a run of a million collisions has one that is farther out
POISSON = "a number > -1 and <= 0.5"
SAME = 0.01  # relative difference up to which two values of A agree, by hand: measured A are known to a few per cent

# A name becomes part of names of functions and files: letters that every language has, and at most 40 of them, a choice
# that keeps a line of code readable.
_IDENTIFIER = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,39}")
T = TypeVar("T")

_TOP = ("name", "title", "contact", "speed", "tolerance", "code", "units", "material", "body", "gas")
_INSIDE = {
    "code": ("language", "format", "use", "argument", "largest_table"),
    "tolerance": ("epsilon", "dissipation", "absolute"),
    "gas": ("volume_fraction",),
}
"""The keys of tables, which a message for the top level names."""


def from_toml(content: bytes | str, source: str) -> Scene:
    """Return the scene in a TOML file.

    Parameters
    ----------
    content : bytes or str
        Content of the file.
    source : str
        The file's name, for messages.

    Raises
    ------
    ValueError
        One line that names the file, the key, the value and the expected one.
    """
    whole = Node(source, "", files.toml(content, source)).only(*_TOP, inside=_INSIDE)
    # Bodies need the materials, and meetings both.
    materials = {
        name: _material(node) for name, node in _entries(whole.need("material", "one table or more, [material.NAME]"))
    }
    bodies = {
        name: _body(node, materials) for name, node in _entries(whole.need("body", "one table or more, [body.NAME]"))
    }
    meetings = tuple(_meetings(whole, materials, bodies))
    (units, scale), title = _units(whole.get("units")), whole.get("title")
    scene = Scene(
        source=whole.source,
        name=_name(whole.get("name"), whole.source),
        title=whole.source if title is None else title.text(),
        materials=materials,
        bodies=bodies,
        meetings=meetings,
        tolerance=_tolerance(whole.get("tolerance")),
        code=_code(whole.get("code")),
        volume_fraction=_volume_fraction(whole.get("gas")),
        units=units,
        scale=scale,
        toml=content if isinstance(content, str) else content.decode("utf-8-sig"),
    )
    for i, meeting in enumerate(meetings):
        _require_damping(scene, meeting, f"contact[{i}]" if whole.has("contact") else "")
    return scene


def _name(node: Node | None, source: str) -> str:
    """Return the scene's name: that of its key name, `node`, or one made from the file's name, `source`."""
    if node is not None:
        return _identifier(node)
    # "my scene.toml" is my_scene; an identifier has up to 40 characters (`_IDENTIFIER`).
    stem = re.split(r"[/\\]", source)[-1].split(".")[0]
    identifier = re.sub(r"[^A-Za-z0-9]+", "_", stem).strip("_")[:40]
    return identifier if _IDENTIFIER.fullmatch(identifier) else "scene"


def _identifier(node: Node) -> str:
    """Return a name that every language admits in the names of functions."""
    if not isinstance(node.value, str) or not _IDENTIFIER.fullmatch(node.value):
        raise node.refuse("a name of up to 40 letters, digits and _ that begins with a letter")
    return node.value


def _entries(node: Node) -> Iterator[tuple[str, Node]]:
    """Yield the entries of a table of materials or bodies, each with its name."""
    # Names become parts of generated code, so they are identifiers.
    entries = list(node.parts())
    if not 0 < len(entries) <= MOST_BODIES:
        raise ValueError(f"{node.source}: {node.key} has {len(entries)} entries: expected 1 to {MOST_BODIES}")
    for name, entry in entries:
        yield _identifier(Node(node.source, f"a name in {node.key}", name)), entry


# --- materials and bodies ---------------------------------------------------------------------------------------------


def _material(node: Node) -> Material:
    """Return a material, [material.NAME], with A given or from a measured eps."""
    node.only(
        "young_modulus", "poisson_ratio", "density", "dissipative_constant", "restitution", "yield_strength", "source"
    )
    # The elastic properties, the density, and A if it is there.
    modulus = _required(node, "young_modulus", "pressure")
    # The elastic energy is positive for -1 < nu < 1/2; at 1/2 the volume is constant.
    poisson = node.need("poisson_ratio", POISSON).within(POISSON, lambda nu: -1 < nu <= 0.5)
    density = _optional(node, "density", "density")
    constant = _optional(node, "dissipative_constant", "time", zero=True)
    if (source := node.get("source")) is not None:
        source.text()
    restitution, relative_error = node.get("restitution"), None
    if restitution is not None:
        restitution.only("epsilon", "one_minus_epsilon", "standard_error", "speed", "radius", "partner")
        # Else A follows from a measured eps, of two equal balls, or of a ball and a wall.
        radius = _required(restitution, "radius", "length")
        partner_node = restitution.get("partner")
        partner = "sphere" if partner_node is None else partner_node.choice(("sphere", "wall", "rigid wall"))
        if density is None:
            raise ValueError(f"{node.source}: {node.key}.density is missing: {node.key}.restitution needs it")
        elastic = {"young_modulus": modulus, "poisson_ratio": poisson, "dissipative_constant": 0.0}
        ball = _with_place(node, lambda: Sphere(radius=radius, density=density, **elastic))
        # 2^60 times as stiff a wall is rigid: it changes no digit of a double, which has 53 bits.
        wall = elastic | ({"young_modulus": 2.0**60 * modulus} if partner == "rigid wall" else {})
        pair = _with_place(node, lambda: Pair(ball, ball if partner == "sphere" else Sphere.wall(**wall)))
        constant = _dissipative_constant(node, pair, constant, restitution)
        relative_error = _relative_error(restitution, pair, constant)
    return Material(modulus, poisson, density, constant, _optional(node, "yield_strength", "pressure"), relative_error)


def _required(node: Node, name: str, dimension: str) -> float:
    """Return the quantity of a key in SI units; ValueError if the table has no such key."""
    return quantity(node.need(name, words(dimension)), dimension)


def _optional(node: Node, name: str, dimension: str, *, zero: bool = False) -> float | None:
    """Return the quantity of a key in SI units, which may be 0 if `zero`; None if the table has no such key."""
    value = node.get(name)
    return None if value is None else quantity(value, dimension, zero=zero)


def _dissipative_constant(node: Node, pair: Pair, constant: float | None, restitution: Node) -> float:
    """Return A in seconds from a known eps; if A is also given, both must agree.

    Parameters
    ----------
    node : Node
        The material or contact.
    pair : Pair
        The bodies whose eps is known.
    constant : float or None
        A, if it is given.
    restitution : Node
        The table with eps and its speed.
    """
    names = [name for name in ("epsilon", "one_minus_epsilon") if restitution.has(name)]
    if len(names) != 1:
        which = "both" if names else "neither"
        raise ValueError(
            f"{restitution.source}: {restitution.key}: epsilon and one_minus_epsilon: {which} given, expected exactly "
            "one of them"
        )
    if names[0] == "epsilon":
        value = restitution["epsilon"].within("a number > 0 and <= 1", lambda e: 0 < e <= 1)
    else:
        value = restitution["one_minus_epsilon"].within("a number >= 0 and < 1", lambda e: 0 <= e < 1)
    # eps is a function of v* alone: its inverse gives v*, this beta, and this A.
    speed = _required(restitution, "speed", "speed")
    implied = _with_place(restitution, lambda: pair.calibrated(speed, **{names[0]: value}).A)
    if constant is not None and abs(constant - implied) > SAME * max(constant, implied):
        raise ValueError(
            f"{node.source}: {node.key}.dissipative_constant is {constant:.6g} s, but {restitution.key} implies "
            f"{implied:.6g} s: expected one of the two, or both if they agree within 1 %"
        )
    return implied if constant is None else constant


def _relative_error(restitution: Node, pair: Pair, constant: float) -> float | None:
    """Return the relative standard error of A from the standard error of a known eps; None if this has none.

    `restitution` is the table with eps, `pair` the bodies, and `constant` their A.
    """
    if not restitution.has("standard_error"):
        return None
    accepted = "a number > 0 and < 1, the standard error of eps"
    error = restitution["standard_error"].within(accepted, lambda x: 0 < x < 1)
    # sigma_eps = |d eps/d ln A| sigma_A/A, whose first factor is the error of eps for a relative error of 1.
    sensitivity = restitution_error(float(pair.damped(constant).v_star(_required(restitution, "speed", "speed"))), 1.0)
    if not sensitivity:
        raise restitution["standard_error"].refuse("none if eps is 1, because A is then 0 and has no relative error")
    return error / sensitivity


def _with_place(node: Node, make: Callable[[], T]) -> T:
    """Return the result of `make`; add the names of the file and the key to its errors."""
    try:
        return make()
    except ValueError as error:
        raise ValueError(f"{node.source}: {node.key}: {error}") from None


def _body(node: Node, materials: Mapping[str, Material]) -> Body:
    """Return a body, [body.NAME]: a wall, or a sphere with one radius or a distribution of radii."""
    # A wall has no radius, and a sphere needs the density of its material.
    node.only("material", "radius", "wall")
    material = node.need("material", "the name of one").choice(list(materials))
    wall = node.has("wall") and node["wall"].flag()
    if wall:
        if node.has("radius"):
            raise node["radius"].refuse("no radius for a wall")
        return Body(material, None)
    if materials[material].density is None:
        raise ValueError(f"{node.source}: material.{material}.density is missing: the sphere {node.key} needs it")
    return Body(material, _sizes(node.need("radius", f"{words('length')}, or a distribution; or wall = true")))


def _sizes(node: Node) -> Sizes:
    """Return the radii in metres: one, or those of a range or of a distribution without its tails, in classes.

    `node` is the key radius.
    """
    # A single radius.
    if not isinstance(node.value, Mapping):
        radius = quantity(node, "length")
        return Sizes(radius, radius, radius)
    if node.has("min") or node.has("max"):
        node.only("min", "max", "typical", "classes")
        # A range, with the geometric mean as the typical radius.
        least, largest = (_required(node, name, "length") for name in ("min", "max"))
        typical = _optional(node, "typical", "length")
        middle = geometric_mean(least, largest) if typical is None else typical
        if not least <= middle <= largest:
            raise node.refuse("min <= typical <= max")
        sizes = Sizes(least, middle, largest)
    elif node.has("mean"):
        node.only("mean", "deviation", "tail", "classes")
        # A normal distribution: mean -+ z deviation, z the quantile of the tail.
        mean = _required(node, "mean", "length")
        reach = quantity(node.need("deviation", words("length", zero=True)), "length", zero=True) * _quantile(node)
        if reach >= mean:
            raise node["deviation"].refuse(
                "a smaller deviation: the smallest radius, mean - deviation times quantile, must be > 0"
            )
        sizes = Sizes(mean - reach, mean, mean + reach)
    elif node.has("median"):
        node.only("median", "geometric_deviation", "tail", "classes")
        # A log-normal distribution: median times deviation^(-+z).
        # A geometric deviation above 100 would span the radii of dust and of planets, and is a percentage.
        median, accepted = _required(node, "median", "length"), "a number from 1 to 100"
        deviation = node.need("geometric_deviation", accepted).within(accepted, lambda g: 1 <= g <= 100)
        reach = deviation ** _quantile(node)
        sizes = Sizes(median / reach, median, median * reach)
        if not 0 < sizes.least <= sizes.largest < math.inf:
            raise node.refuse("radii in the range of double precision")
    else:
        raise node.refuse("a length, or one of {min, max}, {mean, deviation}, {median, geometric_deviation}")
    return replace(sizes, classes=_classes(node, sizes))


def _classes(node: Node, sizes: Sizes) -> int:
    """Return the number of classes into which the sizes of a distribution, `node`, are divided; 1 by default."""
    classes = node.get("classes")
    if classes is None:
        return 1
    # A single radius has one class.
    accepted = f"an integer from 1 to {MOST_CLASSES}"
    number = classes.within(accepted, lambda n: isinstance(n, int) and 1 <= n <= MOST_CLASSES)
    if number > 1 and not sizes.spread:
        raise classes.refuse("1 for a single radius")
    return int(number)


def _quantile(node: Node) -> float:
    """Return the distance of the tail of a normal distribution from its mean, in standard deviations."""
    return -NormalDist().inv_cdf(_tail(node))


def _tail(node: Node) -> float:
    """Return the probability of a tail of a distribution, which is left out; `TAIL` by default."""
    tail = node.get("tail")
    if tail is None:
        return TAIL
    # From 1/2 on nothing is left between both tails; below 1e-300, near the smallest double, quantiles are not exact.
    return tail.within("a probability > 1e-300 and < 0.5", lambda p: 1e-300 <= p < 0.5)


# --- pairs of bodies --------------------------------------------------------------------------------------------------


def _speeds(node: Node, wall: bool) -> Speeds:
    """Return the impact speeds in m/s of two spheres, or of a sphere and a `wall`; `node` is the key speed."""
    # By the granular temperature, or as a range
    if node.has("granular_temperature"):
        node.only("granular_temperature", "tail")
        return Speeds.thermal(_required(node, "granular_temperature", "squared speed"), _tail(node), wall)
    if not (node.has("min") or node.has("max")):
        raise node.refuse("{min, max} or {granular_temperature}")
    node.only("min", "max")
    slowest, fastest = (_required(node, name, "speed") for name in ("min", "max"))
    if slowest > fastest:
        raise node.refuse("min <= max, or granular_temperature")
    return Speeds.between(slowest, fastest)


def _meetings(whole: Node, materials: Mapping[str, Material], bodies: Mapping[str, Body]) -> Iterator[Meeting]:
    """Yield the pairs of bodies that meet; `whole` is the file, with the keys contact and speed."""
    # Without a list of contacts, all spheres meet all bodies, with the speeds of the scene.
    listed, default = whole.get("contact"), whole.get("speed")
    if default is not None:
        _speeds(default, False)
    if listed is None:
        if default is None:
            raise ValueError(f"{whole.source}: speed is missing: expected {{min, max}} or {{granular_temperature}}")
        spheres, walls = ([name for name, body in bodies.items() if body.is_wall == wall] for wall in (False, True))
        if not spheres:
            raise whole["body"].refuse("at least one sphere")
        pairs = chain(combinations_with_replacement(spheres, 2), product(spheres, walls))
        yield from (Meeting(*pair, _speeds(default, bodies[pair[1]].is_wall)) for pair in pairs)
        return
    # With a list, the listed pairs meet, each of them once.
    earlier_pairs: set[frozenset[str]] = set()
    if not listed.items():
        raise listed.refuse("at least one contact")
    for node in listed.items():
        node.only("between", "speed", "restitution", "dissipative_constant")
        between = _between(node.need("between", "a list of two bodies"), bodies)
        if frozenset(between) in earlier_pairs:
            raise node["between"].refuse("each pair once")
        earlier_pairs.add(frozenset(between))
        yield _meeting(node, between, materials, bodies, default)


def _between(node: Node, bodies: Mapping[str, Body]) -> tuple[str, str]:
    """Return the names of the two bodies of a contact; a wall is the second."""
    # A list of two names
    if len(node.items()) != 2:
        raise node.refuse("a list of two bodies")
    first, second = (item.choice(list(bodies)) for item in node.items())
    if bodies[first].is_wall and bodies[second].is_wall:
        raise node.refuse("at most one wall")
    return (second, first) if bodies[first].is_wall else (first, second)


def _meeting(
    node: Node,
    between: tuple[str, str],
    materials: Mapping[str, Material],
    bodies: Mapping[str, Body],
    default: Node | None,
) -> Meeting:
    """Return the meeting of two bodies, [[contact]].

    Parameters
    ----------
    node : Node
        The contact.
    between : pair of str
        Names of the bodies.
    materials, bodies : mapping
        Those of the scene, by their names.
    default : Node or None
        The speed of the whole scene.
    """
    speed = node.get("speed") or default or node.need("speed", "a speed here, or one for the whole scene")
    speeds = _speeds(speed, bodies[between[1]].is_wall)
    # A of this pair alone, if the contact has it
    constant = _optional(node, "dissipative_constant", "time", zero=True)
    restitution = node.get("restitution")
    known_at = relative_error = None
    if restitution is not None:
        restitution.only("epsilon", "one_minus_epsilon", "standard_error", "speed")
        # A follows from eps of the pair with typical radii and no damping yet.
        bare = Scene("", "", "", materials, bodies, (), Tolerance(epsilon=1.0), Code())
        pair = _with_place(node, lambda: bare.pair(Meeting(*between, speeds, 0.0)))
        constant = _dissipative_constant(node, pair, constant, restitution)
        known_at = quantity(restitution["speed"], "speed")
        relative_error = _relative_error(restitution, pair, constant)
    return Meeting(*between, speeds, constant, known_at, relative_error)


def _require_damping(scene: Scene, meeting: Meeting, place: str) -> None:
    """Raise ValueError if no A of a pair is known, or its properties are out of range.

    `place` is the key of the contact for messages, "" if the file has no list of contacts.
    """
    # A of the pair, or of both materials; then the pair itself, whose A must not be 0.
    if meeting.dissipative_constant is None:
        for name in (meeting.first, meeting.second):
            material = scene.bodies[name].material
            if scene.materials[material].dissipative_constant is None:
                raise ValueError(
                    f"{scene.source}: material.{material}.dissipative_constant is missing: expected "
                    "dissipative_constant or restitution, for the material or for each contact"
                )
    node = Node(scene.source, place or f"body.{meeting.first}", None)
    pair = _with_place(node, lambda: scene.pair(meeting))
    if pair.A == 0:
        where = place or f"material.{scene.bodies[meeting.first].material}"
        raise ValueError(
            f"{scene.source}: {where}: {meeting.name} has no dissipation, eps is 1: expected dissipative_constant > 0"
        )


# --- tolerance, code, gas and units -----------------------------------------------------------------------------------


def _tolerance(node: Node | None) -> Tolerance:
    """Return the tolerance, [tolerance], which has at least one of its keys; one without limits if there is none."""
    if node is None:
        return Tolerance()
    # An error of 1 or more, relative or of eps, would be no tolerance.
    node.only(*_INSIDE["tolerance"])
    limits = {name: limit.within("a number > 0 and < 1", lambda t: 0 < t < 1) for name, limit in node.parts()}
    if not limits:
        raise ValueError(f"{node.source}: tolerance is empty: expected epsilon, dissipation, absolute")
    return Tolerance(**limits)


def _code(node: Node | None) -> Code:
    """Return the wanted code, [code]; each key that is not there has the first word that it accepts."""
    if node is None:
        return Code()
    node.only(*_INSIDE["code"])

    def word(name: str, accepted: tuple[str, ...]) -> str:
        """Return the word of a key."""
        value = node.get(name)
        return accepted[0] if value is None else value.choice(accepted)

    # A header in C serves C++, too; its name as a language leads there.
    language_node = node.get("language")
    if language_node is not None and str(language_node.value).lower() in ("c++", "cpp", "cxx"):
        raise language_node.refuse("c, which is the language for C++, too")
    language = word("language", NAMES)
    table = node.get("largest_table")
    return Code(
        language=language,
        format=cast(FormatName, word("format", language_of(language).forms)),
        use=cast(Use, word("use", get_args(Use))),
        argument=cast(Argument, word("argument", get_args(Argument))),
        largest_table=None if table is None else table.count(),
    )


def _volume_fraction(gas: Node | None) -> float | None:
    """Return the volume fraction of the spheres, [gas], or None."""
    # No packing of equal spheres is denser than pi/sqrt(18) = 0.7405.
    accepted = "a number > 0 and < 0.74"
    fraction = None if gas is None else gas.only("volume_fraction").need("volume_fraction", accepted)
    return None if fraction is None else fraction.within(accepted, lambda phi: 0 < phi < 0.74)


def _units(node: Node | None) -> tuple[Units, Scale]:
    """Return the units of generated files, [units], and their sizes in SI units; those that are not there are SI."""
    # Name of a unit's dimension (length, mass, time) -> the unit's name and its size
    si = vars(Units())
    unit_nodes = {} if node is None else dict(node.only(*si).parts())
    units = {name: factor(unit_nodes[name], name) if name in unit_nodes else (unit, 1.0) for name, unit in si.items()}
    return Units(*(name for name, _ in units.values())), Scale(*(size for _, size in units.values()))
