"""REBOUND: the `coefficient_of_restitution` callback with our kernel, in C and Python, for one pair or by sizes.

    r->collision_resolve = viscopade_resolve_ball_ball;                      in C, by sizes
    r->coefficient_of_restitution = viscopade_callback_ball_ball;            in C, for one pair
    import rebound, NAME; NAME.install(sim)                                  in Python

REBOUND's source (read in version 5.2.2; `src/collision.c` is the same in 5.0.0): `reb_collision_resolve_hardsphere`
calls `r->coefficient_of_restitution(r, v)` with the component of the relative velocity p1 - p2 along the line of
centres from p2 to p1, in the simulation's units. The spheres approach, so v is negative (or 0): callbacks take fabs(v).
Without a callback eps is 1. `r->minimum_collision_velocity` may raise the change of velocity afterwards.

The callback knows neither of the two particles: it can have one beta only. If sizes are distributed, that is wrong for
all pairs but the typical one, as beta is proportional to 1/R for spheres of one material. A `collision_resolve`
function does know the pair: it gets the numbers of both particles and looks masses and radii up. The generated
C file has one. It needs no root for beta: for one material

    beta^5 / beta_0^5 = (R_eff/R_0) (m_0/m_eff)^2                                      (the paper's Eqs. 8 and 3)

and v* depends on beta^5 v alone, so the pair at speed v has the eps of the typical pair (R_0, m_0) at that factor
times v. In Python, `rebound/simulation.py` makes a Python callback of any callable, also of a compiled function or of
the word "hardsphere"; of an address (an int) it makes a pointer to the compiled function itself, so that is what
the generated module hands over.

For the audit: `reb_collision_resolve_hardsphere` multiplies the normal component of the relative velocity by -eps,
whatever eps is. There is no force, and no time step in a collision. A constant eps is that of a law with nu = 2.
`minimum_collision_velocity` is a rate, not a velocity: the change of velocity is at least the rate times the overlap,
which counts up to the larger radius. The overlap is that at the end of a step.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from viscopade.arithmetic.decimals import at_most
from viscopade.arithmetic.formats import DOUBLE
from viscopade.arrays.checked import FloatArray
from viscopade.collision.schemes import SEMI_IMPLICIT
from viscopade.generated import END_CONDITION
from viscopade.kernels import catalogue
from viscopade.kernels.kernel import Kernel
from viscopade.kernels.write.file import file_text
from viscopade.kernels.write.languages import language as language_of
from viscopade.simulators import native
from viscopade.simulators.formula import LINEAR, DampingFormula, force_end_kappa, viscoelastic_formula
from viscopade.simulators.input_file import same_beta, size_errors, template_contact
from viscopade.simulators.setup import NamedContact, Setup
from viscopade.simulators.simulator import InputFile, Simulator


def callback_kernel(tier: str) -> Kernel:
    """Return the kernel of the files, a function of speed and beta whose result is eps.

    `tier` is a word of `catalogue.TIERS`, such as "1e-5": an upper bound of its error.

    Raises
    ------
    ValueError
        If there is no such tier.
    """
    if tier not in catalogue.TIERS:
        raise ValueError(f"tier is {tier!r}: expected {', '.join(catalogue.TIERS)}")
    return catalogue.kernel(f"speed {tier}")


def contacts(setup: Setup) -> dict[str, NamedContact]:
    """Return the contacts of two spheres, which REBOUND can have, by the ends of their C functions' names.

    Raises
    ------
    ValueError
        If there is none.
    """
    by_symbol: dict[str, NamedContact] = {}
    for contact in setup.contacts:
        if contact.pair.second.is_wall:
            continue
        # Characters that a name in C cannot have become _, and a name that is taken gets one more.
        symbol = re.sub(r"\W+", "_", contact.name, flags=re.ASCII)
        while symbol in by_symbol:
            symbol = f"{symbol}_"
        by_symbol[symbol] = contact
    if not by_symbol:
        raise ValueError(
            f"{setup.title}: all contacts are with walls: expected contacts of two spheres, as REBOUND has no walls"
        )
    return by_symbol


def _values(setup: Setup, tier: str = "1e-5") -> dict[str, Any]:
    """Return what the templates of both languages have, by name.

    Parameters
    ----------
    setup : Setup
        The simulation must use its units.
    tier : str
        Accuracy of the kernel in the C file: a word of `catalogue.TIERS`; 1e-5 is chosen by hand.

    Raises
    ------
    ValueError
        If the tier is not known, or no two spheres meet.
    """
    kernel = callback_kernel(tier)
    rows = []
    for symbol, contact in contacts(setup).items():
        # The typical pair, in decimals for Python, and in hexadecimals, which C reads without rounding.
        pair = contact.pair
        numbers = {"beta": pair.beta, "m_eff": pair.m_eff, "R_eff": pair.R_eff}
        exact = {f"{name}_c": DOUBLE.hexadecimal(value) for name, value in numbers.items()}
        # The callback has one beta for all sizes: its errors are those at the ends of the sizes.
        errors = size_errors(contact, same_beta(pair))
        functions = {("functions", ""): f"viscopade_callback_{symbol} viscopade_resolve_{symbol}"}
        rows.append(
            template_contact(
                contact, setup, errors, functions, symbol=symbol, quoted=repr(contact.name), **numbers, **exact
            )
        )
    return {
        "contacts": rows,
        "kernel": lambda command: file_text([kernel], language_of("c"), command),
        "function": f"viscopade_restitution_{kernel.name}",
        # The proven bound, rounded up to a short decimal.
        "error": at_most(max(bound.formula for bound in kernel.bounds if bound.result == "restitution")),
        "walls": [contact.name for contact in setup.contacts if contact.pair.second.is_wall],
        "end_condition": END_CONDITION,
    }


_USE = """\
For REBOUND (written for 5.2.2): the coefficient of normal restitution eps of viscoelastic spheres. The simulation must
use these units: {{ units.length }}, {{ units.mass }}, {{ units.time }}.
End condition: {{ end_condition }}.
Error of the compiled functions: |eps - exact|/min(eps, 1 - eps) <= {{ error }} at all speeds (proven; besides rounding,
as the kernel's comment says).
If sizes are distributed, use the resolve function: it has none of the errors of one beta.
{% if walls %}
REBOUND has no walls; left out: {{ walls | join(", ") }}.
{% endif %}
"""

_USE_C = f"""\
{_USE}
For each contact there is one function of each kind:

    double viscopade_callback_CONTACT(const struct reb_simulation *r, double v)
        for r->coefficient_of_restitution, with r->collision_resolve = reb_collision_resolve_hardsphere. REBOUND
        tells it no particles, so it has the beta below for all pairs.
    enum REB_COLLISION_RESOLVE_OUTCOME viscopade_resolve_CONTACT(struct reb_simulation *r, struct reb_collision c)
        for r->collision_resolve: bounces like reb_collision_resolve_hardsphere, with beta by the masses and radii
        of the two particles (the material is that of the contact). Not with MPI.

There is no state. C99. Compile this file with your problem.c, or include it there; or make a shared library for the
Python module. The resolve functions need rebound.h of the REBOUND that runs; define VISCOPADE_CALLBACK_ONLY to do
without them and without rebound.h.
"""

_USE_PYTHON = f"""\
{_USE}
    import rebound, NAME  # NAME.py is this file
    NAME.install(sim)

The fast way needs the C file of the same setup, compiled to a shared library libNAME.so beside this module (macOS and
Windows: give its path as `library`); rebound.h is that of the installed package:

    where=$(python -c 'import rebound; print(rebound.__path__[0])')
    cc -O3 -march=native -shared -fPIC -I "$where/../src" -o libNAME.so NAME.c -lm

Without it Python functions with viscopade.restitution (full accuracy) are called for each collision.
"""

_CODE_C = """\
{{ kernel(command) }}
struct reb_simulation;
{% for contact in contacts %}

/* {{ contact.name }}. REBOUND's v is negative: that of particle 1 relative to 2, along the line from 2 to 1. */
extern const double viscopade_beta_{{ contact.symbol }};
const double viscopade_beta_{{ contact.symbol }} = {{ contact.beta_c }}; /* {{ contact.beta }} */

double viscopade_callback_{{ contact.symbol }}(const struct reb_simulation *r, double v);
double viscopade_callback_{{ contact.symbol }}(const struct reb_simulation *r, double v)
{
    (void)r;
    return {{ function }}(fabs(v), viscopade_beta_{{ contact.symbol }});
}
{% endfor %}

#ifndef VISCOPADE_CALLBACK_ONLY
#ifdef MPI
#error "the resolve functions need both particles on this machine: define VISCOPADE_CALLBACK_ONLY with MPI"
#endif
#include <stddef.h>
#include "rebound.h"

/* What is used of REBOUND's structures: the Python module compares it with those of the REBOUND that runs. */
extern const size_t viscopade_layout[8];
const size_t viscopade_layout[8] = {
    sizeof(struct reb_particle),
    offsetof(struct reb_particle, m),
    offsetof(struct reb_particle, r),
    sizeof(struct reb_collision),
    offsetof(struct reb_simulation, particles),
    offsetof(struct reb_simulation, minimum_collision_velocity),
    offsetof(struct reb_simulation, collisions_plog),
    offsetof(struct reb_simulation, collisions_log_n),
};

/* Smooth spheres bounce: the impulse is along the line of centres. R_0 and m_0 belong to beta. */
static enum REB_COLLISION_RESOLVE_OUTCOME viscopade_bounce(
    struct reb_simulation *r, struct reb_collision c, double beta, double R_0, double m_0)
{
    struct reb_particle *p1 = &r->particles[c.p1], *p2 = &r->particles[c.p2];
    /* From 2 to 1; c.gb is the shift of 1 by periodic or shearing boundaries. */
    const double x = p1->x + c.gb.x - p2->x;
    const double y = p1->y + c.gb.y - p2->y;
    const double z = p1->z + c.gb.z - p2->z;
    const double distance = sqrt(x * x + y * y + z * z);
    const double reach = p1->r + p2->r;
    const double closing = x * (p2->vx - c.gb.vx - p1->vx) + y * (p2->vy - c.gb.vy - p1->vy)
        + z * (p2->vz - c.gb.vz - p1->vz);
    if (distance > reach || distance == 0.0 || closing < 0.0) {
        return REB_COLLISION_RESOLVE_OUTCOME_REMOVE_NONE;
    }
    const double speed = closing / distance;
    const double mass = p1->m + p2->m;
    const double m_eff = p1->m * (p2->m / mass);
    const double R_eff = p1->r * (p2->r / reach);
    /* beta^5 speed of this pair over that of the pair of R_0 and m_0 at the same speed. */
    const double factor = (R_eff / R_0) * (m_0 / m_eff) * (m_0 / m_eff);
    const double eps = {{ function }}(factor * speed, beta);

    /* REBOUND's own remedy against spheres that sink into each other. */
    const double larger = p1->r > p2->r ? p1->r : p2->r;
    const double overlap = reach - distance;
    const double least = r->minimum_collision_velocity * (overlap < larger ? overlap : larger);
    const double rebound = (1.0 + eps) * speed;
    const double change = (rebound < least ? least : rebound) / distance;

    const double of_1 = change * (p2->m / mass), of_2 = change * (p1->m / mass);
    p1->vx += of_1 * x;
    p1->vy += of_1 * y;
    p1->vz += of_1 * z;
    p2->vx -= of_2 * x;
    p2->vy -= of_2 * y;
    p2->vz -= of_2 * z;

    /* REBOUND's records of collisions: momentum along y that is carried along x, and the number. */
    r->collisions_plog += x * (m_eff * change * y);
    r->collisions_log_n++;
    return REB_COLLISION_RESOLVE_OUTCOME_REMOVE_NONE;
}
{% for contact in contacts %}

/* {{ contact.name }} */
enum REB_COLLISION_RESOLVE_OUTCOME viscopade_resolve_{{ contact.symbol }}(
    struct reb_simulation *r, struct reb_collision c);
enum REB_COLLISION_RESOLVE_OUTCOME viscopade_resolve_{{ contact.symbol }}(
    struct reb_simulation *r, struct reb_collision c)
{
    /* R_0 = {{ contact.R_eff }}, m_0 = {{ contact.m_eff }} */
    return viscopade_bounce(r, c, viscopade_beta_{{ contact.symbol }}, {{ contact.R_eff_c }}, {{ contact.m_eff_c }});
}
{% endfor %}
#endif
"""

_CODE_PYTHON = '''\

"""Give a REBOUND simulation the coefficient of restitution of viscoelastic spheres: `install(sim)`."""

from __future__ import annotations

import ctypes
from pathlib import Path
from typing import NamedTuple

LIBRARY = Path(__file__).with_name(f"lib{Path(__file__).stem}.so")


class Contact(NamedTuple):
    """The end of the names of its C functions, and its typical pair."""

    symbol: str
    beta: float
    R_eff: float
    m_eff: float


CONTACTS = {
{% for contact in contacts %}
    {{ contact.quoted }}: Contact("{{ contact.symbol }}", {{ contact.beta }}, {{ contact.R_eff }}, {{ contact.m_eff }}),
{% endfor %}
}


def install(sim, contact={{ contacts[0].quoted }}, by_pair=True, library=None):
    """Set collision_resolve and coefficient_of_restitution of a simulation, and say how.

    Saved simulations do not keep functions: call this again after loading one.

    Parameters
    ----------
    sim : rebound.Simulation
        Its units must be those stated above; its masses must be positive.
    contact : str
        One of CONTACTS: the material of all particles.
    by_pair : bool
        Whether beta depends on the masses and radii of the two particles; else it is the typical pair's.
    library : str or Path, optional
        The shared library made of the C file; without it LIBRARY, if it exists.

    Returns
    -------
    str
        "compiled", or "python" if there is no library.

    Raises
    ------
    ValueError
        If the contact is not known, or the library is not that of this setup and of the REBOUND that runs.
    OSError
        If the library cannot be loaded.
    """
    if contact not in CONTACTS:
        raise ValueError(f"contact is {contact!r}: expected {', '.join(CONTACTS)}")
    if library is None and not LIBRARY.exists():
        _install_python(sim, CONTACTS[contact], by_pair)
        return "python"
    path = Path(LIBRARY if library is None else library).resolve()
    _install_compiled(sim, CONTACTS[contact], by_pair, path)
    return "compiled"


def _install_compiled(sim, contact, by_pair, path):
    import rebound

    compiled = ctypes.CDLL(str(path))
    _check(compiled, contact, by_pair, path)
    resolve = rebound.clibrebound.reb_collision_resolve_hardsphere
    if by_pair:
        resolve = compiled[f"viscopade_resolve_{contact.symbol}"]
    # REBOUND wraps what is callable in a Python callback, and takes a number as the function's address.
    sim.collision_resolve = _address(resolve)
    sim.coefficient_of_restitution = _address(compiled[f"viscopade_callback_{contact.symbol}"])


def _address(function):
    return ctypes.cast(function, ctypes.c_void_p).value


def _check(compiled, contact, by_pair, path):
    """Refuse a library of another setup, and one whose idea of REBOUND's structures is another."""
    from rebound import Particle, Simulation
    from rebound.simulation import CollisionS

    try:
        beta = ctypes.c_double.in_dll(compiled, f"viscopade_beta_{contact.symbol}").value
        layout = list((ctypes.c_size_t * 8).in_dll(compiled, "viscopade_layout")) if by_pair else None
    except ValueError as error:
        raise ValueError(f"{path}: {error}: expected the C file of this setup, compiled") from None
    if beta != contact.beta:
        raise ValueError(f"{path} is of another setup: its beta is {beta!r}, expected {contact.beta!r}")
    here = [
        ctypes.sizeof(Particle),
        Particle.m.offset,
        Particle.r.offset,
        ctypes.sizeof(CollisionS),
        Simulation._particles.offset,
        Simulation.minimum_collision_velocity.offset,
        Simulation.collisions_plog.offset,
        Simulation.collisions_log_n.offset,
    ]
    if layout not in (None, here):
        raise ValueError(f"{path} was compiled with another REBOUND's rebound.h: compile it with this one's")


def _install_python(sim, contact, by_pair):
    import rebound
    from viscopade import restitution

    hardsphere = rebound.clibrebound.reb_collision_resolve_hardsphere
    factor = 1.0  # of the speed, so that the typical pair has the v* of the pair that collides

    def callback(_, v):
        return float(restitution(factor * abs(v), contact.beta))

    def resolve(pointer, collision):
        nonlocal factor
        particles = pointer.contents._particles
        p1, p2 = particles[collision.p1], particles[collision.p2]
        m_eff, R_eff = p1.m * p2.m / (p1.m + p2.m), p1.r * p2.r / (p1.r + p2.r)
        factor = R_eff / contact.R_eff * (contact.m_eff / m_eff) ** 2
        return hardsphere(pointer, collision)

    sim.collision_resolve = resolve if by_pair else _address(hardsphere)
    sim.coefficient_of_restitution = callback
'''

_SOURCE, _E = "src/collision.c", "coefficient_of_restitution"
_FIXED = "leapfrog", "sei", "whfast"  # integrators with a fixed time step; ias15 chooses its own


def _impulse(values: native.Values, impact: native.Impact) -> native.Impulse:
    """Return the collision, which REBOUND resolves at the end of the step in which the spheres overlap.

    `values` are eps and the rate of the user's simulation, `impact` has the speed, the radius and the time step, in its
    units.

    Raises
    ------
    ValueError
        If there is gravity.
    """
    if impact.gravity:
        raise ValueError("gravity is given: REBOUND has no walls on which bodies fall")
    # minimum_collision_velocity is a rate, in 1/s; the overlap counts up to the radius of the larger sphere.
    e, rate, deepest = values[_E], values["minimum_collision_velocity"], math.inf
    if impact.radius is not None:
        deepest = 2 * impact.radius  # of two equal spheres, whose effective radius is half of theirs

    def epsilon(phases: FloatArray) -> FloatArray:
        """Return eps of contacts that begin at phases of a step, from 0 to 1."""
        # The overlap at the end of the step is the rest of the way in it, (1 - phase) h v. The change of velocity is
        # (1 + e) v, or the rate times the overlap if that is larger: eps = max(e, rate overlap/v - 1).
        overlap = (1 - phases) * (impact.step or 0.0) * impact.speed
        return np.asarray(np.maximum(e, rate * np.minimum(overlap, deepest) / impact.speed - 1))

    return native.Impulse(epsilon)


def _warnings(values: native.Values, impact: native.Impact) -> Iterator[str]:
    """Yield a warning that minimum_collision_velocity was given, and no time step by which bodies overlap."""
    if values["minimum_collision_velocity"] and impact.step is None:
        yield "minimum_collision_velocity acts on spheres that overlap: give --time-step, and --scheme leapfrog"


_NATIVE = native.Native(
    (native.restitution(_E, "1"), native.Parameter("minimum_collision_velocity", "1/s", "0")),
    _impulse,
    _SOURCE,
    schemes={"ias15": None, **dict.fromkeys(_FIXED, SEMI_IMPLICIT)},
    integrator="integrator",
    damping=_E,
    warnings=_warnings,
)

SIMULATOR = Simulator(
    "rebound",
    "REBOUND",
    "5.2.2",
    (
        DampingFormula(
            "coefficient_of_restitution, a constant",
            LINEAR,
            "eps",
            force_end_kappa,
            ("0.001", "1"),
            "exact",
            _SOURCE,
            note="There is no contact: eps is applied, the same at all speeds.",
            scheme=None,
            is_impulse=True,
        ),
        replace(
            viscoelastic_formula(
                "collision_resolve of viscopade simulators",
                _SOURCE,
                "eps is that of viscoelastic spheres at each speed, by the kernel or by viscopade.restitution.",
                scheme=None,
            ),
            is_impulse=True,
        ),
    ),
    texts={
        "rebound-c": InputFile("/*", _USE_C, _CODE_C, _values, "use the resolve function"),
        "rebound-python": InputFile("#", _USE_PYTHON, _CODE_PYTHON, _values, "use the resolve function"),
    },
    walls=False,
    native=_NATIVE,
)
