"""Check of the code generated for a scene: a run at many speeds, compared with the exact eps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from viscopade.arrays import double
from viscopade.arrays.checked import FloatArray
from viscopade.arrays.double import exact_of_speed
from viscopade.kernels.write import runners
from viscopade.kernels.write.runners import ToolchainError
from viscopade.scene.choice import Choice
from viscopade.scene.render import calls, file_name
from viscopade.scene.tolerance import MEASURES

# Collisions of each pair, at most, and of all pairs together, about; each pair has at least 1000. Chosen by hand for
# the time of a slow interpreter. The errors are proven: the check is for mistakes in the generated text.
SPEEDS = 20_000
COLLISIONS = 1_000_000
REFERENCE = 1e-15  # more than the relative error of the exact results, in double precision (sampled)
_SEED = 7  # of the random speeds and sizes, which are the same in each run; any other number does

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
        The largest error by the name of the tolerance; empty if the code was not run.
    reason : str
        Reason why it was not run, as the end of a sentence; empty if it was run.
    """

    how: str
    collisions: int = 0
    errors: Mapping[str, float] = field(default_factory=dict)
    reason: str = ""


class Collisions(NamedTuple):
    """Collisions of all pairs: arguments for the code, in the scene's units and format, and the exact results.

    `pair` has the numbers of the pairs, `eps` the exact eps, and `loss` 1 - eps.
    """

    arguments: tuple[Array, ...]
    pair: npt.NDArray[np.int_]
    eps: FloatArray
    loss: FloatArray


def check_code(choice: Choice, text: str, cc: str | None = None) -> SceneCheck:
    """Run the generated code at many speeds, and compare its results with the exact eps.

    Parameters
    ----------
    choice : Choice
    text : str
        The code, from `render`.
    cc : str or None
        Command of the C compiler. By default the environment's CC, or cc.

    Returns
    -------
    SceneCheck
        With a reason if the tool is missing.

    Raises
    ------
    ToolchainError
        If the tool fails, or the code's errors exceed the tolerance.
    """
    code, constant = choice.scene.code, choice.chosen.is_constant
    language, number, runner = code.spoken, code.number, code.spoken.run
    tool = runners.find_tool(runner, cc if runner.variable == "CC" else None)
    if tool is None:
        return SceneCheck("", reason=f"not run: there is no {runners.missing(runner)}")
    # Compile the file with a driver that evaluates these calls, and run it at the collisions of the scene.
    call_texts = calls(choice, "x", "y")
    if constant:
        call_texts = [f"{call} + {number.literal(0.0)} * x" for call in call_texts]  # drivers have arguments
    with TemporaryDirectory() as folder:
        program = runners.build(language, number, (file_name(choice.scene), text), call_texts, tool, Path(folder))
        sample = collisions(choice)
        # The program gives a row for each call: eps of each pair for a constant, or else eps and 1 - eps^2.
        if constant:
            eps = program(np.zeros(1))[:, 0].astype(float)[sample.pair]
            results = np.array([eps, (1 - eps) * (1 + eps)])
        else:
            results = program(*sample.arguments).astype(float)
    return _compare(choice, sample, tool.version, results)


# --- collisions -------------------------------------------------------------------------------------------------------


def collisions(choice: Choice) -> Collisions:
    """Return collisions of each pair at speeds and sizes all over the scene of a choice."""
    # The million collisions are divided among the pairs.
    pairs = len(choice.encounters)
    size = max(1000, min(SPEEDS, COLLISIONS // pairs))
    speeds_and_betas = [_sample_pair(choice, i, size) for i in range(pairs)]
    speed, beta = (np.concatenate(values) for values in zip(*speeds_and_betas, strict=True))
    # The exact eps and 1 - eps are those of the arguments as they are after rounding to the format of the code.
    pair = np.repeat(np.arange(pairs), size)
    if choice.scene.code.argument == "v_star":
        # v* = beta^(1/2) v^(1/10), in the format of the code
        argument = np.sqrt(beta) * speed ** speed.dtype.type(0.1)
        v_star = argument.astype(np.float64)
        return Collisions(
            (argument,), pair, np.asarray(double.epsilon(v_star)), np.asarray(double.one_minus_epsilon(v_star))
        )
    return Collisions((speed, beta), pair, *exact_of_speed(speed.astype(np.float64), beta.astype(np.float64)))


def _sample_pair(choice: Choice, pair: int, size: int) -> tuple[Array, Array]:
    """Return speeds and betas of `size` random collisions of a pair (its number), in the units and format of the code.

    The first two collisions are those at the ends of both ranges.
    """
    encounter, scale = choice.encounters[pair], choice.scene.scale
    number_type = np.float32 if choice.scene.code.format == "float" else np.float64
    random = np.random.default_rng((_SEED, pair)).random((2, size))
    random[:, :2] = [0, 1], [0, 1]  # the smallest speed and beta, and the largest
    # From the weakest to the strongest pair beta grows; both ends of both ranges are among the samples.
    speeds = encounter.speeds.slowest / scale.speed, encounter.speeds.fastest / scale.speed
    betas = scale.beta(encounter.weakest.beta), scale.beta(encounter.strongest.beta)
    # Numbers whose logarithms are uniform; clip undoes the rounding of powers at the ends.
    speed, beta = (
        np.clip(low * (high / low) ** x, low, high).astype(number_type)
        for (low, high), x in zip((speeds, betas), random, strict=True)
    )
    return speed, beta


# --- results ----------------------------------------------------------------------------------------------------------


def _compare(choice: Choice, sample: Collisions, how: str, results: FloatArray) -> SceneCheck:
    """Return the largest errors of the code's eps and 1 - eps^2, the rows of `results`, on the collisions of `sample`.

    `how` is the tool that ran the code. ToolchainError: the errors are too large.
    """
    # 1 - eps^2 = (1 - eps) (1 + eps), which does not cancel.
    eps, dissipation = sample.eps, sample.loss * (1 + sample.eps)
    deviation = np.abs(results[0] - eps)
    deviations = {
        "epsilon": deviation / eps,
        "dissipation": np.abs(results[1] - dissipation) / dissipation,
        "absolute": deviation,
    }
    errors = {name: float(np.nan_to_num(values, nan=np.inf).max()) for name, values in deviations.items()}
    limits, proven = choice.scene.tolerance.limits(), choice.chosen.errors
    # The other errors must meet twice the file's bounds, because mathematical libraries may round differently from what
    # the bounds assume. An error that is no number counts as infinite.
    others = {name: 2 * float(bound) for name, bound in proven.items() if name not in limits}
    for name, limit in (limits | others).items():
        if not errors[name] <= limit + REFERENCE:
            raise ToolchainError(
                f"the generated code fails its check: {MEASURES[name]} is {errors[name]:.3g}, more than {limit:.3g}"
            )
    return SceneCheck(how, sample.pair.size, errors)
