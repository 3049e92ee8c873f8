/* The image under b candidate lattices: their refinement, and the scores of their cells.

   What `refine.refine_lattices` and `fit.score_cells` work out with numpy, one candidate and one
   tactel after the other and without the arrays between; single precision stands where numpy has
   it. Names, units and frames are those of `gain.normalize_image`, `projection`, `noise`, `damped`
   and `refine`, which are the reference. Arrays are C-contiguous. Compile without contraction of
   products and sums. */

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "touch_data.h"

static const double LOG4 = 1.3862943611198906; /* log(1 + 3) */

/* 2^x of |x| < 100 and log x of x > 0 to 1e-7, in steps that compilers do side by side:
   S. L. Moshier, Methods and Programs for Mathematical Functions (Ellis Horwood, 1989). */
static inline float power_of_two(float x) {
    const float shift = 12582912.0f; /* adding it rounds to whole numbers */
    float whole = (x + shift) - shift, f = x - whole, y = 1.535336188319500e-4f;
    y = y * f + 1.339887440266574e-3f;
    y = y * f + 9.618437357674640e-3f;
    y = y * f + 5.550332471162809e-2f;
    y = y * f + 2.402264791363012e-1f;
    y = y * f + 6.931472028550421e-1f;
    y = y * f + 1.0f;
    union { int32_t bits; float value; } scale = {.bits = ((int32_t)whole + 127) << 23};
    return y * scale.value;
}

static inline float logarithm(float x) {
    union { float value; int32_t bits; } at = {.value = x};
    int32_t exponent = (at.bits - 0x3f3504f3) >> 23; /* the rest lies about 1 */
    at.bits -= exponent << 23;
    float f = at.value - 1.0f, z = f * f, e = (float)exponent, y = 7.0376836292e-2f;
    y = y * f - 1.1514610310e-1f;
    y = y * f + 1.1676998740e-1f;
    y = y * f - 1.2420140846e-1f;
    y = y * f + 1.4249322787e-1f;
    y = y * f - 1.6668057665e-1f;
    y = y * f + 2.0000714765e-1f;
    y = y * f - 2.4999993993e-1f;
    y = y * f + 3.3333331174e-1f;
    y = y * f * z - 2.12194440e-4f * e - 0.5f * z;
    return f + y + 0.693359375f * e;
}

static inline double stiffness(double u) { double w = 1.0 - u; return 2.0 / (w * w * w) + 1.0; }

static inline double force_of(int64_t hardens, double deepest, double beyond, double depth) {
    if (!hardens) return 3.0 * larger(depth, 0.0);
    double u = smaller(larger(depth, 0.0), deepest), w = 1.0 - u;
    return 1.0 / (w * w) - w + larger(depth - deepest, 0.0) * beyond;
}

static inline double slope_of(const TouchData *s, double depth) {
    double slope = s->hardens ? stiffness(smaller(depth, s->deepest)) : 3.0;
    return depth > 0 ? slope : 0.0;
}

static inline double psi(double y) { return y > 0.0 ? log(1.0 + 3.0 * y) / LOG4 : 0.0; }

/* What one candidate shows, tactel by tactel, and what all candidates have in common. The rows of
   the normal matrix are filled up with zeros to whole fours. */
typedef struct {
    double strongest, mean[3];          /* of the forces; of the planes over what is loaded */
    int any_bare, is_loud;              /* under any of the gains */
    int known;                          /* labels are: symbols (1, n) are what is shown alone */
    double *psi, *press, *bare, *contact, *depth, *plain, *lower, *plateau, *unit; /* (n,) */
    double *none, *scores;              /* (n,) and (q, n): of no symbol, and of each */
    double *sums, *rows;                /* (n, q + 1); (2, 12, n) */
    double *shown, *force, *by_psi;     /* (6, n), (n,), (n,) of what is shown */
    float *value, *x, *y, *by;          /* (q, n) psi of symbols, slopes, what scales these */
    float *square, *width, *face;       /* (n,) of a spread, its logarithm; `bare` */
    int64_t *cells, *first, *labels;    /* (n, 2), (n,), (n,) */
    int64_t *place;                     /* (n,) in the template */
    double measure;
} Work;

enum { ROWS = 12 };

static int64_t whole_fours(int64_t n) { return (n + 3) / 4 * 4; }

static Work new_work(const TouchData *s) {
    Work w = {0};
    int64_t n = s->n, wide = whole_fours(n), q = s->q;
    w.psi = malloc((18 * n + q * n + n * (q + 1) + 2 * ROWS * wide) * sizeof(double));
    w.press = w.psi + n;
    w.bare = w.press + n;
    w.contact = w.bare + n;
    w.depth = w.contact + n;
    w.plain = w.depth + n;
    w.lower = w.plain + n;
    w.plateau = w.lower + n;
    w.unit = w.plateau + n;
    w.none = w.unit + n;
    w.scores = w.none + n;
    w.sums = w.scores + q * n;
    w.shown = w.sums + n * (q + 1);
    w.force = w.shown + FIELDS * n;
    w.by_psi = w.force + n;
    w.rows = w.by_psi + n;
    memset(w.rows, 0, 2 * ROWS * wide * sizeof(double));
    w.value = malloc((4 * q + 3) * n * sizeof(float));
    w.x = w.value + q * n;
    w.y = w.x + q * n;
    w.by = w.y + q * n;
    w.square = w.by + q * n;
    w.width = w.square + n;
    w.face = w.width + n;
    w.cells = malloc(5 * n * sizeof(int64_t));
    w.first = w.cells + 2 * n;
    w.labels = w.first + n;
    w.place = w.labels + n;
    w.strongest = -INFINITY;
    double count = 0.0;
    for (int64_t t = 0; t < n; t++) {
        w.strongest = larger(w.strongest, s->forces[t]);
        if (!s->loaded[t]) continue;
        count += 1.0;
        for (int k = 0; k < 3; k++) w.mean[k] += s->plane[3 * t + k];
    }
    for (int k = 0; k < 3; k++) w.mean[k] /= count;
    return w;
}

static void free_work(Work *w) {
    free(w->psi);
    free(w->value);
    free(w->cells);
}

/* Depths under a gain, and what they press, (n,); returns the least plateau over the scale. */
static double press_plane(const TouchData *s, Work *w, int64_t i, const double *g) {
    const double *drop = s->falls ? s->drop + (s->falls > 1 ? i : 0) * s->n : NULL;
    const double *plane = s->plane, beyond = stiffness(s->deepest), deepest = s->deepest;
    double most = 0.0;
    for (int64_t t = 0; t < s->n; t++) {
        double d = g[1] * plane[3 * t] + g[2] * plane[3 * t + 1] + g[3] * plane[3 * t + 2];
        w->depth[t] = drop ? d - drop[t] : d;
    }
    for (int64_t t = 0; t < s->n; t++) {
        w->plain[t] = force_of(s->hardens, deepest, beyond, w->depth[t]);
        w->lower[t] = force_of(s->hardens, deepest, beyond, w->depth[t] - s->symbol);
    }
    for (int64_t t = 0; t < s->n; t++) if (s->loaded[t]) most = larger(most, w->plain[t]);
    return s->least_gain * most;
}

/* What some candidate has makes all of them work it out. */
static void look_at_gains(const TouchData *s, Work *w, const double *gain) {
    w->any_bare = w->is_loud = 0;
    for (int64_t i = 0; i < s->b && !(w->any_bare && (w->is_loud || s->noise == 0.0)); i++) {
        const double *g = gain + 4 * i;
        if (i && !memcmp(g, g - 4, 4 * sizeof(double)) && s->falls < 2) continue;
        double least = press_plane(s, w, i, g), scale = exp(g[0]);
        for (int64_t t = 0; t < s->n; t++) {
            double plateau = s->loaded[t] ? scale * larger(w->plain[t], least) : w->strongest;
            w->any_bare |= s->loaded[t] && w->lower[t] > 0.0;
            w->is_loud |= s->noise / plateau >= s->loud;
        }
    }
}

/* The image under the gain g (4,) of candidate i. */
static void normalize(const TouchData *s, Work *w, int64_t i, const double *g) {
    double least = press_plane(s, w, i, g), scale = exp(g[0]), sum = 0.0;
    double usual = g[1] * w->mean[0] + g[2] * w->mean[1] + g[3] * w->mean[2];
    double full = s->full_press * larger(usual, 1e-9);
    for (int64_t t = 0; t < s->n; t++) {
        double share = larger(w->plain[t], least);
        w->plateau[t] = s->loaded[t] ? scale * share : w->strongest;
        w->press[t] = smaller(larger(w->depth[t] / full, s->least_press), 1.0);
        w->bare[t] = s->loaded[t] ? w->lower[t] / share : 0.0;
        w->contact[t] = smaller(larger(w->plain[t] / least, 0.0), 1.0);
    }
    for (int64_t t = 0; t < s->n; t++) {
        w->psi[t] = psi(s->forces[t] / w->plateau[t]);
        if (s->trust[t] != 0.0) sum += s->trust[t] * (log(w->plateau[t]) + LOG4 * w->psi[t]);
    }
    w->measure = -sum;
}

static inline int64_t grid(const TouchData *s, double offset) {
    const double shift = 6755399441055744.0; /* adding it rounds to whole numbers */
    double at = ((offset + s->half) / s->step + shift) - shift;
    return (int64_t)smaller(larger(at, -1.0), (double)s->size) + 1;
}

/* Column and upward row of the cell under each tactel, and where that is in its template. */
static void find_cells(const TouchData *s, Work *w, const double *pose) {
    double c = cos(pose[2]) * (1 + pose[6]), n = sin(pose[2]) * (1 + pose[6]);
    for (int64_t t = 0; t < s->n; t++) {
        double x = s->points[2 * t], y = s->points[2 * t + 1], offset[2];
        double u[2] = {pose[0] + c * x - n * y, pose[1] + n * x + c * y};
        for (int k = 0; k < 2; k++) {
            double cell = u[k] / s->pitch;
            w->cells[2 * t + k] = (int64_t)cell - (cell < (double)(int64_t)cell); /* its floor */
            offset[k] = u[k] - ((double)w->cells[2 * t + k] + 0.5) * s->pitch;
        }
        w->place[t] = grid(s, offset[1]) * (s->size + 2) + grid(s, offset[0]);
        for (int64_t at = 0; at < s->q * FIELDS; at += 16)
            __builtin_prefetch(s->rimmed + w->place[t] * s->q * FIELDS + at);
    }
}

static inline int64_t symbols(const TouchData *s, const Work *w) { return w->known ? 1 : s->q; }

/* psi of each symbol at each tactel and its slopes, for what is fitted of form and gain. */
static void look_up(const TouchData *s, Work *w, const double *pose) {
    const float form[3] = {(float)pose[3], (float)pose[4], (float)pose[5]}, log4 = (float)LOG4;
    int64_t n = s->n;
    for (int64_t t = 0; t < n; t++) w->face[t] = (float)w->bare[t];
    for (int64_t t = 0; t < n; t++) {
        const float *from = s->rimmed + w->place[t] * s->q * FIELDS;
        float hold = (float)w->contact[t];
        if (w->known && w->labels[t] > 0) from += w->labels[t] * FIELDS;
        for (int64_t k = 0; k < symbols(s, w); k++, from += FIELDS) {
            float v = from[0] + from[3] * form[0] + from[4] * form[1] + from[5] * form[2];
            w->value[k * n + t] = v * hold;
            w->x[k * n + t] = from[1] * hold;
            w->y[k * n + t] = from[2] * hold;
        }
    }
    for (int64_t k = 0; k < symbols(s, w) && w->any_bare; k++) {
        float *value = w->value + k * n, *x = w->x + k * n, *y = w->y + k * n, *by = w->by + k * n;
        for (int64_t t = 0; t < n; t++) { /* 1 + 3 y is 4^psi; `less` is what a sum of 1 rounds off */
            float face = w->face[t], power = power_of_two(2.0f * value[t]);
            float more = (power - 1.0f) + (4.0f - power) * face, whole = 1.0f + more;
            float inverse = 1.0f / whole, less = (more - (whole - 1.0f)) * inverse;
            float total = (logarithm(more > 0.0f ? whole : 1.0f) + less) / log4;
            float alone = value[t] > 0.0f ? value[t] : 0.0f;
            by[t] = face > 0.0f ? (1.0f - face) * power * inverse : 1.0f;
            x[t] *= by[t];
            y[t] *= by[t];
            value[t] = face > 0.0f ? (more > 0.0f ? total : 0.0f) : alone;
        }
    }
}

/* What the noise of readings adds to the square of a spread at a value of psi. */
static inline double readings(const TouchData *s, double value, double plateau, double unit) {
    double share = 3.0 / LOG4 * exp(-LOG4 * value) * (s->noise / plateau) / unit;
    return share * share;
}

/* Score of a tactel that reads the bare face, or nothing, at a value of psi. */
static inline double bare_score(const TouchData *s, const Work *w, int64_t t, double value) {
    double unit = w->unit[t], square = s->quiet * s->quiet + value * value;
    if (w->is_loud) square += readings(s, value, w->plateau[t], unit);
    double away = (w->psi[t] - value) / unit;
    return s->trust[t] * (-smaller(0.5 * away * away / square, s->most) - 0.5 * log(square));
}

/* Scores of each symbol at each tactel, and of none; noise: deviation of psi on a covered one. */
static void score(const TouchData *s, Work *w, double noise) {
    const float quiet = (float)(s->quiet * s->quiet), aside = (float)(s->displaced * s->displaced);
    const double alone = s->quiet * s->quiet, usual = log(sqrt(alone));
    int64_t n = s->n;
    for (int64_t t = 0; t < n; t++) w->unit[t] = noise / larger(w->press[t], 1e-3);
    for (int64_t k = 0; k < symbols(s, w); k++) {
        const float *value = w->value + k * n, *x = w->x + k * n, *y = w->y + k * n;
        float *square = w->square, *width = w->width;
        double *to = w->scores + k * n;
        for (int64_t t = 0; t < n; t++)
            square[t] = quiet + value[t] * value[t] + aside * (x[t] * x[t] + y[t] * y[t]);
        for (int64_t t = 0; t < n && w->is_loud; t++)
            square[t] += (float)readings(s, value[t], w->plateau[t], w->unit[t]);
        for (int64_t t = 0; t < n; t++) width[t] = 0.5f * logarithm(square[t]);
        for (int64_t t = 0; t < n; t++) {
            double away = w->psi[t] - value[t], unit = w->unit[t];
            double loss = smaller(0.5 * away * away / (unit * unit * square[t]), s->most);
            to[t] = s->trust[t] * (-loss - width[t]);
        }
    }
    for (int64_t t = 0; t < n; t++) { /* beyond the edge of the face, or on it */
        double away = w->psi[t] / w->unit[t];
        w->none[t] = s->trust[t] * (-smaller(0.5 * away * away / alone, s->most) - usual);
    }
    for (int64_t t = 0; t < n; t++) {
        if (!(w->bare[t] > 0.0) && !w->is_loud) continue;
        w->none[t] = bare_score(s, w, t, 0.0);
        if (w->bare[t] > 0.0)
            w->none[t] = larger(w->none[t], bare_score(s, w, t, psi(w->bare[t])));
    }
}

/* labels (n,) of what fits best in the cell under each tactel, -1: no symbol. Cells are few, and
   mostly that of the tactel before. */
static void choose(const TouchData *s, Work *w) {
    const int64_t *cells = w->cells, wide = s->q + 1;
    int64_t known = 0, k = 0;
    for (int64_t t = 0; t < s->n; t++) {
        const int64_t *cell = cells + 2 * t;
#define IS_CELL(k) (cells[2 * w->first[k]] == cell[0] && cells[2 * w->first[k] + 1] == cell[1])
        if (!(known && IS_CELL(k)))
            for (k = 0; k < known && !IS_CELL(k); k++) {}
        if (k == known) {
            w->first[known++] = t;
            memset(w->sums + k * wide, 0, wide * sizeof(double));
        }
        for (int64_t c = 0; c < s->q; c++) w->sums[k * wide + c] += w->scores[c * s->n + t];
        w->sums[k * wide + s->q] += w->none[t];
        w->labels[t] = k;
    }
    for (k = 0; k < known; k++) {
        const double *sum = w->sums + k * wide;
        int64_t best = 0;
        for (int64_t c = 1; c < s->q; c++) if (sum[c] > sum[best]) best = c;
        w->first[k] = sum[s->q] + s->tie > sum[best] ? -1 : best;
    }
    for (int64_t t = 0; t < s->n; t++) w->labels[t] = w->first[w->labels[t]];
}

/* Labels (n,) of what cells show, -1 beyond the table. */
static void read_labels(const TouchData *s, Work *w, const int8_t *given, const int64_t *corner) {
    for (int64_t t = 0; t < s->n; t++) {
        int64_t x = w->cells[2 * t] - corner[0], y = w->cells[2 * t + 1] - corner[1];
        int inside = x >= 0 && x < s->wide && y >= 0 && y < s->high;
        w->labels[t] = inside ? given[y * s->wide + x] : -1;
    }
}

/* psi and slopes (6, n) of what is shown, of the bare face where that is nothing. */
static void value_shown(const TouchData *s, Work *w) {
    int64_t n = s->n;
    double *v = w->shown;
    for (int64_t t = 0; t < n; t++) {
        int64_t label = w->labels[t], at = (w->known ? 0 : label) * n + t;
        if (label < 0) {
            double floor_ = psi(w->bare[t]);
            v[t] = w->psi[t] > floor_ / 2 ? floor_ : 0.0;
            for (int f = 1; f < FIELDS; f++) v[f * n + t] = 0.0;
            continue;
        }
        const float *from = s->rimmed + (w->place[t] * s->q + label) * FIELDS;
        float scale = w->any_bare ? w->by[at] : 1.0f, hold = (float)w->contact[t];
        v[t] = w->value[at];
        v[n + t] = w->x[at];
        v[2 * n + t] = w->y[at];
        for (int f = 3; f < FIELDS; f++) v[f * n + t] = from[f] * hold * scale;
    }
}

/* Spread of psi about what is shown, in units of the noise. */
static inline double deviation(const TouchData *s, const Work *w, int64_t t, double unit) {
    const double *v = w->shown + t;
    double x = v[s->n], y = v[2 * s->n], square = s->quiet * s->quiet + v[0] * v[0];
    square += s->displaced * s->displaced * (x * x + y * y);
    if (w->is_loud) square += readings(s, v[0], w->plateau[t], unit);
    return (double)(float)sqrt(square);
}

/* Forces (n,) of what is shown, what changes with pose and gain (11, n), and by how much forces
   change with psi (n,). */
static void press_shown(const TouchData *s, Work *w, const double *pose, const double *gain) {
    const double c = cos(pose[2]), r = sin(pose[2]), scale = exp(gain[0]), *points = s->points;
    const int64_t n = s->n, wide = whole_fours(n);
    double *by = w->by_psi, *rows = w->rows, *v = w->shown;
    for (int64_t t = 0; t < n; t++) by[t] = exp(v[t] * (double)(float)LOG4);
    for (int64_t t = 0; t < n; t++) {
        double total = (by[t] - 1.0) / 3.0, bare = w->bare[t], depth = w->depth[t];
        double symbol = smaller(larger((total - bare) / larger(1 - bare, 1e-3), 0.0), 1.5);
        double rest = v[t] > s->grazed ? 1 - symbol : 0.0;
        double force = scale * (symbol * w->plain[t] + rest * w->lower[t]);
        double slope = symbol * slope_of(s, depth) + rest * slope_of(s, depth - s->symbol);
        w->force[t] = rows[7 * wide + t] = force;
        for (int k = 0; k < 3; k++) rows[(8 + k) * wide + t] = scale * slope * s->plane[3 * t + k];
    }
    for (int64_t t = 0; t < n; t++) {
        double x = points[2 * t], y = points[2 * t + 1], across = c * x - r * y, up = r * x + c * y;
        double by_x = v[n + t], by_y = v[2 * n + t], change = by[t] * LOG4 / 3.0 * w->plateau[t];
        rows[t] = by_x * change;
        rows[wide + t] = by_y * change;
        rows[2 * wide + t] = (by_y * across - by_x * up) * change;
        for (int f = 3; f < FIELDS; f++) rows[f * wide + t] = v[f * n + t] * change;
        rows[6 * wide + t] = (by_x * across + by_y * up) * change;
        by[t] = change;
    }
}

/* given: (b, high, wide) labels of cells from `corner` (b, 2) on, or NULL: what fits best. */
typedef struct { const int8_t *given; const int64_t *corner; } Shown;

/* See the image as candidate i does; returns its log-likelihood. */
static double explain(const TouchData *s, Work *w, Shown shown, int64_t i, const double *pose,
                      const double *gain) {
    double sum = 0.0, level = 0.0;
    w->known = shown.given != NULL;
    find_cells(s, w, pose);
    if (w->known) read_labels(s, w, shown.given + i * s->high * s->wide, shown.corner + 2 * i);
    look_up(s, w, pose);
    score(s, w, s->first);
    if (!w->known) choose(s, w);
    for (int64_t t = 0; t < s->n; t++) {
        int64_t label = w->labels[t];
        sum += label < 0 ? w->none[t] : w->scores[(w->known ? 0 : label) * s->n + t];
        if (w->press[t] != 1.0 && s->trust[t] != 0.0) level += s->trust[t] * log(w->press[t]);
    }
    for (int k = 3; k < 8; k++) {
        double away = departure(s, k, pose, gain);
        sum -= 0.5 * away * away * s->precision[k];
    }
    return sum + w->measure + level;
}

/* Normal matrix (11, 11) and right-hand side (11,) of the candidate that was seen last. */
static void linear_system(const TouchData *s, Work *w, const double *pose, const double *gain,
                          double *normal, double *right) {
    int64_t wide = whole_fours(s->n);
    double *rows = w->rows, *weighed = w->rows + ROWS * wide; /* the last row: what is left */
    value_shown(s, w);
    press_shown(s, w, pose, gain);
    for (int64_t t = 0; t < s->n; t++) {
        double unit = s->first / w->press[t], left = s->forces[t] - w->force[t];
        double width = unit * deviation(s, w, t, unit) * w->by_psi[t];
        int pulls = fabs(left / width) < s->far && s->trust[t] != 0.0;
        w->unit[t] = pulls ? s->trust[t] / (width * width) : 0.0;
        rows[UNKNOWNS * wide + t] = pulls ? left : 0.0;
    }
    for (int k = 0; k < UNKNOWNS; k++)
        for (int64_t t = 0; t < s->n; t++) {
            rows[k * wide + t] = w->unit[t] != 0.0 ? rows[k * wide + t] : 0.0;
            weighed[k * wide + t] = rows[k * wide + t] * w->unit[t];
        }
    for (int k = 0; k < UNKNOWNS; k++) {
        const double *one = weighed + k * wide;
        for (int m = k / 4 * 4; m < ROWS; m += 4) { /* four dot products at once, from the left */
            const double *a = rows + m * wide, *b = a + wide, *d = b + wide, *e = d + wide;
            Four sums[4] = {{0}, {0}, {0}, {0}};
            for (int64_t t = 0; t < wide; t += 4) {
                Four at = *(const Four *)(one + t);
                sums[0] += at * *(const Four *)(a + t);
                sums[1] += at * *(const Four *)(b + t);
                sums[2] += at * *(const Four *)(d + t);
                sums[3] += at * *(const Four *)(e + t);
            }
            for (int j = 0; j < 4; j++) {
                double sum = total(sums[j]);
                if (m + j == UNKNOWNS) right[k] = sum;
                else normal[k * UNKNOWNS + m + j] = normal[(m + j) * UNKNOWNS + k] = sum;
            }
        }
    }
    for (int k = 0; k < UNKNOWNS; k++) {
        double away = departure(s, k, pose, gain);
        normal[k * UNKNOWNS + k] += s->precision[k];
        right[k] -= away * s->precision[k];
    }
}

/* See the image as the one lattice does whose cells show what is given. */
static Work see_given(const TouchData *s, const int8_t *given, const int64_t *corner,
                      const double *pose, const double *gain) {
    Work w = new_work(s);
    look_at_gains(s, &w, gain);
    normalize(s, &w, 0, gain);
    w.known = 1;
    find_cells(s, &w, pose);
    read_labels(s, &w, given, corner);
    look_up(s, &w, pose);
    return w;
}

void linearize(const TouchData *s, const int8_t *given, const int64_t *corner, const double *pose,
               const double *gain, int64_t wide, Linearized at) {
    Work w = see_given(s, given, corner, pose, gain);
    const int64_t n = s->n, row = n * sizeof(double);
    value_shown(s, &w);
    press_shown(s, &w, pose, gain);
    for (int f = 0; f < 3; f++) memcpy(at.values + f * wide, w.shown + f * n, row);
    for (int k = 0; k < UNKNOWNS; k++)
        memcpy(at.jacobian + k * wide, w.rows + k * whole_fours(n), row);
    memcpy(at.forces, w.force, row);
    for (int64_t t = 0; t < n; t++) at.unit[t] = w.by_psi[t] / w.press[t];
    free_work(&w);
}

/* The share of the variance of psi that labels (high, wide) from `corner` on explain where they
   stand: what `explained.explained_share` says. */
double explained_share(const TouchData *s, const int8_t *given, const int64_t *corner,
                       const double *pose, const double *gain, double hidden, double above) {
    Work w = see_given(s, given, corner, pose, gain);
    double weight = 0.0, sum = 0.0, whole = 0.0, left = 0.0, alone = 0.0;
    for (int64_t t = 0; t < s->n; t++) { /* no symbol explains the noise of readings */
        double noise = 3.0 / LOG4 * exp(-LOG4 * w.value[t]) * (s->noise / w.plateau[t]);
        double share = noise / (s->quiet * s->first);
        double trust = w.labels[t] < 0 ? 0.0 : s->trust[t] * (s->falls ? w.contact[t] : 1.0);
        w.unit[t] = trust / (1.0 + share * share);
        weight += w.unit[t];
        sum += w.unit[t] * w.psi[t];
        alone += w.unit[t] * (w.value[t] > s->grazed ? 1.0 : above) * noise * noise;
    }
    for (int64_t t = 0; t < s->n; t++) {
        double away = w.psi[t] - sum / larger(weight, 1e-12), off = w.psi[t] - w.value[t];
        whole += w.unit[t] * away * away;
        left += w.unit[t] * off * off;
    }
    free_work(&w);
    alone = smaller(smaller(alone, hidden * whole), left);
    return 1.0 - (left - alone) / larger(whole - alone, 1e-12);
}

/* The lattice a damped step further. */
static void move(const TouchData *s, const double *normal, const double *right, double damping,
                 const double *pose, const double *gain, double *to_pose, double *to_gain) {
    double A[UNKNOWNS][UNKNOWNS], step[UNKNOWNS];
    memcpy(A, normal, sizeof A);
    memcpy(step, right, sizeof step);
    for (int k = 0; k < UNKNOWNS; k++) A[k][k] += A[k][k] * damping + s->least[k];
    solve(UNKNOWNS, A, step);
    for (int k = 0; k < UNKNOWNS; k++) step[k] = bounded(step[k], -s->largest[k], s->largest[k]);
    take_step(s, step, pose, gain, to_pose, to_gain);
}

/* Move candidates by damped steps, `steps` at most; pose and gain (b, 7), (b, 4) are where they begin
   and end. Normal matrices and right-hand sides are worked out where a step begins, and in the end
   if `told`. */
void refine(const TouchData *s, int64_t steps, int64_t told, const int8_t *given, const int64_t *corner,
            double *pose, double *gain, double *value, double *normal, double *right) {
    const int64_t square = UNKNOWNS * UNKNOWNS;
    Work w = new_work(s);
    Shown shown = {given, corner};
    double *damping = malloc(s->b * (2 + 7 + 4) * sizeof(double)), *tried = damping + s->b;
    double *to_pose = tried + s->b, *to_gain = to_pose + 7 * s->b;
    look_at_gains(s, &w, gain);
    for (int64_t i = 0; i < s->b; i++) {
        const double *g = gain + 4 * i;
        if (i == 0 || memcmp(g, g - 4, 4 * sizeof(double)) || s->falls > 1) normalize(s, &w, i, g);
        value[i] = explain(s, &w, shown, i, pose + 7 * i, g);
        if (told || steps)
            linear_system(s, &w, pose + 7 * i, g, normal + i * square, right + i * UNKNOWNS);
        damping[i] = s->damping;
    }
    for (int64_t step = 0, done = 0; step < steps && !done; step++) {
        for (int64_t i = 0; i < s->b; i++)
            move(s, normal + i * square, right + i * UNKNOWNS, damping[i], pose + 7 * i,
                 gain + 4 * i, to_pose + 7 * i, to_gain + 4 * i);
        look_at_gains(s, &w, to_gain);
        done = 1;
        for (int64_t i = 0; i < s->b; i++) {
            const double *p = to_pose + 7 * i, *g = to_gain + 4 * i;
            normalize(s, &w, i, g);
            tried[i] = explain(s, &w, shown, i, p, g);
            if (!(fabs(tried[i] - value[i]) < s->settled)) done = 0;
            if (!(tried[i] > value[i])) {
                damping[i] = smaller(damping[i] * s->harder, 1e6);
                continue;
            }
            damping[i] /= s->easier;
            value[i] = tried[i];
            memcpy(pose + 7 * i, p, 7 * sizeof(double));
            memcpy(gain + 4 * i, g, 4 * sizeof(double));
            if (told || step + 1 < steps)
                linear_system(s, &w, p, g, normal + i * square, right + i * UNKNOWNS);
        }
    }
    free(damping);
    free_work(&w);
}

/* Sums over the cells of one candidate, columns and then rows rising: names (m, 2), scores
   (m, q + 1), tactels that look at them by how hard they press (m,). Returns m. */
static int64_t sum_cells(const TouchData *s, const Work *w, int64_t *names, double *scores,
                         double *seen) {
    int64_t known = 0, wide = s->q + 1;
    for (int64_t t = 0; t < s->n; t++) {
        const int64_t *cell = w->cells + 2 * t;
        int64_t k = 0;
        while (k < known && (names[2 * k] < cell[0] ||
                             (names[2 * k] == cell[0] && names[2 * k + 1] < cell[1]))) k++;
        if (k == known || names[2 * k] != cell[0] || names[2 * k + 1] != cell[1]) {
            int64_t later = known++ - k;
            memmove(names + 2 * (k + 1), names + 2 * k, 2 * later * sizeof(int64_t));
            memmove(scores + wide * (k + 1), scores + wide * k, wide * later * sizeof(double));
            memmove(seen + k + 1, seen + k, later * sizeof(double));
            memcpy(names + 2 * k, cell, 2 * sizeof(int64_t));
            memset(scores + wide * k, 0, wide * sizeof(double));
            seen[k] = 0.0;
        }
        for (int64_t c = 0; c < s->q; c++) scores[wide * k + c] += w->scores[c * s->n + t];
        scores[wide * k + s->q] += w->none[t];
        seen[k] += w->press[t] * s->trust[t];
    }
    return known;
}

/* What `fit.score_cells` needs of candidates of which `best` is the likeliest. Out: count (b,) of
   cells, names (b, n, 2), scores (b, n, q + 1), seen (b, n), level (b,), left (b, n) residuals.
   Returns the noise, `least` or more. */
double score_cells(const TouchData *s, int64_t best, double least, double *pose, double *gain,
                   int64_t *count, int64_t *names, double *scores, double *seen, double *level,
                   double *left) {
    Work w = new_work(s);
    double whole = 0.0, sum = 0.0, noise = 0.0;
    look_at_gains(s, &w, gain);
    for (int64_t k = 0; k < s->b; k++) { /* the likeliest first: it tells the noise */
        int64_t i = k == 0 ? best : k <= best ? k - 1 : k;
        normalize(s, &w, i, gain + 4 * i);
        find_cells(s, &w, pose + 7 * i);
        look_up(s, &w, pose + 7 * i);
        score(s, &w, s->first);
        choose(s, &w);
        value_shown(s, &w);
        level[i] = w.measure;
        for (int64_t t = 0; t < s->n; t++) {
            double press = w.press[t], away = (w.psi[t] - w.shown[t]) * press;
            left[i * s->n + t] = away / deviation(s, &w, t, s->first / press);
            level[i] += s->trust[t] * log(press);
        }
        for (int64_t t = 0; t < s->n && k == 0; t++) {
            double away = smaller(fabs(left[best * s->n + t]), s->far * s->first);
            sum += s->trust[t] * (away * away);
            whole += s->trust[t];
        }
        if (k == 0) noise = larger(least, sqrt(sum / whole));
        score(s, &w, noise);
        count[i] = sum_cells(s, &w, names + 2 * i * s->n, scores + i * s->n * (s->q + 1),
                             seen + i * s->n);
    }
    free_work(&w);
    return noise;
}
