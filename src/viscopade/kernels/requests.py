"""Requests for exported files: options of `viscopade export`, and the files that `viscopade reproduce` writes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

from viscopade.arithmetic.decimals import identifier
from viscopade.kernels import catalogue, compact, full, inverse, quotient, speed_table
from viscopade.kernels.catalogue import Entry
from viscopade.kernels.kernel import Kernel
from viscopade.kernels.write import tables, vectors
from viscopade.kernels.write.file import file_text, version_text
from viscopade.kernels.write.languages import NAMES as LANGUAGES
from viscopade.kernels.write.languages import language
from viscopade.kernels.write.targets import LATEX_DIGITS, SERIES_DIGITS, SERIES_ORDER, TABLES, TARGETS
from viscopade.progress import track
from viscopade.theory.law import VISCOELASTIC
from viscopade.theory.series import series

Degrees = Sequence[tuple[int, int]]


@dataclass(frozen=True)
class Request:
    """A request to `viscopade export`; its fields are the command's options.

    A file holds all kernels that are asked for.

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
        At most one accuracy of `catalogue.SPEEDS`: a kernel that needs no root, in C.
    v_star_min, v_star_max : str or None
        Interval of the best approximants.
    digits : int
        Significant digits of coefficients, for LaTeX.
    """

    full: bool = False
    pade: Degrees = ()
    minimax: Degrees = ()
    accuracy: Sequence[str] = ()
    inverse: Sequence[str] = ()
    from_speed: Sequence[str] = ()
    v_star_min: str = "0"
    v_star_max: str | None = None
    digits: int = LATEX_DIGITS

    def __post_init__(self) -> None:
        if self.minimax and self.v_star_max is None:
            raise ValueError("minimax is given without an interval: expected minimax with v_star_max (--v-star-max)")
        for name in ("v_star_min", "v_star_max"):
            if getattr(self, name) != getattr(Request, name) and not (self.minimax or self.accuracy):
                raise ValueError(
                    f"{name} is given without minimax or accuracy: expected it with one of them (--minimax, --accuracy)"
                )
        if self.v_star_max is None and self.v_star_min != "0":
            raise ValueError(
                "v_star_min is given without v_star_max: expected an interval with both ends (--v-star-max)"
            )
        if len(self.from_speed) > 1:
            raise ValueError(
                f"from_speed is {', '.join(self.from_speed)}: expected one accuracy, as a file holds one kernel"
            )

    @classmethod
    def of(cls, entries: Sequence[Entry]) -> Request:
        """Return the request for kernels of the catalogue, whose options differ in the lists of kernels alone."""
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
        for m, n in self.pade:
            if m + n < VISCOELASTIC.d:
                raise ValueError(f"pade is {m}/{n}: expected m + n >= {VISCOELASTIC.d}, as 1 - eps begins with v*^2")
        found = [quotient.pade_quotient(m, n) for m, n in self.pade]
        if self.v_star_max is None:
            found += [compact.compact(accuracy) for accuracy in self.accuracy]
        else:
            ends = self.v_star_max, self.v_star_min
            found += [quotient.best_fit(m, n, *ends) for m, n in self.minimax]
            found += [quotient.accurate_quotient(accuracy, *ends) for accuracy in self.accuracy]
        found += [inverse.inverse(accuracy) for accuracy in self.inverse]
        found += [full.full()] if self.full else []
        return [*found, *(speed_table.speed_table(accuracy) for accuracy in self.from_speed)]

    def command(self, target: str) -> str:
        """Return the command line."""
        words = ["viscopade export", target]
        for option in fields(self):
            value = getattr(self, option.name)
            if value != option.default:
                given = [""] if value is True else [str(value)] if isinstance(value, (str, int)) else value
                texts = (item if isinstance(item, str) else "/".join(map(str, item)) for item in given)
                words += (f"--{option.name.replace('_', '-')} {text}".rstrip() for text in texts)
        return " ".join(words)

    def render(self, target: str, module: str | None = None) -> str:
        """Return the text that `viscopade export` makes; `module` is the module's name, if it has one of its own.

        Raises
        ------
        ValueError
            For an unknown target, an approximant that does not exist, or the same one twice.
        """
        if target not in TARGETS:
            raise ValueError(f"target is {target!r}: expected {', '.join(TARGETS)}")
        kernels = distinct(self.kernels())
        if target in TABLES:
            if target != "vectors" and any(kernel.tables for kernel in kernels):
                raise ValueError(f"target is {target!r}: expected {_WITH_TABLES} or vectors, as the kernel has a table")
            if target == "latex":
                return tables.latex_table(kernels, self.command(target), self.digits)
            return _TABLES[target](kernels, self.command(target))
        return file_text(kernels, language(target), self.command(target), module or self._module(target))

    def _module(self, target: str) -> str:
        """Return the name of the file's module: that of the file in `exports/`, if there is one."""
        known = [name.partition(".")[0] for name, made in _FILES.items() if made == (self, target)]
        of = language(target)
        return next(iter(known), f"{of.stem}_kernels" if len(of.groups) > 1 else of.stem)


def distinct(kernels: Sequence[Kernel]) -> Sequence[Kernel]:
    """Return the kernels; refuse an empty sequence and repeated names."""
    if not kernels:
        raise ValueError("no kernel is asked for: expected at least one")
    for (_, name), count in Counter((kernel.argument, kernel.name) for kernel in kernels).items():
        if count > 1:
            raise ValueError(f"the kernel {name} is asked for twice: expected each kernel once")
    return kernels


_TABLES: Mapping[str, Callable[[Sequence[Kernel], str], str]] = {
    "csv": tables.csv_table,
    "json": tables.json_table,
    "certificates": tables.certificates,
    "vectors": vectors.render,
}

_GROUPS = {name: Request.of(catalogue.group(name)) for name in ("pade", "minimax", "compact", "inverse")}
PAPER, RECOMMENDED, COMPACT, INVERSE = _GROUPS.values()
_WITH_TABLES = next(name for name in LANGUAGES if language(name).table)


def default(target: str) -> Request:
    """Return the request of a command without options: the paper's table, or the kernels for all v* >= 0."""
    return PAPER if target in TABLES else _GROUPS[language(target).groups[0]]


_FILES = {
    **{
        f"{of.stem}{f'_{group}' * (len(of.groups) > 1)}{of.ending}": (_GROUPS[group], of.name)
        for of in map(language, LANGUAGES)
        for group in of.groups
    },
    "pade_table.csv": (PAPER, "csv"),
    "pade_table.json": (PAPER, "json"),
    "pade_table.tex": (PAPER, "latex"),
    "pade_certificates.json": (PAPER, "certificates"),
    "minimax_table.json": (RECOMMENDED, "json"),
    "minimax_certificates.json": (RECOMMENDED, "certificates"),
    "vectors_compact.json": (COMPACT, "vectors"),
    "inverse_certificates.json": (INVERSE, "certificates"),
    "viscopade_full.h": (Request(full=True), _WITH_TABLES),
    **{
        f"viscopade_speed_{identifier(tier)}.h": (Request(from_speed=(tier,)), _WITH_TABLES) for tier in catalogue.TIERS
    },
}
# Test vectors of each header's kernels.
_FILES |= {
    f"vectors_{name[len('viscopade_') : -len('.h')]}.json": (request, "vectors")
    for name, (request, _) in _FILES.items()
    if name.endswith(".h")
}


def render_series(target: str, order: int, digits: int) -> str:
    """Return the table of h_0 … h_order as CSV, JSON or LaTeX, with its provenance."""
    command = f"viscopade export series-{target} --order {order} --digits {digits}"
    renderer = {"csv": tables.series_csv, "json": tables.series_json, "latex": tables.series_latex}[target]
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
        return version_text(language(_WITH_TABLES), "viscopade export version-header")
    request, target = _FILES[name]
    return request.render(target)


def files() -> dict[str, str]:
    """Return name and text of every file in `exports/`."""
    return {NAMES[i]: file(NAMES[i]) for i in track(range(len(NAMES)), "exports")}
