"""Errors on a range of eps: no perturbation within a proven bound exceeds them, and some perturbation reaches them."""

from __future__ import annotations

import math
import random
from dataclasses import replace
from fractions import Fraction
from itertools import product

import pytest

from viscopade.kernels import compact
from viscopade.kernels.arithmetic import DEVICE, HOST, HOST_FLOAT
from viscopade.kernels.bound import ErrorBound
from viscopade.scene.description import Tolerance
from viscopade.scene.tolerance import (
    HOPELESS,
    MEASURES,
    Range,
    allowed,
    errors_of,
    errors_on,
    excess,
    failing,
    product_rounding,
    worst_errors,
)

F = Fraction
RANGES = [
    (F(1, 10), F(2, 10)),
    (F(1, 10), F(9, 10)),
    (F(4, 10), F(6, 10)),
    (F(1, 2), F(1, 2)),
    (F(6, 10), F(999, 1000)),
    (F(1, 10**9), F(1, 10**8)),
    (1 - F(1, 10**9), 1 - F(1, 10**15)),
]

ZERO = F(0)


def bound(relative_to: str, formula: Fraction, last: Fraction = ZERO, arithmetic=HOST) -> ErrorBound:
    return ErrorBound("epsilon", F(0), math.inf, relative_to, formula, last=last, arithmetic=arithmetic)


BOUNDS = [
    bound("smaller", F(1, 1000)),
    bound("value", F(1, 1000)),
    bound("smaller", F(1, 10), F(1, 20)),
    bound("smaller", F(999, 1000)),
    bound("smaller", F(3, 10**5), F(1, 2**23), HOST_FLOAT),
]


def attained(of: ErrorBound, low: Fraction, high: Fraction) -> dict[str, Fraction]:
    """Return the largest errors of an eps, and of its (1 - eps) (1 + eps), that are as far off as a bound admits."""
    generator, found = random.Random(3), []
    values = [low, high, *(low + (high - low) * F(generator.random()) for _ in range(12))]
    values += [F(1, 2)] if low < F(1, 2) < high else []
    share, relative = (of.formula, of.last) if of.relative_to == "smaller" else (0, of.formula + of.last)
    for eps, signs in product(values, product((-1, 0, 1), repeat=3)):
        computed = eps + signs[0] * share * min(eps, 1 - eps) + signs[1] * relative * eps
        lost = (1 - computed**2) * (1 + signs[2] * product_rounding(of.arithmetic))
        off = abs(computed - eps)
        found.append(
            {"epsilon": off / eps, "dissipation": abs(lost - 1 + eps**2) / (1 - eps**2), "absolute": off}
        )  # fmt: skip
    return worst_errors(found)


@pytest.mark.parametrize("of", BOUNDS)
@pytest.mark.parametrize("epsilon", RANGES)
def test_no_perturbation_exceeds_the_errors_and_one_reaches_them(of: ErrorBound, epsilon) -> None:
    stated, found = errors_of(of, epsilon), attained(of, *epsilon)
    for name in MEASURES:
        assert found[name] <= stated[name]
        assert found[name] >= F(9, 10) * stated[name] * (F(1, 2) if name == "absolute" else 1)


def test_absolute_parts_of_bounds_count() -> None:
    tiny = ErrorBound("epsilon", F(0), math.inf, "value", F(0), ulps=F(1), absolute=F(2**1000))
    found = errors_of(tiny, (F(1, 8), F(1, 2)))
    assert found["epsilon"] == HOST.ulp + 8 * 2**1000 * HOST.form.smallest
    assert errors_of(replace(tiny, absolute=ZERO), (F(6, 10), F(7, 10)))["epsilon"] == HOST.ulp / 2 / F(6, 10)
    assert found["absolute"] == HOST.ulp / 2 + 2**1000 * HOST.form.smallest


def test_dissipation_near_one_is_bounded_only_if_it_is_computed_apart() -> None:
    near = (1 - F(1, 10**18), F(1))
    assert errors_of(bound("smaller", F(1, 1000), F(1, 2**24)), near)["dissipation"] == HOPELESS
    assert errors_of(bound("smaller", F(1, 1000)), near)["dissipation"] < F(1001, 10**6)
    kernel, v_star = compact.compact("1e-5"), (F(1, 10**9), F(1, 10**8))
    where = Range(v_star, (1 - F(2, 10**16), 1 - F(1, 10**18)), (F(1), F(1)))
    found = errors_on(kernel, "restitution", [HOST], [where])
    assert found["dissipation"] < F(1, 10**5)


def test_errors_are_those_of_the_worst_range_and_machine_and_none_where_nothing_is_proven() -> None:
    kernel = compact.compact("1e-3")

    def errors(arithmetics, *ranges):
        return errors_on(kernel, "restitution", arithmetics, [Range(v, e, (F(1), F(1))) for v, e in ranges])

    low, high = ((F(1, 10), F(2, 10)), (F(9, 10), F(99, 100))), ((F(1), F(2)), (F(1, 10), F(4, 10)))
    assert errors([HOST_FLOAT], low, high) == worst_errors([errors([HOST_FLOAT], low), errors([HOST_FLOAT], high)])
    assert errors([HOST_FLOAT, DEVICE], low) == worst_errors([errors([HOST_FLOAT], low), errors([DEVICE], low)])
    assert errors([HOST_FLOAT], low, ((F(1), F(10**5)), (F(1, 10**9), F(1, 3)))) is None


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
def test_allowed_is_the_largest_error_within_the_tolerance(tolerance: Tolerance, ranges) -> None:
    limit = allowed(tolerance, ranges)

    def fails(size: Fraction) -> bool:
        of = bound("smaller", size)
        return bool(failing(worst_errors(errors_of(of, epsilon) for epsilon in ranges), tolerance))

    assert not fails(limit * F(99, 100))
    assert fails(limit * F(101, 100))


def test_a_tolerance_is_the_decimal_that_was_written() -> None:
    at = dict.fromkeys(MEASURES, F(1, 10))
    assert failing(at, Tolerance(epsilon=0.1)) == ()
    assert failing(at | {"epsilon": F(1, 10) + F(1, 10**24)}, Tolerance(epsilon=0.1, absolute=0.1)) == ("epsilon",)
    assert failing(at, Tolerance(dissipation=0.09, absolute=0.2)) == ("dissipation",)
    assert excess(at, Tolerance(dissipation=0.05, absolute=0.2)) == (2, "dissipation")
