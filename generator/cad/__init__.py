"""Solids of build123d and cadquery in, encoded solids out.

::

    read.py     a solid of either library -> polyhedron
    encode.py   solid + settings -> files, registered object, EncodedSolid
    result.py   EncodedSolid -> build123d, cadquery
"""

from generator.cad.encode import EncodedSolid, encode
from generator.cad.result import to_build123d, to_cadquery

__all__ = ["EncodedSolid", "encode", "to_build123d", "to_cadquery"]
