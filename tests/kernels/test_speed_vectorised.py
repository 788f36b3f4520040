"""The array functions of the kernels from speed to eps become vector instructions: by the compilers' own reports.

`viscopade_block_` computes places, loads rows, and sums; its first and its last loop are for vector instructions.
"""

from __future__ import annotations

import itertools
import platform
import re
import shutil
import subprocess
from collections import Counter
from typing import NamedTuple

import numpy as np
import pytest

from tests import daily
from tests.compiled import compiler
from tests.kernels.speed_headers import ARRAYS, FORMS, FUNCTIONS, SUFFIXES, header, interface
from viscopade.kernels import catalogue

ARM = "aarch64-linux-gnu"
REPORTS = {
    "gcc": ("-fopt-info-vec-optimized",),
    "clang": ("-Rpass=(loop-vectorize|slp-vectorizer)",),
}
VECTOR = re.compile(r"loop vectorized using|vectorized loop")
UNROLLED = re.compile(r"Stores SLP vectorized")  # Clang may unroll a loop completely, and make vectors then
slow = pytest.mark.slow


class Target(NamedTuple):
    compiler: str
    flags: tuple[str, ...]
    bytes: int
    """The least size of its vectors in the reports."""


TARGETS = {
    "gcc-haswell": Target("gcc", ("-march=haswell",), 32),
    "gcc-cooperlake": Target("gcc", ("-march=cooperlake",), 32),  # with AVX-512 BF16
    "gcc-zen4": Target("gcc", ("-march=znver3", "-mavx512f", "-mavx512vl", "-mavx512bw", "-mavx512dq"), 32),
    "gcc-neon": Target(f"{ARM}-gcc", (), 16),
    "clang-haswell": Target("clang", ("-march=haswell",), 32),
    "clang-neon": Target("clang", (f"--target={ARM}", "-isystem", f"/usr/{ARM}/include"), 16),
}
KINDS = ("1e-5", "full", "1e-10")  # of blocks
# These have all kinds of blocks. The usual machine takes turns.
ALWAYS = {
    "gcc-haswell": (daily.chosen(catalogue.TIERS),),
    "clang-haswell": ("1e-5",),
    "gcc-cooperlake": ("1e-5",),
    "gcc-zen4": ("1e-10",),
}
OF_TWO = ("1e-5",)  # tables with rows of two numbers
CASES = [
    pytest.param(target, tier, marks=() if tier in ALWAYS.get(target, ()) else slow)
    for target in TARGETS
    for tier in catalogue.TIERS
]


def compiled(folder, given, target):
    """Return the compiler's report and the assembly, or skip."""
    command = shutil.which(target.compiler)
    if command is None:
        pytest.skip(f"there is no {target.compiler}")
    (folder / "header.h").write_text(given.text)
    (folder / "source.c").write_text(f'#include "header.h"\n{interface(given)}')
    (folder / "probe.c").write_text("#include <math.h>\n#include <string.h>\nint main(void) { return 0; }\n")
    arguments = [command, "-std=c99", "-O3", *target.flags]
    probe = subprocess.run([*arguments, "-S", "probe.c", "-o", "probe.s"], cwd=folder, capture_output=True)
    if probe.returncode:
        pytest.skip(f"{target.compiler} cannot compile for {' '.join(target.flags)}")
    reports = REPORTS["clang" if "clang" in target.compiler else "gcc"]
    done = subprocess.run(
        [*arguments, *reports, "-S", "source.c", "-o", "source.s"], cwd=folder, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stderr, (folder / "source.s").read_text()


def loops(given, form):
    """Return first and last line of the loops of a type's viscopade_block_, in the order of the text."""
    lines = given.text.splitlines()
    head = f"viscopade_block_{given.name}{SUFFIXES[form]}("
    start = next(n for n, line in enumerate(lines) if head in line and line.startswith("VISCOPADE_ALWAYS"))
    end = lines.index("}", start)
    starts = [n for n in range(start, end) if re.match(r" +for \(", lines[n])]
    return [(n + 1, next(m for m in range(n, end) if lines[m] == lines[n].split("f")[0] + "}") + 1) for n in starts]


def reported(report):
    """Return the messages on vectors in the header: line, text."""
    found = re.findall(r"header\.h:(\d+):\d+: (?:optimized|remark): (.*)", report)
    return [(int(line), text) for line, text in found]


def vector_bytes(text, form):
    """Return the size of vectors that a message states."""
    found = re.search(r"using (\d+) byte vectors", text)
    if found:
        return int(found[1])
    width = int(re.search(r"vectorization width: (\d+)", text)[1])
    return width * np.dtype(FORMS[form]).itemsize


def shortcomings(given, report, target):
    """Return what is not made of vectors: types, loops and how many of how many functions."""
    found = []
    messages = reported(report)
    for form in given.native:
        # Functions of a type that is converted use the block of the other.
        wanted = len(ARRAYS) * len(FUNCTIONS) * (len(FORMS) if given.native == [form] else 1)
        every = loops(given, form)
        for name, (start, end) in (("first", every[0]), ("last", every[-1])):
            sizes = [vector_bytes(text, form) for line, text in messages if line == start and VECTOR.search(text)]
            # Clang is asked for vectors of four numbers where numbers were stored by four.
            by_four = name == "last" and target.compiler == "clang" and given.native == ["double"]
            least = min(target.bytes, 32) if by_four else target.bytes
            vectors = sum(size >= least for size in sizes)
            unrolled = sum(start <= line <= end and bool(UNROLLED.search(text)) for line, text in messages)
            if vectors < wanted and not (name == "first" and vectors + unrolled >= wanted):
                found.append(f"{form}: {name} loop in {vectors} of {wanted} functions")
    return found


def gathers(assembly):
    """Return how many gather instructions each function has."""
    found = Counter()
    name = ""
    for line in assembly.splitlines():
        label = re.match(r"(\w+):", line)
        name = label[1] if label else name
        found[name] += bool(re.match(r"\s+vp?gather", line))
    return found


@pytest.mark.parametrize(("target", "tier"), CASES)
def test_first_and_last_loop_are_vectorised(tmp_path, target, tier):
    given = header(tier)
    report, assembly = compiled(tmp_path, given, TARGETS[target])
    assert shortcomings(given, report, TARGETS[target]) == []
    found = gathers(assembly)
    assert {f"{kind}_{function}_{form}" for kind in ARRAYS for function in FUNCTIONS for form in FORMS} <= set(found)
    if target == "gcc-zen4":
        assert ("zmm" in assembly) == (tier in OF_TWO)
    if target == "gcc-cooperlake" and tier in OF_TWO:
        gathering = [name for name, number in found.items() if number]
        for kind, function in itertools.product(ARRAYS, FUNCTIONS):
            assert any(kind in name and function in name for name in gathering), found
    else:  # beta[pair[i]] may be gathered; rows are not
        assert all(number == 0 or "by_pair" in name for name, number in found.items()), found


# By GCC and Clang for any x86-64: registers of the instruction sets that array functions choose from.
CHOSEN = {"gcc": {"avx2": "ymm", "avx512": "zmm"}, "clang": {"avx2": "ymm"}}


@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="only functions for x86-64 choose")
@pytest.mark.parametrize("maker", CHOSEN)
@pytest.mark.parametrize(
    "tier", [daily.chosen(catalogue.TIERS), *(pytest.param(tier, marks=slow) for tier in catalogue.TIERS)]
)
def test_functions_that_are_chosen_have_long_vectors(tmp_path, tier, maker):
    """They do with plain -O2, and are not there if the command line names AVX."""
    named, found = re.compile(r"viscopade_\w+_(avx2|avx512)[.\w]*:"), Counter()
    _, assembly = compiled(tmp_path, header(tier), Target(maker, ("-march=x86-64", "-O2"), 32))
    for function in re.split(r"\n(?=\w+[.\w]*:)", assembly):
        chosen = named.match(function)
        if chosen:
            found[chosen[1]] += bool(re.search(rf"\tvmulp[sd]\t.*%{CHOSEN[maker][chosen[1]]}", function))
    functions = len(ARRAYS) * len(FUNCTIONS) * len(FORMS)
    assert found == dict.fromkeys(CHOSEN[maker], functions)
    _, assembly = compiled(tmp_path, header(tier), Target(maker, ("-mavx2", "-O2"), 32))
    assert not re.search(named, assembly)
    # Their arrays on the stack begin with a cache line.
    assert len(re.findall(r"\tandq\t\$-64, %rsp", assembly)) >= functions


# --- undefined behaviour ----------------------------------------------------------------------------------------------

SWEEP = """
static void arrays_NAMEEND(size_t n)
{
    static uint64_t z = 1;
    TYPE *speed = malloc(n * sizeof *speed), *beta = malloc(n * sizeof *beta), *out = malloc(n * sizeof *out);
    int *pair = malloc(n * sizeof *pair);
    for (size_t i = 0; i < n; i++) {
        z = z * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
        pair[i] = (int)((z >> 40) % n);
        beta[i] = (TYPE)(z >> 60);
        memcpy(&speed[i], (const char *)&z + sizeof z - sizeof *speed, sizeof *speed);
        speed[i] = n % 3 ? speed[i] : (TYPE)(z >> 40);
    }
    CALLS
    free(speed), free(beta), free(out), free(pair);
}
"""
"""Memory is as large as needed, so that the sanitizer sees every access beyond it."""
SANITIZERS = ["-fsanitize=undefined,address", "-fno-sanitize-recover=all"]


def sanitized(folder, source, *flags):
    """Compile and run a program that the sanitizers watch; return what it prints."""
    (folder / "patterns.c").write_text(source)
    command = [*compiler("c99"), "-O1", *flags, "-o", str(folder / "patterns"), str(folder / "patterns.c")]
    if subprocess.run([*command, *SANITIZERS, "-lm"], capture_output=True, text=True).returncode:
        pytest.skip("the compiler has no sanitizers")
    done = subprocess.run([str(folder / "patterns")], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize(
    ("math_flag", "tiers"),
    [
        ("-fno-fast-math", KINDS),
        ("-ffast-math", (daily.chosen(catalogue.TIERS),)),
        *(pytest.param(flag, catalogue.TIERS, marks=slow) for flag in ("-fno-fast-math", "-ffast-math")),
    ],
)
def test_no_undefined_behaviour_of_array_functions(tmp_path, math_flag, tiers):
    """For any speeds and lengths, with the rules of IEEE and without them."""
    body, runs = ["#include <stdlib.h>"], []
    for name, (form, suffix) in itertools.product([tier.replace("-", "m") for tier in tiers], SUFFIXES.items()):
        end = f"{name}{suffix}"
        calls = "\n    ".join(
            f"viscopade_{function}_{kind_}_{end}(n, speed, {beta}, out);"
            for function in ("restitution", "rebound", "dissipation")
            for kind_, beta in (("each", "beta"), ("by_pair", "pair, beta"), ("array", "(TYPE)1.3"))
        )
        made = SWEEP.replace("CALLS", calls).replace("NAME", name).replace("END", suffix)
        body.append(made.replace("TYPE", form))
        runs.append(f"arrays_{end}(n);")
    main = f"int main(void) {{ for (size_t n = 0; n < 300; n++) {{ {' '.join(runs)} }} return 0; }}"
    headers = [header(tier).text for tier in tiers]
    sanitized(tmp_path, "\n".join([*headers, *body, main]), math_flag)
