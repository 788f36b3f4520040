"""Inverse kernels: programs, bounds of rounding, choice of powers, refusals."""

from __future__ import annotations

import ctypes
import ctypes.util
import random
from fractions import Fraction
from functools import cache

import numpy as np
import pytest
from flint import arb

from viscopade.approximation import inverse as approximants
from viscopade.arithmetic.balls import working
from viscopade.arithmetic.formats import FORMATS
from viscopade.kernels import formulas, inverse, machine, rounding_bounds
from viscopade.kernels.arithmetic import HOST, HOSTS
from viscopade.kernels.expressions import Reading, Run, evaluate
from viscopade.kernels.machine import TYPES

each_form = pytest.mark.parametrize("form", FORMATS.values(), ids=FORMATS)


@cache
def kernels():
    """Return kernels with powers and coefficients."""
    found = []
    for accuracy in ("1e-3", "1e-5"):
        powers = inverse.inverse_powers(Fraction(accuracy))
        found.append((inverse.inverse(accuracy), powers, inverse.inverse_fit(powers)))
    return found


def v_star_of(powers, found, y, number):
    n, d = (
        sum(number(c) * y**k for k, c in zip(*part, strict=True))
        for part in ((powers.top, found.a), (powers.bottom, found.b))
    )
    return y**5 * n / d


@pytest.mark.parametrize("which", range(2))
def test_programs_are_the_formula(which):
    """In exact numbers, given the root: all branches."""
    kernel, powers, found = kernels()[which]
    numbers, y = {k: Fraction(c) for k, c in kernel.constants["double"].items()}, Fraction(3, 5)
    for variable, branch in zip("yu", formulas.inverse_branches(powers), strict=True):
        run = Run(branch.program, {**numbers, variable: y}, Reading(Fraction))
        at = y if variable == "y" else 1 / y
        assert evaluate(branch.results["v_star"], run, Reading(Fraction)) == v_star_of(powers, found, at, Fraction)


@pytest.mark.parametrize("which", range(2))
@each_form
def test_rounding_is_within_its_bound(which, form):
    kernel, powers, proven = kernels()[which]
    kind, generator = TYPES[form.name], random.Random(5)
    low = float(form.least)
    points = [low, 0.5, float(np.nextafter(kind(1), kind(0))), *(low ** generator.random() for _ in range(300))]
    x = np.array([point for point in points if low <= kind(point) < 1], kind)
    bounds = {result: proven.bound(result, form) for result in ("v_star", "beta")}
    sizes = {result: float(b.rounding / (1 + b.formula)) for result, b in bounds.items()}
    found = {
        "v_star": machine.function_values(kernel, "v_star", x, form=form).tolist(),
        "beta": machine.function_values(kernel, "beta", x, 3.0, form=form).tolist(),
    }
    for i, at in enumerate(x.tolist()):
        with working(300):
            exact = v_star_of(powers, proven, ((1 - arb(at)) / arb(at)).root(10), arb)
            assert abs(found["v_star"][i] / exact - 1) <= sizes["v_star"], at
            assert abs(found["beta"][i] / (exact**2 / arb(3).root(5)) - 1) <= sizes["beta"], at


def test_bounds_for_all_arguments_are_nearly_the_largest_for_one(monkeypatch):
    """A search that stops later finds hardly less."""
    _, powers, found = kernels()[1]
    for form in found.formats:
        given, bound = (powers, found.a, found.b, HOSTS[form.name]), found.bound("v_star", form)
        monkeypatch.setattr(rounding_bounds, "_NEARLY", Fraction(1, 1024))
        assert 0.9 < float(inverse.inverse_rounding(*given)["v_star"] / bound.rounding * (1 + bound.formula)) <= 1


@each_form
def test_math_h_is_as_accurate_as_assumed(form):
    """A sample: cbrt and pow of this machine against exact powers."""
    name = ctypes.util.find_library("m")
    if name is None:
        pytest.skip("there is no C library of mathematics")
    kind, of_machine = {"double": ctypes.c_double, "float": ctypes.c_float}[form.name], ctypes.CDLL(name)
    generator = random.Random(7)
    exponent = {"cbrt": Fraction(1, 3), "pow": Fraction(form.nearest(Fraction("0.1")))}
    for name in ("cbrt", "pow"):
        worst = 0.0
        for _ in range(3000):
            x = float(TYPES[form.name](2.0 ** generator.uniform(-120, 120)))
            function = of_machine[name + form.suffix]
            function.restype = kind
            found = function(kind(x), *([kind(exponent["pow"])] if name == "pow" else []))
            with working(128):
                true = (arb(x).log() * exponent[name].numerator / exponent[name].denominator).exp()
                worst = max(worst, float(abs(found - true) / float(form.ulp(Fraction(found)))))
        assert 0.3 < worst < HOST.functions


def test_the_fewest_coefficients_that_are_accurate_enough():
    fewest = next(powers for powers in approximants.BEST if approximants.fit_inverse(powers).error <= 1e-3)
    assert kernels()[0][1].coefficients == fewest.coefficients


def test_what_is_said_to_be_accepted_is_accepted():
    best = inverse.inverse_fit(approximants.BEST[-1]).error("v_star")
    assert inverse.BEST_ACCURACY * Fraction(95, 100) < best <= inverse.BEST_ACCURACY
    with pytest.raises(ValueError, match=r"inverse is 3\.4e-08: expected a number from 3\.5e-08 to 0\.99"):
        inverse.inverse(3.4e-8)
