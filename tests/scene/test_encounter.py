"""Ranges of beta, v* and eps, duration and depth of contact, warnings: each by another route."""

import math
import re
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import viscopade as vp
from viscopade import Pair, Sphere
from viscopade.collision import limits
from viscopade.scene import encounter, model_limits, read
from viscopade.scene.description import Body, Code, Material, Meeting, Scene, Sizes, Speeds, Tolerance

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = sorted((ROOT / "examples").glob("*.toml"))
GLASS = Material(70e9, 0.22, 2500.0, 5e-8)
LEAD = Material(16e9, 0.44, 11340.0, 4e-6)
CORK = Material(2e7, 0.1, 200.0, 3e-5)


def scene_of(first, second=None, speeds=None, *, sizes=((1e-3, 2e-3, 4e-3), (1e-3, 2e-3, 4e-3)), wall=None, phi=None):
    """Return a scene of one contact: between equal bodies, two kinds of spheres, or a sphere and a wall."""
    materials = {"a": first, "b": wall or second or first}
    bodies = {"one": Body("a", Sizes(*sizes[0]))}
    if wall is not None:
        bodies["two"] = Body("b", None)
    elif second is not None:
        bodies["two"] = Body("b", Sizes(*sizes[1]))
    meeting = Meeting("one", list(bodies)[-1], speeds or Speeds.between(0.01, 1.0))
    return Scene("s.toml", "s", "s", materials, bodies, (meeting,), Tolerance(epsilon=1e-3), Code(), phi)


def met(scene):
    (found,) = encounter.scene_encounters(scene)
    return found


def grid_of_beta(scene):
    """Return beta on a dense grid of radii, from the formulas of the paper with numbers only."""
    meeting = scene.meetings[0]
    parts = []
    for name in (meeting.first, meeting.second):
        body = scene.bodies[name]
        material = scene.materials[body.material]
        if body.is_wall:
            radii = np.array([math.inf])
        else:
            radii = np.geomspace(body.sizes.least, body.sizes.largest, 400 if body.sizes.spread else 1)
        mass = np.full_like(radii, math.inf) if body.is_wall else 4 / 3 * math.pi * radii**3 * material.density
        compliance = (1 - material.poisson_ratio**2) / material.young_modulus
        parts.append((radii, mass, compliance, material.dissipative_constant))
    (r1, m1, d1, a1), (r2, m2, d2, a2) = parts
    r_eff, m_eff = (1 / (1 / x[:, None] + 1 / y[None, :]) for x, y in ((r1, r2), (m1, m2)))
    rho = 4 / 3 / (d1 + d2) * np.sqrt(r_eff)
    return 1.5 * (d1 * a1 + d2 * a2) / (d1 + d2) * (rho / m_eff) ** 0.4


# --- ranges -----------------------------------------------------------------------------------------------------------

WIDE, NARROW, POINT = (1e-4, 1e-3, 1e-2), (0.9e-3, 1e-3, 1.1e-3), (1e-3, 1e-3, 1e-3)
SCENES = {
    "one kind": scene_of(GLASS, sizes=(WIDE,)),
    "one size": scene_of(GLASS, sizes=(POINT,)),
    "two kinds of one material": scene_of(GLASS, GLASS, sizes=(WIDE, NARROW)),
    "one fixed": scene_of(GLASS, GLASS, sizes=(POINT, WIDE)),
    "light and heavy": scene_of(CORK, LEAD, sizes=(WIDE, WIDE)),
    "heavy and light": scene_of(LEAD, CORK, sizes=(WIDE, NARROW)),
    "light, of one size, and heavy": scene_of(CORK, LEAD, sizes=(POINT, (0.5e-3, 1e-3, 1e-1))),
    "heavy, of one size, and light": scene_of(LEAD, CORK, sizes=(POINT, WIDE)),
    "at a wall": scene_of(GLASS, wall=LEAD, sizes=(WIDE,)),
}


@pytest.mark.parametrize("name", SCENES)
def test_range_of_beta_is_that_of_all_radii(name):
    scene = SCENES[name]
    found, beta = met(scene), grid_of_beta(scene)
    assert beta.max() == pytest.approx(found.strongest.beta, rel=1e-13, abs=0)  # at a corner, which the grid has
    assert found.weakest.beta <= beta.min() * (1 + 1e-13)
    assert found.weakest.beta == pytest.approx(beta.min(), rel=1e-4)  # and no lower than it must be


@pytest.mark.parametrize("name", SCENES)
def test_v_star_is_rounded_outwards(name):
    found = met(SCENES[name])
    low, high = found.v_star
    for pair, speed, end, sign in ((found.weakest, 0.01, low, 1), (found.strongest, 1.0, high, -1)):
        v_star = math.sqrt(pair.beta) * speed**0.1
        assert sign * (v_star - end) > 0
        assert v_star == pytest.approx(float(end), rel=1e-11, abs=0)


@pytest.mark.parametrize("name", SCENES)
def test_range_of_eps(name):
    found = met(SCENES[name])
    for end, eps, sign in zip(found.v_star, reversed(found.epsilon), (1, -1), strict=True):
        exact = Fraction(vp.exact.collision(end, 40).decimals()["epsilon"])
        assert 0 < sign * (eps - exact) < exact * Fraction(3, 10**18)


def test_eps_never_exceeds_one():
    low, high = encounter.proven_epsilon(Fraction(1, 10**30))
    assert low < high <= 1


@pytest.mark.parametrize("kind", ["spheres", "wall"])
def test_speeds_of_a_temperature_are_those_of_impacts(kind):
    """Sample pairs from a gas, and let them meet as often as they are fast."""
    rng = np.random.default_rng(7)
    temperature, count, tail = 0.3, 400_000, 0.01
    velocity = rng.normal(0, math.sqrt(temperature), (2, count))
    normal = np.abs(velocity[0] if kind == "wall" else velocity[0] - velocity[1])
    speeds = rng.choice(normal, count, p=normal / normal.sum())
    found = Speeds.thermal(temperature, tail, kind == "wall")
    assert (speeds < found.slowest).mean() == pytest.approx(tail, rel=0.1)
    assert (speeds > found.fastest).mean() == pytest.approx(tail, rel=0.1)
    assert speeds.mean() == pytest.approx(found.typical, rel=0.01)


@pytest.mark.parametrize("tail", [1e-300, 0.4999])
def test_tails_of_a_temperature(tail):
    s = math.sqrt(2 * 0.7)
    found = Speeds.thermal(0.7, tail, wall=False)
    assert math.exp(-(found.fastest**2) / (2 * s**2)) == pytest.approx(tail, rel=1e-12, abs=0)
    assert -math.expm1(-(found.slowest**2) / (2 * s**2)) == pytest.approx(tail, rel=1e-12, abs=0)
    assert found.slowest < found.typical < found.fastest or tail > 0.4


def test_v_star_beyond_all_reason_is_refused():
    strange = replace(GLASS, dissipative_constant=1e70)
    with pytest.raises(ValueError, match=r"s\.toml: v\* of one-one ranges from .* expected 1e-30 to 1e30"):
        encounter.scene_encounters(scene_of(strange))


def test_extreme_radii_that_cannot_be_are_refused_with_the_files_name():
    with pytest.raises(ValueError, match=r"^s\.toml: one-one: mass is .* expected"):
        encounter.scene_encounters(scene_of(GLASS, sizes=((1e-150, 1e-3, 2e-3),)))


# --- duration, depth, mean free time, yield ---------------------------------------------------------------------------


@pytest.mark.parametrize("scene", [scene_of(GLASS), scene_of(CORK, LEAD), scene_of(CORK, wall=LEAD)])
def test_duration_and_depth_of_contact(scene):
    """Against the equation of motion in SI units, integrated until the force vanishes."""
    found = met(scene)
    pair = found.pair
    unit = (pair.m_eff / pair.rho) ** 0.4

    def force(_, y):
        return pair.rho * math.sqrt(max(y[0], 0)) * (y[0] + 1.5 * pair.A * y[1])

    def ends(t, y):
        return y[0] + 1.5 * pair.A * y[1] if t else 1.0

    def turns(_, y):
        return y[1]

    ends.terminal, ends.direction = True, -1
    runs = [
        solve_ivp(
            lambda t, y: (y[1], -force(t, y) / pair.m_eff), (0, 100 * unit * speed**-0.2), (0.0, speed),
            method="DOP853", events=(ends, turns), rtol=1e-11, atol=1e-13 * unit, max_step=0.05 * unit * speed**-0.2,
        )
        for speed in (0.1, 1.0)
    ]  # fmt: skip
    assert found.contact_time == pytest.approx(runs[0].t_events[0][0], rel=1e-6)
    assert found.overlap == pytest.approx(runs[1].y_events[1][0][0] / 2e-3, rel=1e-6)


def test_mean_free_time_of_a_gas_counted():
    """Count collisions of test particles with scatterers in a dilute box, by volumes swept: rate = n pi d^2 <v_rel>."""
    temperature, phi, radius = 0.04, 1e-6, 2e-3
    scene = scene_of(GLASS, speeds=Speeds.thermal(temperature, 1e-6, False), sizes=((radius,) * 3,), phi=phi)
    rng = np.random.default_rng(3)
    relative = rng.normal(0, math.sqrt(2 * temperature), (400_000, 3))
    n = phi / (4 / 3 * math.pi * radius**3)
    rate = n * math.pi * (2 * radius) ** 2 * np.linalg.norm(relative, axis=1).mean()
    assert encounter.mean_free_time(scene, met(scene)) == pytest.approx(1 / rate, rel=0.01)


@pytest.mark.parametrize("phi", [0.01, 0.2, 0.5])
def test_mean_free_time_of_a_dense_gas(phi):
    """By the equation of state of Carnahan and Starling: Z = 1 + 4 phi g."""
    thin, dense = (scene_of(GLASS, speeds=Speeds.thermal(1.0, 1e-6, False), phi=p) for p in (1e-9, phi))
    z = (1 + phi + phi**2 - phi**3) / (1 - phi) ** 3
    ratio = encounter.mean_free_time(thin, met(thin)) / encounter.mean_free_time(dense, met(dense))
    assert ratio == pytest.approx(phi / 1e-9 * (z - 1) / (4 * phi), rel=1e-7)


def test_no_mean_free_time_without_a_gas_or_at_a_wall():
    assert encounter.mean_free_time(scene_of(GLASS), met(scene_of(GLASS))) is None
    wall = scene_of(GLASS, wall=LEAD, phi=0.1)
    assert encounter.mean_free_time(wall, met(wall)) is None


def test_pressure_at_the_yield_speed():
    """Without dissipation, the largest compression at that speed has the pressure 1.6 Y: p = 3 F/(2 pi a^2)."""
    one = Sphere(radius=2e-3, density=2500, young_modulus=70e9, poisson_ratio=0.22, dissipative_constant=0)
    pair = Pair(one, one)
    depth = pair.max_compression(limits.yield_speed(pair, 3e8))
    pressure = 3 * pair.rho * depth**1.5 / (2 * math.pi * pair.R_eff * depth)
    assert pressure == pytest.approx(1.6 * 3e8, rel=1e-6)


def test_what_is_beyond_double_precision_is_no_error():
    pair = met(scene_of(GLASS)).pair
    assert limits.yield_speed(pair, 1e300) == math.inf
    assert limits.yield_speed(pair, 1e-300) == 0
    thin = scene_of(GLASS, sizes=((10.0,) * 3,), phi=5e-324)
    assert encounter.mean_free_time(thin, met(thin)) > 1e300


# --- warnings ---------------------------------------------------------------------------------------------------------

HARDNESS, DEPTH, YIELDING = "mean free time", "the overlap reaches", "begins to yield"
SOUND, RELAXATION = "as long as sound takes", "of the contact time at"


def warned(scene):
    """Return which of the five warnings there are."""
    found = list(model_limits.warnings(scene, met(scene)))
    assert all(text.startswith(f"{scene.meetings[0].name}: ") and text.isprintable() for text in found)
    kinds = (HARDNESS, DEPTH, YIELDING, SOUND, RELAXATION)
    assert len(found) == sum(any(kind in text for text in found) for kind in kinds)
    return {kind for kind in kinds if any(kind in text for text in found)}


SLOW = Speeds.between(1e-3, 1e-2)


def test_nothing_is_warned_of():
    assert warned(scene_of(replace(GLASS, yield_strength=1e9), speeds=SLOW, phi=0.1)) == set()


def around(kind, make, low, high):
    """Assert that a warning begins where a number between two passes a point; return that."""
    assert kind not in warned(make(low))
    assert kind in warned(make(high))
    for _ in range(40):
        middle = math.sqrt(low * high)
        low, high = (low, middle) if kind in warned(make(middle)) else (middle, high)
    return low


def test_contacts_that_last_long():
    def make(phi):
        return scene_of(replace(GLASS, young_modulus=1e5), speeds=SLOW, phi=phi)

    phi = around(HARDNESS, make, 1e-3, 0.7)
    found = met(make(phi))
    share = found.contact_time / encounter.mean_free_time(make(phi), found)
    assert share == pytest.approx(model_limits.LONGEST_CONTACT, rel=1e-9)


def test_deep_contacts():
    def make(fastest):
        return scene_of(replace(GLASS, young_modulus=1e7), speeds=Speeds.between(1e-3, fastest))

    fastest = around(DEPTH, make, 1e-2, 10)
    assert met(make(1.0)).pair.max_compression(fastest) / 2e-3 == pytest.approx(limits.LARGEST_OVERLAP, rel=1e-6)


def test_yielding():
    def make(fastest):
        return scene_of(replace(GLASS, yield_strength=1e9), speeds=Speeds.between(1e-3, fastest))

    fastest = around(YIELDING, make, 1e-2, 10)
    limit = limits.yield_speed(met(make(1.0)).pair, 1e9)
    assert fastest == pytest.approx(limits.NEAR_YIELD * limit, rel=1e-9)
    near, beyond = (" ".join(model_limits.warnings(make(f * limit), met(make(f * limit)))) for f in (0.9, 1.1))
    assert "is near the" in near
    assert "is beyond the" in beyond


def test_the_weaker_material_yields_wherever_it_is():
    weak, strong = replace(GLASS, yield_strength=1e7), replace(GLASS, yield_strength=1e12)
    for first, second in ((weak, strong), (strong, weak), (weak, GLASS), (GLASS, weak)):
        assert YIELDING in warned(scene_of(first, second))
        assert YIELDING in warned(scene_of(first, wall=second))
    assert YIELDING not in warned(scene_of(strong, GLASS))


def test_sound():
    def make(fastest):
        return scene_of(GLASS, speeds=Speeds.between(1e-3, fastest))

    fastest = around(SOUND, make, 1e-2, 1e4)
    crossing = 2 * 2e-3 / math.sqrt(70e9 / 2500)
    assert met(make(1.0)).pair.contact_time(fastest) == pytest.approx(limits.SOUND_CROSSINGS * crossing, rel=1e-6)


def test_relaxation():
    def make(constant):
        return scene_of(replace(GLASS, dissipative_constant=constant), speeds=SLOW)

    constant = around(RELAXATION, make, 1e-9, 1e-2)
    found = met(make(constant))
    assert found.strongest.first.radius == found.strongest.second.radius == 1e-3
    assert constant / found.strongest.contact_time(1e-2) == pytest.approx(limits.LONGEST_RELAXATION, rel=1e-6)


# --- what simulators are told -----------------------------------------------------------------------------------------


def test_contact_of_simulators():
    spread, point = met(scene_of(GLASS)).contact(), met(scene_of(GLASS, sizes=((1e-3,) * 3,))).contact()
    assert (spread.slowest, spread.typical, spread.fastest) == (0.01, pytest.approx(0.1), 1.0)
    assert spread.extremes[0].beta < spread.pair.beta < spread.extremes[1].beta
    assert point.extremes == ()


@pytest.mark.parametrize(("known", "typical"), [(None, 0.1), (0.3, 0.3), (1e-9, 0.01), (50.0, 1.0)])
def test_the_typical_speed_is_that_at_which_eps_is_known(known, typical):
    scene = scene_of(GLASS)
    scene = replace(scene, meetings=(replace(scene.meetings[0], dissipative_constant=1e-7, known_at=known),))
    assert met(scene).contact().typical == pytest.approx(typical)


# --- examples and documents -------------------------------------------------------------------------------------------


def met_in(path):
    return encounter.scene_encounters(read.from_toml(path.read_bytes(), path.name))


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_readme_of_the_examples(path):
    found = met_in(path)
    row = next(
        line for line in (ROOT / "examples" / "README.md").read_text("utf-8").splitlines()
        if line.startswith(f"| [{path.name}]({path.name}) |")
    )  # fmt: skip
    columns = [column.strip() for column in row.strip("|").split("|")]
    for shown, name in zip(columns[2:], ("v_star", "epsilon"), strict=True):
        ranges = [getattr(e, name) for e in found]
        low, high = (float(f(r[i] for r in ranges)) for i, f in ((0, min), (1, max)))
        assert shown == f"{low:.3g} … {high:.3g}"


def test_ice_is_that_of_the_paper():
    """v* = 1 at 0.262 cm/s, for the ball that was measured."""
    scene = read.from_toml((ROOT / "examples" / "ice_rings.toml").read_bytes(), "ice_rings.toml")
    ice = scene.materials["ice"]
    law = {
        "young_modulus": ice.young_modulus,
        "poisson_ratio": ice.poisson_ratio,
        "dissipative_constant": ice.dissipative_constant,
    }
    pair = Pair(Sphere(radius=0.0275, density=ice.density, **law), Sphere.wall(**law))
    assert pair.speed(1.0) == pytest.approx(0.00262, rel=0.2)
    assert pair.epsilon(0.01) == pytest.approx(0.32, rel=1e-12, abs=0)


def test_document_has_the_limits():
    text = (ROOT / "docs" / "usage" / "scenes.md").read_text("utf-8")
    rows = dict(re.findall(r"^\| ([^|]+) \| ([<>] [\d.]+) \|", text, re.MULTILINE))
    assert rows == {
        "contact time / mean free time": f"> {model_limits.LONGEST_CONTACT:g}",
        "overlap / smaller radius": f"> {limits.LARGEST_OVERLAP:g}",
        "fastest speed / yield speed": f"> {limits.NEAR_YIELD:g}",
        "contact time / time of sound through the sphere": f"< {limits.SOUND_CROSSINGS:g}",
        "A / contact time": f"> {limits.LONGEST_RELAXATION:g}",
    }
    assert f"this pressure is {limits.YIELD_PRESSURE:g} times the yield strength" in " ".join(text.split())
