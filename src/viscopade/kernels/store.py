"""Records: what was fitted and proven once is stored as data, and a function that is asked for it again reads the data.

`recorded` marks a function whose result is a record: the same for the same arguments, and costly. The record is looked
for in this process, among the package's own (data/kernels, made by `tools.kernel_records`), and in the user's cache
directory. A record that is found nowhere is made, and stored in the cache.

A record is JSON: doubles are hexadecimal, fractions "p/q". The constructors of what is read check it again. A file in
the cache is named by a digest of the package's own sources and of the record's key, so that another version of the code
finds nothing of this one's.
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

_INNERMOST = re.compile(r"\[[^][{}]*\]")

Function = TypeVar("Function", bound=Callable[..., Any])

_use_cache = True
_anew: dict[str, str] | None = None  # where everything is made anew: what was made, by file name
_forget: list[Callable[[], None]] = []


def recorded(make: Function) -> Function:
    """Mark a function of hashable arguments whose result is kept as a record; its annotations say of what type."""
    bind = signature(make).bind

    @lru_cache(maxsize=256)
    def known(*arguments: Any) -> Any:
        return _found(make, arguments)

    @wraps(make)
    def found(*arguments: Any, **named: Any) -> Any:
        bound = bind(*arguments, **named)
        bound.apply_defaults()
        return known(*bound.args)

    _forget.append(known.cache_clear)
    return cast(Function, found)


def _found(make: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
    key = [make.__name__.strip("_"), *_converter().unstructure(arguments)]
    text = _read(key) if _anew is None else None
    if text is not None:
        with suppress(ValueError, TypeError, LookupError):  # another file than ours
            return _converter().structure(json.loads(text)["value"], get_type_hints(make)["return"])
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
def without_cache(wanted: bool = True) -> Iterator[None]:
    """Leave the user's cache alone in a `with` block."""
    global _use_cache
    before, _use_cache = _use_cache, _use_cache and not wanted
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


def _read(key: list[Any]) -> str | None:
    found = of_package(_file_name(key))
    if found is not None or not _use_cache:
        return found
    path = _cached(key)
    try:
        os.utime(path)
        return path.read_text("utf-8")
    except OSError:
        return None


def _keep(key: list[Any], record: str) -> None:
    """Store a record in the cache; where that is impossible, nothing happens."""
    if not _use_cache:
        return
    path = _cached(key)
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, new = tempfile.mkstemp(dir=path.parent, suffix=".new")
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(record)
        Path(new).replace(path)  # at once: a run beside this one reads a whole file or none
        _shrink(path.parent)


def _shrink(folder: Path) -> None:
    files = sorted((entry.stat().st_mtime, entry.stat().st_size, entry.path) for entry in os.scandir(folder))
    excess = sum(size for _, size, _ in files) - MOST_BYTES
    for _, size, path in files:
        if excess <= 0:
            break
        Path(path).unlink(missing_ok=True)
        excess -= size


def _cached(key: list[Any]) -> Path:
    from platformdirs import user_cache_path

    folder = os.environ.get(VARIABLE)
    parent = Path(folder) if folder else user_cache_path("viscopade", appauthor=False)
    return parent / "kernels" / f"{_digest(_sources() + json.dumps(key))[:32]}.json"


@lru_cache(maxsize=1)
def _sources() -> str:
    """Return a digest of everything that records depend on."""
    root = Path(__file__).parents[1]
    wings = ("arithmetic", "arrays", "theory", "collision", "approximation", "kernels")
    files = [path for wing in wings for path in (root / wing).rglob("*.py")] + list((root / "data").glob("*.*"))
    digest = hashlib.sha256()
    for path in sorted(files):
        digest.update(path.relative_to(root).as_posix().encode() + path.read_bytes())
    return digest.hexdigest()
