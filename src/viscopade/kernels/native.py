"""`restitution(speed, beta)` on NumPy arrays: the exported kernel, compiled, or its program evaluated by NumPy.

Both have the same bits; `viscopade.compiled` chooses. Before either of the two, `restitution` takes units and masks
away, as the other functions of arrays do.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from viscopade.arguments import refusal, without_unit
from viscopade.arrays import checked
from viscopade.arrays.checked import Accepted
from viscopade.compiled import extension
from viscopade.kernels import machine

Array = npt.NDArray[Any]

_NUMBERS = Accepted("a number that double precision can hold", np.isfinite)
_LARGE = 1 << 1000
"""Python's integers below it surely have a double; the largest double is below 2^1024."""
_INVALID = "invalid value encountered in restitution"
_FLAGS: Sequence[Any] = ("external_loop", "buffered", "zerosize_ok", "copy_if_overlap")
_PART = 2048
"""Elements that NumPy computes at once. From 2,048 to 16,384 one takes 210 to 90 ns; 1,024 or fewer cost more for the
calls, and from 65,536 on, four times as slow, what belongs to them leaves the cache (measured)."""
_READ = ("readonly", "nbo", "aligned", "overlap_assume_elementwise")
_WRITE = ("nbo", "aligned", "allocate", "no_broadcast", "overlap_assume_elementwise")

DOC = """The coefficient of restitution eps at a speed, in double precision or, for float32, in single precision.

Arguments are numbers, lists or arrays of any shapes that broadcast; `out`, `where` and `dtype` are those of NumPy's
ufuncs. Compiled, a ufunc computes; without a C compiler, NumPy does, with the same bits. Both run the functions of
exports/viscopade_speed_full.h.

Parameters
----------
x1 : array_like
    speed, the normal component of the impact velocity, >= 0; may be infinite.
x2 : array_like
    beta = 3/2 A (rho/m_eff)^(2/5), >= 0, in (time/length)^(1/5), in units of speed (the paper's Eq. 8; `Pair.beta`).

Returns
-------
float or array
    eps, from 1 at rest to 0: float32 for float32 and float16, float64 for float64 and for integers of any type.
    1 where speed or beta is 0, 0 where one is infinite. NaN where one is negative, and where one is 0 and the other
    infinite, which is reported as "invalid value" (`numpy.errstate`), as the root of -1 is; NaN where one is NaN.
    No other floating-point error is reported. A masked array stays masked: what it hides is not looked at.

Raises
------
TypeError
    If an argument is not made of real numbers of at most double precision (a bool is not one), or has a unit of another
    dimension.
ValueError
    If an integer is too large for double precision.

See Also
--------
epsilon : The same of v* = beta^(1/2) speed^(1/10), within 1 ulp, refusing negative numbers.

Examples
--------
>>> import viscopade as vp
>>> vp.restitution([0, 0.1, 1.0], 1.307).round(12).tolist()
[1.0, 0.450746849797, 0.317892978311]
"""


def numpy_restitution(
    x1: Any, x2: Any, /, out: Array | None = None, *, where: Any = True, dtype: npt.DTypeLike | None = None
) -> Any:
    """Return what the compiled `restitution` does, by NumPy: with its broadcasting, types and overlaps.

    x1 is the speed, x2 beta; `out`, `where` and `dtype` are those of NumPy's ufuncs.
    """
    kind = _computed_type(x1, x2, dtype)
    speeds, betas = (np.asarray(x, kind if type(x) in (bool, int, float) else None) for x in (x1, x2))

    # The iterator broadcasts, converts in pieces, and copies where `out` overlaps an argument, as ufuncs do. Its
    # operands are the speed, beta and the result, which are all of one type, and the mask if there is one.
    operands: list[Any] = [speeds, betas, out]
    flags: list[Any] = [_READ, _READ, ("writeonly", *_WRITE)]
    types: list[Any] = [kind, kind, kind]
    if where is not True:
        operands.append(np.asarray(where))
        flags[2] = ("writeonly" if out is None else "readwrite", *_WRITE, "writemasked")
        flags.append(("readonly", "arraymask"))
        types.append(np.dtype(np.bool_))

    # Where a result is NaN and no argument is, the operation is invalid, which is reported once, at the end.
    invalid = False
    with np.nditer(operands, _FLAGS, flags, types, casting="same_kind", buffersize=_PART) as iterator:
        if iterator.itersize:
            for speed, beta, epsilon, *masks in iterator:
                chosen = masks[0] if masks else ...
                v, b = speed[chosen], beta[chosen]
                with np.errstate(all="ignore"):
                    values = _by_numpy(v, b)
                invalid |= bool((np.isnan(values) & ~np.isnan(v) & ~np.isnan(b)).any())
                epsilon[chosen] = values
        result: Array = iterator.operands[2]

    # As `numpy.errstate` asks for it; its other choices report nothing here.
    if invalid and np.geterr()["invalid"] == "raise":
        raise FloatingPointError(_INVALID)
    if invalid and np.geterr()["invalid"] == "warn":
        warnings.warn(_INVALID, RuntimeWarning, stacklevel=2)  # at the caller's line
    if out is not None:
        return out
    return result[()]  # a scalar for scalars


numpy_restitution.__doc__ = DOC


def _computed_type(x1: Any, x2: Any, dtype: npt.DTypeLike | None) -> np.dtype[Any]:
    """Return the type to compute in, as NumPy does: float or double, to which both arguments cast safely.

    x1 and x2 are the arguments, and `dtype` is the one asked for, or None.
    """
    if dtype is not None:
        if np.dtype(dtype) not in (np.float32, np.float64):
            raise TypeError("No loop matching the specified signature and casting was found for restitution")
        return np.dtype(dtype)
    # Python's numbers adapt to the other argument, and an integer may be as large as it likes.
    plain = (0 if type(x) is int else x if type(x) in (bool, float) else np.asarray(x) for x in (x1, x2))
    try:
        common = np.result_type(*plain)
    except TypeError:  # strings, dates
        common = np.dtype(object)
    # Kinds of NumPy: bool (b), integers (i), unsigned ones (u), floats (f). The first type that holds all is taken.
    if common.kind in "biu":
        return np.dtype(np.float64)
    for form in (np.float32, np.float64):
        if common.kind == "f" and np.can_cast(common, form):
            return np.dtype(form)
    raise TypeError("ufunc 'restitution' not supported for the input types: expected real numbers, at most doubles")


def _by_numpy(speed: Array, beta: Array) -> Array:
    """Return eps of two arrays of one type; float is computed in double and rounded."""
    from viscopade.kernels.speed_table import speed_table  # loads FLINT

    speed, beta, form = speed.astype(np.float64), beta.astype(np.float64), speed.dtype
    return np.asarray(machine.function_values(speed_table("full"), "restitution", speed, beta)).astype(form, copy=False)


def compiled_restitution(instructions: str | None = None) -> np.ufunc:
    """Return the compiled `restitution`, with the named instructions or the best ones of this processor.

    Raises
    ------
    ValueError
        If the processor does not have these instructions.
    """
    # The extension lists what this processor has, the best last.
    ufunc: np.ufunc = extension.ufunc(instructions or extension.instruction_sets()[-1], DOC)
    return ufunc


_kernel: Any = numpy_restitution if extension is None else compiled_restitution()


def restitution(
    x1: Any, x2: Any, /, out: Array | None = None, *, where: Any = True, dtype: npt.DTypeLike | None = None
) -> Any:
    """Return eps at the speeds x1 for the beta x2: what the kernel makes of them without their units and masks.

    `out`, `where` and `dtype` are those of NumPy's ufuncs.
    """
    # All that follows takes ten times as long as one number (measured).
    if out is None and where is True and dtype is None and _is_plain(x1) and _is_plain(x2):
        return _kernel(x1, x2)

    # Units go first. An integer that no double holds is refused here: NumPy would compute with objects.
    unitless = [without_unit("speed", x1), without_unit("beta", x2)]
    for name, value in zip(("speed", "beta"), unitless, strict=True):
        if type(value) is int:
            checked.number(name, value, _NUMBERS)

    # A container (pandas, xarray, Dask) applies this function to its arrays itself, and returns a container.
    choices = (("out", out, None), ("where", where, True), ("dtype", dtype, None))
    keywords = {name: value for name, value, default in choices if value is not default}
    contained = checked.by_container(restitution, unitless, **keywords)
    if contained is not NotImplemented:
        return contained

    # `hidden`: the mask of both in their common shape, or None.
    values, hidden = checked.unmasked(unitless)
    for name, value in zip(("speed", "beta"), values, strict=True):
        if np.asarray(value).dtype.kind == "b":  # True and False are no speeds
            raise TypeError(refusal(name, value, f"{_NUMBERS.words}, or an array of such numbers"))
    if hidden is None:
        return _kernel(*values, **keywords)

    # What a mask hides is replaced by 1, which is in the domain, or is not computed: it must report no error.
    if out is None:
        # Python's numbers adapt to the other argument's type: they stay what they are.
        values = [value if type(value) in (int, float) else np.where(hidden, 1, value) for value in values]
        result = _kernel(*values, **keywords)
        return np.ma.array(result, mask=hidden)[()]
    _kernel(*values, **keywords | {"out": np.ma.getdata(out), "where": np.logical_and(where, ~hidden)})
    if isinstance(out, np.ma.MaskedArray):
        out.mask = np.broadcast_to(hidden, out.shape)
    return out


def _is_plain(value: Any) -> bool:
    """Return whether a value surely has neither a unit nor a mask, and is no integer too large for a double."""
    kind = type(value)
    if kind is np.ndarray:
        return bool(value.dtype.kind == "f")
    return kind is float or kind is np.float64 or (kind is int and abs(value) < _LARGE)


restitution.__doc__ = DOC
vars(restitution).update(nin=2, nout=1, signature=None)  # what a container asks a ufunc for
