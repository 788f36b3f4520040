"""Programs read with machine numbers: operation by operation as code computes, without FMA contraction."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cache, lru_cache
from typing import Any

import numpy as np

from viscopade.arithmetic.formats import DOUBLE, FLOAT, FORMATS, Format
from viscopade.kernels.expressions import CodeBranch, Reading, Run, read

TYPES: Mapping[str, Any] = {DOUBLE.name: np.float64, FLOAT.name: np.float32}
"""NumPy's type of numbers by the name of a format."""
_WORDS: Mapping[str, Any] = {DOUBLE.name: np.uint64, FLOAT.name: np.uint32}


@cache
def machine_arithmetic(form: Format) -> Reading:
    """Return how arrays of numbers of a format are computed with, and words as long as these."""
    functions: dict[str, Any] = {
        "cbrt": np.cbrt,
        "sqrt": np.sqrt,
        "pow": _power,
        "index": np.asarray,
    }
    for name, word in _WORDS.items():
        size = 8 * FORMATS[name].bytes
        functions |= {
            f"uint{size}": word,
            f"bits{size}": lambda x, kind=TYPES[name], word=word: np.asarray(x, kind).view(word),
            f"from_bits{size}": lambda x, kind=TYPES[name], word=word: np.asarray(x, word).view(kind),
        }
    return Reading(TYPES[form.name], functions, word=_WORDS[form.name], choose=np.where, row=_rows_at)


def _power(x: Any, p: Any) -> Any:
    """Return x^p of doubles by the C library, from whose results NumPy's own differ in the last bit; NaN for x < 0."""
    found = [math.pow(one, p) if one >= 0 else math.nan for one in np.ravel(x).tolist()]
    return np.array(found, np.asarray(x).dtype).reshape(np.shape(x))


def _rows_at(table: Any, index: Any) -> Any:
    """Return rows of a table; an index beyond the last one leads to it. Faster than `table[index]`."""
    return table.take(index, axis=0, mode="clip")


def computed(branch: CodeBranch, result: str, given: Mapping[str, Any], form: Format) -> Any:
    """Return a result of a branch, or one of its variables, for inputs and constants: numbers or arrays of a format."""
    return read(branch, [result], given, machine_arithmetic(form))[result]


def run_on_row(branch: CodeBranch, names: Sequence[str], given: Mapping[str, Any], by: Reading) -> Run:
    """Return the values of a branch that assigns a row of a table to "row", given the names of the row's numbers."""
    run = Run(branch.program, given, by)
    run.update({name: run["row"][..., n] for n, name in enumerate(names)})
    return run


@lru_cache(maxsize=32)
def rows_of(table: Any, form: Format) -> Any:
    """Return the rows of a table, which has the attribute `rows`, as an array of numbers of a format."""
    return np.array(table.rows, TYPES[form.name])
