"""What kernels cost: counted, measured, or estimated from what was measured."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from viscopade.kernels.registry import Entry, entries
from viscopade.scene.cost import (
    CUBE_ROOT,
    DIVISION,
    PADE,
    POWER,
    Costs,
    MeasuredCosts,
    MeasuredTimes,
    Operations,
    id_of,
    measured,
)
from viscopade.scene.description import Code

FILE = Path(__file__).parents[2] / "docs" / "bench" / "result.json"
CODES = [Code("c", form, use) for form in ("double", "float") for use in ("scalar", "batch")]


@pytest.fixture(scope="module")
def benchmark() -> MeasuredTimes:
    return MeasuredTimes.from_json(FILE.read_text(), FILE.name)


def of(given: MeasuredTimes, code: Code) -> MeasuredCosts:
    found = measured(given, code, given.cpu)
    assert isinstance(found, MeasuredCosts)
    return found


def test_counted_costs() -> None:
    assert Operations(7, 1, 2, 3).count == 7 + DIVISION + 2 * POWER + 3 * CUBE_ROOT
    assert Costs().of("speed-1e-3", Operations(12)).value == 12
    assert Costs().of(None, Operations()).value == 0
    assert str(POWER) in Costs().source
    assert Costs().unit == "operations"


@pytest.mark.parametrize("code", CODES, ids=lambda c: f"{c.format}-{c.use}")
def test_the_committed_measurement_serves_every_format_and_use(code: Code, benchmark: MeasuredTimes) -> None:
    found = of(benchmark, code)
    measure = "memory" if code.use == "batch" else "throughput"
    assert found.unit == "ns"
    assert benchmark.cpu in found.source
    assert benchmark.compiler in found.source
    assert f", {measure}," in found.source
    assert "not this machine" not in found.source
    those = [row for row in benchmark.rows if (row.format, row.measure) == (code.format, measure)]
    rows = {row.id: row for row in those if row.speeds == those[0].speeds}
    for entry in (entry for entry in entries() if entry.kind == "speed"):
        if entry.size == "small":
            assert id_of(entry) is None
        else:
            price = found.of(id_of(entry), Operations(20))
            assert (price.value, price.how) == (rows[f"speed-{entry.tier}"].median, "measured")


@pytest.mark.parametrize("code", CODES, ids=lambda c: f"{c.format}-{c.use}")
def test_estimates_are_in_proportion_and_of_the_right_size(code: Code, benchmark: MeasuredTimes) -> None:
    found = of(benchmark, code)
    times = found.times
    assert times is not None
    power, whole = times["pow"], times[PADE]
    # What [3/6] itself is estimated to cost is what was measured.
    assert found.of(None, Operations(18, 1, 1)).value == pytest.approx(whole)
    assert found.of(None, Operations(18, 1)).value == pytest.approx(whole - power)
    assert found.of(None, Operations()).value == 0
    prices = [found.of(None, Operations(n, 1, 1)) for n in (4, 10, 30)]
    assert power < prices[0].value < prices[1].value < prices[2].value < 4 * power
    assert {price.how for price in prices} == {"estimated"}
    # An id that was not measured is estimated, too.
    assert found.of("speed-1e-4", Operations(18, 1, 1)).how == "estimated"


def test_another_machine_is_named(benchmark: MeasuredTimes) -> None:
    found = measured(benchmark, Code(), "Abacus 1")
    assert f"on {benchmark.cpu}, which is not this machine (Abacus 1)" in found.source


def test_one_distribution_of_speeds_counts(benchmark: MeasuredTimes) -> None:
    found = of(benchmark, Code())
    rows = [row for row in benchmark.rows if (row.format, row.measure) == ("double", "throughput")]
    speeds = rows[0].speeds
    assert found.times == {row.id: row.median for row in rows if row.speeds == speeds}


@pytest.mark.parametrize(("use", "second"), [("scalar", "latency"), ("batch", "cache")])
def test_the_next_measure_is_taken_if_the_first_is_missing(use, second: str, benchmark: MeasuredTimes) -> None:
    rows = tuple(row for row in benchmark.rows if row.measure == second)
    given = replace(benchmark, rows=rows)
    if {"pow", PADE} <= {row.id for row in rows if row.format == "double"}:
        assert f", {second}," in of(given, Code(use=use)).source
    else:
        with pytest.raises(ValueError, match="has no times of pow"):
            measured(given, Code(use=use), "")


@pytest.mark.parametrize("form", ["double", "float"])
@pytest.mark.parametrize("use", ["scalar", "batch"])
@pytest.mark.parametrize("missing", ["format", "pow", PADE])
def test_a_measurement_without_what_is_needed_is_refused(form, use, missing: str, benchmark: MeasuredTimes) -> None:
    rows = [row for row in benchmark.rows if row.id != missing and not (missing == "format" and row.format == form)]
    with pytest.raises(ValueError, match=f"in type {form} .*accepted is the result of") as refused:
        measured(replace(benchmark, rows=tuple(rows)), Code("c", form, use), "")
    assert "\n" not in str(refused.value)


def test_a_quotient_that_seems_to_take_no_time_still_costs_something() -> None:
    found = MeasuredCosts("ns", "noise", {"pow": 20.0, PADE: 19.0})
    few, many = (found.of(None, Operations(n, 1, 1)).value for n in (4, 30))
    assert 20 < few < many
    assert found.of(None, Operations(4)).value > 0


@pytest.mark.parametrize("entry", [e for e in entries() if e.kind in ("half-line", "full")], ids=lambda e: e.name)
def test_kernels_of_v_star_are_measured_too(entry: Entry, benchmark: MeasuredTimes) -> None:
    found = of(benchmark, Code("c", entry.format))
    name = id_of(entry)
    assert name is not None
    assert found.times is not None
    whole = found.times[name]
    assert found.of(name, Operations(20, 1, 1, 1)).value == whole
    price = found.of(name, Operations(20, 1, 0, 1))
    assert (price.value, price.how) == (pytest.approx(whole - found.times["pow"]), "measured")


def test_compact_kernels_are_not_measured() -> None:
    assert {id_of(entry) for entry in entries() if entry.kind == "compact"} == {None}
