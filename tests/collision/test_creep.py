"""Unloading to x = 0 against strong damping: closed forms, one integration for all of it, the scaling, wrong parts."""

from contextlib import suppress
from dataclasses import replace
from functools import cache
from unittest import mock

import pytest
from flint import arb, fmpz_poly
from mpmath import mp, mpf

from tests.closed_forms import nu_1
from viscopade.arithmetic.balls import ball_of, working
from viscopade.collision import creep, exact
from viscopade.collision.creep import Creep, ends_of, setting, unloading
from viscopade.collision.flow import Dyadic, Motion
from viscopade.collision.validation import Ends
from viscopade.theory.law import Law, law_of

LAWS = [
    *(Law(a, b, "return") for a, b in (("3/2", "1/2"), ("3/2", "1"), ("1", "1/2"), ("2", "1"), ("7/2", "3/2"))),
    *(Law(a, b) for a, b in (("1", "1"), ("3/2", "3/2"), ("1/2", "1"), ("1/2", "2"))),
    Law("1/2", "0", "return"),
]
of_laws = pytest.mark.parametrize("law", LAWS, ids=lambda law: f"{law}-nu-{law.nu}".replace("/", "_"))
ACCURACY = 90


def log_distance(a: mpf, b: mpf) -> mpf:
    return abs(mp.log(a / b))


@pytest.mark.parametrize("kappa", ["300", "1e4", "1e7", "1e13", "1e30"])
@pytest.mark.parametrize("law", ["1,1", "3/2,3/2", "1/3,1/3"])
def test_nu_1_to_50_digits(law, kappa):
    found = exact.collision(kappa=kappa, digits=52, law=law).mpf()
    with mp.workdps(100):
        closed = nu_1(mpf(kappa))
        assert log_distance(found["epsilon"], closed) < mpf(10) ** -50
        assert log_distance(found["one_minus_epsilon"], 1 - closed) < mpf(10) ** -50


@of_laws
@pytest.mark.parametrize("kappa", ["5", "20", "70"])
def test_the_three_parts_against_one_integration(law, kappa):
    """For the smallest kappa nothing is to be gained, and there is one part only."""
    if law.nu > 1.7:
        kappa = kappa[0]
    found = exact.collision(kappa=kappa, digits=15, law=law)
    with mock.patch.object(creep, "setting", return_value=None):
        assert exact.collision(kappa=kappa, digits=15, law=law).decimals() == found.decimals()


@of_laws
@pytest.mark.parametrize("kappa", ["1e9", "1e30"])
def test_epsilon_is_a_power_of_kappa(law, kappa):
    """eps -> C kappa^-p, p = nu/(2 - nu); what differs is exponentially small."""
    with mp.workdps(40):
        low, high = (exact.collision(kappa=mpf(kappa) * c, digits=25, law=law).mpf()["epsilon"] for c in (1, 16))
        relative = 1 / mpf(kappa) ** min(float(law.nu), 1.0)  # corrections of F, of loading
        assert abs(mp.log(low / high) / mp.log(16) - mpf(law.decay.numerator) / law.decay.denominator) < relative


@of_laws
def test_there_and_back_at_a_tiny_epsilon(law):
    there = exact.invert("1e-30", 25, law=law)
    back = exact.collision(kappa=there.decimals()["kappa"], digits=20, law=law)
    with mp.workdps(40):
        assert log_distance(back.mpf()["epsilon"], mpf("1e-30")) < mpf(10) ** -15
        assert log_distance(back.mpf()["tau_c"], there.mpf()["tau_c"]) < mpf(10) ** -18


@pytest.mark.parametrize("law", ["1,1", "1/2,1", "1/2,1/4"])
def test_another_accuracy_has_another_k_0(law):
    of = law_of(law, "return")
    few, many = (exact.collision(kappa="1e12", digits=digits, law=of) for digits in (12, 45))
    assert few.tau_c.overlaps(many.tau_c)
    assert few.x_max.overlaps(many.x_max)
    assert few.epsilon.overlaps(many.epsilon)


def test_where_there_are_no_three_parts():
    for law in (law_of("viscoelastic"), law_of("linear", "return"), law_of("3/2,0", "return")):
        assert setting(ACCURACY, Motion.of(law)) is None
    k = Dyadic(-3, 0)
    assert not isinstance(unloading(k, ACCURACY, Motion.of(LAWS[0])), Creep)


# --- wrong on purpose -------------------------------------------------------------------------------------------------


@cache
def creeping(law: Law, accuracy: int = ACCURACY) -> Creep:
    found = unloading(Dyadic(-1000, 3), accuracy, Motion.of(law))
    assert isinstance(found, Creep)
    return found


@cache
def truth(law: Law) -> Ends:
    return ends_of(creeping(law, 2 * ACCURACY))


@of_laws
def test_the_proof_is_not_vacuous(law):
    with working(4 * ACCURACY):
        for value, fine in zip(ends_of(creeping(law)), truth(law), strict=True):
            assert value.overlaps(fine)
            assert value.rel_accuracy_bits() > ACCURACY


@of_laws
@pytest.mark.parametrize("n", [1, 3, 9, 15])
@pytest.mark.parametrize("name", ["w", "over_w"])
def test_a_wrong_series_is_covered_or_refused(law, n, name):
    right = creeping(law)
    coefficients = [*getattr(right.setting, name).coeffs(), *(20 * [0])]
    coefficients[n] += 1
    wrong = replace(right, setting=right.setting._replace(**{name: fmpz_poly(coefficients)}))
    with suppress(ArithmeticError), working(4 * ACCURACY):
        assert all(value.overlaps(fine) for value, fine in zip(ends_of(wrong), truth(law), strict=True))


@of_laws
@pytest.mark.parametrize("missing", [1, 5, 10])
def test_a_beginning_that_ends_too_early_is_covered_or_refused(law, missing):
    """Neither part need have come to the slow manifold: its distance there is part of the proof."""
    right = creeping(law)
    first = replace(right.first, pieces=right.first.pieces[:-missing])
    for wrong in (replace(right, first=first), replace(right, settled=right.settled - missing)):
        with suppress(ArithmeticError), working(4 * ACCURACY):
            found = ends_of(wrong)
            assert all(value.overlaps(fine) for value, fine in zip(found, truth(law), strict=True))
            assert missing == 1 or law.nu > 1.7 or any(value.rel_accuracy_bits() < ACCURACY for value in found)


def test_parts_that_overlap_are_refused():
    right = creeping(LAWS[0])
    k_0 = right.setting.k_0
    same = replace(right, k=Dyadic(-k_0.mantissa, k_0.exponent), first=right.last)
    with pytest.raises(ArithmeticError, match="no slow manifold"):
        ends_of(replace(same, first=replace(right.last, pieces=right.last.pieces[: right.settled + 3])))


def test_the_slow_manifold_of_nu_1_is_a_constant():
    """p = 1/k solves p dp/du = (r^(n-1) - k p r^(n-1))/2."""
    for law in ("1,1", "3/2,3/2"):
        of = setting(ACCURACY, Motion.of(law_of(law)))
        assert list(of.w.coeffs()) == list(of.over_w.coeffs()) == [1]


@of_laws
def test_the_bound_of_the_slope_in_k(law):
    """-nu/(2 - nu) <= d ln P/d ln k <= 0, by differences, from small k on."""
    motion = Motion.of(law)
    with working(200):
        for mantissa in (1, 4, 9, 24, 70, 600):
            k, above = Dyadic(-mantissa, -2), Dyadic(-mantissa * 1025, -12)
            low, high = (ends_of(unloading(c, ACCURACY, motion)).p for c in (k, above))
            slope = (high / low).log() / (arb(1025) / 1024).log()
            least = -ball_of(law.nu / (2 - law.nu))
            assert not slope < least - arb(10) ** -15
            assert not slope > 0
