"""Error against run time: contact models, decoders, and the reader that spends more or less.

What is counted goes to the results, what is timed to the times: `counted` holds the lines,
`spent` their CPU times, ms, in the same order. Contact models and engines were measured against
finer references by `tests/bench/contact_precision.py` and `contact_engines.py`; decoders read
damaged windows of the set's own array; readers read the same touches.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from decoder import Decodings, Likelihood, decode_exact, decode_good_tuple
from generator.array import FoldedArray
from probe.contact.engines import engine_table
from probe.contact.press import table
from recognizer.touch.lab import EmbossedArray
from recognizer.validation.campaign import Campaign, series_of, settings_of
from recognizer.validation.lines import line_of
from recognizer.validation.settings import STUDIES
from recognizer.validation.shards import TIMES, columns_of, read_series

Ints = NDArray[np.int64]


@dataclass(slots=True)
class Study:
    """Lines of a picture, and what each took."""

    counted: list[dict[str, Any]] = field(default_factory=list)
    spent: list[float] = field(default_factory=list)  #: ms CPU


def contact_study() -> Study:
    """Return error and time of every contact level and engine, as they were measured once."""
    study = Study()
    found = [
        (f"{kind}, own engine", line.level, line.error, line.ms)
        for kind, lines in table().items()
        for line in lines
    ]
    found += [(f"tab, {each.engine}", each.level, each.error, each.ms) for each in engine_table()]
    for series, level, error, ms in found:
        study.counted.append({"series": series, "level": level, "error": error})
        study.spent.append(ms)
    return study


def reader_study(folder: Path, campaign: Campaign) -> Study:
    """Return what readers that spend more or less make of the same touches."""
    study = Study()
    for series in series_of(campaign)[1:]:
        rows = columns_of(read_series(folder, series))
        line = {"reader": series.reader, "settings": settings_of(series.reader)}
        study.counted.append(line | line_of(rows, np.ones(len(rows["number"]), bool)))
        spent = columns_of(read_series(folder, series, TIMES))["reading"]
        study.spent.append(round(1e3 * float(np.mean(spent)), 3))
    return study


def decoder_study(encoding: EmbossedArray, seed: int) -> Study:
    """Return what decoders make of damaged windows at registered places of an array."""
    study, array = Study(), encoding.array
    shape = (array.window[0] + STUDIES.beyond, array.window[1] + STUDIES.beyond)
    rng = np.random.default_rng([seed, 2])
    keys = encoding.keys[rng.integers(len(encoding.keys), size=STUDIES.windows)]
    rows, columns = (part.astype(np.int64) for part in np.divmod(keys, np.uint64(array.columns)))
    down, along = np.indices(shape)
    windows = array.symbols(
        (rows[:, None, None] + down) % array.rows,
        (columns[:, None, None] + along) % array.columns,
    )
    other = (windows + rng.integers(1, array.order, windows.shape)) % array.order
    windows = np.where(rng.random(windows.shape) < STUDIES.wrong_symbols, other, windows)
    for name, decode in _decoders(encoding):
        decode(windows[:2])
        start = time.process_time()
        found = decode(windows)
        study.spent.append(round(1e3 * (time.process_time() - start) / STUDIES.windows, 5))
        right = (found.rows == rows.astype(np.uint64)) & (
            found.columns == columns.astype(np.uint64)
        )
        study.counted.append(
            {
                "decoder": name,
                "view": list(shape),
                "wrong_symbols": STUDIES.wrong_symbols,
                "windows": STUDIES.windows,
                "right": int((found.answered & right).sum()),
                "wrong": int((found.answered & ~right).sum()),
                "rejected": int((~found.answered).sum()),
            }
        )
    return study


def _decoders(encoding: EmbossedArray) -> Iterator[tuple[str, Callable[[Ints], Decodings]]]:
    array = encoding.array
    places = array.rows * array.columns
    methods = ["logarithm"]
    if places <= STUDIES.largest_serial:
        methods = ["table", "serial", "milestones", *methods]
    for method in methods:
        yield method, _exact(array, method)
    if isinstance(array, FoldedArray):
        yield "good tuple", lambda windows: decode_good_tuple(array, windows)
    yield "likelihood", Likelihood(array).decode
    at = np.divmod(encoding.keys, np.uint64(array.columns))
    prior = np.stack([part.astype(np.int64) for part in at], axis=1)
    yield "likelihood, registered cells", Likelihood(array, prior=prior).decode


def _exact(array: Any, method: str) -> Callable[[Ints], Decodings]:
    return lambda windows: decode_exact(array, windows, method)
