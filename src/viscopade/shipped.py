"""Files of the package for other programs and first trials: C headers, CMake configuration, example scenes."""

from __future__ import annotations

from pathlib import Path

_PACKAGE = Path(__file__).parent
# Folders of an installed package, which setup.py fills, and the folders of the same files in a checkout.
_IN_A_CHECKOUT = {"include": "exports", "share/cmake/viscopade": "cmake", "examples": "examples"}


def get_include() -> str:
    """Return the folder of the C and C++ headers, for a compiler's -I; `viscopade --include-dir` prints it.

    Raises
    ------
    FileNotFoundError
        If the package was installed without them.
    """
    return str(_folder("include"))


def cmake_folder() -> str:
    """Return the folder that CMake's viscopade_DIR names; errors as for `get_include`."""
    return str(_folder("share/cmake/viscopade"))


def examples_folder() -> str:
    """Return the folder of the example scenes; errors as for `get_include`."""
    return str(_folder("examples"))


def example_scenes() -> dict[str, Path]:
    """Return the files of the example scenes by their names, such as ice_rings; errors as for `get_include`."""
    return {file.stem: file for file in sorted(_folder("examples").glob("*.toml"))}


def _folder(name: str) -> Path:
    """Return a folder of the installed package, or the one of the same files in a checkout, src/viscopade/../.."""
    for folder in (_PACKAGE / name, _PACKAGE.parents[1] / _IN_A_CHECKOUT[name]):
        if folder.is_dir():
            return folder
    raise FileNotFoundError(f"viscopade was installed without its folder {name}: expected an installation with pip")
