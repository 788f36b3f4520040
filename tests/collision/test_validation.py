"""Enclosures of a branch's end hold for polynomials wrong on purpose, or are refused; and they are not vacuous.

The truth comes from a run with many more bits, which is itself compared with an integration by mpmath.
"""

from contextlib import suppress
from dataclasses import replace
from fractions import Fraction
from functools import cache

import pytest
from flint import arb, arb_poly, fmpq, fmpq_poly, fmpz_poly
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from mpmath import mp, mpf

from viscopade.arithmetic.balls import exact_middle, fixed_point, to_mpf, working
from viscopade.collision import flow, validation
from viscopade.collision.flow import HERTZ, Branch, Dyadic, Piece, integrate
from viscopade.collision.validation import GUARD_BITS, Ends, ends

FINE = 200
DAMPINGS = [Dyadic(0, 0), Dyadic(5, -60), Dyadic(5, -4), Dyadic(1, 0), Dyadic(11, 0), Dyadic(1001, 3)]
SIGNED = [*DAMPINGS, *(Dyadic(-k.mantissa, k.exponent) for k in DAMPINGS[1:])]


@cache
def fine(k: Dyadic) -> Ends:
    return enclosed(integrate(k, FINE))


@cache
def coarse(k: Dyadic, accuracy: int = 60) -> Branch:
    return integrate(k, accuracy)


def enclosed(branch: Branch) -> Ends:
    with working(branch.bits + GUARD_BITS):
        return ends(branch)


def holds_or_is_refused(branch: Branch) -> bool:
    """Whether it was refused; if not, it must meet the truth, which is far narrower."""
    try:
        found = enclosed(branch)
    except ArithmeticError:
        return True
    with working(2 * FINE):
        for value, truth in zip(found, fine(branch.k), strict=True):
            assert value.overlaps(truth)
    return False


class Astray(Exception):
    """So wrong that the flow does not lead to an end at all."""


def with_piece(branch: Branch, index: int, piece: Piece) -> Branch:
    """Replace one piece, and integrate on from its end with the same steps, so that the joints stay right."""
    pieces = [*branch.pieces[:index], piece]
    steps = [p.h for p in branch.pieces[index + 1 :]]
    while not flow._ends_in(pieces[-1], branch.k, branch.bits, HERTZ):
        last = pieces[-1]
        h = steps.pop(0) if steps else last.h
        slope = h.over(last.h, sum(last.y))
        if slope <= 0 or len(pieces) > 30:
            raise Astray
        pieces.append(Piece(flow.taylor(sum(last.u), slope, h, branch.k, branch.bits, len(last.u)), h))
    try:
        root = flow._root(pieces[-1], branch.k, branch.bits, HERTZ)
    except ValueError as error:  # of the square root of p < 0
        raise Astray from error
    return Branch(branch.k, branch.bits, tuple(pieces), root)


def with_coefficient(piece: Piece, j: int, change: int) -> Piece:
    return piece._replace(u=[c + change * (i == j) for i, c in enumerate(piece.u)])


# --- the truth --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("k", [Dyadic(5, -4), Dyadic(-5, -4), Dyadic(11, 0), Dyadic(-11, 0)])
def test_fine_enclosures_hold_what_mpmath_finds(k):
    """mpmath integrates u' = 2 p, p' = r^2 (r^2 + k p), T' = r, W' = 2 p^2 r^2 to the end."""
    with mp.workdps(20):
        number = mpf(k.mantissa) * mpf(2) ** k.exponent

        def rates(_, y):
            r, p = 1 - y[0], y[1]
            return [2 * p, r * r * (r * r + number * p), r, 2 * p * p * r * r]

        path = mp.odefun(rates, 0, [0, 0, 0, 0])
        branch = coarse(k)
        last = branch.pieces[-1]
        z = mpf(branch.root) / mpf(2) ** branch.bits
        near = sum(to_mpf(piece.h.ball()) for piece in branch.pieces[:-1]) + z * to_mpf(last.h.ball())

        def beyond(s):
            u, p = path(s)[:2]
            return 1 - u if number > 0 else (1 - u) ** 2 + number * p

        end = path(mp.findroot(beyond, (near * mpf("0.999"), near * mpf("1.001")), solver="secant"))
        for found, truth in zip(end[1:], fine(k), strict=True):
            assert abs(found / to_mpf(truth) - 1) < mpf(10) ** -17


@pytest.mark.parametrize("k", SIGNED)
def test_fine_enclosures_are_fine(k):
    assert all(value.rel_accuracy_bits() > FINE - 10 for value in fine(k))


@settings(max_examples=60)
@given(st.sampled_from(SIGNED), st.integers(2, 70))
def test_few_bits_enclose_what_many_bits_give(k, accuracy):
    refused = holds_or_is_refused(coarse(k, accuracy))
    assert not refused or accuracy < 12


@settings(max_examples=25)
@given(st.integers(-(2**30), 2**30), st.integers(-60, -5), st.integers(8, 40))
def test_few_bits_enclose_what_many_bits_give_for_any_damping(mantissa, exponent, accuracy):
    k = Dyadic(mantissa, exponent)
    with working(300):
        rough, better = enclosed(integrate(k, accuracy)), enclosed(integrate(k, accuracy + 40))
        assert all(value.overlaps(truth) for value, truth in zip(rough, better, strict=True))


# --- wrong on purpose -------------------------------------------------------------------------------------------------


@st.composite
def wrong_coefficients(draw):
    """A branch with one coefficient changed in one piece, joined without a jump."""
    branch = coarse(draw(st.sampled_from(SIGNED)))
    index = draw(st.integers(0, len(branch.pieces) - 1))
    piece = branch.pieces[index]
    j = draw(st.integers(2, len(piece.u) - 1))
    size = max(abs(c) for c in piece.u[1:3]) >> draw(st.integers(1, 50))
    return branch, index, with_coefficient(piece, j, draw(st.sampled_from([-1, 1])) * size)


@settings(max_examples=150)
@given(wrong_coefficients())
def test_a_wrong_coefficient(wrong):
    with suppress(Astray):
        holds_or_is_refused(with_piece(*wrong))


@settings(max_examples=60)
@given(st.sampled_from(SIGNED), st.integers(1, 50), st.sampled_from([-1, 1]))
def test_a_wrong_step(k, bits, sign):
    """The first polynomial runs in another time: p and its integrals are wrong by a factor."""
    branch = coarse(k)
    piece = branch.pieces[0]
    h = Dyadic((piece.h.mantissa << 60) + (sign * piece.h.mantissa << 60 - bits), piece.h.exponent - 60)
    with suppress(Astray):
        holds_or_is_refused(with_piece(branch, 0, piece._replace(h=h)))


@pytest.mark.parametrize("k", [k for k in SIGNED if k.size < 5])
@pytest.mark.parametrize("size", [20, 40])
@pytest.mark.parametrize("index", [0, 1])
def test_the_radius_is_of_the_size_of_the_error(k, index, size):
    """An enclosure that is far too wide would hold, too."""
    branch = coarse(k, 80)
    piece = branch.pieces[index]
    found = enclosed(with_piece(branch, index, with_coefficient(piece, 2, max(piece.u[1:3]) >> size)))
    assert found.p.rel_accuracy_bits() > size - 7
    assert found.time.rel_accuracy_bits() > size - 9
    assert found.work.rel_accuracy_bits() > size - 12  # by the balance of energy


# --- term by term -----------------------------------------------------------------------------------------------------
# The ends forgive a factor of four or more. Here is what the single terms say, at the joints.


def true_p(k: Dyadic, u: mpf) -> mpf:
    """p of the true solution at the given u, before the end."""
    branch = coarse(k, FINE)
    unit = mpf(2) ** -branch.bits
    piece = next(p for p in branch.pieces if sum(p.u) * unit >= u)
    u_of_z, y_of_z = ([c * unit for c in reversed(coefficients)] for coefficients in (piece.u, piece.y))
    z = mp.findroot(lambda z: mp.polyval(u_of_z, z) - u, (mpf(0.4), mpf(0.6)))
    return mp.polyval(y_of_z, z) / (2 * to_mpf(piece.h.ball()))


def errors_at_ends(branch: Branch, pieces: tuple[Piece, ...]) -> list[tuple[mpf, mpf]]:
    """E, the error of p^2, and p^2 itself at the end of every piece."""
    errors = []
    for piece in pieces:
        u = mpf(sum(piece.u)) / 2**branch.bits
        p = mpf(sum(piece.y)) / 2**branch.bits / (2 * to_mpf(piece.h.ball()))
        square = true_p(branch.k, u) ** 2
        errors.append((p**2 - square, square))
    return errors


def parts(branch: Branch):
    functions = [validation._Functions.of(branch, piece) for piece in branch.pieces]
    residuals = [validation._residual(branch.k, f) for f in functions]
    return functions, residuals, validation._shares(branch, functions, residuals)


@pytest.mark.parametrize("k", SIGNED)
@pytest.mark.parametrize("index", [0, -1])
@pytest.mark.parametrize("last", [0, 1 << 24])
def test_the_bound_of_the_residual_against_exact_arithmetic(k, index, last):
    """All coefficients of R = u'' - S (2 h^2 S + h k Y), S = (1 - u)^2, written out; also if the high ones count."""
    branch = coarse(k, 40)
    piece = branch.pieces[index]
    piece = with_coefficient(piece, len(piece.u) - 1, last * piece.u[-1])
    with working(branch.bits + GUARD_BITS):
        bound = exact_middle(validation._residual(k, validation._Functions.of(branch, piece)))
    u = fmpq_poly(fmpz_poly(piece.u), 1 << branch.bits)
    h, number = (fmpq(n.mantissa) * fmpq(2) ** n.exponent for n in (piece.h, k))
    y, s = u.derivative(), (1 - u) ** 2
    residual = y.derivative() - s * (2 * h**2 * s + h * number * y)
    total = sum((abs(Fraction(int(c.p), int(c.q))) for c in residual.coeffs()), Fraction(0))
    assert total <= bound <= total * (Fraction(101, 100) if last == 0 else 2)


@cache
def wrong_at(k: Dyadic, index: int, change: int) -> Branch:
    """A residual of one sign, nearly constant over one piece: the most that a residual of that size can do."""
    piece = coarse(k).pieces[index]
    return with_piece(coarse(k), index, with_coefficient(piece, 2, round(max(piece.u[1:3]) * change / 1000)))


@pytest.mark.parametrize("k", SIGNED)
@pytest.mark.parametrize("index", [0, 1, 2])
@pytest.mark.parametrize("change", [-1, 1])
def test_the_error_at_every_joint_is_within_the_shares(k, index, change):
    branch = wrong_at(k, min(index, len(coarse(k).pieces) - 2), change)
    with mp.workdps(50), working(250):
        total = arb(0)
        for (error, square), share in zip(errors_at_ends(branch, branch.pieces[:-1]), parts(branch)[2], strict=False):
            total += share
            assert abs(error) / square <= to_mpf(total) * 5 / 4


def first_piece(k: Dyadic, part: float, change: int) -> Branch:
    """A long first piece, to this part of the collision, with a residual of one sign."""
    h = Dyadic(int(part * sum(float(piece.h.ball()) for piece in coarse(k).pieces) * 2**40), -40)
    u = flow.taylor(0, 0, h, k, 200, 120)
    return Branch(k, 200, (with_coefficient(Piece(u, h), 2, u[2] * change // 100),), 0)


@pytest.mark.parametrize("change", [-1, 1])
def test_the_share_of_a_long_first_piece_in_unloading_needs_its_factor_of_two(change):
    k = SIGNED[-1]
    branch = first_piece(k, 0.5, change)
    with mp.workdps(50), working(250):
        share = to_mpf(parts(branch)[2][0])
        ((error, square),) = errors_at_ends(branch, branch.pieces)
        assert share / 2 * 5 / 4 < abs(error) / square <= share


def test_the_share_of_a_long_first_piece_in_loading():
    """For k = 0 a constant residual rho leads to rho u/p^2, and p^2 = (1 - r^5)/5."""
    branch = first_piece(Dyadic(0, 0), 0.3, 0)
    with working(250):
        f = parts(branch)[0][0]
        r = f.r(arb(1))
        truth = 5 * (1 - r) / (1 - r**5)
        assert 1.2 * truth < validation._first_piece(branch, f) * 2 * f.h**2 * 5 / 4 < 5 * truth


@pytest.mark.parametrize("k", [k for k in SIGNED if k.mantissa < 0 and k.size > -10])
@pytest.mark.parametrize("change", [-1, 1])
def test_errors_shrink_in_unloading_by_the_contraction(k, change):
    branch = wrong_at(k, 0, change)
    with mp.workdps(50), working(250):
        errors = errors_at_ends(branch, branch.pieces[:-1])
        for (before, square), (after, _), f in zip(errors, errors[1:], parts(branch)[0][1:], strict=False):
            contraction = to_mpf(f.contraction(k.ball(), arb(float(abs(before) / square))))
            assert contraction * mpf(0.9) < abs(after / before) <= contraction


@pytest.mark.parametrize("k", [Dyadic(-5, -4), Dyadic(-1, 0), Dyadic(-11, 0)])
def test_what_lies_behind_the_end_is_never_before_it(k):
    """With p too small, r^2 - |k| p is positive still at the true end and somewhat behind."""
    branch = wrong_at(k, len(coarse(k).pieces) - 2, -1)
    with mp.workdps(50), working(250):
        functions, residuals, shares = parts(branch)
        eta = 2 * sum(shares, arb(0))
        u_end = 1 - mp.sqrt(-to_mpf(k.ball()) * to_mpf(fine(k).p))
        u_of_z = [mpf(c) / 2**branch.bits for c in reversed(branch.pieces[-1].u)]

        def is_before(u: mpf) -> bool:
            z = mp.findroot(lambda z: mp.polyval(u_of_z, z) - u, (mpf(0.4), mpf(0.6)))
            exact_z = fixed_point(int(z * 2**150), 0, 150)
            return validation._is_before(functions[-1], exact_z, k.ball(), eta, residuals[-1])

        assert not is_before(u_end + mpf(10) ** -30)
        assert is_before(u_end - 2 * to_mpf(eta.mid()))


@pytest.mark.parametrize("k", [Dyadic(-1, 0), Dyadic(-11, 0)])
def test_a_piece_that_begins_behind_the_end_is_noticed(k):
    """With p too small, r^2 - |k| p is positive still at a joint behind the true end."""
    branch = wrong_at(k, len(coarse(k).pieces) - 2, -1)
    bits, last = branch.bits, branch.pieces[-1]
    with mp.workdps(50), working(250):
        u_end = 1 - mp.sqrt(-to_mpf(k.ball()) * to_mpf(fine(k).p))
        u_of_z = [mpf(c) / 2**bits for c in reversed(last.u)]
        z = mp.findroot(lambda z: mp.polyval(u_of_z, z) - u_end, (mpf(0.4), mpf(0.6))) + mpf(10) ** -9
        h = Dyadic(int(z * to_mpf(last.h.ball()) * 2**100), -100)
    joined = Piece(flow.taylor(last.u[0], h.over(last.h, last.u[1]), h, k, bits, len(last.u)), h)
    assert not flow._ends_in(joined, k, bits, HERTZ)
    rest = flow.taylor(sum(joined.u), sum(joined.y), h, k, bits, len(last.u))
    behind = Branch(k, bits, (*branch.pieces[:-1], joined, Piece(rest, h)), 1 << 30)
    with pytest.raises(ArithmeticError, match="before the last piece"):
        enclosed(behind)


# r, p, h, k, max|rho| h. By so much p may be wrong: then the force, or p itself, may have been 0 already.
NOT_BEFORE = [
    (0.5, -0.1, 1.0, 0.0, 0.0),
    (-0.1, 0.4, 1.0, 0.0, 0.0),
    (0.5, -0.1, 1.0, -1.0, 0.0),
    (-0.5, 0.1, 1.0, -1.0, 0.0),
    (0.5, 0.2, 1e-3, -1.0, 0.06),
    (0.1, 0.1, 1.0, -1e-9, 0.1),
]


@pytest.mark.parametrize(("r", "p", "h", "k", "disturbance"), NOT_BEFORE)
def test_what_may_lie_behind_the_end_is_not_taken_to_be_before_it(r, p, h, k, disturbance):
    with working(100):
        r_poly = arb_poly([r, -2 * h * p])
        square = r_poly * r_poly
        f = validation._Functions(r_poly, -r_poly.derivative(), square, square, arb_poly([1]), arb(h), HERTZ)
        assert not validation._is_before(f, arb(0), arb(k), arb(0), arb(2 * h * disturbance))
        if r > 0 and p > 0:
            assert validation._is_before(f, arb(0), arb(k), arb(0), arb(0))


@pytest.mark.parametrize(
    ("y", "end", "positive"),
    [
        ([], 1, False),
        ([0, 1], 1, True),
        ([0, 1, -1], 0.99, True),
        ([0, 1, -1], 1, False),
        ([1, -4, 4.001], 1, False),  # 2.5e-4 at its least: too little to be shown
        ([1, -4, 4.2], 1, True),
        ([1, -4, 3.99], 1, False),
        ([1, *150 * [0], -0.9], 1, True),  # behind the leading coefficients
        ([1, *150 * [0], -1.1], 1, False),
    ],
)
def test_a_speed_that_may_vanish_is_refused(y, end, positive):
    with working(100):
        u = arb_poly(y).integral()
        f = validation._Functions(1 - u, u.derivative(), u, u, u, arb(1), HERTZ)
        if positive:
            validation._require_motion(f, arb(end))
        else:
            with pytest.raises(ArithmeticError, match="may vanish"):
                validation._require_motion(f, arb(end))


def test_a_first_piece_beyond_r_0_is_too_long():
    branch = Branch(Dyadic(0, 0), 30, (Piece([0, 0, 3 << 29], Dyadic(1, 0)),), 0)
    with working(100), pytest.raises(ArithmeticError, match="too long"):
        validation._shares(branch, [validation._Functions.of(branch, branch.pieces[0])], [arb(0)])


def test_too_few_bits_for_the_speed():
    h = Dyadic(1, 0)
    branch = Branch(Dyadic(0, 0), 30, (Piece([0, 0, 25], h), Piece([25, 50, 0], h)), 0)
    with working(100), pytest.raises(ArithmeticError, match="too few bits"):
        validation._shares(branch, [validation._Functions.of(branch, p) for p in branch.pieces], [arb(0), arb(0)])


@pytest.mark.parametrize("k", SIGNED)
def test_a_large_residual_is_refused(k):
    piece = coarse(k).pieces[0]
    branch = with_piece(coarse(k), 0, with_coefficient(piece, 2, -piece.u[2] >> 2))
    with pytest.raises(ArithmeticError, match="residual"):
        enclosed(branch)


# --- not a branch at all ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("k", SIGNED)
@pytest.mark.parametrize("j", [0, 1])
@pytest.mark.parametrize("change", [-1, 1])
def test_a_start_that_is_not_the_turning_point(k, j, change):
    branch = coarse(k)
    with pytest.raises(ValueError, match="starts with"):
        replace(branch, pieces=(with_coefficient(branch.pieces[0], j, change), *branch.pieces[1:]))


@settings(max_examples=60)
@given(wrong_coefficients())
def test_a_joint_of_u_that_is_broken(wrong):
    branch, index, piece = wrong
    pieces = list(branch.pieces)
    assume(index < len(pieces) - 1 and pieces[index] != piece)
    pieces[index] = piece
    with pytest.raises(ValueError, match="u is not"):
        replace(branch, pieces=tuple(pieces))


@pytest.mark.parametrize("k", SIGNED)
@pytest.mark.parametrize("change", [-2, 2, 1 << 20])
def test_a_joint_of_p_that_is_broken(k, change):
    branch = coarse(k)
    *_, before, last = branch.pieces
    u = flow.taylor(last.u[0], last.u[1] + change, last.h, k, branch.bits, len(last.u))
    assert last.h.over(before.h, sum(before.y)) == last.u[1]
    with pytest.raises(ValueError, match="p is not"):
        replace(branch, pieces=(*branch.pieces[:-1], last._replace(u=u)))


@pytest.mark.parametrize("k", SIGNED)
def test_jumps_of_p_that_pass_as_rounding_are_counted(k):
    """Each may change p^2 by six units/u', relatively, on top of whatever the residuals do: here nothing."""
    branch = coarse(k, 20)
    with working(100):
        functions = [validation._Functions.of(branch, piece) for piece in branch.pieces]
        shares = validation._shares(branch, functions, [arb(0)] * len(functions))
        for share, piece in zip(shares[1:], branch.pieces[1:], strict=True):
            assert share * piece.u[1] >= 6


@pytest.mark.parametrize("k", SIGNED)
def test_a_piece_left_out(k):
    branch = coarse(k)
    for index in range(len(branch.pieces) - 1):
        with pytest.raises(ValueError):
            replace(branch, pieces=branch.pieces[:index] + branch.pieces[index + 1 :])


# --- the end ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("k", SIGNED)
def test_an_end_that_lies_in_a_later_piece(k):
    branch = coarse(k)
    for pieces in range(1, len(branch.pieces)):
        holds_or_is_refused(replace(branch, pieces=branch.pieces[:pieces], root=1 << branch.bits))


@pytest.mark.parametrize("k", SIGNED)
def test_an_end_that_lies_in_an_earlier_piece(k):
    """The polynomials are fine, but follow the flow on beyond the end."""
    branch = coarse(k)
    last = branch.pieces[-1]
    h = Dyadic(last.h.mantissa, last.h.exponent - 1)
    u = flow.taylor(sum(last.u), h.over(last.h, sum(last.y)), h, k, branch.bits, len(last.u))
    for root in (0, 1 << 20, 1 << branch.bits - 1):
        with pytest.raises(ArithmeticError, match="before the last piece"):
            enclosed(replace(branch, pieces=(*branch.pieces, Piece(u, h)), root=root))


@pytest.mark.parametrize("k", SIGNED)
def test_a_root_elsewhere(k):
    branch = coarse(k)
    one = 1 << branch.bits
    for root in (0, one >> 3, one >> 1, branch.root - (one >> 6), branch.root + (one >> 20), branch.root + (one >> 6)):
        holds_or_is_refused(replace(branch, root=root))


@pytest.mark.parametrize("k", [Dyadic(-5, -4), Dyadic(-1, 0), Dyadic(-11, 0)])
@pytest.mark.parametrize("size", [8, 12, 20])
def test_nothing_behind_the_end_is_taken_for_the_end(k, size):
    """p is too small at the start of the last piece, so the polynomial's own end lies behind the true one."""
    branch = coarse(k)
    index = len(branch.pieces) - 2
    piece = branch.pieces[index]
    for sign in (-1, 1):
        holds_or_is_refused(with_piece(branch, index, with_coefficient(piece, 2, sign * (piece.u[1] >> size))))


@pytest.mark.parametrize("k", [Dyadic(-11, 0), Dyadic(0, 0), Dyadic(11, 0)])
def test_a_single_piece_to_the_end_is_too_long(k):
    """It would end at two thirds of its radius of convergence or more."""
    end = sum(float(piece.h.ball()) for piece in coarse(k).pieces)
    h = Dyadic(int(end * 2**20), -20)
    piece = Piece(flow.taylor(0, 0, h, k, 200, 100), h)
    assert holds_or_is_refused(Branch(k, 200, (piece,), (1 << 200) * 9 // 10))
