"""`recognize-object`: answers printed as they come; the pictures of a recording at its end."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from threading import Event
from typing import Any

from encoded_objects.base.console import FAILED, INTERRUPTED, interruption
from encoded_objects.base.output import ProgressBar, message, progress_bar, warning, write_json
from probe.frame import Frame
from probe.recording.layout import RecordingOrigin
from probe.recording.read import Recording
from recognizer.command import report
from recognizer.command.answer_pictures import draw_answer, draw_answers, refuse_pictures
from recognizer.command.answer_sink import AnswerSink
from recognizer.command.answers import Answer, RecognizeOptions, answers_of
from recognizer.command.learning import SensorLearning, learning_for
from recognizer.command.port import listen, source_at
from recognizer.command.scanning import touches_for
from recognizer.command.sinks import sinks_for
from recognizer.touch.contacts import TouchImage
from recognizer.touch.lab import Lab, open_lab
from recognizer.touch.reader import Reader
from recognizer.touch.recognition import NO_CONTACT
from recognizer.touch.source import TouchSource, source_of

TRIED = 6  #: refused touches, none answered, after which it is asked how the sensor is wired


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
        refuse_pictures(options.plot, replace=options.replace)
    with interruption() as interrupted:
        lab = open_lab(options.database)
        if options.recording is not None:
            recording = Recording(options.recording, live=options.live)
            source = source_of(
                recording, options.sensor_type, overlay=options.overlay,
                calibration=options.calibration, every=options.every,
            )  # fmt: skip
            learning = _reader(options, lab, source)
            frames = _rewire(options, source, recording.frames())
            learning.learn_from(source.touches(frames, learning.reader.settings))
            frames = _rewire(options, source, recording.frames())
            return _print_answers(options, learning, source, frames, interrupted, recording.origin)
        source = source_at(
            options.port, sensor_type=options.sensor_type, overlay=options.overlay,
            calibration=options.calibration, every=options.every,
        )  # fmt: skip
        learning = _reader(options, lab, source)  # before frames come
        with listen(source, interrupted, options.sensor, options.calibration) as frames:
            origin = RecordingOrigin(sensor=options.port)
            frames = _rewire(options, source, frames)
            return _print_answers(options, learning, source, frames, interrupted, origin)


def _rewire(
    options: RecognizeOptions, source: TouchSource, frames: Iterator[Frame]
) -> Iterator[Frame]:
    """Return frames as the sensor has them, where a person says that they arrive otherwise."""
    if not options.flip:
        return frames
    from recognizer.sensor.wiring import wiring_named

    wiring = wiring_named(options.flip)
    return (wiring.frame(frame, source.sensor.full) for frame in frames)


def _hint_wiring(reader: Reader, source: TouchSource, refused: list[TouchImage]) -> None:
    """Say how the sensor seems to be wired, where refused touches tell."""
    from recognizer.sensor.wiring import wiring_hint

    hint = wiring_hint(reader, refused, calibration=source.calibration)
    if hint:
        message(hint)


def _reader(options: RecognizeOptions, lab: Lab, source: TouchSource) -> SensorLearning:
    if source.notice:
        warning(source.notice)
    return learning_for(Reader(lab, source.sensor), source, options.learn, options.state)


def _print_answers(
    options: RecognizeOptions,
    learning: SensorLearning,
    source: TouchSource,
    frames: Iterator[Frame],
    interrupted: Event,
    origin: RecordingOrigin,
) -> int:
    """Answer and print all touches; returns the exit code."""
    out = sys.stdout  # a bar would take it for its terminal
    values: list[dict[str, Any]] = []
    kept: list[Answer] = []
    refused: list[TouchImage] = []
    read = answered = 0
    lines = options.as_json and options.follow
    reader = learning.reader
    needed = touches_for(reader)
    if options.scan and needed == 1:
        message("one touch is enough for these symbols; a scan helps where parts are worn or cut")
    with ExitStack() as stack:
        bar = None
        if options.as_json or not out.isatty():  # otherwise the answers show how far it is
            bar = stack.enter_context(progress_bar("reading", source.frames))
            frames = _show_count(frames, bar)
        sinks = [stack.enter_context(sink) for sink in sinks_for(options, origin)]
        frames = _hand_on(frames, sinks)
        for answer in answers_of(options, learning, source, frames, interrupted):
            for sink in sinks:
                sink.answer(answer)
            read += 1
            if not answer.found and not options.scan and answer.found.reason != NO_CONTACT:
                refused.append(answer.touch)
                if len(refused) == TRIED and not answered:
                    _hint_wiring(learning.reader, source, refused)
            answered = bool(answer.found) + (0 if options.scan else answered)
            if options.plot is not None:
                if options.follow:
                    draw_answer(learning.reader, source, answer, options.plot)
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
    learning.end()
    if refused and not answered and len(refused) < TRIED and not interrupted.is_set():
        _hint_wiring(learning.reader, source, refused)
    if options.plot is not None and kept:
        draw_answers(learning.reader, source, kept, options.plot, interrupted)
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


def _sentence(answer: Answer, needed: int) -> str:
    """Return an answer in a line; of a scan with the number of its touches."""
    said = report.sentence(answer.touch, answer.found, answer.in_base)
    if answer.touches is None:
        return said
    if not answer.found and answer.found.reason != NO_CONTACT:
        more = f"; go on: about {needed} touches" if answer.touches < needed else ""
        said = f"{answer.touch.seq}: not yet: {answer.found.reason}{more}"
        said += f"; next: {answer.found.next}" if answer.found.next is not None else ""
    said = f"{said} ({answer.touches} {'touch' if answer.touches == 1 else 'touches'})"
    return "; ".join((said, *map(report.edge_words, answer.edges or ())))


def _show_count(frames: Iterator[Frame], bar: ProgressBar) -> Iterator[Frame]:
    for number, frame in enumerate(frames, start=1):
        bar.show(number, f"{number:,} frames")
        yield frame


def _hand_on(frames: Iterator[Frame], sinks: Sequence[AnswerSink]) -> Iterator[Frame]:
    for frame in frames:
        for sink in sinks:
            sink.frame(frame)
        yield frame
