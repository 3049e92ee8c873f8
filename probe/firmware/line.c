#include "line.h"

#include <avr/interrupt.h>
#include <util/atomic.h>

#include "config.h"
#include "packet.h"

#define QUEUE 16 /* commands that can wait; a power of two */

static uint8_t wire[2][PACKET_WIRE];
static uint8_t filling;              /* the buffer of the next packet */
static uint8_t waiting;              /* the other one holds a packet that is not yet begun */
static const uint8_t *volatile next; /* the next byte to send */

static volatile uint8_t queue[QUEUE];
static volatile uint8_t head, tail;
static volatile uint16_t errors;

/* A packet holds no zero byte but its last, so the interrupt needs no counter. It is enabled
 * while a packet is being sent, and at no other time. Written by hand: it runs for every byte,
 * and the compiler's own takes half as long again.
 */
ISR(LINE_empty_vect, ISR_NAKED)
{
    __asm__ volatile("push r24\n\t"
                     "in r24, __SREG__\n\t"
                     "push r24\n\t"
                     "push r30\n\t"
                     "push r31\n\t"
                     "lds r30, %[next]\n\t"
                     "lds r31, %[next] + 1\n\t"
                     "ld r24, Z+\n\t"
                     "sts %[data], r24\n\t"
                     "sts %[next] + 1, r31\n\t"
                     "sts %[next], r30\n\t"
                     "tst r24\n\t"
                     "brne 1f\n\t"
                     "lds r24, %[control]\n\t"
                     "andi r24, %[silent]\n\t"
                     "sts %[control], r24\n"
                     "1:\n\t"
                     "pop r31\n\t"
                     "pop r30\n\t"
                     "pop r24\n\t"
                     "out __SREG__, r24\n\t"
                     "pop r24\n\t"
                     "reti"
                     :
                     : [next] "i"(&next), [data] "i"(_SFR_MEM_ADDR(LINE_DATA)),
                       [control] "i"(_SFR_MEM_ADDR(LINE_CONTROL)),
                       [silent] "i"((uint8_t)~_BV(UDRIE0)));
}

ISR(LINE_received_vect)
{
    uint8_t status = LINE_STATUS; /* before the data, which it belongs to */
    uint8_t byte = LINE_DATA;

    if (status & (_BV(FE0) | _BV(DOR0)))
        errors++;
    if (status & _BV(FE0))
        return;
    if ((uint8_t)(head - tail) == QUEUE) {
        errors++;
        return;
    }
    queue[head++ % QUEUE] = byte;
}

void line_init(void)
{
    LINE_STATUS = _BV(U2X0);
    LINE_FORMAT = _BV(UCSZ01) | _BV(UCSZ00);
    LINE_RATE_HIGH = 0;
    LINE_RATE_LOW = (uint8_t)(F_CPU / 8 / BAUD - 1);
    LINE_CONTROL = _BV(RXCIE0) | _BV(RXEN0) | _BV(TXEN0);
}

static uint8_t sending(void)
{
    return LINE_CONTROL & _BV(UDRIE0);
}

static void begin(void)
{
    next = wire[filling ^ 1];
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        LINE_CONTROL |= _BV(UDRIE0);
    }
}

/* A packet waits only if it was written faster than its predecessor was sent. Then the caller
 * has nothing to do but to ask again: the line is never idle for long.
 */
void line_continue(void)
{
    if (waiting && !sending()) {
        waiting = 0;
        begin();
    }
}

uint8_t *line_free(void)
{
    line_continue();
    return waiting ? 0 : wire[filling];
}

void line_send(void)
{
    filling ^= 1;
    if (sending())
        waiting = 1;
    else
        begin();
}

int16_t line_command(void)
{
    if (head == tail)
        return -1;
    return queue[tail++ % QUEUE];
}

uint16_t line_errors(void)
{
    uint16_t count;

    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        count = errors;
    }
    return count;
}
