"""Level "tabs": separate elastic tabs under a rigid plate on the wrist. Thesis 3.3, 4.2.

Surface + sensor + touch -> force on each tactel and the plate's pose. Tabs do not interact. The
tip of each samples the surface at a few points (`tips`); the plate comes to rest by `plate`.

A tab is a skin of independent columns over a common column, of the same solid (`neo_hooke`). The
skin takes the share s = 1/(1 + beta) of the height, the column the rest.

- Covered wholly at one height, both bear the same stress: the tab is exactly the neo-Hookean
  column of its whole height.
- Covered in part (share c, a step's edge), the skin works alone there while the column works
  as a whole: F(c)/F(1) = c (1 + beta)/(1 + beta c) at small strain. An edge presses harder
  than its share, as elements show (0.65 at c = 0.5, 0.34 at 0.25), by beta = 0.75 within 0.03,
  and within 0.02 of c [1 + 0.59 (1 - c)].
- Two heights, slopes, and domed ends are presses of different depth on the skin's points.

The law is the least energy over the column's compression: convex and C1 in the plate's pose;
no point pulls, and a tab's force grows with every point's depth. On a step the covered share is a
count of points: the force moves in small steps, finer with more points. Where strokes are so thin
that one or two points of a tip meet them by chance, tips get more points; strokes too thin for the
finest pattern are refused.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import Overlay, SensorType
from probe.contact.contract import Contact, Touch, heights_under, no_contact, refuse_steep
from probe.contact.neo_hooke import Linear, NeoHooke
from probe.contact.plate import Columns, PlatePose, PlateRest, check_load, rest
from probe.contact.tips import Tips, tip_points
from probe.errors import ContactError
from probe.surface.contract import HeightMap

Array = NDArray[np.float64]

SKIN = 0.75  #: beta: stiffness of the column behind the skin: the skin's over the column's
TOLERANCE = 1e-6  #: of the force
FINER = (61, 217, 817)  # points on a tip, for thin strokes
BY_CHANCE = 2  # points of a tip that may meet a stroke by chance
ON_STEP = 0.5  # share of the tabs, at most, that may stand on a step
CORNER_TABS = 4  # fewer tabs are on a corner, which is sharp for any pattern
# Turn of the plate under the whole moment, beyond which springs are checked first.
HOPELESS_RAD = 10.0
MARGIN = 0.1  # of the predicted depth, further down which points are still computed
CRUSHED = 1.4  # power by which partial cover stiffens more at the usual strains
SAMPLED = 8  # every so many points of a tip one predicts the pose


def tabs(surface: HeightMap, sensor: SensorType, touch: Touch, tips: Tips | None = None) -> Contact:
    """Press separate tabs on a surface, with 19 points on each tip by default.

    No force gives an exactly zero image; other forces (rows, columns) sum to the touch's.

    Raises `ContactError` for an overlay that is no tabs, nothing under the sensor, a plate that
    tips or comes to rest at a tilt that is not small, a force that is negative or no number,
    heights that are no numbers, strokes too thin for any pattern.
    """
    overlay = sensor.overlay
    _check_tabs(overlay)
    check_load(touch)
    if touch.force_n == 0:
        return no_contact(sensor, touch, "tabs")
    tips = tips or Tips()
    points, drop = tip_points(sensor, tips)
    heights = heights_under(surface, touch, points) - drop
    stiffness = min(touch.wrist.tilt_x_nmm_rad, touch.wrist.tilt_y_nmm_rad)
    if touch.force_n * sensor.reach_mm > HOPELESS_RAD * stiffness > 0:
        # Linear springs show whether the force would turn the plate over.
        law = Linear(overlay.young_mpa * math.prod(sensor.step_mm) / overlay.height_mm)
        pose = rest(points.reshape(-1, 2), heights.ravel(), law, touch).pose
        refuse_steep(pose.tilt_x_rad, pose.tilt_y_rad, HOPELESS_RAD)
    found, forces = tabs_at_rest(points, heights, overlay, touch)
    pose = found.pose
    refuse_steep(pose.tilt_x_rad, pose.tilt_y_rad)
    if by_chance := _met_by_chance(heights, forces, overlay):
        finer = next((q for q in FINER if q > tips.points), None)
        if finer:
            return tabs(surface, sensor, touch, replace(tips, points=finer))
        if by_chance >= CORNER_TABS:
            raise ContactError(
                f"strokes too thin for {tips.points} points on each tip: {by_chance} tabs met "
                f"them with {BY_CHANCE} at most",
                fix="give wider strokes; printed ones have 0.1 mm or more",
            )
    forces = forces.reshape(sensor.shape)
    return Contact(forces, pose.z_mm, pose.tilt_x_rad, pose.tilt_y_rad, "tabs", found.iterations)


def _met_by_chance(heights_mm: Array, forces_n: Array, overlay: Overlay) -> int:
    """Return how many tabs meet the surface with a point or two that stand out of their tips.

    None, unless they are several, and the most of those that stand on a step. To stand out is to be
    higher than the rest of the tip by more than points are apart, which is steeper than 45 degrees.
    """
    q = heights_mm.shape[1]
    apart = overlay.tab_diameter_mm / 2 * math.sqrt(math.pi / q)
    tips = heights_mm.take(np.flatnonzero(forces_n), axis=0)
    near = np.count_nonzero(tips > tips.max(axis=1, keepdims=True) - apart, axis=1)
    few = int(np.count_nonzero(near <= min(BY_CHANCE, q // 7)))
    return few if few > max(1, ON_STEP * np.count_nonzero(near < q)) else 0


def tabs_at_rest(
    points_mm: Array, heights_mm: Array, overlay: Overlay, touch: Touch
) -> tuple[PlateRest, Array]:
    """Return the plate at rest and the force (n,) of each tab.

    The plate's rest is predicted, and points of (n, q) well below it are not computed. If one of
    them touches after all, it is taken in and the rest is computed again.
    """
    n, q = heights_mm.shape
    skin, column = tip_laws(overlay, q)
    predicted, depth = predicted_pose(points_mm, heights_mm, overlay, touch)
    points, heights = points_mm.reshape(-1, 2), heights_mm.ravel()
    pressed = heights - predicted.heights_mm(points)
    kept = pressed >= min(-MARGIN * depth, float(pressed.max()))
    if min(touch.wrist.tilt_x_nmm_rad, touch.wrist.tilt_y_nmm_rad) == 0:
        kept = heights > -math.inf  # the hull of all points decides whether a free plate stands
    while True:
        some = np.flatnonzero(kept)
        of_tab = some // q
        first = np.empty(len(some), dtype=np.bool_)
        first[0] = True
        np.not_equal(of_tab[1:], of_tab[:-1], out=first[1:])
        starts = np.flatnonzero(first)
        compressed = predicted_columns(pressed[some], starts, q, overlay)
        columns = Columns(column, starts, np.cumsum(first) - 1, compressed)
        found = rest(
            points.take(some, axis=0), heights[some], skin, touch,
            columns=columns, start=predicted, tolerance=TOLERANCE,
        )  # fmt: skip
        missed = (heights > found.pose.heights_mm(points)) & ~kept
        if not missed.any():
            forces = np.zeros(n)
            forces[of_tab[starts]] = np.add.reduceat(found.forces_n, starts)
            return found, forces
        kept |= missed


@lru_cache(maxsize=16)
def tip_laws(overlay: Overlay, points: int) -> tuple[NeoHooke, NeoHooke]:
    """Return the laws of one point of the skin and of the column behind it."""
    area = math.pi * overlay.tab_diameter_mm**2 / 4
    skin_mm = overlay.height_mm / (1 + SKIN)
    column_mm = overlay.height_mm - skin_mm
    return (
        NeoHooke(overlay.young_mpa * area / points / skin_mm, skin_mm),
        NeoHooke(overlay.young_mpa * area / column_mm, column_mm),
    )


def _check_tabs(overlay: Overlay) -> None:
    """Refuse an overlay that is no tabs."""
    if overlay.kind != "tab":
        raise ContactError(
            f"the overlay is a {overlay.kind}; this level knows tabs alone",
            fix='take the level "layer" for a pad',
        )


def predicted_pose(
    points_mm: Array, heights_mm: Array, overlay: Overlay, touch: Touch
) -> tuple[PlatePose, float]:
    """Return a prediction of the plate at rest, and of the depth of the tabs.

    Some points of each tip stand for all, each a neo-Hookean column of its own, stiffened as
    tips are that are covered in part.
    """
    q = heights_mm.shape[1]
    level = heights_mm
    if touch.tilt_x_rad or touch.tilt_y_rad:
        unloaded = PlatePose(0.0, touch.tilt_x_rad, touch.tilt_y_rad)
        level = heights_mm - unloaded.heights_mm(points_mm)
    high = level > level.max() - overlay.height_mm / 4
    share = high.astype(np.float64) @ np.full(q, 1 / q)
    stiffer = float(share @ ((1 + SKIN) / (1 + SKIN * share))) / max(float(share.sum()), 1 / q)
    area = math.pi * overlay.tab_diameter_mm**2 / 4 * stiffer**CRUSHED
    free = min(touch.wrist.tilt_x_nmm_rad, touch.wrist.tilt_y_nmm_rad) == 0
    some = slice(None, None, SAMPLED)
    if free or not heights_mm[:, some].max() > -math.inf:
        some = slice(None)  # a needle, or a hull that matters
    points = points_mm[:, some].reshape(-1, 2)
    heights = heights_mm[:, some].ravel()
    area *= len(heights_mm) / heights.size
    law = NeoHooke(overlay.young_mpa * area / overlay.height_mm, overlay.height_mm)
    z = level.max() - _level_depth(-np.sort(-level[:, some], axis=None), law, touch.force_n)
    start = PlatePose(float(z), touch.tilt_x_rad, touch.tilt_y_rad)
    found = rest(points, heights, law, touch, start=start, tolerance=0.02)
    return found.pose, max(float((heights - found.pose.heights_mm(points)).max()), 0.0)


def _level_depth(heights: Array, law: NeoHooke, force_n: float) -> float:
    """Return the approximate depth of a level plate on columns of falling heights (n,).

    The first k are taken at their mean; the next would bear too much.
    """
    length = law.length_mm
    many = np.arange(1, heights.size + 1)
    below = np.minimum(heights[0] - heights, 1e3 * length)
    mean = np.cumsum(below) / many
    stretch = np.maximum(1 - (below - mean) / length, 1e-6)
    stress = 3 * force_n / (float(law.stiffness) * length)
    k = max(int(np.searchsorted(many * (1 / (stretch * stretch) - stretch), stress)) - 1, 0)
    return float(mean[k]) + length * (1 - _stretch(stress / float(many[k])))


def _stretch(stress: float) -> float:
    """Return lambda with lambda^-2 - lambda = stress >= 0, by Newton from above."""
    stretch = min(1.0, 1 / math.sqrt(stress)) if stress > 0 else 1.0
    for _ in range(60):
        step = ((stretch + stress) * stretch**2 - 1) / ((3 * stretch + 2 * stress) * stretch)
        stretch -= step
        if abs(step) <= 1e-12 * stretch:
            break
    return stretch


def predicted_columns(
    pressed: Array, starts: NDArray[np.intp], points: int, overlay: Overlay
) -> Array:
    """Return the approximate compression of the columns behind skins pressed to a depth.

    Exact for tips covered at one height in the limits of small and of large strain.
    """
    skin, column = 1 / (1 + SKIN), SKIN / (1 + SKIN)
    share = np.add.reduceat((pressed > 0).astype(np.float64), starts) / points
    mean = np.add.reduceat(np.maximum(pressed, 0.0), starts) / points
    small = column * mean / (skin + column * share)
    root = np.sqrt(share)
    depth = mean / np.maximum(share, 1 / points)
    large = (depth - skin * overlay.height_mm * (1 - root)) / (1 + root * (skin / column))
    return np.maximum(small, large)
