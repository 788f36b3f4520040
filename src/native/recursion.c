/*
 * Taylor coefficients of the flow of a collision: the same integers as those of viscopade.collision.recursion.
 *
 * A number is a sum of digits d_a 2^(56 a), -2^55 <= d_a <= 2^55, so the high digits of small numbers of either sign are
 * zero. A sequence of coefficients stores digit a of all of them together: a coefficient of a product is then, for each
 * pair of digits, one short sum of products of 64-bit integers.
 */
#include "native.h"

#ifdef __SIZEOF_INT128__

#include <stdint.h>
#include <string.h>

__extension__ typedef __int128 wide;
__extension__ typedef unsigned __int128 unsigned_wide;

enum { DIGIT_BITS = 56, DIGIT_BYTES = 7, MOST_DIGITS = 128, MOST_POWERS = 16 };
enum { MOST_PRODUCTS = 1 << 15 }; /* in a column, each at most 2^110 */

static const uint64_t MASK = ((uint64_t)1 << DIGIT_BITS) - 1;

typedef struct {
    int64_t *digits[MOST_DIGITS]; /* digits[a][i] is digit a of coefficient i */
    int lengths[MOST_DIGITS];     /* digits[a] is zero from there on */
} sequence;

/* A sum, columns[c] 2^(56 c), and whether all results until now have n digits. */
typedef struct {
    int n, fits;
    wide columns[2 * MOST_DIGITS + 1];
} sum;

/* Add coefficient j of the product of two sequences. */
static void add_product(sum *total, const sequence *s, const sequence *t, int j)
{
    for (int a = 0; a < total->n; a++) {
        for (int b = s == t ? a : 0; b < total->n; b++) {
            const int64_t *x = s->digits[a], *y = t->digits[b] + j;
            const int first = j < t->lengths[b] ? 0 : j - t->lengths[b] + 1;
            const int end = j < s->lengths[a] ? j + 1 : s->lengths[a];
            wide column = 0;
#pragma GCC unroll 4
            for (int i = first; i < end; i++) {
                column += (wide)x[i] * y[-i];
            }
            /* In a square the pairs (a, b) and (b, a) are equal. */
            total->columns[a + b] += s == t && a != b ? 2 * column : column;
        }
    }
}

/* Add s_i t_j. */
static void add_number(sum *total, const sequence *s, int i, const sequence *t, int j)
{
    for (int a = 0; a < total->n; a++) {
        for (int b = 0; b < total->n; b++) {
            total->columns[a + b] += (wide)s->digits[a][i] * t->digits[b][j];
        }
    }
}

/* Add factor s_i. */
static void add_multiple(sum *total, int factor, const sequence *s, int i)
{
    for (int a = 0; a < total->n; a++) {
        total->columns[a] += (wide)factor * s->digits[a][i];
    }
}

/* Let s_i be the sum/2^right, rounded down, over the divisor, rounded down again; begin a new sum. */
static void store(sum *total, long long right, int divisor, sequence *s, int i)
{
    const int n = total->n, count = 2 * n + 1, shift = (int)(right % DIGIT_BITS);
    const int skipped = right < count * DIGIT_BITS ? (int)(right / DIGIT_BITS) : count;
    const int top = count - skipped > n ? count - skipped : n;
    uint64_t digits[2 * MOST_DIGITS + 1], sign, remainder;
    int64_t digit, carried = 0;
    wide carry = 0;

    /* Two's complement, of which a shift to the right rounds down: digits from 0 to 2^56 - 1, and above them the sign. */
    for (int c = 0; c < count; c++) {
        carry += total->columns[c];
        digits[c] = (uint64_t)carry & MASK;
        carry >>= DIGIT_BITS;
    }
    sign = (uint64_t)carry & MASK;
    for (int e = 0; e < top; e++) {
        const uint64_t low = e + skipped < count ? digits[e + skipped] : sign;
        const uint64_t high = e + skipped + 1 < count ? digits[e + skipped + 1] : sign;
        digits[e] = (low >> shift | high << (DIGIT_BITS - shift)) & MASK;
    }

    /* Division digit by digit; the quotient has the same sign. */
    remainder = sign ? (unsigned)divisor - 1 : 0;
    for (int e = top - 1; e >= 0 && divisor > 1; e--) {
        const unsigned_wide dividend = (unsigned_wide)remainder << DIGIT_BITS | digits[e];
        digits[e] = (uint64_t)(dividend / (unsigned)divisor);
        remainder = (uint64_t)(dividend % (unsigned)divisor);
    }

    /* Digits from -2^55 to 2^55 - 1; those beyond the n-th are zero if the number fits. */
    for (int e = 0; e < top; e++) {
        digit = (int64_t)digits[e] + carried;
        carried = digit >> (DIGIT_BITS - 1) != 0;
        digit -= carried << DIGIT_BITS;
        if (e >= n) {
            total->fits &= digit == 0;
        } else {
            s->digits[e][i] = digit;
            s->lengths[e] = digit != 0 && s->lengths[e] <= i ? i + 1 : s->lengths[e];
        }
    }
    total->fits &= carried == (sign != 0);
    memset(total->columns, 0, (size_t)count * sizeof *total->columns);
}

/* A number in two's complement: from Python's bytes, and into them. */
static void unpack(sum *total, const char *bytes, sequence *s, int i)
{
    const int size = DIGIT_BYTES * total->n;
    for (int b = size - 1; b >= 0; b--) {
        wide *column = &total->columns[b / DIGIT_BYTES];
        *column = *column * 256 + (unsigned char)bytes[b];
    }
    total->columns[total->n] = bytes[size - 1] & 0x80 ? -1 : 0;
    store(total, 0, 1, s, i);
}

static void pack(int n, const sequence *s, int i, unsigned char *bytes)
{
    int64_t rest = 0;
    for (int a = 0; a < n; a++) {
        rest += s->digits[a][i];
        for (int b = 0; b < DIGIT_BYTES; b++, rest >>= 8) {
            *bytes++ = (unsigned char)(rest & 0xff);
        }
    }
}

/*
 * taylor(n, constants, (stiff, damp), bits, terms, steps, factors): coefficients u_0, u_1, … as bytes of n digits each;
 * None if one has more, or if they are too many.
 *
 * constants: u_0, u_1, the stiffness times 2^stiff, the damper times 2^damp; steps: which two of the powers of r (1, r and
 * those made before) are multiplied to make another one; factors: which of them belong to S, the spring and the drag.
 */
PyObject *viscopade_taylor(PyObject *module, PyObject *args)
{
    sequence sequences[4 + MOST_POWERS] = {0}, *given = sequences, *u = given + 1, *y = given + 2, *v = given + 3;
    sequence *powers = given + 4, *r = powers + 1;
    sum total = {0};
    int n, bits, terms;
    long long stiff, damp;
    const char *constants, *steps, *factors;
    Py_ssize_t constants_size, steps_size, factors_size;
    PyObject *result = Py_None;
    (void)module;
    if (!PyArg_ParseTuple(args, "iy#(LL)iiy#y#:taylor", &n, &constants, &constants_size, &stiff, &damp, &bits, &terms,
                          &steps, &steps_size, &factors, &factors_size)) {
        return NULL;
    }
    const int made = (int)steps_size / 2, count = 6 + made;
    if (n < 1 || n > MOST_DIGITS || bits < 0 || bits >= DIGIT_BITS * n || terms < 6 || terms > MOST_PRODUCTS / n ||
        2 + made > MOST_POWERS || stiff < 0 || damp < 0 || constants_size != 4 * DIGIT_BYTES * n || factors_size != 3) {
        Py_RETURN_NONE;
    }
    int64_t *memory = PyMem_Calloc((size_t)(count * n) * (size_t)terms, sizeof *memory);
    if (memory == NULL) {
        return PyErr_NoMemory();
    }
    for (int i = 0; i < count * n; i++) {
        sequences[i / n].digits[i % n] = memory + (size_t)i * (size_t)terms;
    }
    total.n = n;
    total.fits = 1;

    /* 1, and the first two coefficients of u and r = 1 - u. */
    for (int i = 0; i < 4; i++) {
        unpack(&total, constants + i * DIGIT_BYTES * n, given, i);
    }
    for (int i = 0; i < 2; i++) {
        total.columns[bits / DIGIT_BITS] = i ? 0 : (wide)1 << bits % DIGIT_BITS;
        store(&total, 0, 1, &powers[0], i);
        add_multiple(&total, 1, given, i);
        store(&total, 0, 1, u, i);
        add_multiple(&total, 1, &powers[0], i);
        add_multiple(&total, -1, u, i);
        store(&total, 0, 1, r, i);
    }
    for (int j = 0; j < terms - 2 && total.fits; j++) {
        add_multiple(&total, j + 1, u, j + 1);
        store(&total, 0, 1, y, j);
        for (int i = 0; i < made; i++) {
            add_product(&total, &powers[(int)steps[2 * i]], &powers[(int)steps[2 * i + 1]], j);
            store(&total, bits, 1, &powers[2 + i], j);
        }
        /* V = 2 h^2 r^elastic + h k r^viscous Y. */
        add_product(&total, &powers[(int)factors[2]], y, j);
        store(&total, bits, 1, given, 4);
        add_number(&total, given, 3, given, 4);
        store(&total, damp, 1, given, 5);
        add_number(&total, given, 2, &powers[(int)factors[1]], j);
        store(&total, stiff, 1, given, 4);
        add_multiple(&total, 1, given, 4);
        add_multiple(&total, 1, given, 5);
        store(&total, 0, 1, v, j);
        /* (j + 1) (j + 2) u_{j+2} = sum of S_i V_{j-i}. */
        add_product(&total, &powers[(int)factors[0]], v, j);
        store(&total, bits, (j + 1) * (j + 2), u, j + 2);
        add_multiple(&total, -1, u, j + 2);
        store(&total, 0, 1, r, j + 2);
    }

    if (total.fits) {
        result = PyBytes_FromStringAndSize(NULL, DIGIT_BYTES * n * terms);
        for (int i = 0; result != NULL && i < terms; i++) {
            pack(n, u, i, (unsigned char *)PyBytes_AS_STRING(result) + DIGIT_BYTES * n * i);
        }
    } else {
        Py_INCREF(result);
    }
    PyMem_Free(memory);
    return result;
}

#else /* without 128-bit integers Python computes */

PyObject *viscopade_taylor(PyObject *module, PyObject *args)
{
    (void)module;
    (void)args;
    Py_RETURN_NONE;
}

#endif
