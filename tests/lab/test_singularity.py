"""The singularity that ends the convergence: two routes of ours, SciPy's, and the coefficients themselves."""

from functools import cache

import pytest
from mpmath import mp
from scipy.integrate import solve_ivp

from viscopade_lab import singularity


@cache
def from_flow():
    return singularity.from_flow()


def test_more_coefficients_come_closer_to_what_the_flow_gives():
    """Orders 60, 90 and 120 share nothing with the flow; the uncertainty covers the error each time."""
    found = [singularity.from_coefficients(order) for order in (60, 90, 120)]
    errors = [abs(complex(s.v_star) / complex(from_flow().v_star) - 1) for s in found]
    assert errors[0] > 3 * errors[1] > 9 * errors[2] > 0
    assert all(error < s.uncertainty for error, s in zip(errors, found, strict=True))
    assert errors[2] < 2e-5
    assert found[2].uncertainty < 1e-4


def test_more_digits_agree():
    more = singularity.from_flow(38)
    assert abs(more.v_star - from_flow().v_star) < mp.mpf(10) ** -29


def test_scipy_integration_of_the_creeping_orbit():
    """dg/dz = z^2 - z^4/g down to z = 0, then z' = g, g' = z^2 (g - z^2) in complex time."""
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
