"""What asking a surface costs, and what a simulated touch costs with it.

    python tests/bench/surfaces.py [--touches 200] [--frames 2000]

Makes a 60 mm cube (panels and whole) in a folder of its own, then prints: the time to make
each kind of surface; of a first touch and of the ones after it, 4,864 points (19 on each tab);
end to end a touch (surface, contact, film, board); frames of a `sim:` stream and of touches one
by one; what leaving out saves. CPU times, medians.
"""

from __future__ import annotations

import itertools
import statistics
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from reference.indenters import sphere

from encoded_objects.base.sensor_type import Overlay, SensorType
from generator.pipeline import encode
from generator.spec import read_specs
from probe.circuit import read_counts
from probe.contact.contract import Touch
from probe.contact.press import press
from probe.contact.tips import Tips, tip_points
from probe.simulate.registered import registered_surface
from probe.simulate.scene import bare_scene
from probe.simulate.sensor import simulated_sensor
from probe.simulate.source import frames_of
from probe.simulate.target import part_surface
from probe.simulate.touch import TouchRanges, random_touches
from probe.surface.face import endless_face
from probe.surface.indenters import RoughSurface, Washer

sys.path.insert(0, str(Path(__file__).parents[1] / "campaigns"))
import runner

SPEC = """
objects:
- {name: Cube, shape: {cube: 60 mm}}
- {name: Whole, shape: {cube: 60 mm}, print: {parts: whole}}
"""
LARGE = "name: Large\nshape: {cube: 180 mm}\nprofile: large\nprint: {parts: whole}\n"
STEPS = ((((-1, 1), (-1, -1)), ((-1, -1), (1, -1))), (((-1, 0), (1, 0)), ((0, 0), (0, 1))))


def cpu(action):
    """Return what an action gives and its CPU time, ms."""
    start = time.process_time()
    found = action()
    return found, 1e3 * (time.process_time() - start)


def asked(name, make, places, points):
    """Print the time to make a surface, of its first query, and of later ones."""
    surface, made = cpu(make)
    at = [touch.on_surface(points) for touch in places]
    times = [cpu(lambda p=p: surface.heights_mm(p))[1] for p in itertools.chain(at, at)]
    later = statistics.median(times[len(at) :])
    print(
        f"{name:<34}{made:>10.1f}{times[0]:>12.2f}{later:>10.3f}{1e6 * later / len(points):>10.0f}"
    )
    return surface


def touched(name, surface, sensor, touches, accuracy):
    """Print the time of touches from surface to counts."""
    simulated, scene = simulated_sensor(sensor, accuracy=accuracy), bare_scene(surface)
    board, film, rng = simulated.board, simulated.film, np.random.default_rng(0)
    press(surface, sensor, touches[0], accuracy=accuracy)  # what is made once
    whole = [cpu(lambda t=t: simulated.read(scene, t, rng))[1] for t in touches]
    alone = [cpu(lambda t=t: press(surface, sensor, t, accuracy=accuracy)) for t in touches]
    counts = [cpu(lambda c=c: read_counts(c.forces_n, board, film, None, rng))[1] for c, _ in alone]
    times = (statistics.median(part) for part in (whole, [ms for _, ms in alone], counts))
    print(f"{name:<34}" + "".join(f"{ms:>12.3f}" for ms in times))


def main():
    parser = runner.arguments(__doc__, touches=200, seed=1)
    parser.add_argument("--frames", type=int, default=2000)
    given = runner.parse(parser)
    with tempfile.TemporaryDirectory() as folder:
        report(Path(folder), given)


def report(folder, given):
    database, other = str(folder / "lab.db"), str(folder / "large.db")
    for text, url in ((SPEC, database), (LARGE, other)):
        (folder / "set.yaml").write_text(text)
        specs = read_specs([folder / "set.yaml"])
        encode(specs, folder=folder / "out", database=f"sqlite:///{url}", formats=("stl",))
    panel = next((folder / "out").rglob("Cube-F1.stl"))
    whole = next((folder / "out").rglob("Whole.stl"))
    large = next((folder / "out").rglob("Large.stl"))
    scene = registered_surface(database, "Cube", "F1")
    rng = np.random.default_rng(given.seed)
    inside = TouchRanges(margin_mm=18.0)
    places = list(itertools.islice(random_touches(scene.region, rng, inside), given.touches))
    points = tip_points(SensorType(), Tips())[0].reshape(-1, 2)
    grid = np.random.default_rng(0).integers(0, 2, (63, 65))

    print(f"{'surface':<34}{'made ms':>10}{'first ms':>12}{'then ms':>10}{'ns/point':>10}")
    face = asked("registered face", lambda: registered_surface(database, "Cube", "F1").surface,
                 places, points)  # fmt: skip
    mesh = asked("panel, STL", lambda: part_surface(panel, database=database).surface,
                 places, points)  # fmt: skip
    asked("whole cube, STL", lambda: part_surface(whole, database=database, face="F1").surface,
          places, points)  # fmt: skip
    for name, make in (
        ("cube of 180 mm, STL", lambda: part_surface(large, database=other, face="F1")),
        ("cube of 180 mm, registered", lambda: registered_surface(other, "Large", "F1")),
    ):
        asked(name, lambda make=make: make().surface, places, points)
    asked("array, as a table", lambda: endless_face(grid, STEPS), places, points)
    asked("array, as a function", lambda: endless_face(lambda r, c: (r * r + c) % 2, STEPS),
          places, points)  # fmt: skip
    for body in (Washer(), sphere(), RoughSurface()):
        asked(type(body).__name__.lower(), lambda body=body: body, places, points)

    print(f"\n{'a touch, median of CPU ms':<34}{'all':>12}{'press':>12}{'counts':>12}")
    some = places[: max(10, given.touches // 4)]
    for level in ("footprint", "tabs-7", "tabs-19", "tabs-61"):
        touched(f"{level} on the registered face", face, SensorType(), places, level)
    touched("tabs-19 on the panel's STL", mesh, SensorType(), places, "tabs-19")
    pad = SensorType(overlay=Overlay(kind="pad"))
    for level in ("layer-2", "layer-4"):
        touched(f"{level} on the registered face", face, pad, some, level)

    frames = frames_of(f"{database}#Cube/F1", {"seed": "1", "rate": "220"})
    _, ms = cpu(lambda: list(itertools.islice(frames, given.frames)))
    print(
        f"\nsim: stream, 220 frames to a second of the device: {1e3 * given.frames / ms:.0f} "
        "frames in a second of CPU"
    )

    def median(action):
        return statistics.median(cpu(action)[1] for _ in range(20))

    print("\nleaving out:")
    at = places[0].on_surface(points)
    lattice = face.lattice
    symbols, pitch = lattice.template.symbols, lattice.template.pitch_mm
    within = at - (np.floor(at / pitch) + 0.5) * pitch
    labels = np.zeros(len(at), dtype=np.int64)
    by_table = median(lambda: lattice.heights_mm(at))
    exact = median(lambda: symbols.heights_mm(labels, within[:, 0], within[:, 1]))
    print(f"  table of pieces {by_table:.3f} ms, every edge for every point {exact:.3f} ms: "
          f"{exact / by_table:.0f}x")  # fmt: skip
    patch, everything = cpu(lambda: mesh.heights_mm(at))[1], mesh.corners
    some_points = at[:: len(at) // 60]
    all_pairs = cpu(lambda: brute(everything, some_points))[1] * len(at) / len(some_points)
    print(f"  bins of triangles {patch:.2f} ms, all {len(everything):,} triangles {all_pairs:.0f} "
          f"ms: {all_pairs / patch:.0f}x")  # fmt: skip
    inner, outer = (
        median(lambda y=y: face.heights_mm(Touch(30.0, y, 0.4, 60.0).on_surface(points)))
        for y in (30.0, 0.0)
    )
    print(f"  neighbouring faces: {inner:.3f} ms inside the face, {outer:.3f} ms over its edge")


def brute(corners, points):
    """Return the heights by looking at every triangle for every point."""
    (ax, bx, cx), (ay, by, cy), (az, bz, cz) = corners.transpose(2, 1, 0)
    x, y = points[:, :1], points[:, 1:]
    ab = (bx - ax) * (y - ay) - (by - ay) * (x - ax)
    bc = (cx - bx) * (y - by) - (cy - by) * (x - bx)
    ca = (ax - cx) * (y - cy) - (ay - cy) * (x - cx)
    inside = ((ab >= 0) & (bc >= 0) & (ca >= 0)) | ((ab <= 0) & (bc <= 0) & (ca <= 0))
    z = np.where(inside, (ab * cz + bc * az + ca * bz) / (ab + bc + ca), -np.inf)
    return z.max(axis=1)


if __name__ == "__main__":
    main()
