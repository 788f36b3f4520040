"""Functions without branches, for arrays: every branch is computed, with safe arguments where it is not chosen."""

from __future__ import annotations

from collections.abc import Mapping

from viscopade.kernels.expressions import (
    Call,
    CodeBranch,
    Expression,
    Literal,
    Name,
    Negation,
    Operation,
    Select,
    Statement,
    bare,
)
from viscopade.kernels.kernel import Function, names_of

SAFE, NAN = Literal("0.5"), Name("nan")


def straight(function: Function) -> Function:
    """Return the function as one program.

    A branch takes 0.5 for its arguments where it is not chosen: so nothing overflows or divides by 0 there, and the
    gradient of what is chosen is not multiplied with an infinite one.
    """
    program = list[Statement]()
    if function.domain is not None:
        program.append(Statement("inside", function.domain))
        program += (
            Statement(name, Select(Name("inside"), Name(name), SAFE))
            for name in function.arguments
        )  # fmt: skip
    program += function.start
    given = {*function.arguments, *(statement.name for statement in function.start)}
    chosen = list[tuple[Expression | None, Expression]]()
    for number, branch in enumerate(function.branches, 1):
        program += _branch(function, branch, number, given, chosen)
    result: Expression = NAN
    for condition, value in reversed(chosen):
        result = value if condition is None else Select(condition, value, result)
    if function.domain is not None:
        result = Select(Name("inside"), result, NAN)
    end = CodeBranch(None, (), {function.result: result})
    return Function(
        function.name, function.arguments, function.meaning, None, tuple(program), (end,), function.result
    )  # fmt: skip


def _branch(
    function: Function,
    branch: CodeBranch,
    number: int,
    given: set[str],
    chosen: list[tuple[Expression | None, Expression]],
) -> list[Statement]:
    """Return the program of a branch; add its condition and its value to those chosen."""
    only = branch.guard is None and not chosen
    condition = None if branch.guard is None else Name(f"case{number}")
    lines = [] if branch.guard is None else [Statement(f"case{number}", branch.guard)]
    inner = branch._replace(guard=None)
    read = sorted(given.intersection(names_of(inner)))
    names = {} if only else {name: f"{name}{number}" for name in read}
    for name, own in names.items():
        safe: Expression = Name(name) if condition is None else Select(condition, Name(name), SAFE)
        for earlier, _ in reversed(chosen):
            assert earlier is not None
            safe = Select(earlier, SAFE, safe)
        lines.append(Statement(own, safe))
    lines += (Statement(name, renamed(value, names)) for name, value in branch.program)
    value = renamed(branch.results[function.result], names)
    if not only:
        lines.append(Statement(f"result{number}", value))
        value = Name(f"result{number}")
    chosen.append((condition, value))
    return lines


def renamed(expression: Expression, names: Mapping[str, str]) -> Expression:
    """Return an expression with other names."""
    match bare(expression):
        case Name(name):
            return Name(names.get(name, name))
        case Operation(symbol, left, right):
            return Operation(symbol, renamed(left, names), renamed(right, names))
        case Negation(symbol, operand):
            return Negation(symbol, renamed(operand, names))
        case Select(condition, met, otherwise):
            return Select(renamed(condition, names), renamed(met, names), renamed(otherwise, names))
        case Call(called, arguments):
            return Call(called, tuple(renamed(part, names) for part in arguments))
        case other:
            return other
