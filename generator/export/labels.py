"""Where the name of each face stands in a picture: on the face, where it is seen.

A coarse map tells which face is seen where. A name goes where most of its label lies on its
own face, near the face's middle, and over no other label; a face that is hidden, or seen in
too few places, gets none. Picture frame: pixels, x right, y down.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.export.settings import PREVIEW

Floats = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class LabelRequest:
    """A name to be placed."""

    face: int  #: as the map calls it
    x: float  #: px, the middle of the face
    y: float
    half_width: float  #: of the label, px


def label_places(
    seen: Index, step: float, wanted: Sequence[LabelRequest]
) -> list[tuple[float, float] | None]:
    """Return the centre of each label, px, or None where there is no place for it.

    Parameters
    ----------
    seen
        (rows, columns) the face seen at ((column + 1/2) step, (row + 1/2) step), -1 for none.
    step
        Distance between two places of the map, px.
    wanted
        The names.
    """
    rows, columns = np.nonzero(seen >= 0)
    faces = seen[rows, columns]
    order = np.argsort(faces, kind="stable")
    faces = faces[order]
    x: Floats = (columns[order].astype(np.float64) + 0.5) * step
    y: Floats = (rows[order].astype(np.float64) + 0.5) * step
    spans = [np.searchsorted(faces, [one.face, one.face + 1]).tolist() for one in wanted]
    found: list[tuple[float, float] | None] = [None] * len(wanted)
    taken: list[tuple[float, float, float]] = []
    # Small faces first: large ones have other places left.
    for number in sorted(range(len(wanted)), key=lambda k: spans[k][1] - spans[k][0]):
        one, (first, end) = wanted[number], spans[number]
        if end - first < PREVIEW.label_least:
            continue
        at_x, at_y = x[first:end], y[first:end]
        free = np.abs(at_x - seen.shape[1] * step / 2) <= seen.shape[1] * step / 2 - one.half_width
        for other_x, other_y, other_half in taken:
            beside = np.abs(at_x - other_x) >= one.half_width + other_half + PREVIEW.label_gap
            free &= beside | (
                np.abs(at_y - other_y) >= 2 * PREVIEW.label_half_height + PREVIEW.label_gap
            )
        if not free.any():
            continue
        size = max(float(np.ptp(at_x)), float(np.ptp(at_y)), step)
        away = np.hypot(at_x - one.x, at_y - one.y) / size
        score = (
            _own_share(seen == one.face, at_x, at_y, step, one.half_width)
            - PREVIEW.label_far * away
        )
        best = int(np.argmax(np.where(free, score, -np.inf)))
        place = (float(at_x[best]), float(at_y[best]))
        found[number] = place
        taken.append((*place, one.half_width))
    return found


def _own_share(
    own: NDArray[np.bool_],
    x: Floats,
    y: Floats,
    step: float,
    half_width: float,
) -> Floats:
    """Return which share of a label at each place lies on its own face, by summed areas."""
    sums = np.zeros((own.shape[0] + 1, own.shape[1] + 1))
    sums[1:, 1:] = own.cumsum(axis=0).cumsum(axis=1)
    top = np.rint((y - PREVIEW.label_half_height) / step).astype(np.int64).clip(0, own.shape[0])
    bottom = np.rint((y + PREVIEW.label_half_height) / step).astype(np.int64).clip(0, own.shape[0])
    left = np.rint((x - half_width) / step).astype(np.int64).clip(0, own.shape[1])
    right = np.rint((x + half_width) / step).astype(np.int64).clip(0, own.shape[1])
    inside = sums[bottom, right] - sums[top, right] - sums[bottom, left] + sums[top, left]
    return np.asarray(inside * step**2 / (4 * half_width * PREVIEW.label_half_height))
