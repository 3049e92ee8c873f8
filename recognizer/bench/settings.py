"""Numbers that decide at the bench: when a touch is read, what is given up, how much is kept.

One frozen value a stage; limits of requests stand in `guard.AccessRules`.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class TriggerSettings:
    """When a touch is worth reading."""

    steady: float = 0.15
    """Share of the forces that may change from frame to frame; noise alone changes 0.1."""
    changed: float = 0.35
    """Share by which a read touch differs from a new one, whatever their strength."""
    restless_s: float = 0.3  #: after so long a touch is read although it moves
    again_s: float = 0.4  #: after so long a touch that was not answered is read again


@dataclass(frozen=True, slots=True)
class RecognitionSettings:
    """How much the thread that reads keeps."""

    faces: int = 24  #: mosaics that are kept
    touches: int = 300  #: of one mosaic; more cost time and show nothing new


@dataclass(frozen=True, slots=True)
class ScanModeSettings:
    """What is told of a belief."""

    told: int = 4  #: likeliest places of a step
    kept: int = 60  #: newest steps


@dataclass(frozen=True, slots=True)
class SensorDeskSettings:
    """How much is learned from."""

    most: int = 200  #: newest touches; `recognize-object --learn` takes as many of a recording


@dataclass(frozen=True, slots=True)
class UploadSettings:
    """Recordings that are sent in; how long one may be stands in `guard.AccessRules`."""

    at_once: int = 2
    silent_s: float = 15.0  #: without a byte of one that comes it is given up
    quota: int = 2 * 1024**3  #: bytes of all recordings in the folder; beyond, none is taken


@dataclass(frozen=True, slots=True)
class SessionSettings:
    """How often the session looks about."""

    wait_s: float = 0.05  #: of the thread for a frame
    status_s: float = 0.25  #: between two reports
    notices: int = 40  #: that are kept for the page
    retry_s: float = 1.0  #: after a probe went away for good
    silent_s: float = 0.6  #: without a frame a probe is gone
    idle_s: float = 5.0  #: without page, recording and calibration the probe is let go
    calibration_s: tuple[float, float] = (0.2, 60.0)  #: to read one load


@dataclass(frozen=True, slots=True)
class ReplaySettings:
    """How recordings are played."""

    at_once: int = 512  #: frames taken at a time
    points: int = 800  #: of the time line's picture
    most_frames: int = 2_000_000  #: of a recording that is played, or sent in
    most_values: int = 1 << 30  #: of its images: twice as many as 2,000,000 of 16 x 16 have
    faint: float = 2048.0  #: counts of all tactels; a recording of noise alone looks like one
    jump_s: float = 0.5  #: longer pauses in a recording are shortened to it


@dataclass(frozen=True, slots=True)
class PressSettings:
    """How the simulated probe comes down, and what it is spared."""

    steps: tuple[float, ...] = (0.5,)  #: shares of the force on the way down, a frame each
    apart_s: float = 0.08  #: between two touches
    loaded_s: float = 0.1  #: that a load is on before it counts as put on
    unread_s: float = 5.0  #: the longest that is waited for it
    largest_n: float = 400.0  #: of a touch; a load may be ten times as large
    scenes: int = 32  #: surfaces that are kept
    unplugged_s: float = 60.0  #: at most


@dataclass(frozen=True, slots=True)
class LineSettings:
    """The serial line of the simulated probe."""

    wait_s: float = 0.005  #: of the probe for its next frame, and so of a command for its answer
    idle_s: float = 0.05  #: the same where no frames are wanted
    at_once: int = 4096  #: bytes read
    lost: int = 65536  #: bytes that wait for a reader; more are thrown away, as on a real line


@dataclass(frozen=True, slots=True)
class ExampleSettings:
    """What the example of an empty lab may cost."""

    longest_s: float = 120.0  #: to make it


@dataclass(frozen=True, slots=True)
class DatabaseSettings:
    """How the page reads the database."""

    wait_s: float = 2.0  #: for others to end; then the page is told who keeps it waiting
    promise_s: float = 60.0  #: that `encode-object show` may take
    promises: int = 512  #: objects whose promises are kept


@dataclass(frozen=True, slots=True)
class PageSettings:
    """What pages may ask of the live line, and how much they get."""

    pages: int = 80  #: open at once; 64 that never read leave room for those that do
    connections: int = 900  #: open at once, below the files that a process may have open
    silent_s: float = 5.0  #: that a connection may take for its first request
    message: int = 1024  #: bytes of a message from a page
    mosaic: int = 512  #: rows or columns of a mosaic that is sent; beyond, cells are left out
    listed: int = 200  #: files of a kind that are offered


@dataclass(frozen=True, slots=True)
class TouchLogSettings:
    """What is kept of the touches of a session."""

    kept: int = 1000  #: newest touches
    name: int = 80  #: characters that a touch's name may have


TRIGGER, RECOGNITION, SESSION = TriggerSettings(), RecognitionSettings(), SessionSettings()
TOUCHES, SCAN, DESK = TouchLogSettings(), ScanModeSettings(), SensorDeskSettings()
REPLAY, PRESS = ReplaySettings(), PressSettings()
LINE, PAGE, UPLOAD = LineSettings(), PageSettings(), UploadSettings()
EXAMPLE, DATABASE = ExampleSettings(), DatabaseSettings()
