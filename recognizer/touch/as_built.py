"""Where a probe stands on a part as it was printed: some per mille smaller, a little askew.

Pose read from the symbols, as if they stood where they were designed + AsBuilt -> pose beside the
printed part, with its covariance. Part frame: that of the part's file, z up from the bed, x and y
along the printer's axes, its origin in the middle of the part. A point p of the design is printed
at S p, S of `print_matrix`: x and y are scaled from that origin, z is as designed. No touch tells
which of the two axes a skewed printer has turned: here x keeps its direction and y leans, as the
skew correction of printer firmware has it (Marlin, M852). mm, rad.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from generator.database.as_built import AsBuilt
from recognizer.touch.settings import DEFAULTS

Array = NDArray[np.float64]


def print_matrix(as_built: AsBuilt) -> Array:
    """Return S (3, 3): a point p of the part's design is printed at S p; z is as designed."""
    sin, cos = math.sin(as_built.skew_rad), math.cos(as_built.skew_rad)
    scale_x, scale_y = as_built.scale_x, as_built.scale_y
    return np.array([[scale_x, scale_y * sin, 0.0], [0.0, scale_y * cos, 0.0], [0.0, 0.0, 1.0]])


def print_of(prints: Sequence[AsBuilt], part: str, printer: str) -> AsBuilt | None:
    """Return what is known of a part: as it was touched, else as its printer prints.

    None where nothing is, or where the printer is known with several materials: which of them
    the part is made of no database says.

    Parameters
    ----------
    prints
        Of the part's object, and of printers (`object_id` None).
    """
    for one in prints:
        if one.object_id is not None and one.part == part:
            return one
    alike = [one for one in prints if one.object_id is None and one.printer == printer]
    return alike[0] if len(alike) == 1 else None


@dataclass(frozen=True, slots=True, eq=False)
class PrintedFace:
    """A flat face of a part of which it is known how it was printed."""

    as_built: AsBuilt
    T_part_face: Array  #: (4, 4), mm

    def pose(self, T_face_probe: Array, covariance: Array) -> tuple[Array, Array]:
        """Return pose and covariance on the printed part, in the face frame of the design.

        Parameters
        ----------
        T_face_probe
            (4, 4) as it was read.
        covariance
            (3, 3) of x, y (mm) and the turn about z (rad).

        Notes
        -----
        B, the face's x and y axes in the part frame, is printed as S B = Q U, Q orthonormal and U
        symmetric. The reader fits a turned and scaled lattice to what is turned and stretched,
        which finds the turn against Q, whatever U.
        """
        printed = self._printed(self.as_built, T_face_probe)
        at, step = _planar(printed), DEFAULTS.printed.step
        slopes = []
        for name in ("scale_x", "scale_y", "skew_rad"):
            changed = replace(self.as_built, **{name: getattr(self.as_built, name) + step})
            slopes.append((_planar(self._printed(changed, T_face_probe)) - at) / step)
        by_print = np.column_stack(slopes)
        along = np.eye(3)
        R = self.T_part_face[:3, :3]
        along[:2, :2] = (R.T @ print_matrix(self.as_built) @ R)[:2, :2]
        told = along @ covariance @ along.T
        return printed, told + by_print @ self.as_built.covariance[:3, :3] @ by_print.T

    def _printed(self, as_built: AsBuilt, T_face_probe: Array) -> Array:
        S, R = print_matrix(as_built), self.T_part_face[:3, :3]
        left, _, right = np.linalg.svd(S @ R[:, :2], full_matrices=False)
        Q = left @ right
        T_part_probe = np.eye(4)
        axes = np.column_stack([Q, np.cross(Q[:, 0], Q[:, 1])])
        T_part_probe[:3, :3] = axes @ T_face_probe[:3, :3]
        at = R @ T_face_probe[:3, 3] + self.T_part_face[:3, 3]
        T_part_probe[:3, 3] = S @ at
        T_face_part = np.eye(4)
        T_face_part[:3, :3] = R.T
        T_face_part[:3, 3] = -R.T @ self.T_part_face[:3, 3]
        return np.asarray(T_face_part @ T_part_probe)


def _planar(T: Array) -> Array:
    """Return x, y and the turn about z of a pose (4, 4)."""
    return np.array([T[0, 3], T[1, 3], math.atan2(T[1, 0], T[0, 0])])
