"""eps and 1 - eps at many v* at a time, in long double: a reference for compiled code.

The polynomials are the rows of `double`'s table, whose relative error is proven (`panel_proof.proven_error`), below
2^-59. Long double must have 64 bits, as on x86 and, with more of them, on aarch64: `enough` tells.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from viscopade.arrays import panels
from viscopade.collision import panel_proof


def enough():
    """Whether long double has as many bits as are needed."""
    return bool(np.finfo(np.longdouble).nmant >= 63)


def values(name, v_star):
    """Return "epsilon" or "one_minus_epsilon": on panels, and beyond them by eps(8 v*) = 2^-10 eps(v*)."""
    exponent = np.frexp(v_star)[1] - 1
    folds = np.maximum((exponent - panels.FOLD) // 3, 0)
    folded = np.ldexp(v_star, -3 * folds)
    octave = np.maximum(exponent - 3 * folds - panels.FIRST, 0)
    part = np.ldexp(folded, panels.SPLIT - panels.FIRST - octave).astype(np.int64) - (1 << panels.SPLIT)
    panel = np.where(exponent < panels.FIRST, 0, 1 + (octave << panels.SPLIT) + part)
    z = (folded - panels.CENTRES[panel]) / panels.HALF_WIDTHS[panel]
    rows = _rows(name)
    total = rows[-1][panel]
    for row in rows[-2::-1]:
        total = total * z + row[panel]
    return np.ldexp(total, -10 * folds) if name == "epsilon" else np.where(folds > 0, np.longdouble(1), total)


@lru_cache(maxsize=2)
def _rows(name):
    """Return the coefficients of all panels, the power first."""
    rows = [panel_proof.panel_rows()[name, panel] for panel in range(panels.PANELS)]
    return np.array([[np.ldexp(np.longdouble(str(c)), row.exponent) for c in row.a] for row in rows]).T
