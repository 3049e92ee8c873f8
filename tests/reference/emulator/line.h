/* The serial line as a USB-serial adapter shows it: a pseudo-terminal under a stable name.
 *
 * Bytes that nobody listens to are lost; bytes for a listener who is too slow wait in the
 * memory of the adapter and its driver until that is full, then they are lost too. The
 * processor never waits.
 */
#ifndef LINE_H
#define LINE_H

#include <stdbool.h>
#include <stdint.h>

#include <simavr/sim_avr.h>

void line_connect(avr_t *avr, const char *link);

/* Make the pseudo-terminal and its link; 0, or the number of an error. */
int line_plug(void);

/* Take both away; whoever has the port open reads its end. */
void line_unplug(void);

/* To be called after the processor was reset. */
void line_reset(void);

/* Carry bytes both ways; to be called every millisecond of the processor's time. */
void line_carry(void);

void line_set_flips(double per_million);
void line_set_drops(double per_million);
void line_put_garbage(uint32_t bytes);

#endif
