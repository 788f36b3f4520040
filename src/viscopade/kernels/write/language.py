"""What the writer knows of a language: one object of data, in a module of `kernels.write.languages`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from fractions import Fraction

from viscopade.kernels.arithmetic import Arithmetic


def shortest(arithmetic: Arithmetic, pattern: str = "{}") -> Callable[[float], str]:
    """Return a function from a number to its literal: the shortest decimal that rounds to the number, with a point.

    The format is that of the arithmetic; the pattern has {} for the decimal: "{}f" makes a C float of it.
    """
    form = arithmetic.form

    def literal(value: float) -> str:
        """Return the literal of a number of the format."""
        # form.digits, 9 for float and 17 for double, always suffice.
        for digits in range(1, form.digits + 1):
            written = format(value, f".{digits}g")
            with suppress(ValueError):  # below the smallest normal number
                if form.nearest(Fraction(written)) == form.rounded(Fraction(value)):
                    break
        # "1e+30" -> "1.0e30"
        mantissa, e, exponent = written.replace("e+", "e").partition("e")
        return pattern.format(f"{mantissa if '.' in mantissa else mantissa + '.0'}{e}{exponent}")

    return literal


@dataclass(frozen=True)
class Number:
    """A language's numbers of one format: the type, its literals, and the functions of its library.

    Attributes
    ----------
    arithmetics : tuple of Arithmetic
        Where the functions run, and what is assumed there.
    type : str
    literal : callable
        From a number of the format to its text; integers of the program's text are numbers, too.
    suffix : str
        Of functions' names.
    functions : str
        Pattern of a library function's name, of {name}: "sqrt" in C.
    calls : mapping
        Patterns of the calls that differ, of {0} and {1}; log2 and exp2 may be those of any one base. "divide": of a
        quotient, where its operator is not to be used.
    nan : str
    coefficient : callable or None
        The text of a kernel's constants, if they are written in another way than literals.
    types : mapping
        Of what is no number: "word" (the bits of one), "uint32", "uint64", "index", "row", "condition".
    word : str
        Pattern of a word as hexadecimal {digits}.
    """

    arithmetics: tuple[Arithmetic, ...]
    type: str
    literal: Callable[[float], str]
    suffix: str = ""
    functions: str = "{name}"
    calls: Mapping[str, str] = field(default_factory=dict)
    nan: str = "nan"
    coefficient: Callable[[float], str] | None = None
    types: Mapping[str, str] = field(default_factory=dict)
    word: str = "{digits}"

    @property
    def form(self) -> str:
        """Name of the format."""
        return self.arithmetics[0].form.name

    def constant(self, value: float) -> str:
        """Return the text of a kernel's constant."""
        return (self.coefficient or self.literal)(value)


@dataclass(frozen=True)
class Runner:
    """How a program is built and run.

    Attributes
    ----------
    driver : str
        The name of its text in `drivers`, without ".jinja".
    tools : tuple of str
        Compilers or interpreters, of which the first that is there is taken; none: the interpreter that runs viscopade.
    build, start : str
        Commands, with the words {tool}, {driver}, {file} and {program} for names; "" if nothing is compiled.
    variable, package : str
        In the environment, what names the tool; what the interpreter needs.
    """

    driver: str = ""
    tools: tuple[str, ...] = ()
    build: str = ""
    start: str = ""
    variable: str = ""
    package: str = ""


@dataclass(frozen=True)
class Language:
    """A language, as patterns whose words in braces are replaced; a doubled brace is one brace.

    Attributes
    ----------
    name, ending, comment : str
        In commands; of files; what begins a line of comment.
    numbers : tuple of Number
    begin, argument, close : str
        Of a function: {name}, {Name}, which begins with a capital, {arguments}, {names}, which are the arguments
        without types, {type}, {suffix}; of each argument {argument}, {type}.
    index, between : str
        An argument that is a whole number: {argument}; what stands between arguments.
    list, item : str
        A list of constants in a function, {name}, {type}, {values}, {count}; a number of it: {name}, {index}.
    constant, assign, result : str
        Statements: {name}, {value}, {type}; {value}.
    last : str
        The result at the end of a function, if it is written in another way.
    generic, procedure : str
        The one function for all types, {name} or {Name}, of {names} and {procedures}: for each type {name}, {suffix},
        {type}.
    unless, when, end : str
        The line before a return of NaN where a {condition} does not hold, the line before statements for which it does,
        and the line after either; "" where indentation ends them.
    select : str
        A choice as an expression: {condition}, {met}, {otherwise}; both may be computed.
    locals : str
        The declaration of all variables, {names} and {type}, where it stands before the statements.
    both, either : str
        Between conditions: "and", "or".
    absent : str
        The condition that an {argument} is no number, where a language converts other types to numbers.
    continued : str
        What stands at the end of a line that goes on in the next.
    doc : str
        What begins a line of the comment before a public function, if it is not `comment`.
    block : str
        A comment, of {lines}.
    file : str
        {head}, {version}, {prelude}, {functions}, {generics}, which are all `generic` texts, {module}, {Module}: the
        module's name, and with a capital.
    version : str
        Constants, of {version} and {number}.
    kernel : str
        The functions of one kernel: {functions}, {generics}, {name}, {GUARD}, {identity}.
    macro : str
        The line that defines a function's error: {NAME}, {SUFFIX}, {error}, {rest}: its first number, and the rest.
    branchless : bool
        Whether functions are written without branches (`write.branchless`): the language is one of arrays.
    apart : int
        Lines between functions.
    prelude : str
        Names of files in `preludes` with definitions that functions need.
    helpers : str
        Names of files in `preludes` with one function each, of the file's name, for files of functions that call it.
    words : str
        The same as `prelude` for kernels with tables.
    table, row : str
        A kernel's table: {type}, {table}, {kernel}, {rows}, {columns}, {values}; a row of it: {table}, {kernel},
        {index}. "": kernels with tables cannot be written.
    call : str
        A call: {name} or {Name}, {suffix}, {arguments}.
    take, use : str
        A line that makes the file's functions known, of {module} and {ending}; a line of use, of {call}, {type} and
        {result}: a name for the value.
    material : Language or None
        The language with which a file has the functions of `kernels.material` before those of kernels; None: it has
        none.
    others : str
        A sentence of the head on what is public besides the functions of kernels.
    stem : str
        The usual name of a module.
    groups : tuple of str
        Groups of the catalogue that have a file in `exports`; the first one is the usual one.
    run : Runner
        How a program that calls the functions is built and run.
    """

    name: str
    ending: str
    comment: str
    numbers: tuple[Number, ...]
    begin: str
    argument: str
    assign: str
    result: str
    unless: str
    when: str
    index: str = "{argument}"
    between: str = ", "
    list: str = "{name} = ({values},)"
    item: str = "{name}[{index}]"
    constant: str = ""
    last: str = ""
    generic: str = ""
    procedure: str = "{name}{suffix}"
    close: str = ""
    end: str = ""
    select: str = "{condition} ? {met} : {otherwise}"
    locals: str = ""
    both: str = "&&"
    either: str = "||"
    absent: str = ""
    continued: str = ""
    doc: str = ""
    block: str = "{lines}"
    file: str = "{head}\n\n{version}\n\n{functions}\n"
    version: str = ""
    kernel: str = "{functions}"
    macro: str = ""
    branchless: bool = False
    apart: int = 1
    prelude: str = ""
    helpers: str = ""
    words: str = ""
    table: str = ""
    row: str = ""
    call: str = "{name}{suffix}({arguments})"
    take: str = ""
    use: str = "{call}"
    material: Language | None = None
    others: str = ""
    stem: str = "viscopade"
    groups: tuple[str, ...] = ("compact",)
    run: Runner = Runner()

    def number(self, form: str) -> Number:
        """Return the numbers of a format, by its name."""
        return next(number for number in self.numbers if number.form == form)

    @property
    def forms(self) -> tuple[str, ...]:
        """Names of the formats."""
        return tuple(number.form for number in self.numbers)
