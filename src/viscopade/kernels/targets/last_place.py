"""C header of the kernels of full accuracy (`viscopade.kernels.forms.last_place`): C99, also valid C++17."""

from __future__ import annotations

import math
from fractions import Fraction
from textwrap import wrap

from viscopade.arithmetic.formats import DOUBLE, FLOAT, FORMATS, Format
from viscopade.arrays.panels import FIRST, FOLD
from viscopade.generated import END_CONDITION, WIDTH, marker_line, template
from viscopade.kernels.expressions import CodeBranch
from viscopade.kernels.forms import last_place
from viscopade.kernels.targets.syntax import of_c, text


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
    return template(__name__, "last_place.h.jinja").render(head=head, **_octaves(), double=_double(), float=_float())


def render_double() -> str:
    """Return the functions of type double without the comment that begins the file."""
    return template(__name__, "last_place_double.h.jinja").render(**_octaves(), double=_double())


def _octaves() -> dict[str, int]:
    return {"first": FIRST, "fold": FOLD, "top": FOLD + last_place.PERIOD, "per_octave": 2**last_place.SPLIT}


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


def _double() -> dict[str, object]:
    return {
        "cleared": _mask(last_place.CLEARED),
        "near_cleared": _mask(53 - last_place.CENTRE_BITS),
        "tiny": _constant(2.0**last_place.TINY),
        "lift": _constant(2.0**last_place.LIFT),
        "lower": _constant(2.0 ** (-2 * last_place.LIFT)),
        **_of_type(DOUBLE, -1),
    }


def _float() -> dict[str, object]:
    return {"half": f"0x{1 << (FLOAT.precision - last_place.SPLIT - 2):x}", **_of_type(FLOAT, 0)}


def _of_type(form: Format, offset: int) -> dict[str, object]:
    """Return what the functions of a type have: table and sums, and where the bits of a number lead to in the table."""
    shift = form.precision - 1 - last_place.SPLIT
    return {
        "degree": last_place.DEGREES[form],
        "rows": [[DOUBLE.hexadecimal(number) for number in row] for row in _rows(form)],
        "switch": last_place.switch(),
        "near": [(name, _constant(value)) for name, value in last_place.near(form).items()],
        "panel": _lines(last_place.panel_branch(form)),
        "near_sums": _lines(last_place.near_branch(form)),
        "shift": shift,
        "lead": ((form.largest + FIRST) << last_place.SPLIT) + offset,
        "fold": form.largest + FOLD,
        "near_bits": _bits(form, FIRST),
        "one": _bits(form, FOLD),
        "largest": _bits(form, last_place.LARGEST[form]),
        "largest_exponent": last_place.LARGEST[form],
    }


def _bits(form: Format, exponent: int) -> str:
    """Return the bits of 2^exponent, a normal number."""
    return f"{(form.largest + exponent) << (form.precision - 1):#x}"


def _mask(bits: int) -> str:
    return f"{(1 << bits) - 1:#x}"


def _constant(value: float) -> str:
    return f"{DOUBLE.hexadecimal(value)} /* {DOUBLE.decimal(value)} */"


def _lines(branch: CodeBranch) -> dict[str, str]:
    """Return a branch's statements and results in C by name, on lines of a function's body."""
    language = of_c(DOUBLE)
    written = {**dict(branch.program), **branch.results}
    return {name: f"\n{' ' * 8}".join(wrap(text(e, language), WIDTH - 20)) for name, e in written.items()}
