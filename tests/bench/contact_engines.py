"""Error against run time of contact engines that share no model with ours.

    OPENBLAS_NUM_THREADS=1 PYTHONPATH=tests python tests/bench/contact_engines.py [--write]

The five indenters of `contact_precision.py` as closed bodies; the patch is a written face.
The error of an image is the norm of its deviation from the same engine's with 217 points on
every tip, over the norm of that: what asking fewer points costs. Beside it, how far the
engine's image lies from our own engine's with 217 points, of an elastomer as stiff: what the
two models make of the same touch. Root mean squares over the places, then the worst indenter;
CPU times with the surface, the least of the repetitions, medians over places and indenters.
`--write` puts the lines into `precision.json` and draws its picture anew.
"""

from __future__ import annotations

import json
import math
import statistics
import sys
import tempfile
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from contact_precision import BALL_MM, STIFF, TABLE, places, three, write_table
from manifold3d import Manifold

from encoded_objects import encode
from encoded_objects.base.sensor_type import SensorType
from probe.contact.contract import WristStiffness
from probe.contact.engines import engine_named
from probe.contact.mujoco import DEEPEST_MM, STIFFER
from probe.contact.tips import Tips
from probe.simulate.target import part_surface
from probe.surface.body import body_of
from probe.surface.mesh import mesh

sys.path.insert(0, str(Path(__file__).parents[1] / "campaigns"))
import runner

POINTS = (7, 19, 61)
REFERENCE = 217
DEEP_MM = 4.0  #: of the indenters


def main():
    """Print the lines; with `--write` they go into `precision.json`."""
    given = runner.asked(__doc__, engine="mujoco", places=40, repeat=2, seed=1, write=False)
    found = {points: [] for points in POINTS}
    for case, (surface, force_n, wrist) in bodies().items():
        rng = np.random.default_rng([given.seed, 7])
        touches = list(places(rng, given.places, force_n, wrist))
        for points, line in lines_of(given.engine, surface, touches, given.repeat):
            found[points].append(line)
            print(f"{case:8}{given.engine}-{points:<5} error {line[0]:9.2e}, from our own "
                  f"{line[1]:9.2e}   {line[2]:7.1f} ms", flush=True)  # fmt: skip
    table = []
    for points, lines in found.items():
        errors, others, ms = zip(*lines, strict=True)
        line = {"engine": given.engine, "level": f"{given.engine}-{points}",
                "touches": given.places * len(lines), "error": three(max(errors)),
                "from_own": three(max(others)), "ms": three(statistics.median(ms))}  # fmt: skip
        table.append(line)
        print(json.dumps(line))
    if given.write:
        known = json.loads(TABLE.read_text())
        kept = [line for line in known.get("engines", []) if line["engine"] != given.engine]
        write_table(known | {"engines": kept + table})


def bodies():
    """Name -> body, force (N), wrist: as in `contact_precision.cases`."""
    low = (0, 0, -DEEP_MM)
    ring = Manifold.cylinder(DEEP_MM, 7.5, 7.5, 256) - Manifold.cylinder(DEEP_MM, 3.5, 3.5, 256)
    bar = Manifold.cube((2, 60, DEEP_MM)).translate((-1, -30, -DEEP_MM))
    cap = Manifold.sphere(BALL_MM, 512).translate((0, 0, -BALL_MM))
    cap = cap ^ Manifold.cube((60, 60, DEEP_MM), center=True).translate((0, 0, -DEEP_MM / 2))
    corners = [(x, y, z) for x in (-30, 30) for y in (-30, 30) for z in (0, 1)]
    plane = Manifold.hull_points([(x, y, z * DEEP_MM * 2 + 0.02 * x + 0.01 * y - 9 + z)
                                  for x, y, z in corners])  # fmt: skip
    return {
        "washer": (surface_of(ring.translate(low)), 80.0, STIFF),
        "strip": (surface_of(bar), 40.0, STIFF),
        "sphere": (surface_of(cap), 40.0, STIFF),
        "patch": (written_face(), 80.0, STIFF),
        "tilt": (surface_of(plane), 60.0, WristStiffness()),
    }


def surface_of(body):
    made = body.to_mesh()
    return mesh(np.asarray(made.vert_properties, float)[:, :3][np.asarray(made.tri_verts)])


def written_face():
    """Return a face of a cube as its STL holds it, its middle at the origin."""
    with tempfile.TemporaryDirectory() as folder:
        database = f"{folder}/lab.db"
        encode({"name": "Cube", "shape": {"cube": "90 mm"}, "profile": "one-touch"},
               folder=folder, database=database, formats=("stl",))  # fmt: skip
        part = next(iter(sorted(Path(folder).rglob("*-F1.stl"))))
        scene = part_surface(part, database=database, face="F1")
    triangles = body_of(scene.surface)
    top = triangles[:, :, 2].max()
    return mesh(triangles - (*scene.centre_mm(), top))


def lines_of(engine, surface, touches, repeat):
    """Yield (points, (error, distance from our own, ms)) for one indenter."""
    press, own = engine_named(engine).press, engine_named("own").press
    sensor = SensorType()
    young = STIFFER * sensor.overlay.young_mpa * DEEPEST_MM / sensor.overlay.height_mm
    stiff = replace(sensor.overlay, young_mpa=young, height_mm=DEEPEST_MM)
    ours = replace(sensor, overlay=stiff)
    wanted = [press(surface, sensor, touch, Tips(REFERENCE)).forces_n for touch in touches]
    others = [own(surface, ours, touch, Tips(REFERENCE)).forces_n for touch in touches]
    for points in POINTS:
        images, times = [], []
        for touch in touches:
            work = partial(press, surface, sensor, touch, Tips(points))
            made = [runner.clocked(work) for _ in range(repeat)]
            images.append(made[-1][0].forces_n)
            times.append(min(ms for _, ms in made))
        yield points, (apart(images, wanted), apart(images, others), statistics.median(times))


def apart(images, wanted):
    """Return the root mean square of |image - wanted| / |wanted|."""
    ratios = [
        np.linalg.norm(a - b) / np.linalg.norm(b) for a, b in zip(images, wanted, strict=True)
    ]
    return math.sqrt(statistics.fmean(r * r for r in ratios))


if __name__ == "__main__":
    main()
