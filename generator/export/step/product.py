"""What a STEP file says around its solids: header, units, colours, products, assembly.

ISO 10303-41 (products), -43 (representations), -44 (assembly), -46 (colour).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.export.colours import RGB
from generator.export.step.entities import PLACES, Entities, reference_list, step_string, triple
from generator.solid.part import Part

FOOTER = b"ENDSEC;\nEND-ISO-10303-21;\n"
_TIME_STAMP = "1970-01-01T00:00:00"


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
    x, z = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    return entities.add(
        f"AXIS2_PLACEMENT_3D('',{point},{entities.direction(z)},{entities.direction(x)})"
    )


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
    add = entities.add
    shape = add(f"ADVANCED_BREP_SHAPE_REPRESENTATION('{name}',({origin},{solid}),{units})")
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


def write_assembly(
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
    point = entities.add(f"CARTESIAN_POINT('',{triple(np.round(T[:3, 3], PLACES), PLACES)})")
    z, x = entities.direction(T[:3, 2]), entities.direction(T[:3, 0])
    return entities.add(f"AXIS2_PLACEMENT_3D('',{point},{z},{x})")
