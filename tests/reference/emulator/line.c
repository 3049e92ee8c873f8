#define _GNU_SOURCE
#include "line.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <poll.h>
#include <pty.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <unistd.h>

#include <simavr/avr_uart.h>

#define MEMORY 65536 /* bytes kept for a slow listener, as by a Linux serial driver */
#define RECEIVED 256
#define UCSR0A 0xC0 /* data addresses, the same in both parts */
#define UCSR0B 0xC1
#define UBRR0L 0xC4
#define UBRR0H 0xC5
#define U2X0 1 /* bits */
#define RXEN0 4

static avr_t *avr;
static avr_uart_t *uart;
static avr_irq_t *input;
static const char *link_path;
static double flips, drops; /* probability for a byte */

static int master = -1;
static char terminal[PATH_MAX];
static bool heard, wrong_speed;

static uint8_t memory[MEMORY];
static unsigned kept;
static uint8_t received[RECEIVED];
static unsigned taken, given;
static bool stopped; /* the processor's receiver is full */

static void keep(uint8_t byte)
{
    if (kept < MEMORY)
        memory[kept++] = byte;
}

static void processor_sends(avr_irq_t *irq, uint32_t value, void *parameter)
{
    uint8_t byte = (uint8_t)value;

    (void)irq;
    (void)parameter;
    if (!heard || (drops > 0 && drand48() < drops))
        return;
    if (flips > 0 && drand48() < flips)
        byte ^= (uint8_t)(1u << (mrand48() & 7));
    if (wrong_speed)
        byte ^= (uint8_t)mrand48();
    keep(byte);
}

static void receiver_ready(avr_irq_t *irq, uint32_t value, void *parameter)
{
    (void)irq;
    (void)value;
    (void)parameter;
    stopped = false;
}

static void receiver_full(avr_irq_t *irq, uint32_t value, void *parameter)
{
    (void)irq;
    (void)parameter;
    stopped = value != 0;
}

void line_connect(avr_t *processor, const char *link)
{
    uint32_t flags = 0;

    avr = processor;
    link_path = link;
    for (avr_io_t *io = avr->io_port; io; io = io->next)
        if (!strcmp(io->kind, "uart") && ((avr_uart_t *)io)->name == '0')
            uart = (avr_uart_t *)io;
    /* neither sleep while the firmware polls, nor print what it sends */
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    input = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT),
                            processor_sends, 0);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUT_XON),
                            receiver_ready, 0);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUT_XOFF),
                            receiver_full, 0);
}

/* Cycles for one bit, as the firmware has set it. */
static unsigned bit_cycles(void)
{
    unsigned divider = avr->data[UBRR0L] | (unsigned)avr->data[UBRR0H] << 8;

    return (divider + 1) * (avr->data[UCSR0A] & (1 << U2X0) ? 8 : 16);
}

/* The terminal's name for the firmware's speed; B0 if it has none. */
static speed_t firmware_speed(void)
{
    switch (avr->frequency / bit_cycles()) {
    case 500000: return B500000;
    case 1000000: return B1000000;
    case 2000000: return B2000000;
    default: return B0;
    }
}

static int make_terminal(void)
{
    struct termios settings;
    int slave;

    if (openpty(&master, &slave, terminal, 0, 0))
        return errno;
    tcgetattr(slave, &settings);
    cfmakeraw(&settings);
    if (firmware_speed() != B0)
        cfsetspeed(&settings, firmware_speed());
    tcsetattr(slave, TCSANOW, &settings);
    close(slave); /* from here on a hang-up says that nobody listens */
    fcntl(master, F_SETFL, O_NONBLOCK);
    fcntl(master, F_SETFD, FD_CLOEXEC);
    return 0;
}

int line_plug(void)
{
    char fresh[PATH_MAX];
    int error = make_terminal();

    if (error)
        return error;
    snprintf(fresh, sizeof fresh, "%s.new", link_path);
    unlink(fresh);
    if (symlink(terminal, fresh) || rename(fresh, link_path)) {
        error = errno;
        close(master);
        master = -1;
    }
    return error;
}

void line_unplug(void)
{
    if (master < 0)
        return;
    unlink(link_path);
    close(master);
    master = -1;
    heard = false;
    kept = taken = given = 0;
}

void line_reset(void)
{
    stopped = false;
    taken = given = 0;
}

/* A port that was closed keeps nothing for whoever opens it next. */
static void forget(void)
{
    int slave = open(terminal, O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    kept = 0;
    if (slave >= 0) {
        tcflush(slave, TCIFLUSH);
        close(slave);
    }
}

static void look_at_listener(void)
{
    struct pollfd state = {.fd = master};
    struct termios settings;
    bool listens;

    poll(&state, 1, 0);
    listens = !(state.revents & POLLHUP);
    if (heard && !listens)
        forget();
    heard = listens;
    if (heard && tcgetattr(master, &settings) == 0)
        wrong_speed = firmware_speed() != B0 && cfgetospeed(&settings) != firmware_speed();
}

static void deliver(void)
{
    ssize_t written = kept ? write(master, memory, kept) : 0;

    if (written <= 0)
        return;
    kept -= (unsigned)written;
    memmove(memory, memory + written, kept);
}

static void fetch(void)
{
    ssize_t got;

    if (given == taken) {
        given = taken = 0;
        got = read(master, received, sizeof received);
        if (got > 0)
            taken = (unsigned)got;
    }
    while (given < taken && !stopped) {
        uint8_t byte = received[given++];
        avr_raise_irq(input, wrong_speed ? (uint8_t)mrand48() : byte);
    }
}

void line_carry(void)
{
    /* the emulated line counts a parity bit that 8N1 has not: ten bits a byte, not eleven */
    if (avr->data[UCSR0B] & (1 << RXEN0))
        uart->cycles_per_byte = 10 * bit_cycles();
    if (master < 0)
        return;
    look_at_listener();
    if (heard) {
        deliver();
        fetch();
    }
}

void line_set_flips(double per_million)
{
    flips = per_million / 1e6;
}

void line_set_drops(double per_million)
{
    drops = per_million / 1e6;
}

void line_put_garbage(uint32_t bytes)
{
    for (; bytes && heard; bytes--)
        keep((uint8_t)mrand48());
}
