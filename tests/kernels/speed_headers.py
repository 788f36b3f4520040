"""The headers "from speed to eps" for the tests: their text, what they state, compiled functions, and the truth."""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import count
from pathlib import Path

import numpy as np
import pytest

from tests.compiled import WARNINGS, compiler
from tests.kernels import long_double
from viscopade.kernels import speed_table

EXPORTS = Path(__file__).parents[2] / "exports"
FORMS = {"double": np.float64, "float": np.float32}
SUFFIXES = {"double": "", "float": "f"}
FUNCTIONS = tuple(speed_table.MEANINGS)

_serial = count()


# --- a header ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Header:
    """The text of a header, its kernel and its table."""

    text: str
    tier: str

    @property
    def kernel(self):
        return speed_table.speed_table(self.tier)

    @property
    def layout(self):
        return speed_table.TABLES[self.tier, "fast"]

    @property
    def name(self):
        return self.kernel.name

    @property
    def native(self):
        """The types in which the table's sums are computed; the other is converted."""
        return [form.name for form in speed_table.forms_of(self.layout)]

    @property
    def first(self):
        """The table begins at w = 2^first, and ends at 2^end."""
        return self.layout.first

    @property
    def end(self):
        return self.layout.first + speed_table.OCTAVES

    @property
    def split(self):
        return self.layout.split


@cache
def header(tier):
    """Return a header as it lies in exports/."""
    return Header((EXPORTS / f"viscopade_speed_{tier.replace('-', 'm')}.h").read_text(encoding="utf-8"), tier)


# --- compiled functions -----------------------------------------------------------------------------------------------

_INTERFACE = """
#define INTERFACE_OF(FUNCTION, NAME, T, S) \\
    void single_##FUNCTION##_##NAME##S(size_t n, const T *speed, const T *beta, T *out); \\
    void single_##FUNCTION##_##NAME##S(size_t n, const T *speed, const T *beta, T *out) \\
    { \\
        size_t i; \\
        for (i = 0; i < n; ++i) { \\
            out[i] = viscopade_##FUNCTION##_##NAME##S(speed[i], beta[i]); \\
        } \\
    } \\
    void array_##FUNCTION##_##NAME##S(size_t n, const T *speed, T beta, T *out); \\
    void array_##FUNCTION##_##NAME##S(size_t n, const T *speed, T beta, T *out) \\
    { \\
        viscopade_##FUNCTION##_array_##NAME##S(n, speed, beta, out); \\
    } \\
    void by_pair_##FUNCTION##_##NAME##S(size_t n, const T *speed, const int *pair, const T *beta, T *out); \\
    void by_pair_##FUNCTION##_##NAME##S(size_t n, const T *speed, const int *pair, const T *beta, T *out) \\
    { \\
        viscopade_##FUNCTION##_by_pair_##NAME##S(n, speed, pair, beta, out); \\
    } \\
    void each_##FUNCTION##_##NAME##S(size_t n, const T *speed, const T *beta, T *out); \\
    void each_##FUNCTION##_##NAME##S(size_t n, const T *speed, const T *beta, T *out) \\
    { \\
        viscopade_##FUNCTION##_each_##NAME##S(n, speed, beta, out); \\
    }
#ifdef __cplusplus
extern "C" {
#endif
"""

# Lets the tests set subnormal numbers to 0 while a function runs: flush-to-zero and denormals-are-zero of x86.
_CONTROL = """
#if defined(__x86_64__)
unsigned control(unsigned value);
unsigned control(unsigned value)
{
    unsigned before;

    __asm__ volatile("stmxcsr %0" : "=m"(before));
    __asm__ volatile("ldmxcsr %0" : : "m"(value));
    return before;
}
#endif
"""


def interface(headers):
    """Return C text that makes all functions of these headers visible to the linker."""
    names = [(function, h.name, form, s) for h in headers for function in FUNCTIONS for form, s in SUFFIXES.items()]
    lines = [f"INTERFACE_OF({', '.join(name)})" for name in names]
    return "\n".join([_INTERFACE, *lines, _CONTROL, "#ifdef __cplusplus", "}", "#endif", ""])


def named_compiler(name, standard, flags=()):
    """Return the command of the usual compiler, "cc", or of "clang", with flags, or skip the test."""
    command = compiler(standard)
    if name == "clang":
        clang = shutil.which("clang++" if "++" in standard else "clang")
        if clang is None:
            pytest.skip("there is no clang")
        command = [clang, *command[1:]]
    if not _works([*command, *flags]):
        pytest.skip(f"{name} does not know {' '.join(flags) or standard}")
    return [*command, *flags]


def _works(command):
    probe = subprocess.run([*command, "-fsyntax-only", "-"], input="", text=True, capture_output=True)
    return probe.returncode == 0


class Functions:
    """All functions of some headers, compiled; they take and return arrays."""

    def __init__(self, directory, headers, command, warnings=WARNINGS):
        here = directory / f"speed{next(_serial)}"
        here.mkdir()
        self.names = {}
        for i, given in enumerate(headers):
            (here / f"header{i}.h").write_text(given.text, encoding="utf-8")
        includes = "".join(f'#include "header{i}.h"\n' for i in range(len(headers)))
        source, target = here / "interface.src", here / "interface.so"
        source.write_text(includes + interface(headers))
        built = target.with_suffix(".o")
        subprocess.run([*command, *warnings, "-fPIC", "-c", str(source), "-o", str(built)], check=True)
        # Linked without -ffast-math, which would set subnormal numbers to 0 in this process.
        subprocess.run([command[0], "-shared", str(built), "-o", str(target), "-lm"], check=True)
        self.shared = ctypes.CDLL(str(target))

    def __call__(self, kind, function, of, values, beta, pair=None, out=None):
        """Call a function; `values` has the type, `beta` is an array, for kind "array" one number.

        `pair` are indices of `beta` for kind "by_pair".
        """
        kind_of = values.dtype.type
        suffix = next(SUFFIXES[form] for form, it in FORMS.items() if it is kind_of)
        result = np.empty_like(values) if out is None else out
        if kind == "array":
            scalar = ctypes.c_float if suffix else ctypes.c_double
            given = [scalar(float(beta))]
        else:
            assert beta.dtype == values.dtype
            given = [_pointer(beta)]
        if kind == "by_pair":
            assert pair.dtype == np.intc
            given = [_pointer(pair), *given]
        entry = self.shared[f"{kind}_{function}_{of.name}{suffix}"]
        entry.restype = None
        entry(ctypes.c_size_t(values.size), _pointer(values), *given, _pointer(result))
        return result

    def flushed(self):
        """Set subnormal numbers to 0 in this thread; return a function that undoes it."""
        if "control" not in dir(self.shared) and not hasattr(self.shared, "control"):
            pytest.skip("there is no such control of this processor here")
        before = self.shared.control(0x1F80 | 0x8040)
        return lambda: self.shared.control(before)


def _pointer(array):
    assert array.flags.c_contiguous
    return ctypes.c_void_p(array.ctypes.data)


def machine_flags():
    """Return -march=native, or nothing where the compiler does not know it."""
    command = shutil.which(os.environ.get("CC", "cc"))
    return ["-march=native"] if command and _works([command, "-xc", "-march=native"]) else []


# --- the truth --------------------------------------------------------------------------------------------------------


class Truth:
    """eps and 1 - eps in long double, from the table of `viscopade.arrays.double`, and what a kernel's bounds allow.

    w = beta^5 speed is not rounded to double, and the polynomials are those of double.txt: nothing here comes from
    `viscopade.kernels.speed_table`. Relative errors are below 2^-56 (x86's long double).
    """

    def __init__(self, values, beta):
        if not long_double.enough():
            pytest.skip("long double is too short here for a reference")
        self.speed, self.beta = (np.asarray(x).astype(np.longdouble) for x in np.broadcast_arrays(values, beta))
        self.w = self.beta**2 * self.beta**2 * self.beta * self.speed
        v_star = self.w ** (np.longdouble(1) / 10)
        self.v_star = v_star.astype(float)
        eps, loss = (long_double.values(name, v_star) for name in ("epsilon", "one_minus_epsilon"))
        far = loss > 0.5
        self.eps, self.loss = np.where(far, eps, 1 - loss), np.where(far, 1 - eps, loss)

    @cached_property
    def smaller(self):
        return np.minimum(self.eps, self.loss)

    def of(self, function):
        if function == "restitution":
            return self.eps
        return self.eps * self.speed if function == "rebound" else self.loss * (1 + self.eps)

    def in_table(self, given, form):
        return in_table(given, form, self.speed, self.beta)

    def bound(self, function, given, form, more=0, flushed=False):
        """Return the largest error that the kernel's bounds allow to a function, in the units of the result.

        `more` units in the last place are added; `flushed` says that subnormal numbers are set to 0.
        """
        true, factor = self.of(function), self.speed if function == "rebound" else np.longdouble(1)
        least = np.full(true.shape, np.inf, np.longdouble)
        for bound in given.kernel.bound(function, "host", form):
            low, high = float(bound.low), float(bound.high)
            holds = (self.v_star >= low * (1 + 1e-12)) & (self.v_star <= high * (1 - 1e-12))
            if bound.speeds is not None:
                holds &= (self.speed >= number(bound.speeds[0])) & (self.speed <= number(bound.speeds[1]))
            reference = true if bound.relative_to == "value" else self.smaller * factor
            sizes = number(bound.relative) * reference + number(bound.last) * true
            sizes += number(bound.absolute) * np.longdouble(np.finfo(FORMS[form]).smallest_subnormal) * (1 + factor)
            sizes += number(bound.ulps) * spacing(true + sizes, FORMS[form])
            least = np.where(holds, np.minimum(least, sizes), least)
        # Subnormal products and results count as 0, in type double those beyond the table, too.
        lost = [2.0 * np.finfo(FORMS[form]).tiny, 2.0 * np.finfo(float).tiny] if flushed else [0.0, 0.0]
        tiny = max(float(bound.absolute) for bound in given.kernel.bounds)
        lost = (lost[0] + (1 + tiny) * np.longdouble(lost[1])) * (1 + factor)
        return least + lost + 2.0**-57 * true + more * spacing(true, FORMS[form])


def number(fraction):
    """Return a fraction in long double."""
    return np.longdouble(fraction.numerator) / np.longdouble(fraction.denominator)


def spacing(numbers, kind):
    """Return the unit in the last place of numbers in a type."""
    largest = np.finfo(kind).max
    with np.errstate(all="ignore"):
        rounded = np.minimum(numbers, largest).astype(kind)
        down = np.where(rounded > numbers, np.nextafter(rounded, kind(0)), rounded)
    return np.spacing(np.minimum(down, np.nextafter(largest, kind(0)))).astype(np.longdouble)


def in_table(given, form, values, beta):
    """Whether the header's table serves these inputs."""
    kind = FORMS[form] if form in given.native else float
    values, beta = np.asarray(values).astype(kind), np.asarray(beta).astype(kind)
    with np.errstate(all="ignore"):
        b2 = beta * beta
        scale = b2 * b2 * beta
        w = scale * values
    return (w >= 2.0**given.first) & (w < 2.0**given.end) & (scale >= np.finfo(kind).tiny)
