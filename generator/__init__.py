"""Making encoded objects: from a shape to printable parts and a registered object.

From a script, with solids of build123d or cadquery::

    from generator import encode, to_build123d

    result = encode(solid, name="Bracket", database="lab.db")
    assembled = to_build123d(result)

Both load the CAD kernel; nothing of it is loaded before one of them is used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from generator.cad.encode import EncodedSolid, encode
    from generator.cad.result import to_build123d, to_cadquery

__all__ = ["EncodedSolid", "encode", "to_build123d", "to_cadquery"]


def __getattr__(name: str) -> Any:
    if name in __all__:
        from importlib import import_module

        return getattr(import_module("generator.cad"), name)
    raise AttributeError(f"module 'generator' has no attribute '{name}'")
