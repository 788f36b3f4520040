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
_GUARD = 10
_TWICE = 2 * (DIGITS + _GUARD)  # digits for closed forms, which lose half of them near eps = 1 or a damping ratio of 1
_SECANTS = 90
_SOLVED = 1e-20  # relative error of kappa; where kappa jumps, as a fit may at eps = 1, the width of the bracket

LINEAR, LINEAR_RETURN = law_of("linear"), law_of("linear", "return")
TSUJI, TSUJI_RETURN = law_of("tsuji"), law_of("tsuji", "return")
_THORNTON = (
    *("-1489.915", "6276.757", "-11342.18", "11494.29", "-7206.864", "2928.711"),
    *("-796.4559", "146.8049", "-16.41105", "-6.918798", "0"),
)


def identity(value: Any) -> Any:
    """Return the value: a program that takes eps, or the damping of the scaled equation, itself."""
    return value


def twice(ratio: Any) -> Any:
    """Return kappa of the linear spring with a damping ratio."""
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
        """Return the kappa of the contact if eps = `asked` is wanted, an mpmath number."""
        with mp.workdps(DIGITS + _GUARD):
            parameter = self.usual_parameter(mp.mpf(asked))
            low, high = map(mp.mpf, self.accepted)
            if not low <= parameter <= high:
                raise ValueError(
                    f"epsilon is {asked}: {self.name} would be given {self.parameter} = {mp.nstr(parameter, 6)}, and "
                    f"accepts {self.accepted[0]} to {self.accepted[1]}"
                )
            return +self.kappa(parameter)

    def contact_epsilon(self, kappa: Any) -> Any:
        """Return the proven eps of the contact with a kappa, an mpmath number; None if the bodies never part."""
        try:
            return law_epsilon(self.law, kappa)
        except ValueError:
            if self.law.bounded:
                return None
            raise

    def parameter_of(self, kappa: Any) -> Any:
        """Return the parameter that gives the contact a kappa, an mpmath number; None if none in its range does."""
        with mp.workdps(DIGITS + _GUARD):
            low, high = map(mp.mpf, self.accepted)
            below, above = self.kappa(low) - kappa, self.kappa(high) - kappa
            if below * above > 0:
                return None
            # The Illinois method: secants through both ends of the bracket. An end that stays has its value halved, so
            # that the next secant passes on its side of the solution.
            kept = 0
            for _ in range(_SECANTS):
                middle = high if above == 0 else low - below * (high - low) / (above - below)
                value = self.kappa(middle) - kappa
                if abs(value) <= _SOLVED * kappa or high - low <= _SOLVED * high:
                    return middle
                if (value < 0) == (below < 0):
                    low, below, above, kept = middle, value, above / 2 if kept < 0 else above, -1
                else:
                    high, above, below, kept = middle, value, below / 2 if kept > 0 else below, 1
            return high

    def instead(self, asked: str) -> Any:
        """Return the parameter that gives `asked` in the continuum, an mpmath number; None if none does."""
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
    """Return a table of formulas that take the same parameter; the arguments are those of `DampingFormula`."""
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

    Its parameter is kappa of the scaled equation, in the program's words.
    """
    reason: Reason = "exact" if end == "force" else "other end"
    row = name, law_of(VISCOELASTIC, end), mp.mpf, reason, note
    (found,) = formulas(parameter, ("0", "1e6"), source, row, usual_parameter=viscoelastic_kappa, scheme=scheme)
    return found


@cache
def law_epsilon(law: Law, kappa: Any) -> Any:
    """Return the eps that a law gives with a kappa, to `DIGITS` digits, an mpmath number.

    Raises
    ------
    ValueError
        If contact does not end.
    """
    same_epsilon, factor = _simplest(law)
    with mp.workdps(DIGITS + _GUARD):
        damping = kappa * factor
    if law.nu == 2:
        with working(bits_for(_TWICE)):
            return to_mpf(_epsilon_of_ratio(arb(damping) / 2, law.end))
    return to_mpf(exact.collision(kappa=damping, law=same_epsilon, digits=DIGITS).epsilon)


def _epsilon_of_ratio(zeta: arb, end: End) -> arb:
    """Return the eps of a linear spring with a damping ratio, an enclosure."""
    if end == "return":
        if not zeta < 1:
            raise ValueError("the damping ratio is not below 1: the bodies never part")
        # eps = exp(-pi zeta/sqrt(1 - zeta^2))
        return (-arb.pi() * zeta / ((1 - zeta) * (1 + zeta)).sqrt()).exp()
    # eps = exp(-2 zeta acos(zeta)/sqrt(1 - zeta^2)), and the same with acosh from the damping ratio 1 on
    if zeta == 1:
        return arb(-2).exp()
    w = abs((1 - zeta) * (1 + zeta)).sqrt()
    return (-2 * zeta * (zeta.acos() if zeta < 1 else zeta.acosh()) / w).exp()


def _simplest(law: Law) -> tuple[Law, Any]:
    """Return a law with the same nu, whose eps is quick to prove, and its kappa over the law's (section 2.9).

    It is the paper's law, whose eps is in a table, (nu - 1, 0), or for nu <= 1 the law with a = 1.
    """
    if law.nu == VISCOELASTIC.nu and law.end == VISCOELASTIC.end:
        simplest = VISCOELASTIC
    else:
        simplest = Law(law.nu - 1, 0, law.end) if law.nu > 1 else Law(1, 2 / law.nu - 1, law.end)
    with mp.workdps(DIGITS + _GUARD):
        return simplest, _scale(law) / _scale(simplest)


def _scale(law: Law) -> Any:
    """Return K/kappa, (b + 1)^(-(a-b)/(a+1)), an mpmath number."""
    base, power = law.damping + 1, (law.elastic - law.damping) / (law.elastic + 1)
    return (mp.mpf(base.numerator) / base.denominator) ** (-mp.mpf(power.numerator) / power.denominator)


@cache
def kappa_for_epsilon(law: Law, asked: str) -> Any:
    """Return the kappa with which a law gives eps = `asked`, an mpmath number."""
    if mp.mpf(asked) == 1:
        return mp.mpf(0)
    with mp.workdps(_TWICE if law.nu == 2 else DIGITS + _GUARD):
        same_epsilon, factor = _simplest(law)
        if law.nu == 2:
            ratio_of = ratio_for_return if law.end == "return" else ratio_at_force_end
            return 2 * ratio_of(mp.mpf(asked)) / factor
        v_star = to_mpf(exact.invert(asked, law=same_epsilon, digits=DIGITS + 2).v_star)
        return v_star**same_epsilon.d / factor


@cache
def stepped_collision(
    law: Law, kappa: float, step: float, scheme: Scheme, load: float = 0.0, carried: float = 0.0
) -> SampledCollision:
    """Return the collision of a law with a time step, which is in units of `Law.contact_time`."""
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
    near: float | None = None,
) -> float:
    """Return the kappa of a law whose mean eps with a time step, or with a load, is `epsilon`.

    The search begins at the kappa `near`, by default at that without a time step and a load.

    Raises
    ------
    TooFewSteps
        If none does with this time step.
    ValueError
        If none does with this load.
    """
    near = float(kappa_for_epsilon(law, repr(epsilon))) if near is None else near
    if near == 0:
        return 0.0  # without damping no step changes eps
    scaled = None if step is None else step * law.contact_time

    def family(kappa: float) -> Contact:
        return loaded(law, kappa, load, carried)

    try:
        # Where the steps alone take more energy than is wanted, no search is necessary.
        if scaled is not None and family(0.0).collide(step=scaled, scheme=scheme, phases=PHASES).epsilon < epsilon:
            raise ValueError
        return damping_factor(family, epsilon, near, step=scaled, scheme=scheme)
    except ValueError as error:
        if step is None:
            raise ValueError(f"with weight {error}") from None
        raise TooFewSteps(
            f"time-step is {step:.4g} of the contact time: no damping gives eps = {epsilon:g} with so few steps"
        ) from None


def ratio_for_return(e: Any) -> Any:
    """Return zeta for eps = e at the end x = 0, -ln e/sqrt(pi^2 + ln^2 e), of an mpmath number."""
    loss = -mp.log(e)
    return loss / mp.sqrt(mp.pi**2 + loss**2)


def linear_kappa(e: Any) -> Any:
    """Return kappa of the linear spring with that damping ratio."""
    return twice(ratio_for_return(e))


def tsuji_kappa(e: Any) -> Any:
    """Return kappa of Hertz' spring and Tsuji's damping with that damping ratio."""
    return mp.sqrt(5) * ratio_for_return(e)


def ratio_at_force_end(e: Any) -> Any:
    """Return zeta for eps = e at the end where the force vanishes, of an mpmath number."""
    if e == 1:
        return mp.mpf(0)
    with mp.workdps(_TWICE):
        loss = -mp.log(e)

        def excess(zeta: Any) -> Any:
            # -ln eps = 2 zeta acos(zeta)/sqrt(1 - zeta^2); from zeta = 1 on both, acos and root, are imaginary
            return (2 * zeta * mp.acos(zeta) / mp.sqrt((1 - zeta) * (1 + zeta))).real - loss

        return mp.findroot(excess, (loss / mp.pi, 1.01 * loss / mp.pi))


def viscoelastic_kappa(e: Any) -> Any:
    """Return kappa of the viscoelastic law for eps = e, as `viscopade.simulators` do."""
    return kappa_for_epsilon(VISCOELASTIC, mp.nstr(e, DIGITS + _GUARD - 1))


def thornton_kappa(en: Any) -> Any:
    """Return kappa by the fit of Thornton, Cummins and Cleary (2013) to Tsuji's damping, an mpmath number."""
    if en == 1:
        return mp.mpf(0)
    exponent = mp.polyval([mp.mpf(c) for c in _THORNTON], en)
    return mp.sqrt(6) * mp.sqrt(1 / (1 - (1 + en) ** 2 * mp.exp(exponent)) - 1)


def force_end_kappa(e: Any) -> Any:
    """Return kappa of the linear spring for eps = e at the end where the force vanishes."""
    return twice(ratio_at_force_end(e))


def half_mass_kappa(e: Any) -> Any:
    """Return kappa of a linear contact at a wall whose damping is made for half of its effective mass."""
    return linear_kappa(e) / mp.sqrt(2)
