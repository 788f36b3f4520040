"""The kernels of full accuracy: proven bounds, compiled C where rounding is hardest, and no undefined behaviour.

Compiled code at all other arguments is checked by test_vectors.py and test_languages.py.
"""

from fractions import Fraction
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from flint import fmpz

from tests import compiled
from tests.compiled import compiler
from viscopade.arithmetic.balls import working
from viscopade.arithmetic.formats import DOUBLE, exponent
from viscopade.arrays import panels
from viscopade.collision import exact
from viscopade.kernels import full
from viscopade_lab.studies import exhaustive

HEADER = Path(__file__).parents[2] / "exports" / "viscopade_full.h"


@pytest.fixture(scope="module")
def text():
    return HEADER.read_text()


@pytest.fixture(scope="module")
def library(text, tmp_path_factory):
    """The functions, compiled with fused operations."""
    flags = ("-O3", *compiled.machine_flags(), "-ffp-contract=fast")
    return compiled.build(tmp_path_factory.mktemp("full"), [text], flags=flags)


# --- the truth ------------------------------------------------------------------------------------------------------


@cache
def truth(function, v_star):
    """From `exact`; where the power law for large v* (section 2.5) is good to 2^-64, from that."""
    if v_star > 2.0**22:
        return power_law(v_star) if function == "epsilon" else 1 - power_law(v_star)
    return Fraction(exact.collision(v_star, 35).decimals()[function])


def power_law(v_star):
    """Return (3/2)^(2/3) v*^(-10/3) to more than 100 bits."""
    cube = Fraction(9, 4) / Fraction(v_star) ** 10
    shift = 128 - exponent(cube) // 3
    return Fraction(int(fmpz(int(cube * Fraction(8) ** shift)).root(3))) / Fraction(2) ** shift


def ulps(result, true):
    return abs(Fraction(float(result)) - true) / DOUBLE.ulp(true)


# --- certificate ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("function", full.FUNCTIONS)
def test_bounds_are_those_of_the_worst_panel(function):
    bounds = full.bounds()[function]
    assert len(bounds) == 1 + len(full.smaller_panels())
    assert 0.5 < full.largest_ulp(function) == max(bounds) < 0.6
    normal, everywhere = full.full().bound(function, "host", "double")
    assert normal.ulps == everywhere.ulps == max(bounds)
    assert normal.absolute == 0 < everywhere.absolute < 0.3
    low, high = full.NORMAL[function]  # there the result is a normal number, with room to spare
    assert DOUBLE.least < truth(function, float(low or high)) < 2 * DOUBLE.least


def table_value(function, v_star):
    """Return the value of the polynomials of `viscopade.arrays.double`, exactly."""
    index = int(np.searchsorted(panels.CENTRES + panels.HALF_WIDTHS, v_star, side="right"))
    z = (Fraction(v_star) - Fraction(panels.CENTRES[index])) / Fraction(panels.HALF_WIDTHS[index])
    return full.table_row(function, index)(z)


@pytest.mark.parametrize("function", full.FUNCTIONS)
def test_errors_are_below_the_bounds_and_not_far_below(library, function):
    """Sampled on every panel against the polynomials: the bound holds, and the largest error comes near it."""
    generator = np.random.default_rng(3)
    worst = Fraction(0)
    ends = [(Fraction(0), full.NEAR), *((p.centre - p.half, p.centre + p.half) for p in full.smaller_panels())]
    for (low, high), bound in zip(ends, full.bounds()[function], strict=True):
        values = generator.uniform(float(low), float(high), 12)
        values = values[(values >= low) & (values < high) & (values > 0)]
        for v_star in values:
            error = ulps(library[f"{function}_full"](v_star), table_value(function, v_star))
            assert error <= bound, float(v_star).hex()
            worst = max(worst, error)
    assert worst > Fraction(49, 100)


def with_row(monkeypatch, column, factor):
    """Change a number of row 200 of the table."""
    rows, place = list(full.panel_table()), full.COLUMNS.index(column)
    rows[200] = tuple(c * factor if n == place else c for n, c in enumerate(rows[200]))
    monkeypatch.setattr(full, "panel_table", lambda: tuple(rows))


@pytest.mark.parametrize(("column", "factor"), [("a0_high", 1 + 2.0**-50), ("a0_low", 9.0), ("a1_low", 1e4)])
def test_certificate_sees_a_wrong_coefficient(monkeypatch, column, factor):
    with_row(monkeypatch, column, factor)
    with working(128):
        assert full.panel_bound(199, loss=False) > 2


def test_certificate_refuses_a_leading_part_that_is_not_exact(monkeypatch):
    with_row(monkeypatch, "a1_high", 1 + 2.0**-40)
    with working(128), pytest.raises(ArithmeticError, match="not exact"):
        full.panel_bound(199, loss=False)


def test_certificate_sees_a_wrong_coefficient_near_0(monkeypatch):
    right = full.near_constants()
    monkeypatch.setattr(full, "near_constants", lambda: right | {"d0": right["d0"] * (1 + 2.0**-20)})
    with working(128):
        assert full._near_bound() > 1


# --- the checks themselves ------------------------------------------------------------------------------------------


def test_reference_of_the_checks_is_right(text):
    """The reference in long double against exact values: errors of the kernel agree to 0.01 ulp."""
    compiler("c11")
    values = [*np.geomspace(1e-3, 1e6, 30).tolist(), 1e-170, 3e-5, 1e60, 1e94]
    bits = np.array(values).view(np.uint64).tolist()
    with exhaustive.compiled("exhaustive_double", "plain", exhaustive.double_files(text)) as program:
        for number, function in enumerate(full.FUNCTIONS):
            lines = exhaustive.outputs(program, [(number, at, at + 1, 1, 1) for at in bits])
            for v_star, (_, error, at, result) in zip(values, lines, strict=True):
                assert float.fromhex(at) == v_star
                exactly = ulps(float.fromhex(result), truth(function, v_star))
                assert abs(float(exactly) - float(error)) < exhaustive.REFERENCE_ULP, v_star


def test_random_doubles_meet_their_bound(text):
    compiler("c11")
    with exhaustive.compiled("exhaustive_double", "fused", exhaustive.double_files(text)) as program:
        rows = [row for function in full.FUNCTIONS for row in exhaustive.doubles(program, function, 4000, 1)]
    assert all(0.49 < row.largest <= row.bound + exhaustive.REFERENCE_ULP for row in rows)
    assert all(row.total == 4000 and row.noted < 80 for row in rows)
