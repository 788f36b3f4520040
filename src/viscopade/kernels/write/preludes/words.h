#if defined(VISCOPADE_INLINE) && !defined(VISCOPADE_WORDS)
#define VISCOPADE_WORDS

#include <stdint.h>
#include <string.h>

#ifdef __cplusplus
#define VISCOPADE_AS(type, x) static_cast<type>(x)
#else
#define VISCOPADE_AS(type, x) ((type)(x))
#endif

/* Tables are hexadecimal: clang warns of each number before C++17, GCC in strict mode knows none. */
#if defined(__clang__) && defined(__cplusplus) && __cplusplus < 201703L
#define VISCOPADE_HEXADECIMAL _Pragma("clang diagnostic push") _Pragma("clang diagnostic ignored \"-Wc++17-extensions\"")
#define VISCOPADE_HEXADECIMAL_END _Pragma("clang diagnostic pop")
#else
#define VISCOPADE_HEXADECIMAL
#define VISCOPADE_HEXADECIMAL_END
#if defined(__cplusplus) && __cplusplus < 201703L && defined(__STRICT_ANSI__) && defined(__GNUC__)
#error "viscopade: expected C99, C++17, or the older C++ of GNU (-std=gnu++11): this table has hexadecimal constants"
#undef VISCOPADE_INLINE
#define VISCOPADE_REFUSED
#endif
#endif

#ifdef VISCOPADE_INLINE
/* Private: the bits of a number, and the number with these bits. */
VISCOPADE_INLINE uint64_t viscopade_bits(double x)
{
    uint64_t bits;

    memcpy(&bits, &x, sizeof bits);
    return bits;
}

VISCOPADE_INLINE double viscopade_from_bits(uint64_t bits)
{
    double x;

    memcpy(&x, &bits, sizeof x);
    return x;
}

VISCOPADE_INLINE uint32_t viscopade_bitsf(float x)
{
    uint32_t bits;

    memcpy(&bits, &x, sizeof bits);
    return bits;
}

VISCOPADE_INLINE float viscopade_from_bitsf(uint32_t bits)
{
    float x;

    memcpy(&x, &bits, sizeof x);
    return x;
}
#endif
#endif
