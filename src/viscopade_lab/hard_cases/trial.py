"""Give hostile inputs to the installed program, one after the other, in a process of its own that can be killed.

`python -m viscopade_lab.hard_cases.trial SEED FIRST LAST` prints one line of JSON for each input. The program's own
function is called, so that a hundred thousand inputs take minutes; it sees other arguments, other streams, a directory
with traps, little memory, and no programs to run.
"""

from __future__ import annotations

import csv
import importlib.metadata
import io
import json
import os
import re
import resource
import shutil
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import mpmath
from flint import ctx

from viscopade.generated import MARKER
from viscopade_lab.hard_cases import inputs
from viscopade_lab.hard_cases.inputs import Attempt, Grammar
from viscopade_lab.hard_cases.streams import memory

MEMORY, FILE_SIZE = 8 << 30, 1 << 26  # bytes that an input may take
OUTCOMES = ("answered", "refused", "cannot")
"""By exit status: 0, 2 and 1; the last is for what this machine lacks, such as a compiler."""

# What a refusal says: what is accepted, or what is wrong with the words, in our own or in Click's words.
SAID = re.compile(
    r"accepted (is|are|for|with|at)\b|No such (option|command)|is not one of|Missing (argument|option|command)|"
    r"requires an argument|does not take a value|unexpected (extra )?argument|cannot (read|write)|"
    r"will not replace|is missing|is not known|: no (TOML|JSON|text in UTF-8)|nested too deeply|does not exist|"
    r"also needs|must be one printable line|is empty|repeats|Invalid value for|is required|does not pass|"
    r"for all v\* >= 0|ranges over|no curve|Option .* requires|is a directory|not a file|asked for twice|"
    r"which is not installed"
)
LACKS = re.compile(r"there is no C compiler|nothing is written, because of the disagreement")
LONGEST_LINE = 5100  # characters of a refusal: a list of all names fits, a whole file does not


@dataclass(frozen=True)
class Answer:
    """What the program did: exit status, or None after an exception, and what it printed."""

    status: int | None
    output: str
    errors: str
    exception: str = ""


class Program:
    """The installed program, called as a function."""

    def __init__(self) -> None:
        (entry,) = importlib.metadata.entry_points(group="console_scripts", name="viscopade")
        self.main: Callable[[], None] = entry.load()

    def run(self, *words: str) -> Answer:
        """Call it with these arguments."""
        streams = sys.argv, sys.stdin, sys.stdout, sys.stderr
        buffers = io.BytesIO(), io.BytesIO()
        out = io.TextIOWrapper(buffers[0], encoding="utf-8", errors="strict")
        err = io.TextIOWrapper(buffers[1], encoding="utf-8", errors="backslashreplace")
        sys.argv, sys.stdin, sys.stdout, sys.stderr = ["viscopade", *words], io.StringIO(), out, err
        status: int | None = 0
        exception = ""
        try:
            self.main()
        except SystemExit as end:
            status = end.code if isinstance(end.code, int) else 0 if end.code is None else 1
        except BaseException as error:  # whatever it is: that it came here is the finding
            status, last = None, traceback.extract_tb(error.__traceback__)[-1]
            exception = f"{type(error).__name__}: {str(error)[:200]} ({Path(last.filename).name}, {last.name})"
        finally:
            sys.argv, sys.stdin, sys.stdout, sys.stderr = streams
        for stream in (out, err):
            stream.flush()
        printed, complained = (buffer.getvalue().decode("utf-8") for buffer in buffers)
        return Answer(status, printed, complained, exception)

    def grammar(self) -> Grammar:
        """Return the commands and options that the help lists."""
        helps = {name: self.run(name, "--help").output for name in inputs.commands_of(self.run("--help").output)}
        targets = {name: found for name, text in helps.items() if (found := inputs.targets_of(text))}
        return Grammar({name: inputs.options_of(text) for name, text in helps.items()}, targets)


class Sandbox:
    """A directory with traps, made anew whenever it was changed."""

    def __init__(self, directory: str) -> None:
        self.top = Path(directory)
        self.here = self.top / "a" / "b"
        self._files: dict[str, bytes] = {}
        self.restore()

    def restore(self) -> None:
        """Make everything as it was."""
        for path in self.top.iterdir():
            shutil.rmtree(path) if path.is_dir() and not path.is_symlink() else path.unlink()
        for name in ("directory", "taken"):
            (self.here / name).mkdir(parents=True)
        os.chdir(self.here)
        for name in ("foreign.h", "taken/viscopade_pade.h", "taken/report.html"):
            Path(name).write_text("somebody's own file\n")
        Path("ours.h").write_text(f"/* {MARKER} 0: nothing */\n")
        for name, target in (("link", inputs.SCENE), ("dangling", "nowhere"), ("loop", "loop")):
            os.symlink(target, name)
        for name in inputs.FILES:
            if name.startswith("odd") or name == "\udcff.toml":
                os.symlink(inputs.SCENE, name)
        self._files = {}
        self.put({inputs.SCENE: b"", inputs.RESULT: b"", inputs.FINDINGS: b""})

    def put(self, files: Mapping[str, bytes]) -> None:
        """Write the files of an input; those of the one before are left if it has none of that name."""
        for name, content in files.items():
            if self._files.get(name) != content:
                Path(name).write_bytes(content)
                self._files[name] = content
        self.before = self._look()

    def changed(self) -> list[str]:
        """Return what was made, changed or removed since `put`."""
        after = self._look()
        return sorted(name for name in {*self.before, *after} if self.before.get(name) != after.get(name))

    def _look(self) -> dict[str, tuple[int, ...]]:
        found: dict[str, tuple[int, ...]] = {}
        directories = [str(self.top)]
        while directories:
            for entry in os.scandir(directories.pop()):
                status = entry.stat(follow_symlinks=False)
                is_directory = entry.is_dir(follow_symlinks=False)
                found[entry.path] = (
                    (status.st_mode,) if is_directory else (status.st_mode, status.st_size, status.st_mtime_ns)
                )
                if is_directory:
                    directories.append(entry.path)
        return found


def faults(attempt: Attempt, answer: Answer, changed: list[str]) -> list[str]:
    """Return what is wrong with an answer."""
    if answer.status is None:
        return [f"exception: {answer.exception}"]
    if answer.status not in (0, 1, 2):
        return [f"exit status {answer.status}"]
    found = _bad_answer(attempt, answer) if answer.status == 0 else _bad_refusal(answer)
    return [*found, *_bad_files(attempt, answer, changed)]


def _bad_refusal(answer: Answer) -> list[str]:
    line = answer.errors.removesuffix("\n")
    found = []
    if not (line.startswith("viscopade: ") and answer.errors.endswith("\n") and line.isprintable()):
        found.append("a refusal is not one printable line")
    if len(line) > LONGEST_LINE:
        found.append("a refusal is too long")
    if answer.output:
        found.append("output with a refusal")
    if not (SAID if answer.status == 2 else LACKS).search(line):
        found.append(f"a refusal does not say what is accepted: {line[:200]}")
    return found


def _bad_answer(attempt: Attempt, answer: Answer) -> list[str]:
    found = []
    if answer.errors:
        found.append(f"an answer with something on standard error: {answer.errors[-200:]}")
    is_code = attempt.command in ("export", "simulators")  # which may speak of NaN, and call nan("")
    nan = re.compile(r"(?<![\w\"])nan(?![\w\"(])") if is_code else re.compile(r"\bnan\b", re.IGNORECASE)
    if nan.search(answer.output) and not {"-h", "--help"} & {*attempt.words}:
        found.append("a silent NaN")
    if not all(line.isprintable() for line in answer.output.split("\n")):
        found.append("an answer with unprintable characters")
    try:
        if answer.output.startswith("{") and not answer.output.startswith("{\\"):
            json.loads(answer.output, parse_constant=_refuse)
    except ValueError:
        found.append("no strict JSON")
    if _style(attempt) == "csv" and len({len(row) for row in csv.reader(io.StringIO(answer.output))}) > 1:
        found.append("rows of different lengths")
    return found


def _refuse(constant: str) -> None:
    raise ValueError(constant)


def _style(attempt: Attempt) -> str | None:
    words = attempt.words
    given = [b for a, b in pairwise(words) if a == "--format"]
    return given[-1] if given and attempt.command != "export" and not {"-h", "--help"} & {*words} else None


def _bad_files(attempt: Attempt, answer: Answer, changed: list[str]) -> list[str]:
    if not changed:
        return []
    asked = any(word.startswith(("-o", "--out")) for word in attempt.words)
    if answer.status != 0:
        return [f"a refusal that left or changed files: {[Path(name).name[-40:] for name in changed]}"]
    if not asked:
        return ["files that nobody asked for"]
    for name in changed:
        path = Path(name)
        if path.is_file() and MARKER.encode() not in path.read_bytes():
            return ["a file that is not ours was changed"]
        if path.name.startswith(".viscopade"):
            return ["a temporary file is left"]
    return []


def shape(line: str) -> str:
    """Return a message without what came from the input: to count the different ones."""
    line = re.sub(r"(unexpected extra argument).*|(No such option).*|(is not one of).*", r"\1\2\3", line)
    line = re.sub(r"(cannot write|cannot read|will not replace) .*?(?=: )", r"\1 …", line)
    line = re.sub(r"'(?:[^'\\]|\\.)*'|\"(?:[^\"\\]|\\.)*\"", "'…'", line)
    line = re.sub(r"[^ ]*[.](?:toml|json|h)\b", "…", line)
    line = re.sub(r"(\bis .*?|[^ ]* is not known)(?=: accepted)", "is …", line)
    line = re.sub(r"\[[0-9]+\]", "[]", line)  # which element of a list
    return re.sub(r"[0-9][0-9.e+-]*", "0", line)[:120]


def _limit() -> None:
    """Leave the program little to break: no other programs, little memory, no core, no large files."""
    os.environ["PATH"] = ""
    for name in ("CC", "CXX", "FC"):
        os.environ.pop(name, None)
    for kind, most in ((resource.RLIMIT_AS, MEMORY), (resource.RLIMIT_FSIZE, FILE_SIZE), (resource.RLIMIT_CORE, 0)):
        resource.setrlimit(kind, (most, resource.getrlimit(kind)[1]))


def trials(seed: int, first: int, last: int, write: Callable[[str], object]) -> None:
    """Try the inputs of these numbers, and write a line for each."""
    program = Program()
    grammar = program.grammar()
    _limit()
    with tempfile.TemporaryDirectory(dir=memory()) as directory, warnings.catch_warnings():
        warnings.simplefilter("always")
        sandbox = Sandbox(directory)
        for number in range(first, last):
            write(json.dumps(trial(program, sandbox, grammar.attempt(seed, number))) + "\n")
        os.chdir("/")


def trial(program: Program, sandbox: Sandbox, attempt: Attempt) -> dict[str, Any]:
    """Try one input; return its command, what came of it, and what is wrong with that."""
    sandbox.put(attempt.files)
    precision = mpmath.mp.prec, ctx.prec
    answer = program.run(*attempt.words)
    changed = sandbox.changed()
    wrong = faults(attempt, answer, changed)
    if (mpmath.mp.prec, ctx.prec) != precision:
        wrong.append("another precision for everybody")
    if changed:
        sandbox.restore()
    outcome = {0: "answered", 2: "refused", 1: "cannot"}.get(-1 if answer.status is None else answer.status, "broken")
    found: dict[str, Any] = {"command": attempt.command, "outcome": outcome, "faults": wrong}
    if answer.status != 0:
        found["message"] = shape(answer.errors.strip() or answer.exception)
    if wrong:
        found["words"] = attempt.words
    return found


if __name__ == "__main__":
    stream = os.fdopen(os.dup(1), "w", buffering=1)
    asked_seed, asked_first, asked_last = map(int, sys.argv[1:4])
    trials(asked_seed, asked_first, asked_last, stream.write)
