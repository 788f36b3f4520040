"""The catalogue of ready kernels: keys, requests, names in exported files, bounds, records."""

from fractions import Fraction
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from viscopade import store
from viscopade.arithmetic.formats import FORMATS
from viscopade.arrays import double
from viscopade.kernels import catalogue, machine
from viscopade.kernels.catalogue import CATALOGUE

EVERY = pytest.mark.parametrize("entry", CATALOGUE.values(), ids=CATALOGUE)
FORWARD = [entry for entry in CATALOGUE.values() if entry.group != "inverse"]
COMPACT = [entry.kernel for entry in catalogue.group("compact")]


def test_keys_and_names_are_those_of_one_kernel() -> None:
    assert all(entry.key == key for key, entry in CATALOGUE.items())
    names = [(entry.kernel.argument, entry.kernel.name) for entry in CATALOGUE.values()]
    assert len(set(names)) == len(names)
    with pytest.raises(ValueError, match="the kernel asked for is 'compact 1e-4': expected pade 0/3, "):
        catalogue.kernel("compact 1e-4")


OUTSIDE = {"epsilon": (0.0, 1.5), "one_minus_epsilon": (1.0, 1.5), "speed": (), "beta": (), "v_star": ()}


@EVERY
def test_outside_the_domain_there_is_nan_and_inside_none(entry) -> None:
    """Test vectors take NaN where the program has it: that it has it where it should is seen here."""
    for form, function in product(map(FORMATS.get, entry.kernel.formats), entry.kernel.functions):
        usual = [0.5] * len(function.arguments)
        assert np.isfinite(machine.function_values(entry.kernel, function.name, *usual, form=form))
        for place, name in enumerate(function.arguments):
            for bad in (-1.0, -np.inf, np.nan, *OUTSIDE[name]):
                given = [bad if i == place else x for i, x in enumerate(usual)]
                assert np.isnan(machine.function_values(entry.kernel, function.name, *given, form=form)), (
                    function,
                    given,
                )
    if entry.group == "compact":
        with np.errstate(all="raise"):
            found = machine.function_values(entry.kernel, "restitution", [0.0, 1.0, 0.0], [1.0, 0.0, 0.0])
        assert (found == 1).all()


@EVERY
def test_every_function_has_a_bound_in_every_format_on_the_host(entry) -> None:
    for form in entry.kernel.formats:
        for function in entry.kernel.functions:
            assert entry.kernel.bound(function.name, "host", form)
        for name, value in entry.kernel.constants[form].items():
            assert FORMATS[form].rounded(Fraction(value)) == value, name
    there = {(function.name, form) for function in entry.kernel.functions for form in entry.kernel.formats}
    assert {(bound.result, bound.arithmetic.form.name) for bound in entry.kernel.bounds} == there


@pytest.mark.parametrize("entry", FORWARD, ids=lambda entry: entry.key)
def test_formulas_are_as_far_off_as_the_bounds_say(entry) -> None:
    """In double, of eps: nearly the whole bound is used somewhere, and nowhere more."""
    kernel = entry.kernel
    name = "epsilon" if kernel.argument == "v_star" else "restitution"
    most = 0.0
    for bound in kernel.bound(name, "host", "double"):
        ends = max(float(bound.low), 1e-4), min(float(bound.high), 1e4)
        v_star = np.geomspace(*ends, 20001)[1:-1]
        given = (v_star,) if name == "epsilon" else (v_star**10, 1.0)
        eps, loss = double.epsilon(v_star), double.one_minus_epsilon(v_star)
        off = np.abs(machine.function_values(kernel, name, *given) - eps)
        off -= 1e-14 * np.minimum(eps, loss) + np.spacing(eps)  # of w and double
        allowed = float(bound.relative) * (np.minimum(eps, loss) if bound.relative_to == "smaller" else eps)
        allowed += float(bound.last) * eps + float(bound.ulps) * np.spacing(eps)
        assert (off <= allowed).all()
        most = max(most, (off / allowed).max())
    assert most > (0.65 if kernel.tables else 0.9) or entry.key in ("full", "speed full")


@pytest.mark.parametrize("form", FORMATS.values(), ids=FORMATS)
def test_compact_kernels_cover_where_w_is_normal_and_not_cut_off(form) -> None:
    cut = {"float": 120, "double": 900}[form.name]
    for kernel in COMPACT:
        for bound in kernel.bound("restitution", "host", form.name)[-1:]:
            assert form.least < bound.low**10 < form.least * 2
            assert Fraction(2) ** (cut - 1) < Fraction(bound.high) ** 10 < Fraction(2) ** cut


OPERATIONS = {
    "minimax 1e-5 v5": {"+": 10, "*": 10, "/": 1},
    "compact 1e-3": {"+": 5, "*": 15, ">": 3, "divide": 1, "log2": 1, "exp2": 1},
    "inverse 1e-3": {"+": 3, "-": 1, "*": 10, "/": 2, "pow": 1},
}


@pytest.mark.parametrize("key", OPERATIONS)
def test_operations_are_counted_with_divisions_powers_and_roots_apart(key) -> None:
    assert catalogue.kernel(key).functions[0].operations() == OPERATIONS[key]


@pytest.mark.slow
def test_all_records_are_what_is_made() -> None:
    """As `make reproduce` says too; every record belongs to a kernel of the catalogue."""
    with store.fresh_records() as records:
        for entry in CATALOGUE.values():
            entry.request.kernels()
    folder = Path(store.__file__).parent / store.FOLDER
    others = ("curve_tables-", "weight_table")  # tests/collision/test_curve.py, tests/fitting/test_weight_table.py
    assert records == {path.name: path.read_text() for path in folder.iterdir() if not path.name.startswith(others)}
