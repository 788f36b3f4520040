"""What a proven value of eps(v*) costs: against direct integration in time, and how the cost grows.

Run as `python -m viscopade_lab.studies.exact`, or with `--format json`; part of `make bench`. Times are medians of
interleaved runs in one process; they depend on the machine, the ratios much less. Rivals, both in mpmath arithmetic and
not proven: `odefun`, what one would type (Taylor integrator of mpmath on x and x', event by root search; slow, so only
at v* = 1), and the Taylor integrator with event location that was written for the tests
(src/viscopade_lab/studies/direct.py).
"""

from __future__ import annotations

import statistics
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from rich.table import Table

from viscopade.collision import exact
from viscopade_lab.script import command, console, in_turn, seconds
from viscopade_lab.studies import direct

SPEEDS = ("1e-3", "1", "30", "1e4")
DIGITS = (30, 100, 300)
GROWTH = (50, 100, 200, 400, 800)


def interleaved(runs: dict[str, Callable[[], object]], rounds: int) -> dict[str, float]:
    """Return the median time of each run."""
    times = in_turn({name: partial(seconds, run) for name, run in runs.items()}, rounds)
    return {name: statistics.median(values) for name, values in times.items()}


def against_time_integration(v_star: str, digits: int) -> dict[str, Any]:
    """Compare with the Taylor integrator in time."""
    rounds = {30: 9, 100: 5, 300: 1}[digits]
    runs = {"ours": lambda: exact.collision(v_star, digits), "direct": lambda: direct.collide(v_star, digits)}
    times = interleaved(runs, rounds)
    inverse = exact.collision(v_star, digits + 5).decimals()["one_minus_epsilon"]
    times |= interleaved({"invert": lambda: exact.invert(one_minus_epsilon=inverse, digits=digits)}, rounds)
    return {"v_star": v_star, "digits": digits, **times, "ratio": times["direct"] / times["ours"]}


def against_odefun(digits: int) -> dict[str, Any]:
    """Compare with mpmath's odefun, at v* = 1."""
    times = interleaved({"ours": lambda: exact.collision("1", digits)}, 9)
    times |= interleaved({"odefun": lambda: direct.odefun_epsilon("1", digits)}, 1)
    return {"digits": digits, **times, "ratio": times["odefun"] / times["ours"]}


def growth() -> dict[str, Any]:
    """Return the time at v* = 1 for growing digits, and the exponent of the power law through them."""
    times = [interleaved({"ours": partial(exact.collision, "1", digits)}, 3)["ours"] for digits in GROWTH]
    exponent = float(np.polyfit(np.log(GROWTH), np.log(times), 1)[0])
    return {"digits": GROWTH, "seconds": times, "exponent": exponent}


def measure() -> dict[str, Any]:
    """Run everything."""
    rows = [against_time_integration(v_star, digits) for digits in DIGITS for v_star in SPEEDS]
    return {"direct": rows, "odefun": [against_odefun(digits) for digits in (15, 30)], "growth": growth()}


def show(result: dict[str, Any]) -> None:
    """Print the tables."""
    table = Table(
        "digits", "v*", "eps(v*)", "v*(eps)", "direct integration", "ratio", title="proven value, milliseconds"
    )
    for row in result["direct"]:
        times = (f"{1e3 * row[name]:.3g}" for name in ("ours", "invert", "direct"))
        table.add_row(str(row["digits"]), row["v_star"], *times, f"{row['ratio']:.1f}")
    out = console()
    out.print(table)
    for row in result["odefun"]:
        out.print(
            f"mpmath.odefun at v* = 1, {row['digits']} digits: {row['odefun']:.2f} s, {row['ratio']:.0f} times ours"
        )
    out.print(f"time ~ digits^{result['growth']['exponent']:.1f} from {GROWTH[0]} to {GROWTH[-1]} digits")


main = command(measure, show)


if __name__ == "__main__":
    main()
