"""Scene with a fitted material, its uncertainty and the measured range of speeds, as TOML."""

from __future__ import annotations

import math

from viscopade.arrays import double
from viscopade.collision.spheres import Pair
from viscopade.fitting.damping import DampingFit
from viscopade.generated import comment, harmless, marker_lines, string

# Tolerance over the standard error of eps. Errors add in squares: with a tenth the error of eps grows by 0.5 %, and
# more accuracy would not help.
SHARE = 0.1


def scene_text(fit: DampingFit, pair: Pair, command: str, title: str) -> str:
    """Return a scene with spheres like the measured one, as TOML.

    Parameters
    ----------
    fit : DampingFit
        In SI units.
    pair : Pair
        The measured sphere, with the wall or the sphere of its kind that it hit; their A is not used.
    command : str
        The command line that makes the scene, for its first line.
    title : str

    Raises
    ------
    ValueError
        If the damping is 0, or the standard error of eps is 1 or more.
    """
    if fit.verdict.word in ("does not hold", "undecided"):
        title += f" ({fit.verdict.sentence[0].lower()}{fit.verdict.sentence[1:]})"
    # eps at the geometric mean of the speeds, where it is known best; the speed as the scene has it, in four digits.
    speed = f"{fit.main.middle:.4g}"
    epsilon, error = fit.epsilon(float(speed))
    # 1 - eps at v* = beta^(1/2) v^(1/10)
    loss = float(double.one_minus_epsilon(math.sqrt(fit.beta) * float(speed) ** 0.1))
    # A loss of 1e-12 or less is round-off of a fit without damping, and no error of eps, a number from 0 to 1, is 1 or
    # more.
    if not loss > 1e-12 or not 0 < error < 1:
        raise ValueError(
            f"beta is {fit.beta:.3g} +- {fit.beta_standard_error:.2g}, eps is {epsilon:.6g} +- {error:.2g}: "
            "expected beta > 0 and a standard error of eps < 1, for a scene"
        )
    # A small 1 - eps keeps its digits only if it is written as such, a small eps only as eps: write the smaller one.
    measured_value = f"epsilon = {epsilon!r}" if epsilon <= 0.5 else f"one_minus_epsilon = {loss!r}"
    measured_value += f', standard_error = {error:.3g}, speed = "{speed} m/s"'
    sphere, other = pair.first, pair.second
    # eps is that of the material; or if the wall has another one, of these two bodies, which then both have their A.
    is_alike = (other.young_modulus, other.poisson_ratio) == (sphere.young_modulus, sphere.poisson_ratio)
    note = f"# From {len(fit.points)} points; standard_error is that of eps.\nrestitution = {{ {measured_value}"
    partner = ', partner = "wall"' if other.is_wall else ""
    constant = f"dissipative_constant = {fit.dissipative_constant(pair).value!r}  # s"
    of_material = f"{note}, radius = {sphere.radius!r}{partner} }}" if is_alike else f"{constant}, that of the pair"
    name = "measured" if is_alike else "plane"
    plane = f'\n[body.plane]\nmaterial = "{name}"\nwall = true\n' if other.is_wall else ""
    of_contacts = (
        ""
        if is_alike
        else f"""
[material.plane]
young_modulus = {other.young_modulus!r}  # Pa
poisson_ratio = {other.poisson_ratio!r}
{constant}

[[contact]]
between = ["ball", "ball"]

[[contact]]
between = ["ball", "plane"]
{note} }}
"""
    )
    # One digit of a tolerance is enough; below 1e-12 no kernel in double precision meets it.
    tolerance = max(float(f"{SHARE * error:.1g}"), 1e-12)
    return f"""\
{comment(marker_lines(command), "#")}
# {fit.verdict.sentence}: {"; ".join(fit.verdict.reasons)}.
title = {string(harmless(title))}

[material.measured]
young_modulus = {sphere.young_modulus!r}  # Pa
poisson_ratio = {sphere.poisson_ratio!r}
density = {sphere.density!r}  # kg/m^3
{of_material}

[body.ball]
material = "measured"
radius = {sphere.radius!r}  # m
{plane}{of_contacts}
[speed]
min = "{fit.points.speed.min():.4g} m/s"
max = "{fit.points.speed.max():.4g} m/s"

[tolerance]
# A tenth of the standard error of eps: more accuracy would not help.
absolute = {tolerance:.1g}
"""
