"""Take objects out of use. A retired object keeps its cells, because it may still lie around.

Retired objects stay in the database with all they have, and a touch still tells them; only
making them again is refused. Freeing is another thing: the object is removed, and the next
one may stand on its cells, so a touch on an old part names the new object.
"""

from __future__ import annotations

from datetime import UTC, datetime

from sqlalchemy import Connection, update

from generator.database.entries import object_entry
from generator.database.register import remove_object
from generator.database.registered import ObjectEntry
from generator.database.tables import objects


def retire(connection: Connection, name: str) -> ObjectEntry:
    """Mark an object as retired; one that is retired keeps its date. Returns its entry now.

    Raises
    ------
    DatabaseError
        When no object has this name; the fix lists names that are known.
    """
    if not object_entry(connection, name).retired_utc:
        _mark(connection, name, datetime.now(UTC).isoformat(timespec="seconds"))
    return object_entry(connection, name)


def restore(connection: Connection, name: str) -> ObjectEntry:
    """Bring a retired object back into use; raises as `retire`."""
    _mark(connection, object_entry(connection, name).name, None)
    return object_entry(connection, name)


def remove(connection: Connection, name: str) -> ObjectEntry:
    """Remove an object and free its cells; returns what its entry was. Raises as `retire`."""
    entry = object_entry(connection, name)
    remove_object(connection, entry.object_id)
    return entry


def _mark(connection: Connection, name: str, utc: str | None) -> None:
    connection.execute(update(objects).where(objects.c.name == name).values(retired_utc=utc))
