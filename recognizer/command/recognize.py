"""`recognize-object`: touches -> answers, printed as they come; pictures of a recording at its end.

A touch is read by itself, or added to the belief of a scan.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING, Any

from encoded_objects.base.console import FAILED, INTERRUPTED, interruption
from encoded_objects.base.errors import require
from encoded_objects.base.files import file_exists_error, refuse_taken, staged_file
from encoded_objects.base.output import (
    ProgressBar,
    count_of,
    message,
    progress_bar,
    warning,
    write_json,
)
from probe.errors import PoseError
from probe.frame import Frame
from probe.recording.layout import RecordingOrigin
from probe.recording.read import Recording
from recognizer.command.answers import Answer, AnswerSink
from recognizer.command.learning import SensorLearning, learning_for
from recognizer.command.options import RecognizeOptions
from recognizer.command.port import listen, source_at
from recognizer.command.scanning import (
    belief_for,
    pose_during,
    read_joints,
    refuse_single,
    sensor_pose,
    touches_for,
)
from recognizer.touch.lab import open_lab
from recognizer.touch.options import ReaderOptions
from recognizer.touch.reader import Reader
from recognizer.touch.recognition import NO_CONTACT, UNCHECKED, Recognition
from recognizer.touch.source import TouchImage, TouchSource, source_of

if TYPE_CHECKING:
    from recognizer.sensor.wiring import Wiring
    from recognizer.touch.robot import ObjectPose
    from recognizer.touch.signal import Signal

MOUNTING = (
    "how this sensor is mounted was never checked, and no touch shows a quarter or half turn: "
    "recognize-object check --at OBJECT/FACE --sensor-state FILE"
)
POSES = (
    "the poses contradict the touches, which without them say {object}/{face}; poses are "
    "T_base_sensor in mm, z away from the surface (docs/recognizer.md)"
)
TRIED = 6  #: refused touches, none answered, after which the wiring is checked


def recognize_touches(options: RecognizeOptions) -> int:
    """Read touches and print answers; returns the exit code.

    Raises RecordingError, PortError, CalibrationError: the recording, port or calibration cannot be
    read; DatabaseError, LabError: the database cannot be read, or holds no encoded object.
    """
    if options.plot is not None:
        _refuse_pictures(options.plot, replace=options.replace)
    with interruption() as interrupted, ExitStack() as stack:
        lab = open_lab(options.database)
        if options.recording is not None:
            recording = Recording(options.recording, live=options.live)
            source = source_of(
                recording, options.sensor_type, overlay=options.overlay,
                calibration=options.calibration, every=options.every,
            )  # fmt: skip
            origin = recording.origin
        else:
            source = source_at(
                options.port, sensor_type=options.sensor_type, overlay=options.overlay,
                calibration=options.calibration, every=options.every,
            )  # fmt: skip
            origin = RecordingOrigin(sensor=options.port)
        if source.notice:
            warning(source.notice)
        known = ReaderOptions(as_designed=options.as_designed)
        reader = Reader(lab, source.sensor, known)
        learning = learning_for(reader, source, options.learn, options.state)
        wiring = _wiring(options.flip, learning)
        if options.recording is not None:
            frames = _rewired(wiring, source, recording.frames())
            learning.learn_from(source.touches(frames, learning.reader.options))
            frames = recording.frames()
        else:
            frames = stack.enter_context(
                listen(source, interrupted, options.sensor, options.calibration)
            )
        frames = _rewired(wiring, source, frames)
        return _print_answers(options, learning, source, frames, interrupted, origin)


def _print_answers(
    options: RecognizeOptions,
    learning: SensorLearning,
    source: TouchSource,
    frames: Iterator[Frame],
    interrupted: Event,
    origin: RecordingOrigin,
) -> int:
    out = sys.stdout  # a bar would take it for its terminal
    values: list[dict[str, Any]] = []
    kept: list[Answer] = []
    refused: list[TouchImage] = []
    read = answered = 0
    hinted, as_json = False, options.as_json
    simulated = origin.sensor.startswith(("simulated/", "sim:"))  # none is mounted
    lines = as_json and options.follow
    needed = touches_for(learning.reader)
    scan, said = bool(options.scan_method), ""
    quiet = options.recording is not None and options.scan_method == "joint"  # news alone
    if scan and needed == 1:
        message("one touch is enough for these symbols; a scan helps where parts are worn or cut")
    with ExitStack() as stack:
        bar = None
        if options.as_json or not out.isatty():  # otherwise the answers show the progress
            bar = stack.enter_context(progress_bar("reading", source.frames))
        sinks = [stack.enter_context(sink) for sink in _sinks(options, origin)]
        frames = _watched(frames, interrupted, sinks, bar)
        for answer in _answers(options, learning, source, frames, interrupted):
            for sink in sinks:
                sink.answer(answer)
            read += 1
            if not answer.found and not scan and answer.found.reason != NO_CONTACT:
                refused.append(answer.touch)
                if len(refused) == TRIED and not answered:
                    _hint_wiring(learning.reader, source, refused, options.flip)
            unchecked = answer.found and answer.found.mounting == UNCHECKED
            if unchecked and not (hinted or as_json or simulated):
                message(MOUNTING)
                hinted = True
            answered = bool(answer.found) + (0 if scan else answered)
            if options.plot is not None and options.follow:
                _draw(learning.reader, source, answer, options.plot)
            elif options.plot is not None:
                kept = [*kept[: 0 if scan else None], answer]  # of a scan one picture
            if options.as_json and not lines:
                values.append(answer.printed_json())
                continue
            name = f"{answer.found.object}/{answer.found.face}" if answer.found else ""
            if lines:
                write_json(answer.printed_json(), line=True)
            elif not quiet or name != said:
                out.write(answer.sentence(needed) + "\n")
                said = name
            out.flush()
    learning.end()
    if refused and not answered and len(refused) < TRIED and not interrupted.is_set():
        _hint_wiring(learning.reader, source, refused, options.flip)
    if options.plot is not None and kept:
        _draw_all(learning.reader, source, kept, options.plot, interrupted)
    if options.as_json and not lines:
        write_json(values)
    elif scan and read:
        out.write(f"a scan of {answer.touches} touches: {answer.found}\n")
    elif read == 0:
        message("no touch" + ("" if source.frames is None
                              else f" in {count_of(source.frames, 'frame')}"))  # fmt: skip
    elif read > 1:
        message(f"{read:,} touches, {answered:,} recognised")
    if not answered and read and not scan and needed > 1:
        message(f"symbols of this lab are read by a scan of about {needed} overlapping touches: "
                "recognize-object --scan")  # fmt: skip
    if interrupted.is_set():
        message("recognize-object: interrupted")
        return INTERRUPTED
    return 0 if answered else FAILED


def _answers(
    options: RecognizeOptions,
    learning: SensorLearning,
    source: TouchSource,
    frames: Iterator[Frame],
    interrupted: Event,
) -> Iterator[Answer]:
    """Yield the answer of every touch as it comes; of a scan its answer at last."""
    reader, method = learning.reader, options.scan_method
    belief = belief_for(reader, method) if method else None
    most = options.most
    if options.port and not options.follow and most is None and belief is None:
        most = 1
    by_touch = read_joints(options.joints_file) if options.joints_file else ()
    touches = source.touches(frames, reader.options)
    if belief is not None and options.recording is not None:
        touches = refuse_single(touches, source.place, touches_for(reader))
    warned = ""
    posed: list[tuple[Signal, int]] = []  # touches of a scan whose pose is known
    last: Answer | None = None  # that answers
    for count, touch in enumerate(touches, start=1):
        if interrupted.is_set():  # a touch that is cut short is none
            return
        reader = learning.take(touch)
        if belief is None:
            found = reader.read(touch.counts, calibration=source.calibration, seq=touch.seq)
        else:
            signal = reader.signal(touch.counts, calibration=source.calibration)
            pose = pose_during(touch, count, by_touch, options.joint_error, source.place)
            found = belief.add(signal, pose, seq=touch.seq)
            if pose is not None and not options.follow:  # which has no end
                posed.append((signal, touch.seq))
        joints = by_touch[count - 1] if len(by_touch) >= count else options.joints_deg
        in_base, trouble = _object_in_base(touch, found, joints, options.joint_error)
        answer = Answer(touch, found, in_base, None if belief is None else belief.touches)
        if method == "thesis":
            from recognizer.thesis.edge_fit import touch_edges

            answer = replace(answer, edges=touch_edges(reader.sensor, signal))
        if trouble and trouble != warned:
            warning(f"touch {touch.seq}: the place in the robot's base is not known: {trouble}")
            warned = trouble
        yield answer
        last = answer if found else last
        until_answered = belief is not None and options.port and not options.follow
        if count == most or (found and until_answered):
            return
    if belief is None or not belief.touches or found:
        return
    if not belief.answer:
        without = belief_for(reader, method)
        for signal, seq in posed:
            without.add(signal, None, seq=seq)
        if without.answer:
            message(POSES.format(object=without.answer.object, face=without.answer.face))
        return
    # the answer of the scan, though its last touch could not be read
    if last is not None and last.found is belief.answer:
        yield last
    else:
        in_base, _ = _object_in_base(touch, belief.answer, joints, options.joint_error)
        yield replace(answer, found=belief.answer, in_base=in_base)


def _object_in_base(
    touch: TouchImage,
    found: Recognition,
    joints_deg: tuple[float, ...] | None,
    joint_error_deg: float,
) -> tuple[ObjectPose | None, str]:
    """Return the object in the robot's base, and why it is not known though angles are."""
    try:
        pose = sensor_pose(touch, joints_deg, joint_error_deg)
    except PoseError as error:
        return None, str(error)
    if pose is None:
        return None, ""
    from recognizer.touch.robot import object_pose

    return object_pose(found, pose), ""


def _sinks(options: RecognizeOptions, origin: RecordingOrigin) -> Iterator[AnswerSink]:
    """Yield the sinks of the options; their libraries load now."""
    if options.mcap is not None:
        from recognizer.command.ros import McapSink

        yield McapSink(options.mcap, origin, replace=options.replace)
    if options.publish:
        from recognizer.command.publish import PublishSink

        yield PublishSink(options.publish, options.publish_users, to_all=options.open)


def _wiring(flip: str, learning: SensorLearning) -> Wiring | None:
    """Return the changes on the way of images: those of `--flip`, else those that `check` found.

    Others than `check` found say that the sensor was mounted anew: it was not checked so.
    """
    state = learning.reader.state
    checked = None if state is None else state.mounting
    if not flip and not checked:
        return None
    from recognizer.sensor.wiring import Wiring, wiring_named

    if not flip:
        return Wiring(checked or ())
    wiring = wiring_named(flip)
    turned = tuple(change for change in wiring.changes if change != "values")
    if state is not None and checked is not None and turned != checked:
        warning(f"--flip {flip} is not what recognize-object check found: "
                f"{','.join(checked) or 'as drawn'}")  # fmt: skip
        learning.reader = replace(learning.reader, state=replace(state, mounting=None))
    return wiring


def _rewired(
    wiring: Wiring | None, source: TouchSource, frames: Iterator[Frame]
) -> Iterator[Frame]:
    if wiring is None:
        return frames
    return (wiring.frame(frame, source.sensor.full) for frame in frames)


def _hint_wiring(reader: Reader, source: TouchSource, refused: list[TouchImage], flip: str) -> None:
    """Say how the sensor seems to be wired, if refused touches show it after the given changes."""
    from recognizer.sensor.wiring import wiring_hint

    hint = wiring_hint(reader, refused, calibration=source.calibration)
    if hint:
        again = f"; this is after --flip {flip}: give both, or none of two that are the same"
        message(hint + again if flip else hint)


def _watched(
    frames: Iterator[Frame],
    interrupted: Event,
    sinks: Sequence[AnswerSink],
    bar: ProgressBar | None,
) -> Iterator[Frame]:
    """Yield frames until an interruption; sinks and a bar get each."""
    for number, frame in enumerate(frames, start=1):
        if bar is not None:
            bar.show(number, f"{number:,} frames")
        for sink in sinks:
            sink.frame(frame)
        if interrupted.is_set():
            return
        yield frame


def _refuse_pictures(plot: Path, *, replace: bool) -> None:
    """Refuse a picture's name that is taken, also by that of one of several touches."""
    refuse_taken(plot, ".png", replace=replace)
    require("matplotlib", extra="report", purpose="--plot")
    for path in plot.parent.glob(f"{plot.stem}-*.png"):
        if path.stem.removeprefix(f"{plot.stem}-").isdecimal() and not replace:
            raise file_exists_error(path)


def _draw_all(
    reader: Reader, source: TouchSource, answers: list[Answer], plot: Path, interrupted: Event
) -> None:
    """Draw the answers: one into the file, several into files with their numbers."""
    if len(answers) > 1:
        numbers = f"{plot.stem}-{answers[0].touch.seq}.png ... -{answers[-1].touch.seq}.png"
        message(f"drawing {len(answers):,} pictures, one a touch: {numbers}")
    with progress_bar("drawing", len(answers)) as bar:
        for number, answer in enumerate(answers, start=1):
            if interrupted.is_set():
                return
            one = len(answers) == 1
            path = plot if one else plot.with_stem(f"{plot.stem}-{answer.touch.seq}")
            _draw(reader, source, answer, path)
            bar.show(number, f"{number:,} of {len(answers):,}")


def _draw(reader: Reader, source: TouchSource, answer: Answer, path: Path) -> None:
    from recognizer.picture import touch_picture

    pose = None if answer.in_base is None else answer.in_base.T_robot_object
    with staged_file(path) as draft:
        signal = reader.signal(answer.touch.counts, calibration=source.calibration)
        touch_picture(reader, signal, answer.found, draft, T_robot_object=pose)
