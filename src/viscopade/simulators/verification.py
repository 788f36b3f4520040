"""Cases that verify another program: spheres collide, with a known eps, peak overlap and contact time.

The YAML files have the form of LAMMPS's granular unit tests (unittest/granular of lammps/lammps, pull requests 5008,
5110 and 5113 of 2026, read at commits 10e220f and 027c2f9): its driver test_dem_01 reads them, with the analytic model
`collision_restitution`. No case with `damping viscoelastic` was found there. The JSON file has the same cases for any
program.

Three more cases are a sphere that falls on a plane, and three one that slides over it with Coulomb's friction: inputs
of LAMMPS, and entries of the JSON file. Friction takes the speed mu (1 + eps) v_n along the plane from a sphere that
slides, and gives it the spin R omega = 5/2 of that.

Expected numbers are proven digits of the equation of motion; with a weight they are sampled. Tolerances are those of
the time step: 1.5 times the largest error over where in a step contact begins, of the steps that LAMMPS takes
(`viscopade.collision.schemes`).
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from viscopade.collision import exact
from viscopade.collision.contact import PHASES, Contact
from viscopade.collision.spheres import Pair, Sphere
from viscopade.collision.weight import EARTH
from viscopade.generated import CITE, SPDX, marker_line, marker_lines, written_template
from viscopade.simulators.lammps import hertz_material
from viscopade.theory.law import VISCOELASTIC, Law, law_of

EPSILONS = ("0.95", "0.5", "0.1")
RADII = {"twosphere": (0.0025, 0.0025), "unequal": (0.0025, 0.005)}
"""Radii in m, by what the file's name says."""
STEPS = 1000
"""Time steps in an undamped contact."""
MARGIN = 1.5
"""Tolerance over the error of the time step."""
JSON = "viscoelastic.json"

_MATERIAL, _SPEED = {"density": 2700.0, "young_modulus": 1e8, "poisson_ratio": 0.33}, 1.0
_DAMPING = "damping viscoelastic, contact that ends at"
_ENDS = {"force": "zero force", "return": "x = 0"}
_GAP = 10.5  # steps before contact
_DIGITS = 15


def cases() -> Iterator[dict[str, Any]]:
    """Yield the collisions of two spheres: each eps, with both ends of contact, for equal and for unequal spheres."""
    for size, radii in RADII.items():
        for end in ("force", "return"):
            for epsilon in EPSILONS:
                yield _case(f"{size}-e{epsilon.replace('.', '')}-{end}", radii, epsilon, law_of(VISCOELASTIC, end))


def _case(name: str, radii: tuple[float, float], epsilon: str, law: Law) -> dict[str, Any]:
    """Return a head-on collision of two spheres, in SI units, as the JSON file has it.

    Places are the distances from the origin on both sides, at rest in the centre of mass's frame. After `steps` the
    spheres have parted. Contact time is from overlap 0 to the end of contact.
    """
    elastic = Pair(*(Sphere(radius=radius, **_MATERIAL, dissipative_constant=0.0) for radius in radii))
    pair, kappa, scaled = _calibrated(elastic, law, epsilon, _SPEED)
    length, time = float(pair.length_scale(_SPEED)), float(pair.time_scale(_SPEED))
    h = law.contact_time / STEPS
    errors, contact = _errors(law, kappa, h, scaled)
    values = epsilon, repr(scaled["x_max"] * length), repr(scaled["tau_c"] * time)
    masses = pair.first.mass, pair.second.mass
    shares = masses[1] / sum(masses), masses[0] / sum(masses)
    gap = _GAP * h * time * _SPEED
    return {
        "name": f"dem01-viscoelastic-{name}-3d-si",
        "title": f"two spheres, {_DAMPING} {_ENDS[law.end]}",
        "end": law.end,
        "diameters": (2 * radii[0], 2 * radii[1]),
        "masses": masses,
        "speeds": tuple(_SPEED * share for share in shares),
        "places": tuple(radius + gap * share for radius, share in zip(radii, shares, strict=True)),
        **_MATERIAL,
        "dissipative_constant": pair.A,
        "eta_n0": hertz_material(pair).eta_n0,
        "half_speed": _SPEED / 2,
        "time_step": h * time,
        "steps": math.ceil(_GAP + 1.2 * contact / h),
        **_expected(("epsilon", "peak_overlap", "contact_time"), values, errors),
    }


def _calibrated(elastic: Pair, law: Law, epsilon: str, speed: float) -> tuple[Pair, float, dict[str, float]]:
    """Return bodies with an eps at a speed, by proven digits, their kappa and the numbers of the scaled equation."""
    proven = exact.invert(epsilon, _DIGITS, law=law)
    kappa = float(proven.mpf()["v_star"] ** law.d)
    # kappa = beta v^(1/5), for both ends of contact
    return elastic.damped(float(elastic.dissipative_constant(kappa * speed**-0.2))), kappa, proven.floats()


def _expected(names: Iterable[str], values: Iterable[str], errors: Iterable[float]) -> dict[str, dict[str, str]]:
    """Return numbers that a program should give, each with its largest relative error."""
    return {
        name: {"value": value, "tolerance": f"{MARGIN * error:.1e}"}
        for name, value, error in zip(names, values, errors, strict=True)
    }


# --- a sphere and a plane ---------------------------------------------------------------------------------------------

FALLS = (("0.9", "force"), ("0.5", "force"), ("0.5", "return"))
"""Eps without weight, and the end of contact."""
SLIDES = (("0.95", 0.1), ("0.5", 0.3), ("0.1", 0.5))
"""Eps, and the friction coefficient."""
_SLOW, _ALONG = 0.02, 5.0  # m/s: speed of the falls, and speed along the plane that no friction here uses up


def plane_cases() -> Iterator[dict[str, Any]]:
    """Yield the collisions of a sphere and a plane: those that fall, and those that slide."""
    for epsilon, end in FALLS:
        name = f"fall-e{epsilon.replace('.', '')}-{end}"
        yield _plane_case(name, "a sphere falls on a plane", epsilon, law_of(VISCOELASTIC, end), _SLOW, EARTH, 0.0)
    for epsilon, friction in SLIDES:
        name = f"slide-e{epsilon.replace('.', '')}-mu{f'{friction:g}'.replace('.', '')}"
        yield _plane_case(name, "a sphere slides over a plane", epsilon, VISCOELASTIC, _SPEED, 0.0, friction)


def _plane_case(
    name: str, title: str, epsilon: str, law: Law, speed: float, gravity: float, friction: float
) -> dict[str, Any]:
    """Return a collision of a sphere with a plane of its material at z = 0, in SI units, as the JSON file has it.

    `height` is that of the centre at the beginning. Eps is the speed at which the sphere is back at the height of first
    contact, over `speed`; contact time is from overlap 0 to the last moment of a force. Expected are also the speed
    along the plane that is lost, and the radius times the angular velocity that is gained.
    """
    radius, along = RADII["twosphere"][0], _ALONG if friction else 0.0
    of_plane = {key: value for key, value in _MATERIAL.items() if key != "density"}
    sphere = Sphere(radius=radius, **_MATERIAL, dissipative_constant=0.0)
    pair, kappa, scaled = _calibrated(
        Pair(sphere, Sphere.wall(**of_plane, dissipative_constant=0.0)), law, epsilon, speed
    )
    length, time = float(pair.length_scale(speed)), float(pair.time_scale(speed))
    load = gravity * time / speed
    if load:
        fall = Contact.of_law(law, kappa, load).collide()
        scaled = {"epsilon": fall.epsilon, "x_max": fall.depth, "tau_c": fall.duration}
    h = law.contact_time / STEPS
    errors, contact = _errors(law, kappa, h, scaled, load)
    change = friction * (1 + scaled["epsilon"]) * speed
    values = scaled["epsilon"], scaled["x_max"] * length, scaled["tau_c"] * time, change, 2.5 * change
    errors += [errors[0] * scaled["epsilon"] / (1 + scaled["epsilon"])] * 2
    names = ("epsilon", "peak_overlap", "contact_time", "change_along", "surface_spin")
    gap = _GAP * h * time * speed
    return {
        "name": name,
        "title": f"{title}, {_DAMPING} {_ENDS[law.end]}",
        "end": law.end,
        "diameter": 2 * radius,
        "mass": pair.first.mass,
        **_MATERIAL,
        "dissipative_constant": pair.A,
        "eta_n0": hertz_material(pair).eta_n0,
        "gravity": gravity,
        "friction": friction,
        "speed": speed,
        "speed_along": along,
        "height": radius + gap,
        "start_speed": math.sqrt(speed**2 - 2 * gravity * gap),
        "time_step": h * time,
        "steps": math.ceil(_GAP + 1.2 * contact / h),
        **_expected(names, (f"{value:.12g}" for value in values), errors),
    }


def _errors(law: Law, kappa: float, h: float, scaled: dict[str, float], load: float = 0.0) -> tuple[list[float], float]:
    """Return the largest relative errors of eps, x_max and tau_c by time steps, and the longest contact.

    The overlap is seen at the end of each step, and contact ends with the step in which the force vanishes.
    """
    rebounds = Contact.of_law(law, kappa, load).rebounds(1.0, h, PHASES)
    names = {"epsilon": "epsilon", "depth": "x_max", "duration": "tau_c"}
    errors = [float(np.abs(getattr(rebounds, ours) / scaled[name] - 1).max()) for ours, name in names.items()]
    apart = kappa if law.delayed else 0.0  # after contact: the compression kappa eps at the speed eps
    return errors, float(rebounds.duration.max()) + apart


_YAML = """\
{{ marker | lines("# {}") }}
# {{ case.title }}
# Expected, by proven digits of the equation of motion: en {{ case.epsilon.value }}, peak overlap {{
case.peak_overlap.value }} m,
# contact time {{ case.contact_time.value }} s.
# analytic_tol is derived from the time step: {{ case.epsilon.tolerance }}.
---
lammps_version: 4 Jul 2026
tags: granular, generated
date_generated:
epsilon: 1e-10
skip_tests:
prerequisites: |
  atom sphere
  pair granular
pre_commands: |
  units si
  dimension 3
  boundary f f f
  atom_style sphere
  region box block -0.2 0.2 -0.1 0.1 -0.1 0.1 units box
  create_box 1 box
  create_atoms 1 single -${sep1} 0.0 0.0 units box
  create_atoms 1 single ${sep2} 0.0 0.0 units box
  group left id 1
  group right id 2
  set group left diameter ${diam1} density ${dens}
  set group right diameter ${diam2} density ${dens}
  velocity left set ${v1} 0.0 0.0
  velocity right set -${v2} 0.0 0.0
  comm_modify vel yes
  neighbor 0.01 bin
  neigh_modify delay 0
  timestep ${dt}
post_commands: |
  fix integr all nve/sphere
input_file:
natoms: 2
variables: |
  diam1 {{ case.diameters[0] }}
  diam2 {{ case.diameters[1] }}
  dens {{ case.density }}
  emod {{ case.young_modulus }}
  poisson {{ case.poisson_ratio }}
  etan {{ case.eta_n0 }}
  en {{ case.epsilon.value }}
  vin {{ case.half_speed }}
  v1 {{ case.speeds[0] }}
  v2 {{ case.speeds[1] }}
  sep1 {{ case.places[0] }}
  sep2 {{ case.places[1] }}
  dt {{ case.time_step }}
pair_style: granular
pair_coeff: |
  * * hertz/material ${emod} ${etan} ${poisson} tangential linear_nohistory 0.0 0.0 damping viscoelastic{{
" limit_damping" if case.end == "force" }}
run_segments: |-
  {{ case.steps }} 100
analytic_enable: yes
analytic_model: collision_restitution
analytic_tol: {{ case.epsilon.tolerance }}
analytic_segment: 1
analytic_only: yes
...
"""


_PLANE = """\
{{ marker | lines("# {}") }}
# {{ case.title }}
{% if case.friction %}
# The sphere slides all the time, as the viscous limit of linear_nohistory, with the factor 1e6, is never reached.
{% endif %}
units si
dimension 3
boundary f f f
atom_style sphere
atom_modify map array
region box block -1 1 -1 1 -0.1 1 units box
create_box 1 box
create_atoms 1 single 0 0 {{ case.height }} units box
set atom 1 diameter {{ case.diameter }} density {{ case.density }}
velocity all set {{ case.speed_along }} 0 -{{ case.start_speed }}
comm_modify vel yes
neighbor 0.01 bin
timestep {{ case.time_step }}
variable contact string "hertz/material {{ case.young_modulus }} {{ case.eta_n0 }} {{ case.poisson_ratio
}} tangential linear_nohistory {{ "1e6" if case.friction else "0" }} {{ case.friction }} damping viscoelastic{{
" limit_damping" if case.end == "force" }}"
pair_style granular
pair_coeff * * ${contact}
fix plane all wall/gran granular ${contact} zplane 0 NULL
{% if case.gravity %}
fix weight all gravity {{ case.gravity }} vector 0 0 -1
{% endif %}
fix motion all nve/sphere
compute each all property/atom omegay
compute spin all reduce sum c_each
variable overlap equal {{ case.diameter / 2 }}-z[1]
variable force equal fz[1]+mass(all)*{{ case.gravity }}
thermo 1
thermo_style custom step v_overlap v_force
thermo_modify format float %.12g
run {{ case.steps }}
variable epsilon equal sqrt(vz[1]^2-2*{{ case.gravity }}*v_overlap)/{{ case.speed }}
variable change equal {{ case.speed_along }}-vx[1]
variable spin equal {{ case.diameter / 2 }}*c_spin
print "epsilon $(v_epsilon:%.12g) expected {{ case.epsilon.value }}, within {{ case.epsilon.tolerance }} of it"
print "change of the speed along the plane $(v_change:%.12g) expected {{ case.change_along.value }}"
print "spin times radius $(v_spin:%.12g) expected {{ case.surface_spin.value }}"
"""


def verification_files(command: str) -> dict[str, str]:
    """Return file names and texts: a YAML file or an input for each case, and all of them in one JSON file."""
    made, yaml = list(cases()), written_template(_YAML)
    texts = {f"{case['name']}.yaml": yaml.render(marker=marker_lines(command), case=case) for case in made}
    on_plane, script = list(plane_cases()), written_template(_PLANE)
    texts |= {f"in.{case['name']}": script.render(marker=marker_lines(command), case=case) for case in on_plane}
    whole = {
        "generated_by": marker_line(command),
        **dict(line.split(": ") for line in SPDX),
        "cite": CITE,
        "law": "m x'' = -k x^(3/2) - c x^(1/2) x', k = 4/3 E_eff sqrt(R_eff), c = 3/2 A k; m, R_eff effective",
        "units": "SI",
        "cases": made,
        "on_a_plane": on_plane,
    }
    return {**texts, JSON: json.dumps(whole, indent=2) + "\n"}
