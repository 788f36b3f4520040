"""Maker of the list of arguments at which rounding errors of exported functions are the largest that a search finds.

python -m tools.hard_arguments > src/viscopade/data/hard_arguments.csv

The test vectors (`viscopade.kernels.targets.vectors`) take them.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from viscopade.generated import generated_by
from viscopade.kernels import prove_lacunary, requests
from viscopade.kernels.forms import speed_kernel
from viscopade.kernels.names import FAST, FULL
from viscopade_lab.hard_cases import kernel_rounding
from viscopade_lab.hard_cases.exported import BETA, ExportedFunction
from viscopade_lab.hard_cases.kernel_rounding import SEED, SEPARATE, THOROUGH, AnyFunction

NUMBER, ROUNDS, ROWS = 1200, 8, 4  # of the search; rows of each table
FUNCTIONS = {"derivative": "epsilon_derivative", "v*(eps)": "v_star", "v*(1 - eps)": "v_star_from_loss"}
"""Names of functions in headers, where the laboratory has others."""


def name_of(function: AnyFunction) -> str:
    """Return the name of an exported function, without its type's ending."""
    family, _, label = function.kernel.partition(" ")
    short = function.name.partition(",")[0]
    if family in ("Padé", "best"):
        request = requests.PAPER if family == "Padé" else requests.RECOMMENDED
        kernel = next(kernel.name for kernel in request.quotients() if kernel.label == label)
    elif family == "inverse":
        kernel = prove_lacunary.inverse_kernel(label).name
    elif family == "table":
        kernel = prove_lacunary.speed_kernel(label, FAST).name
        short = "restitution" if label == FULL else short
    elif family == "full":
        kernel = FULL
    else:
        kernel = prove_lacunary.half_line_kernel(label).name
        kernel = kernel.replace("halfline", "compact") if family == "compact" else kernel
    return f"{FUNCTIONS.get(short, short)}_{kernel}"


def arguments(function: AnyFunction, x: float) -> list[float]:
    """Return the arguments of the exported function."""
    family, _, label = function.kernel.partition(" ")
    if family == "compact":
        return [x, float(np.float32(BETA)) if function.form.suffix else BETA]
    if family == "table":
        row = function.name.partition("row ")[2]
        scale = 2.0 ** speed_kernel.TABLES[label, FAST].interval(int(row))[0] if row else 1.0
        return [x * scale, 1.0]
    return [x]


def functions() -> Iterator[AnyFunction]:
    """Yield what is searched: every exported function, its branches, and some rows of tables."""
    plan = THOROUGH._replace(rows=ROWS)
    for _, function in kernel_rounding.planned_functions(plan):
        if not function.name.endswith("coefficients too"):
            yield function


def main() -> None:
    """Print the arguments."""
    generator = np.random.default_rng(SEED)
    print(f"# {generated_by()}: python -m tools.hard_arguments > src/viscopade/data/hard_arguments.csv")
    print("# Arguments at which a search found the largest rounding errors of functions (`viscopade hardcases`).")
    print("function,type,x,y")
    for function in functions():
        of_row = isinstance(function, ExportedFunction) and function.kernel.startswith("table")
        number = NUMBER // 4 if of_row else NUMBER
        worst = kernel_rounding.largest_error(function, SEPARATE, number, ROUNDS, generator)
        given = [x.hex() for x in arguments(function, worst.x)]
        print(",".join([name_of(function), function.form.name, *given, *[""] * (2 - len(given))]), flush=True)


if __name__ == "__main__":
    main()
