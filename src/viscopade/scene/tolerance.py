"""Errors in the measures of a tolerance, from a proven bound of a kernel and the scene's range of eps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import reduce

from viscopade.scene.description import Tolerance
from viscopade.scene.encounter import Interval

_HALF = Fraction(1, 2)
HOPELESS = Fraction(10) ** 30


@dataclass(frozen=True)
class Bound:
    """Proven bound of a computed eps: |d eps| <= both min(eps, 1 - eps) + relative eps, with both < 1.

    Attributes
    ----------
    both, relative : Fraction
    loss : Fraction
        What the last roundings of 1 - eps^2 add, relatively.
    apart : bool
        Whether 1 - eps^2 is computed apart, from the smaller of eps and 1 - eps: then `relative` does not harm it.
    """

    both: Fraction
    relative: Fraction
    loss: Fraction = Fraction(0)
    apart: bool = False

    def errors(self, epsilon: Interval) -> Errors:
        """Return the largest errors on a range of eps."""
        low, high = epsilon
        share = min(Fraction(1), (1 - low) / low)
        smaller = _HALF if low <= _HALF <= high else max(min(e, 1 - e) for e in epsilon)
        return Errors(
            self.both * share + self.relative,
            self._of_dissipation(high),
            self.both * smaller + self.relative * high,
        )

    def _of_dissipation(self, epsilon: Fraction) -> Fraction:
        """Return the relative error of 1 - eps^2 at the largest eps, where it is largest.

        It is |d eps| (2 eps + |d eps|)/((1 - eps) (1 + eps)). For eps >= 1/2, the factor 1 - eps of `both` is gone.
        """
        relative = Fraction(0) if self.apart else self.relative
        if epsilon == 1 and relative:  # eps is 1 to as many digits as it is known
            return HOPELESS
        of_relative = relative * epsilon / (1 - epsilon) if relative else Fraction(0)
        over_loss = self.both * (epsilon / (1 - epsilon) if epsilon < _HALF else 1) + of_relative
        found = over_loss * (2 * epsilon + over_loss * (1 - epsilon)) / (1 + epsilon)
        return found + self.loss * (1 + found)


@dataclass(frozen=True)
class Errors:
    """Errors in the measures of a `Tolerance`: relative ones of eps and of 1 - eps^2, and the absolute one of eps."""

    epsilon: Fraction
    dissipation: Fraction
    absolute: Fraction

    def worse(self, other: Errors) -> Errors:
        """Return the larger error in each measure."""
        return Errors(*(max(a, b) for a, b in zip(vars(self).values(), vars(other).values(), strict=True)))

    def failing(self, tolerance: Tolerance) -> list[str]:
        """Return the names of the measures that exceed the tolerance."""
        return [name for name, limit in tolerance.given().items() if getattr(self, name) > _exact(limit)]


def worst(found: Sequence[Errors]) -> Errors:
    """Return the largest error in each measure."""
    return reduce(Errors.worse, found)


def allowed(tolerance: Tolerance, ranges: list[Interval], measure: str) -> Fraction:
    """Return the largest error in a measure ("both" or "relative") within the tolerance, to first order.

    The errors are nearly proportional to it: one of 2^-40 tells the factors.
    """
    unit = Fraction(1, 1 << 40)
    bound = Bound(unit, Fraction(0)) if measure == "both" else Bound(Fraction(0), unit)
    largest = worst([bound.errors(epsilon) for epsilon in ranges])
    factors = {name: Fraction(error) / unit for name, error in vars(largest).items()}
    return min(_exact(limit) / factors[name] for name, limit in tolerance.given().items())


def _exact(number: float) -> Fraction:
    """Return the decimal that was written."""
    return Fraction(repr(number))
