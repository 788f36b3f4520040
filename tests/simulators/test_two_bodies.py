"""Two bodies with different parameters: the rules of programs, and eps from the force as their sources have it."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from viscopade.simulators import simulator_of
from viscopade.simulators.native import Impact, delivery

MASS, RADIUS, SPEED = 0.01, 0.01, 1.0  # effective ones


def delivered(program, settings, mass=MASS, **impact):
    native = simulator_of(program).native
    epsilon = impact.pop("epsilon", None)
    return delivery(native, settings, Impact(SPEED, mass, RADIUS, **impact), epsilon)


def integrated(force, mass=MASS, *, clipped):
    """Return eps and depth of m x'' = -F(x, x') by SciPy, up to F = 0 if the program clips the force, or to x = 0."""

    def motion(_, state):
        x, v = state
        return v, -(force(max(x, 0.0), v)) / mass

    def end(_, state):
        x, v = state
        return force(max(x, 0.0), v) if clipped and v < 0 else x + (v > 0)

    def deepest(_, state):
        return state[1]

    end.terminal, end.direction = True, -1
    solution = solve_ivp(motion, (0, 10), (1e-15, SPEED), events=(end, deepest), rtol=1e-11, atol=1e-14, max_step=2e-4)
    return -solution.y[1, -1] / SPEED, solution.y_events[1][0][0]


def ratio(e):
    return -math.log(e) / math.hypot(math.pi, math.log(e))


def linear(k, c):
    return lambda x, v: k * x + c * v


def hertz(k, c, power):
    return lambda x, v: k * x**1.5 + c * x**power * v


def tsuji(k, zeta):
    """Return Hertz' spring with the damping 2 zeta sqrt(m kn) x', kn = 5/4 k sqrt(x)."""
    return hertz(k, 2 * zeta * math.sqrt(1.25 * MASS * k), 0.25)


def modulus(young, poisson):
    return 1 / sum((1 - nu**2) / e for e, nu in zip(young, poisson, strict=True))


def thornton(e):
    """Return betan of equations (B6) and (B7) of Thornton, Cummins and Cleary (2013), the fit of YADE and Kratos."""
    fit = (-6.918798, -16.41105, 146.8049, -796.4559, 2928.711, -7206.864, 11494.29, -11342.18, 6276.757, -1489.915)
    alpha = sum(h * e**i for i, h in enumerate(fit, 1))
    return math.sqrt(1 / (1 - (1 + e) ** 2 * math.exp(alpha)) - 1)


def cn_from_en(en, m, kn):
    """Return cn as YADE's `find_cn_from_en` and `get_en_from_cn` do, with their differences instead of a derivative."""
    eps = 1e-8

    def en_of(cn):
        beta, omega0 = cn / m / 2, math.sqrt(kn / m)
        if beta > omega0:
            large = math.sqrt(beta**2 - omega0**2)
            return math.exp(-beta / large * math.log((beta + large) / (beta - large)))
        omega = math.sqrt(omega0**2 - beta**2)
        angle = math.atan(2 * beta * omega / (omega**2 - beta**2))
        return math.exp(-beta / omega * ((math.pi if beta < omega0 / math.sqrt(2) else 0) - angle))

    cn = eps
    while abs(en_of(cn) - en) / en > 1e-2:
        cn -= (en_of(cn) - en) / ((en_of(cn - eps) - en_of(cn + eps)) / (-2 * eps))
    return cn


E_1, E_2 = 1e6, 3e6
NU_1, NU_2 = 0.2, 0.4
K = 4 / 3 * modulus((E_1, E_2), (NU_1, NU_2)) * math.sqrt(RADIUS)
MODULI = "1e6 3e6", "0.2 0.4"
MASSLESS = math.log(0.5) ** 2 + math.pi**2  # k t_c^2/m for e = 0.5


def harmonic(a, b):
    return 2 * a * b / (a + b)


def mercury(e, time, mass):
    """Return stiffness and dissipation that `setCollisionTimeAndRestitutionCoefficient` leaves."""
    return mass / 2 * (math.pi**2 + math.log(e) ** 2) / time**2, -mass / time * math.log(e)


(K_1, C_1), (K_2, C_2) = mercury(0.9, 5e-3, 0.02), mercury(0.4, 8e-3, 0.03)
KNS = 2 * E_1 * 2 * RADIUS, 2 * E_2 * 2 * RADIUS  # of two equal spheres, whose radii are twice the effective one
MFIX = "E_YOUNG", "V_POISSON"
YADE = {"physics": "ViscElPhys", "damping": "0"}
HALVES = [s ** (2 / 3) for s in (1e6, 4e6)]
SIMBODY = HALVES[0] * HALVES[1] / sum(HALVES)

# Program, settings, force, whether it is clipped, and the beginnings of sentences.
CASES = {
    "yade tc": (
        ("yade", YADE | {"tc": "0.01 0.03", "en": "0.9 0.1"}),
        linear(MASS / 0.02**2 * MASSLESS, -2 * MASS / 0.02 * math.log(0.5)),
        True,
        ("en = 0.5, the mean of 0.9 and 0.1 (Ip2_ViscElMat", "tc = 0.02, the mean of 0.01 and 0.03 ("),
    ),
    "yade young": (
        ("yade", YADE | {"young": "1e6 3e6", "en": "0.95 0.65"}),
        linear(KNS[0] * KNS[1] / sum(KNS), cn_from_en(0.8, MASS, KNS[0] * KNS[1] / sum(KNS))),
        True,
        ("en = 0.8, the mean of", "kn = 30000, half of the harmonic mean of 2 young R, 40000 and 120000 (contactParam"),
    ),
    "yade young wall": (
        ("yade", YADE | {"young": "1e6 3e6", "en": "0.3", "other": "wall"}),
        linear(1.5e4, cn_from_en(0.3, MASS / 2, 1.5e4)),  # 2 E R of both is 2e4 and 6e4
        True,
        ("kn = 15000, half of the harmonic mean of 2 young R, 20000 and 60000 (",),
    ),
    "yade young facet": (
        ("yade", YADE | {"young": "1e6 3e6", "en": "0.9", "other": "facet"}),
        linear(1 / (1 / 2e4 + 1 / 1.2e5), cn_from_en(0.9, MASS / 2, 1 / (1 / 2e4 + 1 / 1.2e5))),
        True,
        ("kn = 17142.857, half of the harmonic mean of 2 young R, 20000 and 120000 (",),
    ),
    "yade Mindlin": (
        ("yade", {"physics": "MindlinPhys", "young": MODULI[0], "poisson": MODULI[1], "en": "0.6", "damping": "0"}),
        hertz(K, 2 * thornton(0.6) * math.sqrt(1.5 * MASS * K), 0.25),
        True,
        (f"E_eff = {modulus((E_1, E_2), (NU_1, NU_2)):.8g}, half of the harmonic mean of E/(1 - nu^2), 1041666.7 and",),
    ),
    "kratos": (
        (
            "kratos",
            {
                "law": "DEM_D_Hertz_viscous_Coulomb",
                "YOUNG_MODULUS": MODULI[0],
                "POISSON_RATIO": MODULI[1],
                "COEFFICIENT_OF_RESTITUTION": "0.6",
            },
        ),
        hertz(K, 2 * thornton(0.6) * math.sqrt(1.5 * MASS * K), 0.25),
        True,
        ("E_eff = ",),
    ),
    "mercurydpm": (
        (
            "mercurydpm",
            {
                "species": "LinearViscoelastic",
                "collisionTime": "5e-3 8e-3",
                "restitutionCoefficient": "0.9 0.4",
                "particleMass": "0.02 0.03",
            },
        ),
        linear(harmonic(K_1, K_2), harmonic(C_1, C_2)),
        False,
        (
            f"stiffness = {harmonic(K_1, K_2):.8g}, the harmonic mean of {K_1:.8g} and {K_2:.8g} (LinearViscoelasticN",
            f"dissipation = {harmonic(C_1, C_2):.8g}, the harmonic mean of",
        ),
    ),
    "mercurydpm Hertz": (
        (
            "mercurydpm",
            {
                "species": "HertzianViscoelastic",
                "effectiveElasticModulus": "1e6 3e6",
                "restitutionCoefficient": "0.9 0.4",
            },
        ),
        hertz(
            2e6 * math.sqrt(RADIUS),
            harmonic(*(math.sqrt(5) * ratio(e) for e in (0.9, 0.4))) * math.sqrt(MASS * 2e6 * math.sqrt(RADIUS)),
            0.25,
        ),
        False,
        ("effectiveElasticModulus = 1500000, the harmonic mean of 1000000 and 3000000 (", "dissipation = "),
    ),
    "mercurydpm BSHP": (
        (
            "mercurydpm",
            {
                "species": "HertzianBSHPViscoelastic",
                "effectiveElasticModulus": "1e6 3e6",
                "dissipation": "2e-3 6e-3",
            },
        ),
        hertz(2e6 * math.sqrt(RADIUS), 1.5 * 3e-3 * 2e6 * math.sqrt(RADIUS), 0.5),
        True,
        ("dissipation = 0.003, the harmonic mean of 0.002 and 0.006 (",),
    ),
    "chrono": (
        ("chrono", {"young_modulus": MODULI[0], "poisson_ratio": MODULI[1], "restitution": "0.9 0.5"}),
        tsuji(K, ratio(0.5)),
        True,
        ("restitution = 0.5, the smaller of 0.9 and 0.5 (ChContactMaterialCompositeSMC)", "E_eff = "),
    ),
    "chrono kn": (
        (
            "chrono",
            {"contact_force_model": "Hooke", "use_material_properties": "false", "kn": "1e5 3e5", "gn": "500 700"},
        ),
        linear(2e5, 600 * MASS),
        True,
        ("kn = 200000, the mean of", "gn = 600, the mean of"),
    ),
    "drake": (
        (
            "drake",
            {
                "point_stiffness": "3e4 6e4",
                "hunt_crossley_dissipation": "3 0",
                "discrete_contact_approximation": "continuous",
            },
        ),
        lambda x, v: 2e4 * x * (1 + 2 * v),
        True,
        (
            "point_stiffness = 20000, half of the harmonic mean of 30000 and 60000 (GetCombinedPointContactStiffness)",
            "hunt_crossley_dissipation = 2, the mean, weighted by the other body's stiffness, of 3 and 0 (",
        ),
    ),
    "drake sap": (
        (
            "drake",
            {
                "point_stiffness": "3e4 6e4",
                "relaxation_time": "1e-4 3e-4",
                "discrete_contact_approximation": "sap",
            },
        ),
        linear(2e4, 2e4 * 4e-4),
        True,
        ("relaxation_time = 0.0004, the sum of 0.0001 and 0.0003 (",),
    ),
    "simbody": (
        ("simbody", {"stiffness": "1e6 4e6", "dissipation": "0.5 2"}),
        lambda x, v: (
            4
            / 3
            * SIMBODY
            * x
            * math.sqrt(RADIUS * SIMBODY * x)
            * (1 + 1.5 * (0.5 * HALVES[1] + 2 * HALVES[0]) / sum(HALVES) * v)
        ),
        True,
        ("dissipation = ", "stiffness^(2/3) = "),
    ),
    "newton": (
        ("newton", {"ke": "1e4 3e4", "kd": "10 20"}),
        lambda x, v: 2e4 * x + 15 * max(v, 0.0),
        False,
        ("ke = 20000, the mean of", "kd = 15, the mean of 10 and 20 (_eval_body_contact)"),
    ),
    "mfix": (
        (
            "mfix",
            {"UNITS": "SI", "DES_COLL_MODEL": "HERTZIAN", **dict(zip(MFIX, MODULI, strict=True))}
            | {"DES_EN_INPUT": "0.6"},
        ),
        hertz(K, 2 * ratio(0.6) * math.sqrt(MASS * K), 0.25),
        False,
        (f"E_eff = {modulus((E_1, E_2), (NU_1, NU_2)):.8g}, half of the",),
    ),
    "openfoam": (
        ("openfoam", {"youngsModulus": MODULI[0], "poissonsRatio": MODULI[1], "alpha": "0.3", "b": "1.5"}),
        hertz(K, 0.3 * math.sqrt(MASS * K), 0.25),
        False,
        ("E_eff = ",),
    ),
    "trixi": (
        (
            "trixi",
            {
                "contact_model": "HertzContactModel",
                "elastic_modulus": MODULI[0],
                "poissons_ratio": MODULI[1],
                "damping_coefficient": "0.2",
            },
        ),
        hertz(K, 2 * 0.2 * math.sqrt(MASS * K), 0.25),
        False,
        ("E_eff = ",),
    ),
    "jaxdem": (
        ("jaxdem", {"young": "1e6 3e6", "e": "0.5 0.7"}),
        linear(2 * RADIUS * 1.5e6, 2 * ratio(0.5) * math.sqrt(MASS * 2 * RADIUS * 1.5e6)),
        True,
        ("young = 1500000, the harmonic mean of", "e = 0.5, the smaller of 0.5 and 0.7 ("),
    ),
}


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_two_bodies_mix_as_the_source_says(case):
    (program, settings), force, clipped, sentences = case
    found = delivered(program, settings)
    collision = found.collision
    assert (collision.epsilon, collision.depth) == pytest.approx(integrated(force, clipped=clipped), rel=2e-6)
    mixed = [one.sentence(name) for name, one in found.values.mixed.items()]
    for beginning in sentences:
        assert any(sentence.startswith(beginning) for sentence in mixed), mixed


def test_shapes_of_newton_mix_as_geoms_of_mujoco():
    """solref of each is 2/kd and kd/(2 sqrt(ke)), or 0.02 1 without damping; MuJoCo takes means, and the larger mu."""
    shapes = {"solver": "SolverMuJoCo", "ke": "1e4 4e4", "kd": "50 100", "mu": "0.5 0.8"}
    found = delivered("newton", shapes)
    solref = f"{(2 / 50 + 2 / 100) / 2} {(50 / 200 + 100 / 400) / 2}"
    assert found.collision == delivered("mujoco", {"solref": solref, "friction": "0.8"}).collision
    assert found.values.mixed["mu"].sentence("mu") == "mu = 0.8, the larger of 0.5 and 0.8 (contact_params)"
    undamped = delivered("newton", shapes | {"kd": "50 0"}).collision
    assert undamped == delivered("mujoco", {"solref": "0.03 0.625", "friction": "0.8"}).collision
    xpbd = {"solver": "SolverXPBD", "restitution": "0.9 0.1", "enable_restitution": "True"}
    (restitution,) = delivered("newton", xpbd).values.mixed.values()
    assert restitution == (0.5, "the mean", "", (0.9, 0.1), "build_restitution_manifolds")


def test_two_types_of_lammps_mix_as_it_does():
    """E_eff is that of both materials, and the restitution is the geometric mean; decks of such types run in LAMMPS."""
    settings = {"normal": "hertz/material", "damping": "coeff_restitution", "units": "si"}
    mixed = delivered("lammps", settings | {"coefficients": "1e7 0.5 0.3, 2e7 0.7 0.2"})
    E_eff, e = 1 / ((1 - 0.3**2) / 1e7 + (1 - 0.2**2) / 2e7), math.sqrt(0.5 * 0.7)
    one = delivered("lammps", settings | {"normal": "hertz", "coefficients": f"{4 / 3 * E_eff} {e}"}).collision
    assert (mixed.collision.epsilon, mixed.collision.depth) == pytest.approx((one.epsilon, one.depth), rel=1e-9)
    assert mixed.collision.epsilon == pytest.approx(e, rel=1e-6)
    assert mixed.values.mixed["coefficients"].rule == "the mixture"
    with pytest.raises(ValueError, match="coefficients is 3 numbers and 2: expected as many for both types"):
        delivered("lammps", settings | {"coefficients": "1e7 0.5 0.3, 2e7 0.7"})


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_one_number_is_that_of_both_bodies(case):
    (program, settings), *_ = case
    one = {name: text.split()[0] for name, text in settings.items() if name != "other"}
    two = {name: f"{text} {text}" if " " in settings[name] else text for name, text in one.items()}
    alike, found = delivered(program, one), delivered(program, two)
    assert alike.collision == found.collision
    # Only a sum, or a product, of equal numbers is another number.
    assert all(len({*each.bodies}) == 1 and each.value != each.bodies[0] for each in found.values.mixed.values())


@pytest.mark.parametrize("name", ["yade tc", "yade Mindlin", "mercurydpm", "mercurydpm Hertz", "chrono", "jaxdem"])
def test_what_is_written_instead_is_one_number_for_both_bodies(name):
    (program, settings), *_ = CASES[name]
    ((parameter, number),) = delivered(program, settings, epsilon=0.45).instead.items()
    assert " " not in number
    found = delivered(program, settings | {parameter: number})
    assert found.collision.epsilon == pytest.approx(0.45, abs=1e-6)


MFIX_WALL = {"UNITS": "SI", "other": "wall"}
LETHE = {"young modulus particles": MODULI[0], "poisson ratio particles": MODULI[1]}
METHOD = "particle particle contact force method"
LETHE_WALL = {
    "other": "wall",
    "young modulus particles": "1e6",
    "poisson ratio particles": "0.2",
    "restitution coefficient particles": "0.9",
    "young modulus wall": "3e6",
    "poisson ratio wall": "0.4",
    "restitution coefficient wall": "0.5",
}


@pytest.mark.parametrize(
    ("program", "settings", "force"),
    [
        ("mfix", MFIX_WALL | {"KN_W": "2e4", "DES_EN_WALL_INPUT": "0.7"}, linear(2e4, 2 * ratio(0.7) * math.sqrt(200))),
        (
            "mfix",
            MFIX_WALL
            | {"DES_COLL_MODEL": "HERTZIAN", "E_YOUNG": "1e6", "V_POISSON": "0.2"}
            | {"EW_YOUNG": "3e6", "VW_POISSON": "0.4", "DES_EN_WALL_INPUT": "0.7"},
            hertz(K, 2 * ratio(0.7) * math.sqrt(MASS * K), 0.25),
        ),
        (
            "openfoam",
            {"youngsModulus": "1e6", "poissonsRatio": "0.2", "alpha": "0.3", "b": "1.2"},
            lambda x, v: (
                4 / 3 * 1e6 / 1.92 * 0.1 * x**1.2 + 0.3 * math.sqrt(MASS * 4 / 3 * 1e6 / 1.92 * 0.1) * x**0.25 * v
            ),
        ),
        (
            "trixi",
            {"contact_model": "LinearContactModel", "normal_stiffness": "2e4", "damping_coefficient": "0.2"},
            linear(2e4, 0.4 * math.sqrt(200)),
        ),
    ],
)
def test_walls_and_other_laws(program, settings, force):
    found = delivered(program, settings).collision
    assert (found.epsilon, found.depth) == pytest.approx(integrated(force, clipped=False), rel=2e-6)


def lethe(restitution, model):
    """Return the force with the constants as Lethe has them."""
    log_e, stiffness = math.log(restitution), 2 * modulus((E_1, E_2), (NU_1, NU_2)) * math.sqrt(RADIUS)
    beta = log_e / math.sqrt(log_e**2 + 9.8696)
    if model == "linear":
        k = 1.0667 * stiffness / 2 * (0.9375 * MASS / (stiffness / 2)) ** 0.2
        return linear(k, -2 * beta * math.sqrt(MASS * k))
    return hertz(0.66665 * stiffness, -1.8257 * beta * math.sqrt(stiffness * MASS), 0.25)


@pytest.mark.parametrize(
    ("settings", "model", "sentence"),
    [
        (LETHE | {METHOD: "linear"}, "linear", "0.9 and 0.5"),
        *((LETHE | {METHOD: f"hertz{name}"}, "", "0.9 and 0.5") for name in ("", "_mindlin_limit_force")),
        (LETHE, "", "0.9 and 0.5"),
        (LETHE_WALL, "", "0.9 and 0.5"),
        (LETHE_WALL | {"particle wall contact force method": "linear"}, "linear", "0.9 and 0.5"),
    ],
)
def test_lethe(settings, model, sentence):
    """Its constants have five digits; ours have all."""
    given = settings if "other" in settings else settings | {"restitution coefficient particles": "0.9 0.5"}
    found = delivered("lethe", given)
    force = lethe(harmonic(0.9, 0.5), model)
    assert (found.collision.epsilon, found.collision.depth) == pytest.approx(integrated(force, clipped=False), rel=3e-5)
    mixed = found.values.mixed["restitution coefficient"].sentence("e")
    assert mixed == f"e = 0.64285714, the harmonic mean of {sentence} (set_effective_properties)"
    instead = delivered("lethe", given, epsilon=0.45).instead
    assert len(instead) == (2 if "other" in given else 1)
    assert delivered("lethe", given | instead).collision.epsilon == pytest.approx(0.45, abs=1e-6)


def test_mfix_in_both_units():
    """1 N/m is 1000 dyn/cm, and eps depends on the ratio alone."""
    given = {"KN": "2e4", "DES_EN_INPUT": "0.7"}
    si, cgs = (delivered("mfix", given | {"UNITS": name, "KN": kn}) for name, kn in (("SI", "2e4"), ("CGS", "2e7")))
    assert si.collision.epsilon == pytest.approx(cgs.collision.epsilon, rel=1e-9)
    assert (cgs.collision.depth, cgs.units.length) == (pytest.approx(100 * si.collision.depth, rel=1e-9), "cm")


@pytest.mark.parametrize(
    ("program", "settings"),
    [
        ("mfix", {"UNITS": "SI", "KN": "2e4", "DES_EN_INPUT": "0.7"}),
        ("mfix", MFIX_WALL | {"KN_W": "2e4", "DES_EN_WALL_INPUT": "0.7"}),
        ("openfoam", {"youngsModulus": "1e6", "poissonsRatio": "0.2", "alpha": "0.3", "b": "1.2"}),
        ("trixi", {"contact_model": "LinearContactModel", "normal_stiffness": "2e4", "damping_coefficient": "0.2"}),
    ],
)
def test_what_is_written_instead_in_other_programs(program, settings):
    step = {} if program == "trixi" else {"step": 1e-4}
    ((parameter, number),) = delivered(program, settings, epsilon=0.45, **step).instead.items()
    found = delivered(program, settings | {parameter: number}, **step).collision
    assert found.epsilon == pytest.approx(0.45, abs=1e-6)


@pytest.mark.parametrize("en", np.linspace(0.02, 0.98, 25))
def test_yade_solves_for_the_damping_to_one_per_cent(en):
    """Its iteration comes from above."""
    found = delivered("yade", YADE | {"young": "1e6", "en": repr(float(en))}).collision
    k = 2 * E_1 * RADIUS
    assert found.epsilon == pytest.approx(integrated(linear(k, cn_from_en(en, MASS, k)), clipped=True)[0], rel=1e-6)
    assert en <= found.epsilon <= 1.0101 * en


@pytest.mark.parametrize(("wanted", "reached"), [(0.89, 0.892828), (0.995, 1.0), (0.88, None)])
def test_an_eps_that_yade_jumps_over_is_said(wanted, reached):
    """Newton's method takes one step more below en = 0.88399, and none above 1/1.01."""
    given = YADE | {"young": "1e6", "en": "0.5"}
    found = delivered("yade", given, epsilon=wanted)
    again = delivered("yade", given | found.instead).collision.epsilon
    assert again == pytest.approx(reached or wanted, abs=1e-6)
    texts = [text for text in found.warnings if text.startswith("No number")]
    assert texts == ([f"No number gives {wanted}: the one to write gives {reached:.4f}"] if reached else [])


@pytest.mark.parametrize(
    ("other", "radius", "share", "kn", "cn"),
    [
        ("sphere", 0.01, 1 / 2, 30000.0, 3.3237706118398145),
        ("wall", 0.02, 1, 30000.0, 3.3237706118398145),
        ("facet", 0.02, 1, 34285.71428571428, 3.5532602123107493),
    ],
)
def test_springs_in_yade_itself(other, radius, share, kn, cn):
    """Printed by YADE 2023.02a for spheres of 33.5 g and 2 cm; the effective mass of two is half of that."""
    native, mass = simulator_of("yade").native, 0.03351032163829113 * share
    values = native.values(YADE | {"young": "1e6 3e6", "en": "0.95 0.65", "other": other})
    spring = native.force(values, Impact(SPEED, mass, radius))
    assert (spring.k, spring.c) == pytest.approx((kn, cn), rel=2e-8)


@pytest.mark.parametrize(
    ("program", "settings", "message"),
    [
        (
            "yade",
            {"physics": "MindlinPhys", "young": "1e6", "poisson": "0.3", "en": "0.9 0.1"},
            "en is 0.9 0.1: expected one number, as MindlinPhys has one for a pair of materials",
        ),
        ("yade", YADE | {"en": "0.5"}, "tc and young: expected one of them"),
        (
            "lethe",
            {"other": "wall", "young modulus particles": "1e6 2e6"},
            "young modulus particles is 1e+06 2e+06: expected one number, as the other one is that of the wall",
        ),
        ("lethe", {METHOD: "DMT"}, "is 'DMT': expected linear, hertz_mindlin_limit_overlap"),
        (
            "lethe",
            {METHOD: "hertz_JKR"},
            "surface energy is 0 0: expected numbers > 0, or a contact force method without",
        ),
        ("mfix", {"KN": "1e4"}, 'UNITS is not set: expected --set "UNITS=SI" or "UNITS=CGS"'),
        ("mfix", {"UNITS": "SI", "DES_INTG_METHOD": "ADAMS_BASHFORTH"}, "expected EULER"),
        ("trixi", {"normal_stiffness": "1e4"}, "contact_model is not set"),
        ("mercurydpm", {"species": "HertzianBSHPViscoelastic", "effectiveElasticModulus": "1e6"}, "dissipation is not"),
    ],
)
def test_what_has_no_rule_is_refused(program, settings, message):
    with pytest.raises(ValueError) as error:
        delivered(program, settings)
    assert message in str(error.value)


def test_two_spheres_of_yade_with_two_moduli_have_one_radius():
    two, one = (delivered("yade", YADE | {"young": young, "en": "0.5"}).warnings for young in ("1e6 3e6", "1e6"))
    assert any("taken to have one radius" in text for text in two)
    assert not any("taken to have one radius" in text for text in one)
