"""The one writer of functions: it walks a kernel and a language.

Expressions are written with the same order of evaluation; choices are expressions, too. Every function stands alone: it
can be copied without the others.

A `Language` is a set of patterns, texts with words in braces; a `Number` is its number type of one format. Each module
of `write.languages` has one, such as `languages.c`. `write.file` puts functions and tables below the head of a file.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from fractions import Fraction
from textwrap import TextWrapper, indent

from viscopade.arithmetic.formats import FORMATS
from viscopade.generated import WIDTH
from viscopade.kernels.expressions import (
    AND,
    Call,
    CodeBranch,
    Column,
    Expression,
    Item,
    Literal,
    Name,
    Negation,
    Operation,
    Program,
    Select,
    TableRow,
    Word,
    bare,
)
from viscopade.kernels.kernel import Function, Kernel, Table
from viscopade.kernels.write.branchless import without_branches
from viscopade.kernels.write.language import Language, Number

_TAB = " " * 4
# Wraps an expression: of `WIDTH` columns 24 are left for what is no part of it, indent and "const double elastic = ".
_LINES = TextWrapper(WIDTH - 24, break_long_words=False, break_on_hyphens=False)
# Wraps rows of a table: lines of a generated file have at most 120 columns.
_ROWS = TextWrapper(
    120, initial_indent=_TAB, subsequent_indent=_TAB, break_long_words=False, break_on_hyphens=False
)  # fmt: skip
# A blank before an operator: lines do not break there, but after it.
_OPERATOR = re.compile(r" (?=(?:\W{1,2}|and|or|else|if) )")
_CONDITIONS = ("<", "<=", ">", ">=", "==", AND)


def function_text(kernel: Kernel, function: Function, language: Language, number: Number) -> str:
    """Return the text of a kernel's function in a language, for numbers of one type."""
    pruned = function.pruned
    return _Writer(kernel, without_branches(pruned) if language.branchless else pruned, language, number).text()


def generic_text(kernel: Kernel, function: Function, language: Language) -> str:
    """Return the text that makes one function of those for each type, of a kernel; "" where the language has none."""
    words = words_of(kernel, function)
    procedures = [
        language.procedure.format(**words, type=number.type, suffix=number.suffix)
        for number in language.numbers
        if number.form in kernel.constants
    ]
    return language.generic.format(**words, procedures=", ".join(procedures))


def words_of(kernel: Kernel, function: Function) -> dict[str, str]:
    """Return the words of patterns that name a function of a kernel: word in braces -> text."""
    # "restitution_compact_1em5", and with a capital for languages whose functions have one
    name = f"{function.name}_{kernel.name}"
    return {
        "name": name,
        "Name": name[0].upper() + name[1:],
        "function": function.name,
        "kernel": kernel.name,
        "names": ", ".join(function.arguments),
        "meaning": function.meaning,
    }


def table_text(kernel: Kernel, table: Table, language: Language) -> str:
    """Return the text of a kernel's table in a language, with hexadecimal numbers.

    A line has as many whole rows as fit; a row that is longer than a line has one of its own.
    """
    form = FORMATS[table.form]
    # No-break spaces within a row, while lines are broken, keep it whole.
    rows = [f"{{{form.hexadecimal(*row)}}},".replace(" ", "\N{NO-BREAK SPACE}") for row in table.rows]
    values = "\n".join(_ROWS.wrap(" ".join(rows))).replace("\N{NO-BREAK SPACE}", " ")
    return language.table.format(
        type=language.number(table.form).type, table=table.name, kernel=kernel.name, rows=table.shape[0],
        columns=table.shape[1], values=values,
    )  # fmt: skip


def program_text(kernel: Kernel, program: Program, language: Language, number: Number) -> list[str]:
    """Return the lines of assignments alone, of a program of the kernel."""
    return _Writer(kernel, Function("", (), "", None, program, (), ""), language, number).program(program)


def expression_text(kernel: Kernel, expression: Expression, language: Language, number: Number) -> str:
    """Return the text of an expression of the kernel alone."""
    return _Writer(kernel, Function("", (), "", None, (), (), ""), language, number).expression(expression)


class _Writer:
    """Writer of one function in one format."""

    def __init__(self, kernel: Kernel, function: Function, language: Language, number: Number) -> None:
        """Write a kernel's function in a language, with numbers of one of its types."""
        self.kernel, self.function, self.language, self.number = kernel, function, language, number
        # Words of all patterns.
        self.words = {"type": number.type, "suffix": number.suffix, "nan": number.nan}
        # Names that were assigned, in the order of the text, for languages that declare them first.
        self.variables: list[str] = []
        # What each variable is, for its type: name -> result of `_kind`.
        self.kinds: dict[str, str] = {}
        for program in (function.start, *(branch.program for branch in function.branches)):
            for name, expression in program:
                self.kinds[name] = _kind(expression, self.kinds)

    def text(self) -> str:
        """Return the whole text."""
        language, function = self.language, self.function
        arguments = language.between.join(
            (language.index if argument in function.indices else language.argument).format(
                argument=argument, **self.words
            )
            for argument in function.arguments
        )
        # NaN outside the domain, what the branches need, the branches but the last, each with its return, and the last.
        *branches, last = function.branches
        body = [*self._absent(), *self._unless(function.domain), *self.program(function.start)]
        for branch in branches:
            assert branch.guard is not None
            body += self._when(self.expression(branch.guard), self._branch(branch, language.result))
        body += [*self._unless(last.guard), *self._branch(last, language.last or language.result)]
        # Constants and declarations come first; an empty line follows them.
        constants, declarations = list(self._constants()), []
        if language.locals and self.variables:
            declarations = self._line(language.locals, names=", ".join(dict.fromkeys(self.variables)))
        lines = [*constants, *declarations, *([""] if constants or declarations else []), *body]
        # Where indentation ends a function, as in Python, it has no empty lines.
        if language.end == "" and not language.close:
            lines = [line for line in lines if line]
        words = {**words_of(self.kernel, function), "arguments": arguments}
        begin = language.begin.format(**self.words, **words)
        close = language.close.format(**self.words, **words)
        return "\n".join(filter(None, (begin, indent("\n".join(lines), _TAB), close)))

    def _line(self, pattern: str, **words: str) -> list[str]:
        """Return the lines of a pattern with its words replaced; none where the language has no such pattern."""
        return pattern.format(**{**self.words, **words}).splitlines() if pattern else []

    def _constants(self) -> Iterator[str]:
        """Yield the lines that define the constants and lists of constants that the function reads."""
        read = self.function.names
        for name, value in self.kernel.constants[self.number.form].items():
            if name in read:
                yield from self._line(self.language.constant, name=name, value=self.number.constant(value))
        for name, numbers in self.kernel.lists.items():
            if name in read:
                # Lists are exact numbers, rounded to the type here; the other constants are already numbers of it.
                form, literal = FORMATS[self.number.form], self.number.literal
                values = [literal(float(form.nearest(Fraction(value)))) for value in numbers]
                yield from self._line(
                    self.language.list, name=name, values=self._broken(", ".join(values)), count=str(len(values))
                )

    def _broken(self, text: str) -> str:
        """Return a text broken into lines, of which all but the first are indented by two tabs."""
        return f"{self.language.continued}\n{_TAB * 2}".join(_LINES.wrap(text))

    def _absent(self) -> list[str]:
        """Return the lines that give NaN for an argument that is no number; none where the types exclude that."""
        if not self.language.absent:
            return []
        conditions = [self.language.absent.format(argument=argument) for argument in self.function.arguments]
        return self._when(
            f" {self.language.either} ".join(conditions), self._line(self.language.result, value=self.number.nan)
        )

    def _unless(self, condition: Expression | None) -> list[str]:
        """Return the lines that give NaN where a condition does not hold; none for None, no condition."""
        if condition is None:
            return []
        first = self._line(self.language.unless, condition=self.expression(condition))
        nan = self._line(self.language.result, value=self.number.nan)
        return [*first, *(_TAB + line for line in nan), *self._line(self.language.end)]

    def _when(self, condition: str, lines: list[str]) -> list[str]:
        """Return lines that are executed where a condition, as text, holds."""
        return [
            *self._line(self.language.when, condition=condition),
            *(_TAB + line if line else line for line in lines),
            *self._line(self.language.end),
        ]

    def _branch(self, branch: CodeBranch, result: str) -> list[str]:
        """Return the lines of a branch, the last of which has the pattern `result`."""
        return [*self.program(branch.program), *self._statement(result, branch.results[self.function.result])]

    def program(self, program: Program) -> list[str]:
        """Return the lines of assignments."""
        lines = list[str]()
        for name, value in program:
            self.variables.append(name)
            kind = _kind(value, self.kinds)
            # Words, rows and conditions have types of their own.
            variable_type = self.number.types.get(kind, self.number.type)
            lines += self._statement(self.language.assign, value, name=name, type=variable_type)
        return lines

    def _statement(self, pattern: str, value: Expression, **words: str) -> list[str]:
        """Return the lines of a pattern with an expression as its value, and with other words.

        Lines break after operators, where every language knows that the next line goes on.
        """
        # No-break spaces before operators, while lines are broken, keep each operator on the line of its left operand.
        unbroken = _OPERATOR.sub("\N{NO-BREAK SPACE}", self.expression(value))
        text = self._broken(unbroken).replace("\N{NO-BREAK SPACE}", " ")
        return self._line(pattern, value=text, **words)

    # --- expressions ------------------------------------------------------------------------------------------------

    def expression(self, expression: Expression) -> str:
        """Return the expression as text, with the same order of evaluation."""
        language, number = self.language, self.number
        match bare(expression):
            case Name(name):
                return name
            case Literal(text):
                return number.literal(float(text))
            case Call("divide", (top, bottom)) if "divide" not in number.calls:
                return self.expression(top / bottom)
            case Call(function, arguments):
                texts = [self.expression(argument) for argument in arguments]
                if function in number.calls:
                    return number.calls[function].format(*texts)
                return f"{number.functions.format(name=function)}({', '.join(texts)})"
            case Word(_, pattern) as word:
                # Masks and bits of numbers are hexadecimal, shifts and counts decimal.
                value = word.value_in(FORMATS[number.form])
                return number.word.format(digits=hex(value)) if pattern else str(value)
            case Negation(symbol, operand):
                return f"{symbol}{self._in_parentheses(operand)}"
            case Select(condition, met, otherwise):
                # A choice as the last alternative needs no parentheses in any language: a ? b : c ? d : e.
                return language.select.format(
                    condition=self._chosen(condition), met=self._chosen(met), otherwise=self.expression(otherwise)
                )
            case Item(values, place):  # a number of a list of constants
                return language.item.format(name=values, index=place)
            case TableRow(table, index):
                return language.row.format(table=table, kernel=self.kernel.name, index=self.expression(index))
            case Column(row, index):  # a number of a row
                return f"{row}[{index}]"
            case Operation(symbol, left, right):
                # Quotients of words are whole numbers, which languages with words write like others. 0 and 1 are sides.
                written = {AND: language.both, "//": "/"}.get(symbol, symbol)
                return f"{self._operand(left, symbol, 0)} {written} {self._operand(right, symbol, 1)}"
        raise TypeError(f"{expression!r} is no expression")

    def _chosen(self, expression: Expression) -> str:
        """Return a condition or a first alternative of a choice as text, in parentheses if it is a choice itself."""
        # Branchless languages write choices as calls.
        nested = isinstance(bare(expression), Select) and not self.language.branchless
        return self._in_parentheses(expression) if nested else self.expression(expression)

    def _operand(self, expression: Expression, symbol: str, side: int) -> str:
        """Return the left (side 0) or right (1) operand of an operation as text, in parentheses where it needs them."""
        operand = bare(expression)
        if isinstance(operand, Call) and operand.function == "divide" and "divide" not in self.number.calls:
            operand = operand.arguments[0] / operand.arguments[1]
        if not isinstance(operand, Operation):
            return self._in_parentheses(operand) if isinstance(operand, Select) else self.expression(operand)
        # A sum within a sum is in parentheses on either side: some languages let compilers reorder what is in none.
        # Operations on bits have all of theirs in parentheses, and comparisons those on bits and other comparisons:
        # languages differ in which of them bind more tightly. Where "and" is "&", as for arrays of Python, it binds
        # more tightly than comparisons.
        binding, outer = _BINDING[operand.symbol], _BINDING[symbol]
        loose = (
            outer == _BITS or (symbol, self.language.both) == (AND, "&") or (outer == _COMPARISON and binding <= _BITS)
        )
        # A right operand must bind more tightly, a - (b - c) and a / (b * c); a left one as tightly, a * b * c.
        loose = loose or binding < outer + (side or binding == _SUM)
        written = self.expression(operand)  # no deeper than needed: polynomials may be of degree 200
        return f"({written})" if loose else written

    def _in_parentheses(self, expression: Expression) -> str:
        """Return an expression as text, in parentheses unless it is a name, a call or a positive number."""
        written = self.expression(expression)
        compound = isinstance(bare(expression), Operation | Select | Negation) or written.startswith("-")
        return f"({written})" if compound else written


# How tightly operators bind, loosest first; only the order counts.
_COMPARISON, _BITS, _SUM, _PRODUCT = 2, 3, 4, 5
_BINDING = {
    AND: 1,
    **dict.fromkeys(("<", "<=", ">", ">=", "=="), _COMPARISON),
    **dict.fromkeys(("&", "|", "^", "<<", ">>"), _BITS),
    **dict.fromkeys("+-", _SUM),
    **dict.fromkeys(("*", "/", "//"), _PRODUCT),
}


# Calls whose results are words, and of which kind; all others give numbers.
_KINDS = {"bits": "word", "uint32": "uint32", "uint64": "uint64", "index": "index"}


def _kind(expression: Expression, variables: Mapping[str, str]) -> str:
    """Return what an expression is: a "number", a "condition", a "row", or a word of some kind; "" if it is a constant.

    `variables` has the kinds of variables by name; other names are numbers. An operation on words of two kinds is of
    the first one's.
    """
    match bare(expression):
        case Operation(symbol, left, right):
            return "condition" if symbol in _CONDITIONS else _kind(left, variables) or _kind(right, variables)
        case Negation(_, operand):
            return _kind(operand, variables)
        case Select(_, met, otherwise):
            return _kind(met, variables) or _kind(otherwise, variables)
        case Call(function, _):
            return _KINDS.get(function, "number")
        case TableRow():
            return "row"
        case Word():
            return ""
        case Name(name):
            return variables.get(name, "number")
    return "number"
