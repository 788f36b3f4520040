"""The file that a scene gets: its names, its comments, its numbers, and what compilers think of it."""

import ast
import builtins
import ctypes
import re
import subprocess
import sys
from dataclasses import replace
from functools import cache
from shutil import which

import numpy as np
import pytest

from tests import compiled
from tests.titles import HARD
from viscopade.generated import MARKER
from viscopade.kernels import registry
from viscopade.kernels.targets.languages import target, targets
from viscopade.scene import read
from viscopade.scene.candidate import BestApproximant, PairConstant, RegistryKernel, candidates
from viscopade.scene.choice import Choice, Offer
from viscopade.scene.description import Meeting, Speeds
from viscopade.scene.encounter import encounters
from viscopade.scene.render import file_name, names, prefix, render
from viscopade.scene.runners import find_tool
from viscopade.scene.units import Scale

COMMAND = "viscopade scene tiny.toml"
EACH = [(each.name, form) for each in targets() for form in each.formats]
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


def scene(language, form=None, bodies=SPREAD, top="", code="", slowest="0.1 m/s", tolerance="epsilon = 1e-3", end=""):
    rest = REST.format(
        slowest=slowest, tolerance=tolerance, language=language, form=form or target(language).formats[0], code=code
    )
    return read.from_toml(f"{top}\n{MATERIALS}{bodies}{rest}{end}".encode(), "some/where/tiny.toml")


def chosen(made, kind=None):
    """Take a kernel of a kind, else the first kind here, without asking whether it is the cheapest: that takes long."""
    met, code = encounters(made), made.code
    kinds = code.target.kinds[code.argument] - ({"full"} if code.format == "float" else set())
    kind = kind or next(one for one in ("compact", "speed", "full", "polynomial") if one in kinds)
    if kind in ("constant", "polynomial"):
        wanted = {"constant": PairConstant, "polynomial": BestApproximant}[kind]
        found = next(c for c in candidates(made, met) if isinstance(c, wanted))
    else:
        place = registry.HOST if code.format == "double" else code.target.place
        looked_for = (kind, {"compact": "1e-3", "speed": "1e-5", "full": "full"}[kind], code.format, place)
        entries = registry.entries()
        found = next(RegistryKernel(met, code, e) for e in entries if (e.kind, e.tier, e.format, e.place) == looked_for)
    offer = Offer(found, ())
    return Choice(made, met, [offer], offer, "no kernel is cheaper", ())


@cache
def choice(language, form=None, constant=False, spread=True):
    bodies = SPREAD if spread else SAME
    if not constant:
        return chosen(scene(language, form, bodies))
    return chosen(scene(language, form, bodies, slowest="0.9 m/s", tolerance="absolute = 0.5"), "constant")


@cache
def text(language, form=None, constant=False, spread=True):
    return render(choice(language, form, constant, spread), COMMAND)


def outside_comments(language, made):
    mark = target(language).comment.strip()
    pattern = r"/\*.*?\*/" if mark == "*" else rf"{re.escape(mark)}[^\n]*"
    return " ".join(re.sub(pattern, "", made, flags=re.DOTALL).split())


def tool(name):
    found = which(name)
    if found is None:
        pytest.skip(f"{name} is not installed")
    return found


def succeed(directory, *words):
    ran = subprocess.run(words, cwd=directory, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr + ran.stdout
    return ran.stdout


# --- what it says -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("language", read.LANGUAGES)
@pytest.mark.parametrize("constant", [False, True])
def test_the_file_says_what_it_is(language, constant):
    made = text(language, None, constant)
    assert MARKER in made[:1000]
    assert COMMAND in made[:1000]
    assert made == render(choice(language, None, constant), COMMAND)
    assert made.rstrip("\n") + "\n" == made
    assert not [line for line in made.splitlines() if line != line.rstrip()]
    assert "some/where" not in made
    first = target(language).first_index
    assert re.search(rf"^.{{0,2}}\s+{first}  a-a: beta = ", made, re.MULTILINE)
    for words in ("End condition", "Proven on this scene", "Use: "):
        assert words in made


@pytest.mark.parametrize("language", read.LANGUAGES)
@pytest.mark.parametrize("title", HARD)
def test_titles_do_not_end_comments(language, title):
    plain = choice(language, None, True)
    made = render(replace(plain, scene=replace(plain.scene, title=title)), COMMAND)
    assert outside_comments(language, made) == outside_comments(language, text(language, None, True))
    for line in made.splitlines():
        assert not line.endswith("\\")
        assert line.isprintable()
        assert "??/" not in line
        if target(language).comment == " *" and line.startswith(" * "):
            assert "*/" not in line[1:].replace("/*", "*/")
    if language == "python":
        ast.parse(made)


# --- names ------------------------------------------------------------------------------------------------------------


def of_bodies(language, *bodies, name="tiny"):
    given = "".join(f'[body.{body}]\nmaterial = "m"\nradius = "5 mm"\n' for body in bodies)
    return chosen(
        scene(language, bodies=given, top=f'name = "{name}"', slowest="0.9 m/s", tolerance="absolute = 0.5"), "constant"
    )


@pytest.mark.parametrize("language", read.LANGUAGES)
@pytest.mark.parametrize(
    "bodies", [("a_b", "c", "a", "b_c"), ("A", "a"), ("a", "a_0", "0".join("ab")), ("a_", "_".join("a_b"), "a__b")]
)
def test_names_of_pairs_are_different(language, bodies):
    found = names(of_bodies(language, *bodies))
    assert len({name.casefold() for name in found}) == len(found)
    assert not [name for name in found if "__" in name]
    assert all(re.fullmatch(r"pair\d*_\w+", name) for name in found)


@pytest.mark.parametrize(("bodies", "name"), [(40, 40), (20, 20), (19, 19)])
def test_names_in_fortran_are_short_enough(bodies, name):
    long = of_bodies("fortran", "b" * bodies, "c" * bodies, name="n" * name)
    assert max(len(f"{prefix(long.scene)}_{name}") for name in names(long)) <= 63
    assert len(set(names(long))) == len(names(long))
    assert max(len(word) for word in re.findall(r"\w+", outside_comments("fortran", render(long, COMMAND)))) <= 63


@pytest.mark.parametrize(
    ("language", "name", "expected"),
    [
        ("c", "math", "math_scene.h"),
        ("c", "Stdio", "Stdio_scene.h"),
        ("python", "class", "class_scene.py"),
        ("python", "random", "random_scene.py"),
        ("python", "viscopade", "viscopade_scene.py"),
        ("fortran", "module", "module.f90"),
    ],
)
def test_names_of_files(language, name, expected):
    assert file_name(replace(scene(language), name=name)) == expected


# --- numbers ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("unit", ["nm", "um", "cm", "km"])
@pytest.mark.parametrize("form", ["double", "float"])
def test_beta_of_given_radii(tmp_path, unit, form):
    """Against the model, for all units: powers of radii do not leave the range of the type."""
    made = chosen(scene("c", form, end=f'[units]\nlength = "{unit}"'))
    given, kind = made.scene, np.dtype(form if form == "double" else "float32").type
    (tmp_path / "tiny.h").write_text(render(made, COMMAND))
    number = f"{form} first, {form} second"
    source = f'#include "tiny.h"\n{form} call(int pair, {number}) {{ return tiny_beta_of(pair, first, second); }}\n'
    (tmp_path / "call.c").write_text(source)
    command = compiled.compiler("c99")
    succeed(tmp_path, *command, *compiled.WARNINGS, "-O2", "-fPIC", "-shared", "call.c", "-o", "call.so", "-lm")
    call = ctypes.CDLL(str(tmp_path / "call.so")).call
    real = ctypes.c_double if form == "double" else ctypes.c_float
    call.argtypes, call.restype = [ctypes.c_int, real, real], real
    scale = given.scale
    for index, encounter in enumerate(made.encounters):
        for r1 in (1e-9, 1e-6, 3e-3, 1.0, 1e3):
            for r2 in (1e-9, 5e-3, 1e4):
                radii = (r1, r1 if encounter.meeting.second == encounter.meeting.first else r2)
                expected = scale.beta(given.pair(encounter.meeting, radii).beta)
                found = call(index, *(kind(r / scale.length) for r in radii))
                assert found == pytest.approx(expected, rel=1e-14 if form == "double" else 1e-6, abs=0)


def test_beta_of_given_radii_in_python():
    made, module = choice("python"), {}
    exec(text("python"), module)
    for encounter in made.encounters:
        for radii in ((0.01, 0.02), (0.02, 0.005), (3e-3, 3e-3)):
            found = module["beta_of"](encounter.name, *radii)
            assert found == pytest.approx(made.scene.pair(encounter.meeting, radii).beta, rel=1e-14, abs=0)
        assert module["BETA"][encounter.name] == encounter.pair.beta


CALLS = {
    "jax": """
import jax
jax.config.update("jax_enable_x64", {double})
import tiny as scene
found = [float(jax.jit(scene.beta_of)(*row)) for row in rows]
""",
    "numba": """
import tiny as scene
found = [scene.beta_of(*row) for row in rows]
""",
    "warp": """
import contextlib
import sys
import warp as wp
import tiny as scene
wp.config.kernel_cache_dir = "cache"
@wp.kernel
def compute(pair: wp.array(dtype=wp.int32), r: wp.array2d(dtype={number}), out: wp.array(dtype={number})):
    i = wp.tid()
    out[i] = scene.beta_of(pair[i], r[i, 0], r[i, 1])
with contextlib.redirect_stdout(sys.stderr), wp.ScopedDevice("cpu"):
    out = wp.zeros(len(rows), dtype={number})
    pair, radii = [row[0] for row in rows], [row[1:] for row in rows]
    wp.launch(compute, len(rows), [wp.array(pair, dtype=wp.int32), wp.array(radii, dtype={number}), out])
    found = out.numpy().tolist()
""",
}


@pytest.mark.parametrize(("language", "form"), [(lang, form) for lang, form in EACH if lang in CALLS])
def test_beta_of_given_radii_in_packages_of_python(tmp_path, language, form):
    runner = target(language).runner
    if find_tool(runner) is None:
        pytest.skip(f"the Python package {runner.package} is not installed")
    made = choice(language, form)
    (tmp_path / "tiny.py").write_text(text(language, form))
    radii = [(i, first, second) for i in range(len(made.encounters)) for first, second in ((0.01, 0.02), (3e-3, 5e-3))]
    calls = CALLS[language].format(double=form == "double", number=target(language).number(form).type)
    (tmp_path / "call.py").write_text(f"rows = {radii}\n{calls}\nprint(*found)\n")
    found = map(float, succeed(tmp_path, sys.executable, "call.py").split())
    for value, (index, *pair) in zip(found, radii, strict=True):
        meeting = made.encounters[index].meeting
        expected = made.scene.pair(meeting, tuple(pair)).beta
        assert value == pytest.approx(expected, rel=1e-13 if form == "double" else 1e-6, abs=0)


@pytest.mark.parametrize(("language", "form"), [pair for pair in EACH if target(pair[0]).suffix == ".py"])
@pytest.mark.parametrize("constant", [False, True])
def test_modules_of_python_define_what_they_use(language, form, constant):
    """Where a package is not installed, too."""
    nodes = [*ast.walk(ast.parse(text(language, form, constant)))]
    defined = {node.name for node in nodes if isinstance(node, ast.FunctionDef)} | set(dir(builtins))
    defined |= {name.asname or name.name for node in nodes if isinstance(node, ast.Import) for name in node.names}
    defined |= {name.name for node in nodes if isinstance(node, ast.ImportFrom) for name in node.names}
    defined |= {node.arg for node in nodes if isinstance(node, ast.arg)}
    defined |= {node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
    assert {node.id for node in nodes if isinstance(node, ast.Name)} <= defined


def test_numbers_that_float_does_not_have_are_refused():
    made = choice("rust", "float")
    with pytest.raises(ValueError, match=r"^some/where/tiny.toml: units: beta, or beta times a radius, is .* float$"):
        render(replace(made, scene=replace(made.scene, scale=Scale(1e-55))), COMMAND)


BETAS = {
    "a-b": scene("c").pair(Meeting("a", "b", Speeds.between(1.0, 1.0)), (0.02, 0.005)).beta,
    "a-wall": scene("c").pair(Meeting("a", "wall", Speeds.between(1.0, 1.0)), (0.01, None)).beta,
}

# --- compilers, with warnings -----------------------------------------------------------------------------------------

USE = """
#include "tiny.h"
#include "tiny.h"
int main(void) { return 0; }
"""


@pytest.mark.parametrize("standard", ["c99", "c++98"])
@pytest.mark.parametrize("form", ["double", "float"])
@pytest.mark.parametrize("kind", [None, "constant", "polynomial"])
def test_c_has_no_warnings(tmp_path, standard, form, kind):
    """Included, and nothing of it used, or the functions for batches."""
    for code in ("", 'use = "batch"', 'use = "batch"\nargument = "v_star"'):
        found = chosen(scene("c", form, code=code), kind)
        if found.chosen.candidate.bytes and standard == "c++98":  # tables are hexadecimal
            continue
        made = render(found, COMMAND)
        (tmp_path / "tiny.h").write_text(made)
        (tmp_path / "use.c").write_text(USE)
        command = compiled.compiler(standard)
        succeed(tmp_path, *command, *compiled.WARNINGS, "-fsyntax-only", "use.c")
        assert ("_batch(" in made) == ("batch" in code and kind != "constant")


BATCH = """
#include <stdio.h>
#include "tiny.h"
int main(void)
{
    const double radii[] = {0.005, 0.01, 0.02}, speed[] = {0.3, 0.1, 0.2};
    double beta[3], eps[3];
    for (int i = 0; i < 3; i++) beta[i] = tiny_beta_of(tiny_pair_a_b, radii[i], 0.01);
    tiny_restitution_batch(3, speed, beta, eps);
    for (int i = 0; i < 3; i++) if (eps[i] != tiny_restitution(speed[i], beta[i])) return 1;
    return eps[0] == eps[1];
}
"""


def test_a_batch_of_distributed_sizes_takes_the_beta_of_each(tmp_path):
    made = render(chosen(scene("c", code='use = "batch"'), "polynomial"), COMMAND)
    assert "const int *pair" not in made
    (tmp_path / "tiny.h").write_text(made)
    (tmp_path / "use.c").write_text(BATCH)
    succeed(tmp_path, *compiled.compiler("c99"), *compiled.WARNINGS, "use.c", "-o", "use", "-lm")
    succeed(tmp_path, "./use")
    assert "tiny_restitution(speed, tiny_beta_of(tiny_pair_a_a, first_radius, second_radius))" in made


@pytest.mark.parametrize(
    ("language", "form"), [pair for pair in EACH if pair[0] in ("cuda", "fortran", "rust", "glsl")]
)
@pytest.mark.parametrize("constant", [False, True])
def test_compilers_have_no_warnings(tmp_path, language, form, constant):
    made, name = text(language, form, constant), file_name(choice(language, form, constant).scene)
    (tmp_path / name).write_text(made)
    if language == "cuda":
        (tmp_path / "use.cpp").write_text(USE.replace(".h", ".cuh"))
        succeed(tmp_path, *compiled.compiler("c++17"), *compiled.WARNINGS, "-fsyntax-only", "use.cpp")
    elif language == "fortran":
        warnings = ("-std=f2018", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror")
        succeed(tmp_path, tool("gfortran"), *warnings, "-c", name)
    elif language == "rust":
        (tmp_path / "lib.rs").write_text("pub mod tiny;\n")
        succeed(tmp_path, tool("rustc"), "--edition", "2021", "--crate-type", "lib", "-D", "warnings", "lib.rs")
    elif language == "glsl":
        for version in ("450", "320 es"):
            precision = "precision highp float;\n" if "es" in version else ""
            shader = f"#version {version}\n{precision}{made}\n{made}\nvoid main() {{ }}\n"
            (tmp_path / "use.vert").write_text(shader)
            succeed(tmp_path, tool("glslangValidator"), "use.vert")


@pytest.mark.parametrize("constant", [False, True])
def test_device_code_has_no_warnings(tmp_path, constant):
    (tmp_path / "tiny.cuh").write_text(text("cuda", "float", constant))
    (tmp_path / "use.cu").write_text(USE.replace(".h", ".cuh"))
    succeed(tmp_path, tool("nvcc"), "-Werror", "all-warnings", "-c", "use.cu")


def test_fortran_takes_two_scenes(tmp_path):
    gfortran = tool("gfortran")
    first = choice("fortran")
    second = replace(first, scene=replace(first.scene, name="other"))
    for made in (first, second):
        (tmp_path / file_name(made.scene)).write_text(render(made, COMMAND))
    (tmp_path / "main.f90").write_text(
        "program both\n use tiny_scene\n use other_scene\n implicit none\n"
        " print *, tiny_beta_of(tiny_pair_a_b, 0.02d0, 0.005d0), other_beta_of(other_pair_a_wall, 0.01d0, 0d0), &\n"
        "  tiny_restitution([1d0, 2d0], tiny_beta(1)), tiny_pairs, size(other_beta)\nend program\n"
    )
    succeed(tmp_path, gfortran, "-Wall", "-Werror", "tiny.f90", "other.f90", "main.f90", "-o", "both")
    found = [float(word) for word in succeed(tmp_path, str(tmp_path / "both")).split()]
    assert found[:2] == pytest.approx(list(BETAS.values()), rel=1e-14, abs=0)
    assert 0 < found[3] < found[2] < 1
    assert found[4:] == [5, 5]


def test_beta_of_given_radii_in_javascript(tmp_path):
    node = tool("node")
    (tmp_path / "tiny.mjs").write_text(text("javascript"))
    calls = "m.beta_of(m.pair_a_b, 0.02, 0.005), m.beta_of(m.pair_a_wall, 0.01)"
    (tmp_path / "main.mjs").write_text(f'import * as m from "./tiny.mjs";\nconsole.log({calls});\n')
    found = [float(word) for word in succeed(tmp_path, node, "main.mjs").split()]
    assert found == pytest.approx(list(BETAS.values()), rel=1e-14, abs=0)


def test_beta_of_given_radii_in_rust(tmp_path):
    rustc = tool("rustc")
    (tmp_path / "tiny.rs").write_text(text("rust", "float"))
    calls = "m::beta_of(m::PAIR_A_B, 0.02, 0.005), m::beta_of(m::PAIR_A_WALL, 0.01, 0.0)"
    main = '#[allow(dead_code)]\n#[path = "tiny.rs"]\nmod m;\nfn main() { println!("{} {}", CALLS); }\n'
    (tmp_path / "main.rs").write_text(main.replace("CALLS", calls))
    succeed(tmp_path, rustc, "--edition", "2021", "-D", "warnings", "main.rs")
    found = [float(word) for word in succeed(tmp_path, str(tmp_path / "main")).split()]
    assert found == pytest.approx(list(BETAS.values()), rel=1e-6)


def test_constants_of_pairs():
    candidate = choice("glsl", None, True).chosen.candidate
    assert isinstance(candidate, PairConstant)
    numbers = re.search(r"tiny_epsilon\[5\] = float\[5\]\((.*?)\);", text("glsl", None, True), re.DOTALL)[1]
    found = [float(line.split(",")[0].split("//")[0]) for line in numbers.strip().splitlines()]
    assert found == pytest.approx([float(value) for value in candidate.values], rel=1e-7)
