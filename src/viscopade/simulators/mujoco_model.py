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
- `mj_contactParam`: `mujoco.mixed`. `mj_assignRef`, `mj_assignImp`, `mj_assignFriction` and `mj_assignMargin` of
  engine_core_constraint.c: with the flag `override` all contacts have o_solref, o_solimp, o_friction and o_margin.
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
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple
from xml.sax.saxutils import quoteattr

import numpy as np

from viscopade import files
from viscopade.extras import require
from viscopade.simulators.deck import Deck, DeckContact, Line, Run, Said, Size
from viscopade.simulators.mujoco import NATIVE, SIMULATOR, Surface, mixed
from viscopade.simulators.native import FileUnits

MEMORY, SECONDS = 1 << 32, 60
"""Limits of the process that compiles: bytes of its address space, and its duration."""
_MOST_GEOMS, _MOST_ROWS = 5000, 1000  # pairs of geoms are compared one by one; each row takes about 0.1 s
_WRITTEN = 50  # pairs of geoms, up to which each has a line to write instead


class Kind(NamedTuple):
    """What decides the contacts of a geom.

    Attributes
    ----------
    surface : Surface
    margin, adhesion : float
        Those of a contact are the sums of both geoms'.
    moves : bool
        Whether its body has degrees of freedom.
    level : bool
        Whether a body's whole weight may press on it.
    mark : str
        Why eps is not that of free bodies whose centres lie on the normal; "" if it is.
    """

    surface: Surface
    margin: float
    adhesion: float
    moves: bool
    level: bool
    mark: str


class State(NamedTuple):
    """What is equal in all contacts of a row; fields as those of `DeckContact`."""

    settings: tuple[tuple[str, str], ...]
    falls: bool
    marks: tuple[str, ...]
    reason: str


def read(path: Path, said: Said) -> Deck:
    """Return the contacts of a model.

    Parameters
    ----------
    path : Path
    said : Said
        Nothing of it has an effect: a model says everything itself.

    Raises
    ------
    MissingPackage
        If MuJoCo is not installed.
    ValueError
        If the file is no model.
    """
    require("viscopade audit FILE", "mujoco")
    text = files.content(path, "a model of MuJoCo (MJCF)").decode(errors="replace").splitlines()
    try:
        printed = files.printed_by(__file__, str(path.resolve()), b"", MEMORY, SECONDS, "a smaller model")
    except ValueError as error:
        raise ValueError(f"MuJoCo cannot read {path}: {error}") from None
    facts = json.loads(next(line for line in printed.splitlines() if line.startswith(b"{")))

    def line(tag: str, number: int) -> Line:
        """Return where an element begins; number 0 if it stands in another file, of which MuJoCo keeps no number."""
        source = text[number - 1].strip() if 0 < number <= len(text) else ""
        return Line(path, number, source) if f"<{tag}" in source else Line(path, 0, f"<{tag}>")

    contacts = []
    for (settings, falls, marks, reason), names, place, masses, count, rule in facts["rows"]:
        first, second = (Size(None, mass) if mass else None for mass in masses)
        assert first is not None
        write = partial(_lines, dict(settings), names, bool(facts["override"]))
        name, sizes = (
            " - ".join(name if isinstance(name, str) else f"geom {name}" for name in names[0]),
            ((first, second),),
        )
        marks = (*([rule] if rule else []), *marks)
        contacts.append(DeckContact(name, line(*place), dict(settings), sizes, falls, count, reason, marks, write))
    run = Run(None, facts["step"], facts["gravity"], tuple(contacts))
    unread = tuple(Line(path, number, tag) for tag, number in facts["unread"].items())
    return Deck(SIMULATOR, path, FileUnits(), (run,), (), unread, tuple(facts["warnings"]))


def _lines(
    settings: Mapping[str, str], names: list[tuple[Any, Any]], override: bool, instead: Mapping[str, str]
) -> tuple[str, ...]:
    """Return what gives the contacts of pairs of geoms other values, as lines of the model."""
    values = {f"o_{name}" if override else name: text for name, text in instead.items()}
    changed = " ".join(f'{name}="{text}"' for name, text in values.items())
    if override:
        return (f"<option {changed}/>",)
    if len(names) > _WRITTEN or not all(isinstance(name, str) for pair in names for name in pair):
        return (f"<geom {changed}/> <!-- both geoms of each pair -->",)
    # A pair has no numbers of its geoms; it has friction in two directions of sliding, and of rolling.
    sliding, torsion, rolling = settings["friction"].split()
    changed += f' solimp="{settings["solimp"]}" condim="{settings["condim"]}"'
    changed += f' friction="{sliding} {sliding} {torsion} {rolling} {rolling}"'
    return tuple(f"<pair geom1={quoteattr(i)} geom2={quoteattr(j)} {changed}/>" for i, j in names)


def facts_of(file: str) -> dict[str, Any]:
    """Return what MuJoCo makes of a model, as JSON has it."""
    import mujoco

    # Lines where elements begin are known before the model is compiled, and are in the order of its arrays then.
    spec = mujoco.MjSpec.from_file(file)
    spec.memory = -1  # as much as contacts of the model need
    model = spec.compile()
    parts = {"geom": spec.geoms, "pair": spec.pairs, "equality": spec.equalities, "tendon": spec.tendons}
    parts |= {"actuator": spec.actuators, "flex": spec.flexes, "plugin": spec.plugins}
    numbers = {
        tag: [int("0" + "".join(filter(str.isdigit, part.info))) for part in sorted(some, key=lambda part: part.id)]
        for tag, some in parts.items()
    }
    option, flags = model.opt, set()
    for bits, value in ((mujoco.mjtDisableBit, model.opt.disableflags), (mujoco.mjtEnableBit, model.opt.enableflags)):
        flags |= {name for name, bit in bits.__members__.items() if value & int(bit)}
    for name in ("mjDSBL_CONTACT", "mjDSBL_CONSTRAINT"):
        if name in flags:
            raise ValueError(f"the flag {name[7:].lower()} disables all contacts")
    if model.ngeom > _MOST_GEOMS:
        raise ValueError(f"it has {model.ngeom} geoms: expected at most {_MOST_GEOMS}")
    gravity = np.zeros(3) if "mjDSBL_GRAVITY" in flags else option.gravity
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)

    # Pairs of geoms with equal contacts make a row.
    kinds = [_kind(model, data, gravity, i) for i in range(model.ngeom)]
    weld = model.body_weldid[model.geom_bodyid]
    rows: dict[State, list[Any]] = {}
    for i, partners, k in _touching(model, flags, kinds):
        state, rule = _state(model, flags, kinds[i], kinds[partners[0]], k)
        # A body that moves is the first of both.
        pairs = [(i, j) if kinds[i].moves else (j, i) for j in partners]
        masses = [float(model.body_subtreemass[weld[geom]]) if kinds[geom].moves else None for geom in pairs[0]]
        place = ("geom", numbers["geom"][pairs[0][0]]) if k is None else ("pair", numbers["pair"][k])
        row = rows.setdefault(state, [state, [], place, masses, 0, rule])
        row[1] += [
            tuple(model.geom(geom).name or geom for geom in pair) for pair in pairs[: _WRITTEN + 1 - len(row[1])]
        ]
        row[4] += len(pairs)
        if len(rows) > _MOST_ROWS:
            raise ValueError(f"it has more than {_MOST_ROWS} different contacts: expected fewer")
    return {
        "rows": [*rows.values()],
        "override": "mjENBL_OVERRIDE" in flags,
        "step": option.timestep,
        "gravity": float(np.linalg.norm(gravity)),
        "unread": {tag: some[0] for tag, some in numbers.items() if some and tag not in ("geom", "pair")},
        "warnings": [
            sentence
            for sentence, condition in {
                "Contacts of flexes are not computed": model.nflex,
                "Equality constraints tie bodies together, which changes eps": model.neq,
                "Density and viscosity of the medium change eps": option.density or option.viscosity,
                "gravcomp carries bodies: eps with weight has their whole weight": model.body_gravcomp.any(),
                "Speculative contacts change eps where a body moves by its own size in a step": "mjENBL_SPECULATIVE"
                in flags,
            }.items()
            if condition
        ],
    }


def _kind(model: Any, data: Any, gravity: Any, geom: int) -> Kind:
    """Return what decides the contacts of a geom."""
    import mujoco

    body = model.geom_bodyid[geom]
    shape, moves = mujoco.mjtGeom(model.geom_type[geom]).name, bool(model.body_dofnum[model.body_weldid[body]])
    level, mark = True, ""
    if moves:
        joint, dof = model.body_jntadr[body], model.body_dofadr[body]
        free = model.body_jntnum[body] == 1 and model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE
        # Armature, damping and friction of a free joint act on the body as well.
        forces = [
            force[dof : dof + 3].any() for force in (model.dof_armature, model.dof_damping, model.dof_frictionloss)
        ]
        off = np.linalg.norm(model.geom_pos[geom] - model.body_ipos[body]) > 1e-9 * model.geom_size[geom][0]
        if not free or any(forces) or model.body_subtreemass[body] != model.body_mass[body]:
            mark = "a geom on a jointed body"
        elif shape != "mjGEOM_SPHERE" or off:
            mark = "a geom that is no sphere around the centre of mass"
    elif shape == "mjGEOM_PLANE":
        # The part of the weight that presses on a plane is that along its normal, the third column of the matrix.
        pressing = float(-data.geom_xmat[geom][2::3] @ gravity) / (float(np.linalg.norm(gravity)) or 1.0)
        level = pressing > 1 - 1e-6
        mark = "an inclined plane: eps is without weight" if pressing > 1e-6 and not level else ""
    elif shape in ("mjGEOM_HFIELD", "mjGEOM_SDF"):
        mark = "a geom that touches at several points"
    numbers: list[Any] = [getattr(model, f"geom_{name}")[geom].tolist() for name in Surface._fields]
    surface = Surface(*numbers[:3], *map(tuple, numbers[3:]))
    return Kind(surface, float(model.geom_margin[geom]), float(model.geom_adhesion[geom]), moves, level, mark)


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
    """Return what a contact has, and the rule by which two geoms are mixed; k is the index of a `<pair>`."""
    option, (surface, rule) = model.opt, mixed(first.surface, second.surface)
    rule = rule and f"mixed: {rule}"
    # The geom with the higher priority decides on adhesion, too.
    adhesion = sum(kind.adhesion for kind in (first, second) if kind.surface.priority == surface.priority)
    margin = first.margin + second.margin
    if k is not None:
        numbers = (
            model.pair_solref[k].tolist(),
            model.pair_solimp[k].tolist(),
            model.pair_friction[k][[0, 2, 3]].tolist(),
        )
        surface, rule = Surface(0, 0, int(model.pair_dim[k]), *map(tuple, numbers)), ""
        margin, adhesion = model.pair_margin[k], model.pair_adhesion[k]
    if "mjENBL_OVERRIDE" in flags:
        numbers = (option.o_solref.tolist(), option.o_solimp.tolist(), option.o_friction[[0, 2, 3]].tolist())
        surface, margin = Surface(0, 0, surface.condim, *map(tuple, numbers)), option.o_margin
        rule = "o_solref, o_solimp and o_friction replace those of all contacts (flag override)"
    marks = [*dict.fromkeys(kind.mark for kind in (first, second) if kind.mark)]
    if (surface.solref[0] > 0) != (surface.solref[1] > 0):
        surface = surface._replace(solref=(0.02, 1.0))
        marks.append("solref has both signs: MuJoCo takes 0.02 1")
    if margin:
        marks.append(f"contact begins at a distance of {margin:g} m (margin)")
    settings = {
        **{name: " ".join(map(repr, getattr(surface, name))) for name in ("solref", "solimp", "friction")},
        "condim": str(surface.condim),
        "cone": ("pyramidal", "elliptic")[option.cone],
        "impratio": repr(option.impratio),
        "refsafe": "disable" if "mjDSBL_REFSAFE" in flags else "enable",
        "integrator": ("Euler", "RK4", "implicit", "implicitfast", "discrete")[option.integrator],
    }
    reason = "adhesion pulls, which is not computed" if adhesion else ""
    if "mjENBL_DIAGEXACT" in flags and settings["cone"] == "pyramidal" and surface.condim > 1:
        reason = "the flag diagexact changes the pyramidal cone, which is not computed"
    try:
        NATIVE.values(settings)
    except ValueError as error:
        reason = str(error)
    falls = first.moves != second.moves and first.level and second.level
    return State(tuple(settings.items()), falls, tuple(marks), reason), rule


if __name__ == "__main__":
    try:
        print(json.dumps(facts_of(json.loads(sys.argv[1]))))
    except Exception as error:
        sys.exit(" ".join(str(error).split()))
