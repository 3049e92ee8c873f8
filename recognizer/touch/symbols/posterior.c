/* Where a lattice of known symbols lies: the steps of `posterior.fit_posterior`, each with the rounds
   of `spread.fit_spread`; these are the reference. Rows of tactels are filled up with zeros to whole
   eights: what is filled up weighs nothing. */

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "touch_data.h"

enum { OFFSET = UNKNOWNS, UP, ALONG, ALL }; /* unknowns of a sensor after those of a lattice */

typedef struct {
    int64_t rows, columns;      /* of the sensor */
    int64_t steps, rounds;
    double freedom, touches, unseen;    /* SpreadSettings */
    double usual[2];            /* variances of a covered tactel and of a tip's place */
    double least[ALL], most[ALL], known[ALL]; /* added to the diagonal, largest step, precision */
    const double *aside;        /* (n,) of Image */
} Steps;

/* An image about one lattice. */
typedef struct {
    double pose[7], gain[4], more[3]; /* `more`: offset, blur across rows and across columns */
    double away[ALL];           /* how far each unknown lies from what is known beforehand */
    double *left, *parts, *jacobian;    /* (wide,); (2, wide) of the spread; (14, wide) */
} Image;

/* Those of one image, across rows and across columns; beyond the rim nothing is felt. */
static void second_differences(int64_t rows, int64_t columns, const double *image, double *up,
                               double *along) {
    for (int64_t r = 0, t = 0; r < rows; r++)
        for (int64_t c = 0; c < columns; c++, t++) {
            up[t] = along[t] = -2.0 * image[t];
            if (r) up[t] += image[t - columns];
            if (r + 1 < rows) up[t] += image[t + columns];
            if (c) along[t] += image[t - 1];
            if (c + 1 < columns) along[t] += image[t + 1];
        }
}

/* See the image about the lattice at which it stands; scratch: (7, wide). */
static void look(const TouchData *s, const Steps *how, const int8_t *given, const int64_t *corner,
                 int64_t wide, double *scratch, Image *at) {
    double *values = scratch, *forces = scratch + 3 * wide, *unit = forces + wide;
    double *up = unit + wide, *along = up + wide, *jacobian = at->jacobian, *more = at->more;
    const double quiet = s->quiet * s->quiet;
    Linearized seen = {values, forces, unit, jacobian};
    linearize(s, given, corner, at->pose, at->gain, wide, seen);
    for (int k = 0; k < UNKNOWNS && (more[1] != 0.0 || more[2] != 0.0); k++) {
        double *row = jacobian + k * wide;
        second_differences(how->rows, how->columns, row, up, along);
        for (int64_t t = 0; t < s->n; t++) row[t] += more[1] * up[t] + more[2] * along[t];
    }
    second_differences(how->rows, how->columns, forces, jacobian + UP * wide,
                       jacobian + ALONG * wide);
    for (int64_t t = 0; t < s->n; t++) {
        double v = values[t], x = values[wide + t], y = values[2 * wide + t];
        double square = unit[t] * unit[t], blurred = more[1] * jacobian[UP * wide + t];
        blurred += more[2] * jacobian[ALONG * wide + t];
        jacobian[OFFSET * wide + t] = 1.0;
        at->parts[t] = (quiet + v * v) * square;
        at->parts[wide + t] = how->aside[t] * (x * x + y * y) * square;
        at->left[t] = s->forces[t] - forces[t] - (more[0] + blurred);
    }
    for (int k = 0; k < UNKNOWNS; k++) at->away[k] = departure(s, k, at->pose, at->gain);
    memcpy(at->away + OFFSET, more, sizeof at->more);
}

/* L of A = U^-1 L L' U^-1, U one over the roots of A's diagonal. Returns whether no eigenvalue of
   L L' lies below `unseen`: one over the trace of its inverse bounds them. */
static int factor(double A[ALL][ALL], double unseen, double L[ALL][ALL], double U[ALL]) {
    double trace = 0.0;
    for (int i = 0; i < ALL; i++) {
        if (!(A[i][i] > 1e-12)) return 0;
        U[i] = 1.0 / sqrt(A[i][i]);
    }
    for (int i = 0; i < ALL; i++) {
        for (int j = 0; j <= i; j++) {
            double sum = A[i][j] * (U[i] * U[j]);
            for (int m = 0; m < j; m++) sum -= L[i][m] * L[j][m];
            if (j < i) L[i][j] = sum / L[j][j];
            else if (sum > 0.0) L[i][i] = sqrt(sum);
            else return 0;
        }
    }
    for (int column = 0; column < ALL; column++) {
        double x[ALL];
        for (int i = column; i < ALL; i++) {
            double sum = i == column ? 1.0 : 0.0;
            for (int m = column; m < i; m++) sum -= L[i][m] * x[m];
            x[i] = sum / L[i][i];
            trace += x[i] * x[i];
        }
    }
    return 1.0 / trace > unseen;
}

/* One over the variance of each tactel (wide,), less for what lies far out. */
static void weigh(const TouchData *s, const Steps *how, int64_t wide, const Image *at,
                  const double *now, double *variance, double *weights) {
    for (int64_t t = 0; t < s->n; t++) {
        double left = at->left[t];
        variance[t] = now[0] * at->parts[t] + now[1] * at->parts[wide + t];
        weights[t] = s->trust[t] * (how->freedom + 1) / (how->freedom * variance[t] + left * left);
    }
}

/* A = known + J' W J, its lower half alone, and J W (14, wide) on the way. */
static void add_squares(int64_t wide, const double *jacobian, const double *weights,
                        const double *known, double *weighed, double A[ALL][ALL]) {
    for (int i = 0; i < ALL; i++) {
        const double *row = jacobian + i * wide;
        double *one = weighed + i * wide;
        for (int64_t t = 0; t < wide; t++) one[t] = row[t] * weights[t];
        for (int j = 0; j <= i; j += 3) { /* three dot products at once, the last ones twice */
            int other = j + 1 < i ? j + 1 : i, last = j + 2 < i ? j + 2 : i;
            const double *a = jacobian + j * wide, *b = jacobian + other * wide;
            const double *c = jacobian + last * wide;
            Four sums[3] = {{0}, {0}, {0}};
            for (int64_t t = 0; t < wide; t += 4) {
                Four at = *(const Four *)(one + t);
                sums[0] += at * *(const Four *)(a + t);
                sums[1] += at * *(const Four *)(b + t);
                sums[2] += at * *(const Four *)(c + t);
            }
            A[i][j] = total(sums[0]);
            A[i][other] = total(sums[1]);
            A[i][last] = total(sums[2]);
        }
        A[i][i] += known[i];
    }
}

/* taken (wide,): the diagonal of J A^-1 J', A as `factor` leaves it. */
static void leverages(int64_t wide, const double *jacobian, double L[ALL][ALL],
                      const double U[ALL], double *taken) {
    double inverse[ALL];
    for (int i = 0; i < ALL; i++) inverse[i] = 1.0 / L[i][i];
    for (int64_t t = 0; t < wide; t += 8) { /* eight tactels side by side */
        Four x[ALL], y[ALL], whole = {0}, other = {0};
        for (int i = 0; i < ALL; i++) {
            Four sum = *(const Four *)(jacobian + i * wide + t) * U[i];
            Four more = *(const Four *)(jacobian + i * wide + t + 4) * U[i];
            for (int m = 0; m < i; m++) {
                sum -= L[i][m] * x[m];
                more -= L[i][m] * y[m];
            }
            x[i] = sum * inverse[i];
            y[i] = more * inverse[i];
            whole += x[i] * x[i];
            other += y[i] * y[i];
        }
        *(Four *)(taken + t) = whole;
        *(Four *)(taken + t + 4) = other;
    }
}

/* Fit the variances `now` (2,); scratch: (17, wide). Returns 0 where a normal matrix shows too little
   to be inverted so. */
static int fit_spread(const TouchData *s, const Steps *how, int64_t wide, const Image *at,
                      double *scratch, double *now) {
    double *weights = scratch, *variance = scratch + wide, *taken = variance + wide;
    for (int64_t round = 0; round < how->rounds; round++) {
        double A[ALL][ALL], L[ALL][ALL], U[ALL], asked[2] = {0}, shares[2] = {0};
        weigh(s, how, wide, at, now, variance, weights);
        add_squares(wide, at->jacobian, weights, how->known, taken + wide, A);
        if (!factor(A, how->unseen, L, U)) return 0;
        leverages(wide, at->jacobian, L, U, taken);
        for (int64_t t = 0; t < s->n; t++) {
            double told = weights[t] * (at->left[t] * at->left[t] + taken[t]);
            for (int part = 0; part < 2; part++) {
                double share = s->trust[t] * now[part] * at->parts[part * wide + t] / variance[t];
                asked[part] += share * told;
                shares[part] += share;
            }
        }
        for (int part = 0; part < 2; part++) {
            double whole = asked[part] + how->touches * how->usual[part] / now[part];
            now[part] *= sqrt(whole / (shares[part] + how->touches));
        }
    }
    return 1;
}

/* Log-likelihood of what is left over and of the unknowns, nats, up to a constant. */
static double likelihood(const TouchData *s, const Steps *how, int64_t wide, const Image *at,
                         const double *now) {
    double loss = 0.0;
    for (int64_t t = 0; t < s->n; t++) {
        double variance = now[0] * at->parts[t] + now[1] * at->parts[wide + t];
        double share = at->left[t] * at->left[t] / (how->freedom * variance);
        loss += s->trust[t] * ((how->freedom + 1) * log1p(share) + log(variance));
    }
    for (int k = 0; k < ALL; k++) loss += at->away[k] * at->away[k] * how->known[k];
    return -0.5 * loss;
}

/* The lattice a damped step further, not yet looked at. */
static void move(const TouchData *s, const Steps *how, int64_t wide, const Image *at,
                 const double *weighed, double A[ALL][ALL], double damping, Image *to) {
    double step[ALL];
    for (int k = 0; k < ALL; k++) {
        const double *row = weighed + k * wide;
        Four sum = {0};
        for (int64_t t = 0; t < wide; t += 4)
            sum += *(const Four *)(row + t) * *(const Four *)(at->left + t);
        step[k] = total(sum) - how->known[k] * at->away[k];
        for (int m = 0; m < k; m++) A[m][k] = A[k][m];
        A[k][k] += A[k][k] * damping + how->least[k];
    }
    solve(ALL, A, step);
    for (int k = 0; k < ALL; k++) step[k] = bounded(step[k], -how->most[k], how->most[k]);
    take_step(s, step, at->pose, at->gain, to->pose, to->gain);
    for (int k = 0; k < 3; k++) to->more[k] = at->more[k] + step[OFFSET + k];
}

/* Fit a lattice that shows labels (high, wide) from `corner` on. pose (7,), gain (4,): where it
   begins and ends; in the end more (3,), variances now (2,), and the normal matrix (14, 14). Returns
   0, with nothing told, where the image shows too little. */
int fit_posterior(const TouchData *s, const Steps *how, const int8_t *given, const int64_t *corner,
                  double *pose, double *gain, double *more, double *now, double *normal) {
    const int64_t wide = (s->n + 7) / 8 * 8, each = (1 + 2 + ALL) * wide;
    double *scratch = calloc((3 + ALL) * wide + 2 * each, sizeof(double));
    double *weights = scratch, *weighed = scratch + 3 * wide;
    double damping = s->damping, A[ALL][ALL];
    Image images[2] = {{{0}}}, *at = images, *tried = images + 1;
    for (int k = 0; k < 2; k++) {
        images[k].left = scratch + (3 + ALL) * wide + k * each;
        images[k].parts = images[k].left + wide;
        images[k].jacobian = images[k].parts + 2 * wide;
    }
    memcpy(at->pose, pose, sizeof at->pose);
    memcpy(at->gain, gain, sizeof at->gain);
    memcpy(now, how->usual, sizeof how->usual);
    look(s, how, given, corner, wide, weighed, at);
    int64_t step = 0;
    int seen;
    while ((seen = fit_spread(s, how, wide, at, scratch, now))) {
        weigh(s, how, wide, at, now, scratch + wide, weights);
        add_squares(wide, at->jacobian, weights, how->known, weighed, A);
        if (step++ == how->steps) break;
        move(s, how, wide, at, weighed, A, damping, tried);
        look(s, how, given, corner, wide, weighed, tried);
        if (likelihood(s, how, wide, tried, now) > likelihood(s, how, wide, at, now)) {
            Image *held = at;
            at = tried;
            tried = held;
            damping /= s->easier;
        } else {
            damping *= s->harder;
        }
    }
    if (seen) {
        memcpy(pose, at->pose, sizeof at->pose);
        memcpy(gain, at->gain, sizeof at->gain);
        memcpy(more, at->more, sizeof at->more);
        for (int i = 0; i < ALL; i++)
            for (int j = 0; j < ALL; j++) normal[i * ALL + j] = A[i > j ? i : j][i > j ? j : i];
    }
    free(scratch);
    return seen;
}
