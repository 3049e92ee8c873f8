/* The image under candidate lattices: what `evaluate.c` and `posterior.c` both know.

   Names, units and frames are those of the Python that calls them. Arrays are C-contiguous. */

#ifndef TOUCH_DATA_H
#define TOUCH_DATA_H

#include <math.h>
#include <stdint.h>

enum { UNKNOWNS = 11, FIELDS = 6 };

typedef struct {
    int64_t b, n, q, size;      /* candidates, tactels, symbols, grid points along a side */
    int64_t hardens, falls;     /* of the overlay; rows of `falls`, 0 for a flat face */
    int64_t high, wide;         /* of the tables of labels */
    double symbol, deepest;     /* Pressing */
    double pitch, half, step;   /* ResponseTemplate, mm */
    double noise;               /* of the readings */
    double least_gain, full_press, least_press, steepest;       /* gains: kernels.py */
    double quiet, displaced, loud, most, first, far, grazed, tie;   /* noise: kernels.py */
    double damping, easier, harder, settled, shallower, deepest_gain; /* steps: kernels.py */
    double least[UNKNOWNS], largest[UNKNOWNS], limits[4];
    double precision[UNKNOWNS], usual_scale;    /* what is known beforehand; log of the scale */
    const double *points, *forces, *trust, *plane;  /* Image: (n, 2), (n,), (n,), (n, 3) */
    const uint8_t *loaded;      /* (n,) */
    const double *drop;         /* (falls, n), or NULL */
    const float *rimmed;        /* ResponseTemplate, (size + 2, size + 2, q, 6) */
} TouchData;

typedef double Four __attribute__((vector_size(32), aligned(8), may_alias));

static inline double total(Four sum) { return (sum[0] + sum[1]) + (sum[2] + sum[3]); }
static inline double larger(double a, double b) { return a > b ? a : b; }
static inline double smaller(double a, double b) { return a < b ? a : b; }

static inline double bounded(double value, double least, double most) {
    return smaller(larger(value, least), most);
}

/* How far unknown k of a lattice lies from what is known of it beforehand. */
static inline double departure(const TouchData *s, int k, const double *pose, const double *gain) {
    return k < 3 || k > 7 ? 0.0 : k < 7 ? pose[k] : gain[0] - s->usual_scale;
}

/* Solve A x = b of k unknowns by elimination with row pivots; both are overwritten. */
static inline void solve(int k, double A[k][k], double b[k]) {
    for (int c = 0; c < k; c++) {
        int pivot = c;
        for (int i = c + 1; i < k; i++) if (fabs(A[i][c]) > fabs(A[pivot][c])) pivot = i;
        for (int j = 0; j < k && pivot != c; j++) {
            double held = A[c][j];
            A[c][j] = A[pivot][j];
            A[pivot][j] = held;
        }
        double held = b[c];
        b[c] = b[pivot];
        b[pivot] = held;
        for (int i = c + 1; i < k; i++) {
            double share = A[i][c] / A[c][c];
            for (int j = c + 1; j < k; j++) A[i][j] -= share * A[c][j];
            b[i] -= share * b[c];
        }
    }
    for (int c = k - 1; c >= 0; c--) {
        for (int j = c + 1; j < k; j++) b[c] -= A[c][j] * b[j];
        b[c] /= A[c][c];
    }
}

/* The lattice a step (11,) further. */
static inline void take_step(const TouchData *s, const double *step, const double *pose,
                             const double *gain, double *to_pose, double *to_gain) {
    for (int k = 0; k < 7; k++) to_pose[k] = pose[k] + step[k];
    for (int k = 0; k < 4; k++) {
        to_pose[3 + k] = bounded(to_pose[3 + k], -s->limits[k], s->limits[k]);
        to_gain[k] = gain[k] + step[7 + k];
    }
    to_gain[1] = bounded(to_gain[1], s->shallower * gain[1], s->deepest_gain);
    double slope = fabs(to_gain[2]) + fabs(to_gain[3]), limit = s->steepest * to_gain[1];
    double factor = slope > limit ? limit / larger(slope, 1e-300) : 1.0;
    to_gain[2] *= factor;
    to_gain[3] *= factor;
}

/* What an image is about one lattice, row by row of `wide` tactels. */
typedef struct {
    double *values;             /* (3, wide) psi and its slopes of what is shown */
    double *forces, *unit;      /* (wide,); by how much these change with psi, fully pressed */
    double *jacobian;           /* (11, wide) forces by pose and gain */
} Linearized;

/* The image about a lattice whose cells show what is given: labels (high, wide) from `corner` on. */
void linearize(const TouchData *s, const int8_t *given, const int64_t *corner, const double *pose,
               const double *gain, int64_t wide, Linearized at);

#endif
