"""Sizes -> the solids of a probe's parts, as they lie on the printer's bed, by build123d. mm.

Each part is boxes, cylinders and cones, joined and cut, so that its volume can be worked out by
hand. Lower edge of the sensor at -y: there the film's tail leaves. z up; a part stands on z = 0.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from probe.kit.sizes import KitSizes

Shape = Any  # a solid of build123d


def mould_base(k: KitSizes) -> Shape:
    """Return what closes the tips' ends: flat, a vent beside every line of tips."""
    s = k.settings
    plate = _box(*k.mould_mm, s.plate_mm)
    cut = [*_mould_holes(k, s.plate_mm)]
    if k.tip_mm:
        xs = np.unique(k.sensor.centres_mm()[..., 0].round(9))
        lines = [*((xs[:-1] + xs[1:]) / 2)]
        size = k.vent_mm, k.mould_mm[1], s.vent_mm[1]
        cut += [_box(*size, at=(x, 0.0, s.plate_mm - s.vent_mm[1])) for x in lines]
    return _cut(plate, cut)


def mould_plate(k: KitSizes) -> Shape:
    """Return what shapes the tabs: a pocket for the skin, its floor pierced for every tab.

    A pad's pocket has a floor without holes.
    """
    s = k.settings
    floor = k.sensor.overlay.height_mm if k.tip_mm else s.plate_mm
    deep = s.pocket_mm if k.tip_mm else k.sensor.overlay.height_mm + s.pocket_mm - s.web_mm
    high = floor + deep
    plate = _box(*k.mould_mm, high)
    cut = [_box(*k.skin_mm, deep, at=(0.0, 0.0, floor)), *_mould_holes(k, high)]
    if k.tip_mm:
        cone = _cone(k.tip_mm, k.foot_mm, floor)
        places = k.sensor.centres_mm()[k.sensor.present()]
        cut += [_at(cone, (float(x), float(y), 0.0)) for x, y in places]
    posts = [_rod(s.pin_mm, deep, at=(x, y, floor)) for x, y in k.posts_mm]
    return _join(_cut(plate, cut), posts)


def mould_lid(k: KitSizes) -> Shape:
    """Return what presses the skin to its thickness: a boss, open for posts, vents and silicone."""
    s = k.settings
    boss = s.pocket_mm - s.web_mm
    inner = (k.skin_mm[0] - 2 * s.clearance_mm, k.skin_mm[1] - 2 * s.clearance_mm)
    lid = _join(_box(*k.mould_mm, s.plate_mm), [_box(*inner, boss, at=(0.0, 0.0, s.plate_mm))])
    high = s.plate_mm + boss
    posts = s.pin_mm + 2 * s.clearance_mm
    cut = [_rod(posts, high, at=(x, y, 0.0)) for x, y in k.posts_mm]
    cut += [_rod(s.riser_mm, high, at=(x, y, 0.0)) for x, y in riser_places(k)]
    return _cut(lid, [*cut, *_mould_holes(k, s.plate_mm)])


def riser_places(k: KitSizes) -> tuple[tuple[float, float], ...]:
    """Return where silicone rises: in the skin's rim, midway between the posts."""
    (x, y), *_ = k.posts_mm
    return ((x, 0.0), (-x, 0.0), (0.0, y), (0.0, -y))


def housing_body(k: KitSizes) -> Shape:
    """Return what bears the film: a platform with a bed for it, posts, a way for the tail.

    The tail bends down beside the platform and lies on a tongue, where a cable tie holds it.
    """
    s = k.settings
    top = s.shoulder_mm + s.platform_mm
    up = k.thickness_skin_mm + k.lip_mm / 2
    posts = [_rod(s.pin_mm - 2 * s.clearance_mm, up, at=(x, y, top)) for x, y in k.posts_mm]
    block = _box(*k.side_mm, s.shoulder_mm)
    platform = _box(*k.skin_mm, s.platform_mm, at=(0.0, 0.0, s.shoulder_mm))
    tongue = _box(s.tail_mm + 8 * s.tie_mm[1], s.tongue_mm, s.shoulder_mm,
                  at=(0.0, -(k.side_mm[1] + s.tongue_mm) / 2, 0.0))  # fmt: skip
    body = _join(block, [_rounded(platform, k), tongue, *posts])
    bed = _box(*k.film_mm, s.film_mm, at=(0.0, 0.0, top - s.film_mm))
    reach = (k.skin_mm[1] - k.film_mm[1]) / 2
    leaves = _box(s.tail_mm, reach, s.film_mm,
                  at=(0.0, -(k.film_mm[1] + reach) / 2, top - s.film_mm))  # fmt: skip
    ties = [
        _box(s.tie_mm[1], s.tie_mm[0], s.shoulder_mm,
             at=(side * (s.tail_mm / 2 + 1.5 * s.tie_mm[1]),
                 -(k.side_mm[1] + s.tongue_mm) / 2, 0.0))
        for side in (-1, 1)
    ]  # fmt: skip
    return _cut(body, [bed, leaves, *ties, *_screws(k, top)])


def housing_frame(k: KitSizes) -> Shape:
    """Return what holds skin and film down, lower than the tips; it lies on its outer face."""
    s = k.settings
    inner = k.settings.platform_mm + k.thickness_skin_mm
    high = inner + k.lip_mm
    frame = _box(*k.side_mm, high)
    room = (k.skin_mm[0] + 2 * s.clearance_mm, k.skin_mm[1] + 2 * s.clearance_mm)
    half = k.sensor.half_mm
    opening = 2 * (half[0] + s.opening_mm), 2 * (half[1] + s.opening_mm)
    wall = (k.side_mm[1] - room[1]) / 2
    tail = _box(s.tail_mm + 1.0, wall, s.film_mm + 1.0,
                at=(0.0, -(room[1] + wall) / 2, high - s.film_mm - 1.0))  # fmt: skip
    posts = [_rod(s.pin_mm, k.lip_mm, at=(x, y, 0.0)) for x, y in k.posts_mm]
    heads = [_rod(*s.head_mm, at=(x, y, 0.0)) for x, y in screw_places(k)]
    cut = [_box(*room, inner, at=(0.0, 0.0, k.lip_mm)), _box(*opening, k.lip_mm), tail, *posts]
    return _cut(frame, [*cut, *heads, *_screws(k, high)])


def flange_adapter(k: KitSizes) -> Shape:
    """Return the plate between the robot's flange (ISO 9409-1-50-4-M6) and the housing."""
    s = k.settings
    plate = _box(*k.side_mm, s.adapter_mm)
    reach = s.flange_circle_mm / 2 / np.sqrt(2)
    bolts = [(float(a * reach), float(b * reach)) for a in (-1, 1) for b in (-1, 1)]
    deep = s.flange_head_mm[1]
    cut = [_rod(s.flange_screw_mm, s.adapter_mm, at=(x, y, 0.0)) for x, y in bolts]
    cut += [_rod(s.flange_head_mm[0], deep, at=(x, y, s.adapter_mm - deep)) for x, y in bolts]
    return _cut(plate, [*cut, _rod(*s.flange_spigot_mm), *_screws(k, s.adapter_mm)])


def calibration_cap(k: KitSizes) -> Shape:
    """Return what loads all tabs evenly: foot, skirt over the frame, a ring to centre weights.

    It lies on its pan, the foot up.
    """
    s = k.settings
    room = k.side_mm[0] + 4 * s.clearance_mm, k.side_mm[1] + 4 * s.clearance_mm
    outer = room[0] + 2 * s.skirt_mm, room[1] + 2 * s.skirt_mm
    pan = s.pan_mm
    foot = s.guided_mm + s.foam_mm
    skirt = foot + s.free_mm + s.guided_mm
    least = pan + 2 * s.ring_mm[0]
    wide = max(outer[0], least), max(outer[1], least)
    plate = _box(*wide, s.plate_mm)
    ring = _cut(_rod(pan, s.ring_mm[1]), [_rod(pan - 2 * s.ring_mm[0], s.ring_mm[1])])
    sleeve = _cut(_box(*outer, skirt, at=(0.0, 0.0, s.plate_mm)),
                  [_box(*room, skirt, at=(0.0, 0.0, s.plate_mm))])  # fmt: skip
    half = k.sensor.half_mm
    stamp = _box(2 * half[0], 2 * half[1], foot, at=(0.0, 0.0, s.plate_mm))
    return _join(_cut(plate, [ring]), [sleeve, stamp])


def screw_places(k: KitSizes) -> tuple[tuple[float, float], ...]:
    """Return the housing's screws."""
    x, y = (side / 2 - k.settings.corner_mm for side in k.side_mm)
    return ((x, y), (-x, y), (-x, -y), (x, -y))


#: Parts that are printed: name, what it is, what makes it, whether it needs resin.
PARTS: dict[str, tuple[str, Callable[[KitSizes], Shape], bool]] = {
    "mould-base": ("closes the ends of the tips; vents", mould_base, True),
    "mould-plate": ("shapes skin and tabs; posts make the holes that register", mould_plate, True),
    "mould-lid": ("presses the skin to its thickness", mould_lid, False),
    "housing-body": ("bears film and overlay", housing_body, False),
    "housing-frame": ("holds them down, lower than the tips", housing_frame, False),
    "flange-adapter": (
        "between housing and a flange ISO 9409-1-50-4-M6",
        flange_adapter,
        False,
    ),
    "calibration-cap": ("loads all tabs evenly by known weights", calibration_cap, False),
}


def _mould_holes(k: KitSizes, high: float) -> list[Shape]:
    """Return two dowels and four screws through the mould."""
    s = k.settings
    x, y = (side / 2 - s.around_mm / 2 for side in k.mould_mm)
    dowels = [_rod(s.pin_mm + s.clearance_mm, high, at=(side * x, 0.0, 0.0)) for side in (-1, 1)]
    corners = [(a * x, b * y) for a in (-1, 1) for b in (-1, 1)]
    return [*dowels, *(_rod(s.screw_mm, high, at=(a, b, 0.0)) for a, b in corners)]


def _screws(k: KitSizes, high: float) -> list[Shape]:
    return [_rod(k.settings.screw_mm, high, at=(x, y, 0.0)) for x, y in screw_places(k)]


def _rounded(platform: Shape, k: KitSizes) -> Shape:
    """Return the platform with its upper lower-side edge rounded, where the tail bends down."""
    from build123d import Axis, fillet

    edge = platform.faces().sort_by(Axis.Y)[0].edges().sort_by(Axis.Z)[-1]
    return fillet(edge, k.settings.bend_mm)


def _box(x: float, y: float, z: float, at: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Shape:
    """Return a box whose lower face has its middle at a point."""
    from build123d import Align, Box

    return _at(Box(x, y, z, align=(Align.CENTER, Align.CENTER, Align.MIN)), at)


def _rod(diameter: float, high: float, at: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Shape:
    from build123d import Align, Cylinder

    return _at(Cylinder(diameter / 2, high, align=(Align.CENTER, Align.CENTER, Align.MIN)), at)


def _cone(lower: float, upper: float, high: float) -> Shape:
    from build123d import Align, Cone, Cylinder

    align = (Align.CENTER, Align.CENTER, Align.MIN)
    if abs(lower - upper) < 1e-9:
        return Cylinder(lower / 2, high, align=align)
    return Cone(lower / 2, upper / 2, high, align=align)


def _at(shape: Shape, at: tuple[float, float, float]) -> Shape:
    from build123d import Pos

    return Pos(*at) * shape


def _cut(shape: Shape, tools: Iterable[Shape]) -> Shape:
    return shape.cut(*tools)


def _join(shape: Shape, tools: Iterable[Shape]) -> Shape:
    return shape.fuse(*tools)
