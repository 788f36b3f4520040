"""A benchmark's result, checked: frozen data from the JSON that `viscopade bench` writes."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, cast

from viscopade.arithmetic.formats import FORMATS as BINARY
from viscopade.arrays import double
from viscopade.kernels.v_star import of_v_star as of_rounded_v_star
from viscopade.records import Node

_TERM = re.compile(r"([0-9]+[.]?[0-9]*(?:[eE][+-]?[0-9]{1,3})?)( ulp)?")

GROUPS = ("ours", "rival", "limit")
FORMATS = tuple(BINARY)
SPEEDS = ("log-uniform", "maxwell", "equal")
MEASURES = ("latency", "throughput", "cache", "memory")
PROVEN_OF = ("speed", "v_star")

# Sampled errors are written with four digits: the true one may be smaller by this part.
_WRITTEN = 5e-4


@dataclass(frozen=True)
class Machine:
    """Where it was measured; every field is a line of text."""

    cpu: str
    compiler: str
    system: str
    python: str
    numpy: str


@dataclass(frozen=True)
class Scene:
    """The speeds that were measured: from `speed_min` to `speed_max`, in `unit`; beta fits this unit."""

    beta: float
    speed_min: float
    speed_max: float
    unit: str

    def v_star(self, speed: float) -> float:
        """Return v* = beta^(1/2) v^(1/10)."""
        return math.sqrt(self.beta) * math.pow(speed, 0.1)


@dataclass(frozen=True)
class Settings:
    """How it was measured: rounds, scene, lengths of the arrays, and the compiler's flags."""

    rounds: int
    scene: Scene
    memory_elements: int
    cache_elements: int
    flags_scalar: str
    flags_array: str


@dataclass(frozen=True)
class Row:
    """One measured time: nanoseconds per collision, and its ratios to two others.

    Attributes
    ----------
    spread : float
        Distance of the quartiles, relative to the median.
    """

    id: str
    label: str
    group: str
    format: str
    speeds: str
    measure: str
    min: float
    median: float
    spread: float
    ratio_to_3_6: float | None
    ratio_to_copy: float | None


@dataclass(frozen=True)
class Error:
    """Largest errors of one kernel in one format, over the scene.

    Attributes
    ----------
    relative, loss : float or None
        Sampled maximum of |d eps|/eps, and of |d eps|/(1 - eps).
    proven : str or None
        A proven bound of both, as it is written: a number, a number of ulps of eps, or a sum of these.
    bound : float or None
        The same as a number, over the scene.
    of_v_star : bool
        The bound is one of eps(v*), and the rounding of v* is not in it.
    allowed : float or None
        The most that can be sampled if the bound holds: with the rounding of v*, and that of the eps compared with.
    """

    id: str
    label: str
    group: str
    format: str
    relative: float | None
    loss: float | None
    proven: str | None
    bound: float | None
    of_v_star: bool
    allowed: float | None
    note: str

    @property
    def sampled(self) -> float | None:
        """The larger of the two sampled errors; None if there is none."""
        return max((value for value in (self.relative, self.loss) if value is not None), default=None)

    @property
    def exceeds_proof(self) -> bool:
        """Whether a sampled error is larger than the proven bound, as those of eps(v*) may be."""
        return self.bound is not None and self.sampled is not None and self.sampled > self.bound

    @property
    def contradicts_proof(self) -> bool:
        """Whether a sampled error is larger than the proof allows: then one of the two is wrong."""
        return self.allowed is not None and self.sampled is not None and self.sampled * (1 - _WRITTEN) > self.allowed

    @property
    def is_proven(self) -> bool:
        """Whether `value` is the proven bound."""
        return self.bound is not None and not self.exceeds_proof

    @property
    def value(self) -> float | None:
        """The proven bound, or the sampled error where there is no bound or where it exceeds the bound."""
        return self.bound if self.is_proven else self.sampled


@dataclass(frozen=True)
class Target:
    """What was to be reached, and whether it was; None: not measured."""

    what: str
    target: str
    measured: str
    reached: bool | None
    note: str


@dataclass(frozen=True)
class Curve:
    """Relative error of eps over v*, as measured; both of the same length."""

    id: str
    label: str
    v_star: tuple[float, ...]
    error: tuple[float, ...]


@dataclass(frozen=True)
class Result:
    """All of it."""

    command: str
    machine: Machine
    settings: Settings
    rows: tuple[Row, ...]
    errors: tuple[Error, ...]
    targets: tuple[Target, ...]
    curves: tuple[Curve, ...]

    def error(self, row: Row) -> Error | None:
        """Return the errors of a row's kernel; None if the result has none."""
        return next((e for e in self.errors if (e.id, e.format) == (row.id, row.format)), None)


class _Node(Node):
    """A value in the file, with its place for messages."""

    def bound(self, ulp: float) -> float | None:
        """Return a sum of numbers and numbers of ulps as a number, or None."""
        if self.value is None:
            return None
        terms = [_TERM.fullmatch(term.strip()) for term in self.text().split("+")]
        found = [float(term[1]) * (ulp if term[2] else 1) for term in terms if term is not None]
        if len(found) < len(terms) or not 0 < sum(found) < math.inf:
            raise self.refuse('a bound such as "6.7e-6", "0.57 ulp" or "6.7e-6 + 0.5 ulp", or null')
        return sum(found)

    def verdict(self) -> bool | None:
        """Return true, false or None."""
        if self.value is not None and not isinstance(self.value, bool):
            raise self.refuse("true, false or null")
        return self.value

    def words(self) -> str:
        """Return text, or a number or null as text."""
        if self.value is None:
            return ""
        if isinstance(self.value, str):
            return self.text(empty=True)
        return f"{self.number():.4g}"


def from_json(text: str | bytes, source: str) -> dict[str, Any]:
    """Return the result in a JSON file's text, checked.

    Parameters
    ----------
    text : str or bytes
        The file's content.
    source : str
        The file's name, for messages.

    Raises
    ------
    ValueError
        One line that names the file, the key, what is there and what is accepted.
    """
    data = Node.of_json(text, source).value
    checked(data, source)
    return cast(dict[str, Any], data)


def checked(data: object, source: str = "result") -> Result:
    """Return a benchmark's result as frozen data.

    Raises
    ------
    ValueError
        As `from_json` does.
    """
    whole = _Node(source, "", data)
    machine = whole["machine"]
    rows = whole["rows"]
    settings = _settings(whole["settings"])
    result = Result(
        command=whole["command"].text(),
        machine=Machine(**{name: machine[name].text() for name in Machine.__dataclass_fields__}),
        settings=settings,
        rows=tuple(map(_row, rows.items())),
        errors=tuple(_error(node, settings.scene) for node in whole["errors"].items()),
        targets=tuple(map(_target, whole["targets"].items())),
        curves=tuple(map(_curve, whole["curves"].items())) if whole.has("curves") else (),
    )
    if not result.rows:
        raise rows.refuse("a list of at least one row")
    _refuse_repeated(source, "rows", [(row.id, row.format, row.speeds, row.measure) for row in result.rows])
    _refuse_repeated(source, "errors", [(error.id, error.format) for error in result.errors])
    _refuse_repeated(source, "curves", [(curve.id,) for curve in result.curves])
    return result


def _refuse_repeated(source: str, key: str, names: list[tuple[str, ...]]) -> None:
    for i, name in enumerate(names):
        if name in names[:i]:
            raise ValueError(f"{source}: {key}[{i}] repeats {', '.join(name)}: accepted is each once")


def _settings(node: _Node) -> Settings:
    scene, flags = node["scene"], node["flags"]
    low, high = scene["speed_min"], scene["speed_max"]
    if low.number(positive=True) > high.number(positive=True):
        raise high.refuse(f"at least speed_min, {low.value!r}")
    return Settings(
        rounds=node["rounds"].count(),
        scene=Scene(scene["beta"].number(positive=True), low.number(), high.number(), scene["unit"].text()),
        memory_elements=node["memory_elements"].count(),
        cache_elements=node["cache_elements"].count(),
        flags_scalar=flags["scalar"].text(empty=True),
        flags_array=flags["array"].text(empty=True),
    )


def _row(node: _Node) -> Row:
    ns = node["ns"]
    if ns["min"].number(positive=True) > ns["median"].number(positive=True):
        raise ns["min"].refuse(f"at most the median, {ns['median'].value!r}")
    return Row(
        id=node["id"].text(),
        label=node["label"].text(),
        group=node["group"].choice(GROUPS),
        format=node["format"].choice(FORMATS),
        speeds=node["speeds"].choice(SPEEDS),
        measure=node["measure"].choice(MEASURES),
        min=ns["min"].number(),
        median=ns["median"].number(),
        spread=ns["spread"].number(),
        ratio_to_3_6=node["ratio_to_3_6"].optional(positive=True),
        ratio_to_copy=node["ratio_to_copy"].optional(positive=True),
    )


def _error(node: _Node, scene: Scene) -> Error:
    form = node["format"].choice(FORMATS)
    bound = node["proven"].bound(_ulp(form, scene))
    # Results of older versions do not say it: any of their bounds may be one of eps(v*).
    of_v_star = not node.has("proven_of") or node["proven_of"].choice(PROVEN_OF) == "v_star"
    return Error(
        id=node["id"].text(),
        label=node["label"].text(),
        group=node["group"].choice(GROUPS),
        format=form,
        relative=node["relative"].optional(),
        loss=node["loss"].optional(),
        proven=None if node["proven"].value is None else node["proven"].text(),
        bound=bound,
        of_v_star=of_v_star,
        allowed=None if bound is None else _allowed(bound, form, scene, of_v_star=of_v_star),
        note=node["note"].text(empty=True),
    )


def _ulp(form: str, scene: Scene) -> float:
    """Return the most that an ulp of eps can be over the scene, relative to the smaller of eps and 1 - eps."""
    epsilon = 2.0**-52 if form == "double" else 2.0**-23
    # Below 1/2, an ulp of eps is at most epsilon eps. From 1/2 on it is epsilon/2, and 1 - eps is least at the scene's
    # lowest speed.
    return max(epsilon, epsilon / 2 / float(double.one_minus_epsilon(scene.v_star(scene.speed_min))))


def _allowed(bound: float, form: str, scene: Scene, *, of_v_star: bool) -> float:
    """Return the most that a sampled error can be if a bound holds."""
    root = of_root(form, scene) if of_v_star else 0.0
    return (1 + bound) * (1 + root) - 1 + double.ULP["epsilon"] * _ulp("double", scene)


def of_root(form: str, scene: Scene) -> float:
    """Bound what the rounding of v* = sqrt(beta) pow(speed, 0.1) does to eps, relative to min(eps, 1 - eps)."""
    return float(of_rounded_v_star(BINARY[form], Fraction(max(scene.speed_max, 1 / scene.speed_min))))


def _target(node: _Node) -> Target:
    return Target(
        what=node["what"].text(),
        target=node["target"].words(),
        measured=node["measured"].words(),
        reached=node["reached"].verdict(),
        note=node["note"].text(empty=True),
    )


def _curve(node: _Node) -> Curve:
    v_star = tuple(item.number(positive=True) for item in node["v_star"].items())
    error = tuple(item.number() for item in node["error"].items())
    if not v_star:
        raise node["v_star"].refuse("a list of at least one number")
    if len(v_star) != len(error):
        raise ValueError(f"{node.source}: {node.key}.error has {len(error)} numbers: accepted is one for each v_star")
    return Curve(node["id"].text(), node["label"].text(), v_star, error)
