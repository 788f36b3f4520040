"""The rows of the table that kernels are compared with: their proof finds wrong rows out, and agrees with `exact`."""

import math
import random
from fractions import Fraction
from functools import cache

import pytest
from flint import arb, arb_poly, fmpz_poly

from tests import daily
from tools import panel_bounds
from viscopade.arithmetic.balls import working
from viscopade.arrays import panels
from viscopade.arrays.panels import CENTRES, HALF_WIDTHS, PANELS
from viscopade.collision import exact, panel_proof
from viscopade.collision.exact import Collision
from viscopade.collision.panel_proof import END, RECORD_BITS, PanelBounds, PanelRow, panel_rows
from viscopade.theory.series import series

CHEAP = (5, 30)  # a few seconds each
ERROR = panel_proof.proven_error()
FUNCTIONS = ("epsilon", "one_minus_epsilon")
WRONG = Fraction(1, 2**55)


class Kept(panel_proof._PanelProof):
    """A proof that keeps what it compares the rows with."""

    def _compared(self, *found):
        self.found = found
        return super()._compared(*found)

    def again(self):
        with working(2 * self.bits):
            return super()._compared(*self.found)


@cache
def proof(index):
    kept = Kept(index)
    return kept, kept.bounds()


@cache
def collision(v_star: Fraction) -> Collision:
    return exact.collision(v_star, 26)


def v_star_at(index, z):
    return Fraction(float(CENTRES[index])) + Fraction(float(HALF_WIDTHS[index])) * z


def deviation(index, name, z):
    truth = Fraction(collision(v_star_at(index, z)).decimals()[name])
    return abs(panel_rows()[name, index](z) / truth - 1)


def change(monkeypatch, name, index, power, factor=1 + WRONG, add=Fraction(0)):
    """Make a row wrong by a factor in one coefficient, or by adding a multiple of the row's size."""
    row = panel_rows()[name, index]
    fine = [c << 80 for c in row.a]
    fine[power] = int(fine[power] * factor + add * fine[0 if index else 2])
    wrong = {**panel_rows(), (name, index): PanelRow(row.exponent - 80, tuple(fine))}
    monkeypatch.setattr(panel_proof, "panel_rows", lambda: wrong)


# --- panels -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("index", CHEAP)
def test_a_panel_is_proven(index):
    _, bounds = proof(index)
    for name in FUNCTIONS:
        bound = getattr(bounds, name)
        assert bound < ERROR
        points = [Fraction(p, 8) for p in (-8, -7, -5, -2, 0, 1, 4, 6, 8)]
        largest = max(deviation(index, name, z) for z in points)
        assert float(largest) <= float(bound)
        assert float(bound) < 2.0**-62


DAYS = 100  # after which all panels have been proven again


def proven_again(index):
    """Prove a panel; the record has the same bounds but for what another libm may change."""
    print(f"panel {index} of VISCOPADE_DAY={index % DAYS}")
    for found, recorded in zip(panel_proof.prove_panel(index).recorded(), panel_proof.proven()[index], strict=True):
        assert 0.99 * found < recorded < 1.01 * found + 1
        assert found * 2.0**-RECORD_BITS < ERROR / 2


@pytest.mark.parametrize("number", range(-(-PANELS // DAYS)))
def test_a_share_of_the_panels_is_proven_again(number):
    index = daily.place(number, DAYS)
    if index < PANELS:
        proven_again(index)


@pytest.mark.slow
@pytest.mark.parametrize("index", range(PANELS))
def test_every_panel_is_proven(index):
    proven_again(index)


@pytest.mark.parametrize("index", CHEAP)
@pytest.mark.parametrize("name", FUNCTIONS)
@pytest.mark.parametrize("sign", [-1, 1])
def test_a_row_that_is_wrong_is_found_out(monkeypatch, index, name, sign):
    kept, right = proof(index)
    other = FUNCTIONS[1 - FUNCTIONS.index(name)]
    change(monkeypatch, name, index, 0, 1 + sign * WRONG)
    bounds = kept.again()
    assert float(WRONG) * 0.999 < float(getattr(bounds, name)) < 1.5 * float(WRONG)
    assert getattr(bounds, other) == getattr(right, other)


@pytest.mark.parametrize("name", FUNCTIONS)
@pytest.mark.parametrize("power", [1, 2, 7, 13])
def test_a_row_that_is_wrong_away_from_the_middle_is_found_out(monkeypatch, name, power):
    index = CHEAP[0]
    kept, _ = proof(index)
    change(monkeypatch, name, index, power, 1, WRONG)
    assert float(getattr(kept.again(), name)) > float(WRONG) / 2


def test_a_row_that_is_very_wrong_is_refused(monkeypatch):
    kept, _ = proof(CHEAP[0])
    change(monkeypatch, "epsilon", CHEAP[0], 0, 1 + Fraction(1, 2**39))
    with pytest.raises(ArithmeticError, match="only"):
        kept.again()


def test_the_errors_of_the_ends_are_in_the_bound():
    kept, right = proof(CHEAP[1])
    k, loading, unloading = kept.found
    with working(2 * kept.bits):
        more = arb(2) ** -50
        for worse in ((loading._replace(error=loading.error + more), unloading),
                      (loading, unloading._replace(error=unloading.error + more))):  # fmt: skip
            bounds = panel_proof._PanelProof._compared(kept, k, *worse)
            assert float(bounds.epsilon) >= float(right.epsilon) + 2.0**-50
            assert float(bounds.one_minus_epsilon) >= float(right.one_minus_epsilon) + 2.0**-50


def test_another_k_is_in_the_bound():
    """The comparison with v* finds out a k that does not belong to it: kappa^5 = k^5 F/16."""
    kept, right = proof(CHEAP[1])
    k, loading, unloading = kept.found
    with working(2 * kept.bits):
        wrong = k._replace(polynomial=k.polynomial * (2**50 + 1), exponent=k.exponent - 50)
        bounds = panel_proof._PanelProof._compared(kept, wrong, loading, unloading)
    # kappa is larger by 2^-50: eps changes by at most 2, 1 - eps by at most 3 times that.
    assert float(bounds.epsilon) > float(right.epsilon) + 2 * 2.0**-50
    assert float(bounds.one_minus_epsilon) > float(right.one_minus_epsilon) + 3 * 2.0**-50


@pytest.mark.parametrize("index", [-1, PANELS])
def test_there_is_no_such_panel(index):
    with pytest.raises(ValueError, match=f"expected 0 to {PANELS - 1}"):
        panel_proof.prove_panel(index)


def test_rows_are_within_the_proven_error_of_exact():
    """Sampled on random panels, and on the first near 0, where 1 - eps is small."""
    draw = random.Random(7)
    for index in [0, 0, *draw.sample(range(1, PANELS), 10)]:
        z = Fraction(draw.randint(0 if index == 0 else -(2**20), 2**20), 2**20)
        for name in FUNCTIONS:
            assert deviation(index, name, z) < ERROR


@pytest.mark.parametrize("index", [0, 73])
def test_parts_of_a_panel_bound_a_polynomial_closely(index):
    """T_14 is steepest at the ends; there an error of interpolation is as large as in the middle."""
    steep = fmpz_poly.chebyshev_t(14)
    with working(200):
        assert (
            1
            <= panel_proof._PanelProof(index)._most(arb_poly(steep(fmpz_poly([-1, 2])) if index == 0 else steep))
            < 1.2
        )


def test_panels_are_exact_and_without_gaps():
    assert v_star_at(0, Fraction(0)) == 0
    for index in range(1, PANELS):
        assert v_star_at(index, Fraction(-1)) == v_star_at(index - 1, Fraction(1))
    assert v_star_at(PANELS - 1, Fraction(1)) == END


def test_row_as_value_and_as_polynomial():
    row = PanelRow(-3, (8, 4, -2))
    assert row(Fraction(1, 2)) == Fraction(19, 16)
    with working(64):
        assert row.poly().coeffs() == [1, arb(1) / 2, -arb(1) / 4]


# --- the record -------------------------------------------------------------------------------------------------------


def test_the_error_is_a_power_of_2_that_leaves_a_bit():
    worst = max(map(max, panel_proof.proven().values()))
    assert math.frexp(ERROR)[0] == 0.5
    assert 2 * worst <= ERROR * 2**RECORD_BITS < 4 * worst


@pytest.fixture
def files(monkeypatch):
    """Put other texts into the place of the package's."""
    texts = {name: panel_proof._text(name) for name in (panels.DATA, panel_proof.RECORD)}
    monkeypatch.setattr(panel_proof, "_text", texts.__getitem__)
    panel_proof.proven_error.cache_clear()
    yield texts
    panel_proof.proven_error.cache_clear()


def test_a_worse_panel_is_a_larger_error(files):
    files[panel_proof.RECORD] = files[panel_proof.RECORD].replace("\n73 ", f"\n73 {2**21}", 1)
    assert panel_proof.proven_error() > ERROR


@pytest.mark.parametrize("name", [panels.DATA, panel_proof.RECORD])
def test_a_record_of_another_table_is_refused(files, name):
    files[name] = "\n".join(files[name].splitlines()[:-1])
    with pytest.raises(OSError, match=r"python -m tools\.panel_bounds"):
        panel_proof.proven_error()


def test_what_the_command_writes_is_what_is_read(files, monkeypatch):
    proven = PanelBounds(arb(2) ** -62, arb(2) ** -61 + arb(2) ** -100)
    monkeypatch.setattr(panel_bounds, "prove_panel", lambda index: proven)
    files[panel_proof.RECORD] = "of another table"
    files[panel_proof.RECORD] = "\n".join(panel_bounds.record())
    assert set(map(tuple, panel_proof.proven().values())) == {(2**18, 2**19 + 1)}
    assert panel_proof.proven_error() == 2.0**-59


def test_no_panel_is_proven_with_less_than_a_bit_of_margin():
    """Panel 73, whose proof on 64 equal parts had 2^-60.97, among them."""
    assert max(map(max, panel_proof.proven().values())) < 2 ** (RECORD_BITS - 61)


# --- panel 0 ----------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(("name", "power"), [("epsilon", 0), ("epsilon", 2), ("one_minus_epsilon", 2)])
def test_a_wrong_row_at_0_is_found_out(monkeypatch, name, power):
    kept, _ = proof(0)
    change(monkeypatch, name, 0, power)
    assert float(getattr(kept.again(), name)) > float(WRONG) / 2**8


def test_below_elastic():
    bounds = panel_proof.elastic_error()
    assert max(bounds) < ERROR
    for exponent in (37, 45, 70):
        z = Fraction(1, 2 ** (exponent - 4))
        truth = Fraction(exact.collision(Fraction(1, 2**exponent), 26).decimals()["one_minus_epsilon"])
        relative = abs(panel_rows()["one_minus_epsilon", 0](z) / truth - 1)
        assert float(relative) <= float(bounds.one_minus_epsilon)


def test_the_series_second_term_is_in_the_bound_below_elastic(monkeypatch):
    monkeypatch.setattr(panel_proof, "ELASTIC", Fraction(1, 2**24))
    assert float(panel_proof.elastic_error().one_minus_epsilon) >= 8 * 2.0**-48


@pytest.mark.parametrize(("name", "power"), [("epsilon", 0), ("one_minus_epsilon", 2)])
def test_a_wrong_row_below_elastic_is_found_out(monkeypatch, name, power):
    change(monkeypatch, name, 0, power)
    assert float(getattr(panel_proof.elastic_error(), name)) > 0.999 * float(WRONG)


@pytest.mark.parametrize("power", [0, 1])
def test_a_row_that_does_not_vanish_at_0_is_refused(monkeypatch, power):
    change(monkeypatch, "one_minus_epsilon", 0, power, 1, Fraction(1, 2**70))
    with pytest.raises(ArithmeticError, match="z"):
        panel_proof.elastic_error()


# --- step 8 -----------------------------------------------------------------------------------------------------------


def test_lambda_1_is_the_series_first_coefficient():
    h_2 = Fraction(series(2, 40).decimals()[2])
    with working(200):
        assert abs(panel_proof.lambda_1_ball() + arb(h_2.numerator) / h_2.denominator) < arb(10) ** -39


@pytest.mark.parametrize("exponent", [10, 12, 20])
def test_small_v_star(exponent):
    """|(1 - eps)/(lambda_1 kappa) - 1| <= 8 kappa, and it is not much smaller."""
    kappa = Fraction(1, 2 ** (2 * exponent))
    truth = Fraction(exact.collision(Fraction(1, 2**exponent), 40).decimals()["one_minus_epsilon"])
    with working(200):
        ratio = (
            arb(truth.numerator)
            / truth.denominator
            / (panel_proof.lambda_1_ball() * kappa.numerator / kappa.denominator)
        )
        assert abs(ratio - 1) <= 8 * arb(kappa.numerator) / kappa.denominator
        assert abs(ratio - 1) >= arb(kappa.numerator) / kappa.denominator / 10


@pytest.mark.parametrize("v_star", [4, 5, 10, 1000, 10**6, 10**9])
def test_large_v_star(v_star):
    truth = Fraction(exact.collision(v_star, 40).decimals()["epsilon"])
    with working(200):
        at = arb(v_star)
        scaled = (
            arb(truth.numerator) / truth.denominator * at ** (arb(10) / 3) / panel_proof.asymptotic_factor()
        ).log()
        assert abs(scaled) <= panel_proof.tail(at)
        assert panel_proof.tail(at) < 4 * abs(scaled)


def test_the_limit():
    with working(100):
        assert abs(panel_proof.asymptotic_factor() - (arb(3) / 2) ** (arb(2) / 3)) < arb(2) ** -90


@pytest.mark.parametrize("v_star", ["3.9", "0", "-5"])
def test_tail_is_refused_for_small_v_star(v_star):
    with working(64), pytest.raises(ValueError, match="4 or more"):
        panel_proof.tail(arb(v_star))
