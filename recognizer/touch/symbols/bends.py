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

from encoded_objects.base.sensor_type import SensorType
from generator.database.registered import Bend
from recognizer.touch.symbols.damped import ascend, damped_step
from recognizer.touch.symbols.gain import Image, bounded_gain

Array = NDArray[np.float64]


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
    settings = image.settings.bends
    angles = np.arange(settings.directions) * math.pi / settings.directions
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
    fitted = _fit_gains(image, falls, ink, smooth, seen)
    found: list[BendGuess] = []
    for b in np.argsort(-fitted.value, kind="stable").tolist():
        if len(found) == keep:
            break
        if any(_same_bend(bends[b], one.bend, settings.apart) for one in found):
            continue
        scale = 2.0 * math.log(max(float(fitted.scale[b]), 1e-9))
        gain = np.array([[scale, *fitted.plane[b]]])
        gain = bounded_gain(gain, image.settings.gain.steepest)[0]
        found.append(BendGuess(bends[b], gain, -float(fitted.value[b]) / whole))
    return found


def _same_bend(a: Bend, b: Bend, apart: float) -> bool:
    turn = math.remainder(a.towards_rad - b.towards_rad, math.pi)
    return a.radius_mm == b.radius_mm and abs(turn) < apart


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

        around = self.image.settings.bends.around
        square = values.reshape(-1, *self.image.shape)
        sums = uniform_filter(square, (0, around, around), mode="constant")
        return np.asarray(sums.reshape(values.shape))


@dataclass(frozen=True, slots=True, eq=False)
class _Strips:
    """What planes under b bends explain of an image."""

    plane: Array  # (b, 3) depths
    scale: Array  # (b,) root of the force scale
    value: Array  # (b,) minus the sum of squares of what is left
    normal: Array  # (b, 4, 4) of plane and root of the scale
    right: Array  # (b, 4)


def _fit_gains(image: Image, falls: Array, ink: float, smooth: _Average, seen: Array) -> _Strips:
    """Return the planes under which bends explain an image best."""
    pressing, basis, settings = image.pressing, image.plane, image.settings.bends

    def pressed(plane: Array) -> _Strips:
        depth = plane @ basis.T - falls
        force = ink * pressing.force(depth)
        force += (1.0 - ink) * pressing.force(depth - pressing.symbol)
        slope = ink * pressing.slope(depth)
        slope += (1.0 - ink) * pressing.slope(depth - pressing.symbol)
        root = np.sqrt(np.maximum(smooth.of(force), 1e-9))
        scale = (root @ seen) / (root * root).sum(axis=1)
        away = seen - scale[:, None] * root
        half = 0.5 * scale[:, None] / np.maximum(root, settings.faint)
        columns = [half * smooth.of(slope * one) for one in basis.T]
        jacobian = np.stack([*columns, root], axis=-1)
        return _Strips(
            plane=plane,
            scale=scale,
            value=-(away * away).sum(axis=1),
            normal=jacobian.swapaxes(1, 2) @ jacobian,
            right=(jacobian * away[..., None]).sum(axis=1),
        )

    def moved(at: _Strips, damping: Array) -> _Strips:
        step = damped_step(at, damping, 1e-9)[:, :3]
        plane = at.plane + np.clip(step, -settings.step, settings.step)
        plane[:, 0] = np.clip(plane[:, 0], settings.least, settings.most)
        return pressed(plane)

    start = np.zeros((len(falls), 3))
    start[:, 0] = settings.first
    return ascend(pressed(start), moved, settings.steps, settings)
