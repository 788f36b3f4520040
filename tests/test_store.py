"""Records: what comes back is what was made, once; and neither a broken cache nor other runs do harm."""

import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import pytest

from viscopade import store
from viscopade.arithmetic.formats import DOUBLE, FLOAT, Format
from viscopade.kernels import prove_rational
from viscopade.kernels.forms.speed_table import RowBounds, Table, table_rows
from viscopade.kernels.prove_lacunary import half_line_kernel

FOLDER = Path(store.__file__).parent / store.FOLDER
SCENE = "from viscopade.kernels.prove_rational import accurate; print(accurate('1e-2', '0.5').variants[0].a)"


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """An empty cache, and a function whose records it shall hold."""
    monkeypatch.setenv(store.VARIABLE, str(tmp_path))
    return tmp_path / "kernels"


def counted():
    """A recorded function, and the list of its calls."""
    calls = []

    @store.recorded
    def made_for_the_test(
        number: Fraction, form: Format, also: int = 3
    ) -> tuple[RowBounds, dict[str, tuple[float, ...]], Decimal | None]:
        calls.append((number, form, also))
        return (
            RowBounds(number, (("float", number / 3),), True),
            {"rows": (0.1, -0.0, 5e-324, float("inf"))},
            Decimal("0.10"),
        )

    return made_for_the_test, calls


def records(folder):
    return sorted(folder.iterdir()) if folder.exists() else []


def test_what_is_read_is_what_was_made(cache):
    first, calls = counted()
    made = first(Fraction(1, 3), FLOAT)
    again, later = counted()  # knows nothing of the first one's process
    read = again(Fraction(1, 3), FLOAT)
    assert str(read) == str(made)  # -0.0, too
    assert isinstance(read[0], RowBounds)
    assert isinstance(read[2], Decimal)
    assert (len(calls), later) == (1, [])


def test_defaults_and_names_of_arguments_make_no_difference(cache):
    found, calls = counted()
    one, two, three = found(Fraction(1), DOUBLE), found(Fraction(1), DOUBLE, 3), found(form=DOUBLE, number=Fraction(1))
    assert one is two is three
    assert found(Fraction(1), DOUBLE, also=4) is not one
    assert len(calls) == 2


def of_another_form(good):
    """Return a file with a right checksum whose value lacks a field."""
    text = good.partition(b"\n")[2].replace(b'"error"', b'"mistake"')
    return hashlib.sha256(text).hexdigest().encode() + b"\n" + text


@pytest.mark.parametrize(
    "spoil",
    [
        of_another_form,
        b"",
        b"{",
        b"[]",
        b"\xff\xfebroken",
        b"[" * 10**5,
        b"0" * 64 + b"\n{}",
        lambda text: text.replace(b"2/3", b"0/0"),
    ],
)
def test_a_broken_file_is_made_again(cache, spoil):
    counted()[0](Fraction(2), DOUBLE)
    (file,) = records(cache)
    good = file.read_bytes()
    broken = spoil if isinstance(spoil, bytes) else spoil(good)
    assert broken != good
    file.write_bytes(broken)
    found, calls = counted()
    assert found(Fraction(2), DOUBLE)[0].error == 2
    assert len(calls) == 1
    assert file.read_bytes() == good


def test_a_cache_that_cannot_be_written_is_no_error(monkeypatch, tmp_path):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv(store.VARIABLE, str(tmp_path / "file" / "cache"))
    assert counted()[0](Fraction(2), DOUBLE)[0].error == 2


def test_without_cache_nothing_is_written_or_read(cache):
    with store.without_cache():
        counted()[0](Fraction(2), DOUBLE)
    assert records(cache) == []
    counted()[0](Fraction(2), DOUBLE)
    found, calls = counted()
    with store.without_cache():
        found(Fraction(2), DOUBLE)
    assert len(calls) == 1


def test_anew_makes_everything_and_stores_nothing(cache):
    found, calls = counted()
    found(Fraction(2), DOUBLE)
    with store.anew() as made:
        found(Fraction(2), DOUBLE)
    (name,) = made
    assert name == "made_for_the_test-2-double.json"
    assert json.loads(made[name])["key"] == ["made_for_the_test", "2", "double"]
    assert len(calls) == 2
    assert len(records(cache)) == 1


def test_other_sources_have_other_records(cache, monkeypatch):
    counted()[0](Fraction(2), DOUBLE)
    monkeypatch.setattr(store, "_sources", lambda: "another version")
    found, calls = counted()
    found(Fraction(2), DOUBLE)
    assert len(calls) == 1
    assert len(records(cache)) == 2


def test_the_cache_is_bounded_and_loses_the_oldest(cache, monkeypatch):
    found, _ = counted()
    found(Fraction(1), DOUBLE)
    (oldest,) = records(cache)
    size = oldest.stat().st_size
    monkeypatch.setattr(store, "MOST_BYTES", 3 * size + size // 2)
    for number in range(2, 5):
        os.utime(oldest, (number, number))
        found(Fraction(number), DOUBLE)
    assert oldest not in records(cache)
    assert len(records(cache)) == 3


def test_several_runs_at_once(cache):
    def run(_):
        return subprocess.run([sys.executable, "-c", SCENE], capture_output=True, text=True, check=True).stdout

    with ThreadPoolExecutor(3) as pool:
        assert len(set(pool.map(run, range(3)))) == 1
    assert records(cache)
    assert all(file.suffix == ".json" and store._checked(file) for file in records(cache))  # whole, and no leftovers


def test_ready_kernels_are_neither_fitted_nor_proven(monkeypatch, cache):
    """What exports/ needs is in the package: nothing of it is made, and nothing goes to the cache."""

    def never(*_, **__):
        raise AssertionError("made")

    for module, name in (
        (prove_rational.certificate, "prove"),
        (Table, "row"),
    ):
        monkeypatch.setattr(module, name, never)
    store._clear()
    half_line_kernel("1e-5")
    prove_rational.accurate("1e-3", "5")
    prove_rational.of_pade(3, 6)
    assert len(table_rows(Table(3, -96, 1, FLOAT))) == 1024
    assert records(cache) == []


def test_a_record_of_another_key_is_no_hit(monkeypatch, cache):
    """The names of files are shorter than keys."""
    with pytest.raises(ValueError, match="m is -3"):
        prove_rational.of_pade(-3, 6)
    name = "of_pade-3-6.json"
    other, read = store.of_package("of_pade-2-5.json"), store.of_package
    monkeypatch.setattr(store, "of_package", lambda asked: other if asked == name else read(asked))
    store._clear()
    assert prove_rational.of_pade(3, 6).m == 3  # made


def test_files_of_another_kind_are_left_alone(cache, monkeypatch):
    cache.mkdir(parents=True)
    mine = cache / "notes.bin"
    mine.write_bytes(bytes(1000))
    os.utime(mine, (1, 1))
    monkeypatch.setattr(store, "MOST_BYTES", 10)
    counted()[0](Fraction(2), DOUBLE)
    assert mine.exists()
    assert [path.name for path in records(cache)] == ["notes.bin"]


def test_a_pipe_in_the_cache_is_no_record(cache):
    counted()[0](Fraction(2), DOUBLE)
    (file,) = records(cache)
    file.unlink()
    os.mkfifo(file)
    assert counted()[0](Fraction(2), DOUBLE)[0].error == 2


def test_changed_sources_have_another_digest(monkeypatch, tmp_path):
    def digest():
        store._sources.cache_clear()
        return store._sources()

    package = tmp_path / "viscopade"
    shutil.copytree(FOLDER.parents[1], package, ignore=shutil.ignore_patterns("__pycache__", "*.so"))
    monkeypatch.setattr(store, "__file__", str(package / "store.py"))
    found = [digest()]
    for name in ("arguments.py", "collision/flow.py", "data/double.txt"):
        (package / name).write_text((package / name).read_text() + "# changed\n")
        found.append(digest())
    assert len(set(found)) == 4
    shutil.rmtree(package)
    assert digest() is None  # nothing is cached then
    monkeypatch.undo()
    store._sources.cache_clear()


def test_no_two_recorded_functions_share_a_name():
    """The name is part of the key, and the module is not."""
    sources = (path.read_text("utf-8") for path in Path(store.__file__).parent.rglob("*.py"))
    names = [name.strip("_") for text in sources for name in re.findall(r"@recorded\ndef (\w+)", text)]
    assert len(names) == len(set(names)) >= 10


@pytest.mark.parametrize("path", sorted(FOLDER.iterdir()), ids=lambda path: path.stem)
def test_a_record_is_json_with_a_key_that_names_it(path):
    record = json.loads(path.read_text())
    assert set(record) == {"key", "value"}
    assert store._file_name(record["key"]) == path.name
