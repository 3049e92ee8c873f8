"""Polynomials over GF(q) and unique windows, the slow and plain way: labels, x^0 first."""

import numpy as np

from generator.array.polynomial import known_polynomials


def mulmod(field, a, b, h):
    """Return a b modulo the monic polynomial h of degree n, n labels."""
    degree = len(h) - 1
    result = [0] * max(len(a) + len(b), degree)

    def add(at, label):
        result[at] = int(field.addition[result[at], label])

    for i, x in enumerate(a):
        for j, y in enumerate(b):
            add(i + j, field.multiplication[x, y])
    for top in range(len(result) - 1, degree - 1, -1):
        factor = field.negative[result[top]]
        for k in range(degree + 1):
            add(top - degree + k, field.multiplication[factor, h[k]])
    return tuple(result[:degree])


def powmod(field, a, exponent, h):
    """Return a^exponent modulo h."""
    result = mulmod(field, (1,), (1,), h)
    for bit in bin(exponent)[2:]:
        result = mulmod(field, result, result, h)
        if bit == "1":
            result = mulmod(field, result, a, h)
    return result


def on_file(order, degree, source):
    """Return the polynomial of one source, as labels."""
    (found,) = {
        p.labels
        for p in known_polynomials()
        if (p.order, p.degree, p.source) == (order, degree, source)
    }
    return found


def windows_are_unique(array, window):
    """Compare every window with every other one; the rank test says the same."""
    a, b = window
    grid = array.symbols(np.arange(array.rows)[:, None], np.arange(array.columns))
    small = np.pad(grid, ((0, a - 1), (0, b - 1)), mode="wrap").astype("u2")
    seen = np.lib.stride_tricks.sliding_window_view(small, window)
    flat = np.ascontiguousarray(seen.reshape(-1, a * b)).view(f"V{2 * a * b}").ravel()
    return np.unique(flat).size == flat.size
