"""Candidates for a scene: kernels with their costs and their proven errors there.

Names in all functions: a `Scene` has the question, with its `code` (language, format, argument) and `tolerance`. Its
`encounters` are the pairs of bodies that collide, with their ranges of beta, v* and eps. A `Kernel` is a set of
functions as expressions, which may be evaluated, counted, proven and written.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np

from viscopade.approximation import cheapest, minimax
from viscopade.arithmetic.decimals import at_most
from viscopade.arithmetic.formats import DOUBLE, FORMATS
from viscopade.arrays import double
from viscopade.arrays.checked import FloatArray
from viscopade.kernels import catalogue, expressions, quotient
from viscopade.kernels.arithmetic import HOSTS
from viscopade.kernels.bound import ErrorBound
from viscopade.kernels.expressions import CodeBranch, Item
from viscopade.kernels.kernel import Function, Kernel
from viscopade.kernels.machine import function_values, taken_branch
from viscopade.kernels.v_star import USUAL, eps_error_from_v_star
from viscopade.scene import tolerance
from viscopade.scene.description import Code, Scene, Tolerance
from viscopade.scene.encounter import Encounter, Interval, hull

DIVISION, LOGARITHM, POWER = 4, 20, 50
"""Costs in multiplications on today's processors, roughly (docs/results/benchmark.md).

A division or a square root takes about the time of four products, a call of log2 or exp2 that of twenty, and pow fifty.
"""
COSTS = (
    f"a count of operations (a division or a square root counts {DIVISION}, a logarithm or an exponential {LOGARITHM}, "
    f"a power {POWER})"
)
_COSTS = {"/": DIVISION, "divide": DIVISION, "sqrt": DIVISION, "pow": POWER, "cbrt": LOGARITHM}
_COSTS |= {"log2": LOGARITHM, "exp2": LOGARITHM}
AS_CHEAP = 1.2
"""Largest ratio of costs that count as equal. Then the smaller table wins, and after that a kernel for all speeds.

Chosen by hand: the costs themselves are not more accurate than 20 %.
"""

READY = {
    "compact": ("speed", "quotient for all v*, {}, without tables"),
    "speed": ("speed", "speed table, {}"),
    "full": ("v_star", "table of v*, {}"),
}
"""The groups of the catalogue that are candidates: their argument, and the kernel in words."""
# End of the interval of a best quotient, at most, chosen by hand: there eps is 1e-10, and no real rebound is as slow.
LARGEST_V_STAR = Fraction(1000)
STEEPEST = 4  # more than |d ln eps/d ln v*| and |d ln(1 - eps)/d ln v*|: at most 10/3, the power of eps at large v*
# More than the relative rounding errors of beta, the speed and v* in float: 2^-18 is 64 units of 2^-24.
WIDER = Fraction(1, 1 << 18)
# Share by which the interval of a quotient exceeds that of the scene, by hand: 1.02^10 = 1.2 in speed, so that impacts
# that are 20 % faster still get an eps instead of NaN.
BEYOND = Fraction(1, 50)
# Factors of the accuracy that are tried for a float kernel, chosen by hand: a formula that is four times more accurate
# than needed leaves 3/4 of the tolerance to rounding; if that is not enough, rounding alone exceeds it.
TIGHTER = (Fraction(1), Fraction(1, 2), Fraction(1, 4))
# Values of v* at which an error is sampled, for a message with three digits: an error curve has some ten oscillations,
# so that a maximum is missed by 1e-4 of it.
SAMPLES = 4001
VALUES = "values"  # name of the list of constants
_SMALLEST = 2e-38  # smallest constant: a normal number in float, whose smallest is 2^-126 = 1.2e-38
NOISE = 1e-15  # more than the relative error of a sampled error of eps in double, about four roundings of 2^-53


@dataclass(frozen=True)
class Candidate:
    """A kernel for the pairs of a scene.

    Attributes
    ----------
    kernel : Kernel
    label : str
        The kernel in words.
    cost : int
        The weighted number of operations of one eps.
    errors : mapping of str to Fraction
        The largest errors on the scene (proven), rounding included, by the name of the tolerance.
    failing : tuple of str
        The names of the tolerances that they exceed.
    degrees : pair of int, or None
        Those of a best quotient.
    """

    kernel: Kernel
    label: str
    cost: int
    errors: tolerance.Errors
    failing: tuple[str, ...]
    degrees: tuple[int, int] | None = None

    @property
    def rank(self) -> tuple[int, int, Fraction]:
        """The key for comparison: cost, size of the table, error."""
        return self.cost, self.kernel.bytes, self.errors["epsilon"]

    @property
    def is_constant(self) -> bool:
        """Whether eps depends on the pair alone."""
        return self.kernel.argument == "pair"

    def epsilon(self, pair: int, v_star: FloatArray) -> FloatArray:
        """Return the kernel's eps for a pair, by its number, at each v*, computed in double."""
        # A constant of the pair; a function of v*; or one of the speed and beta, where speed 1 and beta = v*^2 give v*.
        if self.is_constant:
            return np.full_like(v_star, self.kernel.lists[VALUES][pair])
        if any(function.name == "epsilon" for function in self.kernel.functions):
            return np.asarray(function_values(self.kernel, "epsilon", v_star))
        return np.asarray(function_values(self.kernel, "restitution", np.ones_like(v_star), v_star**2))

    def sampled(self, encounters: Sequence[Encounter], measure: str) -> tuple[float, float, str]:
        """Return the largest error (sampled) in a measure of the tolerance, with its v* and its pair.

        It is computed in double, and reduced by the rounding error of the sample.
        """

        def largest_error(pair: int, encounter: Encounter) -> tuple[float, float, str]:
            """Return the largest error of one pair, the v* where it is, and the pair's name."""
            low, high = map(float, encounter.v_star)
            v_star = np.geomspace(low, high, SAMPLES)
            # The error of eps that is certain: the rounding of the exact eps is taken off.
            eps, loss = double.epsilon(v_star), double.one_minus_epsilon(v_star)
            eps_of_kernel = self.epsilon(pair, v_star)
            deviations = np.maximum(np.abs(eps_of_kernel - eps) - NOISE * eps, 0.0)
            # The error of eps that makes 1 in this measure.
            scale = tolerance.in_eps(measure, eps, loss)
            if measure == "dissipation":
                # |eps_k^2 - eps^2|/(1 - eps^2) = |eps_k - eps| (eps_k + eps)/((1 - eps) (1 + eps)): not to first order,
                # as the errors of constants are large.
                scale = loss * (1 + eps) / (eps_of_kernel + eps)
            i = int(np.argmax(deviations / scale))
            return float(deviations[i] / scale[i]), float(v_star[i]), encounter.name

        return max(largest_error(i, encounter) for i, encounter in enumerate(encounters))


def candidates(scene: Scene, encounters: Sequence[Encounter]) -> Iterator[Candidate]:
    """Yield the kernels for a scene's language, format and argument, and a best quotient if it may be cheaper.

    `encounters` are those of all pairs of the scene.
    """
    ready = [constant(scene, encounters), *_ready(scene, encounters)]
    yield from ready
    # No quotient costs less than this: two operations, and for speeds v* = sqrt(beta) v^(1/10), which is a power, a
    # root (as a division) and a product. A fit takes time, and saves little where a kernel that is accurate enough
    # costs hardly more.
    cheapest_quotient = 2 + (POWER + DIVISION + 1 if scene.code.argument == "speed" else 0)
    is_cheap = any(not kernel.failing and kernel.cost <= AS_CHEAP * cheapest_quotient for kernel in ready)
    if not is_cheap and too_rough(scene, encounters) is None and (best := best_quotient(scene, encounters)) is not None:
        yield best


def _ready(scene: Scene, encounters: Sequence[Encounter]) -> Iterator[Candidate]:
    """Yield the kernels of the catalogue that exist in the scene's language and are proven for its encounters."""
    code = scene.code
    # Groups with the argument of the scene, which the language has, and whose domain contains the scene.
    groups = [group for group, (argument, _) in READY.items() if argument == code.argument]
    if not code.spoken.table:
        groups = [group for group in groups if group == "compact"]
    if "compact" in groups and uncovered(scene, encounters):
        groups.remove("compact")
    # Of their kernels, those whose table is not too large and that have a proven error here.
    for entry in (entry for entry in catalogue.CATALOGUE.values() if entry.group in groups):
        if code.largest_table is None or entry.kernel.bytes <= code.largest_table:
            accuracy = "full accuracy" if entry.variant in ("", "full") else f"to {entry.variant}"
            ready = _candidate(scene, encounters, entry.kernel, READY[entry.group][1].format(accuracy))
            if ready is not None:
                yield ready


def _candidate(
    scene: Scene, encounters: Sequence[Encounter], kernel: Kernel, label: str, degrees: tuple[int, int] | None = None
) -> Candidate | None:
    """Return the candidate of a kernel, with its cost and errors; None if it has no proven error on the scene.

    `label` is the kernel in words, and `degrees` are those of a best quotient.
    """
    code = scene.code
    if code.format not in kernel.formats:
        return None
    # The errors are proven on all encounters; the cost is counted at a typical impact of the first one.
    errors = tolerance.errors_on(kernel, code.function, code.number.arithmetics, ranges(scene, encounters))
    if errors is None:
        return None
    count = weighted_operations(kernel, code.function, encounters[0])
    return Candidate(kernel, label, count, errors, tolerance.failing(errors, scene.tolerance), degrees)


def weighted_operations(kernel: Kernel, result: str, encounter: Encounter) -> int:
    """Return the weighted number of operations of a result, in the branch of a typical impact.

    `result` is the name of a function of the kernel; the typical impact is that of the `encounter`.
    """
    # The branch that a typical impact takes: beta = v*^2 at the speed 1.
    function, v_star = kernel.function(result), float(encounter.pair.v_star(encounter.speeds.typical))
    inputs = {"v_star": v_star, "speed": 1.0, "beta": v_star**2}
    branch_number = taken_branch(kernel, result, *(inputs[name] for name in function.arguments))
    # Operations of this branch with their costs; a sum or a product, whose name is its sign, costs 1.
    branch = function.branches[branch_number]
    counts = expressions.operations((*function.start, *branch.program), branch.results[function.result])
    count = sum(number * _COSTS.get(name, not name.isidentifier()) for name, number in counts.items())
    # Outside its first branch a kernel of the speed may call another one.
    called = kernel.fallback if branch_number > 0 else None
    return count + (0 if called is None else weighted_operations(called, "epsilon", encounter))


# --- ranges -----------------------------------------------------------------------------------------------------------


def ranges(scene: Scene, encounters: Sequence[Encounter]) -> list[tolerance.Range]:
    """Return the ranges of v*, eps and speeds of each of the encounters, widened by the roundings up to v*."""
    # Speeds in the scene's units, as the code sees them
    unit = Fraction(scene.scale.speed)
    speeds = [
        (Fraction(encounter.speeds.slowest) / unit, Fraction(encounter.speeds.fastest) / unit)
        for encounter in encounters
    ]
    return [
        tolerance.Range(*in_format(encounter, scene.code), ends)
        for encounter, ends in zip(encounters, speeds, strict=True)
    ]


def in_format(encounter: Encounter, code: Code) -> tuple[Interval, Interval]:
    """Return the ranges of v* and of eps, widened by the rounding of beta, the speed and v*.

    `code` has the format. In double the encounter's own ranges are wide enough.
    """
    if code.format == DOUBLE.name:
        return encounter.v_star, encounter.epsilon
    (low, high), (low_eps, high_eps) = encounter.v_star, encounter.epsilon
    # A relative change of v* by WIDER changes eps and 1 - eps by less than STEEPEST WIDER, relatively.
    v_star = low * (1 - WIDER), high * (1 + WIDER)
    eps_change = STEEPEST * WIDER
    return v_star, (low_eps * (1 - eps_change), 1 - (1 - high_eps) * (1 - eps_change))


def uncovered(scene: Scene, encounters: Sequence[Encounter]) -> str | None:
    """Return the reason why no compact kernel is proven on this scene (v* or beta out of range), or None.

    `encounters` are those of the scene.
    """
    # The range of v* of the compact kernels' proof; the last bound is that on all v*.
    code, arithmetic = scene.code, scene.code.number.arithmetics[-1]
    compact = catalogue.group("compact")[0].kernel.bound("restitution", arithmetic.place, code.format)[-1]
    # beta^2, beta^4 and beta^5 must be normal numbers: with the largest exponent E of the format, beta^5 is at most
    # 2^(E - 2), a quarter of the largest number, which is more than roundings need; and at least the inverse of this.
    largest = 2.0 ** ((FORMATS[code.format].largest - 2) / 5)
    v_star = hull(span.v_star for span in ranges(scene, encounters))
    beta = hull((encounter.weakest.beta, encounter.strongest.beta) for encounter in encounters)
    for name, (low, high), (lower_limit, upper_limit) in (
        ("v*", v_star, (compact.low, compact.high)),
        (f"beta in {scene.units.beta}", map(scene.scale.beta, beta), (1 / largest, largest)),
    ):
        if not lower_limit <= low <= high <= upper_limit:
            return (
                f"{name} ranges from {float(low):.3g} to {float(high):.3g}: expected {float(lower_limit):.3g} to "
                f"{float(upper_limit):.3g} for {code.language} ({code.format})"
            )
    return None


# --- constants --------------------------------------------------------------------------------------------------------


def constant(scene: Scene, encounters: Sequence[Encounter]) -> Candidate:
    """Return the candidate that is a constant eps for each pair: the shortest decimal within the tolerance."""
    # A decimal for the range of eps of each encounter
    code, eps_ranges = scene.code, [span.epsilon for span in ranges(scene, encounters)]
    values = [_constant_for(eps_range, scene.tolerance, code) for eps_range in eps_ranges]
    # The kernel reads it in a list by the number of the pair: a cost of 0. Its fields are name, label, argument,
    # formula, source and domain in words, functions, constants by format (none), and lists.
    kernel = Kernel(
        "constant", "a constant", "pair", "eps is a number", "the scene", "the pairs of the scene",
        (value_of_pair("epsilon", VALUES, "eps of a pair"),), {form: {} for form in FORMATS},
        lists={VALUES: tuple(values)},
    )  # fmt: skip
    errors = tolerance.worst_errors(
        _constant_errors(value, eps_range, code) for value, eps_range in zip(values, eps_ranges, strict=True)
    )
    label = "a constant" + " for each pair" * (len(encounters) > 1)
    return Candidate(kernel, label, 0, errors, tolerance.failing(errors, scene.tolerance))


def value_of_pair(name: str, values: str, meaning: str) -> Function:
    """Return the function that reads a list of values by the number of a pair."""
    # No condition on its argument, no statements before the only branch, and none in it: the result is an item.
    return Function(name, ("pair",), meaning, None, (), (CodeBranch(None, (), {name: Item(values, "pair")}),), name)


def _constant_errors(number: float, epsilon: Interval, code: Code) -> tolerance.Errors:
    """Return the largest errors of a constant eps on a range of eps, and of (1 - eps) (1 + eps) computed from it.

    The code has the number's shortest decimal, rounded to its format.
    """
    value = Fraction(FORMATS[code.format].nearest(Fraction(repr(number))))
    # (1 - eps) (1 + eps) has three roundings, each of at most 2^-precision; six of them are more than their products of
    # second order add, and far below the error of a constant.
    lost = (1 - value**2) * Fraction(6) * Fraction(2) ** -FORMATS[code.format].precision
    return {
        "epsilon": max(abs(value - e) / e for e in epsilon),
        "dissipation": max(
            (abs(e**2 - value**2) + lost) / (1 - e**2) if e < 1 else tolerance.HOPELESS for e in epsilon
        ),
        "absolute": max(abs(value - e) for e in epsilon),
    }


def _constant_for(epsilon: Interval, limits: Tolerance, code: Code) -> float:
    """Return the shortest decimal within the tolerance on a range of eps, or the best number if there is none.

    `limits` is the tolerance of the scene, and `code` has the format of the constant.
    """
    low, high = (float(e) for e in epsilon)
    # The smallest and the largest constant c within a tolerance t, by the name of the tolerance: |c - e| <= t e,
    # |c^2 - e^2| <= t (1 - e^2), |c - e| <= t for each end e of the range.
    within: dict[str, Callable[[float], tuple[float, float]]] = {
        "epsilon": lambda t: (high * (1 - t), low * (1 + t)),
        "dissipation": lambda t: (
            math.sqrt(max(1 - (1 - high**2) * (1 + t), 0.0)),
            math.sqrt(1 - (1 - low**2) * max(1 - t, 0.0)),
        ),
        "absolute": lambda t: (high - t, low + t),
    }

    def ends(scale: float) -> tuple[float, float]:
        """Return the smallest and the largest constant within this multiple of the tolerance, if they are in order."""
        bounds = [within[name](scale * limit) for name, limit in limits.limits().items()]
        return max(lower for lower, _ in bounds), min(upper for _, upper in bounds)

    # If no constant is within the tolerance, bisect the logarithm of the smallest multiple of it that one is within: up
    # to 1e30, which any range of eps in double needs at most for a tolerance above 1e-30, and to 1e-4, because only the
    # three digits of its error are shown.
    scale, largest = 1.0, 1e30
    if not operator.le(*ends(scale)):
        while largest > 1.0001 * scale:
            middle = math.sqrt(scale * largest)
            scale, largest = (scale, middle) if operator.le(*ends(middle)) else (middle, largest)
        scale = largest
    # The shortest decimal within the tolerance; 17 digits are enough for a double.
    middle = sum(ends(scale)) / 2
    for digits in range(1, 18):
        value = float(f"{middle:.{digits}g}")
        if _SMALLEST <= value <= 1 and not tolerance.failing(_constant_errors(value, epsilon, code), limits):
            return value
    return min(max(middle, low, _SMALLEST), 1.0)


# --- best quotients ---------------------------------------------------------------------------------------------------


def too_rough(scene: Scene, encounters: Sequence[Encounter]) -> str | None:
    """Return the reason why no quotient meets the tolerance, if its last division's rounding exceeds it, or None.

    `encounters` are those of the scene.
    """
    arithmetic = scene.code.number.arithmetics[-1]
    # Errors of a kernel with no other error than the rounding of its last division, at most 2^-precision. (The range of
    # v* of the bound, 0 to 1, is not used.)
    unit = Fraction(2) ** -arithmetic.form.precision
    last_division = ErrorBound("epsilon", Fraction(0), Fraction(1), "value", Fraction(0), unit, arithmetic=arithmetic)
    errors = tolerance.worst_errors(
        tolerance.errors_of(last_division, span.epsilon) for span in ranges(scene, encounters)
    )
    for name in tolerance.failing(errors, scene.tolerance):
        size = at_most(errors[name]) if errors[name] < tolerance.HOPELESS else "any size"
        error = f"{tolerance.MEASURES[name]} of {size}, more than {scene.tolerance.limits()[name]:g}"
        return f"quotients: one division in {arithmetic.form.name} may already cause a {error}"
    return None


def best_quotient(scene: Scene, encounters: Sequence[Encounter]) -> Candidate | None:
    """Return the cheapest best approximant within the tolerance on the range of v* of all encounters, or None.

    In float it is a more accurate one if its rounding needs it.
    """
    low, high = interval(encounters, scene.code)
    accuracy = _accuracy(scene, encounters)
    if high > LARGEST_V_STAR or accuracy is None:
        return None
    by_pow = ", v* by pow" if scene.code.argument == "speed" else ""
    for factor in TIGHTER if scene.code.format != DOUBLE.name else TIGHTER[:1]:
        # Three digits, as a request for a kernel writes them. Rounding to nearest may add half a unit of the third
        # digit: 0.15 % are taken off first, by hand, which makes up for most of it. Errors are checked in any case.
        try:
            short = f"{float(accuracy * factor) * 0.9985:.2e}".replace("e-0", "e-")
            kernel = quotient.accurate_quotient(short, high, low)
        except (ValueError, ArithmeticError):
            return None
        m, n = kernel.record["m"], kernel.record["n"]
        candidate = _candidate(scene, encounters, kernel, f"best quotient {kernel.label}{by_pow}", (m, n))
        if candidate is not None and n:
            return candidate
        # A polynomial is a quotient with the denominator 1; its division is left out of the code.
        if candidate is not None:
            return replace(candidate, label=f"best series {kernel.label}{by_pow}", cost=candidate.cost - DIVISION)
    return None


def fewer_operations(candidate: Candidate) -> minimax.Fit | None:
    """Return the most accurate best approximant with one operation less than a best quotient; None if there is none."""
    assert candidate.degrees is not None
    domain = candidate.kernel.bounds[0]
    return cheapest.most_accurate(minimax.cost(*candidate.degrees) - 1, Fraction(domain.high), domain.low)


def _accuracy(scene: Scene, encounters: Sequence[Encounter]) -> Fraction | None:
    """Return the allowed error of a kernel relative to min(eps, 1 - eps), or None if no kernel is that accurate."""
    code, spans = scene.code, ranges(scene, encounters)
    # The allowed error is to first order: 0.1 % of it is a margin for the second order, enough for tolerances up to
    # about 1e-3; the error of the kernel is proven afterwards in any case.
    accuracy = tolerance.allowed(scene.tolerance, [span.epsilon for span in spans]) * Fraction(999, 1000)
    if code.argument == "speed":
        # Less the error that the computed v* = sqrt(beta) v^(1/10) causes, smaller for usual speeds. Twice: once for
        # the true function's change, and once for the formula's.
        slowest, fastest = hull(span.speeds for span in spans)
        is_usual = 1 / USUAL <= slowest <= fastest <= USUAL
        accuracy -= 2 * eps_error_from_v_star(HOSTS[code.format], USUAL if is_usual else None)
    # A quotient that is off by more than half of min(eps, 1 - eps) would be no approximation.
    return None if accuracy < minimax.SMALLEST_ERROR else min(accuracy, Fraction(1, 2))


def interval(encounters: Sequence[Encounter], code: Code) -> Interval:
    """Return the interval of a best quotient: the range of v* of all pairs, widened; a very low start becomes 0."""
    low, high = hull(in_format(encounter, code)[0] for encounter in encounters)
    # An interval that begins below 1/100 begins at 0: there 1 - eps = 1.15 v*^2 is 1e-4, and the quotient hardly gets
    # longer by it. The limit was chosen by hand.
    start = _outwards(low * (1 - BEYOND), -1) if low > Fraction(1, 100) else Fraction(0)
    return start, _outwards(high * (1 + BEYOND), 1)


def _outwards(number: Fraction, sign: int) -> Fraction:
    """Return a number >= 0 in three significant digits, rounded up (sign 1) or down (-1): away from the interval."""
    if not number:
        return number
    # The unit of the third digit: 10^(e - 2) for a number of the order 10^e. Names of kernels show three digits.
    unit = Fraction(10) ** (math.floor(math.log10(number)) - 2)
    steps = number / unit
    return unit * (math.ceil(steps) if sign > 0 else math.floor(steps))
