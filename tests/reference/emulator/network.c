#include "network.h"

#include <math.h>

#define LINES 16
#define NODES (2 * LINES - 1) /* rows, then columns; the last column is the reference */
#define LEAK 1e-9             /* S of every tactel: a network without it falls apart */

/* Conductance of a column to the driven rows, and to all of them. */
static double driven_of(const float *tactels, uint16_t rows, unsigned column, double *all)
{
    double driven = 0;

    *all = 0;

    for (unsigned row = 0; row < LINES; row++) {
        double conductance = tactels[LINES * row + column] + LEAK;

        *all += conductance;
        if (rows >> row & 1)
            driven += conductance;
    }
    return driven;
}

double network_grounded(const float *tactels, uint16_t rows, unsigned column, double load_s)
{
    double all, driven = driven_of(tactels, rows, column, &all);

    return driven / (all + load_s);
}

double network_virtual(const float *tactels, uint16_t rows, unsigned column, double feedback_s)
{
    double all;

    return fmin(driven_of(tactels, rows, column, &all) / feedback_s, 1);
}

/* Invert a symmetric positive definite matrix in place, by sweeps. */
static void invert(double m[NODES][NODES])
{
    for (int k = 0; k < NODES; k++) {
        double pivot = 1 / m[k][k];

        m[k][k] = 1;
        for (int j = 0; j < NODES; j++)
            m[k][j] *= pivot;
        for (int i = 0; i < NODES; i++) {
            double factor = m[i][k];

            if (i == k)
                continue;
            m[i][k] = 0;
            for (int j = 0; j < NODES; j++)
                m[i][j] -= factor * m[k][j];
        }
    }
}

/* Resistances between every row and every column with all other lines open. */
static void solve(network_t *network, const float *tactels, double load_s)
{
    static double m[NODES][NODES];

    for (int i = 0; i < NODES; i++)
        for (int j = 0; j < NODES; j++)
            m[i][j] = 0;
    for (int r = 0; r < LINES; r++)
        for (int c = 0; c < LINES; c++) {
            double conductance = tactels[LINES * r + c] + LEAK;
            int at = LINES + c;

            m[r][r] += conductance;
            if (at < NODES) {
                m[at][at] += conductance;
                m[r][at] -= conductance;
                m[at][r] -= conductance;
            }
        }
    invert(m);
    for (int r = 0; r < LINES; r++)
        for (int c = 0; c < LINES; c++) {
            int at = LINES + c;
            double ohm = m[r][r] + (at < NODES ? m[at][at] - 2 * m[r][at] : 0);

            network->share[LINES * r + c] = (float)(1 / (1 + load_s * ohm));
        }
}

double network_floating(network_t *network, const float *tactels, uint32_t number,
                        unsigned sensor, uint16_t rows, unsigned column, double load_s)
{
    if (network->number != number || network->sensor != sensor || network->load_s != load_s) {
        solve(network, tactels, load_s);
        network->number = number;
        network->sensor = sensor;
        network->load_s = load_s;
    }
    for (unsigned row = 0; row < LINES; row++)
        if (rows == 1u << row)
            return network->share[LINES * row + column];
    return 0;
}
