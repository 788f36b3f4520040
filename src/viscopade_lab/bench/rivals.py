"""The ways from speed to eps that ours are compared with, written as a careful user of the paper would."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from functools import partial
from importlib.util import find_spec
from typing import Any

import numpy as np

from viscopade import generated
from viscopade.arithmetic.formats import DOUBLE, FLOAT, FORMATS, Format
from viscopade.arrays.checked import FloatArray
from viscopade.arrays.double import exact_of_speed
from viscopade.collision import spheres
from viscopade.kernels.expressions import by_horner
from viscopade.kernels.targets.syntax import of_c, text
from viscopade.theory.paper import TABLE
from viscopade.theory.series import series
from viscopade_lab.bench.contender import ARRAY, MEASURES, SCALAR, Contender, Group, identifier
from viscopade_lab.bench.speed_range import SpeedRange, elastic_contact_time
from viscopade_lab.figures.paper import FIT_EXPONENT, FIT_FACTOR, FIT_SPEEDS

TERMS = 20
POINTS = 1000
STEPS = 50
TOLERANCE = "1e-8"
_LIMIT = 10_000_000  # of steps: an integration that goes astray ends with NaN

COPY, PADE = "copy", "pow+[3/6]"
"""Ids of what all times are compared with."""


def contenders(speeds: SpeedRange) -> list[Contender]:
    """Return the yardsticks and the rivals for a range of speeds."""
    return [
        _formula(COPY, "scaled copy", lambda form: "beta * speed", lambda v, beta: beta * v, group="limit"),
        _formula("pow", "libm's pow alone", _tenth_root, lambda v, _: v**0.1, group="limit"),
        _truncated_series(),
        _quotient((1, 4), "pow+[1/4]"),
        _quotient((3, 6), PADE),
        _quotient((3, 6), f"{PADE}-fast", fast_math=True),
        _quotient((3, 6), "exp-log+[3/6]-fast", fast_math=True, root=_exp_log),
        _fit(speeds),
        _table(speeds, "table", logarithmic=False),
        _table(speeds, "log-table", logarithmic=True),
        _verlet(speeds),
        _adaptive(),
        *filter(None, [_scipy()]),
    ]


def _template(template: str, /, **values: Any) -> str:
    """Return a template of the benchmark, filled in."""
    return generated.template(__name__, template).render(values)


def _power(form: Format, exponent: str) -> str:
    return f"pow{form.suffix}(speed, {form.literal(exponent)})"


def _tenth_root(form: Format) -> str:
    return _power(form, "0.1")


def _exp_log(form: Format) -> str:
    """Return the tenth root without `pow`, for which vector libraries have faster code."""
    return f"exp{form.suffix}({form.literal('0.1')} * log{form.suffix}(speed))"


def _formula(
    ident: str,
    label: str,
    expression: Callable[[Format], str],
    expected: Callable[[FloatArray, FloatArray], FloatArray],
    group: Group = "rival",
    **options: Any,
) -> Contender:
    """Return a contender of one expression in `speed` and `beta`; `options` are its other fields."""
    name = f"bench_{identifier(ident)}"
    source = "\n\n".join(
        f"static inline {form.name} {name}{form.suffix}({form.name} speed, {form.name} beta)\n"
        f"{{\n    (void)beta;\n    return {expression(form)};\n}}"
        for form in options.get("formats", (DOUBLE, FLOAT))
    )
    return Contender(ident, label, group, expected, source, scalar=name, **options)


def of_v_star(
    ident: str,
    label: str,
    expression: Callable[[Format], str],
    expected: Callable[[FloatArray, FloatArray], FloatArray],
    root: Callable[[Format], str] = _tenth_root,
    group: Group = "rival",
    **options: Any,
) -> Contender:
    """Return a contender of one expression in `v_star`, which the function makes of sqrt(beta) and the speed."""
    name = f"bench_{identifier(ident)}"
    source = "\n\n".join(
        f"static inline {form.name} {name}{form.suffix}({form.name} speed, {form.name} root_beta)\n"
        f"{{\n    const {form.name} v_star = root_beta * {root(form)};\n\n    return {expression(form)};\n}}"
        for form in options.get("formats", (DOUBLE, FLOAT))
    )
    return Contender(ident, label, group, expected, source, scalar=name, takes_root=True, **options)


def _polynomial(form: Format, coefficients: Sequence[str]) -> str:
    """Return Horner's rule with the coefficients as constants; those that are zero are left out."""
    terms = tuple((k, form.literal(c)) for k, c in enumerate(coefficients) if float(c))
    return text(by_horner("v_star", terms), of_c(form))


def _value(coefficients: Sequence[str], x: FloatArray) -> FloatArray:
    return np.asarray(np.polynomial.polynomial.polyval(x, [float(c) for c in coefficients]))


def _truncated_series() -> Contender:
    h = series(TERMS, 17).decimals()
    return of_v_star(
        f"pow+series{TERMS}",
        f"pow + {TERMS} terms of the series",
        lambda form: _polynomial(form, h),
        lambda speed, beta: _value(h, spheres.v_star(speed, beta)),
        slack=1e4,  # large terms of both signs cancel
    )


def _quotient(
    degrees: tuple[int, int], ident: str, *, fast_math: bool = False, root: Callable[[Format], str] = _tenth_root
) -> Contender:
    a, b = TABLE[degrees]
    label = "{} + [{}/{}]".format("pow" if root is _tenth_root else "exp, log", *degrees)
    return of_v_star(
        ident,
        label + (", -ffast-math" if fast_math else ""),
        lambda form: f"({_polynomial(form, a)}) / ({_polynomial(form, b)})",
        lambda speed, beta: _value(a, spheres.v_star(speed, beta)) / _value(b, spheres.v_star(speed, beta)),
        root=root,
        fast_math=fast_math,
        measures=ARRAY if fast_math else MEASURES,
    )


def _fit(speeds: SpeedRange) -> Contender:
    return _formula(
        "fit",
        f"published fit {FIT_FACTOR} v^{FIT_EXPONENT}",
        lambda form: f"{form.literal(str(FIT_FACTOR))} * {_power(form, str(FIT_EXPONENT))}",
        lambda speed, _: FIT_FACTOR * speed**FIT_EXPONENT,
        valid=FIT_SPEEDS if speeds.is_ice else (math.inf, math.inf),
    )


def _table(speeds: SpeedRange, ident: str, *, logarithmic: bool) -> Contender:
    """Return the table of one material that DEM codes have, or one in the logarithm of the speed."""
    low, high = speeds.speed_min, speeds.speed_max
    ends = (math.log(low), math.log(high)) if logarithmic else (low, high)
    places = np.linspace(*ends, POINTS)
    nodes = np.exp(places) if logarithmic else places
    values, _ = exact_of_speed(nodes, np.full(POINTS, speeds.beta))
    per_step = (POINTS - 1) / (ends[1] - ends[0])
    source = _template(
        "table.c.jinja", name=identifier(ident), logarithmic=logarithmic, size=POINTS,
        values=[repr(float(value)) for value in values], first=repr(ends[0]), per_step=repr(per_step),
        formats=tuple(FORMATS.values()),
    )  # fmt: skip

    def interpolated(speed: FloatArray, _: FloatArray) -> FloatArray:
        return np.asarray(np.interp(np.log(speed) if logarithmic else speed, places, values))

    where = "log v" if logarithmic else "v"
    return Contender(
        ident,
        f"table in {where}",
        "rival",
        interpolated,
        source,
        scalar=f"rival_{identifier(ident)}",
        slack=1000,
    )


def _verlet(speeds: SpeedRange) -> Contender:
    step = elastic_contact_time() * speeds.speed_max**-0.2 / STEPS
    return Contender(
        "verlet",
        f"velocity Verlet, {STEPS} steps",
        "rival",
        partial(_integrate, step),
        _template("verlet.c.jinja", step=repr(step), steps=STEPS, limit=_LIMIT),
        scalar="rival_verlet",
        formats=(DOUBLE,),
        measures=(*SCALAR, "cache"),
        most=512,
        slack=1e4,
    )


def _integrate(step: float, speed: FloatArray, beta: FloatArray) -> FloatArray:
    """Return what verlet.c.jinja computes, for all speeds at once."""
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


def _adaptive() -> Contender:
    return Contender(
        "adaptive",
        "Dormand-Prince 5(4)",
        "rival",
        lambda speed, beta: exact_of_speed(speed, beta)[0],
        _template("dormand_prince.c.jinja", tolerance=TOLERANCE, limit=_LIMIT),
        scalar="rival_adaptive",
        formats=(DOUBLE,),
        measures=SCALAR,
        bound=1e-4,
        most=128,
    )


def _scipy() -> Contender | None:
    """Return the adaptive integration by SciPy, or None if there is no SciPy."""
    if find_spec("scipy") is None:
        return None
    return Contender(
        "scipy",
        "SciPy solve_ivp",
        "rival",
        lambda speed, beta: exact_of_speed(speed, beta)[0],
        formats=(DOUBLE,),
        measures=("throughput",),
        bound=1e-3,
        most=8,
        python=_solve_ivp,
    )


def _solve_ivp(speed: FloatArray, beta: float) -> tuple[float, FloatArray]:
    """Integrate collisions by SciPy; return the nanoseconds taken, and the coefficients of restitution."""
    from scipy import integrate

    def motion(_: float, y: Sequence[float], kappa: float) -> tuple[float, float]:
        x, u = y
        return u, -math.sqrt(x) * (x + kappa * u) if x > 0 else 0.0

    def end(_: float, y: Sequence[float], kappa: float) -> float:
        return float(y[0] + kappa * y[1])

    end.terminal, end.direction = True, -1  # type: ignore[attr-defined]
    tolerance = float(TOLERANCE)
    result = np.empty_like(speed)
    begin = time.perf_counter_ns()
    for i, v in enumerate(speed.tolist()):
        kappa = beta * v**0.2
        solution = integrate.solve_ivp(
            motion, (0.0, 1e9), (0.0, 1.0), rtol=tolerance, atol=tolerance, events=end, args=(kappa,)
        )
        result[i] = -solution.y[1, -1]
    return float(time.perf_counter_ns() - begin), result
