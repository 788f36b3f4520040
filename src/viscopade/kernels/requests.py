"""Exported files: the texts of requests for kernels, and the files that `viscopade reproduce` writes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence

from viscopade.arithmetic.decimals import identifier
from viscopade.kernels import catalogue
from viscopade.kernels.catalogue import Request
from viscopade.kernels.kernel import Kernel
from viscopade.kernels.write import tables, vectors
from viscopade.kernels.write.file import file_text, version_text
from viscopade.kernels.write.languages import NAMES as LANGUAGES
from viscopade.kernels.write.languages import language
from viscopade.kernels.write.targets import SERIES_DIGITS, SERIES_ORDER, TABLES, TARGETS
from viscopade.progress import track
from viscopade.theory.series import series


def render(request: Request, target: str, module: str | None = None) -> str:
    """Return the text that `viscopade export` makes; `module` is the module's name, if it has one of its own.

    Raises
    ------
    ValueError
        For an unknown target, an approximant that does not exist, or the same one twice.
    """
    if target not in TARGETS:
        raise ValueError(f"target is {target!r}: expected {', '.join(TARGETS)}")
    kernels, command = distinct(request.kernels()), request.command(target)
    if target not in TABLES:
        return file_text(kernels, language(target), command, module or _module(request, target))
    if target != "vectors" and any(kernel.tables for kernel in kernels):
        raise ValueError(f"target is {target!r}: expected {_WITH_TABLES} or vectors, as the kernel has a table")
    if target == "latex":
        return tables.latex_table(kernels, command, request.digits)
    return _TABLES[target](kernels, command)


def _module(request: Request, target: str) -> str:
    """Return the name of a file's module: that of the file in `exports/`, if there is one."""
    known = [name.partition(".")[0] for name, made in _FILES.items() if made == (request, target)]
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

_GROUPS = {name: catalogue.group_request(name) for name in ("pade", "minimax", "compact", "inverse")}
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
    "viscopade_full.h": (catalogue.CATALOGUE["full"].request, _WITH_TABLES),
    **{
        f"viscopade_speed_{identifier(tier)}.h": (catalogue.CATALOGUE[f"speed {tier}"].request, _WITH_TABLES)
        for tier in catalogue.TIERS
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
    return render(*_FILES[name])


def files() -> dict[str, str]:
    """Return name and text of every file in `exports/`."""
    return {NAMES[i]: file(NAMES[i]) for i in track(range(len(NAMES)), "exports")}
