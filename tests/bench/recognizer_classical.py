"""The thesis's way of reading, in figures: edges, mosaics, symbols, answers.

    python tests/bench/recognizer_classical.py [--edges 200] [--scans 2] [--seed 1]

Edges: touches of a blank face's edge and corner, the largest error of an edge over its seen
length against the thesis's 1.52 mm. Scans: faces of thesis-profile objects (80 mm cube, prism,
tetrahedron, box), by an arm with backlash and noise or with a stated error, merged in three
ways. Noise "typical": gains 10 %, tabs .03 mm, 2 % noise; "mismatch": stroke +0.2 mm, scale
1 %, tabs .08 mm high and .12 mm aside, exponent .8, cross-talk .45 tactel, gains 12 %. Times
are of the process, on one core (set OMP_NUM_THREADS=1).
"""

import argparse
import itertools
import math
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np
from scipy.ndimage import gaussian_filter

from encoded_objects.base.sensor_type import SensorType
from generator.pipeline import encode
from generator.spec import read_specs
from probe.arm import Arm
from probe.contact.contract import Touch
from probe.contact.tabs import tabs
from probe.contact.tips import Tips
from probe.scan.kinesthetic import JointErrors, follow_poses
from probe.scan.places import surface_to_sensor, touch_at
from probe.scan.raster import raster
from probe.simulate.registered import registered_surface
from probe.surface.face import FaceSurface
from probe.surface.polygon import polygon
from recognizer.scan.mosaic.planar import relative_pose, transform_points
from recognizer.thesis.edge_fit import face_edges
from recognizer.thesis.edges import classical_edges, vertices
from recognizer.thesis.merge import merge_touches
from recognizer.thesis.read import read_classically
from recognizer.thesis.scan import read_scan, spatial_pose
from recognizer.touch.lab import open_lab
from recognizer.touch.tactile_image import touch_image

SENSOR = SensorType()
LEVELS = ("typical", "mismatch")
PLACINGS = ("product", "bounded", "believed")
THESIS_MM = 1.52
SQUARE = np.array([[0.0, 0], [80, 0], [80, 80], [0, 80]])
SET = """
objects:
- {name: Cube, shape: {cube: 80 mm}, profile: thesis}
- {name: Prism, shape: {triangular_prism: {side: 90 mm, height: 80 mm}}, profile: thesis}
- {name: Tetra, shape: {tetrahedron: 120 mm}, profile: thesis}
- {name: Box, shape: {box: [100 mm, 80 mm, 60 mm]}, profile: thesis}
"""
FACES = (("Cube", "F1"), ("Prism", "F2"), ("Prism", "F1"), ("Tetra", "F3"), ("Box", "F2"))


class Wide:
    """A surface printed 1 % too large about a point, its strokes 0.2 mm too wide."""

    def __init__(self, surface, centre_mm):
        self.surface, self.centre, self.top_mm = surface, np.asarray(centre_mm), surface.top_mm

    def heights_mm(self, points_mm):
        at = (points_mm - self.centre) / 1.01 + self.centre
        ways = np.array([[0, 0], [0.1, 0], [-0.1, 0], [0, 0.1], [0, -0.1]])
        return np.max([self.surface.heights_mm(at + way) for way in ways], axis=0)


class Skin:
    """A sensor's defects, the same for all touches of a scan."""

    def __init__(self, rng, level):
        self.rng, self.mismatch = rng, level == "mismatch"
        height, aside = (0.08, 0.12) if self.mismatch else (0.03, 0.0)
        self.tips = Tips(
            lengths_mm=rng.normal(0, height, (16, 16)),
            shifts_mm=rng.normal(0, 1, (16, 16, 2)) * aside,
        )
        self.gains = np.exp(rng.normal(0, 0.12 if self.mismatch else 0.10, (16, 16)))

    def feel(self, surface, touch):
        forces = tabs(surface, SENSOR, touch, self.tips).forces_n
        if self.mismatch:
            forces = (gaussian_filter(forces, 0.45, mode="nearest") + 1e-12) ** 0.8
        forces = self.gains * forces
        return np.maximum(forces + self.rng.normal(0, 0.02, forces.shape), 0)


# --- edges ------------------------------------------------------------------------------


def true_line(touch, a, b):
    """Angle and offset of the edge from a to b, face to the left, in the sensor frame."""
    way = np.subtract(b, a) / np.linalg.norm(np.subtract(b, a))
    normal = np.array([-way[1], way[0]])
    angle = math.atan2(normal[1], normal[0]) - touch.theta_rad
    return angle, float(normal @ (np.asarray(a, float) - (touch.x_mm, touch.y_mm)))


def matched(edges, angle, offset):
    """Return the edge that is meant, and its largest error, mm."""
    n = np.array([math.cos(angle), math.sin(angle)])
    near = [
        (max(abs(float(n @ end) - offset) for end in (edge.start_mm, edge.end_mm)), edge)
        for edge in edges
        if abs(math.remainder(edge.angle_rad - angle, math.tau)) < 0.4
    ]
    worst, edge = min(near, default=(math.inf, None), key=lambda item: item[0])
    return (edge, worst) if worst < 4 else (None, worst)


def bench_edges(number, seed):
    face = FaceSurface(None, polygon([SQUARE]))
    print(f"{'noise':9}{'view':8}{'way':10}{'seen':>6}{'found':>7}{'median':>8}{'rms':>7}"
          f"{'95 %':>7}{'max mm':>8}{'rms deg':>9}{'in 95 %':>9}{'ms':>7}")  # fmt: skip
    for level, view in itertools.product(LEVELS, ("edge", "corner")):
        rng = np.random.default_rng(seed)
        rows = {"classical": [], "fitted": []}
        spent = {"classical": [], "fitted": []}
        corners, seen = [], 0
        for _ in range(number):
            skin = Skin(rng, level)
            y = rng.uniform(25, 55) if view == "edge" else rng.uniform(-3, 9)
            x = rng.uniform(-5, 9) if view == "edge" else rng.uniform(-3, 9)
            theta, force = rng.uniform(-math.pi, math.pi), rng.uniform(20, 120)
            touch = Touch(x, y, theta, force, *rng.normal(0, 0.01, 2))
            image = touch_image(SENSOR, skin.feel(face, touch))
            begun = time.process_time()
            rough = classical_edges(image)
            between_ = time.process_time()
            found = face_edges(image, SENSOR)
            spent["classical"].append(between_ - begun)
            spent["fitted"].append(time.process_time() - between_)
            lines = [true_line(touch, (0, 80), (0, 0)), true_line(touch, (0, 0), (80, 0))]
            for line in lines[: 1 if view == "edge" else 2]:
                seen += 1
                for way, edges in (("classical", rough), ("fitted", found)):
                    edge, worst = matched(edges, *line)
                    if edge is not None:
                        error = np.array(
                            [math.remainder(edge.angle_rad - line[0], math.tau),
                             edge.offset_mm - line[1]]
                        )  # fmt: skip
                        chi = float(error @ np.linalg.pinv(edge.covariance) @ error)
                        rows[way].append((worst, math.degrees(error[0]), chi < 5.99))
            points = vertices(found)
            if view == "corner" and len(points) == 1:
                c, s = math.cos(theta), math.sin(theta)
                at = (-c * x - s * y, s * x - c * y)
                corners.append(math.dist(at, points[0]))
        for way, found_rows in rows.items():
            worst, degrees, inside = np.array(found_rows, float).T
            print(f"{level:9}{view:8}{way:10}{seen:6}{len(worst):7}{np.median(worst):8.3f}"
                  f"{np.sqrt((worst**2).mean()):7.3f}{np.percentile(worst, 95):7.3f}"
                  f"{worst.max():8.3f}{np.sqrt((degrees**2).mean()):9.2f}{inside.mean():9.3f}"
                  f"{np.median(spent[way]) * 1e3:7.1f}")  # fmt: skip
        if corners:
            rms = np.sqrt(np.mean(np.square(corners)))
            print(f"{'':17}corner point: {len(corners)} found, median {np.median(corners):.3f}, "
                  f"rms {rms:.3f}, max {max(corners):.3f} mm")  # fmt: skip
    print(f"the thesis's largest error of an edge: {THESIS_MM} mm\n")


# --- scans ------------------------------------------------------------------------------


def scanned(scene, level, rng, theta, sigma_tactels):
    """Believed poses, readings and true planar poses of a raster over a face."""
    skin = Skin(rng, level)
    plan = raster([scene.region.starts], SENSOR, theta_rad=theta, least_cover=0.4)
    middle = scene.centre_mm()
    x, y = middle.tolist()
    T_base_face = surface_to_sensor(300, 0, 0.2, 100) @ surface_to_sensor(-x, -y, 0)
    wanted = np.array([T_base_face @ surface_to_sensor(x, y, theta) for x, y in plan.places_mm])
    if sigma_tactels is None:
        arm = follow_poses(Arm(), wanted, JointErrors(), rng)
        believed, true = arm.believed, arm.true
    else:
        believed, true = wanted, wanted.copy()
        true[:, :2, 3] += rng.normal(0, sigma_tactels * SENSOR.pitch_mm, (len(true), 2))
    surface = Wide(scene.surface, middle) if level == "mismatch" else scene.surface
    back, readings, places = np.linalg.inv(T_base_face), [], []
    for T_base_sensor in true:
        touch = touch_at(back @ T_base_sensor, 80.0)
        readings.append(skin.feel(surface, touch))
        places.append([touch.x_mm, touch.y_mm, touch.theta_rad])
    return believed, np.array(readings), np.array(places)


def counted(found, face, first):
    """Right, wrong and rejected symbols of a face."""
    at = transform_points(first, np.array([[s.x_mm, s.y_mm] for s in found]).reshape(-1, 2))
    count = Counter()
    for centre, label in zip(face.centres_mm, face.labels, strict=True):
        near = np.flatnonzero(np.linalg.norm(at - centre, axis=1) < 4)
        named = {found[k].label for k in near} - {-1}
        count["right" if label in named else "wrong" if named else "rejected"] += 1
    return count


class Tally:
    """What the scans of one row of the table gave."""

    def __init__(self):
        self.symbols, self.answered, self.wrong = Counter(), 0, 0
        self.mosaic, self.pose, self.turn = [], [], []
        self.touches, self.first, self.spent = [], [], []

    def add(self, answer, expected, true):
        if not answer:
            return
        self.answered += 1
        self.wrong += (answer.object, answer.face) != expected
        T = answer.T_face_probe
        self.pose.append(math.dist(T[:2, 3], true[:2]))
        self.turn.append(abs(math.remainder(math.atan2(T[1, 0], T[0, 0]) - true[2], math.tau)))

    def row(self):
        number = sum(self.symbols.values())
        pose = np.median(self.pose) if self.pose else math.nan
        turn = math.degrees(np.median(self.turn)) if self.turn else math.nan
        first = [n for n in self.first if n is not None]
        shown = f"{np.median(first):.0f}" if first else "-"
        return (
            f"{len(self.touches):6}{self.answered:9}{self.wrong:6}{number:8}"
            f"{self.symbols['right'] / number:7.3f}{self.symbols['wrong']:6}"
            f"{self.symbols['rejected']:7}{np.mean(self.mosaic):8.2f}{pose:8.2f}{turn:6.2f}"
            f"{np.mean(self.touches):8.0f}{shown:>6}{np.median(self.spent) * 1e3:9.2f}"
        )


def first_answer(lab, readings, believed):
    """Touches until an answer, in steps of four; None without one."""
    return next(
        (k for k in range(4, len(readings) + 4, 4)
         if read_scan(lab, SENSOR, readings[:k], believed[:k], "bounded").recognition), None
    )  # fmt: skip


def bench_scans(url, scans, seed, sigmas):
    lab = open_lab(url)
    encoding = lab.arrays[0]
    faces = {(f.object, f.face): f for f in map(encoding.face, range(len(encoding.faces)))}
    header = (f"{'noise':9}{'arm':>6}  {'placing':9}{'scans':>6}{'answered':>9}{'wrong':>6}"
              f"{'symbols':>8}{'right':>7}{'wrong':>6}{'reject':>7}{'mosaic':>8}{'pose mm':>8}"
              f"{'deg':>6}{'touches':>8}{'first':>6}{'ms/touch':>9}")  # fmt: skip
    print(header + "\n" + "(mosaic: rms of touches, tactels; first: touches until an answer)")
    for level, sigma in itertools.product(LEVELS, sigmas):
        tallies = {placing: Tally() for placing in PLACINGS}
        for (name, side), copy in itertools.product(FACES, range(scans)):
            rng = np.random.default_rng([seed, copy, FACES.index((name, side))])
            scene = registered_surface(url, name, side)
            believed, readings, true = scanned(scene, level, rng, 0.4 * copy, sigma)
            for placing, tally in tallies.items():
                merging = placing, max(0.75, 2 * (sigma or 0))
                begun = time.process_time()
                image = merge_touches(SENSOR, readings, believed, *merging)
                found = read_classically(
                    lab, image.image, T_image_probe=spatial_pose(image.poses[-1])
                )
                tally.spent.append((time.process_time() - begun) / len(readings))
                tally.symbols += counted(found.symbols, faces[name, side], true[0])
                away = (image.poses - relative_pose(true[0], true))[:, :2]
                away = away - away.mean(axis=0)
                tally.mosaic.append(np.sqrt((away**2).sum(axis=1).mean()) / SENSOR.pitch_mm)
                tally.touches.append(len(readings))
                tally.add(found.recognition, (name, side), true[-1])
                if placing == "bounded" and copy == 0:
                    tally.first.append(first_answer(lab, readings, believed))
        for placing, tally in tallies.items():
            shown = "arm" if sigma is None else f"{sigma:g}"
            print(f"{level:9}{shown:>6}  {placing:9}{tally.row()}", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--edges", type=int, default=200, help="touches of each view and noise")
    parser.add_argument("--scans", type=int, default=2, help="scans of each face, turned")
    parser.add_argument("--sigmas", default="arm,0.5,1", help="errors of the arm, tactels")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    sigmas = [None if word == "arm" else float(word) for word in given.sigmas.split(",")]
    if given.edges:
        bench_edges(given.edges, given.seed)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "set.yaml").write_text(SET)
        url = f"sqlite:///{folder / 'lab.db'}"
        encode(read_specs([folder / "set.yaml"]), folder=folder / "out", database=url, formats=())
        bench_scans(url, given.scans, given.seed, sigmas)


if __name__ == "__main__":
    main()
