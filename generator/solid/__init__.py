"""Printable parts: bodies with embossed faces, their triangles and their proof."""

from generator.solid.analytic import round_volume
from generator.solid.closed import prove_closed
from generator.solid.measure import box, volume
from generator.solid.panels import panels
from generator.solid.part import Part
from generator.solid.plate import (
    plain_panels,
    symbol_clearance_mm,
    top_inset_mm,
    top_insets_mm,
)
from generator.solid.triangulate import Mesh, body_mesh, symbol_meshes, triangles
from generator.solid.whole import emboss_whole

__all__ = [
    "Mesh",
    "Part",
    "body_mesh",
    "box",
    "emboss_whole",
    "panels",
    "plain_panels",
    "prove_closed",
    "round_volume",
    "symbol_clearance_mm",
    "symbol_meshes",
    "top_inset_mm",
    "top_insets_mm",
    "triangles",
    "volume",
]
