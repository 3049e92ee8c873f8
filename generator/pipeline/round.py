"""Round faces of an object: how they are printed, unrolled, and which stay blank.

A round face is no flat panel, so an object that has one is printed whole. Each round face is
laid out on its development, under the number of its first facet; the other facets carry nothing.
Cylinder and cone stand on their base when they are printed, so it stays blank.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from generator.alphabet.outline import Tiers
from generator.errors import LayoutError, SolidError
from generator.pipeline.blame import errors_at
from generator.polyhedron import Polyhedron
from generator.polyhedron.development import Development, development
from generator.polyhedron.front import covered_parts
from generator.printers import Printer
from generator.solid.wrap import bend_problem
from generator.spec import LocatedSpec, ObjectSpec

STANDING = ("cylinder", "cone")  #: shapes that are printed standing on F1


@dataclass(frozen=True, slots=True)
class RoundFaces:
    """The round faces that carry symbols, and the faces that carry none."""

    developments: Mapping[int, Development]  #: by the facet that carries them
    blank: frozenset[int]
    notes: tuple[str, ...]


def reach_mm(spec: ObjectSpec, printer: Printer) -> float:
    """Return the distance in front of a face that is left to symbols: its own and another's."""
    return 2.0 * spec.style.height_mm + printer.gap_min_mm


def as_one_part(located: LocatedSpec, polyhedron: Polyhedron) -> LocatedSpec:
    """Return the spec of an object with round faces as one that is printed whole.

    Raises
    ------
    SpecError
        Panels are asked for in the spec.
    """
    if not (polyhedron.surfaces or polyhedron.blank) or located.spec.parts == "whole":
        return located
    asked = located.tree.value.get("print")
    if isinstance(asked, dict) and asked.get("parts") == "panels":
        with errors_at(located, "print.parts"):
            raise SolidError(
                "a round face cannot be printed as a flat panel", fix="set parts to whole"
            )
    return replace(located, spec=replace(located.spec, parts="whole"))


def round_faces(
    polyhedron: Polyhedron, tiers: tuple[Tiers, ...], spec: ObjectSpec, printer: Printer
) -> RoundFaces:
    """Unroll the round faces; one whose bend the printer cannot follow stays blank.

    Raises
    ------
    LayoutError
        No face is left for symbols.
    """
    developments: dict[int, Development] = {}
    blank = set(polyhedron.blank)
    notes: list[str] = []
    unrolled = [development(polyhedron, surface) for surface in polyhedron.surfaces]
    problems = [bend_problem(each, tiers, spec.style, printer) for each in unrolled]
    bent = [s for s, problem in zip(polyhedron.surfaces, problems, strict=True) if not problem]
    reach = reach_mm(spec, printer)
    covered = covered_parts(polyhedron, [facet for s in bent for facet in s.facets], reach)
    for surface, flat, problem in zip(polyhedron.surfaces, unrolled, problems, strict=True):
        name = polyhedron.faces[surface.carrier].name
        if not problem and not covered.keys().isdisjoint(surface.facets):
            problem = f"another face is nearer than {reach:.2g} mm in front of it"
        if problem:
            notes.append(f"{surface.kind} {name} stays blank: {problem}")
            blank |= set(surface.facets)
        else:
            developments[surface.carrier] = flat
            blank |= set(surface.facets[1:])
    if polyhedron.kind in STANDING:
        blank.add(0)
        notes.append(f"{polyhedron.faces[0].name} stays blank: the part is printed standing on it")
    if len(blank - set(developments)) == len(polyhedron.faces):
        why = "; ".join((*polyhedron.notes, *notes))
        fix = "give it a planar face, or a cylinder or cone face between two circles"
        raise LayoutError(f"no face of the object carries symbols: {why}", fix=fix)
    return RoundFaces(developments, frozenset(blank), tuple(notes))
