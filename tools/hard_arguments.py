"""Search for arguments with larger rounding errors than those in the list that the test vectors take.

python -m tools.hard_arguments > hard_arguments.csv

It prints the list `src/viscopade/data/hard_arguments.csv` with an argument replaced wherever the search finds a larger
rounding error; the search is the same each time, so that it leaves a list that it has printed as it is.
"""

from __future__ import annotations

import argparse

import numpy as np

from viscopade.kernels.machine import TYPES
from viscopade.kernels.write.vectors import hard_arguments
from viscopade_lab.hard_cases.worst import Function, functions, worst

NUMBER, ROUNDS, ROWS = 1200, 8, 4  # of the search; rows of each table


def listed_arguments(function: Function) -> list[float]:
    """Return the arguments in the list that are this function's, branch's or row's."""
    listed = hard_arguments().get((function.name, function.form.name), [])
    x = [row[0] / function.scale for row in listed]
    return [one for one in x if function.low <= one <= function.high]


def line(function: Function) -> str:
    """Return the line of a function: of the known arguments and the one worst_argument, that with the largest error."""
    worst_argument = worst(function, NUMBER // 4 if function.family == "tables" else NUMBER, ROUNDS)
    x, _ = max(
        [
            *(
                (one, function.errors(np.array([one], TYPES[function.form.name]))[0])
                for one in listed_arguments(function)
            ),
            worst_argument,
        ],
        key=lambda pair: pair[1],
    )
    hexadecimal = [value.hex() for value in (x * function.scale, *function.second)]
    return ",".join([function.name, function.form.name, *hexadecimal, *[""] * (2 - len(hexadecimal))])


def main() -> None:
    """Print the list."""
    print("# Arguments with the largest rounding errors that `python -m tools.hard_arguments` found.")
    print("function,type,x,y")
    for function in functions(ROWS):
        print(line(function), flush=True)


if __name__ == "__main__":
    argparse.ArgumentParser(description=__doc__).parse_args()
    main()
