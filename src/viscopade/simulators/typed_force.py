"""A force that is typed as a formula of x, the compression, and v, its rate, such as "1e5*x + c*max(v, 0)".

    viscopade audit --force "1e5*x + c*max(v, 0)" --constant "c = 1 kN s/m" --mass 1 --speed 1

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

# Characters, by hand, and levels of brackets of a formula: 50 levels are 100 nested calls, of 1000 that Python allows.
_LONGEST, _DEEPEST = 2000, 50
# Compressions over the depth at which a force is asked whether it pulls: ten a decade, from 1e-9 on (by hand).
_PLACES = np.logspace(-9, 0, 91)
_ACCEPTED = (
    "numbers, x, v, names of --constant, + - * / **, min, max, abs, sqrt, exp, where(x < 1e-3, A, B) and "
    f"step(x, x0, h0, x1, h1), up to {_LONGEST} characters and {_DEEPEST} levels"
)


def _step(x: Any, x0: Any, h0: Any, x1: Any, h1: Any) -> Any:
    """Return h0 below x0, h1 above x1, and the cubic polynomial without a kink between them."""
    # t^2 (3 - 2 t) goes from 0 to 1 with slope 0 at both ends.
    t = np.clip((x - x0) / (x1 - x0), 0, 1)
    return h0 + (h1 - h0) * t**2 * (3 - 2 * t)


def _smallest(*values: Any) -> Any:
    """Return the smallest of two or more numbers or arrays, place by place."""
    smallest = values[0]
    for value in values[1:]:
        smallest = np.minimum(smallest, value)
    return smallest


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
    "min": (range(2, 9), _smallest),
    "max": (range(2, 9), lambda *values: -_smallest(*(-np.asarray(value) for value in values))),
    "abs": (range(1, 2), np.abs),
    "sqrt": (range(1, 2), np.sqrt),
    "exp": (range(1, 2), np.exp),
    "where": (range(3, 4), np.where),
    "step": (range(5, 6), _step),
}
"""By name, how many arguments it takes (2 to 8 of min and max, by hand), and what it computes."""
_NAME = re.compile("[A-Za-z_][A-Za-z_0-9]{0,39}")  # up to 40 characters, by hand
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
    """Return the syntax tree of a formula; ValueError if it is too long, or no expression of Python."""
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
    """Return the function of x and v that a node of the syntax tree of a formula says.

    Parameters
    ----------
    formula : str
        The whole formula, for messages.
    node : ast.expr
    constants : mapping of str to float
        Values of the names other than x and v.
    depth : int
        Levels of the tree above the node.
    condition : bool
        Whether the node is the first argument of `where`: a comparison, and nothing else.

    Raises
    ------
    ValueError
        If the node is nothing that a force may have.
    """

    def inside(operand: ast.expr, condition: bool = False) -> _Function:
        """Return the function of an operand of the node."""
        return _function(formula, operand, constants, depth + 1, condition)

    if depth > _DEEPEST:
        raise _refusal(formula, formula)
    if condition:
        if not isinstance(node, ast.Compare) or len(node.ops) > 1 or type(node.ops[0]) not in _COMPARISONS:
            raise _refusal(formula, node)
        compare, left, right = _COMPARISONS[type(node.ops[0])], inside(node.left), inside(node.comparators[0])
        return lambda x, v: compare(left(x, v), right(x, v))
    # numbers, x and v, constants by name
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
    # signs, operations of two operands, functions
    if isinstance(node, ast.UnaryOp) and type(node.op) in _UNARY:
        sign, operand = _UNARY[type(node.op)], inside(node.operand)
        return lambda x, v: sign(operand(x, v))
    if isinstance(node, ast.BinOp) and type(node.op) in _BINARY:
        operation, left, right = _BINARY[type(node.op)], inside(node.left), inside(node.right)
        return lambda x, v: operation(left(x, v), right(x, v))
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in _FUNCTIONS:
        counts, called = _FUNCTIONS[node.func.id]
        if len(node.args) in counts and not node.keywords:
            is_where = node.func.id == "where"  # its first argument is a condition
            operands = [inside(argument, is_where and i == 0) for i, argument in enumerate(node.args)]
            return lambda x, v: called(*(operand(x, v) for operand in operands))
    raise _refusal(formula, node)


def _refusal(formula: str, node: ast.expr | str) -> ValueError:
    """Return the error that names the text of a node, or a text, and what is accepted instead."""
    wrong = node if isinstance(node, str) else ast.get_source_segment(formula.strip(), node) or formula
    text = " ".join(wrong.split())
    # 60 characters, half of a line, show where the fault is.
    return ValueError(f"force has {text if len(text) < 60 else text[:60] + '…'!r}: expected {_ACCEPTED}")


def parse_constants(formula: str, settings: Sequence[str]) -> dict[str, float]:
    """Return the constants of a formula in SI units, by name, from settings such as "c=1e4" and "c = 10 kN s/m".

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
        # A plain number is in SI units; one with a unit is converted. `decimal_in` returns a quantity in SI units, None
        # if the text has no unit. 1e300 stays below the largest double.
        size = quantity.decimal_in(text, None)
        number = text if size is None else str(size)
        constants[name] = float(
            arguments.exact_number(f"constant {name}", number, _NUMBER, lambda number: abs(number) < 10**300)
        )
    return constants


def native(formula: str, end: End, settings: Sequence[str] = (), damping: str | None = None) -> Native:
    """Return the contact that has the force of a formula, in N, of x in m and v in m/s.

    Parameters
    ----------
    formula : str
    end : "force" or "return"
        Whether contact ends where the force vanishes, or at x = 0.
    settings : sequence of str
        The formula's constants, such as "c=1e4".
    damping : str, optional
        Name of the constant that is varied for a wanted eps.

    Raises
    ------
    ValueError
        If the formula or a constant is not accepted.
    """
    constants = parse_constants(formula, settings)
    force(formula, constants)  # refuses what is no formula
    if damping is not None and damping not in constants:
        raise ValueError(
            f"vary is {damping!r}: expected the name of a --constant{': ' if constants else ''}{', '.join(constants)}"
        )

    def typed(values: Values) -> _Function:
        """Return F(x, v) with the values of the constants."""
        return force(formula, {name: values[name] for name in constants})

    def contact(values: Values, impact: Impact) -> Contact:
        """Return the contact with the mass and the weight of an impact."""
        return Contact(typed(values), impact.effective_mass, impact.effective_mass * impact.gravity, end)

    def damped(values: Values, factor: float, impact: Impact) -> dict[str, float]:
        """Return the constant that is varied, by name: a multiple of itself, which keeps its sign; of 1 if it is 0."""
        return {str(damping): factor * (constants[str(damping)] or 1.0)}

    def warnings(values: Values, impact: Impact) -> Iterator[str]:
        """Yield a warning if the force pulls where the end "force" cuts it off."""
        if end == "force":
            # The depth of a collision whose contact begins in the middle of a step (phase 0.5), which stands for all.
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
    # No program's file is the source, and all integrators that this package knows (SCHEMES) may be asked for.
    return Native(
        parameters, contact, "", schemes=SCHEMES, damped_values=None if damping is None else damped, warnings=warnings
    )
