"""Requests for exported files: options of `viscopade export`, and the files that `viscopade reproduce` writes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, NamedTuple

from viscopade.approximation.measure import Measure
from viscopade.generated import marker_line, template
from viscopade.kernels import catalogue, compact, inverse, prove_lacunary, prove_rational, quotient
from viscopade.kernels.catalogue import Entry
from viscopade.kernels.forms import speed_kernel
from viscopade.kernels.forms.lacunary_kernels import HalfLineKernel, InverseKernel
from viscopade.kernels.forms.quotient import Quotient
from viscopade.kernels.kernel import Kernel
from viscopade.kernels.names import FAST, SERIES_DIGITS, SERIES_ORDER, TARGETS, TIERS
from viscopade.kernels.targets import quotients, table_free, tables, vectors
from viscopade.kernels.targets.language import Renderer, Target
from viscopade.kernels.targets.languages import LANGUAGES, targets
from viscopade.kernels.targets.languages import target as target_of
from viscopade.progress import track
from viscopade.theory.law import VISCOELASTIC, law_of
from viscopade.theory.series import series

MODULE = "viscopade"

Degrees = Sequence[tuple[int, int]]

_OF_FITS = ("minimax", "accuracy")
_NEEDED = {
    **dict.fromkeys(("v_star_min", "v_star_max", "measure"), _OF_FITS),
    "epsilon_min": ("inverse",),
    "size": ("from_speed",),
}
"""Options that need one of others, without which they would change nothing."""


@dataclass(frozen=True)
class Request:
    """A request to `viscopade export`; its fields are the command's options.

    A file holds kernels of one kind: quotients of polynomials in v* (`pade`, and `minimax` and `accuracy` on an
    interval), compact kernels (`accuracy` without an interval), inverse kernels, those of full accuracy, or one from
    speed to eps.

    Attributes
    ----------
    full : bool
        The kernels of full accuracy, in C.
    pade, minimax : sequence of (m, n)
        Degrees of Padé and of best approximants.
    accuracy : sequence of str
        Proven errors: the cheapest best approximant on the interval, or the smallest kernel for all v* >= 0.
    inverse : sequence of str
        Proven relative errors of v*(eps).
    from_speed : sequence of str
        At most one of `names.TIERS`: a kernel that needs no root, in C.
    size : "fast" or "small"
        Of its table.
    v_star_min, v_star_max : str or None
        Interval of the best approximants.
    epsilon_min : str
        Where the inverse ends; "0" for all of (0, 1].
    measure : "both" or "relative"
        Of the error of best approximants.
    law : str
        Law of contact, for Padé approximants in v* = kappa^(1/d); contact ends where the force vanishes.
    """

    full: bool = False
    pade: Degrees = ()
    minimax: Degrees = ()
    accuracy: Sequence[str] = ()
    inverse: Sequence[str] = ()
    from_speed: Sequence[str] = ()
    size: str = FAST
    v_star_min: str = "0"
    v_star_max: str | None = None
    epsilon_min: str = "0"
    measure: Measure = "both"
    law: str = "viscoelastic"

    def __post_init__(self) -> None:
        if self.minimax and self.v_star_max is None:
            raise ValueError("minimax is given without an interval: accepted is minimax with v_star_max (--v-star-max)")
        for name, needed in _NEEDED.items():
            if getattr(self, name) != getattr(Request, name) and not any(getattr(self, other) for other in needed):
                others, flags = " or ".join(needed), ", ".join(f"--{other.replace('_', '-')}" for other in needed)
                raise ValueError(f"{name} is given without {others}: accepted is {name} with {others} ({flags})")
        if law_of(self.law) != VISCOELASTIC and (not self.pade or self.minimax or self.accuracy):
            raise ValueError(f"the law is {self.law}: accepted with it is pade alone (--pade)")
        if self.v_star_max is None and self.v_star_min != "0":
            raise ValueError(
                "v_star_min is given without v_star_max: accepted is an interval with both ends (--v-star-max)"
            )
        if len(self.from_speed) > 1:
            raise ValueError(
                f"from_speed is {', '.join(self.from_speed)}: accepted is one accuracy, as a file holds one kernel"
            )
        if len(self._kinds) > 1:
            kinds = " and ".join(kind.name for kind in self._kinds)
            raise ValueError(f"the request asks for {kinds}: accepted is one kind of kernels in a file")

    @classmethod
    def of(cls, entries: Sequence[Entry]) -> Request:
        """Return the request for kernels of the catalogue, which have the same options but for the lists of kernels."""
        options = dict[str, Any]()
        for entry in entries:
            for name, value in entry.options.items():
                options[name] = (*options.get(name, ()), *value) if isinstance(value, tuple) else value
        return cls(**options)

    def kernels(self) -> list[Kernel]:
        """Return the requested kernels.

        Raises
        ------
        ValueError
            If one does not exist, or cannot be as accurate as wanted.
        """
        law = law_of(self.law)
        for m, n in self.pade:
            if m + n < law.d:
                raise ValueError(f"pade is {m}/{n}: expected m + n >= {law.d}, as 1 - eps begins with v*^{law.d}")
        found = [quotient.pade(m, n, law) for m, n in self.pade]
        if self.v_star_max is None:
            found += [compact.compact(accuracy, self.measure) for accuracy in self.accuracy]
        else:
            ends = self.v_star_max, self.v_star_min, self.measure
            found += [quotient.best(m, n, *ends) for m, n in self.minimax]
            found += [quotient.accurate(accuracy, *ends) for accuracy in self.accuracy]
        return [*found, *(inverse.inverse(accuracy, self.epsilon_min) for accuracy in self.inverse)]

    def prove(self) -> list[Any]:
        """Return the requested kernels, with their proofs; None stands for full accuracy. Errors as for `quotients`."""
        return [kernel for kind in self._kinds for kernel in kind.kernels(self)]

    @property
    def _kinds(self) -> list[Kind]:
        """The kinds of kernels asked for."""
        return [kind for kind in KINDS if kind.wanted(self)]

    def command(self, target: str) -> str:
        """Return the command line."""
        words = ["viscopade export", target]
        for option in fields(self):
            value = getattr(self, option.name)
            if value != option.default:
                given = [""] if value is True else [value] if isinstance(value, str) else value
                texts = (item if isinstance(item, str) else "/".join(map(str, item)) for item in given)
                words += (f"--{option.name.replace('_', '-')} {text}".rstrip() for text in texts)
        return " ".join(words)

    def quotients(self) -> list[Quotient]:
        """Return the requested quotients of polynomials, with their proofs.

        Raises
        ------
        ValueError
            If an approximant does not exist or is eps = 1, or cannot be as accurate as wanted.
        """
        law = law_of(self.law)
        for m, n in self.pade:
            if m + n < law.d:
                raise ValueError(f"pade is {m}/{n}: accepted is m + n >= {law.d}, as 1 - eps begins with v*^{law.d}")
        ends = self.v_star_max, self.v_star_min, self.measure
        found: list[Quotient] = [
            prove_rational.of_pade(m, n) if law == VISCOELASTIC else prove_rational.sampled_pade(m, n, law)
            for m, n in self.pade
        ]
        found += (prove_rational.of_minimax(m, n, *ends) for m, n in self.minimax)
        found += (prove_rational.accurate(accuracy, *ends) for accuracy in self.accuracy)
        return found

    def half_line_kernels(self) -> list[HalfLineKernel]:
        """Return the requested kernels for all v* >= 0, with their proofs; errors as for `quotients`."""
        return [prove_lacunary.half_line_kernel(accuracy, self.measure) for accuracy in self.accuracy]

    def inverse_kernels(self) -> list[InverseKernel]:
        """Return the requested inverse kernels, with their proofs; errors as for `quotients`."""
        return [prove_lacunary.inverse_kernel(accuracy, self.epsilon_min) for accuracy in self.inverse]

    def render(self, target: str, module: str = MODULE) -> str:
        """Return the text that `viscopade export` makes; `module` is the module's name, if it has one of its own.

        Raises
        ------
        ValueError
            For an unknown target, an approximant that does not exist, or the same one twice.
        """
        if target not in TARGETS:
            raise ValueError(f"target is {target!r}: accepted are {', '.join(TARGETS)}")
        kind = (self._kinds or KINDS)[0]
        if kind.id == COMPACT.id and target in LANGUAGES and not target_of(target).compact:
            others = " or from_speed or full (--from-speed, --full)" * ("full" in target_of(target).renderers)
            raise ValueError(
                f"accuracy is given without an interval: accepted for {target} is accuracy with v_star_max "
                f"(--v-star-max){others}"
            )
        if target not in kind.targets:
            raise ValueError(f"target is {target!r}: accepted for {kind.name} is {', '.join(kind.targets)}")
        if target in ("certificates", "vectors") and law_of(self.law) != VISCOELASTIC:
            raise ValueError(
                f"the law is {self.law}, and nothing is proven of it: accepted for {target} is viscoelastic"
            )
        render = kind.tables.get(target) or target_of(target).renderers.get(kind.id)
        if render is not None:
            return render(kind.kernels(self), self.command(target))
        assert kind.compact is not None  # the target is one of the kind's
        return kind.compact(target_of(target), kind.kernels(self), self.command(target), module)


class Kind(NamedTuple):
    """A kind of kernels that may share a file: its id in targets' renderers, and its name.

    `wanted` says whether a request asks for it, `kernels` gives what it asks for, with the proofs; `tables` make the
    text of a file of numbers of that and the command line. `compact` makes the text of compact languages.
    """

    id: str
    name: str
    wanted: Callable[[Request], object]
    kernels: Callable[[Request], list[Any]]
    tables: Mapping[str, Renderer] = {}
    compact: Callable[[Target, Any, str, str], str] | None = None

    @property
    def targets(self) -> list[str]:
        """The targets of its files."""
        written = (t.name for t in targets() if self.id in t.renderers or (self.compact is not None and t.compact))
        return [*written, *self.tables]


QUOTIENTS = Kind(
    "quotient",
    "quotients of polynomials",
    lambda asked: asked.pade or asked.minimax or (asked.accuracy and asked.v_star_max is not None),
    Request.quotients,
    {
        "csv": tables.csv_table,
        "json": tables.json_table,
        "latex": tables.latex_table,
        "certificates": tables.certificates,
        "vectors": vectors.render,
    },
    compact=quotients.render,
)
_PROVEN_TABLES: Mapping[str, Renderer] = {
    "json": tables.records,
    "certificates": tables.certificates,
    "vectors": vectors.render,
}
COMPACT = Kind(
    "compact",
    "compact kernels",
    lambda asked: asked.accuracy and asked.v_star_max is None,
    Request.half_line_kernels,
    _PROVEN_TABLES,
    compact=table_free.render,
)
KINDS = (
    QUOTIENTS,
    COMPACT,
    Kind(
        "inverse",
        "inverse kernels",
        lambda asked: asked.inverse,
        Request.inverse_kernels,
        _PROVEN_TABLES,
    ),
    Kind("full", "kernels of full accuracy", lambda asked: asked.full, lambda _: [None], {"vectors": vectors.render}),
    Kind(
        "speed",
        "kernels of speed",
        lambda asked: asked.from_speed,
        lambda asked: [prove_lacunary.speed_kernel(tier, asked.size) for tier in asked.from_speed],
        {"vectors": vectors.render},
    ),
)

PAPER, RECOMMENDED, WITHOUT_TABLES, INVERSE = (
    Request.of(catalogue.group(name)) for name in ("pade", "minimax", "compact", "inverse")
)
PAPER_DEGREES = PAPER.pade


def default(target: str) -> Request:
    """Return the request of a command without options: the paper's table, or the kernels for all v* >= 0."""
    return WITHOUT_TABLES if target in LANGUAGES and target_of(target).compact else PAPER


def _in_languages(kind: str, request: Request, stem: str) -> dict[str, tuple[Request, str]]:
    """Return the files of a request in the languages that write a kind of kernels."""
    return {stem + target.suffix: (request, target.name) for target in targets() if kind in target.renderers}


_FILES = {
    **_in_languages("quotient", PAPER, "viscopade_pade"),
    "pade_table.csv": (PAPER, "csv"),
    "pade_table.json": (PAPER, "json"),
    "pade_table.tex": (PAPER, "latex"),
    "pade_certificates.json": (PAPER, "certificates"),
    **_in_languages("quotient", RECOMMENDED, "viscopade_minimax"),
    "minimax_table.json": (RECOMMENDED, "json"),
    "minimax_certificates.json": (RECOMMENDED, "certificates"),
    **{target.stem + target.suffix: (WITHOUT_TABLES, target.name) for target in targets() if target.compact},
    "vectors_compact.json": (WITHOUT_TABLES, "vectors"),
    **_in_languages("inverse", INVERSE, "viscopade_inverse"),
    "inverse_certificates.json": (INVERSE, "certificates"),
    **_in_languages("full", Request(full=True), "viscopade_full"),
    **{
        name: found
        for tier in TIERS
        for name, found in _in_languages(
            "speed", Request(from_speed=(tier,)), speed_kernel.file_of(tier).partition(".")[0]
        ).items()
    },
}
# Test vectors of each header's kernels.
_FILES |= {
    f"vectors_{name[len('viscopade_') : -len('.h')]}.json": (request, "vectors")
    for name, (request, _) in _FILES.items()
    if name.endswith(".h")
}


def render(target: str, degrees: Degrees = PAPER_DEGREES) -> str:
    """Return the text that `viscopade export TARGET --pade …` makes; errors as for `Request.render`."""
    return Request(pade=degrees).render(target)


def render_series(target: str, order: int, digits: int) -> str:
    """Return the table of h_0 … h_order as CSV or JSON, with its provenance."""
    command = f"viscopade export series-{target} --order {order} --digits {digits}"
    renderer = {"csv": tables.series_csv, "json": tables.series_json}[target]
    return renderer(series(order, digits).decimals(), command)


_SERIES = {f"series.{target}": target for target in ("csv", "json")}
VERSION_HEADER = "viscopade_version.h"
"""The header that has the version and no kernel, for CMake and for checks before a kernel is included."""
NAMES = (*_FILES, *_SERIES, VERSION_HEADER)
"""The files in `exports/`."""


def file(name: str) -> str:
    """Return the text of a file in `exports/`."""
    if name in _SERIES:
        return render_series(_SERIES[name], SERIES_ORDER, SERIES_DIGITS)
    if name == VERSION_HEADER:
        return template(tables.__name__, "version_alone.h.jinja").render(
            marker=marker_line("viscopade export version-header")
        )
    request, target = _FILES[name]
    return request.render(target)


def files() -> dict[str, str]:
    """Return name and text of every file in `exports/`."""
    return {NAMES[i]: file(NAMES[i]) for i in track(range(len(NAMES)), "exports")}
