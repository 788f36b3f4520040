"""Errors of XLA's log and exp, which the proven bounds of `viscopade_jax.py` take to be within 4 ulp.

In type float at every `step`-th number, all of them by default, compared with NumPy's functions in double precision; in
type double at random arguments, compared with mpmath. The arguments are those that a kernel can have: w of log is a
normal number up to the cut-off, and that of exp is ln(w)/30. Run as `python -m viscopade_lab.studies.jax_functions`;
needs JAX.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from importlib import import_module
from typing import Any

import click
import mpmath
import numpy as np
import numpy.typing as npt
from rich.table import Table

from viscopade.arithmetic.formats import FLOAT, FORMATS, Format
from viscopade.kernels.forms.table_free import LARGEST, ROOT
from viscopade_lab.script import command, console

Array = npt.NDArray[Any]
_MANY = 1 << 22  # numbers at a time
_SEED = 5


def _ends(form: Format) -> dict[str, tuple[float, float]]:
    """Return the ranges of arguments: log's, and exp's on either side of 0, by size."""
    low, high = 1 - form.largest, LARGEST[form.name]
    tiny = 2.0 ** -(form.precision + 1)  # below, exp is 1
    exponents = {"exp": high, "exp of -x": -low}
    return {"log": (2.0**low, 2.0**high)} | {name: (tiny, e * math.log(2) / ROOT) for name, e in exponents.items()}


def _floats(low: float, high: float, step: int) -> Iterator[Array]:
    """Yield every `step`-th number of type float32 between two."""
    first, last = (int(np.float32(end).view(np.uint32)) for end in (low, high))
    for start in range(first, last, _MANY * step):
        yield np.arange(start, min(last, start + _MANY * step), step, dtype=np.uint32).view(np.float32)


def _in_ulp(found: Array, exact: Array) -> float:
    """Return the largest error of float32 numbers in units in the last place of exact ones."""
    unit = np.ldexp(1.0, np.frexp(exact)[1] - FLOAT.precision)
    return float(np.max(np.abs(found.astype(np.float64) - exact) / unit, where=exact != 0, initial=0))


def measure(step: int, size: int) -> dict[str, dict[str, float]]:
    """Return the largest errors by function and format, in ulp."""
    jax = import_module("jax")
    jax.config.update("jax_enable_x64", True)
    jax.config.update("jax_platforms", "cpu")
    random = np.random.default_rng(_SEED)
    worst: dict[str, dict[str, float]] = {}
    for form in FORMATS.values():
        for name, (low, high) in _ends(form).items():
            function = jax.jit(_of(name, jax.numpy))
            if form == FLOAT:
                exact = _of(name, np)
                errors = [
                    _in_ulp(np.asarray(function(x)), exact(x.astype(np.float64))) for x in _floats(low, high, step)
                ]
            else:
                x = np.exp(random.uniform(math.log(low), math.log(high), size))
                x = np.concatenate([x, 1 + random.uniform(-0.5, 0.5, size)]) if name == "log" else x
                errors = _by_mpmath(_of(name, mpmath), x, np.asarray(function(x)), form)
            worst.setdefault(name, {})[form.name] = max(errors)
    return worst


def _of(name: str, library: Any) -> Callable[[Any], Any]:
    if name == "log":
        return lambda x: library.log(x)
    return (lambda x: library.exp(x)) if name == "exp" else (lambda x: library.exp(-x))


def _by_mpmath(function: Callable[[Any], Any], x: Array, found: Array, form: Format) -> list[float]:
    errors = []
    with mpmath.workprec(2 * form.precision):
        for argument, value in zip(x.tolist(), found.tolist(), strict=True):
            exact = function(mpmath.mpf(argument))
            unit = mpmath.ldexp(1, mpmath.frexp(exact)[1] - form.precision)
            errors.append(float(abs(value - exact) / unit))
    return errors


def show(found: dict[str, dict[str, float]]) -> None:
    """Print the errors."""
    table = Table("function", *FORMATS, title="Largest errors found, in ulp")
    for name, errors in found.items():
        table.add_row(name, *(f"{errors[form]:.2f}" for form in FORMATS))
    console().print(table)


main = command(
    measure,
    show,
    click.option("--step", type=click.IntRange(1), default=1, show_default=True, help="Between float32 numbers."),
    click.option("--size", type=click.IntRange(1), default=20_000, show_default=True, help="Arguments in float64."),
    needs="jax",
)


if __name__ == "__main__":
    main()
