"""Written files as what is touched: the STL of a part in the frame of its face.

Database + object + face -> Scene of the file that the database registers, checked by its
sha256. The part is touched alone, as it lies beside the others: beyond the edges of a panel
there is nothing. Thesis 6.3.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from generator.database.registered import RegisteredObject, RegisteredPart
from generator.database.url import normal_url, part_path
from probe.simulate.part import part_surface
from probe.simulate.registered import registered_object
from probe.simulate.scene import Scene
from probe.surface.contract import Surface
from recognizer.touch.lab import EncodedFace
from recognizer.validation.errors import SetError

Array = NDArray[np.float64]


def written_surface(database: str, object_name: str, face: str) -> Scene:
    """Return a face as it was written.

    Parameters
    ----------
    database
        `lab.db`, `sqlite:///lab.db` or `postgresql://host/name`.
    object_name, face
        As registered.

    Raises
    ------
    SetError
        The object has no STL part that bears the face, the file is not there, or its bytes
        are not those that were registered.
    SurfaceError
        The database cannot be read.
    """
    part = stl_part(registered_object(database, object_name), face)
    path = part_path(normal_url(database), part.file)
    check_file(path, part)
    return part_surface(path, database=database, object_name=object_name, face=face)


def stl_part(held: RegisteredObject, face: str) -> RegisteredPart:
    """Return the STL part that bears a face: its panel, or the whole body.

    Raises
    ------
    SetError
        When there is none.
    """
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
    """See to it that a file holds the bytes that were registered.

    Raises
    ------
    SetError
        When it is not there, or holds others.
    """
    fix = "make it again with encode-object"
    try:
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        cause = f"cannot read the part: {error.strerror}"
        raise SetError(cause, fix=fix, place=str(path)) from error
    if digest != part.sha256:
        cause = "the file is not the one that the database registers"
        raise SetError(cause, fix=fix, place=str(path))


@dataclass(frozen=True, slots=True, eq=False)
class WornAway:
    """A surface on which some symbols are worn down to the face."""

    surface: Surface
    centres_mm: Array  #: (n, 2) of the worn symbols, surface frame
    rotation_rad: float  #: turns the surface's x axis into the array's
    pitch_mm: float

    @property
    def top_mm(self) -> float:
        """Height of what is left."""
        return self.surface.top_mm

    def heights_mm(self, points_mm: Array) -> Array:
        """Return the heights, none above the face in the cell of a worn symbol."""
        heights = self.surface.heights_mm(points_mm)
        c, s = np.cos(self.rotation_rad), np.sin(self.rotation_rad)
        turned = np.array([[c, s], [-s, c]])
        high = np.flatnonzero(heights > 0)
        away = points_mm[high, None, :] @ turned - self.centres_mm @ turned
        gone = (np.abs(away) <= self.pitch_mm / 2).all(axis=2).any(axis=1)
        heights = heights.copy()
        heights[high[gone]] = 0.0
        return heights


def worn_away(
    surface: Surface,
    face: EncodedFace,
    pitch_mm: float,
    share: float,
    rng: np.random.Generator,
) -> WornAway:
    """Return a surface of which a share of the symbols is worn away.

    Parameters
    ----------
    surface
        Of the face, face frame.
    face, pitch_mm
        Where its symbols are.
    share
        Probability that a symbol is gone.
    rng
        Draws them.
    """
    gone = rng.random(len(face.centres_mm)) < share
    return WornAway(surface, face.centres_mm[gone], face.rotation_rad, pitch_mm)
