"""Hard case: hostile command lines and files; every one must end in an answer or in one clear line."""

from __future__ import annotations

import json
import os
import selectors
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from viscopade.progress import track
from viscopade_lab.hard_cases.finding import Case, Cell, Chart, ChartCurve, Check, Outcome, Table, curve
from viscopade_lab.hard_cases.inputs import KNOWN

SEED = 20
INPUTS, THOROUGH_INPUTS = 600, 100_000
HANGS = 1800
"""Seconds without an answer after which an input counts as one that hangs; alone, a right one takes less than 30."""

OUTCOMES = ("answered", "refused", "cannot", "broken")
CLASSES: Mapping[str, Sequence[str]] = {
    "end in an exception, a signal, a hang, or another exit status than 0, 1 and 2": (
        "exception", "exit status", "ended", "hangs",
    ),
    "are refused, but not in exactly one printable line of bounded length on standard error and nothing else": (
        "a refusal is", "output with",
    ),
    "are refused without saying what is accepted or what is wrong with the input": ("a refusal does",),
    "are answered with a NaN, an unprintable character, a warning, broken JSON or broken CSV": (
        "a silent", "an answer", "no strict", "rows",
    ),
    "make, change or leave a file that was not asked for, or any file with a refusal": (
        "files", "a file", "a refusal that", "a temporary",
    ),
    "leave another precision behind for what is computed next": ("another precision",),
}  # fmt: skip
"""What can be wrong, by the beginnings of what `trial` says of it."""


def tried(seed: int, count: int) -> Iterator[dict[str, Any]]:
    """Yield what came of each input, in their order; a process that is killed is followed by another one."""
    done = 0
    while done < count:
        words = [sys.executable, "-m", "viscopade_lab.hard_cases.trial", str(seed), str(done), str(count)]
        with subprocess.Popen(
            words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, start_new_session=True
        ) as process:
            for line in _lines(process):
                yield json.loads(line)
                done += 1
            ended = process.poll()
            process.kill()
        if done < count:
            fault = "hangs" if ended is None else f"ended with {ended}"
            yield {"command": "?", "outcome": "broken", "faults": [f"{fault}: input {done}"], "message": fault}
            done += 1


def _lines(process: subprocess.Popen[bytes]) -> Iterator[bytes]:
    """Yield what a process prints, line by line, until it ends or says nothing for too long."""
    assert process.stdout is not None
    rest = b""
    with selectors.DefaultSelector() as selector:
        selector.register(process.stdout, selectors.EVENT_READ)
        while selector.select(HANGS):
            part = os.read(process.stdout.fileno(), 1 << 16)
            if not part:
                process.wait(HANGS)
                return
            *lines, rest = (rest + part).split(b"\n")
            yield from lines


def _group(found: dict[str, Any]) -> str:
    """Return the command, or what stands for words that are none."""
    return found["command"] if found["command"] in KNOWN else "(no command)"


def _run(thorough: bool) -> Outcome:
    count = THOROUGH_INPUTS if thorough else INPUTS
    all_tried = tried(SEED, count)
    return assess([next(all_tried) for _ in track(range(count), "hostile inputs")])


def assess(found: Sequence[dict[str, Any]]) -> Outcome:
    """Return what the inputs' ends say."""
    by_class = {words: _number(found, begins) for words, begins in CLASSES.items()}
    checks = [Check(f"inputs that {words}", number, "==", 0) for words, number in by_class.items()]
    checks.append(Check("inputs that are wrong in a way not listed above", _unlisted(found), "==", 0))
    outcomes = Counter(entry["outcome"] for entry in found)
    messages = len({entry["message"] for entry in found if "message" in entry})
    wrong = sum(bool(entry["faults"]) for entry in found)
    commands = {_group(entry) for entry in found} - {"(no command)"}
    summary = (
        f"{len(found):,} command lines, with hostile scenes and results among them, were given to all "
        f"{len(commands)} commands. {outcomes['answered']:,} were answered, "
        f"{outcomes['refused']:,} refused as wrong input (exit status 2), {outcomes['cannot']:,} because there is no "
        f"compiler (exit status 1): with {messages:,} different messages, numbers and quoted words left out. {wrong:,} "
        "ended in another way than they should."
    )
    return Outcome(summary, _tables(found), _charts(found), tuple(checks))


def _number(found: Sequence[dict[str, Any]], begins: Sequence[str]) -> int:
    return sum(any(fault.startswith(tuple(begins)) for fault in entry["faults"]) for entry in found)


def _unlisted(found: Sequence[dict[str, Any]]) -> int:
    listed = tuple(word for begins in CLASSES.values() for word in begins)
    return sum(any(not fault.startswith(listed) for fault in entry["faults"]) for entry in found)


def _tables(found: Sequence[dict[str, Any]]) -> tuple[Table, ...]:
    rows: list[tuple[Cell, ...]] = []
    for command in sorted({_group(entry) for entry in found}):
        here = [entry for entry in found if _group(entry) == command]
        outcomes = Counter(entry["outcome"] for entry in here)
        messages = len({entry["message"] for entry in here if "message" in entry})
        rows.append((command, len(here), *(outcomes[name] for name in OUTCOMES), messages))
    header = ("command", "inputs", "answered", "refused (2)", "cannot (1)", "broken", "different messages")
    whole = Table("What came of the inputs", header, tuple(rows))
    first: dict[str, tuple[int, str]] = {}
    times: Counter[str] = Counter()
    for entry in found:
        for fault in entry["faults"]:
            times[fault[:100]] += 1
            first.setdefault(fault[:100], (len(first), " ".join(map(repr, entry.get("words", ())))[:200]))
    if not first:
        return (whole,)
    faults = tuple((fault, times[fault], words) for fault, (_, words) in list(first.items())[:20])
    return whole, Table("What went wrong", ("what", "times", "first input"), faults)


def _charts(found: Sequence[dict[str, Any]]) -> tuple[Chart, ...]:
    shown = ("scene", "simulators", "report", "hardcases", "export", "epsilon", "pade")
    kinds = [_new_messages("all", found), *(_new_messages(name, found) for name in shown)]
    ends = []
    for name in OUTCOMES:
        at = [i for i, entry in enumerate(found, 1) if entry["outcome"] == name]
        if at:
            ends.append(curve(name, [*at, len(found)], [*range(1, len(at) + 1), len(at)]))
    return (
        Chart("Messages that were not seen before", "inputs", "different messages", tuple(k for k in kinds if k)),
        Chart("Ends", "inputs", "number", tuple(_thinned(end) for end in ends)),
    )


def _new_messages(name: str, found: Sequence[dict[str, Any]]) -> ChartCurve | None:
    seen: set[str] = set()
    points = []
    for i, entry in enumerate(found, 1):
        if "message" in entry and name in ("all", entry["command"]) and entry["message"] not in seen:
            seen.add(entry["message"])
            points.append((i, len(seen)))
    if not points:
        return None
    points.append((len(found), len(seen)))
    return _thinned(curve(name, [x for x, _ in points], [y for _, y in points]))


def _thinned(whole: ChartCurve, most: int = 200) -> ChartCurve:
    """Return a curve of few points, evenly spaced on a logarithmic axis of inputs."""
    last = len(whole.x) - 1
    keep = sorted({0, last, *(round((last + 1) ** (i / most)) - 1 for i in range(most))})
    return curve(whole.name, [whole.x[i] for i in keep], [whole.y[i] for i in keep], whole.look)


CASE = Case(
    "hostile-input",
    "Hostile input to the command line and its files",
    "Command lines and files are made from a grammar of every command and then mutated: numbers that are none, other "
    "scripts' digits, control characters, endless words, options of other commands, directories and devices as files, "
    "scenes and results with wrong types, units, nesting and bytes. Does each end in an answer, or in one line that "
    "says what is accepted, and no file that was not asked for?",
    _run,
)
