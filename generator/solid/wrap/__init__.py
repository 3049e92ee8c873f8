"""Symbols wrapped onto a round face.

::

    strip.py    facets side by side in the plane, and where their points are on the solid
    cut.py      a symbol in the plane, cut along the lines between facets
    walk.py     directed edges -> loops with their holes
    wrapped.py  Development + symbols -> facets of the part
    limits.py   what the bend leaves of strokes and gaps
"""

from generator.solid.wrap.limits import bend_problem
from generator.solid.wrap.wrapped import Body, wrapped_onto

__all__ = ["Body", "bend_problem", "wrapped_onto"]
