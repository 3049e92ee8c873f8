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

/* products (height, width, order, turns, phases^2) -> scores (turns, lattices): the sum over the
   cells of each lattice of what its likeliest symbol, or none, scores where the cell lies; lookups
   (turns, lattices, cells) are numbers of places (height phases, width phases), the last one none. */
void sum_lattices(int64_t height, int64_t width, int64_t order, int64_t turns, int64_t phases,
                  int64_t lattices, int64_t cells, const float *products, const int32_t *lookups,
                  float *scores) {
    int64_t each = phases * phases, count = height * width * each;
    int64_t all = turns * each;
    float *places = malloc((turns * (count + 1) + all) * sizeof(float));
    float *best = places + turns * (count + 1); /* (turns, phases^2) of one tactel */
    for (int64_t y = 0; y < height; y++) {
        for (int64_t x = 0; x < width; x++) {
            const float *from = products + (y * width + x) * order * all;
            for (int64_t k = 0; k < all; k++) best[k] = from[k] > 0.0f ? from[k] : 0.0f;
            for (int64_t label = 1; label < order; label++)
                for (int64_t k = 0; k < all; k++) {
                    float one = from[label * all + k];
                    best[k] = one > best[k] ? one : best[k];
                }
            for (int64_t down = 0; down < phases; down++) {
                float *to = places + ((y * phases + down) * width + x) * phases;
                for (int64_t turn = 0; turn < turns; turn++, to += count + 1)
                    for (int64_t k = 0; k < phases; k++)
                        to[k] = best[turn * each + down * phases + k];
            }
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
