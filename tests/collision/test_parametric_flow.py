"""Families of collisions: what is proven for all z holds at every z tried, for polynomials wrong on purpose as well.

The truth at single z comes from `validation`, with many more bits.
"""

from contextlib import suppress
from dataclasses import replace
from functools import cache

import pytest
from flint import arb, arb_series, fmpq, fmpz_poly
from hypothesis import example, given, settings
from hypothesis import strategies as st

from viscopade.arithmetic.balls import working
from viscopade.arithmetic.function_balls import FunctionBall, norm
from viscopade.collision import parametric_flow, validation
from viscopade.collision.flow import Dyadic, integrate
from viscopade.collision.parametric_flow import ParametricBranch, ParametricEnds, Scaled, integrated, parametric_ends

ACCURACY, DEGREE = 50, 12
FINE = 110
# k = 1 + z/16, 32 and 1024 times this, and, on a panel that begins at 0, k = z^2 (1 + 3 z/1024)/1024.
DAMPINGS = {name: Scaled(fmpz_poly([1 << 20, 1 << 16]), e) for name, e in (("one", -20), ("large", -15), ("huge", -10))}
DAMPINGS["origin"] = Scaled(fmpz_poly([0, 0, 1 << 10, 3]), -20)
CASES = [(name, unloading) for name in DAMPINGS for unloading in (False, True)]
POINTS = [fmpq(p, 16) for p in (-16, -5, 3, 16)]
FEW = [("one", False), ("one", True), ("huge", True), ("origin", False)]
LARGEST_RELATIVE_ERROR = 2.0**-38  # of what is proven at `ACCURACY` bits, so that the proofs say something


def points(name):
    return [z for z in POINTS if z > 0] if name == "origin" else POINTS


@cache
def made(name, unloading):
    k = DAMPINGS[name]
    gap = ACCURACY // 2 - 2 + max(k.value(1).size, 0) if unloading else ACCURACY // 3 + 4
    return integrated(k, unloading, ACCURACY, DEGREE, gap)


@cache
def truth(name, unloading, z):
    """Return the true p at the end, in a narrow enclosure."""
    with working(200):
        k = Dyadic.nearest(DAMPINGS[name].poly()(arb(z)), 190)
    return validation.ends(integrate(Dyadic(-k.mantissa, k.exponent) if unloading else k, FINE)).p


def deviations(name, unloading, found: ParametricEnds):
    with working(200):
        for z in points(name):
            yield abs(truth(name, unloading, z) * found.step(arb(z)) / found.slope(arb(z)) - 1)


def holds_or_is_refused(name, unloading, wrong: ParametricBranch):
    """Whether it was refused; if not, the error must be within the bound."""
    try:
        found = parametric_ends(wrong, name == "origin")
    except ArithmeticError:
        return True
    assert all(deviation <= found.error for deviation in deviations(name, unloading, found))
    return False


def with_pieces(given: ParametricBranch, pieces):
    return replace(given, pieces=tuple(pieces))


def with_change(given: ParametricBranch, index, j, polynomial):
    """Add a polynomial in z to u_j of a piece, and go on from the piece's end with the same steps."""
    pieces = list(given.pieces[:index])
    u = list(given.pieces[index].u)
    u[j] += polynomial
    pieces.append(given.pieces[index]._replace(u=u))
    return continued(given, pieces)


def continued(given: ParametricBranch, pieces):
    """Integrate on with the same steps, so that the joints stay right."""
    signed = Scaled(-given.k.polynomial, given.k.exponent) if given.unloading else given.k
    grow = parametric_flow._Growth(signed, given.scale, given.bits, given.degree, len(given.pieces[0].u))
    for old in given.pieces[len(pieces) :]:
        if max(norm(sum(c, fmpz_poly()).coeffs()) for c in (pieces[-1].u, pieces[-1].y)) > 1 << given.bits + 4:
            raise Astray
        pieces.append(grow.piece(old.step, pieces[-1]))
    return with_pieces(given, pieces)


class Astray(Exception):
    """So wrong that the flow leads nowhere, with ever larger coefficients."""


# --- right ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "unloading"), CASES)
def test_the_end_is_within_its_bound_and_the_bound_is_small(name, unloading):
    found = parametric_ends(made(name, unloading), name == "origin")
    assert 0 < found.error < LARGEST_RELATIVE_ERROR
    assert all(deviation <= found.error for deviation in deviations(name, unloading, found))


@pytest.mark.parametrize(("name", "unloading"), [("one", False), ("one", True), ("origin", True)])
def test_more_bits_give_a_smaller_bound(name, unloading):
    k = DAMPINGS[name]
    gap = 34 + max(k.value(1).size, 0) if unloading else 33
    finer = parametric_ends(integrated(k, unloading, 80, 20, gap), name == "origin")
    assert finer.error < parametric_ends(made(name, unloading), name == "origin").error / 1000
    assert all(deviation <= finer.error for deviation in deviations(name, unloading, finer))


def test_the_origin_needs_its_own_lower_bounds():
    """Near z = 0 the end of loading is no number for z < 0, or is not covered: both are refused or both are right."""
    assert parametric_ends(made("one", True), True).error <= parametric_ends(made("one", True), False).error


# --- wrong on purpose -------------------------------------------------------------------------------------------------


@settings(max_examples=15)
@given(
    case=st.sampled_from(CASES),
    place=st.tuples(st.integers(0, 9), st.integers(2, 25), st.integers(0, DEGREE)),
    size=st.integers(8, 60),
    sign=st.sampled_from((-1, 1)),
)
@example(case=("one", False), place=(0, 2, 0), size=30, sign=1)
@example(case=("one", False), place=(0, 2, 0), size=30, sign=-1)
@example(case=("huge", True), place=(0, 2, 1), size=30, sign=1)
@example(case=("huge", True), place=(9, 2, 0), size=20, sign=-1)
def test_a_wrong_coefficient_is_refused_or_covered(case, place, size, sign):
    right = made(*case)
    index, j, power = min(place[0], len(right.pieces) - 1), place[1], place[2]
    change = sign * fmpz_poly([0] * power + [1 << max(right.bits - size, 0)])
    with suppress(Astray):
        holds_or_is_refused(*case, with_change(right, index, min(j, len(right.pieces[index].u) - 1), change))


@pytest.mark.parametrize(("name", "unloading"), FEW)
def test_wrong_coefficients_of_medium_size_are_covered_not_refused(name, unloading):
    """A bound that only ever refuses would prove nothing: an error that matters must be admitted, and seen.

    In unloading it must be small compared with the distance 2^-gap from the end.
    """
    right = made(name, unloading)
    size = (40 if unloading else 24) + 2 * max(right.k.value(1).size, 0)
    wrong = with_change(right, 0, 2, fmpz_poly([1 << right.bits - size]))
    assert not holds_or_is_refused(name, unloading, wrong)
    assert parametric_ends(wrong, name == "origin").error > 2.0**-size


@settings(max_examples=10)
@given(case=st.sampled_from(CASES), index=st.integers(1, 9), size=st.integers(4, 50), sign=st.sampled_from((-1, 1)))
@example(case=("one", True), index=1, size=12, sign=1)
@example(case=("one", False), index=4, size=12, sign=-1)
def test_a_speed_that_jumps_at_a_joint_is_refused_or_covered(case, index, size, sign):
    """The speed is changed at the start of a piece only: the piece is a solution, but of another start."""
    right = made(*case)
    index = min(index, len(right.pieces) - 1)
    after = right.pieces[index]
    signed = Scaled(-right.k.polynomial, right.k.exponent) if right.unloading else right.k
    grow = parametric_flow._Growth(signed, right.scale, right.bits, right.degree, len(after.u))
    jump = sign * (right.pieces[index].u[1] * (1 << 20)).coeffs()[0] >> (20 + size)
    pieces = [*right.pieces[:index]]
    pieces.append(after._replace(u=grow._coefficients(after.u[0], after.u[1] + jump, after.step)))
    with suppress(Astray):
        holds_or_is_refused(*case, continued(right, pieces))


def test_a_jump_of_the_speed_is_in_the_bound():
    right = made("one", False)
    after = right.pieces[1]
    signed = right.k
    grow = parametric_flow._Growth(signed, right.scale, right.bits, right.degree, len(after.u))
    change = -(int(after.u[1][0]) >> 12)  # slower: the end is not passed
    pieces = [right.pieces[0], after._replace(u=grow._coefficients(after.u[0], after.u[1] + change, after.step))]
    wrong = continued(right, pieces)
    assert not holds_or_is_refused("one", False, wrong)
    assert parametric_ends(wrong).error > 2.0**-11


@settings(max_examples=10)
@given(case=st.sampled_from(CASES), size=st.integers(2, 50), power=st.integers(0, 3), sign=st.sampled_from((-1, 1)))
@example(case=("one", True), size=20, power=0, sign=1)
@example(case=("huge", True), size=20, power=0, sign=1)
def test_a_wrong_end_is_refused_or_covered(case, size, power, sign):
    right = made(*case)
    change = sign * fmpz_poly([0] * power + [1 << right.bits - size])
    holds_or_is_refused(*case, replace(right, end=right.end + change))


@pytest.mark.parametrize(("name", "unloading"), FEW)
def test_an_end_behind_the_true_end_is_refused(name, unloading):
    """Behind the end polynomials go on smoothly, but p is another."""
    right = made(name, unloading)
    with pytest.raises(ArithmeticError, match="end"):
        parametric_ends(replace(right, end=right.end + (1 << right.bits - 6)), name == "origin")


@pytest.mark.parametrize("position", [-1, (1 << 60) + 1])
def test_an_end_outside_the_last_piece_is_refused(position):
    right = made("one", False)
    end = fmpz_poly([position * (1 << right.bits - 60)])
    with pytest.raises(ArithmeticError, match="the end is not in the last piece"):
        parametric_ends(replace(right, end=end))


@pytest.mark.parametrize(("name", "unloading"), FEW[:3])
@pytest.mark.parametrize("size", [5, 20, 35])
def test_another_k_is_refused_or_covered(name, unloading, size):
    """The polynomials of k (1 + 2^-size), under the name of k: the truth is that of k."""
    k = DAMPINGS[name]
    wrong_k = Scaled(k.polynomial * ((1 << size) + 1), k.exponent - size)
    gap = ACCURACY // 2 - 2 + max(k.value(1).size, 0) if unloading else ACCURACY // 3 + 4
    wrong = replace(integrated(wrong_k, unloading, ACCURACY, DEGREE, gap), k=k)
    assert not holds_or_is_refused(name, unloading, wrong) or unloading or size < 35


@pytest.mark.parametrize(("name", "unloading"), FEW)
@pytest.mark.parametrize("size", [4, 30])
def test_another_scale_of_time_is_refused_or_covered(name, unloading, size):
    right = made(name, unloading)
    scale = Scaled(right.scale.polynomial * (1 << size) + int(right.scale.polynomial[0]), right.scale.exponent - size)
    refused = holds_or_is_refused(name, unloading, replace(right, scale=scale))
    assert refused or size > 4
    assert not refused or unloading or size < 30


@pytest.mark.parametrize(("name", "unloading"), FEW)
def test_another_step_is_refused(name, unloading):
    right = made(name, unloading)
    for index in (0, len(right.pieces) - 1):
        step = right.pieces[index].step
        pieces = list(right.pieces)
        pieces[index] = pieces[index]._replace(step=Dyadic(step.mantissa + (step.mantissa >> 3), step.exponent))
        holds_or_is_refused(name, unloading, with_pieces(right, pieces))


def test_steps_must_be_positive():
    right = made("one", False)
    for index in (0, 2):
        pieces = list(right.pieces)
        step = pieces[index].step
        pieces[index] = pieces[index]._replace(step=Dyadic(-step.mantissa, step.exponent))
        with pytest.raises((ValueError, ArithmeticError)):
            parametric_ends(with_pieces(right, pieces))


@pytest.mark.parametrize("unloading", [False, True])
@pytest.mark.parametrize("polynomial", [[1 << 10, 1 << 11], [-(1 << 10)], [0, 1 << 10]])
def test_k_must_be_positive(unloading, polynomial):
    """Otherwise what is proven would be another half of the collision, in part."""
    k = Scaled(fmpz_poly(polynomial), -20)
    with pytest.raises((ValueError, ArithmeticError)):
        parametric_ends(replace(integrated(DAMPINGS["one"], unloading, 20, 4, 8), k=k))
    right = made("one", unloading)
    small = Scaled(fmpz_poly([1, 2]), -60)
    wrong = integrated(Scaled(fmpz_poly([1]), -60), unloading, ACCURACY, DEGREE, 20)
    with pytest.raises((ValueError, ArithmeticError)):
        parametric_ends(replace(wrong, k=small))
    assert right.k.least() > 0


def test_loading_is_not_unloading():
    with pytest.raises(ArithmeticError):
        parametric_ends(replace(made("one", False), unloading=True))
    with pytest.raises(ArithmeticError):
        parametric_ends(replace(made("one", True), unloading=False))


@pytest.mark.parametrize(("name", "unloading"), FEW)
def test_without_its_last_piece_the_bound_is_large(name, unloading):
    right = made(name, unloading)
    short = replace(right, pieces=right.pieces[:-1])
    assert holds_or_is_refused(name, unloading, short) or parametric_ends(short, name == "origin").error > 2.0**-20


# --- constructor ------------------------------------------------------------------------------------------------------


def test_a_family_starts_at_rest():
    right = made("one", False)
    for j in (0, 1):
        u = list(right.pieces[0].u)
        u[j] += 1
        with pytest.raises(ValueError, match="u = p = 0"):
            with_pieces(right, [right.pieces[0]._replace(u=u), *right.pieces[1:]])


@pytest.mark.parametrize("polynomial", [[1], [0, 0, 0, -1]])
def test_u_is_continuous(polynomial):
    right = made("one", False)
    u = list(right.pieces[2].u)
    u[0] += fmpz_poly(polynomial)
    with pytest.raises(ValueError, match="continuous"):
        with_pieces(right, [*right.pieces[:2], right.pieces[2]._replace(u=u), *right.pieces[3:]])


# --- building blocks --------------------------------------------------------------------------------------------------

POLYNOMIALS = st.lists(st.integers(-(10**6), 10**6), min_size=1, max_size=6).map(fmpz_poly)
FRACTIONS = st.fractions(-1, 1, max_denominator=64)


def value(polynomial, z):
    return sum(int(c) * z**i for i, c in enumerate(polynomial.coeffs()))


@given(POLYNOMIALS, FRACTIONS)
def test_least_and_most_bound_a_polynomial(polynomial, z):
    with working(100):
        assert (
            Scaled(polynomial, 3).least() <= arb(8 * value(polynomial, z).numerator) / value(polynomial, z).denominator
        )
        assert Scaled(polynomial, 3).most() >= abs(
            arb(8 * value(polynomial, z).numerator) / value(polynomial, z).denominator
        )


def test_least_and_most_are_attained():
    with working(64):
        assert Scaled(fmpz_poly([10, -3]), 1).least() == 14
        assert Scaled(fmpz_poly([10, -3]), 1).most() == 26


def test_on_the_panel_at_0_lower_bounds_are_those_of_positive_z():
    with working(64):
        proof = parametric_flow._Proof(made("origin", False), True)
        both = parametric_flow._Proof(made("one", False), False)
        for coefficients, least in (([10, 4], 10), ([10, -4], 6), ([10, 4, -1, 2], 10), ([10, 1, -3], 8)):
            assert proof._least_poly(parametric_flow.arb_poly(coefficients)) == least
            assert both._least_poly(parametric_flow.arb_poly(coefficients)) == 10 - sum(map(abs, coefficients[1:]))


@pytest.mark.parametrize(("name", "unloading"), FEW)
@pytest.mark.parametrize("cut", [False, True])
def test_the_residual_is_bounded_for_all_y_and_z(name, unloading, cut):
    """|u_yy - S (2 h^2 S + h k u_y)| at points, for polynomials that are no solution, against the bound.

    `cut`: most of the residual are powers of z that the products leave out.
    """
    right = made(name, unloading)
    for piece in (right.pieces[0], right.pieces[-1]):
        if cut:
            u = [piece.u[0] - fmpz_poly([0] * DEGREE + [4 << right.bits]), *piece.u[1:]]
        else:
            u = [c + fmpz_poly([0, (-1) ** j << right.bits - 9]) for j, c in enumerate(piece.u)]
        wrong = piece._replace(u=u)
        with working(300):
            bound = parametric_flow._residual(right, wrong)
            largest = max(residual(right, wrong, fmpq(y, 4), z) for y in range(5) for z in POINTS)
            assert largest <= bound
            assert largest > bound / 100


def test_errors_of_both_factors_are_in_that_of_a_product():
    """3 and 7 that are off by 5 and 2: (3 + 5) (7 + 2) - 21 = 51."""
    packing = parametric_flow._Packing(bits=10, degree=3, stride=4, length=4)
    three, seven = (FunctionBall(fmpz_poly([n << 10]), n << 10, error << 10) for n, error in ((3, 5), (7, 2)))
    assert packing.error(three, seven) >> 10 == 51


def residual(given: ParametricBranch, piece, y, z):
    """Return the residual's absolute value at a point, from power series in y."""
    y, z, unit = arb(y), arb(z), arb(2) ** -given.bits
    coefficients = [parametric_flow.arb_poly(c)(z) * unit for c in piece.u]
    series = sum((arb_series([y, 1], 3) ** j * c for j, c in enumerate(coefficients)), arb_series([0], 3))
    u, slope, second = (series[i] for i in range(3))
    h = piece.step.ball() * given.scale.poly()(z)
    k = given.k.poly()(z) * (-1 if given.unloading else 1)
    s = (1 - u) ** 2
    return abs(2 * second - s * (2 * h**2 * s + h * k * slope)).lower()


def test_nearest_has_as_many_bits_as_asked_for():
    with working(100, 3):
        scaled = Scaled.nearest(arb_series([0, arb(1) / 3, 10]), 20)
    assert scaled.polynomial[0] == 0
    assert int(scaled.polynomial[1]).bit_length() == 20
    assert scaled.polynomial[2] == 10 * 2**-scaled.exponent
