"""Spec -> array -> layout -> solid -> files + database: the stages in their order.

::

    choose.py   the array, for profile auto
    plan.py     what the stages need of one spec
    place.py    cells for it: those it has, or free ones
    round.py    cylinder and cone faces: unrolled, printed whole
    faces.py    what each face shows
    files.py    layout -> parts -> staged files
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
