"""Records: what was fitted and proven once is stored as data, and a function that is asked for it again reads the data.

`recorded` marks a function whose result is a record: the same for the same arguments, and costly. The record is looked
for in this process, among the package's own (data/kernels, made by `tools.kernel_records`), and in the user's cache
directory. A record that is found nowhere is made, and stored in the cache.

A record is JSON: doubles are hexadecimal, fractions "p/q". A file in the cache begins with a checksum; a record that it
does not fit is made anew. The file's name is a digest of the package's sources and of the record's key, so that another
version of the code finds nothing of this one's.
"""

from __future__ import annotations

import hashlib
import json
import os
import pkgutil
import re
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from decimal import Decimal
from fractions import Fraction
from functools import lru_cache, wraps
from inspect import signature
from pathlib import Path
from typing import Any, TypeVar, cast, get_type_hints

from viscopade.arithmetic.formats import FORMATS, Format

FOLDER = "data/kernels"
LONGEST_NAME = 80
VARIABLE = "VISCOPADE_CACHE"
"""The environment variable that names another cache directory."""
MOST_BYTES = 64 << 20
"""Of all records in the user's cache; the ones unused for longest are deleted first."""

_OURS = re.compile(r"[0-9a-f]{32}\.json|record-\w+\.new")  # the latter of runs that were killed
_INNERMOST = re.compile(r"\[[^][{}]*\]")

Function = TypeVar("Function", bound=Callable[..., Any])

_use_cache = True
_anew: dict[str, str] | None = None  # where everything is made anew: what was made, by file name
_forget: list[Callable[[], None]] = []


def recorded(make: Function) -> Function:
    """Mark a function of hashable arguments whose result is kept as a record; its annotations say of what type."""
    form = signature(make)

    @lru_cache(maxsize=256)
    def known(*arguments: Any) -> Any:
        return _found(make, arguments)

    @wraps(make)
    def found(*arguments: Any, **named: Any) -> Any:
        bound = form.bind(*arguments, **named)
        bound.apply_defaults()
        given = [*zip(bound.args, form.parameters.values(), strict=True)]
        while given and given[-1][0] == given[-1][1].default:  # defaults are no part of the key
            given.pop()
        return known(*(value for value, _ in given))

    _forget.append(known.cache_clear)
    return cast(Function, found)


def _found(make: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
    key = [make.__name__.strip("_"), *_converter().unstructure(arguments)]
    known = _read(key) if _anew is None else None
    if known is not None:
        with suppress(LookupError, TypeError, ValueError):  # a record of another form is none
            return _converter().structure(known["value"], get_type_hints(make)["return"])
    made = make(*arguments)
    record = _text({"key": key, "value": _converter().unstructure(made)})
    if _anew is None:
        _keep(key, record)
    else:
        _anew[_file_name(key)] = record
    return made


@contextmanager
def anew() -> Iterator[dict[str, str]]:
    """Make everything anew in a `with` block, and store nothing. Yields the records made, as texts by file name."""
    global _anew
    before, _anew = _anew, {}
    _clear()
    try:
        yield _anew
    finally:
        _anew = before
        _clear()


@contextmanager
def without_cache() -> Iterator[None]:
    """Leave the user's cache alone in a `with` block."""
    global _use_cache
    before, _use_cache = _use_cache, False
    try:
        yield
    finally:
        _use_cache = before


def of_package(name: str) -> str | None:
    """Return the text of one of the package's own records, or None."""
    try:
        return (pkgutil.get_data("viscopade", f"{FOLDER}/{name}") or b"").decode()
    except OSError:
        return None


def _clear() -> None:
    for forget in _forget:
        forget()


@lru_cache(maxsize=1)
def _converter() -> Any:
    """Return the converter between objects and what JSON holds."""
    from cattrs import Converter  # imported when it is used: `import viscopade` stays cheap

    converter = Converter(detailed_validation=False)
    for kind, write, read_text in (
        (float, float.hex, float.fromhex),
        (Fraction, str, Fraction),
        (Decimal, str, Decimal),
    ):
        converter.register_unstructure_hook(kind, write)
        converter.register_structure_hook(kind, lambda text, _, read_text=read_text: read_text(text))
    converter.register_unstructure_hook(Format, lambda form: form.name)
    converter.register_structure_hook(Format, lambda name, _: FORMATS[name])

    hints = lru_cache(get_type_hints)

    def written(value: Any) -> dict[str, Any]:
        return {name: converter.unstructure(part) for name, part in value._asdict().items()}

    def read(parts: dict[str, Any], kind: Any) -> Any:
        return kind(**{name: converter.structure(parts[name], hint) for name, hint in hints(kind).items()})

    converter.register_unstructure_hook_func(_is_named_tuple, written)
    converter.register_structure_hook_func(_is_named_tuple, read)
    return converter


def _is_named_tuple(kind: Any) -> bool:
    return hasattr(kind, "_fields")


def _file_name(key: list[Any]) -> str:
    """Return the name of a record among the package's own: readable, and with a digest where it would be long."""
    text = json.dumps(key)
    words = re.sub(r"[^A-Za-z0-9_.]+", "-", text).strip("-")
    return f"{words if len(words) < LONGEST_NAME else f'{words[:LONGEST_NAME]}-{_digest(text)[:8]}'}.json"


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _text(record: dict[str, Any]) -> str:
    """Return a record as JSON, each innermost list on a line of its own."""
    return _INNERMOST.sub(lambda found: " ".join(found[0].split()), json.dumps(record, indent=1)) + "\n"


def _read(key: list[Any]) -> Any:
    """Return the record of a key, or None: of the package, or of the cache if its checksum holds."""
    found = of_package(_file_name(key))
    path = None if found else _cached(key)
    if path is not None:
        with suppress(OSError):
            found = _checked(path)
    record = json.loads(found) if found else None
    return record if record is not None and record["key"] == key else None


def _checked(path: Path) -> str | None:
    """Return the record in a file of the cache; None for another content than `_keep` wrote."""
    if not path.is_file() or path.stat().st_size > MOST_BYTES:
        return None
    digest, _, text = path.read_bytes().partition(b"\n")
    if digest != hashlib.sha256(text).hexdigest().encode():
        return None
    with suppress(OSError):  # of another user
        os.utime(path)
    return text.decode()


def _keep(key: list[Any], record: str) -> None:
    """Store a record in the cache, after its checksum; where that is impossible, nothing happens."""
    path = _cached(key)
    if path is None:
        return
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, new = tempfile.mkstemp(dir=path.parent, prefix="record-", suffix=".new")
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(f"{_digest(record)}\n{record}".encode())
            Path(new).replace(path)  # at once: a run beside this one reads a whole file or none
        except OSError:
            Path(new).unlink(missing_ok=True)
        _shrink(path.parent)


def _shrink(folder: Path) -> None:
    """Delete the records that are unused for longest, and no file of another kind."""
    ours = [path for path in folder.iterdir() if _OURS.fullmatch(path.name) and path.is_file()]
    files = sorted((path.stat().st_mtime, path.stat().st_size, path) for path in ours)
    excess = sum(size for _, size, _ in files) - MOST_BYTES
    for _, size, path in files:
        if excess <= 0:
            break
        path.unlink(missing_ok=True)
        excess -= size


def _cached(key: list[Any]) -> Path | None:
    """Return the file of a record in the cache; None where no cache is wanted, or the code's version is not known."""
    from platformdirs import user_cache_path

    sources = _sources()
    if not _use_cache or sources is None:
        return None
    folder = os.environ.get(VARIABLE)
    parent = Path(folder).expanduser() if folder else user_cache_path("viscopade", appauthor=False)
    return parent / "kernels" / f"{_digest(sources + json.dumps(key))[:32]}.json"


@lru_cache(maxsize=1)
def _sources() -> str | None:
    """Return a digest of everything that records depend on; None if the sources are not files (in an archive)."""
    from importlib.metadata import version

    root = Path(__file__).parent
    wings = ("arithmetic", "arrays", "theory", "collision", "approximation", "kernels")
    files = [path for wing in wings for path in (root / wing).rglob("*.py")]
    if not files:
        return None
    digest = hashlib.sha256("".join(version(package) for package in ("numpy", "python-flint", "pint")).encode())
    for path in sorted([*files, *root.glob("*.py"), *(root / "data").glob("*.*")]):
        digest.update(path.relative_to(root).as_posix().encode() + path.read_bytes())
    return digest.hexdigest()
