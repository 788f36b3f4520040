"""Code of compact kernels from speed to eps in CUDA, GLSL, WGSL, JavaScript, Fortran, Rust and Julia.

All texts come from the programs of `viscopade.kernels.forms.table_free`; the languages differ in how names, literals
and functions are written (`TargetLanguage`), and in their template.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from textwrap import wrap
from typing import Any, cast

from viscopade.arithmetic.decimals import at_most
from viscopade.arithmetic.formats import DOUBLE, FLOAT, Format
from viscopade.generated import END_CONDITION, WIDTH, marker_line, template
from viscopade.kernels.expressions import Language, Program, c_language, text
from viscopade.kernels.forms import table_free
from viscopade.kernels.forms.lacunary_kernels import HALF_LINE, SPELLING, HalfLineKernel, InverseKernel, LacunaryVariant
from viscopade.kernels.forms.rounding_bounds import ULPS
from viscopade.kernels.forms.table_free import (
    DEVICE,
    FUNCTIONS,
    LARGEST,
    LIBRARY,
    SHADER,
    MachineArithmetic,
    RoundingBound,
)
from viscopade.kernels.targets.wording import PROVEN, distinct

COMPACT = "compact"
UNITS = {"restitution": "eps", "rebound": "the speed after the collision", "dissipation": "(1 - eps^2)"}

_LIBRARY = f"{{}} are within {ULPS} units in the last place of the result; +, -, *, / are those of IEEE 754"
_DEVICE = (
    f"on the host log2, exp2, and those of type float, are within {ULPS} units in the last place of the result; on the "
    "device those of type double are, and __log2f within 2 or 2^-22, exp2f within 2 and __fdividef within 2, as the "
    "CUDA programming guide says; +, -, *, / are those of IEEE 754"
)
_SHADER = (
    "log2 is within 3 units in the last place or 2^-21, exp2(x) within 3 + 2 |x|, a quotient within 2.5, sums and "
    "products are one of the two neighbours, and results below 2^-126 may be replaced by 0: what {} guarantees"
)


@dataclass(frozen=True)
class Dialect:
    """Dialect of a language for one type: its literals and functions.

    Attributes
    ----------
    form : Format
    type : str
        The language's name of the type.
    suffix : str
        The end of the functions' names.
    language : Language
    constant : callable
        From a number to the text of a constant.
    machines : tuple of (str, MachineArithmetic)
        Where the functions run, as the end of a sentence, and what is assumed there.
    quotient : callable
        How quotients are written.
    """

    form: Format
    type: str
    suffix: str
    language: Language
    constant: Callable[[float], str]
    machines: tuple[tuple[str, MachineArithmetic], ...]
    quotient: table_free.Division = table_free.plain


@dataclass(frozen=True)
class TargetLanguage:
    """A target language.

    Attributes
    ----------
    template : str
    comment : str
        What begins a line of the preamble.
    dialects : tuple of Dialect
    assumed : str
        What the bounds assume of the arithmetic.
    log, exp : str
        Names of the functions that take the root.
    indent : int
        Columns that assignments need besides the expression.
    next_line : str
        What stands between the lines of an expression.
    """

    template: str
    comment: str
    dialects: tuple[Dialect, ...]
    assumed: str
    log: str = "log2"
    exp: str = "exp2"
    indent: int = 30
    next_line: str = "\n" + " " * 8


def shortest(value: float, form: Format) -> str:
    """Return the shortest decimal that rounds to a number of the format, always with a point."""
    for digits in range(1, form.digits + 1):
        written = format(value, f".{digits}g")
        with suppress(ValueError):  # below the smallest normal number
            if form.nearest(Fraction(written)) == value:
                break
    mantissa, e, exponent = written.replace("e+", "e").partition("e")
    return f"{mantissa if '.' in mantissa else mantissa + '.0'}{e}{exponent}"


def _cuda(form: Format) -> Dialect:
    def constant(value: float) -> str:
        return f"VISCOPADE_CONSTANT({form.hexadecimal(value)}, {form.decimal(value)})"

    if form == DOUBLE:
        return Dialect(form, "double", "", c_language(form), constant, (("", LIBRARY[form.name]),))
    language = Language(lambda name: f"viscopade_{name}f", c_language(form).literal)
    machines = (("on the host", LIBRARY[form.name]), ("on the device", DEVICE))
    return Dialect(form, "float", "f", language, constant, machines, table_free.called)


def _plain(
    form: Format, kind: str, suffix: str, literal: str, prefix: str = "", machine: MachineArithmetic | None = None
) -> Dialect:
    """Return a dialect whose functions are called prefix + name, and whose constants are decimals + literal."""
    return Dialect(
        form,
        kind,
        suffix,
        Language(lambda name: f"{prefix}{name}", lambda text: f"{text}{literal}"),
        lambda value: f"{shortest(value, form)}{literal}",
        (("", LIBRARY[form.name] if machine is None else machine),),
    )


def _julia(form: Format) -> Dialect:
    def constant(value: float) -> str:
        written = shortest(value, form)
        if form == DOUBLE:
            return written
        return written.replace("e", "f") if "e" in written else f"{written}f0"

    language = Language(lambda name: name, lambda text: text.removesuffix(".0"))
    return Dialect(form, f"Float{32 if form == FLOAT else 64}", "", language, constant, (("", LIBRARY[form.name]),))


def _wgsl() -> Dialect:
    def constant(value: float) -> str:
        return FLOAT.hexadecimal(value)

    language = Language(lambda name: name, lambda text: text)
    return Dialect(FLOAT, "f32", "", language, constant, (("", SHADER),))


TARGETS: Mapping[str, TargetLanguage] = {
    "cuda": TargetLanguage("table_free.cuh.jinja", " *", (_cuda(DOUBLE), _cuda(FLOAT)), _DEVICE),
    "glsl": TargetLanguage(
        "table_free.glsl.jinja", "//", (_plain(FLOAT, "float", "", "", machine=SHADER),), _SHADER.format("Vulkan")
    ),
    "wgsl": TargetLanguage("table_free.wgsl.jinja", "//", (_wgsl(),), _SHADER.format("WGSL")),
    "javascript": TargetLanguage(
        "table_free.mjs.jinja", "//", (_plain(DOUBLE, "", "", ""),), _LIBRARY.format("Math.log2 and Math.pow(2, x)"),
    ),
    "fortran": TargetLanguage(
        "table_free.f90.jinja",
        "!",
        (_plain(DOUBLE, "real64", "_r64", "_real64"), _plain(FLOAT, "real32", "_r32", "_real32")),
        _LIBRARY.format("exp and log"),
        "log",
        "exp",
        next_line=" &\n" + " " * 12,
    ),
    "rust": TargetLanguage(
        "table_free.rs.jinja",
        "//",
        (_plain(DOUBLE, "f64", "", "", "f64::"), _plain(FLOAT, "f32", "_f32", "", "f32::")),
        _LIBRARY.format("log2 and exp2"),
    ),
    "julia": TargetLanguage(
        "table_free.jl.jinja", "#", (_julia(DOUBLE), _julia(FLOAT)), _LIBRARY.format("log2 and exp2")
    ),
}  # fmt: skip


def render(
    target: str, kernels: Sequence[HalfLineKernel | InverseKernel], command: str, module: str = "viscopade"
) -> str:
    """Return the text of a file with the functions restitution, rebound and dissipation of all kernels.

    Parameters
    ----------
    target : str
        One of `TARGETS`.
    kernels : sequence of HalfLineKernel
        At least one, no two of the same name.
    command : str
        The command line that makes the file.
    module : str
        The name of the module, in Fortran.

    Raises
    ------
    ValueError
        If the target is not known, there is no kernel, one twice, or one for the inverse, `command` is not one line,
        or no kernel can be written in the language's types.
    """
    if target not in TARGETS:
        raise ValueError(f"target is {target!r}: accepted are {', '.join(TARGETS)}")
    if any(isinstance(kernel, InverseKernel) for kernel in kernels):
        raise ValueError(f"the request has an inverse kernel: accepted for {target} are kernels of eps for all v* >= 0")
    chosen = cast("tuple[HalfLineKernel, ...]", distinct(cast("Sequence[Any]", kernels)))
    language = TARGETS[target]
    forms = [dialect.form for dialect in language.dialects]
    written = [kernel for kernel in chosen if any(variant.form in forms for variant in kernel.variants)]
    if not written:
        raise ValueError(
            f"{', '.join(map(name_of, chosen))} have type double only: accepted for {target} are kernels of type float"
        )
    left_out = [kernel for kernel in chosen if kernel not in written]
    head = _head(language, written, left_out, command)
    return template(__name__, language.template).render(
        head="\n".join(f"{language.comment} {line}".rstrip() for line in head),
        kernels=[_block(language, kernel) for kernel in written],
        example=name_of(written[-1]),
        module=module,
        w=_statements(table_free.w_program(), language.dialects[0].language, language),
        types=[_type(dialect) for dialect in language.dialects],
        table=SPECIAL if SHADER not in [machine for _, machine in language.dialects[0].machines] else None,
    )


SPECIAL = (
    "speed, beta                                             restitution   rebound     dissipation",
    "one is 0 (or -0), the other finite and not negative     1             the speed   0",
    "one is 0, the other +infinity                           NaN           NaN         NaN",
    "one is negative or NaN                                  NaN           NaN         NaN",
)


def name_of(kernel: HalfLineKernel) -> str:
    """Return the name with the proven bound, "compact_2p09em4"."""
    return COMPACT + kernel.name.removeprefix(HALF_LINE)


# --- what templates need ----------------------------------------------------------------------------------------------


def _type(dialect: Dialect) -> dict[str, object]:
    form = dialect.form
    return {
        "type": dialect.type,
        "suffix": dialect.suffix,
        "zero": dialect.language.literal("0.0"),
        "largest": dialect.constant(2.0 ** LARGEST[form.name]),
        "least": dialect.constant(2.0 ** (1 - form.largest)),
    }


def _block(target: TargetLanguage, kernel: HalfLineKernel) -> dict[str, object]:
    pairs = [(d, v) for d in target.dialects for v in kernel.variants if v.form == d.form]
    return {
        "name": name_of(kernel),
        "guard": f"VISCOPADE_{name_of(kernel).upper()}",
        "facts": [line for fact in _errors(target, kernel) for line in wrap(fact, WIDTH)],
        "variants": [_variant(target, kernel, *pair) for pair in pairs],
    }


def _variant(
    target: TargetLanguage, kernel: HalfLineKernel, dialect: Dialect, variant: LacunaryVariant
) -> dict[str, object]:
    program = table_free.table_free_program(kernel.powers, dialect.quotient, target.log, target.exp)
    constants = table_free.numbers(kernel.powers, variant.a, variant.b, variant.form)
    decimals = {name: variant.form.decimal(c) for name, c in constants.items()}
    language = dialect.language
    return {
        **_type(dialect),
        "constants": [(name, dialect.constant(c), decimals[name]) for name, c in constants.items()],
        "common": _statements(program.common, language, target),
        "inverse": text(program.inverse.expression, language),
        "results": {name: text(expression, language) for name, expression in program.results.items()},
    }


def _statements(program: Program, language: Language, target: TargetLanguage) -> list[tuple[str, str]]:
    """Return names and expressions, these wrapped."""
    return [
        (name, target.next_line.join(wrap(text(expression, language), WIDTH - target.indent)))
        for name, expression in program
    ]


# --- words ------------------------------------------------------------------------------------------------------------


def _head(
    target: TargetLanguage, kernels: Sequence[HalfLineKernel], left_out: Sequence[HalfLineKernel], command: str
) -> list[str]:
    """Return the lines that begin the file, without comment marks."""
    indent = " " * 4
    summaries = []
    for kernel in kernels:
        facts = [f"source: {kernel.source}", f"formula: {_formula(kernel)}", *_errors(target, kernel)]
        summaries += [name_of(kernel)]
        for fact in facts:
            summaries += wrap(fact, WIDTH, initial_indent=indent, subsequent_indent=2 * indent)
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
        *summaries,
        *(line for kernel in left_out for line in wrap(_left_out(kernel), WIDTH)),
        "",
        *wrap(f"{PROVEN}.", WIDTH),
        "",
        *wrap(f"assumed: {target.assumed}.", WIDTH),
        "",
        *wrap(f"NAME is compact_B, B being the proven bound of the formula's error {SPELLING}.", WIDTH),
    ]


def _left_out(kernel: HalfLineKernel) -> str:
    reasons = dict(kernel.missing)
    return f"{name_of(kernel)} is left out, as there is no type double here: {reasons.get(FLOAT.name, '')}."


def _formula(kernel: HalfLineKernel) -> str:
    return f"eps = D/(D + y^6 N), y = w^(1/30), w = beta^5 speed = v*^10, {kernel.powers_text}"


def _domain(target: TargetLanguage) -> str:
    """Return where the bounds hold."""
    ranges = ", ".join(
        f"2^{1 - d.form.largest} <= w <= 2^{LARGEST[d.form.name]} in type {d.form.name}" for d in target.dialects
    )
    reached = ", ".join(_reach(d.form) for d in target.dialects)
    return (
        f"domain: {ranges}, w = beta^5 speed = v*^10 ({reached}), where beta^2, beta^4 and beta^5 are normal "
        "numbers, too. Below, eps is 1 but for less than the type can tell. Above, w is cut off, so that eps stays "
        "positive. rebound is proven where it is a normal number."
    )


def _reach(form: Format) -> str:
    """Return the range of v* as text, rounded inwards to two digits."""
    least, most = 2.0 ** ((1 - form.largest) / 10), 2.0 ** (LARGEST[form.name] / 10)
    return f"{least * 1.05:.1e} <= v* <= {most * 0.95:.1e}".replace("e-0", "e-").replace("e+0", "e").replace("e+", "e")


def _errors(target: TargetLanguage, kernel: HalfLineKernel) -> list[str]:
    """Return sentences on what is proven."""
    both = kernel.bound.measure == "both"
    variants = [v for v in kernel.variants if v.form in [d.form for d in target.dialects]]
    bounds = dict.fromkeys(f"{v.certificate.bound} in type {v.form.name}" for v in variants)
    same = len({v.certificate.bound for v in variants}) == 1
    bound = variants[0].certificate.bound if same else " and ".join(bounds)
    errors = [f"proven: |formula - eps| / {'min(eps, 1 - eps)' if both else 'eps'} <= {bound}"]
    if both:
        worst = max(Fraction(v.certificate.bound) for v in variants)
        # |d eps| (2 eps + |d eps|) / ((1 - eps) (1 + eps)), |d eps| <= worst min(eps, 1 - eps)
        errors.append(f"proven: |formula - (1 - eps^2)| / (1 - eps^2) <= {at_most(worst * (1 + worst / 2))}")
    for function in FUNCTIONS:
        of_formula = function == "dissipation" and not both
        unit = "the formula's 1 - eps^2" if of_formula else UNITS[function]
        sizes = " and ".join(
            _size(d, v, function, kernel) for d in target.dialects for v in variants if v.form == d.form
        )
        errors.append(f"rounding of {function}: adds at most {sizes}, relative to {unit} (proven)")
    return errors


def _size(dialect: Dialect, variant: LacunaryVariant, function: str, kernel: HalfLineKernel) -> str:
    """Return the bounds of one type, on all machines where its functions run."""
    parts = []
    for place, machine in dialect.machines:
        found: RoundingBound = table_free.rounding_bounds(kernel.powers, variant.a, variant.b, machine)[function]
        everywhere, common = (at_most(Fraction(s) * (1 + Fraction(variant.certificate.bound)), 2) for s in found)
        smaller = f" ({common} for 1e-3 <= v* <= 10)" if variant.form == FLOAT and common != everywhere else ""
        parts.append(" ".join(filter(None, (everywhere + smaller, place))))
    return f"{' and '.join(parts)} in type {dialect.form.name}"
