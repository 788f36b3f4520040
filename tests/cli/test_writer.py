"""The writer: all or nothing, and never over what is not ours."""

from __future__ import annotations

import errno
import os
import resource
import signal
import stat
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from viscopade.cli.writer import WriteError, write, write_all
from viscopade.generated import MARKER

OURS = f"# {MARKER} 0.1.0: viscopade export csv\nm,n\n"
OLD = f"# {MARKER} 0.0.9: viscopade export csv\nold\n"
FOREIGN = "somebody's own file\n"


def contents(directory: Path) -> dict[str, bytes | None]:
    """Return everything below a directory: names to contents, None for directories."""
    return {
        str(path.relative_to(directory)): path.read_bytes() if path.is_file() else None for path in directory.rglob("*")
    }


def refused(directory: Path, action: Callable[[], None], message: str) -> None:
    """Assert that an action is refused with one line and changes nothing."""
    before = contents(directory)
    with pytest.raises(WriteError, match=message) as caught:
        action()
    assert "\n" not in str(caught.value)
    assert contents(directory) == before


def test_a_path_may_be_a_string(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write("table.csv", OURS)
    assert contents(tmp_path) == {"table.csv": OURS.encode()}


@given(st.text(st.characters(exclude_characters="\r", exclude_categories=["Cs"])))
def test_any_text_is_read_back(tmp_path_factory: pytest.TempPathFactory, text: str) -> None:
    path = tmp_path_factory.getbasetemp() / "any"
    write(path, OURS + text)
    assert path.read_bytes().decode() == OURS + text


def test_our_own_file_is_replaced(tmp_path: Path) -> None:
    target = tmp_path / "table.csv"
    target.write_text(OLD)
    write(target, OURS)
    assert contents(tmp_path) == {"table.csv": OURS.encode()}


def test_permissions_follow_the_umask_or_the_file_replaced(tmp_path: Path) -> None:
    previous = os.umask(0o027)
    try:
        write(tmp_path / "new", OURS)
        (tmp_path / "old").write_text(OLD)
        (tmp_path / "old").chmod(0o664)
        write(tmp_path / "old", OURS)
    finally:
        os.umask(previous)
    assert stat.S_IMODE((tmp_path / "new").stat().st_mode) == 0o640
    assert stat.S_IMODE((tmp_path / "old").stat().st_mode) == 0o664


@pytest.mark.parametrize("text", [FOREIGN, "", "x" * 1000 + OURS], ids=["foreign", "empty", "marker too late"])
def test_a_foreign_file_is_left_alone(tmp_path: Path, text: str) -> None:
    (tmp_path / "theirs").write_text(text)
    refused(tmp_path, lambda: write(tmp_path / "theirs", OURS), "will not replace .*theirs: it was not generated")


def test_no_file_is_written_if_one_target_is_foreign(tmp_path: Path) -> None:
    (tmp_path / "b").write_text(FOREIGN)
    refused(tmp_path, lambda: write_all({tmp_path / "a": OURS, tmp_path / "b": OURS}), "will not replace .*b:")


def test_a_directory_is_refused(tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    refused(tmp_path, lambda: write(tmp_path / "sub", OURS), "it is a directory")


def test_a_symbolic_link_is_refused(tmp_path: Path) -> None:
    (tmp_path / "real").write_text(OLD)
    (tmp_path / "link").symlink_to("real")
    (tmp_path / "dangling").symlink_to("nowhere")
    for name in ("link", "dangling"):
        refused(tmp_path, lambda name=name: write(tmp_path / name, OURS), "symbolic link or no regular file")
        assert (tmp_path / name).is_symlink()


def test_a_device_is_refused() -> None:
    with pytest.raises(WriteError, match="no regular file"):
        write(os.devnull, OURS)
    assert not Path(os.devnull).is_file()


def test_missing_directories_are_made_only_if_asked(tmp_path: Path) -> None:
    target = tmp_path / "a" / "b" / "table.csv"
    refused(tmp_path, lambda: write(target, OURS), "there is no directory .*b$")
    write_all({target: OURS}, parents=True)
    assert contents(tmp_path) == {"a": None, "a/b": None, "a/b/table.csv": OURS.encode()}


@pytest.mark.parametrize("parents", [False, True])
def test_a_file_where_a_directory_should_be(tmp_path: Path, parents: bool) -> None:
    (tmp_path / "file").write_text(FOREIGN)
    for name in ("file/table.csv", "file/sub/table.csv"):
        refused(
            tmp_path,
            lambda name=name: write_all({tmp_path / name: OURS}, parents=parents),
            "cannot write .*table.csv: Not a directory",
        )


def test_an_unknown_text_or_newline_is_refused(tmp_path: Path) -> None:
    refused(tmp_path, lambda: write(tmp_path / "a", FOREIGN), "the text does not begin with")
    refused(tmp_path, lambda: write(tmp_path / "a", OURS + "\r\n"), "carriage return")


@pytest.mark.skipif(os.geteuid() == 0, reason="the superuser may write everywhere")
def test_an_unwritable_directory(tmp_path: Path) -> None:
    tmp_path.chmod(0o555)
    try:
        refused(tmp_path, lambda: write(tmp_path / "a", OURS), "cannot write .*a: Permission denied")
    finally:
        tmp_path.chmod(0o755)


# --- interrupted at every call that touches files, in a child: what is left is what a crash would leave --------------


def content(version: str, name: str) -> bytes:
    """Return a content that shows when a part of it is missing."""
    return f"{MARKER} 0: {version} of {name}\n".encode() * 2000


NAMES = ("a.h", "b.csv", "c.svg", "new/d.h")


def ended(action: Callable[[], None]) -> int:
    """Run an action in a child; return its exit status, 3 for a `WriteError`, or minus its signal."""
    child = os.fork()
    if not child:
        status = 1
        try:
            action()
            status = 0
        except WriteError:
            status = 3
        except KeyboardInterrupt:
            status = 4
        finally:
            sys.setprofile(None)
            os._exit(status)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def acting_at(step: int, act: Callable[[], None]) -> None:
    """Act just before a call that touches files, the one of this number."""
    seen = 0

    def profile(frame: object, event: str, function: object) -> None:
        nonlocal seen
        places = {getattr(function, "__module__", None), type(getattr(function, "__self__", None)).__module__}
        if event == "c_call" and places & {"posix", "_io"} and getattr(function, "__name__", "") != "fspath":
            seen += 1
            if seen == step:
                act()

    sys.setprofile(profile)


def fail() -> None:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@pytest.mark.parametrize(
    ("act", "ends", "cleans_up"),
    [
        (lambda: os.kill(os.getpid(), signal.SIGKILL), {-signal.SIGKILL}, False),
        (lambda: signal.raise_signal(signal.SIGINT), {4}, True),
        (fail, {0, 3}, True),
    ],
    ids=["killed", "interrupted", "a failing call"],
)
def test_nothing_is_lost_or_half_written(
    tmp_path: Path, act: Callable[[], None], ends: set[int], cleans_up: bool
) -> None:
    new = {name: content("new", name) for name in NAMES}
    replaced = set()
    for step in range(1, 1000):
        directory = tmp_path / str(step)
        directory.mkdir()
        for name in NAMES[:2]:
            (directory / name).write_bytes(content("old", name))

        def write_new(directory: Path = directory, step: int = step) -> None:
            signal.signal(signal.SIGINT, signal.default_int_handler)
            acting_at(step, act)
            write_all({directory / name: data for name, data in new.items()}, parents=True)

        end = ended(write_new)
        found = {str(path.relative_to(directory)): path.read_bytes() for path in directory.rglob("*") if path.is_file()}
        targets = {name: found.pop(name, b"") for name in NAMES}
        assert all(
            data in (new[name], content("old", name) if name in NAMES[:2] else b"") for name, data in targets.items()
        )
        assert not cleans_up or not found  # no temporary file is left
        replaced.add(sum(targets[name] == new[name] for name in NAMES))
        if end == 0 and targets == new:
            break
        assert end in ends
    assert step > 20
    assert replaced == {*range(len(NAMES) + 1)} or act is fail


def test_a_full_disk(tmp_path: Path) -> None:
    (tmp_path / "a").write_text(OLD)

    def write_too_much() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, resource.getrlimit(resource.RLIMIT_FSIZE)[1]))
        write_all({tmp_path / "b": OURS, tmp_path / "a": content("new", "a")})

    assert ended(write_too_much) == 3
    assert contents(tmp_path) == {"a": OLD.encode()}


def test_runs_at_once_leave_whole_files(tmp_path: Path) -> None:
    versions = [{tmp_path / "x" / str(i): content(f"run {run}", str(i)) for i in range(6)} for run in range(4)]
    children = []
    for version in versions:
        child = os.fork()
        if not child:
            try:
                write_all(version, parents=True)
            finally:
                os._exit(0)
        children.append(child)
    for child in children:
        os.waitpid(child, 0)
    for path in versions[0]:
        assert path.read_bytes() in [version[path] for version in versions]
    assert len([*(tmp_path / "x").iterdir()]) == 6
