"""The languages of generated code. To add one is to write its module here, with one object LANGUAGE, and to list it."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from viscopade.kernels.write.language import Language

__all__: list[str] = []

NAMES = (
    "c",
    "cuda",
    "python",
    "arrays",
    "fortran",
    "rust",
    "julia",
    "javascript",
    "script",
    "warp",
    "csharp",
)


@cache
def language(name: str) -> Language:
    """Return the language of a name in `NAMES`; its module is loaded when it is first asked for.

    Raises
    ------
    ValueError
        If there is none.
    """
    if name not in NAMES:
        raise ValueError(f"language is {name!r}: expected {', '.join(NAMES)}")
    data: Language = import_module(f"{__name__}.{name}").LANGUAGE
    return data
