"""Lines, words and variables of an input of LAMMPS: `&`, `${name}`, `$x`, `$(formula)`, `v_name`, quotes, comments.

    variable e index 0.5              # a text, the first of a list
    variable k equal 4/3*v_E          # a formula, computed where it is used
    variable w string "hertz $e"      # a text; quotes keep what is in them
    timestep $(0.01*sqrt(PI))         # a formula, computed once

The rules are those of `Input::parse`, `Input::substitute` and `Variable::evaluate` of commit 07b704c. Variables of
other styles, such as loop, python, getenv and shell, have no value here, and nothing is run.
"""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple

# Most characters of a line with its variables. A line of an honest file has some hundreds; the limit stops strings that
# double in each line.
_LONGEST = 100_000
# Stands around the index of a text in `Variables._missing`, in place of a variable whose value nothing says. A file of
# text does not have the character NUL.
_MARK = "\0"

_SPECIAL = re.compile(r"[$\"'#]")  # without one of these characters a line is its own words
# A regular expression cannot count parentheses: a formula between $( and ) has at most eight levels, chosen
# by hand.
_PARENTHESES = "[^()]*+"
for _ in range(8):
    _PARENTHESES = rf"(?:[^()]++|\({_PARENTHESES}\))*+"
# What `Variables._substitute` replaces, or leaves: a quote, a comment, ${name}, $x and $(formula).
_TOKEN = re.compile(
    r'"""(?:.*?)"""|"[^"]*"|\'[^\']*\'|#[^\n]*|\$\{(?P<name>[^}]*)\}|\$(?P<letter>\w)'
    rf"|\$\((?P<formula>{_PARENTHESES})\)",
    re.DOTALL,
)
# A word: in triple, double or single quotes, or up to the next blank.
_WORD = re.compile(r'"""(.*?)"""|"([^"]*)"|\'([^\']*)\'|(\S+)', re.DOTALL)
# A decimal. Its exponent has at most two digits: so products of three numbers are finite doubles, as a rule.
_NUMBER = re.compile(r"[-+]?(?:[0-9]+[.]?[0-9]*|[.][0-9]+)(?:[eE][-+]?[0-9]{1,2})?")
# A token of a formula: a number, a name (with indices), an operator of two characters, or a single character.
_FORMULA = re.compile(r"\s*((?:\d+[.]?\d*|[.]\d+)(?:[eE][-+]?\d+)?|\w+(?:\[[^]]*\])*|&&|\|\||\|\^|[<>=!]=|\S)")

_OPERATORS: Mapping[str, tuple[int, Callable[[float, float], float]]] = {
    "||": (1, lambda x, y: x != 0 or y != 0),
    "|^": (1, lambda x, y: (x != 0) != (y != 0)),
    "&&": (2, lambda x, y: x != 0 and y != 0),
    "==": (3, operator.eq),
    "!=": (3, operator.ne),
    "<": (4, operator.lt),
    "<=": (4, operator.le),
    ">": (4, operator.gt),
    ">=": (4, operator.ge),
    "+": (5, operator.add),
    "-": (5, operator.sub),
    "*": (6, operator.mul),
    "/": (6, operator.truediv),
    "%": (6, math.fmod),
    "^": (7, math.pow),
}
"""Precedence and function. The order of precedences is that of `Variable::evaluate`; their size has no meaning. All
operators group from the left, and a sign binds more strongly than a power: -2^2 is 4."""
_FUNCTIONS: Mapping[str, Callable[..., float]] = {
    **{name: getattr(math, name) for name in ("sqrt", "exp", "sin", "cos", "tan", "atan", "ceil", "floor")},
    "abs": abs,
    "ln": math.log,
    "log": math.log10,
    "round": lambda x: math.floor(x + 0.5),
    "ternary": lambda condition, x, y: x if condition else y,
}


def commands(text: str) -> Iterator[tuple[int, str]]:
    """Yield the number of the first line and the text of each command of a file.

    An & at the end of a line continues a command, and so does a triple quote that is not closed.
    """
    lines = enumerate(text.split("\n"), 1)
    for number, line in lines:
        if "&" not in line and '"""' not in line:
            yield number, line
            continue
        # An odd number of triple quotes is one that is open.
        command_lines, quotes = [line], line.count('"""')
        while quotes % 2 or command_lines[-1].rstrip().endswith("&"):
            _, following = next(lines, (0, None))
            if following is None:
                break
            # The & goes, but in quotes, where it belongs to the text.
            if not quotes % 2:
                command_lines[-1] = command_lines[-1].rstrip()[:-1]
            command_lines.append(following)
            quotes += following.count('"""')
        yield number, " ".join(command_lines)


class MissingValue(Exception):
    """A value that a command needs and the file does not say; its arguments are texts for `Deck.missing`."""


class Variable(NamedTuple):
    """A definition: the style, the text or formula, and the line in which it stands."""

    style: str
    text: str
    line: int


class Variables:
    """The variables of an input.

    Attributes
    ----------
    options : mapping of str to str
        Texts that replace all definitions in the file.
    defined : dict of str to Variable
    names : set of str
        Those that the file defines or uses.
    used : set of str
        Those that the line uses whose words were taken last.
    """

    def __init__(self, options: Mapping[str, str]) -> None:
        """Begin without variables of the file; `options` are texts by name, from the command line."""
        self.options = options
        self.defined: dict[str, Variable] = {}
        self.names: set[str] = set()
        self.used: set[str] = set()
        self._missing: list[str] = []  # what is missing, in words; marks in a line refer to it by index
        self._values: dict[str, str] = {}  # texts of variables of style equal in one line: each is computed once
        self._formulas: list[str] = []  # names of variables whose formulas are being computed, the innermost last

    def define(self, name: str, style: str, text: str, line: int) -> None:
        """Take a command `variable NAME STYLE TEXT`, which stands in a line of the file."""
        self.names.add(name)
        # A string takes the values of its variables at once, in quotes too (`Variable::set`).
        text = self._with_values(text) if style == "string" else text
        if style == "delete":
            self.defined.pop(name, None)
        elif style != "index" or name not in self.defined:  # the first definition of an index stays
            self.defined[name] = Variable(style, text, line)

    def words(self, text: str) -> list[str]:
        """Return the words of the line `text`, with the values of variables outside quotes and without a comment."""
        # `used` and `_values` are those of one line.
        self.used, self._values = set(), {}
        if not _SPECIAL.search(text):
            return text.split()
        text = self._with_values(text)
        # Of the four groups of `_WORD` one has the word; all are empty for "".
        words = [next(filter(None, match), "") for match in _WORD.findall(text)]
        # A quote that is still there began a word and was not closed.
        if any(word.startswith(('"', "'")) for word in words):
            raise ValueError("a quote has no end: expected a second one")
        return words

    def _with_values(self, text: str) -> str:
        """Return `text` with the values of variables outside quotes, refused if it gets longer than `_LONGEST`."""
        text = _TOKEN.sub(self._substitute, text)
        if len(text) > _LONGEST:
            raise ValueError(f"the line has {len(text)} characters: expected at most {_LONGEST}")
        return text

    def _substitute(self, token: re.Match[str]) -> str:
        """Return the text in place of `token`, a match of `_TOKEN`: a value, "" for a comment, or a quote itself."""
        name, formula = token["name"] or token["letter"], token["formula"]
        if name is None and formula is None:
            return "" if token[0].startswith("#") else token[0]
        try:
            if name:
                return self.value(name)
            # A format may follow: $(v_x/2:%.3f). Width and precision have few digits, so that the text stays short.
            # Without a format a number has 15 digits, as many as a double always keeps.
            formula, percent, style = formula.partition(":%")
            if percent and not re.fullmatch(r"[0-9 ]{0,3}[.][0-9]{1,2}[efgEFG]", style):
                raise ValueError(f"the format is %{style}: expected one such as %.6g")
            return f"%{style or '.15g'}" % self.compute(formula)
        except MissingValue as missing:
            # It matters only if a command takes a number from here.
            self._missing += missing.args
            return f"{_MARK}{len(self._missing) - 1}{_MARK}"

    def require_values(self, *texts: str) -> None:
        """Raise MissingValue if texts hold variables whose values nothing says."""
        # Between two marks stands the index of the missing text: every second part of the split.
        marks = [int(mark) for text in texts for mark in text.split(_MARK)[1::2]]
        if marks:
            raise MissingValue(*(self._missing[mark] for mark in marks))

    def number(self, word: str) -> float:
        """Return the number that `word` says: a decimal such as 1e-5, or the variable of `v_name`."""
        self.require_values(word)
        if word.startswith("v_"):
            return self.number(self.value(word[2:]))
        if not _NUMBER.fullmatch(word):
            raise ValueError(f"the number is {word!r}: expected one such as 1e-5")
        return float(word)

    def value(self, name: str) -> str:
        """Return the text of the variable called `name`: that of an option, of an index or string, or of a formula.

        Raises
        ------
        MissingValue
            If nothing says it: it is not defined, or its style has a value in a run only.
        ValueError
            If its formula refers to itself.
        """
        self.names.add(name)
        self.used.add(name)
        option = f"(--variable {name}=VALUE)"
        if name in self.options:
            return self.options[name]
        if name not in self.defined:
            raise MissingValue(f"the value of the variable {name} {option}")
        style, text, line = self.defined[name]
        if style in ("index", "string"):
            return text
        if style != "equal":
            raise MissingValue(f"the value of the variable {name}, of style {style} in line {line} {option}")
        if name in self._formulas:
            raise ValueError(f"the variable {name} refers to itself")
        # A formula is computed where it is used, with 15 digits, as many as a double always keeps.
        if name not in self._values:
            self._formulas.append(name)
            try:
                self._values[name] = f"{self.compute(text):.15g}"
            finally:
                self._formulas.pop()
        return self._values[name]

    def compute(self, formula: str) -> float:
        """Return the value of `formula`, by LAMMPS's rules of precedence.

        Raises
        ------
        MissingValue
            If it has a name, such as of a compute, whose value is there in a run only.
        ValueError
            If it is no formula.
        """
        self.require_values(formula)
        # The tokens in reverse order: the next one is the last of the list.
        tokens = _FORMULA.findall(formula)[::-1]
        # Messages quote 60 characters of a formula, so that they stay in one line.
        refusal = ValueError(f"{formula[:60]!r} is no formula")

        def operand() -> float:
            """Take the tokens of an operand, and return its value: a number, or what a sign or parenthesis begins."""
            token = tokens.pop()
            if token == "-":
                return -operand()
            if token == "!":
                return float(not operand())
            if token == "(":
                return arguments()[0]
            if token[0].isdigit() or token[0] == ".":
                return float(token)
            if token == "PI":
                return math.pi
            if token.startswith("v_"):
                return self.number(token)
            if token in _FUNCTIONS and tokens[-1:] == ["("]:
                tokens.pop()
                return _FUNCTIONS[token](*arguments())
            if not token[0].isalpha():
                raise refusal
            # Any other name, such as step or c_temp, has a value in a run only.
            name = self._formulas[-1] if self._formulas else ""
            option = f"the variable {name} (--variable {name}=VALUE)" if name else formula
            raise MissingValue(f"the value of {option}: {token} is known only in a run")

        def arguments() -> list[float]:
            """Take expressions with commas between, up to the closing parenthesis, and return their values."""
            values = [expression(0)]
            while tokens[-1] == ",":
                tokens.pop()
                values.append(expression(0))
            if tokens.pop() != ")":
                raise refusal
            return values

        def expression(outer_precedence: int) -> float:
            """Take an operand and all operators that bind more strongly than one before it, and return the value."""
            # Precedence climbing. An operator of equal precedence ends the expression: so operators group from the
            # left.
            value = operand()
            while tokens and tokens[-1] in _OPERATORS and _OPERATORS[tokens[-1]][0] > outer_precedence:
                precedence, function = _OPERATORS[tokens.pop()]
                value = float(function(value, expression(precedence)))
            return value

        # 0 is below the precedence of all operators. An empty list of tokens, or a wrong number of arguments, is an
        # error.
        try:
            value = expression(0)
        except RecursionError:
            raise ValueError(f"{formula[:60]!r} has too many levels") from None
        except (IndexError, TypeError):
            raise refusal from None
        if tokens:
            raise refusal
        return value
