"""Files of a run: whole or not there; touches in Parquet files of a thousand.

Rows -> `shards/<series>/00000.parquet`, CPU times -> `times/<series>/00000.parquet`. A file
appears under its name by a rename after its bytes are on the disk, the times first: where
the shard is, it is done. Other tools read them as they are.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from encoded_objects.base.files import whole_file
from recognizer.validation.campaign import Series, shards_of
from recognizer.validation.errors import ValidationError
from recognizer.validation.trial import COLUMNS, CpuTime, Row

if TYPE_CHECKING:
    import pyarrow as pa


def write_text(path: Path, text: str) -> None:
    """Write a text file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with whole_file(path) as file:
        file.write(text.encode())


def write_json(path: Path, values: Any) -> None:
    """Write values as JSON."""
    write_text(path, json.dumps(values, indent=1, ensure_ascii=False, allow_nan=False) + "\n")


SHARDS, TIMES = "shards", "times"
ADDED = ("drawn_anew", "touches")  #: columns that runs of before may lack
GROUP = 100_000  #: rows that a file holds together


def shard_file(folder: Path, series: str, shard: int, what: str = SHARDS) -> Path:
    """Return where a shard, or its times, are kept."""
    return folder / what / series / f"{shard:05d}.parquet"


def row_schema() -> pa.Schema:
    """Return the types of `rows.COLUMNS` in a file."""
    import pyarrow as pa

    types = {"text": pa.string(), "whole": pa.int64(), "truth": pa.bool_()}
    return pa.schema([(name, types.get(str(what), pa.float64())) for name, what in COLUMNS.items()])


def write_shard(
    folder: Path, series: str, shard: int, rows: Iterable[Row], times: Iterable[CpuTime]
) -> None:
    """Write a shard and its times, in the order of the touches' numbers."""
    import pyarrow as pa

    ordered = sorted(rows, key=lambda row: row["number"])
    spent = sorted(times, key=lambda time: time.number)
    schema = pa.schema([(f.name, pa.int64() if f.name == "number" else pa.float64())
                        for f in fields(CpuTime)])  # fmt: skip
    columns = {name: [getattr(time, name) for time in spent] for name in schema.names}
    write_table(pa.table(columns, schema=schema), shard_file(folder, series, shard, TIMES))
    table = pa.Table.from_pylist(ordered, schema=row_schema())
    write_table(table, shard_file(folder, series, shard))


def write_table(table: pa.Table, path: Path) -> None:
    """Write a table under a name that it gets when all of it is on the disk."""
    import pyarrow.parquet as pq

    path.parent.mkdir(parents=True, exist_ok=True)
    with whole_file(path) as file:
        pq.write_table(table, file, compression="zstd", row_group_size=GROUP)


def done_shards(folder: Path, series: Series) -> set[int]:
    """Return which shards of a series are there."""
    return {
        shard
        for shard in range(shards_of(series))
        if shard_file(folder, series.name, shard).exists()
    }


def read_series(folder: Path, series: Series, what: str = SHARDS) -> pa.Table:
    """Return all rows, or all times, of a series that is done.

    Columns of `ADDED` that an earlier version did not write hold nothing.

    Raises
    ------
    ValidationError
        The files lack another column.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    files = [shard_file(folder, series.name, shard, what) for shard in range(shards_of(series))]
    table = pa.concat_tables([pq.read_table(file) for file in files]).combine_chunks()
    if what == TIMES:
        return table
    schema = row_schema()
    missing = [name for name in schema.names if name not in table.column_names]
    if set(missing).difference(ADDED):
        raise ValidationError(
            f"touches of another version: they lack {', '.join(missing)}",
            fix="touch the set again, in another folder",
            place=str(folder),
        )
    for name in missing:
        kind = schema.field(name).type
        table = table.append_column(name, pa.nulls(len(table), kind))
    return table.select(schema.names)


def columns_of(table: pa.Table) -> dict[str, Any]:
    """Return the columns of a table as arrays; texts as arrays of objects."""
    return {name: table.column(name).to_numpy() for name in table.column_names}
