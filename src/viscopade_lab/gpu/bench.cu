/*
 * Time and error of the compact kernels on a GPU.
 *
 *     nvcc -O3 -std=c++17 -arch=native -I exports src/viscopade_lab/gpu/bench.cu -o bench && ./bench [elements]
 *
 * Times: rounds are interleaved; printed are minimum, median and maximum, bytes moved per second, and the ratio of the
 * median to that of a copy within the device. Rivals are the paper's [3/6] with powf or pow.
 * Errors: the largest |result - reference| / reference, for all w of the domain and for 1e-3 <= v* <= 10. The reference
 * is the kernel 1e-7 in double, which is compared with full accuracy on the host first. Float functions are
 * evaluated at every positive float with beta = 1 and at as many random pairs of speed and beta; double functions at
 * the random pairs. The functions of CUDA that the proof assumes something about are evaluated at every float, too.
 */
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "viscopade.cuh"
#include "viscopade_speed_full.h"

static const int ROUNDS = 30;
static const unsigned FLOATS = 0x7f800000u; /* floats from 0 to below infinity, by their bits */

static void check(cudaError_t status)
{
    if (status != cudaSuccess) {
        std::fprintf(stderr, "bench: %s\n", cudaGetErrorString(status));
        std::exit(1);
    }
}

/* The paper's [3/6] of v*, with the power that most programs would call. */
struct paper {
    template <typename T> __device__ static T quotient(T v)
    {
        const T top = T(1) + v * (T(1.07232) + v * (T(0.574198) + v * T(0.141552)));
        const T bottom = T(1) + v * (T(1.07232) + v * (T(1.72765) + v * (T(1.37842) +
            v * (T(1.19449) + v * (T(0.467273) + v * T(0.235585))))));
        return top / bottom;
    }
    struct restitution {
        __device__ float operator()(float speed, float beta) const
        {
            return quotient(powf(speed, 0.1f) * sqrtf(beta));
        }
        __device__ double operator()(double speed, double beta) const
        {
            return quotient(pow(speed, 0.1) * sqrt(beta));
        }
    };
};

template <typename T> struct Row {
    const char *name;
    std::function<void()> launch;
    std::vector<float> times;
};

/* Speeds that lead to v* = 1e-3 ... 10 with beta = 1, log-uniform. */
template <typename T> static void times(const char *type, size_t n)
{
    T *speed = nullptr, *out = nullptr;
    std::vector<T> values(n);
    std::mt19937 generator(1);
    std::uniform_real_distribution<float> exponent(-30.0f, 10.0f);
    cudaEvent_t start, stop;

    for (T &value : values) {
        value = static_cast<T>(std::pow(10.0, static_cast<double>(exponent(generator))));
    }
    check(cudaMalloc(&speed, n * sizeof(T)));
    check(cudaMalloc(&out, n * sizeof(T)));
    check(cudaMemcpy(speed, values.data(), n * sizeof(T), cudaMemcpyHostToDevice));
    check(cudaEventCreate(&start));
    check(cudaEventCreate(&stop));
#define ROW(KERNEL, FUNCTION)                                                                                         \
    {                                                                                                                 \
        #KERNEL " " #FUNCTION, [=] { check(viscopade_launch<KERNEL::FUNCTION>(n, speed, viscopade_beta(T(1)), out)); }, \
        {}                                                                                                            \
    }
    std::vector<Row<T>> rows = {
        {"copy", [=] { check(cudaMemcpyAsync(out, speed, n * sizeof(T), cudaMemcpyDeviceToDevice)); }, {}},
        ROW(paper, restitution), ROW(viscopade_compact_1em3, restitution), ROW(viscopade_compact_1em5, restitution),
        ROW(viscopade_compact_1em5, rebound), ROW(viscopade_compact_1em5, dissipation)};
    if constexpr (sizeof(T) == sizeof(double)) {
        rows.push_back(ROW(viscopade_compact_1em7, restitution));
    }
    for (int round = -3; round < ROUNDS; round++) { /* three to warm up */
        for (Row<T> &row : rows) {
            float time = 0;
            check(cudaEventRecord(start));
            row.launch();
            check(cudaEventRecord(stop));
            check(cudaEventSynchronize(stop));
            check(cudaEventElapsedTime(&time, start, stop));
            if (round >= 0) {
                row.times.push_back(time);
            }
        }
    }
    for (Row<T> &row : rows) {
        std::sort(row.times.begin(), row.times.end());
    }
    for (const Row<T> &row : rows) {
        const float median = row.times[ROUNDS / 2];
        std::printf("%-6s  %-36s  %8.4f %8.4f %8.4f ms  %7.1f GB/s  %.5f ns each  %6.3f copies\n", type, row.name,
                    row.times.front(), median, row.times.back(), 2e-6 * static_cast<double>(n * sizeof(T)) / median,
                    1e6 * median / static_cast<double>(n), median / rows[0].times[ROUNDS / 2]);
    }
    check(cudaFree(speed));
    check(cudaFree(out));
    check(cudaEventDestroy(start));
    check(cudaEventDestroy(stop));
}

/* A random number from i: the mixing function of SplitMix64. */
__host__ __device__ static unsigned long long mixed(unsigned long long i)
{
    i = (i + 1) * 0x9e3779b97f4a7c15ull;
    i = (i ^ (i >> 30)) * 0xbf58476d1ce4e5b9ull;
    i = (i ^ (i >> 27)) * 0x94d049bb133111ebull;
    return i ^ (i >> 31);
}

/* A positive number with exponent in -limit ... limit - 1 and leading bits of a random number. */
__host__ __device__ static double spread(unsigned long long random, int limit)
{
    const double mantissa = 1 + static_cast<double>(random >> 20) * 0x1p-44;
    return ldexp(mantissa, static_cast<int>(random % (2u * limit)) - limit);
}

/* Where the device keeps its largest errors, as their bits: positive doubles are ordered as those. */
struct Worst {
    unsigned long long *bits;
    __device__ void note(int place, double error) const
    {
        const unsigned long long found = __double_as_longlong(error);

        if (found > bits[place]) {
            atomicMax(bits + place, found);
        }
    }
};

/* Relative errors of a function of the header, for every float as speed with beta = 1, or for random pairs: in place 0
 * those of all w of the domain, in place 1 those with 1e-3 <= v* <= 10. */
template <typename T, typename Function, typename Reference> struct OfKernel {
    bool every_float;
    __device__ void operator()(unsigned i, Worst worst) const
    {
        const bool in_float = sizeof(T) == sizeof(float);
        const T speed = every_float ? __uint_as_float(i) : static_cast<T>(spread(mixed(i), in_float ? 60 : 400));
        const T beta = every_float ? 1 : static_cast<T>(spread(mixed(~i), in_float ? 12 : 80));
        const double w = pow(static_cast<double>(beta), 5.0) * speed;

        if (w >= (in_float ? 0x1p-126 : 0x1p-1000) && w <= (in_float ? 0x1p+120 : 0x1p+900)) {
            const double exact = Reference{}(static_cast<double>(speed), static_cast<double>(beta));
            const double error = fabs(Function{}(speed, beta) - exact) / exact;

            worst.note(0, error);
            if (w >= 1e-30 && w <= 1e10) {
                worst.note(1, error);
            }
        }
    }
};

/* The error of a float function in units in the last place of the exact value. */
__device__ static double ulps(float result, double exact)
{
    int exponent;
    frexp(exact, &exponent);
    return fabs(result - exact) / ldexp(1.0, max(exponent, -125) - 24);
}

/* Errors of CUDA's functions: __log2f in ulp outside [1/2, 2]; in 2^-22 inside; exp2f in ulp of normal results;
 * __fdividef in ulp. */
struct OfLibrary {
    __device__ void operator()(unsigned i, Worst worst) const
    {
        const float x = __uint_as_float(i);
        const float a = static_cast<float>(spread(mixed(i), 30)), b = static_cast<float>(spread(mixed(~i), 60));

        if (x >= 0x1p-126f) {
            const double exact = log2(static_cast<double>(x));
            if (x >= 0.5f && x <= 2) {
                worst.note(1, fabs(viscopade_log2f(x) - exact) * 0x1p+22);
            } else {
                worst.note(0, ulps(viscopade_log2f(x), exact));
            }
        }
        if (x < 126) {
            worst.note(2, ulps(exp2f(x), exp2(static_cast<double>(x))));
            worst.note(2, ulps(exp2f(-x), exp2(-static_cast<double>(x))));
        }
        worst.note(3, ulps(viscopade_dividef(a, b), static_cast<double>(a) / b));
    }
};

template <typename Errors> __global__ void note_all(Errors errors, Worst worst)
{
    for (unsigned i = blockIdx.x * blockDim.x + threadIdx.x; i < FLOATS; i += gridDim.x * blockDim.x) {
        errors(i, worst);
    }
}

/* Return the largest errors in each place. */
template <typename Errors> static std::vector<double> largest(Errors errors)
{
    std::vector<double> values(4);
    const size_t size = values.size() * sizeof(double);
    Worst worst;

    check(cudaMalloc(&worst.bits, size));
    check(cudaMemset(worst.bits, 0, size));
    note_all<<<4096, 256>>>(errors, worst);
    check(cudaGetLastError());
    check(cudaMemcpy(values.data(), worst.bits, size, cudaMemcpyDeviceToHost));
    check(cudaFree(worst.bits));
    return values;
}

template <typename Function, typename Reference> static void kernel_errors(const char *name)
{
    const auto print = [=](const char *type, const char *arguments, const std::vector<double> &worst) {
        std::printf("%-6s  %-36s  %-24s  %.3e (%.3e for 1e-3 <= v* <= 10)\n", type, name, arguments, worst[0], worst[1]);
    };

    print("float", "every speed, beta = 1", largest(OfKernel<float, Function, Reference>{true}));
    print("float", "random pairs", largest(OfKernel<float, Function, Reference>{false}));
    print("double", "random pairs", largest(OfKernel<double, Function, Reference>{false}));
}

static void errors()
{
    const std::vector<double> worst = largest(OfLibrary{});

    std::printf("float   __log2f %.3f ulp, in [1/2, 2] %.3f 2^-22; exp2f %.3f ulp; __fdividef %.3f ulp\n", worst[0], worst[1],
                worst[2], worst[3]);
#define ERRORS(KERNEL, FUNCTION) \
    kernel_errors<KERNEL::FUNCTION, viscopade_compact_1em7::FUNCTION>(#KERNEL " " #FUNCTION);
    ERRORS(viscopade_compact_1em3, restitution)
    ERRORS(viscopade_compact_1em3, rebound)
    ERRORS(viscopade_compact_1em3, dissipation)
    ERRORS(viscopade_compact_1em5, restitution)
    ERRORS(viscopade_compact_1em5, rebound)
    ERRORS(viscopade_compact_1em5, dissipation)
}

/* log2 and exp2 of CUDA in type double. */
struct power_functions {
    struct logarithm {
        __device__ double operator()(double x, double) const { return log2(x); }
    };
    struct power {
        __device__ double operator()(double x, double) const { return exp2(log2(x) / 30); }
    };
};

/* Function of speeds on the device, with beta = 1. */
template <typename Function> static std::vector<double> device(const std::vector<double> &speed)
{
    std::vector<double> result(speed.size());
    double *in = nullptr;

    check(cudaMalloc(&in, speed.size() * sizeof(double)));
    check(cudaMemcpy(in, speed.data(), speed.size() * sizeof(double), cudaMemcpyHostToDevice));
    check(viscopade_launch<Function>(speed.size(), in, viscopade_beta(1.0), in));
    check(cudaMemcpy(result.data(), in, speed.size() * sizeof(double), cudaMemcpyDeviceToHost));
    check(cudaFree(in));
    return result;
}

/* In type double, device against host: the kernel 1e-7 against full accuracy, and CUDA's functions against long double. */
static void reference_error(size_t n)
{
    std::vector<double> speed(n);
    double worst[4] = {0, 0, 0, 0};

    for (size_t i = 0; i < n; i++) {
        speed[i] = spread(mixed(i), 900);
    }
    const std::vector<double> restitution = device<viscopade_compact_1em7::restitution>(speed);
    const std::vector<double> dissipation = device<viscopade_compact_1em7::dissipation>(speed);
    const std::vector<double> logarithm = device<power_functions::logarithm>(speed);
    const std::vector<double> power = device<power_functions::power>(speed);
    for (size_t i = 0; i < n; i++) {
        const double eps = viscopade_restitution_full(speed[i], 1.0), lost = viscopade_dissipation_full(speed[i], 1.0);
        const long double exact = log2l(speed[i]), exact_power = exp2l(static_cast<long double>(logarithm[i] / 30));
        worst[0] = std::max(worst[0], std::fabs(restitution[i] - eps) / eps);
        worst[1] = std::max(worst[1], std::fabs(dissipation[i] - lost) / lost);
        worst[2] = std::max(worst[2], static_cast<double>(fabsl((logarithm[i] - exact) / exact)) * 0x1p+52);
        worst[3] = std::max(worst[3], static_cast<double>(fabsl((power[i] - exact_power) / exact_power)) * 0x1p+52);
    }
    std::printf("double  1e-7 on the device against full accuracy on the host: restitution %.3e, dissipation %.3e\n",
                worst[0], worst[1]);
    std::printf("double  log2 %.3f, exp2 %.3f units of 2^-52, relative\n", worst[2], worst[3]);
}

int main(int count, char **words)
{
    const size_t n = count > 1 ? std::strtoull(words[1], nullptr, 10) : 100000000;
    cudaDeviceProp device;

    if (n == 0) {
        std::fprintf(stderr, "bench: elements is %s: expected a whole number >= 1\n", words[1]);
        return 2;
    }
    check(cudaGetDeviceProperties(&device, 0));
    std::printf("%s, %zu elements, %d rounds\n", device.name, n, ROUNDS);
    times<float>("float", n);
    times<double>("double", n);
    reference_error(std::min<size_t>(n, 10000000));
    errors();
    return 0;
}
