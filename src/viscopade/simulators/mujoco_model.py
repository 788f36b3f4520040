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
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
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
"""Limits of the process that compiles and compares pairs of geoms: bytes of its address space, and its duration."""
_ARENA = 1 << 28  # bytes for contacts, of which a model may ask for more than there are
_MOST_LINES = 50  # to write instead for one row
_LONGEST_LINE = 200  # characters of a line of the model that are kept; all of a model may stand in one


class Kind(NamedTuple):
    """What decides the contacts of a geom.

    Attributes
    ----------
    surface : Surface
    margin, adhesion : float
        Those of a contact are the sums of both geoms'.
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
    """What is equal in all contacts of a row; `element` is a `<pair>` but for its geoms and solref."""

    settings: tuple[tuple[str, str], ...]
    falls: float
    marks: tuple[str, ...]
    reason: str
    element: str


def read_model(path: Path, said: DeckOptions) -> Deck:
    """Return the contacts of a model.

    Parameters
    ----------
    path : Path
    said : DeckOptions
        Nothing: a model says everything itself.

    Raises
    ------
    MissingPackage
        If MuJoCo is not installed.
    ValueError
        If the file is no model, or something is said.
    """
    require("viscopade audit FILE", "mujoco")
    if said != DeckOptions():
        raise ValueError("a model of MuJoCo takes no variable, radius or density: expected --speed, --epsilon, …")
    text = files.content(path, "a model of MuJoCo (MJCF)").decode(errors="replace").splitlines()
    try:
        printed = files.printed_by(__file__, str(path.resolve()), b"", MEMORY, SECONDS, "a smaller model")
    except ValueError as error:
        raise ValueError(f"MuJoCo cannot read {path}: {error}") from None
    facts = json.loads(next(line for line in printed.splitlines() if line.startswith(b"{")))

    contacts = []
    for (settings, falls, marks, reason, _), name, (tag, number), (mass, other), rule, count, lines in facts["rows"]:
        # A geom of an included file has no line, or one of that file.
        source = text[number - 1] if 0 < number <= len(text) else ""
        line = Line(path, number, source.strip()[:_LONGEST_LINE]) if f"<{tag}" in source else Line(path, 0, f"<{tag}>")
        sizes = ((Size(None, mass), Size(None, other) if other else None),)
        marks = tuple(filter(None, (rule, *marks)))
        write = partial(_written, lines, facts["prefix"])
        contacts.append(DeckContact(name, line, dict(settings), sizes, falls, count, reason, marks, write))
    run = DeckRun(None, facts["step"], facts["gravity"], tuple(contacts))
    unread = tuple(Line(path, number, tag) for tag, number in facts["unread"].items())
    return Deck(SIMULATOR, path, FileUnits(), (run,), (), unread, tuple(facts["warnings"]))


def _written(elements: Sequence[str], prefix: str, instead: Mapping[str, str]) -> tuple[str, ...]:
    """Return elements of the model with other values of parameters."""
    changed = " ".join(f'{prefix}{name}="{text}"' for name, text in instead.items())
    return tuple(f"{element} {changed}/>" for element in elements)


def facts_of(file: str) -> dict[str, Any]:
    """Return what MuJoCo makes of a model, as JSON has it."""
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

    # "line 12" where an element begins, in the order of the arrays of the model.
    parts = {"geom": spec.geoms, "pair": spec.pairs, "equality": spec.equalities, "tendon": spec.tendons}
    parts |= {"actuator": spec.actuators, "flex": spec.flexes, "plugin": spec.plugins}
    numbers = {
        tag: [int("0" + "".join(filter(str.isdigit, part.info))) for part in sorted(some, key=lambda part: part.id)]
        for tag, some in parts.items()
    }

    # Pairs of geoms with equal contacts make a row.
    kinds = [_kind(model, data, gravity, geom) for geom in range(model.ngeom)]
    mass = model.body_subtreemass[model.body_weldid[model.geom_bodyid]]
    rows: dict[State, list[Any]] = {}
    for i, partners, k in _touching(model, flags, kinds):
        state, rule = _state(model, flags, kinds[i], kinds[partners[0]], k)
        # The first geom of both moves.
        pairs = [(i, j) if kinds[i].moves else (j, i) for j in partners]
        place = ("geom", numbers["geom"][pairs[0][0]]) if k is None else ("pair", numbers["pair"][k])
        masses = [float(mass[geom]) if kinds[geom].moves else None for geom in pairs[0]]
        name = " - ".join(model.geom(geom).name or f"geom {geom}" for geom in pairs[0])
        row = rows.setdefault(state, [state, name, place, masses, rule, 0, []])
        row[-2] += len(pairs)
        for names in ([model.geom(geom).name for geom in pair] for pair in pairs[: _MOST_LINES + 1 - len(row[-1])]):
            first, second = map(quoteattr, names)
            row[-1].append(f"<pair geom1={first} geom2={second} {state.element}" if all(names) else "<geom")
    for row in rows.values():
        if override or "<geom" in row[-1] or len(row[-1]) > _MOST_LINES:
            row[-1] = ["<option" if override else "<geom"]
    warnings = {
        "Equality constraints tie bodies together, which changes eps": model.neq,
        "Density and viscosity of the medium change eps": option.density or option.viscosity,
        "gravcomp carries bodies: eps with weight has their whole weight": model.body_gravcomp.any(),
        "Speculative contacts change eps if a body moves by its size in a step": "mjENBL_SPECULATIVE" in flags,
    }
    return {
        "rows": [*rows.values()],
        "prefix": "o_" if override else "",
        "step": option.timestep,
        "gravity": float(np.linalg.norm(gravity)),
        "unread": {tag: lines[0] for tag, lines in numbers.items() if lines and tag not in ("geom", "pair")},
        "warnings": [sentence for sentence, holds in warnings.items() if holds],
    }


def _kind(model: Any, data: Any, gravity: Any, geom: int) -> Kind:
    """Return what decides the contacts of a geom."""
    import mujoco

    body = model.geom_bodyid[geom]
    shape, moves = mujoco.mjtGeom(model.geom_type[geom]).name, bool(model.body_dofnum[model.body_weldid[body]])
    pressing, mark = 1.0, ""
    if moves:
        joint, dof = model.body_jntadr[body], model.body_dofadr[body]
        free = model.body_jntnum[body] == 1 and model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE
        # Armature, damping and friction of a free joint act on the body as well.
        forces = model.dof_armature + model.dof_damping + model.dof_frictionloss
        distance = np.linalg.norm(model.geom_pos[geom] - model.body_ipos[body])
        if not free or forces[dof : dof + 3].any() or model.body_subtreemass[body] != model.body_mass[body]:
            mark = "a geom on a jointed body: eps is that of a free one"
        elif shape != "mjGEOM_SPHERE" or distance > 1e-9 * model.geom_size[geom][0]:
            mark = "a geom that is no sphere around its body's centre of mass: eps is that of such a sphere"
    elif shape == "mjGEOM_PLANE":
        # The normal of a plane is the third column of its matrix.
        cosine = float(-data.geom_xmat[geom][2::3] @ gravity) / (float(np.linalg.norm(gravity)) or 1.0)
        pressing = max(round(cosine, 9), 0.0)
        mark = INCLINED if 0 < pressing < 1 else ""
    elif shape in ("mjGEOM_HFIELD", "mjGEOM_SDF"):
        mark = "a geom that touches at several points: eps is that of a single one"
    numbers: list[Any] = [getattr(model, f"geom_{name}")[geom].tolist() for name in Surface._fields]
    surface = Surface(*numbers[:3], *map(tuple, numbers[3:]))
    return Kind(surface, float(model.geom_margin[geom]), float(model.geom_adhesion[geom]), moves, pressing, mark)


def _touching(model: Any, flags: set[str], kinds: list[Kind]) -> Iterator[tuple[int, list[int], int | None]]:
    """Yield a geom, others of one kind that it may touch, and the index of the `<pair>` that says so."""
    body, contype, conaffinity = model.geom_bodyid, model.geom_contype, model.geom_conaffinity
    weld = model.body_weldid[body]
    parent, moves = model.body_weldid[model.body_parentid[weld]], model.body_dofnum[weld] > 0
    flat = model.geom_type < 2  # planes and height fields, which do not touch each other
    indices: dict[Kind, int] = {}
    kind_indices = np.array([indices.setdefault(kind, len(indices)) for kind in kinds], int)

    partners = defaultdict(list)
    for k, (i, j) in enumerate(zip(model.pair_geom1.tolist(), model.pair_geom2.tolist(), strict=True)):
        partners[min(i, j)].append(max(i, j))
        if weld[i] != weld[j] and (moves[i] or moves[j]):  # else no force acts
            yield i, [j], k
    for i in range(model.ngeom):
        j = np.arange(i + 1, model.ngeom)
        touch = ((contype[i] & conaffinity[j]) | (contype[j] & conaffinity[i])) != 0
        touch &= (weld[i] != weld[j]) & (moves[i] | moves[j]) & ~(flat[i] & flat[j])
        if "mjDSBL_FILTERPARENT" not in flags:
            touch &= (weld[i] == 0) | (weld[j] == 0) | ((weld[i] != parent[j]) & (weld[j] != parent[i]))
        signature = (np.minimum(body[i], body[j]) << 16) + np.maximum(body[i], body[j])
        others = j[touch & ~np.isin(signature, model.exclude_signature) & ~np.isin(j, partners[i])]
        for kind in np.unique(kind_indices[others]):
            yield i, others[kind_indices[others] == kind].tolist(), None


def _state(model: Any, flags: set[str], first: Kind, second: Kind, k: int | None) -> tuple[State, str]:
    """Return what a contact has, and the rule by which it has it of two geoms; k is the index of a `<pair>`."""
    option, (surface, rule) = model.opt, mixed_surface(first.surface, second.surface)
    # The geom with the higher priority decides on adhesion, too.
    adhesion = sum(kind.adhesion for kind in (first, second) if kind.surface.priority == surface.priority)
    values = [surface.solref, surface.solimp, surface.friction[:1] * 2 + surface.friction[1:] + surface.friction[2:]]
    condim, margin, rule = surface.condim, first.margin + second.margin, rule and f"mixed: {rule}"
    if k is not None:
        values = [model.pair_solref[k], model.pair_solimp[k], model.pair_friction[k]]
        condim, margin, adhesion, rule = model.pair_dim[k], model.pair_margin[k], model.pair_adhesion[k], ""
    if "mjENBL_OVERRIDE" in flags:
        values, margin = [option.o_solref, option.o_solimp, option.o_friction], option.o_margin
        rule = "o_solref, o_solimp and o_friction replace those of all contacts (flag override)"
    marks = [*dict.fromkeys(kind.mark for kind in (first, second) if kind.mark)]
    if (values[0][0] > 0) != (values[0][1] > 0):
        values[0] = (0.02, 1)
        marks.append("solref has both signs: MuJoCo takes 0.02 1")
    if margin:
        marks.append(f"contact begins at a distance of {margin:g} m (margin)")

    # Equal numbers may differ by a rounding. Of five numbers of friction, two are for sliding and two for rolling.
    solref, solimp, friction = (" ".join(f"{number:.15g}" for number in numbers) for numbers in values)
    sliding, _, torsion, rolling, _ = friction.split()
    settings = {
        "solref": solref,
        "solimp": solimp,
        "friction": f"{sliding} {torsion} {rolling}",
        "condim": str(condim),
        "cone": ("pyramidal", "elliptic")[option.cone],
        "impratio": repr(option.impratio),
        "refsafe": "disable" if "mjDSBL_REFSAFE" in flags else "enable",
        "integrator": ("Euler", "RK4", "implicit", "implicitfast", "discrete")[option.integrator],
    }
    reason = "adhesion pulls, which is not computed" if adhesion else ""
    if "mjENBL_DIAGEXACT" in flags and settings["cone"] == "pyramidal" and condim > 1:
        reason = "the flag diagexact changes the pyramidal cone, which is not computed"
    # The other one, which moves, has 1.
    falls = first.pressing * second.pressing if first.moves != second.moves else 0.0
    element = f'solimp="{solimp}" friction="{friction}" condim="{condim}"' + (
        f' margin="{margin:.15g}"' if margin else ""
    )
    return State(tuple(settings.items()), falls, tuple(marks), reason, element), rule


if __name__ == "__main__":
    print(json.dumps(facts_of(json.loads(sys.argv[1]))))
