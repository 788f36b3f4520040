"""Measure all kernels and their rivals in one run, on the same speeds, in C that is compiled on the spot.

The numbers are those of one machine and one compiler; what carries over are the ratios.
"""

from __future__ import annotations

import platform
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from importlib.metadata import version

from viscopade import arguments
from viscopade.generated import marker_line
from viscopade.kernels import toolchain
from viscopade.kernels.toolchain import Compiler
from viscopade.progress import track
from viscopade.scene.cost import PADE
from viscopade_lab.bench import calls, goals, ours, rivals
from viscopade_lab.bench.contender import Contender
from viscopade_lab.bench.harness import ArraySizes, BenchError, Harness, in_rounds
from viscopade_lab.bench.result import Conditions, Error, Machine, Result
from viscopade_lab.bench.rivals import COPY
from viscopade_lab.bench.sources import COMMAND
from viscopade_lab.bench.speed_range import SpeedRange
from viscopade_lab.bench.times import rows

__all__ = ["BenchError", "Result", "Settings", "SpeedRange", "names", "run"]

ROUNDS, QUICK_ROUNDS = 20, 3
MOST_ROUNDS = 10_000
LEAST_ELEMENTS, MOST_ELEMENTS = 1 << 10, 1 << 28

Reader = Callable[[str], str]

_QUICK = ArraySizes(memory=1 << 14, scalar=1 << 9, duration=2e4, sampled=1 << 10)


@dataclass(frozen=True)
class Settings:
    """What `viscopade bench` is asked for.

    Attributes
    ----------
    rounds : int or None
        None: 20, or 3 if `quick`.
    memory_elements : int or None
        Of the arrays from memory. None: 2^23, or 2^14 if `quick`.
    range : SpeedRange
    only : sequence of str
        Ids of kernels and rivals, or the beginnings of some; none means all. The scaled copy and pow + [3/6], to which
        all are compared, are always measured.
    quick : bool
        Too few elements and rounds for numbers that mean something: to see whether it runs.
    cuda : float or None
        Time of the CUDA kernel over that of a copy on the device, measured elsewhere.
    """

    rounds: int | None = None
    memory_elements: int | None = None
    range: SpeedRange = field(default_factory=SpeedRange)
    only: Sequence[str] = ()
    quick: bool = False
    cuda: float | None = None

    def __post_init__(self) -> None:
        self.range.require_measurable()
        if self.rounds is not None:
            arguments.integer("rounds", self.rounds, 1, MOST_ROUNDS)
        if self.memory_elements is not None:
            arguments.integer("memory_elements", self.memory_elements, LEAST_ELEMENTS, MOST_ELEMENTS)
        if self.cuda is not None and not 0 < self.cuda < 1e6:
            raise ValueError(f"cuda is {self.cuda!r}: accepted is a positive ratio")
        if self.only:
            known = names(self.range)
            for name in self.only:
                _require(name, any(_related(name, ident) for ident in known), known)

    @property
    def sizes(self) -> ArraySizes:
        """How much is measured at once."""
        sizes = _QUICK if self.quick else ArraySizes()
        if self.memory_elements is None:
            return sizes
        return ArraySizes(self.memory_elements, sizes.cache, sizes.scalar, sizes.duration, sizes.sampled)

    @property
    def number_of_rounds(self) -> int:
        """The rounds, with the default filled in."""
        return self.rounds or (QUICK_ROUNDS if self.quick else ROUNDS)

    @property
    def command(self) -> str:
        """The command line, without the options that are left at their defaults or name files."""
        default = SpeedRange()
        words = [COMMAND, *(["--quick"] if self.quick else [])]
        words += [f"--rounds {self.rounds}"] if self.rounds is not None else []
        words += [f"--memory-elements {self.memory_elements}"] if self.memory_elements is not None else []
        words += (
            f"--{name.replace('_', '-')} {getattr(self.range, name)}"
            for name in vars(default)
            if getattr(self.range, name) != getattr(default, name)
        )
        words += (f"--only {name}" for name in self.only)
        words += [f"--cuda {self.cuda:g}"] if self.cuda is not None else []
        return " ".join(words)

    def wants(self, ident: str) -> bool:
        """Return whether a contender is to be measured."""
        return not self.only or ident in (COPY, PADE) or any(_begins(name, ident) for name in self.only)


def names(speeds: SpeedRange) -> list[str]:
    """Return what `only` accepts."""
    return [*ours.FILES, *(contender.id for contender in rivals.contenders(speeds))]


def _begins(name: str, ident: str) -> bool:
    """Return whether a name is an id, or its beginning up to a hyphen."""
    return f"{ident}-".startswith(f"{name}-")


def _related(name: str, ident: str) -> bool:
    return _begins(name, ident) or _begins(ident, name)


def _require(name: str, found: bool, known: Sequence[str]) -> None:
    if not found:
        raise ValueError(f"there is no kernel {name!r}: accepted are {', '.join(known)}, and what begins so")


def run(settings: Settings, cc: str | None = None, read: Reader | None = None) -> Result:
    """Compile, check and measure.

    Parameters
    ----------
    settings : Settings
    cc : str or None
        Command of the C compiler. None: the environment's CC, or cc.
    read : callable or None
        From the name of an exported header to its text. None: they are made, which takes minutes.

    Raises
    ------
    toolchain.ToolchainError
        If there is no compiler, or it fails.
    BenchError
        If a kernel computes wrong results.
    ValueError
        If a header cannot be read.
    """
    compiler = toolchain.find_compiler(cc)
    contenders, texts = _contenders(settings, read or _made)
    sizes = settings.sizes
    harness = Harness(contenders, texts, compiler, settings.range, sizes)
    harness.check()
    times = in_rounds([*harness.tasks(), *calls.tasks(harness, contenders)], settings.number_of_rounds)
    labels = {contender.id: (contender.label, contender.group) for contender in contenders}
    return Result(
        command=marker_line(settings.command),
        machine=_machine(compiler),
        conditions=Conditions(
            rounds=settings.number_of_rounds,
            range=settings.range,
            memory_elements=sizes.memory,
            cache_elements=sizes.cache,
            flags_scalar=" ".join(compiler.flags("scalar")),
            flags_array=" ".join(compiler.flags("array")),
        ),
        rows=tuple(rows(times, labels, PADE, COPY)),
        errors=tuple(_errors(harness, contenders)),
        goals=tuple(goals.judged(times, sizes.memory, calls.ratio(times), settings.cuda)),
        curves=tuple(harness.error_curve(contender) for contender in contenders if _has_curve(contender)),
    )


def _contenders(settings: Settings, read: Reader) -> tuple[list[Contender], dict[str, str]]:
    """Return the contenders that are wanted, and the headers they need."""
    wanted = [file for ident, file in ours.FILES.items() if _any_wanted(settings, ident)]
    texts = {wanted[i]: read(wanted[i]) for i in track(range(len(wanted)), "headers")}
    contenders = [*ours.contenders(texts, settings.range), *rivals.contenders(settings.range)]
    ids = [contender.id for contender in contenders]
    for name in settings.only:
        _require(name, any(_begins(name, ident) for ident in ids), ids)
    return [contender for contender in contenders if settings.wants(contender.id)], texts


def _any_wanted(settings: Settings, ident: str) -> bool:
    return not settings.only or any(_related(name, ident) for name in settings.only)


def _made(name: str) -> str:
    """Return an exported header, made here and now."""
    from viscopade.kernels import requests

    return requests.file(name)


def _has_curve(contender: Contender) -> bool:
    return contender.group == "ours" and contender.beta == "one"


def _errors(harness: Harness, contenders: Sequence[Contender]) -> Iterable[Error]:
    """Return the largest errors of all contenders."""
    for i in track(range(len(contenders)), "errors"):
        contender = contenders[i]
        for form in contender.formats:
            relative, loss = harness.largest_errors(contender, form) or (None, None)
            yield Error(
                contender.id,
                contender.label,
                contender.group,
                form.name,
                relative,
                loss,
                contender.proven.get(form.name) or None,
                contender.proven_of,
                contender.note,
                harness.range,
            )


def _machine(compiler: Compiler) -> Machine:
    """Return where this runs, without names of hosts or paths."""
    libc = " ".join(platform.libc_ver()).strip()
    system = f"{platform.system()} {platform.machine()}"
    return Machine(
        cpu=toolchain.processor(),
        compiler=compiler.version,
        system=f"{system}, {libc}" if libc else system,
        python=platform.python_version(),
        numpy=version("numpy"),
    )
