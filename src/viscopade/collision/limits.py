"""Limits of the model: Hertz's theory, slow impacts, elastic material, the law of force."""

from __future__ import annotations

import math
from collections.abc import Iterator

from viscopade.arrays import checked
from viscopade.arrays.checked import Accepted
from viscopade.collision.spheres import Pair

# Warnings, so the first four are rules of thumb, rounded by hand; no result depends on them.
# Maximal compression over the smaller radius; Hertz's contact radius is then sqrt(0.03) = 17% of it.
LARGEST_OVERLAP = 0.03
NEAR_YIELD = 0.5  # speed over the speed at which the material yields
SOUND_CROSSINGS = 5  # least contact time over the time in which sound crosses the smaller sphere
LONGEST_RELAXATION = 0.3  # A over the contact time
YIELD_PRESSURE = 1.6  # largest pressure in the contact at first yield, over the yield strength (Hertz, von Mises)

_SPEED = Accepted("a finite number >= 0", lambda x: 0 <= x < math.inf)
_STRENGTH = Accepted("a number > 0", lambda x: x > 0)

SENTENCES = {
    "depth": "the overlap reaches {share} of the radius, more than {limit}: Hertz's theory is for small contacts",
    "yield": "{speed} is {beyond} the {limit} at which the material begins to yield: eps then falls faster, because "
    "of plastic work, which is not in the model",
    "slowness": "at {speed} the contact lasts {share} times as long as sound takes to cross the sphere, less than "
    "{limit} times: waves carry energy away, but the theory is quasi-static",
    "relaxation": "A is {share} of the contact time at {speed}, more than {limit}: the law of force is only the first "
    "order in A over the contact time",
}
"""The sentences of `violations` and of the calculator's page, with names in braces for numbers."""


def violations(
    pair: Pair,
    fastest: float,
    *,
    strongest: Pair | None = None,
    yield_strength: float | None = None,
    depth: float | None = None,
) -> Iterator[str]:
    """Yield a sentence, without its full stop, for each assumption of the model that a pair violates.

    Parameters
    ----------
    pair : Pair
        The pair with typical radii.
    fastest : float
        Its fastest impact, a length/time.
    strongest : Pair, optional
        The pair with the radii of the largest v* at a speed, if sizes are distributed.
    yield_strength : float, optional
        The smaller yield strength of both materials, a pressure.
    depth : float, optional
        The maximal compression at this speed, if more than Hertz's force and the damping decide it.

    Raises
    ------
    TypeError, ValueError
        If the strength is not a number > 0, or the speed is not a number >= 0.
    """
    fastest = checked.number("fastest", fastest, _SPEED)
    # Small contacts: the compression over the smaller radius.
    share, speed = overlap(pair, fastest, depth), f"{fastest:.3g} m/s"
    if share > LARGEST_OVERLAP:
        yield SENTENCES["depth"].format(share=f"{share:.2g}", limit=f"{LARGEST_OVERLAP:g}")
    # Elastic material: the impact speed at which the contact's pressure makes it yield.
    limit = math.inf if yield_strength is None else yield_speed(pair, yield_strength)
    if fastest > NEAR_YIELD * limit:
        beyond = "beyond" if fastest > limit else "near"
        yield SENTENCES["yield"].format(speed=speed, beyond=beyond, limit=f"{limit:.3g} m/s")
    # Slow impacts: sound of speed sqrt(Y/density) crosses a sphere of diameter 2 R.
    crossing = min(
        2 * s.radius / math.sqrt(s.young_modulus / s.density) for s in (pair.first, pair.second) if not s.is_wall
    )
    duration = float(pair.contact_time(fastest))
    if duration < SOUND_CROSSINGS * crossing:
        times = f"{duration / crossing:.2g}"
        yield SENTENCES["slowness"].format(speed=speed, share=times, limit=f"{SOUND_CROSSINGS}")
    # First order in A: A over the contact time, of the pair with the largest v*.
    fast = pair if strongest is None else strongest
    share = fast.A / float(fast.contact_time(fastest))
    if share > LONGEST_RELAXATION:
        yield SENTENCES["relaxation"].format(speed=speed, share=f"{share:.2g}", limit=f"{LONGEST_RELAXATION:g}")


def overlap(pair: Pair, speed: float, depth: float | None = None) -> float:
    """Return the maximal compression at an impact speed, or a given one, over the smaller radius."""
    return (float(pair.max_compression(speed)) if depth is None else depth) / min(pair.first.radius, pair.second.radius)


def yield_speed(pair: Pair, strength: float) -> float:
    """Return the impact speed of a pair at which the Hertzian pressure reaches `YIELD_PRESSURE` times the strength.

    p = 2 E_eff/pi sqrt(xi/R_eff), and m_eff v^2/2 = 8/15 E_eff R_eff^(1/2) xi^(5/2) without dissipation.
    """
    strength = checked.number("yield_strength", strength, _STRENGTH)
    # Solved for xi, then for v; the energy is the integral of 4/3 E_eff R_eff^(1/2) xi^(3/2), so v^2 = 16/15 ….
    try:
        xi = pair.R_eff * (YIELD_PRESSURE * strength * math.pi / (2 * pair.E_eff)) ** 2
        return math.sqrt(16 / 15 * pair.E_eff * math.sqrt(pair.R_eff) * xi**2.5 / pair.m_eff)
    except OverflowError:  # stronger than any impact
        return math.inf
