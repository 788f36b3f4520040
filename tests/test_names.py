"""What docstrings and pages call by name is there."""

import ast
import re
from collections import defaultdict
from functools import cache
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "viscopade"
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
PATHS = re.compile(
    r"\b(?:src/viscopade(?:_lab)?|checkers|tools|tests|docs|derivations|examples|notebooks|exports)/[\w./-]*\w\.\w+"
)


@cache
def trees():
    return {path: ast.parse(path.read_text()) for path in sorted(SOURCE.rglob("*.py"))}


def texts(tree):
    """Yield strings that are statements: docstrings, also those of variables."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            yield node.value


def identifiers(tree):
    """Return all names in the code, and the words of its strings (keys, columns), without docstrings."""
    documentation, found = set(map(id, texts(tree))), set()
    for node in ast.walk(tree):
        named = [getattr(node, field, None) for field in ("id", "attr", "arg", "name", "module", "value")]
        if id(node) not in documentation:
            found.update(word for name in named if isinstance(name, str) for word in re.findall(r"\w+", name))
    return found


@cache
def known():
    return set().union(*map(identifiers, trees().values()))


@cache
def modules():
    return {".".join(path.relative_to(SOURCE).with_suffix("").parts).removesuffix(".__init__") for path in trees()}


def quoted(text):
    """Return the dotted names in backquotes, without arguments."""
    spans = re.findall(r"`+([^`]+)`+", text)
    return [found[1] for span in spans if (found := re.fullmatch(r"((?:[A-Za-z_]\w*\.)*[A-Za-z_]\w*)(\(.*\))?", span))]


def resolves(name):
    """Whether a dotted name is there in one of the modules that its beginning may mean, or means none of ours."""
    parts = name.removeprefix("viscopade.").split(".")
    meant = [module for module in modules() if module.split(".")[-1] == parts[0]]
    return not meant or any(found(f"viscopade.{module}", parts[1:]) for module in meant)


def found(module, attributes):
    thing = import_module(module)
    for name in attributes:
        try:
            thing = getattr(thing, name) if hasattr(thing, name) else import_module(f"{thing.__name__}.{name}")
        except ImportError:
            return False
    return True


def documentation():
    """Yield paths and what is to be read there."""
    yield from ((path, text.value) for path, tree in trees().items() for text in texts(tree))
    yield from ((page, page.read_text()) for page in PAGES)


def test_names_in_docstrings():
    for path, text in documentation():
        if path in trees():
            assert [(path, name) for name in quoted(text) if "." in name and not resolves(name)] == []
            plain = [name for name in quoted(text) if "_" in name and "." not in name]
            if path.parent.name != "simulators":  # there, names of other programs
                assert [(path, name) for name in plain if name not in known()] == []


def test_names_on_pages():
    """Keys of a scene look like names of modules; so each part of a name must be known, here or as a file's suffix."""
    for path, text in documentation():
        names = [name for name in quoted(text) if "." in name and name.split(".")[0] in modules()]
        assert [(path, name) for name in names if not (resolves(name) or known().issuperset(name.split(".")))] == []


def test_files_that_are_named():
    for path, text in documentation():
        assert [(path, name) for name in PATHS.findall(text) if not (ROOT / name).exists()] == []


def test_code_spans_are_on_one_line():
    for page in PAGES:
        text = re.sub(r"^```.*?^```", "", page.read_text(), flags=re.MULTILINE | re.DOTALL)
        assert [(page, line) for line in text.splitlines() if line.count("`") % 2] == []


def test_stale_names_are_found():
    assert all(map(resolves, ("panel_proof.prove_row", "viscopade.collision.panel_proof.prove_row", "np.exp")))
    assert not any(map(resolves, ("panel_proof.prove_elastic", "kernels.speed_table_of")))
    assert {"prove_row", "prove_elastic"} - known() == {"prove_elastic"}


def test_one_name_has_one_meaning():
    """A quantity may be computed in several ways, targets render and readers read; others stand in one module."""
    shared = {"epsilon", "one_minus_epsilon", "restitution", "invert", "render", "main", "fit", "read"}
    places = defaultdict(set)
    for path, tree in trees().items():
        for node in tree.body:
            if isinstance(node, ast.ClassDef | ast.FunctionDef) and not node.name.startswith("_"):
                places[node.name].add(path)
    assert {name for name, paths in places.items() if len(paths) > 1} <= shared


FOLDERS = ("src/viscopade", "src/viscopade_lab", "tools", "checkers")
VAGUE = {"found", "given", "wanted", "known", "of", "at", "by", "on", "own", "each", "every", "there"}
"""Prepositions and participles, which do not say what a value is."""


def bindings(tree):
    """Yield the names that code binds: variables, arguments, functions, classes, fields, new names of imports."""
    for node in ast.walk(tree):
        match node:
            case ast.Name(id=name, ctx=ast.Store()) | ast.arg(arg=name) | ast.alias(asname=str(name)):
                yield name
            case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name) | ast.ClassDef(name=name):
                yield name
            case ast.ExceptHandler(name=str(name)) | ast.MatchAs(name=str(name)) | ast.MatchStar(name=str(name)):
                yield name
            case ast.Attribute(attr=name, ctx=ast.Store(), value=ast.Name(id="self")):
                yield name


def test_every_binding_of_a_name_counts():
    classes = "class A:\n    def at(self, by, *on, own):\n        self.found, other.known = own, f(wanted=1)"
    statements = "import a as of\neach: int = 1\nfor every in (there := []): pass"
    names = {name for code in (classes, statements) for name in bindings(ast.parse(code))}
    assert names & VAGUE == VAGUE - {"known", "wanted", "given"}


@pytest.mark.parametrize("folder", FOLDERS)
def test_names_say_the_thing(folder):
    paths = sorted((ROOT / folder).rglob("*.py"))
    vague = [(path, name) for path in paths for name in bindings(ast.parse(path.read_text())) if name in VAGUE]
    assert paths
    assert vague == []
