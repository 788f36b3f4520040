r"""The formulas of kernels, each written once, with one program for small and one for large arguments.

Quotients of polynomials in v*, with u = 1/v* where powers of v* might overflow:

    eps = N(v*)/D(v*).

Of a speed and a damping, v* = beta^(1/2) speed^(1/10), and beta = v*^2/speed^(1/5).

Half-line kernels, with y = v*^(1/3), w = 1/v*, u = 1/y and mirrored polynomials N^(u) = u^deg N(1/u):

    v* <= 1:    eps = D(y)/(D(y) + v*^2 N(y)),           1 - eps = v*^2 N(y)/(…)
    v* > 1:     eps = w^3 u D^(u)/(w^3 u D^(u) + N^(u)),  1 - eps = N^(u)/(…)

so that no power overflows. Inverse kernels, with y = ((1 - eps)/eps)^(1/10), u = 1/y:

    v* = y^5 N(y)/D(y)    and for eps < 1/2, where y has no end:    v* = N^(u)/(u^j D^(u)),    j = 5 + deg N - deg D.

Besides the results of exported code the programs have those that proofs need: "loss_ratio" is (1 - eps)/v*^d, "ratio"
is N/D, and "limit" is what is left of eps v*^k, or of v* y^(-j), for large v*.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, TypeVar

from viscopade.approximation.inverse import DEGREES_LESS, SHIFT
from viscopade.approximation.lacunary import Powers
from viscopade.arithmetic.formats import Format
from viscopade.kernels.expressions import (
    Call,
    CodeBranch,
    Expression,
    Literal,
    Name,
    Program,
    Select,
    Statement,
    Terms,
    Word,
    both,
    by_horner,
    by_powers,
    gaps,
    power,
    powers,
)

Number = TypeVar("Number")
ZERO, ONE = Literal("0.0"), Literal("1.0")


def letter_terms(letter: str, exponents: Iterable[int]) -> Terms:
    """Return a polynomial whose coefficients have the letter and the exponent for a name: a4 y^4."""
    return tuple((k, f"{letter}{k}") for k in exponents)


def _mirrored(polynomial: Terms) -> Terms:
    """Return u^degree times the polynomial of 1/u."""
    return tuple((polynomial[-1][0] - k, name) for k, name in reversed(polynomial))


def constants(form: Powers, a: Sequence[Number], b: Sequence[Number]) -> dict[str, Number]:
    """Return the coefficients of a lacunary quotient by name: a4 is the coefficient of y^4 in N, b4 the one in D."""
    tops = {f"a{k}": c for k, c in zip(form.top, a, strict=True)}
    return tops | {f"b{k}": c for k, c in zip(form.bottom, b, strict=True)}


NOT_NEGATIVE = Name("v_star") >= ZERO
"""The condition that there is a function of v*: it is not negative, and not NaN."""


def within(name: str, low: Expression, high: Expression) -> Expression:
    """Return the condition that a number is in an interval, and not NaN."""
    return both(Name(name) >= low, Name(name) <= high)


# --- v*, the speed and beta -------------------------------------------------------------------------------------------


def v_star_branch() -> CodeBranch:
    """Return v* of the speed and beta; of a negative speed there is none, though pow(-infinity, 0.1) is +infinity."""
    speed = Name("speed")
    v_star = Call("sqrt", (Name("beta"),)) * Call("pow", (speed, Literal("0.1")))
    return CodeBranch(speed >= ZERO, (), {"v_star": v_star})


def beta_of_radii_branch() -> CodeBranch:
    """Return beta of two bodies with given radii, from eq:betadef.

    Inputs are the first radius, `first`; the quotient of the first and the second, `ratio`; that of the densities,
    `densities`; and `of_wall`, which is beta times the first radius for a wall as the second body. Both quotients are 0
    for a wall.
    """
    ratio, shape = Name("ratio"), Name("shape")
    program = (Statement("shape", (ONE + Name("densities") * ratio * ratio * ratio) / Call("sqrt", (ONE + ratio,))),)
    beta = Name("of_wall") / Name("first") * Call("pow", (shape, Literal("0.4")))
    return CodeBranch(None, program, {"beta": beta})


def beta_branch() -> CodeBranch:
    """Return beta of v* and a positive speed."""
    speed, v_star = Name("speed"), Name("v_star")
    return CodeBranch(speed > ZERO, (), {"beta": v_star * v_star / Call("pow", (speed, Literal("0.2")))})


# --- quotients of polynomials in v* -----------------------------------------------------------------------------------


def dense(**polynomials: Sequence[Number]) -> dict[str, Number]:
    """Return the coefficients of polynomials by letter and exponent, without those that are zero."""
    return {f"{letter}{i}": c for letter, values in polynomials.items() for i, c in enumerate(values) if c}


def epsilon_branches(given: Mapping[str, object]) -> tuple[CodeBranch, CodeBranch]:
    """Return the programs of eps = N/D with these coefficients a and b: in v_star, and in u = 1/v_star."""
    top, bottom = _terms(given, "a"), _terms(given, "b")
    ratio = Name("numerator") / Name("denominator")
    near: dict[str, Expression] = {"epsilon": ratio}
    if loss := _terms(given, "d"):  # of (D - N)/v*^2
        near["loss_ratio"] = by_horner("v_star", loss) / Name("denominator")
    return _in_v_star(top, bottom, near), _in_u(top, bottom, ratio, top[-1][0] - bottom[-1][0])


def losses(a: Sequence[Any], b: Sequence[Any]) -> dict[str, Any]:
    """Return the coefficients d of (D - N)/v*^2; none if 1 - N/D does not vanish like v*^2.

    Balls that overlap are taken for the same coefficient.
    """
    size = max(len(a), len(b))
    a, b = ([*values, *[0 * b[0]] * (size - len(values))] for values in (a, b))
    if any(c != d for c, d in zip(a[:2], b[:2], strict=True)):
        return {}
    return dense(d=[d - c for c, d in zip(a[2:], b[2:], strict=True)])


def _terms(given: Mapping[str, object], letter: str) -> Terms:
    return letter_terms(letter, sorted(int(name[1:]) for name in given if name[0] == letter))


def _in_v_star(top: Terms, bottom: Terms, results: Mapping[str, Expression]) -> CodeBranch:
    sums = (Statement("numerator", by_horner("v_star", top)), Statement("denominator", by_horner("v_star", bottom)))
    return CodeBranch(None, sums, results)


def _in_u(top: Terms, bottom: Terms, ratio: Expression, degree: int) -> CodeBranch:
    """Return a quotient in powers of u = 1/v*, times v*^degree."""
    for _ in range(abs(degree)):
        ratio = ratio * Name("v_star" if degree > 0 else "u")
    program = (
        Statement("u", ONE / Name("v_star")),
        Statement("numerator", by_horner("u", _mirrored(top))),
        Statement("denominator", by_horner("u", _mirrored(bottom))),
    )
    return CodeBranch(None, program, {"epsilon": ratio})


# --- lacunary quotients -----------------------------------------------------------------------------------------------


def half_line_branches(form: Powers) -> tuple[CodeBranch, CodeBranch]:
    """Return the programs for v* <= 1 and v* > 1; the input is v_star, the results epsilon and one_minus_epsilon."""
    v_star, w, u = Name("v_star"), Name("w"), Name("u")
    elastic, lost = Name("elastic"), Name("lost")
    results = {"epsilon": elastic / (elastic + lost), "one_minus_epsilon": lost / (elastic + lost)}
    top, bottom = letter_terms("a", form.top), letter_terms("b", form.bottom)
    near = (
        Statement("y", Call("cbrt", (v_star,))),
        *powers("y", _needed(form)),
        Statement("elastic", by_powers("y", bottom)),
        Statement("lost", v_star * v_star * by_powers("y", top)),
    )
    top, bottom = _mirrored(top), _mirrored(bottom)
    far = (
        Statement("w", ONE / v_star),
        Statement("u", Call("cbrt", (w,))),
        *powers("u", _needed(form)),
        Statement("elastic", w * w * w * u * by_powers("u", bottom)),
        Statement("lost", by_powers("u", top)),
    )
    loss_ratio = by_powers("y", letter_terms("a", form.top)) / (elastic + lost)
    limit = by_powers("u", bottom) / (elastic + lost)
    return (
        CodeBranch(v_star <= ONE, near, results | {"loss_ratio": loss_ratio}),
        CodeBranch(None, far, results | {"limit": limit}),
    )


def inverse_branches(form: Powers) -> tuple[CodeBranch, CodeBranch]:
    """Return the programs for eps >= 1/2 and eps < 1/2.

    Inputs are epsilon and loss, which is 1 - epsilon; the result is v_star.
    """
    epsilon, loss = Name("epsilon"), Name("loss")
    ratio, tenth = Name("top") / Name("bottom"), Literal("0.1")
    near = CodeBranch(
        loss <= epsilon,
        (Statement("y", Call("pow", (loss / epsilon, tenth))), *_sums(form, "y", SHIFT)),
        {"v_star": power("y", SHIFT) * Name("top") / Name("bottom"), "ratio": ratio},
    )
    rest = SHIFT + form.top[-1] - form.bottom[-1]
    far = CodeBranch(
        None,
        (Statement("u", Call("pow", (epsilon / loss, tenth))), *_sums(form, "u", rest)),
        {"v_star": Name("top") / (power("u", rest) * Name("bottom"))}
        | ({"limit": ratio} if form.bottom[-1] - form.top[-1] == DEGREES_LESS else {}),
    )
    return near, far


def _needed(form: Powers) -> set[int]:
    return gaps(form.top) | gaps(form.bottom)


def _sums(form: Powers, variable: str, shift: int) -> Program:
    """Return the assignments of N and D, or of the mirrored ones in u."""
    top, bottom = letter_terms("a", form.top), letter_terms("b", form.bottom)
    if variable == "u":
        top, bottom = _mirrored(top), _mirrored(bottom)
    return (
        *powers(variable, _needed(form) | {shift}),
        Statement("top", by_powers(variable, top)),
        Statement("bottom", by_powers(variable, bottom)),
    )


# --- dissipation ------------------------------------------------------------------------------------------------------


def lost_energy(epsilon: Expression, loss: Expression) -> dict[str, Expression]:
    """Return 1 - eps^2 of eps, of 1 - eps, and of both, each of which has few roundings: no digits are lost."""
    two, half = Literal("2.0"), Literal("0.5")
    return {
        "of_epsilon": (ONE - epsilon) * (ONE + epsilon),
        "of_loss": loss * (two - loss),
        "of_both": Select(epsilon < half, ONE - epsilon * epsilon, loss * (ONE + epsilon)),
    }


# --- w ---------------------------------------------------------------------------------------------------


def fifth_power(square: str) -> Expression:
    """Return beta^5 from beta and its square, of this name."""
    return Name(square) * Name(square) * Name("beta")


def w_program() -> Program:
    """Return the assignments of w = beta^5 speed; beta^5 comes first, so that a compiler can move it out of loops."""
    beta = Name("beta")
    return Statement("square", beta * beta), Statement("w", fifth_power("square") * Name("speed"))


W_ACCEPTED = both(Name("speed") >= ZERO, Name("beta") >= ZERO)
"""The condition that there is a w: no argument is negative or NaN."""
W_BEYOND = Name("w") > Name("largest")
"""The condition that w is replaced by `largest`."""
W_CUT = Select(W_BEYOND, Name("largest"), Name("w"))
"""The w that compact kernels compute with."""


# --- bits of numbers --------------------------------------------------------------------------------------------------


def bits(number: Expression) -> Expression:
    """Return the bits of a number."""
    return Call("bits", (number,))


def from_bits(word: Expression) -> Expression:
    """Return the number with these bits."""
    return Call("from_bits", (word,))


def octaves(number: int) -> Word:
    """Return the distance of the bits of 2^(e + number) and of 2^e."""
    return Word(lambda form: number << (form.precision - 1))


def power_of_two(exponent: int) -> Word:
    """Return the bits of 2^exponent, a normal number."""
    return Word(lambda form: (form.largest + exponent) << (form.precision - 1))


def count(number: int | Callable[[Format], int]) -> Word:
    """Return a word that counts."""
    return Word(number, pattern=False)


FRACTION = count(lambda form: form.precision - 1)
"""The bits of a number's fraction."""
OCTAVES = 128
"""Of w, in every speed table: a power of 2, so that the range is checked by a shift."""
