/* Firmware of the probe: obeys one-byte commands, scans and sends. Thesis 4.2, appendix 4. */

#include <avr/eeprom.h>
#include <avr/interrupt.h>

#include "clock.h"
#include "config.h"
#include "line.h"
#include "packet.h"
#include "scan.h"

static uint16_t EEMEM stored_boots;

static uint16_t boots;
static uint8_t streaming, wanted; /* frames without end; one frame */
static uint8_t sensor, bits = 10;
static uint16_t number; /* of the next frame */
static uint32_t frames; /* sent */
static uint32_t waits;  /* scans that waited for the line */
static uint16_t unknown; /* commands */

static uint8_t *await_line(void)
{
    uint8_t *wire;

    while (!(wire = line_free())) {
    }
    return wire;
}

static void send(uint8_t type, const void *body, uint8_t length)
{
    packet_t packet;

    packet_begin(&packet, await_line(), type, number, clock_us());
    for (const uint8_t *byte = body; length--; byte++)
        packet_u8(&packet, *byte);
    packet_end(&packet);
    line_send();
}

static void send_ident(void)
{
    struct {
        uint8_t rows, columns, bits, sensors, sensor, major, minor, settle;
        uint16_t kbaud, boots;
        char name[8];
    } ident = {ROWS, COLUMNS, bits, SENSORS, sensor, FIRMWARE_MAJOR, FIRMWARE_MINOR, SETTLE,
               BAUD / 1000, boots, BOARD_NAME};

    send('I', &ident, sizeof ident);
}

static void send_statistics(void)
{
    struct __attribute__((packed)) {
        uint32_t frames, waits;
        uint16_t errors;
        uint32_t ms;
    } statistics = {frames, waits, line_errors() + unknown, clock_ms()};

    send('S', &statistics, sizeof statistics);
}

static void send_frame(void)
{
    if (!line_free())
        waits++;
    scan(await_line(), bits, number);
    line_send();
    number++;
    frames++;
}

static void obey(uint8_t command)
{
    switch (command) {
    case 's': streaming = 1; break;
    case 'x': streaming = 0; break;
    case 'g': wanted = 1; break;
    case 'i': send_ident(); break;
    case 't': send_statistics(); break;
    case 'a': bits = 10; break;
    case 'b': bits = 8; break;
    default:
        if (command >= '0' && command < '0' + SENSORS) {
            sensor = command - '0';
            scan_select(sensor);
        } else {
            unknown++;
        }
    }
}

int main(void)
{
    board_init();
    clock_init();
    line_init();
    scan_init();
    boots = eeprom_read_word(&stored_boots) + 1;
    eeprom_update_word(&stored_boots, boots);
    sei();
    send_ident();
    for (;;) {
        int16_t command = line_command();

        if (command >= 0)
            obey((uint8_t)command);
        else if (streaming || wanted) {
            wanted = 0;
            send_frame();
        } else
            line_continue();
    }
}
