"""Size of the effects that a fit of bounces may neglect: the weight during contacts, drag in air, and adhesion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import optimize

from viscopade.arrays.checked import FloatArray
from viscopade.collision.spheres import Pair, Sphere
from viscopade.collision.weight import COUNTS
from viscopade.fitting.flight import Flight
from viscopade.fitting.likelihood import LawFit
from viscopade.fitting.read import Recording
from viscopade.fitting.verdict import CLEAR, FEWEST
from viscopade.theory.law import VISCOELASTIC

AIR = 1.2
"""Density of air in kg/m^3, at 20 C and 1013 hPa."""

# A table-tennis ball: 4 cm and 2.7 g by the rules of the game. Few balls are lighter for their size, so drag on another
# body is smaller. Its elastic constants do not matter in flight.
_LIGHT = Sphere(radius=0.02, mass=0.0027, young_modulus=1, poisson_ratio=0, dissipative_constant=0)
# Rounds of the iteration for the sticking speed. Each makes the error less than half as large, because E(v) falls at
# most as v^(-1/3). So 1e-6 of it is left, and the report has two digits.
_ROUNDS = 20
# First guesses of the energy that the slowest bodies lose by adhesion, over their energy of impact. A search from a
# wrong one may end where all bodies stick: by hand, four that spread over 0 to 1.
_LOSSES = (0.03, 0.1, 0.3, 0.6)
_LEAST_DRAG = 1e-3  # change of eps from which on drag is reported, by hand: below the errors of any real bounce


@dataclass(frozen=True)
class WeightInContacts:
    """Weight during the contacts of measured points.

    Attributes
    ----------
    fitted : bool
        Whether the fit includes it.
    shares : tuple of float, or None
        g t_c/v of the fastest and the slowest point, with the contact time without damping; None if it is not known.
    sentence : str
        A sentence for the report, without its full stop.
    """

    fitted: bool
    shares: tuple[float, float] | None
    sentence: str

    @property
    def warns(self) -> bool:
        """Whether it is neglected although it matters."""
        return not self.fitted and self.shares is not None and self.shares[1] >= COUNTS


def weight_in_contacts(recorded: Recording, pair: Pair | None, gravity: float) -> WeightInContacts | None:
    """Return the size of the weight's effect; None if the body is not known to fall on a plane.

    Parameters
    ----------
    recorded : Recording
        Bounces fall on a plane; speeds may be those of two spheres.
    pair : Pair or None
        The bodies that collide, if known.
    gravity : float
        In m/s^2.
    """
    # The fastest and the slowest impact, and whether weight presses the bodies on each other
    points, falls = recorded.points, recorded.kind != "speeds"
    ends = np.array([points.speed.max(), points.speed.min()])
    on_wall = pair is not None and (pair.first.is_wall or pair.second.is_wall)
    if not falls and not on_wall:
        return None
    if not points.weight_speed and pair is None:
        # g t_c/v = COUNTS = 0.02, from which on texts warn of weight (it then increases a small loss by 1 %), gives
        # t_c, in ms: 1000 times that in s
        milliseconds = 1000 * COUNTS * ends[1] / gravity
        text = (
            f"it matters if the contact of the slowest bounce lasts {milliseconds:.2g} ms or more "
            f"(g t_c/v = {COUNTS:g})"
        )
        how = "--contact-time, or the material, includes it"
        return WeightInContacts(False, None, f"weight in contacts is neglected: {text}; {how}")
    # G = g T/v, with the pair's time scale T; g t_c/v = tau_c G
    loads = points.load(ends) if pair is None or points.weight_speed else gravity * pair.time_scale(ends) / ends
    fast, slow = (float(VISCOELASTIC.contact_time) * loads).tolist()
    span = f"{fast:.2g} to {slow:.2g}"
    if points.weight_speed:
        return WeightInContacts(True, (fast, slow), f"weight in contacts is in the fit: g t_c/v is {span}")
    text = f"if the sphere fell on the wall, g t_c/v is {span}, and the true damping is less than the fitted one"
    return WeightInContacts(False, (fast, slow), f"weight in contacts is neglected: {text}")


def drag(recorded: Recording, sphere: Sphere | None, gravity: float) -> str | None:
    """Return the largest change of eps that drag in air may cause, as a sentence; None if it is negligible.

    Each flight has the height or duration that its speed implies in vacuum. `recorded` has the measured points, their
    kind and sheets. If `sphere` is None, the sentence is about a table-tennis ball. `gravity` is in m/s^2.
    """
    # Data that have no flight, a body that air would carry, or a wrong scale of length
    body = sphere or _LIGHT
    if recorded.kind == "speeds" or body.density <= AIR or recorded.doubtful_scale:
        return None
    flight = Flight.of_sphere(body.radius, body.density, air_density=AIR, gravity=gravity)
    # In vacuum v = sqrt(2 g h) = g T/2: the same heights or durations, in air, have other speeds.
    before, after = recorded.points.speed, recorded.points.speed * recorded.points.epsilon
    if recorded.kind == "heights":
        fall, rise = (flight.launch_to(speed**2 / (2 * gravity)) for speed in (before, after))
    else:
        fall, rise = (flight.launch(2 * speed / gravity) for speed in (before, after))
    # eps in air, the speed of the rise over that at the end of the fall, minus the eps of the data
    changes = rise / flight.impact(fall) - recorded.points.epsilon
    k = int(np.argmax(np.abs(changes)))
    change, label = float(changes[k]), recorded.points.labels[k]
    if abs(change) < _LEAST_DRAG:
        return None
    # eps is 0 to 1: no drag changes it by more.
    if abs(change) > 1:
        place = label if len(recorded.read) > 1 else f"{recorded.read[0]['sheet']}: {label}"
        raise ValueError(
            f"{place}: in air drag would change eps by {change:.2g}: are the units of heights or times right? (--unit)"
        )
    whose = "" if sphere else " of a table-tennis ball (2.7 g, 4 cm)"
    how = "--air-density" if sphere else "--air-density with --radius and --mass"
    return f"drag is neglected: in air it would change eps{whose} by up to {change:+.2g}; {how} includes it"


def adhesion(fits: Sequence[LawFit]) -> str | None:
    """Return a sentence if eps falls at slow speeds as that of adhering bodies does, better than by any law; or None.

    Besides the energy that their law takes, adhering bodies lose about the same energy at every speed: eps^2 = E(v)^2 -
    (v_0/v)^2. The sticking speed is that at which this is 0.

    Parameters
    ----------
    fits : sequence of LawFit
        Laws fitted to the same points, the viscoelastic one first.
    """
    main = fits[0]
    points, errors, n = main.points, main.standard_errors, len(main.points)
    slowest = float(points.speed.min())
    if n < FEWEST:
        return None

    def residuals(parameters: FloatArray) -> FloatArray:
        """Return the residuals over their errors, for ln b and (v_0/slowest)^2."""
        # eps^2 = E(v)^2 - (v_0/v)^2
        log_b, loss_of_slowest = parameters
        epsilon = main.epsilon(points.speed, np.array([math.exp(log_b)]))
        lost = loss_of_slowest * (slowest / points.speed) ** 2
        return np.asarray((points.epsilon - np.sqrt(np.maximum(epsilon**2 - lost, 0))) / errors)

    # Where the root is cut off at 0 no slope leads back: the search starts with several losses of the slowest bodies.
    # ln b is finite if b is 0, too, because 1e-9 stands for less; exp(50) and exp(-50) are far beyond any damping, and
    # do not overflow.
    log_b = math.log(max(float(main.parameters[0]), 1e-9))
    searches = [optimize.least_squares(residuals, [log_b, loss], bounds=([-50, 0], [50, np.inf])) for loss in _LOSSES]
    best = min(searches, key=lambda search: float(search.cost))
    log_b, loss_of_slowest = best.x.tolist()
    # SciPy's cost is half of chi^2. Exact data have chi^2 = 0: 1e-12 a point keeps its logarithm finite.
    chi2 = max(2 * float(best.cost), 1e-12 * n)
    # Akaike's criterion of the law, with k parameters, minus that with v_0, which is one more; with a fitted scatter
    # chi^2 is the variance, up to a factor: n ln chi^2 replaces it. The penalty is 2 k + 2 k (k + 1)/(n - k - 1).
    gain = main.chi2 - chi2 if points.errors_complete else n * math.log(main.chi2 / chi2)
    k = 1 + (not points.errors_complete)
    penalty = math.inf if n <= k + 2 else 2 + 2 * (k + 1) * (k + 2) / (n - k - 2) - 2 * k * (k + 1) / (n - k - 1)
    ahead = gain - penalty
    if not ahead > max(CLEAR, main.aic - min(fit.aic for fit in fits)):
        return None
    # Below the sticking speed no energy is left for the rebound: E(v) v = v_0, solved by v = v_0/E(v).
    v_0 = slowest * math.sqrt(loss_of_slowest)
    sticking = v_0
    for _ in range(_ROUNDS):
        sticking = v_0 / float(main.epsilon(np.array([sticking]), np.exp(np.array([log_b])))[0])
    if not sticking < points.speed.max():  # no point would rebound
        return None
    return (
        f"slow points fall below the law as if the bodies adhered: eps^2 = E^2 - (v_0/v)^2, with v_0 = {v_0:.2g} m/s, "
        f"has an AIC less by {ahead:.1f}, and below about {sticking:.2g} m/s such bodies would stay together; "
        "`viscopade epsilon --adhesion` computes their collisions, and a weight that is neglected looks alike"
    )
