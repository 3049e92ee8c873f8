"""Spec -> what the stages need: polyhedron, array, outlines and clearances.

Every error is given the line of the setting that causes it. Lengths in mm.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from generator.alphabet.known import Alphabet, alphabet_named
from generator.alphabet.outline import Tiers, footprint_half_mm, outlines
from generator.alphabet.printable import check_printable
from generator.array import SymbolArray, array_from
from generator.errors import ArrayError, SolidError
from generator.layout.layout import Clearances, Outlines
from generator.pipeline.blame import errors_at
from generator.pipeline.round import RoundFaces, as_one_part, reach_mm, round_faces
from generator.polyhedron import Polyhedron, dihedral, face_polygon
from generator.polyhedron.front import Loop, covered_parts
from generator.polyhedron.round import ROUND_SHAPES
from generator.polyhedron.shapes import SHAPES
from generator.printers import Printer
from generator.solid.mitre import symbol_clearance_mm
from generator.solid.part import edge_numbers
from generator.solid.plate import cut_corners, plain_panels, top_insets_mm
from generator.spec import LocatedSpec, ObjectSpec, ShapeSpec

LAYER_MM = 0.02  # by which a printed height may differ from the designed one, unsaid


@dataclass(frozen=True, slots=True)
class ObjectPlan:
    """One object, ready to be laid out and built."""

    located: LocatedSpec
    polyhedron: Polyhedron
    array: SymbolArray
    alphabet: Alphabet
    outlines: tuple[Tiers, ...]  #: one per label of the array
    footprint_half_mm: float  #: half side of the square that holds every symbol's foot
    clearances_mm: Clearances  #: [face][loop][edge], from the edge to the nearest foot
    printer: Printer
    developed: Outlines = field(
        default_factory=dict
    )  #: round faces by the facet that carries them, unrolled; faces less what is covered
    blank_faces: frozenset[int] = frozenset()  #: that carry no symbols of their own
    notes: tuple[str, ...] = ()  #: what was decided for the person who asked

    @property
    def spec(self) -> ObjectSpec:
        """The spec that this plan comes from."""
        return self.located.spec

    @property
    def meaning(self) -> dict[str, Any]:
        """What is registered as the spec: equal values mean the same object."""
        meaning = self.spec.meaning
        if self.polyhedron.surfaces:
            surfaces = [surface.definition() for surface in self.polyhedron.surfaces]
            meaning["surfaces"] = surfaces
        return meaning


def plan_object(located: LocatedSpec, solid: Polyhedron | None = None) -> ObjectPlan:
    """Return the plan of one object.

    Parameters
    ----------
    located
        Its spec.
    solid
        Its shape, where it does not come from the spec.

    Raises
    ------
    SpecError
        The shape is not a solid, the array cannot be made, its symbols do not suit the
        alphabet, or the printer cannot make them: at the line that says so.
    """
    spec = located.spec
    printer = spec.printer
    with errors_at(located, "shape"):
        polyhedron = _polyhedron(spec.shape) if solid is None else solid
    located = as_one_part(located, polyhedron)
    spec = located.spec
    with errors_at(located, "encoding, profile"):
        array = array_from(spec.encoding)
    with errors_at(located, "symbols.alphabet, encoding.alphabet, profile"):
        alphabet = alphabet_named(spec.alphabet)
        _check_order(alphabet, array)
    with errors_at(located, "symbols.pitch, symbols, profile"):
        check_printable(alphabet, spec.style, printer)
        shapes = outlines(alphabet, spec.style)
        half = footprint_half_mm(alphabet, spec.style)
    with errors_at(located, "shape"):
        faces = round_faces(polyhedron, shapes, spec, printer)
    plain = [k for k in range(len(polyhedron.faces)) if k not in faces.blank]
    plain = [k for k in plain if k not in faces.developments]
    covered = covered_parts(polyhedron, plain, reach_mm(spec, printer))
    kept_free = {**covered, **_cut_corners(polyhedron, spec, printer, covered)}
    clearances = _clearances(polyhedron, spec, printer, faces, kept_free)
    outlines_of = {k: (*face_polygon(polyhedron, k), *loops) for k, loops in kept_free.items()}
    outlines_of |= {number: (face.outline,) for number, face in faces.developments.items()}
    return ObjectPlan(
        located,
        polyhedron,
        array,
        alphabet,
        shapes,
        half,
        clearances,
        printer,
        outlines_of,
        faces.blank,
        (
            *faces.notes,
            *_covered_note(polyhedron, covered, reach_mm(spec, printer)),
            *_layer_note(spec),
        ),
    )


def _layer_note(spec: ObjectSpec) -> tuple[str, ...]:
    """Return what whole layers make of a wall and symbols that are none."""
    printer, height = spec.printer, spec.style.height_mm
    if not printer.nozzle_mm:
        return ()
    wall = spec.wall_mm if spec.parts == "panels" else 0.0
    low, high = (printer.printed_mm(z) if z else 0.0 for z in (wall, wall + height))
    if not wall:
        high = round(height / printer.layer_mm) * printer.layer_mm
    if abs(low - wall) < LAYER_MM and abs(high - low - height) < LAYER_MM:
        return ()
    walls = f"walls of {wall:g} mm print {low:g} mm, " if abs(low - wall) > LAYER_MM else ""
    better = f"wall {low:g} mm and height" if walls else "height"
    whole = max(1, round(height / printer.layer_mm)) * printer.layer_mm
    note = (
        f"{walls}symbols of {height:g} mm print {high - low:.3g} mm high at layers of "
        f"{printer.layer_mm:g} mm: {better} {whole:g} mm are whole layers"
    )
    return (note,)


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


def _check_order(alphabet: Alphabet, array: SymbolArray) -> None:
    if alphabet.order < array.order:
        raise ArrayError(
            f"the array has {array.order} symbols, but alphabet {alphabet.name} shows "
            f"{alphabet.order}",
            fix=f"choose an alphabet with {array.order} symbols or more",
        )


def _cut_corners(
    polyhedron: Polyhedron,
    spec: ObjectSpec,
    printer: Printer,
    covered: Mapping[int, tuple[Loop, ...]],
) -> dict[int, tuple[Loop, ...]]:
    """Return what is cut off the tops of panels, with what other faces cover of the same ones."""
    if spec.parts != "panels":
        return {}
    try:
        plain = plain_panels(polyhedron, spec.wall_mm, printer, spec.gap_mm, spec.name)
    except SolidError:
        return {}  # told with its place when the parts are built
    cut = cut_corners(polyhedron, plain, printer)
    return {face: (*covered.get(face, ()), *loops) for face, loops in cut.items()}


def _covered_note(
    polyhedron: Polyhedron, covered: Mapping[int, tuple[Loop, ...]], reach: float
) -> tuple[str, ...]:
    if not covered:
        return ()
    names = ", ".join(polyhedron.faces[face].name for face in covered)
    return (f"no symbols where another face is nearer than {reach:.2g} mm in front of: {names}",)


def _clearances(
    polyhedron: Polyhedron,
    spec: ObjectSpec,
    printer: Printer,
    faces: RoundFaces,
    covered: Mapping[int, tuple[Loop, ...]],
) -> Clearances:
    """Return what printer, mitre and the neighbouring face's symbols need along each edge."""
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
