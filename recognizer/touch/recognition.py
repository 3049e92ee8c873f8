"""The answer: which object, which face, where, and how sure; or why not. Thesis 6.3.

Frames: `T_face_probe` takes the sensor frame to the face frame (origin at the face's first
vertex, x along its first edge, z outward), `T_object_probe` to the object frame; mm.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

NO_CONTACT = "no contact"
TOO_FEW = "too few symbols"
AMBIGUOUS = "ambiguous"
NOT_ENCODED = "not an encoded surface"
OUTSIDE = "outside every face"


@dataclass(frozen=True, slots=True, eq=False)
class RunnerUp:
    """The second-best reading, the one that the margin is measured against."""

    object: str
    face: str
    index: tuple[int, int]


@dataclass(frozen=True, slots=True, eq=False)
class Recognition:
    """What one touch, or several, say."""

    seq: int
    object: str | None  #: None where it does not answer
    face: str | None
    index: tuple[int, int] | None  #: row and column of the array's cell under the sensor's centre
    T_face_probe: NDArray[np.float64] | None  #: (4, 4)
    T_object_probe: NDArray[np.float64] | None  #: (4, 4)
    covariance: NDArray[np.float64] | None  #: (3, 3) of x, y (mm) and the turn about z (rad), face
    margin: float | None  #: log-likelihood ratio to the runner-up, nats
    runner_up: RunnerUp | None
    reason: str  #: "" where it answers
    noise: float | None = None  #: standard deviation of psi that the symbols leave unexplained

    def __bool__(self) -> bool:
        return self.object is not None

    def as_json(self) -> dict[str, Any]:
        """Return the plain values that `recognize-object --json` prints."""
        runner_up = self.runner_up
        return {
            "seq": self.seq,
            "object": self.object,
            "face": self.face,
            "index": None if self.index is None else list(self.index),
            "T_face_probe": _nested(self.T_face_probe),
            "T_object_probe": _nested(self.T_object_probe),
            "covariance": _nested(self.covariance),
            "margin": None if self.margin is None else round(self.margin, 4),
            "runner_up": None
            if runner_up is None
            else {
                "object": runner_up.object,
                "face": runner_up.face,
                "index": list(runner_up.index),
            },
            "reason": self.reason,
        }


def refusal(
    seq: int, reason: str, *, margin: float | None = None, runner_up: RunnerUp | None = None
) -> Recognition:
    """Return the value of a touch that is not answered."""
    return Recognition(seq, None, None, None, None, None, None, margin, runner_up, reason)


def _nested(matrix: NDArray[np.float64] | None) -> list[list[float]] | None:
    return None if matrix is None else [[float(value) for value in row] for row in matrix]
