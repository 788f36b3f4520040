"""Rivals: other ways from speed to eps, written as a careful user of the paper would."""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from viscopade import generated
from viscopade.arithmetic.formats import DOUBLE, FLOAT, FORMATS, Format
from viscopade.arrays import double
from viscopade.arrays.checked import FloatArray
from viscopade.collision import spheres
from viscopade.theory.paper import TABLE
from viscopade.theory.series import series
from viscopade_lab.bench.contender import ARRAY, MEASURES, SCALAR, Contender, Group, identifier
from viscopade_lab.bench.speeds import BETA, SPEED_MAX, SPEED_MIN
from viscopade_lab.figures.paper import FIT_EXPONENT, FIT_FACTOR, FIT_SPEEDS

TERMS = 20
POINTS = 1000
STEPS = 50
TOLERANCE = "1e-8"
_LIMIT = 10_000_000  # steps; a failed integration ends with NaN

COPY, PADE = "copy", "pow+[3/6]"
"""Ids of the two references: all times are compared with them."""


def contenders() -> list[Contender]:
    """Return the yardsticks and the rivals."""
    fit = f"published fit {FIT_FACTOR} v^{FIT_EXPONENT}"
    return [
        of_expression(COPY, "scaled copy", lambda _: "beta * speed", lambda v, beta: beta * v, group="limit"),
        of_expression("pow", "libm's pow alone", tenth_root, lambda v, _: v**0.1, group="limit"),
        _truncated_series(),
        _quotient((1, 4), "pow+[1/4]"),
        _quotient((3, 6), PADE),
        _quotient((3, 6), f"{PADE}-fast", fast_math=True),
        _quotient((3, 6), "exp-log+[3/6]-fast", fast_math=True, root=_exp_log),
        *(_vector_pow(library, path) for library in VECTOR_LIBRARIES if (path := library.path)),
        of_expression(
            "fit",
            fit,
            lambda form: f"{form.literal(str(FIT_FACTOR))} * {_power(form, str(FIT_EXPONENT))}",
            lambda speed, _: FIT_FACTOR * speed**FIT_EXPONENT,
            valid=FIT_SPEEDS,
        ),
        _table("table", logarithmic=False),
        _table("log-table", logarithmic=True),
        _verlet(),
        Contender(
            "adaptive",
            "Dormand-Prince 5(4)",
            "rival",
            _template("dormand_prince.c.jinja", tolerance=TOLERANCE, limit=_LIMIT),
            scalar="rival_adaptive",
            formats=(DOUBLE,),
            measures=SCALAR,
            expected=lambda speed, beta: double.exact_of_speed(speed, np.full(speed.shape, beta))[0],
            slack=1e-6 / DOUBLE.epsilon,
            most=128,
        ),
    ]


def _template(template: str, /, **values: Any) -> str:
    """Return a template of the benchmark, filled in."""
    return generated.template(__name__, template).render(values)


def _power(form: Format, exponent: str) -> str:
    return f"pow{form.suffix}(speed, {form.literal(exponent)})"


def tenth_root(form: Format) -> str:
    """Return the tenth root of the speed by `pow`."""
    return _power(form, "0.1")


def _exp_log(form: Format) -> str:
    """Return the tenth root without `pow`, for which vector libraries have faster code."""
    return f"exp{form.suffix}({form.literal('0.1')} * log{form.suffix}(speed))"


def of_expression(
    ident: str,
    label: str,
    expression: Callable[[Format], str],
    expected: Callable[[FloatArray, float], FloatArray] | None = None,
    root: Callable[[Format], str] | None = None,
    group: Group = "rival",
    **options: Any,
) -> Contender:
    """Return a contender of one expression in `speed` and `beta`; `options` are its other fields.

    With `root` it is an expression in `v_star`, the product of sqrt(beta) and the root.
    """
    name = f"bench_{identifier(ident)}"
    functions = []
    for form in options.get("formats", (DOUBLE, FLOAT)):
        first = f"const {form.name} v_star = beta * {root(form)};" if root else "(void)beta;"
        functions.append(
            f"static inline {form.name} {name}{form.suffix}({form.name} speed, {form.name} beta)\n"
            f"{{\n    {first}\n\n    return {expression(form)};\n}}"
        )
    source = "\n\n".join(functions)
    return Contender(
        ident, label, group, source, scalar=name, takes_root=root is not None, expected=expected, **options
    )


def _polynomial(form: Format, coefficients: Sequence[str]) -> str:
    """Return Horner's rule with the coefficients as constants, without those that are zero."""
    (last, text), *others = ((k, form.literal(c)) for k, c in reversed([*enumerate(coefficients)]) if float(c))
    for k, literal in (*others, *([] if others and others[-1][0] == 0 else [(0, "")])):
        for _ in range(last - k):
            text = f"v_star * {f'({text})' if ' ' in text else text}"
        last, text = k, f"{literal} + {text}" if literal else text
    return text


def _value(coefficients: Sequence[str], speed: FloatArray, beta: float) -> FloatArray:
    v_star = spheres.v_star(speed, beta)
    return np.asarray(np.polynomial.polynomial.polyval(v_star, [float(c) for c in coefficients]))


def _truncated_series() -> Contender:
    h = series(TERMS, 17).decimals()
    return of_expression(
        f"pow+series{TERMS}",
        f"pow + {TERMS} terms of the series",
        lambda form: _polynomial(form, h),
        lambda speed, beta: _value(h, speed, beta),
        tenth_root,
        slack=1e4,  # large terms of both signs cancel
    )


def _quotient(
    degrees: tuple[int, int], ident: str, *, fast_math: bool = False, root: Callable[[Format], str] = tenth_root
) -> Contender:
    a, b = TABLE[degrees]
    label = "{} + [{}/{}]".format("pow" if root is tenth_root else "exp, log", *degrees)
    return of_expression(
        ident,
        label + (", -ffast-math" if fast_math else ""),
        lambda form: f"({_polynomial(form, a)}) / ({_polynomial(form, b)})",
        lambda speed, beta: _value(a, speed, beta) / _value(b, speed, beta),
        root,
        fast_math=fast_math,
        measures=ARRAY if fast_math else MEASURES,
    )


@dataclass(frozen=True)
class VectorLibrary:
    """A library with a vector pow, which the benchmark measures if it is installed."""

    name: str
    title: str
    files: tuple[str, ...]
    install: str

    @property
    def path(self) -> str | None:
        """The library as it can be loaded, or None: from the loader's folders, or from the folder of pip's packages."""
        for path in (*self.files, *(str(Path(sys.prefix, "lib", file)) for file in self.files)):
            with suppress(OSError):
                ctypes.CDLL(path)
                return path
        return None


VECTOR_LIBRARIES = (
    VectorLibrary("sleef", "SLEEF", ("libsleef.so.3", "libsleef.so"), "apt-get install libsleef3"),
    VectorLibrary("mkl", "oneMKL", ("libmkl_rt.so.3", "libmkl_rt.so.2", "libmkl_rt.so"), "python -m pip install mkl"),
)


def absent() -> list[str]:
    """Return a line for each library that is not installed, with the command that installs it."""
    return [
        f"left out: {PADE}-{library.name}; {library.title} is not installed: {library.install}"
        for library in VECTOR_LIBRARIES
        if library.path is None
    ]


def _vector_pow(library: VectorLibrary, path: str) -> Contender:
    quotient = _quotient((3, 6), f"{PADE}-{library.name}", fast_math=True)
    a, b = TABLE[3, 6]
    source = _template(
        f"{library.name}.c.jinja", library=path, formats=tuple(FORMATS.values()),
        quotient=lambda form: f"({_polynomial(form, a)}) / ({_polynomial(form, b)})",
    )  # fmt: skip
    return replace(quotient, label=f"{library.title}'s pow + [3/6]", source=source, array=f"rival_{library.name}")


def _table(ident: str, *, logarithmic: bool) -> Contender:
    """Return the table of one material as in DEM codes, or a table in the logarithm of the speed."""
    first, last = np.log([SPEED_MIN, SPEED_MAX]) if logarithmic else (SPEED_MIN, SPEED_MAX)
    places = np.linspace(first, last, POINTS)
    values, _ = double.exact_of_speed(np.exp(places) if logarithmic else places, np.full(POINTS, BETA))
    source = _template(
        "table.c.jinja", name=identifier(ident), logarithmic=logarithmic, size=POINTS,
        values=[repr(float(value)) for value in values], first=repr(float(first)),
        per_step=repr(float((POINTS - 1) / (last - first))), formats=tuple(FORMATS.values()),
    )  # fmt: skip
    return Contender(
        ident,
        f"table in {'log v' if logarithmic else 'v'}",
        "rival",
        source,
        scalar=f"rival_{identifier(ident)}",
        expected=lambda speed, _: np.interp(np.log(speed) if logarithmic else speed, places, values),
        slack=1000,
    )


def _verlet() -> Contender:
    step = float(double.tau_c(0.0)) * SPEED_MAX**-0.2 / STEPS
    return Contender(
        "verlet",
        f"velocity Verlet, {STEPS} steps",
        "rival",
        _template("verlet.c.jinja", step=repr(step), steps=STEPS, limit=_LIMIT),
        scalar="rival_verlet",
        formats=(DOUBLE,),
        measures=(*SCALAR, "cache"),
        expected=partial(_integrate, step),
        slack=1e4,
        most=512,
    )


def _integrate(step: float, speed: FloatArray, beta: float) -> FloatArray:
    """Return the results of verlet.c.jinja, for all speeds at once."""
    x, velocity, acceleration = np.zeros_like(speed), speed.copy(), np.zeros_like(speed)
    running, result = np.ones(speed.shape, bool), np.full(speed.shape, np.nan)
    for _ in range(_LIMIT):
        velocity = velocity + 0.5 * step * acceleration
        x = x + step * velocity
        ended = running & ~((x + beta * velocity > 0) & (x > 0))
        result[ended] = -velocity[ended] / speed[ended]
        running &= ~ended
        if not running.any():
            break
        acceleration = np.where(running, -np.sqrt(np.maximum(x, 0)) * (x + beta * velocity), 0.0)
        velocity = np.where(running, velocity + 0.5 * step * acceleration, 0.0)
    return result
