"""How far off the damping is that simulators get from Padé approximants today, against the exact inverse.

Wanted is the dissipative constant A for a known coefficient of restitution eps at a known speed. As beta = v*^2/v^(1/5)
and A is proportional to beta, the relative error of A is that of v*^2: the same for every material and speed. Two
common ways, with the printed six-digit coefficients of tab:padeCoeffs: Newton's method on [3/6], and Brent's on [1/4].

Run as `python -m viscopade_lab.studies.damping`, also with `--format json`, `csv` or `latex`; needs SciPy; part of
`make bench`.
"""

from __future__ import annotations

from collections.abc import Callable

import click

from viscopade.cli.console import STYLE, need, show
from viscopade.collision import exact
from viscopade.theory.paper import TABLE

RESTITUTIONS = ("0.9", "0.5", "0.1", "0.01")


def printed_approximant(m: int) -> Callable[[float], float]:
    """Return [m/m+3] with the coefficients as printed in the paper."""
    a, b = ([float(text) for text in coefficients] for coefficients in TABLE[m, m + 3])

    def approximant(v_star: float) -> float:
        top, bottom = 0.0, 0.0
        for c in reversed(a):
            top = top * v_star + c
        for c in reversed(b):
            bottom = bottom * v_star + c
        return top / bottom

    return approximant


def newton_on_3_6(epsilon: float) -> float:
    """Return v* by Newton's method on the printed [3/6], as DEM codes do."""
    from scipy.optimize import newton

    approximant = printed_approximant(3)
    return float(newton(lambda v: approximant(v) - epsilon, 0.5, tol=1e-14, maxiter=200))


def brent_on_1_4(epsilon: float) -> float:
    """Return v* by Brent's method on the printed [1/4]."""
    from scipy.optimize import brentq

    approximant = printed_approximant(1)
    return float(brentq(lambda v: approximant(v) - epsilon, 1e-6, 1e6, xtol=1e-14, rtol=1e-14))


def errors() -> dict[str, dict[str, float]]:
    """Return the relative error of A for each eps: by Newton on [3/6], by Brent on [1/4]."""
    rows = {}
    for epsilon in RESTITUTIONS:
        truth = exact.invert(epsilon, 20).floats()["v_star"]
        rows[epsilon] = {
            "v_star": truth,
            "newton_3_6": (newton_on_3_6(float(epsilon)) / truth) ** 2 - 1,
            "brent_1_4": (brent_on_1_4(float(epsilon)) / truth) ** 2 - 1,
        }
    return rows


@click.command()
@STYLE
def main(style: str) -> None:
    """Print the relative errors of A."""
    need("damping.py", "scipy")
    whole = errors()
    header = ("eps", "v*", "A by Newton on [3/6]", "A by Brent on [1/4]")
    rows = (
        (epsilon, f"{row['v_star']:.6f}", f"{row['newton_3_6']:+.2e}", f"{row['brent_1_4']:+.2e}")
        for epsilon, row in whole.items()
    )
    show(style, header, rows, whole, title="relative error of A")


if __name__ == "__main__":
    main()
