"""Compile what was generated for a scene, and compare its results with the exact function."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from viscopade import double
from viscopade.arrays import FloatArray
from viscopade.bench import compilers
from viscopade.bench.compilers import BenchError
from viscopade.bench.scene import exact
from viscopade.kernels import MARKER
from viscopade.scene.candidate import Constant
from viscopade.scene.choice import WORDS, Choice
from viscopade.scene.render import file_name
from viscopade.scene.units import Scale

SPEEDS = 20_000  # for each pair
REFERENCE = 1e-15  # more than the relative error of what is compared with, in double precision (sampled)
_SEED = 7

Array = npt.NDArray[Any]
Run = Callable[[Array, Array, int], tuple[FloatArray, FloatArray]]


@dataclass(frozen=True)
class Check:
    """What was found.

    Attributes
    ----------
    how : str
        Compiler or interpreter.
    collisions : int
    errors : mapping of str to float
        By name of the tolerance, the largest error.
    """

    how: str
    collisions: int
    errors: Mapping[str, float]


def check(choice: Choice, text: str, cc: str | None = None) -> Check | None:
    """Run the generated code at many speeds, and compare.

    Parameters
    ----------
    choice : Choice
    text : str
        What `render` returned.
    cc : str or None
        Command of the C compiler. None: the environment's CC, or cc.

    Returns
    -------
    Check or None
        None for languages that are not run here.

    Raises
    ------
    BenchError
        If there is no compiler, it fails, or the code exceeds the tolerance.
    """
    language = choice.scene.code.language
    if language == "c":
        compiler = compilers.find(cc)
        how, run = compiler.version, _compiled(choice, text, compiler)
    elif language == "python":
        how, run = "Python", _imported(choice, text)
    else:
        return None
    largest = dict.fromkeys(WORDS, 0.0)
    for pair in range(len(choice.encounters)):
        for name, error in _errors(choice, pair, run).items():
            largest[name] = max(largest[name], error)
    for name, limit in choice.scene.tolerance.given().items():
        if not largest[name] <= limit + REFERENCE:
            raise BenchError(
                f"the generated code fails its check: {WORDS[name]} is {largest[name]:.3g}, more than {limit:g}"
            )
    return Check(how, SPEEDS * len(choice.encounters), largest)


def _errors(choice: Choice, pair: int, run: Run) -> dict[str, float]:
    """Return the largest errors for a pair, at speeds and sizes all over the scene."""
    encounter, scale = choice.encounters[pair], Scale(*choice.scene.scale)
    kind = np.float32 if choice.scene.code.format == "float" else np.float64
    random = np.random.default_rng((_SEED, pair)).random((2, SPEEDS))
    random[:, :2] = [0, 1], [0, 1]  # the ends
    slowest, _, fastest = (v / scale.speed for v in encounter.speeds)
    speed = _between(slowest, fastest, random[0]).astype(kind)
    weakest, strongest = (scale.beta(p.beta) for p in (encounter.weakest, encounter.strongest))
    beta = _between(weakest, strongest, random[1]).astype(kind)
    found, lost = run(speed, beta, pair)
    if choice.scene.code.argument == "v_star":
        v_star = _v_star(speed, beta).astype(np.float64)
        eps, loss = np.asarray(double.epsilon(v_star)), np.asarray(double.one_minus_epsilon(v_star))
    else:
        eps, loss = exact(speed.astype(np.float64), beta.astype(np.float64))
    dissipation = loss * (1 + eps)
    off = np.abs(found - eps)
    return {
        "epsilon": float((off / eps).max()),
        "dissipation": float((np.abs(lost - dissipation) / dissipation).max()),
        "absolute": float(off.max()),
    }


def _between(low: float, high: float, random: FloatArray) -> FloatArray:
    """Return numbers whose logarithms are uniform."""
    values = np.exp(np.log(low) + (np.log(high) - np.log(low)) * random)
    return np.asarray(np.clip(values, low, high))


def _v_star(speed: Array, beta: Array) -> Array:
    return np.asarray(np.sqrt(beta) * speed ** speed.dtype.type(0.1))


# --- Python -----------------------------------------------------------------------------------------------------------


def _imported(choice: Choice, text: str) -> Run:
    """Return what runs a generated module."""
    module: dict[str, Any] = {"__name__": choice.scene.name}
    exec(compile(text, file_name(choice.scene), "exec"), module)
    candidate = choice.chosen.candidate

    def run(speed: Array, beta: Array, pair: int) -> tuple[FloatArray, FloatArray]:
        if isinstance(candidate, Constant):
            values = np.full(speed.shape, module["EPSILON"][choice.encounters[pair].name])
        elif choice.scene.code.argument == "v_star":
            values = np.array([module["epsilon"](float(v)) for v in _v_star(speed, beta)])
        else:
            values = np.array([module["restitution"](float(v), float(b)) for v, b in zip(speed, beta, strict=True)])
        return values, (1 - values) * (1 + values)

    return run


# --- C ----------------------------------------------------------------------------------------------------------------

_SOURCE = """/* {marker} */
#include <stddef.h>
#include "{header}"

void check(size_t n, const {number} *speed, const {number} *argument, int pair, double *epsilon, double *loss)
{{
    for (size_t i = 0; i < n; i++) {{
        {body}
    }}
}}
"""
_BODIES = {
    "constant": (
        "(void)speed; (void)argument; epsilon[i] = {name}_epsilon[pair]; loss[i] = (1 - epsilon[i]) * (1 + epsilon[i]);"
    ),
    "speed": (
        "(void)pair; epsilon[i] = {name}_restitution(speed[i], argument[i]); "
        "loss[i] = {name}_dissipation(speed[i], argument[i]);"
    ),
    "v_star": (
        "(void)pair; (void)speed; epsilon[i] = {name}_restitution(argument[i]); "
        "loss[i] = {name}_dissipation(argument[i]);"
    ),
}


def _compiled(choice: Choice, text: str, compiler: compilers.Compiler) -> Run:
    """Compile the header and return what runs its functions."""
    scene = choice.scene
    kind = "constant" if isinstance(choice.chosen.candidate, Constant) else scene.code.argument
    header = file_name(choice.scene)
    source = _SOURCE.format(
        marker=MARKER, header=header, number=scene.code.format, body=_BODIES[kind].format(name=scene.name)
    )
    library = compilers.build(compiler, {"scalar": {"check.c": source}}, {header: text})["scalar"]

    def run(speed: Array, beta: Array, pair: int) -> tuple[FloatArray, FloatArray]:
        argument = _v_star(speed, beta) if kind == "v_star" else beta
        epsilon, loss = np.full(speed.shape, np.nan), np.full(speed.shape, np.nan)
        pointers = (ctypes.c_void_p(values.ctypes.data) for values in (speed, argument))
        results = (ctypes.c_void_p(values.ctypes.data) for values in (epsilon, loss))
        library.check(ctypes.c_size_t(speed.size), *pointers, ctypes.c_int(pair), *results)
        return epsilon, loss

    return run
