"""Time and memory per decode, by method and size: n = 12 ... 64, binary, single and batches.

    OPENBLAS_NUM_THREADS=1 python tests/bench/decoder_times.py --seed 1 -o times.json
    OPENBLAS_NUM_THREADS=1 python tests/bench/decoder_times.py --profiles --batch 1000

Windows are drawn over the whole array. One window: the median of repeated calls; a batch:
the best of three calls with 10,000 windows, fewer where a line says so. All times are
processor time, so that other programs count little. Memory: the method's tables, and the
most that one call with the batch allocates beside them. Likelihood decodes 8x8 windows (6x6
at n = 12, the next larger square that identifies at n = 64) with 5 % wrong symbols, beyond
2^18 places by ordered statistics; with a prior, among 400 registered cells. Every answer of
the exact methods is compared with the truth. `--profiles` takes the arrays over GF(4) instead that
profiles have, and one with a lab's key; likelihood then decodes 6x6 windows.
"""

from __future__ import annotations

import argparse
import json
import statistics
import time
import tracemalloc
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from decoder import Decodings, Likelihood, MethodError, decode_exact
from decoder.exact import METHODS, conversion
from generator.array import FoldedArray, array_from, next_larger, profile
from generator.array.lab_key import keyed_array

SIZES = (12, 16, 20, 24, 32, 48, 64)
BATCH = 10_000
BUDGET_S = 4.0  # for one call with a batch


def memory(value: Any) -> int:
    """Return the bytes of the arrays that a value holds, without its sequence's elements."""
    if isinstance(value, np.ndarray):
        return value.nbytes
    if isinstance(value, list | tuple):
        return sum(map(memory, value))
    held = {k: v for k, v in getattr(value, "__dict__", {}).items() if k != "elements"}
    return sum(map(memory, held.values()))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--sizes", default=",".join(map(str, SIZES)))
    parser.add_argument("--profiles", action="store_true", help="arrays of profiles in their place")
    parser.add_argument("--batch", type=int, default=BATCH)
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    print(f"{'array':<17}{'method':<12}{'set-up ms':>11}{'single us':>11}{'batch us':>10}"
          f"{'windows':>9}{'tables B':>12}{'working B':>12}")  # fmt: skip
    rows = []
    for name, array, side in arrays_of(options.sizes, profiles=options.profiles):
        rows += times_of(name, array, side, options.batch, rng)
    if options.output:
        options.output.write_text(json.dumps(rows, indent=1))


def arrays_of(sizes: str, *, profiles: bool) -> Iterator[tuple[str, FoldedArray, int]]:
    """Yield names and arrays, and the side of the windows that likelihood decodes."""
    if not profiles:
        for n in map(int, sizes.split(",")):
            array = array_from({"family": "prba", "order": 2, "degree": n})
            side = next(a for a in (6, 8, 10, 12, 14) if a >= (6 if n == 12 else 8)
                        and array.identifies(*np.indices((a, a))))  # fmt: skip
            yield f"n = {n}", array, side
        return
    yield "one-touch", profile("one-touch").array(), 6
    known = profile("large")
    yield "large, lab key", keyed_array(known.array(), "0123-4567-89AB-CDER"), 6
    for _ in range(6):
        array = known.array()
        yield f"{array.rows}x{array.columns}", array, 6
        known = next_larger(known)


def times_of(
    name: str, array: FoldedArray, side: int, batch: int, rng: np.random.Generator
) -> list[dict]:
    """Return what each method takes on an array."""
    rows = []
    windows, truth = drawn(array, array.window, batch, rng)
    for method in METHODS:
        conversion.cache_clear()
        start = time.process_time()
        try:
            tables = memory(conversion(array.sequence, method))
        except MethodError:
            rows.append({"array": name, "method": method})
            print(f"{name:<17}{method:<12}{'-':>11}")
            continue
        ready = time.process_time() - start

        def exact(part: np.ndarray, m: str = method) -> Decodings:
            return decode_exact(array, part, m)

        rows.append({"array": name, "method": method, **timed(exact, windows, truth)})
        told(rows[-1], ready, tables)
    windows, truth = drawn(array, (side, side), batch, rng)
    wrong = rng.integers(1, array.order, windows.shape).astype(windows.dtype)
    changed = (windows + wrong) % array.order
    windows = np.where(rng.random(windows.shape) < 0.05, changed, windows).astype(windows.dtype)
    for method, decoder in (
        ("likelihood", Likelihood(array)),
        ("with a prior", Likelihood(array, prior=np.concatenate([truth[:400]]))),
    ):
        start = time.process_time()
        decoder.decode(windows[0])
        ready = time.process_time() - start
        part = windows if method == "likelihood" else windows[:400]
        rows.append({"array": name, "method": method, **timed(decoder.decode, part, None)})
        told(rows[-1], ready, 0)
    return rows


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
    print(f"{row['array']:<17}{row['method']:<12}{row['setup_ms']:>11.1f}{row['single_us']:>11.1f}"
          f"{row['batch_us']:>10.3f}{row['windows']:>9}{tables:>12}{row['working']:>12}",
          flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
