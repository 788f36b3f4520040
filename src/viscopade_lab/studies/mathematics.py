"""The tables of docs/theory/mathematics.md: the coefficients h_k, and the limit of large v*.

Run as `python -m viscopade_lab.studies.mathematics`: it prints the tables in Markdown, as they stand on the page.
"""

from __future__ import annotations

from collections.abc import Iterator

import click
import sympy as sp
from flint import arb
from mpmath import mp

from viscopade.arithmetic.balls import to_mpf, working
from viscopade.collision import exact
from viscopade.theory import symbolic
from viscopade.theory.series import series
from viscopade_lab.asymptotics import viscous
from viscopade_lab.studies.laws import markdown

ORDERS = (2, 4, 5, 6, 7, 8, 9, 11, 13)
"""The k of the h_k that have a closed form."""
LARGE = (5, 10, 100, 1000)
MOST_TERMS = 3
DIGITS = 15
# The errors of three terms are larger than 1e-30.
EXACT_DIGITS, BITS = 40, 200


def coefficients() -> Iterator[list[str]]:
    """Yield k, h_k as a polynomial in lambda_1 and lambda_3, and its value."""
    decimals = series(max(ORDERS), DIGITS).decimals()
    for k in ORDERS:
        yield [str(k), f"${sp.latex(symbolic.h_polynomial(k))}$", decimals[k]]


def large_v_star() -> Iterator[list[str]]:
    """Yield v*, eps, and the relative errors of the first one, two and three terms of the expansion."""
    expansion = viscous(MOST_TERMS, EXACT_DIGITS)["epsilon"]
    for v_star in LARGE:
        epsilon = exact.collision(v_star, EXACT_DIGITS).mpf()["epsilon"]
        with working(BITS), mp.workdps(EXACT_DIGITS):
            terms = [to_mpf(term) for term in expansion.terms(arb(v_star))]
            errors = [sum(terms[: n + 1]) / epsilon - 1 for n in range(MOST_TERMS)]
        yield [str(v_star), f"{float(epsilon):.10g}", *(f"{float(error):.1e}" for error in errors)]


def tables() -> Iterator[str]:
    """Yield the page's tables in its order."""
    yield markdown(["$k$", "$h_k$", "value"], coefficients())
    yield markdown([r"$v_\ast$", r"$\varepsilon$", "one term", "two terms", "three terms"], large_v_star())


@click.command()
def main() -> None:
    """Print the tables in Markdown."""
    click.echo("\n\n".join(tables()))


if __name__ == "__main__":
    main()
