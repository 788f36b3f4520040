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

_LONGEST = 100_000  # characters of a line with its variables
_MARK = "\0"  # around the number of a text in `Variables.unsaid`, in place of a variable that nothing says

_SPECIAL = re.compile(r"[$\"'#]")
# A formula between $( and ) has at most eight levels of parentheses.
_PARENTHESES = "[^()]*+"
for _ in range(8):
    _PARENTHESES = rf"(?:[^()]++|\({_PARENTHESES}\))*+"
_TOKEN = re.compile(
    r'"""(?:.*?)"""|"[^"]*"|\'[^\']*\'|#[^\n]*|\$\{(?P<name>[^}]*)\}|\$(?P<letter>\w)'
    rf"|\$\((?P<formula>{_PARENTHESES})\)",
    re.DOTALL,
)
_WORD = re.compile(r'"""(.*?)"""|"([^"]*)"|\'([^\']*)\'|(\S+)', re.DOTALL)
_NUMBER = re.compile(r"[-+]?(?:[0-9]+[.]?[0-9]*|[.][0-9]+)(?:[eE][-+]?[0-9]{1,2})?")
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
"""Precedence and function. All group from the left, and a sign binds more strongly than a power: -2^2 is 4."""
_FUNCTIONS: Mapping[str, Callable[..., float]] = {
    **{name: getattr(math, name) for name in ("sqrt", "exp", "sin", "cos", "tan", "atan", "ceil", "floor")},
    "abs": abs,
    "ln": math.log,
    "log": math.log10,
    "round": lambda x: math.floor(x + 0.5),
    "ternary": lambda condition, x, y: x if condition else y,
}


def commands(text: str) -> Iterator[tuple[int, str]]:
    """Yield number and text of each command, which & and triple quotes continue in the next line."""
    lines = enumerate(text.split("\n"), 1)
    for number, line in lines:
        if "&" not in line and '"""' not in line:
            yield number, line
            continue
        parts, quotes = [line], line.count('"""')
        while quotes % 2 or parts[-1].rstrip().endswith("&"):
            _, following = next(lines, (0, None))
            if following is None:
                break
            if not quotes % 2:
                parts[-1] = parts[-1].rstrip()[:-1]
            parts.append(following)
            quotes += following.count('"""')
        yield number, " ".join(parts)


class Unsaid(Exception):
    """What a command needs and the file does not say, in words for `Deck.missing`."""


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
        self.options = options
        self.defined: dict[str, Variable] = {}
        self.names: set[str] = set()
        self.used: set[str] = set()
        self._unsaid: list[str] = []
        self._values: dict[str, str] = {}  # of formulas, in one line
        self._formulas: list[str] = []  # names of those that are being computed

    def define(self, name: str, style: str, text: str, line: int) -> None:
        """Take a command `variable`."""
        self.names.add(name)
        # A string takes the values of its variables at once, in quotes too (`Variable::set`).
        text = self._with_values(text) if style == "string" else text
        if style == "delete":
            self.defined.pop(name, None)
        elif style != "index" or name not in self.defined:  # the first definition of an index stays
            self.defined[name] = Variable(style, text, line)

    def words(self, text: str) -> list[str]:
        """Return the words of a line, with the values of variables outside quotes."""
        self.used, self._values = set(), {}
        if not _SPECIAL.search(text):
            return text.split()
        text = self._with_values(text)
        words = [next(filter(None, match), "") for match in _WORD.findall(text)]
        if any(word.startswith(('"', "'")) for word in words):
            raise ValueError("a quote has no end: expected a second one")
        return words

    def _with_values(self, text: str) -> str:
        """Return a text with the values of variables outside quotes."""
        text = _TOKEN.sub(self._substitute, text)
        if len(text) > _LONGEST:
            raise ValueError(f"the line has {len(text)} characters: expected at most {_LONGEST}")
        return text

    def _substitute(self, token: re.Match[str]) -> str:
        """Return the text in place of a variable, a formula, a comment or a quote."""
        name, formula = token["name"] or token["letter"], token["formula"]
        if name is None and formula is None:
            return "" if token[0].startswith("#") else token[0]
        try:
            if name:
                return self.value(name)
            # A format may follow: $(v_x/2:%.3f).
            formula, percent, style = formula.partition(":%")
            if percent and not re.fullmatch(r"[0-9 ]{0,3}[.][0-9]{1,2}[efgEFG]", style):
                raise ValueError(f"the format is %{style}: expected one such as %.6g")
            return f"%{style or '.15g'}" % self.compute(formula)
        except Unsaid as unsaid:
            # It matters only if a command takes a number from here.
            self._unsaid += unsaid.args
            return f"{_MARK}{len(self._unsaid) - 1}{_MARK}"

    def require_said(self, *texts: str) -> None:
        """Raise Unsaid if texts hold variables that nothing says."""
        marks = [int(mark) for text in texts for mark in text.split(_MARK)[1::2]]
        if marks:
            raise Unsaid(*(self._unsaid[mark] for mark in marks))

    def number(self, word: str) -> float:
        """Return the number that a word says, itself or as `v_name`."""
        self.require_said(word)
        if word.startswith("v_"):
            return self.number(self.value(word[2:]))
        if not _NUMBER.fullmatch(word):
            raise ValueError(f"the number is {word!r}: expected one such as 1e-5")
        return float(word)

    def value(self, name: str) -> str:
        """Return the text of a variable."""
        self.names.add(name)
        self.used.add(name)
        option = f"(--variable {name}=VALUE)"
        if name in self.options:
            return self.options[name]
        if name not in self.defined:
            raise Unsaid(f"the value of the variable {name} {option}")
        style, text, line = self.defined[name]
        if style in ("index", "string"):
            return text
        if style != "equal":
            raise Unsaid(f"the value of the variable {name}, of style {style} in line {line} {option}")
        if name in self._formulas:
            raise ValueError(f"the variable {name} refers to itself")
        if name not in self._values:
            self._formulas.append(name)
            try:
                self._values[name] = f"{self.compute(text):.15g}"
            finally:
                self._formulas.pop()
        return self._values[name]

    def compute(self, formula: str) -> float:
        """Return the value of a formula."""
        self.require_said(formula)
        tokens = _FORMULA.findall(formula)[::-1]
        refusal = ValueError(f"{formula[:60]!r} is no formula")

        def operand() -> float:
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
            name = self._formulas[-1] if self._formulas else ""
            option = f"the variable {name} (--variable {name}=VALUE)" if name else formula
            raise Unsaid(f"the value of {option}: {token} is known only in a run")

        def arguments() -> list[float]:
            values = [expression(0)]
            while tokens[-1] == ",":
                tokens.pop()
                values.append(expression(0))
            if tokens.pop() != ")":
                raise refusal
            return values

        def expression(least: int) -> float:
            value = operand()
            while tokens and tokens[-1] in _OPERATORS and _OPERATORS[tokens[-1]][0] > least:
                precedence, function = _OPERATORS[tokens.pop()]
                value = float(function(value, expression(precedence)))
            return value

        try:
            value = expression(0)
        except RecursionError:
            raise ValueError(f"{formula[:60]!r} has too many levels") from None
        except (IndexError, TypeError):
            raise refusal from None
        if tokens:
            raise refusal
        return value
