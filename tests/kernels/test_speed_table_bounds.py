"""Tables over the bits of w: every term of the bounds is needed, shown one by one, by hand-made pieces and rows."""

from fractions import Fraction

import numpy as np
import pytest
from flint import fmpq_poly

from viscopade.arithmetic.balls import ball_of, exact_middle, working
from viscopade.arithmetic.chebyshev import greatest, to_fmpq, to_fraction
from viscopade.arithmetic.formats import DOUBLE, FLOAT
from viscopade.collision import exact, panel_proof
from viscopade.kernels import formulas, machine, rounding_bounds, speed_table, truth
from viscopade.kernels.catalogue import TIERS
from viscopade.kernels.expressions import Reading, Run
from viscopade.kernels.speed_table import TABLES, MantissaPiece, Polynomials

SMALL, FULL = TABLES["5e-6"], TABLES["full"]
U = Fraction(1, 2**53)
E = Fraction(1, 2**60)


def eps(w):
    found = exact.collision(beta="1", speed=w, digits=30).decimals()
    return Fraction(found["epsilon"]), Fraction(found["one_minus_epsilon"])


def with_rows(table, changes):
    """Return a table whose rows are changed."""
    rows = list(table.rows)
    for index, row in changes.items():
        rows[index] = row
    changed = type(table)(*(getattr(table, name) for name in table.__dataclass_fields__))
    changed.__dict__["rows"] = tuple(rows)
    return changed


# --- pieces -----------------------------------------------------------------------------------------------------------


def test_least_and_most_count_the_polynomial_and_its_error():
    piece = MantissaPiece(Fraction(1), Fraction(1, 2), fmpq_poly([1, 0, to_fmpq(Fraction(1, 8))]), Fraction(1, 100))
    assert piece.least == 1 - Fraction(1, 8) - Fraction(1, 100)
    assert piece.most == 1 + Fraction(1, 8) + Fraction(1, 100)
    negative = piece._replace(p=-piece.p)
    assert (negative.least, negative.most) == (piece.least, piece.most)


@pytest.mark.parametrize("index", [7, 300, 371, 372, 504, 511])
def test_errors_of_pieces_count_the_remainder_and_the_reference(index):
    """The remainder is seen at the ends, in 40 digits; its enclosure is not wider than 100 times."""
    for piece in SMALL.pieces(index):
        exponent = SMALL.interval(index)[0]
        assert piece.error > E * (1 + E) * abs(to_fraction(piece.p[0])) * Fraction(99, 100)
        found = []
        for s in (-1, 1):
            true, loss = eps((piece.centre + s * piece.half) * Fraction(2) ** exponent)
            found.append(abs(to_fraction(piece.p(s)) - (-loss if SMALL.base(index) else true)))
        assert max(found) <= piece.error
        assert piece.error < 100 * max(found) + 2 * E
        assert index != 504 or max(found) > 1000 * E


def test_a_panel_of_the_reference_ends_where_the_next_begins():
    for number in (0, 5, 40):
        edge = speed_table._edges()[number]
        assert speed_table._panel_at(0, edge) == number
        assert speed_table._panel_at(0, edge * (1 + E)) == number + 1


# --- bounds of rows ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("index", [300, 372, 511])
def test_bounds_of_a_row_count_every_part(index):
    """What is bounded, from its definition; |p| may be above 1/2 at row 372, where 1 - |p| is the smaller one."""
    pieces = SMALL.pieces(index)
    more = Fraction(1, 10**4)
    for piece in pieces:
        plain, wider = (SMALL.bounds_on(index, x, 1) for x in (piece, piece._replace(error=piece.error + more)))
        smaller = min(piece.least, 1 - piece.most)
        difference = greatest(SMALL.machine_p(index, speed_table._m_of_s(piece)) - piece.p)
        assert plain["error"] == (difference + piece.error) / smaller
        assert wider["error"] == (difference + piece.error + more) / (smaller - more)
        for form in (DOUBLE, FLOAT):
            assert plain[form.name] == SMALL.rounding_on(index, piece, form) / smaller
    assert index != 372 or any(1 - piece.most < piece.least for piece in pieces)


def test_a_row_that_falls_in_its_middle_only_is_refused():
    _, low, high = SMALL.interval(450)
    centre = (low + high) / 2
    for sign in (1, -1):  # p' = -1/8 + sign 2 (m - centre): 0 within the row
        c = (Fraction(1, 4) + sign * centre**2 + centre / 8, -Fraction(1, 8) - sign * 2 * centre, Fraction(sign))
        changed = with_rows(SMALL, {450: (*map(float, c), 0.0)})
        with pytest.raises(ArithmeticError, match="eps may rise in row 450"):
            changed.bounds(450)


def value(row, m):
    """Return p by Horner's rule, exactly."""
    total = Fraction(0)
    for c in reversed(row):
        total = total * m + Fraction(c)
    return total


def test_a_rise_is_relative_to_the_smaller_function():
    """At the first border after the switch eps is above 1/2, so that 1 - eps is the smaller one."""
    table = Polynomials(3, -96, 1, FLOAT)
    index = table.switch
    first, *others = table.rows[index + 1]
    changed = with_rows(table, {index + 1: (first + 0.125, *others)})
    before = value(table.rows[index], table.interval(index)[2])
    after = value(changed.rows[index + 1], table.interval(index)[2])
    assert before > Fraction(1, 2)
    wanted = (after - before) / (1 - before)
    assert wanted <= changed.rise_after(index) <= wanted * (1 + Fraction(1, 100))
    last = table.size - 1
    changed = with_rows(table, {last: (table.rows[last][0] * 2, *table.rows[last][1:])})
    assert changed.rise_after(last - 1) > Fraction(1, 2)
    assert abs(table.rise_after(table.switch - 1)) < Fraction(1, 100)  # from rows of eps - 1 to those of eps


# --- rounding ---------------------------------------------------------------------------------------------------------


def error(table, row, x, kind, start=0):
    """Return the largest rounding error of p, or of the rest of a row of full accuracy, by fractions."""
    exactly = [sum(Fraction(c) * Fraction(v) ** n for n, c in enumerate(row[start:])) for v in x.tolist()]
    variable, result = ("t", "rest") if table is FULL else ("m", "p")
    given = {name: kind(c) for name, c in zip(table.names, row, strict=True)} | {variable: x}
    found = Run(table.sums().program, given, Reading(kind))[result]
    return max(abs(Fraction(v) - e) for v, e in zip(found.tolist(), exactly, strict=True))


@pytest.mark.parametrize("degree", [1, 3, 5, 7])
@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_roundings_of_a_row_stay_within_the_bound_and_come_near_it(degree, kind):
    form = FLOAT if kind is np.float32 else DOUBLE
    table, closest = Polynomials(2, -96, degree, FLOAT), 0.0
    for index in (100, 300, 371, 372, 420, 500):
        for piece in table.pieces(index):
            bound = table.rounding_on(index, piece, form)
            ends = float(piece.centre - piece.half), float(piece.centre + piece.half)
            m = np.random.default_rng(index).uniform(*ends, 250).astype(kind)
            found = error(table, table.row(index), m, kind)
            assert found <= bound
            closest = max(closest, float(found / bound))
    assert closest > 0.5


@pytest.mark.parametrize("index", [100, 487, 488, 1016])
def test_roundings_of_a_row_of_full_accuracy_stay_within_the_bound(index):
    _, start, end = FULL.interval(index)
    centre, half = (start + end) / 2, (end - start) / 2
    rest, _ = FULL.rounding_on(index, fmpq_poly([0, to_fmpq(half)]))
    t = np.random.default_rng(index).uniform(float(start), float(end), 600) - float(centre)
    found = error(FULL, FULL.rows[index], t, np.float64, start=1)
    assert Fraction(1, 5) * rest < found <= rest


@pytest.mark.parametrize("w", [Fraction(1, 2**80), Fraction(1, 8), Fraction(3), Fraction(2**60)])
def test_what_the_rounding_of_w_does_is_within_its_bound(w):
    """W is off by five units, to both sides; at 1/8 that is into another row, whose p means something else."""
    (low, low_loss), (middle, loss), (high, high_loss) = (eps(w * (1 + n * U)) for n in (-5, 0, 5))
    bound = speed_table.eps_error_from_w_rounding(DOUBLE)
    assert max(low - middle, middle - high) / middle <= bound
    assert max(loss - low_loss, high_loss - loss) / loss <= bound
    if w > 1000:  # the slope is nearly 1/3
        assert (low - middle) / middle > bound * Fraction(95, 100)


def test_the_reference_is_known_up_to_its_error_on_both_sides_of_a_border():
    for form in (DOUBLE, FLOAT):
        assert (
            speed_table.eps_error_from_w_rounding(form)
            >= rounding_bounds.rounding_of_w(form) * panel_proof.steepest() / 10 + 4 * E
        )


# --- the full table ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("index", [100, 487, 488, 1016])
def test_bounds_of_a_full_row_count_every_part(index):
    """What is bounded, from its definition."""
    low, *a = map(Fraction, FULL.rows[index][1:])
    _, start, end = FULL.interval(index)
    half, base = (end - start) / 2, FULL.base(index)
    more = Fraction(1, 2**70)
    for piece in FULL.pieces(index):
        plain, wider = (FULL.bounds_on(index, x, 1) for x in (piece, piece._replace(error=piece.error + more)))
        assert wider["relative"] - plain["relative"] > more
        assert wider["ulp"] > plain["ulp"]
        t = fmpq_poly([to_fmpq(piece.centre - (start + end) / 2), to_fmpq(piece.half)])
        machine = fmpq_poly([to_fmpq(c) for c in (Fraction(FULL.rows[index][0]) + low, *a)])(t)
        given = greatest(machine - piece.p) + piece.error
        rest, added = FULL.rounding_on(index, t)
        least = 1 - piece.most if base else piece.least
        assert plain["relative"] == ((given + rest) / piece.least + U) * (1 + U)
        # The sum of what is lost, half a unit of base + high at most, and of the rest is rounded, too.
        lost = U / 2 * (DOUBLE.ulp(1 + Fraction(FULL.rows[index][0])) * 2**53) / 2 if base else 0
        assert rest < added <= rest + U * (abs(low) + sum(abs(c) * half ** (n + 1) for n, c in enumerate(a)) + lost)
        assert plain["ulp"] == Fraction(1, 2) + (given + added) / DOUBLE.ulp(least)


def test_the_unit_is_that_of_the_least_eps():
    """With 1 - eps = 0.45, eps may be below 1/2 if p is known less well: there the unit is half as large."""
    (piece,) = FULL.pieces(100)
    constant = piece._replace(p=fmpq_poly([to_fmpq(Fraction(-45, 100))]))
    near, far = (FULL.bounds_on(100, constant._replace(error=Fraction(error, 1000)), 1)["ulp"] for error in (49, 51))
    assert far > Fraction(19, 10) * near  # nearly all of both is the distance of p from the row


def test_units_in_the_last_place():
    for number, exponent in ((1, -52), (1 - E, -53), (Fraction(1, 2), -53), (Fraction(3, 4), -53), (3, -51)):
        assert DOUBLE.ulp(Fraction(number)) == Fraction(2) ** exponent
    assert DOUBLE.ulp(Fraction(1, 3) / 2**30) == Fraction(2) ** (-2 - 30 - 52)


def test_p_of_1_or_more_is_refused():
    (piece,) = FULL.pieces(100)
    with pytest.raises(ArithmeticError, match="p may vanish"):
        FULL.bounds_on(100, piece._replace(p=fmpq_poly([to_fmpq(Fraction(-6, 5))])), 1)


# --- the ends of a table ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("tier", TIERS)
def test_at_the_ends_of_a_table_a_bound_is_that_of_the_branch_taken(tier):
    """The numbers of the type decide which branch it is, and no bound that covers both is needed."""
    kernel, low = speed_table.speed_table(tier), 2.0 ** TABLES[tier].first
    high = low * 2.0**formulas.OCTAVES
    for w, branch in ((low, 0), (np.nextafter(high, 0), 0), (np.nextafter(low, 0), 1), (high, 1)):
        assert machine.values_and_branches(kernel, "restitution", w, 1.0)[1] == branch
        with working(truth.BITS):
            v_star, (epsilon, loss) = exact_middle(ball_of(Fraction(w)).root(10)), truth.portions_of_w(Fraction(w))
            sizes = exact_middle(epsilon), exact_middle(min(epsilon, loss)), Fraction(w)
        known, both = (
            min(b.allowed(*sizes) for b in bounds if b.holds_at(v_star, sizes[2]))
            for bounds in (kernel.bound("restitution", "host", "double", of) for of in (branch, None))
        )
        inside = kernel.table_bound("restitution", "double").allowed(*sizes)
        assert known == inside if branch == 0 else known < both
        assert both >= max(known, inside)


@pytest.mark.parametrize(("speed", "beta"), [(2.0**-1030, 2.0**204), (1.23e-310, 4e61)])
@pytest.mark.parametrize("tier", TIERS)
def test_a_subnormal_rebound_is_within_the_bound_of_the_table(tier, speed, beta):
    kernel, w = speed_table.speed_table(tier), Fraction(beta) ** 5 * Fraction(speed)
    result, branch = machine.values_and_branches(kernel, "rebound", speed, beta)
    with working(truth.BITS):
        epsilon, loss = truth.portions_of_w(w)
        v_star, value = exact_middle(ball_of(w).root(10)), exact_middle(epsilon) * Fraction(speed)
        smaller, error = exact_middle(min(epsilon, loss)), abs(Fraction(float(result)) - value)
    bounds = [
        bound for bound in kernel.bound("rebound", "host", "double", branch) if bound.holds_at(v_star, Fraction(speed))
    ]
    assert branch == 0
    assert all(error <= bound.allowed(value, smaller, Fraction(speed)) for bound in bounds)


# --- small things -----------------------------------------------------------------------------------------------------


def test_greatest_sees_the_whole_interval():
    for parts in (1, 2, 5, 16):
        for p in (fmpq_poly([1, 1]), fmpq_poly([1, -1]), fmpq_poly([0, 0, 0, -2])):
            assert greatest(p, parts) == 2
