"""The catalogue: the one list of the kernels that stand ready, each with a key of its own.

Exports, scenes, the benchmark, the calculator and the docs read it. What a kernel says of itself (coefficients, bounds,
operations, size of its table) is in its `Kernel`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

    from viscopade.kernels.kernel import Kernel

SPEEDS = ("1e-5", "5e-6", "1e-10", "full")
"""Accuracies of speed tables; that of 5e-6 is the smallest table, and needs more operations than that of 1e-5."""
TIERS = ("1e-5", "1e-10", "full")
"""Those that have a header in `exports`."""


@dataclass(frozen=True)
class Entry:
    """A ready kernel.

    Attributes
    ----------
    group : str
        "pade", "minimax", "compact", "inverse", "full" or "speed".
    asked : str
        What was asked for: an accuracy, degrees; "" for the only kernel of its group.
    options : mapping
        The options of `viscopade export` that ask for it, as `requests.Request` has them.
    make : callable
        Reads the kernel's records.
    """

    group: str
    asked: str
    options: Mapping[str, Any]
    make: Callable[[], Kernel]

    @property
    def key(self) -> str:
        """Both as one word or two, "compact 1e-5"."""
        return f"{self.group} {self.asked}".rstrip()

    @cached_property
    def kernel(self) -> Kernel:
        """The kernel."""
        return self.make()


# Makers import what they need when they are called: the command line reads the keys, and nothing else.


def _pade(m: int, n: int) -> Kernel:
    from viscopade.kernels import quotient

    return quotient.pade_quotient(m, n)


def _minimax(accuracy: str, v_star_max: str) -> Kernel:
    from viscopade.kernels import quotient

    return quotient.accurate_quotient(accuracy, v_star_max)


def _compact(accuracy: str) -> Kernel:
    from viscopade.kernels import compact

    return compact.compact(accuracy)


def _inverse(accuracy: str) -> Kernel:
    from viscopade.kernels import inverse

    return inverse.inverse(accuracy)


def _full() -> Kernel:
    from viscopade.kernels import full

    return full.full()


def _speed(accuracy: str) -> Kernel:
    from viscopade.kernels import speed_table

    return speed_table.speed_table(accuracy)


def _entries() -> Iterator[Entry]:
    for m, n in ((0, 3), (1, 4), (2, 5), (3, 6)):  # the paper's; its module takes long to import
        yield Entry("pade", f"{m}/{n}", {"pade": ((m, n),)}, partial(_pade, m, n))
    for accuracy in ("1e-3", "1e-5", "1e-8"):
        options = {"accuracy": (accuracy,), "v_star_max": "5"}
        yield Entry("minimax", f"{accuracy} v5", options, partial(_minimax, accuracy, "5"))
    for accuracy in ("1e-3", "1e-5", "1e-7"):
        yield Entry("compact", accuracy, {"accuracy": (accuracy,)}, partial(_compact, accuracy))
    for accuracy in ("1e-3", "1e-5"):
        yield Entry("inverse", accuracy, {"inverse": (accuracy,)}, partial(_inverse, accuracy))
    yield Entry("full", "", {"full": True}, _full)
    for accuracy in SPEEDS:
        yield Entry("speed", accuracy, {"from_speed": (accuracy,)}, partial(_speed, accuracy))


CATALOGUE: Mapping[str, Entry] = {entry.key: entry for entry in _entries()}
"""All ready kernels by their keys."""


def group(name: str) -> tuple[Entry, ...]:
    """Return the entries of a group, in order."""
    return tuple(entry for entry in CATALOGUE.values() if entry.group == name)


def kernel(key: str) -> Kernel:
    """Return the kernel of a key.

    Raises
    ------
    ValueError
        If there is none.
    """
    if key not in CATALOGUE:
        raise ValueError(f"the kernel asked for is {key!r}: expected {', '.join(CATALOGUE)}")
    return CATALOGUE[key].kernel
