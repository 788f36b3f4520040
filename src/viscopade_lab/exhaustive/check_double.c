/*
 * Compare a double kernel with the reference:
 *
 *     check_double FUNCTION sample LOW HIGH COUNT SEED BINS     COUNT random numbers, evenly distributed in the bits
 *                                                           from LOW to HIGH (both 64-bit integers)
 *     check_double FUNCTION given                           those on standard input, as bits
 *
 * In both it prints "largest ULPS BITS" of the largest error; sample prints "bins N_0 N_1 ...", how many errors are
 * in the BINS equal parts of [0, 1) ulp, before (the last takes all that are larger); given prints "error ULPS BITS
 * RESULT" for each number. Errors are in units in the last place of the true value.
 */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#include "full.h"
#include "reference.h"

static double from_bits(uint64_t bits)
{
    double x;

    memcpy(&x, &bits, sizeof x);
    return x;
}

/* SplitMix64 (Steele, Lea and Flood 2014). */
static uint64_t next(uint64_t *state)
{
    uint64_t z = *state += UINT64_C(0x9e3779b97f4a7c15);

    z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
    return z ^ (z >> 31);
}

static double kernel(int function, double v_star)
{
    return function == EPSILON ? viscopade_epsilon_full(v_star) : viscopade_one_minus_epsilon_full(v_star);
}

static double error_in_ulp(int function, double v_star)
{
    const double found = kernel(function, v_star);
    const long double truth = reference(function, v_star);
    const int exponent = truth > 0x1p-1022L ? ilogbl(truth) : -1022;

    return (double)ldexpl(fabsl(truth - (long double)found), 52 - exponent);
}

int main(int count, char **arguments)
{
    if (count < 3) {
        return 2;
    }
    const int function = atoi(arguments[1]);
    double largest = 0.0;
    uint64_t worst = 0;

    if (count == 8) {
        const uint64_t low = strtoull(arguments[3], NULL, 10);
        const uint64_t high = strtoull(arguments[4], NULL, 10);
        const uint64_t number = strtoull(arguments[5], NULL, 10);
        uint64_t state = strtoull(arguments[6], NULL, 10);
        const int bins = atoi(arguments[7]);
        uint64_t *found = calloc((size_t)bins, sizeof *found);

        if (found == NULL) {
            return 1;
        }
        for (uint64_t n = 0; n < number; n++) {
            const uint64_t bits = low + next(&state) % (high - low);
            const double error = error_in_ulp(function, from_bits(bits));
            const int bin = error < 1.0 ? (int)(error * bins) : bins - 1;

            found[bin]++;
            if (error > largest) {
                largest = error;
                worst = bits;
            }
        }
        printf("bins");
        for (int n = 0; n < bins; n++) {
            printf(" %" PRIu64, found[n]);
        }
        printf("\n");
        free(found);
    } else {
        uint64_t bits;

        while (scanf("%" SCNu64, &bits) == 1) {
            const double error = error_in_ulp(function, from_bits(bits));

            printf("error %.17g %" PRIu64 " %a\n", error, bits, kernel(function, from_bits(bits)));
            if (error > largest) {
                largest = error;
                worst = bits;
            }
        }
    }
    printf("largest %.17g %" PRIu64 "\n", largest, worst);
    return 0;
}
