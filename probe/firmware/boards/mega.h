/* Arduino Mega 2560.
 *
 *   rows, grounded          PA0 SER, PA1 SRCLK, PA2 RCLK   D22 D23 D24
 *   rows, floating S0..S3   PA0 PA1 PA2 PA3   D22 D23 D24 D25
 *   column address S0..S3   PA4 PA5 PA6 PA7   D26 D27 D28 D29
 *   sensor select A0..A2    PC0 PC1 PC2       D37 D36 D35
 *   tactel, wrist 1..4      ADC0, ADC1..ADC4  A0, A1..A4
 *   serial line             PE0 RXD0, PE1 TXD0   D0, D1
 */
#ifndef BOARD_H
#define BOARD_H

#include <avr/io.h>
#include <stdint.h>

#define BOARD_NAME "FSR-mega" /* 8 characters */

#define LINE_DATA UDR0
#define LINE_STATUS UCSR0A
#define LINE_CONTROL UCSR0B
#define LINE_FORMAT UCSR0C
#define LINE_RATE_HIGH UBRR0H
#define LINE_RATE_LOW UBRR0L
#define LINE_received_vect USART0_RX_vect
#define LINE_empty_vect USART0_UDRE_vect

static inline void board_init(void)
{
    DDRA = 0xFF;
    DDRC |= 0x07;
    DIDR0 = 0x1F; /* no digital inputs on the analog pins */
}

static inline void board_shift_rows(uint8_t first)
{
    if (first)
        PORTA |= 1;
    else
        PORTA &= (uint8_t)~1;
    PORTA |= 2;
    PORTA &= (uint8_t)~2;
    PORTA |= 4;
    PORTA &= (uint8_t)~4;
}

static inline void board_select_row(uint8_t row)
{
    PORTA = (uint8_t)((PORTA & 0xF0) | row);
}

static inline void board_select_column(uint8_t column)
{
    PORTA = (uint8_t)((PORTA & 0x0F) | (column << 4));
}

static inline void board_select_sensor(uint8_t sensor)
{
    PORTC = (uint8_t)((PORTC & 0xF8) | sensor);
}

#endif
