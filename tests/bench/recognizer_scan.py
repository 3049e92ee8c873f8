"""Scans read by the joint fit, against the truth of the simulation and the thesis's way.

    python tests/bench/recognizer_scan.py --profiles thesis --scans 2 --seed 1
    python tests/bench/recognizer_scan.py --profiles one-touch --kinds corner worn --levels mismatch

Objects of `fixtures/specs` (80 mm cube, prism, tetrahedron, box; of the product profile the
cube) are scanned face by face, a touch every 4.25 tactels: in lines there and back from one end
of the face (`face`; `worn`: with 20 % of its symbols gone), or round its first corner, 5 mm
from the edges (`corner`); or another surface of `recognizer.validation.draw` is scanned, and
any answer is wrong. Places are those of an arm whose joints have noise and backlash (`arm`), or
they err by so many tactels; 20-120 N, up to 2 degrees of tilt. A scan is felt by one sensor,
drawn from a level of `recognizer.validation`, with the same noise in every touch. Ways:
`joint`; `alone`, each touch by itself; `classical`, the thesis's.

    first     touches until the answer: median and 95 %
    symbols   that a touch had whole in view: named right (share), wrong (number)
    rms, 95 % of all answered touches; share within the 95 % ellipse of the covariance
    ms        process time per touch, median (set OMP_NUM_THREADS=1)
"""

import argparse
import math
import tempfile
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from encoded_objects.base.sensor_type import SensorType
from probe.arm import Arm
from probe.contact.contract import Touch
from probe.errors import ContactError
from probe.scan.kinesthetic import JointErrors, follow_poses
from probe.scan.places import surface_to_sensor
from probe.scan.raster import raster
from probe.simulate.registered import registered_surface
from probe.simulate.scene import bare_scene
from probe.simulate.world.levels import LEVELS
from probe.simulate.world.sensor import BIAS, LevelSensor
from probe.simulate.world.surfaces import worn_scene
from recognizer.scan.belief import begin_scan, extend_scan
from recognizer.scan.mosaic.planar import (
    PlacedTouch,
    inverse,
    planar_belief,
    planar_covariance,
    planar_pose,
    transform_points,
)
from recognizer.thesis.scan import read_scan as read_classically
from recognizer.touch.lab import open_lab
from recognizer.touch.reader import Reader
from recognizer.touch.recognise import recognise
from recognizer.touch.signal import signal_of
from recognizer.validation.draw import FOREIGN
from recognizer.validation.statistics import chi2_quantile

SPECS = Path(__file__).parents[2] / "fixtures" / "specs"
SHAPES = {"thesis": ("cube", "prism", "tetrahedron", "box"), "product": ("cube",),
          "one-touch": ("cube", "prism", "tetrahedron", "box")}  # fmt: skip
SENSOR = SensorType()
NAMED = 3.0  # nats
NEAR_MM = 2.0
INSET_MM = 5.0  # of a scan along edges


@dataclass
class Felt:
    """What was felt, believed and true."""

    counts: list[np.ndarray]
    touches: list[PlacedTouch]
    true: np.ndarray  #: (n, 3) T_face_sensor


@dataclass
class Tally:
    """One line of the table."""

    scans: int = 0
    first: list = field(default_factory=list)
    wrong: int = 0
    answers: int = 0
    touches: int = 0
    symbols: Counter = field(default_factory=Counter)
    away: list = field(default_factory=list)
    nees: list = field(default_factory=list)
    ms: list = field(default_factory=list)
    reasons: Counter = field(default_factory=Counter)

    def judge(self, answer, name, true):
        """Count an answer; return whether it is one."""
        self.touches += 1
        self.reasons[answer.reason] += 1
        if not answer:
            return False
        T = answer.T_face_probe
        error = np.array([T[0, 3], T[1, 3], math.atan2(T[1, 0], T[0, 0])]) - true
        error[2] = math.remainder(error[2], math.tau)
        right = (answer.object, answer.face) == name and math.hypot(*error[:2]) < NEAR_MM
        self.answers += 1
        self.wrong += not right
        if right:
            self.away.append(error)
            self.nees.append(float(error @ np.linalg.solve(answer.covariance, error)) / 3)
        return True

    def line(self):
        """Return the figures."""
        known = [n for n in self.first if n is not None]
        rank = sorted(n if n is not None else math.inf for n in self.first)
        median = rank[(len(rank) - 1) // 2]
        late = rank[math.ceil(0.95 * len(rank)) - 1]
        away = np.array(self.away).reshape(-1, 3)
        mm = np.sqrt((away[:, :2] ** 2).sum(axis=1).mean()) if len(away) else math.nan
        deg = math.degrees(np.sqrt((away[:, 2] ** 2).mean())) if len(away) else math.nan
        all_ = sum(self.symbols.values()) or math.nan
        nees = np.array(self.nees)
        inside = (nees * 3 < chi2_quantile(0.95)).mean() if len(nees) else math.nan
        return (
            f"{self.scans:5}{len(known):6}{median:7.0f}{late:5.0f}{self.wrong:6}"
            f"{self.answers / self.touches:8.3f}{self.symbols['right'] / all_:8.3f}"
            f"{self.symbols['wrong']:6}{mm:8.3f}{deg:7.2f}{inside:7.2f}{np.median(self.ms):8.1f}"
        )


HEADER = (f"{'':34}{'scans':>5}{'told':>6}{'first':>7}{'95 %':>5}{'wrong':>6}{'answers':>8}"
          f"{'symbols':>8}{'wrong':>6}{'rms mm':>8}{'deg':>7}{'95 %':>7}{'ms':>8}")  # fmt: skip


@dataclass
class Manner:
    """How a scan is done."""

    force_n: tuple = (20.0, 120.0)
    tilt_deg: float = 2.0
    turn_deg: float | None = None  #: of the sensor; None: any


def scanned(scene, encoding, kind, level, sigma_tactels, most, rng, manner=None):
    """Return a scan of a face."""
    manner = manner or Manner()
    theta = float(rng.uniform(-math.pi, math.pi))
    if manner.turn_deg is not None:
        theta = math.radians(manner.turn_deg)
    if kind == "corner":
        a, b, c = (scene.region.starts[k] for k in (1, 0, -1))
        along = [(end - b) / np.linalg.norm(end - b) for end in (a, c)]
        steps = INSET_MM + 4.25 * SENSOR.pitch_mm * np.arange(most // 2)
        first, second = (b + INSET_MM * sum(along) + steps[:, None] * way for way in along)
        places = np.concatenate([first[::-1], second[1:]])
    else:
        plan = raster([scene.region.starts], SENSOR, theta_rad=theta, least_cover=0.5)
        lines = [plan.places_mm[plan.lines == n] for n in np.unique(plan.lines)]
        places = np.concatenate([line[:: (-1) ** n] for n, line in enumerate(lines)])
        places = places[:: 1 if rng.random() < 0.5 else -1][:most]
    x, y = scene.centre_mm().tolist()
    T_base_face = surface_to_sensor(300, 0, 0.2, 100) @ surface_to_sensor(-x, -y, 0)
    wanted = [T_base_face @ surface_to_sensor(x, y, theta) for x, y in places]
    if sigma_tactels is None:
        lift = surface_to_sensor(0, 0, 0, 10.0)
        path = [pose for stand in wanted for pose in (lift @ stand, stand)]
        arm = follow_poses(Arm(), path, JointErrors(), rng)
        believed, true = arm.believed[1::2], arm.true[1::2]
        spread = [planar_covariance(each) for each in arm.covariance[1::2]]
    else:
        sigma = sigma_tactels * SENSOR.pitch_mm
        believed, true = np.array(wanted), np.array(wanted)
        true[:, :2, 3] += rng.normal(0, sigma, (len(true), 2))
        spread = [np.array([sigma, sigma, 0.003])] * len(true)
    if kind == "worn":
        scene = worn_scene(scene, np.zeros((0, 2)), 0.0, 1.0, 0.2, rng)
    elif kind in FOREIGN:
        scene = bare_scene(FOREIGN[kind](encoding, rng))
    back, number = np.linalg.inv(T_base_face), int(rng.integers(1 << 30))
    felt = Felt([], [], np.zeros((0, 3)))
    stood = []
    for k, stand in enumerate(true):
        at = planar_pose(back @ stand)
        x, y, turn = at.tolist()
        tilt = math.radians(manner.tilt_deg) * math.sqrt(rng.random())
        towards = rng.uniform(-math.pi, math.pi)
        touch = Touch(x, y, turn, float(rng.uniform(*manner.force_n)),
                      tilt * math.cos(towards), tilt * math.sin(towards))  # fmt: skip
        try:
            one_sensor = np.random.default_rng(number)
            counts = LevelSensor(SENSOR, LEVELS[level]).read(scene, touch, one_sensor).counts
        except ContactError:
            continue  # the plate slips off
        felt.counts.append(counts.astype(float))
        felt.touches.append(
            PlacedTouch(
                signal_of(counts.astype(float)), planar_belief(believed[k], spread[k]), seq=k
            )
        )
        stood.append(at)
    felt.true = np.array(stood)
    return felt


def in_view(encoding, face, felt):
    """Return which symbols of a face some touch had whole under the sensor."""
    away = np.array([transform_points(inverse(pose), face.centres_mm) for pose in felt.true])
    reach = np.array(SENSOR.half_mm) - 0.35 * encoding.style.pitch_mm
    return (np.abs(away) < reach).all(axis=2).any(axis=0)


def named(scan, face_of, felt):
    """Right, wrong and rejected symbols in view, by the composite alone."""
    encoding, face = face_of
    count, seen = Counter(), in_view(encoding, face, felt)
    if scan.best is None:
        return count
    fit, pitch, true = scan.best.fit, encoding.style.pitch_mm, felt.true[-1]
    # the truth says where the lattice's cells lie on the face
    turn = true[2] - fit.theta_rad
    c, s = math.cos(turn), math.sin(turn)
    centres = (fit.cells + 0.5) * pitch - (fit.x_mm, fit.y_mm)
    at = centres @ np.array([[c, s], [-s, c]]) + true[:2]
    for n in np.flatnonzero(seen):
        away = np.linalg.norm(at - face.centres_mm[n], axis=1)
        scores = fit.scores[np.argmin(away)]
        first, second = np.sort(scores)[::-1][:2]
        label = int(np.argmax(scores))
        if away.min() > pitch / 4 or first - second < NAMED or label == encoding.array.order:
            count["rejected"] += 1
        else:
            count["right" if label == face.labels[n] else "wrong"] += 1
    return count


def joint(reader, felt, name, faces, tally):
    """Read a scan touch by touch."""
    scan, first = begin_scan(reader), None
    for k, touch in enumerate(felt.touches):
        start = time.process_time()
        scan = extend_scan(scan, touch)
        tally.ms.append(1e3 * (time.process_time() - start))
        if tally.judge(scan.recognition, name, felt.true[k]) and first is None:
            first = k + 1
    tally.scans += 1
    tally.first.append(first)
    if name in faces:
        tally.symbols += named(scan, faces[name], felt)


def alone(reader, felt, name, tally):
    """Read each touch by itself."""
    first = None
    for k, touch in enumerate(felt.touches):
        start = time.process_time()
        answer = recognise(reader, touch.signal, k)
        tally.ms.append(1e3 * (time.process_time() - start))
        if tally.judge(answer, name, felt.true[k]) and first is None:
            first = k + 1
    tally.scans += 1
    tally.first.append(first)


def classical(lab, felt, name, sigma, tally):
    """Read a scan the thesis's way, after every eighth touch and at the end."""
    window = max(0.75, 2 * (sigma or 0))
    poses = np.array([touch.believed.pose for touch in felt.touches])
    images = [np.maximum(counts - BIAS, 0) for counts in felt.counts]
    first, n = None, len(images)
    for k in [*range(8, n, 8), n]:
        start = time.process_time()
        found = read_classically(lab, SENSOR, images[:k], poses[:k], window_tactels=window)
        if k == n:
            tally.ms.append(1e3 * (time.process_time() - start) / n)
        if tally.judge(found.recognition, name, felt.true[k - 1]) and first is None:
            first = k
    tally.scans += 1
    tally.first.append(first)
    return found


def counted(found, face_of, felt):
    """Right, wrong and rejected symbols in view, of the thesis's way."""
    encoding, face = face_of
    symbols = found.symbols
    at = transform_points(
        felt.true[0], np.array([[s.x_mm, s.y_mm] for s in symbols]).reshape(-1, 2)
    )
    count = Counter()
    for n in np.flatnonzero(in_view(encoding, face, felt)):
        near = np.flatnonzero(np.linalg.norm(at - face.centres_mm[n], axis=1) < 4)
        labels = {symbols[k].label for k in near} - {-1}
        count["right" if face.labels[n] in labels else "wrong" if labels else "rejected"] += 1
    return count


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--profiles", nargs="+", default=["thesis", "product", "one-touch"])
    parser.add_argument("--kinds", nargs="+", default=["face"], help="and those of FOREIGN")
    parser.add_argument("--levels", nargs="+", default=["typical", "mismatch"])
    parser.add_argument("--errors", nargs="+", default=["arm"], help="arm, or tactels")
    parser.add_argument("--ways", nargs="+", default=["joint", "alone", "classical"])
    parser.add_argument("--scans", type=int, default=1, help="of each object, a face at random")
    parser.add_argument("--touches", type=int, default=40, help="at most, of a scan")
    parser.add_argument("--force", nargs=2, type=float, default=[20.0, 120.0], help="N")
    parser.add_argument("--tilt", type=float, default=2.0, help="largest, degrees")
    parser.add_argument("--turn", type=float, default=None, help="degrees; any if not given")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--databases", type=Path, help="folder of them, made if they are not there")
    given = parser.parse_args()
    print(HEADER)
    with tempfile.TemporaryDirectory() as folder:
        for profile in given.profiles:
            file = (given.databases or Path(folder)) / f"{profile}.db"
            url = f"sqlite:///{file}"
            if not file.exists():
                made(profile, url, Path(folder))
            lab = open_lab(url)
            reader = Reader(lab, SENSOR)
            faces = {}
            for encoding in lab.arrays:
                for n in range(len(encoding.faces)):
                    face = encoding.face(n)
                    faces[face.object, face.face] = encoding, face
            for kind in given.kinds:
                for level in given.levels:
                    for error in given.errors:
                        compare(given, url, lab, reader, faces, profile, kind, level, error)


def made(profile, url, folder):
    """Register the objects of a profile."""
    from generator.pipeline import encode
    from generator.spec import read_specs

    specs = read_specs([SPECS / f"{profile}-{shape}.yaml" for shape in SHAPES[profile]])
    encode(specs, folder=folder / profile, database=url, formats=())


def compare(given, url, lab, reader, faces, profile, kind, level, error):
    """Print a line for each way."""
    tallies = {way: Tally() for way in given.ways}
    sigma = None if error == "arm" else float(error)
    for number, thing in enumerate(sorted({name for name, _ in faces})):
        for copy in range(given.scans):
            rng = np.random.default_rng([given.seed, number, copy])
            sides = sorted(side for name, side in faces if name == thing)
            name = (thing, sides[int(rng.integers(len(sides)))])
            scene = registered_surface(url, *name)
            manner = Manner(tuple(given.force), given.tilt, given.turn)
            felt = scanned(scene, faces[name][0], kind, level, sigma, given.touches, rng, manner)
            if kind in FOREIGN:
                name = ("", "")  # any answer is wrong
            if "joint" in tallies:
                joint(reader, felt, name, faces, tallies["joint"])
            if "alone" in tallies:
                alone(reader, felt, name, tallies["alone"])
            if "classical" in tallies:
                found = classical(lab, felt, name, sigma, tallies["classical"])
                if name in faces:
                    tallies["classical"].symbols += counted(found, faces[name], felt)
    for way, tally in tallies.items():
        label = f"{profile} {kind} {level} {error} {way}"
        print(f"{label:34}{tally.line()}", flush=True)
        print(f"{'':34}{dict(tally.reasons)}", flush=True)


if __name__ == "__main__":
    main()
