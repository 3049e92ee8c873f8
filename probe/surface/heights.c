/* The highest triangle over points: mesh.py, which is the reference, to the bit. */

#include <math.h>
#include <stdint.h>

uint32_t source_sum(void) { return SOURCE_SUM; } /* which text this was made of */

enum { FIELDS = 13 }; /* corners a and b, edges ab, bc and ac (x, y each), heights of a, b and c */

/* Twice the signed area of an edge and a point, seen from where the edge begins. */
static inline double area(const double *edge, double x, double y) {
    return edge[0] * y - edge[1] * x;
}

/* heights (n,) over points (n, 2) from the triangles (m, FIELDS) that their bins list; -INFINITY
   beside all. Bins: columns x rows of a side from (low_x, low_y). */
void look_up_heights(int64_t n, const double *points, double low_x, double low_y, double side,
                     int64_t columns, int64_t rows, const int64_t *starts, const int64_t *listed,
                     const uint8_t *level, const double *triangles, double top, double *heights) {
    for (int64_t p = 0; p < n; p++) {
        double x = points[2 * p], y = points[2 * p + 1], highest = -INFINITY;
        double i = (x - low_x) / side, j = (y - low_y) / side;
        if (i >= 0 && i <= columns && j >= 0 && j <= rows) {
            int64_t column = (int64_t)i, row = (int64_t)j;
            if (column == columns) column--;
            if (row == rows) row--;
            int64_t bin = column * rows + row;
            if (level[bin]) highest = 0.0;
            for (int64_t k = starts[bin]; k < starts[bin + 1]; k++) {
                const double *t = triangles + FIELDS * listed[k];
                double ab = area(t + 4, x - t[0], y - t[1]);
                double bc = area(t + 6, x - t[2], y - t[3]);
                double ac = area(t + 8, x - t[0], y - t[1]);
                if (!((ab >= 0 && bc >= 0 && ac <= 0) || (ab <= 0 && bc <= 0 && ac >= 0))) continue;
                double weight = ab + bc - ac;
                if (weight == 0) continue;
                double z = (ab * t[12] + bc * t[10] - ac * t[11]) / weight;
                if (z > highest) highest = z;
            }
        }
        heights[p] = highest < top ? highest : top;
    }
}
