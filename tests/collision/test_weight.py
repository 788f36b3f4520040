"""Weight: the slope of a small loss by quadrature, falls against tables, and the sentences."""

import numpy as np
import pytest
from mpmath import mp, mpf

from viscopade.collision import exact
from viscopade.collision.spheres import Pair, Sphere
from viscopade.collision.weight import EARTH, FallingContact, calibrated, falling, loss_slope
from viscopade.theory.law import ENDS, law_of

RUBBER = {"young_modulus": 1e7, "poisson_ratio": 0.3, "dissipative_constant": 0}
BALL = Pair(Sphere(radius=0.01, density=2500, **RUBBER), Sphere.wall(**RUBBER))


def of(name, epsilon, end="force", duration=None, k_over_m=None, speed=1.0, carried=0.0):
    """Return the contact with an eps without weight, of a duration or a stiffness."""
    law = law_of(name, end)
    found = exact.invert(str(epsilon), law=law, digits=15).floats()
    time = duration / found["tau_c"] if duration else law.time_scale(speed, k=k_over_m, mass=1.0)
    return FallingContact(law, found["v_star"] ** law.d, time, speed, EARTH, carried)


def loss(law, load):
    """Return lambda(G) of derivation 16, by quadrature."""
    a, b = mpf(law.elastic.numerator) / law.elastic.denominator, mpf(law.damping.numerator) / law.damping.denominator

    def radicand(x):
        return 1 + 2 * load * x - 2 * x ** (a + 1) / (a + 1)

    end = mp.findroot(radicand, (mpf("0.5"), mpf(4)), solver="anderson")
    return 2 * mp.quad(
        lambda s: (end * mp.sin(s) ** 2) ** b * mp.sqrt(abs(radicand(end * mp.sin(s) ** 2))) * end * mp.sin(2 * s),
        [0, mp.pi / 2],
    )


@pytest.mark.parametrize(
    ("name", "known"), [("viscoelastic", 0.539), ("linear", 0.405), ("tsuji", None), ("hunt-crossley:1", None)]
)
def test_the_slope_of_a_small_loss(name, known):
    law, h = law_of(name), mpf("1e-5")
    slope = (loss(law, h) - loss(law, -h)) / (2 * h) / loss(law, 0) / law.contact_time
    assert loss_slope(law) == pytest.approx(float(slope), rel=1e-8)
    assert known is None or round(loss_slope(law), 3) == known


@pytest.mark.parametrize("end", ENDS)
def test_the_slope_is_that_of_collisions(end):
    body = of("viscoelastic", 0.99, end, duration=1e-4)
    (heavy,) = body.epsilon([1.0])
    assert (1 - heavy) / 0.01 == pytest.approx(1 + loss_slope(body.law) * body.share(1.0), rel=1e-5)


def test_mujoco_carries_a_part_of_the_weight():
    """Measured in MuJoCo 4.0.0: a contact of 31 ms and of 5 ms, made for 0.5."""
    assert of("linear", 0.5, duration=0.031, carried=0.9).epsilon([1, 0.3, 0.1]) == pytest.approx(
        [0.4482, 0.4078, 0.3399], abs=4e-4
    )
    assert of("linear", 0.5, duration=0.005, carried=0.9).epsilon([1, 0.3, 0.1]) == pytest.approx(
        [0.4905, 0.4699, 0.4273], abs=4e-4
    )


@pytest.mark.parametrize(("k", "fast", "slow"), [(5e4, 0.4644, 0), (5e5, 0.4892, 0.292), (5e6, 0.4966, 0.449)])
def test_a_body_that_is_dropped(k, fast, slow):
    body = of("linear", 0.5, "return", k_over_m=k / 10.9, speed=2.8)
    assert body.epsilon([2.8, 0.2]) == pytest.approx([fast, slow], abs=5e-4)
    assert (body.sticking_speed > 0.2) == (slow == 0)


@pytest.mark.parametrize("end", ENDS)
@pytest.mark.parametrize("name", ["linear", "viscoelastic", "tsuji", "hunt-crossley", "3/2,0"])
def test_the_sticking_speed(name, end):
    body = of(name, 0.6, end, duration=0.01)
    stays = body.sticking_speed
    below, above, far = body.epsilon([0.999 * stays, 1.001 * stays, 10 * stays])
    assert below == 0 < above < 0.2 < far


def test_bodies_without_damping_or_gravity_never_stay_down():
    body = of("linear", 0.5, duration=0.01)
    for changes in ({"kappa": 0.0}, {"gravity": 0.0}):
        assert FallingContact(**{**vars(body), **changes}).sticking_speed is None
    assert FallingContact(law_of("linear", "return"), 2.5, 0.01, 1.0, EARTH).sticking_speed is None  # it always does


def test_a_pair_that_falls():
    pair = calibrated(BALL, 0.5, 0.7, EARTH)
    body = falling(pair, 2.0, EARTH)
    assert body.epsilon([0.5]) == pytest.approx([0.7], rel=1e-9)
    assert pair.epsilon(0.5) > 0.708
    assert body.share(0.5) == pytest.approx(EARTH * BALL.contact_time(0.5) / 0.5)
    free = FallingContact(**{**vars(body), "gravity": 0.0}).epsilon([0.5, 2.0])
    assert free == pytest.approx(pair.epsilon(np.array([0.5, 2.0])), rel=1e-9)
    assert calibrated(BALL, 0.5, 1.0, EARTH).A == 0


def test_sentences():
    note, fall = of("linear", 0.5, duration=0.031).sentences(0.1, 1.0)
    assert note == (
        "weight: g t_c/v = 0.35 and 3.5 at 1 and 0.1 m/s with g = 9.81 m/s^2; the loss 1 - eps of a body that falls on "
        "a plane grows by about the factor 1 + 0.405 g t_c/v"
    )
    assert fall == (
        "a body that falls on a plane at 1 and 0.1 m/s rebounds with eps = 0.3987 and 0 (sampled), without weight "
        "0.5000 and 0.5000; below 0.391 m/s it stays down, eps = 0"
    )
    stiff = of("linear", 0.5, duration=1e-5)
    assert stiff.sentences(0.1, 1.0).fall is None
    assert "below 0.000126 m/s it stays down" in stiff.sentences(0.1, 1.0, user_set_gravity=True).fall
    assert "g t_c/v = 0.00011 at 1 m/s" in stiff.sentences(1.0, 1.0).note
