"""What a recording holds: datasets, attributes, version, and blocks of its frames.

::

    /frames  u16 (N, rows, columns)   counts, row 0 on top
    /t_ns    i64 (N,)          device time, unwrapped, ns
    /seq     i64 (N,)          number of the frame, unwrapped
    /wrist   u16 (N, 4)        ADC counts of the wrist's transducers
    /pose    f64 (N, 4, 4)     T_base_sensor, mm; NaN where not known (dataset optional)

    attributes: format, format_version, tool_version, sensor, sensor_type (as YAML; none in
    recordings of old), calibration (hash; empty: none), units, piece (number in a series,
    from 1), and what the writer adds

Any HDF5 file with counts (N, rows, columns) in /frames is a recording; without /seq frames are
numbered from 0, without /t_ns they come at 220 a second. Datasets are chunked and compressed by
shuffle and deflate, in the file format of HDF5 1.10, whose metadata have checksums.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.errors import without_password
from encoded_objects.base.sensor_type import SensorType
from probe.frame import WRIST, Frame

FORMAT: Final = "tactile recording"
FORMAT_VERSION: Final = 1
NOMINAL_HZ: Final = 220.0  #: of the frames of a file that tells no time
CHUNK: Final = 64  #: frames that are compressed together

#: name: shape of one entry (-1: any length), type in the file
DATASETS: Final[Mapping[str, tuple[tuple[int, ...], np.dtype[Any]]]] = MappingProxyType(
    {
        "frames": ((-1, -1), np.dtype("<u2")),
        "t_ns": ((), np.dtype("<i8")),
        "seq": ((), np.dtype("<i8")),
        "wrist": ((WRIST,), np.dtype("<u2")),
        "pose": ((4, 4), np.dtype("<f8")),
    }
)


@dataclass(frozen=True, slots=True)
class RecordingOrigin:
    """Where the frames of a recording come from."""

    sensor: str = ""  #: ident of the probe, or what was simulated
    calibration: str = ""  #: hash of the calibration file; empty: none
    units: str = "counts"
    sensor_type: str = ""  #: as YAML, `sensor_type_text`; empty: not known
    more: MappingProxyType[str, Any] = field(default_factory=lambda: MappingProxyType({}))

    def __post_init__(self) -> None:
        """Keep no password, also of a recording that has one."""
        more = {
            name: without_password(value) if isinstance(value, str) else value
            for name, value in self.more.items()
        }
        object.__setattr__(self, "more", MappingProxyType(more))

    def texts(self) -> dict[str, str]:
        """Return the fields that are texts, by their names, as `of_texts` takes them."""
        return {name: getattr(self, name) for name in _TEXTS}

    @classmethod
    def of_texts(cls, said: Mapping[str, Any], more: Mapping[str, Any]) -> RecordingOrigin:
        """Return the origin that a file tells; what it leaves out is as by default."""
        texts = {name: str(said[name]) for name in _TEXTS if name in said}
        return cls(**texts, more=MappingProxyType(dict(more)))


_TEXTS: Final = ("sensor", "calibration", "units", "sensor_type")


def json_value(value: Any) -> Any:
    """Return an attribute that JSON does not know as one that it does (`default` of `json`)."""
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else str(value)


@dataclass(frozen=True, slots=True, eq=False)
class FrameBlock:
    """Consecutive frames of a recording; arrays are read-only."""

    counts: NDArray[np.uint16]  #: (n, rows, columns)
    t_ns: NDArray[np.int64]  #: (n,)
    seq: NDArray[np.int64]  #: (n,)
    wrist: NDArray[np.uint16]  #: (n, 4)
    pose: NDArray[np.float64] | None  #: (n, 4, 4) T_base_sensor, mm; NaN where not known

    def __len__(self) -> int:
        return len(self.counts)

    @classmethod
    def empty(cls, shape: tuple[int, int] = SensorType().shape) -> FrameBlock:
        """Return a block without frames."""
        images, readings = np.empty((0, *shape), np.uint16), np.empty((0, WRIST), np.uint16)
        return cls(images, np.empty(0, np.int64), np.empty(0, np.int64), readings, None)

    def datasets(self) -> dict[str, NDArray[Any]]:
        """Return the arrays under the names that they have in a file; `pose` where it is known."""
        arrays = (self.counts, self.t_ns, self.seq, self.wrist, self.pose)
        named = zip(DATASETS, arrays, strict=True)
        return {name: array for name, array in named if array is not None}

    def frozen(self) -> FrameBlock:
        """Make the arrays read-only, and return the block."""
        for array in self.datasets().values():
            array.setflags(write=False)
        return self

    def frame(self, i: int) -> Frame:
        """Return frame `i` of the block, a view on its arrays."""
        pose = None if self.pose is None or np.isnan(self.pose[i, 0, 0]) else self.pose[i]
        return Frame(self.counts[i], int(self.t_ns[i]), int(self.seq[i]), self.wrist[i], pose)


def block_of(frames: Sequence[Frame]) -> FrameBlock:
    """Return frames as a block; with poses if any frame has one."""
    unknown = np.full((4, 4), np.nan)
    poses = [unknown if frame.pose is None else frame.pose for frame in frames]
    return FrameBlock(
        np.stack([frame.counts for frame in frames]),
        np.array([frame.t_ns for frame in frames], np.int64),
        np.array([frame.seq for frame in frames], np.int64),
        np.stack([frame.wrist for frame in frames]),
        np.stack(poses) if any(frame.pose is not None for frame in frames) else None,
    )


def join_blocks(blocks: Sequence[FrameBlock], shape: tuple[int, int]) -> FrameBlock:
    """Return consecutive blocks as one; without any, an empty one of images of that shape."""
    if len(blocks) < 2:
        return blocks[0] if blocks else FrameBlock.empty(shape)
    poses = [np.full((len(b), 4, 4), np.nan) if b.pose is None else b.pose for b in blocks]
    known = any(block.pose is not None for block in blocks)
    arrays = zip(*((b.counts, b.t_ns, b.seq, b.wrist) for b in blocks), strict=True)
    counts, t_ns, seq, wrist = map(np.concatenate, arrays)
    pose = np.concatenate(poses) if known else None
    return FrameBlock(counts, t_ns, seq, wrist, pose).frozen()


@dataclass(frozen=True, slots=True)
class FrameFile:
    """An open file of frames, HDF5 or a journal."""

    origin: RecordingOrigin
    own: bool  #: written by this programme
    closed: bool  #: its writer closed it, and its end is there
    tool_version: str
    piece: int  #: number in its series, from 1
    lengths: Mapping[str, int]  #: of its datasets
    shape: tuple[int, int]  #: rows and columns of its images
    poses: bool  #: frames in it may have a pose
    read: Callable[[int, int], FrameBlock]
    """Return and check frames `start` ... `stop` - 1; RecordingError where the file is damaged, or
    a value is no count, time, number or pose. A dataset that ends before /frames is continued:
    times at its rate, numbers by one, no wrist and no pose."""

    @property
    def frames(self) -> int:
        """The frames with everything that belongs to them."""
        return min(self.lengths.values())

    @property
    def even(self) -> bool:
        """Whether all datasets have one length."""
        return len(set(self.lengths.values())) == 1

    def blocks(self) -> Iterator[FrameBlock]:
        """Yield all frames, many whole chunks at a time; see `read`."""
        tactels = self.shape[0] * self.shape[1]
        size = CHUNK * max(1, min(16, (1 << 24) // (CHUNK * tactels)))
        for start in range(0, self.frames, size):
            yield self.read(start, min(start + size, self.frames))
