"""Rows into a table, as each engine takes them fastest."""

from __future__ import annotations

from typing import Any

from sqlalchemy import Connection, Table, bindparam, func, insert, select

Row = dict[str, Any]
Rows = list[Row]


def insert_rows(connection: Connection, table: Table, rows: Rows) -> None:
    """Insert rows of one table, all of which name the same columns; none is well, too.

    A server gets one statement with an array per column: a message per row costs it twice
    the time, and its driver complains aloud when one of them is refused.
    """
    if not rows:
        return
    if connection.dialect.name != "postgresql":
        connection.execute(insert(table), rows)
        return
    from sqlalchemy.dialects.postgresql import ARRAY

    names = list(rows[0])
    columns = [
        bindparam(None, [row[name] for row in rows], type_=ARRAY(table.c[name].type))
        for name in names
    ]
    connection.execute(insert(table).from_select(names, select(*map(func.unnest, columns))))
