"""LAMMPS: an include file for `pair_style granular`, and an input script that checks it by one collision.

The correspondence, from the source of LAMMPS (src/GRANULAR of lammps/lammps, commits 58ee392 and 07b704c, which agree
in this; the tests run the release of 22 Jul 2025). With the compression d, its rate d' and the contact radius
a = sqrt(R_eff d) (`GranSubModNormal::calculate_contact_radius`):

- `GranSubModNormalHertz::calculate_forces`: the elastic force k a d, where k = 4/3 E_eff for hertz/material;
- `GranSubModNormalHertzMaterial::coeffs_to_local`: of an explicit line for a pair of types E_eff is
  `mix_stiffnessE(E, E, nu, nu)`, and for a wall `mix_stiffnessE_wall(E, nu)`; both are E/(2 (1 - nu^2));
- `GranSubModDampingViscoelastic::calculate_forces`: the damping eta_n0 m_eff a d';
- `GranularModel::calculate_forces`: their sum, set to 0 where it is attractive if there is limit_damping;
- `GranularModel::check_contact`, `PairGranular::compute`, `FixWallGran::post_force`: R_eff and m_eff are the paper's,
  with a wall those of the sphere.

So rho = 4/3 E_eff sqrt(R_eff), and rho 3/2 A = eta_n0 m_eff sqrt(R_eff) gives eta_n0 = 2 A E_eff/m_eff. From the end of
contact on, x + kappa x' = 0 in the scaled variables, the velocity is constant as long as the force is 0, so x falls and
x + kappa x' stays negative: the force remains cut off until the spheres part. This is the paper's end condition.

Velocities enter the force as they are half a step before (`Verlet::run`: `FixNVESphere::initial_integrate` adds half of
the kick, then forces are computed). This makes the scheme one of first order: x'' is multiplied by
1/(1 - kappa sqrt(x) h/2), up to higher orders of the time step h. `stepped_epsilon` does the same steps.

Other dampings, at commit 07b704c, with the elastic force F:

- `GranSubModDampingCoeffRestitution::init`: c = damp sqrt(m_eff F/d), with damp = 2 zeta for `hooke` and
  sqrt(5) zeta for `hertz`, zeta the damping ratio for contact that ends at x = 0. Both are exact.
- `GranSubModDampingTsuji::init`: the same c, damp a polynomial in e of degree 6, which Marshall (2009) fitted to
  the figure of Tsuji, Tanaka and Ishida (1992). Since 2026 it is multiplied by sqrt(2), as Tsuji's mass is not m_eff.
- `GranSubModDampingMassVelocity`: c = eta_n0 m_eff. People take eta_n0 from Silbert et al. (2001), which is the linear
  spring-dashpot contact that ends at x = 0.

With `limit_damping` a force that would pull is 0, with any of them; without, contact ends at x = 0.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np
from mpmath import mp

from viscopade.arrays import checked, double
from viscopade.arrays.checked import Values
from viscopade.collision.contact import PHASE, Contact
from viscopade.collision.schemes import SEMI_IMPLICIT
from viscopade.collision.spheres import Pair, Sphere
from viscopade.generated import WIDTH, harmless, marker_lines, written_template
from viscopade.simulators import native
from viscopade.simulators.formula import (
    LINEAR,
    LINEAR_RETURN,
    TSUJI,
    TSUJI_RETURN,
    DampingFormula,
    linear_kappa,
    tsuji_kappa,
    viscoelastic_kappa,
)
from viscopade.simulators.setup import NamedContact, Setup, Units
from viscopade.simulators.simulator import Simulator
from viscopade.theory.law import VISCOELASTIC, Law, law_of

STEPS = (50, 200, 1000)
"""Steps in the shortest contact for which the file states the error."""
PHASES = (0.0, 0.25, 0.5, 0.75)
"""Where in a step contact begins: errors are the largest over these."""

_FRICTIONLESS = "tangential linear_nohistory 0.0 0.0"
_LAW = f"{_FRICTIONLESS} damping viscoelastic limit_damping"
STYLE = f"hertz/material {{E}} {{eta_n0}} {{nu}} {_LAW}"
"""The words after the types in pair_coeff, and after `granular` in fix wall/gran, with `HertzMaterial` in braces."""
_WALL = f'fix wall all wall/gran granular {STYLE} zplane 0.0 NULL  # for "zplane 0.0 NULL" put your wall'
_STYLES = {("m", "kg", "s"): "si", ("cm", "g", "s"): "cgs", ("um", "pg", "us"): "micro", ("nm", "ag", "ns"): "nano"}
_MOST_STEPS = 2000  # of one collision in `timestep_error`
_TOO_MANY_STEPS = 1_000_000
_PATIENCE = 20  # a collision that takes so many times as long as it should does not end
_POSITIVE = checked.Accepted("a finite number > 0", lambda x: (x > 0) & (x < math.inf))


@dataclass(frozen=True)
class HertzMaterial:
    """The numbers of `hertz/material E eta_n0 nu`, for one pair of bodies.

    Attributes
    ----------
    E : float
        Young modulus, a pressure.
    eta_n0 : float
        Damping constant, 1/(length time).
    nu : float
        Poisson ratio.
    """

    E: float
    eta_n0: float
    nu: float

    @property
    def E_eff(self) -> float:
        """The effective modulus that LAMMPS computes from E and nu, a pressure."""
        return self.E / (2 * (1 - self.nu) * (1 + self.nu))

    @property
    def k_n(self) -> float:
        """The stiffness with which `hertz k_n eta_n0` is the same law, a pressure."""
        return self.E_eff * (4 / 3)

    @property
    def style(self) -> str:
        """`STYLE` with these numbers."""
        return STYLE.format(E=_number(self.E), eta_n0=_number(self.eta_n0), nu=_number(self.nu))

    def pair(self, pair: Pair) -> Pair:
        """Return other bodies of the same materials with the A that LAMMPS gives them with these numbers."""
        a = self.eta_n0 / self.E_eff * pair.m_eff / 2
        return Pair(replace(pair.first, dissipative_constant=a), replace(pair.second, dissipative_constant=a))


@dataclass(frozen=True)
class TimeStep:
    """Error of eps by a time step.

    Attributes
    ----------
    steps : int
        Steps in the shortest contact of all.
    timestep : float
        The time step.
    errors : tuple of float
        For each contact, the largest |eps'/eps - 1| over its speeds and `PHASES`.
    """

    steps: int
    timestep: float
    errors: tuple[float, ...]


def hertz_material(pair: Pair) -> HertzMaterial:
    """Return the parameters of LAMMPS for a pair of bodies.

    Parameters
    ----------
    pair : Pair
        Two spheres, or a sphere and a wall.

    Returns
    -------
    HertzMaterial
        E and nu give E_eff and, in tangential models with NULL for the stiffness (`mix_stiffnessG`), the effective
        shear modulus of the pair. For equal materials they are the material's.

    Examples
    --------
    >>> from viscopade import Pair, Sphere
    >>> glass = {"density": 2500, "young_modulus": 7e10, "poisson_ratio": 0.25, "dissipative_constant": 1e-8}
    >>> hertz_material(Pair(Sphere(radius=1e-3, **glass), Sphere(radius=2e-3, **glass))).style.split()[:4]
    ['hertz/material', '70000000000', '80214091.3183153', '0.25']
    """
    nu = _common_poisson_ratio(pair.first, pair.second)
    return HertzMaterial(E=2 * (1 - nu) * (1 + nu) * pair.E_eff, eta_n0=2 * pair.A * (pair.E_eff / pair.m_eff), nu=nu)


def stepped_epsilon(pair: Pair, speed: float, timestep: float, phase: Values) -> Values:
    """Return the eps that LAMMPS computes with a time step, by its own scheme.

    Parameters
    ----------
    pair : Pair
        The colliding bodies.
    speed : float
        Impact speed v > 0.
    timestep : float
        Time step > 0.
    phase : float or array
        Where in the first step contact begins, from 0 to 1.

    Returns
    -------
    float or array
        The coefficient of restitution with limit_damping; may be above 1 if the time step is far too large. 0 if the
        bodies are still in contact after many times the true duration: where v* is huge, they creep apart.

    Raises
    ------
    TypeError
        If an argument is not a real number.
    ValueError
        If speed or timestep is not a finite number > 0, or the time step is a 1,000,000th of the contact or less.
    """
    v = checked.number("speed", speed, _POSITIVE)
    h = checked.number("timestep", timestep, _POSITIVE) / float(pair.time_scale(v))
    contact = float(pair.contact_time(v))
    steps = contact / float(timestep)
    if steps > _TOO_MANY_STEPS:
        least = contact / _TOO_MANY_STEPS
        raise ValueError(
            f"timestep is {timestep!r}: expected at least {least:.3g}, for {_TOO_MANY_STEPS:,} steps in a contact"
        )
    longest = _PATIENCE * h * max(steps, min(STEPS))
    collide = Contact.of_law(VISCOELASTIC, float(pair.v_star(v)) ** 2).rebounds
    return checked.elementwise(lambda at: collide(1.0, h, at, longest=longest).epsilon, "phase", phase, PHASE)


def timestep_error(contact: NamedContact, timestep: float) -> float:
    """Return the largest relative error of eps with a time step, over the contact's three speeds and `PHASES`.

    Of a contact that lasts more than 2000 steps it is the error with 2000 steps, which is larger.
    """
    speeds = np.array([contact.slowest, contact.typical, contact.fastest])
    pairs = (contact.pair, *contact.extremes)
    v_star = np.concatenate([pair.v_star(speeds) for pair in pairs])[:, None]
    unit = np.concatenate([pair.time_scale(speeds) for pair in pairs])[:, None]
    h = np.maximum(timestep / unit, double.tau_c(v_star) / _MOST_STEPS)
    longest = _PATIENCE * max(float(double.tau_c(v_star).max()), min(STEPS) * float(h.max()))
    found = Contact.of_law(VISCOELASTIC, v_star**2).rebounds(1.0, h, PHASES, longest=longest).epsilon
    return float(np.abs(found / double.epsilon(v_star) - 1).max())


def shortest_contact(setup: Setup) -> float:
    """Return the shortest duration of contact, a time."""
    return min(
        float(pair.contact_time(contact.fastest))
        for contact in setup.contacts
        for pair in (contact.pair, *contact.extremes)
    )


def timesteps(setup: Setup) -> tuple[TimeStep, ...]:
    """Return the errors for each number of `STEPS` in the shortest contact."""
    shortest = shortest_contact(setup)
    return tuple(
        TimeStep(
            steps, shortest / steps, tuple(timestep_error(contact, shortest / steps) for contact in setup.contacts)
        )
        for steps in STEPS
    )


def size_error(contact: NamedContact) -> float:
    """Return the largest relative error of eps at the contact's `extremes` with the parameters of its typical pair.

    It is taken at the slowest, the typical and the fastest speed; 0 if there are no extremes.
    """
    numbers = hertz_material(contact.pair)
    return max(
        (
            abs(float(numbers.pair(pair).epsilon(speed)) / float(pair.epsilon(speed)) - 1)
            for pair in contact.extremes
            for speed in (contact.slowest, contact.typical, contact.fastest)
        ),
        default=0.0,
    )


def pair_coeff(setup: Setup, first: str, second: str) -> str:
    """Return the pair_coeff line of two spheres by name, the lower type first."""
    i, j = sorted((_type(setup, first), _type(setup, second)))
    return f"pair_coeff {i} {j} {hertz_material(_pair(setup, first, second)).style}"


def wall_fix(setup: Setup, sphere: str, wall: str) -> str:
    """Return the fix wall/gran line of a sphere and a wall by name; the wall's place is in its variable."""
    number, variable = _type(setup, sphere), wall_variable(setup, wall)
    group = "all" if len(setup.spheres) == 1 else _group(number)
    style = hertz_material(_pair(setup, sphere, wall)).style
    return f"fix {variable}_type{number} {group} wall/gran granular {style} ${{{variable}}}"


def wall_variable(setup: Setup, wall: str) -> str:
    """Return the name of the variable for a wall's place."""
    return f"wall{_walls(setup).index(wall) + 1}_" + re.sub(r"[^A-Za-z0-9]", "_", wall)


def units_command(units: Units) -> str:
    """Return the units command for numbers in these units; `units lj` takes numbers as they are."""
    return f"units {_STYLES.get((units.length, units.mass, units.time), 'lj')}"


def render(setup: Setup, command: str) -> str:
    """Return an include file with one line for each pair of types, and for each type and wall.

    Parameters
    ----------
    setup : Setup
        Spheres become atom types in their order. Pairs that are not among the contacts get their lines, too, from the
        bodies' own numbers.
    command : str
        The command that made the file, for its first line.

    Returns
    -------
    str
        The text.
    """
    spheres, walls = setup.spheres, _walls(setup)
    pairs = [(first, second) for i, first in enumerate(spheres) for second in spheres[i:]]
    return written_template(_TEXT).render(
        marker=marker_lines(command),
        opening=setup.opening,
        units=setup.units,
        units_command=units_command(setup.units),
        units_lines=_units_lines(setup.units),
        types=[_atom_type(setup, name) for name in spheres],
        shortest=f"{shortest_contact(setup):.4g}",
        time_table=_time_table(setup),
        pairs=[
            {"lines": _describe(setup, first, second), "command": pair_coeff(setup, first, second)}
            for first, second in pairs
        ],
        walls=[{"name": harmless(wall), "variable": wall_variable(setup, wall)} for wall in walls],
        groups=[{"name": _group(_type(setup, name)), "number": _type(setup, name)} for name in spheres]
        if len(spheres) > 1
        else [],
        wall_contacts=[
            {"lines": _describe(setup, name, wall), "command": wall_fix(setup, name, wall)}
            for wall in walls
            for name in spheres
        ],
    )


def collision_script(
    setup: Setup,
    contact: NamedContact,
    command: str,
    include: str,
    speed: float | None = None,
    timestep: float | None = None,
    phase: float = 0.0,
    contact_times: float = 1.5,
) -> str:
    """Return a complete input script: two bodies of a contact collide head-on, and eps is printed.

    Parameters
    ----------
    setup : Setup
        What the include file was rendered from.
    contact : NamedContact
        One of its contacts.
    command : str
        The command that made the file, for its first line.
    include : str
        Name of the file with `render(setup, ...)`, without blanks.
    speed : float, optional
        Impact speed; the contact's typical one if not given.
    timestep : float, optional
        Time step; a thousandth of the duration of contact if not given.
    phase : float
        Where in the first step contact begins, from 0 to 1.
    contact_times : float
        How long to run, in durations of contact.

    Returns
    -------
    str
        The text. The script prints `epsilon X expected Y overlap Z`: what LAMMPS finds, what `Pair.epsilon` says, and
        the compression at the end.

    Raises
    ------
    ValueError
        If speed or timestep is not a finite number > 0.
    """
    pair = contact.pair
    v = checked.number("speed", contact.typical if speed is None else speed, _POSITIVE)
    duration = float(pair.contact_time(v))
    dt = checked.number("timestep", duration / 1000 if timestep is None else timestep, _POSITIVE)
    atoms = _atoms(setup, contact, v, phase * v * dt)
    radii = [body.radius for body in (pair.first, pair.second) if not body.is_wall]
    wall = pair.second.is_wall
    return written_template(_COLLISION).render(
        marker=marker_lines(command),
        lines=_wrapped(
            f"{contact.name}: a head-on collision at {_number(v)} {setup.units.speed}, in steps of "
            f"{duration / dt:.6g} to a contact. It prints eps, the value expected, and the overlap at the end, which "
            "may be positive: contact ends when the force vanishes."
        ),
        units_command=units_command(setup.units),
        skin=_number(min(radii)),
        box=2.5 * max(radii),
        types=len(setup.spheres),
        atoms=atoms,
        walls=[
            {
                "variable": wall_variable(setup, name),
                "place": "zplane 0.0 NULL" if name == contact.second else "zplane NULL NULL",
            }
            for name in _walls(setup)
        ],
        include=include,
        timestep=f"{dt:.17g}",
        steps=math.ceil(contact_times * duration / dt) + 2,
        rebound=f"vz[1]/{v:.17g}" if wall else f"(vz[2]-vz[1])/{v:.17g}",
        expected=f"{float(pair.epsilon(v)):.17g}",
        overlap=f"{radii[0]:.17g}-z[1]" if wall else f"{radii[0]:.17g}+{radii[1]:.17g}-(z[2]-z[1])",
    )


def _common_poisson_ratio(first: Sphere, second: Sphere) -> float:
    """Return the nu with which one material has the pair's E_eff and effective shear modulus both.

    1/E_eff is the sum of D_i = (1 - nu_i^2)/Y_i, and 1/G_eff that of 2 (2 - nu_i) (1 + nu_i)/Y_i, which is
    2 D_i (1 + 1/(1 - nu_i)). So 1/(1 - nu) is the mean of 1/(1 - nu_i) with the weights D_i.
    """
    if first.poisson_ratio == second.poisson_ratio:
        return first.poisson_ratio
    share = 1 / (1 + first.plane_strain_modulus / second.plane_strain_modulus)  # the first one's of D_1 + D_2
    return 1 - 1 / (share / (1 - first.poisson_ratio) + (1 - share) / (1 - second.poisson_ratio))


def _walls(setup: Setup) -> list[str]:
    """Return the names of the walls."""
    return [name for name, body in setup.bodies.items() if body.is_wall]


def _type(setup: Setup, name: str) -> int:
    """Return the atom type of a sphere."""
    return setup.spheres.index(name) + 1


def _group(number: int) -> str:
    """Return the name of the group of a type."""
    return f"viscopade_type{number}"


def _contact(setup: Setup, first: str, second: str) -> NamedContact | None:
    """Return the contact of two bodies by name, in either order, if it is among those of the setup."""
    return next((c for c in setup.contacts if {c.first, c.second} == {first, second}), None)


def _pair(setup: Setup, first: str, second: str) -> Pair:
    """Return the pair of two bodies by name: that of their contact, or made of the bodies."""
    contact = _contact(setup, first, second)
    return contact.pair if contact else Pair(setup.bodies[first], setup.bodies[second])


def _describe(setup: Setup, first: str, second: str) -> list[str]:
    """Return the comment above a line."""
    pair, contact = _pair(setup, first, second), _contact(setup, first, second)
    numbers, units = hertz_material(pair), setup.units
    radii = " and ".join(f"R = {body.radius:.10g}" for body in (pair.first, pair.second) if not body.is_wall)
    text = (
        f"{harmless(first)} and {harmless(second)}, for {radii} {units.length}, "
        f"m_eff = {pair.m_eff:.10g} {units.mass}: A = {pair.A:.10g} {units.time}, "
        f"beta = {pair.beta:.10g} {units.beta}. The same law: hertz {_number(numbers.k_n)} {_number(numbers.eta_n0)}."
    )
    if contact is None:
        return _wrapped(f"{text} Not among the contacts that are meant to occur.")
    return [
        *_wrapped(text),
        *_wrapped(_speeds(contact, units)),
        *(_wrapped(_sizes(contact)) if contact.extremes else []),
    ]


def _speeds(contact: NamedContact, units: Units) -> str:
    """Return the sentence on the contact's speeds, v* and eps."""
    speeds = list(dict.fromkeys((contact.slowest, contact.typical, contact.fastest)))
    return (
        f"At {', '.join(f'{v:.6g}' for v in speeds)} {units.speed}: "
        f"v* = {', '.join(f'{float(contact.pair.v_star(v)):.6g}' for v in speeds)}, "
        f"eps = {', '.join(f'{float(contact.pair.epsilon(v)):.10g}' for v in speeds)}."
    )


def _sizes(contact: NamedContact) -> str:
    """Return the sentence on other sizes of the same types."""
    ratios = [pair.m_eff / contact.pair.m_eff for pair in contact.extremes]
    return (
        f"With this line bodies of other sizes have A in proportion to their m_eff, {min(ratios):.4g} to "
        f"{max(ratios):.4g} times the right one over the range of sizes, and eps is off by up to "
        f"{size_error(contact):.3g} (relative, at these speeds). To be more exact, make a type of each class of sizes."
    )


def _time_table(setup: Setup) -> list[str]:
    """Return the table of errors: a line for each number of steps, a column for each contact."""
    names = [contact.name for contact in setup.contacts]
    widths = [max(len(name), 7) for name in names]
    head = f"{'N':>6}  {'timestep':>13}  " + "  ".join(f"{n:>{w}}" for n, w in zip(names, widths, strict=True))
    rows = [
        f"{row.steps:>6}  {row.timestep:>13.6e}  "
        + "  ".join(f"{error:>{w}.1e}" for error, w in zip(row.errors, widths, strict=True))
        for row in timesteps(setup)
    ]
    return [head, *rows]


def _units_lines(units: Units) -> list[str]:
    """Return the lines of comment on units."""
    text = f"Units: {units.length}, {units.mass}, {units.time}."
    if (units.length, units.mass, units.time) not in _STYLES:
        text += " LAMMPS has no units style for these: units lj takes numbers as they are."
    return _wrapped(text)


def _atom_type(setup: Setup, name: str) -> dict[str, object]:
    """Return the values of a type for the template."""
    body = setup.bodies[name]
    return {
        "number": _type(setup, name),
        "name": harmless(name),
        "radius": f"{body.radius:.10g}",
        "mass": f"{body.mass:.10g}",
    }


def _atoms(setup: Setup, contact: NamedContact, speed: float, gap: float) -> list[dict[str, object]]:
    """Return where the atoms of a collision start, for the template; a wall is at z = 0."""
    first, second = contact.pair.first, contact.pair.second
    if second.is_wall:
        return [_atom(_type(setup, contact.first), first, first.radius + gap, -speed)]
    return [
        _atom(_type(setup, contact.first), first, -first.radius - gap / 2, speed / 2),
        _atom(_type(setup, contact.second), second, second.radius + gap / 2, -speed / 2),
    ]


def _atom(number: int, body: Sphere, z: float, vz: float) -> dict[str, object]:
    """Return an atom for the template, its numbers as text that loses no bit."""
    return {
        "type": number,
        "z": f"{z:.17g}",
        "vz": f"{vz:.17g}",
        "diameter": f"{2 * body.radius:.17g}",
        "mass": f"{body.mass:.17g}",
    }


def _wrapped(text: str) -> list[str]:
    """Return lines for comments."""
    from textwrap import wrap

    return wrap(text, WIDTH, break_long_words=False, break_on_hyphens=False)


def _number(x: float) -> str:
    """Return a number for LAMMPS: 15 digits, which decide eps to as many."""
    return f"{x:.15g}"


_TEXT = """\
{{ marker | lines("# {}") }}
#
{{ opening | lines("# {}") }}
#
# For LAMMPS, pair_style granular. Include this file where the atoms have been created already; before
# it stand {{ units_command }}, an atom_style with radii (sphere) and "comm_modify vel yes".
{{ units_lines | lines("# {}") }}
#
# Atom types:
{% for type in types %}
#   {{ type.number }}  {{ type.name }}: R = {{ type.radius }} {{ units.length }}, m = {{ type.mass }} {{ units.mass }}
{% endfor %}
#
# Law, along the line of centres, with the compression d and its rate d':
#
#     F = 4/3 E_eff sqrt(R_eff) d^(3/2) + eta_n0 m_eff sqrt(R_eff d) d',    E_eff = E/(2 (1 - nu^2)),
#
# which is the viscoelastic force with the dissipative constant A if eta_n0 = 2 A E_eff/m_eff. E and nu
# of a line are those of one material that is as stiff as the two together, also in tangential
# direction ("mindlin NULL ..."). For like materials they are the material's own.
# End condition: contact ends when the force vanishes (x'' = 0), not when d returns to 0. This is what
# limit_damping does: the force would be attractive from then on, so it is 0 until the spheres part.
# Without limit_damping eps is smaller. So the law is the viscoelastic one, and eps is the exact one at
# all speeds, apart from two errors: that of the time step, and that of other sizes.
#
# Sizes. eta_n0 holds m_eff: a line is right for the radii and masses stated with it, and for no others.
# Every pair of types has its line, as the mean that LAMMPS would take for a missing one is not this law.
#
# Tangential forces: there are none here (LAMMPS refuses "tangential none", so it is linear_nohistory
# with both numbers 0). To have them replace these words, for example by
# "tangential mindlin NULL 1.0 0.5" for the friction coefficient 0.5.
#
# Time step. LAMMPS damps with the velocity of half a step before: the error of eps is proportional to
# the time step. The shortest contact lasts {{ shortest }} {{ units.time }}. With N steps in it eps is off
# by up to (relative; computed by the same scheme, at the slowest, the typical and the fastest speed of
# each contact)
#
{{ time_table | lines("# {}") }}

pair_style granular
{% for block in pairs %}

{{ block.lines | lines("# {}") }}
{{ block.command }}
{% endfor %}
{% if walls %}

# Walls. Where a wall is, is for you to say: define its variable before this file is included (the
# definitions here are ignored then), as "zplane lo hi" (xplane, yplane; NULL for a side that is open)
# or as "region ID" with fix wall/gran/region in place of wall/gran.
{% if groups %}
# Atoms that are created after this are not in the groups, and do not feel walls.
{% endif %}
{% for wall in walls %}
variable {{ wall.variable }} index "zplane 0.0 NULL"  # {{ wall.name }}
{% endfor %}
{% for group in groups %}
group {{ group.name }} type {{ group.number }}
{% endfor %}
{% for block in wall_contacts %}

{{ block.lines | lines("# {}") }}
{{ block.command }}
{% endfor %}
{% endif %}
"""

_COLLISION = """\
{{ marker | lines("# {}") }}
#
{{ lines | lines("# {}") }}

{{ units_command }}
atom_style sphere
atom_modify map array
boundary s s s
comm_modify vel yes
neighbor {{ skin }} nsq
region box block {{ -box }} {{ box }} {{ -box }} {{ box }} {{ -box }} {{ box }}
create_box {{ types }} box
{% for atom in atoms %}
create_atoms {{ atom.type }} single 0 0 {{ atom.z }} units box
set atom {{ loop.index }} diameter {{ atom.diameter }}
set atom {{ loop.index }} mass {{ atom.mass }}
set atom {{ loop.index }} vz {{ atom.vz }}
{% endfor %}

{% for wall in walls %}
variable {{ wall.variable }} index "{{ wall.place }}"
{% endfor %}
include {{ include }}

fix motion all nve/sphere
timestep {{ timestep }}
thermo {{ steps }}
run {{ steps }}

variable epsilon equal {{ rebound }}
variable expected equal {{ expected }}
print "epsilon ${epsilon} expected ${expected} overlap $({{ overlap }}:%.9g)"
"""

_SOURCE = "src/GRANULAR/gran_sub_mod_damping.cpp"
_EPSILON, _E = ("1e-6", "1"), "coefficient of restitution"
_SCALED_ETA = "eta_n0 (m_eff/k_n)^(3/5) (R_eff v)^(1/5)"
"""It is kappa of the scaled equation."""
_ETA_NOTE = "`k_n` is `4/3 E_eff` for hertz/material. `eta_n0` is as `viscopade simulators lammps` writes {}."
_POLYNOMIAL = ("4.8218", "-18.022", "27.467", "-22.348", "11.087", "-4.2783", "1.2728")


def marshall(e: Any) -> Any:
    """Return Marshall's fit of Tsuji's alpha(e)."""
    return mp.polyval([mp.mpf(c) for c in _POLYNOMIAL], e)


_UNITS = {
    "lj": native.FileUnits("sigma", "m", "tau", earth=0.0),
    "si": native.FileUnits(),
    "cgs": native.FileUnits("cm", "g", "s", 1e-2, 1e-3),
    "micro": native.FileUnits("um", "pg", "us", 1e-6, 1e-15, 1e-6),
    "nano": native.FileUnits("nm", "ag", "ns", 1e-9, 1e-21, 1e-9),
}
_OF_EPSILON: Mapping[str, tuple[Callable[[Any], Any], ...]] = {
    "tsuji": (lambda e: mp.sqrt(2) * marshall(e),) * 2,
    "tsuji (22 Jul 2025)": (marshall,) * 2,
    "coeff_restitution": (linear_kappa, tsuji_kappa),
}
"""Dampings that take an eps, and their kappa for hooke and hertz."""


def _constants(values: native.Values, impact: native.Impact) -> tuple[Law, float, float]:
    """Return the law of a line of pair_coeff, k and c.

    Raises
    ------
    ValueError
        If there are other coefficients than the normal model has, or one is not accepted.
    """
    normal, damping, numbers = values["normal"], values["damping"], values["coefficients"]
    words = "E, damping coefficient and nu" if normal == "hertz/material" else "k_n and damping coefficient"
    if len(numbers) != words.count(",") + 2:
        raise ValueError(f"coefficients is {len(numbers)} numbers: accepted for {normal} is {words}")
    k, coefficient = numbers[:2]
    if k <= 0 or numbers[2:] > (0.5,) or (damping in _OF_EPSILON and not 0 < coefficient <= 1):
        accepted = "a stiffness > 0, a nu up to 1/2 and for tsuji and coeff_restitution an eps > 0 and <= 1"
        raise ValueError(f"coefficients is {' '.join(f'{x:g}' for x in numbers)}: expected {accepted}")
    mass, hertz = impact.effective_mass, normal != "hooke"
    if normal == "hertz/material":
        k = HertzMaterial(k, coefficient, numbers[2]).k_n
    if hertz:
        k *= math.sqrt(impact.effective_radius)
    if damping in _OF_EPSILON:
        b, c = Fraction(int(hertz), 4), float(_OF_EPSILON[damping][hertz](mp.mpf(coefficient))) * math.sqrt(mass * k)
    elif damping == "viscoelastic":
        b, c = Fraction(1, 2), coefficient * mass * math.sqrt(impact.effective_radius)
    else:
        b, c = Fraction(0), coefficient * (mass if damping == "mass_velocity" else 1)
    return Law(Fraction(3, 2) if hertz else 1, b, "force" if values["limit_damping"] == "yes" else "return"), k, c


def _damped(values: native.Values, damping: float, impact: native.Impact) -> dict[str, tuple[float, ...]]:
    """Return the coefficients with another damping: an eps, or what makes kappa of the law."""
    first, _, *rest = values["coefficients"]
    if values["damping"] in _OF_EPSILON:
        return {"coefficients": (first, max(math.exp(-damping), float(_EPSILON[0])), *rest)}
    one = native.Values({**values, "coefficients": (first, 1.0, *rest)})
    return {"coefficients": (first, native.number_for(damping, *_constants(one, impact), impact), *rest)}


def _warnings(values: native.Values, _: native.Impact) -> Iterator[str]:
    if values["damping"] == "tsuji":
        yield "Releases up to 22 Jul 2025 damp less, by sqrt(2): damping = tsuji (22 Jul 2025)"


_NATIVE = native.Native(
    (
        native.Parameter("normal", words=("hooke", "hertz", "hertz/material")),
        native.Parameter(
            "coefficients",
            accepted="the numbers of the normal model, as in the line: k_n and damping coefficient, or for "
            "hertz/material E, damping coefficient and nu; with tsuji and coeff_restitution the coefficient is an eps",
            most=3,
        ),
        native.Parameter(
            "damping", default="viscoelastic", words=("velocity", "mass_velocity", "viscoelastic", *_OF_EPSILON)
        ),
        native.Parameter("limit_damping", default="no", words=("no", "yes")),
        native.Parameter("units", default="lj", words=tuple(_UNITS)),
    ),
    lambda values, impact: native.law_contact(*_constants(values, impact), impact),
    _SOURCE,
    schemes={"verlet": SEMI_IMPLICIT},
    integrator="run_style",
    damped=_damped,
    warnings=_warnings,
    units=lambda values: _UNITS[values["units"]],
)

SIMULATOR = Simulator(
    "lammps",
    "LAMMPS",
    "commit 07b704c",
    (
        DampingFormula("hertz, coeff_restitution", TSUJI_RETURN, _E, tsuji_kappa, _EPSILON, "exact", _SOURCE),
        DampingFormula(
            "hertz, coeff_restitution, limit_damping", TSUJI, _E, tsuji_kappa, _EPSILON, "other end", _SOURCE
        ),
        DampingFormula("hooke, coeff_restitution", LINEAR_RETURN, _E, linear_kappa, _EPSILON, "exact", _SOURCE),
        DampingFormula(
            "hooke, coeff_restitution, limit_damping", LINEAR, _E, linear_kappa, _EPSILON, "other end", _SOURCE
        ),
        DampingFormula(
            "hertz, tsuji (22 Jul 2025)",
            TSUJI_RETURN,
            _E,
            marshall,
            ("0", "1"),
            "normalisation",
            _SOURCE,
            note="The damping lacks the factor √2 between the mass of Tsuji et al. and the effective mass.",
        ),
        DampingFormula(
            "hertz, tsuji",
            TSUJI_RETURN,
            _E,
            lambda e: mp.sqrt(2) * marshall(e),
            ("0", "1"),
            "approximate formula",
            _SOURCE,
        ),
        DampingFormula(
            "hertz, tsuji, limit_damping",
            TSUJI,
            _E,
            lambda e: mp.sqrt(2) * marshall(e),
            ("0", "1"),
            "other end",
            _SOURCE,
        ),
        DampingFormula(
            "hooke, mass_velocity",
            LINEAR_RETURN,
            "eta_n0 sqrt(m_eff/k)",
            mp.mpf,
            ("0", "100"),
            "exact",
            _SOURCE,
            written=linear_kappa,
        ),
        DampingFormula(
            "hooke, mass_velocity, limit_damping",
            LINEAR,
            "eta_n0 sqrt(m_eff/k)",
            mp.mpf,
            ("0", "100"),
            "other end",
            _SOURCE,
            written=linear_kappa,
        ),
        DampingFormula(
            "hertz, viscoelastic, limit_damping",
            VISCOELASTIC,
            _SCALED_ETA,
            mp.mpf,
            ("0", "1e6"),
            "exact",
            _SOURCE,
            written=viscoelastic_kappa,
            note=_ETA_NOTE.format("it"),
        ),
        DampingFormula(
            "hertz, viscoelastic",
            law_of("viscoelastic", "return"),
            _SCALED_ETA,
            mp.mpf,
            ("0", "1e6"),
            "other end",
            _SOURCE,
            written=viscoelastic_kappa,
            note=_ETA_NOTE.format("it, without its `limit_damping`"),
        ),
    ),
    texts={"lammps": render},
    lines={"pair": f"pair_coeff 1 1 {STYLE}", "wall": _WALL},
    native=_NATIVE,
)
