"""The writer: all or nothing, and never over what is not ours."""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from viscopade.cli import writer
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


def test_a_new_file(tmp_path: Path) -> None:
    write(tmp_path / "table.csv", OURS)
    assert contents(tmp_path) == {"table.csv": OURS.encode()}


def test_a_path_may_be_a_string(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write("table.csv", OURS)
    assert contents(tmp_path) == {"table.csv": OURS.encode()}


def test_text_is_written_as_utf8_with_its_newlines(tmp_path: Path) -> None:
    text = OURS + "Müller and Pöschel: ε\n"
    write(tmp_path / "table.csv", text)
    assert (tmp_path / "table.csv").read_bytes() == text.encode("utf-8")


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


@pytest.mark.parametrize(("times", "written"), [(1, True), (9, True), (10, False)])
def test_a_directory_that_another_run_takes_away_is_made_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, times: int, written: bool
) -> None:
    """Another run that made it, and failed, removes it between our look at it and our first file there."""
    target, stage = tmp_path / "new" / "deeper" / "a.csv", writer._stage
    left = [None] * times

    def staged(path: Path, content: bytes, undo: ExitStack) -> Path:
        if left:
            left.pop()
            path.parent.rmdir()
            path.parent.parent.rmdir()
        return stage(path, content, undo)

    monkeypatch.setattr(writer, "_stage", staged)
    if written:
        write_all({target: OURS}, parents=True)
        assert contents(tmp_path / "new" / "deeper") == {"a.csv": OURS.encode()}
    else:
        refused(tmp_path, lambda: write_all({target: OURS}, parents=True), "cannot write .*No such file or directory")


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


@pytest.mark.parametrize("call", ["open", "fsync", "chmod", "replace"])
@pytest.mark.parametrize("failure", [OSError(errno.ENOSPC, "No space left on device"), KeyboardInterrupt()])
def test_an_interruption_leaves_the_old_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: str, failure: BaseException
) -> None:
    (tmp_path / "a").write_text(OLD)
    before = contents(tmp_path)

    def fail(*args: object, **kwargs: object) -> None:
        raise failure

    owner = Path if call in ("open", "chmod") else writer.os
    original = getattr(owner, call)
    if call == "open":  # only the temporary file's
        monkeypatch.setattr(Path, "open", lambda path, mode: fail() if mode == "xb" else original(path, mode))
    else:
        monkeypatch.setattr(owner, call, fail)
    expected = WriteError if isinstance(failure, OSError) else KeyboardInterrupt
    with pytest.raises(expected) as caught:
        write_all({tmp_path / "a": OURS, tmp_path / "new" / "b": OURS}, parents=True)
    monkeypatch.undo()
    if expected is WriteError:
        assert str(caught.value) == f"cannot write {tmp_path / 'a'}: No space left on device"
    assert contents(tmp_path) == before


def test_no_file_is_replaced_before_all_are_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a").write_text(OLD)
    (tmp_path / "b").write_text(OLD)
    before = contents(tmp_path)
    calls = iter([None, OSError(errno.EIO, "Input/output error")])

    def fsync(descriptor: int) -> None:
        if failure := next(calls):
            raise failure

    monkeypatch.setattr(writer.os, "fsync", fsync)
    with pytest.raises(WriteError, match=r"cannot write .*b: Input/output error"):
        write_all({tmp_path / "a": OURS, tmp_path / "b": OURS})
    assert contents(tmp_path) == before


def test_each_file_is_whole_if_the_second_cannot_be_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a").write_text(OLD)
    (tmp_path / "b").write_text(OLD)
    replace = os.replace

    def failing(source: Path, target: Path) -> None:
        if target.name == "b":
            raise PermissionError(errno.EACCES, "Permission denied")
        replace(source, target)

    monkeypatch.setattr(writer.os, "replace", failing)
    with pytest.raises(WriteError, match=r"cannot write .*b: Permission denied"):
        write_all({tmp_path / "a": OURS, tmp_path / "b": OURS})
    assert contents(tmp_path) == {"a": OURS.encode(), "b": OLD.encode()}


@pytest.mark.skipif(os.geteuid() == 0, reason="the superuser may write everywhere")
def test_an_unwritable_directory(tmp_path: Path) -> None:
    tmp_path.chmod(0o555)
    try:
        refused(tmp_path, lambda: write(tmp_path / "a", OURS), "cannot write .*a: Permission denied")
    finally:
        tmp_path.chmod(0o755)
