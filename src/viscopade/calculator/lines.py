"""What the calculator's page writes for each simulator: a line or two in the program's words, in SI units.

`viscopade simulators` writes whole files, with comments, errors and time steps. The page has those parts of them that
follow from a few numbers; of the other programs it has the command only. Tests compare its numbers with the files'.
"""

from __future__ import annotations

from typing import Any

from mpmath import mp

from viscopade.audit.programs import program_of
from viscopade.simulators import SOFT, TARGETS, lammps
from viscopade.simulators.soft_text import PROGRAMS

_LAMMPS_WALL = f'fix wall all wall/gran granular {lammps.STYLE} zplane 0.0 NULL  # for "zplane 0.0 NULL" put your wall'
_TEXTS = {
    "lammps": {"pair": f"pair_coeff 1 1 {lammps.STYLE}", "wall": _LAMMPS_WALL},
    "yade": {
        "pair": "FrictMat(young={young}, poisson={poisson}, density={density}, frictionAngle=0)\n"
        "Ip2_FrictMat_FrictMat_MindlinPhys(en={en}, vn={speed})  # versions after 2023.02a"
    },
    "mercurydpm": {
        "pair": "HertzianBSHPViscoelasticSpecies species;\n"
        "species.setDensity({density});\n"
        "species.setEffectiveElasticModulus({E_eff});\n"
        "species.setDissipation({A});"
    },
    "mujoco": {"any": '<geom solref="-{stiffness} -{parameter}" solimp="0.9 0.9 0.001"/>'},
    "drake": {"any": "AddContactMaterial(dissipation={parameter}, properties=properties)  # exact at {speed} m/s"},
    "simbody": {"any": "force.setDissipation({parameter})  # exact at {speed} m/s"},
    "chrono": {"any": "material->SetRestitution({parameter}f);"},
    "jaxdem": {"any": 'Material.create("elasticfrict", e={parameter}, …)'},
}
"""By program: for a pair of like spheres (LAMMPS: of any two materials), for a wall, or for whatever has this eps."""


def programs() -> list[dict[str, Any]]:
    """Return name, title and texts of each program; of a soft one its law, and its parameter in terms of kappa."""
    found = []
    for name in (*TARGETS, *SOFT):
        program: dict[str, Any] = {"name": name, "title": _title(name), "texts": _TEXTS.get(name, {})}
        program["walls"] = not name.startswith("rebound")  # `viscopade.simulators.rebound` needs two spheres
        if name in SOFT:
            formula = PROGRAMS[name].formula_of(name)
            law = {"elastic": str(formula.law.elastic), "damping": str(formula.law.damping), "end": formula.law.end}
            program |= {"law": law, "kappa": _kappa(name)}
        found.append(program)
    return found


def _title(name: str) -> str:
    program, _, interface = name.partition("-")
    return program_of(program).title + (f" ({interface.title()})" if interface else "")


def _kappa(name: str) -> dict[str, Any]:
    """Return the kappa that the program makes of its parameter: a multiple of it, or of eps's handbook damping ratio.

    The ratio is -ln e/sqrt(pi^2 + ln^2 e), which is 1/sqrt(2) for e = exp(-pi).
    """
    kappa, restitution = PROGRAMS[name].formula_of(name).kappa, name in ("chrono", "jaxdem")
    factor = kappa(mp.exp(-mp.pi)) * mp.sqrt(2) if restitution else kappa(mp.mpf(1))
    per = {"mujoco": "root of stiffness", "chrono": "", "jaxdem": ""}.get(name, "speed")
    return {"factor": float(factor), "restitution": restitution, "per": per}
