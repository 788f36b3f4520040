"""The functions on docs/results/laws.md, compiled and run: eps of the linear and of the Hunt-Crossley law."""

import math
import re
import subprocess
from pathlib import Path

import pytest

from tests import compiled
from viscopade.collision import exact

PAGE = (Path(__file__).parents[2] / "docs" / "results" / "laws.md").read_text()
LAWS = {"epsilon_linear": "linear", "epsilon_hunt_crossley": "hunt-crossley:1"}
KAPPAS = [0.001, 0.01, 0.1, 0.5, 1.0, 1.9, 2.0, 2.1, 5.0, 40.0, 1000.0]
ERROR = 1e-12


def functions():
    found = [text for text in re.findall(r"```c\n(.*?)```", PAGE, re.DOTALL) if "epsilon_" in text]
    assert len(found) == len(LAWS)
    assert all(len(text.strip("\n").split("\n")) <= 6 for text in found)
    return "\n\n".join(found)


def in_c(tmp_path):
    calls = "".join(f'    printf("%a ", {name}({kappa!r}));\n' for name in LAWS for kappa in KAPPAS)
    text = f"#include <math.h>\n#include <stdio.h>\n{functions()}\nint main(void)\n{{\n{calls}    return 0;\n}}\n"
    (tmp_path / "laws.c").write_text(text)
    compiler = compiled.compiler("c99")[0]
    subprocess.run(
        [compiler, "-std=c99", "-Wall", "-Werror", tmp_path / "laws.c", "-lm", "-o", tmp_path / "laws"], check=True
    )
    printed = subprocess.run([tmp_path / "laws"], check=True, capture_output=True, text=True).stdout
    return list(map(float.fromhex, printed.split()))


def test_the_functions_give_eps(tmp_path):
    exactly = [
        exact.collision(kappa=kappa, digits=20, law=law).floats()["epsilon"]
        for law in LAWS.values()
        for kappa in KAPPAS
    ]
    assert in_c(tmp_path) == pytest.approx(exactly, rel=ERROR, abs=0)


def test_the_first_term_serves_below():
    for law, slope in (("linear", math.pi / 2), ("hunt-crossley:1", 2 / 3)):
        for kappa in (1e-3, 1e-5):
            assert (
                abs(exact.collision(kappa=kappa, digits=15, law=law).floats()["epsilon"] - (1 - slope * kappa)) < 2e-6
            )
