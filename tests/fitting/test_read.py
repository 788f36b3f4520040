"""Files as programs write them: CSV of many kinds, spreadsheets, archives; and what is none of these."""

import io
import math
import zipfile
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import viscopade as vp
from viscopade.fitting import bounces, read, spreadsheet
from viscopade.fitting.flight import Flight
from viscopade.fitting.read import Options

PHYPHOX = Path(__file__).with_name("phyphox.xls")
"""Made with xlwt: the sheet "Energy" of phyphox's "(In)elastic collision" with invented instants, and two others."""


def points(text, source="data.csv", **options):
    return recording(text, source, **options).points


def recording(text, source="data.csv", **options):
    return read.recording([(text.encode() if isinstance(text, str) else text, source)], Options(**options))


@pytest.mark.parametrize(
    ("text", "columns"),
    [
        ("speed (cm/s),epsilon\n100,0.9\n200,0.85\n300,0.8\n", {}),
        ("\ufeffspeed (cm/s);eps\r\n100;0,9\r\n200;0,85\r\n300;0,8\r\n", {}),
        ('"Impact speed [cm/s]"\t"COR (%)"\n1e2\t90\n2e2\t85\n3e2\t80\n', {}),
        ("# a comment\nv e note\n\n1 0.9 a\n2 0.85 b\n3 0.8 c\n", {}),
        ("v (cm/s)  e\n100  0.9\n200 0.85\n300 0.8\n", {}),
        ("number,V [m/s],E\n1,1,.9\n2,2,.85\n3,3,.8,\n", {}),
        ("Impact (m/s),COR\n1,0.9\n2,0.85\n3,0.8\n", {"speed": "impact"}),
        ("v (m/s),COR,COR\n1,7,0.9\n2,7,0.85\n3,7,0.8\n", {"epsilon": "3"}),
        ("My title,\nv,e\n(cm/s),%\n,\n100,90\n200,85\n300,80\n", {}),
        ("# written by a program\n# v e\n1 0.9\n2 0.85\n3 0.8\n", {}),
    ],
)
def test_one_table_written_in_many_ways(text, columns):
    found = points(text, columns=columns)
    assert found.speed.tolist() == pytest.approx([1, 2, 3])
    assert found.epsilon.tolist() == pytest.approx([0.9, 0.85, 0.8])
    assert not found.errors_complete


def test_columns_and_units_by_option():
    text = "a,b,c\n100,0.9,0.01\n200,0.85,0.02\n300,0.8,0.01\n"
    columns = {"speed": "a", "epsilon": "b", "sigma_epsilon": "c"}
    found = points(text, columns=columns, units={"speed": "cm/s"})
    assert found.speed.tolist() == [1, 2, 3]
    assert found.errors_complete
    assert np.sqrt((found.epsilon_errors.toarray() ** 2).sum(axis=1)).tolist() == pytest.approx([0.01, 0.02, 0.01])
    assert not points(text, columns=columns, units={"speed": "cm/s"}, scatter=True).errors_complete


AUDACITY = "".join(f"{t:.6f}\t{t:.6f}\tb{k}\n" for k, t in enumerate(0.5 + np.cumsum(0.9 ** np.arange(7))))


@pytest.mark.parametrize(
    ("text", "columns", "epsilon"),
    [
        (AUDACITY, {"time": "1"}, [0.9] * 5),
        (f"labels of a track\n{AUDACITY}", {"time": "1"}, [0.9] * 5),
        (f"# 1\n{AUDACITY}", {"time": "1"}, [0.9] * 5),
        ("1,.93\n2,.92\n3,.9\n4,.89\n", {"speed": "1", "epsilon": "2"}, [0.93, 0.92, 0.9, 0.89]),
        ("1,.93,a\n2,.92,\n3,.9,b\n", {"speed": "column 1", "epsilon": "2"}, [0.93, 0.92, 0.9]),
        ("0;1;0,5\n", {"height": "3"}, "no drop has two heights"),
        ("1,93%\n2,92%\n", {"speed": "1", "epsilon": "2"}, "line 1: epsilon is '93%': write epsilon as 0.93"),
        ("00:01\n00:02\n", {"time": "1"}, "line 1: time is '00:01': expected a number"),
        ("0.5s\n1.5s\n2.4s\n", {"time": "1"}, "line 1: time is '0.5s': expected a number"),
        ("0,512\n1,402\n2,203\n", {"time": "1"}, "commas between digits may be decimal signs: expected a header"),
        ("1,.93\n2,.92\n", {}, "the columns are 'column 1', 'column 2': expected"),
        ("1,.93\n2,.92\nv,e\n3,.9\n4,.89\n", {}, "the columns are 'column 1', 'column 2': expected"),
    ],
)
def test_a_row_of_numbers_is_no_header(text, columns, epsilon):
    """Without a header no row is lost: the first one is data, or refused."""
    if isinstance(epsilon, str):
        with pytest.raises(ValueError, match=epsilon):
            points(text, columns=columns)
    else:
        assert points(text, columns=columns).epsilon == pytest.approx(epsilon, abs=2e-6)


def test_a_row_of_numbers_is_no_header_of_a_spreadsheet(monkeypatch):
    pytest.importorskip("python_calamine")
    rows = [(k, [float(k), 1 - k / 100]) for k in range(1, 5)]
    monkeypatch.setattr(spreadsheet, "worksheets", lambda *_: [("s", rows)])
    found = points(STOPWATCH.read_bytes(), "a.xls", columns={"speed": "1", "epsilon": "2"})
    assert found.epsilon.tolist() == [0.99, 0.98, 0.97, 0.96]


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("v und e eines Balls\n\nv (m/s);e\n0,1;0,93\n0,2;0,9\n", {"speed": "v (m/s)", "epsilon": "e"}),
        ("speed, epsilon, contact time of balls\nv (m/s);e\n0,1;0,93\n0,2;0,9\n", {"speed": "v (m/s)"}),
        ("Höhe (cm);100\n\nZeit (s)\n0\n1\n1,9\n2,7\n", {"time": "Zeit (s)"}),
        ("Höhe (cm);100\n\nZeit (s);n\n0;1\n1;2\n1,9;3\n2,7;4\n", {"time": "Zeit (s)"}),
        ('"t (s)"\n0\n1\n1.9\n2.7\n', {"time": "t (s)"}),
        ('"t (s)" "level (dB)"\n0 1\n1 1\n1.9 2\n2.7 2\n', {"time": "t (s)"}),
        ("Datum;Zeit\n21.11.2024;10:30\nv (m/s);e\n0,1;0,93\n0,2;0,9\n", {"speed": "v (m/s)", "epsilon": "e"}),
        ("drop height\n1 .5\n1 .4\n2 .6\n2 .5\n", {"drop": "drop", "height": "height"}),
    ],
)
def test_the_header_is_the_line_above_the_numbers(text, shown):
    (read_columns,) = recording(text).read
    assert {name: read_columns[name]["column"] for name in shown} == shown


@pytest.mark.parametrize(
    ("text", "columns"),
    [
        ("a,b\ncm/s,%\n100,90\n200,85\n", {"speed": "1", "epsilon": "2"}),
        ("speed;e\n[cm/s];[1]\n100;0,9\n200;0,85\n", {}),
        ("speed;e;sigma_e\ncm/s;1;1\n100;0,9;0,1\n200;0,85;0,1\n", {}),
        ("e,speed\n(1),(cm s^-1)\n.9,100\n.85,200\n", {}),
    ],
)
def test_units_in_a_row_below_the_header_are_read(text, columns):
    found = points(text, columns=columns)
    assert found.speed.tolist() == [1, 2]
    assert found.epsilon == pytest.approx([0.9, 0.85])


def test_a_row_of_ones_is_no_row_of_units():
    assert points("speed;e\n1;1\n2;0,9\n").epsilon.tolist() == [1, 0.9]
    with pytest.raises(ValueError, match="line 2: speed is 'n/a': expected a number > 0"):
        points("speed;e\nn/a;1\n2;0,9\n")


def test_refusals_of_exchanged_columns_and_of_flights_lead_somewhere():
    text = "H (cm),h (cm)\n40.5,50\n49,100\n"
    with pytest.raises(
        ValueError, match=r"0\.5 m is above .* --column drop_height=HEADER and --column rebound_height="
    ):
        points(text)
    found = points(text, columns={"drop_height": "h (cm)", "rebound_height": "H (cm)"})
    assert found.epsilon == pytest.approx([0.9, 0.7])
    text = "T (s)\n.8\n.72\n.63\n"
    with pytest.raises(
        ValueError, match=r"at 0\.72: .* times of flight, expected the name interval, or --column interval="
    ):
        points(text)
    assert points(text, columns={"interval": "T (s)"}).epsilon == pytest.approx([0.9, 0.875])
    assert points(text.replace("T", "interval")).epsilon == pytest.approx([0.9, 0.875])
    with pytest.raises(ValueError, match=r"expected later than the one before$"):
        points("time\n0\n1\n1.9\n0\n1\n1.8\n")


def test_labels_are_lines_of_the_file():
    found = points("# first\nspeed,epsilon\n1,0.9\n\n2,0.8\n3,0.7\n")
    assert found.labels == ("line 3", "line 5", "line 6")
    assert found.without(["line 5"]).speed.tolist() == [1, 3]


HEIGHTS = [300, 195.6, 131, 87.4, 58.4, 40.9, 28, 20.8]  # mm; the rebound of 87.4 mm is line 5 of a file


def column(*cells, header="height (mm)"):
    return "\n".join([header, *map(str, cells)]) + "\n"


GAPS = {
    "an empty cell": (
        column(*(f"{k},{'' if k == 3 else h}" for k, h in enumerate(HEIGHTS)), header="k,height (mm)"),
        {},
        6,
    ),
    "an empty line": (column(*HEIGHTS[:3], "", *HEIGHTS[4:]), {}, 6),
    "every second line empty": (column(*("\n" if k == 3 else f"{h}\n" for k, h in enumerate(HEIGHTS))), {}, 10),
    "nan": (column(*HEIGHTS[:3], "nan", *HEIGHTS[4:]), {}, 6),
    "a number": (column(*(f"{k},{h}" for k, h in enumerate(HEIGHTS) if k != 3), header="Nr.,height (mm)"), {}, 5),
    "a line left out": (column(*HEIGHTS), {"without": ["5"]}, 6),
    "no mark": (column(*HEIGHTS[:3], *HEIGHTS[4:]), {}, 5),
}


@pytest.mark.parametrize("gap", GAPS)
def test_a_missing_rebound_breaks_the_chain_of_heights(gap):
    text, options, line = GAPS[gap]
    recorded = recording(text, **options)
    kept = [math.sqrt(after / before) for before, after in pairwise(HEIGHTS) if 87.4 not in (before, after)]
    assert recorded.points.epsilon == pytest.approx(kept)
    why = "a rebound before it was not measured" if gap == "no mark" else "the one before it is missing"
    assert recorded.left_out == ((f"line {line}", why),)


def test_drops_may_alternate():
    """Lines of another drop between two heights are no gap."""
    recorded = recording("drop,height (m)\na,1\nb,1\na,.81\na,.6561\nb,.7744\n")
    assert recorded.points.epsilon == pytest.approx([0.9, 0.9, 0.88])
    assert recorded.left_out == ()


def test_a_missing_flight_breaks_the_chain_of_flights():
    flights = 600 * 0.85 ** np.arange(7)
    text = column(*(f"{k},{flight:.3f}" for k, flight in enumerate(flights) if k != 3), header="n,interval (ms)")
    recorded = recording(text)
    assert recorded.points.epsilon == pytest.approx([0.85] * 4, rel=1e-4)
    assert ("line 5", "the one before it is missing") in recorded.left_out
    assert recorded.read[0]["number"]["column"] == "n"


def test_a_column_that_does_not_count_is_not_taken_for_numbers():
    text = column(
        *(f"{mass},{h}" for mass, h in zip([5, 5, 6, 7, 7, 8, 8, 8], HEIGHTS, strict=True)), header="m,height (mm)"
    )
    assert recording(text).read[0]["unused"] == ["m"]


def test_instants_heights_and_pairs_of_heights_are_one_drop():
    flight = Flight(10.0)
    launch = np.array([3.0, 2.7, 2.4, 2.1, 1.8])
    instants = np.concatenate([[0.5], 0.5 + np.cumsum(2 * launch / 10)])
    heights = launch**2 / 20
    by_time = points("time (ms)\n" + "\n".join(f"{1000 * t:.12g}" for t in instants), flight=flight, resolution="1 ms")
    by_height = points("height (mm)\n" + "\n".join(f"{1000 * h:.12g}" for h in heights), flight=flight)
    pairs = pairwise(heights.tolist())
    by_pair = points("drop_height,rebound_height\n" + "\n".join(f"{a!r},{b!r}" for a, b in pairs), flight=flight)
    for found in (by_time, by_height, by_pair):
        assert found.speed.tolist() == pytest.approx([3.0, 2.7, 2.4, 2.1])
        assert found.epsilon.tolist() == pytest.approx((launch[1:] / launch[:-1]).tolist())
    assert by_time.labels[0] == "line 3"
    assert not by_time.errors_complete
    assert points("time\n1\n2\n2.9\n", resolution="1 ms", scatter=False).errors_complete
    assert by_time.epsilon_errors.toarray().any()
    assert not by_height.epsilon_errors.toarray().any()


def test_drops_are_told_apart():
    rows = [(1, 0.0), (1, 0.5), (1, 0.95), (2, 3.0), (2, 3.6), (2, 4.14), (2, 4.63)]
    found = points("drop,time\n" + "\n".join(f"{d},{t}" for d, t in rows))
    assert found.epsilon.tolist() == pytest.approx([0.9, 0.9, 0.49 / 0.54])
    assert found.labels == ("line 3", "line 6", "line 7")
    in_turns = points("drop,time\na,0\nb,0\na,1\nb,1\na,1.9\nb,1.8\na,2.7\n")
    assert in_turns.epsilon.tolist() == pytest.approx([0.9, 0.8 / 0.9, 0.8])


def test_errors_that_leave_points_without_one_are_scatter_or_refused():
    text = "time,sigma\n0,0\n1,0\n1.9,.001\n2.7,.001\n3.42,0\n4.06,0\n"
    assert vp.fit(points(text)).beta > 0
    with pytest.raises(ValueError, match=r"eps has no standard errors|combination of points"):
        vp.fit(points(text, scatter=False))
    with pytest.raises(ValueError, match="line 3: sigma_time is '-1': expected a number >= 0"):
        points("time,sigma\n0,0\n1,-1\n1.9,.001\n")


def test_robust_fits_are_for_errors_that_points_do_not_share():
    found = points("time\n0\n1\n1.9\n2.7\n3.42\n", resolution="1 ms")
    with pytest.raises(ValueError, match="bounces share errors"):
        vp.fit(found, robust=True)


def test_phyphox_as_spreadsheet_csv_and_archive():
    pytest.importorskip("python_calamine")
    found = points(PHYPHOX.read_bytes(), "phyphox.xls", flight=Flight(9.81))
    times = np.array([0.312, 0.9012, 1.4309, 1.9083, 2.3390, 2.7281])
    spans = np.diff(times)
    assert found.epsilon.tolist() == pytest.approx((spans[1:] / spans[:-1]).tolist())
    assert found.speed.tolist() == pytest.approx((9.81 / 2 * spans[:-1]).tolist())
    header = ";".join(f'"Bounce {k} (s)";"Height {k} (m)"' for k in range(6))
    row = ";".join(f"{t:.4f};0.5".replace(".", ",") for t in times)
    as_csv = points(f"{header}\n{row}\n", flight=Flight(9.81))
    assert as_csv.epsilon.tolist() == pytest.approx(found.epsilon.tolist())
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        archive.writestr("meta/device.csv", "property,value\nversion,1\n")
        archive.writestr("Energy.csv", f"{header}\n{row}\n")
    zipped = points(packed.getvalue(), "export.zip", flight=Flight(9.81))
    assert zipped.epsilon.tolist() == pytest.approx(found.epsilon.tolist())


def test_phyphox_that_heard_fewer_bounces():
    found = points("Bounce 0 (s),Bounce 1 (s),Bounce 2 (s),Bounce 3 (s)\n0.0,0.5,0.95,\n1.0,1.5,NaN,NaN\n")
    assert found.epsilon.tolist() == pytest.approx([0.9])
    assert found.labels == ("line 2, Bounce 1",)


STOPWATCH = Path(__file__).with_name("stopwatch.xls")
"""Made with xlwt: the sheets of phyphox's acoustic stopwatch with invented instants, of which one is an echo."""


def test_the_acoustic_stopwatch_has_its_instants_in_three_sheets():
    pytest.importorskip("python_calamine")
    found = recording(STOPWATCH.read_bytes(), "stopwatch.xls")
    assert dict(found.sheets) == {
        "stopwatch.xls, sheet Simple": "its instants are in other sheets",
        "stopwatch.xls, sheet Multiple": "its instants are in other sheets",
        "stopwatch.xls, sheet All": 7,
        "stopwatch.xls, sheet Metadata Device": "no columns of data",
        "stopwatch.xls, sheet Metadata Time": "no columns of data",
    }
    assert found.left_out == (("line 6", "an echo or another sound"),)
    assert found.points.epsilon == pytest.approx(0.87, abs=0.01)
    multiple = recording(STOPWATCH.read_bytes(), "stopwatch.xls", sheets=["Multiple"])
    assert [label for label, _ in multiple.left_out] == ["line 2, Stop 4"]
    assert len(multiple.points) == 3
    with pytest.raises(ValueError, match="there is no sheet 'Raw': its sheets are 'Simple', 'Multiple', 'All', 'Meta"):
        recording(STOPWATCH.read_bytes(), "stopwatch.xls", sheets=["Raw"])


@pytest.mark.parametrize(
    "header",
    [
        "Start (s),Stop 1 (s),Total energy,Stop 2 (s),Total energy,Stop 3 (s)",
        "Bounce 0 (s),Bounce 1 (s),Total energy,Bounce 2 (s),Total energy,Bounce 3 (s)",
    ],
)
def test_older_forms_of_inelastic_collision_have_equal_headers(header):
    found = points(f"{header}\n0.1,0.6,0.8,1.05,0.8,1.455\n")
    assert found.epsilon == pytest.approx([0.9, 0.9])
    assert [label.split()[-1] for label in found.labels] == ["1", "2"]


def test_several_files_are_fitted_together():
    drops = [(f"time\n0\n{t}\n{1.9 * t}\n{2.71 * t}\n".encode(), f"somewhere/{t}.csv") for t in (0.5, 0.6)]
    found = read.recording(drops)
    assert found.points.epsilon == pytest.approx([0.9] * 4)
    assert found.points.labels == tuple(f"{t}.csv, line {k}" for t in (0.5, 0.6) for k in (3, 4))
    assert found.sheets == (("0.5.csv", 2), ("0.6.csv", 2))
    without = read.recording(drops, Options(without=["0.6.csv:5"])).points
    assert without.labels == ("0.5.csv, line 3", "0.5.csv, line 4", "0.6.csv, line 3")
    with pytest.raises(ValueError, match=r"line 5 is in 2 sheets or files: expected NAME:5"):
        read.recording(drops, Options(without=["5"]))
    with pytest.raises(
        ValueError, match=r"b\.csv: the file has speeds, but somewhere/0\.5\.csv has instants: expected"
    ):
        read.recording([*drops, (b"speed,epsilon\n1,0.9\n", "b.csv")])


def test_speeds_before_and_after_have_their_errors():
    found = points("v_in,v_out\n1,0.9\n2,1.7\n", resolution="1 cm/s")
    assert found.standard_errors == pytest.approx([0.01 * np.hypot(1, 0.9), 0.005 * np.hypot(1, 0.85)])


@pytest.mark.parametrize("of", ["v", "v_in", "v_out"])
def test_errors_of_one_of_two_speeds_are_those_of_both_and_said_so(of):
    found = recording(f"v_in,v_out,sigma_{of}\n1,0.9,0.01\n2,1.7,0.01\n")
    assert [found.read[0][name]["error"] for name in ("speed", "speed_out")] == [f"sigma_{of}"] * 2
    assert found.points.standard_errors == pytest.approx([0.01 * np.hypot(1, 0.9), 0.005 * np.hypot(1, 0.85)])


def test_columns_of_one_series_may_have_units_of_their_own():
    found = recording("h0 (m),h1 (cm),h2 (cm)\n1,81,64\n")
    assert found.read[0]["heights"]["unit"] == ["m", "cm", "cm"]
    assert found.points.epsilon == pytest.approx(np.sqrt([0.81, 0.64 / 0.81]))


def test_a_comma_before_three_digits_is_decided_by_the_whole_sheet(monkeypatch):
    pytest.importorskip("python_calamine")
    rows = [(1, ["v", "e"]), (2, ["1,053", "0,9"]), (3, ["2,5", "0,85"]), (4, [3.0, 0.8])]
    monkeypatch.setattr(spreadsheet, "worksheets", lambda *_: [("s", rows)])
    found = recording(STOPWATCH.read_bytes(), "a.xls")
    assert found.points.speed.tolist() == [1.053, 2.5, 3]
    assert found.warnings == ("line 2: '1,053' is read as 1.053, as other numbers have decimal commas",)


def test_lines_are_left_out_before_they_are_looked_at():
    text = "speed,epsilon\n1,0.9\n2,broken\n3,0.8\n4,-1\n"
    assert points(text, without=["3", "5"]).speed.tolist() == [1, 3]
    with pytest.raises(ValueError, match="there is no point 'line last'"):
        points(text, without=["3", "5", "last"])
    with pytest.raises(ValueError, match="there is no line 9 with data: expected 2 to 5"):
        points(text, without=["9"])


def test_intervals_and_ends_of_contacts_are_the_same_drop():
    instants, contacts = np.cumsum([0, 0.6, 0.51, 0.44, 0.38]), np.array([0.004, 0.005, 0.006, 0.007, 0.008])
    rows = "\n".join(f"{t:.6f},{t + c:.6f}" for t, c in zip(instants, contacts, strict=True))
    found = points(f"impact_time,release_time\n{rows}\n", resolution="1 ms")
    flights = np.diff(instants) - contacts[:-1]
    assert found.epsilon == pytest.approx(flights[1:] / flights[:-1], rel=2e-3)  # the ball leaves from below its height
    same = bounces.of_times([(instants, "abcde")], Flight(), durations=[contacts])
    assert found.epsilon == pytest.approx(same.epsilon)
    assert found.weight_speed == pytest.approx(same.weight_speed) != 0
    rows = "\n".join(f"{t:.6f},{1000 * c:.3f}" for t, c in zip(instants, contacts, strict=True))
    of_column = points(f"time (s),contact_time (ms)\n{rows}\n", resolution="1 ms")
    assert of_column.epsilon == pytest.approx(found.epsilon)
    assert found.contact_time == pytest.approx(contacts[1:-1])
    plain = points("interval (ms)\n600\n510\n440\n380\n")
    assert plain.epsilon == pytest.approx([0.51 / 0.6, 0.44 / 0.51, 0.38 / 0.44])
    assert plain.labels == ("line 2", "line 3", "line 4")


def test_an_eps_above_1_and_one_of_0_are_data():
    text = "speed,epsilon,sigma_epsilon\n.1,1.003,.01\n1,.96,.01\n10,.92,.01\n{}"
    found = vp.fit(points(text.format("")))
    assert found.beta == pytest.approx(0.045, abs=0.01)
    assert found.betas[0] == 0
    assert found.main.residuals[0] == pytest.approx(1.003 - found.main.epsilon(np.array([0.1]))[0])
    stuck = vp.fit(points("speed,epsilon\n.1,.6\n1,.4\n10,.2\n100,0\n"))
    assert stuck.betas[-1] == np.inf


@pytest.mark.parametrize("wide", ["utf-16", "cp1252"])
def test_encodings(wide):
    text = "speed (m/s);epsilon;Größe\n1;0,9;a\n2;0,8;b\n3;0,7;c\n"
    assert points(text.encode(wide)).epsilon.tolist() == [0.9, 0.8, 0.7]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "x,y\n1,2\n",
            "the columns are 'x', 'y': expected names such as time .s.; .* --column NAME=HEADER, such as .*=UNIT",
        ),
        ("speed,v,epsilon\n1,1,0.9\n", "'speed' .column 1. and 'v' .column 2. are both speed: expected one"),
        ("speed,epsilon\n1,90\n2,85\n3,0.8\n", "line 2: eps is 90: expected 0 to 2"),
        ("speed,epsilon\n1,0.9\n2,-0.01\n3,0.8\n", "line 3: eps is -0.01: expected 0 to 2"),
        (
            "speed,epsilon,sigma_epsilon\n1,0.9,.01\n2,1.06,.01\n3,0.8,.01\n",
            "line 3: eps is 1.06: expected 0 to 1.05 .1 and 5 standard errors",
        ),
        ("speed,speed_out\n1,0.9\n0,0.8\n3,0.8\n", "line 3: speed is '0': expected a number > 0"),
        ("speed,epsilon\n1,0.9\n0,0.8\n3,0.8\n", "line 3: speed is '0': expected a number > 0"),
        ("speed,epsilon\n1,0.9\nnan,0.8\n3,0.8\n", "line 3: speed is 'nan': expected a number"),
        ("speed,epsilon\n1,0.9\n2\n3,0.8\n", "line 3: epsilon is '': expected a number"),
        ("speed (kg),epsilon\n1,0.9\n2,0.8\n", "the unit of speed is 'kg'"),
        ("speed,epsilon (m)\n1,0.9\n2,0.8\n", "the unit of epsilon is 'm': expected none or %"),
        ("time\n1\n3\n2\n", "line 4: the bounce is at 2: expected later than the one before"),
        (
            "time\n1\n2\n4\n",
            "three bounces in succession: .* line 3: ambiguous: an echo or another sound, or the bounce after it",
        ),
        ("t,x\n0,1\n0.1,2\n0.2,2\n0.3,1\n0.4,1\n0.5,1\n", "the times are evenly spaced, as in a recording"),
        ("drop,time\na,0\na,1\na,1.9\ndrop,time\nb,0\nb,1\nb,1.8\n", "line 5: time is 'time': expected a number"),
        ("v,e\n1,bad\nv,e\n2,.8\n", "line 3: speed is 'v': expected a number > 0"),
        ("v,e\n1,.9\n" + "2" * 140_000 + ",.9", "the file is not CSV: field larger than"),
        ("speed,epsilon\n,\n,\n", "there are no rows with data"),
        (
            "speed,eps\n1,0,0,9\n2,0,0,8\n",
            "line 2: 4 cells under 2 names: a decimal comma needs another separator, such as ;",
        ),
        ("speed,eps,remark\n1,0.9\n2,0.8,ok,ok2,\n", "line 3: 4 cells under 3 names"),
        ("speed eps\n100 0.9\n1 000 0.8\n", "line 3: 3 cells under 2 names: expected at most as many"),
        ("speed,eps\n1,0.9\n2,85 %\n", "line 3: epsilon is '85 %': write epsilon as 0.85, or % in the header"),
        ("bounce 0,bounce 1,bounce 2\nNaN,NaN,NaN\n1,2,\n", "no drop has three bounces in succession"),
        ("impact_time,release_time\n0,0.1\n1,0.9\n1.9,2\n", "line 3: the release_time is before the impact"),
        ("time,sigma\n0,1e300\n1,1e300\n1.9,1e300\n", "line 3: the standard error of eps is"),
        ("interval\n1\n-1\n0.9\n", "line 3: interval is '-1': expected a number > 0"),
        ("time\n1\n2\n", "no drop has three bounces"),
        ("height\n1\n-2\n", "line 3: height is '-2': expected a number > 0"),
        ("height\n1\nmissed\n", "line 3: height is 'missed': expected a number > 0, or an empty cell"),
        ("v,e\n1,.9 ± .1\n", "line 2: epsilon is '.9 ± .1': expected its error in a column"),
        ("nr,heard after seconds\n1,2\n", "such as --column time='heard after seconds'; --unit"),
        ("height\n1\n", "no drop has two heights"),
        ("drop height (cm)\n50\n60\n70\n", "the columns are 'drop height .cm.': expected"),
        ("# 3 balls\nrebound height (cm)\n50\n60\n70\n", "the columns are 'rebound height .cm.': expected"),
        ("", "the file has 0 lines with data"),
        (b"\x00\x01\x02", "the file is not text"),
        ('speed,epsilon\n"1,0.9\n2,0.8\n', "the file is not CSV|a quoted cell extends"),
    ],
)
def test_what_is_wrong_is_one_line_that_names_the_place(text, message):
    with pytest.raises(ValueError, match=message) as caught:
        points(text)
    assert str(caught.value).startswith("data.csv")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["data.xls", "data.ods", "data.zip"])
@pytest.mark.parametrize("content", [b"speed,epsilon\n1,0.9\n", b"PK\x03\x04rubbish"])
def test_a_spreadsheet_that_is_none_is_refused(name, content):
    pytest.importorskip("python_calamine")
    with pytest.raises(ValueError, match=rf"{name}: (the content is not|the spreadsheet|the ZIP)"):
        points(content, name)


@pytest.mark.parametrize(
    ("text", "options", "message"),
    [
        (
            "speed,epsilon\n1,0.8\n",
            {"contact_time": 1e-3},
            "--contact-time is for bounces: expected a column contact_time",
        ),
        ("time\n1\n2\n2.9\n", {"contact_time": -1.0}, "contact_time is -1"),
        ("time\n1\n2\n2.9\n", {"resolution": "20"}, "line 3: the standard error of eps is"),
        ("time\n1000\n2000\n2900\n", {}, "the speed is 4.9e.03 m/s: expected 1e-09 to 100 m/s; is the unit right"),
        ("speed;epsilon\n1,000;0.92\n2,000;0.9\n", {}, "line 2: '1,000' has a comma, line 2 has '0.92'"),
        ("time\n1\n2\n2.9\n", {"resolution": "1 mm"}, "resolution is '1 mm': expected a time"),
        ("time,sigma\n1,1\n2,1\n2.9,1\n", {"resolution": "1 ms"}, "expected no --resolution"),
        ("speed,epsilon\n1,0.9\n", {"scatter": False}, "eps has no standard errors"),
        ("time\n1\n2\n2.9\n", {"scatter": False}, "eps has no standard errors"),
        ("speed,epsilon\n1,0.9\n", {"columns": {"speed": "w"}}, "there is no column 'w'"),
        (
            "speed,epsilon\n1,0.9\n",
            {"units": {"time": "s"}},
            "there is no column 'time': expected one, because an option names it",
        ),
        (
            "time\n1\n1.1\n1.19\n",
            {"contact_time": 0.2},
            "0.1 s after the last one, but a contact takes 0.2 s: is the contact time right",
        ),
    ],
)
def test_options_that_do_not_fit_the_file(text, options, message):
    with pytest.raises(ValueError, match=message):
        points(text, **options)


def test_contact_times_lengthen_the_intervals():
    instants, contact = np.array([0.0, 0.51, 0.97, 1.384]), 0.01
    text = "time\n" + "\n".join(map(repr, instants.tolist()))
    found = points(text, contact_time=contact)
    spans = np.diff(instants) - contact
    assert found.epsilon.tolist() == pytest.approx((spans[1:] / spans[:-1]).tolist())


def test_a_file_of_many_rows_is_read():
    rows = "\n".join(f"{1 + i / 1e5:.6f},0.9" for i in range(50_000))
    assert len(points(f"speed,epsilon\n{rows}\n")) == 50_000
    many = "\n".join(map(str, range(20_001)))
    with pytest.raises(ValueError, match="there are 20001 instants: expected up to 20000"):
        points(f"time\n{many}\n")


def test_a_rebound_missing_in_a_row_is_found():
    """Its later heights stand a column to the left: eps across the gap, 0.48, is no eps of a bounce."""
    rows = ["h0 (mm),h1 (mm),h2 (mm),h3 (mm),h4 (mm)", "600,288,138,66,32", "500,240,115,55,26", "400,192,44,21,"]
    found = recording("\n".join(rows))
    assert found.left_out == (("line 4, h2", "a rebound before it was not measured"),)
    assert len(found.points) == 10


def test_a_title_in_a_spreadsheet_is_no_header():
    """CSV of a spreadsheet fills its rows with empty cells."""
    german = "Versuch,Starthöhe (mm),Rücksprung 1 (mm),Rücksprung 2 (mm)"
    found = points(f"Stahlplatte,,,\n{german}\n1,600,288,138\n2,500,240,115\n")
    assert found.epsilon == pytest.approx(np.sqrt([288 / 600, 138 / 288, 240 / 500, 115 / 240]))
    with pytest.raises(ValueError, match=r"the columns are 'Nr', 'x \(mm\)', 'y \(mm\)': .*NAME=HEADER; --unit"):
        points("Stahlplatte,,\nNr,x (mm),y (mm)\n1,600,288\n2,500,240\n")
