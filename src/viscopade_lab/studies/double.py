"""What the exact functions in double precision cost: values per second, beside the paper's [3/6] in plain NumPy.

Run as `make bench`, or `python -m viscopade_lab.studies.double --format json`. Rounds are interleaved; times are the
best of them, per value, on one core. [3/6], good at small v*, is Horner's rule on the whole array; `power` is the
leading term (3/2)^(2/3) v*^(-10/3), good at large v*, by np.power.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from rich.table import Table

from viscopade.arrays import double, panels
from viscopade.arrays.checked import FloatArray
from viscopade.theory.pade import horner, pade
from viscopade_lab.script import command, console, in_turn, rounds, seconds

POINTS = 1_000_000
OURS = (*panels.NAMES, "slope", "v_star_from")


def rational(m: int, n: int) -> Callable[[FloatArray], FloatArray]:
    """Return the Padé approximant [m/n] on arrays."""
    a, b = (np.array([float(c) for c in part]) for part in pade(m, n).decimals(20))
    return lambda v_star: horner(a, v_star) / horner(b, v_star)


def power(v_star: FloatArray) -> FloatArray:
    """Return the leading term for large v*."""
    return np.power(v_star, -10 / 3) * math.cbrt(9 / 4)


def measure(rounds: int) -> dict[str, Any]:
    """Return values per second, and how long the table takes to load."""
    loading = seconds(lambda: double.epsilon(1.0))  # loads the table
    v_star = np.exp(np.random.default_rng(1).uniform(-7, 7, POINTS))
    epsilon = double.epsilon(v_star)
    runs = {name: partial(getattr(double, name), epsilon if name == "v_star_from" else v_star) for name in OURS}
    runs |= {"[3/6]": partial(rational(3, 6), v_star), "power": partial(power, v_star)}
    times = in_turn({name: partial(seconds, run) for name, run in runs.items()}, rounds)
    return {
        "points": POINTS,
        "loading_s": loading,
        "values_per_second": {name: POINTS / min(found) for name, found in times.items()},
    }


def show(result: dict[str, Any]) -> None:
    """Print the result for people."""
    rates = result["values_per_second"]
    table = Table("function of a million values", "million values/s", "time, [3/6] = 1", "error at most (sampled)")
    for name, rate in rates.items():
        limit = f"{double.ULP[name]} ulp" if name in double.ULP else ""
        table.add_row(name, f"{rate / 1e6:.1f}", f"{rates['[3/6]'] / rate:.1f}", limit)
    out = console()
    out.print(table)
    out.print(f"first call, which loads the table: {1e3 * result['loading_s']:.0f} ms")


main = command(measure, show, rounds(5))


if __name__ == "__main__":
    main()
