"""A force that is typed as a formula of x, the compression, and v, its rate, such as "1e5*x + 1e3*max(v, 0)".

Python's own parser reads it, and only what is listed here is computed: nothing of it runs as Python code.
"""

from __future__ import annotations

import ast
import operator
import warnings
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from viscopade.arrays.checked import FloatArray
from viscopade.collision.contact import Contact
from viscopade.collision.schemes import SCHEMES
from viscopade.simulators.native import Impact, Native, Values
from viscopade.theory.law import End

_Function = Callable[[FloatArray, FloatArray], Any]

_LONGEST, _DEEPEST = 2000, 50
_PLACES = np.logspace(-9, 0, 91)  # over the depth, where a force may pull
_ACCEPTED = (
    "numbers, x, v, + - * / **, min, max, abs, sqrt, exp, where(x < 1e-3, A, B) and step(x, x0, h0, x1, h1), "
    f"up to {_LONGEST} characters and {_DEEPEST} levels"
)


def _step(x: Any, x0: Any, h0: Any, x1: Any, h1: Any) -> Any:
    """Return h0 below x0, h1 above x1, and the cubic polynomial without a kink between them."""
    part = np.clip((x - x0) / (x1 - x0), 0, 1)
    return h0 + (h1 - h0) * part**2 * (3 - 2 * part)


def _least(*values: Any) -> Any:
    least = values[0]
    for value in values[1:]:
        least = np.minimum(least, value)
    return least


def _greatest(*values: Any) -> Any:
    return -_least(*(-np.asarray(value) for value in values))


_BINARY: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: np.divide,
    ast.Pow: np.power,
}
_UNARY: dict[type[ast.unaryop], Callable[[Any], Any]] = {ast.USub: operator.neg, ast.UAdd: operator.pos}
_COMPARISONS: dict[type[ast.cmpop], Callable[[Any, Any], Any]] = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
}
_FUNCTIONS: dict[str, tuple[range, Callable[..., Any]]] = {
    "min": (range(2, 9), _least),
    "max": (range(2, 9), _greatest),
    "abs": (range(1, 2), np.abs),
    "sqrt": (range(1, 2), np.sqrt),
    "exp": (range(1, 2), np.exp),
    "where": (range(3, 4), np.where),
    "step": (range(5, 6), _step),
}
"""By name, how many arguments it takes, and what it computes."""


def force(formula: str) -> _Function:
    """Return the force F(x, v) of NumPy arrays that a formula says.

    Raises
    ------
    ValueError
        If it is no such formula.

    Examples
    --------
    >>> force("1e5*x + 1e3*max(v, 0)")(np.array([1e-3, 1e-3]), np.array([0.5, -0.5]))
    array([600., 100.])
    """
    if len(formula) > _LONGEST:
        raise ValueError(f"force has {len(formula)} characters: expected {_ACCEPTED}")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of numbers that touch a word
            tree = ast.parse(formula.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise _refusal(formula, formula) from None
    function = _function(formula, tree, 0)

    def computed(x: FloatArray, v: FloatArray) -> FloatArray:
        with np.errstate(all="ignore"):  # of values that are not finite, which the contact refuses
            return np.asarray(function(x, v), float) + np.zeros(np.shape(x))

    return computed


def _function(formula: str, node: ast.expr, depth: int, condition: bool = False) -> _Function:
    """Return the function of x and v that a part of a formula says."""

    def inside(part: ast.expr, condition: bool = False) -> _Function:
        return _function(formula, part, depth + 1, condition)

    if depth > _DEEPEST:
        raise _refusal(formula, formula)
    if condition:
        if not isinstance(node, ast.Compare) or len(node.ops) > 1 or type(node.ops[0]) not in _COMPARISONS:
            raise _refusal(formula, node)
        compared, one, other = _COMPARISONS[type(node.ops[0])], inside(node.left), inside(node.comparators[0])
        return lambda x, v: compared(one(x, v), other(x, v))
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float) and not isinstance(node.value, bool):
        try:
            number = np.float64(node.value)
        except OverflowError:
            raise _refusal(formula, node) from None
        return lambda x, v: number
    if isinstance(node, ast.Name) and node.id in ("x", "v"):
        return (lambda x, v: x) if node.id == "x" else (lambda x, v: v)
    if isinstance(node, ast.UnaryOp) and type(node.op) in _UNARY:
        of, inner = _UNARY[type(node.op)], inside(node.operand)
        return lambda x, v: of(inner(x, v))
    if isinstance(node, ast.BinOp) and type(node.op) in _BINARY:
        joined, left, right = _BINARY[type(node.op)], inside(node.left), inside(node.right)
        return lambda x, v: joined(left(x, v), right(x, v))
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in _FUNCTIONS:
        numbers, called = _FUNCTIONS[node.func.id]
        if len(node.args) in numbers and not node.keywords:
            chosen = node.func.id == "where"
            parts = [inside(part, chosen and i == 0) for i, part in enumerate(node.args)]
            return lambda x, v: called(*(part(x, v) for part in parts))
    raise _refusal(formula, node)


def _refusal(formula: str, part: ast.expr | str) -> ValueError:
    wrong = part if isinstance(part, str) else ast.get_source_segment(formula.strip(), part) or formula
    text = " ".join(wrong.split())
    return ValueError(f"force has {text if len(text) < 60 else text[:60] + '…'!r}: expected {_ACCEPTED}")


def native(formula: str, end: End) -> Native:
    """Return the contact that has the force of a formula."""
    typed = force(formula)

    def contact(values: Values, impact: Impact) -> Contact:
        return Contact(typed, impact.effective_mass, impact.effective_mass * impact.gravity, end)

    def warnings(values: Values, impact: Impact) -> Iterator[str]:
        if end == "force":
            depth = contact(values, impact).collide(impact.speed, step=impact.step, phases=[0.5]).depth
            # Attraction of bodies at rest, or on the approach, is no effect of damping: it is adhesion.
            x = depth * _PLACES
            pulls = np.minimum(typed(x, np.zeros_like(x)), typed(x, np.full_like(x, impact.speed))) < 0
            if pulls.any():
                where = f"The force pulls at a compression of {x[pulls][-1]:.2g} m"
                yield f'{where}, which the end "force" cuts off: --end return'

    return Native((), contact, "", schemes=SCHEMES, warnings=warnings)
