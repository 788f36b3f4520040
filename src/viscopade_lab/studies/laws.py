"""The tables of docs/results/laws.md: common laws, the two ends of contact, and the eps of damping formulas.

Run as `python -m viscopade_lab.studies.laws`: it prints the tables in Markdown, as they stand on the page.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from fractions import Fraction

import click

from viscopade.collision import exact
from viscopade.simulators import textbook
from viscopade.simulators.audit import ASKED
from viscopade.theory.law import Law
from viscopade_lab.figures.laws import COLORS, epsilon, law_with

COMMON = (
    ("Hunt-Crossley, $n = 1$ (Drake)", "1", "1"),
    ("Hunt-Crossley, $n = 3/2$ (Simbody, OpenSim)", "3/2", "3/2"),
    ("Hertz, damping proportional to the area of contact", "3/2", "1"),
    ("viscoelastic cone", "2", "1"),
    ("viscoelastic spheres (Kuwabara and Kono; Brilliantov et al.; LAMMPS)", "3/2", "1/2"),
    ("linear spring-dashpot (MuJoCo)", "1", "0"),
    ("Tsuji et al.; Antypov and Elliott (YADE, LIGGGHTS, MercuryDPM)", "3/2", "1/4"),
    ("Hertz, linear dashpot", "3/2", "0"),
)
"""Common laws: in words, and their exponents a and b."""

DIGITS = 10  # of eps: more than the 4 to 6 that are shown
WITH_FORCE_END = ("0.9", "0.7", "0.5", "0.3", "0.2", "0.1")  # eps of the rows of the table of ends
# K at which eps is compared with its power law, at the ends "force" and "return". The larger, the closer; at x = 0 the
# motion creeps, and the exact function follows it to K = 150 at most.
LARGE, LARGE_RETURN = 1000, 30
BISECTIONS = 14  # of an interval of 2.9, which leave 2e-4: the three decimals shown

NEVER = "never"


def common_laws() -> Iterator[list[str]]:
    """Yield the rows of common laws: name, a, b, nu, exponent of the speed in kappa, and what that means for eps."""
    for name, a, b in COMMON:
        law = Law(Fraction(a), Fraction(b))
        power = 2 / law.nu - 1  # kappa ~ v^(2/nu - 1); eps falls with kappa
        trend = "falls" if power > 0 else "rises" if power < 0 else "is constant"
        yield [name, f"${a}$", f"${b}$", f"${law.nu}$", f"$v^{{{power}}}$" if power else "constant", trend]


def ends() -> Iterator[list[str]]:
    """Yield, for each eps with the end "force", the eps of the same contacts with the end "return"."""
    for epsilon_force in WITH_FORCE_END:
        # For nu = 1 the force vanishes at x = 0: both ends are one.
        yield [epsilon_force, *(with_other_end(nu, epsilon_force) for nu in COLORS if nu > 1)]


def with_other_end(nu: Fraction, epsilon_force: str) -> str:
    """Return, as text, eps of a contact that ends at x = 0, whose damping gives `epsilon_force` with the end "force".

    It is "never" if contact does not end at x = 0 with this damping.
    """
    damping = exact.invert(epsilon_force, law=law_with(nu), digits=DIGITS).mpf()["kappa"]
    law = law_with(nu, "return")
    try:
        return f"{float(exact.collision(kappa=damping, law=law, digits=DIGITS).mpf()['epsilon']):.4g}"
    except ValueError:
        if law.bounded:
            return NEVER
        raise


def large_dampings() -> Iterator[list[str]]:
    """Yield, for each nu, the powers of large K at both ends, or the K from which on contact never ends."""
    for nu in COLORS:
        law = law_with(nu, "return")
        # With the end "force" eps tends to K^-nu: the column eps K^nu is near 1.
        force = exact.collision(kappa=LARGE, law=law_with(nu), digits=DIGITS).mpf()["epsilon"]
        row = [f"${nu}$", f"$K^{{{-nu}}}$", f"{float(force * LARGE ** float(nu)):.4f}"]
        if law.bounded:
            yield [*row, f"{NEVER} from $K = {largest_damping(law):.3f}$ on", ""]
        else:
            # With the end x = 0 and nu < 2 it is proportional to K^(-nu/(2 - nu)).
            power = nu / (2 - nu)
            epsilon_return = exact.collision(kappa=LARGE_RETURN, law=law, digits=DIGITS).mpf()["epsilon"]
            yield [*row, f"$K^{{{-power}}}$", f"{float(epsilon_return * LARGE_RETURN ** float(power)):.4f}"]


def largest_damping(law: Law) -> float:
    """Return the K from which on contact never ends at x = 0: damping ratio 1 for nu = 2, else by bisection."""
    # zeta = K/2; eps = exp(-pi zeta/sqrt(1 - zeta^2)) is too small to be followed before zeta = 1.
    if law.nu == 2:
        return 2.0
    # For nu = 5/2, the other bounded law here, contact ends with K = 0.1 and does not with 3. `epsilon` is nan then,
    # which is not >= 0.
    low, high = 0.1, 3.0
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        low, high = (middle, high) if epsilon(law, middle) >= 0 else (low, middle)
    return high


def formulas() -> Iterator[list[str]]:
    """Yield the rows of damping formulas: name, formula, and its eps for each requested one."""
    for formula in textbook.HUNT_CROSSLEY:
        delivered = (f"{float(textbook.delivered_epsilon(formula, e)):.4f}" for e in ASKED)
        yield [formula.name, f"${formula.text}$", *delivered]
    yield ["**exact $z$**", "", *(f"**{float(textbook.exact_z(e)):.6f}**" for e in ASKED)]


def sources() -> Iterator[list[str]]:
    """Yield where each formula is from: name, citation, and where its form was read."""
    yield from ([formula.name, formula.citation, formula.source] for formula in textbook.HUNT_CROSSLEY)


def markdown(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table in Markdown."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in lines)


def tables() -> Iterator[str]:
    """Yield the page's tables in its order."""
    yield markdown(["contact", "$a$", "$b$", r"$\nu$", r"$\kappa \propto$", r"$\varepsilon$ with speed"], common_laws())
    yield markdown(["force = 0", *(rf"$x = 0$, $\nu = {nu}$" for nu in COLORS if nu > 1)], ends())
    yield markdown(
        [r"$\nu$", "force = 0", f"factor at $K = {LARGE}$", "$x = 0$", f"factor at $K = {LARGE_RETURN}$"],
        large_dampings(),
    )
    yield markdown(["formula", "$z$", *(f"$e = {e}$" for e in ASKED)], formulas())
    yield markdown(["formula", "where published", "form from"], sources())


@click.command()
def main() -> None:
    """Print the tables in Markdown."""
    click.echo("\n\n".join(tables()))


if __name__ == "__main__":
    main()
