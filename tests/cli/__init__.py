"""`viscopade WORDS`, called in this process, which has imported and proven much already, or as one of its own.

A process takes most of a second to start. It is needed only where streams, signals, the environment or the imports
matter; everything else is `main` with these words in `sys.argv`.
"""

import io
import json
import os
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from unittest import mock

from tests.patience import HANGS
from viscopade.cli.main import main

VISCOPADE = [sys.executable, "-m", "viscopade"]


def started(*words, environment=None):
    """Run a process of its own."""
    variables = os.environ | (environment or {})
    return subprocess.run([*VISCOPADE, *map(str, words)], capture_output=True, text=True, timeout=HANGS, env=variables)


def called(*words, environment=None):
    """Run the command in this process; what comes back is as that of `started`."""
    out, err = (
        io.TextIOWrapper(io.BytesIO(), encoding="utf-8", errors=errors, newline="\n")
        for errors in ("strict", "backslashreplace")  # as Python opens them
    )
    argv = mock.patch.multiple(sys, argv=["viscopade", *map(str, words)], stdin=io.StringIO())
    with argv, mock.patch.dict(os.environ, environment or {}), redirect_stdout(out), redirect_stderr(err):
        try:
            main()
        except SystemExit as ended:
            status = ended.code
    printed = []
    for stream in (out, err):
        stream.flush()
        printed.append(stream.buffer.getvalue().decode())
    return subprocess.CompletedProcess(list(words), status, *printed)


def printed(*words):
    """Call a command that must succeed, and return what it prints."""
    result = called(*words)
    assert (result.returncode, result.stderr) == (0, ""), result.stderr
    return result.stdout


def said(*words):
    """Return what a command prints, on one line."""
    return " ".join(printed(*words).split())


def json_of(*words):
    """Return the JSON that a command prints."""
    return json.loads(printed(*words, "--format", "json"))


def refused(*words, environment=None):
    """Call a command that must be refused, and return the one line that says why."""
    result = called(*words, environment=environment)
    assert (result.returncode, result.stdout) == (2, "")
    line = result.stderr.removesuffix("\n")
    assert line.startswith("viscopade: ")
    assert line.isprintable()
    assert len(line) < 5300
    return line
