"""Spec -> array -> layout -> solid -> files + database: the stages in their order.

::

    choose.py   the lab's array of a run, for profile auto the smallest with room
    plan.py     spec -> polyhedron, array, outlines, clearances
    place.py    cells for it: those it has, or free ones
    faces.py    what each face shows
    files.py    layout -> parts -> staged files
    sheet.py    the build sheet of one object
    make.py     one object, one transaction
    sets.py     several objects, in parallel; what was made before is skipped
    plates.py   the set on the printer's bed: plates, overview, packing list
    encode.py   one run
    made.py     what came of it
    printed_check.py  what becomes of every symbol on a printer
"""

from generator.pipeline.encode import encode
from generator.pipeline.made import Encoded, MadeObject

__all__ = ["Encoded", "MadeObject", "encode"]
