"""From materials to beta: the functions that all C headers have are those of `viscopade.Pair`."""

import ctypes
import math
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import viscopade as vp
from tests import compiled
from viscopade.kernels import catalogue
from viscopade.kernels.material import material_kernel
from viscopade.kernels.write.file import file_text
from viscopade.kernels.write.languages import NAMES, language

EXPORTS = Path(__file__).parents[2] / "exports"
HEADERS = ("viscopade_pade.h", "viscopade_speed_1em5.h", "viscopade.cuh")
BLOCK = re.compile(r"#ifndef VISCOPADE_MATERIAL\n.*?VISCOPADE_KERNEL_END\n.*?#endif\n", re.DOTALL)
# What is sampled below, and said in docs/usage/c-and-cpp.md.
ERRORS = {"double": 1e-14, "float": 2e-6}

# All functions in one, for a type T whose functions have the suffix F: x has E1, nu1, R1, m1, E2, nu2, R2, m2, A.
CHAIN = """
LINKED void material_T(const T *x, T *out)
{
    out[0] = viscopade_effective_modulusF(x[0], x[1], x[4], x[5]);
    out[1] = viscopade_effective_radiusF(x[2], x[6]);
    out[2] = viscopade_effective_massF(x[3], x[7]);
    out[3] = viscopade_rhoF(out[0], out[1]);
    out[4] = viscopade_betaF(x[8], out[3], out[2]);
}
"""
LINKED = '#ifdef __cplusplus\n#define LINKED extern "C"\n#else\n#define LINKED\n#endif\n'


def code(headers):
    """Return a program that includes headers and has the functions `material_double` and `material_float`."""
    includes = "".join(f'#include "{name}"\n' for name in headers)
    declarations = "".join(f"LINKED void material_{kind}(const {kind} *x, {kind} *out);\n" for kind in ERRORS)
    chains = (re.sub(r"\bT\b|(?<=_)T\b", kind, CHAIN).replace("F(", f"{'f' * (kind == 'float')}(") for kind in ERRORS)
    return includes + LINKED + declarations + "".join(chains)


@pytest.fixture(scope="module", params=["c99", "c++98", "c++17"])
def chain(request, tmp_path_factory):
    """Return the compiled chain, with all headers in one file, in C and in C++: numbers and a type -> results."""
    folder = tmp_path_factory.mktemp("material")
    headers = HEADERS[::2] if request.param == "c++98" else HEADERS  # tables need C++17
    (folder / "chain.src").write_text(code(headers))
    words = [*compiled.compiler(request.param), *compiled.WARNINGS, "-Wno-missing-declarations", "-O2", "-I", EXPORTS]
    subprocess.run([*words, "-fPIC", "-shared", "chain.src", "-o", "chain.so", "-lm"], cwd=folder, check=True)
    library = ctypes.CDLL(str(folder / "chain.so"))

    def results(numbers, kind):
        """Return E_eff, R_eff, m_eff, rho and beta."""
        form = {"double": np.float64, "float": np.float32}[kind]
        given, out = np.array(numbers, form), np.zeros(5, form)
        library[f"material_{kind}"](given.ctypes.data_as(ctypes.c_void_p), out.ctypes.data_as(ctypes.c_void_p))
        return out

    return results


def bodies(random, wall):
    """Return numbers of two bodies and their A, of sizes from 1 um to 1 m, and the pair."""
    moduli, sizes, densities = (10 ** random.uniform(low, high, 2) for low, high in ((4, 12), (-6, 0), (2, 4.3)))
    ratios, dissipative_constant = random.uniform(-0.9, 0.5, 2), 10 ** random.uniform(-9, -2)
    materials = [
        {"young_modulus": modulus, "poisson_ratio": ratio, "dissipative_constant": dissipative_constant}
        for modulus, ratio in zip(moduli, ratios, strict=True)
    ]
    spheres = [
        vp.Sphere(radius=size, density=density, **values)
        for size, density, values in zip(sizes, densities, materials, strict=True)
    ]
    if wall:
        spheres[1] = vp.Sphere.wall(**materials[1])
    numbers = [n for s in spheres for n in (s.young_modulus, s.poisson_ratio, s.radius, s.mass)]
    return [*numbers, dissipative_constant], vp.Pair(*spheres)


@pytest.mark.parametrize("kind", ERRORS)
def test_functions_are_those_of_pair(chain, kind):
    random = np.random.default_rng(11)
    for number in range(200):
        numbers, pair = bodies(random, wall=number % 2 == 0)
        expected = [pair.E_eff, pair.R_eff, pair.m_eff, pair.rho, pair.beta]
        np.testing.assert_allclose(chain(numbers, kind), expected, rtol=ERRORS[kind])


@pytest.mark.parametrize("kind", ERRORS)
def test_results_are_nan_for_what_is_no_material(chain, kind):
    numbers, _ = bodies(np.random.default_rng(12), wall=False)
    # By the number of the argument: the result that depends on it, and values that are refused.
    wrong = {0: (0, (0.0, -1.0, math.nan)), 1: (0, (-1.0, 0.6, math.nan)), 2: (1, (0.0, -1.0)), 3: (2, (0.0, -1.0))}
    wrong |= {place + 4: values for place, values in wrong.items()} | {8: (4, (-1.0, math.nan))}
    for place, (result, values) in wrong.items():
        for value in values:
            changed = [value if n == place else number for n, number in enumerate(numbers)]
            assert math.isnan(chain(changed, kind)[result])
            assert math.isnan(chain(changed, kind)[4])
    assert chain([*numbers[:8], 0.0], kind)[4] == 0.0
    assert chain([math.inf, *numbers[1:]], kind)[0] == pytest.approx(numbers[4] / (1 - numbers[5] ** 2), rel=1e-6)


def test_the_block_is_the_same_in_all_headers():
    names = [path.name for path in EXPORTS.glob("viscopade*.[hc]*") if path.suffix in (".h", ".cuh")]
    blocks = {BLOCK.search((EXPORTS / name).read_text())[0] for name in names if name != "viscopade_version.h"}
    (block,) = blocks
    assert block.count("Not proven") == 2 * len(material_kernel().functions)
    assert "pow is taken to be within 4 ulp" in block
    assert "VISCOPADE_MATERIAL" not in (EXPORTS / "viscopade_version.h").read_text()
    for name in NAMES:
        text = file_text([catalogue.kernel("compact 1e-3")], language(name), "viscopade", "a")
        assert ("viscopade_effective_modulus" in text) == (name in ("c", "cuda"))


DEVICE = """
__global__ void betas(size_t n, const float *mass, float *out, double *wide)
{
    for (size_t i = blockIdx.x * blockDim.x + threadIdx.x; i < n; i += gridDim.x * blockDim.x) {
        const float rho = viscopade_rhof(viscopade_effective_modulusf(1e7f, 0.3f, 1e9f, 0.2f), mass[i]);
        out[i] = viscopade_betaf(1e-6f, rho, viscopade_effective_massf(mass[i], INFINITY));
        wide[i] = viscopade_beta(1e-6, viscopade_rho(1e7, viscopade_effective_radius(0.01, 0.02)), 1e-3);
    }
}
"""


@pytest.mark.parametrize("header", HEADERS)
def test_functions_are_those_of_devices_too(tmp_path, header):
    """In the headers of C as well, where nvcc reads them; viscopade_beta(beta) of the launch is another function."""
    nvcc = shutil.which("nvcc")
    if nvcc is None:
        pytest.skip("there is no nvcc")
    (tmp_path / "betas.cu").write_text(f'#include "{header}"\n{DEVICE}')
    words = [nvcc, "-std=c++17", "-arch=sm_75", "-I", EXPORTS, "-cubin", "betas.cu", "-o", "betas.cubin"]
    ran = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
