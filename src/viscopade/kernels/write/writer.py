"""The one writer of functions: it walks a kernel and a language.

Expressions are written with the same order of evaluation; choices are expressions, too. Every function stands alone: it
can be copied without the others.
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
    Statement,
    TableRow,
    Word,
    bare,
)
from viscopade.kernels.kernel import Function, Kernel, Table
from viscopade.kernels.write.language import Language, Number
from viscopade.kernels.write.straight import straight

_TAB = " " * 4
_LINES = TextWrapper(WIDTH - 24, break_long_words=False, break_on_hyphens=False)  # of an expression
_OPERATOR = re.compile(r" (?=(?:\W{1,2}|and|or|else|if) )")
_CONDITIONS = ("<", "<=", ">", ">=", "==", AND)


def function_text(kernel: Kernel, function: Function, language: Language, number: Number) -> str:
    """Return the text of a function in a format of the kernel and the language."""
    pruned = function.pruned
    return _Writer(kernel, straight(pruned) if language.straight else pruned, language, number).text()


def generic_text(kernel: Kernel, function: Function, language: Language) -> str:
    """Return the text that makes one function of those for each type; "" where the language has none."""
    words = words_of(kernel, function)
    each = [
        language.procedure.format(**words, type=number.type, suffix=number.suffix)
        for number in language.numbers
        if number.form in kernel.constants
    ]
    return language.generic.format(**words, procedures=", ".join(each))


def words_of(kernel: Kernel, function: Function) -> dict[str, str]:
    """Return the words of patterns that name a function."""
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
    """Return the text of a table, whose numbers are hexadecimal."""
    form = FORMATS[table.form]
    lines = [f"    {{{form.hexadecimal(*row)}}}," for row in table.rows]
    return language.table.format(
        type=language.number(table.form).type, table=table.name, kernel=kernel.name, rows=table.shape[0],
        columns=table.shape[1], values="\n".join(lines),
    )  # fmt: skip


def program_text(kernel: Kernel, program: Program, language: Language, number: Number) -> list[str]:
    """Return the lines of assignments alone."""
    return _Writer(kernel, Function("", (), "", None, program, (), ""), language, number).program(program)


def expression_text(kernel: Kernel, expression: Expression, language: Language, number: Number) -> str:
    """Return the text of an expression alone."""
    return _Writer(kernel, Function("", (), "", None, (), (), ""), language, number).expression(expression)


class _Writer:
    """Writer of one function in one format."""

    def __init__(self, kernel: Kernel, function: Function, language: Language, number: Number) -> None:
        self.kernel, self.function, self.language, self.number = kernel, function, language, number
        self.words = {"type": number.type, "suffix": number.suffix, "nan": number.nan}
        self.variables: list[str] = []
        self.kinds: dict[str, str] = {}
        for name, expression in self._statements():
            self.kinds[name] = _kind(expression, self.kinds)

    def _statements(self) -> Iterator[Statement]:
        yield from self.function.start
        for branch in self.function.branches:
            yield from branch.program

    def text(self) -> str:
        """Return the whole text."""
        language, function, given = self.language, self.function, self.language.between.join(self._arguments())
        body = [*self._absent(), *self._unless(function.domain), *self.program(function.start), *self._branches()]
        constants, head = list(self._constants()), []
        if language.locals and self.variables:
            head = self._line(language.locals, names=", ".join(dict.fromkeys(self.variables)))
        words = {**words_of(self.kernel, function), "arguments": given}
        lines = [*constants, *head, *([""] if constants or head else []), *body]
        if language.end == "" and not language.close:
            lines = [line for line in lines if line]
        begin = language.begin.format(**self.words, **words)
        close = language.close.format(**self.words, **words)
        return "\n".join(filter(None, (begin, indent("\n".join(lines), _TAB), close)))

    def _arguments(self) -> Iterator[str]:
        for argument in self.function.arguments:
            pattern = self.language.index if argument in self.function.indices else self.language.argument
            yield pattern.format(argument=argument, **self.words)

    def _line(self, pattern: str, **words: str) -> list[str]:
        return pattern.format(**{**self.words, **words}).splitlines() if pattern else []

    def _constants(self) -> Iterator[str]:
        read = self.function.names
        for name, value in self.kernel.constants[self.number.form].items():
            if name in read:
                yield from self._line(self.language.constant, name=name, value=self.number.constant(value))
        for name, numbers in self.kernel.lists.items():
            if name in read:
                form, literal = FORMATS[self.number.form], self.number.literal
                values = [literal(float(form.nearest(Fraction(value)))) for value in numbers]
                split = f"{self.language.continued}\n{_TAB * 2}".join(_LINES.wrap(", ".join(values)))
                yield from self._line(self.language.list, name=name, values=split, count=str(len(values)))

    def _absent(self) -> list[str]:
        if not self.language.absent:
            return []
        each = [self.language.absent.format(argument=argument) for argument in self.function.arguments]
        return self._when(
            f" {self.language.either} ".join(each), self._line(self.language.result, value=self.number.nan)
        )

    def _unless(self, condition: Expression | None) -> list[str]:
        if condition is None:
            return []
        first = self._line(self.language.unless, condition=self.expression(condition))
        nan = self._line(self.language.result, value=self.number.nan)
        return [*first, *(_TAB + line for line in nan), *self._line(self.language.end)]

    def _when(self, condition: str, lines: list[str]) -> list[str]:
        return [
            *self._line(self.language.when, condition=condition),
            *(_TAB + line if line else line for line in lines),
            *self._line(self.language.end),
        ]

    def _branches(self) -> list[str]:
        *first, last = self.function.branches
        lines = list[str]()
        for branch in first:
            assert branch.guard is not None
            lines += self._when(self.expression(branch.guard), self._branch(branch, self.language.result))
        return [*lines, *self._unless(last.guard), *self._branch(last, self.language.last or self.language.result)]

    def _branch(self, branch: CodeBranch, result: str) -> list[str]:
        return [*self.program(branch.program), *self._wrapped(result, branch.results[self.function.result])]

    def program(self, program: Program) -> list[str]:
        lines = list[str]()
        for name, value in program:
            self.variables.append(name)
            kind = _kind(value, self.kinds)
            of_kind = self.number.types.get(kind, self.number.type)
            lines += self._wrapped(self.language.assign, value, name=name, type=of_kind)
        return lines

    def _wrapped(self, pattern: str, value: Expression, **words: str) -> list[str]:
        """Return a statement; lines break after operators, where every language knows that the next line goes on."""
        kept = _OPERATOR.sub("\N{NO-BREAK SPACE}", self.expression(value))
        text = f"{self.language.continued}\n{_TAB * 2}".join(_LINES.wrap(kept))
        return self._line(pattern, value=text.replace("\N{NO-BREAK SPACE}", " "), **words)

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
                parts = [self.expression(argument) for argument in arguments]
                if function in number.calls:
                    return number.calls[function].format(*parts)
                return f"{number.functions.format(name=function)}({', '.join(parts)})"
            case Word(_, pattern) as word:
                value = word.value_in(FORMATS[number.form])
                return number.word.format(digits=hex(value)) if pattern else str(value)
            case Negation(symbol, operand):
                return f"{symbol}{self._in_parentheses(operand)}"
            case Select(condition, met, otherwise):
                return language.select.format(
                    condition=self._chosen(condition), met=self._chosen(met), otherwise=self.expression(otherwise)
                )
            case Item(values, place):
                return language.item.format(name=values, index=place)
            case TableRow(table, index):
                return language.row.format(table=table, kernel=self.kernel.name, index=self.expression(index))
            case Column(row, index):
                return f"{row}[{index}]"
            case Operation(symbol, left, right):
                written = {AND: language.both, "//": "/"}.get(symbol, symbol)
                return f"{self._operand(left, symbol, 0)} {written} {self._operand(right, symbol, 1)}"
        raise TypeError(f"{expression!r} is no expression")

    def _chosen(self, part: Expression) -> str:
        nested = isinstance(bare(part), Select) and not self.language.straight  # which writes calls
        return self._in_parentheses(part) if nested else self.expression(part)

    def _operand(self, expression: Expression, symbol: str, side: int) -> str:
        own = bare(expression)
        if isinstance(own, Call) and own.function == "divide" and "divide" not in self.number.calls:
            own = own.arguments[0] / own.arguments[1]
        if not isinstance(own, Operation):
            return self._in_parentheses(own) if isinstance(own, Select) else self.expression(own)
        # A sum within a sum is in parentheses on either side: some languages let compilers reorder what is in none.
        # Operations on bits have all of theirs in parentheses, and comparisons those on bits and other comparisons:
        # languages differ in which of them bind more tightly.
        binding, outer = _BINDING[own.symbol], _BINDING[symbol]
        loose = (
            outer == _BITS or (symbol, self.language.both) == (AND, "&") or (outer == _COMPARISON and binding <= _BITS)
        )
        loose = loose or binding < outer + (side or binding == _SUM)
        written = self.expression(own)  # no deeper than needed: polynomials may be of degree 200
        return f"({written})" if loose else written

    def _in_parentheses(self, expression: Expression) -> str:
        written = self.expression(expression)
        own = isinstance(bare(expression), Operation | Select | Negation) or written.startswith("-")
        return f"({written})" if own else written


_COMPARISON, _BITS, _SUM, _PRODUCT = 2, 3, 4, 5
_BINDING = {
    AND: 1,
    **dict.fromkeys(("<", "<=", ">", ">=", "=="), _COMPARISON),
    **dict.fromkeys(("&", "|", "^", "<<", ">>"), _BITS),
    **dict.fromkeys("+-", _SUM),
    **dict.fromkeys(("*", "/", "//"), _PRODUCT),
}


_KINDS = {"bits": "word", "uint32": "uint32", "uint64": "uint64", "index": "index"}


def _kind(expression: Expression, known: Mapping[str, str]) -> str:
    """Return what an expression is: a "number", a "condition", a "row", or a word of some kind; "" if it is a constant.

    An operation on words of two kinds is of the first one's.
    """
    match bare(expression):
        case Operation(symbol, left, right):
            return "condition" if symbol in _CONDITIONS else _kind(left, known) or _kind(right, known)
        case Negation(_, operand):
            return _kind(operand, known)
        case Select(_, met, otherwise):
            return _kind(met, known) or _kind(otherwise, known)
        case Call(function, _):
            return _KINDS.get(function, "number")
        case TableRow():
            return "row"
        case Word():
            return ""
        case Name(name):
            return known.get(name, "number")
    return "number"
