r"""The exact coefficient of restitution eps(v*) and its inverse, to any number of proven digits.

The curve's parameter is k = sqrt(5) K (section 2.2). For a given k the two branches of `flow` lead to F (loading) and
m (unloading), and with them, kappa = v*^2,

    kappa = 2^(-4/5) k F^(1/5),    eps = m/F,                          x_max = (2 F)^(-4/5),
    tau_c = 2 (2 F)^(1/5) T,       (1 - eps^2) F^2 = r_c^5/5 + k W,    r_c^2 = k m,

T and W being integrals over both branches of positive functions: 1 - eps loses no digits however small v* is. Newton's
method, with the derivative of the flow, finds a k whose kappa (or eps) is nearly the wanted one; what it found is then
enclosed (`validation`), and the difference that remains is covered by bounds of the derivatives with respect to ln k
which hold for every k. docs/theory/exact-function.md has the proofs.

End of contact is eq:tEndAdvanced, where the force vanishes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from decimal import ROUND_HALF_EVEN, Context, Decimal
from fractions import Fraction
from typing import Any, SupportsIndex

from flint import arb, fmpz
from mpmath import mp

from viscopade import arguments
from viscopade.arithmetic.balls import ball_of, bits_for, decimal_string, to_mpf, working
from viscopade.arrays import double
from viscopade.collision.flow import Branch, Dyadic, integrate
from viscopade.collision.validation import Ends, ends
from viscopade.progress import track

Exact = Any
"""A number taken exactly: str (decimal), int, float, Fraction, Decimal, mpmath.mpf or a NumPy scalar."""

MAX_ATTEMPTS = 12
GUARD_BITS = 32  # of ball arithmetic, beyond the accuracy asked for
GUARD_DIGIT_BITS = 12  # so that an enclosure rarely lies across a boundary of rounding
LEAST_ACCURACY = 30  # with fewer bits, the end of unloading may not be found for large k

_SPEEDS = "0, infinity, or a number from 1e-1000 to 1e100"
_BETAS = "0, or a number from 1e-1000 to 1e100"
_SPEEDS_AT = "a number from 1e-1000 to 1e100"
_RESTITUTIONS = "1, or a number from 1e-330 to 1 - 1e-1990"
_LOSSES = "0, or a number from 1e-1990 to 1 - 1e-330"


@dataclass(frozen=True)
class Collision:
    """One collision in scaled units (eq:equationOfMotionNatUnit), every number a proven enclosure.

    Attributes
    ----------
    digits : int
        Significant digits to which every number is determined.
    v_star : flint.arb
        v* = beta^(1/2) v^(1/10), >= 0; may be infinite.
    epsilon : flint.arb
        Coefficient of restitution (eq:force2COR).
    one_minus_epsilon : flint.arb
        1 - epsilon, without cancellation.
    x_max : flint.arb
        Maximal compression.
    tau_c : flint.arb
        Duration of contact (eq:tEndAdvanced).
    given : dict
        The numbers among them that were given, or follow from those, as fractions.
    beta : flint.arb, optional
        eq:betadef in (time/length)^(1/5), if the speed was given.
    """

    digits: int
    v_star: arb
    epsilon: arb
    one_minus_epsilon: arb
    x_max: arb
    tau_c: arb
    given: dict[str, Fraction]
    beta: arb | None = None

    def __post_init__(self) -> None:
        if not (self.epsilon + self.one_minus_epsilon).contains(1):
            raise ValueError("epsilon and one_minus_epsilon do not belong together")
        undetermined = [name for name in self.balls() if self._decimal(name) is None]
        if undetermined:
            raise ValueError(f"enclosures are too wide for {self.digits} digits: {', '.join(undetermined)}")

    def balls(self) -> dict[str, arb]:
        """Return the enclosures by name."""
        balls = {name: getattr(self, name) for name in NAMES}
        return balls if self.beta is None else {**balls, "beta": self.beta}

    def decimals(self) -> dict[str, str]:
        """Return the numbers by name as decimal strings, correctly rounded to `digits`."""
        return {name: str(self._decimal(name)) for name in self.balls()}

    def mpf(self) -> dict[str, mp.mpf]:
        """Return the numbers by name as mpmath numbers, of relative error below 5 10^-digits."""
        return {name: to_mpf(ball) if ball.is_finite() else mp.inf for name, ball in self.balls().items()}

    def floats(self) -> dict[str, float]:
        """Return the numbers by name as doubles: those nearest to the decimals."""
        return {name: float(text) for name, text in self.decimals().items()}

    def _decimal(self, name: str) -> str | None:
        if name in self.given:
            return _rounded(self.given[name], self.digits)
        ball: arb = getattr(self, name)
        if name == "v_star" and ball > 10**1000:
            return "inf"
        return decimal_string(ball, self.digits)


NAMES = ("v_star", "epsilon", "one_minus_epsilon", "x_max", "tau_c")


def collision(
    v_star: Exact = None, digits: SupportsIndex = 30, *, beta: Exact = None, speed: Exact = None
) -> Collision:
    """Return the proven numbers of the collision at v*, or at a speed and a beta.

    Parameters
    ----------
    v_star : str, int, float, Fraction, Decimal, mpmath.mpf or NumPy scalar
        0, infinity, or from 1e-1000 to 1e100. It is taken exactly: a string is a decimal number and never becomes a
        float.
    digits : int
        Significant digits, 1 to 5000.
    beta, speed : like v_star
        Both instead of v_star: beta of eq:betadef in (time/length)^(1/5), and the impact speed in length/time; each
        from 1e-1000 to 1e100, or 0.

    Returns
    -------
    Collision

    Raises
    ------
    TypeError, ValueError
        If not v_star alone, or not both of beta and speed, are given; if one is no such number; or digits out of range.
    """
    digits = arguments.digits(digits)
    if v_star is not None and beta is None and speed is None:
        if _is_infinite(v_star):
            return _at_infinity(digits)
        number = arguments.exact_number("v_star", v_star, _SPEEDS, _in_range)
        wanted = _Speed(number**2, Fraction(1), {"v_star": number})
        return _elastic(digits) if number == 0 else _collision(wanted, digits)
    if v_star is None and beta is not None and speed is not None:
        factor = arguments.exact_number("beta", beta, _BETAS, _in_range)
        velocity = arguments.exact_number("speed", speed, _BETAS, _in_range)
        if factor * velocity == 0:
            return _elastic(digits, factor)
        given = {"beta": factor, **_v_star_if_rational(factor, velocity)}
        return _collision(_Speed(factor, velocity, given), digits)
    raise TypeError("accepted is either v_star, or both beta and speed")


def epsilon(v_star: Exact, digits: SupportsIndex = 30) -> mp.mpf:
    """Return eps(v*) as an mpmath number, to `digits` digits; arguments and errors as for `collision`."""
    return collision(v_star, digits).mpf()["epsilon"]


def invert(
    epsilon: Exact = None, digits: SupportsIndex = 30, *, one_minus_epsilon: Exact = None, speed: Exact = None
) -> Collision:
    """Return the collision whose coefficient of restitution is `epsilon`.

    Parameters
    ----------
    epsilon : str, int, float, Fraction, Decimal, mpmath.mpf or NumPy scalar
        Greater than 0 (at least 1e-330) and at most 1, taken exactly.
    digits : int
        Significant digits, 1 to 5000.
    one_minus_epsilon : like epsilon
        Instead of epsilon: a float near 1 knows few digits of 1 - epsilon.
    speed : like epsilon, optional
        Impact speed at which epsilon was found, from 1e-1000 to 1e100: the collision then has a beta, too.

    Returns
    -------
    Collision

    Raises
    ------
    TypeError, ValueError
        If not exactly one of the two is given, if it is no such number, or digits out of range.
    """
    digits = arguments.digits(digits)
    if (epsilon is None) == (one_minus_epsilon is None):
        raise TypeError("accepted is exactly one of epsilon and one_minus_epsilon")
    if epsilon is not None:
        restitution = arguments.exact_number("epsilon", epsilon, _RESTITUTIONS, _is_restitution)
    else:
        loss = arguments.exact_number(
            "one_minus_epsilon", one_minus_epsilon, _LOSSES, lambda number: _is_restitution(1 - number)
        )
        restitution = 1 - loss
    velocity = (
        None if speed is None else arguments.exact_number("speed", speed, _SPEEDS_AT, lambda v: v > 0 and _in_range(v))
    )
    if restitution == 1:
        return _elastic(digits, None if speed is None else Fraction(0))
    return _collision(_Restitution(restitution, velocity), digits)


def _in_range(number: Fraction) -> bool:
    return number == 0 or Fraction(1, 10**1000) <= number <= 10**100


def _is_restitution(number: Fraction) -> bool:
    return number == 1 or Fraction(1, 10**330) <= number <= 1 - Fraction(1, 10**1990)


def _is_infinite(value: object) -> bool:
    if isinstance(value, str):
        return value.strip().lower().removeprefix("+") in ("inf", "infinity")
    try:
        return bool(value == math.inf)
    except (TypeError, ValueError, ArithmeticError):
        return False


def _root(number: int, n: int) -> int | None:
    """Return the n-th root of a whole number, if it is one."""
    root = int(fmpz(number).root(n))
    return root if root**n == number else None


def _v_star_if_rational(beta: Fraction, speed: Fraction) -> dict[str, Fraction]:
    """Return v* = (beta^5 v)^(1/10) if it is a fraction, so that it can be rounded exactly."""
    power = beta**5 * speed
    top, bottom = _root(power.numerator, 10), _root(power.denominator, 10)
    return {} if top is None or bottom is None else {"v_star": Fraction(top, bottom)}


def _rounded(number: Fraction, digits: int) -> str:
    """Return a fraction as a decimal string, correctly rounded."""
    context = Context(prec=digits, rounding=ROUND_HALF_EVEN, Emin=-(10**9), Emax=10**9)
    return str(context.divide(Decimal(number.numerator), Decimal(number.denominator))).lower()


# --- at a given k ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _AtK:
    """Proven numbers of the collision at a given k. Properties are to be used within `working`."""

    k: arb
    loading: Ends
    unloading: Ends

    @property
    def log_kappa(self) -> arb:
        return self.k.log() + (self.loading.p.log() - 4 * arb.const_log2()) / 5

    @property
    def epsilon(self) -> arb:
        return self.unloading.p / self.loading.p

    @property
    def one_minus_epsilon(self) -> arb:
        """(r_c^5/5 + k W)/(F^2 (1 + eps)): a sum of positive terms."""
        r_c = (self.k * self.unloading.p).sqrt()
        lost = r_c**5 / 5 + self.k * (self.loading.work + self.unloading.work)
        return lost / (self.loading.p**2 * (1 + self.epsilon))

    @property
    def least_slope(self) -> arb:
        """A lower bound of -d ln eps/d ln k."""
        return self.k * self.loading.work / (2 * self.loading.p**2)

    def restitution(self, delta: arb) -> dict[str, arb]:
        """Enclose eps and 1 - eps at any k whose logarithm differs by at most delta."""
        epsilon = self.epsilon * _within(2 * delta)
        loss = self.one_minus_epsilon * _within(3 * delta)
        return {"epsilon": 1 - loss if loss < arb(1) / 2 else epsilon, "one_minus_epsilon": loss}

    def course(self, delta: arb) -> dict[str, arb]:
        """Enclose x_max and tau_c likewise."""
        f, time = 2 * self.loading.p, self.loading.time + self.unloading.time
        r_c = (self.k * self.unloading.p).sqrt()
        end = self.k / (2 * time)
        sensitivity = arb(6) / 5 + (end.min(3 / r_c) if r_c > arb(1) / 2 else end)
        if not delta * sensitivity < arb(1) / 8:
            raise ArithmeticError("k is too far off")
        x_max = f ** (arb(-4) / 5) * _within(arb(4) / 5 * delta)
        return {"x_max": x_max, "tau_c": 2 * f.root(5) * time * _within(delta * sensitivity)}


# --- results ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Speed:
    """A collision at v* = beta^(1/2) v^(1/10): beta may be v*^2 and the speed 1."""

    beta: Fraction
    speed: Fraction
    given: dict[str, Fraction]

    def log_kappa(self) -> arb:
        return ball_of(self.beta).log() + ball_of(self.speed).log() / 5

    def guess(self) -> tuple[arb, int]:
        """Return an approximation of k, and the number of its bits that are right."""
        with working(128):
            log_kappa = self.log_kappa()
            return _k_from_table(log_kappa, 52) or _k_from_limits(float(log_kappa))

    def step(self, k: Dyadic, accuracy: int) -> arb:
        """Return by how much ln k should change."""
        loading = integrate(k, accuracy)
        with working(accuracy + GUARD_BITS):
            log_kappa = k.ball().log() + (loading.p_end.log() - 4 * arb.const_log2()) / 5
            return (self.log_kappa() - log_kappa) / (1 + loading.sensitivity() / 5)

    def enclosed(self, at: _AtK) -> dict[str, arb]:
        """Enclose the collision, from what is proven for a k nearby."""
        log_kappa = self.log_kappa()
        delta = abs(log_kappa - at.log_kappa)  # bounds the error of ln k, too
        numbers = {"v_star": (log_kappa / 2).exp(), **at.restitution(delta), **at.course(delta)}
        return {**numbers, "beta": ball_of(self.beta)} if "beta" in self.given else numbers


@dataclass(frozen=True)
class _Restitution:
    """A collision with the given coefficient of restitution."""

    epsilon: Fraction
    speed: Fraction | None

    @property
    def given(self) -> dict[str, Fraction]:
        return {"epsilon": self.epsilon, "one_minus_epsilon": 1 - self.epsilon}

    def log_odds(self) -> arb:
        """Return ln((1 - eps)/eps), a smooth function of ln k of slope 1 to 2."""
        return ball_of(1 - self.epsilon).log() - ball_of(self.epsilon).log()

    def guess(self) -> tuple[arb, int]:
        """Return an approximation of k, and the number of its bits that are right."""
        epsilon, loss = float(self.epsilon), float(1 - self.epsilon)
        if min(epsilon, loss) > 1e-300:
            v_star = double.v_star_from(epsilon) if epsilon < loss else double.v_star_from(one_minus_epsilon=loss)
            with working(128):
                found = _k_from_table(2 * arb(v_star).log(), 47)
            if found is not None:
                return found
        with working(128):
            odds = float(self.log_odds())
        # (1 - eps)/eps is about the larger of its limits, lambda_1 kappa and (2/3)^(2/3) kappa^(5/3).
        lambda_1 = math.sqrt(math.pi) * math.gamma(3 / 5) / (5**0.4 * 2**0.2 * math.gamma(21 / 10))
        return _k_from_limits(min(odds - math.log(lambda_1), 3 / 5 * odds - 2 / 5 * math.log(2 / 3)))

    def step(self, k: Dyadic, accuracy: int) -> arb:
        """Return by how much ln k should change."""
        loading, unloading = _branches(k, accuracy)
        with working(accuracy + GUARD_BITS):
            at = _AtK(k.ball(), ends(loading), ends(unloading))
            log_odds = at.one_minus_epsilon.log() - at.epsilon.log()
            slope = (loading.sensitivity() - unloading.sensitivity()) / at.one_minus_epsilon
            return (self.log_odds() - log_odds) / slope

    def enclosed(self, at: _AtK) -> dict[str, arb]:
        """Enclose the collision, from what is proven for a k nearby."""
        epsilon, loss = ball_of(self.epsilon), ball_of(1 - self.epsilon)
        difference = epsilon - at.epsilon if epsilon < loss else loss - at.one_minus_epsilon
        delta = 2 * abs(difference) / (epsilon.min(at.epsilon) * at.least_slope)
        if not delta < arb(1) / 8:
            raise ArithmeticError("k is too far off")
        v_star = (at.log_kappa / 2).exp() * _within(arb(3) / 5 * delta)
        numbers = {"v_star": v_star, "epsilon": epsilon, "one_minus_epsilon": loss, **at.course(delta)}
        return numbers if self.speed is None else {**numbers, "beta": v_star**2 / ball_of(self.speed).root(5)}


_Wanted = _Speed | _Restitution


def _k_from_table(log_kappa: arb, bits: int) -> tuple[arb, int] | None:
    """Return k = 2 kappa x_max^(1/4) with x_max in double precision, unless v* is extreme."""
    half = float(log_kappa) / 2
    if abs(half) > 200:
        return None
    try:
        x_max = double.x_max(math.exp(half))
    except OSError:  # the table is being made
        return None
    return 2 * log_kappa.exp() * arb(x_max).root(4), bits


def _k_from_limits(log_kappa: float) -> tuple[arb, int]:
    """Return k as if F were the larger of its limits, 1/sqrt(5) for slow and k/6 for fast impacts."""
    scaled = log_kappa + 4 / 5 * math.log(2)
    log_k = min(scaled + math.log(5) / 10, 5 / 6 * scaled + math.log(6) / 6)
    with working(128):
        return arb(log_k).exp(), 1


# --- solving ----------------------------------------------------------------------------------------------------------


def _collision(wanted: _Wanted, digits: int) -> Collision:
    """Solve for k and enclose, with more and more bits until every decimal is determined."""
    accuracy = bits_for(digits) + GUARD_DIGIT_BITS
    guess, known = wanted.guess()
    k = Dyadic.nearest(guess, 64)
    for _ in range(MAX_ATTEMPTS):
        k, known = _solved(wanted, k, known, accuracy), accuracy
        loading, unloading = _branches(k, accuracy)
        with working(accuracy + GUARD_BITS):
            try:
                balls = wanted.enclosed(_AtK(k.ball(), ends(loading), ends(unloading)))
                return Collision(digits, **balls, given=wanted.given)
            except (ArithmeticError, ValueError):
                accuracy += 16
    raise ArithmeticError(f"{MAX_ATTEMPTS} attempts did not determine {digits} digits")


def _solved(wanted: _Wanted, k: Dyadic, known: int, accuracy: int) -> Dyadic:
    """Return k to `accuracy` bits, given to `known` bits, by Newton's method."""
    steps = [accuracy]
    while steps[-1] > 2 * known + 8:  # the constant of quadratic convergence is small
        steps.append(steps[-1] // 2 + 2)
    for bits in track(steps[::-1], "Newton's method"):
        change = wanted.step(k, max(bits, LEAST_ACCURACY))
        with working(bits + GUARD_BITS):
            k = Dyadic.nearest(k.ball() * change.mid().exp(), bits + 8)
    return k


def _branches(k: Dyadic, accuracy: int) -> tuple[Branch, Branch]:
    return integrate(k, accuracy), integrate(Dyadic(-k.mantissa, k.exponent), accuracy)


def _within(log_error: arb) -> arb:
    """Return the ball of the factors e^x, |x| <= log_error."""
    return arb(1, log_error.abs_upper().expm1().abs_upper())


def _elastic(digits: int, beta: Fraction | None = None) -> Collision:
    """Return the limit v* = 0."""
    zero = Dyadic(0, 0)
    accuracy = bits_for(digits) + GUARD_DIGIT_BITS
    for _ in range(MAX_ATTEMPTS):
        loading, unloading = _branches(zero, accuracy)
        with working(accuracy + GUARD_BITS):
            at = _AtK(arb(0), ends(loading), ends(unloading))
            given = {} if beta is None else {"beta": beta}
            balls = {name: ball_of(number) for name, number in given.items()}
            try:
                return Collision(digits, arb(0), arb(1), arb(0), **at.course(arb(0)), given=given, **balls)
            except ValueError:
                accuracy += 16
    raise ArithmeticError(f"{MAX_ATTEMPTS} attempts did not determine {digits} digits")


def _at_infinity(digits: int) -> Collision:
    """Return the limit v* -> infinity."""
    return Collision(digits, arb.pos_inf(), arb(0), arb(1), arb(0), arb(0), {})
