"""C header of the kernels of full accuracy (`viscopade.kernels.forms.last_place`): C99, also valid C++17."""

from __future__ import annotations

import math
from fractions import Fraction
from textwrap import wrap

from viscopade.arithmetic.formats import DOUBLE, FLOAT, FORMATS, Format
from viscopade.arrays.panels import FIRST, FOLD, PERIOD
from viscopade.generated import END_CONDITION, WIDTH, marker_line, template
from viscopade.kernels.expressions import Call, CodeBranch, Expression, Name
from viscopade.kernels.forms import formulas, last_place
from viscopade.kernels.forms.bits import count, smaller_word
from viscopade.kernels.targets.syntax import Syntax, of_c, text


def render(command: str) -> str:
    """Return the header's text, with eps and 1 - eps in double and in float.

    Parameters
    ----------
    command : str
        The command line that makes the file.

    Raises
    ------
    ValueError
        If `command` is not one line.
    """
    head = "\n".join(f" * {line}".rstrip() for line in _head(command))
    return template(__name__, "last_place.h.jinja").render(
        head=head, **_octaves(), double=_of_type(DOUBLE), float=_of_type(FLOAT)
    )


def render_double() -> str:
    """Return the functions of type double without the comment that begins the file."""
    return template(__name__, "last_place_double.h.jinja").render(**_octaves(), double=_of_type(DOUBLE))


def _octaves() -> dict[str, int]:
    return {"first": FIRST, "fold": FOLD, "top": FOLD + PERIOD, "per_octave": 2**last_place.SPLIT}


def _head(command: str) -> list[str]:
    """Return the lines of the comment that begins the file."""
    return [
        marker_line(command),
        "",
        "The coefficient of normal restitution eps of two viscoelastic spheres, and 1 - eps, as functions of",
        "v* = beta^(1/2) v^(1/10), where v is the normal component of the impact velocity; beta is that of the",
        "paper's eq:betadef. These are the exact functions, to the last place of the type:",
        "",
        "    double viscopade_epsilon_full(double v_star)    double viscopade_one_minus_epsilon_full(double v_star)",
        "    float viscopade_epsilon_fullf(float v_star)     float viscopade_one_minus_epsilon_fullf(float v_star)",
        "",
        "1 - eps is accurate however near eps is to 1, and eps however small it is.",
        "",
        *wrap(f"End condition: {END_CONDITION}.", WIDTH),
        "",
        "domain: all v* >= 0",
        *_error_lines(),
        *wrap(_table_line(), WIDTH, subsequent_indent="    "),
        "",
        "What the functions return:",
        "",
        "    v_star              epsilon                    one_minus_epsilon",
        "    0, -0               1                          0",
        "    +infinity           0                          1",
        "    negative, NaN       NaN                        NaN",
        "    large               denormal numbers, then 0   1",
        "    small               1                          denormal numbers, then 0",
        "",
        *wrap(
            "C99 or later; C++17 or later, for the hexadecimal constants (the older C++ of GNU has them, too: "
            "-std=gnu++11). Needed of the machine: IEEE 754 formats, rounding to nearest, operations of type double in "
            "that type (FLT_EVAL_METHOD 0: not the x87 unit). Fused multiplications do no harm.",
            WIDTH,
        ),
        "",
        *wrap(
            "With -ffast-math the bounds are not promised: sums may be reordered and denormal numbers set to 0, and "
            "nothing is promised for NaN, infinities and negative numbers but that no table is read out of its range.",
            WIDTH,
        ),
    ]


def _error_lines() -> list[str]:
    lines = ["error in units in the last place (ulp) of the true value, proven for the code below:"]
    for form in FORMATS.values():
        for function in last_place.FUNCTIONS:
            maximum = _rounded_up(last_place.largest_ulp(form, function))
            lines.append(f"    {form.name + ',':<8}{function + ':':<19}at most {maximum}")
    underflow = _rounded_up(last_place.largest_subnormal(DOUBLE))
    lines.append(f"    in double, where results are denormal: at most {underflow} of the smallest number")
    return lines


def _table_line() -> str:
    sizes = tuple(map(table_bytes, last_place.DEGREES))
    return "tables: {} bytes for double, {} bytes for float; in each translation unit that uses them".format(*sizes)


def table_bytes(form: Format) -> int:
    """Return the size of a type's table."""
    rows = _rows(form)
    return 8 * len(rows) * len(rows[0])


def _rounded_up(ulp: Fraction) -> str:
    """Return a bound with as many decimals as show its distance from 1/2."""
    digits = 1 - math.floor(math.log10(ulp - 0.5))
    return f"{math.ceil(ulp * 10**digits) / 10**digits:.{digits}f}"


def _rows(form: Format) -> list[tuple[float, ...]]:
    return [row.numbers for row in last_place.double_rows()] if form == DOUBLE else list(last_place.float_rows())


def _of_type(form: Format) -> dict[str, object]:
    """Return what the functions of a type have: table, sums, and where the bits of a number lead to in the table."""
    return {
        "degree": last_place.DEGREES[form],
        "rows": [[DOUBLE.hexadecimal(number) for number in row] for row in _rows(form)],
        "switch": last_place.switch(),
        "near": [(name, _constant(value)) for name, value in last_place.near_constants(form).items()],
        "near_bits": _text(last_place.near_bits(form), form),
        "at_most": _text(smaller_word(Name("bits"), Name("largest")), form),
        "largest": {name: _text(last_place.largest_bits(form, name), form) for name in last_place.FUNCTIONS},
        "fold": {name: _text(expression, form) for name, expression in last_place.fold_program(form)},
        "panel": _lines(last_place.panel_branch(form), form),
        "near_sums": _lines(last_place.near_branch(form), form),
        "accepted": text(formulas.NOT_NEGATIVE, of_c(form)),
        **{name: _assembled(name, form) for name in last_place.FUNCTIONS},
        "largest_exponent": last_place.LARGEST[form],
    }


def _assembled(function: str, form: Format) -> list[str]:
    """Return what a function returns below NEAR, for type float by a function of its own, and beyond."""
    largest = smaller_word(Name("bits"), Name("largest"))
    word, loss = (largest, 1) if function == "one_minus_epsilon" else (dict(last_place.fold_program(form))["folded"], 0)
    panel = Call(f"panel{8 * form.bytes}", (word, count(loss)))
    near = Call("near", (Name("v_star"),)) if form == FLOAT else last_place.near_branch(form).results["result"]
    return [_text(expression, form) for expression in last_place.assembled(function, near, panel)]


def _constant(value: float) -> str:
    return f"{DOUBLE.hexadecimal(value)} /* {DOUBLE.decimal(value)} */"


def _literal(number: str) -> str:
    return number if len(number) == len("1.0") else _constant(float(number))


def _text(expression: Expression, form: Format) -> str:
    """Return an expression of numbers of type double, and of words as long as numbers of a type, in C."""
    return text(expression, Syntax(lambda name: _FUNCTIONS.get(name, name), _literal, word=of_c(form).word))


_FUNCTIONS = {
    "panel64": "viscopade_full_sum",
    "panel32": "viscopade_full_panelf",
    "near": "viscopade_full_nearf",
    "bits64": "viscopade_full_bits",
    "from_bits64": "viscopade_full_from_bits",
    "from_bits32": "viscopade_full_from_bitsf",
    "index": "(unsigned)",
    "uint32": "(uint32_t)",
    "uint64": "(uint64_t)",
    "double": "(double)",
}
"""In C, the functions of words; those of bits take the absolute value of a number."""


def _lines(branch: CodeBranch, form: Format) -> dict[str, str]:
    """Return a branch's statements and results in C by name, on lines of a function's body."""
    written = {**dict(branch.program), **branch.results}
    # Comments are no part of what is wrapped.
    return {
        name: found if "/*" in (found := _text(e, form)) else f"\n{' ' * 8}".join(wrap(found, WIDTH - 20))
        for name, e in written.items()
    }
