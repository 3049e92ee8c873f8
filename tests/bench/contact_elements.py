"""Level "layer" held against finite elements on indenters that tuned nothing; and the washer.

    OPENBLAS_NUM_THREADS=1 python tests/bench/contact_elements.py [--per-tactel 2] [-o FILE]

First table: the washer of 15/7 mm with 80 N on a pad of 2 mm by the section through its axis, error
and processor time against the number of unknowns. Second table: indenters on a pad of the
sensor's size, "free edge" as it is and "goes on" with 8 mm more pad on each side: what the edge
makes, errors of the layer against both (all tactels but the outermost), and of the elements
against themselves with one element less on a tactel. Errors of tactels are root mean squares
over that of the reference.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

import numpy as np

from probe.contact.contract import Contact, Touch
from probe.contact.elements import elements
from probe.contact.elements_round import indented, washer_pad
from probe.contact.layer import layer
from probe.sensor import Overlay, Sensor
from probe.surface.contract import Surface
from probe.surface.indenters import Cross, Paraboloid, Plate, Sphere, Strip

PAD = Sensor(overlay=Overlay(kind="pad"))
INNER, OUTER, FORCE = 3.5, 7.5, 80.0
TINY = 1e-9  #: mm, so that a node on a wall that was moved stays on it
CELLS = (4, 8)  #: of the layer, per tactel
INNER_TACTELS = np.s_[1:-1, 1:-1]  #: the outermost feel what the endless layer bears outside
Walls = tuple[tuple[float, ...], tuple[float, ...]]

#: name, surface, touch, walls in the sensor frame
HELD_OUT: tuple[tuple[str, Surface, Touch, Walls], ...] = (
    ("strip 2.3 x 14 mm", Strip(2.3, 14.0), Touch(0.0, 0.0, 0.0, 20.0), ((1.15,), (7.0,))),
    (
        "strip 1.4 x 9 mm, aside",
        Strip(1.4 + TINY, 9.0 + TINY),
        Touch(-3.0, -2.0, 0.0, 8.0),
        ((2.3, 3.7), (2.5, 6.5)),
    ),
    ("sphere R = 20 mm", Sphere(20.0), Touch(1.3, -0.7, 0.4, 20.0), ((), ())),
    ("paraboloid R = 60 mm", Paraboloid(60.0), Touch(-2.0, 1.1, 0.0, 60.0), ((), ())),
    ("cross 8 mm, bars 1.6 mm", Cross(1.6, 8.0), Touch(0.0, 0.0, 0.0, 25.0), ((0.8, 4.0),) * 2),
    ("plate, wrist at 3 degrees", Plate(), Touch(0, 0, 0, 30.0, np.radians(3.0), 0.02), ((), ())),
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--per-tactel", type=int, default=2)
    parser.add_argument("--repeat", type=int, default=5)
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args()
    rows = held_out(options.per_tactel)
    if options.output:
        options.output.write_text(json.dumps(rows, indent=1), encoding="utf-8")


def washer(repeat: int) -> list[dict[str, object]]:
    print(f"{'washer':<10}{'unknowns':>9}{'ms':>8}{'tactels':>10}{'depth':>10}")
    found = []
    for kind, parts in [("q2q1", n) for n in (60, 40, 32, 24, 16, 8, 4)] + [
        ("q1p0", n) for n in (32, 16, 8)
    ]:
        times = []
        for _ in range(repeat if parts < 40 else 1):
            start = time.process_time()
            pad = washer_pad(INNER, OUTER, 2.0, 1.0, 0.4999, parts=parts, kind=kind)
            pressed = indented(pad, annulus, FORCE)
            tactels = pressed.tactels_n(PAD)
            times.append(1e3 * (time.process_time() - start))
        if not found:
            truth, depth = tactels, pressed.depth_mm
        row = {
            "element": kind, "unknowns": pad.unknowns, "ms": float(np.median(times)),
            "tactels": rms(tactels, truth), "depth": pressed.depth_mm / depth - 1,
        }  # fmt: skip
        found.append(row)
        print(f"{kind:<10}{row['unknowns']:>9}{row['ms']:>8.0f}{row['tactels']:>10.1e}"
              f"{row['depth']:>10.1e}", flush=True)  # fmt: skip
    print(f"depth {depth:.5f} mm, {truth.sum():.2f} of {FORCE:g} N on the matrix\n")
    return found


def annulus(r: np.ndarray) -> np.ndarray:
    slack = 1e-9 * OUTER
    return np.where((r >= INNER - slack) & (r <= OUTER + slack), 0.0, -np.inf)


def held_out(per_tactel: int) -> list[dict[str, object]]:
    print(f"{'':<27}{'own error':^20}{'edge':>10}"
          + "".join(f"{f'layer-{c}, {a}':^20}" for c in CELLS for a in ("goes on", "free edge"))
          + f"{'first':>8}{'again':>8}")  # fmt: skip
    print(f"{'indenter':<27}{'tactels':>10}{'depth':>10}{'tactels':>10}"
          + f"{'tactels':>10}{'depth':>10}" * (2 * len(CELLS)) + f"{'s':>8}{'s':>8}")  # fmt: skip
    found = []
    for name, surface, touch, walls in HELD_OUT:
        start = time.process_time()
        free = elements(surface, PAD, touch, per_tactel=per_tactel, walls_mm=walls)
        first = time.process_time()
        elements(surface, PAD, touch, per_tactel=per_tactel, walls_mm=walls)
        again = time.process_time()
        coarse = elements(surface, PAD, touch, per_tactel=per_tactel - 1, walls_mm=walls)
        wide = elements(surface, PAD, touch, per_tactel=per_tactel, walls_mm=walls, margin_mm=8.0)
        quicks = {c: layer(surface, PAD, touch, cells_per_tactel=c) for c in CELLS}
        row = {
            "indenter": name,
            "own": rms(coarse.forces_n, free.forces_n),
            "own_depth": depth_error(coarse, free, surface),
            "edge": rms(wide.forces_n, free.forces_n),
            **{
                f"layer{cells}_{against}{what}": measure
                for cells, quick in quicks.items()
                for against, truth in (("wide", wide), ("free", free))
                for what, measure in (
                    ("", rms(quick.forces_n[INNER_TACTELS], truth.forces_n[INNER_TACTELS])),
                    ("_depth", depth_error(quick, truth, surface)),
                )
            },
            "first_s": first - start,
            "again_s": again - first,
        }
        found.append(row)
        print(f"{name:<27}" + "".join(
            f"{row[key]:>10.1e}" for key in row if key not in ("indenter", "first_s", "again_s")
        ) + f"{row['first_s']:>8.1f}{row['again_s']:>8.2f}", flush=True)  # fmt: skip
    return found


def rms(found: np.ndarray, truth: np.ndarray) -> float:
    return float(np.sqrt(((found - truth) ** 2).mean() / (truth**2).mean()))


def depth_error(found: Contact, truth: Contact, surface: Surface) -> float:
    return (surface.top_mm - found.z_mm) / (surface.top_mm - truth.z_mm) - 1


if __name__ == "__main__":
    main()
