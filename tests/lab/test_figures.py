"""Figures draw what their lines are named, and take no settings of the user. `make reproduce` compares the files."""

import os
import re
import subprocess
import sys
from contextlib import ExitStack
from functools import cache
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from mpmath import mp, mpf

from viscopade.collision import exact
from viscopade.plots.sheet import STYLE, Page
from viscopade.theory.pade import pade
from viscopade.theory.paper import BETA_ICE_CGS
from viscopade.theory.series import series
from viscopade_lab import figures
from viscopade_lab.figures import FORMATS
from viscopade_lab.figures.paper import FIT_EXPONENT, FIT_FACTOR
from viscopade_lab.figures.registry import FIGURES, drawn, render

DIGITS = 25
NAMES = list(FIGURES)
CAPTIONS = (Path(__file__).parents[2] / "docs" / "figures" / "README.md").read_text("utf-8")
NAME = "pade-on-linear-axes"  # where one is enough

CURVES = {
    "truncated-series-diverge": ["exact", "pade-1-4", *(f"series-{k}" for k in (5, 10, 15, 20, 40))],
    "pade-at-large-v-star": ["exact", "pade-0-3", "pade-1-4", "pade-2-5", "pade-3-6", "pade-15-18"],
    "pade-on-linear-axes": [
        name + suffix for suffix in ("", "-inset") for name in ("exact", "pade-0-3", "pade-1-4", "pade-2-5", "pade-3-6")
    ],
    "ice-pade-and-measured-fit": ["exact", "pade-3-6", "series-40"],
}


@pytest.fixture(scope="module")
def sheets():
    with ExitStack() as stack:
        yield {name: stack.enter_context(drawn(name)) for name in (*CURVES, "pade-errors")}


def artist(sheet, gid):
    (found,) = sheet.findobj(lambda a: a.get_gid() == gid)
    return found


def samples(line, count=3):
    """A few of the points drawn, within the frame."""
    x, y = line.get_data()
    (left, right), (low, high) = line.axes.get_xlim(), line.axes.get_ylim()
    inside = np.flatnonzero((x >= left) & (x <= right) & (y >= low) & (y <= high) & (x > 0))
    chosen = inside[np.linspace(0, len(inside) - 1, count).astype(int)]
    return list(zip(x[chosen].tolist(), y[chosen].tolist(), strict=True))


def polynomial(coefficients, x):
    return mp.polyval([mpf(c) for c in reversed(coefficients)], x)


def model(gid, v_star):
    """eps of the approximant or truncated series of this name, by mpmath from decimals."""
    kind, *numbers = gid.split("-")
    if kind == "pade":
        a, b = pade(*map(int, numbers[:2]), DIGITS).decimals()
        return polynomial(a, v_star) / polynomial(b, v_star)
    return polynomial(series(int(numbers[0]), DIGITS).decimals(), v_star)


@cache
def true(v_star, what="epsilon"):
    return exact.collision(v_star, DIGITS).mpf()[what]


def of_ice(speed):
    return mp.sqrt(mpf(BETA_ICE_CGS)) * mpf(speed) ** mpf("0.1")


# --- the data drawn ---------------------------------------------------------------------------------------------------


def test_the_command_names_every_figure():
    assert list(figures.NAMES) == NAMES


def test_the_captions_numbers_are_those_drawn():
    caption = CAPTIONS.partition("## ice-pade-and-measured-fit")[2].partition("![")[0]
    assert f"= {BETA_ICE_CGS}$" in caption
    assert f"${FIT_FACTOR} (v/" in caption
    assert f"^{{{FIT_EXPONENT}}}" in caption


@pytest.mark.parametrize(("name", "gid"), [(name, gid) for name, found in CURVES.items() for gid in found])
def test_curves_of_epsilon(sheets, name, gid):
    points = samples(artist(sheets[name], gid))
    for x, y in points:
        v_star = of_ice(x) if name == "ice-pade-and-measured-fit" else mpf(x)
        expected = true(v_star) if gid.startswith("exact") else model(gid, v_star)
        assert y == pytest.approx(float(expected), rel=1e-9, abs=0)
    assert len({y for _, y in points}) == len(points)


@pytest.mark.parametrize("m", [0, 1, 2, 3, 15, 25])
def test_errors_of_approximants(sheets, m):
    for size in ("epsilon", "loss"):
        for x, y in samples(artist(sheets["pade-errors"], f"pade-{m}-{m + 3}-{size}")):
            with mp.workdps(30):
                deviation = abs(model(f"pade-{m}-{m + 3}", mpf(x)) - true(x))
                expected = deviation / true(x, "epsilon" if size == "epsilon" else "one_minus_epsilon")
            assert y == pytest.approx(float(expected), rel=1e-2, abs=0)


# --- the files --------------------------------------------------------------------------------------------------------

CODE = f"""
import sys
from viscopade_lab.figures.registry import render
assert "matplotlib" not in sys.modules
files = render(["{NAME}"], ["svg"])
assert "matplotlib.pyplot" not in sys.modules
sys.stdout.buffer.write(files["{NAME}.svg"])
"""


def test_settings_of_the_user_change_nothing(tmp_path):
    settings = tmp_path / "matplotlibrc"
    settings.write_text("font.size: 20\nlines.linewidth: 7\nsavefig.dpi: 30\nbackend: TkAgg\nsvg.fonttype: none\n")
    environment = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY", "MPLBACKEND")}
    environment |= {"MATPLOTLIBRC": str(settings), "PYTHONHASHSEED": "7", "SOURCE_DATE_EPOCH": "1"}
    run = subprocess.run([sys.executable, "-W", "error", "-c", CODE], env=environment, capture_output=True)
    assert run.returncode == 0, run.stderr
    assert run.stdout == render([NAME], ["svg"])[f"{NAME}.svg"]


def test_a_page_has_its_size_and_its_letters():
    with drawn(NAME, Page(size=(5, 4), font_size=15)) as sheet:
        assert sheet.get_size_inches().tolist() == [5, 4]
        assert sheet.axes[0].xaxis.label.get_size() == 2 * STYLE["axes.labelsize"]
        assert {text.get_size() for text in sheet.axes[0].texts} == {14}  # twice the usual 7 points
    text = render([NAME], ["svg"], Page(size=(5, 4), font_size=15))[f"{NAME}.svg"].decode()
    assert f"viscopade figures --only {NAME} --format svg --size 0.127 0.1016 --font-size 15" in " ".join(text.split())


def test_settings_of_matplotlib_are_left_as_they_were():
    def settings():
        return {key: matplotlib.rcParams[key] for key in matplotlib.rcParams if key != "backend"}

    with matplotlib.rc_context({"font.size": 17.0, "svg.hashsalt": "mine"}):
        before = settings()
        render([NAME], ["svg"])
        assert settings() == before


@pytest.mark.slow
def test_every_figure_in_every_format():
    found = render(formats=FORMATS)
    assert set(found) == {f"{name}.{kind}" for name in FIGURES for kind in FORMATS}
    for name, data in found.items():
        assert data.startswith({"svg": b"<?xml", "pdf": b"%PDF", "png": b"\x89PNG"}[name.split(".")[1]])
        assert not re.search(rb"CreationDate|ModDate|dc:date|tIME|/home/", data), name
    assert render(formats=FORMATS) == found
