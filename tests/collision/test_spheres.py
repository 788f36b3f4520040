"""Physical parameters: identities, limits, units, arrays, extreme values, refusals."""

import dataclasses
import math
import pickle
from decimal import Decimal
from fractions import Fraction

import mpmath
import numpy as np
import pytest
import sympy
from hypothesis import given
from hypothesis import strategies as st

from viscopade.collision import spheres
from viscopade.collision.spheres import Pair, Sphere
from viscopade.theory import equation

ICE_BETA = 1.307  # the paper's value, in (s/cm)^(1/5)

MATERIAL = {"young_modulus": 1e9, "poisson_ratio": 0.3, "dissipative_constant": 1e-5}
SPHERE = {"radius": 0.01, "density": 2500.0, **MATERIAL}
SOFT = Sphere(radius=0.02, density=1100, young_modulus=1e7, poisson_ratio=0.49, dissipative_constant=2e-4)
STIFF = Sphere(radius=0.03, mass=0.8, young_modulus=7e10, poisson_ratio=0.2, dissipative_constant=1e-6)
PAIR = Pair(SOFT, STIFF)

extreme = st.floats(1e-300, 1e300)


def magnitudes(low, high):
    """Floats whose order of magnitude is uniform."""
    return st.floats(low, high).map(lambda exponent: 10.0**exponent)


some_spheres = st.builds(
    Sphere,
    radius=magnitudes(-6, 1),
    density=magnitudes(1, 5),
    young_modulus=magnitudes(4, 12),
    poisson_ratio=st.floats(-0.99, 0.5),
    dissipative_constant=magnitudes(-9, -1),
)
speeds = magnitudes(-6, 3)


def close(expected, rel=1e-13):
    return pytest.approx(expected, rel=rel, abs=0)


# Sphere


def test_mass_and_density_give_each_other():
    by_density = Sphere(**SPHERE)
    assert by_density.mass == close(4 / 3 * math.pi * 0.01**3 * 2500)
    by_mass = Sphere(**MATERIAL, radius=0.01, mass=by_density.mass)
    assert by_mass.density == close(2500)


@given(some_spheres)
def test_equality_does_not_depend_on_the_rounding_of_the_density(sphere):
    by_mass = dataclasses.replace(sphere)
    assert by_mass.density == close(sphere.density)
    assert by_mass == sphere
    assert hash(by_mass) == hash(sphere)


@given(radius=magnitudes(-80, 80), density=magnitudes(-40, 40))
def test_mass_is_right_wherever_it_is_a_double(radius, density):
    with mpmath.workdps(30):
        mass = mpmath.pi * 4 / 3 * mpmath.mpf(radius) ** 3 * density
    assert Sphere(**MATERIAL, radius=radius, density=density).mass == close(float(mass))


def test_repr_and_replace_and_pickle():
    sphere = Sphere(**SPHERE)
    assert eval(repr(sphere)) == sphere
    assert pickle.loads(pickle.dumps(PAIR)) == PAIR
    larger = dataclasses.replace(sphere, radius=0.02)
    assert larger.mass == sphere.mass
    assert larger.density == close(2500 / 8)
    wall = Sphere.wall(**MATERIAL)
    assert dataclasses.replace(wall, young_modulus=1).is_wall


def test_wall():
    wall = Sphere.wall(**MATERIAL)
    assert wall.is_wall
    assert not SOFT.is_wall
    assert wall.radius == wall.mass == math.inf
    assert math.isnan(wall.density)
    assert wall == Sphere.wall(**MATERIAL) == Sphere(radius=math.inf, mass=math.inf, **MATERIAL)


@given(st.floats(-1, 0.5, exclude_min=True))
def test_nothing_cancels_in_the_plane_strain_modulus(nu):
    expected = Fraction(10**9) / (1 - Fraction(nu) ** 2)
    assert Sphere(**{**SPHERE, "poisson_ratio": nu}).plane_strain_modulus == close(float(expected), rel=1e-15)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *((name, value) for name in SPHERE for value in (math.nan, -1.0, math.inf)),
        *((name, 0.0) for name in ("radius", "density", "young_modulus")),
        ("poisson_ratio", 0.51),
        ("density", Decimal("NaN")),
        ("density", 10**400),
    ],
)
def test_sphere_refuses_what_no_material_has(name, value):
    with pytest.raises(ValueError, match=rf"^{name} is .*: expected") as refusal:
        Sphere(**{**SPHERE, name: value})
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("name", SPHERE)
@pytest.mark.parametrize(
    "value",
    [True, "0.3", 1j, np.ones(1), sympy.Symbol("a")],
)
def test_sphere_refuses_what_is_not_a_real_number(name, value):
    with pytest.raises(TypeError, match=rf"^{name} is .*: expected") as refusal:
        Sphere(**{**SPHERE, name: value})
    assert "\n" not in str(refusal.value)


def test_exactly_one_of_mass_and_density():
    with pytest.raises(ValueError, match=r"^mass and density: both given, expected exactly one of them$"):
        Sphere(**SPHERE, mass=1.0)
    with pytest.raises(ValueError, match=r"^mass and density: neither given, expected exactly one of them$"):
        Sphere(radius=1.0, **MATERIAL)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"radius": math.inf, "mass": 1.0}, "radius is inf: expected .* for a wall, mass = inf too"),
        ({"radius": 1.0, "mass": math.inf}, "mass is inf: expected .* for a wall, radius = inf too"),
        ({"radius": 1e-200, "density": 1.0}, "mass is 0.0 in these units: expected a finite number > 0"),
        ({"radius": 1e200, "density": 1.0}, "mass is inf in these units: expected a finite number > 0"),
        ({"radius": 1e-200, "mass": 1.0}, "density is inf in these units: expected a finite number > 0"),
    ],
)
def test_half_infinite_and_unrepresentable_spheres(arguments, message):
    with pytest.raises(ValueError, match="^" + message):
        Sphere(**arguments, **MATERIAL)


# Pair


@given(some_spheres, some_spheres)
def test_effective_values(one, other):
    pair = Pair(one, other)
    D1, D2 = ((1 - s.poisson_ratio**2) / s.young_modulus for s in (one, other))
    assert pair.m_eff == close(one.mass * other.mass / (one.mass + other.mass))
    assert pair.R_eff == close(1 / (1 / one.radius + 1 / other.radius))
    assert pair.E_eff == close(1 / (D1 + D2), rel=1e-12)
    assert pair.rho == close(4 / 3 * math.sqrt(pair.R_eff) / (D1 + D2), rel=1e-12)
    A = (D1 * one.dissipative_constant + D2 * other.dissipative_constant) / (D1 + D2)
    assert close(A, rel=1e-12) == pair.A


@given(some_spheres, some_spheres, speeds)
def test_exchanging_the_spheres_changes_nothing(one, other, speed):
    names = ("m_eff", "R_eff", "E_eff", "rho", "A", "beta")
    ab, ba = Pair(one, other), Pair(other, one)
    assert [getattr(ab, name) for name in names] == [getattr(ba, name) for name in names]
    assert ab.v_star(speed) == ba.v_star(speed)


def test_wall_is_the_limit_of_a_huge_heavy_sphere():
    wall = Pair(SOFT, Sphere.wall(**MATERIAL))
    assert (wall.m_eff, wall.R_eff) == (SOFT.mass, SOFT.radius)
    for factor, tolerance in ((1e4, 1e-3), (1e8, 1e-7), (1e16, 1e-15)):
        huge = Pair(SOFT, Sphere(radius=factor * SOFT.radius, mass=factor * SOFT.mass, **MATERIAL))
        assert huge.beta == close(wall.beta, rel=tolerance)
        assert huge.beta != wall.beta or factor == 1e16
        assert huge.rho == close(wall.rho, rel=tolerance)
    assert Pair(Sphere.wall(**MATERIAL), SOFT).beta == wall.beta


def test_pair_refuses():
    wall = Sphere.wall(**MATERIAL)
    with pytest.raises(ValueError, match=r"^first and second are walls: expected at most one wall$"):
        Pair(wall, wall)
    with pytest.raises(TypeError, match=r"^second is 1\.0: expected a Sphere$"):
        Pair(SOFT, 1.0)
    with pytest.raises(TypeError, match=r"^first is None: expected a Sphere$"):
        Pair(None, SOFT)


def test_numbers_that_have_lost_digits_are_refused():
    """A subnormal rho has fewer digits than beta, which follows from it and is no small number."""
    flat = Sphere(radius=5e-50, mass=6e-109, young_modulus=5e-290, poisson_ratio=0, dissipative_constant=2e108)
    with pytest.raises(
        ValueError, match=r"^rho is .*e-31\d in these units: expected at least 2\.23e-308, because smaller"
    ):
        Pair(flat, flat)
    with pytest.raises(ValueError, match=r"^mass is .*e-31\d in these units: expected at least 2\.23e-308"):
        Sphere(**{**SPHERE, "radius": 1e-105})


@given(radius=magnitudes(-60, 60), mass=magnitudes(-100, 100), Y=magnitudes(-120, 120), A=magnitudes(-100, 100))
def test_beta_against_many_digits(radius, mass, Y, A):
    wall = Sphere.wall(young_modulus=Y, poisson_ratio=0.5, dissipative_constant=A)
    pair = Pair(dataclasses.replace(wall, radius=radius, mass=mass), wall)
    with mpmath.workdps(40):
        rho = 2 * mpmath.mpf(Y) * mpmath.sqrt(radius) / (3 * (1 - mpmath.mpf(0.25)))
        beta = mpmath.mpf(3) / 2 * A * (rho / mass) ** (mpmath.mpf(2) / 5)
        assert pair.beta == close(float(beta), rel=1e-13)


def test_beta_where_rho_over_mass_is_no_double():
    heavy = Sphere(radius=1.0, mass=1e300, young_modulus=1e-300, poisson_ratio=0, dissipative_constant=1)
    light = Sphere(radius=1.0, mass=1e-300, young_modulus=1e300, poisson_ratio=0, dissipative_constant=1)
    ratio = (math.sqrt(0.5) * 4 / 3) ** 0.4  # the rest of rho/m_eff is a power of ten
    assert Pair(heavy, heavy).beta == close(1.5 * ratio * 1e-240)
    assert Pair(light, light).beta == close(1.5 * ratio * 1e240)


def test_elastic_pair():
    sphere = Sphere(**{**SPHERE, "dissipative_constant": 0})
    pair = Pair(sphere, sphere)
    assert pair.beta == pair.v_star(1.0) == 0
    with pytest.raises(ValueError, match=r"^beta is 0\.0: expected a finite number > 0$"):
        pair.speed(1.0)


# Units


def test_si_and_cgs_agree():
    si = Sphere(radius=0.025, density=917, young_modulus=9e9, poisson_ratio=0.31, dissipative_constant=1e-6)
    cgs = Sphere(radius=2.5, density=0.917, young_modulus=9e10, poisson_ratio=0.31, dissipative_constant=1e-6)
    pair_si, pair_cgs = Pair(si, si), Pair(cgs, cgs)
    assert pair_cgs.v_star(1.0) == close(pair_si.v_star(0.01))
    assert spheres.beta_cgs_from_si(pair_si.beta) == close(pair_cgs.beta)
    assert spheres.beta_si_from_cgs(pair_cgs.beta) == close(pair_si.beta)


def test_the_papers_ice():
    speed = spheres.speed_from_v_star(1.0, ICE_BETA)
    assert f"{speed:.3f}" == "0.262"  # cm/s
    in_si = spheres.speed_from_v_star(1.0, spheres.beta_si_from_cgs(ICE_BETA))
    assert in_si == close(speed / 100)
    assert spheres.speed_from_v_star(10**0.3, ICE_BETA) == close(speed * 1000, rel=1e-12)  # the paper's 2.6 m/s


# v*, speed and scales


@given(speed=extreme, beta=extreme)
def test_v_star_against_many_digits(speed, beta):
    with mpmath.workdps(30):
        expected = mpmath.sqrt(beta) * mpmath.mpf(speed) ** (mpmath.mpf(1) / 10)
    assert spheres.v_star(speed, beta) == close(float(expected), rel=1e-14)


@given(beta=extreme, speed=extreme)
def test_v_star_and_speed_are_inverse_over_the_whole_range(speed, beta):
    assert spheres.speed_from_v_star(spheres.v_star(speed, beta), beta) == close(speed)


def test_speed_beyond_double_precision():
    assert spheres.speed_from_v_star(1e300, 1e-300) == math.inf
    assert spheres.speed_from_v_star(1e-300, 1e300) == 0
    smallest = 2.0**-1074
    assert spheres.v_star(smallest, smallest) == close(2.0**-537 * 2**-107.4)


def test_rest():
    assert spheres.v_star(0, 1.0) == spheres.v_star(0.0, 0) == spheres.v_star(1.0, 0) == 0
    assert PAIR.v_star(0.0) == PAIR.length_scale(0.0) == 0
    assert PAIR.time_scale(0.0) == math.inf


@given(some_spheres, some_spheres, speeds)
def test_scales_solve_their_defining_equations(one, other, speed):
    """With X and T as units the elastic term and the initial velocity are 1, the viscous term is v*^2."""
    pair = Pair(one, other)
    X, T = pair.length_scale(speed), pair.time_scale(speed)
    assert speed * T / X == close(1)
    assert pair.rho * X**1.5 / (pair.m_eff * X / T**2) == close(1, rel=1e-12)
    assert 1.5 * pair.A * pair.rho * X**0.5 / (pair.m_eff / T) == close(pair.v_star(speed) ** 2, rel=1e-12)


@given(some_spheres, some_spheres, speeds, magnitudes(-9, 3))
def test_round_trips_of_a_pair(one, other, speed, beta):
    pair = Pair(one, other)
    assert pair.speed(pair.v_star(speed)) == close(speed, rel=1e-12)
    assert pair.dissipative_constant(pair.beta) == close(pair.A)
    A = pair.dissipative_constant(beta)
    one, other = (dataclasses.replace(sphere, dissipative_constant=A) for sphere in (one, other))
    assert Pair(one, other).beta == close(beta)


def test_numbers_that_no_double_can_be_are_refused():
    """Other bad numbers: tests/test_arguments.py."""
    with pytest.raises(ValueError, match=r"^speed is .*: expected a finite number"):
        PAIR.v_star(np.array([np.longdouble("1e4000")]))
    with pytest.raises(ValueError, match=r"^beta is .*: expected a finite number"):
        spheres.speed_from_v_star(1.0, 0.0)


# The scaled equation


def test_contact_ends_at_kappa_epsilon():
    lhs, x, tau, kappa = equation.scaled_equation()
    eps, x_c = sympy.symbols("epsilon x_c", positive=True)
    end = equation.end_of_contact()
    force = lhs.subs(end.lhs, end.rhs).subs(x.diff(tau), -eps).subs(x, x_c)
    assert sympy.solve(force, x_c) == [kappa * eps]


def test_a_sphere_that_falls_on_a_wall():
    """Its weight acts during the contact: the rule of thumb for weak damping, 0 for a sphere that stays down."""
    soft = {"young_modulus": 1e7, "poisson_ratio": 0.3, "dissipative_constant": 3e-6}
    pair = Pair(Sphere(radius=0.01, density=2500, **soft), Sphere.wall(**soft))
    for speed in (0.5, 2.0):
        rule = 1 + 0.539 * 9.81 * pair.contact_time(speed) / speed
        loss = 1 - pair.epsilon(speed, gravity=9.81)
        assert loss == pytest.approx(pair.one_minus_epsilon(speed) * rule, rel=2e-3)
    found = pair.damped(1e-3).epsilon(np.array([[0.0, 1e-4], [0.1, 1.0]]), gravity=9.81)
    assert found.shape == (2, 2)
    assert (found[0] == 0).all()
    assert found[1, 1] == pair.damped(1e-3).epsilon(1.0, gravity=9.81)
    assert pair.contact().collide(0.5).epsilon == pytest.approx(pair.epsilon(0.5), rel=1e-12)
    with pytest.raises(ValueError, match=r"gravity is 9\.81 for two spheres: expected 0"):
        Pair(pair.first, pair.first).epsilon(1.0, gravity=9.81)
    with pytest.raises(ValueError, match="gravity is -1"):
        pair.epsilon(1.0, gravity=-1)
