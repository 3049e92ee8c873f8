"""What the faces of an object promise, and what would help those that promise little.

Plan + layout -> a promise for each flat face: the share of touches that are answered at once, and
within three. A remedy has been tried: the face is laid out anew, wider or at another pitch, and
looked at again.
Of round faces, and of arrays that are read by a scan, nothing was measured and nothing is said.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from encoded_objects.base.sensor_type import SensorType
from generator.alphabet.outline import SymbolStyle, footprint_half_mm
from generator.alphabet.printable import check_printable
from generator.array.touches import touches_needed
from generator.errors import GeneratorError
from generator.layout.footprint import Points, Region, region_of
from generator.layout.layout import lay_out_face
from generator.layout.placement import FaceLayout, Layout
from generator.layout.promise import PROMISE, measured_answers, promised_shares
from generator.layout.views import VIEWS, FaceViews, ViewSettings, face_views, sensor_view
from generator.pipeline.plan import ObjectPlan
from generator.plane.polygon import is_convex
from generator.polyhedron import face_polygon
from generator.solid.inset import inset, regular

Loops = tuple[Points, ...]


@dataclass(frozen=True, slots=True)
class FacePromise:
    """Of one flat face."""

    at_once: float  #: share of touches, the sensor's centre on the face, that are answered
    #: the same of up to three, each where the answer before says; None: no such measurement
    within_three: float | None
    one_row: bool = False  #: touches show one row of symbols
    remedy: str = ""  #: what would make it answer most touches, where it does not


def promise_faces(plan: ObjectPlan, layout: Layout) -> dict[int, FacePromise]:
    """Return the promise of each flat face by its number; equal faces share the work.

    Parameters
    ----------
    plan, layout
        An object and its symbols.
    """
    array, across = plan.array, plan.spec.sensor.across_mm
    cells = array.rows * array.columns
    if touches_needed(array.order, cells, layout.pitch_mm, sensor_mm=across) > 1:
        return {}
    carriers = {surface.carrier for surface in plan.polyhedron.surfaces}
    known: dict[bytes, FacePromise] = {}
    remedies: dict[tuple[float, float, bool], str] = {}
    found = {}
    for face in layout.faces:
        if face.face in plan.blank_faces or face.face in carriers:
            continue
        loops = tuple(face_polygon(plan.polyhedron, face.face))
        key = face_key(loops, face)
        if key not in known:
            promise = _promise(plan, loops, face, plan.spec.style)
            if promise.at_once < PROMISE.low:
                # faces as narrow, longer than a sensor, need the same
                narrow, wide = sorted(np.ptp(loops[0], axis=0).round(1).tolist())
                like = narrow, min(wide, 1.5 * across), is_convex(loops[0])
                if like not in remedies:
                    remedies[like] = _remedy(plan, loops, face.face)
                promise = dataclasses.replace(promise, remedy=remedies[like])
            known[key] = promise
        found[face.face] = known[key]
    return found


def _promise(
    plan: ObjectPlan,
    loops: Loops,
    face: FaceLayout,
    style: SymbolStyle,
    settings: ViewSettings = VIEWS,
) -> FacePromise:
    """Return what a face promises, without a remedy."""
    if not len(face.labels):
        return FacePromise(0.0, 0.0)
    reach = plan.alphabet.reach * style.pitch_mm + style.stroke_mm / 2
    view = sensor_view(plan.spec.sensor, reach)
    views = face_views(loops, face, style.pitch_mm, view, settings)
    one_row = bool((views.lines <= 1).mean() >= PROMISE.one_line)
    promise = promise_of(views, style.pitch_mm, plan.spec.sensor)
    return dataclasses.replace(promise, one_row=one_row)


def promise_of(views: FaceViews, pitch_mm: float, sensor: SensorType) -> FacePromise:
    """Return the shares that a face promises to a sensor, to three places.

    Parameters
    ----------
    views
        Of the face.
    pitch_mm
        Of its symbols.
    sensor
        That touches it.
    """
    once, within = promised_shares(views, measured_answers(), pitch_mm, sensor)
    return FacePromise(round(once, 3), None if within is None else round(within, 3))


def _remedy(plan: ObjectPlan, loops: Loops, face: int) -> str:
    """Return what would bring the face to `PROMISE.low`; empty if nothing that was tried does."""
    style = plan.spec.style
    region = region_of(plan.developed.get(face) or loops, plan.clearances_mm[face])
    found = []
    width, factor = _wider(plan, loops, region)
    if width:
        found.append(f"{math.ceil(width * factor - 1e-9):g} mm wide instead of {width:.3g}")
    elif more := _thicker(plan, loops, plan.clearances_mm[face]):
        found.append(f"{more:g} mm wider all along")
    for usual in PROMISE.pitches_mm:
        pitch = round(usual * plan.spec.sensor.coarseness, 1)
        if pitch >= style.pitch_mm:
            continue
        finer = dataclasses.replace(
            style, pitch_mm=pitch, stroke_mm=round(style.stroke_mm * pitch / style.pitch_mm, 2)
        )
        if _prints(plan, finer) and _tried(plan, loops, region, finer) >= PROMISE.low:
            found.append(f"pitch {pitch:g} mm")
            break
    return " or ".join(found)


def _wider(plan: ObjectPlan, loops: Loops, region: Region) -> tuple[float, float]:
    """Return the width (mm) of a simple face and how many times wider it must be; zeros if not."""
    size = np.ptp(loops[0], axis=0)
    narrow = int(np.argmin(size))
    if len(region.start) != len(loops[0]) or not is_convex(loops[0]):
        return 0.0, 0.0

    def keeps(factor: float) -> bool:
        stretch = np.ones(2)
        stretch[narrow] = factor
        wide = Region(region.start * stretch, region.end * stretch, region.clearance)
        loop = (loops[0] * stretch,)
        return _tried(plan, loop, wide, plan.spec.style) >= PROMISE.low

    low, high = 1.0, PROMISE.wider
    if not keeps(high):
        return 0.0, 0.0
    while (high - low) * size[narrow] > 2.0:  # mm
        middle = (low + high) / 2
        low, high = (low, middle) if keeps(middle) else (middle, high)
    return float(size[narrow]), high


def _thicker(plan: ObjectPlan, loops: Loops, clearances: Sequence[Points]) -> int:
    """Return by how many mm a face of bars must be thicker, its outline moved outward; 0: none.

    Of faces that are not convex and have no holes: an L, a T, a frame that is cut open.
    """
    if len(loops) > 1 or is_convex(loops[0]):
        return 0
    for more in PROMISE.thicker_mm:
        grown = (inset(loops[0], np.full(len(loops[0]), -more / 2)),)
        if not regular(loops, grown, more):
            return 0
        if _tried(plan, grown, region_of(grown, clearances), plan.spec.style) >= PROMISE.low:
            return more
    return 0


def _prints(plan: ObjectPlan, style: SymbolStyle) -> bool:
    try:
        check_printable(plan.alphabet, style, plan.printer)
    except GeneratorError:
        return False
    return True


def _tried(plan: ObjectPlan, loops: Loops, region: Region, style: SymbolStyle) -> float:
    """Return the promise of a face laid out anew."""
    half = footprint_half_mm(plan.alphabet, style)
    face = lay_out_face(region, plan.array, style.pitch_mm, half)
    return _promise(plan, loops, face, style, ViewSettings(PROMISE.tries)).at_once


def face_key(loops: Loops, face: FaceLayout) -> bytes:
    """Return the same bytes for faces that show the same at every pose."""
    place = face.placement
    turn = np.array([math.cos(place.rotation_rad), math.sin(place.rotation_rad)])
    numbers = [np.concatenate(loops).ravel(), face.centres_mm.ravel(), turn]
    return (np.round(np.concatenate(numbers), 6) + 0.0).tobytes()
