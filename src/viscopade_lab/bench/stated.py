"""What the exported headers state of their errors, read from their comments."""

from __future__ import annotations

import re
from decimal import ROUND_CEILING, Context, Decimal

from viscopade.arithmetic.formats import FLOAT, Format

_N = r"([0-9.]+(?:e-?[0-9]+)?)"
_SCALE = r"(?:eps|min\(eps, 1 - eps\))"
_FORMULA = rf"proven: \|formula - eps\| / min\(eps, 1 - eps\) <= {_N}(?: in type double and {_N} in type float)?"
_FLOATS = rf"(?: and {_N} {_SCALE} in type float)?"
_ROUNDING = rf"rounding(?: of (?:epsilon|restitution))?: adds at most {_N} {_SCALE} in type double{_FLOATS}"
_ELSEWHERE = rf" in the table, {_N} elsewhere"
_RANGE = rf"\({_N} <= v\* < {_N}\)"
_ULPS = rf"eps is off by at most {_N} units in the last place \(ulp\) of eps\(w\).{{1,80}}?at most {_N} ulp"
_ULP = r"{}, +epsilon: +at most ([0-9.]+)"
_THROUGH_DOUBLE = re.compile("type float:? (?:is )?computed in type double,")
# Half an ulp of float, and less than a thousandth of it for what double is off.
_ROUNDED_TO_FLOAT = "0.501 ulp"


def words(text: str) -> str:
    """Return the text of a header's comments as one line."""
    return " " + " ".join(line.strip().removeprefix("*").strip() for line in text.splitlines())


def passage(name: str, text: str) -> str:
    """Return what a header says of a kernel, and what follows, as one line.

    If it does not say it at the beginning, it does where the kernel's own code begins.
    """
    whole = words(text)
    places = whole.find(f" {name} "), whole.find(f"#define VISCOPADE_{name.upper()} ")
    return whole[next((place for place in places if place >= 0), len(whole)) :]


def named(name: str) -> str:
    """Return the error in a kernel's name: ..._6p7em6 is 6.7e-6."""
    match = re.search(r"_([0-9]+)(?:p([0-9]+))?em([0-9]+)$", name)
    if match is None:
        return name
    return f"{match[1]}{'.' + match[2] if match[2] else ''}e-{match[3]}"


def bound(name: str, text: str) -> float:
    """Return the largest proven error of a kernel's formula, or 0 if it is stated in ulp."""
    match = re.search(_FORMULA + rf"(?:{_ELSEWHERE})?", passage(name, text))
    return max(float(number) for number in match.groups() if number) if match else 0.0


def by_root(name: str, text: str, form: Format) -> str:
    """Return the proven error of a kernel of v*, rounding included, relative to the smaller of eps and 1 - eps."""
    part = passage(name, text)
    return _sum(_of(form, re.search(_FORMULA, part)), _of(form, re.search(_ROUNDING, part)))


def full(text: str, form: Format) -> str:
    """Return the proven error of the full kernel of v*."""
    match = re.search(_ULP.format(form.name), text)
    return f"{match[1]} ulp" if match else ""


def lookup(name: str, text: str, form: Format, v_star_max: float) -> str:
    """Return the proven error of a kernel from speed to eps, rounding included.

    The first number is relative to the smaller of eps and 1 - eps, an ulp is that of eps.
    """
    part = passage(name, text)
    rounded = form is FLOAT and _THROUGH_DOUBLE.search(part) is not None
    ulps = re.search(_ULPS, part)
    if ulps is not None:
        return _ROUNDED_TO_FLOAT if rounded else f"{Decimal(ulps[1]) + Decimal(ulps[2])} ulp"
    formula, table = re.search(_FORMULA, part), re.search(_RANGE, part)
    if formula is None or table is None or v_star_max >= float(table[2]):
        return ""
    sum_of = _sum(Decimal(formula[1]), _of(form, re.search(_ROUNDING, part)))
    return f"{sum_of} + {_ROUNDED_TO_FLOAT if rounded else '0.5 ulp'}" if sum_of else ""


def _of(form: Format, match: re.Match[str] | None) -> Decimal | None:
    """Return the number for a type: there is one for both, or one for each."""
    if match is None:
        return None
    return Decimal(match[2] if form is FLOAT and match[2] else match[1])


def _sum(a: Decimal | None, b: Decimal | None) -> str:
    """Return the sum, rounded up to three digits, or ""."""
    return "" if a is None or b is None else f"{Context(prec=3, rounding=ROUND_CEILING).add(a, b):.2e}"
