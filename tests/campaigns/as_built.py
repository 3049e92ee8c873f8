"""A print's scale and skew from 30 touches, and what they do for the poses of 30 others.

    validate-set SPEC.yaml --surfaces printed --faults usual --touches 100 -o RUN
    python tests/campaigns/as_built.py RUN --panels 12

The surfaces are what the slicer's G-code leaves of a run's panels, which shares no model with the
reader: touched, estimated, kept in the database, and touched elsewhere; place before and after,
and what of the 95 % ellipses holds. Touches to learn from have seed 1, those to judge by seed 2,
both at least 9 mm from the edges. The true place is counted from the middle of the printed symbols
(docs/printed.md).
"""

import math
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import runner

from generator.database.as_built import AsBuilt
from generator.database.open import open_database
from generator.database.read import list_objects
from generator.database.transaction import read_transaction
from probe.contact.contract import Touch
from probe.errors import ContactError, SurfaceError
from probe.simulate.printed import printed_scene
from probe.simulate.registered import registered_object, registered_objects
from probe.simulate.scene import Scene, TouchRanges, random_touches
from probe.simulate.world.levels import LEVELS
from probe.simulate.world.sensor import LevelSensor
from recognizer.as_built.estimate import estimate_print, keep_prints
from recognizer.as_built.touches import WIDE_SCALE, measure_prints
from recognizer.as_built.verdict import judge_print
from recognizer.errors import AsBuiltError
from recognizer.touch.lab import open_lab
from recognizer.touch.reader import Reader
from recognizer.touch.source import TouchImage

ON_FACE = TouchRanges(force_n=(20, 120), tilt_rad=math.radians(2), margin_mm=9)
LARGE_MM = 45.0  #: least side of a panel on which a sensor finds room


def printed_panels(run: Path, count: int) -> Iterator[tuple[str, int, Scene]]:
    """Yield name, object number and surface of each object's first large printed face."""
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
            yield f"{name}/{face.name}", numbers[name], scene
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


def trials_of(
    scene: Scene, reader: Reader, felt: list[tuple[Touch, TouchImage]]
) -> list[runner.Row]:
    return [runner.trial_of(reader.read(image.counts), touch, scene) for touch, image in felt]


def summary(trials: list[runner.Row]) -> str:
    """Return how many are right and wrong, rms of place and turn, and the share inside."""
    line = runner.outcome(trials)
    return (f"{line['right']:3d} right, {line['wrong']} wrong, {line['rms_mm']:6.3f} mm "
            f"{line['rms_deg']:5.2f} deg {100 * line['inside']:4.0f} %")  # fmt: skip


def sizes(found: AsBuilt) -> str:
    """Return scales and skew as they were estimated, and their standard deviations."""
    values = (found.scale_x, found.scale_y, found.skew_rad)
    spread = np.sqrt(np.diag(found.covariance))[:3]
    return " ".join(f"{one:+.5f} ({sd:.5f})" for one, sd in zip(values, spread, strict=True))


def main() -> None:
    """Print what each print is taken for, and poses before and after."""
    asked = runner.asked(__doc__, "run", touches=30, level="typical", panels=12)
    run, before, after = Path(asked.run), [], []
    folder = Path(tempfile.mkdtemp())
    for name, number, scene in printed_panels(run, asked.panels):
        database = folder / "one.db"
        shutil.copy(run / "lab.db", database)
        usual, wide = Reader(open_lab(database)), Reader(open_lab(database), options=WIDE_SCALE)
        learn = [one for _, one in touched(scene, usual, 1, asked.touches, asked.level)]
        judge = list(touched(scene, usual, 2, asked.touches, asked.level))
        try:
            felt = measure_prints(wide, learn)
            found = estimate_print(felt, object_id=number, printer="fdm-0.4")
        except AsBuiltError as error:
            print(f"{name}: {error}", flush=True)
            continue
        old = trials_of(scene, usual, judge)
        keep_prints(database, [found])
        new = trials_of(scene, Reader(open_lab(database)), judge)
        before, after = before + old, after + new
        print(f"{name}: {len(felt)} of {len(learn)}, {sizes(found)} rad; strokes "
              f"{found.stroke_mm:.2f}\n  before {summary(old)}\n  after  {summary(new)}\n"
              f"  {judge_print(found, 1.4).words}", flush=True)  # fmt: skip
    print(f"all:\n  before {summary(before)}\n  after  {summary(after)}")


if __name__ == "__main__":
    main()
