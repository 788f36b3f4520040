"""A model of MuJoCo (MJCF): which of its geoms may touch, and what contacts they have.

    <option timestep="0.001" cone="elliptic"/>
    <geom name="ball" size="0.1" solref="-2500 -100" priority="1"/>
    <pair geom1="ball" geom2="table" solref="0.02 1"/>

MuJoCo itself compiles the model, in a process of its own. Read in src/engine/engine_collision_driver.c of MuJoCo 3.12.1
(google-deepmind/mujoco at commit a725507):

- `mj_collision`, `filterBodyPair` and `filterBitmask`: two geoms may touch if contype of one and conaffinity of the
  other have a common bit, unless they belong to one body or to bodies welded together, neither moves, one body is the
  parent of the other (and not the world), an `<exclude>` names both bodies, or a `<pair>` names both geoms. A `<pair>`
  needs none of this.
- `mj_contactParam`: `mujoco.mixed_surface`. `mj_assignRef`, `mj_assignImp`, `mj_assignFriction` and
  `mj_assignMargin` of engine_core_constraint.c: with the flag `override` all contacts have o_solref, o_solimp,
  o_friction and o_margin.
- `getMargin`, `mj_setContact` and `mj_referenceConstraint`: the margins of both geoms add. The force depends on
  margin - distance, so contact begins earlier, with the same eps. A gap adds contacts without a force.
- `mj_instantiateContact`: a contact that no degree of freedom moves has no force.
- `getsolparam`: a solref with one positive number is replaced by 0.02 1.

The force per effective mass is that of free bodies whose centres lie on the normal. A geom for which this does not hold
has a mark, and the difference is not computed.
"""

from __future__ import annotations

import json
import sys
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import astuple, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple
from xml.sax.saxutils import quoteattr

import numpy as np

from viscopade import files
from viscopade.extras import require
from viscopade.simulators.deck import INCLINED, Deck, DeckContact, DeckOptions, DeckRun, Line, Size
from viscopade.simulators.mujoco import SIMULATOR, Surface, mixed_surface
from viscopade.simulators.native import FileUnits

MEMORY, SECONDS = 1 << 32, 60
"""Limits of the process that compiles and compares pairs of geoms: 4 GiB of its address space, and 60 s. They were
chosen by hand, for models that are hostile or large."""
# Bytes for contacts, 256 MiB, in place of the number in a model, which may ask for more than there are.
_ARENA = 1 << 28
# Lines to write instead for one row; for more pairs of geoms one line <geom> is written. Chosen by hand.
_MOST_LINES = 50
# Characters of a line of the model that are kept. All of a model may stand in one line.
_LONGEST_LINE = 200


class Kind(NamedTuple):
    """What decides the contacts of a geom.

    Attributes
    ----------
    surface : Surface
    margin, adhesion : float
        Distance, in m, at which a contact begins, and a force that pulls, in N; a contact has the sums of both geoms'.
    moves : bool
        Whether its body has degrees of freedom.
    pressing : float
        The part of a body's weight that presses on it: on an inclined plane the cosine.
    mark : str
        Why eps is not that of free bodies whose centres lie on the normal; "" if it is.
    """

    surface: Surface
    margin: float
    adhesion: float
    moves: bool
    pressing: float
    mark: str


class State(NamedTuple):
    """What is equal in all contacts of a row.

    Attributes
    ----------
    settings : tuple of pairs of str
        Names and texts of the parameters of `mujoco.NATIVE`.
    falls : float
        The part of the weight that presses the bodies together.
    marks : tuple of str
    reason : str
        As of `DeckContact`.
    element : str
        The attributes of a `<pair>` for these contacts, without its geoms and solref.
    """

    settings: tuple[tuple[str, str], ...]
    falls: float
    marks: tuple[str, ...]
    reason: str
    element: str


@dataclass
class GeomRow:
    """Pairs of geoms whose contacts are equal.

    Attributes
    ----------
    state : State
    name : str
        Both geoms of the first pair, "ball - table".
    tag : str
        "geom" or "pair", of the element that says the contact.
    number : int
        The line of that element; 0 if MuJoCo does not say it.
    masses : tuple of float, and float or None
        Masses of the bodies of both geoms, in kg. The first one moves; None if the second does not.
    rule : str
        How numbers are mixed, in words.
    count : int
        How many pairs there are.
    elements : list of str
        Elements of the model to write instead, without solref and their end.
    """

    state: State
    name: str
    tag: str
    number: int
    masses: tuple[float, float | None]
    rule: str
    count: int = 0
    elements: list[str] = field(default_factory=list)


def read_model(path: Path, options: DeckOptions) -> Deck:
    """Return the contacts of a model.

    Parameters
    ----------
    path : Path
    options : DeckOptions
        Without any: a model says everything itself.

    Raises
    ------
    MissingPackage
        If MuJoCo is not installed.
    ValueError
        If the file is no model, or something is said.
    """
    require("viscopade audit FILE", "mujoco")
    if options != DeckOptions():
        raise ValueError("a model of MuJoCo takes no variable, radius or density: expected --speed, --epsilon, …")
    # This module is run as a program in a process of its own, with limits, and prints `model_facts` as JSON.
    text = files.content(path, "a model of MuJoCo (MJCF)").decode(errors="replace").splitlines()
    try:
        printed = files.isolated_output(__file__, str(path.resolve()), b"", MEMORY, SECONDS, "a smaller model")
    except ValueError as error:
        raise ValueError(f"MuJoCo cannot read {path}: {error}") from None
    facts = json.loads(next(line for line in printed.splitlines() if line.startswith(b"{")))

    contacts = []
    for row in (GeomRow(State(*state), *others) for state, *others in facts["rows"]):
        # A geom of an included file has no line, or one of that file.
        source = text[row.number - 1] if 0 < row.number <= len(text) else ""
        line = Line(path, 0, f"<{row.tag}>")
        start = source.find(f"<{row.tag}")
        if start >= 0:
            line = Line(path, row.number, source[start : start + _LONGEST_LINE].strip())
        # The first geom moves; a body without a radius, as eps depends on no size.
        first_mass, second_mass = row.masses
        sizes = ((Size(None, first_mass), Size(None, second_mass) if second_mass else None),)
        marks = tuple(filter(None, (row.rule, *row.state.marks)))
        write = partial(_elements_with, row.elements, facts["prefix"])
        settings, falls, _, reason, _ = row.state
        contacts.append(DeckContact(row.name, line, dict(settings), sizes, falls, row.count, reason, marks, write))
    run = DeckRun(None, facts["step"], facts["gravity"], tuple(contacts))
    unread = tuple(Line(path, number, tag) for tag, number in facts["unread"].items())
    return Deck(SIMULATOR, path, FileUnits(), (run,), (), unread, tuple(facts["warnings"]))


def _elements_with(elements: Sequence[str], prefix: str, instead: Mapping[str, str]) -> tuple[str, ...]:
    """Return elements of the model with other values of parameters.

    `elements` lack their end, such as '<pair geom1="a" geom2="b"'; `prefix` stands before the names of attributes, such
    as o_solref; `instead` has texts by parameter.
    """
    changed = " ".join(f'{prefix}{name}="{text}"' for name, text in instead.items())
    return tuple(f"{element} {changed}/>" for element in elements)


def model_facts(file: str) -> dict[str, Any]:
    """Return what MuJoCo makes of the model in `file`, as JSON has it.

    The keys are "rows", each a list of the fields of a `GeomRow`; "prefix" of attributes; "step" and "gravity", in the
    units of the model; "unread", the line of the first element of each tag that is not read; and "warnings", sentences.
    """
    import mujoco

    spec = mujoco.MjSpec.from_file(file)
    spec.memory = _ARENA
    model = spec.compile()
    data, option = mujoco.MjData(model), model.opt
    mujoco.mj_kinematics(model, data)
    flags = {name for name, bit in mujoco.mjtDisableBit.__members__.items() if option.disableflags & int(bit)}
    flags |= {name for name, bit in mujoco.mjtEnableBit.__members__.items() if option.enableflags & int(bit)}
    override = "mjENBL_OVERRIDE" in flags
    if flags & {"mjDSBL_CONTACT", "mjDSBL_CONSTRAINT"}:
        raise ValueError("its flags disable all contacts: expected the flags contact and constraint")
    gravity = np.zeros(3) if "mjDSBL_GRAVITY" in flags else option.gravity

    # The line in which each element begins, by its tag, in the order of the arrays of the model (`id`). MuJoCo says it
    # in words, "line 12", or not at all; then it is 0.
    elements = {"geom": spec.geoms, "pair": spec.pairs, "equality": spec.equalities, "tendon": spec.tendons}
    elements |= {"actuator": spec.actuators, "flex": spec.flexes, "plugin": spec.plugins}
    numbers = {
        tag: [int("0" + "".join(filter(str.isdigit, element.info))) for element in sorted(some, key=lambda e: e.id)]
        for tag, some in elements.items()
    }

    # Pairs of geoms with equal contacts make a row. The mass is that of the body with all that is welded to it, or
    # hangs on it.
    kinds = [_geom_kind(model, data, gravity, geom) for geom in range(model.ngeom)]
    mass = model.body_subtreemass[model.body_weldid[model.geom_bodyid]]
    rows: dict[State, GeomRow] = {}
    # A <pair> that is replaced keeps its name and class. A class may have a margin: without one it is 0.
    pair_names = [
        (f" name={quoteattr(pair.name)}" if pair.name else "", pair.classname.name)
        for pair in sorted(spec.pairs, key=lambda pair: pair.id)
    ]
    # How many <pair> two geoms have: MuJoCo makes a contact of each.
    pair_counts, repeated = Counter[frozenset[int]](), list[str]()
    for i, partners, k in _touching_geoms(model, flags, kinds):
        state, rule = _row_state(model, flags, kinds[i], kinds[partners[0]], k)
        # The first geom of both moves.
        pairs = [(i, j) if kinds[i].moves else (j, i) for j in partners]
        tag, number = ("geom", numbers["geom"][pairs[0][0]]) if k is None else ("pair", numbers["pair"][k])
        first, second = pairs[0]
        masses = float(mass[first]), float(mass[second]) if kinds[second].moves else None
        name = " - ".join(model.geom(geom).name or f"geom {geom}" for geom in pairs[0])
        if k is not None:
            pair_counts[frozenset(pairs[0])] += 1
            repeated += [name] if pair_counts[frozenset(pairs[0])] == 2 else []
        row = rows.setdefault(state, GeomRow(state, name, tag, number, masses, rule))
        row.count += len(pairs)
        kept, pair_class = ("", "main") if k is None else pair_names[k]
        if pair_class != "main":  # MuJoCo's name of the defaults of no class
            kept += f" class={quoteattr(pair_class)}" + ' margin="0"' * (" margin=" not in state.element)
        # At most 50 elements, and one more as a sign of more.
        for pair in pairs[: _MOST_LINES + 1 - len(row.elements)]:
            names = [model.geom(geom).name for geom in pair]
            geom1, geom2 = map(quoteattr, names)
            row.elements.append(f"<pair geom1={geom1} geom2={geom2}{kept} {state.element}" if all(names) else "<geom")
    # One line for all pairs: with the flag override, for a geom without a name, which no <pair> can name, or many
    # pairs.
    for row in rows.values():
        if override or "<geom" in row.elements or len(row.elements) > _MOST_LINES:
            row.elements = ["<option" if override else "<geom"]
    warnings = {
        "Equality constraints tie bodies together, which changes eps": model.neq,
        "Density and viscosity of the medium change eps": option.density or option.viscosity,
        "gravcomp carries bodies: eps with weight has their whole weight": model.body_gravcomp.any(),
        "Speculative contacts change eps if a body moves by its size in a step": "mjENBL_SPECULATIVE" in flags,
        f"More than one <pair> acts between {', '.join(repeated)}: each row is one of them alone, keep one": repeated,
    }
    return {
        "rows": [astuple(row) for row in rows.values()],
        "prefix": "o_" if override else "",
        "step": option.timestep,
        "gravity": float(np.linalg.norm(gravity)),
        "unread": {tag: lines[0] for tag, lines in numbers.items() if lines and tag not in ("geom", "pair")},
        "warnings": [sentence for sentence, holds in warnings.items() if holds],
    }


def _geom_kind(model: Any, data: Any, gravity: Any, geom: int) -> Kind:
    """Return what decides the contacts of the geom with the index `geom`.

    `model` and `data` are MuJoCo's, `data` after its kinematics; `gravity` is a vector, in the units of the model.
    """
    import mujoco

    # A body moves if the body to which it is welded has degrees of freedom.
    body = model.geom_bodyid[geom]
    shape, moves = mujoco.mjtGeom(model.geom_type[geom]).name, bool(model.body_dofnum[model.body_weldid[body]])
    pressing, mark = 1.0, ""
    if moves:
        joint, dof = model.body_jntadr[body], model.body_dofadr[body]
        free = model.body_jntnum[body] == 1 and model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE
        # A free body has one joint, a free one, whose first three degrees of freedom are those of its place. Armature,
        # damping and friction of the joint act on the body as well.
        forces = model.dof_armature + model.dof_damping + model.dof_frictionloss
        distance = np.linalg.norm(model.geom_pos[geom] - model.body_ipos[body])
        if not free or forces[dof : dof + 3].any() or model.body_subtreemass[body] != model.body_mass[body]:
            mark = "a geom on a jointed body: eps is that of a free one"
        # The compiler computes the centre of mass of a sphere up to round-off: 1e-9 of the radius is far above it.
        elif shape != "mjGEOM_SPHERE" or distance > 1e-9 * model.geom_size[geom][0]:
            mark = "a geom that is no sphere around its body's centre of mass: eps is that of such a sphere"
    elif shape == "mjGEOM_PLANE":
        # The normal of a plane is the third column of its 3 x 3 matrix, whose rows stand one after another. Nine
        # decimals remove round-off, so that a level plane has 1 and no mark. A plane from above presses with nothing.
        cosine = float(-data.geom_xmat[geom][2::3] @ gravity) / (float(np.linalg.norm(gravity)) or 1.0)
        pressing = max(round(cosine, 9), 0.0)
        mark = INCLINED if 0 < pressing < 1 else ""
    elif shape in ("mjGEOM_HFIELD", "mjGEOM_SDF"):
        mark = "a geom that touches at several points: eps is that of a single one"
    # Of the fields of `Surface` the first three are numbers, the others become tuples.
    numbers: list[Any] = [getattr(model, f"geom_{name}")[geom].tolist() for name in Surface._fields]
    surface = Surface(*numbers[:3], *map(tuple, numbers[3:]))
    return Kind(surface, float(model.geom_margin[geom]), float(model.geom_adhesion[geom]), moves, pressing, mark)


def _touching_geoms(model: Any, flags: set[str], kinds: list[Kind]) -> Iterator[tuple[int, list[int], int | None]]:
    """Yield the index of a geom, the indices of others of one kind that it may touch, and the index of a `<pair>`.

    The last is None if no `<pair>` says so. `model` is MuJoCo's, `flags` are the names of its flags that are set, and
    `kinds` what decides the contacts of each geom. The rules are those of `mj_collision`, `filterBodyPair` and
    `filterBitmask` (see the head of this module).
    """
    # Of each geom: its body, the body to which this is welded, the parent of that one, and whether it moves.
    body, contype, conaffinity = model.geom_bodyid, model.geom_contype, model.geom_conaffinity
    weld = model.body_weldid[body]
    parent, moves = model.body_weldid[model.body_parentid[weld]], model.body_dofnum[weld] > 0
    flat = model.geom_type < 2  # mjGEOM_PLANE = 0 and mjGEOM_HFIELD = 1, which do not touch each other
    # Equal kinds have one index.
    indices: dict[Kind, int] = {}
    kind_indices = np.array([indices.setdefault(kind, len(indices)) for kind in kinds], int)

    partners = defaultdict(list)
    for k, (i, j) in enumerate(zip(model.pair_geom1.tolist(), model.pair_geom2.tolist(), strict=True)):
        partners[min(i, j)].append(max(i, j))
        if weld[i] != weld[j] and (moves[i] or moves[j]):  # else no force acts
            yield i, [j], k
    # Each geom i with all later ones j.
    for i in range(model.ngeom):
        j = np.arange(i + 1, model.ngeom)
        touch = ((contype[i] & conaffinity[j]) | (contype[j] & conaffinity[i])) != 0
        touch &= (weld[i] != weld[j]) & (moves[i] | moves[j]) & ~(flat[i] & flat[j])
        # A parent and its child do not touch, except for the world, body 0.
        if "mjDSBL_FILTERPARENT" not in flags:
            touch &= (weld[i] == 0) | (weld[j] == 0) | ((weld[i] != parent[j]) & (weld[j] != parent[i]))
        # An <exclude> has the number of two bodies that MuJoCo makes: the smaller index times 2^16, plus the larger
        # one.
        signature = (np.minimum(body[i], body[j]) << 16) + np.maximum(body[i], body[j])
        others = j[touch & ~np.isin(signature, model.exclude_signature) & ~np.isin(j, partners[i])]
        for kind in np.unique(kind_indices[others]):
            yield i, others[kind_indices[others] == kind].tolist(), None


def _row_state(model: Any, flags: set[str], first: Kind, second: Kind, k: int | None) -> tuple[State, str]:
    """Return what a contact of the kinds `first` and `second` has, and the rules of numbers that it mixes, in words.

    `model` is MuJoCo's, `flags` are the names of its flags that are set, and `k` is the index of a `<pair>`, or None.
    """
    # Numbers of two geoms are mixed. A contact has five numbers of friction: two for sliding, one for torsion, two for
    # rolling; a geom has one for each.
    option, (surface, rule) = model.opt, mixed_surface(first.surface, second.surface)
    # The geom with the higher priority decides on adhesion, too.
    adhesion = sum(kind.adhesion for kind in (first, second) if kind.surface.priority == surface.priority)
    values = [surface.solref, surface.solimp, surface.friction[:1] * 2 + surface.friction[1:] + surface.friction[2:]]
    condim, margin, rule = surface.condim, first.margin + second.margin, rule and f"mixed: {rule}"
    # A <pair> has all numbers itself, and the flag override replaces those of all contacts.
    if k is not None:
        values = [model.pair_solref[k], model.pair_solimp[k], model.pair_friction[k]]
        condim, margin, adhesion, rule = model.pair_dim[k], model.pair_margin[k], model.pair_adhesion[k], ""
    if "mjENBL_OVERRIDE" in flags:
        values, margin = [option.o_solref, option.o_solimp, option.o_friction], option.o_margin
        rule = "o_solref, o_solimp and o_friction replace those of all contacts (flag override)"
    marks = [*dict.fromkeys(kind.mark for kind in (first, second) if kind.mark)]
    # `getsolparam`: a solref with one positive number is replaced by the default.
    if (values[0][0] > 0) != (values[0][1] > 0):
        values[0] = (0.02, 1)
        marks.append("solref has both signs: MuJoCo takes 0.02 1")
    if margin:
        marks.append(f"contact begins at a distance of {margin:g} m (margin)")

    # Equal numbers may differ by a rounding: 15 digits make equal texts of them.
    solref, solimp, friction = (" ".join(f"{number:.15g}" for number in numbers) for numbers in values)
    sliding, _, torsion, rolling, _ = friction.split()
    settings = {
        "solref": solref,
        "solimp": solimp,
        "friction": f"{sliding} {torsion} {rolling}",
        "condim": str(condim),
        # The words of mjtCone and mjtIntegrator, in their order.
        "cone": ("pyramidal", "elliptic")[option.cone],
        "impratio": repr(option.impratio),
        "refsafe": "disable" if "mjDSBL_REFSAFE" in flags else "enable",
        "integrator": ("Euler", "RK4", "implicit", "implicitfast", "discrete")[option.integrator],
    }
    reason = "adhesion pulls, which is not computed" if adhesion else ""
    if "mjENBL_DIAGEXACT" in flags and settings["cone"] == "pyramidal" and condim > 1:
        reason = "the flag diagexact changes the pyramidal cone, which is not computed"
    # Weight presses if one body moves and one does not. `pressing` of the one that moves is 1, of a plane its cosine.
    falls = first.pressing * second.pressing if first.moves != second.moves else 0.0
    element = f'solimp="{solimp}" friction="{friction}" condim="{condim}"' + (
        f' margin="{margin:.15g}"' if margin else ""
    )
    # The line replaces a <pair> that is there, which may have a solref of its own for friction.
    if k is not None and model.pair_solreffriction[k].any():
        element += f' solreffriction="{" ".join(f"{number:.15g}" for number in model.pair_solreffriction[k])}"'
    return State(tuple(settings.items()), falls, tuple(marks), reason, element), rule


if __name__ == "__main__":
    print(json.dumps(model_facts(json.loads(sys.argv[1]))))
