"""Interrupted writes: nothing is lost or half-written; and a writer that does lose something is caught."""

import json
import os
import shutil
import signal
import stat
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.hard_case import assert_passes
from tests.patience import HANGS
from viscopade.cli import writer
from viscopade.generated import MARKER
from viscopade_lab.hard_cases import interrupted_writes, interruption

OURS = f"# {MARKER} 0: x\n"


@pytest.fixture(scope="module")
def quick():
    return interrupted_writes.found(thorough=False)


def test_the_quick_run_passes(quick):
    result = interrupted_writes.assess(quick)
    assert_passes(result)
    assert len(result.charts) == 2


@pytest.mark.slow
def test_the_thorough_run_passes():
    result = interrupted_writes.CASE.run(True)
    assert_passes(result)


def test_the_steps_are_the_system_calls(quick):
    """A second count: strace is not needed to know that each new file takes at least these calls."""
    steps = {entry["step"] for entry in quick if entry["how"] == "failing call"}
    calls = len(("lstat", "open", "write", "fsync", "close", "stat", "replace"))
    assert len(steps) == max(steps) >= calls * len(interruption.TARGETS)
    # With the returns there are as many again, but for calls that raise.
    assert len(steps) < max(entry["step"] for entry in quick if entry["how"] == "SIGKILL") <= 2 * len(steps)


# --- writers that are broken ------------------------------------------------------------------------------------------

MUTANTS = {
    "in place": """
def write(files):
    for path, content in files.items():
        path.parent.mkdir(exist_ok=True, parents=True)
        with open(path, "wb") as file:
            file.write(content)
""",
    "removed first": """
def write(files):
    for path, content in files.items():
        path.unlink(missing_ok=True)
        interruption.write_all({path: content})
""",
    "temporary file left": """
import contextlib
writer._quietly = lambda action: None
write = interruption.write_all
""",
    "stale files left": """
writer._remove_stale = lambda directory, written: None
write = interruption.write_all
""",
    "fresh files removed": """
writer._STALE = -1
write = interruption.write_all
""",
    "one name for all temporary files": """
import time
writer.secrets = type("secrets", (), {"token_hex": lambda n: "0" * 16})
writer._synchronise = lambda _: time.sleep(0.01)  # long enough for another run to be there, on a busy machine too
write = interruption.write_all
""",
    "directories made without looking": """
import time
def make(directory, undo):
    if not directory.is_dir():
        make(directory.parent, undo)
        time.sleep(0.02)  # long enough for another run to be there, on a busy machine too
        directory.mkdir()
writer._make_directory = make
write = interruption.write_all
""",
}
SEEN = {
    "in place": "targets that were neither",
    "removed first": "old files that were lost",
    "temporary file left": "temporary files left after an error",
    "stale files left": "two days old",
    "fresh files removed": "fresh temporary files",
    "one name for all temporary files": "runs that failed because of another one",
    "directories made without looking": "runs that failed because of another one",
}


@pytest.mark.parametrize("name", MUTANTS)
def test_a_broken_writer_is_caught(name):
    rounds = 20 if SEEN[name].startswith("runs") else 0
    stride = 1 if name == "in place" else 5
    code = f"""
import itertools, json
from viscopade.cli import writer
from viscopade_lab.hard_cases import interruption
from viscopade_lab.hard_cases.streams import memory
{MUTANTS[name]}
import os, signal, tempfile
with tempfile.TemporaryDirectory(dir=memory()) as top:
    if {rounds}:
        for found in interruption.together(top, write, 4, {rounds}, 6, False):
            print(json.dumps(found))
    else:
        directory = interruption.Directory(top)
        kill = lambda: os.kill(os.getpid(), signal.SIGKILL)
        for how, act in (("SIGKILL", kill), ("failing call", interruption._fail)):
            for found in interruption.interrupted(directory, write, how, act, stride={stride}):
                print(json.dumps(found))
"""
    run = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        timeout=HANGS,
        env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},
    )
    assert run.returncode == 0, run.stderr
    checks = interrupted_writes.checks([json.loads(line) for line in run.stdout.splitlines()])
    failed = [check.statement for check in checks if not check.holds]
    assert any(SEEN[name] in statement for statement in failed), failed


# --- the real program, and a real full disk ---------------------------------------------------------------------------

EXPORT = [sys.executable, "-m", "viscopade", "export", "series-json", "--order", "12", "--digits", "20", "-o"]


def test_commands_that_write_the_same_file_at_once(tmp_path):
    target = tmp_path / "series.json"
    runs = [subprocess.Popen([*EXPORT, target], stderr=subprocess.PIPE) for _ in range(3)]
    assert [(run.communicate(timeout=HANGS)[1], run.returncode) for run in runs] == [(b"", 0)] * 3
    assert [path.name for path in tmp_path.iterdir()] == ["series.json"]
    assert target.read_text().rstrip().endswith("}")


def test_a_command_that_is_killed_at_random_leaves_a_whole_file(tmp_path):
    target = tmp_path / "series.json"
    target.write_text("{" + OURS)
    old = target.read_text()
    subprocess.run([*EXPORT, tmp_path / "new.json"], check=True, timeout=HANGS)
    new = (tmp_path / "new.json").read_text()
    for delay in (0.5, 1.0):
        run = subprocess.Popen([*EXPORT, target])
        time.sleep(delay)
        run.send_signal(signal.SIGKILL)
        run.wait(timeout=HANGS)
        assert target.read_text() in (old, new)


@pytest.fixture
def small_disk(tmp_path):
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = shutil.which("mount")
    if (
        mount is None
        or subprocess.run([mount, "-t", "tmpfs", "-o", "size=64k", "none", disk], capture_output=True).returncode
    ):
        pytest.skip("no right to mount a small disk")
    yield disk
    subprocess.run(["umount", disk], check=True)


@pytest.mark.parametrize("used", [0, 8, 12, 15])
def test_a_disk_that_is_full(small_disk, used):
    """64 KiB, of which 4 KiB blocks are used before: the new files of 80 KB never fit."""
    old = {small_disk / name: OURS + "old\n" for name in ("a.h", "b.h")}
    for path, text in old.items():
        path.write_text(text)
    (small_disk / "other").write_bytes(b"x" * 4096 * min(used, 13))
    with pytest.raises(writer.WriteError, match="No space left on device"):
        writer.write_all(dict.fromkeys(old, OURS + "new\n" * 10000))
    assert {path: path.read_text() for path in small_disk.glob("*.h")} == old
    assert {path.name for path in small_disk.iterdir()} == {"a.h", "b.h", "other"}


def test_a_full_standard_output_is_one_line():
    if not Path("/dev/full").exists():
        pytest.skip("there is no device that is always full")
    with open("/dev/full", "w") as full:
        words = [sys.executable, "-m", "viscopade", "coefficients", "--order", "4"]
        run = subprocess.run(words, stdout=full, stderr=subprocess.PIPE, text=True, timeout=HANGS)
    assert (run.returncode, run.stderr) == (1, "viscopade: cannot print: No space left on device\n")


# --- what the writer promises -----------------------------------------------------------------------------------------


def test_what_others_put_there_in_the_meantime_is_not_replaced(tmp_path, monkeypatch):
    target = tmp_path / "a.h"
    stage = writer._stage

    def slowly(path, content, undo):
        temporary = stage(path, content, undo)
        target.write_text("somebody's own file\n")
        return temporary

    monkeypatch.setattr(writer, "_stage", slowly)
    with pytest.raises(writer.WriteError, match="was not generated by viscopade"):
        writer.write(target, OURS)
    assert target.read_text() == "somebody's own file\n"
    assert [path.name for path in tmp_path.iterdir()] == ["a.h"]


def test_stale_temporary_files_are_removed_and_nothing_else(tmp_path):
    past = time.time() - 2 * 24 * 3600
    stale = tmp_path / f".viscopade-{'0' * 16}.tmp"
    others = [
        tmp_path / name
        for name in (
            f".viscopade-{'1' * 16}.tmp",
            ".viscopade-mine.tmp",
            f"viscopade-{'0' * 16}.tmp",
            ".viscopade-0.tmp",
        )
    ]
    for path in (stale, *others):
        path.write_text("x")
    for path in (stale, *others[1:]):
        os.utime(path, (past, past))
    (tmp_path / f".viscopade-{'2' * 16}.tmp").mkdir()
    writer.write(tmp_path / "a.h", OURS)
    assert not stale.exists()
    assert all(path.exists() for path in others)
    assert (tmp_path / f".viscopade-{'2' * 16}.tmp").is_dir()


def test_another_process_makes_the_directory_first(tmp_path, monkeypatch):
    mkdir = Path.mkdir

    def late(path, *words, **options):
        if not path.exists():
            mkdir(path, *words, **options)
        mkdir(path, *words, **options)

    monkeypatch.setattr(Path, "mkdir", late)
    writer.write_all({tmp_path / "x" / "y" / "a.h": OURS}, parents=True)
    assert stat.S_ISREG((tmp_path / "x" / "y" / "a.h").stat().st_mode)
