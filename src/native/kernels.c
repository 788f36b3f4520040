/*
 * restitution(speed, beta) as a NumPy ufunc: the exported kernel itself, on arrays.
 *
 * The loops below only bring the data to the kernel: contiguous arrays as they are, all others in blocks that stay in
 * the cache. They are compiled with -ffp-contract=off, so that every instruction set, and NumPy
 * (`viscopade.kernels.native`), gives the same bits.
 */
#define NPY_NO_DEPRECATED_API NPY_1_23_API_VERSION

#include "native.h"

#include <fenv.h>
#include <float.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <numpy/arrayobject.h>
#include <numpy/ufuncobject.h>

#if (defined(__GNUC__) || defined(__clang__)) && (defined(__x86_64__) || defined(__i386__))
#define WITH_TARGETS 1
#define VISCOPADE_CHOICE 0 /* it is made below */
#define VISCOPADE_BY_FOUR 1 /* by the sets with AVX; without, functions for arrays would be slow, and are not called */
#else
#define WITH_TARGETS 0
#endif

#include "viscopade_speed_full.h"

/* On the x87 unit results would be rounded twice. Without an extension, NumPy computes. */
#if !defined(FLT_EVAL_METHOD) || FLT_EVAL_METHOD != 0
#error "operations of type float and double must be rounded to their own type"
#endif

enum { BLOCK = 1024 };

/* --- the kernel on contiguous arrays, once for every instruction set --- */

typedef int (*array_double)(size_t n, const double *speed, double beta, double *out);
typedef int (*each_double)(size_t n, const double *speed, const double *beta, double *out);
typedef int (*array_float)(size_t n, const float *speed, float beta, float *out);
typedef int (*each_float)(size_t n, const float *speed, const float *beta, float *out);

typedef struct {
    const char *name;
    array_double array_d;
    each_double each_d;
    array_float array_f;
    each_float each_f;
} instructions;

/* All return whether there is a NaN among the results. `out` overlaps nothing. */
#define KERNELS(SET, ATTRIBUTES, MANY) \
    KERNELS_OF_TYPE(SET, ATTRIBUTES, MANY, double, d, ) \
    KERNELS_OF_TYPE(SET, ATTRIBUTES, MANY, float, f, f) \
    static const instructions SET = {#SET, SET##_array_d, SET##_each_d, SET##_array_f, SET##_each_f};

#define KERNELS_OF_TYPE(SET, ATTRIBUTES, MANY, T, LETTER, F) \
    ATTRIBUTES static int SET##_array_##LETTER(size_t n, const T *speed, T beta, T *out) \
    { \
        MANY(array, F, beta) \
        NAN_AMONG(n, out) \
    } \
    ATTRIBUTES static int SET##_each_##LETTER(size_t n, const T *speed, const T *beta, T *out) \
    { \
        MANY(each, F, beta[i]) \
        NAN_AMONG(n, out) \
    }

#define AS_ARRAYS(KIND, F, ONE) viscopade_restitution_##KIND##_full##F(n, speed, beta, out);
#define ONE_BY_ONE(KIND, F, ONE) \
    for (size_t i = 0; i < n; i++) { \
        out[i] = viscopade_restitution_full##F(speed[i], ONE); \
    }

#define NAN_AMONG(n, out) \
    int found = 0; \
    for (size_t i = 0; i < n; i++) { \
        found |= out[i] != out[i]; \
    } \
    return found;

#if WITH_TARGETS
KERNELS(baseline, , ONE_BY_ONE)
KERNELS(avx2, __attribute__((target("avx2"), flatten)), AS_ARRAYS)
KERNELS(avx512, __attribute__((target("avx512f,avx512vl,avx512bw,avx512dq"), flatten)), AS_ARRAYS)
#else
KERNELS(baseline, , AS_ARRAYS)
#endif

/* The best last. */
static const instructions *const SETS[] = {
    &baseline,
#if WITH_TARGETS
    &avx2,
    &avx512,
#endif
};
enum { SETS_COUNT = sizeof SETS / sizeof *SETS };

static int runs_here(const instructions *set)
{
#if WITH_TARGETS
    __builtin_cpu_init();
    if (set == &avx2) {
        return __builtin_cpu_supports("avx2") != 0;
    }
    if (set == &avx512) {
        return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
               __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq");
    }
#endif
    return set == &baseline;
}

/* --- NumPy's inner loops --- */

/*
 * NumPy reads the floating-point flags after the loop. Those that the kernel raises on its way mean nothing; a NaN that
 * comes of no NaN means "invalid value", as for np.sqrt.
 */
static void set_flags(const fexcept_t *before, int invalid)
{
    feclearexcept(FE_ALL_EXCEPT);
    fesetexceptflag(before, FE_ALL_EXCEPT);
    if (invalid) {
        feraiseexcept(FE_INVALID);
    }
}

static int overlap(const char *first, npy_intp first_step, const char *second, npy_intp second_step, npy_intp n,
                   npy_intp size)
{
    npy_intp first_last = (n - 1) * first_step, second_last = (n - 1) * second_step;
    uintptr_t a = (uintptr_t)first + (uintptr_t)(first_last < 0 ? first_last : 0);
    uintptr_t b = (uintptr_t)second + (uintptr_t)(second_last < 0 ? second_last : 0);
    uintptr_t a_size = (uintptr_t)((first_last < 0 ? -first_last : first_last) + size);
    uintptr_t b_size = (uintptr_t)((second_last < 0 ? -second_last : second_last) + size);
    return a < b + b_size && b < a + a_size;
}

/*
 * One loop. IN is the type of the arguments, T that of the results; IS_T says whether they are the same.
 *
 * If out overlaps an argument, element by element or not at all (out=speed), the arguments go through buffers. Any other
 * overlap (reduce, accumulate, a shifted view) is computed one element at a time, in order.
 */
#define LOOP(NAME, IN, IS_T, T, LETTER, F) \
    static void NAME(char **args, const npy_intp *dimensions, const npy_intp *steps, void *data) \
    { \
        const instructions *set = data; \
        const npy_intp n = dimensions[0], x_step = steps[0], b_step = steps[1], y_step = steps[2]; \
        char *x = args[0], *b = args[1], *y = args[2]; \
        int over_x, over_b, over, in_order, x_direct, b_direct, y_direct, invalid = 0; \
        T x_block[BLOCK], b_block[BLOCK], y_block[BLOCK]; \
        fexcept_t flags; \
        if (n <= 0) { \
            return; \
        } \
        fegetexceptflag(&flags, FE_ALL_EXCEPT); \
        over_x = overlap(x, x_step, y, y_step, n, sizeof(T)); \
        over_b = overlap(b, b_step, y, y_step, n, sizeof(T)); \
        over = over_x || over_b; \
        in_order = n > 1 && (y_step == 0 || (over_x && !(IS_T && x == y && x_step == y_step)) || \
                             (over_b && !(IS_T && b == y && b_step == y_step))); \
        x_direct = IS_T && !over && (x_step == sizeof(T) || n == 1); \
        b_direct = IS_T && !over && (b_step == sizeof(T) || n == 1); \
        y_direct = y_step == sizeof(T) || n == 1; \
        for (npy_intp done = 0; done < n;) { \
            npy_intp m = in_order ? 1 : n - done < BLOCK ? n - done : BLOCK; \
            const T *speed = x_direct ? (const T *)x : x_block; \
            const T *beta = b_direct ? (const T *)b : b_block; \
            T *out = y_direct && !in_order ? (T *)y : y_block; \
            int constant = b_step == 0 || m == 1; \
            if (!x_direct) { \
                for (npy_intp i = 0; i < m; i++) { \
                    x_block[i] = (T) * (const IN *)(x + i * x_step); \
                } \
            } \
            if (!b_direct) { \
                for (npy_intp i = 0; i < (constant ? 1 : m); i++) { \
                    b_block[i] = (T) * (const IN *)(b + i * b_step); \
                } \
            } \
            if (constant ? set->array_##LETTER((size_t)m, speed, *beta, out) \
                         : set->each_##LETTER((size_t)m, speed, beta, out)) { \
                for (npy_intp i = 0; i < m; i++) { \
                    const T of_x = speed[i], of_b = beta[constant ? 0 : i]; \
                    invalid |= out[i] != out[i] && of_x == of_x && of_b == of_b; \
                } \
            } \
            if (out == y_block) { \
                for (npy_intp i = 0; i < m; i++) { \
                    *(T *)(y + i * y_step) = y_block[i]; \
                } \
            } \
            x += m * x_step; \
            b += m * b_step; \
            y += m * y_step; \
            done += m; \
        } \
        set_flags(&flags, invalid); \
    }

LOOP(loop_integers, npy_int, 0, double, d, )
LOOP(loop_float, npy_float, 1, float, f, f)
LOOP(loop_double, npy_double, 1, double, d, )

/* --- what Python calls --- */

/* In the order in which NumPy looks for the first that takes the arguments: small integers must not become floats. */
static const PyUFuncGenericFunction LOOPS[] = {loop_integers, loop_float, loop_double};
static const char TYPES[] = {NPY_INT, NPY_INT, NPY_DOUBLE, NPY_FLOAT, NPY_FLOAT, NPY_FLOAT,
                             NPY_DOUBLE, NPY_DOUBLE, NPY_DOUBLE};
enum { LOOPS_COUNT = sizeof LOOPS / sizeof *LOOPS };

PyObject *viscopade_ufunc(PyObject *module, PyObject *args)
{
    const char *wanted, *doc;
    (void)module;
    if (!PyArg_ParseTuple(args, "ss:ufunc", &wanted, &doc)) {
        return NULL;
    }
    for (int i = 0; i < SETS_COUNT; i++) {
        if (strcmp(SETS[i]->name, wanted) == 0 && runs_here(SETS[i])) {
            /* NumPy keeps the pointers: they live as long as the process. */
            size_t size = strlen(doc) + 1;
            const void **data = PyMem_RawMalloc(LOOPS_COUNT * sizeof *data);
            char *kept = PyMem_RawMalloc(size);
            PyObject *result = NULL;
            if (data != NULL && kept != NULL) {
                for (int j = 0; j < LOOPS_COUNT; j++) {
                    data[j] = SETS[i];
                }
                memcpy(kept, doc, size);
                result = PyUFunc_FromFuncAndData((PyUFuncGenericFunction *)LOOPS, (void **)data, (char *)TYPES,
                                                 LOOPS_COUNT, 2, 1, PyUFunc_None, "restitution", kept, 0);
            } else {
                PyErr_NoMemory();
            }
            if (result == NULL) {
                PyMem_RawFree(data);
                PyMem_RawFree(kept);
            }
            return result;
        }
    }
    return PyErr_Format(PyExc_ValueError, "instructions are %s: expected one of instruction_sets()", wanted);
}

PyObject *viscopade_instruction_sets(PyObject *module, PyObject *unused)
{
    PyObject *names = PyList_New(0);
    (void)module;
    (void)unused;
    for (int i = 0; names != NULL && i < SETS_COUNT; i++) {
        if (runs_here(SETS[i])) {
            PyObject *name = PyUnicode_FromString(SETS[i]->name);
            if (name == NULL || PyList_Append(names, name) < 0) {
                Py_CLEAR(names);
            }
            Py_XDECREF(name);
        }
    }
    return names;
}

int viscopade_prepare_kernels(PyObject *module)
{
    (void)module;
    import_array1(-1);
    import_umath1(-1);
    return 0;
}
