"""A force that is typed as a formula of x, the compression, and v, its rate, such as "1e5*x + c*max(v, 0)".

Python's own parser reads it, and only what is listed here is computed: nothing of it runs as Python code. Other names
are constants, such as "c = 1 kN s/m".
"""

from __future__ import annotations

import ast
import keyword
import operator
import re
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np

from viscopade import arguments, quantity
from viscopade.arrays.checked import FloatArray
from viscopade.collision.contact import Contact
from viscopade.collision.schemes import SCHEMES
from viscopade.simulators.native import Impact, Native, Parameter, Values
from viscopade.theory.law import End

_Function = Callable[[FloatArray, FloatArray], Any]

_LONGEST, _DEEPEST = 2000, 50
_PLACES = np.logspace(-9, 0, 91)  # over the depth, where a force may pull
_ACCEPTED = (
    "numbers, x, v, names of --constant, + - * / **, min, max, abs, sqrt, exp, where(x < 1e-3, A, B) and "
    f"step(x, x0, h0, x1, h1), up to {_LONGEST} characters and {_DEEPEST} levels"
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
_NAME = re.compile("[A-Za-z_][A-Za-z_0-9]{0,39}")
_RESERVED = ("x", "v", "scheme", *_FUNCTIONS)  # "scheme" is the integrator of `Native`
_NUMBER = "a number, or a quantity with a unit such as 10 kN s/m"
_NO_CONSTANTS: Mapping[str, float] = MappingProxyType({})


def force(formula: str, constants: Mapping[str, float] = _NO_CONSTANTS) -> _Function:
    """Return the force F(x, v) of NumPy arrays that a formula says, with the values of its constants by name.

    Raises
    ------
    ValueError
        If it is no such formula.

    Examples
    --------
    >>> force("1e5*x + 1e3*max(v, 0)")(np.array([1e-3, 1e-3]), np.array([0.5, -0.5]))
    array([600., 100.])
    """
    function = _function(formula, _tree(formula), constants, 0)

    def computed(x: FloatArray, v: FloatArray) -> FloatArray:
        with np.errstate(all="ignore"):  # of values that are not finite, which the contact refuses
            return np.asarray(function(x, v), float) + np.zeros(np.shape(x))

    return computed


def _tree(formula: str) -> ast.expr:
    """Return the syntax tree of a formula."""
    if len(formula) > _LONGEST:
        raise ValueError(f"force has {len(formula)} characters: expected {_ACCEPTED}")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of numbers that touch a word
            return ast.parse(formula.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise _refusal(formula, formula) from None


def _function(
    formula: str, node: ast.expr, constants: Mapping[str, float], depth: int, condition: bool = False
) -> _Function:
    """Return the function of x and v that a part of a formula says."""

    def inside(part: ast.expr, condition: bool = False) -> _Function:
        return _function(formula, part, constants, depth + 1, condition)

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
    if isinstance(node, ast.Name) and node.id in constants:
        constant = np.float64(constants[node.id])
        return lambda x, v: constant
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


def constants_of(formula: str, settings: Sequence[str]) -> dict[str, float]:
    """Return the constants of a formula in SI units, from texts such as "c=1e4" and "c = 10 kN s/m".

    Raises
    ------
    ValueError
        If a text is no constant, or the formula has none of this name.
    """
    used = {node.id for node in ast.walk(_tree(formula)) if isinstance(node, ast.Name)}
    constants: dict[str, float] = {}
    for setting in settings:
        name, _, text = map(str.strip, setting.partition("="))
        if not _NAME.fullmatch(name) or name in _RESERVED or keyword.iskeyword(name):
            raise ValueError(
                f"constant is {setting!r}: expected NAME=VALUE, such as c=1e4, with a NAME of letters, digits and _, "
                f"other than {', '.join(_RESERVED)}"
            )
        if name in constants:
            raise ValueError(f"constant {name} is given twice: expected once")
        if name not in used:
            raise ValueError(f"constant {name} is not in the force {formula.strip()!r}: expected a formula with it")
        # A plain number is in SI units; one with a unit is converted.
        size = quantity.decimal_in(text, None)
        number = text if size is None else str(size)
        constants[name] = float(
            arguments.exact_number(f"constant {name}", number, _NUMBER, lambda number: abs(number) < 10**300)
        )
    return constants


def native(formula: str, end: End, settings: Sequence[str] = (), damping: str | None = None) -> Native:
    """Return the contact that has the force of a formula.

    Parameters
    ----------
    formula : str
    end : "force" or "return"
    settings : sequence of str
        The formula's constants, such as "c=1e4".
    damping : str, optional
        Name of the constant that is varied for a wanted eps.

    Raises
    ------
    ValueError
        If the formula or a constant is not accepted.
    """
    constants = constants_of(formula, settings)
    force(formula, constants)
    if damping is not None and damping not in constants:
        raise ValueError(
            f"vary is {damping!r}: expected the name of a --constant{': '[: bool(constants) * 2]}{', '.join(constants)}"
        )

    def typed(values: Values) -> _Function:
        return force(formula, {name: values[name] for name in constants})

    def contact(values: Values, impact: Impact) -> Contact:
        return Contact(typed(values), impact.effective_mass, impact.effective_mass * impact.gravity, end)

    def damped(values: Values, factor: float, impact: Impact) -> dict[str, float]:
        """Return a multiple of the constant, which keeps its sign; of 1 if it is 0."""
        return {str(damping): factor * (constants[str(damping)] or 1.0)}

    def warnings(values: Values, impact: Impact) -> Iterator[str]:
        if end == "force":
            depth = contact(values, impact).collide(impact.speed, step=impact.step, phases=[0.5]).depth
            # Attraction of bodies at rest, or on the approach, is no effect of damping: it is adhesion.
            x, force_at = depth * _PLACES, typed(values)
            pulls = np.minimum(force_at(x, np.zeros_like(x)), force_at(x, np.full_like(x, impact.speed))) < 0
            if pulls.any():
                where = f"The force pulls at a compression of {x[pulls][-1]:.2g} m"
                yield f'{where}, which the end "force" cuts off: --end return'

    parameters = tuple(
        Parameter(name, default=repr(number), accepted="a number", allowed=lambda numbers: True)
        for name, number in constants.items()
    )
    return Native(
        parameters, contact, "", schemes=SCHEMES, damped_values=None if damping is None else damped, warnings=warnings
    )
