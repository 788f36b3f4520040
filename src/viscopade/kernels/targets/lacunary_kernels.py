"""Code of lacunary kernels (half-line and inverse) in C and Python."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from textwrap import wrap
from typing import Any, cast

from viscopade.arithmetic.formats import DOUBLE, FORMATS, Format
from viscopade.generated import WIDTH, marker_line, template
from viscopade.kernels.expressions import CodeBranch
from viscopade.kernels.forms import formulas
from viscopade.kernels.forms.lacunary_kernels import (
    HALF_LINE,
    INVERSE,
    NAMES,
    SPELLING,
    InverseKernel,
    LacunaryKernel,
    LacunaryVariant,
)
from viscopade.kernels.forms.quotient import law_pattern
from viscopade.kernels.targets.syntax import MATH_MODULE, Syntax, constant_of_c, of_c, text
from viscopade.kernels.targets.wording import (
    OF_EPSILON,
    OF_EXPONENTS,
    PROVEN,
    distinct,
    end_condition,
    equation_lines,
    lasting,
    lasting_lines,
    takes_speed,
)
from viscopade.kernels.v_star import assumed, stated

_FUNCTIONS = {
    HALF_LINE: ("epsilon", "one_minus_epsilon", "restitution"),
    INVERSE: ("v_star", "v_star_from_loss", "beta"),
}
_OF_SPEED = ("restitution", "beta")

# --- text -------------------------------------------------------------------------------------------------------------


def render_c(kernels: Sequence[LacunaryKernel], command: str) -> str:
    """Return a C header with the functions of all kernels, in type double and, where proven, in type float.

    Parameters
    ----------
    kernels : sequence of HalfLineKernel or InverseKernel
        At least one, no two of the same name.
    command : str
        The command line that makes the file.

    Raises
    ------
    ValueError
        If there is no kernel, or one twice, or `command` is not one line.
    """
    chosen = _distinct(kernels)
    types = {variant.form.name for kernel in chosen for variant in kernel.variants}
    forms = [form for form in FORMATS.values() if form.name in types]
    lines = [*_preamble(chosen, command, forms), *lasting_lines(chosen)]
    head = "\n".join(f" * {line}".rstrip() for line in lines)
    blocks = [_c_block(kernel) for kernel in chosen]
    return template(__name__, "lacunary.h.jinja").render(
        head=head,
        blocks=blocks,
        kinds=_kinds(chosen),
        names=_names(chosen),
        lasting=lasting((kernel, _functions(kernel, forms)) for kernel in chosen),
        of_speed=takes_speed(chosen[0]),
    )


def _functions(kernel: LacunaryKernel, forms: Sequence[Format]) -> list[str]:
    """Return a kernel's functions in these types, with {} for its name."""
    names = [name for name in _FUNCTIONS[kernel.kind] if takes_speed(kernel) or name not in _OF_SPEED]
    return [f"{name}_{{}}{v.form.suffix}" for v in kernel.variants if v.form in forms for name in names]


def render_functions(kernels: Sequence[LacunaryKernel]) -> str:
    """Return the header's text after its first comment."""
    return template(__name__, "lacunary_functions.h.jinja").render(
        blocks=[_c_block(kernel) for kernel in _distinct(kernels)]
    )


def render_python(kernels: Sequence[LacunaryKernel], command: str) -> str:
    """Return a Python module with the same results as the C functions of type double.

    Parameters and errors are those of `render_c`.
    """
    chosen = _distinct(kernels)
    lines = [*_preamble(chosen, command, [DOUBLE]), *lasting_lines(chosen)]
    return template(__name__, "lacunary.py.jinja").render(
        head="\n".join(f"# {line}".rstrip() for line in lines),
        blocks=[_python_block(kernel) for kernel in chosen],
        kinds=_kinds(chosen),
        names=_names(chosen),
        lasting=lasting((kernel, _functions(kernel, [DOUBLE])) for kernel in chosen),
        of_speed=takes_speed(chosen[0]),
    )


def _distinct(kernels: Sequence[LacunaryKernel]) -> tuple[LacunaryKernel, ...]:
    return cast("tuple[LacunaryKernel, ...]", distinct(cast("Sequence[Any]", kernels)))


def _kinds(kernels: Sequence[LacunaryKernel]) -> dict[str, str]:
    """Return the last name of each kind."""
    return {kernel.kind: kernel.name for kernel in kernels}


def _names(kernels: Sequence[LacunaryKernel]) -> list[str]:
    sentences = [NAMES[kind] for kind in NAMES if kind in _kinds(kernels)]
    if not takes_speed(kernels[0]):
        of_laws = NAMES[INVERSE].replace(INVERSE, f"{INVERSE}{law_pattern(kernels[0].law)}")
        return wrap(f"{of_laws} {SPELLING}, {OF_EXPONENTS}.", WIDTH)
    return wrap(f"{'; '.join(sentences)} {SPELLING}.", WIDTH)


def inverse_preamble(kernels: Sequence[InverseKernel], command: str) -> list[str]:
    """Return the lines that begin a file of inverse kernels, without comment marks."""
    return _preamble(_distinct(kernels), command, [])


def _preamble(kernels: Sequence[LacunaryKernel], command: str, forms: Sequence[Format]) -> list[str]:
    """Return the lines that begin the file, without comment marks; `forms` are the types of its functions."""
    law = kernels[0].law
    calls = takes_speed(kernels[0]) or kernels[0].root < Fraction(1, 2)
    spheres = [
        "The coefficient of normal restitution eps of two viscoelastic spheres as a function of",
        "v* = beta^(1/2) v^(1/10), where v is the normal component of the impact velocity, or v* as a function",
        "of eps: quotients of polynomials in which only some powers of a root y occur.",
    ]
    return [
        marker_line(command),
        "",
        *(spheres if takes_speed(kernels[0]) else equation_lines(law, OF_EPSILON)),
        "",
        *wrap(f"End condition: {end_condition(law)}.", WIDTH),
        "",
        *(line for kernel in kernels for line in _summary(kernel)),
        "",
        *wrap(f"{PROVEN}.", WIDTH),
        *(["", *wrap(stated(forms), WIDTH)] if HALF_LINE in _kinds(kernels) else []),
        *(["", *wrap(f"{assumed('cbrt and pow')}.", WIDTH)] if calls else []),
    ]


def _summary(kernel: LacunaryKernel) -> list[str]:
    indent = " " * 4
    lines = (wrap(fact, WIDTH, initial_indent=indent, subsequent_indent=2 * indent) for fact in kernel.facts)
    return [kernel.name, *(line for part in lines for line in part)]


def _c_block(kernel: LacunaryKernel) -> dict[str, object]:
    """Return what the template needs of one kernel."""
    missing = [f"There are no functions of type {name}: {reason}." for name, reason in kernel.missing]
    return {
        "kernel": kernel,
        "guard": f"VISCOPADE_{kernel.name.upper()}",
        "facts": [line for fact in kernel.proven for line in wrap(fact, WIDTH)],
        "variants": [_c_variant(kernel, kernel.variant(v.form)) for v in kernel.variants],
        "missing": [line for text in missing for line in wrap(text, WIDTH)],
    }


def _c_variant(kernel: LacunaryKernel, variant: LacunaryVariant) -> dict[str, object]:
    form = variant.form
    ends = _ends(kernel)
    return {
        "type": form.name,
        "suffix": form.suffix,
        "zero": form.decimal(0.0),
        "one": form.decimal(1.0),
        "fifth": f"0.2{form.suffix}",
        "nan": f'nan{form.suffix}("")',
        "constants": [(name, constant_of_c(c, form)) for name, c in _constants(kernel, variant)],
        "branches": [_branch(branch, of_c(form), 28) for branch in kernel.branches],
        "ends": None if ends is None else [constant_of_c(end, form) for end in ends],
    }


def _python_block(kernel: LacunaryKernel) -> dict[str, object]:
    variant = kernel.variant(DOUBLE)
    ends = _ends(kernel)
    return {
        "kernel": kernel,
        "constants": [(name, repr(c)) for name, c in _constants(kernel, variant)],
        "branches": [_branch(branch, MATH_MODULE, 0) for branch in kernel.branches],
        "ends": ends,
    }


def _ends(kernel: LacunaryKernel) -> tuple[float, float] | None:
    """Return the least eps and the largest 1 - eps that are accepted; None if all of (0, 1] or if v* is given."""
    if not isinstance(kernel, InverseKernel) or not kernel.epsilon_low:
        return None
    return float(kernel.epsilon_low), float(1 - kernel.epsilon_low)


def _constants(kernel: LacunaryKernel, variant: LacunaryVariant) -> list[tuple[str, float]]:
    return list(formulas.constants(kernel.powers, variant.a, variant.b).items())


def _branch(branch: CodeBranch, syntax: Syntax, indent: int) -> dict[str, object]:
    """Return a program as names and lines, those for C wrapped."""
    written = [(name, text(expression, syntax)) for name, expression in branch.program]
    results = {name: text(expression, syntax) for name, expression in branch.results.items()}
    if indent:
        written = [(name, f"\n{' ' * 12}".join(wrap(line, WIDTH - indent))) for name, line in written]
    guard = branch.guard and f"{text(branch.guard.left, syntax)} <= {text(branch.guard.right, syntax)}"
    return {"guard": guard, "statements": written, "results": results}
