"""What faces promise, measured with today's reader, and held against faces it was not set on.

    python tests/campaigns/promised.py -o out/promised --save    # touches, table, check: an hour
    python tests/campaigns/promised.py -o out/promised --rounds 0  # of the touches that are there
    python tests/campaigns/promised.py -o out/types --types [--save]  # touches of sensor_types.py

A table that is made from the first of two sets of solids is checked on 60 faces of all sizes of the
second; `--save` keeps a table of both (`generator/layout/answers.json`). In each round every face
is touched once, anywhere, and in every third round again where the answer's `next` says, up to
three times; so any number of rounds is a fair sample. A touch is looked at as
`generator.layout.sensor_view` sees it; places where the sensor meets another face are left
out, since nothing is promised there. A step over a re-entrant edge may end on another face, which
counts as not answered. What is there is kept, and an interrupted run goes on.

With `--types` touches of other sensor types are held against what `encode-object --sensor-type`
promises; `--save` sets that: each type's share of the usual sensor's answers (`AnsweredShare`) is
the likeliest for its touches inside faces, at edges and corners
(`generator/layout/answers_of_types.json`).
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import runner
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import minimize

from encoded_objects import encode
from encoded_objects.base.sensor_type import USUAL_SENSOR, SensorType
from encoded_objects.base.sensor_type_file import sensor_type_named, shipped_names
from generator.database.open import open_if_there
from generator.database.read import object_names, read_object
from generator.database.transaction import read_transaction
from generator.layout.obstacle import SolidEdges, solid_edges
from generator.layout.placement import FaceLayout
from generator.layout.recognition_rate import (
    AnswerTable,
    answered_at_once,
    answered_share,
    measured_answers,
)
from generator.layout.sensor_view import (
    SensorView,
    beside_obstacles,
    sensor_view,
    views_at,
)
from recognizer.touch.lab import open_lab
from recognizer.touch.reader import Reader
from recognizer.validation.touch_plan import TouchPlan
from recognizer.validation.trial import NEXT, judge, touch_until_answered

Points = NDArray[np.float64]

LEVELS = ("typical", "mismatch")
PITCH = (4.5, 5.0, 7.0)  #: mm, of the table's sheets
SEEN = (0.0, 2.0, 4.0, 6.0, 8.0, 11.0, 15.0, 20.0, 26.0)  #: of its rows
LOADED = (0.25, 0.4, 0.5, 0.6, 0.7, 0.85, 1.0)  #: and columns
WEIGHT = 8.0  #: touches that the smooth law counts for at every entry
CLASSES_MM = (0.0, 16.0, 22.0, 30.0, 45.0, 1e3)  #: narrower side of a face
LAB_KEY = "0123-4567-89AB-CDER"
EVERY = 3  #: rounds, of which one goes on until a touch is answered
KINDS = ("face", "edge", "corner")
BINS = (0.0, 0.4, 0.6, 0.8, 0.95, 1.001)  #: of the loaded share, in the table
STRENGTH = 0.02  #: of the pull of both numbers to 0, of the weights of a fit
SHIPPED = Path(__file__).parents[2] / "generator" / "layout"

Solid = dict[str, Any]


def box(x: float, y: float, z: float, **more: Any) -> Solid:
    sizes = [f"{v:g} mm" for v in (x, y, z)]
    return {"shape": {"box": sizes}} | more


def prism(side: float, height: float, **more: Any) -> Solid:
    shape = {"triangular_prism": {"side": f"{side:g} mm", "height": f"{height:g} mm"}}
    return {"shape": shape} | more


def bracket(length: float, height: float, leg: float) -> Solid:
    """Return an L of square bars."""
    outline = [(0, 0), (length, 0), (length, leg), (leg, leg), (leg, height), (0, height)]
    vertices = [[x, y, z] for y in (0, leg) for x, z in outline]
    faces = [[0, 1, 2, 3, 4, 5], [6, 11, 10, 9, 8, 7]]
    faces += [[k, k + 6, (k + 1) % 6 + 6, (k + 1) % 6] for k in range(6)]
    return {"shape": {"polyhedron": {"vertices": vertices, "faces": faces}}}


COARSE: Solid = {"symbols": {"pitch": "7 mm"}}
FINE: Solid = {"symbols": {"pitch": "4.5 mm"}}
SETS: dict[str, list[Solid]] = {
    "learn": [
        box(75, 50, 30), box(60, 22, 17), box(42, 36, 26), box(33, 20, 14), box(90, 27, 24),
        box(29, 18, 12), prism(55, 38), prism(32, 20), bracket(70, 60, 12), bracket(65, 50, 20),
        box(72, 52, 31, **COARSE), box(61, 27, 21, **COARSE), box(59, 44, 18, **FINE),
        box(34, 25, 15, **FINE),
    ],
    "check": [
        box(65, 40, 20), box(80, 28, 18), box(70, 60, 12),
        box(90, 35, 16), box(31, 22, 19), box(26, 21, 13), box(85, 17, 14),
        box(58, 23, 21), box(62, 54, 46), box(44, 41, 39), box(78, 66, 27),
        prism(60, 50), prism(45, 24), prism(36, 18), prism(70, 30), prism(28, 26),
        bracket(72, 55, 12), bracket(60, 48, 16), bracket(80, 64, 24),
    ],
}  # fmt: skip


@dataclass(frozen=True)
class Face:
    """One of a set that is touched."""

    group: str
    name: str  #: object/face
    pitch_mm: float
    size_mm: tuple[float, float]
    loops: tuple[Points, ...]
    layout: FaceLayout
    view: SensorView
    solid: SolidEdges
    T_object_face: Points
    height_mm: float  #: of its symbols


@dataclass(frozen=True)
class Touched:
    """A touch as the promise sees it, and what became of it."""

    group: str
    face: str
    size_mm: tuple[float, float]
    pitch_mm: float
    level: str
    anew: int  #: times that it was drawn again, because the plate found no rest
    x_mm: float  #: of the sensor's centre, face frame
    y_mm: float
    turn_rad: float
    edge_mm: float  #: from there
    seen: int
    lines: int
    loaded: float
    around: int  #: symbols that stand about the centre, `views.SensorView.around_mm`
    most: int  #: touches that were allowed
    touches: int  #: that were made
    first: str  #: what the first said: right, wrong, rejected
    last: str
    reason: str

    @property
    def right(self) -> bool:
        """Whether it was answered at once."""
        return self.first == "right"


def main() -> None:
    asked = runner.asked(__doc__, output=True, seed=25, rounds=100, save=False, types=False)
    if asked.types:
        compare_types(asked.output, save=asked.save)
        return
    touches = list(map(_touched, touch_faces(asked.output, asked.rounds, asked.seed)))
    touches = on_free_places(touches, asked.output)
    table = measured_table([one for one in touches if one.group == "learn"])
    for label, one in (("that ships", measured_answers()), ("of the first set", table)):
        print(f"\nthe second set against the table {label}")
        compare([t for t in touches if t.group == "check"], one)
    if asked.save:
        text = json_of(measured_table(touches), len(touches))
        (SHIPPED / "answers.json").write_text(text)


def _touched(values: dict[str, Any]) -> Touched:
    lists = {k: tuple(v) for k, v in values.items() if isinstance(v, list)}
    return Touched(**(values | lists))


def touch_faces(folder: Path, rounds: int, seed: int) -> list[runner.Row]:
    """Touch every face once a round, the rounds that are not there yet."""
    folder.mkdir(parents=True, exist_ok=True)
    readers, faces = {}, []
    for group, solids in SETS.items() if rounds else ():
        lab = folder / f"{group}.db"
        if not lab.exists():
            unfinished = lab.with_suffix(".part")
            unfinished.unlink(missing_ok=True)
            for k, solid in enumerate(solids):  # one by one: each has the pitch that suits it
                spec = {"name": f"{group} {k + 1}", "output": {"lab_key": LAB_KEY}} | solid
                made = folder / group / str(k)
                encode(spec, database=str(unfinished), folder=made, formats=())
            unfinished.rename(lab)
        readers[group] = Reader(open_lab(lab), USUAL_SENSOR)
        faces += list(faces_of(lab, group))

    def touch(number: int) -> runner.Row:
        face, most = faces[number % len(faces)], 3 if number // len(faces) % EVERY == 0 else 1
        lab = str(folder / f"{face.group}.db")
        return asdict(touch_face(face, lab, number, most, readers[face.group], seed))

    return runner.resume(folder / "touches.jsonl", range(rounds * len(faces)), touch)


def on_free_places(touches: Sequence[Touched], folder: Path) -> list[Touched]:
    """Return the touches at which the sensor met no other face."""
    found = []
    for face in (one for group in SETS for one in faces_of(folder / f"{group}.db", group)):
        own = [touch for touch in touches if touch.face == face.name]
        at = np.array([(touch.x_mm, touch.y_mm, touch.turn_rad) for touch in own]).reshape(-1, 3)
        views = views_at(face.loops, face.layout, face.pitch_mm, face.view, at[:, :2], at[:, 2])
        views = beside_obstacles(views, face.solid, face.T_object_face, face.height_mm, face.view)
        found += [touch for touch, met in zip(own, views.blocked, strict=True) if not met]
    print(f"{len(found)} of {len(touches)} touches met no other face")
    return found


def faces_of(lab: Path, group: str) -> Iterator[Face]:
    """Yield the faces of a set that bear symbols, one of those that are equal."""
    engine = open_if_there(f"sqlite:///{lab}", writable=False)
    assert engine is not None
    known = set()
    with read_transaction(engine) as connection:
        for k, name in enumerate(object_names(connection)):
            held = read_object(connection, name)
            pitch = held.style.pitch_mm
            reach = held.alphabet["reach"] * pitch + held.style.stroke_mm / 2
            view = sensor_view(USUAL_SENSOR, reach)
            layouts = {one.face: one for one in held.layout.faces}
            solid = solid_edges(held.polyhedron)
            for face in held.faces:
                layout = layouts[face.face_id]
                low, high = sorted(np.ptp(face.polygon_mm[0], axis=0).round(1).tolist())
                if not len(layout.labels) or (k, low, high) in known:
                    continue
                known.add((k, low, high))
                name = f"{group} {k + 1}/{face.name}"
                yield Face(group, name, pitch, (low, high), face.polygon_mm, layout, view,
                           solid, face.T_object_face, held.style.height_mm)  # fmt: skip


def touch_face(face: Face, lab: str, number: int, most: int, reader: Reader, seed: int) -> Touched:
    level = LEVELS[int(np.random.default_rng([seed, number, 2]).integers(len(LEVELS)))]
    plan = TouchPlan(lab, seed, level, "anywhere", policy=NEXT, only=face.name)
    made = list(touch_until_answered(plan, number, reader, most))
    first, last = (
        judge(plan, number, one.found, one.answer, reader) for one in (made[0], made[-1])
    )
    at = np.array([[first.x_mm, first.y_mm]])
    turn = np.array([np.radians(first.theta_deg)])
    views = views_at(face.loops, face.layout, face.pitch_mm, face.view, at, turn)
    return Touched(
        face.group, face.name, face.size_mm, face.pitch_mm, level,
        anew=len(made[0].found.resampled), x_mm=round(first.x_mm, 3), y_mm=round(first.y_mm, 3),
        turn_rad=round(float(turn[0]), 5), edge_mm=round(first.edge_mm, 3),
        seen=int(views.seen[0]), lines=int(views.lines[0]), loaded=round(float(views.loaded[0]), 4),
        around=int(views.around[0]), most=most, touches=len(made),
        first=first.verdict, last=last.verdict, reason=first.reason,
    )  # fmt: skip


def compare(touches: list[Touched], table: AnswerTable) -> None:
    """Print promise and reading by size and face, and how far they lie apart."""
    for title, within in (("at once", False), ("within three", True)):
        some = [one for one in touches if one.most > 1] if within else touches
        names = sorted({one.face for one in some})
        print(f"{title}: promised, answered; {len(some)} touches of {len(names)} faces")
        for low, high in itertools.pairwise(CLASSES_MM):
            sized = [one for one in some if low <= min(one.size_mm) < high]
            if sized:
                p, right, error = _shares(sized, table, within)
                faces = len({one.face for one in sized})
                print(f"  {low:g}-{high:g} mm, {faces:2d} faces, {len(sized):5d}  {p:.3f}"
                      f"  {right:.3f}  +- {error:.3f}  apart {p - right:+.3f}")  # fmt: skip
        each = [_shares([t for t in some if t.face == name], table, within) for name in names]
        apart = np.array([p - right for p, right, _ in each])
        chance = np.array([error for *_, error in each])
        near, by_chance = np.abs(apart) <= 0.05, np.abs(apart) <= 0.05 + 2 * chance
        print(f"  faces within .05: {near.sum()} of {len(names)}, or {by_chance.sum()} with two"
              f" errors of chance; rms {np.sqrt(np.mean(apart**2)):.3f},"
              f" of chance alone {np.sqrt(np.mean(chance**2)):.3f}")  # fmt: skip


def _shares(
    touches: Sequence[Touched], table: AnswerTable, within: bool
) -> tuple[float, float, float]:
    """Return what is promised and answered, and the standard error of the second."""
    p = np.array([
        answered_at_once(table, t.pitch_mm, np.array([t.seen]), np.array([t.loaded]))[0]
        for t in touches
    ])  # fmt: skip
    right = [t.right for t in touches]
    if within:
        seen, around = np.array([(t.seen, t.around) for t in touches]).T
        later = table.later(seen, around)
        p, right = p + (1 - p) * later, [t.last == "right" for t in touches]
    error = float(np.sqrt((p * (1 - p)).sum())) / len(touches)
    return float(p.mean()), float(np.mean(right)), error


def tally(touches: Iterable[Touched]) -> tuple[Points, Points]:
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
    """Return the table: at each entry the share of the touches near it, and a smooth law's.

    The law, a logistic one of all pitches together, stands for `WEIGHT` touches.
    """
    right_at_once = np.array([t.right for t in touches], float)
    law = _fit(
        _terms(*np.array([(t.seen, t.loaded, t.pitch_mm) for t in touches]).T), right_at_once
    )
    nearest = np.abs(np.array([[t.pitch_mm] for t in touches]) - PITCH).argmin(axis=1)
    sheets = []
    for k, pitch in enumerate(PITCH):
        right, number = tally(t for t, sheet in zip(touches, nearest, strict=True) if sheet == k)
        seen, loaded = np.meshgrid(SEEN, LOADED, indexing="ij")
        smooth = 1 / (1 + np.exp(-_terms(seen, loaded, np.full_like(seen, pitch)) @ law))
        sheet = (right + WEIGHT * smooth) / (number + WEIGHT)
        sheet[0] = 0.0  # nothing seen whole
        sheets.append(sheet)
    later = [t for t in touches if t.most > 1 and not t.right and t.around > 0]
    terms = np.array([(1.0, np.log1p(t.around), np.log1p(t.seen)) for t in later])
    again = _fit(terms, np.array([t.last == "right" for t in later], float))
    return AnswerTable(PITCH, SEEN, LOADED, np.array(sheets), tuple(again.tolist()))


def _terms(seen: ArrayLike, loaded: ArrayLike, pitch_mm: ArrayLike) -> Points:
    seen, loaded = np.log1p(np.asarray(seen, float)), np.asarray(loaded, float)
    pitch = np.log(np.asarray(pitch_mm, float))
    return np.stack([np.ones_like(seen), seen, loaded, pitch, seen * loaded], axis=-1)


def _fit(x: Points, y: Points, steps: int = 30, ridge: float = STRENGTH) -> Points:
    """Return the weights of a logistic regression of y (n,) on x (n, k), by Newton's method."""
    weights = np.zeros(x.shape[1])
    for _ in range(steps):
        p = 1 / (1 + np.exp(-np.clip(x @ weights, -30, 30)))
        slope = x.T @ (y - p) - ridge * weights
        curve = (x * (p * (1 - p))[:, None]).T @ x + ridge * np.eye(len(weights))
        weights = weights + np.linalg.solve(curve, slope)
    return weights


def touches_of(folder: Path, sensor: SensorType) -> Points:
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
    table = measured_answers(held.alphabet["name"])
    usual = table.at(pitch / sensor.coarseness, views.seen, views.loaded)
    return float(usual[0]), float(views.loaded[0]), row["verdict"] == "right"


def likeliest(touches: Points) -> tuple[float, float]:
    """Return constant and weight of the loaded share, of the share of the usual answers.

    More load is never worse.
    """
    usual, loaded, right = touches.T

    def loss(logit: Points) -> float:
        p = np.clip(usual / (1 + np.exp(-(logit[0] + logit[1] * loaded))), 1e-9, 1 - 1e-9)
        likelihood = np.where(right > 0, np.log(p), np.log1p(-p)).sum()
        return float(STRENGTH / 2 * logit @ logit - likelihood)

    constant, by_loaded = minimize(loss, np.zeros(2), bounds=[(None, None), (0.0, None)]).x
    return round(float(constant), 2), round(float(by_loaded), 2)


def compare_type(name: str, touches: Points, sensor: SensorType) -> None:
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


def compare_types(folder: Path, *, save: bool) -> None:
    """Hold what is promised to each type against the touches of `sensor_types.py`."""
    runner.table(("type", "loaded", "touches", "usual sensor's", "promised", "answered"))
    kept = {}
    for name in shipped_names():
        sensor = sensor_type_named(name)
        touches = touches_of(folder / name, sensor)
        if not len(touches):
            continue
        compare_type(name, touches, sensor)
        if name != USUAL_SENSOR.name:
            kept[name] = {
                "touches": len(touches), "across_mm": round(sensor.across_mm, 2),
                "pitch_mm": sensor.symbol_pitch_mm, "logit": likeliest(touches),
            }  # fmt: skip
    if save:
        lines = ",\n".join(f"  {json.dumps(n)}: {json.dumps(one)}" for n, one in kept.items())
        (SHIPPED / "answers_of_types.json").write_text(f"{{\n{lines}\n}}\n", encoding="utf-8")


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
        f'  "again": {json.dumps([round(value, 3) for value in table.again])}',
        f'  "probability": [\n    [{rows}]\n  ]',
    ]
    return "{\n" + ",\n".join(lines) + "\n}\n"


if __name__ == "__main__":
    main()
