"""Reader of scenes in TOML; docs/usage/scenes.md describes the keys."""

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

MOST_BODIES = 40  # and materials; a choice, as is the next one
MOST_CLASSES = 16
TAIL = 1e-6  # default probability of a tail; a choice: a run of N collisions needs less than 1/N
POISSON = "a number > -1 and <= 0.5"
SAME = 0.01  # relative difference up to which two values of A agree; a choice

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
    materials = {
        name: _material(node) for name, node in _named(whole.need("material", "one table or more, [material.NAME]"))
    }
    bodies = {
        name: _body(node, materials) for name, node in _named(whole.need("body", "one table or more, [body.NAME]"))
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
        tolerance=_tolerance(whole.need("tolerance", "a table with epsilon, dissipation or absolute")),
        code=_code(whole.get("code")),
        volume_fraction=_volume_fraction(whole.get("gas")),
        units=units,
        scale=scale,
    )
    for i, meeting in enumerate(meetings):
        _require_damping(scene, meeting, f"contact[{i}]" if whole.has("contact") else "")
    return scene


def _name(node: Node | None, source: str) -> str:
    """Return the scene's name, by default one made from the file's name."""
    if node is not None:
        return _identifier(node)
    stem = re.split(r"[/\\]", source)[-1].split(".")[0]
    made = re.sub(r"[^A-Za-z0-9]+", "_", stem).strip("_")[:40]
    return made if _IDENTIFIER.fullmatch(made) else "scene"


def _identifier(node: Node) -> str:
    if not isinstance(node.value, str) or not _IDENTIFIER.fullmatch(node.value):
        raise node.refuse("a name of up to 40 letters, digits and _ that begins with a letter")
    return node.value


def _named(node: Node) -> Iterator[tuple[str, Node]]:
    """Yield the parts of a table of named things."""
    parts = list(node.parts())
    if not 0 < len(parts) <= MOST_BODIES:
        raise ValueError(f"{node.source}: {node.key} has {len(parts)} entries: expected 1 to {MOST_BODIES}")
    for name, part in parts:
        yield _identifier(Node(node.source, f"a name in {node.key}", name)), part


# --- materials and bodies ---------------------------------------------------------------------------------------------


def _material(node: Node) -> Material:
    node.only(
        "young_modulus", "poisson_ratio", "density", "dissipative_constant", "restitution", "yield_strength", "source"
    )
    # The elastic properties, the density, and A if it is there.
    modulus = _required(node, "young_modulus", "pressure")
    poisson = node.need("poisson_ratio", POISSON).within(POISSON, lambda nu: -1 < nu <= 0.5)
    density = _optional(node, "density", "density")
    constant = _optional(node, "dissipative_constant", "time", zero=True)
    if (source := node.get("source")) is not None:
        source.text()
    restitution, relative_error = node.get("restitution"), None
    if restitution is not None:
        restitution.only("epsilon", "one_minus_epsilon", "standard_error", "speed", "radius", "partner")
        # Else A follows from a measured eps, of two equal balls or of a ball and a wall of this material.
        radius = _required(restitution, "radius", "length")
        partner = "sphere" if (part := restitution.get("partner")) is None else part.choice(("sphere", "wall"))
        if density is None:
            raise ValueError(f"{node.source}: {node.key}.density is missing: {node.key}.restitution needs it")
        elastic = {"young_modulus": modulus, "poisson_ratio": poisson, "dissipative_constant": 0.0}
        ball = _checked(node, lambda: Sphere(radius=radius, density=density, **elastic))
        pair = _checked(node, lambda: Pair(ball, ball if partner == "sphere" else Sphere.wall(**elastic)))
        constant = _constant(node, pair, constant, restitution)
        relative_error = _relative_error(restitution, pair, constant)
    return Material(modulus, poisson, density, constant, _optional(node, "yield_strength", "pressure"), relative_error)


def _required(node: Node, name: str, dimension: str) -> float:
    return quantity(node.need(name, words(dimension)), dimension)


def _optional(node: Node, name: str, dimension: str, *, zero: bool = False) -> float | None:
    part = node.get(name)
    return None if part is None else quantity(part, dimension, zero=zero)


def _constant(node: Node, pair: Pair, constant: float | None, restitution: Node) -> float:
    """Return A from a known eps; if A is also given, both must agree."""
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
    implied = _checked(restitution, lambda: pair.calibrated(speed, **{names[0]: value}).A)
    if constant is not None and abs(constant - implied) > SAME * max(constant, implied):
        raise ValueError(
            f"{node.source}: {node.key}.dissipative_constant is {constant:.6g} s, but {restitution.key} implies "
            f"{implied:.6g} s: expected one of the two, or both if they agree within 1 %"
        )
    return implied if constant is None else constant


def _relative_error(restitution: Node, pair: Pair, constant: float) -> float | None:
    """Return the relative standard error of A from the standard error of a known eps."""
    if not restitution.has("standard_error"):
        return None
    accepted = "a number > 0 and < 1, the standard error of eps"
    error = restitution["standard_error"].within(accepted, lambda x: 0 < x < 1)
    # sigma_eps = |d eps/d ln A| sigma_A/A, whose first factor is the error of eps for a relative error of 1.
    sensitivity = restitution_error(float(pair.damped(constant).v_star(_required(restitution, "speed", "speed"))), 1.0)
    if not sensitivity:
        raise restitution["standard_error"].refuse("none if eps is 1, because A is then 0 and has no relative error")
    return error / sensitivity


def _checked(node: Node, make: Callable[[], T]) -> T:
    """Return the result of `make`; add the names of the file and the key to its errors."""
    try:
        return make()
    except ValueError as error:
        raise ValueError(f"{node.source}: {node.key}: {error}") from None


def _body(node: Node, materials: Mapping[str, Material]) -> Body:
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
    """Return the radii: one, or those of a range or of a distribution without its tails, in classes."""
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
    part = node.get("classes")
    if part is None:
        return 1
    accepted = f"an integer from 1 to {MOST_CLASSES}"
    number = part.within(accepted, lambda n: isinstance(n, int) and 1 <= n <= MOST_CLASSES)
    if number > 1 and not sizes.spread:
        raise part.refuse("1 for a single radius")
    return int(number)


def _quantile(node: Node) -> float:
    """Return the distance of the tail of a normal distribution from its mean, in standard deviations."""
    return -NormalDist().inv_cdf(_tail(node))


def _tail(node: Node) -> float:
    part = node.get("tail")
    if part is None:
        return TAIL
    return part.within("a probability > 1e-300 and < 0.5", lambda p: 1e-300 <= p < 0.5)


# --- pairs of bodies --------------------------------------------------------------------------------------------------


def _speeds(node: Node, wall: bool) -> Speeds:
    """Return the impact speeds of two spheres, or of a sphere and a wall."""
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
    seen: set[frozenset[str]] = set()
    if not listed.items():
        raise listed.refuse("at least one contact")
    for node in listed.items():
        node.only("between", "speed", "restitution", "dissipative_constant")
        between = _between(node.need("between", "a list of two bodies"), bodies)
        if frozenset(between) in seen:
            raise node["between"].refuse("each pair once")
        seen.add(frozenset(between))
        yield _meeting(node, between, materials, bodies, default)


def _between(node: Node, bodies: Mapping[str, Body]) -> tuple[str, str]:
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
    part = node.get("speed") or default or node.need("speed", "a speed here, or one for the whole scene")
    speeds = _speeds(part, bodies[between[1]].is_wall)
    constant = _optional(node, "dissipative_constant", "time", zero=True)
    restitution = node.get("restitution")
    known_at = relative_error = None
    if restitution is not None:
        restitution.only("epsilon", "one_minus_epsilon", "standard_error", "speed")
        # A follows from eps of the pair with typical radii and no damping yet.
        bare = Scene("", "", "", materials, bodies, (), Tolerance(epsilon=1.0), Code())
        pair = _checked(node, lambda: bare.pair(Meeting(*between, speeds, 0.0)))
        constant, known_at = _constant(node, pair, constant, restitution), quantity(restitution["speed"], "speed")
        relative_error = _relative_error(restitution, pair, constant)
    return Meeting(*between, speeds, constant, known_at, relative_error)


def _require_damping(scene: Scene, meeting: Meeting, place: str) -> None:
    """Raise ValueError if no A of a pair is known, or its properties are out of range."""
    if meeting.dissipative_constant is None:
        for name in (meeting.first, meeting.second):
            material = scene.bodies[name].material
            if scene.materials[material].dissipative_constant is None:
                raise ValueError(
                    f"{scene.source}: material.{material}.dissipative_constant is missing: expected "
                    "dissipative_constant or restitution, for the material or for each contact"
                )
    node = Node(scene.source, place or f"body.{meeting.first}", None)
    pair = _checked(node, lambda: scene.pair(meeting))
    if pair.A == 0:
        where = place or f"material.{scene.bodies[meeting.first].material}"
        raise ValueError(
            f"{scene.source}: {where}: {meeting.name} has no dissipation, eps is 1: expected dissipative_constant > 0"
        )


# --- tolerance, code, gas and units -----------------------------------------------------------------------------------


def _tolerance(node: Node) -> Tolerance:
    node.only(*_INSIDE["tolerance"])
    values = {name: part.within("a number > 0 and < 1", lambda t: 0 < t < 1) for name, part in node.parts()}
    if not values:
        raise ValueError(f"{node.source}: tolerance is empty: expected epsilon, dissipation, absolute")
    return Tolerance(**values)


def _code(node: Node | None) -> Code:
    if node is None:
        return Code()
    node.only(*_INSIDE["code"])

    def word(name: str, accepted: tuple[str, ...]) -> str:
        part = node.get(name)
        return accepted[0] if part is None else part.choice(accepted)

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
    accepted = "a number > 0 and < 0.74"
    part = None if gas is None else gas.only("volume_fraction").need("volume_fraction", accepted)
    return None if part is None else part.within(accepted, lambda phi: 0 < phi < 0.74)


def _units(node: Node | None) -> tuple[Units, Scale]:
    """Return the units of generated files, and their sizes in SI units."""
    si = vars(Units())
    parts = {} if node is None else dict(node.only(*si).parts())
    units = {name: factor(parts[name], name) if name in parts else (unit, 1.0) for name, unit in si.items()}
    return Units(*(name for name, _ in units.values())), Scale(*(size for _, size in units.values()))
