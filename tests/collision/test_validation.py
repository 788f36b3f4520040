"""Enclosures of a branch's end hold for polynomials wrong on purpose, or are refused; and they are not vacuous.

The truth comes from a run with many more bits, which is itself compared with an integration by mpmath.
"""

from contextlib import suppress
from dataclasses import replace
from fractions import Fraction
from functools import cache
from itertools import pairwise

import pytest
from flint import arb, arb_poly, fmpq, fmpq_poly, fmpz_poly
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from mpmath import mp, mpf

from viscopade.arithmetic.balls import exact_middle, fixed_point, to_mpf, working
from viscopade.collision import exact, flow, validation
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


def in_time(v_star: str, accuracy: int = 60) -> Branch:
    """Return loading, of which all pieces but the first are read backwards."""
    start = exact._Speed(Fraction(v_star) ** 2, Fraction(1), {}).start(accuracy)
    return flow.collide(*start, accuracy)[0]


LOADINGS = [in_time(v_star) for v_star in ("1e-9", "0.2", "1", "3", "20")]


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
        u, y = (mpf(piece.at_ends(coefficients)[1]) / 2**branch.bits for coefficients in (piece.u, piece.y))
        p = y / (2 * to_mpf(piece.h.ball()))
        square = true_p(branch.k, u) ** 2
        errors.append((p**2 - square, square))
    return errors


def parts(branch: Branch):
    functions = [validation._Functions.on_piece(branch, piece) for piece in branch.pieces]
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
        bound = exact_middle(validation._residual(k, validation._Functions.on_piece(branch, piece)))
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
        # Backwards, Y < 0 is needed on the whole piece, wherever its end is.
        ([-1], None, True),
        ([-1, 0.99], None, True),
        ([-1, 1.01], None, False),
        ([1], None, False),
        ([-1, 4, -3.99], None, False),
    ],
)
def test_a_speed_that_may_vanish_is_refused(y, end, positive):
    """A piece with an end is read forwards."""
    h, end = (-1, 0) if end is None else (1, end)
    with working(100):
        u = arb_poly(y).integral()
        f = validation._Functions(1 - u, u.derivative(), u, u, u, arb(h), HERTZ)
        if positive:
            validation._require_motion(f, arb(end))
        else:
            with pytest.raises(ArithmeticError, match="may vanish"):
                validation._require_motion(f, arb(end))


def test_a_first_piece_beyond_r_0_is_too_long():
    branch = Branch(Dyadic(0, 0), 30, (Piece([0, 0, 3 << 29], Dyadic(1, 0)),), 0)
    with working(100), pytest.raises(ArithmeticError, match="too long"):
        validation._shares(branch, [validation._Functions.on_piece(branch, branch.pieces[0])], [arb(0)])


def test_too_few_bits_for_the_speed():
    h = Dyadic(1, 0)
    branch = Branch(Dyadic(0, 0), 30, (Piece([0, 0, 25], h), Piece([25, 50, 0], h)), 0)
    with working(100), pytest.raises(ArithmeticError, match="too few bits"):
        validation._shares(branch, [validation._Functions.on_piece(branch, p) for p in branch.pieces], [arb(0), arb(0)])


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


def with_jump(k: Dyadic, change: int) -> Branch:
    branch = coarse(k)
    last = branch.pieces[-1]
    u = flow.taylor(last.u[0], last.u[1] + change, last.h, k, branch.bits, len(last.u))
    return replace(branch, pieces=(*branch.pieces[:-1], last._replace(u=u)))


@pytest.mark.parametrize("k", SIGNED)
@pytest.mark.parametrize("change", [-2, 2, 10**6, -(10**8)])
def test_a_jump_of_p_is_counted(k, change):
    branch = with_jump(k, change)
    assert abs(branch.jumps()[-1] - abs(change)) <= 3
    assert not holds_or_is_refused(branch)


@pytest.mark.parametrize("k", SIGNED)
def test_a_large_jump_of_p_is_refused(k):
    with pytest.raises(ArithmeticError, match="residual is too large"):
        enclosed(with_jump(k, coarse(k).pieces[-1].u[1] >> 4))


@pytest.mark.parametrize("branch", [*map(coarse, SIGNED), *LOADINGS])
def test_the_share_of_a_joint_covers_its_jump(branch):
    """Relative to p^2, without any residual: |p_before^2 - p_after^2|."""
    with working(branch.bits):
        functions = [validation._Functions.on_piece(branch, piece) for piece in branch.pieces]
        shares = validation._shares(branch, functions, [arb(0)] * len(functions))
    for share, (before, after) in zip(shares[1:], pairwise(branch.pieces), strict=True):
        old, new = (
            Fraction(piece.at_ends(piece.y)[end]) / piece.h.mantissa / Fraction(2) ** piece.h.exponent
            for piece, end in ((before, 1), (after, 0))
        )
        assert exact_middle(share) >= abs(old**2 - new**2) / new**2


@pytest.mark.parametrize("k", SIGNED)
def test_a_piece_left_out(k):
    branch = coarse(k)
    for index in range(len(branch.pieces) - 1):
        with pytest.raises(ValueError):
            replace(branch, pieces=branch.pieces[:index] + branch.pieces[index + 1 :])


# --- loading in time --------------------------------------------------------------------------------------------------
# The pieces were integrated from first contact on; from the turning point they are read backwards, with h < 0.


def rejoined(branch: Branch, pieces: list[Piece]) -> Branch:
    """Return a branch of these pieces; where u jumps, the slope of the piece behind the joint changes."""
    for index in range(1, len(pieces)):
        before, after = pieces[index - 1], pieces[index]
        gap = before.at_ends(before.u)[1] - after.at_ends(after.u)[0]
        pieces[index] = with_coefficient(after, 1 if after.h.mantissa < 0 else 0, gap)
    return replace(branch, pieces=tuple(pieces))


@pytest.mark.parametrize("v_star", ["1e-9", "0.01", "0.2", "1", "3", "20", "90"])
@pytest.mark.parametrize("accuracy", [12, 20, 60, 113])
def test_loading_in_time_agrees_with_loading_from_the_turning_point(v_star, accuracy):
    branch = in_time(v_star, accuracy)
    assert sum(piece.h.mantissa < 0 for piece in branch.pieces) == len(branch.pieces) - 1
    assert not holds_or_is_refused(branch)
    assert all(value.rel_accuracy_bits() > accuracy - 12 for value in enclosed(branch))


@pytest.mark.parametrize("branch", LOADINGS)
@pytest.mark.parametrize("size", [10, 30, 50])
@pytest.mark.parametrize("sign", [-1, 1])
def test_a_wrong_coefficient_in_time(branch, size, sign):
    for index, piece in enumerate(branch.pieces):
        for j in (2, 3, len(piece.u) - 1):
            pieces = list(branch.pieces)
            pieces[index] = with_coefficient(piece, j, sign * (max(map(abs, piece.u[1:3])) >> size))
            holds_or_is_refused(rejoined(branch, pieces))


@pytest.mark.parametrize("branch", LOADINGS[1:])
@pytest.mark.parametrize("index", [0, 1, 2])
@pytest.mark.parametrize("change", [-1, 1])
def test_the_error_at_every_joint_in_time_is_within_the_shares(branch, index, change):
    pieces = list(branch.pieces)
    pieces[index] = with_coefficient(pieces[index], 2, change * max(map(abs, pieces[index].u[1:3])) // 1000)
    wrong = rejoined(branch, pieces)
    with mp.workdps(50), working(250):
        total = arb(0)
        for (error, square), share in zip(errors_at_ends(wrong, wrong.pieces[:-1]), parts(wrong)[2], strict=False):
            total += share
            assert abs(error) / square <= to_mpf(total) * 5 / 4


@pytest.mark.parametrize("branch", LOADINGS[1:])
@pytest.mark.parametrize("j", [3, 5, 7])
def test_a_sign_of_an_odd_coefficient(branch, j):
    """The first piece is that of unloading with the signs of odd powers changed; here one keeps its sign."""
    first, *others = branch.pieces
    wrong = rejoined(branch, [with_coefficient(first, j, -2 * first.u[j]), *others])
    assert holds_or_is_refused(wrong) or (j > 3 and enclosed(wrong).p.rel_accuracy_bits() < 40)


@pytest.mark.parametrize("branch", LOADINGS[1:])
def test_unloading_instead_of_loading(branch):
    first, *others = branch.pieces
    mirrored = first._replace(u=[-c if j % 2 else c for j, c in enumerate(first.u)])
    with pytest.raises(ArithmeticError):
        enclosed(rejoined(branch, [mirrored, *others]))


@pytest.mark.parametrize("branch", LOADINGS)
def test_a_flipped_piece(branch):
    for index in range(1, len(branch.pieces)):
        piece = branch.pieces[index]
        whole = fmpz_poly(piece.u)(fmpz_poly([1, -1]))
        flipped = Piece([int(c) for c in whole.coeffs()], piece.h)
        forwards = Piece(piece.u, Dyadic(-piece.h.mantissa, piece.h.exponent))
        for wrong in (flipped, forwards):  # each alone begins where the piece ends
            with pytest.raises(ValueError, match="u is not continuous"):
                replace(branch, pieces=(*branch.pieces[:index], wrong, *branch.pieces[index + 1 :]))
        both = Piece(flipped.u, forwards.h)
        assert not holds_or_is_refused(
            replace(branch, pieces=(*branch.pieces[:index], both, *branch.pieces[index + 1 :]))
        )


@pytest.mark.parametrize("branch", LOADINGS)
@pytest.mark.parametrize("j", [0, 1, 2])
@pytest.mark.parametrize("change", [-1, 1])
def test_a_chain_that_is_not_continuous(branch, j, change):
    for index, piece in enumerate(branch.pieces[:-1]):
        pieces = list(branch.pieces)
        pieces[index] = with_coefficient(piece, j, change)
        with pytest.raises(ValueError, match="starts with" if index == 0 and j < 2 else "u is not continuous"):
            replace(branch, pieces=tuple(pieces))


@pytest.mark.parametrize("branch", LOADINGS)
def test_a_branch_does_not_start_backwards_nor_end_unloading_backwards(branch):
    first, second = branch.pieces[0], branch.pieces[1]
    with pytest.raises(ValueError, match="starts with"):
        replace(branch, pieces=(first._replace(h=Dyadic(-first.h.mantissa, first.h.exponent)),))
    with pytest.raises(ValueError, match="not read backwards"):
        replace(branch, k=Dyadic(-branch.k.mantissa, branch.k.exponent), pieces=(first, second))


@pytest.mark.parametrize("branch", LOADINGS)
@pytest.mark.parametrize("jump", [10**6, -(10**6)])
def test_a_jump_at_a_joint_in_time(branch, jump):
    """Of 10^6 units of Y; u stays continuous, as u_2 makes up for u_1."""
    for index in range(1, len(branch.pieces)):
        pieces = list(branch.pieces)
        pieces[index] = with_coefficient(with_coefficient(pieces[index], 1, -jump), 2, jump)
        wrong = replace(branch, pieces=tuple(pieces))
        assert abs(wrong.jumps()[index - 1] - 10**6) <= branch.jumps()[index - 1] + 4
        holds_or_is_refused(wrong)


@pytest.mark.parametrize("branch", LOADINGS)
def test_loading_in_time_from_elsewhere_than_first_contact(branch):
    """The chain ends before r = 0, or goes on beyond it."""
    for pieces in range(1, len(branch.pieces)):
        holds_or_is_refused(replace(branch, pieces=branch.pieces[:pieces]))
    last, bits = branch.pieces[-1], branch.bits
    h = Dyadic(-last.h.mantissa, last.h.exponent - 2)
    u = flow.taylor(last.u[0], h.over(last.h, last.u[1]), h, branch.k, bits, len(last.u))
    beyond = replace(branch, pieces=(*branch.pieces, Piece(u, h)), root=1 << bits - 1)
    holds_or_is_refused(beyond)
    h_half = Dyadic(h.mantissa, h.exponent - 1)
    u = flow.taylor(sum(u), h_half.over(h, sum(beyond.pieces[-1].y)), h_half, branch.k, bits, len(u))
    with pytest.raises(ArithmeticError, match="before the last piece"):
        enclosed(replace(beyond, pieces=(*beyond.pieces, Piece(u, h_half))))
    for root in (1 << bits - 10, 1 << bits - 1, (1 << bits) - 1):
        holds_or_is_refused(replace(branch, root=root))


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


@pytest.mark.parametrize("branch", [coarse(Dyadic(1, 0)), coarse(Dyadic(-1, 0)), LOADINGS[2]])
def test_a_root_outside_the_last_piece_is_refused(branch):
    """There the residual is not bounded."""
    for root in (-1, (1 << branch.bits) + 1):
        with pytest.raises(ValueError, match="not in the last piece"):
            replace(branch, root=root)


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
