"""One touch and those before it -> what they say together of a face. Thesis 6.3.

The touch is what the others lead to expect if it looks like that, and what it says by itself
otherwise. Its lattices join theirs, and what all say of each cell is located.
"""

from __future__ import annotations

from collections.abc import Sequence
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
from recognizer.scan.belief import ScanBelief
from recognizer.scan.composite import Composite, composite, expected_fit
from recognizer.scan.lattice import (
    PlaneLattice,
    expected_at,
    refine_agreement,
    same_lattice,
    seed_lattice,
)
from recognizer.scan.mosaic.planar import PlacedTouch
from recognizer.scan.path import follow_path, path_touch_poses
from recognizer.scan.settings import LATTICES, ScanSettings
from recognizer.scan.steps import steps_of
from recognizer.scan.views import (
    LatticeView,
    LatticeViews,
    TouchPoses,
    expected_view,
    fits_of,
    round_views,
    tells_place,
    views_of,
)
from recognizer.touch.belief import VerifiedHypothesis
from recognizer.touch.reader import Reader
from recognizer.touch.recognise import recognise_with_rivals
from recognizer.touch.recognition import (
    TOO_FEW,
    Recognition,
    refusal,
)
from recognizer.touch.symbols.gain import Image, image_of_signal

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class SeenTouch:
    """What the last touch shows."""

    images: list[Image]  #: of each encoding
    views: tuple[tuple[tuple[LatticeView, ...], ...], ...]  #: as `ScanBelief.views`
    alone: Recognition | None  #: by itself; None: it lies where it was expected, nobody asked
    rivals: list[VerifiedHypothesis]  #: places that it may be by itself


@dataclass(frozen=True, slots=True, eq=False)
class JoinedTouch:
    """What the last touch and those before say together."""

    seen: SeenTouch
    touch_poses: TouchPoses  #: of all touches
    lattices: tuple[tuple[PlaneLattice, ...], ...]  #: as `ScanBelief.lattices`
    found: list[LocatedComposite]  #: places, best first
    answer: Recognition
    agrees: bool  #: whether the last touch agrees with the best of them


def join_touch(
    scan: ScanBelief,
    touches: Sequence[PlacedTouch],
    touch_poses: TouchPoses | None,
    *,
    expected: bool,
) -> JoinedTouch:
    """Return what touches say together, the last of which is new.

    Parameters
    ----------
    touch_poses
        Where they stand; None: a step was made that nobody measured.
    expected
        Whether the touch may be taken for what the others lead to expect, if it looks like that.
    """
    reader, limits, seq = scan.reader, scan.settings, touches[-1].seq
    seen = _see_touch(scan, touches[-1], touch_poses, expected=expected)
    steps = steps_of(touches, limits)
    lattices: list[tuple[PlaneLattice, ...]] = []
    stand: list[TouchPoses] = []
    found: list[LocatedComposite] = []
    for k, (encoding, _, _) in enumerate(reader.prepared):
        pitch, views = encoding.style.pitch_mm, views_of(seen.views[k])
        path = None
        if touch_poses is None:
            path = follow_path(encoding, seen.views[k], steps, reader.settings.hypotheses, limits)
            stand.append(path_touch_poses(path, steps))
            sums = _composites_along(views, stand[k], pitch, limits)
        else:
            stand.append(touch_poses)
            sums = _composites(views, touch_poses, scan.lattices[k], pitch, limits)
        lattices.append(tuple(item.agreement.lattice for item in sums))
        located = locate_composites(encoding, sums, limits, reader.settings.hypotheses)
        found += [replace(item, path=path) for item in located]
    found = distinct_places(found)
    answer, agrees, at = refusal(seq, TOO_FEW), False, stand[0]
    if found:
        at = next(poses for each, poses in zip(reader.prepared, stand, strict=True)
                  if each[0] is found[0].encoding)  # fmt: skip
    if found and (found[0].composite.agreement.chosen >= 0).sum() > 1:
        answer = answer_scan(reader, found, limits, seq)
        agrees = bool(found[0].composite.agreement.chosen[-1] >= 0)
        if answer:
            found[0], agrees = _pose_last_touch(reader, seen.images, found[0], at, limits)
            answer = answer_scan(reader, found, limits, seq)
    return JoinedTouch(seen, at, tuple(lattices), found, answer, agrees)


def _see_touch(
    scan: ScanBelief, touch: PlacedTouch, touch_poses: TouchPoses | None, *, expected: bool
) -> SeenTouch:
    """Return what the last touch shows: what is expected of it, or what it says by itself."""
    reader, limits = scan.reader, scan.settings
    images = [_image(reader, touch, each.style.height_mm) for each in reader.lab.arrays]
    near = [_expected_poses(each[: limits.guided], touch_poses) for each in scan.lattices]
    new: list[tuple[LatticeView, ...]] = [() for _ in images]
    if expected and scan.recognition and scan.astray == 0:
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
    return SeenTouch(images, views, alone, rivals)


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


def _image(reader: Reader, touch: PlacedTouch, height_mm: float) -> Image:
    signal = touch.signal
    return image_of_signal(reader.sensor, signal, height_mm, reader.settings)


def _expected_poses(lattices: tuple[PlaneLattice, ...], touch_poses: TouchPoses | None) -> Array:
    """Return where (k, 3) lattices lead to expect the last touch."""
    if touch_poses is None:
        return np.zeros((0, 3))
    at = [
        expected_at(each, touch_poses.poses[-1], touch_poses.covariances[-1])[0]
        for each in lattices
    ]
    return np.array(at).reshape(-1, 3)


def _composites_along(
    views: LatticeViews, touch_poses: TouchPoses, pitch_mm: float, limits: ScanSettings
) -> list[Composite]:
    """Return the sum of what agrees with the array that a path runs through; none, if nothing."""
    along = PlaneLattice(np.zeros(3), LATTICES.least * np.eye(3))
    agreement = refine_agreement(views, touch_poses, along, pitch_mm, limits)
    summed = composite(views, touch_poses, agreement, pitch_mm, limits)
    return [] if summed is None else [summed]


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
