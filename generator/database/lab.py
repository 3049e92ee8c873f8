"""The lab's key, the arrays that its objects are made on, and how full these are.

A database has its key from the day it was made; one that was brought here from schema version
1 or 2 has none, and its arrays are the published ones. A profile that the lab has made objects
on keeps its array, whatever a later version would make of the same key. Arrays that came with
imported objects are other labs': nothing new is placed on them.

An array is full where it has no free blocks for whole faces any more; a larger one is then
taken. Of k symbols out of q a foreign surface shows a given place's with probability q^-k,
whatever the size of the array: where too many places are registered for one touch, a finer pitch
helps, a larger array does not.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from sqlalchemy import Connection, func, select

from generator.array import PROFILES, FoldedArray, ProductArray, Profile, array_from
from generator.array.contract import symbols_seen, touches_needed
from generator.array.lab_key import read_lab_key
from generator.database.read import check_pitch, read_array
from generator.database.registered import RegisteredArray
from generator.database.tables import arrays, cells, meta, objects
from generator.database.transaction import of_rows, place_of
from generator.errors import LabKeyError

META = "lab_key"  #: in `meta`


@of_rows
def lab_key(connection: Connection) -> str:
    """Return the key of a database; empty where its arrays are the published ones."""
    found = connection.execute(select(meta.c.value).where(meta.c.key == META))
    return str(found.scalar_one_or_none() or "")


def require_lab_key(connection: Connection, wanted: str) -> None:
    """Refuse a key that is not the database's; raises `LabKeyError`."""
    key = lab_key(connection)
    if read_lab_key(wanted) != key:
        has = f"has the lab key {key}" if key else "was made before there were lab keys"
        raise LabKeyError(
            f"the lab key {wanted} was given, but the database {has}",
            fix="leave the key out, or name another database; a new one takes the key",
            place=place_of(connection.engine.url),
        )


@dataclass(frozen=True, slots=True)
class LabArrays:
    """On which array a lab makes the objects of each profile."""

    key: str  #: empty where all arrays are the published ones
    made: Mapping[str, RegisteredArray]  #: that objects were made on, by profile
    symbols: Mapping[int, FoldedArray | ProductArray]  #: of these, by their numbers

    def of_profile(self, profile: Profile) -> FoldedArray | ProductArray:
        """Return the lab's array of a profile; profiles that differ in pitch share one."""
        if profile.keyed:
            alike = {name for name, one in PROFILES.items() if one.encoding == profile.encoding}
            kept = [self.made[name] for name in alike | {profile.name} if name in self.made]
            if kept:
                return self.symbols[min(one.array_id for one in kept)]
        return profile.array_of_lab(self.key)

    def key_of(self, profile: Profile) -> str:
        """Return the key that the lab's array of a profile was made from; empty: published."""
        return self.key if profile.keyed else ""


@of_rows
def lab_arrays(connection: Connection) -> LabArrays:
    """Return the key of a database and the arrays that its own objects were made on."""
    key = lab_key(connection)
    query = select(arrays.c.array_id, arrays.c.profile).order_by(arrays.c.array_id.desc())
    mine = query.where(arrays.c.lab_key.is_not_distinct_from(key or None))
    made = {name: read_array(connection, number) for number, name in connection.execute(mine)}
    symbols = {one.array_id: array_from(one.definition) for one in made.values()}
    return LabArrays(key, made, symbols)


MOST_FILLED = 0.8  #: share of an array that faces of all shapes fill without a search
#: Probability of a foreign touch to match a registered place: the doubt that readers allow.
_CHANCE = 1e-4


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
        return int(_CHANCE * self.order ** min(self.symbols, 100.0))  # a larger float overflows


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
        return max(0, int(MOST_FILLED * self.array.rows * self.array.columns) - self.taken)


@dataclass(frozen=True, slots=True)
class Fullness:
    """The arrays of a database and their use."""

    lab_key: str  #: empty where the arrays are the published ones
    arrays: tuple[ArrayUse, ...]
    pitches: tuple[PitchUse, ...]


@of_rows
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
        check_pitch(pitch)
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
            PitchUse(pitch, order, places[pitch, order], symbols_seen(pitch),
                     touches_needed(order, largest[pitch, order], pitch))
            for pitch, order in sorted(places)
        ),
    )  # fmt: skip
