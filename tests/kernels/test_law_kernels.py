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
from viscopade.approximation import cheapest, inverse, minimax
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


@cache
def kernel(law):
    (found,) = request(law).quotients()
    return found


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


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("form", [DOUBLE, FLOAT], ids=lambda form: form.name)
def test_the_proven_error_is_the_largest_one(law, form):
    found = worst(kernel(law), form, LAWS[law], np.geomspace(1e-3, 1.999, 400))
    bound = float(kernel(law).variant(form).certificate.bound)
    assert 0.97 * bound < found < bound < 1e-4


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


def test_an_interval_that_begins_late():
    (found,) = request("linear", v_star_min="1", accuracy=("1e-6",)).quotients()
    assert found.bounds[0].low == 1
    size = worst(found, DOUBLE, LAWS["linear"], np.geomspace(1, 1.999, 200))
    assert 0.9 * float(found.bounds[0].bound) < size < float(found.bounds[0].bound)


def test_pade_kernels():
    (found,) = request("hunt-crossley", accuracy=(), kappa_max=None, pade=((3, 4),)).quotients()
    ends = [bound.high for bound in found.bounds]
    assert ends == [Fraction(1, 2), 1, 2, 5]
    for bound in found.bounds:
        size = worst(found, DOUBLE, LAWS["hunt-crossley"], np.linspace(0.01, float(bound.high), 100))
        assert 0.9 * float(bound.bound) < size < float(bound.bound) * (1 + 1e-9)


# --- all kappa --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("accuracy", ["1e-5", "1e-10"])
def test_ready_kernels_for_all_kappa(law, accuracy):
    """They are records of the package."""
    (found,) = request(law, kappa_max="inf", accuracy=(accuracy,)).quotients()
    bound = float(found.bounds[0].bound)
    size = worst(found, DOUBLE, LAWS[law], np.geomspace(1e-3, 1e7, 1500))
    assert (0.9 if accuracy == "1e-5" else 0.2) * bound < size < bound < float(accuracy)  # panels are known to 1e-11
    assert found.bounds[0].high is None
    assert f"all_{accuracy.replace('-', 'm')}" in found.lasting_name


def test_a_quotient_without_the_limit_is_refused():
    with pytest.raises(ValueError, match=r"the degrees are \[3/5\]: accepted up to infinity is n = m \+ 1"):
        minimax.fit(3, 5, "inf", law=law_of("hunt-crossley"))
    with pytest.raises(ValueError, match=r"v_star_max is inf: accepted for the law 3/2,1/2 is a number"):
        cheapest.cheapest_fit("1e-3", "inf")


# --- texts and numbers ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("asked", "function", "most"),
    [({}, "epsilon_minimax", 2), ({"accuracy": (), "kappa_max": None, "inverse": ("1e-5",)}, "v_star_inverse", 1)],
    ids=["eps", "inverse"],
)
def test_vectors_are_exact(asked, function, most):
    """Those of a law are from the exact function; here they are compared with the closed form."""
    data = json.loads(request("hunt-crossley", **asked).render("vectors"))
    rows = [dict(zip(data["columns"], row, strict=True)) for row in data["vectors"]]
    assert not [row for row in rows if row["function"].startswith(("beta", "restitution"))]
    checked = 0
    for row in rows:
        x = float.fromhex(row["x"])
        if row["function"].startswith(function) and 1e-6 < x <= most and row["exact"] not in ("-", "0"):
            with mp.workdps(80):
                found, exactly = (mpf(row["exact"]), mpf(x)) if most > 1 else (mpf(x), mpf(row["exact"]))
                assert abs(nu_1(exactly) / found - 1) < 1e-18
            if row["bits"] != "-":
                least, most_, bits = (float.fromhex(row[key]) for key in ("least", "most", "bits"))
                assert least <= bits <= most_
            checked += 1
    assert checked > 10


@pytest.mark.parametrize(
    ("asked", "root"), [({}, None), ({"accuracy": (), "kappa_max": None, "inverse": ("1e-5",)}, "1/2")]
)
def test_certificates_name_the_law(asked, root):
    (entry, *_) = json.loads(request("linear", **asked).render("certificates"))["certificates"]
    assert (entry["law"], entry["end"], entry.get("root")) == ("1,0", "force", root)
    assert entry["measure"] == ("speed" if root else "both")


# --- the inverse ------------------------------------------------------------------------------------------------------


def inverse_request(law, **more):
    return Request(law=law, **{"inverse": ("1e-5",)} | more)


@cache
def inverse_kernel(law, accuracy="1e-5", epsilon_min="0"):
    (found,) = inverse_request(law, inverse=(accuracy,), epsilon_min=epsilon_min).prove()
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


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize(("accuracy", "tightness"), [("1e-5", 0.95), ("1e-10", 0.7)])
def test_ready_inverse_kernels_for_all_eps(law, accuracy, tightness):
    """They are records of the package. Near 1e-11 the panels of nu = 1 are off themselves."""
    of = inverse_kernel(law, accuracy)
    bound = float(of.variant(DOUBLE).certificate.bound)
    size = worst_inverse(of, DOUBLE, LAWS[law], np.geomspace(1e-12, 1e12, 3000))
    assert tightness * bound < size < bound
    assert of.variant(DOUBLE).total(of.checked) <= Fraction(accuracy)
    assert of.bound.high is None
    assert of.lasting_name.endswith(f"_{accuracy.replace('-', 'm')}")


def test_inverse_kernels_in_type_float():
    of = inverse_kernel("hunt-crossley")
    bound = float(of.variant(FLOAT).certificate.bound)
    assert 0.9 * bound < worst_inverse(of, FLOAT, LAWS["hunt-crossley"], np.geomspace(1e-6, 1e6, 1000)) < bound


def beyond_the_panels():
    """The kernel that a search finds for 1e-4, without the search."""
    return prove_lacunary.of_inverse(full_powers(4, 4), law_of("hunt-crossley"), Fraction("0.01"))


@pytest.mark.parametrize(
    ("law", "epsilon_min", "accuracy"), [("hunt-crossley", "0.01", "1e-4"), ("linear", "0.1", "1e-4")]
)
def test_inverse_kernels_on_an_interval(law, epsilon_min, accuracy):
    """The first one ends at kappa = 100, beyond the panels of nu = 1."""
    of = inverse_kernel(law, accuracy, epsilon_min) if law == "linear" else beyond_the_panels()
    end = float(exact.invert(epsilon_min, 15, law=law_of(law)).v_star.mid())
    bound = float(of.variant(DOUBLE).certificate.bound)
    size = worst_inverse(of, DOUBLE, LAWS[law], np.geomspace(1e-6, end, 500))
    assert 0.9 * bound < size < bound <= float(accuracy)
    assert len(of.branches) == 1


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
        ({"law": "kelvin-voigt:1", "kappa_max": "inf"}, "v_star_max is inf: accepted for the law 2,1 is a number"),
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
    assert of.render("rust").count(f"pub fn epsilon_{first.lasting_name}(") == 1
