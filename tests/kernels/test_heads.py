"""Bounds that headers state hold for the largest, the smallest and subnormal arguments, where the headers say so."""

import re
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from mpmath import beta, mp, mpf

from tests import compiled
from viscopade.arithmetic.balls import ball_of, working
from viscopade.arithmetic.formats import DOUBLE, FLOAT
from viscopade.kernels import catalogue, truth

EXPORTS = Path(__file__).parents[2] / "exports"
NAMES = ("full.h", "inverse.h", "minimax.h", "pade.h", "speed_1em5.h", "speed_1em10.h", "speed_full.h")
HEADERS = [*(f"viscopade_{name}" for name in NAMES), "viscopade.cuh"]
MEANINGS = (
    "epsilon",
    "one_minus_epsilon",
    "restitution",
    "rebound",
    "dissipation",
    "v_star_from_loss",
    "v_star",
    "beta",
)
MACRO = re.compile(r"^#define VISCOPADE_(\w+)_ERROR(F?) (\S+) /\* (.*) \*/$", re.MULTILINE)
NUMBER = 400  # of arguments of each function
NEAR, FAR = mpf(10) ** -10, mpf(10) ** 12  # v* below and beyond which a first term is eps to 18 digits


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    """Return the compiled functions of all headers."""
    return compiled.build(tmp_path_factory.mktemp("heads"), [(EXPORTS / name).read_text() for name in HEADERS])


def h_2():
    """Return c in 1 - eps = c v*^2 + …: 2 (4/5)^(2/5) B(3/5, 3/2)/2."""
    return (mpf(4) / 5) ** (mpf(2) / 5) * beta(mpf(3) / 5, mpf(3) / 2)


def eps_and_loss(v_star):
    """Return eps and 1 - eps: the first terms for v* -> 0 and v* -> infinity, between them the proven table."""
    if v_star < NEAR:
        loss = h_2() * v_star**2
        return 1 - loss, loss
    if v_star > FAR:
        eps = (mpf(3) / 2) ** (mpf(2) / 3) * v_star ** (-mpf(10) / 3)
        return eps, 1 - eps
    with working(truth.BITS):
        found = truth.exact_portions(ball_of(exactly(v_star)))
        return tuple(mpf(int(part.fmpq().p)) / int(part.fmpq().q) for part in (found.epsilon.mid(), found.loss.mid()))


def v_star_of(eps, loss):
    """Return v* by the same first terms."""
    return mp.sqrt(loss / h_2()) if loss < eps else ((mpf(3) / 2) ** (mpf(2) / 3) / eps) ** (mpf(3) / 10)


def exactly(number):
    """Return a number of mpmath as a fraction."""
    sign, mantissa, exponent, _ = mpf(number)._mpf_
    return (-1) ** sign * int(mantissa) * Fraction(2) ** exponent


def sizes_of(kind):
    """Return the exponents of the smallest and the largest number of a type."""
    limits = np.finfo(kind)
    return np.log2(limits.smallest_subnormal.astype(np.longdouble)), np.log2(limits.max.astype(np.longdouble))


def arguments(meaning, kind, generator):
    """Yield arguments of all sizes, most of them with results and v* between the smallest and the largest number."""
    low, high = (float(size) for size in sizes_of(kind))
    for _ in range(NUMBER):
        size = kind(np.exp2(np.longdouble(generator.uniform(low, high))))
        if meaning in ("epsilon", "one_minus_epsilon"):
            yield (size,)
        elif meaning == "v_star_from_loss":
            yield (min(size, kind(2) ** -24),)
        elif meaning in ("v_star", "beta"):  # only eps and 1 - eps for which a first term is accurate enough
            eps = generator.choice([min(size, kind(2) ** -80), 1 - kind(2.0 ** -generator.integers(20, 50))])
            yield (eps, size)[: 1 + (meaning == "beta")]
        else:  # v* of all sizes, the smallest and the largest ones with few speeds
            v_star = np.longdouble(10) ** generator.choice([generator.uniform(-160, 100), generator.uniform(-6, 6)])
            yield size, kind((v_star / np.longdouble(size) ** np.longdouble(0.1)) ** 2)


def exact_values(meaning, given):
    """Return the exact result, v*, and what E min is relative to."""
    x = [mpf(float(number)) for number in given]
    if meaning in ("v_star", "v_star_from_loss", "beta"):
        v_star = v_star_of(1 - x[0], x[0]) if meaning == "v_star_from_loss" else v_star_of(x[0], 1 - x[0])
        return (v_star if meaning != "beta" else v_star**2 / x[1] ** (mpf(1) / 5)), v_star, mpf(0)
    v_star = x[0] if len(x) == 1 else mp.sqrt(x[1]) * x[0] ** (mpf(1) / 10)
    eps, loss = eps_and_loss(v_star)
    results = {"epsilon": eps, "restitution": eps, "one_minus_epsilon": loss, "dissipation": loss * (1 + eps)}
    smaller = min(eps, loss)
    return (eps * x[0], v_star, smaller * x[0]) if meaning == "rebound" else (results[meaning], v_star, smaller)


def computed(name, kernel, given, library, result):
    """Return a number that a condition names, as computed."""
    if name == "the result":
        return result
    if name == "eps":
        return library[f"restitution_{kernel}"](*given)
    speed, beta = given
    fifth = beta * beta * (beta * beta) * beta
    return fifth if name == "beta^5" else fifth * speed


@pytest.mark.parametrize("header", HEADERS)
def test_stated_bounds_hold_where_they_are_stated(library, header):
    generator, used = np.random.default_rng(5), 0
    text = (EXPORTS / header).read_text()
    macros = MACRO.findall(text)
    assert macros
    for name, suffix, first, rest in macros:
        meaning = next(m for m in MEANINGS if name.lower().startswith(f"{m}_"))
        kernel = name.lower().removeprefix(f"{meaning}_") + suffix.lower()
        kind, form = (np.float32, FLOAT) if suffix else (np.float64, DOUBLE)
        error, condition = re.fullmatch(r"(.*?)(?:, host and device)?(?:, where (.*), as computed, .*)?", rest).groups()
        sizes = {unit: Fraction(size) for size, unit in re.findall(r"(\S+) (min|r|ulp)\b", f"{first} {error}")}
        low, high = re.search(r"(\S+) <= v\*", error), re.search(r"v\* <= ([^ ,]+)", error)
        normal = re.split(r", | and ", condition) if condition else []
        with np.errstate(all="ignore"), mp.workdps(60):
            for given in arguments(meaning, kind, generator):
                if not all(0 < number < np.inf for number in given) or given[0] == 1:
                    continue
                result = library[f"{meaning}_{kernel}"](*given)
                numbers = [computed(each, kernel, given, library, result) for each in normal]
                value, v_star, smaller = (exactly(number) for number in exact_values(meaning, given))
                inside = (not low or v_star >= Fraction(low[1])) and (not high or v_star <= Fraction(high[1]))
                if not inside or not all(form.least <= number < np.inf for number in numbers):
                    continue
                allowed = sizes.get("min", 0) * smaller + sizes.get("r", 0) * value
                allowed += sizes.get("ulp", 0) * form.ulp(value + allowed)
                assert abs(Fraction(result) - value) <= allowed, (name, given, result)
                used += 1
    assert used > 30 * len(macros)


@pytest.mark.parametrize(
    ("function", "given", "exact"),
    [("rebound_full", (1e29, 1e192), "2.8e-301"), ("epsilon_full", (2.2416075665961923e92,), "1.9151e-308")],
)
def test_the_condition_is_needed(library, function, given, exact):
    """Without it, the bound would be stated for results that underflow."""
    with mp.workdps(40):
        value, *_ = exact_values(function.partition("_full")[0], given)
        assert abs(value / mpf(exact) - 1) < 0.02
        assert abs(mpf(library[function](*given)) - value) > mpf("0.6") * max(mpf(2) ** -1074, value * mpf(2) ** -52)


@pytest.mark.parametrize("place", ["host", "device"])
def test_the_cuda_header_states_what_holds_on_host_and_device(place):
    text = (EXPORTS / "viscopade.cuh").read_text()
    assert "error, float (host and device)" in text
    for name, suffix, first, rest in MACRO.findall(text):
        function, _, kernel = name.lower().partition("_compact_")
        where = (place, "float") if suffix else ("host", "double")
        bounds = catalogue.kernel(f"compact {kernel.replace('m', '-')}").bound(function, *where)
        least = min(bound.relative + bound.last for bound in bounds if bound.high == bounds[-1].high)
        stated = sum(Fraction(size) for size, unit in re.findall(r"(\S+) (min|r)\b", f"{first} {rest}"))
        assert stated >= least
        assert ("host and device" in rest) == bool(suffix)
