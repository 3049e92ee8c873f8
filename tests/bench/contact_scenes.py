"""Extreme scenes at every level, and how fast a face is scanned.

    OPENBLAS_NUM_THREADS=1 python tests/bench/contact_scenes.py [extreme scan] [--side 60]

extreme  no force, nothing under the sensor, one tab, the edge of a face, the corner of a
         tetrahedron, 10 degrees, 1e-9 ... 1e9 N, overlays of 0.05 ... 20 mm, nu = .5, strokes of
         0.01 mm: the plate at rest, or the refusal. A line is wrong ("WRONG") where forces are
         not finite, pull, or do not add up; then the script ends with 1.
scan     a cube is encoded and registered; one face is scanned by `probe.scan.raster` (75 %
         overlap), 80 N, arm errors drawn (`probe.scan.kinesthetic`), film, board and noise with
         the film's memory from touch to touch; frames per second of processor time, by parts,
         each the least of the repetitions
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
import time
from itertools import pairwise
from pathlib import Path

import numpy as np
from reference.indenters import half_plane, sphere

from encoded_objects.base.sensor_type import Overlay, SensorType
from probe.contact.contract import Touch, WristStiffness
from probe.contact.press import press
from probe.errors import ContactError
from probe.surface.indenters import FlatPlate, RaisedStrip, Washer
from probe.surface.mesh import mesh

LEVELS = {"tab": ("footprint", "tabs-19"), "pad": ("layer-2", "layer-4")}
TEN = math.radians(10)
FREE = WristStiffness(0.0, 0.0)


def tetrahedron(edge_mm=40.0):
    """A tetrahedron that stands on a face, its corner up, at the origin."""
    height = edge_mm * math.sqrt(2 / 3)
    angle = np.array([0, 2, 4]) * math.pi / 3
    foot = np.c_[edge_mm / math.sqrt(3) * np.c_[np.cos(angle), np.sin(angle)], np.full(3, -height)]
    top = np.zeros(3)
    sides = [(a, b, top) for a, b in pairwise([*foot, foot[0]])]
    return mesh(np.array([*sides, foot[::-1]]))


def scenes():
    """Name, surface, touch, changes of the overlay."""
    corner = tetrahedron()
    yield "no force", Washer(), Touch(0.3, 0.2, 0.4, 0.0), {}
    yield "nothing there", Washer(), Touch(60.0, 0.2, 0.4, 10.0), {}
    yield "one tab", sphere(2.0), Touch(0.79, 0.79, 0.0, 0.2), {}
    yield "one tab, far out", sphere(2.0), Touch(8.73, 8.73, 0.0, 0.2), {}
    yield "one tab, free wrist", sphere(2.0), Touch(8.73, 8.73, 0.0, 0.2, wrist=FREE), {}
    yield "edge of a face", half_plane(), Touch(5.0, 0.0, 0.3, 20.0), {}
    yield "edge, free wrist", half_plane(), Touch(5.0, 0.0, 0.3, 20.0, wrist=FREE), {}
    yield "corner, 1 N", corner, Touch(0.4, 0.3, 0.2, 1.0), {}
    yield "corner, 100 N", corner, Touch(0.4, 0.3, 0.2, 100.0), {}
    yield "10 degrees", FlatPlate(), Touch(0, 0, 0, 20.0, TEN), {}
    for force in (1e-9, 1e-3, 1e3, 1e6, 1e9):
        yield f"{force:g} N", Washer(), Touch(0.3, 0.2, 0.4, force), {}
    for height in (0.05, 0.5, 20.0):
        yield f"overlay {height:g} mm", Washer(), Touch(0.3, 0.2, 0.4, 2.0), {"height_mm": height}
    for poisson in (0.0, 0.5):
        yield f"nu = {poisson:g}", Washer(), Touch(0.3, 0.2, 0.4, 20.0), {"poisson": poisson}
    for width in (0.01, 0.1):
        yield f"stroke {width:g} mm", RaisedStrip(width), Touch(0.31, 0, 0.02, 1.0), {}
        name = f"stroke {width:g}, floor"
        yield name, RaisedStrip(width, floor_mm=-0.8), Touch(0.31, 0, 0.02, 1.0), {}


def extreme(only) -> bool:
    print(f"{'scene':<20}{'level':<11}{'s':>6}  answer")
    sound = True
    for name, surface, touch, changed in scenes():
        for kind, levels in LEVELS.items():
            for level in levels:
                if only and level not in only:
                    continue
                sensor = SensorType(overlay=Overlay(kind=kind, **changed))
                start = time.process_time()
                try:
                    answer, good = described(press(surface, sensor, touch, accuracy=level), touch)
                except ContactError as refused:
                    answer, good = f"refused: {refused.cause}", bool(refused.fix)
                sound &= good
                seconds = time.process_time() - start
                print(f"{name:<20}{level:<11}{seconds:>6.2f}  {answer}"
                      + ("" if good else "   WRONG"), flush=True)  # fmt: skip
    return sound


def described(found, touch):
    """Return a line on a contact, and whether it can be true."""
    f = found.forces_n
    if touch.force_n == 0:
        return "an image of zeros", not f.any()
    tilts = np.degrees([found.tilt_x_rad, found.tilt_y_rad])
    good = np.isfinite([*f.ravel(), found.z_mm, *tilts]).all() and f.min() >= 0
    good = bool(good and abs(f.sum() / touch.force_n - 1) < 1e-5)
    felt = int((f > 1e-3 * f.max()).sum())
    line = f"z {found.z_mm:.4g} mm, tilt {tilts[0]:.3g} {tilts[1]:.3g} deg, {felt} tactels"
    return line, good


def scan(side_mm, repeat):
    from generator.pipeline import encode
    from generator.spec import read_specs
    from probe.simulate.registered import registered_object, registered_surface

    print(f"{'level':<9}{'touches':>8}{'frames/s':>10}" + "".join(
        f"{name:>10}" for name in ("arm ms", "press ms", "board ms")
    ) + "   of a touch")  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        spec, database = Path(folder) / "cube.yaml", Path(folder) / "lab.db"
        spec.write_text(
            f"name: Cube\nshape: {{cube: {side_mm:g} mm}}\n"
            f"output: {{folder: {folder}, formats: [stl], database: 'sqlite:///{database}'}}\n"
        )
        encode(read_specs([spec]))
        surface = registered_surface(str(database), "Cube").surface
        loops = [
            loop[:, :2] for loop in registered_object(str(database), "Cube").faces[0].polygon_mm
        ]
        for kind, level in (("tab", "tabs-7"), ("tab", "tabs-19"), ("pad", "layer-2"),
                            ("pad", "layer-4")):  # fmt: skip
            sensor = SensorType(overlay=Overlay(kind=kind))
            runs = [scanned(surface, loops, sensor, level) for _ in range(repeat)]
            count = runs[0][0]
            arm, pressing, board = np.min([run[1] for run in runs], axis=0) / count
            print(
                f"{level:<9}{count:>8}{1 / (arm + pressing + board):>10.0f}"
                f"{1e3 * arm:>10.2f}{1e3 * pressing:>10.2f}{1e3 * board:>10.2f}",
                flush=True,
            )


def scanned(surface, loops, sensor, level):
    """Scan once; return the number of frames, and CPU seconds of arm, contact and board."""
    from probe.arm import Arm
    from probe.circuit import Electronics, fsr_of, read_counts
    from probe.frame import frame_from
    from probe.scan.kinesthetic import JointErrors, follow_poses
    from probe.scan.places import surface_to_sensor
    from probe.scan.raster import raster

    rng = np.random.default_rng(1)
    start = time.process_time()
    plan = raster(loops, sensor)
    stands = [surface_to_sensor(260 + x, y - 40, 0.0, 100.0) for x, y in plan.places_mm.tolist()]
    follow_poses(Arm(), stands, JointErrors((3e-4,) * 5, (1e-3,) * 5), rng)
    times = [time.process_time() - start, 0.0, 0.0]
    fsr, electronics, state, frames = fsr_of(), Electronics(), None, []
    for seq, (x, y) in enumerate(plan.places_mm.tolist()):
        start = time.process_time()
        forces = press(surface, sensor, Touch(x, y, 0.0, 80.0), accuracy=level).forces_n
        middle = time.process_time()
        counts, state = read_counts(forces, electronics, fsr, state, rng)
        frames.append(frame_from(counts, t_ns=0, seq=seq))
        times[1] += middle - start
        times[2] += time.process_time() - middle
    return len(frames), times


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("tables", nargs="*", help="extreme, scan; default both")
    parser.add_argument("--level", action="append", help="of the extreme scenes, only these")
    parser.add_argument("--side", type=float, default=60.0, help="of the cube, mm")
    parser.add_argument("--repeat", type=int, default=3, help="scans")
    given = parser.parse_args()
    unknown = set(given.tables) - {"extreme", "scan"}
    if unknown:
        parser.error(f"no table {', '.join(unknown)}")
    tables = given.tables or ["extreme", "scan"]
    sound = extreme(given.level) if "extreme" in tables else True
    if "scan" in tables:
        scan(given.side, given.repeat)
    sys.exit(0 if sound else 1)


if __name__ == "__main__":
    main()
