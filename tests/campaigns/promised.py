"""What faces and whole parts promise, held against touches, and the tables that it rests on.

    python tests/campaigns/promised.py -o out/promised              # an hour and a half
    python tests/campaigns/promised.py -o out/promised --only mug   # some parts
    python tests/campaigns/promised.py -o out/promised --rounds 0 --save  # of what is there
    python tests/campaigns/promised.py -o out/million --types [--save]    # touches of million.py

Every face that bears symbols, one of those that are alike, is touched once a round, anywhere, in
every third round again where the answer's `next` says, up to three times. A touch whose plate
finds no rest was not answered. The promise is that of `encode-object show`. What is there is kept,
and an interrupted run goes on.

`--save` makes the table (`generator/layout/answers.json`) of the touches of the flat solids that
met no other face, as `generator.layout.sensor_view` sees them. `--types` holds touches of other
sensor types, worlds of `million.py`, against what `--sensor-type` promises; with `--save` it sets
each type's share of the usual sensor's answers (`answers_of_types.json`).
"""

import contextlib
import io
import itertools
import json
import zlib
from collections import defaultdict
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import runner
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import minimize

from encoded_objects import encode
from encoded_objects.base.sensor_type import USUAL_SENSOR, SensorType
from encoded_objects.base.sensor_type_file import sensor_type_named, shipped_names
from generator.command import run
from generator.database.open import open_if_there
from generator.database.read import read_object
from generator.database.transaction import read_transaction
from generator.layout.obstacle import solid_edges
from generator.layout.recognition_rate import AnswerTable, answered_share, measured_answers
from generator.layout.sensor_view import beside_obstacles, sensor_view, views_at
from recognizer.touch.lab import open_lab
from recognizer.touch.reader import Reader
from recognizer.validation.touch_plan import TouchPlan
from recognizer.validation.trial import NEXT, RIGHT, judge, touch_until_answered

Points = NDArray[np.float64]
Outline = list[tuple[float, float]]
Spec = dict[str, Any]

SHIPPED = Path(__file__).parents[2] / "generator" / "layout"
LAB_KEY = "0123-4567-89AB-CDER"
LEVELS = ("typical", "mismatch")
EVERY = 3  #: rounds, of which one goes on until a touch is answered
PITCH = (4.5, 5.0, 7.0)  #: mm, of the table's sheets
SEEN = (0.0, 2.0, 4.0, 6.0, 8.0, 11.0, 15.0, 20.0, 26.0)  #: of its rows
LOADED = (0.25, 0.4, 0.5, 0.6, 0.7, 0.85, 1.0)  #: and columns
WEIGHT = 8.0  #: touches that the smooth law counts for at every entry
STRENGTH = 0.02  #: of the pull of weights to 0
KINDS = ("face", "edge", "corner")  #: of a type's touches
BINS = (0.0, 0.4, 0.6, 0.8, 0.95, 1.001)  #: of the loaded share, in the table of types
ROUND = ("cylinder", "cone")

FLAT = "flat"  #: the solids that the table is made of, all in one lab
BOXES = [
    (75, 50, 30), (60, 22, 17), (42, 36, 26), (33, 20, 14), (90, 27, 24), (29, 18, 12),
    (65, 40, 20), (80, 28, 18), (70, 60, 12), (90, 35, 16), (31, 22, 19), (26, 21, 13),
    (85, 17, 14), (58, 23, 21), (62, 54, 46), (44, 41, 39), (78, 66, 27),
]  # fmt: skip
OTHER_PITCH = {"7 mm": [(72, 52, 31), (61, 27, 21)], "4.5 mm": [(59, 44, 18), (34, 25, 15)]}
PRISMS = [(55, 38), (32, 20), (60, 50), (45, 24), (36, 18), (70, 30), (28, 26)]
BRACKETS = [(70, 60, 12), (65, 50, 20), (72, 55, 12), (60, 48, 16), (80, 64, 24)]
OUTLINES: dict[str, tuple[Outline, float]] = {  # (x, z) and depth, mm
    "step/stairs": ([(0, 0), (120, 0), (120, 20), (80, 20), (80, 35), (40, 35), (40, 50), (0, 50)],
                    60),
    "step/low": ([(0, 0), (120, 0), (120, 20), (80, 20), (80, 21.5), (40, 21.5), (40, 24.5),
                  (0, 24.5)], 60),
    "step/channel": ([(0, 0), (80, 0), (80, 40), (60, 40), (60, 15), (20, 15), (20, 40), (0, 40)],
                     70),
    "step/ramp": ([(0, 0), (110, 0), (110, 50), (60, 20), (0, 20)], 60),
}  # fmt: skip
ROUNDS = {
    "round/can 26": {"cylinder": {"diameter": "26 mm", "height": "60 mm"}},
    "round/can 40": {"cylinder": {"diameter": "40 mm", "height": "60 mm"}},
    "round/can 60": {"cylinder": {"diameter": "60 mm", "height": "80 mm"}},
    "round/can 100": {"cylinder": {"diameter": "100 mm", "height": "50 mm"}},
    "round/cone": {"cone": {"diameter": "70 mm", "height": "60 mm", "top_diameter": "40 mm"}},
    "round/tip": {"cone": {"diameter": "80 mm", "height": "90 mm"}},
}


def main() -> None:
    """Touch what is asked for, print the tables, keep them with `--save`."""
    asked = runner.asked(__doc__, output=True, seed=36, rounds=100, only="", save=False,
                         types=False)  # fmt: skip
    folder = asked.output
    if asked.types:
        compare_types(folder, save=asked.save)
        return
    folder.mkdir(parents=True, exist_ok=True)
    rows: list[runner.Row] = []
    for lab, specs in labs(folder).items():
        if asked.only in lab:
            rows += touch_lab(folder, lab, specs, asked.rounds, asked.seed)
    compare(folder, rows)
    if asked.save:
        flat = [row for row in rows if row["lab"] == FLAT]
        seen = list(touches_seen(database_of(folder, FLAT), flat, USUAL_SENSOR))
        print(f"\n{len(seen)} of {len(flat)} touches of flat solids met no other face")
        (SHIPPED / "answers.json").write_text(json_of(measured_table(seen), len(seen)))


def labs(folder: Path) -> dict[str, dict[str, Spec]]:
    """Return specs by lab and object; writes the files of parts that others have drawn."""
    shapes = [{"box": [f"{mm} mm" for mm in sizes]} for sizes in BOXES]
    shapes += [{"triangular_prism": {"side": f"{side} mm", "height": f"{height} mm"}}
               for side, height in PRISMS]  # fmt: skip
    shapes += [profile(*bracket(*sizes)) for sizes in BRACKETS]
    flat: list[Spec] = [{"shape": shape} for shape in shapes]
    flat += [{"shape": {"box": [f"{mm} mm" for mm in sizes]}, "symbols": {"pitch": pitch}}
             for pitch, several in OTHER_PITCH.items() for sizes in several]  # fmt: skip
    parts = {name: profile(*outline) for name, outline in OUTLINES.items()}
    parts |= {"bracket/bars": profile(*bracket(70, 70, 30)), **drawn(folder), **ROUNDS}
    return {
        FLAT: {f"{FLAT} {k}": spec for k, spec in enumerate(flat, 1)},
        **{name: {name.replace("/", " "): {"shape": shape}} for name, shape in parts.items()},
    }


def bracket(length: float, height: float, leg: float) -> tuple[Outline, float]:
    """Return outline and depth of an L of square bars."""
    return [(0, 0), (length, 0), (length, leg), (leg, leg), (leg, height), (0, height)], leg


def profile(outline: Outline, depth: float) -> Spec:
    """Return a solid of this outline (x, z) along y, mm."""
    n = len(outline)
    vertices = [[x, y, z] for y in (0, depth) for x, z in outline]
    faces = [list(range(n)), list(range(2 * n - 1, n - 1, -1))]
    faces += [[k, k + n, (k + 1) % n + n, (k + 1) % n] for k in range(n)]
    return {"polyhedron": {"vertices": vertices, "faces": faces}}


def drawn(folder: Path) -> dict[str, Spec]:
    """Write the models of another program, and return their shapes."""
    import build123d as b

    low = (b.Align.CENTER, b.Align.CENTER, b.Align.MIN)
    corner = (b.Align.MIN,) * 3
    bore = b.Pos(0, 0, 10) * b.Cylinder(31, 80, align=low)
    handle = b.Pos(48, 0, 45) * (b.Box(40, 14, 60) - b.Pos(-2, 0, 0) * b.Box(26, 14, 40))
    hollow = b.Pos(0, 0, 12) * b.Box(90, 70, 40, align=low)
    models = {
        "bracket/angle.step": b.Box(80, 60, 12, align=corner) + b.Box(12, 60, 70, align=corner),
        "bracket/tee.stl": b.Box(90, 50, 14, align=low) + b.Box(14, 50, 60, align=low),
        "mug/plain.stl": b.Cylinder(40, 85, align=low) - bore,
        "mug/handle.step": b.Cylinder(40, 85, align=low) + handle - bore,
        "imported/tray.stl": b.Box(110, 90, 40, align=low) - hollow,
        "imported/flange.step": b.Box(100, 100, 10, align=low) + b.Cylinder(25, 50, align=low),
        "imported/shaft.step": b.Cylinder(35, 30, align=low) + b.Cylinder(22, 80, align=low),
        "imported/hexagon.stl": b.extrude(b.RegularPolygon(45, 6), 35),
    }
    shapes = {}
    for name, solid in models.items():
        file = (folder / name.replace("/", " ")).absolute()
        if not file.exists():
            (b.export_step if file.suffix == ".step" else b.export_stl)(solid, str(file))
        shapes[name] = {"file": str(file)}
    return shapes


def database_of(folder: Path, lab: str) -> Path:
    return folder / f"{lab.replace('/', '-')}.db"


def promises(database: Path, name: str) -> dict[str, Any]:
    """Return what `encode-object show` says of an object."""
    with contextlib.redirect_stdout(io.StringIO()) as said:
        assert run(["show", name, "--database", str(database), "--json"]) == 0
    return dict(json.loads(said.getvalue()))


def touch_lab(
    folder: Path, lab: str, specs: dict[str, Spec], rounds: int, seed: int
) -> list[runner.Row]:
    """Touch every face of a lab that bears symbols once a round; a row each."""
    database = database_of(folder, lab)
    made = database.with_suffix("")
    for name, spec in specs.items():  # one by one: each has the pitch that suits it
        if not (made / name).exists():
            encode({"name": name, "output": {"lab_key": LAB_KEY}} | spec, database=str(database),
                   folder=made / name, formats=("stl",))  # fmt: skip
    faces = [(name, face) for name in specs for face in unlike_faces(promises(database, name))]
    reader = Reader(open_lab(database), USUAL_SENSOR)

    def touch(job: tuple[int, str, str]) -> runner.Row:
        number, name, face = job
        key = zlib.crc32(f"{name}/{face}".encode()) % 10**6 * 1000 + number
        most = 3 if number % EVERY == 0 else 1
        plan = TouchPlan(str(database), seed, LEVELS[number // EVERY % len(LEVELS)], "anywhere",
                         policy=NEXT, only=f"{name}/{face}")  # fmt: skip
        touches = list(touch_until_answered(plan, key, reader, most))
        first, last = (judge(plan, key, one.found, one.answer, reader)
                       for one in (touches[0], touches[-1]))  # fmt: skip
        return {
            "lab": lab, "object": name, "face": face, "most": most,
            "no_rest": len(touches[0].found.resampled), "first": first.verdict,
            "last": last.verdict, "reason": first.reason, "x_mm": round(first.x_mm, 3),
            "y_mm": round(first.y_mm, 3), "theta_deg": round(first.theta_deg, 3),
        }  # fmt: skip

    jobs = [(number, *face) for number in range(rounds) for face in faces]
    return runner.resume(database.with_suffix(".jsonl"), jobs, touch)


def unlike_faces(part: dict[str, Any]) -> list[str]:
    """Return the faces of a part that bear symbols, one of those that are alike."""
    alike: dict[tuple[Any, ...], str] = {}
    for face in part["faces"]:  # the wall of a bore promises nothing
        promise = face["promise"]
        if face["symbols"] and (promise["at_once"] or face["type"] not in ROUND):
            key = face["type"], round(face["area_mm2"], 1), round(promise["blocked"], 1)
            alike.setdefault(key, face["name"])
    return list(alike.values())


def compare(folder: Path, rows: Iterable[runner.Row]) -> None:
    """Print promised and answered by face and by class."""
    faces: dict[tuple[str, str, str], list[runner.Row]] = defaultdict(list)
    for row in rows:
        faces[row["lab"], row["object"], row["face"]].append(row)
    said = {name: promises(database_of(folder, lab), name) for lab, name, _ in faces}
    shares = ("at once: promised", "answered", "within three: promised", "answered")
    runner.table(("part", "face", "touches", "no rest", *shares, "why"))
    classes: dict[str, list[tuple[float, ...]]] = defaultdict(list)
    for (lab, part, name), touches in faces.items():
        face = next(one for one in said[part]["faces"] if one["name"] == name)
        promise = face["promise"]
        again = [row for row in touches if row["most"] > 1]
        answered, later = _share(touches, "first"), _share(again, "last")
        values = promise["at_once"], answered, promise["within_three"], later
        shown = [f"{100 * value:.0f} %" for value in values]
        why = f"{', '.join(promise['meets'])} {promise['blocked']:.0%}" if promise["meets"] else ""
        lost = sum(row["no_rest"] for row in touches)
        runner.row(part, f"{name} ({face['type']})", len(touches), lost, *shown, why)
        kind = "round faces" if face["type"] in ROUND else lab.partition("/")[0]
        classes[kind].append((*values, len(touches)))
        if promise["meets"]:
            classes["beside another face"].append((*values, len(touches)))
    print()
    runner.table(("class", "faces", "touches", *shares, "apart"))
    for kind, some in classes.items():
        *values, number = np.array(some).T
        means = [100 * float(one.mean()) for one in values]
        apart = f"{means[0] - means[1]:+.1f}, {means[2] - means[3]:+.1f}"
        shown = [f"{mean:.1f} %" for mean in means]
        runner.row(kind, len(some), int(number.sum()), *shown, apart)


def _share(touches: list[runner.Row], which: str) -> float:
    """Return the share that is right of touches, those that found no rest among them."""
    right = sum(row[which] == RIGHT for row in touches)
    return right / max(1, len(touches) + sum(row["no_rest"] for row in touches))


def touches_seen(
    database: Path, rows: Iterable[runner.Row], sensor: SensorType
) -> Iterator[runner.Row]:
    """Yield the touches that met no other face, with what the sensor saw.

    `seen`, `loaded` and `around` are those of `FaceViews`, `usual` is the probability that the
    usual sensor answers at once, `pitch_mm` the symbols'.
    """
    engine = open_if_there(f"sqlite:///{database}", writable=False)
    assert engine is not None, f"{database}: touches of a lab that is not there"
    faces: dict[tuple[str, str], list[runner.Row]] = defaultdict(list)
    for row in rows:
        faces[row["object"], row["face"]].append(row)
    for (name, face_name), own in faces.items():
        with read_transaction(engine) as connection:
            held = read_object(connection, name)
        face = next(face for face in held.faces if face.name == face_name)
        layout = next(one for one in held.layout.faces if one.face == face.face_id)
        style, letters = held.style, held.alphabet
        view = sensor_view(sensor, letters["reach"] * style.pitch_mm + style.stroke_mm / 2)
        at = np.array([(row["x_mm"], row["y_mm"]) for row in own])
        turn = np.radians([row["theta_deg"] for row in own])
        views = views_at(face.polygon_mm, layout, style.pitch_mm, view, at, turn)
        solid = solid_edges(held.polyhedron)
        views = beside_obstacles(views, solid, face.T_object_face, style.height_mm, view)
        table = measured_answers(letters["name"])
        usual = table.at(style.pitch_mm / sensor.coarseness, views.seen, views.loaded)
        for k, row in enumerate(own):
            if not views.blocked[k]:
                yield row | {"pitch_mm": style.pitch_mm, "usual": float(usual[k]),
                             "seen": int(views.seen[k]), "loaded": float(views.loaded[k]),
                             "around": int(views.around[k])}  # fmt: skip


def columns(rows: Iterable[runner.Row], *names: str) -> Points:
    return np.array([[row[name] for row in rows] for name in names], float)


def measured_table(touches: list[runner.Row]) -> AnswerTable:
    """Return the table: at each entry the share of the touches near it, and a smooth law's.

    The law, a logistic one of all pitches together, stands for `WEIGHT` touches.
    """
    seen, loaded, pitch = columns(touches, "seen", "loaded", "pitch_mm")
    right = np.array([row["first"] == RIGHT for row in touches], float)
    law = _fit(_terms(seen, loaded, pitch), right)
    nearest = np.abs(pitch[:, None] - PITCH).argmin(axis=1)
    shares = _near(seen, SEEN)[:, :, None] * _near(loaded, LOADED)[:, None, :]
    sheets = []
    for k, sheet_pitch in enumerate(PITCH):
        own = nearest == k
        number = shares[own].sum(axis=0)
        answered = (shares[own] * right[own, None, None]).sum(axis=0)
        grid = np.meshgrid(SEEN, LOADED, indexing="ij")
        smooth = 1 / (1 + np.exp(-_terms(*grid, np.full_like(grid[0], sheet_pitch)) @ law))
        sheet = (answered + WEIGHT * smooth) / (number + WEIGHT)
        sheet[0] = 0.0  # nothing seen whole
        sheets.append(sheet)
    later = [t for t in touches if t["most"] > 1 and t["first"] != RIGHT and t["around"] > 0]
    around, seen = np.log1p(columns(later, "around", "seen"))
    terms = np.stack([np.ones(len(later)), around, seen], axis=1)
    again = _fit(terms, np.array([t["last"] == RIGHT for t in later], float))
    return AnswerTable(PITCH, SEEN, LOADED, np.array(sheets), tuple(again.tolist()))


def _near(values: Points, steps: tuple[float, ...]) -> Points:
    """Return (N, steps) how near each value is to each step: 1 there, 0 at the next one."""
    return np.array([np.interp(values, steps, row) for row in np.eye(len(steps))]).T


def _terms(seen: ArrayLike, loaded: ArrayLike, pitch_mm: ArrayLike) -> Points:
    seen, loaded = np.log1p(np.asarray(seen, float)), np.asarray(loaded, float)
    pitch = np.log(np.asarray(pitch_mm, float))
    return np.stack([np.ones_like(seen), seen, loaded, pitch, seen * loaded], axis=-1)


def _fit(x: Points, y: Points, steps: int = 30) -> Points:
    """Return the weights of a logistic regression of y (n,) on x (n, k), by Newton's method."""
    weights = np.zeros(x.shape[1])
    for _ in range(steps):
        p = 1 / (1 + np.exp(-np.clip(x @ weights, -30, 30)))
        slope = x.T @ (y - p) - STRENGTH * weights
        curve = (x * (p * (1 - p))[:, None]).T @ x + STRENGTH * np.eye(len(weights))
        weights = weights + np.linalg.solve(curve, slope)
    return weights


def json_of(table: AnswerTable, touches: int) -> str:
    """Return what `answers.json` holds, a row of a sheet in a line."""
    head = {"touches": touches, "pitch_mm": table.pitch_mm, "seen": table.seen,
            "loaded": table.loaded, "again": np.round(table.again, 3).tolist()}  # fmt: skip
    sheets = (
        ",\n      ".join(json.dumps(row) for row in sheet)
        for sheet in np.round(table.probability, 3).tolist()
    )
    probability = "],\n    [".join(f"\n      {sheet}\n    " for sheet in sheets)
    lines = [f'  "{name}": {json.dumps(value)}' for name, value in head.items()]
    lines.append(f'  "probability": [\n    [{probability}]\n  ]')
    return "{\n" + ",\n".join(lines) + "\n}\n"


def compare_types(folder: Path, *, save: bool) -> None:
    """Hold what is promised to each type against its touches in a run of `million.py`."""
    runner.table(("type", "loaded", "touches", "usual sensor's", "promised", "answered"))
    kept = {}
    for name in shipped_names():
        rows = [row for row in runner.rows_of(folder / name)
                if row["object"] and row["kind"] in KINDS and row["level"] in LEVELS]  # fmt: skip
        if not rows:
            continue
        sensor = sensor_type_named(name)
        touches = list(touches_seen(folder / name / "lab.db", rows, sensor))
        usual, loaded = columns(touches, "usual", "loaded")
        right = np.array([row["verdict"] == RIGHT for row in touches])
        share = answered_share(sensor)
        promised = usual if share is None else usual * share.at(loaded)
        for low, high in [*itertools.pairwise(BINS), (BINS[0], BINS[-1])]:
            some = (loaded >= low) & (loaded < high)
            if some.any():
                p = promised[some]
                chance = np.sqrt((p * (1 - p)).sum()) / len(p)
                runner.row(name, f"{low:g} to {min(high, 1):g}", len(p),
                           f"{usual[some].mean():.2f}", f"{p.mean():.2f} +- {chance:.2f}",
                           f"{right[some].mean():.2f}")  # fmt: skip
        kept[name] = {"touches": len(touches), "logit": likeliest(usual, loaded, right)}
    if save:
        lines = ",\n".join(f"  {json.dumps(n)}: {json.dumps(one)}" for n, one in kept.items())
        (SHIPPED / "answers_of_types.json").write_text(f"{{\n{lines}\n}}\n", encoding="utf-8")


def likeliest(usual: Points, loaded: Points, right: NDArray[np.bool_]) -> tuple[float, float]:
    """Return constant and weight of the loaded share, of the share of the usual answers.

    More load is never worse.
    """

    def loss(logit: Points) -> float:
        p = np.clip(usual / (1 + np.exp(-(logit[0] + logit[1] * loaded))), 1e-9, 1 - 1e-9)
        likelihood = np.where(right, np.log(p), np.log1p(-p)).sum()
        return float(STRENGTH / 2 * logit @ logit - likelihood)

    constant, by_loaded = minimize(loss, np.zeros(2), bounds=[(None, None), (0.0, None)]).x
    return round(float(constant), 2), round(float(by_loaded), 2)


if __name__ == "__main__":
    main()
