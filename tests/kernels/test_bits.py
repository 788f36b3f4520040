"""Bits of numbers as expressions: the row of every number, read from what code is written from, and its text."""

from fractions import Fraction

import numpy as np
import pytest

from viscopade.arithmetic.formats import DOUBLE, FLOAT, FORMATS
from viscopade.kernels.expressions import (
    Call,
    CodeBranch,
    Literal,
    Name,
    Negation,
    Reading,
    Run,
    Select,
    Statement,
    Word,
    both,
    equal,
    evaluate,
    operations,
    prepared,
    read,
)
from viscopade.kernels.forms import last_place
from viscopade.kernels.forms.bits import power_of_two
from viscopade.kernels.forms.speed_kernel import TABLES
from viscopade.kernels.forms.speed_table import SMALLEST, TABLE
from viscopade.kernels.forms.speed_table_last_place import LastPlaceTable
from viscopade.kernels.machine import TYPES, machine_arithmetic, rows_of
from viscopade.kernels.rounding_bounds import rounding_of_w
from viscopade.kernels.targets.syntax import Syntax, of_c, text

TABLES_AND_TYPES = [(table, form) for table in (*TABLES.values(), LastPlaceTable()) for form in FORMATS.values()]


@pytest.mark.parametrize(("table", "form"), TABLES_AND_TYPES, ids=str)
def test_the_first_and_the_last_number_of_every_row_lead_to_it(table, form):
    """So do all between them: the index grows with the bits."""
    kind, one = TYPES[form.name], Fraction(1)
    ends = [table.interval(index) for index in range(table.size)]
    low = np.array([float(m * Fraction(2) ** e) for e, m, _ in ends], kind)
    above = np.array([float(m * Fraction(2) ** e) for e, _, m in ends])  # the last one overflows in no type
    high = np.nextafter(above.astype(kind), kind(0))
    assert [Fraction(float(x)) for x in low] == [m * Fraction(2) ** e for e, m, _ in ends]
    expected = np.arange(table.size)
    for w in (low, high):
        run = Run(table.branch(form).program, {"w": w, TABLE: rows_of(table, DOUBLE)}, machine_arithmetic(form))
        assert evaluate(table.within(form), run, machine_arithmetic(form)).all()
        assert np.array_equal(run["index"], expected)
        assert np.array_equal(run["row"], np.array(table.rows))
        assert [Fraction(float(x)) for x in run["middle"]] == [table.centre(i) for i in expected]
        assert np.array_equal(run["base"], [table.base(i) for i in expected])
        assert np.array_equal(run["rest_of_base"], 1 - run["base"])
        exponents = np.array([float(2 * one**e) for e, _, _ in ends])
        assert ((run["m"] >= 1) & (run["m"] < exponents)).all()
        assert np.array_equal(np.ldexp(run["m"], [e for e, _, _ in ends]), w)
        assert np.array_equal(run["t"].astype(float), run["m"].astype(float) - run["middle"])


@pytest.mark.parametrize(("table", "form"), TABLES_AND_TYPES, ids=str)
def test_numbers_outside_of_a_table_are_known(table, form):
    kind, by = TYPES[form.name], machine_arithmetic(form)
    low, high = (kind(end) for end in table.ends)
    w = np.array([np.nextafter(low, kind(0)), high, 0, -0.0, np.inf, np.nan, -1, -low], kind)
    assert not evaluate(table.within(form), Run(table.branch(form).program, {"w": w}, by), by).any()
    smallest = kind(2.0 ** (1 - form.largest))
    for scale, inside in ((smallest, True), (np.nextafter(smallest, kind(0)), False)):
        given = {"w": np.array([low, 1], kind), "scale": scale, SMALLEST: smallest}
        assert (evaluate(table.holds(form), Run(table.branch(form).program, given, by), by) == inside).all()


@pytest.mark.parametrize(("table", "form"), TABLES_AND_TYPES, ids=str)
def test_a_table_gives_arrays_of_any_shape_what_it_gives_numbers(table, form):
    speed = (2.0 ** np.array([[-110, -20, -1], [0.5, 20, 110]])).astype(TYPES[form.name])
    values, within = table.evaluated_in(form, "restitution", speed, 1.5)
    assert within.tolist() == [[False, True, True], [True, True, False]]
    for place in np.argwhere(within):
        found, inside = table.evaluated_in(form, "restitution", speed[tuple(place)], 1.5)
        assert inside
        assert found.dtype == values.dtype == speed.dtype
        assert found == values[tuple(place)]


def test_the_first_and_the_last_number_of_every_panel_lead_to_it():
    panels, by = last_place.smaller_panels(), machine_arithmetic(DOUBLE)
    low = np.array([float(panel.centre - panel.half) for panel in panels])
    high = np.nextafter(np.array([float(panel.centre + panel.half) for panel in panels]), 0)
    for x in (low, high):
        run = Run(last_place.panel_branch().program, {"bits": x.view(np.uint64)}, by)
        assert np.array_equal(run["index"], np.arange(len(panels)) + 1)
        assert np.array_equal(run["elastic"], [panel.elastic for panel in panels])
    assert np.array_equal(low.view(np.uint64)[0], last_place.near_bits().value)


def test_large_numbers_are_divided_by_a_power_of_eight():
    exponents = np.arange(-1, last_place.LARGEST)
    x = np.ldexp(1.375, exponents)
    run = Run(last_place.fold_program(), {"bits": x.view(np.uint64)}, machine_arithmetic(DOUBLE))
    s = run["folded"].astype(np.uint64).view(np.float64)
    n = np.maximum(exponents - last_place.FOLD, 0) // 3
    assert np.array_equal(s * 8.0**n, x)


def test_all_five_roundings_of_w_can_add():
    """Near 1, where a rounding changes the most: errors beyond four units are found, none beyond the bound."""
    u, generator = Fraction(1, 2**24), np.random.default_rng(5)
    steps = generator.integers(1, 60_000, (2, 400_000)).astype(np.float32)
    beta, speed = 1 + steps * np.float32(2) ** -23
    square = beta * beta
    found = (square * square * beta * speed).astype(np.longdouble)
    exactly = beta.astype(np.longdouble) ** 5 * speed.astype(np.longdouble)
    at = int(np.argmax(np.abs(found / exactly - 1)))
    error = abs(Fraction(float(found[at])) / (Fraction(float(beta[at])) ** 5 * Fraction(float(speed[at]))) - 1)
    assert 4 * u < error <= rounding_of_w(FLOAT) < Fraction(501, 100) * u


x, n, yes = map(Name, ("x", "n", "yes"))
COUNT = Word(3, pattern=False)


@pytest.mark.parametrize(
    ("expression", "written"),
    [
        ((x & Word(255)) | power_of_two(FLOAT, 0), "(x & UINT32_C(0xff)) | UINT32_C(0x3f800000)"),
        (Word(0, pattern=False) - ((x - n) >> COUNT), "0 - ((x - n) >> 3)"),
        (x - ((COUNT * n) << COUNT), "x - ((3 * n) << 3)"),
        (x & ~Word(7), "x & ~UINT32_C(0x7)"),
        ((x - COUNT) // COUNT, "(x - 3) / 3"),
        (x + Select(yes, -n, n), "x + (yes ? -n : n)"),
        (-(x + n), "-(x + n)"),
        (Negation("-", -x), "-(-x)"),
        (-Literal("-1.5"), "-(-1.5f)"),
        (equal(x & n, yes), "(x & n) == yes"),
        (Select(Select(x, yes, n), x, yes), "(x ? yes : n) ? x : yes"),
        (Select(equal(yes, n < x), x, n), "yes == (n < x) ? x : n"),
        (both(both(x < n, x >= n), yes), "x < n && x >= n && yes"),
        (Call("f", (Select(yes, x, Literal("1.0")),)), "f(yes ? x : 1.0f)".replace("f(", "ff(")),
    ],
)
def test_text_of_words_and_conditions(expression, written):
    assert text(expression, of_c(FLOAT)) == written


def test_conditions_of_arrays_are_in_parentheses():
    assert text(both(x >= n, x <= yes), Syntax(both="&")) == "(x >= n) & (x <= yes)"


def test_a_prepared_branch_is_read_like_the_branch():
    """Of a choice, one part is computed: the other would divide by 0."""
    chosen, exactly = Select(x <= n, x * n, n / (x - n)), Reading(Fraction)
    branch = CodeBranch(
        x < n, (Statement("y", chosen), Statement("unused", n / (x - x))), {"z": Name("y") + Literal("0.5")}
    )
    ready = prepared(branch, exactly)
    for value, y in ((0, 0), (2, 4), (3, 2)):
        given = {"x": Fraction(value), "n": Fraction(2)}
        for form in (branch, ready):
            assert read(form, ["y", "z"], given, exactly) == {"y": y, "z": y + Fraction(1, 2)}
            assert evaluate(form.guard, given, exactly) == (value < 2)


def test_of_a_choice_the_costlier_part_counts():
    expression = x + Select(yes, n * n * n, n - x)
    assert operations((), expression) == {"+": 1, "*": 2}
    # A variable that both parts need counts in either.
    program = (Statement("p", x * x * x),)
    assert operations(program, Select(yes, Name("p"), Name("p") - x)) == {"*": 2, "-": 1}
    assert operations(program, Select(yes, Name("p"), Name("p") - x) + Name("p")) == {"*": 2, "-": 1, "+": 1}
    assert operations(program, Select(yes, Name("p"), x) + Name("p")) == {"*": 4, "+": 1}
