"""Along which line, and under which radius, a round face lies under the sensor: from forces alone.

Image -> a few bends with a gain each, likeliest first. A plate on a cylinder presses a strip:
its direction is that of the cylinder's lines, its width tells depth and radius. Forces averaged
over about a symbol are what a face with the mean response of symbols all over would give; every
direction under every registered radius is fitted by depth and slopes, all at once. Roots of
forces are compared, which makes their errors nearly even. Sensor frame, mm, rad.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.database.registered import Bend
from probe.sensor import SensorType
from recognizer.touch.symbols.gain import Image, bounded_gain

Array = NDArray[np.float64]

DIRECTIONS = 18  #: of lines, over half a turn
STEPS = 6  #: of Gauss and Newton
AROUND = 5  #: tactels, side of the square over which forces are averaged
APART = 0.35  #: rad by which two bends differ in direction, or else in radius
_FIRST, _LEAST, _MOST = 0.45, 0.08, 0.8  # depth, heights of the overlay
_STEP = 0.2  # largest change of a step
_FAINT = 0.03  # root of a response below which its slope is not trusted


@dataclass(frozen=True, slots=True, eq=False)
class BendGuess:
    """A bend that a touch may have."""

    bend: Bend  #: in the axes of the sensor, of the face without its symbols
    gain: Array  #: (4,) to begin with
    left: float  #: share of the image that it does not explain


def guess_bends(
    image: Image, sensor: SensorType, radii_mm: tuple[float, ...], ink: float, keep: int
) -> list[BendGuess]:
    """Return the bends that explain an image best, at most `keep`, no two of them alike.

    Parameters
    ----------
    image
        As of a flat face.
    radii_mm
        Of the faces that may be touched.
    ink
        Mean response of symbols.
    """
    angles = np.arange(DIRECTIONS) * math.pi / DIRECTIONS
    bends = [Bend(radius, float(angle)) for radius in radii_mm for angle in angles]
    height = sensor.overlay.height_mm
    symbol = image.pressing.symbol * height
    points = sensor.centres_mm().reshape(-1, 2)
    falls = np.array([bend.raised(symbol).falls_mm(points) / height for bend in bends])
    smooth = _Average(image)
    seen = np.sqrt(np.maximum(smooth.of(image.forces[None])[0], 0.0))
    whole = float(seen @ seen)
    if not whole > 0:
        return []
    plane, root, left = _fit_gains(image, falls, ink, smooth, seen)
    found: list[BendGuess] = []
    for b in np.argsort(left, kind="stable").tolist():
        if len(found) == keep:
            break
        if any(_same_bend(bends[b], one.bend) for one in found):
            continue
        scale = 2.0 * math.log(max(float(root[b]), 1e-9))
        gain = bounded_gain(np.array([[scale, *plane[b]]]))[0]
        found.append(BendGuess(bends[b], gain, float(left[b]) / whole))
    return found


def _same_bend(a: Bend, b: Bend) -> bool:
    turn = math.remainder(a.towards_rad - b.towards_rad, math.pi)
    return a.radius_mm == b.radius_mm and abs(turn) < APART


@dataclass(frozen=True, slots=True, eq=False)
class _Average:
    """Means over the neighbourhood of each tactel, of those that are trusted."""

    image: Image

    def of(self, values: Array) -> Array:
        """Return the means (b, n) of values (b, n)."""
        return self._sum(values * self.image.trust) / np.maximum(
            self._sum(self.image.trust[None]), 1e-9
        )

    def _sum(self, values: Array) -> Array:
        from scipy.ndimage import uniform_filter

        square = values.reshape(-1, *self.image.shape)
        sums = uniform_filter(square, (0, AROUND, AROUND), mode="constant")
        return np.asarray(sums.reshape(values.shape))


def _fit_gains(
    image: Image, falls: Array, ink: float, smooth: _Average, seen: Array
) -> tuple[Array, Array, Array]:
    """Return planes (b, 3), roots of scales (b,), and what is left (b,)."""
    pressing, basis = image.pressing, image.plane

    def pressed(plane: Array) -> tuple[Array, ...]:
        depth = plane @ basis.T - falls
        force = ink * pressing.force(depth)
        force += (1.0 - ink) * pressing.force(depth - pressing.symbol)
        slope = ink * pressing.slope(depth)
        slope += (1.0 - ink) * pressing.slope(depth - pressing.symbol)
        root = np.sqrt(np.maximum(smooth.of(force), 1e-9))
        scale = (root @ seen) / (root * root).sum(axis=1)
        away = seen - scale[:, None] * root
        return plane, slope, root, scale, away, (away * away).sum(axis=1)

    start = np.zeros((len(falls), 3))
    start[:, 0] = _FIRST
    best = pressed(start)
    damping = np.full(len(falls), 1e-2)
    for _ in range(STEPS):
        plane, slope, root, scale, away, left = best
        half = 0.5 * scale[:, None] / np.maximum(root, _FAINT)
        columns = [half * smooth.of(slope * one) for one in basis.T]
        jacobian = np.stack([*columns, root], axis=-1)
        normal = jacobian.swapaxes(1, 2) @ jacobian
        diagonal = damping[:, None] * np.einsum("bkk->bk", normal) + 1e-9
        right = (jacobian * away[..., None]).sum(axis=1)
        step = np.linalg.solve(normal + diagonal[..., None] * np.eye(4), right[..., None])[..., 0]
        moved = plane + np.clip(step[:, :3], -_STEP, _STEP)
        moved[:, 0] = np.clip(moved[:, 0], _LEAST, _MOST)
        tried = pressed(moved)
        better = tried[-1] < left
        damping = np.where(better, damping / 3.0, damping * 6.0)
        best = tuple(
            np.where(better.reshape(-1, *[1] * (old.ndim - 1)), new, old)
            for new, old in zip(tried, best, strict=True)
        )
    return best[0], best[3], best[5]
