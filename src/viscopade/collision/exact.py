r"""The exact coefficient of restitution eps(v*) and its inverse, to any number of proven digits.

The curve's parameter is k = sqrt(n_a) K. For a given k the two branches of `flow` lead to F (loading)
and P (unloading), and with them, for a law of contact (a, b), nu = (a+1)/(b+1),

    kappa = (2 m)^(1/nu-1) k F^(2/nu-1),    eps = P/F,    x_max = (2 m F^2)^(-1/(a+1)),    tau_c = 2 m F x_max T,
    (1 - eps^2) F^2 = r_c^n_a/n_a + k W,    r_c^d = k P (or r_c = 0 if nothing is delayed),

for the paper's law kappa = v*^2 = 2^(-4/5) k F^(1/5), x_max = (2 F)^(-4/5), r_c^2 = k P. T and W are integrals over
both branches of positive functions, so that 1 - eps loses no digits however small kappa is. From v* the collision is
integrated in time, which gives k. From eps, and for other laws, Newton's method with the derivative of the flow finds a
k whose eps (or kappa) is nearly the wanted one. The numbers at this k are then enclosed (`validation`), and bounds of
the derivatives with respect to ln k, which hold for every k, cover the remaining difference.
docs/theory/exact-function.md has the proofs; "step" in this module is a section of it.

Numbers are FLINT's balls (`arb`, a middle and a radius); `working(bits)` sets their precision within a block. A
`Dyadic` is a dyadic number, exactly. 64, 96 or 128 bits are for numbers that become doubles or start Newton's method:
any number above a double's 53 would do.

For the paper's law eps, 1 - eps and v*(eps) are first looked up in a table of proven polynomials, which determines them
to 37 digits or so (`exact_table`). Such a collision is integrated as above when x_max or tau_c is first asked for.

The end condition is that of the law; for the paper's law contact ends where the force vanishes (the paper's Eq. 6).
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable
from dataclasses import dataclass
from decimal import ROUND_HALF_EVEN, Context, Decimal
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Any, SupportsIndex

from flint import arb, fmpz

from viscopade import arguments
from viscopade.arithmetic.balls import Determined, ball_of, bits_for, decimal_string, rational_power, to_mpf, working
from viscopade.arrays import double
from viscopade.collision import exact_table
from viscopade.collision.flow import Branch, Dyadic, Motion, NoEndError, collide, integrate
from viscopade.collision.panel_proof import EXACT
from viscopade.collision.validation import Ends, ends
from viscopade.progress import track
from viscopade.theory.law import VISCOELASTIC, Law, law_of

if TYPE_CHECKING:
    from mpmath import mp

Exact = Any
"""A number taken exactly: str (decimal), int, float, Fraction, Decimal, mpmath.mpf or a NumPy scalar."""

# Nothing here is part of a proof: with other numbers the digits are the same, found in more time or attempts.
MAX_ATTEMPTS = 12  # to determine all digits, with more bits each time; a choice
GUARD_BITS = 32  # additional bits of ball arithmetic, for rounding; a choice
GUARD_DIGIT_BITS = 12  # so that an enclosure contains a boundary of rounding in about one of 2^12 cases only
LEAST_ACCURACY = 30  # with fewer bits, the end of unloading may not be found for large k
LOW_ACCURACY = 60  # bits of a number that becomes a double
LOST_BITS = 4  # bits by which a step of Newton's method falls short of doubling the correct ones
LEAST_KNOWN = 8  # bits of k, from which Newton's method converges quadratically
MAX_STEPS = 100  # of Newton's method from a rough guess; a choice
MOST_IN_TIME = math.log(1e4)  # of ln kappa: beyond, the many pieces of loading take longer than Newton's method
START_BITS = 32  # by which k and the speed at first contact are more accurate than the integration
# For the progress bar only: a step of Newton's method takes like bits^2.4, the proof as long as 2.5 of them, and an
# integration in time as long as three of its proofs (measured).
COST_POWER, PROOF_COST = 2.4, 2.5
COLLISION_COST = 3.0
LARGEST_POWER_BITS = 7000  # bits of k^n_a, beyond which an integration would take minutes

_SPEEDS = "0, infinity, or a number from 1e-1000 to 1e100"
_BETAS = "0, or a number from 1e-1000 to 1e100"
_SPEEDS_AT = "a number from 1e-1000 to 1e100"
_RESTITUTIONS = "1, or a number from 1e-330 to 1 - 1e-1990"
_LOSSES = "0, or a number from 1e-1990 to 1 - 1e-330"


@dataclass(frozen=True, eq=False)
class Collision(Determined):
    """One collision in scaled units (the paper's Eq. 9), every number a proven enclosure.

    Attributes
    ----------
    digits : int
        Significant digits to which every number is determined.
    v_star : flint.arb
        v* = kappa^(1/law.d), beta^(1/2) v^(1/10) for the paper's law, >= 0; may be infinite.
    epsilon : flint.arb
        Coefficient of restitution (the paper's Eq. 5).
    one_minus_epsilon : flint.arb
        1 - epsilon, without cancellation.
    x_max : flint.arb
        Maximal compression.
    tau_c : flint.arb
        Duration of contact (the paper's Eq. 6).
    fractions : dict
        The numbers among them that are known exactly, as fractions.
    beta : flint.arb, optional
        Damping (the paper's Eq. 8) in (time/length)^(1/5), if the speed is given.
    kappa : flint.arb, optional
        Damping of the scaled equation, if it is given or the law is not the paper's.
    """

    digits: int
    v_star: arb
    epsilon: arb
    one_minus_epsilon: arb
    x_max: arb
    tau_c: arb
    fractions: dict[str, Fraction]
    beta: arb | None = None
    kappa: arb | None = None

    def __post_init__(self) -> None:
        """Refuse enclosures that cannot be those of one collision, or that leave a digit open."""
        if not (self.epsilon + self.one_minus_epsilon).contains(1):
            raise ValueError("epsilon and one_minus_epsilon do not belong together")
        self._require_determined(self.balls())

    def _require_determined(self, names: Iterable[str]) -> None:
        """Raise ValueError if an enclosure contains numbers of different decimals."""
        undetermined = [name for name in names if self._decimal(name) is None]
        if undetermined:
            raise ValueError(f"enclosures are too wide for {self.digits} digits: {', '.join(undetermined)}")

    def proven(self) -> Hashable:
        """Return the decimals to all digits."""
        return self.digits, *self.decimals().items()

    def balls(self) -> dict[str, arb]:
        """Return the enclosures by name."""
        enclosures = {name: getattr(self, name) for name in (*NAMES, "beta", "kappa")}
        return {name: ball for name, ball in enclosures.items() if ball is not None}

    def decimals(self) -> dict[str, str]:
        """Return the numbers by name as decimal strings, correctly rounded to `digits`."""
        return {name: str(self._decimal(name)) for name in self.balls()}

    def mpf(self) -> dict[str, mp.mpf]:
        """Return the numbers by name as mpmath numbers, of relative error below 5 10^-digits."""
        from mpmath import mp

        return {name: to_mpf(ball) if ball.is_finite() else mp.inf for name, ball in self.balls().items()}

    def floats(self) -> dict[str, float]:
        """Return the numbers by name as the doubles nearest to the decimals."""
        return {name: float(text) for name, text in self.decimals().items()}

    def _decimal(self, name: str) -> str | None:
        """Return the number of this name, rounded to `digits`; None if its enclosure does not determine it."""
        # A fraction is rounded itself: an enclosure of a number with few digits may contain a tie.
        if name in self.fractions:
            return _rounded(self.fractions[name], self.digits)
        ball: arb = getattr(self, name)
        # Arguments end at 1e100 (`_in_range`): what is above 1e1000 is taken for infinity itself.
        if name in ("v_star", "kappa") and ball > 10**1000:
            return "inf"
        return decimal_string(ball, self.digits)


NAMES = ("v_star", "epsilon", "one_minus_epsilon", "x_max", "tau_c")


class _Tabulated(Collision):
    """A collision whose balls are from the table; it is integrated when x_max or tau_c is first asked for."""

    problem: _Problem

    def __init__(self, problem: _Problem, digits: int, balls: dict[str, arb]) -> None:
        vars(self).update(
            {"beta": None, "kappa": None, **balls}, digits=digits, fractions=problem.fractions, problem=problem
        )
        self._require_determined(balls)

    @cached_property
    def _integrated(self) -> Collision:
        """The same collision by another route, with which the table must agree.

        Raises
        ------
        OSError
            If it does not: a row is wrong.
        """
        # v*, eps and 1 - eps, the first three names, are in the table, too.
        integrated = _determined(self.problem, self.digits)
        if not all(getattr(integrated, name).overlaps(vars(self)[name]) for name in NAMES[:3]):
            raise OSError(f"{EXACT} does not agree with an integration: run python -m tools.exact_table")
        return integrated

    @cached_property
    def x_max(self) -> arb:
        return self._integrated.x_max

    @cached_property
    def tau_c(self) -> arb:
        return self._integrated.tau_c


def collision(
    v_star: Exact = None,
    digits: SupportsIndex = 30,
    *,
    kappa: Exact = None,
    beta: Exact = None,
    speed: Exact = None,
    law: Law | str = VISCOELASTIC,
) -> Collision:
    """Return the proven numbers of the collision at v*, at a kappa, or at a speed and a beta.

    Parameters
    ----------
    v_star : str, int, float, Fraction, Decimal, mpmath.mpf or NumPy scalar
        0, infinity, or from 1e-1000 to 1e100. It is taken exactly: a string is a decimal number and never becomes a
        float.
    digits : int
        Significant digits, 1 to 5000.
    kappa : like v_star
        Instead of v_star = kappa^(1/law.d): the damping in the scaled equation, 0 or from 1e-1000 to 1e100.
    beta, speed : like v_star
        Both instead of v_star: beta (the paper's Eq. 8) in (time/length)^(1/5), and the impact speed in length/time,
        from 1e-1000 to 1e100, or 0. For another law, kappa = beta speed^(2/nu-1).
    law : Law or str
        Law of contact, or its name or exponents (`law_of`).

    Returns
    -------
    Collision

    Raises
    ------
    TypeError, ValueError
        If not exactly one of v_star, kappa, and both beta and speed, is given; if a number or digits are out of range;
        if the law is not known, or contact does not end with this kappa.
    """
    # Each kind of input becomes kappa = beta speed^(2 c), with the numbers that are known exactly as fractions. 30
    # digits are a choice: a double has 16, the table 39.
    digits, contact_law = arguments.digits(digits), law_of(law)
    inputs = (v_star is not None, kappa is not None, beta is not None, speed is not None)
    # v*: kappa = v*^d.
    if inputs == (True, False, False, False):
        if _is_infinite(v_star):
            return _at_infinity(digits, contact_law)
        number = arguments.exact_number("v_star", v_star, _SPEEDS, _in_range)
        return _at_speed(
            _Speed(
                number**contact_law.d,
                Fraction(1),
                {"v_star": number, **_named(contact_law, number**contact_law.d)},
                contact_law,
            ),
            digits,
        )
    # kappa: v* = kappa^(1/d) may be a fraction, too.
    if inputs == (False, True, False, False):
        number = arguments.exact_number("kappa", kappa, _BETAS, _in_range)
        root = _rational_root(number, contact_law.d)
        exact = {"kappa": number} if root is None else {"kappa": number, "v_star": root}
        return _at_speed(_Speed(number, Fraction(1), exact, contact_law), digits)
    # beta and the speed: v* = (beta speed^(2 c))^(1/d). For c < 0 (nu > 2) kappa grows without bound as the speed goes
    # to 0, for c = 0 it does not depend on it.
    if inputs == (False, False, True, True):
        beta_number = arguments.exact_number("beta", beta, _BETAS, _in_range)
        velocity = arguments.exact_number("speed", speed, _BETAS, _in_range)
        if contact_law.c <= 0 and velocity == 0:
            raise ValueError("speed is 0: expected a number > 0, because kappa does not vanish with the speed")
        root = _rational_root_of_product(beta_number, velocity, contact_law)
        exact = {"beta": beta_number} if root is None else {"beta": beta_number, "v_star": root}
        return _at_speed(_Speed(beta_number, velocity, exact, contact_law), digits)
    raise TypeError("expected exactly one of v_star, kappa, and both beta and speed")


def _at_speed(problem: _Speed, digits: int) -> Collision:
    """Return the collision of a problem; without damping or at rest it is elastic."""
    if problem.beta * problem.speed == 0:
        return _elastic(digits, problem.law, problem.fractions.get("beta"), "kappa" in problem.fractions)
    return _collision(problem, digits)


def _require_moderate(problem: _Speed) -> None:
    """Raise ValueError if k ~ kappa^(nu/2) of a problem is so large that its integration would take minutes."""
    # The limit is one of k^n_a: ln k <= LARGEST_POWER_BITS ln 2/n_a.
    n_a, law = Motion.from_law(problem.law).n_a, problem.law
    with working(128):
        log_kappa = float(problem.log_kappa())
        log_k = float(_k_from_limits(log_kappa, law)[0].log())
    excess = log_k - LARGEST_POWER_BITS * math.log(2) / n_a
    if excess > 0:
        # The largest kappa by kappa ~ k^(2/nu), as a power of ten; that of v* = kappa^(1/d) is 2 per cent lower
        # (10^-0.01), because two digits are printed.
        largest = (log_kappa - excess * 2 / float(law.nu)) / math.log(10)
        root = f", or v_star up to {10.0 ** (largest / law.d - 0.01):.2g}" if law.d > 1 else ""
        raise ValueError(
            f"kappa is about 1e{round(log_kappa / math.log(10))}: expected kappa up to 1e{math.floor(largest)}{root} "
            f"for the law {law}"
        )


def _named(law: Law, kappa: Fraction) -> dict[str, Fraction]:
    """Return kappa as a number to be shown, except for the paper's law, where only v* is shown."""
    return {} if law == VISCOELASTIC else {"kappa": kappa}


def epsilon(v_star: Exact, digits: SupportsIndex = 30, law: Law | str = VISCOELASTIC) -> mp.mpf:
    """Return eps(v*) as an mpmath number, to `digits` digits; arguments and errors as for `collision`.

    `print` shows 15 digits of it, mpmath's default; `mpmath.nstr(number, digits)` shows all.
    """
    return to_mpf(collision(v_star, digits, law=law).epsilon)


def one_minus_epsilon(v_star: Exact, digits: SupportsIndex = 30, law: Law | str = VISCOELASTIC) -> mp.mpf:
    """Return 1 - eps(v*), without cancellation, as `epsilon` returns eps(v*)."""
    return to_mpf(collision(v_star, digits, law=law).one_minus_epsilon)


def invert(
    epsilon: Exact = None,
    digits: SupportsIndex = 30,
    *,
    one_minus_epsilon: Exact = None,
    speed: Exact = None,
    law: Law | str = VISCOELASTIC,
) -> Collision:
    """Return the collision whose coefficient of restitution is `epsilon`.

    Parameters
    ----------
    epsilon : str, int, float, Fraction, Decimal, mpmath.mpf or NumPy scalar
        Greater than 0 (at least 1e-330) and at most 1, taken exactly.
    digits : int
        Significant digits, 1 to 5000.
    one_minus_epsilon : like epsilon
        In place of epsilon, because a float near 1 has few digits of 1 - epsilon.
    speed : like epsilon, optional
        Impact speed at which epsilon holds, from 1e-1000 to 1e100; the collision then also has a beta.
    law : Law or str
        Law of contact, or its name or exponents (`law_of`).

    Returns
    -------
    Collision

    Raises
    ------
    TypeError, ValueError
        If not exactly one of the two is given, a number or digits are out of range, or the law is not known.
    """
    # 30 digits: as for `collision`. eps as a fraction, from whichever of the two is given.
    digits, contact_law = arguments.digits(digits), law_of(law)
    if (epsilon is None) == (one_minus_epsilon is None):
        raise TypeError("expected exactly one of epsilon and one_minus_epsilon")
    if epsilon is not None:
        restitution = arguments.exact_number("epsilon", epsilon, "0 < epsilon <= 1", lambda number: 0 < number <= 1)
        if not _is_restitution(restitution):
            raise ValueError(arguments.refusal("epsilon", epsilon, _RESTITUTIONS))
    else:
        accepted = "0 <= one_minus_epsilon < 1"
        loss = arguments.exact_number("one_minus_epsilon", one_minus_epsilon, accepted, lambda number: 0 <= number < 1)
        restitution = 1 - loss
        if not _is_restitution(restitution):
            raise ValueError(arguments.refusal("one_minus_epsilon", one_minus_epsilon, _LOSSES))
    velocity = (
        None if speed is None else arguments.exact_number("speed", speed, _SPEEDS_AT, lambda v: v > 0 and _in_range(v))
    )
    # eps = 1 means kappa = 0; beta is then 0 at any speed.
    if restitution == 1:
        return _elastic(
            digits, contact_law, None if speed is None else Fraction(0), bool(_named(contact_law, restitution))
        )
    return _collision(_Restitution(restitution, velocity, contact_law), digits)


def _in_range(number: Fraction) -> bool:
    """Return whether a number is 0, or from 1e-1000 to 1e100: limits by hand, far beyond any experiment."""
    return number == 0 or Fraction(1, 10**1000) <= number <= 10**100


def _is_restitution(number: Fraction) -> bool:
    """Return whether eps is 1, or in the range of speeds: 1 - eps ~ v*^2 from 1e-1990, eps ~ v*^(-10/3) from 1e-330."""
    return number == 1 or Fraction(1, 10**330) <= number <= 1 - Fraction(1, 10**1990)


def _is_infinite(value: object) -> bool:
    """Return whether an argument is plus infinity, as a word or a number."""
    # Comparisons of foreign numbers may fail: these are not infinite, and refused later.
    if isinstance(value, str):
        return value.strip().lower().removeprefix("+") in ("inf", "infinity")
    try:
        return bool(value == math.inf)
    except (TypeError, ValueError, ArithmeticError):
        return False


def _rational_root(number: Fraction, n: int) -> Fraction | None:
    """Return the n-th root of a fraction >= 0, if it is a fraction, so that it can be rounded exactly."""
    # A reduced fraction is a power if numerator and denominator are; FLINT's roots of integers are rounded down.
    roots = [int(fmpz(integer).root(n)) for integer in (number.numerator, number.denominator)]
    root = Fraction(*roots)
    return root if root**n == number else None


def _rational_root_of_product(beta: Fraction, speed: Fraction, law: Law) -> Fraction | None:
    """Return v* = (beta speed^(2 c))^(1/d) if it is a fraction: (beta^5 v)^(1/10) for the paper's law."""
    power = 2 * law.c  # a fraction, 1/5 for the paper's law
    if speed == 0:
        return Fraction(0)
    # With 2 c = s/t: v* = (beta^t speed^s)^(1/(t d)).
    return _rational_root(beta**power.denominator * speed**power.numerator, power.denominator * law.d)


def _rounded(number: Fraction, digits: int) -> str:
    """Return a fraction as a decimal string, correctly rounded."""
    # Exponents to 10^9, so that nothing over- or underflows: numbers are between 1e-2000 and 1e100.
    context = Context(prec=digits, rounding=ROUND_HALF_EVEN, Emin=-(10**9), Emax=10**9)
    return str(context.divide(Decimal(number.numerator), Decimal(number.denominator))).lower()


# --- at a given k ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _AtK:
    """Proven numbers of the collision at a given k. Properties are to be used within `working`.

    `loading` and `unloading` have p at the end (F and P), the time integral of r^(m-1) ds and the work integral of
    p r^(n_b-1) dr of each half.
    """

    k: arb
    loading: Ends
    unloading: Ends
    law: Law = VISCOELASTIC

    @classmethod
    def enclosed(cls, branches: tuple[Branch, Branch], law: Law) -> _AtK:
        """Enclose the collision from loading and unloading."""
        forth, back = branches
        if forth.k.mantissa < 0 or back.k != Dyadic(-forth.k.mantissa, forth.k.exponent):
            raise ValueError("loading and unloading have different k")
        return cls(forth.k.ball(), ends(forth), ends(back), law)

    @property
    def motion(self) -> Motion:
        """The law's whole exponents n_a, n_b, m and d."""
        return Motion.from_law(self.law)

    @property
    def log_kappa(self) -> arb:
        """Ln kappa."""
        return _log_kappa(self.law, self.k, self.loading.p)

    @property
    def epsilon(self) -> arb:
        """P/F."""
        return self.unloading.p / self.loading.p

    @property
    def r_c(self) -> arb:
        """The r at which contact ends."""
        if not self.law.delayed or self.k == 0:
            return arb(0)
        return (self.k * self.unloading.p).root(self.motion.d)

    @property
    def one_minus_epsilon(self) -> arb:
        """(r_c^n_a/n_a + k W)/(F^2 (1 + eps)): a sum of positive terms."""
        n_a = self.motion.n_a
        lost = self.r_c**n_a / n_a + self.k * (self.loading.work + self.unloading.work)
        return lost / (self.loading.p**2 * (1 + self.epsilon))

    @property
    def log_odds(self) -> arb:
        """Ln((1 - eps)/eps)."""
        return self.one_minus_epsilon.log() - self.epsilon.log()

    @property
    def x_max(self) -> arb:
        """(2 m F^2)^(-1/(a+1))."""
        return rational_power(1 / (2 * self.motion.m * self.loading.p**2), 1 / (self.law.elastic + 1))

    @property
    def tau_over_x(self) -> arb:
        """tau_c/x_max = 2 m F T."""
        return 2 * self.motion.m * self.loading.p * (self.loading.time + self.unloading.time)

    @property
    def least_slope(self) -> arb:
        """A lower bound of -d ln eps/d ln k: k W_loading/(2 F^2) (step 5, inverse)."""
        return self.k * self.loading.work / (2 * self.loading.p**2)

    @property
    def unloading_slope(self) -> arb:
        """A bound of |d ln p/d ln k| in unloading for k nearby: 1, or more if the force is attractive."""
        if not self.motion.attractive:
            return arb(1)
        # With attraction P^2 changes by at most delta/n_a over delta in ln k: P'/P <= 1/(2 n_a P^2), and twice that for
        # a k nearby (step 10).
        slope = (1 / (self.motion.n_a * self.unloading.p**2)).max(arb(1))
        # Unloading with a larger k is a scaled one that began farther out: p k^(n_a/q), q = 2 n_b - n_a, does not fall.
        return slope if self.law.nu >= 2 else slope.min(ball_of(max(self.law.nu / (2 - self.law.nu), Fraction(1))))

    def restitution(self, delta: arb) -> dict[str, arb]:
        """Enclose eps and 1 - eps at any k whose logarithm differs by at most delta."""
        # eps = P/F: |d ln F/d ln k| <= 1 and that of P. Below 1/4 in all, P stays within the factor of
        # `unloading_slope`.
        slope = 1 + self.unloading_slope
        if not delta * slope < arb(1) / 4:
            raise ArithmeticError("k is too far off")
        epsilon = self.epsilon * _within(slope * delta)
        # |d ln(1 - eps)/d ln k| <= 3 for slope 2 (step 5): 2 from k W and F^2, and half of the slope from 1 + eps.
        loss = self.one_minus_epsilon * _within((2 + slope / 2) * delta)
        # eps from the smaller of both, whose error is smaller.
        return {"epsilon": 1 - loss if loss < arb(1) / 2 else epsilon, "one_minus_epsilon": loss}

    def course(self, delta: arb) -> dict[str, arb]:
        """Enclose x_max and tau_c at any k whose logarithm differs by at most delta."""
        # x_max = (2 m F^2)^-power with |d ln F/d ln k| <= 1, so |d ln x_max/d ln k| <= 2 power. tau_c = 2 m F x_max T
        # has a factor F^(1 - 2 power), the integrand r^(m-1)/p of T, and the motion of the end (steps 5 and 10).
        motion, power = self.motion, 1 / (self.law.elastic + 1)
        time = self.loading.time + self.unloading.time
        scale_slope = ball_of(abs(1 - 2 * power))
        sensitivity = scale_slope + self.unloading_slope + (self._end_sensitivity(time) if self.law.delayed else 0)
        # T and r_c, known at this k only, differ little at k nearby if delta is below an eighth of the inverse.
        if not delta * (sensitivity + motion.n_a) < arb(1) / 8:
            raise ArithmeticError("k is too far off")
        return {
            "x_max": self.x_max * _within(ball_of(2 * power) * delta),
            "tau_c": self.tau_over_x * self.x_max * _within(delta * sensitivity),
        }

    def _end_sensitivity(self, time: arb) -> arb:
        """Bound |d ln T/d ln k| by the motion of the end, where `time` is T: for large k the end hardly moves."""
        # k r_c^(m-d) y/(2 d T) with y <= 1 and k = r_c^d/P, twice that for a k nearby. Where r_c <= 1/2 damping is
        # weak, and this is the better bound.
        n_b, m, d, r_c = self.motion.n_b, self.motion.m, self.motion.d, self.r_c
        end = r_c**m / (d * self.unloading.p * time)
        if not r_c > arb(1) / 2:
            return end
        # For large k, y <= 4 d sigma_c R/k^2 with R = max(1, r_c^(d-n_b)) and sigma_c <= k T max(1, r_c^(n_b-m)): 2 R
        # r_c^(m-d), the last maximum being 1 as n_b >= m. 3 instead of 2: r_c is known at this k only.
        power_of_r_c = r_c ** (min(d - n_b, 0) + m - d)
        return end.min(3 * power_of_r_c)


def _log_kappa(law: Law, k: arb, f: arb) -> arb:
    """Return ln kappa = ln((2 m)^(1/nu-1) k F^(2 c)), where 2 c = 2/nu - 1 and f is F."""
    return k.log() + f.log() * ball_of(2 * law.c) - (arb(2) * law.m).log() * ball_of(1 - 1 / law.nu)


# --- results ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Speed:
    """A collision at kappa = beta speed^(2 c): beta may be kappa and the speed 1.

    `fractions` are the numbers to be shown that are known exactly, by name.
    """

    beta: Fraction
    speed: Fraction
    fractions: dict[str, Fraction]
    law: Law = VISCOELASTIC

    def log_kappa(self) -> arb:
        """Return ln kappa."""
        return ball_of(self.beta).log() + ball_of(self.speed).log() * ball_of(2 * self.law.c)

    def guess(self) -> tuple[arb, int]:
        """Return an approximation of k, and the number of its correct bits."""
        # For the paper's law from x_max in double precision, whose relative error the fourth root divides by 4: 52
        # bits.
        with working(128):
            log_kappa = self.log_kappa()
            from_table = _k_from_table(log_kappa, 52) if self.law == VISCOELASTIC else None
            return from_table or _k_from_limits(float(log_kappa), self.law)

    def tabulated(self) -> dict[str, arb] | None:
        """Enclose eps and 1 - eps by the table, if it can."""
        kappa = ball_of(self.beta) * ball_of(self.speed).root(5)  # the paper's law: 2 c = 1/5, v*^2 = kappa
        v_star = ball_of(self.fractions["v_star"]) if "v_star" in self.fractions else kappa.sqrt()
        portions = exact_table.portions(v_star)
        if portions is None:
            return None
        numbers = {"v_star": v_star, "epsilon": portions.epsilon, "one_minus_epsilon": portions.loss}
        further = {"kappa": kappa, "beta": ball_of(self.beta)}
        return numbers | {name: ball for name, ball in further.items() if name in self.fractions}

    def start(self, accuracy: int) -> tuple[Dyadic, Dyadic] | None:
        """Return k and the speed at first contact for `collide` with `accuracy` bits; None where it is not the way.

        Units are those of x_max in double precision.
        """
        with working(accuracy + START_BITS + GUARD_BITS):
            log_kappa = self.log_kappa()
            if self.law != VISCOELASTIC or not log_kappa < MOST_IN_TIME or (x_max := _rough_x_max(log_kappa)) is None:
                return None
            # With X = q^4, k = 2 kappa X^(1/4) = 2 kappa q, and p = 1/(2 X^(5/4)) = 1/(2 q^5).
            q = arb(x_max).root(4).mid()
            k, speed = 2 * log_kappa.exp() * q, 1 / (2 * q**5)
            return Dyadic.nearest(k, accuracy + START_BITS), Dyadic.nearest(speed, accuracy + START_BITS)

    def step(self, k: Dyadic, accuracy: int) -> arb:
        """Return by how much ln k should change, by Newton's method for ln kappa."""
        # d ln kappa/d ln k = 1 + 2 c d ln F/d ln k; `p_end` is F, and `sensitivity` its derivative.
        loading = integrate(k, accuracy, Motion.from_law(self.law))
        with working(accuracy + GUARD_BITS):
            log_kappa = _log_kappa(self.law, k.ball(), loading.p_end)
            return (self.log_kappa() - log_kappa) / (1 + loading.sensitivity() * ball_of(2 * self.law.c))

    def enclosed(self, nearby: _AtK) -> dict[str, arb]:
        """Enclose the collision, from what is proven for a k nearby."""
        # d ln kappa/d ln k is between 1 and 2/nu (step 10), that is at least the smaller of both: this bounds the
        # difference of ln k.
        log_kappa = self.log_kappa()
        delta = abs(log_kappa - nearby.log_kappa) * ball_of(max(self.law.nu / 2, Fraction(1)))
        # v* = kappa^(1/d). beta and kappa are shown if they were asked for, kappa always for other laws.
        numbers = {"v_star": (log_kappa / self.law.d).exp(), **nearby.restitution(delta), **nearby.course(delta)}
        if "kappa" in self.fractions or self.law != VISCOELASTIC:
            numbers["kappa"] = log_kappa.exp()
        return {**numbers, "beta": ball_of(self.beta)} if "beta" in self.fractions else numbers


@dataclass(frozen=True)
class _Restitution:
    """A collision with a coefficient of restitution, at a speed if beta is to be shown, too."""

    epsilon: Fraction
    speed: Fraction | None
    law: Law = VISCOELASTIC

    @property
    def fractions(self) -> dict[str, Fraction]:
        """The numbers that are known exactly, by name."""
        return {"epsilon": self.epsilon, "one_minus_epsilon": 1 - self.epsilon}

    def log_odds(self) -> arb:
        """Return ln((1 - eps)/eps), a smooth function of ln k; of slope 1 to 2 for the paper's law."""
        return ball_of(1 - self.epsilon).log() - ball_of(self.epsilon).log()

    def guess(self) -> tuple[arb, int]:
        """Return an approximation of k, and the number of its correct bits."""
        # For the paper's law from the inverse of doubles, as long as neither of eps and 1 - eps underflows: v* to about
        # 2^-48, so that k has 47 correct bits.
        epsilon, loss = float(self.epsilon), float(1 - self.epsilon)
        if self.law == VISCOELASTIC and min(epsilon, loss) > 1e-300:
            v_star = double.v_star_from(epsilon) if epsilon < loss else double.v_star_from(one_minus_epsilon=loss)
            with working(128):
                from_table = _k_from_table(2 * arb(v_star).log(), 47)
            if from_table is not None:
                return from_table
        with working(128):
            odds = float(self.log_odds())
        # (1 - eps)/eps goes from lambda_1 kappa to kappa^decay, with delayed recovery K^nu (decay = nu), K = kappa
        # (b+1)^(1/nu-1): it is about the larger of both, or for decay < 1 the smaller.
        log_kappa = odds - math.log(_lambda_1(self.law))
        if self.law.decay is not None:
            log_k_of_e = 0.0 if not self.law.delayed else (1 - 1 / self.law.nu) * math.log(self.law.damping + 1)
            nearer = min if self.law.decay >= 1 else max
            log_kappa = nearer(log_kappa, odds / float(self.law.decay) + log_k_of_e)
        elif log_kappa > -1:
            log_kappa = -1.0  # no decay: contact ends only below a kappa of order 1, and e^-1 is below that
        return _k_from_limits(log_kappa, self.law)

    def tabulated(self) -> dict[str, arb] | None:
        """Enclose v* by the table, if it can; beta = v*^2 v^(-1/5) if there is a speed v."""
        v_star = exact_table.v_star_of(self.epsilon)
        if v_star is None:
            return None
        # kappa = v*^2 = beta v^(1/5): the paper's law.
        numbers = {"v_star": v_star, "epsilon": ball_of(self.epsilon), "one_minus_epsilon": ball_of(1 - self.epsilon)}
        return numbers if self.speed is None else {**numbers, "beta": v_star**2 / ball_of(self.speed).root(5)}

    def step(self, k: Dyadic, accuracy: int) -> arb:
        """Return by how much ln k should change, by Newton's method for ln((1 - eps)/eps)."""
        # d ln((1 - eps)/eps)/d ln k = -(d ln eps/d ln k)/(1 - eps), and ln eps = ln P - ln F.
        rough, (loading, unloading) = _rough_collision_at_k(k, accuracy, self.law)
        with working(accuracy + GUARD_BITS):
            slope = (loading.sensitivity() - unloading.sensitivity()) / rough.one_minus_epsilon
            return (self.log_odds() - rough.log_odds) / slope

    def enclosed(self, nearby: _AtK) -> dict[str, arb]:
        """Enclose the collision, from what is proven for a k nearby."""
        # -d ln eps/d ln k is at least `least_slope` here, and half of that at k nearby, up to delta = 1/8 (step 5). The
        # difference of ln eps is at most that of eps over the smaller eps.
        epsilon, loss = ball_of(self.epsilon), ball_of(1 - self.epsilon)
        difference = epsilon - nearby.epsilon if epsilon < loss else loss - nearby.one_minus_epsilon
        delta = 2 * abs(difference) / (epsilon.min(nearby.epsilon) * nearby.least_slope)
        if not delta < arb(1) / 8:
            raise ArithmeticError("k is too far off")
        # ln kappa changes by at most 2/nu (6/5 for the paper's law) or 1 times ln k, and ln v* by a d-th of that.
        rate = max(2 / self.law.nu, Fraction(1))
        kappa = nearby.log_kappa.exp() * _within(ball_of(rate) * delta)
        v_star = (nearby.log_kappa / self.law.d).exp() * _within(ball_of(rate / self.law.d) * delta)
        numbers = {"v_star": v_star, "epsilon": epsilon, "one_minus_epsilon": loss, **nearby.course(delta)}
        if self.law != VISCOELASTIC:
            numbers["kappa"] = kappa
        if self.speed is None:
            return numbers
        power = 2 * self.law.c
        return {**numbers, "beta": kappa / rational_power(ball_of(self.speed), power) if power else kappa}


_Problem = _Speed | _Restitution


def _lambda_1(law: Law) -> float:
    """Return the limit of (1 - eps)/kappa for small kappa, B(1/nu, 3/2) ((a+1)/2)^(1/nu-1), to a double's digits."""
    # `kappa_scale` is the pair ((a+1)/2, 1 - 1/nu).
    # B(1/nu, 3/2) = Gamma(1/nu) Gamma(3/2)/Gamma(1/nu + 3/2).
    inverse, (base, power) = float(1 / law.nu), law.kappa_scale
    beta = math.exp(math.lgamma(inverse) + math.lgamma(1.5) - math.lgamma(inverse + 1.5))
    return beta * math.exp(-float(power) * math.log(base))


def _rough_x_max(log_kappa: arb) -> float | None:
    """Return x_max in double precision at v* = e^(log_kappa/2), unless v* is extreme: the paper's law."""
    half = float(log_kappa) / 2
    # v* beyond e^±200 = 1e±87: by hand, well inside the range of doubles, also for kappa = v*^2.
    if abs(half) > 200:
        return None
    try:
        return double.x_max(math.exp(half))
    except OSError:  # the table is being made
        return None


def _k_from_table(log_kappa: arb, bits: int) -> tuple[arb, int] | None:
    """Return k = 2 kappa x_max^(1/4) with x_max in double precision, and `bits`; None if v* is extreme."""
    x_max = _rough_x_max(log_kappa)
    return None if x_max is None else (2 * log_kappa.exp() * arb(x_max).root(4), bits)


def _k_from_limits(log_kappa: float, law: Law) -> tuple[arb, int]:
    """Return k at ln kappa under a law, as if F were the larger of its limits.

    These are 1/sqrt(n_a) for slow and k/(2 n_b) for fast impacts. The second number is that of its correct bits, 1.
    """
    # ln kappa + (1 - 1/nu) ln(2 m) = ln k + 2 c ln F. For F = k/(2 n_b): ln k (1 + 2 c) = that + 2 c ln(2 n_b). A
    # larger F makes k smaller if c > 0, and larger if c < 0.
    motion, c = Motion.from_law(law), float(2 * law.c)
    scaled = log_kappa + float(1 - 1 / law.nu) * math.log(2 * motion.m)
    slow = log_k_of(log_kappa, law)
    fast = (scaled + c * math.log(2 * motion.n_b)) / (1 + c)
    with working(128):
        return arb(min(slow, fast) if c > 0 else max(slow, fast)).exp(), 1


# --- solving ----------------------------------------------------------------------------------------------------------


def _collision(problem: _Problem, digits: int) -> Collision:
    """Return the collision of a problem to `digits` digits.

    eps or v* is looked up in the table; where it does not determine the decimals, solve for k and enclose.
    """
    if problem.law == VISCOELASTIC and digits <= exact_table.DIGITS:
        with working(exact_table.BITS):
            balls = problem.tabulated()
        if balls is not None:
            try:
                return _Tabulated(problem, digits, balls)
            except ValueError:  # a decimal is not determined
                pass
    if isinstance(problem, _Speed):
        _require_moderate(problem)
    try:
        return _determined(problem, digits)
    except NoEndError:
        smaller = "a larger epsilon" if isinstance(problem, _Restitution) else "a smaller kappa"
        raise ValueError(
            f"with this much damping, contact of the law {problem.law} does not end at x = 0, or lasts too long to be "
            f"computed: expected {smaller}" + (", or end 'force'" if problem.law.nu > 1 else "")
        ) from None


def _determined(problem: _Problem, digits: int) -> Collision:
    """Return the collision of a problem, enclosed with more and more bits until all `digits` digits are determined."""
    accuracy = _accuracy(digits)
    # From v*: in time from first contact, without solving for k. A second attempt has 16 bits more, which helps if an
    # enclosure contains a boundary of rounding; Newton's method comes after it.
    for bits in (accuracy, accuracy + 16):
        start = problem.start(bits) if isinstance(problem, _Speed) else None
        if start is None:
            break
        for i in track(range(2), "Integration and proof", [COLLISION_COST, 1].__getitem__):
            if i == 0:
                branches = collide(*start, bits)
            elif collision := _enclosed(problem, branches, digits, bits):
                return collision
    # From epsilon, for other laws and extremes: k by Newton's method, from a k of the bits of a double or so (64).
    guess, correct_bits = problem.guess()
    k = Dyadic.nearest(guess, 64)
    if correct_bits < LEAST_KNOWN:
        k, correct_bits = _approached(problem, k)
    # Each attempt improves the k of the last one; it gets 16, 32, 64, … bits more (a choice: most need one attempt).
    accuracy, more = accuracy + _end_bits(problem.law, k, accuracy), 16
    for _ in range(MAX_ATTEMPTS):
        steps = _accuracies(correct_bits, accuracy)
        costs = [*(bits**COST_POWER for bits in steps), PROOF_COST * accuracy**COST_POWER]
        for i in track(range(len(costs)), "Newton's method and proof", costs.__getitem__):
            if i < len(steps):
                k = _improved(problem, k, steps[i])
            elif collision := _enclosed(problem, _branches(k, accuracy, problem.law), digits, accuracy):
                return collision
        correct_bits, accuracy, more = accuracy, accuracy + more, 2 * more
    raise ArithmeticError(f"{MAX_ATTEMPTS} attempts did not determine {digits} digits")


def _accuracy(digits: int) -> int:
    """Return the bits of an integration that determines so many digits, as a rule at the first attempt."""
    bits = bits_for(digits)
    # The bounds of errors grow with the number of terms, a half of the bits: log2(bits) more, from 128 bits on.
    return bits + GUARD_DIGIT_BITS + max(bits.bit_length() - 7, 0)


def _enclosed(problem: _Problem, branches: tuple[Branch, Branch], digits: int, accuracy: int) -> Collision | None:
    """Enclose a problem's collision from branches at a k nearby; None if that does not determine all digits.

    `accuracy` is the bits of the branches.
    """
    # A failed proof is an ArithmeticError, an undetermined decimal a ValueError: both call for more bits.
    with working(accuracy + GUARD_BITS):
        try:
            return Collision(
                digits, **problem.enclosed(_AtK.enclosed(branches, problem.law)), fractions=problem.fractions
            )
        except (ArithmeticError, ValueError):
            return None


def _end_bits(law: Law, k: Dyadic, accuracy: int) -> int:
    """Return the additional bits of tau_c for small k: the error of r_c^m is that of r_c^d = k P times k^(m/d - 1)."""
    motion, small = Motion.from_law(law), max(-k.size, 0)
    if not law.delayed or motion.m >= motion.d or small * motion.m > accuracy * motion.d:  # r_c^m itself is nothing
        return 0
    return small * (motion.d - motion.m) // motion.d


def _approached(problem: _Problem, k: Dyadic) -> tuple[Dyadic, int]:
    """Return k of a problem to a few bits, and their number: Newton's method with steps of at most a factor of e^2."""
    largest = 2.0  # of |ln k|, that is a factor of e^2; a choice
    for _ in range(MAX_STEPS):
        try:
            change = float(problem.step(k, LEAST_ACCURACY).mid())
        except NoEndError:
            change, largest = -largest, largest / 2  # back, then with smaller steps
        change = max(min(change, largest), -largest)
        with working(96):
            k = Dyadic.nearest(k.ball() * arb(change).exp(), 64)
        # A change by 2^-n leaves an error of about 2^(-2 n), up to the constant of quadratic convergence (LOST_BITS)
        # and the accuracy of this step.
        if abs(change) < 2.0**-LEAST_KNOWN:
            right = int(-2 * math.log2(max(abs(change), 2.0**-LEAST_ACCURACY))) - LOST_BITS
            return k, max(LEAST_KNOWN, min(right, LEAST_ACCURACY - LOST_BITS))
    raise ArithmeticError("Newton's method did not converge")


def _accuracies(correct_bits: int, accuracy: int) -> list[int]:
    """Return the bits of k after each step of Newton's method, from `correct_bits` to `accuracy`."""
    # Backwards: a step to n bits needs n/2 and LOST_BITS/2 more. The first may gain 8 bits more than that, because the
    # constant of quadratic convergence is small; if it is not, the proof fails and a further attempt follows.
    steps = [accuracy]
    while steps[-1] > 2 * correct_bits + 8:
        steps.append(steps[-1] // 2 + 2)
    return steps[::-1]


def _improved(problem: _Problem, k: Dyadic, bits: int) -> Dyadic:
    """Return k after a step of Newton's method, to about `bits` bits (8 more are kept, so that rounding is nothing)."""
    change = problem.step(k, max(bits, LEAST_ACCURACY))
    with working(bits + GUARD_BITS):
        return Dyadic.nearest(k.ball() * change.mid().exp(), bits + 8)


def _branches(k: Dyadic, accuracy: int, law: Law = VISCOELASTIC) -> tuple[Branch, Branch]:
    """Return loading and unloading at k."""
    motion = Motion.from_law(law)
    return integrate(k, accuracy, motion), integrate(Dyadic(-k.mantissa, k.exponent), accuracy, motion)


def _collision_at_k(k: Dyadic, accuracy: int, law: Law) -> tuple[_AtK, tuple[Branch, Branch]]:
    """Enclose the collision at k under a law, with `accuracy` bits or more where an attractive force needs them.

    The branches, loading and unloading, are returned with it.
    """
    for _ in range(MAX_ATTEMPTS):
        branches = _branches(k, accuracy, law)
        with working(accuracy + GUARD_BITS):
            try:
                return _AtK.enclosed(branches, law), branches
            except ArithmeticError:  # the proof fails, by an unknown number of bits: twice as many
                accuracy *= 2
    raise ArithmeticError("the end was not enclosed")


def _rough_collision_at_k(k: Dyadic, accuracy: int, law: Law) -> tuple[_AtK, tuple[Branch, Branch]]:
    """Return numbers and branches at k for a step of Newton's method, mostly without a proof.

    `accuracy` is in bits, `law` that of contact. Times are not needed, and 0. With attraction p at the end
    may have far fewer bits than asked for: then only the proof tells how many there are.
    """
    forth, back = _branches(k, accuracy, law)  # loading and unloading
    if back.motion.attractive:
        return _collision_at_k(k, accuracy, law)
    with working(accuracy + GUARD_BITS):
        loading, unloading = (Ends(branch.p_end, arb(0), branch.work()) for branch in (forth, back))
        return _AtK(k.ball(), loading, unloading, law), (forth, back)


def at_k(log_k: float, law: Law) -> tuple[float, float, float, float]:
    """Return ln(kappa/k), ln((1 - eps)/eps) - ln kappa, ln x_max and tau_c/x_max at ln k, in double precision.

    These are smooth functions of ln k for every law, which `curve` interpolates.
    """
    # k to 96 bits: more than LOW_ACCURACY, the bits of what becomes a double.
    with working(128):
        k = Dyadic.nearest(arb(log_k).exp(), 96)
    enclosed, _ = _collision_at_k(k, LOW_ACCURACY, law)
    with working(LOW_ACCURACY + GUARD_BITS):
        log_kappa, log = enclosed.log_kappa, enclosed.k.log()
        functions = log_kappa - log, enclosed.log_odds - log_kappa, enclosed.x_max.log(), enclosed.tau_over_x
        return (float(functions[0]), float(functions[1]), float(functions[2]), float(functions[3]))


def log_k(kappa: Fraction, law: Law) -> float:
    """Return ln k at kappa > 0 under a law, in double precision."""
    # As in `_determined`, up to LOW_ACCURACY = 60 bits; 64 and 128 bits hold that.
    problem = _Speed(kappa, Fraction(1), {}, law)
    guess, correct_bits = problem.guess()
    k = Dyadic.nearest(guess, 64)
    if correct_bits < LEAST_KNOWN:
        k, correct_bits = _approached(problem, k)[0], LEAST_KNOWN
    for bits in _accuracies(correct_bits, LOW_ACCURACY):
        k = _improved(problem, k, bits)
    with working(128):
        return float(k.ball().log())


def log_k_of(log_kappa: float, law: Law) -> float:
    """Return ln k where kappa is tiny: ln kappa + (1 - 1/nu) ln(2 m) - 2 c ln F with F = 1/sqrt(n_a)."""
    return log_kappa + float(1 - 1 / law.nu) * math.log(2 * law.m) + float(law.c) * math.log(Motion.from_law(law).n_a)


def log_k_of_epsilon(epsilon: str, law: Law) -> float:
    """Return ln k at which eps has a value, a decimal."""
    # 15 digits: kappa becomes a double's ln k.
    return log_k(Fraction(invert(epsilon, 15, law=law).decimals()["kappa"]), law)


def _within(log_error: arb) -> arb:
    """Return the ball of the factors e^x, |x| <= log_error."""
    return arb(1, log_error.abs_upper().expm1().abs_upper())


def _elastic(digits: int, law: Law, beta: Fraction | None = None, with_kappa: bool = False) -> Collision:
    """Return the limit v* = 0: eps = 1, and x_max and tau_c of an elastic collision under the law.

    `beta` is shown if given, and kappa = 0 if `with_kappa`.
    """
    # k = 0: both halves are loading. 16 bits more at each attempt, as in `_determined`.
    zero = Dyadic(0, 0)
    accuracy = _accuracy(digits)
    fractions = {} if beta is None else {"beta": beta}
    if with_kappa:
        fractions["kappa"] = Fraction(0)
    for _ in range(MAX_ATTEMPTS):
        branches = _branches(zero, accuracy, law)
        with working(accuracy + GUARD_BITS):
            limit = _AtK.enclosed(branches, law)
            balls = {name: ball_of(number) for name, number in fractions.items()}
            try:
                return Collision(digits, arb(0), arb(1), arb(0), **limit.course(arb(0)), fractions=fractions, **balls)
            except ValueError:
                accuracy += 16
    raise ArithmeticError(f"{MAX_ATTEMPTS} attempts did not determine {digits} digits")


def _at_infinity(digits: int, law: Law) -> Collision:
    """Return the limit v* -> infinity: eps = x_max = tau_c = 0, where the law has one."""
    if not law.delayed:
        raise ValueError("v_star is inf: expected a finite number, because contact with this law never ends")
    kappa = {"kappa": arb.pos_inf()} if law != VISCOELASTIC else {}
    return Collision(digits, arb.pos_inf(), arb(0), arb(1), arb(0), arb(0), {}, **kappa)
