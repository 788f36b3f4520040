"""Reader of files from other people: their size and nesting are checked before they are parsed.

Parsers of other packages, which a small file may fill the memory of or crash, run in a process with limits.
"""

from __future__ import annotations

import io
import json
import lzma
import os
import re
import subprocess
import sys
import tempfile
import tomllib
import zipfile
import zlib
from collections.abc import Callable
from itertools import accumulate
from pathlib import Path
from typing import Any

# Limits of what is parsed, chosen by hand: a table of millions of rows is read, and a file that would fill the memory
# of a laptop is refused in one line.
LONGEST = 1 << 27  # bytes, 134 million, of a file, and of all members of an archive
MOST_CELLS = 1 << 23  # cells, 8.4 million, in all sheets of a file, empty ones included
MOST_MEMBERS = 1000  # members of an archive, and sheets of a spreadsheet
LONGEST_TOML = 1 << 20  # bytes; the parser takes 1 or 2 s for 1 MB
DEEPEST = 8  # nested tables and lists, and parts of a dotted key: one of many parts filled 5 GB

LIMITED = sys.platform == "linux" and not getattr(sys, "frozen", False)
"""Whether a process has a limit of memory. A frozen program has no process of its own."""
# The program of `isolated_output`: it limits its memory, writes no image of it after a crash, and runs the module.
_PROCESS = """
import json, runpy, sys
file, request, memory, sys.path[:] = json.loads(sys.argv[1])
if memory is not None:
    import resource
    hard = resource.getrlimit(resource.RLIMIT_AS)[1]
    resource.setrlimit(resource.RLIMIT_AS, (memory if hard == resource.RLIM_INFINITY else min(memory, hard), hard))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
sys.argv = [file, json.dumps(request)]
try:
    runpy.run_path(file, run_name="__main__")
except Exception as error:
    sys.exit(f"{type(error).__name__}: {' '.join(str(error).split())}")
"""

# A string without an end extends to the end of the text, so that no character is searched twice.
_STRING_OR_COMMENT = re.compile(
    r'"""(?:[^\\]|\\.)*?(?:"{3,5}|\Z)'
    r"|'''.*?(?:'{3,5}|\Z)"
    r'|"(?:[^"\\\n]|\\[^\n])*+"?'
    r"|'[^'\n]*+'?"
    r"|#[^\n]*+",
    re.DOTALL,
)
_PART = r"[^\s.,=\[\]{}]"
_DOTTED = re.compile(rf"(?<!{_PART})(?:{_PART}++[ \t]*+\.[ \t]*+){{{DEEPEST}}}")


def content(file: Path, accepted: str) -> bytes:
    """Return the content of a file; `accepted` says in the message what it should be, such as "a scene in TOML".

    Raises
    ------
    ValueError
        If the file cannot be read or is too long.
    """
    try:
        # Nobody may write into a named pipe; one that is open already, as /dev/stdin, has an end.
        if file.is_fifo() and not str(file).startswith("/dev/"):
            raise OSError("it is a pipe (/dev/stdin reads standard input)")
        # One byte more than allowed shows that a file is too long, without reading the rest.
        with file.open("rb") as stream:
            read = stream.read(LONGEST + 1)
    # Our pages name examples/…, which is a folder of the package: say where it is.
    except OSError as error:
        shipped = not file.is_absolute() and file.parts[:1] == ("examples",) and isinstance(error, FileNotFoundError)
        copy = "; the folder that `viscopade --examples-dir` prints has the examples" * shipped
        raise ValueError(f"cannot read {file}: {error.strerror or error}; expected {accepted}{copy}") from None
    require_size(str(file), len(read))
    return read


def require_size(source: str, size: int, largest: int = LONGEST) -> None:
    """Raise ValueError if a file, or an archive after it is unpacked, has too many bytes."""
    if size > largest:
        raise ValueError(f"{source}: the content is too long: expected at most {largest} bytes")


def require_cells(source: str, cells: int) -> None:
    """Raise ValueError if tables have too many cells."""
    if cells > MOST_CELLS:
        raise ValueError(f"{source}: the tables are too large: expected at most {MOST_CELLS} cells")


def members(archive: bytes, source: str) -> dict[str, bytes]:
    """Return the members of a ZIP archive by name; `source` names the file in messages.

    Raises
    ------
    ValueError
        If the archive is damaged, encrypted, or too large, also after it is unpacked.
    """
    # The list of members says their sizes: check it before anything is unpacked.
    require_size(source, len(archive))
    try:
        with zipfile.ZipFile(io.BytesIO(archive)) as opened:
            listed = opened.infolist()
            if len(listed) > MOST_MEMBERS:
                raise ValueError(f"the archive has {len(listed)} members: expected up to {MOST_MEMBERS}")
            require_size(source, sum(info.file_size for info in listed))  # no more is unpacked than an entry says
            return {info.filename: opened.read(info) for info in listed}
    except (zipfile.BadZipFile, zlib.error, lzma.LZMAError, EOFError, OSError, RuntimeError, ValueError) as error:
        message = str(error)
        raise ValueError(
            message if message.startswith(source) else f"{source}: the ZIP archive cannot be read: {message}"
        ) from None


def toml(text: bytes | str, source: str) -> dict[str, Any]:
    """Return the tables in the `text` of a TOML file; `source` names the file in messages.

    Raises
    ------
    ValueError
        If it is too long, not TOML in UTF-8, or nested too deeply.
    """
    require_size(source, len(text), LONGEST_TOML)
    try:
        plain = text if isinstance(text, str) else text.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise ValueError(f"{source}: the file is not text in UTF-8: expected a scene in TOML") from None
    # Nested lists and long dotted keys would exceed the parser's recursion or fill the memory: look for them in the
    # text without strings and comments. The depth is the number of brackets that are open.
    code = _STRING_OR_COMMENT.sub("x", plain)
    depths = accumulate((c in "[{") - (c in "]}") for c in code if c in "[]{}")
    if _DOTTED.search(code) or max(depths, default=0) > DEEPEST:
        raise ValueError(f"{source}: its tables are nested too deeply: expected at most {DEEPEST} levels")
    try:
        return tomllib.loads(plain)
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"{source}: the text is not TOML: {error}") from None
    except ValueError:
        raise ValueError(f"{source}: the text is not TOML: a number has too many digits") from None


def toml_with_strings(text: str, write: Callable[[str], str]) -> str:
    """Return the text of a TOML file, in which each string, with its quotes, is what `write` makes of it."""
    return _STRING_OR_COMMENT.sub(lambda match: match[0] if match[0].startswith("#") else write(match[0]), text)


def isolated_output(module: str, request: object, content: bytes, memory: int, seconds: float, smaller: str) -> bytes:
    """Return what a module prints if it runs as a program, in a process of its own and in an empty folder.

    Parameters
    ----------
    module : str
        Its `__file__`.
    request : object
        The program's only argument, as JSON.
    content : bytes
        Its standard input.
    memory, seconds : int, float
        Limits: bytes of the address space, on Linux, and the duration.
    smaller : str
        What to expect instead if a limit is exceeded.

    Raises
    ------
    ValueError
        If the process exceeds a limit, crashes or fails; with the message of its exception in one line.
    """
    # -I: Python ignores the user's environment and the folder; the process gets this one's path for imports.
    words = [sys.executable, "-I", "-c", _PROCESS, json.dumps([module, request, memory if LIMITED else None, sys.path])]
    threads = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"), "1")  # each takes address space
    try:
        with tempfile.TemporaryDirectory() as folder:
            run = subprocess.run(
                words,
                cwd=folder,
                env={**os.environ, **threads},
                input=content,
                capture_output=True,
                timeout=seconds,
                check=False,
            )
    except subprocess.TimeoutExpired:
        raise ValueError(f"it takes more than {seconds} s: expected {smaller}") from None
    # The last line has the exception. A negative status is the signal that killed the process.
    message = run.stderr.decode(errors="replace").strip().rpartition("\n")[2]
    if run.returncode < 0 or "MemoryError" in message or "bad_alloc" in message:
        raise ValueError(f"its parser crashes or needs more than {memory} bytes of memory: expected {smaller}")
    if run.returncode:
        raise ValueError(message.partition(": ")[2] or message)  # without the name of the exception
    return run.stdout
