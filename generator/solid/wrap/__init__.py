"""Symbols wrapped onto a round face.

`wrapped`: facets of the part; `analytic`: cylinders and cones for CAD; `limits`: what the bend
leaves of strokes and gaps.
"""

from generator.solid.wrap.analytic import analytic_faces, round_volume
from generator.solid.wrap.limits import bend_problem
from generator.solid.wrap.wrapped import Body, wrapped_onto

__all__ = ["Body", "analytic_faces", "bend_problem", "round_volume", "wrapped_onto"]
