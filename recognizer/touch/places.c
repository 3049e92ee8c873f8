/* Which symbols registered cells hold, and what cells of a lattice say of many places at once.

   The numpy forms of `locate` and `chance` are the reference: the same sums in the same order. */

#include <stdint.h>
#include <string.h>

/* Which text the library was made of; `compiled.load_kernels` leaves out what is older. */
uint32_t source_sum(void) { return SOURCE_SUM; }

typedef struct {
    int64_t registered, rows, columns, order; /* cells that are held; of the array; of its symbols */
    const uint64_t *keys;                     /* (registered,) row * columns + column, rising */
    const int32_t *owners;                    /* (registered + 1,) the last one: none */
    const int8_t *labels;                     /* (registered + 1,) */
    const int32_t *dense;                     /* (rows * columns,) place in `owners`, or NULL */
} Held;

/* Place in `owners` and `labels` of what holds a cell of the torus. */
static inline int64_t holder(const Held *h, int64_t row, int64_t column) {
    if (row < 0 || row >= h->rows) row = (row % h->rows + h->rows) % h->rows;
    if (column < 0 || column >= h->columns)
        column = (column % h->columns + h->columns) % h->columns;
    uint64_t key = (uint64_t)row * (uint64_t)h->columns + (uint64_t)column;
    if (h->dense) return h->dense[key];
    int64_t low = 0, high = h->registered;
    while (low < high) {
        int64_t middle = (low + high) / 2;
        if (h->keys[middle] < key) low = middle + 1;
        else high = middle;
    }
    return low < h->registered && h->keys[low] == key ? low : h->registered;
}

/* total (n,) += the scores (m, order + 1) of what m cells (m, 2) show at each of n places. */
void add_scores(const Held *h, int64_t n, const int64_t *rows, const int64_t *columns,
                const int32_t *owners, int64_t m, const int64_t *cells, const double *scores,
                double *total) {
    for (int64_t k = 0; k < n; k++) {
        double sum = total[k];
        for (int64_t c = 0; c < m; c++) {
            int64_t at = holder(h, rows[k] - cells[2 * c + 1], columns[k] + cells[2 * c]);
            int64_t label = h->owners[at] == owners[k] ? h->labels[at] : h->order;
            sum += scores[c * (h->order + 1) + label];
        }
        total[k] = sum;
    }
}

/* How many registered cells can be the one that m bare cells (m, 2) are counted from: what their
   prices (m,) come to, where the place holds a symbol, stays within the slack. */
int64_t count_places(const Held *h, int64_t m, const int64_t *cells, const double *prices,
                     double slack) {
    int64_t count = 0;
    for (int64_t k = 0; k < h->registered; k++) {
        int64_t row = (int64_t)(h->keys[k] / (uint64_t)h->columns);
        int64_t column = (int64_t)(h->keys[k] % (uint64_t)h->columns);
        double left = slack;
        for (int64_t c = 0; c < m && left >= 0; c++) {
            int64_t at = holder(h, row - cells[2 * c + 1], column + cells[2 * c]);
            if (h->owners[at] == h->owners[k]) left -= prices[c];
        }
        count += left >= 0;
    }
    return count;
}

/* One number (n,) for the place of cell (0, 0) and the face that holds it, if cells (n, 2) are the
   registered ones `at` (n,): key of the place times `faces`, and the face. */
void name_places(const Held *h, int64_t n, const int64_t *at, const int64_t *cells, int64_t faces,
                 int64_t *names) {
    for (int64_t k = 0; k < n; k++) {
        uint64_t key = h->keys[at[k]], row = key / (uint64_t)h->columns;
        int64_t down = (int64_t)row + cells[2 * k + 1];
        int64_t along = (int64_t)(key - row * (uint64_t)h->columns) - cells[2 * k];
        if (down < 0 || down >= h->rows) down = (down % h->rows + h->rows) % h->rows;
        if (along < 0 || along >= h->columns)
            along = (along % h->columns + h->columns) % h->columns;
        names[k] = (down * h->columns + along) * faces + h->owners[at[k]];
    }
}

enum { DIGIT = 12 };

/* Numbers (n,), none negative: sorted in place, each once, with how often it was there. They are
   sorted by digits of at most 12 bits, every other pass into `spare` (n,). Returns how many. */
int64_t count_names(int64_t n, int64_t *names, int64_t *spare, int64_t *votes) {
    int64_t most = 0, *from = names, *to = spare;
    int bits = 0;
    for (int64_t k = 0; k < n; k++) most |= names[k];
    while (bits < 63 && most >> bits) bits++;
    int passes = (bits + DIGIT - 1) / DIGIT, digit = passes ? (bits + passes - 1) / passes : 0;
    int64_t digits = 1 << digit;
    for (int shift = 0; shift < bits; shift += digit) {
        int64_t starts[1 << DIGIT];
        memset(starts, 0, digits * sizeof *starts);
        for (int64_t k = 0; k < n; k++) starts[(from[k] >> shift) & (digits - 1)]++;
        for (int64_t d = 0, sum = 0; d < digits; d++) {
            int64_t count = starts[d];
            starts[d] = sum;
            sum += count;
        }
        for (int64_t k = 0; k < n; k++) to[starts[(from[k] >> shift) & (digits - 1)]++] = from[k];
        int64_t *was = from;
        from = to;
        to = was;
    }
    int64_t found = 0;
    for (int64_t k = 0; k < n; k++) {
        if (found && from[k] == names[found - 1]) votes[found - 1]++;
        else {
            votes[found] = 1;
            names[found++] = from[k];
        }
    }
    return found;
}
