"""Errors on a range of eps: no perturbation within a proven bound exceeds them, and some perturbation reaches them."""

from __future__ import annotations

import random
from collections.abc import Iterator
from fractions import Fraction
from itertools import product

import pytest

from viscopade.scene.description import Tolerance
from viscopade.scene.tolerance import HOPELESS, Bound, Errors, allowed, worst

F = Fraction
TINY = F(1, 10**12)
RANGES = [
    (F(1, 10), F(2, 10)),
    (F(1, 10), F(9, 10)),
    (F(4, 10), F(6, 10)),
    (F(1, 2), F(1, 2)),
    (F(6, 10), F(999, 1000)),
    (F(1, 10**9), F(1, 10**8)),
    (1 - F(1, 10**9), 1 - F(1, 10**15)),
    (F(3, 10), F(3, 10)),
]
BOUNDS = [
    Bound(F(1, 1000), F(0)),
    Bound(F(0), F(1, 1000)),
    Bound(F(1, 10), F(1, 20), F(1, 30)),
    Bound(F(1, 10), F(1, 20), F(1, 30), apart=True),
    Bound(F(999, 1000), F(0)),
    Bound(F(4, 10**4), F(1, 2**24), F(6, 2**24), apart=True),
    Bound(F(3, 10**5), F(2, 2**24), F(4, 2**24)),
]


def computed(bound: Bound, eps: Fraction, signs: tuple[int, int, int]) -> tuple[Fraction, Fraction]:
    """Return an eps and a 1 - eps^2 that are as far off as a bound admits."""
    of_both, of_relative, of_loss = signs
    exact = eps + of_both * bound.both * min(eps, 1 - eps)
    rounded = exact + of_relative * bound.relative * eps
    loss = 1 - (exact if bound.apart else rounded) ** 2
    return rounded, loss * (1 + of_loss * bound.loss)


def values(low: Fraction, high: Fraction) -> Iterator[Fraction]:
    generator = random.Random(3)
    yield from (low, high, *(x for x in (F(1, 2),) if low < x < high))
    for _ in range(12):
        yield low + (high - low) * F(generator.random())


def attained(bound: Bound, low: Fraction, high: Fraction) -> Errors:
    found = []
    for eps, signs in product(values(low, high), product((-1, 0, 1), repeat=3)):
        rounded, loss = computed(bound, eps, signs)
        lost = 1 - eps**2
        found.append(Errors(abs(rounded - eps) / eps, abs(loss - lost) / lost, abs(rounded - eps)))
    return worst(found)


@pytest.mark.parametrize("bound", BOUNDS)
@pytest.mark.parametrize("epsilon", RANGES)
def test_no_perturbation_exceeds_the_errors_and_one_reaches_them(
    bound: Bound, epsilon: tuple[Fraction, Fraction]
) -> None:
    stated, found = bound.errors(epsilon), attained(bound, *epsilon)
    for name in vars(stated):
        assert getattr(found, name) <= getattr(stated, name)
        assert getattr(found, name) >= F(9, 10) * getattr(stated, name) * (F(1, 2) if name == "absolute" else 1)
    assert found.absolute > F(1, 2) * stated.absolute


def test_the_share_of_the_smaller_one_is_largest_at_one_half() -> None:
    assert Bound(F(1, 100), F(0)).errors((F(1, 10), F(9, 10))).absolute == F(1, 200)
    assert Bound(F(1, 100), F(0)).errors((F(1, 10), F(2, 10))).absolute == F(1, 500)
    assert Bound(F(1, 100), F(0)).errors((F(8, 10), F(9, 10))).absolute == F(1, 500)


def test_dissipation_near_one_is_bounded_only_if_it_is_computed_apart() -> None:
    near = (1 - F(1, 10**18), F(1))
    apart = Bound(F(1, 1000), F(1, 2**24), F(1, 2**22), apart=True).errors(near)
    assert F(1, 1000) <= apart.dissipation < F(1001, 10**6)
    assert Bound(F(1, 1000), F(1, 2**24)).errors(near).dissipation == HOPELESS
    assert Bound(F(1, 1000), F(0)).errors(near).dissipation == F(1, 1000)


@pytest.mark.parametrize("measure", ["both", "relative"])
@pytest.mark.parametrize(
    "tolerance",
    [
        Tolerance(epsilon=1e-4),
        Tolerance(dissipation=1e-6),
        Tolerance(absolute=1e-3),
        Tolerance(epsilon=1e-4, dissipation=3e-5, absolute=1e-3),
    ],
)
@pytest.mark.parametrize("ranges", [[RANGES[0]], [RANGES[4]], [RANGES[0], RANGES[4]], RANGES])
def test_allowed_is_the_largest_error_that_keeps_the_tolerance(tolerance: Tolerance, ranges, measure: str) -> None:
    limit = allowed(tolerance, ranges, measure)

    def failing(size: Fraction) -> list[str]:
        bound = Bound(size, F(0)) if measure == "both" else Bound(F(0), size)
        return worst([bound.errors(epsilon) for epsilon in ranges]).failing(tolerance)

    assert not failing(limit * F(99, 100))
    assert failing(limit * F(101, 100))


def test_a_tolerance_is_the_decimal_that_was_written() -> None:
    at = Errors(F(1, 10), F(1, 10), F(1, 10))
    assert at.failing(Tolerance(epsilon=0.1)) == []
    assert Errors(F(1, 10) + TINY**2, F(0), F(0)).failing(Tolerance(epsilon=0.1, absolute=0.1)) == ["epsilon"]
    assert at.failing(Tolerance(dissipation=0.09, absolute=0.2)) == ["dissipation"]


def test_the_worst_of_errors_is_the_worst_of_each() -> None:
    first, second = Errors(F(1), F(2), F(3)), Errors(F(3), F(1), F(2))
    assert worst([first, second]) == first.worse(second) == Errors(F(3), F(2), F(3))
    assert worst([first]) == first
