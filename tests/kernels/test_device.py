"""The header for devices, by compilers of CUDA and HIP; nothing here has run on a GPU."""

import ctypes
import ctypes.util
import importlib.util
import re
import subprocess
from pathlib import Path

import pytest

from tests.kernels.languages import tool
from viscopade.kernels import catalogue

EXPORTS = Path(__file__).parents[2] / "exports"
HEADER = (EXPORTS / "viscopade.cuh").read_text()
BENCHMARK = Path(__file__).parents[2] / "src" / "viscopade_lab" / "gpu" / "bench.cu"

LAUNCHES = """
#include "viscopade.cuh"
#define FOR(NAME, T, BETA) \\
    template cudaError_t viscopade_launch<viscopade_##NAME>(size_t, const T *, BETA<T>, T *, cudaStream_t);
FOR(compact_1em3::restitution, float, viscopade_beta_of_all)
FOR(compact_1em5::rebound, float, viscopade_beta_of_pair)
FOR(compact_1em5::dissipation, double, viscopade_beta_of_each)
FOR(compact_1em7::restitution, double, viscopade_beta_of_all)
FOR(compact_1em7::restitution, float, viscopade_beta_of_all)
"""


@pytest.mark.parametrize("architecture", ["sm_75", "sm_90"])
def test_device_code_compiles(tmp_path, architecture):
    (tmp_path / "viscopade.cuh").write_text(HEADER)
    (tmp_path / "launches.cu").write_text(LAUNCHES)
    command = [tool("nvcc"), f"-arch={architecture}", "-std=c++17", "-Werror", "all-warnings", "-O3", "-Xptxas", "-v"]
    ran = subprocess.run(
        [*command, "-cubin", "launches.cu", "-o", "launches.cubin"], cwd=tmp_path, capture_output=True, text=True
    )
    assert ran.returncode == 0, ran.stderr
    registers = [int(n) for n in re.findall(r"Used (\d+) registers", ran.stderr)]
    assert len(registers) == 5
    assert max(registers) <= 64  # so that 1024 threads fit on a multiprocessor
    assert "bytes spill" not in ran.stderr or set(re.findall(r"(\d+) bytes spill", ran.stderr)) == {"0"}


def test_the_header_compiles_at_run_time():
    """By NVRTC, as CuPy's RawModule does it: without headers, and for the device alone."""
    found = importlib.util.find_spec("nvidia")
    wheels = (
        [library for path in found.submodule_search_locations for library in Path(path).glob("**/libnvrtc.so*")]
        if found
        else []
    )
    library = next(iter(wheels), None) or ctypes.util.find_library("nvrtc")
    if library is None:
        pytest.skip("there is no NVRTC: the package nvidia-cuda-nvrtc-cu12 has it")
    compiler, program, size = ctypes.CDLL(str(library)), ctypes.c_void_p(), ctypes.c_size_t()
    names = [
        f"viscopade_apply<viscopade_{entry.kernel.name}::{function.name}, double, viscopade_beta_of_all<double>>"
        for entry in catalogue.group("compact")
        for function in entry.kernel.functions
    ]
    assert compiler.nvrtcCreateProgram(ctypes.byref(program), HEADER.encode(), b"viscopade.cu", 0, None, None) == 0
    for name in names:
        assert compiler.nvrtcAddNameExpression(program, name.encode()) == 0
    failed = compiler.nvrtcCompileProgram(program, 1, (ctypes.c_char_p * 1)(b"--gpu-architecture=compute_75"))
    compiler.nvrtcGetProgramLogSize(program, ctypes.byref(size))
    said = ctypes.create_string_buffer(size.value)
    compiler.nvrtcGetProgramLog(program, said)
    assert not failed, said.value.decode()
    compiler.nvrtcGetPTXSize(program, ctypes.byref(size))
    code = ctypes.create_string_buffer(size.value)
    compiler.nvrtcGetPTX(program, code)
    assert code.value.count(b".entry") == len(names)


RUNTIME_OF_HIP = """
typedef __SIZE_TYPE__ size_t;
#define __host__ __attribute__((host))
#define __device__ __attribute__((device))
#define __global__ __attribute__((global))
enum hipError_t { hipSuccess };
typedef struct ihipStream_t *hipStream_t;
struct dim3 { unsigned x, y, z; dim3(unsigned a, unsigned b = 1, unsigned c = 1) : x(a), y(b), z(c) {} };
extern const __device__ dim3 threadIdx, blockIdx, blockDim, gridDim;
hipError_t hipGetLastError();
extern "C" unsigned __hipPushCallConfiguration(dim3 blocks, dim3 threads, size_t shared = 0, hipStream_t stream = 0);
extern "C" hipError_t hipLaunchKernel(const void *, dim3, dim3, void **, size_t, hipStream_t);
extern "C" __host__ __device__ double log2(double);
extern "C" __host__ __device__ double exp2(double);
extern "C" __host__ __device__ float log2f(float);
extern "C" __host__ __device__ float exp2f(float);
extern "C" __host__ __device__ double sqrt(double);
extern "C" __host__ __device__ float sqrtf(float);
extern "C" __host__ __device__ double pow(double, double);
extern "C" __host__ __device__ float powf(float, float);
extern "C" __host__ __device__ double nan(const char *);
extern "C" __host__ __device__ float nanf(const char *);
"""


@pytest.mark.parametrize("half", ["host", "device"])
def test_the_header_compiles_for_hip(tmp_path, half):
    """By Clang, with what the header needs of HIP's runtime in place of it. It has not been run."""
    (tmp_path / "viscopade.cuh").write_text(HEADER)
    (tmp_path / "hip").mkdir()
    (tmp_path / "hip" / "hip_runtime.h").write_text(RUNTIME_OF_HIP)
    for name in ("math.h", "stddef.h"):
        (tmp_path / name).write_text("")
    (tmp_path / "launches.hip").write_text(LAUNCHES.replace("cuda", "hip"))
    command = [tool("clang++"), "-x", "hip", f"--cuda-{half}-only", "--offload-arch=gfx90a", "-nogpuinc", "-nogpulib"]
    flags = ["-std=c++17", "-Wall", "-Wextra", "-Werror", "-I.", "-emit-llvm", "-S", "-O2"]
    ran = subprocess.run(
        [*command, *flags, "launches.hip", "-o", "launches.ll"], cwd=tmp_path, capture_output=True, text=True
    )
    assert ran.returncode == 0, ran.stderr
    assert (tmp_path / "launches.ll").read_text().count("amdgpu_kernel void") == (5 if half == "device" else 0)


def test_the_gpu_benchmark_compiles(tmp_path):
    command = [
        tool("nvcc"),
        "-arch=sm_75",
        "-std=c++17",
        "-Werror",
        "all-warnings",
        "-I",
        str(EXPORTS),
        str(BENCHMARK),
    ]
    subprocess.run([*command, "-o", str(tmp_path / "bench")], check=True, capture_output=True)
