"""Touches -> answers, each printed as it comes; the pictures of a recording at its end."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from threading import Event
from typing import Any

from encoded_objects.console import FAILED, INTERRUPTED
from encoded_objects.console.files import refuse_taken, staged, taken
from encoded_objects.console.interruption import interruption
from encoded_objects.console.output import message, warning, write_json
from encoded_objects.console.progress import ProgressBar, progress_bar
from encoded_objects.errors import require
from probe.frame import Frame
from probe.recording.read import Recording
from probe.sensor import SensorType
from recognizer.command import report
from recognizer.command.in_base import object_in_base
from recognizer.command.port import listen, source_at
from recognizer.touch.contacts import TouchImage
from recognizer.touch.lab import Lab, open_lab
from recognizer.touch.reader import Reader
from recognizer.touch.recognition import Recognition
from recognizer.touch.robot import ObjectPose
from recognizer.touch.source import TouchSource, source_of


@dataclass(frozen=True, slots=True)
class RecognizeOptions:
    """What the command line says; see `app`."""

    recording: Path | None
    port: str
    database: str
    follow: bool
    every: bool
    most: int | None
    overlay: str
    calibration: Path | None
    sensor: int | None
    live: bool
    joints_deg: tuple[float, ...] | None
    joint_error_deg: float
    plot: Path | None
    replace: bool
    as_json: bool


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """A touch and what it says."""

    touch: TouchImage
    found: Recognition
    in_base: ObjectPose | None


def recognize_touches(options: RecognizeOptions) -> int:
    """Read touches and print answers; returns the exit code.

    Raises
    ------
    RecordingError, PortError, CalibrationError
        What is read cannot be read.
    DatabaseError, LabError
        The database cannot be read, or holds no encoded object.
    """
    if options.plot is not None:
        _refuse_pictures(options.plot, replace=options.replace)
    with interruption() as interrupted:
        lab = open_lab(options.database)
        if options.recording is not None:
            recording = Recording(options.recording, live=options.live)
            source = source_of(
                recording, SensorType(), overlay=options.overlay,
                calibration=options.calibration, every=options.every,
            )  # fmt: skip
            reader = _reader(lab, source)
            return _print_answers(options, reader, source, recording.frames(), interrupted)
        source = source_at(
            options.port, overlay=options.overlay, calibration=options.calibration,
            every=options.every,
        )  # fmt: skip
        reader = _reader(lab, source)  # before frames come
        with listen(source, interrupted, options.sensor, options.calibration) as frames:
            return _print_answers(options, reader, source, frames, interrupted)


def _reader(lab: Lab, source: TouchSource) -> Reader:
    if source.notice:
        warning(source.notice)
    return Reader(lab, source.sensor)


def _until(interrupted: Event, frames: Iterator[Frame]) -> Iterator[Frame]:
    for frame in frames:
        if interrupted.is_set():
            return
        yield frame


def _print_answers(
    options: RecognizeOptions,
    reader: Reader,
    source: TouchSource,
    frames: Iterator[Frame],
    interrupted: Event,
) -> int:
    """Answer and print all touches; returns the exit code."""
    out = sys.stdout  # a bar would take it for its terminal
    values: list[dict[str, Any]] = []
    kept: list[Answer] = []
    read = answered = 0
    lines = options.as_json and options.follow
    with ExitStack() as stack:
        bar = None
        if options.as_json or not out.isatty():  # otherwise the answers show how far it is
            bar = stack.enter_context(progress_bar("reading", source.frames))
            frames = _show_count(frames, bar)
        for answer in _answers(options, reader, source, frames, interrupted):
            read += 1
            answered += bool(answer.found)
            if options.plot is not None:
                if options.follow:
                    _draw(reader, source, answer, options.plot)
                else:
                    kept.append(answer)
            if not options.as_json:
                out.write(report.sentence(answer.touch, answer.found, answer.in_base) + "\n")
                out.flush()
                continue
            entry = report.entry(answer.touch, answer.found, answer.in_base)
            if lines:
                write_json(entry, line=True)
                out.flush()
            else:
                values.append(entry)
    if options.plot is not None and kept:
        _draw_all(reader, source, kept, options.plot, interrupted)
    if options.as_json and not lines:
        write_json(values)
    elif read != 1:
        message(report.summary(read, answered, source.frames))
    if interrupted.is_set():
        message("recognize-object: interrupted")
        return INTERRUPTED
    return 0 if answered else FAILED


def _answers(
    options: RecognizeOptions,
    reader: Reader,
    source: TouchSource,
    frames: Iterator[Frame],
    interrupted: Event,
) -> Iterator[Answer]:
    most = 1 if options.port and not options.follow and options.most is None else options.most
    warned = ""
    touches = source.touches(_until(interrupted, frames), reader.settings)
    for number, touch in enumerate(touches, start=1):
        if interrupted.is_set():  # what an interruption cuts short is no touch
            return
        found = reader.read(touch.counts, calibration=source.calibration, seq=touch.seq)
        in_base, trouble = object_in_base(touch, found, options.joints_deg, options.joint_error_deg)
        if trouble and trouble != warned:
            warning(f"touch {touch.seq}: the place in the robot's base is not known: {trouble}")
            warned = trouble
        yield Answer(touch, found, in_base)
        if number == most:
            return


def _show_count(frames: Iterator[Frame], bar: ProgressBar) -> Iterator[Frame]:
    for number, frame in enumerate(frames, start=1):
        bar.show(number, f"{number:,} frames")
        yield frame


def _refuse_pictures(plot: Path, *, replace: bool) -> None:
    """Refuse a picture's name that is taken, also by that of one of several touches."""
    refuse_taken(plot, ".png", replace=replace)
    require("matplotlib", extra="report", purpose="--plot")
    there = [
        path
        for path in plot.parent.glob(f"{plot.stem}-*.png")
        if path.stem.removeprefix(f"{plot.stem}-").isdecimal()
    ]
    if there and not replace:
        raise taken(there[0])


def _draw_all(
    reader: Reader, source: TouchSource, answers: list[Answer], plot: Path, interrupted: Event
) -> None:
    """Draw the answers: one into the file, several into files with their numbers."""
    with progress_bar("drawing", len(answers)) as bar:
        for number, answer in enumerate(answers, start=1):
            if interrupted.is_set():
                return
            one = len(answers) == 1
            path = plot if one else plot.with_stem(f"{plot.stem}-{answer.touch.seq}")
            _draw(reader, source, answer, path)
            bar.show(number, f"{number:,} of {len(answers):,}")


def _draw(reader: Reader, source: TouchSource, answer: Answer, path: Path) -> None:
    from recognizer.command.plot.touch import touch_picture

    pose = None if answer.in_base is None else answer.in_base.T_robot_object
    with staged(path) as draft:
        signal = reader.signal(answer.touch.counts, calibration=source.calibration)
        touch_picture(reader, signal, answer.found, draft, T_robot_object=pose)
