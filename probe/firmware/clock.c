#include "clock.h"

#include <avr/interrupt.h>
#include <util/atomic.h>

static volatile uint32_t overflows;

ISR(TIMER1_OVF_vect)
{
    overflows++;
}

void clock_init(void)
{
    TCCR1A = 0;
    TCCR1B = _BV(CS10);
    TIMSK1 = _BV(TOIE1);
}

/* Overflows and cycles of one instant. */
static uint32_t instant(uint16_t *cycles)
{
    uint32_t turns;

    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        *cycles = TCNT1;
        turns = overflows;
        /* an overflow that is not counted yet, unless it came after the cycles were read */
        if ((TIFR1 & _BV(TOV1)) && *cycles < 0x8000)
            turns++;
    }
    return turns;
}

uint32_t clock_us(void)
{
    uint16_t cycles;
    uint32_t turns = instant(&cycles);

    return (turns << 12) | (cycles >> 4);
}

uint32_t clock_ms(void)
{
    uint16_t cycles;
    uint32_t turns = instant(&cycles);

    /* 4.096 ms a turn, in 32 bits */
    return turns * 4 + turns / 125 * 12 + turns % 125 * 12 / 125 + cycles / 16000;
}
