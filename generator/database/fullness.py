"""How full a lab's arrays are, and how full before a single touch is not enough.

Two limits: an array has no free blocks for whole faces any more, and then a larger one is
taken; and so many places are registered that a surface of no object, another lab's say, shows
what one of them shows. Of k symbols out of q it shows a given place's with probability q^-k,
whatever the size of the array: a larger array is no help there, a finer pitch is.
"""

from __future__ import annotations

from dataclasses import dataclass

from sqlalchemy import Connection, func, select

from generator.array.touches import symbols_seen, touches_needed
from generator.database.lab import lab_key
from generator.database.read import read_array
from generator.database.registered import RegisteredArray
from generator.database.tables import cells, objects


@dataclass(frozen=True, slots=True)
class FullnessLimits:
    """From where on more room, or more symbols a touch, are advised."""

    full: float = 0.8
    """Share of an array that faces of all shapes fill without a search."""
    chance: float = 1e-4
    """Of a foreign touch to match a registered place: as the doubt that readers allow."""


LIMITS = FullnessLimits()


@dataclass(frozen=True, slots=True)
class PitchUse:
    """The registered places of one pitch and number of symbols, over all arrays."""

    pitch_mm: float
    order: int  #: number of symbols
    places: int  #: registered cells that begin what a touch can show
    symbols: float  #: that a touch shows, about
    touches: int  #: that an answer needs, about; 1: no scan

    @property
    def chance(self) -> float:
        """Of a foreign touch to show what some registered place shows."""
        return float(min(1.0, self.places * self.order**-self.symbols))

    @property
    def most_places(self) -> int:
        """Registered places up to which a single touch is enough."""
        return int(LIMITS.chance * self.order**self.symbols)


@dataclass(frozen=True, slots=True)
class ArrayUse:
    """How much of an array is taken."""

    array: RegisteredArray
    own: bool  #: the lab's own objects are made on it; other labs' came with an import
    objects: int
    taken: int  #: cells

    @property
    def room(self) -> int:
        """How many more cells faces of all shapes can have."""
        return max(0, int(LIMITS.full * self.array.rows * self.array.columns) - self.taken)


@dataclass(frozen=True, slots=True)
class Fullness:
    """What a database says of its arrays."""

    lab_key: str  #: empty where the arrays are the published ones
    arrays: tuple[ArrayUse, ...]
    pitches: tuple[PitchUse, ...]


def read_fullness(connection: Connection) -> Fullness:
    """Return how full the arrays of a database are; arrays without objects are left out."""
    key = lab_key(connection)
    held = (
        select(objects.c.array_id, objects.c.pitch_mm, func.count().label("cells"))
        .join(cells, cells.c.object_id == objects.c.object_id)
        .group_by(objects.c.array_id, objects.c.pitch_mm)
    )
    number = select(objects.c.array_id, func.count()).group_by(objects.c.array_id)
    objects_on = {row[0]: row[1] for row in connection.execute(number)}
    taken: dict[int, int] = {}
    places: dict[tuple[float, int], int] = {}
    largest: dict[tuple[float, int], int] = {}
    known: dict[int, RegisteredArray] = {}
    for array_id, pitch, count in connection.execute(held):
        array = known.setdefault(array_id, read_array(connection, array_id))
        taken[array_id] = taken.get(array_id, 0) + count
        kind = pitch, array.order
        places[kind] = places.get(kind, 0) + count
        largest[kind] = max(largest.get(kind, 0), array.rows * array.columns)
    return Fullness(
        key,
        tuple(
            ArrayUse(known[k], known[k].lab_key in ("", key), objects_on[k], taken[k])
            for k in sorted(known)
        ),
        tuple(
            PitchUse(
                pitch,
                order,
                places[pitch, order],
                symbols_seen(pitch),
                touches_needed(order, largest[pitch, order], pitch),
            )
            for pitch, order in sorted(places)
        ),
    )
