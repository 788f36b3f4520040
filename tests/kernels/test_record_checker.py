"""Records of kernels, each checked without the package; a record that no checker reads, and wrong ones, are refused."""

import copy
import json
from functools import cache
from importlib import import_module
from pathlib import Path

import pytest

import interval_checker
import record_checker
from record_checker import CHECKS, Sample, Wrong, check
from tests import daily

ROOT = Path(__file__).parents[2]
RECORDS = record_checker.paths(ROOT / "src" / "viscopade" / "data" / "kernels")
CERTIFICATES = {
    **dict.fromkeys(("minimax_certificates.json", "pade_certificates.json"), "certificate_checker"),
    "inverse_certificates.json": "interval_checker",
}
"""Files in exports/ with certificates, and what checks them."""
EVERY = 503


@cache
def read(path):
    return json.loads(path.read_text())


def test_every_record_and_every_certificate_has_its_checker():
    assert {read(path)["key"][0] for path in RECORDS} == set(CHECKS)
    assert {path.name for path in (ROOT / "exports").glob("*certificates*")} == set(CERTIFICATES)
    assert [read(path) for path in RECORDS] == record_checker.records()


def test_a_share_of_every_record():
    """Another one every day."""
    lines = [check(read(path), Sample(EVERY, daily.DAY)) for path in RECORDS]
    assert all(line.endswith(" holds") for line in lines)


@pytest.mark.slow
@pytest.mark.parametrize("path", RECORDS, ids=lambda path: path.stem[:60])
def test_whole_records(path):
    check(read(path), Sample())


@pytest.mark.parametrize("every", [1009, pytest.param(1, marks=pytest.mark.slow)])
@pytest.mark.parametrize(("name", "checker"), CERTIFICATES.items())
def test_exported_certificates(name, checker, every):
    """The programs read the files; the records that these are made from have a larger sample, another one every day."""
    sample = (every,) if checker == "interval_checker" else ()
    lines = import_module(checker).check_file(ROOT / "exports" / name, *sample)
    assert len(lines) == len(read(ROOT / "exports" / name)["certificates"]) >= 2


@pytest.mark.parametrize("name", [name for name, checker in CERTIFICATES.items() if checker == "interval_checker"])
def test_a_certificate_with_another_error_of_the_reference_is_refused(name):
    entry = read(ROOT / "exports" / name)["certificates"][0] | {"reference_error": (2.0**-70).hex()}
    with pytest.raises(Wrong):
        interval_checker.Checker(entry).check(10**6)


def test_a_record_of_an_unknown_kind_is_refused():
    with pytest.raises(Wrong, match="no check knows a record of 'of_nothing'"):
        check({"key": ["of_nothing", 1], "value": 1}, Sample())


def smaller(text, factor=0.4):
    return repr(float(text) * factor)


def fraction_by(text, factor):
    p, _, q = text.partition("/")
    return f"{int(p) * int(factor * 1000)}/{int(q or 1) * 1000}"


def set_at(value, place, change):
    *way, last = place
    for step in way:
        value = value[step]
    value[last] = change(value[last])


def by(factor):
    return lambda x: fraction_by(x, factor)


IN_POWERS = [  # of a root
    (("a", -1), lambda x: (float.fromhex(x) * 1.002).hex()),
    (("a", 1), lambda x: "0x1p-1"),
    (("certificate", "bound"), by(0.98)),
    (("certificate", "measure"), lambda x: "none"),
    (("certificate", "parts"), lambda x: x[1:]),
    (("certificate", "parts"), lambda x: [*x[:40], *x[41:]]),
    (("certificate", "parts", 3, 1), lambda x: 0),
    (("bounds", 0, "formula"), by(0.99)),
]
WRONG = {
    "pade": [
        (("certificates", 0, "bound"), by(0.4)),
        *((("bounds", 0, name), by(factor)) for name, factor in (("formula", 0.4), ("last", 0.01))),
        (("bounds", 9, "last"), by(0.01)),
        (("bounds", 12, "rounding"), by(0.9)),
        (("bounds",), lambda x: x[:-1]),
        (("b", 2), smaller),
    ],
    "minimax": [
        (("certificate", "bound"), by(0.4)),
        (("certificate", "parts"), lambda x: x[1:]),
        (("bounds", 0, "last"), by(0.01)),
        (("bounds", 0, "last"), by(10**14)),
        (("bounds", 1, "formula"), by(0.01)),
        (("bounds", 2, "rounding"), by(0.9)),
    ],
    "compact": [
        *IN_POWERS,
        *((("bounds", i, "last"), by(0.001)) for i in (0, 1, 4, 5, 6)),
        (("bounds", 3, "rounding"), by(0.001)),
    ],
    "inverse": [*IN_POWERS, *((("bounds", i, "rounding"), by(0.001)) for i in range(3))],
    "compact powers": [(("top", 1), lambda x: x + 1)],
    "inverse powers": [(("top", 1), lambda x: x + 1)],
    "speed table bounds": [
        (("rise",), lambda x: fraction_by(x, 0.9)),
        (("double",), lambda x: fraction_by(x, 0.01)),
        (("error",), lambda x: fraction_by(x, 0.5)),
    ],
    "full bounds": [(("epsilon",), lambda x: x[1:]), (("one_minus_epsilon", 150), lambda x: "1/1000")],
    "rounding of v_star": [((), lambda x: fraction_by(x, 0.9)), ((), lambda x: fraction_by(x, 1.1))],
    "rounding of w": [((), lambda x: fraction_by(x, 0.9)), ((), lambda x: fraction_by(x, 1.1))],
}


SAMPLES = {
    **dict.fromkeys(("pade", "minimax"), Sample()),
    **dict.fromkeys(("compact", "inverse"), Sample(200)),
    "full bounds": Sample(16 * 24, 149),
}
"""Parts of records that have what is wrong."""


@pytest.mark.parametrize(("kind", "place", "change"), [(k, *one) for k, changes in WRONG.items() for one in changes])
def test_a_wrong_record_is_refused(kind, place, change):
    record = copy.deepcopy(next(read(path) for path in RECORDS if read(path)["key"][0] == kind))
    set_at(record, ("value", *place), change)
    with pytest.raises(Wrong):
        check(record, SAMPLES.get(kind, Sample(100)))


@pytest.mark.parametrize("kind", ["speed table rows", "full rows"])
def test_a_wrong_row_is_refused(kind, monkeypatch):
    """The checks of tables read all records of a table: all of them, with one number changed, take their place."""
    changed = copy.deepcopy(record_checker.records())
    record = next(one for one in changed if one["key"][0] == kind)
    at = len(record["value"]) // 4
    set_at(record["value"], (at, kind == "full rows"), lambda x: (float.fromhex(x) * (1 + 2**-6)).hex())
    monkeypatch.setattr(record_checker, "records", lambda: changed)
    within = at - (kind == "full rows")
    with pytest.raises(Wrong):
        check(record, Sample(len(record["value"]), within))
