"""The registered cells of a lab, as the reader needs them. Thesis 6.3.

Database -> Lab: for every array and way of embossing (an `EmbossedArray`) the cells that objects
hold, each with its face. Cells are looked up by row x columns + column; faces are read from the
database when a touch first meets them.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Connection, Engine

from encoded_objects.base.compiled import addresses
from encoded_objects.base.errors import without_password
from encoded_objects.base.output import count_of
from generator.alphabet import Alphabet, SymbolStyle, alphabet_from
from generator.array import FoldedArray, ProductArray
from generator.database.as_built import AsBuilt, read_as_built
from generator.database.cells import held_cells
from generator.database.open import open_database
from generator.database.read import (
    find_object,
    make_array,
    read_object,
    read_styles,
    read_surfaces,
)
from generator.database.registered import (
    Developable,
    RegisteredObject,
    RegisteredPart,
    RegisteredStyle,
    RoundFace,
)
from generator.database.transaction import of_rows, place_of, read_transaction
from probe.surface.polygon import FaceRegion, polygon
from recognizer.errors import LabError
from recognizer.touch.as_built import PrintedFace, print_of, usual_print
from recognizer.touch.symbols.kernels import Held

Ints = NDArray[np.int64]

DENSE_CELLS = 1 << 22  #: arrays of at most so many cells are looked up in a table (16 MB)
LEAST_RADIUS_MM = 15.0  #: of round faces that are looked for
MOST_RADIUS_MM = 400.0  #: a larger one falls less than 0.2 mm away at the sensor's rim
RADIUS_FACTOR = 1.35  #: from one radius to the next
WINDOW_SHAPES = ((2, 3), (3, 2), (2, 2))  #: rows and columns of a window


@dataclass(frozen=True, eq=False)
class EncodedFace:
    """A face of an object with its symbols."""

    object: str
    face: str
    T_object_face: NDArray[np.float64]  #: (4, 4)
    polygon_mm: tuple[NDArray[np.float64], ...]  #: loops (k, 2), face frame; holes after the first
    rotation_rad: float  #: turns face x into array x
    rows: Ints  #: (n,) of the array
    columns: Ints  #: (n,)
    labels: Ints  #: (n,)
    centres_mm: NDArray[np.float64]  #: (n, 2) face frame
    round: RoundFace | None = None  #: of a round face; its frame is that of the unrolled plane
    part: str = ""  #: name of the printed part that bears it; empty where no part is registered
    T_part_face: NDArray[np.float64] | None = None  #: (4, 4) to the frame of the part's file
    printed: PrintedFace | None = None  #: None on round faces

    @cached_property
    def region(self) -> FaceRegion:
        """Outline, face frame."""
        return polygon(list(self.polygon_mm))


@dataclass(frozen=True, slots=True, eq=False)
class Windows:
    """Registered cells, ordered by the labels of the windows of which they are the top left.

    A touch looks up six neighbouring symbols here, or four; the work grows with how often the same
    labels occur, not with the number of faces.
    """

    shape: tuple[int, int]
    codes: Ints  #: (n,) rising; labels of the window as digits, row by row
    cells: NDArray[np.uint32]  #: (n,) places in the keys

    def at(self, code: int) -> NDArray[np.uint32]:
        """Return where a window's labels stand, as places in the keys."""
        first, last = np.searchsorted(self.codes, [code, code + 1])
        return self.cells[first:last]


@dataclass(frozen=True, eq=False)
class EmbossedArray:
    """One array as embossed in one alphabet and style, and who holds its cells."""

    array: FoldedArray | ProductArray
    alphabet: Alphabet
    style: SymbolStyle
    keys: NDArray[np.uint64]  #: (n,) registered cells, `cell_keys`, rising
    owners: NDArray[np.int32]  #: (n + 1,) number of the face in `faces`; the last is none, -1
    labels: NDArray[np.int8]  #: (n + 1,); the last is -1
    dense: NDArray[np.int32] | None  #: (rows * columns,) place in `owners`; None for large arrays
    faces: Ints  #: (f, 2) object and face number in the database
    names: dict[int, str]  #: of the objects, by their numbers
    engine: Engine
    radii_mm: tuple[float, ...] = ()  #: of round faces, nearly, rising; none: all faces are flat
    known: dict[int, EncodedFace] = field(default_factory=dict)

    def at(self, rows: Ints, columns: Ints) -> tuple[NDArray[np.int32], NDArray[np.int8]]:
        """Return the face (-1: none) that holds each cell on the torus, and the cell's label."""
        wanted = cell_keys(self.array.columns, rows, columns)
        if self.dense is not None:
            place = self.dense[wanted]
            return self.owners[place], self.labels[place]
        place = np.searchsorted(self.keys, wanted).clip(max=len(self.keys) - 1)
        held = self.keys[place] == wanted
        none = np.int32(-1)
        return np.where(held, self.owners[place], none), np.where(held, self.labels[place], none)

    @cached_property
    def windows(self) -> tuple[Windows, ...]:
        """Index of all small windows."""
        return tuple(self._index_windows(shape) for shape in WINDOW_SHAPES)

    def _index_windows(self, shape: tuple[int, int]) -> Windows:
        array, owners = self.array, self.owners[:-1]
        row, column = (
            part.astype(np.int64) for part in np.divmod(self.keys, np.uint64(array.columns))
        )
        code, whole = np.zeros(len(row), np.int64), np.ones(len(row), np.bool_)
        for down in range(shape[0]):
            for right in range(shape[1]):
                held_by, label = self.at(
                    (row + down) % array.rows, (column + right) % array.columns
                )
                whole &= held_by == owners
                code = code * array.order + label
        places = np.flatnonzero(whole)
        by_code = places[np.argsort(code[places], kind="stable")]
        return Windows(shape, code[by_code], by_code.astype(np.uint32))

    @cached_property
    def held(self) -> Held:
        """The array as the compiled loops over places take it."""
        array = self.array
        return Held(
            len(self.keys), array.rows, array.columns, array.order,
            *addresses(self.keys, self.owners, self.labels, self.dense),
        )  # fmt: skip

    def face(self, number: int) -> EncodedFace:
        """Return a face by its number, from memory or from the database.

        Raises LabError: it is there no longer, or on other cells than when the lab was opened.
        """
        if number not in self.known:
            object_id = int(self.faces[number, 0])
            name = self.names[object_id]
            with read_transaction(self.engine) as connection:
                found = _read_faces(connection, object_id, name)
            cells = np.bincount(self.owners[:-1], minlength=len(self.faces))
            for mine in self.faces_of(name):
                one = found.get(int(self.faces[mine, 1]))
                held = np.full(cells[mine], mine)
                if not one or not np.array_equal(self.at(one.rows, one.columns)[0], held):
                    raise LabError(
                        f"'{name}' was removed or made again after the lab was opened",
                        fix="open the lab again: start the command again",
                        place=place_of(self.engine.url),
                    )
                self.known[mine] = one
        return self.known[number]

    def faces_of(self, object_name: str) -> list[int]:
        """Return the numbers of an object's faces; none if other arrays bear them."""
        numbers: list[int] = np.flatnonzero(
            self.faces[:, 0] == self._ids.get(object_name, -1)
        ).tolist()
        return numbers

    @cached_property
    def _ids(self) -> dict[str, int]:
        return {name: object_id for object_id, name in self.names.items()}


def cell_keys(columns: int, rows: Ints, columns_at: Ints) -> NDArray[np.uint64]:
    """Return row * columns + column of cells on the torus, exact up to 2^64 cells."""
    return rows.astype(np.uint64) * np.uint64(columns) + columns_at.astype(np.uint64)


@dataclass(frozen=True, slots=True, eq=False)
class Lab:
    """Everything that a touch may show; prints as its contents.

    A context manager, for those who like to close what they open: nothing is kept open.
    """

    url: str
    arrays: tuple[EmbossedArray, ...]

    def __enter__(self) -> Lab:
        return self

    def __exit__(self, *_: object) -> None:
        for each in self.arrays:
            each.engine.dispose()

    def __repr__(self) -> str:  # of a notebook, too, so without a password
        objects = {name for each in self.arrays for name in each.names.values()}
        faces = sum(len(each.faces) for each in self.arrays)
        symbols = sum(len(each.keys) for each in self.arrays)
        held = (
            count_of(len(objects), "object"),
            count_of(faces, "face"),
            count_of(symbols, "symbol"),
        )
        return f"{without_password(self.url)}: {', '.join(held)}"


def find_face(lab: Lab, object_name: str, face: str) -> tuple[int, int] | None:
    """Return which array of a lab bears a face, and its number there; None if none does."""
    for which, each in enumerate(lab.arrays):
        for number in each.faces_of(object_name):
            if each.face(number).face == face:
                return which, number
    return None


def open_lab(database: str | Path) -> Lab:
    """Return the lab of a database: a file, `sqlite:///lab.db`, or `postgresql://user@host/name`.

    Raises
    ------
    DatabaseError
        The database cannot be read.
    LabError
        It holds no encoded object.

    Examples
    --------
    >>> lab = open_lab("lab.db")
    >>> embossed = lab.arrays[0]
    >>> embossed.alphabet.name, embossed.style.pitch_mm, embossed.face(0).object
    ('tactel-8', 5.0, 'Cube')
    """
    engine, url = open_database(database, writable=False), str(database)
    with read_transaction(engine) as connection:
        arrays = _embossed_arrays(connection, engine)
    if not arrays:
        raise LabError(
            "the database holds no encoded object",
            fix="register one first: encode-object SPEC.yaml --database " + url,
            place=url,
        )
    return Lab(url, arrays)


@of_rows
def _embossed_arrays(connection: Connection, engine: Engine) -> tuple[EmbossedArray, ...]:
    found = []
    styles: dict[tuple[int, str, SymbolStyle], list[RegisteredStyle]] = {}
    for entry in read_styles(connection):
        styles.setdefault((entry.array_id, entry.alphabet, entry.style), []).append(entry)
    cells: dict[int, Ints] = {}
    surfaces = read_surfaces(connection)
    for (array_id, alphabet, style), objects in sorted(styles.items(), key=lambda item: item[0][0]):
        if array_id not in cells:
            cells = {array_id: held_cells(connection, array_id)}
        mine = cells[array_id]
        mine = mine[np.isin(mine[:, 2], [entry.object_id for entry in objects])]
        if len(mine) == 0:
            continue
        array = make_array(connection, array_id)
        faces, owners = np.unique(mine[:, 2:4], axis=0, return_inverse=True)
        keys = cell_keys(array.columns, mine[:, 0], mine[:, 1])
        dense = None
        if array.rows * array.columns <= DENSE_CELLS:
            dense = np.full(array.rows * array.columns, len(mine), np.int32)
            dense[keys] = np.arange(len(mine))
        one = EmbossedArray(
            array=array,
            alphabet=alphabet_from(json.loads(alphabet)),
            style=style,
            keys=keys,
            owners=np.append(owners.reshape(-1), -1).astype(np.int32),
            labels=np.append(mine[:, 4], -1).astype(np.int8),
            dense=dense,
            faces=faces,
            names={entry.object_id: entry.name for entry in objects},
            engine=engine,
            radii_mm=radii_of(
                bent for entry in objects for bent in surfaces.get(entry.object_id, ())
            ),
        )
        found.append(one)
    return tuple(found)


def radii_of(surfaces: Iterable[Developable]) -> tuple[float, ...]:
    """Return a ladder of radii that covers those at which a plate can touch round faces.

    A cone has all radii from its largest down.
    """
    least, finer = LEAST_RADIUS_MM, RADIUS_FACTOR
    steps: set[int] = set()
    for surface in surfaces:
        if surface.concave:
            continue  # a flat plate feels nothing in a hole
        largest = surface.radius_mm / math.cos(surface.half_angle_rad)
        last = round(math.log(min(max(largest, least), MOST_RADIUS_MM) / least) / math.log(finer))
        steps |= set(range(last + 1)) if surface.half_angle_rad else {last}
    return tuple(least * finer**step for step in sorted(steps))


@of_rows
def _read_faces(connection: Connection, object_id: int, name: str) -> dict[int, EncodedFace]:
    """Return encoded faces of an object by their numbers in it; none where it is no longer."""
    entry = find_object(connection, name)
    if entry is None or entry.object_id != object_id:
        return {}
    prints = (*read_as_built(connection, object_id), *read_as_built(connection))
    return dict(_encoded_faces(read_object(connection, name), prints))


def _encoded_faces(
    found: RegisteredObject, prints: Sequence[AsBuilt]
) -> Iterable[tuple[int, EncodedFace]]:
    for layout in found.layout.faces:
        face = found.faces[layout.face]
        part = part_with(found, face.name)
        T_part_face, printed = None, None
        if face.round is None:
            known = None
            if part is not None:
                T_part_face = np.linalg.inv(part.T_object_part) @ face.T_object_face
                known = print_of(prints, part.name, printer_of(found))
            printed = PrintedFace(
                known or usual_print(), _about_symbols(T_part_face, layout.centres_mm)
            )
        yield (
            layout.face,
            EncodedFace(
                object=found.entry.name,
                face=face.name,
                T_object_face=face.T_object_face,
                polygon_mm=(face.round.outline_mm,) if face.round else face.polygon_mm,
                rotation_rad=layout.placement.rotation_rad,
                rows=layout.rows,
                columns=layout.columns,
                labels=layout.labels,
                centres_mm=layout.centres_mm,
                round=face.round,
                part="" if part is None else part.name,
                T_part_face=T_part_face,
                printed=printed,
            ),
        )


def _about_symbols(
    T_part_face: NDArray[np.float64] | None, centres_mm: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return T_part_face (4, 4) with the origin in the middle of the face's symbols (n, 2).

    Places on a printed face are counted from there (`docs/printed.md`). A face of no registered
    part is taken to be a part of its own, printed as it lies.
    """
    about = np.eye(4)
    if T_part_face is not None:
        about[:3, :3] = T_part_face[:3, :3]
    if len(centres_mm):
        about[:3, 3] = -about[:3, :2] @ centres_mm.mean(axis=0)
    return about


def part_with(found: RegisteredObject, face: str) -> RegisteredPart | None:
    """Return the printed part that bears a face: its panel, or the whole body; None if neither."""
    names = {part.name for part in found.parts}
    for part in found.parts:
        if part.name.endswith(f"-{face}") or len(names) == 1:
            return part
    return None


def printer_of(found: RegisteredObject) -> str:
    """Return the printer that an object was made for; empty where its spec names none."""
    spec = found.spec
    return str(spec.get("printer", "")) if isinstance(spec, dict) else ""
