"""Small square faces under the gel: how often one touch names them.

    python tests/bench/gel_faces.py                          # 9, 10, 12 and 15 mm, 25 touches each
    python tests/bench/gel_faces.py 9 --pitch 2.5 --levels sound,mismatch

One touch within 1.5 mm of the middle of a registered face, 1 to 4 N.
"""

from __future__ import annotations

import argparse
import math
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np

from encoded_objects import Reader, encode, open_lab
from encoded_objects.base.sensor_type_file import sensor_type_named
from probe.contact.contract import Touch
from probe.simulate.registered import registered_surface
from probe.simulate.world.levels import LEVELS
from probe.simulate.world.sensor import LevelSensor


def make_lab(folder: Path, pitch_mm: float, shapes: dict[str, object]) -> str:
    """Register objects with symbols of a pitch; return the database."""
    database = str(folder / f"lab-{pitch_mm:g}-{len(shapes)}.db")
    if not Path(database).exists():
        printer = "resin" if pitch_mm < 5 else "fdm-0.4"
        for name, shape in shapes.items():
            spec = {"name": name, "shape": shape, "profile": "large", "print": {"printer": printer},
                    "output": {"lab_key": "VA11-DATE-0000-0002"}}  # fmt: skip
            encode(spec | {"symbols": {"pitch": f"{pitch_mm} mm"}}, database=database, formats=())
    return database


def print_small_faces(
    folder: Path, sides: list[int], touches: int, levels: list[str], pitch_mm: float,
    force_n: tuple[float, float],
) -> None:  # fmt: skip
    """Print how often the gel names square faces by one touch, and why not; 0: pitch proposed."""
    sensor = sensor_type_named("gel-24x32")
    shapes: dict[str, object] = {
        f"S{side}": {"box": [f"{side} mm", f"{side} mm", "30 mm"]} for side in sides
    }
    database = make_lab(folder, pitch_mm or sensor.symbol_pitch_mm, shapes)
    reader = Reader(open_lab(database), sensor)
    for level in levels:
        for name in shapes:
            scene, verdicts = registered_surface(database, name, "F1"), Counter[str]()
            middle = scene.centre_mm()
            for number in range(touches):
                rng = np.random.default_rng([7, number])
                x, y = (middle + rng.uniform(-1.5, 1.5, 2)).tolist()
                turn, force = rng.uniform(-math.pi, math.pi), rng.uniform(*force_n)
                touch = Touch(
                    x, y, float(turn), float(force), *rng.uniform(-0.01, 0.01, 2).tolist()
                )
                counts = LevelSensor(sensor, LEVELS[level]).read(scene, touch, rng).counts
                answer = reader.read(counts)
                same = (answer.object, answer.face) == (name, "F1")
                near = bool(answer) and math.hypot(answer.x_mm - x, answer.y_mm - y) < 1.5
                verdicts["right" if same and near else "wrong" if answer else answer.reason] += 1
            print(f"{name:4} {level:9} {dict(verdicts)}")


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("sides", nargs="*", type=int, default=[9, 10, 12, 15], help="mm")
    parser.add_argument("--touches", type=int, default=25)
    parser.add_argument("--levels", default="sound,typical")
    parser.add_argument("--pitch", type=float, default=0.0, help="mm; that which is proposed")
    parser.add_argument("--force", type=float, nargs=2, default=[1.0, 4.0], help="N")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        print_small_faces(
            Path(name), given.sides, given.touches, given.levels.split(","), given.pitch,
            (given.force[0], given.force[1]),
        )  # fmt: skip


if __name__ == "__main__":
    main()
