"""Formulas as expressions: one description, which proof, rounding bound, NumPy, cost and every language read.

A program is a sequence of assignments; a branch is a program for a part of the arguments, with expressions for its
results. `Run` and `evaluate` read a program with numbers of any kind: balls of power series for the proof
(`certificate`), numbers that bound their rounding errors (`rounding`), machine numbers (`machine`), fractions;
`write.writer` writes it in a language, and `operations` counts. Nothing here needs FLINT.

For instance `formulas.epsilon_branches` has two branches for the paper's [1/4], eps = (a0 + a1 v*)/(b0 + b1 v* + …).
The one for v* >= 0 assigns numerator = a0 + v_star a1 and denominator = b0 + v_star (b1 + …), and its result is
epsilon = numerator/denominator; the one before it, for v* > threshold, does the same in u = 1/v_star.

Besides numbers there are words, which are the bits of numbers, and conditions. Code adds, shifts and masks words modulo
2^32 or 2^64, and so does `machine`.
"""

from __future__ import annotations

import operator as op
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import count as whole_numbers
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from viscopade.arithmetic.formats import Format

# --- expressions ------------------------------------------------------------------------------------------------------

Evaluator = Callable[[Mapping[str, Any]], Any]
"""An expression made a function: from the values of names to the expression's value."""


def _operator(symbol: str) -> Callable[[Expression, Expression], Operation]:
    """Return a function that makes an operation with this symbol of two expressions."""
    return lambda left, right: Operation(symbol, left, right)


class Expression:
    """An expression, the right-hand side of an assignment; equal to no other one, so that it is a key at no cost."""

    __add__, __sub__, __mul__, __truediv__ = map(_operator, "+-*/")  # of numbers, or of words
    __floordiv__, __lshift__, __rshift__ = map(_operator, ("//", "<<", ">>"))  # of words
    __and__, __or__, __xor__ = map(_operator, "&|^")
    __lt__, __le__, __gt__, __ge__ = map(_operator, ("<", "<=", ">", ">="))  # conditions

    def __neg__(self) -> Negation:
        return Negation("-", self)

    def __invert__(self) -> Negation:
        return Negation("~", self)


@dataclass(frozen=True, eq=False)
class Name(Expression):
    """A name in a program: an input, a constant, or an assigned variable."""

    name: str


@dataclass(frozen=True, eq=False)
class Literal(Expression):
    """A decimal number, rounded to the type."""

    text: str


@dataclass(frozen=True, eq=False)
class Word(Expression):
    """A constant word, or one for each format; a `pattern` has hexadecimal digits in code, a count decimal ones."""

    value: int | Callable[[Format], int]
    pattern: bool = True

    def value_in(self, form: Format) -> int:
        """Return the word for numbers of a format."""
        return self.value if isinstance(self.value, int) else self.value(form)


@dataclass(frozen=True, eq=False)
class Operation(Expression):
    """One operation; those of numbers round once."""

    symbol: str
    left: Expression
    right: Expression


@dataclass(frozen=True, eq=False)
class Negation(Expression):
    """A number with the other sign, or a word with all bits changed; exact."""

    symbol: str
    operand: Expression


@dataclass(frozen=True, eq=False)
class Select(Expression):
    """One of two expressions, by a condition."""

    condition: Expression
    met: Expression
    otherwise: Expression


@dataclass(frozen=True, eq=False)
class TableRow(Expression):
    """A row of a table."""

    table: str
    index: Expression


@dataclass(frozen=True, eq=False)
class Column(Expression):
    """A number of a row, which has a name."""

    row: str
    index: int


@dataclass(frozen=True, eq=False)
class Item(Expression):
    """A number of a list of constants, by an argument that is a whole number."""

    list: str
    index: str


@dataclass(frozen=True, eq=False)
class Exact(Expression):
    """One operation that does not round; the reason says why."""

    operation: Operation
    reason: str


@dataclass(frozen=True, eq=False)
class Call(Expression):
    """A call of a function of math.h, or of one that languages write in their own ways.

    "divide" is a quotient that a GPU may compute less accurately. "bits", "from_bits", "uint32", "uint64" and "index"
    convert numbers and words.
    """

    function: str
    arguments: tuple[Expression, ...]


@dataclass(frozen=True, eq=False)
class Polynomial(Expression):
    """A polynomial, and how it is summed.

    Attributes
    ----------
    variable : str
    terms : tuple of (int, str)
        Exponents, ascending, and names of coefficients.
    summed : Expression
        The same by sums and products.
    """

    variable: str
    terms: Terms
    summed: Expression


class Statement(NamedTuple):
    """An assignment."""

    name: str
    expression: Expression


Program = tuple[Statement, ...]
"""Assignments in the order of the code; each reads inputs, constants and earlier names."""
Terms = tuple[tuple[int, str], ...]
"""A polynomial: exponents, ascending, and names of coefficients."""


class CodeBranch(NamedTuple):
    """A part of a formula: a program for the arguments that its guard lets pass, and the expressions of its results.

    Attributes
    ----------
    guard : Expression or None
        A condition. None: for all arguments that earlier branches leave.
    program : Program
    results : dict
        Expressions by name.
    """

    guard: Expression | None
    program: Program
    results: Mapping[str, Expression]


def bare(expression: Expression) -> Expression:
    """Return the operations of an expression, without the marks that it is a polynomial, or exact."""
    match expression:
        case Polynomial():
            return expression.summed
        case Exact(operation):
            return operation
    return expression


def names_in(*expressions: Expression) -> set[str]:
    """Return the names that expressions read; also the names of tables."""
    names, rest = set[str](), [*expressions]
    # `rest` has the expressions that are still to be looked into.
    while rest:
        match rest.pop():
            case Name(name):
                names.add(name)
            case Polynomial(_, _, summed):
                rest.append(summed)
            case Exact(operation):
                rest.append(operation)
            case Operation(_, left, right):
                rest += (left, right)
            case Negation(_, operand):
                rest.append(operand)
            case Select(condition, met, otherwise):
                rest += (condition, met, otherwise)
            case Item(values, index):
                names |= {values, index}
            case TableRow(table, index):
                names.add(table)
                rest.append(index)
            case Column(row, _):
                names.add(row)
            case Call(_, arguments):
                rest += arguments
    return names


# --- readings ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Reading:
    """How a program is read with numbers of some kind, which can be added, subtracted, multiplied and divided.

    Attributes
    ----------
    literal : callable
        From a literal's text to a number.
    functions : mapping
        The functions called, by name.
    polynomial : callable or None
        From coefficients by ascending exponents, and the variable, to the polynomial's value; None: as it is summed.
    operations, exactly : mapping
        By symbol, operations other than Python's; those that do not round.
    word : callable
        From a `Word` to its value.
    choose : callable or None
        From a condition and two values to the one that it chooses; None: only the chosen one is computed.
    row, column : callable
        From a table and an index to a row; from a row and an index to a number.
    """

    literal: Callable[[str], Any]
    functions: Mapping[str, Callable[..., Any]] = field(default_factory=dict)
    polynomial: Callable[[Sequence[tuple[int, Any]], Any], Any] | None = None
    operations: Mapping[str, Callable[[Any, Any], Any]] = field(default_factory=dict)
    exactly: Mapping[str, Callable[[Any, Any], Any]] = field(default_factory=dict)
    word: Callable[[Word], Any] = lambda word: word.value
    choose: Callable[[Any, Any, Any], Any] | None = None
    row: Callable[[Any, Any], Any] = op.getitem
    column: Callable[[Any, int], Any] = op.getitem


class Run(dict[str, Any]):
    """The values of a program by name, each computed when it is first asked for.

    It begins with those of the inputs and constants.
    """

    def __init__(self, program: Program, inputs: Mapping[str, Any], arithmetic: Reading) -> None:
        super().__init__(inputs)
        self.program, self.arithmetic = {s.name: s.expression for s in program}, arithmetic

    def __missing__(self, name: str) -> Any:
        self[name] = value = evaluate(self.program[name], self, self.arithmetic)
        return value


AND = "and"
_OPERATIONS: Mapping[str, Callable[[Any, Any], Any]] = {
    "+": op.add,
    "-": op.sub,
    "*": op.mul,
    "/": op.truediv,
    "//": op.floordiv,
    "&": op.and_,
    "|": op.or_,
    "^": op.xor,
    "<<": op.lshift,
    ">>": op.rshift,
    "<": op.lt,
    "<=": op.le,
    ">": op.gt,
    ">=": op.ge,
    "==": op.eq,
    AND: op.and_,
}
_NEGATIONS: Mapping[str, Callable[[Any], Any]] = {"-": op.neg, "~": op.invert}


equal, both = map(_operator, ("==", AND))
"""Conditions: two numbers, words or conditions are equal; both of two conditions hold."""


def evaluate(expression: Expression, values: Mapping[str, Any], arithmetic: Reading) -> Any:
    """Return the value of an expression, from those of its names, with numbers of one kind."""
    return function_of(expression, arithmetic)(values)


# 2^12: all expressions of the largest kernel are 424 (measured), once for each kind of numbers.
@lru_cache(maxsize=1 << 12)
def function_of(expression: Expression, arithmetic: Reading) -> Evaluator:
    """Return an expression as a function of the values of its names; a proof has the same one for 10^5 values."""
    match expression:
        case Operation(symbol, left, right):
            operate = arithmetic.operations.get(symbol, _OPERATIONS[symbol])
            return _composed(operate, function_of(left, arithmetic), function_of(right, arithmetic))
        case Name(name):
            return op.itemgetter(name)
        case Literal(text):
            # Converted at each call: balls of a decimal depend on the precision that FLINT has then.
            return lambda values: arithmetic.literal(text)
        case Word():
            word = arithmetic.word(expression)
            return lambda values: word
        case Call(function, arguments):
            operands = (function_of(operand, arithmetic) for operand in arguments)
            return _composed(arithmetic.functions[function], *operands)
        case Exact(Operation(symbol, left, right)):
            # A kind of numbers that counts rounding errors has operations without them; for others these are the same.
            operate = arithmetic.exactly.get(symbol) or arithmetic.operations.get(symbol, _OPERATIONS[symbol])
            return _composed(operate, function_of(left, arithmetic), function_of(right, arithmetic))
        case Polynomial(variable, terms, summed):
            # Power series and polynomials have a rule of their own; other numbers follow the code's sums.
            polynomial = arithmetic.polynomial
            if polynomial is None:
                return function_of(summed, arithmetic)
            return lambda values: polynomial([(exponent, values[name]) for exponent, name in terms], values[variable])
        case Negation(symbol, operand):
            return _composed(_NEGATIONS[symbol], function_of(operand, arithmetic))
        case Select(condition, met, otherwise):
            test, if_met, if_not = (function_of(part, arithmetic) for part in (condition, met, otherwise))
            # Arrays compute both and choose element by element; for single numbers the other one may have no value.
            if arithmetic.choose is None:
                return lambda values: (if_met if test(values) else if_not)(values)
            return _composed(arithmetic.choose, test, if_met, if_not)
        case Item(items, place):
            return lambda values: values[items][values[place]]
        case TableRow(table, index):
            return _composed(arithmetic.row, op.itemgetter(table), function_of(index, arithmetic))
        case Column(row, number):
            return lambda values: arithmetic.column(values[row], number)
    raise TypeError(f"{expression!r} is no expression")


def _composed(operate: Callable[..., Any], first: Evaluator, *others: Evaluator) -> Evaluator:
    """Return the function of names that applies an operation to the results of one, two or more such functions."""
    # One and two operands have functions of their own, which call faster than an argument list.
    match others:
        case ():
            return lambda values: operate(first(values))
        case (second,):
            return lambda values: operate(first(values), second(values))
    return lambda values: operate(first(values), *[operand(values) for operand in others])


def read(branch: CodeBranch, names: Iterable[str], inputs: Mapping[str, Any], arithmetic: Reading) -> dict[str, Any]:
    """Return results or variables of a branch by name, from its inputs and constants by name."""
    values, results = Run(branch.program, inputs, arithmetic), branch.results
    return {name: evaluate(results[name], values, arithmetic) if name in results else values[name] for name in names}


def operations(program: Program, *results: Expression) -> Counter[str]:
    """Return how often each operation and function occurs in what the results need, by symbol or name."""
    assigned = {s.name: s.expression for s in program}

    def count(expression: Expression, counted: set[str]) -> Counter[str]:
        """Return the counts of an expression, and add the names of variables that it counts to `counted`."""
        match bare(expression):
            case Name(name) if name in assigned and name not in counted:
                # A variable is computed once, however often it is read.
                counted.add(name)
                return count(assigned[name], counted)
            case Operation(symbol, left, right):
                return Counter({symbol: 1}) + count(left, counted) + count(right, counted)
            case Negation(_, operand):  # free: it changes a bit
                return count(operand, counted)
            case Select(condition, met, otherwise):
                # One of two sides is computed: the costlier one counts. Afterwards only what both have computed, or
                # what was computed before, need not be computed again.
                in_condition, counted_otherwise = count(condition, counted), set(counted)
                sides = count(met, counted), count(otherwise, counted_otherwise)
                counted &= counted_otherwise
                return in_condition + max(sides, key=Counter.total)
            case Call(function, arguments):
                return sum((count(operand, counted) for operand in arguments), Counter({function: 1}))
        return Counter()

    counted: set[str] = set()
    return sum((count(result, counted) for result in results), Counter())


# --- powers and lacunary polynomials ----------------------------------------------------------------------------------


class Step(NamedTuple):
    """One multiplication: y^power = y^left y^right."""

    power: int
    left: int
    right: int


@lru_cache(maxsize=256)  # proof, rounding bound and code of a kernel ask for the same set; 256 is far more than kernels
def chain(exponents: frozenset[int]) -> tuple[Step, ...]:
    """Return a shortest sequence of multiplications, in ascending order, that ends with all these powers of y.

    Raises
    ------
    ValueError
        If a power is below 1.
    """
    if any(exponent < 1 for exponent in exponents):
        raise ValueError(f"powers are {sorted(exponents)}: expected whole numbers >= 1")
    # With k powers besides y itself k multiplications are the least; then k + 1, …, until a sequence is long enough.
    rest = tuple(sorted(exponents - {1}))
    lengths = (_chain((1,), rest, steps) for steps in whole_numbers(len(rest)))
    return next(steps for steps in lengths if steps is not None)


def _chain(have: tuple[int, ...], missing: tuple[int, ...], steps: int) -> tuple[Step, ...] | None:
    """Return at most `steps` multiplications that lead from the powers in `have` to those in `missing`, or None.

    Both ascend, and a step's power is larger than all before it (an addition chain; search in depth).
    """
    if not missing:
        return ()
    # Each missing power takes a step of its own, and a step at most doubles the largest exponent: have[-1] 2^steps.
    if len(missing) > steps or have[-1] << steps < missing[-1]:
        return None
    # The next power is a sum of two in `have`, and not above the first missing one, which has to be hit.
    sums = {x + y: (y, x) for x in have for y in have if x <= y and have[-1] < x + y <= missing[0]}
    for power in sorted(sums, reverse=True):  # the largest first, as it is nearest to what is missing
        rest = missing[1:] if power == missing[0] else missing
        later = _chain((*have, power), rest, steps - 1)
        if later is not None:
            return (Step(power, *sums[power]), *later)
    return None


def powers(variable: str, exponents: Iterable[int]) -> Program:
    """Return the assignments that make these powers of a variable: y2 = y * y, …."""
    return tuple(
        Statement(f"{variable}{step.power}", power(variable, step.left) * power(variable, step.right))
        for step in chain(frozenset(exponents))
    )


def power(variable: str, exponent: int) -> Name:
    """Return the name of a power of a variable."""
    return Name(variable if exponent == 1 else f"{variable}{exponent}")


def gaps(exponents: Sequence[int]) -> set[int]:
    """Return the powers of y that Horner's rule for a lacunary polynomial needs: differences of its exponents."""
    return {high - low for low, high in pairwise(exponents)}


def by_powers(variable: str, terms: Terms) -> Polynomial:
    """Return a lacunary polynomial, whose exponents begin with 0, by Horner's rule: a0 + y4 * (a4 + y4 * a8).

    The powers of the variable have to be assigned before (`powers`, `gaps`).
    """
    # From the last term inwards: the sum so far times y to the gap of two exponents, plus the next coefficient.
    summed: Expression = Name(terms[-1][1])
    for (low, name), (high, _) in reversed(list(pairwise(terms))):
        summed = Name(name) + power(variable, high - low) * summed
    return Polynomial(variable, terms, summed)


def by_horner(variable: str, terms: Terms) -> Polynomial:
    """Return a polynomial by Horner's rule with products by the variable alone: a0 + v * (a1 + v * (v * a3))."""
    # From the highest exponent down; None is the sum before the first coefficient, and where a coefficient is missing
    # nothing is added.
    summed: Expression | None = None
    names = dict(terms)
    for exponent in range(terms[-1][0], -1, -1):
        product = None if summed is None else Name(variable) * summed
        if exponent in names:
            summed = Name(names[exponent]) if product is None else Name(names[exponent]) + product
        else:
            summed = product
    return Polynomial(variable, terms, summed or Name(terms[-1][1]))


def in_pairs(variable: str, square: str, names: Sequence[str]) -> Polynomial:
    """Return a polynomial in pairs, (c0 + m * c1) + mm * ((c2 + m * c3) + mm * (…)); an odd one out comes last.

    `variable` and `square` are the names of m and of mm = m m, and `names` those of the coefficients c0, c1, …. The
    pairs do not wait for each other, as the products of Horner's rule do.
    """
    pairs = [names[n : n + 2] for n in range(0, len(names), 2)]
    sums: list[Expression] = [
        Name(pair[0]) + Name(variable) * Name(pair[1]) if len(pair) == 2 else Name(pair[0]) for pair in pairs
    ]
    # Horner's rule in mm, from the last pair inwards.
    summed = sums.pop()
    for pair_sum in reversed(sums):
        summed = pair_sum + Name(square) * summed
    return Polynomial(variable, tuple(enumerate(names)), summed)
