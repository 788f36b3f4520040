"""The tables of docs/theory/mathematics.md: the coefficients h_k, the limit of large v*, best quotients against Padé's.

Run as `python -m viscopade_lab.studies.mathematics`: it prints the tables in Markdown, as they stand on the page.
"""

from __future__ import annotations

from collections.abc import Iterator

import click
import sympy as sp
from flint import arb
from mpmath import mp

from viscopade.approximation import frontier
from viscopade.arithmetic.balls import to_mpf, working
from viscopade.arithmetic.decimals import at_most
from viscopade.collision import exact
from viscopade.theory import symbolic
from viscopade.theory.asymptotics import viscous
from viscopade.theory.series import series
from viscopade_lab.studies.laws import markdown

ORDERS = (2, 4, 5, 6, 7, 8, 9, 11, 13)
"""The k of the h_k that have a closed form."""
LARGE = (5, 10, 100, 1000)
MOST_TERMS = 3
DEGREES = ((1, 4), (3, 6), (6, 9))
INTERVALS = (1.0, 2.0, 5.0, 10.0, 100.0)
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


def best_against_pade() -> Iterator[list[str]]:
    """Yield the end of an interval and the largest errors, rounded up: for each degrees Padé's and the best one's."""
    records = {(record.v_star_max, record.m, record.n): record for record in frontier.table()}
    for end in INTERVALS:
        here = [records[end, m, n] for m, n in DEGREES]
        yield [f"{end:g}", *(at_most(error, 2) for record in here for error in (record.pade_error, record.error))]


def tables() -> Iterator[str]:
    """Yield the page's tables in its order."""
    yield markdown(["$k$", "$h_k$", "value"], coefficients())
    yield markdown([r"$v_\ast$", r"$\varepsilon$", "one term", "two terms", "three terms"], large_v_star())
    names = [f"{kind} $[{m}/{n}]$" for m, n in DEGREES for kind in ("Padé", "best")]
    yield markdown(["$V$", *names], best_against_pade())


@click.command()
def main() -> None:
    """Print the tables in Markdown."""
    click.echo("\n\n".join(tables()))


if __name__ == "__main__":
    main()
