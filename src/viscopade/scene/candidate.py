"""Candidates for a scene: kernels with their costs and their proven errors there."""

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
"""Costs in multiplications on today's processors, roughly (docs/results/benchmark.md)."""
COSTS = (
    f"a count of operations (a division or a square root counts {DIVISION}, a logarithm or an exponential {LOGARITHM}, "
    f"a power {POWER})"
)
_COSTS = {"/": DIVISION, "divide": DIVISION, "sqrt": DIVISION, "pow": POWER, "cbrt": LOGARITHM}
_COSTS |= {"log2": LOGARITHM, "exp2": LOGARITHM}
AS_CHEAP = 1.2
"""Largest ratio of costs that count as equal. Then the smaller table wins, and after that a kernel for all speeds."""

READY = {
    "compact": ("speed", "quotient for all v*, {}, without tables"),
    "speed": ("speed", "speed table, {}"),
    "full": ("v_star", "table of v*, {}"),
}
"""The groups of the catalogue that are candidates: their argument, and the kernel in words."""
LARGEST_V_STAR = Fraction(1000)  # end of the interval of a best quotient, at most; a choice
STEEPEST = 4  # more than |d ln eps/d ln v*| and |d ln(1 - eps)/d ln v*|: at most 10/3, the power of eps at large v*
WIDER = Fraction(1, 1 << 18)  # more than the relative rounding errors of beta, the speed and v* in float
BEYOND = Fraction(1, 50)  # share by which the interval of a quotient exceeds that of the scene: 20 % in speed
# Factors of the accuracy that are tried for a float kernel; a choice.
TIGHTER = (Fraction(1), Fraction(1, 2), Fraction(1, 4))
SAMPLES = 4001  # values of v* at which an error is sampled, for a message; a choice
VALUES = "values"  # name of the list of constants
_LEAST = 2e-38  # least constant: a normal number in float, whose smallest is 2^-126 = 1.2e-38
NOISE = 1e-15  # more than the relative error of a sampled error of eps in double


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
        """Return the kernel's eps for a pair, by its number, in double."""
        if self.is_constant:
            return np.full_like(v_star, self.kernel.lists[VALUES][pair])
        if any(function.name == "epsilon" for function in self.kernel.functions):
            return np.asarray(function_values(self.kernel, "epsilon", v_star))
        return np.asarray(function_values(self.kernel, "restitution", np.ones_like(v_star), v_star**2))

    def sampled(self, met: Sequence[Encounter], measure: str) -> tuple[float, float, str]:
        """Return the largest error (sampled) in a measure of the tolerance, with its v* and its pair.

        It is computed in double, and reduced by the rounding error of the sample.
        """
        return max(self._sampled(i, encounter, measure) for i, encounter in enumerate(met))

    def _sampled(self, pair: int, encounter: Encounter, measure: str) -> tuple[float, float, str]:
        low, high = map(float, encounter.v_star)
        v_star = np.geomspace(low, high, SAMPLES)
        # The error of eps that is certain: the rounding of the exact eps is taken off.
        eps, loss = double.epsilon(v_star), double.one_minus_epsilon(v_star)
        eps_of_kernel = self.epsilon(pair, v_star)
        off = np.maximum(np.abs(eps_of_kernel - eps) - NOISE * eps, 0.0)
        # The error of eps that makes 1 in this measure.
        scale = tolerance.in_eps(measure, eps, loss)
        if measure == "dissipation":
            # |eps_k^2 - eps^2|/(1 - eps^2) = |eps_k - eps| (eps_k + eps)/((1 - eps) (1 + eps)): not to first order, as
            # the errors of constants are large.
            scale = loss * (1 + eps) / (eps_of_kernel + eps)
        i = int(np.argmax(off / scale))
        return float(off[i] / scale[i]), float(v_star[i]), encounter.name


def candidates(scene: Scene, met: Sequence[Encounter]) -> Iterator[Candidate]:
    """Yield the kernels for a scene's language, format and argument, and a best quotient if it may be cheaper."""
    others = [constant(scene, met), *_ready(scene, met)]
    yield from others
    # No quotient costs less than `least`: two operations, and for speeds v* = sqrt(beta) v^(1/10), which is a power, a
    # root (as a division) and a product. A fit takes time, and saves little where a kernel that is accurate enough
    # costs hardly more.
    least = 2 + (POWER + DIVISION + 1 if scene.code.argument == "speed" else 0)
    enough = any(not other.failing and other.cost <= AS_CHEAP * least for other in others)
    if not enough and too_rough(scene, met) is None and (best := best_quotient(scene, met)) is not None:
        yield best


def _ready(scene: Scene, met: Sequence[Encounter]) -> Iterator[Candidate]:
    """Yield the kernels of the catalogue that exist in the language and are proven on the scene."""
    code = scene.code
    # Groups with the argument of the scene, which the language has, and whose domain contains the scene.
    groups = [group for group, (argument, _) in READY.items() if argument == code.argument]
    if not code.spoken.table:
        groups = [group for group in groups if group == "compact"]
    if "compact" in groups and uncovered(scene, met):
        groups.remove("compact")
    # Of their kernels, those whose table is not too large and that have a proven error here.
    for entry in (entry for entry in catalogue.CATALOGUE.values() if entry.group in groups):
        if code.largest_table is None or entry.kernel.bytes <= code.largest_table:
            accuracy = "full accuracy" if entry.variant in ("", "full") else f"to {entry.variant}"
            ready = _candidate(scene, met, entry.kernel, READY[entry.group][1].format(accuracy))
            if ready is not None:
                yield ready


def _candidate(
    scene: Scene, met: Sequence[Encounter], kernel: Kernel, label: str, degrees: tuple[int, int] | None = None
) -> Candidate | None:
    """Return a candidate; None if the kernel has no proven error on the scene."""
    code = scene.code
    if code.format not in kernel.formats:
        return None
    errors = tolerance.errors_on(kernel, code.function, code.number.arithmetics, ranges(scene, met))
    if errors is None:
        return None
    count = weighted_operations(kernel, code.function, met[0])
    return Candidate(kernel, label, count, errors, tolerance.failing(errors, scene.tolerance), degrees)


def weighted_operations(kernel: Kernel, result: str, encounter: Encounter) -> int:
    """Return the weighted number of operations of a result, in the branch of a typical impact."""
    # The branch that a typical impact takes: beta = v*^2 at the speed 1.
    function, v_star = kernel.function(result), float(encounter.pair.v_star(encounter.speeds.typical))
    inputs = {"v_star": v_star, "speed": 1.0, "beta": v_star**2}
    taken = taken_branch(kernel, result, *(inputs[name] for name in function.arguments))
    # Operations of this branch with their costs; a sum or a product, whose name is its sign, costs 1.
    branch = function.branches[taken]
    counts = expressions.operations((*function.start, *branch.program), branch.results[function.result])
    count = sum(number * _COSTS.get(name, not name.isidentifier()) for name, number in counts.items())
    # Outside its first branch a kernel of the speed may call another one.
    called = kernel.fallback if taken > 0 else None
    return count + (0 if called is None else weighted_operations(called, "epsilon", encounter))


# --- ranges -----------------------------------------------------------------------------------------------------------


def ranges(scene: Scene, met: Sequence[Encounter]) -> list[tolerance.Range]:
    """Return the ranges of v*, eps and speeds of each pair, widened by the roundings up to v*."""
    unit = Fraction(scene.scale.speed)
    speeds = [
        (Fraction(encounter.speeds.slowest) / unit, Fraction(encounter.speeds.fastest) / unit) for encounter in met
    ]
    return [
        tolerance.Range(*in_format(encounter, scene.code), ends) for encounter, ends in zip(met, speeds, strict=True)
    ]


def in_format(encounter: Encounter, code: Code) -> tuple[Interval, Interval]:
    """Return the ranges of v* and of eps, widened by the rounding of beta, the speed and v*.

    In double the encounter's own ranges are wide enough.
    """
    if code.format == DOUBLE.name:
        return encounter.v_star, encounter.epsilon
    (low, high), (least, most) = encounter.v_star, encounter.epsilon
    # A relative change of v* by WIDER changes eps and 1 - eps by less than STEEPEST WIDER, relatively.
    wide = low * (1 - WIDER), high * (1 + WIDER)
    wider = STEEPEST * WIDER
    return wide, (least * (1 - wider), 1 - (1 - most) * (1 - wider))


def uncovered(scene: Scene, met: Sequence[Encounter]) -> str | None:
    """Return the reason why no compact kernel is proven on this scene (v* or beta out of range), or None."""
    code, arithmetic = scene.code, scene.code.number.arithmetics[-1]
    compact = catalogue.group("compact")[0].kernel.bound("restitution", arithmetic.place, code.format)[-1]
    largest = 2.0 ** ((FORMATS[code.format].largest - 2) / 5)  # beta^2, beta^4 and beta^5 must be normal numbers
    v_star = hull(span.v_star for span in ranges(scene, met))
    beta = hull((encounter.weakest.beta, encounter.strongest.beta) for encounter in met)
    for name, (low, high), (least, most) in (
        ("v*", v_star, (compact.low, compact.high)),
        (f"beta in {scene.units.beta}", map(scene.scale.beta, beta), (1 / largest, largest)),
    ):
        if not least <= low <= high <= most:
            return (
                f"{name} ranges from {float(low):.3g} to {float(high):.3g}: expected {float(least):.3g} to "
                f"{float(most):.3g} for {code.language} ({code.format})"
            )
    return None


# --- constants --------------------------------------------------------------------------------------------------------


def constant(scene: Scene, met: Sequence[Encounter]) -> Candidate:
    """Return the candidate that is a constant eps for each pair: the shortest decimal within the tolerance."""
    code, eps = scene.code, [span.epsilon for span in ranges(scene, met)]
    values = [_decimal(epsilon, scene.tolerance, code) for epsilon in eps]
    kernel = Kernel(
        "constant", "a constant", "pair", "eps is a number", "the scene", "the pairs of the scene",
        (value_of_pair("epsilon", VALUES, "eps of a pair"),), {form: {} for form in FORMATS},
        lists={VALUES: tuple(values)},
    )  # fmt: skip
    errors = tolerance.worst_errors(
        _of_constant(value, epsilon, code) for value, epsilon in zip(values, eps, strict=True)
    )
    label = "a constant" + " for each pair" * (len(met) > 1)
    return Candidate(kernel, label, 0, errors, tolerance.failing(errors, scene.tolerance))


def value_of_pair(name: str, values: str, meaning: str) -> Function:
    """Return the function that reads a list of values by the number of a pair."""
    return Function(name, ("pair",), meaning, None, (), (CodeBranch(None, (), {name: Item(values, "pair")}),), name)


def _of_constant(number: float, epsilon: Interval, code: Code) -> tolerance.Errors:
    """Return the errors of a number, rounded to the format, and of (1 - eps) (1 + eps)."""
    value = Fraction(FORMATS[code.format].nearest(Fraction(repr(number))))
    # Twice the three roundings of (1 - eps) (1 + eps), each of them at most 2^-precision; twice is a choice.
    lost = (1 - value**2) * Fraction(6) * Fraction(2) ** -FORMATS[code.format].precision
    return {
        "epsilon": max(abs(value - e) / e for e in epsilon),
        "dissipation": max(
            (abs(e**2 - value**2) + lost) / (1 - e**2) if e < 1 else tolerance.HOPELESS for e in epsilon
        ),
        "absolute": max(abs(value - e) for e in epsilon),
    }


def _decimal(epsilon: Interval, asked: Tolerance, code: Code) -> float:
    """Return the shortest decimal within the tolerance, or the best number if there is none."""
    low, high = (float(e) for e in epsilon)
    # The smallest and the largest constant within a tolerance t, by the name of the tolerance.
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
        bounds = [within[name](scale * limit) for name, limit in asked.limits().items()]
        return max(least for least, _ in bounds), min(most for _, most in bounds)

    # If no constant is within the tolerance, bisect the logarithm of the smallest multiple of it that one is within: up
    # to 1e30, to 1e-4 (both are a choice).
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
        if _LEAST <= value <= 1 and not tolerance.failing(_of_constant(value, epsilon, code), asked):
            return value
    return min(max(middle, low, _LEAST), 1.0)


# --- best quotients ---------------------------------------------------------------------------------------------------


def too_rough(scene: Scene, met: Sequence[Encounter]) -> str | None:
    """Return the reason why no quotient meets the tolerance, if its last division's rounding exceeds it, or None."""
    arithmetic = scene.code.number.arithmetics[-1]
    # Errors of a kernel with no other error than the rounding of its last division, at most 2^-precision.
    unit = Fraction(2) ** -arithmetic.form.precision
    least = ErrorBound("epsilon", Fraction(0), Fraction(1), "value", Fraction(0), unit, arithmetic=arithmetic)
    errors = tolerance.worst_errors(tolerance.errors_of(least, span.epsilon) for span in ranges(scene, met))
    for name in tolerance.failing(errors, scene.tolerance):
        off = at_most(errors[name]) if errors[name] < tolerance.HOPELESS else "any size"
        error = f"{tolerance.MEASURES[name]} of {off}, more than {scene.tolerance.limits()[name]:g}"
        return f"quotients: one division in {arithmetic.form.name} may already cause a {error}"
    return None


def best_quotient(scene: Scene, met: Sequence[Encounter]) -> Candidate | None:
    """Return the cheapest best approximant within the tolerance on the range of v* of all pairs, or None.

    In float it is a more accurate one if its rounding needs it.
    """
    low, high = interval(met, scene.code)
    accuracy = _accuracy(scene, met)
    if high > LARGEST_V_STAR or accuracy is None:
        return None
    by_pow = ", v* by pow" if scene.code.argument == "speed" else ""
    for factor in TIGHTER if scene.code.format != DOUBLE.name else TIGHTER[:1]:
        # Three digits, as a request for a kernel writes them; 0.15 % less (a choice), as they are rounded to nearest.
        try:
            short = f"{float(accuracy * factor) * 0.9985:.2e}".replace("e-0", "e-")
            kernel = quotient.accurate_quotient(short, high, low)
        except (ValueError, ArithmeticError):
            return None
        m, n = kernel.record["m"], kernel.record["n"]
        candidate = _candidate(scene, met, kernel, f"best quotient {kernel.label}{by_pow}", (m, n))
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


def _accuracy(scene: Scene, met: Sequence[Encounter]) -> Fraction | None:
    """Return the allowed error of a kernel relative to min(eps, 1 - eps), or None if no kernel is that accurate."""
    code, where = scene.code, ranges(scene, met)
    # The allowed error is to first order: 0.1 % of it are a margin (a choice).
    accuracy = tolerance.allowed(scene.tolerance, [span.epsilon for span in where]) * Fraction(999, 1000)
    if code.argument == "speed":
        # Less the error that the computed v* = sqrt(beta) v^(1/10) causes, smaller for usual speeds.
        slowest, fastest = hull(span.speeds for span in where)
        usual = 1 / USUAL <= slowest <= fastest <= USUAL
        accuracy -= 2 * eps_error_from_v_star(HOSTS[code.format], USUAL if usual else None)
    return None if accuracy < minimax.SMALLEST_ERROR else min(accuracy, Fraction(1, 2))


def interval(met: Sequence[Encounter], code: Code) -> Interval:
    """Return the interval of a best quotient: the range of v* of all pairs, widened; a very low start becomes 0."""
    low, high = hull(in_format(encounter, code)[0] for encounter in met)
    # An interval that begins below 1/100 begins at 0; the limit is a choice.
    start = _outwards(low * (1 - BEYOND), -1) if low > Fraction(1, 100) else Fraction(0)
    return start, _outwards(high * (1 + BEYOND), 1)


def _outwards(number: Fraction, sign: int) -> Fraction:
    if not number:
        return number
    # Three significant digits, rounded away from the interval.
    unit = Fraction(10) ** (math.floor(math.log10(number)) - 2)
    steps = number / unit
    return unit * (math.ceil(steps) if sign > 0 else math.floor(steps))
