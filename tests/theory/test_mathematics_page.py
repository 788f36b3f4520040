"""The page docs/theory/mathematics.md: each formula names its derivation, and the numbers are those of the package."""

import re
from itertools import pairwise
from pathlib import Path

import pytest
import sympy as sp

from viscopade.collision import exact
from viscopade.theory import symbolic
from viscopade.theory.series import series

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "theory" / "mathematics.md").read_text("utf-8")
LINK = re.compile(r"\[D(\d\d)\]\(\.\./\.\./derivations/(\S+?)\)")


def test_every_derivation_is_named():
    named = {name for _, name in LINK.findall(PAGE)}
    assert named == {path.name for path in (ROOT / "derivations").glob("[0-9]*.py")}
    assert all(name.startswith(f"{number}_") for number, name in LINK.findall(PAGE))


def test_every_formula_names_a_derivation():
    """In the text between it and the formulas before and after it."""
    text = re.split(r"\$\$.*?\$\$", PAGE, flags=re.DOTALL)
    assert re.findall(r"\\tag\{(\d+)\}", PAGE) == [str(n) for n in range(1, len(text))]
    assert [n for n, both in enumerate(pairwise(text), 1) if not LINK.search("".join(both))] == []


def test_coefficients_of_the_table():
    decimals = series(13, 15).decimals()
    for k in (2, 4, 5, 6, 7, 8, 9, 11, 13):
        assert f"| {k} | ${sp.latex(symbolic.h_polynomial(k))}$ | {decimals[k]} |" in PAGE


@pytest.mark.parametrize("v_star", [5, 10, 100, 1000])
def test_epsilon_of_the_table(v_star):
    assert f"| {v_star} | {float(exact.epsilon(v_star, 20)):.10g} |" in PAGE
