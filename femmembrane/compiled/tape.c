/* The instructions of a point function, replayed on blocks of points: one loop for each instruction. */
#include "native.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define UNARY(X)                                                                                                                          \
    X(NEG, -a) X(TWICE, 2.0 * a) X(SQ, a * a) X(INV, 1.0 / a) X(SQRT, sqrt(a)) X(FABS, fabs(a)) X(EXP, exp(a)) X(LOG, log(a))             \
    X(EXPM1, expm1(a)) X(LOG1P, log1p(a)) X(SIN, sin(a)) X(COS, cos(a)) X(TAN, tan(a)) X(ASIN, asin(a)) X(ACOS, acos(a))                  \
    X(ATAN, atan(a)) X(SINH, sinh(a)) X(COSH, cosh(a)) X(TANH, tanh(a)) X(ASINH, asinh(a)) X(ACOSH, acosh(a)) X(ATANH, atanh(a))          \
    X(FLOOR, floor(a)) X(CEIL, ceil(a)) X(NOT, (double)(a == 0.0)) X(SIGN, (a < 0.0 ? -1.0 : a > 0.0 ? 1.0 : a)) X(ERF, erf(a)) X(ASSIGN, a)
#define BINARY(X)                                                                                                                         \
    X(ADD, a + b) X(SUB, a - b) X(MUL, a * b) X(DIV, a / b) X(POW, pow(a, b)) X(CONSTPOW, pow(a, b)) X(FMIN, fmin(a, b))                  \
    X(FMAX, fmax(a, b)) X(LT, (double)(a < b)) X(LE, (double)(a <= b)) X(EQ, (double)(a == b)) X(NE, (double)(a != b))                    \
    X(AND, (double)((a != 0.0) && (b != 0.0))) X(OR, (double)((a != 0.0) || (b != 0.0))) X(IF_ELSE_ZERO, (a != 0.0 ? b : 0.0))            \
    X(ATAN2, atan2(a, b)) X(HYPOT, hypot(a, b)) X(COPYSIGN, copysign(a, b)) X(FMOD, fmod(a, b))

#define NUMBER(NAME, EXPRESSION) OP_##NAME,
enum { UNARY(NUMBER) N_UNARY, BEFORE_BINARY = N_UNARY - 1, BINARY(NUMBER) N_OPERATIONS };
#undef NUMBER
#define WORD(NAME, EXPRESSION) #NAME,
static const char *const names[] = {UNARY(WORD) BINARY(WORD)};
#undef WORD

PyObject *tape_operations(void)
{
    PyObject *list = PyTuple_New(N_OPERATIONS);
    for (int k = 0; list != NULL && k < N_OPERATIONS; k++) {
        PyObject *name = PyUnicode_FromString(names[k]);
        if (name == NULL || PyTuple_SetItem(list, k, name) < 0) {
            Py_DECREF(list);
            return NULL;
        }
    }
    return list;
}

/*
 * expm1 of many points, of which a strain energy is made: 2^k (1 + p) - 1 with p = expm1(r), |r| <= log(2)/2, by its series to r^14. Unlike
 * the library's it is computed several points at a time; within 2.2 units in the last place (the library 0.9). Arguments beyond +-700 and NaN are the library's.
 */
static inline void expm1_many(double *r, const double *x, Py_ssize_t n)
{
    const double per_log2 = 1.44269504088896338700, high = 6.93147180369123816490e-01, low = 1.90821492927058770002e-10;
    const double round = 0x1.8p52; /* added and subtracted: to the nearest whole number, which then stands in the last bits */
    double beyond = 0.0;
    for (Py_ssize_t i = 0; i < n; i++)
        beyond = fabs(x[i]) <= 700.0 ? beyond : 1.0;
    if (beyond != 0.0) {
        for (Py_ssize_t i = 0; i < n; i++)
            r[i] = expm1(x[i]);
        return;
    }
    INDEPENDENT
    for (Py_ssize_t i = 0; i < n; i++) {
        const double a = x[i], shifted = a * per_log2 + round, k = shifted - round;
        const double t = (a - k * high) - k * low, t2 = t * t, t4 = t2 * t2;
        int64_t bits;
        double scale;
        memcpy(&bits, &shifted, 8);
        bits = (int64_t)((uint64_t)bits << 52) + ((int64_t)1023 << 52);
        memcpy(&scale, &bits, 8);
        const double q0 = 1.0 / 2 + t * (1.0 / 6), q1 = 1.0 / 24 + t * (1.0 / 120), q2 = 1.0 / 720 + t * (1.0 / 5040);
        const double q3 = 1.0 / 40320 + t * (1.0 / 362880), q4 = 1.0 / 3628800 + t * (1.0 / 39916800);
        const double q5 = 1.0 / 479001600 + t * (1.0 / 6227020800.0) + t2 * (1.0 / 87178291200.0);
        const double q = (q0 + t2 * q1) + t4 * ((q2 + t2 * q3) + t4 * (q4 + t2 * q5));
        const double p = t + t2 * q;
        r[i] = (scale - 1.0) + scale * p;
    }
}

static double apply(int code, double a, double b)
{
#define CASE(NAME, EXPRESSION)                                                                                                            \
    case OP_##NAME:                                                                                                                       \
        return EXPRESSION;
    switch (code) {
        UNARY(CASE)
        BINARY(CASE)
    }
#undef CASE
    return NAN;
}

void tape_scalars(const Tape *tape, double *s)
{
    for (Py_ssize_t k = 0; k < tape->n_scalar; k++) {
        const Instruction i = tape->scalar[k];
        s[-1 - i.target] = apply(i.code, s[-1 - i.left], s[-1 - i.right]);
    }
}

static inline void fill(double *r, double value, Py_ssize_t n)
{
    for (Py_ssize_t i = 0; i < n; i++)
        r[i] = value;
}

EACH_PROCESSOR
void tape_run(const Tape *tape, const double *scalars, double **registers, Py_ssize_t n)
{
    for (const Instruction *i = tape->vector, *end = i + tape->n_vector; i != end; i++) {
        double *r = registers[i->target];
        const double *left = i->left < 0 ? &scalars[-1 - i->left] : registers[i->left];
        const double *right = i->right < 0 ? &scalars[-1 - i->right] : registers[i->right];
        if (i->code == OP_EXPM1 && i->left >= 0) {
            expm1_many(r, left, n);
            continue;
        }
        switch (i->code) {
#define CASE(NAME, EXPRESSION)                                                                                                            \
    case OP_##NAME:                                                                                                                       \
        if (i->left < 0) {                                                                                                                \
            const double a = *left;                                                                                                       \
            fill(r, EXPRESSION, n);                                                                                                       \
        } else {                                                                                                                          \
            INDEPENDENT                                                                                                                   \
            for (Py_ssize_t k = 0; k < n; k++) {                                                                                          \
                const double a = left[k];                                                                                                 \
                r[k] = EXPRESSION;                                                                                                        \
            }                                                                                                                             \
        }                                                                                                                                 \
        break;
            UNARY(CASE)
#undef CASE
#define CASE(NAME, EXPRESSION)                                                                                                            \
    case OP_##NAME:                                                                                                                       \
        if (i->left < 0) {                                                                                                                \
            const double a = *left;                                                                                                       \
            INDEPENDENT                                                                                                                   \
            for (Py_ssize_t k = 0; k < n; k++) {                                                                                          \
                const double b = right[k];                                                                                                \
                r[k] = EXPRESSION;                                                                                                        \
            }                                                                                                                             \
        } else if (i->right < 0) {                                                                                                        \
            const double b = *right;                                                                                                      \
            INDEPENDENT                                                                                                                   \
            for (Py_ssize_t k = 0; k < n; k++) {                                                                                          \
                const double a = left[k];                                                                                                 \
                r[k] = EXPRESSION;                                                                                                        \
            }                                                                                                                             \
        } else {                                                                                                                          \
            INDEPENDENT                                                                                                                   \
            for (Py_ssize_t k = 0; k < n; k++) {                                                                                          \
                const double a = left[k], b = right[k];                                                                                   \
                r[k] = EXPRESSION;                                                                                                        \
            }                                                                                                                             \
        }                                                                                                                                 \
        break;
            BINARY(CASE)
#undef CASE
        }
    }
}

/* Each register that an instruction reads or writes must exist: a tape is checked once, so that running it needs no checks. */
static int check(const Tape *t, const Instruction *list, Py_ssize_t count, int scalar)
{
    for (Py_ssize_t k = 0; k < count; k++) {
        const Instruction i = list[k];
        const int32_t low = -(int32_t)t->n_scalars, high = (int32_t)t->n_registers;
        int bad = i.code < 0 || i.code >= N_OPERATIONS;
        bad |= i.left < low || i.left >= high || i.right < low || i.right >= high || i.target < low || i.target >= high;
        bad |= scalar ? i.target >= 0 || i.left >= 0 || i.right >= 0 : i.target < (int32_t)t->n_inputs;
        bad |= scalar && i.target > -1 - (int32_t)(t->n_constants + t->n_parameters);
        if (bad) {
            PyErr_SetString(PyExc_ValueError, "an instruction of the tape has no meaning");
            return -1;
        }
    }
    return 0;
}

/* (scalar instructions, vector instructions, constants, numbers of parameters, scalars, inputs, registers and outputs) */
int tape_init(Tape *t, PyObject *description)
{
    PyObject *scalar, *vector, *constants;
    Py_buffer s = {0}, v = {0}, c = {0};
    int result = -1;
    if (!PyArg_ParseTuple(description, "OOOnnnnn", &scalar, &vector, &constants, &t->n_parameters, &t->n_scalars, &t->n_inputs, &t->n_registers, &t->n_outputs))
        return -1;
    if (take_array(scalar, &s, 'l', -1, 0, "scalar") == 0 && take_array(vector, &v, 'l', -1, 0, "vector") == 0 &&
        take_array(constants, &c, 'd', -1, 0, "constants") == 0) {
        t->n_scalar = s.len / (4 * 8), t->n_vector = v.len / (4 * 8), t->n_constants = c.len / 8;
        t->scalar = calloc(t->n_scalar + t->n_vector + 1, sizeof(Instruction));
        t->constants = malloc(c.len + 8);
        if (t->scalar == NULL || t->constants == NULL) {
            PyErr_NoMemory();
        } else {
            t->vector = t->scalar + t->n_scalar;
            memcpy(t->constants, c.buf, c.len);
            int32_t *numbers = (int32_t *)t->scalar;
            for (Py_ssize_t k = 0; k < 4 * t->n_scalar; k++)
                numbers[k] = (int32_t)((const int64_t *)s.buf)[k];
            for (Py_ssize_t k = 0; k < 4 * t->n_vector; k++)
                numbers[4 * t->n_scalar + k] = (int32_t)((const int64_t *)v.buf)[k];
            result = check(t, t->scalar, t->n_scalar, 1) | check(t, t->vector, t->n_vector, 0);
            if (t->n_scalars < t->n_constants + t->n_parameters || t->n_registers < t->n_inputs + t->n_outputs) {
                PyErr_SetString(PyExc_ValueError, "the tape has too few registers");
                result = -1;
            }
        }
    }
    PyBuffer_Release(&s), PyBuffer_Release(&v), PyBuffer_Release(&c);
    return result;
}

void tape_free(Tape *t)
{
    free(t->scalar), free(t->constants);
    t->scalar = t->vector = NULL, t->constants = NULL;
}
