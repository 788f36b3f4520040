"""Verdict on the viscoelastic law: what measured points say for it and against it, beside other laws."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy import optimize, stats

from viscopade.arrays.checked import FloatArray
from viscopade.fitting.likelihood import LawFit, Model, fitted
from viscopade.fitting.points import Points
from viscopade.theory.law import VISCOELASTIC, Law

Word = Literal["holds", "holds with a limit", "does not hold"]

MODELS = (
    Model.of("viscoelastic", VISCOELASTIC),
    Model("constant", VISCOELASTIC, 0.0),
    Model.of("hunt-crossley", Law(1, 1)),
    Model("free exponent", VISCOELASTIC, None),
)
"""What is compared: nu = 5/3; a constant eps, nu = 2; nu = 1; and 1 - eps ~ v^p at small v, with the curve of 5/3."""

THEORY = float(2 * VISCOELASTIC.c)
"""The exponent p of the viscoelastic law, 1/5."""

_REFUTED, _DOUBTED = 0.99, 0.95  # levels of the intervals of p that must hold 1/5
_SLACK = 0.01  # of p, which flights and soft contacts shift: by 0.002 in LAMMPS (`viscopade_lab.studies.coverage`)
_CLEAR = 6.0  # difference of Akaike's criteria that decides: the other law is exp(3) = 20 times less likely
_TOLD = (1 + math.sqrt(1 + _CLEAR)) ** 2
_PREFERRED = 4.0
_POOR = 1e-3  # probability of so large a chi^2
_FAR = 4.5  # standard errors, of a point that is named as an outlier
_FEW = 6
_WIDEST = 1e8  # ratio of speeds


@dataclass(frozen=True)
class Verdict:
    """Verdict on a law, with its reasons.

    Attributes
    ----------
    word : str
        "holds", "holds with a limit" or "does not hold".
    reasons : tuple of str
        Sentences.
    ratio : float or None
        Ratio of the fastest to the slowest speed at which as many points with the same errors would decide.
    """

    word: Word
    reasons: tuple[str, ...]
    ratio: float | None = None


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
    """Return the verdict on the first of several laws fitted to the same points."""
    main, others = fits[0], {fit.model.name: fit for fit in fits[1:]}
    if not math.isfinite(main.aic):
        return Verdict("holds with a limit", (f"{len(main.points)} points are too few to compare laws",))
    free = others.get("free exponent")
    best = min(fits, key=lambda fit: fit.aic)
    trend = "" if free is None else _trend(free)
    ahead = main.aic - best.aic
    if free is not None and ahead > _PREFERRED:
        low, high = free.interval(_REFUTED, 1)
        if not low - _SLACK <= THEORY <= high + _SLACK:
            return Verdict("does not hold", (f"{_named(best)} fits better: its AIC is less by {ahead:.1f}", trend))
    poor = main.points.known and stats.chi2.sf(main.chi2, main.degrees) < _POOR
    if poor:
        text = (
            f"chi^2 = {main.chi2:.1f} for {main.degrees} degrees of freedom: eps scatters by more than its standard "
            "errors say"
        )
        if free is not None and stats.chi2.sf(free.chi2, free.degrees) >= _POOR:
            return Verdict("does not hold", (text, trend))
        return Verdict("holds with a limit", (f"{text}, and so for every law; --scatter fits the rest", trend))
    if free is not None:
        low, high = free.interval(_DOUBTED, 1)
        if not low - _SLACK <= THEORY <= high + _SLACK:
            return Verdict("holds with a limit", (f"the exponent is near {THEORY:g}, but not within its errors", trend))
    rivals = [fit for name, fit in others.items() if name in ("constant", "hunt-crossley")]
    low, high = (-math.inf, math.inf) if free is None else free.interval(_DOUBTED, 1)
    open_ones = [fit for fit in rivals if not fit.aic - main.aic >= _CLEAR or low <= fit.exponent <= high]
    if not open_ones:
        return Verdict("holds", tuple(filter(None, (trend,))))
    names = " and ".join(_named(fit) for fit in open_ones)
    ratios = [deciding_ratio(main, fit.model) for fit in open_ones]
    ratio = None if None in ratios else max(each for each in ratios if each is not None)
    fast, slow = main.points.speed.max(), main.points.speed.min()
    if ratio is not None and ratio <= fast / slow:
        advice = "as many points again would probably decide"
    elif ratio is None:
        advice = "no range of speeds with so few points and such errors would decide"
    else:
        advice = (
            f"{len(main.points)} points with these errors would decide if the fastest were {ratio:.2g} times as fast "
            f"as the slowest, instead of {fast / slow:.2g} times"
        )
    return Verdict(
        "holds with a limit", tuple(filter(None, (f"the data do not exclude {names}", trend, advice))), ratio
    )


def _named(fit: LawFit) -> str:
    return {
        "constant": "a constant eps (nu = 2, spring-dashpot)",
        "hunt-crossley": "nu = 1 (Hunt-Crossley)",
        "free exponent": f"an exponent of {fit.exponent:.2g}",
        "viscoelastic": "the viscoelastic law",
    }.get(fit.model.name, f"the law {fit.model.name}")


def _trend(free: LawFit) -> str:
    low, high = free.interval(0.95, 1)
    span = f"from {low:.2g} to {high:.2g} (95 %)"
    return f"1 - eps ~ v^p at small v with p = {free.exponent:.2g}, {span}; theory: {THEORY:g}"


def deciding_ratio(main: LawFit, other: Model) -> float | None:
    """Return the ratio of speeds, evenly spaced in their logarithm, that would tell a true law from another one.

    The points are as many as were measured. Their standard error is the harmonic mean of the squared ones. The
    difference of the criteria, of mean d and standard deviation 2 sqrt(d), then exceeds `_CLEAR` in five of six
    measurements.

    Returns
    -------
    float or None
        None if none up to 1e8 is enough.
    """
    n = len(main.points)
    error = max(1 / math.sqrt(float(np.mean(1 / main.standard_errors**2))), 1e-10)

    def told(log_ratio: float) -> float:
        speed = main.middle * np.exp(np.linspace(-0.5, 0.5, n) * log_ratio)
        truth = main.at(speed)
        trial = LawFit(main.points, other, main.middle, np.ones(other.parameters), 0.0, False)

        def residuals(log_b: FloatArray) -> FloatArray:
            return np.asarray((trial.at(speed, np.exp(log_b)) - truth) / error)

        found = optimize.least_squares(residuals, [math.log(max(float(main.parameters[0]), 1e-9))])
        return 2 * float(found.cost) - _TOLD

    bottom, top = 1e-3, math.log(_WIDEST)
    if told(top) < 0:
        return None
    if told(bottom) >= 0:
        return math.exp(bottom)
    return math.exp(float(optimize.brentq(told, bottom, top, xtol=1e-3)))
