"""Spec -> array -> layout -> solid -> files + database: the stages in their order.

::

    plan.py    what the stages need of one spec
    files.py   layout -> parts -> staged files
    encode.py  one object, one transaction; several objects, one run
"""

from generator.pipeline.encode import Encoded, Made, encode

__all__ = ["Encoded", "Made", "encode"]
