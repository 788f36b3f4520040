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
    # Names of functions in programs. A choice computes both sides and takes one, element by element.
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

    def rows_at(table: Any, index: Any) -> Any:
        """Return rows of a table; an index beyond the last one leads to it. Faster than `table[index]`."""
        # NumPy 1.26 refuses unsigned indices.
        return table.take(np.asarray(index).astype(np.intp, copy=False), axis=0, mode="clip")

    return Reading(
        kind,
        functions,
        word=lambda constant: word(constant.value_in(form)),
        choose=np.where,
        row=rows_at,
        column=lambda row, index: row[..., index],  # of every row of an array of rows
    )


def _power(x: Any, p: Any) -> Any:
    """Return x^p of doubles by the C library, from whose results NumPy's own differ in the last bit; NaN for x < 0."""
    powers = [math.pow(base, p) if base >= 0 else math.nan for base in np.ravel(x).tolist()]
    return np.array(powers, np.asarray(x).dtype).reshape(np.shape(x))


def branch_value(branch: CodeBranch, result: str, inputs: Mapping[str, Any], form: Format) -> Any:
    """Return a result of a branch, or one of its variables, from numbers or arrays of a format.

    `inputs` has the branch's inputs and constants by name.
    """
    return read(branch, [result], inputs, machine_arithmetic(form))[result]


@lru_cache(maxsize=32)  # the catalogue's kernels have seven tables, in two formats
def rows_of(table: Table, form: Format) -> Any:
    """Return the rows of a table as an array of numbers of a format."""
    return np.array(table.rows, TYPES[form.name])


# --- functions of kernels ---------------------------------------------------------------------------------------------


def _inputs(kernel: Kernel, function: Function, arguments: Sequence[Any], form: Format) -> dict[str, Any]:
    """Return a function's arguments, broadcast to one shape, and the kernel's constants, by name in a format."""
    kind = TYPES[form.name]
    constants = {name: kind(value) for name, value in kernel.constants[form.name].items()}
    values = np.broadcast_arrays(*(np.asarray(x, kind) for x in arguments))
    return {**constants, **dict(zip(function.arguments, values, strict=True))}


def _branches(function: Function, inputs: Mapping[str, Any], arithmetic: Reading) -> Iterator[tuple[int, Any]]:
    """Yield the index of each branch, and for which arguments it is taken: those for which no earlier one is.

    `inputs` are the function's arguments (arrays of one shape) and the constants, by name. What is taken is an array of
    bools of that shape.
    """
    # `untaken`: the arguments inside the domain that no branch has taken so far.
    untaken = np.full(inputs[function.arguments[0]].shape, True)
    if function.domain is not None:
        untaken = untaken & evaluate(function.domain, inputs, arithmetic)
    for index, branch in enumerate(function.branches):
        taken = np.zeros(untaken.shape, bool)
        run = Run(function.start, _inputs_where(untaken, function, inputs), arithmetic)
        taken[untaken] = True if branch.guard is None else evaluate(branch.guard, run, arithmetic)
        yield index, taken
        untaken = untaken & ~taken


def _inputs_where(chosen: Any, function: Function, inputs: Mapping[str, Any]) -> dict[str, Any]:
    """Return the inputs with only the arguments for which `chosen`, an array of bools, is true."""
    return {**inputs, **{argument: inputs[argument][chosen] for argument in function.arguments}}


def values_and_branches(kernel: Kernel, name: str, *arguments: Any, form: Format = DOUBLE) -> tuple[Any, Any]:
    """Return a function's results on numbers or arrays, and the index of the branch that gives each.

    Outside the domain, and where no guard holds, they are NaN and -1. In a narrower type than a table's, results are
    computed in the table's type, and rounded.

    Parameters
    ----------
    kernel : Kernel
    name : str
        That of the function, such as "epsilon".
    *arguments : number or array
        Those of the function, in its order.
    form : Format
        The type to compute in.
    """
    if form != DOUBLE and any(table.form == DOUBLE.name for table in kernel.tables):
        rounded = (np.asarray(x, TYPES[form.name]) for x in arguments)
        values, taken_branches = values_and_branches(kernel, name, *rounded)
        return values.astype(TYPES[form.name]), taken_branches

    function, arithmetic = kernel.function(name).pruned, machine_arithmetic(form)
    inputs = _inputs(kernel, function, arguments, form)
    tables = {table.name: rows_of(table, form) for table in kernel.tables}
    shape = inputs[function.arguments[0]].shape
    values, taken_branches = np.full(shape, math.nan, TYPES[form.name]), np.full(shape, -1)
    # Code raises no floating-point error either: what overflows on purpose is no fault.
    with np.errstate(all="ignore"):
        for index, taken in _branches(function, inputs, arithmetic):
            if not taken.any():
                continue
            branch, branch_inputs = function.branches[index], _inputs_where(taken, function, inputs)
            if kernel.fallback is not None and index > 0:
                # Outside a speed table the code calls the functions of a kernel of v*.
                values[taken] = _fallback_values(kernel, kernel.fallback, function, branch, branch_inputs)
            else:
                run = Run((*function.start, *branch.program), {**branch_inputs, **tables}, arithmetic)
                values[taken] = evaluate(branch.results[function.result], run, arithmetic)
            taken_branches[taken] = index
    return values, taken_branches


def _fallback_values(
    kernel: Kernel, fallback: Kernel, function: Function, branch: CodeBranch, inputs: Mapping[str, Any]
) -> Any:
    """Return results of a branch that calls functions of the kernel `fallback`, in type double.

    `inputs` has the arguments of `kernel`'s function by name, of which the constants are taken anew in double.
    """
    # In programs the called functions have the names of the code, "viscopade_epsilon_full".
    arithmetic = machine_arithmetic(DOUBLE)
    calls = {
        f"viscopade_{f.name}_{fallback.name}": partial(function_values, fallback, f.name) for f in fallback.functions
    }
    arithmetic = replace(arithmetic, functions={**arithmetic.functions, **calls})
    inputs = _inputs(kernel, function, [inputs[argument] for argument in function.arguments], DOUBLE)
    return read(branch, [function.result], inputs, arithmetic)[function.result]


def taken_branch(kernel: Kernel, name: str, *arguments: float) -> int:
    """Return the index of the branch that gives a function's result; nothing is read from tables."""
    function = kernel.function(name).pruned
    inputs, arithmetic = _inputs(kernel, function, arguments, DOUBLE), machine_arithmetic(DOUBLE)
    return next(index for index, taken in _branches(function, inputs, arithmetic) if taken)


def function_values(kernel: Kernel, name: str, *arguments: Any, form: Format = DOUBLE) -> Any:
    """Return a function's results on numbers or arrays, operation by operation as code computes; NaN outside."""
    return values_and_branches(kernel, name, *arguments, form=form)[0]


def is_normal(kernel: Kernel, name: str, *arguments: float, form: Format = DOUBLE) -> bool:
    """Return whether nothing overflows or underflows in what a function of this name computes before its branches."""
    function = kernel.function(name).pruned
    # [()] makes NumPy scalars of arrays without a dimension.
    inputs = {key: value[()] for key, value in _inputs(kernel, function, arguments, form).items()}
    run = Run(function.start, inputs, machine_arithmetic(form))
    try:
        with np.errstate(over="raise", under="raise"):
            # Reading a name computes it.
            return all(run[statement.name] is not None for statement in function.start)
    except FloatingPointError:
        return False


def borders(kernel: Kernel, name: str, form: Format = DOUBLE) -> list[float]:
    """Return the largest first arguments, the others being 1, before a condition of the function changes.

    `name` is the function's. With a speed first, the second argument is beta: of beta = 1, w = beta^5 speed is the
    speed.
    """
    function, arithmetic = kernel.function(name).pruned, machine_arithmetic(form)
    # (program, condition): those of the domain, of the branch, and of the choices that the program assigns.
    programs = [(*function.start, *branch.program) for branch in function.branches]
    conditions = [
        (program, condition)
        for program, branch in zip(programs, function.branches, strict=True)
        for condition in (
            function.domain,
            branch.guard,
            *(s.expression.condition for s in program if isinstance(s.expression, Select)),
        )
        if condition is not None
    ]

    def states(x: Any) -> Any:
        """Return which conditions hold for first arguments x: a row for each condition."""
        inputs = _inputs(kernel, function, (x, *(1.0 for _ in function.arguments[1:])), form)
        return np.array(
            [
                np.broadcast_to(evaluate(condition, Run(program, inputs, arithmetic), arithmetic), np.shape(x))
                for program, condition in conditions
            ]
        )

    largest_before_change = []
    # All powers of 2 of the type; between two of them a condition changes at most once, or back, which stays unseen.
    x = np.ldexp(TYPES[form.name](1), np.arange(1 - form.largest, form.largest + 1))
    with np.errstate(all="ignore"):
        states_at_x = states(x)
        for i in np.flatnonzero((states_at_x[:, 1:] != states_at_x[:, :-1]).any(axis=0)):
            # Bisection, until no number of the type lies between: `low` has the states of x[i], `high` others.
            low, high = x[i], x[i + 1]
            while (middle := low + (high - low) / 2) not in (low, high):
                same = (states(middle) == states_at_x[:, i]).all()
                low, high = (middle, high) if same else (low, middle)
            largest_before_change.append(float(low))
    return largest_before_change
