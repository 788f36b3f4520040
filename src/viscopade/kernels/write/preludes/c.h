#ifndef VISCOPADE_INLINE
#if !defined(__cplusplus) && defined(__STRICT_ANSI__) && (!defined(__STDC_VERSION__) || __STDC_VERSION__ < 199901L)
#error "viscopade: expected C99 or later, or GNU's C89 (-std=gnu89)"
#elif defined(__SIZEOF_DOUBLE__) && __SIZEOF_DOUBLE__ != 8
#error "viscopade: expected a double of 64 bits, for which the errors are proven (on AVR: -mdouble=64)"
#else
#if !defined(__CUDACC_RTC__) && !defined(__HIPCC_RTC__) /* compilers at run time have no headers */
#include <math.h>
#endif

/* Not with -fsingle-precision-constant: it would break the bounds. */
typedef char viscopade_expected_constants_of_type_double[sizeof(0.0) == 8 ? 1 : -1];

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
#define VISCOPADE_KERNEL(identity)
#define VISCOPADE_KERNEL_END
#endif

/* C++ before C++17 has no hexadecimal constants; the decimal is rounded to the same number. */
#if defined(__cplusplus) && __cplusplus < 201703L
#define VISCOPADE_CONSTANT(hexadecimal, decimal) (decimal)
#else
#define VISCOPADE_CONSTANT(hexadecimal, decimal) (hexadecimal)
#endif
#endif
#endif
