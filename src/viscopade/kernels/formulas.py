r"""The formulas of kernels, each written once, with one program for small and one for large arguments.

Quotients of polynomials in v*, with u = 1/v* where powers of v* might overflow:

    eps = N(v*)/D(v*).

Of a speed and a damping, v* = beta^(1/2) speed^(1/10), and beta = v*^2/speed^(1/5). Of a pair of bodies
beta = 3/2 A (rho/m_eff)^(2/5), rho = 4/3 E_eff sqrt(R_eff), with A the dissipative constant, a time.

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
"""Of coefficients: a double, a fraction, a ball."""
ZERO, ONE = Literal("0.0"), Literal("1.0")


def letter_terms(letter: str, exponents: Iterable[int]) -> Terms:
    """Return a polynomial whose coefficients have the letter and the exponent for a name: a4 y^4."""
    return tuple((k, f"{letter}{k}") for k in exponents)


def _mirrored(polynomial: Terms) -> Terms:
    """Return u^degree times the polynomial of 1/u: exponent k becomes degree - k."""
    return tuple((polynomial[-1][0] - k, name) for k, name in reversed(polynomial))


def constants(exponents: Powers, a: Sequence[Number], b: Sequence[Number]) -> dict[str, Number]:
    """Return the coefficients of a lacunary quotient by name: a4 is the coefficient of y^4 in N, b4 the one in D.

    `exponents` has those of y in N (`top`) and D (`bottom`), and a and b the coefficients in their order.
    """
    tops = {f"a{k}": c for k, c in zip(exponents.top, a, strict=True)}
    return tops | {f"b{k}": c for k, c in zip(exponents.bottom, b, strict=True)}


NOT_NEGATIVE = Name("v_star") >= ZERO
"""The condition that there is a function of v*: it is not negative, and not NaN."""


def within(name: str, low: Expression, high: Expression) -> Expression:
    """Return the condition that a number is in an interval, and not NaN."""
    return both(Name(name) >= low, Name(name) <= high)


# --- v*, the speed and beta -------------------------------------------------------------------------------------------


def v_star_branch() -> CodeBranch:
    """Return v* of the speed and beta; of a negative speed there is none, though pow(-infinity, 0.1) is +infinity."""
    # v* = beta^(1/2) speed^(1/10) (the paper's Eq. 8)
    speed = Name("speed")
    v_star = Call("sqrt", (Name("beta"),)) * Call("pow", (speed, Literal("0.1")))
    return CodeBranch(speed >= ZERO, (), {"v_star": v_star})


def beta_of_radii_branch() -> CodeBranch:
    """Return beta of two bodies with given radii, from the paper's Eq. 8.

    Inputs are the first radius, `first`; the quotient of the first and the second, `ratio`; that of the densities,
    `densities`; and `of_wall`, which is beta times the first radius for a wall as the second body. Both quotients are 0
    for a wall.
    """
    # beta = 3/2 A (rho/m_eff)^(2/5), and rho goes like R_eff^(1/2). With R_eff = first/(1 + ratio) and
    # 1/m_eff = (1 + densities ratio^3)/m_first this is beta of the wall, which goes like 1/first, times shape^(2/5).
    ratio, shape = Name("ratio"), Name("shape")
    program = (Statement("shape", (ONE + Name("densities") * ratio * ratio * ratio) / Call("sqrt", (ONE + ratio,))),)
    beta = Name("of_wall") / Name("first") * Call("pow", (shape, Literal("0.4")))
    return CodeBranch(None, program, {"beta": beta})


def beta_branch() -> CodeBranch:
    """Return beta of v* and a positive speed: v*^2/speed^(1/5)."""
    speed, v_star = Name("speed"), Name("v_star")
    return CodeBranch(speed > ZERO, (), {"beta": v_star * v_star / Call("pow", (speed, Literal("0.2")))})


# --- from materials to beta -------------------------------------------------------------------------------------------


def _all_positive(*names: str) -> Expression:
    """Return the condition that numbers are above 0, and not NaN; infinity is."""
    condition, *others = (Name(name) > ZERO for name in names)
    for other in others:
        condition = both(condition, other)
    return condition


def effective_modulus_branch() -> CodeBranch:
    """Return E_eff of the Young moduli E1, E2 and the Poisson ratios nu1, nu2, > -1 and <= 1/2, of two bodies."""
    # 1/E_eff = (1 - nu1^2)/E1 + (1 - nu2^2)/E2; (1 - nu) (1 + nu) loses no digits near nu = -1.
    compliances = [(ONE - Name(f"nu{n}")) * (ONE + Name(f"nu{n}")) / Name(f"E{n}") for n in (1, 2)]
    accepted = _all_positive("E1", "E2")
    for ratio in (Name("nu1"), Name("nu2")):
        accepted = both(accepted, both(ratio > Literal("-1.0"), ratio <= Literal("0.5")))
    return CodeBranch(accepted, (), {"E_eff": ONE / (compliances[0] + compliances[1])})


def reduced_branch(first: str, second: str, result: str) -> CodeBranch:
    """Return the effective radius or mass of two radii or masses of these names; that of a wall is infinite."""
    # R_eff = R1 R2/(R1 + R2), as 1/R_eff = 1/R1 + 1/R2, where infinity leaves the other one.
    return CodeBranch(
        _all_positive(first, second), (), {result: ONE / (ONE / Name(first) + ONE / Name(second))}
    )  # fmt: skip


def rho_branch() -> CodeBranch:
    """Return rho of E_eff and R_eff: the force of Hertz is rho times (compression)^(3/2)."""
    # rho = 4/3 E_eff sqrt(R_eff) (the paper's Eq. 3)
    four_thirds = Literal("4.0") / Literal("3.0")
    rho = four_thirds * Name("E_eff") * Call("sqrt", (Name("R_eff"),))
    return CodeBranch(_all_positive("E_eff", "R_eff"), (), {"rho": rho})


def beta_of_material_branch() -> CodeBranch:
    """Return beta of the dissipative constant A >= 0, rho and m_eff of a pair."""
    # beta = 3/2 A (rho/m_eff)^(2/5) (the paper's Eq. 8), power by power, because rho/m_eff may overflow in type float.
    two_fifths = Literal("0.4")
    powers_quotient = Call("pow", (Name("rho"), two_fifths)) / Call("pow", (Name("m_eff"), two_fifths))
    accepted = both(Name("A") >= ZERO, _all_positive("rho", "m_eff"))
    return CodeBranch(accepted, (), {"beta": Literal("1.5") * Name("A") * powers_quotient})


# --- quotients of polynomials in v* -----------------------------------------------------------------------------------


def dense(**polynomials: Sequence[Number]) -> dict[str, Number]:
    """Return the coefficients of polynomials by letter and exponent, without those that are zero."""
    return {f"{letter}{i}": c for letter, values in polynomials.items() for i, c in enumerate(values) if c}


def epsilon_branches(coefficients: Mapping[str, object]) -> tuple[CodeBranch, CodeBranch]:
    """Return the programs of eps = N/D: in v_star, and in u = 1/v_star, where powers of v_star might overflow.

    `coefficients` has those of N as a0, a1, …, those of D as b0, b1, …, and, if 1 - N/D vanishes like v*^2, those of
    (D - N)/v*^2 as d0, d1, …. Only the names count; the values are given where a program is run.
    """
    top, bottom = _terms(coefficients, "a"), _terms(coefficients, "b")
    ratio = Name("numerator") / Name("denominator")

    # In v*: N/D, and for proofs "loss_ratio", (1 - eps)/v*^2 = ((D - N)/v*^2)/D.
    results: dict[str, Expression] = {"epsilon": ratio}
    if loss := _terms(coefficients, "d"):
        results["loss_ratio"] = by_horner("v_star", loss) / Name("denominator")
    sums = (Statement("numerator", by_horner("v_star", top)), Statement("denominator", by_horner("v_star", bottom)))
    near = CodeBranch(None, sums, results)

    # In u: N = v*^m N^(u) with the mirrored polynomial N^(u) = u^m N(1/u), likewise D, so that N/D is N^/D^ times
    # v*^(m - n): a product for each power, by v_star or by u. Each lies between N^/D^ and the result, so it is a normal
    # number if these are.
    degree = top[-1][0] - bottom[-1][0]
    for _ in range(abs(degree)):
        ratio = ratio * Name("v_star" if degree > 0 else "u")
    program = (
        Statement("u", ONE / Name("v_star")),
        Statement("numerator", by_horner("u", _mirrored(top))),
        Statement("denominator", by_horner("u", _mirrored(bottom))),
    )
    return near, CodeBranch(None, program, {"epsilon": ratio})


def losses(a: Sequence[Any], b: Sequence[Any]) -> dict[str, Any]:
    """Return the coefficients d of (D - N)/v*^2 by name; none if 1 - N/D does not vanish like v*^2.

    `a` and `b` are those of N and D, ascending. Balls that overlap are taken for the same coefficient.
    """
    # The shorter one gets zeros of its own kind (fractions, balls): 0 times a coefficient.
    size = max(len(a), len(b))
    a, b = ([*values, *[0 * b[0]] * (size - len(values))] for values in (a, b))
    # D - N begins with v*^2 if a_0 = b_0 and a_1 = b_1.
    if any(c != d for c, d in zip(a[:2], b[:2], strict=True)):
        return {}
    return dense(d=[d - c for c, d in zip(a[2:], b[2:], strict=True)])


def _terms(coefficients: Mapping[str, object], letter: str) -> Terms:
    """Return the polynomial whose coefficients have the letter: (exponent, name), ascending."""
    return letter_terms(letter, sorted(int(name[1:]) for name in coefficients if name[0] == letter))


# --- lacunary quotients -----------------------------------------------------------------------------------------------


def half_line_branches(exponents: Powers) -> tuple[CodeBranch, CodeBranch]:
    """Return the programs for v* <= 1 and v* > 1; the input is v_star, the results epsilon and one_minus_epsilon.

    `exponents` has those of y = v*^(1/3) in N (`top`) and D (`bottom`).
    """
    v_star, w, u = Name("v_star"), Name("w"), Name("u")
    elastic, lost = Name("elastic"), Name("lost")
    # eps and 1 - eps are the shares of two positive sums, so that neither loses digits.
    results = {"epsilon": elastic / (elastic + lost), "one_minus_epsilon": lost / (elastic + lost)}
    top, bottom = letter_terms("a", exponents.top), letter_terms("b", exponents.bottom)

    # v* <= 1: elastic = D(y), lost = v*^2 N(y)
    near = (
        Statement("y", Call("cbrt", (v_star,))),
        *powers("y", _horner_powers(exponents)),
        Statement("elastic", by_powers("y", bottom)),
        Statement("lost", v_star * v_star * by_powers("y", top)),
    )
    loss_ratio = by_powers("y", top) / (elastic + lost)  # (1 - eps)/v*^2

    # v* > 1: both sums times u^deg N v*^-2, with deg N = deg D + 4 and v*^-2 = u^6: D(y) becomes u^10 D^(u), which is
    # w^3 u D^(u) with w = u^3, and v*^2 N(y) becomes N^(u).
    top, bottom = _mirrored(top), _mirrored(bottom)
    far = (
        Statement("w", ONE / v_star),
        Statement("u", Call("cbrt", (w,))),
        *powers("u", _horner_powers(exponents)),
        Statement("elastic", w * w * w * u * by_powers("u", bottom)),
        Statement("lost", by_powers("u", top)),
    )
    limit = by_powers("u", bottom) / (elastic + lost)  # eps v*^(10/3), as eps has the factor w^3 u = v*^(-10/3)
    return (
        CodeBranch(v_star <= ONE, near, results | {"loss_ratio": loss_ratio}),
        CodeBranch(None, far, results | {"limit": limit}),
    )


def inverse_branches(exponents: Powers) -> tuple[CodeBranch, CodeBranch]:
    """Return the programs for eps >= 1/2 and eps < 1/2.

    Inputs are epsilon and loss, which is 1 - epsilon; the result is v_star. `exponents` has those of y in N (`top`)
    and D (`bottom`).
    """
    epsilon, loss = Name("epsilon"), Name("loss")
    ratio, tenth = Name("top") / Name("bottom"), Literal("0.1")
    # y = (loss/epsilon)^(1/10), and v* = y^5 N(y)/D(y); SHIFT = 5 because 1 - eps goes like v*^2, so v* like y^5.
    near = CodeBranch(
        loss <= epsilon,
        (Statement("y", Call("pow", (loss / epsilon, tenth))), *_sums(exponents, "y", SHIFT)),
        {"v_star": power("y", SHIFT) * Name("top") / Name("bottom"), "ratio": ratio},
    )
    # u = 1/y: N(y) = y^deg N N^(u), so that v* = N^(u)/(u^rest D^(u)), rest = 5 + deg N - deg D.
    rest = SHIFT + exponents.top[-1] - exponents.bottom[-1]
    far = CodeBranch(
        None,
        (Statement("u", Call("pow", (epsilon / loss, tenth))), *_sums(exponents, "u", rest)),
        {"v_star": Name("top") / (power("u", rest) * Name("bottom"))}
        # v* goes like y^3, as eps goes like v*^(-10/3): only with deg D = deg N + 2 (DEGREES_LESS) has N^/D^ a limit.
        | ({"limit": ratio} if exponents.bottom[-1] - exponents.top[-1] == DEGREES_LESS else {}),
    )
    return near, far


def _horner_powers(exponents: Powers) -> set[int]:
    """Return the powers that Horner's rules for N and D multiply by; those of the mirrored polynomials are the same."""
    return gaps(exponents.top) | gaps(exponents.bottom)


def _sums(exponents: Powers, variable: str, shift: int) -> Program:
    """Return the assignments of `top` = N and `bottom` = D in the variable "y", or of the mirrored ones in "u".

    `exponents` has those of y in N and D. The variable's power `shift` is assigned, too, as v* has it as a factor.
    """
    top, bottom = letter_terms("a", exponents.top), letter_terms("b", exponents.bottom)
    if variable == "u":
        top, bottom = _mirrored(top), _mirrored(bottom)
    return (
        *powers(variable, _horner_powers(exponents) | {shift}),
        Statement("top", by_powers(variable, top)),
        Statement("bottom", by_powers(variable, bottom)),
    )


# --- dissipation ------------------------------------------------------------------------------------------------------


def lost_energy(epsilon: Expression, loss: Expression) -> dict[str, Expression]:
    """Return 1 - eps^2, the share of the energy that is lost, in three ways that lose no digits.

    "of_epsilon" needs eps alone, "of_loss" 1 - eps alone (`loss`), and "of_both" both.
    """
    # (1 - eps)(1 + eps), and with loss = 1 - eps: loss (2 - loss). Of both: below eps = 1/2 1 - eps^2 is above 3/4 and
    # has two roundings; from there on loss is the accurate factor.
    two, half = Literal("2.0"), Literal("0.5")
    return {
        "of_epsilon": (ONE - epsilon) * (ONE + epsilon),
        "of_loss": loss * (two - loss),
        "of_both": Select(epsilon < half, ONE - epsilon * epsilon, loss * (ONE + epsilon)),
    }


# --- w ----------------------------------------------------------------------------------------------------------------


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
    """Return the distance of the bits of 2^(e + number) and of 2^e, both normal numbers, as words."""
    # A word has the sign, the exponent, and below it the precision - 1 bits of the fraction.
    return Word(lambda form: number << (form.precision - 1))


def power_of_two(exponent: int) -> Word:
    """Return the bits of 2^exponent, a normal number."""
    # IEEE 754 stores exponent + largest (the bias), before precision - 1 bits of the fraction, which are 0.
    return Word(lambda form: (form.largest + exponent) << (form.precision - 1))


def count(number: int | Callable[[Format], int]) -> Word:
    """Return a word that counts."""
    return Word(number, pattern=False)


FRACTION = count(lambda form: form.precision - 1)
"""The number of bits of a number's fraction: the leading bit of the significand is not stored."""
OCTAVES = 128
"""Of w, in every speed table: 12.8 octaves of v*. A power of 2, so that the range is checked by a shift."""
