"""Version 3: arrays of a lab's own, prints as they came out.

A database that is brought here gets no lab key: what was printed from it stands on the
published arrays, and so will its next objects.
"""

from __future__ import annotations

from sqlalchemy import Connection, text

NUMBER = {"sqlite": "INTEGER", "postgresql": "SERIAL"}  #: a key that counts itself
REAL = {"sqlite": "DOUBLE_BLOB", "postgresql": "DOUBLE PRECISION"}  #: doubles that keep their bits

AS_BUILT = """
CREATE TABLE as_built (
    as_built_id {number} NOT NULL,
    object_id INTEGER,
    part TEXT,
    printer TEXT NOT NULL,
    material TEXT NOT NULL,
    scale_x {real} NOT NULL,
    scale_y {real} NOT NULL,
    skew_rad {real} NOT NULL,
    stroke_mm {real} NOT NULL,
    covariance TEXT NOT NULL,
    touches INTEGER NOT NULL,
    PRIMARY KEY (as_built_id),
    CONSTRAINT part_of_an_object CHECK (object_id IS NOT NULL OR part IS NULL),
    CONSTRAINT print_has_size CHECK (scale_x > 0 AND scale_y > 0 AND stroke_mm > 0),
    CONSTRAINT print_was_touched CHECK (touches > 0),
    FOREIGN KEY(object_id) REFERENCES objects (object_id) ON DELETE CASCADE
)
"""


def upgrade(connection: Connection) -> None:
    """Bring a database of version 2 to version 3."""
    engine = connection.dialect.name
    connection.execute(text("ALTER TABLE arrays ADD COLUMN lab_key VARCHAR(32)"))
    connection.execute(text(AS_BUILT.format(number=NUMBER[engine], real=REAL[engine])))
    connection.execute(text("CREATE INDEX ix_as_built_object_id ON as_built (object_id)"))
