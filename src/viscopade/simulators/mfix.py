"""MFiX: `des_en_input` of the collision models LSD and HERTZIAN.

    DES_COLL_MODEL = 'HERTZIAN'
    E_YOUNG(1) = 1.0d6    V_POISSON(1) = 0.3    DES_EN_INPUT = 0.9

Read in CurtinIDS/mfix at commit aa5da90:

- model/des/calc_force_dem.f: -(kn x + eta x'), which may pull; in HERTZIAN kn = k sqrt(x) and eta = c x^(1/4).
  calc_collision_wall_mod.f has the same for walls, with KN_W, DES_EN_WALL_INPUT, EW_YOUNG and VW_POISSON.
- `DES_ETAN` of check_solids_dem.f in model/check_data: 2 sqrt(kn m) |ln e|/sqrt(pi^2 + ln^2 e) in both models, in
  HERTZIAN with k = 4/3 E_eff sqrt(R_eff) for kn. Tsuji's damping with this ratio would have sqrt(5) for 2: HERTZIAN
  damps less. m is the effective mass, at a wall the particle's; an eps belongs to a pair of phases.
- The time step is `TCOLL/50`: 1/50 of the shortest contact of the linear model between particles.
- `CFNEWVALUES` of cfnewvalues.f: the default, `DES_INTG_METHOD = 'EULER'`, kicks and then drifts. 'ADAMS_BASHFORTH'
  takes the acceleration of the step before, too, and is not computed here.
"""

from __future__ import annotations

import math

from viscopade.collision.schemes import SEMI_IMPLICIT
from viscopade.simulators import native
from viscopade.simulators.formula import LINEAR_RETURN, TSUJI_RETURN, formulas, linear_kappa
from viscopade.simulators.simulator import Simulator

_SOURCE, _LEAST = "model/check_data/check_solids_dem.f", "1e-15"  # the least eps of the audit: ln 0 is no damping
# Names of the units of length, mass and time, and the size of the first two in m and kg.
_UNITS = {"SI": native.FileUnits(), "CGS": native.FileUnits("cm", "g", "s", 1e-2, 1e-3)}


def _force(values: native.Values, impact: native.Impact) -> native.Power:
    """Return the force k x^a + c x^b v of a collision model between two phases, or of one and a wall.

    `values` are the numbers of the user's file by their names, in SI units or CGS units, pairs where both phases have
    one. `impact` has the effective mass and radius, in the same units.
    """
    model, mass, wall = values["DES_COLL_MODEL"], impact.effective_mass, values["other"] == "wall"
    formula, e = SIMULATOR.formula(model), values[_damping(values)]
    # c = kappa sqrt(k m), with the kappa that the formula makes of e.
    if model == "LSD":
        return native.power_force(formula, e, values["KN_W" if wall else "KN"], mass)
    young, poisson = (
        (values.single(name, "as the other one is that of the wall"), values[of_wall]) if wall else values[name]
        for name, of_wall in (("E_YOUNG", "EW_YOUNG"), ("V_POISSON", "VW_POISSON"))
    )
    # HERTZIAN: k = 4/3 E_eff sqrt(R_eff)
    modulus = native.effective_modulus(values, young, poisson, "CHECK_SOLIDS_DEM_COLL_HERTZ")
    return native.power_force(formula, e, 4 / 3 * modulus * math.sqrt(impact.effective_radius), mass)


def _damping(values: native.Values) -> str:
    """Return the parameter that is the eps of the contact, of two particles or at a wall."""
    return "DES_EN_WALL_INPUT" if values["other"] == "wall" else "DES_EN_INPUT"


_NATIVE = native.Native(
    (
        native.Parameter("UNITS", words=tuple(_UNITS)),
        native.Parameter("DES_COLL_MODEL", default="LSD", words=("LSD", "HERTZIAN")),
        native.Parameter("other", default="particle", words=("particle", "wall")),
        *(native.positive(name, "") for name in ("KN", "KN_W")),
        *(native.restitution(name) for name in ("DES_EN_INPUT", "DES_EN_WALL_INPUT")),
        native.positive("E_YOUNG", "", per_body=True),
        native.positive("EW_YOUNG", ""),
        native.poisson_ratios("V_POISSON"),
        native.poisson_ratios("VW_POISSON", per_body=False),
    ),
    _force,
    _SOURCE,
    schemes={"EULER": SEMI_IMPLICIT},
    integrator="DES_INTG_METHOD",
    damping=_damping,
    units=lambda values: _UNITS[values["UNITS"]],
)

SIMULATOR = Simulator(
    "mfix",
    "MFiX",
    "CurtinIDS/mfix, commit aa5da90",
    formulas(
        "des_en_input",
        (_LEAST, "1"),
        _SOURCE,
        ("LSD", LINEAR_RETURN, linear_kappa, "exact"),
        ("HERTZIAN", TSUJI_RETURN, linear_kappa, "other law"),
    ),
    native=_NATIVE,
)
