"""The kernel that is chosen is the cheapest that keeps the tolerance, and what is said of the others is true."""

from __future__ import annotations

import math
import re
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from tests.compiled import build
from viscopade.approximation import minimax
from viscopade.arrays import double
from viscopade.collision import exact
from viscopade.kernels import registry_arrays
from viscopade.kernels.registry import entries
from viscopade.kernels.requests import Request
from viscopade.scene import candidate
from viscopade.scene.candidate import BestApproximant, PairConstant, RegistryKernel, in_format, interval, uncovered
from viscopade.scene.choice import AS_CHEAP, Choice, choose
from viscopade.scene.cost import Operations
from viscopade.scene.description import Body, Code, Material, Meeting, Scene, Sizes, Speeds, Tolerance
from viscopade.scene.encounter import encounters
from viscopade.scene.units import Scale

SIZE = Sizes(0.01, 0.01, 0.01)


def material(v_star: float) -> Material:
    """Return one with which v* of equal spheres at 1 m/s is given."""
    pair = encounters(_scene([(1.0, 1.0)], Tolerance(epsilon=0.1), Code(), [Material(1e9, 0.3, 1000.0, 1e-6)]))[0].pair
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


def outcome(asked: Scene) -> Choice | str:
    """Return the choice, or the refusal."""
    try:
        return choose(asked)
    except ValueError as refused:
        return str(refused)


def is_one_line(text: str) -> bool:
    return "\n" not in text and text.startswith("s.toml: ")


def is_sound(choice: Choice) -> None:
    """Check what must hold of every choice."""
    limits = choice.scene.tolerance.given()
    prices = [offer.cost for offer in choice.offers]
    assert prices == sorted(prices)
    assert choice.chosen.suffices
    dearer = any(o.suffices and o.cost < choice.chosen.cost for o in choice.offers)
    assert ("hardly cheaper" in choice.reason) == dearer
    for offer in choice.offers:
        errors = offer.candidate.errors
        failing = {name for name, limit in limits.items() if getattr(errors, name) > Fraction(repr(limit))}
        assert set(offer.failing) == failing
        if offer.suffices:
            assert offer.cost * AS_CHEAP >= choice.chosen.cost
            if offer.cost < choice.chosen.cost:
                assert offer.candidate.bytes > choice.chosen.candidate.bytes
                assert offer.candidate.label in choice.reason


# --- the cheapest -----------------------------------------------------------------------------------------------------

TOLERANCES = [{name: size} for name in ("epsilon", "dissipation", "absolute") for size in (1e-2, 3e-4, 1e-7)]


@pytest.mark.parametrize("tolerance", TOLERANCES, ids=str)
def test_the_cheapest_of_languages_with_ready_kernels(tolerance: dict[str, float]) -> None:
    ranges = [(0.01, 0.05), (0.3, 1.5), (2.0, 6.0)]
    for code in (ready("cuda"), ready("cuda", "float"), ready("javascript"), ready("glsl", "float")):
        for pairs in (ranges[:1], ranges[1:2], ranges):
            asked = scene(*pairs, code=code, **tolerance)
            found = outcome(asked)
            if isinstance(found, Choice):
                is_sound(found)
                continue
            assert is_one_line(found)
            assert "accepted is" in found
            assert all(c.errors.failing(asked.tolerance) for c in candidate.candidates(asked, encounters(asked)))


@pytest.mark.parametrize(
    ("code", "tolerance"),
    [
        (ready(), {"epsilon": 1e-6}),
        (ready(form="float"), {"dissipation": 1e-5}),
        (ready(argument="v_star"), {"dissipation": 1e-4}),
        (ready("python"), {"absolute": 1e-4, "epsilon": 1e-3}),
    ],
    ids=["c", "float", "v_star", "python"],
)
def test_the_cheapest_of_all_kinds(code: Code, tolerance: dict[str, float]) -> None:
    found = choose(scene((0.3, 0.9), (0.4, 1.3), code=code, **tolerance))
    is_sound(found)
    kinds = {type(offer.candidate) for offer in found.offers}
    assert kinds == {PairConstant, BestApproximant, *([RegistryKernel] if code.language == "c" else [])}


def test_equal_costs_are_decided_by_the_table(monkeypatch: pytest.MonkeyPatch) -> None:
    equal = property(lambda self: 100 - self.simple / 20 + (self.powers > 0) * 50)
    monkeypatch.setattr(Operations, "count", equal)
    found = choose(scene((0.0005, 1100.0), epsilon=1e-5))
    sizes = [o.candidate.bytes for o in found.offers if o.suffices and o.cost <= 100]
    assert found.chosen.candidate.bytes == min(sizes) < max(sizes)
    is_sound(found)
    assert "hardly cheaper" in found.reason


def test_tables_that_are_too_large_are_not_offered() -> None:
    asked = {"epsilon": 1e-5}
    ranges = (0.2, 2000.0)  # no quotient on the interval
    assert choose(scene(ranges, code=ready(largest_table=100_000), **asked)).chosen.candidate.bytes == 65536
    assert choose(scene(ranges, code=ready(largest_table=10_000), **asked)).chosen.candidate.bytes == 8192
    with pytest.raises(ValueError, match=r"tables of at most 0 bytes\) reaches on this scene"):
        choose(scene(ranges, code=ready(largest_table=0), **asked))


@pytest.mark.parametrize(
    ("ends", "tolerance"),
    [((0.02, 3.0), {"epsilon": 1e-2}), ((0.2, 0.8), {"absolute": 1e-4})],
    ids=str,
)
def test_the_cheaper_of_both_measures_is_taken(ends: tuple[float, float], tolerance: dict[str, float]) -> None:
    asked = scene(ends, code=ready("python", argument="v_star"), **tolerance)
    met = encounters(asked)
    found = candidate.best_polynomial(asked, met)
    both, relative = (candidate._best(asked, met, interval(met, asked.code), m) for m in ("both", "relative"))
    assert found is not None
    costs = [minimax.cost(c.kernel.m, c.kernel.n) for c in (both, relative)]
    assert minimax.cost(found.kernel.m, found.kernel.n) == min(costs)
    assert found.kernel.bounds[0].measure == ("relative" if costs[1] < costs[0] else "both")


# --- errors on the scene ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("form", ["double", "float"])
@pytest.mark.parametrize("argument", ["speed", "v_star"])
def test_compiled_quotients_keep_their_errors(form: str, argument: str, tmp_path: Path) -> None:
    asked = scene((0.25, 0.8), code=ready(form=form, argument=argument), dissipation=2e-5)
    (met,) = encounters(asked)
    found = candidate.best_polynomial(asked, [met])
    suffix, kind = ("f", np.float32) if form == "float" else ("", np.float64)
    library = build(tmp_path, [found.request().render("c")])
    random = np.random.default_rng(2)
    speed = np.exp(random.uniform(math.log(met.speeds.slowest), math.log(met.speeds.fastest), 2000))
    speed = np.array([met.speeds.slowest, met.speeds.fastest, *speed]).astype(kind)
    beta = kind(met.pair.beta)
    if argument == "speed":
        restitution = library[f"restitution_{found.name}{suffix}"]
        computed = np.array([restitution(float(v), float(beta)) for v in speed]).astype(kind)
        v_star = (np.sqrt(np.longdouble(beta)) * speed.astype(np.longdouble) ** (np.longdouble(1) / 10)).astype(float)
    else:
        v_star = (np.sqrt(beta) * speed ** kind(0.1)).astype(kind)
        computed = np.array([library[f"epsilon_{found.name}{suffix}"](float(v)) for v in v_star]).astype(kind)
        v_star = v_star.astype(float)
    low, high = (float(v) for v in in_format(met, asked.code)[0])
    assert low <= v_star.min() <= v_star.max() <= high
    eps, loss = np.asarray(double.epsilon(v_star)), np.asarray(double.one_minus_epsilon(v_star))
    lost = ((kind(1) - computed) * (kind(1) + computed)).astype(float)
    off = np.abs(computed.astype(float) - eps)
    reached = {
        "epsilon": (off / eps).max(),
        "dissipation": (np.abs(lost / (loss * (1 + eps)) - 1)).max(),
        "absolute": off.max(),
    }
    for name, size in reached.items():
        assert 0.3 * getattr(found.errors, name) < size <= getattr(found.errors, name)


def test_ranges_of_type_float_are_wider_and_those_of_quotients_hold_them() -> None:
    (met,) = encounters(scene((0.9999999, 1.9999999), epsilon=1e-3))
    narrow, wide = in_format(met, ready()), in_format(met, ready(form="float"))
    assert narrow == (met.v_star, met.epsilon)
    assert wide[0][0] < narrow[0][0] < narrow[0][1] < wide[0][1]
    # eps at the ends of the wider range is in the wider range of eps.
    for end, v_star in zip(wide[1][::-1], wide[0], strict=True):
        eps = Fraction(exact.collision(v_star, 20).decimals()["epsilon"])
        assert wide[1][0] <= eps <= wide[1][1]
        assert abs(end - eps) < Fraction(1, 10**4)
    low, high = interval([met], ready(form="float"))
    assert low <= wide[0][0]
    assert wide[0][1] <= high
    assert high == Fraction("2.01")  # not 2.00, which type float could pass
    assert interval([met], ready())[1] == 2


@pytest.mark.parametrize("form", ["double", "float"])
def test_constants_are_rounded_to_the_format(form: str) -> None:
    """At a single speed only rounding is left."""
    asked = scene((0.7, 0.7), code=ready("cuda", form), epsilon=0.5)
    (met,) = encounters(asked)
    kind, unit = (np.float32, 2.0**-24) if form == "float" else (np.float64, 2.0**-53)
    for name, size in (("epsilon", unit / 8), ("epsilon", 1e-3), ("absolute", 1e-6), ("dissipation", 1e-2)):
        constant = PairConstant([met], asked.code, Tolerance(**{name: size}))
        value = Fraction(float(kind(constant.values[0])))
        for eps in met.epsilon:
            off = abs(value - eps)
            assert off / eps <= constant.errors.epsilon
            assert off <= constant.errors.absolute
            assert abs((1 - value**2) - (1 - eps**2)) / (1 - eps**2) < constant.errors.dissipation
        if size > 1e-6:
            assert not constant.errors.failing(Tolerance(**{name: size}))
    assert PairConstant([met], asked.code, Tolerance(epsilon=unit / 100)).errors.epsilon > Fraction(unit / 100)


@pytest.mark.parametrize("ranges", [(0.5, 0.5), (3.0, 30.0)])
@pytest.mark.parametrize("name", ["epsilon", "dissipation", "absolute"])
def test_a_constant_is_found_as_soon_as_there_is_one(ranges: tuple[float, float], name: str) -> None:
    asked = scene(ranges, code=ready("cuda"), epsilon=0.5)
    met = encounters(asked)
    low, high = met[0].epsilon
    # The least tolerance that a constant can keep.
    least = {
        "epsilon": (high - low) / (high + low),
        "absolute": (high - low) / 2,
        "dissipation": (high**2 - low**2) / (2 - high**2 - low**2),
    }[name]
    enough, short = float(least * Fraction(101, 100)) + 1e-14, float(least * Fraction(99, 100))
    assert not PairConstant(met, asked.code, Tolerance(**{name: enough})).errors.failing(Tolerance(**{name: enough}))
    if short > 1e-9:
        assert PairConstant(met, asked.code, Tolerance(**{name: short})).errors.failing(Tolerance(**{name: short}))


# --- extremes ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("ends", [(1.01e-30, 1e-29), (1e-9, 1e-4), (1e29, 9.9e29)])
@pytest.mark.parametrize("code", [ready("python"), ready("javascript"), ready(form="float")], ids=str)
@pytest.mark.parametrize("tolerance", [{"epsilon": 1e-3}, {"dissipation": 1e-2}, {"absolute": 1e-6}], ids=str)
def test_extreme_v_star_gets_a_kernel_or_a_clear_refusal(ends, code: Code, tolerance: dict[str, float]) -> None:
    asked = scene(ends, code=code, **tolerance)
    found = outcome(asked)
    if isinstance(found, Choice):
        is_sound(found)
    else:
        assert is_one_line(found)
        assert "accepted" in found


def test_tables_compute_dissipation_of_nearly_elastic_collisions() -> None:
    """1 - eps is 1e-30 there: eps is 1 in all formats, but 1 - eps^2 has its digits."""
    found = choose(scene((1e-16, 1e-15), dissipation=1e-2))
    assert isinstance(found.chosen.candidate, RegistryKernel)
    assert found.chosen.candidate.entry.kind == "speed"
    assert choose(scene((1e-16, 1e-15), epsilon=1e-2)).chosen.candidate.name == "constant"


@pytest.mark.parametrize("ends", [(1e-5, 1e-3), (10.0, 1e4)])
@pytest.mark.parametrize("language", ["glsl", "wgsl", "cuda", "rust"])
def test_compact_kernels_of_type_float_are_not_offered_beyond_their_domain(ends, language: str) -> None:
    asked = scene(ends, code=ready(language, "float"), dissipation=1e-3)
    assert [type(c) for c in candidate.candidates(asked, encounters(asked))] == [PairConstant]
    if language == "glsl":
        tight = scene(ends, code=ready(language, "float"), dissipation=1e-3, epsilon=1e-4)
        with pytest.raises(ValueError, match=r"s\.toml: a constant does not suffice, and v\* is from .*: accepted for"):
            choose(tight)


def test_compact_kernels_need_a_beta_whose_fifth_power_is_normal() -> None:
    asked = scene((0.5, 1.0), code=ready("glsl", "float"), epsilon=1e-3)
    assert uncovered(asked, encounters(asked)) is None
    units = Scene(**{**vars(asked), "scale": Scale(time=1e45)})
    assert "beta is from" in str(uncovered(units, encounters(units)))
    assert uncovered(Scene(**{**vars(units), "code": ready()}), encounters(units)) is None


@pytest.mark.parametrize("language", ["c", "cuda", "python"])
@pytest.mark.parametrize("name", ["epsilon", "dissipation", "absolute"])
def test_an_impossible_tolerance_is_refused_with_what_is_possible(language: str, name: str) -> None:
    asked = scene((0.3, 0.9), code=ready(language), **{name: 1e-16})
    with pytest.raises(ValueError) as refused:
        choose(asked)
    assert is_one_line(str(refused.value))
    match = re.match(rf"s\.toml: tolerance\.{name} is 1e-16: accepted is (\S+) or more", str(refused.value))
    assert match
    is_sound(choose(scene((0.3, 0.9), code=ready(language), **{name: float(match[1])})))


# --- the reason -------------------------------------------------------------------------------------------------------


def test_the_witness_of_the_reason_fails_in_the_compiled_code(tmp_path: Path) -> None:
    found = choose(scene((0.2, 2.0), epsilon=1e-8))
    match = re.match(
        r"speed table, to 1e-5 \(small table\): relative error of eps (\S+) at v\* = (\S+) \(m0-m0\), more than 1e-08",
        found.reason,
    )
    assert match
    error, v_star = map(float, match.groups())
    library = build(tmp_path, [Request(from_speed=("1e-5",), size="small").render("c")])
    name = "restitution_1em5"

    def off(v: float) -> float:
        eps = float(exact.collision(v, 17).decimals()["epsilon"])
        return abs(library[name](v**10, 1.0) / eps - 1)

    assert off(v_star) == pytest.approx(error, rel=0.02)
    # It is the largest one, nearly.
    grid = np.geomspace(0.2, 2.0, 3001)
    eps = np.asarray(double.epsilon(grid))
    largest = max(abs(library[name](v**10, 1.0) / e - 1) for v, e in zip(grid.tolist(), eps.tolist(), strict=True))
    assert largest == pytest.approx(error, rel=0.02)


@pytest.mark.parametrize(
    "entry", [e for e in entries() if e.kind != "v*" and e.format == "double"], ids=lambda e: e.name
)
def test_formulas_are_as_far_off_as_the_registry_says(entry) -> None:
    """Largest errors of what shows where a kernel fails: at most the bound, and not far below."""
    v_star = np.geomspace(0.05, 8.0, 20001)
    eps, loss = np.asarray(double.epsilon(v_star)), np.asarray(double.one_minus_epsilon(v_star))
    off = (np.abs(registry_arrays.entry_epsilon(entry, v_star) - eps) / np.minimum(eps, loss)).max()
    bound = float(entry.error(Fraction(1, 20), Fraction(8)))
    assert off <= bound + 1e-14
    if bound > 1e-13:
        assert off > 0.3 * bound


@pytest.mark.parametrize("tier", ["1e-5", "1e-10", "full"])
def test_formulas_hold_beyond_the_tables(tier: str) -> None:
    entry = next(e for e in entries() if (e.kind, e.tier, e.format) == ("speed", tier, "double"))
    v_star = np.array([1e-9, 1e-4, 1e2, 1e6])
    eps = np.asarray(double.epsilon(v_star))
    assert np.abs(registry_arrays.entry_epsilon(entry, v_star) / eps - 1).max() <= float(entry.outside)


# --- costs ------------------------------------------------------------------------------------------------------------


def test_operations_of_polynomials_and_ready_kernels() -> None:
    for code in (ready(), ready(argument="v_star")):
        asked = scene((0.3, 0.9), code=code, epsilon=1e-3)
        by_speed = int(code.argument == "speed")
        for found in candidate.candidates(asked, encounters(asked)):
            if isinstance(found, BestApproximant):
                kernel = found.kernel
                zeros = (*kernel.variants[0].a, *kernel.variants[0].b).count(0)  # a sum less for each
                simple = 2 * (kernel.m + kernel.n) - zeros
                assert found.operations == Operations(simple, int(kernel.n > 0), by_speed)
            elif isinstance(found, RegistryKernel) and found.entry.kind != "speed":
                assert found.operations.powers == 0


def test_rounding_of_a_sample_is_not_shown_as_an_error() -> None:
    """Nearly elastic, and as accurate as it gets: the quotient fails by its rounding, which a sample cannot show."""
    asked = scene((0.1, 0.2), code=ready(argument="v_star"), dissipation=4e-15)
    found = choose(asked)
    assert found.chosen.candidate.name == "full"
    assert re.search(r"best quotient .* is proven to be at most \S+, which is more than 4e-15", found.reason)
    for offer in found.offers:
        if isinstance(offer.candidate, RegistryKernel):
            assert offer.candidate.sampled("dissipation")[0] <= float(offer.candidate.errors.dissipation)
