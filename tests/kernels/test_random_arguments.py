"""Ready kernels at random arguments, others every day: compiled code, and Python, against the exact function.

Fixed arguments are those of the test vectors (test_every_kernel.py, test_vectors.py). The exact values and the allowed
errors come from the module that makes the vectors.
"""

import math
import random
from fractions import Fraction

import numpy as np
import pytest

from tests import compiled, daily
from tests.kernels.languages import LANGUAGES, TYPES, Code, of_c
from tests.kernels.test_every_kernel import REQUESTS, has
from viscopade.arithmetic.balls import exact_middle, working
from viscopade.kernels import requests, truth
from viscopade.kernels.requests import Request
from viscopade.kernels.targets import vectors

OTHERS = {
    "half-line-relative": Request(accuracy=("1e-3",), measure="relative"),
    "minimax-relative": Request(minimax=((2, 3),), v_star_min="0.5", v_star_max="3", measure="relative"),
    "inverse-interval": Request(inverse=("1e-3",), epsilon_min="0.3"),
}
KNOWN = REQUESTS | OTHERS
COMPACT = "half-line in cuda"
NAMES = [*KNOWN, COMPACT]
BUILDS = {"plain": [], "contracted": ["-ffp-contract=fast", *compiled.FMA]}
WHOLE = {"double": (-1074, 1023), "float": (-149, 127)}  # exponents of all numbers
of_days = pytest.mark.parametrize("number", [6, pytest.param(100, marks=pytest.mark.slow)])


def functions(asked):
    """Return the functions of a request by type and number of arguments."""
    found = {}
    for kernel in asked.prove():
        for function in vectors._functions(kernel):
            arity = len(next(iter(function.points)))
            found.setdefault((function.form.name, arity), []).append(function)
    return found


def portion(generator, form):
    """Return an eps, or a 1 - eps."""
    return generator.choice(
        [
            generator.random,
            lambda: 2.0 ** generator.uniform(WHOLE[form][0], 0),
            lambda: 1 - 10 ** -generator.uniform(1, 6),
        ]
    )()


def size(generator, form, least=-14, most=14):
    """Return a positive number, of usual size or any."""
    return 2.0 ** generator.uniform(*generator.choice([(least, most), (least, most), WHOLE[form]]))


def arguments(function, arity, number, generator):
    """Return random arguments of a function, numbers of its type."""
    form = function.form.name
    for _ in range(number):
        if function.name.startswith(("v_star", "beta")):
            given = [portion(generator, form), *(size(generator, form) for _ in range(arity - 1))]
        elif arity == 1:
            given = [generator.choice([size(generator, form), generator.uniform(0.5, 3)])]
        else:
            given = [size(generator, form, -90, 60), size(generator, form, -6, 6)]
        yield tuple(float(TYPES[form](x)) for x in given)


def allowed(function, given):
    """Return the least and the largest result within the proven bounds, or None where nothing is stated."""
    found = function.answer(*given)
    if found is None:
        return None
    exact, error = found
    if isinstance(exact, float):
        return exact, exact
    return exact_middle(exact.lower()) - error, exact_middle(exact.upper()) + error


def in_python(text, function):
    """Return a function of the module; NaN stands for a refusal."""
    names = {"__name__": "generated"}
    exec(text, names)

    def call(*given):
        try:
            return names[function.name](*given)
        except ValueError:
            return math.nan

    return call


@pytest.mark.parametrize("name", NAMES)
@of_days
def test_results_are_within_the_proven_bounds(tmp_path, name, number):
    """In C, with and without FMA contraction; compact kernels as CUDA's header has them for the host."""
    asked = requests.HALF_LINE if name == COMPACT else KNOWN[name]
    how = LANGUAGES["CUDA, host" if name == COMPACT else "C"]
    text, generator = asked.render(how.target), random.Random(f"{name} {daily.DAY}")
    checked = 0
    with working(truth.BITS), np.errstate(all="ignore"):
        for (form, arity), found in functions(asked).items():
            found = [function for function in found if has(how, text, function.name, form)]
            if not found:
                continue
            code = Code(text, tuple(function.name for function in found), form, arity)
            computes = {}
            for build, flags in BUILDS.items():
                directory = tmp_path / f"{form}{arity}{build}"
                directory.mkdir()
                computes[build] = of_c(directory, code, flags=flags)
            for function in found:
                points = list(arguments(function, arity, number, generator))
                ends = [allowed(function, point) for point in points]
                columns = np.array(points).T.astype(TYPES[form])
                for build, compute in computes.items():
                    for point, end, result in zip(points, ends, compute(*columns)[function.name], strict=True):
                        checked += end is not None
                        assert end is None or is_within(float(result), end), (function.name, form, build, point)
    assert checked


def is_within(result, ends):
    """Whether a result is between two ends, or NaN if they are."""
    low, high = ends
    if isinstance(low, float):
        return result == low or (math.isnan(low) and math.isnan(result))
    return math.isfinite(result) and low <= Fraction(result) <= high


@pytest.mark.parametrize("name", [name for name in KNOWN if name != "full" and not name.startswith("speed")])
def test_python_is_c_to_the_last_bit(tmp_path, name):
    generator = random.Random(f"{name} {daily.DAY}")
    text, module = KNOWN[name].render("c"), KNOWN[name].render("python")
    for (form, arity), found in functions(KNOWN[name]).items():
        found = [function for function in found if form == "double" and has(LANGUAGES["C"], text, function.name, form)]
        if found:
            directory = tmp_path / f"{arity}"
            directory.mkdir()
            compute = of_c(directory, Code(text, tuple(function.name for function in found), form, arity))
            points = [point for function in found for point in arguments(function, arity, 200, generator)]
            results = compute(*np.array(points).T)
            for function in found:
                same = in_python(module, function)
                for point, result in zip(points, results[function.name], strict=True):
                    here = same(*point)
                    assert here == result or math.isnan(here), (function.name, point)
