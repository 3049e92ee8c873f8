"""Files of a run: whole or not there; touches in Parquet files of a thousand.

Rows -> `shards/<series>/00000.parquet`, CPU times -> `times/<series>/00000.parquet`. A file
appears under its name by a rename after its bytes are on the disk, the times first: where
the shard is, it is done. Other tools read them as they are.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from encoded_objects.base.files import whole_file
from recognizer.validation.campaign import Series
from recognizer.validation.errors import ValidationError
from recognizer.validation.limits import COLUMNS as LIMIT_COLUMNS
from recognizer.validation.trial import COLUMNS, Row

if TYPE_CHECKING:
    import pyarrow as pa

SHARDS, TIMES, LIMITS = "shards", "times", "limits"
TIME_COLUMNS = {"number": "int", "drawing": "float", "reading": "float"}  #: CPU of a touch, s
ADDED = ("drawn_anew", "touches")  #: columns that runs of before may lack
GROUP = 100_000  #: rows that a file holds together


def write_text(path: Path, text: str) -> None:
    """Write a text file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with whole_file(path) as file:
        file.write(text.encode())


def write_json(path: Path, values: Any) -> None:
    """Write values as JSON."""
    write_text(path, json.dumps(values, indent=1, ensure_ascii=False, allow_nan=False) + "\n")


def write_table(table: pa.Table, path: Path, compression: str = "zstd") -> None:
    """Write a table."""
    import pyarrow.parquet as pq

    path.parent.mkdir(parents=True, exist_ok=True)
    with whole_file(path) as file:
        pq.write_table(table, file, compression=compression, row_group_size=GROUP)


@contextmanager
def whole_folder(path: Path) -> Iterator[Path]:
    """Yield a folder to write to; it becomes `path`, in place of the one there, at the end."""
    draft = path.with_name(f".{path.name}.writing")
    shutil.rmtree(draft, ignore_errors=True)
    yield draft
    shutil.rmtree(path, ignore_errors=True)
    draft.rename(path)


def shard_file(folder: Path, series: str, shard: int, what: str = SHARDS) -> Path:
    """Return where a shard, or its times, are kept."""
    return folder / what / series / f"{shard:05d}.parquet"


def _schema(what: str) -> pa.Schema:
    """Return the types of the columns of rows, or of times, in a file."""
    import pyarrow as pa

    types = {"str": pa.string(), "int": pa.int64(), "bool": pa.bool_(), "float": pa.float64()}
    columns = {SHARDS: COLUMNS, TIMES: TIME_COLUMNS, LIMITS: LIMIT_COLUMNS}[what]
    return pa.schema([(name, types[kind]) for name, kind in columns.items()])


def write_shard(
    folder: Path, series: str, shard: int, rows: Iterable[Row], times: Iterable[Row],
    limits: Sequence[Row] = (),
) -> None:  # fmt: skip
    """Write a shard, its times, and limits if there are any, in the order of their numbers."""
    import pyarrow as pa

    for what, found in ((TIMES, times), (LIMITS, limits), (SHARDS, rows)):
        if what == LIMITS and not limits:
            continue
        ordered = sorted(found, key=lambda row: row["number"])
        table = pa.Table.from_pylist(ordered, schema=_schema(what))
        write_table(table, shard_file(folder, series, shard, what))


def done_shards(folder: Path, series: Series) -> set[int]:
    """Return which shards of a series are there."""
    shards = range(series.shards)
    return {shard for shard in shards if shard_file(folder, series.name, shard).exists()}


def read_series(folder: Path, series: Series, what: str = SHARDS) -> pa.Table:
    """Return all rows, or all times, of a series that is done.

    Columns of `ADDED` that an earlier version did not write hold nothing.

    Raises ValidationError: the files lack another column.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    files = [shard_file(folder, series.name, shard, what) for shard in range(series.shards)]
    table = pa.concat_tables([pq.read_table(file) for file in files]).combine_chunks()
    if what != SHARDS:
        return table
    schema = _schema(what)
    missing = [name for name in schema.names if name not in table.column_names]
    if set(missing).difference(ADDED):
        raise ValidationError(
            f"touches of another version: they lack {', '.join(missing)}",
            fix="touch the set again, in another folder",
            place=str(folder),
        )
    for name in missing:
        table = table.append_column(name, pa.nulls(len(table), schema.field(name).type))
    return table.select(schema.names)


def columns_of(table: pa.Table) -> dict[str, Any]:
    """Return the columns of a table as arrays; texts as arrays of objects."""
    return {name: table.column(name).to_numpy() for name in table.column_names}
