"""One touch more, or all at once: scan + touch -> scan, with an answer each time. Thesis 6.3."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from recognizer.scan.belief import ScanBelief, begin_scan
from recognizer.scan.join import join_touch
from recognizer.scan.mosaic.planar import PlacedTouch, planar_belief, relative_pose
from recognizer.scan.settings import ScanSettings
from recognizer.scan.views import (
    TouchPoses,
    is_unmeasured,
    stands_of,
    widest_mm,
)
from recognizer.touch.felt_area import EarlierTouch
from recognizer.touch.next_touch import PlaceHypothesis, propose_next
from recognizer.touch.reader import Reader
from recognizer.touch.recognition import (
    AMBIGUOUS,
    NO_CONTACT,
    NOT_ENCODED,
    TOO_FEW,
    Recognition,
    refusal,
)

Array = NDArray[np.float64]


def read_scan(
    reader: Reader, touches: Iterable[PlacedTouch], settings: ScanSettings | None = None
) -> Recognition:
    """Return which object and face a scan has touched, and where the probe stands at its end.

    Parameters
    ----------
    reader
        Of the lab and the sensor.
    touches
        Of one face, in their order, each with what the arm believes of its place, or with the
        step from the one before.

    Raises
    ------
    MosaicError
        Another sensor's image, or a touch that hangs on nothing.
    """
    scan = begin_scan(reader, settings)
    for touch in touches:
        scan = extend_scan(scan, touch)
    return scan.recognition


def extend_scan(scan: ScanBelief, touch: PlacedTouch) -> ScanBelief:
    """Return a scan with one touch more.

    A touch that feels nothing is answered by that reason and not kept. One that is answered by
    itself, and does not lie where the others lead to expect it, begins a new belief: probe or
    object have slipped, or another object lies there.

    Raises
    ------
    MosaicError
        Another sensor's image, or a touch that hangs on nothing.
    """
    reader, limits = scan.reader, scan.settings
    if not touch.signal.contact:
        return replace(scan, recognition=_no_contact(reader, touch))
    touches = (*scan.touches, replace(touch, decoded=None))
    finest = min(encoding.style.pitch_mm for encoding in reader.lab.arrays)
    by_hand = any(is_unmeasured(each, limits.loose * finest) for each in touches)
    stand = None if by_hand else stands_of(reader, touches, scan.touch_poses, limits)
    joined = join_touch(scan, touches, stand, expected=not by_hand)
    if joined.seen.alone is None and not joined.agrees:  # not what was expected: what does it say?
        joined = join_touch(scan, touches, stand, expected=False)
    answer, agrees, alone = joined.answer, joined.agrees, joined.seen.alone
    if alone and scan.touches and answer and not _says_the_same(answer, alone, finest):
        if scan.told is not None:
            return _begin_anew(scan, touch)
        alone = answer = refusal(touch.seq, AMBIGUOUS, margin=answer.margin)
    if alone and not answer and scan.told is not None:  # the others do not go with it
        return _begin_anew(scan, touch)
    if alone is not None and not answer and (alone or not scan.touches):
        answer, agrees = alone, agrees or bool(alone)
    found, seen = joined.found, joined.seen
    astray = 0 if agrees or len(touches) == 1 else scan.astray + 1
    if scan.told is not None and not by_hand and astray > limits.patience:
        return _begin_anew(scan, *touches[-astray:])
    answer, told = _believable_answer(scan, answer, astray, 0 if by_hand else limits.patience)
    rivals: Sequence[PlaceHypothesis] = found if agrees or not seen.rivals else seen.rivals
    step = propose_next(reader, touch.signal, answer, rivals, _earlier(touches, joined.touch_poses))
    return ScanBelief(
        reader=reader,
        settings=limits,
        touches=touches,
        touch_poses=joined.touch_poses,
        views=seen.views,
        lattices=joined.lattices,
        astray=astray,
        told=told,
        leading=found[0] if found else None,
        recognition=replace(answer, next=step),
        places=tuple(found),
        begun=scan.begun,
    )


def _no_contact(reader: Reader, touch: PlacedTouch) -> Recognition:
    answer = refusal(touch.seq, NO_CONTACT)
    return replace(answer, next=propose_next(reader, touch.signal, answer, ()))


def _begin_anew(scan: ScanBelief, *touches: PlacedTouch) -> ScanBelief:
    """Return a belief that rests on the last touches alone."""
    anew = begin_scan(scan.reader, scan.settings)
    first, *rest = touches
    if first.believed is None:
        alone = planar_belief(np.zeros(3), scan.settings.first)
        first = replace(first, stepped=None, believed=alone)
    anew = extend_scan(anew, first)
    for touch in rest:
        anew = extend_scan(anew, touch)
    return replace(anew, begun=scan.begun + 1)


def _says_the_same(answer: Recognition, alone: Recognition, pitch_mm: float) -> bool:
    """Whether two answers name one place."""
    if (answer.object, answer.face) != (alone.object, alone.face):
        return False
    away = math.hypot(answer.x_mm - alone.x_mm, answer.y_mm - alone.y_mm)
    turn = abs(math.remainder(answer.theta_deg - alone.theta_deg, 360.0))
    return away < pitch_mm / 2 and turn < 45.0


def _earlier(touches: Sequence[PlacedTouch], touch_poses: TouchPoses) -> list[EarlierTouch]:
    """Return the touches before the last one, as they stand to it."""
    poses = relative_pose(touch_poses.poses[-1], touch_poses.poses[:-1])
    before = zip(poses, touches[:-1], strict=True)
    return [EarlierTouch(pose, touch.signal) for pose, touch in before]


def _believable_answer(
    scan: ScanBelief, answer: Recognition, astray: int, patience: int
) -> tuple[Recognition, tuple[str | None, str | None] | None]:
    """Return an answer as far as it may be believed, and what the scan has told by now.

    A touch that does not agree is answered from the others, but only while it is one of few.
    Two answers about one face exclude each other: neither is believed. A place that only a
    vague arm tells is none.
    """
    if not answer:
        return answer, scan.told
    named = answer.object, answer.face
    if scan.told is not None and named != scan.told:
        return refusal(answer.seq, AMBIGUOUS, margin=answer.margin), None
    if astray > 0 and (scan.told is None or astray > patience):
        return refusal(answer.seq, NOT_ENCODED, margin=answer.margin), scan.told
    if answer.covariance is not None and widest_mm(answer.covariance) > scan.settings.loose_mm:
        return refusal(answer.seq, TOO_FEW, margin=answer.margin), scan.told or named
    return answer, named
