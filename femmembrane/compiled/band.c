/* Symmetric band matrices: L D L^T without pivoting where its pivots can be trusted, else L U with partial pivoting; one border. */
#include "native.h"
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#if defined(_MSC_VER) && !defined(__clang__)
#define restrict __restrict /* the keyword of C99 under the name that MSVC has for it */
#endif

/* how much larger than the diagonal entry the terms that make up a pivot may be, and beside them a pivot with a certain sign */
#define GROWTH 100.0
#define SMALLEST 1e-11

static inline void subtract(double *restrict y, double factor, const double *restrict x, int n)
{
    for (int i = 0; i < n; i++)
        y[i] -= factor * x[i];
}

int factor_init(Factor *f, int n, int kd)
{
    memset(f, 0, sizeof *f);
    f->n = n, f->kd = kd;
    f->lower = malloc(sizeof(double) * ((size_t)(kd + 1) * n + 2 * (size_t)n + 1));
    if (f->lower == NULL)
        return -1;
    f->inverse = f->lower + (size_t)(kd + 1) * n;
    return 0;
}

void factor_free(Factor *f)
{
    free(f->lower), free(f->lu), free(f->swaps);
    f->lower = f->inverse = f->lu = NULL, f->swaps = NULL;
}

void band_lower(const double *band, int n, int kd, double *lower)
{
    for (int j = 0; j < n; j++)
        memcpy(lower + (size_t)j * (kd + 1), band + (size_t)j * (3 * kd + 1) + 2 * kd, sizeof(double) * (kd + 1));
}

/* the other way round, both triangles into zeros */
void general_storage(const double *lower, int n, int kd, double *band)
{
    const int step = 3 * kd + 1;
    for (int j = 0; j < n; j++) {
        const double *column = lower + (size_t)j * (kd + 1);
        memcpy(band + (size_t)j * step + 2 * kd, column, sizeof(double) * (kd + 1));
        for (int k = 1; k <= kd && j + k < n; k++)
            band[(size_t)(j + k) * step + 2 * kd - k] = column[k];
    }
}

/*
 * Right-looking. Rounding disturbs the matrix by a few units in the last place of |L| |D| |L|^T, whose diagonal, the `terms`, is added up
 * on the way: where it exceeds that of the matrix by little, as for all definite matrices, the factors are those of a matrix next to the
 * given one. Elsewhere the answer is -1. Pivots that are rounding themselves have uncertain signs.
 */
EACH_PROCESSOR
int factor_symmetric(Factor *f)
{
    const int n = f->n, kd = f->kd, depth = kd + 1;
    double *terms = f->inverse + n;
    for (int j = 0; j < n; j++)
        terms[j] = f->inverse[j] = fabs(f->lower[(size_t)j * depth]);
    f->negative = f->uncertain = 0;
    for (int j = 0; j < n; j++) {
        double *column = f->lower + (size_t)j * depth;
        const double pivot = column[0];
        const int m = n - 1 - j < kd ? n - 1 - j : kd;
        if (!(pivot != 0.0 && terms[j] <= GROWTH * f->inverse[j]))
            return -1;
        f->negative += pivot < 0.0;
        f->uncertain += !(fabs(pivot) > SMALLEST * terms[j]);
        const double inverse = f->inverse[j] = 1.0 / pivot;
        for (int k = 1; k <= m; k++) {
            const double l = column[k] * inverse;
            subtract(column + (size_t)k * depth, l, column + k, m - k + 1);
            terms[j + k] += fabs(l * column[k]);
        }
        for (int k = 1; k <= m; k++)
            column[k] *= inverse;
    }
    return 0;
}

EACH_PROCESSOR
int factor_general(Factor *f, const double *band)
{
    const int n = f->n, kd = f->kd, depth = 3 * kd + 1;
    f->lu = malloc(sizeof(double) * (size_t)depth * n + 8);
    f->swaps = malloc(sizeof(int32_t) * ((size_t)n + 1));
    if (f->lu == NULL || f->swaps == NULL)
        return -1;
    memcpy(f->lu, band, sizeof(double) * (size_t)depth * n);
    double largest = 0.0;
    for (size_t k = 0; k < (size_t)depth * n; k++)
        largest = fabs(band[k]) > largest ? fabs(band[k]) : largest;
    for (int j = 0; j < n; j++) /* room for the fill of pivoting: rows above the band */
        memset(f->lu + (size_t)j * depth, 0, sizeof(double) * kd);
    for (int j = 0; j < n; j++) {
        double *column = f->lu + (size_t)j * depth + 2 * kd;
        const int m = n - 1 - j < kd ? n - 1 - j : kd, reach = n - 1 - j < 2 * kd ? n - 1 - j : 2 * kd;
        int p = 0;
        for (int k = 1; k <= m; k++)
            p = fabs(column[k]) > fabs(column[p]) ? k : p;
        f->swaps[j] = p;
        for (int c = 0; p > 0 && c <= reach; c++) { /* entry (j, j + c) lies c columns on and c rows up */
            double *a = column + (size_t)c * depth - c, t = a[0];
            a[0] = a[p], a[p] = t;
        }
        if (column[0] == 0.0) /* perturbed at round-off, as inverse iteration does; the bordered solve stays well defined */
            column[0] = DBL_EPSILON * (largest > 0.0 ? largest : 1.0);
        for (int k = 1; k <= m; k++)
            column[k] /= column[0];
        for (int c = 1; c <= reach; c++) {
            double *target = column + (size_t)c * depth - c;
            if (target[0] != 0.0)
                subtract(target + 1, target[0], column + 1, m);
        }
    }
    return 0;
}

/*
 * L x = b and D L^T x = b in place. Each unknown waits for the one before: that term is kept at hand and comes last, so that the others do
 * not add to the wait.
 */
static inline double forward(const double *l, double last, double *x, int m)
{
    subtract(x + 2, last, l + 2, m - 1);
    return x[1] -= l[1] * last;
}

static inline double backward(const double *l, double inverse, double last, double *x, int m)
{
    return x[0] = (x[0] * inverse - dot(l + 2, x + 2, m - 1)) - l[1] * last;
}

/* two right-hand sides at once, which do not wait for each other */
EACH_PROCESSOR
void factor_solve_both(const Factor *f, double *x, double *y)
{
    const int n = f->n, kd = f->kd;
    if (f->lu != NULL || n < 2 || kd < 1) {
        factor_solve(f, x), factor_solve(f, y);
        return;
    }
    const double *l = f->lower;
    double a = x[0], b = y[0];
    for (int j = 0; j < n - 1; j++, l += kd + 1) {
        const int m = n - 1 - j < kd ? n - 1 - j : kd;
        a = forward(l, a, x + j, m), b = forward(l, b, y + j, m);
    }
    a = x[n - 1] *= f->inverse[n - 1], b = y[n - 1] *= f->inverse[n - 1];
    for (int j = n - 2; j >= 0; j--) {
        const int m = n - 1 - j < kd ? n - 1 - j : kd;
        l -= kd + 1;
        a = backward(l, f->inverse[j], a, x + j, m), b = backward(l, f->inverse[j], b, y + j, m);
    }
}

EACH_PROCESSOR
void factor_solve(const Factor *f, double *x)
{
    const int n = f->n, kd = f->kd;
    if (f->lu == NULL && kd < 1) {
        for (int j = 0; j < n; j++)
            x[j] *= f->inverse[j];
        return;
    }
    if (f->lu == NULL) {
        const double *l = f->lower;
        double a = n > 0 ? x[0] : 0.0;
        for (int j = 0; j < n - 1; j++, l += kd + 1)
            a = forward(l, a, x + j, n - 1 - j < kd ? n - 1 - j : kd);
        if (n > 0)
            a = x[n - 1] *= f->inverse[n - 1];
        for (int j = n - 2; j >= 0; j--) {
            l -= kd + 1;
            a = backward(l, f->inverse[j], a, x + j, n - 1 - j < kd ? n - 1 - j : kd);
        }
        return;
    }
    const int depth = 3 * kd + 1;
    for (int j = 0; j < n; j++) {
        const int m = n - 1 - j < kd ? n - 1 - j : kd, p = j + f->swaps[j];
        const double t = x[p];
        x[p] = x[j], x[j] = t;
        subtract(x + j + 1, t, f->lu + (size_t)j * depth + 2 * kd + 1, m);
    }
    for (int j = n - 1; j >= 0; j--) {
        const double *column = f->lu + (size_t)j * depth + 2 * kd;
        const int m = j < 2 * kd ? j : 2 * kd;
        x[j] /= column[0];
        subtract(x + j - m, x[j], column - m, m);
    }
}

/* y = A x, or |A| |x|, for lower bands whose columns are `step` apart */
EACH_PROCESSOR
void band_product(const double *lower, Py_ssize_t step, int n, int kd, const double *x, double *y, int magnitudes)
{
    memset(y, 0, sizeof(double) * n);
    for (int j = 0; j < n; j++) {
        const double *column = lower + (size_t)j * step;
        const int m = n - 1 - j < kd ? n - 1 - j : kd;
        if (magnitudes) {
            y[j] += fabs(column[0] * x[j]);
            for (int k = 1; k <= m; k++)
                y[j] += fabs(column[k] * x[j + k]), y[j + k] += fabs(column[k] * x[j]);
        } else {
            y[j] += column[0] * x[j] + dot(column + 1, x + j + 1, m);
            subtract(y + j + 1, -x[j], column + 1, m);
        }
    }
}

/* ---- one border: mixed block elimination (Govaerts and Pryce, 1993) ---------------------------------------------------------- */

int border_init(Border *b, int n, int kd)
{
    memset(b, 0, sizeof *b);
    if (factor_init(&b->factor, n, kd) < 0)
        return -1;
    b->column = malloc(sizeof(double) * 4 * ((size_t)n + 1));
    if (b->column == NULL)
        return -1;
    b->row = b->column + n, b->v = b->row + n, b->w = b->v + n;
    return 0;
}

void border_free(Border *b)
{
    factor_free(&b->factor);
    free(b->column);
    b->column = NULL;
}

/* with factors, column and row in place */
void border_set(Border *b, double corner)
{
    const int n = b->factor.n;
    memcpy(b->v, b->row, sizeof(double) * n);
    memcpy(b->w, b->column, sizeof(double) * n);
    factor_solve_both(&b->factor, b->v, b->w);
    b->corner = corner;
    b->delta_v = corner - dot(b->v, b->column, n);
    b->delta_w = corner - dot(b->row, b->w, n);
}

double border_solve(const Border *b, const double *f, double g, double *x)
{
    const int n = b->factor.n;
    const double first = (g - dot(b->v, f, n)) / b->delta_v;
    for (int i = 0; i < n; i++)
        x[i] = f[i] - first * b->column[i];
    factor_solve(&b->factor, x);
    const double second = (g - b->corner * first - dot(b->row, x, n)) / b->delta_w;
    for (int i = 0; i < n; i++)
        x[i] -= second * b->w[i];
    return first + second;
}

/* x . A y */
EACH_PROCESSOR
static double inner(const double *lower, Py_ssize_t step, int n, int kd, const double *x, const double *y)
{
    double sum = 0.0;
    for (int j = 0; j < n; j++) {
        const double *column = lower + (size_t)j * step;
        const int m = n - 1 - j < kd ? n - 1 - j : kd;
        const double of_y = dot(column + 1, y + j + 1, m), of_x = x == y ? of_y : dot(column + 1, x + j + 1, m);
        sum += x[j] * (column[0] * y[j] + of_y) + y[j] * of_x;
    }
    return sum;
}

/* ---- Python ------------------------------------------------------------------------------------------------------------------- */

typedef struct {
    PyObject_HEAD
    Factor factor;
} FactorObject;

static void factor_dealloc(PyObject *self)
{
    PyTypeObject *type = Py_TYPE(self);
    factor_free(&((FactorObject *)self)->factor);
    PyObject_Free(self);
    Py_DECREF(type);
}

/* factors of general storage: L D L^T, or L U where needed; -1 without memory */
int factor_band(Factor *f, const double *band)
{
    free(f->lu), free(f->swaps);
    f->lu = NULL, f->swaps = NULL;
    band_lower(band, f->n, f->kd, f->lower);
    return factor_symmetric(f) == 0 ? 0 : factor_general(f, band);
}

/* Factor(band, n, kd): band of shape (n, 3 kd + 1) in C order */
static PyObject *factor_new(PyTypeObject *type, PyObject *args, PyObject *kwargs)
{
    PyObject *source;
    Py_buffer band = {0};
    int n, kd;
    (void)kwargs;
    if (!PyArg_ParseTuple(args, "Oii", &source, &n, &kd))
        return NULL;
    if (n < 0 || kd < 0) {
        PyErr_SetString(PyExc_ValueError, "no band matrix has these sizes");
        return NULL;
    }
    if (take_array(source, &band, 'd', (Py_ssize_t)n * (3 * kd + 1), 0, "band") < 0)
        return NULL;
    allocfunc allocate = PyType_GetSlot(type, Py_tp_alloc);
    FactorObject *self = (FactorObject *)allocate(type, 0);
    if (self != NULL && (factor_init(&self->factor, n, kd) < 0 || factor_band(&self->factor, band.buf) < 0)) {
        Py_CLEAR(self);
        PyErr_NoMemory();
    }
    PyBuffer_Release(&band);
    return (PyObject *)self;
}

/* solve(x): one or several right-hand sides, one after another in memory, replaced by the solutions */
static PyObject *factor_solve_method(PyObject *self, PyObject *source)
{
    const Factor *f = &((FactorObject *)self)->factor;
    Py_buffer x = {0};
    if (take_array(source, &x, 'd', -1, 1, "x") < 0)
        return NULL;
    const Py_ssize_t items = x.len / (Py_ssize_t)sizeof(double);
    if (f->n == 0 ? items : items % f->n) {
        PyErr_SetString(PyExc_ValueError, "x: the right-hand sides do not fit the matrix");
        PyBuffer_Release(&x);
        return NULL;
    }
    for (Py_ssize_t k = 0; k < items; k += f->n)
        factor_solve(f, (double *)x.buf + k);
    PyBuffer_Release(&x);
    Py_RETURN_NONE;
}

static PyObject *factor_sign(PyObject *self, PyObject *unused)
{
    const Factor *f = &((FactorObject *)self)->factor;
    int odd = f->negative;
    (void)unused;
    if (f->lu != NULL) {
        odd = 0;
        for (int j = 0; j < f->n; j++)
            odd += (f->swaps[j] != 0) + (f->lu[(size_t)j * (3 * f->kd + 1) + 2 * f->kd] < 0.0);
    }
    return PyLong_FromLong(odd % 2 ? -1 : 1);
}

/* product(band, n, kd, x, y): A x into y, or inner(band, n, kd, x, y): x . A y */
static PyObject *multiply(PyObject *args, int within)
{
    PyObject *source, *left, *right;
    Py_buffer band = {0}, x = {0}, y = {0};
    int n, kd;
    double value = 0.0;
    if (!PyArg_ParseTuple(args, "OiiOO", &source, &n, &kd, &left, &right))
        return NULL;
    if (n < 0 || kd < 0)
        PyErr_SetString(PyExc_ValueError, "no band matrix has these sizes");
    else if (take_array(source, &band, 'd', (Py_ssize_t)n * (3 * kd + 1), 0, "band") == 0 && take_array(left, &x, 'd', n, 0, "x") == 0 &&
             take_array(right, &y, 'd', n, !within, "y") == 0) {
        const double *lower = (double *)band.buf + 2 * kd;
        if (within)
            value = inner(lower, 3 * kd + 1, n, kd, x.buf, y.buf);
        else
            band_product(lower, 3 * kd + 1, n, kd, x.buf, y.buf, 0);
    }
    PyBuffer_Release(&band), PyBuffer_Release(&x), PyBuffer_Release(&y);
    if (PyErr_Occurred())
        return NULL;
    return within ? PyFloat_FromDouble(value) : Py_NewRef(Py_None);
}

PyObject *product_function(PyObject *module, PyObject *args)
{
    (void)module;
    return multiply(args, 0);
}

PyObject *inner_function(PyObject *module, PyObject *args)
{
    (void)module;
    return multiply(args, 1);
}

static PyMethodDef factor_methods[] = {{"solve", factor_solve_method, METH_O, NULL},
                                       {"determinant_sign", factor_sign, METH_NOARGS, NULL},
                                       {NULL, NULL, 0, NULL}};
static PyType_Slot factor_slots[] = {
    {Py_tp_new, factor_new}, {Py_tp_dealloc, factor_dealloc}, {Py_tp_methods, factor_methods}, {0, NULL}};
PyType_Spec factor_spec = {"femmembrane._native.Factor", sizeof(FactorObject), 0, Py_TPFLAGS_DEFAULT, factor_slots};

static void border_dealloc(PyObject *self)
{
    PyTypeObject *type = Py_TYPE(self);
    border_free(&((BorderObject *)self)->border);
    PyObject_Free(self);
    Py_DECREF(type);
}

/* solve(f, g, x): y, with the rest of the solution in x */
static PyObject *border_solve_method(PyObject *self, PyObject *args)
{
    const Border *b = &((BorderObject *)self)->border;
    PyObject *source, *target;
    double g, y = 0.0;
    Py_buffer f = {0}, x = {0};
    if (!PyArg_ParseTuple(args, "OdO", &source, &g, &target))
        return NULL;
    if (take_array(source, &f, 'd', b->factor.n, 0, "f") == 0 && take_array(target, &x, 'd', b->factor.n, 1, "x") == 0)
        y = border_solve(b, f.buf, g, x.buf);
    PyBuffer_Release(&f), PyBuffer_Release(&x);
    return PyErr_Occurred() ? NULL : PyFloat_FromDouble(y);
}

static PyMethodDef border_methods[] = {{"solve", border_solve_method, METH_VARARGS, NULL}, {NULL, NULL, 0, NULL}};
static PyType_Slot border_slots[] = {{Py_tp_dealloc, border_dealloc}, {Py_tp_methods, border_methods}, {0, NULL}};
PyType_Spec border_spec = {"femmembrane._native.Border", sizeof(BorderObject), 0,
                           Py_TPFLAGS_DEFAULT | Py_TPFLAGS_DISALLOW_INSTANTIATION, border_slots};
