"""Records: results of costly fits and proofs that are stored in the package, as JSON.

`recorded` marks a function whose results are records, because they are costly and depend only on the arguments.
`tools.kernel_records` makes the records of the package, in data/kernels. A result without a record is computed once a
process. In the JSON, doubles are hexadecimal, and fractions are "p/q".
"""

from __future__ import annotations

import hashlib
import json
import math
import pkgutil
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from decimal import Decimal
from fractions import Fraction
from functools import lru_cache, partial, wraps
from inspect import signature
from operator import attrgetter
from typing import Any, TypeVar, cast, get_type_hints

from viscopade.arithmetic.formats import FORMATS, Format

FOLDER = "data/kernels"
LONGEST_NAME = 80  # characters of a file's name before its digest; a choice, below the limit of every file system
_INNERMOST = re.compile(r"\[[^][{}]*\]")  # a list without lists or objects in it

Function = TypeVar("Function", bound=Callable[..., Any])

_new_records: dict[str, str] | None = None  # inside `fresh_records`: the records that were made, by file name
_cache_clears: list[Callable[[], None]] = []  # of each function with records: clears the results in memory
_named: dict[type, Mapping[str, Any]] = {Format: FORMATS}  # classes whose objects are stored by name, and the objects


def recorded(name: str) -> Callable[[Function], Function]:
    """Mark a function of hashable arguments whose results are records of this name, of the annotated type."""

    def mark(make: Function) -> Function:
        """Return `make` with its results read from records, or kept in memory."""
        parameters = signature(make)

        # 256 results in memory: more than the package has records; a choice.
        @lru_cache(maxsize=256)
        def stored_result(*arguments: Any) -> Any:
            return _result(name, make, arguments)

        @wraps(make)
        def read_or_make(*arguments: Any, **named: Any) -> Any:
            """Return the result for these arguments, positional or by name."""
            # One call has one key, however it is written: all arguments by position, without defaults at the end. So
            # a new parameter with a default changes no key.
            bound = parameters.bind(*arguments, **named)
            bound.apply_defaults()
            values = [*zip(bound.args, parameters.parameters.values(), strict=True)]
            while values and values[-1][0] == values[-1][1].default:
                values.pop()
            return stored_result(*(value for value, _ in values))

        _cache_clears.append(stored_result.cache_clear)
        return cast(Function, read_or_make)

    return mark


def _result(name: str, make: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
    """Return the result of `make` for these arguments from the record of this name; without one, compute it."""
    key = [name, *_converter().unstructure(arguments)]
    file = _file_name(key)
    record = None if _new_records is not None else json.loads(package_record(file) or "null")
    if record is not None and record["key"] == key:  # different keys may have the same file name
        return _converter().structure(record["value"], get_type_hints(make)["return"])
    # No record, or `fresh_records`, which collects the records that results make.
    made = make(*arguments)
    if _new_records is not None:
        _new_records[file] = _text({"key": key, "value": _converter().unstructure(made)})
    return made


@contextmanager
def fresh_records() -> Iterator[dict[str, str]]:
    """Compute all results anew in a `with` block. Yields the records, as texts by file name."""
    # Results in memory are forgotten at both ends: neither old ones inside nor new ones after the block.
    global _new_records
    before, _new_records = _new_records, {}
    _clear()
    try:
        yield _new_records
    finally:
        _new_records = before
        _clear()


def by_name(kind: type, objects: Mapping[str, Any]) -> None:
    """Store the `objects` of a class, which have the attribute `name`, in records by their names."""
    _named[kind] = objects
    _converter.cache_clear()


def package_record(name: str) -> str | None:
    """Return the text of one of the package's records, or None."""
    try:
        return (pkgutil.get_data("viscopade", f"{FOLDER}/{name}") or b"").decode()
    except OSError:
        return None


def _clear() -> None:
    for clear in _cache_clears:
        clear()


@lru_cache(maxsize=1)
def _converter() -> Any:
    """Return the converter between objects and JSON-able data."""
    from cattrs import Converter  # imported here, so that `import viscopade` is fast

    # Numbers as text without rounding: a double in hexadecimal, a fraction as p/q. Fields with their default are left
    # out. `kind` is a type, and each has a function to text and one from text.
    converter = Converter(detailed_validation=False, omit_if_default=True)
    for kind, write, read_text in (
        (float, float.hex, float.fromhex),
        (Fraction, str, Fraction),
        (Decimal, str, Decimal),
        (Fraction | float, str, lambda text: math.inf if text == "inf" else Fraction(text)),
    ):
        converter.register_unstructure_hook(kind, write)
        converter.register_structure_hook(kind, lambda text, _, read_text=read_text: read_text(text))
    # A table has thousands of numbers: its rows are read at once.
    converter.register_structure_hook_func(
        lambda kind: kind == tuple[tuple[float, ...], ...],
        lambda rows, _: tuple([tuple(map(float.fromhex, row)) for row in rows]),
    )
    for named, objects in _named.items():
        converter.register_unstructure_hook(named, attrgetter("name"))
        converter.register_structure_hook(named, partial(_one_of, objects))
    # Named tuples are objects with their fields; cattrs would make lists of them.
    hints = lru_cache(get_type_hints)

    def written(value: Any) -> dict[str, Any]:
        return {name: converter.unstructure(part) for name, part in value._asdict().items()}

    def read(parts: dict[str, Any], kind: Any) -> Any:
        return kind(**{name: converter.structure(parts[name], hint) for name, hint in hints(kind).items()})

    def is_named_tuple(kind: Any) -> bool:
        return hasattr(kind, "_fields")

    converter.register_unstructure_hook_func(is_named_tuple, written)
    converter.register_structure_hook_func(is_named_tuple, read)
    return converter


def _one_of(objects: Mapping[str, Any], name: str, _: Any) -> Any:
    """Return the object of a name; cattrs also passes the type, which is known."""
    return objects[name]


def _file_name(key: list[Any]) -> str:
    """Return the name of a record's file, which is cut and gets a digest if it would be too long."""
    # Readable names, such as name-3-6-double; 8 hexadecimal digits (32 bits) tell long ones with the same beginning
    # apart, and the key in the record tells the rest.
    text = json.dumps(key)
    words = re.sub(r"[^A-Za-z0-9_.]+", "-", text).strip("-")
    digest = hashlib.sha256(text.encode()).hexdigest()[:8]
    return f"{words if len(words) < LONGEST_NAME else f'{words[:LONGEST_NAME]}-{digest}'}.json"


def _text(record: dict[str, Any]) -> str:
    """Return a record as JSON, each innermost list on a line of its own."""
    return _INNERMOST.sub(lambda match: " ".join(match[0].split()), json.dumps(record, indent=1)) + "\n"
