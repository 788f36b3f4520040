"""The singularity that ends the convergence: two routes of ours, SciPy's, and the coefficients themselves."""

from functools import cache

import numpy as np
import pytest
from mpmath import mp

from viscopade.theory import singularity
from viscopade.theory.law import law_of
from viscopade.theory.series import series


@cache
def from_flow():
    return singularity.from_flow()


@cache
def from_coefficients():
    return singularity.from_coefficients()


def test_the_two_routes_agree_to_five_digits():
    """They share nothing; the difference is within what the second one says of itself."""
    distance = abs(complex(from_coefficients().v_star) / complex(from_flow().v_star) - 1)
    assert 0 < distance < from_coefficients().uncertainty < 1e-4
    assert distance < 2e-5


def test_more_digits_agree():
    more = singularity.from_flow(38)
    assert abs(more.v_star - from_flow().v_star) < mp.mpf(10) ** -29


def test_more_coefficients_come_closer():
    """Orders 60, 90 and 120; the uncertainty covers the error each time."""
    found = [singularity.from_coefficients(order) for order in (60, 90)] + [from_coefficients()]
    errors = [abs(complex(s.v_star) / complex(from_flow().v_star) - 1) for s in found]
    assert errors[0] > 3 * errors[1] > 9 * errors[2]
    assert all(error < s.uncertainty for error, s in zip(errors, found, strict=True))


def test_radius_and_argument_are_those_of_v_star():
    v = complex(from_flow().v_star)
    assert float(from_flow().radius) == pytest.approx(abs(v), rel=1e-15, abs=0)
    assert float(from_flow().argument) == pytest.approx(np.angle(v) / np.pi, rel=1e-15, abs=0)


def test_scipy_integration_of_the_creeping_orbit():
    """dg/dz = z^2 - z^4/g down to z = 0, then z' = g, g' = z^2 (g - z^2) in complex time."""
    from scipy.integrate import solve_ivp

    tight = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-12}
    z = 40.0
    g = z**2 + 2 * z + 6 + 16 / z + 28 / z**2 - 152 / z**4
    g_0 = solve_ivp(lambda z, g: z**2 - z**4 / g, (z, 0), [g], **tight).y[0, -1]
    sigma = singularity.TIME_GUESS
    for _ in range(8):

        def rates(_, y, sigma=sigma):
            return sigma * y[1], sigma * y[0] ** 2 * (y[1] - y[0] ** 2)

        z_end, g_end = solve_ivp(rates, (0, 1), [0j, g_0 + 0j], **tight).y[:, -1]
        sigma -= z_end / g_end
    assert abs(z_end) < 1e-9
    assert complex(from_flow().v_star) ** 10 == pytest.approx(-g_end / 4, rel=1e-9)


def test_the_coefficients_fall_like_the_powers_of_the_radius():
    """|k h_k| R^k varies slowly, but for the sign's period: largest values in windows of three half periods."""
    k = np.arange(121)
    size = abs(k * series(120, 60).floats())
    early, late = (size[first : first + 8].max() for first in (56, 112))
    assert (early / late) ** (1 / 56) == pytest.approx(float(from_flow().radius), rel=0.01)


def test_the_signs_turn_with_the_argument():
    """Between k = 40 and 120 the phase of h_k advances by the argument times the number of steps."""
    h = series(120, 60).floats()[40:]
    changes = np.count_nonzero(np.diff(np.sign(h)))
    assert changes == pytest.approx(80 * float(from_flow().argument), abs=1)


@pytest.mark.parametrize(("function", "value"), [(singularity.from_flow, 41), (singularity.from_coefficients, 59)])
def test_what_is_out_of_range_is_refused(function, value):
    with pytest.raises(ValueError, match="accepted is an integer"):
        function(value)
    with pytest.raises(TypeError):
        function(float(value))


def test_flints_precision_and_mpmaths_are_left_alone():
    from flint import ctx

    before = ctx.prec, ctx.cap, mp.dps
    singularity.from_flow(20)
    assert (ctx.prec, ctx.cap, mp.dps) == before


@pytest.mark.parametrize(
    ("law", "radius"),
    [
        ("linear", 2),  # critical damping with the other sign
        (law_of("linear", "return"), 2),
        ("tsuji", 5**0.5),
        ("hunt-crossley", 1),  # the speed at which negative damping balances every force
        ("viscoelastic", None),
    ],
    ids=str,
)
def test_nearest_singularity_of_a_law(law, radius):
    found = singularity.nearest(law)
    wanted = singularity.from_flow(12).radius if radius is None else radius
    assert abs(found.radius / wanted - 1) < 0.01
    assert found.uncertainty < 0.02
    if radius is None:
        assert abs(found.argument - singularity.from_flow(12).argument) < 0.01
