"""Functions that call no function of a math library return the same bits in every version and on every machine.

The hashes are of values within the domain of each function, beyond which all languages return NaN. A
change of the package that alters one bit of a result fails here: a hash may change only where a better kernel takes the
place of a function.
"""

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest

from tests.cli import printed
from tests.kernels.languages import TYPES, WAYS

ROOT = Path(__file__).parents[2]
HASHES = json.loads((ROOT / "tests" / "data" / "same_bits.json").read_text())
COUNT = 10_000

PADE = tuple(f"epsilon_pade_{degrees}" for degrees in ("0_3", "1_4", "2_5", "3_6"))
MINIMAX = tuple(f"epsilon_minimax_v5_{bound}" for bound in ("1em3", "1em5", "1em8"))
FULL = ("epsilon_full", "one_minus_epsilon_full")
EXPORTED = {
    "pade": "viscopade_pade.h",
    "minimax": "viscopade_minimax.h",
    "full": "viscopade_full.h",
    "speed 1em5": "viscopade_speed_1em5.h",
    "speed 1em10": "viscopade_speed_1em10.h",
    "speed full": "viscopade_speed_full.h",
}
FIRST_AND_END = {"1em5": (-96, 32), "5em6": (-96, 32), "1em10": (-96, 32), "full": (-64, 64)}
"""The tables of the speed hold w = beta^5 speed from 2^first to 2^end."""


def functions_of(kind, form):
    """Return the functions with the names that last; [6/9] has no float."""
    if kind.startswith("speed"):
        return tuple(f"{result}_{kind.split()[1]}" for result in ("restitution", "rebound", "dissipation"))
    double = {"pade": PADE, "minimax": MINIMAX, "full": FULL}[kind]
    return double if form == "double" or kind == "pade" else double[:2]


# --- arguments --------------------------------------------------------------------------------------------------------


def whole_numbers(low, above, seed):
    """Return random whole numbers. NumPy promises that the bits of this generator stay the same."""
    raw = np.random.PCG64(seed).random_raw(COUNT)
    return (raw % np.uint64(above - low)).astype(np.int64) + low


def numbers(exponents, form, seed):
    """Return m 2^e for given e, with random 1 <= m < 2; the smallest are subnormal numbers."""
    digits = {"double": 52, "float": 23}[form]
    mantissas = 1 + np.ldexp(whole_numbers(0, 2**digits, seed).astype(float), -digits)
    return np.ldexp(mantissas, exponents).astype(TYPES[form])


def limits(form):
    """Return numbers at the ends of a type, and no numbers."""
    kind = np.finfo(TYPES[form])
    ends = [0, kind.smallest_subnormal, kind.tiny - kind.smallest_subnormal, kind.tiny, 1, kind.max, np.inf]
    return np.array([*ends, *np.negative(ends), np.nan], TYPES[form])


def v_stars(form):
    """Return v*: three quarters from 2^-12 to 2^6, the others of every size, the first ones special."""
    smallest, above = {"double": (-1074, 1024), "float": (-149, 128)}[form]
    exponents = whole_numbers(-12, 6, 1)
    exponents[: COUNT // 4] = whole_numbers(smallest, above, 2)[: COUNT // 4]
    found = numbers(exponents, form, 3)
    found[: len(limits(form))] = limits(form)
    found[100:106] = [0.25, 0.5, 1, 2, 5, 5.000001]  # where intervals end
    return [found]


def speeds_and_betas(form, table):
    """Return speeds, subnormal ones too, and beta with w in a table; the first are 0, infinite, NaN or negative."""
    first, end = FIRST_AND_END[table]
    largest = {"double": 190, "float": 9}[form]
    of_beta = whole_numbers(-largest, largest + 1, 4)
    even = np.arange(COUNT) % 2 == 0  # where beta is a power of two, and w is in any row; else 1 <= w 2^-e < 64
    of_w = np.where(even, whole_numbers(first, end, 5), whole_numbers(first, end - 6, 6))
    beta = np.where(even, np.ldexp(1.0, of_beta), numbers(of_beta, form, 7)).astype(TYPES[form])
    speed = numbers(of_w - 5 * of_beta, form, 8)
    top = np.nextafter(TYPES[form](2.0**end), TYPES[form](0))
    special = [(0, 1), (-0.0, 1), (1, 0), (1, -0.0), (0, 0), (-0.0, -0.0), (top, 1), (2.0**first, 1), (0, 5e-40)]
    special += [(np.inf, 1), (1, np.inf), (np.inf, 0), (0, np.inf), (np.inf, np.inf), (np.nan, 1), (1, np.nan)]
    special += [(-1, 1), (1, -1), (-np.inf, 1), (1, -np.inf), (-1e-40, 1), (1, -1e-40), (-1, -1), (np.nan, 0)]
    speed[: len(special)], beta[: len(special)] = np.array(special, TYPES[form]).T
    return [speed, beta]


def arguments(kind, form):
    return speeds_and_betas(form, kind.split()[1]) if kind.startswith("speed") else v_stars(form)


# --- results ----------------------------------------------------------------------------------------------------------


def digest(column):
    """Return the SHA-256 hash of numbers, little-endian, with one NaN for all."""
    whole = np.where(np.isnan(column), column.dtype.type(np.nan), column)
    return hashlib.sha256(whole.astype(column.dtype.newbyteorder("<")).tobytes()).hexdigest()


def text_of(kind):
    """Return the exported file, or what the command writes."""
    if kind in EXPORTED:
        return (ROOT / "exports" / EXPORTED[kind]).read_text()
    return printed("export", "c", "--from-speed", "5e-6")


CASES = [
    (kind, form)
    for kind in (*EXPORTED, "speed 5em6")
    for form in ("double", "float")
    if (kind, form) != ("full", "float")
]


@pytest.mark.parametrize(("kind", "form"), CASES)
def test_results_have_the_same_bits(tmp_path, kind, form):
    columns = arguments(kind, form)
    calls = dict.fromkeys(functions_of(kind, form), range(len(columns)))
    found = WAYS["C"].program(form, text_of(kind), calls, tmp_path)(*columns)
    assert {function: digest(results) for function, results in found.items()} == HASHES[kind][form]
