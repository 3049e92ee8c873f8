"""A print's scale and skew from 30 touches, and what they do for the poses of 30 others.

    python tests/campaigns/as_built.py --touches 30 --level typical

A cube's panel is written, scaled from the middle of its file, touched, estimated, kept in the
database, and touched elsewhere: place before and after, and what of the 95 % ellipses holds.
Touches to learn from have seed 1, those to judge by seed 2, both at least 9 mm from the edges.
"""

from __future__ import annotations

import argparse
import math
import os
import shutil
import tempfile
from dataclasses import replace
from pathlib import Path
from time import perf_counter

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import numpy as np  # noqa: E402

from encoded_objects import encode  # noqa: E402
from probe.errors import ContactError  # noqa: E402
from probe.simulate.scene import TouchRanges, random_touches  # noqa: E402
from probe.simulate.target import part_surface  # noqa: E402
from probe.simulate.world.levels import LEVELS  # noqa: E402
from probe.simulate.world.sensor import LevelSensor  # noqa: E402
from probe.simulate.written import written_triangles  # noqa: E402
from probe.surface.mesh import mesh  # noqa: E402
from recognizer.as_built.estimate import (  # noqa: E402
    estimate_print,
    keep_prints,
)
from recognizer.as_built.touches import (  # noqa: E402
    WIDE_SCALE,
    measure_prints,
)
from recognizer.as_built.verdict import judge_print  # noqa: E402
from recognizer.errors import AsBuiltError  # noqa: E402
from recognizer.touch.lab import open_lab  # noqa: E402
from recognizer.touch.reader import Reader  # noqa: E402
from recognizer.touch.source import TouchImage  # noqa: E402
from recognizer.validation.statistics import chi2_quantile  # noqa: E402

CHI2_95 = chi2_quantile(0.95)  # 3 degrees of freedom
ON_FACE = TouchRanges(force_n=(20, 120), tilt_rad=math.radians(2), margin_mm=9)
PRINTS = {  # scale x, scale y, skew (rad)
    "as designed": (1.0, 1.0, 0.0),
    ".90": (0.9, 0.9, 0.0),
    ".92": (0.92, 0.92, 0.0),
    ".94": (0.94, 0.94, 0.0),
    ".95": (0.95, 0.95, 0.0),
    ".96": (0.96, 0.96, 0.0),
    ".97": (0.97, 0.97, 0.0),
    ".98": (0.98, 0.98, 0.0),
    ".99": (0.99, 0.99, 0.0),
    ".995": (0.995, 0.995, 0.0),
    "1.01": (1.01, 1.01, 0.0),
    "X .99": (0.99, 1.0, 0.0),
    "X .97": (0.97, 1.0, 0.0),
    "skew .01": (1.0, 1.0, 0.01),
}


def printed(file: Path, database: Path, print_: tuple[float, float, float]):
    """Return the scene of a part that is scaled from the middle of its file."""
    scale_x, scale_y, skew = print_
    S = np.eye(3)
    S[:2, :2] = [[scale_x, scale_y * math.sin(skew)], [0.0, scale_y * math.cos(skew)]]
    scene = part_surface(file, database=str(database))
    T_surface_part = np.eye(4)
    T_surface_part[:3, 3] = SHIFT
    return replace(scene, surface=mesh(written_triangles(file) @ S.T, T_surface_part))


SHIFT = (30.0, 30.0, -3.0)  # of the cube's panels: face frame from part frame


def touched(scene, reader, seed, touches, level):
    rng = np.random.default_rng(seed)
    for number in range(touches):
        while True:
            touch = next(random_touches(scene.region, rng, ON_FACE))
            try:
                counts = LevelSensor(reader.sensor, LEVELS[level]).read(scene, touch, rng).counts
            except ContactError:
                continue
            break
        yield touch, TouchImage(number, 0, 1, counts.astype(float), np.zeros(4), None)


def errors_of(reader, felt):
    """Return squares of place (mm) and turn (degrees), and chi squared, of what is answered."""
    found = []
    for touch, image in felt:
        answer = reader.read(image.counts)
        if not answer:
            continue
        turn = math.remainder(math.radians(answer.theta_deg) - touch.theta_rad, math.tau)
        error = np.array([answer.x_mm - touch.x_mm, answer.y_mm - touch.y_mm, turn])
        chi2 = error @ np.linalg.solve(answer.covariance, error)
        found.append((error[:2] @ error[:2], math.degrees(turn) ** 2, chi2))
    return found


def summary(errors):
    """Return how many, rms of place and turn, and the share inside the 95 % ellipsoid."""
    if not errors:
        return "  0"
    away, turns, chi2 = np.array(errors).T
    inside = 100 * np.mean(chi2 < CHI2_95)
    return (
        f"{len(errors):3d} {math.sqrt(away.mean()):6.3f} mm {math.sqrt(turns.mean()):5.2f} deg "
        f"{inside:4.0f} %"
    )


def judged(reader, felt):
    return summary(errors_of(reader, felt))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--touches", type=int, default=30)
    parser.add_argument("--level", choices=LEVELS, default="typical")
    parser.add_argument("--only", choices=PRINTS)
    options = parser.parse_args()
    folder = Path(tempfile.mkdtemp())
    encode(
        {"name": "Cube", "shape": {"cube": "60 mm"}},
        database=str(folder / "lab.db"), folder=folder / "out", formats=("stl",),
    )  # fmt: skip
    file = next((folder / "out").glob("**/Cube-F1.stl"))
    for name, print_ in PRINTS.items():
        if options.only not in (None, name):
            continue
        database = folder / "one.db"
        shutil.copy(folder / "lab.db", database)
        before = Reader(open_lab(database))
        scene = printed(file, folder / "lab.db", print_)
        learn = [one for _, one in touched(scene, before, 1, options.touches, options.level)]
        judge = list(touched(scene, before, 2, options.touches, options.level))
        usual = sum(bool(before.read(image.counts)) for image in learn)
        wide = Reader(open_lab(database), options=WIDE_SCALE)
        start = perf_counter()
        try:
            felt = measure_prints(wide, learn)
            found = estimate_print(felt, object_id=1, printer="fdm-0.4")
        except AsBuiltError as error:
            print(f"{name}: {error}; the usual reader answers {usual} of {len(learn)}", flush=True)
            continue
        seconds = perf_counter() - start
        keep_prints(database, [found])
        after = Reader(open_lab(database))
        off = (found.scale_x - print_[0], found.scale_y - print_[1], found.skew_rad - print_[2])
        spread = np.sqrt(np.diag(found.covariance))
        print(
            f"{name:12s} {len(felt)} (usual reader {usual}) of {len(learn)} in {seconds:.1f} s\n"
            f"  error {off[0]:+.5f} {off[1]:+.5f} {off[2]:+.5f} rad, said {spread[0]:.5f} "
            f"{spread[1]:.5f} {spread[2]:.5f}; strokes {found.stroke_mm:.2f} +- {spread[3]:.2f}\n"
            f"  before {judged(before, judge)}\n  after  {judged(after, judge)}\n"
            f"  {judge_print(found, 1.4).words}",
            flush=True,
        )


if __name__ == "__main__":
    main()
