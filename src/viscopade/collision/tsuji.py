"""Tsuji's damping, proportional to x^(1/4): a coefficient of restitution independent of the speed.

Many programs damp Hertz's force in the way of Tsuji, Tanaka and Ishida, so that eps is the same for all speeds:

    m x'' = -k x^(3/2) - alpha sqrt(m k) x^(1/4) x'.

With q = x^(5/4) and the stretched time ds = sqrt(5 k/(4 m)) x^(1/4) dt it is the damped linear oscillator

    q'' + 2 zeta q' + q = 0,    q' ~ x',    zeta = alpha/sqrt(5),

so eps is a function of the damping ratio zeta alone (`derivations/12_tsuji.py`). With zeta = cos(psi):

    contact ends at x = 0:       eps = exp(-pi cot(psi)), and 0 from zeta = 1 on;
    contact ends at zero force:  eps = exp(-2 psi cot(psi)), and with zeta = cosh(chi) exp(-2 chi coth(chi)) beyond 1.

If a force that would pull is clipped, max(0, F), contact ends at zero force: from there on the speed is constant, and F
would stay negative.

A constant eps instead of the viscoelastic one is wrong at all speeds except one; `viscopade.simulators.stated` states
the error.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal

from viscopade.arguments import refusal
from viscopade.arrays import checked
from viscopade.arrays.checked import Accepted, Number

End = Literal["force", "position"]

_RATIO = Accepted("a finite number >= 0", lambda x: 0 <= x < math.inf)
_EPSILON = Accepted("a number > 0 and <= 1", lambda x: 0 < x <= 1)
_LOSS = Accepted("a number >= 0 and < 1", lambda x: 0 <= x < 1)
_STEPS = 200


def epsilon(damping_ratio: Number, end: End = "force") -> float:
    """Return the coefficient of restitution of a damping ratio.

    Parameters
    ----------
    damping_ratio : float
        zeta >= 0.
    end : {"force", "position"}
        Whether contact ends where the force vanishes or is clipped, or where the compression vanishes.

    Returns
    -------
    float
        At the end "position" it is 0 from zeta = 1 on: the spheres do not part.

    Raises
    ------
    TypeError, ValueError
        If the damping ratio is negative or not finite, or the end is not known.

    Examples
    --------
    >>> f"{epsilon(0.5):.6f} {epsilon(0.5, 'position'):.6f}"
    '0.298436 0.163034'
    """
    return math.exp(-_decrement(damping_ratio, end))


def one_minus_epsilon(damping_ratio: Number, end: End = "force") -> float:
    """Return 1 - eps without cancellation; arguments and errors as for `epsilon`."""
    return -math.expm1(-_decrement(damping_ratio, end))


def damping_ratio(
    epsilon: Number | None = None, *, one_minus_epsilon: Number | None = None, end: End = "force"
) -> float:
    """Return the damping ratio zeta that gives the wanted coefficient of restitution.

    Parameters
    ----------
    epsilon, one_minus_epsilon : float
        Exactly one of the two: eps > 0 and <= 1, or 1 - eps >= 0 and < 1, for nearly elastic collisions.
    end : {"force", "position"}
        As for `epsilon`.

    Returns
    -------
    float
        Zeta >= 0; below 1 at the end "position".

    Raises
    ------
    TypeError
        If not exactly one of epsilon and one_minus_epsilon is given, or it is not a real number.
    ValueError
        If it is out of range, or `end` is not one of the two.

    Examples
    --------
    >>> f"{damping_ratio(0.9):.6f} {damping_ratio(0.9, end='position'):.6f}"
    '0.034265 0.033518'
    """
    wanted = _wanted(epsilon, one_minus_epsilon)
    if _checked(end) == "position":
        return wanted / math.hypot(wanted, math.pi)
    # 2 zeta g(zeta), where g falls from pi/2 at 0 to 1 at 1: zeta < 1 lies between wanted/pi and wanted/2, and for
    # zeta > 1, chi = acosh(zeta) lies between wanted/2 - 1 and wanted/2, because x <= x coth(x) <= x + 1.
    if wanted <= 2:
        return _bisected(lambda zeta: 2 * zeta * _g(zeta), wanted, wanted / math.pi, wanted / 2)
    return math.cosh(_bisected(lambda chi: 2 * chi / math.tanh(chi), wanted, max(wanted / 2 - 1, 0.0), wanted / 2))


def _wanted(epsilon: Number | None, loss: Number | None) -> float:
    """Return -ln eps."""
    if (epsilon is None) == (loss is None):
        given = "neither" if loss is None else "both"
        raise TypeError(f"epsilon and one_minus_epsilon: {given} given, expected exactly one of them")
    if epsilon is not None:
        return -math.log(checked.number("epsilon", epsilon, _EPSILON)) + 0.0
    return -math.log1p(-checked.number("one_minus_epsilon", loss, _LOSS)) + 0.0


def _checked(end: str) -> str:
    if end not in ("force", "position"):
        raise ValueError(refusal("end", end, "'force' or 'position'"))
    return end


def _decrement(damping_ratio: Number, end: End) -> float:
    """Return -ln eps."""
    zeta = checked.number("damping_ratio", damping_ratio, _RATIO)
    if _checked(end) == "force":
        return 2 * zeta * _g(zeta)
    return math.inf if zeta >= 1 else math.pi * zeta / math.sqrt((1 - zeta) * (1 + zeta))


def _g(zeta: float) -> float:
    """Return arccos(zeta)/sqrt(1 - zeta^2), continued smoothly beyond 1; from |1 - zeta|, so nothing cancels."""
    half = abs(1 - zeta) / 2
    if half == 0:
        return 1.0
    root = math.sqrt(half)
    angle = 2 * (math.asin(root) if zeta < 1 else math.asinh(root))
    return angle / (2 * root * math.sqrt((1 + zeta) / 2))


def _bisected(function: Callable[[float], float], wanted: float, low: float, high: float) -> float:
    """Return the point between two bounds at which an increasing function has a value, by bisection."""
    for _ in range(_STEPS):
        middle = (low + high) / 2
        if not low < middle < high:
            break
        low, high = (middle, high) if function(middle) < wanted else (low, middle)
    return high
