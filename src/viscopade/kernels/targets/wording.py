"""Common text of all languages: the sentences at the head of a file, and names that last."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from textwrap import wrap
from typing import Any, TypeVar

from viscopade.arithmetic.formats import Format
from viscopade.generated import END_CONDITION, END_CONDITION_WITHOUT_DELAY, WIDTH, marker_line
from viscopade.kernels.forms.kernel import Kernel
from viscopade.kernels.forms.lacunary_kernels import SPELLING, InverseKernel
from viscopade.kernels.forms.quotient import PadeKernel, Quotient
from viscopade.kernels.v_star import assumed, stated
from viscopade.theory.law import VISCOELASTIC, Law

NO_BOUND = "Away from v* = 0 no bound of the error is claimed in this file."

PROVEN = (
    "proven: by ball arithmetic on a subdivision of the interval, with the exact eps enclosed; the rounding is that "
    "of the order of evaluation below (to nearest, with or without fused multiply-add), and adds to the error"
)

SAMPLED = (
    "sampled: compared with the exact eps at points of the interval, the largest error being stated; nothing is proven"
)

_PADE = "for the Pade approximant [M/N]"
_LETTERS = "(p stands for the decimal point, m for the minus of an exponent)"
_QUOTIENTS = {
    "pade_M_N": f"{_PADE}.",
    "pade_M_N_aA_bB": f"{_PADE} of the law with the exponents a = A and b = B (o stands for the bar of a fraction).",
    "minimax_M_N_vV": f"for the best approximant [M/N] up to v* = V, or vLtoV from v* = L on {_LETTERS}.",
    "minimax_vV_B": "for the cheapest best approximant up to v* = V, or vLtoV from v* = L on, B being the accuracy "
    f"asked for {_LETTERS}.",
}
"""By the form of the functions' names, what they stand for."""
_INVERSES = (
    "NAME is inverse_B for a kernel for 0 < eps <= 1, inverse_eE_B for one for E <= eps <= 1, B being the accuracy "
    "asked for"
)

AnyKernel = TypeVar("AnyKernel", bound=Kernel)


def at_least_one(kernels: Sequence[object]) -> None:
    """Refuse an empty sequence."""
    if not kernels:
        raise ValueError("no kernel is asked for: accepted is at least one")


def distinct(kernels: Sequence[AnyKernel]) -> tuple[AnyKernel, ...]:
    """Return the kernels as a tuple; refuse an empty sequence and repeated names."""
    at_least_one(kernels)
    names = [kernel.name for kernel in kernels]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"the kernel {name} is asked for twice: accepted is each kernel once")
    return tuple(kernels)


def head_of(kernels: Sequence[Quotient | InverseKernel], command: str, forms: Sequence[Format]) -> dict[str, Any]:
    """Return what the templates of C and Python need for a file's head; `forms` are the types of its functions."""
    quotients = [kernel for kernel in kernels if isinstance(kernel, Quotient)]
    if quotients:
        lines, names = [*preamble(quotients, command), *speed_note(quotients, forms)], quotient_names(quotients)
    else:
        inverses = [kernel for kernel in kernels if isinstance(kernel, InverseKernel)]
        lines, names = inverse_preamble(inverses, command), wrap(f"{_INVERSES} {SPELLING}.", WIDTH)
    return {
        "lines": lines,
        "kind": kernels[0].kind,
        "example": kernels[-1].name,
        "names": names,
        "of_speed": kernels[0].of_speed,
        "variable": variable(kernels[0].law),
    }


def kernel_lines(name: str, facts: Iterable[str]) -> list[str]:
    """Return the lines on a kernel at the head of a file."""
    indent = " " * 4
    lines = (wrap(fact, WIDTH, initial_indent=indent, subsequent_indent=2 * indent) for fact in facts)
    return [name, *(line for part in lines for line in part)]


# --- files of quotients -----------------------------------------------------------------------------------------------


def preamble(kernels: Sequence[Quotient], command: str) -> list[str]:
    """Return the lines that begin every file of quotients, without comment marks."""
    chosen = distinct(kernels)
    law = chosen[0].law
    of_eps = [
        "The coefficient of normal restitution eps of two viscoelastic spheres as a rational function of",
        "v* = beta^(1/2) v^(1/10), where v is the normal component of the impact velocity:",
    ]
    return [
        marker_line(command),
        "",
        *(of_eps if law == VISCOELASTIC else _equation_lines(law)),
        "",
        "    [m/n](v*) = (a_0 + a_1 v* + ... + a_m v*^m) / (b_0 + b_1 v* + ... + b_n v*^n).",
        "",
        *wrap(f"End condition: {end_condition(law)}.", WIDTH),
        "",
        *(line for kernel in chosen for line in kernel_lines(kernel.label, kernel.facts)),
        "",
        *wrap(bound_text(kernels), WIDTH),
    ]


def speed_note(kernels: Sequence[Quotient], forms: Sequence[Format]) -> list[str]:
    """Return the lines on functions of the speed in a file of quotients; none if no error of theirs is proven."""
    if not any(kernel.bounds and kernel.of_speed for kernel in kernels):
        return []
    return ["", *wrap(stated(forms), WIDTH), "", *wrap(f"{assumed('pow')}.", WIDTH)]


def quotient_names(kernels: Sequence[Quotient]) -> list[str]:
    """Return the lines that explain the names of quotients."""
    patterns = {kernel.pattern for kernel in kernels}
    lines = (wrap(f"NAME is {form} {what}", WIDTH) for form, what in _QUOTIENTS.items() if form in patterns)
    return [line for part in lines for line in part]


def bound_text(kernels: Sequence[Quotient]) -> str:
    """Return the sentence on the error bounds."""
    if any(isinstance(kernel, PadeKernel) and kernel.sampled for kernel in kernels):
        return f"{SAMPLED}."
    return f"{PROVEN}." if any(kernel.bounds for kernel in kernels) else NO_BOUND


# --- files of inverse kernels -----------------------------------------------------------------------------------------


def inverse_preamble(kernels: Sequence[InverseKernel], command: str) -> list[str]:
    """Return the lines that begin a file of inverse kernels."""
    chosen = distinct(kernels)
    spheres = [
        "v* = beta^(1/2) v^(1/10) of two viscoelastic spheres, where v is the normal component of the impact",
        "velocity, as a function of the coefficient of normal restitution eps: quotients of polynomials in which",
        "only some powers of a root y occur.",
    ]
    return [
        marker_line(command),
        "",
        *spheres,
        "",
        *wrap(f"End condition: {END_CONDITION}.", WIDTH),
        "",
        *(line for kernel in chosen for line in kernel_lines(kernel.name, kernel.facts)),
        "",
        *wrap(f"{PROVEN}.", WIDTH),
        "",
        *wrap(f"{assumed('cbrt and pow')}.", WIDTH),
    ]


# --- laws -------------------------------------------------------------------------------------------------------------


def _equation_lines(law: Law) -> list[str]:
    """Return the lines that say what a law is."""
    return [
        "The coefficient of normal restitution eps of the law of contact",
        "",
        f"    m xi'' + k xi^a + c xi^b xi' = 0,    a = {law.elastic}, b = {law.damping},",
        "",
        "with the effective mass m and the normal component v of the impact velocity, as a rational function of",
        "",
        f"    {variable(law)},    kappa = {law.kappa_text}:",
    ]


def variable(law: Law) -> str:
    """Return v* by kappa, as a part of a sentence."""
    return "v* = kappa" if law.d == 1 else f"v* = kappa^(1/{law.d})"


def end_condition(law: Law) -> str:
    """Return the end condition of a law as a sentence."""
    return END_CONDITION if law.delayed else END_CONDITION_WITHOUT_DELAY
