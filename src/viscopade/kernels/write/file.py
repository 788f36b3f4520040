"""The file around the functions of kernels: head, version, prelude, and for each kernel its guard and identity.

A `Language` is a set of patterns, texts with words in braces; its `numbers` are its number types, each with a suffix of
functions' names ("f" of a C float), and with the arithmetics (host, device) whose bounds it needs.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from decimal import Decimal
from fractions import Fraction
from functools import lru_cache
from importlib.resources import files
from itertools import chain, product
from zlib import crc32

from viscopade import generated
from viscopade.arithmetic.decimals import at_least, at_most
from viscopade.generated import (
    CITE,
    END_CONDITION,
    SPDX,
    comment,
    marker_line,
    marker_lines,
    version_number,
    wrapped,
)
from viscopade.kernels.arithmetic import Arithmetic
from viscopade.kernels.bound import INFINITY, End, ErrorBound, weakest
from viscopade.kernels.kernel import Function, Kernel
from viscopade.kernels.material import NOT_PROVEN, material_kernel
from viscopade.kernels.write import speed_table
from viscopade.kernels.write.language import Language, Number
from viscopade.kernels.write.writer import function_text, generic_text, table_text, words_of

HEAD = 50
"""Most lines of a file's head, with those that begin and end the comment: a screen; a longer table is cut.

The longest head in `exports` is that of a speed table, with twelve functions; it has 43 lines.
"""
PAGE = "docs/reference/kernels.md"
"""The generated page: what is assumed, special values, monotonicity."""

_DIGITS = 3  # of a printed bound: rounding up widens it by at most 1 %
_COLUMNS = 116  # of the head: after the comment mark " * " lines end before column 120
_RANGE_DIGITS = 6  # of the end of a range: rounding inwards loses at most 1e-5 of it
_LONGEST_INTEGER = 6  # digits before the point, as many as `_RANGE_DIGITS` are known; a longer number has an exponent
# Arguments of the example in a head, whatever the unit: 2 cm/s and beta = 1.307 (s/cm)^(1/5) are the paper's ice, the
# others are usual values.
_EXAMPLES = {"speed": 2.0, "beta": 1.307, "v_star": 0.5, "epsilon": 0.995, "one_minus_epsilon": 0.005}
_EXAMPLE_NOTES = {
    "restitution": "the paper's ice, beta = 1.307 (s/cm)^(1/5), at 2 cm/s",
    "beta": "a material whose eps is 0.995 at a speed of 2",
}
SPHERES = (
    "eps: coefficient of normal restitution of two viscoelastic spheres; speed: normal component of the impact "
    "velocity; beta = 3/2 A (rho/m_eff)^(2/5), unit (time/length)^(1/5), in the units of speed; rho = 4/3 E_eff "
    "sqrt(R_eff); v_star = v* = beta^(1/2) speed^(1/10). Of a pair with radii R1, R2, masses m1, m2, Young moduli E, "
    "Poisson ratios nu and D = (1 - nu^2)/E: R_eff = R1 R2/(R1 + R2), m_eff = m1 m2/(m1 + m2), E_eff = 1/(D1 + D2); A: "
    "dissipative constant, a time, (A1 D1 + A2 D2)/(D1 + D2). A wall has infinite R2 and m2."
)
_UNITS = {
    "min": "min = min(eps, 1 - eps)",
    "rebound": "min = min(eps, 1 - eps), for rebound times the speed",
    "r": "r = |result|",
    "ulp": "ulp = unit in the last place of the result",
}
_LEGEND = f"Functions return NaN outside the domain. Assumptions, special values, monotonicity: {PAGE}"


def file_text(
    kernels: Sequence[Kernel], language: Language, command: str, module: str | None = None, lines: Sequence[str] = ()
) -> str:
    """Return the text of a file with the functions of kernels.

    Parameters
    ----------
    kernels : sequence of Kernel
        At least one, no two of the same name.
    language : Language
    command : str
        The command line that makes the file.
    module : str or None
        The module's name, where the language has modules; None: the language's usual name.
    lines : sequence of str
        At the head of the file; none: `head`.

    Raises
    ------
    ValueError
        If a kernel has a table and the language has none.
    """
    name = module or language.stem
    if not language.table and any(kernel.tables for kernel in kernels):
        raise ValueError(
            f"the language is {language.name}: expected c, as the kernel has a table, or a kernel without one "
            "(--accuracy 1e-5)"
        )
    # The texts of kernels, each after that of the kernel that serves outside its table. What all speed tables share
    # comes first, once.
    texts = [speed_table.shared_text()] if any(kernel.fallback for kernel in kernels) else []
    # The file of a scene, which has a head of its own, needs no beta of other materials.
    if language.material is not None and not lines:
        texts.append(kernel_text(material_kernel(), language.material, NOT_PROVEN))
    for kernel in kernels:
        if kernel.fallback is not None:
            texts.append(kernel_text(kernel.fallback, language, " Private in this file: for w outside the table."))
        texts.append(kernel_text(kernel, language))
    # A helper is a file with one function, whose name is that of the file up to its first point.
    helpers = (
        helper for helper in language.helpers.split() if any(f"{helper.partition('.')[0]}(" in text for text in texts)
    )
    blank_lines = "\n" * (language.apart + 1)
    lines = lines or head(kernels, language, command, name)
    return language.file.format(
        head=language.block.format(lines=comment(lines, language.comment)),
        version=_version(language),
        prelude="\n\n".join(preludes(kernels, language)),
        functions=blank_lines.join([*map(prelude, helpers), *texts]),
        generics="\n".join(filter(None, (generics(kernel, language) for kernel in kernels))),
        module=name,
        Module=name.title().replace("_", ""),
    )


def version_text(language: Language, command: str) -> str:
    """Return the text of a file with the version alone."""
    about = ["The version of viscopade that made this file and those beside it: each file of kernels has it, too."]
    head = language.block.format(lines=comment([*marker_lines(command), "", *about], language.comment))
    return f"{head}\n{_version(language)}\n"


def _version(language: Language) -> str:
    """Return the constants with the version: text, and a number such as 10203 for 1.2.3."""
    return language.version.format(version=generated.__version__, number=version_number())


def preludes(kernels: Sequence[Kernel], language: Language) -> Iterator[str]:
    """Return the definitions that a file needs before its functions; those for words of bits only for tables."""
    names = [*language.prelude.split(), *[language.words] * any(kernel.tables for kernel in kernels)]
    return map(prelude, names)


def prelude(name: str) -> str:
    """Return the text of a file in `preludes`."""
    return (files(__package__) / "preludes" / name).read_text(encoding="utf-8").rstrip("\n")


def kernel_text(kernel: Kernel, language: Language, role: str = "") -> str:
    """Return the functions of a kernel in a language, each after what is proven of it.

    `role` is a sentence for the comment of each, after a blank, or nothing.
    """
    # `code` is what makes the kernel's identity: tables and functions without their comments.
    code = [table_text(kernel, table, language) for table in kernel.tables]
    texts = list(code)
    if kernel.fallback is not None:
        # A speed table: all comments first, as its functions in C are one text.
        comments = [
            "\n".join(_comment(kernel, function, language, number))
            for function in kernel.functions
            for number in numbers_of(kernel, language)
        ]
        return _framed(kernel, language, [*comments, speed_table.functions_text(kernel, language, *code)], code)
    for function in kernel.functions:
        for number in numbers_of(kernel, language):
            code.append(function_text(kernel, function, language, number))
            texts.append("\n".join([*_comment(kernel, function, language, number, role), code[-1]]))
    # Types of the language for which the kernel has no functions, and why.
    for form in (number.form for number in language.numbers if number.form not in kernel.formats):
        lines = wrapped(f"There are no functions in {form}: {kernel.missing.get(form, 'nothing is proven')}.")
        texts.append(language.block.format(lines=comment(lines, language.comment)))
    return _framed(kernel, language, texts, code)


def _framed(kernel: Kernel, language: Language, texts: Sequence[str], code: Sequence[str]) -> str:
    """Return the texts of a kernel's functions in a guard of their own; the code makes the guard's value.

    Two headers with the same kernel may be included; a second kernel of the same name but other code is an error.
    """
    return language.kernel.format(
        functions=("\n" * (language.apart + 1)).join(texts),
        generics=generics(kernel, language),
        name=kernel.name,
        GUARD=f"VISCOPADE_{'SPEED_' * bool(kernel.fallback)}{kernel.name.upper()}",
        # A checksum of 32 bits: "0x" and 8 hexadecimal digits.
        identity=f"{crc32(''.join(code).encode()):#010x}",
    )


def generics(kernel: Kernel, language: Language) -> str:
    """Return the texts that make one function of those for each type."""
    if not language.generic:
        return ""
    return "\n".join(generic_text(kernel, function, language) for function in kernel.functions)


def numbers_of(kernel: Kernel, language: Language) -> list[Number]:
    """Return the numbers of a language for which a kernel has constants."""
    return [number for number in language.numbers if number.form in kernel.formats]


def call(kernel: Kernel, function: Function, language: Language, arguments: Sequence[str], number: Number) -> str:
    """Return the text of a call of a function of a kernel, with arguments as texts, for one of a language's types."""
    return language.call.format(**words_of(kernel, function), suffix=number.suffix, arguments=", ".join(arguments))


# --- what is proven ---------------------------------------------------------------------------------------------------


def error_parts(bound: ErrorBound) -> list[tuple[str, str]]:
    """Return the parts E min, R r and U ulp of a bound: pairs of a number, rounded up, and its unit.

    The units are min = min(eps, 1 - eps), r = |result| and ulp. Rounding that E would not show is in R, as min <= r.
    """
    if bound.relative_to == "value":
        sizes = [(bound.relative + bound.last, "r")]
    else:
        # Rounding shows in the last of E's digits if it is above 10^-3 of the formula's error.
        shown = bound.rounding * 10**_DIGITS > bound.formula
        sizes = [(bound.formula + shown * bound.rounding, "min"), (bound.last + (not shown) * bound.rounding, "r")]
    return [(at_most(size, _DIGITS), unit) for size, unit in (*sizes, (bound.ulps, "ulp")) if size]


def error_text(bound: ErrorBound) -> str:
    """Return an error as text: E min + R r."""
    return " + ".join(f"{size} {unit}" for size, unit in error_parts(bound)) or "0"


# Far more than a file has functions: head, comments and macros ask for the same ones.
@lru_cache(maxsize=1024)
def stated_bounds(kernel: Kernel, function: Function, arithmetic: Arithmetic) -> Sequence[ErrorBound]:
    """Return the bounds of a kernel's function in an arithmetic, the narrowest range first: the best of each range."""
    # Of bounds with the same printed range, the smallest relative error (absolute parts are not printed).
    best = dict[str, ErrorBound]()
    for bound in kernel.bound(function.name, arithmetic.place, arithmetic.form.name):
        text = range_text(bound)
        best[text] = min(best.get(text, bound), bound, key=lambda b: b.relative + b.last)
    # From the widest range on: a narrower range is of use if its error is a smaller one.
    useful = list[ErrorBound]()
    for bound in reversed(best.values()):
        if not any(_covers(wider, bound) and error_text(wider) == error_text(bound) for wider in useful):
            useful.append(bound)
    return useful[::-1]


def _covers(wider: ErrorBound, bound: ErrorBound) -> bool:
    """Return whether the first bound holds on the range of the second: of v*, and of speeds if it has one."""
    return wider.covers(bound.low, bound.high) and wider.speeds in (None, bound.speeds)


def range_text(bound: ErrorBound) -> str:
    """Return the range of a bound, rounded inwards: "0.001 <= v* <= 10", "all v*", "…, 1e-30 <= speed <= 1e30"."""
    low, high = bound.low, bound.high
    text = _between("v*", low, high) if low or high != INFINITY else "all v*"
    if bound.speeds is not None:
        text += f", {_between('speed', *bound.speeds)}"
    return text


def _between(name: str, low: Fraction, high: End) -> str:
    """Return "low <= name <= high" with both ends rounded inwards; an end of 0 or infinity is left out."""
    least = at_most(low, _RANGE_DIGITS) if low else ""
    most = at_least(high, _RANGE_DIGITS) if high != INFINITY else ""
    # 1e+30 instead of a number with many digits before the point
    least, most = (
        f"{Decimal(text).normalize():e}" if len(text.partition(".")[0]) > _LONGEST_INTEGER else text
        for text in (least, most)
    )
    return f"{least} <= " * bool(least) + name + f" <= {most}" * bool(most)


def on_all_machines(kernel: Kernel, function: Function, number: Number) -> list[ErrorBound]:
    """Return the bounds of a kernel's function of a type, wherever it runs, the narrowest range first."""
    *others, last = (stated_bounds(kernel, function, arithmetic) for arithmetic in number.arithmetics)
    common = list[ErrorBound]()
    for bound in last:
        # On each other machine the first bound, of the narrowest range, that covers this one's range.
        covering = [[other for other in bounds if _covers(other, bound)][:1] for bounds in others]
        if all(covering):
            common.append(weakest([bound, *chain.from_iterable(covering)]))
    return common


def places(number: Number) -> str:
    """Return where a file's functions of a type run, if there are several places: "host and device"."""
    return " and ".join(arithmetic.place for arithmetic in number.arithmetics) if len(number.arithmetics) > 1 else ""


def where_normal(kernel: Kernel, bounds: Iterable[ErrorBound]) -> str:
    """Return the condition of bounds besides their ranges, "where … are normal numbers"; "" if there is none.

    It is that of the kernel, and that of each of its bounds which is absolute where a number is subnormal.
    """
    *names, last = [*kernel.normal, *sorted({name for bound in bounds for name in bound.normal})] or [""]
    if names:
        return f"where {', '.join(names)} and {last}, as computed, are normal numbers"
    return f"where {last}, as computed, is a normal number" * bool(last)


def _comment(kernel: Kernel, function: Function, language: Language, number: Number, role: str = "") -> Iterator[str]:
    """Yield the comment before a kernel's function of a type, and the line that defines its error as a macro.

    The comment is "eps." and `role`, a sentence or nothing, and "Error <= E min + R r for RANGE; …, where … are normal
    numbers." for each machine.
    """
    lines = [f"{function.meaning}.{role}"]
    for arithmetic in number.arithmetics:
        bounds = stated_bounds(kernel, function, arithmetic)
        if bounds:
            place = f" on the {arithmetic.place}" if places(number) else ""
            errors = "; ".join(f"{error_text(bound)} for {range_text(bound)}" for bound in bounds)
            conditions = filter(None, [f"Error{place} <= {errors}", where_normal(kernel, bounds)])
            lines += wrapped(f"{', '.join(conditions)}.")
    yield language.block.format(lines=comment(lines, language.doc or language.comment))
    # The macro has the first number of the error on the widest range, the last one; the rest is a comment.
    for bound in on_all_machines(kernel, function, number)[-1:] if language.macro else ():
        (first, unit), *others = error_parts(bound) or [("0", "r")]
        rest = " + ".join([unit, *map(" ".join, others)])
        conditions = filter(None, [f"{rest} for {range_text(bound)}", places(number), where_normal(kernel, [bound])])
        yield language.macro.format(
            NAME=f"{function.name}_{kernel.name}".upper(),
            SUFFIX=number.suffix.upper(),
            error=first,
            rest=", ".join(conditions),
        )


# --- the head ---------------------------------------------------------------------------------------------------------


def head(kernels: Sequence[Kernel], language: Language, command: str, module: str) -> list[str]:
    """Return the lines at the head of a file of kernels, without comment marks; at most `HEAD` with those.

    They are the command line that makes the file, licence, symbols, end condition, the table of public functions with
    their proven errors, an example with the file's module, and what to cite.
    """
    before = [
        marker_line(command),
        *SPDX,
        "",
        *wrapped(SPHERES, _COLUMNS),
        *wrapped(f"End condition: {END_CONDITION}.", _COLUMNS),
        "",
        *wrapped(_legend(kernels, language), _COLUMNS),
        *wrapped(_conditions(kernels, language), _COLUMNS),
    ]
    after = [
        *wrapped(_other_names(kernels, language), _COLUMNS),
        _LEGEND,
        "",
        *_example(kernels[-1], language, module),
        *wrapped(CITE, _COLUMNS),
    ]
    # Two lines begin and end the comment.
    room = HEAD - 2 - len(before) - len(after)
    # All functions, a line each. If these are too many, the first one of each kernel, and a line that says so.
    table = _table(kernels, language, module, slice(None))
    if len(table) > room:
        table = [*_table(kernels, language, module, slice(1))[: room - 1], "(and others, see below)"]
    return [*before, *table, *after]


def in_module(text: str, module: str) -> str:
    """Return a text with the name of the file's module instead of the usual one."""
    named = re.sub(r"\bViscopade(?=\.)", module.title().replace("_", ""), text)
    return re.sub(r"\bviscopade(?=[.:])", module, named)


def _legend(kernels: Sequence[Kernel], language: Language) -> str:
    """Return what the units of the kernels' errors mean, as far as they occur in a language's types; "" for none."""
    units = set[str]()
    for kernel in kernels:
        for function in kernel.functions:
            for number in numbers_of(kernel, language):
                bounds = [bound for a in number.arithmetics for bound in stated_bounds(kernel, function, a)]
                of_function = {unit for bound in bounds for _, unit in error_parts(bound)}
                # For rebound min is times the speed, which has a text of its own in place of that of min.
                units |= of_function | ({"rebound"} if function.name == "rebound" and "min" in of_function else set())
    texts = [text for unit, text in _UNITS.items() if unit in units and (unit, "rebound" in units) != ("min", True)]
    return f"Bounds of |error| below: {'; '.join(texts)}." if texts else ""


def _conditions(kernels: Sequence[Kernel], language: Language) -> str:
    """Return what must be a normal number for the kernels' bounds in the head's table, of all a language's types."""
    # Condition -> names of the kernels with it.
    kernels_of = dict[str, list[str]]()
    for kernel in kernels:
        pairs = product(kernel.functions, numbers_of(kernel, language))
        condition = where_normal(kernel, [b for f, number in pairs for b in on_all_machines(kernel, f, number)])
        kernels_of.setdefault(condition, []).append(kernel.name)
    subjects = ["Bounds"] if len(kernels_of) == 1 else [f"Those of {', '.join(names)}" for names in kernels_of.values()]
    return " ".join(
        f"{subject} hold {condition}." for subject, condition in zip(subjects, kernels_of, strict=True) if condition
    )


def _example(kernel: Kernel, language: Language, module: str) -> Iterator[str]:
    """Yield the lines of an example: what makes the functions of the file's module known, and a call of a kernel."""
    # restitution or beta, if the kernel has one, else its first function.
    by_name = {function.name: function for function in kernel.functions}
    function = next((by_name[name] for name in ("restitution", "beta") if name in by_name), kernel.functions[0])
    number = numbers_of(kernel, language)[0]
    literals = [number.literal(_EXAMPLES[argument]) for argument in function.arguments]
    result = "eps" if function.result == "epsilon" or function.name == "restitution" else function.result
    lines = f"{language.take}\n{language.use}".format(
        module=module,
        ending=language.ending,
        call=call(kernel, function, language, literals, number),
        type=number.type,
        result=result,
        name=function.name,
    )
    note = _EXAMPLE_NOTES.get(function.name)
    yield f"Example{f' ({note})' if note else ''}:"
    yield from (f"    {in_module(line, module)}" for line in lines.splitlines() if line)


def _other_names(kernels: Sequence[Kernel], language: Language) -> str:
    """Return the sentences below the head's table: how arrays are given, and which names are private."""
    sentences = [speed_table.ARRAYS] if any(kernel.fallback for kernel in kernels) else []
    sentences += filter(None, [language.others])
    # In C, where every function of a file can be called; other languages have modules, or only public functions.
    if language.macro:
        # Functions that serve outside of a speed table are named like public ones: one of them is the example.
        names = [f"viscopade_{f.name}_{k.fallback.name}" for k in kernels if k.fallback for f in k.fallback.functions]
        example = f" ({names[0]}, for example)" if names else ""
        sentences.append(f"Other names{example} are private, and may change.")
    return " ".join(sentences)


def _table(kernels: Sequence[Kernel], language: Language, module: str, functions: slice) -> list[str]:
    """Return the lines of a table of proven errors: a call, its widest range, and the error in each type of a language.

    The slice chooses among each kernel's functions.
    """
    # "error, float (host and device), name + f": a type's functions have the name in the table and a suffix, unless one
    # call is for all types.
    titles = [
        f"error, {number.form}"
        + f" ({places(number)})" * bool(places(number))
        + f", name + {number.suffix}" * (number is not language.numbers[0] and "{suffix}" in language.call)
        for number in language.numbers
    ]
    rows = [("function", "range", *titles)]
    for kernel in kernels:
        for function in kernel.functions[functions]:
            rows += [(in_module(name, module), *cells) for name, *cells in _rows(kernel, function, language)]
    if language.material is not None:
        rows += [
            row
            for function in material_kernel().functions
            for row in _rows(material_kernel(), function, language.material)
        ]
    # Columns are as wide as their longest text, with two blanks between.
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return ["  ".join(map(str.ljust, row, widths)).rstrip() for row in rows]


def _rows(kernel: Kernel, function: Function, language: Language) -> Iterator[tuple[str, ...]]:
    """Yield the rows of a kernel's function: its call, its widest range, and the error in each type of a language.

    Functions of speed tables have a row more for each of their functions of arrays. A type whose bound has another
    range than the row has that range behind its error, and a type without functions "-".
    """
    # The widest range is the last one.
    bounds = [
        next(iter(on_all_machines(kernel, function, number)[-1:]), None) if number.form in kernel.formats else None
        for number in language.numbers
    ]
    texts = [range_text(bound) if bound else "" for bound in bounds]
    first = next(filter(None, texts), None)
    cells = [
        error_text(bound) + f" ({text})" * (text != first) if bound else "-"
        for bound, text in zip(bounds, texts, strict=True)
    ]
    if first is None:
        first, cells = kernel.domain, ["not proven" for _ in language.numbers]
    yield call(kernel, function, language, function.arguments, language.numbers[0]), first, *cells
    if kernel.fallback is not None:
        for name, arguments in speed_table.ARRAY_FUNCTIONS.items():
            of_arrays = replace(function, name=f"{function.name}_{name}")
            yield call(kernel, of_arrays, language, arguments, language.numbers[0]), first, *cells
