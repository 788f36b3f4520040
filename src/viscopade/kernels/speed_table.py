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
    equal,
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
"""Where a table may begin: w and 2^(first + OCTAVES) are normal numbers of type float."""
SWITCH = -3
"""Below w = 2^SWITCH, p is -(1 - eps); there eps is about 1/2."""
MOST_SPLIT = 8
MOST_DEGREE = 15
LAST_ULPS = 3
"""Units in the last place of what the last operations add to the relative errors of rebound and dissipation."""
MEANINGS = {
    "restitution": "eps",
    "rebound": "eps speed, the speed after the collision",
    "dissipation": "1 - eps^2, which loses no digits where eps is near 1",
}

_BITS = 160
_HALF_WORD = 32
_U = Fraction(1, 2**53)
_PARTS = 16  # of a piece of a row, where the error is no multiple of one Chebyshev polynomial
_MORE = 7  # terms of Taylor polynomials beyond the degree


# --- rows -------------------------------------------------------------------------------------------------------------


class MantissaPiece(NamedTuple):
    """p on an interval of m as a polynomial in s, |s| <= 1, m = centre + half s, with a bound of its error."""

    centre: Fraction
    half: Fraction
    p: fmpq_poly
    error: Fraction

    @property
    def least(self) -> Fraction:
        """A lower bound of |p|."""
        first = to_fraction(self.p[0])
        return abs(first) - greatest(self.p - to_fmpq(first)) - self.error

    @property
    def most(self) -> Fraction:
        """An upper bound of |p|."""
        return greatest(self.p) + self.error


Bounds = Mapping[str, Fraction]
"""Proven bounds of a row or of a table, by what they bound."""


@dataclass(frozen=True)
class Layout(ABC):
    """Layout of a speed table: the row of every number w.

    Attributes
    ----------
    split : int
        There are 2^split rows to an octave.
    first : int
        The table begins at w = 2^first, and ends at 2^(first + OCTAVES).
    degree : int
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
        """Number of rows."""
        return OCTAVES << self.split

    @property
    def switch(self) -> int:
        """The first row with base = 0."""
        return (SWITCH - self.first) << self.split

    def base(self, index: int) -> int:
        """Return 1 or 0."""
        return int(index < self.switch)

    def interval(self, index: int) -> tuple[int, Fraction, Fraction]:
        """Return e and the ends in m of a row."""
        octave, place = divmod(index, 1 << self.split)
        low = 1 + Fraction(place, 1 << self.split)
        return self.first + octave, low, low + Fraction(1, 1 << self.split)

    def centre(self, index: int) -> Fraction:
        """Return the middle of a row, in m."""
        _, low, high = self.interval(index)
        return (low + high) / 2

    @cached_property
    def rows(self) -> tuple[tuple[float, ...], ...]:
        """The numbers c_0, c_1, … of every row."""
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
        """Prove the bounds of a row."""
        pieces = self.pieces(index)
        return worst([self.bounds_on(index, piece, 1 if len(pieces) == 1 else _PARTS) for piece in pieces])

    def best(self, index: int, origin: Fraction) -> fmpq_poly:
        """Return the row's p in m - origin: the interpolation polynomial at Chebyshev points, nearly the best one."""
        exponent, low, high = self.interval(index)
        points = [self.centre(index) + (high - low) / 2 * s for s in nodes(self.degree + 1)]
        values = [_smaller_at(m * Fraction(2) ** exponent, self.base(index)) for m in points]
        return interpolated([m - origin for m in points], values)

    def pieces(self, index: int) -> list[MantissaPiece]:
        """Return p as Taylor polynomials with bounds of their errors; cut where the panels of `panel_proof` end."""
        exponent, low, high = self.interval(index)
        first, last = _panel_at(exponent, low), _panel_at(exponent, high)
        ends = [low, *(edge / Fraction(2) ** exponent for edge in _edges()[first:last]), high]
        return [
            smaller(exponent, start, end, self.base(index), self.degree, panel)
            for panel, (start, end) in enumerate(pairwise(ends), first)
            if start < end
        ]


class Polynomials(Layout):
    """A speed table whose rows are polynomials in m of odd degree."""

    variable: ClassVar[str] = "m"
    degrees: ClassVar[range] = range(1, MOST_DEGREE + 1, 2)

    def __post_init__(self) -> None:
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
        """Return the coefficients of one row."""
        p = self.best(index, self.origin(index))
        return tuple(self.form.nearest(to_fraction(p[n])) for n in range(self.degree + 1))

    @cache  # noqa: B019  layouts are few
    def sums(self) -> CodeBranch:
        """Return p and the results from a row's coefficients and its variable."""
        variable, square = self.variable, 2 * self.variable
        program = (
            Statement(square, Name(variable) * Name(variable)),
            Statement("p", in_pairs(variable, square, self.names)),
        )
        return _from_speed(program, Name("base") + Name("p"))

    def machine(self, index: int, m: fmpq_poly) -> fmpq_poly:
        """Return a row's p, exactly."""
        variable = m - to_fmpq(self.origin(index))
        return exact_polynomial(self.sums(), "p", {self.variable: variable}, self.coefficients(index))

    def bounds_on(self, index: int, piece: MantissaPiece, parts: int) -> Bounds:
        """Bound the errors relative to the smaller of eps and 1 - eps: of p, and of what rounding does in each type."""
        machine, least, most = self.machine(index, _of_s(piece)), piece.least, piece.most
        smallest = min(least, 1 - most)
        if not smallest > 0:
            raise ArithmeticError(f"p may vanish in row {index}")
        rise = machine.derivative()
        if not to_fraction(rise[0]) + greatest(rise - rise[0]) < 0:
            raise ArithmeticError(f"eps may rise in row {index}")
        found = {"error": (greatest(machine - piece.p, parts) + piece.error) / smallest}
        for form in forms_of(self):
            found[form.name] = self.rounding_on(index, piece, form) / smallest
        return found

    def rounding_on(self, index: int, piece: MantissaPiece, form: Format) -> Fraction:
        """Bound the rounding error of p."""
        with working(_BITS):
            given = {name: Rounded(arb(c), form) for name, c in self.coefficients(index).items()}
            middle = ball_of(piece.centre - self.origin(index))
            given[self.variable] = Rounded(middle + ball_of(piece.half) * arb(0, 1), form)
            return exact_middle(rounded_results(self.sums(), ["p"], given, form)["p"].absolute)

    def rise_after(self, index: int) -> Fraction:
        """Return the increase of eps from a row to the next, relative to the smaller of eps and 1 - eps, exactly."""
        ends = (index, self.interval(index)[2]), (index + 1, self.interval(index + 1)[1])
        before, after = (to_fraction(self.machine(i, fmpq_poly([to_fmpq(m)]))[0]) for i, m in ends)
        after += self.base(index + 1) - self.base(index)
        return (after - before) / min(abs(before), 1 - abs(before))


class HalfWords(Polynomials):
    """A speed table whose rows are polynomials in t = m - centre, the last two coefficients being halves of one word.

    t is small, so that these need few bits: sign, exponent and the first 20 digits. Of the word of c_3

        first half: those of c_3 | second half: those of c_4

    code shifts the second half to the left to get c_4. For c_3 it is the last digits, with which the first half is
    rounded.
    """

    variable: ClassVar[str] = "t"
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
        """Return the middle of a row, in m."""
        return self.centre(index)

    def row(self, index: int) -> tuple[float, ...]:
        """Return the numbers of one row, of which the last is two coefficients."""
        *others, word, last = super().row(index)
        word_bits, last_bits = (int(np.float64(c).view(np.uint64)) for c in (word, last))
        # Halves are rounded to nearest; a carry goes into the exponent, as it should.
        second = (last_bits + (1 << (_HALF_WORD - 1))) >> _HALF_WORD
        first = (word_bits - second + (1 << (_HALF_WORD - 1))) >> _HALF_WORD
        return *others, float(np.uint64(first << _HALF_WORD | second).view(np.float64))


class LastPlace(Layout):
    """A speed table to the last place: rows are high, low, a_1, …, of an even degree."""

    @property
    def names(self) -> tuple[str, ...]:
        """The names of a row's numbers."""
        return ("high", "low", *(f"a{n}" for n in range(1, self.degree + 1)))

    def row(self, index: int) -> tuple[float, ...]:
        """Return the numbers of one row."""
        p = self.best(index, self.centre(index))
        first, *others = (to_fraction(p[n]) for n in range(self.degree + 1))
        head = DOUBLE.nearest(first)
        return head, DOUBLE.nearest(first - Fraction(head)), *map(DOUBLE.nearest, others)

    @cache  # noqa: B019  layouts are few
    def sums(self) -> CodeBranch:
        """Return p = high + rest and the results from a row's numbers and t."""
        t, base, high, rest = map(Name, ("t", "base", "high", "rest"))
        program = (
            Statement("tt", t * t),
            Statement("rest", Name("low") + t * in_pairs("t", "tt", self.names[2:])),
            *sum_with_error(base, high),
            Statement("p", high + rest),
        )
        return _from_speed(program, Name("head") + (Name("lost") + rest))

    def bounds_on(self, index: int, piece: MantissaPiece, parts: int) -> Bounds:
        """Bound the error of eps in ulp of the true value, and the relative one of p; w is exact."""
        t = fmpq_poly([to_fmpq(piece.centre - self.centre(index)), to_fmpq(piece.half)])
        machine = exact_polynomial(self.sums(), "p", {"t": t}, dict(zip(self.names, self.rows[index], strict=True)))
        given = greatest(machine - piece.p, parts) + piece.error
        least, most, base = piece.least, piece.most, self.base(index)
        if not 0 < least <= most < 1:
            raise ArithmeticError(f"p may vanish in row {index}")
        rest, added = self.rounding_on(index, t)
        return {
            "ulp": Fraction(1, 2) + (given + added) / DOUBLE.ulp(1 - most if base else least),
            "relative": ((given + rest) / least + _U) * (1 + _U),
        }

    def rounding_on(self, index: int, t: fmpq_poly) -> tuple[Fraction, Fraction]:
        """Bound the rounding errors of `rest`, and of what is added to the leading sum."""
        with working(_BITS):
            given = {name: Rounded(arb(c), DOUBLE) for name, c in zip(self.names, self.rows[index], strict=True)}
            given["t"] = Rounded(arb_poly(t)(arb(0, 1)), DOUBLE)
            # Both leading operands are normal numbers of which the first is the larger: Fast2Sum is exact.
            lost = half_unit(1 + given["high"].value, DOUBLE) if self.base(index) else arb(0)
            given["lost"] = Rounded(arb(0, lost), DOUBLE)
            found = rounded_results(self.sums(), ["rest", "lost"], given, DOUBLE)
            return exact_middle(found["rest"].absolute), exact_middle((found["lost"] + found["rest"]).absolute)


def forms_of(layout: Layout) -> tuple[Format, ...]:
    """Return the types in which a table's sums are computed."""
    return (DOUBLE, FLOAT) if layout.form == FLOAT else (DOUBLE,)


def worst(found: Sequence[Bounds]) -> Bounds:
    """Return the largest of each bound."""
    return {name: max(bounds[name] for bounds in found) for name in found[0]}


def _of_s(piece: MantissaPiece) -> fmpq_poly:
    return fmpq_poly([to_fmpq(piece.centre), to_fmpq(piece.half)])


# --- what is tabulated ------------------------------------------------------------------------------------------------


@lru_cache(maxsize=1)
def _edges() -> tuple[Fraction, ...]:
    """Return where the panels of `panel_proof` end, in w."""
    return tuple((Fraction(float(CENTRES[i])) + Fraction(float(HALF_WIDTHS[i]))) ** 10 for i in range(PANELS))


def _panel_at(exponent: int, m: Fraction) -> int:
    return min(bisect_left(_edges(), m * Fraction(2) ** exponent), PANELS - 1)


def _smaller_at(w: Fraction, base: int) -> Fraction:
    """Return p at a point, to far more digits than a double has."""
    with working(_BITS):
        portions = truth.portions_of_w(w)
        return exact_middle(-portions.loss if base else portions.epsilon)


def smaller(exponent: int, low: Fraction, high: Fraction, base: int, degree: int, panel: int) -> MantissaPiece:
    """Return p on low <= m <= high from one panel of `panel_proof`, a Taylor polynomial whose remainder is enclosed."""
    centre, half = (low + high) / 2, (high - low) / 2
    order = degree + _MORE
    with working(_BITS, order + 1):
        scale = arb(2) ** exponent
        name, sign = ("one_minus_epsilon", -1) if base else ("epsilon", 1)
        row = panel_proof.panel_rows()[name, panel].poly().coeffs()
        ends = arb(float(CENTRES[panel])), arb(float(HALF_WIDTHS[panel]))

        def at(s: arb) -> list[arb]:
            w = arb_series([(ball_of(centre) + ball_of(half) * s) * scale, ball_of(half) * scale])
            v_star = (w.log() / 10).exp()
            return (polynomial(row, (v_star - ends[0]) / ends[1]) * sign).coeffs()

        coefficients = [*at(arb(0))[:order], *at(arb(0, 1))[order:]]
        if len(coefficients) != order + 1:
            raise ArithmeticError("a Taylor polynomial lost terms")
        own = sum((c.rad() for c in coefficients), arb(0)).abs_upper()
        p = fmpq_poly([_middle(c) for c in coefficients])
        enclosed, relative = to_fraction(_middle(own)), Fraction(panel_proof.proven_error())
        error = enclosed + relative / (1 - relative) * (greatest(p) + enclosed)
    return MantissaPiece(centre, half, p, error)


def _middle(ball: arb) -> fmpq:
    return fmpq(ball.mid().fmpq())


# --- records ----------------------------------------------------------------------------------------------------------

FIRST = -96
TABLES: Mapping[str, Layout] = {
    "1e-5": Polynomials(6, FIRST, 1, FLOAT),
    "5e-6": Polynomials(2, FIRST, 3, FLOAT),
    "1e-10": HalfWords(5, FIRST, 4, DOUBLE),
    "full": LastPlace(3, -64, 10, DOUBLE),
}
"""The tables by accuracy. The table of full accuracy ends at v* = 84."""


@recorded("speed table rows")
def table_rows(layout: Layout) -> tuple[tuple[float, ...], ...]:
    """Return all rows of a table."""
    return tuple(layout.row(i) for i in track(range(layout.size), f"table of degree {layout.degree}"))


@recorded("speed table bounds")
def table_bounds(layout: Layout) -> Mapping[str, Fraction]:
    """Prove the bounds of a whole table; "rise" is the largest increase of eps from one row to the next, or 0."""
    check_results(layout)
    found = dict(worst([layout.bounds(i) for i in track(range(layout.size), "proof")]))
    if isinstance(layout, Polynomials):
        found["rise"] = max(Fraction(0), *map(layout.rise_after, range(layout.size - 1)))
    return found


def check_results(layout: Layout) -> None:
    """Check that without rounding a table's results are eps = base + p, eps speed, and 1 - eps^2.

    Raises
    ------
    ArithmeticError
        If they are not.
    """
    branch, x = layout.sums(), fmpq_poly([0, 1])
    # Any coefficients, any speed, and any leading sum, as its loss makes up for what it lacks.
    speed, head = x**5 + 2, x**7 - 3
    for base in (0, 1):
        numbers = {name: 1.375 + n for n, name in enumerate(layout.names)} | {"base": base, "rest_of_base": 1 - base}
        given = {"m": x, "t": x, "speed": speed, "head": head}
        found = {name: exact_polynomial(branch, name, given, numbers) for name in ("p", *branch.results)}
        eps = found["p"] + base
        if found != {"p": eps - base, "restitution": eps, "rebound": eps * speed, "dissipation": 1 - eps * eps}:
            raise ArithmeticError("the results of a speed table are not eps = base + p, eps speed, and 1 - eps^2")


@recorded("rounding of w")
def of_w(form: Format) -> Fraction:
    """Return a bound of the relative errors of eps and of 1 - eps by the rounding of w = beta^5 v.

    A w that is rounded across a border is in the domain of another row, or panel of `panel_proof`; that adds the errors
    of its rows twice.
    """
    change = rounding_bounds.rounding_of_w(form)
    return change * (1 + change) * panel_proof.steepest() / 10 + 4 * Fraction(panel_proof.proven_error())


# --- the sequence of operations ---------------------------------------------------------------------------------------


def _from_speed(program: Program, eps: Expression) -> CodeBranch:
    """Return the results of a speed table; 1 - eps^2 = (1 - base) - p (2 base + p) loses no digits."""
    p, base = Name("p"), Name("base")
    dissipation = Name("rest_of_base") - p * (Exact(Literal("2.0") * base, "base is 0 or 1") + p)
    results = {"restitution": Name("eps"), "rebound": Name("eps") * Name("speed"), "dissipation": dissipation}
    return CodeBranch(None, (*program, Statement("eps", eps)), results)


def place_program(layout: Layout) -> Program:
    """Return the assignments of w, and of the distance of its bits from the bits of the table's beginning.

    beta^5 comes first, so that a compiler can move it out of loops.
    """
    beta = Name("beta")
    return (
        Statement("b2", beta * beta),
        Statement("scale", formulas.fifth_power("b2")),
        Statement("w", Name("scale") * Name("speed")),
        Statement("place", bits(Name("w")) - power_of_two(layout.first)),
    )


def row_number(layout: Layout) -> Expression:
    """Return the number of the row of a place."""
    return Name("place") >> count(lambda form: form.precision - 1 - layout.split)


def base_of(layout: Layout) -> Expression:
    """Return 1 below w = 2^SWITCH, else 0, without a comparison, which could become a branch."""
    sign = count(lambda form: 8 * form.bytes - 1)
    below = count(0) - ((Name("place") - octaves(SWITCH - layout.first)) >> sign)
    return from_bits(below & power_of_two(0))


def row_branch(layout: Layout) -> CodeBranch:
    """Return the results from place, base and a row's numbers."""
    place, one, sums = Name("place"), power_of_two(0), layout.sums()

    def fraction(split: int) -> Expression:
        """Return 1 + m mod 2^-split: m without the bits that tell the row, or for 0 m."""
        return from_bits((place & Word(lambda form: (1 << (form.precision - 1 - split)) - 1)) | one)

    # t = m - centre = (1 + m mod 2^-split) - (1 + 2^-(split + 1))
    half_a_row = 1 + Fraction(1, 2 << layout.split)
    program = (
        Statement("m", fraction(0)),
        Statement("t", Exact(fraction(layout.split) - Literal(repr(float(half_a_row))), "its bits are those of m")),
        Statement("rest_of_base", from_bits(bits(Name("base")) ^ one)),
        *layout.unpacking,
        *sums.program,
    )
    return sums._replace(program=program)


def of_v_star_branch(kernel: str) -> CodeBranch:
    """Return the results by a kernel of v*, in type double: where the table does not help."""
    branch, eps, speed = formulas.v_star_branch(), Name("eps"), Name("speed")
    of_eps, of_loss = (
        Call(f"viscopade_{name}_{kernel}", (Name("v_star"),)) for name in ("epsilon", "one_minus_epsilon")
    )
    # Without the choice, the speed after the collision would be 0 times infinity at an infinite speed.
    rebound = Select(both(equal(eps, ZERO), speed > Name("largest")), speed, eps * speed)
    results = {"restitution": eps, "rebound": rebound, "dissipation": lost_energy(eps, of_loss)["of_both"]}
    program = Statement("v_star", branch.results["v_star"]), Statement("eps", of_eps)
    return CodeBranch(branch.guard, program, results)


def _functions(layout: Layout, elsewhere: Kernel) -> Iterator[Function]:
    program = (
        Statement("row", TableRow("table", row_number(layout))),
        *(Statement(name, Column("row", n)) for n, name in enumerate(layout.columns)),
        Statement("base", base_of(layout)),
    )
    branch = row_branch(layout)
    inside = both(Name("place") < octaves(OCTAVES), Name("scale") >= Name("smallest"))
    branch = CodeBranch(inside, (*program, *branch.program), branch.results)
    beyond = of_v_star_branch(elsewhere.name)
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
    elsewhere = _in_double(half_line("1e-5") if layout.form == FLOAT else full())  # within 3.4e-6
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
            form.name: {"smallest": float(form.least), "largest": (2 - form.epsilon) * 2.0**form.largest}
            for form in (DOUBLE, FLOAT)
        },
        tuple(_bounds(layout, elsewhere)),
        (Table("table", layout.form.name, (layout.size, len(layout.columns)), lambda: layout.rows),),
        fallback=elsewhere,
    )


def _monotonic(layout: Layout) -> str:
    """Return what is proven of the slope of eps, as text."""
    proven = table_bounds(layout)
    if "rise" not in proven:
        return ""
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

_FOR_ALL = Fraction(0), INFINITY
_HALF = Fraction(1, 2)


def _bounds(layout: Layout, elsewhere: Kernel) -> Iterator[ErrorBound]:
    """Yield the bounds in the table, on both sides of it, and everywhere; elsewhere for usual speeds and for all.

    In the table and elsewhere there is also one for all arguments that lead there.
    """
    # Ranges of the exact w and beta^5; they decide, with one octave to spare, whether the computed ones are in the
    # table, and normal.
    first, end = layout.first, layout.first + OCTAVES
    low, high = _tenth_root(first), _tenth_root(end)
    inner, outer = 1 + Fraction(1, 10**6), 1 - Fraction(1, 10**6)
    for arithmetic, name in product((HOST, HOST_FLOAT), MEANINGS):
        form = arithmetic.form if arithmetic.form in forms_of(layout) else DOUBLE
        speeds = Fraction(2) ** (end + 1 - form.largest), Fraction(2) ** (first + form.largest - 2)
        inside = _in(arithmetic, _inside(layout, name, form), form)
        # A subnormal speed has a subnormal rebound: its last rounding is absolute.
        lost = name == "rebound" and not inside.ulps
        yield replace(inside, branch=0, absolute=_HALF) if lost else replace(inside, branch=0)
        yield replace(inside, low=low * inner, high=high * outer, speeds=speeds)
        for usual in (True, False):
            outside = _in(arithmetic, _outside(elsewhere, name, usual), DOUBLE)
            yield replace(outside, branch=1)
            below = replace(outside, high=low * outer)
            # There eps > 1/2, and its absolute error no more than a relative one.
            yield _without_absolute(below) if name == "rebound" else below
            yield replace(outside, low=high * inner)
            yield weakest([outside, inside])


def _tenth_root(exponent: int) -> Fraction:
    """Return 2^(exponent/10), rounded to 12 digits, far closer than its neighbours that are used."""
    return Fraction(f"{2.0 ** (exponent / 10):.12g}")


def _inside(layout: Layout, name: str, form: Format) -> ErrorBound:
    """Return the bound in the table, of a type in which its sums are computed; it counts the rounding of w."""
    proven, rounding, eps = table_bounds(layout), of_w(form), name == "restitution"
    if isinstance(layout, LastPlace):
        if eps:
            return ErrorBound(name, *_FOR_ALL, "smaller", Fraction(0), rounding, ulps=proven["ulp"])
        return ErrorBound(name, *_FOR_ALL, "value", proven["relative"] + 4 * _U, rounding)  # p, and 4 roundings
    rounding = ((1 + proven[form.name]) * (1 + rounding) - 1) * (1 + proven["error"])
    ulps = _HALF if eps else Fraction(LAST_ULPS)
    return ErrorBound(name, *_FOR_ALL, "smaller" if eps else "value", proven["error"], rounding, ulps=ulps)


def _outside(elsewhere: Kernel, name: str, usual: bool) -> ErrorBound:
    """Return the bound where the kernel of v* serves, in type double."""
    eps, loss = (elsewhere.bound(function, "host", "double")[-1] for function in ("epsilon", "one_minus_epsilon"))
    speeds, rounding = (1 / USUAL, USUAL) if usual else None, eps_error_from_v_star(largest=USUAL if usual else None)
    if name == "restitution":
        return replace(eps, result=name, relative_to="smaller", rounding=rounding, speeds=speeds)
    of_both = _relative(eps) + (_relative(loss) if name == "dissipation" else 0)
    # Where 1 - eps is subnormal, 1 - eps^2 is exactly twice that; where eps is, rebound has its error times speed.
    # A normal 1 - eps^2 is twice a 1 - eps of at least half the least normal number, of which half_line's bound holds
    # without `absolute`, and full's is below an ulp, so that twice its error is below `LAST_ULPS`.
    absolute = 2 * max(loss.absolute, _HALF) if name == "dissipation" else max(eps.absolute, _HALF)
    return ErrorBound(
        name, *_FOR_ALL, "value", eps.formula, rounding + of_both, ulps=Fraction(LAST_ULPS), absolute=absolute,
        speeds=speeds,
    )  # fmt: skip


def _without_absolute(bound: ErrorBound) -> ErrorBound:
    """Return a bound of rebound for eps > 1/2, where its last operations add less than `LAST_ULPS`."""
    return replace(bound, rounding=bound.rounding + 2 * bound.absolute * DOUBLE.smallest, absolute=Fraction(0))


def _relative(bound: ErrorBound) -> Fraction:
    """Return what rounding adds relative to the value, where it is normal."""
    return bound.last + bound.ulps * Fraction(DOUBLE.epsilon)


def _in(arithmetic: Arithmetic, found: ErrorBound, form: Format) -> ErrorBound:
    """Return a bound of results in one type as one of these results in another: there is one rounding more.

    No speed and beta of type float have a subnormal result of type double.
    """
    if arithmetic.form == form:
        return replace(found, arithmetic=arithmetic)
    return replace(found, last=_relative(found), ulps=_HALF, absolute=Fraction(0), arithmetic=arithmetic)
