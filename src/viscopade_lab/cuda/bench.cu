/*
 * How close the compact kernels come to the GPU's copy bandwidth, and how far device and host differ, in ulp.
 *
 *     nvcc -O3 -std=c++17 -arch=native -I exports src/viscopade_lab/cuda/bench.cu -o bench && ./bench [elements]
 *
 * Rounds are interleaved; printed are minimum, median and maximum of the times, the median's ratio to that of the
 * copy (cudaMemcpyAsync within the device), and the largest difference to the host's result in ulp of the type.
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

static const int ROUNDS = 30;
static const size_t COMPARED = 1000000;

static void check(cudaError_t status)
{
    if (status != cudaSuccess) {
        std::fprintf(stderr, "bench: %s\n", cudaGetErrorString(status));
        std::exit(1);
    }
}

/* A candidate: its name, how it is launched, and its result on the host. */
template <typename T> struct Row {
    std::string name;
    std::function<void()> launch;
    std::function<T(T)> host;
    std::vector<float> times;
};

template <typename T> static double ulps(T found, T wanted)
{
    const T spacing = std::nextafter(wanted, static_cast<T>(INFINITY)) - wanted;
    return static_cast<double>(std::fabs(found - wanted) / spacing);
}

template <typename T> static void measure(const char *type, size_t n, std::vector<Row<T>> rows, const T *speed, const T *out)
{
    cudaEvent_t start, stop;
    std::vector<T> inputs(std::min(n, COMPARED)), results(inputs.size());

    check(cudaEventCreate(&start));
    check(cudaEventCreate(&stop));
    check(cudaMemcpy(inputs.data(), speed, inputs.size() * sizeof(T), cudaMemcpyDeviceToHost));
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
    const float copy = rows[0].times[ROUNDS / 2];
    for (Row<T> &row : rows) {
        double worst = 0;
        row.launch();
        check(cudaMemcpy(results.data(), out, results.size() * sizeof(T), cudaMemcpyDeviceToHost));
        for (size_t i = 0; i < results.size(); i++) {
            worst = std::max(worst, ulps(results[i], row.host(inputs[i])));
        }
        std::printf("%-6s %-32s %8.4f %8.4f %8.4f ms  %6.1f GB/s  %6.3f  %8.1f ulp\n", type, row.name.c_str(),
                    row.times.front(), row.times[ROUNDS / 2], row.times.back(),
                    2e-6 * static_cast<double>(n * sizeof(T)) / row.times[ROUNDS / 2], row.times[ROUNDS / 2] / copy,
                    worst);
    }
    check(cudaEventDestroy(start));
    check(cudaEventDestroy(stop));
}

/* Speeds that lead to v* = 1e-3 ... 10, log-uniform. */
template <typename T> static void run(const char *type, size_t n, const std::vector<Row<T>> &(*rows)(size_t, T *, T *))
{
    T *speed = nullptr, *out = nullptr;
    std::vector<T> values(n);
    std::mt19937 generator(1);
    std::uniform_real_distribution<float> exponent(-30.0f, 10.0f);

    for (T &value : values) {
        value = static_cast<T>(std::pow(10.0, static_cast<double>(exponent(generator))));
    }
    check(cudaMalloc(&speed, n * sizeof(T)));
    check(cudaMalloc(&out, n * sizeof(T)));
    check(cudaMemcpy(speed, values.data(), n * sizeof(T), cudaMemcpyHostToDevice));
    measure(type, n, rows(n, speed, out), speed, out);
    check(cudaFree(speed));
    check(cudaFree(out));
}

#define ROW(T, FUNCTION, KERNEL, HOST)                                                                                \
    {                                                                                                                 \
        #FUNCTION " " #KERNEL,                                                                                        \
            [=] { check(viscopade_launch<viscopade_##KERNEL::FUNCTION>(n, speed, viscopade_beta(T(1)), out)); },      \
            [](T v) { return viscopade_##FUNCTION##_##HOST(v, T(1)); }, {}                                            \
    }
#define COPY(T)                                                                                                       \
    {                                                                                                                 \
        "copy", [=] { check(cudaMemcpyAsync(out, speed, n * sizeof(T), cudaMemcpyDeviceToDevice)); },                 \
            [](T v) { return v; }, {}                                                                                 \
    }

static const std::vector<Row<float>> &rows_of_float(size_t n, float *speed, float *out)
{
    static std::vector<Row<float>> rows;
    rows = {COPY(float), ROW(float, restitution, compact_1em3, compact_1em3f),
            ROW(float, restitution, compact_1em5, compact_1em5f), ROW(float, rebound, compact_1em5, compact_1em5f),
            ROW(float, dissipation, compact_1em5, compact_1em5f)};
    return rows;
}

static const std::vector<Row<double>> &rows_of_double(size_t n, double *speed, double *out)
{
    static std::vector<Row<double>> rows;
    rows = {COPY(double), ROW(double, restitution, compact_1em3, compact_1em3),
            ROW(double, restitution, compact_1em5, compact_1em5),
            ROW(double, restitution, compact_1em7, compact_1em7),
            ROW(double, dissipation, compact_1em7, compact_1em7)};
    return rows;
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
    std::printf("%s, %zu elements, %d rounds; time (min, median, max), bandwidth, ratio to the copy, device - host\n",
                device.name, n, ROUNDS);
    run<float>("float", n, rows_of_float);
    run<double>("double", n, rows_of_double);
    return 0;
}
