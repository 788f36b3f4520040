"""Proven errors of Padé approximants of any law: tight, as other proofs say, and refused where there is a pole."""

from fractions import Fraction

import numpy as np
import pytest
from flint import arb
from mpmath import mp

from tests.closed_forms import nu_1
from viscopade.kernels import prove_rational
from viscopade.kernels.prove_rational import error_up_to
from viscopade.theory.law import law_of
from viscopade.theory.pade import pade


def sampled(a, b, high):
    """Return the largest error for Hunt-Crossley contacts on a grid, by the closed form."""
    v_star = np.linspace(0.02, float(high), 3000)
    epsilon = np.array([float(nu_1(mp.mpf(v))) for v in v_star.tolist()])
    loss = 1 - epsilon
    top, bottom = (np.polynomial.polynomial.polyval(v_star, [float(c) for c in values]) for values in (a, b))
    return np.max(np.abs(top / bottom - epsilon) / np.minimum(epsilon, loss))


@pytest.mark.parametrize(("m", "high"), [(2, "3"), (3, "1")])
def test_the_bound_is_tight(m, high):
    law = law_of("hunt-crossley")
    of = pade(m, m + law.excess, 30, law)
    bound, found = float(error_up_to(of.a, of.b, law, high)), sampled(of.a, of.b, high)
    assert found * (1 - 1e-3) < bound < 1.02 * found


@pytest.mark.slow
def test_the_papers_law_by_two_proofs():
    """The proof by the table of panels shares the flow, but neither panels nor polynomials."""
    law, (known, *_) = law_of("3/2,1/2"), prove_rational.of_pade(3, 6).bounds
    of = pade(3, 6, 40)
    bound = error_up_to(of.a, of.b, law, known.high)
    assert float(Fraction(bound)) == pytest.approx(float(Fraction(known.bound)), rel=0.02)


def test_wrong_coefficients_are_seen():
    law = law_of("hunt-crossley")
    of = pade(2, 3, 30, law)
    wrong = [*of.a[:2], of.a[2] + arb("0.01")]
    assert float(error_up_to(wrong, of.b, law, "1")) > 3 * float(error_up_to(of.a, of.b, law, "1"))


POLE = r"v_star_max is 2: no bound was found near v\* = .* \(a pole\?\); accepted is a smaller number"


def test_a_pole_is_refused():
    with pytest.raises(ValueError, match=POLE):
        error_up_to([arb(1), arb(-1)], [arb(1), arb(-1), arb("-0.5")], law_of("hunt-crossley"), "2")


@pytest.mark.slow
def test_a_law_with_no_proof_at_the_origin_is_refused_with_the_reason():
    message = r"^the law is 2,0: accepted .* nu <= 2, as for nu = 3 none .* \(the work .* is enclosed too widely\)$"
    with pytest.raises(ValueError, match=message):
        error_up_to([arb(1)], [arb(1)], law_of("2,0"), "0.1")


@pytest.mark.parametrize("high", ["0", "1e-9", "101", "nan", "x"])
def test_bad_ends_are_refused(high):
    with pytest.raises(ValueError, match=r"v_star_max is .*: accepted is a number from 0\.001 to 100"):
        error_up_to([arb(1)], [arb(1), arb(1)], law_of("hunt-crossley"), high)
