/* The extension module: what may be called from Python. femmembrane works without it, by the same formulas in Python. */
#include "native.h"
#include <string.h>

Types types;

int take_array(PyObject *source, Py_buffer *view, char kind, Py_ssize_t items, int writable, const char *name)
{
    if (PyObject_GetBuffer(source, view, PyBUF_C_CONTIGUOUS | PyBUF_FORMAT | (writable ? PyBUF_WRITABLE : 0)) < 0)
        return -1;
    const char *format = view->format == NULL ? "B" : view->format;
    const int right = kind == 'd' ? !strcmp(format, "d") : (!strcmp(format, "l") || !strcmp(format, "q"));
    if (right && view->itemsize == 8 && (items < 0 || view->len == items * 8))
        return 0;
    PyErr_Format(PyExc_ValueError, "%s: %zd contiguous numbers of type %s are required", name, items, kind == 'd' ? "float64" : "int64");
    PyBuffer_Release(view);
    return -1;
}

static int add_type(PyObject *module, PyType_Spec *spec, const char *name, PyTypeObject **type)
{
    PyObject *made = PyType_FromModuleAndSpec(module, spec, NULL);
    if (made == NULL)
        return -1;
    *type = (PyTypeObject *)made; /* the module keeps it alive */
    return PyModule_AddObjectRef(module, name, made);
}

static PyMethodDef functions[] = {{"inertia", inertia_function, METH_VARARGS, NULL},
                                  {"inner", inner_function, METH_VARARGS, NULL},
                                  {"product", product_function, METH_VARARGS, NULL},
                                  {"rayleigh", rayleigh_function, METH_VARARGS, NULL},
                                  {NULL, NULL, 0, NULL}};
static struct PyModuleDef definition = {PyModuleDef_HEAD_INIT, "femmembrane._native", NULL, -1, functions, NULL, NULL, NULL, NULL};

PyMODINIT_FUNC PyInit__native(void)
{
    PyObject *module = PyModule_Create(&definition), *operations = tape_operations();
    if (module == NULL || operations == NULL || PyModule_AddObjectRef(module, "OPERATIONS", operations) < 0 ||
        PyModule_AddIntConstant(module, "INTERFACE", 6) < 0 || /* raised here and in kernels/compiled_kernels.py when arguments or answers change */
        add_type(module, &factor_spec, "Factor", &types.factor) < 0 || add_type(module, &border_spec, "Border", &types.border) < 0 ||
        add_type(module, &elements_spec, "Elements", &types.elements) < 0)
        Py_CLEAR(module);
    Py_XDECREF(operations);
    return module;
}
