"""Verdict on the viscoelastic law: whether measured points follow it better than other laws."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Literal

import numpy as np
from scipy import optimize, special

from viscopade.arrays.checked import FloatArray
from viscopade.fitting.likelihood import LawFit, Model, fit_law
from viscopade.fitting.points import Points
from viscopade.fitting.read import FAST
from viscopade.theory.law import VISCOELASTIC, Law, law_of

Word = Literal["holds", "holds with a limit", "does not hold", "undecided"]

MODELS = (
    Model.from_law("viscoelastic", VISCOELASTIC),
    Model("constant", VISCOELASTIC, 0.0),
    Model.from_law("hunt-crossley", law_of("hunt-crossley")),
    Model("free exponent", VISCOELASTIC, None),
)
"""Compared laws: nu = 5/3; a constant eps, nu = 2; nu = 1; and 1 - eps ~ v^p at small v, with the curve of 5/3."""

THEORY = float(2 * VISCOELASTIC.c)
"""The exponent p of the viscoelastic law, 1/5."""

_LEVEL = 0.95  # of the interval of p: the customary level
_SLACK = 0.01  # of p, which flights and soft contacts shift: by 0.002 in LAMMPS (`viscopade_lab.studies.coverage`)
CLEAR = 6.0
"""Difference of Akaike's criteria that decides: the other law is exp(3) = 20 times less likely.

With it at most 3.0 % of simulated sets that follow the law are rejected, and at most 1.5 % with a constant eps get
"holds" (docs/results/fit.md).
"""
# Mean difference d of the criteria from which on a measurement decides in five of six cases: the difference has the
# standard deviation 2 sqrt(d), and one of six Gaussian values is below mean - deviation: d - 2 sqrt(d) = CLEAR.
_DECISIVE = (1 + math.sqrt(1 + CLEAR)) ** 2
# Probability of a larger chi^2 below which a fit is rejected: one in a thousand good sets. Chosen by hand; the stated
# errors of a real measurement are themselves rough.
_POOR = 1e-3
# Standard errors from which on a point is an outlier: 7 in a million Gaussian ones. Chosen by hand, so that a data set
# of a thousand points without outliers names none.
_FAR = 4.5
_FEW = 6  # points; with fewer, b, p and the scatter take more of them than they leave, and hide an outlier
FEWEST = 5
"""Number of points; fewer do not show that a law holds. By hand: wrong verdicts are counted from five points on."""
_WIDEST = 1e8  # largest ratio of speeds that is tried: from a micrometre a second to 100 m/s, more than any experiment


@dataclass(frozen=True)
class Verdict:
    """Verdict on a law, with its reasons.

    Attributes
    ----------
    word : str
        "holds": a constant eps and nu = 1 are excluded. "holds with a limit": they are excluded, but the exponent or
        the scatter does not agree. "does not hold": another law fits better. "undecided": the data do not tell.
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
    """Power law of contact with its eps at a speed, which determines the damping.

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


def compare_laws(points: Points, laws: Sequence[Model] = (), *, robust: bool = False) -> tuple[LawFit, ...]:
    """Return the fits of `MODELS` and of other laws to points; the viscoelastic one first.

    Laws with too many parameters for the points are left out.
    """
    models = [model for model in (*MODELS, *laws) if model is MODELS[0] or model.parameters < len(points)]
    return tuple(fit_law(points, model, robust=robust) for model in models)


def outliers(points: Points) -> list[tuple[str, float]]:
    """Return labels of points far from any law, each with its distance in standard errors.

    The law with a free exponent is fitted with errors of Student's t, to which outliers matter little, and with a
    scatter that is that of the other points. The errors of bounces are taken as independent, because Student's t is a
    distribution of one error of each point. Fewer than `_FEW` points and means of groups have no outliers.
    """
    if len(points) < _FEW or points.counts is not None:
        return []
    model = next(model for model in MODELS if model.exponent is None)
    fit = fit_law(points.with_independent_errors(), model, robust=True)
    # Residuals in standard errors, with the fitted scatter, which outliers hardly change
    deviations = fit.residuals / fit.standard_errors
    return [(points.labels[i], float(deviations[i])) for i in np.flatnonzero(np.abs(deviations) > _FAR).tolist()]


def judged(points: Points, laws: Sequence[Model] = (), *, robust: bool = False) -> tuple[tuple[LawFit, ...], Verdict]:
    """Return the fits of `compare_laws`, and the verdict of `judge` on them.

    If eps scatters more than its standard errors under every law, both are those with this scatter.
    """
    fits = compare_laws(points, laws, robust=robust)
    main = fits[0]
    # chdtrc(d, x): the probability that chi^2 with d degrees of freedom exceeds x.
    if not points.errors_complete or any(special.chdtrc(fit.degrees, fit.chi2) >= _POOR for fit in fits):
        return fits, judge(fits)
    with_scatter = compare_laws(replace(points, errors_complete=False), laws, robust=robust)
    judgement = judge(with_scatter)
    text = (
        f"eps scatters more than its standard errors, for every law (chi^2 = {main.chi2:.1f} for {main.degrees} "
        "degrees of freedom): all results are those with --scatter, which fits the additional scatter"
    )
    word: Word = "holds with a limit" if judgement.word == "holds" else judgement.word
    return with_scatter, replace(judgement, word=word, reasons=(text, *judgement.reasons))


def judge(fits: Sequence[LawFit]) -> Verdict:
    """Return the verdict on the first of several laws fitted to the same points.

    Akaike's criteria decide: the law does not hold if another one is better by more than `CLEAR`, and it holds if a
    constant eps and nu = 1 are worse by `CLEAR` or more. `fits` are those of `compare_laws`.
    """
    main, fits_by_name = fits[0], {fit.model.name: fit for fit in fits[1:]}
    number, free_exponent = len(main.points), fits_by_name.get("free exponent")
    # Whether the interval of p (parameter 1) reaches the theory's 1/5: if so, the free exponent is no rival.
    low, high = (THEORY, THEORY) if free_exponent is None else free_exponent.interval(_LEVEL, 1)
    agrees_with_theory = low - _SLACK <= THEORY <= high + _SLACK
    trend: tuple[str, ...] = ()
    if free_exponent is not None:
        # Two digits: the interval is rarely narrower than 0.01. _LEVEL in per cent.
        span = f"p = {free_exponent.exponent:.2g}, from {low:.2g} to {high:.2g} ({100 * _LEVEL:.0f} %)"
        trend = (f"1 - eps ~ v^p at small v with {span}; theory: {THEORY:g}",)
    best = min((fit for fit in fits if fit is not free_exponent or not agrees_with_theory), key=lambda fit: fit.aic)
    # Akaike's criteria: a better law refutes this one.
    ahead = main.aic - best.aic
    if ahead > CLEAR:
        return Verdict("does not hold", (f"{_law_in_words(best)} fits better: its AIC is less by {ahead:.1f}", *trend))
    # It holds if both named rivals are worse by `CLEAR`.
    rivals = [fit for name, fit in fits_by_name.items() if name in ("constant", "hunt-crossley")]
    not_excluded = [fit for fit in rivals if not fit.aic - main.aic >= CLEAR]
    if number >= FEWEST and not not_excluded:
        if agrees_with_theory:
            return Verdict("holds", trend)
        return Verdict("holds with a limit", (f"the exponent is near {THEORY:g}, but not within its errors", *trend))
    # Undecided: say what is missing, and which speeds would decide.
    few = () if number >= FEWEST else (f"{number} points are too few: {FEWEST} or more decide",)
    if not not_excluded:
        return Verdict("undecided", (*few, *trend))
    names = " and ".join(_law_in_words(fit) for fit in not_excluded)
    better = f"; {_law_in_words(best)} is better, its AIC less by {ahead:.1f}" if 0 < ahead < math.inf else ""
    # All of them are excluded at the largest of their ratios of speeds, if each has one.
    ratios = [deciding_ratio(main, fit.model) for fit in not_excluded]
    ratio = None if None in ratios else max(value for value in ratios if value is not None)
    # Speeds that the reader of files would doubt are no advice.
    if ratio is not None and main.middle * math.sqrt(ratio) > FAST:
        ratio = None
    reasons = (*few, f"the data do not exclude {names}{better}", *trend, _advice(main, ratio))
    return Verdict("undecided", reasons, ratio)


def contact_law(fits: Sequence[LawFit], verdict: Verdict) -> ContactLaw:
    """Return the viscoelastic law if it holds by the `verdict`, or else the law of `fits` with the least AIC.

    Its damping is given by eps at v_0, the geometric mean of the measured speeds.
    """
    holds = verdict.word in ("holds", "holds with a limit")
    for fit in fits[:1] if holds else sorted(fits, key=lambda fit: fit.aic):
        # The names that other commands take: a constant eps is that of a linear spring and dashpot.
        name = {"constant": "linear", "free exponent": _law_of_exponent(fit.exponent)}.get(
            fit.model.name, fit.model.name
        )
        if name is not None:
            break
    assert name is not None  # only the free exponent may have no law, and other laws are always fitted
    # The first parameter b is kappa at v_0: this eps is the one without weight.
    return ContactLaw(name, float(fit.model.epsilon(fit.parameters[:1])[0]), fit.middle)


def _law_of_exponent(p: float) -> str | None:
    """Return the name A,B of a law with nearly p = 2/nu - 1: Hertz's force, and damping x^b with b in 16ths or fourths.

    If that b would be negative, the damping is linear, and the exponent of the force gives p. None: there is no such
    law.
    """
    # nu = (a + 1)/(b + 1) for the forces x^a and x^b dx/dt. With a = 3/2, p = 2/nu - 1 gives b = 5/4 (1 + p) - 1;
    # with b = 0, a = 2/(1 + p) - 1.
    b = 1.25 * (1 + p) - 1
    # A step of 1/16 of b changes p by 4/5 of it, 0.05, about the error of a good fit. `Law` accepts exponents for which
    # m (a + 1) and m (b + 1) are integers up to 40: with m = 16 that is a = 3/2 and b <= 3/2. With m = 4 it is b <= 9,
    # which is p <= 7, more than a fit tries, and a <= 9, which is p >= -0.8.
    denominator = 16 if b <= 1.5 else 4
    try:
        if b >= 0:
            return str(Law("3/2", Fraction(round(denominator * b), denominator)))
        # a in fourths, m = 4, because it is above 3/2 here
        return str(Law(Fraction(round(4 * (2 / (1 + p) - 1)), 4), 0))
    except (ValueError, ZeroDivisionError):
        return None


def _advice(main: LawFit, ratio: float | None) -> str:
    """Return the range of speeds that would decide, in words; `ratio` is that of `deciding_ratio` for a fit `main`."""
    slow, fast = float(main.points.speed.min()), float(main.points.speed.max())
    number = max(len(main.points), FEWEST)
    if ratio is None:
        return f"no range of speeds up to {FAST:g} m/s with {number} points and such errors would decide"
    # The range was wide enough, and the data decided nothing by chance, in one of six cases: twice the points.
    if ratio <= fast / slow:
        return f"{2 * number} points at these speeds would probably decide"
    # A range around the geometric mean of the speeds
    reach = math.sqrt(ratio)
    return (
        f"{number} points with these errors would probably decide if their speeds went from {main.middle / reach:.3g} "
        f"to {main.middle * reach:.3g} m/s ({ratio:.3g} times), instead of {slow:.3g} to {fast:.3g} m/s "
        f"({fast / slow:.3g} times)"
    )


def _law_in_words(fit: LawFit) -> str:
    """Return the law of a fit in words, for a sentence."""
    # The names are those of `MODELS`; other laws have the name that the user gave.
    return {
        "constant": "a constant eps (nu = 2, spring-dashpot)",
        "hunt-crossley": "nu = 1 (Hunt-Crossley)",
        "free exponent": f"an exponent of {fit.exponent:.2g}",
        "viscoelastic": "the viscoelastic law",
    }.get(fit.model.name, f"the law {fit.model.name}")


def deciding_ratio(main: LawFit, other: Model) -> float | None:
    """Return the ratio of the largest to the smallest speed that would distinguish a true law from another one.

    The true law is that of the fit `main`, and `other` the model to exclude. The number of points is the measured one,
    but at least `FEWEST`; their speeds are evenly spaced in the logarithm, and the square of their standard error is
    the harmonic mean of the measured squares. The difference of the criteria has mean d and standard deviation
    2 sqrt(d), and exceeds `CLEAR` in five of six measurements. If the fit finds the scatter, the difference is
    n ln(1 + d/n).

    Returns
    -------
    float or None
        None if a ratio of 1e8 is not enough.
    """
    n = max(len(main.points), FEWEST)
    # The mean d that decides; n ln(1 + d/n) = _DECISIVE with a fitted scatter.
    deciding_misfit = _DECISIVE if main.points.errors_complete else n * math.expm1(_DECISIVE / n)
    # sigma^2 is the harmonic mean of the squares; at least 1e-10, for data that follow the law to round-off: the least
    # scatter in a fit.
    error = max(1 / math.sqrt(float(np.mean(1 / main.standard_errors**2))), 1e-10)

    def excess(log_ratio: float) -> float:
        """Return chi^2 of the other law, fitted to the true one for the ratio exp(log_ratio), less what decides."""
        # ln v from -1/2 to 1/2 of ln(ratio) around the mean
        speed = main.middle * np.exp(np.linspace(-0.5, 0.5, n) * log_ratio)
        truth = main.epsilon(speed)
        trial = LawFit(main.points, other, main.middle, np.ones(other.parameters), 0.0, False)

        def residuals(log_b: FloatArray) -> FloatArray:
            return np.asarray((trial.epsilon(speed, np.exp(log_b)) - truth) / error)

        # The search starts with b of the true law; ln b is finite if b is 0, too.
        nearest = optimize.least_squares(residuals, [math.log(max(float(main.parameters[0]), 1e-9))])
        return 2 * float(nearest.cost) - deciding_misfit  # SciPy's cost is half of chi^2

    # The ratio lies between exp(0.001), which is one speed for any experiment, and _WIDEST. `xtol` is that of its
    # logarithm, so the ratio is found to 0.1 %: the report has three digits.
    bottom, top = 1e-3, math.log(_WIDEST)
    if excess(top) < 0:
        return None
    if excess(bottom) >= 0:
        return math.exp(bottom)
    return math.exp(float(optimize.brentq(excess, bottom, top, xtol=1e-3)))
