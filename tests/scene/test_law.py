"""A scene may name another law of contact: its range of eps, its kernels with their errors, and its code."""

from fractions import Fraction

import numpy as np
import pytest

from viscopade.arithmetic.formats import DOUBLE
from viscopade.collision import exact
from viscopade.collision.curve import curve
from viscopade.kernels.toolchain import ToolchainError
from viscopade.scene import check, read, runners, tables, units
from viscopade.scene.candidate import LawQuotient, PairConstant
from viscopade.scene.choice import choose
from viscopade.scene.encounter import impacts
from viscopade.scene.render import render

COMMAND = "viscopade scene law.toml"
SPEEDS = "speed = { min = 0.01, max = 1 }"
KNOWN = "restitution = { epsilon = 0.8, speed = 1 }"
EACH = ("c", "python", "cuda", "glsl", "wgsl", "javascript", "fortran", "rust", "julia")


def toml(law="hunt-crossley", contact=KNOWN, tolerance="epsilon = 1e-4", code="", top=SPEEDS):
    return (
        f'law = "{law}"\n{top}\n[[contact]]\nbetween = ["foot", "floor"]\n{contact}\n[tolerance]\n{tolerance}\n'
        f"[code]\n{code}\n"
    )


def chosen(**more):
    return choose(read.from_toml(toml(**more), "law.toml"))


# --- ranges -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("law", ["hunt-crossley", "hunt-crossley:1", "kelvin-voigt:1", "tsuji", "3/2,0", "1,1/3"])
def test_eps_is_the_given_one_at_its_speed_and_follows_the_speed_elsewhere(law):
    (found,) = impacts(read.from_toml(toml(law, top="speed = { min = 0.25, max = 0.25 }"), "law.toml"))
    kappa = exact.invert("0.8", law=law).floats()["kappa"] * 0.25 ** float(2 / found.law.nu - 1)
    low, high = found.epsilon
    assert low <= high
    assert float(low) == pytest.approx(curve(law).epsilon(kappa), rel=1e-11)
    assert float(high) == pytest.approx(float(low), rel=1e-10)


def test_kappa_may_be_given_at_any_speed():
    met = [
        impacts(read.from_toml(toml(contact=f"kappa = {{ value = {kappa}, speed = {speed} }}"), "law.toml"))[0]
        for kappa, speed in ((0.5, 1), (1.0, '"200 cm/s"'))
    ]
    assert met[0].factor == met[1].factor == 0.5
    assert [float(v) for v in met[0].v_star] == pytest.approx([0.005, 0.5])


def test_v_star_falls_with_the_speed_if_nu_is_above_2():
    (found,) = impacts(read.from_toml(toml("3/2,0"), "law.toml"))
    low, high = found.v_star
    assert low < high
    assert float(found.epsilon[1]) == pytest.approx(0.8)  # at the fastest


def test_a_v_star_beyond_all_bounds_is_refused():
    with pytest.raises(ValueError, match=r"v\* of foot-floor is from .* accepted is 1e-30 to 1e30"):
        impacts(read.from_toml(toml(top="speed = { min = 1, max = 1e300 }"), "law.toml"))


# --- kernels ----------------------------------------------------------------------------------------------------------


def test_a_constant_is_exact_if_eps_does_not_depend_on_the_speed():
    found = chosen(law="tsuji", tolerance="epsilon = 1e-11").chosen.candidate
    assert isinstance(found, PairConstant)
    assert [float(value) for value in found.values] == pytest.approx([0.8], rel=1e-12)


def test_the_cheapest_quotient_and_the_ready_ones_are_offered():
    found = chosen(tolerance="epsilon = 1e-4\ndissipation = 1e-3")
    labels = [offer.candidate.label for offer in found.offers]
    assert labels[0] == "a constant"
    assert labels[-2:] == ["best quotient [5/6] for all v*", "best quotient [12/13] for all v*"]
    assert isinstance(found.chosen.candidate, LawQuotient)
    assert found.chosen.candidate.kernel.interval is not None
    assert "v* by pow" not in found.chosen.candidate.label


def test_quotients_keep_their_errors_with_a_law_by_pow():
    found = chosen(law="kelvin-voigt:1").chosen.candidate
    assert found.label.endswith(", v* by pow")
    for measure, bound in vars(found.errors).items():
        assert 0 < found.sampled(measure)[0] <= float(bound)


@pytest.mark.parametrize("law", ["hunt-crossley", "kelvin-voigt:1"])
def test_steepness_bounds_the_slopes_of_the_quotient(law):
    found = chosen(law=law).chosen.candidate
    a, b = found.kernel.rounded(DOUBLE)
    v = np.linspace(*map(float, found.encounters[0].v_star), 2001)[1:]
    f = np.polyval(a[::-1], v) / np.polyval(b[::-1], v)
    slope = np.abs(np.gradient(f, v)[1:-1] * v[1:-1])
    largest = max((slope / f[1:-1]).max(), (slope / (1 - f[1:-1])).max())
    assert 0.999 * largest <= float(found.steepness) <= 1.2 * largest


def test_the_error_of_v_star_counts_in_type_float_only_from_the_speed():
    def added(argument):
        return chosen(code=f'format = "float"\nargument = "{argument}"').chosen.candidate.of_v_star

    assert added("v_star") == 0
    assert Fraction(1, 2**24) < added("speed") < Fraction(1, 2**20)


# --- code -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("law", ["hunt-crossley", "kelvin-voigt:1"])
@pytest.mark.parametrize(
    "code",
    ["", 'use = "batch"', 'format = "float"', 'argument = "v_star"', 'language = "python"', '[units]\nlength = "cm"'],
)
def test_code_is_compared_with_the_exact_function(law, code):
    found = chosen(law=law, code=code)
    if runners.find_tool(found.scene.code.target.runner) is None:
        pytest.skip("there is no compiler")
    result = check.check_code(found, render(found, COMMAND))
    assert not result.reason
    assert result.collisions == check.SPEEDS
    for name, error in result.errors.items():
        assert error <= float(getattr(found.chosen.candidate.errors, name)) + check.REFERENCE_OF_LAW


def test_the_check_finds_wrong_code():
    found = chosen()
    if runners.find_tool(found.scene.code.target.runner) is None:
        pytest.skip("there is no compiler")
    with pytest.raises(ToolchainError, match="fails its check"):
        check.check_code(found, render(found, COMMAND).replace("(factor * speed)", "(1.01 * factor * speed)"))


@pytest.mark.parametrize("language", EACH)
def test_every_language_has_the_constants(language):
    text = render(chosen(law="linear", code=f'language = "{language}"'), COMMAND)
    assert "0.8" in text
    assert "linear, x'' + x + kappa x' = 0" in text.replace("\n", " ")


def test_tables_have_kappa_in_place_of_v_star():
    found = chosen()
    assert tables.columns(found)[1:4] == ("kappa at 1 m/s", "speeds (m/s)", "kappa")
    assert all(len(row) == len(tables.columns(found)) for row in tables.pairs(found))
    assert tables.to_json(found, None)["pairs"][0]["law"] == "hunt-crossley"


# --- what is refused --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"law": "hertz"}, "law is 'hertz': accepted is viscoelastic, linear"),
        ({"law": "1/100,10"}, r"law\.toml: the exponents 1/100,10 have too large denominators"),
        ({"contact": ""}, r"contact\[0\]: restitution and kappa: neither given, accepted is one of them"),
        ({"contact": f"{KNOWN}\nkappa = {{ value = 1, speed = 1 }}"}, "restitution and kappa: both given"),
        ({"contact": "dissipative_constant = 1"}, "dissipative_constant is not known: accepted are between, speed"),
        ({"contact": 'law = "tsuji"'}, "law is not known: accepted are between, speed, restitution, kappa"),
        ({"contact": "restitution = { epsilon = 1, speed = 1 }"}, "has no dissipation"),
        ({"contact": "kappa = { value = 0, speed = 1 }"}, "value is 0"),
        ({"contact": "kappa = { value = 1, speed = 1e-309 }"}, "accepted is a kappa at 1 m/s that double precision"),
        ({"top": ""}, "speed is missing"),
        ({"top": "speed = { granular_temperature = 1 }"}, "granular_temperature is not known: accepted are min, max"),
        ({"top": f"{SPEEDS}\nmaterial = 1"}, "material is not known: accepted are name, title, law, contact"),
        ({"top": f"{SPEEDS}\ngas = 1"}, "gas is not known"),
    ],
)
def test_refusals(more, message):
    with pytest.raises(ValueError, match=message) as refused:
        read.from_toml(toml(**more), "law.toml")
    assert str(refused.value).startswith("law.toml: ")
    assert "\n" not in str(refused.value)


def test_a_language_without_quotients_names_those_with():
    with pytest.raises(ValueError, match="'rust': accepted for quotients of the law hunt-crossley are c, python"):
        chosen(code='language = "rust"')


def test_simulators_take_viscoelastic_spheres_only():
    with pytest.raises(ValueError, match=r"law is 'hunt-crossley': accepted here is a scene of viscoelastic spheres"):
        units.setup(read.from_toml(toml(), "law.toml"))


@pytest.mark.parametrize("law", ["viscoelastic", "3/2,1/2", "kelvin-voigt"])
def test_the_paper_s_law_by_name_is_no_other_law(law):
    text = (
        '[material.m]\nyoung_modulus = 1e9\npoisson_ratio = 0.3\ndensity = 1e3\ndissipative_constant = 1e-6\n'
        "[body.b]\nmaterial = 'm'\nradius = 0.01\n[speed]\nmin = 1\nmax = 2\n[tolerance]\nepsilon = 0.1\n"
    )  # fmt: skip
    assert read.from_toml(f'law = "{law}"\n{text}', "s.toml") == read.from_toml(text, "s.toml")
