r"""Speed table of full accuracy: eps to the last place of type double, with a bound in ulp.

With t = m - centre, which is exact,

    p = high + rest,    rest = low + t ((a_1 + t a_2) + t^2 ((a_3 + t a_4) + t^2 (…))),

|rest| being some per cent of |p|, so that its rounding errors are as small. eps = base + high + rest is summed with the
error of the first sum (which `Fast2Sum` gives exactly), p alone makes 1 - eps^2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import ClassVar, NamedTuple

from flint import arb, arb_poly, fmpq_poly

from viscopade.arithmetic.balls import exact_middle, working
from viscopade.arithmetic.chebyshev import greatest, to_fmpq, to_fraction
from viscopade.arithmetic.formats import DOUBLE, Format
from viscopade.arrays.checked import FloatArray
from viscopade.kernels import formulas
from viscopade.kernels.enclosure import exactly
from viscopade.kernels.expressions import CodeBranch
from viscopade.kernels.forms import last_place
from viscopade.kernels.forms.speed_table import PARTS, REST, Layout, MantissaPiece, check_row_results, of_w
from viscopade.kernels.machine import computed
from viscopade.kernels.rounding import Rounded, half_unit, of_branch
from viscopade.progress import track
from viscopade.store import recorded

DEGREE = 10
SPLIT = 3
FIRST = -64
"""The table ends at w = 2^64, v* = 84."""

_BITS = 160
_U = Fraction(1, 2**53)


class FullBounds(NamedTuple):
    """Bounds on a row."""

    ulp: Fraction
    """Of the error of eps, in units in the last place of the true value, w being exact."""
    relative: Fraction
    """Of the relative error of the computed p, w being exact."""


@dataclass(frozen=True)
class LastPlaceTable(Layout):
    """A speed table with rows high, low, a_1, …, a_DEGREE. Attributes are those of `Layout`."""

    degree: ClassVar[int] = DEGREE
    form: ClassVar[Format] = DOUBLE
    split: int = SPLIT
    first: int = FIRST

    @property
    def bytes(self) -> int:
        """Size in memory."""
        return self.size * (DEGREE + 2) * DOUBLE.bytes

    @cached_property
    def rows(self) -> tuple[tuple[float, ...], ...]:
        """All rows."""
        return last_place_rows(self)

    def sums(self, names: Sequence[str], rest: str = REST) -> CodeBranch:
        """Return what is computed from a row's numbers."""
        return formulas.full_row_branch(names, rest)

    def row(self, index: int) -> tuple[float, ...]:
        """Return the numbers of one row."""
        p = self.best(index, DEGREE, self.centre(index))
        first, *others = (to_fraction(p[n]) for n in range(DEGREE + 1))
        head = DOUBLE.nearest(first)
        return head, DOUBLE.nearest(first - Fraction(head)), *map(DOUBLE.nearest, others)

    def bounds(self, index: int) -> FullBounds:
        """Prove the bounds of a row; ArithmeticError if p may vanish."""
        pieces = self.pieces(index, DEGREE)
        return _worst([self._bounds_on(index, piece, 1 if len(pieces) == 1 else PARTS) for piece in pieces])

    def _bounds_on(self, index: int, piece: MantissaPiece, parts: int) -> FullBounds:
        t = fmpq_poly([to_fmpq(piece.centre - self.centre(index)), to_fmpq(piece.half)])
        machine = exactly(self.sums(self.names), "p", {"t": t}, dict(zip(self.names, self.rows[index], strict=True)))
        given = greatest(machine - piece.p, parts) + piece.error
        least, most, base = piece.least, piece.most, self.base(index)
        if not 0 < least <= most < 1:
            raise ArithmeticError(f"p may vanish in row {index}")
        rest, added = self._rounding_on(index, t)
        least_epsilon = 1 - most if base else least
        return FullBounds(
            Fraction(1, 2) + (given + added) / DOUBLE.ulp(least_epsilon),
            ((given + rest) / least + _U) * (1 + _U),
        )

    def _rounding_on(self, index: int, t: fmpq_poly) -> tuple[Fraction, Fraction]:
        """Bound the rounding errors of `rest`, and of what is added to the leading sum."""
        with working(_BITS):
            given = {name: Rounded(arb(c), DOUBLE) for name, c in zip(self.names, self.rows[index], strict=True)}
            given["t"] = Rounded(arb_poly(t)(arb(0, 1)), DOUBLE)
            # Both leading operands are normal numbers of which the first is the larger: Fast2Sum is exact.
            lost = half_unit(1 + given["c0"].value, DOUBLE) if self.base(index) else arb(0)
            given["lost"] = Rounded(arb(0, lost), DOUBLE)
            found = of_branch(self.sums(self.names), ["rest", "lost"], given, DOUBLE)
            return exact_middle(found["rest"].absolute), exact_middle((found["lost"] + found["rest"]).absolute)

    @cached_property
    def proven(self) -> FullBounds:
        """Bounds for the whole table."""
        return last_place_bounds(self)

    @property
    def of_products(self) -> Fraction:
        """Bound of the relative errors of rebound and dissipation, w being exact."""
        return self.proven.relative + 4 * _U

    def inside(self, form: Format) -> Fraction:
        """Return a bound of the relative error of p, and of rebound and dissipation."""
        return self.of_products + of_w(form)


_EXPORTED = LastPlaceTable()


@recorded("last_place_rows")
def last_place_rows(table: LastPlaceTable) -> tuple[tuple[float, ...], ...]:
    """Return all rows of a table."""
    return tuple(table.row(i) for i in track(range(table.size), "table of full accuracy"))


@recorded("last_place_bounds")
def last_place_bounds(table: LastPlaceTable) -> FullBounds:
    """Prove the bounds of a whole table."""
    check_row_results(table)
    return _worst([table.bounds(i) for i in track(range(table.size), "proof")])


def _worst(found: Sequence[FullBounds]) -> FullBounds:
    return FullBounds(*map(max, zip(*found, strict=True)))


def restitution(speed: FloatArray, beta: FloatArray) -> FloatArray:
    """Return eps as the code computes it without FMA contraction, for arrays of one shape."""
    result: FloatArray
    result, within = _EXPORTED.evaluated_in(DOUBLE, "restitution", speed, beta)
    if not within.all():
        given = {"speed": speed[~within], "beta": beta[~within]}
        v_star = computed(formulas.v_star_branch(), "v_star", given, DOUBLE)
        result[~within] = last_place.evaluated("epsilon", v_star)
    return result


def ulp_of_w() -> Fraction:
    """Return a bound in ulp of the error of eps by the rounding of w = beta^5 v; a number is at most 2^53 ulp."""
    return of_w(DOUBLE) * 2**53
