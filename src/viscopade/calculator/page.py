"""The page of `viscopade calculator`: its text, and the data from other packages."""

from __future__ import annotations

import json
from typing import Any

from viscopade import generated, quantity
from viscopade.arithmetic.decimals import at_most
from viscopade.calculator import lines, tables
from viscopade.collision import limits
from viscopade.generated import marker_lines
from viscopade.kernels import catalogue, requests
from viscopade.kernels.kernel import Kernel
from viscopade.kernels.write.languages import NAMES, language
from viscopade.simulators.input_file import STEPS
from viscopade.simulators.own_law import CHOSEN_STEPS, FEWEST_STEPS
from viscopade.theory.law import Law
from viscopade.theory.pade import pade
from viscopade.theory.paper import TABLE

KERNELS_FILE = "viscopade.mjs"
"""Our export for JavaScript: it is part of the page as it stands in `exports/`."""
_PADE_DIGITS = 18  # of coefficients: more than a double has
_EXTRA = ((4, 7), (5, 8))
"""Padé approximants of the page beside those of the paper's table; a choice."""

_UNITS = {
    (1, 0, 0): ("m", "dm", "cm", "mm", "um", "nm", "km", "in", "ft"),
    (0, 1, 0): ("kg", "g", "mg", "ug", "pg", "t", "lb"),
    (0, 0, 1): ("s", "ms", "us", "ns", "min", "h"),
    (1, 1, -2): ("N", "kN", "mN", "uN", "dyn"),
    (-1, 1, -2): ("Pa", "hPa", "kPa", "MPa", "GPa", "bar", "psi"),
    (2, 1, -2): ("J", "mJ", "uJ", "nJ", "fJ", "erg"),
}
"""Units of the page by their powers of length, mass and time; fields take products of them, as the command line."""
_DIMENSIONS = ("length", "speed", "pressure", "density", "time", "acceleration", "energy per area")
_SYSTEMS = {
    "SI (m, kg, s)": ("m", "m/s", "Pa", "kg/m^3", "s", "m/s^2", "J/m^2"),
    "CGS (cm, g, s)": ("cm", "cm/s", "dyn/cm^2", "g/cm^3", "s", "cm/s^2", "erg/cm^2"),
    "mm, t, s (MPa)": ("mm", "mm/s", "MPa", "t/mm^3", "s", "mm/s^2", "mJ/mm^2"),
    "um, pg, us": ("um", "um/us", "pg/um/us^2", "pg/um^3", "us", "um/us^2", "fJ/um^2"),
}
"""Consistent units of plain numbers, in the order of `_DIMENSIONS`."""

_TITLES = {
    "viscoelastic": "viscoelastic spheres",
    "linear": "spring-dashpot (linear)",
    "tsuji": "Hertz, Tsuji's damping",
    "hunt-crossley": "Hunt-Crossley, n = 3/2",
    "hunt-crossley:1": "Hunt-Crossley, n = 1",
    "kelvin-voigt:1": "Kelvin-Voigt cone",
    "3/2,0": "Hertz, linear dashpot",
}


def page(command: str) -> str:
    """Return the page: one HTML file that needs no other file and no network.

    Parameters
    ----------
    command : str
        The command line that makes it, for its first line.
    """
    marker = marker_lines(command)
    templates = generated.environment(__name__)
    return templates.get_template("page.html.jinja").render(marker=marker, **_parts())


def functions() -> str:
    """Return the page's computations alone, a module of JavaScript."""
    return generated.environment(__name__).get_template("module.jinja").render(**_parts())


def _parts() -> dict[str, str]:
    """Return the texts that the template of the page puts together: kernels, facts (JSON), names, languages."""
    # The text stands in a script element: "</script" would end it, and after "<!--" and another "<script" its end would
    # not be seen. The data have no "<".
    text = requests.file(KERNELS_FILE)
    if "</script" in text or "<!--" in text:
        raise ValueError(f"{KERNELS_FILE} cannot be part of a page")
    # The calculator asks a kernel for eps and 1 - eps^2, of a speed and beta, by its name (1 - eps is the second over
    # 1 + eps), and names the languages that also have the kernel.
    facts = json.dumps(_facts(), ensure_ascii=False, separators=(",", ":")).replace("<", "\\u003c")
    names = (f"{kernel.name}: [restitution_{kernel.name}, dissipation_{kernel.name}]" for kernel in _kernels())
    targets = ", ".join(name for name in NAMES if "compact" in language(name).groups)
    return {"kernels": text, "facts": facts, "names": ", ".join(names), "targets": targets}


def _kernels() -> list[Kernel]:
    """Return the kernels of the export, the most accurate last."""
    return [entry.kernel for entry in catalogue.group("compact")]


def _bound(kernel: Kernel) -> str:
    """Return the error of eps relative to the smaller of eps and 1 - eps, without half an ulp or two of eps.

    It is a decimal of three digits, rounded up.
    """
    bound = min(kernel.bound("restitution", "host", "double"), key=lambda bound: bound.last)
    return at_most(bound.relative, 3)


def _facts() -> dict[str, Any]:
    """Return the data of the page, as JSON has them; all numbers are in SI units."""
    return {
        "kernels": [{"name": kernel.name, "bound": _bound(kernel)} for kernel in _kernels()],
        # Largest relative error of the tables of other laws, 1e-11.
        "tablesError": tables.ERROR,
        "laws": _laws(),
        # The approximants of the paper's table, by their degrees (m, n), and two more.
        "pade": [_pade(m, n) for m, n in (*TABLE, *_EXTRA)],
        # By unit, its size in SI units and its powers; by dimension, the SI unit and another; by system, units of plain
        # numbers.
        "units": {unit: [_si_size(unit), *powers] for powers, units in _UNITS.items() for unit in units},
        "dimensions": {dimension: quantity.DIMENSIONS[dimension] for dimension in _DIMENSIONS},
        "systems": {name: dict(zip(_DIMENSIONS, units, strict=True)) for name, units in _SYSTEMS.items()},
        # Where the model ends, as for the command line: compression over radius, speed over that of yield, contact time
        # over the time of sound, A over the contact time, and the pressure at yield over the strength.
        "limits": {
            "depth": limits.LARGEST_OVERLAP,
            "nearYield": limits.NEAR_YIELD,
            "slowness": limits.SOUND_CROSSINGS,
            "relaxation": limits.LONGEST_RELAXATION,
            "yieldPressure": limits.YIELD_PRESSURE,
        },
        "sentences": limits.SENTENCES,
        "programs": lines.programs(),
        # Time steps in a contact: of a contact time that is chosen, the fewest, and for a fine step of a law of force.
        "steps": {"chosen": CHOSEN_STEPS, "fewest": FEWEST_STEPS, "fine": STEPS},
        # The coefficients of [3/6] as the paper prints them: Yade solves [3/6](v*) = en with these.
        "printedPade": [[float(c) for c in row] for row in TABLE[3, 6]],
    }


def _si_size(unit: str) -> float:
    """Return the size of a unit in SI base units: 0.01 for cm."""
    size = quantity.decimal_in(f"1 {unit}", None)
    if size is None:
        raise ValueError(f"{unit} is no unit")
    return float(size)


def _laws() -> list[dict[str, Any]]:
    """Return the ready laws, each with its facts and with the tables of eps for each end of contact."""
    # A law with both ends comes twice; its facts are the same.
    entries: dict[str, dict[str, Any]] = {}
    for name, law in tables.laws():
        about = entries.setdefault(name, {"name": name, "title": _TITLES[name], **_about(law), "ends": {}})
        about["ends"][law.end] = tables.stored_tables()[tables.key(law)]
    return [*entries.values()]


def _about(law: Law) -> dict[str, Any]:
    """Return what the page computes with for a law x'' + x^a + kappa x^b x' = 0.

    kappa grows as v^power, v* is kappa^(1/d), nu is (a + 1)/(b + 1), and contactTime is the scaled one without damping.
    symbol and factor belong to the law's own damping constant, such as A.
    """
    # v* = kappa^(1/d): for nu = n_a/n_b > 1 eps is a series in it if contact ends where the force vanishes.
    about: dict[str, Any] = {
        "elastic": str(law.elastic),
        "damping": str(law.damping),
        "a": float(law.elastic),
        "b": float(law.damping),
        "contactTime": law.contact_time,
        "power": float(2 * law.c),
        "d": law.n_a - law.n_b if law.nu > 1 else 1,
        "equation": law.equation,
        "nu": str(law.nu),
        "symbol": None,
    }
    # kappa = (c/m) (k/m)^(-1/nu) v^power, and the law's own constant, such as a damping ratio, has c = factor constant
    # k^p m^(1-p). For p = 1/nu stiffness and mass drop out: kappa = factor constant v^power.
    damping = law.own_damping
    if damping is not None and damping.power == 1 / law.nu:
        about |= {"symbol": damping.symbol, "factor": damping.factor}
    return about


def _pade(m: int, n: int) -> dict[str, Any]:
    """Return the approximant [m/n]: its name, and its coefficients in ascending powers of v*."""
    a, b = pade(m, n, _PADE_DIGITS).decimals(_PADE_DIGITS)
    return {"name": f"[{m}/{n}]", "a": [float(c) for c in a], "b": [float(c) for c in b]}
