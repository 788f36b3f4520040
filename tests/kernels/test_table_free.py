"""Compact kernels: bounds of rounding in each arithmetic."""

from __future__ import annotations

import itertools
from dataclasses import replace
from fractions import Fraction
from functools import cache

import numpy as np
import pytest

from tests.kernels.languages import FORMS
from viscopade.approximation.lacunary import Powers
from viscopade.arithmetic.balls import working
from viscopade.arithmetic.formats import DOUBLE, FLOAT
from viscopade.kernels import expressions, formulas, prove_lacunary
from viscopade.kernels.forms import table_free
from viscopade.kernels.forms.table_free import DEVICE, FUNCTIONS, LARGEST, LIBRARY, SHADER


@cache
def kernels():
    return tuple(prove_lacunary.half_line_kernel(accuracy) for accuracy in ("1e-3", "1e-5", "1e-7"))


def having(form):
    return [kernel for kernel in kernels() if any(v.form == FORMS[form] for v in kernel.variants)]


# --- programs and bounds ----------------------------------------------------------------------------------------------


def test_the_program_is_the_formula():
    y, speed = Fraction(3, 5), Fraction(7, 2)
    for kernel in kernels():
        variant = kernel.variants[0]
        parts = ((kernel.powers.top, variant.a), (kernel.powers.bottom, variant.b))
        n, d = (sum(Fraction(c) * y**k for k, c in zip(*part, strict=True)) for part in parts)
        eps = d / (d + y**6 * n)
        own = table_free.table_free_program(kernel.powers)
        given = {k: Fraction(c) for k, c in table_free.numbers(kernel.powers, variant.a, variant.b, DOUBLE).items()}
        exactly = expressions.Reading(Fraction)
        values = expressions.Run((*own.common, own.inverse), given | {"y": y, "speed": speed}, exactly)
        found = {name: expressions.evaluate(e, values, exactly) for name, e in own.results.items()}
        assert found == {"restitution": eps, "rebound": eps * speed, "dissipation": 1 - eps**2}


def test_w():
    given = {"beta": Fraction(3), "speed": Fraction(5, 2)}
    values = expressions.Run(formulas.w_program(), given, expressions.Reading(Fraction))
    assert values["w"] == 3**5 * Fraction(5, 2)


def test_powers_of_another_kind_are_refused():
    with pytest.raises(ValueError, match="deg N must be deg D"):
        table_free.table_free_program(Powers((0, 4), (0, 4)))


def emulated(kernel, machine, generator, w):
    """The program in type float, with functions whose results are moved by random errors within their bounds."""
    variant = kernel.variant(FLOAT)
    f32 = np.float32

    def moved(exact, ulps, absolute=0.0):
        steps = generator.uniform(-1, 1, len(w)) * np.asarray(ulps, dtype=float)
        near = np.abs(exact) <= 1
        error = np.where(near & (absolute > 0), generator.uniform(-absolute, absolute, len(w)), steps * spacing(exact))
        # A little less, as the result is rounded to a number of the type.
        return (exact + error * (1 - 2**-2)).astype(f32)

    def spacing(exact):
        return np.ldexp(1.0, np.frexp(exact)[1] - 24)

    functions = {
        "log2": lambda x: moved(np.log2(x.astype(float)), float(machine.log2), float(machine.log2_absolute)),
        "exp2": lambda x: moved(
            np.exp2(x.astype(float)), float(machine.exp2) + float(machine.exp2_slope) * np.abs(x.astype(float))
        ),
        "divide": lambda a, b: moved(np.divide(a, b, dtype=float), max(float(machine.quotient) - 0.5, 0)),
    }
    own = table_free.table_free_program(kernel.powers, table_free.called)
    given = {k: f32(c) for k, c in table_free.numbers(kernel.powers, variant.a, variant.b, FLOAT).items()}
    given |= {"w": w, "speed": np.ones(len(w), f32)}
    machine_numbers = expressions.Reading(f32, functions)
    values = expressions.Run((*own.common, own.inverse), given, machine_numbers)
    return {name: expressions.evaluate(e, values, machine_numbers) for name, e in own.results.items()}


def formula(kernel, form, w):
    """The formula with the coefficients of a type, in double precision, with few roundings."""
    variant = kernel.variant(form)
    y = np.longdouble(w) ** (np.longdouble(1) / 30)
    n, d = (
        sum(np.longdouble(c) * y**k for k, c in zip(exponents, numbers, strict=True))
        for exponents, numbers in ((kernel.powers.top, variant.a), (kernel.powers.bottom, variant.b))
    )
    eps, loss = d / (d + y**6 * n), y**6 * n / (d + y**6 * n)
    return {"restitution": eps, "rebound": eps, "dissipation": loss * (1 + eps)}


@pytest.mark.parametrize(
    "machine", [LIBRARY["float"], DEVICE, SHADER], ids=["library", "device", "shader"]
)  # fmt: skip
@pytest.mark.parametrize("which", [0, 1])
def test_bounds_hold_for_machines_as_bad_as_assumed(machine, which):
    kernel, generator = kernels()[which], np.random.default_rng(5)
    variant = kernel.variant(FLOAT)
    w = np.exp2(generator.uniform(-126, 120, 60_000)).astype(np.float32)
    common = (w >= 1e-30) & (w <= 1e10)
    found, true = emulated(kernel, machine, generator, w), formula(kernel, FLOAT, w)
    bounds = table_free.rounding_bounds(kernel.powers, variant.a, variant.b, machine)
    for function in FUNCTIONS:
        error = np.abs(found[function] / true[function] - 1)
        for bound, part in ((bounds[function].everywhere, error), (bounds[function].common, error[common])):
            assert 0.05 * float(bound) < part.max() <= float(bound)


@pytest.mark.parametrize("machine", [LIBRARY["double"], LIBRARY["float"], SHADER], ids=["double", "float", "shader"])
def test_bounds_for_all_arguments_are_nearly_the_largest_for_one(machine):
    kernel = kernels()[1]
    variant, form = kernel.variant(machine.type), machine.type
    given = kernel.powers, variant.a, variant.b, machine
    w = np.linspace(1 - form.largest, LARGEST[form.name], 150)
    with working(128):
        parts = [Fraction(2.0**e) for e in (*(w / 30), *np.log2(np.linspace(0.1, 10 ** (1 / 3), 20)))]
        alone = [(y**3, table_free._on_part(*given, y, y)) for y in parts]
    for function, bound in table_free.rounding_bounds(*given).items():
        everywhere = max(float(found[function]) for _, found in alone)
        common = max(float(found[function]) for v, found in alone if table_free.COMMON[0] <= v <= table_free.COMMON[1])
        assert 0.85 * float(bound.everywhere) < everywhere <= float(bound.everywhere)
        assert 0.85 * float(bound.common) < common <= float(bound.common)


def test_common_speeds_are_covered():
    low, high = table_free._COMMON_Y
    assert low**3 <= table_free.COMMON[0]
    assert table_free.COMMON[1] <= high**3 < table_free.COMMON[1] * Fraction(101, 100)
    for form in FORMS.values():
        for ends in (table_free._COMMON_Y, table_free._ends(form)):
            parts = list(table_free._parts(form, *ends))
            assert (parts[0][0], parts[-1][1]) == ends
            assert all(left[1] == right[0] for left, right in itertools.pairwise(parts))
        low, high = table_free._ends(form)
        assert low**30 <= Fraction(2) ** (1 - form.largest)
        assert high**30 >= Fraction(2) ** LARGEST[form.name]


BAD = {
    "log2": replace(LIBRARY["float"], log2=Fraction(3000)),
    "log2, absolute": replace(LIBRARY["float"], log2_absolute=Fraction(1, 100)),
    "exp2": replace(LIBRARY["float"], exp2=Fraction(1000)),
    "exp2, slope": replace(LIBRARY["float"], exp2_slope=Fraction(1000)),
    "quotient": replace(LIBRARY["float"], quotient=Fraction(1000)),
}


@pytest.mark.parametrize("machine", BAD.values(), ids=BAD)
def test_every_error_of_a_machine_counts(machine):
    """One that is far larger than all others: results come close to the bound, and not beyond it."""
    kernel, generator = kernels()[1], np.random.default_rng(6)
    variant = kernel.variant(FLOAT)
    ends = (-1, 1) if machine.log2_absolute else (-126, 120)
    w = np.exp2(generator.uniform(*ends, 20_000)).astype(np.float32)
    bound = table_free.rounding_bounds(kernel.powers, variant.a, variant.b, machine)
    found, true = emulated(kernel, machine, generator, w), formula(kernel, FLOAT, w)
    ratio = {f: np.abs(found[f] / true[f] - 1).max() / float(bound[f].everywhere) for f in FUNCTIONS}
    assert max(ratio.values()) <= 1
    assert ratio["restitution"] > (0.1 if machine.log2_absolute else 0.2)


def test_powers_that_overflow_are_refused(monkeypatch):
    kernel = kernels()[0]
    variant = kernel.variant(FLOAT)
    monkeypatch.setitem(LARGEST, "float", 150)
    with pytest.raises(ArithmeticError, match="may overflow in type float"):
        table_free.rounding_bounds.__wrapped__(kernel.powers, variant.a, variant.b, DEVICE)
