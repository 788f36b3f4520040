#include "native.h"

static PyMethodDef METHODS[] = {
    {"ufunc", viscopade_ufunc, METH_VARARGS,
     "ufunc(instructions, doc)\n--\n\nReturn the ufunc `restitution` that uses these instructions."},
    {"instruction_sets", viscopade_instruction_sets, METH_NOARGS,
     "instruction_sets()\n--\n\nReturn the names of those that this processor has, the best last."},
    {"taylor", viscopade_taylor, METH_VARARGS,
     "taylor(digits, constants, rights, bits, terms, steps, factors)\n--\n\n"
     "Return Taylor coefficients of a collision's flow as bytes, or None."},
    {"panels", viscopade_panels, METH_VARARGS,
     "panels(function, table, v_star, out)\n--\n\nEvaluate a function of the table of panels at doubles."},
    {"inverse", viscopade_inverse, METH_VARARGS,
     "inverse(table, portion, elastic, v_star)\n--\n\nImprove first guesses of v*, where 1 - eps or eps is the portion."},
    {NULL, NULL, 0, NULL},
};

static PyModuleDef_Slot SLOTS[] = {
    {Py_mod_exec, (void *)viscopade_prepare_kernels},
#ifdef Py_mod_multiple_interpreters
    {Py_mod_multiple_interpreters, Py_MOD_MULTIPLE_INTERPRETERS_NOT_SUPPORTED},
#endif
#ifdef Py_mod_gil
    {Py_mod_gil, Py_MOD_GIL_NOT_USED},
#endif
    {0, NULL},
};

static PyModuleDef DEFINITION = {
    PyModuleDef_HEAD_INIT, "viscopade._native", "What needs a C compiler; without one, Python and NumPy compute the same.",
    0, METHODS, SLOTS, NULL, NULL, NULL,
};

PyMODINIT_FUNC PyInit__native(void)
{
    return PyModuleDef_Init(&DEFINITION);
}
