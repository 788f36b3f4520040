"""The formulas behind most programs: the damping of a few laws for a wanted eps.

The contact m x'' + 2 zeta sqrt(k m) x' + k x = 0 has eps = exp(-pi zeta/sqrt(1 - zeta^2)) if it ends at x = 0, and a
larger one if it ends where the force vanishes. Hertz' spring with Tsuji's damping has the same two functions of zeta
(`viscopade.collision.tsuji`). kappa is 2 zeta for the first, sqrt(5) zeta for the second.
"""

from __future__ import annotations

from typing import Any

from mpmath import mp

from viscopade.audit.program import wanted_kappa
from viscopade.collision import tsuji
from viscopade.theory.law import VISCOELASTIC, law_of

LINEAR, LINEAR_RETURN = law_of("linear"), law_of("linear", "return")
TSUJI, TSUJI_RETURN = law_of("tsuji"), law_of("tsuji", "return")


def ratio_for_return(e: Any) -> Any:
    """Return zeta for eps = e at the end x = 0, -ln e/sqrt(pi^2 + ln^2 e), of an mpmath number."""
    loss = -mp.log(e)
    return loss / mp.sqrt(mp.pi**2 + loss**2)


def linear_kappa(e: Any) -> Any:
    """Return kappa of the linear spring with that damping ratio."""
    return 2 * ratio_for_return(e)


def tsuji_kappa(e: Any) -> Any:
    """Return kappa of Hertz' spring and Tsuji's damping with that damping ratio."""
    return mp.sqrt(5) * ratio_for_return(e)


def ratio_at_force_end(e: Any) -> Any:
    """Return zeta for eps = e at the end where the force vanishes, to 15 digits."""
    return mp.mpf(tsuji.damping_ratio(float(e)))


def viscoelastic_kappa(e: Any) -> Any:
    """Return kappa of the viscoelastic law for eps = e, as `viscopade.simulators` do."""
    return wanted_kappa(VISCOELASTIC, mp.nstr(e, 20))
