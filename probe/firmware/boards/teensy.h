/* Teensy++ 2.0 (AT90USB1286 at 16 MHz and 5 V).
 *
 *   rows, grounded          PC0 SER, PC1 SRCLK, PC2 RCLK
 *   rows, floating S0..S3   PC0 PC1 PC2 PC3
 *   column address S0..S3   PC4 PC5 PC6 PC7
 *   sensor select A0..A2    PB4 PB5 PB6
 *   tactel, wrist 1..4      PF0, PF1..PF4 (ADC0, ADC1..ADC4)
 *   serial line             PD2 RXD1, PD3 TXD1, to a USB-serial adapter
 */
#ifndef BOARD_H
#define BOARD_H

#include <avr/io.h>
#include <stdint.h>

#define BOARD_NAME "FSR-teen" /* 8 characters */

#define LINE_DATA UDR1
#define LINE_STATUS UCSR1A
#define LINE_CONTROL UCSR1B
#define LINE_FORMAT UCSR1C
#define LINE_RATE_HIGH UBRR1H
#define LINE_RATE_LOW UBRR1L
/* the bits have the places that line.c knows by the names of the first line */
#define U2X0 U2X1
#define FE0 FE1
#define DOR0 DOR1
#define UCSZ00 UCSZ10
#define UCSZ01 UCSZ11
#define RXCIE0 RXCIE1
#define UDRIE0 UDRIE1
#define RXEN0 RXEN1
#define TXEN0 TXEN1
#define LINE_received_vect USART1_RX_vect
#define LINE_empty_vect USART1_UDRE_vect

static inline void board_init(void)
{
    CLKPR = _BV(CLKPCE); /* the fuses start it at 2 MHz: take the crystal undivided */
    CLKPR = 0;
    DDRC = 0xFF;
    DDRB |= 0x70;
    DIDR0 = 0x1F; /* no digital inputs on the analog pins */
}

static inline void board_shift_rows(uint8_t first)
{
    if (first)
        PORTC |= 1;
    else
        PORTC &= (uint8_t)~1;
    PORTC |= 2;
    PORTC &= (uint8_t)~2;
    PORTC |= 4;
    PORTC &= (uint8_t)~4;
}

static inline void board_select_row(uint8_t row)
{
    PORTC = (uint8_t)((PORTC & 0xF0) | row);
}

static inline void board_select_column(uint8_t column)
{
    PORTC = (uint8_t)((PORTC & 0x0F) | (column << 4));
}

static inline void board_select_sensor(uint8_t sensor)
{
    PORTB = (uint8_t)((PORTB & 0x8F) | (sensor << 4));
}

#endif
