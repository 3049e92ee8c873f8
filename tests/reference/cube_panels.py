"""Panels of a cube with symbols of dense-4 at 7 mm, for programs that read or print them."""

import numpy as np

from generator.alphabet.known import alphabet_named
from generator.alphabet.outline import SymbolStyle, outlines
from generator.array.profiles import profile
from generator.layout.layout import lay_out
from generator.polyhedron.shapes import cube
from generator.printers import printer_named
from generator.solid import emboss_whole, panels


def embossed(body, *, whole=False, chamfer_mm=0.0, name="Cube"):
    """Return the parts of a body."""
    tiers = outlines(alphabet_named("dense-4"), SymbolStyle(chamfer_mm=chamfer_mm))
    half = max(float(np.abs(ring).max()) for symbol in tiers for ring in symbol.rings[0])
    clearances = [[np.full(len(loop), 1.0) for loop in face.loops] for face in body.faces]
    nothing = np.zeros(0, np.int64)
    layout = lay_out(body, profile().array(), 7.0, half, clearances, (nothing, nothing))
    if whole:
        return (emboss_whole(body, layout, tiers, name),)
    return panels(body, layout, tiers, 3.0, printer_named("fdm-0.4"), name=name).parts


def cube_panels(side_mm):
    """Return the six panels of a cube."""
    return embossed(cube(side_mm))
