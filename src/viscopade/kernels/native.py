"""`restitution(speed, beta)` on NumPy arrays: the exported kernel, compiled, or its program evaluated by NumPy.

The extension `_native` is built at installation if there is a C compiler. Results do not depend on it, to the last bit.
The environment variable VISCOPADE_BACKEND, read once, asks for one of the two.
"""

from __future__ import annotations

from os import environ
from typing import Any

import numpy as np

from viscopade.kernels.ufunc import Array, Ufunc

BACKENDS = ("compiled", "numpy")
VARIABLE = "VISCOPADE_BACKEND"

DOC = """The coefficient of restitution eps at a speed, in double precision or, for float32, in single precision.

A NumPy ufunc: arguments are numbers, lists or arrays of any shapes that broadcast, and `out`, `where`, `dtype` and the
other keywords are those of all ufuncs. It runs the kernel `lookup_full` of exports/viscopade_speed_full.h.

Parameters
----------
x1 : array_like
    speed, the normal component of the impact velocity, >= 0; may be infinite.
x2 : array_like
    beta = 3/2 A (rho/m_eff)^(2/5), >= 0, in (time/length)^(1/5), in the units of speed (eq:betadef; `Pair.beta`).

Returns
-------
float or array
    eps, from 1 at rest to 0: float32 for float32 and float16, float64 for float64 and for integers of any size.
    1 where speed or beta is 0, 0 where one is infinite. NaN where one is negative, and where one is 0 and the other
    infinite, which is reported as "invalid value" (`numpy.errstate`), as the root of -1 is; NaN where one is NaN.
    No other floating-point error is reported.

Raises
------
TypeError
    If an argument is not made of real numbers of at most double precision.

See Also
--------
epsilon : The same of v* = beta^(1/2) speed^(1/10), within 1 ulp, refusing negative numbers.

Examples
--------
>>> import viscopade as vp
>>> vp.restitution([0, 0.1, 1.0], 1.307).round(12).tolist()
[1.0, 0.450746849797, 0.317892978311]
"""


def numpy_restitution() -> Ufunc:
    """Return the `restitution` that NumPy computes."""
    return Ufunc("restitution", DOC, _by_numpy)


def _by_numpy(speed: Array, beta: Array) -> Array:
    """Return eps of two arrays of one type; float is computed in double and rounded."""
    from viscopade.kernels.forms.speed_table_last_place import restitution  # loads FLINT

    result: Array = restitution(speed.astype(np.float64, copy=False), beta.astype(np.float64, copy=False))
    return result.astype(speed.dtype, copy=False)


def compiled_restitution(instructions: str | None = None) -> np.ufunc:
    """Return the compiled `restitution`, with the named instructions or the best ones of this processor.

    Raises
    ------
    ImportError
        If the extension was not built.
    ValueError
        If the processor does not have these instructions.
    """
    from viscopade.kernels import _native

    return _native.ufunc(instructions or _native.instruction_sets()[-1], DOC)


def chosen_backend(wanted: str | None) -> tuple[str, Any]:
    """Return the name of a backend, and its `restitution`.

    Parameters
    ----------
    wanted : str, optional
        "compiled" or "numpy"; by default (and if empty) the compiled one if there is one.

    Raises
    ------
    ValueError
        If there is no such backend.
    ImportError
        If the compiled one is asked for and was not built.
    """
    if wanted not in (*BACKENDS, "", None):
        raise ValueError(f"{VARIABLE} is {wanted!r}: accepted is {' or '.join(BACKENDS)}")
    if wanted == "numpy":
        return "numpy", numpy_restitution()
    try:
        return "compiled", compiled_restitution()
    except ImportError as error:
        if wanted:
            raise ImportError(
                f"{VARIABLE} is {wanted!r}, but the extension could not be loaded ({error}): was there a C compiler "
                "when viscopade was installed? Accepted is numpy, too"
            ) from error
    return "numpy", numpy_restitution()


_BACKEND, restitution = chosen_backend(environ.get(VARIABLE))


def backend() -> str:
    """Return the backend of `restitution`: "compiled" or "numpy"."""
    return _BACKEND
