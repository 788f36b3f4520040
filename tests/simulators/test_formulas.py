"""Formulas of programs: the reason that each states is the one that the numbers show."""

import math
import subprocess
import sys

import pytest
from mpmath import mp

from viscopade.collision import exact
from viscopade.simulators import OWN_LAW, SIMULATORS, TARGETS, simulator_of, simulators
from viscopade.simulators.audit import ASKED, audit_formula
from viscopade.simulators.formula import DampingFormula
from viscopade.simulators.simulator import OwnLaw, Simulator
from viscopade.theory.law import Law

ROWS = [(program, formula) for program in simulators() for formula in program.formulas]
rows = pytest.mark.parametrize(("program", "formula"), ROWS, ids=lambda part: part.name)


@rows
def test_reasons_are_right(program, formula):
    found = audit_formula(program, formula, "0.5")
    error = math.inf if found.delivered is None else abs(float(found.delivered) / 0.5 - 1)
    assert (error < 1e-9) == (formula.reason == "exact") == (not found.reasons)
    if formula.reason == "other end":
        ends = {"force": "return", "return": "force"}
        other = Law(formula.law.elastic, formula.law.damping, ends[formula.law.end])
        assert float(
            exact.collision(kappa=formula.damping("0.5"), law=other, digits=12).mpf()["epsilon"]
        ) == pytest.approx(0.5, rel=1e-3)  # fits are so good


@rows
def test_what_is_written_instead_delivers_what_is_asked_for(program, formula):
    found = audit_formula(program, formula, "0.5")
    if found.instead is None:
        assert any("in its range gives it" in reason for reason in found.reasons)
    else:
        kappa = formula.kappa(mp.mpf(found.instead))
        assert float(formula.contact_epsilon(kappa)) == pytest.approx(0.5, rel=1e-9)


def test_the_list_has_what_the_modules_say():
    assert [(each.name, tuple(each.texts)) for each in simulators()] == [*SIMULATORS.items()]
    assert len({*TARGETS}) == len(TARGETS)
    texts = {target: text for each in simulators() for target, text in each.texts.items()}
    assert [target for target in TARGETS if isinstance(texts[target], OwnLaw)] == [*OWN_LAW]


def test_a_refusal_of_an_option_reads_no_program():
    """Each has a module, which imports others."""
    code = (
        "import sys; from viscopade.cli.main import command\n"
        "try: command(['simulators', 'lammps', '--stiffness', '1'], standalone_mode=False)\n"
        "except Exception as error: print(error.message, [m for m in sys.modules if 'simulators.' in m])"
    )
    printed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert printed == "--stiffness is given for lammps: expected mujoco, drake, simbody, chrono, jaxdem []\n"


def test_names_are_unique():
    one = simulator_of("lammps")
    with pytest.raises(ValueError, match="two formulas"):
        Simulator("x", "X", "1", (one.formulas[0], one.formulas[0]))
    with pytest.raises(ValueError, match="reason is 'luck'"):
        DampingFormula("f", Law(1, 0), "e", lambda e: e, ("0", "1"), "luck", "a file")


def test_unknown_programs_are_refused():
    with pytest.raises(ValueError, match="program is 'x': expected lammps"):
        simulator_of("x")


def test_a_time_step_adds_its_part():
    program = simulator_of("lammps")
    found = audit_formula(program, program.formulas[0], "0.5", 0.02)
    assert found.stepped is not None
    assert found.stepped.epsilon < 0.5 < found.instead
    assert found.reasons == (f"The time step adds {found.stepped.epsilon - 0.5:+.2g} on average.",)


def test_a_step_at_which_nothing_delivers_the_eps_still_gets_advice():
    program = simulator_of("mercurydpm")
    found = audit_formula(program, program.formulas[0], "0.5", 1.0, 0.01)
    assert found.instead is None
    assert "expected" in found.reasons[-1]
    assert 0 < found.advice.largest_step < 0.1


def test_lammps_tsuji_before_its_square_root_of_two():
    """The 0.61 that people get who ask for 0.5."""
    program = simulator_of("lammps")
    formula = next(each for each in program.formulas if each.name == "hertz, tsuji")
    assert [round(float(audit_formula(program, formula, asked).delivered), 2) for asked in ASKED[2:3]] == [0.62]
