"""Kernels of laws of contact other than the paper's: their proven errors against closed forms, in every language."""

import json
import re
from dataclasses import replace
from fractions import Fraction
from functools import cache

import numpy as np
import pytest
from mpmath import mp, mpf

from tests.closed_forms import nu_1, nu_2
from tests.kernels.languages import COMPACT, TYPES, Code
from viscopade.approximation import cheapest, inverse, minimax, target
from viscopade.approximation.lacunary import LacunaryQuotient, Powers, full_powers
from viscopade.arithmetic.formats import DOUBLE, FLOAT
from viscopade.collision import exact
from viscopade.kernels import certificate, prove_lacunary
from viscopade.kernels.forms import exact_formulas, rounding_bounds
from viscopade.kernels.reference import reference_of
from viscopade.kernels.requests import Request
from viscopade.kernels.targets import quotients
from viscopade.kernels.targets.languages import target as target_of
from viscopade.kernels.targets.languages import targets
from viscopade.theory.law import law_of

SHADERS = [target.name for target in targets() if target.place == "shader"]
LAWS = {"hunt-crossley": nu_1, "linear": lambda kappa: nu_2(kappa / 2, "force")}
"""By name, eps of kappa in closed form."""


def request(law, **more):
    return Request(law=law, **{"accuracy": ("1e-4",), "kappa_max": "2"} | more)


def quotient(of, form, v_star):
    """The formula with the coefficients of a type, exactly but for 40 digits."""
    a, b = of.rounded(form)
    top, bottom = (mp.polyval([mpf(c) for c in values[::-1]], v_star) for values in (a, b))
    return top / bottom


def worst(of, form, true, v_stars):
    """The largest error relative to the smaller one of eps and 1 - eps."""
    with mp.workdps(40):
        errors = []
        for v_star in map(mpf, v_stars):
            epsilon = true(v_star)
            errors.append(abs(quotient(of, form, v_star) - epsilon) / min(epsilon, 1 - epsilon))
        return float(max(errors))


FORWARD = [  # request, type, v*, and the least share of the bound that is reached there
    *((law, {}, form, (1e-3, 1.999, 400), 0.97) for law in LAWS for form in (DOUBLE, FLOAT)),
    ("linear", {"v_star_min": "1", "accuracy": ("1e-6",)}, DOUBLE, (1, 1.999, 200), 0.9),
    *((law, {"kappa_max": "inf", "accuracy": ("1e-5",)}, DOUBLE, (1e-3, 1e7, 1500), 0.9) for law in LAWS),
    # Panels are known to 1e-11.
    *((law, {"kappa_max": "inf", "accuracy": ("1e-10",)}, DOUBLE, (1e-3, 1e7, 1500), 0.2) for law in LAWS),
]


@pytest.mark.parametrize(("law", "asked", "form", "points", "share"), FORWARD)
def test_the_proven_error_is_the_largest_one(law, asked, form, points, share):
    (found,), of = request(law, **asked).quotients(), request(law, **asked)
    bound = float(found.variant(form).certificate.bound)
    assert share * bound < worst(found, form, LAWS[law], np.geomspace(*points)) < bound < float(of.accuracy[0])
    assert found.bounds[0].low == Fraction(of.v_star_min)
    if of.kappa_max == "inf":
        assert found.bounds[0].high is None
        assert f"all_{of.accuracy[0].replace('-', 'm')}" in found.lasting_name


@pytest.mark.parametrize(
    ("law", "kappa_max", "accuracy"),
    [pytest.param("kelvin-voigt:1", "3", "1e-4", marks=pytest.mark.slow), ("3/2,1/2", "4", "1e-3")],
)
def test_laws_without_a_closed_form(law, kappa_max, accuracy):
    """The second one is the paper's law, with v* = kappa^(1/2); its proof is that of the table of panels."""
    (found,), of = request(law, kappa_max=kappa_max, accuracy=(accuracy,)).quotients(), law_of(law)
    high = float(kappa_max) ** (1 / of.d)
    points = [Fraction(round(x * 2**20), 2**20) for x in np.linspace(high / 50, high, 50)]
    with mp.workdps(40):
        errors = []
        for v_star in points:
            true = exact.collision(v_star, 25, law=of)
            epsilon, loss = (mpf(x.mid().str(30, radius=False)) for x in (true.epsilon, true.one_minus_epsilon))
            approximated = quotient(found, DOUBLE, mpf(v_star.numerator) / v_star.denominator)
            errors.append(abs(approximated - epsilon) / min(epsilon, loss))
    assert 0.5 * float(found.bounds[0].bound) < max(errors) < float(found.bounds[0].bound) <= float(accuracy)


def test_the_papers_law_by_its_exponents_is_the_papers():
    by_kappa, by_v_star = (
        Request(accuracy=("1e-3",), **end).quotients()[0] for end in ({"kappa_max": "25"}, {"v_star_max": "5"})
    )
    for one, other in zip(by_kappa.rounded(DOUBLE), by_v_star.rounded(DOUBLE), strict=True):
        assert one == pytest.approx(other, rel=1e-9)
    assert by_kappa.law.d == 2
    assert by_kappa.interval[1] >= 5


def test_pade_kernels():
    (found,) = request("hunt-crossley", accuracy=(), kappa_max=None, pade=((3, 4),)).quotients()
    ends = [bound.high for bound in found.bounds]
    assert ends == [Fraction(1, 2), 1, 2, 5]
    for bound in found.bounds:
        size = worst(found, DOUBLE, LAWS["hunt-crossley"], np.linspace(0.01, float(bound.high), 100))
        assert 0.9 * float(bound.bound) < size < float(bound.bound) * (1 + 1e-9)


def test_a_quotient_without_the_limit_is_refused():
    with pytest.raises(ValueError, match=r"the degrees are \[3/5\]: accepted up to infinity is n = m \+ 1"):
        minimax.fit(3, 5, "inf", law=law_of("hunt-crossley"))
    with pytest.raises(ValueError, match=r"the interval has no end \(inf\): accepted for the law 3/2,1/2 is a number"):
        cheapest.cheapest_fit("1e-3", "inf")


# --- texts and numbers ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("asked", "root"), [({}, None), ({"accuracy": (), "kappa_max": None, "inverse": ("1e-5",)}, "1/2")]
)
def test_certificates_name_the_law(asked, root):
    (entry, *_) = json.loads(request("linear", **asked).render("certificates"))["certificates"]
    assert (entry["law"], entry["end"], entry.get("root")) == ("1,0", "force", root)
    assert entry["measure"] == ("speed" if root else "both")


# --- the inverse ------------------------------------------------------------------------------------------------------


@cache
def inverse_kernel(law, accuracy="1e-5", epsilon_min="0"):
    (found,) = Request(law=law, inverse=(accuracy,), epsilon_min=epsilon_min).prove()
    return found


def inverted(of, form, epsilon, loss):
    """V* by the formula with the coefficients of a type, exactly but for the digits of mpmath."""
    variant = of.variant(form)
    y = mp.root(loss / epsilon, of.root.denominator)
    top, bottom = (
        mp.fsum(mpf(c) * y**k for k, c in zip(powers, values, strict=True))
        for powers, values in ((of.powers.top, variant.a), (of.powers.bottom, variant.b))
    )
    return y**of.form.shift * top / bottom


def worst_inverse(of, form, true, kappas):
    """The largest relative error of kappa."""
    with mp.workdps(60):
        errors = []
        for kappa in map(mpf, kappas):
            epsilon = true(kappa)
            errors.append(abs(inverted(of, form, epsilon, 1 - epsilon) / kappa - 1))
        return float(max(errors))


def beyond_the_panels():
    """The kernel that a search finds for 1e-4, without the search; it ends at kappa = 100."""
    return prove_lacunary.of_inverse(full_powers(4, 4), law_of("hunt-crossley"), Fraction("0.01"))


INVERSE = [  # law, accuracy, least eps, type, numbers of kappa, and the least share of the bound that is reached there
    *((law, "1e-5", "0", DOUBLE, 3000, 0.95) for law in LAWS),
    *((law, "1e-10", "0", DOUBLE, 3000, 0.7) for law in LAWS),  # near 1e-11 the panels of nu = 1 are off themselves
    ("hunt-crossley", "1e-5", "0", FLOAT, 1000, 0.9),
    ("hunt-crossley", "1e-4", "0.01", DOUBLE, 500, 0.9),
    ("linear", "1e-4", "0.1", DOUBLE, 500, 0.9),
]


@pytest.mark.parametrize(("law", "accuracy", "epsilon_min", "form", "number", "share"), INVERSE)
def test_the_proven_error_of_an_inverse_is_the_largest_one(law, accuracy, epsilon_min, form, number, share):
    of = beyond_the_panels() if epsilon_min == "0.01" else inverse_kernel(law, accuracy, epsilon_min)
    if epsilon_min == "0":
        size = 12 if form == DOUBLE else 6
        ends = 10.0**-size, 10.0**size
        assert of.bound.high is None
        assert of.lasting_name.endswith(f"_{accuracy.replace('-', 'm')}")
    else:
        ends = 1e-6, float(exact.invert(epsilon_min, 15, law=law_of(law)).v_star.mid())
        assert len(of.branches) == 1
    bound = float(of.variant(form).certificate.bound)
    assert share * bound < worst_inverse(of, form, LAWS[law], np.geomspace(*ends, number)) < bound
    assert of.variant(DOUBLE).total(of.checked) <= Fraction(accuracy)


@pytest.mark.parametrize(
    ("law", "d", "accuracy"),
    [("kelvin-voigt:1", 1, "1e-3"), pytest.param("3/2,0", 3, "1e-3", marks=pytest.mark.slow)],
)
def test_inverse_kernels_of_laws_without_a_closed_form(law, d, accuracy):
    of = inverse_kernel(law, accuracy, "0.3")
    assert (of.law.d, of.root) == (d, Fraction(1, d))
    errors = []
    with mp.workdps(40):
        for epsilon in (Fraction(n, 40) for n in range(12, 40)):
            true = mpf(exact.invert(epsilon, 25, law=of.law).v_star.mid().str(30, radius=False))
            e = mpf(epsilon.numerator) / epsilon.denominator
            errors.append(abs(inverted(of, DOUBLE, e, 1 - e) / true - 1))
    assert 0.5 * float(of.bound.bound) < max(errors) < float(of.bound.bound) <= float(accuracy)


@cache
def with_cube_root():
    """A kernel in y = ((1 - eps)/eps)^(1/3), as for nu = 5/2; its coefficients are those of a ready one for nu = 1."""
    of, law, low = inverse_kernel("hunt-crossley"), law_of("3/2,0"), Fraction(1, 64)
    variants = []
    for v in of.variants:
        form = inverse.inverse_form(law, whole=False)
        sizes = rounding_bounds.inverse_sizes(of.powers, form, low, v.a, v.b, v.form)
        certificate = replace(v.certificate, law=law)
        variants.append(replace(v, certificate=certificate, sizes=tuple(sizes.items())))
    return replace(of, variants=tuple(variants), epsilon_min=low)


@pytest.mark.parametrize("language", [name for name, of in COMPACT.items() if of.target not in SHADERS])
def test_roots_of_a_higher_order_in_every_language(tmp_path, language):
    """Pow, with the errors that its bound assumes: the formula with these coefficients, but for rounding."""
    how, of = COMPACT[language], with_cube_root()
    text = quotients.render_inverse(target_of(how.target), [of], "viscopade export")
    for form in (DOUBLE, FLOAT):
        if form.name not in how.forms:
            continue
        (tmp_path / form.name).mkdir()
        functions = tuple(f"{function}_{of.name}" for function in ("v_star", "v_star_from_loss"))
        compute = how.run(tmp_path / form.name, Code(text, functions, form.name, 1))
        kind = TYPES[form.name]
        near_0 = np.geomspace(1e-12 if form == FLOAT else 1e-30, 0.98, 150).astype(kind)
        given = np.concatenate([1 - near_0[near_0 > 1e-3], near_0])
        found = compute(given)
        bound = float(dict(of.variant(form).sizes)["v_star"].relative)
        for x, *results in zip(given, *map(found.get, functions), strict=True):
            with mp.workdps(40):
                for epsilon, result in zip((mpf(float(x)), 1 - mpf(float(x))), results, strict=True):
                    if of.epsilon_low <= float(epsilon) < 1:
                        assert abs(mpf(float(result)) / inverted(of, form, epsilon, 1 - epsilon) - 1) <= bound


@pytest.mark.parametrize("name", ["linear", "tsuji", "10,9/2", "hunt-crossley"])
def test_the_target_reaches_as_far_as_inverses_of_all_eps_are_fitted(name):
    """By section 2.9: eps -> (b+1)^((a-b)/(b+1)) kappa^(-nu)."""
    law = law_of(name)
    q = inverse._Y_MAX_OF_LAWS ** int(1 / inverse.inverse_form(law, whole=True).root)
    b = float(law.damping)
    assert q < target.LARGEST**law.nu / (b + 1) ** ((float(law.elastic) - b) / (b + 1))


def test_an_inverse_formula_with_another_limit_has_no_proof():
    law = law_of("hunt-crossley")
    form = inverse.inverse_form(law, whole=True)
    wrong = LacunaryQuotient(Powers((0, 1), (0, 1)), (Fraction(3, 2), Fraction(1)), (Fraction(1), Fraction(-1)))
    with pytest.raises(ArithmeticError, match="no bound was found"):
        certificate.prove_inverse(exact_formulas.inverse_formula(wrong, form), Fraction(0), reference_of(law))


# --- what is refused --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"law": "cubic"}, "law is 'cubic': accepted is viscoelastic"),
        ({"kappa_max": "x"}, "kappa_max is 'x': accepted is a number from 1e-9 to 1e18, or inf"),
        ({"kappa_max": "-1"}, "kappa_max is '-1': accepted is a number"),
        ({"v_star_max": "2"}, "kappa_max and v_star_max are both given: accepted is one of them"),
        ({"end": "return", "law": "linear"}, "accepted, as proofs need it, is the end 'force'"),
        ({"kappa_max": None}, "accepted with it is accuracy or minimax with kappa_max"),
        ({"accuracy": (), "kappa_max": None, "full": True}, "accepted with it is accuracy or minimax with kappa_max"),
        ({"accuracy": ("1e-5",), "kappa_max": None, "inverse": ("1e-5",)}, "accepted with it is accuracy or minimax"),
        (
            {"accuracy": (), "kappa_max": None, "inverse": ("1e-3",), "law": "kelvin-voigt:1"},
            "epsilon_min is 0: accepted for the law 2,1 is a number from 2e-4 to 0.99",
        ),
        (
            {"law": "kelvin-voigt:1", "kappa_max": "inf"},
            "the interval has no end (inf): accepted for the law 2,1 is a number",
        ),
    ],
)
def test_requests_that_are_refused(given, message):
    with pytest.raises(ValueError, match=re.escape(message).replace("'cubic'", "'cubic'")):
        request(**{"law": "hunt-crossley"} | given).prove()


@pytest.mark.parametrize("language", SHADERS)
def test_a_root_that_a_language_does_not_take(language):
    with pytest.raises(
        ValueError, match=f"a root of order 3, and nothing is guaranteed of pow in {language}: accepted"
    ):
        quotients.render_inverse(target_of(language), [with_cube_root()], "viscopade export")


def test_a_language_without_the_type():
    (found,) = request("hunt-crossley", accuracy=("1e-9",), kappa_max="0.4").quotients()
    with pytest.raises(ValueError, match=r"cannot be written in glsl: .*; accepted are other degrees or targets"):
        quotients.render(target_of("glsl"), [found], "viscopade export glsl")


def test_too_far_for_a_proof():
    law = law_of("linear")
    formula = exact_formulas.quotient_formula((Fraction(1),), (Fraction(1), Fraction(1)), law)
    with pytest.raises(ArithmeticError, match="proofs for the law 1,0 end at"):
        certificate.prove(formula, Fraction(0), Fraction(10**8), "both", reference_of(law))


# --- names that last --------------------------------------------------------------------------------------------------


def test_kernels_that_share_a_lasting_name_leave_it_to_the_first():
    of = Request(law="hunt-crossley", minimax=((0, 2), (1, 2)), kappa_max="2")
    first, second = of.prove()
    assert first.lasting_name == second.lasting_name
    name = f"pub fn epsilon_{first.lasting_name}("
    assert of.render("rust").count(name) == 1
    assert f"    epsilon_{first.name}(v_star)" in of.render("rust").split(name)[1].split("}")[0]
