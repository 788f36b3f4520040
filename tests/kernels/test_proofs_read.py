"""Proofs read the expressions that code is written from: a formula that is changed is no longer proven."""

from fractions import Fraction
from functools import cache

import pytest

from viscopade.arithmetic.balls import interval_ball, working
from viscopade.arithmetic.formats import FLOAT
from viscopade.kernels import compact, formulas, full, speed_table
from viscopade.kernels.arithmetic import HOST
from viscopade.kernels.expressions import Call, Literal, Name, Statement
from viscopade.kernels.speed_table import HalfWords, LastPlace, Polynomials

ROW = 500
MORE = Literal("1.25")
ROUGH, LAST = Polynomials(4, -90, 1, FLOAT), speed_table.TABLES["full"]
BOUNDS = {
    "polynomials": (Polynomials, "sums", "p", lambda: ROUGH.bounds(ROW)["error"]),
    "last place": (LastPlace, "sums", "rest", lambda: LAST.bounds(ROW)["ulp"]),
    "panel": (full, "panel_sums", "rest", lambda: full.panel_bound(40, False)),
    "near 0": (full, "near_sums", "q", full._near_bound),
}


def changed(branch, name):
    """Return a branch with another formula for one of its variables."""
    program = tuple(Statement(s.name, s.expression * MORE if s.name == name else s.expression) for s in branch.program)
    assert program != branch.program
    return branch._replace(program=program)


@pytest.mark.parametrize("branch", BOUNDS)
def test_a_changed_table_has_another_bound(monkeypatch, branch):
    owner, formula, name, bound = BOUNDS[branch]
    with working(128):
        proven, sums = bound(), getattr(owner, formula)
        monkeypatch.setattr(owner, formula, lambda *given: changed(sums(*given), name))
        assert bound() > 10 * proven


def test_another_coefficient_of_a_half_word_has_another_bound(monkeypatch):
    table = speed_table.TABLES["1e-10"]
    proven, (unpacking,) = table.bounds(ROW)["error"], table.unpacking
    monkeypatch.setattr(HalfWords, "unpacking", (Statement(unpacking.name, unpacking.expression * MORE),))
    assert table.bounds(ROW)["error"] > 10 * proven


@pytest.mark.parametrize("name", ["eps", "restitution", "rebound", "dissipation"])
@pytest.mark.parametrize("layout", [ROUGH, LAST])
def test_a_table_with_other_results_is_refused(monkeypatch, layout, name):
    speed_table.check_results(layout)
    branch = layout.sums()
    if name in branch.results:
        other = branch._replace(results={**branch.results, name: branch.results[name] * MORE})
    else:
        other = changed(branch, name)
    monkeypatch.setattr(type(layout), "sums", lambda _: other)
    with pytest.raises(ArithmeticError, match="are not eps = base"):
        speed_table.check_results(layout)


def test_a_panel_with_other_results_is_refused(monkeypatch):
    full.check_panel_results()
    sums = full.panel_sums

    def other(loss):
        found = sums(loss)
        return found._replace(results={"result": -found.results["result"]})

    monkeypatch.setattr(full, "panel_sums", other)
    with pytest.raises(ArithmeticError, match="are not eps and 1 - eps"):
        full.check_panel_results()


@cache
def compact_kernel():
    powers = compact.compact_powers(Fraction(1, 1000))
    found = compact.compact_fit(powers)
    return powers, found.a, found.b


@pytest.mark.parametrize("name", ["elastic", "lost", *compact.MEANINGS])
def test_a_changed_compact_kernel_is_refused(monkeypatch, name):
    kernel = compact_kernel()
    body = compact.result_branch(kernel[0])
    compact.check_formula(*kernel)
    if name in compact.MEANINGS:
        other = body._replace(results=body.results | {name: body.results[name] * Literal("1.0000001")})
    else:
        other = changed(body, name)
    monkeypatch.setattr(compact, "result_branch", lambda *_: other)
    with pytest.raises(ArithmeticError, match=f"{name} of the program is not that of the proven formula"):
        compact.check_formula(*kernel)


@pytest.mark.parametrize("change", [lambda e: e * Literal("0.5"), lambda e: -e])
def test_a_changed_root_is_refused(monkeypatch, change):
    call = compact.root_of(Name("w"))
    monkeypatch.setattr(compact, "root_of", lambda _: Call("exp2", (change(call.arguments[0]),)))
    with working(128), pytest.raises(ArithmeticError, match="y of the program"):
        compact._error_of_y(HOST, interval_ball(Fraction(1, 2), Fraction(3, 4)))


def test_a_changed_w_is_refused(monkeypatch):
    square, w = formulas.w_program()
    monkeypatch.setattr(formulas, "w_program", lambda: (square, Statement("w", w.expression * Name("beta"))))
    with pytest.raises(ArithmeticError, match="w of the program"):
        compact.check_formula(*compact_kernel())


def test_a_sum_without_its_loss_is_refused(monkeypatch):
    """Exactly, the loss of the leading sum is 0; that it is added is seen with another sum in its place."""
    without, sums, rows = Name("head") + Name("rest"), full.panel_sums, LastPlace.sums
    monkeypatch.setattr(full, "panel_sums", lambda loss: sums(loss)._replace(results={"result": without}))
    with pytest.raises(ArithmeticError, match="are not eps"):
        full.check_panel_results()

    def other(layout):
        found = rows(layout)
        return found._replace(
            program=tuple(s._replace(expression=without) if s.name == "eps" else s for s in found.program)
        )

    monkeypatch.setattr(LastPlace, "sums", other)
    with pytest.raises(ArithmeticError, match="are not eps"):
        speed_table.check_results(LAST)
