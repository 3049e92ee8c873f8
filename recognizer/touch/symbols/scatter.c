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

/* usual, now: (2,) variances of a covered tactel and of a tip's place, the latter to begin with and
   in the end. left, trust (n,); parts (2, n); jacobian (n, k); known (k, k). Returns 0 where a
   normal matrix shows too little to be inverted so. */
int fit_spread(int64_t n, int64_t k, int64_t rounds, double freedom, double touches, double unseen,
               const double *usual, const double *left, const double *parts,
               const double *jacobian, const double *known, const double *trust, double *now) {
    double *weights = malloc(2 * n * sizeof(double)), *variance = weights + n;
    int seen = k <= MOST;
    for (int64_t round = 0; round < rounds && seen; round++) {
        double A[MOST][MOST], L[MOST][MOST], U[MOST], asked[2] = {0}, shares[2] = {0};
        for (int64_t i = 0; i < k; i++)
            for (int64_t j = 0; j < k; j++) A[i][j] = 0.0;
        for (int64_t t = 0; t < n; t++) {
            const double *row = jacobian + k * t;
            variance[t] = now[0] * parts[t] + now[1] * parts[n + t];
            weights[t] = trust[t] * (freedom + 1) / (freedom * variance[t] + left[t] * left[t]);
            for (int64_t i = 0; i < k; i++) {
                double weighed = row[i] * weights[t];
                for (int64_t j = 0; j <= i; j++) A[i][j] += weighed * row[j];
            }
        }
        for (int64_t i = 0; i < k; i++)
            for (int64_t j = 0; j <= i; j++) A[i][j] += known[i * k + j];
        seen = factor(k, A, unseen, L, U);
        for (int64_t t = 0; t < n && seen; t++) {
            const double *row = jacobian + k * t;
            double x[MOST], taken = 0.0;
            for (int64_t i = 0; i < k; i++) {
                double sum = row[i] * U[i];
                for (int64_t m = 0; m < i; m++) sum -= L[i][m] * x[m];
                x[i] = sum / L[i][i];
                taken += x[i] * x[i];
            }
            double told = weights[t] * (left[t] * left[t] + taken);
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
