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

typedef struct {
    uint64_t sent;      /* bytes that the processor sent */
    uint64_t delivered; /* of them, to a listener (damaged ones too) */
    uint64_t unheard;   /* lost: nobody had the port open */
    uint64_t overrun;   /* lost: the listener was too slow */
    uint64_t dropped;   /* lost: by fault */
    uint64_t flipped;   /* damaged: by fault */
    uint64_t garbage;   /* bytes put in between */
    uint64_t garbled;   /* damaged: the listener has set another speed */
    uint64_t received;  /* bytes from the listener */
} line_counts_t;

extern line_counts_t line_counts;

void line_connect(avr_t *avr, const char *link, uint64_t seed);

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
