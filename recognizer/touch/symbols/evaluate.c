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

enum { UNKNOWNS = 11, FIELDS = 6 };

typedef struct {
    int64_t b, n, q, size;      /* candidates, tactels, symbols, grid points along a side */
    int64_t hardens, falls;     /* of the overlay; rows of `falls`, 0 for a flat face */
    int64_t high, wide;         /* of the tables of labels */
    double symbol, deepest;     /* Pressing */
    double pitch, half, step;   /* ResponseTemplate, mm */
    double noise;               /* of the readings */
    double least_gain, full_press, least_press, steepest;       /* GainSettings */
    double quiet, displaced, loud, most, first, far;            /* NoiseSettings */
    double damping, easier, harder, settled, shallower, deepest_gain; /* RefineSettings */
    double least[UNKNOWNS], largest[UNKNOWNS], limits[4];
    double precision[UNKNOWNS], usual_scale;    /* what is known beforehand; log of the scale */
    const double *points, *forces, *trust, *plane;  /* Image: (n, 2), (n,), (n,), (n, 3) */
    const uint8_t *loaded;      /* (n,) */
    const double *drop;         /* (falls, n), or NULL */
    const float *rimmed;        /* ResponseTemplate, (size + 2, size + 2, q, 6) */
} Scene;

static inline double larger(double a, double b) { return a > b ? a : b; }
static inline double smaller(double a, double b) { return a < b ? a : b; }

static const double LOG4 = 1.3862943611198906; /* log(1 + 3) */

static double stiffness(double u) { double w = 1.0 - u; return 2.0 / (w * w * w) + 1.0; }

static double force_of(const Scene *s, double depth) {
    if (!s->hardens) return 3.0 * larger(depth, 0.0);
    double u = smaller(larger(depth, 0.0), s->deepest), w = 1.0 - u;
    double beyond = larger(depth - s->deepest, 0.0) * stiffness(s->deepest);
    return 1.0 / (w * w) - w + beyond;
}

static double slope_of(const Scene *s, double depth) {
    if (!(depth > 0)) return 0.0;
    return s->hardens ? stiffness(smaller(depth, s->deepest)) : 3.0;
}

static double psi(double y) { return y > 0.0 ? log1p(3.0 * y) / LOG4 : 0.0; }

/* felt: (8, b, n) psi, press, bare, contact, depth, plain, lower, plateau */
#define FELT(k) (felt + ((k) * s->b + i) * s->n)

static void normalize(const Scene *s, const double *gain, double *felt, double *measure,
                      int *any_bare, int *is_loud) {
    const double *forces = s->forces, *plane = s->plane;
    const uint8_t *loaded = s->loaded;
    double strongest = -INFINITY, mean[3] = {0}, count = 0.0;
    for (int64_t t = 0; t < s->n; t++) {
        strongest = larger(strongest, forces[t]);
        if (!loaded[t]) continue;
        count += 1.0;
        for (int k = 0; k < 3; k++) mean[k] += plane[3 * t + k];
    }
    *any_bare = *is_loud = 0;
    for (int64_t i = 0; i < s->b; i++) {
        const double *g = gain + 4 * i;
        double *p = FELT(0), *press = FELT(1), *bare = FELT(2), *contact = FELT(3);
        double *depth = FELT(4), *plain = FELT(5), *lower = FELT(6), *plateau = FELT(7);
        double most = 0.0, sum = 0.0, scale = exp(g[0]);
        double usual = (g[1] * mean[0] + g[2] * mean[1] + g[3] * mean[2]) / count;
        double full = s->full_press * larger(usual, 1e-9);
        for (int64_t t = 0; t < s->n; t++) {
            double d = g[1] * plane[3 * t] + g[2] * plane[3 * t + 1] + g[3] * plane[3 * t + 2];
            if (s->falls) d -= s->drop[(s->falls > 1 ? i : 0) * s->n + t];
            depth[t] = d;
            plain[t] = force_of(s, d);
            lower[t] = force_of(s, d - s->symbol);
            if (loaded[t]) most = larger(most, plain[t]);
        }
        double least = s->least_gain * most;
        for (int64_t t = 0; t < s->n; t++) {
            plateau[t] = loaded[t] ? scale * larger(plain[t], least) : strongest;
            p[t] = psi(forces[t] / plateau[t]);
            press[t] = smaller(larger(depth[t] / full, s->least_press), 1.0);
            bare[t] = loaded[t] ? lower[t] / (plateau[t] / scale) : 0.0;
            contact[t] = smaller(larger(plain[t] / least, 0.0), 1.0);
            sum += s->trust[t] * log(plateau[t] + 3.0 * forces[t]);
            if (bare[t] != 0.0) *any_bare = 1;
            if (s->noise / plateau[t] >= s->loud) *is_loud = 1;
        }
        measure[i] = -sum;
    }
}

/* Column and upward row of the cell under each tactel (b, n, 2); offsets from its centre, mm. */
static void cells_under(const Scene *s, const double *pose, int64_t *cells, double *offsets) {
    for (int64_t i = 0; i < s->b; i++) {
        const double *at = pose + 7 * i;
        double c = cos(at[2]) * (1 + at[6]), n = sin(at[2]) * (1 + at[6]);
        for (int64_t t = 0; t < s->n; t++) {
            double x = s->points[2 * t], y = s->points[2 * t + 1];
            double u[2] = {at[0] + c * x - n * y, at[1] + n * x + c * y};
            for (int k = 0; k < 2; k++) {
                double cell = floor(u[k] / s->pitch);
                cells[2 * (i * s->n + t) + k] = (int64_t)cell;
                offsets[2 * (i * s->n + t) + k] = u[k] - (cell + 0.5) * s->pitch;
            }
        }
    }
}

/* What the noise of readings adds to the square of a spread; value in the precision given. */
static double readings(double by_response, double faint, double unit) {
    double share = by_response * faint / unit;
    return share * share;
}

static int64_t grid(const Scene *s, double offset) {
    double at = rint((offset + s->half) / s->step);
    return (int64_t)smaller(larger(at, -1.0), (double)s->size) + 1;
}

/* tables (n, q, 6) of one candidate, for what is fitted of form and gain; shown: the label of each
   tactel, where nothing else is asked for, or NULL */
static void look_up(const Scene *s, const double *offsets, const double *pose, const double *bare,
                    const double *contact, int any_bare, const int64_t *shown, float *tables) {
    const float form[3] = {(float)pose[3], (float)pose[4], (float)pose[5]};
    const float log4 = (float)LOG4;
    for (int64_t t = 0; t < s->n; t++) {
        int64_t place = grid(s, offsets[2 * t + 1]) * (s->size + 2) + grid(s, offsets[2 * t]);
        const float *from = s->rimmed + place * s->q * FIELDS;
        float *to = tables + t * s->q * FIELDS, hold = (float)contact[t], face = (float)bare[t];
        for (int64_t k = 0; k < s->q; k++, from += FIELDS, to += FIELDS) {
            if (shown && shown[t] != k) continue;
            memcpy(to, from, FIELDS * sizeof(float));
            for (int f = 0; f < 3; f++) to[0] += to[3 + f] * form[f];
            if (hold < 1.0f)
                for (int f = 0; f < FIELDS; f++) to[f] *= hold;
            if (any_bare && face == 0.0f) {
                to[0] = to[0] > 0.0f ? to[0] : 0.0f;
            } else if (any_bare) {
                float response = expm1f(to[0] * log4) / 3.0f;
                float total = response + (1.0f - response) * face;
                float by = (1.0f - face) * (1.0f + 3.0f * response) / (1.0f + 3.0f * total);
                for (int f = 1; f < FIELDS; f++) to[f] *= by;
                to[0] = log1pf(3.0f * (total > 0.0f ? total : 0.0f)) / log4;
            }
        }
    }
}

/* scores (n, q + 1) of one candidate: each symbol at each tactel, and none; or what is shown alone.
   noise: deviation of psi on a covered tactel */
static void score(const Scene *s, double noise, const double *p, const double *press,
                  const double *bare, const double *plateau, const float *tables, int is_loud,
                  const int64_t *shown, double *scores) {
    const double *trust = s->trust;
    const float quiet = (float)(s->quiet * s->quiet), aside = (float)(s->displaced * s->displaced);
    for (int64_t t = 0; t < s->n; t++) {
        double unit = noise / larger(press[t], 1e-3), faint = s->noise / plateau[t];
        double *to = scores + t * (s->q + 1);
        for (int64_t k = 0; k < s->q; k++) {
            if (shown && shown[t] != k) continue;
            const float *at = tables + (t * s->q + k) * FIELDS;
            float square = quiet + at[0] * at[0] + aside * (at[1] * at[1] + at[2] * at[2]), wide;
            if (is_loud) {
                float by = (float)(3.0 / LOG4) * expf((float)-LOG4 * at[0]);
                wide = (float)sqrt(square + readings(by, faint, unit));
            } else {
                wide = sqrtf(square);
            }
            double away = (p[t] - at[0]) / (unit * wide);
            to[k] = trust[t] * (-smaller(0.5 * away * away, s->most) - logf(wide));
        }
        if (shown && shown[t] >= 0) continue;
        double floor_ = psi(bare[t]), best = -INFINITY;
        for (int k = 0; k < (floor_ > 0.0 ? 2 : 1); k++) { /* beyond the edge of the face, or not */
            double value = k ? floor_ : 0.0, square = s->quiet * s->quiet + value * value;
            if (is_loud) square += readings(3.0 / LOG4 * exp(-LOG4 * value), faint, unit);
            double wide = sqrt(square), away = (p[t] - value) / (unit * wide);
            best = larger(best, trust[t] * (-smaller(0.5 * away * away, s->most) - log(wide)));
        }
        to[s->q] = best;
    }
}

/* labels (n,) of what fits best in the cell under each tactel, -1: no symbol. sums: room for
   (n, q + 1); first: room for n. Cells are few, so each is looked for among those before it. */
static void choose(const Scene *s, const int64_t *cells, const double *scores, double *sums,
                   int64_t *first, int64_t *labels) {
    int64_t known = 0, wide = s->q + 1;
    for (int64_t t = 0; t < s->n; t++) {
        int64_t k = 0;
        while (k < known && (cells[2 * first[k]] != cells[2 * t] ||
                             cells[2 * first[k] + 1] != cells[2 * t + 1])) k++;
        if (k == known) {
            first[known++] = t;
            memset(sums + k * wide, 0, wide * sizeof(double));
        }
        for (int64_t c = 0; c < wide; c++) sums[k * wide + c] += scores[t * wide + c];
        labels[t] = k;
    }
    for (int64_t t = 0; t < s->n; t++) {
        const double *sum = sums + labels[t] * wide;
        int64_t best = 0;
        for (int64_t c = 1; c < wide; c++) if (sum[c] > sum[best]) best = c;
        labels[t] = best == s->q ? -1 : best;
    }
}

/* What one candidate needs beside `felt`. */
typedef struct {
    double *felt, *measure, *offsets, *scores, *sums;
    int64_t *cells, *first, *labels;
    float *tables;
    int any_bare, is_loud;
} Work;

static Work new_work(const Scene *s) {
    Work w = {0};
    int64_t bn = s->b * s->n, nq = s->n * (s->q + 1);
    w.felt = malloc((8 * bn + s->b + 2 * bn + 2 * nq) * sizeof(double));
    w.measure = w.felt + 8 * bn;
    w.offsets = w.measure + s->b;
    w.scores = w.offsets + 2 * bn;
    w.sums = w.scores + nq;
    w.cells = malloc((2 * bn + 2 * s->n) * sizeof(int64_t));
    w.first = w.cells + 2 * bn;
    w.labels = w.first + s->n;
    w.tables = malloc(s->n * s->q * FIELDS * sizeof(float));
    return w;
}

static void free_work(Work *w) {
    free(w->felt);
    free(w->cells);
    free(w->tables);
}

/* psi and slopes of what is shown at a tactel, of the bare face where that is nothing. */
static void value_of(const Scene *s, const float *tables, int64_t t, int64_t label, double p,
                     double bare, double v[FIELDS]) {
    memset(v, 0, FIELDS * sizeof(double));
    if (label >= 0) {
        const float *from = tables + (t * s->q + label) * FIELDS;
        for (int f = 0; f < FIELDS; f++) v[f] = from[f];
    } else {
        double floor_ = psi(bare);
        if (p > floor_ / 2) v[0] = floor_;
    }
}

/* Spread of psi about it, in units of the noise. */
static double deviation(const Scene *s, const double v[FIELDS], double faint, double unit,
                        int is_loud) {
    double square = s->quiet * s->quiet + v[0] * v[0] +
                    s->displaced * s->displaced * (v[1] * v[1] + v[2] * v[2]);
    if (is_loud) square += readings(3.0 / LOG4 * exp(-LOG4 * v[0]), faint, unit);
    return (double)(float)sqrt(square);
}

/* A tactel under a gain, as `normalize` has it. */
typedef struct { double bare, depth, plain, lower, plateau; } Felt;

/* The force at a tactel that shows v, and what changes with pose and gain; c, n: cosine and sine of
   the pose, scale: of the force, by: out, of psi there. */
static inline double force_at(const Scene *s, int64_t t, const double v[FIELDS], Felt f, double c,
                              double n, double scale, double *by_psi, double J[UNKNOWNS]) {
    double total = expm1(v[0] * (double)(float)LOG4) / 3.0;
    double by = (1 + 3.0 * total) * LOG4 / 3.0 * f.plateau;
    double symbol = smaller(larger((total - f.bare) / larger(1 - f.bare, 1e-3), 0.0), 1.5);
    double rest = total > 0 ? 1 - symbol : 0.0;
    double force = scale * (symbol * f.plain + rest * f.lower);
    double slope = scale * (symbol * slope_of(s, f.depth) + rest * slope_of(s, f.depth - s->symbol));
    double x = s->points[2 * t], y = s->points[2 * t + 1];
    double across = c * x - n * y, up = n * x + c * y;
    const double *plane = s->plane + 3 * t;
    const double by_each[UNKNOWNS] = {
        v[1] * by, v[2] * by, (v[2] * across - v[1] * up) * by, v[3] * by, v[4] * by, v[5] * by,
        (v[1] * across + v[2] * up) * by, force, slope * plane[0], slope * plane[1],
        slope * plane[2]};
    memcpy(J, by_each, sizeof by_each);
    *by_psi = by;
    return force;
}

/* Labels (n,) of what cells show, -1 beyond the table. */
static void read_labels(const Scene *s, const int8_t *given, const int64_t *corner,
                        const int64_t *cells, int64_t *labels) {
    for (int64_t t = 0; t < s->n; t++) {
        int64_t x = cells[2 * t] - corner[0], y = cells[2 * t + 1] - corner[1];
        int inside = x >= 0 && x < s->wide && y >= 0 && y < s->high;
        labels[t] = inside ? given[y * s->wide + x] : -1;
    }
}

/* Candidates somewhere: pose (b, 7), gain (b, 4), value (b,), normal (b, 11, 11), right (b, 11). */
typedef struct { double *pose, *gain, *value, *normal, *right; } Lattices;

/* given: (b, high, wide) labels of cells from `corner` (b, 2) on, or NULL. */
static void evaluate(const Scene *s, const int8_t *given, const int64_t *corner, Work *w,
                     Lattices at) {
    normalize(s, at.gain, w->felt, w->measure, &w->any_bare, &w->is_loud);
    cells_under(s, at.pose, w->cells, w->offsets);
    double *felt = w->felt;
    for (int64_t i = 0; i < s->b; i++) {
        const double *p = FELT(0), *press = FELT(1), *bare = FELT(2), *contact = FELT(3);
        const double *depth = FELT(4), *plain = FELT(5), *lower = FELT(6), *plateau = FELT(7);
        const double *pose = at.pose + 7 * i, *gain = at.gain + 4 * i;
        const int64_t *under = w->cells + 2 * i * s->n;
        const float *tables = w->tables;
        const int64_t *shown = given ? w->labels : NULL;
        if (given) read_labels(s, given + i * s->high * s->wide, corner + 2 * i, under, w->labels);
        look_up(s, w->offsets + 2 * i * s->n, pose, bare, contact, w->any_bare, shown, w->tables);
        score(s, s->first, p, press, bare, plateau, tables, w->is_loud, shown, w->scores);
        if (!given) choose(s, under, w->scores, w->sums, w->first, w->labels);
        double c = cos(pose[2]), n = sin(pose[2]), scale = exp(gain[0]), level = 0.0, sum = 0.0;
        double N[UNKNOWNS][UNKNOWNS], r[UNKNOWNS];
        memset(N, 0, sizeof N);
        memset(r, 0, sizeof r);
        for (int64_t t = 0; t < s->n; t++) {
            int64_t label = w->labels[t];
            sum += w->scores[t * (s->q + 1) + (label < 0 ? s->q : label)];
            if (press[t] != 1.0) level += s->trust[t] * log(press[t]);
            double v[FIELDS], unit = s->first / press[t];
            value_of(s, tables, t, label, p[t], bare[t], v);
            Felt f = {bare[t], depth[t], plain[t], lower[t], plateau[t]};
            double J[UNKNOWNS], by, force = force_at(s, t, v, f, c, n, scale, &by, J);
            double wide = unit * deviation(s, v, s->noise / plateau[t], unit, w->is_loud) * by;
            double left = s->forces[t] - force;
            if (!(fabs(left / wide) < s->far) || s->trust[t] == 0.0) continue;
            double sure = s->trust[t] / (wide * wide);
            for (int k = 0; k < UNKNOWNS; k++) {
                double weighed = J[k] * sure;
                r[k] += weighed * left;
                for (int m = 0; m <= k; m++) N[k][m] += weighed * J[m];
            }
        }
        for (int k = 0; k < UNKNOWNS; k++) {
            double away = k < 3 || k > 7 ? 0.0 : k < 7 ? pose[k] : gain[0] - s->usual_scale;
            for (int m = 0; m < k; m++) N[m][k] = N[k][m];
            N[k][k] += s->precision[k];
            r[k] -= away * s->precision[k];
            sum -= 0.5 * away * away * s->precision[k];
        }
        at.value[i] = sum + w->measure[i] + level;
        memcpy(at.normal + i * UNKNOWNS * UNKNOWNS, N, sizeof N);
        memcpy(at.right + i * UNKNOWNS, r, sizeof r);
    }
}

/* The image about one lattice whose cells show what is given: psi and slopes (n, 6), forces (n,),
   their derivatives (n, 11), and (n,) by how much forces change with psi, where all press fully. */
void linearize(const Scene *s, const int8_t *given, const int64_t *corner, const double *pose,
               const double *gain, double *values, double *forces, double *jacobian,
               double *unit) {
    Work w = new_work(s);
    double *felt = w.felt;
    const int64_t i = 0;
    normalize(s, gain, w.felt, w.measure, &w.any_bare, &w.is_loud);
    cells_under(s, pose, w.cells, w.offsets);
    read_labels(s, given, corner, w.cells, w.labels);
    look_up(s, w.offsets, pose, FELT(2), FELT(3), w.any_bare, w.labels, w.tables);
    double c = cos(pose[2]), n = sin(pose[2]), scale = exp(gain[0]), by;
    for (int64_t t = 0; t < s->n; t++) {
        Felt f = {FELT(2)[t], FELT(4)[t], FELT(5)[t], FELT(6)[t], FELT(7)[t]};
        value_of(s, w.tables, t, w.labels[t], FELT(0)[t], f.bare, values + FIELDS * t);
        forces[t] = force_at(s, t, values + FIELDS * t, f, c, n, scale, &by,
                             jacobian + UNKNOWNS * t);
        unit[t] = by / FELT(1)[t];
    }
    free_work(&w);
}

/* Solve A x = b by elimination with row pivots; both are overwritten. */
static void solve(double A[UNKNOWNS][UNKNOWNS], double b[UNKNOWNS]) {
    for (int k = 0; k < UNKNOWNS; k++) {
        int pivot = k;
        for (int i = k + 1; i < UNKNOWNS; i++) if (fabs(A[i][k]) > fabs(A[pivot][k])) pivot = i;
        for (int j = 0; j < UNKNOWNS && pivot != k; j++) {
            double held = A[k][j];
            A[k][j] = A[pivot][j];
            A[pivot][j] = held;
        }
        double held = b[k];
        b[k] = b[pivot];
        b[pivot] = held;
        for (int i = k + 1; i < UNKNOWNS; i++) {
            double share = A[i][k] / A[k][k];
            for (int j = k + 1; j < UNKNOWNS; j++) A[i][j] -= share * A[k][j];
            b[i] -= share * b[k];
        }
    }
    for (int k = UNKNOWNS - 1; k >= 0; k--) {
        for (int j = k + 1; j < UNKNOWNS; j++) b[k] -= A[k][j] * b[j];
        b[k] /= A[k][k];
    }
}

static double bounded(double value, double least, double most) {
    return smaller(larger(value, least), most);
}

/* The lattice a damped step further. */
static void move(const Scene *s, const double *normal, const double *right, double damping,
                 const double *pose, const double *gain, double *to_pose, double *to_gain) {
    double A[UNKNOWNS][UNKNOWNS], step[UNKNOWNS];
    memcpy(A, normal, sizeof A);
    memcpy(step, right, sizeof step);
    for (int k = 0; k < UNKNOWNS; k++) A[k][k] += A[k][k] * damping + s->least[k];
    solve(A, step);
    for (int k = 0; k < UNKNOWNS; k++) step[k] = bounded(step[k], -s->largest[k], s->largest[k]);
    for (int k = 0; k < 7; k++) to_pose[k] = pose[k] + step[k];
    for (int k = 0; k < 4; k++) {
        to_pose[3 + k] = bounded(to_pose[3 + k], -s->limits[k], s->limits[k]);
        to_gain[k] = gain[k] + step[7 + k];
    }
    to_gain[1] = bounded(to_gain[1], s->shallower * gain[1], s->deepest_gain);
    double slope = fabs(to_gain[2]) + fabs(to_gain[3]), limit = s->steepest * to_gain[1];
    double factor = slope > limit ? limit / larger(slope, 1e-300) : 1.0;
    to_gain[2] *= factor;
    to_gain[3] *= factor;
}

/* Move candidates by damped steps, `steps` at most; pose and gain are where they begin and end. */
void refine(const Scene *s, int64_t steps, const int8_t *given, const int64_t *corner,
            double *pose, double *gain, double *value, double *normal, double *right) {
    const int64_t each[5] = {7, 4, 1, UNKNOWNS * UNKNOWNS, UNKNOWNS};
    Work work = new_work(s);
    Lattices best = {pose, gain, value, normal, right}, tried;
    double *room = malloc(s->b * (7 + 4 + 2 + UNKNOWNS * (UNKNOWNS + 1)) * sizeof(double));
    tried.pose = room;
    tried.gain = tried.pose + 7 * s->b;
    tried.value = tried.gain + 4 * s->b;
    tried.normal = tried.value + s->b;
    tried.right = tried.normal + UNKNOWNS * UNKNOWNS * s->b;
    double *damping = tried.right + UNKNOWNS * s->b;
    double *to[5] = {pose, gain, value, normal, right};
    double *from[5] = {tried.pose, tried.gain, tried.value, tried.normal, tried.right};
    evaluate(s, given, corner, &work, best);
    for (int64_t i = 0; i < s->b; i++) damping[i] = s->damping;
    for (int64_t step = 0, done = 0; step < steps && !done; step++) {
        for (int64_t i = 0; i < s->b; i++)
            move(s, normal + i * UNKNOWNS * UNKNOWNS, right + i * UNKNOWNS, damping[i],
                 pose + 7 * i, gain + 4 * i, tried.pose + 7 * i, tried.gain + 4 * i);
        evaluate(s, given, corner, &work, tried);
        done = 1;
        for (int64_t i = 0; i < s->b; i++) {
            if (!(fabs(tried.value[i] - value[i]) < s->settled)) done = 0;
            if (tried.value[i] > value[i]) {
                damping[i] /= s->easier;
                for (int k = 0; k < 5; k++)
                    memcpy(to[k] + each[k] * i, from[k] + each[k] * i, each[k] * sizeof(double));
            } else {
                damping[i] = smaller(damping[i] * s->harder, 1e6);
            }
        }
    }
    free(room);
    free_work(&work);
}

/* Sums over the cells of one candidate, columns and then rows rising: names (m, 2), scores
   (m, q + 1), tactels that look at them by how hard they press (m,). Returns m. */
static int64_t sum_cells(const Scene *s, const int64_t *cells, const double *each,
                         const double *press, int64_t *names, double *scores, double *seen) {
    int64_t known = 0, wide = s->q + 1;
    for (int64_t t = 0; t < s->n; t++) {
        const int64_t *cell = cells + 2 * t;
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
        for (int64_t c = 0; c < wide; c++) scores[wide * k + c] += each[wide * t + c];
        seen[k] += press[t] * s->trust[t];
    }
    return known;
}

/* What `fit.score_cells` needs of candidates of which `best` is the likeliest. Out: count (b,) of
   cells, names (b, n, 2), scores (b, n, q + 1), seen (b, n), level (b,), left (b, n) residuals.
   Returns the noise, `least` or more. */
double score_cells(const Scene *s, int64_t best, double least, double *pose, double *gain,
                   int64_t *count, int64_t *names, double *scores, double *seen, double *level,
                   double *left) {
    Work w = new_work(s);
    double *felt = w.felt, whole = 0.0, sum = 0.0, noise = 0.0;
    float *all = malloc(s->b * s->n * s->q * FIELDS * sizeof(float));
    normalize(s, gain, w.felt, w.measure, &w.any_bare, &w.is_loud);
    cells_under(s, pose, w.cells, w.offsets);
    for (int64_t i = 0; i < s->b; i++) {
        const double *p = FELT(0), *press = FELT(1), *bare = FELT(2), *plateau = FELT(7);
        float *tables = all + i * s->n * s->q * FIELDS;
        look_up(s, w.offsets + 2 * i * s->n, pose + 7 * i, bare, FELT(3), w.any_bare, NULL, tables);
        score(s, s->first, p, press, bare, plateau, tables, w.is_loud, NULL, w.scores);
        choose(s, w.cells + 2 * i * s->n, w.scores, w.sums, w.first, w.labels);
        level[i] = w.measure[i];
        double pressed = 0.0;
        for (int64_t t = 0; t < s->n; t++) {
            double v[FIELDS], unit = s->first / press[t];
            value_of(s, tables, t, w.labels[t], p[t], bare[t], v);
            left[i * s->n + t] = (p[t] - v[0]) * press[t] /
                                 deviation(s, v, s->noise / plateau[t], unit, w.is_loud);
            pressed += s->trust[t] * log(press[t]);
        }
        level[i] += pressed;
    }
    for (int64_t t = 0; t < s->n; t++) {
        double away = smaller(fabs(left[best * s->n + t]), s->far * s->first);
        sum += s->trust[t] * (away * away);
        whole += s->trust[t];
    }
    noise = larger(least, sqrt(sum / whole));
    for (int64_t i = 0; i < s->b; i++) {
        const double *press = FELT(1);
        const float *tables = all + i * s->n * s->q * FIELDS;
        score(s, noise, FELT(0), press, FELT(2), FELT(7), tables, w.is_loud, NULL, w.scores);
        count[i] = sum_cells(s, w.cells + 2 * i * s->n, w.scores, press, names + 2 * i * s->n,
                             scores + i * s->n * (s->q + 1), seen + i * s->n);
    }
    free(all);
    free_work(&w);
    return noise;
}
