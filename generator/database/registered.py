"""What the database holds of an object, as values; mm, radians. Thesis 6.3.

A face's frame has its origin at the face's first vertex, x along its first edge, z outward;
`T_object_face` takes it to the object frame.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from generator.alphabet.outline import SymbolStyle
from generator.database.round_face import Bend, RoundFace
from generator.layout.placement import Layout, Placement
from generator.polyhedron.winged import Developable, Polyhedron


def canonical(value: Any) -> str:
    """Return the JSON text of `value` with sorted keys, no blanks; floats read back bit for bit.

    Raises `TypeError` on what JSON does not know and `ValueError` on NaN and infinity.

    >>> canonical({"b": [1, 0.1], "a": "é"})
    '{"a":"é","b":[1,0.1]}'
    """
    return json.dumps(
        value, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False
    )


def digest(text: str) -> str:
    """Return the SHA-256 of the UTF-8 bytes of `text`, in hexadecimal."""
    return hashlib.sha256(text.encode()).hexdigest()


def spec_hash(spec: Any) -> str:
    """Return the digest of a spec given as plain values: equal specs, equal hashes."""
    return digest(canonical(spec))


__all__ = ["Bend", "Developable", "ObjectEntry", "Polyhedron", "RegisteredArray", "RegisteredFace",
           "RegisteredObject", "RegisteredPart", "RegisteredStyle", "RoundFace"]  # fmt: skip


@dataclass(frozen=True, slots=True)
class ObjectEntry:
    """One line of the list of objects."""

    object_id: int
    name: str
    object_type: str  #: cube, box, tetrahedron, ..., file
    number_of_vertices: int
    number_of_faces: int  #: of the polyhedron: each facet of a round face is one
    faces: int  #: as people count them: a round face is one
    symbols: int  #: cells that the object holds
    array_id: int
    profile: str
    rows: int  #: of the array
    columns: int
    pitch_mm: float
    spec_hash: str
    tool_version: str
    utc: str  #: when it was registered, ISO 8601
    retired_utc: str = ""  #: when it was retired; empty while in use
    imported_from: str = ""  #: the database that it came from; empty where it was made here
    imported_utc: str = ""

    def same_spec(self, spec: Any) -> bool:
        """Whether this object was registered from the same plain values."""
        return self.spec_hash == spec_hash(spec)


@dataclass(frozen=True, slots=True)
class RegisteredStyle:
    """How the symbols of an object are embossed, and of which array they are."""

    object_id: int
    name: str
    array_id: int
    alphabet: str  #: canonical JSON of the alphabet's definition
    style: SymbolStyle


@dataclass(frozen=True, slots=True)
class RegisteredPart:
    """A printable part in one file."""

    name: str
    format: str  #: step, stl, 3mf, glb
    file: str  #: from the folder of the database file; absolute on a server
    sha256: str  #: of the file's bytes
    T_object_part: NDArray[np.float64]  #: (4, 4), mm: the file has a local origin


@dataclass(frozen=True, slots=True)
class RegisteredFace:
    """A face with its frame, its outline and its place on the array."""

    face_id: int
    name: str
    face_type: str  #: triangle, square, rectangle, quadrilateral, polygon
    area_mm2: float
    T_object_face: NDArray[np.float64]  #: (4, 4)
    polygon_mm: tuple[NDArray[np.float64], ...]  #: loops (k, 2), face frame; holes after the first
    placement: Placement | None  #: None where the face is blank
    round: RoundFace | None = None  #: the round face of which this facet carries the symbols


@dataclass(frozen=True, slots=True)
class RegisteredArray:
    """An array that objects share."""

    array_id: int
    profile: str
    definition: dict[str, Any]  #: for `array_from`
    rows: int
    columns: int
    window: tuple[int, int]
    order: int
    lab_key: str = ""  #: from which it was made; empty: the published array


@dataclass(frozen=True, slots=True)
class RegisteredObject:
    """Everything that is known about one object."""

    entry: ObjectEntry
    polyhedron: Polyhedron
    faces: tuple[RegisteredFace, ...]
    layout: Layout
    style: SymbolStyle
    array: RegisteredArray
    alphabet: dict[str, Any]  #: for `alphabet_from`
    parts: tuple[RegisteredPart, ...]
    spec: Any  #: plain values
