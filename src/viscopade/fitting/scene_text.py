"""Scene with a fitted material, its uncertainty and the measured range of speeds, as TOML."""

from __future__ import annotations

import math

from viscopade.collision.spheres import Sphere
from viscopade.fitting.damping import DampingFit
from viscopade.generated import marker_line

SHARE = 0.1  # of the standard error of eps, as the tolerance


def scene_text(found: DampingFit, sphere: Sphere, wall: bool, command: str, title: str) -> str:
    """Return a scene of spheres like the measured one.

    Parameters
    ----------
    found : DampingFit
        In SI units.
    sphere : Sphere
        The measured one; its A is not used.
    wall : bool
        Whether it hit a wall, not another sphere like it.
    command : str
        For the head.
    title : str
        One line.
    """
    speed = f"{found.main.middle:.4g}"
    epsilon, error = found.epsilon(float(speed))
    partner = ', partner = "wall"' if wall else ""
    tolerance = max(float(f"{SHARE * error:.1g}"), 1e-12)
    plane = '\n[body.plane]\nmaterial = "measured"\nwall = true\n' if wall else ""
    return f"""\
# {marker_line(command)}
# {found.verdict.word}: {"; ".join(found.verdict.reasons)}.
title = "{_harmless(title)}"

[material.measured]
young_modulus = {sphere.young_modulus!r}  # Pa
poisson_ratio = {sphere.poisson_ratio!r}
density = {sphere.density!r}  # kg/m^3
# From {len(found.points)} points; standard_error is that of eps.
restitution = {{ epsilon = {epsilon:.10g}, standard_error = {_some(error)}, speed = "{speed} m/s", \
radius = {sphere.radius!r}{partner} }}

[body.ball]
material = "measured"
radius = {sphere.radius!r}  # m
{plane}
[speed]
min = "{found.points.speed.min():.4g} m/s"
max = "{found.points.speed.max():.4g} m/s"

[tolerance]
# A tenth of the standard error: a kernel more accurate than that is a waste.
absolute = {tolerance:.1g}
"""


def _some(error: float) -> str:
    return f"{max(error, math.ulp(1.0)):.3g}"


def _harmless(title: str) -> str:
    """Return a text that a TOML string can hold."""
    return "".join(c if c.isprintable() and c not in '"\\' else "_" for c in title)
