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

SAFE = Literal("0.5")
"""Stands for an argument where a branch is not chosen: inside (0, 1), where no formula of v* or eps is singular.

Any other number well inside would do.
"""
NAN = Name("nan")


def without_branches(function: Function) -> Function:
    """Return the function as one program, whose result is a choice among those of its branches.

    A branch takes 0.5 for its arguments where it is not chosen: so nothing overflows or divides by 0 there, and the
    gradient of what is chosen is not multiplied with an infinite one.
    """
    program = list[Statement]()
    # Outside the domain all arguments are safe, and the result is NaN.
    if function.domain is not None:
        program.append(Statement("inside", function.domain))
        program += (
            Statement(name, Select(Name("inside"), Name(name), SAFE))
            for name in function.arguments
        )  # fmt: skip
    program += function.start
    shared_names = {*function.arguments, *(statement.name for statement in function.start)}
    # The condition of each branch (None: all arguments that are left) and its result.
    choices = list[tuple[Expression | None, Expression]]()
    for number, branch in enumerate(function.branches, 1):
        # A function's only branch needs neither a condition nor names of its own.
        only = branch.guard is None and not choices
        condition: Expression | None = None
        if branch.guard is not None:
            condition = Name(f"case{number}")
            program.append(Statement(f"case{number}", branch.guard))
        # What the branch reads gets a name of its own, v_star1: safe unless the branch is chosen, and no earlier one.
        read = sorted(shared_names.intersection(names_of(branch._replace(guard=None))))
        new_names = {} if only else {name: f"{name}{number}" for name in read}
        for name, new_name in new_names.items():
            safe: Expression = Name(name) if condition is None else Select(condition, Name(name), SAFE)
            for earlier, _ in reversed(choices):
                assert earlier is not None
                safe = Select(earlier, SAFE, safe)
            program.append(Statement(new_name, safe))
        program += (Statement(name, renamed(value, new_names)) for name, value in branch.program)
        value = renamed(branch.results[function.result], new_names)
        if not only:
            program.append(Statement(f"result{number}", value))
            value = Name(f"result{number}")
        choices.append((condition, value))
    # The result of the first branch whose condition holds: case1 ? result1 : (case2 ? result2 : …), at last NaN.
    result: Expression = NAN
    for condition, value in reversed(choices):
        result = value if condition is None else Select(condition, value, result)
    if function.domain is not None:
        result = Select(Name("inside"), result, NAN)
    end = CodeBranch(None, (), {function.result: result})
    return Function(
        function.name, function.arguments, function.meaning, None, tuple(program), (end,), function.result
    )  # fmt: skip


def renamed(expression: Expression, names: Mapping[str, str]) -> Expression:
    """Return an expression in which names are replaced: old name -> new name."""
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
            return Call(called, tuple(renamed(argument, names) for argument in arguments))
        case leaf:  # literals, and words of bits, have no names
            return leaf
