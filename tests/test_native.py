"""The extension in C: its sources have no warnings, and compute within their memory and the ranges of their types."""

import subprocess
import sys
import sysconfig
from pathlib import Path

import numpy as np
import pytest

from tests.compiled import compiler

ROOT = Path(__file__).parents[1]
SANITIZERS = ("-fsanitize=undefined,address", "-fno-sanitize-recover=all", "-fno-omit-frame-pointer", "-O1", "-g")
WARNINGS = ("-Wall", "-Wextra", "-Wshadow", "-Wconversion", "-Wsign-conversion", "-Werror")

# Import the sanitized extension in place of the installed one; then run the comparisons of other tests.
WATCHED = """
import importlib.util, sys
spec = importlib.util.spec_from_file_location("viscopade._native", sys.argv[1])
sys.modules["viscopade._native"] = module = importlib.util.module_from_spec(spec)
spec.loader.exec_module(module)
import numpy as np
import viscopade as vp
from viscopade import compiled
from viscopade.arrays import double
from viscopade.kernels import native
from tests.arrays.test_double import check_that_backends_agree
from tests.collision.test_recursion import check_random_cases
assert vp.backend() == "compiled"
for most_bits in (60, 400, 3000):
    check_random_cases(most_bits + 1, 100, most_bits, 40)
check_that_backends_agree(3, 1000)
beyond = np.array([-1, -1e308, -np.inf, np.nan])
compiled.extension.panels(0, double._rows(), beyond, np.empty(4))
restitution = native.compiled_restitution()
for speed in (np.geomspace(1e-9, 1e9, 5001), np.ones(4000, np.float32)[::-3]):
    assert np.array_equal(restitution(speed, 1.3), native.numpy_restitution(speed, 1.3))
print("done")
"""


def test_the_sanitizers_find_nothing(tmp_path):
    includes = [f"-isystem{path}" for path in (sysconfig.get_path("include"), np.get_include())]
    command = compiler("c11", flags=SANITIZERS)
    library = subprocess.run([command[0], "-print-file-name=libasan.so"], capture_output=True, text=True).stdout.strip()
    if not Path(sysconfig.get_path("include"), "Python.h").exists() or not Path(library).is_absolute():
        pytest.skip("Python's headers or the sanitizers' library are missing")
    built = tmp_path / "_native.so"
    sources = sorted(map(str, (ROOT / "src" / "native").glob("*.c")))
    subprocess.run(
        [*command, *WARNINGS, *includes, f"-I{ROOT / 'exports'}", "-shared", "-fPIC", *sources, "-o", built, "-lm"],
        check=True,
    )
    environment = {
        "LD_PRELOAD": library,
        "PYTHONMALLOC": "malloc",
        "ASAN_OPTIONS": "detect_leaks=0",
        "PYTHONPATH": f"{ROOT}:{ROOT / 'src'}",
    }
    run = subprocess.run([sys.executable, "-c", WATCHED, built], capture_output=True, text=True, env=environment)
    assert run.stdout == "done\n", run.stderr[-3000:]
