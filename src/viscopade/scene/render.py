"""The generated file of a scene: the question and the answer, the scene, the kernel under its name, and the pairs.

A Kernel is a set of functions of named arguments and constants, as expressions (`Name`, `Select`, `Item`), which
`file.file_text` writes in a language. A Choice has the scene, its encounters (pairs of bodies with their ranges of
beta, v* and eps), and the chosen kernel with its errors there.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import NamedTuple

from viscopade import files
from viscopade.arithmetic.decimals import at_most
from viscopade.arithmetic.formats import DOUBLE
from viscopade.collision.spheres import Pair
from viscopade.generated import CITE, END_CONDITION, SPDX, harmless, harmless_string, marker_line, wrapped
from viscopade.kernels import formulas
from viscopade.kernels.bound import ErrorBound
from viscopade.kernels.expressions import CodeBranch, Item, Name, Select, Statement
from viscopade.kernels.kernel import Function, Kernel
from viscopade.kernels.machine import branch_value
from viscopade.kernels.write import file
from viscopade.kernels.write.languages import language as language_of
from viscopade.scene.candidate import value_of_pair
from viscopade.scene.choice import Choice
from viscopade.scene.description import Scene
from viscopade.scene.encounter import hull
from viscopade.scene.tolerance import HOPELESS, MEASURES


def file_name(scene: Scene) -> str:
    """Return the file's name."""
    return f"{_module(scene)}{scene.code.spoken.ending}"


def _module(scene: Scene) -> str:
    """Return the file's name without its ending, which some languages take for the name of a module."""
    return f"{scene.name}_scene"


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
        If a number in the scene's units is out of the format's range.
    """
    file_kernels, code = kernels(choice), choice.scene.code
    # A table serves numbers in float and double, other kernels those of the scene.
    language = language_of(code.language) if file_kernels[0].tables else code.spoken
    return file.file_text(file_kernels, language, command, _module(choice.scene), _head(choice, command))


# --- kernels ----------------------------------------------------------------------------------------------------------


def kernels(choice: Choice) -> list[Kernel]:
    """Return the kernel of a choice with the scene's name, and a kernel with the constants of each pair."""
    scene, chosen = choice.scene, choice.chosen
    name = re.sub("_+", "_", scene.name).rstrip("_")  # C++ reserves names with two underscores in a row
    if chosen.is_constant:
        return [_with_errors(choice, replace(chosen.kernel, name=name))]
    # A kernel that is complete without another one gets two functions, eps and 1 - eps^2, with their errors here.
    main = chosen.kernel
    if main.fallback is None:
        eps_function = main.function(scene.code.function)
        main = replace(main, functions=(eps_function, _dissipation_function(main, eps_function)), bounds=())
        main = _with_errors(choice, main)
    return [replace(main, name=name), _pair_kernel(choice, f"{name}_pairs")]


def _with_errors(choice: Choice, kernel: Kernel) -> Kernel:
    """Return a kernel with the bounds of its errors on the scene of a choice, in place of its own."""
    # One bound for each function and arithmetic, relative to the value; an error without a proof has none.
    low, high = hull(encounter.v_star for encounter in choice.encounters)
    errors, arithmetics = choice.chosen.errors, choice.scene.code.number.arithmetics
    bounds = tuple(
        ErrorBound(function.name, low, high, "value", size, arithmetic=arithmetic)
        for function in kernel.functions
        if (size := errors["dissipation" if function.name == "dissipation" else "epsilon"]) < HOPELESS
        for arithmetic in arithmetics
    )
    return replace(kernel, bounds=bounds)


def _dissipation_function(kernel: Kernel, eps_function: Function) -> Function:
    """Return the function 1 - eps^2 of a kernel, from 1 - eps if the kernel has a separate function for that.

    `eps_function` is the kernel's eps.
    """
    functions = {function.name: function for function in kernel.functions}
    if "dissipation" in functions:
        return functions["dissipation"]
    has_loss = "one_minus_epsilon" in functions and eps_function.arguments == ("v_star",)
    function, name = (functions["one_minus_epsilon"], "loss") if has_loss else (eps_function, "eps")
    value = formulas.lost_energy(Name("eps"), Name("loss"))["of_loss" if has_loss else "of_epsilon"]
    # The branches of the kernel, each with its value v made into 1 - eps^2: (1 - v) (1 + v) if v is eps, v (2 - v)
    # if it is 1 - eps.
    branches = tuple(
        CodeBranch(b.guard, (*b.program, Statement(name, b.results[function.result])), {"dissipation": value})
        for b in function.branches
    )
    meaning = "1 - eps^2, the part of the energy of the normal motion that is lost"
    return replace(function, name="dissipation", meaning=meaning, branches=branches, result="dissipation")


def _pair_kernel(choice: Choice, name: str) -> Kernel:
    """Return the kernel of beta by pair, for typical radii, and for given radii if a body's radii differ.

    `name` is that of the kernel.
    """
    scene = choice.scene
    # Lists by pair; the last two only if radii differ, for a function of the radii.
    numbers = [_pair_numbers(scene, encounter.pair) for encounter in choice.encounters]
    typical = " for typical radii" if _is_spread(scene) else ""
    functions = [value_of_pair("beta", "betas", f"beta of a pair in {scene.units.beta}{typical}")]
    lists = {"betas": tuple(pair.beta for pair in numbers)}
    if _is_spread(scene):
        # beta(R_1, R_2) = of_wall/R_1 ((1 + densities ratio^3)/(1 + ratio)^(1/2))^(2/5), with ratio = R_1/R_2
        zero, densities = formulas.ZERO, Name("densities")
        start = (
            Statement("of_wall", Item("walls", "pair")),
            Statement("densities", Item("quotients", "pair")),
            # Some languages compute both sides of a choice: the second radius of a wall may be 0.
            Statement("other", Select(densities > zero, Name("second"), formulas.ONE)),
            Statement("ratio", Select(densities > zero, Name("first") / Name("other"), zero)),
        )
        meaning = (
            f"beta of a pair with given radii of its first and second body in {scene.units.length}; for a sphere and a "
            "wall, the second radius is ignored"
        )
        branch = (formulas.beta_of_radii_branch(),)
        functions.append(Function("beta_of", ("pair", "first", "second"), meaning, None, start, branch, "beta"))
        lists |= {
            "walls": tuple(pair.of_wall for pair in numbers),
            "quotients": tuple(pair.densities for pair in numbers),
        }
    # Name, label, argument, formula, source and domain in words, functions, constants by format (none), and lists
    return Kernel(
        name, "beta", "pair", "", "the scene", "the pairs of the scene", tuple(functions), {scene.code.format: {}},
        lists=lists,
    )  # fmt: skip


class _PairNumbers(NamedTuple):
    """beta of a pair, beta times the first radius at a wall, and the ratio of the densities, 0 for a wall."""

    beta: float
    of_wall: float
    densities: float


def _pair_numbers(scene: Scene, si: Pair) -> _PairNumbers:
    """Return the numbers of a pair, `si` in SI units, in the scene's units."""
    pair = scene.scale.pair(si)
    # Ratios of densities and radii stay in the range of the format in all units.
    first, second = (0.0 if s.is_wall else s.mass / s.radius**3 for s in (pair.first, pair.second))
    densities = first / second if second else 0.0
    ratio = pair.first.radius / pair.second.radius if second else 0.0
    # beta of a pair is a function of its radii, times the number `of_wall`: so this is beta over the function's value
    # with 1.
    unit = {"of_wall": 1.0, "densities": densities, "ratio": ratio, "first": pair.first.radius}
    of_wall = pair.beta / float(branch_value(formulas.beta_of_radii_branch(), "beta", unit, DOUBLE))
    # All numbers must be normal ones in the format of the code.
    form = scene.code.number.arithmetics[0].form
    for value in (pair.beta, of_wall, *([densities] if densities else [])):
        try:
            form.nearest(Fraction(value))
        except (ValueError, OverflowError):
            raise ValueError(
                f"{scene.source}: units: beta, or beta times a radius, is {value:.3g} in {scene.units.beta}: expected "
                f"units in which it is a normal number in {form.name}"
            ) from None
    return _PairNumbers(pair.beta, of_wall, densities)


def _is_spread(scene: Scene) -> bool:
    """Return whether a body that meets another one has different radii."""
    names = {name for meeting in scene.meetings for name in (meeting.first, meeting.second)}
    return any((sizes := scene.bodies[name].sizes) is not None and sizes.spread for name in names & scene.bodies.keys())


# --- head of the file -------------------------------------------------------------------------------------------------


def _head(choice: Choice, command: str) -> list[str]:
    """Return the lines at the head of the file: command, question and answer, pairs, warnings, and the scene."""
    scene = choice.scene
    paragraphs = [
        # Without a title, a scene has the name of its file as its title.
        re.split(r"[/\\]", scene.title)[-1] if scene.title == scene.source else scene.title,
        tolerance_sentence(scene),
        *error_sentences(choice),
        choice.against_cheaper,
        f"End condition: {END_CONDITION}.",
        f"Use: {file.in_module(_typical_call(choice), _module(scene))}",
        CITE,
    ]
    typical = " for typical radii" * _is_spread(scene)
    # Each pair has the number by which the code knows it.
    pairs = [f"    {i}  {line}" for i, line in enumerate(_pair_lines(choice))]
    notes = [*(f"{text}." for text in choice.notes), *(f"Warning: {text}." for text in choice.warnings)]
    return [
        *(marker_line(command), *SPDX, "", *_wrap(paragraphs), ""),
        *(f"Pairs, with speeds in {scene.units.speed} and beta in {scene.units.beta}{typical}:", *pairs),
        *([""] if notes else []),
        *_wrap(notes),
        *_scene_lines(scene),
    ]


def _scene_lines(scene: Scene) -> list[str]:
    """Return the lines with the text of the scene's file, after a sentence that names it; none if it was not read.

    Without comment marks the lines are the same scene. Strings with what ends a comment, or with several lines, have
    escapes; in the scene's own comments a blank or a full stop is put in (`harmless`).
    """

    def on_one_line(string: str) -> str:
        """Return a string of TOML, with its quotes, as one that a comment may contain."""
        if "\n" not in string and harmless(string) == string:
            return string
        return harmless_string(tomllib.loads(f"x = {string}")["x"])

    text = files.toml_with_strings(scene.toml, on_one_line).strip("\n")
    if not text:
        return []
    # Only line feeds end lines of TOML. Tabs outside of strings are blanks: comments would have escapes for them.
    lines = [line.rstrip("\r").expandtabs(4).rstrip() for line in text.split("\n")]
    name = re.split(r"[/\\]", scene.source)[-1]
    return ["", f"The scene, {name}:", "", *lines]


def _wrap(paragraphs: Sequence[str]) -> list[str]:
    """Return paragraphs in lines of a file's width; all but their first lines are indented."""
    return [line for text in paragraphs for line in wrapped(text, indent="    ")]


def calls(choice: Choice, first: str, second: str) -> list[str]:
    """Return calls of the file's eps and 1 - eps^2, for a speed and beta or for a v*; of a constant, eps by pair.

    `first` and `second` are the texts of the arguments: of the speed and beta, or of v* and nothing.
    """
    # The first kernel of the file is that of eps.
    main, code = kernels(choice)[0], choice.scene.code
    if main.argument == "pair":
        return [_call(choice, main, "epsilon", str(i)) for i in range(len(choice.encounters))]
    arguments = (first, second) if code.argument == "speed" else (first,)
    return [_call(choice, main, name, *arguments) for name in (code.function, "dissipation")]


def beta_call(choice: Choice, pair: int, *radii: str) -> str:
    """Return a call of the file's beta of a pair, with typical or given radii."""
    return _call(choice, kernels(choice)[1], "beta_of" if radii else "beta", str(pair), *radii)


def _call(choice: Choice, kernel: Kernel, name: str, *arguments: str) -> str:
    """Return a call of a kernel's function in the scene's language and format."""
    code = choice.scene.code
    return file.call(kernel, kernel.function(name), code.spoken, arguments, code.number)


def _typical_call(choice: Choice) -> str:
    """Return an example of how to use the file: a call that gives eps of the first pair."""
    main = kernels(choice)[0]
    if main.argument == "pair" or choice.scene.code.argument == "v_star":
        return calls(choice, "v_star", "")[0]
    # Many collisions at once: files with tables have functions of arrays, with a beta each, or by pair.
    if choice.scene.code.use == "batch" and main.tables:
        arguments, how = ("beta", "each") if _is_spread(choice.scene) else ("pair, beta", "by_pair")
        suffix = choice.scene.code.number.suffix
        return f"viscopade_restitution_{how}_{main.name}{suffix}(n, speed, {arguments}, out);"
    # One collision: the speed, and beta of pair 0
    radii = ("first_radius", "second_radius") if _is_spread(choice.scene) else ()
    return calls(choice, "speed", beta_call(choice, 0, *radii))[0]


def _pair_lines(choice: Choice) -> Iterator[str]:
    """Yield a line for each pair of a choice, in the scene's units: beta, and the ranges of speeds, v* and eps."""
    scale = choice.scene.scale
    for encounter in choice.encounters:
        slowest, fastest = encounter.speeds.slowest / scale.speed, encounter.speeds.fastest / scale.speed
        (low, high), (low_eps, high_eps) = (tuple(map(float, ends)) for ends in (encounter.v_star, encounter.epsilon))
        # beta has ten digits, as users may copy it; speeds and v* four, to be compared; eps six, because it is near 1.
        yield (
            f"{encounter.name}: beta = {scale.beta(encounter.pair.beta):.10g}, speeds {slowest:.4g} to "
            f"{fastest:.4g}, v* {low:.4g} to {high:.4g}, eps {low_eps:.6g} to {high_eps:.6g}"
        )


def tolerance_sentence(scene: Scene) -> str:
    """Return the sentence on the tolerance."""
    limits = (f"{MEASURES[name]} at most {limit:g}" for name, limit in scene.tolerance.limits().items())
    return f"Tolerance: {', '.join(limits)}."


def error_sentences(choice: Choice) -> list[str]:
    """Return sentences on the chosen kernel, its errors on the scene, and its range of v*."""
    # Errors are rounded up to three digits (`at_most`), so that the sentence is proven, too.
    candidate = choice.chosen
    errors = ", ".join(f"{words} at most {at_most(candidate.errors[name])}" for name, words in MEASURES.items())
    size = candidate.kernel.bytes
    table = f", a table of {size:,} bytes" if size else ""
    sentences = [
        f"Kernel: {candidate.label} ({candidate.kernel.name}){table}.",
        f"Proven on this scene, rounding included: {errors}.",
    ]
    if candidate.degrees is not None:
        low, high = (float(end) for end in (candidate.kernel.bounds[0].low, candidate.kernel.bounds[0].high))
        sentences.append(f"The formula is for v* from {low:.6g} to {high:.6g}; outside, the functions return NaN.")
    return sentences
