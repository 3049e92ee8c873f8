"""Where a plate on tabs will about come to rest, so that little is computed in vain.

A few points of each tip stand for all: the plate is put on them as on separate columns, to
two per cent of the force. From there on the tips themselves (`tabs`) need few steps, and all
that hangs well below the plate is left out.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import Overlay
from probe.contact.neo_hooke import NeoHooke
from probe.contact.plate import PlateLoad, PlatePose, rest
from probe.contact.settings import TABS

Array = NDArray[np.float64]


def foreseen_pose(
    points_mm: Array, heights_mm: Array, overlay: Overlay, load: PlateLoad
) -> tuple[PlatePose, float]:
    """Return about where the plate comes to rest, and how deep the tabs are pressed.

    Some points of each tip stand for all, each a neo-Hookean column of its own, stiffened as
    tips are that are covered in part.
    """
    q = heights_mm.shape[1]
    level = heights_mm
    if load.tilt_x_rad or load.tilt_y_rad:
        unloaded = PlatePose(0.0, load.tilt_x_rad, load.tilt_y_rad)
        level = heights_mm - unloaded.heights_mm(points_mm)
    high = level > level.max() - overlay.height_mm / 4
    share = high.astype(np.float64) @ np.full(q, 1 / q)
    stiffer = float(share @ ((1 + TABS.skin) / (1 + TABS.skin * share))) / max(
        float(share.sum()), 1 / q
    )
    area = math.pi * overlay.tab_diameter_mm**2 / 4 * stiffer**TABS.crushed
    free = min(load.wrist.tilt_x_nmm_rad, load.wrist.tilt_y_nmm_rad) == 0
    some = slice(None, None, TABS.sampled)
    if free or not heights_mm[:, some].max() > -math.inf:
        some = slice(None)  # a needle, or a hull that matters
    points = points_mm[:, some].reshape(-1, 2)
    heights = heights_mm[:, some].ravel()
    area *= len(heights_mm) / heights.size
    law = NeoHooke(overlay.young_mpa * area / overlay.height_mm, overlay.height_mm)
    z = level.max() - _level_depth(-np.sort(-level[:, some], axis=None), law, load.force_n)
    start = PlatePose(float(z), load.tilt_x_rad, load.tilt_y_rad)
    found = rest(points, heights, law, load, foreseen=start, tolerance=0.02)
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


def columns_foreseen(
    pressed: Array, starts: NDArray[np.intp], points: int, overlay: Overlay
) -> Array:
    """Return about the compression of the columns behind skins that are pressed so deep.

    Exact for tips covered at one height in the limits of small and of large strain.
    """
    skin, column = 1 / (1 + TABS.skin), TABS.skin / (1 + TABS.skin)
    share = np.add.reduceat((pressed > 0).astype(np.float64), starts) / points
    mean = np.add.reduceat(np.maximum(pressed, 0.0), starts) / points
    small = column * mean / (skin + column * share)
    root = np.sqrt(share)
    depth = mean / np.maximum(share, 1 / points)
    large = (depth - skin * overlay.height_mm * (1 - root)) / (1 + root * (skin / column))
    return np.maximum(small, large)
