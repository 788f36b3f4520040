"""Interrupted writes: nothing is lost or half-written; and a writer that does lose something is caught.

Several files are replaced, and the process is killed, terminated or interrupted before and after every call that
touches files; every such call fails once; the disk is full; others write the same files at the same time.
"""

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

from tests.cli.interruption import BROKEN, DONE, REFUSED, STOPPED, TARGETS
from tests.patience import HANGS
from viscopade.cli import writer
from viscopade.generated import MARKER

OURS = f"# {MARKER} 0: x\n"


def left_by(what):
    """Return what is left after each experiment; they are made in a process of its own, which forks."""
    words = [sys.executable, "-m", "tests.cli.interruption", what]
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}  # who forks has no threads
    run = subprocess.run(words, capture_output=True, env=environment, text=True, timeout=HANGS)
    assert run.returncode == 0, run.stderr
    return [json.loads(line) for line in run.stdout.splitlines()]


def broken_promises(left):
    """Return what the writer promises and did not keep, with how often."""

    def of(*kinds):
        return [entry for entry in left if entry["how"] in kinds]

    def total(key, entries):
        return sum(entry[key] for entry in entries)

    killed, interrupted, errors = of("SIGKILL", "SIGTERM"), of("SIGINT"), of("failing call", "full")
    alone, later = [*killed, *interrupted, *errors], of("later run")
    together = of("together", "together, one killed")
    deaf = [entry for entry in interrupted if entry["end"] != STOPPED and entry["new"] < len(TARGETS)]
    found = {
        "each file is the whole old or the whole new one": total("half", alone),
        "no old file is lost": total("lost", alone),
        "a failing call ends in success or one error of the writer": sum(
            entry["end"] not in (DONE, REFUSED) for entry in errors
        ),
        "no temporary file is left after an error": total("temporary", errors),
        "no temporary file is left after an interruption from the keyboard": total("temporary", interrupted),
        "an interruption reaches the caller": len(deaf),
        "runs at once: each file is the whole one of one run, during and after them": total("half", together),
        "runs at once lose no file": total("lost", of("together")),
        "runs at once do not fail because of each other": total("failed", together),
        "runs at once leave no temporary file": total("temporary", together),
        "a run after a kill writes every file": total("unwritten", later),
        "a run removes killed runs' temporary files that are two days old": total("stale", later),
        "a run leaves fresh temporary files, maybe of a living run": total("stolen", later),
    }
    return {promise: number for promise, number in found.items() if number}


@pytest.fixture(scope="module")
def quick():
    return left_by("quick")


def assert_all_is_well(left):
    assert broken_promises(left) == {}
    killed = {entry["new"] for entry in left if entry["how"] == "SIGKILL"}
    assert killed == {*range(len(TARGETS) + 1)}  # from none to all: the kills come everywhere


def test_nothing_is_lost_or_half_written(quick):
    assert_all_is_well(quick)


@pytest.mark.slow
def test_nothing_is_lost_or_half_written_at_any_instruction():
    assert_all_is_well(left_by("thorough"))


def test_the_steps_are_the_system_calls(quick):
    """A second count: strace is not needed to know that each new file takes at least these calls."""
    steps = {entry["step"] for entry in quick if entry["how"] == "failing call"}
    calls = len(("lstat", "open", "write", "fsync", "close", "stat", "replace"))
    assert len(steps) == max(steps) >= calls * len(TARGETS)
    # With the returns there are as many again, but for calls that raise.
    assert len(steps) < max(entry["step"] for entry in quick if entry["how"] == "SIGKILL") <= 2 * len(steps)


SEEN = {
    "in place": "each file is the whole old or the whole new one",
    "removed first": "no old file is lost",
    "temporary file left": "no temporary file is left after an error",
    "stale files left": "a run removes killed runs' temporary files that are two days old",
    "fresh files removed": "a run leaves fresh temporary files, maybe of a living run",
    "one name for all temporary files": "runs at once do not fail because of each other",
    "directories made without looking": "runs at once do not fail because of each other",
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_writer_is_caught(name):
    assert SEEN[name] in broken_promises(left_by(name))


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
