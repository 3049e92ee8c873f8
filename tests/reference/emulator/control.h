/* Commands to the host, a line each on its standard input; every line gets one line of answer.
 *
 *   flip N         damage one bit in N of a million bytes
 *   drop N         lose N of a million bytes
 *   garbage N      put N random bytes into the line, at once (at most 4096)
 *   unplug S       take the port and the power away, give both back after S seconds
 *   reset          reset the processor
 *
 * The end of the input ends the host.
 */
#ifndef CONTROL_H
#define CONTROL_H

#include <stdbool.h>

typedef struct {
    bool quit;
    bool reset;
    double unplug_s; /* > 0: unplug for so long */
} wishes_t;

/* Read what has come, obey or note it in `wishes`; returns at once. */
void control_read(wishes_t *wishes);

/* Answer with a line. */
void control_answer(const char *said);

#endif
