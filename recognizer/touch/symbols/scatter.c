/* How far readings scatter about a model: rounds of `spread.fit_spread`, which is the reference. */

#include <math.h>
#include <stdint.h>
#include <stdlib.h>

enum { MOST = 16 }; /* unknowns */

/* L (k, k) of A = U^-1 L L' U^-1, U (k,) one over the roots of A's diagonal. Returns whether no
   eigenvalue of L L' lies below `unseen`: one over the trace of its inverse bounds them. */
static int factor(int64_t k, double A[MOST][MOST], double unseen, double L[MOST][MOST],
                  double U[MOST]) {
    double trace = 0.0;
    for (int64_t i = 0; i < k; i++) {
        if (!(A[i][i] > 1e-12)) return 0;
        U[i] = 1.0 / sqrt(A[i][i]);
    }
    for (int64_t i = 0; i < k; i++) {
        for (int64_t j = 0; j <= i; j++) {
            double sum = A[i][j] * (U[i] * U[j]);
            for (int64_t m = 0; m < j; m++) sum -= L[i][m] * L[j][m];
            if (j < i) L[i][j] = sum / L[j][j];
            else if (sum > 0.0) L[i][i] = sqrt(sum);
            else return 0;
        }
    }
    for (int64_t column = 0; column < k; column++) {
        double x[MOST];
        for (int64_t i = column; i < k; i++) {
            double sum = i == column ? 1.0 : 0.0;
            for (int64_t m = column; m < i; m++) sum -= L[i][m] * x[m];
            x[i] = sum / L[i][i];
            trace += x[i] * x[i];
        }
    }
    return 1.0 / trace > unseen;
}

typedef double Four __attribute__((vector_size(32), aligned(8), may_alias));

static inline double total(Four sum) { return (sum[0] + sum[1]) + (sum[2] + sum[3]); }

/* A (k, k) = known + J' W J of a jacobian (k, wide) by columns, its lower half alone. */
static void weigh(int64_t k, int64_t wide, const double *jacobian, const double *weights,
                  const double *known, double *weighed, double A[MOST][MOST]) {
    for (int64_t i = 0; i < k; i++) {
        const double *row = jacobian + i * wide;
        for (int64_t t = 0; t < wide; t++) weighed[t] = row[t] * weights[t];
        for (int64_t j = 0; j <= i; j += 3) { /* three dot products at once, the last ones twice */
            int64_t other = j + 1 < i ? j + 1 : i, last = j + 2 < i ? j + 2 : i;
            const double *a = jacobian + j * wide, *b = jacobian + other * wide;
            const double *c = jacobian + last * wide;
            Four sums[3] = {{0}, {0}, {0}};
            for (int64_t t = 0; t < wide; t += 4) {
                Four at = *(const Four *)(weighed + t);
                sums[0] += at * *(const Four *)(a + t);
                sums[1] += at * *(const Four *)(b + t);
                sums[2] += at * *(const Four *)(c + t);
            }
            A[i][j] = known[i * k + j] + total(sums[0]);
            A[i][other] = known[i * k + other] + total(sums[1]);
            A[i][last] = known[i * k + last] + total(sums[2]);
        }
    }
}

/* taken (wide,): the diagonal of J A^-1 J', A as `factor` leaves it. */
static void leverages(int64_t k, int64_t wide, const double *jacobian, double L[MOST][MOST],
                      const double U[MOST], double *taken) {
    double inverse[MOST];
    for (int64_t i = 0; i < k; i++) inverse[i] = 1.0 / L[i][i];
    for (int64_t t = 0; t < wide; t += 8) { /* eight tactels side by side */
        Four x[MOST], y[MOST], whole = {0}, other = {0};
        for (int64_t i = 0; i < k; i++) {
            Four sum = *(const Four *)(jacobian + i * wide + t) * U[i];
            Four more = *(const Four *)(jacobian + i * wide + t + 4) * U[i];
            for (int64_t m = 0; m < i; m++) {
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

/* usual, now: (2,) variances of a covered tactel and of a tip's place, the latter to begin with and
   in the end. left, trust (n,); parts (2, n); jacobian (n, k); known (k, k). Returns 0 where a
   normal matrix shows too little to be inverted so. */
int fit_spread(int64_t n, int64_t k, int64_t rounds, double freedom, double touches, double unseen,
               const double *usual, const double *left, const double *parts,
               const double *jacobian, const double *known, const double *trust, double *now) {
    int64_t wide = (n + 7) / 8 * 8; /* what is filled up weighs nothing */
    double *weights = calloc((k + 4) * wide, sizeof(double)), *variance = weights + wide;
    double *weighed = variance + wide, *taken = weighed + wide, *columns = taken + wide;
    int seen = k <= MOST;
    for (int64_t t = 0; t < n; t++)
        for (int64_t i = 0; i < k; i++) columns[i * wide + t] = jacobian[t * k + i];
    for (int64_t round = 0; round < rounds && seen; round++) {
        double A[MOST][MOST], L[MOST][MOST], U[MOST], asked[2] = {0}, shares[2] = {0};
        for (int64_t t = 0; t < n; t++) {
            variance[t] = now[0] * parts[t] + now[1] * parts[n + t];
            weights[t] = trust[t] * (freedom + 1) / (freedom * variance[t] + left[t] * left[t]);
        }
        weigh(k, wide, columns, weights, known, weighed, A);
        seen = factor(k, A, unseen, L, U);
        if (seen) leverages(k, wide, columns, L, U, taken);
        for (int64_t t = 0; t < n && seen; t++) {
            double told = weights[t] * (left[t] * left[t] + taken[t]);
            for (int part = 0; part < 2; part++) {
                double share = trust[t] * now[part] * parts[part * n + t] / variance[t];
                asked[part] += share * told;
                shares[part] += share;
            }
        }
        for (int part = 0; part < 2 && seen; part++) {
            double whole = asked[part] + touches * usual[part] / now[part];
            now[part] *= sqrt(whole / (shares[part] + touches));
        }
    }
    free(weights);
    return seen;
}
