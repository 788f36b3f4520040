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

# End of the time axis, in mean collision times at the start: late enough for both power laws. 20 points to a decade:
# the curves are nearly straight on logarithmic axes, and look smooth.
END = 1e9
TIMES = np.geomspace(0.1, END, 201)

# Simulated: one gas for the marks, and several pairs of gases with the same seed. T scatters by some 3 % with 1000
# particles, less than a mark is high. Times are one in each decade: to 10^7, which takes seconds, and for the pairs to
# 100: later they collide differently, and their difference is noise.
TIME = "$t$ (mean collision times at the start)"
PARTICLES, SEEDS = 1000, 8
MARKED = np.geomspace(1, 1e7, 8)
COMPARED = np.array([1.0, 10.0, 100.0])

TIER = "1e-5"  # accuracy of the speed kernel that is shown
STEPS_NODES = 600  # of the quadrature over a table, whose errors jump from row to row; 80 suffice for smooth functions


def exact_restitution(speed: FloatArray) -> FloatArray:
    """Return the exact eps of ice at speeds in cm/s."""
    value: FloatArray = native.restitution(speed, BETA)
    return value


def constant_restitution() -> gas.RestitutionFunction:
    """Return the constant eps that gives the correct initial rate of cooling, as a function of speeds."""
    # Cooling is proportional to L, the mean of 1 - eps^2 (`gas.loss`), which is 1 - eps^2 itself if eps is constant.
    epsilon = float(np.sqrt(1 - gas.loss(exact_restitution, TEMPERATURE)))
    return lambda speed: np.full_like(speed, epsilon)


def pade_restitution(m: int, n: int) -> gas.RestitutionFunction:
    """Return Padé's [m/n] of ice as a function of speeds in cm/s."""
    # a_0 … a_m and b_0 … b_n from decimals of 18 digits.
    a, b = (np.array([float(c) for c in side]) for side in pade(m, n, DIGITS).decimals())

    def restitution(speed: FloatArray) -> FloatArray:
        x = spheres.v_star(speed, BETA)
        value: FloatArray = horner(a, x) / horner(b, x)
        return value

    return restitution


def kernel_restitution(tier: str) -> gas.RestitutionFunction:
    """Return eps of ice by the speed kernel of this accuracy ("1e-5"), as a function of speeds in cm/s."""
    kernel = catalogue.kernel(f"speed {tier}")

    def restitution(speed: FloatArray) -> FloatArray:
        value: FloatArray = machine.function_values(kernel, "restitution", speed, BETA)
        return value

    return restitution


@lru_cache(maxsize=4 * SEEDS)  # three functions are simulated with each seed
def _simulated(restitution: gas.RestitutionFunction, seed: int) -> FloatArray:
    """Return T in (cm/s)^2 at the times `COMPARED` of one simulation."""
    simulated = gas.cool(restitution, particles=PARTICLES, temperature=TEMPERATURE, time=float(COMPARED[-1]), seed=seed)
    return simulated.temperature_at(COMPARED)


@figure("a cooling gas of ice with the exact eps and a constant one, and errors of the temperature with approximants")
def _cooling() -> Sheet:
    """Return the figure: above, T over time with the exact and a constant eps; below, errors of T by four eps.

    Both parts have curves by quadrature, for Maxwellian velocities, and marks by simulation.
    """
    sheet, (top, bottom) = new_sheet(4.8, (1.15, 1))  # height in inches, ratio of heights: chosen by eye
    functions = {
        "constant": constant_restitution(),
        "[1/4]": pade_restitution(1, 4),
        "[3/6]": pade_restitution(3, 6),
        "kernel": kernel_restitution(TIER),
    }
    exact_temperatures = gas.maxwellian(exact_restitution, TIMES, temperature=TEMPERATURE)
    temperatures = {
        name: gas.maxwellian(f, TIMES, temperature=TEMPERATURE, nodes=STEPS_NODES if name == "kernel" else gas.NODES)
        for name, f in functions.items()
    }
    _draw_temperatures(top, exact_temperatures, temperatures["constant"])
    _mark_simulated_temperatures(top, {"exact": exact_restitution, "constant": functions["constant"]})
    _draw_errors(bottom, {name: np.abs(T / exact_temperatures - 1) for name, T in temperatures.items()})
    # The errors of the others are far below the scatter of simulations.
    for name in ("constant", "[1/4]"):
        _mark_simulated_errors(bottom, name, functions[name])
    names = ["simulations, constant", "simulations, [1/4]"]
    bottom.legend(bottom.containers, names, loc="upper right", ncol=2)
    return sheet


# Curves that look like others of `LOOKS`.
_LIKE = {"constant": "fit", "kernel": "best"}
_CONSTANT = r"constant $\varepsilon$"

# Places of names: (time beside which a name stands, points to the right, points upwards), chosen by eye.


def _draw_temperatures(axes: Axes, exact: FloatArray, constant: FloatArray) -> None:
    """Draw the temperatures at `TIMES` with the exact and with the constant eps, and beside them their power laws."""
    draw_curve(axes, "exact", TIMES, exact, (300, 4, 4), text=r"exact $\varepsilon(v)$")
    draw_curve(axes, _LIKE["constant"], TIMES, constant, (3e3, -4, -4), gid="constant", text=_CONSTANT)
    # Haff's laws t^(-5/3) and t^(-2) as lines from 10^4, where both gases follow them; a factor 30 above and below the
    # curves, so that a reader can compare slopes.
    late = np.array([1e4, END])
    for name, exponent, T_end, side in (("-5/3", -5 / 3, 30 * exact[-1], 4), ("-2", -2.0, constant[-1] / 30, -4)):
        gid = f"slope{name.replace('/', '-')}"
        draw_curve(axes, "limit-power", late, T_end * (late / END) ** exponent, gid=gid)
        # The name stands by t = 10^7, in the middle of the line, on the side away from the curves.
        write_text(axes, f"$t^{{{name}}}$", (1e7, T_end * (1e7 / END) ** exponent), (side, side))
    # T falls from 1 to 2e-15 and 4e-17, and the lower line of t^(-2) is a factor of 30 below.
    label_axes(axes, TIME, "$T$ ((cm/s)$^2$)", (0.3, END), (1e-18, 3), "xy")


def _mark_simulated_temperatures(axes: Axes, functions: Mapping[str, gas.RestitutionFunction]) -> None:
    """Mark T of one simulation (seed 0) with each eps at the times `MARKED`."""
    for name, restitution in functions.items():
        run = gas.cool(restitution, particles=PARTICLES, temperature=TEMPERATURE, time=float(MARKED[-1]))
        (points,) = axes.plot(MARKED, run.temperature_at(MARKED), "o", color=BLACK, gid=f"simulated-{name}")
        points.set(**_POINTS)
    axes.legend([points], [f"simulation, {PARTICLES} particles"], loc="lower left")


def _draw_errors(axes: Axes, errors: Mapping[str, FloatArray]) -> None:
    """Draw the relative errors of T at `TIMES`, by the name of their eps; names stand where they cover no curve."""
    places: Mapping[str, Beside] = {"constant": (300, 4, -4), "[1/4]": (3, 4, -4), "[3/6]": (2e3, 3, 3)}
    texts = {"constant": _CONSTANT, "kernel": f"kernel for {TIER}"}
    for name, error in errors.items():
        beside, text = places.get(name, (1e6, 0, -4)), texts.get(name, name)
        draw_curve(axes, _LIKE.get(name, name), TIMES, error, beside, gid=f"{name}-error", text=text)
    # From the accuracy of the quadrature, 1e-8, to above the largest error, 1: there the legend stands.
    label_axes(axes, TIME, "relative error of $T$", (0.3, END), (1e-8, 50), "xy")


def _mark_simulated_errors(axes: Axes, name: str, restitution: gas.RestitutionFunction) -> None:
    """Mark |T/T_exact - 1| of simulations at `COMPARED`: means over seeds and their standard errors.

    `restitution` is the eps of that name; the gas with the exact eps has the same seed.
    """
    ratios = [_simulated(restitution, seed) / _simulated(exact_restitution, seed) for seed in range(SEEDS)]
    # Standard error of the mean: the deviation of a sample (ddof=1) over the root of its size.
    mean, bar = np.mean(ratios, axis=0) - 1, np.std(ratios, axis=0, ddof=1) / np.sqrt(SEEDS)
    color, marker = LOOKS[_LIKE.get(name, name)].text, "s" if name == "constant" else "o"
    # Bars of 0.7 points, as wide as the marks' edges.
    bars = axes.errorbar(COMPARED, np.abs(mean), bar, fmt=marker, color=color, elinewidth=0.7)
    bars.lines[0].set(gid=identifier(f"simulated-{name}-error"), **_POINTS)


# Small open marks, sizes in points: the curve behind stays visible.
_POINTS: Mapping[str, Any] = {"markersize": 2.8, "markerfacecolor": "white", "markeredgewidth": 0.7}

FIGURES: Mapping[str, Figure] = {"cooling": _cooling}
