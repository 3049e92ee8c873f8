"""What the faces of an object promise, and what would help those that promise little.

Plan + layout -> a promise for each flat face: the share of single touches that are answered. A
remedy has been tried: the face is laid out anew, wider or at another pitch, and looked at again.
Of round faces, and of arrays that are read by a scan, nothing was measured and nothing is said.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from encoded_objects.sensor_type import USUAL_SENSOR, SensorSize
from generator.alphabet.outline import SymbolStyle, footprint_half_mm
from generator.alphabet.printable import check_printable
from generator.array.touches import touches_needed
from generator.errors import GeneratorError
from generator.layout.footprint import Points, Region, region_of
from generator.layout.lattice import choose_lattice
from generator.layout.placement import FaceLayout, Layout, Placement
from generator.layout.places import array_cells, rank_test
from generator.layout.promise import PROMISE, measured_answers, promised_share
from generator.layout.views import VIEWS, SensorView, ViewSettings, face_views
from generator.pipeline.plan import ObjectPlan
from generator.plane.polygon import is_convex
from generator.polyhedron import face_polygon

Loops = tuple[Points, ...]


@dataclass(frozen=True, slots=True)
class FacePromise:
    """Of one flat face."""

    at_once: float  #: share of touches, the sensor's centre on the face, that are answered
    within_three: float | None = None  #: the same of up to three touches; not modelled yet
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
            share, one_row = _share(plan, loops, face, plan.spec.style)
            remedy = ""
            if share < PROMISE.low:  # faces as narrow, longer than a sensor, need the same
                narrow, wide = sorted(np.ptp(loops[0], axis=0).round(1).tolist())
                like = narrow, min(wide, 1.5 * across), is_convex(loops[0])
                if like not in remedies:
                    remedies[like] = _remedy(plan, loops, face.face)
                remedy = remedies[like]
            known[key] = FacePromise(round(share, 3), None, one_row, remedy)
        found[face.face] = known[key]
    return found


def _share(
    plan: ObjectPlan,
    loops: Loops,
    face: FaceLayout,
    style: SymbolStyle,
    settings: ViewSettings = VIEWS,
) -> tuple[float, bool]:
    """Return the share of touches answered, and whether they show one row of symbols."""
    if not len(face.labels):
        return 0.0, False
    reach = plan.alphabet.reach * style.pitch_mm + style.stroke_mm / 2
    view = SensorView(plan.spec.sensor.half_mm, reach)
    views = face_views(loops, face, style.pitch_mm, view, settings)
    one_row = bool((views.lines <= 1).mean() >= PROMISE.one_line)
    pitch = style.pitch_mm / _fineness(plan.spec.sensor)
    return promised_share(views, measured_answers(), pitch), one_row


def _fineness(sensor: SensorSize) -> float:
    """Return how many times coarser a sensor is than that of the measured table."""
    return sensor.pitch_mm / USUAL_SENSOR.pitch_mm


def _remedy(plan: ObjectPlan, loops: Loops, face: int) -> str:
    """Return what would bring the face to `PROMISE.low`; empty if nothing that was tried does."""
    style = plan.spec.style
    region = region_of(plan.developed.get(face) or loops, plan.clearances_mm[face])
    found = []
    width, factor = _wider(plan, loops, region)
    if width:
        found.append(f"{math.ceil(width * factor - 1e-9):g} mm wide instead of {width:.3g}")
    for usual in PROMISE.pitches_mm:
        pitch = round(usual * _fineness(plan.spec.sensor), 1)
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


def _prints(plan: ObjectPlan, style: SymbolStyle) -> bool:
    try:
        check_printable(plan.alphabet, style, plan.printer)
    except GeneratorError:
        return False
    return True


def _tried(plan: ObjectPlan, loops: Loops, region: Region, style: SymbolStyle) -> float:
    """Return the promise of a face laid out anew."""
    array = plan.array
    half = footprint_half_mm(plan.alphabet, style)
    identifies = rank_test(array)
    lattice = choose_lattice([region], half, style.pitch_mm, array.window, identifies, search=False)
    cells, pitch = lattice.cells[0], style.pitch_mm
    rows, columns = array_cells(cells, 0)
    c, s = math.cos(lattice.rotation_rad), math.sin(lattice.rotation_rad)
    centres = (cells[:, ::-1] * pitch + [lattice.x_mm, lattice.y_mm]) @ np.array([[c, -s], [s, c]])
    place = Placement(
        0, 0, lattice.rotation_rad, pitch / 2 - lattice.x_mm, -pitch / 2 - lattice.y_mm
    )
    none = np.zeros(len(cells), np.int64)
    face = FaceLayout(0, place, rows, columns, none, centres, lattice.places[0])
    return _share(plan, loops, face, style, ViewSettings(PROMISE.tries))[0]


def face_key(loops: Loops, face: FaceLayout) -> bytes:
    """Return the same bytes for faces that show the same at every pose."""
    place = face.placement
    turn = np.array([math.cos(place.rotation_rad), math.sin(place.rotation_rad)])
    numbers = [np.concatenate(loops).ravel(), face.centres_mm.ravel(), turn]
    return (np.round(np.concatenate(numbers), 6) + 0.0).tobytes()
