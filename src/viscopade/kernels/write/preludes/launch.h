#if defined(VISCOPADE_RUNTIME) && VISCOPADE_HAS_HOST && !defined(VISCOPADE_LAUNCH)
#define VISCOPADE_LAUNCH
/*
 * For n numbers in memory of the device: viscopade_launch<viscopade_KERNEL::FUNCTION>(n, speed, beta, out, stream), with
 * beta from viscopade_beta(beta), viscopade_beta_by_pair(pair, beta) or viscopade_beta_each(beta). speed and out have one
 * type, double or float; out may be speed, else they must not overlap. The result is the error code of CUDA or HIP.
 */
template <typename T> viscopade_beta_of_all<T> viscopade_beta(T beta)
{
    return viscopade_beta_of_all<T>{beta};
}

template <typename T> viscopade_beta_of_pair<T> viscopade_beta_by_pair(const int *pair, const T *beta)
{
    return viscopade_beta_of_pair<T>{pair, beta};
}

template <typename T> viscopade_beta_of_each<T> viscopade_beta_each(const T *beta)
{
    return viscopade_beta_of_each<T>{beta};
}

template <typename Function, typename T, typename Beta>
VISCOPADE_RUNTIME(Error_t) viscopade_launch(size_t n, const T *speed, Beta beta, T *out, VISCOPADE_RUNTIME(Stream_t) stream = 0)
{
    const size_t threads = 256, most_blocks = 1 << 20;
    const bool aligned = (reinterpret_cast<size_t>(speed) | reinterpret_cast<size_t>(out)) % 16 == 0;
    const size_t packs = aligned ? n / (16 / sizeof(T)) : 0;
    const size_t blocks = ((aligned ? packs : n) + threads - 1) / threads;

    if (n == 0) {
        return VISCOPADE_RUNTIME(Success);
    }
    viscopade_apply<Function><<<static_cast<unsigned>(blocks == 0 ? 1 : blocks < most_blocks ? blocks : most_blocks),
                                static_cast<unsigned>(threads), 0, stream>>>(packs, n, speed, beta, out);
    return VISCOPADE_RUNTIME(GetLastError)();
}
#endif
