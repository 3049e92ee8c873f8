"""What each dimension of a probe's parts costs in reading, one defect at a time.

    python tests/bench/kit_tolerances.py                       # fsr-16, 80 touches each
    python tests/bench/kit_tolerances.py --sensor-type fsr-8x8 --touches 40

Touches amid faces of registered objects of the pitch that the type proposes, 20 to 120 N. The
sensor that presses is off in one dimension more than a typical one (level `typical` of
`validate-set`); the reader has the type as it should be. Right of all, root mean square of place
and turn of right answers, and errors inside the answer's own 95 % ellipsoid. `probe-kit` prints it.
"""

from __future__ import annotations

import math
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from encoded_objects import Reader, encode, open_lab
from encoded_objects.base.sensor_type import SensorType
from encoded_objects.base.sensor_type_file import sensor_type_named
from probe.errors import ContactError
from probe.simulate.registered import registered_surface
from probe.simulate.scene import TouchRanges, random_touches
from probe.simulate.world.levels import TYPICAL, Level
from probe.simulate.world.sensor import LevelSensor, SensorInstance, sample_sensor
from recognizer.touch.recognise import recognise
from recognizer.validation.statistics import chi2_quantile

sys.path.insert(0, str(Path(__file__).parents[1] / "campaigns"))
import runner

SHAPES = {"Cube": {"cube": "80 mm"}, "Box": {"box": ["90 mm", "70 mm", "60 mm"]}}
INSIDE = chi2_quantile(0.95)  #: chi square of three numbers at 95 %


@dataclass(frozen=True)
class Defect:
    """How far the sensor that presses is off."""

    what: str
    by: str
    level: Level = TYPICAL
    sensor: SensorType | None = None  #: that presses, where it is another one
    moved_mm: float = 0.0  #: the whole overlay, along x
    grown: float = 0.0  #: the whole overlay, about its middle


def defects(sensor: SensorType) -> Iterator[Defect]:
    """Yield what is tried."""
    yield Defect("none", "")
    for by in (0.05, 0.15, 0.25, 0.4):
        yield Defect("place of each tab", f"{by:g} mm", replace(TYPICAL, shift_mm=by))
    for by in (0.03, 0.1, 0.15, 0.2, 0.3):
        yield Defect("height of each tab", f"{by:g} mm", replace(TYPICAL, length_mm=by))
    for by in (0.1, 0.25, 0.5):
        yield Defect("overlay over film", f"{by:g} mm", moved_mm=by)
    for by in (0.003, 0.006, 0.01, 0.02):
        yield Defect("size of the overlay", f"{100 * by:g} %", grown=-by)
    overlay = sensor.overlay
    for by in (-0.3, -0.15, 0.15, 0.3):
        tip = replace(overlay, tab_diameter_mm=overlay.tab_diameter_mm * (1 + by))
        yield Defect("diameter of a tip", f"{100 * by:+g} %", sensor=replace(sensor, overlay=tip))
    for times in (0.5, 2.0, 4.0):
        stiff = replace(overlay, young_mpa=overlay.young_mpa * times)
        yield Defect("modulus of the silicone", f"x {times:g}",
                     sensor=replace(sensor, overlay=stiff))  # fmt: skip
    for by in (0.2, 0.3, 0.5):
        yield Defect("dome of a tip", f"{by:g} mm", replace(TYPICAL, dome_mm=by))
    for by in (3.0, 5.0):
        tilt = replace(TYPICAL, tilt_rad=math.radians(by))
        yield Defect("tilt of the housing", f"{by:g} degrees", tilt)


def instance_of(defect: Defect, sensor: SensorType, rng: np.random.Generator) -> SensorInstance:
    """Return a sensor whose tips are moved together beside each by itself."""
    drawn = sample_sensor(sensor, rng)
    moved = defect.grown * sensor.centres_mm() + np.array([defect.moved_mm, 0.0])
    return replace(drawn, shifts=drawn.shifts + moved / max(defect.level.shift_mm, 1e-12))


def measure(
    database: str, reader: Reader, defect: Defect, touches: int
) -> tuple[int, int, float, float, float]:
    """Return right, wrong, rms mm, rms degrees and the share inside."""
    sensor, errors, inside, wrong = reader.sensor, [], 0, 0
    scenes = [registered_surface(database, name, f"F{k}") for name in SHAPES for k in (1, 2, 3)]
    area = math.prod(sensor.half_mm) / 12.7**2
    for number in range(touches):
        rng = np.random.default_rng([3, number])
        scene = scenes[number % len(scenes)]
        ranges = TouchRanges(margin_mm=9.0, force_n=(20.0 * area, 120.0 * area))
        for touch in random_touches(scene.region, rng, ranges):
            tilt = defect.level.tilt_rad or math.radians(2)
            towards = rng.uniform(-math.pi, math.pi)
            by = tilt * math.sqrt(rng.random())
            at = replace(
                touch, tilt_x_rad=by * math.cos(towards), tilt_y_rad=by * math.sin(towards)
            )
            try:
                used, instance = defect.sensor or sensor, instance_of(defect, sensor, rng)
                worse = LevelSensor(used, defect.level, instance=instance)
                counts = worse.read(scene, at, rng).counts
                break
            except ContactError:
                continue
        answer = recognise(reader, reader.signal(counts), number)
        if not answer:
            continue
        dx, dy = answer.x_mm - at.x_mm, answer.y_mm - at.y_mm
        turn = math.remainder(math.radians(answer.theta_deg) - at.theta_rad, math.tau)
        if (answer.object, answer.face) != (scene.object_name, scene.face) or math.hypot(
            dx, dy
        ) > 2:
            wrong += 1
            continue
        off = np.array([dx, dy, turn])
        inside += float(off @ np.linalg.solve(answer.covariance, off)) < INSIDE
        errors.append((math.hypot(dx, dy), math.degrees(turn)))
    rms = np.sqrt(np.mean(np.square(errors), axis=0)) if errors else np.full(2, math.nan)
    return len(errors), wrong, float(rms[0]), float(rms[1]), inside / max(len(errors), 1)


def main() -> None:
    """Print the table."""
    parser = runner.arguments(__doc__, touches=80)
    parser.add_argument("--sensor-type", default="fsr-16")
    given = runner.parse(parser)
    sensor = sensor_type_named(given.sensor_type)
    with tempfile.TemporaryDirectory() as folder:
        database = f"{folder}/lab.db"
        for name, shape in SHAPES.items():
            spec = {"name": name, "shape": shape, "sensor_type": given.sensor_type}
            encode(spec | {"output": {"lab_key": "VA11-DATE-0000-0002"}}, database=database,
                   formats=())  # fmt: skip
        reader = Reader(open_lab(database), sensor)
        runner.table(("dimension", "off by", "right", "wrong", "rms mm / degrees", "inside"))
        for defect in defects(sensor):
            right, wrong, mm, deg, inside = measure(database, reader, defect, given.touches)
            runner.row(defect.what, defect.by, f"{right} of {given.touches}", wrong,
                       f"{mm:.3f} / {deg:.2f}", f"{100 * inside:.0f} %")  # fmt: skip


if __name__ == "__main__":
    main()
