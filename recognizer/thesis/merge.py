"""Overlapping touches -> the global tactile image, merged one after another. Thesis 4.3.

The first touch is the reference: the image frame is its sensor frame. Every further one is laid on
the touch before it that overlaps it most, at the step that arm and wrist believe, corrected by
quarters of a tactel where the correlation of products is largest. Errors of single steps add up
along the way; they stay bounded if the search is around the arm's pose itself rather than the step.
`recognizer.scan.mosaic` does better; its poses can be given as beliefs. Where touches overlap, the
image is the mean of their magnified images.

The correlation: each image is magnified to four times its resolution (`filters`). The zone is the
common part of both images at the believed shift; it stays fixed in the first image while the second
one is shifted under it. The largest sum of products wins, to the cell. Kept as published, to
measure `scan.mosaic` against: sums of products favour large readings.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from encoded_objects.base.sensor_type import SensorType
from recognizer.scan.mosaic.planar import (
    compose_poses,
    inverse,
    planar_pose,
    relative_pose,
    transform_points,
)
from recognizer.scan.mosaic.search import MAGNIFIED
from recognizer.thesis.filters import double_sampling, magnify_image
from recognizer.touch.tactile_image import ImageError, TactileImage, tactile_image, touch_image

Array = NDArray[np.float64]
#: correct the believed step, correct the believed pose, or keep it
Placing = Literal["product", "bounded", "believed"]

WINDOW_TACTELS = 0.75  #: half width of the search around a belief
LEAST_OVERLAP = 0.5  #: share of the sensor's width and height in common
TURN_RAD = math.radians(3)  #: touches turned further against each other are not compared
FAINT = 0.2  #: of the highest reading; zones below show nothing
ROUNDING = 1e-6  #: samples beyond an image's rim; share of two touches' overlap


@dataclass(frozen=True, slots=True, eq=False)
class MergedImage:
    """The thesis's global tactile image (GTI) with the poses of its touches."""

    image: TactileImage  #: four samples to a tactel; frame: the sensor frame of the first touch
    poses: Array  #: (n, 3) T_image_probe of each touch: x, y (mm), theta (rad)


def merge_touches(
    sensor: SensorType,
    readings: Sequence[ArrayLike],
    poses: ArrayLike,
    placing: Placing = "product",
    *,
    trust: ArrayLike | None = None,
) -> MergedImage:
    """Merge the touches of a scan, which are pressed with about equal forces.

    Parameters
    ----------
    readings
        (rows, columns) of each touch, over its bias.
    poses
        As believed; see `relative_poses`.
    placing
        Where a correction is searched for.
    trust
        (rows, columns) 0 for bad tactels, which are left out.

    Raises
    ------
    ImageError
        If readings and poses do not belong together, or a reading is no number.
    """
    believed = relative_poses(poses)
    images = [touch_image(sensor, values, trust) for values in readings]
    if len(images) != len(believed):
        raise ImageError(
            f"{len(images)} touches with {len(believed)} poses", fix="give one pose to each"
        )
    placed = np.array(believed)
    origin = placed if placing == "bounded" else believed
    for k in range(1, len(images) if placing != "believed" else 0):
        near = _nearest_touch(sensor, believed, k)
        before = k - 1 if near is None else near
        step = relative_pose(origin[before], believed[k])
        if near is not None:
            step = _corrected_step(sensor, images[near], images[k], step)
        placed[k] = compose_poses(placed[before], step)
    return MergedImage(average_touches(sensor, images, placed), placed)


def relative_poses(poses: ArrayLike) -> Array:
    """Return (n, 3) planar poses of touches in the sensor frame of the first one.

    Parameters
    ----------
    poses
        (n, 4, 4) T_base_probe in any base frame, mm; or (n, 3) x, y (mm) and theta (rad) in
        any plane.

    Raises
    ------
    ImageError
        If they are neither.
    MosaicError
        If a touch is tilted by more than 60 degrees out of the plane of the first one.
    """
    given = np.asarray(poses, np.float64)
    if len(given) and np.isfinite(given).all():
        if given.ndim == 2 and given.shape[1:] == (3,):
            return relative_pose(given[0], given)
        if given.ndim == 3 and given.shape[1:] == (4, 4):
            first = np.linalg.inv(given[0])
            return np.array([planar_pose(first @ T) for T in given])
    raise ImageError(
        f"poses of shape {given.shape}",
        fix="give T_base_probe (n, 4, 4) of n touches, or x, y and theta (n, 3)",
    )


def average_touches(
    sensor: SensorType, images: Sequence[TactileImage], placed: Array
) -> TactileImage:
    """Return the mean of images at poses (n, 3), sampled four times as finely."""
    cell = sensor.pitch_mm / MAGNIFIED
    half = np.array(sensor.half_mm) - sensor.pitch_mm / 2
    corners = half * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    ends = np.concatenate([transform_points(pose, corners) for pose in placed])
    low, high = np.floor(ends.min(axis=0) / cell), np.ceil(ends.max(axis=0) / cell)
    columns, rows = (high - low).astype(int) + 1
    total, weight = np.zeros((rows, columns)), np.zeros((rows, columns))
    for image, pose in zip(images, placed, strict=True):
        fine = magnify_image(image)
        box = transform_points(pose, corners) / cell
        left, down = np.floor(box.min(axis=0) - low).astype(int)
        right, up = np.ceil(box.max(axis=0) - low).astype(int) + 1
        x, y = np.meshgrid((np.arange(left, right) + low[0]), (np.arange(down, up) + low[1]))
        at = transform_points(inverse(pose), np.stack([x, y], axis=-1) * cell)
        values, known = _interpolate(fine, at)
        total[down:up, left:right] += values
        weight[down:up, left:right] += known
    values = np.divide(total, weight, out=np.zeros_like(total), where=weight > 0)
    return tactile_image(
        values[::-1],
        step_mm=cell,
        defined=weight[::-1] > 0,
        corner_mm=(float(low[0]) * cell, float(high[1]) * cell),
    )


def product_shift(a: Array, b: Array, believed: tuple[float, float]) -> Array:
    """Return the shift (2,) along x and y of image b from a, in steps of a quarter tactel.

    Parameters
    ----------
    a, b
        (rows, columns) readings of two touches.
    believed
        Shift of b from a along x and y, tactels; `WINDOW_TACTELS` around it is searched.
    """
    first, second = magnify_samples(a), magnify_samples(b)
    rows, columns = first.shape
    right, down = round(believed[0] * MAGNIFIED), -round(believed[1] * MAGNIFIED)
    i0, i1 = max(0, down), min(rows, rows + down)
    j0, j1 = max(0, right), min(columns, columns + right)
    zone = first[i0:i1, j0:j1]
    reach = math.floor(WINDOW_TACTELS * MAGNIFIED + 1e-9)
    margin = max(rows, columns) + reach
    wide = np.pad(second, margin)  # no reading beyond the matrix
    best, shift = -math.inf, (right, down)
    for k in range(-reach, reach + 1):
        for n in range(-reach, reach + 1):
            i, j = margin + i0 - (down + k), margin + j0 - (right + n)
            total = float((zone * wide[i : i + i1 - i0, j : j + j1 - j0]).sum())
            if total > best:
                best, shift = total, (right + n, down + k)
    return np.array([shift[0], -shift[1]]) / MAGNIFIED


def magnify_samples(image: Array) -> Array:
    """Return an image of four times the rows and columns, 0 beyond the last ones."""
    for _ in range(2):
        image = double_sampling(np.pad(image, (0, 1)))[:-1, :-1]
    return image


def _nearest_touch(sensor: SensorType, believed: Array, k: int) -> int | None:
    """Return the earlier touch that overlaps most, of equals the latest; None if none does."""
    steps = relative_pose(believed[:k], believed[k])
    width = 2 * np.array(sensor.half_mm)
    share = 1 - np.abs(steps[:, :2]) / width
    fit = (share >= LEAST_OVERLAP).all(axis=1) & (np.abs(steps[:, 2]) <= TURN_RAD)
    if not fit.any():
        return None
    common = np.where(fit, share.prod(axis=1), 0.0)
    return int(np.flatnonzero(common >= common.max() - ROUNDING)[-1])


def _corrected_step(sensor: SensorType, a: TactileImage, b: TactileImage, step: Array) -> Array:
    """Return the step (3,) from a to b, corrected by products if the common part shows anything."""
    faint = FAINT * max(a.values.max(), b.values.max())
    for image, way in ((a, step), (b, inverse(step))):
        centres = sensor.centres_mm() - way[:2]
        common = (np.abs(centres) <= np.array(sensor.half_mm)).all(axis=-1)
        if not (image.values[common] > faint).any():
            return step
    believed = (float(step[0]) / sensor.pitch_mm, float(step[1]) / sensor.pitch_mm)
    shift = product_shift(a.values, b.values, believed)
    return np.append(shift * sensor.pitch_mm, step[2])


def _interpolate(image: TactileImage, at_mm: Array) -> tuple[Array, Array]:
    """Return values, 0 where not defined, and defined shares, from the four samples around."""
    from scipy.ndimage import map_coordinates

    column = (at_mm[..., 0] - image.corner_mm[0]) / image.step_mm
    row = (image.corner_mm[1] - at_mm[..., 1]) / image.step_mm
    rows, columns = image.values.shape
    inside = (column >= -ROUNDING) & (column <= columns - 1 + ROUNDING)
    inside &= (row >= -ROUNDING) & (row <= rows - 1 + ROUNDING)
    known = image.defined.astype(np.float64)
    value, share = (
        np.where(inside, map_coordinates(samples, [row, column], order=1, mode="nearest"), 0.0)
        for samples in (image.values * known, known)
    )
    return value, share
