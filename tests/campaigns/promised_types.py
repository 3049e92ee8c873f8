"""What faces promise to each sensor type, held against the touches of `sensor_types.py`.

    python tests/campaigns/promised_types.py out/types           # promised and answered
    python tests/campaigns/promised_types.py out/types --save    # and what ships is set by them

Every touch inside a face, at an edge or a corner of the levels of `promised.py`, as
`generator.layout.recognition_rate` sees it: the probability of an answer that the shipped table
gives, and what became of it. With `--save` each type's share of the usual sensor's answers
(`generator.layout.recognition_rate.AnsweredShare`) is the likeliest for its touches, and kept in
`generator/layout/answers_of_types.json`. On other faces it is checked by `promised.py
--sensor-type`.
"""

from __future__ import annotations

import itertools
import json
from pathlib import Path
from typing import Any

import numpy as np
import runner
from promised import LEVELS
from scipy.optimize import minimize

from encoded_objects.base.sensor_type import USUAL_SENSOR, SensorType
from encoded_objects.base.sensor_type_file import sensor_type_named, shipped_names
from generator.database.open import open_if_there
from generator.database.read import read_object
from generator.database.transaction import read_transaction
from generator.layout.recognition_rate import (
    answered_share,
    measured_answers,
    sensor_view,
    views_at,
)

Array = np.ndarray
KINDS = ("face", "edge", "corner")
BINS = (0.0, 0.4, 0.6, 0.8, 0.95, 1.001)  #: of the loaded share, in the table
STRENGTH = 0.02  #: of the pull of both numbers to 0, as in `promised.py`
SHIPPED = Path(__file__).parents[2] / "generator" / "layout" / "answers_of_types.json"


def touches_of(folder: Path, sensor: SensorType) -> Array:
    """Return (N, 3) of a type's touches: the usual sensor's probability, loaded share, right."""
    rows = [row for one in sorted(folder.glob("own-*")) for row in runner.rows_of(one)]
    if not rows:
        return np.empty((0, 3))
    engine = open_if_there(f"sqlite:///{folder / 'lab.db'}", writable=False)
    assert engine is not None, f"{folder}: touches of a lab that is not there"
    with read_transaction(engine) as connection:
        held = {n: read_object(connection, n) for n in {r["object"] for r in rows} - {""}}
    return np.array([
        _seen(row, held[row["object"]], sensor) for row in rows
        if row["object"] and row["kind"] in KINDS and row["level"] in LEVELS
    ]).reshape(-1, 3)  # fmt: skip


def _seen(row: dict[str, Any], held: Any, sensor: SensorType) -> tuple[float, float, bool]:
    face = next(face for face in held.faces if face.name == row["face"])
    layout = next(one for one in held.layout.faces if one.face == face.face_id)
    pitch = held.style.pitch_mm
    view = sensor_view(sensor, held.alphabet["reach"] * pitch + held.style.stroke_mm / 2)
    at, turn = np.array([[row["x_mm"], row["y_mm"]]]), np.radians([row["theta_deg"]])
    views = views_at(face.polygon_mm, layout, pitch, view, at, turn)
    table = measured_answers()
    usual = table.at(pitch / sensor.coarseness, views.seen, views.loaded)
    return float(usual[0]), float(views.loaded[0]), row["verdict"] == "right"


def likeliest(touches: Array) -> tuple[float, float]:
    """Return constant and weight of the loaded share, of the share of the usual answers.

    More load is never worse.
    """
    usual, loaded, right = touches.T

    def loss(logit: Array) -> float:
        p = np.clip(usual / (1 + np.exp(-(logit[0] + logit[1] * loaded))), 1e-9, 1 - 1e-9)
        likelihood = np.where(right > 0, np.log(p), np.log1p(-p)).sum()
        return float(STRENGTH / 2 * logit @ logit - likelihood)

    constant, by_loaded = minimize(loss, np.zeros(2), bounds=[(None, None), (0.0, None)]).x
    return round(float(constant), 2), round(float(by_loaded), 2)


def compare(name: str, touches: Array, sensor: SensorType) -> None:
    """Print promised and answered by how much of the sensor is loaded."""
    usual, loaded, right = touches.T
    share = answered_share(sensor)
    promised = usual if share is None else usual * share.at(loaded)
    for low, high in [*itertools.pairwise(BINS), (BINS[0], BINS[-1])]:
        some = (loaded >= low) & (loaded < high)
        if some.any():
            p, q = promised[some], right[some]
            chance = np.sqrt((p * (1 - p)).sum()) / len(p)
            runner.row(name, f"{low:g} to {min(high, 1):g}", len(p), f"{usual[some].mean():.2f}",
                       f"{p.mean():.2f} +- {chance:.2f}", f"{q.mean():.2f}")  # fmt: skip


def main() -> None:
    asked = runner.asked(__doc__, "folder", save=False)
    runner.table(("type", "loaded", "touches", "usual sensor's", "promised", "answered"))
    kept = {}
    for name in shipped_names():
        sensor = sensor_type_named(name)
        touches = touches_of(Path(asked.folder) / name, sensor)
        if not len(touches):
            continue
        compare(name, touches, sensor)
        if name != USUAL_SENSOR.name:
            kept[name] = {
                "touches": len(touches), "across_mm": round(sensor.across_mm, 2),
                "pitch_mm": sensor.symbol_pitch_mm, "logit": likeliest(touches),
            }  # fmt: skip
    if asked.save:
        lines = ",\n".join(f"  {json.dumps(n)}: {json.dumps(one)}" for n, one in kept.items())
        SHIPPED.write_text(f"{{\n{lines}\n}}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
