"""d eps/d v*: the reference's slopes, the bound behind them, and the exported functions."""

from fractions import Fraction

import numpy as np
import pytest
from flint import arb, arb_series
from mpmath import mp, mpf

from tests import compiled
from viscopade.approximation import machine_coefficients, minimax
from viscopade.arithmetic.balls import working
from viscopade.arithmetic.formats import DOUBLE, FLOAT
from viscopade.arrays import double
from viscopade.arrays.panels import CENTRES, HALF_WIDTHS
from viscopade.collision import exact, panel_proof
from viscopade.kernels import prove_rational, reference, requests
from viscopade.kernels.forms import exact_formulas

DEGREES = [(1, 4, "5"), (3, 7, "5"), (2, 5, "1.3")]
GROWING = [(3, 2, "0.5"), (4, 2, "0.5"), (4, 1, "0.5")]
"""The derivatives of these go like v*^0, v*^1 and v*^2 far beyond the interval; those of the others fall."""


def logarithms(v_star: mpf) -> tuple[mpf, mpf]:
    found = exact.collision(v_star, 40).decimals()
    return mp.log(mpf(found["epsilon"])), mp.log(mpf(found["one_minus_epsilon"]))


@pytest.mark.parametrize("v_star", ["1e-4", "0.1", "0.5", "0.8", "1", "1.7", "4", "30", "1e4"])
def test_second_derivatives_are_within_the_bound(v_star):
    with mp.workdps(40):
        step = mpf("1e-8")
        low, middle, high = (logarithms(mpf(v_star) * mp.exp(i * step)) for i in (-1, 0, 1))
        seconds = [abs(a - 2 * b + c) / step**2 for a, b, c in zip(low, middle, high, strict=True)]
    assert all(second < panel_proof.CURVATURE for second in seconds)
    assert max(seconds) > 1e-12


@pytest.mark.parametrize("panel", [0, 3, 20, 33, 34, 50, 90, 150, 216])
def test_slopes_of_the_reference(panel):
    v_star = float(CENTRES[panel] + 0.7 * HALF_WIDTHS[panel])
    with working(128, 4):
        slope = reference.Rows(panel, arb_series([arb(v_star), arb(1)]), 1).slope_ratio.coeffs()[0]
        true = double.epsilon(v_star) * double.slope(v_star) / v_star**2
        error = reference.slope_error(panel)
    assert abs(float(slope) / true - 1) < 1e-11
    assert 1e-8 < error < 4e-8


def true_derivative(v_star: np.ndarray) -> np.ndarray:
    return double.epsilon(v_star) * double.slope(v_star) / v_star


@pytest.mark.parametrize(("m", "n", "end"), DEGREES)
def test_the_derivative_of_a_quotient(m, n, end):
    kernel = machine_coefficients.machine(minimax.fit(m, n, end))
    formula = exact_formulas.derivative_formula(exact_formulas.slope_numerator(*kernel.exact), kernel.exact[1])
    whole = exact_formulas.quotient_formula(*kernel.exact)
    with working(128, 8):
        for v_star in (0.01, 0.6, float(end)):
            series = arb_series([arb(v_star), arb(1)])
            direct = whole.at("epsilon", v_star=series).coeffs()[1]
            ratio = formula.at("slope_ratio", v_star=series).coeffs()[0]
            assert abs(ratio * arb(v_star) / direct - 1) < 1e-25


def test_a_quotient_with_a_slope_at_0_is_refused():
    with pytest.raises(ValueError, match="must vanish like"):
        exact_formulas.slope_numerator((Fraction(1), Fraction(1)), (Fraction(1), Fraction(2)))


@pytest.fixture(scope="module")
def headers():
    wanted = [requests.Request(minimax=((m, n),), v_star_max=end) for m, n, end in DEGREES + GROWING]
    return [request.render("c") for request in wanted]


@pytest.fixture(scope="module")
def library(headers, tmp_path_factory):
    return compiled.build(tmp_path_factory.mktemp("derivative"), headers)


@pytest.mark.parametrize(("m", "n", "end"), DEGREES)
@pytest.mark.parametrize("form", [DOUBLE, FLOAT], ids=["double", "float"])
def test_exported_functions_keep_to_the_bound(m, n, end, form, library):
    kernel = prove_rational.of_minimax(m, n, end)
    proof = kernel.variant(form).derivative
    function = library[f"epsilon_derivative_{kernel.name}{form.suffix}"]
    v_star = np.unique(np.concatenate([np.geomspace(1e-9, float(end), 3000), np.linspace(1e-3, float(end), 3000)]))
    v_star = v_star.astype(np.float32 if form == FLOAT else np.float64).astype(float)
    v_star = v_star[v_star <= float(end)]
    errors = np.abs(np.array([function(v) for v in v_star]) / true_derivative(v_star) - 1)
    bound = float(proof.certificate.bound) + float(proof.rounding)
    assert errors.max() <= bound + 1e-11  # double.slope has 12 digits
    assert errors.max() >= 0.97 * float(proof.certificate.bound)


@pytest.mark.parametrize(("m", "n", "end"), DEGREES + GROWING)
@pytest.mark.parametrize("form", [DOUBLE, FLOAT], ids=["double", "float"])
def test_the_far_branch_is_the_same_quotient(m, n, end, form, headers, library):
    """Beyond 2^t code goes over to powers of 1/v*: against v* T/D^2 in exact numbers, as long as that is normal."""
    kernel = prove_rational.of_minimax(m, n, end)
    (t, b), exponent = kernel.derivative(form)
    name = f"epsilon_derivative_{kernel.name}{form.suffix}"
    start, compared = Fraction(2) ** exponent, 0
    for v_star in (start * (1 + Fraction(k, 4)) * 2**i for i in range(60) for k in range(4)):
        top, bottom = (sum(Fraction(c) * v_star**i for i, c in enumerate(values)) for values in (t, b))
        true = v_star * top / bottom**2
        if not Fraction(2) ** (1 - form.largest) <= abs(true) < Fraction(2) ** form.largest:
            break
        found = Fraction(library[name](float(v_star)))
        assert abs(found / true - 1) < Fraction(32, 2**form.precision)
        compared += 1
    assert compared > 40
    function = next(text.split(f"viscopade_{name}(")[1].split("\n}\n")[0] for text in headers if f"_{name}(" in text)
    assert f"if (v_star > VISCOPADE_CONSTANT({form.hexadecimal(float(start))}," in function
