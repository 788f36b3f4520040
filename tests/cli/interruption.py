"""Interrupt the writer at every step, in processes of their own, and look at what is left on the disk.

`python -m tests.cli.interruption quick` (or `thorough`, or the name of a broken writer) prints one line of
JSON for each experiment. A child is forked for each: it counts the calls that touch files, before and after each of
them, and at the one that it was told it kills itself, is interrupted, or has the call fail. The files then are those
that a crash would leave.
"""

import errno
import json
import multiprocessing
import os
import random
import resource
import shutil
import signal
import sys
import tempfile
import time
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from unittest import mock

from tests.cli.processes import memory
from viscopade.cli import writer
from viscopade.cli.writer import WriteError
from viscopade.generated import MARKER

DONE, REFUSED, STOPPED, OTHER = 0, 3, 4, 5
"""How a child ends, unless it is killed: written, `WriteError`, `KeyboardInterrupt`, another exception."""

TARGETS = {"a.h": (5_000, 40_000), "b.csv": (60_000, 1_000), "c.svg": (0, 20_000), "new/d.h": (0, 9_000)}
"""The files of an experiment, with the lengths of the old and the new content; 0: there is no old file."""

OLD = 2 * 24 * 3600  # seconds: what is as old as that is nobody's any more
TEMPORARY = ".viscopade-*"


def write_all(files):
    """Write as the commands do."""
    writer.write_all(files, parents=True)


def content(name, version, length):
    """Return a content that shows when a part of it is missing."""
    line = f"{MARKER} 0: {version} of {name}\n".encode()
    return (line * (length // len(line) + 1))[:length]


def _steps(act, at, returns, finer):
    """Install what counts the steps and acts at one of them; return the counter."""
    seen = [0]

    def step():
        seen[0] += 1
        if seen[0] == at:
            act()

    def profile(frame, event, function):
        if (event == "c_call" or (returns and event == "c_return")) and _touches_files(function):
            step()

    def trace(frame, event, argument):
        frame.f_trace_opcodes = True
        if event == "opcode":
            step()
        return trace

    if finer:
        sys.settrace(trace)
    else:
        sys.setprofile(profile)
    return seen


def _touches_files(function):
    if getattr(function, "__module__", None) in ("posix", "nt", "_io"):
        return True
    return type(getattr(function, "__self__", None)).__module__ == "_io"


class Directory:
    """The directory of an experiment, with the old files."""

    def __init__(self, top):
        self.path = Path(top, "run")
        self.new = {self.path / name: content(name, "new", new) for name, (_, new) in TARGETS.items()}
        self.old = {self.path / name: content(name, "old", old) for name, (old, _) in TARGETS.items() if old}

    def prepare(self):
        """Make the directory with the old files, and nothing else."""
        shutil.rmtree(self.path, ignore_errors=True)
        self.path.mkdir()
        for path, data in self.old.items():
            path.write_bytes(data)

    def temporary(self):
        """Return the temporary files."""
        return [*self.path.rglob(TEMPORARY)]

    def state(self):
        """Return how many targets are new, half-written or lost, and how many temporary files there are."""
        found = {"new": 0, "half": 0, "lost": 0, "temporary": len(self.temporary())}
        for path, new in self.new.items():
            data = path.read_bytes() if path.exists() else None
            if data == new:
                found["new"] += 1
            elif data is None:
                found["lost"] += path in self.old
            elif data != self.old.get(path):
                found["half"] += 1
        return found


def _child(write, prepare):
    """Fork; the child prepares, writes, and ends at once."""
    child = os.fork()
    if child:
        return child
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a job in the background would ignore it
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    end = OTHER
    try:
        prepare()
        write()
        end = DONE
    except WriteError:
        end = REFUSED
    except KeyboardInterrupt:
        end = STOPPED
    except BaseException as error:
        print(repr(error), file=sys.stderr)
    finally:
        sys.setprofile(None)
        sys.settrace(None)
        os._exit(end)


def _ended(child):
    """Return how a child ended: its exit status, or minus the signal."""
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def steps(directory, write, *, returns, finer):
    """Return how many steps an undisturbed run has."""
    directory.prepare()
    seen = _steps(lambda: None, 0, returns, finer)
    try:
        write(directory.new)
    finally:
        sys.setprofile(None)
        sys.settrace(None)
    return seen[0]


def interrupted(directory, write, how, act, *, finer=False, stride=1):
    """Yield what is left after an interruption at each step.

    A call that fails does so before it is made; a signal may also come just after it.
    """
    returns = how != "failing call"
    for at in range(1, steps(directory, write, returns=returns, finer=finer) + 1, stride):
        directory.prepare()
        child = _child(partial(write, directory.new), partial(_steps, act, at, returns, finer))
        yield {"how": how, "step": at, "end": _ended(child), **directory.state()}
        if how == "SIGKILL" and at % 3 == 0:
            yield {"how": "later run", "step": at, **_later(directory, write)}


def _later(directory, write):
    """Return what later runs leave of fresh temporary files, then of those that are old, and whether they write all."""
    fresh = directory.temporary()
    write(directory.new)
    stolen = sum(not path.exists() for path in fresh)
    past = time.time() - OLD
    for path in fresh:
        if path.exists():
            os.utime(path, (past, past))
    write(directory.new)
    state = directory.state()
    return {"stolen": stolen, "stale": state["temporary"], "unwritten": len(TARGETS) - state["new"], "left": len(fresh)}


def _fail():
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def full(directory, write, limits):
    """Yield what is left where the system lets no file grow beyond a limit, for each limit."""
    for limit in limits:
        directory.prepare()
        hard = resource.getrlimit(resource.RLIMIT_FSIZE)[1]
        prepare = partial(resource.setrlimit, resource.RLIMIT_FSIZE, (limit, hard))
        end = _ended(_child(partial(write, directory.new), prepare))
        yield {"how": "full", "step": limit, "end": end, **directory.state()}


def together(top, write, runs, rounds, files, killed):
    """Yield what several runs leave that write the same files, into a new directory, at the same time."""
    dice = random.Random(runs * 1000 + rounds + killed)
    for number in range(rounds):
        path = Path(top, "together")
        shutil.rmtree(path, ignore_errors=True)
        targets = [path / "x" / f"{i}.h" for i in range(files)]
        versions = [
            {target: content(target.name, f"run {run}", 3000 * (run + 1) + 500 * i) for i, target in enumerate(targets)}
            for run in range(runs)
        ]
        pipe = os.pipe()
        children = [_child(partial(write, version), partial(_wait, *pipe)) for version in versions]
        for end in pipe:
            os.close(end)  # all start now
        if killed:
            time.sleep(dice.random() * 0.01)
            os.kill(children[0], signal.SIGKILL)
        half, ends = 0, []
        for child in children:
            half += _half(versions)
            ends.append(_ended(child))
        half += _half(versions)
        failed = sum(end != DONE for end in ends[killed:])
        left = len([*path.rglob(TEMPORARY)])
        lost = sum(not target.exists() for target in targets)
        yield {
            "how": "together, one killed" if killed else "together",
            "step": number,
            "runs": runs,
            "half": half,
            "failed": failed,
            "lost": lost,
            "temporary": 0 if killed and ends[0] == -signal.SIGKILL else left,
        }


def _wait(reading, writing):
    """Wait until nobody can write to a pipe any more."""
    os.close(writing)
    os.read(reading, 1)


def _half(versions):
    """Return how many of the files that are there are not the whole one of one of the runs."""
    found = 0
    for target in versions[0]:
        try:
            data = target.read_bytes()
        except FileNotFoundError:
            continue
        found += all(data != version[target] for version in versions)
    return found


def killing(number):
    """Return what sends a signal to the process that calls it."""
    return lambda: os.kill(os.getpid(), number)


def experiments(thorough):
    """Yield what each experiment leaves."""
    with tempfile.TemporaryDirectory(dir=memory()) as top:
        directory = Directory(top)
        yield from interrupted(directory, write_all, "SIGKILL", killing(signal.SIGKILL))
        yield from interrupted(directory, write_all, "SIGINT", killing(signal.SIGINT))
        yield from interrupted(directory, write_all, "SIGTERM", killing(signal.SIGTERM), stride=1 if thorough else 5)
        yield from interrupted(directory, write_all, "failing call", _fail)
        largest = max(new for _, new in TARGETS.values())
        yield from full(directory, write_all, range(0, largest, 100 if thorough else 2500))
        for runs in (2, 3, 4):
            for killed in (False, True):
                yield from together(top, write_all, runs, 100 if thorough else 3, 6, killed)
        if thorough:  # at instructions of the interpreter
            for number in (signal.SIGKILL, signal.SIGINT):
                yield from interrupted(directory, write_all, number.name, killing(number), finer=True, stride=7)


# --- writers that are broken ------------------------------------------------------------------------------------------


def in_place(files):
    """Write without a temporary file."""
    for path, data in files.items():
        path.parent.mkdir(exist_ok=True, parents=True)
        with open(path, "wb") as file:
            file.write(data)


def removed_first(files):
    """Write where the old file was, after it is gone."""
    for path, data in files.items():
        path.unlink(missing_ok=True)
        write_all({path: data})


RUNS = 4
everybody, met = multiprocessing.get_context("fork").Barrier(RUNS), []


def without_looking(directory, undo):
    """Make a directory as if nobody else did; all runs see that the first one is missing before any makes it."""
    if not directory.is_dir():
        without_looking(directory.parent, undo)
        if not met:
            met.append(everybody.wait())
        directory.mkdir()


BROKEN = {
    "in place": (in_place, {}),
    "removed first": (removed_first, {}),
    "temporary file left": (write_all, {"_quietly": lambda action: None}),
    "stale files left": (write_all, {"_remove_stale": lambda directory, written: None}),
    "fresh files removed": (write_all, {"_STALE": -1}),
    "one name for all temporary files": (
        write_all,
        # Writing takes long enough for another run to be there, on a busy machine too.
        {"secrets": SimpleNamespace(token_hex=lambda n: "0" * 16), "_synchronise": lambda _: time.sleep(0.01)},
    ),
    "directories made without looking": (write_all, {"_make_directory": without_looking}),
}
"""How to write wrongly: a function, and what is changed in the writer's module."""


def of_broken(name):
    """Yield what a broken writer leaves in those experiments that may show it."""
    write, changes = BROKEN[name]
    with tempfile.TemporaryDirectory(dir=memory()) as top, mock.patch.dict(vars(writer), changes):
        if name in ("one name for all temporary files", "directories made without looking"):
            yield from together(top, write, RUNS, 3, 6, killed=False)
        else:
            for how, act in (("SIGKILL", killing(signal.SIGKILL)), ("failing call", _fail)):
                yield from interrupted(Directory(top), write, how, act, stride=1 if name == "in place" else 5)


if __name__ == "__main__":
    what = sys.argv[1]
    for found in of_broken(what) if what in BROKEN else experiments(what == "thorough"):
        print(json.dumps(found), flush=True)
