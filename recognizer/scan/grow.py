"""One touch more, or all at once: scan + touch -> scan, with an answer each time. Thesis 6.3."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from recognizer.scan.answer import (
    LocatedComposite,
    answer_scan,
    distinct_places,
    locate_composites,
    refine_last_pose,
)
from recognizer.scan.composite import Composite, composite, expected_fit
from recognizer.scan.lattice import (
    PlaneLattice,
    expected_at,
    refine_agreement,
    same_lattice,
    seed_lattice,
)
from recognizer.scan.mosaic.planar import relative_pose
from recognizer.scan.mosaic.touch import PlacedTouch, planar_belief
from recognizer.scan.settings import ScanSettings
from recognizer.scan.views import (
    LatticeView,
    LatticeViews,
    TouchPoses,
    expected_view,
    fits_of,
    is_unmeasured,
    round_views,
    stands_of,
    tells_place,
    views_of,
    widest_mm,
)
from recognizer.touch.belief import VerifiedHypothesis
from recognizer.touch.felt_area import EarlierTouch
from recognizer.touch.next_touch import PlaceHypothesis, propose_next
from recognizer.touch.reader import Reader
from recognizer.touch.recognise import recognise_with_rivals
from recognizer.touch.recognition import (
    AMBIGUOUS,
    NO_CONTACT,
    NOT_ENCODED,
    TOO_FEW,
    Recognition,
    refusal,
)
from recognizer.touch.symbols.gain import Image, image_of_signal

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class ScanBelief:
    """The touches of one face so far and what they say together; `extend_scan` returns the next."""

    reader: Reader
    settings: ScanSettings
    touches: tuple[PlacedTouch, ...]  #: those with contact
    touch_poses: TouchPoses | None
    views: tuple[tuple[tuple[LatticeView, ...], ...], ...]  #: of each encoding, of each touch
    lattices: tuple[tuple[PlaneLattice, ...], ...]  #: of each encoding, best first
    astray: int  #: touches in a row that agree with nothing that the others say
    told: tuple[str | None, str | None] | None  #: object and face by a touch that agreed
    leading: LocatedComposite | None  #: the likeliest place, whether it is the answer or not
    recognition: Recognition  #: of the probe's pose at the last touch
    begun: int = 0  #: how often a new belief began, because touches did not belong together


def begin_scan(reader: Reader, settings: ScanSettings | None = None) -> ScanBelief:
    """Return a scan without touches."""
    none = tuple(() for _ in reader.prepared)
    limits = settings or ScanSettings()
    return ScanBelief(reader, limits, (), None, none, none, 0, None, None, refusal(0, TOO_FEW))


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
    touch_poses = stands_of(reader, touches, scan.touch_poses, limits)
    seen = _see_touch(scan, touch, touch_poses)
    lattices: list[tuple[PlaneLattice, ...]] = []
    found: list[LocatedComposite] = []
    for k, (encoding, _, _) in enumerate(reader.prepared):
        pitch = encoding.style.pitch_mm
        sums = _composites(views_of(seen.views[k]), touch_poses, scan.lattices[k], pitch, limits)
        lattices.append(tuple(item.agreement.lattice for item in sums))
        found += locate_composites(encoding, sums, limits, reader.settings.hypotheses)
    found = distinct_places(found)
    answer, agrees = refusal(touch.seq, TOO_FEW), False
    if found and (found[0].composite.agreement.chosen >= 0).sum() > 1:
        answer = answer_scan(reader, found, limits, touch.seq, by_hand=by_hand)
        agrees = bool(found[0].composite.agreement.chosen[-1] >= 0)
        if answer:
            found[0], agrees = _pose_last_touch(reader, seen.images, found[0], touch_poses, limits)
            answer = answer_scan(reader, found, limits, touch.seq, by_hand=by_hand)
    alone = seen.alone
    if alone and scan.touches and not _says_the_same(answer, alone, finest):
        if scan.told is not None or not answer:
            return _begin_anew(scan, touch)
        alone = answer = refusal(touch.seq, AMBIGUOUS, margin=answer.margin)
    if alone is not None and not answer and (alone or not scan.touches):
        answer, agrees = alone, agrees or bool(alone)
    astray = 0 if agrees or len(touches) == 1 else scan.astray + 1
    if scan.told is not None and not by_hand and astray > limits.patience:
        return _begin_anew(scan, *touches[-astray:])
    answer, told = _believable_answer(scan, answer, astray, 0 if by_hand else limits.patience)
    rivals: Sequence[PlaceHypothesis] = found if agrees or not seen.rivals else seen.rivals
    step = propose_next(reader, touch.signal, answer, rivals, _earlier(touches, touch_poses))
    return ScanBelief(
        reader=reader,
        settings=limits,
        touches=touches,
        touch_poses=touch_poses,
        views=seen.views,
        lattices=tuple(lattices),
        astray=astray,
        told=told,
        leading=found[0] if found else None,
        recognition=replace(answer, next=step),
        begun=scan.begun,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _SeenTouch:
    """What the last touch shows."""

    images: list[Image]  #: of each encoding
    views: tuple[tuple[tuple[LatticeView, ...], ...], ...]  #: as `ScanBelief.views`
    alone: Recognition | None  #: by itself; None: it lies where it was expected, nobody asked
    rivals: list[VerifiedHypothesis]  #: places that it may be by itself


def _see_touch(scan: ScanBelief, touch: PlacedTouch, touch_poses: TouchPoses) -> _SeenTouch:
    """Return what the last touch shows: what is expected of it, or what it says by itself."""
    reader, limits = scan.reader, scan.settings
    images = [_image(reader, touch, each.style.height_mm) for each in reader.lab.arrays]
    near = [_expected_poses(each[: limits.guided], touch_poses) for each in scan.lattices]
    new: list[tuple[LatticeView, ...]] = [() for _ in images]
    if scan.recognition and scan.astray == 0:
        for k, (_, template, _) in enumerate(reader.prepared):
            new[k] = expected_view(images[k], template, reader, near[k], limits.clean)
    alone: Recognition | None = None
    rivals: list[VerifiedHypothesis] = []
    if not any(new):
        alone, rivals = recognise_with_rivals(reader, touch.signal, touch.seq)
        for k, (encoding, template, bank) in enumerate(reader.prepared):
            own = [one.fit for one in rivals if one.embossed is encoding and one.bend is None]
            new[k] = fits_of(images[k], template, bank, reader, near[k], own)
            if encoding.radii_mm:
                more = round_views(images[k], template, bank, reader, encoding, near[k])
                new[k] = (*new[k], *more)
    views = tuple(
        (*before, tuple(view for view in each if view.fit.noise <= limits.noise))
        for before, each in zip(scan.views, new, strict=True)
    )
    return _SeenTouch(images, views, alone, rivals)


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


def _pose_last_touch(
    reader: Reader,
    images: list[Image],
    best: LocatedComposite,
    touch_poses: TouchPoses,
    limits: ScanSettings,
) -> tuple[LocatedComposite, bool]:
    """Return a place with the pose of the last touch, and whether that touch agrees with it."""
    if best.composite.agreement.chosen[-1] >= 0:
        k = next(n for n, each in enumerate(reader.prepared) if each[0] is best.encoding)
        finer = refine_last_pose(reader, images[k], reader.prepared[k][1], best, limits)
        many = len(best.fit.cells) >= reader.settings.belief.many_inliers
        least = (
            reader.settings.belief.explained_by_many if many else reader.settings.belief.explained
        )
        if finer.explained >= least and tells_place(finer.fit.covariance):
            return finer, True
    return replace(best, fit=expected_fit(best.composite, touch_poses)), False


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


def _image(reader: Reader, touch: PlacedTouch, height_mm: float) -> Image:
    signal = touch.signal
    return image_of_signal(reader.sensor, signal, height_mm, reader.settings)


def _expected_poses(lattices: tuple[PlaneLattice, ...], touch_poses: TouchPoses) -> Array:
    """Return where (k, 3) lattices lead to expect the last touch."""
    at = [
        expected_at(each, touch_poses.poses[-1], touch_poses.covariances[-1])[0]
        for each in lattices
    ]
    return np.array(at).reshape(-1, 3)


def _composites(
    views: LatticeViews,
    touch_poses: TouchPoses,
    before: tuple[PlaneLattice, ...],
    pitch_mm: float,
    limits: ScanSettings,
) -> list[Composite]:
    """Return the sums of the lattices that were followed and of those of the last touch."""
    last = len(touch_poses.poses) - 1
    every = [refine_agreement(views, touch_poses, each, pitch_mm, limits) for each in before]
    known = {int(agreement.chosen[last]) for agreement in every[:1]}
    for view in np.flatnonzero(views.touch == last).tolist():
        if view not in known:
            every.append(
                refine_agreement(
                    views, touch_poses, seed_lattice(views, touch_poses, view), pitch_mm, limits
                )
            )
    every.sort(key=lambda agreement: -agreement.score)
    distinct: list[PlaneLattice] = []
    sums: list[Composite] = []
    for agreement in every:
        if any(
            same_lattice(agreement.lattice, other, touch_poses.poses[last], pitch_mm)
            for other in distinct
        ):
            continue
        distinct.append(agreement.lattice)
        summed = composite(views, touch_poses, agreement, pitch_mm, limits)
        if summed is not None:
            sums.append(summed)
        if len(distinct) == limits.lattices:
            break
    sums.sort(key=lambda item: -item.fit.value)
    return [item for item in sums if item.fit.value > sums[0].fit.value - limits.hopeless]
