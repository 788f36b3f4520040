"""Code of compact kernels from speed to eps, in every language for GPUs, shaders, arrays or short texts.

All texts come from the programs of `viscopade.kernels.forms.table_free`; a `Target` says how its language writes names,
literals and functions, and has a template.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from textwrap import wrap

from viscopade.approximation.measure import RELATIVE_TO
from viscopade.arithmetic.decimals import at_most
from viscopade.arithmetic.formats import FLOAT, Format
from viscopade.generated import END_CONDITION, WIDTH, comment, marker_line, template
from viscopade.kernels import formulas
from viscopade.kernels.expressions import Program
from viscopade.kernels.forms import table_free
from viscopade.kernels.forms.lacunary_kernels import (
    HALF_LINE,
    SPELLING,
    HalfLineKernel,
    LacunaryVariant,
)
from viscopade.kernels.forms.table_free import (
    FUNCTIONS,
    LARGEST,
    RoundingBound,
)
from viscopade.kernels.targets import slope
from viscopade.kernels.targets.language import Number, Target
from viscopade.kernels.targets.syntax import Syntax, text
from viscopade.kernels.targets.wording import PROVEN, distinct, kernel_lines

COMPACT = "compact"
_INDENT = 30  # columns that assignments need besides the expression
UNITS = {"restitution": "eps", "rebound": "the speed after the collision", "dissipation": "(1 - eps^2)"}


def render(target: Target, kernels: Sequence[HalfLineKernel], command: str, module: str = "viscopade") -> str:
    """Return the text of a file with the functions restitution, rebound and dissipation of all kernels.

    Parameters
    ----------
    target : Target
    kernels : sequence of HalfLineKernel
        At least one, no two of the same name.
    command : str
        The command line that makes the file.
    module : str
        The name of the module, in languages whose modules have names of their own.

    Raises
    ------
    ValueError
        If there is no kernel, or one twice, `command` is not one line, or no kernel can be written in the language's
        types.
    """
    chosen = distinct(kernels)
    written = [kernel for kernel in chosen if any(variant.form.name in target.formats for variant in kernel.variants)]
    if not written:
        raise ValueError(
            f"there is no type double in {target.name}, and no type float for {', '.join(map(name_of, chosen))}: "
            "accepted is a larger error (--accuracy 1e-5)"
        )
    left_out = [kernel for kernel in chosen if kernel not in written]
    head = _head(target, written, left_out, command)
    return template(__name__, target.template("table_free")).render(
        head=comment(head, target.comment),
        kernels=[_block(target, kernel) for kernel in written],
        example=name_of(written[-1]),
        module=module,
        prelude=target.prelude,
        w=_statements(formulas.w_program(), target.numbers[0].syntax, target),
        types=[_type(number) for number in target.numbers],
        table=SPECIAL,
        functions=MEANINGS.items(),
        slopes=_slopes(target),
    )


MEANINGS = {
    "restitution": "eps",
    "rebound": "eps speed, the speed after the collision",
    "dissipation": "1 - eps^2",
}
SPECIAL = (
    "speed, beta                                             restitution   rebound     dissipation",
    "one is 0 (or -0), the other finite and not negative     1             the speed   0",
    "one is 0, the other +infinity                           NaN           NaN         NaN",
    "one is negative or NaN                                  NaN           NaN         NaN",
    "one is +infinity, the other positive, or w beyond       as at the cut-off, but rebound grows with speed",
    "beta^2, beta^4 or beta^5 no normal number as computed   those of another w: nothing is promised of the error",
)


def name_of(kernel: HalfLineKernel) -> str:
    """Return the name, in every language the same: "compact_1em5"."""
    return COMPACT + kernel.name.removeprefix(HALF_LINE)


# --- what templates need ----------------------------------------------------------------------------------------------


_SPECIAL_W = {"accepted": formulas.W_ACCEPTED, "beyond": formulas.W_BEYOND, "cut": formulas.W_CUT}


def _type(number: Number) -> dict[str, object]:
    form = number.form
    return {
        **{name: text(e, number.syntax) for name, e in _SPECIAL_W.items()},
        "type": number.type,
        "suffix": number.suffix,
        "zero": number.syntax.literal("0.0"),
        "one": number.syntax.literal("1.0"),
        "largest": number.coefficient(2.0 ** LARGEST[form.name]),
        "least": number.coefficient(2.0 ** (1 - form.largest)),
        "top": f"2^{LARGEST[form.name]}",
    }


def _block(target: Target, kernel: HalfLineKernel) -> dict[str, object]:
    pairs = [(number, v) for number in target.numbers for v in kernel.variants if v.form == number.form]
    return {
        "name": name_of(kernel),
        "guard": f"VISCOPADE_{name_of(kernel).upper()}",
        "identity": kernel.identity,
        "facts": [line for fact in _errors(target, kernel) for line in wrap(fact, WIDTH)],
        "variants": [_variant(target, kernel, *pair) for pair in pairs],
    }


def _variant(target: Target, kernel: HalfLineKernel, number: Number, variant: LacunaryVariant) -> dict[str, object]:
    program = table_free.table_free_program(kernel.powers, number.quotient, target.log, target.exp, target.larger)
    constants = table_free.numbers(kernel.powers, variant.a, variant.b, variant.form)
    decimals = {name: variant.form.decimal(c) for name, c in constants.items()}
    syntax = number.syntax
    of_slope = slope.slope_constants(kernel.powers, variant.a, variant.b, variant.form)
    return {
        **_type(number),
        "constants": [(name, number.coefficient(c), decimals[name]) for name, c in constants.items()],
        "of_slope": [(name, number.coefficient(c), "") for name, c in of_slope.items()],
        "slope": _statements(slope.slope_program(kernel.powers), syntax, target),
        "common": _statements(program.common, syntax, target),
        "inverse": text(program.inverse.expression, syntax),
        "results": {name: text(expression, syntax) for name, expression in program.results.items()},
    }


def _slopes(target: Target) -> dict[str, object]:
    """Return the texts of the derivatives, by function, and by name of those of eps."""
    syntax = target.numbers[0].syntax._replace(literal=str, power="{base}**{p}")
    return {
        **{name: text(expression, syntax) for name, expression in slope.along().items()},
        **{name: [text(expression, syntax) for expression in both] for name, both in slope.derivatives().items()},
    }


def _statements(program: Program, syntax: Syntax, target: Target) -> list[tuple[str, str]]:
    """Return names and expressions, these wrapped."""
    return [
        (name, target.next_line.join(wrap(text(expression, syntax), WIDTH - _INDENT))) for name, expression in program
    ]


# --- words ------------------------------------------------------------------------------------------------------------


def _head(
    target: Target, kernels: Sequence[HalfLineKernel], left_out: Sequence[HalfLineKernel], command: str
) -> list[str]:
    """Return the lines that begin the file, without comment marks."""
    facts = {
        name_of(kernel): (f"source: {kernel.source}", f"formula: {_formula(kernel)}", *_errors(target, kernel))
        for kernel in kernels
    }
    return [
        marker_line(command),
        "",
        "The coefficient of normal restitution eps of two viscoelastic spheres from the normal component of",
        "their impact velocity (speed) and beta = 3/2 A (rho/m_eff)^(2/5), eq:betadef, in the units of speed.",
        "",
        *wrap(f"End condition: {END_CONDITION}.", WIDTH),
        "",
        *wrap(_domain(target), WIDTH),
        "",
        *(line for name in facts for line in kernel_lines(name, facts[name])),
        *(line for kernel in left_out for line in wrap(_left_out(kernel), WIDTH)),
        "",
        *wrap(f"{PROVEN}.", WIDTH),
        "",
        *wrap(f"assumed: {target.assumed}.", WIDTH),
        "",
        *wrap(f"NAME is compact_B, B being the accuracy asked for {SPELLING}.", WIDTH),
    ]


def _left_out(kernel: HalfLineKernel) -> str:
    reasons = dict(kernel.missing)
    return f"{name_of(kernel)} is left out, as there is no type double here: {reasons.get(FLOAT.name, '')}."


def _formula(kernel: HalfLineKernel) -> str:
    return f"eps = D/(D + y^6 N), y = w^(1/30), w = beta^5 speed = v*^10, {kernel.powers_text}"


def _domain(target: Target) -> str:
    """Return where the bounds hold."""
    ranges = ", ".join(
        f"2^{1 - n.form.largest} <= w <= 2^{LARGEST[n.form.name]} in type {n.form.name}" for n in target.numbers
    )
    reached = ", ".join(_reach(number.form) for number in target.numbers)
    return (
        f"domain: {ranges}, w = beta^5 speed = v*^10 ({reached}), where beta^2, beta^4, beta^5 and w are normal "
        "numbers as computed. Below, eps is 1 but for less than the type can tell. Above, w is cut off, so that eps "
        "stays positive. rebound is proven where it is a normal number."
    )


def _reach(form: Format) -> str:
    """Return the range of v* as text, rounded inwards to two digits."""
    least, most = 2.0 ** ((1 - form.largest) / 10), 2.0 ** (LARGEST[form.name] / 10)
    return f"{least * 1.05:.1e} <= v* <= {most * 0.95:.1e}".replace("e-0", "e-").replace("e+0", "e").replace("e+", "e")


def _errors(target: Target, kernel: HalfLineKernel) -> list[str]:
    """Return sentences on what is proven."""
    both = kernel.bound.measure == "both"
    variants = [v for v in kernel.variants if v.form.name in target.formats]
    bounds = dict.fromkeys(f"{at_most(v.certificate.bound)} in type {v.form.name}" for v in variants)
    same = len({v.certificate.bound for v in variants}) == 1
    bound = at_most(variants[0].certificate.bound) if same else " and ".join(bounds)
    errors = [f"proven: |formula - eps| / {RELATIVE_TO[kernel.bound.measure]} <= {bound}"]
    if both:
        worst = max(v.error for v in variants)
        # |d eps| (2 eps + |d eps|) / ((1 - eps) (1 + eps)), |d eps| <= worst min(eps, 1 - eps)
        errors.append(f"proven: |formula - (1 - eps^2)| / (1 - eps^2) <= {at_most(worst * (1 + worst / 2))}")
    for function in FUNCTIONS:
        of_formula = function == "dissipation" and not both
        unit = "the formula's 1 - eps^2" if of_formula else UNITS[function]
        sizes = " and ".join(
            _size(n, v, function, kernel) for n in target.numbers for v in variants if v.form == n.form
        )
        errors.append(f"rounding of {function}: adds at most {sizes}, relative to {unit} (proven)")
    return errors


def _size(number: Number, variant: LacunaryVariant, function: str, kernel: HalfLineKernel) -> str:
    """Return the bounds of one type, on all machines where its functions run."""
    parts = []
    for place, machine in number.machines:
        found: RoundingBound = table_free.rounding_bounds(kernel.powers, variant.a, variant.b, machine)[function]
        everywhere, common = (at_most(Fraction(s) * (1 + variant.error), 2) for s in found)
        smaller = f" ({common} for 1e-3 <= v* <= 10)" if variant.form == FLOAT and common != everywhere else ""
        parts.append(" ".join(filter(None, (everywhere + smaller, place))))
    return f"{' and '.join(parts)} in type {number.form.name}"
