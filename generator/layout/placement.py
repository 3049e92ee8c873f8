"""Where a face lies on the array: values that `layout` makes and everyone reads.

A placement is one rigid transform per face. A point (x, y) of the face frame (mm)
lies in the array plane, relative to the upper left corner of the anchor cell
(row, column), at

    u = x cos(rotation) - y sin(rotation) + x_mm
    v = x sin(rotation) + y cos(rotation) + y_mm

and an unwrapped cell (r, c) has its centre at u = (c - column + 1/2) p,
v = -(r - row + 1/2) p. The anchor is a pair of integers, so that a face stays exact
on an array of any size.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

CODE_LETTERS = "23457ACDEHJKLMNPRTUWXY"  #: no F, which begins the number of a face


@dataclass(frozen=True, slots=True)
class Placement:
    """Face to array: one rigid transform."""

    row: int  #: anchor cell, 0 <= row < rows
    column: int  #: anchor cell, 0 <= column < columns
    rotation_rad: float  #: turns face x into array x (columns)
    x_mm: float
    y_mm: float


@dataclass(frozen=True, slots=True)
class FaceLayout:
    """The symbols of one face; a blank face has none, and a placement without a meaning."""

    face: int  #: number of the face in its polyhedron
    placement: Placement
    rows: NDArray[np.int64]  #: (n,) array rows on the torus
    columns: NDArray[np.int64]  #: (n,) array columns on the torus
    labels: NDArray[np.int64]  #: (n,) symbols to emboss
    centres_mm: NDArray[np.float64]  #: (n, 2) symbol centres in the face frame; x axis at -rotation
    places: int  #: how many places of this face can be identified


@dataclass(frozen=True, slots=True)
class Layout:
    """All faces of one object on one array."""

    kind: str  #: "net" or "faces"
    pitch_mm: float
    faces: tuple[FaceLayout, ...]  #: one per face of the polyhedron, in its order
    blank_faces: tuple[int, ...] = ()  #: left blank, as asked or because nothing identifies
    warnings: tuple[str, ...] = ()  #: for the person who asked: faces without a place


def object_code(layout: Layout, rows: int, columns: int) -> str:
    """Return a short code that no other object on the array has, for backs of small panels.

    It is the first cell that the object uses, counted row by row, in letters and digits that are
    not mistaken for each other: 3 letters up to 10,648 cells, 4 up to 234,256.
    """
    faces = [face for face in layout.faces if len(face.labels)]
    row = min(int(face.rows.min()) for face in faces)
    column = min(int(c) for face in faces for c in face.columns[face.rows == row].tolist())
    first = row * columns + column
    length = 1
    while len(CODE_LETTERS) ** length < rows * columns:
        length += 1
    digits = ""
    for _ in range(length):
        first, digit = divmod(first, len(CODE_LETTERS))
        digits = CODE_LETTERS[digit] + digits
    return digits
