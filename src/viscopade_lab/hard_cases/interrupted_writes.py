"""Hard case: writing that is interrupted, fails, or is done by several at once; no file may be lost or half-written."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any

from viscopade.progress import track
from viscopade_lab.hard_cases.finding import Case, Cell, Chart, Check, Outcome, Table, curve
from viscopade_lab.hard_cases.interruption import DONE, REFUSED, STOPPED, TARGETS

KILLS = ("SIGKILL", "SIGTERM", "SIGKILL, finer")
INTERRUPTS = ("SIGINT", "SIGINT, finer")
ERRORS = ("failing call", "full")
TOGETHER = ("together", "together, one killed")
NAMES = {
    "SIGKILL": "killed (SIGKILL) at every call",
    "SIGTERM": "terminated (SIGTERM) at calls",
    "SIGINT": "interrupted (SIGINT) at every call",
    "failing call": "every call fails once (no space left)",
    "full": "no file may grow beyond a limit",
    "together": "2 to 4 runs write the same files at once",
    "together, one killed": "the same, and one of them is killed",
    "SIGKILL, finer": "killed (SIGKILL) at instructions of the interpreter",
    "SIGINT, finer": "interrupted (SIGINT) at instructions of the interpreter",
}


def found(thorough: bool) -> list[dict[str, Any]]:
    """Return what every experiment left; they are made in a process of its own, which forks."""
    words = [sys.executable, "-m", "viscopade_lab.hard_cases.interruption", "thorough" if thorough else "quick"]
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}  # who forks has no threads
    run = subprocess.run(
        words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=environment, check=True, text=True
    )
    return [json.loads(line) for line in run.stdout.splitlines()]


def _run(thorough: bool) -> Outcome:
    (all_found,) = [found(thorough) for _ in track(range(1), "interrupted writes")]
    return assess(all_found)


def assess(left: Sequence[dict[str, Any]]) -> Outcome:
    """Return what is left on the disk says."""
    killed, interrupted, errors, together = (_of(left, kinds) for kinds in (KILLS, INTERRUPTS, ERRORS, TOGETHER))
    later = _of(left, ["later run"])
    most = max((entry["temporary"] for entry in killed), default=0)
    half, lost = (_sum([*killed, *interrupted, *errors], key) for key in ("half", "lost"))
    summary = (
        f"The writer replaced {len(TARGETS)} files. It was killed at {len(killed)} steps, interrupted at "
        f"{len(interrupted)}, and stopped by an error at {len(errors)}: {half} files were half-written, {lost} lost. "
        f"{len(together)} times, 2 to 4 runs wrote the same files at once: {_sum(together, 'half')} were not a whole "
        f"one. A kill left up to {most} temporary files; a later run removed those two days old in "
        f"{sum(entry['stale'] == 0 for entry in later)} of {len(later)} cases, and the fresh ones, "
        f"which may be those of a living run, in {sum(entry['stolen'] > 0 for entry in later)}."
    )
    return Outcome(summary, (_table(left),), tuple(_charts(left)), checks(left))


def checks(left: Sequence[dict[str, Any]]) -> tuple[Check, ...]:
    """Return what must hold: every limit is 0 but for one, which says that the experiment sees what it should."""
    killed, interrupted, errors, together = (_of(left, kinds) for kinds in (KILLS, INTERRUPTS, ERRORS, TOGETHER))
    later = _of(left, ["later run"])
    alone = [*killed, *interrupted, *errors]
    all_states = {entry["new"] for entry in killed}
    wrong_end = sum(entry["end"] not in (DONE, REFUSED) for entry in errors)
    return (
        Check("targets that were neither the whole old nor the whole new file", _sum(alone, "half"), "==", 0),
        Check("old files that were lost", _sum(alone, "lost"), "==", 0),
        Check(
            "numbers of new files that were seen after a kill, from none to all",
            len(all_states),
            "==",
            len(TARGETS) + 1,
        ),
        Check("failing calls that ended in anything but success or one error of the writer", wrong_end, "==", 0),
        Check("temporary files left after an error", _sum(errors, "temporary"), "==", 0),
        Check("temporary files left after an interruption from the keyboard", _sum(interrupted, "temporary"), "==", 0),
        Check("interruptions that did not reach the caller", _not(interrupted, STOPPED), "==", 0),
        Check(
            "files that were not a whole one of one run, during or after runs at once", _sum(together, "half"), "==", 0
        ),
        Check("files lost by runs at once", _sum(_of(left, ["together"]), "lost"), "==", 0),
        Check("runs that failed because of another one", _sum(together, "failed"), "==", 0),
        Check("temporary files left by runs at once", _sum(together, "temporary"), "==", 0),
        Check("files that a run after a kill did not write", _sum(later, "unwritten"), "==", 0),
        Check("temporary files of killed runs, two days old, that a run left", _sum(later, "stale"), "==", 0),
        Check("fresh temporary files, maybe of a living run, that a run removed", _sum(later, "stolen"), "==", 0),
    )


def _of(left: Iterable[dict[str, Any]], kinds: Sequence[str]) -> list[dict[str, Any]]:
    return [entry for entry in left if entry["how"] in kinds]


def _sum(entries: Iterable[dict[str, Any]], key: str) -> int:
    return sum(entry[key] for entry in entries)


def _not(entries: Iterable[dict[str, Any]], end: int) -> int:
    """Return how many ended otherwise, but for those that had written everything before."""
    return sum(entry["end"] != end and entry["new"] < len(TARGETS) for entry in entries)


def _table(left: Sequence[dict[str, Any]]) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for kind, name in NAMES.items():
        here = _of(left, [kind])
        if not here:
            continue
        if kind in TOGETHER:
            states = ["", "", ""]
        else:
            number = Counter((entry["new"] > 0) + (entry["new"] == len(TARGETS)) for entry in here)
            states = [str(number[i]) for i in range(3)]
        lost = _sum(here, "lost") if kind != "together, one killed" else 0
        rows.append((name, len(here), *states, _sum(here, "half"), lost, _most(here, kind)))
    header = (
        "what happens",
        "times",
        "all old",
        "some new",
        "all new",
        "half-written",
        "lost",
        "most temporary files left",
    )
    return Table(f"What {len(TARGETS)} files are afterwards", header, tuple(rows))


def _most(entries: Sequence[dict[str, Any]], kind: str) -> str:
    if kind == "together, one killed":
        return "not counted"
    return str(max(entry["temporary"] for entry in entries))


def _charts(left: Sequence[dict[str, Any]]) -> Iterable[Chart]:
    whole = f"of {len(TARGETS)} files"
    words = {"new": "new", "half": "half-written", "lost": "lost", "temporary": "temporary files left"}
    for title, kind, keys in (
        ("Killed at every call", "SIGKILL", ("new", "temporary", "half", "lost")),
        ("Every call fails once", "failing call", ("new", "temporary", "half", "lost")),
    ):
        here = _of(left, [kind])
        if here:
            x = [entry["step"] for entry in here]
            curves = tuple(curve(words[key], x, [entry[key] for entry in here]) for key in keys)
            yield Chart(title, "call that touches files", whole, curves, "linear", "linear")


CASE = Case(
    "interrupted-writes",
    "Files, when writing is interrupted",
    "Several files are replaced, and the process is killed, terminated or interrupted before and after every call that "
    "touches files; every such call fails once; the disk is full; others write the same files at the same time. Is "
    "every file afterwards the whole old or the whole new one, what is left beside it, and does a later run cope?",
    _run,
)
