"""The solids of a probe's parts, as they lie on the bed, by build123d; STEP and triangles.

Sizes -> solids, mm. Each part is boxes, cylinders and cones, joined and cut, so that its volume can
be worked out by hand. Lower edge of the sensor at -y: there the film's tail leaves. z up; a part
stands on z = 0. STEP text and triangles are the same on every run: the kernel's count of products
and the time in its header are taken out. Triangles share their vertices by number.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from generator.errors import SolidError
from generator.export.check import read_step, read_stl
from generator.solid import Mesh
from probe.kit import sizes as s
from probe.kit.sizes import KitSizes

CHORD_MM = 0.03  # of the mesh against true circles
CHORD_RAD = 0.45  # and against their turn


Shape = Any  # a solid of build123d
Point = tuple[float, float, float]
ORIGIN = (0.0, 0.0, 0.0)


def mould_base(k: KitSizes) -> Shape:
    """Return the plate that closes the tips' ends: flat, a vent along every line of tips."""
    plate = _box(*k.mould_mm, s.PLATE_MM)
    cut = _mould_holes(k, s.PLATE_MM)
    if k.tip_mm:
        xs = np.unique(k.sensor.centres_mm()[..., 0].round(9))
        size = k.vent_mm, k.mould_mm[1], s.VENT_MM[1]
        lines = (xs[:-1] + xs[1:]) / 2
        cut += [_box(*size, at=(x, 0.0, s.PLATE_MM - s.VENT_MM[1])) for x in lines]
    return plate.cut(*cut)


def mould_plate(k: KitSizes) -> Shape:
    """Return the plate that shapes the tabs: a pocket for the skin, pierced for every tab.

    A pad's pocket has a floor without holes.
    """
    from build123d import Pos

    floor = k.sensor.overlay.height_mm if k.tip_mm else s.PLATE_MM
    deep = s.POCKET_MM if k.tip_mm else k.sensor.overlay.height_mm + s.POCKET_MM - s.WEB_MM
    high = floor + deep
    plate = _box(*k.mould_mm, high)
    cut = [_box(*k.skin_mm, deep, at=(0.0, 0.0, floor)), *_mould_holes(k, high)]
    if k.tip_mm:
        cone = _cone(k.tip_mm, k.foot_mm, floor)
        places = k.sensor.centres_mm()[k.sensor.present()]
        cut += [Pos(float(x), float(y), 0.0) * cone for x, y in places]
    posts = [_rod(s.PIN_MM, deep, at=(x, y, floor)) for x, y in k.posts_mm]
    return plate.cut(*cut).fuse(*posts)


def mould_lid(k: KitSizes) -> Shape:
    """Return the lid that presses the skin to its thickness: a boss with holes."""
    boss = s.POCKET_MM - s.WEB_MM
    inner = (k.skin_mm[0] - 2 * s.CLEARANCE_MM, k.skin_mm[1] - 2 * s.CLEARANCE_MM)
    lid = _box(*k.mould_mm, s.PLATE_MM).fuse(_box(*inner, boss, at=(0.0, 0.0, s.PLATE_MM)))
    high = s.PLATE_MM + boss
    posts = s.PIN_MM + 2 * s.CLEARANCE_MM
    cut = [_rod(posts, high, at=(x, y, 0.0)) for x, y in k.posts_mm]
    (x, y), *_ = k.posts_mm
    risers = ((x, 0.0), (-x, 0.0), (0.0, y), (0.0, -y))  # in the skin's rim, between the posts
    cut += [_rod(s.RISER_MM, high, at=(x, y, 0.0)) for x, y in risers]
    return lid.cut(*cut, *_mould_holes(k, s.PLATE_MM))


def housing_body(k: KitSizes) -> Shape:
    """Return the body that bears the film: a platform with a bed for it, posts, a way for the tail.

    The tail bends down along the platform and lies on a tongue, where a cable tie holds it.
    """
    top = s.SHOULDER_MM + s.PLATFORM_MM
    up = k.thickness_skin_mm + k.lip_mm / 2
    posts = [_rod(s.PIN_MM - 2 * s.CLEARANCE_MM, up, at=(x, y, top)) for x, y in k.posts_mm]
    block = _box(*k.side_mm, s.SHOULDER_MM)
    platform = _box(*k.skin_mm, s.PLATFORM_MM, at=(0.0, 0.0, s.SHOULDER_MM))
    tongue = _box(s.TAIL_MM + 8 * s.TIE_MM[1], s.TONGUE_MM, s.SHOULDER_MM,
                  at=(0.0, -(k.side_mm[1] + s.TONGUE_MM) / 2, 0.0))  # fmt: skip
    body = block.fuse(_rounded(platform), tongue, *posts)
    bed = _box(*k.film_mm, s.FILM_MM, at=(0.0, 0.0, top - s.FILM_MM))
    reach = (k.skin_mm[1] - k.film_mm[1]) / 2
    leaves = _box(s.TAIL_MM, reach, s.FILM_MM,
                  at=(0.0, -(k.film_mm[1] + reach) / 2, top - s.FILM_MM))  # fmt: skip
    ties = [
        _box(s.TIE_MM[1], s.TIE_MM[0], s.SHOULDER_MM,
             at=(side * (s.TAIL_MM / 2 + 1.5 * s.TIE_MM[1]),
                 -(k.side_mm[1] + s.TONGUE_MM) / 2, 0.0))
        for side in (-1, 1)
    ]  # fmt: skip
    return body.cut(bed, leaves, *ties, *_screws(k, top))


def housing_frame(k: KitSizes) -> Shape:
    """Return the frame that holds skin and film down, lower than the tips; it lies face down."""
    inner = s.PLATFORM_MM + k.thickness_skin_mm
    high = inner + k.lip_mm
    frame = _box(*k.side_mm, high)
    room = (k.skin_mm[0] + 2 * s.CLEARANCE_MM, k.skin_mm[1] + 2 * s.CLEARANCE_MM)
    half = k.sensor.half_mm
    opening = 2 * (half[0] + s.OPENING_MM), 2 * (half[1] + s.OPENING_MM)
    wall = (k.side_mm[1] - room[1]) / 2
    tail = _box(s.TAIL_MM + 1.0, wall, s.FILM_MM + 1.0,
                at=(0.0, -(room[1] + wall) / 2, high - s.FILM_MM - 1.0))  # fmt: skip
    posts = [_rod(s.PIN_MM, k.lip_mm, at=(x, y, 0.0)) for x, y in k.posts_mm]
    heads = [_rod(*s.HEAD_MM, at=(x, y, 0.0)) for x, y in k.screws_mm]
    cut = [_box(*room, inner, at=(0.0, 0.0, k.lip_mm)), _box(*opening, k.lip_mm), tail, *posts]
    return frame.cut(*cut, *heads, *_screws(k, high))


def flange_adapter(k: KitSizes) -> Shape:
    """Return the plate between the robot's flange (ISO 9409-1-50-4-M6) and the housing."""
    plate = _box(*k.side_mm, s.ADAPTER_MM)
    reach = s.FLANGE_CIRCLE_MM / 2 / np.sqrt(2)
    bolts = [(float(a * reach), float(b * reach)) for a in (-1, 1) for b in (-1, 1)]
    deep = s.FLANGE_HEAD_MM[1]
    cut = [_rod(s.FLANGE_SCREW_MM, s.ADAPTER_MM, at=(x, y, 0.0)) for x, y in bolts]
    cut += [_rod(s.FLANGE_HEAD_MM[0], deep, at=(x, y, s.ADAPTER_MM - deep)) for x, y in bolts]
    return plate.cut(*cut, _rod(*s.FLANGE_SPIGOT_MM), *_screws(k, s.ADAPTER_MM))


def calibration_cap(k: KitSizes) -> Shape:
    """Return the cap that loads all tabs evenly: foot, skirt over the frame, ring for weights.

    It lies on its pan, the foot up.
    """
    room = k.side_mm[0] + 4 * s.CLEARANCE_MM, k.side_mm[1] + 4 * s.CLEARANCE_MM
    outer = room[0] + 2 * s.SKIRT_MM, room[1] + 2 * s.SKIRT_MM
    pan = s.PAN_MM
    foot = s.GUIDED_MM + s.FOAM_MM
    skirt = foot + s.FREE_MM + s.GUIDED_MM
    least = pan + 2 * s.RING_MM[0]
    wide = max(outer[0], least), max(outer[1], least)
    plate = _box(*wide, s.PLATE_MM)
    ring = _rod(pan, s.RING_MM[1]).cut(_rod(pan - 2 * s.RING_MM[0], s.RING_MM[1]))
    above = (0.0, 0.0, s.PLATE_MM)
    sleeve = _box(*outer, skirt, at=above).cut(_box(*room, skirt, at=above))
    half = k.sensor.half_mm
    stamp = _box(2 * half[0], 2 * half[1], foot, at=above)
    return plate.cut(ring).fuse(sleeve, stamp)


#: Parts that are printed: name, what it is, what makes it, whether it needs resin.
PARTS: dict[str, tuple[str, Callable[[KitSizes], Shape], bool]] = {
    "mould-base": ("closes the ends of the tips; vents", mould_base, True),
    "mould-plate": ("shapes skin and tabs; posts make the holes that register", mould_plate, True),
    "mould-lid": ("presses the skin to its thickness", mould_lid, False),
    "housing-body": ("bears film and overlay", housing_body, False),
    "housing-frame": ("holds them down, lower than the tips", housing_frame, False),
    "flange-adapter": ("between housing and a flange ISO 9409-1-50-4-M6", flange_adapter, False),
    "calibration-cap": ("loads all tabs evenly by known weights", calibration_cap, False),
}


def _mould_holes(k: KitSizes, high: float) -> list[Shape]:
    """Return two dowels and four screws through the mould."""
    x, y = (side / 2 - s.AROUND_MM / 2 for side in k.mould_mm)
    dowels = [_rod(s.PIN_MM + s.CLEARANCE_MM, high, at=(side * x, 0.0, 0.0)) for side in (-1, 1)]
    corners = [(a * x, b * y) for a in (-1, 1) for b in (-1, 1)]
    return [*dowels, *(_rod(s.SCREW_MM, high, at=(a, b, 0.0)) for a, b in corners)]


def _screws(k: KitSizes, high: float) -> list[Shape]:
    return [_rod(s.SCREW_MM, high, at=(x, y, 0.0)) for x, y in k.screws_mm]


def _rounded(platform: Shape) -> Shape:
    """Return the platform with its upper lower-side edge rounded, where the tail bends down."""
    from build123d import Axis, fillet

    edge = platform.faces().sort_by(Axis.Y)[0].edges().sort_by(Axis.Z)[-1]
    return fillet(edge, s.BEND_MM)


def _box(x: float, y: float, z: float, at: Point = ORIGIN) -> Shape:
    return _standing("Box", x, y, z, at=at)


def _rod(diameter: float, high: float, at: Point = ORIGIN) -> Shape:
    return _standing("Cylinder", diameter / 2, high, at=at)


def _cone(lower: float, upper: float, high: float) -> Shape:
    if abs(lower - upper) < 1e-9:
        return _rod(lower, high)
    return _standing("Cone", lower / 2, upper / 2, high)


def _standing(kind: str, *sizes: float, at: Point = ORIGIN) -> Shape:
    """Return a solid of build123d whose lower face has its middle at a point."""
    import build123d

    align = build123d.Align
    shape = getattr(build123d, kind)(*sizes, align=(align.CENTER, align.CENTER, align.MIN))
    return build123d.Pos(*at) * shape


_TIME = datetime(2000, 1, 1)
_COUNTED = re.compile(rb"Open CASCADE STEP translator [0-9.]+ [0-9]+")
_WELD_MM = 1e-6  #: corners of neighbouring faces differ by less
STEP_VOLUME, MESH_VOLUME = 1e-6, 5e-3  #: relative errors: as text; of chords


def step_text(solid: Any, name: str) -> bytes:
    """Return a solid as STEP (mm), the same bytes for the same solid."""
    from build123d import export_step

    solid.label = name
    out = io.BytesIO()
    export_step(solid, out, timestamp=_TIME)
    return _COUNTED.sub(b"Open CASCADE STEP translator", out.getvalue())


def mesh_of(solid: Any) -> Mesh:
    """Return the triangles of a solid; raises `SolidError` if the kernel leaves a gap."""
    points, faces = solid.tessellate(CHORD_MM, CHORD_RAD)
    corners = np.array([(p.X, p.Y, p.Z) for p in points])
    grid, numbers = np.unique(np.rint(corners / _WELD_MM), axis=0, return_inverse=True)
    triangles = numbers.reshape(-1)[np.array(faces, np.int64)]
    distinct = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    triangles = triangles[distinct]
    edges = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    there = set(map(tuple, edges.tolist()))
    if len(there) != len(edges) or any((b, a) not in there for a, b in there):
        raise SolidError("the kernel's triangles do not close", fix="report the sensor type")
    none = np.zeros(len(triangles), np.int64)
    return Mesh(grid * _WELD_MM, triangles, none, none - 1, none - 1)


def check_part(name: str, solid: Any, step: Path, stl: Path) -> None:
    """Read the files of a part back by other programs.

    Raises `SolidError` if they hold something else than one closed solid of its volume;
    `MissingExtraError` if the CAD kernel or the mesh library is not installed.
    """
    volume = float(solid.volume)
    found, mesh = read_step(step), read_stl(stl)
    faults = {
        f"{found.solids} solids in STEP": found.solids != 1,
        "a solid that the CAD kernel finds invalid": not found.valid,
        f"{found.volume_mm3:.3f} mm3 in STEP": abs(found.volume_mm3 / volume - 1) > STEP_VOLUME,
        f"{mesh.volume_mm3:.3f} mm3 in STL": not abs(mesh.volume_mm3 / volume - 1) < MESH_VOLUME,
        f"{mesh.boundary_edges} open edges": mesh.boundary_edges > 0,
        f"{mesh.non_manifold_edges} edges of more than two triangles": mesh.non_manifold_edges > 0,
        f"{mesh.non_manifold_vertices} vertices where it touches itself": (
            mesh.non_manifold_vertices > 0
        ),
        f"{mesh.self_intersections} triangles that cut others": mesh.self_intersections > 0,
    }
    if wrong := [text for text, bad in faults.items() if bad]:
        raise SolidError(
            f"part '{name}' of {volume:.3f} mm3 has {', '.join(wrong)}",
            fix="do not print it; report the sensor type together with this message",
            place=step,
        )
