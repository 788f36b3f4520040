/*
 * Compare the full kernel in type double with the polynomials of src/viscopade/data/double.txt in type long double, whose
 * significand must have 64 bits or more:
 *
 *     exhaustive_double FUNCTION LOW HIGH COUNT SEED
 *
 * takes COUNT random v*, evenly distributed in the bits from LOW to below HIGH (both 64-bit integers), and prints
 * "ABOVE LARGEST V_STAR RESULT": how many errors are above 0.5, the largest, where it is, and the kernel's result there.
 * Errors are in units in the last place of the true value. The driver makes table.h, with the numbers of
 * viscopade.arrays.panels and
 *
 *     static const long double table[2][PANELS][1 + COEFFICIENTS];     a_0 = [0] + [1], a_1 = [2], ...
 */
#include <float.h>
#include <inttypes.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "full.h"
#include "table.h"

#if LDBL_MANT_DIG < 64
#error "long double is too short here to tell which results are rounded correctly"
#endif

enum { EPSILON, ONE_MINUS_EPSILON };

static long double reference(int function, double v_star)
{
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

/* SplitMix64 (Steele, Lea and Flood 2014). */
static uint64_t next(uint64_t *state)
{
    uint64_t z = *state += UINT64_C(0x9e3779b97f4a7c15);

    z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
    return z ^ (z >> 31);
}

int main(int count, char **arguments)
{
    if (count != 6) {
        return 2;
    }
    const int function = atoi(arguments[1]);
    const uint64_t low = strtoull(arguments[2], NULL, 10);
    const uint64_t high = strtoull(arguments[3], NULL, 10);
    const uint64_t number = strtoull(arguments[4], NULL, 10);
    uint64_t state = strtoull(arguments[5], NULL, 10), above = 0;
    double largest = -1.0, worst = 0.0, result = 0.0;

    for (uint64_t n = 0; n < number; n++) {
        const uint64_t bits = low + next(&state) % (high - low);
        double v_star;
        memcpy(&v_star, &bits, sizeof v_star);
        const double computed =
            function == EPSILON ? viscopade_epsilon_full(v_star) : viscopade_one_minus_epsilon_full(v_star);
        const long double truth = reference(function, v_star);
        const int exponent = truth > 0x1p-1022L ? ilogbl(truth) : -1022;
        const double error = (double)ldexpl(fabsl(truth - (long double)computed), 52 - exponent);

        above += error > 0.5;
        if (!(error <= largest)) {
            largest = error;
            worst = v_star;
            result = computed;
        }
    }
    printf("%" PRIu64 " %.17g %a %a\n", above, largest, worst, result);
    return 0;
}
