"""A print's scale and skew from 30 touches, and what they do for the poses of 30 others.

    python tests/campaigns/as_built.py --level typical
    validate-set SPEC.yaml --surfaces printed --faults usual --touches 100 -o RUN
    python tests/campaigns/as_built.py --run RUN --panels 12

A cube's panel is written, scaled from the middle of its file, touched, estimated, kept in the
database, and touched elsewhere: place before and after, and what of the 95 % ellipses holds.
Touches to learn from have seed 1, those to judge by seed 2, both at least 9 mm from the edges.
With `--run` the surfaces are what the slicer's G-code leaves of a run's panels, which shares no
model with the reader; the true place is counted from the middle of the printed symbols
(docs/printed.md).
"""

from __future__ import annotations

import math
import shutil
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import runner

from encoded_objects import encode
from generator.database.as_built import AsBuilt
from generator.database.open import open_database
from generator.database.read import list_objects
from generator.database.transaction import read_transaction
from probe.contact.contract import Touch
from probe.errors import ContactError, SurfaceError
from probe.simulate.printed import printed_scene
from probe.simulate.registered import registered_object, registered_objects
from probe.simulate.scene import Scene, TouchRanges, random_touches
from probe.simulate.target import part_surface
from probe.simulate.world.levels import LEVELS
from probe.simulate.world.sensor import LevelSensor
from probe.simulate.written import written_triangles
from probe.surface.mesh import mesh
from recognizer.as_built.estimate import estimate_print, keep_prints
from recognizer.as_built.touches import WIDE_SCALE, measure_prints
from recognizer.as_built.verdict import judge_print
from recognizer.errors import AsBuiltError
from recognizer.touch.lab import open_lab
from recognizer.touch.reader import Reader
from recognizer.touch.source import TouchImage

ON_FACE = TouchRanges(force_n=(20, 120), tilt_rad=math.radians(2), margin_mm=9)
LARGE_MM = 45.0  #: least side of a panel on which a sensor finds room
SHIFT = (30.0, 30.0, -3.0)  #: of the cube's panels: face frame from part frame
SCALES = (0.9, 0.92, 0.94, 0.95, 0.96, 0.97, 0.98, 0.99, 0.995, 1.01)
PRINTS = {  # scale x, scale y, skew (rad)
    "as designed": (1.0, 1.0, 0.0),
    **{f"{scale:g}": (scale, scale, 0.0) for scale in SCALES},
    "X .99": (0.99, 1.0, 0.0),
    "X .97": (0.97, 1.0, 0.0),
    "X .988, Y .994": (0.988, 0.994, 0.0),
    "skew .01": (1.0, 1.0, 0.01),
}
Errors = list[tuple[float, float, float]]


def scaled_panels(
    folder: Path, only: str | None
) -> Iterator[tuple[str, Path, int, Scene, tuple[float, float, float]]]:
    """Yield a cube's panel, scaled from the middle of its file, as each print leaves it."""
    lab = folder / "lab.db"
    encode({"name": "Cube", "shape": {"cube": "60 mm"}}, database=str(lab),
           folder=folder / "out", formats=("stl",))  # fmt: skip
    file = next((folder / "out").glob("**/Cube-F1.stl"))
    T_surface_part = np.eye(4)
    T_surface_part[:3, 3] = SHIFT
    for name, (scale_x, scale_y, skew) in PRINTS.items():
        if only in (None, name):
            S = np.eye(3)
            S[:2, :2] = [[scale_x, scale_y * math.sin(skew)], [0.0, scale_y * math.cos(skew)]]
            surface = mesh(written_triangles(file) @ S.T, T_surface_part)
            scene = replace(part_surface(file, database=str(lab)), surface=surface)
            yield name, lab, 1, scene, (scale_x, scale_y, skew)


def printed_panels(run: Path, count: int) -> Iterator[tuple[str, Path, int, Scene, None]]:
    """Yield the first large printed face of each object of a run."""
    database = str(run / "lab.db")
    with read_transaction(open_database(database, writable=False)) as connection:
        numbers = {entry.name: entry.object_id for entry in list_objects(connection)}
    found = 0
    for name in sorted(registered_objects(database)):
        for face in registered_object(database, name).faces:
            large = np.ptp(face.polygon_mm[0], axis=0).min() >= LARGE_MM
            if face.placement is None or not large:
                continue
            try:
                scene = printed_scene(str(run / "printed.json"), database, name, face.name)
            except SurfaceError:
                break
            yield f"{name}/{face.name}", run / "lab.db", numbers[name], scene, None
            found += 1
            break
        if found == count:
            return


def touched(
    scene: Scene, reader: Reader, seed: int, touches: int, level: str
) -> Iterator[tuple[Touch, TouchImage]]:
    """Yield touches amid a face, and what is read of each."""
    rng, sensor = np.random.default_rng(seed), LevelSensor(reader.sensor, LEVELS[level])
    for number in range(touches):
        while True:
            touch = next(random_touches(scene.region, rng, ON_FACE))
            try:
                counts = sensor.read(scene, touch, rng).counts
            except ContactError:
                continue
            break
        yield touch, TouchImage(number, 0, 1, counts.astype(float), np.zeros(4), None)


def errors_of(reader: Reader, felt: list[tuple[Touch, TouchImage]]) -> Errors:
    """Return squares of place (mm) and turn (degrees), and chi squared, of what is answered."""
    found = []
    for touch, image in felt:
        answer = reader.read(image.counts)
        if not answer:
            continue
        turn = math.remainder(math.radians(answer.theta_deg) - touch.theta_rad, math.tau)
        error = np.array([answer.x_mm - touch.x_mm, answer.y_mm - touch.y_mm, turn])
        chi2 = error @ np.linalg.solve(answer.covariance, error)
        found.append((error[:2] @ error[:2], math.degrees(turn) ** 2, chi2))
    return found


def summary(errors: Errors) -> str:
    """Return how many, rms of place and turn, and the share inside the 95 % ellipsoid."""
    if not errors:
        return "  0"
    away, turns, chi2 = np.array(errors).T
    inside = 100 * np.mean(chi2 < runner.INSIDE_CHI2)
    return (
        f"{len(errors):3d} {math.sqrt(away.mean()):6.3f} mm {math.sqrt(turns.mean()):5.2f} deg "
        f"{inside:4.0f} %"
    )


def deviation(found: AsBuilt, true: tuple[float, float, float] | None) -> str:
    """Return scales and skew as they were estimated, or their errors where they are known."""
    values = np.array([found.scale_x, found.scale_y, found.skew_rad])
    said = " ".join(f"{one:.5f}" for one in np.sqrt(np.diag(found.covariance))[:3])
    word, shown = ("found", values) if true is None else ("error", values - true)
    return f"{word} {' '.join(f'{one:+.5f}' for one in shown)} rad, said {said}"


def main() -> None:
    """Print what each print is taken for, and poses before and after."""
    asked = runner.asked(__doc__, touches=30, level="typical", only=str, run=Path, panels=12)
    folder, before, after = Path(tempfile.mkdtemp()), [], []
    panels = (
        printed_panels(asked.run, asked.panels) if asked.run else scaled_panels(folder, asked.only)
    )
    for name, lab, number, scene, true in panels:
        database = folder / "one.db"
        shutil.copy(lab, database)
        usual, wide = Reader(open_lab(database)), Reader(open_lab(database), options=WIDE_SCALE)
        learn = [one for _, one in touched(scene, usual, 1, asked.touches, asked.level)]
        judge = list(touched(scene, usual, 2, asked.touches, asked.level))
        try:
            felt = measure_prints(wide, learn)
            found = estimate_print(felt, object_id=number, printer="fdm-0.4")
        except AsBuiltError as error:
            print(f"{name}: {error}", flush=True)
            continue
        old = errors_of(usual, judge)
        keep_prints(database, [found])
        new = errors_of(Reader(open_lab(database)), judge)
        before, after = before + old, after + new
        print(f"{name}: {len(felt)} of {len(learn)}, {deviation(found, true)}; strokes "
              f"{found.stroke_mm:.2f}\n  before {summary(old)}\n  after  {summary(new)}\n"
              f"  {judge_print(found, 1.4).words}", flush=True)  # fmt: skip
    print(f"all:\n  before {summary(before)}\n  after  {summary(after)}")


if __name__ == "__main__":
    main()
