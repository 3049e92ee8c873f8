"""What whole parts promise, held against touches: steps, brackets, mugs, cans, models of others.

    python tests/campaigns/promised_parts.py -o out/parts --rounds 100  # 20 minutes

Every face that bears symbols, one of those that are alike, is touched once a round, anywhere, in
every third round again where the answer's `next` says, up to three times. A touch whose plate finds
no rest was not answered. The promise is that of `encode-object show`. What is there is kept, and an
interrupted run goes on.
"""

from __future__ import annotations

import json
import zlib
from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import runner
from promised import EVERY, LAB_KEY, LEVELS, Solid, bracket

from encoded_objects import encode
from encoded_objects.base.sensor_type import USUAL_SENSOR
from recognizer.touch.lab import open_lab
from recognizer.touch.reader import Reader
from recognizer.validation.touch_plan import TouchPlan
from recognizer.validation.trial import NEXT, RIGHT, judge, touch_until_answered

ROUND = ("cylinder", "cone")
Outline = list[tuple[float, float]]


def main() -> None:
    asked = runner.asked(__doc__, output=True, seed=36, rounds=100, only="")
    folder = asked.output
    folder.mkdir(parents=True, exist_ok=True)
    parts = {name: spec for name, spec in solids(folder).items() if asked.only in name}
    rows = []
    for name, spec in parts.items():
        lab = folder / f"{name.replace('/', '-')}.db"
        if not lab.exists():
            made = {"name": called(name), "output": {"lab_key": LAB_KEY}} | spec
            encode(made, database=str(lab), folder=lab.with_suffix(""), formats=("stl",))
        rows += touch_part(name, lab, asked.rounds, asked.seed)
    compare(folder, rows)


def called(name: str) -> str:
    """Return the name of the object of a part."""
    return name.replace("/", " ")


def profile(outline: Outline, depth: float) -> Solid:
    """Return a solid of this outline (x, z) along y, mm."""
    n = len(outline)
    vertices = [[x, y, z] for y in (0, depth) for x, z in outline]
    faces = [list(range(n)), list(range(2 * n - 1, n - 1, -1))]
    faces += [[k, k + n, (k + 1) % n + n, (k + 1) % n] for k in range(n)]
    return {"shape": {"polyhedron": {"vertices": vertices, "faces": faces}}}


def solids(folder: Path) -> dict[str, Solid]:
    """Return whole parts by class and name; writes the files of those that others have drawn."""
    import build123d as b

    low = (b.Align.CENTER, b.Align.CENTER, b.Align.MIN)
    corner = (b.Align.MIN,) * 3
    bore = b.Pos(0, 0, 10) * b.Cylinder(31, 80, align=low)
    handle = b.Pos(48, 0, 45) * (b.Box(40, 14, 60) - b.Pos(-2, 0, 0) * b.Box(26, 14, 40))
    drawn = {
        "bracket/angle.step": b.Box(80, 60, 12, align=corner) + b.Box(12, 60, 70, align=corner),
        "bracket/tee.stl": b.Box(90, 50, 14, align=low) + b.Box(14, 50, 60, align=low),
        "mug/plain.stl": b.Cylinder(40, 85, align=low) - bore,
        "mug/handle.step": b.Cylinder(40, 85, align=low) + handle - bore,
        "imported/tray.stl": b.Box(110, 90, 40, align=low)
        - b.Pos(0, 0, 12) * b.Box(90, 70, 40, align=low),
        "imported/flange.step": b.Box(100, 100, 10, align=low) + b.Cylinder(25, 50, align=low),
        "imported/shaft.step": b.Cylinder(35, 30, align=low) + b.Cylinder(22, 80, align=low),
        "imported/hexagon.stl": b.extrude(b.RegularPolygon(45, 6), 35),
    }
    files = {}
    for name, solid in drawn.items():
        file = (folder / called(name)).absolute()
        if not file.exists():
            write = b.export_step if file.suffix == ".step" else b.export_stl
            write(solid, str(file))
        files[name] = {"shape": {"file": str(file)}}
    stairs = [(0, 0), (120, 0), (120, 20), (80, 20), (80, 35), (40, 35), (40, 50), (0, 50)]
    low_steps = [(0, 0), (120, 0), (120, 20), (80, 20), (80, 21.5), (40, 21.5), (40, 24.5),
                 (0, 24.5)]  # fmt: skip
    channel = [(0, 0), (80, 0), (80, 40), (60, 40), (60, 15), (20, 15), (20, 40), (0, 40)]
    ramp = [(0, 0), (110, 0), (110, 50), (60, 20), (0, 20)]
    rounds: dict[str, Solid] = {
        "can 26": {"cylinder": {"diameter": "26 mm", "height": "60 mm"}},
        "can 40": {"cylinder": {"diameter": "40 mm", "height": "60 mm"}},
        "can 60": {"cylinder": {"diameter": "60 mm", "height": "80 mm"}},
        "can 100": {"cylinder": {"diameter": "100 mm", "height": "50 mm"}},
        "cone": {"cone": {"diameter": "70 mm", "height": "60 mm", "top_diameter": "40 mm"}},
        "tip": {"cone": {"diameter": "80 mm", "height": "90 mm"}},
    }
    return {
        "step/stairs": profile(stairs, 60),
        "step/low": profile(low_steps, 60),
        "step/channel": profile(channel, 70),
        "step/ramp": profile(ramp, 60),
        "bracket/bars": bracket(70, 70, 30),
        **files,
        **{f"round/{name}": {"shape": shape} for name, shape in rounds.items()},
    }


def promises(lab: Path, name: str) -> dict[str, Any]:
    """Return what `encode-object show` says of an object."""
    import contextlib
    import io

    from generator.command import run

    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        assert run(["show", called(name), "--database", str(lab), "--json"]) == 0
    return dict(json.loads(said.getvalue()))


def touch_part(name: str, lab: Path, rounds: int, seed: int) -> list[runner.Row]:
    """Touch every face of a part that bears symbols once a round; a row each."""
    reader = Reader(open_lab(lab), USUAL_SENSOR)
    alike = {}
    for one in promises(lab, name)["faces"]:  # the wall of a bore promises nothing
        promise = one["promise"]
        if one["symbols"] and (promise["at_once"] or one["type"] not in ROUND):
            key = one["type"], round(one["area_mm2"], 1), round(promise["blocked"], 1)
            alike.setdefault(key, one["name"])
    faces = list(alike.values())

    def touch(job: tuple[int, str]) -> runner.Row:
        number, face = job
        key = zlib.crc32(f"{name}/{face}".encode()) % 10**6 * 1000 + number
        most = 3 if number % EVERY == 0 else 1
        plan = TouchPlan(str(lab), seed, LEVELS[number // EVERY % len(LEVELS)], "anywhere",
                         policy=NEXT, only=f"{called(name)}/{face}")  # fmt: skip
        made = list(touch_until_answered(plan, key, reader, most))
        first, last = (judge(plan, key, one.found, one.answer, reader)
                       for one in (made[0], made[-1]))  # fmt: skip
        return {
            "part": name, "face": face, "number": number, "most": most,
            "no_rest": len(made[0].found.resampled), "first": first.verdict, "last": last.verdict,
            "reason": first.reason, "x_mm": round(first.x_mm, 3), "y_mm": round(first.y_mm, 3),
            "theta_deg": round(first.theta_deg, 3), "force_n": round(first.force_n, 1),
        }  # fmt: skip

    jobs = [(number, face) for number in range(rounds) for face in faces]
    return runner.resume(lab.with_suffix(".jsonl"), jobs, touch)


def compare(folder: Path, rows: Iterable[runner.Row]) -> None:
    """Print promised and answered by face and by class."""
    faces: dict[tuple[str, str], list[runner.Row]] = defaultdict(list)
    for row in rows:
        faces[row["part"], row["face"]].append(row)
    said = {part: promises(folder / f"{part.replace('/', '-')}.db", part) for part, _ in faces}
    heads = ("part", "face", "touches", "no rest", "at once: promised", "answered",
             "within three: promised", "answered", "why")  # fmt: skip
    runner.table(heads)
    classes: dict[str, list[tuple[float, ...]]] = defaultdict(list)
    for (part, name), touches in faces.items():
        face = next(one for one in said[part]["faces"] if one["name"] == name)
        promise = face["promise"]
        again = [row for row in touches if row["most"] > 1]
        values = (
            promise["at_once"], _share(touches, "first"),
            promise["within_three"], _share(again, "last"),
        )  # fmt: skip
        number, lost = len(touches), sum(row["no_rest"] for row in touches)
        shown = [f"{100 * value:.0f} %" for value in values]
        why = f"{', '.join(promise['meets'])} {promise['blocked']:.0%}" if promise["meets"] else ""
        runner.row(part, f"{name} ({face['type']})", number, lost, *shown, why)
        kind = "round faces" if face["type"] in ROUND else part.partition("/")[0]
        classes[kind].append((*values, number))
        if promise["meets"]:
            classes["beside another face"].append((*values, number))
    print()
    runner.table(("class", "faces", "touches", *heads[4:8], "apart"))
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


if __name__ == "__main__":
    main()
