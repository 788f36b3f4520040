"""The file that a scene gets: its comments, its numbers, and what compilers think of it."""

import ast
import re
import subprocess
import tomllib
from dataclasses import replace
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from tests import compiled
from tests.titles import HARD
from viscopade.generated import MARKER
from viscopade.kernels.write import runners
from viscopade.kernels.write.languages import NAMES, language
from viscopade.scene import candidate, read
from viscopade.scene.choice import Choice, choose
from viscopade.scene.encounter import scene_encounters
from viscopade.scene.render import beta_call, calls, file_name, render
from viscopade.scene.units import Scale

COMMAND = "viscopade scene tiny.toml"
EACH = [(name, form) for name in NAMES for form in language(name).forms]
KINDS = ("ready", "table", "quotient", "constant")


def kinds(name):
    """Return the kinds of kernels that a language has."""
    return [kind for kind in KINDS if kind != "table" or language(name).table]


MATERIALS = """
[material.m]
young_modulus = "10 GPa"
poisson_ratio = 0.3
density = "1 g/cm^3"
restitution = { epsilon = 0.8, speed = "1 m/s", radius = "1 cm" }
[material.n]
young_modulus = "70 GPa"
poisson_ratio = 0.2
density = "2.5 g/cm^3"
restitution = { epsilon = 0.9, speed = "1 m/s", radius = "1 cm" }
"""
SPREAD = """
[body.a]
material = "m"
radius = { min = "5 mm", max = "2 cm" }
[body.b]
material = "n"
radius = "3 mm"
[body.wall]
material = "n"
wall = true
"""
SAME = """
[body.ball]
material = "m"
radius = "5 mm"
[body.wall]
material = "n"
wall = true
"""
REST = """
[speed]
min = "{slowest}"
max = "1 m/s"
[tolerance]
{tolerance}
[code]
language = "{language}"
format = "{form}"
{code}
"""


def scene(name, form=None, bodies=SPREAD, top="", code="", slowest="0.1 m/s", tolerance="epsilon = 1e-3", end=""):
    form = form or language(name).forms[0]
    rest = REST.format(slowest=slowest, tolerance=tolerance, language=name, form=form, code=code)
    return read.from_toml(f"{top}\n{MATERIALS}{bodies}{rest}{end}".encode(), "some/where/tiny.toml")


def of_kind(made, kind):
    """Take a kernel of a kind, without asking whether it is the cheapest; None: there is none."""
    met = scene_encounters(made)
    makers = {
        "ready": lambda: next(candidate._ready(made, met), None),
        "table": lambda: next((c for c in candidate._ready(made, met) if c.kernel.bytes), None),
        "quotient": lambda: candidate.best_quotient(made, met),
        "constant": lambda: candidate.constant(made, met),
    }
    found = makers[kind]()
    return found and Choice(made, met, [found], found, "", ())


@cache
def choice(name, form=None, kind="ready", spread=True):
    bodies = SPREAD if spread else SAME
    if kind != "constant":
        return of_kind(scene(name, form, bodies), kind)
    return of_kind(scene(name, form, bodies, slowest="0.9 m/s", tolerance="absolute = 0.5"), kind)


@cache
def text(name, form=None, kind="ready", spread=True):
    return render(choice(name, form, kind, spread), COMMAND)


def need(name):
    tool = runners.find_tool(language(name).run)
    if tool is None:
        pytest.skip(f"there is no {runners.missing(language(name).run)}")
    return tool


def outside_comments(name, made):
    mark = language(name).comment.strip()
    pattern = r"/\*.*?\*/" if mark == "*" else rf"{re.escape(mark)}[^\n]*"
    return " ".join(re.sub(pattern, "", made, flags=re.DOTALL).split())


# --- what it says -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "kind"), [(name, kind) for name in NAMES for kind in kinds(name)])
def test_the_file_begins_with_the_question_and_the_answer(name, kind):
    made = text(name, None, kind)
    head = made.splitlines()[:30]  # a small screen
    assert MARKER in head[0] + head[1]
    for words in (COMMAND, "Tolerance: ", "Kernel: ", "Proven on this scene", "End condition", "Use: ", "Cite: "):
        assert any(words in line for line in head), words
    assert re.search(r"^.{0,2}\s+0  a-a: beta = ", made, re.MULTILINE)
    assert re.search(r"Use: (tiny_scene\b|TinyScene\b|viscopade_|epsilon_|restitution_)", made)
    assert ("outside, the functions return NaN" in made) == (kind == "quotient")
    assert made == render(choice(name, None, kind), COMMAND)
    assert made.rstrip("\n") + "\n" == made
    assert not [line for line in made.splitlines() if line != line.rstrip()]
    assert "some/where" not in made
    assert not re.search(r"1\n|\b1 -\n|[<=]\n", "\n".join(head))


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("title", HARD)
def test_titles_do_not_end_comments(name, title):
    plain = choice(name, None, "constant")
    made = render(replace(plain, scene=replace(plain.scene, title=title)), COMMAND)
    usual = text(name, None, "constant")
    assert outside_comments(name, made) == outside_comments(name, usual)
    for line in {*made.splitlines()} - {*usual.splitlines()}:
        assert not line.endswith("\\")
        assert line.isprintable()
        assert "??/" not in line
        if language(name).comment == " *" and line.startswith(" * "):
            assert "*/" not in line[1:].replace("/*", "*/")
    if name == "python":
        ast.parse(made)


@pytest.mark.parametrize("name", ["math", "Stdio", "class", "random", "viscopade", "a__b_"])
def test_names_of_scenes_are_not_taken(name):
    for spoken in ("c", "python", "fortran"):
        plain = choice(spoken)
        made = replace(plain, scene=replace(plain.scene, name=name))
        assert file_name(made.scene) == f"{name}_scene{language(spoken).ending}"
        found = re.findall(r"\w*_a__?b\w*", outside_comments(spoken, render(made, COMMAND)))
        assert not [word for word in found if "__" in word]


def scene_in(made, name):
    """Return the scene in the head of a generated file: the lines after the sentence, without comment marks."""
    mark = language(name).comment
    lines = made.splitlines()
    first = next(i for i, line in enumerate(lines) if re.match(rf"{re.escape(mark)} The scene, .*:$", line)) + 2
    last = next(i for i in range(first, len(lines)) if not lines[i].startswith(mark.rstrip()) or lines[i] == " */")
    return "\n".join(line[len(mark) + 1 :] for line in lines[first:last])


@pytest.mark.parametrize("name", NAMES)
def test_the_file_is_made_again_from_the_scene_in_it(name):
    made, read_again = text(name, None, "constant"), choice(name, None, "constant").scene
    again = read.from_toml(scene_in(made, name), "some/where/tiny.toml")
    assert again == read_again
    assert render(of_kind(again, "constant"), COMMAND) == made


@pytest.mark.parametrize(
    "path", sorted((Path(__file__).parents[2] / "examples").glob("*.toml")), ids=lambda path: path.stem
)
def test_scenes_of_the_examples_are_in_their_files(path):
    first = read.from_toml(path.read_bytes(), path.name)
    made = render(choose(first), COMMAND)
    assert read.from_toml(scene_in(made, first.code.language), path.name) == first
    assert f"The scene, {path.name}:\n" in made


HARD_SCENE = "\n".join(
    [
        r'title = "*/ /* ??/ coding: & \"\"\" \\" # */ /* ??/ &',
        "[material.m] # \\",
        '\tsource = """\\',
        "    two lines,",
        '\t*/ and quotes: "" "',
        '"""',
        "[speed] # \u2028 \t a",
        r"min = '*/\'",
        "max = '''",
        "coding=''' # coding=",
    ]
)


@pytest.mark.parametrize("name", NAMES)
def test_a_scene_does_not_end_the_comment(name):
    """One with tabs, with marks that end comments, in strings and beside them, and with a string of two lines."""
    plain = choice(name, None, "constant")
    made = render(replace(plain, scene=replace(plain.scene, toml=HARD_SCENE)), COMMAND)
    assert outside_comments(name, made) == outside_comments(name, text(name, None, "constant"))
    lines = scene_in(made, name).splitlines()
    assert tomllib.loads("\n".join(lines)) == tomllib.loads(HARD_SCENE)
    for line in lines:
        assert not line.endswith(("\\", "&"))
        assert line.isprintable()
        assert not re.search(r"\*/|/\*|\?\?/|coding[:=]", line)
    if name == "python":
        ast.parse(made)


# --- numbers ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "form", "unit"),
    [(name, form, unit) for name, form in EACH for unit in ("cm", "nm", "km")[: 3 if name in ("c", "fortran") else 1]],
)
def test_beta_of_given_radii(tmp_path, name, form, unit):
    """Against the model; in C and Fortran in units in which powers of radii would leave the range of the type, too."""
    tool, made = need(name), of_kind(scene(name, form, end=f'[units]\nlength = "{unit}"'), "ready")
    given, number, pairs = made.scene, made.scene.code.number, range(len(made.encounters))
    wanted = [beta_call(made, i, "x", "y") for i in pairs]
    wanted += [f"{beta_call(made, i)} + {number.literal(0.0)} * x" for i in pairs]
    program = runners.build(
        given.code.spoken, number, (file_name(given), render(made, COMMAND)), wanted, tool, tmp_path
    )  # fmt: skip
    if not program.command:
        return
    radii = np.array([(r1, r2) for r1 in (1e-9, 1e-6, 3e-3, 1.0, 1e3) for r2 in (1e-9, 5e-3, 1e4)])
    found = program(*(radii / given.scale.length).T)
    for i, encounter in enumerate(made.encounters):
        between = encounter.meeting.first, encounter.meeting.second
        for (r1, r2), value in zip(radii, found[i], strict=True):
            if between[0] != between[1] or r1 == r2:
                expected = given.scale.beta(given.pair(encounter.meeting, (r1, r2)).beta)
                assert value == pytest.approx(expected, rel=1e-14 if form == "double" else 1e-6, abs=0)
        typical = given.scale.beta(encounter.pair.beta)
        assert found[len(pairs) + i] == pytest.approx(typical, rel=1e-15 if form == "double" else 1e-7, abs=0)


def test_numbers_that_float_does_not_have_are_refused():
    made = choice("rust", "float")
    with pytest.raises(ValueError, match=r"^some/where/tiny.toml: units: beta, or beta times a radius, is .* float$"):
        render(replace(made, scene=replace(made.scene, scale=Scale(1e-55))), COMMAND)


# --- compilers, with warnings -----------------------------------------------------------------------------------------


@cache
def headers(form):
    """Choices of every kind for different scenes in C, each with a name of its own."""
    asked = product(("", 'argument = "v_star"', "largest_table = 1"), KINDS)
    found = [made for code, kind in asked if (made := of_kind(scene("c", form, code=code), kind))]
    return [replace(made, scene=replace(made.scene, name=f"tiny_{i}")) for i, made in enumerate(found)]


@pytest.mark.parametrize("standard", ["c99", "c++98", "c++17"])
@pytest.mark.parametrize("form", ["double", "float"])
def test_c_has_no_warnings(tmp_path, standard, form):
    """All headers in one file, included twice, and nothing of them used."""
    # Tables are hexadecimal, which C++98 does not know.
    taken = [made for made in headers(form) if standard != "c++98" or not made.chosen.kernel.bytes]
    assert len(taken) >= 6
    for made in taken:
        (tmp_path / file_name(made.scene)).write_text(render(made, COMMAND))
    lines = [f'#include "{file_name(made.scene)}"' for made in taken]
    (tmp_path / "use.c").write_text("\n".join([*lines, *lines, "int main(void) { return 0; }\n"]))
    command = (*compiled.compiler(standard), *compiled.WARNINGS, "-fsyntax-only", "use.c")
    ran = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr


@pytest.mark.parametrize(("name", "flags"), [("fortran", ("-Wall", "-Werror")), ("rust", ("-D", "warnings"))])
@pytest.mark.parametrize("form", ["double", "float"])
@pytest.mark.parametrize(("kind", "spread"), [("ready", False), *((kind, True) for kind in kinds("rust"))])
def test_compilers_have_no_warnings(tmp_path, name, flags, form, kind, spread):
    made, code = choice(name, form, kind, spread), choice(name, form, kind, spread).scene.code
    wanted = [f"{call} + {code.number.literal(0.0)} * x" for call in calls(made, "x", "y")]
    file = file_name(made.scene), text(name, form, kind, spread)
    runners.build(code.spoken, code.number, file, wanted, need(name), tmp_path, flags)


def test_fortran_takes_two_scenes(tmp_path):
    tool, first = need("fortran"), choice("fortran")
    second = replace(first, scene=replace(first.scene, name="other"))
    for made in (first, second):
        (tmp_path / file_name(made.scene)).write_text(render(made, COMMAND))
    (tmp_path / "main.f90").write_text(
        "program both\n use tiny_scene\n use other_scene\n implicit none\n"
        " print *, restitution_tiny([1d0, 2d0], beta_tiny_pairs(1)), restitution_other(1d0, beta_other_pairs(1))\n"
        "end program\n"
    )
    for words in ((*tool.words, "tiny_scene.f90", "other_scene.f90", "main.f90", "-o", "both"), ("./both",)):
        ran = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True)
        assert ran.returncode == 0, ran.stderr
    slow, fast, other = map(float, ran.stdout.split())
    assert 0 < fast < slow == other < 1


def test_functions_for_arrays_are_named():
    batch = of_kind(scene("c", code='use = "batch"'), "table")
    assert "viscopade_restitution_each_tiny(n, speed, beta, out)" in render(batch, COMMAND).split("Cite: ")[0]
