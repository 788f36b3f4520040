"""The figure of the cooling gas: temperature over time, and its error with approximants of eps."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from viscopade.arrays.checked import FloatArray
from viscopade.collision import spheres
from viscopade.kernels import catalogue, machine, native
from viscopade.plots.sheet import BLACK, label_axes, new_sheet
from viscopade.theory.pade import horner, pade
from viscopade.theory.paper import BETA_ICE_CGS
from viscopade_lab import gas
from viscopade_lab.figures.paper import DIGITS, LOOKS, Beside, Figure, draw_curve, figure, identifier, write_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Sheet

BETA = float(BETA_ICE_CGS)
TEMPERATURE = 1.0  # (cm/s)^2, at the start

# End of the time axis: late enough for both power laws.
END = 1e9
TIMES = np.geomspace(0.1, END, 201)

# Simulated: one gas to the end, and several pairs of gases with the same seed.
TIME = "$t$ (mean collision times at the start)"
PARTICLES, SEEDS = 1000, 8
MARKED = np.geomspace(1, 1e7, 8)
COMPARED = np.array([1.0, 10.0, 100.0])

TIER = "1e-5"  # of the kernel of speed
STEPS_NODES = 600  # of the quadrature over a table, whose errors jump from row to row


def _v_star(speed: FloatArray) -> FloatArray:
    return spheres.v_star(speed, BETA)


def exact_restitution(speed: FloatArray) -> FloatArray:
    """Return the exact eps of ice at speeds in cm/s."""
    value: FloatArray = native.restitution(speed, BETA)
    return value


def constant_restitution() -> gas.RestitutionFunction:
    """Return the constant eps that gives the correct initial rate of cooling."""
    epsilon = float(np.sqrt(1 - gas.loss(exact_restitution, TEMPERATURE)))
    return lambda speed: np.full_like(speed, epsilon)


def pade_restitution(m: int, n: int) -> gas.RestitutionFunction:
    """Return Padé's [m/n] of ice."""
    a, b = (np.array([float(c) for c in side]) for side in pade(m, n, DIGITS).decimals())

    def restitution(speed: FloatArray) -> FloatArray:
        x = _v_star(speed)
        value: FloatArray = horner(a, x) / horner(b, x)
        return value

    return restitution


def kernel_restitution(tier: str) -> gas.RestitutionFunction:
    """Return eps of ice by the speed kernel of this accuracy."""
    kernel = catalogue.kernel(f"speed {tier}")

    def restitution(speed: FloatArray) -> FloatArray:
        value: FloatArray = machine.function_values(kernel, "restitution", speed, BETA)
        return value

    return restitution


@lru_cache(maxsize=4 * SEEDS)
def _simulated(restitution: gas.RestitutionFunction, seed: int) -> FloatArray:
    """Return T at `COMPARED`."""
    simulated = gas.cool(restitution, particles=PARTICLES, temperature=TEMPERATURE, time=float(COMPARED[-1]), seed=seed)
    return simulated.temperature_at(COMPARED)


@figure("a cooling gas of ice with the exact eps and a constant one, and errors of the temperature with approximants")
def _cooling() -> Sheet:
    sheet, (top, bottom) = new_sheet(4.8, (1.15, 1))
    functions = {
        "constant": constant_restitution(),
        "[1/4]": pade_restitution(1, 4),
        "[3/6]": pade_restitution(3, 6),
        "kernel": kernel_restitution(TIER),
    }
    exactly = gas.maxwellian(exact_restitution, TIMES, temperature=TEMPERATURE)
    found = {
        name: gas.maxwellian(f, TIMES, temperature=TEMPERATURE, nodes=STEPS_NODES if name == "kernel" else gas.NODES)
        for name, f in functions.items()
    }
    _temperatures(top, exactly, found["constant"])
    _simulated_temperatures(top, {"exact": exact_restitution, "constant": functions["constant"]})
    _errors(bottom, {name: np.abs(temperatures / exactly - 1) for name, temperatures in found.items()})
    for name in ("constant", "[1/4]"):
        _simulated_errors(bottom, name, functions[name])
    names = ["simulations, constant", "simulations, [1/4]"]
    bottom.legend(bottom.containers, names, loc="upper right", ncol=2, frameon=False)
    return sheet


# Curves with the same look.
_LIKE = {"constant": "fit", "kernel": "best"}
_CONSTANT = r"constant $\varepsilon$"


def _temperatures(axes: Axes, exactly: FloatArray, constantly: FloatArray) -> None:
    """Draw the temperatures of both gases, and beside them their power laws."""
    draw_curve(axes, "exact", TIMES, exactly, (300, 4, 4), text=r"exact $\varepsilon(v)$")
    draw_curve(axes, _LIKE["constant"], TIMES, constantly, (3e3, -4, -4), gid="constant", text=_CONSTANT)
    late = np.array([1e4, END])
    for name, exponent, at_end, side in (("-5/3", -5 / 3, 30 * exactly[-1], 4), ("-2", -2.0, constantly[-1] / 30, -4)):
        gid = f"slope{name.replace('/', '-')}"
        draw_curve(axes, "limit-power", late, at_end * (late / END) ** exponent, gid=gid)
        write_text(axes, f"$t^{{{name}}}$", (1e7, at_end * (1e7 / END) ** exponent), (side, side))
    label_axes(axes, TIME, "$T$ ((cm/s)$^2$)", (0.3, END), (1e-18, 3), "xy")


def _simulated_temperatures(axes: Axes, functions: Mapping[str, gas.RestitutionFunction]) -> None:
    for name, restitution in functions.items():
        run = gas.cool(restitution, particles=PARTICLES, temperature=TEMPERATURE, time=float(MARKED[-1]))
        (points,) = axes.plot(MARKED, run.temperature_at(MARKED), "o", color=BLACK, gid=f"simulated-{name}")
        points.set(**_POINTS)
    axes.legend([points], [f"simulation, {PARTICLES} particles"], loc="lower left", frameon=False)


def _errors(axes: Axes, errors: Mapping[str, FloatArray]) -> None:
    """Draw errors of the temperature."""
    places: Mapping[str, Beside] = {"constant": (300, 4, -4), "[1/4]": (3, 4, -4), "[3/6]": (2e3, 3, 3)}
    texts = {"constant": _CONSTANT, "kernel": f"kernel for {TIER}"}
    for name, error in errors.items():
        beside, text = places.get(name, (1e6, 0, -4)), texts.get(name, name)
        draw_curve(axes, _LIKE.get(name, name), TIMES, error, beside, gid=f"{name}-error", text=text)
    label_axes(axes, TIME, "relative error of $T$", (0.3, END), (1e-8, 50), "xy")


def _simulated_errors(axes: Axes, name: str, restitution: gas.RestitutionFunction) -> None:
    """Draw means over seeds and their standard errors."""
    ratios = [_simulated(restitution, seed) / _simulated(exact_restitution, seed) for seed in range(SEEDS)]
    mean, bar = np.mean(ratios, axis=0) - 1, np.std(ratios, axis=0, ddof=1) / np.sqrt(SEEDS)
    color, marker = LOOKS[_LIKE.get(name, name)].text, "s" if name == "constant" else "o"
    bars = axes.errorbar(COMPARED, np.abs(mean), bar, fmt=marker, color=color, elinewidth=0.7)
    bars.lines[0].set(gid=identifier(f"simulated-{name}-error"), **_POINTS)


_POINTS: Mapping[str, Any] = {"markersize": 2.8, "markerfacecolor": "white", "markeredgewidth": 0.7}

FIGURES: Mapping[str, Figure] = {"cooling": _cooling}
