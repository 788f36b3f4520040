"""Commands that print exact numbers: reproduce, coefficients, pade, epsilon, invert."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from viscopade import arguments
from viscopade.cli.console import (
    ADHESION,
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

COMPARED_DIGITS = 20
_HIGHEST = 9  # order to which `reproduce` shows h_k, that of [3/6]
_IN_DOUBLES = 15  # digits of numbers that are computed from doubles
_PRECISE = 20  # digits of a damping that is used in doubles
_SAMPLED, _LEAST_SAMPLED = 12, 1e-12  # digits of sampled numbers, and the smallest error that is stated
_STATED, _STATED_DIGITS = (1, 2, 5, 10), 30  # v* at which the errors of an approximant are printed


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
    from flint import arb, arb_poly

    from viscopade.arithmetic.balls import bits_for, working
    from viscopade.collision import exact

    found = []
    for v_star in (*_STATED, *[v_star_max] * (v_star_max > max(_STATED))):
        true = exact.epsilon(v_star, _STATED_DIGITS)
        with working(bits_for(_STATED_DIGITS) + 64):
            value = arb_poly(list(p.a))(v_star) / arb_poly(list(p.b))(v_star)
            found.append((v_star, float((value / arb(true) - 1).mid())))
    return found


# --- epsilon and invert -----------------------------------------------------------------------------------------------


def _of_bodies(*properties: str) -> Callable[..., Any]:
    """Return a decorator that adds the options of `_Bodies`."""
    return with_options(
        click.option("--speed", type=Quantity("speed", exact=True), help="Impact speed."),
        click.option("--stiffness", help="Constant k of the elastic force k x^A, in N/m^A."),
        click.option("--mass", help="Effective mass m1 m2/(m1 + m2); on a plane, the mass of the body."),
        click.option("--load", type=Real(), help="Load G of the scaled equation x'' + … = G, with its kappa or v*."),
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
    speed: str | None
    pair: Pair | None
    constants: dict[str, float]
    damping: float | None
    load: float | None
    gravity: float | None
    strength: float | None

    @classmethod
    def of(
        cls,
        law: str,
        end: str | None,
        style: str,
        speed: str | None,
        load: float | None,
        gravity: float | None,
        force: Mapping[str, str | None],
        **options: Any,
    ) -> _Bodies:
        """Read the options, those of the force by name.

        Raises
        ------
        click.UsageError
            If options are missing, or do not belong together.
        """
        from viscopade.theory.law import law_of

        of, pair, forced = law_of(law, end), pair_of(**options), any(value is not None for value in force.values())
        if pair is not None and (speed is None or forced or of != VISCOELASTIC):
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
        constants, damping = _force(of, speed, force) if forced else ({}, None)
        if pair is not None:
            constants = {"k": pair.rho, "mass": pair.m_eff}
        return cls(of, style, speed, pair, constants, damping, load, gravity, options["yield_strength"])

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
        length, time = self.scales
        return self.gravity * time**2 / length

    def with_weight(self, kappa: float, epsilon: float) -> float:
        """Return the kappa that gives eps with the weight; `kappa` gives it without."""
        from viscopade.collision.contact import Contact, damping_factor

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
    ) -> None:
        """Print the numbers of a collision, and those of a force in SI units, which need all digits of a double."""
        numbers, scaled = collision.decimals(), precise or collision.floats()
        found: dict[str, tuple[float, str]] = {}
        lines = []
        if self.constants:
            law, own, (length, time) = self.law, self.law.own_damping, self.scales
            c = law.damping_constant(kappa, self._speed, **self.constants)
            found["damping"] = c, law.damping_unit
            if own is not None:
                found[own.symbol] = own.value(c, **self.constants), own.unit
            if self.speed is not None:
                found["max_compression"] = scaled["x_max"] * length, "m"
            if self.speed is not None or law.elastic == 1:
                found["contact_time"] = scaled["tau_c"] * time, "s"
            symbol = "" if own is None else f", and {own.symbol} = {own.definition}"
            lines.append(f"damping is c of the force {law.force}{symbol}")
        numbers |= {name: repr(float(value)) for name, (value, _) in found.items()}
        units = {"beta": unit_of_beta, **{name: unit for name, (_, unit) in found.items()}}
        context = {} if self.load is not None else {"digits": digits}
        self._print(numbers, units, context, lines, kappa, scaled["epsilon"])

    def show_material(self, pair: Pair, proven: dict[str, str], **context: Any) -> None:
        """Print the numbers of a pair, in double precision except for the proven ones, and warnings about the model."""
        from viscopade.arrays import double

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
        self._print(texts, units, context, [], v_star**2, float(numbers["epsilon"]), warnings=warnings)

    def show_adhesive(self, pair: Pair, work: float) -> None:
        """Print the sampled numbers of a pair that adheres, and warnings about the model."""
        from viscopade.collision.adhesion import JKR, adhesive, sticking

        speed, gravity = self._speed, self.gravity or 0.0
        contact, spheres = adhesive(pair, work, gravity), JKR(pair.E_eff, pair.R_eff, work)
        collision, bond = contact.collide(speed), sticking(lambda _: contact, speed)
        without = float(pair.epsilon(speed, gravity))
        numbers = {
            "epsilon": (collision.epsilon, ""),
            "one_minus_epsilon": (1 - collision.epsilon, ""),
            "max_compression": (collision.depth, "m"),
            "contact_time": (collision.duration, "s"),
            "pull_off_force": (spheres.pull_off_force, "N"),
            "neck_energy": (spheres.neck_energy, "J"),
            "epsilon_without_adhesion": (without, ""),
        }
        rows = [(name, f"{value:.{_SAMPLED}g}", unit) for name, (value, unit) in numbers.items()]
        if bond is not None and bond.speed is not None:
            rows.append(("sticking_speed", f"{bond.speed:.4g}", "m/s"))
        warnings = limits_of(pair, speed, self.strength, work)
        whole = {name: text for name, text, _ in rows} | {
            "units": {name: unit for name, _, unit in rows if unit},
            "parts": collision.parts,
            "status": collision.status,
            "errors": {name: collision.errors[name] for name in ("epsilon", "depth", "duration")},
            "warnings": warnings,
        }
        show(self.style, ("quantity", "value", "unit"), rows, whole)
        if self.style == "text":
            error = 10.0 ** math.ceil(math.log10(max(collision.errors["epsilon"], _LEAST_SAMPLED)))
            weight = " and weight" if gravity else ""
            sentence = f"Sampled, with an error below {error:.0e}: eps with adhesion{weight}"
            if not collision.parts:
                sentence = f"Sampled: with adhesion{weight} the bodies stay together, eps is 0"
            say(f"{sentence}. Without adhesion eps is {without:.6g}.")
            for text in warnings:
                say(f"Warning: {text}.")

    def _print(
        self,
        numbers: Mapping[str, str],
        units: Mapping[str, str],
        context: Mapping[str, Any],
        lines: Sequence[str],
        kappa: float,
        without: float,
        **further: Any,
    ) -> None:
        """Print numbers, in a table with a column of units if there are any, and lines below it.

        With weight, sampled numbers replace those of the collision without weight, whose eps is `without`.
        """
        fields, line = law_words(self.law)
        lines = [line, *lines]
        if (weight := self.weight) is not None:
            sampled, of_weight, sentence = self._with_weight(weight, kappa, without)
            numbers = sampled if self.load is not None else {**numbers, **sampled}
            lines.append(sentence)
            further |= of_weight
        lines += [f"Warning: {text}." for text in further.get("warnings", ())]
        known = {name: unit for name, unit in units.items() if unit}
        header = ("quantity", "value", "unit") if known else ("quantity", "value")
        rows = [(name, value, known.get(name, ""))[: len(header)] for name, value in numbers.items()]
        further = ({"units": known} if known else {}) | further
        show(self.style, header, rows, {**context, **fields, **numbers, **further})
        for text in lines if self.style == "text" else ():
            if text:
                say(text)

    def _with_weight(self, weight: float, kappa: float, without: float) -> tuple[dict[str, str], dict[str, Any], str]:
        """Return the sampled numbers of a collision with weight, further entries for JSON, and a sentence."""
        from viscopade.collision.contact import Contact

        found = Contact.of_law(self.law, kappa, weight).collide()
        scaled = {"epsilon": found.epsilon, "one_minus_epsilon": 1 - found.epsilon}
        scaled |= {"x_max": found.depth, "tau_c": found.duration}
        if self.load is not None:
            v_star = kappa ** (1 / self.law.d)
            numbers = {"v_star": v_star, "kappa": kappa, "load": weight, **scaled, "epsilon_without_load": without}
        else:
            length, time = self.scales
            in_si = {"max_compression": found.depth * length, "contact_time": found.duration * time}
            numbers = scaled | in_si | {"epsilon_without_weight": without}
        names = {"epsilon": "epsilon", "depth": "x_max", "duration": "tau_c"}
        errors = {name: found.errors[of] for of, name in names.items()}
        error = 10.0 ** math.ceil(math.log10(max(found.errors["epsilon"], _LEAST_SAMPLED)))
        sentence = f"Sampled, with an error below {error:.0e}: eps with the weight. Without it eps is {without:.6g}."
        if not found.parts:
            sentence = f"Sampled: with the weight the bodies do not part, eps is 0; without it eps is {without:.6g}."
        texts = {name: f"{value:.{_SAMPLED}g}" for name, value in numbers.items()}
        return texts, {"parts": found.parts, "status": found.status, "errors": errors}, sentence


def _force(law: Law, speed: str | None, given: Mapping[str, str | None]) -> tuple[dict[str, float], float | None]:
    """Return stiffness and mass, as arguments of `Law.kappa`, and the damping if it is asked for; in SI units.

    Raises
    ------
    click.UsageError
        If some of them are missing.
    ValueError
        If one is not a positive number, or one in another unit.
    """
    needed = given if law.nu == 2 else {**given, "speed": speed}
    missing = [f"--{name}" for name, value in needed.items() if value is None]
    if missing:
        others = " and ".join(f"--{name}" for name, value in given.items() if value is not None)
        why = "" if law.nu == 2 else f"; for the law {law} kappa depends on the speed"
        raise click.UsageError(f"{others} {'need' if ' and ' in others else 'needs'} {' and '.join(missing)}{why}")
    if speed is not None and float(speed) == 0:
        raise ValueError("speed is 0: expected a number > 0")
    units = {"stiffness": law.stiffness_unit, "damping": law.damping_unit, "mass": "kg"}
    value = {name: _in_unit(name, str(text), units[name]) for name, text in given.items()}
    return {"k": value["stiffness"], "mass": value["mass"]}, value.get("damping")


@click.command(epilog=examples('viscopade epsilon --beta "1.307 (s/cm)^(1/5)" --speed "2 cm/s"'))
@click.option(
    "--v-star",
    help="v* = beta^(1/2) v^(1/10): 0, inf, or 1e-1000 to 1e100. For other laws it is kappa^(1/d), with --end return "
    "kappa.",
)
@click.option("--kappa", help="Damping of the scaled equation; v*^2 for the viscoelastic law.")
@click.option("--beta", help="Damping beta, such as '1.3 (s/cm)^(1/5)', with --speed.")
@click.option("--damping", help="Constant c of the damping force c x^B x', in N s/m^(B+1).")
@click.option("--digits", type=DIGITS, help="Significant digits; not with a material or a stiffness.  [default: 30]")
@ADHESION
@_of_bodies("young_modulus", "poisson_ratio", "density", "dissipative_constant")
def epsilon(
    v_star: str | None,
    kappa: str | None,
    beta: str | None,
    damping: str | None,
    digits: int | None,
    stiffness: str | None,
    mass: str | None,
    adhesion: float | None,
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

    --adhesion makes the surfaces of a material adhere (JKR): a neck costs energy, and below the sticking speed the
    bodies stay together. These numbers are sampled, too.
    """
    from viscopade.collision import exact

    bodies = _Bodies.of(force={"stiffness": stiffness, "damping": damping, "mass": mass}, **options)
    law, speed = bodies.law, bodies.speed
    scaled = {"--v-star": v_star, "--kappa": kappa, "--beta": beta}
    if bodies.constants:
        what = "--stiffness, --damping and --mass are" if bodies.pair is None else "a material is"
        if any(value is not None for value in scaled.values()):
            raise click.UsageError(f"{what} given: expected none of {', '.join(scaled)}")
        if digits is not None:
            raise click.UsageError(
                f"--digits and {what} given: such numbers are computed in double precision, {_IN_DOUBLES} digits "
                f"without weight, {_SAMPLED} with it; expected no --digits"
            )
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
        bodies.show(in_doubles, bodies.kappa, _IN_DOUBLES)
        return
    if sum(value is not None for value in scaled.values()) != 1 or (beta is None) != (speed is None):
        raise click.UsageError(
            "the options do not give one v*: expected --v-star, --kappa, --beta with --speed, --stiffness with "
            "--damping and --mass, or a material with --speed"
        )
    number, unit = 30 if digits is None else digits, ""
    if beta is not None and speed is not None and law == VISCOELASTIC:
        factor, in_its_units, unit = _beta_and_speed(beta, speed)
        collision = exact.collision(digits=number, beta=factor, speed=in_its_units)
    else:
        if beta is not None:
            unit = _unit_of_beta(law)
            accepted = f"a plain number, in {unit}" if unit else "a plain number"
            arguments.exact_number("beta", beta, f"{accepted}, for the law {law}", lambda _: True)
        collision = exact.collision(v_star, number, kappa=kappa, beta=beta, speed=speed, law=law)
    bodies.show(collision, collision.floats()["v_star"] ** law.d, number, unit)


@click.command(epilog=examples("viscopade invert --law linear --epsilon 0.5 --stiffness 1e5 --mass 0.1"))
@click.option("--epsilon", help="Wanted coefficient of restitution eps, > 0 and <= 1.")
@click.option("--one-minus-epsilon", help="1 - eps, instead of --epsilon, for nearly elastic collisions.")
@DIGITS_OPTION
@_of_bodies("young_modulus", "poisson_ratio", "density")
def invert(
    epsilon: str | None,
    one_minus_epsilon: str | None,
    digits: int,
    stiffness: str | None,
    mass: str | None,
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

    if (epsilon is None) == (one_minus_epsilon is None):
        given = "neither" if epsilon is None else "both"
        raise click.UsageError(f"--epsilon and --one-minus-epsilon: {given} given, expected exactly one of them")
    bodies = _Bodies.of(force={"stiffness": stiffness, "mass": mass}, **options)
    law, speed, pair = bodies.law, bodies.speed, bodies.pair
    collision = exact.invert(epsilon, digits, one_minus_epsilon=one_minus_epsilon, speed=speed, law=law)

    # Numbers in double precision need the damping to more digits than these, and one that compensates the weight.
    precise = collision.floats()
    if digits < _PRECISE:
        precise = exact.invert(epsilon, _PRECISE, one_minus_epsilon=one_minus_epsilon, speed=speed, law=law).floats()
    without = precise["v_star"] ** law.d
    kappa = bodies.with_weight(without, precise["epsilon"])
    if pair is not None:
        constant = pair.dissipative_constant(precise["beta"])
        damped = pair.damped(constant if kappa == without else constant * kappa / without)
        bodies.show_material(damped, collision.decimals() if kappa == without else {}, digits=digits)
        return
    if kappa != without:
        collision = exact.collision(kappa=repr(kappa), digits=_IN_DOUBLES, law=law)
        precise = collision.floats()
    bodies.show(collision, kappa, digits, "" if speed is None else _unit_of_beta(law), precise)


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
