"""Worlds that a reader must hold in: sensors, prints and surfaces as they are, not as drawn.

::

    levels     how bad sensors and prints are: a table;  sensor_copy  one sensor among its like
    reading    what a sensor of a level reads of a touch;  mounting  wired otherwise than drawn
    distorted  a print that is off in scale and stroke;  worn  one whose symbols are gone
    foreign    surfaces that no database knows
    extremes   stiff and extreme scenes for the contact models

Nothing here knows a reader: counts go out, and the truth stays with who asked.
"""
