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
- `getsolparam`: a solref with one positive number is replaced by 0.02 1.

The force per effective mass is that of free bodies whose centres lie on the normal. A geom for which this does not hold
has a mark, and the difference is not computed.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple
from xml.sax.saxutils import quoteattr

import numpy as np

from viscopade.extras import require
from viscopade.files import content
from viscopade.simulators.deck import Deck, DeckContact, Line, Run, Said, Size
from viscopade.simulators.mujoco import NATIVE, SIMULATOR, Surface, mixed
from viscopade.simulators.native import FileUnits

MEMORY, SECONDS = 1 << 32, 60
"""Limits of the process that compiles: bytes of its address space, on Linux, and its duration."""
_MOST_GEOMS, _MOST_CONTACTS = 10_000, 1000  # pairs of geoms are compared one by one; each contact takes about 0.1 s
_WRITTEN = 50  # pairs of geoms, up to which each has a line to write instead

_COMPILER = """
import json, re, sys
file, folder, memory, sys.path[:] = json.loads(sys.argv[1])
if sys.platform == "linux":
    import resource
    hard = resource.getrlimit(resource.RLIMIT_AS)[1]
    resource.setrlimit(resource.RLIMIT_AS, (memory if hard < 0 else min(memory, hard), hard))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
import mujoco
try:
    spec = mujoco.MjSpec.from_file(file)
    spec.memory = 1 << 20
    model = spec.compile()
except (ValueError, mujoco.FatalError) as error:
    sys.exit(" ".join(str(error).split()))
mujoco.mj_saveModel(model, folder + "/model.mjb")
kinds = {"geom": spec.geoms, "pair": spec.pairs, "equality": spec.equalities, "tendon": spec.tendons,
         "actuator": spec.actuators, "flex": spec.flexes, "plugin": spec.plugins}
lines = {kind: [int("0" + re.sub("[^0-9]", "", part.info)) for part in sorted(parts, key=lambda part: part.id)]
         for kind, parts in kinds.items()}
json.dump(lines, open(folder + "/lines.json", "w"))
"""


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
    """What is equal in all contacts of a row: fields as those of `DeckContact`."""

    settings: tuple[tuple[str, str], ...]
    margin: float
    falls: bool
    marks: tuple[str, ...]
    reason: str


class Pairs(NamedTuple):
    """Pairs of geoms with equal contacts: their number, the first of them, the rule of mixing, index of a pair."""

    number: int
    geoms: list[tuple[int, int]]
    rule: str = ""
    explicit: int | None = None


def read(path: Path, said: Said) -> Deck:
    """Return the contacts of a model.

    Parameters
    ----------
    path : Path
    said : Said
        Nothing: a model says everything itself.

    Raises
    ------
    MissingPackage
        If MuJoCo is not installed.
    ValueError
        If the file is no model, or an option has no meaning for a model.
    """
    require("viscopade audit FILE", "mujoco")
    import mujoco

    if said != Said():
        raise ValueError("a model of MuJoCo has no variables, radii or densities to set: expected no such option")
    text = content(path, "a model of MuJoCo (MJCF)").decode(errors="replace").splitlines()
    model, lines = _compiled(path)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)

    def line(kind: str, index: int) -> Line:
        """Return where an element begins; number 0 if it stands in another file, of which MuJoCo keeps no number."""
        number = lines[kind][index]
        begins = 0 < number <= len(text) and (kind not in ("geom", "pair") or f"<{kind}" in text[number - 1])
        return Line(path, number, text[number - 1].strip()) if begins else Line(path, 0, f"<{kind}>")

    def name(geom: int) -> str:
        return model.geom(geom).name or f"geom {geom}"

    # Geoms of one kind have equal contacts; pairs of kinds then give rows.
    indices: dict[Kind, int] = {}
    kind_of_geom = np.array([indices.setdefault(_kind(model, data, i), len(indices)) for i in range(model.ngeom)], int)
    kinds = [*indices]
    rows: defaultdict[State, list[Pairs]] = defaultdict(list)
    for pairs in _pairs(model, kind_of_geom):
        first, second = (kinds[kind_of_geom[geom]] for geom in pairs.geoms[0])
        k = pairs.explicit
        if k is None:
            surface, rule = mixed(first.surface, second.surface)
            # Adhesion is the sum, unless the geom with the higher priority decides.
            decisive = [kind for kind in (first, second) if kind.surface.priority == surface.priority]
            margin, adhesion = first.margin + second.margin, sum(kind.adhesion for kind in decisive)
        else:
            friction = model.pair_friction[k][[0, 2, 3]]
            numbers = (model.pair_solref[k].tolist(), model.pair_solimp[k].tolist(), friction.tolist())
            surface, rule = Surface(0, 0, int(model.pair_dim[k]), *map(tuple, numbers)), ""
            margin, adhesion = float(model.pair_margin[k]), float(model.pair_adhesion[k])
        falls = (first.moves or first.level) and (second.moves or second.level) and first.moves != second.moves
        marks = dict.fromkeys(kind.mark for kind in (first, second) if kind.mark)
        state = _state(model, surface, margin, adhesion, falls, (*marks,))
        rows[state].append(pairs._replace(rule=rule))
        if len(rows) > _MOST_CONTACTS:
            raise ValueError(f"{path} has more than {_MOST_CONTACTS} different contacts: expected fewer")

    contacts = []
    for state, parts in rows.items():
        geoms = [pair for part in parts for pair in part.geoms]
        count = sum(part.number for part in parts)
        masses = [Size(None, float(model.body_subtreemass[model.body_weldid[model.geom_bodyid[i]]])) for i in geoms[0]]
        moving = [kinds[kind_of_geom[i]].moves for i in geoms[0]]
        explicit = parts[0].explicit
        written = [(name(i), name(j)) for i, j in geoms] if len(geoms) == count else []
        if not all(model.geom(i).name for pair in geoms for i in pair):
            written = []
        contacts.append(
            DeckContact(
                " - ".join(map(name, geoms[0])),
                line("geom", geoms[0][0]) if explicit is None else line("pair", explicit),
                dict(state.settings),
                ((masses[0], masses[1] if all(moving) else None),),
                state.falls,
                count,
                state.reason,
                (*(f"mixed: {rule}" for rule in dict.fromkeys(part.rule for part in parts) if rule), *state.marks),
                _written(state, written, count, _flag(model, "mjENBL_OVERRIDE")),
            )
        )
    gravity = 0.0 if _flag(model, "mjDSBL_GRAVITY") else float(np.linalg.norm(model.opt.gravity))
    run = Run(None, float(model.opt.timestep), gravity, tuple(contacts))
    unread = tuple(line(kind, 0) for kind in lines if kind not in ("geom", "pair") and lines[kind])
    return Deck(SIMULATOR, path, FileUnits(), (run,), (), unread, tuple(_warnings(model, contacts)))


def _flag(model: Any, name: str) -> bool:
    """Return whether a flag is set, one that disables or one that enables."""
    import mujoco

    disables = name.startswith("mjDSBL")
    bits = mujoco.mjtDisableBit if disables else mujoco.mjtEnableBit
    return bool((model.opt.disableflags if disables else model.opt.enableflags) & int(getattr(bits, name)))


def _compiled(path: Path) -> tuple[Any, dict[str, list[int]]]:
    """Return the model that MuJoCo makes of a file, and the lines where elements begin, by tag, 0 if unknown."""
    import mujoco

    with tempfile.TemporaryDirectory() as folder:  # where MuJoCo may write MUJOCO_LOG.TXT
        words = [sys.executable, "-I", "-c", _COMPILER, json.dumps([str(path.resolve()), folder, MEMORY, sys.path])]
        environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
        try:
            run = subprocess.run(words, cwd=folder, env=environment, capture_output=True, timeout=SECONDS, check=False)
        except subprocess.TimeoutExpired:
            raise ValueError(f"MuJoCo takes more than {SECONDS} s for {path}: expected a smaller model") from None
        message = run.stderr.decode(errors="replace").strip().rpartition("\n")[2]
        if run.returncode < 0 or "MemoryError" in message or "bad_alloc" in message:
            raise ValueError(f"MuJoCo ends without a model of {path}: expected a smaller model")
        if run.returncode:
            raise ValueError(f"MuJoCo cannot compile {path}: {message}")
        lines = json.loads(Path(folder, "lines.json").read_text())
        return mujoco.MjModel.from_binary_path(str(Path(folder, "model.mjb"))), lines


def _kind(model: Any, data: Any, geom: int) -> Kind:
    """Return what decides the contacts of a geom."""
    import mujoco

    body = model.geom_bodyid[geom]
    weld, shape = model.body_weldid[body], model.geom_type[geom]
    moves, level, mark = bool(model.body_dofnum[weld]), True, ""
    if not moves and shape == mujoco.mjtGeom.mjGEOM_PLANE:
        # The part of the weight that presses on a plane is that along its normal, the third column of the matrix.
        weight = model.opt.gravity
        pressing = -float(data.geom_xmat[geom].reshape(3, 3)[:, 2] @ weight) / (float(np.linalg.norm(weight)) or 1.0)
        level = pressing > 1 - 1e-6
        mark = "an inclined plane: eps is without weight" if 1e-6 < pressing < 1 - 1e-6 else ""
    elif not moves and shape in (mujoco.mjtGeom.mjGEOM_HFIELD, mujoco.mjtGeom.mjGEOM_SDF):
        mark = "a geom that touches at several points"
    elif moves:
        joint, dof = model.body_jntadr[body], model.body_dofadr[body]
        free = model.body_jntnum[body] == 1 and model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE
        alone = free and model.body_subtreemass[body] == model.body_mass[body]
        # Armature, damping and friction of a free joint act on the body as well.
        forces = (model.dof_armature, model.dof_damping, model.dof_frictionloss)
        if not alone or any(force[dof : dof + 3].any() for force in forces):
            mark = "a geom on a jointed body"
        elif shape != mujoco.mjtGeom.mjGEOM_SPHERE:
            mark = "a geom that is no sphere"
        elif np.linalg.norm(model.geom_pos[geom] - model.body_ipos[body]) > 1e-9 * model.geom_size[geom][0]:
            mark = "a sphere off its body's centre of mass"
    surface = Surface(
        int(model.geom_priority[geom]),
        float(model.geom_solmix[geom]),
        int(model.geom_condim[geom]),
        tuple(model.geom_solref[geom].tolist()),
        tuple(model.geom_solimp[geom].tolist()),
        tuple(model.geom_friction[geom].tolist()),
    )
    return Kind(surface, float(model.geom_margin[geom]), float(model.geom_adhesion[geom]), moves, level, mark)


def _pairs(model: Any, kinds: Any) -> Iterator[Pairs]:
    """Yield the pairs of geoms that may touch: each `<pair>`, then those of every two kinds; the first geom moves."""
    import mujoco

    if _flag(model, "mjDSBL_CONTACT") or _flag(model, "mjDSBL_CONSTRAINT"):
        return
    if model.ngeom > _MOST_GEOMS:
        raise ValueError(f"the model has {model.ngeom} geoms: expected at most {_MOST_GEOMS}")
    body, contype, conaffinity = model.geom_bodyid, model.geom_contype, model.geom_conaffinity
    weld = model.body_weldid[body]
    parent, moves = model.body_weldid[model.body_parentid[weld]], model.body_dofnum[weld] > 0
    flat = np.isin(model.geom_type, (mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_HFIELD))

    def ordered(i: int, j: int) -> tuple[int, int]:
        return (int(i), int(j)) if moves[i] else (int(j), int(i))

    partners = defaultdict(list)
    for k, (i, j) in enumerate(zip(model.pair_geom1.tolist(), model.pair_geom2.tolist(), strict=True)):
        partners[min(i, j)].append(max(i, j))
        if moves[i] or moves[j]:
            yield Pairs(1, [ordered(i, j)], explicit=k)

    touching: dict[tuple[int, int], Pairs] = {}
    for i in range(model.ngeom):
        j = np.arange(i + 1, model.ngeom)
        touch = ((contype[i] & conaffinity[j]) | (contype[j] & conaffinity[i])) != 0
        touch &= (weld[i] != weld[j]) & (moves[i] | moves[j]) & ~(flat[i] & flat[j])
        if not _flag(model, "mjDSBL_FILTERPARENT"):
            touch &= (weld[i] == 0) | (weld[j] == 0) | ((weld[i] != parent[j]) & (weld[j] != parent[i]))
        both = np.sort([np.full_like(body[j], body[i]), body[j]], axis=0)
        touch &= ~np.isin((both[0] << 16) + both[1], model.exclude_signature) & ~np.isin(j, partners[i])
        for kind in np.unique(kinds[j[touch]]).tolist():
            others = j[touch & (kinds[j] == kind)]
            key = min(kinds[i], kind), max(kinds[i], kind)
            count, geoms, *_ = touching.get(key, Pairs(0, []))
            geoms += [ordered(i, other) for other in others[: _WRITTEN - len(geoms)]]
            touching[key] = Pairs(count + len(others), geoms)
    yield from touching.values()


def _state(model: Any, surface: Surface, margin: float, adhesion: float, falls: bool, marks: tuple[str, ...]) -> State:
    """Return what a contact has, with the options of the model."""
    option = model.opt
    if _flag(model, "mjENBL_OVERRIDE"):
        numbers = (option.o_solref.tolist(), option.o_solimp.tolist(), option.o_friction[[0, 2, 3]].tolist())
        solref, solimp, friction = map(tuple, numbers)
        surface, margin = surface._replace(solref=solref, solimp=solimp, friction=friction), float(option.o_margin)
    if (surface.solref[0] > 0) != (surface.solref[1] > 0):
        surface, marks = surface._replace(solref=(0.02, 1.0)), (*marks, "solref of both signs: MuJoCo takes 0.02 1")
    if margin:
        marks = (*marks, f"contact begins at a distance of {margin:g} m (margin)")
    settings = {
        "solref": " ".join(map(repr, surface.solref)),
        "solimp": " ".join(map(repr, surface.solimp)),
        "friction": " ".join(map(repr, surface.friction)),
        "condim": str(surface.condim),
        "cone": ("pyramidal", "elliptic")[option.cone],
        "impratio": repr(float(option.impratio)),
        "refsafe": "disable" if _flag(model, "mjDSBL_REFSAFE") else "enable",
        "integrator": ("Euler", "RK4", "implicit", "implicitfast", "discrete")[option.integrator],
    }
    reason = "adhesion pulls, which is not computed" if adhesion else ""
    if _flag(model, "mjENBL_DIAGEXACT") and option.cone == 0 and surface.condim > 1:
        reason = "the flag diagexact changes the pyramidal cone, which is not computed"
    try:
        NATIVE.values(settings)
    except ValueError as error:
        reason = str(error)
    return State(tuple(settings.items()), margin, falls, marks, reason)


def _written(
    state: State, names: list[tuple[str, str]], count: int, override: bool
) -> Callable[[Mapping[str, str]], tuple[str, ...]]:
    """Return what gives a row the values of parameters: a `<pair>` for each pair of geoms, if all have names."""

    def lines(instead: Mapping[str, str]) -> tuple[str, ...]:
        if override:
            return tuple(f'<option o_{parameter}="{text}"/>' for parameter, text in instead.items())
        if not names:
            changed = " ".join(f'{parameter}="{text}"' for parameter, text in instead.items())
            return (f"<geom {changed}/> <!-- both geoms of each of the {count} pairs -->",)
        values = {name: text for name, text in state.settings if name in ("solref", "solimp", "friction", "condim")}
        values |= instead
        sliding, torsion, rolling = values["friction"].split()
        values["friction"] = " ".join((sliding, sliding, torsion, rolling, rolling))
        values |= {"margin": repr(state.margin)} if state.margin else {}
        changed = " ".join(f'{parameter}="{text}"' for parameter, text in values.items())
        return tuple(f"<pair geom1={quoteattr(i)} geom2={quoteattr(j)} {changed}/>" for i, j in names)

    return lines


def _warnings(model: Any, contacts: list[DeckContact]) -> Iterator[str]:
    """Yield sentences on what changes eps and is not computed."""
    if _flag(model, "mjDSBL_CONTACT") or _flag(model, "mjDSBL_CONSTRAINT"):
        yield "A flag disables contacts: there are none"
    if model.nflex:
        yield "Contacts of flexes are not computed"
    if model.neq:
        yield "Equality constraints tie bodies together: eps of these bodies differs"
    if model.opt.density or model.opt.viscosity:
        yield "The medium slows bodies down: eps is without its density and viscosity"
    if model.body_gravcomp.any():
        yield "gravcomp carries the weight of some bodies: eps with weight has all of it"
    if _flag(model, "mjENBL_SPECULATIVE"):
        yield "Where a body moves by more than its own size in a step, speculative contacts change eps"
    if any("geom" in mark or "sphere" in mark for contact in contacts for mark in contact.marks):
        yield "Rows with a mark have eps of free bodies whose centres lie on the normal: the difference is not computed"
