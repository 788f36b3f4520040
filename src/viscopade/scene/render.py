"""The generated file of a scene: the question and the answer, the kernel, and functions by the scene's names."""

from __future__ import annotations

import re
from collections.abc import Iterator
from fractions import Fraction
from textwrap import wrap
from typing import Any

from viscopade.arithmetic.decimals import at_most
from viscopade.arithmetic.formats import DOUBLE
from viscopade.generated import END_CONDITION, WIDTH, comment, marker_line, template
from viscopade.kernels import formulas
from viscopade.kernels.expressions import Name
from viscopade.kernels.machine import computed
from viscopade.kernels.targets.syntax import text
from viscopade.scene.candidate import Candidate, PairConstant, RegistryKernel
from viscopade.scene.choice import WORDS, Choice
from viscopade.scene.description import Scene

_RESERVED = re.compile(r"gl_|webgl_|viscopade", re.IGNORECASE)  # beginnings of names that are not ours
_IN_A_ROW = 3


def file_name(scene: Scene) -> str:
    """Return the file's name, the scene's unless a header or a module of that name exists already."""
    target = scene.code.target
    return f"{scene.name}{'_scene' if target.is_taken(scene.name) else ''}{target.suffix}"


def render(choice: Choice, command: str) -> str:
    """Return the file's text.

    Parameters
    ----------
    choice : Choice
    command : str
        The command line that makes the file.

    Raises
    ------
    ValueError
        If a number is beyond what the format has, in the scene's units.
    """
    scene, request = choice.scene, choice.chosen.candidate.request()
    mark = scene.code.target.comment
    head = comment(_head(choice, command), mark)
    pairs = [_pair(choice, i, name) for i, name in enumerate(names(choice))]
    return template(__name__, "scene.jinja").render(
        **layout(choice),
        head=f"/*\n{head}\n */" if mark == " *" else head,
        # A module of its own is named after the scene, as there may be several scenes.
        kernel="" if request is None else request.render(scene.code.language, f"{prefix(scene)}_kernel"),
        pairs=pairs,
        rows=[pairs[i : i + _IN_A_ROW] for i in range(0, len(pairs), _IN_A_ROW)],
        speed=scene.units.speed,
        length=scene.units.length,
    )


def layout(choice: Choice) -> dict[str, Any]:
    """Return the names and types for the templates of the file and of a program that calls it."""
    scene, candidate = choice.scene, choice.chosen.candidate
    target, name = scene.code.target, prefix(scene)
    number = target.number(scene.code.format)
    constant, spread = isinstance(candidate, PairConstant), _is_spread(scene)
    typical = ", for typical radii" if spread else ""
    return {
        "target": target,
        "element": lambda array, index: target.element.format(array=array, index=index),
        "name": name,
        "upper": name.upper(),
        "qualifier": qualifier_of(scene),
        "module": module(scene),
        "kind": _kind(candidate),
        "function": candidate.name,
        "batch": scene.code.use == "batch",
        "argument": scene.code.argument,
        "spread": spread,
        "what": "epsilon" if constant else "beta",
        "values_are": f"By pair, {'eps' if constant else f'beta in {scene.units.beta}{typical}'}",
        **_formulas(scene),
        "number": number.type,
        "suffix": number.suffix,
    }


def _formulas(scene: Scene) -> dict[str, str]:
    """Return the formulas of beta of given radii, and of dissipation, in the language's words."""
    target = scene.code.target
    number, branch = target.number(scene.code.format), formulas.beta_of_radii_branch()
    of_radii = {**dict(branch.program), **branch.results}
    dissipation = formulas.lost_energy(Name("epsilon"), Name("loss"))
    written = {
        **{f"{name}_of_radii": expression for name, expression in of_radii.items()},
        **{f"dissipation_{name}": expression for name, expression in dissipation.items()},
    }
    return {name: text(expression, target.syntax(number)) for name, expression in written.items()}


def _kind(candidate: Candidate) -> str:
    """Return which functions the kernel's text has."""
    if isinstance(candidate, PairConstant):
        return "constant"
    return candidate.entry.kind if isinstance(candidate, RegistryKernel) else "polynomial"


def _is_spread(scene: Scene) -> bool:
    """Return whether a body has radii that differ."""
    met = {name for meeting in scene.meetings for name in (meeting.first, meeting.second)}
    return any((sizes := scene.bodies[name].sizes) is not None and sizes.spread for name in met & scene.bodies.keys())


# --- names ------------------------------------------------------------------------------------------------------------


def prefix(scene: Scene) -> str:
    """Return the prefix of the names in the file.

    C++ and GLSL keep names with two underscores in a row for themselves, and there are names that are taken.
    """
    name = _single(scene.name)
    return f"scene_{name}" if _RESERVED.match(name) else name


def module(scene: Scene) -> str:
    """Return the name of the module, in Julia."""
    return "".join(word[:1].upper() + word[1:] for word in scene.name.split("_")) + "Scene"


def names(choice: Choice) -> list[str]:
    """Return an identifier for each pair.

    Capitals alone do not tell names apart in Fortran, nor in Rust, where these are written in capitals. Where the
    names of bodies are not enough, all pairs are numbered.
    """
    scene = choice.scene
    between = [_single(f"{e.meeting.first}_{e.meeting.second}") for e in choice.encounters]
    if len({name.casefold() for name in between}) == len(between):
        found = [f"pair_{name}" for name in between]
    else:
        found = [f"pair{i}_{name}" for i, name in enumerate(between)]
    longest = scene.code.target.longest
    if longest and max(map(len, found)) + len(prefix(scene)) + 1 > longest:
        return [f"pair{i}" for i in range(len(found))]
    return found


def _single(name: str) -> str:
    """Return a name without two underscores in a row, and none at the end."""
    return re.sub("_+", "_", name).rstrip("_")


# --- numbers ----------------------------------------------------------------------------------------------------------


def _pair(choice: Choice, index: int, name: str) -> dict[str, object]:
    """Return what the template needs of a pair."""
    scene, encounter, candidate = choice.scene, choice.encounters[index], choice.chosen.candidate
    values = candidate.values if isinstance(candidate, PairConstant) else None
    pair = scene.scale.pair(encounter.pair)
    # No power of a radius in the formula leaves the range of the format, whatever the units.
    first, second = (0.0 if s.is_wall else s.mass / s.radius**3 for s in (pair.first, pair.second))
    densities = first / second if second else 0.0
    ratio = pair.first.radius / pair.second.radius if second else 0.0
    unit = {"of_wall": 1.0, "densities": densities, "ratio": ratio, "first": pair.first.radius}
    of_wall = pair.beta / float(computed(formulas.beta_of_radii_branch(), "beta", unit, DOUBLE))
    value = float(values[index]) if values else pair.beta
    return {
        "name": name,
        "capitals": name.upper(),
        "index": index + scene.code.target.first_index,
        "title": encounter.name,
        "value": _constant(scene, value),
        "of_wall": _constant(scene, of_wall),
        "densities": _constant(scene, densities),
    }


def _constant(scene: Scene, value: float) -> str:
    """Return the shortest decimal for a number of the scene's format.

    Raises
    ------
    ValueError
        If there is no such number.
    """
    number = scene.code.target.number(scene.code.format)
    try:
        return number.constant(number.form.nearest(Fraction(value)))
    except (ValueError, OverflowError):
        raise ValueError(
            f"{scene.source}: units: beta, or beta times a radius, is {value:.3g} in {scene.units.beta}: accepted are "
            f"units in which it is a normal number of type {number.form.name}"
        ) from None


# --- what the file says -----------------------------------------------------------------------------------------------


def _head(choice: Choice, command: str) -> list[str]:
    scene = choice.scene
    paragraphs = [
        # Without a title of its own it has the name of the file, as it was given.
        re.split(r"[/\\]", scene.title)[-1] if scene.title == scene.source else scene.title,
        f"End condition: {END_CONDITION}.",
        "Tolerance: "
        + ", ".join(f"{WORDS[name]} at most {limit:g}" for name, limit in scene.tolerance.given().items())
        + ".",
        *error_sentences(choice),
        choice.against_cheaper,
        *(f"{text}." for text in choice.notes),
        *(f"Warning: {text}." for text in choice.warnings),
    ]
    lines = [marker_line(command), ""]
    for paragraph in paragraphs:
        lines += [*wrap(paragraph, WIDTH, subsequent_indent="    "), ""]
    lines += [
        f"Pairs, with speeds in {scene.units.speed} and beta in {scene.units.beta} for typical radii:",
        "",
        *(f"    {i}  {line}" for i, line in enumerate(_lines(choice), scene.code.target.first_index)),
        "",
        *(f"Use: {line}" for line in _use(choice)),
    ]
    return lines


def _use(choice: Choice) -> list[str]:
    """Return how the file's functions are called, as lines of code."""
    scene, target, file = choice.scene, choice.scene.code.target, file_name(choice.scene)
    pair, qualifier = names(choice)[0], qualifier_of(scene)
    constant = isinstance(choice.chosen.candidate, PairConstant)
    what = "epsilon" if constant else "beta"
    title = choice.encounters[0].name
    index = target.pair.format(qualifier=qualifier, pair=pair, PAIR=pair.upper(), title=title)
    if _is_spread(scene) and not constant:
        number = f"{qualifier}beta_of({index}, first_radius, second_radius)"
    else:
        number = target.element.format(array=qualifier + (what.upper() if target.capitals else what), index=index)
    arguments = f"speed, {number}" if scene.code.argument == "speed" else "v_star"
    call = number if constant else f"{qualifier}restitution({arguments})"
    include = target.include.format(file=file, stem=file.removesuffix(target.suffix), name=prefix(scene))
    return [*([include] if include else []), call]


def qualifier_of(scene: Scene) -> str:
    """Return the qualifier before the functions' names in a call."""
    return scene.code.target.qualifier.format(name=prefix(scene), module=module(scene))


def _lines(choice: Choice) -> Iterator[str]:
    """Yield a line for each pair, in the scene's units."""
    scene = choice.scene
    scale = scene.scale
    for encounter in choice.encounters:
        slowest, fastest = (v / scale.speed for v in (encounter.speeds.slowest, encounter.speeds.fastest))
        (low, high), (least, most) = (tuple(map(float, ends)) for ends in (encounter.v_star, encounter.epsilon))
        yield (
            f"{encounter.name}: beta = {scale.beta(encounter.pair.beta):.10g}, speeds {slowest:.4g} to "
            f"{fastest:.4g}, v* {low:.4g} to {high:.4g}, eps {least:.6g} to {most:.6g}"
        )


def error_sentences(choice: Choice) -> list[str]:
    """Return sentences on the kernel and its errors on the scene."""
    candidate = choice.chosen.candidate
    found = ", ".join(
        f"{WORDS[name]} at most {at_most(getattr(candidate.errors, name))}" for name in vars(candidate.errors)
    )
    table = f", a table of {candidate.bytes:,} bytes" if candidate.bytes else ""
    return [
        f"Kernel: {candidate.label} ({candidate.name}){table}.",
        f"Proven on this scene, rounding included: {found}.",
    ]
