"""`vp.restitution`: both backends give the same bits, and take `out`, `where` and `dtype` as NumPy's ufuncs do."""

import copy
import math
import os
import pickle
import shutil
import subprocess
import sys
import sysconfig
from concurrent.futures import ThreadPoolExecutor
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

import viscopade as vp
from viscopade import compiled
from viscopade.kernels import native
from viscopade.kernels.formulas import OCTAVES
from viscopade.kernels.speed_table import SWITCH, TABLES

FIRST = TABLES["full"].first
NUMPY = native.numpy_restitution
SETS = compiled.extension.instruction_sets() if compiled.extension else ()
COMPILED = {name: native.compiled_restitution(name) for name in SETS}
BACKENDS = {"numpy": NUMPY, **COMPILED}

each_backend = pytest.mark.parametrize("restitution", BACKENDS.values(), ids=BACKENDS)
needs_extension = pytest.mark.skipif(not COMPILED, reason="the extension was not built")
FLOATS = (np.float32, np.float64)
BITS = {4: np.uint32, 8: np.uint64}


def same(first, second):
    """Whether all bits agree, except those that tell a NaN from another."""
    if type(first) is not type(second) or first.dtype != second.dtype or first.shape != second.shape:
        return False
    if np.ma.isMaskedArray(first) and not np.array_equal(first.mask, second.mask):
        return False
    first, second = (np.array(x, dtype=x.dtype.newbyteorder("=")) for x in (first, second))
    bits = BITS[first.dtype.itemsize]
    return bool(np.all((first.view(bits) == second.view(bits)) | (np.isnan(first) & np.isnan(second))))


def quiet(function, *arguments, **keywords):
    with np.errstate(all="ignore"):
        return function(*arguments, **keywords)


# --- the same bits ----------------------------------------------------------------------------------------------------


def samples(dtype, number, seed):
    """Yield speeds and betas: any bits; those of the table; those beyond it."""
    rng = np.random.default_rng(seed)
    size = np.dtype(dtype).itemsize
    for signs in (False, True):
        pair = [rng.integers(0, 256, number * size, dtype=np.uint8).view(dtype) for _ in range(2)]
        yield pair if signs else np.abs(pair)
    for width in (3, 25 if size == 8 else 7):
        yield [(10 ** rng.uniform(-w, w, number)).astype(dtype) for w in (width, width / 5)]


def edges(dtype):
    """Return numbers next to where the code branches, and the special ones."""
    ends = np.array([2.0**FIRST, 2.0 ** (FIRST + OCTAVES), 2.0**SWITCH, 1, 2])
    form = np.finfo(dtype)
    numbers = [*ends, form.tiny, form.smallest_subnormal, form.max, form.eps, 1.5, 1e-30, 1e30, 0.0, np.inf, np.nan]
    with np.errstate(all="ignore"):
        numbers = np.array(numbers, dtype=dtype)
        near = np.concatenate([numbers, np.nextafter(numbers, dtype(0)), np.nextafter(numbers, dtype(np.inf))])
    return np.concatenate([near, -near])


def check_agreement(compiled, dtype, number, seed):
    for speed, beta in samples(dtype, number, seed):
        assert same(quiet(compiled, speed, beta), quiet(NUMPY, speed, beta))
        for one in (dtype(1.307), beta[0], beta[1]):
            assert same(quiet(compiled, speed, one), quiet(NUMPY, speed, one))


@needs_extension
@pytest.mark.parametrize("compiled", COMPILED.values(), ids=COMPILED)
@pytest.mark.parametrize("dtype", FLOATS)
def test_backends_agree_to_the_last_bit(dtype, compiled):
    check_agreement(compiled, dtype, 30_000, seed=1)
    grid = edges(dtype)
    assert same(quiet(compiled, grid[:, None], grid), quiet(NUMPY, grid[:, None], grid))


@each_backend
def test_eps_keeps_its_bits_if_beta_and_the_fifth_root_of_1_over_speed_grow_by_a_power_of_two(restitution):
    generator = np.random.default_rng(11)
    w, beta = np.exp2(generator.uniform(-60, 60, 3000)), np.exp2(generator.uniform(-30, 30, 3000))
    speed, power = w / beta**5, generator.integers(-20, 21, 3000)
    assert same(restitution(speed, beta), restitution(np.ldexp(speed, -5 * power), np.ldexp(beta, power)))


@each_backend
def test_float_is_the_rounded_double(restitution):
    rng = np.random.default_rng(6)
    speed, beta = ((10 ** rng.uniform(-4, 4, 5000)).astype(np.float32) for _ in range(2))
    assert same(restitution(speed, beta), restitution(speed.astype(float), beta.astype(float)).astype(np.float32))


# --- the right numbers ------------------------------------------------------------------------------------------------


@each_backend
def test_agrees_with_the_function_of_v_star(restitution):
    speed = np.geomspace(1e-40, 1e40, 20_000)
    np.testing.assert_allclose(restitution(speed, 1.0), vp.epsilon(speed**0.1), rtol=3e-14)


INF, NAN = math.inf, math.nan
SPECIAL = {
    1.0: [(0.0, 1.0), (1.0, 0.0), (-0.0, 1.0), (1.0, -0.0), (0.0, 0.0), (5e-324, 5e-324)],
    0.0: [(INF, 1.0), (1.0, INF), (INF, INF), (INF, 5e-324), (1.7e308, 1.7e308)],
    NAN: [(NAN, 1.0), (1.0, NAN), (NAN, NAN), (NAN, -1.0), (-1.0, NAN)],
}
"""Arguments by their result."""
INVALID = [(0.0, INF), (INF, 0.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-INF, 1.0), (1.0, -INF)]
MESSAGE = "invalid value encountered in restitution"


@each_backend
@pytest.mark.parametrize("extra", [0, 100])
def test_special_values(restitution, extra):
    """No warning: those are errors in these tests. With `extra` numbers around them, blocks are computed."""
    with np.errstate(all="raise", invalid="raise"):
        for (epsilon, pairs), dtype in product(SPECIAL.items(), FLOATS):
            for pair in pairs:
                if dtype == np.float32 and {5e-324, 1.7e308} & {*pair}:
                    continue
                found = restitution(*(np.array([x, *[1.5] * extra], dtype) for x in pair))[0]
                np.testing.assert_equal(found, dtype(epsilon))  # with its sign


@each_backend
def test_invalid_values_are_reported_as_numpy_does(restitution):
    for pair, size in product(INVALID, (None, 50)):
        arguments = pair if size is None else [np.full(size, x) for x in pair]
        with pytest.warns(RuntimeWarning, match=f"^{MESSAGE}$") as caught:
            assert np.isnan(restitution(*arguments)).all()
        assert [warning.filename for warning in caught] == [__file__]
        with np.errstate(invalid="ignore"):
            assert np.isnan(restitution(*arguments)).all()
        with np.errstate(invalid="raise"), pytest.raises(FloatingPointError, match=MESSAGE):
            restitution(*arguments)


@each_backend
def test_an_invalid_value_is_not_forgotten(restitution):
    """An early one among many; one that the result overwrites; one that a step leaves out."""
    early, first, second = np.ones(100_000), np.full(100, -1.0), np.full(100, -1.0)
    early[3] = -1
    for arguments, keywords in (
        ((early, 1.0), {}),
        ((early.astype(">f8"), 1.0), {}),
        ((early.astype(int), 1.0), {}),
        ((first, np.ones(100)), {"out": first}),
        ((np.ones(100), second), {"out": second}),
    ):
        with pytest.warns(RuntimeWarning, match=MESSAGE) as caught:
            restitution(*arguments, **keywords)
        assert len(caught) == 1
    restitution(early[::2], 1.0)


# --- called as a ufunc ------------------------------------------------------------------------------------------------


def a(values, dtype=None):
    return np.array(values, dtype)


TYPE, VALUE = (TypeError, ""), (ValueError, "")
NO_NUMBER = TypeError, "ufunc 'restitution' not supported for the input types"
CALLS = {
    "numbers": ((0.5, 1.3), {}, "f8"),
    "integers": ((1, 2), {}, "f8"),
    "a huge integer": ((2**70, 1.0), {}, "f8"),
    "an integer too large": ((10**400, 1.0), {}, (OverflowError, "")),
    "lists": (([1, 2], [[1], [2.5]]), {}, "f8"),
    "ragged": (([[1, 2], [3]], 1), {}, VALUE),
    "empty": (([], 1.0), {}, "f8"),
    "no axes": ((a(1.0), a(2.0)), {}, "f8"),
    "no broadcast": ((np.ones(2), np.ones(3)), {}, VALUE),
    "float32 scalar": ((np.float32(1), np.float32(2)), {}, "f4"),
    "float32 scalar and Python's": ((np.float32(1), 2.0), {}, "f4"),
    "float32 and Python's": ((a([1, 2], "f4"), 2.0), {}, "f4"),
    "float32 and float64": ((a([1, 2], "f4"), np.float64(2)), {}, "f8"),
    "float32 and int16": ((a([1, 2], "f4"), a([1], "i2")), {}, "f4"),
    "float32 and int64": ((a([1, 2], "f4"), a([1], "i8")), {}, "f8"),
    "float16": ((np.ones(2, "f2"), 1), {}, "f4"),
    "float16 and uint16": ((a([1, 2], "f2"), a([1], "u2")), {}, "f4"),
    "int8 and uint8": ((np.ones(2, "i1"), np.ones(2, "u1")), {}, "f8"),
    "uint32": ((a([1, 2**32 - 1], "u4"), a([1], "u4")), {}, "f8"),
    "int64 and uint64": ((a([1, 2**62], "i8"), a([2**63], "u8")), {}, "f8"),
    "other endian": ((a([1, 2], ">f8"), a([1, 2], "<i4")), {}, "f8"),
    "longdouble": ((np.longdouble(1), 1.0), {}, NO_NUMBER),
    "complex": ((1j, 1.0), {}, NO_NUMBER),
    "complex array": ((np.ones(2), np.ones(2, complex)), {}, NO_NUMBER),
    "strings": (("a", 1.0), {}, NO_NUMBER),
    "string array": ((1.0, a(["a"])), {}, NO_NUMBER),
    "dates": ((a(["2020-01-01"], "M8[D]"), 1.0), {}, NO_NUMBER),
    "an object": ((object(), 1.0), {}, NO_NUMBER),
    "records": ((np.zeros(1, "f8,f8"), 1.0), {}, TYPE),
    "one argument": ((1.0,), {}, TYPE),
    "named arguments": ((), {"speed": 1.0, "beta": 1.0}, TYPE),
    "unknown keyword": ((1.0, 1.0), {"axis": 0}, TYPE),
    "dtype f4": ((a([1.0, 1e-50]), 1.0), {"dtype": "f4"}, "f4"),
    "dtype f8": ((a([1, 2], "f4"), 1.1), {"dtype": float}, "f8"),
    "complex as f8": ((a([1j]), 1.0), {"dtype": "f8"}, TYPE),
    "out": ((a([1.0, 2.0]), 1.0), {"out": np.zeros(2)}, "f8"),
    "out positional": ((a([1.0, 2.0]), 1.0, np.zeros(2)), {}, "f8"),
    "out f4": ((a([1.0, 2.0]), 1.0), {"out": np.zeros(2, "f4")}, "f4"),
    "out complex": ((a([1.0, 2.0]), 1.0), {"out": np.zeros(2, complex)}, "c16"),
    "out other endian": ((a([1.0, 2.0]), 1.0), {"out": np.zeros(2, ">f8")}, ">f8"),
    "out too small": ((a([1.0, 2.0]), 1.0), {"out": np.zeros(1)}, VALUE),
    "out no axes": ((1.0, 1.0), {"out": np.zeros(())}, "f8"),
    "where": ((a([1.0, 2.0, -1.0]), 1.0), {"out": np.zeros(3), "where": [True, True, False]}, "f8"),
    "where, more axes": ((a([1.0, 2.0]), 1.0), {"out": np.zeros((2, 2)), "where": [[True], [False]]}, "f8"),
    "where False": ((a([1.0, 2.0]), 1.0), {"out": np.zeros(2), "where": False}, "f8"),
}
"""Calls: the type of their results, or their error and how its message begins. None warns."""


@each_backend
def test_calls_are_those_of_a_ufunc(restitution):
    """Results have the type and the bits of the other backend; a given array is what is returned."""
    for name, (arguments, keywords, expected) in CALLS.items():
        first, second = copy.deepcopy([(arguments, keywords)] * 2)
        if isinstance(expected, tuple):
            for function in (restitution, NUMPY):
                with pytest.raises(expected[0]) as refused:
                    function(*arguments, **keywords)
                assert str(refused.value).startswith(expected[1]), name
            continue
        result, other = restitution(*first[0], **first[1]), NUMPY(*second[0], **second[1])
        assert result.dtype == expected, name
        assert same(result.real, other.real), name
        assert result is first[1].get("out", result), name
    assert type(restitution([1.0], 1)) is np.ndarray
    assert type(restitution(1, 2)) is np.float64


@pytest.fixture(params=[next(iter(BACKENDS)), next(reversed(BACKENDS))])
def public(request, monkeypatch):
    """`vp.restitution` by NumPy, and compiled for the best instructions."""
    monkeypatch.setattr(native, "_kernel", BACKENDS[request.param])
    return vp.restitution


NOTHING_BAD = np.ma.array([1.0, -2.0, 3.0], mask=[0, 1, 0])
MASKED = {
    "an array": ((NOTHING_BAD, 1.0), [0, 1, 0]),
    "both": ((NOTHING_BAD, np.ma.array([-1.0, 2.0, 3.0], mask=[1, 0, 0])), [1, 1, 0]),
    "broadcast": ((NOTHING_BAD, [[1.0], [2.0]]), [[0, 1, 0]] * 2),
    "float32": ((NOTHING_BAD.astype("f4"), 1.0), [0, 1, 0]),
    "nothing masked": ((np.ma.array([1.0, 2.0]), 1.0), [0, 0]),
}


def test_masked_arrays_stay_masked_and_what_they_hide_is_not_looked_at(public):
    for case, (arguments, mask) in MASKED.items():
        result = public(*arguments)
        shown = public(*(np.where(np.ma.getmaskarray(x), 7.0, x) for x in arguments))
        assert np.array_equal(result.mask, np.array(mask, bool))
        assert result.dtype == (np.float32 if case == "float32" else np.float64)
        np.testing.assert_allclose(result.compressed(), shown[~result.mask], rtol=1e-6 if case == "float32" else 0)


def test_masked_constants_and_outs(public):
    assert public(np.ma.masked, 1.0) is np.ma.masked
    out = np.full(3, 7.0)
    assert public(NOTHING_BAD, 1.0, out=out) is out
    assert list(out == 7) == [False, True, False]
    out = np.ma.array([7.0, 7.0, 7.0])
    assert public(NOTHING_BAD, 1.0, out=out, where=[True, True, False]) is out
    assert list(out.data == 7) == [False, True, True]
    assert list(out.mask) == [False, True, False]


REFUSED = "is .*: expected a number that double precision can hold"
BOOLS = (True, np.True_, [True, False], np.array([True]), np.ma.array([True], mask=[False]))


def test_integers_too_large_and_bools_are_refused(public):
    for speed in (10**400, -(10**400), 10**5000):
        with pytest.raises(ValueError, match=rf"^speed {REFUSED}$"):
            public(speed, 1.0)
    for place, bad in product((0, 1), BOOLS):
        with pytest.raises(TypeError, match=rf"^{('speed', 'beta')[place]} {REFUSED}, or an array"):
            public(*((bad, 1.0), (1.0, bad))[place])


DTYPES = [*"bBhHiIlLfd", ">f8", ">f4", ">i2", "f2"]


@st.composite
def arrays(draw, shape, dtype):
    """An array that may be strided, reversed, transposed, or unaligned."""
    dtype = np.dtype(dtype)
    elements = st.integers(0, 100) if dtype.kind in "iu" else st.floats(0, 64, width=16)
    whole = np.asarray(draw(hnp.arrays(dtype, tuple(2 * n for n in shape), elements=elements, fill=elements)), dtype)
    kind = draw(st.sampled_from(["plain", "stepped", "reversed", "fortran", "unaligned", "read-only"]))
    if kind == "stepped":
        return whole[(..., *(slice(None, None, 2) for _ in shape))]
    part = np.array(whole[tuple(slice(n) for n in shape)], dtype)
    if kind == "reversed":
        return part[(..., *(slice(None, None, -1) for _ in shape))]
    if kind == "fortran":
        return np.asfortranarray(part)
    if kind == "unaligned":
        raw = np.zeros(part.nbytes + 1, np.uint8)[1:].view(part.dtype).reshape(part.shape)
        raw[...] = part
        return raw
    part.flags.writeable = kind != "read-only"
    return part


@needs_extension
@settings(max_examples=150)
@given(st.data(), hnp.mutually_broadcastable_shapes(num_shapes=3, max_dims=3, max_side=5))
def test_all_shapes_types_and_strides(data, shapes):
    speed, beta, mask = (
        data.draw(arrays(shape, data.draw(st.sampled_from(kinds))))
        for shape, kinds in zip(shapes.input_shapes, (DTYPES, DTYPES, ["u1"]), strict=True)
    )
    keywords = {}
    if data.draw(st.booleans()):
        shape = np.broadcast_shapes(speed.shape, beta.shape)
        kind = data.draw(st.sampled_from(["f4", "f8", ">f8"]))
        keywords["out"] = np.zeros(tuple(2 * n for n in shape), kind)[(..., *(slice(None, None, 2) for _ in shape))]
        if np.broadcast_shapes(shape, mask.shape) == shape and data.draw(st.booleans()):
            keywords["where"] = mask % 2 == 0
    compiled = next(reversed(COMPILED.values()))
    first, second = (f(speed, beta, **copy.deepcopy(keywords)) for f in (compiled, NUMPY))
    assert np.array_equal(first, second)
    assert first.dtype == second.dtype


@each_backend
@pytest.mark.parametrize("dtype", FLOATS)
@pytest.mark.parametrize("beta_is_array", [False, True])
def test_out_may_overlap_the_arguments(restitution, dtype, beta_is_array):
    start = np.geomspace(1e-3, 1e3, 5000).astype(dtype)
    views = [slice(0, 4000), slice(1, 4001), slice(900, 4900), slice(3999, None, -1), slice(0, 4000)]
    for read in views:
        for write in views:
            memory = start.copy()
            speed = memory[read][:4000]
            beta = np.flip(memory)[write][:4000] if beta_is_array else dtype(1.3)
            expected = restitution(speed.copy(), np.copy(beta))
            out = memory[write][:4000]
            restitution(speed, beta, out=out)
            assert same(out.copy(), expected)


@each_backend
def test_in_place_with_where_keeps_the_rest(restitution):
    values = np.linspace(1, 2, 100)
    shifted = values.copy()
    mask = np.arange(99) % 3 == 0
    restitution(shifted[:-1], 1.0, out=shifted[1:], where=mask)
    assert same(shifted[1:], np.where(mask, restitution(values[:-1], 1.0), values[1:]))


@each_backend
def test_several_threads(restitution):
    speed = np.geomspace(1e-6, 1e6, 200_000)
    betas = np.linspace(0.5, 5, 8)
    alone = [restitution(speed, beta) for beta in betas]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda beta: restitution(speed, beta), betas))
    assert all(map(same, alone, together))


@each_backend
def test_has_the_docstring(restitution):
    assert native.DOC in restitution.__doc__


def test_pickled_by_name():
    for pickled in (pickle.dumps(vp.restitution), pickle.dumps([vp.restitution])):
        assert pickle.loads(pickled) in (vp.restitution, [vp.restitution])
    assert copy.deepcopy(vp.restitution) is vp.restitution
    assert pickle.loads(pickle.dumps(NUMPY)) is NUMPY


# --- which backend ----------------------------------------------------------------------------------------------------


def python(code, **environment):
    variables = {k: v for k, v in os.environ.items() if k != compiled.VARIABLE} | environment
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=variables)


SHOWN = "import viscopade as vp; print(vp.backend(), type(vp.restitution).__name__, vp.restitution(0.1, 1.307).hex())"


def test_the_environment_chooses():
    value = NUMPY(0.1, 1.307).hex()
    assert python(SHOWN, VISCOPADE_BACKEND="numpy").stdout.split() == ["numpy", "function", value]
    expected = ["compiled" if COMPILED else "numpy", "function", value]
    assert python(SHOWN).stdout.split() == python(SHOWN, VISCOPADE_BACKEND="").stdout.split() == expected


def test_a_bad_environment_is_refused():
    run = python(SHOWN, VISCOPADE_BACKEND="fortran")
    assert run.returncode == 1
    assert run.stderr.splitlines()[-1] == "ValueError: VISCOPADE_BACKEND is 'fortran': expected compiled or numpy"


def test_without_the_extension(monkeypatch):
    monkeypatch.setitem(sys.modules, "viscopade._native", None)
    monkeypatch.delattr("viscopade._native", raising=False)
    assert [compiled.load_extension(wanted) for wanted in (None, "", "numpy")] == [None] * 3
    with pytest.raises(ImportError, match="VISCOPADE_BACKEND is 'compiled', but the extension could not be loaded"):
        compiled.load_extension("compiled")


@needs_extension
def test_unknown_instructions_are_refused():
    with pytest.raises(ValueError, match="instructions are z80: expected one of instruction_sets"):
        native.compiled_restitution("z80")


def test_backend_is_what_runs():
    assert vp.backend() in compiled.BACKENDS
    assert (native._kernel is NUMPY) == (vp.backend() == "numpy")


def test_a_compiler_was_used_if_there_is_one():
    headers = Path(sysconfig.get_path("include"), "Python.h")
    if shutil.which("cc") is None or not headers.exists():
        pytest.skip("no C compiler, or Python's headers are missing")
    assert COMPILED, "the extension was not built: pip install --verbose says why"


def test_programs_are_loaded_when_numpy_needs_them():
    code = """
import sys, viscopade
def loaded():
    return bool({"flint", "viscopade.kernels.speed_table"} & {*sys.modules})
viscopade.restitution
before = loaded()
viscopade.restitution(1.0, 1.0)
print(viscopade.backend(), before, loaded())
"""
    assert python(code, VISCOPADE_BACKEND="numpy").stdout.split() == ["numpy", "False", "True"]
    if COMPILED:
        assert python(code).stdout.split() == ["compiled", "False", "False"]
