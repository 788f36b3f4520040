"""The headers "from speed to eps" for the tests: their text, what they state, compiled functions, and the truth."""

from __future__ import annotations

import ctypes
import os
import re
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
from viscopade.kernels import prove_lacunary
from viscopade.kernels.forms import speed_kernel
from viscopade.kernels.targets import speed

EXPORTS = Path(__file__).parents[2] / "exports"
FORMS = {"double": np.float64, "float": np.float32}
SUFFIXES = {"double": "", "float": "f"}
FUNCTIONS = tuple(function for function, _ in speed.FUNCTIONS)

_serial = count()


# --- a header ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Header:
    """The text of a header, and what it states about errors: the tests hold it to its own words."""

    text: str

    @cached_property
    def name(self):
        return self._word(r"viscopade_restitution_array_(\w+)\(")

    @cached_property
    def head(self):
        lines = self.text.split("*/")[0].splitlines()
        return " ".join(line.removeprefix(" *").strip() for line in lines)

    @property
    def full(self):
        return self.name == "full"

    @cached_property
    def native(self):
        """The types in which the table's sums are computed; the other is converted."""
        return [form for form, s in SUFFIXES.items() if f"viscopade_block_{self.name}{s}(" in self.text]

    @property
    def block(self):
        return int(self._word(r"\* (\d+) speeds at a time"))

    def number(self, pattern, where=None):
        """Return the number that the head states in a sentence of this pattern."""
        return float(self._word(pattern, self.head if where is None else where))

    def _word(self, pattern, where=None):
        found = re.search(pattern, self.text if where is None else where)
        assert found, f"the header has no text like {pattern}"
        return found[1]

    @cached_property
    def first(self):
        """The table begins at w = 2^first, and ends at 2^end."""
        return int(self._word(r"for each e from (-\d+) to", self.head))

    @cached_property
    def end(self):
        return int(self._word(r"for each e from -\d+ to (\d+)", self.head)) + 1

    @cached_property
    def split(self):
        """There are 2^split rows to an octave."""
        return int(self._word(r"(\d+) rows of coefficients", self.head)).bit_length() - 1


@cache
def header(tier):
    """Return a header as it lies in exports/, made anew only if it does not."""
    path = EXPORTS / speed_kernel.file_of(tier)
    if path.exists():
        return Header(path.read_text(encoding="utf-8"))
    return Header(speed.render(prove_lacunary.speed_kernel(tier), f"viscopade export c --from-speed {tier}"))


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
    """eps and 1 - eps in long double, from the table of `viscopade.arrays.double`, and the bounds that a header states.

    w = beta^5 speed is not rounded to double, and the polynomials are those of double.txt: nothing here comes from
    `viscopade.kernels.forms.speed_table`. Relative errors are below 2^-56 (x86's long double).
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
        """Return the largest error that the header allows to a function, in the units of the result.

        `more` units in the last place are added; `flushed` says that subnormal numbers are set to 0.
        """
        table = self.in_table(given, form)
        relative, absolute = (
            _full_bounds(self, function, table) if given.full else relative_bounds(self, given, form, table)
        )
        true = self.of(function)
        kind = FORMS[form] if form in given.native else float
        if function == "restitution":
            found = relative * self.smaller + absolute
            if not given.full:
                found = found + spacing(true, kind) / 2
        else:
            share = np.where(self.eps > 0, absolute / np.where(self.eps > 0, self.eps, 1), 0)
            found = (relative + share) * true + (0 if given.full else 3 * spacing(true, kind))
        least = [2.0 * np.finfo(FORMS[form]).tiny, 2.0 * np.finfo(float).tiny] if flushed else [0.0, 2.0**-1074]
        lost = least[0] + _underflow(given, function) * np.longdouble(least[1])
        found = found + lost * (1 + (self.speed if function == "rebound" else 0)) + 2.0**-57 * true
        if kind is not FORMS[form]:
            found = found + spacing(true, FORMS[form]) / 2 * (1 + 2.0**-20)
        elif kind is np.float32:  # outside the table the result comes from type double
            found = found + np.where(table, 0, spacing(true, kind) / 2)
        return found + more * spacing(true, FORMS[form])


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


def _underflow(given, function):
    """What underflow adds beyond the table, in numbers of the smallest size."""
    if function == "dissipation":
        return given.number(r"and so off by up to (\S+) of the smallest numbers")
    return _slow(given)[2] if "underflow: adds" in given.text else 0.5


def _slow(given):
    """Return what rounding adds to eps and 1 - eps in the kernel for w beyond the table, and what underflow does."""
    code = " ".join(line.strip().removeprefix("* ") for line in given.text.splitlines()[:200])
    return (
        given.number(r"rounding of epsilon: adds at most (\S+) eps in type double", code),
        given.number(r"rounding of one_minus_epsilon: adds at most (\S+) \(1 - eps\) in type double", code),
        given.number(r"underflow: adds at most (\d+) of", code),
    )


def relative_bounds(truth, given, form, table):
    """Return the relative error of the smaller of eps and 1 - eps, and what is absolute."""
    proven = given.number(r"<= (\S+) in the table")
    kind = form if form in given.native else "double"
    rounding = given.number(rf"rounding of restitution:.*?(\S+) min\(eps, 1 - eps\) in type {kind}")
    of_v_star = _beyond(truth, given, r"rounding of restitution:.*?elsewhere", re.escape("min(eps, 1 - eps)"))
    if "viscopade_full.h elsewhere" in given.head:
        return np.where(table, proven + rounding, of_v_star), np.where(table, 0, 0.6 * 2.0**-52 * truth.eps)
    elsewhere = given.number(r"in the table, (\S+) elsewhere")
    of_eps, of_loss, _ = _slow(given)
    relative = np.where(table, proven + rounding, elsewhere + of_v_star)
    return relative, np.where(table, 0, (of_eps + of_loss) * truth.eps)


def _beyond(truth, given, start, unit):
    """Return what the header states for each speed where w is not in the table."""
    found = given.number(rf"{start} (\S+) {unit} for 1e-30 <= speed <= 1e30")
    every = given.number(rf"{start}.*? and (\S+) {unit} for every other speed")
    return np.where((truth.speed >= 1e-30) & (truth.speed <= 1e30), found, every)


def _full_bounds(truth, function, table):
    given = header("full")
    outside = _beyond(truth, given, "elsewhere: at most", "ulp(?: in all)?")
    if function == "restitution":
        of_w = given.number(r"rounding of w.{0,40}? (?:is|adds) at most (\S+) ulp")
        inside = given.number(r"off by at most (\S+) units") + of_w
        return 0, np.where(table, inside, outside) * spacing(truth.eps, float)
    own = given.number(r"dissipation and rebound: relative errors of at most (\S+) in the table")
    of_w = given.number(r"dissipation and rebound:.*? rounding of w.{0,40}? at most (\d\S*\d)")
    return np.where(table, own + of_w, outside * 2.0**-52), 0
