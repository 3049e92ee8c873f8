"""Touches of a part -> how it was printed: scale both ways, skew and stroke width.

A print takes a point p of the part to S p (`recognizer.touch.as_built`). Where the part was
touched cannot be known, nor how it was turned, but how it is stretched: E = (S'S - 1) / 2 does
not change with a turn. A touch tells E of its face, P' E P with P the face's axes in x and y of
the part (along z it is as designed), which is linear in E, so touches of all faces of a part go
into one weighted least squares. A touch may be plainly wrong, so errors are taken as distributed
like Student's t, by reweighing (K. L. Lange et al., J. Amer. Stat. Assoc. 84 (1989) 881); how sure
the result is comes from the spread of the touches around it, not from what each says of itself
(P. J. Huber, Proc. 5th Berkeley Symp. 1 (1967) 221). Part frame; mm, rad.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.database.as_built import AsBuilt
from recognizer.as_built.settings import ESTIMATE, EstimateSettings
from recognizer.errors import AsBuiltError

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class FeltPrint:
    """How one touch felt the print under it."""

    seq: int
    object: str
    face: str
    part: str  #: name of the part that bears the face
    axes: Array  #: (2, 2) P: columns are the face's x and y axes, in x and y of the part
    strain: Array  #: (3,) xx, yy and xy of (F'F - 1) / 2, F from the face's design to its print
    stroke_mm: float
    covariance: Array  #: (4, 4) of strain and stroke_mm


def estimate_print(
    felt: Sequence[FeltPrint],
    *,
    object_id: int | None = None,
    printer: str = "",
    material: str = "",
    settings: EstimateSettings = ESTIMATE,
) -> AsBuilt:
    """Return how a part was printed.

    Parameters
    ----------
    felt
        Touches of it.
    object_id, printer, material
        What the result is kept under.

    Raises
    ------
    AsBuiltError
        There are too few touches, or none of a face that tells scale both ways and skew.

    Examples
    --------
    >>> touch = FeltPrint(0, "Cube", "F1", "Cube-F1", np.eye(2), np.array([-0.02, 0, 0]), 1.4,
    ...                   np.eye(4) * 1e-6)
    >>> found = estimate_print([touch] * 25)
    >>> round(found.scale_x, 4), found.scale_y, found.skew_rad
    (0.9798, 1.0, 0.0)
    """
    if len(felt) < settings.least:
        raise AsBuiltError(
            f"{len(felt)} touches of it were read, {settings.least} are the least",
            fix=f"record {settings.enough}-{2 * settings.enough} touches all over the part",
            place=felt[0].part if felt else "",
        )
    design = np.array([_design(one.axes) for one in felt])  # (n, 4, 4)
    said = np.array([[*one.strain, one.stroke_mm] for one in felt])
    sure = np.linalg.inv([one.covariance for one in felt])
    _refuse_unseen(design, felt[0].part, settings)
    weights = np.ones(len(felt))
    best = np.full(4, np.inf)
    for _ in range(settings.rounds):
        pull = design.swapaxes(1, 2) @ sure * weights[:, None, None]
        normal = (pull @ design).sum(axis=0)
        before, best = best, np.linalg.solve(normal, (pull @ said[..., None]).sum(axis=0)[:, 0])
        left = said - design @ best
        square = np.einsum("ni,nij,nj->n", left, sure, left)
        size = max(float(np.median(square)) / settings.median, 1e-12)
        if np.abs(best - before).max() < settings.settled:
            break
        weights = (settings.freedom + 4) / (settings.freedom + square / size)
    each = (pull @ left[..., None])[..., 0]
    meat = each.T @ each
    bread = np.linalg.inv(normal - 2 / ((settings.freedom + 4) * size) * meat)
    spread = bread @ meat @ bread * len(felt) / (len(felt) - 4)  # four unknowns
    scale_x, scale_y = math.sqrt(1 + 2 * best[0]), math.sqrt(1 + 2 * best[1])
    by = np.diag([1 / scale_x, 1 / scale_y, 2 / (scale_x * scale_y), 1.0])  # to first order
    return AsBuilt(
        object_id=object_id,
        part=felt[0].part,
        printer=printer,
        material=material,
        scale_x=scale_x,
        scale_y=scale_y,
        skew_rad=math.asin(2 * best[2] / (scale_x * scale_y)),
        stroke_mm=float(best[3]),
        covariance=by @ spread @ by + np.diag(np.square(settings.always)),
        touches=len(felt),
    )


def estimate_printer(parts: Sequence[AsBuilt], settings: EstimateSettings = ESTIMATE) -> AsBuilt:
    """Return what a part that nobody has touched is expected to be, by parts of its printer.

    Parameters
    ----------
    parts
        One or more of one printer and material. How far parts differ is what they show, and no
        less than `EstimateSettings.between`.
    """
    said = np.array([[one.scale_x, one.scale_y, one.skew_rad, one.stroke_mm] for one in parts])
    mean, count = said.mean(axis=0), len(parts)
    between = np.square(settings.between)
    if count > 1:
        between = np.maximum(between, said.var(axis=0, ddof=1))
    known = np.sum([one.covariance for one in parts], axis=0) / count**2
    return AsBuilt(
        object_id=None,
        part=None,
        printer=parts[0].printer,
        material=parts[0].material,
        scale_x=float(mean[0]),
        scale_y=float(mean[1]),
        skew_rad=float(mean[2]),
        stroke_mm=float(mean[3]),
        covariance=known + np.diag(between) * (1 + 1 / count),
        touches=sum(one.touches for one in parts),
    )


def _design(axes: Array) -> Array:
    """Return (4, 4): strain and stroke of a face by xx, yy, xy of its part's E and the stroke."""
    (xa, xb), (ya, yb) = axes
    whole = np.eye(4)
    whole[0, :3] = xa * xa, ya * ya, 2 * xa * ya
    whole[1, :3] = xb * xb, yb * yb, 2 * xb * yb
    whole[2, :3] = xa * xb, ya * yb, xa * yb + ya * xb
    return whole


def _refuse_unseen(design: Array, part: str, settings: EstimateSettings) -> None:
    """Refuse touches of faces that do not tell all of E, such as one wall of a whole body."""
    told, axes = np.linalg.eigh((design.swapaxes(1, 2) @ design).sum(axis=0)[:3, :3])
    if told[0] > settings.unseen * told[-1]:
        return
    names = ("x", "y", "skew")
    unseen = [
        name
        for name, row in zip(names, axes, strict=True)
        if np.abs(row[told <= settings.unseen * told[-1]]).max() > 0.5
    ]
    raise AsBuiltError(
        f"the faces that were touched do not tell {' and '.join(unseen)}",
        fix="touch also its top, or a wall that runs the other way",
        place=part,
    )
