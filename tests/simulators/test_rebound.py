"""REBOUND's files: the C code against exact eps, and the real program where it is installed."""

import ctypes
import importlib.util
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.compiled import WARNINGS, compiler
from tests.simulators.two_balls import flowing
from viscopade.collision.spheres import Pair, Sphere
from viscopade.simulators import rebound
from viscopade.simulators.input_file import render
from viscopade.simulators.setup import NamedContact, Setup

ICE = {"young_modulus": 1e10, "poisson_ratio": 0.3, "dissipative_constant": 1e-5}
ROCK = {"young_modulus": 5e10, "poisson_ratio": 0.2, "dissipative_constant": 1e-6}
COMMAND = "viscopade simulators rebound scene.toml"
KERNEL_ERROR = 3.4e-6  # what "1e-5" states, and rounding

# What the C file uses of rebound.h, in another order.
STUB = """
#include <stdint.h>
struct reb_vec6d { double x, y, z, vx, vy, vz; };
struct reb_particle { double m, r, x, y, z, vx, vy, vz; };
struct reb_collision { size_t p1, p2; struct reb_vec6d gb; };
struct reb_simulation {
    struct reb_particle *particles; double minimum_collision_velocity, collisions_plog; int64_t collisions_log_n;
};
enum REB_COLLISION_RESOLVE_OUTCOME { REB_COLLISION_RESOLVE_OUTCOME_REMOVE_NONE = 0 };
"""


def ball(radius, material=ICE, density=917):
    return Sphere(radius=radius, density=density, **material)


def pair(first, second=None):
    return Pair(ball(first), ball(first if second is None else second))


TYPICAL = pair(0.1)
EXTREMES = (pair(1.0), pair(0.025))


def ice(extremes=EXTREMES, typical=TYPICAL):
    return Setup("ring", {"ice": typical.first}, (NamedContact("ice", "ice", typical, 1e-4, 5e-3, 0.05, extremes),))


def several():
    rock, wall = ball(0.2, ROCK, 3000), Sphere.wall(**ROCK)
    bodies = {"ice": ball(0.1), "dark rock": rock, "floor": wall}
    contacts = (
        NamedContact("ice", "dark rock", Pair(ball(0.1), rock), 1e-4, 1e-3, 0.01),
        NamedContact("ice", "floor", Pair(ball(0.1), wall), 1e-4, 1e-3, 0.01),
        NamedContact("dark rock", "dark rock", Pair(rock, rock), 1e-4, 1e-3, 0.01),
    )
    return Setup("two materials", bodies, contacts)


def shared(directory, setup, *flags, tier="1e-5", name="scene", standard="c11"):
    """Compile the C file with all warnings; return the library's path."""
    source, library = directory / f"{name}.c", directory / f"lib{name}.so"
    source.write_text(render("rebound-c", setup, COMMAND, tier=tier))
    command = [*compiler(standard), *WARNINGS, "-Wmissing-prototypes", "-O2", "-shared", "-fPIC", *flags]
    done = subprocess.run([*command, "-o", library, source, "-lm"], capture_output=True, text=True)
    assert not done.returncode, done.stderr
    return library


def callback(library, symbol="ice_ice"):
    function = ctypes.CDLL(str(library))[f"viscopade_callback_{symbol}"]
    function.restype, function.argtypes = ctypes.c_double, [ctypes.c_void_p, ctypes.c_double]
    return lambda v: function(None, v)


def module(directory, setup=None, name="scene"):
    """Write and import the Python module."""
    path = directory / f"{name}.py"
    path.write_text(render("rebound-python", ice() if setup is None else setup, COMMAND))
    spec = importlib.util.spec_from_file_location(f"{name}_{len(sys.modules)}", path)
    found = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = found
    spec.loader.exec_module(found)
    return found


def no_worse(eps, exact, bound=KERNEL_ERROR):
    return np.all(np.abs(eps - exact) <= bound * np.minimum(exact, 1 - exact) + 2e-16)


# --- text -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("target", ["rebound-c", "rebound-python"])
def test_text(target):
    text = render(target, ice(), COMMAND)
    for phrase in ("x'' = 0", "m, kg, s", "viscopade_resolve_ice_ice", "6.69e-6", repr(TYPICAL.beta)):
        assert phrase in flowing(text)


def test_walls_are_left_out():
    assert list(rebound.contacts(several())) == ["ice_dark_rock", "dark_rock_dark_rock"]
    text = render("rebound-c", several(), COMMAND)
    assert "REBOUND has no walls; left out: ice-floor." in text
    assert "viscopade_callback_ice_floor" not in text


def test_names_of_functions_are_distinct():
    bodies = {name: ball(0.1) for name in ("a b", "a_b", "a-b")}
    contacts = tuple(NamedContact(name, name, TYPICAL, 1, 1, 1) for name in bodies)
    assert list(rebound.contacts(Setup("t", bodies, contacts))) == ["a_b_a_b", "a_b_a_b_", "a_b_a_b__"]


def test_bad_input():
    with pytest.raises(ValueError, match="expected 1e-5, 1e-10, full"):
        render("rebound-c", ice(), COMMAND, tier="1e-6")
    wall = Sphere.wall(**ICE)
    alone = Setup("t", {"ice": ball(1), "w": wall}, (NamedContact("ice", "w", Pair(ball(1), wall), 1, 1, 1),))
    with pytest.raises(ValueError, match="all contacts are with walls"):
        render("rebound-c", alone, COMMAND)


# --- the C file, without REBOUND --------------------------------------------------------------------------------------


@pytest.mark.parametrize("tier", ["1e-5", "1e-10"])
def test_callback(tier, tmp_path):
    """REBOUND's speeds are negative; some codes pass positive ones."""
    eps = callback(shared(tmp_path, ice(), "-DVISCOPADE_CALLBACK_ONLY", tier=tier))
    bounds = rebound.callback_kernel(tier).bound("restitution", "host", "double")
    bound = max(float(bound.relative + bound.last) for bound in bounds) + 4e-14  # rounding too
    v = 10 ** np.random.default_rng(1).uniform(-8, 3, 300)
    exact = TYPICAL.epsilon(v)
    assert no_worse(np.array([eps(-x) for x in v]), exact, bound)
    assert [eps(x) for x in v] == [eps(-x) for x in v]


def test_callback_at_the_ends(tmp_path):
    eps = callback(shared(tmp_path, ice(), "-DVISCOPADE_CALLBACK_ONLY"))
    assert eps(0.0) == eps(-0.0) == 1
    assert eps(math.inf) == eps(-math.inf) == 0
    assert math.isnan(eps(math.nan))
    assert eps(-5e-324) == 1


def test_each_contact_has_its_beta(tmp_path):
    library = shared(tmp_path, several(), "-DVISCOPADE_CALLBACK_ONLY")
    for symbol, contact in rebound.contacts(several()).items():
        assert no_worse(callback(library, symbol)(-0.003), contact.pair.epsilon(0.003))


# --- the resolve function, with another program's structures ----------------------------------------------------------


class Particle(ctypes.Structure):
    _fields_ = [(name, ctypes.c_double) for name in ("m", "r", "x", "y", "z", "vx", "vy", "vz")]


class Collision(ctypes.Structure):
    _fields_ = [("p1", ctypes.c_size_t), ("p2", ctypes.c_size_t), ("gb", ctypes.c_double * 6)]


class Simulation(ctypes.Structure):
    _fields_ = [
        ("particles", ctypes.POINTER(Particle)),
        ("minimum_collision_velocity", ctypes.c_double),
        ("collisions_plog", ctypes.c_double),
        ("collisions_log_n", ctypes.c_int64),
    ]


@pytest.fixture(scope="module")
def resolve(tmp_path_factory):
    directory = tmp_path_factory.mktemp("stub")
    (directory / "rebound.h").write_text(STUB)
    function = ctypes.CDLL(str(shared(directory, ice(), f"-I{directory}"))).viscopade_resolve_ice_ice
    function.argtypes = [ctypes.POINTER(Simulation), Collision]
    return function


def spheres(rng, depth=1e-4):
    """Return two overlapping spheres, the shift of the first and the line from the second to it."""
    radii = 10 ** rng.uniform(-1.6, 0, 2)
    normal = rng.normal(size=3)
    normal /= np.linalg.norm(normal)
    shift, v_shift = rng.normal(size=3), rng.normal(size=3) * 1e-3
    places = [normal * radii.sum() * (1 - depth) - shift, np.zeros(3)]
    velocities = rng.normal(size=(2, 3)) * 1e-2
    masses = [ball(r).mass for r in radii]
    particles = (Particle * 2)(
        *[Particle(m, r, *x, *v) for m, r, x, v in zip(masses, radii, places, velocities, strict=True)]
    )
    return particles, [*shift, *v_shift], normal


def velocities_of(particles):
    return np.array([[p.vx, p.vy, p.vz] for p in particles])


def test_resolve(resolve):
    """eps of the pair along the line of centres, nothing across, momentum and REBOUND's records."""
    rng = np.random.default_rng(2)
    bounced = 0
    for _ in range(300):
        particles, shift, normal = spheres(rng)
        before, (m1, m2) = velocities_of(particles), (p.m for p in particles)
        r = Simulation(particles, 0.0, 0.0, 0)
        assert resolve(r, Collision(0, 1, (ctypes.c_double * 6)(*shift))) == 0
        after = velocities_of(particles)
        relative, change = before[0] + shift[3:] - before[1], after - before
        v = -relative @ normal
        assert r.collisions_log_n == (v > 0)
        if v <= 0:
            assert not change.any()
            continue
        bounced += 1
        both = pair(*(p.r for p in particles))
        eps = (change[0] - change[1]) @ normal / v - 1
        exact = both.epsilon(v)
        assert abs(eps - exact) <= KERNEL_ERROR * min(exact, 1 - exact) + 1e-13
        rounding = 1e-15 * (m1 * np.linalg.norm(before[0]) + m2 * np.linalg.norm(before[1]))  # of the momenta
        assert m1 * change[0] == pytest.approx(-m2 * change[1], rel=0, abs=rounding)
        assert np.cross(change[0], normal) == pytest.approx(0, abs=1e-12 * np.linalg.norm(change[0]))
        distance = (particles[0].r + particles[1].r) * (1 - 1e-4)
        logged = normal[0] * distance * m1 * change[0][1]
        assert r.collisions_plog == pytest.approx(logged, rel=1e-12, abs=distance * rounding)
    assert bounced > 100


def test_resolve_leaves_what_does_not_touch(resolve):
    rng = np.random.default_rng(3)
    for _ in range(20):
        particles, shift, _ = spheres(rng, depth=-1e-9)
        before = velocities_of(particles)
        r = Simulation(particles, 1.0, 0.0, 0)
        resolve(r, Collision(0, 1, (ctypes.c_double * 6)(*shift)))
        assert (velocities_of(particles) == before).all()
        assert r.collisions_log_n == 0


def test_resolve_at_no_distance(resolve):
    particles = (Particle * 2)(*[Particle(1, 1, 0, 0, 0, v, 0, 0) for v in (1, -1)])
    resolve(Simulation(particles, 0.0, 0.0, 0), Collision(0, 1))
    assert [p.vx for p in particles] == [1, -1]


# --- the real program -------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def program():
    return pytest.importorskip("rebound", reason="REBOUND is not installed")


@pytest.fixture(scope="module")
def header(program):
    found = Path(program.__path__[0]).parent / "src" / "rebound.h"
    if not found.exists():
        pytest.skip("the installed REBOUND has no rebound.h")
    return found


@pytest.fixture(scope="module")
def scene(header, tmp_path_factory):
    """The Python module with its shared library beside it."""
    directory = tmp_path_factory.mktemp("scene")
    shared(directory, ice(), "-isystem", str(header.parent))
    return module(directory)


@pytest.fixture
def slow(tmp_path):
    """The Python module without a library."""
    return module(tmp_path)


def two(program, radii, velocities, install, minimum=0.0):
    """Let two spheres collide in REBOUND; return its simulation and the eps that came out."""
    sim = program.Simulation()
    sim.gravity, sim.collision, sim.integrator = "none", "direct", "leapfrog"
    sim.G, sim.minimum_collision_velocity = 0, minimum
    distance = sum(radii) * (1 + 1e-6)
    normal = np.array([0.6, 0.48, 0.64])
    for r, sign, v in zip(radii, (1, -1), velocities, strict=True):
        x, y, z = sign * distance / 2 * normal
        vx, vy, vz = v
        sim.add(m=ball(r).mass, r=r, x=x, y=y, z=z, vx=vx, vy=vy, vz=vz)
    install(sim)
    closing = -(np.subtract(*velocities) @ normal)
    sim.dt = 2e-6 * distance / closing
    sim.steps(1)
    after = [(p.vx, p.vy, p.vz) for p in sim.particles]
    place = np.subtract(*[(p.x, p.y, p.z) for p in sim.particles])
    place /= np.linalg.norm(place)
    return sim, np.subtract(*after) @ place / -(np.subtract(*velocities) @ place)


CASES = [
    ((0.1, 0.1), (-0.01, 0.01)),
    ((1.0, 0.025), (-1e-3, 1e-3)),
    ((0.3, 0.05), (-0.05, 0.002)),
]


def aimed(velocities):
    return [np.add([v, v / 3, v / 2], [1e-4, -2e-4, 3e-4]) for v in velocities]


@pytest.mark.parametrize(("radii", "velocities"), CASES)
@pytest.mark.parametrize("by_pair", [True, False])
@pytest.mark.parametrize("way", ["compiled", "python"])
def test_collision_in_rebound(program, request, radii, velocities, by_pair, way):
    chosen = request.getfixturevalue("scene" if way == "compiled" else "slow")
    ways = []
    sim, eps = two(program, radii, aimed(velocities), lambda s: ways.append(chosen.install(s, by_pair=by_pair)))
    assert ways == [way]
    assert sim.collisions_log_n == 1
    v = -np.subtract(*aimed(velocities)) @ np.array([0.6, 0.48, 0.64])
    exact = (pair(*radii) if by_pair else TYPICAL).epsilon(v)
    assert abs(eps - exact) <= KERNEL_ERROR * min(exact, 1 - exact) + 1e-8  # the line turns while they approach


@pytest.mark.parametrize("minimum", [0.0, 0.5, 1e5])
def test_resolve_is_that_of_rebound(program, scene, minimum):
    """With one beta for both, velocities and records are those of REBOUND's own hard spheres."""
    radii, velocities = (0.1, 0.1), aimed((-0.01, 0.02))
    found = [
        two(program, radii, velocities, lambda s, b=by_pair: scene.install(s, by_pair=b), minimum)[0]
        for by_pair in (True, False)
    ]
    ours, theirs = ([*np.ravel([(p.vx, p.vy, p.vz) for p in s.particles]), s.collisions_plog] for s in found)
    assert ours == pytest.approx(theirs, rel=1e-11, abs=0)
    assert [s.collisions_log_n for s in found] == [1, 1]


def test_minimum_velocity_of_unequal_spheres(program, scene, slow):
    """Deep in each other, REBOUND's least velocity decides: it does not depend on eps."""

    def deep(install):
        sim = program.Simulation()
        sim.gravity, sim.collision, sim.dt, sim.minimum_collision_velocity = "none", "direct", 1e-9, 3.0
        sim.add(m=1.0, r=1.0, x=0.1, vx=-1e-3)
        sim.add(m=2.0, r=0.25, y=0.2, vx=1e-3)
        install(sim)
        sim.steps(1)
        return [*np.ravel([(p.vx, p.vy, p.vz) for p in sim.particles]), sim.collisions_plog]

    assert deep(scene.install) == pytest.approx(deep(slow.install), rel=1e-12, abs=1e-15)


def test_compiled_functions_are_called_directly(program, scene):
    """REBOUND must not wrap them in Python callbacks."""
    sim = program.Simulation()
    scene.install(sim)
    library = ctypes.CDLL(str(scene.LIBRARY))
    for field, name in (("_collision_resolve", "resolve"), ("_coefficient_of_restitution", "callback")):
        inside = ctypes.cast(getattr(sim, field), ctypes.c_void_p).value
        assert inside == ctypes.cast(library[f"viscopade_{name}_ice_ice"], ctypes.c_void_p).value


def test_install_refuses(program, scene, slow, tmp_path, header):
    sim = program.Simulation()
    with pytest.raises(ValueError, match="contact is 'x': expected ice-ice"):
        scene.install(sim, "x")
    with pytest.raises(OSError, match=r"no\.so"):
        scene.install(sim, library=tmp_path / "no.so")
    other = shared(tmp_path, ice((), pair(0.2)), "-isystem", str(header.parent), name="other")
    with pytest.raises(ValueError, match="of another setup"):
        slow.install(sim, library=other)
    small = shared(tmp_path, ice(), "-DVISCOPADE_CALLBACK_ONLY", name="small")
    slow.install(sim, library=small, by_pair=False)
    with pytest.raises(ValueError, match="viscopade_layout"):
        slow.install(sim, library=small)
    (tmp_path / "rebound.h").write_text(STUB)
    stub = shared(tmp_path, ice(), f"-I{tmp_path}", name="stub")
    with pytest.raises(ValueError, match="another REBOUND"):
        slow.install(sim, library=stub)
