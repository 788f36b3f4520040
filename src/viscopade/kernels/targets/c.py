"""C headers of quotients and inverse kernels: C99, also valid C++ from C++98 on; they need math.h only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from textwrap import wrap
from typing import Any

from viscopade.arithmetic.formats import DOUBLE, FLOAT, FORMATS
from viscopade.generated import WIDTH, comment, template
from viscopade.kernels.forms.lacunary_kernels import HalfLineKernel, InverseKernel, LacunaryKernel
from viscopade.kernels.forms.quotient import Quotient
from viscopade.kernels.targets import bodies
from viscopade.kernels.targets.bodies import Language
from viscopade.kernels.targets.syntax import PRELUDE, constant_of_c, of_c
from viscopade.kernels.targets.wording import distinct, head_of

_LANGUAGES = [Language(form, of_c(form), partial(constant_of_c, form=form)) for form in (DOUBLE, FLOAT)]


def render(kernels: Sequence[Quotient | InverseKernel], command: str) -> str:
    """Return the text of a header with functions of type double and float for every kernel.

    The float functions of a kernel are left out, with a comment that says why, where a coefficient is not a normal
    number of type float, the sums cannot be kept below its largest number, or nothing is proven in that type.

    Parameters
    ----------
    kernels : sequence of Quotient, or of InverseKernel
        At least one, no two of the same name.
    command : str
        The command line that makes the file.

    Raises
    ------
    ValueError
        If a kernel does not fit type double either, or `command` is not one line.
    """
    blocks = [_block(kernel, _LANGUAGES) for kernel in distinct(kernels)]
    types = [[FORMATS[variant["type"]] for variant in block["variants"]] for block in blocks]
    forms = [form for form in FORMATS.values() if any(form in of for of in types)]
    words = head_of(kernels, command, forms)
    return template(__name__, f"{kernels[0].kind}.h.jinja").render(
        words,
        head=comment(words["lines"], " *"),
        blocks=blocks,
        types=list(map(_type, _LANGUAGES)),
        prelude=PRELUDE,
        has_ends=kernels[0].of_speed or any(block["warning"] for block in blocks),
    )


def half_line_functions(kernels: Sequence[HalfLineKernel]) -> str:
    """Return v* of speed and beta, and half-line kernels of v* in type double, without a header's beginning."""
    double = [replace(kernel, variants=(kernel.variant(DOUBLE),), missing=()) for kernel in kernels]
    blocks = [_block(kernel, _LANGUAGES[:1]) for kernel in double]
    return template(__name__, "functions.h.jinja").render(
        blocks=blocks, types=list(map(_type, _LANGUAGES)), of_speed=True
    )


def _block(kernel: Quotient | LacunaryKernel, languages: Sequence[Language]) -> dict[str, Any]:
    variants, reasons = [], []
    for language in languages:
        try:
            variants.append({**_type(language), **bodies.of_kernel(kernel, language)})
        except ValueError as error:
            if language.form == DOUBLE:
                raise
            reasons += wrap(f"There are no functions of type {language.form.name}: {error}.", WIDTH)
    return {
        "kernel": kernel,
        "proven": [line for fact in kernel.proven for line in wrap(fact, WIDTH)],
        "guard": f"VISCOPADE_{kernel.name.upper()}",
        "variants": variants,
        "warning": _warning(kernel) if isinstance(kernel, Quotient) else None,
        "missing": reasons,
    }


def _type(language: Language) -> dict[str, object]:
    """Return what the templates need of a type."""
    form = language.form
    nan = f'nan{form.suffix}("")'
    return {"type": form.name, "suffix": form.suffix, "nan": nan, **bodies.of_speed(language)}


def _warning(kernel: Quotient) -> str | None:
    if kernel.end is not None:
        return "from there on, what these functions return is NOT a coefficient of restitution."
    return None if kernel.interval is None else "outside this interval nothing is known of the error."
