"""Long loops announce themselves; who wants to show that installs a tracker (the command line does)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from contextvars import ContextVar
from typing import TypeVar

Item = TypeVar("Item")
Tracker = Callable[[Sequence[int], str], Iterable[int]]

_tracker: ContextVar[Tracker | None] = ContextVar("viscopade_progress", default=None)


def track(steps: Sequence[int], description: str) -> Iterable[int]:
    """Iterate over `steps`, through the installed tracker if there is one."""
    tracker = _tracker.get()
    return steps if tracker is None else tracker(steps, description)


@contextmanager
def shown_by(tracker: Tracker) -> Iterator[None]:
    """Install `tracker` for the duration of a `with` block."""
    token = _tracker.set(tracker)
    try:
        yield
    finally:
        _tracker.reset(token)


def quietly() -> AbstractContextManager[None]:
    """Show nothing for the duration of a `with` block: the steps of a step."""
    return shown_by(lambda steps, _: steps)
