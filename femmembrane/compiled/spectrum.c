/* Inertia of K - shift M with one constraint, and Rayleigh quotient iteration: mirrors of stability/spectrum.py. */
#include "native.h"
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    int n, kd, step;                        /* step: from column to column of general storage */
    const double *band, *mass, *constraint; /* the latter may be NULL */
    double compliance;
} Pencil;

EACH_PROCESSOR
static void shift_band(const Pencil *p, double shift, double *lower)
{
    const int kd = p->kd;
    for (int j = 0; j < p->n; j++) {
        const double *a = p->band + (size_t)j * p->step + 2 * kd, *m = p->mass + (size_t)j * p->step + 2 * kd;
        double *l = lower + (size_t)j * (kd + 1);
        for (int k = 0; k <= kd; k++)
            l[k] = a[k] - shift * m[k];
    }
}

/*
 * Number of negative eigenvalues of the factored matrix A, of A under constraint . x = 0, or with the spring of a soft constraint; -1 where
 * rounding may decide. The constraint is a border with the Schur complement s = -compliance - c.z, A z = c; factors disturbed by dA,
 * at most a few units in the last place of |L| |D| |L|^T, change it by z.dA z.
 */
static int signs(const Factor *f, const double *constraint, double compliance, double *z)
{
    if (f->uncertain)
        return -1;
    if (constraint == NULL)
        return f->negative;
    const int n = f->n;
    memcpy(z, constraint, sizeof(double) * n);
    factor_solve(f, z);
    const double s = -compliance - dot(constraint, z, n), *terms = f->inverse + n;
    double bound = 0.0;
    for (int i = 0; i < n; i++)
        bound += terms[i] * z[i] * z[i] + fabs(constraint[i] * z[i]);
    if (!(fabs(s) > 8.0 * (f->kd + 4) * DBL_EPSILON * bound))
        return -1;
    return f->negative + (s < 0.0) - 1;
}

static int count_below(const Pencil *p, double shift, Factor *f, double *work)
{
    free(f->lu), free(f->swaps);
    f->lu = NULL, f->swaps = NULL;
    if (p->mass == NULL)
        band_lower(p->band, p->n, p->kd, f->lower);
    else
        shift_band(p, shift, f->lower);
    return factor_symmetric(f) < 0 ? -1 : signs(f, p->constraint, p->compliance, work);
}

static void project(const Pencil *p, double *x)
{
    if (p->constraint == NULL || p->compliance > 0.0)
        return;
    const double share = dot(p->constraint, x, p->n) / dot(p->constraint, p->constraint, p->n);
    for (int i = 0; i < p->n; i++)
        x[i] -= p->constraint[i] * share;
}

/* sqrt(sum of x^2/diagonal of M) */
EACH_PROCESSOR
static double size_of(const Pencil *p, const double *x)
{
    double sum = 0.0;
    for (int i = 0; i < p->n; i++)
        sum += x[i] * x[i] / p->mass[(size_t)i * p->step + 2 * p->kd];
    return sqrt(sum);
}

/* factors of K - shift M for a solve; -1 without memory */
static int shifted(const Pencil *p, double shift, Border *b)
{
    Factor *f = &b->factor;
    free(f->lu), free(f->swaps);
    f->lu = NULL, f->swaps = NULL;
    shift_band(p, shift, f->lower);
    if (factor_symmetric(f) < 0) {
        const size_t items = (size_t)p->step * p->n;
        double *band = malloc(sizeof(double) * (items + 1));
        if (band == NULL)
            return -1;
        for (size_t k = 0; k < items; k++)
            band[k] = p->band[k] - shift * p->mass[k];
        const int failed = factor_general(f, band);
        free(band);
        if (failed)
            return -1;
    }
    if (p->constraint != NULL) {
        memcpy(b->column, p->constraint, sizeof(double) * p->n);
        memcpy(b->row, p->constraint, sizeof(double) * p->n);
        border_set(b, -p->compliance);
    }
    return 0;
}

typedef struct {
    int iterations;
    double converged, shrinking, rounding; /* residuals that end the iterations */
    double gap, noise, floor;              /* how far below the eigenvalue inertia looks for others */
} Tolerances;

/* 1 and value, error and the number of eigenvalues clearly below (-1: not certain); 0 when nothing was found, -1 without memory */
EACH_PROCESSOR
static int rayleigh(const Pencil *p, double *mode, const Tolerances *t, Border *b, double *work, double *value, double *error, int *below)
{
    const int n = p->n, kd = p->kd, step = p->step;
    const double *k_lower = p->band + 2 * kd, *m_lower = p->mass + 2 * kd;
    double *right = work, *force = right + n, *residual = force + n, best = HUGE_VAL;
    for (int iteration = 0; iteration < t->iterations; iteration++) {
        project(p, mode);
        int largest = 0;
        for (int i = 1; i < n; i++)
            largest = fabs(mode[i]) > fabs(mode[largest]) ? i : largest;
        double size = fabs(mode[largest]);
        if (!(size > 0.0 && size < HUGE_VAL))
            return 0;
        for (int i = 0; i < n; i++)
            mode[i] /= size;
        band_product(m_lower, step, n, kd, mode, right, 0);
        size = copysign(sqrt(dot(mode, right, n)), mode[largest]);
        for (int i = 0; i < n; i++)
            mode[i] /= size, right[i] /= size;
        band_product(k_lower, step, n, kd, mode, force, 0);
        if (p->constraint != NULL && p->compliance > 0.0) {
            const double share = dot(p->constraint, mode, n) / p->compliance;
            for (int i = 0; i < n; i++)
                force[i] += p->constraint[i] * share;
        }
        *value = dot(mode, force, n);
        for (int i = 0; i < n; i++)
            residual[i] = force[i] - *value * right[i];
        project(p, residual);
        *error = size_of(p, residual);
        int converged = *error <= t->converged * fabs(*value);
        if (!converged && *error > t->shrinking * best) {
            band_product(k_lower, step, n, kd, mode, force, 1);
            converged = *error <= t->rounding * size_of(p, force);
        }
        if (converged) {
            double scale = 0.0, noise = 0.0;
            band_product(k_lower, step, n, kd, mode, force, 1);
            for (int i = 0; i < n; i++) {
                noise += fabs(mode[i]) * force[i];
                scale = fmax(scale, fabs(k_lower[(size_t)i * step] / m_lower[(size_t)i * step]));
            }
            *below = count_below(p, *value - fmax(fmax(t->gap * fabs(*value), t->noise * noise), t->floor * scale), &b->factor, force);
            return 1;
        }
        best = fmin(best, *error);
        if (shifted(p, *value, b) < 0)
            return -1;
        if (p->constraint == NULL) {
            memcpy(mode, right, sizeof(double) * n);
            factor_solve(&b->factor, mode);
        } else {
            border_solve(b, right, 0.0, mode);
        }
        for (int i = 0; i < n; i++)
            if (!isfinite(mode[i]))
                return 0;
    }
    return 0;
}

/* ---- Python --------------------------------------------------------------------------------------------------------------------- */

/* band and mass of shape (n, 3 kd + 1), constraint (n,) or None */
static int pencil_init(Pencil *p, PyObject *const o[3], Py_buffer views[3])
{
    const Py_ssize_t items = (Py_ssize_t)p->n * (3 * p->kd + 1);
    p->step = 3 * p->kd + 1;
    if (p->n < 1 || p->kd < 0) {
        PyErr_SetString(PyExc_ValueError, "no band matrix has these sizes");
        return -1;
    }
    if (take_array(o[0], &views[0], 'd', items, 0, "band") < 0 || (o[1] != Py_None && take_array(o[1], &views[1], 'd', items, 0, "mass") < 0) ||
        (o[2] != Py_None && take_array(o[2], &views[2], 'd', p->n, 0, "constraint") < 0))
        return -1;
    p->band = views[0].buf, p->mass = views[1].buf, p->constraint = views[2].buf;
    return 0;
}

/* inertia(band, mass or None, constraint or None, n, kd, compliance, shift): eigenvalues below the shift, or -1 where rounding may decide */
PyObject *inertia_function(PyObject *module, PyObject *args)
{
    Pencil p;
    PyObject *o[3], *answer = NULL;
    Py_buffer views[3] = {{0}};
    double shift;
    (void)module;
    if (!PyArg_ParseTuple(args, "OOOiidd", &o[0], &o[1], &o[2], &p.n, &p.kd, &p.compliance, &shift))
        return NULL;
    if (pencil_init(&p, o, views) == 0) {
        Factor f;
        double *work = malloc(sizeof(double) * p.n);
        if (factor_init(&f, p.n, p.kd) < 0 || work == NULL)
            PyErr_NoMemory();
        else
            answer = PyLong_FromLong(count_below(&p, shift, &f, work));
        factor_free(&f);
        free(work);
    }
    for (int k = 0; k < 3; k++)
        PyBuffer_Release(&views[k]);
    return answer;
}

/* rayleigh(band, mass, constraint or None, n, kd, compliance, mode, tolerances in their order): (value, error, below) with the
 * mode in place, or None */
PyObject *rayleigh_function(PyObject *module, PyObject *args)
{
    Pencil p;
    PyObject *o[3], *guess, *answer = NULL;
    Py_buffer views[3] = {{0}}, mode = {0};
    double value, error;
    Tolerances t;
    int below;
    (void)module;
    if (!PyArg_ParseTuple(args, "OOOiidOidddddd", &o[0], &o[1], &o[2], &p.n, &p.kd, &p.compliance, &guess, &t.iterations, &t.converged, &t.shrinking,
                          &t.rounding, &t.gap, &t.noise, &t.floor))
        return NULL;
    if (o[1] == Py_None) {
        PyErr_SetString(PyExc_ValueError, "mass: a band matrix is required");
        return NULL;
    }
    if (pencil_init(&p, o, views) == 0 && take_array(guess, &mode, 'd', p.n, 1, "mode") == 0) {
        Border b;
        double *work = malloc(sizeof(double) * 3 * p.n);
        int found = -1;
        if (border_init(&b, p.n, p.kd) == 0 && work != NULL)
            found = rayleigh(&p, mode.buf, &t, &b, work, &value, &error, &below);
        border_free(&b);
        free(work);
        if (found < 0)
            PyErr_NoMemory();
        else
            answer = found ? Py_BuildValue("(ddi)", value, error, below) : Py_NewRef(Py_None);
    }
    for (int k = 0; k < 3; k++)
        PyBuffer_Release(&views[k]);
    PyBuffer_Release(&mode);
    return answer;
}
