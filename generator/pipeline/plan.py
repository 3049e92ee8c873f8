"""Spec -> what the stages need: polyhedron, array, outlines and clearances; lengths in mm.

Every error is given the line of the setting that causes it. A round face is no flat panel, so an
object that has one is printed whole. Each round face is laid out on its development, under the
number of its first facet; the other facets carry nothing. What one body stands on when it is
printed stays blank.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from generator.alphabet.known import Alphabet
from generator.alphabet.outline import SymbolStyle, Tiers, footprint_half_mm, outlines
from generator.alphabet.printable import check_printable, is_printable
from generator.array import SymbolArray, array_from
from generator.errors import LayoutError, SolidError
from generator.layout.layout import Clearances, Outlines
from generator.layout.recognition_rate import like_measured
from generator.polyhedron import Polyhedron, dihedral, face_polygon
from generator.polyhedron.development import Development, development
from generator.polyhedron.front import Loop, covered_parts
from generator.polyhedron.mount import with_mount
from generator.polyhedron.shapes import ROUND_SHAPES, SHAPES
from generator.polyhedron.standing import Stance, best_stance, stance_on
from generator.polyhedron.winged import Developable
from generator.printers import Printer
from generator.solid.analytic import bend_problem
from generator.solid.part import edge_numbers
from generator.solid.plate import (
    cut_corners,
    plain_panels,
    symbol_clearance_mm,
    top_inset_mm,
    top_insets_mm,
)
from generator.spec import ObjectSpec, ShapeSpec
from generator.spec.problem import error_location

FACES_LISTED = 8  #: faces that a message lists by name
TAG_BACK = 1  #: face that a tag lies on
SHARP_MM = 5.0  #: by which panels end before an edge that stays open, said beyond
LAYER_MM = 0.02  # by which a printed height may differ from the designed one, unsaid


@dataclass(frozen=True, slots=True)
class ObjectPlan:
    """One object, ready to be laid out and built."""

    spec: ObjectSpec
    polyhedron: Polyhedron
    array: SymbolArray
    alphabet: Alphabet
    outlines: tuple[Tiers, ...]  #: one per label of the array
    footprint_half_mm: float  #: half side of the square that holds every symbol's foot
    clearances_mm: Clearances  #: [face][loop][edge], from the edge to the nearest foot
    #: round faces by the facet that carries them, unrolled; faces less what is covered
    developed: Outlines = field(default_factory=dict)
    blank_faces: frozenset[int] = frozenset()  #: that carry no symbols of their own
    stance: Stance | None = None  #: how one body stands on the bed; None: as it was modelled
    notes: tuple[str, ...] = ()  #: what was decided for the person who asked

    @property
    def printer(self) -> Printer:
        """What prints it."""
        return self.spec.printer

    def style_at(self, pitch_mm: float) -> SymbolStyle | None:
        """Return the symbols at another pitch, strokes in proportion; None: they do not print."""
        style = self.spec.style
        stroke = round(style.stroke_mm * pitch_mm / style.pitch_mm, 2)
        style = replace(style, pitch_mm=pitch_mm, stroke_mm=stroke)
        return style if is_printable(self.alphabet, style, self.printer) else None

    @property
    def meaning(self) -> dict[str, Any]:
        """What is registered as the spec: equal values mean the same object."""
        meaning = self.spec.meaning
        if self.polyhedron.surfaces:
            surfaces = [surface.definition() for surface in self.polyhedron.surfaces]
            meaning["surfaces"] = surfaces
        return meaning


@dataclass(frozen=True, slots=True)
class RoundFaces:
    """The round faces that carry symbols, and the faces that carry none."""

    developments: Mapping[int, Development]  #: by the facet that carries them
    blank: frozenset[int]
    notes: tuple[str, ...]

    def shown(self, polyhedron: Polyhedron) -> bool:
        """Whether a face is left that can carry symbols."""
        return len(self.blank - set(self.developments)) < len(polyhedron.faces)

    def without(self, blank: Collection[int], *notes: str) -> RoundFaces:
        """Return the faces when more stay blank."""
        left = {facet: flat for facet, flat in self.developments.items() if facet not in blank}
        return RoundFaces(left, self.blank | set(blank), (*self.notes, *notes))


def plan_objects(
    specs: Sequence[ObjectSpec], solid: Polyhedron | None = None
) -> tuple[ObjectPlan, ...]:
    """Return the plan of each object; copies share the work."""
    known: dict[tuple[str, Path | None], ObjectPlan] = {}
    plans = []
    for spec in specs:
        key = repr(spec.meaning), spec.shape.file
        if key not in known:
            known[key] = plan_object(spec, solid)
        plan = known[key]
        chosen = {name: getattr(plan.spec, name) for name in ("parts", "down", "blank", "mount")}
        plans.append(replace(plan, spec=replace(spec, **chosen)))
    return tuple(plans)


def plan_object(spec: ObjectSpec, solid: Polyhedron | None = None) -> ObjectPlan:
    """Return the plan of one object; `solid` is its shape where that does not come from the spec.

    Raises
    ------
    SpecError
        The shape is not a solid, the array cannot be made, its symbols do not suit the
        alphabet, or the printer cannot make them: at the line that says so.
    """
    source, printer = spec.source, spec.printer
    with error_location(source, "shape"):
        polyhedron = _polyhedron(spec.shape) if solid is None else solid
    spec, polyhedron = _mounted(_as_one_part(spec, polyhedron), polyhedron)
    with error_location(source, "encoding, profile"):
        array = array_from(spec.encoding)
    alphabet = spec.alphabet
    with error_location(source, "symbols.pitch, symbols, profile"):
        check_printable(alphabet, spec.style, printer)
        shapes = outlines(alphabet, spec.style)
        half = footprint_half_mm(alphabet, spec.style)
    reach = 2.0 * spec.style.height_mm + printer.gap_min_mm  # room for symbols of two faces
    with error_location(source, "shape"):
        faces = _round_faces(polyhedron, shapes, spec, reach)
    spec, faces, stance = _blank_faces(polyhedron, spec, faces)
    plain = sorted(set(range(len(polyhedron.faces))) - faces.blank - faces.developments.keys())
    covered = covered_parts(polyhedron, plain, reach)
    kept_free = {**covered, **_cut_corners(polyhedron, spec, covered)}
    outlines_of = {k: (*face_polygon(polyhedron, k), *loops) for k, loops in kept_free.items()}
    outlines_of |= {number: (face.outline,) for number, face in faces.developments.items()}
    return ObjectPlan(
        spec,
        polyhedron,
        array,
        alphabet,
        shapes,
        half,
        _clearances(polyhedron, spec, faces, kept_free),
        outlines_of,
        faces.blank,
        stance,
        (*faces.notes, *_notes(polyhedron, spec, covered, reach)),
    )


def _as_one_part(spec: ObjectSpec, polyhedron: Polyhedron) -> ObjectSpec:
    """Return the spec of an object with round faces or a mount as one that is printed whole."""
    one = spec.mount or polyhedron.kind == "tag"
    if not (polyhedron.surfaces or polyhedron.blank or one) or spec.parts == "whole":
        return spec
    asked = spec.source.value.get("print")
    if isinstance(asked, dict) and asked.get("parts") == "panels":
        why = "a round face cannot be printed as a flat panel"
        if one:
            why = f"a {'part with a mount' if spec.mount else 'tag'} is printed in one piece"
        with error_location(spec.source, "print.parts"):
            raise SolidError(why, fix="set parts to whole")
    return replace(spec, parts="whole")


def _mounted(spec: ObjectSpec, polyhedron: Polyhedron) -> tuple[ObjectSpec, Polyhedron]:
    """Return the solid with the holes of its mount, and the spec with the face that is held."""
    mount = spec.mount
    if mount is None:
        return spec, polyhedron
    with error_location(spec.source, "mount.face, mount"):
        name = mount.face
        face = _facets(polyhedron, name)[0] if name else _held_face(spec, polyhedron)
        bent = {facet for surface in polyhedron.surfaces for facet in surface.facets}
        if face in bent or (face in polyhedron.blank and polyhedron.kind != "tag"):
            raise SolidError(f"{mount.face} is round, a mount needs a flat face", fix="face: F1")
        name = polyhedron.faces[face].name
        return replace(spec, mount=replace(mount, face=name)), with_mount(polyhedron, mount, face)


def _held_face(spec: ObjectSpec, polyhedron: Polyhedron) -> int:
    """Return the face that is mounted where the spec names none: the one that is down."""
    if spec.down not in ("", "none"):
        return _facets(polyhedron, spec.down)[0]
    if polyhedron.kind == "tag":
        return TAG_BACK
    stance = best_stance(polyhedron, _flat(polyhedron), math.sin(spec.printer.overhang_max_rad))
    return 0 if stance is None else stance.face


def _facets(polyhedron: Polyhedron, name: str) -> list[int]:
    """Return the faces that a name stands for: one, or the facets of a round face."""
    known: dict[str, list[int]] = {}
    for number, face in enumerate(polyhedron.faces):
        known.setdefault(face.name.partition(".")[0], []).append(number)
    if name not in known:
        fix = f"name one of {', '.join(known)}"
        if len(known) > FACES_LISTED:
            fix = f"name one of F1 to {list(known)[-1]}; the picture NAME.png shows them"
        raise LayoutError(f"the object has no face {name}", fix=fix)
    return known[name]


def _flat(polyhedron: Polyhedron) -> set[int]:
    """Return the flat faces that can carry symbols."""
    bent = {facet for surface in polyhedron.surfaces for facet in surface.facets}
    return set(range(len(polyhedron.faces))) - bent - set(polyhedron.blank)


def _round_faces(
    polyhedron: Polyhedron, tiers: tuple[Tiers, ...], spec: ObjectSpec, reach: float
) -> RoundFaces:
    """Unroll the round faces; one whose curvature the printer cannot follow stays blank."""
    developments: dict[int, Development] = {}
    blank = set(polyhedron.blank)
    notes: list[str] = []
    surfaces = [one for one in polyhedron.surfaces if one.carrier not in blank]
    unrolled = [development(polyhedron, surface) for surface in surfaces]
    problems = [bend_problem(each, tiers, spec.style, spec.printer) for each in unrolled]
    bent = [s for s, problem in zip(surfaces, problems, strict=True) if not problem]
    covered = covered_parts(polyhedron, [facet for s in bent for facet in s.facets], reach)
    for surface, flat, problem in zip(surfaces, unrolled, problems, strict=True):
        name = polyhedron.faces[surface.carrier].name
        if not problem and not covered.keys().isdisjoint(surface.facets):
            problem = f"another face is nearer than {reach:.2g} mm in front of it"
        if not problem and surface.concave:
            problem = _bore_problem(surface, spec)
        if problem:
            notes.append(f"{surface.kind} {name} stays blank: {problem}")
            blank |= set(surface.facets)
        else:
            developments[surface.carrier] = flat
            blank |= set(surface.facets[1:])
    found = RoundFaces(developments, frozenset(blank), tuple(notes))
    if not found.shown(polyhedron):
        why = "; ".join((*polyhedron.notes, *notes))
        fix = "give it a planar face, or a cylinder or cone face between two circles"
        if not why and spec.mount:
            why = f"the mount takes {spec.mount.face}, the only one that could"
            fix = "mount another face, or leave out which one"
        raise LayoutError(f"no face of the object carries symbols: {why}", fix=fix)
    return found


def _bore_problem(surface: Developable, spec: ObjectSpec) -> str:
    """Return why a sensor does not reach the wall of a hole; "" where it does."""
    radius, half = surface.radius_mm, min(spec.sensor.half_mm)
    gap = radius - math.sqrt(max(radius**2 - half**2, 0.0))
    if gap <= spec.style.height_mm:
        return ""
    return f"a sensor {2 * half:.3g} mm wide does not reach the wall of this hole"


def _blank_faces(
    polyhedron: Polyhedron, spec: ObjectSpec, faces: RoundFaces
) -> tuple[ObjectSpec, RoundFaces, Stance | None]:
    """Leave faces blank: as the spec says, and what one body stands on.

    Settings that say what holds without them are dropped, so that they mean the same object.
    """
    source = spec.source
    with error_location(source, "print.blank"):
        asked = {name: _facets(polyhedron, name) for name in spec.blank}
        carried = faces.without([number for facets in asked.values() for number in facets])
        if not carried.shown(polyhedron):
            fix = "take a face with symbols out of the list"
            raise LayoutError("all faces are blank, so that no touch names a place", fix=fix)
    stance = None
    with error_location(source, "print.down"):
        if spec.parts == "panels" and spec.down:
            fix = "leave it out, or set parts to whole"
            raise SolidError("every panel lies on its back: none stands on a face", fix=fix)
        if spec.parts == "whole" and spec.down != "none":
            stance = _chosen_stance(polyhedron, spec)
            if stance is not None and not carried.without(stance.on_bed).shown(polyhedron):
                stance = None
        if spec.down not in ("", "none"):
            chosen, facets = stance, _facets(polyhedron, spec.down)
            steepest = math.sin(spec.printer.overhang_max_rad)
            stance = stance_on(polyhedron, facets[0], steepest) if len(facets) == 1 else None
            if stance is None:
                fix = "take a flat face on the outside, or leave it out: one is chosen"
                raise SolidError(f"the part cannot stand on {spec.down}", fix=fix)
            if not carried.without(stance.on_bed).shown(polyhedron):
                fix = "take another face, or none: then no face is blank for the bed"
                raise SolidError(f"only {spec.down} would carry symbols", fix=fix)
            if chosen is not None and chosen.face == stance.face:
                spec = replace(spec, down="")
    if stance is not None:
        names = ", ".join(polyhedron.faces[face].name for face in stance.on_bed)
        on_it = "it" if len(stance.on_bed) == 1 else "them"
        note = f"{names} stay{'s' * (on_it == 'it')} blank: the part is printed standing on {on_it}"
        carried = carried.without(stance.on_bed, *([note] if polyhedron.kind != "tag" else []))
        kept = [name for name, facets in asked.items() if facets[0] not in stance.on_bed]
        spec = replace(spec, blank=tuple(kept))
    return spec, carried, stance


def _chosen_stance(polyhedron: Polyhedron, spec: ObjectSpec) -> Stance | None:
    """Return how one body stands where the spec does not say: on its mount if it can."""
    steepest = math.sin(spec.printer.overhang_max_rad)
    held = TAG_BACK if polyhedron.kind == "tag" else None
    if spec.mount is not None:
        (held,) = _facets(polyhedron, spec.mount.face)
    if held is not None and (stance := stance_on(polyhedron, held, steepest)) is not None:
        return stance
    return best_stance(polyhedron, _flat(polyhedron), steepest)


def _notes(
    polyhedron: Polyhedron, spec: ObjectSpec, covered: Collection[int], reach: float
) -> Iterator[str]:
    """Yield what the person who asked should know of an object as it is planned."""
    printer, height = spec.printer, spec.style.height_mm
    if covered:
        names = ", ".join(polyhedron.faces[face].name for face in covered)
        yield f"no symbols where another face is nearer than {reach:.2g} mm in front of: {names}"
    wall = spec.wall_mm if spec.parts == "panels" else 0.0
    if wall and (sharp := _sharp_edges(polyhedron, spec)):
        where = ", ".join(f"{names} ({mm:.0f} mm)" for names, mm in sharp.items())
        yield (
            "panels end that far before the edge where faces meet sharply, which stays open: "
            f"{where}; print it in one piece (print: {{parts: whole}})"
        )
    if spec.coarser:
        pitch, usual = spec.style.pitch_mm, spec.sensor.symbol_pitch_mm
        yield f"pitch {pitch:g} mm is taken; at {usual:g} mm: {spec.coarser}"
    if printer.nozzle_mm:
        low, high = (printer.printed_mm(z) if z else 0.0 for z in (wall, wall + height))
        if not wall:
            high = round(height / printer.layer_mm) * printer.layer_mm
        if abs(low - wall) >= LAYER_MM or abs(high - low - height) >= LAYER_MM:
            walls = f"walls of {wall:g} mm print {low:g} mm, " if abs(low - wall) > LAYER_MM else ""
            better = f"wall {low:g} mm and height" if walls else "height"
            whole = max(1, round(height / printer.layer_mm)) * printer.layer_mm
            yield (
                f"{walls}symbols of {height:g} mm print {high - low:.3g} mm high at layers of "
                f"{printer.layer_mm:g} mm: {better} {whole:g} mm are whole layers"
            )
    if (like := like_measured(spec.sensor)) != spec.sensor.name:
        yield (
            f"promises for {spec.sensor.name} are those of {like}, not measured: validate-set on "
            "this database measures what is answered"
        )


def _sharp_edges(polyhedron: Polyhedron, spec: ObjectSpec) -> dict[str, float]:
    """Return where panels end far before an edge, their mitres being too thin to print, mm."""
    found = {}
    for number, edge in enumerate(polyhedron.edges):
        angle = dihedral(polyhedron, number)
        inset = top_inset_mm(angle, spec.wall_mm, spec.printer, spec.gap_mm)
        if angle < math.pi and inset > SHARP_MM:
            names = (polyhedron.faces[k].name for k in sorted((edge.left, edge.right)))
            found[" and ".join(names)] = inset
    return found


def _polyhedron(shape: ShapeSpec) -> Polyhedron:
    if shape.file is not None:
        return _model(shape.file, shape.parameters["sha256"], shape.parameters.get("scale", 1.0))
    known = {**SHAPES, **ROUND_SHAPES}
    return known[shape.kind](**shape.parameters)


@lru_cache(maxsize=8)
def _model(file: Path, sha256: str, scale: float) -> Polyhedron:  # noqa: ARG001 - tells contents apart
    """Read a model once for all its copies and for all arrays that are tried."""
    from generator.polyhedron.read import read_shape  # readers load only for files

    return read_shape(file, scale)


def _cut_corners(
    polyhedron: Polyhedron, spec: ObjectSpec, covered: Mapping[int, tuple[Loop, ...]]
) -> dict[int, tuple[Loop, ...]]:
    """Return what is cut off the tops of panels, and what other faces cover of these faces."""
    if spec.parts != "panels":
        return {}
    try:
        plain = plain_panels(polyhedron, spec.wall_mm, spec.printer, spec.gap_mm, spec.name)
    except SolidError:
        return {}  # the error is raised with its place when the parts are built
    cut = cut_corners(polyhedron, plain, spec.printer)
    return {face: (*covered.get(face, ()), *loops) for face, loops in cut.items()}


def _clearances(
    polyhedron: Polyhedron,
    spec: ObjectSpec,
    faces: RoundFaces,
    covered: Mapping[int, tuple[Loop, ...]],
) -> Clearances:
    """Return what printer, mitre and the neighbouring face's symbols need along each edge."""
    printer = spec.printer
    apart = {
        edge: symbol_clearance_mm(dihedral(polyhedron, number), spec.style.height_mm)
        for edge, number in edge_numbers(polyhedron).items()
    }
    clearances = []
    for number, face in enumerate(polyhedron.faces):
        loops = [list(zip(loop, loop[1:] + loop[:1], strict=True)) for loop in face.loops]
        if number in faces.developments:
            loops = [faces.developments[number].outline_edges()]
        needs = [np.array([apart[edge] for edge in loop]) for loop in loops]
        if spec.parts == "panels":
            insets = top_insets_mm(polyhedron, number, spec.wall_mm, printer, gap_mm=spec.gap_mm)
            needs = [np.maximum(need, inset) for need, inset in zip(needs, insets, strict=True)]
        needs += [np.zeros(len(loop)) for loop in covered.get(number, ())]
        clearances.append(tuple(printer.edge_min_mm + need for need in needs))
    return tuple(clearances)
