/*
 * Compare the float functions of a kernel from speed to eps with viscopade_full.h in type double, for beta = 1 and the
 * speeds of bits FIRST, FIRST + STEP, ... below END, all positive:
 *
 *     exhaustive_float FIRST END STEP
 *
 * prints for each function "FUNCTION PART SPEED BEYOND INPUTS": the largest error as a part of the bound, where it is, and
 * how many of how many exceed the bound; and "differ N", how many results of arrays are not the single ones.
 *
 * bounds.h, made by the driver, holds
 *
 *     LOW, HIGH            the ends of the table, in w
 *     INSIDE, OUTSIDE      bounds of the relative error of the smaller of eps and 1 - eps before eps is rounded
 *     NAME(function)       the name of a function
 */
#include <inttypes.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "full.h"
#include "speed.h"

#include "bounds.h"

enum { FUNCTIONS = 3, BLOCK = 1024 };
static const char *const names[FUNCTIONS] = {"restitution", "rebound", "dissipation"};

/* The error of the reference: pow, and eps and 1 - eps in type double. */
static const double REFERENCE = 1e-14;

/* What is added to the bounds of rebound and dissipation, in units in the last place. */
static const double ULPS = 3.5;

static float from_bits(uint32_t bits)
{
    float x;

    memcpy(&x, &bits, sizeof x);
    return x;
}

/* The unit in the last place of a float at a number >= 0. */
static double unit(double x)
{
    uint64_t bits;

    memcpy(&bits, &x, sizeof bits);
    const int exponent = (int)(bits >> 52) - 1023;

    return ldexp(1.0, (exponent > -126 ? exponent : -126) - 23);
}

int main(int count, char **arguments)
{
    if (count != 4) {
        return 2;
    }
    const uint64_t first = strtoull(arguments[1], NULL, 10);
    const uint64_t end = strtoull(arguments[2], NULL, 10);
    const uint64_t step = strtoull(arguments[3], NULL, 10);
    double largest[FUNCTIONS] = {0.0, 0.0, 0.0}, worst[FUNCTIONS] = {0.0, 0.0, 0.0};
    uint64_t beyond[FUNCTIONS] = {0, 0, 0}, inputs = 0, differ = 0;
    static float speed[BLOCK], found[FUNCTIONS][BLOCK];

    for (uint64_t start = first; start < end; start += BLOCK * step) {
        size_t n = 0;

        for (uint64_t bits = start; bits < end && n < BLOCK; bits += step) {
            speed[n++] = from_bits((uint32_t)bits);
        }
        NAME(restitution_array)(n, speed, 1.0f, found[0]);
        NAME(rebound_array)(n, speed, 1.0f, found[1]);
        NAME(dissipation_array)(n, speed, 1.0f, found[2]);
        inputs += n;
        for (size_t i = 0; i < n; i++) {
            const double w = (double)speed[i];
            const double v_star = pow(w, 0.1);
            const double eps = viscopade_epsilon_full(v_star);
            const double loss = viscopade_one_minus_epsilon_full(v_star);
            const double smaller = eps < loss ? eps : loss;
            const double relative = w >= LOW && w < HIGH ? INSIDE : OUTSIDE;
            const double truth[FUNCTIONS] = {eps, eps * w, loss * (1.0 + eps)};
            const float single[FUNCTIONS] = {NAME(restitution)(speed[i], 1.0f), NAME(rebound)(speed[i], 1.0f),
                                             NAME(dissipation)(speed[i], 1.0f)};

            for (int k = 0; k < FUNCTIONS; k++) {
                const double size = k == 0 ? smaller : truth[k];
                const double bound = (relative + REFERENCE) * size + (k == 0 ? 0.5 : ULPS) * unit(truth[k]) +
                                     REFERENCE * truth[k];
                const double part = fabs((double)single[k] - truth[k]) / bound;

                differ += single[k] != found[k][i];
                beyond[k] += !(part <= 1.0);
                if (!(part <= largest[k])) {
                    largest[k] = part;
                    worst[k] = w;
                }
            }
        }
    }
    for (int k = 0; k < FUNCTIONS; k++) {
        printf("%s %.17g %a %" PRIu64 " %" PRIu64 "\n", names[k], largest[k], worst[k], beyond[k], inputs);
    }
    printf("differ %" PRIu64 "\n", differ);
    return 0;
}
