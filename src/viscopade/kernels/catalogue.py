"""Requests for kernels, and the catalogue: the one list of the kernels that stand ready, each with a key of its own.

Exports, scenes, the benchmark, the calculator and the docs read it. What a kernel says of itself (coefficients, bounds,
operations, size of its table) is in its `Kernel`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

from viscopade.kernels.write.targets import LATEX_DIGITS
from viscopade.theory.law import VISCOELASTIC

if TYPE_CHECKING:
    from viscopade.kernels.kernel import Kernel

SPEEDS = ("1e-5", "5e-6", "1e-10", "full")
"""Accuracies of speed tables; that of 5e-6 is the smallest table, and needs more operations than that of 1e-5."""
TIERS = ("1e-5", "1e-10", "full")
"""Those that have a header in `exports`."""

Degrees = Sequence[tuple[int, int]]


@dataclass(frozen=True)
class Request:
    """A request to `viscopade export`; its fields are the command's options.

    A file holds all kernels that are asked for.

    Attributes
    ----------
    full : bool
        The kernels of full accuracy, in C.
    pade, minimax : sequence of (m, n)
        Degrees of Padé and of best approximants.
    accuracy : sequence of str
        Proven errors: the cheapest best approximant on the interval, or the smallest kernel for all v* >= 0.
    inverse : sequence of str
        Proven relative errors of v*(eps).
    from_speed : sequence of str
        At most one accuracy of `SPEEDS`: a kernel that needs no root, in C.
    v_star_min, v_star_max : str or None
        Interval of v* of the best approximants.
    digits : int
        Significant digits of coefficients, for LaTeX.
    """

    full: bool = False
    pade: Degrees = ()
    minimax: Degrees = ()
    accuracy: Sequence[str] = ()
    inverse: Sequence[str] = ()
    from_speed: Sequence[str] = ()
    v_star_min: str = "0"
    v_star_max: str | None = None
    digits: int = LATEX_DIGITS

    def __post_init__(self) -> None:
        """Refuse options that contradict each other; each message names the command's option."""
        # Degrees have a best approximant only on an interval. The ends of an interval mean nothing to other kernels.
        if self.minimax and self.v_star_max is None:
            raise ValueError("minimax is given without an interval: expected minimax with v_star_max (--v-star-max)")
        for name in ("v_star_min", "v_star_max"):
            if getattr(self, name) != getattr(Request, name) and not (self.minimax or self.accuracy):
                raise ValueError(
                    f"{name} is given without minimax or accuracy: expected it with one of them (--minimax, --accuracy)"
                )
        # An accuracy with a lower end alone would be that of a compact kernel, for all v* >= 0.
        if self.v_star_max is None and self.v_star_min != "0":
            raise ValueError(
                "v_star_min is given without v_star_max: expected an interval with both ends (--v-star-max)"
            )
        if len(self.from_speed) > 1:
            raise ValueError(
                f"from_speed is {', '.join(self.from_speed)}: expected one accuracy, as a file holds one kernel"
            )

    def kernels(self) -> list[Kernel]:
        """Return the requested kernels.

        Raises
        ------
        ValueError
            If one does not exist, or cannot be as accurate as asked.
        """
        # What makes kernels is loaded here: the command line reads what can be asked for, and nothing else.
        from viscopade.kernels import compact, full, inverse, quotient, speed_table

        # 1 - eps = lambda_1 v*^2 + …: [m/n] agrees to order m + n, and below order d = 2 it is 1.
        for m, n in self.pade:
            if m + n < VISCOELASTIC.d:
                raise ValueError(f"pade is {m}/{n}: expected m + n >= {VISCOELASTIC.d}, as 1 - eps begins with v*^2")
        kernels = [quotient.pade_quotient(m, n) for m, n in self.pade]
        # Without an interval an accuracy is one for all v* >= 0: the compact kernels.
        if self.v_star_max is None:
            kernels += [compact.compact(accuracy) for accuracy in self.accuracy]
        else:
            ends = self.v_star_max, self.v_star_min
            kernels += [quotient.best_fit(m, n, *ends) for m, n in self.minimax]
            kernels += [quotient.accurate_quotient(accuracy, *ends) for accuracy in self.accuracy]
        kernels += [inverse.inverse(accuracy) for accuracy in self.inverse]
        kernels += [full.full()] if self.full else []
        return [*kernels, *(speed_table.speed_table(accuracy) for accuracy in self.from_speed)]

    def command(self, target: str) -> str:
        """Return the command line that makes this request's file for a target ("c", "json", …)."""
        words = ["viscopade export", target]
        for option in fields(self):
            value = getattr(self, option.name)
            if value != option.default:
                # A switch has no value, a sequence repeats its option, and degrees are written m/n.
                values = [""] if value is True else [str(value)] if isinstance(value, (str, int)) else value
                texts = (text if isinstance(text, str) else "/".join(map(str, text)) for text in values)
                words += (f"--{option.name.replace('_', '-')} {text}".rstrip() for text in texts)
        return " ".join(words)


@dataclass(frozen=True)
class Entry:
    """A ready kernel.

    Attributes
    ----------
    group : str
        "pade", "minimax", "compact", "inverse", "full" or "speed".
    variant : str
        What was asked for: an accuracy, degrees; "" for the only kernel of its group.
    request : Request
        That for this kernel alone.
    """

    group: str
    variant: str
    request: Request

    @property
    def key(self) -> str:
        """Both as one word or two, "compact 1e-5"."""
        return f"{self.group} {self.variant}".rstrip()

    @cached_property
    def kernel(self) -> Kernel:
        """The kernel, which is made of its records."""
        (kernel,) = self.request.kernels()
        return kernel


def _entries() -> Iterator[Entry]:
    """Yield the ready kernels, in the order of exports and docs. Accuracies are round numbers, chosen by hand."""
    # The paper's [m/m+3], typed here because its module (`theory.paper`) takes long to import.
    for m, n in ((0, 3), (1, 4), (2, 5), (3, 6)):
        yield Entry("pade", f"{m}/{n}", Request(pade=((m, n),)))
    # On 0 <= v* <= 5, where eps falls from 1 to 0.006.
    for accuracy in ("1e-3", "1e-5", "1e-8"):
        yield Entry("minimax", f"{accuracy} v5", Request(accuracy=(accuracy,), v_star_max="5"))
    for accuracy in ("1e-3", "1e-5", "1e-7"):
        yield Entry("compact", accuracy, Request(accuracy=(accuracy,)))
    for accuracy in ("1e-3", "1e-5"):
        yield Entry("inverse", accuracy, Request(inverse=(accuracy,)))
    yield Entry("full", "", Request(full=True))
    for accuracy in SPEEDS:
        yield Entry("speed", accuracy, Request(from_speed=(accuracy,)))


CATALOGUE: Mapping[str, Entry] = {entry.key: entry for entry in _entries()}
"""All ready kernels by their keys."""


def group(name: str) -> tuple[Entry, ...]:
    """Return the entries of a group, "pade" or "compact", in the catalogue's order."""
    return tuple(entry for entry in CATALOGUE.values() if entry.group == name)


def group_request(name: str) -> Request:
    """Return the request for all kernels of a group, whose requests differ in the kernel alone."""
    # The fields with sequences are put together; the others are those of the first request.
    requests, lists = [entry.request for entry in group(name)], dict[str, Any]()
    for field in fields(Request):
        if isinstance(field.default, tuple):
            lists[field.name] = tuple(value for request in requests for value in getattr(request, field.name))
    return replace(requests[0], **lists)


def kernel(key: str) -> Kernel:
    """Return the kernel of a key of `CATALOGUE`, "compact 1e-5".

    Raises
    ------
    ValueError
        If there is none.
    """
    if key not in CATALOGUE:
        raise ValueError(f"the kernel asked for is {key!r}: expected {', '.join(CATALOGUE)}")
    return CATALOGUE[key].kernel
