"""The file that a scene gets: what was asked and found, the kernel, and the scene's names for its functions."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import wrap

from viscopade.certificate import at_most
from viscopade.kernels import END_CONDITION, WIDTH, marker_line, template
from viscopade.kernels.binary import DOUBLE, FLOAT
from viscopade.scene.candidate import Candidate, Constant, Ready
from viscopade.scene.choice import WORDS, Choice
from viscopade.scene.description import Scene
from viscopade.scene.encounter import Encounter
from viscopade.scene.units import Scale

FILES = {
    "c": (".h", " *"),
    "python": (".py", "#"),
    "cuda": (".cuh", " *"),
    "glsl": (".glsl", "//"),
    "wgsl": (".wgsl", "//"),
    "javascript": (".mjs", "//"),
    "fortran": (".f90", "!"),
    "rust": (".rs", "//"),
    "julia": (".jl", "#"),
}
"""By language, the end of the file's name, and what begins a line of comment."""

_TYPES = {
    ("glsl", "float"): "float",
    ("wgsl", "float"): "f32",
    ("fortran", "double"): "real64",
    ("fortran", "float"): "real32",
    ("rust", "double"): "f64",
    ("rust", "float"): "f32",
    ("julia", "double"): "Float64",
    ("julia", "float"): "Float32",
}


def file_name(scene: Scene) -> str:
    """Return the name of the file."""
    return scene.name + FILES[scene.code.language][0]


def render(choice: Choice, command: str) -> str:
    """Return the file's text.

    Parameters
    ----------
    choice : Choice
    command : str
        The command line that makes the file.
    """
    scene, candidate = choice.scene, choice.chosen.candidate
    request = candidate.request()
    kernel = "" if request is None else request.render(scene.code.language)
    return template("scene.jinja").render(
        language=scene.code.language,
        head=_comment(scene.code.language, _head(choice, command)),
        kernel=kernel,
        name=scene.name,
        kind=_kind(candidate),
        function=candidate.name,
        batch=scene.code.use == "batch",
        argument=scene.code.argument,
        pairs=[_pair(choice, i) for i in range(len(choice.encounters))],
        spread=any(_is_spread(choice, encounter) for encounter in choice.encounters),
        number=_TYPES.get((scene.code.language, scene.code.format), scene.code.format),
        suffix="f" if scene.code.format == "float" else "",
        speed=scene.units.speed,
        beta_unit=scene.units.beta,
    )


def _kind(candidate: Candidate) -> str:
    """Return which functions the kernel's text has."""
    if isinstance(candidate, Constant):
        return "constant"
    return candidate.entry.kind if isinstance(candidate, Ready) else "polynomial"


def _is_spread(choice: Choice, encounter: Encounter) -> bool:
    return any(
        (sizes := choice.scene.bodies[name].sizes) is not None and sizes.spread
        for name in (encounter.meeting.first, encounter.meeting.second)
    )


def _pair(choice: Choice, index: int) -> dict[str, object]:
    """Return what the template needs of a pair."""
    scene, encounter = choice.scene, choice.encounters[index]
    scale, form = Scale(*scene.scale), FLOAT if scene.code.format == "float" else DOUBLE
    pair = scale.pair(encounter.pair)
    candidate = choice.chosen.candidate
    # beta = factor (sqrt(R_eff)/m_eff)^(2/5), eq:betadef with rho = 4/3 E_eff sqrt(R_eff)
    factor = 1.5 * pair.A * (4 / 3 * pair.E_eff) ** 0.4
    return {
        "name": _names(choice)[index],
        "title": encounter.name,
        "beta": _constant(scene.code.language, pair.beta, form.name),
        "factor": _constant(scene.code.language, factor, form.name),
        "mass": [
            "0.0" if s.is_wall else _constant(scene.code.language, s.mass / s.radius**3, form.name)
            for s in (pair.first, pair.second)
        ],
        "epsilon": candidate.values[index] + ("" if "." in candidate.values[index] else ".0")
        if isinstance(candidate, Constant)
        else "",
    }


def _names(choice: Choice) -> list[str]:
    """Return an identifier for each pair; a number is appended where two would be the same."""
    plain = [f"pair_{e.meeting.first}_{e.meeting.second}" for e in choice.encounters]
    return [name if plain.count(name) == 1 else f"{name}_{i}" for i, name in enumerate(plain)]


def _constant(language: str, value: float, form: str) -> str:
    text = repr(value) if form == "double" else f"{value:.9g}"
    text = text if set(text) & set(".e") else f"{text}.0"
    return text + ("f" if language in ("c", "cuda") and form == "float" else "")


# --- what the file says -----------------------------------------------------------------------------------------------


def _comment(language: str, lines: Sequence[str]) -> str:
    mark = FILES[language][1]
    body = "\n".join(f"{mark} {line}".rstrip() for line in lines)
    return f"/*\n{body}\n */" if mark == " *" else body


def _head(choice: Choice, command: str) -> list[str]:
    scene = choice.scene
    paragraphs = [
        scene.title,
        f"End condition: {END_CONDITION}.",
        "Tolerance: "
        + ", ".join(f"{WORDS[name]} at most {limit:g}" for name, limit in scene.tolerance.given().items())
        + ".",
        *errors(choice),
        f"Not cheaper: {choice.reason}.",
        *(f"Warning: {text}." for text in choice.warnings),
    ]
    lines = [marker_line(command), ""]
    for paragraph in paragraphs:
        lines += [*wrap(paragraph, WIDTH, subsequent_indent="    "), ""]
    lines += [
        f"Pairs, with speeds in {scene.units.speed} and beta in {scene.units.beta} for typical radii:",
        "",
        *(f"    {i}  {line}" for i, line in enumerate(map(_line, _in_units(choice)))),
    ]
    return [line.replace("*/", "* /") for line in lines]


def _in_units(choice: Choice) -> list[tuple[Encounter, float, tuple[float, ...]]]:
    scale = Scale(*choice.scene.scale)
    return [(e, scale.beta(e.pair.beta), tuple(v / scale.speed for v in e.speeds)) for e in choice.encounters]


def _line(given: tuple[Encounter, float, tuple[float, ...]]) -> str:
    encounter, beta, (slowest, _, fastest) = given
    (low, high), (least, most) = ((float(x) for x in interval) for interval in (encounter.v_star, encounter.epsilon))
    return (
        f"{encounter.name}: beta = {beta:.10g}, speeds {slowest:.4g} to {fastest:.4g}, v* {low:.4g} to {high:.4g}, "
        f"eps {least:.6g} to {most:.6g}"
    )


def errors(choice: Choice) -> list[str]:
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
