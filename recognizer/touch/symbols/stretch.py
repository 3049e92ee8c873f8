"""How the lattice of one touch is stretched: its scale both ways, its skew, its stroke width.

A fit whose symbols are known + image -> Stretch. The reader fits one scale; a print may be longer
one way than the other, and its axes need not be square. A sensor point s then lies at A s + (x, y)
in the lattice frame, A = (1 + e) R(theta) G with G = [[1 + a, c], [c, 1 - a]]: two unknowns more
than `refine` has, found with all others by damped least squares. Scale and stroke width have no
prior, so that many touches average to what was printed. mm, sensor and lattice frame.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from recognizer.touch.symbols.image import Image, bounded_gain
from recognizer.touch.symbols.kernels import (
    DAMPING,
    DEEPEST_GAIN,
    EASIER,
    FORM_MOST,
    HARDER,
    LARGEST_STEP,
    LEAST_DIAGONAL,
    POSE,
    SHALLOWER,
    UNKNOWNS,
)
from recognizer.touch.symbols.linearize import LabelsAt, linearize_image, prior_precision
from recognizer.touch.symbols.template import STROKE_UNIT_MM

Array = NDArray[np.float64]

STEPS = 12  #: of damped least squares, at most
SETTLED = 0.01  #: nats by which a step may better a stretch that counts as found
EVERYTHING = np.arange(UNKNOWNS + 2)
SHAPE = np.array([0, 1, 2, POSE - 1, UNKNOWNS, UNKNOWNS + 1])  #: place, turn, scale and shear
LARGEST = 0.15  #: of scale - 1 and of both unknowns of the shear
WIDEST = 2.5  #: tenths of a mm, of the stroke's excess
SHEAR_STEP = (0.01, 0.01)  #: largest change of the shear in one step
SHEAR_LEAST = (10.0, 10.0)  #: is added to the diagonal of its normal matrix


@dataclass(frozen=True, slots=True, eq=False)
class Stretch:
    """The print by one touch."""

    strain: Array  #: (3,) xx, yy and xy of (F'F - 1) / 2, F from the lattice to the print
    wider_mm: float  #: strokes, than asked
    covariance: Array  #: (4, 4) of strain and wider_mm, as the image tells it


class _StretchedLattice(NamedTuple):
    pose: Array  # (7,)
    gain: Array  # (4,)
    stretch: Array  # (2,) a and c of G
    value: float
    normal: Array  # (13, 13)
    right: Array  # (13,)


def fit_stretch(image: Image, pose: Array, gain: Array, labels_at: LabelsAt) -> Stretch:
    """Return how the lattice is stretched, from `pose` (7,) and `gain` (4,) of the fit."""
    precision = prior_precision(image)
    precision[[3, POSE - 1]] = 0.0
    least = np.array([*LEAST_DIAGONAL, *SHEAR_LEAST])
    most = np.array([*LARGEST_STEP, *SHEAR_STEP])
    limits = np.array([WIDEST, *FORM_MOST[1:], LARGEST])
    best = _evaluate(image, precision, pose, gain, np.zeros(2), labels_at)
    damping = DAMPING
    for _ in range(STEPS):
        # The likelihood is no sum of squares: a step that also widens strokes can lower it, and
        # what is held at its start counts in full. Then the shape of the lattice moves alone.
        for free in (EVERYTHING, SHAPE):
            system = (best.normal + np.diag(np.diagonal(best.normal) * damping + least))[
                np.ix_(free, free)
            ]
            step = np.zeros(len(least))
            step[free] = np.linalg.solve(system, best.right[free])
            step = np.clip(step, -most, most)
            pose, gain = best.pose + step[:POSE], best.gain + step[POSE:UNKNOWNS]
            pose[3:] = np.clip(pose[3:], -limits, limits)
            gain[1] = np.clip(gain[1], SHALLOWER * best.gain[1], DEEPEST_GAIN)
            gain = bounded_gain(gain[None])[0]
            stretch = np.clip(best.stretch + step[UNKNOWNS:], -LARGEST, LARGEST)
            tried = _evaluate(image, precision, pose, gain, stretch, labels_at)
            if tried.value > best.value:
                break
        better = tried.value - best.value
        if better > 0:
            best, damping = tried, damping / EASIER
        else:
            damping *= HARDER
        if 0 < better < SETTLED:
            break
    return _stretch_of(best)


def _evaluate(
    image: Image, precision: Array, pose: Array, gain: Array, stretch: Array, labels_at: LabelsAt
) -> _StretchedLattice:
    points = image.points_mm
    (a, c), turn = stretch, float(pose[2])
    stretched = replace(image, points_mm=points @ np.array([[1 + a, c], [c, 1 - a]]))
    at = linearize_image(stretched, pose[None], gain[None], labels_at, precision)
    cos, sin, scale = math.cos(turn), math.sin(turn), 1 + float(pose[6])
    across, up = at.jacobian[0, :, 0], at.jacobian[0, :, 1]  # by x and y of the lattice
    along_x = (across * cos + up * sin) * scale  # and of the sensor
    along_y = (up * cos - across * sin) * scale
    x, y = points.T
    jacobian = np.column_stack(
        [at.jacobian[0], along_x * x - along_y * y, along_x * y + along_y * x]
    )
    weighted = (jacobian * at.sure[0, :, None]).T
    known, precision = np.append(at.known[0], [0.0, 0.0]), np.append(precision, [0.0, 0.0])
    normal = weighted @ jacobian + np.diag(precision)
    right = weighted @ at.left[0] - known * precision
    return _StretchedLattice(pose, gain, stretch, float(at.value[0]), normal, right)


def _stretch_of(found: _StretchedLattice) -> Stretch:
    """Return strain and width of a lattice; the strain turns with the lattice, not the sensor."""
    (a, c), turn = found.stretch, float(found.pose[2])
    cos, sin = math.cos(turn), math.sin(turn)
    R = np.array([[cos, -sin], [sin, cos]])
    F = R @ np.linalg.inv(np.array([[1 + a, c], [c, 1 - a]]) * (1 + found.pose[6])) @ R.T
    E = (F @ F - np.eye(2)) / 2
    # d E = -R (de 1 + [[da, dc], [dc, -da]]) R', to first order
    modes = [R @ mode @ R.T for mode in (np.eye(2), np.diag([1.0, -1.0]), np.eye(2)[::-1])]
    by = np.zeros((4, 4))
    by[:3, :3] = -np.array([[M[0, 0], M[1, 1], M[0, 1]] for M in modes]).T
    by[3, 3] = STROKE_UNIT_MM
    unit = 1.0 / np.sqrt(np.diag(found.normal))
    whole = np.linalg.inv(found.normal * np.outer(unit, unit)) * np.outer(unit, unit)
    which = [POSE - 1, UNKNOWNS, UNKNOWNS + 1, 3]  # scale, the two of G, width
    covariance = by @ whole[np.ix_(which, which)] @ by.T
    wider = STROKE_UNIT_MM * float(found.pose[3])
    return Stretch(np.array([E[0, 0], E[1, 1], E[0, 1]]), wider, covariance)
