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
from recognizer.command import report
from recognizer.command.placed import object_in_base
from recognizer.command.source import Source, at_port, listened, recorded
from recognizer.touch.contacts import TouchImage
from recognizer.touch.lab import open_lab
from recognizer.touch.reader import Reader, reader_for
from recognizer.touch.recognise import recognise
from recognizer.touch.recognition import Recognition
from recognizer.touch.robot import ObjectPose


@dataclass(frozen=True, slots=True)
class Asked:
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
    placed: ObjectPose | None


def recognize_touches(asked: Asked) -> int:
    """Read touches and print answers; returns the exit code.

    Raises
    ------
    RecordingError, PortError, CalibrationError
        What is read cannot be read.
    DatabaseError, LabError
        The database cannot be read, or holds no encoded object.
    """
    if asked.plot is not None:
        _refuse_pictures(asked.plot, replace=asked.replace)
    with interruption() as interrupted:
        lab = open_lab(asked.database)
        if asked.recording is not None:
            source, read = recorded(
                asked.recording, overlay=asked.overlay, calibration=asked.calibration,
                every=asked.every, live=asked.live,
            )  # fmt: skip
            reader = reader_for(lab, source.sensor)
            return _finished(asked, reader, source, read(interrupted), interrupted)
        source = at_port(asked.port, overlay=asked.overlay, calibration=asked.calibration,
                         every=asked.every)  # fmt: skip
        reader = reader_for(lab, source.sensor)  # before frames come
        with listened(source, interrupted, asked.sensor, asked.calibration) as frames:
            return _finished(asked, reader, source, frames, interrupted)


def _finished(
    asked: Asked, reader: Reader, source: Source, frames: Iterator[Frame], interrupted: Event
) -> int:
    """Answer and print all touches; returns the exit code."""
    out = sys.stdout  # a bar would take it for its terminal
    values: list[dict[str, Any]] = []
    kept: list[Answer] = []
    read = answered = 0
    lines = asked.as_json and asked.follow
    with ExitStack() as stack:
        told = None
        if asked.as_json or not out.isatty():  # otherwise the answers show how far it is
            told = stack.enter_context(progress_bar("reading", source.frames))
            frames = _counted(frames, told)
        for answer in _answers(asked, reader, source, frames, interrupted):
            read += 1
            answered += bool(answer.found)
            if asked.plot is not None:
                if asked.follow:
                    _draw(reader, source, answer, asked.plot)
                else:
                    kept.append(answer)
            if not asked.as_json:
                out.write(report.sentence(answer.touch, answer.found, answer.placed) + "\n")
                out.flush()
                continue
            entry = report.entry(answer.touch, answer.found, answer.placed)
            if lines:
                write_json(entry, line=True)
                out.flush()
            else:
                values.append(entry)
    if asked.plot is not None and kept:
        _draw_all(reader, source, kept, asked.plot, interrupted)
    if asked.as_json and not lines:
        write_json(values)
    elif read != 1:
        message(report.summary(read, answered, source.frames))
    if interrupted.is_set():
        message("recognize-object: interrupted")
        return INTERRUPTED
    return 0 if answered else FAILED


def _answers(
    asked: Asked, reader: Reader, source: Source, frames: Iterator[Frame], interrupted: Event
) -> Iterator[Answer]:
    most = 1 if asked.port and not asked.follow and asked.most is None else asked.most
    warned = ""
    for number, touch in enumerate(source.touches(frames), start=1):
        if interrupted.is_set():  # what an interruption cuts short is no touch
            return
        found = recognise(reader, source.signal(touch), touch.seq)
        placed, trouble = object_in_base(touch, found, asked.joints_deg, asked.joint_error_deg)
        if trouble and trouble != warned:
            warning(f"touch {touch.seq}: the place in the robot's base is not known: {trouble}")
            warned = trouble
        yield Answer(touch, found, placed)
        if number == most:
            return


def _counted(frames: Iterator[Frame], told: ProgressBar) -> Iterator[Frame]:
    for number, frame in enumerate(frames, start=1):
        told.show(number, f"{number:,} frames")
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
    reader: Reader, source: Source, answers: list[Answer], plot: Path, interrupted: Event
) -> None:
    """Draw the answers: one into the file, several into files with their numbers."""
    with progress_bar("drawing", len(answers)) as told:
        for number, answer in enumerate(answers, start=1):
            if interrupted.is_set():
                return
            one = len(answers) == 1
            path = plot if one else plot.with_stem(f"{plot.stem}-{answer.touch.seq}")
            _draw(reader, source, answer, path)
            told.show(number, f"{number:,} of {len(answers):,}")


def _draw(reader: Reader, source: Source, answer: Answer, path: Path) -> None:
    from recognizer.command.plot.touch import touch_picture

    pose = None if answer.placed is None else answer.placed.T_robot_object
    with staged(path) as draft:
        signal = source.signal(answer.touch)
        touch_picture(reader, signal, answer.found, draft, T_robot_object=pose)
