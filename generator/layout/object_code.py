"""A short code that tells an object from all others on its array, for backs of small panels.

The first cell that the object uses, counted row by row, in letters and digits that are not
mistaken for each other. No cell is used twice, so no code is; the same place on the array
gives the same code.
"""

from __future__ import annotations

from generator.layout.placement import Layout

LETTERS = "23457ACDEHJKLMNPRTUWXY"  #: no F, which begins the number of a face


def object_code(layout: Layout, rows: int, columns: int) -> str:
    """Return the code of what lies at `layout` on an array of `rows` x `columns` cells.

    All codes of an array have the same length: 3 letters up to 10,648 cells, 4 up to 234,256.
    """
    faces = [face for face in layout.faces if len(face.labels)]
    row = min(int(face.rows.min()) for face in faces)
    column = min(int(c) for face in faces for c in face.columns[face.rows == row].tolist())
    first = row * columns + column
    length = 1
    while len(LETTERS) ** length < rows * columns:
        length += 1
    digits = ""
    for _ in range(length):
        first, digit = divmod(first, len(LETTERS))
        digits = LETTERS[digit] + digits
    return digits
