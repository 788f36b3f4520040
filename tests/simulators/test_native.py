"""Native parameters: eps that the real programs delivered, what to write instead, and forces that are typed."""

import ast
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from mpmath import mp
from scipy.integrate import solve_ivp

from viscopade.collision.contact import PHASES
from viscopade.collision.schemes import SEMI_IMPLICIT
from viscopade.simulators import simulator_of
from viscopade.simulators.formula import force_end_kappa, tsuji_kappa
from viscopade.simulators.native import Impact, Native, Parameter, delivery
from viscopade.simulators.typed_force import force
from viscopade.simulators.typed_force import native as typed
from viscopade_lab.runs.simulators import RADIUS, Deck, falls, mujoco_epsilons

EARTH = 9.81
KRATOS = {"law": "DEM_D_Linear_viscous_Coulomb", "YOUNG_MODULUS": "1e5", "POISSON_RATIO": "0"}
KRATOS |= {"COEFFICIENT_OF_RESTITUTION": "0.5"}
SOFT, HARD = "-7672.00354889 -44.7191729394", "-294911.816419 -277.258872224"  # eps 0.5: contacts of 31 ms and 5 ms
FLAT = {"solimp": "0.9 0.9 0.001", "condim": "1"}


def delivered(name, settings, speed=1.0, mass=None, gravity=0.0, step=None, epsilon=None, radius=None):
    native = name if isinstance(name, Native) else simulator_of(name).native
    return delivery(native, settings, Impact(speed, mass, radius, gravity, step), epsilon)


# Measured in MuJoCo 4.0.0: mean, least and largest of 64 phases.
MUJOCO = [
    ({"solref": "-2500 -100"}, 0.003, 0.0, (0.122181, 0.103048, 0.143140)),
    ({"solref": "-2500 -100"}, 0.01, 0.0, (0.125371, 0.013048, 0.248047)),
    ({}, 0.01, 0.0, (0.125371, 0.013048, 0.248047)),
    ({"integrator": "implicitfast"}, 0.003, 0.0, (0.122181, 0.103048, 0.143140)),
    ({"integrator": "RK4"}, 0.003, 0.0, (0.135677, 0.123601, 0.148715)),
    ({"integrator": "RK4"}, 0.01, 0.0, (0.135906, 0.096894, 0.180108)),
    ({}, 0.003, EARTH, (0, 0, 0)),
]


@pytest.mark.parametrize(("settings", "step", "gravity", "measured"), MUJOCO)
def test_mujoco_in_time_steps(settings, step, gravity, measured):
    native, hit = simulator_of("mujoco").native, Impact(1.0, None, None, gravity, step)
    values = native.values(settings)
    scheme = native.schemes[values["integrator"]]
    found = native.contact(values, hit).collide(step=step, scheme=scheme, phases=PHASES)
    assert (found.epsilon, found.least, found.largest) == pytest.approx(measured, abs=2e-6)
    assert found.parts == (gravity == 0)
    assert found.status == "sampled"


@dataclass(frozen=True)
class AtPhases(Deck):
    """A deck with phases of one's choice, without gravity."""

    parts: tuple[float, ...] = ()

    @property
    def starts(self):
        """The height and the velocity from which contact begins at each phase."""
        yield from ((part * self.time_step * self.speed, -self.speed) for part in self.parts)


@pytest.mark.parametrize("step", [0.01, 0.003])
def test_the_range_over_all_phases_is_that_of_mujoco_itself(step):
    pytest.importorskip("mujoco")
    found = delivered("mujoco", {"solref": "0.02 1"}, step=step).collision
    text, parts = "solref=0.02 1; solimp=0.9 0.95 0.001 0.5 2; condim=3", np.linspace(1e-9, 1 - 1e-9, 201)
    epsilon = [*mujoco_epsilons(AtPhases("mujoco", "Euler", text, 3.0, 1.0, 0.0, step, 0.06, 0, tuple(parts)))]
    assert (found.least, found.largest) == pytest.approx((min(epsilon), max(epsilon)), abs=3e-5)
    assert found.least < min(epsilon) + 1e-7
    assert found.largest > max(epsilon) - 1e-7


@pytest.mark.parametrize("speed", [0.16, 0.2, 0.3])
def test_mujoco_just_above_the_speed_below_which_a_body_stays_down(speed):
    """The speed is 0.147 m/s: some phases stay down. The page on MuJoCo has these numbers."""
    pytest.importorskip("mujoco")
    settings = {"solref": "0.02 0.5", "cone": "elliptic", "integrator": "implicitfast"}
    found = delivered("mujoco", settings, speed, gravity=EARTH, step=0.002).collision
    text = "solref=0.02 0.5; solimp=0.9 0.95 0.001 0.5 2; cone=elliptic; condim=3"
    epsilon = [*mujoco_epsilons(Deck("mujoco", "implicitfast", text, 3.0, speed, EARTH, 0.002, 0.031, len(PHASES)))]
    assert found.epsilon == pytest.approx(np.mean(epsilon), abs=1e-9)
    page = (Path(__file__).parents[2] / "docs/usage/simulators/mujoco.md").read_text("utf-8")
    least = f"{found.least:.3f}" if found.least else "0"
    assert f"| {speed} m/s | {found.epsilon:.3f} | {least} to {found.largest:.3f} |" in page


@pytest.mark.parametrize(
    ("solref", "speed", "measured"),
    [
        *((SOFT, *pair) for pair in ((1.0, 0.448188), (0.3, 0.407536), (0.1, 0.339840))),
        *((HARD, *pair) for pair in ((1.0, 0.490498), (0.3, 0.469897), (0.1, 0.427204))),
    ],
)
def test_mujoco_with_weight(solref, speed, measured):
    """Runge-Kutta with 2000 steps in a contact."""
    found = delivered("mujoco", {"solref": solref, **FLAT}, speed, gravity=EARTH)
    assert found.collision.epsilon == pytest.approx(measured, abs=1e-4)


@pytest.mark.parametrize(
    ("settings", "gravity", "measured"),
    [
        ({"condim": "1", "friction": "0.5"}, 0, 0.499896),
        ({"friction": "0"}, 0, 0.483970),
        ({"friction": "0.5"}, 0, 0.486579),
        ({"friction": "1.5"}, 0, 0.535025),
        ({"friction": "0.5 0.005 0.0001", "condim": "4"}, 0, 0.485714),
        ({"friction": "1.5", "condim": "4", "impratio": "10"}, 0, 0.488019),
        ({"friction": "1.5", "cone": "elliptic", "impratio": "10"}, 0, 0.499896),
        ({"friction": "1.5"}, EARTH, 0.473640),
        ({"friction": "1.5", "condim": "4"}, EARTH, 0.462674),
    ],
)
def test_friction_changes_the_eps_of_mujoco(settings, gravity, measured):
    """With 1000 steps in a contact."""
    found = delivered("mujoco", {"solref": SOFT, "solimp": FLAT["solimp"], **settings}, gravity=gravity, step=3.1e-5)
    assert found.collision.epsilon == pytest.approx(measured, abs=2e-5)


@pytest.mark.parametrize("solref", ["-2500 -100", "0.02 1"])
@pytest.mark.parametrize(("gravity", "step"), [(0.0, None), (EARTH, None), (0.0, 0.002)])
def test_what_is_written_instead_delivers_the_wanted_eps(solref, gravity, step):
    given = {"gravity": gravity, "step": step}
    instead = delivered("mujoco", {"solref": solref}, 3.0, epsilon=0.5, **given).instead
    found = delivered("mujoco", instead, 3.0, **given)
    assert found.collision.epsilon == pytest.approx(0.5, abs=1e-6)
    assert (found.values["solref"][0][0] > 0) == (solref[0] != "-")


def test_a_short_timeconst_counts_as_two_steps():
    given = {"solref": "0.002 1"}
    held = delivered("mujoco", given, step=0.002)
    assert any("counts as two time steps, 0.004 s" in text for text in held.warnings)
    assert held.collision == delivered("mujoco", {"solref": "0.004 1"}, step=0.002).collision
    assert held.collision != delivered("mujoco", given | {"refsafe": "disable"}, step=0.002).collision


def test_warnings():
    (weight,) = delivered("mujoco", {"solref": SOFT, **FLAT}).warnings
    assert weight == "Without weight. A body that falls on a plane has g t_c/v = 0.35, and eps = 0.4482: --gravity 9.81"
    (signs,) = delivered("mujoco", {"solref": "2500 100"}, gravity=EARTH).warnings
    assert "for stiffness and damping write solref = -2500 -100" in signs
    step, energy = delivered("mujoco", {"solref": SOFT, **FLAT}, gravity=EARTH, step=0.02).warnings
    assert step.startswith("A contact has 1.8 time steps only")  # pi/sqrt(stiffness) is 35.9 ms
    assert energy.endswith("above 1: the bodies gain energy, as the time step is too long")
    assert not delivered("mujoco", {"solref": SOFT, **FLAT}, gravity=EARTH, step=0.002).warnings


def test_steps_that_are_far_too_short_give_the_eps_without_one():
    short, without = (delivered("mujoco", {"solref": SOFT, **FLAT}, step=step) for step in (1e-9, None))
    assert short.collision == without.collision
    assert (short.stepped, without.stepped) == (False, False)
    assert (
        short.warnings[0]
        == "A contact has 3.6e+07 time steps: this is eps with infinitely many, which differs by less than 0.001"
    )


@pytest.mark.parametrize("phase", [0.0, 0.3, 1 - 1e-12])
def test_steps_longer_than_a_contact_are_computed(phase):
    """Drake's approximation sap, by hand: each step of implicit Euler solves a linear equation."""
    sap, h, k, c = {"discrete_contact_approximation": "sap"}, 0.01, 5e5, 5e5 * 0.2
    found = delivered("drake", sap, mass=1.0, step=h)
    assert any(text.startswith("A time step is 2.3 contacts long") for text in found.warnings)
    x, v = -phase * h + h, 1.0  # after the step in which contact begins
    while x > 0:
        v = min(v, (v - h * k * x) / (1 + h * c + h * h * k))  # the force never pulls
        x += h * v
    assert found.collision.least - 1e-6 < -v < found.collision.largest + 1e-6
    assert (found.collision.epsilon, found.collision.largest) == pytest.approx((0.0231, 0.0466), abs=5e-5)


def test_a_step_of_seconds_is_warned_of():
    texts = delivered("mujoco", {}, step=2.0).warnings
    assert any(text.startswith("A time step is 32 contacts long") for text in texts)


@pytest.mark.parametrize(
    ("program", "settings", "step"),
    [
        ("newton", {"ke": "1e5", "kd": "1e3"}, 1e-3),
        ("drake", {"hunt_crossley_dissipation": "0.5"}, 5e-4),
        ("kratos", {**KRATOS, "TranslationalIntegrationScheme": "Forward_Euler"}, 2e-3),
        (typed("1e5*x + 139*v", "force"), {"scheme": "forward-euler"}, 1e-3),
        (typed("1e5*x + 139*v", "force"), {}, None),
    ],
)
def test_both_numbers_of_a_line_are_those_of_the_program(program, settings, step):
    """The second is what is printed if gravity is asked for, in the same steps."""
    given = {"mass": 1.0, "radius": 0.5, "step": step}
    alone, falls = (delivered(program, settings, gravity=g, **given) for g in (0.0, EARTH))
    assert alone.falling == falls.collision
    assert alone.collision != falls.collision
    assert falls.falling is None


@pytest.mark.parametrize("start", [0.04, 0.6])
@pytest.mark.parametrize(("step", "error"), [(None, 1e-6), (1e-3, 0.1), (1e-4, 1e-2)])
@pytest.mark.parametrize("gravity", [0.0, EARTH])
def test_a_spring_from_some_compression_on(start, step, error, gravity):
    """Without damping eps is 1, with weight, too; the depth is that of the energy, k y^2 = v^2 + 2 g (start + y)."""
    found = delivered(typed(f"1e5*max(x - {start}, 0)", "force"), {}, mass=1.0, step=step, gravity=gravity)
    collision = found.collision
    assert (collision.least, collision.largest) == pytest.approx((1, 1), abs=error)
    overlap = (gravity + np.sqrt(gravity**2 + 1e5 * (1 + 2 * gravity * start))) / 1e5
    assert collision.depth == pytest.approx(start + overlap, abs=error / 100)
    assert found.stepped == (step is not None)
    # A spring that begins within a step gains energy at some phases.
    gains = collision.largest > 1.01
    assert (found.falling, [text.startswith("eps is up to 1.") for text in found.warnings]) == (None, [True] * gains)


def test_an_unstable_step_is_warned_of():
    """Damping c/m h = 10 in one step: v becomes (1 - 10) v."""
    hertz = {"normal": "hertz", "coefficients": "1e7 100", "damping": "velocity", "units": "si"}
    found = delivered("lammps", hertz, mass=1e-5, radius=1e-3, step=1e-6)
    assert found.collision.epsilon == pytest.approx(9, abs=1e-3)
    assert "eps is up to 9, above 1: the bodies gain energy, as the time step is too long" in found.warnings


def test_an_impulse_above_one_is_warned_of():
    found = delivered("physx", {"restitution": "0.9"}, gravity=EARTH, step=0.0166)
    assert found.collision.epsilon > 1.05
    assert "eps is up to 1.06, above 1" in found.warnings[-1]


def test_a_contact_time_without_end_says_nothing_of_steps(monkeypatch):
    monkeypatch.setattr("viscopade.collision.contact.Contact.contact_time", lambda contact, speed: np.inf)
    found = delivered("newton", {"ke": "1e5", "kd": "1e3"}, mass=1.0, step=1e-3)
    assert (found.stepped, found.warnings) == (True, ())
    assert found.collision.epsilon == pytest.approx(0.1601, abs=5e-5)


def test_newton_with_weight_and_a_step():
    found = delivered("newton", {"ke": "1e5", "kd": "1e3"}, mass=1.0, step=1e-3)
    assert (found.collision.epsilon, found.falling.epsilon) == pytest.approx((0.1601, 0.1248), abs=5e-5)
    (weight,) = found.warnings
    assert "g t_c/v = 0.097, and eps = 0.1248" in weight  # 9.81 pi sqrt(1/1e5)


def test_attraction_that_is_cut_off_is_warned_of():
    """The force at rest is below 0 up to (0.02/1e6)^(2/3) m."""
    adhesion, hit = "1e6*x**1.5 - 0.02 + 3*sqrt(x)*v", {"speed": 0.05, "mass": 1e-4}
    for step in (None, 1e-5, 1e-9):
        (text, *_) = delivered(typed(adhesion, "force"), {}, step=step, **hit).warnings
        assert text.startswith("The force pulls at a compression of 7")
        assert text.endswith('e-06 m, which the end "force" cuts off: --end return')
    for other in (typed(adhesion, "return"), typed("1e6*x**1.5 + 3*sqrt(x)*v", "force")):
        assert not any("pulls" in text for text in delivered(other, {}, **hit).warnings)


def test_a_step_that_resolves_the_contact_is_suggested():
    given = {"solref": "-2500 -100", "solimp": "0.9 0.9 0.001", "condim": "1"}
    text = delivered("mujoco", given, 1.0, step=0.01, epsilon=0.5).warnings[-1]
    before, after = text.split(";")
    least, most = map(float, re.findall(r"0\.\d+", before)[1:])
    assert most - least > 0.02
    shorter = float(re.search(r'--time-step "([\d.]+) s"', after)[1])
    again = delivered("mujoco", given, 1.0, step=shorter, epsilon=0.5)
    assert not any("on average" in text for text in again.warnings)
    found = delivered("mujoco", {**given, **again.instead}, 1.0, step=shorter).collision
    assert found.epsilon == pytest.approx(0.5, abs=1e-5)
    assert 0.01 < found.largest - found.least < 0.02


def test_a_step_that_is_too_long_for_any_damping_is_said():
    texts = delivered("mujoco", {"solref": "-20000 -50"}, gravity=EARTH, step=0.02, epsilon=0.5).warnings
    assert re.fullmatch(
        r"No damping gives 0\.5: epsilon grows with the damping in time steps so long; "
        r'with a shorter step, --time-step "0\.000\d+ s", its range is below 0\.02',
        texts[-1],
    )


# --- falls in the real programs ---------------------------------------------------------------------------------------

NAMES = {"dissipation": "hunt_crossley_dissipation"}  # of Drake, whose Python has another name than its files
SCHEMES = {"continuous": "RungeKuttaMerson", "velocity Verlet": "verlet", "leapfrog": "NewtonIntegrator"}
AGREE = {("newton", "SolverSemiImplicit"): 1e-3, ("newton", "SolverXPBD"): 3e-4}  # in single precision
AGREE |= {("kratos", scheme): 3e-5 for scheme in simulator_of("kratos").native.schemes}  # its damping is good to 1e-4
RADII = {"kratos": 0.25, "simbody": None}  # effective ones
FALLS = falls()
WHICH = sorted({(fall.program, fall.scheme) for fall in FALLS})


def quick(i, fall):
    """Return whether a fall has not too many steps; of the programs with 0.01 ms every tenth that bounces."""
    if "_A=" in fall.parameters:  # two materials
        return True
    if fall.program in ("lammps", "liggghts", "yade"):
        return fall.mean > 0.2 and i % 10 == 2
    return not 0 < fall.time_step / fall.contact_time < (1 / 1100 if fall.mean else 1 / 100)


def of_file(fall):
    """Return the parameters of a fall as a user's file has them, and the effective radius."""
    named = {**fall.named}
    radius = float(named.pop("radius", 0)) or RADII.get(fall.program, RADIUS)
    named.pop("use_mujoco_contacts", None)
    for name in [name.removesuffix("_A") for name in named if name.endswith("_A")]:
        own = NAMES.get(name, name) if fall.program == "drake" else name
        named[own] = f"{named.pop(f'{name}_A')} {named.pop(f'{name}_B')}"
    if fall.program == "yade":
        named |= {"physics": "MindlinPhys" if "poisson" in named else "ViscElPhys", "other": "wall", "damping": "0"}
    native = simulator_of(fall.program).native
    named[native.integrator] = fall.scheme if fall.scheme in native.schemes else SCHEMES[fall.scheme]
    return named, radius


def assert_same(fall):
    """Compare mean, least and largest eps of a stored fall, whose contacts begin at the same phases."""
    native, (named, radius) = simulator_of(fall.program).native, of_file(fall)
    values = native.values(named)
    step = fall.time_step or None
    hit = Impact(fall.speed, fall.mass, radius, fall.gravity, step)
    scheme = native.schemes[values[native.integrator]] or SEMI_IMPLICIT
    phases = (np.arange(fall.phases) + 0.5) / fall.phases
    found = native.contact(values, hit).collide(fall.speed, step=step, scheme=scheme, phases=phases)
    measured = (fall.mean, fall.least, fall.largest)
    close = AGREE.get((fall.program, fall.scheme), 4e-6)
    assert (found.epsilon, found.least, found.largest) == pytest.approx(measured, abs=close), fall


@pytest.mark.parametrize("which", WHICH, ids="-".join)
def test_falls_in_the_real_programs(which):
    chosen = [fall for i, fall in enumerate(FALLS) if (fall.program, fall.scheme) == which and quick(i, fall)]
    assert chosen
    for fall in chosen:
        assert_same(fall)


@pytest.mark.slow
@pytest.mark.parametrize("which", WHICH, ids="-".join)
def test_all_falls_in_the_real_programs(which):
    for i, fall in enumerate(FALLS):
        if (fall.program, fall.scheme) == which and not quick(i, fall):
            assert_same(fall)


@pytest.mark.parametrize(("gravity", "measured"), [(0.0, (0.409676, 0.409723)), (EARTH, (0.363364, 0.363432))])
def test_yade_damps_with_its_integrator_too(gravity, measured):
    """Measured in YADE 2023.02a at two phases: en = 0.5, and the 0.2 that NewtonIntegrator has unless it is set."""
    given = {"physics": "MindlinPhys", "young": "2.2e5", "poisson": "0.3", "en": "0.5", "other": "wall"}
    found = delivered("yade", given, 1.0, 0.01, gravity, 1e-5, radius=0.01)
    assert (found.collision.least, found.collision.largest) == pytest.approx(measured, abs=5e-5)
    assert "NewtonIntegrator(damping=0.2) takes a part of eps" in found.warnings[0]
    assert delivered("yade", given | {"damping": "0"}, 1.0, 0.01, gravity, radius=0.01).collision.epsilon > 0.46


DEM = {
    "lammps": [
        {"normal": normal, "coefficients": coefficients, "damping": damping, "limit_damping": limited}
        for normal, coefficients, damping, limited in (
            ("hooke", "1e5 0.4", "tsuji", "no"),
            ("hooke", "1e5 1", "viscoelastic", "yes"),
            ("hertz", "1e6 1", "velocity", "no"),
            ("hertz/material", "1e6 1 0.3", "mass_velocity", "yes"),
        )
    ],
    "liggghts": [
        {"youngsModulus": "1e6 2e6", "poissonsRatio": "0.3", "coefficientRestitution": "0.6", "model": "hertz"},
        {"model": "hertz/stiffness", "kn": "1e6", "gamman": "1", "limitForce": "on"},
    ],
    "yade": [
        {"physics": "MindlinPhys", "young": "1e6", "poisson": "0.3", "en": "0.6"},
        {"physics": "MindlinPhys", "young": "1e6", "poisson": "0.3", "en": "0.6", "vn": "2", "damping": "0"},
        {"physics": "MindlinPhys", "young": "1e6", "poisson": "0.3", "betan": "0.1", "other": "facet", "damping": "0"},
        {"physics": "ViscElPhys", "tc": "0.01", "en": "0.6", "damping": "0"},
    ],
    "kratos": [
        {"law": law, "YOUNG_MODULUS": "1e6", "POISSON_RATIO": "0.3", "COEFFICIENT_OF_RESTITUTION": "0.6"}
        for law in ("DEM_D_Hertz_viscous_Coulomb", "DEM_D_Linear_viscous_Coulomb")
    ],
    "mercurydpm": [
        {"species": "LinearViscoelastic", "stiffness": "1e4", "dissipation": "1"},
        {"species": "HertzianBSHPViscoelastic", "effectiveElasticModulus": "1e6", "dissipation": "1e-4"},
        {"species": "HertzianViscoelastic", "effectiveElasticModulus": "1e6", "restitutionCoefficient": "0.7"},
    ],
    "chrono": [{"young_modulus": "1e6"}, {"use_material_properties": "false", "contact_force_model": "Hooke"}],
    "jaxdem": [{"young": "1e6", "e": "0.7"}],
}


@pytest.mark.parametrize(("program", "given"), [(name, given) for name, rows in DEM.items() for given in rows])
def test_what_is_written_instead_delivers_the_wanted_eps_in_dem_programs(program, given):
    hit = {"mass": 0.01, "radius": 0.02, "gravity": EARTH}
    instead = delivered(program, given, 2.0, epsilon=0.45, **hit).instead
    found = delivered(program, given | instead, 2.0, **hit)
    assert found.collision.epsilon == pytest.approx(0.45, abs=1e-6)


MERCURY, MATERIAL = {"species": "LinearViscoelastic", "restitutionCoefficient": "0.5"}, {"restitution": "0.5"}
TIMED = {"collisionTime": "1e-2", "particleMass": "0.02"}
HERTZ = {"effectiveElasticModulus": "1e6", "species": "HertzianViscoelastic"}
WITHOUT = {"use_material_properties": "false"}
ZETA = float(tsuji_kappa(mp.mpf("0.5"))) / np.sqrt(5)
FORCE, LIGHTER = (np.exp(-2 * zeta * np.arccos(zeta) / np.sqrt(1 - zeta**2)) for zeta in (ZETA, ZETA / np.sqrt(2)))
AT_WALL = np.exp(-np.pi * ZETA / np.sqrt(2 - ZETA**2))


@pytest.mark.parametrize(
    ("program", "given", "epsilon"),
    [
        ("mercurydpm", MERCURY | TIMED, 0.5),
        ("mercurydpm", MERCURY | {"stiffness": "1e4", "particleMass": "0.02"}, 0.5),
        ("mercurydpm", MERCURY | TIMED | {"particleMass": "0.01"}, AT_WALL),  # made for half of the effective mass
        ("mercurydpm", HERTZ | {"restitutionCoefficient": "0.5"}, 0.5),
        ("mercurydpm", HERTZ | {"dissipation": repr(float(tsuji_kappa(mp.mpf("0.5"))))}, 0.5),
        ("chrono", MATERIAL, FORCE),
        ("chrono", MATERIAL | {"contact_force_model": "PlainCoulomb"}, FORCE),
        ("chrono", MATERIAL | {"contact_force_model": "Hooke"}, FORCE),
        ("chrono", MATERIAL | {"restitution": "0.5 0.9", "contact_force_model": "Flores"}, FORCE),
        ("chrono", MATERIAL | {"fixed_body_mass": "1e9"}, FORCE),
        ("chrono", MATERIAL | {"fixed_body_mass": "0.01"}, LIGHTER),  # c knows half of the mass
        (
            "chrono",
            WITHOUT
            | {"contact_force_model": "Hooke", "kn": "100", "gn": repr(100 * float(force_end_kappa(mp.mpf("0.5"))))},
            0.5,
        ),
        ("jaxdem", {"young": "1e6 3e6", "e": "0.5 0.7"}, FORCE),
    ],
)
def test_what_the_source_says(program, given, epsilon):
    found = delivered(program, given, 2.0, 0.01, radius=0.02).collision
    assert found.epsilon == pytest.approx(epsilon, abs=1e-8)


@pytest.mark.parametrize(
    ("law", "scheme", "measured"),
    [
        ("Hertz", "Forward_Euler", (0.553259899, 0.551701171, 0.555933646, 0.0046666542)),
        ("Linear", "Symplectic_Euler", (0.494215095, 0.476677597, 0.514146961, 0.0013899181)),
        ("Linear", "Forward_Euler", (0.649436101, 0.627953185, 0.673173145, 0.0016605098)),
    ],
)
def test_kratos_at_a_wall(law, scheme, measured):
    """Measured in Kratos 10.4.4: mean, least and largest of eight phases, and the mean depth."""
    native = simulator_of("kratos").native
    given = {"YOUNG_MODULUS": "1e6", "POISSON_RATIO": "0", "COEFFICIENT_OF_RESTITUTION": "0.5", "other": "wall"}
    values = native.values({**given, "law": f"DEM_D_{law}_viscous_Coulomb"})
    contact = native.contact(values, Impact(1.0, 1.0, 0.5, step=3.26e-4))
    found = contact.collide(1.0, step=3.26e-4, scheme=native.schemes[scheme], phases=(np.arange(8) + 0.5) / 8)
    assert (found.epsilon, found.least, found.largest, found.depth) == pytest.approx(measured, abs=2e-5, rel=1e-5)


@pytest.mark.parametrize("integrator", ["verlet", "euler"])
def test_jaxdem_in_time_steps(integrator):
    """Measured in JaxDEM at commit 5d9c13a, in double precision: mean, least and largest of eight phases."""
    native = simulator_of("jaxdem").native
    values = native.values({"young": "1e6", "e": "0.5", "linear_integrator_type": integrator})
    contact = native.contact(values, Impact(1.0, 0.01, 0.01, step=1e-4))
    scheme = native.schemes[integrator]
    found = contact.collide(1.0, step=1e-4, scheme=scheme, phases=(np.arange(8) + 0.5) / 8)
    measured = (0.5461662605438579, 0.5316468671435074, 0.56209597255386)
    assert (found.epsilon, found.least, found.largest) == pytest.approx(measured, abs=1e-12)


def test_parameters_of_dem_programs_mean_what_they_say():
    viscoelastic = {"species": "HertzianBSHPViscoelastic", "effectiveElasticModulus": "1e6", "dissipation": "1e-3"}
    bshp = delivered("mercurydpm", viscoelastic, 2.0, 0.01, radius=0.02).collision
    kn, eta = 4e6 / 3, 2 * 1e-3 * 1e6 / 0.01
    line = {"normal": "hertz", "coefficients": f"{kn!r} {eta!r}", "limit_damping": "yes"}
    assert delivered("lammps", line, 2.0, 0.01, radius=0.02).collision.epsilon == pytest.approx(bshp.epsilon, abs=1e-9)
    stiffness = {"model": "hertz/stiffness", "kn": repr(kn), "gamman": repr(eta), "limitForce": "on"}
    found = delivered("liggghts", stiffness, 2.0, 0.01, radius=0.02).collision
    assert (found.epsilon, found.depth) == pytest.approx((bshp.epsilon, bshp.depth), rel=1e-9)
    cgs = {**line, "units": "cgs", "coefficients": f"{10 * kn!r} {eta / 100!r}"}
    found = delivered("lammps", cgs, 2.0, 0.01, radius=0.02)
    assert (found.collision.epsilon, found.collision.depth) == pytest.approx((bshp.epsilon, 100 * bshp.depth), rel=1e-9)
    assert found.units.length == "cm"
    assert not delivered("lammps", line, 0.01, 0.01, radius=0.02).warnings  # lj: nothing is known of weight
    k = 4 * 0.02 / (1 / 1e6 + 1 / 3e6)
    found = delivered("jaxdem", {"young": "1e6 3e6", "e": "1"}, 2.0, 0.01, radius=0.02).collision
    assert found.depth == pytest.approx(2 * np.sqrt(0.01 / k), rel=1e-9)


@pytest.mark.parametrize(
    ("program", "given", "message"),
    [
        (
            "lammps",
            {"normal": "hertz", "coefficients": "1e5 1 0.3"},
            "coefficients is 3 numbers: expected for hertz k_n",
        ),
        (
            "lammps",
            {"normal": "hertz/material", "coefficients": "1 1"},
            "hertz/material E, damping coefficient and nu",
        ),
        ("lammps", {"normal": "hooke", "coefficients": "1e5 1.5", "damping": "tsuji"}, "an eps > 0 and <= 1"),
        ("lammps", {"normal": "hertz/material", "coefficients": "1e5 1 0.6"}, "a nu up to 1/2"),
        ("lammps", {"coefficients": "1e5 1"}, "normal is not set"),
        (
            "lammps",
            {"normal": "mdr", "coefficients": "1e5 1"},
            "normal is 'mdr': expected hooke, hertz, hertz/material",
        ),
        ("liggghts", {"model": "hertz", "coefficientRestitution": "0.05"}, "a number > 0.05 and <= 1"),
        ("yade", {"physics": "MindlinPhys", "young": "1e6", "poisson": "0.3"}, "en and betan: expected one of them"),
        ("mercurydpm", MERCURY | {"dissipation": "1"}, "expected one of them"),
        ("mercurydpm", MERCURY, "particleMass is not set"),
        ("mercurydpm", {"dissipation": "-1"}, "a number >= 0: in N s/m if LinearViscoelastic, without unit if"),
        ("mercurydpm", {"alpha": "1"}, "dissipation (a number >= 0: in N s/m if LinearViscoelastic, without unit if"),
        ("chrono", {"kn": "0"}, "kn is '0': expected a number > 0: in N/m if Hooke or Flores, N/m^(5/2) if Hertz,"),
        (
            "chrono",
            {"stiffness": "1"},
            "gn (a number >= 0: in 1/s if Hooke or Flores, 1/(s m^(3/2)) if Hertz, N s/m^(3/2) if",
        ),
        ("kratos", {"law": "DEM_D_JKR"}, "law is 'DEM_D_JKR': expected DEM_D_Hertz"),
        ("jaxdem", {"young": "0", "e": "0.5"}, "young is '0': expected a number > 0, in Pa"),
        ("chrono", {"poisson_ratio": "0.6"}, "poisson_ratio is '0.6': expected from -1 to 1/2"),
        ("rebound", {"coefficient_of_restitution": "1.1"}, "expected a number > 0 and <= 1"),
    ],
)
def test_wrong_parameters_of_dem_programs(program, given, message):
    with pytest.raises(ValueError) as error:
        delivered(program, given, mass=0.01, radius=0.02)
    assert message in str(error.value)


@pytest.mark.parametrize(("rate", "e", "speed"), [(0, 0.5, 1.0), (300, 0.5, 1.0), (1000, 0.5, 1.0), (1000, 0.9, 0.1)])
def test_the_rule_of_rebound(rate, e, speed):
    """A rate times the overlap at the end of a step: it may add much energy."""
    given = {"coefficient_of_restitution": str(e), "minimum_collision_velocity": str(rate), "integrator": "leapfrog"}
    native, step, phases = simulator_of("rebound").native, 0.01, np.array([0.125, 0.375, 0.625, 0.875])
    found = native.contact(native.values(given), Impact(speed, None, 0.5, step=step)).epsilon(phases)
    assert found == pytest.approx(np.maximum(e, rate * step * (1 - phases) - 1))
    with pytest.raises(ValueError, match="REBOUND has no walls"):
        delivered("rebound", given, gravity=EARTH)
    rebound = pytest.importorskip("rebound")
    for phase, epsilon in zip(phases, found, strict=True):
        sim = rebound.Simulation()
        sim.G, sim.dt, sim.integrator, sim.collision = 0, step, "leapfrog", "direct"
        sim.collision_resolve, sim.minimum_collision_velocity = "hardsphere", rate
        sim.coefficient_of_restitution = lambda *_: e
        for side in (-1, 1):
            sim.add(m=1, r=1, x=side * (1 + phase * step * speed / 2), vx=-side * speed / 2)
        sim.steps(2)
        assert (sim.particles[1].vx - sim.particles[0].vx) / speed == pytest.approx(epsilon, rel=1e-9)


def newton_epsilon(ke, kd, mass=1.0):
    return delivered("newton", {"ke": repr(float(ke)), "kd": repr(float(kd))}, mass=mass).collision.epsilon


# 0.5973425 is the zeta of eps = 1/2; ke = 1e5 N/m, kd = 1e3 N s/m and 1 kg have zeta = sqrt(2.5), and eps = 0.263964.
@pytest.mark.parametrize("zeta", [0.05, 0.5973425, 0.95, np.sqrt(2.5)])
def test_newtons_damping_of_the_approach_has_its_closed_form(zeta):
    """Only the approach is damped: eps is the greatest x of x'' + 2 zeta x' + x = 0, x(0) = 0, x'(0) = 1."""
    w, ke, mass = np.sqrt(abs(1 - zeta**2)), 1e5, 3.0
    # The time of x' = 0, where x is e^(-zeta t).
    turning = (np.arctan2(w, zeta) if zeta < 1 else np.arctanh(w / zeta)) / w
    assert newton_epsilon(ke, 2 * zeta * np.sqrt(ke * mass), mass) == pytest.approx(np.exp(-zeta * turning), abs=1e-9)


def test_newton_gets_the_damping_of_one_half():
    """Two bodies have the mean of their ke, 2e5, and eps = 1/2 needs kd = 2 zeta sqrt(ke m), 2 zeta = 1.19468."""
    instead = delivered("newton", {"ke": "1e5 3e5"}, mass=1.0, epsilon=0.5).instead
    assert float(instead["kd"]) == pytest.approx(1.19468 * np.sqrt(2e5), rel=1e-5)


@pytest.mark.parametrize("kd", [1e-3, 0.5, 2, np.sqrt(10), 30])  # zeta = kd/2 is below, at and above 1
def test_newtons_formula_is_the_sampled_contact(kd):
    formula = simulator_of("newton").formula("SolverSemiImplicit, damping of the approach")
    assert float(formula.contact_epsilon(formula.kappa(mp.mpf(kd)))) == pytest.approx(newton_epsilon(1, kd), rel=1e-8)


def test_newton_has_other_units_with_the_solver_of_mujoco():
    """k/m in 1/s^2 and c/m in 1/s: 1e5 N/m of 2 kg is 5e4 1/s^2."""
    solver = {"solver": "SolverMuJoCo"}
    plain, units = ({"ke": "5e4", "kd": "50"}, {"ke": "0.05 1/ms^2", "kd": "50 1/s"})
    assert delivered("newton", plain | solver).collision == delivered("newton", units | solver).collision
    springs = {"ke": "100 N/mm", "kd": "100 N s/m"}
    for settings, accepted in ((springs | solver, r"in 1/s\^2"), (units, "in N/m")):
        with pytest.raises(ValueError, match=accepted):
            delivered("newton", settings, mass=2.0)
    with pytest.raises(ValueError, match=r"ke \(a number > 0, N/m or 1/s\^2 with SolverMuJoCo, one for"):
        delivered("newton", {"stiffness": "1"})


def test_newton_without_damping_has_the_default_of_mujoco():
    solver = {"solver": "SolverMuJoCo"}
    assert delivered("newton", {**solver, "kd": "0"}).collision == delivered("mujoco", {}).collision
    instead = delivered("newton", {**solver, "ke": "7672", "kd": "0"}, epsilon=0.5).instead
    found = delivered("newton", {**solver, "ke": "7672", **instead}, mass=5.0)
    assert found.collision.epsilon == pytest.approx(0.5, abs=1e-8)


def test_the_rule_of_xpbd():
    settings = {"solver": "SolverXPBD", "restitution": "0.4 0.6", "enable_restitution": "True"}
    assert delivered("newton", settings).collision.epsilon == 0.5
    assert delivered("newton", settings | {"enable_restitution": "False"}).collision.epsilon == 0
    falls = delivered("newton", settings, speed=0.015, gravity=EARTH, step=1e-3).collision
    assert (falls.epsilon, falls.parts) == (0, False)
    assert delivered("newton", settings, epsilon=0.7, gravity=EARTH).instead == {"restitution": "0.7"}
    off = delivered("newton", settings | {"enable_restitution": "False"}, epsilon=0.7)
    assert off.instead == {"restitution": "0.7", "enable_restitution": "True"}
    assert off.warnings == ("enable_restitution is off, the default: SolverXPBD then ignores restitution",)
    assert delivered("newton", settings, gravity=EARTH, step=1e-3).warnings == ()


def test_stiff_contacts_of_drake_are_warned_of():
    stiff = {"point_stiffness": "1e9", "discrete_contact_approximation": "sap", "relaxation_time": "0"}
    (text,) = delivered("drake", stiff, mass=1.0, gravity=EARTH, step=3e-4).warnings[:1]
    assert "softened by Drake's approximation sap" in text
    with pytest.raises(ValueError, match="continuous chooses its own steps; expected with one --scheme lagged"):
        delivered("drake", {"discrete_contact_approximation": "continuous"}, mass=1.0, step=1e-3)


# --- parameters -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"mass": "1"}, "there is no parameter 'mass': expected solref (timeconst"),
        ({"solRef": "0.02 1"}, "there is no parameter 'solRef': did you mean solref?"),
        ({"solref": "1 -1"}, "solref is '1 -1': expected timeconst (in s) and dampratio > 0, or"),
        ({"solref": "nan 1"}, "solref is 'nan 1'"),
        ({"solref": "0.02, 1"}, "solref is '0.02, 1': expected numbers apart by spaces, and at most one comma"),
        ({"solref": "0.02 1, 0.02 1, 1 1"}, "and at most one comma, between both bodies"),
        ({"priority": "0 0.5"}, "priority is '0 0.5': expected an integer"),
        ({"solref": "1e999 1"}, "solref is '1e999 1'"),
        ({"solref": ""}, "solref is ''"),
        ({"friction": "1 1 1 1"}, "friction is '1 1 1 1': expected"),
        ({"friction": "-1"}, "friction is '-1': expected"),
        ({"condim": "2"}, "condim is '2': expected 1, 3, 4 or 6"),
        ({"integrator": "Verlet"}, "integrator is 'Verlet': expected Euler, RK4, implicit, implicitfast"),
        ({"solref": "-0.0 -1"}, "solref is '-0.0 -1'"),
    ],
)
def test_wrong_parameters(settings, message):
    with pytest.raises(ValueError) as error:
        delivered("mujoco", settings)
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_numbers_may_have_units():
    one, two = Parameter("young", "Pa", default="1e9"), Parameter("both", "N/m", default="1 2", max_numbers=2)
    assert one.value("70 GPa") == one.value("7e10") == 7e10
    assert two.value("3 kN/m, 4 N/m") == (3000, 4)
    assert two.value("3") == (3, 2)
    assert two.text(two.value("3, 4")) == "3 4"
    for wrong in ("70 kg", "1 GPa, 2 GPa", "-1", "x"):
        with pytest.raises(ValueError, match="expected a number >= 0, in Pa"):
            one.value(wrong)


def test_what_is_missing_is_asked_for():
    contact = typed("1e5*x", "force")
    with pytest.raises(ValueError, match="mass is missing: expected --mass"):
        delivered(contact, {})
    with pytest.raises(ValueError, match="force does not stop a body"):
        delivered(typed("-x", "force"), {}, mass=1.0)
    with pytest.raises(ValueError, match="k is not set"):
        delivered(Native((Parameter("k"),), lambda values, _: values["k"], ""), {})


# --- forces that are typed --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("formula", "value"),
    [
        ("1e5*x + 1e3*max(v, 0)", 600.0),
        ("-x**2 - -3*v/2", 0.75 - 1e-6),
        ("min(x, v, 2) + abs(-v)", 0.501),
        ("sqrt(4*exp(0)) + where(x < 1e-2, 1, 2) + where(v >= x, 10, 20)", 13.0),
        ("step(x, 0, 0, 2e-3, 8)", 4.0),
        ("step(x, 2e-3, 5, 3e-3, 8) + step(x, 0, 0, 5e-4, 8)", 13.0),
        (" 7 ", 7.0),
    ],
)
def test_formulas_are_computed(formula, value):
    found = force(formula)(np.full(3, 1e-3), np.full(3, 0.5))
    assert found == pytest.approx(np.full(3, value))


@pytest.mark.parametrize(
    "formula",
    [
        *("", "x +", "y", "x; v", "where(x, 1, 2)", "where(x == 1, 1, 2)", "where(1 < x < 2, 1, 2)", "max(x)"),
        *("sqrt(x, v)", "'x'", "True", "1j", "f(x)", "number0", "max(x, number0)", "1 + number0", "x @ v", "not x"),
        *("__import__('os')", "max(x, v, key=abs)", "x = 1", "1" + "0" * 400, "x" * 3000, "~x"),
        *("(" * 300 + "x" + ")" * 300, "-" * 100 + "x", "x\0", "x // 2", "x % 2", "min(" * 60 + "x, 1" + ", 1)" * 60),
    ],
)
def test_wrong_formulas_get_one_line(formula):
    with pytest.raises(ValueError) as error:
        force(formula)
    assert str(error.value).startswith("force has ")
    assert "expected numbers, x, v, names of --constant, + - * / **" in str(error.value)
    assert "\n" not in str(error.value)


# A formula with each node of an expression that CPython's parser knows, except for those that forces have.
REFUSED_NODES = {
    "Attribute": "x.real",
    "Await": "await x",
    "BoolOp": "x and v",
    "Compare": "x < 1",
    "Dict": "{x: v}",
    "DictComp": "{x: v for x in v}",
    "FormattedValue": "f'{x}'",
    "GeneratorExp": "max(x for x in v)",
    "IfExp": "x if v else 1",
    "JoinedStr": "f'{x}'",
    "Lambda": "lambda: x",
    "List": "[x]",
    "ListComp": "[x for x in v]",
    "NamedExpr": "(y := 1)",
    "Set": "{x}",
    "SetComp": "{x for x in v}",
    "Slice": "x[1:2]",
    "Starred": "max(*x, v)",
    "Subscript": "x[0]",
    "Tuple": "x, v",
    "Yield": "(yield x)",
    "YieldFrom": "(yield from x)",
    "Interpolation": "t'{x}'",
    "TemplateStr": "t'{x}'",
}


def test_all_other_nodes_of_python_are_refused():
    of_python = {kind.__name__ for kind in ast.expr.__subclasses__()}
    assert of_python <= {*REFUSED_NODES, "BinOp", "UnaryOp", "Constant", "Name", "Call"}
    for formula in REFUSED_NODES.values():
        with pytest.raises(ValueError, match="force has"):
            force(formula)


@pytest.mark.parametrize("formula", ["10**10**10", "x/0", "sqrt(-1)*x", "0", "-1e5*x"])
def test_forces_that_stop_no_body_are_refused(formula):
    with pytest.raises(
        ValueError, match=r"force (does not stop a body of mass 1|cannot be integrated at compression 0)"
    ):
        delivered(typed(formula, "force"), {}, mass=1.0)


def test_steep_forces_are_integrated():
    found = delivered(typed("x**40*1e100", "force"), {}, mass=1.0).collision
    assert found.epsilon == pytest.approx(1, abs=1e-9)


def test_a_typed_force_is_a_contact():
    """Damping of the approach only: with zeta = kd/(2 sqrt(ke m)), eps = exp(-(zeta/w) atan(w/zeta))."""
    zeta = 1e3 / 2 / np.sqrt(1e5)
    with pytest.raises(ValueError, match="there is no parameter"):
        delivered(typed("x", "force"), {"k": "1"}, mass=1.0)
    assert zeta > 1
    found = delivered(typed("1e5*x + 378*max(v, 0)", "force"), {}, mass=1.0, epsilon=0.5)
    zeta = 378 / 2 / np.sqrt(1e5)
    w = np.sqrt(1 - zeta**2)
    assert found.collision.epsilon == pytest.approx(np.exp(-zeta / w * np.arctan2(w, zeta)), abs=1e-9)
    assert found.instead is None
    assert "nothing to write instead" in found.warnings[-1]


IMPACT = "max(0, 1e5*x**1.5 + step(x, 0, 0, 1e-4, c)*v)"


def impact_of_adams(x, v, c):
    """Return the force of an IMPACT with stiffness 1e5, exponent 1.5, and damping from 0 to 0.1 mm."""
    part = min(max(x, 0) / 1e-4, 1)
    return max(0, 1e5 * max(x, 0) ** 1.5 + c * (3 * part**2 - 2 * part**3) * v)


@pytest.mark.parametrize("wanted", [0.9, 0.5, 0.1])
@pytest.mark.parametrize("constant", ["c=1e4", "c = 0.01 kN s/mm", "c=0"])
def test_the_damping_of_an_impact_gives_the_wanted_eps(wanted, constant):
    """SciPy's integration of a body of 1 kg at 1 m/s, up to where x = 0 again."""
    found = delivered(typed(IMPACT, "force", [constant], "c"), {}, mass=1.0, epsilon=wanted)
    c = float(found.instead["c"])
    parts = lambda t, y: y[0] + 1e-15 * (t == 0)  # noqa: E731
    parts.terminal, parts.direction = True, -1
    motion = solve_ivp(
        lambda t, y: (y[1], -impact_of_adams(*y, c)), (0, 1), (0, 1), "Radau", events=parts, rtol=1e-9, atol=1e-12
    )
    assert -motion.y_events[0][0][1] == pytest.approx(wanted, abs=2e-7)


def test_constants_are_in_si_units():
    """10 kN s/mm is 1e7 N s/m, 3 N/cm^(3/2) is 3000 N/m^(3/2)."""
    native = typed("k*x**1.5 + c*v", "force", ["c=10 kN s/mm", "k = 3 N/cm^(3/2)"])
    assert native.values({}) == {"c": 1e7, "k": pytest.approx(3000), "scheme": "semi-implicit-euler"}


@pytest.mark.parametrize(
    ("formula", "wanted", "said"),
    [
        ("1e5*x + max(k*v, -5)", 1e-4, None),  # damping of the approach alone has no least eps
        ("k*x + 100*v", 0.9, "No damping gives 0.9: epsilon grows with the damping"),
        ("k*x + 100*v", 0.3, "No damping gives 0.3: epsilon grows with the damping"),
        ("1e5*x + 100*v + min(k, 10)*max(v, 0)", 0.3, "expected at least 0.6"),
    ],
)
def test_a_constant_that_gives_no_such_eps(formula, wanted, said):
    found = delivered(typed(formula, "force", ["k=1e5"], "k"), {}, mass=1.0, epsilon=wanted)
    assert (found.instead is None) == (said is not None)
    assert said is None or said in found.warnings[-1]
