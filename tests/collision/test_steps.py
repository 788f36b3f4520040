"""Collisions in time steps: against the proven eps, a linear recurrence, and the scheme that `lammps` has."""

import math

import numpy as np
import pytest
from mpmath import mp

from tests.closed_forms import nu_2
from viscopade import Pair, Sphere
from viscopade.collision import exact, steps
from viscopade.simulators import lammps
from viscopade.theory.law import Law, law_of

LAWS = [
    law_of(name, end) for name in ("viscoelastic", "linear", "tsuji", "hunt-crossley:1") for end in ("force", "return")
]
KAPPA = 0.4


def proven(law, kappa=KAPPA):
    return exact.collision(kappa=kappa, law=law, digits=12).floats()


@pytest.mark.parametrize("law", LAWS, ids=lambda law: f"{law}-{law.end}")
def test_contact_time_is_the_undamped_one(law):
    assert steps.contact_time(law) == pytest.approx(exact.collision(kappa=0, law=law, digits=15).floats()["tau_c"])


@pytest.mark.parametrize("law", LAWS, ids=lambda law: f"{law}-{law.end}")
def test_short_steps_deliver_the_proven_eps_and_the_slope_the_first_order(law):
    epsilon, slope = proven(law)["epsilon"], steps.step_slope(law, KAPPA)
    for step, tolerance in ((1e-2, 1e-3), (1e-3, 2e-5)):
        found = steps.stepped(law, KAPPA, step)
        assert found.least <= found.mean <= found.largest
        assert found.mean == pytest.approx(epsilon + slope * step, abs=tolerance)


def test_a_lagged_linear_dashpot_is_a_recurrence_with_two_roots():
    """The map of a linear contact that never ends has the trace 2 - h (h + kappa) and the determinant 1 - kappa h."""
    h, kappa = 0.01, 0.3
    law = law_of("linear", "return")
    matrix = np.array([[1, h], [-h, 1 - h * (h + kappa)]])
    x, u = h / 2, 1 - h * (h / 2 + kappa)
    while x > 0:
        x, u = matrix @ (x, u)
    u += h * min(x, 0) + h * kappa * (u + h * min(x, 0)) / (1 - h * kappa)  # the last kick is none
    assert np.linalg.det(matrix) == pytest.approx(1 - kappa * h)
    force = steps.force_of(law, kappa)
    assert float(steps.rebound(force, h, 0.5, longest=10)) == pytest.approx(-u, rel=1e-3)


@pytest.mark.parametrize("end", ["force", "return"])
def test_first_order_error_of_the_linear_contact(end):
    """The lag multiplies both forces by 1 + kappa h/2, so the damping ratio kappa/2 by the root of that."""
    with mp.workdps(30):
        zeta, h = mp.mpf("0.2"), mp.mpf("1e-9")
        expected = float((nu_2(zeta * (1 + zeta * h / 2), end) - nu_2(zeta, end)) / h * mp.pi)
    assert steps.step_slope(law_of("linear", end), 0.4) == pytest.approx(expected, rel=0.03)


@pytest.mark.parametrize("end", ["force", "return"])
def test_first_order_error_of_hunt_crossley_vanishes(end):
    """The lag multiplies both forces by one function of x, and eps does not depend on the shape of the spring."""
    law = law_of("hunt-crossley:1", end)
    assert abs(steps.step_slope(law, 1.4)) < 1e-5
    assert steps.stepped(law, 1.4, 0.01).error(proven(law, 1.4)["epsilon"]) < 1e-4


def test_the_scheme_is_that_of_lammps():
    ball = Sphere(radius=1e-3, density=2500, young_modulus=1e7, poisson_ratio=0.25, dissipative_constant=1e-5)
    pair = Pair(ball, ball)
    law, speed = Law("3/2", "1/2"), 1.0
    duration = pair.time_scale(speed) * steps.contact_time(law)
    for phase in lammps.PHASES:
        theirs = lammps.stepped_epsilon(pair, speed, duration / 50, phase)
        force = steps.force_of(law, pair.v_star(speed) ** 2)
        ours = steps.rebound(force, steps.contact_time(law) / 50, phase, longest=20)
        assert float(ours) == pytest.approx(theirs, rel=1e-12)


def test_the_largest_step_for_an_error_has_that_error():
    law = law_of("tsuji")
    epsilon = proven(law)["epsilon"]
    for error in (0.02, 1e-5):
        step = steps.largest_step(law, KAPPA, error, epsilon)
        assert error / 2 < steps.stepped(law, KAPPA, step).error(epsilon) <= 1.1 * error


@pytest.mark.parametrize("law", LAWS, ids=lambda law: f"{law}-{law.end}")
def test_damping_compensates_for_the_step(law):
    for step in (0.02, 0.1):
        near = exact.invert("0.6", law=law, digits=12).floats()["v_star"] ** law.d
        kappa = steps.compensated(law, 0.6, step, near)
        assert steps.stepped(law, kappa, step).mean == pytest.approx(0.6, abs=3e-4)


def test_what_no_damping_delivers_at_a_step_is_refused_with_the_range():
    with pytest.raises(ValueError, match=r"with a time step of 0.5 contact times accepted is 0\.\d+ to"):
        steps.compensated(law_of("linear", "return"), 0.001, 0.5, 1.8)


def test_bodies_that_creep_do_not_part():
    found = steps.stepped(law_of("linear", "return"), 2.5, 0.01)
    assert math.isnan(found.mean)
    assert found.error(0.5) == math.inf


@pytest.mark.parametrize(
    ("scheme", "name"),
    [(steps.IMPLICIT, "linear"), (steps.IMPLICIT, "hunt-crossley:1"), (steps.RUNGE_KUTTA, "linear")],
    ids=lambda part: getattr(part, "name", part),
)
def test_other_schemes_deliver_the_proven_eps_in_the_limit(scheme, name):
    law = law_of(name)
    coarse, fine = (steps.stepped(law, KAPPA, step, scheme).mean for step in (0.002, 0.001))
    assert 2 * fine - coarse == pytest.approx(proven(law)["epsilon"], abs=5e-5)


def test_implicit_steps_are_solved():
    """A step of a Hunt-Crossley contact is a quadratic equation for the velocity after it."""
    x, u, h, kappa = np.array([0.4]), np.array([0.7]), np.array([0.5]), 1.4
    after_x, w = steps.IMPLICIT.step(x, u, h, steps.force_of(law_of("hunt-crossley:1"), kappa))
    assert after_x == pytest.approx(x + h * w)
    roots = np.roots([h[0] ** 2 * kappa, 1 + h[0] * (h[0] + kappa * x[0]), h[0] * x[0] - u[0]])
    assert w[0] == pytest.approx(max(roots), abs=1e-14)


def test_implicit_steps_damp_by_themselves():
    """Each turns (x, u) by atan h and shortens it by sqrt(1 + h^2), if there is no dashpot."""
    step = 0.01
    h = step * math.pi
    expected = (1 + h * h) ** (-math.pi / math.atan(h) / 2)
    assert steps.stepped(law_of("linear"), 0.0, step, steps.IMPLICIT).mean == pytest.approx(expected, rel=1e-3)


def test_a_number_far_from_that_of_fine_steps_is_found_or_refused():
    law, near = law_of("hunt-crossley:1"), 0.1664819507
    kappa = steps.compensated(law, 0.9, 0.02, near, steps.IMPLICIT)
    assert kappa < near / 10
    assert steps.stepped(law, kappa, 0.02, steps.IMPLICIT).mean == pytest.approx(0.9, abs=1e-5)
    with pytest.raises(ValueError, match=r"accepted is 0\.\d+ to 0\.64"):
        steps.compensated(law, 0.9, 0.1, near, steps.IMPLICIT)
