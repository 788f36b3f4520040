"""The exact function of every law of contact: closed forms, integration in time, and polynomials wrong on purpose."""

from contextlib import suppress
from functools import cache

import pytest
from flint import arb
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp, mpf

import viscopade
from tests.closed_forms import nu_1, nu_2
from viscopade.arithmetic.balls import ball_of, rational_power, working
from viscopade.collision import exact
from viscopade.collision.flow import Branch, Dyadic, Motion, NoEndError, integrate
from viscopade.collision.validation import GUARD_BITS, Ends, ends
from viscopade.theory.law import ENDS, VISCOELASTIC, Law, law_of
from viscopade.theory.series import series
from viscopade_lab.studies.direct import collide_by

LAWS = [
    *(law_of(name) for name in ("linear", "tsuji", "hunt-crossley:1", "kelvin-voigt:1", "3/2,0", "3/2,1", "5/4,1/4")),
    *(law_of(name) for name in ("2,1/2", "1,2", "3,0")),
    *(law_of(name, "return") for name in ("viscoelastic", "linear", "kelvin-voigt:1", "3/2,0")),
]
of_laws = pytest.mark.parametrize("law", LAWS, ids=lambda law: f"{law}-{law.end}")
KAPPAS = ("1e-3", "0.3", "1", "7")


@cache
def at(law: Law, kappa: str, digits: int = 30) -> exact.Collision | None:
    """The collision, or None if it does not end."""
    try:
        return exact.collision(kappa=kappa, digits=digits, law=law)
    except ValueError:
        assert law.bounded
        return None


# --- closed forms -----------------------------------------------------------------------------------------------------


def close(ours: mpf, theirs: mpf, digits: int) -> bool:
    with mp.workdps(digits + 20):
        return abs(ours / theirs - 1) < mpf(10) ** -digits


@pytest.mark.parametrize("kappa", [*KAPPAS, "40"])
@pytest.mark.parametrize("n", ["1", "3/2"])
def test_nu_1_to_50_digits(n, kappa):
    found = at(law_of(f"hunt-crossley:{n}"), kappa, 52).mpf()
    with mp.workdps(100):
        closed = nu_1(mpf(kappa))
        assert close(found["epsilon"], closed, 50)
        assert close(found["one_minus_epsilon"], 1 - closed, 50)


@pytest.mark.parametrize("end", ENDS)
@pytest.mark.parametrize(("name", "scale"), [("linear", 1), ("tsuji", 1.25), ("2,1/2", 1.5)])
@pytest.mark.parametrize("kappa", [*KAPPAS, "2.5", "1e3"])
def test_nu_2_to_50_digits(name, scale, end, kappa):
    """The damping ratio is kappa/(2 sqrt(b + 1)); the older end exists below 1."""
    with mp.workdps(200):
        zeta = mpf(kappa) / (2 * mp.sqrt(scale))
        law = law_of(name, end)
        if end == "return" and zeta >= 1:
            with pytest.raises(ValueError, match=r"does not end at x = 0.*or end 'force'"):
                exact.collision(kappa=kappa, law=law)
        else:
            assert close(at(law, kappa, 52).mpf()["epsilon"], nu_2(zeta, end), 50)


# --- integration in time ----------------------------------------------------------------------------------------------


@of_laws
def test_against_integration_in_time(law):
    """Where damping is strong; the older end may not exist there."""
    kappa = "1.2" if at(law, "1.2") else "0.3"
    found, theirs = at(law, kappa), collide_by(law, kappa, 20)
    for name in ("epsilon", "one_minus_epsilon", "x_max", "tau_c"):
        assert close(found.mpf()[name], getattr(theirs, name), 19), name


@of_laws
def test_the_series_at_small_kappa(law):
    """1 - eps at a v* so small that the terms left out do not matter."""
    v_star = mpf(10) ** -3
    found = exact.collision(v_star, 30, law=law).mpf()["one_minus_epsilon"]
    with mp.workdps(60):
        terms = series(4 * law.d + law.n_a + 10, 50, law).mpf()
        assert close(found, -mp.polyval([*terms[:0:-1], 0], v_star), 28)


@pytest.mark.parametrize("law", [law for law in LAWS if law.delayed], ids=str)
def test_the_limit_of_large_kappa(law):
    """eps -> K^-nu, K = kappa (b+1)^-(1-1/nu), with corrections of order ln(K)/K^2 or smaller for nu <= 2."""
    found = at(law, "1e30", 20).epsilon
    with working(150):
        limit = rational_power(ball_of(law.damping + 1), law.nu - 1) * rational_power(arb(10) ** 30, -law.nu)
        assert abs(found / limit - 1) < arb(10) ** -15


def test_the_older_end_exists_for_any_damping_below_nu_2():
    """For nu < 2, x = 0 is reached however large kappa is."""
    for name, kappa, digits in (("3/2,1/2", "20", 6), ("2,1", "60", 2)):
        law = law_of(name, "return")
        low, high = (
            exact.collision(kappa=k, digits=15, law=law).mpf()["epsilon"] for k in (kappa, str(2 * int(kappa)))
        )
        power = law.decay
        assert close(low / high, mpf(2) ** (mpf(power.numerator) / power.denominator), digits)


# --- inverse ----------------------------------------------------------------------------------------------------------


@of_laws
@pytest.mark.parametrize("epsilon", ["0.999999", "0.05"])
def test_there_and_back(law, epsilon):
    there = exact.invert(epsilon, 30, law=law)
    assert there.decimals()["epsilon"].rstrip("0") == epsilon
    with working(200):
        kappa = there.v_star**law.d if there.kappa is None else there.kappa
    back = exact.collision(kappa=kappa.str(28, radius=False), digits=25, law=law)
    with mp.workdps(40):
        assert close(back.mpf()["epsilon"], mpf(epsilon), 22)


@pytest.mark.parametrize(("law", "epsilon"), [("3/2,1/2", "1e-6"), ("linear", "1e-9")])
def test_a_small_epsilon_at_the_older_end(law, epsilon):
    """The search needs more bits than the answer, because the error of p^2 is absolute."""
    law = law_of(law, "return")
    there = exact.invert(epsilon, 12, law=law)
    back = exact.collision(kappa=there.decimals()["kappa"], digits=8, law=law)
    with mp.workdps(30):
        assert close(back.mpf()["epsilon"], mpf(epsilon), 5)


@pytest.mark.parametrize("epsilon", ["1e-12", "0.999999999999"])
def test_there_and_back_where_the_powers_are_high(epsilon):
    """Newton's steps take nothing proven, and the end of small k has the bits that tau_c needs from the start."""
    law = law_of("10,1/3")
    there = exact.invert(epsilon, 20, law=law)
    back = exact.collision(kappa=there.kappa.str(40, radius=False), digits=15, law=law)
    with mp.workdps(40):
        assert close(back.mpf()["epsilon"], mpf(epsilon), 14)
        assert close(back.mpf()["tau_c"], there.mpf()["tau_c"], 13)


@pytest.mark.parametrize(("law", "epsilon"), [("1/3,10", "0.999999"), ("3/2,5/2", "1e-2")])
def test_laws_whose_epsilon_falls_slower_than_1_over_kappa(law, epsilon):
    """The first guess is the limit of (1 - eps)/eps that is the smaller one, where Newton's method converges."""
    found = exact.invert(epsilon, 12, law=law_of(law, "return"))
    back = exact.collision(kappa=found.decimals()["kappa"], digits=8, law=law_of(law, "return"))
    with mp.workdps(30):
        assert close(back.mpf()["epsilon"], mpf(epsilon), 5)


def test_an_epsilon_that_is_reached_too_slowly_is_refused():
    with pytest.raises(ValueError, match=r"does not end at x = 0.*expected a larger epsilon"):
        exact.invert("1e-9", 5, law=law_of("3/2,0", "return"))


@pytest.mark.parametrize(
    ("law", "last", "beyond"),
    [("hunt-crossley:1", "12000", "13000"), ("kelvin-voigt:1", "400", "450"), ("1/2,1", "1e5", "1e30")],
)
def test_damping_too_strong_to_be_followed_to_x_0_is_refused(law, last, beyond):
    of = law_of(law, "return")
    assert exact.collision(kappa=last, digits=5, law=of).epsilon > 0
    with pytest.raises(ValueError, match=r"does not end at x = 0, or lasts too long.*expected a smaller kappa"):
        exact.collision(kappa=beyond, law=of)
    with pytest.raises(ValueError, match=r"does not end at x = 0, or lasts too long.*expected a larger epsilon"):
        exact.invert("1e-30", law=of)


def test_speeds_and_betas():
    """kappa = beta v^(2/nu-1)."""
    at_speed = exact.collision(beta="0.3", speed="32", law="kelvin-voigt:1", digits=20)
    with mp.workdps(30):
        assert close(at_speed.mpf()["kappa"], mpf("0.3") * mpf(32) ** (mpf(1) / 3), 19)
    assert exact.collision(beta="0.3", speed="32", law="linear").decimals()["kappa"] == "0.3" + 29 * "0"
    found = exact.invert("0.6", 25, speed="3", law="hunt-crossley").mpf()
    with mp.workdps(30):
        assert close(found["beta"] * 3, found["kappa"], 23)


# --- what is shown, and refused ---------------------------------------------------------------------------------------


def test_the_papers_law_is_as_it_was():
    assert "kappa" not in exact.collision("1.5").decimals()
    assert exact.collision("1.5").decimals() == exact.collision("1.5", law="viscoelastic").decimals()
    by_kappa = exact.collision(kappa="2.25").decimals()
    assert by_kappa.pop("kappa") == "2.25"
    assert by_kappa == exact.collision("1.5").decimals()
    assert viscopade.Law("3/2", "1/2") == VISCOELASTIC


@of_laws
def test_the_ends(law):
    elastic = exact.collision(0, 20, law=law)
    assert elastic.decimals()["epsilon"] == "1"
    assert elastic.decimals()["kappa"] == "0"
    with mp.workdps(40):  # of x'^2/2 + x^(a+1)/(a+1) = 1/2
        power = mpf(law.elastic.numerator) / law.elastic.denominator + 1
        x_max = (power / 2) ** (1 / power)
        assert close(elastic.mpf()["x_max"], x_max, 19)
        assert close(elastic.mpf()["tau_c"], 2 * x_max * mp.beta(1 / power, 0.5) / power, 19)
    if law.delayed:
        assert exact.collision("inf", law=law).decimals()["kappa"] == "inf"
    else:
        with pytest.raises(ValueError, match="v_star is inf: expected a finite number"):
            exact.collision("inf", law=law)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"kappa": "-1", "law": "linear"}, "kappa is '-1'"),
        ({"kappa": 1, "v_star": 1}, "exactly one of"),
        ({"kappa": 3, "law": Law(1, 0, "return")}, "does not end at x = 0"),
        ({"beta": 1, "speed": 0, "law": "3/2,0"}, "speed is 0"),
        (
            {"v_star": "1e100", "law": "10,1/3"},
            "kappa is about 1e2900.*expected kappa up to 1e15.* for the law 10,1/3",
        ),
        ({"kappa": 1, "law": "hertz"}, "law is 'hertz': expected viscoelastic"),
    ],
)
def test_refusals(arguments, message):
    with pytest.raises((TypeError, ValueError), match=message):
        exact.collision(**arguments)


@pytest.mark.parametrize("name", ["linear", "tsuji", "3/2,0", "3,0"])
def test_damping_that_holds_the_bodies_back_is_noticed(name):
    law = law_of(name, "return")
    with pytest.raises(NoEndError):
        integrate(Dyadic(-30, 0), 60, Motion.from_law(law))


@pytest.mark.parametrize(
    "law", [law_of(name, "return") for name in ("viscoelastic", "3/2,1", "1,1/2", "1/2,1")], ids=str
)
def test_the_bound_of_the_slope_in_k(law):
    """-nu/(2 - nu) <= d ln P/d ln k <= 0 where the end is x = 0, by differences, from small k on."""
    with working(200):
        for mantissa in (1, 4, 9, 24, 70, 200):
            k, above = Dyadic(-mantissa, -2), Dyadic(-mantissa * 1025, -12)
            low, high = (ends(integrate(c, 90, Motion.from_law(law))).p for c in (k, above))
            slope = (high / low).log() / (arb(1025) / 1024).log()
            least = -arb(law.nu.numerator) / (2 * law.nu.denominator - law.nu.numerator)
            assert not slope < least - arb(10) ** -15
            assert not slope > 0


# --- wrong on purpose -------------------------------------------------------------------------------------------------

FINE = 160
STARTS = [(law, Dyadic(k, -2)) for law in LAWS for k in (0, 3, 9, -3, -9) if not (law.bounded and k < -8)]


@cache
def fine(law: Law, k: Dyadic) -> Ends:
    return enclosed(integrate(k, FINE, Motion.from_law(law)))


@cache
def coarse(law: Law, k: Dyadic, accuracy: int = 60) -> Branch:
    return integrate(k, accuracy, Motion.from_law(law))


def enclosed(branch: Branch) -> Ends:
    with working(branch.bits + GUARD_BITS):
        return ends(branch)


@settings(max_examples=60)
@given(st.sampled_from(STARTS), st.integers(20, 80))
def test_few_bits_enclose_what_many_bits_give(start, accuracy):
    with suppress(ArithmeticError), working(2 * FINE):
        found = enclosed(coarse(*start, accuracy))
        for value, truth in zip(found, fine(*start), strict=True):
            assert value.overlaps(truth)
        assert accuracy < 40 or found.p.rel_accuracy_bits() > accuracy - 30


@settings(max_examples=100)
@given(st.sampled_from(STARTS), st.data())
def test_a_wrong_coefficient_is_covered_or_refused(start, data):
    """One coefficient is changed in the last piece, where nothing has to be joined."""
    branch = coarse(*start)
    *before, last = branch.pieces
    j = data.draw(st.integers(2, len(last.u) - 1))
    size = max(abs(c) for c in last.u[1:3]) >> data.draw(st.integers(1, 50))
    change = data.draw(st.sampled_from([-1, 1])) * size
    wrong = last._replace(u=[c + change * (i == j) for i, c in enumerate(last.u)])
    with suppress(ArithmeticError), working(2 * FINE):
        found = enclosed(Branch(branch.k, branch.bits, (*before, wrong), branch.root, branch.motion))
        for value, truth in zip(found, fine(*start), strict=True):
            assert value.overlaps(truth)


@pytest.mark.parametrize("start", STARTS, ids=lambda start: f"{start[0]}-{start[0].end}-{start[1].mantissa}")
def test_the_proof_is_not_vacuous(start):
    assert all(value.rel_accuracy_bits() > FINE - 40 for value in fine(*start))
