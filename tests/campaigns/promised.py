"""How often a reader answers, by symbols seen whole and loaded share: promise against reading.

    validate-set boxes.yaml --touches 1300 --kinds face=2,edge=2,corner=1 \\
        --levels typical,mismatch --surfaces database --study 0 -o learn
    python tests/campaigns/promised.py learn --save generator/layout/answers.json
    python tests/campaigns/promised.py other_boxes --check

Each touch of a run on a registered face is looked at as `generator.layout.views` sees it. They
make a table of answers, for `AnswerTable`; with `--check` the table that ships is compared with
them instead, by kind of touch, pitch and face.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
from numpy.typing import ArrayLike, NDArray

from generator.array.touches import SENSOR_MM
from generator.database.open import open_if_there
from generator.database.read import read_object
from generator.database.transaction import read_transaction
from generator.layout.promise import AnswerTable, measured_answers
from generator.layout.views import SensorView, views_at

KINDS, LEVELS = ("face", "edge", "corner"), ("typical", "mismatch")
PITCH = (4.5, 5.5, 7.0)  #: mm, of the table's sheets
SEEN = (0.0, 2.0, 4.0, 6.0, 8.0, 11.0, 15.0, 20.0, 26.0)  #: of its rows
LOADED = (0.25, 0.4, 0.5, 0.6, 0.7, 0.85, 1.0)  #: and columns
WEIGHT = 4.0  #: touches that the smooth fit counts for at every entry


@dataclass(frozen=True)
class Touched:
    """A touch as the promise sees it, and whether it was answered."""

    kind: str
    pitch_mm: float
    face: str
    seen: int
    loaded: float
    right: bool


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("run", nargs="+", type=Path, help="folder of validate-set")
    parser.add_argument("--check", action="store_true", help="the table that ships")
    parser.add_argument("--save", type=Path, help="write the measured table")
    options = parser.parse_args()
    touches = [t for run in options.run for t in touches_of(run)]
    if options.check:
        compare(touches, measured_answers())
        return
    table = measured_table(touches)
    print("answered share (touches), by symbols seen whole and loaded share")
    for pitch, sheet in zip(PITCH, table.probability, strict=True):
        print(f"{pitch:g} mm  " + "".join(f"{x:>12.2f}" for x in LOADED))
        counts = tally([t for t in touches if t.pitch_mm == pitch])[1]
        for seen, row, number in zip(SEEN, sheet, counts, strict=True):
            cells = (f"{p:.2f} ({n:.0f})" for p, n in zip(row, number, strict=True))
            print(f"{seen:6.0f}  " + "".join(f"{cell:>12}" for cell in cells))
    if options.save:
        options.save.write_text(json_of(table, len(touches)))
    compare(touches, table)


def compare(touches: list[Touched], table: AnswerTable) -> None:
    """Print promise and reading by kind, pitch and face, and how far they lie apart."""
    print(f"promised and answered, {len(touches)} touches")
    for label in ("kind", "pitch_mm", "face"):
        apart, chance = [], []
        for group in sorted({getattr(t, label) for t in touches}):
            some = [t for t in touches if getattr(t, label) == group]
            p = np.array(
                [float(table.at(t.pitch_mm, np.array([t.seen]), np.array([t.loaded]))[0])
                 for t in some]
            )  # fmt: skip
            right = float(np.mean([t.right for t in some]))
            error = float(np.sqrt((p * (1 - p)).sum())) / len(some)
            print(f"{group!s:<28}{len(some):5d}  {p.mean():.3f}  {right:.3f}  +- {error:.3f}")
            apart.append(float(p.mean()) - right)
            chance.append(error)
        rms, expected = (float(np.sqrt(np.mean(np.square(x)))) for x in (apart, chance))
        print(f"  rms difference by {label} {rms:.3f}; of chance alone {expected:.3f}")


def touches_of(run: Path) -> Iterator[Touched]:
    """Read the touches of registered faces, whole symbols and all."""
    rows = pq.read_table(run / "trials.parquet").to_pylist()
    rows = [r for r in rows if r["object"] and r["kind"] in KINDS and r["level"] in LEVELS]
    engine = open_if_there(f"sqlite:///{run / 'lab.db'}", writable=False)
    assert engine is not None
    with read_transaction(engine) as connection:
        for name in sorted({row["object"] for row in rows}):
            known = read_object(connection, name)
            pitch = known.style.pitch_mm
            reach = known.alphabet["reach"] * pitch + known.style.stroke_mm / 2
            view = SensorView((SENSOR_MM / 2, SENSOR_MM / 2), reach)
            layouts = {one.face: one for one in known.layout.faces}
            for face in known.faces:
                some = [r for r in rows if (r["object"], r["face"]) == (name, face.name)]
                if not some:
                    continue
                centre = np.array([(r["x_mm"], r["y_mm"]) for r in some])
                turn = np.radians([r["theta_deg"] for r in some])
                views = views_at(face.polygon_mm, layouts[face.face_id], pitch, view, centre, turn)
                size = " x ".join(f"{v:.0f}" for v in sorted(np.ptp(face.polygon_mm[0], axis=0)))
                for k, row in enumerate(some):
                    yield Touched(
                        row["kind"], pitch, f"{size} mm, pitch {pitch:g}",
                        int(views.seen[k]), float(views.loaded[k]), row["verdict"] == "right",
                    )  # fmt: skip


def tally(touches: Iterable[Touched]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return answers and touches at the entries of a sheet, each shared by the nearest four."""
    right, number = np.zeros((2, len(SEEN), len(LOADED)))
    for one in touches:
        row = np.interp(one.seen, SEEN, np.arange(len(SEEN)))
        column = np.interp(one.loaded, LOADED, np.arange(len(LOADED)))
        for i in {int(row), min(int(row) + 1, len(SEEN) - 1)}:
            for j in {int(column), min(int(column) + 1, len(LOADED) - 1)}:
                weight = max(0.0, 1 - abs(row - i)) * max(0.0, 1 - abs(column - j))
                right[i, j] += weight * one.right
                number[i, j] += weight
    return right, number


def measured_table(touches: list[Touched]) -> AnswerTable:
    """Return the table: at each entry the share of the touches near it, and a smooth fit's."""
    sheets = []
    for pitch in PITCH:
        some = [t for t in touches if t.pitch_mm == pitch]
        right, number = tally(some)
        seen, loaded = np.meshgrid(SEEN, LOADED, indexing="ij")
        smooth = 1 / (1 + np.exp(-_terms(seen, loaded) @ _fit(some)))
        sheets.append((right + WEIGHT * smooth) / (number + WEIGHT))
    return AnswerTable(PITCH, SEEN, LOADED, np.array(sheets))


def _terms(seen: ArrayLike, loaded: ArrayLike) -> NDArray[np.float64]:
    seen, loaded = np.asarray(seen, float), np.asarray(loaded, float)
    return np.stack([np.ones_like(loaded), np.log1p(seen), loaded], axis=-1)


def _fit(touches: Sequence[Touched], steps: int = 30, ridge: float = 0.02) -> NDArray[np.float64]:
    """Return the weights of a logistic regression, by Newton's method."""
    x = _terms([t.seen for t in touches], [t.loaded for t in touches])
    y = np.array([t.right for t in touches], float)
    weights = np.zeros(x.shape[1])
    for _ in range(steps):
        p = 1 / (1 + np.exp(-np.clip(x @ weights, -30, 30)))
        slope = x.T @ (y - p) - ridge * weights
        curve = (x * (p * (1 - p))[:, None]).T @ x + ridge * np.eye(len(weights))
        weights = weights + np.linalg.solve(curve, slope)
    return weights


def json_of(table: AnswerTable, touches: int) -> str:
    """Return what `answers.json` holds."""
    sheets = [
        ",\n      ".join(json.dumps([round(float(p), 3) for p in row]) for row in sheet)
        for sheet in table.probability
    ]
    rows = "],\n    [".join(f"\n      {sheet}\n    " for sheet in sheets)
    lines = [
        f'  "touches": {touches}',
        f'  "pitch_mm": {json.dumps(list(table.pitch_mm))}',
        f'  "seen": {json.dumps(list(table.seen))}',
        f'  "loaded": {json.dumps(list(table.loaded))}',
        f'  "probability": [\n    [{rows}]\n  ]',
    ]
    return "{\n" + ",\n".join(lines) + "\n}\n"


if __name__ == "__main__":
    main()
