"""Imports point downward only, and importing the package stays cheap."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

SOURCE = Path(__file__).parents[1] / "src" / "viscopade"

# Design section 3, foundations first: a module imports only from those before it. What is not in the design's list
# (checks, progress, balls, wiener, exports, writer) stands where it is used from; CHANGELOG.md says why it exists.
ORDER = (
    "checks",
    "document",
    "progress",
    "balls",
    "chebyshev",
    "arrays",
    "compensated",
    "ufunc",
    "double",
    "fallback",
    "native",
    "model",
    "gas",
    "perturbation",
    "wiener",
    "series",
    "pade",
    "flow",
    "enclosure",
    "exact",
    "expansions",
    "family",
    "reference",
    "curve",
    "certificate",
    "kernels.binary",
    "lookup",
    "lookup_full",
    "rounding",
    "remez",
    "minimax",
    "gapped",
    "formulas",
    "halfline",
    "inverse",
    "program",
    "evaluation",
    "compact",
    "singularity",
    "convergence",
    "paper",
    "claims.evidence",
    "claims.curve",
    "claims.motion",
    "claims.series",
    "claims.asymptotics",
    "claims.pade",
    "claims.physics",
    "claims",
    "kernels",
    "double_table",
    "frontier",
    "figures",
    "full",
    "restitution_table",
    "kernels.full",
    "kernels.minimax",
    "kernels.v_star",
    "kernels.gapped",
    "kernels.compact",
    "kernels.c",
    "kernels.python",
    "kernels.tables",
    "proofs",
    "proofs_gapped",
    "kernels.speed",
    "catalogue",
    "tabulated",
    "exports",
    "bench.kernel",
    "bench.compilers",
    "bench.scene",
    "bench.sources",
    "bench.measured",
    "bench.stated",
    "bench.ours",
    "bench.rivals",
    "bench.harness",
    "bench.calls",
    "bench.targets",
    "bench.tables",
    "bench",
    "report.result",
    "report.choice",
    "report.labels",
    "report.picture",
    "report.page",
    "report",
    "simulators.setup",
    "simulators.lammps",
    "simulators.stated",
    "simulators.tsuji",
    "simulators.rebound",
    "simulators.mercurydpm",
    "simulators.yade",
    "simulators.liggghts",
    "simulators",
    "scene.description",
    "scene.quantity",
    "scene.read",
    "scene.encounter",
    "scene.sense",
    "scene.units",
    "scene.tolerance",
    "scene.cost",
    "scene.candidate",
    "scene.choice",
    "scene.render",
    "scene.runners",
    "scene.shaders",
    "scene.check",
    "scene.tables",
    "scene",
    "figures_gas",
    "writer",
    "latex",
    "console",
    "hardcases.finding",
    "hardcases.truncated_series",
    "hardcases.pade_systems",
    "hardcases.data_precision",
    "hardcases.printed_digits",
    "hardcases.machine",
    "hardcases.exported",
    "hardcases.kernel_rounding",
    "hardcases.overflow",
    "hardcases.near_elastic",
    "hardcases.extremes",
    "hardcases.double_trips",
    "hardcases.material_trips",
    "hardcases.compiled_text",
    "hardcases.tables_read_back",
    "hardcases.round_trips",
    "hardcases.always",
    "hardcases.streams",
    "hardcases.inputs",
    "hardcases.trial",
    "hardcases.hostile_input",
    "hardcases.interruption",
    "hardcases.interrupted_writes",
    "hardcases.compilers",
    "hardcases.million",
    "hardcases.processors",
    "hardcases.environments",
    "hardcases",
    "hardcases.picture",
    "hardcases.page",
    "cli",
)
# All but the first two do so in temporary directories only: they hand sources to compilers, or are the hard cases that
# attack the writer and the command line.
TOUCH_FILES = {"cli", "writer", "bench.compilers", "scene.runners"} | {
    f"hardcases.{name}"
    for name in (
        "trial",
        "hostile_input",
        "interruption",
        "interrupted_writes",
        "compilers",
        "processors",
        "streams",
        "environments",
    )
}


def name_of(path: Path) -> str:
    return ".".join(path.relative_to(SOURCE).with_suffix("").parts).removesuffix(".__init__")


MODULES = {name_of(path): path for path in SOURCE.rglob("*.py")}
FRAME = {"__init__", "__main__"}


def imported(path: Path) -> set[str]:
    """Modules of this package that a file imports, anywhere in it (type-checking imports too)."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path.name} uses a relative import"
            for alias in node.names:
                whole = f"{node.module}.{alias.name}".removeprefix("viscopade.")
                found.add(f"viscopade.{whole}" if whole in MODULES else str(node.module))
    return {name.removeprefix("viscopade.") for name in found if name.startswith("viscopade.")}


def test_every_module_has_its_place():
    assert set(MODULES) - FRAME == set(ORDER)


@pytest.mark.parametrize("module", ORDER)
def test_imports_point_downward(module):
    below = ORDER[: ORDER.index(module)]
    assert imported(MODULES[module]) <= set(below)


@pytest.mark.parametrize("module", sorted(set(ORDER) - TOUCH_FILES))
def test_only_the_command_line_and_the_writer_touch_files(module):
    names = {node.id for node in ast.walk(ast.parse(MODULES[module].read_text())) if isinstance(node, ast.Name)}
    assert not names & {"open", "Path", "os", "shutil", "tempfile"}


def loaded_after(statement: str) -> set[str]:
    code = f"import sys\n{statement}\nprint(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    return set(run.stdout.split())


HEAVY = {"pint", "sympy", "matplotlib", "jinja2", "click", "rich", "scipy"}


def test_importing_the_package_loads_nothing_heavy():
    assert not loaded_after("import viscopade") & HEAVY


def test_deriving_coefficients_needs_no_sympy():
    assert not loaded_after("import viscopade as vp; vp.series(10, 10); vp.pade(3, 6)") & HEAVY
