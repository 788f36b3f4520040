"""The tests in other Pythons, with the oldest and the newest versions of the packages that pyproject.toml allows.

For every interpreter and every set of versions: a new virtual environment under a temporary directory, a copy of this
tree installed into it, `viscopade reproduce` compared with exports/ byte for byte, and the tests. Warnings are errors.
The sets:

    oldest          the lower bounds of pyproject.toml; where a package has no wheel of that version for a Python, the
                    oldest version that has one
    newest          what pip takes of its own accord
    newest mpmath   the newest mpmath; SymPy from 1.12.1 on refuses it, so pip takes an older SymPy

Needs the package index. Run as `python -m tools.environment_matrix`; `--out` replaces the rows of the same Python
and set in a table and keeps the others. The whole suite (`--scope all`) takes half an hour in each environment.
"""

from __future__ import annotations

import csv
import os
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import click

ROOT = Path(__file__).parents[1]
RESULT = ROOT / "src" / "viscopade" / "data" / "environments.csv"
PARTS = (
    "CHANGELOG.md", "LICENSE", "MANIFEST.in", "Makefile", "README.md", "constraints.txt", "pyproject.toml", "setup.py",
    "benchmarks", "derivations", "docs", "examples", "exports", "notebooks", "src", "tests",
)  # fmt: skip
SETS = ("oldest", "newest", "newest mpmath")
PACKAGES = ("sympy", "mpmath", "numpy", "python-flint", "click", "jinja2", "pint", "rich", "matplotlib", "scipy")
# Of the optional packages and the tools, those that the selected tests use; ruff and mypy check the same everywhere.
OPTIONAL = ("matplotlib", "scipy", "hypothesis", "nbformat", "pytest", "pytest-xdist", "setuptools")
TESTS: Mapping[str, Sequence[str]] = {
    "few": tuple(
        f"tests/test_{name}.py"
        for name in (
            "balls", "series", "pade", "flow", "exact", "model", "perturbation", "double", "kernels", "cli",
            "cli_scenes", "scene_read", "scene_cost", "writer", "layers", "gas",
        )
    ),
    "all": ("tests",),
}  # fmt: skip
COLUMNS = (
    "python", "set", "tests", *PACKAGES, "exports_same", "exports", "passed", "failed", "skipped",
)  # fmt: skip


class MatrixError(RuntimeError):
    """An environment cannot be made; the message is one line."""


def run(words: Sequence[str], directory: Path, **variables: str) -> subprocess.CompletedProcess[str]:
    """Run a command in a directory, without what the calling environment says of Python."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "VIRTUAL_ENV"))}
    return subprocess.run(
        list(words), cwd=directory, capture_output=True, text=True, errors="replace", env=kept | variables
    )


def succeed(words: Sequence[str], directory: Path) -> str:
    """Run a command that has to succeed; return what it prints."""
    done = run(words, directory)
    if done.returncode:
        last = (done.stderr.strip() or done.stdout.strip()).splitlines()[-1:]
        raise MatrixError(f"{' '.join(words[1:])[:200]}: {''.join(last)}")
    return done.stdout


def bounds(names: Iterable[str]) -> dict[str, str]:
    """Return the lower bounds that pyproject.toml states for these packages."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    stated = sum(project["optional-dependencies"].values(), project["dependencies"])
    found = dict(line.split(">=") for line in stated if ">=" in line)
    return {name: str(found[name]) for name in names if name in found}


def number(version: str) -> tuple[int, ...]:
    """Return 1.26.0 as (1, 26)."""
    parts = [int(part) for part in version.split(".")]
    while parts and not parts[-1]:
        parts.pop()
    return tuple(parts)


def oldest(pip: Sequence[str], name: str, bound: str, directory: Path) -> str:
    """Return the oldest version from the bound on that has a wheel for this Python."""
    listed = re.search(r"Available versions: (.*)", succeed([*pip, "index", "versions", name], directory))
    versions: list[str] = re.findall(r"(?:^|, )(\d+(?:\.\d+)*)(?=,|$)", listed[1] if listed else "")
    for version in sorted(versions, key=number):
        wanted = [*pip, "install", "--quiet", "--dry-run", "--no-deps", "--only-binary", ":all:", f"{name}=={version}"]
        if number(version) >= number(bound) and not run(wanted, directory).returncode:
            return version
    raise MatrixError(f"{name} has no wheel from {bound} on")


def requirements(pip: Sequence[str], chosen: str, directory: Path) -> list[str]:
    """Return what pip is asked for besides the project."""
    if chosen == "oldest":
        stated = bounds(PACKAGES)
        pinned = [f"{name}=={oldest(pip, name, bound, directory)}" for name, bound in stated.items()]
        return [*pinned, *(name for name in OPTIONAL if name not in stated)]
    return [*OPTIONAL, *(["mpmath>=1.4"] if chosen == "newest mpmath" else [])]


def versions(pip: Sequence[str], directory: Path) -> dict[str, str]:
    """Return the versions of the packages that are installed."""
    lines = succeed([*pip, "list", "--format", "freeze"], directory).splitlines()
    installed = {name.lower().replace("_", "-"): version for name, _, version in (x.partition("==") for x in lines)}
    return {name: installed.get(name, "") for name in PACKAGES}


def same_exports(python: str, tree: Path, directory: Path) -> tuple[int, int]:
    """Return how many files `viscopade reproduce` makes as they are in exports/, and how many those are."""
    words = [python, "-W", "error", "-m", "viscopade", "reproduce", "--out", str(directory / "made")]
    done = run(words, directory)
    if done.returncode:
        click.echo(done.stderr[-2000:], err=True)
    stated = sorted((tree / "exports").iterdir())
    made = [directory / "made" / path.name for path in stated]
    return sum(m.exists() and m.read_bytes() == p.read_bytes() for m, p in zip(made, stated, strict=True)), len(stated)


def tested(python: str, tree: Path, scope: str, workers: int) -> dict[str, int]:
    """Return how many tests passed, failed and were skipped; what failed goes to standard error."""
    words = [python, "-m", "pytest", "-q", "--tb=short", "-p", "no:cacheprovider", "--dist", "loadfile"]
    words += ["--deselect", "tests/test_cli.py::test_reproduce_writes_everything"]  # it has just been done
    path = os.pathsep.join((str(Path(python).parent), os.environ.get("PATH", "")))
    done = run([*words, "--numprocesses", str(workers), *TESTS[scope]], tree, PATH=path)
    last = (done.stdout.strip().splitlines() or [""])[-1]
    counts = {word: int(count) for count, word in re.findall(r"(\d+) (\w+)", last)}
    failed = counts.get("failed", 0) + counts.get("errors", 0) + counts.get("error", 0)
    failed = max(failed, int(done.returncode != 0))  # also where pytest did not come so far as to count
    if failed:
        click.echo(done.stdout[-20000:] + done.stderr[-2000:], err=True)
    return {"passed": counts.get("passed", 0), "failed": failed, "skipped": counts.get("skipped", 0)}


def environment(interpreter: str, chosen: str, scope: str, workers: int) -> dict[str, object]:
    """Make one environment, and return its row."""
    with TemporaryDirectory(prefix="viscopade-matrix-") as name:
        directory = Path(name)
        tree = directory / "tree"
        for part in PARTS:
            copy(ROOT / part, tree / part)
        succeed([interpreter, "-m", "venv", "venv"], directory)
        python = str(directory / "venv" / "bin" / "python")
        pip = (python, "-m", "pip", "--disable-pip-version-check")
        succeed([*pip, "install", "--quiet", "--upgrade", "pip"], directory)
        asked = requirements(pip, chosen, directory)
        succeed([*pip, "install", "--quiet", "--prefer-binary", "--editable", str(tree), *asked], directory)
        same, stated = same_exports(python, tree, directory)
        return {
            "python": succeed([python, "-c", "import platform; print(platform.python_version())"], directory).strip(),
            "set": chosen,
            "tests": scope,
            **versions(pip, directory),
            "exports_same": same,
            "exports": stated,
            **tested(python, tree, scope, workers),
        }


def copy(source: Path, target: Path) -> None:
    """Copy a part of the tree without what was built or cached there."""
    if source.is_dir():
        shutil.copytree(source, target, ignore=shutil.ignore_patterns("__pycache__", "*.so", "*.egg-info", "*_cache"))
    else:
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(source, target)


def found() -> list[str]:
    """Return the interpreters from 3.11 on that are there."""
    names = [f"python3.{minor}" for minor in range(11, 30)]
    paths = [path for path in map(shutil.which, names) if path]
    return [path for path in paths if not run([path, "-c", ""], ROOT).returncode] or [sys.executable]


def save(row: Mapping[str, object], out: Path) -> None:
    """Put a row into the table, in place of that of the same Python and set."""
    rows: list[Mapping[str, object]] = []
    if out.exists():
        with out.open(encoding="utf-8", newline="") as file:
            rows = [*csv.DictReader(file)]
    key = row["python"], row["set"], row["tests"]
    rows = [other for other in rows if (other["python"], other["set"], other["tests"]) != key] + [row]
    rows.sort(key=lambda one: (number(str(one["python"])), SETS.index(str(one["set"])), str(one["tests"])))
    with out.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


@click.command()
@click.option("--python", "interpreters", multiple=True, help="Interpreter.  [default: every python3.N from 3.11 on]")
@click.option("--set", "sets", type=click.Choice(SETS), multiple=True, default=SETS, help="Versions.  [default: all]")
@click.option("--scope", type=click.Choice(list(TESTS)), default="few", show_default=True, help="Tests.")
@click.option("--workers", type=int, default=2, show_default=True, help="Processes that test.")
@click.option("--out", type=click.Path(dir_okay=False, path_type=Path), default=RESULT, help="The table.")
def main(interpreters: Sequence[str], sets: Sequence[str], scope: str, workers: int, out: Path) -> None:
    """Test in every environment; exit status 1 if anything failed."""
    failed = False
    for interpreter in interpreters or found():
        for chosen in sets:
            try:
                row = environment(interpreter, chosen, scope, workers)
            except MatrixError as error:
                click.echo(f"{interpreter}, {chosen}: {error}", err=True)
                failed = True
                continue
            save(row, out)
            click.echo(", ".join(f"{name} {row[name]}" for name in COLUMNS))
            failed |= bool(row["failed"]) or row["exports_same"] != row["exports"] or not row["passed"]
    sys.exit(failed)


if __name__ == "__main__":
    main()
