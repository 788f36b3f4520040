/*
 * Functions of v* from the table of panels: the operations of viscopade.arrays.double in the same order, and so the same
 * bits, as the compiler contracts no products and sums.
 */
#include "native.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

/* As in viscopade.arrays.panels; the table has the functions in this order. */
enum { FIRST = -4, FOLD = 20, PERIOD = 3, SPLIT = 3, POWERS = 13, PANELS = 1 + ((FOLD + PERIOD - FIRST) << SPLIT) };
enum { EPSILON, LOSS, X_MAX, TAU_C, FUNCTIONS };

enum { MANTISSA = 52, BIAS = 1023, NEWTON_STEPS = 3 };
static const double LOG_PERIOD = 0x1.27be27f25daf2p+3; /* 40/9 ln 8 */

/* A function on a panel: high + (low + z (a_0 + z (a_1 + …))). */
typedef struct {
    double high, low, a[POWERS];
} row;

/* v* = 8^folds s; z = (s - centre)/w with the panel's half width w. */
typedef struct {
    int folds, panel;
    double z, s_over_w;
} place;

static place place_of(double v_star)
{
    const int free = MANTISSA - SPLIT; /* bits that do not tell the panel */
    const double v = v_star < 0x1p1023 ? v_star + 0.0 : 0x1p1023; /* -0.0 + 0.0 = 0.0 */
    uint64_t bits, leading;
    int exponent;
    place p = {0, 0, v * (1 << -FIRST), v * (1 << -FIRST)};
    memcpy(&bits, &v, sizeof bits);
    exponent = (int)(bits >> MANTISSA) - BIAS;
    if (exponent >= FIRST) {
        p.folds = exponent < FOLD ? 0 : (exponent - FOLD) / PERIOD;
        bits -= (uint64_t)(PERIOD * p.folds) << MANTISSA;
        p.panel = (int)(bits >> free) - ((BIAS + FIRST) << SPLIT) + 1;
        /* w is 2^-(SPLIT + 1) of the octave. */
        leading = (bits & (((uint64_t)1 << MANTISSA) - 1)) | (uint64_t)(BIAS + SPLIT + 1) << MANTISSA;
        memcpy(&p.s_over_w, &leading, sizeof leading);
        p.z = ((double)(bits & (((uint64_t)1 << free) - 1)) - 0x1p48) / 0x1p48;
    }
    return p;
}

static double value(const row *table, int function, place p)
{
    const row *r = table + PANELS * function + p.panel;
    double sum = r->a[POWERS - 1];
    for (int i = POWERS - 2; i >= 0; i--) {
        sum = sum * p.z + r->a[i];
    }
    return r->high + (r->low + p.z * sum);
}

static double function_of(const row *table, int function, double v_star)
{
    const place p = place_of(function == LOSS && v_star > 0x1p20 ? 0x1p20 : v_star);
    double found = value(table, function, p);
    if (p.folds == 0) {
        return found;
    }
    if (function == TAU_C) {
        found += LOG_PERIOD * p.folds * value(table, X_MAX, p);
    }
    return ldexp(found, (function == EPSILON ? -10 : -4) * p.folds);
}

/* v* of which 1 - eps (if elastic) or eps is `portion`, by Newton's method from a first guess. */
static double inverse(const row *table, double v_star, double portion, int elastic)
{
    for (int step = 0; step < NEWTON_STEPS; step++) {
        const place p = place_of(v_star);
        const row *r = table + PANELS * (elastic ? LOSS : EPSILON) + p.panel;
        const double scale = p.folds ? ldexp(1.0, -10 * p.folds) : 1.0;
        double sum = r->a[POWERS - 1], change = 0.0, residual;
        for (int i = POWERS - 2; i >= 0; i--) {
            change = change * p.z + sum;
            sum = sum * p.z + r->a[i];
        }
        change = (sum + p.z * change) * p.s_over_w;
        residual = (portion - scale * r->high) - scale * (r->low + p.z * sum);
        v_star += v_star * (residual / (scale * change));
    }
    return v_star;
}

/* panels(function, table, v_star, out): the function number `function` of the table at doubles. */
PyObject *viscopade_panels(PyObject *module, PyObject *args)
{
    int function;
    Py_buffer table, v_star, out;
    (void)module;
    if (!PyArg_ParseTuple(args, "iy*y*w*:panels", &function, &table, &v_star, &out)) {
        return NULL;
    }
    const int fits = function >= 0 && function < FUNCTIONS && v_star.len == out.len &&
                     table.len == FUNCTIONS * PANELS * (Py_ssize_t)sizeof(row);
    Py_BEGIN_ALLOW_THREADS
    for (Py_ssize_t i = 0; fits && i < out.len / (Py_ssize_t)sizeof(double); i++) {
        ((double *)out.buf)[i] = function_of(table.buf, function, ((const double *)v_star.buf)[i]);
    }
    Py_END_ALLOW_THREADS
    PyBuffer_Release(&table);
    PyBuffer_Release(&v_star);
    PyBuffer_Release(&out);
    return fits ? Py_NewRef(Py_None) : PyErr_Format(PyExc_ValueError, "arrays have other sizes than expected");
}

/* inverse(table, portion, elastic, v_star): replace first guesses of v*; portion and elastic (bytes) as in `inverse`. */
PyObject *viscopade_inverse(PyObject *module, PyObject *args)
{
    Py_buffer table, portion, elastic, v_star;
    (void)module;
    if (!PyArg_ParseTuple(args, "y*y*y*w*:inverse", &table, &portion, &elastic, &v_star)) {
        return NULL;
    }
    const Py_ssize_t n = elastic.len;
    const int fits = portion.len == n * (Py_ssize_t)sizeof(double) && v_star.len == portion.len &&
                     table.len == FUNCTIONS * PANELS * (Py_ssize_t)sizeof(row);
    Py_BEGIN_ALLOW_THREADS
    for (Py_ssize_t i = 0; fits && i < n; i++) {
        double *v = (double *)v_star.buf + i;
        *v = inverse(table.buf, *v, ((const double *)portion.buf)[i], ((const char *)elastic.buf)[i]);
    }
    Py_END_ALLOW_THREADS
    PyBuffer_Release(&table);
    PyBuffer_Release(&portion);
    PyBuffer_Release(&elastic);
    PyBuffer_Release(&v_star);
    return fits ? Py_NewRef(Py_None) : PyErr_Format(PyExc_ValueError, "arrays have other sizes than expected");
}
