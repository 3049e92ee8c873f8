"""Error against run time, and the work that is avoided.

Counts go to the results, CPU times to the times: `counted` holds the lines, `spent` their CPU
times, ms, in order. Contact models and engines were measured against finer references by
`tests/bench/contact_precision.py`; decoders read damaged windows of the set's own array; readers
that spend more or less read the same touches.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from decoder import Decodings, Likelihood, decode_exact, decode_good_tuple
from encoded_objects.base.sensor_type import SensorType
from generator.array import FoldedArray
from generator.database.open import open_database
from generator.database.read import object_names, read_object
from generator.database.transaction import read_transaction
from probe.contact.engines import ENGINES, engine_named, engine_table
from probe.contact.press import LEVELS, level_for, table
from probe.contact.tips import Tips, tip_points
from recognizer.touch.lab import EmbossedArray
from recognizer.touch.reader import Reader
from recognizer.validation.campaign import Campaign, series_of, settings_of
from recognizer.validation.draw import DrawnTouch, draw_touch
from recognizer.validation.files import LIMITS, TIMES, columns_of, read_series
from recognizer.validation.limits import alphabets_of, line_of_limits
from recognizer.validation.results import line_of
from recognizer.validation.touch_plan import TouchPlan

WINDOWS = 200  #: damaged ones for each decoder
WRONG_SYMBOLS = 0.05  #: of these windows
BEYOND = 2  #: rows and columns of a view beyond the window, so that errors show
LARGEST_SERIAL = 1 << 13  #: places up to which the serial method ends in time
OBJECTS = 20  #: read to know what reading all would take
REPEATS = 5  #: of what is timed; the median counts

Ints = NDArray[np.int64]


@dataclass(slots=True)
class Study:
    """Lines of a picture, and the CPU time of each."""

    counted: list[dict[str, Any]] = field(default_factory=list)
    spent: list[Any] = field(default_factory=list)  #: ms CPU

    def add(self, ms: Any, **line: Any) -> None:
        """Add a line and its time."""
        self.counted.append(line)
        self.spent.append(ms)


def contact_study() -> Study:
    """Return error and time of every contact level and engine, as they were measured once."""
    study = Study()
    for kind, lines in table().items():
        for line in lines:
            study.add(line.ms, series=f"{kind}, own engine", level=line.level, error=line.error)
    for each in engine_table():
        study.add(each.ms, series=f"tab, {each.engine}", level=each.level, error=each.error)
    return study


def reader_study(folder: Path, campaign: Campaign) -> Study:
    """Return the outcome of the same touches for readers that spend more or less."""
    study = Study()
    for series in series_of(campaign)[1:]:
        if series.limits:
            continue
        rows = columns_of(read_series(folder, series))
        spent = columns_of(read_series(folder, series, TIMES))["reading"]
        study.add(
            round(1e3 * float(np.mean(spent)), 3),
            reader=series.reader,
            settings=settings_of(series.reader),
            **line_of(rows, np.ones(len(rows["number"]), bool)),
        )
    return study


def limit_study(folder: Path, campaign: Campaign, reader: Reader) -> dict[str, Any]:
    """Return what touches can say at best, by class, and what is answered of them."""
    doubt, lines = reader.options.doubt, []
    for series in series_of(campaign):
        if series.limits:
            rows = columns_of(read_series(folder, series, LIMITS))
            trials = columns_of(read_series(folder, series))
            lines.append(line_of_limits(series.limits, rows, trials, doubt))
    return {
        "sensor": reader.sensor.name,
        "arrays": alphabets_of(reader.lab.arrays),
        "doubt": doubt,
        "classes": lines,
    }


def decoder_study(encoding: EmbossedArray, seed: int) -> Study:
    """Return the outcome of damaged windows at registered places of an array, by decoder."""
    study, array = Study(), encoding.array
    shape = (array.window[0] + BEYOND, array.window[1] + BEYOND)
    rng = np.random.default_rng([seed, 2])
    keys = encoding.keys[rng.integers(len(encoding.keys), size=WINDOWS)]
    rows, columns = (part.astype(np.int64) for part in np.divmod(keys, np.uint64(array.columns)))
    down, along = np.indices(shape)
    windows = array.symbols(
        (rows[:, None, None] + down) % array.rows,
        (columns[:, None, None] + along) % array.columns,
    )
    other = (windows + rng.integers(1, array.order, windows.shape)) % array.order
    windows = np.where(rng.random(windows.shape) < WRONG_SYMBOLS, other, windows)
    for name, decode in _decoders(encoding):
        decode(windows[:2])
        start = time.process_time()
        found = decode(windows)
        ms = round(1e3 * (time.process_time() - start) / WINDOWS, 5)
        right = found.rows == rows.astype(np.uint64)
        right &= found.columns == columns.astype(np.uint64)
        study.add(
            ms,
            decoder=name,
            view=list(shape),
            wrong_symbols=WRONG_SYMBOLS,
            windows=WINDOWS,
            right=int((found.answered & right).sum()),
            wrong=int((found.answered & ~right).sum()),
            rejected=int((~found.answered).sum()),
        )
    return study


def _decoders(encoding: EmbossedArray) -> Iterator[tuple[str, Callable[[Ints], Decodings]]]:
    array = encoding.array
    methods = ["logarithm"]
    if array.rows * array.columns <= LARGEST_SERIAL:
        methods = ["table", "serial", "milestones", *methods]
    for method in methods:
        yield method, partial(decode_exact, array, method=method)
    if isinstance(array, FoldedArray):
        yield "good tuple", partial(decode_good_tuple, array)
    yield "likelihood", Likelihood(array).decode
    at = np.divmod(encoding.keys, np.uint64(array.columns))
    prior = np.stack([part.astype(np.int64) for part in at], axis=1)
    yield "likelihood, registered cells", Likelihood(array, prior=prior).decode


#: Work that is avoided: what, how much is needed, of how much, its unit, CPU time of both, ms.
Avoided = tuple[str, int, int, str, float | None, float | None]


def work_avoided(reader: Reader, plan: TouchPlan, readers: Study) -> Study:
    """Return the work that is avoided for a touch of a registered face.

    The example is touch 0 of the plan, of kind `face`; in the study of readers the first is the
    reader as it is, and the last spends most.
    """
    study = Study()
    for what, needed, of, unit, *spent in _avoided(reader, plan, readers):
        study.counted.append({"what": what, "needed": needed, "of": of, "unit": unit})
        study.spent += [None if ms is None else float(f"{ms:.3g}") for ms in spent]
    return study


def _avoided(reader: Reader, plan: TouchPlan, readers: Study) -> Iterator[Avoided]:
    found, sensor = draw_touch(plan, 0, reader), reader.sensor
    yield _objects(reader)
    yield _heights(found, sensor)
    yield _levels(sensor)
    triangles = engine_named(plan.engine).triangles
    if triangles is not None:  # it takes meshes of parts
        surface = found.contact.scene.under(found.touch).surface
        counted = triangles(surface, sensor, found.touch)
        if counted is not None:
            what = f"Triangles of the part that engine {plan.engine} gets"
            yield f"{what}: only those under the sensor", *counted, "triangles", None, None
    for encoding in reader.lab.arrays:
        rows, columns = encoding.array.rows, encoding.array.columns
        what = f"only those that were made, of all {rows} x {columns} of the array"
        what, needed = f"Places that an answer may name: {what}", len(encoding.keys)
        yield what, needed, rows * columns, "places", None, None
    if readers.counted:
        tried, most = (readers.counted[k]["settings"]["candidates"] for k in (0, -1))
        what = "the likeliest ones; more only where these give no answer"
        what, spent = f"Ways to read the touch that are tried out: {what}", readers.spent
        yield what, tried, most, "ways", spent[0], spent[-1]


def _objects(reader: Reader) -> Avoided:
    with read_transaction(open_database(reader.lab.url, writable=False)) as connection:
        names = object_names(connection)
        spent = [_cpu_ms(partial(read_object, connection, name), 1) for name in names[:OBJECTS]]
    one = float(np.median(spent))
    what = "Objects loaded from the database: only the one that is touched"
    return what, 1, len(names), "objects", one, one * len(names)


def _heights(found: DrawnTouch, sensor: SensorType) -> Avoided:
    scene = found.contact.scene
    under = found.touch.on_surface(tip_points(sensor, Tips())[0].reshape(-1, 2))
    low, high = scene.region.box_mm
    step = float(np.sqrt(4 * sensor.half_mm[0] * sensor.half_mm[1] / len(under)))
    x, y = (np.arange(a, b, step) for a, b in zip(low, high, strict=True))
    whole = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    heights = scene.surface.heights_mm
    heights(under)
    spent = [_cpu_ms(partial(heights, points)) for points in (under, whole)]
    what = "Places where the height of the surface is computed: only under the sensor's tips"
    return what, len(under), len(whole), "places", spent[0], spent[1]


def _levels(sensor: SensorType) -> Avoided:
    kind, chosen = sensor.overlay.kind, level_for(sensor)
    lines = {line.level: line for line in table()[kind]}
    finest = [level for level in LEVELS[kind] if level in lines][-1]
    what = f"Fineness of the simulated contact: {chosen}, the cheapest that is exact enough; "
    needed = LEVELS[kind].index(chosen) + 1
    return (
        f"{what}the finest is {finest}", needed, len(lines), "levels",
        lines[chosen].ms, lines[finest].ms,
    )  # fmt: skip


def engine_lines() -> list[dict[str, Any]]:
    """Return, in plain words, which effects of a real touch each engine leaves out."""
    measured = {line.engine: line.from_own for line in engine_table()}
    return [
        {"engine": name, "left_out": entry.left_out, "from_own": measured.get(name)}
        for name, entry in ENGINES.items()
    ]


def _cpu_ms(work: Callable[[], object], repeats: int = REPEATS) -> float:
    times = []
    for _ in range(repeats):
        start = time.process_time()
        work()
        times.append(1e3 * (time.process_time() - start))
    return float(np.median(times))
