"""The kernel that is chosen is the cheapest within the tolerance, and what is said of the others is true."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from viscopade.arrays import double
from viscopade.collision import exact
from viscopade.kernels import catalogue, compact, quotient
from viscopade.kernels.machine import function_values
from viscopade.scene import candidate
from viscopade.scene.candidate import AS_CHEAP, constant, in_format, interval, uncovered
from viscopade.scene.choice import Choice, choose
from viscopade.scene.description import Body, Code, Material, Meeting, Scene, Sizes, Speeds, Tolerance
from viscopade.scene.encounter import scene_encounters
from viscopade.scene.tolerance import failing
from viscopade.scene.units import Scale

SIZE = Sizes(0.01, 0.01, 0.01)


def material(v_star: float) -> Material:
    """Return one with which v* of equal spheres at 1 m/s is given."""
    pair = scene_encounters(_scene([(1.0, 1.0)], Tolerance(epsilon=0.1), Code(), [Material(1e9, 0.3, 1000.0, 1e-6)]))[
        0
    ].pair
    return Material(1e9, 0.3, 1000.0, 1e-6 * v_star**2 / float(pair.beta))


def _scene(speeds, tolerance, code, materials) -> Scene:
    names = [f"m{i}" for i in range(len(materials))]
    return Scene(
        "s.toml", "s", "s", dict(zip(names, materials, strict=True)), {n: Body(n, SIZE) for n in names},
        tuple(Meeting(n, n, Speeds.between(*s)) for n, s in zip(names, speeds, strict=True)), tolerance, code,
    )  # fmt: skip


def scene(*ranges: tuple[float, float], code: Code | None = None, **tolerance: float) -> Scene:
    """Return a scene with a pair for each range of v*."""
    speeds = [(1.0, (high / low) ** 10) for low, high in ranges]
    return _scene(speeds, Tolerance(**tolerance), code or Code(), [material(low) for low, _ in ranges])


def ready(language: str = "c", form: str = "double", **more) -> Code:
    return Code(language, form, **more)


def is_sound(choice: Choice) -> None:
    """Check what must hold of every choice."""
    chosen = choice.chosen
    assert [offer.rank for offer in choice.offers] == sorted(offer.rank for offer in choice.offers)
    assert not choice.chosen.failing
    for offer in choice.offers:
        assert offer.failing == failing(offer.errors, choice.scene.tolerance)
        if not offer.failing:
            assert offer.cost * AS_CHEAP >= chosen.cost
            if offer.cost < chosen.cost:
                assert offer.kernel.bytes > chosen.kernel.bytes or offer.degrees is not None
                assert offer.label in choice.reason
                assert "hardly cheaper" in choice.reason


def is_sound_or_refused(asked: Scene) -> None:
    """Check a choice, or a refusal in one line: then no candidate suffices."""
    try:
        is_sound(choose(asked))
    except ValueError as refused:
        if not re.fullmatch(r"s\.toml: .*expected.*", str(refused)):
            raise
        assert all(failing(c.errors, asked.tolerance) for c in candidate.candidates(asked, scene_encounters(asked)))


# --- the cheapest -----------------------------------------------------------------------------------------------------

TOLERANCES = [{name: size} for name in ("epsilon", "dissipation", "absolute") for size in (1e-2, 3e-4, 1e-7)]


@pytest.mark.parametrize("tolerance", TOLERANCES, ids=str)
def test_the_cheapest_of_ready_kernels(tolerance: dict[str, float]) -> None:
    ranges = [(0.01, 0.05), (0.3, 1.5), (2.0, 6.0)]
    codes = ready("cuda"), ready("cuda", "float"), ready("javascript")
    for code in codes if min(tolerance.values()) > 1e-6 else codes[:2]:  # a refusal tries every kernel
        for pairs in (ranges[:1], ranges[1:2], ranges):
            is_sound_or_refused(scene(*pairs, code=code, **tolerance))


@pytest.mark.parametrize(
    ("code", "tolerance"),
    [
        (ready(), {"epsilon": 1e-6}),
        (ready(form="float"), {"dissipation": 1e-5}),
        (ready(argument="v_star"), {"dissipation": 1e-4}),
        (ready("python"), {"absolute": 1e-9, "epsilon": 1e-3}),
    ],
    ids=["c", "float", "v_star", "python"],
)
def test_the_cheapest_of_all_kinds(code: Code, tolerance: dict[str, float]) -> None:
    is_sound(choose(scene((0.3, 0.9), (0.4, 1.3), code=code, **tolerance)))


@pytest.mark.parametrize(("ends", "dearer"), [((0.3, 0.9), 0.0), ((0.02, 3.0), 100.0)])
def test_a_quotient_is_chosen_only_where_it_is_clearly_cheaper_than_a_compact_kernel(monkeypatch, ends, dearer) -> None:
    asked = scene(ends, code=ready("rust"), epsilon=1e-3)
    assert choose(asked).chosen.kernel.name == "compact_1em3"
    whole = candidate.weighted_operations

    def cost(kernel, *rest):
        return whole(kernel, *rest) + dearer * (kernel.argument == "speed")

    monkeypatch.setattr(candidate, "weighted_operations", cost)
    found = choose(asked)
    is_sound(found)
    assert (found.chosen.degrees is not None) == (dearer > 0)


def test_tables_that_are_too_large_are_not_offered() -> None:
    asked = {"epsilon": 1e-5}
    large = choose(scene((0.2, 5.0), code=ready(largest_table=100_000), **asked))
    assert large.chosen.kernel.bytes == 65536
    (smaller,) = [text for text in large.notes if "code.largest_table" in text]
    assert re.fullmatch(r"For a smaller table \(8,192 bytes, cost \d+\): code.largest_table = 8192", smaller)
    assert choose(scene((0.2, 5.0), code=ready(largest_table=10_000), **asked)).chosen.kernel.bytes == 8192
    ranges = (0.2, 2000.0)  # no quotient on the interval
    assert choose(scene(ranges, code=ready(largest_table=0), **asked)).chosen.kernel.name == "compact_1em5"
    with pytest.raises(ValueError, match=r"tables of at most 0 bytes\) reaches on this scene"):
        choose(scene(ranges, code=ready(largest_table=0), epsilon=1e-9))


# --- errors on the scene ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("ends", [(0.25, 0.8), (0.02, 0.9), (0.002, 0.3)])
def test_a_quotient_goes_on_beyond_the_scene(ends: tuple[float, float]) -> None:
    """20 % in speed are 1.8 % in v*."""
    asked = scene(ends, code=ready(argument="v_star"), dissipation=2e-5)
    (met,) = scene_encounters(asked)
    found = candidate.best_quotient(asked, [met])
    assert found is not None
    for beyond in (met.v_star[0] / Fraction("1.018"), met.v_star[1] * Fraction("1.018")):
        assert math.isfinite(function_values(found.kernel, "epsilon", float(beyond)))
    assert math.isnan(function_values(found.kernel, "epsilon", float(met.v_star[1] * Fraction("1.1"))))


def test_ranges_of_type_float_are_wider_and_those_of_quotients_hold_them() -> None:
    (met,) = scene_encounters(scene((0.9999999, 1.9999999), epsilon=1e-3))
    narrow, wide = in_format(met, ready()), in_format(met, ready(form="float"))
    assert narrow == (met.v_star, met.epsilon)
    assert wide[0][0] < narrow[0][0] < narrow[0][1] < wide[0][1]
    # eps at the ends of the wider range is in the wider range of eps.
    for end, v_star in zip(wide[1][::-1], wide[0], strict=True):
        eps = Fraction(exact.collision(v_star, 20).decimals()["epsilon"])
        assert wide[1][0] <= eps <= wide[1][1]
        assert abs(end - eps) < Fraction(1, 10**4)
    low, high = interval([met], ready(form="float"))
    assert low <= wide[0][0] / Fraction("1.018") < wide[0][1] * Fraction("1.018") <= high == Fraction("2.05")
    assert interval([met], ready())[1] == Fraction("2.04")


def decimals(asked: Scene) -> tuple[float, ...]:
    return constant(asked, scene_encounters(asked)).kernel.lists[candidate.VALUES]


@pytest.mark.parametrize("form", ["double", "float"])
def test_constants_are_rounded_to_the_format(form: str) -> None:
    """At a single speed only rounding is left."""
    kind, unit = (np.float32, 2.0**-24) if form == "float" else (np.float64, 2.0**-53)
    for name, size in (("epsilon", unit / 8), ("epsilon", 1e-3), ("absolute", 1e-6), ("dissipation", 1e-2)):
        asked = scene((0.7, 0.7), code=ready("cuda", form), **{name: size})
        (met,) = scene_encounters(asked)
        value, errors = Fraction(float(kind(decimals(asked)[0]))), constant(asked, [met]).errors
        for eps in met.epsilon:
            assert abs(value - eps) / eps <= errors["epsilon"]
            assert abs(value - eps) <= errors["absolute"]
            assert abs((1 - value**2) - (1 - eps**2)) / (1 - eps**2) < errors["dissipation"]
        if size != 1e-6:
            assert bool(failing(errors, asked.tolerance)) == (size < 1e-6)


@pytest.mark.parametrize("ranges", [(0.5, 0.5), (3.0, 30.0)])
@pytest.mark.parametrize("name", ["epsilon", "dissipation", "absolute"])
def test_a_constant_is_found_as_soon_as_there_is_one(ranges: tuple[float, float], name: str) -> None:
    low, high = scene_encounters(scene(ranges, epsilon=0.5))[0].epsilon
    # The least tolerance that a constant can have.
    least = {
        "epsilon": (high - low) / (high + low),
        "absolute": (high - low) / 2,
        "dissipation": (high**2 - low**2) / (2 - high**2 - low**2),
    }[name]
    for share, fails in ((Fraction(101, 100), False), (Fraction(99, 100), True)):
        limit = float(least * share) + 1e-14 * (not fails)
        asked = scene(ranges, code=ready("cuda"), **{name: limit})
        if limit > 1e-9 or not fails:
            assert bool(failing(constant(asked, scene_encounters(asked)).errors, asked.tolerance)) == fails


# --- extremes ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("ends", [(1.01e-30, 1e-29), (1e-9, 1e-4), (1e29, 9.9e29)])
@pytest.mark.parametrize("code", [ready("python"), ready("javascript"), ready(form="float")], ids=str)
@pytest.mark.parametrize("tolerance", [{"epsilon": 1e-3}, {"dissipation": 1e-2}, {"absolute": 1e-6}], ids=str)
def test_extreme_v_star_gets_a_kernel_or_a_clear_refusal(ends, code: Code, tolerance: dict[str, float]) -> None:
    is_sound_or_refused(scene(ends, code=code, **tolerance))


def test_tables_compute_dissipation_of_nearly_elastic_collisions() -> None:
    """1 - eps is 1e-30 there: eps is 1 in all formats, but 1 - eps^2 has its digits."""
    assert not choose(scene((1e-16, 1e-15), dissipation=1e-2)).chosen.is_constant
    assert choose(scene((1e-16, 1e-15), epsilon=1e-2)).chosen.is_constant


@pytest.mark.parametrize("ends", [(1e-5, 1e-3), (10.0, 1e4)])
@pytest.mark.parametrize("language", ["cuda", "rust"])
def test_compact_kernels_of_type_float_are_not_offered_beyond_their_domain(ends, language: str) -> None:
    asked = scene(ends, code=ready(language, "float"), dissipation=1e-5, epsilon=1e-4)
    assert all(c.is_constant or c.degrees for c in candidate.candidates(asked, scene_encounters(asked)))
    with pytest.raises(
        ValueError, match=r"s\.toml: a constant does not meet the tolerance, and v\* ranges from .*: expected"
    ):
        choose(asked)


def test_compact_kernels_need_a_beta_whose_fifth_power_is_normal() -> None:
    asked = scene((0.5, 1.0), code=ready("rust", "float"), epsilon=1e-3)
    assert uncovered(asked, scene_encounters(asked)) is None
    units = replace(asked, scale=Scale(time=1e45))
    assert "beta in (s/m)^(1/5) ranges from" in str(uncovered(units, scene_encounters(units)))
    assert uncovered(replace(units, code=ready()), scene_encounters(units)) is None


@pytest.mark.parametrize(
    ("language", "name"), [("c", "epsilon"), ("cuda", "dissipation"), ("python", "absolute"), ("python", "epsilon")]
)
def test_an_impossible_tolerance_is_refused_with_what_is_possible(language: str, name: str) -> None:
    with pytest.raises(ValueError, match=rf"s\.toml: tolerance\.{name} is 1e-16: expected (\S+) or more") as refused:
        choose(scene((0.3, 0.9), code=ready(language), **{name: 1e-16}))
    possible = re.search(r"expected (\S+) or more", str(refused.value))
    assert possible is not None
    is_sound(choose(scene((0.3, 0.9), code=ready(language), **{name: float(possible[1])})))


def test_a_scene_without_tolerance_has_no_kernel() -> None:
    with pytest.raises(ValueError, match=r"s\.toml: tolerance is missing: expected a table with epsilon, dissipation"):
        choose(scene((0.3, 0.9)))


# --- the reason -------------------------------------------------------------------------------------------------------


def test_the_reason_names_the_place_of_the_largest_error() -> None:
    found = choose(scene((0.2, 2.0), code=ready("rust"), epsilon=1e-6))
    match = re.match(
        r"quotient for all v\*, to 1e-5, without tables: relative error of eps (\S+) at v\* = (\S+) \(m0-m0\), "
        "more than 1e-06",
        found.reason,
    )
    assert match
    error, v_star = map(float, match.groups())
    eps = float(exact.collision(v_star, 17).decimals()["epsilon"])
    kernel = compact.compact("1e-5")
    assert abs(function_values(kernel, "restitution", 1.0, v_star**2) / eps - 1) == pytest.approx(error, rel=0.02)
    grid = np.geomspace(0.2, 2.0, 3001)
    off = np.abs(function_values(kernel, "restitution", np.ones_like(grid), grid**2) / double.epsilon(grid) - 1)
    assert off.max() == pytest.approx(error, rel=0.02)


def test_rounding_of_a_sample_is_not_shown_as_an_error() -> None:
    found = choose(scene((0.1, 0.2), code=ready(argument="v_star"), dissipation=1e-13))
    for offer in found.offers:
        if offer.kernel.name == "full":
            sampled = offer.sampled(found.encounters, "dissipation")[0]
            assert sampled <= float(offer.errors["dissipation"])


def test_quotients_that_rounding_alone_makes_too_rough_are_not_made(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nearly elastic, and as accurate as it gets."""
    monkeypatch.setattr(quotient, "accurate_quotient", lambda *_: pytest.fail("a quotient is fitted"))
    found = choose(scene((0.1, 0.2), code=ready(argument="v_star"), dissipation=4e-15))
    assert found.chosen.kernel.name == "full"
    match = re.search(r"one division in double may already cause a .* of (\S+), more than 4e-15", found.reason)
    assert match
    eps = float(found.encounters[0].epsilon[1])
    assert float(match[1]) == pytest.approx(eps * 2 * eps * 2.0**-53 / (1 - eps**2), rel=0.2)


# --- costs ------------------------------------------------------------------------------------------------------------


def test_costs_are_counts_of_operations() -> None:
    asked = scene((0.3, 0.9), epsilon=1e-3)
    (met,) = scene_encounters(asked)
    kernel = quotient.pade_quotient(1, 4)
    by_horner = 2 * (1 + 4) + candidate.DIVISION
    assert candidate.weighted_operations(kernel, "epsilon", met) == by_horner
    assert (
        candidate.weighted_operations(kernel, "restitution", met)
        == by_horner + candidate.POWER + candidate.DIVISION + 1
    )


def test_beyond_a_table_the_kernel_of_v_star_counts_and_what_makes_v_star() -> None:
    kernel, costs = catalogue.kernel("speed 1e-5"), []
    for ends in ((0.3, 0.9), (20.0, 30.0)):  # the table ends at v* = 2^3.2
        (met,) = scene_encounters(scene(ends, epsilon=1e-3))
        costs.append(candidate.weighted_operations(kernel, "restitution", met))
    of_v_star = candidate.weighted_operations(compact.half_line("1e-5"), "epsilon", met)
    assert costs == [14, of_v_star + candidate.POWER + candidate.DIVISION + 1]
