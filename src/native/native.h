/* The optional extension `viscopade._native`: module.c, and one file for each of its purposes. */
#define PY_SSIZE_T_CLEAN

#include <Python.h>

/* kernels.c */
PyObject *viscopade_ufunc(PyObject *module, PyObject *args);
PyObject *viscopade_instruction_sets(PyObject *module, PyObject *unused);
int viscopade_prepare_kernels(PyObject *module);

/* recursion.c */
PyObject *viscopade_taylor(PyObject *module, PyObject *args);

/* panels.c */
PyObject *viscopade_panels(PyObject *module, PyObject *args);
PyObject *viscopade_inverse(PyObject *module, PyObject *args);
