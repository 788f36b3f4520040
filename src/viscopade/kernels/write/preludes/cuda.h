#if defined(VISCOPADE_INLINE) && !defined(VISCOPADE_FUNCTION)
#if defined(__CUDACC_RTC__) || defined(__HIPCC_RTC__) /* compilers at run time have no headers, and no host */
#define VISCOPADE_HAS_HOST 0
#else
#define VISCOPADE_HAS_HOST 1
#include <stddef.h>
#endif
#if defined(__HIPCC__) || defined(__HIPCC_RTC__)
#if VISCOPADE_HAS_HOST
#include <hip/hip_runtime.h>
#endif
#define VISCOPADE_RUNTIME(name) hip##name
#elif defined(__CUDACC__)
#define VISCOPADE_RUNTIME(name) cuda##name
#endif

#ifndef VISCOPADE_RUNTIME
#define VISCOPADE_FUNCTION VISCOPADE_INLINE
#define VISCOPADE_CALLED(function, kernel, T, name)
#else
#define VISCOPADE_FUNCTION VISCOPADE_INLINE __host__ __device__
/* viscopade_KERNEL::FUNCTION, a type whose objects are called with arguments of type double or float */
#define VISCOPADE_CALLED(function, kernel, T, name) namespace viscopade_##kernel { struct function##_##T { \
    template <typename... Rest> __device__ T operator()(T x, Rest... y) const { return name(x, y...); } }; }

template <typename Function, typename... Others> struct viscopade_all : Function, viscopade_all<Others...> {
    using Function::operator();
    using viscopade_all<Others...>::operator();
};
template <typename Function> struct viscopade_all<Function> : Function {};

/* The second argument, beta, of element i: one for all, one for each pair of materials, or one for each i. */
template <typename T> struct viscopade_beta_of_all {
    T beta;
    __device__ T operator()(size_t) const { return beta; }
};
template <typename T> struct viscopade_beta_of_pair {
    const int *pair;
    const T *beta;
    __device__ T operator()(size_t i) const { return beta[pair[i]]; }
};
template <typename T> struct viscopade_beta_of_each {
    const T *beta;
    __device__ T operator()(size_t i) const { return beta[i]; }
};

template <typename T> struct alignas(16) viscopade_pack { /* as many numbers as a thread loads at once */
    T x[16 / sizeof(T)];
};

/* The first 16 / sizeof(T) * packs elements in packs of 16 bytes, the others one by one. */
template <typename Function, typename T, typename Beta>
__global__ void viscopade_apply(size_t packs, size_t n, const T *speed, Beta beta, T *out)
{
    const size_t width = 16 / sizeof(T), stride = static_cast<size_t>(gridDim.x) * blockDim.x;
    const size_t first = static_cast<size_t>(blockIdx.x) * blockDim.x + threadIdx.x;
    const Function function{};

    for (size_t i = first; i < packs; i += stride) {
        viscopade_pack<T> pack = reinterpret_cast<const viscopade_pack<T> *>(speed)[i];
#pragma unroll
        for (size_t k = 0; k < width; k++) {
            pack.x[k] = function(pack.x[k], static_cast<T>(beta(width * i + k)));
        }
        reinterpret_cast<viscopade_pack<T> *>(out)[i] = pack;
    }
    for (size_t i = width * packs + first; i < n; i += stride) {
        out[i] = function(speed[i], static_cast<T>(beta(i)));
    }
}
#endif

/* Private: log2 and a quotient in type float; on the device the fast ones, for which the errors are proven. */
VISCOPADE_FUNCTION float viscopade_log2f(float x)
{
#ifdef __CUDA_ARCH__
    return __log2f(x);
#else
    return log2f(x);
#endif
}

VISCOPADE_FUNCTION float viscopade_dividef(float a, float b)
{
#ifdef __CUDA_ARCH__
    return __fdividef(a, b);
#else
    return a / b;
#endif
}
#endif
