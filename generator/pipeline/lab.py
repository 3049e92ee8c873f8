"""The lab that objects are made in: its key, asked for, stored or drawn, and its arrays."""

from __future__ import annotations

from collections.abc import Sequence

from sqlalchemy import Connection

from generator.array.lab_key import draw_lab_key, read_lab_key
from generator.database.lab import LabArrays, lab_arrays, require_lab_key
from generator.pipeline.blame import errors_at
from generator.spec import LocatedSpec


def lab_of(
    specs: Sequence[LocatedSpec], connection: Connection | None, lab_key: str = ""
) -> LabArrays:
    """Return key and arrays of the lab in which specs are made.

    Parameters
    ----------
    specs
        Of one run; they agree on a key, or say none.
    connection
        Of a transaction on the lab's database; None where there is none yet, and a key that
        nobody asked for is drawn.
    lab_key
        In place of the specs' own.

    Raises
    ------
    GeneratorError
        The key is misspelt, or the database has another one.
    """
    wanted = read_lab_key(lab_key) if lab_key else specs[0].spec.lab_key
    if connection is None:
        return LabArrays(wanted or draw_lab_key(), {})
    if lab_key:
        require_lab_key(connection, wanted)
    elif wanted:
        with errors_at(specs[0], "output.lab_key"):
            require_lab_key(connection, wanted)
    return lab_arrays(connection)
