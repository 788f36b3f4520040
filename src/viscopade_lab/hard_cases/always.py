r"""What always holds: 0 < eps <= 1, eps falls with v*, eps(0) = 1, and so on, looked for where it could fail.

Every function here takes points and returns what was found there; the case samples points with a seed, and the tests
let hypothesis look for worse ones.

eps itself falls strictly, and this is proven between any two v* that are enclosed apart. A computed eps cannot: between
neighbouring v* it may rise by what its two errors allow, and near v* = 1/16 it does, by one unit in the last place
(ulp), once in millions of pairs.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from decimal import ROUND_HALF_EVEN, Context, Decimal
from fractions import Fraction
from functools import partial
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from flint import acb, arb

from viscopade.arithmetic.balls import ball_of, working
from viscopade.arrays import double
from viscopade.arrays.checked import FloatArray
from viscopade.arrays.double import ULP
from viscopade.collision import exact, spheres
from viscopade.kernels import native
from viscopade.theory.pade import DegenerateError, Pade, Root, pade
from viscopade.theory.series import series
from viscopade_lab.hard_cases.double_trips import change_of_portion, log_uniform, v_star_of_all_sizes
from viscopade_lab.hard_cases.finding import Case, Cell, Chart, ChartCurve, Check, Outcome, ResultTable, binned, curve
from viscopade_lab.hard_cases.material_trips import proven_restitution
from viscopade_lab.hard_cases.round_trips import rounding_interval

SEED = 11
Array = npt.NDArray[Any]

FALLING, RISING = -1, 1
OF_V_STAR = {"epsilon": FALLING, "one_minus_epsilon": RISING, "x_max": FALLING, "tau_c": FALLING}

RISES = 0.06045712713593428
"""Here eps rises by 1 ulp to the next double (found among 16 million pairs)."""

# eps = (3/2)^(2/3) v*^(-10/3) for large v*; it is the smallest double, or half of it, at these v*.
_LOG_LEADING = 2 / 3 * math.log(1.5)
LAST_POSITIVE = math.exp(0.3 * (_LOG_LEADING + 1074 * math.log(2))) * (1 - 1e-9)
FIRST_ZERO = math.exp(0.3 * (_LOG_LEADING + 1075 * math.log(2))) * (1 + 1e-9)

# w = beta^5 speed in the table of `restitution`, and a beta whose powers are normal numbers there.
_W, _BETA = (2.0**-60, 2.0**60), (2.0**-30, 2.0**30)


# --- 0 < eps <= 1, and the sum ----------------------------------------------------------------------------------------


def out_of_range(epsilon: Array, v_star: FloatArray) -> int:
    """Return how many eps are not in (0, 1], or not 0 where they underflow; between the two ends both are right."""
    positive = (epsilon > 0) & (epsilon <= 1)
    right = np.where(
        v_star <= LAST_POSITIVE, positive, np.where(v_star >= FIRST_ZERO, epsilon == 0, positive | (epsilon == 0))
    )
    return int(np.count_nonzero(~right))


def wrong_at_rest() -> tuple[int, int]:
    """Return how many ways there are to ask for eps at v* = 0, and how many do not give 1."""
    zeros: list[Any] = [0, 0.0, -0.0, np.float32(0), np.array(0.0), [0.0]]
    answers = [double.epsilon(zero) for zero in zeros] + [1 - double.one_minus_epsilon(zero) for zero in zeros]
    for kind in (np.float64, np.float32):
        zero, other = kind(0), kind(1.5)
        answers += [native.restitution(speed, beta) for speed in (zero, -zero, other) for beta in (zero, -zero)]
        answers += [native.restitution(zero, other), native.restitution(-zero, other)]
    answers += [float(exact.collision(zero, 5).decimals()["epsilon"]) for zero in ("0", 0, -0.0, Fraction(0))]
    return len(answers), sum(not np.all(np.equal(answer, 1)) for answer in answers)


def sum_off(v_star: FloatArray) -> FloatArray:
    """Return |eps + (1 - eps) - 1|, computed exactly, in terms of what the two stated errors allow."""
    e, d = double.epsilon(v_star), double.one_minus_epsilon(v_star)
    total = e + d
    lost = np.where(e > d, (e - total) + d, (d - total) + e)
    allowed = sum(ULP[name] * np.spacing(np.nextafter(x, 2)) for name, x in (("epsilon", e), ("one_minus_epsilon", d)))
    return np.asarray(np.abs((total - 1) + lost) / allowed)


# --- from one number to the next --------------------------------------------------------------------------------------


def steps(function: Callable[[Array], Array], x: Array, places: int = 1) -> FloatArray:
    """Return f(next number) - f(x) in units in the last place of f(x)."""
    after = x
    for _ in range(places):
        after = np.nextafter(after, x.dtype.type(np.inf))
    before = function(x)
    with np.errstate(all="ignore"):
        return np.asarray((function(after) - before) / np.spacing(before), dtype=np.float64)


class WrongSteps(NamedTuple):
    """Steps of a function in the wrong direction, where it should rise or fall.

    Attributes
    ----------
    name : str
    pairs : int
        Of neighbours.
    wrong : int
        In the wrong direction.
    x, steps : array
        Where, and the steps in the wrong direction (0 or more) in ulp.
    limit : float
        What the errors of both numbers allow, in ulp.
    """

    name: str
    pairs: int
    wrong: int
    x: FloatArray
    steps: FloatArray
    limit: float

    @property
    def worst(self) -> float:
        """The largest step in the wrong direction, in ulp."""
        return float(self.steps.max(initial=0.0))


def wrong_steps(
    name: str, function: Callable[[Array], Array], direction: int, x: Array, limit: float, at: FloatArray | None = None
) -> WrongSteps:
    """Return the steps in the wrong direction; `at` is the v* at each x, if x is something else."""
    found = -direction * steps(function, x)
    found = np.where(np.isnan(found), np.inf, np.where(found > 0, found, 0.0))
    return WrongSteps(name, len(x), int(np.count_nonzero(found)), np.asarray(x if at is None else at), found, limit)


def _restitution_limit(form: str) -> float:
    """Return what two errors of `restitution` in its table may be, in ulp of eps; a type float is rounded once more."""
    both, last = proven_restitution(Fraction(13, 1000), Fraction(83))
    # An ulp is at least 2^-53 of a number; a float's own rounding is half an ulp, and one more if double straddles it.
    return 2 * (both + last) / 2.0**-53 if form == "double" else 1.0


def all_wrong_steps(generator: np.random.Generator, number: int) -> Iterator[WrongSteps]:
    """Look at neighbours, everywhere and where the panels of tables meet."""
    x = np.concatenate([_moderate(generator, number), [RISES]])
    for name, direction in OF_V_STAR.items():
        yield wrong_steps(name, getattr(double, name), direction, x, 2 * ULP[name])
    portion = np.concatenate([log_uniform(generator, 1e-300, 1, number // 2), generator.uniform(0, 1, number // 2)])
    portion = portion[portion < 1]
    for name, direction in (("epsilon", FALLING), ("one_minus_epsilon", RISING)):

        def inverse(p: Array, name: str = name) -> Array:
            return np.asarray(double.v_star_from(**{name: p}))

        at = inverse(portion)
        yield wrong_steps(f"v_star_from({name})", inverse, direction, portion, 2 * ULP["v_star_from"], at)
    for form, kind in (("double", np.float64), ("float", np.float32)):
        w, beta = log_uniform(generator, *_W, number), log_uniform(generator, 0.01, 100, number).astype(kind)
        speed = (w / beta.astype(np.float64) ** 5).astype(kind)
        v_star = w**0.1
        limit = _restitution_limit(form)
        of_speed = partial(_restitution, beta=beta)
        yield wrong_steps(f"restitution, speed, {form}", of_speed, FALLING, speed, limit, v_star)
        of_beta = partial(_restitution, speed)
        yield wrong_steps(f"restitution, beta, {form}", of_beta, FALLING, beta, limit, v_star)


def _restitution(speed: Array, beta: Array) -> Array:
    return np.asarray(native.restitution(speed, beta))


def _moderate(generator: np.random.Generator, number: int) -> FloatArray:
    """Return v* at which eps and 1 - eps are normal numbers."""
    x = v_star_of_all_sizes(generator, number)
    return x[(x > 1e-150) & (x < 1e90)]


# --- proven -----------------------------------------------------------------------------------------------------------


class MonotonePair(NamedTuple):
    """Whether it is proven that a pair of v* has what it should have, each 1 or 0."""

    v_star: str
    gap: float
    falls: bool
    rises: bool
    x_max_falls: bool
    tau_c_falls: bool
    between: bool
    sums: bool

    @property
    def holds(self) -> bool:
        """Whether all of it is."""
        return all(self[2:])


def monotone_pair(v_star: str, power: int) -> MonotonePair:
    """Compare the enclosures at v* and at v* (1 + 10^-power).

    The digits tell 1 - eps and x_max at both apart: for small v* x_max differs by about v*^2 times the gap.
    """
    near, gap = Fraction(v_star), Fraction(1, 10**power)
    digits = power + 6 + max(0, -2 * Decimal(v_star).adjusted()) + _digits_far(v_star)
    one, other = (exact.collision(v, digits) for v in (near, near * (1 + gap)))
    return MonotonePair(
        v_star,
        float(gap),
        bool(other.epsilon < one.epsilon),
        bool(other.one_minus_epsilon > one.one_minus_epsilon),
        bool(other.x_max < one.x_max),
        bool(other.tau_c < one.tau_c),
        all(bool(c.epsilon > 0) and bool(c.epsilon < 1) for c in (one, other)),
        all(bool((c.epsilon + c.one_minus_epsilon).contains(1)) for c in (one, other)),
    )


def _digits_far(v_star: str) -> int:
    """Return the digits that 1 - eps needs for large v*, where it changes by 10/3 eps times the gap."""
    return max(0, math.ceil(10 / 3 * (Decimal(v_star).adjusted() + 1)))


class NestedEnclosures(NamedTuple):
    """Enclosures with more and more digits.

    Attributes
    ----------
    v_star : str
    pairs : int
        Of enclosures of one number with fewer and more digits.
    not_nested, not_rounded : int
        Where the one does not contain the other; where its decimal is not the other's, rounded.
    """

    v_star: str
    pairs: int
    not_nested: int
    not_rounded: int


def nested_enclosures(v_star: str, digits: Sequence[int]) -> NestedEnclosures:
    """Compare enclosures of a collision with these numbers of digits, which grow."""
    found = [exact.collision(v_star, number) for number in digits]
    pairs = nested = rounded = 0
    for few, many in pairwise(found):
        context = Context(prec=few.digits, rounding=ROUND_HALF_EVEN, Emin=-(10**9), Emax=10**9)
        longer, shorter = many.decimals(), few.decimals()
        for name, ball in few.balls().items():
            pairs += 1
            nested += name in few.given or bool(ball.contains(many.balls()[name]))
            rounded += context.create_decimal(longer[name]) == Decimal(shorter[name])
    return NestedEnclosures(v_star, pairs, pairs - nested, pairs - rounded)


def _random_v_star(generator: np.random.Generator, low: int, high: int) -> str:
    return f"{generator.uniform(1, 10):.6f}e{int(generator.integers(low, high))}"


# --- scaling ----------------------------------------------------------------------------------------------------------


def scaled_by_powers_of_two(speed: FloatArray, beta: FloatArray, power: Array) -> int:
    """Return how many eps change in a bit when beta is multiplied by 2^power and speed by 2^(-5 power)."""
    other = native.restitution(np.ldexp(speed, -5 * power), np.ldexp(beta, power))
    return int(np.count_nonzero(native.restitution(speed, beta).view(np.int64) != other.view(np.int64)))


def scaled(speed: float, beta: float, factor: float) -> tuple[float, float, float]:
    """Return v*, by how much eps changes when beta grows by a factor and speed falls by its 5th power, and the limit.

    The new speed and beta are rounded, so that w = beta^5 speed changes a little; by how much is known exactly.
    """
    new_speed, new_beta = speed / factor**5, beta * factor
    w, new_w = (Fraction(b) ** 5 * Fraction(s) for s, b in ((speed, beta), (new_speed, new_beta)))
    moved = math.log1p(abs(float(new_w / w - 1))) / 10
    v_star = float(w) ** 0.1
    first, second = float(native.restitution(speed, beta)), float(native.restitution(new_speed, new_beta))
    both, last = proven_restitution(*(Fraction(v_star) * Fraction(n, 100) for n in (99, 101)))
    own = both * min(1.0, 1 / first - 1) + last
    limit = float(change_of_portion(np.array(v_star), np.array(1 - first), moved)) + 2 * own * (1 + 1e-9)
    return v_star, abs(second - first) / first, limit


# --- arrays -----------------------------------------------------------------------------------------------------------

FUNCTIONS: Mapping[str, Callable[[Any], Any]] = {
    **{name: getattr(double, name) for name in (*OF_V_STAR, "slope", "v_star_from")},
    "restitution": lambda x: native.restitution(x, 1.307),
    "restitution, by beta": lambda x: native.restitution(0.25, x),
    "restitution, float": lambda x: native.restitution(np.asarray(x).astype(np.float32), np.float32(1.307)),
}


def layouts(x: FloatArray) -> Iterator[tuple[str, Any, Callable[[Array], Array]]]:
    """Yield names, the same numbers laid out otherwise, and what brings the results back to the order of x.

    There is an even number of them.
    """
    n = len(x)
    spread = np.zeros(3 * n)
    spread[::3] = x
    shifted = np.frombuffer(b"\0" + x.tobytes(), dtype=np.uint8)[1:].view(np.float64)
    yield "strided", spread[::3], np.asarray
    yield "reversed", x[::-1], lambda r: r[::-1]
    yield "transposed", x.reshape(2, -1).T, lambda r: r.T.ravel()
    yield "Fortran order", np.asfortranarray(x.reshape(2, -1)), np.ravel
    yield "broadcast", np.broadcast_to(x, (3, n)), lambda r: r[2]
    yield "big-endian", x.astype(">f8"), np.asarray
    yield "not aligned", shifted, np.asarray
    yield "list", x.tolist(), np.asarray
    yield "one by one", None, np.asarray
    yield "in pieces", None, np.asarray


def changed_by_layout(name: str, x: FloatArray) -> int:
    """Return how many results differ in a bit between arrays of these numbers that are laid out otherwise."""
    function = FUNCTIONS[name]
    expected = np.asarray(function(x))
    wrong = 0
    for layout, given, back in layouts(x):
        if layout == "one by one":
            got = np.array([function(value) for value in x.tolist()], dtype=expected.dtype)
        elif layout == "in pieces":
            ends = np.minimum(np.cumsum(range(len(x) + 1)), len(x))
            parts = [function(x[i:j]) for i, j in pairwise(ends) if i < j]
            got = np.concatenate(parts)
        else:
            got = back(np.asarray(function(given)))
        wrong += int(got.dtype != expected.dtype) + int(np.count_nonzero(got != expected))
    empty = function(np.empty((0, 3)))
    zero_dimensional = function(np.array(x[0]))
    return wrong + sum(
        map(int, [np.shape(empty) != (0, 3), zero_dimensional != expected[0], np.ndim(zero_dimensional) != 0])
    )


# --- Padé approximants ------------------------------------------------------------------------------------------------


class ExpandedPade(NamedTuple):
    """What an approximant's decimals give when they are expanded, and what its roots are like.

    Attributes
    ----------
    label : str
    coefficients : int
        Of the series that were compared.
    outside : int
        That are not within the enclosures that the rounded decimals give.
    width : float
        The widest of these enclosures, relative to h_k.
    roots, without_conjugate, missing : int
        Poles and zeros; those that are not real and whose conjugate is no root; those that are too few or too many,
        or whose product is not the quotient of the outer coefficients.
    """

    label: str
    coefficients: int
    outside: int
    width: float
    roots: int
    without_conjugate: int
    missing: int


def expanded(m: int, n: int, digits: int) -> ExpandedPade:
    """Expand [m/n], from its decimals, by division, and compare with the series; look at its poles and zeros.

    Raises
    ------
    DegenerateError
        If there is no such approximant.
    """
    approximant = pade(m, n, digits)
    order = approximant.contact_order
    with working(8 * digits):
        a, b = ([_rounded(text, digits) for text in part] for part in approximant.decimals())
        quotient = divided(a, b, order)
        h = [_rounded(text, digits) for text in series(order, digits).decimals()]
        outside = sum(not x.overlaps(y) for x, y in zip(quotient, h, strict=True))
        width = max(float((x.rad() / abs(y.mid())).mid()) for x, y in zip(quotient, h, strict=True) if y != 0)
    roots = [*approximant.poles, *approximant.zeros]
    return ExpandedPade(
        approximant.label, order + 1, outside, width, len(roots), without_conjugate(approximant.poles)
        + without_conjugate(approximant.zeros), _missing(approximant, digits),
    )  # fmt: skip


def _rounded(text: str, digits: int) -> arb:
    """Return the ball of the numbers that a decimal may be the rounding of; an integer is exact."""
    number = Decimal(text)
    if number == number.to_integral_value():
        return arb(text)
    low, high = map(ball_of, rounding_interval(text, digits))
    return low.union(high)


def divided(a: Sequence[arb], b: Sequence[arb], order: int) -> list[arb]:
    """Return the coefficients of a/b up to an order, b_0 = 1."""
    result: list[arb] = []
    for k in range(order + 1):
        known = sum((b[j] * result[k - j] for j in range(1, min(k, len(b) - 1) + 1)), arb(0))
        result.append((a[k] if k < len(a) else arb(0)) - known)
    return result


def without_conjugate(roots: Sequence[Root]) -> int:
    """Return how many roots are not real and have no partner among the others."""
    return sum(
        not root.real
        and not any(
            _is_conjugate(root.value, other.value) and root.multiplicity == other.multiplicity for other in roots
        )
        for root in roots
    )


def _is_conjugate(first: acb, second: acb) -> bool:
    return bool(first.real.overlaps(second.real)) and bool(first.imag.overlaps(-second.imag))


def _missing(approximant: Pade, digits: int) -> int:
    """Compare roots with coefficients: as many as the degree, and their product (Vieta)."""
    wrong = 0
    for coefficients, roots in ((approximant.b, approximant.poles), (approximant.a, approximant.zeros)):
        degree = max(k for k, c in enumerate(coefficients) if c != 0)
        wrong += abs(sum(root.multiplicity for root in roots) - degree)
        with working(8 * digits):
            product = acb(1)
            for root in roots:
                product *= (-root.value) ** root.multiplicity
            wrong += not (product * coefficients[degree]).overlaps(acb(coefficients[0]))
    return wrong


def expansions(generator: np.random.Generator, number: int, largest: int, digits: int) -> list[ExpandedPade]:
    """Look at approximants of random degrees."""
    found: list[ExpandedPade] = []
    while len(found) < number:
        m, n = (int(k) for k in generator.integers(0, largest + 1, 2))
        try:
            found.append(expanded(m, n, digits))
        except DegenerateError:
            continue
    return found


# --- the case ---------------------------------------------------------------------------------------------------------


def run(thorough: bool) -> Outcome:
    """Look for exceptions at points that a seed gives."""
    generator = np.random.default_rng(SEED)
    number = 1_000_000 if thorough else 60_000
    wrong = list(all_wrong_steps(generator, number))
    everywhere = v_star_of_all_sizes(generator, number)
    outside = out_of_range(np.asarray(double.epsilon(everywhere)), everywhere)
    kernel = _kernel_out_of_range(generator, number)
    sums = (x := _moderate(generator, number), sum_off(x))
    orders = [
        monotone_pair(_random_v_star(generator, *((-4, 15) if thorough else (-3, 6))), int(generator.integers(1, 9)))
        for _ in range(20 if thorough else 6)
    ]
    digits = (5, 10, 20, 40, 80) if thorough else (5, 10, 20, 40)
    growths = [
        nested_enclosures(_random_v_star(generator, -30, 12 if thorough else 4), digits)
        for _ in range(12 if thorough else 4)
    ]
    w, beta = log_uniform(generator, *_W, number), log_uniform(generator, *_BETA, number)
    bits = scaled_by_powers_of_two(w / beta**5, beta, generator.integers(-20, 21, number))
    others = [_random_scaled(generator) for _ in range(10_000 if thorough else 1_000)]
    sample = np.minimum(log_uniform(generator, 1e-12, 1.0, 300), 1.0)
    layout = {name: changed_by_layout(name, sample) for name in FUNCTIONS}
    found = expansions(generator, 20 if thorough else 6, 15 if thorough else 8, 60)
    return Outcome(
        _summary(wrong, orders, growths, found),
        (_step_table(wrong), _order_table(orders, growths), _layout_table(layout, sample), _pade_table(found)),
        (_step_chart(wrong), _share_chart(sums, others), _fall_chart(generator, number)),
        (
            *_step_checks(wrong),
            Check.never("eps of v* in double precision outside (0, 1], or not 0 where it underflows", outside),
            Check.never("eps of speed and beta outside (0, 1], or not 0 where it underflows", kernel),
            Check.never("calls for eps at v* = 0 that do not return 1", wrong_at_rest()[1]),
            Check.within(
                "|eps + (1 - eps) - 1| in double precision, relative to the sum of both stated errors", sums[1].max()
            ),
            Check.never(
                "pairs of v* without a proof that 0 < eps < 1, that eps, x_max and tau_c fall, that 1 - eps rises, and "
                "that eps + (1 - eps) = 1",
                sum(not o.holds for o in orders),
            ),
            Check.never(
                "enclosures that do not contain the enclosure with more digits", sum(g.not_nested for g in growths)
            ),
            Check.never(
                "decimals that are not the correctly rounded decimals with more digits",
                sum(g.not_rounded for g in growths),
            ),
            Check.never("eps that change in a bit when beta and 1/speed^(1/5) are multiplied by 2^n", bits),
            Check.within(
                "change of eps when beta and 1/speed^(1/5) are multiplied by any number, relative to the proven errors",
                max(change / limit for _, change, limit in others),
            ),
            Check.never("results that depend on the layout of an array", sum(layout.values())),
            Check.never("coefficients of expanded Padé approximants that are not h_k", sum(e.outside for e in found)),
            Check(
                "relative uncertainty of these coefficients: they are compared to ten digits",
                max(e.width for e in found),
                "<=",
                1e-10,
            ),
            Check.never(
                "poles and zeros that are missing, or neither real nor accompanied by their complex conjugate",
                sum(e.without_conjugate + e.missing for e in found),
            ),
        ),
    )


def _kernel_out_of_range(generator: np.random.Generator, number: int) -> int:
    """Return how many eps of speed and beta are out of range, with v* anywhere in double's range."""
    beta, speed = log_uniform(generator, 1e-300, 1e300, number), log_uniform(generator, 1e-300, 1e300, number)
    return out_of_range(native.restitution(speed, beta), spheres.v_star(speed, beta))


def _random_scaled(generator: np.random.Generator) -> tuple[float, float, float]:
    w, beta = float(log_uniform(generator, *_W, 1)[0]), float(log_uniform(generator, *_BETA, 1)[0])
    return scaled(w / beta**5, beta, float(log_uniform(generator, 1e-6, 1e6, 1)[0]))


def _summary(
    wrong: Sequence[WrongSteps],
    orders: Sequence[MonotonePair],
    growths: Sequence[NestedEnclosures],
    found: Sequence[ExpandedPade],
) -> str:
    rises = [w for w in wrong if w.wrong]
    words = "; ".join(f"{w.name} by up to {w.worst:g} ulp in {w.wrong} of {w.pairs:,} pairs" for w in rises)
    return (
        f"In double precision eps is in (0, 1] up to v* = {LAST_POSITIVE:.4g}, where it underflows. Some monotonic "
        f"functions step in the wrong direction between neighbouring numbers, within their stated errors: {words}. The "
        "others are monotonic at every pair tried. With enclosures, eps, x_max and tau_c are proven to fall in all "
        f"{sum(o.holds for o in orders)} of {len(orders)} pairs, as near as {min(o.gap for o in orders):g}; "
        f"{sum(g.pairs for g in growths)} enclosures contain the enclosure with more digits; exceptions: "
        f"{sum(g.not_nested for g in growths)}. {sum(e.coefficients for e in found)} coefficients of {len(found)} Padé "
        f"approximants, expanded again, agree with h_k; exceptions: {sum(e.outside for e in found)}."
    )


def _step_checks(wrong: Sequence[WrongSteps]) -> Iterator[Check]:
    for one in wrong:
        yield Check(
            f"{one.name}: largest step in the wrong direction between neighbours, in ulp; the limit is the sum "
            "of both errors",
            one.worst,
            "<=",
            one.limit,
        )


def _step_table(wrong: Sequence[WrongSteps]) -> ResultTable:
    rows: list[tuple[Cell, ...]] = []
    for one in wrong:
        where = f"{one.x[int(np.argmax(one.steps))]:.6g}" if one.wrong else ""
        rows.append((one.name, one.pairs, one.wrong, f"{one.worst:g}", f"{one.limit:.3g}", where))
    header = ("function", "pairs of neighbours", "wrong direction", "largest, ulp", "allowed, ulp", "at v*")
    return ResultTable("Steps to the neighbouring number", header, tuple(rows))


def _order_table(orders: Sequence[MonotonePair], growths: Sequence[NestedEnclosures]) -> ResultTable:
    rows: list[tuple[Cell, ...]] = []
    for one in orders[:12]:
        rows.append((one.v_star, f"pair, gap {one.gap:g}", "proven" if one.holds else "not proven"))
    for grown in growths[:12]:
        rows.append(
            (
                grown.v_star,
                f"{grown.pairs} pairs of digits",
                f"{grown.not_nested} not nested, {grown.not_rounded} not rounded",
            )
        )
    return ResultTable("Proven monotonicity and nested enclosures (a selection)", ("v*", "what", "found"), tuple(rows))


def _layout_table(layout: Mapping[str, int], x: FloatArray) -> ResultTable:
    count = sum(1 for _ in layouts(x)) + 2
    rows = tuple((name, count, len(x), wrong) for name, wrong in layout.items())
    return ResultTable(
        "Arrays in other memory layouts", ("function", "layouts", "numbers", "results that differ"), rows
    )


def _pade_table(found: Sequence[ExpandedPade]) -> ResultTable:
    rows = tuple(
        (e.label, e.coefficients, e.outside, f"{e.width:.1e}", e.roots, e.without_conjugate + e.missing)
        for e in found[:20]
    )
    header = ("approximant", "coefficients", "not h_k", "relative uncertainty", "poles and zeros", "not in order")
    return ResultTable("Padé approximants, expanded from 60 digits, and their roots", header, rows)


def _step_chart(wrong: Sequence[WrongSteps]) -> Chart:
    edges = np.linspace(-12, 12, 145)
    curves: list[ChartCurve] = []
    for one in wrong:
        if one.name.startswith(("epsilon", "one", "v_star")):
            curves.append(curve(one.name, *binned(one.x, one.steps, edges), "points"))
    limit = min(one.limit for one in wrong[:1])
    curves.append(curve("allowed for eps", [1e-12, 1e12], [limit, limit], "bound"))
    return Chart("Largest step in the wrong direction", "v*", "ulp", tuple(curves), y_scale="linear")


def _share_chart(sums: tuple[FloatArray, FloatArray], others: Sequence[tuple[float, float, float]]) -> Chart:
    edges = np.linspace(-12, 12, 145)
    v_star, change, limit = (np.array(part) for part in zip(*others, strict=True))
    return Chart(
        "Errors relative to their limits",
        "v*",
        "error/allowed",
        (
            curve("eps + (1 - eps) - 1", *binned(*sums, edges), "points"),
            curve("eps(speed, beta) at the same beta^5 speed", *binned(v_star, change / limit, edges), "points"),
            curve("allowed", [1e-12, 1e12], [1, 1], "bound"),
        ),
        y_scale="linear",
    )


def _fall_chart(generator: np.random.Generator, number: int) -> Chart:
    """Return by how much eps falls from one double to the next, with what the slope says."""
    edges = np.linspace(-4, 3, 43)
    x = log_uniform(generator, 1e-4, 1e3, min(number, 200_000))
    fall = -steps(lambda v: np.asarray(double.epsilon(v)), x)
    middles = 10 ** ((edges[1:] + edges[:-1]) / 2)
    place = np.digitize(np.log10(x), edges) - 1
    mean = np.bincount(place, fall, len(middles))[: len(middles)] / np.bincount(place, minlength=len(middles))
    slope = -double.slope(x) * np.spacing(x) / x * double.epsilon(x) / np.spacing(double.epsilon(x))
    expected = np.bincount(place, slope, len(middles))[: len(middles)] / np.bincount(place, minlength=len(middles))
    return Chart(
        "Mean decrease of eps to the next double",
        "v*",
        "ulp of eps",
        (curve("computed", middles, mean, "points"), curve("from the slope of ln eps", middles, expected, "line")),
    )


CASE = Case(
    "always",
    "Properties that always hold",
    "0 < eps <= 1, eps(0) = 1, eps falls and 1 - eps rises with v*, their sum is 1, enclosures are nested, eps depends "
    "on beta^5 speed only, the layout of arrays does not matter, Padé approximants expand to their series: does one of "
    "these properties fail at any v*, speed, beta, number of digits or degree?",
    run,
)
