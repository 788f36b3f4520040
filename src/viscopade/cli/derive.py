"""Commands that print exact numbers: reproduce, coefficients, pade, epsilon, invert."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from viscopade import arguments
from viscopade.cli.console import (
    DIGITS,
    DIGITS_OPTION,
    GRAVITY,
    ORDER,
    STYLE,
    WITH_LAW,
    Degree,
    FilePath,
    Quantity,
    Real,
    Whole,
    examples,
    law_words,
    limits_of,
    material,
    pair_of,
    say,
    show,
)
from viscopade.cli.writer import check_targets, write_all
from viscopade.theory.law import VISCOELASTIC

if TYPE_CHECKING:
    from viscopade.collision import exact
    from viscopade.collision.contact import SampledCollision
    from viscopade.collision.spheres import Pair
    from viscopade.theory.derivation import Derivation
    from viscopade.theory.law import Law
    from viscopade.theory.pade import Pade, Root

COMPARED_DIGITS = 20
_HIGHEST = 9  # order to which `reproduce` shows h_k, that of [3/6]
_IN_DOUBLES = 15  # digits of numbers that are computed from doubles
_STIFFNESS = click.option("--stiffness", help="Constant k of the elastic force k x^A, in N/m^A.")
_MASS = click.option("--mass", help="Effective mass m1 m2/(m1 + m2); on a plane, the mass of the body.")
_SAMPLED, _LEAST_SAMPLED = 12, 1e-12  # digits of sampled numbers, and the smallest error that is stated
_STATED, _STATED_DIGITS = (1, 2, 5, 10), 20  # v* at which the errors of an approximant are printed
_LOAD = click.option("--load", type=Real(), help="Load G of the scaled equation x'' + … = G, with its kappa or v*.")


@click.command(epilog=examples("viscopade reproduce"))
@click.option("--out", type=FilePath(), help="Directory for the exported files.  [default: no file is written]")
@STYLE
@click.pass_context
def reproduce(context: click.Context, out: Path | None, style: str) -> None:
    """Derive the paper's table from the equation of motion and compare every printed entry.

    SymPy generates the hierarchy of perturbation equations and the h_k as polynomials from the scaled equation, balls
    give their proven values, and mpmath builds the Padé approximants. A second route checks the values.

    With --out, also write all exported files (C headers, tables, modules). Every kernel is fitted and proven again,
    and compared with the package's record of it. After a mismatch the exit status is 1, and no file is written.
    """
    from viscopade import store
    from viscopade.kernels import requests
    from viscopade.theory.derivation import derive
    from viscopade.theory.equation import scaled_equation
    from viscopade.theory.paper import CITATION, approximants, compare

    if out is not None:
        check_targets([out / name for name in requests.NAMES], parents=True)
    derivation = derive(scaled_equation(), _HIGHEST, COMPARED_DIGITS)
    ours = approximants(COMPARED_DIGITS)
    entries = compare(ours)
    agreeing = sum(entry.agrees for entry in entries)
    header = ("[m/n]", "coefficient", "paper", "ours, rounded", "ours", "agrees")
    rows = [(f"[{e.m}/{e.n}]", e.name, e.printed, e.rounded, e.ours, "yes" if e.agrees else "NO") for e in entries]
    fields = ("m", "n", "symbol", "index", "printed", "rounded", "ours", "agrees")
    whole = {
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
        say("From the equation of motion to the table; SymPy generates what follows from the first line")
        say(f"scaled equation: {derivation.equation}; contact ends where x'' = 0", indent=2)
        say(f"turning point:   {derivation.turning_point}", indent=2)
        say(f"order K^n:       {derivation.hierarchy}", indent=2)
        _say_polynomials(derivation)
        say("mpmath builds a and b of [m/n] from these and higher h_k; balls prove their digits\n")
    show(style, header, rows, whole, title=CITATION)
    if style == "text":
        say(f"{agreeing} of {len(entries)} printed numbers agree")
        for approximant in ours:
            say(f"{approximant.label} is {approximant.verdict}")
    if agreeing < len(entries):
        if out is not None:
            click.echo("viscopade: no file is written, because a printed number disagrees", err=True)
        context.exit(1)
    if out is not None:
        with store.anew() as records:
            texts = requests.files()
        others = [name for name, record in records.items() if store.of_package(name) != record]
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


@click.command(epilog=examples("viscopade coefficients --order 6 --digits 40"))
@click.option("--order", type=ORDER, default=20, show_default=True, help="Highest power of v*.")
@DIGITS_OPTION
@click.option("--symbolic", is_flag=True, help="Print the h_k also as polynomials in lambda_1, lambda_3, ….")
@WITH_LAW
@STYLE
def coefficients(order: int, digits: int, symbolic: bool, law: str, end: str | None, style: str) -> None:
    """Print the series coefficients h_k of eps = sum h_k v*^k.

    The coefficients are h_0 to h_ORDER, and every digit is proven. For other laws of contact v* is a root of kappa,
    which the output states.

    With --symbolic, SymPy generates every h_k from the scaled equation as a polynomial with rational coefficients in
    lambda_1, lambda_3, …. These are the coefficients of -ln eps, as an odd function, if contact ends where x = 0.
    """
    from viscopade.theory.law import law_of
    from viscopade.theory.series import series

    of = law_of(law, end)
    if symbolic:
        from viscopade.theory.derivation import derive
        from viscopade.theory.equation import scaled_equation

        derivation = derive(scaled_equation(of), order, digits, of.end)
    h = series(order, digits, of).decimals()
    fields, line = law_words(of)
    whole: dict[str, Any] = {"order": order, "digits": digits, **fields, "h": h}
    if symbolic:
        whole |= _polynomials_json(derivation, "symbolic")
    if symbolic and style == "csv":
        rows = [(k, h_k, derivation.polynomials.get(k, h_k)) for k, h_k in enumerate(h)]
        show(style, ("k", "h_k", "polynomial"), rows, whole)
    else:
        show(style, ("k", "h_k"), enumerate(h), whole)
    if style == "text":
        if symbolic:
            _say_polynomials(derivation)
        if line:
            say(line)


def _polynomials_json(derivation: Derivation, name: str) -> dict[str, dict[str, str]]:
    """Return the polynomials as text that SymPy reads, and the values of the lambdas."""
    return {
        name: {str(k): str(polynomial) for k, polynomial in derivation.polynomials.items()},
        "lambda": {str(k): value for k, value in derivation.lambdas.items()},
    }


def _say_polynomials(derivation: Derivation) -> None:
    """Print the lambdas, and every h_k as a polynomial and as a number."""
    from viscopade.theory.derivation import plain_text

    for k, value in derivation.lambdas.items():
        say(f"lambda_{k} = {value}", indent=2)
    for k, polynomial in derivation.polynomials.items():
        value = f" = {derivation.values[k]}" if polynomial else ""
        say(f"h_{k} = {plain_text(polynomial)}{value}", indent=2)


# Unknown options become arguments, so that the message about a negative degree names the degree.
@click.command(
    "pade",
    context_settings={"ignore_unknown_options": True},
    epilog=examples("viscopade pade 3/6 --digits 15 --v-star-max 1"),
)
@click.argument("m", type=Degree())
@click.argument("n", type=Whole(0, arguments.MAX_DEGREE), required=False)
@DIGITS_OPTION
@click.option(
    "--v-star-max",
    help="State the error for 0 <= v* <= this number (0.001 to 100): proven for the viscoelastic law, else sampled.",
)
@WITH_LAW
@STYLE
def pade_command(
    m: tuple[int, int], n: int | None, digits: int, v_star_max: str | None, law: str, end: str | None, style: str
) -> None:
    """Print the Padé approximant [M/N] of eps(v*).

    M is the degree of the numerator, N the degree of the denominator; you may also write M/N. The default of N lets the
    approximant decay nearly as eps does: it is M + 3 for the viscoelastic law.

    The output has the coefficients, poles and zeros, the range of v* in which you may use the approximant, and its
    errors at a few v*. An approximant without a pole need not be accurate.
    """
    from viscopade.arithmetic.balls import known_decimal
    from viscopade.arithmetic.decimals import at_most, below
    from viscopade.theory.law import law_of
    from viscopade.theory.pade import pade

    of = law_of(law, end)
    fields, line = law_words(of)
    top, bottom = m
    if bottom >= 0 and n is not None:
        raise click.UsageError(f"the degrees are {top}/{bottom} and {n}: expected M/N or M N")
    if bottom < 0:
        bottom = top + of.excess if n is None else n
    p = pade(top, bottom, digits, of)
    errors, verdict = [], f"{p.label} is {p.verdict}"  # sentences
    if of != VISCOELASTIC:
        from viscopade.kernels.quotient import sampled_errors

        sampled = [(below(high), at_most(error)) for high, error in sampled_errors(p, of, v_star_max)]
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
    if of == VISCOELASTIC:
        at = _errors_at(p, 0 if v_star_max is None else float(v_star_max))
        fields["errors"] = [{"v_star": v_star, "relative": error} for v_star, error in at]
        listed = ", ".join(f"{float(f'{100 * error:.2g}'):g} % at v* = {v_star:g}" for v_star, error in at)
        grows = sorted(at, key=lambda pair: abs(pair[1])) == at
        verdict += f"; its relative error (sampled){' grows' * grows}: {listed}"
    a, b = p.decimals()
    rows = [(name, i, value, "") for name, values in (("a", a), ("b", b)) for i, value in enumerate(values)]
    rows += [
        (kind, i, *root.decimals(digits))
        for kind, roots in (("pole", p.poles), ("zero", p.zeros))
        for i, root in enumerate(roots, 1)
    ]
    header = ("what", "i", "value or real part", "imaginary part")
    show(style, header, rows, {**fields, **_pade_json(p)})
    if style == "text":
        if line:
            say(line)
        say(verdict)
        say(f"eps - {p.label} = {known_decimal(p.next_term, 10)} v*^{p.contact_order + 1} + …")
        for line in errors:
            say(line)
        say(f"digits lost by the linear system: {p.digits_lost}; order conditions met within {p.residual:.1e}")
        for d in p.doublets():
            pole, zero = (" + i ".join(root.decimals(min(digits, 10))) for root in (d.pole, d.zero))
            say(f"Froissart doublet: pole {pole}, zero {zero}, relative distance {d.distance:.1e}")


def _errors_at(p: Pade, v_star_max: float) -> list[tuple[float, float]]:
    """Return the relative errors of an approximant at a few v*, and at the largest one if it lies beyond them."""
    from flint import arb_poly

    from viscopade.arithmetic.balls import bits_for, working
    from viscopade.collision import exact

    found = []
    for v_star in (*_STATED, *[v_star_max] * (v_star_max > max(_STATED))):
        true = exact.collision(v_star, _STATED_DIGITS).epsilon
        with working(bits_for(_STATED_DIGITS) + 64):
            value = arb_poly(list(p.a))(v_star) / arb_poly(list(p.b))(v_star)
            found.append((v_star, float((value / true - 1).mid())))
    return found


@click.command(epilog=examples('viscopade epsilon --beta "1.307 (s/cm)^(1/5)" --speed "2 cm/s"'))
@click.option(
    "--v-star",
    help="v* = beta^(1/2) v^(1/10): 0, inf, or 1e-1000 to 1e100. For other laws it is kappa^(1/d), with --end return "
    "kappa.",
)
@click.option("--kappa", help="Damping of the scaled equation; v*^2 for the viscoelastic law.")
@click.option("--beta", help="Damping beta, such as '1.3 (s/cm)^(1/5)', with --speed.")
@click.option("--speed", type=Quantity("speed", exact=True), help="Impact speed.")
@_STIFFNESS
@click.option("--damping", help="Constant c of the damping force c x^B x', in N s/m^(B+1).")
@_MASS
@_LOAD
@material("young_modulus", "poisson_ratio", "density", "dissipative_constant", "yield_strength")
@GRAVITY
@click.option("--digits", type=DIGITS, help="Significant digits; not with a material or a stiffness.  [default: 30]")
@WITH_LAW
@STYLE
def epsilon(
    v_star: str | None,
    kappa: str | None,
    beta: str | None,
    speed: str | None,
    stiffness: str | None,
    damping: str | None,
    mass: str | None,
    load: float | None,
    gravity: float | None,
    digits: int | None,
    law: str,
    end: str | None,
    style: str,
    **options: Any,
) -> None:
    """Print eps, maximal compression and contact time.

    Give one of these sets of options: --v-star; --kappa; --beta and --speed; a material and --speed; or --stiffness,
    --damping, --mass and --speed. Quantities may have units, such as "1 cm/s"; plain numbers are in SI units.

    For v*, kappa or beta every digit is proven. x_max is in units of (rho/m_eff)^(-2/5) v^(4/5), tau_c in units of
    (rho/m_eff)^(-2/5) v^(-1/5). For a material the numbers are in double precision, and warnings say which assumptions
    of the model do not hold.

    For the force k x^A + c x^B x' of another law, the unit of length is (k/m)^(-1/(A+1)) v^(2/(A+1)), the unit of time
    is this length over v, and kappa = (c/m) (k/m)^(-(B+1)/(A+1)) v^(2(B+1)/(A+1)-1).

    --gravity (for a material with --wall, or for --stiffness) and --load include the weight of a body that falls on a
    plane. These numbers are sampled in double precision, with an estimate of their error. A constant force F0 is the
    load G = (F0/m) (k/m)^(-1/(A+1)) v^(-2A/(A+1)).
    """
    from viscopade.collision import exact
    from viscopade.theory.law import law_of

    of = law_of(law, end)
    fields, line = law_words(of)
    pair = pair_of(**options)
    on_plane = stiffness is not None and speed is not None if pair is None else pair.second.is_wall
    _check_weight(load, gravity, on_plane=on_plane, of_scaled=v_star is not None or kappa is not None)
    if pair is not None:
        others = (v_star, kappa, beta, digits, stiffness, damping, mass)
        if any(value is not None for value in others) or speed is None or of != VISCOELASTIC:
            raise click.UsageError(
                "a material is given: expected --speed with it, and none of --v-star, --kappa, --beta, --stiffness, "
                "--damping, --mass, --digits and --law"
            )
        _show_material(pair, float(speed), {}, options["yield_strength"], fields, style, gravity)
        return
    constants = _constants(of, stiffness, mass, speed, damping=damping)
    if constants is not None:
        if digits is not None:
            raise click.UsageError(
                "--digits is given with --stiffness, --damping and --mass: their numbers are computed in double "
                f"precision, {_IN_DOUBLES} digits without weight, {_SAMPLED} with it; expected no --digits"
            )
        if v_star is not None or kappa is not None or beta is not None:
            raise click.UsageError(
                "--stiffness, --damping and --mass are given: expected none of --v-star, --kappa and --beta with them"
            )
        in_doubles = exact.collision(kappa=repr(constants.kappa), digits=_IN_DOUBLES, law=of)
        numbers, units = constants.of(in_doubles.floats())
        shown, lines = in_doubles.decimals() | numbers, constants.lines
        further: dict[str, Any] = {}
        if gravity is not None:
            weighted, further, sentence = _falling(of, constants.kappa, gravity, *constants.scales)
            shown, lines = shown | weighted, (*lines, sentence)
        _show_numbers(shown, units, {"digits": _IN_DOUBLES, **fields}, style, line, *lines, **further)
        return
    given = (v_star is not None) + (kappa is not None) + (beta is not None and speed is not None)
    if given != 1 or (beta is None) != (speed is None):
        raise click.UsageError(
            "the options do not give one v*: expected --v-star, --kappa, --beta with --speed, --stiffness with "
            "--damping and --mass, or a material with --speed"
        )
    number = 30 if digits is None else digits
    if beta is not None and speed is not None and of == VISCOELASTIC:
        factor, in_its_units, unit = _beta_and_speed(beta, speed)
        collision = exact.collision(digits=number, beta=factor, speed=in_its_units)
    else:
        unit = "" if beta is None else _unit_of_beta(of)
        if beta is not None:
            accepted = f"a plain number, in {unit}" if unit else "a plain number"
            arguments.exact_number("beta", beta, f"{accepted}, for the law {of}", lambda _: True)
        collision = exact.collision(v_star, number, kappa=kappa, beta=beta, speed=speed, law=of)
    if load is not None:
        _show_load(collision, load, of, fields, style, line)
        return
    units = {"beta": unit} if unit else {}
    _show_numbers(collision.decimals(), units, {"digits": collision.digits, **fields}, style, line)


@click.command(epilog=examples("viscopade invert --law linear --epsilon 0.5 --stiffness 1e5 --mass 0.1"))
@click.option("--epsilon", help="Wanted coefficient of restitution eps, > 0 and <= 1.")
@click.option("--one-minus-epsilon", help="1 - eps, instead of --epsilon, for nearly elastic collisions.")
@click.option("--speed", type=Quantity("speed", exact=True), help="Impact speed.")
@_STIFFNESS
@_MASS
@_LOAD
@material("young_modulus", "poisson_ratio", "density", "yield_strength")
@GRAVITY
@DIGITS_OPTION
@WITH_LAW
@STYLE
def invert(
    epsilon: str | None,
    one_minus_epsilon: str | None,
    speed: str | None,
    stiffness: str | None,
    mass: str | None,
    load: float | None,
    gravity: float | None,
    digits: int,
    law: str,
    end: str | None,
    style: str,
    **options: Any,
) -> None:
    """Print the v*, beta and A that give a wanted eps.

    --epsilon alone prints v*, and for another law of contact its kappa. Further options add further numbers:

    \b
    --speed                  beta, where kappa = beta speed^(2/nu-1)
    a material and --speed   A, the maximal compression and the contact time
    --stiffness and --mass   the damping c of the force k x^A + c x^B x', the
                             law's own damping constant, and the same lengths

    Quantities may have units, such as "1 cm/s"; plain numbers are in SI units. Every digit is proven, except for those
    that need a material, or a stiffness and a mass: they are in double precision. For a material, warnings say which
    assumptions of the model do not hold.

    --gravity (for a material with --wall, or for --stiffness) and --load give eps to a body whose weight acts during
    the contact. These numbers are sampled in double precision.
    """  # noqa: D301
    from viscopade.collision import exact
    from viscopade.collision.contact import Contact, damping_factor
    from viscopade.theory.law import law_of

    if (epsilon is None) == (one_minus_epsilon is None):
        given = "neither" if epsilon is None else "both"
        raise click.UsageError(f"--epsilon and --one-minus-epsilon: {given} given, expected exactly one of them")
    of = law_of(law, end)
    fields, line = law_words(of)
    pair = pair_of(**options)
    if pair is not None and speed is None:
        raise click.UsageError("a material also needs --speed")
    if pair is not None and of != VISCOELASTIC:
        raise click.UsageError("a material is given: expected the law viscoelastic with the end force")
    constants = _constants(of, stiffness, mass, speed)
    if constants is not None and pair is not None:
        raise click.UsageError("--stiffness and a material are given: expected one of them")
    plain = pair is None and speed is None and constants is None
    on_plane = constants is not None and speed is not None if pair is None else pair.second.is_wall
    _check_weight(load, gravity, on_plane=on_plane, of_scaled=plain)
    collision = exact.invert(epsilon, digits, one_minus_epsilon=one_minus_epsilon, speed=speed, law=of)
    proven = collision.decimals()
    if pair is not None and speed is not None:
        precise = exact.invert(epsilon, max(digits, 20), one_minus_epsilon=one_minus_epsilon, speed=speed)
        constant, v = pair.dissipative_constant(precise.floats()["beta"]), float(speed)
        if gravity and constant:
            wanted = precise.floats()["epsilon"]
            constant = damping_factor(lambda a: pair.damped(a).contact(gravity), wanted, constant, speed=v)
        known = {"digits": digits, **fields}
        _show_material(pair.damped(constant), v, proven, options["yield_strength"], known, style, gravity)
        return
    if load is not None:
        wanted, kappa = collision.floats()["epsilon"], collision.floats()["v_star"] ** of.d
        if kappa:
            kappa = damping_factor(lambda damping: Contact.of_law(of, damping, load), wanted, kappa)
        _show_load(exact.collision(kappa=repr(kappa), digits=15, law=of), load, of, fields, style, line)
        return
    units = {} if speed is None else {"beta": _unit_of_beta(of)}
    lines: tuple[str, ...] = ()
    further: dict[str, Any] = {}
    if constants is not None:
        floats = exact.invert(epsilon, max(digits, 20), one_minus_epsilon=one_minus_epsilon, law=of).floats()
        constants = replace(constants, kappa=floats["v_star"] ** of.d)
        if gravity and constants.kappa:
            weight = gravity * constants.scales[1] ** 2 / constants.scales[0]
            wanted = floats["epsilon"]
            kappa = damping_factor(lambda damping: Contact.of_law(of, damping, weight), wanted, constants.kappa)
            without = exact.collision(kappa=repr(kappa), digits=_IN_DOUBLES, law=of)
            constants, floats, proven = replace(constants, kappa=kappa), without.floats(), without.decimals()
        numbers, own_units = constants.of(floats)
        proven, units, lines = proven | numbers, units | own_units, constants.lines
        if gravity is not None:
            weighted, further, sentence = _falling(of, constants.kappa, gravity, *constants.scales)
            proven, lines = proven | weighted, (*lines, sentence)
    _show_numbers(proven, units, {"digits": digits, **fields}, style, line, *lines, **further)


@dataclass(frozen=True)
class _Constants:
    """Constants of a contact in SI units; the speed is None if the damping does not depend on it."""

    law: Law
    k: float
    mass: float
    speed: float | None
    kappa: float

    def of(self, scaled: dict[str, float]) -> tuple[dict[str, str], dict[str, str]]:
        """Return the damping, the depth and the duration of the scaled collision, and their units."""
        law, at = self.law, {"k": self.k, "mass": self.mass}
        speed = 1.0 if self.speed is None else self.speed
        c = law.damping_constant(self.kappa, speed, **at)
        found = {"damping": (c, law.damping_unit)}
        if law.own_damping is not None:
            found[law.own_damping.symbol] = law.own_damping.of(c, **at), law.own_damping.unit
        if self.speed is not None:
            found["max_compression"] = scaled["x_max"] * law.length_scale(speed, **at), "m"
        if self.speed is not None or law.elastic == 1:
            found["contact_time"] = scaled["tau_c"] * law.time_scale(speed, **at), "s"
        numbers = {name: repr(float(value)) for name, (value, _) in found.items()}
        return numbers, {name: unit for name, (_, unit) in found.items() if unit}

    @property
    def scales(self) -> tuple[float, float]:
        """Units of length and time of the scaled equation."""
        speed, at = 1.0 if self.speed is None else self.speed, {"k": self.k, "mass": self.mass}
        return self.law.length_scale(speed, **at), self.law.time_scale(speed, **at)

    @property
    def lines(self) -> tuple[str, ...]:
        """Sentences on the damping."""
        own, what = self.law.own_damping, f"damping is c of the force {self.law.force}"
        return (what if own is None else f"{what}, and {own.symbol} = {own.definition}",)


def _constants(
    law: Law, stiffness: str | None, mass: str | None, speed: str | None, **of_epsilon: str | None
) -> _Constants | None:
    """Return the constants of a contact; None if none is given.

    Raises
    ------
    click.UsageError
        If some of them are missing.
    ValueError
        If one is not a positive number, or one in another unit.
    """
    given = {"stiffness": stiffness, "mass": mass, **of_epsilon}
    if all(value is None for value in given.values()):
        return None
    needed = given if law.nu == 2 else {**given, "speed": speed}
    missing = [f"--{name}" for name, value in needed.items() if value is None]
    if missing:
        others = " and ".join(f"--{name}" for name, value in given.items() if value is not None)
        why = "" if law.nu == 2 else f"; for the law {law} kappa depends on the speed"
        raise click.UsageError(f"{others} {'need' if ' and ' in others else 'needs'} {' and '.join(missing)}{why}")
    units = {"stiffness": law.stiffness_unit, "damping": law.damping_unit, "mass": "kg"}
    value = {name: _in_unit(name, str(text), units[name]) for name, text in given.items()}
    v = None if speed is None else float(speed)
    if v == 0:
        raise ValueError("speed is 0: expected a number > 0")
    k, m = value["stiffness"], value["mass"]
    kappa = law.kappa(1.0 if v is None else v, k=k, c=value["damping"], mass=m) if of_epsilon else 0.0
    return _Constants(law, k, m, v, kappa)


def _in_unit(name: str, text: str, unit: str) -> float:
    """Return a number with a unit, or a plain one, in an SI unit."""
    from viscopade import quantity

    found = quantity.decimal_in(text, unit)
    accepted = f"a number {'>=' if name == 'damping' else '>'} 0 in {unit}, or one with such a unit"
    return float(
        arguments.exact_number(
            name,
            text if found is None else found,
            accepted,
            lambda x: 0 < x < 10**300 or (x == 0 and name == "damping"),
        )
    )


def _check_weight(load: float | None, gravity: float | None, *, on_plane: bool, of_scaled: bool) -> None:
    """Refuse --load or --gravity without the collision that it belongs to."""
    if load is not None and not of_scaled:
        raise click.UsageError(
            "--load belongs to the scaled equation: expected --kappa, --v-star or --epsilon alone with it, or "
            "--gravity with a material"
        )
    if gravity is not None and not on_plane:
        raise click.UsageError(
            "--gravity needs a body that falls on a plane: expected a material, --wall and --speed, or "
            "--stiffness, --mass and --speed"
        )


def _falling(
    law: Law, kappa: float, gravity: float, length: float, time: float
) -> tuple[dict[str, str], dict[str, Any], str]:
    """Return the numbers of a body that falls on a plane, further entries for JSON, and a sentence.

    `length` and `time` are the units of the scaled equation.
    """
    from viscopade.collision.contact import Contact

    without = Contact.of_law(law, kappa).collide().epsilon
    found = Contact.of_law(law, kappa, gravity * time**2 / length).collide()
    numbers = {
        "epsilon": found.epsilon,
        "one_minus_epsilon": 1 - found.epsilon,
        "x_max": found.depth,
        "tau_c": found.duration,
        "max_compression": found.depth * length,
        "contact_time": found.duration * time,
        "epsilon_without_weight": without,
    }
    texts = {name: f"{value:.{_SAMPLED}g}" for name, value in numbers.items()}
    return texts, _sampled_json(found, "x_max", "tau_c"), _weight_line(found, without)


def _weight_line(found: SampledCollision, without: float) -> str:
    """Return the sentence on a collision with weight."""
    if not found.parts:
        return f"Sampled: with the weight the bodies do not part, eps is 0; without it eps is {without:.6g}."
    error = 10.0 ** math.ceil(math.log10(max(found.errors["epsilon"], _LEAST_SAMPLED)))
    return f"Sampled, with an error below {error:.0e}: eps with the weight. Without it eps is {without:.6g}."


def _show_load(
    collision: exact.Collision, load: float, law: Law, context: dict[str, Any], style: str, line: str
) -> None:
    """Show a collision of the scaled equation with a load."""
    from viscopade.collision.contact import Contact

    without = collision.floats()
    kappa = without["v_star"] ** law.d
    found = Contact.of_law(law, kappa, load).collide()
    numbers = {
        "v_star": without["v_star"],
        "kappa": kappa,
        "load": load,
        "epsilon": found.epsilon,
        "x_max": found.depth,
        "tau_c": found.duration,
        "epsilon_without_load": without["epsilon"],
    }
    shown = {name: f"{value:.{_SAMPLED}g}" for name, value in numbers.items()}
    further = _sampled_json(found, "x_max", "tau_c")
    _show_numbers(shown, {}, context, style, line, _weight_line(found, without["epsilon"]), **further)


def _sampled_json(found: SampledCollision, depth: str, duration: str) -> dict[str, Any]:
    """Return whether the bodies part, and the errors of the numbers by their names in the output."""
    names = {"epsilon": "epsilon", "depth": depth, "duration": duration}
    errors = {name: found.errors[of] for of, name in names.items()}
    return {"parts": found.parts, "status": found.status, "errors": errors}


def _beta_and_speed(beta: str, speed: str) -> tuple[str, str | Fraction, str]:
    """Return the number of beta, the speed in matching units, and the unit of beta; the numbers are exact."""
    from viscopade import quantity

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


def _show_material(
    pair: Pair,
    speed: float,
    proven: dict[str, str],
    strength: float | None,
    context: dict[str, Any],
    style: str,
    gravity: float | None = None,
) -> None:
    """Show the numbers of a collision, in double precision except for the proven ones, and warnings about the model."""
    from viscopade.arrays import double as scaled

    v_star = pair.v_star(speed)
    numbers = {
        "v_star": v_star,
        "epsilon": pair.epsilon(speed),
        "one_minus_epsilon": pair.one_minus_epsilon(speed),
        "x_max": scaled.x_max(v_star),
        "tau_c": scaled.tau_c(v_star),
        "beta": pair.beta,
        "dissipative_constant": pair.A,
        "max_compression": pair.max_compression(speed),
        "contact_time": pair.contact_time(speed),
    }
    units = {
        "beta": _unit_of_beta(VISCOELASTIC),
        "dissipative_constant": "s",
        "max_compression": "m",
        "contact_time": "s",
    }
    lines: list[str] = []
    further: dict[str, Any] = {}
    if gravity is not None:
        scales = pair.length_scale(speed), pair.time_scale(speed)
        proven, further, line = _falling(VISCOELASTIC, v_star**2, gravity, *scales)
        lines = [line]
    warnings = limits_of(pair, speed, strength)
    lines += [f"Warning: {text}." for text in warnings]
    shown = {name: repr(float(value)) for name, value in numbers.items()} | proven
    _show_numbers(shown, units, context, style, *lines, warnings=warnings, **further)


def _show_numbers(
    numbers: dict[str, str], units: dict[str, str], context: dict[str, Any], style: str, *lines: str, **further: Any
) -> None:
    """Show numbers in a table, with a column of units if there are any, and lines below it."""
    if units:
        header: tuple[str, ...] = ("quantity", "value", "unit")
        rows: list[tuple[str, ...]] = [(name, value, units.get(name, "")) for name, value in numbers.items()]
        further = {"units": units, **further}
    else:
        header, rows = ("quantity", "value"), list(numbers.items())
    show(style, header, rows, {**context, **numbers, **further})
    for line in lines:
        if style == "text" and line:
            say(line)


def _root_json(root: Root, digits: int) -> dict[str, Any]:
    real_part, imaginary_part = root.decimals(digits)
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
        "next_term": known_decimal(p.next_term, 10),
        "digits_lost": p.digits_lost,
        "residual": p.residual,
    }


COMMANDS = (reproduce, coefficients, pade_command, epsilon, invert)
