"""MFiX: `des_en_input` of the collision models LSD and HERTZIAN.

Read in CurtinIDS/mfix at commit aa5da90:

- model/des/calc_force_dem.f: -(kn x + eta x'), which may pull; in HERTZIAN kn = k sqrt(x) and eta = c x^(1/4).
- `DES_ETAN` of check_solids_dem.f in model/check_data: 2 sqrt(kn m) |ln e|/sqrt(pi^2 + ln^2 e) in both models, in
  HERTZIAN with k for kn. Tsuji's damping with this ratio would have sqrt(5) for 2: HERTZIAN damps less.

The default, `des_intg_method = 'EULER'`, kicks and then drifts.
"""

from __future__ import annotations

from viscopade.simulators.formula import LINEAR_RETURN, TSUJI_RETURN, formulas, linear_kappa
from viscopade.simulators.simulator import Simulator

SIMULATOR = Simulator(
    "mfix",
    "MFiX",
    "CurtinIDS/mfix, commit aa5da90",
    formulas(
        "des_en_input",
        ("1e-15", "1"),
        "model/check_data/check_solids_dem.f",
        ("LSD", LINEAR_RETURN, linear_kappa, "exact"),
        ("HERTZIAN", TSUJI_RETURN, linear_kappa, "other law"),
    ),
)
