"""The entities of one STEP file, and what stands around its solids.

The list gives numbers and writes directions once; around solids stand header, units, colours,
products and assembly. ISO 10303-21: an entity is `#17=KIND(...);`. Text is ASCII. Lengths in mm.
ISO 10303-41 (products), -43 (representations), -44 (assembly), -46 (colour).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.export.colours import RGB
from generator.export.fixed_text import whole_numbers
from generator.solid.part import Part

PLACES = 10  #: decimals of a coordinate in mm
_UNIT_PLACES = 13  #: decimals of a component of a unit vector
_BLOCK = 240_000  # references written at once; a multiple of `_PER_LINE`
_PER_LINE = 12  #: references in one line of a long list
FOOTER = b"ENDSEC;\nEND-ISO-10303-21;\n"
_TIME_STAMP = "1970-01-01T00:00:00"


class Entities:
    """Entities that are written once, in order; the text waits until it is taken.

    No more than `at_most` are written: it sets the width of the numbers, as in #100000, #100001.
    """

    def __init__(self, at_most: int) -> None:
        self.width = max(5, len(str(at_most // 9)) + 1)
        self.next: int = 10 ** (self.width - 1)
        self._text: list[str] = []
        self._shared: dict[str, str] = {}

    def add(self, text: str) -> str:
        """Write one entity; return its reference."""
        reference = f"#{self.next}"
        self.next += 1
        self._text.append(f"{reference}={text};\n")
        return reference

    def direction(self, unit: NDArray[np.float64]) -> str:
        """Return the direction `unit`, (3,), written once however often it is used."""
        return self.direction_along(unit_text(unit))

    def direction_along(self, components: str) -> str:
        """Return the direction with these components, as `unit_text` writes them."""
        return self._once(f"DIRECTION('',{components})")

    def vector(self, unit: NDArray[np.float64]) -> str:
        """Return the vector of length 1 along `unit`."""
        return self.vector_along(unit_text(unit))

    def vector_along(self, components: str) -> str:
        """Return the vector of length 1 with these components, as `unit_text` writes them."""
        return self._once(f"VECTOR('',{self.direction_along(components)},1.)")

    def point(self, place: NDArray[np.float64], places: int = PLACES) -> str:
        """Write a point (3,), mm."""
        return self.add(f"CARTESIAN_POINT('',{triple(place, places)})")

    def placement(self, point: str, z: NDArray[np.float64], x: NDArray[np.float64]) -> str:
        """Write a frame at a point with axes z and x, (3,)."""
        axes = f"{self.direction(z)},{self.direction(x)}"
        return self.add(f"AXIS2_PLACEMENT_3D('',{point},{axes})")

    def oriented(self, edge: str, *, forward: bool) -> str:
        """Write an edge as a loop runs along it."""
        return self.add(f"ORIENTED_EDGE('',*,*,{edge},.{'T' if forward else 'F'}.)")

    def bound(self, edges: list[str], kind: str) -> str:
        """Write a bound of oriented edges."""
        loop = self.add(f"EDGE_LOOP('',({reference_list(edges)}))")
        return self.add(f"{kind}('',{loop},.T.)")

    def reserve(self, count: int) -> int:
        """Return the first of `count` numbers that the caller writes himself."""
        first = self.next
        self.next += count
        return first

    def taken(self) -> bytes:
        """Return the text written since the last call."""
        text = "".join(self._text).encode("ascii")
        self._text.clear()
        return text

    def _once(self, text: str) -> str:
        found = self._shared.get(text)
        if found is None:
            found = self._shared[text] = self.add(text)
        return found


def unit(vector: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return `vector` (..., 3) scaled to length 1."""
    length: NDArray[np.float64] = np.linalg.norm(vector, axis=-1, keepdims=True)
    return vector / length


def unit_text(unit: NDArray[np.float64]) -> str:
    """Return the components of a unit vector (3,) as STEP writes them."""
    return triple(unit, _UNIT_PLACES)


def triple(values: NDArray[np.float64], places: int) -> str:
    """Return three reals as STEP writes them: `(0.,-12.5,3.)`."""
    return "(" + ",".join(_real(value, places) for value in values.tolist()) + ")"


def reference_list(references: Iterable[str]) -> str:
    """Return references with commas, in lines that an editor can show."""
    items = list(references)
    lines = (",".join(items[i : i + _PER_LINE]) for i in range(0, len(items), _PER_LINE))
    return ",\n".join(lines)


def numbers_listed(numbers: NDArray[np.int64], width: int) -> Iterator[bytes]:
    """Yield the references to `numbers`, all of `width` digits, as `reference_list` would."""
    for start in range(0, len(numbers), _BLOCK):
        some = numbers[start : start + _BLOCK]
        text = np.full((len(some), width + 3), ord("\n"), np.uint8)
        text[:, 0] = ord("#")
        text[:, 1:-2] = whole_numbers(some, width)
        text[:, -2] = ord(",")
        kept = np.ones(text.shape, bool)
        kept[:, -1] = np.arange(1, len(some) + 1) % _PER_LINE == 0
        if start + len(some) == len(numbers):
            kept[-1, -2:] = False
        yield text[kept].tobytes()


def step_string(text: str) -> str:
    r"""Return `text` as the inside of a STEP string: quotes doubled, beyond ASCII as \X2\ or \X4\.

    >>> print(step_string("O'Neil, Würfel"))
    O''Neil, W\X2\00FC\X0\rfel
    """
    if text.isascii() and text.isprintable() and "'" not in text and "\\" not in text:
        return text
    return "".join(_step_character(character) for character in text)


def _step_character(character: str) -> str:
    code = ord(character)
    if character in "'\\":
        return 2 * character
    if 32 <= code < 127:
        return character
    return f"\\X2\\{code:04X}\\X0\\" if code < 0x10000 else f"\\X4\\{code:08X}\\X0\\"


def _real(value: float, places: int) -> str:
    text = f"{value:.{places}f}".rstrip("0")
    return "0." if text == "-0." else text


@dataclass(frozen=True, slots=True)
class Shared:
    """What all parts of a file refer to."""

    units: str
    origin: str
    symbols: str  #: style of symbols


@dataclass(frozen=True, slots=True)
class ProductReferences:
    """References to a product."""

    definition: str
    shape: str


def file_header(name: str) -> bytes:
    """Return what stands before the entities; `name` is an encoded string."""
    return (
        "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION(('encoded object'),'2;1');\n"
        f"FILE_NAME('{name}','{_TIME_STAMP}',(''),(''),'encoded-objects','encoded-objects','');\n"
        "FILE_SCHEMA(('AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }'));\nENDSEC;\nDATA;\n"
    ).encode("ascii")


def write_units(entities: Entities) -> str:
    """Write mm, radian and the tolerance; return the geometric context."""
    length = entities.add("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))")
    angle = entities.add("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))")
    solid_angle = entities.add("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())")
    accuracy = entities.add(
        f"UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-07),{length},"
        "'distance_accuracy_value','confusion accuracy')"
    )
    return entities.add(
        f"(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT(({accuracy}))"
        f"GLOBAL_UNIT_ASSIGNED_CONTEXT(({length},{angle},{solid_angle}))"
        "REPRESENTATION_CONTEXT('',''))"
    )


def write_origin(entities: Entities) -> str:
    """Write the frame that parts are given in."""
    point = entities.add("CARTESIAN_POINT('',(0.,0.,0.))")
    return entities.placement(point, np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]))


def write_style(entities: Entities, colour_rgb: RGB) -> str:
    """Write a colour; return the style that faces of that colour refer to."""
    rgb = ",".join(f"{value / 255:.6f}" for value in colour_rgb)
    colour = entities.add(f"COLOUR_RGB('',{rgb})")
    fill = entities.add(f"FILL_AREA_STYLE_COLOUR('',{colour})")
    area = entities.add(f"FILL_AREA_STYLE('',({fill}))")
    surface = entities.add(f"SURFACE_STYLE_FILL_AREA({area})")
    side = entities.add(f"SURFACE_SIDE_STYLE('',({surface}))")
    usage = entities.add(f"SURFACE_STYLE_USAGE(.BOTH.,{side})")
    return entities.add(f"PRESENTATION_STYLE_ASSIGNMENT(({usage}))")


def write_product(
    entities: Entities, name: str, solid: str, units: str, origin: str
) -> ProductReferences:
    """Write the product that the solid is the shape of."""
    shape = entities.add(f"ADVANCED_BREP_SHAPE_REPRESENTATION('{name}',({origin},{solid}),{units})")
    return write_product_of(entities, name, shape)


def write_product_of(entities: Entities, name: str, shape: str) -> ProductReferences:
    """Write the product that a representation is the shape of."""
    add = entities.add
    application = add("APPLICATION_CONTEXT('automotive design')")
    add(
        "APPLICATION_PROTOCOL_DEFINITION('international standard','automotive_design',"
        f"2000,{application})"
    )
    context = add(f"PRODUCT_CONTEXT('',{application},'mechanical')")
    product = add(f"PRODUCT('{name}','{name}','',({context}))")
    add(f"PRODUCT_RELATED_PRODUCT_CATEGORY('part',$,({product}))")
    formation = add(f"PRODUCT_DEFINITION_FORMATION('','',{product})")
    design = add(f"PRODUCT_DEFINITION_CONTEXT('part definition',{application},'design')")
    definition = add(f"PRODUCT_DEFINITION('design','',{formation},{design})")
    definition_shape = add(f"PRODUCT_DEFINITION_SHAPE('','',{definition})")
    add(f"SHAPE_DEFINITION_REPRESENTATION({definition_shape},{shape})")
    return ProductReferences(definition, shape)


def write_assembly_product(
    entities: Entities,
    name: str,
    shared: Shared,
    held: Sequence[tuple[Part, ProductReferences]],
) -> None:
    """Write the product that holds all parts, each where it belongs (ISO 10303-44, -43)."""
    add = entities.add
    places = [_placement(entities, part.T_object_part) for part, _ in held]
    items = reference_list([shared.origin, *places])
    whole_shape = add(f"SHAPE_REPRESENTATION('{name}',({items}),{shared.units})")
    whole = write_product_of(entities, name, whole_shape)
    for number, ((part, product), place) in enumerate(zip(held, places, strict=True), 1):
        own = step_string(part.name)
        use = add(
            f"NEXT_ASSEMBLY_USAGE_OCCURRENCE('{number}','{own}','',{whole.definition},"
            f"{product.definition},$)"
        )
        of_use = add(f"PRODUCT_DEFINITION_SHAPE('','',{use})")
        motion = add(f"ITEM_DEFINED_TRANSFORMATION('','',{shared.origin},{place})")
        relation = add(
            f"(REPRESENTATION_RELATIONSHIP('','',{product.shape},{whole_shape})"
            f"REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION({motion})"
            "SHAPE_REPRESENTATION_RELATIONSHIP())"
        )
        add(f"CONTEXT_DEPENDENT_SHAPE_REPRESENTATION({relation},{of_use})")


def _placement(entities: Entities, T: NDArray[np.float64]) -> str:
    point = entities.point(np.round(T[:3, 3], PLACES))
    return entities.placement(point, T[:3, 2], T[:3, 0])
