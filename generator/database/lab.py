"""The lab's key, and the arrays that its objects are made on.

A database has its key from the day it was made; one that was brought here from schema version
1 or 2 has none, and its arrays are the published ones. A profile that the lab has made objects
on keeps its array, whatever a later version would make of the same key. Arrays that came with
imported objects are other labs': nothing new is placed on them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from sqlalchemy import Connection, select

from generator.array import PROFILES, FoldedArray, ProductArray, Profile, array_from
from generator.array.lab_key import read_lab_key
from generator.database.read import read_array
from generator.database.registered import RegisteredArray
from generator.database.tables import arrays, meta
from generator.database.transaction import place_of
from generator.errors import LabKeyError

META = "lab_key"  #: in `meta`


def lab_key(connection: Connection) -> str:
    """Return the key of a database; empty where its arrays are the published ones."""
    found = connection.execute(select(meta.c.value).where(meta.c.key == META))
    return str(found.scalar_one_or_none() or "")


def require_lab_key(connection: Connection, wanted: str) -> None:
    """Refuse a key that is not the database's.

    Raises
    ------
    LabKeyError
        The database has another key, or none.
    """
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

    def of_profile(self, profile: Profile) -> FoldedArray | ProductArray:
        """Return the lab's array of a profile; profiles that differ in pitch share one."""
        if profile.keyed:
            alike = {name for name, one in PROFILES.items() if one.encoding == profile.encoding}
            kept = [self.made[name] for name in alike | {profile.name} if name in self.made]
            if kept:
                return array_from(min(kept, key=lambda one: one.array_id).definition)
        return profile.array_of_lab(self.key)

    def key_of(self, profile: Profile) -> str:
        """Return the key that the lab's array of a profile was made from; empty: published."""
        return self.key if profile.keyed else ""


def lab_arrays(connection: Connection) -> LabArrays:
    """Return the key of a database and the arrays that its own objects were made on."""
    key = lab_key(connection)
    query = select(arrays.c.array_id, arrays.c.profile).order_by(arrays.c.array_id.desc())
    mine = query.where(arrays.c.lab_key.is_not_distinct_from(key or None))
    made = {name: read_array(connection, number) for number, name in connection.execute(mine)}
    return LabArrays(key, made)
