"""What the proven coefficients cost: against the straightforward way, and how the cost grows.

The approximants [m/m+3] are timed against the same code with FLINT's solver in place of mpmath's, once from nothing, as
every first call of `pade` has it, and once with the series known already.

Run as `make bench`, or `python -m viscopade_lab.studies.series --format json`. Every time is a median of repeated runs
in one process with all caches cleared; the two rivals are interleaved. Times depend on the machine, the ratios and the
exponents much less.
"""

from __future__ import annotations

import platform
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any
from unittest import mock

import flint
import numpy as np
from flint import arb, arb_mat
from rich.table import Table

from viscopade.theory.pade import _pade, _product_coefficient, order_system, pade
from viscopade.theory.series import _derivations, _g_fixed_point, _series, derived, end_series, series
from viscopade_lab.script import command, console, rounds, seconds
from viscopade_lab.studies import baseline

ORDERS = (20, 40, 80, 160)
DIGITS = (50, 100, 200, 400)
PADE_DEGREES, PADE_DIGITS = range(26), 30


def derive(order: int, digits: int) -> Callable[[], object]:
    """Return a run that derives h_0 … h_order from nothing."""

    def run() -> object:
        forget_series()
        return series(order, digits)

    return run


def forget_series() -> None:
    """Clear all caches of the series."""
    _derivations.clear()
    for cached in (_series, derived, _g_fixed_point, end_series):
        cached.cache_clear()


def median(run: Callable[[], object], rounds: int) -> float:
    """Median time over `rounds` runs."""
    return statistics.median(seconds(run) for _ in range(rounds))


def against_baseline(order: int, digits: int, rounds: int) -> dict[str, Any]:
    """Interleave baseline and ours, and return medians and the ratio's spread."""
    pairs = []
    for _ in range(rounds):
        theirs = seconds(lambda: baseline.coefficients(order, digits))
        pairs.append((theirs, median(derive(order, digits), 5)))
    ratios = [theirs / ours for theirs, ours in pairs]
    return {
        "order": order,
        "digits": digits,
        "baseline_s": statistics.median(p[0] for p in pairs),
        "ours_s": statistics.median(p[1] for p in pairs),
        "ratio": statistics.median(ratios),
        "ratio_range": [min(ratios), max(ratios)],
    }


def by_flint_alone(h: Sequence[arb], m: int, n: int) -> tuple[tuple[arb, ...], tuple[arb, ...]]:
    """Return a and b of [m/n] by FLINT's solver, where `viscopade.theory.pade.solution` has mpmath build them."""
    entries, right = order_system(h, m, n, arb(0))
    b = (arb(1), *arb_mat(n, n, entries).solve(arb_mat(n, 1, right), algorithm="precond").entries())
    return tuple(_product_coefficient(b, h, k) for k in range(m + 1)), b


def approximant(m: int, known: bool) -> Callable[[], object]:
    """Return a run that makes [m/m+3], with the series known already or from nothing."""

    def run() -> object:
        _pade.cache_clear()
        if not known:
            forget_series()
        return pade(m, m + 3, PADE_DIGITS)

    return run


def against_flint(m: int, known: bool, rounds: int) -> dict[str, Any]:
    """Interleave [m/m+3] by FLINT's solver and ours, by mpmath and proven, and return medians."""
    run = approximant(m, known)
    run()
    pairs = []
    for _ in range(rounds):
        with mock.patch.object(sys.modules["viscopade.theory.pade"], "solution", by_flint_alone):
            theirs = seconds(run)
        pairs.append((theirs, seconds(run)))
    return {
        "m": m,
        "flint_s": statistics.median(theirs for theirs, _ in pairs),
        "ours_s": statistics.median(ours for _, ours in pairs),
        "ratio": statistics.median(ours / theirs for theirs, ours in pairs),
    }


def growth(values: tuple[int, ...], run: Callable[[int], Callable[[], object]], rounds: int) -> dict[str, Any]:
    """Return the times at `values`, and the exponents of a power law: fitted to all, and of the last doubling."""
    times = [median(run(value), rounds) for value in values]
    logs = np.log(values), np.log(times)
    slope = float(np.polyfit(*logs, 1)[0])
    last = float(np.diff(logs[1])[-1] / np.diff(logs[0])[-1])
    return {"values": list(values), "seconds": times, "exponent": slope, "last_exponent": last}


def measure(rounds: int) -> dict[str, Any]:
    """Run everything."""
    derive(20, 40)()  # load what is loaded on first use
    return {
        "machine": {
            "processor": _processor(),
            "python": platform.python_version(),
            "python-flint": flint.__version__,
            "flint": flint.__FLINT_VERSION__,
        },
        "baseline": against_baseline(20, 40, rounds),
        "paper": {"order": 53, "digits": 50, "seconds": median(derive(53, 50), rounds)},
        "large": {"order": 160, "digits": 100, "seconds": seconds(derive(160, 100))},
        "reproduce_s": median(reproduce, rounds),
        "orders": growth(ORDERS, lambda order: derive(order, 50), rounds),
        "digits": growth(DIGITS, lambda digits: derive(20, digits), rounds),
        "pade": [against_flint(m, False, rounds) for m in PADE_DEGREES],
        "pade_series_known": [against_flint(m, True, rounds) for m in PADE_DEGREES],
    }


def reproduce() -> None:
    """Do what `make reproduce` does after set-up, as a process of its own."""
    with tempfile.TemporaryDirectory() as directory:
        words = [sys.executable, "-m", "viscopade", "reproduce", "--out", directory]
        subprocess.run(words, check=True, capture_output=True)


def _processor() -> str:
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        for line in cpuinfo.read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def show(result: dict[str, Any]) -> None:
    """Print the result for people."""
    out = console()
    out.print("   ".join(f"{key} {value}" for key, value in result["machine"].items()))
    table = Table("what", "seconds (median)", "note")
    b = result["baseline"]
    what = f"h_0 … h_{b['order']}, {b['digits']} digits"
    table.add_row(f"{what}: joint Taylor expansion, plain mpmath", f"{b['baseline_s']:.3g}", "no proof")
    low, high = b["ratio_range"]
    ratio = f"{b['ratio']:.0f} times faster ({low:.0f} … {high:.0f})"
    table.add_row(f"{what}: viscopade.theory.series", f"{b['ours_s']:.3g}", ratio)
    for key in ("paper", "large"):
        row = result[key]
        table.add_row(f"h_0 … h_{row['order']}, {row['digits']} digits", f"{row['seconds']:.3g}", "")
    table.add_row("viscopade reproduce, all of it", f"{result['reproduce_s']:.3g}", "")
    for key, text in (("orders", "order {}, 50 digits"), ("digits", "order 20, {} digits")):
        row = result[key]
        for value, time_ in zip(row["values"], row["seconds"], strict=True):
            table.add_row(text.format(value), f"{time_:.3g}", "")
        note = f"time ~ {key[:-1] if key == 'orders' else key}^{row['exponent']:.2f}"
        table.add_row("", "", f"{note}, last doubling: ^{row['last_exponent']:.2f}")
    for key, text in (("pade", "from nothing"), ("pade_series_known", "series known already")):
        rows = result[key]
        worst = max(rows, key=lambda row: float(row["ratio"]))
        note = f"at most {worst['ratio']:.2f} times FLINT's solver alone (m = {worst['m']})"
        table.add_row(f"[m/m+3], m up to {rows[-1]['m']}, {text}", f"up to {rows[-1]['ours_s']:.3g}", note)
    out.print(table)


main = command(measure, show, rounds(3))


if __name__ == "__main__":
    main()
