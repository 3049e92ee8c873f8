"""How often a reader answers, by symbols seen whole and loaded share: promise against reading.

    validate-set bricks.yaml cube.yaml --touches 2000 --kinds face,edge,corner -o run
    python tests/campaigns/promised.py run ...

Each touch of a run on a registered face is looked at as `generator.layout.promise` sees it. The
touches of even numbers make a table of answers, for `AnswerTable`; those of odd numbers are
compared with what it promises for their poses, by kind of touch and by object.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
from numpy.typing import NDArray

from generator.array import array_from
from generator.database.cells import occupancy
from generator.database.open import open_if_there
from generator.database.read import read_object
from generator.database.transaction import read_transaction
from generator.layout.promise import AnswerTable, FaceViews, SeenRanks, SensorView, views_at

SENSOR_HALF_MM = (12.7, 12.7)
SEEN = (1.0, 3.0, 5.0, 7.0, 9.0, 12.0, 16.0, 20.0, 26.0)  #: of the table's rows
LOADED = (0.35, 0.5, 0.65, 0.8, 1.0)  #: and columns


@dataclass(frozen=True)
class Touched:
    """Touches as the promise sees them, and whether they were answered."""

    kind: str
    name: str
    number: int
    seen: int
    loaded: float
    alone: float  #: probability that no rival is registered
    right: bool


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("run", nargs="+", type=Path, help="folder of validate-set")
    parser.add_argument("--level", help="of noise, alone")
    options = parser.parse_args()
    touches = [t for run in options.run for t in touches_of(run, options.level)]
    learned = [t for t in touches if t.number % 2 == 0]
    checked = [t for t in touches if t.number % 2]
    table = measured_table(learned)
    print("answered share (touches), by symbols seen whole and loaded share")
    print("        " + "".join(f"{x:>12.2f}" for x in LOADED))
    counts = tally(learned)[1]
    for seen, row, number in zip(SEEN, table.probability, counts, strict=True):
        cells = (f"{p:.2f} ({n:.0f})" for p, n in zip(row, number, strict=True))
        print(f"{seen:6.0f}  " + "".join(f"{cell:>12}" for cell in cells))
    print("promised and answered, touches of odd numbers")
    for label in ("kind", "name"):
        for group in sorted({getattr(t, label) for t in checked}):
            some = [t for t in checked if getattr(t, label) == group]
            promised = table.at(
                np.array([t.seen for t in some]), np.array([t.loaded for t in some])
            ) * [t.alone for t in some]
            right = np.mean([t.right for t in some])
            print(f"{group:<24}{len(some):5d}  {promised.mean():.3f}  {right:.3f}")


def touches_of(run: Path, level: str | None) -> Iterator[Touched]:
    rows = pq.read_table(run / "trials.parquet").to_pylist()
    rows = [r for r in rows if r["object"] and (level is None or r["level"] == level)]
    engine = open_if_there(f"sqlite:///{run / 'lab.db'}", writable=False)
    assert engine is not None
    with read_transaction(engine) as connection:
        for name in sorted({row["object"] for row in rows}):
            known = read_object(connection, name)
            array = array_from(known.array.definition)
            used = occupancy(connection, array).used / (array.rows * array.columns)
            reach = known.alphabet["reach"] * known.style.pitch_mm
            view = SensorView(SENSOR_HALF_MM, reach + known.style.stroke_mm / 2)
            layouts = {one.face: one for one in known.layout.faces}
            for face in known.faces:
                some = [r for r in rows if (r["object"], r["face"]) == (name, face.name)]
                if not some:
                    continue
                centre = np.array([(r["x_mm"], r["y_mm"]) for r in some])
                turn = np.radians([r["theta_deg"] for r in some])
                views = views_at(
                    face.polygon_mm, layouts[face.face_id], known.style.pitch_mm, view,
                    SeenRanks(array), centre, turn,
                )  # fmt: skip
                yield from (touched(row, k, views, used) for k, row in enumerate(some))


def touched(row: dict[str, object], k: int, views: FaceViews, used: float) -> Touched:
    name = str(row["object"]).rsplit("-", 1)[0]
    return Touched(
        str(row["kind"]), name, int(row["number"]), int(views.seen[k]), float(views.loaded[k]),
        float(np.exp(-views.rivals[k] * used)), row["verdict"] == "right",
    )  # fmt: skip


def tally(touches: Iterable[Touched]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return answers and touches at the table's entries, each shared by the nearest four."""
    right, number = np.zeros((2, len(SEEN), len(LOADED)))
    for one in touches:
        row = np.interp(one.seen, SEEN, np.arange(len(SEEN)))
        column = np.interp(one.loaded, LOADED, np.arange(len(LOADED)))
        for i in {int(row), min(int(row) + 1, len(SEEN) - 1)}:
            for j in {int(column), min(int(column) + 1, len(LOADED) - 1)}:
                weight = one.alone * max(0.0, 1 - abs(row - i)) * max(0.0, 1 - abs(column - j))
                right[i, j] += weight * one.right
                number[i, j] += weight
    return right, number


def measured_table(touches: list[Touched]) -> AnswerTable:
    """Return the table, its entries pulled towards the share of all by one touch."""
    right, number = tally(touches)
    overall = right.sum() / max(number.sum(), 1.0)
    return AnswerTable(SEEN, LOADED, (right + overall) / (number + 1))


if __name__ == "__main__":
    main()
