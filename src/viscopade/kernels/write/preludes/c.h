#if !defined(VISCOPADE_INLINE) && !defined(VISCOPADE_REFUSED) /* refused once: the next header adds no error */
#if !defined(__cplusplus) && defined(__STRICT_ANSI__) && (!defined(__STDC_VERSION__) || __STDC_VERSION__ < 199901L)
#error "viscopade: expected C99 or later, or GNU's C89 (-std=gnu89)"
#define VISCOPADE_REFUSED
#elif defined(__SIZEOF_DOUBLE__) && __SIZEOF_DOUBLE__ != 8
#error "viscopade: expected a double of 64 bits, for which the errors are proven (on AVR: -mdouble=64)"
#define VISCOPADE_REFUSED
#else
#if !defined(__CUDACC_RTC__) && !defined(__HIPCC_RTC__) /* compilers at run time have no headers */
#include <math.h>
#endif

/* No preprocessor knows this option; in C++98 the name of the type is the sentence. */
#if defined(__cplusplus) && __cplusplus >= 201103L
static_assert(sizeof(0.0) == 8, "viscopade: expected no -fsingle-precision-constant, which breaks the proven errors");
#elif !defined(__cplusplus) && defined(__GNUC__) && __GNUC__ >= 5
#pragma push_macro("_Static_assert") /* in strict C99 the C library has a macro without the sentence */
#undef _Static_assert
__extension__ _Static_assert(sizeof(0.0) == 8,
    "viscopade: expected no -fsingle-precision-constant, which breaks the proven errors");
#pragma pop_macro("_Static_assert")
#else
typedef char viscopade_expected_no_fsingle_precision_constant[sizeof(0.0) == 8 ? 1 : -1];
#endif

/*
 * External linkage from C++17 on: templates that a module exports may call the functions. So, as with all inline
 * functions of C++, all files must have the same options (-march, -ffast-math). Different kernels of the same
 * name are in different namespaces, so that two translation units may each include one.
 */
#if defined(__cplusplus) && __cplusplus >= 201703L
#define VISCOPADE_INLINE inline
#define VISCOPADE_TABLE inline const
#define VISCOPADE_KERNEL(identity) inline namespace viscopade_##identity {
#define VISCOPADE_KERNEL_END }
#else
#define VISCOPADE_INLINE static inline
#define VISCOPADE_TABLE static const
#if defined(__GNUC__) && !defined(__cplusplus)
#define VISCOPADE_KERNEL(identity) \
    _Pragma("GCC diagnostic push") _Pragma("GCC diagnostic ignored \"-Wdeclaration-after-statement\"")
#define VISCOPADE_KERNEL_END _Pragma("GCC diagnostic pop")
#else
#define VISCOPADE_KERNEL(identity)
#define VISCOPADE_KERNEL_END
#endif
#endif

/* C++ before C++17 has no hexadecimal constants; the decimal is rounded to the same number. */
#if defined(__cplusplus) && __cplusplus < 201703L
#define VISCOPADE_CONSTANT(hexadecimal, decimal) (decimal)
#else
#define VISCOPADE_CONSTANT(hexadecimal, decimal) (hexadecimal)
#endif
#endif
#endif
