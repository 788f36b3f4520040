"""Programs read with machine numbers: operation by operation as code computes, without FMA contraction."""

from __future__ import annotations

import math
import operator
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache, lru_cache, partial
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
        kind,
        functions,
        word=lambda constant: word(constant.value_in(form)),
        choose=np.where,
        row=_rows_at,
        column=_column,
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


def branch_value(branch: CodeBranch, result: str, given: Mapping[str, Any], form: Format) -> Any:
    """Return a result of a branch, or one of its variables, for inputs and constants: numbers or arrays of a format."""
    return read(branch, [result], given, machine_arithmetic(form))[result]


@lru_cache(maxsize=32)
def rows_of(table: Table, form: Format) -> Any:
    """Return the rows of a table as an array of numbers of a format."""
    return np.array(table.rows, TYPES[form.name])


# --- functions of kernels ---------------------------------------------------------------------------------------------


def _given(kernel: Kernel, function: Function, arguments: Sequence[Any], form: Format) -> dict[str, Any]:
    """Return the arguments and the constants by name."""
    kind = TYPES[form.name]
    constants = {name: kind(value) for name, value in kernel.constants[form.name].items()}
    values = np.broadcast_arrays(*(np.asarray(x, kind) for x in arguments))
    return {**constants, **dict(zip(function.arguments, values, strict=True))}


def _branches(function: Function, given: Mapping[str, Any], by: Reading) -> Iterator[tuple[int, Any]]:
    """Yield the index of each branch, and for which arguments it is taken: those for which no earlier one is."""
    rest = np.full(given[function.arguments[0]].shape, True)
    if function.domain is not None:
        rest = rest & evaluate(function.domain, given, by)
    for index, branch in enumerate(function.branches):
        here = np.zeros(rest.shape, bool)
        run = Run(function.start, _where(rest, function, given), by)
        here[rest] = True if branch.guard is None else evaluate(branch.guard, run, by)
        yield index, here
        rest = rest & ~here


def _where(here: Any, function: Function, given: Mapping[str, Any]) -> dict[str, Any]:
    return {**given, **{argument: given[argument][here] for argument in function.arguments}}


def values_and_branches(kernel: Kernel, name: str, *arguments: Any, form: Format = DOUBLE) -> tuple[Any, Any]:
    """Return a function's results on numbers or arrays, and the index of the branch that gives each.

    Outside the domain, and where no guard holds, they are NaN and -1. In a narrower type than a table's, results are
    computed in the table's type, and rounded.
    """
    if form != DOUBLE and any(table.form == DOUBLE.name for table in kernel.tables):
        found, taken = values_and_branches(kernel, name, *(np.asarray(x, TYPES[form.name]) for x in arguments))
        return found.astype(TYPES[form.name]), taken
    function, by = kernel.function(name).pruned, machine_arithmetic(form)
    given = _given(kernel, function, arguments, form)
    tables = {table.name: rows_of(table, form) for table in kernel.tables}
    shape = given[function.arguments[0]].shape
    found, taken = np.full(shape, math.nan, TYPES[form.name]), np.full(shape, -1)
    with np.errstate(all="ignore"):
        for index, here in _branches(function, given, by):
            if not here.any():
                continue
            branch, inner = function.branches[index], _where(here, function, given)
            if kernel.fallback is not None and index > 0:
                found[here] = _in_double(kernel, kernel.fallback, function, branch, inner)
            else:
                run = Run((*function.start, *branch.program), {**inner, **tables}, by)
                found[here] = evaluate(branch.results[function.result], run, by)
            taken[here] = index
    return found, taken


def _in_double(kernel: Kernel, called: Kernel, function: Function, branch: CodeBranch, given: Mapping[str, Any]) -> Any:
    """Return results of a branch that calls functions of another kernel, in type double."""
    by = machine_arithmetic(DOUBLE)
    calls = {f"viscopade_{f.name}_{called.name}": partial(function_values, called, f.name) for f in called.functions}
    by = replace(by, functions={**by.functions, **calls})
    given = _given(kernel, function, [given[argument] for argument in function.arguments], DOUBLE)
    return read(branch, [function.result], given, by)[function.result]


def taken_branch(kernel: Kernel, name: str, *arguments: float) -> int:
    """Return the index of the branch that gives a function's result; nothing is read from tables."""
    function = kernel.function(name).pruned
    given, by = _given(kernel, function, arguments, DOUBLE), machine_arithmetic(DOUBLE)
    return next(index for index, here in _branches(function, given, by) if here)


def function_values(kernel: Kernel, name: str, *arguments: Any, form: Format = DOUBLE) -> Any:
    """Return a function's results on numbers or arrays, operation by operation as code computes; NaN outside."""
    return values_and_branches(kernel, name, *arguments, form=form)[0]


def is_normal(kernel: Kernel, name: str, *arguments: float, form: Format = DOUBLE) -> bool:
    """Return whether nothing overflows or underflows in what a function computes before its branches."""
    function = kernel.function(name).pruned
    given = {key: value[()] for key, value in _given(kernel, function, arguments, form).items()}
    run = Run(function.start, given, machine_arithmetic(form))
    try:
        with np.errstate(over="raise", under="raise"):
            return all(run[statement.name] is not None for statement in function.start)
    except FloatingPointError:
        return False


def borders(kernel: Kernel, name: str, form: Format = DOUBLE) -> list[float]:
    """Return the largest first arguments, the others being 1, before a condition of the function changes."""
    function, by = kernel.function(name).pruned, machine_arithmetic(form)
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
