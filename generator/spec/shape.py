"""The shapes a spec can ask for; sizes in mm after reading.

What only geometry can tell (closed, planar, oriented) is checked where the polyhedron is made.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, WithJsonSchema

from encoded_objects.base.settings import (
    Block,
    Coordinate,
    Length,
    PathText,
    coordinates,
    refuse,
    sides,
    two_sides,
    whole_number,
)

SIDES_MAX = 64
Sides = Annotated[int, Field(ge=3, le=SIDES_MAX), whole_number(3, SIDES_MAX, "sides")]

SCALES = (1e-6, 1e6)


def scale_factor(value: Any) -> float:
    """Return how many times larger a model is made."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise refuse("a scale must be a number", "write 25.4 for a model in inches")
    if not SCALES[0] <= value <= SCALES[1]:
        low, high = SCALES
        raise refuse(
            f"a scale of {value:g} is not {low:g} to {high:g}", "write 25.4 for a model in inches"
        )
    return float(value)


Scale = Annotated[
    float,
    BeforeValidator(scale_factor),
    WithJsonSchema({"type": "number", "minimum": SCALES[0], "maximum": SCALES[1]}),
]


def is_model(path: Path) -> bool:
    """Return whether a file is a model by its ending."""
    if path.suffix.lower() in ("", ".yaml", ".yml"):
        return False
    from generator.polyhedron.read import MESHES, STEP  # costs start-up

    return path.suffix.lower() in (*STEP, *MESHES)


def face_loops(value: Any) -> tuple[tuple[int, ...], ...]:
    """Return the loops of a face: `[0, 1, 2]`, or `[[0, 1, 2, 3], [4, 5, 6]]` with a hole."""
    if not isinstance(value, list) or not value:
        raise refuse("a face is a list of vertex numbers", "write, for example, [0, 1, 2]")
    loops = value if isinstance(value[0], list) else [value]
    for loop in loops:
        if not isinstance(loop, list) or any(type(vertex) is not int for vertex in loop):
            raise refuse(
                "a face holds whole numbers, the numbers of its vertices",
                "write, for example, [0, 1, 2]; holes as [[0, 1, 2, 3], [4, 5, 6]]",
            )
        if len(loop) < 3:
            raise refuse(
                f"a loop of a face needs 3 vertices or more, not {len(loop)}",
                "add vertices, or leave the face out",
            )
        if len(set(loop)) < len(loop):
            twice = next(vertex for vertex in loop if loop.count(vertex) > 1)
            raise refuse(f"vertex {twice} occurs twice in one loop", "leave one of them out")
    return tuple(tuple(loop) for loop in loops)


_LOOP_SCHEMA = {"type": "array", "minItems": 3, "items": {"type": "integer", "minimum": 0}}
FaceLoops = Annotated[
    tuple[tuple[int, ...], ...],
    BeforeValidator(face_loops),
    WithJsonSchema({"anyOf": [_LOOP_SCHEMA, {"type": "array", "items": _LOOP_SCHEMA}]}),
]
Point = Annotated[tuple[Coordinate, Coordinate, Coordinate], BeforeValidator(coordinates)]
BoxSides = Annotated[
    tuple[Length, Length, Length],
    BeforeValidator(sides, json_schema_input_type=tuple[Length, Length, Length] | str),
]


TagSides = Annotated[
    tuple[Length, Length],
    BeforeValidator(two_sides, json_schema_input_type=tuple[Length, Length] | str),
]


def tag_block(value: Any) -> Any:
    """Return the block that the two sides of a tag stand for."""
    return value if isinstance(value, dict) else {"size": value}


class TriangularPrism(Block):
    """A prism on an equilateral triangle."""

    side: Length
    """Side of the triangle, mm unless a unit is written."""
    height: Length
    """Distance between the triangles, mm unless a unit is written."""


class Prism(Block):
    """A right prism on a regular polygon."""

    sides: Sides
    """Number of sides of the base."""
    side: Length | None = None
    """Length of a side of the base, mm unless a unit is written."""
    radius: Length | None = None
    """Distance from the middle of the base to its corners, in place of side."""
    height: Length
    """Distance between the bases, mm unless a unit is written."""


class Pyramid(Block):
    """A right pyramid on a regular polygon."""

    sides: Sides = 4
    """Number of sides of the base."""
    side: Length | None = None
    """Length of a side of the base, mm unless a unit is written."""
    radius: Length | None = None
    """Distance from the middle of the base to its corners, in place of side."""
    height: Length
    """Height of the apex above the base, mm unless a unit is written."""


class Cylinder(Block):
    """A cylinder; symbols are wrapped onto its side."""

    diameter: Length
    """Diameter, mm unless a unit is written."""
    height: Length
    """Distance between base and top, mm unless a unit is written."""


class Cone(Block):
    """A cone, or its lower part; symbols are wrapped onto its side."""

    diameter: Length
    """Diameter of the base, mm unless a unit is written."""
    top_diameter: Length | None = None
    """Diameter of the top, mm unless a unit is written; a pointed cone if left out."""
    height: Length
    """Distance between base and top, mm unless a unit is written."""


class Tag(Block):
    """A flat plate with symbols on one side."""

    size: TagSides
    """Length and width of the side with symbols: [40 mm, 40 mm] or 40 x 40 mm."""
    thickness: Length | None = None
    """Of the plate; 3 mm, or what magnets need."""
    frame: Length | None = None
    """Width of a blank frame around the symbols, 1 mm lower, for clamps and screws; none if left
    out."""


TagChoice = Annotated[Tag, BeforeValidator(tag_block, json_schema_input_type=Tag | TagSides)]


class VerticesAndFaces(Block):
    """Any polyhedron with planar faces."""

    vertices: Annotated[list[Point], Field(min_length=4)]
    """Corners [x, y, z], mm unless a unit is written; numbered from 0."""
    faces: Annotated[list[FaceLoops], Field(min_length=4)]
    """For each face the numbers of its vertices, counter-clockwise seen from outside; a face
    with holes is a list of loops, the outer one first."""


class Shape(Block):
    """The object's shape: exactly one of these; a file may have a scale beside it."""

    cube: Length | None = None
    """Edge of a cube."""
    box: BoxSides | None = None
    """Three sides of a parallelepiped: [80, 80, 120] or 80 x 80 x 120 mm."""
    triangular_prism: TriangularPrism | None = None
    tetrahedron: Length | None = None
    """Edge of a regular tetrahedron."""
    octahedron: Length | None = None
    """Edge of a regular octahedron."""
    dodecahedron: Length | None = None
    """Edge of a regular dodecahedron."""
    prism: Prism | None = None
    pyramid: Pyramid | None = None
    cylinder: Cylinder | None = None
    cone: Cone | None = None
    tag: TagChoice | None = None
    """Sides of a flat plate with symbols on one side: [40, 40] or 40 x 40 mm."""
    polyhedron: VerticesAndFaces | None = None
    file: PathText | None = None
    """A model, relative to the spec: a .step, .stl or .obj file. Its cylinder and cone faces are
    unrolled, of a mesh the strips of facets that lie on one; other curved regions stay blank."""
    scale: Scale | None = None
    """How many times larger the model of `file` is made: 25.4 for a .stl in inches, 1000 for one
    in metres. A .step file says its unit, which is honoured without a scale."""


KINDS = tuple(name for name in Shape.model_fields if name != "scale")
EXAMPLES = {
    "cube": "{cube: 60 mm}",
    "box": "{box: [80 mm, 80 mm, 120 mm]}",
    "triangular_prism": "{triangular_prism: {side: 80 mm, height: 120 mm}}",
    "tetrahedron": "{tetrahedron: 120 mm}",
    "octahedron": "{octahedron: 80 mm}",
    "dodecahedron": "{dodecahedron: 40 mm}",
    "prism": "{prism: {sides: 6, side: 40 mm, height: 80 mm}}",
    "pyramid": "{pyramid: {sides: 4, side: 80 mm, height: 70 mm}}",
    "cylinder": "{cylinder: {diameter: 60 mm, height: 80 mm}}",
    "cone": "{cone: {diameter: 80 mm, top_diameter: 40 mm, height: 80 mm}}",
    "tag": "{tag: [40 mm, 40 mm]}",
    "polyhedron": "{polyhedron: {vertices: [[0, 0, 0], ...], faces: [[0, 2, 1], ...]}}",
    "file": "{file: part.step}",
}
"""How each shape is written, for messages and for `encode-object init`."""
OTHER_NAMES = {
    "parallelepiped": "box", "cuboid": "box", "block": "box", "brick": "box", "rectangle": "box",
    "wedge": "triangular_prism", "hexagonal_prism": "prism", "frustum": "cone", "tube": "cylinder",
    "plate": "tag", "label": "tag",
    "mesh": "file", "stl": "file", "step": "file", "obj": "file", "model": "file", "path": "file",
}  # fmt: skip
"""Names people try, and what they are called here."""
