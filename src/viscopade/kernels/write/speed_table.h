/* == once == */

#ifndef VISCOPADE_SPEED
#define VISCOPADE_SPEED

#include <float.h>
#include <stddef.h>

#if defined(__GNUC__)
#define VISCOPADE_ALWAYS VISCOPADE_INLINE __attribute__((always_inline))
#if defined(__cplusplus)
#define VISCOPADE_SELDOM VISCOPADE_INLINE __attribute__((noinline, cold, unused))
#else
#define VISCOPADE_SELDOM static __attribute__((noinline, cold, unused))
#endif
#define VISCOPADE_EXPECT(condition) __builtin_expect(condition, 1)
/* Keeps compilers from loading rows by gather instructions, which are slower than single loads on many processors. */
#ifndef VISCOPADE_OPAQUE
#define VISCOPADE_OPAQUE(index) __asm__("" : "+r"(index))
#endif
/* For arrays on the stack: vectors do not cross cache lines. Clang does not see to it, and may be slower by a third. */
#define VISCOPADE_ALIGNED __attribute__((aligned(64)))
#define VISCOPADE_READ_SOON(address) __builtin_prefetch(address, 0)
#define VISCOPADE_WRITE_SOON(address) __builtin_prefetch(address, 1)
#else
#define VISCOPADE_ALWAYS VISCOPADE_INLINE
#define VISCOPADE_SELDOM VISCOPADE_INLINE
#define VISCOPADE_EXPECT(condition) (condition)
#define VISCOPADE_OPAQUE(index) ((void)0)
#define VISCOPADE_ALIGNED
#define VISCOPADE_READ_SOON(address) ((void)(address))
#define VISCOPADE_WRITE_SOON(address) ((void)(address))
#endif

/* Loops whose passes do not depend on each other; BY_FOUR reads numbers that were stored by four. */
#if defined(__clang__)
#define VISCOPADE_INDEPENDENT _Pragma("clang loop vectorize(assume_safety)")
#define VISCOPADE_INDEPENDENT_BY_FOUR _Pragma("clang loop vectorize(assume_safety) vectorize_width(4)")
#elif defined(__GNUC__)
#define VISCOPADE_INDEPENDENT _Pragma("GCC ivdep")
#define VISCOPADE_INDEPENDENT_BY_FOUR VISCOPADE_INDEPENDENT
#else
#define VISCOPADE_INDEPENDENT
#define VISCOPADE_INDEPENDENT_BY_FOUR
#endif

/*
 * Makes compilers read an array again in the next loop. Values taken over from the loop before would come out of vectors one by one (GCC),
 * or prevent vector instructions (Clang).
 */
#if defined(__GNUC__)
#define VISCOPADE_IN_MEMORY(array) __asm__("" : "+m"(array))
#else
#define VISCOPADE_IN_MEMORY(array) ((void)0)
#endif

/* AMD Zen 4, which Clang 14 and earlier take for a Zen 3 with AVX-512. */
#if defined(__AVX512F__) && (defined(__znver3__) || defined(__znver4__))
#define VISCOPADE_ON_ZEN_4 1
#else
#define VISCOPADE_ON_ZEN_4 0
#endif

/* For array functions with rows of more than two numbers. GCC takes vectors of 512 bits, but 256 are faster on Zen 4. */
#ifndef VISCOPADE_VECTORS
#if VISCOPADE_ON_ZEN_4 && defined(__GNUC__) && !defined(__clang__)
#define VISCOPADE_VECTORS __attribute__((target("prefer-vector-width=256")))
#else
#define VISCOPADE_VECTORS
#endif
#endif

/* Whether arrays are prefetched with rows of four floats or fewer. Zen 4 is faster by itself. */
#ifndef VISCOPADE_AHEAD_WITH_FEW
#define VISCOPADE_AHEAD_WITH_FEW !VISCOPADE_ON_ZEN_4
#endif

/*
 * Whether array functions choose their instruction set when they run: if the command line optimises and names no set with AVX. Not
 * on Windows, where GCC does not align vectors of 256 bits on the stack.
 */
#ifndef VISCOPADE_CHOICE
#if defined(__x86_64__) && defined(__GNUC__) && defined(__OPTIMIZE__) && !defined(__OPTIMIZE_SIZE__) && !defined(__AVX__) && \
    __STDC_HOSTED__ && !defined(_WIN32) && !defined(__EDG__) && !defined(__INTEL_COMPILER) && !defined(__CUDACC__)
#define VISCOPADE_CHOICE 1
#else
#define VISCOPADE_CHOICE 0
#endif
#endif

/* Rows of two numbers are gathered on processors with AVX-512 BF16 (Sapphire Rapids, Zen 4, and later): faster there. */
#ifndef VISCOPADE_GATHER_TWO
#if defined(__AVX512BF16__)
#define VISCOPADE_GATHER_TWO 1
#else
#define VISCOPADE_GATHER_TWO 0
#endif
#endif
#define VISCOPADE_GATHERED(numbers, set) ((numbers) <= 2 && (VISCOPADE_GATHER_TWO || (set) == VISCOPADE_AVX512))

/* Whether vectors hold four numbers, or two. */
#ifndef VISCOPADE_BY_FOUR
#if defined(__AVX__)
#define VISCOPADE_BY_FOUR 1
#else
#define VISCOPADE_BY_FOUR 0
#endif
#endif

/* Instruction sets of array functions: that of the command line, and those that are chosen. */
enum { VISCOPADE_COMPILED, VISCOPADE_AVX2, VISCOPADE_AVX512 };

/* Vectors of numbers chosen from two others; older versions of GCC have __builtin_shuffle. */
#if defined(__has_builtin)
#if __has_builtin(__builtin_shufflevector)
#define VISCOPADE_JOINED(a, b) __builtin_shufflevector(a, b, 0, 1, 2, 3)
#define VISCOPADE_TWO(a, b, i, j) __builtin_shufflevector(a, b, i, j)
#define VISCOPADE_FOUR(a, b, i, j, k, l) __builtin_shufflevector(a, b, i, j, k, l)
#endif
#endif
#if defined(__GNUC__) && !defined(VISCOPADE_JOINED) && !defined(__EDG__) && !defined(__INTEL_COMPILER) && !defined(__CUDACC__)
#if defined(__AVX__)
#include <immintrin.h>
#define VISCOPADE_JOINED(a, b) _mm256_insertf128_pd(_mm256_castpd128_pd256(a), b, 1)
#else
#define VISCOPADE_JOINED(a, b) { a[0], a[1], b[0], b[1] }
#endif
#define VISCOPADE_TWO(a, b, i, j) __builtin_shuffle(a, b, __extension__(viscopade_places){ i, j })
#define VISCOPADE_FOUR(a, b, i, j, k, l) __builtin_shuffle(a, b, __extension__(viscopade_places){ i, j, k, l })
#endif

/* The first two numbers of four rows, stored as parts of two columns. A load that takes numbers from several stores would wait for them. */
VISCOPADE_ALWAYS void viscopade_columns(const double *row0, const double *row1, const double *row2, const double *row3, double *column0,
    double *column1, int set)
{
#if defined(VISCOPADE_JOINED)
    typedef double viscopade_two __attribute__((vector_size(16)));
    viscopade_two a, b, c, d;

    memcpy(&a, row0, sizeof a);
    memcpy(&b, row1, sizeof b);
    memcpy(&c, row2, sizeof c);
    memcpy(&d, row3, sizeof d);
    if (VISCOPADE_BY_FOUR || set != VISCOPADE_COMPILED) {
        typedef double viscopade_four __attribute__((vector_size(32)));
        typedef long long viscopade_places __attribute__((vector_size(32), unused));
        const viscopade_four even = VISCOPADE_JOINED(a, c), odd = VISCOPADE_JOINED(b, d);
        const viscopade_four first = VISCOPADE_FOUR(even, odd, 0, 4, 2, 6), second = VISCOPADE_FOUR(even, odd, 1, 5, 3, 7);

        memcpy(column0, &first, sizeof first);
        memcpy(column1, &second, sizeof second);
    } else {
        typedef long long viscopade_places __attribute__((vector_size(16), unused));
        const viscopade_two first = VISCOPADE_TWO(a, b, 0, 2), second = VISCOPADE_TWO(a, b, 1, 3);
        const viscopade_two third = VISCOPADE_TWO(c, d, 0, 2), fourth = VISCOPADE_TWO(c, d, 1, 3);

        memcpy(column0, &first, sizeof first);
        memcpy(column1, &second, sizeof second);
        memcpy(column0 + 2, &third, sizeof third);
        memcpy(column1 + 2, &fourth, sizeof fourth);
    }
#else
    (void)set;
    column0[0] = row0[0];
    column0[1] = row1[0];
    column0[2] = row2[0];
    column0[3] = row3[0];
    column1[0] = row0[1];
    column1[1] = row1[1];
    column1[2] = row2[1];
    column1[3] = row3[1];
#endif
}

/*
 * An array function, whose body has a constant `set`: compiled for the command line's set and, if there is a choice, for others, of
 * which it calls the best that the processor has. Before the C library is ready, that is the first. All give the same bits, as no
 * products and sums are contracted: AVX2 has no instructions for that, and with AVX-512 GCC (from 11 on) is told so. Clang gains
 * nothing by AVX-512, nor do processors without BF16, whose gathers are slow.
 */
#if VISCOPADE_CHOICE && !defined(__clang__) && __GNUC__ >= 11
#define VISCOPADE_WITH_AVX512(name, parameters, body) \
    VISCOPADE_INLINE __attribute__((target("avx512f,avx512vl,avx512bw,avx512dq"), optimize("O3", "fp-contract=off"), flatten)) \
    void name##_avx512 parameters \
    { \
        const int set = VISCOPADE_AVX512; \
        body; \
    }
#define VISCOPADE_IF_AVX512(call) \
    if (__builtin_cpu_supports("avx512bf16") && __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw") && \
        __builtin_cpu_supports("avx512dq")) { \
        call; \
        return; \
    }
#else
#define VISCOPADE_WITH_AVX512(name, parameters, body)
#define VISCOPADE_IF_AVX512(call)
#endif
#if VISCOPADE_CHOICE
#define VISCOPADE_ARRAYS(name, parameters, arguments, body) \
    VISCOPADE_WITH_AVX512(name, parameters, body) \
    VISCOPADE_INLINE __attribute__((target("avx2"), flatten)) void name##_avx2 parameters \
    { \
        const int set = VISCOPADE_AVX2; \
        body; \
    } \
    VISCOPADE_INLINE void name parameters \
    { \
        const int set = VISCOPADE_COMPILED; \
        VISCOPADE_IF_AVX512(name##_avx512 arguments) \
        if (__builtin_cpu_supports("avx2")) { \
            name##_avx2 arguments; \
            return; \
        } \
        body; \
    }
#else
#define VISCOPADE_ARRAYS(name, parameters, arguments, body) \
    VISCOPADE_INLINE void name parameters \
    { \
        const int set = VISCOPADE_COMPILED; \
        body; \
    }
#endif

enum { VISCOPADE_EPSILON, VISCOPADE_REBOUND, VISCOPADE_DISSIPATION };

#endif

/* == about == */

/*
 * FORMULA
 *
 * PROVEN
 *
 * For n speeds at once, with restitution, rebound or dissipation for FUNCTION, in double and (names that end in f) in float:
 *
 *     viscopade_FUNCTION_array_KERNEL(n, speed, beta, out)            one beta
 *     viscopade_FUNCTION_by_pair_KERNEL(n, speed, pair, beta, out)    beta[pair[i]], one for each pair of materials
 *     viscopade_FUNCTION_each_KERNEL(n, speed, beta, out)             beta[i], one for each speed
 *
 * out may be speed; other overlaps are not allowed. There is no state: threads may call everything at once. The results equal
 * the single calls (bit for bit without -ffast-math, if the compiler contracts products and sums alike). GCC and
 * Clang make vector instructions of them at -O3, for the machine that -march names. Without -march on x86-64, -O2 is enough: the
 * functions choose AVX2 or AVX-512 when they run (VISCOPADE_CHOICE).
 *
 * These functions and those of a single speed are public; all others of the table (viscopade_one_KERNEL, ...) are private.
 */

/* == type == */

/* beta^5, by which the speed is multiplied. */
VISCOPADE_ALWAYS REAL viscopade_scale_NAME(REAL beta)
{
    const REAL b2 = B2;

    return SCALE;
}

/* Distance of w's bits from the bits of the table's first number: less than 128 octaves if w is in the table. */
VISCOPADE_ALWAYS WORD viscopade_place_NAME(REAL w)
{
    return PLACE;
}

/* 1 where the table holds eps - 1, else 0, by the exponent of w: for single calls. */
VISCOPADE_TABLE REAL viscopade_bases_NAME[128] = {
    BASES
};

/* The same for vector instructions; a comparison could become a branch. */
VISCOPADE_ALWAYS REAL viscopade_base_NAME(WORD place)
{
    return BASE;
}

/*
 * The result by a row of the table: p = eps - base. 1 - base is made of bits: with -ffast-math a difference would be drawn
 * into the sum that it is for, and digits lost.
 */
VISCOPADE_ALWAYS REAL viscopade_inside_NAME(WORD place, REAL base, REAL speed, int what,
    PARAMETERS)
{
    STATEMENTS

    if (what == VISCOPADE_DISSIPATION) {
        return DISSIPATION;
    }
    return what == VISCOPADE_REBOUND ? REBOUND : RESTITUTION;
}

/* Where the table does not help. */
VISCOPADE_SELDOM REAL viscopade_elsewhere_NAME(REAL speed, REAL beta, int what)
{
    const double v_star = VALID ? BEYOND_V_STAR : nan("");
    const double eps = BEYOND_EPS;

    if (what == VISCOPADE_DISSIPATION) {
        return BEYOND_DISSIPATION;
    }
    if (what == VISCOPADE_REBOUND) {
        return BEYOND_REBOUND;
    }
    return BEYOND_RESTITUTION;
}

VISCOPADE_ALWAYS REAL viscopade_one_NAME(REAL speed, REAL beta, int what)
{
    const REAL scale = viscopade_scale_NAME(beta);
    const REAL w = scale * speed;
    const WORD place = viscopade_place_NAME(w);

    if (VISCOPADE_EXPECT(INSIDE)) {
        const NUMBER *c = viscopade_table_KERNEL[INDEX];

        return viscopade_inside_NAME(place, viscopade_bases_NAME[OCTAVE], speed, what,
            ROW);
    }
    return viscopade_elsewhere_NAME(speed, beta, what);
}

/*
 * BLOCK speeds at a time: places in the table, then their rows, then the sums; the first and last of these loops are for
 * vector instructions. beta is one number, or one for each speed (each = 1).
 */
VISCOPADE_ALWAYS void viscopade_block_NAME(const REAL *speed, const REAL *beta, int each, REAL *out, int what, int set)
{
    VISCOPADE_ALIGNED WORD place[BLOCK];
    VISCOPADE_ALIGNED LOADED
    WORD beyond = 0;
    const REAL common = viscopade_scale_NAME(beta[0]);
    WORD usual = common >= SMALLEST;
    size_t i;

    for (i = 0; i < BLOCK; ++i) {
        const REAL scale = each ? viscopade_scale_NAME(beta[i]) : common;

        place[i] = viscopade_place_NAME(scale * speed[i]);
        beyond |= place[i];
        usual &= !each || scale >= SMALLEST;
    }
    if (!VISCOPADE_EXPECT((beyond >> END_SHIFT) == 0 && usual)) {
        for (i = 0; i < BLOCK; ++i) {
            out[i] = viscopade_one_NAME(speed[i], beta[each ? i : 0], what);
        }
        return;
    }
    LOAD
    for (i = 0; i < BLOCK; ++i) {
        out[i] = viscopade_inside_NAME(place[i], viscopade_base_NAME(place[i]), speed[i], what,
            ROW_OF_BLOCK);
    }
}

/* pair = NULL: beta is one number (each = 0) or one for each speed; otherwise beta[pair[i]] belongs to speed i. */
VISCOPADE_ALWAYS void viscopade_many_NAME(size_t n, const REAL *speed, const int *pair, const REAL *beta, int each,
    REAL *out, int what, int set)
{
    VISCOPADE_ALIGNED REAL of_pair[BLOCK];
    const size_t whole = n - n % BLOCK;
    size_t start, i;

    for (start = 0; start < whole; start += BLOCK) {
        for (i = 0; PREFETCH && i < BLOCK && n - start >= AHEAD + BLOCK; i += LINE) {
            VISCOPADE_READ_SOON(speed + start + AHEAD + i);
            VISCOPADE_WRITE_SOON(out + start + AHEAD / 2 + i); /* not as far: the arrays may lie alike in the cache */
        }
        for (i = 0; pair != NULL && i < BLOCK; ++i) {
            int at = pair[start + i];

            if (!VISCOPADE_GATHERED(WIDTH, set)) {
                VISCOPADE_OPAQUE(at);
            }
            of_pair[i] = beta[at];
        }
        viscopade_block_NAME(speed + start, pair != NULL ? of_pair : beta + (each ? start : 0), each, out + start, what, set);
    }
    for (i = whole; i < n; ++i) {
        const REAL b = beta[pair != NULL ? VISCOPADE_AS(size_t, pair[i]) : each ? i : 0];

        out[i] = viscopade_one_NAME(speed[i], b, what);
    }
}

/* == rows in columns == */
VISCOPADE_IN_MEMORY(place);
for (i = 0; i < BLOCK; i += 4) {
    const double *row0 = viscopade_table_KERNEL[INDEX_0];
    const double *row1 = viscopade_table_KERNEL[INDEX_1];
    const double *row2 = viscopade_table_KERNEL[INDEX_2];
    const double *row3 = viscopade_table_KERNEL[INDEX_3];

    COLUMNS
}
VISCOPADE_INDEPENDENT_BY_FOUR

/* == rows == */
for (i = 0; i < BLOCK; ++i) {
    WORD index = INDEX_0;

    if (!VISCOPADE_GATHERED(WIDTH, set)) {
        VISCOPADE_OPAQUE(index);
    }
    memcpy(c[i], viscopade_table_KERNEL[index], sizeof c[i]);
}
#if defined(__clang__)
VISCOPADE_IN_MEMORY(place);
#endif
VISCOPADE_INDEPENDENT

/* == function == */

VISCOPADE_INLINE REAL viscopade_FUNCTION_NAME(REAL speed, REAL beta)
{
    return ONE;
}

VECTORS VISCOPADE_ARRAYS(viscopade_FUNCTION_array_NAME, (size_t n, const REAL *speed, REAL beta, REAL *out),
    (n, speed, beta, out), viscopade_many_NAME(n, speed, NULL, &beta, 0, out, VISCOPADE_WHAT, set))

VECTORS VISCOPADE_ARRAYS(viscopade_FUNCTION_by_pair_NAME,
    (size_t n, const REAL *speed, const int *pair, const REAL *beta, REAL *out),
    (n, speed, pair, beta, out), viscopade_many_NAME(n, speed, pair, beta, 1, out, VISCOPADE_WHAT, set))

VECTORS VISCOPADE_ARRAYS(viscopade_FUNCTION_each_NAME, (size_t n, const REAL *speed, const REAL *beta, REAL *out),
    (n, speed, beta, out), viscopade_many_NAME(n, speed, NULL, beta, 1, out, VISCOPADE_WHAT, set))

/* == float by double == */

/* Type float: computed in type double, and rounded. */
VISCOPADE_ALWAYS void viscopade_many_NAME(size_t n, const float *speed, const int *pair, const float *beta, int each, float *out,
    int what, int set)
{
    VISCOPADE_ALIGNED double speeds[BLOCK], betas[BLOCK], results[BLOCK];
    const size_t whole = n - n % BLOCK;
    size_t start, i;

    betas[0] = pair != NULL || n == 0 ? 0.0 : VISCOPADE_AS(double, beta[0]);
    for (start = 0; start < whole; start += BLOCK) {
        for (i = 0; i < BLOCK; ++i) {
            speeds[i] = VISCOPADE_AS(double, speed[start + i]);
        }
        for (i = 0; each && i < BLOCK; ++i) {
            betas[i] = VISCOPADE_AS(double, beta[pair != NULL ? VISCOPADE_AS(size_t, pair[start + i]) : start + i]);
        }
        viscopade_block_KERNEL(speeds, betas, each, results, what, set);
        for (i = 0; i < BLOCK; ++i) {
            out[start + i] = VISCOPADE_AS(float, results[i]);
        }
    }
    for (i = whole; i < n; ++i) {
        const double b = VISCOPADE_AS(double, beta[pair != NULL ? VISCOPADE_AS(size_t, pair[i]) : each ? i : 0]);

        out[i] = VISCOPADE_AS(float, viscopade_one_KERNEL(VISCOPADE_AS(double, speed[i]), b, what));
    }
}
