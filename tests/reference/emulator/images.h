/* What the sensors feel, in a file that another process maps and changes while this one runs. */
#ifndef IMAGES_H
#define IMAGES_H

#include <stdint.h>

#define SENSORS 8
#define TACTELS 256
#define WRIST 4
#define REMEMBERED 4096

enum { MILLIVOLTS = 0, SIEMENS = 1 }; /* of `tactels`: what the ADC is given, or every resistor */

/* The file, little endian. The writer makes `lock` odd, writes, and makes it even again; an image
 * that is being written is taken at the next scan. This side writes from `boots` on.
 */
typedef struct {
    char magic[8];                          /*     0 "PROBEIMG" */
    uint32_t version;                       /*     8 2 */
    uint32_t lock;                          /*    12 odd while the image is being written */
    uint32_t number;                        /*    16 of the image, given by the writer */
    uint32_t kind;                          /*    20 what stands in `tactels` */
    uint32_t reserved[10];                  /*    24 */
    float tactels[SENSORS][TACTELS];        /*    64 row by row from the top */
    float wrist_mv[WRIST];                  /*  8256 */
    uint32_t boots;                         /*  8272 resets since the host started, from 1 */
    uint32_t scans;                         /*  8276 begun since the last reset */
    uint32_t felt[REMEMBERED];              /*  8280 number of the image in scan i, at i % 4096 */
} images_t;

/* Map the file; 0 and a message in `*why` if it cannot be. */
images_t *images_open(const char *path, const char **why);

/* Copy the image whole; leave the copy as it is while a new one is being written. */
void images_take(images_t *file, images_t *copy);

#endif
