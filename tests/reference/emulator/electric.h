/* The circuit around the processor: rows, columns, tactels, wrist. Thesis 4.2, figure 4.5.
 *
 * Rows are outputs of two shift registers, at the supply or at ground, or of a multiplexer that
 * leaves all but one open; the column that is selected goes to the load resistor and the ADC, all
 * others are open. An image of conductances makes every tactel a resistor between its row and its
 * column (`network.h`); one of millivolts is what the ADC gets of the tactel alone.
 *
 * Follows the pins and gives the ADC the voltage of the tactel that they select. After a
 * switch the voltage runs towards its new value with one time constant; the ADC takes it at the
 * moment of its sample and hold, so that an address that changes too early is seen.
 */
#ifndef ELECTRIC_H
#define ELECTRIC_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#include <simavr/sim_avr.h>

#include "images.h"

typedef struct {
    char port; /* 'A' ... */
    uint8_t bit;
} pin_t;

typedef struct {
    const char *name; /* of the board */
    const char *mcu;
    pin_t row[4];    /* grounded: data, shift clock, latch; floating: address, lowest bit first */
    pin_t column[4], sensor[3]; /* lowest bit first */
} wiring_t;

typedef struct {
    enum { GROUNDED, FLOATING, VIRTUAL } wiring; /* rows that are not read; columns held at 0 V */
    double load_ohm; /* of the column; virtual: of the amplifier's feedback */
    double tau_us;   /* after a switch */
    double noise_mv; /* deviation at the ADC */
} readout_t;

/* The wiring of a board, or 0. */
const wiring_t *electric_wiring(const char *board);

/* `trace`, if not 0, gets a line for every switch and every conversion. */
void electric_connect(avr_t *avr, const wiring_t *wiring, readout_t readout, images_t *images,
                      FILE *trace);

/* To be called before the processor is reset. */
void electric_reset(void);

#endif
