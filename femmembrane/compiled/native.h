/* Shared by the parts of the extension module: the tape of a point function, band factors, and the elements of one space. */
#ifndef FEMMEMBRANE_NATIVE_H
#define FEMMEMBRANE_NATIVE_H

#define Py_LIMITED_API 0x030B0000
#define PY_SSIZE_T_CLEAN
#include <Python.h>
#include <stdint.h>

/* the loops marked so read and write one place at a time: no iteration depends on another, whether or not pointers coincide */
#if defined(__clang__)
#define INDEPENDENT _Pragma("clang loop vectorize(assume_safety)")
#elif defined(__GNUC__)
#define INDEPENDENT _Pragma("GCC ivdep")
#else
#define INDEPENDENT
#endif

/* Compiled twice where the loader can choose, for processors with and without AVX2; without contraction to FMA the results are the same. */
#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && defined(__GLIBC__)
#define EACH_PROCESSOR __attribute__((target_clones("avx2", "default")))
#else
#define EACH_PROCESSOR
#endif

/* ---- module.c ---------------------------------------------------------------------------------------------------------------- */

/* A C-contiguous array of doubles (or int64) of a known number of items, or -1 with an exception set. */
int take_array(PyObject *source, Py_buffer *view, char kind, Py_ssize_t items, int writable, const char *name);

/* ---- tape.c: the instructions of a point function, replayed on vectors of points --------------------------------------------- */

typedef struct {
    int32_t code, target, left, right; /* registers: < 0 are scalars -1 - k, others vectors */
} Instruction;

typedef struct {
    Py_ssize_t n_scalar, n_vector, n_constants, n_parameters, n_scalars, n_inputs, n_registers, n_outputs;
    Instruction *scalar; /* on constants and parameters: once a call */
    Instruction *vector;
    double *constants; /* the first of the scalars, before the parameters */
} Tape;

int tape_init(Tape *tape, PyObject *description);
void tape_free(Tape *tape);
void tape_scalars(const Tape *tape, double *scalars);
void tape_run(const Tape *tape, const double *scalars, double **registers, Py_ssize_t n);
PyObject *tape_operations(void);

/* ---- band.c: symmetric band matrices ------------------------------------------------------------------------------------------ */

typedef struct {
    int n, kd;
    int negative, uncertain; /* numbers of negative pivots, and of pivots whose signs are rounding */
    double *lower;           /* unit lower triangle by columns, (kd + 1) n, with the pivots in the place of its diagonal */
    double *inverse;         /* 1/pivots, n; then the terms of the pivots, n */
    double *lu;              /* LAPACK's general storage, (3 kd + 1) n, where pivoting was needed; else NULL */
    int32_t *swaps;
} Factor;

int factor_init(Factor *f, int n, int kd);
void factor_free(Factor *f);
/* L D L^T of f->lower without pivoting; 0, or -1 where its pivots cannot be trusted */
int factor_symmetric(Factor *f);
int factor_band(Factor *f, const double *band);
/* P A = L U of general storage, copied; 0, or -1 without memory */
int factor_general(Factor *f, const double *band);
void factor_solve(const Factor *f, double *x);
void factor_solve_both(const Factor *f, double *x, double *y);
void general_storage(const double *lower, int n, int kd, double *band);
void band_lower(const double *band, int n, int kd, double *lower);
void band_product(const double *lower, Py_ssize_t step, int n, int kd, const double *x, double *y, int magnitudes);

typedef struct {
    Factor factor;
    double *column, *row, *v, *w; /* one block, n each */
    double corner, delta_v, delta_w;
} Border;

int border_init(Border *b, int n, int kd);
void border_free(Border *b);
void border_set(Border *b, double corner);
double border_solve(const Border *b, const double *f, double g, double *x);
static inline double dot(const double *a, const double *b, Py_ssize_t n)
{
    double s0 = 0.0, s1 = 0.0, s2 = 0.0, s3 = 0.0;
    Py_ssize_t i = 0;
    for (; i + 4 <= n; i += 4)
        s0 += a[i] * b[i], s1 += a[i + 1] * b[i + 1], s2 += a[i + 2] * b[i + 2], s3 += a[i + 3] * b[i + 3];
    for (; i < n; i++)
        s0 += a[i] * b[i];
    return (s0 + s1) + (s2 + s3);
}
PyObject *product_function(PyObject *module, PyObject *args);
PyObject *inner_function(PyObject *module, PyObject *args);

/* ---- spectrum.c ---------------------------------------------------------------------------------------------------------------- */

PyObject *inertia_function(PyObject *module, PyObject *args);
PyObject *rayleigh_function(PyObject *module, PyObject *args);

/* ---- types ---------------------------------------------------------------------------------------------------------------------- */

extern PyType_Spec factor_spec, border_spec, elements_spec;

typedef struct {
    PyObject_HEAD
    Border border;
} BorderObject;

typedef struct {
    PyTypeObject *factor, *border, *elements;
} Types;
extern Types types;

#endif
