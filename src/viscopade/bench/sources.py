"""The C code of the benchmark: the timed loops, and the rivals' formulas."""

from __future__ import annotations

from typing import Any

from viscopade.bench.kernel import Kernel, Library
from viscopade.kernels import environment, marker_line

COMMAND = "viscopade bench"


def render(template: str, /, **values: Any) -> str:
    """Return a template of the benchmark, filled in."""
    return environment("viscopade").get_template(template).render(values)


def frame() -> str:
    """Return bench.h, which defines the loops."""
    return render("bench.h.jinja", marker=marker_line(COMMAND))


def unit(kernel: Kernel, library: Library) -> str:
    """Return the C file of a kernel for one of the libraries, or "" if that holds nothing of it."""
    loops = kernel.loops(library)
    if not loops:
        return ""
    return render(
        "bench_unit.c.jinja",
        marker=marker_line(COMMAND),
        headers=kernel.headers,
        source=kernel.source,
        loops=loops,
    )
