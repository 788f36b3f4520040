"""The functions of a speed table in C: those of arrays are tuned by hand, in speed_table.h beside this module.

Capital words of that file are replaced: by the names, types and numbers of a table, and by its sums as expressions. The
file has parts, each after a line "/* == name == */": `shared_text` is one of them, "about" a comment, "type" the
functions in a type that has sums of its own, "float by double" those of float where only double has, "rows" and "rows
in columns" two ways to load rows of the table, and "function" the functions of one result.
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

# Speeds that the array functions take at a time: a multiple of the four rows that are copied at once, and of vectors of
# up to 16 floats. Chosen by hand; the places and rows of a block stay in the first cache.
BLOCK = 32
# Elements by which speeds are asked for in advance of their use; results by half as many, as both arrays may lie alike
# in the cache. Chosen by hand.
AHEAD = 256
CACHE_LINE = 64  # bytes, of x86-64 and most ARM processors: one request brings as many
FUNCTIONS = {"restitution": "EPSILON", "rebound": "REBOUND", "dissipation": "DISSIPATION"}
"""The functions, and their words in the C file: VISCOPADE_EPSILON, …"""
ARRAY_FUNCTIONS = {
    "array": ("n", "speed", "beta", "out"),
    "by_pair": ("n", "speed", "pair", "beta", "out"),
    "each": ("n", "speed", "beta", "out"),
}
"""Those of arrays, viscopade_restitution_array_KERNEL, …: the word in their name, and their arguments."""
ARRAYS = (
    "For n speeds at once: array has one beta, by_pair beta[pair[i]] and each beta[i] for speed[i]; out may be speed."
)
"""The sentence of a head on them."""
_COMMENT_COLUMNS = 118  # with " * " lines end at column 121: the C file has lines up to 140
_AS_DOUBLE = "VISCOPADE_AS(double, {})"  # a cast


@cache
def _parts() -> Mapping[str, str]:
    """Return the parts of the C file by name."""
    text = (files(__package__) / "speed_table.h").read_text(encoding="utf-8")
    _, *names_and_texts = re.split(r"/\* == (.+) == \*/\n", text)
    return {name: part.strip("\n") for name, part in zip(names_and_texts[::2], names_and_texts[1::2], strict=True)}


def shared_text() -> str:
    """Return what all speed tables of a program share."""
    return _parts()["once"]


def functions_text(kernel: Kernel, language: Language, rows: str) -> str:
    """Return the C text of a speed table and its functions in type double and float, after what is proven of them.

    `rows` is the text of the table itself.
    """
    (table,), parts = kernel.tables, _parts()
    table_words = _table_words(kernel, table)
    about = {name: "\n * ".join(wrapped(text, _COMMENT_COLUMNS)) for name, text in _facts(kernel).items()}
    texts = [_replace_words(parts["about"], table_words | about), rows]
    for form in (DOUBLE, FLOAT):
        name = f"{kernel.name}{form.suffix}"
        # ONE: a call for a single speed.
        words = table_words | {
            "NAME": name, "REAL": form.name, "ONE": f"viscopade_one_{name}(speed, beta, VISCOPADE_WHAT)",
        }  # fmt: skip
        if form == DOUBLE or table.form == form.name:
            words |= _type_words(kernel, table, language, form)
            load = _replace_words(parts["rows in columns" if table.form == DOUBLE.name else "rows"], words)
            texts.append(_replace_words(parts["type"], words | {"LOAD": load}))
        else:
            # A table of doubles is not summed in float: float calls double.
            texts.append(_replace_words(parts["float by double"], words))
            words["ONE"] = (
                f"VISCOPADE_AS(float, viscopade_one_{kernel.name}("
                "VISCOPADE_AS(double, speed), VISCOPADE_AS(double, beta), VISCOPADE_WHAT))"
            )
        for function, what in FUNCTIONS.items():
            text = _replace_words(parts["function"].replace("FUNCTION", function), words)
            texts.append(text.replace("VISCOPADE_WHAT", f"VISCOPADE_{what}"))
    # A table with few numbers has an empty word before VISCOPADE_ARRAYS, which leaves a blank.
    return "\n\n".join(texts).replace("\n VISCOPADE_ARRAYS", "\nVISCOPADE_ARRAYS")


def _facts(kernel: Kernel) -> dict[str, str]:
    """Return the sentences for the words FORMULA and PROVEN: what a kernel computes, and its bounds in the table."""
    eps, rebound = (kernel.table_bound(name, DOUBLE.name) for name in ("restitution", "rebound"))
    # Tables to the last place have no error of the formula apart from that in ulp. Bounds are rounded up; two digits
    # are enough for rounding.
    if eps.formula:
        sizes = ((kernel.table_bound("restitution", form.name).rounding, form.name) for form in (DOUBLE, FLOAT))
        adds = " and ".join(f"{at_most(size, 2)} min(eps, 1 - eps) in type {name}" for size, name in sizes)
        proven = (
            f"Proven: |formula - eps| / min(eps, 1 - eps) <= {at_most(eps.formula)} in the table; rounding of "
            f"restitution: adds at most {adds}, with the rounding of beta^5 speed, and half a unit in the last place."
        )
    else:
        # A relative error x is at most 2^53 x ulp.
        ulp_from_w = at_most(eps.rounding * 2**DOUBLE.precision)
        proven = (
            f"Proven: in the table, eps is off by at most {at_most(eps.ulps)} units in the last place (ulp) of eps(w), "
            f"and what the rounding of w = beta^5 speed does is at most {ulp_from_w} ulp; "
            f"dissipation and rebound have relative errors of at most {at_most(rebound.formula, 2)} in the table, "
            f"besides what the rounding of w does, at most {at_most(rebound.rounding, 2)}."
        )
    return {"FORMULA": f"Formula: {kernel.formula}.", "PROVEN": proven}


def _replace_words(text: str, words: Mapping[str, str]) -> str:
    """Return a text with capital words replaced, alone or after an underscore at the end of a name.

    A word alone on its line may stand for several lines, which are indented alike, except for those of the
    preprocessor.
    """
    keys = "|".join(words)

    def indented(match: re.Match[str]) -> str:
        return indent(words[match[2]], match[1], lambda line: bool(line.strip()) and not line.startswith("#"))

    text = re.compile(rf"^( *)({keys})$", re.MULTILINE).sub(indented, text)
    return re.sub(rf"(?:(?<![A-Z_])|(?<=[a-z]_))({keys})(?![A-Za-z0-9_])", lambda match: words[match[1]], text)


def _table_words(kernel: Kernel, table: Table) -> dict[str, str]:
    """Return the C file's words for a kernel's table, in any type: word -> text."""
    width = len(table.rows[0])
    # Rows are copied to columns four at a time, as viscopade_columns does, two numbers of each by one call.
    pairs = [", ".join(f"row{k} + {n}" if n else f"row{k}" for k in range(4)) for n in range(0, width, 2)]
    columns = (f"viscopade_columns({four}, c[{2 * k}] + i, c[{2 * k + 1}] + i, set);" for k, four in enumerate(pairs))
    return {
        "KERNEL": kernel.name,
        "NUMBER": table.form,
        "BLOCK": str(BLOCK),
        "AHEAD": str(AHEAD),
        "COLUMNS": "\n".join(columns),
        "WIDTH": str(width),
        # Measured (docs/reference/speed.md): vectors of 256 bits for rows of more than two numbers, and no prefetch for
        # rows of four floats or fewer, are faster on Zen 4; the macros decide by the processor.
        "VECTORS": "VISCOPADE_VECTORS" * (width > 2),
        "PREFETCH": "VISCOPADE_AHEAD_WITH_FEW" if table.form == FLOAT.name and width <= 4 else "1",
    }


def _type_words(kernel: Kernel, table: Table, language: Language, form: Format) -> dict[str, str]:
    """Return the C file's words for functions in a type with sums of its own: word -> text.

    They are the numbers of the type `form`, and the kernel's expressions. `table` is the kernel's table, whose type may
    be another; `language` is C.
    """
    number, function = language.number(form.name), kernel.functions[0]
    # All functions have the same two branches, in the table and beyond it, and the same assignments before: b2, scale,
    # w and place.
    (branch, beyond), start = function.branches, dict(function.start)
    # The names of a row's numbers, which are parameters; STATEMENTS are the assignments between these and the results.
    names = [name for name, expression in branch.program if isinstance(expression, Column)]
    parameters = {"row", "base", *names}
    read = {name for result in branch.results.values() for name in names_in(result)}
    program = [s for s in needed(branch.program, read) if s.name not in parameters]
    assigned = dict(branch.program)
    row, base, guard = assigned["row"], assigned["base"], branch.guard
    assert isinstance(row, TableRow)
    assert guard is not None
    assert beyond.guard is not None

    def written(expression: Expression, as_form: Format = form) -> str:
        """Return an expression in C, with numbers of a type."""
        return expression_text(kernel, expression, language, language.number(as_form.name))

    # Numbers of a row are cast where the table has another type.
    in_columns, cast = table.form == DOUBLE.name, "{}" if form.name == table.form else _AS_DOUBLE
    cast_back = "{}" if form == DOUBLE else "VISCOPADE_AS(float, {})"
    smallest, width, index = "DBL_MIN" if form == DOUBLE else "FLT_MIN", len(names), written(row.index)

    def in_double(expression: Expression) -> str:
        """Return an expression in type double, with casts of the speed and beta from another type."""
        text = written(expression, DOUBLE).replace("largest", "DBL_MAX")
        return text if form == DOUBLE else re.sub(r"\b(speed|beta)\b", lambda match: _AS_DOUBLE.format(match[0]), text)

    # The base of each octave, 1 or 0, in lines of 96 columns: 100 with the indent.
    places = np.array([octaves(e).value_in(form) for e in range(OCTAVES)], np.uint64 if form == DOUBLE else np.uint32)
    bases = branch_value(CodeBranch(None, (), {"base": base}), "base", {"place": places}, form)
    bases_text = "\n".join(wrap(", ".join(form.decimal(float(number)) for number in bases), 96))
    # c[n][i]: number n of the row of speed i; rows that are copied unchanged have c[i][n].
    in_block = "c[{n}][i]" if in_columns else "c[i][{n}]"
    return {name.upper(): written(expression) for name, expression in branch.results.items()} | {
        "WORD": number.types["word"],
        "B2": written(start["b2"]),
        "SCALE": written(start["scale"]),
        "PLACE": written(start["place"]),
        "BASE": written(base),
        "BASES": bases_text,
        "OCTAVE": written(Name("place") >> FRACTION),
        "PARAMETERS": ", ".join(f"{form.name} {name}" for name in names),
        "STATEMENTS": "\n".join(program_text(kernel, tuple(program), language, number)),
        "INSIDE": written(guard).replace("smallest", smallest),
        "INDEX": index,
        # Of four speeds at a time: INDEX_0 … INDEX_3.
        **{f"INDEX_{k}": index.replace("place", f"place[i + {k}]" if k else "place[i]") for k in range(4)},
        "ROW": ", ".join(cast.format(f"c[{n}]") for n in range(width)),
        "ROW_OF_BLOCK": ", ".join(cast.format(in_block.format(n=n)) for n in range(width)),
        "LOADED": f"double c[{width}][{BLOCK}];" if in_columns else f"{table.form} c[{BLOCK}][{width}];",
        "SMALLEST": smallest,
        # Places in the table are below 2^END_SHIFT: 128 octaves are a power of 2.
        "END_SHIFT": str(octaves(OCTAVES).value_in(form).bit_length() - 1),
        # Numbers in a cache line.
        "LINE": str(CACHE_LINE // form.bytes),
        "VALID": in_double(beyond.guard),
        **{f"BEYOND_{name.upper()}": in_double(value) for name, value in beyond.program},
        # Results have the type: no cast of a number to its own type (GCC's -Wuseless-cast).
        **{f"BEYOND_{name.upper()}": cast_back.format(in_double(value)) for name, value in beyond.results.items()},
    }
