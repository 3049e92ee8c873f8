/* Runs the probe's firmware on an emulated AVR, with its circuit, serial line and faults.
 *
 *   emulator --board uno --firmware probe.elf --images FILE --link PATH
 *            [--wiring grounded|floating|virtual] [--load OHM] [--tau US] [--noise MV] [--trace FILE] [--free]
 *
 * Says "ready" on standard output, then obeys lines of its input, and ends with it:
 *
 *   flip N         damage one bit in N of a million bytes
 *   drop N         lose N of a million bytes
 *   garbage N      put N random bytes into the line, at once (at most 4096)
 *   unplug S       take the port and the power away, give both back after S seconds
 *   reset          reset the processor
 *
 * Paced at 16 MHz of real time, with --free as fast as it goes.
 */
#include <getopt.h>
#include <poll.h>
#include <signal.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include <simavr/avr_extint.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>

#include "electric.h"
#include "images.h"
#include "line.h"

#define HERTZ 16000000
#define SLICE (HERTZ / 1000) /* cycles between two looks at the world: 1 ms */
#define RUN_LIMIT 2000       /* cycles that the emulator runs at a time */
#define SLIP_S 0.25          /* further behind than this, time is given up as lost */

static struct {
    const char *board, *firmware, *images, *link, *trace;
    readout_t readout;
    bool free;
} options = {.board = "uno", .readout = {.load_ohm = 2200, .tau_us = 1}};

static volatile sig_atomic_t terminated;
static bool quit, reset_wanted; /* what the input asked for */
static double unplug_s;

static avr_t *avr;
static double origin_s;           /* wall time at which `emulated_s` was 0 */
static double emulated_s;         /* time of the processor, without the time off power */
static avr_cycle_count_t counted; /* cycles that are in it */

static void fail(const char *format, ...)
{
    va_list arguments;

    va_start(arguments, format);
    fputs("emulator: ", stderr);
    vfprintf(stderr, format, arguments);
    fputc('\n', stderr);
    va_end(arguments);
    exit(2);
}

static void terminate(int signal)
{
    (void)signal;
    terminated = 1;
}

/* The emulator's own messages: standard output is for answers. */
static void log_message(avr_t *processor, const int level, const char *format, va_list arguments)
{
    if (level <= (processor ? processor->log : LOG_ERROR))
        vfprintf(stderr, format, arguments);
}

static double wall_s(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void pause_s(double seconds)
{
    struct timespec span = {(time_t)seconds, (long)(1e9 * (seconds - (double)(time_t)seconds))};

    nanosleep(&span, 0);
}

static void read_options(int count, char **values)
{
    static const struct option names[] = {
        {"board", 1, 0, 'b'}, {"firmware", 1, 0, 'f'}, {"images", 1, 0, 'i'},
        {"link", 1, 0, 'l'},  {"trace", 1, 0, 'c'},    {"tau", 1, 0, 't'},
        {"noise", 1, 0, 'n'}, {"free", 0, 0, 'r'},     {"wiring", 1, 0, 'w'},
        {"load", 1, 0, 'o'},
        {0, 0, 0, 0}};
    int letter;

    while ((letter = getopt_long(count, values, "", names, 0)) != -1) {
        switch (letter) {
        case 'b': options.board = optarg; break;
        case 'f': options.firmware = optarg; break;
        case 'i': options.images = optarg; break;
        case 'l': options.link = optarg; break;
        case 'c': options.trace = optarg; break;
        case 't': options.readout.tau_us = atof(optarg); break;
        case 'n': options.readout.noise_mv = atof(optarg); break;
        case 'r': options.free = true; break;
        case 'o': options.readout.load_ohm = atof(optarg); break;
        case 'w':
            if (!strcmp(optarg, "grounded"))
                options.readout.wiring = GROUNDED;
            else if (!strcmp(optarg, "floating"))
                options.readout.wiring = FLOATING;
            else if (!strcmp(optarg, "virtual"))
                options.readout.wiring = VIRTUAL;
            else
                fail("the wiring '%s' is not known: take grounded, floating or virtual", optarg);
            break;
        default: exit(2);
        }
    }
    if (optind < count)
        fail("'%s' is no option", values[optind]);
    if (!options.firmware || !options.images || !options.link)
        fail("--firmware, --images and --link are needed");
    if (!(options.readout.load_ohm > 0))
        fail("a load resistor has more than 0 ohm");
}

static void reset(void)
{
    electric_reset();
    avr_reset(avr);
    avr->run_cycle_limit = RUN_LIMIT;
    /* else the emulator looks at a low INT pin in every cycle, even with its interrupt off */
    for (uint8_t pin = 0; pin < 8; pin++)
        avr_extint_set_strict_lvl_trig(avr, pin, 0);
    counted = avr->cycle;
    line_reset();
}

static void make_processor(const wiring_t *wiring)
{
    elf_firmware_t firmware = {0};

    avr_global_logger_set(log_message);
    if (elf_read_firmware(options.firmware, &firmware))
        fail("cannot read the firmware %s", options.firmware);
    snprintf(firmware.mmcu, sizeof firmware.mmcu, "%s", wiring->mcu);
    firmware.frequency = HERTZ;
    avr = avr_make_mcu_by_name(firmware.mmcu);
    if (!avr)
        fail("the emulator knows no %s", firmware.mmcu);
    avr_init(avr);
    avr->log = LOG_ERROR;
    avr_load_firmware(avr, &firmware);
    avr->vcc = avr->avcc = avr->aref = 5000;
}

static void run_slice(void)
{
    avr_cycle_count_t end = avr->cycle + SLICE;

    while (avr->cycle < end) {
        int state = avr_run(avr);
        if (state == cpu_Done || state == cpu_Crashed)
            fail("the processor stopped at 0x%x", avr->pc);
    }
    emulated_s += (double)(avr->cycle - counted) / HERTZ;
    counted = avr->cycle;
}

/* Wait for real time, or give up what is too far behind it. */
static void keep_pace(void)
{
    double ahead_s = origin_s + emulated_s - wall_s();

    if (options.free)
        return;
    if (ahead_s > 0)
        pause_s(ahead_s);
    else if (-ahead_s > SLIP_S)
        origin_s -= ahead_s;
}

/* Lines of the input, each obeyed and answered with a line. */
static void answer(const char *said)
{
    puts(said);
    fflush(stdout);
}

static void obey(const char *line)
{
    char word[16] = "";
    double value = -1;

    sscanf(line, "%15s %lf", word, &value);
    if (!strcmp(word, "reset")) {
        reset_wanted = true;
    } else if (!strcmp(word, "unplug") && value > 0 && value <= 3600) {
        unplug_s = value;
    } else if (!strcmp(word, "flip") && value >= 0 && value <= 1e6) {
        line_set_flips(value);
    } else if (!strcmp(word, "drop") && value >= 0 && value <= 1e6) {
        line_set_drops(value);
    } else if (!strcmp(word, "garbage") && value >= 0 && value <= 4096) {
        line_put_garbage((unsigned)value);
    } else {
        answer("error: no command with a number in its range");
        return;
    }
    answer("ok");
}

static void read_commands(void)
{
    struct pollfd state = {.fd = STDIN_FILENO, .events = POLLIN};
    char line[256];

    while (!quit && poll(&state, 1, 0) > 0) { /* who asks waits for the answer */
        if (fgets(line, sizeof line, stdin))
            obey(line);
        else
            quit = true;
    }
}

static void plug(void)
{
    int error = line_plug();

    if (error)
        fail("cannot make the port %s: %s", options.link, strerror(error));
}

int main(int count, char **values)
{
    const wiring_t *wiring;
    const char *why = "";
    images_t *images;
    FILE *trace = 0;
    double back_s = 0; /* when power comes back; 0: it is there */

    read_options(count, values);
    if (!(wiring = electric_wiring(options.board)))
        fail("the board '%s' is not known: take uno or mega", options.board);
    if (!(images = images_open(options.images, &why)))
        fail("%s %s", options.images, why);
    if (options.trace && !(trace = fopen(options.trace, "w")))
        fail("cannot write %s", options.trace);
    signal(SIGTERM, terminate);
    signal(SIGINT, terminate);
    signal(SIGPIPE, SIG_IGN);

    make_processor(wiring);
    electric_connect(avr, wiring, options.readout, images, trace);
    line_connect(avr, options.link);
    reset();
    run_slice(); /* lets the firmware set its line rate, which the port takes on */
    plug();
    answer("ready");

    origin_s = wall_s() - emulated_s;
    while (!quit && !terminated) {
        if (back_s > 0 && wall_s() >= back_s) {
            back_s = 0;
            reset();
            plug();
            origin_s = wall_s() - emulated_s;
        }
        if (back_s > 0) {
            pause_s(0.001);
        } else {
            run_slice();
            line_carry();
            keep_pace();
        }
        read_commands();
        if (unplug_s > 0) {
            line_unplug();
            back_s = wall_s() + unplug_s;
        }
        if (reset_wanted && back_s == 0)
            reset();
        reset_wanted = false;
        unplug_s = 0;
    }
    line_unplug();
    if (trace)
        fclose(trace);
    return 0;
}
