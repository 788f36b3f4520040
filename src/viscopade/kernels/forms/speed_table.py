r"""Speed tables: eps without a root, by the leading bits of w = beta^5 v = v*^10, with proofs of their errors.

A floating-point number w = 2^e m, 1 <= m < 2, says by its exponent e and the leading bits of m which row of a table it
belongs to; no root and no logarithm is needed. A row holds a polynomial in m of odd degree for

    p = eps - base,    base = 1 for w < 2^SWITCH (p = -(1 - eps)), 0 else (p = eps),

the smaller of eps and 1 - eps, so that its relative error is what counts (section 2.7), and

    1 - eps^2 = (1 - base) - p (2 base + p)

loses no digits either. The polynomials interpolate the rows of `panel_proof`, as functions of m, at Chebyshev points.
`Table` also bounds, row by row, exactly or in ball arithmetic: the error of the polynomials with their machine
coefficients, the rounding error in the exported code's sequence of operations, the effect of an error of w, and the
largest increase of eps with v (docs/reference/speed.md).

The polynomial is summed in pairs, p = (c_0 + m c_1) + m^2 ((c_2 + m c_3) + m^2 (…)).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import Any, NamedTuple, cast

import numpy as np
from flint import arb, arb_series, fmpq, fmpq_poly

from viscopade.arithmetic.balls import ball_of, exact_middle, working
from viscopade.arithmetic.chebyshev import greatest, interpolated, nodes, to_fmpq, to_fraction
from viscopade.arithmetic.formats import DOUBLE, FLOAT, Format
from viscopade.arrays.panels import CENTRES, HALF_WIDTHS, PANELS
from viscopade.collision import panel_proof
from viscopade.kernels import formulas, rounding_bounds, truth
from viscopade.kernels.enclosure import exactly, polynomial
from viscopade.kernels.expressions import (
    CodeBranch,
    Expression,
    Name,
    Program,
    Statement,
    TableRow,
    Word,
    both,
    evaluate,
    prepared,
)
from viscopade.kernels.forms.bits import bits, count, from_bits, mask, octaves, power_of_two
from viscopade.kernels.machine import TYPES, machine_arithmetic, rows_of, run_on_row
from viscopade.kernels.rounding import Rounded, of_branch
from viscopade.progress import track
from viscopade.store import recorded

OCTAVES = 128
"""Of w, in every table: a power of 2, so that the range is checked by a shift."""
FIRSTS = range(-124, -27)
"""Where a table may begin: w and 2^(first + OCTAVES) are normal numbers of type float."""
SWITCH = -3
"""Below w = 2^SWITCH, p is -(1 - eps); there eps is about 1/2."""
MOST_SPLIT = 8
MOST_DEGREE = 15

LAST_ULPS = 3
"""Units in the last place of what the last operations add to the relative errors of rebound and dissipation."""

TABLE, SMALLEST, REST = "table", "smallest", "rest_of_base"
"""Names in programs: all rows, the smallest normal number, and 1 - base."""

_BITS = 160
PARTS = 16  # of a piece of a row, where the error is no multiple of one Chebyshev polynomial
_MORE = 7  # terms of Taylor polynomials beyond the degree


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


class RowBounds(NamedTuple):
    """Bounds on a row, relative to the smaller of eps and 1 - eps."""

    error: Fraction
    rounding: tuple[tuple[str, Fraction], ...]
    """Of what rounding does to p for an exact w, by name of the type."""
    falling: bool
    """Whether eps certainly decreases with w on the row."""


@dataclass(frozen=True)
class Layout(ABC):
    """Layout of a speed table: the row of every number w.

    Attributes
    ----------
    split : int
        There are 2^split rows to an octave.
    first : int
        The table begins at w = 2^first, and ends at 2^(first + OCTAVES).
    """

    split: int
    first: int

    def __post_init__(self) -> None:
        if self.split not in range(MOST_SPLIT + 1):
            raise ValueError(f"split is {self.split}: accepted is 0 to {MOST_SPLIT}")
        if self.first not in FIRSTS:
            raise ValueError(f"first is {self.first}: accepted is {FIRSTS.start} to {FIRSTS.stop - 1}")

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

    @property
    def ends(self) -> tuple[float, float]:
        """The w between which the table holds eps, the second one excluded."""
        return 2.0**self.first, 2.0 ** (self.first + OCTAVES)

    def centre(self, index: int) -> Fraction:
        """Return the middle of a row, in m."""
        _, low, high = self.interval(index)
        return (low + high) / 2

    @property
    @abstractmethod
    def rows(self) -> tuple[tuple[float, ...], ...]:
        """The numbers c_0, c_1, … of every row."""

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The names of a row's numbers."""
        return tuple(f"c{n}" for n in range(len(self.rows[0])))

    @abstractmethod
    def inside(self, form: Format) -> Fraction:
        """Return a bound of the computed p's error, w's rounding included, relative to the smaller of eps and 1 - eps.

        Rebound and dissipation have it, too, relative to themselves; those of `Table` `LAST_ULPS` besides.
        """

    @abstractmethod
    def sums(self, names: Sequence[str], rest: str = REST) -> CodeBranch:
        """Return what is computed from a row's numbers, of these names, m or t, and the names of base and 1 - base."""

    def branch(self, form: Format) -> CodeBranch:
        """Return what code computes in a type from speed, beta, `TABLE` and `SMALLEST`."""
        sums = self.sums(self.names)
        return sums._replace(guard=self.holds(form), program=(*self.row_program(form), *sums.program))

    def row_program(self, form: Format) -> Program:
        """Return the assignments of w, its row, m, the row's middle, their distance t, base, and 1 - base."""
        beta, scale = Name("beta"), Name("scale")
        fraction, one = form.precision - 1, power_of_two(form, 0)
        place, m, middle = Name("place"), Name("m"), Name("middle")
        lead = mask(self.split).value << (fraction - self.split)
        half_a_row = 1 << (fraction - self.split - 1)
        below = count(0) - ((place - octaves(form, SWITCH - self.first)) >> count(8 * form.bytes - 1))
        return (
            Statement("b2", beta * beta),
            Statement("scale", formulas.fifth_power("b2")),
            Statement("w", scale * Name("speed")),
            Statement("bits", bits(form, Name("w"))),
            Statement("place", Name("bits") - power_of_two(form, self.first)),
            Statement("index", place >> count(fraction - self.split)),
            Statement("row", TableRow(TABLE, Name("index"))),
            Statement("bits_of_m", (place & mask(fraction)) | one),
            Statement("m", from_bits(form, Name("bits_of_m"))),
            Statement("bits_of_middle", (place & Word(lead)) | Word(one.value | half_a_row)),
            Statement("middle", from_bits(form, Name("bits_of_middle"))),
            Statement("t", m - middle),
            Statement("octave", place >> count(fraction)),
            Statement("bits_of_base", below & one),
            Statement("base", from_bits(form, Name("bits_of_base"))),
            Statement(REST, from_bits(form, bits(form, Name("base")) ^ one)),
        )

    def evaluated_in(self, form: Format, result: str, speed: Any, beta: Any) -> tuple[Any, Any]:
        """Return a result of the code of a type without FMA contraction, and whether the code takes it from this table.

        Elsewhere the first one means nothing. Speeds and betas are numbers of that type.
        """
        by, branch, kind = machine_arithmetic(form), _prepared(self, form), TYPES[form.name]
        given = {"speed": np.asarray(speed, kind), "beta": np.asarray(beta, kind)}
        given |= {TABLE: rows_of(self, form), SMALLEST: kind(2.0 ** (1 - form.largest))}
        with np.errstate(all="ignore"):
            run = run_on_row(branch, self.names, given, by)
            return evaluate(branch.results[result], run, by), evaluate(cast(Expression, branch.guard), run, by)

    def holds(self, form: Format, smallest: str = SMALLEST) -> Expression:
        """Return the condition that w is in the table, and beta^5, the `scale` of the speed, a normal number."""
        return both(self.within(form), Name("scale") >= Name(smallest))

    def within(self, form: Format) -> Expression:
        """Return the condition that w is in the table."""
        return Name("place") < octaves(form, OCTAVES)

    def best(self, index: int, degree: int, origin: Fraction) -> fmpq_poly:
        """Return the row's p in m - origin: the interpolation polynomial at Chebyshev points, nearly the best one."""
        exponent, low, high = self.interval(index)
        points = [self.centre(index) + (high - low) / 2 * s for s in nodes(degree + 1)]
        values = [_smaller_at(m * Fraction(2) ** exponent, self.base(index)) for m in points]
        return interpolated([m - origin for m in points], values)

    def pieces(self, index: int, degree: int) -> list[MantissaPiece]:
        """Return p as Taylor polynomials with bounds of their errors; cut where the panels of `panel_proof` end."""
        exponent, low, high = self.interval(index)
        first, last = _panel_at(exponent, low), _panel_at(exponent, high)
        ends = [low, *(edge / Fraction(2) ** exponent for edge in _edges()[first:last]), high]
        return [
            smaller(exponent, start, end, self.base(index), degree, panel)
            for panel, (start, end) in enumerate(pairwise(ends), first)
            if start < end
        ]


@dataclass(frozen=True)
class Table(Layout):
    """A speed table: rows of polynomials in m.

    Attributes
    ----------
    degree : int
        Odd.
    form : Format
        Type of the coefficients.

    The others are those of `Layout`.

    Raises
    ------
    ValueError
        If there is no such table.
    """

    degree: int
    form: Format

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.degree not in range(1, MOST_DEGREE + 1, 2):
            raise ValueError(f"degree is {self.degree}: accepted are odd numbers from 1 to {MOST_DEGREE}")

    @property
    def types(self) -> tuple[Format, ...]:
        """The types in which the sums are computed."""
        return (DOUBLE, FLOAT) if self.form == FLOAT else (DOUBLE,)

    @property
    def bytes(self) -> int:
        """Size in memory."""
        return self.size * (self.degree + 1) * self.form.bytes

    @cached_property
    def rows(self) -> tuple[tuple[float, ...], ...]:
        """The coefficients c_0, c_1, …, numbers of the format, of every row."""
        return table_rows(self)

    def sums(self, names: Sequence[str], rest: str = REST) -> CodeBranch:
        """Return what is computed from a row's coefficients."""
        return formulas.table_row_branch(names, rest)

    def row(self, index: int) -> tuple[float, ...]:
        """Return the coefficients of one row."""
        p = self.best(index, self.degree, Fraction(0))
        return tuple(self.form.nearest(to_fraction(p[n])) for n in range(self.degree + 1))

    def machine(self, index: int, piece: MantissaPiece) -> fmpq_poly:
        """Return the row's polynomial in s, exactly."""
        return self._p(index, fmpq_poly([to_fmpq(piece.centre), to_fmpq(piece.half)]))

    def _p(self, index: int, m: fmpq_poly) -> fmpq_poly:
        """Return a row's p, exactly."""
        return exactly(self.sums(self.names), "p", {"m": m}, dict(zip(self.names, self.rows[index], strict=True)))

    def bounds(self, index: int) -> RowBounds:
        """Prove the bounds of a row.

        Raises
        ------
        ArithmeticError
            If p may vanish.
        """
        whole = self.pieces(index, self.degree)
        found = [self._bounds_on(index, piece, 1 if len(whole) == 1 else PARTS) for piece in whole]
        return _worst(found)

    def _bounds_on(self, index: int, piece: MantissaPiece, parts: int) -> RowBounds:
        machine, least, most = self.machine(index, piece), piece.least, piece.most
        smallest = min(least, 1 - most)
        if not smallest > 0:
            raise ArithmeticError(f"p may vanish in row {index}")
        error = greatest(machine - piece.p, parts) + piece.error
        rounding = tuple((form.name, self._rounding_on(index, piece, form) / smallest) for form in self.types)
        rise = machine.derivative()
        falling = to_fraction(rise[0]) + greatest(rise - rise[0]) < 0
        return RowBounds(error / smallest, rounding, falling)

    def _rounding_on(self, index: int, piece: MantissaPiece, form: Format) -> Fraction:
        """Bound the rounding error of p."""
        with working(_BITS):
            given = {name: Rounded(arb(c), form) for name, c in zip(self.names, self.rows[index], strict=True)}
            given["m"] = Rounded(ball_of(piece.centre) + ball_of(piece.half) * arb(0, 1), form)
            return exact_middle(of_branch(self.sums(self.names), ["p"], given, form)["p"].absolute)

    @cached_property
    def proven(self) -> RowBounds:
        """Bounds for the whole table."""
        return table_bounds(self)

    @cached_property
    def rise(self) -> Fraction:
        """The largest increase of eps from one row to the next, relative to the smaller of eps and 1 - eps, exactly."""
        return table_rise(self)

    def rise_after(self, index: int) -> Fraction:
        """Return the increase of eps, likewise, from a row to the next."""
        ends = (index, self.interval(index)[2]), (index + 1, self.interval(index + 1)[1])
        before, after = (to_fraction(self._p(i, fmpq_poly([to_fmpq(m)]))[0]) for i, m in ends)
        after += self.base(index + 1) - self.base(index)
        return (after - before) / min(abs(before), 1 - abs(before))

    def rounding(self, form: Format) -> Fraction:
        """Return a bound of the rounding error of p, w's included, relative to the smaller of eps and 1 - eps."""
        change = (1 + dict(self.proven.rounding)[form.name]) * (1 + of_w(form)) - 1
        return change * (1 + self.proven.error)

    def inside(self, form: Format) -> Fraction:
        """Return a bound of the computed p's error: of the formula, and of rounding."""
        return self.proven.error + self.rounding(form)


@recorded("table_rows")
def table_rows(table: Table) -> tuple[tuple[float, ...], ...]:
    """Return all rows of a table."""
    return tuple(table.row(i) for i in track(range(table.size), f"table of degree {table.degree}"))


@recorded("table_rise")
def table_rise(table: Table) -> Fraction:
    """Return the largest increase of eps from one row to the next, or 0."""
    return max(max(table.rise_after(i) for i in range(table.size - 1)), Fraction(0))


def check_row_results(table: Layout) -> None:
    """Check that without rounding a table's results are eps = base + p, eps speed, and 1 - eps^2.

    Raises
    ------
    ArithmeticError
        If they are not.
    """
    branch, x = table.sums(table.names), fmpq_poly([0, 1])
    # Any coefficients, any speed, and any leading sum, as its loss makes up for what it lacks.
    speed, head = x**5 + 2, x**7 - 3
    for base in (0, 1):
        numbers = {**{name: 1.375 + n for n, name in enumerate(table.names)}, "base": base, REST: 1 - base}
        given = {"m": x, "t": x, "speed": speed, "head": head}
        found = {name: exactly(branch, name, given, numbers) for name in ("p", *branch.results)}
        eps = found["p"] + base
        if found != {"p": eps - base, "restitution": eps, "rebound": eps * speed, "dissipation": 1 - eps * eps}:
            raise ArithmeticError("the results of a speed table are not eps = base + p, eps speed, and 1 - eps^2")


@recorded("table_bounds")
def table_bounds(table: Table) -> RowBounds:
    """Prove the bounds of a whole table."""
    check_row_results(table)
    return _worst([table.bounds(i) for i in track(range(table.size), "proof")])


@recorded("w_rounding")
def of_w(form: Format) -> Fraction:
    """Return a bound of the relative errors of eps and of 1 - eps by the rounding of w = beta^5 v.

    A w that is rounded across a border is in the domain of another row, or panel of `panel_proof`; that adds the errors
    of its rows twice.
    """
    change = rounding_bounds.rounding_of_w(form)
    return change * (1 + change) * panel_proof.steepest() / 10 + 4 * Fraction(panel_proof.proven_error())


@lru_cache(maxsize=32)
def _prepared(table: Layout, form: Format) -> CodeBranch:
    """Return a table's branch, prepared to be read with machine numbers."""
    return prepared(table.branch(form), machine_arithmetic(form))


def _worst(found: Sequence[RowBounds]) -> RowBounds:
    return RowBounds(
        max(b.error for b in found),
        tuple((name, max(dict(b.rounding)[name] for b in found)) for name, _ in found[0].rounding),
        all(b.falling for b in found),
    )


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
        portions = truth.at(w)
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
