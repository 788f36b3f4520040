"""Verdict on the viscoelastic law: what measured points say for it and against it, beside other laws."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Literal

import numpy as np
from scipy import optimize, stats

from viscopade.arrays.checked import FloatArray
from viscopade.fitting.likelihood import LawFit, Model, fitted
from viscopade.fitting.points import Points
from viscopade.theory.law import VISCOELASTIC, Law

Word = Literal["holds", "holds with a limit", "does not hold", "undecided"]

MODELS = (
    Model.of("viscoelastic", VISCOELASTIC),
    Model("constant", VISCOELASTIC, 0.0),
    Model.of("hunt-crossley", Law(1, 1)),
    Model("free exponent", VISCOELASTIC, None),
)
"""What is compared: nu = 5/3; a constant eps, nu = 2; nu = 1; and 1 - eps ~ v^p at small v, with the curve of 5/3."""

THEORY = float(2 * VISCOELASTIC.c)
"""The exponent p of the viscoelastic law, 1/5."""

_LEVEL = 0.95  # of the interval of p
_SLACK = 0.01  # of p, which flights and soft contacts shift: by 0.002 in LAMMPS (`viscopade_lab.studies.coverage`)
_CLEAR = 6.0  # difference of Akaike's criteria that decides: the other law is exp(3) = 20 times less likely
_TOLD = (1 + math.sqrt(1 + _CLEAR)) ** 2
_POOR = 1e-3  # probability of so large a chi^2
_FAR = 4.5  # standard errors, of a point that is named as an outlier
_FEW = 6
_FEWEST = 5  # points of which a law may be said to hold
_WIDEST = 1e8  # ratio of speeds


@dataclass(frozen=True)
class Verdict:
    """Verdict on a law, with its reasons.

    Attributes
    ----------
    word : str
        "holds": a constant eps and nu = 1 are excluded. "holds with a limit": so they are, but the exponent or the
        scatter is not as it should be. "does not hold": another law fits better. "undecided": the data do not tell.
    reasons : tuple of str
        Sentences.
    ratio : float or None
        Ratio of the fastest to the slowest speed at which as many points with the same errors would decide.
    """

    word: Word
    reasons: tuple[str, ...]
    ratio: float | None = None

    @property
    def sentence(self) -> str:
        """The verdict as a sentence, without its full stop."""
        if self.word == "undecided":
            return "Undecided: the data do not tell whether the viscoelastic law holds"
        return f"The viscoelastic law {self.word}"


@dataclass(frozen=True)
class ContactLaw:
    """Power law of contact with the eps that it has at a speed, from which its damping follows.

    Attributes
    ----------
    law : str
        Its name, or its exponents A,B.
    epsilon, speed : float
    """

    law: str
    epsilon: float
    speed: float

    @property
    def options(self) -> str:
        """Options of `viscopade invert` and `viscopade simulators`."""
        return f"--law {self.law} --epsilon {self.epsilon:.6g} --speed {self.speed:.6g}"


def compared(points: Points, laws: Sequence[Model] = (), *, robust: bool = False) -> tuple[LawFit, ...]:
    """Return the fits of `MODELS`, and of further laws, to points; the viscoelastic one first.

    Laws with more parameters than the points allow are left out.
    """
    models = [model for model in (*MODELS, *laws) if model is MODELS[0] or model.parameters < len(points)]
    return tuple(fitted(points, model, robust=robust) for model in models)


def outliers(points: Points) -> list[tuple[str, float]]:
    """Return labels of points far from any law, and how many standard errors they are off.

    The law with a free exponent is fitted with errors by Student's t, which such points hardly change (of bounces,
    which share errors, with Gaussian ones). Fewer than `_FEW` points have no outliers, and groups have none.
    """
    if len(points) < _FEW or points.counts is not None:
        return []
    model = next(each for each in MODELS if each.exponent is None)
    found = fitted(points, model, robust=points.of_independent_errors)
    off = found.residuals / found.standard_errors
    return [(points.labels[i], float(off[i])) for i in np.flatnonzero(np.abs(off) > _FAR).tolist()]


def judged(fits: Sequence[LawFit]) -> Verdict:
    """Return the verdict on the first of several laws fitted to the same points.

    Akaike's criteria decide: another law that is better by more than `_CLEAR` refutes it, and it holds if a constant
    eps and nu = 1 are worse by `_CLEAR` or more. If eps scatters more than its standard errors say, whatever the law,
    they are compared with that scatter.
    """
    main, others = fits[0], {fit.model.name: fit for fit in fits[1:]}
    number, free = len(main.points), others.get("free exponent")
    if main.points.known and all(stats.chi2.sf(fit.chi2, fit.degrees) < _POOR for fit in fits):
        further = [fit.model for fit in fits if fit.model not in MODELS]
        again = judged(compared(replace(main.points, known=False), further, robust=main.robust))
        text = (
            f"eps scatters by more than its standard errors say, whatever the law (chi^2 = {main.chi2:.1f} for "
            f"{main.degrees} degrees of freedom): the verdict is the one with --scatter, which fits the rest"
        )
        return replace(
            again, word="holds with a limit" if again.word == "holds" else again.word, reasons=(text, *again.reasons)
        )
    low, high = (THEORY, THEORY) if free is None else free.interval(_LEVEL, 1)
    of_theory = low - _SLACK <= THEORY <= high + _SLACK
    trend: tuple[str, ...] = ()
    if free is not None:
        span = f"p = {free.exponent:.2g}, from {low:.2g} to {high:.2g} ({100 * _LEVEL:.0f} %)"
        trend = (f"1 - eps ~ v^p at small v with {span}; theory: {THEORY:g}",)
    best = min((fit for fit in fits if fit is not free or not of_theory), key=lambda fit: fit.aic)
    ahead = main.aic - best.aic
    if ahead > _CLEAR:
        return Verdict("does not hold", (f"{_named(best)} fits better: its AIC is less by {ahead:.1f}", *trend))
    rivals = [fit for name, fit in others.items() if name in ("constant", "hunt-crossley")]
    open_ones = [fit for fit in rivals if not fit.aic - main.aic >= _CLEAR]
    if number >= _FEWEST and not open_ones:
        if of_theory:
            return Verdict("holds", trend)
        return Verdict("holds with a limit", (f"the exponent is near {THEORY:g}, but not within its errors", *trend))
    few = () if number >= _FEWEST else (f"{number} points are too few: {_FEWEST} or more decide",)
    if not open_ones:
        return Verdict("undecided", (*few, *trend))
    names = " and ".join(_named(fit) for fit in open_ones)
    better = f"; {_named(best)} is better, its AIC less by {ahead:.1f}" if 0 < ahead < math.inf else ""
    ratios = [deciding_ratio(main, fit.model) for fit in open_ones]
    ratio = None if None in ratios else max(each for each in ratios if each is not None)
    reasons = (*few, f"the data do not exclude {names}{better}", *trend, _advice(main, ratio))
    return Verdict("undecided", reasons, ratio)


def contact_law(fits: Sequence[LawFit], verdict: Verdict) -> ContactLaw:
    """Return the law to go on with: the viscoelastic one if it holds, else the one of the least AIC."""
    holds = verdict.word in ("holds", "holds with a limit")
    for fit in fits[:1] if holds else sorted(fits, key=lambda fit: fit.aic):
        name = {"constant": "linear", "free exponent": _law_of_exponent(fit.exponent)}.get(
            fit.model.name, fit.model.name
        )
        if name is not None:
            break
    assert name is not None  # only the free exponent has no law, and it is not alone
    return ContactLaw(name, float(fit.model.epsilon(fit.parameters[:1])[0]), fit.middle)  # without weight


def _law_of_exponent(p: float) -> str | None:
    """Return a law of contact with nearly p = 2/nu - 1: Hertz's force, and x^b in 16ths or fourths.

    Where that b would be negative, the damping is linear and the force another one. None: there is no such law.
    """
    b = 1.25 * (1 + p) - 1
    parts = 16 if b <= 1.5 else 4  # so that the law is one (`Law`)
    try:
        if b >= 0:
            return str(Law("3/2", Fraction(round(parts * b), parts)))
        return str(Law(Fraction(round(4 * (2 / (1 + p) - 1)), 4), 0))
    except (ValueError, ZeroDivisionError):
        return None


def _advice(main: LawFit, ratio: float | None) -> str:
    """Return which speeds would decide."""
    slow, fast = float(main.points.speed.min()), float(main.points.speed.max())
    number = max(len(main.points), _FEWEST)
    if ratio is None:
        return f"no range of speeds with {number} points and such errors would decide"
    if ratio <= fast / slow:
        return f"{2 * number} points at these speeds would probably decide"
    reach = math.sqrt(ratio)
    return (
        f"{number} points with these errors would probably decide if their speeds went from {main.middle / reach:.3g} "
        f"to {main.middle * reach:.3g} m/s ({ratio:.3g} times), instead of {slow:.3g} to {fast:.3g} m/s "
        f"({fast / slow:.3g} times)"
    )


def _named(fit: LawFit) -> str:
    return {
        "constant": "a constant eps (nu = 2, spring-dashpot)",
        "hunt-crossley": "nu = 1 (Hunt-Crossley)",
        "free exponent": f"an exponent of {fit.exponent:.2g}",
        "viscoelastic": "the viscoelastic law",
    }.get(fit.model.name, f"the law {fit.model.name}")


def deciding_ratio(main: LawFit, other: Model) -> float | None:
    """Return the ratio of speeds, evenly spaced in their logarithm, that would tell a true law from another one.

    The points are as many as were measured, and at least `_FEWEST`. Their standard error is the harmonic mean of the
    squared ones. The difference of the criteria, of mean d and standard deviation 2 sqrt(d), then exceeds `_CLEAR` in
    five of six measurements. Where the fit finds the scatter, the difference is n ln(1 + d/n).

    Returns
    -------
    float or None
        None if none up to 1e8 is enough.
    """
    n = max(len(main.points), _FEWEST)
    wanted = _TOLD if main.points.known else n * math.expm1(_TOLD / n)
    error = max(1 / math.sqrt(float(np.mean(1 / main.standard_errors**2))), 1e-10)

    def told(log_ratio: float) -> float:
        speed = main.middle * np.exp(np.linspace(-0.5, 0.5, n) * log_ratio)
        truth = main.at(speed)
        trial = LawFit(main.points, other, main.middle, np.ones(other.parameters), 0.0, False)

        def residuals(log_b: FloatArray) -> FloatArray:
            return np.asarray((trial.at(speed, np.exp(log_b)) - truth) / error)

        found = optimize.least_squares(residuals, [math.log(max(float(main.parameters[0]), 1e-9))])
        return 2 * float(found.cost) - wanted

    bottom, top = 1e-3, math.log(_WIDEST)
    if told(top) < 0:
        return None
    if told(bottom) >= 0:
        return math.exp(bottom)
    return math.exp(float(optimize.brentq(told, bottom, top, xtol=1e-3)))
