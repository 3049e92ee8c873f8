/* What a matrix of resistors gives the ADC: shares of the supply. Thesis 4.2, figure 4.5.
 *
 * Tactels (256, row by row) are conductances in S between rows and columns; one column is loaded to
 * ground, all others are open.
 */
#ifndef NETWORK_H
#define NETWORK_H

#include <stdint.h>

typedef struct {
    uint32_t number, sensor; /* of the image that is solved */
    double load_s;
    float share[256];
} network_t;

/* Rows at the supply by bits, all others at ground: columns do not know of each other. */
double network_grounded(const float *tactels, uint16_t rows, unsigned column, double load_s);

/* The same with the column held at 0 V by an amplifier: its output, which ends at the supply. */
double network_virtual(const float *tactels, uint16_t rows, unsigned column, double feedback_s);

/* One row at the supply, all others open; 0 with none or several. Solved once for an image. */
double network_floating(network_t *network, const float *tactels, uint32_t number,
                        unsigned sensor, uint16_t rows, unsigned column, double load_s);

#endif
