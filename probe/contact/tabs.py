"""Level "tabs": separate elastic tabs under a rigid plate on the wrist. Thesis 3.3, 4.2.

Surface + sensor + touch -> force on each tactel and the plate's pose. Tabs do not know of
each other. Each is a neo-Hookean column (`neo_hooke`); its tip asks the surface at a few
points (`tips`), and the plate comes to rest by `plate`.

One law serves every tip, however the surface lies under it: a skin of independent columns
over a common column. The skin takes the share s = 1/(1 + beta) of the height, the column the
rest, both of the same solid.

- Fully covered at one height, both bear the same stress, so the tab is exactly the
  neo-Hookean column of its whole height.
- Covered in part (share c, a step's edge), the skin works alone there while the column works
  as a whole: F(c)/F(1) = c (1 + beta)/(1 + beta c) at small strain. An edge presses harder
  than its share, as elements show (0.65 at c = 0.5, 0.34 at 0.25), by beta = 0.75 within 0.03,
  and within 0.02 of c [1 + 0.59 (1 - c)].
- Two heights, slopes, and domed ends are presses of different depth on the skin's points.

The law is the least energy over the column's compression: convex and C1 in the plate's pose,
no point pulls, and a tab's force grows with every point's depth. Where the surface is a step,
the share is a count of points: in x and y the force moves in small steps, finer with more.
Forces act at the points, so a tab that is pressed on one side turns the plate.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from probe.contact.contract import Contact, Touch
from probe.contact.neo_hooke import NeoHooke
from probe.contact.plate import Columns, Load, Pose, Rest, load_of, rest
from probe.contact.tips import Tips, tip_points
from probe.errors import ContactError
from probe.sensor import Overlay, Sensor
from probe.surface.contract import Surface

Array = NDArray[np.float64]

BETA = 0.75  #: stiffness of the column behind the skin: the skin's over the column's
TOLERANCE = 1e-6  #: of the force
STEEPEST_RAD = 0.35  #: tilts beyond are not small


def tabs(surface: Surface, sensor: Sensor, touch: Touch, tips: Tips | None = None) -> Contact:
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
        are no numbers.
    """
    overlay = sensor.overlay
    checked_tabs(overlay)
    shape = (sensor.rows, sensor.columns)
    load = load_of(touch)
    if touch.force_n == 0:
        return Contact(
            np.zeros(shape), math.inf, touch.tilt_x_rad, touch.tilt_y_rad, "tabs", iterations=0
        )
    points, drop = tip_points(sensor, tips or _PLAIN)
    heights = asked(surface, touch, points) - drop
    found, forces = settled(points, heights, overlay, load)
    tilt = max(abs(found.pose.tilt_x_rad), abs(found.pose.tilt_y_rad))
    if tilt > STEEPEST_RAD:
        raise ContactError(
            f"the plate tips: it comes to rest at a tilt of {math.degrees(tilt):.3g} degrees, "
            f"beyond {math.degrees(STEEPEST_RAD):.3g}",
            fix="move the sensor, press with less force, or take a stiffer wrist",
        )
    return Contact(
        forces.reshape(shape),
        found.pose.z_mm,
        found.pose.tilt_x_rad,
        found.pose.tilt_y_rad,
        "tabs",
        found.iterations,
    )


def asked(surface: Surface, touch: Touch, points_mm: Array) -> Array:
    """Return the heights under points (..., 2) of the sensor, refused where they are no numbers."""
    at = touch.on_surface(points_mm.reshape(-1, 2))
    heights = np.asarray(surface.heights_mm(at), dtype=np.float64)
    highest = heights.max(initial=-math.inf) if heights.shape == (len(at),) else math.nan
    if not highest < math.inf:  # NaN, too
        raise ContactError(
            "the surface gives heights that are no numbers",
            fix="give a finite height at each point, or -inf where there is no matter",
        )
    return heights.reshape(points_mm.shape[:-1])


def settled(
    points_mm: Array, heights_mm: Array, overlay: Overlay, load: Load
) -> tuple[Rest, Array]:
    """Return the plate at rest and the force (n,) of each tab; what hangs free is left out.

    The plate is foreseen level, and points (n, q) deep below it are not computed. Should one
    of them touch after all, it is taken in and the plate comes to rest anew.
    """
    n, q = heights_mm.shape
    skin, column = tip_laws(overlay, q)
    foreseen, depth = _foreseen(points_mm, heights_mm, overlay, load)
    points, heights = points_mm.reshape(-1, 2), heights_mm.ravel()
    pressed = heights - foreseen.heights_mm(points)
    kept = pressed > -_MARGIN * depth
    while True:
        some = np.flatnonzero(kept)
        of_tab = some // q
        first = np.empty(len(some), dtype=np.bool_)
        first[0] = True
        np.not_equal(of_tab[1:], of_tab[:-1], out=first[1:])
        starts = np.flatnonzero(first)
        compressed = _compressed(pressed[some], starts, q, overlay)
        columns = Columns(column, starts, np.cumsum(first) - 1, compressed)
        found = rest(
            points.take(some, axis=0), heights[some], skin, load,
            columns=columns, foreseen=foreseen, tolerance=TOLERANCE,
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
    skin_mm = overlay.height_mm / (1 + BETA)
    column_mm = overlay.height_mm - skin_mm
    return (
        NeoHooke(overlay.young_mpa * area / points / skin_mm, skin_mm),
        NeoHooke(overlay.young_mpa * area / column_mm, column_mm),
    )


def checked_tabs(overlay: Overlay) -> None:
    """Refuse an overlay that is no tabs, or of no size."""
    if overlay.kind != "tab":
        raise ContactError(
            f"the overlay is a {overlay.kind}; this level knows tabs alone",
            fix='take the level "layer" or "elements" for a pad',
        )
    sizes = (overlay.height_mm, overlay.tab_diameter_mm, overlay.young_mpa)
    if not (min(sizes) > 0 and max(sizes) < math.inf):
        raise ContactError(
            f"tabs of height {sizes[0]:g} mm, diameter {sizes[1]:g} mm, modulus {sizes[2]:g} MPa",
            fix="give finite values > 0",
        )


_PLAIN = Tips()
_CRUSHED = 1.4  # power by which partial cover stiffens more at the usual strains
_MARGIN = 0.1  # of the foreseen depth, further down which points are still computed
_SAMPLED = 8  # every eighth point of a tip foresees the pose


def _foreseen(
    points_mm: Array, heights_mm: Array, overlay: Overlay, load: Load
) -> tuple[Pose, float]:
    """Return about where the plate comes to rest, and how deep the tabs are pressed.

    Some points of each tip stand for all, each a neo-Hookean column of its own, stiffened as
    tips are that are covered in part.
    """
    q = heights_mm.shape[1]
    level = heights_mm
    if load.tilt_x_rad or load.tilt_y_rad:
        unloaded = Pose(0.0, load.tilt_x_rad, load.tilt_y_rad)
        level = heights_mm - unloaded.heights_mm(points_mm)
    high = level > level.max() - overlay.height_mm / 4
    share = high.astype(np.float64) @ np.full(q, 1 / q)
    stiffer = float(share @ ((1 + BETA) / (1 + BETA * share))) / max(float(share.sum()), 1 / q)
    area = math.pi * overlay.tab_diameter_mm**2 / 4 * stiffer**_CRUSHED
    points = points_mm[:, ::_SAMPLED].reshape(-1, 2)
    heights = heights_mm[:, ::_SAMPLED].ravel()
    area *= len(heights_mm) / heights.size
    law = NeoHooke(overlay.young_mpa * area / overlay.height_mm, overlay.height_mm)
    z = level.max() - _level_depth(-np.sort(-level[:, ::_SAMPLED], axis=None), law, load.force_n)
    found = rest(points, heights, law, load,
                 foreseen=Pose(z, load.tilt_x_rad, load.tilt_y_rad), tolerance=0.02)  # fmt: skip
    return found.pose, max(float((heights - found.pose.heights_mm(points)).max()), 0.0)


def _level_depth(heights: Array, law: NeoHooke, force_n: float) -> float:
    """Return about how deep a level plate sinks in on columns of falling heights (n,).

    The first k are taken at their mean; the next would bear too much.
    """
    length = law.length_mm
    many = np.arange(1, heights.size + 1)
    below = np.minimum(heights[0] - heights, 1e3 * length)
    mean = np.cumsum(below) / many
    stretch = np.maximum(1 - (below - mean) / length, 1e-6)
    stress = 3 * force_n / (float(law.stiffness) * length)
    k = max(int(np.searchsorted(many * (stretch**-2 - stretch), stress)) - 1, 0)
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


def _compressed(pressed: Array, starts: NDArray[np.intp], points: int, overlay: Overlay) -> Array:
    """Return about the compression of the columns behind skins that are pressed so deep.

    Exact for tips covered at one height in the limits of small and of large strain.
    """
    skin, column = 1 / (1 + BETA), BETA / (1 + BETA)
    share = np.add.reduceat((pressed > 0).astype(np.float64), starts) / points
    mean = np.add.reduceat(np.maximum(pressed, 0.0), starts) / points
    small = column * mean / (skin + column * share)
    root = np.sqrt(share)
    depth = mean / np.maximum(share, 1 / points)
    large = (depth - skin * overlay.height_mm * (1 - root)) / (1 + root * (skin / column))
    return np.maximum(small, large)
