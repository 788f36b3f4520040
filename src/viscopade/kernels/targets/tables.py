"""Tables of coefficients as CSV, JSON and LaTeX."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from decimal import Context
from itertools import zip_longest
from json import dumps
from textwrap import wrap

from viscopade import arguments
from viscopade.arithmetic.formats import decimal_value
from viscopade.generated import END_CONDITION, WIDTH, comment, generated_by, marker_line, template
from viscopade.kernels.forms.kernel import Kernel
from viscopade.kernels.forms.quotient import Quotient
from viscopade.kernels.targets.wording import PROVEN, bound_text, distinct, end_condition, preamble

SERIES_SOURCE = "coefficients of the Maclaurin series eps = sum_k h_k v*^k (eq:epsSeriesAdvanced)"


CERTIFICATE_SOURCE = (
    "proofs by ball arithmetic: each panel of the reference (rows of 1 - eps and eps, with their proven relative "
    "error) is cut into equal parts, on each of which the deviation is below the bound"
)
SERIES_NO_BOUND = "The file is about the coefficients: no bound of a truncated sum's error is claimed in it."


def csv_table(kernels: Sequence[Quotient], command: str) -> str:
    """Return the columns m,n,symbol,index,value, after lines of comment that begin with "#"."""
    rows = (
        (kernel.m, kernel.n, symbol, index, value)
        for kernel in distinct(kernels)
        for symbol, values in zip("ab", kernel.texts, strict=True)
        for index, value in enumerate(values)
    )
    return _csv(preamble(kernels, command), ("m", "n", "symbol", "index", "value"), rows)


def json_table(kernels: Sequence[Quotient], command: str) -> str:
    """Return one object; its "approximants" hold the numbers as decimal strings."""
    approximants = [kernel.record() for kernel in distinct(kernels)]
    source = "; ".join(dict.fromkeys(kernel.source for kernel in distinct(kernels)))
    return _json(
        command, source, {"error": bound_text(kernels), "approximants": approximants}, end_condition(kernels[0].law)
    )


def certificates(kernels: Sequence[Kernel], command: str) -> str:
    """Return one object; its "certificates" hold the data for independent checks of the kernels' proofs."""
    entries = [entry for kernel in distinct(kernels) for entry in kernel.certificates()]
    return _json(command, CERTIFICATE_SOURCE, {"certificates": entries})


def records(kernels: Sequence[Kernel], command: str) -> str:
    """Return one object; its "approximants" hold the records of lacunary kernels."""
    source = "; ".join(dict.fromkeys(kernel.source for kernel in distinct(kernels)))
    rest: dict[str, object] = {"error": f"{PROVEN}.", "approximants": [kernel.record() for kernel in kernels]}
    return _json(command, source, rest)


def latex_table(kernels: Sequence[Quotient], command: str, digits: int = 15) -> str:
    """Return a LaTeX tabular in the layout of the paper's tab:padeCoeffs, rounded to `digits` significant digits."""
    arguments.digits(digits)
    head = "\n".join(f"% {line}".rstrip() for line in preamble(kernels, command))
    blocks = [_latex_rows(kernel, digits) for kernel in distinct(kernels)]
    return template(__name__, "table.tex.jinja").render(head=head, blocks=blocks)


def series_csv(h: Sequence[str], command: str) -> str:
    """Return the columns k,h_k of the series' coefficients, after lines of comment that begin with "#"."""
    head = [
        marker_line(command),
        "",
        "The coefficient of normal restitution eps of two viscoelastic spheres:",
        f"{SERIES_SOURCE}, v* = beta^(1/2) v^(1/10).",
        "",
        *wrap(f"End condition: {END_CONDITION}.", WIDTH),
        "",
        SERIES_NO_BOUND,
    ]
    return _csv(head, ("k", "h_k"), enumerate(_decimals(h)))


def series_json(h: Sequence[str], command: str) -> str:
    """Return one object; its "h" holds the series' coefficients as decimal strings."""
    return _json(command, SERIES_SOURCE, {"error": SERIES_NO_BOUND, "order": len(h) - 1, "h": _decimals(h)})


def _decimals(h: Sequence[str]) -> list[str]:
    """Return the coefficients if they are finite decimal numbers."""
    for value in h:
        decimal_value(value)
    return list(h)


def _csv(head: Iterable[str], columns: tuple[str, ...], rows: Iterable[tuple[object, ...]]) -> str:
    """Return the lines of a file whose fields need no quotes."""
    return "\n".join([comment(head, "#"), *(",".join(map(str, row)) for row in (columns, *rows))]) + "\n"


def _json(command: str, source: str, rest: dict[str, object], end: str = END_CONDITION) -> str:
    head = {
        "generated_by": generated_by(),
        "command": command,
        "source": source,
        "end_condition": end,
    }
    return dumps(head | rest, indent=2, ensure_ascii=False) + "\n"


def _latex_rows(kernel: Quotient, digits: int) -> list[str]:
    """Return the rows of one approximant: m, n, a_i, and b_i in two columns, as in the paper."""
    a, b = (
        [f"${symbol}_{{{i}}}={_latex_number(value, digits)}$" for i, value in enumerate(values)]
        for symbol, values in zip("ab", kernel.texts, strict=True)
    )
    height = max(len(a), (len(b) + 1) // 2)
    degrees = [(f"${kernel.m}$", f"${kernel.n}$")]
    columns = zip_longest(degrees, a, b[:height], b[height:])
    return [" & ".join([*(mn or ("", "")), *(cell or "" for cell in cells)]) for mn, *cells in columns]


def _latex_number(value: str, digits: int) -> str:
    """Return a number in LaTeX, correctly rounded to significant digits."""
    context = Context(prec=digits)
    number = context.create_decimal(value)
    if not number:
        return "0"
    if -6 < number.adjusted() < digits:
        return f"{number:f}"
    exponent = number.adjusted()
    return f"{number.scaleb(-exponent, context):f}\\times10^{{{exponent}}}"
