"""Deviations of prints, as touches measured them: of an object, or of a printer and a material.

Scale, skew and stroke with their covariance. What is kept of an object goes when the object is
replaced or removed.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Connection, delete, insert, select

from generator.database.read import read_only
from generator.database.tables import as_built
from generator.database.transaction import of_rows
from generator.errors import DatabaseError

PARAMETERS = ("scale_x", "scale_y", "skew_rad", "stroke_mm")  #: order in the covariance


@dataclass(frozen=True, slots=True)
class AsBuilt:
    """How a print differs from what was drawn."""

    object_id: int | None  #: None: of whatever `printer` makes of `material`
    part: str | None  #: one part of the object; None: all of it
    printer: str
    material: str
    scale_x: float  #: measured length / drawn length
    scale_y: float
    skew_rad: float  #: by which x and y are off a right angle
    stroke_mm: float  #: width of the strokes of symbols
    covariance: NDArray[np.float64]  #: (4, 4) of (scale_x, scale_y, skew_rad, stroke_mm)
    touches: int  #: on which it rests


_COLUMNS = tuple(as_built.c[field.name] for field in fields(AsBuilt))


def write_as_built(connection: Connection, measured: AsBuilt) -> None:
    """Keep a measurement in place of one of the same object and part, or printer and material.

    Raises
    ------
    DatabaseError
        The covariance is not a finite 4x4 matrix, there is no such object, or a scale, the stroke
        or `touches` is not positive.
    """
    covariance = np.asarray(measured.covariance, np.float64)
    if covariance.shape != (4, 4) or not np.isfinite(covariance).all():
        raise DatabaseError(
            "the covariance of an as-built print is a finite 4x4 matrix",
            fix="measure the print again: recognize-object as-built RECORDING --store",
        )
    named = ("object_id", "part", "printer", "material")
    row = {name: getattr(measured, name) for name in (*named, *PARAMETERS, "touches")}
    alike = named if measured.object_id is None else ("object_id", "part")
    same = [as_built.c[name].is_not_distinct_from(row[name]) for name in alike]
    connection.execute(delete(as_built).where(*same))
    row["covariance"] = json.dumps(covariance.tolist())
    connection.execute(insert(as_built).values(row))


@of_rows
def read_as_built(connection: Connection, object_id: int | None = None) -> tuple[AsBuilt, ...]:
    """Return what is kept of an object, or, with None, of printers and materials.

    In the order of part, printer and material, an object as a whole before its parts.
    """
    of_object = as_built.c.object_id.is_not_distinct_from(object_id)
    found = [
        AsBuilt(**row._asdict() | {"covariance": read_only(json.loads(row.covariance))})
        for row in connection.execute(select(*_COLUMNS).where(of_object))
    ]
    return tuple(sorted(found, key=lambda one: (one.part or "", one.printer, one.material)))
