"""One tactile image as the probe sends it. Thesis 4.2.

Counts are ADC readings and rise with force; row 0 is the top row of the sensor seen
through its back. A frame is a value: its arrays are read-only copies.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probe.errors import FrameError

WRIST = 4  #: transducers of the wrist

MOST_HZ = 10_000.0  #: frames a second of a probe in software; boards reach 500


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """An image with its time, number, wrist readings and, where known, its pose.

    Examples
    --------
    >>> import numpy as np
    >>> frame = frame_from(np.zeros((16, 16), np.uint16), t_ns=0, seq=0)
    >>> frame.counts.shape, frame.counts.dtype.name, frame.seq, frame.pose
    ((16, 16), 'uint16', 0, None)
    """

    counts: NDArray[np.uint16]  #: (rows, columns) counts, of ADC or of the sensor type's unit
    t_ns: int  #: ns; of the device since it started, unwrapped
    seq: int  #: number of the frame, unwrapped; a gap means lost frames
    wrist: NDArray[np.uint16]  #: (4,) ADC counts of the wrist's transducers
    pose: NDArray[np.float64] | None = None  #: (4, 4) T_base_sensor, mm; None if not known


def frame_from(
    counts: ArrayLike,
    *,
    t_ns: int,
    seq: int,
    wrist: ArrayLike | None = None,
    pose: ArrayLike | None = None,
) -> Frame:
    """Return a checked frame of counts (rows, columns), whole numbers 0 ... 65535.

    Time (ns) and number are unwrapped; the wrist (4,) is zeros if not given; `pose` is a (4, 4)
    rigid transform T_base_sensor, mm. Raises FrameError: a shape is wrong, or a value is no count.
    """
    image = _counts(counts, None, "image")
    given = _counts(np.zeros(WRIST, np.uint16) if wrist is None else wrist, (WRIST,), "wrist")
    return Frame(image, int(t_ns), int(seq), given, None if pose is None else _pose(pose))


def median_filter(image: NDArray[Any]) -> NDArray[Any]:
    """Return the median of the 3x3 neighbourhood of each reading; edges are repeated."""
    around = np.lib.stride_tricks.sliding_window_view(np.pad(image, 1, mode="edge"), (3, 3))
    filtered: NDArray[Any] = np.median(around, axis=(2, 3))
    return filtered


def _counts(values: ArrayLike, shape: tuple[int, ...] | None, name: str) -> NDArray[np.uint16]:
    array = np.asarray(values)
    if array.shape != shape and (shape is not None or array.ndim != 2 or array.size == 0):
        wanted = "(rows, columns)" if shape is None else shape
        raise FrameError(
            f"the {name} has shape {array.shape}, it must be {wanted}",
            fix="give one reading per tactel, rows from the top",
        )
    if not np.issubdtype(array.dtype, np.number) or not np.isfinite(array).all():
        raise FrameError(f"the {name} holds values that are no numbers", fix="give ADC counts")
    if (array < 0).any() or (array > 65535).any() or (array != np.floor(array)).any():
        raise FrameError(
            f"the {name} holds {array.min():g} ... {array.max():g}, counts are whole numbers "
            "0 ... 65535",
            fix="give raw ADC counts, not newtons",
        )
    return _freeze(array, np.uint16)


def are_rigid(poses: NDArray[Any]) -> bool:
    """Tell whether poses (n, 4, 4) are rigid transforms, or NaN."""
    known = poses[~np.isnan(poses).all(axis=(1, 2))].astype(np.float64)
    turn = known[:, :3, :3]
    return bool(
        np.isfinite(known).all()
        and np.allclose(turn @ turn.transpose(0, 2, 1), np.eye(3), atol=1e-6)
        and (np.linalg.det(turn) > 0).all()
        and (known[:, 3] == (0, 0, 0, 1)).all()
    )


def _pose(values: ArrayLike) -> NDArray[np.float64]:
    pose = np.asarray(values, dtype=np.float64)
    if pose.shape != (4, 4) or np.isnan(pose).any() or not are_rigid(pose[None]):
        raise FrameError(
            "the pose is no rigid transform", fix="give a 4x4 matrix T_base_sensor, mm"
        )
    return _freeze(pose, np.float64)


def _freeze(values: ArrayLike, dtype: type[np.generic]) -> NDArray[Any]:
    array = np.array(values, dtype=dtype, order="C")
    array.setflags(write=False)
    return array
