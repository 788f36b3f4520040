"""The benchmark's result: what `viscopade bench` writes as JSON, and the report reads."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, fields
from fractions import Fraction
from typing import Any, Literal, NamedTuple

from viscopade.arithmetic.formats import FORMATS
from viscopade.arrays import double
from viscopade.kernels.v_star import of_v_star as of_rounded_v_star
from viscopade.records import Node
from viscopade_lab.bench.contender import GROUPS, MEASURES, PROVEN_OF, Group, ProvenOf, TimingMeasure
from viscopade_lab.bench.speed_range import DISTRIBUTIONS, Distribution, SpeedRange

CALL: Literal["call"] = "call"
"""The measure of an array as Python hands it over: only for the ratio of the two that are compared so."""

_TERM = re.compile(r"([0-9]+[.]?[0-9]*(?:[eE][+-]?[0-9]{1,3})?)( ulp)?")
_WRITTEN = 5e-4  # sampled errors are written with four digits: the true one may be smaller by this part


class Key(NamedTuple):
    """What a row of times is about."""

    id: str
    format: str
    speeds: Distribution
    measure: TimingMeasure | Literal["call"]


@dataclass(frozen=True)
class Machine:
    """Where it was measured, without names of hosts or paths; every field is a line of text."""

    cpu: str
    compiler: str
    system: str
    python: str
    numpy: str

    @classmethod
    def from_json(cls, node: Node) -> Machine:
        """Return what a file holds, checked."""
        return cls(**{field.name: node[field.name].text() for field in fields(cls)})


@dataclass(frozen=True)
class Conditions:
    """How it was measured: rounds, speeds, lengths of the arrays, and the compiler's flags."""

    rounds: int
    range: SpeedRange
    memory_elements: int
    cache_elements: int
    flags_scalar: str
    flags_array: str

    def to_json(self) -> dict[str, Any]:
        """Return the conditions as JSON-able data."""
        return {
            "rounds": self.rounds,
            "scene": vars(self.range),
            "memory_elements": self.memory_elements,
            "cache_elements": self.cache_elements,
            "flags": {"scalar": self.flags_scalar, "array": self.flags_array},
        }

    @classmethod
    def from_json(cls, node: Node) -> Conditions:
        """Return what a file holds, checked."""
        flags = node["flags"]
        return cls(
            rounds=node["rounds"].count(),
            range=SpeedRange.from_json(node["scene"]),
            memory_elements=node["memory_elements"].count(),
            cache_elements=node["cache_elements"].count(),
            flags_scalar=flags["scalar"].text(empty=True),
            flags_array=flags["array"].text(empty=True),
        )


@dataclass(frozen=True)
class Timing:
    """The times of a contender in nanoseconds per collision.

    Attributes
    ----------
    spread : float
        Distance of the quartiles, relative to the median.
    ratio_to_3_6, ratio_to_copy : float or None
        Median over the rounds of the time over that of pow + [3/6], or of a scaled copy, in the same round, of the
        same type, speeds and measure.
    """

    id: str
    label: str
    group: Group
    format: str
    speeds: Distribution
    measure: TimingMeasure
    min: float
    median: float
    spread: float
    ratio_to_3_6: float | None
    ratio_to_copy: float | None

    @property
    def key(self) -> Key:
        """What it is about."""
        return Key(self.id, self.format, self.speeds, self.measure)

    def to_json(self) -> dict[str, Any]:
        """Return the row as JSON-able data."""
        return {
            "id": self.id,
            "label": self.label,
            "group": self.group,
            "format": self.format,
            "speeds": self.speeds,
            "measure": self.measure,
            "ns": {"min": _digits(self.min), "median": _digits(self.median), "spread": _digits(self.spread)},
            "ratio_to_3_6": _digits(self.ratio_to_3_6),
            "ratio_to_copy": _digits(self.ratio_to_copy),
        }

    @classmethod
    def from_json(cls, node: Node) -> Timing:
        """Return what a file holds, checked."""
        ns = node["ns"]
        if ns["min"].number(positive=True) > ns["median"].number(positive=True):
            raise ns["min"].refuse(f"at most the median, {ns['median'].value!r}")
        return cls(
            id=node["id"].text(),
            label=node["label"].text(),
            group=node["group"].choice(GROUPS),
            format=node["format"].choice(tuple(FORMATS)),
            speeds=node["speeds"].choice(DISTRIBUTIONS),
            measure=node["measure"].choice(MEASURES),
            min=ns["min"].number(),
            median=ns["median"].number(),
            spread=ns["spread"].number(),
            ratio_to_3_6=node["ratio_to_3_6"].optional(positive=True),
            ratio_to_copy=node["ratio_to_copy"].optional(positive=True),
        )


@dataclass(frozen=True)
class Error:
    """The largest errors of a contender in one format, sampled on a range of speeds.

    Attributes
    ----------
    relative, loss : float or None
        Sampled maximum of |d eps|/eps, and of |d eps|/(1 - eps).
    proven : str or None
        A proven bound of both, as it is written: a number, a number of ulps of eps, or a sum of these.
    proven_of : "speed" or "v_star"
        Whether that is a bound for eps of the speed, or for eps of v*: then the rounding of v* comes on top.
    range : SpeedRange
        Where it was sampled; the JSON form leaves it to the conditions.
    """

    id: str
    label: str
    group: Group
    format: str
    relative: float | None
    loss: float | None
    proven: str | None
    proven_of: ProvenOf
    note: str
    range: SpeedRange

    @property
    def sampled(self) -> float | None:
        """The larger of the two sampled errors; None if there is none."""
        return max((value for value in (self.relative, self.loss) if value is not None), default=None)

    @property
    def bound(self) -> float | None:
        """The proven bound as a number, over the range of speeds."""
        return None if self.proven is None else _number(self.proven, _ulp(self.format, self.range))

    @property
    def allowed(self) -> float | None:
        """The most that can be sampled if the bound holds: with the rounding of v*, and of the eps compared with."""
        bound = self.bound
        if bound is None:
            return None
        root = of_root(self.format, self.range) if self.proven_of == "v_star" else 0.0
        return (1 + bound) * (1 + root) - 1 + double.ULP["epsilon"] * _ulp("double", self.range)

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

    def to_json(self) -> dict[str, Any]:
        """Return the errors as JSON-able data."""
        rounded = {"relative": _digits(self.relative), "loss": _digits(self.loss)}
        return {name: rounded.get(name, value) for name, value in vars(self).items() if name != "range"}

    @classmethod
    def from_json(cls, node: Node, speeds: SpeedRange) -> Error:
        """Return what a file holds, checked."""
        form, proven = node["format"].choice(tuple(FORMATS)), node["proven"]
        if proven.value is not None and _number(proven.text(), _ulp(form, speeds)) is None:
            raise proven.refuse('a bound such as "6.7e-6", "0.57 ulp" or "6.7e-6 + 0.5 ulp", or null')
        return cls(
            id=node["id"].text(),
            label=node["label"].text(),
            group=node["group"].choice(GROUPS),
            format=form,
            relative=node["relative"].optional(),
            loss=node["loss"].optional(),
            proven=None if proven.value is None else proven.text(),
            # Results of older versions do not say it: any of their bounds may be one of eps(v*).
            proven_of=node["proven_of"].choice(PROVEN_OF) if node.has("proven_of") else "v_star",
            note=node["note"].text(empty=True),
            range=speeds,
        )


@dataclass(frozen=True)
class Goal:
    """A ratio that was aimed at: what it is, and whether it was reached (None: not measured)."""

    what: str
    target: str
    measured: float | str | None
    reached: bool | None
    note: str

    @property
    def words(self) -> str:
        """What was measured, for the reader."""
        return f"{self.measured:.4g}" if isinstance(self.measured, float) else self.measured or ""

    def to_json(self) -> dict[str, Any]:
        """Return the goal as JSON-able data."""
        return vars(self) | ({"measured": _digits(self.measured)} if isinstance(self.measured, float) else {})

    @classmethod
    def from_json(cls, node: Node) -> Goal:
        """Return what a file holds, checked."""
        measured, reached = node["measured"], node["reached"]
        return cls(
            what=node["what"].text(),
            target=node["target"].text(),
            measured=measured.text(empty=True) if isinstance(measured.value, str) else measured.optional(),
            reached=None if reached.value is None else reached.flag(),
            note=node["note"].text(empty=True),
        )


@dataclass(frozen=True)
class ErrorCurve:
    """|d eps|/eps of a contender in double over v*: the largest in each of many strips of the range of speeds."""

    id: str
    label: str
    v_star: tuple[float, ...]
    error: tuple[float, ...]

    def to_json(self) -> dict[str, Any]:
        """Return the curve as JSON-able data."""
        points = {"v_star": [_digits(x) for x in self.v_star], "error": [_digits(x) for x in self.error]}
        return {"id": self.id, "label": self.label, **points}

    @classmethod
    def from_json(cls, node: Node) -> ErrorCurve:
        """Return what a file holds, checked."""
        v_star = tuple(item.number(positive=True) for item in node["v_star"].items())
        error = tuple(item.number() for item in node["error"].items())
        if not v_star:
            raise node["v_star"].refuse("a list of at least one number")
        if len(v_star) != len(error):
            words = f"{node.key}.error has {len(error)} numbers: accepted is one for each v_star"
            raise ValueError(f"{node.source}: {words}")
        return cls(node["id"].text(), node["label"].text(), v_star, error)


@dataclass(frozen=True)
class Result:
    """All of it; `command` is the marker of generated files, and the command line."""

    command: str
    machine: Machine
    conditions: Conditions
    rows: tuple[Timing, ...]
    errors: tuple[Error, ...]
    goals: tuple[Goal, ...]
    curves: tuple[ErrorCurve, ...]

    def error(self, row: Timing) -> Error | None:
        """Return the errors of a row's contender; None if the result has none."""
        return next((e for e in self.errors if (e.id, e.format) == (row.id, row.format)), None)

    def to_json(self) -> dict[str, Any]:
        """Return one object with everything."""
        return {
            "command": self.command,
            "machine": vars(self.machine),
            "settings": self.conditions.to_json(),
            "rows": [row.to_json() for row in self.rows],
            "errors": [error.to_json() for error in self.errors],
            "targets": [goal.to_json() for goal in self.goals],
            "curves": [curve.to_json() for curve in self.curves],
        }

    @classmethod
    def from_json(cls, data: object, source: str = "result") -> Result:
        """Return the result that nested data hold, checked; `source` names their file, for messages.

        Raises
        ------
        ValueError
            One line that names the file, the key, what is there and what is accepted.
        """
        whole = Node(source, "", data)
        conditions = Conditions.from_json(whole["settings"])
        result = cls(
            command=whole["command"].text(),
            machine=Machine.from_json(whole["machine"]),
            conditions=conditions,
            rows=tuple(map(Timing.from_json, whole["rows"].items())),
            errors=tuple(Error.from_json(node, conditions.range) for node in whole["errors"].items()),
            goals=tuple(map(Goal.from_json, whole["targets"].items())),
            curves=tuple(map(ErrorCurve.from_json, whole["curves"].items())) if whole.has("curves") else (),
        )
        if not result.rows:
            raise whole["rows"].refuse("a list of at least one row")
        _refuse_repeated(source, "rows", [row.key for row in result.rows])
        _refuse_repeated(source, "errors", [(error.id, error.format) for error in result.errors])
        _refuse_repeated(source, "curves", [(curve.id,) for curve in result.curves])
        return result

    @classmethod
    def from_text(cls, text: str | bytes, source: str) -> Result:
        """Return the result in a JSON file's text, checked as `from_json` does."""
        return cls.from_json(Node.of_json(text, source).value, source)


def of_root(form: str, speeds: SpeedRange) -> float:
    """Bound what the rounding of v* = sqrt(beta) pow(speed, 0.1) does to eps, relative to min(eps, 1 - eps)."""
    return float(of_rounded_v_star(FORMATS[form], Fraction(max(speeds.speed_max, 1 / speeds.speed_min))))


def _ulp(form: str, speeds: SpeedRange) -> float:
    """Return the most that an ulp of eps can be over the speeds, relative to the smaller of eps and 1 - eps."""
    # Below 1/2, an ulp of eps is at most epsilon eps. From 1/2 on it is epsilon/2, and 1 - eps is least at the lowest
    # speed.
    epsilon = FORMATS[form].epsilon
    return max(epsilon, epsilon / 2 / float(double.one_minus_epsilon(speeds.v_star(speeds.speed_min))))


def _number(bound: str, ulp: float) -> float | None:
    """Return a sum of numbers and numbers of ulps as a number, or None if it is none."""
    terms = [_TERM.fullmatch(term.strip()) for term in bound.split("+")]
    found = [float(term[1]) * (ulp if term[2] else 1) for term in terms if term is not None]
    return sum(found) if len(found) == len(terms) and 0 < sum(found) < math.inf else None


def _refuse_repeated(source: str, key: str, names: list[Any]) -> None:
    for i, name in enumerate(names):
        if name in names[:i]:
            raise ValueError(f"{source}: {key}[{i}] repeats {', '.join(name)}: accepted is each once")


def _digits(value: float | None) -> float | None:
    """Return a number to four digits, more are noise, or None if it is infinite or NaN: JSON knows neither."""
    return None if value is None or not math.isfinite(value) else float(f"{value:.4g}")
