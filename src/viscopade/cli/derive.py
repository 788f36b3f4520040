"""Commands that print exact numbers: reproduce, coefficients, pade, epsilon, invert.

The coefficient of restitution eps is a function of v* = beta^(1/2) v^(1/10), or of kappa = v*^2, the damping of the
scaled equation x'' + x^(3/2) + kappa x^(1/2) x' = 0; v is the impact speed. For other laws of contact, x'' + x^a +
kappa x^b x' = 0, v* is kappa^(1/d) with an integer d.

Numbers in sentences have 1 to 6 figures (`.6g`), chosen by hand to be read; so have those in tables as text, unless
--digits asks for others. JSON and CSV have all digits.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from viscopade import arguments
from viscopade.cli.console import (
    ADHESION,
    ALL_DIGITS,
    DIGITS_OPTION,
    GRAVITY,
    ORDER,
    STYLE,
    STYLE_OR_LATEX,
    TEXT_DIGITS,
    WITH_LAW,
    Command,
    Degree,
    Degrees,
    FilePath,
    Quantity,
    Real,
    Whole,
    check_units_of_beta,
    examples,
    figures,
    law_words,
    limits_of,
    material,
    option,
    pair_of,
    say,
    say_below,
    show,
    with_options,
)
from viscopade.cli.writer import check_targets, write_all
from viscopade.theory.law import VISCOELASTIC

if TYPE_CHECKING:
    from viscopade.collision import exact
    from viscopade.collision.spheres import Pair
    from viscopade.theory.derivation import Derivation
    from viscopade.theory.law import Law
    from viscopade.theory.pade import Pade, Root

COMPARED_DIGITS = 20  # of our coefficients beside the paper's, which have 6 digits or so; chosen by hand
_HIGHEST = 9  # order to which `reproduce` shows h_k: [3/6], the paper's largest approximant, follows from h_0 to h_9
_IN_DOUBLES = 15  # digits that a double has in any case: of numbers that are computed from doubles
_OF_DOUBLES = 17  # digits with which every double can be told from its neighbours: no decimal of one needs more
_PRECISE = 20  # digits of a damping that is rounded to a double: 17 tell doubles apart, 3 keep the rounding right
# Sampled numbers are integrated in double precision with errors down to about 1e-12: no smaller one is stated.
_SAMPLED, _LEAST_SAMPLED = 12, 1e-12
_SAMPLED_WITH_WEIGHT = {"epsilon", "one_minus_epsilon", "x_max", "tau_c", "max_compression", "contact_time"}
# v* at which the errors of an approximant are printed, from 1 to where eps is 6e-4, and the digits there, of eps and
# beyond the size of the error: a choice, of which three are printed.
_STATED, _STATED_DIGITS = (1, 2, 5, 10), 30


@click.command(cls=Command, epilog=examples("viscopade reproduce"))
@option("--out", type=FilePath(), help="Directory for the exported files.  [default: no file is written]")
@STYLE
@click.pass_context
def reproduce(context: click.Context, out: Path | None, style: str) -> None:
    """Derive the paper's table from the equation of motion and compare every printed entry.

    SymPy generates the hierarchy of perturbation equations and the h_k as polynomials from the scaled equation, balls
    give their proven values, and mpmath builds the Padé approximants. A second route checks the values.

    With --out, also write all exported files (C headers, tables, modules). Every kernel is fitted and proven again,
    and compared with the package's record of it. After a mismatch the exit status is 1, and no file is written.
    """
    # `context` is the running command, and `style` the format of the output.
    from viscopade import store
    from viscopade.kernels import requests
    from viscopade.theory.derivation import derive
    from viscopade.theory.equation import scaled_equation
    from viscopade.theory.paper import CITATION, approximants, compare
    from viscopade.theory.series import end_series

    if out is not None:
        check_targets([out / name for name in requests.NAMES], parents=True)

    # Derive the h_k, build the approximants, and compare each coefficient with the printed one.
    derivation = derive(scaled_equation(), _HIGHEST, COMPARED_DIGITS)
    ours = approximants(COMPARED_DIGITS)
    entries = compare(ours)
    agreeing = sum(entry.agrees for entry in entries)

    # The table, and around it as text the steps of the derivation and what each approximant is good for.
    header = ("[m/n]", "coefficient", "paper", "ours, rounded", "ours", "agrees")
    rows = [(f"[{e.m}/{e.n}]", e.name, e.printed, e.rounded, e.ours, "yes" if e.agrees else "NO") for e in entries]
    fields = ("m", "n", "symbol", "index", "printed", "rounded", "ours", "agrees")
    json_object = {
        "derivation": {
            "equation": derivation.equation,
            "turning_point": derivation.turning_point,
            "hierarchy": derivation.hierarchy,
            **_polynomials_json(derivation, "h"),
        },
        "agreeing": agreeing,
        "entries": [{name: getattr(e, name) for name in fields} for e in entries],
    }
    if style == "text":
        # H as text, its powers up to z^2: "1 + z/3 + 13 z^2/96".
        h_text = " + ".join(
            f"{'' if c.numerator == 1 else f'{c.numerator} '}{power}/{c.denominator}" if power else str(c)
            for c, power in zip(end_series(2), ("", "z", "z^2"), strict=True)
        )
        # What SymPy and mpmath do, in the order of the argument; the files named are those that prove each step.
        steps = [
            f"scaled equation: {derivation.equation}; contact ends where x'' = 0; kappa = v*^2 "
            "(derivations/01_scaling.py)",
            f"without time: {derivation.turning_point}; x = x_max r^2, |x'| = sqrt(4/5) x_max^(5/4) g, "
            "K = sqrt(4/5) kappa x_max^(1/4) (03_turning_point.py)",
            f"order K^n of g = g_0 + K g_1 + …: {derivation.hierarchy} (04_hierarchy.py)",
            "speeds at x = 0: eps_0 = g(-K)/g(K) at r = 0, so that the numbers g_n(0) give the lambda_k in "
            "ln eps_0 = -(lambda_1 nu + lambda_3 nu^3 + …), nu = kappa eps_0^(1/10) (06_time_reversal.py)",
            f"speed at the end: eps = eps_0 H(4/5 v*^5 sqrt(eps_0)), H(z) = {h_text} + … (05_end_of_contact.py)",
            "both together: eps = 1 + sum h_k v*^k (07_coefficients.py)",
        ]
        say("From the equation of motion to the table; SymPy generates the equations below the first, and the h_k")
        for number, step in enumerate(steps, 1):
            say(f"{number}. {step}", indent=3)
        _say_polynomials(derivation)
        say(
            f"{len(steps) + 1}. mpmath builds a and b of [m/n] from h_0 … h_{_HIGHEST}: the series of "
            "(b_0 + … + b_n v*^n) eps - (a_0 + … + a_m v*^m) has no power below v*^(m+n+1); balls prove the digits\n",
            indent=3,
        )
    show(style, header, rows, json_object, title=CITATION)
    if style == "text":
        say(f"{agreeing} of {len(entries)} printed numbers agree")
        for approximant in ours:
            say(f"{approximant.label} is {approximant.verdict}")

    # A disagreement ends the command with status 1.
    if agreeing < len(entries):
        if out is not None:
            click.echo("viscopade: no file is written, because a printed number disagrees", err=True)
        context.exit(1)

    # Fit and prove all kernels again, with no record of the package, and compare the records that this makes.
    if out is not None:
        with store.fresh_records() as records:
            texts = requests.files()
        others = [name for name, record in records.items() if store.package_record(name) != record]
        if others:
            click.echo(
                f"viscopade: no file is written: {len(others)} of {len(records)} records of kernels differ from those "
                f"of the package, the first is {others[0]}; `python -m tools.kernel_records` writes them",
                err=True,
            )
            context.exit(1)
        write_all({out / name: text for name, text in texts.items()}, parents=True)
        if style == "text":
            say(f"wrote {', '.join(texts)} to {out}")


@click.command(cls=Command, epilog=examples("viscopade coefficients --order 6 --digits 40"))
# 20: twice the order that [3/6] needs; chosen by hand.
@option("--order", type=ORDER, default=20, show_default=True, help="Highest power of v*.")
@DIGITS_OPTION
@option("--symbolic", group="Output", is_flag=True, help="Print the h_k also as polynomials in lambda_1, lambda_3, ….")
@WITH_LAW
@STYLE_OR_LATEX
def coefficients(order: int, digits: int | None, symbolic: bool, law: str, end: str | None, style: str) -> None:
    """Print the series coefficients h_k of eps = sum h_k v*^k.

    The coefficients are h_0 to h_ORDER, and every digit is proven. For other
    laws of contact v* is a root of kappa; the output states which root.

    With --symbolic, SymPy generates every h_k from the scaled equation as a polynomial with rational coefficients in
    lambda_1, lambda_3, …. These are the coefficients of -ln eps of contact that ends where x = 0, an odd function.
    """
    from viscopade.theory.law import law_of
    from viscopade.theory.series import series

    # The h_k as decimals; with --symbolic SymPy also derives them as polynomials.
    contact_law, number = law_of(law, end), digits or (ALL_DIGITS if style in ("json", "csv") else TEXT_DIGITS)
    if symbolic:
        from viscopade.theory.derivation import derive
        from viscopade.theory.equation import scaled_equation

        derivation = derive(scaled_equation(contact_law), order, number, contact_law.end)
    h = series(order, number, contact_law).decimals()
    fields, line = law_words(contact_law)  # for JSON, and a sentence ("" for the paper's law)
    json_object: dict[str, Any] = {"order": order, "digits": number, **fields, "h": h}
    if symbolic:
        json_object |= _polynomials_json(derivation, "symbolic")
    if symbolic and style == "csv":  # h_k has a polynomial from k = d on; before it h_0 = 1 and the others are 0
        rows = [(k, h_k, derivation.polynomials.get(k, h_k)) for k, h_k in enumerate(h)]
        show(style, ("k", "h_k", "polynomial"), rows, json_object)
    else:
        show(style, ("k", "h_k"), enumerate(h), json_object)
    if symbolic and style == "text":
        _say_polynomials(derivation)
    elif symbolic and style == "latex":
        click.echo(_latex_polynomials(derivation))
    if symbolic and contact_law == VISCOELASTIC:
        say_below(style, _CLOSED_FORMS)
    if line:
        say_below(style, line)


def _polynomials_json(derivation: Derivation, name: str) -> dict[str, dict[str, str]]:
    """Return the polynomials, under `name`, as text that SymPy reads, and the values of the lambdas."""
    return {
        name: {str(k): str(polynomial) for k, polynomial in derivation.polynomials.items()},
        "lambda": {str(k): value for k, value in derivation.lambdas.items()},
    }


_CLOSED_FORMS = (
    "lambda_1 = (4/5)^(2/5) B(3/5, 3/2) and lambda_3 = 125/1452 (4/5)^(6/5) B(9/5, 1/2) - lambda_1^3/600, with Euler's "
    "Beta function; lambda_5 has no known closed form (derivations/08_closed_forms.py)"
)
"""The lambdas of the paper's law, for the output of `coefficients`."""


def _latex_polynomials(derivation: Derivation) -> str:
    """Return the lambdas of a `derivation`, and every h_k as a polynomial and as a number, as equations in LaTeX."""
    import sympy as sp

    lines = [rf"\lambda_{{{k}}} &= {value}" for k, value in derivation.lambdas.items()]
    for k, polynomial in derivation.polynomials.items():
        value = f" = {derivation.values[k]}" if polynomial else ""
        lines.append(f"h_{{{k}}} &= {sp.latex(polynomial)}{value}")
    return "\n".join([r"\begin{align*}", " \\\\\n".join(lines), r"\end{align*}"])


def _say_polynomials(derivation: Derivation) -> None:
    """Print the lambdas of a `derivation`, and every h_k as a polynomial and as a number."""
    from viscopade.theory.derivation import plain_text

    # A polynomial of 0 has no second form.
    for k, value in derivation.lambdas.items():
        say(f"lambda_{k} = {value}", indent=2)
    for k, polynomial in derivation.polynomials.items():
        value = f" = {derivation.values[k]}" if polynomial else ""
        say(f"h_{k} = {plain_text(polynomial)}{value}", indent=2)


# Unknown options become arguments, so that the message about a negative degree names the degree.
@click.command(
    "pade",
    cls=Command,
    context_settings={"ignore_unknown_options": True},
    epilog=examples("viscopade pade 3/6 --digits 15 --v-star-max 1"),
)
@click.argument("m", type=Degree())
@click.argument("n", type=Whole(0, arguments.MAX_DEGREE), required=False)
@DIGITS_OPTION
# Here and below the numbers in helps are the limits of the functions that are called, and are checked there.
@option(
    "--v-star-max",
    help="State the error for 0 <= v* <= this number (0.001 to 100): proven for the viscoelastic law, else sampled.",
)
@WITH_LAW
@STYLE
def pade_command(
    m: tuple[int, int], n: int | None, digits: int | None, v_star_max: str | None, law: str, end: str | None, style: str
) -> None:
    """Print the Padé approximant [M/N] of eps(v*).

    M is the degree of the numerator, N the degree of the denominator. You may also write M/N. The default of N lets the
    approximant decay nearly as eps does. For the viscoelastic law this default is M + 3.

    The output has the coefficients, poles and zeros, the range of v* in which you may use the approximant, and its
    errors at a few v*. An approximant without a pole need not be accurate.
    """
    from viscopade.arithmetic.balls import known_decimal
    from viscopade.arithmetic.decimals import at_most, below
    from viscopade.theory.law import law_of
    from viscopade.theory.pade import pade

    # Degrees: M/N as one word, M N as two, or M alone (`bottom` is -1 where `m` has no second degree).
    contact_law = law_of(law, end)
    fields, line = law_words(contact_law)
    top, bottom = m
    if bottom >= 0 and n is not None:
        raise click.UsageError(f"the degrees are {top}/{bottom} and {n}: expected M/N or M N")
    if bottom < 0:
        bottom = top + contact_law.excess if n is None else n
    number = digits or ALL_DIGITS
    p = pade(top, bottom, number, contact_law)
    errors, verdict = [], f"{p.label} is {p.verdict}"  # sentences

    # Largest error up to v*: sampled for other laws, proven for the paper's. Ends are rounded down and errors up.
    if contact_law != VISCOELASTIC:
        from viscopade.kernels.quotient import sampled_errors

        sampled = [(below(high), at_most(error)) for high, error in sampled_errors(p, contact_law, v_star_max)]
        fields["sampled"] = [{"v_star_max": high, "error": error} for high, error in sampled]
        errors = [
            f"sampled, not proven: |{p.label} - eps| <= {error} min(eps, 1 - eps) for 0 <= v* <= {high}"
            for high, error in sampled
        ]
    elif v_star_max is not None:
        from viscopade.kernels.quotient import error_up_to

        bound = at_most(error_up_to(p.a, p.b, v_star_max))
        fields |= {"v_star_max": v_star_max, "proven_error": bound}
        errors = [f"proven: |{p.label} - eps| <= {bound} min(eps, 1 - eps) for 0 <= v* <= {v_star_max}"]

    # Errors at a few v*, in percent with two figures; "grows" if each is larger than the one before.
    if contact_law == VISCOELASTIC:
        few_errors = _errors_at(p, 0 if v_star_max is None else float(v_star_max))
        fields["errors"] = [{"v_star": v_star, "relative": error} for v_star, error in few_errors]
        listed = ", ".join(f"{float(f'{100 * error:.2g}'):g} % at v* = {v_star:g}" for v_star, error in few_errors)
        grows = sorted(few_errors, key=lambda pair: abs(pair[1])) == few_errors
        verdict += f"; its relative error (sampled){' grows' * grows}: {listed}"

    # The table: coefficients, then poles and zeros, which may be complex.
    a, b = p.decimals()
    rows = [(name, i, value, "") for name, values in (("a", a), ("b", b)) for i, value in enumerate(values)]
    rows += [
        (kind, i, *root.decimals(number))
        for kind, roots in (("pole", p.poles), ("zero", p.zeros))
        for i, root in enumerate(roots, 1)
    ]
    if style == "text":
        shown = digits or TEXT_DIGITS
        rows = [(kind, i, figures(real, shown), figures(imaginary, shown)) for kind, i, real, imaginary in rows]
    header = ("what", "i", "value or real part", "imaginary part")
    show(style, header, rows, {**fields, **_pade_json(p)})
    if style == "text":
        if line:
            say(line)
        say(verdict)
        # The series of the error begins with this term, of which 10 digits are enough to read.
        say(f"eps - {p.label} = {known_decimal(p.next_term, min(shown, 10))} v*^{p.contact_order + 1} + …")
        for line in errors:
            say(line)
        say(f"digits lost by the linear system: {p.digits_lost}; order conditions met within {p.residual:.1e}")
        for d in p.doublets():
            # A pole and a zero that nearly cancel; 10 digits are enough to read.
            pole, zero = (" + i ".join(root.decimals(min(shown, 10))) for root in (d.pole, d.zero))
            say(f"Froissart doublet: pole {pole}, zero {zero}, relative distance {d.distance:.1e}")


def _errors_at(p: Pade, v_star_max: float) -> list[tuple[float, float]]:
    """Return (v*, relative error of the approximant `p` of the paper's law) at a few v*, and at a larger `v_star_max`.

    The relative error is p(v*)/eps(v*) - 1.
    """
    from viscopade.kernels.quotient import relative_errors
    from viscopade.theory.pade import pade

    # The error at v* = 1 is no less than 10^-(m+n) (measured up to [90/93]: 2e-63), so that as many digits more than
    # `_STATED_DIGITS` show some of its digits. The coefficients are made anew with them.
    digits = _STATED_DIGITS + p.m + p.n
    v_stars = [*_STATED, *[v_star_max] * (v_star_max > max(_STATED))]
    # The middle of each enclosure is taken, without its radius: the errors are "sampled".
    errors = [float(error.mid()) for error in relative_errors(pade(p.m, p.n, digits), v_stars, digits)]
    return [*zip(v_stars, errors, strict=True)]


# --- epsilon and invert -----------------------------------------------------------------------------------------------


def _of_bodies(*properties: str) -> Callable[..., Any]:
    """Return a decorator that adds the options of `_Bodies`; `properties` are the keys of a material's options."""
    # Exact decimals of --speed: for beta and v* every digit is proven, and a double would round it.
    return with_options(
        option("--speed", type=Quantity("speed", exact=True), help="Impact speed."),
        option("--stiffness", group="Other laws", help="Constant k of the elastic force k x^A, in N/m^A."),
        option("--mass", group="Other laws", help="Effective mass m1 m2/(m1 + m2); on a plane, the mass of the body."),
        option(
            "--load",
            group="Advanced",
            type=Real(),
            help="Load G of the scaled equation x'' + … = G, without --speed.",
        ),
        material(*properties, "yield_strength"),
        GRAVITY,
        WITH_LAW,
        STYLE,
    )


@dataclass(frozen=True)
class _Bodies:
    """What the options of `epsilon` and `invert` describe: a scaled equation, or bodies with a force or of a material.

    Attributes
    ----------
    law : Law
    style : str
        Format of the output.
    digits : int or None
        Significant digits that were typed.
    speed : str or None
        Impact speed in m/s, exact.
    pair : Pair or None
        Spheres of a material.
    constants : dict
        Stiffness k and mass of the force, or those of the pair, in SI units; empty for the scaled equation.
    damping : float or None
        Constant c of the force.
    load, gravity : float or None
        Load of the scaled equation; acceleration of a body that falls on a plane.
    strength : float or None
        Yield strength of the material.
    """

    law: Law
    style: str
    digits: int | None
    speed: str | None
    pair: Pair | None
    constants: dict[str, float]
    damping: float | None
    load: float | None
    gravity: float | None
    strength: float | None

    @classmethod
    def from_options(
        cls,
        law: str,
        end: str | None,
        style: str,
        digits: int | None,
        speed: str | None,
        load: float | None,
        gravity: float | None,
        force: Mapping[str, str | None],
        **options: Any,
    ) -> _Bodies:
        """Return the bodies that the options describe.

        Parameters
        ----------
        law, end : str, str or None
            Name or exponents of the law of contact, and its end; None for where the force vanishes.
        style : str
            Format of the output.
        digits : int or None
            Significant digits, if they were typed.
        speed : str or None
            Impact speed in m/s, an exact decimal.
        load, gravity : float or None
            Load G of the scaled equation; acceleration in m/s^2.
        force : mapping of str to str or None
            Typed texts of stiffness, mass and, where it is asked for, damping.
        **options : Any
            Those of `pair_of`.

        Raises
        ------
        click.UsageError
            If options are missing, or do not belong together.
        """
        from viscopade.theory.law import law_of

        # Refuse what does not belong together. There are a material, a force of k and c, or the scaled equation.
        contact_law, pair = law_of(law, end), pair_of(**options)
        forced = any(value is not None for value in force.values())
        if pair is not None and (speed is None or forced or contact_law != VISCOELASTIC):
            raise click.UsageError(
                "a material is given: expected --speed with it, and none of --law, --end, --stiffness, --damping and "
                "--mass"
            )
        if load is not None and (pair is not None or forced or speed is not None):
            raise click.UsageError(
                "--load belongs to the scaled equation: expected --kappa, --v-star or --epsilon alone with it, or "
                "--gravity with a material"
            )
        if gravity is not None and not (forced and speed is not None if pair is None else pair.second.is_wall):
            raise click.UsageError(
                "--gravity needs a body that falls on a plane: expected a material, --wall and --speed, or "
                "--stiffness, --mass and --speed"
            )
        # A material is the force k x^(3/2) + … with k = rho and the effective mass.
        constants, damping = _force(contact_law, speed, force) if forced else ({}, None)
        if pair is not None:
            constants = {"k": pair.rho, "mass": pair.m_eff}
        strength = options["yield_strength"]
        return cls(contact_law, style, digits, speed, pair, constants, damping, load, gravity, strength)

    @property
    def _speed(self) -> float:
        """The speed; 1 if the damping does not depend on it."""
        return 1.0 if self.speed is None else float(self.speed)

    @property
    def scales(self) -> tuple[float, float]:
        """Units of length and time of the scaled equation."""
        speed, law = self._speed, self.law
        return law.length_scale(speed, **self.constants), law.time_scale(speed, **self.constants)

    @property
    def kappa(self) -> float | None:
        """Kappa of the given force; None if none is given."""
        return None if self.damping is None else self.law.kappa(self._speed, c=self.damping, **self.constants)

    @property
    def weight(self) -> float | None:
        """The load G; None without weight."""
        if self.gravity is None:
            return self.load
        # G = g T^2/L, with the units L and T of length and time of the scaled equation.
        length, time = self.scales
        return self.gravity * time**2 / length

    def with_weight(self, kappa: float, epsilon: float) -> float:
        """Return the kappa that gives `epsilon` with the weight; `kappa`, which gives it without, starts the search."""
        from viscopade.collision.contact import Contact, damping_factor

        # Without a weight, or for eps = 1 (kappa = 0, with which weight costs nothing), both are the same.
        weight = self.weight
        if not weight or not kappa:
            return kappa
        return damping_factor(lambda damping: Contact.of_law(self.law, damping, weight), epsilon, kappa)

    def show(
        self,
        collision: exact.Collision,
        kappa: float,
        digits: int,
        unit_of_beta: str = "",
        precise: Mapping[str, float] | None = None,
        *,
        proven: bool = True,
        further: Mapping[str, str] | None = None,
    ) -> None:
        """Print the numbers of a collision, and those of a force in SI units, which need all digits of a double.

        Parameters
        ----------
        collision : exact.Collision
            Numbers of the scaled equation.
        kappa : float
            Its damping.
        digits : int
            Digits of the proven numbers, for JSON.
        unit_of_beta : str
            "" if beta has none, or there is no beta.
        precise : mapping of str to float, optional
            The numbers of the collision as doubles, where it has too few digits for them.
        proven : bool
            Whether all digits of the collision are those of the wanted one: its kappa was no rounded double.
        further : mapping of str to str, optional
            Further proven decimals, by name.
        """
        numbers, scaled = collision.decimals() | dict(further or {}), precise or collision.floats()

        # Of a force: c = kappa over the kappa of c = 1, the law's own constant such as a damping ratio, and x_max and
        # tau_c in the units of length and time. For a linear spring the contact time does not depend on the speed.
        si_quantities: dict[str, tuple[float, str]] = {}  # by name: the number and its unit
        lines = []
        if self.constants:
            law, law_damping, (length, time) = self.law, self.law.own_damping, self.scales
            c = law.damping_constant(kappa, self._speed, **self.constants)
            si_quantities["damping"] = c, law.damping_unit
            if law_damping is not None:
                si_quantities[law_damping.symbol] = law_damping.value(c, **self.constants), law_damping.unit
            if self.speed is not None:
                si_quantities["max_compression"] = scaled["x_max"] * length, "m"
            if self.speed is not None or law.elastic == 1:
                si_quantities["contact_time"] = scaled["tau_c"] * time, "s"
            symbol = "" if law_damping is None else f", and {law_damping.symbol} = {law_damping.definition}"
            lines.append(f"damping is c of the force {law.force}{symbol}")

        proven_names = {*numbers} if proven else set[str]()
        # repr is the shortest decimal that is this double.
        numbers |= {name: repr(float(value)) for name, (value, _) in si_quantities.items()}
        units = {"beta": unit_of_beta, **{name: unit for name, (_, unit) in si_quantities.items()}}
        context = {} if self.load is not None else {"digits": digits}
        self._print(numbers, units, proven_names, context, lines, kappa, scaled["epsilon"])

    def show_material(self, pair: Pair, proven: dict[str, str], **context: Any) -> None:
        """Print the numbers of a pair, in double precision except for the proven ones, and warnings about the model.

        `proven` has decimals by name, which replace the doubles; `context` has further entries for JSON.
        """
        from viscopade.arrays import double

        # v* = beta^(1/2) v^(1/10); x_max and tau_c are scaled, max_compression and contact_time are in m and s.
        speed = self._speed
        v_star = pair.v_star(speed)
        numbers = {
            "v_star": v_star,
            "epsilon": pair.epsilon(speed),
            "one_minus_epsilon": pair.one_minus_epsilon(speed),
            "x_max": double.x_max(v_star),
            "tau_c": double.tau_c(v_star),
            "beta": pair.beta,
            "dissipative_constant": pair.A,
            "max_compression": pair.max_compression(speed),
            "contact_time": pair.contact_time(speed),
        }
        texts = {name: repr(float(value)) for name, value in numbers.items()} | proven
        units = {"beta": _unit_of_beta(VISCOELASTIC), "dissipative_constant": "s", "max_compression": "m"}
        units["contact_time"] = "s"
        warnings = limits_of(pair, speed, self.strength)
        self._print(texts, units, {*proven}, context, [], v_star**2, float(numbers["epsilon"]), warnings=warnings)

    def show_adhesive(self, pair: Pair, work: float) -> None:
        """Print the sampled numbers of a `pair` that adheres, and warnings about the model.

        `work` is the work of adhesion in J/m^2.
        """
        from viscopade.collision.adhesion import JKR, adhesive, sticking

        # `bond` has the speed below which the bodies stay together, `spheres` the pull-off force and the neck's energy
        # of Johnson, Kendall and Roberts' contact.
        speed, gravity = self._speed, self.gravity or 0.0
        contact, spheres = adhesive(pair, work, gravity), JKR(pair.E_eff, pair.R_eff, work)
        collision, bond = contact.collide(speed), sticking(lambda _: contact, speed)
        epsilon_without = float(pair.epsilon(speed, gravity))
        numbers = {
            "epsilon": (collision.epsilon, ""),
            "one_minus_epsilon": (1 - collision.epsilon, ""),
            "max_compression": (collision.depth, "m"),
            "contact_time": (collision.duration, "s"),
            "pull_off_force": (spheres.pull_off_force, "N"),
            "neck_energy": (spheres.neck_energy, "J"),
            "epsilon_without_adhesion": (epsilon_without, ""),
        }
        rows = [(name, f"{value:.{_SAMPLED}g}", unit) for name, (value, unit) in numbers.items()]
        if bond is not None and bond.speed is not None:  # found with a relative error of 1e-4, so 4 digits
            rows.append(("sticking_speed", f"{bond.speed:.4g}", "m/s"))
        warnings = limits_of(pair, speed, self.strength, work)
        json_object = {name: text for name, text, _ in rows} | {
            "units": {name: unit for name, _, unit in rows if unit},
            "parts": collision.parts,
            "status": collision.status,
            "errors": {name: collision.errors[name] for name in ("epsilon", "depth", "duration")},
            "warnings": warnings,
        }
        show(self.style, ("quantity", "value", "unit"), self._rounded(rows), json_object)
        if self.style == "text":
            # The estimated error, rounded up to a power of ten.
            error = 10.0 ** math.ceil(math.log10(max(collision.errors["epsilon"], _LEAST_SAMPLED)))
            weight = " and weight" if gravity else ""
            sentence = f"Sampled, with an error below {error:.0e}: eps with adhesion{weight}"
            if not collision.parts:
                sentence = f"Sampled: with adhesion{weight} the bodies stay together, eps is 0"
            say(f"{sentence}. Without adhesion eps is {epsilon_without:.6g}.")
            for text in warnings:
                say(f"Warning: {text}.")

    def show_damped(self, epsilon: str | None, one_minus_epsilon: str | None = None) -> None:
        """Print the numbers of the collision of these bodies, which have the damping that gives a wanted eps.

        `epsilon` is the wanted eps as it was typed, or None if 1 - eps was. Of bodies with a weight, it is the eps
        that they have with this weight.
        """
        from viscopade.collision import exact

        law, speed, pair, number = self.law, self.speed, self.pair, self.digits or ALL_DIGITS
        collision = exact.invert(epsilon, number, one_minus_epsilon=one_minus_epsilon, speed=speed, law=law)

        # Numbers in double precision need the damping to 20 digits, and one that compensates the weight.
        precise = collision.floats()
        if number < _PRECISE:
            to_20_digits = exact.invert(epsilon, _PRECISE, one_minus_epsilon=one_minus_epsilon, speed=speed, law=law)
            precise = to_20_digits.floats()
        kappa_without = precise["v_star"] ** law.d  # kappa = v*^d, for bodies without weight
        kappa = self.with_weight(kappa_without, precise["epsilon"])
        has_kappa_of_eps = kappa == kappa_without
        # The A of a material is in proportion to kappa.
        if pair is not None:
            constant = pair.dissipative_constant(precise["beta"])
            damped = pair.damped(constant if has_kappa_of_eps else constant * kappa / kappa_without)
            self.show_material(damped, collision.decimals() if has_kappa_of_eps else {}, digits=number)
            return
        if not has_kappa_of_eps:
            collision = exact.collision(kappa=repr(kappa), digits=_IN_DOUBLES, law=law)
            precise = collision.floats()
        unit_of_beta = "" if speed is None else _unit_of_beta(law)
        self.show(collision, kappa, number, unit_of_beta, precise, proven=has_kappa_of_eps)

    def _rounded(self, rows: Sequence[tuple[str, ...]]) -> list[tuple[str, ...]]:
        """Return rows (name, number, …) for `show`: in text with the digits that are read, in JSON and CSV with all."""
        if self.style != "text":
            return [*rows]
        return [(name, figures(text, self.digits or TEXT_DIGITS), *more) for name, text, *more in rows]

    def _print(
        self,
        numbers: Mapping[str, str],
        units: Mapping[str, str],
        proven: set[str],
        context: Mapping[str, Any],
        lines: Sequence[str],
        kappa: float,
        epsilon_without: float,
        **further: Any,
    ) -> None:
        """Print numbers, in a table with a column of units if there are any, and lines below it.

        As text a column says which numbers are proven, unless all are; JSON and CSV have no such column.

        With weight, sampled numbers replace those of the collision without weight, whose eps is `epsilon_without`.

        Parameters
        ----------
        numbers, units : mapping of str to str
            Texts of the numbers and their units ("" for none), by name.
        proven : set of str
            Names of the numbers whose digits are proven; the others are computed in double precision.
        context : mapping
            First entries of JSON.
        lines : sequence of str
            Sentences.
        kappa, epsilon_without : float
            Damping of the scaled equation, and its eps without weight.
        **further : Any
            Last entries of JSON; warnings among them are printed as text, too.
        """
        fields, line = law_words(self.law)
        lines = [line, *lines]
        sampled_names: set[str] = set()
        # A load has no units, so that all numbers are new; a weight leaves those that do not depend on it.
        if (weight := self.weight) is not None:
            sampled, weight_entries, sentence = self._with_weight(weight, kappa, epsilon_without)
            numbers, proven = (sampled, set()) if self.load is not None else ({**numbers, **sampled}, proven)
            sampled_names = _SAMPLED_WITH_WEIGHT & {*sampled}
            lines.append(sentence)
            further |= weight_entries
        lines += [f"Warning: {text}." for text in further.get("warnings", ())]
        kind_by_name = {
            name: "sampled" if name in sampled_names else "proven" if name in proven else "in double precision"
            for name in numbers
        }
        # The column of units stands only if some number has one. What is known of the numbers stands in another column;
        # if all are in double precision, in a sentence; and if all are proven, nowhere.
        with_unit = {name: unit for name, unit in units.items() if unit}
        columns = {"quantity": {name: name for name in numbers}, "value": numbers}
        columns |= {"unit": with_unit} if with_unit else {}
        kinds = {*kind_by_name.values()}
        if self.style == "text" and len(kinds) > 1:
            columns["number is"] = kind_by_name
        elif kinds == {"in double precision"}:
            lines.append("All numbers are in double precision.")
        header = tuple(columns)
        rows = [tuple(column.get(name, "") for column in columns.values()) for name in numbers]
        further = ({"units": with_unit} if with_unit else {}) | further
        show(self.style, header, self._rounded(rows), {**context, **fields, **numbers, **further})
        for text in lines if self.style == "text" else ():
            if text:
                say(text)

    def _with_weight(
        self, weight: float, kappa: float, epsilon_without: float
    ) -> tuple[dict[str, str], dict[str, Any], str]:
        """Return the sampled numbers of a collision with weight, further entries for JSON, and a sentence.

        `weight` is the load G of the scaled equation, `kappa` its damping, and `epsilon_without` eps without weight.
        """
        from viscopade.collision.contact import Contact

        # The scaled numbers, or with a gravity the same in SI units.
        heavy = Contact.of_law(self.law, kappa, weight).collide()
        scaled = {"epsilon": heavy.epsilon, "one_minus_epsilon": 1 - heavy.epsilon}
        scaled |= {"x_max": heavy.depth, "tau_c": heavy.duration}
        if self.load is not None:
            v_star = kappa ** (1 / self.law.d)
            numbers = {
                "v_star": v_star,
                "kappa": kappa,
                "load": weight,
                **scaled,
                "epsilon_without_load": epsilon_without,
            }
        else:
            length, time = self.scales
            in_si = {"max_compression": heavy.depth * length, "contact_time": heavy.duration * time}
            numbers = scaled | in_si | {"epsilon_without_weight": epsilon_without}

        # Estimated errors under the names of the numbers; that of eps, rounded up to a power of ten, in the sentence.
        names = {"epsilon": "epsilon", "depth": "x_max", "duration": "tau_c"}
        errors = {name: heavy.errors[field] for field, name in names.items()}
        error = 10.0 ** math.ceil(math.log10(max(heavy.errors["epsilon"], _LEAST_SAMPLED)))
        sentence = (
            f"Sampled, with an error below {error:.0e}: eps with the weight. Without it eps is {epsilon_without:.6g}."
        )
        if not heavy.parts:
            sentence = (
                f"Sampled: with the weight the bodies do not part, eps is 0; without it eps is {epsilon_without:.6g}."
            )
        texts = {name: f"{value:.{_SAMPLED}g}" for name, value in numbers.items()}
        return texts, {"parts": heavy.parts, "status": heavy.status, "errors": errors}, sentence


def _force(law: Law, speed: str | None, typed: Mapping[str, str | None]) -> tuple[dict[str, float], float | None]:
    """Return stiffness and mass, as arguments of `Law.kappa`, and the damping if it is asked for; in SI units.

    `speed` is in m/s, and `typed` has the texts of stiffness, mass and, where it is asked for, damping, by name.

    Raises
    ------
    click.UsageError
        If some of them are missing.
    ValueError
        If one is not a positive number, or one in another unit.
    """
    # kappa grows as v^(2/nu - 1): for nu = 2 it does not depend on the speed.
    needed = typed if law.nu == 2 else {**typed, "speed": speed}
    missing = [f"--{name}" for name, value in needed.items() if value is None]
    if missing:
        others = " and ".join(f"--{name}" for name, value in typed.items() if value is not None)
        why = "" if law.nu == 2 else f"; for the law {law} kappa depends on the speed"
        raise click.UsageError(f"{others} {'need' if ' and ' in others else 'needs'} {' and '.join(missing)}{why}")
    if speed is not None and float(speed) == 0:
        raise ValueError("speed is 0: expected a number > 0")
    units = {"stiffness": law.stiffness_unit, "damping": law.damping_unit, "mass": "kg"}
    value = {name: _in_unit(name, str(text), units[name]) for name, text in typed.items()}
    return {"k": value["stiffness"], "mass": value["mass"]}, value.get("damping")


@click.command(cls=Command, epilog=examples('viscopade epsilon --beta "1.307 (s/cm)^(1/5)" --speed "2 cm/s"'))
@option(
    "--v-star",
    help="v* = beta^(1/2) v^(1/10): 0, inf, or 1e-1000 to 1e100. For other laws v* is kappa^(1/d); with --end "
    "return, kappa.",
)
@option("--epsilon", "epsilon_at_speed", help="eps at --speed, instead of the damping.")
@option("--kappa", group="Other laws", help="Damping of the scaled equation; v*^2 for the viscoelastic law.")
@option("--beta", help="Damping beta, such as '1.3 (s/cm)^(1/5)', with --speed.")
@option("--damping", group="Other laws", help="Constant c of the damping force c x^B x', in N s/m^(B+1).")
@option(
    "--pade",
    "approximants",
    group="Other laws",
    type=Degrees(),
    multiple=True,
    help="Add this approximant and its relative error; repeatable.",
)
@DIGITS_OPTION
@ADHESION
@_of_bodies("young_modulus", "poisson_ratio", "density", "dissipative_constant")
def epsilon(
    v_star: str | None,
    epsilon_at_speed: str | None,
    kappa: str | None,
    beta: str | None,
    damping: str | None,
    approximants: tuple[tuple[int, int], ...],
    digits: int | None,
    stiffness: str | None,
    mass: str | None,
    adhesion: float | None,
    dissipative_constant: float | None,
    **options: Any,
) -> None:
    """Print eps, maximal compression and contact time.

    Give one of these sets of options:

    \b
    --v-star, or --kappa
    --beta and --speed
    --epsilon and --speed             the damping follows from this eps
    a material and --speed            with A, or with --epsilon
    --stiffness, --mass and --speed   with --damping, or with --epsilon

    Quantities may have units, such as "1 cm/s"; plain numbers are in SI units.

    For v*, kappa, beta or eps every digit is proven. --pade also prints an approximant there and its relative error,
    [m/n]/eps - 1. x_max is in units of (rho/m_eff)^(-2/5) v^(4/5), tau_c in units of
    (rho/m_eff)^(-2/5) v^(-1/5). For a material the numbers are in double precision, and warnings say which assumptions
    of the model do not hold.

    For the force k x^A + c x^B x' of another law, the unit of length is (k/m)^(-1/(A+1)) v^(2/(A+1)), the unit of time
    is this length over v, and kappa = (c/m) (k/m)^(-(B+1)/(A+1)) v^(2(B+1)/(A+1)-1).

    --gravity (for a material with --wall, or for --stiffness) and --load include the weight of a body that falls on a
    plane. These numbers are sampled in double precision, with an estimate of their error. A constant force F0 is the
    load G = (F0/m) (k/m)^(-1/(A+1)) v^(-2A/(A+1)).

    --adhesion makes the surfaces of a material adhere (JKR): a neck costs energy, and below the sticking speed the
    bodies stay together. These numbers are sampled, too.
    """  # noqa: D301
    from viscopade.collision import exact

    if beta is not None:
        check_units_of_beta(beta, speed="--speed")
    # From an eps at a speed the damping follows, and no other one may be typed.
    scaled = {"--v-star": v_star, "--kappa": kappa, "--beta": beta}
    if epsilon_at_speed is not None:
        if approximants:
            raise click.UsageError(_NO_APPROXIMANT)
        others = {"--dissipative-constant": dissipative_constant, "--damping": damping, "--adhesion": adhesion}
        for flag, value in (scaled | others).items():
            if value is not None:
                raise click.UsageError(f"--epsilon and {flag} are given: expected one of them")
        if options["speed"] is None:
            raise click.UsageError(
                "--epsilon is given: expected --speed with it, the impact speed at which eps is known"
            )
        bodies = _Bodies.from_options(force={"stiffness": stiffness, "mass": mass}, digits=digits, **options)
        bodies.show_damped(epsilon_at_speed)
        return

    # Refuse options that do not belong together.
    options["dissipative_constant"] = dissipative_constant
    force = {"stiffness": stiffness, "damping": damping, "mass": mass}
    bodies = _Bodies.from_options(force=force, digits=digits, **options)
    law, speed = bodies.law, bodies.speed
    if approximants and (bodies.constants or bodies.load is not None or law != VISCOELASTIC):
        raise click.UsageError(_NO_APPROXIMANT)
    if bodies.constants:
        subject = "--stiffness, --damping and --mass are" if bodies.pair is None else "a material is"
        if any(value is not None for value in scaled.values()):
            raise click.UsageError(f"{subject} given: expected none of {', '.join(scaled)}")
        if digits is not None and (bodies.style != "text" or digits > _OF_DOUBLES):
            raise click.UsageError(
                f"--digits and {subject} given: such numbers are computed in double precision; expected at most "
                f"{_OF_DOUBLES} digits in text, and no --digits in JSON and CSV, which have all of them"
            )

    # Bodies with a force: adhesive, of a material, or of k and c. These numbers are doubles.
    if adhesion is not None:
        if bodies.pair is None:
            raise click.UsageError("--adhesion needs surfaces: expected a material with --speed")
        bodies.show_adhesive(bodies.pair, adhesion)
        return
    if bodies.pair is not None:
        bodies.show_material(bodies.pair, {})
        return
    if bodies.kappa is not None:
        in_doubles = exact.collision(kappa=repr(bodies.kappa), digits=_IN_DOUBLES, law=law)
        bodies.show(in_doubles, bodies.kappa, _IN_DOUBLES, proven=False)
        return

    # The scaled equation: exactly one of v*, kappa and beta with a speed. Every digit is proven.
    if sum(value is not None for value in scaled.values()) != 1 or (beta is None) != (speed is None):
        raise click.UsageError(
            "the options do not give one v*: expected --v-star, --kappa, --beta or --epsilon with --speed, --stiffness "
            "with --damping and --mass, or a material with --speed"
        )
    number, unit = digits or ALL_DIGITS, ""
    if bodies.load is not None:  # the numbers with a load are doubles, computed from this kappa
        number = max(number, _PRECISE)
    if beta is not None and speed is not None and law == VISCOELASTIC:
        beta_number, matching_speed, unit = _beta_and_speed(beta, speed)
        collide = partial(exact.collision, beta=beta_number, speed=matching_speed)
    else:
        if beta is not None:
            unit = _unit_of_beta(law)
            accepted = f"a plain number, in {unit}" if unit else "a plain number"
            arguments.exact_number("beta", beta, f"{accepted}, for the law {law}", lambda _: True)
        collide = partial(exact.collision, v_star, kappa=kappa, beta=beta, speed=speed, law=law)
    collision = collide(digits=number)
    quotients = {name: text for m, n in approximants for name, text in _approximant(m, n, collide, number).items()}
    bodies.show(collision, collision.floats()["v_star"] ** law.d, number, unit, further=quotients)


_NO_APPROXIMANT = (
    "--pade needs the viscoelastic law without load: expected --v-star, --kappa, or --beta and --speed; "
    "`viscopade table` has the error for a material"
)
# Zeros before the first digit of the smallest error of an approximant: a double, which reads it, has no smaller one.
_MOST_ZEROS = 300


def _approximant(m: int, n: int, collide: Callable[..., exact.Collision], digits: int) -> dict[str, str]:
    """Return the proven digits of [m/n] at a v*, and of its relative error [m/n]/eps - 1, by their names in the output.

    `collide` returns the exact collision at v* to a number of digits.

    Raises
    ------
    ValueError
        If v* is infinite, or so small that the error is below 1e-300.
    """
    from flint import arb_poly

    from viscopade.arithmetic.balls import bits_for, known_decimal, working
    from viscopade.theory.pade import pade

    name, v_star = f"[{m}/{n}]", collide(digits=_IN_DOUBLES).v_star
    if not v_star.is_finite():
        raise ValueError("v_star is inf: expected a finite one with --pade")
    # For v* -> 0 the error is of the order v*^(contact order + 1): so many zeros stand before its digits. At v* = 1 it
    # is no less than 10^-(m + n) (measured up to [90/93]: 2e-63). 10 digits more for rounding; a choice.
    order = pade(m, n, _IN_DOUBLES).contact_order + 1
    zeros = 0 if v_star == 0 or v_star > 1 else math.ceil(-order * float(v_star.log() / math.log(10)))
    if zeros > _MOST_ZEROS:
        raise ValueError(f"the error of {name} is below 1e-{_MOST_ZEROS}: expected a larger v*")
    working_digits = digits + zeros + m + n + 10
    p, collision = pade(m, n, working_digits), collide(digits=working_digits)
    # 64 bits (a machine word) more than the digits: those that the sums of the polynomials lose.
    with working(bits_for(working_digits) + 64):
        top, bottom = (arb_poly(list(coefficients))(collision.v_star) for coefficients in (p.a, p.b))
        quotient = top / bottom
        error = quotient / collision.epsilon - 1
    return {name: known_decimal(quotient, digits), f"error of {name}": known_decimal(error, digits)}


@click.command(cls=Command, epilog=examples("viscopade invert --law linear --epsilon 0.5 --stiffness 1e5 --mass 0.1"))
@option("--epsilon", help="Wanted coefficient of restitution eps, > 0 and <= 1.")
@option("--one-minus-epsilon", help="1 - eps, instead of --epsilon, for nearly elastic collisions.")
@DIGITS_OPTION
@_of_bodies("young_modulus", "poisson_ratio", "density")
def invert(
    epsilon: str | None,
    one_minus_epsilon: str | None,
    digits: int | None,
    stiffness: str | None,
    mass: str | None,
    **options: Any,
) -> None:
    """Print the v*, beta and A that give a wanted eps.

    --epsilon alone prints v*, and for another law of contact kappa. These options add

    \b
    --speed                  beta, where kappa = beta speed^(2/nu-1)
    a material and --speed   A, the maximal compression and the contact time
    --stiffness and --mass   the damping c of the force k x^A + c x^B x', the
                             law's own damping constant, the maximal
                             compression and the contact time

    Quantities may have units, such as "1 cm/s"; plain numbers are in SI units. Numbers that need a material, or a
    stiffness and a mass, are in double precision. Every digit of the other numbers is proven. A column of the text says
    which numbers are proven. For a material, warnings say which assumptions of the model do not hold.

    --gravity (for a material with --wall, or for --stiffness) and --load give eps to a body whose weight acts during
    the contact. These numbers are sampled in double precision.
    """  # noqa: D301
    if (epsilon is None) == (one_minus_epsilon is None):
        which = "neither" if epsilon is None else "both"
        raise click.UsageError(f"--epsilon and --one-minus-epsilon: {which} given, expected exactly one of them")
    bodies = _Bodies.from_options(force={"stiffness": stiffness, "mass": mass}, digits=digits, **options)
    bodies.show_damped(epsilon, one_minus_epsilon)


def _in_unit(name: str, text: str, unit: str) -> float:
    """Return the number of a typed `text`, with a unit or a plain one, in the SI unit `unit`; > 0, a damping may be 0.

    `name` is the option's, for the message.
    """
    from viscopade import quantity

    # None for a text without a unit. A number below 1e300 is a finite double, also in another unit.
    in_si = quantity.decimal_in(text, unit)
    accepted = f"a number {'>=' if name == 'damping' else '>'} 0 in {unit}, or one with such a unit"
    return float(
        arguments.exact_number(
            name,
            text if in_si is None else in_si,
            accepted,
            # the largest double is 1.8e308
            lambda x: 0 < x < 10**300 or (x == 0 and name == "damping"),
        )
    )


def _beta_and_speed(beta: str, speed: str) -> tuple[str, str | Fraction, str]:
    """Return the number of beta, the speed in matching units, and the unit of beta; the numbers are exact.

    `beta` is a typed text such as "1.307 (s/cm)^(1/5)", and `speed` is in m/s. In units of its own, (s/cm)^(1/5) and
    cm/s, beta v^(1/5) is the same number. So the fifth root of 100, which is irrational, is never needed.
    """
    from viscopade import quantity

    # `parts`: the number, the unit, and the speed of 1 in its lengths and times, in m/s: 0.01 for cm/s.
    parts = quantity.beta_decimal(beta)
    if parts is None:
        accepted = 'a number in (s/m)^(1/5), or one with its unit, such as "1.3 (s/cm)^(1/5)"'
        arguments.exact_number("beta", beta, accepted, lambda _: True)
        return beta, speed, _unit_of_beta(VISCOELASTIC)
    number, unit, scale = parts
    return number, Fraction(speed) / Fraction(scale), unit


def _unit_of_beta(law: Law) -> str:
    """Return the SI unit of beta, (s/m)^(2/nu - 1); "" if it has none."""
    power = 2 / law.nu - 1
    if abs(power) in (0, 1):
        return {0: "", 1: "s/m", -1: "m/s"}[int(power)]
    return f"(s/m)^({power})" if power > 0 else f"(m/s)^({-power})"


def _root_json(root: Root, digits: int) -> dict[str, Any]:
    """Return a pole or a zero as JSON has it: decimals, whether it is real or positive, and a pole's residue."""
    real_part, imaginary_part = root.decimals(digits)
    # Positive and real: the approximant is not defined there, or vanishes, for some v*.
    result: dict[str, Any] = {
        "re": real_part,
        "im": imaginary_part,
        "multiplicity": root.multiplicity,
        "real": root.real,
        "positive": root.positive,
    }
    if root.residue is not None:
        residue = complex(root.residue)
        result["residue"] = {"re": residue.real, "im": residue.imag}
    return result


def _pade_json(p: Pade) -> dict[str, Any]:
    """Return an approximant as JSON has it: numbers with `p.digits` digits are decimals, as text."""
    from viscopade.arithmetic.balls import known_decimal

    a, b = p.decimals()
    return {
        "m": p.m,
        "n": p.n,
        "digits": p.digits,
        "a": a,
        "b": b,
        "poles": [_root_json(root, p.digits) for root in p.poles],
        "zeros": [_root_json(root, p.digits) for root in p.zeros],
        "doublets": [
            {"pole": d.pole.decimals(p.digits), "zero": d.zero.decimals(p.digits), "distance": d.distance}
            for d in p.doublets()
        ],
        "usable": p.usable,
        "verdict": p.verdict,
        "contact_order": p.contact_order,
        # The first coefficient of the series of eps - p; 10 digits, as the text output has, tell its size.
        "next_term": known_decimal(p.next_term, 10),
        "digits_lost": p.digits_lost,
        "residual": p.residual,
    }


COMMANDS = (reproduce, coefficients, pade_command, epsilon, invert)
