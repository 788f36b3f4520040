"""The proof that the series converges: what it says is true, and it fails where, and for drafts with which, it must."""

import re
from dataclasses import replace
from fractions import Fraction
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from flint import acb, acb_poly, arb
from mpmath import mp

from viscopade.arithmetic.balls import working
from viscopade.theory.pade import pade
from viscopade.theory.series import series
from viscopade_lab import convergence, singularity
from viscopade_lab.convergence import (
    ORDER,
    TERMS,
    BivariateBall,
    Square,
    agree,
    prove_disc,
    proven_discs,
    starts_elastically,
    theorem,
)

ROOT = Path(__file__).parents[2]


@cache
def singular() -> complex:
    return complex(singularity.from_flow(10).v_star)


@cache
def approximants():
    return [pade(m, m + 3, 60) for m in (30, 28)]


def square_around(v: complex, level: int) -> Square:
    """The square of half width 2^-level that holds v and that the proof might use."""
    half = Fraction(1, 2**level)
    x, y = (half * (2 * int(np.floor(c * 2 ** (level - 1))) + 1) for c in (v.real, v.imag))
    return Square(x, y, half)


@pytest.fixture(scope="module")
def centre():
    """The two panels that have v* = 0 in common."""
    eighth = Fraction(1, 8)
    return prove_disc(Square(-eighth, eighth, eighth)), prove_disc(Square(eighth, eighth, eighth))


@pytest.fixture(scope="module")
def hardest():
    """A panel near the rim of the disc, and as near to the singularity."""
    return prove_disc(square_around(singular() * 1.04 / abs(singular()), 10))


def epsilon(panel, v: complex) -> tuple[complex, float]:
    """What a panel says of eps at v, and the error it states."""
    with working(64):
        value = panel.epsilon(panel.z(Fraction(v.real), Fraction(v.imag)))
    return complex(float(value.real.mid()), float(value.imag.mid())), float(panel.error)


def continued(v: complex) -> tuple[complex, float]:
    """eps at v by Padé approximants of the series, and what their order changes."""
    values = [complex(mp.polyval(p.mpf()[0][::-1], v) / mp.polyval(p.mpf()[1][::-1], v)) for p in approximants()]
    return values[0], abs(values[0] - values[1])


# --- what it says is true ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("v_star", [0.01 + 0j, 0.24 + 0j, 0.2 + 0.1j, 0.03 + 0.2j, 0.25j, -0.1 + 0.05j, -0.24 + 0j])
def test_near_zero_it_is_the_sum_of_the_series(centre, v_star):
    value, error = epsilon(centre[v_star.real >= 0], v_star)
    assert abs(value - np.polyval(series(40, 20).floats()[::-1], v_star)) < error < 1e-4


@pytest.mark.parametrize(("angle", "level"), [(0.6, 5), (0.97, 4)])
def test_far_out_it_is_the_series_continued(angle, level):
    v_star = complex(1.03 * np.exp(1j * np.pi * angle))
    panel = prove_disc(square_around(v_star, level))
    value, error = epsilon(panel, v_star)
    known, uncertain = continued(v_star)
    assert abs(value - known) < error + 3 * uncertain
    assert error + 3 * uncertain < 0.01
    assert abs(known) < panel.bound


def test_scipy_integration_in_complex_time(hardest):
    """x'' + x^(3/2) + v*^2 x' sqrt(x) = 0 along the panel's path; with y = sqrt(x), d tau = 2 y ds."""
    from scipy.integrate import solve_ivp

    assert hardest.square.farthest() >= convergence.RADIUS**2
    v_star, (value, error) = hardest.square.centre, epsilon(hardest, hardest.square.centre)
    state = np.array([0j, 1])
    corners = [0j, *(complex(float(t.real.mid()), float(t.imag.mid())) for t in (hardest.turning(0), hardest.end(0)))]
    for start, end in pairwise(corners):

        def rates(_, state, leg=end - start):
            y, speed = state
            return leg * np.array([speed, -2 * y * (y**3 + v_star**2 * speed * y)])

        state = solve_ivp(rates, (0, 1), state, method="DOP853", rtol=1e-10, atol=1e-12).y[:, -1]
    assert abs(-state[1] - value) < error
    assert abs(state[0] - v_star * np.sqrt(value)) < error


def test_panels_agree_and_one_of_them_starts_with_the_elastic_collision(centre):
    assert agree(*centre)
    assert all(map(starts_elastically, centre))


def test_a_neighbour_of_another_size_agrees(centre):
    small = prove_disc(Square(Fraction(3, 16), Fraction(5, 16), Fraction(1, 16)))
    assert agree(centre[1], small)
    with pytest.raises(ValueError, match="do not touch"):
        agree(centre[0], small)


# --- it fails where it must -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("level", [4, 9, 12])
def test_eps_is_not_proven_to_be_analytic_where_it_is_not(level):
    """Squares that hold the singularity; on another sheet it is none, and a panel of another sheet may be proven."""
    square = square_around(singular(), level)
    try:
        panel = prove_disc(square)
    except ArithmeticError:
        return
    value, error = epsilon(panel, square.centre)
    assert abs(value - continued(square.centre)[0]) > 1 + error


def test_panels_on_different_sheets_do_not_agree(monkeypatch, hardest):
    """Next to the singularity contact has a second end; with it, a panel is proven that fits no neighbour."""
    square = replace(hardest.square, x=hardest.square.x - 2 * hardest.square.half)
    assert agree(hardest, prove_disc(square))
    times = convergence._times(square)
    other = convergence._moved(times._replace(rest=0 * times.rest + 1.5568 + 0.2172j), times.v)
    monkeypatch.setattr(convergence, "_times", lambda _: other)
    elsewhere = prove_disc(square)
    assert not agree(hardest, elsewhere)
    assert epsilon(elsewhere, square.centre)[0] == pytest.approx(-0.1 + 1.1j, abs=0.3)


@pytest.mark.parametrize(("shift", "level"), [(0.9, 6), (0.9, 9), (0.6j, 9)])
def test_nor_if_the_draft_has_no_doubts(monkeypatch, shift, level):
    """The draft's own test is switched off, and the singularity is inside the circle that the draft is made on."""
    monkeypatch.setattr(convergence, "LAST_IN_Z", np.inf)
    half = Fraction(1, 2**level)
    centre = singular() - shift * float(half) * singular() / abs(singular())
    square = Square(*(Fraction(round(c * 2**20), 2**20) for c in (centre.real, centre.imag)), half)
    assert abs(square.centre - singular()) < float(square.radius)
    with pytest.raises(ArithmeticError):
        prove_disc(square)


def test_a_disc_that_holds_the_singularity_is_not_covered(monkeypatch):
    monkeypatch.setattr(convergence, "SMALLEST", Fraction(1, 2**9))
    with pytest.raises(ArithmeticError):
        list(proven_discs(Fraction(21, 20), [square_around(singular(), 9)]))


def test_paths_that_are_too_far_apart_do_not_agree(centre):
    one, other = centre
    shifted = replace(other, end=other.end + acb_poly([2 * one.reach]))
    assert not agree(one, shifted)
    assert not starts_elastically(shifted)
    assert not agree(one, replace(other, turning=other.turning + acb_poly([acb(0, 2 * one.reach)])))


@pytest.fixture(scope="module")
def drafted():
    """A square, its draft, and eps at its middle."""
    square = Square(Fraction(5, 8), Fraction(3, 8), Fraction(1, 8))
    return square, convergence._draft(square), continued(square.centre)[0]


@pytest.mark.parametrize("size", [1e-9, 1e-7, 1e-4])
@pytest.mark.parametrize("leg", [0, 1])
@pytest.mark.parametrize("name", ["R", "W"])
def test_wrong_drafts_are_refused_or_enclose(drafted, size, leg, name):
    """A coefficient of one piece is wrong: the error that is stated covers what comes of it."""
    square, draft, known = drafted
    pieces = list(draft.legs[leg].pieces)
    change = np.zeros((3, 2), complex)
    change[2, 1] = size
    pieces[1] = pieces[1]._replace(**{name: getattr(pieces[1], name) + BivariateBall.rounded(change)})
    legs = list(draft.legs)
    legs[leg] = replace(draft.legs[leg], pieces=pieces)
    with working(80):
        try:
            panel = convergence._proven(square, draft._replace(legs=legs))
        except ArithmeticError:
            assert size > 1e-8
            return
    value, error = epsilon(panel, square.centre)
    assert abs(value - known) < error
    assert error > size


@pytest.mark.parametrize("change", [{"root": -1}, {"root": 1j}, {"h": 1.01}, {"h": -1}])
def test_a_draft_of_something_else_is_refused(drafted, change):
    """The other root of eps; a leg of another length."""
    square, draft, _ = drafted
    if "root" in change:
        wrong = draft._replace(root=draft.root * BivariateBall.rounded(np.array([[change["root"]]])))
    else:
        last = replace(draft.legs[1], h=draft.legs[1].h * BivariateBall.rounded(np.array([[change["h"]]])))
        wrong = draft._replace(legs=[draft.legs[0], last])
    with working(80), pytest.raises(ArithmeticError):
        convergence._proven(square, wrong)


# --- arithmetic and the disc ------------------------------------------------------------------------------------------


def value_at(rows: np.ndarray, y: complex, z: complex) -> complex:
    return complex(np.polynomial.polynomial.polyval2d(y, z, rows))


def coefficients(element: BivariateBall) -> np.ndarray:
    """The polynomial's, as floats."""
    re, im = (
        np.array([[float(c) for c in row] for row in convergence._rows(part)]) for part in (element.re, element.im)
    )
    rows = max(len(re), len(im))
    return (np.pad(re, ((0, rows - len(re)), (0, 0))) + 1j * np.pad(im, ((0, rows - len(im)), (0, 0)))) / 2.0**60


def test_products_enclose():
    rng = np.random.default_rng(1)
    tables = [(rng.normal(size=(2, ORDER + 1, TERMS)) * [[[1]], [[1j]]]).sum(0) for _ in range(2)]
    f, g = map(BivariateBall.rounded, tables)
    product = f * (g + BivariateBall(f.re * 0, f.im * 0, 1 << 50))
    for y, z in np.exp(2j * np.pi * rng.uniform(size=(20, 2))):
        true = value_at(tables[0], y, z) * (value_at(tables[1], y, z) + 2.0**-10)
        assert abs(true - value_at(coefficients(product), y, z)) < product.error / 2.0**60
        assert abs(true) < product.norm()
        assert abs(value_at(tables[0], 0.3 * y, z)) < f.majorant()(arb(0.3))
        at_advance = value_at(tables[0], float(convergence.ADVANCE), z)
        assert value_at(coefficients(f.advanced()), 0, z) == pytest.approx(at_advance, rel=1e-12)
        slope = value_at(np.arange(1, ORDER + 1)[:, None] * tables[0][1:], y, z)
        assert value_at(coefficients(f.slope()), y, z) == pytest.approx(slope, rel=1e-10)


def test_products_count_every_part_of_their_error():
    """Errors of either factor and of both, and what is cut off the real and the imaginary part."""
    one = BivariateBall.linear(1)
    wide, last = replace(one, error=1 << 50), np.eye(ORDER + 1)[:, -1:]
    assert min((wide * one).error, (one * wide).error) >= 1 << 50
    assert (wide * wide).error >= (1 << 51) + (1 << 40)
    assert min((BivariateBall.rounded(last) * BivariateBall.rounded(i * last)).error for i in (1, 1j)) >= 1 << 60


def test_squares_cover_the_upper_half_of_the_disc(monkeypatch):
    """Whatever is proven and whatever is not."""
    rng = np.random.default_rng(2)

    def by_chance(square):
        if rng.uniform() < 0.4 and square.half > Fraction(1, 256):
            raise ArithmeticError
        return square

    monkeypatch.setattr(convergence, "prove_disc", by_chance)
    found = list(proven_discs(Fraction(26, 25)))
    points = 1.04 * np.sqrt(rng.uniform(size=2000)) * np.exp(1j * np.pi * rng.uniform(size=2000))
    x, y, half = (np.array([float(getattr(square, name)) for square in found])[:, None] for name in ("x", "y", "half"))
    holds = (abs(points.real - x) <= half) & (abs(points.imag - y) <= half)
    assert holds.any(axis=0).all()
    assert max(square.nearest() for square in found) <= Fraction(26, 25) ** 2


def test_numbers_that_are_not_exact_are_refused():
    with pytest.raises(ValueError, match="multiples"):
        Square(Fraction(1, 3), Fraction(0), Fraction(1, 8))


# --- the whole --------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_the_series_converges_for_the_radius_that_the_page_states():
    radius, bound, found = theorem()
    page = (ROOT / "docs" / "results" / "paper.md").read_text()
    stated = re.search(
        r"v_\\ast \\rvert \\le ([0-9.]+)\$\. There \$\\lvert \\varepsilon \\rvert \\le ([0-9.]+)\$", page
    )
    assert stated
    assert Fraction(stated[1]) == radius < abs(singular())
    assert bound < arb(stated[2])
    assert len(found) > 50
    h = series(120, 60).h
    with working(200):
        assert all(abs(h_k) * (arb(radius.numerator) / radius.denominator) ** k < bound for k, h_k in enumerate(h))
