"""Finite elements of a touch: error against run time, and the layer held against them.

    PYTHONPATH=tests python tests/bench/contact_elements.py [washer tab space held-out] [-o F]

washer    the washer of 15/7 mm with 80 N on a pad of 2 mm by the section through its axis:
          error against unknowns and processor time; the reference is the first line
tab       a tab's neo-Hookean law, and that of a tab in part covered, over finite elements
space     a ball on the pad in space against the section: error against elements and time
held-out  the layer on indenters that tuned nothing, against elements on a pad of the sensor's
          size: "free edge" as it is, "goes on" with 6 mm more pad on each side; "edge" is what
          the edge makes, "own error" that of the elements with one less on a tactel

Errors of tactels are root mean squares over that of the reference; of the layer, all tactels but
the outermost, since those feel what the endless layer bears beside the matrix.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from reference.elements_axisymmetric import section
from reference.elements_round import indented, washer_pad
from reference.elements_space import condensed_pad, elements
from reference.elements_tab import Tab, compressed, partly_covered
from reference.indenters import paraboloid, sphere

from encoded_objects.base.sensor_type import Overlay, SensorType
from probe.contact.contract import Contact, Touch, WristStiffness
from probe.contact.layer import layer
from probe.surface.contract import HeightMap
from probe.surface.indenters import Cross, FlatPlate, RaisedStrip

PAD = SensorType(overlay=Overlay(kind="pad"))
INNER, OUTER, FORCE = 3.5, 7.5, 80.0
TINY = 1e-9  #: mm, so that a node on a wall that was moved stays on it
COVERED_PARTS = 3  #: elements along the radius of a tab that is covered in part
CELLS = (4, 8)  #: of the layer, per tactel
WIDER_MM = 6.0  #: three thicknesses
INNER_TACTELS = np.s_[1:-1, 1:-1]  #: the outermost feel what the endless layer bears outside
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
    parser.add_argument("tables", nargs="*", help="washer, tab, space, held-out; default all")
    parser.add_argument("--per-tactel", type=int, default=2)
    parser.add_argument("--layers", type=int, default=2)
    parser.add_argument("--repeat", type=int, default=5)
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args()
    made: dict[str, Callable[[], list[dict[str, object]]]] = {
        "washer": lambda: washer(options.repeat),
        "tab": tab,
        "space": space,
        "held-out": lambda: held_out(options.per_tactel, options.layers),
    }
    unknown = [name for name in options.tables if name not in made]
    if unknown:
        parser.error(f"no table {', '.join(unknown)}; there are {', '.join(made)}")
    rows = {name: made[name]() for name in (options.tables or made)}
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


def tab() -> list[dict[str, object]]:
    strain = np.array([0.1, 0.2, 0.3, 0.4, 0.5])
    print(f"{'law over elements':<24}{'parts':>6}{'ms':>8}"
          + "".join(f"{f'strain {e:g}':>12}" for e in strain))  # fmt: skip
    found = []
    for height in (1.0, 2.0):
        one = Tab(height_mm=height)
        law = one.young_mpa / 3 * ((1 - strain) ** -2 - (1 - strain)) * np.pi * one.diameter_mm**2
        for parts in (4, 8, 16):
            start = time.process_time()
            truth = compressed(one, strain * height, parts=parts)
            ms = 1e3 * (time.process_time() - start)
            row = {"height": height, "parts": parts, "ms": ms, "law": (law / 4 / truth).tolist()}
            found.append(row)
            print(f"{f'tab of {height:g} mm':<24}{parts:>6}{ms:>8.0f}"
                  + "".join(f"{ratio:>12.3f}" for ratio in row["law"]), flush=True)  # fmt: skip
        small = strain[:3]
        whole = partly_covered(one, 1.0, small * height, parts=COVERED_PARTS)
        for share in (0.25, 0.5, 0.75):
            start = time.process_time()
            part = partly_covered(one, share, small * height, parts=COVERED_PARTS) / whole
            ms = 1e3 * (time.process_time() - start)
            law_share = share * (1 + 0.59 * (1 - share))
            row = {"height": height, "share": share, "ms": ms, "part": part.tolist()}
            found.append(row)
            print(f"{f'covered {share:g}: {law_share:.3f}':<24}{COVERED_PARTS:>6}{ms:>8.0f}"
                  + "".join(f"{value:>12.3f}" for value in part), flush=True)  # fmt: skip
    print()
    return found


def space() -> list[dict[str, object]]:
    ball, force, margin = sphere(20.0), 20.0, 6.0
    reach = PAD.half_mm[0] + margin
    r = np.concatenate([np.linspace(0, 6, 121), 6 + (reach - 6) * np.linspace(0, 1, 40)[1:] ** 2])
    z = PAD.overlay.height_mm * (1 - (1 - np.linspace(0, 1, 13)) ** 1.6)
    pad = section(r, z, PAD.overlay.young_mpa, PAD.overlay.poisson)
    truth = indented(pad, lambda r: ball.heights_mm(np.stack([r, 0 * r], axis=-1)), force)
    tactels = truth.tactels_n(PAD, (0.3, -0.4))
    touch = Touch(-0.3, 0.4, 0.0, force, wrist=WristStiffness(1e9, 1e9))
    print(f"{'ball in space':<14}{'unknowns':>9}{'first s':>9}{'again ms':>9}"
          f"{'tactels':>10}{'depth':>10}")  # fmt: skip
    found = []
    for per_tactel, layers in ((1, 1), (1, 2), (1, 3), (2, 1), (2, 2), (2, 3)):
        mesh = {"per_tactel": per_tactel, "layers": layers, "margin_mm": margin}
        start = time.process_time()
        unknowns = condensed_pad(PAD, **mesh).unknowns
        first = time.process_time()
        pressed = elements(ball, PAD, touch, **mesh)
        again = time.process_time()
        row = {
            **mesh, "unknowns": unknowns,
            "first_s": first - start, "again_ms": 1e3 * (again - first),
            "tactels": rms(pressed.forces_n, tactels), "depth": -pressed.z_mm / truth.depth_mm - 1,
        }  # fmt: skip
        found.append(row)
        print(f"{f'{per_tactel}, {layers} layers':<14}{unknowns:>9}{first - start:>9.2f}"
              f"{1e3 * (again - first):>9.0f}{row['tactels']:>10.1e}{row['depth']:>10.1e}",
              flush=True)  # fmt: skip
    print()
    return found


def annulus(r: np.ndarray) -> np.ndarray:
    slack = 1e-9 * OUTER
    return np.where((r >= INNER - slack) & (r <= OUTER + slack), 0.0, -np.inf)


def held_out(per_tactel: int, layers: int) -> list[dict[str, object]]:
    print(f"{'':<29}{'own error':^20}{'edge':>10}"
          + "".join(f"{f'layer-{c}, {a}':^20}" for c in CELLS for a in ("goes on", "free edge"))
          + f"{'first':>8}{'again':>8}")  # fmt: skip
    print(f"{'indenter':<29}{'tactels':>10}{'depth':>10}{'tactels':>10}"
          + f"{'tactels':>10}{'depth':>10}" * (2 * len(CELLS)) + f"{'s':>8}{'s':>8}")  # fmt: skip
    found = []
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
        found.append(row)
        print(f"{name:<29}" + "".join(
            f"{row[key]:>10.1e}" for key in row if key not in ("indenter", "first_s", "again_s")
        ) + f"{row['first_s']:>8.1f}{row['again_s']:>8.2f}", flush=True)  # fmt: skip
    return found


def rms(found: np.ndarray, truth: np.ndarray) -> float:
    return float(np.sqrt(((found - truth) ** 2).mean() / (truth**2).mean()))


def depth_error(found: Contact, truth: Contact, surface: HeightMap) -> float:
    return (surface.top_mm - found.z_mm) / (surface.top_mm - truth.z_mm) - 1


if __name__ == "__main__":
    main()
