"""What all tables are declared with: numbers that keep their bits, ties to an object."""

from __future__ import annotations

from typing import Any

from sqlalchemy import Column, Double, ForeignKey, ForeignKeyConstraint, Integer, MetaData
from sqlalchemy.types import UserDefinedType

metadata = MetaData()


class _SqliteDouble(UserDefinedType[float]):
    """An IEEE 754 double that SQLite stores as it is.

    A column of REAL affinity is written as an integer where the value has no
    fraction, which turns -0.0 into 0.0: the same spec would give other bytes when
    its layout is read back. A type name with BLOB in it has no affinity.
    """

    cache_ok = True

    def get_col_spec(self, **_: Any) -> str:
        return "DOUBLE_BLOB"


REAL: Double[float] = Double().with_variant(_SqliteDouble(), "sqlite")


def of_object() -> Column[int]:
    """Return the column that ties a row to its object, and removes it with the object."""
    return Column(
        "object_id", Integer, ForeignKey("objects.object_id", ondelete="CASCADE"), nullable=False
    )


def foreign_key(table: str, column: str, *, key: str, **options: Any) -> ForeignKeyConstraint:
    """Return a foreign key from (object_id, column) to (object_id, key) of `table`.

    It removes nothing: an object goes as a whole, a single vertex or face does not.
    """
    return ForeignKeyConstraint(
        ["object_id", column], [f"{table}.object_id", f"{table}.{key}"], **options
    )
