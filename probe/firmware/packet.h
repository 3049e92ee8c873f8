/* A packet, encoded while it is written: no second pass, no second buffer.
 *
 * Little endian: type u8, version u8, number u16, time u32 (us), body, CRC16 (CCITT: polynomial
 * 0x1021, start 0xFFFF, not reflected) over all before it. The whole is COBS-encoded on the fly:
 * the length byte of a block is filled in when the block ends. A zero byte ends the packet.
 */
#ifndef PACKET_H
#define PACKET_H

#include <stdint.h>

#include "config.h"

#define PACKET_VERSION 2
#define PACKET_BODY (2 + 2 * ROWS * COLUMNS + 2 * WRIST) /* rows, columns, readings u16 */
#define PACKET_PLAIN (8 + PACKET_BODY + 2)               /* 532 of 16x16 */
#define PACKET_WIRE (PACKET_PLAIN + 1 + PACKET_PLAIN / 254 + 1) /* 536 */

typedef struct {
    uint8_t *out;  /* where the next byte goes */
    uint8_t *code; /* where the length of the open block goes */
    uint8_t run;   /* that length so far */
    uint8_t crc_high, crc_low;
} packet_t;

static inline void packet_encode(packet_t *packet, uint8_t byte)
{
    if (byte) {
        *packet->out++ = byte;
        if (++packet->run != 255)
            return;
    }
    *packet->code = packet->run;
    packet->code = packet->out++;
    packet->run = 1;
}

static inline void packet_u8(packet_t *packet, uint8_t byte)
{
    /* eight steps of the CRC at once */
    uint8_t x = packet->crc_high ^ byte;
    x ^= (uint8_t)(x >> 4);
    packet->crc_high = (uint8_t)(packet->crc_low ^ (uint8_t)(x << 4) ^ (x >> 3));
    packet->crc_low = (uint8_t)((uint8_t)(x << 5) ^ x);
    packet_encode(packet, byte);
}

static inline void packet_u16(packet_t *packet, uint16_t word)
{
    packet_u8(packet, (uint8_t)word);
    packet_u8(packet, (uint8_t)(word >> 8));
}

static inline void packet_begin(packet_t *packet, uint8_t *wire, uint8_t type, uint16_t number,
                                uint32_t time_us)
{
    packet->code = wire;
    packet->out = wire + 1;
    packet->run = 1;
    packet->crc_high = packet->crc_low = 0xFF;
    packet_u8(packet, type);
    packet_u8(packet, PACKET_VERSION);
    packet_u16(packet, number);
    packet_u16(packet, (uint16_t)time_us);
    packet_u16(packet, (uint16_t)(time_us >> 16));
}

static inline void packet_end(packet_t *packet)
{
    uint8_t high = packet->crc_high, low = packet->crc_low;

    packet_encode(packet, low);
    packet_encode(packet, high);
    *packet->code = packet->run;
    *packet->out = 0;
}

#endif
