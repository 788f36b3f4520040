"""REBOUND: the `coefficient_of_restitution` callback with our kernel, in C and Python, for one pair or by sizes.

REBOUND's source (read in version 5.2.2; `src/collision.c` is the same in 5.0.0): `reb_collision_resolve_hardsphere`
calls `r->coefficient_of_restitution(r, v)` with the component of the relative velocity p1 - p2 along the line of
centres from p2 to p1, in the simulation's units. The spheres approach, so v is negative (or 0): callbacks take fabs(v).
Without a callback eps is 1. `r->minimum_collision_velocity` may raise the change of velocity afterwards.

The callback knows neither of the two particles: it can have one beta only. If sizes are distributed, that is wrong for
all pairs but the typical one, as beta is proportional to 1/R for spheres of one material. A `collision_resolve`
function does know the pair: it gets the numbers of both particles and looks masses and radii up. The generated
C file has one. It needs no root for beta: for one material

    beta^5 / beta_0^5 = (R_eff/R_0) (m_0/m_eff)^2                                      (eq:betadef, eq:paramEl)

and v* depends on beta^5 v alone, so the pair at speed v has the eps of the typical pair (R_0, m_0) at that factor
times v. In Python, `rebound/simulation.py` makes a Python callback of any callable, also of a compiled function or of
the word "hardsphere"; of an address (an int) it makes a pointer to the compiled function itself, so that is what
the generated module hands over.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from textwrap import wrap

import numpy as np

from viscopade.arithmetic.formats import DOUBLE
from viscopade.arrays.checked import FloatArray
from viscopade.collision.spheres import Pair
from viscopade.generated import END_CONDITION, WIDTH, marker_line, one_line, template
from viscopade.kernels import names, prove_lacunary
from viscopade.kernels.forms import speed_kernel
from viscopade.kernels.targets import speed
from viscopade.simulators.setup import Contact, Setup

LANGUAGES = ("c", "python")
SAMPLES = 1001  # speeds at which errors are looked for


@dataclass(frozen=True)
class SizeError:
    """Error of a pair's eps by one beta for all sizes.

    Attributes
    ----------
    pair : Pair
        Not the typical one.
    absolute, relative : float
        Largest |difference| of the typical pair's eps to this pair's, and over this pair's eps, at
        `SAMPLES` speeds.
    speed : float
        Where the absolute error is largest.
    """

    pair: Pair
    absolute: float
    relative: float
    speed: float


def size_errors(contact: Contact) -> tuple[SizeError, ...]:
    """Return the errors of a callback with the typical pair's beta, for each of the contact's extremes."""
    speeds = np.geomspace(contact.slowest, contact.fastest, SAMPLES)
    typical = contact.pair.epsilon(speeds)
    return tuple(_size_error(pair, speeds, typical) for pair in contact.extremes)


def _size_error(pair: Pair, speeds: FloatArray, typical: FloatArray) -> SizeError:
    exact = np.asarray(pair.epsilon(speeds))
    error = np.abs(typical - exact)
    return SizeError(pair, float(error.max()), float((error / exact).max()), float(speeds[error.argmax()]))


def callback_kernel(tier: str) -> speed_kernel.SpeedKernel:
    """Return the kernel from speed to eps in the files; of the two tables for 1e-5, the small one.

    Collisions come one at a time, between other work: a large table would not stay in the cache.

    Raises
    ------
    ValueError
        If there is no such tier.
    """
    return prove_lacunary.speed_kernel(tier, names.SMALL if (tier, names.SMALL) in speed_kernel.TABLES else names.FAST)


def contacts(setup: Setup) -> dict[str, Contact]:
    """Return the contacts of two spheres, which REBOUND can have, by the ends of their C functions' names.

    Raises
    ------
    ValueError
        If there is none.
    """
    found: dict[str, Contact] = {}
    for contact in setup.contacts:
        if not contact.pair.second.is_wall:
            found[_unused(re.sub(r"\W+", "_", contact.name, flags=re.ASCII), found)] = contact
    if not found:
        raise ValueError(
            f"{setup.title}: all contacts are with walls: accepted for REBOUND are contacts of two spheres"
        )
    return found


def _unused(name: str, taken: dict[str, Contact]) -> str:
    return name if name not in taken else _unused(f"{name}_", taken)


def render(setup: Setup, command: str, language: str = "c", tier: str = "1e-5") -> str:
    """Return the text of a C file or of a Python module for REBOUND.

    The C file stands alone: it has the kernel, for each contact of two spheres a callback (one beta) and a
    `collision_resolve` function (beta by the masses and radii of the two particles). The Python module's `install`
    gives a simulation the compiled functions, if the C file's shared library lies beside it, and otherwise slow
    ones with `viscopade.restitution`.

    Parameters
    ----------
    setup : Setup
        The simulation must use its units.
    command : str
        The command line that makes the file.
    language : "c" or "python"
    tier : str
        Accuracy of the kernel in the C file, as for `kernels.prove_lacunary.speed_kernel`.

    Raises
    ------
    ValueError
        If the language or the tier is not known, `command`, the title or a name is not one printable line, or no two
        spheres meet.
    """
    if language not in LANGUAGES:
        raise ValueError(f"language is {language!r}: accepted are {', '.join(LANGUAGES)}")
    named = contacts(setup)
    chosen = callback_kernel(tier)
    head = _head(setup, named, chosen, command, _ON[language])
    if language == "python":
        return template(__name__, "rebound.py.jinja").render(
            head="\n".join(f"# {line}".rstrip() for line in head), contacts=_numbers(named)
        )
    return template(__name__, "rebound.c.jinja").render(
        head="\n".join(f" * {line}".rstrip() for line in head),
        kernel=speed.render(chosen, command),
        name=chosen.name,
        contacts=_numbers(named),
    )


def _numbers(named: dict[str, Contact]) -> list[dict[str, str]]:
    """Return what the templates need of each contact."""
    return [
        {"symbol": symbol, "name": repr(contact.name), "label": one_line("the name of a contact", contact.name)}
        | {name: repr(value) for name, value in _typical(contact.pair).items()}
        | {f"{name}_c": DOUBLE.hexadecimal(value) for name, value in _typical(contact.pair).items()}
        for symbol, contact in named.items()
    ]


def _typical(pair: Pair) -> dict[str, float]:
    return {"beta": pair.beta, "m_eff": pair.m_eff, "R_eff": pair.R_eff}


# --- what the files say -----------------------------------------------------------------------------------------------

_C = """
For each contact there is one function of each kind:

    double viscopade_callback_CONTACT(const struct reb_simulation *r, double v)
        for r->coefficient_of_restitution, with r->collision_resolve = reb_collision_resolve_hardsphere. REBOUND
        tells it no particles, so it has the beta below for all pairs.
    enum REB_COLLISION_RESOLVE_OUTCOME viscopade_resolve_CONTACT(struct reb_simulation *r, struct reb_collision c)
        for r->collision_resolve: bounces like reb_collision_resolve_hardsphere, with beta by the masses and radii
        of the two particles (the material is that of the contact). Not with MPI.

There is no state. C99. Compile this file with your problem.c, or include it there; or make a shared
library for the Python module. The resolve functions need rebound.h of the REBOUND that runs; define
VISCOPADE_CALLBACK_ONLY to do without them and without rebound.h."""

_PYTHON = """
    import rebound, NAME  # NAME.py is this file
    NAME.install(sim)

The fast way needs the C file of the same setup, compiled to a shared library libNAME.so beside this
module (macOS and Windows: give its path as `library`); rebound.h is that of the installed package:

    cc -O3 -march=native -shared -fPIC -I "$(python -c 'import rebound; print(rebound.__path__[0])')/../src" \\
        -o libNAME.so NAME.c -lm

Without it Python functions with viscopade.restitution (full accuracy) are called for each collision."""

_ON = {"c": _C, "python": _PYTHON}


def _head(
    setup: Setup, named: dict[str, Contact], chosen: speed_kernel.SpeedKernel, command: str, use: str
) -> list[str]:
    """Return the lines of the comment that begins a file."""
    units, opening = setup.units, setup.opening
    return [
        marker_line(command),
        "",
        *wrap(f"For REBOUND (written for 5.2.2): {opening[0]}", WIDTH),
        *(line for text in opening[1:] for line in wrap(text, WIDTH)),
        "",
        *wrap(
            "The coefficient of normal restitution eps of viscoelastic spheres. The simulation must use these units: "
            f"{units.length}, {units.mass}, {units.time}.",
            WIDTH,
        ),
        *wrap(f"End condition: {END_CONDITION}.", WIDTH),
        *wrap(
            f"Error of the compiled functions: |eps - exact|/min(eps, 1 - eps) <= {chosen.bound} at all speeds "
            "(proven; besides rounding, as the kernel's comment says).",
            WIDTH,
        ),
        *use.splitlines(),
        *(line for symbol, contact in named.items() for line in _contact_lines(setup, symbol, contact)),
        *_walls(setup),
    ]


def _contact_lines(setup: Setup, symbol: str, contact: Contact) -> list[str]:
    units, pair = setup.units, contact.pair
    facts = [
        f"typical pair: R_eff = {pair.R_eff!r} {units.length}, m_eff = {pair.m_eff!r} {units.mass}, A = {pair.A!r} "
        f"{units.time}, beta = {pair.beta!r} {units.beta}",
        *(
            f"at {word} speed {v!r} {units.speed}: v* = {pair.v_star(v):.6g}, eps = {pair.epsilon(v):.10g}"
            for word, v in zip(_SPEEDS, (contact.slowest, contact.typical, contact.fastest), strict=True)
        ),
        *(_size_line(setup, error) for error in size_errors(contact)),
        _SIZES if contact.extremes else _ONE_SIZE,
    ]
    lines = (wrap(fact, WIDTH, initial_indent="    ", subsequent_indent="        ") for fact in facts)
    return [
        "",
        f"{symbol}: {one_line('the name of a contact', contact.name)}",
        *(line for part in lines for line in part),
    ]


_SPEEDS = ("the least", "typical", "the largest")
_SIZES = "sizes are distributed: use the resolve function, which has none of the errors of one beta"
_ONE_SIZE = "no other sizes are given: the callback and the resolve function are equally right"


def _size_line(setup: Setup, error: SizeError) -> str:
    units, pair = setup.units, error.pair
    return (
        f"one beta, for the pair R_eff = {pair.R_eff!r} {units.length}, m_eff = {pair.m_eff!r} {units.mass} (beta = "
        f"{pair.beta!r}): eps is off by up to {error.absolute:.3g} (at {error.speed:.3g} {units.speed}), relatively by "
        f"up to {error.relative:.3g} ({SAMPLES} speeds from the least to the largest, sampled)"
    )


def _walls(setup: Setup) -> list[str]:
    names = [one_line("the name of a contact", c.name) for c in setup.contacts if c.pair.second.is_wall]
    return ["", *wrap(f"REBOUND has no walls; left out: {', '.join(names)}.", WIDTH)] if names else []
