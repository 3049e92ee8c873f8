"""What each dimension of a probe's parts costs in reading, one defect at a time.

    python tests/bench/kit_tolerances.py                       # fsr-16, 80 touches each
    python tests/bench/kit_tolerances.py --sensor-type fsr-8x8 --touches 40

Touches amid faces of registered objects of the pitch that the type proposes, 20 to 120 N. The
sensor that presses is off in one dimension more than a typical one (level `typical` of
`validate-set`); the reader has the type as it should be. Right of all, root mean square of place
and turn of right answers, and errors inside the answer's own 95 % ellipsoid. `probe-kit` prints it.
"""

import math
import sys
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from encoded_objects import Reader, encode, open_lab
from encoded_objects.base.sensor_type import SensorType
from encoded_objects.base.sensor_type_file import sensor_type_named
from probe.contact.contract import Touch
from probe.errors import ContactError
from probe.simulate.registered import registered_surface
from probe.simulate.scene import Scene, TouchRanges, random_touches
from probe.simulate.world.levels import TYPICAL, Level
from probe.simulate.world.sensor import LevelSensor, SensorInstance, sample_sensor
from recognizer.touch.recognise import recognise

sys.path.insert(0, str(Path(__file__).parents[1] / "campaigns"))
import runner

SHAPES = {"Cube": {"cube": "80 mm"}, "Box": {"box": ["90 mm", "70 mm", "60 mm"]}}


@dataclass(frozen=True)
class Defect:
    """How far the sensor that presses is off."""

    what: str
    by: str = ""
    level: Level = TYPICAL
    sensor: SensorType | None = None  #: that presses, where it is another one
    moved_mm: float = 0.0  #: the whole overlay, along x
    grown: float = 0.0  #: the whole overlay, about its middle


def defects(sensor: SensorType) -> Iterator[Defect]:
    """Yield what is tried."""
    yield Defect("none")
    for what, field, values in (
        ("place of each tab", "shift_mm", (0.05, 0.15, 0.25, 0.4)),
        ("height of each tab", "length_mm", (0.03, 0.1, 0.15, 0.2, 0.3)),
        ("dome of a tip", "dome_mm", (0.2, 0.3, 0.5)),
    ):
        yield from (Defect(what, f"{by:g} mm", replace(TYPICAL, **{field: by})) for by in values)
    for by in (0.1, 0.25, 0.5):
        yield Defect("overlay over film", f"{by:g} mm", moved_mm=by)
    for by in (0.003, 0.006, 0.01, 0.02):
        yield Defect("size of the overlay", f"{100 * by:g} %", grown=-by)
    overlay = sensor.overlay
    for by in (-0.3, -0.15, 0.15, 0.3):
        tip = replace(overlay, tab_diameter_mm=overlay.tab_diameter_mm * (1 + by))
        yield Defect("diameter of a tip", f"{100 * by:+g} %", sensor=replace(sensor, overlay=tip))
    for by in (0.5, 2.0, 4.0):
        stiff = replace(overlay, young_mpa=overlay.young_mpa * by)
        yield Defect("modulus of the silicone", f"x {by:g}", sensor=replace(sensor, overlay=stiff))
    for by in (3.0, 5.0):
        tilt = replace(TYPICAL, tilt_rad=math.radians(by))
        yield Defect("tilt of the housing", f"{by:g} degrees", tilt)


def instance_of(defect: Defect, sensor: SensorType, rng: np.random.Generator) -> SensorInstance:
    """Return a sensor whose tips are moved together beside each by itself."""
    drawn = sample_sensor(sensor, rng)
    moved = defect.grown * sensor.centres_mm() + np.array([defect.moved_mm, 0.0])
    return replace(drawn, shifts=drawn.shifts + moved / max(defect.level.shift_mm, 1e-12))


def touched(
    scene: Scene, sensor: SensorType, defect: Defect, number: int
) -> tuple[Touch, np.ndarray]:
    """Return a touch amid a face and its counts."""
    rng, area = np.random.default_rng([3, number]), math.prod(sensor.half_mm) / 12.7**2
    ranges = TouchRanges(margin_mm=9.0, force_n=(20.0 * area, 120.0 * area))
    for touch in random_touches(scene.region, rng, ranges):
        tilt, towards = defect.level.tilt_rad or math.radians(2), rng.uniform(-math.pi, math.pi)
        by = tilt * math.sqrt(rng.random())
        at = replace(touch, tilt_x_rad=by * math.cos(towards), tilt_y_rad=by * math.sin(towards))
        instance = instance_of(defect, sensor, rng)
        worse = LevelSensor(defect.sensor or sensor, defect.level, instance=instance)
        with suppress(ContactError):
            return at, worse.read(scene, at, rng).counts
    raise AssertionError


def measure(scenes: list[Scene], reader: Reader, defect: Defect, touches: int) -> runner.Row:
    """Return what becomes of touches, as `runner.outcome` does."""
    trials = []
    for number in range(touches):
        scene = scenes[number % len(scenes)]
        at, counts = touched(scene, reader.sensor, defect, number)
        answer = recognise(reader, reader.signal(counts), number)
        trials.append(runner.trial_of(answer, at, scene))
    return runner.outcome(trials)


def main() -> None:
    """Print the table."""
    given = runner.asked(__doc__, touches=80, sensor_type="fsr-16")
    sensor = sensor_type_named(given.sensor_type)
    with tempfile.TemporaryDirectory() as folder:
        database = f"{folder}/lab.db"
        for name, shape in SHAPES.items():
            spec = {"name": name, "shape": shape, "sensor_type": given.sensor_type}
            encode(spec | {"output": {"lab_key": "VA11-DATE-0000-0002"}}, database=database,
                   folder=f"{folder}/{name}", formats=())  # fmt: skip
        reader = Reader(open_lab(database), sensor)
        scenes = [registered_surface(database, n, f"F{k}") for n in SHAPES for k in (1, 2, 3)]
        runner.table(("dimension", "off by", "right", "wrong", "rms mm / degrees", "inside"))
        for defect in defects(sensor):
            row = measure(scenes, reader, defect, given.touches)
            runner.row(defect.what, defect.by, f"{row['right']} of {given.touches}", row["wrong"],
                       f"{row['rms_mm']:.3f} / {row['rms_deg']:.2f}",
                       f"{100 * row['inside']:.0f} %")  # fmt: skip


if __name__ == "__main__":
    main()
