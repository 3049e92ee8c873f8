"""Mosaics of raster scans of cubes, against the truth of the simulation.

    python tests/bench/recognizer_mosaic.py --errors 0.5 1 2 --seed 1
    python tests/bench/recognizer_mosaic.py --profiles one-touch --readings counts

An 80 mm cube of each profile is encoded, one face is touched every 4.25 tactels (100 touches)
by an arm whose joints have noise and backlash, scaled so that the believed places err by so
many tactels (rms); 80 N within 10 %, half a degree of tilt, 10 % spread of gain from tactel to
tactel, 0.02 N of noise, one dead tactel; or counts of the simulated board. All lengths are in
tactels of 1.5875 mm. Lines:

    mosaic      shape error after the best rigid motion; absolute error in the frame
    decoded     the same with decoded places: every touch, or one in twelve
    steps       no arm: steps that err by half a tactel and half a degree each
"""

from __future__ import annotations

import argparse
import math
import tempfile
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from encoded_objects.base.sensor_type import SensorType
from generator.pipeline import encode
from generator.spec import read_specs
from probe.arm import Arm
from probe.circuit import Electronics, fsr_of, read_counts
from probe.contact.contract import Touch
from probe.contact.press import press
from probe.scan.kinesthetic import ArmPath, JointErrors, follow_poses
from probe.scan.places import surface_to_sensor
from probe.scan.raster import raster
from probe.simulate.registered import registered_object, registered_surface
from recognizer.scan.mosaic.mosaic import Mosaic, add_touch, no_touches
from recognizer.scan.mosaic.planar import (
    PlacedTouch,
    PlanarBelief,
    compose_poses,
    decoded_place,
    planar_belief,
    planar_covariance,
    planar_pose,
    relative_pose,
    wrap_angle,
)
from recognizer.touch.lab import open_lab
from recognizer.touch.options import ReaderOptions
from recognizer.touch.reader import Reader
from recognizer.touch.recognise import recognise
from recognizer.touch.signal import Signal, signal_of
from recognizer.validation.statistics import chi2_quantile

SPECS = Path(__file__).parents[2] / "fixtures" / "specs"
SENSOR = SensorType()
P = SENSOR.pitch_mm
DEG = math.pi / 180
PITCH_MM = {"thesis": 12.0, "one-touch": 7.0}
#: The face before the arm, and the frame that the operator taught, a little beside it.
T_BASE_FACE = surface_to_sensor(260.0, -40.0, 0.0, 100.0)
T_BASE_PLANE = surface_to_sensor(256.0, -37.0, 1.5 * DEG, 100.0)


@dataclass
class Scan:
    """What was felt, believed and true."""

    signals: list[Signal]
    believed: list[PlanarBelief]  #: in the plane that the operator taught
    true: np.ndarray  #: (n, 3) T_face_sensor
    pitch_mm: float


FIRM = ReaderOptions(contact_n=0.1)


def scanned(database: str, name: str, pitch_mm: float, tactels: float, counts: bool, seed: int):
    """Return a scan of the first face."""
    rng = np.random.default_rng(seed)
    surface = registered_surface(database, name).surface
    face = registered_object(database, name).faces[0]
    plan = raster([loop[:, :2] for loop in face.polygon_mm])
    stands = [T_BASE_FACE @ surface_to_sensor(x, y, 0.0) for x, y in plan.places_mm.tolist()]
    track = moved_arm(stands, tactels, seed)
    gains = np.exp(rng.normal(0, 0.1, (16, 16)))
    dead = np.ones((16, 16))
    dead.flat[rng.integers(256)] = 0
    fsr, state, signals, true = fsr_of(), None, [], []
    for stand in track.true:
        pose = planar_pose(np.linalg.inv(T_BASE_FACE) @ stand)
        x, y, theta = pose.tolist()
        tilt_x, tilt_y = rng.uniform(-0.5, 0.5, 2) * DEG
        touch = Touch(x, y, theta, 80 * rng.uniform(0.9, 1.1), tilt_x, tilt_y)
        forces = press(surface, SENSOR, touch).forces_n
        if counts:
            read, _ = read_counts(forces, Electronics(), fsr, state, rng)
            signals.append(signal_of(read.astype(float)))
        else:
            read = np.maximum(forces * gains + rng.normal(0, 0.02, (16, 16)), 0)
            signals.append(signal_of(read, trust=dead, floor=0.0, newtons=True, options=FIRM))
        true.append(pose)
    back = np.linalg.inv(T_BASE_PLANE)
    believed = []
    for stand, covariance in zip(track.believed, track.covariance, strict=True):
        spread = planar_covariance(covariance, back[:3, :3])
        believed.append(planar_belief(back @ stand, spread))
    return Scan(signals, believed, np.array(true), pitch_mm)


def moved_arm(stands, tactels: float, seed: int) -> ArmPath:
    """Follow a scan, lifted between touches, with joint errors of the wanted size."""
    lift = surface_to_sensor(0, 0, 0, 10.0)
    path = [pose for stand in stands for pose in (lift @ stand, stand)]
    scale = 1.0
    for _ in range(3):
        errors = JointErrors((3e-4 * scale,) * 5, (1e-3 * scale,) * 5)
        track = follow_poses(Arm(), path, errors, np.random.default_rng(seed))
        away = (track.true - track.believed)[1::2, :2, 3]
        scale *= tactels * P / math.sqrt(float((away**2).sum(axis=1).mean()))
    return ArmPath(*(getattr(track, name)[1::2] for name in track.__dataclass_fields__))


def rms(values) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else math.nan


def shape_errors(poses: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Return distances (n,), tactels, after the rigid motion that fits best."""
    a, b = poses[:, :2] - poses[:, :2].mean(0), true[:, :2] - true[:, :2].mean(0)
    angle = math.atan2(float((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum()), float((a * b).sum()))
    c, s = math.cos(angle), math.sin(angle)
    return np.hypot(*(b - a @ np.array([[c, s], [-s, c]])).T) / P


def grown(touches: list[PlacedTouch], pitch_mm: float) -> tuple[Mosaic, float]:
    """Return a mosaic, and ms per touch (median)."""
    mosaic, times = no_touches(SENSOR, pitch_mm), []
    for touch in touches:
        start = time.process_time()
        mosaic = add_touch(mosaic, touch)
        times.append(time.process_time() - start)
    return mosaic, 1e3 * float(np.median(times))


def told(name: str, scan: Scan, touches: list[PlacedTouch], *, face: bool) -> None:
    """Grow a mosaic and print what it is worth."""
    mosaic, ms = grown(touches, scan.pitch_mm)
    away = mosaic.poses - scan.true
    away[:, 2] = wrap_angle(away[:, 2])
    shape = shape_errors(mosaic.poses, scan.true)
    line = f"  {name:16} shape rms {rms(shape):.3f} max {shape.max():.2f}"
    if face:
        nees = np.einsum("ni,nij,nj->n", away, np.linalg.inv(mosaic.covariances), away)
        free = np.array([touch.decoded is None for touch in touches])
        line += f"  absolute rms {rms(np.hypot(*away.T[:2])) / P:.3f}"
        if free.any():
            line += f" (not decoded {rms(np.hypot(*away[free].T[:2])) / P:.3f})"
        line += f"  chi^2/3 {nees.mean() / 3:.2f} in 95 % {(nees < chi2_quantile(0.95)).mean():.2f}"
    reasons = Counter(mosaic.reasons)
    defined = np.array([not reason for reason in mosaic.reasons])
    if not face and not defined.all():
        line += (
            f" (of the defined {rms(shape_errors(mosaic.poses[defined], scan.true[defined])):.3f})"
        )
    undefined = 1 - reasons[""] / len(mosaic)
    print(f"{line}  undefined {undefined:.3f}  {ms:.0f} ms/touch")
    if undefined:
        print(f"                   {dict(reasons)}")


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--profiles", nargs="+", default=["thesis", "one-touch"])
    parser.add_argument("--errors", nargs="+", type=float, default=[0.5, 1.0, 2.0])
    parser.add_argument("--readings", choices=("newtons", "counts"), default="newtons")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        for profile in given.profiles:
            database = f"sqlite:///{folder}/{profile}.db"
            specs = read_specs([SPECS / f"{profile}-cube.yaml"])
            encode(specs, folder=Path(folder) / profile, database=database, formats=("stl",))
            for tactels in given.errors:
                measure(database, profile, tactels, given.readings == "counts", given.seed)


def measure(database: str, profile: str, tactels: float, counts: bool, seed: int) -> None:
    """Print all lines of one profile and one size of errors."""
    scan = scanned(database, "", PITCH_MM[profile], tactels, counts, seed)
    n = len(scan.signals)
    print(f"{profile}, {n} touches, believed places err by {tactels:g} tactels rms")
    believed = np.array([place.pose for place in scan.believed])
    print(f"  as believed      shape rms {rms(shape_errors(believed, scan.true)):.3f}")
    told("mosaic", scan, touches_of(scan, {}), face=False)
    if profile == "one-touch":
        reader = Reader(open_lab(database), SENSOR)
        start = time.process_time()
        answers = [recognise(reader, signal, k) for k, signal in enumerate(scan.signals)]
        ms = 1e3 * (time.process_time() - start) / n
        every = {k: place for k, a in enumerate(answers) if (place := decoded_place(a)) is not None}
        errors = [math.hypot(*(place.pose - scan.true[k])[:2]) / P for k, place in every.items()]
        print(f"  decoded alone    {len(every)} of {n}, rms {rms(errors):.3f}, {ms:.0f} ms/touch")
        told("all decoded", scan, touches_of(scan, every), face=True)
        some = {k: place for k, place in every.items() if k % 12 == 0}
        told("1 in 12 decoded", scan, touches_of(scan, some), face=True)
    rng = np.random.default_rng(seed)
    spread = np.array([0.5 * P, 0.5 * P, 0.5 * DEG])
    steps = []
    for k, signal in enumerate(scan.signals):
        before = scan.true[k - 1] if k else np.zeros(3)
        step = relative_pose(before, scan.true[k]) + rng.normal(0, spread) * (k > 0)
        first = planar_belief(scan.true[0], (0.01, 0.01, 1e-4)) if k == 0 else None
        stepped = planar_belief(step, spread) if k else None
        steps.append(PlacedTouch(signal, believed=first, stepped=stepped, seq=k))
    reckoned = [scan.true[0]]
    for touch in steps[1:]:
        reckoned.append(compose_poses(reckoned[-1], touch.stepped.pose))
    away = np.array(reckoned) - scan.true
    print(f"  steps as counted drift rms {rms(np.hypot(*away.T[:2])) / P:.2f}")
    told("steps", scan, steps, face=True)


def touches_of(scan: Scan, decoded: dict[int, PlanarBelief]) -> list[PlacedTouch]:
    """Return the touches of a scan, some of them decoded."""
    return [
        PlacedTouch(signal, believed=believed, decoded=decoded.get(k), seq=k)
        for k, (signal, believed) in enumerate(zip(scan.signals, scan.believed, strict=True))
    ]


if __name__ == "__main__":
    main()
