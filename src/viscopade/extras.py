"""Optional packages: the extra that includes each of them, and the command that installs it."""

from __future__ import annotations

import shlex
import sys
from importlib import import_module

EXTRAS = {
    "matplotlib": "figures",
    "scipy": "fit",
    "python_calamine": "fit",
    "mujoco": "simulators",
    "rebound": "simulators",
}
"""The extra in pyproject.toml for each package, by its name for `import`."""


class MissingPackage(ModuleNotFoundError):
    """An optional package is not installed; the message is one line."""


def install_command(*packages: str) -> str:
    """Return the command that installs optional packages, by their extras, with the Python that runs."""
    extras = ",".join(sorted({EXTRAS[package] for package in packages if package in EXTRAS}))
    words = [f"viscopade[{extras}]"] * bool(extras) + [package for package in packages if package not in EXTRAS]
    return shlex.join([sys.executable, "-m", "pip", "install", *words])


def require(user: str, *packages: str) -> None:
    """Check that optional packages are installed, before any work that needs them.

    Parameters
    ----------
    user : str
        The command or function that needs them, for the message.
    *packages : str
        Their names for `import`.

    Raises
    ------
    MissingPackage
        If a package cannot be imported; the message has the command that installs all missing ones.
    """
    # Try all packages, so that one message and one command are enough.
    errors = {}
    for package in packages:
        try:
            import_module(package)
        except ImportError as error:
            errors[package] = str(error)
    if errors:
        are = "which are" if len(errors) > 1 else "which is"
        why = "; ".join(errors.values())
        raise MissingPackage(
            f"{user} needs {' and '.join(errors)}, {are} not installed ({why}): {install_command(*errors)}"
        )
