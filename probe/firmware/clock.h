/* Time from timer 1, which counts processor cycles and overflows every 4096 us. */
#ifndef CLOCK_H
#define CLOCK_H

#include <avr/io.h>
#include <stdint.h>

void clock_init(void);

/* Microseconds since the start; wraps after 71 minutes. */
uint32_t clock_us(void);

/* Milliseconds since the start; wraps after 49 days. */
uint32_t clock_ms(void);

/* Cycles, modulo 65536. */
static inline uint16_t clock_cycles(void)
{
    return TCNT1;
}

/* Wait until `cycles` have passed since `start`; at most 4 ms. */
static inline void clock_wait(uint16_t start, uint16_t cycles)
{
    while ((uint16_t)(clock_cycles() - start) < cycles) {
    }
}

#endif
