"""Progress of long loops, shown by an installed tracker (the command line installs one)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from contextvars import ContextVar
from typing import TypeVar

Item = TypeVar("Item")
Cost = Callable[[int], float]
Tracker = Callable[[Sequence[int], str, Cost | None], Iterable[int]]

_tracker: ContextVar[Tracker | None] = ContextVar("viscopade_progress", default=None)


def track(steps: Sequence[int], description: str, cost: Cost | None = None) -> Iterable[int]:
    """Iterate over `steps` through the installed tracker, if there is one.

    `cost` is a step's duration in any unit. Without it durations are not known, and no remaining time is estimated.
    """
    tracker = _tracker.get()
    return steps if tracker is None else tracker(steps, description, cost)


@contextmanager
def use_tracker(tracker: Tracker) -> Iterator[None]:
    """Show progress by `tracker` for the duration of a `with` block."""
    # The token brings back the tracker of the block around this one.
    token = _tracker.set(tracker)
    try:
        yield
    finally:
        _tracker.reset(token)


def quietly() -> AbstractContextManager[None]:
    """Show no progress for the duration of a `with` block, for loops inside a step."""
    return use_tracker(lambda steps, *_: steps)
