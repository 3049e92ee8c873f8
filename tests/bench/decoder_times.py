"""Time and memory per decode, by method and size: n = 12 ... 64, binary, single and batches.

    python tests/bench/decoder_times.py --seed 1 --sizes 12 16 20
    python tests/bench/decoder_times.py --profiles --batch 1000

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

import statistics
import sys
import tracemalloc
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from decoder import Decodings, Likelihood, MethodError, decode_exact
from decoder.exact import METHODS, conversion
from generator.array import FoldedArray, array_from, next_larger, profile
from generator.array.lab_key import keyed_array

sys.path.insert(0, str(Path(__file__).parents[1] / "campaigns"))
import runner

SIZES = (12, 16, 20, 24, 32, 48, 64)
BUDGET_MS = 4e3  #: for one call with a batch


def memory(value: Any) -> int:
    """Return the bytes of the arrays that a value holds, without its sequence's elements."""
    if isinstance(value, np.ndarray):
        return value.nbytes
    if isinstance(value, list | tuple):
        return sum(map(memory, value))
    held = {k: v for k, v in getattr(value, "__dict__", {}).items() if k != "elements"}
    return sum(map(memory, held.values()))


def main() -> None:
    """Print a line for each array and method."""
    asked = runner.asked(__doc__, seed=1, sizes=list(SIZES), profiles=False, batch=10_000)
    rng = np.random.default_rng(asked.seed)
    runner.table(("array", "method", "set-up ms", "single us", "batch us", "windows", "tables B",
                  "working B"))  # fmt: skip
    for name, array, side in arrays_of(asked.sizes, profiles=asked.profiles):
        print_times(name, array, side, asked.batch, rng)


def arrays_of(sizes: list[int], *, profiles: bool) -> Iterator[tuple[str, FoldedArray, int]]:
    """Yield names and arrays, and the side of the windows that likelihood decodes."""
    if not profiles:
        for n in sizes:
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


def print_times(
    name: str, array: FoldedArray, side: int, batch: int, rng: np.random.Generator
) -> None:
    """Print what each method takes on an array."""
    windows, truth = drawn(array, array.window, batch, rng)
    for method in METHODS:
        conversion.cache_clear()
        try:
            made, ready = runner.clocked(conversion, array.sequence, method)
        except MethodError:
            runner.row(name, method, "-", "-", "-", "-", "-", "-")
            continue
        exact = partial(decode_exact, array, method=method)
        *times, working = timed(exact, windows, truth)
        runner.row(name, method, ready, *times, memory(made), working)
    windows, truth = drawn(array, (side, side), batch, rng)
    wrong = rng.integers(1, array.order, windows.shape).astype(windows.dtype)
    changed = (windows + wrong) % array.order
    windows = np.where(rng.random(windows.shape) < 0.05, changed, windows).astype(windows.dtype)
    for method, decoder, part in (
        ("likelihood", Likelihood(array), windows),
        ("with a prior", Likelihood(array, prior=truth[:400]), windows[:400]),
    ):
        _, ready = runner.clocked(decoder.decode, windows[0])
        *times, working = timed(decoder.decode, part, None)
        runner.row(name, method, ready, *times, 0, working)


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
) -> tuple[float, float, int, int]:
    """Return microseconds of one window and of one of a batch, its size, and working memory."""

    def spent_ms(first: int, end: int) -> float:
        return runner.clocked(decode, windows[first:end])[1]

    once = spent_ms(0, 1)
    single = statistics.median(
        spent_ms(i, i + 1) for i in range(1, max(4, min(200, int(1e3 / once))))
    )
    number = len(windows)
    if single * number > 10 * BUDGET_MS:  # find out what a batch costs before asking for it
        number = min(max(1, int(BUDGET_MS / spent_ms(0, 8) * 8)), number)
    batch = min(spent_ms(0, number) for _ in range(3)) / number
    tracemalloc.start()
    found = decode(windows[:number])
    working = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    if truth is not None:
        right = (found.rows == truth[:number, 0]) & (found.columns == truth[:number, 1])
        if not (right & found.answered).all():
            raise SystemExit("a window was decoded wrong")
    return single * 1e3, batch * 1e3, number, working


if __name__ == "__main__":
    main()
