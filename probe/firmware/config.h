/* What a build can choose (make BAUD=... SETTLE=... ADC_DIVIDER=...), checked here. */
#ifndef CONFIG_H
#define CONFIG_H

#define FIRMWARE_MAJOR 2
#define FIRMWARE_MINOR 0

#ifndef ROWS
#define ROWS 16
#endif
#ifndef COLUMNS
#define COLUMNS 16
#endif
#define WRIST 4
#define SENSORS 8

#ifndef BAUD
#define BAUD 1000000UL
#endif

/* Least time from switching a multiplexer to the conversion, in 0.25 us. */
#ifndef SETTLE
#define SETTLE 40
#endif

/* 1: rows are outputs of shift registers, all but one at ground; 0: of a multiplexer, floating. */
#ifndef GROUNDED
#define GROUNDED 1
#endif

/* ADC clock = F_CPU / ADC_DIVIDER. */
#ifndef ADC_DIVIDER
#define ADC_DIVIDER 16
#endif

#if F_CPU != 16000000UL
#error "the timing is written for F_CPU = 16000000"
#endif
#if F_CPU / 8 % BAUD
#error "BAUD is not exact at 16 MHz: take 250000, 500000, 1000000 or 2000000"
#endif
#if ROWS < 2 || ROWS > 16 || COLUMNS < 2 || COLUMNS > 16
#error "ROWS and COLUMNS are 2 ... 16: one multiplexer and two shift registers"
#endif
#if SETTLE < 0 || SETTLE > 255
#error "SETTLE counts quarters of a microsecond, 0 ... 255"
#endif

#if ADC_DIVIDER == 16
#define ADC_PRESCALER 4
#elif ADC_DIVIDER == 32
#define ADC_PRESCALER 5
#elif ADC_DIVIDER == 64
#define ADC_PRESCALER 6
#elif ADC_DIVIDER == 128
#define ADC_PRESCALER 7
#else
#error "ADC_DIVIDER is 16, 32, 64 or 128"
#endif

#endif
