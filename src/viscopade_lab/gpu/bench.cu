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

/* The largest errors: of all arguments, and of those with 1e-3 <= v* <= 10. Positive doubles are ordered as their bits. */
__device__ static void note(double error, bool middle, unsigned long long *worst)
{
    const unsigned long long bits = __double_as_longlong(error);

    if (bits > worst[0]) {
        atomicMax(worst, bits);
    }
    if (middle && bits > worst[1]) {
        atomicMax(worst + 1, bits);
    }
}

__device__ static bool is_middle(double w)
{
    return w >= 1e-30 && w <= 1e10;
}

/* Every float as speed with beta = 1 (one = true), or random pairs. */
template <typename Function, typename Reference>
__global__ void float_errors(bool one, Function function, Reference reference, unsigned long long *worst)
{
    for (unsigned i = blockIdx.x * blockDim.x + threadIdx.x; i < FLOATS; i += gridDim.x * blockDim.x) {
        const float speed = one ? __uint_as_float(i) : static_cast<float>(spread(mixed(i), 60));
        const float beta = one ? 1.0f : static_cast<float>(spread(mixed(~i), 12));
        const double w = pow(static_cast<double>(beta), 5.0) * speed;

        if (w >= 0x1p-126 && w <= 0x1p+120) {
            const double exact = reference(static_cast<double>(speed), static_cast<double>(beta));
            note(fabs(function(speed, beta) - exact) / exact, is_middle(w), worst);
        }
    }
}

template <typename Function, typename Reference>
__global__ void double_errors(Function function, Reference reference, unsigned long long *worst)
{
    for (unsigned i = blockIdx.x * blockDim.x + threadIdx.x; i < FLOATS; i += gridDim.x * blockDim.x) {
        const double speed = spread(mixed(i), 400), beta = spread(mixed(~i), 80);
        const double w = pow(beta, 5.0) * speed;

        if (w >= 0x1p-1000 && w <= 0x1p+900) {
            const double exact = reference(speed, beta);
            note(fabs(function(speed, beta) - exact) / exact, is_middle(w), worst);
        }
    }
}

/* The error of a float function in units in the last place of the exact value. */
__device__ static double ulps(float result, double exact)
{
    int exponent;
    frexp(exact, &exponent);
    return fabs(result - exact) / ldexp(1.0, max(exponent, -125) - 24);
}

/* worst: __log2f in ulp outside [1/2, 2]; in 2^-22 inside; exp2f in ulp of normal results; __fdividef in ulp. */
__global__ void function_errors(unsigned long long *worst)
{
    for (unsigned i = blockIdx.x * blockDim.x + threadIdx.x; i < FLOATS; i += gridDim.x * blockDim.x) {
        const float x = __uint_as_float(i);
        const float a = static_cast<float>(spread(mixed(i), 30)), b = static_cast<float>(spread(mixed(~i), 60));

        if (x >= 0x1p-126f) {
            const double exact = log2(static_cast<double>(x));
            if (x >= 0.5f && x <= 2) {
                note(fabs(viscopade_log2f(x) - exact) * 0x1p+22, false, worst + 1);
            } else {
                note(ulps(viscopade_log2f(x), exact), false, worst);
            }
        }
        if (x < 126) {
            note(ulps(exp2f(x), exp2(static_cast<double>(x))), false, worst + 2);
            note(ulps(exp2f(-x), exp2(-static_cast<double>(x))), false, worst + 2);
        }
        note(ulps(viscopade_dividef(a, b), static_cast<double>(a) / b), false, worst + 3);
    }
}

/* Numbers on the device that kernels raise, as their bits. */
struct Largest {
    unsigned long long *bits = nullptr;
    Largest()
    {
        check(cudaMalloc(&bits, 4 * sizeof(*bits)));
        reset();
    }
    ~Largest() { cudaFree(bits); }
    void reset() { check(cudaMemset(bits, 0, 4 * sizeof(*bits))); }
    std::vector<double> read()
    {
        std::vector<double> values(4);
        check(cudaGetLastError());
        check(cudaMemcpy(values.data(), bits, 4 * sizeof(double), cudaMemcpyDeviceToHost));
        reset();
        return values;
    }
    void print(const char *type, const char *name, const char *arguments)
    {
        const std::vector<double> worst = read();
        std::printf("%-6s  %-36s  %-24s  %.3e (%.3e for 1e-3 <= v* <= 10)\n", type, name, arguments, worst[0], worst[1]);
    }
};

#define FLOAT_ERRORS(KERNEL, FUNCTION)                                                                                \
    float_errors<<<4096, 256>>>(true, KERNEL::FUNCTION{}, viscopade_compact_1em7::FUNCTION{}, largest.bits);          \
    largest.print("float", #KERNEL " " #FUNCTION, "every speed, beta = 1");                                           \
    float_errors<<<4096, 256>>>(false, KERNEL::FUNCTION{}, viscopade_compact_1em7::FUNCTION{}, largest.bits);         \
    largest.print("float", #KERNEL " " #FUNCTION, "random pairs");
#define DOUBLE_ERRORS(KERNEL, FUNCTION)                                                                               \
    double_errors<<<4096, 256>>>(KERNEL::FUNCTION{}, viscopade_compact_1em7::FUNCTION{}, largest.bits);               \
    largest.print("double", #KERNEL " " #FUNCTION, "random pairs");

static void errors()
{
    Largest largest;

    function_errors<<<4096, 256>>>(largest.bits);
    const std::vector<double> worst = largest.read();
    std::printf("float   __log2f %.3f ulp, in [1/2, 2] %.3f 2^-22; exp2f %.3f ulp; __fdividef %.3f ulp\n", worst[0], worst[1],
                worst[2], worst[3]);
    FLOAT_ERRORS(viscopade_compact_1em3, restitution)
    FLOAT_ERRORS(viscopade_compact_1em3, rebound)
    FLOAT_ERRORS(viscopade_compact_1em3, dissipation)
    FLOAT_ERRORS(viscopade_compact_1em5, restitution)
    FLOAT_ERRORS(viscopade_compact_1em5, rebound)
    FLOAT_ERRORS(viscopade_compact_1em5, dissipation)
    DOUBLE_ERRORS(viscopade_compact_1em3, restitution)
    DOUBLE_ERRORS(viscopade_compact_1em3, rebound)
    DOUBLE_ERRORS(viscopade_compact_1em3, dissipation)
    DOUBLE_ERRORS(viscopade_compact_1em5, restitution)
    DOUBLE_ERRORS(viscopade_compact_1em5, rebound)
    DOUBLE_ERRORS(viscopade_compact_1em5, dissipation)
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
