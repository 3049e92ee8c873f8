/* The image under b candidate lattices: log-likelihood, normal matrix and right-hand side of each.

   What `refine.linearize_image` works out with numpy, one candidate and one tactel after the other
   and without the arrays between; single precision stands where numpy has it. Names, units and
   frames are those of `gain.normalize_image`, `projection`, `noise` and `refine`, which are the
   reference. Arrays are C-contiguous. Compile without contraction of products and sums. */

#include <math.h>
#include <stdint.h>
#include <string.h>

/* Which text this was made of; `compiled.load_kernels` leaves out what is older. */
uint32_t source_sum(void) { return SOURCE_SUM; }

enum { UNKNOWNS = 11, FIELDS = 6 };

typedef struct {
    int64_t b, n, q, size;      /* candidates, tactels, symbols, grid points along a side */
    int64_t hardens, falls;     /* of the overlay; rows of `falls`, 0 for a flat face */
    double symbol, deepest;     /* Pressing */
    double pitch, half, step;   /* ResponseTemplate, mm */
    double noise;               /* of the readings */
    double least_gain, full_press, least_press;         /* GainSettings */
    double quiet, displaced, loud, most, first, far;    /* NoiseSettings */
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

static void normalize(const Scene *s, const double *forces, const double *trust,
                      const double *plane, const uint8_t *loaded, const double *falls,
                      const double *gain, double *felt, double *measure, int *any_bare,
                      int *is_loud) {
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
            if (s->falls) d -= falls[(s->falls > 1 ? i : 0) * s->n + t];
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
            sum += trust[t] * log(plateau[t] + 3.0 * forces[t]);
            if (bare[t] != 0.0) *any_bare = 1;
            if (s->noise / plateau[t] >= s->loud) *is_loud = 1;
        }
        measure[i] = -sum;
    }
}

/* Column and upward row of the cell under each tactel (b, n, 2); offsets from its centre, mm. */
void cells_under(const Scene *s, const double *points, const double *pose, int64_t *cells,
                 double *offsets) {
    for (int64_t i = 0; i < s->b; i++) {
        const double *at = pose + 7 * i;
        double c = cos(at[2]) * (1 + at[6]), n = sin(at[2]) * (1 + at[6]);
        for (int64_t t = 0; t < s->n; t++) {
            double x = points[2 * t], y = points[2 * t + 1];
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

/* tables (n, q, 6) of one candidate, for what is fitted of form and gain */
static void look_up(const Scene *s, const float *rimmed, const double *offsets, const double *pose,
                    const double *bare, const double *contact, int any_bare, float *tables) {
    const float form[3] = {(float)pose[3], (float)pose[4], (float)pose[5]};
    const float log4 = (float)LOG4;
    for (int64_t t = 0; t < s->n; t++) {
        int64_t place = grid(s, offsets[2 * t + 1]) * (s->size + 2) + grid(s, offsets[2 * t]);
        const float *from = rimmed + place * s->q * FIELDS;
        float *to = tables + t * s->q * FIELDS, hold = (float)contact[t], face = (float)bare[t];
        for (int64_t k = 0; k < s->q; k++, from += FIELDS, to += FIELDS) {
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

/* scores (n, q + 1) of one candidate: each symbol at each tactel, and none */
static void score(const Scene *s, const double *trust, const double *p, const double *press,
                  const double *bare, const double *plateau, const float *tables, int is_loud,
                  double *scores) {
    const float quiet = (float)(s->quiet * s->quiet), aside = (float)(s->displaced * s->displaced);
    for (int64_t t = 0; t < s->n; t++) {
        double unit = s->first / larger(press[t], 1e-3), faint = s->noise / plateau[t];
        double *to = scores + t * (s->q + 1);
        for (int64_t k = 0; k < s->q; k++) {
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

/* How many doubles `evaluate` works in. */
int64_t work_size(const Scene *s) {
    return s->b * s->n * 10 + s->b + s->n * (3 * s->q + 2 * (s->q + 1)) + 2 * s->n +
           2 * s->b * s->n;
}

/* given: (b, n) labels that cells show, or NULL; known (b, 11), precision (11,) of unknowns.
   Out: value (b,), normal (b, 11, 11), right (b, 11). */
void evaluate(const Scene *s, const double *points, const double *forces, const double *trust,
              const double *plane, const uint8_t *loaded, const double *falls,
              const float *rimmed, const double *pose, const double *gain, const int64_t *given,
              const double *known, const double *precision, double *work, double *value,
              double *normal, double *right) {
    double *felt = work, *measure = felt + 8 * s->b * s->n, *offsets = measure + s->b;
    int64_t *cells = (int64_t *)(offsets + 2 * s->b * s->n);
    double *scores = (double *)(cells + 2 * s->b * s->n), *sums = scores + s->n * (s->q + 1);
    int64_t *first = (int64_t *)(sums + s->n * (s->q + 1)), *labels = first + s->n;
    float *tables = (float *)(labels + s->n);
    int any_bare, is_loud;
    normalize(s, forces, trust, plane, loaded, falls, gain, felt, measure, &any_bare, &is_loud);
    cells_under(s, points, pose, cells, offsets);
    for (int64_t i = 0; i < s->b; i++) {
        const double *p = FELT(0), *press = FELT(1), *bare = FELT(2), *contact = FELT(3);
        const double *depth = FELT(4), *plain = FELT(5), *lower = FELT(6), *plateau = FELT(7);
        const double *at = pose + 7 * i, *away = known + UNKNOWNS * i;
        const int64_t *under = cells + 2 * i * s->n, *shown = labels;
        look_up(s, rimmed, offsets + 2 * i * s->n, at, bare, contact, any_bare, tables);
        score(s, trust, p, press, bare, plateau, tables, is_loud, scores);
        if (given) shown = given + i * s->n;
        else choose(s, under, scores, sums, first, labels);
        double c = cos(at[2]), n = sin(at[2]), scale = exp(gain[4 * i]), level = 0.0, sum = 0.0;
        double N[UNKNOWNS][UNKNOWNS], r[UNKNOWNS];
        memset(N, 0, sizeof N);
        memset(r, 0, sizeof r);
        for (int64_t t = 0; t < s->n; t++) {
            int64_t label = shown[t];
            sum += scores[t * (s->q + 1) + (label < 0 ? s->q : label)];
            if (press[t] != 1.0) level += trust[t] * log(press[t]);
            double v[FIELDS] = {0};
            if (label >= 0) {
                const float *from = tables + (t * s->q + label) * FIELDS;
                for (int f = 0; f < FIELDS; f++) v[f] = from[f];
            } else {
                double floor_ = psi(bare[t]);
                if (p[t] > floor_ / 2) v[0] = floor_;
            }
            double total = expm1(v[0] * (double)(float)LOG4) / 3.0;
            double by = (1 + 3.0 * total) * LOG4 / 3.0 * plateau[t];
            double unit = s->first / press[t];
            double square = s->quiet * s->quiet + v[0] * v[0] +
                            s->displaced * s->displaced * (v[1] * v[1] + v[2] * v[2]);
            if (is_loud)
                square += readings(3.0 / LOG4 * exp(-LOG4 * v[0]), s->noise / plateau[t], unit);
            double wide = unit * (double)(float)sqrt(square) * by;
            double symbol = smaller(larger((total - bare[t]) / larger(1 - bare[t], 1e-3), 0.0), 1.5);
            double rest = total > 0 ? 1 - symbol : 0.0;
            double force = scale * (symbol * plain[t] + rest * lower[t]);
            double left = forces[t] - force;
            if (!(fabs(left / wide) < s->far) || trust[t] == 0.0) continue;
            double slope = scale * (symbol * slope_of(s, depth[t]) +
                                    rest * slope_of(s, depth[t] - s->symbol));
            double x = points[2 * t], y = points[2 * t + 1];
            double across = c * x - n * y, up = n * x + c * y, sure = trust[t] / (wide * wide);
            double J[UNKNOWNS] = {
                v[1] * by, v[2] * by, (v[2] * across - v[1] * up) * by, v[3] * by, v[4] * by,
                v[5] * by, (v[1] * across + v[2] * up) * by, force, slope * plane[3 * t],
                slope * plane[3 * t + 1], slope * plane[3 * t + 2]};
            for (int k = 0; k < UNKNOWNS; k++) {
                double weighed = J[k] * sure;
                r[k] += weighed * left;
                for (int m = 0; m < UNKNOWNS; m++) N[k][m] += weighed * J[m];
            }
        }
        for (int k = 0; k < UNKNOWNS; k++) {
            N[k][k] += precision[k];
            r[k] -= away[k] * precision[k];
            sum -= 0.5 * away[k] * away[k] * precision[k];
        }
        value[i] = sum + measure[i] + level;
        memcpy(normal + i * UNKNOWNS * UNKNOWNS, N, sizeof N);
        memcpy(right + i * UNKNOWNS, r, sizeof r);
    }
}
