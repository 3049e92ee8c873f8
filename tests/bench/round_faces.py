"""Cylinders and cones read back by touch: how wide a strip is felt, one touch, and scans.

    python tests/bench/round_faces.py strip
    python tests/bench/round_faces.py touch --touches 100 --levels typical,mismatch -j 2
    python tests/bench/round_faces.py scan --touches 20 --levels typical,mismatch -j 2
    python tests/bench/round_faces.py picture --output docs/round-touch.png

Cylinders (radius 20 ... 100 mm) and a cone are made with their files, as one set in one array
(`--alone`: each in a database of its own), and the written STL is touched: 20-120 N, up to 2
degrees of tilt, any turn, the centre at least 9 mm from the edges of the unrolled face. The
reader gets the counts alone. A scan rolls around the axis, a touch every 4.25 tactels, with an
arm that errs by 0.5 mm and 1 degree; at most 12 touches.

    strip   mm across which tactels feel more than 2 % of the strongest; depth of the plate under
            the tops of the symbols; tactels in the strip
    plane   rms error of the place in the unrolled plane, mm, and of the turn, degrees
    object  rms error of T_object_probe: of its origin, mm, and of its axes, degrees
    in 95   share within the 95 % ellipse of the covariance
    ms      process time of a touch, median (set OMP_NUM_THREADS=1)
"""

from __future__ import annotations

import argparse
import math
import os
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import numpy as np  # noqa: E402

from encoded_objects.base.sensor_type import SensorType  # noqa: E402
from generator.database.open import normal_url, part_path  # noqa: E402
from generator.pipeline import encode  # noqa: E402
from generator.spec import read_specs  # noqa: E402
from probe.contact.contract import Touch  # noqa: E402
from probe.errors import ContactError  # noqa: E402
from probe.simulate.registered import registered_object  # noqa: E402
from probe.simulate.scene import TouchRanges, random_touches  # noqa: E402
from probe.simulate.world.levels import LEVELS  # noqa: E402
from probe.simulate.world.sensor import LevelSensor  # noqa: E402
from probe.simulate.written import RoundPart, round_part  # noqa: E402
from recognizer.scan.belief import begin_scan, extend_scan  # noqa: E402
from recognizer.scan.mosaic.planar import PlacedTouch, planar_belief  # noqa: E402
from recognizer.touch.lab import open_lab  # noqa: E402
from recognizer.touch.reader import Reader  # noqa: E402
from recognizer.touch.recognise import recognise  # noqa: E402
from recognizer.touch.recognition import Recognition  # noqa: E402
from recognizer.touch.signal import signal_of  # noqa: E402
from recognizer.validation.draw import INSIDE_MM  # noqa: E402
from recognizer.validation.statistics import chi2_quantile  # noqa: E402
from recognizer.validation.trial import NEAR_MM  # noqa: E402

SHAPES = {
    "R20": "{cylinder: {diameter: 40 mm, height: 70 mm}}",
    "R30": "{cylinder: {diameter: 60 mm, height: 60 mm}}",
    "R40": "{cylinder: {diameter: 80 mm, height: 60 mm}}",
    "R60": "{cylinder: {diameter: 120 mm, height: 60 mm}}",
    "R100": "{cylinder: {diameter: 200 mm, height: 50 mm}}",
    "Cone": "{cone: {diameter: 120 mm, top_diameter: 70 mm, height: 70 mm}}",
}
FORCES_N = (20.0, 50.0, 80.0, 120.0)
FELT = 0.02  #: of the strongest tactel
STEP_MM = 6.75
MOST = 12  #: touches of a scan
ARM = (0.5, 0.5, math.radians(1.0))
CHI2_95 = chi2_quantile(0.95)  # 3 degrees of freedom


def made(folder: Path, alone: bool) -> dict[str, str]:
    """Return the database in which each object is registered."""
    lines = {name: f"- {{name: {name}, shape: {shape}}}" for name, shape in SHAPES.items()}
    sets = [[name] for name in lines] if alone else [list(lines)]
    found = {}
    for names in sets:
        spec = folder / f"{names[0]}.yaml"
        profile = "one-touch" if alone else "large"
        body = "\n  ".join(lines[name] for name in names)
        spec.write_text(f"profile: {profile}\nobjects:\n  {body}\n")
        url = f"sqlite:///{folder / names[0]}.db"
        encode(read_specs([spec]), folder=folder / names[0], database=url, formats=("stl",))
        found |= dict.fromkeys(names, url)
    return found


@lru_cache(maxsize=64)
def part(database: str, name: str) -> RoundPart:
    held = registered_object(database, name)
    (face,) = [face for face in held.faces if face.round is not None]
    (stl,) = [one for one in held.parts if one.format == "stl"]
    return round_part(part_path(normal_url(database), stl.file), held, stl, face)


@lru_cache(maxsize=8)
def reader(database: str) -> Reader:
    return Reader(open_lab(database), SensorType())


def touches(touched: RoundPart, rng: np.random.Generator) -> Iterator[Touch]:
    return random_touches(touched.region, rng, TouchRanges(margin_mm=INSIDE_MM))


def truth(touched: RoundPart, touch: Touch, height_mm: float) -> np.ndarray:
    """Return T_object_probe of the plate as it was meant to stand."""
    c, s = math.cos(touch.theta_rad), math.sin(touch.theta_rad)
    T = np.eye(4)
    T[:2, :2], T[:3, 3] = [[c, -s], [s, c]], (touch.x_mm, touch.y_mm, height_mm)
    return touched.tangent(touch.x_mm, touch.y_mm) @ T


@dataclass(frozen=True)
class Outcome:
    verdict: str  # right, wrong, refused
    plane: tuple[float, float] = (math.nan, math.nan)
    object: tuple[float, float] = (math.nan, math.nan)
    chi2: float = math.nan
    seconds: float = math.nan
    first: float = math.nan  # touches until the first answer


def judged(touched: RoundPart, touch: Touch, answer: Recognition) -> Outcome:
    if not answer:
        return Outcome("refused")
    T, away = answer.T_face_probe, np.zeros(3)
    away[:2] = T[:2, 3] - (touch.x_mm, touch.y_mm)
    away[2] = math.remainder(math.atan2(T[1, 0], T[0, 0]) - touch.theta_rad, 2 * math.pi)
    named = (answer.object, answer.face) == (touched.object_name, touched.face.name)
    if not named or math.hypot(*away[:2]) > NEAR_MM:
        return Outcome("wrong")
    meant = truth(touched, touch, T[2, 3])
    turn = np.linalg.inv(meant[:3, :3]) @ answer.T_object_probe[:3, :3]
    sine = np.linalg.norm(turn - turn.T) / math.sqrt(8)
    return Outcome(
        "right",
        (math.hypot(*away[:2]), math.degrees(away[2])),
        (float(np.linalg.norm((answer.T_object_probe - meant)[:3, 3])),
         math.degrees(math.asin(min(1.0, sine)))),
        float(away @ np.linalg.solve(answer.covariance, away)),
    )  # fmt: skip


def one_touch(job: tuple[str, str, str, int]) -> Outcome:
    database, name, level, number = job
    touched, rng = part(database, name), np.random.default_rng([1, number])
    for touch in touches(touched, rng):
        sensor = LevelSensor(SensorType(), LEVELS[level])
        try:
            counts = sensor.read(touched.scene(), touch, rng).counts
        except ContactError:
            continue  # the plate slips off: no touch
        start = time.process_time()
        answer = recognise(reader(database), signal_of(counts.astype(np.float64)))
        return replace(judged(touched, touch, answer), seconds=time.process_time() - start)
    raise AssertionError


def one_scan(job: tuple[str, str, str, int]) -> Outcome:
    database, name, level, number = job
    touched, rng = part(database, name), np.random.default_rng([2, number])
    touch = next(touches(touched, rng))
    along = float(rng.choice([-1.0, 1.0])) * STEP_MM
    scan, outcome, first, start = begin_scan(reader(database)), Outcome("refused"), math.nan, 0.0
    for k in range(MOST):
        at = np.array([[touch.x_mm, touch.y_mm]])
        inside = touched.region.contains(at)[0] and touched.region.distance_mm(at)[0] > INSIDE_MM
        if inside:
            try:
                sensor = LevelSensor(SensorType(), LEVELS[level])
                counts = sensor.read(touched.scene(), touch, rng).counts
            except ContactError:
                inside = False
        if inside:
            pose = np.array([touch.x_mm, touch.y_mm, touch.theta_rad])
            believed = planar_belief(pose + rng.standard_normal(3) * ARM, ARM)
            signal = signal_of(counts.astype(np.float64))
            begin = time.process_time()
            scan = extend_scan(scan, PlacedTouch(signal, believed=believed, seq=k))
            start += time.process_time() - begin
            outcome = judged(touched, touch, scan.recognition)
            if scan.recognition and math.isnan(first):
                first = k + 1.0
            agreed = outcome.verdict != "refused" and k + 1 - first >= 2  # two touches more
            if agreed or outcome.verdict == "wrong":
                break
        else:
            along = -along
        touch = replace(touch, x_mm=touch.x_mm + along)
    count = max(1, len(scan.touches))
    return replace(outcome, seconds=start / count, first=first)


def rms(values: list[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values)))) if values else math.nan


def table(options: argparse.Namespace, databases: dict[str, str]) -> None:
    run = one_touch if options.what == "touch" else one_scan
    print("object level     number right wrong refused   plane mm    deg  object mm    deg  in 95"
          "     ms  first", flush=True)  # fmt: skip
    with ProcessPoolExecutor(options.j) as pool:
        for name in options.objects.split(","):
            for level in options.levels.split(","):
                jobs = [(databases[name], name, level, n) for n in range(options.touches)]
                found = list(pool.map(run, jobs, chunksize=10))
                right = [one for one in found if one.verdict == "right"]
                count = [sum(one.verdict == v for one in found)
                         for v in ("right", "wrong", "refused")]  # fmt: skip
                plane, there = (
                    [rms([getattr(one, key)[i] for one in right]) for i in (0, 1)]
                    for key in ("plane", "object")
                )
                inside = np.mean([one.chi2 < CHI2_95 for one in right]) if right else math.nan
                ms = 1e3 * np.median([one.seconds for one in found])
                firsts = [one.first for one in found if not math.isnan(one.first)]
                first = f"{np.median(firsts):.0f}" if firsts else ""
                print(f"{name:6s} {level:9s} {len(found):6d} {count[0]:5d} {count[1]:5d} "
                      f"{count[2]:7d} {plane[0]:10.3f} {plane[1]:6.2f} {there[0]:10.3f} "
                      f"{there[1]:6.2f} {100 * inside:6.0f} {ms:6.0f}  {first}",
                      flush=True)  # fmt: skip


def strips(options: argparse.Namespace, databases: dict[str, str]) -> None:
    sensor = SensorType()
    points = sensor.centres_mm().reshape(-1, 2)
    print("object  force N  strip mm  depth mm  tactels")
    for name in options.objects.split(","):
        touched = part(databases[name], name)
        for force in FORCES_N:
            rng, found = np.random.default_rng(1), []
            for _ in range(min(options.touches, 12)):
                ranges = TouchRanges((force, force), 0.0, INSIDE_MM)
                drawn = next(random_touches(touched.region, rng, ranges))
                worse = LevelSensor(sensor, LEVELS["low"])
                contact = worse.read(touched.scene(), drawn, rng).contact
                bend = touched.face.round.bend(drawn.x_mm, drawn.y_mm).turned(drawn.theta_rad)
                c, s = math.cos(bend.towards_rad), math.sin(bend.towards_rad)
                forces = contact.forces_n.reshape(-1)
                felt = forces > FELT * forces.max()
                across = (points @ (-s, c))[felt]
                found.append((np.ptp(np.percentile(across, (1, 99))), 1.0 - contact.z_mm,
                              felt.sum()))  # fmt: skip
            strip, depth, count = np.mean(found, axis=0)
            print(f"{name:6s} {force:8.0f} {strip:9.1f} {depth:9.2f} {count:8.0f}", flush=True)


def picture(options: argparse.Namespace, databases: dict[str, str]) -> None:
    from probe.plot.touch import touch_picture

    touched, touch = part(databases["R40"], "R40"), Touch(100.0, 31.0, math.radians(25), 80.0)
    surface = touched.under(touch).surface
    sensor = LevelSensor(SensorType(), LEVELS["typical"])
    reading = sensor.read(touched.scene(), touch, np.random.default_rng(1))
    forces, counts = reading.contact.forces_n, reading.counts
    touch_picture(surface, SensorType(), touch, forces, counts, Path(options.output),
                  title="a cylinder of 80 mm, 80 N")  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=("strip", "touch", "scan", "picture"))
    parser.add_argument("--touches", type=int, default=100)
    parser.add_argument("--levels", default="typical,mismatch")
    parser.add_argument("--objects", default=",".join(SHAPES))
    parser.add_argument("--alone", action="store_true")
    parser.add_argument("--output", default="docs/round-touch.png")
    parser.add_argument("-j", type=int, default=1)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        databases = made(Path(folder), options.alone)
        {"strip": strips, "picture": picture}.get(options.what, table)(options, databases)


if __name__ == "__main__":
    main()
