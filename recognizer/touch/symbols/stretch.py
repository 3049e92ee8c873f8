"""How the lattice of one touch is stretched: its scale both ways, its skew, its stroke width.

A fit whose symbols are known + image -> Stretch. The reader fits one scale of the lattice; a
print may be longer one way than the other, and its axes need not stand at right angles. A sensor
point s then lies at A s + (x, y) in the lattice frame, A = (1 + e) R(theta) G with G = [[1 + a,
c], [c, 1 - a]]: two unknowns more than `refine` has, found with all the others by damped least
squares on the image. Of scale and stroke width nothing is taken as known beforehand, so that
many touches average to what was printed. mm, sensor and lattice frame.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from recognizer.touch.symbols.damped import ascend, damped_step
from recognizer.touch.symbols.gain import Image, bounded_gain
from recognizer.touch.symbols.projection import Shown
from recognizer.touch.symbols.refine import POSE, linearize_image
from recognizer.touch.symbols.template import ResponseTemplate

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Stretch:
    """How one touch felt the print."""

    strain: Array  #: (3,) xx, yy and xy of (F'F - 1) / 2, F from the lattice to the print
    wider_mm: float  #: strokes, than asked
    covariance: Array  #: (4, 4) of strain and wider_mm, as the image tells it


@dataclass(frozen=True, slots=True)
class _StretchedLattice:
    """One lattice, as a stack of one: what `damped.ascend` moves."""

    pose: Array  # (1, 7)
    gain: Array  # (1, 4)
    stretch: Array  # (1, 2) a and c of G
    value: Array  # (1,)
    normal: Array  # (1, 13, 13)
    right: Array  # (1, 13)


def fit_stretch(
    image: Image, template: ResponseTemplate, pose: Array, gain: Array, shown: Shown
) -> Stretch:
    """Return how the lattice under a touch is stretched.

    Parameters
    ----------
    pose, gain
        (7,) and (4,) of the fit, to begin with.
    shown
        What the cells show.
    """
    settings = image.settings.stretch
    prior = (*image.settings.refine.prior[:3], 0.0, *image.settings.refine.prior[4:6], 0.0)
    refine = replace(image.settings.refine, prior=prior)
    free = replace(image, settings=replace(image.settings, refine=refine))
    least = np.array([*refine.least, *settings.least])
    most = np.array([*refine.step, *settings.step])
    limits = np.array([settings.widest, *refine.limits[1:3], settings.largest])

    def moved(at: _StretchedLattice, damping: Array) -> _StretchedLattice:
        step = np.clip(damped_step(at, damping, least), -most, most)
        pose, gain = at.pose + step[:, :POSE], at.gain + step[:, POSE : POSE + 4]
        pose[:, 3:] = np.clip(pose[:, 3:], -limits, limits)
        gain[:, 1] = np.clip(gain[:, 1], refine.shallower * at.gain[:, 1], refine.deepest)
        gain = bounded_gain(gain, image.settings.gain.steepest)
        stretch = np.clip(at.stretch + step[:, POSE + 4 :], -settings.largest, settings.largest)
        return _evaluate(free, template, pose, gain, stretch, shown)

    start = _evaluate(free, template, pose[None], gain[None], np.zeros((1, 2)), shown)
    found = ascend(start, moved, settings.steps, refine, settings.settled)
    return _stretch_of(found, image.settings.template.wider_mm)


def _evaluate(
    image: Image, template: ResponseTemplate, pose: Array, gain: Array, stretch: Array, shown: Shown
) -> _StretchedLattice:
    points = image.points_mm
    (a, c), turn = stretch[0], float(pose[0, 2])
    stretched = replace(image, points_mm=points @ np.array([[1 + a, c], [c, 1 - a]]))
    at = linearize_image(stretched, template, pose, gain, shown)
    cos, sin, scale = math.cos(turn), math.sin(turn), 1 + float(pose[0, 6])
    across, up = at.jacobian[0, :, 0], at.jacobian[0, :, 1]  # by x and y of the lattice
    along_x = (across * cos + up * sin) * scale  # and of the sensor
    along_y = (up * cos - across * sin) * scale
    x, y = points.T
    jacobian = np.column_stack(
        [at.jacobian[0], along_x * x - along_y * y, along_x * y + along_y * x]
    )
    weighted = (jacobian * at.sure[0, :, None]).T
    known, precision = np.append(at.known[0], [0.0, 0.0]), np.append(at.precision, [0.0, 0.0])
    return _StretchedLattice(
        pose=pose,
        gain=gain,
        stretch=stretch,
        value=at.value,
        normal=(weighted @ jacobian + np.diag(precision))[None],
        right=(weighted @ at.left[0] - known * precision)[None],
    )


def _stretch_of(found: _StretchedLattice, unit_mm: float) -> Stretch:
    """Return strain and width of a lattice; the strain turns with the lattice, not the sensor."""
    (a, c), turn = found.stretch[0], float(found.pose[0, 2])
    cos, sin = math.cos(turn), math.sin(turn)
    R = np.array([[cos, -sin], [sin, cos]])
    F = R @ np.linalg.inv(np.array([[1 + a, c], [c, 1 - a]]) * (1 + found.pose[0, 6])) @ R.T
    E = (F @ F - np.eye(2)) / 2
    # d E = -R (de 1 + [[da, dc], [dc, -da]]) R', to first order
    modes = [R @ mode @ R.T for mode in (np.eye(2), np.diag([1.0, -1.0]), np.eye(2)[::-1])]
    by = np.zeros((4, 4))
    by[:3, :3] = -np.array([[M[0, 0], M[1, 1], M[0, 1]] for M in modes]).T
    by[3, 3] = unit_mm
    unit = 1.0 / np.sqrt(np.diag(found.normal[0]))
    whole = np.linalg.inv(found.normal[0] * np.outer(unit, unit)) * np.outer(unit, unit)
    told = [POSE - 1, POSE + 4, POSE + 5, 3]  # scale, the two of G, width
    covariance = by @ whole[np.ix_(told, told)] @ by.T
    wider = unit_mm * float(found.pose[0, 3])
    return Stretch(np.array([E[0, 0], E[1, 1], E[0, 1]]), wider, covariance)
