"""The report says what the result says: its numbers, its picture, its choice; and it stands alone, in a browser too."""

import copy
import hashlib
import json
import os
import random
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from html.parser import HTMLParser
from itertools import combinations, pairwise, product
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from matplotlib.image import imread

from tests.devtools import browser
from tests.patience import HANGS
from viscopade.arithmetic.formats import FORMATS
from viscopade.arrays import double
from viscopade.cli import writer
from viscopade_lab.bench import result as result_module
from viscopade_lab.bench.contender import MEASURES
from viscopade_lab.bench.result import Result, Timing
from viscopade_lab.bench.speed_range import DISTRIBUTIONS, SpeedRange
from viscopade_lab.report import choice, labels, page, picture
from viscopade_lab.report import render as report
from viscopade_lab.report.choice import Point, choices, frontier, panel, panels
from viscopade_lab.report.labels import Box, place, shortened
from viscopade_lab.report.picture import NARROW, WIDE, drawn_curves, drawn_panels

SAMPLE = Path(__file__).parents[1] / "data" / "bench_result.json"
COMMITTED = Path(__file__).parents[2] / "docs" / "bench" / "result.json"
LAYOUTS = {"wide": WIDE, "narrow": NARROW}


@pytest.fixture(scope="module")
def data():
    return json.loads(SAMPLE.read_text())


@pytest.fixture(scope="module")
def files(data):
    return drawn_report(data)


@pytest.fixture(scope="module")
def html(files):
    return files["report.html"]


def drawn_report(data, formats=report.FORMATS):
    """The report's files on a result as JSON holds it."""
    return report.render(Result.from_json(data), formats)


def words_of_page(data):
    """The page without pictures, whose drawing takes a second."""
    return page.html(Result.from_json(data), {}, [])


def small(data, **changes):
    """The sample with few rows, so that it is drawn fast; a deep copy."""
    kept = ("lookup_1em5", "pow_3_6", "copy")
    rows = [r for r in data["rows"] if r["id"] in kept and (r["format"], r["speeds"]) == ("double", "log-uniform")]
    found = copy.deepcopy({**data, "rows": rows, "curves": data["curves"][:1]})
    return {**found, **changes}


class Tables(HTMLParser):
    """The tables of a page by id, as lists of rows of cells' texts, and every tag with its attributes."""

    def __init__(self, text):
        super().__init__()
        self.tables, self.tags, self.cell, self.open = {}, [], None, None
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        self.tags.append((tag, attributes))
        if tag == "table":
            self.open = self.tables.setdefault(attributes["id"], [])
        elif tag == "tr":
            self.open.append([])
        elif tag in ("td", "th"):
            self.open[-1].append("")
            self.cell = True

    def handle_endtag(self, tag):
        if tag in ("td", "th"):
            self.cell = False

    def handle_data(self, data):
        if self.cell:
            self.open[-1][-1] += data


@pytest.fixture(scope="module")
def tables(html):
    return Tables(html).tables


# --- the page ---------------------------------------------------------------------------------------------------------


def number(text):
    text = text.replace(",", "").strip()
    if text == "–":
        return None
    return float(text.removesuffix(" %")) / 100 if text.endswith(" %") else float(text)


def same(cell, value, tolerance=6e-4):
    found = number(cell)
    return found == value if value is None or not value else found == pytest.approx(value, rel=tolerance, abs=0)


def test_every_time_stands_in_a_table(data, tables):
    for measure in MEASURES:
        expected = [row for row in data["rows"] if row["measure"] == measure]
        lines = [row for row in tables[f"times-{measure}"] if len(row) == 7][1:]
        assert len(lines) == len(expected)
        for row in expected:
            ns = row["ns"]
            values = (ns["median"], ns["min"], ns["spread"], row["ratio_to_3_6"], row["ratio_to_copy"])
            tolerances = (6e-4, 6e-4, 6e-3, 6e-4, 6e-4)
            assert any(
                line[0].endswith(row["label"]) and all(map(same, line[2:], values, tolerances)) for line in lines
            ), row


def test_times_stand_below_the_speeds_they_were_measured_at(data, tables):
    title, found = None, {}
    for line in tables["times-throughput"]:
        if len(line) == 1:
            title = line[0]
        elif title:
            found.setdefault(title, []).append(number(line[2]))
    rows = [row for row in data["rows"] if row["measure"] == "throughput"]
    for form in FORMATS:
        for speeds in DISTRIBUTIONS:
            expected = sorted(r["ns"]["median"] for r in rows if (r["format"], r["speeds"]) == (form, speeds))
            name = f"{page.PRECISION[form].capitalize()}; {page.SPEEDS_TEXT[speeds]}"
            assert found.get(name, []) == pytest.approx(expected, rel=6e-4)


def test_every_error_stands_in_the_table(data, tables):
    lines = tables["errors"][1:]
    assert len(lines) == len(data["errors"])
    for line, error in zip(lines, data["errors"], strict=True):
        assert line[0].endswith(error["label"])
        assert line[1] == error["format"]
        assert same(line[2], error["relative"], 6e-3)
        assert same(line[3], error["loss"], 6e-3)
        assert line[4:] == [error["proven"] or "–", error["note"]]


def test_every_target_stands_in_the_table(data, tables):
    verdicts = {True: "✓ yes", False: "✗ no", None: "– not measured"}
    lines = tables["targets"][1:]
    assert len(lines) == len(data["targets"])
    for line, target in zip(lines, data["targets"], strict=True):
        measured = "–" if target["measured"] is None else str(target["measured"])
        assert line == [target["what"], target["target"], measured, verdicts[target["reached"]], target["note"]]


def test_says_where_and_how_it_was_measured(data, html):
    settings = data["settings"]
    for text in (*data["machine"].values(), *settings["flags"].values(), data["command"]):
        assert text in html
    assert f"{settings['rounds']} rounds" in html
    assert f"{settings['memory_elements']:,} numbers" in html
    assert "SAMPLE" in html
    low, high = (
        float(double.epsilon(settings["scene"]["beta"] ** 0.5 * settings["scene"][end] ** 0.1))
        for end in ("speed_min", "speed_max")
    )
    assert re.search(r"ε from 0\.910 to\s+0\.0652", html)
    assert (low, high) == pytest.approx((0.910, 0.0652), rel=1e-3)


def test_nothing_is_fetched_and_nothing_runs(html):
    for tag, attributes in Tables(html).tags:
        assert tag not in ("script", "link", "img", "iframe", "object", "embed", "base", "image", "style-sheet")
        for name, value in attributes.items():
            assert not name.startswith("on")
            assert name != "src"
            if name.endswith("href"):
                assert value.startswith("#")
    assert "http:" not in html
    assert "https:" not in html
    assert "@import" not in html
    assert all(target.startswith("#") for target in re.findall(r"url\(([^)]*)", html))
    assert "default-src 'none'" in html


def test_ids_are_unique_and_references_have_targets(html):
    ids = [attributes["id"] for _, attributes in Tables(html).tags if "id" in attributes]
    assert len(set(ids)) == len(ids)
    assert set(re.findall(r'(?:href="|url\()#([^")]+)', html)) <= set(ids)


def test_pictures_follow_the_style_sheet(html):
    drawn = "".join(re.findall(r"<svg.*?</svg>", html, flags=re.DOTALL))
    assert len(re.findall("<svg", html)) == 6  # double, float and the curves, each wide and narrow
    assert not re.findall(r"#[0-9a-f]{6}\b(?!-)", re.sub(r'(id|href)="[^"]*"|url\([^)]*\)', "", drawn))
    style = html[: html.index("</style>")]
    for variable in set(re.findall(r"var\((--[\w-]+)\)", html)):
        assert style.count(f"{variable}:") == (1 if variable in ("--none",) else 2), variable  # light and dark


def test_text_is_escaped(data):
    nasty = "<b>&amp;</b>\"' $x^2$ {{ 7 * 7 }} --> ]]>"
    changed = small(data)
    for key in ("rows", "errors", "curves"):
        for entry in changed[key]:
            entry["label"] = nasty + entry["id"]
    changed["errors"][0]["note"] = changed["machine"]["cpu"] = changed["command"] = nasty
    changed["targets"] = [{"what": nasty, "target": nasty, "measured": nasty, "reached": None, "note": nasty}]
    found = drawn_report(changed, ["svg"])
    assert "<b>&amp;</b>" not in found["report.html"]
    assert "{{ 7 * 7 }}" in found["report.html"]
    assert Tables(found["report.html"]).tables["targets"][1][0] == nasty
    ET.fromstring(found["speed_against_error.svg"])


def test_without_curves_a_line_says_so(data, html):
    assert "no error curves" not in html
    without = small(data)
    del without["curves"]
    assert "This result holds no error curves" in drawn_report(without, [])["report.html"]


def test_shows_the_sampled_error_where_it_exceeds_the_proof(data):
    changed = small(data)
    (error,) = (e for e in changed["errors"] if (e["id"], e["format"]) == ("lookup_1em5", "double"))
    error.update(relative=9e-6, loss=8e-6, note="without the root")
    result = Result.from_json(changed)
    (point,) = (p for p in panel(result, "double", "throughput").points if p.row.id == "lookup_1em5")
    assert (point.error, point.proven) == (9e-6, False)
    assert "the sampled error 9.00e-6 is larger than the proven bound 6.7e-6 (without the root)" in " ".join(
        words_of_page(changed).split()
    )


def with_error(data, **changes):
    """The sample's rows and errors of one kernel of ours only, with another error."""
    changed = small(data)
    changed["rows"] = [row for row in changed["rows"] if row["id"] == "lookup_1em5"]
    (error,) = (e for e in changed["errors"] if (e["id"], e["format"]) == ("lookup_1em5", "double"))
    changed["errors"] = [{**error, **changes}]
    return changed


def alarms(page_text):
    return [attributes for _, attributes in Tables(page_text).tags if attributes.get("class") == "alarm"]


@pytest.mark.parametrize("form", ["double", "float"])
@pytest.mark.parametrize("share", [0.1, 0.9, 2])
def test_what_the_root_adds_is_explained_and_more_is_an_alarm(data, form, share):
    scene = Result.from_json(data).conditions.range
    unit = {"double": 2.0**-53, "float": 2.0**-24}[form]
    bound, added = 2 * unit, result_module.of_root(form, scene)
    found = with_error(
        data, proven=f"{bound!r}", proven_of="v_star", format=form, relative=bound + share * added, loss=0
    )
    text = words_of_page(found)
    (error,) = Result.from_json(found).errors
    assert error.exceeds_proof
    assert len(alarms(text)) == (share > 1) == error.contradicts_proof
    assert ("with the rounding of v* at most" in text) == (share < 1)
    assert "comes on top" in text.partition("with the rounding of v* at most")[0]


def test_the_same_error_of_a_kernel_of_the_speed_is_an_alarm(data):
    errors = {"proven": "1 ulp", "format": "double", "relative": 4e-15, "loss": 0}
    shown = [words_of_page(with_error(data, proven_of=of, **errors)) for of in ("v_star", "speed")]
    assert [len(alarms(text)) for text in shown] == [0, 1]


def test_what_the_root_adds_is_no_less_than_what_it_does():
    """v* as C computes it (NumPy's pow is the C library's), at many speeds, through the exact function."""
    scene = SpeedRange(1.307, 1e-3, 1e3, "cm/s")
    for form, kind in (("double", np.float64), ("float", np.float32)):
        speed = np.geomspace(scene.speed_min, scene.speed_max, 4001).astype(kind)
        v_star = np.sqrt(kind(scene.beta)) * speed ** kind(0.1)
        true = np.sqrt(np.longdouble(kind(scene.beta))) * speed.astype(np.longdouble) ** (np.longdouble(1) / 10)
        off = np.abs(v_star.astype(np.longdouble) / true - 1).astype(float)
        worst = np.max(off * np.abs(double.slope(v_star.astype(float))))
        assert 0 < worst < result_module.of_root(form, scene) < 40 * worst


def test_a_result_is_written_as_it_was_read():
    text = COMMITTED.read_text()
    result = Result.from_text(text, "result.json")
    assert json.dumps(result.to_json(), ensure_ascii=False, indent=1) + "\n" == text
    assert Result.from_json(result.to_json()) == result


def test_committed_result_contradicts_no_proof():
    result = Result.from_text(COMMITTED.read_text(), "result.json")
    assert [error.id for error in result.errors if error.exceeds_proof] == ["full", "full"]
    assert not [error.id for error in result.errors if error.contradicts_proof]


def test_a_printed_error_is_rounded_up():
    assert page.scientific(6.7001e-6) == "6.71e-6"
    assert page.scientific(1.001e-3, 1) == "2e-3"


def test_a_method_without_error_is_named(data):
    changed = small(data)
    changed["errors"] = [e for e in changed["errors"] if e["id"] != "pow_3_6"]
    assert "no error is known: pow + [3/6], 6 digits (double)" in words_of_page(changed)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, "–"),
        (0, "0"),
        (0.6123, "0.6123"),
        (9.9996, "10.00"),
        (12, "12.00"),
        (123456, "123,456"),
        (2e-5, "2.000e-5"),
    ],
)
def test_numbers_have_four_digits(value, text):
    assert page.significant(value) == text


@pytest.mark.parametrize(
    ("value", "text"), [(None, "–"), (0, "0"), (6.7e-6, "6.70e-6"), (2, "2.00e0"), (7.7e9, "7.70e9")]
)
def test_errors_are_in_scientific_notation(value, text):
    assert page.scientific(value) == text


# --- which kernel to take ---------------------------------------------------------------------------------------------


def point(time, error, name="k"):
    row = Timing(name, name, "ours", "double", "log-uniform", "memory", time, time, 0.1, None, None)
    return Point(row, time, error, True)


def random_points(count, seed):
    rng = random.Random(seed)
    times, errors = range(1, 12), [None, *(10.0**-n for n in range(9))]  # few values: many ties
    return [point(rng.choice(times), rng.choice(errors), str(i)) for i in range(count)]


@pytest.mark.parametrize("seed", range(40))
def test_frontier_is_what_nothing_dominates(seed):
    given = random_points(seed, seed)
    rated = [p for p in given if p.error is not None]

    def dominated(p):
        return any(q.time <= p.time and q.error <= p.error and (q.time < p.time or q.error < p.error) for q in rated)

    found = frontier(given)
    assert {p.row.id for p in found} == {p.row.id for p in rated if not dominated(p)}
    assert found == sorted(found, key=lambda p: p.time)


@pytest.mark.parametrize("seed", range(20))
def test_the_fastest_that_is_accurate_enough_is_chosen(seed):
    given = random_points(12, seed)
    shown = choice.PicturePanel("memory", "log-uniform", "", given)
    for chosen in choices([shown]):
        need = 4 * min(p.error for p in given if p.error is not None) if chosen.need is None else chosen.need
        enough = [p for p in given if p.error is not None and p.error <= need]
        (fastest,) = chosen.fastest
        assert fastest in enough
        assert all(p.time >= fastest.time for p in enough)
    met = [need for need in choice.NEEDS if any(p.error is not None and p.error <= need for p in given)]
    assert [chosen.need for chosen in choices([shown])] == [*met, None]


def test_a_bound_counts_as_small_as_a_sample_within_a_factor_of_4():
    shown = choice.PicturePanel("memory", "log-uniform", "", [point(1, 4.1e-16), point(2, 4e-16), point(9, 1e-16)])
    assert choices([shown])[-1].fastest[0].time == 2


def test_choice_stands_on_the_page(data, tables):
    header, *lines = tables["choice-double"]
    assert header[0] == "Error at most"
    assert [line[0] for line in lines] == ["1e-3", "1e-5", "1e-7", "1e-10", "about the smallest"]
    rows = [r for r in data["rows"] if (r["format"], r["speeds"], r["measure"]) == ("double", "log-uniform", "memory")]
    errors = {
        e["id"]: float(e["proven"] or max(e["relative"] or 9, e["loss"] or 9))
        for e in data["errors"]
        if e["format"] == "double"
    }
    for line, need in zip(lines, [1e-3, 1e-5, 1e-7, 1e-10, 4 * min(errors.values())], strict=True):
        best = min((r for r in rows if errors[r["id"]] <= need), key=lambda r: r["ns"]["median"])
        assert line[-1].startswith(f"{best['label']}, {page.significant(best['ns']['median'], 3)}\N{NO-BREAK SPACE}ns")
        assert f"{page.significant(best['ratio_to_copy'], 3)} times a copy" in line[-1]


def test_faster_and_slower_are_not_mixed_up(data, tables):
    by_need = {line[0]: line for line in tables["choice-double"][1:]}
    (row,) = (
        r
        for r in data["rows"]
        if (r["id"], r["format"], r["speeds"], r["measure"]) == ("lookup_1em5", "double", "log-uniform", "throughput")
    )
    assert row["ratio_to_3_6"] < 1
    assert f"{1 / row['ratio_to_3_6']:.1f} times faster than pow + [3/6]" in by_need["1e-5"][2].replace(
        "\N{NO-BREAK SPACE}", " "
    )


# --- the picture ------------------------------------------------------------------------------------------------------


def boxes(sheet, prefix):
    """Boxes of what has a gid with this prefix, on the sheet, by the rest of the gid."""
    found = sheet.findobj(lambda artist: str(artist.get_gid() or "").startswith(prefix))
    return {
        artist.get_gid().removeprefix(prefix): Box(*artist.get_window_extent().extents.tolist()) for artist in found
    }


def crowded(data):
    """As many points as a full benchmark has, with long names, some of them on the same place."""
    rng = random.Random(7)
    changed = small(data, rows=[], errors=[])
    for i in range(28):
        name = " ".join([f"method {i}", *["of many words"] * rng.randint(0, 2)])
        names = {"id": str(i), "label": name, "group": rng.choice(["ours", "ours", "rival"]), "format": "double"}
        time, error = 10 ** rng.uniform(-0.3, 1.7), 10.0 ** -rng.choice([1, 2, 3, 5, 5, 7, 10, 15])
        for measure in ("throughput", "memory"):
            ns = {"min": time, "median": time, "spread": 0.1}
            rest = {"speeds": "equal", "measure": measure, "ns": ns, "ratio_to_3_6": None, "ratio_to_copy": None}
            changed["rows"].append(names | rest)
        changed["errors"].append(names | {"relative": error, "loss": None, "proven": None, "note": ""})
    return changed


@pytest.mark.parametrize(
    ("kind", "layout"),
    [
        *product(("double", "float"), LAYOUTS),
        ("crowded", "narrow"),
        pytest.param("crowded", "wide", marks=pytest.mark.slow),
    ],
)
def test_every_point_has_a_label_and_nothing_overlaps(data, kind, layout):
    result = Result.from_json(crowded(data) if kind == "crowded" else data)
    shown = panels(result, "float" if kind == "float" else "double")
    assert [each.measure for each in shown] == ["throughput", "memory"]
    with drawn_panels(shown, LAYOUTS[layout]) as sheet:
        sheet.draw_without_rendering()
        labels, marks = boxes(sheet, "label-"), boxes(sheet, "point-")
        frames = [Box(*axes.get_window_extent().extents.tolist()) for axes in sheet.axes]
        texts = {a.get_gid(): a.get_text() for a in sheet.findobj(matplotlib.text.Text) if a.get_gid()}
        everything = [
            Box(*t.get_window_extent().extents.tolist())
            for t in sheet.findobj(matplotlib.text.Text)
            if t.get_text() and t.get_visible()
        ]
    expected = {f"{n}-{i}": p for n, each in enumerate(shown) for i, p in enumerate(each.points)}
    assert set(labels) == set(marks) == set(expected)
    for key, p in expected.items():
        words = " ".join(texts[f"label-{key}"].replace("\N{NO-BREAK SPACE}", " ").split())
        assert words.startswith(p.row.label.split(", ")[0])
    for a, b in combinations(labels, 2):
        assert not labels[a].overlaps(labels[b]), (texts[f"label-{a}"], texts[f"label-{b}"])
    for key, box in labels.items():
        frame = frames[int(key.split("-")[0])]
        assert frame.left <= box.left
        assert box.right <= frame.right
        assert frame.bottom <= box.bottom
        assert box.top <= frame.top + 4
        for other, mark in marks.items():
            assert not box.overlaps(mark), (texts[f"label-{key}"], texts[f"label-{other}"])
    width, height = sheet.get_size_inches() * sheet.dpi
    assert all(b.left >= 0 and b.right <= width and b.bottom >= 0 and b.top <= height for b in everything)


@pytest.mark.parametrize("form", ["double", "float"])
def test_no_label_of_the_published_picture_lies_on_a_line(form, monkeypatch):
    touched = []

    def watched(points, sizes, frame, *, lines, **options):
        found = labels.place(points, sizes, frame, lines=lines, **options)
        ends = np.array([[*start, *end] for start, end in lines])
        corners = [np.array([[b.left, b.bottom, b.right, b.top]]) for b in found]
        touched.extend(bool(labels._through(ends, corner).any()) for corner in corners)
        return found

    monkeypatch.setattr(picture, "place", watched)
    with drawn_panels(panels(Result.from_text(COMMITTED.read_text(), "result.json"), form), WIDE):
        assert touched
        assert not any(touched)


def drawn(data, form="double", layout=WIDE):
    return drawn_panels(panels(Result.from_json(data), form), layout)


def mark_of(sheet, shown, name):
    (key,) = [f"point-0-{i}" for i, p in enumerate(shown.points) if p.row.id == name]
    (mark,) = sheet.findobj(lambda artist: artist.get_gid() == key)
    return mark


def test_marks_stand_at_time_and_error_and_tell_what_is_proven(data):
    result = Result.from_json(data)
    shown = panels(result, "double")[0]
    with drawn(data) as sheet:
        looks = {}
        for p in shown.points:
            mark = mark_of(sheet, shown, p.row.id)
            looks.setdefault(p.row.group, set()).add((mark.get_marker(), mark.get_color()))
            (time,), (error,) = mark.get_data()
            if p.error is None:
                assert time == p.time
                continue
            assert time == min(p.time, 1000 * shown.points[0].time)
            assert error == min(p.error, 100)
            filled = mark.get_markerfacecolor() == mark.get_color()
            assert filled == (p.row.id.startswith(("lookup", "root")) and p.row.id != "lookup_full")
        steps = sheet.findobj(lambda artist: artist.get_gid() == "frontier-0")[0]
        corners = set(zip(*map(tuple, steps.get_data()), strict=True))
        label = " ".join(
            t.get_text() for t in sheet.findobj(matplotlib.text.Text) if (t.get_gid() or "").startswith("label-0")
        )
    assert {(p.time, p.error) for p in frontier(shown.points)} <= corners
    assert len({marker for look in looks.values() for marker, _ in look}) == len(looks) == 3
    assert len({color for look in looks.values() for _, color in look}) == 3
    assert "error\N{NO-BREAK SPACE}8e9\N{NO-BREAK SPACE}↑" in label  # off the scale, and says so
    assert "2.4\N{NO-BREAK SPACE}ms\N{NO-BREAK SPACE}→" in label


def test_an_error_of_0_stays_on_the_axis(data):
    changed = small(data)
    for error in changed["errors"]:
        if error["id"] == "lookup_1em5":
            error.update(relative=0, loss=0, proven=None)
    with drawn(changed) as sheet:
        (_, (error,)) = mark_of(sheet, panels(Result.from_json(changed), "double")[0], "lookup_1em5").get_data()
        low, high = sheet.axes[0].get_ylim()
    assert 0 < low < error < high


def test_other_measures_and_speeds_stand_in_for_missing_ones(data):
    changed = small(data)
    for row in changed["rows"]:
        row["speeds"] = "equal"
    changed["rows"] = [row for row in changed["rows"] if row["measure"] in ("latency", "cache")]
    shown = panels(Result.from_json(changed), "double")
    assert [(each.measure, each.speeds) for each in shown] == [("latency", "equal"), ("cache", "equal")]
    assert panels(Result.from_json(changed), "float") == []
    assert list(drawn_report(changed, ["svg"])) == ["report.html", "speed_against_error.svg"]


def test_curves_show_the_data_and_their_names_do_not_overlap(data):
    result = Result.from_json(data)
    for layout in LAYOUTS.values():
        with drawn_curves(result.curves, result.conditions.range, layout) as sheet:
            names = boxes(sheet, "name-")
            width, _ = sheet.get_size_inches() * sheet.dpi
            for i, curve in enumerate(result.curves):
                (line,) = sheet.findobj(lambda artist, i=i: artist.get_gid() == f"curve-{i}")
                x, y = line.get_data()
                assert x.tolist() == list(curve.v_star)
                assert np.nan_to_num(y).tolist() == list(curve.error)
        assert len(names) == len(result.curves)
        assert all(box.right <= width for box in names.values())
        assert not any(a.overlaps(b) for a, b in combinations(names.values(), 2))


def test_of_many_points_the_largest_error_is_drawn(data):
    curve = Result.from_json(data).curves[0]
    rng = np.random.default_rng(1)
    v_star, error = np.geomspace(0.1, 5, 10_001), rng.uniform(0, 1, 10_001)
    many = type(curve)("a", "a", tuple(v_star.tolist()), tuple(error.tolist()))
    x, y = picture._thinned(many)
    assert len(x) == 400
    assert y.max() == error.max()
    assert y.min() > 0.5
    assert set(zip(x, y, strict=True)) <= set(zip(v_star, error, strict=True))


@pytest.mark.parametrize("seed", range(15))
def test_positions_are_spread_in_order_and_within_bounds(seed):
    rng = random.Random(seed)
    sizes = [rng.uniform(1, 10) for _ in range(8)]
    wanted = [rng.uniform(-20, 120) for _ in sizes]
    found = picture.spread(wanted, sizes, 0, 100)
    order = sorted(range(8), key=lambda i: wanted[i])
    for i, j in pairwise(order):
        assert found[j] - found[i] >= (sizes[i] + sizes[j]) / 2 - 1e-9
    assert all(size / 2 - 1e-9 <= x <= 100 - size / 2 + 1e-9 for x, size in zip(found, sizes, strict=True))


def test_a_label_alone_stands_right_of_its_mark():
    (box,) = place([(50.0, 50.0)], [(20.0, 8.0)], Box(0, 0, 100, 100), radius=3)
    assert 53 <= box.left < 60
    assert (box.bottom, box.top) == (46, 54)


def test_a_label_beside_the_edge_or_a_blocked_area_gives_way():
    (box,) = place([(95.0, 50.0)], [(20.0, 8.0)], Box(0, 0, 100, 100), radius=3)
    assert box.right <= 100
    (box,) = place([(50.0, 50.0)], [(20.0, 8.0)], Box(0, 0, 100, 100), radius=3, blocked=[Box(53, 0, 100, 100)])
    assert box.right <= 53


def test_names_are_cut_where_they_stay_different():
    names = ["a, b", "c, d, e", "c, d, f", "g, h", "g, h, i"]
    assert shortened(names) == {
        "a, b": "a",
        "c, d, e": "c, d, e",
        "c, d, f": "c, d, f",
        "g, h": "g, h",
        "g, h, i": "g, h, i",
    }


@pytest.mark.parametrize(("ns", "text"), [(0.5, "0.5 ns"), (1e3, "1 µs"), (2e6, "2 ms"), (5e9, "5 s")])
def test_times_have_units(ns, text):
    assert picture.duration(ns) == text


# --- the files --------------------------------------------------------------------------------------------------------


def test_files_are_named_and_known_as_ours(files, tmp_path):
    pictures = {f"speed_against_error{form}.{kind}" for form in ("", "_float") for kind in ("svg", "png")}
    assert set(files) == {"report.html", *pictures}
    for _ in range(2):  # the second time, they are replaced
        writer.write_all({tmp_path / name: content for name, content in files.items()})
    for name in pictures:
        if name.endswith(".svg"):
            ET.fromstring(files[name])
        else:
            (tmp_path / "picture.png").write_bytes(files[name])
            pixels = imread(tmp_path / "picture.png")
            assert pixels[0, 0, :3].tolist() == [1, 1, 1]
            assert len(np.unique((pixels[..., :3] * 255).round() @ [65536, 256, 1])) > 50


def test_bytes_are_the_same_whatever_the_hash_seed(data, tmp_path):
    code = (
        "import json, sys, hashlib\nfrom viscopade_lab.bench.result import Result\n"
        "from viscopade_lab.report.render import render\n"
        "for name, content in render(Result.from_json(json.load(sys.stdin))).items():\n"
        "    print(name, hashlib.sha256(content if isinstance(content, bytes) else content.encode()).hexdigest())\n"
    )
    few = small(data)
    variables = {**os.environ, "PYTHONHASHSEED": "2", "MPLCONFIGDIR": str(tmp_path), "TZ": "Asia/Tokyo"}
    words = [sys.executable, "-c", code]
    run = subprocess.run(words, check=True, capture_output=True, text=True, input=json.dumps(few), env=variables)
    found = dict(line.split() for line in run.stdout.splitlines())
    here = {name: text if isinstance(text, bytes) else text.encode() for name, text in drawn_report(few).items()}
    assert found == {name: hashlib.sha256(content).hexdigest() for name, content in here.items()}
    assert len(found) == 3


def test_settings_of_matplotlib_are_left_alone(data):
    before = dict(matplotlib.rcParams)
    drawn_report(small(data), ["svg"])
    assert dict(matplotlib.rcParams) == before


def test_the_result_is_left_alone(data):
    given = small(data)
    digest = hashlib.sha256(json.dumps(given).encode()).hexdigest()
    drawn_report(given, [])
    assert hashlib.sha256(json.dumps(given).encode()).hexdigest() == digest


def test_importing_loads_neither_matplotlib_nor_jinja():
    code = "import sys, viscopade_lab.report\nprint(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert not {"matplotlib", "jinja2", "scipy", "click"} & set(run.stdout.split())


def test_unknown_format_is_refused(data):
    with pytest.raises(ValueError, match="format is 'gif': accepted are svg, png"):
        drawn_report(data, ["gif"])


# --- wrong results ----------------------------------------------------------------------------------------------------


def broken(path, value):
    def change(data):
        *parents, last = path
        for key in parents:
            data = data[key]
        if value is KeyError:
            del data[last]
        else:
            data[last] = value

    return change


MALFORMED = {
    "command is missing": broken(["command"], KeyError),
    "machine.cpu is missing": broken(["machine", "cpu"], KeyError),
    "machine is 'PC'": broken(["machine"], "PC"),
    "machine.cpu is 'two\\nlines'": broken(["machine", "cpu"], "two\nlines"),
    "settings.rounds is 0": broken(["settings", "rounds"], 0),
    "settings.rounds is True": broken(["settings", "rounds"], True),
    "settings.scene.beta is 0": broken(["settings", "scene", "beta"], 0),
    "settings.scene.speed_max is 1e-09": broken(["settings", "scene", "speed_max"], 1e-9),
    "settings.flags.array is missing": broken(["settings", "flags", "array"], KeyError),
    "rows is {}": broken(["rows"], {}),
    "rows is []": broken(["rows"], []),
    "rows[1] is 3": broken(["rows", 1], 3),
    "rows[1].label is ''": broken(["rows", 1, "label"], ""),
    "rows[2].group is 'mine'": broken(["rows", 2, "group"], "mine"),
    "rows[2].format is ['double']": broken(["rows", 2, "format"], ["double"]),
    "rows[0].speeds is 'fast'": broken(["rows", 0, "speeds"], "fast"),
    "rows[0].measure is None": broken(["rows", 0, "measure"], None),
    "rows[0].ns.median is 'quick'": broken(["rows", 0, "ns", "median"], "quick"),
    "rows[0].ns.median is inf": broken(["rows", 0, "ns", "median"], float("inf")),
    "rows[0].ns.median is nan": broken(["rows", 0, "ns", "median"], float("nan")),
    "rows[0].ns.min is 1000.0": broken(["rows", 0, "ns", "min"], 1e3),
    "rows[0].ns.min is 0": broken(["rows", 0, "ns", "min"], 0),
    "rows[0].ns.spread is -1": broken(["rows", 0, "ns", "spread"], -1),
    "rows[0].ratio_to_copy is missing": broken(["rows", 0, "ratio_to_copy"], KeyError),
    "rows[0].ratio_to_3_6 is 0": broken(["rows", 0, "ratio_to_3_6"], 0),
    "errors[0].proven is 6.7e-06": broken(["errors", 0, "proven"], 6.7e-6),
    "errors[0].proven is 'small'": broken(["errors", 0, "proven"], "small"),
    "errors[0].proven is '0'": broken(["errors", 0, "proven"], "0"),
    "errors[0].proven is '1e-5 + '": broken(["errors", 0, "proven"], "1e-5 + "),
    "errors[0].loss is True": broken(["errors", 0, "loss"], True),
    "targets[0].reached is 'yes'": broken(["targets", 0, "reached"], "yes"),
    "targets[0].measured is [1]": broken(["targets", 0, "measured"], [1]),
    "curves[0].error has": broken(["curves", 0, "error"], [1e-3]),
    "curves[0].v_star[0] is 0": broken(["curves", 0, "v_star", 0], 0),
    "curves[0].v_star is []": broken(["curves", 0, "v_star"], []),
    "rows[1] repeats": lambda data: data["rows"].insert(1, data["rows"][0]),
    "errors[1] repeats": lambda data: data["errors"].insert(1, data["errors"][0]),
    "curves[1] repeats": lambda data: data["curves"].insert(1, data["curves"][0]),
}


@pytest.mark.parametrize("message", MALFORMED)
def test_wrong_results_are_refused_in_one_line(data, message):
    changed = copy.deepcopy(data)
    MALFORMED[message](changed)
    with pytest.raises(ValueError) as caught:
        Result.from_text(json.dumps(changed), "my/result.json")
    text = str(caught.value)
    assert text.startswith(f"my/result.json: {message}")
    assert "\n" not in text
    assert len(text) < 250


@pytest.mark.parametrize("text", ["", "{", "[" * 100_000, "no", '{"command": 1e999999}', "\ufeff{}", b"\xff{}", b"\0"])
def test_what_is_no_json_is_refused_in_one_line(text):
    with pytest.raises(ValueError, match=r"\Aresult\.json: [^\n]*\Z"):
        Result.from_text(text, "result.json")


def test_huge_integers_are_refused(data):
    changed = copy.deepcopy(data)
    changed["rows"][0]["ns"]["median"] = 10**400
    with pytest.raises(ValueError, match=r"rows\[0\]\.ns\.median is"):
        Result.from_json(changed)


def test_more_keys_than_needed_are_accepted(data):
    changed = copy.deepcopy(data)
    changed["new"] = changed["rows"][0]["new"] = changed["machine"]["memory"] = "more"
    assert Result.from_json(changed) == Result.from_json(data)


@pytest.mark.parametrize(
    ("text", "form", "bound"),
    [
        ("6.7e-6", "double", 6.7e-6),
        ("0.57 ulp", "float", 0.57 * 2**-23),
        ("6.7e-6 + 0.5 ulp", "float", 6.7e-6 + 2**-24),
        ("2 ulp", "double", 2**-51),
    ],
)
def test_bounds_in_ulps_become_numbers(data, text, form, bound):
    changed = small(
        data, errors=[{**data["errors"][0], "format": form, "proven": text, "relative": None, "loss": None}]
    )
    changed["settings"]["scene"]["speed_min"] = changed["settings"]["scene"]["speed_max"]  # eps < 1/2
    (error,) = Result.from_json(changed).errors
    assert error.value == pytest.approx(bound, rel=1e-12, abs=0)
    assert error.is_proven


@pytest.mark.parametrize("speed_min", [1e-12, 1e-3, 1.0])
def test_an_ulp_is_no_larger_than_what_is_assumed(data, speed_min):
    scene = {**data["settings"]["scene"], "speed_min": speed_min}
    errors = [{**data["errors"][0], "proven": "1 ulp", "relative": None, "loss": None}]
    (error,) = Result.from_json({**data, "settings": {**data["settings"], "scene": scene}, "errors": errors}).errors
    v_star = scene["beta"] ** 0.5 * np.geomspace(speed_min, scene["speed_max"], 20_001) ** 0.1
    epsilon, loss = double.epsilon(v_star), double.one_minus_epsilon(v_star)
    largest = np.max(np.spacing(epsilon) / np.minimum(epsilon, loss))
    assert 0.5 * error.value < largest <= error.value


# --- in a browser -----------------------------------------------------------------------------------------------------


def run_browser(tmp_path, *arguments):
    command = browser()
    if command is None:
        pytest.skip("no Chromium, Chrome or Edge found")
    offline = ("--host-resolver-rules=MAP * ~NOTFOUND", "--proxy-server=127.0.0.1:9", "--disable-background-networking")
    quiet = (
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--disable-dev-shm-usage",
        "--hide-scrollbars",
        "--no-first-run",
    )
    profile = f"--user-data-dir={tmp_path / 'profile'}"
    page_url = (tmp_path / "report.html").as_uri()
    return subprocess.run(
        [command, *quiet, *offline, profile, *arguments, page_url],
        capture_output=True,
        text=True,
        timeout=HANGS,
        check=True,
    )


@pytest.fixture
def on_disk(html, tmp_path):
    (tmp_path / "report.html").write_text(html, encoding="utf-8")
    return tmp_path


def test_browser_has_the_tables(on_disk, tables, html):
    found = Tables(run_browser(on_disk, "--dump-dom").stdout)
    assert found.tables == tables
    assert {"choice-double", "choice-float", "targets", "errors", *(f"times-{m}" for m in MEASURES)} == set(tables)
    assert sum(tag == "svg" for tag, _ in found.tags) == html.count("<svg")


@pytest.mark.parametrize("width", [1200, 500])
def test_browser_shows_the_page(on_disk, width):
    target = on_disk / "shot.png"
    run_browser(on_disk, f"--screenshot={target}", f"--window-size={width},3200")
    pixels = (imread(target)[..., :3] * 255).round().astype(int)
    assert pixels.shape[1] == width
    paper = pixels[0, 0]
    assert paper.tolist() == [255, 255, 255]
    ink = (pixels != paper).any(axis=2)
    # Something on most of the page's length, and room on both sides: nothing is cut off.
    assert ink.any(axis=1).mean() > 0.3
    assert not ink[:, :8].any()
    assert not ink[:, -8:].any()
    # The marks of the picture, in the colours of the style sheet.
    for color in ((0x00, 0x68, 0xA8), (0xBD, 0x4B, 0x00), (0x00, 0x75, 0x5A)):
        assert (abs(pixels - color).max(axis=2) < 6).sum() > 100
