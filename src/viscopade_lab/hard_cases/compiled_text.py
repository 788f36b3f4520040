"""Exported text as others use it: C compiled, Python run, JSON read, and their values compared with exact quotients."""

from __future__ import annotations

import ctypes
import json
import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from viscopade.arithmetic.balls import ball_of, working
from viscopade.arithmetic.formats import DOUBLE, FLOAT, Format
from viscopade.kernels import requests, toolchain
from viscopade.kernels.forms import formulas, rounding_bounds
from viscopade.kernels.forms.quotient import Quotient
from viscopade.kernels.requests import Request
from viscopade.kernels.rounding import Rounded, of_branch
from viscopade.theory.pade import DegenerateError
from viscopade_lab.hard_cases.finding import Cell, Chart, Check, ResultTable, curve

NO_CONTRACTION = "-ffp-contract=off"  # without it a compiler may fuse products and sums, which Python does not
_DEFINITION = re.compile(r"^static inline (double|float) (viscopade_\w+)\((?:double|float) \w+\)$", re.MULTILINE)
_COEFFICIENT = re.compile(r"^    ([ab])(\d+) = (\S+)$", re.MULTILINE)
_NUMPY = {"double": np.float64, "float": np.float32}
_CHARTED = "pade_3_6"

Array = npt.NDArray[Any]
Function = Callable[[Array], Array]


def python(text: str) -> dict[str, Any]:
    """Return what an exported Python module defines."""
    names: dict[str, Any] = {}
    exec(compile(text, "exported module", "exec"), names)
    return names


def proven_inverses(text: str) -> Iterator[tuple[str, Fraction, Fraction]]:
    """Yield the names of the kernels in a JSON table, the proven error of v* and that of its rounding, in double."""
    for record in json.loads(text)["approximants"]:
        (variant,) = (v for v in record["variants"] if v["type"] == "double")
        yield record["name"], Fraction(variant["bound"]), Fraction(variant["rounding"]["v_star"]["relative"])


# --- C ----------------------------------------------------------------------------------------------------------------


def compiled(header: str) -> dict[str, Function]:
    """Return the functions of one argument in a header, compiled, by name without "viscopade_".

    Raises
    ------
    compilers.ToolchainError
        If there is no compiler, or it fails.
    """
    found = toolchain.find_compiler()
    compiler = replace(found, words=(*found.words, NO_CONTRACTION))
    definitions = _DEFINITION.findall(header)
    lines = ['#include "exported.h"']
    for kind, name in definitions:
        lines += [
            f"void trip_{name}(long n, const {kind} *x, {kind} *y);",
            f"void trip_{name}(long n, const {kind} *x, {kind} *y)",
            f"{{ for (long i = 0; i < n; i++) y[i] = {name}(x[i]); }}",
        ]
    sources = {"trips.c": "\n".join([*lines, ""])}
    library = toolchain.build(compiler, {"scalar": sources}, {"exported.h": header})["scalar"]
    return {name.removeprefix("viscopade_"): _function(library, kind, name) for kind, name in definitions}


def _function(library: ctypes.CDLL, kind: str, name: str) -> Function:
    called = library[f"trip_{name}"]
    called.restype, called.argtypes = None, [ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p]

    def function(x: Array) -> Array:
        given = np.ascontiguousarray(x, dtype=_NUMPY[kind])
        result = np.empty_like(given)
        called(len(given), given.ctypes.data, result.ctypes.data)
        return result

    return function


# --- the exact quotient -----------------------------------------------------------------------------------------------


def exact_polynomial(ascending: Sequence[Fraction], x: Fraction) -> Fraction:
    """Return a polynomial's exact value, as a sum of powers (the kernels use Horner's rule)."""
    return sum((c * x**i for i, c in enumerate(ascending)), Fraction(0))


class ExactQuotient(NamedTuple):
    """The exact quotient at a v*, and by how much a computed one may be off."""

    value: Fraction
    error: float


def allowed(
    a: Sequence[Fraction], b: Sequence[Fraction], form: Format, v_star: Fraction, threshold: int
) -> ExactQuotient | None:
    """Return what the rounding analysis says of the code for one v*; None if a sum may vanish.

    Beyond 2^threshold the polynomials are those in u = 1/v*.
    """
    given = formulas.dense(a=a, b=b)
    branch = formulas.epsilon_branches(given)[v_star > Fraction(2) ** threshold]
    with working(rounding_bounds.BITS):
        numbers = {name: Rounded(ball_of(c), form) for name, c in {**given, "v_star": v_star}.items()}
        try:
            found = of_branch(branch, ["epsilon"], numbers, form)["epsilon"]
        except ArithmeticError:
            return None
        if not found.relative < 0.5:
            return None
        error = float(found.absolute.abs_upper())
    return ExactQuotient(exact_polynomial(a, v_star) / exact_polynomial(b, v_star), error)


# --- comparisons ------------------------------------------------------------------------------------------------------


@dataclass
class TextComparison:
    """What was compared, of all texts.

    Attributes
    ----------
    compared, different : int
        Values of compiled C and of Python, in type double, and how many of them differ in any bit.
    coefficients, changed : int
        Coefficients in JSON tables, and how many of them do not become those of the Python module.
    rows : list
        By text and type: name, type, values compared with exact ones, largest error/allowed, largest error/stated.
    why_not : str
        Why no C was compiled; "" if it was.
    points : list of (v*, error, allowed)
        Of one kernel in type double, in units of 2^-53 of the value.
    """

    compared: int = 0
    different: int = 0
    coefficients: int = 0
    changed: int = 0
    rows: list[tuple[str, str, int, float, float]] = field(default_factory=list)
    why_not: str = ""
    points: list[tuple[float, float, float]] = field(default_factory=list)


def v_star_samples(generator: np.random.Generator, number: int, form: Format) -> Array:
    """Return v* of a type: all exponents, and more near 1."""
    tiny, huge = 2.0 ** (1 - form.largest - form.precision + 1), 2.0**form.largest
    everywhere = np.exp(generator.uniform(math.log(tiny), math.log(huge), number // 2))
    near = np.exp(generator.uniform(math.log(1e-3), math.log(10), number - number // 2))
    return np.concatenate([everywhere, near, [0.0, 1.0, tiny, huge]]).astype(_NUMPY[form.name])


def same(function: Function, reference: Callable[[float], float], x: Array) -> tuple[int, int]:
    """Return how many values are compared (where the reference does not refuse) and how many differ in a bit."""
    expected, taken = [], []
    for i, value in enumerate(x.tolist()):
        try:
            expected.append(reference(value))
        except ValueError:
            continue
        taken.append(i)
    got = function(x[taken])
    return len(taken), int(np.count_nonzero(got.view(np.int64) != np.array(expected).view(np.int64)))


def compare_quotients(request: Request, generator: np.random.Generator, number: int, into: TextComparison) -> None:
    """Compile and run the quotients of a request, and compare them with each other and with exact values."""
    text = request.render("python")
    module = python(text)
    records = json.loads(request.render("json"))["approximants"]
    functions = _compiled_or_not(request.render("c"), into)
    for kernel, record in zip(request.quotients(), records, strict=True):
        name = f"epsilon_{kernel.name}"
        given = tuple(tuple(map(Fraction, part)) for part in _coefficients(record))
        _compare_coefficients(given, text, name, into)
        if name in functions:
            compared, different = same(functions[name], module[name], v_star_samples(generator, number, DOUBLE))
            into.compared += compared
            into.different += different
        for form in (DOUBLE, FLOAT):
            function = functions.get(name + form.suffix)
            if function is None and form == DOUBLE:
                function = _vectorised(module[name])
            if function is not None:
                x = v_star_samples(generator, number, form)
                _compare_with_exact(kernel, record, form, x, function, into)


def compare_inverses(request: Request, generator: np.random.Generator, number: int, into: TextComparison) -> None:
    """Compile and run the inverse kernels of a request, and compare C with Python."""
    module, functions = python(request.render("python")), _compiled_or_not(request.render("c"), into)
    portions = np.concatenate(
        [np.exp(generator.uniform(math.log(1e-300), 0, number)), generator.uniform(0, 1, number), [1.0, 0.5]]
    )
    for name in functions:
        if name in module:
            compared, different = same(functions[name], module[name], portions)
            into.compared += compared
            into.different += different


def _compiled_or_not(header: str, into: TextComparison) -> dict[str, Function]:
    try:
        return compiled(header)
    except toolchain.ToolchainError as error:
        into.why_not = str(error)
        return {}


def _vectorised(function: Callable[[float], float]) -> Function:
    """Apply a function to each number; NaN where it refuses."""

    def one(value: float) -> float:
        try:
            return function(value)
        except ValueError:
            return math.nan

    return lambda x: np.array([one(value) for value in x.tolist()])


def _coefficients(record: Mapping[str, Any], form: Format = DOUBLE) -> tuple[list[str], list[str]]:
    """Return a and b of a record as its strings: those of a type if it has several."""
    part = record if "a" in record else next(v for v in record["variants"] if v["type"] == form.name)
    return part["a"], part["b"]


def _compare_coefficients(
    given: tuple[tuple[Fraction, ...], ...], module: str, function: str, into: TextComparison
) -> None:
    """Compare coefficients a and b with those in the text of a module's function, which leaves out zeros."""
    body = module.split(f"def {function}(")[1].split("\ndef ")[0]
    held = {letter + exponent: float(value) for letter, exponent, value in _COEFFICIENT.findall(body)}
    wanted = {f"{letter}{i}": float(c) for letter, part in zip("ab", given, strict=True) for i, c in enumerate(part)}
    into.coefficients += len(wanted)
    into.changed += sum(held.get(name, 0.0) != wanted.get(name, 0.0) for name in held.keys() | wanted.keys())


def _stated(record: Mapping[str, Any], form: Format) -> tuple[float, float]:
    """Return the bound of the rounding that a record states for a type, and up to which v* it holds."""
    if "a" in record:
        to = max((float(bound["v_star_max"]) for bound in record["proven"]), default=-1.0)
        return float(record["rounding"].get(form.name, math.inf)), to
    variant = next(v for v in record["variants"] if v["type"] == form.name)
    return float(variant["rounding"]), float(Fraction(record["v_star_max"]))


def _compare_with_exact(
    kernel: Quotient, record: Mapping[str, Any], form: Format, x: Array, function: Function, into: TextComparison
) -> None:
    a, b = ([Fraction(c) for c in part] for part in kernel.rounded(form))
    table = [[Fraction(c) for c in part] for part in _coefficients(record, form)]
    bound, to = _stated(record, form)
    low, high = (float(end) for end in kernel.interval) if kernel.interval else (0.0, math.inf)
    end = float(kernel.end[1]) if kernel.end else math.inf
    threshold, values = kernel.threshold(form), function(x)
    count, worst, worst_stated = 0, 0.0, 0.0
    for v, value in zip(x.tolist(), values.tolist(), strict=True):
        if not (low <= v <= high and v < end):
            continue
        found = allowed(a, b, form, Fraction(v), threshold)
        if found is None:
            continue
        count += 1
        if not math.isfinite(value):  # where the kernel is meant to be used it refuses nothing
            worst = math.inf
            continue
        error = float(abs(Fraction(value) - found.value))
        worst = max(worst, error / found.error)
        if v <= to:
            exact = exact_polynomial(table[0], Fraction(v)) / exact_polynomial(table[1], Fraction(v))
            worst_stated = max(worst_stated, float(abs(Fraction(value) / exact - 1)) / bound)
        if kernel.name == _CHARTED and form == DOUBLE and 1e-4 <= v <= 1e6:
            scale = float(found.value) * 2.0**-53
            into.points.append((v, error / scale, found.error / scale))
    into.rows.append((kernel.name, form.name, count, worst, worst_stated))


def _wanted(generator: np.random.Generator, thorough: bool) -> list[Request]:
    """Return what to export: the paper's table, and if thorough Padé approximants at random and best ones."""
    if not thorough:
        return [requests.PAPER]
    degrees: list[tuple[int, int]] = []
    while len(degrees) < 8:
        m = int(generator.integers(0, 11))
        candidate = (m, int(generator.integers(m, m + 5)))
        if candidate not in degrees and candidate not in requests.PAPER_DEGREES and _exists(candidate):
            degrees.append(candidate)
    best = Request(minimax=((2, 3), (3, 4)), v_star_max="2")
    return [requests.PAPER, Request(pade=degrees), best]


def _exists(degrees: tuple[int, int]) -> bool:
    """Whether there is an approximant of these degrees, with coefficients that both types hold."""
    try:
        for kernel in Request(pade=[degrees]).quotients():
            for form in (DOUBLE, FLOAT):
                kernel.threshold(form)
                kernel.rounded(form)
    except (DegenerateError, ValueError):
        return False
    return True


def all_trips(generator: np.random.Generator, number: int, inverse: Request, thorough: bool) -> TextComparison:
    """Compare everything."""
    into = TextComparison()
    for request in _wanted(generator, thorough):
        compare_quotients(request, generator, number, into)
    compare_inverses(inverse, generator, number, into)
    return into


# --- what is shown ----------------------------------------------------------------------------------------------------


def table(found: TextComparison) -> ResultTable:
    """Return the errors by text and type."""
    rows: list[tuple[Cell, ...]] = [
        (name, form, count, f"{worst:.3f}", f"{stated:.3f}" if stated else "")
        for name, form, count, worst, stated in found.rows
    ]
    compared = f"{found.different} of {found.compared:,} values differ" if not found.why_not else "not run: no compiler"
    rows.append(("C and Python, every bit", "double", found.compared, compared, ""))
    header = ("exported text", "type", "values", "largest error/allowed at that v*", "largest error/stated bound")
    return ResultTable(
        "Exported text, compiled or run: against exact quotients of its own coefficients", header, tuple(rows)
    )


def chart(found: TextComparison) -> Chart:
    """Return the rounding errors of one kernel with the bound at each v*."""
    points = sorted(found.points)
    x = [v for v, _, _ in points]
    return Chart(
        "Rounding of [3/6] as exported",
        "v*",
        "relative error in units of 2^-53",
        (
            curve("error", x, [error for _, error, _ in points], "points"),
            curve("proven at that v*", x, [bound for _, _, bound in points], "bound"),
        ),
    )


def checks(found: TextComparison) -> tuple[Check, ...]:
    """Return what must hold."""
    return (
        Check.never("values of compiled C that differ in a bit from those of the exported Python", found.different),
        Check.never("coefficients in JSON tables that do not become those of the exported Python", found.changed),
        Check.within(
            "largest round-off of exported code, relative to the running error bound of Horner's rule at that v*",
            max(row[3] for row in found.rows),
        ),
        Check.within(
            "largest error against the quotient of the JSON table's decimals, relative to the round-off that "
            "the table states",
            max(row[4] for row in found.rows),
        ),
    )
