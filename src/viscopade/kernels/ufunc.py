"""A function of two numbers with the interface of a NumPy ufunc, for machines without the compiled one.

Broadcasting, casting, `out`, `where`, memory overlap and buffering are those of `numpy.nditer`, on which NumPy's own
ufuncs are modelled. The methods reduce, accumulate and reduceat, which make no sense here, and `at` are missing.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]
ArrayFunction = Callable[[Array, Array], Array]
"""Of two one-dimensional arrays of one type; NaN comes of NaN, or means "invalid value"."""

_WRAP_SCALARS = int(np.__version__.split(".")[0]) >= 2  # __array_wrap__ takes return_scalar
_INVALID = 8  # NumPy's number for it, given to what np.seterrcall set
_FLAGS: Sequence[Any] = ("external_loop", "buffered", "zerosize_ok", "copy_if_overlap")
_PART = 2048  # elements at once: all that belongs to them stays in the cache
_READ = ("readonly", "nbo", "aligned", "overlap_assume_elementwise")
_WRITE = ("writeonly", "nbo", "aligned", "allocate", "no_broadcast", "overlap_assume_elementwise")


class Ufunc:
    """A function of two numbers, `kernel`, on arrays.

    Parameters
    ----------
    name, doc : str
        Its name, and its docstring.
    kernel : callable
        Takes two arrays of one type, float or double, and returns a third.
    """

    nin, nout, nargs, ntypes = 2, 1, 3, 3
    types = ("ii->d", "ff->f", "dd->d")
    identity = None
    signature = None

    def __init__(self, name: str, doc: str, kernel: ArrayFunction) -> None:
        self.__name__ = self.__qualname__ = name
        self.__module__ = __name__.partition(".")[0]  # for pickle
        self.__doc__ = f"{name}(x1, x2, /, out=None, *, {_KEYWORDS})\n\n{doc}"
        self._kernel = kernel

    def __repr__(self) -> str:
        return f"<ufunc {self.__name__!r}, by NumPy>"

    def __reduce__(self) -> str:
        return self.__name__

    def __call__(
        self,
        x1: Any,
        x2: Any,
        /,
        out: Any = None,
        *,
        where: Any = True,
        casting: Any = "same_kind",
        order: Any = "K",
        dtype: npt.DTypeLike | None = None,
        subok: bool = True,
        signature: Any = None,
    ) -> Any:
        """Return the function's values."""
        target = _only(out)
        given = {"where": where, "casting": casting, "order": order, "dtype": dtype, "subok": subok}
        found = self._overridden("__call__", (x1, x2), target, given | {"signature": signature})
        if found is not NotImplemented:
            return found
        kind = self._type(x1, x2, dtype, signature)
        first, second = (np.asarray(x, kind if type(x) in (bool, int, float) else None) for x in (x1, x2))
        result = self._computed([first, second], target, where, kind, casting, order)
        return target if target is not None else self._wrapped(result, (x1, x2), subok)

    def outer(self, first: Any, second: Any, /, **keywords: Any) -> Any:
        """Return the values for all pairs of an element of `first` with one of `second`."""
        found = self._overridden("outer", (first, second), _only(keywords.get("out")), keywords)
        if found is not NotImplemented:
            return found
        first, second = np.asanyarray(first), np.asanyarray(second)
        return self(first.reshape(first.shape + (1,) * second.ndim), second, **keywords)

    def _type(self, x1: Any, x2: Any, dtype: npt.DTypeLike | None, signature: Any) -> np.dtype[Any]:
        """Return the type to compute in, as NumPy does: the first loop in `types` to which both cast safely."""
        if signature is not None:
            if dtype is not None:
                raise TypeError("cannot specify both 'signature' and 'dtype'")
            if signature not in self.types:
                raise TypeError(f"No loop matching the specified signature and casting was found for {self.__name__}")
            return np.dtype(str(signature)[-1])
        if dtype is not None:
            wanted: np.dtype[Any] = np.dtype(dtype)
            if wanted not in (np.float32, np.float64):
                raise TypeError(f"No loop matching the specified signature and casting was found for {self.__name__}")
            return wanted
        try:
            common = np.result_type(*(_plain(x) for x in (x1, x2)))
        except TypeError:  # strings, dates
            common = np.dtype(object)
        if common.kind in "biu":
            return np.dtype(np.float64)
        for form in (np.float32, np.float64):
            if common.kind == "f" and np.can_cast(common, form):
                return np.dtype(form)
        raise TypeError(
            f"ufunc '{self.__name__}' not supported for the input types, and the inputs could not be safely coerced to "
            "any supported types according to the casting rule ''safe''"
        )

    def _computed(
        self, arguments: list[Array], out: Array | None, where: Any, kind: np.dtype[Any], casting: Any, order: Any
    ) -> Array:
        masked = where is not True
        operands: list[Any] = [*arguments, out]
        flags: list[Any] = [_READ, _READ, _WRITE]
        types: list[Any] = [kind] * 3
        if masked:
            mask = np.asarray(where)
            if isinstance(where, np.ndarray) and not np.can_cast(mask.dtype, np.bool_):
                raise TypeError(
                    f"Cannot cast array data from {mask.dtype!r} to dtype('bool') according to the rule 'safe'"
                )
            mask = mask.astype(np.bool_)
            operands.append(mask)
            flags[2] = (*_WRITE, "writemasked") if out is None else ("readwrite", *_WRITE[1:], "writemasked")
            flags.append(("readonly", "arraymask"))
            types.append(np.dtype(np.bool_))
        invalid = False
        with np.nditer(operands, _FLAGS, flags, types, order=order, casting=casting, buffersize=_PART) as iterator:
            if iterator.itersize:
                for x1, x2, y, *masks in iterator:
                    invalid |= self._chunk(x1, x2, y, *masks)
            result: Array = iterator.operands[2]
        if invalid:
            _report(self.__name__)
        return result

    def _chunk(self, x1: Array, x2: Array, out: Array, mask: Array | None = None) -> bool:
        """Compute a part of the result; return whether there is a NaN that does not come of one."""
        if mask is not None:
            x1, x2 = x1[mask], x2[mask]
        with np.errstate(all="ignore"):
            values = self._kernel(x1, x2)
        nan = np.isnan(values)
        invalid = bool(nan.any() and np.any(nan & ~np.isnan(x1) & ~np.isnan(x2)))
        if mask is None:
            out[...] = values
        else:
            out[mask] = values
        return invalid

    def _wrapped(self, result: Array, arguments: tuple[Any, Any], subok: bool) -> Any:
        """Return a scalar for what has no dimension, a subclass (a masked array, …) for such."""
        owners = [x for x in arguments if type(x) is not np.ndarray and not isinstance(x, np.generic)]
        owners = [x for x in owners if hasattr(type(x), "__array_wrap__")]
        if not subok or not owners:
            return result[()]
        owner = max(owners, key=lambda x: getattr(x, "__array_priority__", 0.0))
        context = (self, arguments, 0)
        return owner.__array_wrap__(result, context, *([result.ndim == 0] if _WRAP_SCALARS else []))

    def _overridden(self, method: str, arguments: tuple[Any, Any], out: Any, keywords: Mapping[str, Any]) -> Any:
        """Call the first __array_ufunc__ that answers; NotImplemented if there is none at all."""
        operands = (*arguments, *([] if out is None else [out]))
        owners: list[Any] = []
        for x in operands:
            theirs = getattr(type(x), "__array_ufunc__", np.ndarray.__array_ufunc__)
            if theirs is None:
                raise TypeError(f"operand '{type(x).__name__}' does not support ufuncs (__array_ufunc__=None)")
            if theirs is not np.ndarray.__array_ufunc__ and all(type(x) is not type(y) for y in owners):
                # A subclass is asked before its base, otherwise the left before the right.
                place = next((i for i, y in enumerate(owners) if issubclass(type(x), type(y))), len(owners))
                owners.insert(place, x)
        if not owners:
            return NotImplemented
        passed = {key: value for key, value in keywords.items() if value is not _DEFAULTS.get(key) and key != "out"}
        if out is not None:
            passed["out"] = (out,)
        for owner in owners:
            answer = owner.__array_ufunc__(self, method, *arguments, **passed)
            if answer is not NotImplemented:
                return answer
        types = ", ".join(repr(type(x).__name__) for x in operands)
        raise TypeError(
            f"operand type(s) all returned NotImplemented from __array_ufunc__({self!r}, {method!r}): {types}"
        )


_DEFAULTS = {"where": True, "casting": "same_kind", "order": "K", "dtype": None, "subok": True, "signature": None}
_KEYWORDS = ", ".join(f"{name}={value!r}" for name, value in _DEFAULTS.items())


def _only(out: Any) -> Array | None:
    """Return the array to write to: `out` may be that, or a tuple with it, or None."""
    if isinstance(out, tuple):
        if len(out) != 1:
            raise ValueError("The 'out' tuple must have exactly one entry per ufunc output")
        (out,) = out
    if out is not None and not isinstance(out, np.ndarray) and not hasattr(type(out), "__array_ufunc__"):
        raise TypeError("return arrays must be of ArrayType")
    return out  # type: ignore[no-any-return]


def _plain(x: Any) -> Any:
    """Return what stands for an argument's type: Python's numbers themselves, which adapt to the other argument."""
    if type(x) is int:
        return 0  # however large
    return x if type(x) in (bool, float) else np.asarray(x)


def _report(name: str) -> None:
    """Say "invalid value" in the way that np.errstate asks for."""
    message = f"invalid value encountered in {name}"
    how: Literal["ignore", "warn", "raise", "call", "print", "log"] = np.geterr()["invalid"]
    if how == "warn":
        warnings.warn(message, RuntimeWarning, stacklevel=4)
    elif how == "raise":
        raise FloatingPointError(message)
    elif how == "print":
        print(f"Warning: {message}", file=sys.stderr)
    elif how == "call":
        np.geterrcall()("invalid value", _INVALID)  # type: ignore[operator,misc]
    elif how == "log":
        np.geterrcall().write(f"Warning: {message}\n")  # type: ignore[union-attr]
