"""The one type of a kernel: functions as programs, constants in each format, tables, and proven bounds.

Quotients, compact and inverse kernels, speed tables and the functions of full accuracy are kernels that functions build
from a record or a fit. The writer (`kernels.write`) writes every kernel in every language; it does not know which
is which.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Any

from viscopade.arithmetic.formats import FORMATS
from viscopade.kernels import expressions
from viscopade.kernels.bound import ErrorBound
from viscopade.kernels.expressions import CodeBranch, Expression, Item, Program, Statement, names_in

if TYPE_CHECKING:  # which imports FLINT
    from viscopade.kernels.certificate import Certificate

Proof = tuple[Mapping[str, Any], "Certificate"]
"""JSON-able data of a formula, and its certificate."""


@dataclass(frozen=True, eq=False)
class Table:
    """A table of numbers of one format, which programs read by rows (`expressions.TableRow`).

    Attributes
    ----------
    name, form : str
        Its name in programs, and that of the format.
    shape : pair of int
        Numbers of rows and of columns.
    make : callable
        Gives the rows.
    """

    name: str
    form: str
    shape: tuple[int, int]
    make: Callable[[], tuple[tuple[float, ...], ...]]

    @cached_property
    def rows(self) -> tuple[tuple[float, ...], ...]:
        """The rows, which are read when they are first asked for."""
        return self.make()

    @property
    def bytes(self) -> int:
        """Size in memory."""
        return self.shape[0] * self.shape[1] * FORMATS[self.form].bytes


@dataclass(frozen=True, eq=False)
class Function:
    """A function of a kernel: a program from its arguments to one number.

    Where `domain` does not hold, and where no branch's guard does, the result is NaN.

    Attributes
    ----------
    name : str
        The beginning of its name in code: "epsilon", "restitution", …
    arguments : tuple of str
        Their names.
    meaning : str
        What it returns, for the reader.
    domain : Expression or None
        The condition on the arguments under which `start` can be computed; None: always.
    start : Program
        From the arguments to what the branches take.
    branches : tuple of CodeBranch
        The first one whose guard holds is computed.
    result : str
        The name of the result in every branch.
    """

    name: str
    arguments: tuple[str, ...]
    meaning: str
    domain: Expression | None
    start: Program
    branches: tuple[CodeBranch, ...]
    result: str

    @cached_property
    def pruned(self) -> Function:
        """Return the function without the statements that its result does not need."""

        def pruned_branch(branch: CodeBranch) -> CodeBranch:
            value = branch.results[self.result]
            return CodeBranch(branch.guard, needed(branch.program, names_in(value)), {self.result: value})

        # What the branches read is what `start` has to compute.
        branches = tuple(map(pruned_branch, self.branches))
        read_names = set[str]().union(*map(names_of, branches))
        return Function(
            self.name, self.arguments, self.meaning, self.domain, needed(self.start, read_names), branches, self.result
        )

    @property
    def indices(self) -> set[str]:
        """The arguments that are whole numbers: those that choose a number of a list."""
        values = (*(s.expression for s in self.start), *(branch.results[self.result] for branch in self.branches))
        return {value.index for value in values if isinstance(value, Item)}

    @property
    def names(self) -> set[str]:
        """All names that are read."""
        domain = [] if self.domain is None else [self.domain]
        return names_in(*(statement.expression for statement in self.start), *domain).union(
            *map(names_of, self.branches)
        )

    @property
    def assigned(self) -> set[str]:
        """All names that are assigned."""
        return {s.name for program in (self.start, *(b.program for b in self.branches)) for s in program}

    def operations(self) -> Counter[str]:
        """Return how often each operation and function occurs in the costliest branch, by symbol or name."""
        return max(map(self._branch_operations, self.branches), key=Counter.total)

    def calls(self, index: int) -> set[str]:
        """Return the names of the functions that a branch calls for its result."""
        # Of the keys, symbols of operations and names of functions, the names have letters.
        return {name for name in self._branch_operations(self.branches[index]) if name.isalnum()}

    def _branch_operations(self, branch: CodeBranch) -> Counter[str]:
        """Return how often each operation and function occurs in what one branch needs, with `start`."""
        return expressions.operations((*self.start, *branch.program), branch.results[self.result])


def names_of(branch: CodeBranch) -> set[str]:
    """Return the names that a branch reads."""
    guard = [] if branch.guard is None else [branch.guard]
    return names_in(*(s.expression for s in branch.program), *branch.results.values(), *guard)


def needed(program: Program, names: Iterable[str]) -> Program:
    """Return the statements of a program that lead to these names."""
    # From the last statement up: one that is needed makes what it reads needed.
    needed_names, kept = set(names), list[Statement]()
    for statement in reversed(program):
        if statement.name in needed_names:
            needed_names |= names_in(statement.expression)
            kept.append(statement)
    return tuple(reversed(kept))


@dataclass(frozen=True, eq=False)
class Kernel:
    """A kernel: formulas of eps or of v* with proven errors.

    Attributes
    ----------
    name : str
        The end of the functions' names, which lasts: it says what was asked for, "pade_3_6", "compact_1em5".
    label : str
        The name for the reader, "[3/6]".
    argument : str
        What its functions take: "v_star", "speed" (and beta) or "epsilon".
    formula, source, domain : str
        What is computed, where the coefficients come from, and for which arguments, for the reader.
    normal : tuple of str
        What must be a normal number for the bounds, besides what each needs (`ErrorBound.normal`).
    functions : tuple of Function
        What it computes, each with its own program.
    constants : mapping
        By name of a format and name of a constant; a format without constants has an entry, too.
    bounds : tuple of ErrorBound
        Of results of the functions, each on a range and in an arithmetic.
    tables : tuple of Table
        In a narrower type than a table's, functions are computed in the table's type, and rounded.
    lists : mapping
        By name, constants that functions read by a whole number (`expressions.Item`), such as one for each pair.
    missing : mapping
        Why a format is left out, by its name.
    record : mapping
        The formula for tables, as JSON-able data: coefficients as decimals, domain, measure, …
    fallback : Kernel or None
        For functions of the speed: the kernel of v* whose functions their second branch calls, in type double.
    proofs : tuple of (mapping, Certificate)
        What independent checkers need to check the bounds: JSON-able data, and a certificate.

    Raises
    ------
    ValueError
        If a program reads a name that is neither given nor computed, a constant is no number of its format, or a bound
        is one of a function or a format that the kernel does not have.
    """

    name: str
    label: str
    argument: str
    formula: str
    source: str
    domain: str
    functions: tuple[Function, ...]
    constants: Mapping[str, Mapping[str, float]]
    bounds: tuple[ErrorBound, ...] = ()
    tables: tuple[Table, ...] = ()
    lists: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    missing: Mapping[str, str] = field(default_factory=dict)
    record: Mapping[str, Any] = field(default_factory=dict)
    proofs: tuple[Proof, ...] = ()
    fallback: Kernel | None = None
    normal: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Refuse a kernel whose programs, constants and bounds do not belong together."""
        # What each function reads and does not compute; tables and lists are the same for all formats.
        needs = {f.name: f.names - f.assigned - {*f.arguments} for f in (f.pruned for f in self.functions)}
        shared = {*(table.name for table in self.tables), *self.lists}
        for form, constants in self.constants.items():
            for name, value in constants.items():
                if FORMATS[form].rounded(Fraction(value)) != value:
                    raise ValueError(f"{self.name}: {name} is no number of type {form}")
            for function, names in needs.items():
                if unknown := names - shared - {*constants}:
                    raise ValueError(f"{self.name}: {function} reads {', '.join(sorted(unknown))}, which nothing gives")
        # A bound of a function or a type that is not there would be stated by no file.
        function_names = {function.name for function in self.functions}
        for bound in self.bounds:
            if bound.result not in function_names or bound.arithmetic.form.name not in self.constants:
                raise ValueError(f"{self.name}: there is no {bound.result} in type {bound.arithmetic.form.name}")

    @property
    def formats(self) -> tuple[str, ...]:
        """Names of the formats."""
        return tuple(self.constants)

    def function(self, name: str) -> Function:
        """Return the function with this name."""
        return next(function for function in self.functions if function.name == name)

    def bound(self, result: str, place: str, form: str, branch: int | None = None) -> list[ErrorBound]:
        """Return the bounds of a result in an arithmetic, the narrowest range of v* first.

        `result` is a function's name, and `place` ("host" or "device") and the name `form` of a type are the
        arithmetic's. Bounds of one branch alone are left out, except for the branch with the index `branch`.
        """
        key = result, place, form
        bounds = [
            b
            for b in self.bounds
            if (b.result, b.arithmetic.place, b.arithmetic.form.name) == key and b.branch in (None, branch)
        ]
        # Of the same range a bound for some speeds comes before one for all.
        return sorted(bounds, key=lambda b: (b.high - b.low, b.speeds is None))

    def table_bound(self, result: str, form: str) -> ErrorBound:
        """Return the bound for the arguments of a speed table that lead to its table, on a host.

        `result` is a function's name and `form` that of a type.
        """
        # Branch 0 of these functions reads the table, and branch 1 calls the kernel `fallback`.
        return next(b for b in self.bound(result, "host", form, 0) if b.branch == 0)

    @property
    def bytes(self) -> int:
        """Size of the tables in memory."""
        return sum(table.bytes for table in self.tables)
