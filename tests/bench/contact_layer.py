"""Level "layer": error against run time, and what leaving out saves.

    OPENBLAS_NUM_THREADS=1 python tests/bench/contact_layer.py [--scenes 500]

First table: error of the tactels (norm over that of the reference) and CPU time of a touch at
2, 4, 8 cells per tactel; the references are those of `contact_precision.py`. Second: one touch
on the washer and on a patch of symbols, in parts. "culled" finds levels and pressures with the
plate foreseen, "all cells" with every cell sampled in full and every level taking part; "made anew"
makes the influence functions, too. The last columns are one solution with the cells in touch known:
by the gathered compliance (its Cholesky factor, then a pose with the factor cached) and by the
conjugate gradients that are used. Third: scenes at random, a count of each outcome. CPU times are
medians on one thread.
"""

from __future__ import annotations

import argparse
import collections
import math
import statistics
import time
from functools import partial

import numpy as np
import scipy.fft
import scipy.linalg
from contact_precision import ROUND, cases, places, reference
from reference.indenters import half_plane, sphere

from encoded_objects.base.sensor_type import Overlay, SensorType
from probe.contact.contract import Touch, WristStiffness
from probe.contact.layer import layer
from probe.contact.layer_equilibrium import contact_system, equilibrium, plate_of, solve_glued
from probe.contact.layer_influence import influence
from probe.contact.layer_patch import DepthWindow, levels_of, patch_under
from probe.contact.plate import PlatePose
from probe.errors import ContactError
from probe.surface.indenters import Cross, RaisedStrip, RoughSurface, TiltedPlane, Washer

PAD = SensorType(overlay=Overlay("pad"))
CELLS = (2, 4, 8)
REFUSALS = (
    "tips",
    "press the pad",
    "into a pad",
    "strokes",
    "settle",
    "no equilibrium",
    "nothing under",
)


def cpu(action, repeat):
    """Return what an action gives and its median CPU time, ms."""
    found, times = action(), []
    for _ in range(repeat):
        start = time.process_time()
        found = action()
        times.append(time.process_time() - start)
    return found, 1e3 * statistics.median(times)


def precision(given):
    print(f"{'indenter':<10}" + "".join(f"{f'error, {n} cells':>18}{'ms':>8}" for n in CELLS))
    for case, (surface, _, force, wrist) in cases(np.random.default_rng(given.seed)).items():
        touches = list(places(np.random.default_rng([given.seed, 7]), given.places, force, wrist))
        wanted = [reference("pad", case, surface, PAD, touch) for touch in touches]
        kept = np.s_[1:-1, 1:-1] if case in ROUND else np.s_[:, :]
        line = f"{case:<10}"
        for cells in CELLS:
            squares, times = [], []
            for touch, true in zip(touches, wanted, strict=True):
                touched = partial(layer, surface, PAD, touch, cells_per_tactel=cells)
                found, ms = cpu(touched, given.repeat)
                error = (found.forces_n - true)[kept]
                squares.append((error**2).sum() / (true[kept] ** 2).sum())
                times.append(ms)
            line += f"{math.sqrt(statistics.fmean(squares)):>18.2e}{statistics.median(times):>8.1f}"
        print(line, flush=True)


def left_out(given):
    names = ("cells", "in touch", "touch", "culled", "all cells", "made anew",
             "factor", "cached", "gradients")  # fmt: skip
    print(f"\n{'scene':<10}" + "".join(f"{name:>11}" for name in names) + "   ms")
    known = cases(np.random.default_rng(given.seed))
    for case in ("washer", "patch"):
        surface, _, force, wrist = known[case]
        touch = Touch(0.3, 0.2, 0.4, force, wrist=wrist)
        for cells in CELLS[:2]:
            grid = influence(PAD, cells)
            contact, whole = cpu(
                lambda c=cells, s=surface, t=touch: layer(s, PAD, t, cells_per_tactel=c),
                given.repeat,
            )
            plane = PlatePose(contact.z_mm, contact.tilt_x_rad, contact.tilt_y_rad)

            def seen(few, s=surface, t=touch, c=cells, grid=grid, plane=plane):
                patch = patch_under(s, PAD, t, cells_per_tactel=c)
                depth = float((patch.highest_mm - plane.heights_mm(patch.centres_mm)).max())
                above = patch.highest_mm - plane.heights_mm(patch.centres_mm) >= -depth
                patch = patch.with_cells(np.flatnonzero(patch.neighbours(above | (not few))))
                rest = () if few else (DepthWindow(plane, -1e9),)
                levels = levels_of(patch, grid, DepthWindow(plane, -depth), rest)
                return levels, equilibrium(levels, plate_of(t, levels))

            (levels, pressed), some = cpu(lambda f=seen: f(few=True), given.repeat)
            _, every = cpu(lambda f=seen: f(few=False), given.repeat)
            _, new = cpu(lambda c=cells: influence.__wrapped__(PAD, c), given.repeat)
            system = contact_system(levels, pressed.touching)
            (factor, _), factored = cpu(lambda s=system, g=grid: gathered(s, g), 1)
            _, cached = cpu(
                lambda f=factor, s=system: scipy.linalg.cho_solve(f, s.levers.T), given.repeat
            )
            start = np.zeros(len(levels.cells))
            _, gradients = cpu(
                lambda s=system, t=touch, v=levels, p=start: solve_glued(
                    s, plate_of(t, v), p, np.zeros(3), 1e-5
                ),
                given.repeat,
            )
            times = (whole, some, every, whole + new, factored, cached, gradients)
            print(f"{case:<10}{cells:>11}{len(system.some):>11}"
                  + "".join(f"{ms:>11.2f}" for ms in times), flush=True)  # fmt: skip


def gathered(system, grid):
    """Return the Cholesky factor of the compliance between the cells in touch."""
    kernel = scipy.fft.irfft2(grid.compliance, s=grid.domain)
    row, column = np.divmod(system.levels.cells[system.some], grid.columns)
    matrix = kernel[(row[:, None] - row) % grid.domain[0], (column[:, None] - column)
                    % grid.domain[1]]  # fmt: skip
    matrix += np.diag(system.soft)
    return scipy.linalg.cho_factor(matrix), matrix


def scenes(given):
    rng = np.random.default_rng(given.seed)
    outcomes, times = collections.Counter(), []
    for _ in range(given.scenes):
        height, young = (
            10 ** rng.uniform(math.log10(0.05), math.log10(20)),
            10 ** rng.uniform(-2, 3),
        )
        poisson = float(rng.choice([0, 0.3, 0.45, 0.49, 0.4999, 0.5]))
        sensor = SensorType(overlay=Overlay("pad", height, young_mpa=young, poisson=poisson))
        force = 10 ** rng.uniform(-6, 9) if rng.random() < 0.3 else (
            young * height * 10 ** rng.uniform(-3, 1.2))  # fmt: skip
        stiffness = 3e3 * 10 ** rng.uniform(-6, 6) * (rng.random() < 0.7)
        wrist = WristStiffness(stiffness, stiffness * 10 ** rng.uniform(-1, 1))
        surface = (Washer(), RaisedStrip(rng.uniform(0.01, 3)), sphere(10 ** rng.uniform(0, 3)),
                   Cross(rng.uniform(0.3, 3), 15.0), TiltedPlane(*rng.uniform(-0.15, 0.15, 2)),
                   RoughSurface(int(rng.integers(100)), 10 ** rng.uniform(-4, 0)), half_plane(),
                   half_plane(-0.6), RaisedStrip(1.0, 10.0, -0.5))[rng.integers(9)]  # fmt: skip
        tilt_x, tilt_y = rng.uniform(-0.17, 0.17, 2) * (rng.random() < 0.6)
        x, y = rng.uniform(-9, 9, 2)
        touch = Touch(x, y, rng.uniform(0, 6.3), force, tilt_x, tilt_y, wrist)
        start = time.process_time()
        try:
            found = layer(surface, sensor, touch, cells_per_tactel=int(rng.choice([2, 3, 4])))
        except ContactError as refused:
            outcomes[next(word for word in REFUSALS if word in str(refused))] += 1
        else:
            sound = np.isfinite(found.forces_n).all() and found.forces_n.min() >= 0
            sound = sound and abs(found.forces_n.sum() / force - 1) < 1e-6
            outcomes["balanced" if sound else "WRONG"] += 1
        times.append(time.process_time() - start)
    print(f"\n{given.scenes} scenes: {dict(outcomes)}")
    print(f"median {1e3 * statistics.median(times):.1f} ms, longest {max(times):.2f} s")


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--places", type=int, default=3, help="touches on each indenter")
    parser.add_argument("--repeat", type=int, default=9, help="timings of each")
    parser.add_argument("--scenes", type=int, default=500, help="scenes at random")
    given = parser.parse_args()
    precision(given)
    left_out(given)
    scenes(given)


if __name__ == "__main__":
    main()
