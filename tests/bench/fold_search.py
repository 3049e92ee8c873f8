"""Which fold and which polynomial leave a touch the fewest rivals: the search behind profiles.

    python tests/bench/fold_search.py --degree 8                     # 2 min, all 1,024 classes
    python tests/bench/fold_search.py --degree 9 --polynomials 400
    python tests/bench/fold_search.py --order 8 --degree 5 --sheared

Every polynomial of a degree is a decimation: term t becomes term k t, k prime to the period.
Conjugates and the reversed sequence (p k and -k) show a sensor the same, so one k of each class
is tried. Other directions of the steps, u rows and v columns, are decimations too (k = u modulo
the rows, v modulo the columns), and a factor of q - 1 that may stand in rows or columns changes
nothing: A scales with it. `--sheared` tries folds of which rows and columns need not be coprime:
cell (r, c) shows term a r + b c, and row R is row 0 shifted.

The score is the sum of log(share) over pitches and over identical rivals, rivals within one and
within two symbols, a share below 1e-4 counted as that.
"""

from __future__ import annotations

import argparse
import sys
import time
from math import gcd, log
from pathlib import Path

import numpy as np

from generator.array.field import field_of_order, format_polynomial
from generator.array.fold import folds
from generator.array.polynomial import primitive_polynomial, search_primitive
from generator.array.sequence import Sequence
from generator.array.window import null_space
from generator.errors import ArrayError

sys.path.insert(0, str(Path(__file__).parents[1]))
from reference.rivals import RivalShares, code_shares
from reference.visible import PoseGrid, VisibleSet, visible_sets

PITCHES_MM = (7.0, 6.0, 5.5, 5.0)
SENSOR_HALF_MM = (12.7, 12.7)
SYMBOL_SHARE = 0.36  # of the pitch, from a symbol's centre to the end of its strokes: dense-4
POSES = PoseGrid(places=12, turns=30)
LEAST = 1e-4
GRID = 10  # cells a side that hold every set


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--order", type=int, default=4)
    parser.add_argument("--degree", type=int, required=True)
    parser.add_argument("--polynomials", type=int, default=2000, help="classes tried at most")
    parser.add_argument("--rows", type=int, help="one fold alone")
    parser.add_argument("--least-rows", type=int, default=15)
    parser.add_argument("--sheared", action="store_true", help="rows and columns not coprime")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    sequence = first_sequence(options.order, options.degree)
    rng = np.random.default_rng(options.seed)
    classes = decimations(sequence, options.polynomials, rng)
    sets = {p: visible_sets(p, SENSOR_HALF_MM, SYMBOL_SHARE * p, POSES) for p in PITCHES_MM}
    print(f"{sequence.period} terms, {len(classes)} classes of polynomials tried", flush=True)
    for rows, columns in folds(options.order, options.degree):
        if rows < options.least_rows or options.rows not in (None, rows):
            continue
        row_step = columns * pow(columns, -1, rows)
        column_step = rows * pow(rows, -1, columns)
        steps = [(k * row_step, k * column_step) for k in classes]
        began = time.perf_counter()
        best = report(f"{rows}x{columns}", sequence, steps, sets)
        k = classes[best]
        text = format_polynomial(sequence.field, decimated_polynomial(sequence, k))
        print(f"    best: k {k}, {text}; {time.perf_counter() - began:.0f} s", flush=True)
    if options.sheared:
        period = sequence.period
        steps = [(int(rng.integers(1, period)), 1) for _ in classes]
        best = report("sheared (a, 1)", sequence, steps, sets)
        print(f"    best: a {steps[best][0]}")


def first_sequence(order: int, degree: int) -> Sequence:
    field = field_of_order(order)
    try:
        polynomial = primitive_polynomial(order, degree)
    except ArrayError:
        polynomial = search_primitive(order, degree)
    return Sequence(field, polynomial)


def decimations(sequence: Sequence, most: int, rng: np.random.Generator) -> list[int]:
    """Return one k of each class, or of `most` classes drawn at random."""
    period, p = sequence.period, sequence.field.characteristic
    found: list[int] = []
    seen: set[int] = set()
    short = period < 1 << 17
    draws = iter(range(1, period)) if short else iter(lambda: int(rng.integers(1, period)), 0)
    for k in draws:
        if len(found) == most and not short:
            break
        if gcd(k, period) > 1 or k in seen:
            continue
        found.append(k)
        for _ in range(sequence.ring.degree):
            seen.update((k, period - k))
            k = k * p % period
    if len(found) > most:
        found = [found[i] for i in np.sort(rng.permutation(len(found))[:most])]
    return found


def decimated_polynomial(sequence: Sequence, k: int) -> tuple[int, ...]:
    """Return the minimal polynomial over GF(q) of x^k: that of the terms s[k t]."""
    powers = [k * j % sequence.period for j in range(sequence.degree + 1)]
    (relation,) = null_space(sequence.field, sequence.coefficients(powers).T)
    field = sequence.field
    return tuple(field.multiplication[relation, field.inverse[relation[-1]]].tolist())


def report(
    name: str,
    sequence: Sequence,
    steps: list[tuple[int, int]],
    sets: dict[float, tuple[VisibleSet, ...]],
) -> int:
    """Print the shares of the median and of the best; return the best's place."""
    rated = [shares_of_steps(sequence, *step, sets) for step in steps]
    scores = [score(one) for one in rated]
    best = int(np.argmin(scores))
    median = int(np.argsort(scores)[len(scores) // 2])
    for label, at in (("best", best), ("median", median)):
        texts = [
            f"{pitch:g} mm {one.short:.4f} | " + " ".join(f"{x:.4f}" for x in one.poses)
            for pitch, one in zip(PITCHES_MM, rated[at], strict=True)
        ]
        print(f"{name:<16}{label:<7}{scores[at]:7.2f}  {'; '.join(texts)}", flush=True)
    serving = np.mean([one[0].short <= 0.11 for one in rated])
    print(f"    at most .11 short at {PITCHES_MM[0]:g} mm: {serving:.2f} of them")
    return best


def shares_of_steps(
    sequence: Sequence,
    row_step: int,
    column_step: int,
    sets: dict[float, tuple[VisibleSet, ...]],
) -> list[RivalShares]:
    offsets = [
        (r * row_step + c * column_step) % sequence.period for r in range(GRID) for c in range(GRID)
    ]
    cells = sequence.coefficients(offsets).reshape(GRID, GRID, -1)
    return [code_shares(sequence.field, cells, one) for one in sets.values()]


def score(rated: list[RivalShares]) -> float:
    return sum(log(max(share, LEAST)) for one in rated for share in one.poses)


if __name__ == "__main__":
    main()
