"""The plan of a campaign's touches, and the faces and scenes that it names.

A face is touched as the database has it, as it was printed, or as it was written: the STL file
that the database registers, checked by its sha256, in the frame of the face. The part is touched
alone: beyond the edges of a panel there is nothing. Thesis 6.3.
"""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

from sqlalchemy import Engine

from encoded_objects.base.sensor_type import SensorType, force_share
from generator.database.open import normal_url, open_database, part_path
from generator.database.read import read_object
from generator.database.registered import RegisteredObject, RegisteredPart
from generator.database.transaction import read_transaction
from probe.simulate.registered import (
    registered_object,
    registered_objects,
    scene_of_face,
    scene_of_part,
)
from probe.simulate.scene import Scene, TouchRanges
from probe.simulate.world.levels import LEVELS, Level
from recognizer.touch.lab import EmbossedArray
from recognizer.touch.reader import Reader
from recognizer.validation.encoded_set import DECOYS, is_extra
from recognizer.validation.errors import SetError

FORCE_N = (20.0, 120.0)  #: as a hand or an arm presses
TILT_RAD = math.radians(2.0)  #: at most, of the wrist
ROW = "row"
WORN = 0.2  #: probability that a symbol of a worn face is gone


@dataclass(frozen=True, slots=True)
class TouchPlan:
    """How a touch is drawn.

    `kind` is `face` (the sensor's centre at least `draw.INSIDE_MM` from the edges), `row` (the
    same, with rows of tactels along rows or columns of symbols), `edge` (nearer to the edges),
    `corner` (that near a corner), `worn` (a face with a share of its symbols gone), `copy`, `near`
    or `small` (inside faces of these members, `encoded_set`), `side` (near an edge next to another
    object), `same_profile` (a part of another lab), `anywhere` (uniform over a face), one of
    `encoded_set.DECOYS`, or one of the surfaces of `draw.FOREIGN`.
    """

    database: str
    seed: int = 1
    level: str = "typical"
    kind: str = "face"
    counted_as: str = ""  #: kind as the campaign names it; empty: `kind`
    force_n: tuple[float, float] = FORCE_N
    tilt_rad: float = TILT_RAD
    worn: float = WORN
    files: bool = False  #: touch the written STL files, not the registered faces
    prints: str = ""  #: listing of the printed surfaces that are touched instead; empty: none
    engine: str = "own"  #: of contact, `probe.contact.engines`
    sensor_per: str = "touch"  #: or `run`: the errors of the sensor stay the same
    labs: tuple[str, ...] = ()  #: databases of other labs, of `same_profile`
    policy: str = "one"  #: or `next`: touches follow until one is answered, `trial`
    only: str = ""  #: object/face that is touched; empty: any

    @property
    def noise(self) -> Level:
        """Faults of the sensor; a printed surface brings the print's faults itself."""
        level = LEVELS[self.level]
        return replace(level, wider_mm=0.0, scale=0.0) if self.prints else level

    def knowing(self, reader: Reader) -> Reader:
        """Return a reader that knows where parts are as designed: files and faces without faults.

        A print, also that of a level, is one that nobody has measured.
        """
        if self.prints or self.noise.scale or self.noise.wider_mm:
            return reader
        return replace(reader, options=replace(reader.options, as_designed=True))

    def ranges(self, sensor: SensorType) -> TouchRanges:
        """Return forces and tilts, those of the level if it has its own.

        Forces are those on `fsr-16`; another sensor is pressed as hard (`force_share`).
        """
        level, share = self.noise, force_share(sensor)
        tilt = self.tilt_rad if level.tilt_rad is None else level.tilt_rad
        low, high = level.force_n or self.force_n
        return TouchRanges(force_n=(low * share, high * share), tilt_rad=tilt)

    def face(self, object_name: str, face: str, lab: str = "") -> tuple[Scene, float]:
        """Return a face of the set, or of another lab's database, as the plan touches it.

        Second is how far its inmost point lies from its edges, mm, nearly.

        Raises SetError: as `written_surface`.
        """
        prints = "" if lab else self.prints
        return _face_of_run(lab or self.database, object_name, face, self.files, prints)


@lru_cache(maxsize=512)
def faces_of_kind(
    encoding: EmbossedArray, kind: str, prints: str = "", only: str = ""
) -> list[int]:
    """Return the faces that a kind touches, in the order of their objects' names.

    With prints, those that were printed; with `only`, that face. The order of registration is
    random in a set made in parallel.
    """
    faces, names = encoding.faces.tolist(), encoding.names
    found = sorted(range(len(faces)), key=lambda n: (names[faces[n][0]], faces[n][1]))
    found = [n for n in found if is_extra(names[faces[n][0]], kind)]
    if kind in DECOYS:  # round faces roll away from each other, and are no panels
        found = [n for n in found if encoding.face(n).round is None]
    if only:
        whole = {n: encoding.face(n) for n in found if only.startswith(names[faces[n][0]])}
        found = [n for n, face in whole.items() if f"{face.object}/{face.face}" == only]
    if not prints:
        return found
    from probe.simulate.printed import read_listing

    printed = read_listing(prints).keys
    shown = {n: encoding.face(n) for n in found}
    return [n for n, face in shown.items() if (face.object, face.face) in printed]


@lru_cache(maxsize=8)
def faces_of_lab(database: str) -> list[tuple[str, str]]:
    """Return the objects and faces of another lab that bear symbols, in order."""
    return [
        (name, face.name)
        for name in registered_objects(database)
        for face in registered_object(database, name).faces
        if face.placement is not None
    ]


@lru_cache(maxsize=512)
def _face_of_run(
    database: str, object_name: str, face: str, files: bool, prints: str
) -> tuple[Scene, float]:
    if prints:
        from probe.simulate.printed import printed_scene

        scene = printed_scene(prints, database, object_name, face)
    elif files:
        scene = written_surface(database, object_name, face)
    else:
        scene = scene_of_face(database, _object_of_run(database, object_name), face)
    return scene, scene.inradius_mm()


def written_surface(database: str, object_name: str, face: str) -> Scene:
    """Return a registered face as it was written.

    Raises SetError: the object has no STL part that bears the face, the file is not there, or its
    bytes are not those that were registered; DatabaseError: the database cannot be read, or does
    not hold the object.
    """
    held = _object_of_run(database, object_name)
    part = stl_part(held, face)
    path = part_path(normal_url(database), part.file)
    check_file(path, part)
    return scene_of_part(path, held, part, face)


@lru_cache(maxsize=64)
def _object_of_run(database: str, object_name: str) -> RegisteredObject:
    """Return an object of a set, which stays as it is while it is touched (`set_digest`)."""
    with read_transaction(_database_of_run(database)) as connection:
        return read_object(connection, object_name)


@lru_cache(maxsize=4)
def _database_of_run(database: str) -> Engine:
    """Return a database that stays open, so that each query is compiled once."""
    return open_database(database, writable=False)


def stl_part(held: RegisteredObject, face: str) -> RegisteredPart:
    """Return the STL part that bears a face: its panel, or the whole body; else `SetError`."""
    known = [part for part in held.parts if part.format == "stl"]
    for part in known:
        if part.name.endswith(f"-{face}"):
            return part
    if len(known) == 1:
        return known[0]
    raise SetError(
        f"'{held.entry.name}' has no STL part that bears {face}",
        fix="make it again with --format stl, or touch what the database says: --surfaces database",
        place=held.entry.name,
    )


def check_file(path: Path, part: RegisteredPart) -> None:
    """Raise `SetError` unless a file is there and holds the bytes that were registered."""
    fix = "make it again with encode-object"
    try:
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        cause = f"cannot read the part: {error.strerror}"
        raise SetError(cause, fix=fix, place=str(path)) from error
    if digest != part.sha256:
        cause = "the file is not the one that the database registers"
        raise SetError(cause, fix=fix, place=str(path))
