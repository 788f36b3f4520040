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

# What a user would take; all are choices.
TERMS = 20
"""Highest power of v* in the truncated series."""
POINTS = 1000
"""Of a table of eps."""
STEPS = 50
"""Time steps of velocity Verlet in the shortest elastic contact: some tens are usual in DEM."""
TOLERANCE = "1e-8"
"""Relative tolerance of the adaptive integration."""
_LIMIT = 10_000_000  # steps; a failed integration ends with NaN

COPY, PADE = "copy", "pow+[3/6]"
"""Ids of the two references: all times are compared with them."""


def contenders() -> list[Contender]:
    """Return the yardsticks (a scaled copy of the speeds, pow alone) and the rivals.

    The tolerance `slack` of each, in units of the format's epsilon, tells a wrong result from rounding. It is 100 by
    default, chosen by hand; results differ from NumPy's by up to 2 (measured), except where a comment says more.
    """
    fit = f"published fit {FIT_FACTOR} v^{FIT_EXPONENT}"
    return [
        expression_contender(COPY, "scaled copy", lambda _: "beta * speed", lambda v, beta: beta * v, group="limit"),
        expression_contender("pow", "libm's pow alone", tenth_root, lambda v, _: v**0.1, group="limit"),
        # Quotients [1/4] and [3/6] of the paper; -fast is -ffast-math, with exp and log instead of pow in the last.
        _truncated_series(),
        _quotient((1, 4), "pow+[1/4]"),
        _quotient((3, 6), PADE),
        _quotient((3, 6), f"{PADE}-fast", fast_math=True),
        _quotient((3, 6), "exp-log+[3/6]-fast", fast_math=True, root=_exp_log),
        *(_vector_pow(library, path) for library in VECTOR_LIBRARIES if (path := library.path)),
        # The fit eps = 0.32 v^(-0.234) to measurements with ice, v in cm/s, inside the measured range of speeds.
        expression_contender(
            "fit",
            fit,
            lambda form: f"{form.literal(str(FIT_FACTOR))} * {_power(form, str(FIT_EXPONENT))}",
            lambda speed, _: FIT_FACTOR * speed**FIT_EXPONENT,
            valid=FIT_SPEEDS,
        ),
        _table("table", logarithmic=False),
        _table("log-table", logarithmic=True),
        _verlet(),
        # An adaptive Runge-Kutta method, the usual one for a single trajectory.
        Contender(
            "adaptive",
            "Dormand-Prince 5(4)",
            "rival",
            _template("dormand_prince.c.jinja", tolerance=TOLERANCE, limit=_LIMIT),
            scalar="rival_adaptive",
            formats=(DOUBLE,),
            measures=SCALAR,
            expected=lambda speed, beta: double.exact_of_speed(speed, np.full(speed.shape, beta))[0],
            # It integrates to 1e-8; results are within 1.2e-8 of the exact eps (measured), so that 1e-6 leaves room. A
            # call takes 3 microseconds, 100 times as long as pow: 128 elements are a choice.
            slack=1e-6 / DOUBLE.epsilon,
            most=128,
        ),
    ]


def _template(template: str, /, **values: Any) -> str:
    """Return the C code of a file in bench/templates, filled in with these values."""
    return generated.template(__name__, template).render(values)


def _power(form: Format, exponent: str) -> str:
    """Return a power of the speed in C, in a format; the exponent is a decimal number."""
    return f"pow{form.suffix}(speed, {form.literal(exponent)})"


def tenth_root(form: Format) -> str:
    """Return the tenth root of the speed by `pow`, as C in a format: v* = sqrt(beta) speed^(1/10)."""
    return _power(form, "0.1")


def _exp_log(form: Format) -> str:
    """Return the tenth root without `pow`, for which vector libraries have faster code."""
    return f"exp{form.suffix}({form.literal('0.1')} * log{form.suffix}(speed))"


def expression_contender(
    ident: str,
    label: str,
    expression: Callable[[Format], str],
    expected: Callable[[FloatArray, float], FloatArray] | None = None,
    root: Callable[[Format], str] | None = None,
    group: Group = "rival",
    **options: Any,
) -> Contender:
    """Return a contender that computes one expression in `speed` and `beta`.

    Parameters
    ----------
    ident, label, group : str
        Fields of `Contender`.
    expression : callable
        From a format to the expression in C.
    expected : callable, optional
        From speeds and beta to the same results in NumPy.
    root : callable, optional
        From a format to the tenth root of the speed in C. With it the expression is one in `v_star`, the product of the
        root and sqrt(beta), which the function takes for beta.
    **options
        Other fields of `Contender`.
    """
    name = f"bench_{identifier(ident)}"
    functions = []
    # A function for each format, with the suffix f for float; (void) keeps compilers from warning.
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
    """Return c_0 + v* (c_1 + v* (…)) in C, without coefficients that are zero.

    `coefficients` are c_0, c_1, … as decimal numbers.
    """
    # From the highest power on: where k steps lead to the next coefficient that is not zero, v_star stands k times.
    (last, text), *others = ((k, form.literal(c)) for k, c in reversed([*enumerate(coefficients)]) if float(c))
    # If c_0 is zero, the end is power 0 without a coefficient.
    for k, literal in (*others, *([] if others and others[-1][0] == 0 else [(0, "")])):
        for _ in range(last - k):
            text = f"v_star * {f'({text})' if ' ' in text else text}"
        last, text = k, f"{literal} + {text}" if literal else text
    return text


def _value(coefficients: Sequence[str], speed: FloatArray, beta: float) -> FloatArray:
    """Return the polynomial sum c_k v*^k at speeds, in double precision."""
    v_star = spheres.v_star(speed, beta)
    return np.asarray(np.polynomial.polynomial.polyval(v_star, [float(c) for c in coefficients]))


def _truncated_series() -> Contender:
    """Return S_20, the series of eps up to v*^20."""
    # 17 digits identify a double.
    h = series(TERMS, 17).decimals()
    return expression_contender(
        f"pow+series{TERMS}",
        f"pow + {TERMS} terms of the series",
        lambda form: _polynomial(form, h),
        lambda speed, beta: _value(h, speed, beta),
        tenth_root,
        slack=1e4,  # large terms of both signs cancel: results differ by 47 units (measured)
    )


def _quotient(
    degrees: tuple[int, int], ident: str, *, fast_math: bool = False, root: Callable[[Format], str] = tenth_root
) -> Contender:
    """Return a quotient [m/n] (`degrees`) with the coefficients of the paper's table, as printed.

    `root` gives the tenth root in C. With `fast_math` compilers may use their vector functions; only arrays are timed.
    """
    a, b = TABLE[degrees]
    label = "{} + [{}/{}]".format("pow" if root is tenth_root else "exp, log", *degrees)
    return expression_contender(
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
    """A library with a vector pow, which the benchmark measures if it is installed.

    Attributes
    ----------
    name, title : str
        In ids and templates; for the reader.
    files : tuple of str
        Names of the shared library, of which the first that can be loaded is taken.
    install : str
        The command that installs it.
    """

    name: str
    title: str
    files: tuple[str, ...]
    install: str

    @property
    def path(self) -> str | None:
        """The library as it can be loaded, or None: from the loader's folders, or from the folder of pip's packages."""
        # A file that cannot be loaded raises OSError: the next one is tried.
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
    """Return [3/6] with the pow of a vector library, whose file is `path`: an array function from a template."""
    quotient = _quotient((3, 6), f"{PADE}-{library.name}", fast_math=True)
    a, b = TABLE[3, 6]
    source = _template(
        f"{library.name}.c.jinja", library=path, formats=tuple(FORMATS.values()),
        quotient=lambda form: f"({_polynomial(form, a)}) / ({_polynomial(form, b)})",
    )  # fmt: skip
    return replace(quotient, label=f"{library.title}'s pow + [3/6]", source=source, array=f"rival_{library.name}")


def _table(ident: str, *, logarithmic: bool) -> Contender:
    """Return a table of eps of one material with linear interpolation, as in DEM codes.

    Its points are equidistant in the speed, or in the logarithm of the speed.
    """
    first, last = np.log([SPEED_MIN, SPEED_MAX]) if logarithmic else (SPEED_MIN, SPEED_MAX)
    points = np.linspace(first, last, POINTS)
    values, _ = double.exact_of_speed(np.exp(points) if logarithmic else points, np.full(POINTS, BETA))
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
        expected=lambda speed, _: np.interp(np.log(speed) if logarithmic else speed, points, values),
        slack=1000,  # results differ by 0.6 units (measured): generous
    )


def _verlet() -> Contender:
    """Return velocity Verlet with a fixed time step, as in DEM codes."""
    # An elastic contact lasts tau_c(0) v^(-1/5) in the units of the template, least at the highest speed.
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
        # The same operations in NumPy give the same results; 1e4 is for compilers that contract them. A call takes 2
        # microseconds: 512 elements are a choice.
        slack=1e4,
        most=512,
    )


def _integrate(step: float, speed: FloatArray, beta: float) -> FloatArray:
    """Return eps as the C code of velocity Verlet computes it, for all speeds at once.

    x'' = -(x^(3/2) + beta x^(1/2) x') in units where the elastic constant over the mass is 1; `step` is the time step.
    The velocity advances by half a step, 0.5 step x'', before and after the position, and contact ends when the force
    vanishes: x + beta x' <= 0 or x <= 0.
    """
    # NaN stays where an integration does not end.
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
