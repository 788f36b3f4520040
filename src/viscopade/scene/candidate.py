"""The kernels that a scene may be content with, each with its cost, its proven errors on the scene, and its code."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import numpy as np

from viscopade import catalogue, double, exports, minimax, proofs
from viscopade.arrays import FloatArray
from viscopade.catalogue import HOST, Entry
from viscopade.certificate import Measure
from viscopade.kernels.binary import DOUBLE, FLOAT
from viscopade.kernels.compact import TARGETS
from viscopade.kernels.minimax import MinimaxKernel
from viscopade.scene import formula
from viscopade.scene.cost import Operations, id_of_tier
from viscopade.scene.description import Code, Scene, Tolerance
from viscopade.scene.encounter import Encounter, Interval
from viscopade.scene.tolerance import Bound, Errors, allowed

FORMATS = {form.name: form for form in (DOUBLE, FLOAT)}
LARGEST_V_STAR = Fraction(1000)  # of quotients of polynomials
SAMPLES = 4001
ULPS_OF_DISSIPATION = 3  # that the last sums and products of 1 - eps^2 add


@dataclass(frozen=True)
class Candidate(ABC):
    """A kernel.

    Attributes
    ----------
    encounters : sequence of Encounter
        The pairs of the scene.
    """

    encounters: Sequence[Encounter]

    @property
    @abstractmethod
    def label(self) -> str:
        """What it is, for the reader."""

    @property
    @abstractmethod
    def name(self) -> str:
        """The end of the functions' names."""

    @property
    @abstractmethod
    def operations(self) -> Operations:
        """What one evaluation consists of."""

    @property
    @abstractmethod
    def errors(self) -> Errors:
        """The largest errors on the scene, proven, rounding included."""

    @abstractmethod
    def epsilon(self, encounter: Encounter, v_star: FloatArray) -> FloatArray:
        """Return what the formula gives for a pair, to show where it fails."""

    @property
    def bench_id(self) -> str | None:
        """The id in the benchmark, if it is measured there."""
        return None

    @property
    def bytes(self) -> int:
        """Size of the table."""
        return 0

    def request(self) -> exports.Request | None:
        """Return what `viscopade export` is to be asked for; None if there is no such file."""
        return None

    def sampled(self, measure: str) -> tuple[float, float, str]:
        """Return the largest error in one of the tolerance's measures that was found, at which v*, and of which pair.

        Of the formula, without rounding.
        """
        return max(self._sampled(encounter, measure) for encounter in self.encounters)

    def _sampled(self, encounter: Encounter, measure: str) -> tuple[float, float, str]:
        low, high = (float(v) for v in encounter.v_star)
        v_star = np.geomspace(low, high, SAMPLES)
        eps, loss = np.asarray(double.epsilon(v_star)), np.asarray(double.one_minus_epsilon(v_star))
        off = np.abs(self.epsilon(encounter, v_star) - eps)
        scale = {"epsilon": eps, "dissipation": loss * (1 + eps) / (2 * eps), "absolute": np.ones_like(eps)}[measure]
        i = int(np.argmax(off / scale))
        return float(off[i] / scale[i]), float(v_star[i]), encounter.name


@dataclass(frozen=True)
class Constant(Candidate):
    """One number for each pair.

    Attributes
    ----------
    tolerance : Tolerance
    """

    tolerance: Tolerance

    @property
    def label(self) -> str:
        """What it is."""
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
        """By pair, eps as a decimal."""
        return tuple(_constant(encounter.epsilon, self.tolerance) for encounter in self.encounters)

    @cached_property
    def errors(self) -> Errors:
        """Errors at the ends of the ranges, where they are largest, as eps falls with v*."""
        found = None
        for value, encounter in zip(self.values, self.encounters, strict=True):
            mine = _of_constant(Fraction(value), encounter.epsilon)
            found = mine if found is None else found.worse(mine)
        assert found is not None
        return found

    def epsilon(self, encounter: Encounter, v_star: FloatArray) -> FloatArray:
        """Return the constant."""
        return np.full_like(v_star, float(self.values[list(self.encounters).index(encounter)]))


def _of_constant(value: Fraction, epsilon: Interval) -> Errors:
    off = [abs(value - e) for e in epsilon]
    lost = [1 - e**2 for e in epsilon]
    of_dissipation = [abs(1 - value**2 - d) / d if d else Fraction(10) ** 30 for d in lost]
    return Errors(max(o / e for o, e in zip(off, epsilon, strict=True)), max(of_dissipation), max(off))


def _constant(epsilon: Interval, tolerance: Tolerance) -> str:
    """Return the shortest decimal that keeps the tolerance, or about the best one if none does."""
    low, high = (float(e) for e in epsilon)
    # By tolerance t: the least and the largest constant that keep it.
    keep: Mapping[str, Callable[[float], tuple[float, float]]] = {
        "epsilon": lambda t: (high * (1 - t), low * (1 + t)),
        "dissipation": lambda t: (_with_loss((1 - high**2) * (1 + t)), _with_loss((1 - low**2) * (1 - t))),
        "absolute": lambda t: (high - t, low + t),
    }
    kept = [keep[name](limit) for name, limit in tolerance.given().items()]
    middle = (max(least for least, _ in kept) + min(most for _, most in kept)) / 2
    for digits in range(1, 17):
        text = f"{middle:.{digits}g}"
        if 0 < float(text) <= 1 and not _of_constant(Fraction(text), epsilon).failing(tolerance):
            return text
    return f"{min(max(middle, low), high):.17g}"


def _with_loss(loss: float) -> float:
    """Return the eps with 1 - eps^2 = loss."""
    return math.sqrt(max(1 - loss, 0.0))


@dataclass(frozen=True)
class Polynomial(Candidate):
    """A best approximant [m/n] on the scene's range of v*; a two-term series if it is [2/0].

    Attributes
    ----------
    kernel : MinimaxKernel
    code : Code
    wanted : Request
        What it was asked for with.
    """

    kernel: MinimaxKernel
    code: Code
    wanted: exports.Request

    @property
    def label(self) -> str:
        """What it is."""
        of_speed = ", v* by pow" if self.code.argument == "speed" else ""
        kind = "best series" if self.kernel.n == 0 else "best quotient"
        return f"{kind} {self.kernel.label}{of_speed}"

    @property
    def name(self) -> str:
        """The name."""
        return self.kernel.name

    @property
    def operations(self) -> Operations:
        """Two Horner's rules, a quotient, and v*."""
        powers = int(self.code.argument == "speed")
        return Operations(2 * (self.kernel.m + self.kernel.n), int(self.kernel.n > 0), powers)

    @cached_property
    def errors(self) -> Errors:
        """Errors on the scene."""
        form = FORMATS[self.code.format]
        variant = next(v for v in self.kernel.variants if v.form == form)
        bound, rounding = Fraction(variant.certificate.bound), Fraction(variant.rounding)
        both, relative = (bound, rounding) if variant.certificate.measure == "both" else (Fraction(0), bound + rounding)
        return _worst(self.encounters, Bound(both + _of_v_star(self.code), relative, _of_product(self.code)))

    def epsilon(self, encounter: Encounter, v_star: FloatArray) -> FloatArray:
        """Return the quotient."""
        a, b = (np.polynomial.Polynomial([float(c) for c in part]) for part in (self.kernel.a, self.kernel.b))
        return np.asarray(a(v_star) / b(v_star))

    def request(self) -> exports.Request:
        """Return what `viscopade export` is to be asked for."""
        return self.wanted


@dataclass(frozen=True)
class Ready(Candidate):
    """A kernel of the catalogue.

    Attributes
    ----------
    entry : Entry
    code : Code
    """

    entry: Entry
    code: Code

    @property
    def label(self) -> str:
        """What it is."""
        tier, size = self.entry.tier, " (small table)" if self.entry.size == "small" else ""
        accuracy = "full accuracy" if tier == "full" else f"to {tier}"
        of_speed = ", v* by pow" if self.code.argument == "speed" else ""
        return {
            "speed": f"table of the speed, {accuracy}{size}",
            "half-line": f"quotient for all v*, {accuracy}{of_speed}",
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
    def bench_id(self) -> str | None:
        """The id in the benchmark."""
        return id_of_tier(self.entry.tier, self.entry.size) if self.entry.kind == "speed" else None

    @property
    def operations(self) -> Operations:
        """As counted in the templates."""
        simple, by_pow = self.entry.operations, int(self.code.argument == "speed")
        return {
            "speed": Operations(simple),
            "half-line": Operations(simple, 1, by_pow, 1),
            "compact": Operations(simple, 1, 1),
            "full": Operations(simple, 0, by_pow),
        }[self.entry.kind]

    @cached_property
    def errors(self) -> Errors:
        """Errors on the scene."""
        unit = Fraction(2) ** -FORMATS[self.code.format].precision
        apart = self.entry.kind != "half-line"
        added = Fraction(0) if apart else _of_v_star(self.code)
        found = None
        for encounter in self.encounters:
            bound = Bound(self.entry.error(*encounter.v_star) + added, unit, _of_product(self.code), apart)
            errors = bound.errors(encounter.epsilon)
            found = errors if found is None else found.worse(errors)
        assert found is not None
        return found

    def epsilon(self, encounter: Encounter, v_star: FloatArray) -> FloatArray:
        """Return what the kernel computes, without rounding."""
        return formula.epsilon(self.entry, v_star)

    def request(self) -> exports.Request:
        """Return what `viscopade export` is to be asked for."""
        if self.entry.kind == "speed":
            return exports.Request(from_speed=(self.entry.tier,), size=self.entry.size)
        if self.entry.kind == "full":
            return exports.Request(full=True)
        return exports.Request(accuracy=(self.entry.tier,))


def _worst(encounters: Sequence[Encounter], bound: Bound) -> Errors:
    errors = [bound.errors(encounter.epsilon) for encounter in encounters]
    worst = errors[0]
    for other in errors[1:]:
        worst = worst.worse(other)
    return worst


def _of_product(code: Code) -> Fraction:
    """Return what the last roundings of 1 - eps^2 add, relatively."""
    return 2 * ULPS_OF_DISSIPATION * Fraction(2) ** -FORMATS[code.format].precision


def _of_v_star(code: Code) -> Fraction:
    """Return what the rounding of v* adds, if the kernel is given a speed."""
    if code.argument == "v_star":
        return Fraction(0)
    entry = next(e for e in catalogue.entries() if e.kind == "v*" and e.format == code.format)
    return Fraction(entry.inside)


# --- all of them ------------------------------------------------------------------------------------------------------


def candidates(scene: Scene, encounters: Sequence[Encounter]) -> Iterator[Candidate]:
    """Yield the kernels that language, format and argument admit; of best quotients on the range, the cheapest."""
    yield Constant(encounters, scene.tolerance)
    code = scene.code
    kinds = _kinds(code)
    if "polynomial" in kinds:
        found = polynomial(scene, encounters)
        if found is not None:
            yield found
    place = {"cuda": "device", "glsl": "shader", "wgsl": "shader"}.get(code.language, HOST)
    for entry in catalogue.entries():
        fits = code.largest_table is None or entry.bytes <= code.largest_table
        here = entry.place == (HOST if code.format == "double" else place)
        if entry.kind in kinds and entry.format == code.format and here and fits:
            yield Ready(encounters, entry, code)


def _kinds(code: Code) -> set[str]:
    if code.language in TARGETS:
        return {"compact"}
    if code.language == "python":
        return {"polynomial", "half-line"}
    return {"polynomial", "half-line", "speed" if code.argument == "speed" else "full"}


def polynomial(scene: Scene, encounters: Sequence[Encounter]) -> Polynomial | None:
    """Return the cheapest best approximant that keeps the tolerance on the range of v* of all pairs, or None."""
    low, high = interval(encounters)
    if high > LARGEST_V_STAR:
        return None
    found = []
    for measure in ("both", "relative"):
        accuracy = allowed(scene.tolerance, [e.epsilon for e in encounters], measure)
        accuracy = min(accuracy * Fraction(999, 1000) - 2 * _of_v_star(scene.code), Fraction(1, 2))
        if accuracy < Fraction(1, 10**15):
            continue
        text = _short(accuracy)
        request = exports.Request(
            accuracy=(text,), v_star_max=str(float(high)), v_star_min=_plain(low), measure=_measure(measure)
        )
        try:
            kernel = proofs.accurate(text, high, low, _measure(measure))
        except (ValueError, ArithmeticError):
            continue
        if any(v.form.name == scene.code.format for v in kernel.variants):
            found.append(Polynomial(encounters, kernel, scene.code, request))
    fine = [candidate for candidate in found if not candidate.errors.failing(scene.tolerance)]
    return min(fine or found, key=lambda c: minimax.cost(c.kernel.m, c.kernel.n), default=None)


def _measure(name: str) -> Measure:
    return "both" if name == "both" else "relative"


def _plain(number: Fraction) -> str:
    return str(float(number)) if number else "0"


def _short(accuracy: Fraction) -> str:
    """Return a number rounded down to three digits."""
    text = f"{float(accuracy) * 0.9985:.2e}"
    return text.replace("e-0", "e-")


def interval(encounters: Sequence[Encounter]) -> Interval:
    """Return the range of v* of all pairs, rounded outwards to three digits; to 0 if it begins very low."""
    low = min(encounter.v_star[0] for encounter in encounters)
    high = max(encounter.v_star[1] for encounter in encounters)
    return _outwards(low, -1) if low > Fraction(1, 100) else Fraction(0), _outwards(high, 1)


def _outwards(number: Fraction, sign: int) -> Fraction:
    unit = Fraction(10) ** (math.floor(math.log10(number)) - 2)
    steps = number / unit
    return unit * (math.ceil(steps) if sign > 0 else math.floor(steps))


def cheaper_polynomial(found: Polynomial) -> tuple[str, float] | None:
    """Return the best approximant of the next lower cost, and its error; None if there is none."""
    low, high = found.kernel.interval
    price = minimax.cost(found.kernel.m, found.kernel.n) - 1
    fit = minimax.most_accurate(price, high, low, _measure(found.kernel.bounds[0].measure))
    return None if fit is None else (fit.label, float(fit.error))
