/* One image: 256 tactels row by row, then the wrist, into a packet. Thesis 4.2, figure 4.5.
 *
 * A conversion takes 13 ADC clocks, but its voltage is held after the first 2.5 of them. The
 * multiplexers are switched at that moment, so that the next tactel settles while this one is
 * converted, and its predecessor is encoded meanwhile.
 */
#ifndef SCAN_H
#define SCAN_H

#include <stdint.h>

void scan_init(void);

/* Select one of the eight sensors, 0 ... 7. */
void scan_select(uint8_t sensor);

/* Scan into `wire` (PACKET_WIRE bytes) as an 'F' packet (bits = 10) or a 'B' packet (8). */
void scan(uint8_t *wire, uint8_t bits, uint16_t number);

#endif
