"""Where a probe stands on a part as it was printed: some per mille smaller, a little askew.

Pose read from the symbols as designed + AsBuilt -> pose on the printed part, with its covariance.
A part that nobody has measured is taken to be a usual print (`usual_print`); each touch measures
the scale as well. Part frame: that of the part's file, z up from the bed, x and y along the
printer's axes, origin in the middle of the part. A point p of the design is printed at S p, S of
`print_matrix`. No touch shows which axis a skewed printer has turned: x keeps its direction and y
leans, as in the skew correction of printer firmware (Marlin, M852). mm, rad.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from generator.database.as_built import AsBuilt
from recognizer.touch.recognition import AS_BUILT, AS_DESIGNED, NOT_MEASURED

Array = NDArray[np.float64]

# How prints come out that nobody has measured: standard deviations. Printers are off by .3 % as a
# rule and .6 % at worst, and backlash and shifted layers move symbols by up to .03 mm
# (`docs/printed.md`).
SCALE_SD = 0.004  #: of the part that both axes have in common
APART_SD = 0.002  #: of the difference between the two
SKEW_SD_RAD = 0.001
UNUSUAL = 6.25  #: times these variances at most, where a touch shows another scale: to one of 1 %
ASIDE_SD_MM = 0.02  #: each way, of the place of symbols, beyond scale and skew
DIFFERENCE = 1e-6  #: of scales and skew, of the differences that stand for derivatives


def print_of(prints: Sequence[AsBuilt], part: str, printer: str) -> AsBuilt | None:
    """Return the print of a part as it was touched, else of its printer; None if neither is known.

    A printer that is known with several materials says nothing of the part. `prints` are those of
    the part's object, and of printers (`object_id` None).
    """
    for one in prints:
        if one.object_id is not None and one.part == part:
            return one
    alike = [one for one in prints if one.object_id is None and one.printer == printer]
    return alike[0] if len(alike) == 1 else None


def usual_print() -> AsBuilt:
    """Return the print of a part that nobody has measured: as designed, within the usual spread."""
    common, apart = SCALE_SD**2, APART_SD**2 / 2
    covariance = np.zeros((4, 4))
    covariance[:2, :2] = common
    covariance[[0, 1, 2], [0, 1, 2]] += apart, apart, SKEW_SD_RAD**2
    return replace(DESIGNED, covariance=covariance)


#: A part that is as its file: a simulated one.
DESIGNED = AsBuilt(
    object_id=None, part=None, printer="", material="", scale_x=1.0, scale_y=1.0, skew_rad=0.0,
    stroke_mm=1.0, covariance=np.zeros((4, 4)), touches=0,
)  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class TouchScale:
    """The scale of a print by one touch, with its covariance with the pose."""

    excess: float  #: lattice over print, less 1
    covariance: Array  #: (4,) with x, y (mm) and the turn (rad) on the face, and its variance
    expected: float  #: standard deviation within which the fit took it to be 0


@dataclass(frozen=True, slots=True, eq=False)
class PrintedFace:
    """A flat face of a part, and what is known of how it was printed."""

    as_built: AsBuilt
    #: (4, 4), mm, but with the origin where a print keeps its place: places on a face are counted
    #: from the middle of its printed symbols, which backlash and layers move with the whole face
    T_part_face: Array

    @property
    def part(self) -> str:
        """What the pose takes the part for, as `Recognition.part` says it."""
        if self.as_built is DESIGNED:
            return AS_DESIGNED
        return AS_BUILT if self.as_built.touches else NOT_MEASURED

    def pose(
        self, T_face_probe: Array, covariance: Array, by_touch: TouchScale | None = None
    ) -> tuple[Array, Array]:
        """Return pose (4, 4) and covariance (3, 3) on the printed part, face frame of the design.

        `covariance` (3, 3) is of x, y (mm) and the turn about z (rad); `by_touch` is the scale
        that the touch shows.

        B, the face's x and y axes in the part frame, is printed as S B = Q U, Q orthonormal and U
        symmetric. The reader fits a turned and scaled lattice to what is turned and stretched,
        which finds the turn against Q, whatever U, and the mean of U's eigenvalues as the scale.
        """
        print_ = scales_and_skew(self.as_built)
        spread = self.as_built.covariance[:3, :3]
        slope, alone = np.zeros(3), covariance
        if by_touch is not None:
            slope = by_touch.covariance[:3] / by_touch.covariance[3]
            alone = covariance - np.outer(slope, by_touch.covariance[:3])
            print_, spread = self._with_scale(print_, spread, by_touch)

        def posed(print_: Array) -> Array:
            S = print_matrix(print_)
            axes, scale = _polar(S @ self.T_part_face[:3, :2])
            moved = T_face_probe
            if by_touch is not None:
                moved = _moved(T_face_probe, slope * (1.0 / scale - 1.0 - by_touch.excess))
            return self._printed(S, axes, moved)

        printed = posed(print_)
        by_print = _slopes(lambda one: _planar(posed(one)), print_, _planar(printed))
        along = np.eye(3)
        R = self.T_part_face[:3, :3]
        along[:2, :2] = (R.T @ print_matrix(print_) @ R)[:2, :2]
        aside = 0.0 if self.as_built is DESIGNED else ASIDE_SD_MM**2
        floor = np.diag([aside, aside, 0.0])
        return printed, along @ alone @ along.T + by_print @ spread @ by_print.T + floor

    def _with_scale(
        self, print_: Array, spread: Array, by_touch: TouchScale
    ) -> tuple[Array, Array]:
        """Return scales and skew updated by the scale of a touch, and their covariance (3, 3)."""
        variance = by_touch.covariance[3]
        precision = 1.0 / variance - 1.0 / by_touch.expected**2  # by the image alone
        if not precision > 0:
            return print_, spread
        excess = self._excess(print_)
        by = _slopes(self._excess, print_, excess)[0]
        away = by_touch.excess / (variance * precision) - float(excess[0])
        gain = spread @ by / (by @ spread @ by + 1.0 / precision)
        found, usual = print_ + gain * away, float(by @ spread @ by)
        if self.as_built.touches == 0 and usual > 0:
            # No usual print: the spread under which the scale of this touch is likeliest. The pose
            # stays where usual prints have it, the ellipse grows.
            spread = spread * min(max((away**2 - 1.0 / precision) / usual, 1.0), UNUSUAL)
            gain = spread @ by / (by @ spread @ by + 1.0 / precision)
        return found, spread - np.outer(gain, by @ spread)

    def _excess(self, print_: Array) -> Array:
        """Return (1,) lattice over print, less 1, by a touch of the face."""
        return np.array([1.0 / _polar(print_matrix(print_) @ self.T_part_face[:3, :2])[1] - 1.0])

    def _printed(self, S: Array, axes: Array, T_face_probe: Array) -> Array:
        R, ((ax, ay, az), (bx, by, bz)) = self.T_part_face[:3, :3], axes.T.tolist()
        across = (ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx)
        printed = np.array([(ax, ay, az), (bx, by, bz), across]).T  # axes of the face, as printed
        at = S @ (R @ T_face_probe[:3, 3] + self.T_part_face[:3, 3]) - self.T_part_face[:3, 3]
        found = np.eye(4)
        found[:3, :3] = R.T @ printed @ T_face_probe[:3, :3]
        found[:3, 3] = R.T @ at
        return found


def scales_and_skew(as_built: AsBuilt) -> Array:
    """Return what of a print moves places (3,)."""
    return np.array([as_built.scale_x, as_built.scale_y, as_built.skew_rad])


def print_matrix(print_: Array) -> Array:
    """Return S (3, 3) of scales and skew (3,); z is as designed."""
    scale_x, scale_y, skew = print_.tolist()
    sin, cos = math.sin(skew), math.cos(skew)
    return np.array([[scale_x, scale_y * sin, 0.0], [0.0, scale_y * cos, 0.0], [0.0, 0.0, 1.0]])


def _polar(B: Array) -> tuple[Array, float]:
    """Return the orthonormal Q of B = Q U (3, 2), and the mean of the eigenvalues of U.

    U is (B'B + s 1) / t by the Cayley-Hamilton theorem, s^2 the determinant of B'B, t^2 its trace
    and 2 s: L. P. Franca, Comput. Math. Appl. 18 (1989) 459.
    """
    (a, c), (_, b) = (B.T @ B).tolist()
    s = math.sqrt(a * b - c * c)
    t = math.sqrt(a + b + 2.0 * s)
    return B @ np.array([[b + s, -c], [-c, a + s]]) / (t * s), t / 2.0


def _slopes(of: Callable[[Array], Array], at: Array, here: Array) -> Array:
    """Return the derivatives (m, 3) of a function of a print, whose value there is `here` (m,)."""
    return np.array([(of(at + DIFFERENCE * one) - here) / DIFFERENCE for one in np.eye(3)]).T


def _moved(T_face_probe: Array, by: Array) -> Array:
    x, y, turn = by.tolist()
    moved = T_face_probe.copy()
    cos, sin = math.cos(turn), math.sin(turn)
    moved[:2, :3] = np.array([[cos, -sin], [sin, cos]]) @ T_face_probe[:2, :3]
    moved[:2, 3] += x, y
    return moved


def _planar(T: Array) -> Array:
    return np.array([T[0, 3], T[1, 3], math.atan2(T[1, 0], T[0, 0])])
