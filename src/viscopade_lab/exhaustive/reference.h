/*
 * eps and 1 - eps for the checks, by the polynomials of src/viscopade/data/double.txt in type long double, whose
 * significand must have 64 bits or more. table.h, made by the driver, holds
 *
 *     static const long double table[2][PANELS][1 + COEFFICIENTS];     a_0 = [0] + [1], a_1 = [2], ...
 *
 * and FIRST, SPLIT, FOLD and PERIOD of viscopade.arrays.double.
 */
#ifndef REFERENCE_H
#define REFERENCE_H

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "table.h"

#if LDBL_MANT_DIG < 64
#error "long double is too short here to tell which results are rounded correctly"
#endif

enum { EPSILON, ONE_MINUS_EPSILON };

/* Relative: rounding errors here (below 4 in units of 2^-64), and what the table may be off. */
static const long double REFERENCE_ERROR = 0x1p-59L;

static inline long double reference(int function, double v_star)
{
    if (v_star == 0.0) {
        return function == EPSILON ? 1.0L : 0.0L;
    }
    if (isinf(v_star)) {
        return function == EPSILON ? 0.0L : 1.0L;
    }
    if (function == ONE_MINUS_EPSILON && v_star > 0x1p+20) { /* there 2^-66 and less is missing to 1 */
        v_star = 0x1p+20;
    }

    uint64_t bits;
    memcpy(&bits, &v_star, sizeof bits);

    int exponent = (int)(bits >> 52) - 1023;
    const int folds = exponent >= FOLD + PERIOD ? (exponent - FOLD) / PERIOD : 0;
    exponent -= PERIOD * folds;

    int panel = 0;
    long double z = (long double)v_star * (1 << -FIRST);
    if (exponent >= FIRST) {
        const int64_t fraction = (int64_t)(bits & ((UINT64_C(1) << 52) - 1));
        const int64_t part = fraction >> (52 - SPLIT);
        const int64_t half = INT64_C(1) << (52 - SPLIT - 1);

        panel = 1 + ((exponent - FIRST) << SPLIT) + (int)part;
        z = (long double)(fraction - (2 * part + 1) * half) / (long double)half;
    }

    const long double *a = table[function][panel];
    long double sum = a[COEFFICIENTS];
    for (int n = COEFFICIENTS - 1; n >= 3; n--) {
        sum = a[n] + z * sum;
    }
    if (function == ONE_MINUS_EPSILON && panel == 0) {
        return z * z * sum; /* a_0 = a_1 = 0 */
    }
    sum = a[0] + (a[1] + z * (a[2] + z * sum));
    return folds ? ldexpl(sum, -10 * folds) : sum;
}

#endif
