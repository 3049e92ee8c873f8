#include "control.h"

#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "line.h"

void control_answer(const char *said)
{
    puts(said);
    fflush(stdout);
}

static void obey(const char *line, wishes_t *wishes)
{
    char word[16] = "";
    double value = -1;

    sscanf(line, "%15s %lf", word, &value);
    if (!strcmp(word, "reset")) {
        wishes->reset = true;
    } else if (!strcmp(word, "unplug") && value > 0 && value <= 3600) {
        wishes->unplug_s = value;
    } else if (!strcmp(word, "flip") && value >= 0 && value <= 1e6) {
        line_set_flips(value);
    } else if (!strcmp(word, "drop") && value >= 0 && value <= 1e6) {
        line_set_drops(value);
    } else if (!strcmp(word, "garbage") && value >= 0 && value <= 4096) {
        line_put_garbage((unsigned)value);
    } else {
        control_answer("error: no command with a number in its range");
        return;
    }
    control_answer("ok");
}

void control_read(wishes_t *wishes)
{
    struct pollfd state = {.fd = STDIN_FILENO, .events = POLLIN};
    char line[256];

    while (!wishes->quit && poll(&state, 1, 0) > 0) { /* who asks waits for the answer */
        if (fgets(line, sizeof line, stdin))
            obey(line, wishes);
        else
            wishes->quit = true;
    }
}
