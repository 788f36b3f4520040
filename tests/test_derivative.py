"""d eps/d v*: the reference's slopes, the bound behind them, and the exported functions."""

import math
from fractions import Fraction

import numpy as np
import pytest
from flint import arb, arb_series
from mpmath import mp, mpf

from tests import compiled
from viscopade import certificate, double, exact, exports, minimax, proofs, reference
from viscopade.balls import working
from viscopade.certificate import Rational, RationalDerivative
from viscopade.double import CENTRES, HALF_WIDTHS
from viscopade.kernels.binary import DOUBLE, FLOAT

DEGREES = [(1, 4, "5"), (3, 7, "5"), (2, 5, "1.3")]


def logarithms(v_star: mpf) -> tuple[mpf, mpf]:
    found = exact.collision(v_star, 40).decimals()
    return mp.log(mpf(found["epsilon"])), mp.log(mpf(found["one_minus_epsilon"]))


@pytest.mark.parametrize("v_star", ["1e-4", "0.1", "0.5", "0.8", "1", "1.7", "4", "30", "1e4"])
def test_second_derivatives_are_within_the_bound(v_star):
    with mp.workdps(40):
        step = mpf("1e-8")
        low, middle, high = (logarithms(mpf(v_star) * mp.exp(i * step)) for i in (-1, 0, 1))
        seconds = [abs(a - 2 * b + c) / step**2 for a, b, c in zip(low, middle, high, strict=True)]
    assert all(second < reference.CURVATURE for second in seconds)
    assert max(seconds) > 1e-12


@pytest.mark.parametrize("panel", [0, 3, 20, 33, 34, 50, 90, 150, 216])
def test_slopes_of_the_reference(panel):
    v_star = float(CENTRES[panel] + 0.7 * HALF_WIDTHS[panel])
    with working(128, 4):
        slope = certificate._slope_ratio(panel, arb_series([arb(v_star), arb(1)])).coeffs()[0]
        true = double.epsilon(v_star) * double.slope(v_star) / v_star**2
        error = certificate._slope_error(panel)
    assert abs(float(slope) / true - 1) < 1e-11
    assert 1e-8 < error < 4e-8


def true_derivative(v_star: np.ndarray) -> np.ndarray:
    return double.epsilon(v_star) * double.slope(v_star) / v_star


@pytest.mark.parametrize(("m", "n", "end"), DEGREES)
def test_the_derivative_of_a_quotient(m, n, end):
    kernel = minimax.machine(minimax.fit(m, n, end))
    formula = RationalDerivative.of(Rational(*kernel.exact))
    with working(128, 8):
        for v_star in (0.01, 0.6, float(end)):
            direct = Rational(*kernel.exact).epsilon(arb_series([arb(v_star), arb(1)])).coeffs()[1]
            ratio = formula.slope_ratio(arb_series([arb(v_star), arb(1)])).coeffs()[0]
            assert abs(ratio * arb(v_star) / direct - 1) < 1e-25


def test_a_quotient_with_a_slope_at_0_is_refused():
    with pytest.raises(ValueError, match="must vanish like"):
        RationalDerivative.of(Rational((Fraction(1), Fraction(1)), (Fraction(1), Fraction(2))))


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    requests = [exports.Request(minimax=((m, n),), v_star_max=end) for m, n, end in DEGREES]
    return compiled.build(tmp_path_factory.mktemp("derivative"), [request.render("c") for request in requests])


@pytest.mark.parametrize(("m", "n", "end"), DEGREES)
@pytest.mark.parametrize("form", [DOUBLE, FLOAT], ids=["double", "float"])
def test_exported_functions_keep_to_the_bound(m, n, end, form, library):
    kernel = proofs.of_minimax(m, n, end)
    proof = kernel.variant(form).derivative
    function = library[f"epsilon_derivative_{kernel.name}{form.suffix}"]
    v_star = np.unique(np.concatenate([np.geomspace(1e-9, float(end), 3000), np.linspace(1e-3, float(end), 3000)]))
    v_star = v_star.astype(np.float32 if form == FLOAT else np.float64).astype(float)
    v_star = v_star[v_star <= float(end)]
    errors = np.abs(np.array([function(v) for v in v_star]) / true_derivative(v_star) - 1)
    bound = float(proof.certificate.bound) + float(proof.rounding)
    assert errors.max() <= bound + 1e-11  # double.slope has 12 digits
    assert errors.max() >= 0.97 * float(proof.certificate.bound)


@pytest.mark.parametrize("form", [DOUBLE, FLOAT], ids=["double", "float"])
def test_special_values(form, library):
    name = f"epsilon_derivative_{proofs.of_minimax(1, 4, '5').name}{form.suffix}"
    assert library[name](0.0) == 0.0
    assert library[name](math.inf) == 0.0
    assert math.isnan(library[name](-1.0))
    assert math.isnan(library[name](math.nan))
    assert abs(library[name](1e30)) < 1e-100 or form == FLOAT
