"""Array functions of any law: against closed forms, proven numbers and each other, and what is refused."""

import math

import numpy as np
import pytest
from mpmath import mp, mpf

import viscopade as vp
from tests import daily
from tests.closed_forms import nu_1, nu_2
from viscopade.collision import curve as module
from viscopade.collision import exact
from viscopade.collision.curve import Curve, interpolant
from viscopade.theory.law import law_of

KAPPAS = [0.0, *np.geomspace(1e-30, 1e-3, 7), *np.geomspace(2e-3, 30, 25), 1e3, 1e10, 1e100, 1e300]
LAWS = [
    ("hunt-crossley", None),
    ("3/2,1/2", None),
    ("3/2,0", None),
    ("5/4,1/4", None),
    ("3/2,1", None),
    ("2,1/2", None),
    ("1/2,3", None),
]
ATTRACTIVE = [("1,0", "return"), ("3/2,1/2", "return")]
QUICK = [LAWS[0], ATTRACTIVE[0]]

every_law = pytest.mark.parametrize(
    "law",
    [pytest.param(law_of(*law), marks=() if law in QUICK else pytest.mark.slow) for law in (*LAWS, *ATTRACTIVE)],
    ids=str,
)


def closed(law, kappa):
    """Return eps and 1 - eps in closed form."""
    if not kappa:
        return 1.0, 0.0
    with mp.workdps(80 + 2 * int(abs(math.log10(kappa)))):
        number = mpf(kappa)
        if law.nu == 1:
            eps = nu_1(number) if kappa < 100 else 1 / number
        else:
            eps = nu_2(number / (2 * mp.sqrt(mpf(law.damping.numerator) / law.damping.denominator + 1)), law.end)
        return float(eps), float(1 - eps)


@pytest.mark.parametrize("name", ["hunt-crossley", pytest.param("tsuji", marks=pytest.mark.slow)])
def test_closed_forms(name):
    found = vp.curve(name)
    wanted = np.array([closed(found.law, kappa) for kappa in KAPPAS])
    np.testing.assert_allclose(found.epsilon(KAPPAS), wanted[:, 0], rtol=module.ERROR)
    np.testing.assert_allclose(found.one_minus_epsilon(KAPPAS), wanted[:, 1], rtol=module.ERROR)
    by_loss, kappas = wanted[:, 0] > 0.5, np.array(KAPPAS)
    small = ~by_loss & (wanted[:, 0] > 0)  # 1e-600 is no double
    np.testing.assert_allclose(found.kappa_from(wanted[small, 0]), kappas[small], rtol=module.ERROR)
    back = found.kappa_from(one_minus_epsilon=wanted[by_loss, 1])
    np.testing.assert_allclose(back, kappas[by_loss], rtol=module.ERROR)


@every_law
def test_against_proven_numbers(law):
    found, generator = vp.curve(law), np.random.default_rng(daily.DAY)
    largest = math.log(min(found.kappa_max_of_course * (1 - 1e-12), 1e30))
    for s in [*generator.uniform(-60, largest, 5), *generator.uniform(-4, min(largest, 4), 5), -80, largest]:
        kappa = math.exp(s)
        true = exact.collision(kappa=kappa, digits=18, law=law).floats()
        numbers = {
            "epsilon": found.epsilon(kappa),
            "one_minus_epsilon": found.one_minus_epsilon(kappa),
            "x_max": found.x_max(kappa),
            "tau_c": found.tau_c(kappa),
        }
        for name, number in numbers.items():
            assert number == pytest.approx(true[name], rel=module.ERROR), (name, kappa)
        smaller = min(("epsilon", "one_minus_epsilon"), key=true.get)
        if smaller == "one_minus_epsilon" or true["epsilon"] >= 1.001e-3:
            assert found.kappa_from(**{smaller: true[smaller]}) == pytest.approx(kappa, rel=module.ERROR)


@every_law
def test_limits(law):
    found = vp.curve(law)
    assert (found.epsilon(0), found.one_minus_epsilon(0), found.kappa_from(1), found.kappa_from(1.0)) == (1, 0, 0, 0)
    if found.kappa_max == math.inf:
        assert (found.epsilon(math.inf), found.one_minus_epsilon(math.inf)) == (0, 1)
        assert found.kappa_from(0) == math.inf
        assert found.epsilon(1e100) / found.epsilon(1e90) == pytest.approx(1e10 ** -float(law.decay), rel=1e-11)
    if found.kappa_max_of_course == math.inf:
        assert (found.x_max(math.inf), found.tau_c(math.inf)) == (0, 0)
    elastic = exact.collision(kappa=0, law=law).floats()
    assert found.tau_c([0, 0])[1] == pytest.approx(elastic["tau_c"], rel=module.ERROR)
    assert found.x_max(0) == pytest.approx(elastic["x_max"], rel=module.ERROR)


def test_bad_input():
    """Numbers that are refused by every function of arrays: tests/test_arguments.py."""
    found = vp.curve("hunt-crossley")
    with pytest.raises(ValueError, match=r"kappa is 1000.0: expected a number >= 0 and <= 41.*law 3/2,3/2"):
        found.tau_c(1e3)
    with pytest.raises(TypeError, match="exactly one of epsilon and one_minus_epsilon"):
        found.kappa_from(0.5, one_minus_epsilon=0.5)
    with pytest.raises(ValueError, match="law is 'hertz'"):
        vp.curve("hertz")


def test_what_does_not_exist_is_refused():
    found = vp.curve(law_of("linear", "return"))
    assert found.kappa_max < 2
    with pytest.raises(ValueError, match=r"kappa is 2.0: expected a number >= 0 and <= 1.8"):
        found.epsilon(2.0)
    with pytest.raises(ValueError, match=r"epsilon is 0.0001: expected a number >= 0.001 and <= 1"):
        found.kappa_from(1e-4)


def test_interpolation_halves_panels_where_it_must():
    of = interpolant(lambda x: np.array([np.tanh(20 * x)]), np.array([-3.0, 3.0]))
    widths = np.diff(of.ends)
    assert widths.min() < widths.max() / 4
    x = np.linspace(-3, 3, 1001)
    np.testing.assert_allclose(of(0, x), np.tanh(20 * x), rtol=0, atol=1e-13)


def test_a_table_that_is_wrong_is_seen():
    """The comparison with closed forms can fail."""
    good = vp.curve("hunt-crossley")
    tables = module.curve_tables(good.law)
    shifted = [[list(row) for row in function] for function in tables.of_s.coefficients]
    for row in shifted[0]:
        row[0] += 1e-12
    of_s = module.Interpolant(tables.of_s.ends, shifted, tables.of_s.slopes)
    bad = Curve(good.law, module.Tables(of_s, tables.of_odds))
    assert abs(bad.one_minus_epsilon(0.01) / good.one_minus_epsilon(0.01) - 1) > module.ERROR
