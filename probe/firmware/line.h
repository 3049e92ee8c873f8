/* The serial line: two packets out, commands in.
 *
 * While one packet is sent by interrupt, the next is written into the other buffer.
 */
#ifndef LINE_H
#define LINE_H

#include <stdint.h>

void line_init(void);

/* The buffer for the next packet (PACKET_WIRE bytes), or 0 while both are waiting to be sent. */
uint8_t *line_free(void);

/* Send the packet that was written into that buffer; it ends with its zero byte. */
void line_send(void);

/* Begin the packet that waits, if the line is free. To be called while there is nothing to do. */
void line_continue(void);

/* The next command, or -1. */
int16_t line_command(void);

/* Bytes that came damaged or were lost. */
uint16_t line_errors(void);

#endif
