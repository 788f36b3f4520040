"""Common text of all languages: the sentences at the head of a file."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from textwrap import wrap
from typing import Protocol, TypeVar

from viscopade.arithmetic.formats import Format
from viscopade.generated import END_CONDITION, WIDTH, marker_line
from viscopade.kernels.forms.quotient import Quotient, law_name
from viscopade.theory.law import Law

NO_BOUND = "Away from v* = 0 no bound of the error is claimed in this file."

PROVEN = (
    "proven: by ball arithmetic on a subdivision of the interval, with the exact eps enclosed; the rounding is that "
    "of the order of evaluation below (to nearest, with or without fused multiply-add), and adds to the error"
)

OF_EXPONENTS = "of the law with the exponents a = A and b = B (o stands for the bar of a fraction)"

OF_V_STAR = ("The coefficient of normal restitution eps", ", as a rational function of", ":")
OF_EPSILON = ("v* as a function of the coefficient of normal restitution eps", ". Here", ".")

AnyQuotient = TypeVar("AnyQuotient", bound="Quotient")


def distinct(kernels: Sequence[AnyQuotient]) -> tuple[AnyQuotient, ...]:
    """Return the kernels as a tuple; refuse an empty sequence and repeated names."""
    names = [kernel.name for kernel in kernels]
    if not names:
        raise ValueError("no kernel is asked for: accepted is at least one")
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"the kernel {name} is asked for twice: accepted is each kernel once")
    return tuple(kernels)


def preamble(kernels: Sequence[Quotient], command: str) -> list[str]:
    """Return the lines that begin every generated file, without comment marks."""
    law = kernels[0].law if kernels else None
    return [
        marker_line(command),
        "",
        *_of_eps(law),
        "",
        "    [m/n](v*) = (a_0 + a_1 v* + ... + a_m v*^m) / (b_0 + b_1 v* + ... + b_n v*^n).",
        "",
        *wrap(f"End condition: {end_condition(law)}.", WIDTH),
        "",
        *(line for kernel in distinct(kernels) for line in _summary(kernel)),
        "",
        *wrap(bound_text(kernels), WIDTH),
    ]


def _of_eps(law: Law | None) -> list[str]:
    """Return the lines that say what eps is of."""
    if law is None or not law_name(law):
        return [
            "The coefficient of normal restitution eps of two viscoelastic spheres as a rational function of",
            "v* = beta^(1/2) v^(1/10), where v is the normal component of the impact velocity:",
        ]
    return equation_lines(law)


def equation_lines(law: Law, words: tuple[str, str, str] = OF_V_STAR) -> list[str]:
    """Return the lines that say what a law is, in which `words` say what the file has."""
    begin, middle, end = words
    return [
        f"{begin} of the law of contact",
        "",
        f"    m xi'' + k xi^a + c xi^b xi' = 0,    a = {law.elastic}, b = {law.damping},",
        "",
        f"with the effective mass m and the normal component v of the impact velocity{middle}",
        "",
        f"    {variable(law)},    kappa = {law.kappa_text}{end}",
    ]


def variable(law: Law) -> str:
    """Return v* by kappa, as a part of a sentence."""
    return "v* = kappa" if law.d == 1 else f"v* = kappa^(1/{law.d})"


def takes_speed(kernel: OfLaw) -> bool:
    """Return whether a kernel has functions of speed and beta besides those of v*: the paper's law has."""
    return not law_name(kernel.law)


def end_condition(law: Law | None) -> str:
    """Return the end condition of a law as a sentence."""
    if law is None or law.delayed:
        return END_CONDITION
    return "contact ends when the force vanishes, which by this law is where the compression x returns to 0"


class OfLaw(Protocol):
    """A kernel of a law."""

    @property
    def law(self) -> Law:
        """The law of contact."""


class Named(Protocol):
    """A kernel whose functions have a name that may change, and one that lasts."""

    @property
    def name(self) -> str:
        """The end of the functions' names."""

    @property
    def lasting_name(self) -> str:
        """The end of the names that do not change when a better kernel takes this one's place."""


def functions_of(kernel: Quotient, forms: Iterable[Format]) -> list[str]:
    """Return the names of a quotient's functions in C and Python, with {} for that of the kernel."""
    return [
        f"{function}_{{}}{form.suffix}"
        for form in forms
        for function, given in (
            ("epsilon", True),
            ("epsilon_derivative", kernel.derivative(form)),
            ("restitution", takes_speed(kernel)),
        )
        if given
    ]


def lasting(functions: Iterable[tuple[Named, Sequence[str]]]) -> list[list[tuple[str, str]]]:
    """Return pairs of a lasting name and today's by kernel, given its functions with {} in place of its name."""
    found: dict[str, list[tuple[str, str]]] = {}
    for kernel, patterns in functions:
        if kernel.lasting_name != kernel.name:
            pairs = [(pattern.format(kernel.lasting_name), pattern.format(kernel.name)) for pattern in patterns]
            found.setdefault(kernel.lasting_name, pairs)
    return list(found.values())


def lasting_lines(kernels: Sequence[Named]) -> list[str]:
    """Return the sentence on lasting names for the head of a file, wrapped; none if all names last."""
    pairs = {kernel.lasting_name: kernel.name for kernel in reversed(kernels) if kernel.lasting_name != kernel.name}
    if not pairs:
        return []
    names = ", ".join(f"{lasting_name} (now {name})" for lasting_name, name in reversed(pairs.items()))
    text = f"NAME may also be {names}: a name that stays when a better kernel takes the place of today's."
    return ["", *wrap(text, WIDTH, break_on_hyphens=False)]


def bound_text(kernels: Sequence[Quotient]) -> str:
    """Return the sentence on the error bounds."""
    return f"{PROVEN}." if any(kernel.bounds for kernel in kernels) else NO_BOUND


def _summary(kernel: Quotient) -> list[str]:
    """Return the lines on one kernel in the preamble."""
    indent = " " * 4
    lines = (wrap(fact, WIDTH, initial_indent=indent, subsequent_indent=2 * indent) for fact in kernel.facts)
    return [kernel.label, *(line for part in lines for line in part)]
