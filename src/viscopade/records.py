"""Reader of nested data from a file; an error message is one line with the file, the key and the expected value."""

from __future__ import annotations

import reprlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Self, TypeVar

from viscopade.arguments import spelling_advice

Word = TypeVar("Word", bound=str)

MOST = 2**53  # largest count: a double holds every integer up to it exactly


@dataclass(frozen=True)
class Node:
    """A value in a file, with its file and key for messages.

    Attributes
    ----------
    source : str
        The file's name.
    key : str
        Place of the value in the file, such as "material.ice"; "" for the whole file.
    value : object
    """

    source: str
    key: str
    value: object

    def refuse(self, accepted: str) -> ValueError:
        """Return the exception that names the file, the key, the value and the expected values."""
        where = f"{self.key} is" if self.key else "it contains"
        return ValueError(
            f"{self.source}: {where} {_shown(self.value)}: expected {accepted}{spelling_advice(self.value)}"
        )

    def _at(self, name: str, value: object) -> Self:
        """Return the node of a part, whose key is this one's and the part's name: "material.ice"."""
        return type(self)(self.source, f"{self.key}.{name}".removeprefix("."), value)

    @property
    def _table(self) -> Mapping[str, object]:
        """The parts by name, if the value is a table of TOML or an object of JSON."""
        if not isinstance(self.value, Mapping):
            raise self.refuse("an object")
        return self.value

    def __getitem__(self, name: str) -> Self:
        if name not in self._table:
            raise ValueError(f"{self.source}: {self._at(name, None).key} is missing")
        return self._at(name, self._table[name])

    def need(self, name: str, accepted: str) -> Self:
        """Return a part; if it is missing, raise ValueError with the expected values."""
        if name not in self._table:
            raise ValueError(f"{self.source}: {self._at(name, None).key} is missing: expected {accepted}")
        return self[name]

    def get(self, name: str) -> Self | None:
        """Return a part, or None if it is missing."""
        return self[name] if name in self._table else None

    def has(self, name: str) -> bool:
        """Return whether a part of this name exists."""
        return isinstance(self.value, Mapping) and name in self.value

    def only(self, *names: str, inside: Mapping[str, Sequence[str]] | None = None) -> Self:
        """Return this node, after a check that its parts have no other names than `names`.

        `inside` has the names of parts of its parts: a name that stands one level too high is told where it belongs.
        """
        for name in self._table:
            if name not in names:
                where = f"{self.key}." if self.key else ""
                near = [f"{part}.{name}" for part, inner_names in (inside or {}).items() if name in inner_names]
                hint = f"did you mean {' or '.join(near)}?" if near else f"expected {', '.join(names)}"
                raise ValueError(f"{self.source}: {where}{_short(name)} is not known: {hint}")
        return self

    def parts(self) -> Iterator[tuple[str, Self]]:
        """Yield the names and values of all parts."""
        for name, value in self._table.items():
            yield name, self._at(name, value)

    def items(self) -> list[Self]:
        """Return the elements of a list."""
        if not isinstance(self.value, list | tuple):
            raise self.refuse("a list")
        return [type(self)(self.source, f"{self.key}[{i}]", value) for i, value in enumerate(self.value)]

    def text(self) -> str:
        """Return a line of text."""
        if not isinstance(self.value, str) or not self.value.isprintable() or not self.value.strip():
            raise self.refuse("one line of text")
        return self.value

    def choice(self, accepted: Sequence[Word]) -> Word:
        """Return one of several words."""
        for word in accepted:
            if self.value == word:
                return word
        raise self.refuse(", ".join(accepted))

    def within(self, accepted: str, holds: Callable[[float], bool]) -> float:
        """Return a number for which `holds` is true; `accepted` describes this condition in the message."""
        # True is an integer for Python, and no number here. An integer may be beyond the doubles.
        value = self.value
        if isinstance(value, bool) or not isinstance(value, int | float) or not holds(value):
            raise self.refuse(accepted)
        try:
            return float(value)
        except OverflowError:
            raise self.refuse(accepted) from None

    def count(self) -> int:
        """Return a positive integer that a double holds exactly."""
        if isinstance(self.value, bool) or not isinstance(self.value, int) or not 1 <= self.value <= MOST:
            raise self.refuse(f"a positive integer up to {MOST}")
        return self.value

    def flag(self) -> bool:
        """Return true or false."""
        if not isinstance(self.value, bool):
            raise self.refuse("true or false")
        return self.value


def _shown(value: object) -> str:
    """Return a value in one line, abbreviated."""
    try:
        return " ".join(reprlib.repr(value).split())
    except ValueError:  # Python does not write integers of so many digits (TOML can, in hexadecimal)
        return "or contains an integer of thousands of digits"


def _short(name: object) -> str:
    """Return a name in one line, with at most 40 characters (a choice): it is a key that the user invented."""
    text = str(name) if str(name).isprintable() else repr(name)
    return text if len(text) <= 40 else text[:40] + "…"
