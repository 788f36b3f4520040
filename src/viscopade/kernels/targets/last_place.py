"""C header of the kernels of full accuracy (`viscopade.kernels.forms.last_place`): C99, also valid C++17."""

from __future__ import annotations

import math
from fractions import Fraction
from textwrap import wrap

from viscopade.arithmetic.formats import DOUBLE
from viscopade.arrays.panels import FIRST, FOLD, PERIOD
from viscopade.generated import END_CONDITION, WIDTH, comment, marker_line, template
from viscopade.kernels import formulas
from viscopade.kernels.expressions import CodeBranch, Expression, Name
from viscopade.kernels.forms import last_place
from viscopade.kernels.forms.bits import smaller_word
from viscopade.kernels.targets.syntax import PRELUDE, Syntax, of_c, text


def render(command: str) -> str:
    """Return the header's text, with eps and 1 - eps.

    Parameters
    ----------
    command : str
        The command line that makes the file.

    Raises
    ------
    ValueError
        If `command` is not one line.
    """
    head = comment(_head(command), " *")
    return template(__name__, "last_place.h.jinja").render(head=head, prelude=PRELUDE, **_words())


def render_functions() -> str:
    """Return the functions without the comment that begins the file."""
    return template(__name__, "last_place_functions.h.jinja").render(**_words())


def _head(command: str) -> list[str]:
    """Return the lines of the comment that begins the file."""
    return [
        marker_line(command),
        "",
        "The coefficient of normal restitution eps of two viscoelastic spheres, and 1 - eps, as functions of",
        "v* = beta^(1/2) v^(1/10), where v is the normal component of the impact velocity; beta is that of the",
        "paper's eq:betadef. These are the exact functions, to the last place:",
        "",
        "    double viscopade_epsilon_full(double v_star)    double viscopade_one_minus_epsilon_full(double v_star)",
        "",
        "1 - eps is accurate however near eps is to 1, and eps however small it is.",
        "",
        *wrap(f"End condition: {END_CONDITION}.", WIDTH),
        "",
        "domain: all v* >= 0",
        *_error_lines(),
        f"table: {table_bytes()} bytes, in each translation unit that uses it (once in all from C++17 on)",
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
    for function in last_place.FUNCTIONS:
        lines.append(f"    {function + ':':<19}at most {_rounded_up(last_place.largest_ulp(function))}")
    underflow = _rounded_up(last_place.largest_subnormal())
    lines.append(f"    where results are denormal: at most {underflow} of the smallest number")
    return lines


def table_bytes() -> int:
    """Return the size of the table."""
    rows = last_place.double_rows()
    return DOUBLE.bytes * len(rows) * len(rows[0].numbers)


def _rounded_up(ulp: Fraction) -> str:
    """Return a bound with as many decimals as show its distance from 1/2."""
    digits = 1 - math.floor(math.log10(ulp - 0.5))
    return f"{math.ceil(ulp * 10**digits) / 10**digits:.{digits}f}"


def _words() -> dict[str, object]:
    """Return table, sums, and where the bits of a number lead to in the table."""
    return {
        "first": FIRST,
        "fold": FOLD,
        "top": FOLD + PERIOD,
        "per_octave": 2**last_place.SPLIT,
        "degree": last_place.DEGREE,
        "rows": [[DOUBLE.hexadecimal(number) for number in row.numbers] for row in last_place.double_rows()],
        "switch": last_place.switch(),
        "near": [(name, _constant(value)) for name, value in last_place.near_constants().items()],
        "near_bits": _text(last_place.near_bits()),
        "at_most": _text(smaller_word(Name("bits"), Name("largest"))),
        "largest": {name: _text(last_place.largest_bits(name)) for name in last_place.FUNCTIONS},
        "folding": {name: _text(expression) for name, expression in last_place.fold_program()},
        "panel": _lines(last_place.panel_branch()),
        "near_sums": _lines(last_place.near_branch()),
        "accepted": text(formulas.NOT_NEGATIVE, of_c(DOUBLE)),
        "largest_exponent": last_place.LARGEST,
    }


def _constant(value: float) -> str:
    return f"{DOUBLE.hexadecimal(value)} /* {DOUBLE.decimal(value)} */"


def _literal(number: str) -> str:
    return number if len(number) == len("1.0") else _constant(float(number))


def _text(expression: Expression) -> str:
    """Return an expression of doubles, and of words as long as these, in C."""
    return text(expression, Syntax(lambda name: _FUNCTIONS.get(name, name), _literal, word=of_c(DOUBLE).word))


_FUNCTIONS = {
    "bits64": "viscopade_full_bits",
    "from_bits64": "viscopade_full_from_bits",
    "index": "(unsigned)",
    "uint32": "(uint32_t)",
    "uint64": "(uint64_t)",
}
"""In C, the functions of words; those of bits take the absolute value of a number."""


def _lines(branch: CodeBranch) -> dict[str, str]:
    """Return a branch's statements and results in C by name, on lines of a function's body."""
    written = {**dict(branch.program), **branch.results}
    # Comments are no part of what is wrapped.
    return {
        name: found if "/*" in (found := _text(e)) else f"\n{' ' * 8}".join(wrap(found, WIDTH - 20))
        for name, e in written.items()
    }
