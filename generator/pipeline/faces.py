"""What each face of an object shows, its expected recognition rate, and what would raise that.

A remedy has been tried: the face is laid out again, wider or at another pitch, and its rate is
computed again.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from encoded_objects.base.output import three_digits
from generator.alphabet.outline import SymbolStyle, footprint_half_mm
from generator.layout.blank import extent_mm, smallest_mm
from generator.layout.footprint import Points, Region, region_of
from generator.layout.lattice import LatticeRequest
from generator.layout.layout import lay_out_face
from generator.layout.placement import Layout
from generator.layout.places import rank_test
from generator.layout.recognition_rate import (
    LOW,
    PartRate,
    RecognitionRate,
    face_rate,
    face_rates,
    part_rate,
)
from generator.layout.sensor_view import Loops
from generator.pipeline.plan import ObjectPlan
from generator.plane.polygon import is_convex, signed_area
from generator.polyhedron import Polyhedron, face_normal, face_polygon
from generator.solid.plate import inset, regular

Size = tuple[float, float]  #: width and height in the face's frame, mm

TRIES = 150  #: poses on each face that is tried as a remedy
PITCHES_MM = (6.5, 6.0, 5.5, 5.0, 4.5, 4.0)
"""Tried as remedies, times the coarseness of the sensor; rates were measured from 4 to 7 mm."""
WIDER = 3.0  #: times the width that is tried at most
THICKER_MM = (2, 3, 4, 5, 6, 8, 10, 12, 15)  #: that bars of faces that are not convex are widened


@dataclass(frozen=True, slots=True)
class FaceReport:
    """One face; a round one counts as one, unrolled."""

    name: str
    place: str  #: which one it is: "the 12 x 70 mm face at x = 40"
    kind: str  #: plane, cylinder, cone
    size_mm: Size
    area_mm2: float
    symbols: int
    places: int  #: windows that fit, or one where all its symbols together name it
    promise: RecognitionRate | None  #: None where no rate was measured
    smallest_mm: Size | None = None  #: at which it would still show a place, in its proportions


def face_reports(
    plan: ObjectPlan, layout: Layout, *, smallest: bool = False
) -> tuple[FaceReport, ...]:
    """Return a report on every face that symbols can stand on.

    `smallest` says also how small each face could be, for which its layout is searched many times.
    """
    rates = _rates(plan, layout)
    request = LatticeRequest(
        plan.footprint_half_mm, plan.spec.style.pitch_mm, plan.array.window, rank_test(plan.array)
    )
    kinds = {surface.carrier: surface.kind for surface in plan.polyhedron.surfaces}
    known: dict[bytes, Size] = {}
    reports = []
    for face in layout.faces:
        if face.face in plan.blank_faces and not len(face.labels):
            continue
        outline = plan.developed.get(face.face) or face_polygon(plan.polyhedron, face.face)
        region = region_of(outline, plan.clearances_mm[face.face])
        edges = np.column_stack([region.start, region.end, region.clearance])
        key = (np.round(edges, 6) + 0.0).tobytes()
        if smallest and key not in known:
            known[key] = smallest_mm(region, request)
        size = extent_mm(region)
        reports.append(
            FaceReport(
                name=plan.polyhedron.faces[face.face].name,
                place=_place(plan.polyhedron, face.face, size, kinds.get(face.face, "")),
                kind=kinds.get(face.face, "plane"),
                size_mm=size,
                area_mm2=round(float(sum(signed_area(loop) for loop in outline)), 3),
                symbols=len(face.labels),
                places=face.places,
                promise=rates.get(face.face),
                smallest_mm=known.get(key),
            )
        )
    return tuple(reports)


def whole_rate(plan: ObjectPlan, layout: Layout, faces: Sequence[FaceReport]) -> PartRate | None:
    """Return the rate of the whole part; None where none was measured."""
    rates = {face.name: face.promise for face in faces}
    return part_rate(plan.polyhedron, layout.faces, rates)


def _place(polyhedron: Polyhedron, face: int, size: Size, kind: str) -> str:
    """Return words by which a person finds a face: its size, and where it lies (mm)."""
    width, height = sorted(size)
    corners = polyhedron.vertices[list(polyhedron.faces[face].loops[0])]
    axis = int(np.argmax(np.abs(face_normal(polyhedron, face))))
    middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
    if kind:
        where = f"of the {kind}"
    elif np.ptp(corners[:, axis]) < 1e-6 * np.ptp(polyhedron.vertices):
        where = f"at {'xyz'[axis]} = {middle[axis] + 0.0:.4g}"
    else:
        where = f"about ({', '.join(three_digits(round(value, 6) + 0.0) for value in middle)})"
    return f"the {three_digits(width)} x {three_digits(height)} mm face {where}"


def _rates(plan: ObjectPlan, layout: Layout) -> dict[int, RecognitionRate]:
    """Return the rate of each face by its number, low ones of flat faces with a remedy.

    A face whose places other faces cover for the most part has none.
    """
    round_faces = {surface.carrier for surface in plan.polyhedron.surfaces}
    faces = [face for face in layout.faces if len(face.labels) or face.face not in plan.blank_faces]
    array, sensor = plan.array, plan.spec.sensor
    cells = array.rows * array.columns
    rates = face_rates(
        plan.polyhedron, faces, array.order, cells, plan.spec.style, plan.alphabet, sensor
    )
    remedies: dict[tuple[float, float, bool, float], str] = {}
    for face, rate in list(rates.items()):
        if rate.at_once >= LOW or rate.blocked >= LOW or face in round_faces:
            continue
        # Faces of one width that are longer than a sensor have one remedy.
        loops = face_polygon(plan.polyhedron, face)
        narrow, wide = sorted(np.ptp(loops[0], axis=0).round(1).tolist())
        like = narrow, min(wide, 1.5 * sensor.across_mm), is_convex(loops[0]), rate.blocked
        if like not in remedies:
            remedies[like] = _remedy(plan, loops, face, LOW / (1 - rate.blocked))
        rates[face] = dataclasses.replace(rate, remedy=remedies[like])
    return rates


def _remedy(plan: ObjectPlan, loops: Loops, face: int, least: float) -> str:
    """Return what would bring the face's rate to this; empty if nothing that was tried does."""
    style = plan.spec.style
    region = region_of(plan.developed.get(face) or loops, plan.clearances_mm[face])
    found = []
    width, factor = _wider(plan, loops, region, least)
    if width:
        found.append(
            f"{math.ceil(width * factor - 1e-9):g} mm wide instead of {three_digits(width)}"
        )
    elif more := _thicker(plan, loops, plan.clearances_mm[face], least):
        found.append(f"{more:g} mm wider all along")
    for usual in PITCHES_MM:
        pitch = round(usual * plan.spec.sensor.coarseness, 1)
        if pitch >= style.pitch_mm:
            continue
        finer = plan.style_at(pitch)
        if finer is not None and _rate_of(plan, loops, region, finer) >= least:
            found.append(f"pitch {pitch:g} mm")
            break
    return " or ".join(found)


def _wider(plan: ObjectPlan, loops: Loops, region: Region, least: float) -> tuple[float, float]:
    """Return the width (mm) of a simple face and how many times wider it must be; zeros if not."""
    size = np.ptp(loops[0], axis=0)
    narrow = int(np.argmin(size))
    if len(region.start) != len(loops[0]) or not is_convex(loops[0]):
        return 0.0, 0.0

    def enough(factor: float) -> bool:
        stretch = np.ones(2)
        stretch[narrow] = factor
        wide = Region(region.start * stretch, region.end * stretch, region.clearance)
        return _rate_of(plan, (loops[0] * stretch,), wide, plan.spec.style) >= least

    low, high = 1.0, WIDER
    if not enough(high):
        return 0.0, 0.0
    while (high - low) * size[narrow] > 2.0:  # mm
        middle = (low + high) / 2
        low, high = (low, middle) if enough(middle) else (middle, high)
    return float(size[narrow]), high


def _thicker(plan: ObjectPlan, loops: Loops, clearances: Sequence[Points], least: float) -> int:
    """Return by how many mm a face of bars must be thicker, its outline moved outward; 0: none.

    Of faces that are not convex and have no holes: an L, a T, a frame that is cut open.
    """
    if len(loops) > 1 or is_convex(loops[0]):
        return 0
    for more in THICKER_MM:
        grown = (inset(loops[0], np.full(len(loops[0]), -more / 2)),)
        if not regular(loops, grown, more):
            return 0
        if _rate_of(plan, grown, region_of(grown, clearances), plan.spec.style) >= least:
            return more
    return 0


def _rate_of(plan: ObjectPlan, loops: Loops, region: Region, style: SymbolStyle) -> float:
    """Return the share of touches answered at once on a face that is laid out in a style."""
    half = footprint_half_mm(plan.alphabet, style)
    face = lay_out_face(region, plan.array, style.pitch_mm, half)
    return face_rate(loops, face, style, plan.alphabet, plan.spec.sensor, TRIES).at_once
