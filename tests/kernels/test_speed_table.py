"""Tables over the bits of w = beta^5 v: the exact function by another route, the proofs, and what refuses."""

import math
import struct
from fractions import Fraction
from itertools import pairwise
from random import Random

import pytest
from flint import fmpq_poly

from viscopade.arithmetic.chebyshev import (
    chebyshev,
    cut,
    greatest,
    in_chebyshev,
    interpolated,
    nodes,
    to_fmpq,
    to_fraction,
)
from viscopade.arithmetic.formats import DOUBLE, FLOAT
from viscopade.collision import exact, panel_proof
from viscopade.kernels import speed_table
from viscopade.kernels.speed_table import TABLES, HalfWords, Layout, Polynomials, table_bounds

SMALL, FULL = TABLES["5e-6"], TABLES["full"]


def true(w: Fraction, base: int) -> Fraction:
    """Eps - base, by integration of the motion to 30 digits: a route without tables."""
    root = exact.collision(beta="1", speed=w, digits=30)
    return -Fraction(root.decimals()["one_minus_epsilon"]) if base else Fraction(root.decimals()["epsilon"])


def somewhere(table: Layout, index: int, random: Random) -> Fraction:
    _, low, high = table.interval(index)
    return low + (high - low) * Fraction(random.randrange(2**30), 2**30)


def value(table, index, m):
    """Return a row's p by powers, exactly."""
    return sum(Fraction(c) * (m - table.origin(index)) ** n for n, c in enumerate(table.coefficients(index).values()))


@pytest.mark.parametrize(
    ("table", "share"),
    [
        (SMALL, "0.8"),
        (Polynomials(1, -60, 7, DOUBLE), "0.7"),
        (Polynomials(3, -96, 1, FLOAT), "0.8"),
        (HalfWords(1, -60, 6, DOUBLE), "0.5"),
    ],
    ids=["cubic", "septic", "linear", "half words"],
)
def test_errors_are_within_the_row_s_bound_and_nearly_reach_it(table, share):
    random, shares = Random(1), []
    for index in random.sample(range(table.size), 12):
        exponent = table.interval(index)[0]
        bound = table.bounds(index)["error"]
        for _ in range(4):
            m = somewhere(table, index, random)
            p = true(m * Fraction(2) ** exponent, table.base(index))
            shares.append(abs(value(table, index, m) - p) / min(abs(p), 1 - abs(p)) / bound)
    assert max(shares) <= 1
    assert max(shares) > Fraction(share)


@pytest.mark.parametrize("index", [3, 2000, TABLES["1e-10"].switch, 4095])
def test_a_word_holds_two_coefficients(index):
    """The second one is its last 32 bits, and the first is as near as doubles with these bits can be."""
    table = TABLES["1e-10"]
    *_, c3, c4 = Polynomials.row(table, index)
    *_, first, last = table.coefficients(index).values()
    (word,) = struct.unpack("<Q", struct.pack("<d", first))
    assert struct.pack("<Q", word << 32 & (1 << 64) - 1) == struct.pack("<d", last)
    # 32 bits are 12 of sign and exponent, and 20 digits behind the point.
    assert abs(first - c3) <= math.ulp(c3) * 2**31
    assert abs(last / c4 - 1) <= 2**-21


def test_the_bound_of_the_table_is_that_of_its_worst_row():
    worst = max(range(SMALL.size), key=lambda i: SMALL.bounds(i)["error"])
    assert table_bounds(SMALL)["error"] == SMALL.bounds(worst)["error"] < Fraction("3.3e-6")


def test_a_wrong_coefficient_is_found_by_the_bounds():
    wrong = Polynomials(2, -96, 3, FLOAT)
    rows = list(wrong.rows)
    rows[300] = (rows[300][0] * (1 + 2**-16), *rows[300][1:])
    wrong.__dict__["rows"] = tuple(rows)
    assert wrong.bounds(300)["error"] > 4 * SMALL.bounds(300)["error"]


def test_pieces_join_where_the_panels_of_the_reference_end():
    split = [i for i in range(SMALL.size) if len(SMALL.pieces(i)) > 1]
    assert len(split) > 20
    for index in split[:5]:
        parts = SMALL.pieces(index)
        _, low, high = SMALL.interval(index)
        assert parts[0].centre - parts[0].half == low
        assert parts[-1].centre + parts[-1].half == high
        for before, after in pairwise(parts):
            assert before.centre + before.half == after.centre - after.half
            left, right = to_fraction(before.p(1)), to_fraction(after.p(-1))
            assert abs(left - right) <= before.error + after.error


def test_full_table_has_a_bound_below_one_ulp():
    assert table_bounds(FULL)["ulp"] < 1
    assert speed_table.speed_table("full").bytes == 1024 * 12 * 8


def test_steepest_slopes():
    """The limits are 10/3 and 2; local slopes by differences."""
    bound = panel_proof.steepest()
    assert Fraction(10, 3) <= bound < Fraction(7, 2)
    for w in (Fraction(1, 2**30), Fraction(1), Fraction(2**30)):
        p, q = (true(w * k, 0) for k in (1, Fraction(1001, 1000)))
        assert abs(1 - q / p) / Fraction(1, 1000) * 10 <= bound


def test_chebyshev_helpers():
    p = fmpq_poly([1, 2, 3, 4, 5])
    assert sum((chebyshev(n) * c for n, c in enumerate(in_chebyshev(p))), fmpq_poly([])) == p
    assert cut(p, 4) == p
    assert greatest(chebyshev(5)) == 1
    assert greatest(p) == 15
    wave = chebyshev(1) - chebyshev(3)  # 2 sin(theta) sin(2 theta), at most 8/sqrt(27)
    assert Fraction("1.5396") < greatest(wave, 256) < Fraction("1.55") < greatest(wave) == 2
    points = nodes(5)
    assert interpolated(points, [to_fraction(p(to_fmpq(x))) for x in points]) == p


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((9, -96, 3, FLOAT), "split is 9: expected 0 to 8"),
        ((-1, -96, 3, FLOAT), "split is -1"),
        ((2, -200, 3, FLOAT), "first is -200: expected -124 to -28"),
        ((2, -96, 2, FLOAT), "degree is 2: expected odd numbers from 1 to 15"),
        ((2, -96, 17, FLOAT), "degree is 17"),
    ],
)
def test_tables_that_do_not_exist(arguments, message):
    with pytest.raises(ValueError, match=message):
        Polynomials(*arguments)
    with pytest.raises(ValueError, match="degree is 5: expected even numbers from 2 to 14"):
        HalfWords(2, -96, 5, DOUBLE)


def test_a_function_that_may_vanish_is_refused():
    piece = SMALL.pieces(300)[0]
    with pytest.raises(ArithmeticError, match="p may vanish in row 300"):
        SMALL.bounds_on(300, piece._replace(p=piece.p - piece.p[0]), 1)
    with pytest.raises(ArithmeticError, match="p may vanish"):
        FULL.bounds_on(5, piece._replace(p=piece.p - piece.p[0]), 1)
