"""Worlds that a reader must hold in: sensors, prints and surfaces as they are, not as drawn.

::

    levels     how bad sensors and prints are: a table
    sensor     a sensor of a level among its like: scene + touch -> counts
    surfaces   prints that are off, symbols that are gone, parts side by side, foreign surfaces

Nothing here knows a reader: counts go out, and the truth stays with the caller.
"""
