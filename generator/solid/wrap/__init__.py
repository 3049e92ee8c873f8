"""Symbols wrapped onto a round face.

::

    strip.py    facets side by side in the plane, and where their points are on the solid
    cut.py      a symbol in the plane, cut along the lines between facets
    walk.py     directed edges -> loops with their holes
    wrapped.py  Development + symbols -> facets of the part
    analytic.py the face as a cylinder or cone, for CAD
    bend.py     straight lines of the plane on it
    limits.py   what the bend leaves of strokes and gaps
"""

from generator.solid.wrap.analytic import analytic_faces, round_volume
from generator.solid.wrap.limits import bend_problem
from generator.solid.wrap.wrapped import Body, wrapped_onto

__all__ = ["Body", "analytic_faces", "bend_problem", "round_volume", "wrapped_onto"]
