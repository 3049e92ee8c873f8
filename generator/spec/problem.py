"""What is wrong with a spec, in the words of specs."""

from __future__ import annotations

from encoded_objects.base.document import DocumentError, DocumentKind
from generator.errors import GeneratorError


class SpecError(DocumentError, GeneratorError):
    """A spec that cannot be used; holds every problem that was found, in file order."""


SPEC = DocumentKind(
    error=SpecError,
    name="a spec",
    empty="write  name: Cube  and, in the next line,  shape: {cube: 60 mm}",
    example="encode-object init cube",
    first="write a first one with: encode-object init cube -o cube.yaml",
    several="list several objects under objects:, in one document",
    repeat="write the value out; a set shares what stands beside objects:",
    large="give a large polyhedron as a file, for example shape: {file: part.stl}",
)
