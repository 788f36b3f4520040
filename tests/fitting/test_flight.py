"""Free flight against an integration of Newton's equation in time."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from viscopade.fitting.flight import Flight

IN_AIR = Flight.of_sphere(0.02, 84.0, air_density=1.2)  # a table tennis ball


def flown(flight, launch):
    """Return duration, height and speed at the end of a flight, integrated."""

    def rates(_, state):
        _, w = state
        drag = 0 if flight.terminal_speed == math.inf else flight.gravity * w * abs(w) / flight.terminal_speed**2
        return w, -flight.gravity - drag

    def down(_, state):
        return state[0] if state[1] < 0 else 1.0

    def top(_, state):
        return state[1]

    down.terminal = True
    run = solve_ivp(rates, (0, 100), (0.0, launch), events=(down, top), rtol=1e-11, atol=1e-13, method="DOP853")
    return run.t_events[0][0], run.y_events[1][0][0], -run.y_events[0][0][1]


@pytest.mark.parametrize("flight", [Flight(), Flight(1.62), IN_AIR])
@pytest.mark.parametrize("launch", [0.1, 1.0, 6.0])
def test_formulas_are_what_an_integration_gives(flight, launch):
    duration, height, impact = flown(flight, launch)
    assert flight.duration(np.array([launch]))[0] == pytest.approx(duration, rel=1e-8)
    assert flight.launch(np.array([duration]))[0] == pytest.approx(launch, rel=1e-8)
    assert flight.launch_to(np.array([height]))[0] == pytest.approx(launch, rel=1e-8)
    assert flight.impact(np.array([launch]))[0] == pytest.approx(impact, rel=1e-8)


@pytest.mark.parametrize("flight", [Flight(), IN_AIR])
def test_slopes_are_derivatives(flight):
    x, h = np.array([0.3, 1.0, 4.0]), 1e-6
    for function, slope in (
        (flight.impact, flight.impact_slope(x)),
        (flight.launch_to, flight.launch_to_slope(x)),
        (flight.launch, flight.launch_slope(flight.launch(x))),
    ):
        assert (function(x + h) - function(x - h)) / (2 * h) == pytest.approx(slope, rel=1e-6)


def test_terminal_speed_balances_drag_and_weight():
    radius, density, air = 0.02, 84.0, 1.2
    weight = (density - air) * 4 / 3 * math.pi * radius**3 * 9.80665
    drag = 0.5 * air * 0.47 * math.pi * radius**2 * IN_AIR.terminal_speed**2
    # The body's own inertia: gravity is that of the buoyant body.
    assert drag == pytest.approx(weight, rel=1e-12)
    assert Flight.of_sphere(0.02, 84.0, air_density=0).terminal_speed == math.inf


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"air_density": 90}, "expected less than the sphere's density"),
        ({"air_density": -1}, "air_density is -1"),
        ({"air_density": 1.2, "drag_coefficient": math.nan}, "drag_coefficient is nan"),
        ({"air_density": 1.2, "gravity": 0}, "gravity is 0"),
    ],
)
def test_what_is_no_flight_is_refused(values, text):
    with pytest.raises(ValueError, match=text):
        Flight.of_sphere(0.02, 84.0, **values)


def test_a_flight_that_no_body_has_starts_at_a_finite_speed():
    """Milliseconds read as seconds: sinh and squares of the speed would overflow, and warn."""
    launch = IN_AIR.launch(np.array([1.0, 350.0, 1e4]))
    assert IN_AIR.duration(launch)[0] == pytest.approx(1.0, rel=1e-12)
    # g t/v_t = arctan s + arsinh s = 300, for a large s
    assert launch[1] == launch[2] == pytest.approx(IN_AIR.terminal_speed * math.exp(300 - math.pi / 2) / 2, rel=1e-9)
