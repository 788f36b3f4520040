"""Every ready kernel in every language: results at vectors, bad input, exceptions; each cell is run where its tool is.

A cell is a kernel and a way to run a language. Bounds are those of the kernel, exact results those of the test vectors,
at their arguments and at random ones, others every day.
"""

import json
import math
import random
import re
import subprocess
from dataclasses import replace
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from tests import compiled, daily
from tests.devtools import opened
from tests.kernels.languages import FORMS, TYPES, WAYS, tool
from tests.kernels.test_same_bits import HASHES, digest, functions_of, v_stars
from viscopade.kernels import catalogue
from viscopade.kernels.kernel import Kernel
from viscopade.kernels.write import file, vectors
from viscopade.kernels.write.languages import NAMES, language

KERNELS = {key: entry for key, entry in catalogue.CATALOGUE.items() if entry.group not in ("full", "speed")}
"""Those that every language writes."""
EXPORTS = Path(__file__).parents[2] / "exports"
RANDOM = 6  # arguments of each function
COMMAND = "viscopade export"


@cache
def kernel(key: str) -> Kernel:
    return KERNELS[key].kernel


@cache
def text(name: str) -> str:
    """Return one file with all kernels that a language can write."""
    found = language(name)
    return file.file_text([*map(kernel, KERNELS)], found, COMMAND)


@cache
def functions(form: str) -> dict:
    """Return the functions of a type in a file by their names in code, with the keys of their kernels."""
    there = {key: kernel(key) for key in KERNELS if form in kernel(key).formats}
    return {f"{f.name}_{of.name}": (key, f) for key, of in there.items() for f in of.functions}


WHOLE = {"double": (-1074, 1023), "float": (-149, 127)}
"""Exponents of all numbers."""


def arguments(function, form, generator):
    """Return random arguments: portions of any size, speeds and v* of usual size or any."""

    def portion():
        near_one = 1 - 10 ** -generator.uniform(1, 6)
        return generator.choice([generator.random(), 2.0 ** generator.uniform(WHOLE[form][0], 0), near_one])

    def size(least=-14, most=14):
        return 2.0 ** generator.uniform(*generator.choice([(least, most), (least, most), WHOLE[form]]))

    match function.arguments:
        case ("v_star",):
            return (generator.choice([size(), generator.uniform(0.5, 3)]),)
        case ("speed", "beta"):
            return size(-90, 60), size(-6, 6)
        case (_, "speed"):
            return portion(), size()
    return (portion(),)


def number(text_of_one):
    """Return a number of the vectors; what is not stated is None."""
    return None if text_of_one == vectors.NOTHING else float.fromhex(text_of_one)


@cache
def stored():
    """Return the vectors of `exports/` by function and type."""
    found = {}
    for group in ("pade", "minimax", "compact", "inverse"):
        for row in json.loads((EXPORTS / f"vectors_{group}.json").read_text())["vectors"]:
            found.setdefault((row[0], row[1]), []).append(row)
    return found


@cache
def rows(form):
    """Return vectors of each function of a type, with random ones: arguments, least and greatest result, and bits."""
    found = {}
    for name, (key, function) in functions(form).items():
        generator = random.Random(f"{name} {form} {daily.DAY}")
        more = [arguments(function, form, generator) for _ in range(RANDOM)]
        lines = [*stored()[name, form], *vectors.vectors(kernel(key), function, FORMS[form], more)]
        found[name] = [[number(one) for one in (*row[2:4], *row[7:10])] for row in lines]
    return found


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Return a function from a way and a type to the program of all functions; those of one argument take the first."""

    @cache
    def ready(way, form):
        calls = {name: f.arguments for name, (_, f) in functions(form).items()}
        found = WAYS[way]
        program = found.program(form, text(found.language), calls, tmp_path_factory.mktemp("language"))
        return lambda x, y=None, **more: program(x, np.ones_like(x) if y is None else y, **more)

    return ready


STANDARDS = [way for way in WAYS if way.startswith("C as ")]


def ways(names):
    """Return ways as parameters: of other standards of C than C99, one every day."""
    left_out = {*STANDARDS} - {daily.chosen(STANDARDS)}
    return [
        pytest.param(
            way, marks=pytest.mark.slow if way in left_out else (), id=way.replace(", ", "-").replace(" ", "-")
        )
        for way in names
    ]


@pytest.mark.parametrize("way", ways(WAYS))
def test_results_are_within_the_proven_bounds_and_have_the_bits(run, way):
    """NaN for bad input; what the operations of IEEE 754 determine is the same everywhere."""
    for form in WAYS[way].written.forms:
        given = np.array([[1 if x is None else x for x in row[:2]] for each in rows(form).values() for row in each])
        found, start, tiny = run(way, form)(*given.astype(TYPES[form]).T), 0, np.finfo(TYPES[form]).tiny
        for name, lines in rows(form).items():
            results, start, checked = found[name][start : start + len(lines)].astype(float), start + len(lines), 0
            for result, (*point, least, most, bits) in zip(results, lines, strict=True):
                said = (name, form, point, result)
                if WAYS[way].flushed and any(x and abs(x) < tiny for x in (*point, least)):
                    continue
                assert least is None or (math.isnan(least) and math.isnan(result)) or least <= result <= most, said
                exact = bits is not None and WAYS[way].exact
                assert not exact or result == bits or (math.isnan(bits) and math.isnan(result)), said
                checked += 1
            assert checked > 10, name


@pytest.mark.parametrize("way", ways(way for way, found in WAYS.items() if found.exact))
def test_ten_thousand_results_have_the_hashes(run, way):
    """Those that `test_same_bits` has."""
    for form in WAYS[way].written.forms:
        found = run(way, form)(*v_stars(form))
        for kind in ("pade", "minimax"):
            hashes = {name: digest(found[name]) for name in functions_of(kind, form)}
            assert hashes == HASHES[kind][form]


# --- exceptions -------------------------------------------------------------------------------------------------------

TRAPS = """#define _GNU_SOURCE
#include <fenv.h>
__attribute__((constructor)) static void trap(void) { feenableexcept(FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW); }
"""
SIZES = {
    "double": (0.0, 5e-324, 1e-310, 1e-300, 1e-20, 0.3, 1.0, 1e20, 1e300),
    "float": (0.0, 1e-45, 1e-40, 1e-37, 1e-20, 0.3, 1.0, 1e20, 1e37),
}
# JavaScript, Julia and C# have no exceptions of floating-point numbers.
TRAPPING = [way for way, found in WAYS.items() if found.language in ("c", "cuda", "fortran", "rust")]
WARNING = [way for way, found in WAYS.items() if found.language in ("python", "arrays", "warp")]


@pytest.fixture(scope="module")
def traps(tmp_path_factory):
    """Return a library that lets a program stop at each exception."""
    source = tmp_path_factory.mktemp("traps") / "traps.c"
    source.write_text(TRAPS)
    library = source.with_suffix(".so")
    command = [*compiled.compiler("gnu99"), source, "-shared", "-fPIC", "-o", library, "-lm"]
    if subprocess.run(command, capture_output=True).returncode:
        pytest.skip("the C library does not trap exceptions")
    return str(library)


@pytest.mark.parametrize("way", ways([*TRAPPING, *WARNING]))
def test_no_exception_is_raised_that_programs_trap(run, traps, way):
    """No division by zero, invalid operation or overflow, at which OpenFOAM stops; in Python no warning."""
    more = {"LD_PRELOAD": traps} if way in TRAPPING else {"PYTHONWARNINGS": "error::RuntimeWarning"}
    for form in WAYS[way].written.forms:
        given = list(product(SIZES[form], (0.0, 1e-40, 0.01, 1.307)))
        found = run(way, form)(*np.array(given, TYPES[form]).T, **more)
        assert set(found) == set(functions(form))


# --- all arguments ----------------------------------------------------------------------------------------------------

CUT = {"double": 2.0**900, "float": 2.0**120}
"""The w = beta^5 speed at which compact kernels are cut off."""
SANITIZERS = ("-fsanitize=undefined,address,float-divide-by-zero", "-fno-sanitize-recover=all")


@pytest.mark.parametrize("way", ways(WAYS))
def test_beyond_the_largest_w_results_are_those_of_the_cut_off(run, way):
    """The vectors state nothing of these speeds."""
    for form in WAYS[way].written.forms:
        most, cut = float(np.finfo(TYPES[form]).max), CUT[form]
        pairs = [(cut, 1.0), (cut * 2, 1.0), (math.inf, 1.0), (most, 1e10), (1.0, math.inf), (math.inf, math.inf)]
        found = run(way, form)(*np.array(pairs, dtype=TYPES[form]).T)
        for name, (key, function) in functions(form).items():
            if KERNELS[key].group == "compact" and function.name != "rebound":
                assert (found[name] == found[name][0]).all()
            if KERNELS[key].group == "compact" and function.name == "restitution":
                assert 0 < found[name][0] < (1e-89 if form == "double" else 2e-12)


@pytest.mark.parametrize("form", FORMS)
def test_no_undefined_behaviour_and_no_overflow_for_any_bits(tmp_path, form):
    """No finite input gives an infinity or a division by 0, and eps is in [0, 1] but for rounding."""
    bits = np.random.default_rng(daily.DAY).integers(0, 256, 160_000, np.uint8).view(TYPES[form])
    powers = np.ldexp(1.0, np.arange(*WHOLE[form])).astype(TYPES[form])
    x = np.concatenate([bits, powers, np.nextafter(powers, TYPES[form](0))])
    second = np.random.default_rng(daily.DAY).integers(0, 2**24, len(x)).astype(TYPES[form])
    calls = {name: f.arguments for name, (_, f) in functions(form).items()}
    found = replace(WAYS["C"], flags=SANITIZERS).program(form, text("c"), calls, tmp_path)(x, second)
    for name, results in found.items():
        assert not np.isinf(results[np.isfinite(x)]).any(), name
        assert np.isfinite(results).sum() > 0.09 * len(x), name
        if name.startswith(("epsilon", "restitution", "dissipation")):
            known = results[~np.isnan(results)]
            assert ((known >= 0) & (known <= 1 + 4 * np.finfo(TYPES[form]).eps)).all(), name


# --- bad input --------------------------------------------------------------------------------------------------------

NO_NUMBERS = ("null", "undefined", "[]", "[1]", "'1'", "true", "1n")


def test_what_is_no_number_gives_nan(tmp_path):
    """JavaScript's arithmetic takes null and [] for 0."""
    (tmp_path / "viscopade.mjs").write_text(text("javascript"))
    calls = list[str]()
    for (name, (_, function)), none in product(functions("double").items(), NO_NUMBERS):
        two = len(function.arguments) == 2
        calls += [f"v.{name}({none}, 1)", f"v.{name}(1, {none})"] if two else [f"v.{name}({none})"]
    (tmp_path / "main.mjs").write_text(f'import * as v from "./viscopade.mjs"; console.log({", ".join(calls)})')
    ran = subprocess.run([tool("node"), tmp_path / "main.mjs"], capture_output=True, text=True, check=True)
    assert set(ran.stdout.split()) == {"NaN"}


def test_a_page_from_the_disk_has_the_functions_of_the_module(tmp_path):
    """In Node and in Chromium: by the script in exports, whose one global object has what the module exports."""
    # To 12 digits: pow and log2 of two browsers may differ in the last one.
    calls = [
        f"viscopade.{name}({speed}, 1.307)"
        for name in re.findall(r"^export function (\w+)", (EXPORTS / "viscopade.mjs").read_text(), re.MULTILINE)
        for speed in ("0", "1e-9", "2", "1e9", "-1", "null")
    ]
    values = (
        f"JSON.stringify([{', '.join(f'({call}).toPrecision(12)' for call in calls)}, Object.keys(viscopade).sort()])"
    )
    mains = {
        "module.mjs": f'import * as viscopade from "{EXPORTS}/viscopade.mjs"; console.log({values});',
        "script.cjs": f'const viscopade = require("{EXPORTS}/viscopade.js"); console.log({values});',
    }
    printed = []
    for name, main in mains.items():
        (tmp_path / name).write_text(main)
        ran = subprocess.run([tool("node"), tmp_path / name], capture_output=True, text=True, check=True)
        printed.append(ran.stdout.strip())
    assert printed[0] == printed[1]
    (tmp_path / "page.html").write_text(
        f'<!doctype html><title>a</title><script src="{EXPORTS}/viscopade.js"></script>'
    )
    with opened(tmp_path / "profile") as tab:
        tab.open((tmp_path / "page.html").as_uri())
        assert tab.evaluate(values) == printed[0]
        assert tab.errors == []


@pytest.mark.parametrize(
    ("name", "helper"), [(name, each) for name in NAMES for each in language(name).helpers.split()]
)
def test_helpers_are_in_files_that_call_them(name, helper):
    found, call_ = language(name), f"{helper.partition('.')[0]}("
    counts = {file.file_text([kernel(key)], found, COMMAND).count(call_) for key in KERNELS}
    assert 0 in counts
    assert 1 not in counts  # it stands there, and nothing calls it
    assert max(counts) > 1


@pytest.mark.parametrize("name", NAMES)
def test_coefficients_read_back(name):
    """Every constant of a kernel is in the text of its type to the last bit."""
    found = language(name)
    for key, number_ in product(KERNELS, found.numbers):
        for constant in kernel(key).constants.get(number_.form, {}).values():
            assert number_.constant(constant) in text(name)
