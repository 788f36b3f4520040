"""Every figure draws what it says: its data against independent values. `make reproduce` compares the files."""

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
from matplotlib.text import Annotation
from mpmath import mp, mpf

from tests.closed_forms import nu_1, nu_2
from viscopade import restitution
from viscopade.collision import exact
from viscopade.collision.spheres import v_star
from viscopade.theory.law import law_of
from viscopade.theory.pade import pade
from viscopade.theory.paper import BETA_ICE_CGS
from viscopade.theory.series import series
from viscopade_lab import figures, gas
from viscopade_lab.figures import FORMATS, cooling, paper
from viscopade_lab.figures.paper import FIT_EXPONENT, FIT_FACTOR, FIT_SPEEDS, MAX_M
from viscopade_lab.figures.registry import FIGURES, drawn, render

DIGITS = 25
NAMES = list(FIGURES)
CAPTIONS = (Path(__file__).parents[2] / "docs" / "figures" / "README.md").read_text("utf-8")
NAME = "pade-on-linear-axes"  # where one is enough


@pytest.fixture(scope="module")
def sheets():
    with ExitStack() as stack:
        yield {name: stack.enter_context(drawn(name)) for name in FIGURES}


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


CURVES = {
    "truncated-series-diverge": ["exact", "pade-1-4", *(f"series-{k}" for k in (5, 10, 15, 20, 40))],
    "pade-at-large-v-star": ["exact", "pade-0-3", "pade-1-4", "pade-2-5", "pade-3-6", "pade-15-18"],
    "pade-on-linear-axes": [
        name + suffix for suffix in ("", "-inset") for name in ("exact", "pade-0-3", "pade-1-4", "pade-2-5", "pade-3-6")
    ],
    "ice-pade-and-measured-fit": ["exact", "pade-3-6", "series-40"],
}


@pytest.mark.parametrize(("name", "gid"), [(name, gid) for name, found in CURVES.items() for gid in found])
def test_curves_of_epsilon(sheets, name, gid):
    points = samples(artist(sheets[name], gid))
    for x, y in points:
        v_star = of_ice(x) if name == "ice-pade-and-measured-fit" else mpf(x)
        expected = true(v_star) if gid.startswith("exact") else model(gid, v_star)
        assert y == pytest.approx(float(expected), rel=1e-9, abs=0)
    assert len({y for _, y in points}) == len(points)


def test_power_laws(sheets):
    sheet = sheets["pade-at-large-v-star"]
    for gid, factor, exponent in (
        ("paper-power", 1, mpf("-3.2")),
        ("limit-power", mpf("1.5") ** (mpf(2) / 3), mpf(-10) / 3),
    ):
        for x, y in samples(artist(sheet, gid)):
            assert y == pytest.approx(float(factor * mpf(x) ** exponent), rel=1e-12, abs=0)
        for suffix in ("", "-inset"):
            line = artist(sheets["local-exponent"], gid + suffix)
            np.testing.assert_allclose(line.get_ydata(), float(exponent), rtol=1e-12)


@pytest.mark.parametrize("gid", ["exact", "pade-1-4", "pade-3-6", "pade-15-18"])
def test_slopes(sheets, gid):
    def log_epsilon(log_v):
        v_star = mp.exp(log_v)
        return mp.log(true(v_star) if gid == "exact" else model(gid, v_star))

    for suffix in ("", "-inset"):
        for x, y in samples(artist(sheets["local-exponent"], gid + suffix), 2):
            with mp.workdps(30):
                log_v, step = mp.log(mpf(x)), mpf("1e-6")
                expected = (log_epsilon(log_v + step) - log_epsilon(log_v - step)) / (2 * step)
            assert y == pytest.approx(float(expected), abs=1e-6)


@pytest.mark.parametrize("m", [0, 1, 2, 3, 15, 25])
def test_errors_of_approximants(sheets, m):
    for size in ("epsilon", "loss"):
        for x, y in samples(artist(sheets["pade-errors"], f"pade-{m}-{m + 3}-{size}")):
            with mp.workdps(30):
                deviation = abs(model(f"pade-{m}-{m + 3}", mpf(x)) - true(x))
                expected = deviation / true(x, "epsilon" if size == "epsilon" else "one_minus_epsilon")
            assert y == pytest.approx(float(expected), rel=1e-2, abs=0)


def test_the_fit_is_a_curve_over_the_range_of_its_speeds_and_labelled_so(sheets):
    sheet = sheets["ice-pade-and-measured-fit"]
    line = artist(sheet, "fit")
    assert line.get_marker() == "None"
    assert (line.get_xdata()[0], line.get_xdata()[-1]) == pytest.approx(FIT_SPEEDS, rel=1e-12, abs=0)
    assert any("fit of Bridges et al." in text.get_text() for text in sheet.findobj(Annotation))
    np.testing.assert_allclose(line.get_ydata(), FIT_FACTOR * line.get_xdata() ** FIT_EXPONENT, rtol=1e-12)


def test_poles_and_zeros(sheets):
    """Each point annihilates its polynomial, and with the mirror images they are all there."""
    sheet = sheets["poles-and-zeros"]
    approximants = [pade(m, m + 3, paper.DIGITS) for m in range(MAX_M + 1)]
    for gid, roots in (("zeros", lambda p: p.zeros), ("poles", lambda p: p.poles)):
        z = [complex(*point) for point in artist(sheet, gid).get_offsets()]
        expected = [complex(*map(float, r.decimals(paper.DIGITS))) for p in approximants for r in roots(p)]
        everything = [*z, *(x.conjugate() for x in z if x.imag)]
        np.testing.assert_allclose(*(np.sort_complex(np.round(x, 10)) for x in (everything, expected)))
    marked = set()
    for gid in ("poles-positive", "zeros-positive"):
        for x, m in zip(*artist(sheet, gid).get_data(), strict=True):
            a, b = pade(int(m), int(m) + 3, paper.DIGITS).decimals()
            coefficients = [mpf(c) for c in (a if gid == "zeros-positive" else b)[::-1]]
            value, slope = mp.polyval(coefficients, mpf(x), derivative=1)
            assert abs(value / slope) < 1e-12 * x
            marked.add(int(m))
    assert marked == {p.m for p in approximants if not p.usable}


def test_the_marked_zero_and_pole(sheets):
    (zero,) = artist(sheets["pade-at-large-v-star"], "zero-pade-2-5").get_xdata()
    assert zero == pytest.approx(5.68012, abs=1e-5)
    for size in ("epsilon", "loss"):
        (pole,) = artist(sheets["pade-errors"], f"pole-pade-25-28-{size}").get_xdata()
        assert pole == pytest.approx(2.97524, abs=1e-5)
        assert np.nanmax(artist(sheets["pade-errors"], f"pade-25-28-{size}").get_ydata()) > 100


def test_the_singularity_limits_the_convergence(sheets):
    """The series' root test, slowly, tends to the circle's radius, and nearest poles of [25/28] lie at its end."""
    sheet = sheets["poles-and-zeros"]
    x, y = (data[0] for data in artist(sheet, "singularity").get_data())
    radius = abs(complex(x, y))
    assert np.hypot(*artist(sheet, "circle").get_data()) == pytest.approx(radius)
    h = np.arange(81) * np.abs(series(80, paper.DIGITS).floats())
    assert (np.max(h[40:60]) / np.max(h[60:80])) ** (1 / 20) == pytest.approx(radius, rel=0.01)
    assert min(abs(complex(*p) - complex(x, y)) for p in artist(sheet, "poles").get_offsets()) < 0.01


def test_universal_curves_with_closed_forms(sheets):
    """nu = 1 by Lambert's function, nu = 2 by the damped oscillator."""
    for end, nu in (("force", "1"), ("force", "2"), ("return", "2")):
        for axes in ("linear", "logarithmic"):
            for x, y in samples(artist(sheets["universal-curves"], f"{end}-{nu}-{axes}"), 5):
                with mp.workdps(30):
                    K = mpf(x)
                    expected = nu_1(K) if nu == "1" else nu_2(K / 2, end)
                assert y == pytest.approx(float(expected), rel=1e-6, abs=0)


def test_what_programs_deliver_with_closed_forms(sheets):
    """A damping ratio made for x = 0, at zero force, with half of the mass, and with both; what is measured is near."""
    for gid, share, end in (("other-end", 1, "force"), ("half-mass", mpf(0.5), "return"), ("both", mpf(0.5), "force")):
        for asked, delivered in samples(artist(sheets["audit"], gid), 4):
            with mp.workdps(30):
                loss = -mp.log(asked)
                expected = nu_2(mp.sqrt(share) * loss / mp.sqrt(mp.pi**2 + loss**2), end)
            assert delivered == pytest.approx(float(expected), rel=0.02 if gid == "half-mass" else 1e-9)  # a fit
    for name in ("hooke-coeff_restitution", "hertz-coeff_restitution", "hertz-viscoelastic-limit_damping"):
        at, measured = artist(sheets["audit"], f"{name}-points").get_data()
        steps, mean = artist(sheets["audit"], f"{name}-mean").get_data()
        assert [round(step, 3) for step in (steps[0], steps[-1])] == [min(at), max(at)] == [0.001, 0.1]
        assert abs(measured[np.argmin(at)] - mean[0]) < 1e-3


def test_eps_over_the_speed(sheets):
    """Closed forms of two laws; for the viscoelastic law with both ends the digits of the exact function."""
    sheet, beta = sheets["eps-over-speed"], exact.invert("0.5", DIGITS, speed="1").mpf()["beta"]
    asked = 2 * mp.log(2) / mp.sqrt(mp.pi**2 + mp.log(2) ** 2)
    for gid, kappa in (("hunt-crossley", None), ("hunt-crossley-asked", 0.75)):
        d = mp.findroot(lambda z: nu_1(z) - 0.5, 1.4) if kappa is None else mpf(kappa)
        for speed, y in samples(artist(sheet, gid)):
            assert y == pytest.approx(float(nu_1(d * speed)), rel=1e-9)
    for gid, eps in (("constant", 0.5), ("constant-asked", float(nu_2(asked / 2, "force")))):
        assert artist(sheet, gid).get_ydata() == pytest.approx(eps, rel=1e-9)
    for gid, end in (("viscoelastic", "force"), ("no-limit", "return")):
        for speed, y in samples(artist(sheet, gid)):
            kappa = mp.nstr(beta * mpf(speed) ** mpf("0.2"), 20)
            expected = exact.collision(kappa=kappa, law=law_of("viscoelastic", end), digits=12).mpf()["epsilon"]
            assert y == pytest.approx(float(expected), rel=1e-9)
    line, difference = (artist(sheet, "no-limit" + suffix) for suffix in ("", "-difference"))
    whole = artist(sheet, "viscoelastic").get_ydata()
    np.testing.assert_allclose(difference.get_ydata(), line.get_ydata() / whole - 1)


def test_curves_at_x_0_end_where_contact_ends_no_more(sheets):
    for nu, largest in (("2", 2), ("5-2", 1.128)):
        x, y = artist(sheets["universal-curves"], f"return-{nu}-linear").get_data()
        assert 0.95 * largest < x[-1] < largest
        assert 0 < y[-1] < 1e-4


def test_delivered_eps(sheets):
    """Of formulas that are asked for 1 - e = 0.04 … 1, against Lambert's function."""
    formulas = {"hunt-and-crossley": lambda e: 3 * (1 - e) / 2, "gonthier-et-al": lambda e: (1 - e**2) / e}
    for gid, formula in formulas.items():
        for asked, y in samples(artist(sheets["damping-formulas"], gid), 4)[:3]:
            with mp.workdps(30):
                z = formula(mpf(asked))
                expected = nu_1(z)
            assert y == pytest.approx(float(expected), rel=1e-9)
        line, error = (artist(sheets["damping-formulas"], gid + suffix) for suffix in ("", "-error"))
        np.testing.assert_allclose(line.get_ydata() - line.get_xdata(), error.get_ydata())


def drawn_line(sheets, gid):
    return np.array(artist(sheets["cooling"], gid).get_data())


@pytest.mark.parametrize("exponent", ["-5/3", "-2"])
def test_power_laws_of_the_gas(sheets, exponent):
    x, y = drawn_line(sheets, "slope" + exponent.replace("/", "-"))
    power, _, root = exponent.partition("/")
    assert np.diff(np.log(y)) / np.diff(np.log(x)) == pytest.approx(float(power) / float(root or 1), rel=1e-10)


@pytest.mark.parametrize("name", ["exact", "constant"])
def test_simulated_temperatures_lie_on_the_curves(sheets, name):
    x, y = drawn_line(sheets, name)
    at, simulated = drawn_line(sheets, f"simulated-{name}")
    assert simulated == pytest.approx(np.exp(np.interp(np.log(at), np.log(x), np.log(y))), rel=0.2, abs=0)
    functions = {"exact": lambda speed: restitution(speed, cooling.BETA), "constant": cooling.constant_restitution()}
    assert y == pytest.approx(gas.maxwellian(functions[name], x), rel=1e-6, abs=0)


def test_errors_of_the_gas(sheets):
    x, reference = drawn_line(sheets, "exact")
    for name, m, n in (("pade-1-4-error", 1, 4), ("pade-3-6-error", 3, 6)):
        found = pade(m, n)
        expected = gas.maxwellian(lambda speed, found=found: found(v_star(speed, cooling.BETA)), x) / reference - 1
        assert drawn_line(sheets, name)[1] == pytest.approx(np.abs(expected), rel=1e-3, abs=0)
    assert np.max(drawn_line(sheets, "kernel-error")[1]) < 1e-6
    assert np.all(drawn_line(sheets, "constant-error")[1][-10:] > 0.5)


def test_simulated_errors_of_the_gas(sheets):
    for name, allowed in (("constant", 0.3), ("pade-1-4", 3.0)):
        at, simulated = drawn_line(sheets, f"simulated-{name}-error")
        x, error = drawn_line(sheets, f"{name}-error")
        assert simulated[-1] == pytest.approx(np.interp(at[-1], x, error), rel=allowed)


def test_weight(sheets):
    """At G = 0.03 and 0.1 the values of an own integration; and the weight from which viscoelastic bodies stay down."""
    known = {
        ("linear", "force"): (0.476, 0.411),
        ("linear", "return"): (0.480, 0.427),
        ("viscoelastic", "force"): (0.468, 0.380),
    }
    for (name, end), values in known.items():
        shares, drawn_values = artist(sheets["weight"], f"{name}-{end}").get_data()
        at = [load * law_of(name).contact_time for load in (0.03, 0.1)]
        assert np.interp(at, shares, drawn_values) == pytest.approx(values, abs=1.5e-3)
        assert drawn_values[-1] == 0 < drawn_values[-2]
    shares, _ = artist(sheets["weight"], "viscoelastic-return").get_data()
    assert shares[-2] < 0.255 * law_of("viscoelastic").contact_time
    assert shares[-1] > 0.245 * law_of("viscoelastic").contact_time


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
