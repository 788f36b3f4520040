"""The languages of generated code. To add one is to write its module here, with one object TARGET, and to list it."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from viscopade.kernels.targets.language import Target

__all__: list[str] = []  # modules of languages are taken by `target`

LANGUAGES = (
    *("c", "python", "cuda", "glsl", "wgsl", "javascript", "fortran", "rust", "julia"),
    *("jax", "numba", "warp"),
)
"""Names of the targets, which are those of their modules."""


@cache
def target(name: str) -> Target:
    """Return the target of a name.

    Raises
    ------
    ValueError
        If there is none.
    """
    if name not in LANGUAGES:
        raise ValueError(f"target is {name!r}: accepted are {', '.join(LANGUAGES)}")
    found: Target = import_module(f"{__name__}.{name}").TARGET
    return found


def targets() -> tuple[Target, ...]:
    """Return all targets."""
    return tuple(map(target, LANGUAGES))
