"""Programs read with machine numbers: operation by operation as code computes, without FMA contraction."""

from __future__ import annotations

import math
import operator
from collections.abc import Iterator, Mapping, Sequence
from functools import cache, lru_cache
from typing import Any

import numpy as np

from viscopade.arithmetic.formats import DOUBLE, FLOAT, Format
from viscopade.kernels.expressions import (
    CodeBranch,
    Expression,
    Program,
    Reading,
    Run,
    Select,
    evaluate,
    read,
)
from viscopade.kernels.kernel import Function, Kernel, Table

TYPES: Mapping[str, Any] = {DOUBLE.name: np.float64, FLOAT.name: np.float32}
"""NumPy's type of numbers by the name of a format."""
_WORDS: Mapping[str, Any] = {DOUBLE.name: np.uint64, FLOAT.name: np.uint32}


@cache
def machine_arithmetic(form: Format) -> Reading:
    """Return how arrays of numbers of a format are computed with, and words as long as these."""
    kind, word = TYPES[form.name], _WORDS[form.name]
    functions: dict[str, Any] = {
        "cbrt": np.cbrt,
        "sqrt": np.sqrt,
        "pow": _power,
        "log2": np.log2,
        "exp2": np.exp2,
        "divide": operator.truediv,
        "index": np.asarray,
        "bits": lambda x: np.asarray(x, kind).view(word),
        "from_bits": lambda bits: np.asarray(bits, word).view(kind),
        "uint32": np.uint32,
        "uint64": np.uint64,
    }
    return Reading(
        kind, functions, word=lambda constant: word(constant.of(form)), choose=np.where, row=_rows_at, column=_column
    )


def _power(x: Any, p: Any) -> Any:
    """Return x^p of doubles by the C library, from whose results NumPy's own differ in the last bit; NaN for x < 0."""
    found = [math.pow(one, p) if one >= 0 else math.nan for one in np.ravel(x).tolist()]
    return np.array(found, np.asarray(x).dtype).reshape(np.shape(x))


def _rows_at(table: Any, index: Any) -> Any:
    """Return rows of a table; an index beyond the last one leads to it. Faster than `table[index]`."""
    # NumPy 1.26 refuses unsigned indices.
    return table.take(np.asarray(index).astype(np.intp, copy=False), axis=0, mode="clip")


def _column(row: Any, index: int) -> Any:
    return row[..., index]


def computed(branch: CodeBranch, result: str, given: Mapping[str, Any], form: Format) -> Any:
    """Return a result of a branch, or one of its variables, for inputs and constants: numbers or arrays of a format."""
    return read(branch, [result], given, machine_arithmetic(form))[result]


@lru_cache(maxsize=32)
def rows_of(table: Table, form: Format) -> Any:
    """Return the rows of a table as an array of numbers of a format."""
    return np.array(table.rows, TYPES[form.name])


# --- functions of kernels ---------------------------------------------------------------------------------------------


def _given(kernel: Kernel, function: Function, arguments: Sequence[Any], form: Format) -> dict[str, Any]:
    """Return the arguments, the constants and the tables by name."""
    kind = TYPES[form.name]
    constants = {name: kind(value) for name, value in kernel.constants[form.name].items()}
    tables = {table.name: rows_of(table, form) for table in kernel.tables}
    values = np.broadcast_arrays(*(np.asarray(x, kind) for x in arguments))
    return {**constants, **tables, **dict(zip(function.arguments, values, strict=True))}


def located(kernel: Kernel, name: str, *arguments: Any, form: Format = DOUBLE) -> tuple[Any, Any]:
    """Return a function's results on numbers or arrays, and the index of the branch that gives each.

    Outside the domain, and where no guard holds, they are NaN and -1; where the kernel's `elsewhere` serves, the index
    is the number of branches. In a narrower type than a table's, results are computed in the table's type, and rounded.
    """
    if form != DOUBLE and any(table.form == DOUBLE.name for table in kernel.tables):
        found, taken = located(kernel, name, *(np.asarray(x, TYPES[form.name]) for x in arguments))
        return found.astype(TYPES[form.name]), taken
    function, by = kernel.function(name).pruned(), machine_arithmetic(form)
    given = _given(kernel, function, arguments, form)
    shape = given[function.arguments[0]].shape
    found, taken = np.full(shape, math.nan, TYPES[form.name]), np.full(shape, -1)
    with np.errstate(all="ignore"):
        rest = np.full(shape, True)
        if function.domain is not None:
            rest = rest & evaluate(function.domain, given, by)
        for index, branch in enumerate(function.branches):
            inner = given | {argument: given[argument][rest] for argument in function.arguments}
            run = Run(function.start, inner, by)
            here = np.zeros(shape, bool)
            here[rest] = True if branch.guard is None else evaluate(branch.guard, run, by)
            inner = given | {argument: given[argument][here] for argument in function.arguments}
            run = Run((*function.start, *branch.program), inner, by)
            found[here], taken[here] = evaluate(branch.results[function.result], run, by), index
            rest = rest & ~here
        if kernel.elsewhere is not None and rest.any():
            given = {argument: given[argument][rest] for argument in function.arguments}
            found[rest], taken[rest] = _elsewhere(kernel.elsewhere, name, **given), len(function.branches)
    return found, taken


def _elsewhere(kernel: Kernel, name: str, speed: Any, beta: Any) -> Any:
    """Return results of a speed and beta by a kernel of v*, in type double."""
    speed, beta = speed.astype(np.float64), beta.astype(np.float64)
    v_star = np.where(speed >= 0, np.sqrt(beta) * _power(speed, 0.1), math.nan)
    eps = evaluated(kernel, "epsilon", v_star)
    if name == "dissipation":
        return np.where(eps < 0.5, 1 - eps * eps, evaluated(kernel, "one_minus_epsilon", v_star) * (1 + eps))
    if name == "rebound":
        return np.where((eps == 0) & (speed == np.inf), speed, eps * speed)
    return eps


def evaluated(kernel: Kernel, name: str, *arguments: Any, form: Format = DOUBLE) -> Any:
    """Return a function's results on numbers or arrays, operation by operation as code computes; NaN outside."""
    return located(kernel, name, *arguments, form=form)[0]


def is_normal(kernel: Kernel, name: str, *arguments: float, form: Format = DOUBLE) -> bool:
    """Return whether nothing overflows or underflows in what a function computes before its branches."""
    function = kernel.function(name).pruned()
    given = {key: value[()] for key, value in _given(kernel, function, arguments, form).items()}
    run = Run(function.start, given, machine_arithmetic(form))
    try:
        with np.errstate(over="raise", under="raise"):
            return all(run[statement.name] is not None for statement in function.start)
    except FloatingPointError:
        return False


def borders(kernel: Kernel, name: str, form: Format = DOUBLE) -> list[float]:
    """Return the largest first arguments, the others being 1, before a condition of the function changes."""
    function, by = kernel.function(name).pruned(), machine_arithmetic(form)
    programs = [(*function.start, *branch.program) for branch in function.branches]
    conditions = [
        (program, condition)
        for program, branch in zip(programs, function.branches, strict=True)
        for condition in (function.domain, branch.guard, *_choices(program))
        if condition is not None
    ]

    def states(x: Any) -> Any:
        given = _given(kernel, function, (x, *(1.0 for _ in function.arguments[1:])), form)
        return np.array(
            [np.broadcast_to(evaluate(c, Run(program, given, by), by), np.shape(x)) for program, c in conditions]
        )

    found = []
    x = np.ldexp(TYPES[form.name](1), np.arange(1 - form.largest, form.largest + 1))
    with np.errstate(all="ignore"):
        known = states(x)
        for i in np.flatnonzero((known[:, 1:] != known[:, :-1]).any(axis=0)):
            low, high = x[i], x[i + 1]
            while (middle := low + (high - low) / 2) not in (low, high):
                low, high = (middle, high) if (states(middle) == known[:, i]).all() else (low, middle)
            found.append(float(low))
    return found


def _choices(program: Program) -> Iterator[Expression]:
    """Yield the conditions of the choices that a program assigns."""
    yield from (s.expression.condition for s in program if isinstance(s.expression, Select))
