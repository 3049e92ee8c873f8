"""Encode a bracket that build123d made, and go on with the embossed solid in build123d."""

from build123d import Align, Box, Cylinder, Pos

from generator import encode, to_build123d

# A bracket from two boxes: every face is planar.
LOW = (Align.CENTER, Align.CENTER, Align.MIN)
bracket = Box(60, 30, 12, align=LOW) + Pos(-24, 0, 12) * Box(12, 30, 24, align=LOW)

result = encode(
    bracket,
    name="Bracket",
    database="lab.db",
    folder="out/bracket",
    formats=["stl"],
    print={"parts": "whole"},
)
print(f"{result.name}: {result.symbols} symbols, {result.places} places told apart by touch")

# The embossed bracket again as build123d's own: drill a hole through its middle.
embossed = to_build123d(result)
drilled = embossed.children[0] - Pos(0, 0, 0) * Cylinder(1.5, 200)
print(f"volume {embossed.volume:.0f} mm3, drilled {drilled.volume:.0f} mm3")
