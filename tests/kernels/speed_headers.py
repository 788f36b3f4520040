"""The headers "from speed to eps" for the tests: their text, what they state, compiled functions, and the truth."""

from __future__ import annotations

import ctypes
import subprocess
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import count, product
from pathlib import Path

import numpy as np
import pytest

from tests.compiled import WARNINGS
from tests.kernels import long_double
from viscopade.kernels import formulas, speed_table

EXPORTS = Path(__file__).parents[2] / "exports"
FORMS = {"double": np.float64, "float": np.float32}
SUFFIXES = {"double": "", "float": "f"}
FUNCTIONS = tuple(speed_table.MEANINGS)

_serial = count()


# --- a header ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Header:
    """The text of a header, and which kernel it is said to have."""

    text: str
    tier: str

    def __post_init__(self):
        """Find the kernel and its table, which begins at w = 2^first and ends at 2^end."""
        kernel, layout = speed_table.speed_table(self.tier), speed_table.TABLES[self.tier]
        native = [form.name for form in speed_table.forms_of(layout)]  # other types are converted to this one
        given = {"kernel": kernel, "layout": layout, "name": kernel.name, "native": native, "first": layout.first}
        self.__dict__.update(given, end=layout.first + formulas.OCTAVES, split=layout.split)


@cache
def header(tier):
    """Return a header as it lies in exports/."""
    return Header((EXPORTS / f"viscopade_speed_{tier.replace('-', 'm')}.h").read_text(encoding="utf-8"), tier)


# --- compiled functions -----------------------------------------------------------------------------------------------

ARRAYS = {"array": ("T beta", "beta"), "by_pair": ("const int *pair, const T *beta", "pair, beta"),
          "each": ("const T *beta", "beta")}  # fmt: skip
"""Kinds of array functions: parameters and arguments."""


def interface(given):
    """Return C text that makes the array functions visible to the linker, as kind_function_type."""
    lines = []
    for (kind, (parameters, arguments)), function, form in product(ARRAYS.items(), FUNCTIONS, FORMS):
        head = f"void {kind}_{function}_T(size_t n, const T *speed, {parameters}, T *out)".replace("T", form)
        call = f"viscopade_{function}_{kind}_{given.name}{SUFFIXES[form]}(n, speed, {arguments}, out);"
        lines.append(f"{head} {{ {call} }}")
    return "\n".join([*lines, ""])


def single(given):
    """Return C text of functions that call those of single speeds one by one, named likewise."""
    return "".join(
        f"void single_{function}_{form}(size_t n, const {form} *speed, const {form} *beta, {form} *out)\n{{\n"
        f"    size_t i;\n    for (i = 0; i < n; ++i) {{\n"
        f"        out[i] = viscopade_{function}_{given.name}{SUFFIXES[form]}(speed[i], beta[i]);\n    }}\n}}\n"
        for function, form in product(FUNCTIONS, FORMS)
    )


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


class Functions:
    """All functions of a header, compiled; they take and return arrays."""

    def __init__(self, here, given, command):
        here = here / f"speed{next(_serial)}"
        here.mkdir()
        (here / "header.h").write_text(given.text, encoding="utf-8")
        text = ('#include "header.h"\n#ifdef __cplusplus\nextern "C" {\n#endif\n', interface(given), single(given),
                _CONTROL, "#ifdef __cplusplus\n}\n#endif\n")  # fmt: skip
        (here / "interface.src").write_text("".join(text))
        built = here / "interface.o"
        subprocess.run([*command, *WARNINGS, "-fPIC", "-c", str(here / "interface.src"), "-o", str(built)], check=True)
        # Linked without -ffast-math, which would set subnormal numbers to 0 in this process.
        subprocess.run([command[0], "-shared", str(built), "-o", str(here / "interface.so"), "-lm"], check=True)
        self.shared = ctypes.CDLL(str(here / "interface.so"))

    def __call__(self, kind, function, values, beta, pair=None, out=None):
        """Call a function; `values` has the type, `beta` is an array, for kind "array" one number.

        `pair` are indices of `beta` for kind "by_pair".
        """
        form = next(form for form, it in FORMS.items() if it is values.dtype.type)
        result = np.empty_like(values) if out is None else out
        if kind == "array":
            scalar = ctypes.c_float if form == "float" else ctypes.c_double
            given = [scalar(float(beta))]
        else:
            assert beta.dtype == values.dtype
            given = [_pointer(beta)]
        if kind == "by_pair":
            assert pair.dtype == np.intc
            given = [_pointer(pair), *given]
        entry = self.shared[f"{kind}_{function}_{form}"]
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
