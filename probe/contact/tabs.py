"""Level "tabs": separate elastic tabs under a rigid plate on the wrist. Thesis 3.3, 4.2.

Surface + sensor + touch -> force on each tactel and the plate's pose. Tabs do not know of
each other. The tip of each asks the surface at a few points (`tips`) and presses as one
neo-Hookean column; the plate comes to rest by `plate`.

The law of a tip is `tab_law`'s. Where the surface is a step, the share that it covers is a
count of points: in x and y the force moves in small steps, finer with more points. Forces act
at the points, so a tab that is pressed on one side turns the plate. Where strokes are so thin that
one or two points of a tip meet them by chance, the tips are asked more finely; strokes too thin
for the finest pattern are refused.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import Overlay, SensorType
from probe.contact.contract import Contact, Touch
from probe.contact.heights import heights_at, nothing_under
from probe.contact.neo_hooke import Linear
from probe.contact.plate import PlateLoad, PlatePose, PlateRest, checked_load, load_of, rest
from probe.contact.plate_newton import Columns
from probe.contact.settings import CONTACT, TABS
from probe.contact.tab_law import checked_tabs, tip_laws
from probe.contact.tabs_foreseen import columns_foreseen, foreseen_pose
from probe.contact.tips import Tips, tip_points
from probe.errors import ContactError
from probe.surface.contract import HeightMap

Array = NDArray[np.float64]


def tabs(surface: HeightMap, sensor: SensorType, touch: Touch, tips: Tips | None = None) -> Contact:
    """Press separate tabs on a surface.

    Parameters
    ----------
    surface
        Heights in the surface frame.
    sensor
        Its overlay must be of tabs.
    touch
        Pose, force and wrist. No force gives an exactly zero image.
    tips
        How finely the tips are asked, their dome and defects; 19 points each without it.

    Returns
    -------
    Contact
        Forces (rows, columns) in N, which sum to the touch's force.

    Raises
    ------
    ContactError
        For an overlay that is no tabs, nothing under the sensor, a plate that tips or comes to
        rest at a tilt that is not small, a force that is negative or no number, heights that
        are no numbers, strokes too thin for any pattern.
    """
    overlay = sensor.overlay
    checked_tabs(overlay)
    shape = (sensor.rows, sensor.columns)
    load = load_of(touch)
    checked_load(load)
    if touch.force_n == 0:
        return Contact(
            np.zeros(shape), math.inf, touch.tilt_x_rad, touch.tilt_y_rad, "tabs", iterations=0
        )
    tips = tips or _PLAIN
    points, drop = tip_points(sensor, tips)
    heights = heights_under(surface, touch, points) - drop
    stiffness = min(touch.wrist.tilt_x_nmm_rad, touch.wrist.tilt_y_nmm_rad)
    if touch.force_n * sensor.reach_mm > TABS.hopeless_rad * stiffness > 0:
        # Springs tell for any force whether it would turn the plate over.
        law = Linear(overlay.young_mpa * math.prod(sensor.step_mm) / overlay.height_mm)
        _require_stable(
            rest(points.reshape(-1, 2), heights.ravel(), law, load).pose, TABS.hopeless_rad
        )
    found, forces = tabs_at_rest(points, heights, overlay, load)
    _require_stable(found.pose, CONTACT.steepest_rad)
    if by_chance := _met_by_chance(heights, forces, overlay):
        finer = next((q for q in TABS.finer if q > tips.points), None)
        if finer:
            return tabs(surface, sensor, touch, replace(tips, points=finer))
        if by_chance >= TABS.corner_tabs:
            raise ContactError(
                f"strokes too thin for {tips.points} points on each tip: {by_chance} tabs met "
                f"them with {TABS.by_chance} at most",
                fix="give wider strokes; printed ones have 0.1 mm or more",
            )
    return Contact(
        forces.reshape(shape),
        found.pose.z_mm,
        found.pose.tilt_x_rad,
        found.pose.tilt_y_rad,
        "tabs",
        found.iterations,
    )


def _require_stable(pose: PlatePose, steepest_rad: float) -> None:
    tilt = max(abs(pose.tilt_x_rad), abs(pose.tilt_y_rad))
    if tilt > steepest_rad:
        raise ContactError(
            f"the plate tips: it comes to rest at a tilt of {math.degrees(tilt):.3g} degrees, "
            f"beyond {math.degrees(CONTACT.steepest_rad):.3g}",
            fix="move the sensor, press with less force, or take a stiffer wrist",
        )


def _met_by_chance(heights_mm: Array, forces_n: Array, overlay: Overlay) -> int:
    """Return how many tabs meet the surface with a point or two that stand out of their tips.

    None, unless they are several, and the most of those that stand on a step. To stand out is to
    be higher than the rest of the tip by more than points are apart: what is less steep than 45
    degrees does not.
    """
    q = heights_mm.shape[1]
    apart = overlay.tab_diameter_mm / 2 * math.sqrt(math.pi / q)
    tips = heights_mm.take(np.flatnonzero(forces_n), axis=0)
    near = np.count_nonzero(tips > tips.max(axis=1, keepdims=True) - apart, axis=1)
    few = int(np.count_nonzero(near <= min(TABS.by_chance, q // 7)))
    return few if few > max(1, TABS.on_step * np.count_nonzero(near < q)) else 0


def heights_under(surface: HeightMap, touch: Touch, points_mm: Array) -> Array:
    """Return the heights under points (..., 2) of the sensor.

    Refused where they are no numbers, or nothing at all lies under the points.
    """
    heights = heights_at(surface, touch, points_mm)
    if heights.max(initial=-math.inf) == -math.inf:
        raise nothing_under(touch)
    return heights


def tabs_at_rest(
    points_mm: Array, heights_mm: Array, overlay: Overlay, load: PlateLoad
) -> tuple[PlateRest, Array]:
    """Return the plate at rest and the force (n,) of each tab; what hangs free is left out.

    The plate's rest is foreseen, and points of (n, q) that lie well below it are not computed.
    Should one of them touch after all, it is taken in and the plate comes to rest anew.
    """
    n, q = heights_mm.shape
    skin, column = tip_laws(overlay, q)
    foreseen, depth = foreseen_pose(points_mm, heights_mm, overlay, load)
    points, heights = points_mm.reshape(-1, 2), heights_mm.ravel()
    pressed = heights - foreseen.heights_mm(points)
    kept = pressed >= min(-TABS.margin * depth, float(pressed.max()))
    if min(load.wrist.tilt_x_nmm_rad, load.wrist.tilt_y_nmm_rad) == 0:
        kept = heights > -math.inf  # whether a free plate stands is for all of them to tell
    while True:
        some = np.flatnonzero(kept)
        of_tab = some // q
        first = np.empty(len(some), dtype=np.bool_)
        first[0] = True
        np.not_equal(of_tab[1:], of_tab[:-1], out=first[1:])
        starts = np.flatnonzero(first)
        compressed = columns_foreseen(pressed[some], starts, q, overlay)
        columns = Columns(column, starts, np.cumsum(first) - 1, compressed)
        found = rest(
            points.take(some, axis=0), heights[some], skin, load,
            columns=columns, foreseen=foreseen, tolerance=TABS.tolerance,
        )  # fmt: skip
        missed = (heights > found.pose.heights_mm(points)) & ~kept
        if not missed.any():
            forces = np.zeros(n)
            forces[of_tab[starts]] = np.add.reduceat(found.forces_n, starts)
            return found, forces
        kept |= missed


_PLAIN = Tips()
