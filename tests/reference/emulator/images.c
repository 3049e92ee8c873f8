#include "images.h"

#include <fcntl.h>
#include <stddef.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

_Static_assert(offsetof(images_t, tactels) == 64, "layout");
_Static_assert(offsetof(images_t, wrist_mv) == 8256, "layout");
_Static_assert(offsetof(images_t, felt) == 8280, "layout");
_Static_assert(sizeof(images_t) == 24664, "layout");

images_t *images_open(const char *path, const char **why)
{
    struct stat status;
    int file = open(path, O_RDWR | O_CLOEXEC);
    images_t *images = MAP_FAILED;

    if (file >= 0 && fstat(file, &status) == 0 && status.st_size >= (off_t)sizeof(images_t))
        images = mmap(0, sizeof(images_t), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    if (file >= 0)
        close(file);
    if (images == MAP_FAILED) {
        *why = "is no file of 24664 bytes that can be read and written";
        return 0;
    }
    if (memcmp(images->magic, "PROBEIMG", 8) || images->version != 2) {
        munmap(images, sizeof(images_t));
        *why = "does not begin with PROBEIMG, version 2";
        return 0;
    }
    return images;
}

void images_take(images_t *file, images_t *copy)
{
    uint32_t before = __atomic_load_n(&file->lock, __ATOMIC_ACQUIRE);
    images_t fresh;

    if (before == copy->lock || before & 1)
        return;
    memcpy(&fresh, file, offsetof(images_t, boots));
    __atomic_thread_fence(__ATOMIC_ACQUIRE);
    if (__atomic_load_n(&file->lock, __ATOMIC_RELAXED) != before)
        return;
    memcpy(copy, &fresh, offsetof(images_t, boots));
}
