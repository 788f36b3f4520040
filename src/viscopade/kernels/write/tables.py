"""Tables of coefficients and of proofs as CSV, JSON and LaTeX.

In all functions `command` is the command line that makes the file; it stands in its head.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from decimal import Context
from itertools import zip_longest
from json import dumps
from typing import Any

from viscopade import arguments
from viscopade.arithmetic.formats import decimal_value
from viscopade.generated import END_CONDITION, comment, json_head, marker_lines, wrapped
from viscopade.kernels.arithmetic import HOST
from viscopade.kernels.kernel import Kernel
from viscopade.kernels.write.file import SPHERES, error_text, range_text, stated_bounds
from viscopade.kernels.write.targets import LATEX_DIGITS

SERIES_SOURCE = "coefficients of the Maclaurin series eps = sum_k h_k v*^k (the paper's Eq. 7)"
SERIES_NO_BOUND = "The file is about the coefficients: no bound of a truncated sum's error is claimed in it."
CERTIFICATE_SOURCE = (
    "proofs by ball arithmetic: each panel of the reference (rows of 1 - eps and eps, with their proven relative "
    "error) is cut into equal parts, on each of which the deviation is below the bound"
)
PROVEN = (
    "proven by ball arithmetic on a subdivision of the interval, with the exact eps enclosed; the rounding is proven "
    "for the order of evaluation in code (to nearest, with or without fused multiply-add), and adds to the error"
)
_MAX_DIGITS = 30  # in LaTeX: the records have 40 digits, and a second rounding is right with ten digits to spare
_DOUBLE_DIGITS = 17  # of the coefficients of a best approximant, whose type is double: 17 digits identify one


def csv_table(kernels: Sequence[Kernel], command: str) -> str:
    """Return the columns m,n,symbol,index,value of kernels [m/n], after lines of comment that begin with "#".

    `symbol` is a or b, the coefficients of the numerator and of the denominator; `index` is the power of v*.
    """
    rows = (
        (kernel.record["m"], kernel.record["n"], symbol, index, value)
        for kernel in kernels
        for symbol in "ab"
        for index, value in enumerate(_quotient(kernel, "csv")[symbol])
    )
    return _csv(_head(kernels, command), ("m", "n", "symbol", "index", "value"), rows)


def json_table(kernels: Sequence[Kernel], command: str) -> str:
    """Return one JSON object; its "approximants" hold the records of kernels, with numbers as decimal strings."""
    source = "; ".join(dict.fromkeys(kernel.source for kernel in kernels))
    rest: dict[str, object] = {"error": PROVEN, "approximants": [kernel.record for kernel in kernels]}
    return _json(command, source, rest)


def certificates(kernels: Sequence[Kernel], command: str) -> str:
    """Return one JSON object; its "certificates" hold the data for independent checks of the kernels' proofs."""
    proofs = [{**head, **certificate.record()} for kernel in kernels for head, certificate in kernel.proofs]
    return _json(command, CERTIFICATE_SOURCE, {"certificates": proofs})


def latex_table(kernels: Sequence[Kernel], command: str, digits: int = LATEX_DIGITS) -> str:
    """Return a LaTeX tabular in the layout of the paper's Table I, rounded to `digits` significant digits.

    Raises
    ------
    ValueError
        For more digits than the coefficients have.
    """
    # Only Padé approximants have "a" in their record; best ones have the variants of each type.
    most = _MAX_DIGITS if all("a" in kernel.record for kernel in kernels) else _DOUBLE_DIGITS
    arguments.integer("digits", digits, 1, most)
    rows = (line for kernel in kernels for line in (r"\hline", *(rf"{row} \\" for row in _latex_rows(kernel, digits))))
    return "\n".join(
        [
            comment(_head(kernels, command), "%"),
            r"\begin{tabular}{lllll}",
            r"$m$ & $n$ & $a_i$ & $b_i$ & \\",
            *rows,
            r"\end{tabular}",
            "",
        ]
    )


def series_csv(h: Sequence[str], command: str) -> str:
    """Return the columns k,h_k of the series' coefficients, after lines of comment that begin with "#"."""
    return _csv(_series_head(command), ("k", "h_k"), enumerate(_decimals(h)))


def series_latex(h: Sequence[str], command: str) -> str:
    """Return a LaTeX tabular with the columns k and h_k."""
    rows = (rf"${k}$ & ${latex_number(h_k, len(h_k))}$ \\" for k, h_k in enumerate(_decimals(h)))
    head = comment(_series_head(command), "%")
    return "\n".join([head, r"\begin{tabular}{rl}", r"$k$ & $h_k$ \\", r"\hline", *rows, r"\end{tabular}", ""])


def _series_head(command: str) -> list[str]:
    """Return the lines of comment before the series' coefficients."""
    return [
        *marker_lines(command),
        "",
        "The coefficient of normal restitution eps of two viscoelastic spheres:",
        f"{SERIES_SOURCE}, v* = beta^(1/2) v^(1/10).",
        "",
        *wrapped(f"End condition: {END_CONDITION}."),
        "",
        SERIES_NO_BOUND,
    ]


def series_json(h: Sequence[str], command: str) -> str:
    """Return one JSON object; its "h" holds the series' coefficients as decimal strings."""
    return _json(command, SERIES_SOURCE, {"error": SERIES_NO_BOUND, "order": len(h) - 1, "h": _decimals(h)})


def _decimals(h: Sequence[str]) -> list[str]:
    """Return the coefficients if they are finite decimal numbers; `decimal_value` refuses others."""
    for value in h:
        decimal_value(value)
    return list(h)


def _quotient(kernel: Kernel, target: str) -> Mapping[str, Sequence[str]]:
    """Return the coefficients a and b of a quotient in v*, as decimals: "a" -> (a_0, a_1, …), and "b".

    Of a best approximant they are those of type double, its first variant.

    Raises
    ------
    ValueError
        If the kernel is no such quotient; the message names the target, "csv" or "latex".
    """
    record: Mapping[str, Any] = kernel.record
    if "m" not in record:
        # Compact and inverse kernels are quotients in a root of v* or of eps.
        raise ValueError(f"{kernel.name} is no quotient of polynomials in v*, which {target} expects: use json")
    coefficients: Mapping[str, Sequence[str]] = record if "a" in record else record["variants"][0]
    return coefficients


def _head(kernels: Sequence[Kernel], command: str) -> list[str]:
    """Return the lines of comment before a table of kernels: symbols, end condition, and the proven errors of each."""
    errors = [
        "; ".join(f"{error_text(bound)} for {range_text(bound)}" for bound in stated_bounds(k, k.functions[0], HOST))
        for k in kernels
    ]
    return [
        *marker_lines(command),
        "",
        *wrapped(SPHERES),
        "[m/n](v*) = (a_0 + a_1 v* + ... + a_m v*^m) / (b_0 + b_1 v* + ... + b_n v*^n)",
        *wrapped(f"End condition: {END_CONDITION}."),
        *(
            line
            for kernel, error in zip(kernels, errors, strict=True)
            for line in wrapped(f"{kernel.label}: {kernel.source}. Domain: {kernel.domain}. Error <= {error}.")
        ),
        *wrapped(f"min = min(eps, 1 - eps), r = [m/n]; {PROVEN}."),
    ]


def _csv(head: Iterable[str], columns: tuple[str, ...], rows: Iterable[tuple[object, ...]]) -> str:
    """Return the text of a file: the head as comment, the columns' names and the rows, whose fields need no quotes."""
    return "\n".join([comment(head, "#"), *(",".join(map(str, row)) for row in (columns, *rows))]) + "\n"


def _json(command: str, source: str, rest: dict[str, object]) -> str:
    """Return an object as text: its head (command, source, end condition), then the rest."""
    return dumps(json_head(command, source) | rest, indent=2, ensure_ascii=False) + "\n"


def _latex_rows(kernel: Kernel, digits: int) -> list[str]:
    """Return the rows of one approximant: m, n, a_i, and b_i in two columns, as in the paper, rounded to digits."""
    coefficients = _quotient(kernel, "latex")
    a, b = (
        [f"${symbol}_{{{i}}}={latex_number(value, digits)}$" for i, value in enumerate(coefficients[symbol])]
        for symbol in "ab"
    )
    # As many rows as there are a_i, or half as many as b_i, rounded up.
    height = max(len(a), (len(b) + 1) // 2)
    degrees = [(f"${kernel.record['m']}$", f"${kernel.record['n']}$")]
    # m and n stand in the first row only; cells that are left are empty.
    columns = zip_longest(degrees, a, b[:height], b[height:])
    return [" & ".join([*(mn or ("", "")), *(cell or "" for cell in cells)]) for mn, *cells in columns]


def latex_number(value: str, digits: int) -> str:
    """Return a decimal number in LaTeX, correctly rounded to significant digits."""
    context = Context(prec=digits)
    number = context.create_decimal(value)
    if not number:
        return "0"
    # From 1e-5 on, with at most four zeros before the first digit, up to as many digits as are known; else m 10^e.
    if -6 < number.adjusted() < digits:
        return f"{number:f}"
    exponent = number.adjusted()
    return f"{number.scaleb(-exponent, context):f}\\times10^{{{exponent}}}"
