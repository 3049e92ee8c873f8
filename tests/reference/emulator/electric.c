#include "electric.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <simavr/avr_adc.h>
#include <simavr/avr_ioport.h>

#include "network.h"

#define REFERENCE_MV 5000 /* and the supply of the rows */
#define ADCSRA 0x7A /* data address, the same in both parts */
#define CHANNELS 8

static const wiring_t wirings[] = {
    {"uno",
     "atmega328p",
     {{'B', 0}, {'B', 1}, {'B', 2}, {'B', 3}},
     {{'D', 4}, {'D', 5}, {'D', 6}, {'D', 7}},
     {{'D', 2}, {'D', 3}, {'B', 4}}},
    {"mega",
     "atmega2560",
     {{'A', 0}, {'A', 1}, {'A', 2}, {'A', 3}},
     {{'A', 4}, {'A', 5}, {'A', 6}, {'A', 7}},
     {{'C', 0}, {'C', 1}, {'C', 2}}},
};

static avr_t *avr;
static avr_irq_t *inputs; /* of the ADC, by channel */
static const wiring_t *wiring;
static readout_t readout;
static network_t network; /* of the image and sensor at hand */
static images_t *shared, image; /* the file, and what is felt in this scan */
static FILE *trace;
static double tau_cycles;

static uint8_t ports['Z' + 1]; /* output levels by letter */
static uint16_t rows; /* at the supply, by bits */
static unsigned column, sensor;
static uint16_t shifted;      /* what the registers hold behind their latch */
static unsigned clock_was, latch_was;

/* the voltage at the ADC's tactel input: `from_mv` at `since`, running towards the tactel's */
static double from_mv;
static avr_cycle_count_t since;

/* the conversion under way */
static unsigned channel;
static avr_cycle_count_t held; /* when its voltage is held */
static double noise;

static double tactel_mv(void)
{
    const float *tactels = image.tactels[sensor];
    double ratio;

    if (image.kind == SIEMENS) {
        if (readout.wiring == FLOATING)
            ratio = network_floating(&network, tactels, image.number, sensor, rows, column,
                                     1 / readout.load_ohm);
        else if (readout.wiring == VIRTUAL)
            ratio = network_virtual(tactels, rows, column, 1 / readout.load_ohm);
        else
            ratio = network_grounded(tactels, rows, column, 1 / readout.load_ohm);
        return REFERENCE_MV * ratio;
    }
    for (unsigned row = 0; row < 16; row++)
        if (rows == 1u << row)
            return tactels[16 * row + column];
    return 0; /* no row, or several */
}

static double voltage_mv(avr_cycle_count_t cycle)
{
    double target = tactel_mv();

    if (tau_cycles <= 0)
        return target;
    return target + (from_mv - target) * exp(-(double)(cycle - since) / tau_cycles);
}

/* Give the ADC the voltage of a conversion. It counts (mv * 1023) / 5000 in whole numbers, the
 * real one mv * 1024 / 5000: find the count first, then millivolts that give it. It also looks
 * at the channel when the result is read, the real one when the conversion starts: all channels
 * get the same.
 */
static void inject(void)
{
    double mv = noise + (channel ? image.wrist_mv[channel - 1] : voltage_mv(held));
    double count = floor(mv * 1024 / REFERENCE_MV);

    if (!(count > 0))
        count = 0;
    if (count > 1023)
        count = 1023;
    for (int i = 0; i < CHANNELS; i++)
        avr_raise_irq(inputs + i, (uint32_t)ceil(count * REFERENCE_MV / 1023));
}

static unsigned address(const pin_t *pins, int count)
{
    unsigned value = 0;

    for (int i = 0; i < count; i++)
        value |= ((unsigned)ports[(int)pins[i].port] >> pins[i].bit & 1u) << i;
    return value;
}

/* Follow the pins of the rows; return which are at the supply. */
static uint16_t rows_now(void)
{
    unsigned clock, latch;

    if (readout.wiring == FLOATING)
        return (uint16_t)(1u << address(wiring->row, 4));
    clock = address(wiring->row + 1, 1);
    latch = address(wiring->row + 2, 1);
    if (clock && !clock_was)
        shifted = (uint16_t)(shifted << 1 | address(wiring->row, 1));
    uint16_t held_rows = latch && !latch_was ? shifted : rows;
    clock_was = clock;
    latch_was = latch;
    return held_rows;
}

static void port_changed(avr_irq_t *irq, uint32_t value, void *parameter)
{
    char letter = *(const char *)parameter;
    uint16_t new_rows;
    unsigned new_column, new_sensor;

    (void)irq;
    if (ports[(int)letter] == (uint8_t)value)
        return;
    ports[(int)letter] = (uint8_t)value;
    if (trace)
        fprintf(trace, "%llu port %c %u\n", (unsigned long long)avr->cycle, letter, value & 0xFF);
    new_rows = rows_now();
    new_column = address(wiring->column, 4);
    new_sensor = address(wiring->sensor, 3);
    if (new_rows == rows && new_column == column && new_sensor == sensor)
        return;
    from_mv = voltage_mv(avr->cycle);
    since = avr->cycle;
    rows = new_rows;
    column = new_column;
    sensor = new_sensor;
    if (avr->cycle < held && channel == 0)
        inject(); /* switched before the voltage was held */
}

/* Of mean 0 and deviation 1 (Box and Muller). */
static double normal(void)
{
    double radius = sqrt(-2 * log(1 - drand48()));

    return radius * cos(2 * M_PI * drand48());
}

/* A conversion starts: it holds its voltage 1.5 ADC clocks after the next edge of that clock. */
static void conversion_starts(avr_irq_t *irq, uint32_t value, void *parameter)
{
    union {
        uint32_t value;
        avr_adc_mux_t mux;
    } input = {value};
    unsigned power = avr->data[ADCSRA] & 7;
    avr_cycle_count_t clock = 1u << (power ? power : 1);

    (void)irq;
    (void)parameter;
    channel = input.mux.src;
    if (channel > WRIST)
        channel = 0;
    held = (avr->cycle + clock - 1) / clock * clock + clock + clock / 2;
    if (channel == 0 && rows == 1 && column == 0) {
        images_take(shared, &image);
        shared->felt[shared->scans % REMEMBERED] = image.number;
        __atomic_store_n(&shared->scans, shared->scans + 1, __ATOMIC_RELEASE);
    }
    if (trace)
        fprintf(trace, "%llu convert %u\n", (unsigned long long)avr->cycle, channel);
    noise = readout.noise_mv * normal();
    inject();
}

const wiring_t *electric_wiring(const char *board)
{
    for (size_t i = 0; i < sizeof wirings / sizeof *wirings; i++)
        if (!strcmp(wirings[i].name, board))
            return &wirings[i];
    return 0;
}

void electric_connect(avr_t *processor, const wiring_t *wires, readout_t how, images_t *images,
                      FILE *file)
{
    static const char letters[] = "ABCD";

    avr = processor;
    wiring = wires;
    readout = how;
    shared = images;
    trace = file;
    tau_cycles = how.tau_us * 16;
    inputs = avr_io_getirq(avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_ADC0);
    image.lock = 1; /* no lock of a whole image */
    images_take(shared, &image);
    for (const char *letter = letters; *letter; letter++) {
        avr_irq_t *irq =
            avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ((unsigned)*letter), IOPORT_IRQ_PIN_ALL);
        if (irq)
            avr_irq_register_notify(irq, port_changed, (void *)letter);
    }
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_OUT_TRIGGER),
                            conversion_starts, 0);
}

void electric_reset(void)
{
    memset(ports, 0, sizeof ports);
    column = sensor = 0;
    clock_was = latch_was = 0;
    rows = readout.wiring == FLOATING ? 1 : 0xA53C;
    shifted = 0x5AC3; /* at power on registers hold anything */
    from_mv = 0;
    since = held = 0;
    shared->scans = 0;
    shared->boots++;
}
