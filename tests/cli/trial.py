"""Give hostile inputs to the command line, one after the other, in a process of its own that can be killed.

The program is called as a function, so that a hundred thousand inputs take minutes; it sees other arguments, other
streams, a directory with traps, little memory, and no programs to run.
"""

import csv
import faulthandler
import io
import json
import os
import re
import resource
import shutil
import tempfile
import traceback
import warnings
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import mpmath
from flint import ctx

from tests.cli import called, inputs
from tests.cli.processes import memory
from viscopade.generated import MARKER

HANGS = 1800  # seconds without an answer after which an input counts as one that hangs; alone, none takes 30
MEMORY, FILE_SIZE = 8 << 30, 1 << 26  # bytes that an input may take

# What a refusal says: what is accepted, or what is wrong with the words, in our own or in Click's words.
SAID = re.compile(
    r"accepted (is|are|for|with|at)\b|No such (option|command)|is not one of|Missing (argument|option|command)|"
    r"requires an argument|does not take a value|unexpected (extra )?argument|cannot (read|write)|will not replace|"
    r"is missing|is not known|: the (file|text) is not (TOML|JSON|text in UTF-8)|nested too deeply|does not exist|"
    r"also needs|must be one printable line|is empty|repeats|Invalid value for|is required|does not pass|"
    r"for all v\* >= 0|ranges over|no curve|Option .* requires|is a directory|not a file|asked for twice|"
    r"which is not installed"
)
LACKS = re.compile(r"there is no C compiler|no file is written, because a printed number disagrees")
LONGEST_LINE = 5100  # characters of a refusal: a list of all names fits, a whole file does not


class Answer(NamedTuple):
    """What the program did: exit status, or None after an exception, and what it printed."""

    status: int | None
    output: str
    errors: str
    exception: str = ""


def ask(*words):
    """Call the program with these arguments."""
    try:
        done = called(*words)
    except BaseException as error:  # whatever it is: that it came here is the finding
        last = traceback.extract_tb(error.__traceback__)[-1]
        return Answer(None, "", "", f"{type(error).__name__}: {str(error)[:200]} ({last.filename}, {last.name})")
    return Answer(done.returncode, done.stdout, done.stderr)


def grammar():
    """Return the commands and options that the help lists."""
    helps = {name: ask(name, "--help").output for name in inputs.commands_of(ask("--help").output)}
    targets = {name: found for name, text in helps.items() if (found := inputs.targets_of(text))}
    return inputs.Grammar({name: inputs.options_of(text) for name, text in helps.items()}, targets)


class Sandbox:
    """A directory with traps, made anew whenever it was changed."""

    def __init__(self, directory):
        self.top = Path(directory)
        self.here = self.top / "a" / "b"
        self._files = {}
        self.restore()

    def restore(self):
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
        self.put({inputs.SCENE: b"", inputs.RESULT: b""})

    def put(self, files):
        """Write the files of an input; those of the one before are left if it has none of that name."""
        for name, content in files.items():
            if self._files.get(name) != content:
                Path(name).write_bytes(content)
                self._files[name] = content
        self.before = self._look()

    def changed(self):
        """Return what was made, changed or removed since `put`."""
        after = self._look()
        return sorted(name for name in {*self.before, *after} if self.before.get(name) != after.get(name))

    def _look(self):
        found = {}
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


def faults(attempt, answer, changed):
    """Return what is wrong with an answer."""
    if answer.status is None:
        return [f"exception: {answer.exception}"]
    if answer.status not in (0, 1, 2):
        return [f"exit status {answer.status}"]
    found = _bad_answer(attempt, answer) if answer.status == 0 else _bad_refusal(answer)
    return [*found, *_bad_files(attempt, answer, changed)]


def _bad_refusal(answer):
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


def _bad_answer(attempt, answer):
    found = []
    if answer.errors:
        found.append(f"an answer with something on standard error: {answer.errors[-200:]}")
    is_code = attempt.command in ("calculator", "export", "simulators")  # which may speak of NaN, and call nan("")
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


def _refuse(constant):
    raise ValueError(constant)


def _style(attempt):
    words = attempt.words
    given = [b for a, b in pairwise(words) if a == "--format"]
    return given[-1] if given and attempt.command != "export" and not {"-h", "--help"} & {*words} else None


def _bad_files(attempt, answer, changed):
    if not changed:
        return []
    asked = any(word.startswith(("-o", "--out", "--plot", "--scene")) for word in attempt.words)
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


def _limit():
    """Leave the program little to break: no other programs, little memory, no core, no large files."""
    os.environ["PATH"] = ""
    for name in ("CC", "CXX", "FC"):
        os.environ.pop(name, None)
    for kind, most in ((resource.RLIMIT_AS, MEMORY), (resource.RLIMIT_FSIZE, FILE_SIZE), (resource.RLIMIT_CORE, 0)):
        resource.setrlimit(kind, (most, resource.getrlimit(kind)[1]))


def trials(seed, count):
    """Try so many inputs, and print a line of JSON for each; one that hangs ends the process with a traceback."""
    known = grammar()
    _limit()
    stream = os.fdopen(os.dup(1), "w", buffering=1)
    with stream, tempfile.TemporaryDirectory(dir=memory()) as directory, warnings.catch_warnings():
        warnings.simplefilter("always")
        sandbox = Sandbox(directory)
        for number in range(count):
            faulthandler.dump_traceback_later(HANGS, exit=True)
            stream.write(json.dumps(trial(sandbox, known.attempt(seed, number))) + "\n")
        faulthandler.cancel_dump_traceback_later()
        os.chdir("/")


def trial(sandbox, attempt):
    """Try one input; return its command, the exit status, and what is wrong with the words that did it."""
    sandbox.put(attempt.files)
    precision = mpmath.mp.prec, ctx.prec
    answer = ask(*attempt.words)
    changed = sandbox.changed()
    wrong = faults(attempt, answer, changed)
    if (mpmath.mp.prec, ctx.prec) != precision:
        wrong.append("another precision for everybody")
    if changed:
        sandbox.restore()
    found = {"command": attempt.command, "status": answer.status, "faults": wrong}
    return found | ({"words": attempt.words} if wrong else {})
