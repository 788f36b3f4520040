"""Proofs read the expressions that code is written from: a formula that is changed is no longer proven."""

from fractions import Fraction
from functools import cache

import pytest

from viscopade.arithmetic.formats import FLOAT
from viscopade.kernels import compact, formulas
from viscopade.kernels.arithmetic import HOST
from viscopade.kernels.expressions import Call, Literal, Name, Select, Statement
from viscopade.kernels.forms import last_place, speed_table
from viscopade.kernels.forms.speed_table import Table
from viscopade.kernels.forms.speed_table_last_place import LastPlaceTable

ROW = 500
MORE = Literal("1.25")
BOUNDS = {
    "table_row_branch": ("p", lambda: Table(4, -90, 1, FLOAT).bounds(ROW).error),
    "full_row_branch": ("rest", lambda: LastPlaceTable().bounds(ROW).ulp),
    "full_panel_branch": ("rest", lambda: last_place._panel_bound(40, False)),
    "full_near_branch": ("q", last_place._near_bound),
}


def changed(branch, name):
    """Return a branch with another formula for one of its variables."""
    program = tuple(Statement(s.name, s.expression * MORE if s.name == name else s.expression) for s in branch.program)
    assert program != branch.program
    return branch._replace(program=program)


@pytest.mark.parametrize("branch", BOUNDS)
def test_a_changed_table_has_another_bound(monkeypatch, branch):
    name, bound = BOUNDS[branch]
    with last_place.working(last_place._BITS):
        proven, formula = bound(), getattr(formulas, branch)
        monkeypatch.setattr(formulas, branch, lambda *given: changed(formula(*given), name))
        assert bound() > 10 * proven


@pytest.mark.parametrize("name", ["eps", "restitution", "rebound", "dissipation"])
@pytest.mark.parametrize("table", [Table(4, -90, 1, FLOAT), LastPlaceTable()])
def test_a_table_with_other_results_is_refused(monkeypatch, table, name):
    speed_table.check_row_results(table)
    branch = table.sums(table.names)
    if name in branch.results:
        other = branch._replace(results={**branch.results, name: branch.results[name] * MORE})
    else:
        other = changed(branch, name)
    monkeypatch.setattr(type(table), "sums", lambda *_: other)
    with pytest.raises(ArithmeticError, match="are not eps = base"):
        speed_table.check_row_results(table)


def test_a_panel_with_other_results_is_refused(monkeypatch):
    last_place.check_panel_results()
    formula = formulas.full_panel_branch

    def other(names):
        found = formula(names)
        return found._replace(results={"result": -found.results["result"]})

    monkeypatch.setattr(formulas, "full_panel_branch", other)
    with pytest.raises(ArithmeticError, match="are not eps and 1 - eps"):
        last_place.check_panel_results()


@cache
def compact_kernel():
    powers = compact.compact_powers(Fraction(1, 1000), "both")
    variant = compact.compact_fit(powers, "both").variants[0]
    return powers, variant.a, variant.b


@pytest.mark.parametrize("name", ["elastic", "lost", *compact.MEANINGS])
def test_a_changed_compact_kernel_is_refused(monkeypatch, name):
    kernel = compact_kernel()
    body = compact.body(kernel[0])
    compact.check_formula(*kernel)
    if name in compact.MEANINGS:
        other = body._replace(results=body.results | {name: body.results[name] * Literal("1.0000001")})
    else:
        other = changed(body, name)
    monkeypatch.setattr(compact, "body", lambda *_: other)
    with pytest.raises(ArithmeticError, match=f"{name} of the program is not that of the proven formula"):
        compact.check_formula(*kernel)


@pytest.mark.parametrize("change", [lambda e: e * Literal("0.5"), lambda e: -e])
def test_a_changed_root_is_refused(monkeypatch, change):
    call = compact.root_of(Name("w"))
    monkeypatch.setattr(compact, "root_of", lambda _: Call("exp2", (change(call.arguments[0]),)))
    with last_place.working(128), pytest.raises(ArithmeticError, match="y of the program"):
        compact._error_of_y(HOST, Fraction(1, 2), Fraction(3, 4))


def test_a_changed_w_is_refused(monkeypatch):
    square, w = formulas.w_program()
    monkeypatch.setattr(formulas, "w_program", lambda: (square, Statement("w", w.expression * Name("beta"))))
    with pytest.raises(ArithmeticError, match="w of the program"):
        compact.check_formula(*compact_kernel())


@pytest.mark.parametrize(("branch", "name"), [("full_row_branch", "eps"), ("full_panel_branch", "result")])
def test_a_sum_without_its_loss_is_refused(monkeypatch, branch, name):
    """Exactly, the loss of the leading sum is 0; that it is added is seen with another sum in its place."""
    formula = getattr(formulas, branch)

    def other(*given):
        found = formula(*given)
        if name == "result":
            loss = Select(Name("loss"), -Name("rest"), Name("rest"))
            return found._replace(results={"result": Name("head") + loss})
        program = (
            Statement(s.name, Name("head") + Name("rest") if s.name == name else s.expression) for s in found.program
        )
        return found._replace(program=tuple(program))

    monkeypatch.setattr(formulas, branch, other)
    with pytest.raises(ArithmeticError, match="are not eps"):
        last_place.check_panel_results() if name == "result" else speed_table.check_row_results(LastPlaceTable())
