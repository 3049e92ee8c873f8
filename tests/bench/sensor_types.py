"""Shipped sensor types on symbols of the pitch that each proposes: right, wrong, refused, errors.

    python tests/bench/sensor_types.py --touches 25                     # all types, typical
    python tests/bench/sensor_types.py gel-24x32 --levels sound,mismatch --kinds face,edge
    python tests/bench/sensor_types.py --faces 9,10,12,15               # small faces under the gel

Registered faces of two objects, or small square faces of which one touch within 1.5 mm of the
middle is asked, 4 to 12 N. `validate-set --sensor-type` does the same on written files, with more.
"""

from __future__ import annotations

import argparse
import math
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np

from encoded_objects import Reader, encode, open_lab
from probe.contact.contract import Touch
from probe.sensor_types import proposed_pitch_mm
from probe.sensor_types.read import sensor_type_named, shipped_names
from probe.simulate.registered import registered_surface
from probe.simulate.world.levels import LEVELS
from probe.simulate.world.reading import read_sensor
from recognizer.touch.recognise import recognise
from recognizer.validation.draw import TouchPlan, draw_touch
from recognizer.validation.trial import judge

SHAPES = {"Cube": {"cube": "80 mm"}, "Box": {"box": ["90 mm", "70 mm", "60 mm"]}}


def make_lab(folder: Path, pitch_mm: float, shapes: dict[str, object]) -> str:
    """Register objects with symbols of a pitch; return the database."""
    database = str(folder / f"lab-{pitch_mm:g}-{len(shapes)}.db")
    if not Path(database).exists():
        printer = "resin" if pitch_mm < 5 else "fdm-0.4"
        for name, shape in shapes.items():
            spec = {"name": name, "shape": shape, "profile": "large", "print": {"printer": printer}}
            encode(spec | {"symbols": {"pitch": f"{pitch_mm} mm"}}, database=database, formats=())
    return database


def print_type(folder: Path, name: str, touches: int, levels: list[str], kinds: list[str]) -> None:
    """Print what becomes of touches of a sensor type."""
    sensor = sensor_type_named(name)
    pitch = proposed_pitch_mm(sensor)
    database = make_lab(folder, pitch, SHAPES)
    reader = Reader(open_lab(database), sensor)
    for level in levels:
        for kind in kinds:
            plan, verdicts, errors, inside, spent = (
                TouchPlan(database, 1, level, kind),
                Counter[str](),
                [],
                0,
                0.0,
            )
            for number in range(touches):
                found = draw_touch(plan, number, reader)
                start = time.process_time()
                answer = recognise(reader, reader.signal(found.counts), number)
                spent += time.process_time() - start
                one = judge(plan, number, found, answer, 0.0)
                verdicts[one.verdict] += 1
                if one.verdict == "right":
                    errors.append((one.error_mm, one.error_deg))
                    inside += one.chi2 < 7.815
            rms = np.sqrt(np.mean(np.square(errors), axis=0)) if errors else (math.nan, math.nan)
            share = inside / max(len(errors), 1)
            counted = ", ".join(f"{key} {verdicts[key]}" for key in ("right", "wrong", "rejected"))
            errors_text = f"{rms[0]:.3f} mm, {rms[1]:.3f} degrees, inside {share:.2f}"
            ms = 1e3 * spent / touches
            print(f"{name}, {pitch:g} mm, {level}, {kind}: {counted}; {errors_text}; {ms:.0f} ms")


def print_small_faces(folder: Path, sides: list[int], touches: int, levels: list[str]) -> None:
    """Print how often the gel names square faces by one touch."""
    sensor = sensor_type_named("gel-24x32")
    shapes: dict[str, object] = {
        f"S{side}": {"box": [f"{side} mm", f"{side} mm", "30 mm"]} for side in sides
    }
    database = make_lab(folder, proposed_pitch_mm(sensor), shapes)
    reader = Reader(open_lab(database), sensor)
    for level in levels:
        for name in shapes:
            scene, verdicts = registered_surface(database, name, "F1"), Counter[str]()
            middle = scene.centre_mm()
            for number in range(touches):
                rng = np.random.default_rng([7, number])
                x, y = (middle + rng.uniform(-1.5, 1.5, 2)).tolist()
                turn, force = rng.uniform(-math.pi, math.pi), rng.uniform(4, 12)
                touch = Touch(
                    x, y, float(turn), float(force), *rng.uniform(-0.01, 0.01, 2).tolist()
                )
                counts, _ = read_sensor(scene.surface, sensor, touch, LEVELS[level], rng)
                answer = reader.read(counts)
                same = (answer.object, answer.face) == (name, "F1")
                near = bool(answer) and math.hypot(answer.x_mm - x, answer.y_mm - y) < 1.5
                verdicts["right" if same and near else "wrong" if answer else "refused"] += 1
            print(f"{name:4} {level:9} {dict(verdicts)}")


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("types", nargs="*", default=shipped_names())
    parser.add_argument("--touches", type=int, default=25)
    parser.add_argument("--levels", default="typical")
    parser.add_argument("--kinds", default="face")
    parser.add_argument("--faces", default="")
    given = parser.parse_args()
    levels = given.levels.split(",")
    with tempfile.TemporaryDirectory() as name:
        if given.faces:
            sides = [int(side) for side in given.faces.split(",")]
            print_small_faces(Path(name), sides, given.touches, levels)
            return
        for each in given.types:
            print_type(Path(name), each, given.touches, levels, given.kinds.split(","))


if __name__ == "__main__":
    main()
