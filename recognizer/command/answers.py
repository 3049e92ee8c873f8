"""Touches -> answers, one after another: each by itself, or all as one scan."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING

from encoded_objects.base.output import warning
from probe.frame import Frame
from recognizer.command.learning import SensorLearning
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
from recognizer.touch.recognition import Recognition
from recognizer.touch.source import TouchSource

if TYPE_CHECKING:
    from recognizer.thesis.edges.line import Edge
    from recognizer.touch.robot import ObjectPose


@dataclass(frozen=True, slots=True)
class RecognizeOptions:
    """What the command line says; see `app`."""

    recording: Path | None
    port: str
    database: str
    follow: bool
    every: bool
    most: int | None
    sensor_type: str
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
    learn: Path | None = None  #: what is learned of the sensor, kept and read by
    state: Path | None = None  #: the same, read by alone
    flip: str = ""  #: how images arrive
    mcap: Path | None = None  #: images and answers as ROS 2 messages
    publish: str = ""  #: URL where images and answers are told


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """A touch and what it says."""

    touch: TouchImage
    found: Recognition
    in_base: ObjectPose | None
    touches: int | None = None  #: of a scan, that it rests on
    edges: tuple[Edge, ...] | None = None  #: that the touch feels; None: not asked for


def answers_of(
    options: RecognizeOptions,
    learning: SensorLearning,
    source: TouchSource,
    frames: Iterator[Frame],
    interrupted: Event,
) -> Iterator[Answer]:
    """Yield the answer of every touch as it comes; of a scan its answer at last."""
    reader = learning.reader
    belief = belief_for(reader, options.scan) if options.scan else None
    most = options.most
    if options.port and not options.follow and most is None and belief is None:
        most = 1
    by_touch = read_joints(options.joints_file) if options.joints_file else ()
    touches = source.touches(_frames_until(interrupted, frames), reader.settings)
    if belief is not None and options.recording is not None:
        touches = refuse_single(touches, source.place, touches_for(reader))
    warned = ""
    last: Answer | None = None  # that answers
    for count, touch in enumerate(touches, start=1):
        if interrupted.is_set():  # what an interruption cuts short is no touch
            return
        own = by_touch[count - 1 : count]
        reader = learning.take(touch)
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
    touches = None if belief is None else belief.touches
    if joints is None and touch.pose is None:
        return Answer(touch, found, None, touches), ""
    from recognizer.command.in_base import object_in_base

    in_base, trouble = object_in_base(touch, found, joints, options.joint_error_deg)
    return Answer(touch, found, in_base, touches), trouble


def _frames_until(interrupted: Event, frames: Iterator[Frame]) -> Iterator[Frame]:
    for frame in frames:
        if interrupted.is_set():
            return
        yield frame
