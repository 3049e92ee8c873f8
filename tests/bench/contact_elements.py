"""The layer on indenters that tuned nothing, against finite elements on a pad of the sensor's size.

    PYTHONPATH=tests python tests/bench/contact_elements.py [--per-tactel 2] [--layers 2]

"free edge" is the pad as it is, "goes on" has 6 mm more of it on each side; "edge" is what the edge
makes, "own error" that of the elements with one less on a tactel. Errors of tactels are root mean
squares over that of the reference, of all but the outermost, which bear what the endless layer has
beyond the matrix. Times of a first touch and of the next ones, s.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
from reference.elements_space import elements
from reference.indenters import paraboloid, sphere

from encoded_objects.base.sensor_type import Overlay, SensorType
from probe.contact.contract import Contact, Touch
from probe.contact.layer import layer
from probe.surface.contract import HeightMap
from probe.surface.indenters import Cross, FlatPlate, RaisedStrip

PAD = SensorType(overlay=Overlay(kind="pad"))
TINY = 1e-9  #: mm, so that a node on a wall that was moved stays on it
CELLS = (4, 8)  #: of the layer, per tactel
WIDER_MM = 6.0  #: three thicknesses
INNER_TACTELS = np.s_[1:-1, 1:-1]
Walls = tuple[tuple[float, ...], tuple[float, ...]]

#: name, surface, touch, walls in the sensor frame
HELD_OUT: tuple[tuple[str, HeightMap, Touch, Walls], ...] = (
    ("strip 2.3 x 14 mm", RaisedStrip(2.3, 14.0), Touch(0.0, 0.0, 0.0, 20.0), ((1.15,), (7.0,))),
    (
        "strip 1.4 x 9 mm, aside",
        RaisedStrip(1.4 + TINY, 9.0 + TINY),
        Touch(-3.0, -2.0, 0.0, 8.0),
        ((2.3, 3.7), (2.5, 6.5)),
    ),
    ("sphere R = 20 mm", sphere(20.0), Touch(1.3, -0.7, 0.4, 20.0), ((), ())),
    ("paraboloid R = 60 mm", paraboloid(60.0), Touch(-2.0, 1.1, 0.0, 60.0), ((), ())),
    ("cross 8 mm, bars 1.6 mm", Cross(1.6, 8.0), Touch(0.0, 0.0, 0.0, 25.0), ((0.8, 4.0),) * 2),
    (
        "strip 2 x 12 mm, pad's edge",
        RaisedStrip(2.0 + TINY, 12.0 + TINY),
        Touch(-11.7, 0.0, 0.0, 8.0),
        ((10.7,), (6.0,)),
    ),
    (
        "plate, wrist at 3 degrees",
        FlatPlate(),
        Touch(0, 0, 0, 30.0, np.radians(3.0), 0.02),
        ((), ()),
    ),
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--per-tactel", type=int, default=2)
    parser.add_argument("--layers", type=int, default=2)
    options = parser.parse_args()
    held_out(options.per_tactel, options.layers)


def held_out(per_tactel: int, layers: int) -> None:
    print(f"{'':<29}{'own error':^20}{'edge':>10}"
          + "".join(f"{f'layer-{c}, {a}':^20}" for c in CELLS for a in ("goes on", "free edge"))
          + f"{'first':>8}{'again':>8}")  # fmt: skip
    print(f"{'indenter':<29}{'tactels':>10}{'depth':>10}{'tactels':>10}"
          + f"{'tactels':>10}{'depth':>10}" * (2 * len(CELLS)) + f"{'s':>8}{'s':>8}")  # fmt: skip
    for name, surface, touch, walls in HELD_OUT:
        coarse = elements(
            surface, PAD, touch, per_tactel=per_tactel - 1, layers=layers, walls_mm=walls
        )
        mesh = {"per_tactel": per_tactel, "layers": layers, "walls_mm": walls}
        start = time.process_time()
        free = elements(surface, PAD, touch, **mesh)
        first = time.process_time()
        elements(surface, PAD, touch, **mesh)
        again = time.process_time()
        wide = elements(surface, PAD, touch, **mesh, margin_mm=WIDER_MM)
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
        print(f"{name:<29}" + "".join(
            f"{row[key]:>10.1e}" for key in row if key not in ("indenter", "first_s", "again_s")
        ) + f"{row['first_s']:>8.1f}{row['again_s']:>8.2f}", flush=True)  # fmt: skip


def rms(found: np.ndarray, truth: np.ndarray) -> float:
    return float(np.sqrt(((found - truth) ** 2).mean() / (truth**2).mean()))


def depth_error(found: Contact, truth: Contact, surface: HeightMap) -> float:
    return (surface.top_mm - found.z_mm) / (surface.top_mm - truth.z_mm) - 1


if __name__ == "__main__":
    main()
