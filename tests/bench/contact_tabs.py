"""A touch by tabs: time and error against the points on a tip, and what leaving out saves.

    OPENBLAS_NUM_THREADS=1 python tests/bench/contact_tabs.py --touches 100 --seed 1

Random poses on an embossed face (GF(4) symbols, pitch 7 mm, stroke 1.4, height 1, draft
10 degrees), a washer, a cross, a sphere, a strip and half a face. One line per scene and
number of points: median processor time of a whole touch, of its heights alone, of the plate
with all points, and with those left out that cannot touch (each the best of `--repeats`
calls); Newton steps; the image's error (norm over norm) and the error of the plate's height
against 817 points a tip. The error is that of counting points under edges: the model's own
error against elements is not in it.
"""

from __future__ import annotations

import argparse
import math
import statistics
import time

import numpy as np

from encoded_objects.base.sensor_type import SensorType
from probe.contact.contract import Touch
from probe.contact.plate import Columns, load_of, rest
from probe.contact.tabs import TOLERANCE, heights_under, tabs, tabs_at_rest, tip_laws
from probe.contact.tips import Tips, tip_points
from probe.surface.face import endless_face
from probe.surface.indenters import Cross, HalfPlane, RaisedStrip, Sphere, Washer

SENSOR = SensorType()
POINTS = (7, 19, 37, 61, 127)
DENSE_4 = (
    (((-1, 1), (-1, -1)), ((-1, -1), (1, -1))),
    (((1, -1), (-1, -1)), ((-1, -1), (-1, 0)), ((-1, 0), (0, 1)), ((0, -1), (0, 0))),
    (((-1, -1), (0, -1)), ((0, -1), (0, 0)), ((0, 0), (1, 1)), ((0, 0), (-1, 0))),
    (((-1, 1), (-1, -1)), ((-1, -1), (1, -1)), ((1, -1), (1, 1))),
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--touches", type=int, default=100)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    face = endless_face(rng.integers(0, 4, (63, 65)), DENSE_4)
    scenes = {
        "face": (face, 200.0, 0.0),
        "face, tilt 2 deg": (face, 200.0, 0.035),
        "washer": (Washer(), 3.0, 0.0),
        "cross": (Cross(), 3.0, 0.0),
        "strip 2 mm": (RaisedStrip(), 3.0, 0.0),
        "sphere 40 mm": (Sphere(40.0), 3.0, 0.0),
        "half a face": (HalfPlane(), 6.0, 0.0),
    }
    print(f"{'scene':<18}{'points':>7}{'touch ms':>10}{'heights':>9}{'plate':>8}{'all points':>12}"
          f"{'saved':>7}{'steps':>7}{'image rms':>11}{'worst':>8}{'z um':>7}")  # fmt: skip
    for name, (surface, reach, tilt) in scenes.items():
        touches = [
            Touch(
                rng.uniform(-reach, reach),
                rng.uniform(-reach, reach),
                rng.uniform(0, 2 * math.pi),
                80.0,
                rng.uniform(-tilt, tilt),
                rng.uniform(-tilt, tilt),
            )
            for _ in range(options.touches)
        ]
        fine = [reference(surface, touch) for touch in touches[:40]]
        for points in POINTS:
            print(f"{name:<18}" + line(surface, touches, fine, points, options.repeats))


def line(surface, touches, fine, number, repeats) -> str:
    tips = Tips(number)
    points, drop = tip_points(SENSOR, tips)
    whole, surfaces, plates, full = [], [], [], []
    for touch in touches:
        heights = heights_under(surface, touch, points) - drop
        load = load_of(touch)
        whole.append(best(lambda t=touch: tabs(surface, SENSOR, t, tips), repeats))
        surfaces.append(best(lambda t=touch: heights_under(surface, t, points), repeats))
        plates.append(
            best(lambda h=heights, a=load: tabs_at_rest(points, h, SENSOR.overlay, a), repeats)
        )
        full.append(best(lambda h=heights, a=load: unculled(points, h, a), repeats))
    found = [tabs(surface, SENSOR, touch, tips) for touch in touches]
    errors = [
        np.linalg.norm(a.forces_n - b.forces_n) / np.linalg.norm(b.forces_n)
        for a, b in zip(found, fine, strict=False)
    ]
    z = [abs(a.z_mm - b.z_mm) for a, b in zip(found, fine, strict=False)]
    t = [1e3 * statistics.median(x) for x in (whole, surfaces, plates, full)]
    steps = statistics.median(a.iterations for a in found)
    return (
        f"{number:>7}{t[0]:>10.3f}{t[1]:>9.3f}{t[2]:>8.3f}{t[3]:>12.3f}{t[3] / t[2]:>6.1f}x"
        f"{steps:>7.0f}{np.sqrt(np.mean(np.square(errors))):>11.4f}{max(errors):>8.4f}"
        f"{1e3 * np.mean(z):>7.2f}"
    )


def unculled(points, heights, load):
    """Bring the plate to rest on every point there is, begun at first touch."""
    n, q = heights.shape
    skin, column = tip_laws(SENSOR.overlay, q)
    columns = Columns(column, np.arange(n) * q, np.arange(n * q) // q, np.zeros(n))
    return rest(
        points.reshape(-1, 2),
        heights.ravel(),
        skin,
        load,
        columns=columns,
        tolerance=TOLERANCE,
    )


def reference(surface, touch):
    return tabs(surface, SENSOR, touch, Tips(817))


def best(call, repeats) -> float:
    times = []
    for _ in range(repeats):
        start = time.process_time()
        call()
        times.append(time.process_time() - start)
    return min(times)


if __name__ == "__main__":
    main()
