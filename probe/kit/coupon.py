"""A small encoded plate for the first touch: one panel of a flat box, with a database of its own.

Its lab has a key of its own, the same for everybody: every coupon of a type is alike, and is found
in `coupon.db` alone. The same type gives the same bytes of both, so the time in it is a fixed one.
"""

from __future__ import annotations

import sqlite3
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from encoded_objects.base.sensor_type import SensorType
from generator.array.profiles import smallest_profile
from generator.cad.encode import encode
from generator.solid import Part
from probe.kit.sizes import COUPON_MM, KitSizes

KEY = "V2DC-7EWP-B45S-77XC"  #: of the lab of all coupons
NAME, DATABASE = "Coupon", "coupon.db"
UNDATED = "1980-01-01T00:00:00+00:00"  #: time of making in every coupon, as in its 3MF


@dataclass(frozen=True, slots=True)
class Coupon:
    """A printed plate, and its registration."""

    part: Part
    side_mm: float
    pitch_mm: float
    printer: str


def make_coupon(k: KitSizes, sensor: SensorType, printer: str, database: Path) -> Coupon:
    """Register a coupon that a sensor type reads in a database file, and return its plate."""
    from build123d import Box

    side, pitch_mm = k.coupon_mm, sensor.symbol_pitch_mm
    made = encode(
        Box(side, side, COUPON_MM),
        name=NAME,
        database=str(database),
        folder=database.parent,
        formats=(),
        profile=smallest_profile(sensor),
        symbols={"pitch": pitch_mm},
        print={"printer": printer},
        output={"lab_key": KEY},
    )
    _undate(database)
    best = max(made.parts, key=lambda part: (part.symbols, -part.T_object_part[2, 2]))
    return Coupon(best, side, pitch_mm, printer)


def _undate(database: Path) -> None:
    """Put the same time into every coupon's database, and erase the earlier one."""
    with closing(sqlite3.connect(database)) as connection:
        with connection:
            connection.execute("UPDATE provenance SET utc = ?", (UNDATED,))
        connection.execute("VACUUM")
