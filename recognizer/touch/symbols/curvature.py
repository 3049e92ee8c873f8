"""Along which line, and under which radius, a round face lies under the sensor: from forces alone.

Image -> a few curvatures with a gain each, likeliest first. A plate on a cylinder presses a strip
along the cylinder's lines; its width gives depth and radius. Forces averaged over about a symbol
are compared with those of a face with the mean response of symbols all over; every direction under
every registered radius is fitted by depth and slopes at once. Roots of forces have nearly even
errors. Sensor frame, mm, rad.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from generator.database.registered import Bend
from recognizer.touch.symbols.image import Image, bounded_gain
from recognizer.touch.symbols.kernels import DAMPING, EASIER

Array = NDArray[np.float64]
Smooth = Callable[[Array], Array]  #: values (b, n) -> means (b, n)

DIRECTIONS = 18  #: of lines, over half a turn
STEPS = 6  #: of damped least squares
HARDER = 6.0  #: multiplies the damping after a step that does not help
MOST_DAMPING = 1e6
AROUND = 5  #: tactels, side of the square over which forces are averaged
APART_RAD = 0.35  #: by which two curvatures of one radius differ
FIRST, LEAST, MOST = 0.45, 0.08, 0.8  #: depth, heights of the overlay: to begin with, bounds
LARGEST_STEP = 0.2  #: of the depth
FAINT = 0.03  #: root of a response below which its slope is not trusted


@dataclass(frozen=True, slots=True, eq=False)
class CurvatureGuess:
    """A possible curvature of a touch."""

    bend: Bend  #: in the axes of the sensor, of the face without its symbols
    gain: Array  #: (4,) to begin with
    left: float  #: share of the image that it does not explain


def guess_curvatures(
    image: Image, sensor: SensorType, radii_mm: tuple[float, ...], keep: int
) -> list[CurvatureGuess]:
    """Return the curvatures that explain an image best, at most `keep`, no two of them alike.

    `image` is as of a flat face; `radii_mm` are those of the faces that may be touched.
    """
    angles = np.arange(DIRECTIONS) * math.pi / DIRECTIONS
    bends = [Bend(radius, float(angle)) for radius in radii_mm for angle in angles]
    height = sensor.overlay.height_mm
    symbol = image.pressing.symbol * height
    points = sensor.centres_mm().reshape(-1, 2)
    falls = np.array([bend.raised(symbol).falls_mm(points) / height for bend in bends])
    smooth = _average(image)
    seen = np.sqrt(np.maximum(smooth(image.forces[None])[0], 0.0))
    whole = float(seen @ seen)
    if not whole > 0:
        return []
    fitted = _fit_gains(image, falls, smooth, seen)
    found: list[CurvatureGuess] = []
    for b in np.argsort(-fitted.value, kind="stable").tolist():
        if len(found) == keep:
            break
        if any(_same_curvature(bends[b], one.bend, APART_RAD) for one in found):
            continue
        scale = 2.0 * math.log(max(float(fitted.scale[b]), 1e-9))
        gain = bounded_gain(np.array([[scale, *fitted.plane[b]]]))[0]
        found.append(CurvatureGuess(bends[b], gain, -float(fitted.value[b]) / whole))
    return found


def _same_curvature(a: Bend, b: Bend, apart: float) -> bool:
    turn = math.remainder(a.towards_rad - b.towards_rad, math.pi)
    return a.radius_mm == b.radius_mm and abs(turn) < apart


def _average(image: Image) -> Smooth:
    """Return the means (b, n) of values (b, n) over the trusted tactels about each one."""
    from scipy.ndimage import uniform_filter

    def summed(values: Array) -> Array:
        square = values.reshape(-1, *image.shape)
        sums = uniform_filter(square, (0, AROUND, AROUND), mode="constant")
        return np.asarray(sums.reshape(values.shape))

    known = np.maximum(summed(image.trust[None]), 1e-9)
    return lambda values: summed(values * image.trust) / known


class _Strips(NamedTuple):
    """Planes under b curvatures, and how well they explain an image."""

    plane: Array  # (b, 3) depths
    scale: Array  # (b,) root of the force scale
    value: Array  # (b,) minus the sum of squares of what is left
    normal: Array  # (b, 4, 4) of plane and root of the scale
    right: Array  # (b, 4)


def _fit_gains(image: Image, falls: Array, smooth: Smooth, seen: Array) -> _Strips:
    """Return the planes under which curvatures explain an image best."""
    pressing, basis, ink = image.pressing, image.plane, image.template.ink

    def pressed(plane: Array) -> _Strips:
        depth = plane @ basis.T - falls
        force = ink * pressing.force(depth)
        force += (1.0 - ink) * pressing.force(depth - pressing.symbol)
        slope = ink * pressing.slope(depth)
        slope += (1.0 - ink) * pressing.slope(depth - pressing.symbol)
        root = np.sqrt(np.maximum(smooth(force), 1e-9))
        scale = (root @ seen) / (root * root).sum(axis=1)
        away = seen - scale[:, None] * root
        half = 0.5 * scale[:, None] / np.maximum(root, FAINT)
        columns = [half * smooth(slope * one) for one in basis.T]
        jacobian = np.stack([*columns, root], axis=-1)
        normal = jacobian.swapaxes(1, 2) @ jacobian
        right = (jacobian * away[..., None]).sum(axis=1)
        return _Strips(plane, scale, -(away * away).sum(axis=1), normal, right)

    start = np.zeros((len(falls), 3))
    start[:, 0] = FIRST
    best, damping = pressed(start), np.full(len(falls), DAMPING)
    for _ in range(STEPS):
        diagonal = np.einsum("bii->bi", best.normal) * damping[:, None] + 1e-9
        system = best.normal + diagonal[:, :, None] * np.eye(4)
        step = np.linalg.solve(system, best.right[..., None])[:, :3, 0]
        plane = best.plane + np.clip(step, -LARGEST_STEP, LARGEST_STEP)
        plane[:, 0] = np.clip(plane[:, 0], LEAST, MOST)
        tried = pressed(plane)
        better = tried.value > best.value
        best = _Strips(
            *(
                np.where(better.reshape(-1, *[1] * (new.ndim - 1)), new, old)
                for new, old in zip(tried, best, strict=True)
            )
        )
        damping = np.where(better, damping / EASIER, np.minimum(damping * HARDER, MOST_DAMPING))
    return best
