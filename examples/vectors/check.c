/*
 * Checks the functions of a header against test vectors. From the repository's root:
 *
 *     cc -std=c99 -ffp-contract=off -I exports examples/vectors/check.c -lm -o check
 *     ./check exports/vectors_speed_1em5.json [bits]
 *
 * With "bits", results must also have the vectors' bits. Code compiled without fused products and sums
 * (-ffp-contract=off) has these bits. For another header, give its name, and its functions of one and two arguments:
 *
 *     -DHEADER='"viscopade_full.h"' -DFUNCTIONS='ONE(epsilon_full) ONE(one_minus_epsilon_full)'
 *     -DHEADER='"viscopade_speed_1em10.h"' -DFUNCTIONS='TWO(restitution_1em10)'
 *
 * and for type float ONEF, TWOF. Vectors of functions that are not named are left out. Exit status: 0 if all pass.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifndef HEADER
#define HEADER "viscopade_speed_1em5.h"
#define FUNCTIONS \
    TWO(restitution_1em5) TWO(rebound_1em5) TWO(dissipation_1em5) \
    TWOF(restitution_1em5) TWOF(rebound_1em5) TWOF(dissipation_1em5)
#endif
#include HEADER

/* The result of a function of this name and type; found = 0 if there is none. */
static double call(const char *function, const char *type, double x, double y, int *found)
{
    *found = 1;
#define IS(name, of) (strcmp(function, #name) == 0 && strcmp(type, of) == 0)
#define ONE(name) if (IS(name, "double")) { return viscopade_##name(x); }
#define TWO(name) if (IS(name, "double")) { return viscopade_##name(x, y); }
#define ONEF(name) if (IS(name, "float")) { return viscopade_##name##f((float)x); }
#define TWOF(name) if (IS(name, "float")) { return viscopade_##name##f((float)x, (float)y); }
    FUNCTIONS
    *found = 0;
    return (void)x, y;
}

static int same(double x, double y)
{
    return x == y || (isnan(x) && isnan(y));
}

int main(int count, char **words)
{
    char line[1024] = "", function[100], type[10], text[8][60];
    int exact_bits = count == 3 && strcmp(words[2], "bits") == 0;
    long all = 0, passed = 0;
    FILE *file = count > 1 ? fopen(words[1], "r") : NULL;

    if (count != 2 + exact_bits) {
        fprintf(stderr, "usage: %s VECTORS.json [bits]\n", words[0]);
        return 2;
    }
    if (file == NULL) {
        fprintf(stderr, "cannot read %s\n", words[1]);
        return 2;
    }
    while (fgets(line, sizeof line, file) != NULL) {
        /* function, type, x, y, exact, nearest, error, least, most, bits; "-" where there is none */
        int read = sscanf(line,
            "[\"%99[^\"]\", \"%9[^\"]\", \"%59[^\"]\", \"%59[^\"]\", \"%59[^\"]\", \"%59[^\"]\", \"%59[^\"]\", \"%59[^\"]\", "
            "\"%59[^\"]\", \"%59[^\"]\"",
            function, type, text[0], text[1], text[2], text[3], text[4], text[5], text[6], text[7]);
        double x, result, least, most;
        int found, pass;

        if (read != 10) {
            continue;
        }
        x = strtod(text[0], NULL), least = strtod(text[5], NULL), most = strtod(text[6], NULL);
        result = call(function, type, x, strtod(text[1], NULL), &found);
        if (!found) {
            continue;
        }
        pass = text[5][0] == '-' && text[5][1] == '\0' ? 1 : isnan(least) ? isnan(result) : least <= result && result <= most;
        if (exact_bits && strcmp(text[7], "-") != 0) {
            pass = pass && same(result, strtod(text[7], NULL));
        }
        all += 1;
        passed += pass;
        if (!pass) {
            printf("%a: %s", result, line);
        }
    }
    fclose(file);
    if (strstr(line, "]}") == NULL) {
        fprintf(stderr, "cannot read %s: it does not end as vectors do\n", words[1]);
        return 2;
    }
    printf("%ld of %ld pass\n", passed, all);
    if (all == 0) {
        fprintf(stderr, "no vector is of a function in FUNCTIONS: give -DHEADER and -DFUNCTIONS, as check.c says\n");
    }
    return passed == all && all > 0 ? 0 : 1;
}
