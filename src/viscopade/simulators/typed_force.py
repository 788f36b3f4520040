"""A force that is typed as a formula of x, the compression, and v, its rate, such as "1e5*x + 1e3*max(v, 0)".

Python's own parser reads it, and its compiler compiles it, if it has no nodes and names but those listed here. Numbers
become doubles before that, so that no integer grows beyond all memory.
"""

from __future__ import annotations

import ast
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


_OPERATIONS = (ast.BinOp, ast.Add, ast.Sub, ast.Mult, ast.Div, ast.Pow, ast.UnaryOp, ast.USub, ast.UAdd)
_COMPARISONS = (ast.Lt, ast.LtE, ast.Gt, ast.GtE)
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
    checked = _Checked(formula)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of numbers that touch a word
            tree = checked.visit(ast.parse(formula.strip(), mode="eval").body)
        code = compile(ast.fix_missing_locations(ast.Expression(tree)), "force", "eval")
    except (SyntaxError, RecursionError, MemoryError, OverflowError):
        raise _refusal(formula, formula) from None
    known: dict[str, Any] = (
        {name: function for name, (_, function) in _FUNCTIONS.items()} | checked.numbers | {"__builtins__": {}}
    )

    def computed(x: FloatArray, v: FloatArray) -> FloatArray:
        with np.errstate(all="ignore"):  # of values that are not finite, which the contact refuses
            value = eval(code, known, {"x": np.asarray(x), "v": np.asarray(v)})
        return np.asarray(value, float) + np.zeros(np.shape(x))

    return computed


class _Checked(ast.NodeTransformer):
    """Refuses all nodes of a formula except for the listed ones, and puts names of doubles in place of numbers."""

    def __init__(self, formula: str) -> None:
        self.formula = formula
        self.numbers: dict[str, np.float64] = {}
        self.depth = 0

    def visit(self, node: ast.AST) -> Any:
        """Check a node that is not too deep in the formula."""
        self.depth += 1
        if self.depth > _DEEPEST:
            raise _refusal(self.formula, self.formula)
        checked = super().visit(node)
        self.depth -= 1
        return checked

    def generic_visit(self, node: ast.AST) -> ast.AST:
        """Check an operation and its parts; there is no other node without a method of its own."""
        if not isinstance(node, _OPERATIONS):
            raise _refusal(self.formula, node)
        return super().generic_visit(node)

    def visit_Constant(self, node: ast.Constant) -> ast.Name:
        """Replace a number by a name."""
        if type(node.value) not in (int, float):
            raise _refusal(self.formula, node)
        name = f"number{len(self.numbers)}"
        self.numbers[name] = np.float64(node.value)  # type: ignore[arg-type]
        return ast.Name(name, ast.Load())

    def visit_Name(self, node: ast.Name) -> ast.Name:
        """Check a variable."""
        if node.id not in ("x", "v"):
            raise _refusal(self.formula, node)
        return node

    def visit_Call(self, node: ast.Call) -> ast.Call:
        """Check a function, the number of its arguments, and each of them; the first one of `where` is a comparison."""
        name = node.func.id if isinstance(node.func, ast.Name) else ""
        if name not in _FUNCTIONS or len(node.args) not in _FUNCTIONS[name][0] or node.keywords:
            raise _refusal(self.formula, node)
        if name == "where":
            condition = node.args[0]
            if not isinstance(condition, ast.Compare) or [*map(type, condition.ops)] not in [
                [op] for op in _COMPARISONS
            ]:
                raise _refusal(self.formula, condition)
            condition.left, condition.comparators = self.visit(condition.left), [self.visit(condition.comparators[0])]
        first = 1 if name == "where" else 0
        node.args[first:] = [self.visit(part) for part in node.args[first:]]
        return node


def _refusal(formula: str, part: ast.AST | str) -> ValueError:
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
