/* Sums of the coarse search: products of an image with what symbols look like -> lattices.

   What `search.lattice_scores` works out behind the matrix product, which is the reference. */

#include <stdint.h>
#include <stdlib.h>

/* The sum of values at places, in numpy's order: pairs of halves, eight sums side by side. */
static float sum_pairwise(const float *at, const int32_t *places, int64_t n) {
    if (n < 8) {
        float sum = 0.0f;
        for (int64_t k = 0; k < n; k++) sum += at[places[k]];
        return sum;
    }
    if (n > 128) {
        int64_t half = n / 2 - n / 2 % 8;
        return sum_pairwise(at, places, half) + sum_pairwise(at, places + half, n - half);
    }
    float r[8];
    int64_t k = 8;
    for (int j = 0; j < 8; j++) r[j] = at[places[j]];
    for (; k < n - n % 8; k += 8)
        for (int j = 0; j < 8; j++) r[j] += at[places[k + j]];
    float sum = ((r[0] + r[1]) + (r[2] + r[3])) + ((r[4] + r[5]) + (r[6] + r[7]));
    for (; k < n; k++) sum += at[places[k]];
    return sum;
}

/* Values (n,) of groups of `size` floats that lie `apart`, one behind the other. */
static inline void gather(float *to, const float *from, int64_t n, int64_t size, int64_t apart) {
    for (int64_t x = 0; x < n; x++)
        for (int64_t k = 0; k < size; k++) to[x * size + k] = from[x * apart + k];
}

/* best (2, half): of none and all symbols at a place, of turns and of those half a turn further. */
static void best_symbols(int64_t order, int64_t half, int64_t each, const float *even,
                         const float *odd, float *best) {
    float *opposite = best + half;
    for (int64_t k = 0; k < 2 * half; k++) best[k] = 0.0f;
    for (int64_t label = 0; label < order; label++, even += half, odd += half)
        for (int64_t k = 0; k < half; k++) {
            float one = even[k] + odd[k], other = even[k] - odd[k];
            best[k] = one > best[k] ? one : best[k];
            opposite[k] = other > opposite[k] ? other : opposite[k];
        }
    for (int64_t turn = 0; turn < half; turn += each) /* there phases lie the other way round */
        for (int64_t k = 0; k < each / 2; k++) {
            float one = opposite[turn + k];
            opposite[turn + k] = opposite[turn + each - 1 - k];
            opposite[turn + each - 1 - k] = one;
        }
}

/* Products even, odd (height, width, order, turns / 2, phases^2) -> scores (turns, lattices): the
   sum over the cells of each lattice of what its likeliest symbol, or none, scores where the cell
   lies; lookups (turns, lattices, cells) are numbers of places (height phases, width phases), the
   last one none. */
void sum_lattices(int64_t height, int64_t width, int64_t order, int64_t turns, int64_t phases,
                  int64_t lattices, int64_t cells, const float *even, const float *odd,
                  const int32_t *lookups, float *scores) {
    int64_t each = phases * phases, count = height * width * each;
    int64_t all = turns * each, half = all / 2;
    float *places = malloc((turns * (count + 1) + width * all) * sizeof(float));
    float *row = places + turns * (count + 1); /* (width, turns, phases^2) of a row of tactels */
    for (int64_t y = 0; y < height; y++) {
        for (int64_t x = 0; x < width; x++) {
            int64_t from = (y * width + x) * order * half;
            best_symbols(order, half, each, even + from, odd + from, row + x * all);
        }
        for (int64_t turn = 0; turn < turns; turn++)
            for (int64_t down = 0; down < phases; down++) {
                float *to = places + turn * (count + 1) + (y * phases + down) * width * phases;
                const float *from = row + turn * each + down * phases;
                if (phases == 2) gather(to, from, width, 2, all); /* usually: without a loop */
                else gather(to, from, width, phases, all);
            }
    }
    for (int64_t turn = 0; turn < turns; turn++) {
        float *at = places + turn * (count + 1);
        at[count] = 0.0f;
        for (int64_t k = 0; k < lattices; k++) {
            int64_t lattice = turn * lattices + k;
            scores[lattice] = sum_pairwise(at, lookups + lattice * cells, cells);
        }
    }
    free(places);
}

static inline float most(float a, float b, float c) {
    float one = a > b ? a : b;
    return one > c ? one : c;
}

/* to (n, size): the largest of each of n lines `from` and the two beside it, all around. */
static void look_beside(const float *from, int64_t n, int64_t size, float *to) {
    for (int64_t line = 0; line < n; line++) {
        const float *own = from + line * size;
        const float *before = from + (line ? line - 1 : n - 1) * size;
        const float *after = from + (line < n - 1 ? line + 1 : 0) * size;
        for (int64_t k = 0; k < size; k++) to[line * size + k] = most(before[k], own[k], after[k]);
    }
}

/* around (turns, n, n): the best of the scores (turns, n, n) of a lattice and of those beside it, one
   turn and one shift each way; all three go round. */
void look_around(int64_t turns, int64_t n, const float *scores, float *around) {
    float *one = malloc(2 * turns * n * n * sizeof(float)), *other = one + turns * n * n;
    for (int64_t line = 0; line < turns * n; line++)
        look_beside(scores + line * n, n, 1, one + line * n);
    for (int64_t turn = 0; turn < turns; turn++)
        look_beside(one + turn * n * n, n, n, other + turn * n * n);
    look_beside(other, turns, n * n, around);
    free(one);
}
