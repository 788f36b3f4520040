"""Functions from the materials, radii and masses of two bodies to beta, which C headers have besides their kernels.

They are those of `viscopade.Pair`, as expressions; `kernels.write` writes them in C. Their errors are not proven.
"""

from __future__ import annotations

from functools import cache

from viscopade.arithmetic.formats import DOUBLE, FLOAT
from viscopade.kernels import formulas
from viscopade.kernels.expressions import CodeBranch
from viscopade.kernels.kernel import Function, Kernel

NOT_PROVEN = " Not proven."
"""The sentence after each function's meaning."""


@cache
def material_kernel() -> Kernel:
    """Return E_eff, R_eff, m_eff, rho and beta of a pair as a kernel without bounds, in types double and float."""

    def function(name: str, arguments: str, meaning: str, branch: CodeBranch) -> Function:
        """Return a function of the kernel, whose arguments are separated by blanks; NaN outside of the branch."""
        (result,) = branch.results
        return Function(name, tuple(arguments.split()), meaning, None, (), (branch,), result)

    functions = (
        function(
            "effective_modulus",
            "E1 nu1 E2 nu2",
            "E_eff of a pair with Young moduli E and Poisson ratios nu, -1 < nu <= 1/2; infinite E of a rigid body",
            formulas.effective_modulus_branch(),
        ),
        function(
            "effective_radius",
            "R1 R2",
            "R_eff of a pair with radii R; INFINITY is that of a wall",
            formulas.reduced_branch("R1", "R2", "R_eff"),
        ),
        function(
            "effective_mass",
            "m1 m2",
            "m_eff of a pair with masses m; INFINITY is that of a wall",
            formulas.reduced_branch("m1", "m2", "m_eff"),
        ),
        function("rho", "E_eff R_eff", "rho = 4/3 E_eff sqrt(R_eff)", formulas.rho_branch()),
        function(
            "beta",
            "A rho m_eff",
            "beta = 3/2 A (rho/m_eff)^(2/5) with the dissipative constant A; pow is taken to be within 4 ulp",
            formulas.beta_of_material_branch(),
        ),
    )
    return Kernel(
        "material", "material", "material", "those of Hertz and of the paper", "the paper", "positive",
        functions, {DOUBLE.name: {}, FLOAT.name: {}},
    )  # fmt: skip
