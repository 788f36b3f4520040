"""Derivatives of compact kernels as straight-line programs, for JAX.

With eps = D/(D + L), L = y^6 N, y = w^(1/30), w = beta^5 speed:

    -d eps/d ln y = y^6 slope,    slope = (D (6 N + y N') - y D' N)/(D + L)^2,
    d eps/d speed = -beta speed^(-4/5) slope/30,    d eps/d beta = -speed^(1/5) slope/6,

as y^6 = beta speed^(1/5). So neither is 0/0 where the speed or beta is 0. The constants of the slope are rounded as
exported code has them.
"""

from __future__ import annotations

from fractions import Fraction

from viscopade.approximation.half_line import SHIFT
from viscopade.approximation.lacunary import Powers
from viscopade.arithmetic.formats import Format
from viscopade.kernels import formulas
from viscopade.kernels.expressions import (
    Call,
    Expression,
    Literal,
    Name,
    Program,
    Statement,
    Word,
    by_powers,
    equal,
    gaps,
    power,
    powers,
)
from viscopade.kernels.formulas import named
from viscopade.kernels.rounding_bounds import Values


def slope_program(form: Powers) -> Program:
    """Return the assignments from y to the slope; p4 is 4 times the coefficient of y^4 in N, q4 -4 times that in D."""
    elastic, inverse, top = Name("elastic"), Name("inverse"), Name("top")
    n, d = by_powers("y", named("a", form.top)), by_powers("y", named("b", form.bottom))
    rising, falling = (_times_y(letter, exponents) for letter, exponents in (("p", form.top), ("q", form.bottom)))
    return (
        *powers("y", gaps(form.top) | gaps(form.bottom) | {SHIFT}),
        Statement("top", n),
        Statement("elastic", d),
        Statement("inverse", Literal("1.0") / (elastic + Name(f"y{SHIFT}") * top)),
        Statement("rising", (Literal(f"{SHIFT}.0") * top + rising) * inverse),
        Statement("falling", falling * inverse),
        Statement("slope", elastic * inverse * Name("rising") + top * inverse * Name("falling")),
    )


def _times_y(letter: str, exponents: tuple[int, ...]) -> Expression:
    """Return y times the derivative of a polynomial."""
    if len(exponents) == 1:
        return Literal("0.0")
    lowest, rest = exponents[1], named(letter, exponents[1:])
    return power("y", lowest) * by_powers("y", tuple((k - lowest, name) for k, name in rest))


def along() -> dict[str, Expression]:
    """Return d eps/d speed and d eps/d beta of the slope, by name; a product of 0 and infinity is its limit, 0."""
    speed, beta, slope = Name("speed"), Name("beta"), Name("slope")
    along_speed = -slope * beta * Call("pow", (speed, Literal("-0.8"))) / Literal("30.0")
    along_beta = -slope * Call("pow", (speed, Literal("0.2"))) / Literal("6.0")
    return {
        "along_speed": _or_zero(_is_zero(beta) | _is_zero(slope), along_speed),
        "along_beta": _or_zero(_is_zero(slope), along_beta),
    }


def _is_zero(number: Expression) -> Expression:
    return equal(number, Word(0, pattern=False))


def _or_zero(condition: Expression, value: Expression) -> Expression:
    return Call("where", (condition, formulas.ZERO, value))


def derivatives() -> dict[str, tuple[Expression, Expression]]:
    """Return the derivatives of each function with respect to speed and beta, given those of eps.

    As eps is a function of beta^5 speed, speed d eps/d speed = beta d eps/d beta/5, which is not infinity times 0.
    """
    eps, speed, beta, along_speed, along_beta = map(Name, ("eps", "speed", "beta", "along_speed", "along_beta"))
    of_dissipation = -Literal("2.0") * eps
    return {
        "restitution": (along_speed, along_beta),
        "rebound": (
            eps + _or_zero(_is_zero(along_beta), along_beta * beta / Literal("5.0")),
            _or_zero(_is_zero(along_beta), speed * along_beta),
        ),
        "dissipation": (of_dissipation * along_speed, of_dissipation * along_beta),
    }


def slope_constants(form: Powers, a: Values, b: Values, kind: Format) -> dict[str, float]:
    """Return the constants of the program besides the coefficients, rounded to the format."""
    rising = {f"p{k}": k * Fraction(c) for k, c in zip(form.top[1:], a[1:], strict=True)}
    falling = {f"q{k}": -k * Fraction(c) for k, c in zip(form.bottom[1:], b[1:], strict=True)}
    return {name: kind.nearest(c) for name, c in (rising | falling).items()}
