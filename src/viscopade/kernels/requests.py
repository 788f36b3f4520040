"""Exported files: the texts of requests for kernels, and the files that `viscopade reproduce` writes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence

from viscopade.arithmetic.decimals import identifier
from viscopade.generated import marker_lines
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
    """Return the text that `viscopade export TARGET` makes of a request's kernels.

    `module` is the module's name, if it has one of its own.

    Raises
    ------
    ValueError
        For an unknown target, an approximant that does not exist, or the same one twice.
    """
    if target not in TARGETS:
        raise ValueError(f"target is {target!r}: expected {', '.join(TARGETS)}")
    kernels, command = distinct(request.kernels()), request.command(target)
    if target not in TABLES:
        # Code. The module has the name of the file in `exports/` with this request, if there is one, and else the
        # language's own, by which its files with one group of kernels and with several are told apart.
        names = (name.partition(".")[0] for name, origin in _FILES.items() if origin == (request, target))
        in_language = language(target)
        own_name = f"{in_language.stem}_kernels" if len(in_language.groups) > 1 else in_language.stem
        return file_text(kernels, in_language, command, module or next(names, own_name))
    # Data: tables for people and programs. Only test vectors tell what a kernel with a table of numbers computes.
    if target != "vectors" and any(kernel.tables for kernel in kernels):
        raise ValueError(f"target is {target!r}: expected {_WITH_TABLES} or vectors, as the kernel has a table")
    if target == "latex":
        return tables.latex_table(kernels, command, request.digits)
    return _TABLES[target](kernels, command)


def distinct(kernels: Sequence[Kernel]) -> Sequence[Kernel]:
    """Return the kernels; refuse an empty sequence and repeated names."""
    if not kernels:
        raise ValueError("no kernel is asked for: expected at least one")
    # The name of a function in code consists of what it takes and the kernel's name.
    for (_, name), count in Counter((kernel.argument, kernel.name) for kernel in kernels).items():
        if count > 1:
            raise ValueError(f"the kernel {name} is asked for twice: expected each kernel once")
    return kernels


# The function that makes a target's text of kernels and the command.
_TABLES: Mapping[str, Callable[[Sequence[Kernel], str], str]] = {
    "csv": tables.csv_table,
    "json": tables.json_table,
    "certificates": tables.certificates,
    "vectors": vectors.render,
}

# The request for all kernels of each group.
_GROUPS = {name: catalogue.group_request(name) for name in ("pade", "minimax", "compact", "inverse")}
PAPER, RECOMMENDED, COMPACT, INVERSE = _GROUPS.values()
# The language, C, that writes kernels which read tables.
_WITH_TABLES = next(name for name in LANGUAGES if language(name).table)


def default(target: str) -> Request:
    """Return the request of `viscopade export TARGET` without options: the paper's table, or a language's first group.

    That group are the kernels for all v* >= 0.
    """
    return PAPER if target in TABLES else _GROUPS[language(target).groups[0]]


# The files in `exports/` with kernels: name -> (request, target). A language has a file for each of its groups.
_FILES = {
    **{
        f"{code.stem}{f'_{group}' * (len(code.groups) > 1)}{code.ending}": (_GROUPS[group], code.name)
        for code in map(language, LANGUAGES)
        for group in code.groups
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
    """Return the table of h_0 … h_order, eps = sum h_k v*^k, as CSV, JSON or LaTeX (`target`), with its provenance.

    `digits` is the number of significant digits of each.
    """
    command = _series_command(target, order, digits)
    renderer = {"csv": tables.series_csv, "json": tables.series_json, "latex": tables.series_latex}[target]
    return renderer(series(order, digits).decimals(), command)


def _series_command(target: str, order: int, digits: int) -> str:
    """Return the command that writes this table of h_k."""
    return f"viscopade export series-{target} --order {order} --digits {digits}"


_SERIES = {f"series.{target}": target for target in ("csv", "json")}
VERSION_HEADER, VERSION_COMMAND = "viscopade_version.h", "viscopade export version-header"
"""The header that has the version and no kernel, for CMake and for checks before a kernel is included."""
README = "README.md"
"""The list of the other files."""
NAMES = (*_FILES, *_SERIES, VERSION_HEADER, README)
"""The files in `exports/`."""
_FIRST = {
    "viscopade_speed_1em5.h": "eps from speed and beta, in C and C++",
    "viscopade.cuh": "eps from speed and beta, on a GPU",
    "viscopade_full.h": "eps from v* to the last digit, in C and C++",
    "pade_table.tex": "the paper's table, in LaTeX",
}
"""The files that most people want, and what they are for."""


def _readme() -> str:
    """Return the list of all files, each with the command that makes it, as a page of Markdown."""
    commands = {name: request.command(target) for name, (request, target) in _FILES.items()}
    commands |= {name: _series_command(target, SERIES_ORDER, SERIES_DIGITS) for name, target in _SERIES.items()}
    commands[VERSION_HEADER] = VERSION_COMMAND
    first = [f"- {purpose}: [`{name}`]({name})" for name, purpose in _FIRST.items()]
    rows = [f"| [`{name}`]({name}) | `{command}` |" for name, command in commands.items()]
    return "\n".join(
        [
            "<!-- " + "\n".join(marker_lines("viscopade reproduce")) + " -->",
            "",
            "# Exported files",
            "",
            "Each file begins with its command, licence, end condition, and the proven errors of its functions.",
            "Most people want one of four files:",
            "",
            *first,
            "",
            "Uses: [C and C++](../docs/usage/c-and-cpp.md), [other languages](../docs/reference/languages.md).",
            "`viscopade reproduce --out exports` writes all files. One command writes one file:",
            "",
            "| file | command |",
            "|---|---|",
            *rows,
            "",
        ]
    )


def file(name: str) -> str:
    """Return the text of a file in `exports/`, by its name (one of `NAMES`)."""
    # Four kinds of files: the series, the header with the version, the list of files, and those with kernels.
    if name in _SERIES:
        return render_series(_SERIES[name], SERIES_ORDER, SERIES_DIGITS)
    if name == VERSION_HEADER:
        return version_text(language(_WITH_TABLES), VERSION_COMMAND)
    if name == README:
        return _readme()
    return render(*_FILES[name])


def files() -> dict[str, str]:
    """Return name and text of every file in `exports/`."""
    return {NAMES[i]: file(NAMES[i]) for i in track(range(len(NAMES)), "exports")}
