#include "control.h"

#include <errno.h>
#include <poll.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "electric.h"
#include "line.h"

static char text[256];
static size_t length;
static bool too_long; /* the rest of the line is passed over */

void control_answer(const char *format, ...)
{
    va_list arguments;

    va_start(arguments, format);
    vprintf(format, arguments);
    va_end(arguments);
    putchar('\n');
    fflush(stdout);
}

/* The number after the first word, if it is one from 0 to `most`. */
static bool number(const char *line, double most, double *value)
{
    const char *start = strchr(line, ' ');
    char *end;

    if (!start)
        return false;
    *value = strtod(start, &end);
    return end != start && *end == '\0' && *value >= 0 && *value <= most;
}

static bool is(const char *line, const char *word)
{
    size_t letters = strlen(word);

    return !strncmp(line, word, letters) && (line[letters] == ' ' || line[letters] == '\0');
}

static void obey(const char *line, wishes_t *wishes)
{
    double value;

    if (is(line, "quit")) {
        wishes->quit = true;
    } else if (is(line, "statistics")) {
        wishes->statistics = true;
        return;
    } else if (is(line, "reset")) {
        wishes->reset = true;
    } else if (is(line, "unplug") && number(line, 3600, &value) && value > 0) {
        wishes->unplug_s = value;
    } else if (is(line, "flip") && number(line, 1e6, &value)) {
        line_set_flips(value);
    } else if (is(line, "drop") && number(line, 1e6, &value)) {
        line_set_drops(value);
    } else if (is(line, "garbage") && number(line, 4096, &value)) {
        line_put_garbage((unsigned)value);
    } else if (is(line, "tau") && number(line, 1e6, &value)) {
        electric_set_tau(value);
    } else if (is(line, "noise") && number(line, 5000, &value)) {
        electric_set_noise(value);
    } else {
        control_answer("error: '%s' is no command with a number in its range", line);
        return;
    }
    control_answer("ok");
}

static void split(wishes_t *wishes)
{
    char *end;

    while ((end = memchr(text, '\n', length))) {
        size_t used = (size_t)(end - text) + 1;

        *end = '\0';
        if (too_long)
            control_answer("error: a line of more than %zu characters", sizeof text - 1);
        else
            obey(text, wishes);
        too_long = false;
        length -= used;
        memmove(text, text + used, length);
    }
    if (length == sizeof text) {
        too_long = true;
        length = 0;
    }
}

void control_read(wishes_t *wishes)
{
    struct pollfd state = {.fd = STDIN_FILENO, .events = POLLIN};

    while (!wishes->quit && poll(&state, 1, 0) > 0) {
        ssize_t got = read(STDIN_FILENO, text + length, sizeof text - length);

        if (got > 0) {
            length += (size_t)got;
            split(wishes);
        } else if (got == 0 || errno != EINTR) {
            wishes->quit = true;
        }
    }
}
