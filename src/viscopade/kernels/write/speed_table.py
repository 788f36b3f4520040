"""The functions of a speed table in C: those of arrays are tuned by hand, in speed_table.h beside this module.

Capital words of that file are replaced: by the names, types and numbers of a table, and by its sums as expressions.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from textwrap import indent, wrap

import numpy as np

from viscopade.arithmetic.decimals import at_most
from viscopade.arithmetic.formats import DOUBLE, FLOAT, Format
from viscopade.generated import wrapped
from viscopade.kernels.expressions import CodeBranch, Column, Expression, Name, TableRow, names_in
from viscopade.kernels.formulas import FRACTION, OCTAVES, octaves
from viscopade.kernels.kernel import Kernel, Table, needed
from viscopade.kernels.machine import branch_value
from viscopade.kernels.write.language import Language
from viscopade.kernels.write.writer import expression_text, program_text

BLOCK = 32  # speeds that the array functions take at a time
AHEAD = 256  # elements by which speeds are asked for in advance, and results by half as many
CACHE_LINE = 64  # bytes
FUNCTIONS = {"restitution": "EPSILON", "rebound": "REBOUND", "dissipation": "DISSIPATION"}
_TWO, _FEW = 2, 4  # numbers in a row; and the latter of floats
_COLUMNS = 118  # of comments


_AS_DOUBLE = "VISCOPADE_AS(double, {})"


@cache
def _parts() -> Mapping[str, str]:
    """Return the parts of the C file by name."""
    text = (files(__package__) / "speed_table.h").read_text(encoding="utf-8")
    _, *parts = re.split(r"/\* == (.+) == \*/\n", text)
    return {name: part.strip("\n") for name, part in zip(parts[::2], parts[1::2], strict=True)}


def shared_text() -> str:
    """Return what all speed tables of a program share."""
    return _parts()["once"]


def functions_text(kernel: Kernel, language: Language, rows: str) -> str:
    """Return the table, whose text is given, and the functions of a kernel in type double and float."""
    (table,), parts = kernel.tables, _parts()
    common = _of_table(kernel, table)
    about = {name: "\n * ".join(wrapped(text, _COLUMNS)) for name, text in _facts(kernel).items()}
    found = [_replaced(parts["about"], common | about), rows]
    for form in (DOUBLE, FLOAT):
        name = f"{kernel.name}{form.suffix}"
        words = common | {"NAME": name, "REAL": form.name, "ONE": f"viscopade_one_{name}(speed, beta, VISCOPADE_WHAT)"}
        if form == DOUBLE or table.form == form.name:
            words |= _of_type(kernel, table, language, form)
            load = _replaced(parts["rows in columns" if table.form == DOUBLE.name else "rows"], words)
            found.append(_replaced(parts["type"], words | {"LOAD": load}))
        else:
            found.append(_replaced(parts["float by double"], words))
            words["ONE"] = (
                f"VISCOPADE_AS(float, viscopade_one_{kernel.name}("
                "VISCOPADE_AS(double, speed), VISCOPADE_AS(double, beta), VISCOPADE_WHAT))"
            )
        for function, what in FUNCTIONS.items():
            text = _replaced(parts["function"].replace("FUNCTION", function), words)
            found.append(text.replace("VISCOPADE_WHAT", f"VISCOPADE_{what}"))
    return "\n\n".join(found).replace("\n VISCOPADE_ARRAYS", "\nVISCOPADE_ARRAYS")


def _facts(kernel: Kernel) -> dict[str, str]:
    """Return what is computed, and what is proven of it in the table."""
    eps, rebound = (kernel.table_bound(name, DOUBLE.name) for name in ("restitution", "rebound"))
    if eps.formula:
        sizes = ((kernel.table_bound("restitution", form.name).rounding, form.name) for form in (DOUBLE, FLOAT))
        adds = " and ".join(f"{at_most(size, 2)} min(eps, 1 - eps) in type {name}" for size, name in sizes)
        proven = (
            f"Proven: |formula - eps| / min(eps, 1 - eps) <= {at_most(eps.formula)} in the table; rounding of "
            f"restitution: adds at most {adds}, with the rounding of beta^5 speed, and half a unit in the last place."
        )
    else:
        of_w = at_most(eps.rounding * 2**DOUBLE.precision)
        proven = (
            f"Proven: in the table, eps is off by at most {at_most(eps.ulps)} units in the last place (ulp) of eps(w), "
            f"and what the rounding of w = beta^5 speed does is at most {of_w} ulp; "
            f"dissipation and rebound have relative errors of at most {at_most(rebound.formula, 2)} in the table, "
            f"besides what the rounding of w does, at most {at_most(rebound.rounding, 2)}."
        )
    return {"FORMULA": f"Formula: {kernel.formula}.", "PROVEN": proven}


def _replaced(text: str, words: Mapping[str, str]) -> str:
    """Return a text with capital words replaced, alone or after an underscore at the end of a name.

    A word alone on its line may stand for several lines, which are indented alike.
    """
    keys = "|".join(words)
    alone = re.compile(rf"^( *)({keys})$", re.MULTILINE)
    text = alone.sub(lambda found: _indented(words[found[2]], found[1]), text)
    return re.sub(rf"(?:(?<![A-Z_])|(?<=[a-z]_))({keys})(?![A-Za-z0-9_])", lambda found: words[found[1]], text)


def _indented(text: str, by: str) -> str:
    return indent(text, by, lambda line: bool(line.strip()) and not line.startswith("#"))


def _of_table(kernel: Kernel, table: Table) -> dict[str, str]:
    """Return the words of a table."""
    width = len(table.rows[0])
    rows = [", ".join(f"row{k} + {n}" if n else f"row{k}" for k in range(4)) for n in range(0, width, 2)]
    columns = (f"viscopade_columns({four}, c[{2 * k}] + i, c[{2 * k + 1}] + i, set);" for k, four in enumerate(rows))
    return {
        "KERNEL": kernel.name,
        "NUMBER": table.form,
        "BLOCK": str(BLOCK),
        "AHEAD": str(AHEAD),
        "COLUMNS": "\n".join(columns),
        "WIDTH": str(width),
        "VECTORS": "VISCOPADE_VECTORS" * (width > _TWO),
        "PREFETCH": "VISCOPADE_AHEAD_WITH_FEW" if table.form == FLOAT.name and width <= _FEW else "1",
    }


def _of_type(kernel: Kernel, table: Table, language: Language, form: Format) -> dict[str, str]:
    """Return the words of a type: its numbers, and the kernel's expressions."""
    number, function = language.number(form.name), kernel.functions[0]
    (branch, beyond), start = function.branches, dict(function.start)
    names = [name for name, expression in branch.program if isinstance(expression, Column)]
    given = {"row", "base", *names}
    wanted = {name for result in branch.results.values() for name in names_in(result)}
    program = [s for s in needed(branch.program, wanted) if s.name not in given]
    assigned = dict(branch.program)
    row, base, guard = assigned["row"], assigned["base"], branch.guard
    assert isinstance(row, TableRow)
    assert guard is not None
    assert beyond.guard is not None

    def written(expression: Expression, of: Format = form) -> str:
        return expression_text(kernel, expression, language, language.number(of.name))

    in_columns, cast = table.form == DOUBLE.name, "{}" if form.name == table.form else _AS_DOUBLE
    smallest, width, index = "DBL_MIN" if form == DOUBLE else "FLT_MIN", len(names), written(row.index)

    def in_double(expression: Expression) -> str:
        text = written(expression, DOUBLE).replace("largest", "DBL_MAX")
        return text if form == DOUBLE else re.sub(r"\b(speed|beta)\b", lambda found: _AS_DOUBLE.format(found[0]), text)

    in_block = "c[{n}][i]" if in_columns else "c[i][{n}]"
    return {name.upper(): written(expression) for name, expression in branch.results.items()} | {
        "WORD": number.types["word"],
        "B2": written(start["b2"]),
        "SCALE": written(start["scale"]),
        "PLACE": written(start["place"]),
        "BASE": written(base),
        "BASES": _bases(base, form),
        "OCTAVE": written(Name("place") >> FRACTION),
        "PARAMETERS": ", ".join(f"{form.name} {name}" for name in names),
        "STATEMENTS": "\n".join(program_text(kernel, tuple(program), language, number)),
        "INSIDE": written(guard).replace("smallest", smallest),
        "INDEX": index,
        **{f"INDEX_{k}": index.replace("place", f"place[i + {k}]" if k else "place[i]") for k in range(4)},
        "ROW": ", ".join(cast.format(f"c[{n}]") for n in range(width)),
        "ROW_OF_BLOCK": ", ".join(cast.format(in_block.format(n=n)) for n in range(width)),
        "LOADED": f"double c[{width}][{BLOCK}];" if in_columns else f"{table.form} c[{BLOCK}][{width}];",
        "SMALLEST": smallest,
        "END_SHIFT": str(octaves(OCTAVES).value_in(form).bit_length() - 1),
        "LINE": str(CACHE_LINE // form.bytes),
        "VALID": in_double(beyond.guard),
        **{f"BEYOND_{name.upper()}": in_double(value) for name, value in [*beyond.program, *beyond.results.items()]},
    }


def _bases(base: Expression, form: Format) -> str:
    """Return the base of each octave."""
    branch, places = CodeBranch(None, (), {"base": base}), (octaves(e).value_in(form) for e in range(OCTAVES))
    word = np.uint64 if form == DOUBLE else np.uint32
    found = branch_value(branch, "base", {"place": np.array([*places], word)}, form)
    return "\n".join(wrap(", ".join(form.decimal(float(number)) for number in found), 96))
