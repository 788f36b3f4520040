"""Exact values at a million arguments at a time, in long double, and what the headers' proofs allow there.

The polynomials are the rows of `double`'s table, whose relative error is proven (`panel_proof.proven_error`). Long
double must have 64 bits, as on x86 and, with more of them, on aarch64: `enough` tells.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from viscopade.arrays import double, panels
from viscopade.collision import panel_proof
from viscopade_lab import proven
from viscopade_lab.hard_cases.compilers import TYPES, Form, HeaderFunction, StatedError
from viscopade_lab.hard_cases.compilers import header_functions as of_headers
from viscopade_lab.hard_cases.machine import Array

UNCERTAINTY = 2.0**-59
"""Of exact values, relatively: `panel_proof.proven_error`, and some roundings of 2^-64."""
UNCERTAINTY_OF_DERIVATIVE = 1e-11
"""The same of d eps/d v*: `double.slope` is good to 12 digits."""
CONVERTED = 0.5001
"""Units in the last place of type float that a conversion from type double adds, and that type's own error."""
HALF_OF_SMALLEST = 0.5
"""What underflow adds to a result of a kernel of speed, in the type's smallest numbers: its header says so."""
ENDS = 0.01  # of a table: so near to them, relatively, an argument may be on either side
# Of a type: the bits of its significand, and the exponent of its smallest number.
_BITS = {"double": (53, -1074), "float": (24, -149)}


def enough() -> bool:
    """Whether long double has as many bits as are needed."""
    return bool(np.finfo(np.longdouble).nmant >= 63)


# --- exact values -----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class LongDoubleValues:
    """Arguments x, in long double, with v*, eps and 1 - eps there."""

    x: Array
    v_star: Array
    epsilon: Array
    loss: Array

    @property
    def smaller(self) -> Array:
        """The smaller of eps and 1 - eps."""
        least: Array = np.minimum(self.epsilon, self.loss)
        return least

    def of(self, kind: str) -> Array:
        """Return the values of a kind of function, for beta = 1."""
        if kind == "dissipation":
            return np.asarray(self.loss * (1 + self.epsilon))
        if kind == "rebound":
            return np.asarray(self.epsilon * self.x)
        if kind == "epsilon_derivative":
            return np.asarray(self.epsilon * _slope(self.v_star, self.loss / self.epsilon) / self.v_star)
        if kind in ("v_star", "v_star_from_loss"):
            return self.v_star
        return self.loss if kind == "one_minus_epsilon" else self.epsilon


def long_double_values(over: str, x: Array) -> LongDoubleValues:
    """Return the exact values at positive finite arguments: v*, speeds at beta = 1, or eps or 1 - eps, below 1."""
    given = x.astype(np.longdouble)
    if over == "speed":
        root = given ** (np.longdouble(1) / 10)
        root = root * (1 + (given / root**10 - 1) / 10)
        return _at(given, root)
    return _at(given, given)


def long_double_inverse(x: Array, of_loss: bool) -> LongDoubleValues:
    """Return v* where eps, or 1 - eps, is x, by one step of Newton's method; x is between 0 and 1."""
    given = x.astype(np.longdouble)
    epsilon, loss = (1 - given, given) if of_loss else (given, 1 - given)
    v_star = double.v_star_from(one_minus_epsilon=x) if of_loss else double.v_star_from(x)
    start = _at(given, v_star.astype(np.longdouble))
    # d ln(eps)/d ln v* = slope, d ln(1 - eps)/d ln v* = -slope eps/(1 - eps)
    slope = _slope(start.v_star, loss / epsilon)
    elastic = loss < epsilon
    wanted, found = np.where(elastic, loss, epsilon), np.where(elastic, start.loss, start.epsilon)
    change = np.where(elastic, -slope * epsilon / loss, slope)
    return LongDoubleValues(given, start.v_star * (1 + (wanted / found - 1) / change), epsilon, loss)


def _slope(v_star: Array, ratio: Array) -> Array:
    """Return d ln eps/d ln v*, `ratio` being (1 - eps)/eps, which is v*^2 but for a factor where it is small."""
    found: Array = np.where(ratio < UNCERTAINTY, -2 * ratio, double.slope(v_star.astype(np.float64)))
    return found


def _at(x: Array, v_star: Array) -> LongDoubleValues:
    epsilon, loss = _values("epsilon", v_star), _values("one_minus_epsilon", v_star)
    return LongDoubleValues(x, v_star, epsilon, loss)


def _values(name: str, v_star: Array) -> Array:
    """Return eps or 1 - eps: on panels, and beyond them by eps(8 v*) = 2^-10 eps(v*), as `double` does it."""
    exponent = np.frexp(v_star)[1] - 1
    folds = np.maximum((exponent - panels.FOLD) // 3, 0)
    folded: Array = np.ldexp(v_star, -3 * folds)
    octave = np.maximum(exponent - 3 * folds - panels.FIRST, 0)
    part = np.ldexp(folded, panels.SPLIT - panels.FIRST - octave).astype(np.int64) - (1 << panels.SPLIT)
    panel = np.where(exponent < panels.FIRST, 0, 1 + (octave << panels.SPLIT) + part)
    z = (folded - panels.CENTRES[panel]) / panels.HALF_WIDTHS[panel]
    rows = _rows(name)
    total = rows[-1][panel]
    for row in rows[-2::-1]:
        total = total * z + row[panel]
    return np.ldexp(total, -10 * folds) if name == "epsilon" else np.where(folds > 0, np.longdouble(1), total)


@lru_cache(maxsize=2)
def _rows(name: str) -> Array:
    """Return the coefficients of all panels, the power first."""
    rows = [panel_proof.panel_rows()[name, panel] for panel in range(panels.PANELS)]
    return np.array([[np.ldexp(np.longdouble(str(c)), row.exponent) for c in row.a] for row in rows]).T


# --- what is stated ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class StatedBounds:
    """A function, and what is proven of it: in its interval or table, elsewhere, and of underflow.

    Attributes
    ----------
    function : HeaderFunction
    elsewhere : StatedError or None
    underflow : float
        What is added where results are subnormal, in the smallest numbers of the type.
    of_eps : float
        What the eps of type double within is off, in the smallest numbers of that type, where it is subnormal.
    """

    function: HeaderFunction
    elsewhere: StatedError | None = None
    underflow: float = 0.0
    of_eps: float = 0.0

    def allowed(self, at: LongDoubleValues, truth: Array) -> Array:
        """Return the largest error that is stated, at each argument; infinite where nothing is."""
        stated, form = self.function.stated, self.function.form
        found = _allowed(stated, form, at, truth)
        if self.elsewhere is None:
            found = np.where(_inside(stated, at, 0), found, np.inf)
        else:  # an argument near an end of the table may be on either side of it
            beyond = _allowed(self.elsewhere, form, at, truth)
            either = np.where(_inside(stated, at, ENDS), np.maximum(found, beyond), beyond)
            found = np.where(_inside(stated, at, -ENDS), found, either)
        lost = np.where(truth < np.finfo(TYPES[form]).tiny, _smallest(form) * self.underflow, 0)
        factor = np.abs(at.x) if self.function.kind == "rebound" else 1
        of_eps = np.where(at.epsilon < np.finfo(np.float64).tiny, _smallest("double") * self.of_eps * factor, 0)
        return found + lost + of_eps

    def rounding(self, at: LongDoubleValues, truth: Array) -> Array:
        """Return what is stated of rounding alone."""
        function = replace(self.function, stated=_of_rounding(self.function.stated))
        elsewhere = None if self.elsewhere is None else _of_rounding(self.elsewhere)
        return replace(self, function=function, elsewhere=elsewhere).allowed(at, truth)

    def plain(self, at: LongDoubleValues) -> npt.NDArray[np.bool_]:
        """Tell where the function calls nothing of libm but sqrt."""
        if self.elsewhere is not None:
            return _inside(self.function.stated, at, -ENDS)
        return np.full(at.x.shape, not self.function.name.startswith(("halfline", "inverse")))


def _of_rounding(stated: StatedError) -> StatedError:
    return replace(stated, smaller=(), formula=0.0)


def _inside(stated: StatedError, at: LongDoubleValues, margin: float) -> npt.NDArray[np.bool_]:
    return (at.v_star >= stated.low * (1 - margin)) & (at.v_star <= stated.high * (1 + margin))


def _smallest(form: Form) -> Any:
    return np.ldexp(np.longdouble(1), _BITS[form][1])


def _allowed(stated: StatedError, form: Form, at: LongDoubleValues, truth: Array) -> Array:
    share: Array = np.zeros_like(truth)
    for end, size in reversed(stated.smaller):
        share = np.where(at.v_star <= end, np.longdouble(size), share)
    units = stated.ulps * _unit(truth, form) + stated.double_ulps * _unit(truth, "double")
    return (share + stated.rounding) * at.smaller + (stated.formula + stated.value) * np.abs(truth) + units


def _unit(truth: Array, form: Form) -> Array:
    """Return the unit in the last place of the exact value, in a type."""
    bits, least = _BITS[form]
    unit: Array = np.ldexp(np.longdouble(1), np.maximum(np.frexp(truth)[1] - bits, least))
    return unit


def stated_bounds(texts: Mapping[str, str]) -> dict[str, tuple[StatedBounds, ...]]:
    """Return all that is proven of the functions of headers, by the header; a function of several is the first's."""
    found: dict[str, list[StatedBounds]] = {file: [] for file in texts}
    for function in of_headers(texts):
        file = next(file for file, text in texts.items() if _defines(text, function))
        found[file] += _promises(function)
    return {file: tuple(promises) for file, promises in found.items()}


def _defines(text: str, function: HeaderFunction) -> bool:
    s = "f" if function.form == "float" else ""
    return f" viscopade_{function.kind}_{function.name}{s}(" in text


def _promises(function: HeaderFunction) -> list[StatedBounds]:
    form, name = function.form, function.name
    found = proven.of(name, form)
    if name.startswith("lookup"):
        return _of_speed_table(function)
    if name.startswith("inverse"):
        return [StatedBounds(function), StatedBounds(replace(function, kind="v_star_from_loss"))]
    if name.startswith("halfline"):
        return [StatedBounds(function, underflow=found.number("underflow"))]
    if name.startswith("minimax"):
        formula, size = found.number("derivative"), found.number("rounding of derivative")
        tiny = float(np.finfo(TYPES[form]).tiny)
        derivative = StatedError(value=size, low=tiny, high=function.stated.high, formula=formula)
        return [StatedBounds(function), StatedBounds(replace(function, kind="epsilon_derivative", stated=derivative))]
    if name == "full" and form == "double":
        return [StatedBounds(function, underflow=max(0.0, found.number("underflow") - function.stated.ulps))]
    return [StatedBounds(function)]


def _of_speed_table(function: HeaderFunction) -> list[StatedBounds]:
    """Return eps with what is proven of it, and the same of eps speed and 1 - eps^2."""
    form, stated = function.form, function.stated
    double = proven.of(function.name, "double")
    last = CONVERTED if form == "float" else 0.0  # beyond the table type float is computed in type double
    if double.has("ulps"):
        outside = double.number("ulps elsewhere")
        inside = double.number("relative") + double.number("relative of w")
        kinds = {
            "restitution": (stated, StatedError(double_ulps=outside, ulps=last)),
            **dict.fromkeys(
                ("rebound", "dissipation"),
                (replace(stated, value=inside, double_ulps=0.0), StatedError(value=outside * 2.0**-52, ulps=last)),
            ),
        }
        kernel = _full()
    else:
        slow = double.text("elsewhere")
        kernel = _full() if slow == "full" else _half_line(slow)
        of_v_star = double.number("of v*")
        ((whole, formula),) = stated.smaller
        converted = stated.double_ulps and form == "float"
        own = {"ulps": 3.0} if form == "float" and not converted else {"ulps": last, "double_ulps": 3.0}
        within = replace(stated, smaller=(), value=stated.rounding, rounding=0.0, formula=formula, **own)
        beyond = StatedError(value=of_v_star + kernel.of_eps, ulps=last, double_ulps=3.0, formula=kernel.formula)
        eps = StatedError(((whole, kernel.formula),), kernel.of_eps, ulps=last, rounding=of_v_star)
        kinds = {
            "restitution": (stated, eps),
            "rebound": (within, beyond),
            "dissipation": (within, replace(beyond, value=beyond.value + kernel.of_loss)),
        }
    return [
        StatedBounds(replace(function, kind=kind, stated=inner), outer, HALF_OF_SMALLEST, kernel.underflow)
        for kind, (inner, outer) in kinds.items()
    ]


class _Beyond(NamedTuple):
    """What serves speeds beyond a table: the errors of its formula and of rounding, relatively, and of underflow."""

    formula: float
    of_eps: float
    of_loss: float
    underflow: float


def _half_line(name: str) -> _Beyond:
    quantities = ("formula", "rounding of epsilon", "rounding of one_minus_epsilon", "underflow")
    return _Beyond(*map(proven.of(name, "double").number, quantities))


def _full() -> _Beyond:
    found = proven.of("full", "double")
    ulps = [found.number(f"ulps of {kind}") for kind in ("epsilon", "one_minus_epsilon")]
    return _Beyond(0.0, ulps[0] * 2.0**-52, ulps[1] * 2.0**-52, found.number("underflow"))
