"""Check of the code generated for a scene: a run at many speeds, compared with the exact eps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from viscopade.arrays import double
from viscopade.arrays.checked import FloatArray
from viscopade.arrays.double import exact_of_speed
from viscopade.generated import MARKER, template
from viscopade.kernels.targets.language import Runner
from viscopade.kernels.toolchain import ToolchainError
from viscopade.scene import runners
from viscopade.scene.candidate import PairConstant
from viscopade.scene.choice import WORDS, Choice
from viscopade.scene.render import file_name, layout

SPEEDS = 20_000  # for each pair
COLLISIONS = 1_000_000  # of all pairs, about
REFERENCE = 1e-15  # more than the relative error of what is compared with, in double precision (sampled)
_SEED = 7

Array = npt.NDArray[Any]


@dataclass(frozen=True)
class SceneCheck:
    """Result of the check.

    Attributes
    ----------
    how : str
        Compiler or interpreter; empty if there is none.
    collisions : int
        0 if the code was not run.
    errors : mapping of str to float
        By name of the tolerance, the largest error; empty if the code was not run.
    reason : str
        Why it was not run, as the end of a sentence; empty if it was.
    """

    how: str
    collisions: int = 0
    errors: Mapping[str, float] = field(default_factory=dict)
    reason: str = ""


@dataclass(frozen=True)
class Collisions:
    """Collisions of all pairs: inputs for the code, in the scene's units and format, and the exact results."""

    speed: Array
    beta: Array
    argument: Array
    pair: npt.NDArray[np.int32]
    eps: FloatArray
    loss: FloatArray

    @property
    def bytes(self) -> bytes:
        """The inputs as bytes, for the program."""
        return b"".join(values.tobytes() for values in (self.speed, self.argument, self.pair))


def check_code(choice: Choice, text: str, cc: str | None = None) -> SceneCheck:
    """Run the generated code at many speeds, and compare its results with the exact eps.

    Parameters
    ----------
    choice : Choice
    text : str
        What `render` returned.
    cc : str or None
        Command of the C compiler. None: the environment's CC, or cc.

    Returns
    -------
    SceneCheck
        With a reason if the tool is missing, or only compiles, as those of shaders do.

    Raises
    ------
    ToolchainError
        If the tool fails, or the code's errors exceed the tolerance.
    """
    target = choice.scene.code.target
    tool = runners.find_tool(target.runner, cc if target.runner.variable == "CC" else None)
    device = "" if target.device is None else _device(choice, text, target.device)
    if tool is None:
        reason = f"not run: there is no {runners.missing(target.runner)}"
        return SceneCheck(device, reason=f"{reason}; {device}" if device else reason)
    file = file_name(choice.scene), text
    if not target.runner.start:
        runners.run_driver(target.runner, tool, _driver(choice, text, 1), file, b"", 0)
        return SceneCheck(tool.version, reason="compiled, not run")
    given = _collisions(choice)
    size = given.speed.size
    written = runners.run_driver(target.runner, tool, _driver(choice, text, size), file, given.bytes, 16 * size)
    how = f"{tool.version}; {device}" if device else tool.version
    return _compared(choice, given, how, np.frombuffer(written).reshape(2, size))


def _device(choice: Choice, text: str, runner: Runner) -> str:
    """Compile the code for a GPU; return what was done."""
    tool = runners.find_tool(runner)
    if tool is None:
        return f"device code is not compiled: there is no {runners.missing(runner)}"
    driver = _driver(choice, text, 1, "check_on_device")
    runners.run_driver(runner, tool, driver, (file_name(choice.scene), text), b"", 0)
    return f"device code compiled by {tool.version}, not run"


def _driver(choice: Choice, text: str, size: int, part: str = "check") -> str:
    """Return the text of the program that calls the code."""
    scene, code = choice.scene, choice.scene.code
    return template(__name__, code.target.template(part)).render(
        marker=MARKER,
        text=text,
        file=file_name(scene),
        size=size,
        bytes=4 if code.format == "float" else 8,
        constant=isinstance(choice.chosen.candidate, PairConstant),
        by_v_star=code.argument == "v_star",
        input=runners.INPUT,
        output=runners.OUTPUT,
        titles=[encounter.name for encounter in choice.encounters],
        **layout(choice),
    )


# --- collisions -------------------------------------------------------------------------------------------------------


def _collisions(choice: Choice) -> Collisions:
    """Return collisions of each pair at speeds and sizes all over the scene."""
    pairs = len(choice.encounters)
    size = max(1000, min(SPEEDS, COLLISIONS // pairs))
    made = [_of_pair(choice, i, size) for i in range(pairs)]
    speed, given = (np.concatenate(values) for values in zip(*made, strict=True))
    pair = np.repeat(np.arange(pairs, dtype=np.int32), size)
    wide = [values.astype(np.float64) for values in (speed, given)]
    if choice.scene.code.argument == "v_star":
        argument = _v_star(speed, given)
        v_star = argument.astype(np.float64)
        eps, loss = np.asarray(double.epsilon(v_star)), np.asarray(double.one_minus_epsilon(v_star))
        return Collisions(speed, given, argument, pair, eps, loss)
    eps, loss = exact_of_speed(*wide)
    return Collisions(speed, given, given, pair, eps, loss)


def _of_pair(choice: Choice, pair: int, size: int) -> tuple[Array, Array]:
    """Return speeds and betas of a pair."""
    encounter, scale = choice.encounters[pair], choice.scene.scale
    kind = np.float32 if choice.scene.code.format == "float" else np.float64
    random = np.random.default_rng((_SEED, pair)).random((2, size))
    random[:, :2] = [0, 1], [0, 1]  # the ends
    slowest, fastest = (v / scale.speed for v in (encounter.speeds.slowest, encounter.speeds.fastest))
    weakest, strongest = (scale.beta(p.beta) for p in (encounter.weakest, encounter.strongest))
    return _between(slowest, fastest, random[0]).astype(kind), _between(weakest, strongest, random[1]).astype(kind)


def _between(low: float, high: float, random: FloatArray) -> FloatArray:
    """Return numbers whose logarithms are uniform."""
    values = np.exp(np.log(low) + (np.log(high) - np.log(low)) * random)
    return np.asarray(np.clip(values, low, high))


def _v_star(speed: Array, beta: Array) -> Array:
    return np.asarray(np.sqrt(beta) * speed ** speed.dtype.type(0.1))


# --- results ----------------------------------------------------------------------------------------------------------


def _compared(choice: Choice, given: Collisions, how: str, found: FloatArray) -> SceneCheck:
    """Return the largest errors of the eps and 1 - eps^2 that were found, or refuse them."""
    eps, dissipation = given.eps, given.loss * (1 + given.eps)
    off = np.abs(found[0] - eps)
    errors = {
        "epsilon": _largest(off / eps),
        "dissipation": _largest(np.abs(found[1] - dissipation) / dissipation),
        "absolute": _largest(off),
    }
    limits, proven = choice.scene.tolerance.given(), vars(choice.chosen.candidate.errors)
    # Measures without a tolerance must still meet twice the file's bounds (libraries may round differently).
    others = {name: 2 * float(bound) for name, bound in proven.items() if name not in limits}
    for name, limit in (limits | others).items():
        if not errors[name] <= limit + REFERENCE:
            raise ToolchainError(
                f"the generated code fails its check: {WORDS[name]} is {errors[name]:.3g}, more than {limit:.3g}"
            )
    return SceneCheck(how, given.speed.size, errors)


def _largest(errors: FloatArray) -> float:
    """Return the largest error; what is no number is infinitely wrong."""
    return float(np.where(np.isnan(errors), np.inf, errors).max())
