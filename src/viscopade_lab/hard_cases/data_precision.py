"""What rounding h_k to a few digits does to [m/m+3]: its eps, its poles, and the doublets that only rounding made.

Every system is solved in fractions, so that the error of the data is the only one. Let a/b come from h and a~/b~ from
h + dh, N = 2m + 3, and [p]_N be the terms of a polynomial up to v*^N. As both meet the order conditions,

    a~ b - a b~ = [b b~ dh]_N,

exactly. With |dh_l| <= u |h_l| that bounds the change of eps, and of b~ at a pole of a/b; a polynomial of degree n
has a root within n |b~/b~'| of any point. Both bounds are proven. To first order b~ = b, and a pole p moves by no more
than u kappa |p|: kappa tells beforehand which poles a precision of the data can hold.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from decimal import ROUND_HALF_EVEN, Context
from fractions import Fraction
from functools import lru_cache

import numpy as np
from flint import acb, acb_poly, arb

from viscopade.arithmetic.balls import ball_of, bits_for, working
from viscopade.arithmetic.decimals import at_most
from viscopade.arrays import double
from viscopade.theory.pade import DOUBLET_TOLERANCE, Doublet, Pade, Root, rational_pade
from viscopade.theory.series import series
from viscopade_lab.hard_cases.finding import Case, Cell, Chart, ChartCurve, Check, Outcome, ResultTable, curve, signed
from viscopade_lab.singularity import from_four

QUICK = (0, 1, 2, 3, 5, 7, 10, 13, 15, 20, 25)
THOROUGH = tuple(range(61))
DECIMALS = (6, 10, 15)
DOUBLE = "double"
V_STARS = tuple(Fraction(k, 5) for k in range(1, 26))
NEAR, FAR = 1, 5  # the ranges (0, 1] and (0, 5] that largest errors are stated for
# Of the series that counts as exact, and of all poles: a doublet at v* = p has a residue as small as about p^(2m + 3).
DIGITS, DIGITS_PER_M = 50, 2
# A pole counts as kept if it stays within this part of its modulus, as a doublet counts as one.
KEPT = DOUBLET_TOLERANCE
# Predictions of first order are looked at where they are below SMALL; a factor of 2 covers the higher orders there.
SMALL, HIGHER_ORDERS = 1e-3, 2.0
DRAWN_M, DRAWN_SQUARE = 25, 2.5
ERROR_M = 15
MOVED_M = (7, 10, 15, 20, 25)
SHOWN = 6  # of a list of m in a table
LANDMARKS = ((7, 0.28 + 0j), (10, 3.8 + 0j), (25, 2.97 + 0j))  # m, and about where positive poles of it are


@dataclass(frozen=True)
class RoundedSeries:
    """h_0, h_1, … rounded, and the unit roundoff: |dh_l| <= u |h_l|."""

    name: str
    h: tuple[Fraction, ...]
    u: Fraction


@dataclass(frozen=True)
class SensitivePade:
    """[m/m+3] of the exact series, with the poles on and above the axis and their kappa.

    Attributes
    ----------
    amplification : tuple of float
        At each of `V_STARS`, the most by which relative errors of h_k are amplified in eps, to first order.
    """

    p: Pade
    upper: tuple[Root, ...]
    kappa: tuple[float, ...]
    amplification: tuple[float, ...]


@dataclass(frozen=True)
class PadeOfRounded:
    """[m/m+3] of rounded data, against that of the exact series.

    Attributes
    ----------
    moved : tuple of float
        From each pole of `SensitivePade.upper` to the nearest one here, in parts of its modulus.
    proven : float
        Largest such distance, either way, in parts of the proven bound.
    spurious : tuple of Doublet
        Those without a pole of the exact approximant within KEPT.
    error : tuple of float
        At each of `V_STARS`, the relative change of eps.
    error_proven : float
        Largest of them in parts of the proven bound.
    total : tuple of float
        At each of `V_STARS`, the relative error against the exact function, in double precision.
    """

    data: RoundedSeries
    p: Pade
    moved: tuple[float, ...]
    proven: float
    spurious: tuple[Doublet, ...]
    error: tuple[float, ...]
    error_proven: float
    total: tuple[float, ...]


# --- data -------------------------------------------------------------------------------------------------------------


def exact_data(largest_m: int) -> tuple[Fraction, ...]:
    """Return the series that counts as exact: its digits cover what any of the poles looked at can lose."""
    return tuple(map(Fraction, series(2 * largest_m + 3, _digits(largest_m)).decimals()))


def rounded_series(h: Sequence[Fraction]) -> tuple[RoundedSeries, ...]:
    """Return the series rounded to few decimals, and to double."""
    found = [
        RoundedSeries(
            f"{digits} digits", tuple(_to_decimal(h_k, digits) for h_k in h), Fraction(1, 2 * 10 ** (digits - 1))
        )
        for digits in DECIMALS
    ]
    return (*found, RoundedSeries(DOUBLE, tuple(Fraction(float(h_k)) for h_k in h), Fraction(1, 2**53)))


def _to_decimal(number: Fraction, digits: int) -> Fraction:
    context = Context(prec=digits, rounding=ROUND_HALF_EVEN)
    return Fraction(context.divide(number.numerator, number.denominator))


# --- one approximant --------------------------------------------------------------------------------------------------


def sensitive_pade(h: Sequence[Fraction], m: int) -> SensitivePade:
    """Return [m/m+3] of the exact series and how sensitive it is."""
    p = rational_pade(h[: 2 * m + 4], m, m + 3, _digits(m))
    upper = tuple(pole for pole in p.poles if pole.real or pole.value.imag > 0)
    with working(_bits(m)):
        a, b = _polynomials(p)
        weights = _Weights(b * b, p.h)
        slopes = [abs(a(pole.value) * b.derivative()(pole.value) * pole.value) for pole in upper]
        kappa = [_upper(weights.at(pole.value) / s) for pole, s in zip(upper, slopes, strict=True)]
        amplification = [_float(weights.at(v) / abs(a(v) * b(v))) for v in map(_point, V_STARS)]
    return SensitivePade(p, upper, tuple(kappa), tuple(amplification))


def pade_of_rounded(data: RoundedSeries, exact: SensitivePade) -> PadeOfRounded:
    """Return [m/m+3] of rounded data, compared with that of the exact series."""
    p = exact.p
    q = rational_pade(data.h[: 2 * p.m + 4], p.m, p.n, _digits(p.m))
    with working(_bits(p.m)):
        (a, b), (a_q, b_q) = _polynomials(p), _polynomials(q)
        weights, u = _Weights(b * b_q, p.h), ball_of(data.u)
        moved = [nearest(pole, q.poles) for pole in exact.upper]
        reach = [_reach(pole, a, b_q, weights, u) for pole in exact.upper]
        back = [_reach(pole, a_q, b, weights, u) for pole in q.poles]
        moved_back = [nearest(pole, p.poles) for pole in q.poles]
        proven = max(x / y for x, y in zip([*moved, *moved_back], [*reach, *back], strict=True))
        error, in_bounds, total = _errors(p, q, weights, u)
        spurious = tuple(pair for pair in q.doublets() if nearest(pair.pole, p.poles) > KEPT)
    return PadeOfRounded(data, q, tuple(moved), proven, spurious, error, in_bounds, total)


def _digits(m: int) -> int:
    return DIGITS + DIGITS_PER_M * m


def _bits(m: int) -> int:
    return 2 * bits_for(_digits(m))


def _polynomials(p: Pade) -> tuple[acb_poly, acb_poly]:
    return acb_poly(list(p.a)), acb_poly(list(p.b))


def _float(ball: arb) -> float:
    return float(ball.mid())


def _upper(ball: arb) -> float:
    """Return a bound; infinity where nothing is known."""
    return float(ball.upper()) if ball.is_finite() else math.inf


def _point(v_star: Fraction) -> acb:
    return acb(ball_of(v_star))


class _Weights:
    """sum_l |h_l x^l [product]_{N-l}(x)|: u times that bounds [product dh]_N(x)."""

    def __init__(self, product: acb_poly, h: Sequence[arb]) -> None:
        self.sizes = [abs(h_l) for h_l in h]
        self.product = [*product.coeffs()[: len(h)], *[acb(0)] * (len(h) - len(product))]

    def at(self, x: acb) -> arb:
        """Return it at a point."""
        sums, total, power = [], acb(0), acb(1)
        for c in self.product:
            total += c * power
            sums.append(total)
            power *= x
        size, step, bound = arb(1), abs(x), arb(0)
        for h_l, term in zip(self.sizes, reversed(sums), strict=True):
            bound += h_l * size * abs(term)
            size *= step
        return bound


def nearest(pole: Root, others: Iterable[Root]) -> float:
    """Return the distance to the nearest of the others, in parts of the pole's modulus."""
    place = complex(pole.value)
    # In double precision the conjugate of the nearest, or the other of a close pair, may seem as near.
    candidates = sorted(others, key=lambda other: abs(complex(other.value) - place))[:2]
    return min(_float(abs(other.value - pole.value) / abs(pole.value)) for other in candidates)


def _reach(pole: Root, a: acb_poly, other_b: acb_poly, weights: _Weights, u: arb) -> float:
    """Return the distance within which the other approximant has a pole, proven, in parts of the pole's modulus."""
    x = pole.value
    at_pole = u * weights.at(x) / abs(a(x))  # bounds |other_b(x)|
    return _upper(other_b.degree() * at_pole / abs(other_b.derivative()(x)) / abs(x))


def _errors(p: Pade, q: Pade, weights: _Weights, u: arb) -> tuple[tuple[float, ...], float, tuple[float, ...]]:
    (a, b), (a_q, b_q) = _polynomials(p), _polynomials(q)
    error, parts, total = [], [], []
    for v_star, eps in zip(V_STARS, map(float, _exact_epsilon()), strict=True):
        v = _point(v_star)
        value = a_q(v) / b_q(v)
        error.append(_float(abs(value * b(v) / a(v) - 1)))
        parts.append(error[-1] / _float(u * weights.at(v) / abs(a(v) * b_q(v))))
        total.append(abs(_float(value.real) / eps - 1))
    return tuple(error), max(parts), tuple(total)


@lru_cache(maxsize=1)
def _exact_epsilon() -> tuple[float, ...]:
    return tuple(np.asarray(double.epsilon(np.array([float(v) for v in V_STARS]))).tolist())


def lasting(found: Sequence[PadeOfRounded]) -> int:
    """Count the spurious doublets that the approximants of all other data have too, within KEPT."""
    return sum(
        all(nearest(pair.pole, other.p.poles) <= KEPT for other in found if other is not one)
        for one in found
        for pair in one.spurious
    )


# --- the case ---------------------------------------------------------------------------------------------------------

MeasuredData = Mapping[int, tuple[SensitivePade, tuple[PadeOfRounded, ...]]]


def pade_by_degree(degrees: Sequence[int]) -> MeasuredData:
    """Return for each m the exact approximant and those of all the rounded data."""
    h = exact_data(max(degrees))
    data = rounded_series(h)
    found = {}
    for m in degrees:
        exact = sensitive_pade(h, m)
        found[m] = exact, tuple(pade_of_rounded(one, exact) for one in data)
    return found


def _run(thorough: bool) -> Outcome:
    found = pade_by_degree(THOROUGH if thorough else QUICK)
    return Outcome(
        _summary(found),
        (_by_precision(found), _by_degree(found), _landmarks(found)),
        (_pole_chart(found), _movement_chart(found), _error_chart(found)),
        _checks(found),
    )


def slope(found: MeasuredData) -> tuple[float, float]:
    """Return c and d of c m + d, fitted to the median digits that poles lose: log10 kappa."""
    degrees = [m for m in found if m >= 3]
    lost = [float(np.median(np.log10(found[m][0].kappa))) for m in degrees]
    c, d = np.polyfit(degrees, lost, 1)
    return float(c), float(d)


def _of(found: MeasuredData, i: int) -> dict[int, PadeOfRounded]:
    """Return what the data of index i gave, by m."""
    return {m: row[i] for m, (_, row) in found.items()}


def _names(found: MeasuredData) -> list[str]:
    return [one.data.name for one in next(iter(found.values()))[1]]


def trusted(rows: Mapping[int, PadeOfRounded]) -> int:
    """Return the largest m up to which every pole stays within KEPT; -1 if there is none."""
    best = -1
    for m in sorted(rows):
        if max(rows[m].moved) > KEPT:
            break
        best = m
    return best


def _first_spurious(rows: Mapping[int, PadeOfRounded]) -> int | None:
    return next((m for m in sorted(rows) if rows[m].spurious), None)


def _up_to(values: Sequence[float], end: int) -> float:
    """Return the largest value at the v* up to `end`."""
    return max(x for v, x in zip(V_STARS, values, strict=True) if v <= end)


def best(rows: Mapping[int, PadeOfRounded], end: int) -> tuple[int, float]:
    """Return the m, with its error, that is nearest to the exact function on (0, end], of those without poles there."""
    errors = {m: _up_to(row.total, end) for m, row in rows.items() if row.p.usable}
    m = min(errors, key=lambda m: errors[m])
    return m, errors[m]


def _predicted(found: MeasuredData, u: Fraction) -> int:
    """Return the largest m whose median pole the fit lets move by no more than KEPT."""
    c, d = slope(found)
    return math.floor((math.log10(KEPT) - math.log10(u) - d) / c)


def _summary(found: MeasuredData) -> str:
    c, d = slope(found)
    names, last = _names(found), max(found)
    rows = [_of(found, i) for i in range(len(names))]
    held = ", ".join(f"{trusted(row)} ({name})" for name, row in zip(names, rows, strict=True))
    spurious = ", ".join(f"{len(row[last].spurious)} ({name})" for name, row in zip(names, rows, strict=True))
    near = max(_up_to(exact.amplification, NEAR) for exact, _ in found.values())
    far = _up_to(found[last][0].amplification, FAR)
    optimum = ", ".join(
        f"[{m}/{m + 3}] ({name}: {error:.0e})"
        for name, (m, error) in ((name, best(row, FAR)) for name, row in zip(names, rows, strict=True))
    )
    m, (true_pole, moved) = LANDMARKS[0][0], _landmark(found, *LANDMARKS[0])
    stays = ", ".join(f"{x:.0e} ({name})" for name, x in zip(names, moved, strict=True))
    kept_everywhere = sum(lasting(row) for _, row in found.values())
    return (
        f"The median pole of [m/m+3] loses {c:.2f} m {signed(d)} digits: data of D digits hold the poles to two "
        f"digits up to about m = (D {signed(-2 - d)})/{c:.2f}. All poles stay within {KEPT:.0%} up to m = {held}. "
        f"Beyond, rounding makes Froissart doublets: [{last}/{last + 3}] has {spurious} that the exact series does "
        f"not give it. Of all such doublets, {kept_everywhere} are found in all the other precisions too. A true pole "
        "stays fixed once the data have more digits than it loses, even the doublet of the exact series in "
        f"[{m}/{m + 3}] at v* = {_place(true_pole)}: it moves by {stays} of its modulus. Up to v* = {NEAR}, eps is "
        f"well conditioned: a relative error of the h_k is amplified at most {at_most(near, 2)} times, at any m; but "
        f"up to v* = {FAR} by 10^{math.log10(far):.0f} at m = {last}. Of those without a pole or zero at any v* > 0, "
        f"nearest to the exact function on (0, {FAR}] are {optimum}."
    )


def _landmark(found: MeasuredData, m: int, place: complex) -> tuple[complex, tuple[float, ...]]:
    """Return the pole of [m/m+3] nearest to a place, and how far it moved in each of the rounded data."""
    exact, row = found[m]
    i = _nearest_to(exact, place)
    return complex(exact.upper[i].value), tuple(one.moved[i] for one in row)


def _nearest_to(exact: SensitivePade, place: complex) -> int:
    return min(range(len(exact.upper)), key=lambda i: abs(complex(exact.upper[i].value) - place))


def _by_precision(found: MeasuredData) -> ResultTable:
    header = (
        "data",
        "all poles kept up to m",
        "predicted",
        "first spurious doublet at m",
        "spurious doublets, all m",
        "of these in the next data too",
        "m with a positive pole only by rounding",
        f"best on (0, {FAR}]",
        "its error",
    )
    rows: list[tuple[Cell, ...]] = []
    for i, name in enumerate(_names(found)):
        row, after = _of(found, i), _of(found, i + 1 if i + 1 < len(_names(found)) else i - 1)
        pairs = [(pair, after[m]) for m, one in row.items() for pair in one.spurious]
        again = sum(nearest(pair.pole, other.p.poles) <= KEPT for pair, other in pairs)
        first = _first_spurious(row)
        m, error = best(row, FAR)
        rows.append(
            (
                name,
                trusted(row),
                _predicted(found, row[m].data.u),
                "none" if first is None else first,
                len(pairs),
                again,
                _listed(m for m, one in row.items() if _positive_by_rounding(found[m][0].p, one)),
                f"[{m}/{m + 3}]",
                f"{error:.1e}",
            )
        )
    return ResultTable("Results for each precision of the data", header, tuple(rows))


def _positive_by_rounding(p: Pade, row: PadeOfRounded) -> bool:
    return any(pole.positive and nearest(pole, p.poles) > KEPT for pole in row.p.poles)


def _listed(numbers: Iterable[int]) -> str:
    """Return how many there are, and the first of them."""
    found = list(numbers)
    if not found:
        return "none"
    more = " …" if len(found) > SHOWN else ""
    return f"{len(found)}: {' '.join(map(str, found[:SHOWN]))}{more}"


def _by_degree(found: MeasuredData) -> ResultTable:
    names = _names(found)
    header = (
        "m",
        "digits a pole loses: least",
        "median",
        "most",
        "doublets, exact",
        *(f"spurious, {name}" for name in names),
        *(f"error on (0, {FAR}], {name}" for name in names),
    )
    rows: list[tuple[Cell, ...]] = []
    for m in [m for m in found if len(found) <= 40 or m <= 10 or m % 5 == 0]:
        exact, row = found[m]
        lost = np.log10(exact.kappa)
        rows.append(
            (
                m,
                *(f"{x:.1f}" for x in (lost.min(), float(np.median(lost)), lost.max())),
                len(exact.p.doublets()),
                *(len(one.spurious) for one in row),
                *(f"{_up_to(one.error, FAR):.0e}" for one in row),
            )
        )
    return ResultTable(
        "Poles and doublets of [m/m+3], and the error that rounded data make in eps", header, tuple(rows)
    )


def _landmarks(found: MeasuredData) -> ResultTable:
    """Return how far some poles moved: positive ones, and the one nearest to the singularity of eps."""
    wanted = [(f"positive pole of [{m}/{m + 3}]", m, place) for m, place in LANDMARKS]
    wanted.append((f"pole of [{DRAWN_M}/{DRAWN_M + 3}] nearest to the singularity", DRAWN_M, singularity(found)))
    rows: list[tuple[Cell, ...]] = []
    for name, m, place in wanted:
        exact = found[m][0]
        i = _nearest_to(exact, place)
        pole, moved = _landmark(found, m, place)
        residue = exact.upper[i].residue
        size = "" if residue is None else f"{abs(complex(residue)):.0e}"
        rows.append((name, _place(pole), size, f"{exact.kappa[i]:.0e}", *(f"{x:.0e}" for x in moved)))
    header = ("pole", "v*", "residue", "kappa", *_names(found))
    return ResultTable("Displacement of some poles, relative to their modulus", header, tuple(rows))


def singularity(found: MeasuredData) -> complex:
    """Return the singularity of eps nearest to 0, to two digits, as the last four h_k have it."""
    return from_four([_float(h_k) for h_k in found[max(found)][0].p.h])


def _place(z: complex) -> str:
    return f"{z.real:.6f}" if abs(z.imag) < 1e-12 else f"{z.real:.4f}{z.imag:+.4f}i"


def _pole_chart(found: MeasuredData) -> Chart:
    exact, row = found[DRAWN_M]
    z = singularity(found)
    drawn = [*((one.data.name, one.p) for one in row if one.data.name != DOUBLE), ("exact series", exact.p)]
    points = [_points(name, [complex(pole.value) for pole in p.poles]) for name, p in drawn]
    ends = _points("singularity of eps", [z, z.conjugate()])
    return Chart(f"Poles of [{DRAWN_M}/{DRAWN_M + 3}]", "Re v*", "Im v*", (*points, ends), "linear", "linear")


def _points(name: str, places: Sequence[complex]) -> ChartCurve:
    inside = [z for z in places if max(abs(z.real), abs(z.imag)) <= DRAWN_SQUARE]
    return curve(name, [z.real for z in inside], [z.imag for z in inside], "points")


def _movement_chart(found: MeasuredData) -> Chart:
    curves = []
    for i, name in enumerate(_names(found)):
        rows = [(found[m][0], found[m][1][i]) for m in MOVED_M if m in found]
        pairs = [(k * float(one.data.u), x) for exact, one in rows for k, x in zip(exact.kappa, one.moved, strict=True)]
        curves.append(curve(name, [x for x, _ in pairs], [y for _, y in pairs], "points"))
    ends = (min(min(c.x) for c in curves), 1.0)
    label = "predicted at worst (relative to the modulus)"
    return Chart(
        "Displacement of poles",
        label,
        "displacement",
        (*curves, curve("worst case", ends, ends, "bound")),
    )


def _error_chart(found: MeasuredData) -> Chart:
    exact, row = found[ERROR_M]
    v = [float(v) for v in V_STARS]
    curves = []
    for one in row:
        worst = [float(one.data.u) * x for x in exact.amplification]
        curves += [curve(one.data.name, v, one.error), curve(f"worst case, {one.data.name}", v, worst, "bound")]
    title = f"Error of eps in [{ERROR_M}/{ERROR_M + 3}] from rounded data"
    return Chart(title, "v*", "relative error", tuple(curves), "linear", "log")


def _checks(found: MeasuredData) -> tuple[Check, ...]:
    rows = [(exact, one) for exact, row in found.values() for one in row]
    parts = [
        x / (k * float(one.data.u))
        for exact, one in rows
        for k, x in zip(exact.kappa, one.moved, strict=True)
        if k * float(one.data.u) < SMALL
    ]
    return (
        Check.within(
            "change of eps by rounding, relative to its proven bound: largest at any v*",
            max(one.error_proven for _, one in rows),
        ),
        Check.within(
            "every pole, exact or from rounded data, has a pole of the other approximant within a proven distance: "
            "largest distance relative to it",
            max(one.proven for _, one in rows),
        ),
        Check(
            f"poles whose movement is predicted to be below {SMALL:g} move no further: largest part of the prediction, "
            f"a worst case of first order (a factor {HIGHER_ORDERS:g} for the higher orders)",
            max(parts),
            "<=",
            HIGHER_ORDERS,
        ),
        Check(
            "rounding makes Froissart doublets that the exact approximants do not have: their number",
            sum(len(one.spurious) for _, one in rows),
            ">=",
            1,
        ),
        Check.never(
            f"of these, how many are there within {KEPT:.0%} in all other precisions of the data: other roundings do "
            "not reproduce a doublet",
            sum(lasting(row) for _, row in found.values()),
        ),
    )


CASE = Case(
    "data-precision",
    "Padé from rounded coefficients",
    "The coefficients h_k are rounded to 6, 10 or 15 digits, or to double precision. How large is the error of eps, "
    "which poles are genuine, and which are Froissart doublets made by rounding?",
    _run,
)
