"""Time and memory per decode, by method and size: n = 12 ... 64, binary, single and batches.

    OPENBLAS_NUM_THREADS=1 python tests/bench/decoder_times.py --seed 1 -o times.json

Windows are drawn over the whole array. One window: the median of repeated calls; a batch:
the best of three calls with 10,000 windows, fewer where a line says so. All times are
processor time, so that other programs count little. Memory: the method's tables, and the
most that one call with the batch allocates beside them. Likelihood decodes 8x8 windows (6x6
at n = 12, the next larger square that identifies at n = 64) with 5 % wrong symbols, beyond
2^18 places by ordered statistics; with a prior, among 400 registered cells. Every answer of
the exact methods is compared with the truth.
"""

from __future__ import annotations

import argparse
import json
import statistics
import time
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np

from decoder import Decodings, Likelihood, MethodError, decode_exact
from decoder.convert import METHODS, conversion
from generator.array import FoldedArray, array_from

SIZES = (12, 16, 20, 24, 32, 48, 64)
BATCH = 10_000
BUDGET_S = 4.0  # for one call with a batch


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--sizes", default=",".join(map(str, SIZES)))
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    rows = []
    print(f"{'n':>3} {'method':<12}{'set-up ms':>11}{'single us':>11}{'batch us':>10}{'windows':>9}"
          f"{'tables B':>12}{'working B':>12}")  # fmt: skip
    for n in map(int, options.sizes.split(",")):
        array = array_from({"family": "prba", "order": 2, "degree": n})
        windows, truth = drawn(array, array.window, BATCH, rng)
        for method in METHODS:
            conversion.cache_clear()
            start = time.process_time()
            try:
                tables = conversion(array.sequence, method).nbytes
            except MethodError:
                rows.append({"n": n, "method": method})
                print(f"{n:>3} {method:<12}{'-':>11}")
                continue
            ready = time.process_time() - start

            def exact(part: np.ndarray, m: str = method, a: FoldedArray = array) -> Decodings:
                return decode_exact(a, part, m)

            rows.append({"n": n, "method": method, **timed(exact, windows, truth)})
            told(rows[-1], ready, tables)
        side = next(a for a in (6, 8, 10, 12, 14) if a >= (6 if n == 12 else 8)
                    and array.identifies(*np.indices((a, a))))  # fmt: skip
        shape = (side, side)
        windows, truth = drawn(array, shape, BATCH, rng)
        windows ^= rng.random(windows.shape) < 0.05
        prior = np.concatenate([truth[:400]])
        for name, decoder in (
            ("likelihood", Likelihood(array)),
            ("with a prior", Likelihood(array, prior=prior)),
        ):
            start = time.process_time()
            decoder.decode(windows[0])
            ready = time.process_time() - start
            part = windows if name == "likelihood" else windows[:400]
            rows.append({"n": n, "method": name, **timed(decoder.decode, part, None)})
            told(rows[-1], ready, 0)
    if options.output:
        options.output.write_text(json.dumps(rows, indent=1))


def drawn(
    array: FoldedArray, shape: tuple[int, int], number: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Return windows (N, a, b) and their places (N, 2)."""
    places = np.stack([rng.integers(0, array.rows, number, np.uint64),
                       rng.integers(0, array.columns, number, np.uint64)], axis=1)  # fmt: skip
    a, b = np.indices(shape).astype(np.uint64)
    rows = (places[:, 0, None, None] + a) % np.uint64(array.rows)
    columns = (places[:, 1, None, None] + b) % np.uint64(array.columns)
    windows = [array.symbols(rows[i : i + 500], columns[i : i + 500])
               for i in range(0, number, 500)]  # fmt: skip
    return np.concatenate(windows), places


def timed(
    decode: Callable[[np.ndarray], Decodings], windows: np.ndarray, truth: np.ndarray | None
) -> dict[str, float | int]:
    """Return microseconds for one window and for one of a batch, and working memory."""
    once = clocked(decode, windows[:1])
    singles = [clocked(decode, windows[i : i + 1])
               for i in range(1, max(4, min(200, int(1.0 / once))))]  # fmt: skip
    single = statistics.median(singles)
    number = len(windows)
    if single * number > 10 * BUDGET_S:  # find out what a batch costs before asking for it
        number = max(1, int(BUDGET_S / clocked(decode, windows[:8]) * 8))
        number = min(number, len(windows))
    batch = min(clocked(decode, windows[:number]) for _ in range(3)) / number
    tracemalloc.start()
    found = decode(windows[:number])
    working = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    if truth is not None:
        right = (found.rows == truth[:number, 0]) & (found.columns == truth[:number, 1])
        if not (right & found.answered).all():
            raise SystemExit("a window was decoded wrong")
    return {"single_us": single * 1e6, "batch_us": batch * 1e6, "windows": number,
            "working": working}  # fmt: skip


def clocked(decode: Callable[[np.ndarray], Decodings], windows: np.ndarray) -> float:
    start = time.process_time()
    decode(windows)
    return time.process_time() - start


def told(row: dict, ready: float, tables: int) -> None:
    row |= {"setup_ms": ready * 1e3, "tables": tables}
    print(f"{row['n']:>3} {row['method']:<12}{row['setup_ms']:>11.1f}{row['single_us']:>11.1f}"
          f"{row['batch_us']:>10.3f}{row['windows']:>9}{tables:>12}{row['working']:>12}",
          flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
