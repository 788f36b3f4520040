"""The tests in every Python that is found, with the oldest and the newest packages that pyproject.toml allows.

`python -m pip install nox uv; nox` runs all sessions, `nox -s "tests-3.12(packages='highest')"` runs one. A session
computes exports/ again and compares it byte for byte, and runs the tests of numbers and of the command line. In both,
warnings are errors. `nox -- tests` runs the whole suite instead, for half an hour in each environment.
"""

import nox

nox.needs_version = ">=2024.4"
nox.options.default_venv_backend = "uv"
nox.options.error_on_missing_interpreters = False

PACKAGES = ("hypothesis>=6.100", "nbformat>=5.10", "pytest>=8", "pytest-xdist>=3", "setuptools>=77")
FOLDERS = ("arithmetic", "arrays", "cli", "theory")
FILES = ("collision/test_exact.py", "collision/test_spheres.py", "kernels/test_quotient.py", "scene/test_read.py")


@nox.session(python=["3.11", "3.12", "3.13", "3.14"])
@nox.parametrize("packages", ["lowest-direct", "highest"])
def tests(session: nox.Session, packages: str) -> None:
    """Install the package with these versions, reproduce exports/, and test."""
    session.install("--resolution", packages, "--editable", ".[figures,fit]", *PACKAGES)
    exports = session.create_tmp()
    session.run("python", "-W", "error", "-m", "viscopade", "reproduce", "--out", exports)
    session.run("diff", "--recursive", "exports", exports, external=True)
    chosen = session.posargs or [f"tests/{name}" for name in (*FOLDERS, *FILES)]
    session.run("python", "-m", "pytest", "--numprocesses", "auto", "-q", *chosen)
