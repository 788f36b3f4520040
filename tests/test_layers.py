"""Imports point downward, from package to package and inside each; and importing the package stays cheap."""

import ast
import os
import re
import subprocess
import sys
from dataclasses import replace
from functools import cache
from graphlib import TopologicalSorter
from importlib import import_module
from pathlib import Path

import pytest

import viscopade
from tests.kernels.languages import WAYS
from viscopade.kernels import requests
from viscopade.kernels.write.language import Runner
from viscopade.kernels.write.languages import NAMES as LANGUAGES
from viscopade.kernels.write.languages import language as language_of

SOURCE = Path(__file__).parents[1] / "src"

# Design section 3, from the ground up. Those of the first line are files; a package imports from those before it.
PACKAGES = (
    *("arguments", "records", "files", "progress", "generated", "extras", "shipped", "_native", "compiled"),
    *("arithmetic", "store", "quantity", "arrays", "theory", "collision", "approximation", "kernels"),
    *("fitting", "simulators", "scene", "plots", "calculator", "cli"),
)
# Nothing imports the hook of PyInstaller, which imports nothing of ours.
FRAME = {"viscopade", "viscopade.__main__", "viscopade.pyinstaller", "viscopade.pyinstaller.hook-viscopade"}
# Programs hand sources to compilers in temporary directories; `files` reads what people give; `shipped` finds the
# folders of the package; a line of a deck says in which file it stands.
TOUCH_FILES = {
    "viscopade.cli.writer",
    "viscopade.files",
    "viscopade.simulators.deck",
    "viscopade.simulators.lammps_deck",
    "viscopade.simulators.mujoco_model",
    "viscopade.shipped",
    "viscopade.kernels.write.runners",
    "viscopade.scene.check",
}


def name_of(path):
    return ".".join(path.relative_to(SOURCE).with_suffix("").parts).removesuffix(".__init__")


MODULES = {name_of(path): path for ending in ("py", "pyi") for path in SOURCE.rglob(f"*.{ending}")}
PRODUCT = sorted(module for module in MODULES if module.split(".")[0] == "viscopade" and module not in FRAME)


@cache
def nodes(module):
    return tuple(ast.walk(ast.parse(MODULES[module].read_text())))


@cache
def imports(module):
    """Return what a module imports of ours, anywhere in it (type-checking imports too): modules, and names in them."""
    return tuple(_imports(module))


def _imports(module):
    for node in nodes(module):
        if isinstance(node, ast.Import):
            yield from ((alias.name, "") for alias in node.names if alias.name.startswith("viscopade"))
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{module} uses a relative import"
            for alias in node.names:
                whole = f"{node.module}.{alias.name}"
                if whole in MODULES:
                    yield whole, ""
                elif str(node.module) in MODULES:
                    yield str(node.module), alias.name


def package_of(module):
    return module.split(".")[1] if "." in module else ""


def test_every_module_has_its_place():
    assert {package_of(module) for module in PRODUCT} == set(PACKAGES)


@pytest.mark.parametrize("module", PRODUCT)
def test_imports_point_downward(module):
    below = PACKAGES[: PACKAGES.index(package_of(module)) + 1]
    for other, _ in imports(module):
        assert package_of(other) in below, other


def test_no_module_of_the_product_imports_the_evidence():
    """`viscopade.cli.main` names the modules of all commands, and loads one when its command is looked for."""
    for module in PRODUCT:
        assert not any(other.startswith("viscopade_lab") for other, _ in imports(module))


def test_no_imports_run_in_a_circle():
    TopologicalSorter({module: {other for other, _ in imports(module)} - {module} for module in MODULES}).prepare()


@pytest.mark.parametrize("module", PRODUCT)
def test_packages_take_from_each_other_what_they_list(module):
    for other, name in imports(module):
        private = re.match(r"_[^_]", name) and (other, name) != ("viscopade.kernels", "_native")  # which is compiled
        assert not private, f"{other}.{name} is private"
        if other in FRAME or other.split(".")[:2] == module.split(".")[:2]:
            continue
        if other.count(".") > 1:
            package, _, inside = other.rpartition(".")
            assert inside in import_module(package).__all__, f"{other} is not listed by {package}"


@pytest.mark.parametrize("package", sorted({module.rpartition(".")[0] for module in PRODUCT if module.count(".") > 1}))
def test_packages_list_modules_that_are_there_and_wanted(package):
    """Wanted by other packages, by the laboratory, or by nobody else: then they are not listed."""
    listed = import_module(package).__all__
    wanted = {
        other.removeprefix(f"{package}.")
        for module in MODULES
        for other, _ in imports(module)
        if other.rpartition(".")[0] == package and module.split(".")[:2] != other.split(".")[:2]
    }
    assert sorted(listed) == sorted(wanted)


@pytest.mark.parametrize("module", sorted(set(PRODUCT) - TOUCH_FILES))
def test_only_the_command_line_and_compilers_touch_files(module):
    if module.startswith("viscopade.cli"):
        return
    names = {node.id for node in nodes(module) if isinstance(node, ast.Name)}
    assert not names & {"open", "Path", "os", "shutil", "tempfile"}


OF_LANGUAGES = "viscopade.kernels.write.languages"
NO_LANGUAGES = {
    # REBOUND has two interfaces, in C and in Python, which are no targets of kernels.
    "viscopade.simulators.rebound",
    "viscopade.simulators.input_file",
    # Constants in tables that are called c.
    "viscopade.kernels.formulas",
    "viscopade.kernels.full",
    "viscopade.kernels.speed_table",
}


@pytest.mark.parametrize("module", sorted({*PRODUCT} - NO_LANGUAGES))
def test_no_module_names_a_language(module):
    """But the list of languages, and each language's own module."""
    if module.startswith(OF_LANGUAGES):
        return
    texts = {node.value for node in nodes(module) if isinstance(node, ast.Constant) and isinstance(node.value, str)}
    assert not texts & {*LANGUAGES}


def test_each_language_has_one_module_that_names_no_other():
    found = {module: name for module in MODULES for name in LANGUAGES if module.endswith(f".{name.replace('-', '_')}")}
    found = {module: name for module, name in found.items() if module.startswith(OF_LANGUAGES)}
    assert sorted(found.values()) == sorted(LANGUAGES)
    for module, name in found.items():
        texts = {node.value for node in nodes(module) if isinstance(node, ast.Constant) and isinstance(node.value, str)}
        assert texts & {*LANGUAGES} == {name}
        assert language_of(name).name == name


WRITE = SOURCE / "viscopade" / "kernels" / "write"


def missing_of(name):
    """Return what a language still needs, by the table of docs/development/extending.md."""
    if name not in LANGUAGES:
        return ["its name in NAMES of kernels/write/languages/__init__.py"]
    found, root = language_of(name), SOURCE.parent
    exported = [file for file, (_, target) in requests._FILES.items() if target == name]
    rows = (root / "docs" / "reference" / "languages.md").read_text("utf-8")
    wanted = {
        f"a driver, {found.run.driver}.jinja": (WRITE / "drivers" / f"{found.run.driver}.jinja").is_file(),
        "a command that runs the driver": bool(found.run.start),
        "a way in WAYS of tests/kernels/languages.py": name in {way.language for way in WAYS.values()},
        "its files in exports/": bool(exported) and all((root / "exports" / file).is_file() for file in exported),
        "a row in docs/reference/languages.md": "compact" not in found.groups or f"| {name} |" in rows,
        "its name in docs/usage/scenes.md": f'`"{name}"`' in (root / "docs" / "usage" / "scenes.md").read_text("utf-8"),
    }
    return [what for what, is_there in wanted.items() if not is_there]


@pytest.mark.parametrize("name", sorted({*LANGUAGES, *(path.stem for path in (WRITE / "languages").glob("[a-z]*.py"))}))
def test_no_language_is_half_there(name):
    assert missing_of(name) == []


def test_a_language_that_is_half_there_is_found(monkeypatch):
    half = replace(language_of("rust"), name="rusty", run=Runner("rusty.rs"))
    monkeypatch.setattr(sys.modules[__name__], "LANGUAGES", (*LANGUAGES, "rusty"))
    monkeypatch.setattr(sys.modules[__name__], "language_of", lambda _: half)
    assert len(missing_of("rusty")) == 6
    assert missing_of("cobol") == ["its name in NAMES of kernels/write/languages/__init__.py"]


def loaded_after(statement):
    code = f"import sys\n{statement}\nprint(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    return set(run.stdout.split())


HEAVY = {"pint", "sympy", "matplotlib", "jinja2", "click", "rich", "scipy"}


def test_public_names_are_where_type_checkers_find_them():
    for node in ast.walk(ast.parse((SOURCE / "viscopade" / "__init__.py").read_text())):
        if isinstance(node, ast.ImportFrom) and str(node.module).startswith("viscopade."):
            for alias in node.names:
                here = getattr(viscopade, alias.name)
                assert here is getattr(import_module(node.module), alias.name, here)
                assert alias.name in viscopade.__all__


# The help of each command, that of the laboratory's commands as well.
HELP = """
import contextlib, io
from viscopade.cli.main import command
import click
with contextlib.redirect_stdout(io.StringIO()):
    for words in ((), *((name,) for name in command.list_commands(click.Context(command)))):
        command.main([*words, "--help"], standalone_mode=False)
"""
NUMERICAL = {"numpy", "flint", "mpmath"}


@pytest.mark.parametrize(
    ("code", "unwanted"),
    [
        ("import viscopade", HEAVY | NUMERICAL),
        ("import viscopade\n[getattr(viscopade, name) for name in viscopade.__all__]", HEAVY),
        ("import viscopade as vp; vp.series(10, 10); vp.pade(3, 6)", HEAVY),
        (HELP, HEAVY - {"click"} | NUMERICAL),
    ],
)
def test_nothing_heavy_is_loaded(code, unwanted):
    assert not loaded_after(code) & unwanted


COMMAND = """
from contextlib import redirect_stdout, suppress
from io import StringIO
from viscopade.__main__ import main
sys.argv[1:] = ["epsilon", "--v-star", "1"]
with redirect_stdout(StringIO()), suppress(SystemExit):
    main()
"""


def test_a_command_loads_its_own_module():
    loaded = {name for name in loaded_after(COMMAND) if name.startswith("viscopade.cli.")}
    assert loaded == {f"viscopade.cli.{name}" for name in ("console", "derive", "main", "writer")}


@pytest.mark.parametrize(
    ("code", "before", "after"),
    [("import viscopade; viscopade.epsilon(1)", None, "None"), (COMMAND, None, "1"), (COMMAND, "2", "2")],
)
def test_only_the_command_line_sets_the_threads_of_numpy_unless_they_are_set(code, before, after):
    variables = {name: value for name, value in os.environ.items() if name != "OPENBLAS_NUM_THREADS"}
    variables |= {"OPENBLAS_NUM_THREADS": before} if before else {}
    code = f"import os, sys\n{code}\nprint(os.environ.get('OPENBLAS_NUM_THREADS'))"
    run = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True, env=variables)
    assert run.stdout.strip() == after
