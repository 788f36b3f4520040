"""Completion in the shell: the lines of docs/usage/install.md, in a bash; the answers that zsh and fish read."""

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.cli import started
from tests.patience import HANGS

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "usage" / "install.md").read_text("utf-8")
LINES = dict(re.findall(r"^\| (\w+).*\| `(.*_VISCOPADE_COMPLETE=.*)` \|$", PAGE, re.MULTILINE))
TYPED = {
    "viscopade sc": {"scene"},
    "viscopade export cu": {"cuda"},
    "viscopade scene --example i": {"ice_rings"},
    "viscopade scene --for": {"--format"},
    "viscopade epsilon --law viscoelastic --end ": {"force", "return"},
}


def test_the_page_has_a_line_for_each_shell():
    assert {*LINES} == {"bash", "zsh", "fish"}


@pytest.mark.parametrize("typed", TYPED)
def test_bash(typed, tmp_path):
    if shutil.which("bash") is None or os.name != "posix":
        pytest.skip("there is no bash")
    command = tmp_path / "viscopade"
    command.write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} -m viscopade "$@"\n')
    command.chmod(0o755)
    words = typed.split(" ")
    script = f"""
[[ ${{BASH_VERSINFO[0]}} -gt 4 || (${{BASH_VERSINFO[0]}} -eq 4 && ${{BASH_VERSINFO[1]}} -ge 4) ]] || exit 77
{LINES["bash"]}
COMP_WORDS=({" ".join(map(shlex.quote, words))})
COMP_CWORD={len(words) - 1}
function=$(complete -p viscopade | sed 's/.* -F \\([^ ]*\\) .*/\\1/')
"$function" viscopade
printf '%s\\n' "${{COMPREPLY[@]}}"
"""
    variables = os.environ | {"PATH": f"{tmp_path}{os.pathsep}{os.environ['PATH']}"}
    ended = subprocess.run(
        ["bash", "--norc", "-c", script], capture_output=True, text=True, env=variables, timeout=HANGS
    )
    if ended.returncode == 77:
        pytest.skip("bash is older than 4.4")
    assert (ended.returncode, ended.stderr) == (0, "")
    assert set(ended.stdout.split()) == TYPED[typed]


@pytest.mark.parametrize("shell", ["zsh", "fish"])
def test_other_shells(shell):
    script = started(environment={"_VISCOPADE_COMPLETE": f"{shell}_source"})
    assert script.returncode == 0
    assert f"_VISCOPADE_COMPLETE={shell}_complete" in script.stdout
    asked = {"_VISCOPADE_COMPLETE": f"{shell}_complete", "COMP_WORDS": "viscopade scene --example i", "COMP_CWORD": "3"}
    answer = started(environment=asked | ({"COMP_CWORD": "i"} if shell == "fish" else {}))
    assert "ice_rings" in answer.stdout
    assert "boulders" not in answer.stdout
