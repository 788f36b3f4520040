r"""Speed tables: eps without a root, by the leading bits of w = beta^5 v = v*^10, with proofs of their errors.

A floating-point number w = 2^e m, 1 <= m < 2, says by its exponent e and the leading bits of m which row of a table it
belongs to; no root and no logarithm is needed. A row holds a polynomial for

    p = eps - base,    base = 1 for w < 2^SWITCH (p = -(1 - eps)), 0 else (p = eps),

the smaller of eps and 1 - eps, so that its relative error is what counts (section 2.7), and

    1 - eps^2 = (1 - base) - p (2 base + p)

loses no digits either. The polynomials interpolate the rows of `panel_proof`, as functions of m, at Chebyshev points.
They are summed in pairs: `Polynomials` in m, p = (c_0 + m c_1) + m^2 ((c_2 + m c_3) + m^2 (…)); `HalfWords` likewise
in t = m - centre, which is exact, and so small that the last two coefficients fit into one word; and `LastPlace`, to
the last place of type double, in t,

    p = high + rest,    rest = low + t ((a_1 + t a_2) + t^2 ((a_3 + t a_4) + t^2 (…))),

|rest| being some per cent of |p|, so that its rounding errors are as small; eps = base + high + rest is summed with the
error of the first sum (which `Fast2Sum` gives exactly), p alone makes 1 - eps^2. Where w is not in the table, or beta^5
is no normal number, a kernel of v* = sqrt(beta) pow(speed, 0.1) serves, in type double.

Bounds are proven row by row, exactly or in ball arithmetic: of the error of the polynomials with their machine
coefficients, of the rounding error in the exported code's sequence of operations, of the effect of an error of w, and
of the largest increase of eps with v (docs/reference/speed.md).

Every table has OCTAVES = 128 octaves of w: a power of 2, so that a shift checks the range. The panels of `panel_proof`
are intervals of v*, 8 to an octave, on which eps and 1 - eps are polynomials with a proven relative error of 2^-60.

Words: `index` is the number of a row; a piece is a part of a row on which p has one Taylor polynomial, in s from -1 to
1; `form` is the number format, float or double. p is negative where base is 1.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from bisect import bisect_left
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cache, cached_property, lru_cache
from itertools import pairwise, product
from typing import ClassVar, NamedTuple

import numpy as np
from flint import arb, arb_poly, arb_series, fmpq, fmpq_poly

from viscopade.arithmetic.balls import ball_of, exact_middle, working
from viscopade.arithmetic.chebyshev import greatest, interpolated, nodes, to_fmpq, to_fraction
from viscopade.arithmetic.decimals import at_most, identifier
from viscopade.arithmetic.formats import DOUBLE, FLOAT, Format
from viscopade.arrays.panels import CENTRES, HALF_WIDTHS, PANELS
from viscopade.collision import panel_proof
from viscopade.kernels import formulas, rounding_bounds, truth
from viscopade.kernels.arithmetic import HOST, HOST_FLOAT, Arithmetic
from viscopade.kernels.bound import INFINITY, ErrorBound, weakest
from viscopade.kernels.compact import half_line
from viscopade.kernels.enclosure import exact_polynomial, polynomial
from viscopade.kernels.expressions import (
    Call,
    CodeBranch,
    Column,
    Exact,
    Expression,
    Literal,
    Name,
    Program,
    Select,
    Statement,
    TableRow,
    Word,
    both,
    in_pairs,
)
from viscopade.kernels.formulas import OCTAVES, ZERO, bits, count, from_bits, lost_energy, octaves, power_of_two
from viscopade.kernels.full import full, sum_with_error
from viscopade.kernels.kernel import Function, Kernel, Table
from viscopade.kernels.machine import branch_value
from viscopade.kernels.rounding import Rounded, half_unit, rounded_results
from viscopade.kernels.v_star import USUAL, eps_error_from_v_star
from viscopade.progress import track
from viscopade.store import recorded

FIRSTS = range(-124, -27)
"""Exponents at which a table may begin: w = 2^first and 2^(first + OCTAVES) are normal numbers of type float.

The smallest of these is 2^-126, the last power of two 2^127; here 2^-124 and 2^(-28 + 128) = 2^100. How far inside they
end was chosen by hand: `TABLES` begin at -96 and -64, and need no more.
"""
SWITCH = -3
"""Below w = 2^SWITCH, p is -(1 - eps). There, at v* = 2^-0.3 = 0.81, eps is about 1/2."""
MOST_SPLIT = 8
"""Most bits of m that tell a row; `TABLES` have up to 6. Chosen by hand, and not a limit of the proof."""
MOST_DEGREE = 15
"""Of a row: `TABLES` have up to 10. Chosen by hand, and not a limit of the proof."""
LAST_ULPS = 3
"""Units in the last place of what the last operations add to the relative errors of rebound and dissipation.

1 - eps^2 = (1 - base) - p (2 base + p) has three operations (2 base is exact), eps speed two. Each adds at most 2^-53
of the value, which is less than one ulp (tests/kernels/test_rounding.py bounds them by the rounding analysis).
"""
MEANINGS = {
    "restitution": "eps",
    "rebound": "eps speed, the speed after the collision",
    "dissipation": "1 - eps^2, which loses no digits where eps is near 1",
}

_BITS = 160  # of ball arithmetic: more than the 2^-60 that p is proven to, and the 53 of its rows
_HALF_WORD = 32  # bits
_U = Fraction(1, 2**53)  # unit roundoff of type double
# Parts of a piece of a row, where the error is no multiple of one Chebyshev polynomial: one part would give up to twice
# the bound, 64 give up to 6 % less (measured on 30 pieces of each table).
_PARTS = 16
# Terms of Taylor polynomials beyond the degree: the remainder is then below 1e-10 of p for the rows of a quarter of an
# octave, the longest in `TABLES`, whose error is 3e-6; two terms less give 6e-9, and a bound 0.2 % larger (measured).
_MORE_TERMS = 7


# --- rows -------------------------------------------------------------------------------------------------------------


class MantissaPiece(NamedTuple):
    """p on an interval of m as a polynomial in s, |s| <= 1, m = centre + half s, with a bound of its error."""

    centre: Fraction
    half: Fraction
    p: fmpq_poly
    error: Fraction
    """A bound of |polynomial - true p|."""

    @property
    def least(self) -> Fraction:
        """A lower bound of |p|: its value in the middle, less the largest difference from that, less the error."""
        middle = to_fraction(self.p[0])
        return abs(middle) - greatest(self.p - to_fmpq(middle)) - self.error

    @property
    def most(self) -> Fraction:
        """An upper bound of |p|."""
        return greatest(self.p) + self.error


Bounds = Mapping[str, Fraction]
"""Proven bounds of a row or of a table, by what they bound.

Of `Polynomials`: "error" of the formula and "double", "float" of rounding in that format, relative to the smaller of
eps and 1 - eps. Of `LastPlace`: "ulp" of eps, and the "relative" error of p.
"""


@dataclass(frozen=True)
class Layout(ABC):
    """Layout of a speed table: the row of every number w.

    Attributes
    ----------
    split : int
        There are 2^split rows to an octave, which have equal lengths in m.
    first : int
        The table begins at w = 2^first, and ends at 2^(first + OCTAVES).
    degree : int
        Of the rows' polynomials.
    form : Format
        Type of the coefficients.

    Raises
    ------
    ValueError
        If there is no such table.
    """

    split: int
    first: int
    degree: int
    form: Format

    def __post_init__(self) -> None:
        if self.split not in range(MOST_SPLIT + 1):
            raise ValueError(f"split is {self.split}: expected 0 to {MOST_SPLIT}")
        if self.first not in FIRSTS:
            raise ValueError(f"first is {self.first}: expected {FIRSTS.start} to {FIRSTS.stop - 1}")

    @property
    def size(self) -> int:
        """Number of rows: 2^split in each octave."""
        return OCTAVES << self.split

    @property
    def switch(self) -> int:
        """The first row with base = 0: that of w = 2^SWITCH."""
        return (SWITCH - self.first) << self.split

    def base(self, index: int) -> int:
        """Return 1 for a row where p = -(1 - eps), 0 where p = eps."""
        return int(index < self.switch)

    def interval(self, index: int) -> tuple[int, Fraction, Fraction]:
        """Return e and the ends in m of a row's w = 2^e m, 1 <= m <= 2."""
        octave, place = divmod(index, 1 << self.split)
        # Rows of an octave are [1 + place/2^split, 1 + (place + 1)/2^split].
        low = 1 + Fraction(place, 1 << self.split)
        return self.first + octave, low, low + Fraction(1, 1 << self.split)

    def centre(self, index: int) -> Fraction:
        """Return the middle of a row, in m."""
        _, low, high = self.interval(index)
        return (low + high) / 2

    @cached_property
    def rows(self) -> tuple[tuple[float, ...], ...]:
        """The numbers of every row, in the order of `columns`."""
        return table_rows(self)

    @property
    @abstractmethod
    def names(self) -> tuple[str, ...]:
        """The names of a row's coefficients."""

    @property
    def columns(self) -> tuple[str, ...]:
        """The names of the numbers that the table has of a row."""
        return self.names

    @property
    def formula(self) -> str:
        """What a row is, as text."""
        return f"a polynomial of degree {self.degree} in m"

    @property
    def unpacking(self) -> Program:
        """The assignments of coefficients that are parts of other numbers."""
        return ()

    def coefficients(self, index: int) -> dict[str, float]:
        """Return the coefficients of a row by name, as code reads them."""
        return dict(zip(self.names, self.rows[index], strict=True))

    @abstractmethod
    def row(self, index: int) -> tuple[float, ...]:
        """Return the numbers of one row."""

    @abstractmethod
    def sums(self) -> CodeBranch:
        """Return p and the results from a row's numbers, m or t, base, and `rest_of_base` = 1 - base."""

    @abstractmethod
    def bounds_on(self, index: int, piece: MantissaPiece, parts: int) -> Bounds:
        """Prove the bounds of a piece of a row; ArithmeticError if p may vanish, or eps rise."""

    def bounds(self, index: int) -> Bounds:
        """Prove the bounds of a row: the worst of its pieces."""
        pieces = self.pieces(index)
        # On a whole row the error is nearly a multiple of one Chebyshev polynomial, and one part is enough.
        return worst([self.bounds_on(index, piece, 1 if len(pieces) == 1 else _PARTS) for piece in pieces])

    def interpolation(self, index: int, origin: Fraction) -> fmpq_poly:
        """Return the row's p in m - origin: the interpolation polynomial at Chebyshev points, nearly the best one."""
        exponent, low, high = self.interval(index)
        # m = centre + half s at the zeros s of T_(degree + 1)
        points = [self.centre(index) + (high - low) / 2 * s for s in nodes(self.degree + 1)]
        values = [_exact_p(m * Fraction(2) ** exponent, self.base(index)) for m in points]
        return interpolated([m - origin for m in points], values)

    def pieces(self, index: int) -> list[MantissaPiece]:
        """Return p on a row as Taylor polynomials with bounds of their errors.

        A row is cut where the panels of `panel_proof` end; most rows are one piece.
        """
        exponent, low, high = self.interval(index)
        first, last = _panel_at(exponent, low), _panel_at(exponent, high)
        # Panels' ends are w; w/2^exponent is m.
        ends = [low, *(edge / Fraction(2) ** exponent for edge in _edges()[first:last]), high]
        return [
            taylor_piece(exponent, start, end, self.base(index), self.degree, panel)
            for panel, (start, end) in enumerate(pairwise(ends), first)
            if start < end
        ]


class Polynomials(Layout):
    """A speed table whose rows are polynomials in m of odd degree, so that they are summed in pairs."""

    variable: ClassVar[str] = "m"
    degrees: ClassVar[range] = range(1, MOST_DEGREE + 1, 2)

    def __post_init__(self) -> None:
        """Refuse degrees that are not in `degrees`; ValueError."""
        super().__post_init__()
        if self.degree not in self.degrees:
            parity = "odd" if self.degrees.start % 2 else "even"
            raise ValueError(
                f"degree is {self.degree}: expected {parity} numbers from {self.degrees.start} to {self.degrees[-1]}"
            )

    @property
    def names(self) -> tuple[str, ...]:
        """The names of a row's numbers."""
        return tuple(f"c{n}" for n in range(self.degree + 1))

    def origin(self, index: int) -> Fraction:
        """Return the point in m from where a row's variable counts."""
        return Fraction(0)

    def row(self, index: int) -> tuple[float, ...]:
        """Return the coefficients of one row, rounded to the type."""
        p = self.interpolation(index, self.origin(index))
        return tuple(self.form.nearest(to_fraction(p[n])) for n in range(self.degree + 1))

    @cache  # noqa: B019  layouts are few
    def sums(self) -> CodeBranch:
        """Return p and the results from a row's coefficients and its variable."""
        variable, square = self.variable, 2 * self.variable  # m and "mm", m^2; or t and "tt"
        program = (
            # p = (c_0 + m c_1) + m^2 ((c_2 + m c_3) + …)
            Statement(square, Name(variable) * Name(variable)),
            Statement("p", in_pairs(variable, square, self.names)),
        )
        return _from_speed(program, Name("base") + Name("p"))

    def machine_p(self, index: int, m: fmpq_poly) -> fmpq_poly:
        """Return a row's p with its machine coefficients, every operation being exact, for m as a polynomial."""
        variable = m - to_fmpq(self.origin(index))
        return exact_polynomial(self.sums(), "p", {self.variable: variable}, self.coefficients(index))

    def bounds_on(self, index: int, piece: MantissaPiece, parts: int) -> Bounds:
        """Bound the errors on a piece of a row, relative to the smaller of eps and 1 - eps.

        Keys are "error", of p by its formula, and the name of each type in which p is summed, of rounding. The piece is
        cut into equal parts, as many as `parts`, for a closer bound.

        Raises
        ------
        ArithmeticError
            If p may vanish, or eps rise.
        """
        machine, least, most = self.machine_p(index, _m_of_s(piece)), piece.least, piece.most
        # |p| may be slightly above 1/2; the smaller one of eps and 1 - eps is |p| or 1 - |p|.
        smallest = min(least, 1 - most)
        if not smallest > 0:
            raise ArithmeticError(f"p may vanish in row {index}")
        # dp/ds < 0 on the piece: eps = base + p falls.
        slope = machine.derivative()
        if not to_fraction(slope[0]) + greatest(slope - slope[0]) < 0:
            raise ArithmeticError(f"eps may rise in row {index}")
        bounds = {"error": (greatest(machine - piece.p, parts) + piece.error) / smallest}
        for form in forms_of(self):
            bounds[form.name] = self.rounding_on(index, piece, form) / smallest
        return bounds

    def rounding_on(self, index: int, piece: MantissaPiece, form: Format) -> Fraction:
        """Bound the absolute rounding error of p on a piece of a row, summed in a format."""
        with working(_BITS):
            numbers = {name: Rounded(arb(c), form) for name, c in self.coefficients(index).items()}
            # The whole piece at once: m - origin as a ball, [centre - half, centre + half]. m and t are exact.
            middle = ball_of(piece.centre - self.origin(index))
            numbers[self.variable] = Rounded(middle + ball_of(piece.half) * arb(0, 1), form)
            return exact_middle(rounded_results(self.sums(), ["p"], numbers, form)["p"].absolute)

    def rise_after(self, index: int) -> Fraction:
        """Return the increase of eps from a row to the next, relative to the smaller of eps and 1 - eps, exactly."""
        # p at the end of the row and at the beginning of the next, which is the same w (m = 2 of an octave is m = 1 of
        # the next).
        end, beginning = (index, self.interval(index)[2]), (index + 1, self.interval(index + 1)[1])
        p, next_p = (to_fraction(self.machine_p(i, fmpq_poly([to_fmpq(m)]))[0]) for i, m in (end, beginning))
        # eps = base + p
        rise = next_p + self.base(index + 1) - self.base(index) - p
        return rise / min(abs(p), 1 - abs(p))


class HalfWords(Polynomials):
    """A speed table whose rows are polynomials in t = m - centre, the last two coefficients being halves of one word.

    t is small, so that these need few bits: sign, exponent (1 + 11 bits) and the first 20 digits, half of 64 bits. Of
    the word of c_3

        first half: those of c_3 | second half: those of c_4

    code shifts the second half to the left to get c_4. For c_3 it is the last digits, with which the first half is
    rounded.
    """

    variable: ClassVar[str] = "t"
    # An even degree has an odd number of coefficients: with two of them in one word, an even number in the table.
    degrees: ClassVar[range] = range(2, MOST_DEGREE, 2)

    @property
    def columns(self) -> tuple[str, ...]:
        """The names of the numbers that the table has of a row."""
        return self.names[:-1]

    @property
    def formula(self) -> str:
        """What a row is, as text."""
        return (
            f"a polynomial of degree {self.degree} in m - (the row's middle), whose last coefficient begins with "
            f"the last {_HALF_WORD} bits of the one before"
        )

    @property
    def unpacking(self) -> Program:
        """The assignment of the last coefficient."""
        *_, word, last = self.names
        return (Statement(last, from_bits(bits(Name(word)) << count(_HALF_WORD))),)

    def coefficients(self, index: int) -> dict[str, float]:
        """Return the coefficients of a row by name, as code reads them."""
        numbers, last = dict(zip(self.columns, self.rows[index], strict=True)), self.names[-1]
        return numbers | {last: float(branch_value(CodeBranch(None, self.unpacking, {}), last, numbers, DOUBLE))}

    def origin(self, index: int) -> Fraction:
        """Return the middle of a row, in m, from where t counts."""
        return self.centre(index)

    def row(self, index: int) -> tuple[float, ...]:
        """Return the numbers of one row, of which the last is two coefficients."""
        *others, word, last = super().row(index)
        word_bits, last_bits = (int(np.float64(c).view(np.uint64)) for c in (word, last))
        # Halves are rounded to nearest, by adding half a unit; a carry goes into the exponent, as it should.
        half_unit_bits = 1 << (_HALF_WORD - 1)
        second = (last_bits + half_unit_bits) >> _HALF_WORD
        # The multiple of 2^32, with `second` added, that is nearest to the bits of the last coefficient but one.
        first = (word_bits - second + half_unit_bits) >> _HALF_WORD
        return *others, float(np.uint64(first << _HALF_WORD | second).view(np.float64))


class LastPlace(Layout):
    """A speed table to the last place: rows are high, low, a_1, …, of an even degree."""

    @property
    def names(self) -> tuple[str, ...]:
        """The names of a row's numbers."""
        return ("high", "low", *(f"a{n}" for n in range(1, self.degree + 1)))

    def row(self, index: int) -> tuple[float, ...]:
        """Return the numbers of one row: the constant coefficient in two doubles, the others in one each."""
        p = self.interpolation(index, self.centre(index))
        constant, *others = (to_fraction(p[n]) for n in range(self.degree + 1))
        high = DOUBLE.nearest(constant)
        return high, DOUBLE.nearest(constant - Fraction(high)), *map(DOUBLE.nearest, others)

    @cache  # noqa: B019  layouts are few
    def sums(self) -> CodeBranch:
        """Return p = high + rest and the results from a row's numbers and t."""
        t, base, high, rest = map(Name, ("t", "base", "high", "rest"))
        program = (
            # rest = low + t (a_1 + t a_2 + …), after the two names `high` and `low`
            Statement("tt", t * t),
            Statement("rest", Name("low") + t * in_pairs("t", "tt", self.names[2:])),
            # base + high = head + lost, exactly
            *sum_with_error(base, high),
            Statement("p", high + rest),
        )
        # eps = head + (lost + rest)
        return _from_speed(program, Name("head") + (Name("lost") + rest))

    def bounds_on(self, index: int, piece: MantissaPiece, parts: int) -> Bounds:
        """Bound the error of eps in "ulp" of the true value, and the "relative" one of p, on a piece of row `index`.

        w is exact. The piece is cut into equal parts, as many as `parts`, for a closer bound.

        Raises
        ------
        ArithmeticError
            If p may vanish.
        """
        # t = m - (the row's centre) as a polynomial in the piece's s, m = centre + half s.
        t = fmpq_poly([to_fmpq(piece.centre - self.centre(index)), to_fmpq(piece.half)])
        machine = exact_polynomial(self.sums(), "p", {"t": t}, dict(zip(self.names, self.rows[index], strict=True)))
        formula_error = greatest(machine - piece.p, parts) + piece.error
        least, most, base = piece.least, piece.most, self.base(index)
        if not 0 < least <= most < 1:
            raise ArithmeticError(f"p may vanish in row {index}")
        rest_rounding, added_rounding = self.rounding_on(index, t)
        return {
            # Half an ulp for the last sum; an ulp is smallest at the least eps, 1 - most or `least`.
            "ulp": Fraction(1, 2) + (formula_error + added_rounding) / DOUBLE.ulp(1 - most if base else least),
            # p = high + rest rounds once more.
            "relative": ((formula_error + rest_rounding) / least + _U) * (1 + _U),
        }

    def rounding_on(self, index: int, t: fmpq_poly) -> tuple[Fraction, Fraction]:
        """Bound the rounding errors of `rest`, and of lost + rest, which is added to the leading sum.

        t is a polynomial in s, |s| <= 1.
        """
        with working(_BITS):
            numbers = {name: Rounded(arb(c), DOUBLE) for name, c in zip(self.names, self.rows[index], strict=True)}
            numbers["t"] = Rounded(arb_poly(t)(arb(0, 1)), DOUBLE)
            # Both leading operands are normal numbers of which the first is the larger: Fast2Sum is exact. What it
            # finds lost is at most half a unit of the sum; with base 0 nothing is lost.
            lost = half_unit(1 + numbers["high"].value, DOUBLE) if self.base(index) else arb(0)
            numbers["lost"] = Rounded(arb(0, lost), DOUBLE)
            results = rounded_results(self.sums(), ["rest", "lost"], numbers, DOUBLE)
            rest = results["rest"]
            return exact_middle(rest.absolute), exact_middle((results["lost"] + rest).absolute)


def forms_of(layout: Layout) -> tuple[Format, ...]:
    """Return the types in which a table's sums are computed: rows of doubles are not summed in float."""
    return (DOUBLE, FLOAT) if layout.form == FLOAT else (DOUBLE,)


def worst(bounds_of_parts: Sequence[Bounds]) -> Bounds:
    """Return the largest of each bound, from the bounds of the parts of a row or of a table."""
    return {name: max(bounds[name] for bounds in bounds_of_parts) for name in bounds_of_parts[0]}


def _m_of_s(piece: MantissaPiece) -> fmpq_poly:
    """Return m = centre + half s as a polynomial in s."""
    return fmpq_poly([to_fmpq(piece.centre), to_fmpq(piece.half)])


# --- what is tabulated ------------------------------------------------------------------------------------------------


@lru_cache(maxsize=1)
def _edges() -> tuple[Fraction, ...]:
    """Return where the panels of `panel_proof` end, in w = v*^10."""
    return tuple((Fraction(float(CENTRES[i])) + Fraction(float(HALF_WIDTHS[i]))) ** 10 for i in range(PANELS))


def _panel_at(exponent: int, m: Fraction) -> int:
    """Return the panel of `panel_proof` that has w = 2^exponent m; at an edge, the one that ends there."""
    return min(bisect_left(_edges(), m * Fraction(2) ** exponent), PANELS - 1)


def _exact_p(w: Fraction, base: int) -> Fraction:
    """Return p = eps - base at a point, to far more digits than a double has."""
    with working(_BITS):
        portions = truth.portions_of_w(w)  # balls of eps and of 1 - eps
        return exact_middle(-portions.loss if base else portions.epsilon)


def taylor_piece(exponent: int, low: Fraction, high: Fraction, base: int, degree: int, panel: int) -> MantissaPiece:
    """Return p on low <= m <= high, w = 2^exponent m, from one panel of `panel_proof`.

    p = eps - base is a Taylor polynomial in s, m = centre + half s, of `_MORE_TERMS` more terms than `degree`. Its
    remainder, the panel's proven error and the widths of balls are in the piece's error.

    Raises
    ------
    ArithmeticError
        If FLINT returns fewer terms.
    """
    centre, half = (low + high) / 2, (high - low) / 2
    order = degree + _MORE_TERMS
    with working(_BITS, order + 1):
        scale = arb(2) ** exponent
        # p is -(1 - eps) or eps: the row's polynomial in z = (v* - panel centre)/(panel half).
        name, sign = ("one_minus_epsilon", -1) if base else ("epsilon", 1)
        row = panel_proof.panel_rows()[name, panel].poly().coeffs()
        panel_centre, panel_half = arb(float(CENTRES[panel])), arb(float(HALF_WIDTHS[panel]))

        def taylor_coefficients(s: arb) -> list[arb]:
            """Return p's Taylor coefficients around s, by power series."""
            # w(s + x) = 2^exponent (centre + half s + half x), v* = w^(1/10)
            w = arb_series([(ball_of(centre) + ball_of(half) * s) * scale, ball_of(half) * scale])
            v_star = (w.log() / 10).exp()
            return (polynomial(row, (v_star - panel_centre) / panel_half) * sign).coeffs()

        # Lagrange's remainder: the coefficient of s^order is that at some point between, so that of the ball [-1, 1].
        coefficients = [*taylor_coefficients(arb(0))[:order], *taylor_coefficients(arb(0, 1))[order:]]
        if len(coefficients) != order + 1:
            raise ArithmeticError("a Taylor polynomial lost terms")
        # p is made of the balls' middles; their radii add up to its error, as |s| <= 1.
        radii = sum((c.rad() for c in coefficients), arb(0)).abs_upper()
        p = fmpq_poly([_middle(c) for c in coefficients])
        enclosure_error, relative = to_fraction(_middle(radii)), Fraction(panel_proof.proven_error())
        # |row - true| <= relative |true| <= relative/(1 - relative) |row|
        error = enclosure_error + relative / (1 - relative) * (greatest(p) + enclosure_error)
    return MantissaPiece(centre, half, p, error)


def _middle(ball: arb) -> fmpq:
    """Return a ball's middle, exactly."""
    return fmpq(ball.mid().fmpq())


# --- records ----------------------------------------------------------------------------------------------------------

FIRST = -96
"""Three tables have w from 2^-96 to 2^32, v* from 0.0013 to 9.2: speeds from 3e-30 cm/s with beta = 1.3 (s/cm)^(1/5).

Where they end, 1 - eps is 2e-6 and eps 8e-4.
"""
TABLES: Mapping[str, Layout] = {
    "1e-5": Polynomials(6, FIRST, 1, FLOAT),
    "5e-6": Polynomials(2, FIRST, 3, FLOAT),
    "1e-10": HalfWords(5, FIRST, 4, DOUBLE),
    "full": LastPlace(3, -64, 10, DOUBLE),
}
"""The tables by accuracy: split, first, degree and type. The table of full accuracy ends at w = 2^64, v* = 84.

For the three others |error|/min(eps, 1 - eps) is below the accuracy; 1e-5 has the fewest coefficients, 5e-6 the least
memory (docs/reference/speed.md).
"""


@recorded("speed table rows")
def table_rows(layout: Layout) -> tuple[tuple[float, ...], ...]:
    """Return all rows of a table, each in the order of its `columns`."""
    return tuple(layout.row(i) for i in track(range(layout.size), f"table of degree {layout.degree}"))


@recorded("speed table bounds")
def table_bounds(layout: Layout) -> Mapping[str, Fraction]:
    """Prove the bounds of the whole table of a layout, the worst of its rows: `Bounds`.

    For `Polynomials` there is also "rise", the largest increase of eps from one row to the next, or 0, relative to the
    smaller of eps and 1 - eps.
    """
    # The results first: the rows' proofs are about p alone.
    check_results(layout)
    bounds = dict(worst([layout.bounds(i) for i in track(range(layout.size), "proof")]))
    if isinstance(layout, Polynomials):
        bounds["rise"] = max(Fraction(0), *map(layout.rise_after, range(layout.size - 1)))
    return bounds


def check_results(layout: Layout) -> None:
    """Check that without rounding the results of a layout's table are eps = base + p, eps speed, and 1 - eps^2.

    Raises
    ------
    ArithmeticError
        If they are not.
    """
    branch, x = layout.sums(), fmpq_poly([0, 1])
    # All as polynomials in x. Any will do that differ: x for m or t, 1.375, 2.375, … for the coefficients, x^5 + 2 for
    # the speed, and x^7 - 3 for the leading sum, as its loss makes up for what it lacks.
    speed, head = x**5 + 2, x**7 - 3
    for base in (0, 1):
        numbers = {name: 1.375 + n for n, name in enumerate(layout.names)} | {"base": base, "rest_of_base": 1 - base}
        inputs = {"m": x, "t": x, "speed": speed, "head": head}
        results = {name: exact_polynomial(branch, name, inputs, numbers) for name in ("p", *branch.results)}
        eps = results["p"] + base
        if results != {"p": eps - base, "restitution": eps, "rebound": eps * speed, "dissipation": 1 - eps * eps}:
            raise ArithmeticError("the results of a speed table are not eps = base + p, eps speed, and 1 - eps^2")


@recorded("rounding of w")
def eps_error_from_w_rounding(form: Format) -> Fraction:
    """Return a bound of the relative errors of eps and of 1 - eps by the rounding of w = beta^5 v in a format.

    A w that is rounded across a border is in the domain of another row, or panel of `panel_proof`; that adds the errors
    of its rows twice.
    """
    # A relative change x of w changes ln w by at most x (1 + x), and ln eps and ln(1 - eps) by at most steepest/10
    # times that: `steepest` bounds |d ln eps/d ln v*| and |d ln(1 - eps)/d ln v*|, and ln v* = ln(w)/10.
    change = rounding_bounds.rounding_of_w(form)
    # The slope is that of the proven polynomials, which are off by their error: on the way from w to the computed w, at
    # both, and where a border lies between twice more, as one polynomial ends and another begins there. That is 4.
    return change * (1 + change) * panel_proof.steepest() / 10 + 4 * Fraction(panel_proof.proven_error())


# --- the sequence of operations ---------------------------------------------------------------------------------------


def _from_speed(program: Program, eps: Expression) -> CodeBranch:
    """Return the branch with the results of a speed table: a program that computes p, and an expression for eps."""
    p, base = Name("p"), Name("base")
    # 1 - eps^2 = (1 - base) - p (2 base + p) loses no digits: for base 1 it is -p (2 + p), for base 0 it is 1 - p^2.
    dissipation = Name("rest_of_base") - p * (Exact(Literal("2.0") * base, "base is 0 or 1") + p)
    results = {"restitution": Name("eps"), "rebound": Name("eps") * Name("speed"), "dissipation": dissipation}
    return CodeBranch(None, (*program, Statement("eps", eps)), results)


def place_program(layout: Layout) -> Program:
    """Return the assignments of w, and of `place`: the distance of its bits from those of 2^first of a layout.

    beta^5 comes first, so that a compiler can move it out of loops.
    """
    beta = Name("beta")
    return (
        # scale = beta^5, w = beta^5 speed
        Statement("b2", beta * beta),
        Statement("scale", formulas.fifth_power("b2")),
        Statement("w", Name("scale") * Name("speed")),
        Statement("place", bits(Name("w")) - power_of_two(layout.first)),
    )


def row_number(layout: Layout) -> Expression:
    """Return the number of the row of a place: its bits without those of m behind the first `split` ones."""
    return Name("place") >> count(lambda form: form.precision - 1 - layout.split)


def base_of(layout: Layout) -> Expression:
    """Return the number 1 below w = 2^SWITCH, else 0, without a comparison, which could become a branch."""
    # The distance of the place from that of 2^SWITCH is negative below: its first bit of 8 to a byte is then 1.
    sign = count(lambda form: 8 * form.bytes - 1)
    # 0 - 1 has all bits set, and leaves the bits of 1.0 = 2^0.
    below = count(0) - ((Name("place") - octaves(SWITCH - layout.first)) >> sign)
    return from_bits(below & power_of_two(0))


def row_branch(layout: Layout) -> CodeBranch:
    """Return the program from place, base and the numbers of a row of the layout to the results."""
    place, one, sums = Name("place"), power_of_two(0), layout.sums()

    def fraction(split: int) -> Expression:
        """Return 1 + m mod 2^-split: m without the bits that tell the row, or for 0 m."""
        # The last precision - 1 - split bits of the fraction, with the bits of 1.0 before them.
        return from_bits((place & Word(lambda form: (1 << (form.precision - 1 - split)) - 1)) | one)

    # t = m - centre = (1 + m mod 2^-split) - (1 + 2^-(split + 1)): m is moved to an octave's first row, whose length
    # is 2^-split.
    centre_of_first_row = 1 + Fraction(1, 2 << layout.split)
    program = (
        Statement("m", fraction(0)),
        Statement(
            "t", Exact(fraction(layout.split) - Literal(repr(float(centre_of_first_row))), "its bits are those of m")
        ),
        # 1 - base: the bits of 1.0 are flipped.
        Statement("rest_of_base", from_bits(bits(Name("base")) ^ one)),
        *layout.unpacking,
        *sums.program,
    )
    return sums._replace(program=program)


def v_star_kernel_branch(kernel: str) -> CodeBranch:
    """Return the results by the kernel of v* of this name, in type double: where the table does not help."""
    branch, eps, speed = formulas.v_star_branch(), Name("eps"), Name("speed")
    call_eps, call_loss = (
        Call(f"viscopade_{name}_{kernel}", (Name("v_star"),)) for name in ("epsilon", "one_minus_epsilon")
    )
    # Without the choice, the speed after the collision would be 0 times infinity at an infinite speed.
    # eps <= 0 is eps = 0: compilers may warn of an equality (GCC's -Wfloat-equal).
    rebound = Select(both(eps <= ZERO, speed > Name("largest")), speed, eps * speed)
    results = {"restitution": eps, "rebound": rebound, "dissipation": lost_energy(eps, call_loss)["of_both"]}
    program = Statement("v_star", branch.results["v_star"]), Statement("eps", call_eps)
    return CodeBranch(branch.guard, program, results)


def _functions(layout: Layout, elsewhere: Kernel) -> Iterator[Function]:
    """Yield the functions of `MEANINGS`: by a layout's table, and by the kernel of v* that serves elsewhere."""
    # The row's numbers by name, from the columns of the table.
    program = (
        Statement("row", TableRow("table", row_number(layout))),
        *(Statement(name, Column("row", n)) for n, name in enumerate(layout.columns)),
        Statement("base", base_of(layout)),
    )
    branch = row_branch(layout)
    # In the table, 2^first <= w < 2^(first + OCTAVES): words have no sign, so that a w below has a large place. beta^5
    # must be normal, or its rounding would not be relative.
    inside = both(Name("place") < octaves(OCTAVES), Name("scale") >= Name("smallest"))
    branch = CodeBranch(inside, (*program, *branch.program), branch.results)
    beyond = v_star_kernel_branch(elsewhere.name)
    for name, meaning in MEANINGS.items():
        yield Function(name, ("speed", "beta"), meaning, None, place_program(layout), (branch, beyond), name)


# --- kernels ----------------------------------------------------------------------------------------------------------


@cache
def speed_table(accuracy: str) -> Kernel:
    """Return the kernel from speed to eps of an accuracy.

    Parameters
    ----------
    accuracy : str
        "1e-5", "5e-6", "1e-10" or "full".

    Raises
    ------
    ValueError
        If there is no such kernel.
    """
    if accuracy not in TABLES:
        raise ValueError(f"the kernel of speed asked for is {accuracy}: expected {', '.join(TABLES)}")
    layout = TABLES[accuracy]
    # The kernel of v* outside the table. The half-line kernel for 1e-5 has an error of 3.4e-6, so it serves 5e-6, too.
    elsewhere = _in_double(half_line("1e-5") if layout.form == FLOAT else full())
    # v* = w^(1/10) at both ends, for the text.
    low, high = (2.0 ** (e / 10) for e in (layout.first, layout.first + OCTAVES))
    return Kernel(
        identifier(accuracy),
        f"speed table {accuracy}",
        "speed",
        f"w = beta^5 speed = v*^10 = 2^e m, 1 <= m < 2; {layout.formula}, "
        f"{1 << layout.split} rows of coefficients for each e from {layout.first} to {layout.first + OCTAVES - 1} "
        f"({low:.3g} <= v* < "
        f"{high:.3g}); for other w, and where beta^5 is not a normal number, {elsewhere.label} of "
        f"v* = sqrt(beta) pow(speed, 0.1), in double{_monotonic(layout)}",
        "interpolation of the proven polynomials of viscopade.epsilon",
        "speed >= 0, beta >= 0",
        tuple(_functions(layout, elsewhere)),
        {
            # The smallest normal number and the largest finite one.
            form.name: {"smallest": float(form.least), "largest": (2 - form.epsilon) * 2.0**form.largest}
            for form in (DOUBLE, FLOAT)
        },
        tuple(_bounds(layout, elsewhere)),
        (Table("table", layout.form.name, (layout.size, len(layout.columns)), lambda: layout.rows),),
        fallback=elsewhere,
    )


def _monotonic(layout: Layout) -> str:
    """Return what is proven of the slope of eps in a layout's table, as text; "" for `LastPlace`, where nothing is."""
    proven = table_bounds(layout)
    if "rise" not in proven:
        return ""
    # "rise" is relative to the computed min(eps, 1 - eps), which is at most 1 + error times the exact one.
    rise = at_most(proven["rise"] * (1 + proven["error"]))
    return (
        "; in the table, rounding apart, eps falls with speed within each row, and from one row to the next it rises "
        f"by at most {rise} min(eps, 1 - eps)"
    )


def _in_double(kernel: Kernel) -> Kernel:
    """Return a kernel in type double alone."""
    bounds = tuple(bound for bound in kernel.bounds if bound.arithmetic.form == DOUBLE)
    missing = {FLOAT.name: "beyond tables of speed, eps is computed in type double"}
    return replace(kernel, bounds=bounds, constants={DOUBLE.name: kernel.constants[DOUBLE.name]}, missing=missing)


# --- bounds -----------------------------------------------------------------------------------------------------------

_FOR_ALL = Fraction(0), INFINITY  # v*
_HALF = Fraction(1, 2)  # of an ulp, or of the smallest number: what one rounding adds


def _bounds(layout: Layout, elsewhere: Kernel) -> Iterator[ErrorBound]:
    """Yield the bounds in the table, on both sides of it, and everywhere; elsewhere for usual speeds and for all.

    In the table and elsewhere there is also one for all arguments that lead there.
    """
    # Ranges of the exact w and beta^5; they decide, with one octave to spare, whether the computed ones are in the
    # table, and normal.
    first, end = layout.first, layout.first + OCTAVES
    low, high = _tenth_root(first), _tenth_root(end)
    # w is off by 5 u, 3e-7 in float, so v* by 3e-8: a margin of 1e-6 inwards and outwards is ample.
    above, below = 1 + Fraction(1, 10**6), 1 - Fraction(1, 10**6)
    for arithmetic, name in product((HOST, HOST_FLOAT), MEANINGS):
        form = arithmetic.form if arithmetic.form in forms_of(layout) else DOUBLE
        # beta^5 = w/speed is below 2^(largest - 1) and at least 2^(2 - largest) for these speeds.
        speeds = Fraction(2) ** (end + 1 - form.largest), Fraction(2) ** (first + form.largest - 2)
        inside = _in_arithmetic(arithmetic, _inside(layout, name, form), form)
        # A subnormal speed has a subnormal rebound: its last rounding is absolute, half the smallest number.
        subnormal = name == "rebound" and not inside.ulps
        yield replace(inside, branch=0, absolute=_HALF) if subnormal else replace(inside, branch=0)
        yield replace(inside, low=low * above, high=high * below, speeds=speeds)
        for usual in (True, False):
            outside = _in_arithmetic(arithmetic, _outside(elsewhere, name, usual), DOUBLE)
            yield replace(outside, branch=1)
            before_table = replace(outside, high=low * below)
            if name == "rebound":
                # There eps > 1/2: its absolute error is at most 2 times that relative to it, and the last operations
                # add less than `LAST_ULPS`, so that none is absolute.
                relative = 2 * before_table.absolute * DOUBLE.smallest
                before_table = replace(
                    before_table, rounding=before_table.rounding + relative, absolute=Fraction(0)
                )  # fmt: skip
            yield before_table
            yield replace(outside, low=high * above)
            yield weakest([outside, inside])


def _tenth_root(exponent: int) -> Fraction:
    """Return 2^(exponent/10), v* at w = 2^exponent, rounded to 12 digits: far closer than the margin of 1e-6."""
    return Fraction(f"{2.0 ** (exponent / 10):.12g}")


def _inside(layout: Layout, name: str, form: Format) -> ErrorBound:
    """Return the bound in a layout's table of a result in `MEANINGS`, whose sums are computed in a format.

    It counts the rounding of w.
    """
    proven, rounding, eps = table_bounds(layout), eps_error_from_w_rounding(form), name == "restitution"
    if isinstance(layout, LastPlace):
        if eps:
            return ErrorBound(name, *_FOR_ALL, "smaller", Fraction(0), rounding, ulps=proven["ulp"])
        # The relative error of p, with at most three operations after it: 4 u is more than their roundings.
        return ErrorBound(name, *_FOR_ALL, "value", proven["relative"] + 4 * _U, rounding)
    # Rounding of the sums and of w, relative to the formula's value, which is at most 1 + error times the exact one.
    rounding = ((1 + proven[form.name]) * (1 + rounding) - 1) * (1 + proven["error"])
    # eps = base + p rounds once; rebound and dissipation have at most three more operations.
    ulps = _HALF if eps else Fraction(LAST_ULPS)
    return ErrorBound(name, *_FOR_ALL, "smaller" if eps else "value", proven["error"], rounding, ulps=ulps)


def _outside(elsewhere: Kernel, name: str, usual: bool) -> ErrorBound:
    """Return the bound of a result where the kernel of v* serves elsewhere, in type double.

    With `usual` it is for speeds from 1e-30 to 1e30, where v* = sqrt(beta) pow(speed, 0.1) is closer.
    """
    # The widest bounds of eps and of 1 - eps are the last ones.
    eps, loss = (elsewhere.bound(function, "host", "double")[-1] for function in ("epsilon", "one_minus_epsilon"))
    # What the rounding of v* adds, relative to eps and to 1 - eps.
    speeds, rounding = (1 / USUAL, USUAL) if usual else None, eps_error_from_v_star(largest=USUAL if usual else None)
    if name == "restitution":
        return replace(eps, result=name, relative_to="smaller", rounding=rounding, speeds=speeds)
    # 1 - eps^2 is computed from eps and 1 - eps, rebound from eps alone.
    sum_of_errors = _relative(eps) + (_relative(loss) if name == "dissipation" else 0)
    # Where 1 - eps is subnormal, 1 - eps^2 is exactly twice that; where eps is, rebound has its error times speed.
    # A normal 1 - eps^2 is twice a 1 - eps of at least half the least normal number, of which half_line's bound holds
    # without `absolute`, and full's is below an ulp, so that twice its error is below `LAST_ULPS`.
    absolute = 2 * max(loss.absolute, _HALF) if name == "dissipation" else max(eps.absolute, _HALF)
    return ErrorBound(
        name, *_FOR_ALL, "value", eps.formula, rounding + sum_of_errors, ulps=Fraction(LAST_ULPS), absolute=absolute,
        speeds=speeds,
    )  # fmt: skip


def _relative(bound: ErrorBound) -> Fraction:
    """Return what rounding adds relative to the value, where it is normal: an ulp is at most 2^-52 of it."""
    return bound.last + bound.ulps * Fraction(DOUBLE.epsilon)


def _in_arithmetic(arithmetic: Arithmetic, bound: ErrorBound, form: Format) -> ErrorBound:
    """Return a bound of results in the type `form` as one of these results in an arithmetic, rounded to its type.

    No speed and beta of type float have a subnormal result of type double.
    """
    if arithmetic.form == form:
        return replace(bound, arithmetic=arithmetic)
    # One rounding more, half an ulp of float; what was in ulp of double is relative.
    return replace(bound, last=_relative(bound), ulps=_HALF, absolute=Fraction(0), arithmetic=arithmetic)
