"""The slope of eps over the time step, the largest step for an error, and damping that makes up for a step."""

import math

import pytest
from mpmath import mp

from tests.closed_forms import nu_2
from viscopade.collision import exact
from viscopade.collision.schemes import IMPLICIT, RUNGE_KUTTA, SEMI_IMPLICIT
from viscopade.simulators.audit import largest_step, step_slope
from viscopade.simulators.formula import kappa_in_steps, stepped_collision
from viscopade.theory.law import law_of

LAWS = [
    law_of(name, end) for name in ("viscoelastic", "linear", "tsuji", "hunt-crossley:1") for end in ("force", "return")
]
KAPPA = 0.4


def proven(law, kappa=KAPPA):
    return exact.collision(kappa=kappa, law=law, digits=12).floats()


def error_of(found, epsilon):
    return max(abs(found.least / epsilon - 1), abs(found.largest / epsilon - 1))


@pytest.mark.parametrize("law", LAWS, ids=lambda law: f"{law}-{law.end}")
def test_contact_time_is_the_undamped_one(law):
    assert law.contact_time == pytest.approx(exact.collision(kappa=0, law=law, digits=15).floats()["tau_c"])


@pytest.mark.parametrize("law", LAWS, ids=lambda law: f"{law}-{law.end}")
def test_short_steps_deliver_the_proven_eps_and_the_slope_the_first_order(law):
    epsilon = proven(law)["epsilon"]
    slope = step_slope(law, KAPPA, epsilon, SEMI_IMPLICIT)
    for step, tolerance in ((1e-2, 1e-3), (1e-3, 2e-5)):
        found = stepped_collision(law, KAPPA, step, SEMI_IMPLICIT)
        assert found.least <= found.epsilon <= found.largest
        assert found.epsilon == pytest.approx(epsilon + slope * step, abs=tolerance)


@pytest.mark.parametrize("end", ["force", "return"])
def test_first_order_error_of_the_linear_contact(end):
    """The lag multiplies both forces by 1 + kappa h/2, so the damping ratio kappa/2 by the root of that."""
    for kappa in (0.4, 0.430907523932494):  # the latter for eps = 0.5 at x = 0
        with mp.workdps(30):
            zeta, h = mp.mpf(kappa) / 2, mp.mpf("1e-9")
            epsilon = nu_2(zeta, end)
            expected = float((nu_2(zeta * (1 + zeta * h / 2), end) - epsilon) / h * mp.pi)
        found = step_slope(law_of("linear", end), kappa, float(epsilon), SEMI_IMPLICIT)
        assert found == pytest.approx(expected, abs=6e-4)


def test_first_order_error_of_tsuji_s_contact():
    """An independent fit over many steps has -0.0989 for eps = 0.5 at x = 0."""
    law = law_of("tsuji", "return")
    kappa = exact.invert("0.5", 15, law=law).floats()["kappa"]
    assert step_slope(law, kappa, 0.5, SEMI_IMPLICIT) == -0.099


@pytest.mark.parametrize("end", ["force", "return"])
def test_first_order_error_of_hunt_crossley_vanishes(end):
    """The lag multiplies both forces by one function of x, and eps does not depend on the shape of the spring."""
    law = law_of("hunt-crossley:1", end)
    epsilon = proven(law, 1.4)["epsilon"]
    assert step_slope(law, 1.4, epsilon, SEMI_IMPLICIT) == 0.0
    assert error_of(stepped_collision(law, 1.4, 0.01, SEMI_IMPLICIT), epsilon) < 1e-4


def test_the_largest_step_for_an_error_has_that_error():
    law = law_of("tsuji")
    epsilon = proven(law)["epsilon"]
    for error in (0.02, 1e-5):
        step = largest_step(law, KAPPA, error, epsilon, SEMI_IMPLICIT)
        assert error / 2 < error_of(stepped_collision(law, KAPPA, step, SEMI_IMPLICIT), epsilon) <= 1.1 * error


@pytest.mark.parametrize("law", LAWS, ids=lambda law: f"{law}-{law.end}")
def test_damping_compensates_for_the_step(law):
    for step in (0.02, 0.1):
        kappa = kappa_in_steps(law, 0.6, step, SEMI_IMPLICIT)
        assert stepped_collision(law, kappa, step, SEMI_IMPLICIT).epsilon == pytest.approx(0.6, abs=1e-9)


def test_bodies_that_creep_do_not_part():
    found = stepped_collision(law_of("linear", "return"), 2.5, 0.01, SEMI_IMPLICIT)
    assert (found.parts, found.epsilon, found.duration) == (False, 0, math.inf)


@pytest.mark.parametrize(
    ("scheme", "name"),
    [(IMPLICIT, "linear"), (IMPLICIT, "hunt-crossley:1"), (RUNGE_KUTTA, "linear")],
    ids=lambda part: getattr(part, "name", part),
)
def test_other_schemes_deliver_the_proven_eps_in_the_limit(scheme, name):
    law = law_of(name)
    coarse, fine = (stepped_collision(law, KAPPA, step, scheme).epsilon for step in (0.002, 0.001))
    assert 2 * fine - coarse == pytest.approx(proven(law)["epsilon"], abs=5e-5)


def test_a_number_far_from_that_of_fine_steps_is_found_or_refused():
    law = law_of("hunt-crossley:1")
    kappa = kappa_in_steps(law, 0.9, 0.02, IMPLICIT)
    assert kappa < 0.0166
    assert stepped_collision(law, kappa, 0.02, IMPLICIT).epsilon == pytest.approx(0.9, abs=1e-9)
    with pytest.raises(ValueError, match=r"0\.1 of the contact time: no damping gives eps = 0\.9"):
        kappa_in_steps(law, 0.9, 0.1, IMPLICIT)
