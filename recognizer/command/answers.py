"""Touches -> answers, each printed as it comes; the pictures of a recording at its end."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING, Any

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
from recognizer.command.scanning import (
    Belief,
    Joints,
    belief_for,
    edges_of,
    pose_during,
    read_joints,
    refuse_single,
    touches_for,
)
from recognizer.touch.contacts import TouchImage
from recognizer.touch.lab import Lab, open_lab
from recognizer.touch.reader import Reader
from recognizer.touch.recognition import NO_CONTACT, Recognition
from recognizer.touch.robot import ObjectPose
from recognizer.touch.source import TouchSource, source_of

if TYPE_CHECKING:
    from recognizer.thesis.edges.line import Edge


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
    scan: str = ""  #: joint or thesis; empty: every touch by itself
    joints_file: Path | None = None  #: angles of every touch


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """A touch and what it says."""

    touch: TouchImage
    found: Recognition
    in_base: ObjectPose | None
    touches: int | None = None  #: of a scan, that it rests on
    edges: tuple[Edge, ...] | None = None  #: that the touch feels; None: not asked for


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
    needed = touches_for(reader)
    if options.scan and needed == 1:
        message("one touch is enough for these symbols; a scan helps where parts are worn or cut")
    with ExitStack() as stack:
        bar = None
        if options.as_json or not out.isatty():  # otherwise the answers show how far it is
            bar = stack.enter_context(progress_bar("reading", source.frames))
            frames = _show_count(frames, bar)
        for answer in _answers(options, reader, source, frames, interrupted):
            read += 1
            answered = bool(answer.found) + (0 if options.scan else answered)
            if options.plot is not None:
                if options.follow:
                    _draw(reader, source, answer, options.plot)
                else:
                    kept.append(answer)
            if not options.as_json:
                out.write(_sentence(answer, needed) + "\n")
                out.flush()
                continue
            entry = report.entry(answer.touch, answer.found, answer.in_base)
            if answer.touches is not None:
                entry["touches"] = answer.touches
            if answer.edges is not None:
                entry["edges"] = [report.edge_entry(edge, answer.found) for edge in answer.edges]
            if lines:
                write_json(entry, line=True)
                out.flush()
            else:
                values.append(entry)
    if options.plot is not None and kept:
        _draw_all(reader, source, kept, options.plot, interrupted)
    if options.as_json and not lines:
        write_json(values)
    elif options.scan and read:
        what = f"{answer.found.object}/{answer.found.face}" if answered else "not recognised"
        message(f"a scan of {answer.touches} touches: {what}")
    elif read != 1:
        message(report.summary(read, answered, source.frames))
    if not answered and read and not options.scan and needed > 1:
        message(f"symbols of this lab are read by a scan of about {needed} overlapping touches: "
                "recognize-object --scan")  # fmt: skip
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
    belief = belief_for(reader, options.scan) if options.scan else None
    most = options.most
    if options.port and not options.follow and most is None and belief is None:
        most = 1
    by_touch = read_joints(options.joints_file) if options.joints_file else ()
    touches = source.touches(_until(interrupted, frames), reader.settings)
    if belief is not None and options.recording is not None:
        touches = refuse_single(touches, source.place, touches_for(reader))
    warned = ""
    last: Answer | None = None  # that answers
    for count, touch in enumerate(touches, start=1):
        if interrupted.is_set():  # what an interruption cuts short is no touch
            return
        own = by_touch[count - 1 : count]
        if belief is None:
            found = reader.read(touch.counts, calibration=source.calibration, seq=touch.seq)
        else:
            signal = reader.signal(touch.counts, calibration=source.calibration)
            pose = pose_during(touch, count, by_touch, options.joint_error_deg)
            found = belief.add(signal, pose, seq=touch.seq)
        answer, trouble = _answer(options, touch, found, own, belief)
        if options.scan == "thesis":
            answer = replace(answer, edges=edges_of(reader, signal))
        if trouble and trouble != warned:
            warning(f"touch {touch.seq}: the place in the robot's base is not known: {trouble}")
            warned = trouble
        yield answer
        last = answer if found else last
        until_told = belief is not None and options.port and not options.follow
        if count == most or (found and until_told):
            break
    else:
        if belief is None or not belief.touches or found or not belief.answer:
            return
        # the answer of the scan, though its last touch could not be read
        if last is not None and last.found is belief.answer:
            yield last
        else:
            late, _ = _answer(options, touch, belief.answer, own, belief)
            yield replace(late, edges=answer.edges)


def _answer(
    options: RecognizeOptions,
    touch: TouchImage,
    found: Recognition,
    own: Joints,
    belief: Belief | None,
) -> tuple[Answer, str]:
    """Return an answer with the object in the robot's base, or what kept it from being known.

    Joint angles are those of the touch (`own`), if there are such.
    """
    joints = own[0] if own else options.joints_deg
    in_base, trouble = object_in_base(touch, found, joints, options.joint_error_deg)
    return Answer(touch, found, in_base, None if belief is None else belief.touches), trouble


def _sentence(answer: Answer, needed: int) -> str:
    """Return an answer in a line; of a scan with the number of its touches."""
    said = report.sentence(answer.touch, answer.found, answer.in_base)
    if answer.touches is None:
        return said
    if not answer.found and answer.found.reason != NO_CONTACT:
        more = f"; go on: about {needed} touches" if answer.touches < needed else ""
        said = f"{answer.touch.seq}: not yet: {answer.found.reason}{more}"
    said = f"{said} ({answer.touches} {'touch' if answer.touches == 1 else 'touches'})"
    return "; ".join((said, *map(report.edge_words, answer.edges or ())))


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
