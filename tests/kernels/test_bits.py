"""Bits of numbers as expressions: the row of every number, read from what code is written from, and its text."""

from fractions import Fraction

import numpy as np
import pytest

from viscopade.arithmetic.formats import DOUBLE, FLOAT
from viscopade.arrays import double
from viscopade.kernels import full
from viscopade.kernels.expressions import (
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
    read,
)
from viscopade.kernels.formulas import OCTAVES
from viscopade.kernels.machine import TYPES, machine_arithmetic, values_and_branches
from viscopade.kernels.rounding_bounds import rounding_of_w
from viscopade.kernels.speed_table import TABLES, row_number, speed_table
from viscopade.kernels.write import languages
from viscopade.kernels.write.writer import expression_text

CASES = [(key, form) for key in TABLES for form in (DOUBLE, FLOAT)]


def run(key, form, **given):
    """Return the values of a table's program for arrays, and its guard."""
    kernel, kind, by = speed_table(key), TYPES[form.name], machine_arithmetic(form)
    function = kernel.function("restitution")
    branch, _ = function.branches
    table = np.array(kernel.tables[0].rows, kind)
    values = Run((*function.start, *branch.program), {"table": table, "smallest": kind(form.least), **given}, by)
    return values, evaluate(branch.guard, {**given, "scale": kind(1), **values} | {"place": values["place"]}, by)


@pytest.mark.parametrize(("key", "form"), CASES, ids=str)
def test_the_first_and_the_last_number_of_every_row_lead_to_it(key, form):
    """So do all between them: the index grows with the bits."""
    table, kind = TABLES[key], TYPES[form.name]
    ends = [table.interval(index) for index in range(table.size)]
    low = np.array([float(m * Fraction(2) ** e) for e, m, _ in ends], kind)
    above = np.array([float(m * Fraction(2) ** e) for e, _, m in ends])  # the last one overflows in no type
    high = np.nextafter(above.astype(kind), kind(0))
    expected = np.arange(table.size)
    for w in (low, high):
        values, inside = run(key, form, w=w, scale=kind(1))
        assert np.all(inside)
        assert np.array_equal(evaluate(row_number(table), values, machine_arithmetic(form)), expected)
        assert np.array_equal(values["row"], np.array(table.rows, kind))
        assert np.array_equal(values["base"], [table.base(i) for i in expected])
        assert np.array_equal(values["rest_of_base"], 1 - values["base"])
        assert np.array_equal(np.ldexp(values["m"], [e for e, _, _ in ends]), w)
        centres = np.array([float(table.centre(i)) for i in expected])
        assert np.array_equal(values["t"].astype(float), values["m"].astype(float) - centres)


@pytest.mark.parametrize(("key", "form"), CASES, ids=str)
def test_numbers_outside_of_a_table_are_known(key, form):
    kind, first = TYPES[form.name], TABLES[key].first
    low, high = kind(2.0**first), kind(2.0 ** (first + OCTAVES))
    w = np.array([np.nextafter(low, kind(0)), high, 0, -0.0, np.inf, np.nan, -1, -low], kind)
    assert not np.any(run(key, form, w=w, scale=kind(1))[1])
    smallest = kind(form.least)
    for scale, inside in ((smallest, True), (np.nextafter(smallest, kind(0)), False)):
        assert np.all(run(key, form, w=np.array([low, 1], kind), scale=scale)[1] == inside)


@pytest.mark.parametrize(("key", "form"), CASES, ids=str)
def test_a_table_gives_arrays_of_any_shape_what_it_gives_numbers(key, form):
    """Beyond the table, the kernel of v* serves, which is another branch."""
    kernel, kind = speed_table(key), TYPES[form.name]
    speed = (2.0 ** np.array([[-110, -20, -1], [0.5, 20, 110]])).astype(kind)
    values, branch = values_and_branches(kernel, "restitution", speed, 1.5, form=form)
    assert (branch == 0).tolist() == [[False, True, True], [True, True, False]]
    assert branch.max() == 1
    assert np.allclose(values, double.epsilon((speed.astype(float) * 1.5**5) ** 0.1), rtol=1e-5, atol=0)
    for place in np.ndindex(speed.shape):
        found, _ = values_and_branches(kernel, "restitution", speed[place], 1.5, form=form)
        assert found.dtype == values.dtype == speed.dtype
        assert found == values[place]


def of_panel(name, x):
    function = full.full().function(name)
    program = (*function.start, *function.branches[-1].program)
    table = np.array(full.panel_table())
    return Run(program, {"v_star": x, "panels": table}, machine_arithmetic(DOUBLE))


@pytest.mark.parametrize("function", full.FUNCTIONS)
def test_the_first_and_the_last_number_of_every_panel_lead_to_it(function):
    panels = [panel for panel in full.smaller_panels() if function == "epsilon" or panel.centre < 2**full.FOLD]
    low = np.array([float(panel.centre - panel.half) for panel in panels])
    high = np.nextafter(np.array([float(panel.centre + panel.half) for panel in panels]), 0)
    for x in (low, high):
        values = of_panel(function, x)
        assert np.array_equal(values["index"], np.arange(len(panels)) + 1)
        assert np.array_equal(values["elastic"], [panel.elastic for panel in panels])


def test_large_numbers_are_divided_by_a_power_of_eight():
    exponents = np.arange(-1, full.ZERO_EXPONENT)
    x = np.ldexp(1.375, exponents)
    s = of_panel("epsilon", x)["folded"].astype(np.uint64).view(np.float64)
    assert np.array_equal(s * 8.0 ** (np.maximum(exponents - full.FOLD, 0) // 3), x)


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
        ((x & Word(255)) | full.power_of_two(0), "(x & UINT32_C(0xff)) | UINT32_C(0x3f800000)"),
        (Word(0, pattern=False) - ((x - n) >> COUNT), "0 - ((x - n) >> 3)"),
        (x - ((COUNT * n) << COUNT), "x - ((3 * n) << 3)"),
        (x & ~Word(7), "x & ~UINT32_C(0x7)"),
        ((x - COUNT) // COUNT, "(x - 3) / 3"),
        (x + Select(yes, -n, n), "x + (yes ? -n : n)"),
        (-(x + n), "-(x + n)"),
        (Negation("-", -x), "-(-x)"),
        (equal(x & n, yes), "(x & n) == yes"),
        (Select(Select(x, yes, n), x, yes), "(x ? yes : n) ? x : yes"),
        (both(both(x < n, x >= n), yes), "x < n && x >= n && yes"),
        (full.from_bits(full.bits(x)), "viscopade_from_bitsf(viscopade_bitsf(x))"),
    ],
)
def test_text_of_words_and_conditions(expression, written):
    language = languages.language("c")
    assert expression_text(full.full(), expression, language, language.number("float")) == written


def test_of_a_choice_one_part_is_computed():
    """The other would divide by 0."""
    chosen, exactly = Select(x <= n, x * n, n / (x - n)), Reading(Fraction)
    branch = CodeBranch(
        x < n, (Statement("y", chosen), Statement("unused", n / (x - x))), {"z": Name("y") + Literal("0.5")}
    )
    for value, y in ((0, 0), (2, 4), (3, 2)):
        given = {"x": Fraction(value), "n": Fraction(2)}
        assert read(branch, ["y", "z"], given, exactly) == {"y": y, "z": y + Fraction(1, 2)}
        assert evaluate(branch.guard, given, exactly) == (value < 2)


def test_of_a_choice_the_costlier_part_counts():
    expression = x + Select(yes, n * n * n, n - x)
    assert operations((), expression) == {"+": 1, "*": 2}
    # A variable that both parts need counts in either.
    program = (Statement("p", x * x * x),)
    assert operations(program, Select(yes, Name("p"), Name("p") - x)) == {"*": 2, "-": 1}
    assert operations(program, Select(yes, Name("p"), Name("p") - x) + Name("p")) == {"*": 2, "-": 1, "+": 1}
    assert operations(program, Select(yes, Name("p"), x) + Name("p")) == {"*": 4, "+": 1}
