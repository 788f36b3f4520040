"""Records: what comes back is what was made, and ready kernels are read, not made."""

import json
import math
import re
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import NamedTuple

import pytest

from viscopade import store
from viscopade.arithmetic.formats import DOUBLE, FLOAT, Format
from viscopade.collision import curve
from viscopade.fitting import weight_table
from viscopade.kernels import quotient
from viscopade.kernels.speed_table import Polynomials, table_rows

FOLDER = Path(store.__file__).parent / store.FOLDER
KEY = ["pade", "1/3", "float"]


class RowBounds(NamedTuple):
    error: Fraction
    rounding: tuple[tuple[str, Fraction], ...]
    falling: bool


def counted():
    """A recorded function, and the list of its calls."""
    calls = []

    @store.recorded("pade")
    def make(
        number: Fraction, form: Format, also: int = 3
    ) -> tuple[RowBounds, dict[str, tuple[float, ...]], Decimal | None, tuple[Fraction | float, ...]]:
        calls.append((number, form, also))
        return (
            RowBounds(number, (("float", number / 3),), True),
            {"rows": (0.1, -0.0, 5e-324, float("inf"))},
            Decimal("0.10"),
            (number, math.inf),
        )

    return make, calls


def test_what_is_read_is_what_was_made(monkeypatch):
    first, calls = counted()
    with store.fresh_records() as records:
        made = first(Fraction(1, 3), FLOAT)
    assert [*records] == ["pade-1-3-float.json"]
    assert json.loads(records["pade-1-3-float.json"])["key"] == KEY
    monkeypatch.setattr(store, "package_record", records.get)
    again, later = counted()
    read = again(Fraction(1, 3), FLOAT)
    assert str(read) == str(made)  # -0.0, too
    assert isinstance(read[0], RowBounds)
    assert isinstance(read[2], Decimal)
    assert (len(calls), later) == (1, [])


def test_defaults_and_names_of_arguments_make_no_difference():
    make, calls = counted()
    one, two, three = make(Fraction(1), DOUBLE), make(Fraction(1), DOUBLE, 3), make(form=DOUBLE, number=Fraction(1))
    assert one is two is three
    assert make(Fraction(1), DOUBLE, also=4) is not one
    assert len(calls) == 2


def test_anew_makes_everything_once_more():
    make, calls = counted()
    for _ in range(2):
        with store.fresh_records():
            make(Fraction(2), DOUBLE)
    assert len(calls) == 2


def test_a_record_of_another_key_is_none(monkeypatch):
    """The names of files are shorter than keys."""
    other = json.dumps({"key": ["pade", "-1/3", "float"], "value": None})
    monkeypatch.setattr(store, "package_record", lambda name: other)
    make, calls = counted()
    make(Fraction(1, 3), FLOAT)
    assert len(calls) == 1


def test_ready_kernels_are_neither_fitted_nor_proven(monkeypatch):
    def never(*_, **__):
        raise AssertionError("made")

    makers = (quotient.certificate, "prove"), (Polynomials, "row"), (curve, "interpolant"), (weight_table, "_motion")
    for module, name in makers:
        monkeypatch.setattr(module, name, never)
    store._clear()
    quotient.proven_pade(3, 6)
    assert len(table_rows(Polynomials(6, -96, 1, FLOAT))) == 8192
    curve.curve_tables(curve.law_of("tsuji", "return"))
    weight_table.collisions_at_nodes()


def test_names_of_records_are_unique():
    sources = (path.read_text("utf-8") for path in Path(store.__file__).parent.rglob("*.py"))
    names = [name for text in sources for name in re.findall(r'^@recorded\("([\w ]+)"\)', text, re.MULTILINE)]
    assert len(names) == len({*names}) >= 10
    assert {json.loads(path.read_text())["key"][0] for path in FOLDER.iterdir()} == {*names}


@pytest.mark.parametrize("path", sorted(FOLDER.iterdir()), ids=lambda path: path.stem)
def test_a_record_is_json_with_a_key_that_names_it(path):
    record = json.loads(path.read_text())
    assert set(record) == {"key", "value"}
    assert store._file_name(record["key"]) == path.name
