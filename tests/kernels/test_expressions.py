"""Expressions: programs for powers and sums, evaluated exactly."""

from fractions import Fraction

import pytest

from viscopade.kernels.expressions import (
    Literal,
    Name,
    Reading,
    Run,
    Select,
    both,
    by_horner,
    by_powers,
    chain,
    evaluate,
    in_pairs,
    powers,
)
from viscopade.kernels.formulas import letter_terms

EXACTLY = Reading(Fraction)


def test_chains_of_powers():
    steps = chain(frozenset({7, 15, 4}))
    have = {1}
    for step in steps:
        assert {step.left, step.right} <= have
        assert step.power == step.left + step.right
        have.add(step.power)
    assert {7, 15, 4} <= have
    # The shortest addition chains: Knuth, section 4.6.3.
    assert [len(chain(frozenset({n}))) for n in (1, 2, 3, 7, 15, 23, 32, 47)] == [0, 1, 2, 4, 5, 6, 5, 8]
    with pytest.raises(ValueError, match="whole numbers >= 1"):
        chain(frozenset({0, 3}))


def test_sums_with_gaps():
    y, coefficients = Fraction(2, 3), {f"a{k}": Fraction(k + 1) for k in range(9)}
    run = Run(powers("y", {2, 3, 4, 5}), {"y": y, **coefficients}, EXACTLY)
    assert (run["y3"], run["y5"]) == (y**3, y**5)
    for exponents in ((0,), (0, 4, 8), (0, 1, 3), (0, 1, 2, 3, 4)):
        true = sum((k + 1) * y**k for k in exponents)
        assert evaluate(by_powers("y", letter_terms("a", exponents)), run, EXACTLY) == true
        assert evaluate(by_horner("y", letter_terms("a", exponents)), run, EXACTLY) == true
    pairs = in_pairs("y", "y2", [f"a{k}" for k in range(5)])
    assert evaluate(pairs, run, EXACTLY) == sum((k + 1) * y**k for k in range(5))


@pytest.mark.parametrize("x", [False, True])
@pytest.mark.parametrize("y", [False, True])
def test_choices_within_each_other(x, y):
    given, one, two, three = {"x": x, "y": y}, *map(Literal, "123")
    inner = Select(Name("x"), Select(Name("y"), one, two), three)
    assert evaluate(inner, given, EXACTLY) == (1 if y else 2) if x else 3
    assert evaluate(Select(both(Name("x"), Name("y")), one, two), given, EXACTLY) == (1 if x and y else 2)
