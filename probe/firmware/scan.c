#include "scan.h"

#include "clock.h"
#include "config.h"
#include "packet.h"

#define INLINE static inline __attribute__((always_inline))

#define TACTEL 0                      /* ADC channel of the column multiplexer */
#define WRIST_1 1                     /* and of the first wrist transducer */
#define HELD (ADC_DIVIDER * 5 / 2)    /* cycles until the voltage is surely held */
#define SETTLED ((uint16_t)SETTLE * 4) /* cycles */

static uint16_t switched; /* when the inputs were switched, cycles */
static uint8_t driven;    /* row that is at the supply */

/* Rows follow each other: a one enters the registers at row 0 and moves on a row at a time, so
 * that whatever disturbs them is gone with the next image.
 */
INLINE void select_tactel(uint8_t row, uint8_t column)
{
    board_select_column(column);
    if (row == driven)
        return;
    driven = row;
    if (GROUNDED) {
        for (uint8_t gone = ROWS; row == 0 && gone < 16; gone++)
            board_shift_rows(0); /* the last row leaves the registers */
        board_shift_rows(row == 0);
    } else
        board_select_row(row);
}

INLINE void select_channel(uint8_t channel)
{
    ADMUX = _BV(REFS0) | channel;
}

/* The tactel after one, row by row; 0 after the last. */
INLINE uint8_t next(uint8_t address)
{
    address++;
    if (COLUMNS < 16 && (address & 15) == COLUMNS)
        address += 16 - COLUMNS;
    return ROWS < 16 && address >> 4 == ROWS ? 0 : address;
}

/* Convert what is selected, select `address` and `channel` for the next conversion, and put the
 * reading before this one into the packet. `before` is 0, 8 or 10: bits of that reading.
 */
INLINE uint16_t convert(packet_t *packet, uint8_t before, uint16_t reading, uint8_t address,
                        uint8_t channel)
{
    clock_wait(switched, SETTLED);
    ADCSRA |= _BV(ADSC);
    uint16_t started = clock_cycles();
    if (before == 8)
        packet_u8(packet, (uint8_t)(reading >> 2));
    else if (before)
        packet_u8(packet, (uint8_t)reading);
    clock_wait(started, HELD);
    select_tactel(address >> 4, address & 15);
    select_channel(channel);
    switched = clock_cycles();
    if (before == 10)
        packet_u8(packet, (uint8_t)(reading >> 8));
    while (ADCSRA & _BV(ADSC)) {
    }
    return ADC;
}

void scan_init(void)
{
    ADCSRA = _BV(ADEN) | ADC_PRESCALER;
    if (GROUNDED)
        for (uint8_t row = 0; row < 16; row++)
            board_shift_rows(0); /* what they held at power on */
    driven = ROWS - 1;
    select_tactel(0, 0);
    select_channel(TACTEL);
    scan_select(0);
}

void scan_select(uint8_t sensor)
{
    board_select_sensor(sensor);
    switched = clock_cycles();
}

void scan(uint8_t *wire, uint8_t bits, uint16_t number)
{
    packet_t packet;
    uint16_t reading;
    uint8_t address = 0;

    packet_begin(&packet, wire, bits == 8 ? 'B' : 'F', number, clock_us());
    packet_u8(&packet, ROWS);
    packet_u8(&packet, COLUMNS);
    address = next(address);
    reading = convert(&packet, 0, 0, address, TACTEL);
    while ((address = next(address)))
        reading = convert(&packet, bits, reading, address, TACTEL);
    /* the last tactel; (0, 0) of the next image settles while the wrist is read */
    reading = convert(&packet, bits, reading, 0, WRIST_1);
    reading = convert(&packet, bits, reading, 0, WRIST_1 + 1);
    for (uint8_t channel = WRIST_1 + 2; channel < WRIST_1 + WRIST; channel++)
        reading = convert(&packet, 10, reading, 0, channel);
    reading = convert(&packet, 10, reading, 0, TACTEL);
    packet_u16(&packet, reading);
    packet_end(&packet);
}
