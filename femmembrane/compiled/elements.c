/*
 * The elements of one space under one tape: evaluation, assembly, and the factors and sizes that the bordered Newton corrector asks for.
 *
 * Everything is read off arrays: which unknown a local coefficient is, tables of shape functions, data at the quadrature points. Elements
 * are taken four at a time, one a lane, so that assembly has no short loops; points are numbered quadrature point first, element second.
 */
#include "native.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define LANES 4
/* rows or columns of a product that are summed at once: each sum is a chain of additions, and a processor has room for several */
#define TOGETHER 4
/* points evaluated in one go: a block and the registers of the tape stay in the processor's cache */
#define POINTS 256
/* rows of the point function: energies and volume, two gradients, second derivatives, stresses */
enum { N_SUMS = 3, N_FORCE = 8, N_STIFF = 10, N_STRESS = 2, N_DENSITY = N_FORCE + N_STIFF + N_STRESS, N_ROWS = N_SUMS + N_DENSITY };

typedef struct {
    PyObject_HEAD
    Tape tape;
    Py_ssize_t n_free, n_points, n_elements, block;
    int kd, n_quadrature, n_local; /* n_local: shape functions of one component */
    int n_data;
    double *data;         /* point data, block after block, (n_data, n_quadrature, elements of the block) */
    int32_t *gather;      /* (n_elements, 2 n_local); n_free is what is held at zero */
    int32_t *place;       /* where the entries of LANES elements go in the lower band, in the order of assembly */
    uint8_t *field;       /* (n_free) 0 for u, 1 for w */
    double *table;        /* (2 n_quadrature, n_local) values, then slopes */
    double *transposed;   /* (n_local, 2 n_quadrature) */
    double *magnitudes;   /* of the transposed table */
    double *scalars, *registers, *scratch, *sums;
    double **pointers;
    double *local, *coefficients;
} Elements;

static double *doubles(size_t count)
{
    return calloc(count + LANES, sizeof(double));
}

/* ---- evaluation ---------------------------------------------------------------------------------------------------------------- */

/* LANES numbers in one register or two: compilers left alone with the loop take the wrong one of those around it to vectors */
#if defined(__GNUC__)
typedef double Lanes __attribute__((vector_size(8 * LANES)));
#else
typedef struct {
    double v[LANES];
} Lanes;
#endif

static inline void add_product(Lanes *sum, double a, const double *x)
{
#if defined(__GNUC__)
    Lanes v;
    memcpy(&v, x, sizeof v);
    *sum += a * v;
#else
    for (int l = 0; l < LANES; l++)
        sum->v[l] += a * x[l];
#endif
}

static inline void rows_at_once(int rows, const double *m, int depth, const double *x, Py_ssize_t next, double sum[TOGETHER][LANES])
{
    Lanes s[TOGETHER];
    memset(s, 0, sizeof s);
    for (int k = 0; k < depth; k++, x += next)
        for (int r = 0; r < rows; r++)
            add_product(&s[r], m[r * depth + k], x);
    memcpy(sum, s, sizeof s);
}

static inline void columns_at_once(int columns, const double *m, int depth, const double *x, Py_ssize_t next, double sum[TOGETHER][LANES])
{
    Lanes s[TOGETHER];
    memset(s, 0, sizeof s);
    for (int k = 0; k < depth; k++, x += next)
        for (int c = 0; c < columns; c++)
            add_product(&s[c], m[k], x + c * LANES);
    memcpy(sum, s, sizeof s);
}

/* the loops over few rows or columns are unrolled where their number is known */
#define UNROLLED(FUNCTION, NUMBER, ...)                                                                                                    \
    switch (NUMBER) {                                                                                                                      \
    case 1:                                                                                                                                \
        FUNCTION(1, __VA_ARGS__);                                                                                                          \
        break;                                                                                                                             \
    case 2:                                                                                                                                \
        FUNCTION(2, __VA_ARGS__);                                                                                                          \
        break;                                                                                                                             \
    case 3:                                                                                                                                \
        FUNCTION(3, __VA_ARGS__);                                                                                                          \
        break;                                                                                                                             \
    default:                                                                                                                               \
        FUNCTION(TOGETHER, __VA_ARGS__);                                                                                                   \
    }

/* sum[r][l] = sum_k m[r][k] x[k][l] for the first TOGETHER of so many rows */
static inline void rows_times(int rows, const double *m, int depth, const double *x, Py_ssize_t next, double sum[TOGETHER][LANES])
{
    UNROLLED(rows_at_once, rows, m, depth, x, next, sum)
}

/* sum[c][l] = sum_k m[k] x[k][c][l] for the first TOGETHER of so many columns */
static inline void row_times(int columns, const double *m, int depth, const double *x, Py_ssize_t next, double sum[TOGETHER][LANES])
{
    UNROLLED(columns_at_once, columns, m, depth, x, next, sum)
}

/* out[r][e] = sum_k m[r][k] x[k][e]; x is readable up to the next multiple of LANES */
static inline void product(const double *m, int rows, int depth, const double *x, Py_ssize_t ldx, double *out, Py_ssize_t lanes)
{
    double sum[TOGETHER][LANES];
    for (Py_ssize_t g = 0; g < lanes; g += LANES) {
        const int valid = lanes - g < LANES ? (int)(lanes - g) : LANES;
        for (int first = 0; first < rows; first += TOGETHER) {
            rows_times(rows - first, m + first * depth, depth, x + g, ldx, sum);
            for (int r = first; r < first + TOGETHER && r < rows; r++)
                memcpy(out + r * lanes + g, sum[r - first], sizeof(double) * valid);
        }
    }
}

/* target[unknown] += sum_k transposed[i][k] density[k][e] for both components of the elements from `first` on */
static inline void integrate(const Elements *s, const double *transposed, const double *density, Py_ssize_t first, Py_ssize_t lanes, double *target)
{
    const int nl = s->n_local, depth = 2 * s->n_quadrature;
    double sum[TOGETHER][LANES];
    for (Py_ssize_t g = 0; g < lanes; g += LANES) {
        const int valid = lanes - g < LANES ? (int)(lanes - g) : LANES;
        const int32_t *gather = s->gather + (first + g) * 2 * nl;
        for (int component = 0; component < 2; component++)
            for (int i = 0; i < nl; i += TOGETHER) {
                rows_times(nl - i, transposed + i * depth, depth, density + component * depth * lanes + g, lanes, sum);
                for (int r = i; r < i + TOGETHER && r < nl; r++)
                    for (int l = 0; l < valid; l++)
                        target[gather[l * 2 * nl + component * nl + r]] += sum[r - i][l];
            }
    }
}

static double total(const double *x, Py_ssize_t n)
{
    double s[4] = {0};
    Py_ssize_t i = 0;
    for (; i + 4 <= n; i += 4)
        for (int l = 0; l < 4; l++)
            s[l] += x[i + l];
    for (; i < n; i++)
        s[0] += x[i];
    return (s[0] + s[1]) + (s[2] + s[3]);
}

EACH_PROCESSOR static void interpolate(const Elements *s, const double *x, Py_ssize_t first, Py_ssize_t lanes)
{
    const int nl = s->n_local, nq = s->n_quadrature;
    for (Py_ssize_t e = 0; e < lanes; e++) {
        const int32_t *gather = s->gather + (first + e) * 2 * nl;
        for (int a = 0; a < 2 * nl; a++)
            s->coefficients[a * s->block + e] = gather[a] < s->n_free ? x[gather[a]] : 0.0;
    }
    product(s->table, 2 * nq, nl, s->coefficients, s->block, s->local, lanes);
    product(s->table, 2 * nq, nl, s->coefficients + nl * s->block, s->block, s->local + 2 * nq * lanes, lanes);
}

/* values (3), forces (3, n_free: E', V', P V' - E') and densities (20, n_points) at the unknowns x; parameters of the point function in place */
EACH_PROCESSOR static void evaluate(const Elements *s, const double *x, const double *parameters, double *values, double *forces, double *density)
{
    const int nq = s->n_quadrature;
    const Tape *tape = &s->tape;
    const Py_ssize_t n = s->n_free, spare = n + 1;
    memcpy(s->scalars, tape->constants, sizeof(double) * tape->n_constants);
    s->scalars[tape->n_constants] = parameters[0], s->scalars[tape->n_constants + 1] = parameters[1];
    tape_scalars(tape, s->scalars);
    memset(s->sums, 0, sizeof(double) * 2 * spare);
    values[0] = values[1] = values[2] = 0.0;
    for (Py_ssize_t first = 0; first < s->n_elements; first += s->block) {
        const Py_ssize_t lanes = s->n_elements - first < s->block ? s->n_elements - first : s->block, points = lanes * nq;
        interpolate(s, x, first, lanes);
        for (int k = 0; k < s->n_data; k++)
            s->pointers[k] = s->data + first * nq * s->n_data + k * points;
        for (Py_ssize_t k = 0; k < tape->n_registers - s->n_data; k++)
            s->pointers[s->n_data + k] = (k < 4 ? s->local : s->registers - 4 * points) + k * points;
        tape_run(tape, s->scalars, s->pointers, points);
        const double *rows = s->pointers[s->n_data + 4];
        for (int k = 0; k < N_SUMS; k++)
            values[k] += total(rows + k * points, points);
        const double *force = rows + N_SUMS * points;
        integrate(s, s->transposed, force, first, lanes, s->sums);
        integrate(s, s->transposed, force + 4 * points, first, lanes, s->sums + spare);
        if (lanes == s->n_elements) {
            memcpy(density, force, sizeof(double) * N_DENSITY * points);
        } else {
            for (int r = 0; r < N_DENSITY * nq; r++)
                memcpy(density + r * s->n_elements + first, force + r * lanes, sizeof(double) * lanes);
        }
    }
    for (Py_ssize_t i = 0; i < n; i++) {
        const double elastic = forces[i] = s->sums[i], volume = forces[n + i] = s->sums[spare + i];
        forces[2 * n + i] = parameters[0] * volume - elastic;
    }
}

/* largest sum of absolute forces |E'| + |P| |V'| that meet at an unknown of each component */
EACH_PROCESSOR static void force_scale(const Elements *s, const double *force, double pressure, double scale[2])
{
    const int nq = s->n_quadrature, rows = 4 * nq;
    const Py_ssize_t step = s->block, ne = s->n_elements;
    double *part = s->registers; /* free between evaluations, and no smaller */
    memset(s->sums, 0, sizeof(double) * (s->n_free + 1));
    for (Py_ssize_t first = 0; first < ne; first += step) {
        const Py_ssize_t lanes = ne - first < step ? ne - first : step;
        for (int r = 0; r < rows; r++) {
            const double *a = force + r * ne + first, *b = a + rows * ne;
            for (Py_ssize_t e = 0; e < lanes; e++)
                part[r * lanes + e] = fabs(a[e]) + fabs(pressure) * fabs(b[e]);
        }
        integrate(s, s->magnitudes, part, first, lanes, s->sums);
    }
    scale[0] = scale[1] = 0.0;
    for (Py_ssize_t i = 0; i < s->n_free; i++)
        if (!(s->sums[i] <= scale[s->field[i]]))
            scale[s->field[i]] = s->sums[i];
}

/* ---- assembly of second derivatives, (10, n_quadrature, n_elements) ------------------------------------------------------------- */

/* where a pair of local variables (u, u_x, w, w_x) stands among the second derivatives */
static const int PAIR[4][4] = {{0, 1, 2, 3}, {1, 4, 5, 6}, {2, 5, 7, 8}, {3, 6, 8, 9}};

/* Added to the lower triangle by columns of depth kd + 1; one more entry behind them takes what belongs to no pair of unknowns. */
EACH_PROCESSOR static void assemble(const Elements *s, const double *density, double *lower)
{
    const int nl = s->n_local, nq = s->n_quadrature, depth = 2 * nq;
    const Py_ssize_t ne = s->n_elements;
    const int32_t *place = s->place;
    double *d = s->scratch, *t = d + N_STIFF * nq * LANES; /* t: (2 n_quadrature, 2 n_local, lanes) */
    memset(lower, 0, sizeof(double) * ((s->kd + 1) * s->n_free + 1));
    for (Py_ssize_t first = 0; first < ne; first += LANES) {
        const int valid = ne - first < LANES ? (int)(ne - first) : LANES;
        for (int r = 0; r < N_STIFF * nq; r++)
            for (int l = 0; l < valid; l++)
                d[r * LANES + l] = density[r * ne + first + l];
        for (int component = 0; component < 2; component++) {
            const int from = component * nl; /* the lower block of w against u is the transposed upper one */
            for (int side = 0; side < 2; side++)
                for (int q = 0; q < nq; q++) {
                    double *row = t + (side * nq + q) * 2 * nl * LANES;
                    for (int other = component; other < 2; other++) {
                        const double *a = d + (PAIR[2 * component + side][2 * other] * nq + q) * LANES;
                        const double *b = d + (PAIR[2 * component + side][2 * other + 1] * nq + q) * LANES;
                        for (int j = 0; j < nl; j++)
                            for (int l = 0; l < LANES; l++)
                                row[(other * nl + j) * LANES + l] = a[l] * s->table[q * nl + j] + b[l] * s->table[(nq + q) * nl + j];
                    }
                }
            for (int i = from; i < from + nl; i++)
                for (int j = i; j < 2 * nl; j += TOGETHER) {
                    double sum[TOGETHER][LANES];
                    row_times(2 * nl - j, s->transposed + (i - from) * depth, depth, t + j * LANES, 2 * nl * LANES, sum);
                    for (int c = j; c < j + TOGETHER && c < 2 * nl; c++, place += LANES)
                        for (int l = 0; l < LANES; l++)
                            lower[place[l]] += sum[c - j][l];
                }
        }
    }
}

/* ---- for the corrector -------------------------------------------------------------------------------------------------------------- */

/* largest sizes of a vector of unknowns among u and among w; infinite where there is no number */
static void largest(const Elements *s, const double *x, double *size)
{
    size[0] = size[1] = 0.0;
    for (Py_ssize_t i = 0; i < s->n_free; i++) {
        const double a = fabs(x[i]);
        if (!(a <= size[s->field[i]]))
            size[s->field[i]] = a < HUGE_VAL ? a : HUGE_VAL;
    }
}

/* factors of K at the densities, with the column -V' and the row and corner in place; -1 without memory */
static int bordered(const Elements *s, Border *b, const double *stiffness, const double *volume_gradient, double corner)
{
    Factor *f = &b->factor;
    const Py_ssize_t n = s->n_free;
    free(f->lu), free(f->swaps);
    f->lu = NULL, f->swaps = NULL;
    assemble(s, stiffness, f->lower);
    if (factor_symmetric(f) < 0) {
        double *band = doubles((size_t)(3 * s->kd + 1) * n);
        if (band == NULL)
            return -1;
        assemble(s, stiffness, f->lower);
        general_storage(f->lower, (int)n, s->kd, band);
        const int failed = factor_general(f, band);
        free(band);
        if (failed)
            return -1;
    }
    for (Py_ssize_t i = 0; i < n; i++)
        b->column[i] = -volume_gradient[i];
    border_set(b, corner);
    return 0;
}

/* The integrand of x . K x at the quadrature points: per element its sum with weights, in size, and the sizes of its terms; sums of both */
EACH_PROCESSOR static void form_parts(const Elements *s, const double *stiffness, const double *x, const double *weights, double parts[2])
{
    const int nq = s->n_quadrature;
    const Py_ssize_t step = s->block, ne = s->n_elements;
    double *weighed = s->registers, *sizes = weighed + step; /* free between evaluations, and larger */
    parts[0] = parts[1] = 0.0;
    for (Py_ssize_t first = 0; first < ne; first += step) {
        const Py_ssize_t lanes = ne - first < step ? ne - first : step;
        interpolate(s, x, first, lanes);
        memset(weighed, 0, sizeof(double) * lanes), memset(sizes, 0, sizeof(double) * lanes);
        for (int i = 0; i < 4; i++)
            for (int j = i; j < 4; j++)
                for (int q = 0; q < nq; q++) {
                    const double *a = s->local + (i * nq + q) * lanes, *b = s->local + (j * nq + q) * lanes;
                    const double *k = stiffness + (PAIR[i][j] * nq + q) * ne + first, times = i == j ? 1.0 : 2.0;
                    INDEPENDENT
                    for (Py_ssize_t e = 0; e < lanes; e++) {
                        const double term = times * k[e] * (a[e] * b[e]);
                        weighed[e] += weights[q] * term;
                        sizes[e] += fabs(term);
                    }
                }
        for (Py_ssize_t e = 0; e < lanes; e++)
            parts[0] += fabs(weighed[e]), parts[1] += sizes[e];
    }
}

/* Jumps of the slope of the deformed meridian where elements meet, over the smaller side, and at the poles: `poles` 1 for that at the first
   end, 2 for that at the last. The arrays of both ends of the elements have the components along first: (along 0, along 1, up 0, up 1). */
static void kinks(const Elements *s, const double *x, const double *at_rest, const double *slopes, const double *per_length, int poles, double *jumps)
{
    const Py_ssize_t ne = s->n_elements, inner = ne - 1;
    const int m = s->n_local;
    double along = 0.0, up = 0.0, size = 0.0; /* at the end of the element before */
    for (Py_ssize_t e = 0; e < ne; e++) {
        const int32_t *u = s->gather + 2 * m * e, *w = u + m;
        double y[4] = {0.0, 0.0, 0.0, 0.0};
        for (int k = 0; k < m; k++) {
            const double first = slopes[k], last = slopes[2 * m + k];
            const double a = u[k] < s->n_free ? x[u[k]] : 0.0, b = w[k] < s->n_free ? x[w[k]] : 0.0;
            y[0] += first * a, y[1] += last * a, y[2] += first * b, y[3] += last * b;
        }
        for (int i = 0; i < 4; i++)
            y[i] = y[i] * per_length[i * ne + e] + at_rest[i * ne + e];
        const double before = sqrt(y[0] * y[0] + y[2] * y[2]) + 1e-300, along_jump = along - y[0], up_jump = up - y[2];
        if (e > 0)
            jumps[e - 1] = sqrt(along_jump * along_jump + up_jump * up_jump) / (size < before ? size : before);
        else if (poles & 1)
            jumps[inner] = 2.0 * fabs(y[2]) / before;
        along = y[1], up = y[3], size = sqrt(along * along + up * up) + 1e-300;
    }
    if (poles & 2)
        jumps[inner + (poles & 1)] = 2.0 * fabs(up) / size;
}

/* ---- Python --------------------------------------------------------------------------------------------------------------------- */

static void elements_dealloc(PyObject *self)
{
    Elements *s = (Elements *)self;
    PyTypeObject *type = Py_TYPE(self);
    tape_free(&s->tape);
    free(s->data), free(s->gather), free(s->place), free(s->field), free(s->table), free(s->scalars), free(s->registers), free(s->scratch);
    free(s->sums), free(s->pointers), free(s->local), free(s->coefficients);
    PyObject_Free(self);
    Py_DECREF(type);
}

static void fill_places(Elements *s)
{
    const int nl = s->n_local;
    const Py_ssize_t n = s->n_free, nobody = n * (s->kd + 1);
    int32_t *place = s->place;
    for (Py_ssize_t first = 0; first < s->n_elements; first += LANES)
        for (int i = 0; i < 2 * nl; i++)
            for (int j = i; j < 2 * nl; j++)
                for (Py_ssize_t e = first; e < first + LANES; e++) {
                    const int32_t *gather = s->gather + e * 2 * nl;
                    const Py_ssize_t a = e < s->n_elements ? gather[i] : n, b = e < s->n_elements ? gather[j] : n;
                    const Py_ssize_t low = a < b ? a : b, high = a < b ? b : a;
                    *place++ = (int32_t)(high < n ? low * (s->kd + 1) + high - low : nobody);
                }
}

static int elements_fill(Elements *s, const double *data, const int64_t *gather, const double *table, const int64_t *field)
{
    const int nq = s->n_quadrature, nl = s->n_local;
    const Py_ssize_t ne = s->n_elements, cells = (Py_ssize_t)2 * nq * nl;
    const Py_ssize_t most = POINTS / nq < LANES ? LANES : POINTS / nq / LANES * LANES;
    s->block = ne < most ? ne : most;
    const size_t points = (size_t)s->block * nq;
    s->data = doubles(s->n_data * s->n_points), s->table = doubles(3 * cells), s->local = doubles(4 * points);
    s->gather = malloc(sizeof(int32_t) * (ne * 2 * nl + 1)), s->field = malloc(s->n_free + 1);
    s->place = malloc(sizeof(int32_t) * ((ne + LANES) * nl * (2 * nl + 1)));
    s->scalars = doubles(s->tape.n_scalars + 2), s->registers = doubles((s->tape.n_registers - s->n_data - 4) * points);
    s->scratch = doubles((size_t)(N_STIFF * nq + 2 * nq * 2 * nl) * LANES), s->sums = doubles(2 * (s->n_free + 1));
    s->pointers = calloc(s->tape.n_registers + 1, sizeof(double *)), s->coefficients = doubles(2 * nl * s->block);
    if (!(s->data && s->table && s->local && s->gather && s->place && s->field && s->scalars && s->registers && s->scratch && s->sums && s->pointers &&
          s->coefficients)) {
        PyErr_NoMemory();
        return -1;
    }
    s->transposed = s->table + cells, s->magnitudes = s->transposed + cells;
    for (int r = 0; r < 2 * nq; r++)
        for (int a = 0; a < nl; a++) { /* the table of both components is made of blocks: that of u comes first */
            const double v = table[(Py_ssize_t)r * 2 * nl + a];
            s->table[r * nl + a] = s->transposed[a * 2 * nq + r] = v;
            s->magnitudes[a * 2 * nq + r] = fabs(v);
        }
    for (Py_ssize_t e = 0; e < ne; e++)
        for (int a = 0; a < 2 * nl; a++) {
            const int64_t g = gather[a * ne + e];
            if (g < 0 || g > s->n_free) {
                PyErr_SetString(PyExc_ValueError, "gather: an unknown does not exist");
                return -1;
            }
            s->gather[e * 2 * nl + a] = (int32_t)g;
        }
    for (Py_ssize_t e = 0; e < ne; e++)
        for (int a = 0; a < 2 * nl; a++)
            for (int b = 0; b < 2 * nl; b++) {
                const int32_t i = s->gather[e * 2 * nl + a], j = s->gather[e * 2 * nl + b];
                if (i < s->n_free && j < s->n_free && (i - j > s->kd || j - i > s->kd)) {
                    PyErr_SetString(PyExc_ValueError, "gather: unknowns of one element are farther apart than the half bandwidth");
                    return -1;
                }
            }
    fill_places(s);
    for (Py_ssize_t i = 0; i < s->n_free; i++)
        s->field[i] = field[i] != 0;
    for (Py_ssize_t first = 0; first < ne; first += s->block) {
        const Py_ssize_t lanes = ne - first < s->block ? ne - first : s->block;
        for (int k = 0; k < s->n_data; k++)
            for (int q = 0; q < nq; q++)
                memcpy(s->data + first * nq * s->n_data + (k * nq + q) * lanes, data + (k * nq + q) * ne + first, sizeof(double) * lanes);
    }
    return 0;
}

/* Elements(tape, data, gather, table, field, n_quadrature, n_local, half bandwidth): numbers of points and unknowns by their sizes */
static PyObject *elements_new(PyTypeObject *type, PyObject *args, PyObject *kwargs)
{
    PyObject *tape, *data, *gather, *table, *field;
    Py_buffer d = {0}, g = {0}, t = {0}, f = {0};
    int nq, nl, kd;
    (void)kwargs;
    if (!PyArg_ParseTuple(args, "O!OOOOiii", &PyTuple_Type, &tape, &data, &gather, &table, &field, &nq, &nl, &kd))
        return NULL;
    if (nq < 1 || nl < 1 || kd < 0) {
        PyErr_SetString(PyExc_ValueError, "no elements have these sizes");
        return NULL;
    }
    allocfunc allocate = PyType_GetSlot(type, Py_tp_alloc);
    Elements *s = (Elements *)allocate(type, 0);
    if (s == NULL)
        return NULL;
    s->n_quadrature = nq, s->n_local = nl, s->kd = kd;
    int bad = tape_init(&s->tape, tape) < 0 || take_array(gather, &g, 'l', -1, 0, "gather") < 0 || take_array(field, &f, 'l', -1, 0, "field") < 0;
    if (!bad) {
        s->n_elements = g.len / (8 * 2 * nl), s->n_free = f.len / 8, s->n_points = s->n_elements * nq;
        s->n_data = (int)s->tape.n_inputs - 4;
        bad = take_array(data, &d, 'd', s->n_data * s->n_points, 0, "data") < 0 ||
              take_array(table, &t, 'd', (Py_ssize_t)8 * nq * nl, 0, "table") < 0;
        if (!bad && (s->tape.n_outputs != N_ROWS || s->n_data < 0 || s->tape.n_parameters != 2)) {
            PyErr_SetString(PyExc_ValueError, "the tape is not that of a potential");
            bad = 1;
        }
    }
    bad = bad || elements_fill(s, d.buf, g.buf, t.buf, f.buf) < 0;
    PyBuffer_Release(&d), PyBuffer_Release(&g), PyBuffer_Release(&t), PyBuffer_Release(&f);
    if (bad)
        Py_CLEAR(s);
    return (PyObject *)s;
}

/* 1 if all are numbers */
static int all_finite(const double *x, Py_ssize_t n)
{
    double sums[8] = {0}; /* x - x is 0 of a number, and no number otherwise */
    Py_ssize_t i = 0;
    for (; i + 8 <= n; i += 8)
        for (int l = 0; l < 8; l++)
            sums[l] += x[i + l] - x[i + l];
    for (; i < n; i++)
        sums[0] += x[i] - x[i];
    return total(sums, 8) == 0.0;
}

/* evaluate(x, pressure, factor, forces, densities): (elastic, magnetic, volume, whether gradients and second derivatives are numbers) */
static PyObject *elements_evaluate(PyObject *self, PyObject *args)
{
    const Elements *s = (Elements *)self;
    PyObject *o[3], *whole = Py_False;
    Py_buffer x = {0}, g = {0}, d = {0};
    double values[3], parameters[2];
    if (!PyArg_ParseTuple(args, "OddOO", &o[0], &parameters[0], &parameters[1], &o[1], &o[2]))
        return NULL;
    const int bad = take_array(o[0], &x, 'd', s->n_free, 0, "x") < 0 || take_array(o[1], &g, 'd', 3 * s->n_free, 1, "forces") < 0 ||
                    take_array(o[2], &d, 'd', N_DENSITY * s->n_points, 1, "densities") < 0;
    if (!bad) {
        const double *stiffness = (double *)d.buf + N_FORCE * s->n_points;
        evaluate(s, x.buf, parameters, values, g.buf, d.buf);
        whole = all_finite(g.buf, 2 * s->n_free) && all_finite(stiffness, N_STIFF * s->n_points) ? Py_True : Py_False;
    }
    PyBuffer_Release(&x), PyBuffer_Release(&g), PyBuffer_Release(&d);
    return bad ? NULL : Py_BuildValue("(dddO)", values[0], values[1], values[2], whole);
}

/* at_quadrature(x, out): (u, u_x, w, w_x) at the quadrature points, shape (4, n_points) */
static PyObject *elements_at_quadrature(PyObject *self, PyObject *args)
{
    const Elements *s = (Elements *)self;
    PyObject *source, *target;
    Py_buffer x = {0}, out = {0};
    if (!PyArg_ParseTuple(args, "OO", &source, &target))
        return NULL;
    const int bad = take_array(source, &x, 'd', s->n_free, 0, "x") < 0 || take_array(target, &out, 'd', 4 * s->n_points, 1, "out") < 0;
    for (Py_ssize_t first = 0; !bad && first < s->n_elements; first += s->block) {
        const Py_ssize_t lanes = s->n_elements - first < s->block ? s->n_elements - first : s->block;
        interpolate(s, x.buf, first, lanes);
        for (int r = 0; r < 4 * s->n_quadrature; r++)
            memcpy((double *)out.buf + r * s->n_elements + first, s->local + r * lanes, sizeof(double) * lanes);
    }
    PyBuffer_Release(&x), PyBuffer_Release(&out);
    return bad ? NULL : Py_NewRef(Py_None);
}

/* assemble(densities, band): the second derivatives of an evaluation into general band storage, shape (n_free, 3 kd + 1) of zeros */
static PyObject *elements_assemble(PyObject *self, PyObject *args)
{
    const Elements *s = (Elements *)self;
    PyObject *density, *band;
    Py_buffer d = {0}, b = {0};
    if (!PyArg_ParseTuple(args, "OO", &density, &band))
        return NULL;
    double *lower = NULL;
    const int bad = take_array(density, &d, 'd', N_DENSITY * s->n_points, 0, "densities") < 0 ||
                    take_array(band, &b, 'd', s->n_free * (3 * s->kd + 1), 1, "band") < 0;
    if (!bad && (lower = doubles((size_t)(s->kd + 1) * s->n_free + 1)) != NULL) {
        assemble(s, (double *)d.buf + N_FORCE * s->n_points, lower);
        general_storage(lower, (int)s->n_free, s->kd, b.buf);
    }
    PyBuffer_Release(&d), PyBuffer_Release(&b);
    if (bad)
        return NULL;
    if (lower == NULL)
        return PyErr_NoMemory();
    free(lower);
    Py_RETURN_NONE;
}

/* largest(x): largest sizes among u and among w */
static PyObject *elements_largest(PyObject *self, PyObject *source)
{
    const Elements *s = (Elements *)self;
    Py_buffer x = {0};
    double size[2];
    const int bad = take_array(source, &x, 'd', s->n_free, 0, "x") < 0;
    if (!bad)
        largest(s, x.buf, size);
    PyBuffer_Release(&x);
    return bad ? NULL : Py_BuildValue("(dd)", size[0], size[1]);
}

/* force_scale(densities, pressure): largest sums of absolute forces that meet at a node, along u and along w */
static PyObject *elements_force_scale(PyObject *self, PyObject *args)
{
    const Elements *s = (Elements *)self;
    PyObject *source;
    Py_buffer d = {0};
    double pressure, scale[2];
    if (!PyArg_ParseTuple(args, "Od", &source, &pressure))
        return NULL;
    const int bad = take_array(source, &d, 'd', N_DENSITY * s->n_points, 0, "densities") < 0;
    if (!bad)
        force_scale(s, d.buf, pressure, scale);
    PyBuffer_Release(&d);
    return bad ? NULL : Py_BuildValue("(dd)", scale[0], scale[1]);
}

/* form_parts(densities, x, weights): of the integrand of x . K x, with weights at the quadrature points of an element */
static PyObject *elements_form_parts(PyObject *self, PyObject *args)
{
    const Elements *s = (Elements *)self;
    PyObject *o[3];
    Py_buffer d = {0}, x = {0}, w = {0};
    double parts[2];
    if (!PyArg_ParseTuple(args, "OOO", &o[0], &o[1], &o[2]))
        return NULL;
    const int bad = take_array(o[0], &d, 'd', N_DENSITY * s->n_points, 0, "densities") < 0 ||
                    take_array(o[1], &x, 'd', s->n_free, 0, "x") < 0 || take_array(o[2], &w, 'd', s->n_quadrature, 0, "weights") < 0;
    if (!bad)
        form_parts(s, (double *)d.buf + N_FORCE * s->n_points, x.buf, w.buf, parts);
    PyBuffer_Release(&d), PyBuffer_Release(&x), PyBuffer_Release(&w);
    return bad ? NULL : Py_BuildValue("(dd)", parts[0], parts[1]);
}

/* kinks(x, at rest, slopes, per length, poles, jumps) */
static PyObject *elements_kinks(PyObject *self, PyObject *args)
{
    const Elements *s = (Elements *)self;
    const Py_ssize_t ne = s->n_elements;
    PyObject *o[5];
    Py_buffer x = {0}, r = {0}, d = {0}, l = {0}, j = {0};
    int poles;
    if (!PyArg_ParseTuple(args, "OOOOiO", &o[0], &o[1], &o[2], &o[3], &poles, &o[4]))
        return NULL;
    const int bad = take_array(o[0], &x, 'd', s->n_free, 0, "x") < 0 || take_array(o[1], &r, 'd', 4 * ne, 0, "at rest") < 0 ||
                    take_array(o[2], &d, 'd', 8 * s->n_local, 0, "slopes") < 0 || take_array(o[3], &l, 'd', 4 * ne, 0, "per length") < 0 ||
                    take_array(o[4], &j, 'd', ne - 1 + (poles & 1) + (poles >> 1 & 1), 1, "jumps") < 0;
    if (!bad)
        kinks(s, x.buf, r.buf, d.buf, l.buf, poles, j.buf);
    PyBuffer_Release(&x), PyBuffer_Release(&r), PyBuffer_Release(&d), PyBuffer_Release(&l), PyBuffer_Release(&j);
    if (bad)
        return NULL;
    Py_RETURN_NONE;
}

/* a new object with the factors of [K, -V'; row, corner], or NULL with an exception set */
static BorderObject *new_border(const Elements *s, const double *densities, const double *volume_gradient, const double *row, double corner)
{
    BorderObject *border = PyObject_New(BorderObject, types.border);
    int without = border == NULL || border_init(&border->border, (int)s->n_free, s->kd) < 0;
    if (!without) {
        memcpy(border->border.row, row, sizeof(double) * s->n_free);
        without = bordered(s, &border->border, densities + N_FORCE * s->n_points, volume_gradient, corner) < 0;
    }
    if (without) {
        Py_CLEAR(border);
        PyErr_NoMemory();
    }
    return border;
}

/* border(densities, volume gradient, row, corner): factors of [K, -V'; row, corner] */
static PyObject *elements_border(PyObject *self, PyObject *args)
{
    const Elements *s = (Elements *)self;
    PyObject *o[3];
    Py_buffer d = {0}, v = {0}, r = {0};
    double corner;
    if (!PyArg_ParseTuple(args, "OOOd", &o[0], &o[1], &o[2], &corner))
        return NULL;
    BorderObject *border = NULL;
    if (take_array(o[0], &d, 'd', N_DENSITY * s->n_points, 0, "densities") == 0 && take_array(o[1], &v, 'd', s->n_free, 0, "volume gradient") == 0 &&
        take_array(o[2], &r, 'd', s->n_free, 0, "row") == 0)
        border = new_border(s, d.buf, v.buf, r.buf, corner);
    PyBuffer_Release(&d), PyBuffer_Release(&v), PyBuffer_Release(&r);
    return (PyObject *)border;
}

/* step(densities, forces, row, corner, gap, x, dx): (Border, dp, largest of dx, largest of x) with the solution for (P V' - E', -gap) in dx */
static PyObject *elements_step(PyObject *self, PyObject *args)
{
    const Elements *s = (Elements *)self;
    const Py_ssize_t n = s->n_free;
    PyObject *o[5];
    Py_buffer d = {0}, f = {0}, r = {0}, x = {0}, dx = {0};
    double corner, gap, dp = 0.0, change[2], size[2];
    if (!PyArg_ParseTuple(args, "OOOddOO", &o[0], &o[1], &o[2], &corner, &gap, &o[3], &o[4]))
        return NULL;
    BorderObject *border = NULL;
    if (take_array(o[0], &d, 'd', N_DENSITY * s->n_points, 0, "densities") == 0 && take_array(o[1], &f, 'd', 3 * n, 0, "forces") == 0 &&
        take_array(o[2], &r, 'd', n, 0, "row") == 0 && take_array(o[3], &x, 'd', n, 0, "x") == 0 && take_array(o[4], &dx, 'd', n, 1, "dx") == 0)
        border = new_border(s, d.buf, (double *)f.buf + n, r.buf, corner);
    if (border != NULL) {
        dp = border_solve(&border->border, (double *)f.buf + 2 * n, -gap, dx.buf);
        largest(s, dx.buf, change), largest(s, x.buf, size);
    }
    PyBuffer_Release(&d), PyBuffer_Release(&f), PyBuffer_Release(&r), PyBuffer_Release(&x), PyBuffer_Release(&dx);
    return border == NULL ? NULL : Py_BuildValue("Nd(dd)(dd)", border, dp, change[0], change[1], size[0], size[1]);
}

static PyMethodDef elements_methods[] = {{"at_quadrature", elements_at_quadrature, METH_VARARGS, NULL},
                                         {"evaluate", elements_evaluate, METH_VARARGS, NULL},
                                         {"assemble", elements_assemble, METH_VARARGS, NULL},
                                         {"largest", elements_largest, METH_O, NULL},
                                         {"force_scale", elements_force_scale, METH_VARARGS, NULL},
                                         {"form_parts", elements_form_parts, METH_VARARGS, NULL},
                                         {"kinks", elements_kinks, METH_VARARGS, NULL},
                                         {"border", elements_border, METH_VARARGS, NULL},
                                         {"step", elements_step, METH_VARARGS, NULL},
                                         {NULL, NULL, 0, NULL}};
static PyType_Slot elements_slots[] = {
    {Py_tp_new, elements_new}, {Py_tp_dealloc, elements_dealloc}, {Py_tp_methods, elements_methods}, {0, NULL}};
PyType_Spec elements_spec = {"femmembrane._native.Elements", sizeof(Elements), 0, Py_TPFLAGS_DEFAULT, elements_slots};
