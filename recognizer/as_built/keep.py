"""Estimates of the parts of an object -> the database: each part, and what its printer makes.

In one transaction; what was known of a part or of the printer and material before is replaced.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from sqlalchemy import Connection

from generator.database.as_built import AsBuilt, read_as_built, write_as_built
from generator.database.open import existing_database
from generator.database.read import list_objects
from generator.database.transaction import write_transaction
from recognizer.as_built.estimate import estimate_printer


def keep_prints(database: str | Path, prints: Sequence[AsBuilt]) -> AsBuilt:
    """Keep how parts of one printer and material came out; returns what the printer makes.

    Raises
    ------
    DatabaseError
        The database cannot be written.
    """
    with write_transaction(existing_database(str(database))) as connection:
        for one in prints:
            write_as_built(connection, one)
        printer = estimate_printer(_parts_like(connection, prints[0]))
        write_as_built(connection, printer)
    return printer


def _parts_like(connection: Connection, one: AsBuilt) -> list[AsBuilt]:
    """Return all parts that are known of the same printer and material."""
    return [
        other
        for entry in list_objects(connection)
        for other in read_as_built(connection, entry.object_id)
        if other.part is not None and (other.printer, other.material) == (one.printer, one.material)
    ]
