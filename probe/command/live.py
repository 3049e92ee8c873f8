"""`probe-sensor live`: on a terminal by `rich.live` and keys, elsewhere a line a second.

Frame after frame goes into a `LiveState`, which the keys change; the newest is shown.
The picture is one of characters: heat map at the left, counts at the right. A tactel is a block of
two characters, or, in a terminal that is too low for that, half a character: two rows of tactels
share a line.
"""

from __future__ import annotations

import datetime
import os
import select
import sys
import termios
import time
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from functools import lru_cache
from itertools import groupby
from pathlib import Path
from textwrap import wrap
from threading import Event

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.live import Live
from rich.segment import Segment, Segments
from rich.style import Style

from encoded_objects.base.console import INTERRUPTED, interruption
from encoded_objects.base.errors import MissingExtraError, require, without_password
from encoded_objects.base.files import staged_file
from encoded_objects.base.output import message, write, write_json
from encoded_objects.base.sensor_type import SensorType, choose_sensor_type
from probe.calibration import (
    Calibration,
    calibrate_image,
    calibration_hash,
    drift_of,
    read_calibration,
)
from probe.calibration.load import BIAS_FRAMES
from probe.client import ClientStatistics
from probe.client.client import Client, name_of
from probe.command.options import LiveOptions
from probe.frame import Frame, median_filter
from probe.port.url import typed_port
from probe.protocol import IdentPacket
from probe.recording.files import next_free
from probe.recording.record import Recorder

Image = NDArray[np.float64]

_HOLD = 0.98  #: share of the scale that is left after each frame shown
_LEAST = {"counts": 32.0, "N": 0.2}  # scale of a sensor at rest


@dataclass(slots=True)
class LiveState:
    """A mutable value: one view, one operator."""

    url: str
    folder: Path
    calibration: Calibration | None = None
    sensor: SensorType | None = None  #: None: as the first frame tells
    frame: Frame | None = None  #: newest
    paused: bool = False
    median: bool = False
    bias: Image | None = None  #: counts; None: not taken
    scale: float = 0.0  #: reading of the brightest colour
    notice: str = ""
    recorder: Recorder | None = None
    _resting: list[NDArray[np.uint16]] | None = field(default=None)

    @property
    def unit(self) -> str:
        """N with a calibration, else counts."""
        return "counts" if self.calibration is None else "N"

    @property
    def taking_bias(self) -> bool:
        """Whether frames are being gathered for the bias."""
        return self._resting is not None

    def take(self, frames: list[Frame]) -> None:
        """Take the next frames: record them, and show the last.

        Raises RecordingError: the disk is full, the recording is closed; SensorTypeError: the first
        frame is of another shape than the type.
        """
        if frames and self.frame is None:
            rows, columns = frames[0].counts.shape
            self.sensor = choose_sensor_type(self.sensor, "", (rows, columns), self.url)
        for frame in frames:
            if self.recorder is not None:
                self.recorder.append(frame)
            if self._resting is not None:
                self._resting.append(frame.counts)
                if len(self._resting) == BIAS_FRAMES:
                    self._settle_bias()
        if frames and not self.paused:
            self.frame = frames[-1]

    def image(self) -> Image | None:
        """Return the image that is shown, (rows, columns); None before the first frame."""
        if self.frame is None:
            return None
        if self.calibration is not None:
            image = calibrate_image(self.frame, self.calibration).values
        else:
            image = self.frame.counts.astype(np.float64)
            if self.bias is not None:
                image = np.maximum(image - self.bias, 0.0)
        if self.median:
            image = median_filter(image)
        if not self.paused:
            self.scale = max(float(image.max()), self.scale * _HOLD, _LEAST[self.unit])
        return image

    def toggle_bias(self) -> None:
        """Begin to take the bias, or do without it."""
        if self.bias is None and self._resting is None:
            self._resting = []
            self.notice = "taking the bias: keep the sensor unloaded"
        else:
            self.drop_bias()
            self.notice = "bias off"

    def drop_bias(self) -> None:
        """Do without a bias: it was another sensor's, or is not wanted."""
        self.bias = self._resting = None

    def toggle_recording(self, sensor: str) -> None:
        """Start a recording, or end it."""
        if self.recorder is not None:
            self.end_recording()
            return
        known = self.calibration
        path = next_free(self.folder, "live", ".h5")
        self.recorder = Recorder(
            path, sensor=sensor, sensor_type=self.sensor,
            calibration=calibration_hash(known) if known else "",
            attributes={"url": self.url}
        )  # fmt: skip
        self.notice = f"recording {path.name}"

    def end_recording(self) -> None:
        """End the recording if there is one; its file is complete."""
        if self.recorder is not None:
            recorder, self.recorder = self.recorder, None
            recorder.close()
            files = ", ".join(file.name for file in recorder.files)
            self.notice = f"{files}: {recorder.frames:,} frames"

    def save(self) -> None:
        """Save the image that is shown, and its counts as an array."""
        image = self.image()
        if image is None or self.frame is None:
            return
        try:
            require("matplotlib", extra="report", purpose="a picture")
        except MissingExtraError as error:
            self.notice = str(error)
            return
        from probe.plot.frame import frame_picture

        picture = next_free(self.folder, "image", ".png")
        title = f"frame {self.frame.seq}" + (", median of 3x3" if self.median else "")
        if self.bias is not None:
            title += ", less bias"
        array = picture.with_suffix(".npy")
        with staged_file(picture) as draft:
            frame_picture(image, draft, unit=self.unit, title=title, sensor=self.sensor)
        with staged_file(array) as draft:
            np.save(draft, self.frame.counts)
        self.notice = f"saved {picture.name} and .npy"

    def age(self) -> str:
        """Return how old the calibration is, in words."""
        if self.calibration is None:
            return "none"
        try:
            made = datetime.datetime.fromisoformat(self.calibration.made)
        except ValueError:
            return self.calibration.made or "not dated"
        now = datetime.datetime.now(made.tzinfo)
        days = (now - made).total_seconds() / 86400
        return f"{days:.0f} days old" if days >= 2 else f"{24 * days:.0f} h old"

    def _settle_bias(self) -> None:
        frames, self._resting = np.stack(self._resting or []), None
        self.bias = frames.mean(axis=0)
        self.notice = f"bias of {BIAS_FRAMES} frames is off the image"
        if self.calibration is not None:
            self.bias = None  # a calibration has its own
            drift = drift_of(self.calibration, frames)
            self.notice = drift.warning or "the bias is that of the calibration"


LEVELS = 64
AROUND = 6  #: lines of the view besides those of the image; in fewer a tactel is half a character
KEYS = "q quit  space pause  0-7 sensor  b bias  m median  s save  r record"
#: black, violet, red, orange, pale yellow: rises in brightness, also without hue
_ANCHORS = ((8, 6, 16), (74, 12, 107), (165, 44, 96), (237, 105, 37), (251, 180, 26),
            (252, 255, 164))  # fmt: skip
SHADES = " .:-=+*#%@"
UPPER_HALF = "\u2580"  # its foreground stands over its background
GAP = 3  # characters
BOLD, DIM, YELLOW, RED = map(Style.parse, ("bold", "dim", "yellow", "bold red"))
_PICTURES_HZ = 15
KeyReader = Callable[[float], str]
"""Returns the keys typed within so many seconds, as soon as one is."""


def watch(options: LiveOptions) -> int:
    """Show a probe until the operator quits, a recording ends, or the time is over.

    Raises PortError: the probe is not there, or went away for good; CalibrationError,
    SensorTypeError: none, or of another sensor.
    """
    url, calibration, seconds = options.url, options.calibration, options.seconds
    known = None if calibration is None else read_calibration(calibration)
    port, kind = typed_port(url, options.sensor_type)
    state = LiveState(url, options.folder, known, kind)
    with interruption() as interrupted, Client(port, sensor=options.sensor) as client:
        try:
            if known is not None and calibration is not None:
                read_calibration(calibration, sensor=name_of(client.wait_for_ident(), url) or None)
            until_s = time.monotonic() + (float("inf") if seconds is None else seconds)
            if sys.stdout.isatty() and not options.as_json:
                return _on_terminal(state, client, interrupted, until_s)
            return _in_lines(state, client, interrupted, until_s, as_json=options.as_json)
        finally:
            state.end_recording()


def _on_terminal(state: LiveState, client: Client, interrupted: Event, until_s: float) -> int:
    console = Console(highlight=False)
    colours = console.color_system is not None and not console.no_color
    said: list[str] = []  # what a key has done since the last picture: nothing may hide it
    with _keys() as pressed, Live(console=console, screen=True, auto_refresh=False) as view:
        while not (interrupted.is_set() or client.ended) and time.monotonic() < until_s:
            state.take(client.take(0.0))
            if notices := client.notices():
                state.notice = "; ".join([*said, *notices[-3:]])
            counts, ident = client.statistics(), client.ident
            height = console.size.height
            picture = render_frame(state, counts, ident, height=height, colours=colours)
            view.update(picture, refresh=True)
            shown = state.notice
            if not _obey(state, client, pressed):
                break
            said = [state.notice] if state.notice != shown else []
    return 0


def _obey(state: LiveState, client: Client, pressed: KeyReader) -> bool:
    """Wait for the next picture's time, do what the keys say; False to quit."""
    actions: dict[str, Callable[[], None]] = {
        "b": state.toggle_bias,
        "s": state.save,
        "r": lambda: state.toggle_recording(name_of(client.ident, state.url)),
    }
    for key in pressed(1 / _PICTURES_HZ):
        if key == "q":
            return False
        if key == " ":
            state.paused = not state.paused
        elif key == "m":
            state.median = not state.median
        elif key in "01234567":
            client.select_sensor(int(key))
            state.drop_bias()
            state.notice = f"sensor {key}"
        elif key in actions:
            actions[key]()
    return True


def _in_lines(
    state: LiveState, client: Client, interrupted: Event, until_s: float, *, as_json: bool
) -> int:
    due_s = time.monotonic() + 1.0
    while True:
        state.take(client.take(0.1))
        for notice in client.notices():
            message(notice)
        now_s = time.monotonic()
        over = interrupted.is_set() or client.ended or now_s >= until_s
        if over or now_s >= due_s:
            due_s += 1.0
            _report(state, client, as_json=as_json)
        if over:
            return INTERRUPTED if interrupted.is_set() else 0


def _report(state: LiveState, client: Client, *, as_json: bool) -> None:
    counts, image = client.statistics(), state.image()
    if as_json:
        values = {
            "seq": None if state.frame is None else state.frame.seq,
            "peak": None if image is None else float(image.max()),
            "unit": state.unit,
            **asdict(counts),
        }
        write_json(values, line=True)
    else:
        write(line_of(state, counts))
    sys.stdout.flush()


@contextmanager
def _keys() -> Iterator[KeyReader]:
    """Yield a function that returns what is typed; the terminal is put back at the end."""
    if not sys.stdin.isatty():
        yield _no_keys
        return
    descriptor = sys.stdin.fileno()
    before = termios.tcgetattr(descriptor)

    def pressed(timeout_s: float) -> str:
        ready, _, _ = select.select([descriptor], [], [], max(timeout_s, 0.0))
        return os.read(descriptor, 64).decode(errors="ignore") if ready else ""

    tty.setcbreak(descriptor)  # Ctrl-C still interrupts
    try:
        yield pressed
    finally:
        termios.tcsetattr(descriptor, termios.TCSADRAIN, before)


def _no_keys(timeout_s: float) -> str:
    time.sleep(max(timeout_s, 0.0))
    return ""


def render_frame(
    state: LiveState,
    counts: ClientStatistics,
    ident: IdentPacket | None,
    *,
    height: int,
    colours: bool,
) -> Segments:
    """Return the whole view in a terminal of `height` lines.

    Without `colours` readings are characters of rising weight.
    """
    image = state.image()
    if image is None:
        blocks = [[Segment("waiting for frames ...")]]
    else:
        small = height < len(image) + AROUND
        blocks = heat_map(image / state.scale, small=small, colours=colours)
    numbers = _numbers(state, image, counts, ident)[: max(height - 5, 4)]
    wide = max(sum(len(part.text) for part in line) for line in blocks)
    lines = [_head(state)]
    for i in range(max(len(blocks), len(numbers))):
        left = blocks[i] if i < len(blocks) else [Segment(" " * wide)]
        lines.append([*left, Segment(" " * GAP), *(numbers[i] if i < len(numbers) else ())])
    lines += [_legend(state, colours), [Segment(KEYS, DIM)]]
    lines += [[Segment(text, YELLOW)] for text in wrap(state.notice, len(KEYS))]
    return Segments([piece for line in lines for piece in (*line, Segment.line())][:-1])


def heat_map(share: NDArray[np.float64], *, small: bool, colours: bool) -> list[list[Segment]]:
    """Return readings (rows, columns), 0 ... 1 of the scale, as lines of blocks.

    `small`: two rows of tactels a line, without colours the larger of the two.
    """
    if small and len(share) % 2:
        share = np.pad(share, ((0, 1), (0, 0)))
    if not colours:
        shades = np.clip((share * len(SHADES)).astype(int), 0, len(SHADES) - 1)
        wide, rows = (1, np.maximum(shades[::2], shades[1::2])) if small else (2, shades)
        return [[Segment("".join(SHADES[shade] * wide for shade in row))] for row in rows.tolist()]
    levels = np.clip((share * (LEVELS - 1)).round().astype(int), 0, LEVELS - 1)
    above, under = (levels[::2], levels[1::2]) if small else (levels, levels)
    block = UPPER_HALF if small else "  "
    return [
        [Segment(block * len(list(equal)), _style(*pair))
         for pair, equal in groupby(zip(*rows, strict=True))]
        for rows in zip(above.tolist(), under.tolist(), strict=True)
    ]  # fmt: skip


def line_of(state: LiveState, counts: ClientStatistics) -> str:
    """Return the view in one line, where there is no terminal."""
    image = state.image()
    if image is None:
        return "waiting for frames"
    return (
        f"frame {state.frame.seq if state.frame else 0}  {counts.rate:.1f}/s  "
        f"lost {counts.lost}  failed {counts.failed}  reboots {counts.reboots}  "
        f"peak {_reading(float(image.max()), state.unit)} at {_place(image)}"
    )


def _head(state: LiveState) -> list[Segment]:
    head = [Segment("probe-sensor  ", BOLD)]
    if state.recorder is not None:
        recorded = f"{state.recorder.path.name}, {state.recorder.frames:,} frames  "
        head += [Segment("REC ", RED), Segment(recorded)]
    if state.paused:
        head += [Segment("PAUSED  ", RED)]
    return [*head, Segment(without_password(state.url))]


def _numbers(
    state: LiveState,
    image: NDArray[np.float64] | None,
    counts: ClientStatistics,
    ident: IdentPacket | None,
) -> list[list[Segment]]:
    name = "..." if ident is None else f"{ident.sensor} of {ident.name}, {ident.bits} bits"
    chosen = [word for word, on in (("bias off the image", state.bias is not None),
                                    ("taking bias", state.taking_bias),
                                    ("median 3x3", state.median)) if on]  # fmt: skip
    trouble = ("lost", "failed", "reboots", "reopenings", "overruns")
    counted = {title: f"{getattr(counts, title):,}" for title in trouble}
    rows = {"rate": f"{counts.rate:.1f} frames/s", "frames": f"{counts.frames:,}", **counted}
    rows |= {"sensor": name, "calibration": state.age()}
    if image is not None:
        rows["peak"] = f"{_reading(float(image.max()), state.unit)} at {_place(image)}"
        rows["sum"] = _reading(float(image.sum()), state.unit)
    rows["filter"] = ", ".join(chosen) or "none"
    return [
        [Segment(f"{title:<13}", DIM),
         Segment(value, YELLOW if title in trouble and value != "0" else None)]
        for title, value in rows.items()
    ]  # fmt: skip


def _legend(state: LiveState, colours: bool) -> list[Segment]:
    scale = [Segment(SHADES)]
    if colours:
        scale = [Segment(" ", _style(level, level)) for level in range(0, LEVELS, 4)]
    return [Segment("0 "), *scale, Segment(f" {_reading(state.scale, state.unit)}")]


def _reading(value: float, unit: str) -> str:
    return f"{value:,.2f} N" if unit == "N" else f"{value:,.0f} counts"


def _place(image: NDArray[np.float64]) -> str:
    row, column = divmod(int(image.argmax()), image.shape[1])
    return f"({row}, {column})"


@lru_cache(maxsize=LEVELS * LEVELS)
def _style(upper: int, lower: int) -> Style:
    """Return the colours of a block: foreground of the upper level, background of the lower."""
    return Style(color=_colour(upper), bgcolor=_colour(lower))


def _colour(level: int) -> str:
    at = level / (LEVELS - 1) * (len(_ANCHORS) - 1)
    low = min(int(at), len(_ANCHORS) - 2)
    channels = [
        round(a + (at - low) * (b - a))
        for a, b in zip(_ANCHORS[low], _ANCHORS[low + 1], strict=True)
    ]
    return "#{:02x}{:02x}{:02x}".format(*channels)
