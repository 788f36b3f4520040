"""Programs and formulas that compute damping from a wanted eps, and the audit of what their contacts deliver.

A formula has two halves. `DampingFormula.written` is what people write for a wanted eps: eps itself where the program
asks for it, else the number that a manual tells them. `DampingFormula.kappa` is what the program makes of that number:
the damping of the scaled equation x'' + x^a + kappa x^b x' = 0, with the law and the end of contact that it has.

The number to write instead is the one whose kappa delivers the wanted eps: the program's own formula, inverted.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal

from mpmath import mp

from viscopade.collision import exact, steps
from viscopade.theory.law import Law

Reason = Literal["exact", "other end", "other law", "normalisation", "approximate formula"]
REASONS: dict[Reason, str] = {
    "exact": "The formula is exact for this contact.",
    "other end": "The formula is made for the other end of contact.",
    "other law": "The formula is made for another law of contact.",
    "normalisation": "The formula is made for another mass, radius or stiffness than the contact has.",
    "approximate formula": "The formula is an approximation.",
}
ASKED = ("0.9", "0.75", "0.5", "0.3", "0.1")
DIGITS = 15
_GUARD = 10
_HALVINGS = 90
_AGREES = 1e-9


def same(value: Any) -> Any:
    """Return the value: a program that takes eps, or the damping of the scaled equation, itself."""
    return value


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
        Why the contact delivers another eps than asked for: a key of `REASONS`.
    source : str
        File of the program, or citation.
    written : callable
        From the wanted eps to the parameter, both mpmath numbers.
    note : str
        What a reader of the row must know, a sentence.
    scheme : Scheme or None
        The program's integrator; None if it has no time steps.
    """

    name: str
    law: Law
    parameter: str
    kappa: Callable[[Any], Any]
    accepted: tuple[str, str]
    reason: Reason
    source: str
    written: Callable[[Any], Any] = same
    note: str = ""
    scheme: steps.Scheme | None = steps.LAGGED

    def __post_init__(self) -> None:
        if self.reason not in REASONS:
            raise ValueError(f"reason is {self.reason!r}: accepted is one of {', '.join(REASONS)}")

    def damping(self, asked: str) -> Any:
        """Return the kappa of the contact if eps = `asked` is wanted, an mpmath number."""
        with mp.workdps(DIGITS + _GUARD):
            parameter = self.written(mp.mpf(asked))
            low, high = map(mp.mpf, self.accepted)
            if not low <= parameter <= high:
                raise ValueError(
                    f"epsilon is {asked}: {self.name} would be given {self.parameter} = {mp.nstr(parameter, 6)}, and "
                    f"accepts {self.accepted[0]} to {self.accepted[1]}"
                )
            return +self.kappa(parameter)

    def delivered(self, kappa: Any) -> Any:
        """Return the proven eps of the contact with a kappa, an mpmath number; None if the bodies never part."""
        try:
            return epsilon_of(self.law, kappa)
        except ValueError:
            if self.law.bounded:
                return None
            raise

    def parameter_of(self, kappa: Any) -> Any:
        """Return the parameter that gives the contact a kappa, an mpmath number; None if no accepted one does."""
        with mp.workdps(DIGITS + _GUARD):
            low, high = map(mp.mpf, self.accepted)
            at_low, at_high = self.kappa(low), self.kappa(high)
            if not min(at_low, at_high) <= kappa <= max(at_low, at_high):
                return None
            for _ in range(_HALVINGS):
                middle = (low + high) / 2
                low, high = (middle, high) if (self.kappa(middle) < kappa) == (at_low < at_high) else (low, middle)
            return high

    def instead(self, asked: str) -> Any:
        """Return the parameter that delivers `asked` in the continuum, an mpmath number; None if none does."""
        return self.parameter_of(wanted_kappa(self.law, asked))


@dataclass(frozen=True)
class Program:
    """A program, and its formulas.

    Attributes
    ----------
    name : str
        As `viscopade audit --program` takes it.
    title : str
        As its authors write it.
    version : str
        Version or commit of which the source was read.
    formulas : tuple of DampingFormula
    """

    name: str
    title: str
    version: str
    formulas: tuple[DampingFormula, ...]

    def __post_init__(self) -> None:
        names = [formula.name for formula in self.formulas]
        if len({*names}) < len(names):
            raise ValueError(f"two formulas of {self.title} have one name")


@dataclass(frozen=True)
class Audit:
    """The eps that a formula delivers, and what to write instead.

    Attributes
    ----------
    program : Program
    formula : DampingFormula
    asked : str
        The wanted eps, a decimal.
    written : float
        The parameter that people write for it.
    delivered : mpmath number or None
        Proven eps in the continuum, to `DIGITS` digits; None if the bodies never part.
    time_step : float or None
        In units of the undamped contact time; None for a program without time steps, too.
    stepped : Stepped or None
        Eps at that time step.
    instead : float or None
        The parameter that delivers eps: in the continuum, or on average at the time step. None if there is none.
    reasons : tuple of str
        Why the delivered eps is not the one asked for, and why there is no parameter instead; sentences.
    advice : Advice or None
        How eps depends on the time step, if that was wanted.
    """

    program: Program
    formula: DampingFormula
    asked: str
    written: float
    delivered: Any
    time_step: float | None
    stepped: steps.Stepped | None
    instead: float | None
    reasons: tuple[str, ...]
    advice: Advice | None = None


@dataclass(frozen=True)
class Advice:
    """How the eps of a formula depends on the time step, which is in units of the undamped contact time.

    Attributes
    ----------
    error : float
        The wanted relative error of eps.
    largest_step : float
        The largest time step that keeps it, wherever in a step contact begins.
    slope : float
        The mean eps is that of the continuum plus slope times the time step, to first order.
    """

    error: float
    largest_step: float
    slope: float


@cache
def epsilon_of(law: Law, kappa: Any) -> Any:
    """Return the eps that a law delivers with a kappa, to `DIGITS` digits, an mpmath number."""
    same_epsilon, factor = _simplest(law)
    with mp.workdps(DIGITS + _GUARD):
        damping = kappa * factor
    return exact.collision(kappa=damping, law=same_epsilon, digits=DIGITS).mpf()["epsilon"]


def _simplest(law: Law) -> tuple[Law, Any]:
    """Return a law with the same nu, whose eps is quick to prove, and its kappa over the law's (section 2.9).

    It is (nu - 1, 0), or for nu <= 1 the law with a = 1.
    """
    simplest = Law(law.nu - 1, 0, law.end) if law.nu > 1 else Law(1, 2 / law.nu - 1, law.end)
    with mp.workdps(DIGITS + _GUARD):
        return simplest, _scale(law) / _scale(simplest)


def _scale(law: Law) -> Any:
    """Return K/kappa, (b + 1)^(-(a-b)/(a+1)), an mpmath number."""
    base, power = law.damping + 1, (law.elastic - law.damping) / (law.elastic + 1)
    return (mp.mpf(base.numerator) / base.denominator) ** (-mp.mpf(power.numerator) / power.denominator)


@cache
def wanted_kappa(law: Law, asked: str) -> Any:
    """Return the kappa with which a law delivers eps = `asked`, an mpmath number."""
    if mp.mpf(asked) == 1:
        return mp.mpf(0)
    with mp.workdps(DIGITS + _GUARD):
        same_epsilon, factor = _simplest(law)
        return exact.invert(asked, law=same_epsilon, digits=DIGITS + 2).mpf()["v_star"] ** same_epsilon.d / factor


def audited(
    program: Program,
    formula: DampingFormula,
    asked: str,
    time_step: float | None = None,
    step_error: float | None = None,
) -> Audit:
    """Return what a formula delivers for a wanted eps, in the continuum and at a time step.

    Parameters
    ----------
    program : Program
    formula : DampingFormula
        One of its formulas.
    asked : str
        The wanted eps, a decimal > 0 and <= 1.
    time_step : float, optional
        In units of the undamped contact time (`steps.contact_time`).
    step_error : float, optional
        Wanted relative error of eps by the time step, for the advice.

    Raises
    ------
    ValueError
        If the program does not accept what people would write for this eps.
    """
    kappa, step = formula.damping(asked), None if formula.scheme is None else time_step
    delivered = formula.delivered(kappa)
    wrong = delivered is None or abs(delivered / mp.mpf(asked) - 1) > _AGREES
    reasons = [REASONS[formula.reason], *([formula.note] if formula.note else [])] if wrong else []
    wanted, stepped = wanted_kappa(formula.law, asked), None
    if step is not None and formula.scheme is not None:
        stepped = steps.stepped(formula.law, float(kappa), step, formula.scheme)
        reasons.append(f"The time step adds {stepped.mean - float(delivered or 0):+.2g} on average.")
        try:
            wanted = steps.compensated(formula.law, float(asked), step, float(wanted), formula.scheme)
        except ValueError as error:
            wanted = None
            reasons.append(f"No damping delivers it: {error}.")
    instead = None if wanted is None else formula.parameter_of(wanted)
    if instead is None and wanted is not None:
        reasons.append(f"No accepted {formula.parameter} delivers it.")
    with mp.workdps(DIGITS):
        written = float(formula.written(mp.mpf(asked)))
    number = None if instead is None else float(instead)
    advice = None if step_error is None or delivered is None else advised(formula, kappa, delivered, step_error)
    return Audit(program, formula, asked, written, delivered, step, stepped, number, tuple(reasons), advice)


def advised(formula: DampingFormula, kappa: Any, delivered: Any, error: float) -> Advice | None:
    """Return how eps depends on the time step; None for a program without time steps."""
    if formula.scheme is None:
        return None
    largest = steps.largest_step(formula.law, float(kappa), error, float(delivered), formula.scheme)
    return Advice(error, largest, steps.step_slope(formula.law, float(kappa), formula.scheme))
