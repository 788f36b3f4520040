"""Candidate kernels for a scene, each with its operations, its proven errors on the scene, and its code."""

from __future__ import annotations

import math
import operator
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import cast

import numpy as np

from viscopade.approximation import cheapest, minimax
from viscopade.approximation.measure import RELATIVE_TO, Measure
from viscopade.arithmetic.formats import DOUBLE, FLOAT, FORMATS, Format
from viscopade.arrays import double
from viscopade.arrays.checked import FloatArray
from viscopade.kernels import expressions, formulas, machine, prove_rational, registry, registry_arrays, requests
from viscopade.kernels.forms.minimax import MinimaxKernel
from viscopade.kernels.registry import HOST, Entry, limits
from viscopade.kernels.speed_table import LAST_ULPS
from viscopade.scene.cost import Operations
from viscopade.scene.description import Code, Scene, Tolerance
from viscopade.scene.encounter import Encounter, Interval
from viscopade.scene.tolerance import HOPELESS, Bound, Errors, allowed, worst

LARGEST_V_STAR = Fraction(1000)  # of quotients of polynomials
STEEPEST = 4  # |d ln eps/d ln v*| and |d ln(1 - eps)/d ln v*| are less: 10/3 at most
WIDER = Fraction(1, 1 << 18)  # more than what type float does to beta, the speed and v*, relatively
LEAST_ACCURACY = Fraction(1, 10**15)
TIGHTER = (Fraction(1), Fraction(1, 2), Fraction(1, 4))  # by which accuracy is increased to find a kernel of type float
SAMPLES = 4001
_LEAST = 2e-38  # constant: a normal number of type float
NOISE = 1e-15  # more than double precision adds to a sampled error of eps, relatively


@dataclass(frozen=True)
class Candidate(ABC):
    """A candidate: a kernel on the pairs of a scene.

    Attributes
    ----------
    encounters : sequence of Encounter
        The pairs of the scene.
    code : Code
    """

    encounters: Sequence[Encounter]
    code: Code

    @property
    @abstractmethod
    def label(self) -> str:
        """The kernel in words, for the reader."""

    @property
    @abstractmethod
    def name(self) -> str:
        """The end of the functions' names."""

    @property
    @abstractmethod
    def operations(self) -> Operations:
        """Operations of one evaluation."""

    @property
    @abstractmethod
    def errors(self) -> Errors:
        """The largest errors on the scene (proven), with rounding."""

    @abstractmethod
    def epsilon(self, encounter: Encounter, v_star: FloatArray) -> FloatArray:
        """Return the formula's eps for a pair, to find the place of its largest error."""

    @property
    def bytes(self) -> int:
        """Size of the table."""
        return 0

    def request(self) -> requests.Request | None:
        """Return the request to `viscopade export` for this kernel; None if no export has it."""
        return None

    def sampled(self, measure: str) -> tuple[float, float, str]:
        """Return the largest error found (sampled) in a measure of the tolerance, its v*, and its pair.

        Of the formula, without rounding: what rounding may have done to the sample is taken off.
        """
        return max(self._sampled(encounter, measure) for encounter in self.encounters)

    def _sampled(self, encounter: Encounter, measure: str) -> tuple[float, float, str]:
        low, high = (float(v) for v in encounter.v_star)
        v_star = np.geomspace(low, high, SAMPLES)
        eps, loss = double.epsilon(v_star), double.one_minus_epsilon(v_star)
        off = np.maximum(np.abs(self.epsilon(encounter, v_star) - eps) - NOISE * eps, 0.0)
        scale = {"epsilon": eps, "dissipation": loss * (1 + eps) / (2 * eps), "absolute": np.ones_like(eps)}[measure]
        i = int(np.argmax(off / scale))
        return float(off[i] / scale[i]), float(v_star[i]), encounter.name


@dataclass(frozen=True)
class PairConstant(Candidate):
    """The candidate of a constant eps for each pair.

    Attributes
    ----------
    tolerance : Tolerance
    """

    tolerance: Tolerance

    @property
    def label(self) -> str:
        """The kernel in words."""
        return "a constant" + (" for each pair" if len(self.encounters) > 1 else "")

    @property
    def name(self) -> str:
        """The name."""
        return "constant"

    @property
    def operations(self) -> Operations:
        """Nothing."""
        return Operations()

    @cached_property
    def values(self) -> tuple[str, ...]:
        """The constant eps of each pair, as a decimal."""
        met = (in_format(encounter, self.code) for encounter in self.encounters)
        return tuple(_constant(epsilon, self.tolerance, self.code) for _, epsilon in met)

    @cached_property
    def errors(self) -> Errors:
        """Errors at the ends of the ranges; they are largest there, as eps falls with v*."""
        found = None
        for value, encounter in zip(self.values, self.encounters, strict=True):
            mine = _of_constant(value, in_format(encounter, self.code)[1], self.code)
            found = mine if found is None else found.worse(mine)
        assert found is not None
        return found

    def epsilon(self, encounter: Encounter, v_star: FloatArray) -> FloatArray:
        """Return the constant."""
        return np.full_like(v_star, float(self.values[list(self.encounters).index(encounter)]))


def _of_constant(text: str, epsilon: Interval, code: Code) -> Errors:
    """Return the errors of a decimal, rounded to the format, and of (1 - eps) (1 + eps)."""
    value = Fraction(FORMATS[code.format].nearest(Fraction(text)))
    off = [abs(value - e) for e in epsilon]
    lost = [1 - e**2 for e in epsilon]
    computed = (1 - value**2) * _of_product(code)
    of_dissipation = [(abs(1 - value**2 - d) + computed) / d if d else HOPELESS for d in lost]
    return Errors(max(o / e for o, e in zip(off, epsilon, strict=True)), max(of_dissipation), max(off))


def _constant(epsilon: Interval, tolerance: Tolerance, code: Code) -> str:
    """Return the shortest decimal that keeps the tolerance, or the best number if none does."""
    low, high = (float(e) for e in epsilon)
    # By tolerance t: the least and the largest constant that keep it.
    keep: Mapping[str, Callable[[float], tuple[float, float]]] = {
        "epsilon": lambda t: (high * (1 - t), low * (1 + t)),
        "dissipation": lambda t: (_with_loss((1 - high**2) * (1 + t)), _with_loss((1 - low**2) * (1 - t))),
        "absolute": lambda t: (high - t, low + t),
    }

    def kept(scale: float) -> tuple[float, float]:
        """Return the least and the largest constant that keep this multiple of the tolerance; none if out of order."""
        ends = [keep[name](scale * limit) for name, limit in tolerance.given().items()]
        return max(least for least, _ in ends), min(most for _, most in ends)

    middle = sum(kept(_smallest(lambda scale: operator.le(*kept(scale))))) / 2
    for digits in range(1, 18):
        text = f"{middle:.{digits}g}"
        if _LEAST <= float(text) <= 1 and not _of_constant(text, epsilon, code).failing(tolerance):
            return text
    return f"{min(max(middle, low, _LEAST), 1.0):.17g}"


def _smallest(holds: Callable[[float], bool]) -> float:
    """Return 1 if that holds, or nearly the smallest number above for which it does: what holds once, holds on."""
    low, high = 1.0, 1e30
    if holds(low):
        return low
    while high > 1.0001 * low:
        middle = math.sqrt(low * high)
        low, high = (low, middle) if holds(middle) else (middle, high)
    return high


def _with_loss(loss: float) -> float:
    """Return the eps with 1 - eps^2 = loss."""
    return math.sqrt(max(1 - loss, 0.0))


@dataclass(frozen=True)
class BestApproximant(Candidate):
    """The candidate of a best approximant [m/n] on the scene's range of v*; [2/0] is a two-term series.

    Attributes
    ----------
    kernel : MinimaxKernel
    wanted : Request
        The request to `viscopade export` for it.
    """

    kernel: MinimaxKernel
    wanted: requests.Request

    @property
    def label(self) -> str:
        """The kernel in words."""
        of_speed = ", v* by pow" if self.code.argument == "speed" else ""
        kind = "best series" if self.kernel.n == 0 else "best quotient"
        return f"{kind} {self.kernel.label}{of_speed}"

    @property
    def name(self) -> str:
        """The name."""
        return self.kernel.name

    @property
    def operations(self) -> Operations:
        """Operations: those of the formula, and v*."""
        near, _ = self._in_v_star(FORMATS[self.code.format])
        simple = expressions.simple_operations(near.program, near.results["epsilon"])
        return Operations(simple, int(self.kernel.n > 0), int(self.code.argument == "speed"))

    def _in_v_star(self, form: Format) -> tuple[expressions.CodeBranch, dict[str, float]]:
        """Return the formula in powers of v*, and its coefficients."""
        a, b = self.kernel.rounded(form)
        given = formulas.dense(a=a, b=b)
        return formulas.epsilon_branches(given)[0], given

    @cached_property
    def errors(self) -> Errors:
        """Errors on the scene."""
        variant = self.kernel.variant(FORMATS[self.code.format])
        bound = variant.error
        rounding, of_v_star = Fraction(variant.rounding), _of_v_star(self.code)
        if variant.certificate.measure == "both":
            both, relative = bound * (1 + of_v_star) + of_v_star, rounding
        else:
            both, relative = of_v_star, bound + rounding
        whole = Bound(both, relative * (1 + of_v_star), _of_product(self.code))
        return worst([whole.errors(in_format(encounter, self.code)[1]) for encounter in self.encounters])

    def epsilon(self, encounter: Encounter, v_star: FloatArray) -> FloatArray:
        """Return the quotient."""
        near, given = self._in_v_star(DOUBLE)
        return np.asarray(machine.computed(near, "epsilon", {**given, "v_star": v_star}, DOUBLE))

    def request(self) -> requests.Request:
        """Return the request to `viscopade export` for this kernel."""
        return self.wanted


@dataclass(frozen=True)
class RegistryKernel(Candidate):
    """The candidate of a kernel in the registry.

    Attributes
    ----------
    entry : Entry
    """

    entry: Entry

    @property
    def label(self) -> str:
        """The kernel in words."""
        tier, size = self.entry.tier, " (small table)" if self.entry.size == "small" else ""
        accuracy = "full accuracy" if tier == "full" else f"to {tier}"
        return {
            "speed": f"speed table, {accuracy}{size}",
            "compact": f"quotient for all v*, {accuracy}, without tables",
            "full": "table of v*, full accuracy",
        }[self.entry.kind]

    @property
    def name(self) -> str:
        """The name."""
        return self.entry.name

    @property
    def bytes(self) -> int:
        """Size of the table."""
        return self.entry.bytes

    @property
    def operations(self) -> Operations:
        """Operations as counted in the formulas."""
        called = int(self.entry.kind == "compact")  # a division, and logarithm and exponential, which count as a power
        return Operations(self.entry.operations, called, called)

    @cached_property
    def errors(self) -> Errors:
        """Errors on the scene."""
        last, loss = Fraction(self.entry.rounding), Fraction(self.entry.loss)
        found = []
        for encounter in self.encounters:
            v_star, epsilon = in_format(encounter, self.code)
            both = self.entry.error(*v_star)
            found.append(Bound(both, last * (1 + both), loss, True).errors(epsilon))
        return worst(found)

    def epsilon(self, encounter: Encounter, v_star: FloatArray) -> FloatArray:
        """Return the kernel's eps, without rounding."""
        return registry_arrays.entry_epsilon(self.entry, v_star)

    def request(self) -> requests.Request:
        """Return the request to `viscopade export` for this kernel."""
        if self.entry.kind == "speed":
            return requests.Request(from_speed=(self.entry.tier,), size=self.entry.size)
        if self.entry.kind == "full":
            return requests.Request(full=True)
        return requests.Request(accuracy=(self.entry.tier,))


def in_format(encounter: Encounter, code: Code) -> tuple[Interval, Interval]:
    """Return the ranges of v* and of eps, widened by the rounding of beta, the speed and v*.

    For type double the encounter's own ranges are wide enough.
    """
    if code.format == DOUBLE.name:
        return encounter.v_star, encounter.epsilon
    (low, high), (least, most) = encounter.v_star, encounter.epsilon
    wide = low * (1 - WIDER), high * (1 + WIDER)
    wider = STEEPEST * WIDER
    return wide, (least * (1 - wider), 1 - (1 - most) * (1 - wider))


def _of_product(code: Code) -> Fraction:
    """Return what the last roundings of 1 - eps^2 add, relatively."""
    return 2 * LAST_ULPS * Fraction(2) ** -FORMATS[code.format].precision


def _of_v_star(code: Code) -> Fraction:
    """Return what the rounding of v* adds, if the kernel is given a speed."""
    if code.argument == "v_star":
        return Fraction(0)
    entry = next(e for e in registry.entries() if e.kind == "v*" and e.format == code.format)
    return Fraction(entry.inside)


# --- all of them ------------------------------------------------------------------------------------------------------


def candidates(scene: Scene, encounters: Sequence[Encounter]) -> Iterator[Candidate]:
    """Yield the kernels for a scene's language, format and argument; of best quotients on the range, the cheapest."""
    code = scene.code
    yield PairConstant(encounters, code, scene.tolerance)
    target = code.target
    kinds = target.kinds[code.argument]
    if "polynomial" in kinds:
        found = best_polynomial(scene, encounters)
        if found is not None:
            yield found
    covered = uncovered(scene, encounters) is None
    for entry in registry.entries():
        fits = code.largest_table is None or entry.bytes <= code.largest_table
        here = entry.place == (HOST if code.format == DOUBLE.name else target.place)
        if entry.kind in kinds and entry.format == code.format and here and fits and covered:
            yield RegistryKernel(encounters, code, entry)


def uncovered(scene: Scene, encounters: Sequence[Encounter]) -> str | None:
    """Return the reason why no compact kernel is proven on this scene (v* or beta beyond the type's range), or None."""
    code = scene.code
    if not code.target.compact:
        return None
    low, high = (pick(in_format(e, code)[0][i] for e in encounters) for i, pick in enumerate((min, max)))
    least, largest = limits(code.format)
    if not least <= low <= high <= largest:
        return (
            f"v* is from {float(low):.3g} to {float(high):.3g}: accepted for {code.language} ({code.format}) is "
            f"{float(least):.3g} to {float(largest):.3g}"
        )
    scale = scene.scale
    betas = [scale.beta(pair.beta) for e in encounters for pair in (e.weakest, e.strongest)]
    # beta^2, beta^4 and beta^5 must be normal numbers.
    exponent = (FORMATS[code.format].largest - 2) / 5
    if not 2.0**-exponent <= min(betas) <= max(betas) <= 2.0**exponent:
        return (
            f"beta is from {min(betas):.3g} to {max(betas):.3g} {scene.units.beta}: accepted for {code.language} "
            f"({code.format}) is {2.0**-exponent:.3g} to {2.0**exponent:.3g}, in whatever units"
        )
    return None


def best_polynomial(scene: Scene, encounters: Sequence[Encounter]) -> BestApproximant | None:
    """Return the cheapest best approximant within the tolerance on the range of v* of all pairs, or None.

    Of those in the measure "relative" only such that are cheaper than the one in "both" are looked for.
    """
    low, high = interval(encounters, scene.code)
    if high > LARGEST_V_STAR:
        return None
    first = _best(scene, encounters, (low, high), "both")
    if first is not None and not first.errors.failing(scene.tolerance):
        price, accuracy = minimax.cost(first.kernel.m, first.kernel.n), _accuracy(scene, encounters, "relative")
        fit = cheapest.most_accurate(price - 1, high, low, "relative") if accuracy is not None else None
        if accuracy is None or fit is None or fit.error > accuracy:
            return first
    found = [c for c in (first, _best(scene, encounters, (low, high), "relative")) if c is not None]
    fine = [candidate for candidate in found if not candidate.errors.failing(scene.tolerance)]
    return min(fine or found, key=lambda c: minimax.cost(c.kernel.m, c.kernel.n), default=None)


def _best(scene: Scene, encounters: Sequence[Encounter], ends: Interval, measure: Measure) -> BestApproximant | None:
    """Return the cheapest approximant in a measure, of which more is asked if there is none in the scene's format."""
    accuracy = _accuracy(scene, encounters, measure)
    low, high = ends
    for factor in TIGHTER if accuracy is not None and scene.code.format == FLOAT.name else TIGHTER[:1]:
        if accuracy is None or accuracy * factor < LEAST_ACCURACY:
            return None
        text = _short(accuracy * factor)
        try:
            kernel = prove_rational.accurate(text, high, low, measure)
        except (ValueError, ArithmeticError):
            return None
        if any(v.form.name == scene.code.format for v in kernel.variants):
            request = requests.Request(
                accuracy=(text,), v_star_max=str(float(high)), v_star_min=_plain(low), measure=measure
            )
            return BestApproximant(encounters, scene.code, kernel, request)
    return None


def _accuracy(scene: Scene, encounters: Sequence[Encounter], measure: Measure) -> Fraction | None:
    """Return what a kernel's error may be in a measure, or None if no kernel is that accurate."""
    ranges = [in_format(encounter, scene.code)[1] for encounter in encounters]
    accuracy = allowed(scene.tolerance, ranges, measure) * Fraction(999, 1000) - 2 * _of_v_star(scene.code)
    return None if accuracy < LEAST_ACCURACY else min(accuracy, Fraction(1, 2))


def _plain(number: Fraction) -> str:
    return str(float(number)) if number else "0"


def _short(accuracy: Fraction) -> str:
    """Return a number rounded down to three digits."""
    text = f"{float(accuracy) * 0.9985:.2e}"
    return text.replace("e-0", "e-")


def interval(encounters: Sequence[Encounter], code: Code) -> Interval:
    """Return the range of v* of all pairs, rounded outwards to three digits; a very low start becomes 0."""
    ranges = [in_format(encounter, code)[0] for encounter in encounters]
    low, high = min(least for least, _ in ranges), max(most for _, most in ranges)
    return _outwards(low, -1) if low > Fraction(1, 100) else Fraction(0), _outwards(high, 1)


def _outwards(number: Fraction, sign: int) -> Fraction:
    unit = Fraction(10) ** (math.floor(math.log10(number)) - 2)
    steps = number / unit
    return unit * (math.ceil(steps) if sign > 0 else math.floor(steps))


def cheaper_polynomial(found: BestApproximant) -> tuple[str, float, str] | None:
    """Return the best approximant of the next lower cost, its error and its measure in words; None without one."""
    bound = found.kernel.bound
    price = minimax.cost(found.kernel.m, found.kernel.n) - 1
    measure = cast(Measure, bound.measure)
    fit = cheapest.most_accurate(price, Fraction(bound.high), bound.low, measure)
    return None if fit is None else (fit.label, float(fit.error), RELATIVE_TO[measure])
