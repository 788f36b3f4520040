"""Cells of tables as LaTeX: formulas where there are symbols and numbers, and nothing that stops LaTeX."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.mathtext import MathTextParser

from viscopade.cli.latex import latex_cell

FORMULA = re.compile(r"(?<!\\)\$[^$]*\$")


@pytest.mark.parametrize(
    ("cell", "expected"),
    [
        ("k", "$k$"),
        ("h_k", "$h_k$"),
        ("a_10", "$a_{10}$"),
        ("v_star", "$v_*$"),
        ("epsilon", r"$\varepsilon$"),
        ("one_minus_epsilon", r"$1-\varepsilon$"),
        ("x_max", r"$x_{\max}$"),
        ("tau_c", r"$\tau_c$"),
        ("beta", r"$\beta$"),
        ("m_eff", r"$m_{\mathrm{eff}}$"),
        ("[m/n]", "$[m/n]$"),
        ("of 1 - eps^2", r"of $1-\varepsilon^2$"),
        ("|d eps|/(1-eps)", r"$|d\varepsilon|$/$(1-\varepsilon)$"),
        ("v*^2 = beta v^(1/5)", r"$v_*^2$ = $\beta$ $v^{1/5}$"),
        ("beta in (s/cm)^(1/5)", r"$\beta$ in (s/cm)$^{1/5}$"),
        ("usable for all v* >= 0:", r"usable for all $v_*$ $\geq$ 0:"),
        ("-1.5", "$-1.5$"),
        ("+4.16e-04", r"$+4.16\times10^{-4}$"),
        ("8e-08", r"$8\times10^{-8}$"),
        ("S_20 = -1.2e+04,", r"$S_{20}$ = $-1.2\times10^{4}$,"),
        ("1e5^2", r"1e5\textasciicircum{}2"),  # two powers are none
        # What is a number, a word or a name as it is.
        ("1.53", "1.53"),
        ("8,192", "8,192"),
        ("2-5-for-small-v", "2-5-for-small-v"),
        ("eps-universal", "eps-universal"),
        ("a constant", "a constant"),
        ("to m_eff_x", r"to m\_eff\_x"),
        ("50 % & more", r"50 \% \& more"),
        ("[3/6]", "{}[3/6]"),
        ("*", "{}*"),
    ],
)
def test_a_cell(cell, expected):
    assert latex_cell(cell) == expected


@given(st.text("ahv*eps_^0123.-+()[]<>|$&%#{}~\\ /", max_size=12))
def test_nothing_stops_latex(cell):
    text = latex_cell(cell)
    parser = MathTextParser("path")
    for formula in FORMULA.findall(text):
        parser.parse(formula)  # Matplotlib knows the mathematics of TeX
    rest = re.sub(r"\\(text\w+|.)|\{\}", "", FORMULA.sub("", text))
    assert not set(rest) & set("&%$#_{}~^\\")
