/* Arduino Uno or Nano, or a bare ATmega328P with a 16 MHz crystal.
 *
 *   rows, grounded          PB0 SER, PB1 SRCLK, PB2 RCLK   D8 D9 D10
 *   rows, floating S0..S3   PB0 PB1 PB2 PB3   D8 D9 D10 D11
 *   column address S0..S3   PD4 PD5 PD6 PD7   D4 D5 D6 D7
 *   sensor select A0..A2    PD2 PD3 PB4       D2 D3 D12
 *   tactel, wrist 1..4      ADC0, ADC1..ADC4  A0, A1..A4
 *   serial line             PD0 RXD, PD1 TXD  D0, D1
 */
#ifndef BOARD_H
#define BOARD_H

#include <avr/io.h>
#include <stdint.h>

#define BOARD_NAME "FSR-uno " /* 8 characters */

#define LINE_DATA UDR0
#define LINE_STATUS UCSR0A
#define LINE_CONTROL UCSR0B
#define LINE_FORMAT UCSR0C
#define LINE_RATE_HIGH UBRR0H
#define LINE_RATE_LOW UBRR0L
#define LINE_received_vect USART_RX_vect
#define LINE_empty_vect USART_UDRE_vect

static inline void board_init(void)
{
    DDRB |= 0x1F;
    DDRD |= 0xFC;
    DIDR0 = 0x1F; /* no digital inputs on the analog pins */
}

static inline void board_shift_rows(uint8_t first)
{
    if (first)
        PORTB |= 1;
    else
        PORTB &= (uint8_t)~1;
    PORTB |= 2;
    PORTB &= (uint8_t)~2;
    PORTB |= 4;
    PORTB &= (uint8_t)~4;
}

static inline void board_select_row(uint8_t row)
{
    PORTB = (uint8_t)((PORTB & 0xF0) | row);
}

static inline void board_select_column(uint8_t column)
{
    PORTD = (uint8_t)((PORTD & 0x0F) | (column << 4));
}

static inline void board_select_sensor(uint8_t sensor)
{
    PORTD = (uint8_t)((PORTD & 0xF3) | ((sensor & 3) << 2));
    PORTB = (uint8_t)((PORTB & 0xEF) | ((sensor & 4) << 2));
}

#endif
