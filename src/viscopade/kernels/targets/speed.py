"""C header of kernels from speed to eps: a speed table, and a kernel of v* beyond its ends. C99, also C++17."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from textwrap import wrap

from viscopade.arithmetic.decimals import at_most
from viscopade.arithmetic.formats import DOUBLE, FLOAT, Format
from viscopade.generated import END_CONDITION, WIDTH, comment, marker_line, template
from viscopade.kernels import formulas
from viscopade.kernels.expressions import Call, Expression, Name
from viscopade.kernels.forms import last_place
from viscopade.kernels.forms.bits import octaves, power_of_two
from viscopade.kernels.forms.speed_kernel import SpeedKernel
from viscopade.kernels.forms.speed_table import LAST_ULPS, OCTAVES, SWITCH, Table, of_w
from viscopade.kernels.forms.speed_table_last_place import LastPlaceTable, ulp_of_w
from viscopade.kernels.names import FULL
from viscopade.kernels.targets import c
from viscopade.kernels.targets import last_place as full_text
from viscopade.kernels.targets.syntax import PRELUDE, Syntax, of_c, text
from viscopade.kernels.v_star import USUAL, USUAL_TEXT, assumed, of_v_star

BLOCK = 32  # speeds that the array functions take at a time
AHEAD = 256  # elements by which speeds are asked for in advance, and results by half as many
CACHE_LINE = 64  # bytes
FUNCTIONS = (("restitution", "EPSILON"), ("rebound", "REBOUND"), ("dissipation", "DISSIPATION"))


# --- text -------------------------------------------------------------------------------------------------------------


def render(given: SpeedKernel, command: str) -> str:
    """Return the header's text.

    Parameters
    ----------
    given : SpeedKernel
    command : str
        The command line that makes the file.

    Raises
    ------
    ValueError
        If `command` is not one line.
    """
    table = given.table
    width = len(table.rows[0])
    slow = FULL if given.slow is None else given.slow.name
    slow_loss = Call(f"viscopade_one_minus_epsilon_{slow}", (Name("v_star"),))
    return template(__name__, "speed.h.jinja").render(
        head=comment(_head(given, command), " *"),
        prelude=PRELUDE,
        slow=_slow_text(given),
        slow_epsilon=f"viscopade_epsilon_{slow}(v_star)",
        slow_dissipation=text(formulas.lost_energy(Name("eps"), slow_loss)["of_both"], Syntax()),
        guard=f"VISCOPADE_SPEED_{given.name.upper()}",
        identity=given.identity,
        error=given.bound,
        name=given.name,
        number=table.form.name,
        full=isinstance(table, LastPlaceTable),
        size=table.size,
        bytes=f"{table.bytes:,}",
        width=width,
        first=table.first,
        switch=SWITCH,
        octaves=OCTAVES,
        rows=[", ".join(table.form.hexadecimal(c) for c in row) for row in table.rows],
        in_columns=_in_columns(table),
        types=[_type(given.name, table, form, width) for form in given.formats],
        functions=FUNCTIONS,
        block=BLOCK,
        ahead=AHEAD,
    )


def _type(name: str, table: Table | LastPlaceTable, form: Format, width: int) -> dict[str, object]:
    """Return the numbers and expressions of the functions of a type."""
    smallest = "DBL_MIN" if form == DOUBLE else "FLT_MIN"
    language, end = of_c(form), octaves(form, OCTAVES)
    wider = "(double)" if form.bytes > table.form.bytes else ""
    scalar = [f"{wider}c[{n}]" for n in range(width)]
    array = [wider + _in_block(table, n) for n in range(width)]
    rest = f"viscopade_rest_{name}{form.suffix}(base)"
    result = table.sums(scalar, rest)

    def written(expressions: Mapping[str, Expression]) -> dict[str, str]:
        return {name: text(e, language) for name, e in expressions.items()}

    return {
        "name": form.name,
        "suffix": form.suffix,
        "bits": f"uint{8 * form.bytes}_t",
        "one": text(power_of_two(form, 0), language),
        "end": text(end, language),
        "end_shift": end.value.bit_length() - 1,
        "bases": wrap(
            ", ".join(form.decimal(float(e < SWITCH)) for e in range(table.first, table.first + OCTAVES)), 96
        ),
        "smallest": smallest,
        "line": CACHE_LINE // form.bytes,
        "holds": text(table.holds(form, smallest), language),
        "row": written(dict(table.row_program(form))),
        "scalar": written(dict(result.program)),
        "array": written(dict(table.sums(array, rest).program)),
        "result": written({**dict(result.program), **result.results}),
    }


def _in_columns(table: Table | LastPlaceTable) -> bool:
    """Return whether the rows of a block are stored as columns, four at a time; else each row is copied as it is."""
    return table.form == DOUBLE


def _in_block(table: Table | LastPlaceTable, n: int) -> str:
    """Return the number n of the row of speed i of a block."""
    return f"c[{n}][i]" if _in_columns(table) else f"c[i][{n}]"


def _slow_text(given: SpeedKernel) -> str:
    if given.slow is None:
        return "\n\n".join([c.half_line_functions([]).rstrip(), full_text.render_functions().rstrip()])
    return c.half_line_functions([given.slow]).rstrip()


# --- what the header says ---------------------------------------------------------------------------------------------

_FUNCTIONS = """
Functions, in double and (names that end in f) in float; NAME is {name}:

    viscopade_restitution_NAME(speed, beta)    eps
    viscopade_rebound_NAME(speed, beta)        eps speed, the speed after the collision
    viscopade_dissipation_NAME(speed, beta)    1 - eps^2, which loses no digits where eps is near 1

and for n speeds at once, with restitution, rebound or dissipation for FUNCTION:

    viscopade_FUNCTION_array_NAME(n, speed, beta, out)            one beta
    viscopade_FUNCTION_by_pair_NAME(n, speed, pair, beta, out)    beta[pair[i]], one for each pair of materials
    viscopade_FUNCTION_each_NAME(n, speed, beta, out)             beta[i], one for each speed

out may be speed; other overlaps are not allowed. There is no state: threads may call everything at once.
The results for arrays are those of the single calls (bit for bit without -ffast-math, if the compiler
contracts products and sums alike). GCC and Clang make vector instructions of them at -O3, for the machine
that -march names.

What they return:

    speed and beta                                         restitution   rebound      dissipation
    one is 0 (or -0), the other finite and not negative    1             speed        0
    speed is +infinity, beta > 0                           0             +infinity    1
    beta is +infinity, 0 < speed < infinity                0             0            1
    one is 0, the other +infinity                          NaN           NaN          NaN
    one is negative or NaN                                 NaN           NaN          NaN

With -ffast-math no table is read out of its range, but the rows above with NaN, infinity or a negative
number are not promised, and errors may exceed the bounds by a few units in the last place. Where subnormal
numbers are set to 0, a subnormal speed or beta counts as 0, and a subnormal result may be 0. Fused
multiplications do no harm. Needed of the machine: IEEE 754 formats, rounding to nearest, operations in the
type of their operands (FLT_EVAL_METHOD 0: not the x87 unit)."""


def _head(given: SpeedKernel, command: str) -> list[str]:
    """Return the lines of the comment that begins the file."""
    indent = " " * 4
    facts = (wrap(fact, WIDTH, initial_indent=indent, subsequent_indent=2 * indent) for fact in _facts(given))
    return [
        marker_line(command),
        "",
        "The coefficient of normal restitution eps of two viscoelastic spheres as a function of the normal",
        "component v of the impact velocity (speed) and of beta = 3/2 A (rho/m_eff)^(2/5), the paper's",
        "eq:betadef, whose unit is (time/length)^(1/5) in the units of speed.",
        "",
        *wrap(f"End condition: {END_CONDITION}.", WIDTH),
        "",
        f"{given.name}",
        *(line for lines in facts for line in lines),
        *_FUNCTIONS.format(name=given.name).splitlines(),
    ]


def _facts(given: SpeedKernel) -> list[str]:
    table = given.table
    bounds = _full_bounds(given, table) if isinstance(table, LastPlaceTable) else _bounds(given, table)
    return [_formula(given), *bounds, _underflow(given), f"where w is not in the table, {assumed('cbrt and pow')}"]


def _formula(given: SpeedKernel) -> str:
    table = given.table
    low, high = (f"{2.0 ** (e / 10):.3g}" for e in (table.first, table.first + OCTAVES))
    return (
        f"formula: w = beta^5 speed = v*^10 = 2^e m, 1 <= m < 2; a polynomial of degree {table.degree} in m, "
        f"{1 << table.split} rows of coefficients for each e from {table.first} to {table.first + OCTAVES - 1} "
        f"({low} <= v* < {high}): {table.bytes:,} bytes; elsewhere, and where beta^5 is no normal number, "
        f"{_slow_name(given)} of v* = sqrt(beta) pow(speed, 0.1)"
    )


def _bounds(given: SpeedKernel, table: Table) -> list[str]:
    smaller = "min(eps, 1 - eps)"
    forms = ((at_most(table.rounding(form), 2), form.name) for form in given.formats)
    rounding = " and ".join(f"{size} {smaller} in type {name}" for size, name in forms)
    elsewhere = (
        "that of viscopade_full.h" if given.slow is None else at_most(given.slow.variant(DOUBLE).certificate.bound)
    )
    return [
        f"proven: |formula - eps| / {smaller} <= {at_most(table.proven.error)} in the table, {elsewhere} elsewhere",
        f"rounding of restitution: adds at most {rounding}, and half a unit in the last place of eps (proven; in the "
        f"table, beta^5 speed included); elsewhere {at_most(of_v_star(largest=USUAL))} {smaller} for {USUAL_TEXT} and "
        f"{at_most(of_v_star())} {smaller} for every other speed, besides that of {_slow_name(given)}",
        f"rounding of dissipation and rebound: the same, relative to 1 - eps^2 and to eps speed, and "
        f"{_WORDS[LAST_ULPS]} units in the last place; elsewhere, for dissipation, the sum of what "
        f"{_slow_name(given)} states for epsilon and one_minus_epsilon",
        f"monotonic: eps falls with speed within each row; from one row to the next it rises by at most "
        f"{_rise(table)} {smaller} (proven, rounding apart)",
        _BEYOND if FLOAT in given.formats else _CONVERTED,
    ]


_WORDS = ("no", "one", "two", "three", "four")


def _rise(table: Table) -> str:
    return at_most(table.rise * (1 + table.proven.error))


_CONVERTED = "type float: computed in type double, then rounded"
_BEYOND = "type float: where w is not in the table, computed in type double, then rounded"


def _underflow(given: SpeedKernel) -> str:
    return (
        "underflow: a subnormal result is off by half of the smallest number besides; where 1 - eps is not a normal "
        "number of type double, dissipation is exactly twice the computed 1 - eps, and so off by up to "
        f"{at_most(2 * given.beyond.underflow)} of the smallest numbers besides; where eps itself is none (v* > 2e92), "
        "rebound has the error of eps times speed"
    )


def _full_bounds(given: SpeedKernel, table: LastPlaceTable) -> list[str]:
    rest = given.beyond.of_epsilon + given.beyond.of_loss + LAST_ULPS * Fraction(DOUBLE.epsilon)
    usual, every = (at_most(of_v_star(largest=end) + rest, 2) for end in (USUAL, None))
    return [
        f"proven: in the table, eps is off by at most {at_most(table.proven.ulp)} units in the last place (ulp) of "
        f"eps(w), and what the rounding of w = beta^5 speed does is at most {at_most(ulp_of_w())} ulp",
        f"elsewhere: at most {at_most(ulps_elsewhere(USUAL))} ulp in all for {USUAL_TEXT} and "
        f"{at_most(ulps_elsewhere())} ulp for every other speed, nearly all of which is pow's (proven)",
        f"dissipation and rebound: relative errors of at most {at_most(table.of_products, 2)} in the table, "
        f"besides what the rounding of w does, at most {at_most(of_w(DOUBLE), 2)}; elsewhere of at most {usual} for "
        f"{USUAL_TEXT} and {every} for every other speed (proven)",
        _CONVERTED,
    ]


def ulps_elsewhere(largest: Fraction | None = None) -> Fraction:
    """Return the bound in ulp of the full table's eps where it is not read, for speeds as of `of_v_star`.

    The kernel of v* has its error in ulp of eps at the rounded v*: twice those of eps, if a power of two is between.
    """
    return 2 * last_place.largest_ulp() + of_v_star(largest=largest) * (1 << DOUBLE.precision)


def _slow_name(given: SpeedKernel) -> str:
    return "viscopade_full.h" if given.slow is None else given.slow.name
