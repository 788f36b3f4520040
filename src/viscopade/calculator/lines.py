"""The calculator's lines for each simulator: one or two in the program's syntax, in SI units.

`viscopade simulators` writes whole files, with comments, errors and time steps. The page has the parts that follow from
a few numbers; for the other programs it has only the command. Tests compare its numbers with those of the files.
"""

from __future__ import annotations

from typing import Any

from mpmath import mp

from viscopade.simulators import TARGETS, simulator_with
from viscopade.simulators.formula import DampingFormula, identity
from viscopade.simulators.simulator import OwnLaw


def programs() -> list[dict[str, Any]]:
    """Return name, title, texts and default time step of each program.

    A soft one also has its law, and its parameter in terms of kappa.
    """
    entries = []
    for target in TARGETS:
        # A target is the name of a program, or of one of its interfaces, such as "rebound-c".
        simulator = simulator_with(target)
        interface = target.removeprefix(simulator.name).removeprefix("-")
        program: dict[str, Any] = {
            "name": target,
            "title": simulator.title + (f" ({interface.title()})" if interface else ""),
            "texts": dict(simulator.lines),
            "walls": simulator.walls,
            "step": simulator.default_step,
        }
        # A program with soft contacts solves an equation with a law; kappa follows from its own parameter.
        text = simulator.texts[target]
        if isinstance(text, OwnLaw):
            formula = simulator.formula(text.formula)
            law = {"elastic": str(formula.law.elastic), "damping": str(formula.law.damping), "end": formula.law.end}
            program |= {"law": law, "kappa": _kappa(formula, text)}
        entries.append(program)
    return entries


def _kappa(formula: DampingFormula, text: OwnLaw) -> dict[str, Any]:
    """Return the factor from the program's parameter, or from the handbook damping ratio of its eps, to kappa.

    The ratio is -ln e/sqrt(pi^2 + ln^2 e), which is 1/sqrt(2) for e = exp(-pi).
    """
    # For a damping ratio of 1/sqrt(2), kappa is formula.kappa(exp(-pi)): so the factor is sqrt(2) times that.
    restitution = formula.usual_parameter is identity
    factor = formula.kappa(mp.exp(-mp.pi)) * mp.sqrt(2) if restitution else formula.kappa(mp.mpf(1))
    per = "root of stiffness" if text.per_mass else "speed" if text.per_speed else ""
    return {"factor": float(factor), "restitution": restitution, "per": per}
