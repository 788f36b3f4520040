"""Formulas of programs that compute damping from a wanted eps.

A formula has two halves. `DampingFormula.usual_parameter` is what people write for a wanted eps: eps itself where the
program asks for it, else the number that a manual tells them. `DampingFormula.kappa` is what the program makes of that
number: the damping of the scaled equation x'' + x^a + kappa x^b x' = 0, with the law and the end of contact.

The number to write instead is the one whose kappa gives the wanted eps: the program's own formula, inverted.

Behind most programs is the damping ratio. The contact m x'' + 2 zeta sqrt(k m) x' + k x = 0 has
eps = exp(-pi zeta/sqrt(1 - zeta^2)) if it ends at x = 0, and a larger one if it ends where the force vanishes. Hertz'
spring with Tsuji's damping has the same two functions of zeta (`derivations/12_tsuji.py`). kappa is 2 zeta for the
first, sqrt(5) zeta for the second.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal

from flint import arb
from mpmath import mp

from viscopade.arithmetic.balls import bits_for, to_mpf, working
from viscopade.collision import exact
from viscopade.collision.contact import PHASES, Contact, SampledCollision, damping_factor
from viscopade.collision.schemes import SEMI_IMPLICIT, Scheme
from viscopade.collision.weight import loaded
from viscopade.theory.law import VISCOELASTIC, End, Law, law_of

Reason = Literal["exact", "other end", "other law", "normalisation", "two bodies", "approximate formula"]
REASONS: dict[Reason, str] = {
    "exact": "The formula is exact for this contact.",
    "other end": "The formula is made for the other end of contact.",
    "other law": "The formula is made for another law of contact.",
    "normalisation": "The formula is made for another mass, radius or stiffness than the contact has.",
    "two bodies": "The numbers of both bodies make one.",
    "approximate formula": "The formula is an approximation.",
}
DIGITS = 15
"""Decimal digits of each eps and parameter: as many as a double always keeps."""
# More digits while a number is computed, against round-off. 5 and 20 give the same doubles for all formulas (measured).
_GUARD = 10
# Digits for the closed forms of nu = 2. They lose up to half of them: near eps = 1 in ln eps, and near a damping ratio
# zeta = 1 in 1 - zeta^2.
_TWICE = 2 * (DIGITS + _GUARD)
# Most secants for a parameter. 18 suffice where kappa is smooth (measured for all formulas); where a fit jumps, the
# bracket shrinks more slowly: 90 leave 6e-19 of its end for eps = 0.999 in YADE (and 2e-11 for 0.9999).
_SECANTS = 90
# Relative error of kappa at which a parameter is found, 5 digits below `DIGITS`. Where kappa jumps, as a fit may at
# eps = 1, it is the relative width of the bracket.
_SOLVED = 1e-20

LINEAR, LINEAR_RETURN = law_of("linear"), law_of("linear", "return")
TSUJI, TSUJI_RETURN = law_of("tsuji"), law_of("tsuji", "return")
# Thornton, Cummins and Cleary (2013), equation (B7): coefficients of en^10, …, en^0, as YADE and Kratos have them.
_THORNTON = (
    *("-1489.915", "6276.757", "-11342.18", "11494.29", "-7206.864", "2928.711"),
    *("-796.4559", "146.8049", "-16.41105", "-6.918798", "0"),
)


def identity(value: Any) -> Any:
    """Return the value itself: the number of a program that takes eps, or kappa, as it is."""
    return value


def kappa_from_ratio(ratio: Any) -> Any:
    """Return kappa of the linear spring whose damping ratio is zeta = `ratio`, an mpmath number."""
    # x'' + kappa x' + x = 0 is x'' + 2 zeta x' + x = 0.
    return 2 * ratio


@dataclass(frozen=True)
class DampingFormula:
    """A way in which a program gets its damping from a wanted eps.

    Attributes
    ----------
    name : str
        The program's words for it.
    law : Law
        Law of contact with its end: "force" if attraction is cut off, "return" if not.
    parameter : str
        What is written, such as "coefficientRestitution" or "d v".
    kappa : callable
        From the parameter to kappa, both mpmath numbers; monotone over `accepted`.
    accepted : tuple of str
        Least and largest value of the parameter.
    reason : str
        Why the contact gives a different eps than asked for: a key of `REASONS`.
    source : str
        File of the program, or citation.
    usual_parameter : callable
        From the wanted eps to the parameter, both mpmath numbers.
    note : str
        What a reader of the row must know, a sentence.
    scheme : Scheme or None
        The program's integrator; None if it has no time steps.
    is_impulse : bool
        Whether the program applies eps at once, without a contact.
    """

    name: str
    law: Law
    parameter: str
    kappa: Callable[[Any], Any]
    accepted: tuple[str, str]
    reason: Reason
    source: str
    usual_parameter: Callable[[Any], Any] = identity
    note: str = ""
    scheme: Scheme | None = SEMI_IMPLICIT
    is_impulse: bool = False

    def __post_init__(self) -> None:
        if self.reason not in REASONS:
            raise ValueError(f"reason is {self.reason!r}: expected one of {', '.join(REASONS)}")

    def damping(self, asked: str) -> Any:
        """Return the kappa that the program makes of the number that people write for eps = `asked`, an mpmath number.

        Raises
        ------
        ValueError
            If the program does not accept that number.
        """
        with mp.workdps(DIGITS + _GUARD):
            parameter = self.usual_parameter(mp.mpf(asked))
            low, high = map(mp.mpf, self.accepted)
            # The message has 6 digits of the number, enough for a reader to recognize it.
            if not low <= parameter <= high:
                raise ValueError(
                    f"epsilon is {asked}: {self.name} would be given {self.parameter} = {mp.nstr(parameter, 6)}, and "
                    f"accepts {self.accepted[0]} to {self.accepted[1]}"
                )
            # mpmath's unary plus rounds to the digits of the context.
            return +self.kappa(parameter)

    def contact_epsilon(self, kappa: Any) -> Any:
        """Return the proven eps of the contact with a kappa, an mpmath number; None if the bodies never part."""
        try:
            return law_epsilon(self.law, kappa)
        except ValueError:
            # A bounded law is one with the end x = 0 and nu >= 2: from a critical kappa on its bodies creep, and
            # contact does not end. Of other laws the error is one of the argument.
            if self.law.bounded:
                return None
            raise

    def parameter_of(self, kappa: Any) -> Any:
        """Return the parameter from which the program makes `kappa`, an mpmath number; None outside of its range."""
        with mp.workdps(DIGITS + _GUARD):
            low, high = map(mp.mpf, self.accepted)
            # As kappa is monotone in the parameter, there is a solution if the signs at both ends differ.
            excess_low, excess_high = self.kappa(low) - kappa, self.kappa(high) - kappa
            if excess_low * excess_high > 0:
                return None
            # The Illinois method (Dowell and Jarratt 1971): secants through both ends of the bracket. If one end moves
            # twice in a row, the excess at the other is halved, so that the next secant crosses to its side.
            last_moved = 0  # -1 if the lower end moved last, 1 if the upper one did
            for _ in range(_SECANTS):
                secant = high if excess_high == 0 else low - excess_low * (high - low) / (excess_high - excess_low)
                excess = self.kappa(secant) - kappa
                if abs(excess) <= _SOLVED * kappa or high - low <= _SOLVED * high:
                    return secant
                if (excess < 0) == (excess_low < 0):
                    excess_high = excess_high / 2 if last_moved < 0 else excess_high
                    low, excess_low, last_moved = secant, excess, -1
                else:
                    excess_low = excess_low / 2 if last_moved > 0 else excess_low
                    high, excess_high, last_moved = secant, excess, 1
            return high

    def instead(self, asked: str) -> Any:
        """Return the parameter that gives eps = `asked` without time steps, an mpmath number; None if none does."""
        return self.parameter_of(kappa_for_epsilon(self.law, asked))


Row = tuple[str, Law, Callable[[Any], Any], Reason] | tuple[str, Law, Callable[[Any], Any], Reason, str]
"""Name, law, kappa and reason of a formula, and a note if there is one."""


def formulas(
    parameter: str,
    accepted: tuple[str, str],
    source: str,
    *rows: Row,
    usual_parameter: Callable[[Any], Any] = identity,
    scheme: Scheme | None = SEMI_IMPLICIT,
    is_impulse: bool = False,
) -> tuple[DampingFormula, ...]:
    """Return formulas of a program that take the same parameter, one for each row.

    A row is name, law, kappa and reason, with a note if there is one. The other arguments are the fields of
    `DampingFormula` that all rows share: `accepted` is the range of the parameter, `source` the program's file,
    `usual_parameter` the function from eps to the parameter, `scheme` the integrator, and `is_impulse` says whether eps
    is applied at once.
    """
    # A missing note is an empty list, which joins to "".
    return tuple(
        DampingFormula(
            name, law, parameter, kappa, accepted, reason, source, usual_parameter, "".join(note), scheme, is_impulse
        )
        for name, law, kappa, reason, *note in rows
    )


def viscoelastic_formula(
    name: str,
    source: str,
    note: str,
    end: End = "force",
    *,
    parameter: str = "kappa",
    scheme: Scheme | None = SEMI_IMPLICIT,
) -> DampingFormula:
    """Return the formula of a program that has the viscoelastic force, with our damping; exact for the end "force".

    Its parameter is kappa of the scaled equation x'' + x^(3/2) + kappa x' sqrt(x) = 0, in the program's words, such as
    "eta_n0 (m_eff/k_n)^(3/5) (R_eff v)^(1/5)". `name`, `source`, `note` and `scheme` are those of `DampingFormula`;
    `end` is "return" for a program that lets the force attract until x = 0.
    """
    reason: Reason = "exact" if end == "force" else "other end"
    # The parameter is kappa already: mp.mpf leaves it as it is.
    row = name, law_of(VISCOELASTIC, end), mp.mpf, reason, note
    # eps ~ (3/2)^(2/3) kappa^(-5/3) is 1.3e-10 at kappa = 1e6: no audit asks for less.
    (formula,) = formulas(parameter, ("0", "1e6"), source, row, usual_parameter=viscoelastic_kappa, scheme=scheme)
    return formula


@cache
def law_epsilon(law: Law, kappa: Any) -> Any:
    """Return the proven eps that a law gives with a kappa, rounded to `DIGITS` digits, an mpmath number.

    Raises
    ------
    ValueError
        If contact does not end.
    """
    # Laws with one nu = (a + 1)/(b + 1) have one eps as a function of K = kappa (b + 1)^(-(a-b)/(a+1)). So that of
    # `law` is the eps of a simpler law with another kappa.
    simplest, kappa_ratio = _simplest(law)
    with mp.workdps(DIGITS + _GUARD):
        simplest_kappa = kappa * kappa_ratio
    # Of nu = 2 the simplest law is the linear spring, whose damping ratio is zeta = kappa/2 and whose eps is
    # elementary.
    if law.nu == 2:
        with working(bits_for(_TWICE)):
            return to_mpf(_linear_epsilon(arb(simplest_kappa) / 2, law.end))
    return to_mpf(exact.collision(kappa=simplest_kappa, law=simplest, digits=DIGITS).epsilon)


def _linear_epsilon(zeta: arb, end: End) -> arb:
    """Return an enclosure of the eps of a linear spring with the damping ratio `zeta`, by its end of contact."""
    if end == "return":
        if not zeta < 1:
            raise ValueError("the damping ratio is not below 1: the bodies never part")
        # eps = exp(-pi zeta/sqrt(1 - zeta^2)): half a period of the damped oscillation
        return (-arb.pi() * zeta / ((1 - zeta) * (1 + zeta)).sqrt()).exp()
    # eps = exp(-2 zeta acos(zeta)/sqrt(1 - zeta^2)), its limit exp(-2) at zeta = 1, and acosh and zeta^2 - 1 above.
    if zeta == 1:
        return arb(-2).exp()
    w = abs((1 - zeta) * (1 + zeta)).sqrt()
    return (-2 * zeta * (zeta.acos() if zeta < 1 else zeta.acosh()) / w).exp()


def _simplest(law: Law) -> tuple[Law, Any]:
    """Return a law with the same nu, whose eps is quick to prove, and its kappa over the kappa of `law` at equal eps.

    It is the paper's law if nu is 5/3, as its eps is in a table. Else it has a linear dashpot, (a, b) = (nu - 1, 0),
    and for nu <= 1, where that a would not be > 0, it is (1, 2/nu - 1).
    """
    if law.nu == VISCOELASTIC.nu and law.end == VISCOELASTIC.end:
        simplest = VISCOELASTIC
    else:
        simplest = Law(law.nu - 1, 0, law.end) if law.nu > 1 else Law(1, 2 / law.nu - 1, law.end)
    # Equal eps is equal K, and K = kappa times `_K_over_kappa`.
    with mp.workdps(DIGITS + _GUARD):
        return simplest, _K_over_kappa(law) / _K_over_kappa(simplest)


def _K_over_kappa(law: Law) -> Any:
    """Return K/kappa = (b + 1)^(-(a-b)/(a+1)) of a law with the exponents a (elastic) and b (damping)."""
    base, power = law.damping + 1, (law.elastic - law.damping) / (law.elastic + 1)
    return (mp.mpf(base.numerator) / base.denominator) ** (-mp.mpf(power.numerator) / power.denominator)


@cache
def kappa_for_epsilon(law: Law, asked: str) -> Any:
    """Return the kappa with which a law gives eps = `asked`, a decimal; an mpmath number, inverse of `law_epsilon`."""
    if mp.mpf(asked) == 1:
        return mp.mpf(0)
    with mp.workdps(_TWICE if law.nu == 2 else DIGITS + _GUARD):
        # The law with the same eps whose inverse is known, and its kappa over that of `law`.
        simplest, kappa_ratio = _simplest(law)
        if law.nu == 2:
            # kappa of the linear spring is 2 zeta.
            ratio = ratio_for_return if law.end == "return" else ratio_at_force_end
            return 2 * ratio(mp.mpf(asked)) / kappa_ratio
        # v* = kappa^(1/d) is the variable in which the series of eps has integer powers (d = 2 of the paper's law). The
        # power d, at most a small integer, multiplies its relative error: 2 digits more than `DIGITS` cover this.
        v_star = to_mpf(exact.invert(asked, law=simplest, digits=DIGITS + 2).v_star)
        return v_star**simplest.d / kappa_ratio


@cache
def stepped_collision(
    law: Law, kappa: float, step: float, scheme: Scheme, load: float = 0.0, carried: float = 0.0
) -> SampledCollision:
    """Return the collision that a program computes in its time steps: mean, least and largest eps over phases.

    `step` is the time step in units of the undamped contact time (`Law.contact_time`), `load` the scaled weight G, and
    `carried` the part of it that the force carries without a compression. `scheme` is the integrator.
    """
    return loaded(law, kappa, load, carried).collide(step=step * law.contact_time, scheme=scheme)


class TooFewSteps(ValueError):
    """No damping gives a wanted eps in time steps that are so long."""


@cache
def kappa_in_steps(
    law: Law,
    epsilon: float,
    step: float | None,
    scheme: Scheme,
    load: float = 0.0,
    carried: float = 0.0,
    start: float | None = None,
) -> float:
    """Return the kappa with which the mean eps of a law in a program's time steps, or with a load, is `epsilon`.

    The mean is taken over the phases, which are the parts of a step at which contact begins. `step`, `scheme`, `load`
    and `carried` are those of `stepped_collision`; a step of None is infinitely short. The search begins at the kappa
    `start`, by default at the kappa that gives `epsilon` without a time step and a load.

    Raises
    ------
    TooFewSteps
        If none does with this time step.
    ValueError
        If none does with this load.
    """
    start = float(kappa_for_epsilon(law, repr(epsilon))) if start is None else start
    if start == 0:
        return 0.0  # without damping no step changes eps
    # The scaled equation has its own unit of time, in which its undamped contact lasts `law.contact_time`.
    scaled_step = None if step is None else step * law.contact_time

    def scaled_contact(kappa: float) -> Contact:
        return loaded(law, kappa, load, carried)

    try:
        # Where the steps alone take more energy than is wanted, no search is necessary.
        if scaled_step is not None:
            undamped = scaled_contact(0.0).collide(step=scaled_step, scheme=scheme, phases=PHASES)
            if undamped.epsilon < epsilon:
                raise ValueError
        return damping_factor(scaled_contact, epsilon, start, step=scaled_step, scheme=scheme)
    except ValueError as error:
        if step is None:
            raise ValueError(f"with weight {error}") from None
        raise TooFewSteps(
            f"time-step is {step:.4g} of the contact time: no damping gives eps = {epsilon:g} with so few steps"
        ) from None


def ratio_for_return(e: Any) -> Any:
    """Return the damping ratio zeta with which contact that ends at x = 0 has eps = `e`, an mpmath number."""
    # e = exp(-pi zeta/sqrt(1 - zeta^2)), solved for zeta: zeta = -ln e/sqrt(pi^2 + ln^2 e)
    decrement = -mp.log(e)
    return decrement / mp.sqrt(mp.pi**2 + decrement**2)


def linear_kappa(e: Any) -> Any:
    """Return kappa of the linear spring with which contact that ends at x = 0 has eps = `e`: 2 zeta."""
    return kappa_from_ratio(ratio_for_return(e))


def tsuji_kappa(e: Any) -> Any:
    """Return kappa of Hertz' spring and Tsuji's damping with which contact that ends at x = 0 has eps = `e`."""
    # kappa = sqrt(5) zeta, with the zeta of the linear spring (derivations/12_tsuji.py).
    return mp.sqrt(5) * ratio_for_return(e)


def ratio_at_force_end(e: Any) -> Any:
    """Return the damping ratio zeta with which contact that ends where the force vanishes has eps = `e`."""
    if e == 1:
        return mp.mpf(0)
    with mp.workdps(_TWICE):
        decrement = -mp.log(e)

        def excess(zeta: Any) -> Any:
            # -ln eps = 2 zeta acos(zeta)/sqrt(1 - zeta^2). From zeta = 1 on acos and root are both imaginary, and their
            # quotient is real.
            return (2 * zeta * mp.acos(zeta) / mp.sqrt((1 - zeta) * (1 + zeta))).real - decrement

        # For small zeta acos(zeta) is pi/2, and -ln eps is pi zeta: the secant method starts there, and 1 % above it.
        return mp.findroot(excess, (decrement / mp.pi, 1.01 * decrement / mp.pi))


def viscoelastic_kappa(e: Any) -> Any:
    """Return kappa of the viscoelastic law with the paper's end of contact for eps = `e`, an mpmath number."""
    # A decimal with one digit less than mpmath computes with: so 0.3 is the text "0.3" again.
    return kappa_for_epsilon(VISCOELASTIC, mp.nstr(e, DIGITS + _GUARD - 1))


def thornton_kappa(en: Any) -> Any:
    """Return kappa of Tsuji's damping for eps = `en` by the fit of Thornton, Cummins and Cleary (2013).

    The fit is for contact that ends where the force vanishes.
    """
    if en == 1:
        return mp.mpf(0)
    # (B7): a polynomial h of degree 10. (B6): beta_n = sqrt(1/(1 - (1 + en)^2 e^h) - 1)
    h = mp.polyval([mp.mpf(c) for c in _THORNTON], en)
    beta_n = mp.sqrt(1 / (1 - (1 + en) ** 2 * mp.exp(h)) - 1)
    # The dashpot 2 beta_n sqrt(S m) with S = 3/2 k sqrt(x) of Hertz' force k x^(3/2): kappa = 2 sqrt(3/2) beta_n
    return mp.sqrt(6) * beta_n


def force_end_kappa(e: Any) -> Any:
    """Return kappa of the linear spring with which contact that ends where the force vanishes has eps = `e`."""
    return kappa_from_ratio(ratio_at_force_end(e))


def half_mass_kappa(e: Any) -> Any:
    """Return kappa of a linear contact at a wall whose damping a program makes for half of its effective mass.

    `e` is the eps that is written, for contact that ends at x = 0.
    """
    # kappa = c/sqrt(m k), and the program's c = 2 zeta sqrt(m/2 k)
    return linear_kappa(e) / mp.sqrt(2)
