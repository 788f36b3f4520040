/*
 * Compare a float kernel with the reference for the inputs of bits FIRST, FIRST + STEP, ... below END:
 *
 *     check_float FUNCTION FIRST END STEP
 *
 * prints "inputs N" and "largest ULPS BITS" (of the errors that are nearly 1/2 ulp or more), and a line for each result that is not rounded correctly ("wrong BITS
 * RESULT", the bits of both) or where the reference is too near a boundary of rounding to decide ("undecided BITS
 * RESULT"). "close BITS RESULT" are those nearer than 2^-27 ulp to a boundary, which is more than the proven error of
 * the kernel before its last rounding: there compilers that fuse other operations could differ.
 */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include "full.h"
#include "reference.h"

static float from_bits(uint32_t bits)
{
    float x;

    memcpy(&x, &bits, sizeof x);
    return x;
}

static uint32_t to_bits(float x)
{
    uint32_t bits;

    memcpy(&bits, &x, sizeof bits);
    return bits;
}

static void report(const char *word, uint64_t bits, float found)
{
    printf("%s %lu %lu\n", word, (unsigned long)bits, (unsigned long)to_bits(found));
}

int main(int count, char **arguments)
{
    if (count != 5) {
        return 2;
    }
    const int function = atoi(arguments[1]);
    const uint64_t first = strtoull(arguments[2], NULL, 10);
    const uint64_t end = strtoull(arguments[3], NULL, 10);
    const uint64_t step = strtoull(arguments[4], NULL, 10);
    uint64_t inputs = 0;
    uint32_t worst = 0;
    long double largest = 0.0L;

    for (uint64_t bits = first; bits < end; bits += step) {
        const float v_star = from_bits((uint32_t)bits);
        const float found = function == EPSILON ? viscopade_epsilon_fullf(v_star)
                                                : viscopade_one_minus_epsilon_fullf(v_star);

        inputs++;
        if (isnan(v_star) || isnan(found) || signbit(found)) {
            if (!(isnan(v_star) && isnan(found))) {
                report("wrong", bits, found);
            }
            continue;
        }

        const long double truth = reference(function, (double)v_star);
        const long double error = truth - (long double)found;
        const float above = from_bits(to_bits(found) + 1) - found;
        const float below = found > 0.0f ? found - from_bits(to_bits(found) - 1) : above;

        if (fabsl(error) < 0.499L * (long double)below) {
            continue;
        }

        const long double margin = fminl((long double)above / 2 - error, (long double)below / 2 + error);
        const int exponent = truth > 0x1p-126L ? ilogbl(truth) : -126;
        const long double ulps = fabsl(ldexpl(error, 23 - exponent));

        if (ulps > largest) {
            largest = ulps;
            worst = (uint32_t)bits;
        }
        if (ldexpl(fabsl(margin), 23 - exponent) < 0x1p-27L) {
            report("close", bits, found);
        }
        if (fabsl(margin) <= REFERENCE_ERROR * truth) {
            report("undecided", bits, found);
        } else if (margin < 0.0L) {
            report("wrong", bits, found);
        }
    }
    printf("inputs %lu\nlargest %.17Lg %lu\n", (unsigned long)inputs, largest, (unsigned long)worst);
    return 0;
}
