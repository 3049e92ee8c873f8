"""Prints as they came out: kept with their object, printer and material, and gone with it."""

from dataclasses import replace

import numpy as np
import pytest
from sqlalchemy import insert

from generator.database import tables
from generator.database.as_built import AsBuilt, read_as_built, write_as_built
from generator.database.open import open_database
from generator.database.register import remove_object
from generator.database.transaction import read_transaction, write_transaction
from generator.database.transfer import copy_objects
from generator.errors import DatabaseError

STYLE = {"pitch_mm": 7, "height_mm": 1, "stroke_mm": 1.4, "draft_rad": 0.1, "chamfer_mm": 0}
COVARIANCE = np.diag([1e-8, 2e-8, 3e-8, 1e-4]) + 1e-10


def measured(**changes):
    one = AsBuilt(1, None, "mk4", "PLA", 0.997, 0.1 + 0.2, -0.0, 1.43, COVARIANCE, 25)
    return replace(one, **changes)


@pytest.fixture
def engine(lab_url):
    """A database with an object 1 that has no faces."""
    made = open_database(lab_url)
    array = {"profile": "p", "rows": 7, "columns": 9, "window_rows": 3, "window_columns": 2}
    named = {"definition": "{}", "definition_sha256": "0"}
    counts = {"object_type": "file", "number_of_vertices": 3, "number_of_faces": 1}
    with write_transaction(made) as connection:
        connection.execute(insert(tables.arrays).values(array_id=1, order=4, **named, **array))
        connection.execute(insert(tables.alphabets).values(alphabet_id=1, name="a", **named))
        connection.execute(
            insert(tables.objects).values(
                object_id=1, name="one", array_id=1, alphabet_id=1, layout="net",
                layout_warnings="[]", **counts, **STYLE,
            )
        )  # fmt: skip
        connection.execute(
            insert(tables.provenance).values(
                object_id=1, tool_version="1", spec_hash="0", spec="{}", utc="2026-01-01"
            )
        )
    return made


def same(one, other):
    fields = [name for name in AsBuilt.__slots__ if name != "covariance"]
    assert [repr(getattr(one, f)) for f in fields] == [repr(getattr(other, f)) for f in fields]
    assert one.covariance.tobytes() == other.covariance.tobytes()


def test_what_is_written_is_read_bit_for_bit(engine):
    with write_transaction(engine) as connection:
        write_as_built(connection, measured(part="F2"))
        write_as_built(connection, measured())
        write_as_built(connection, measured(object_id=None, scale_x=1.002))
    with read_transaction(engine) as connection:
        whole, part = read_as_built(connection, 1)
        same(whole, measured())
        same(part, measured(part="F2"))
        (of_printer,) = read_as_built(connection)
        same(of_printer, measured(object_id=None, scale_x=1.002))
        assert read_as_built(connection, 2) == ()
        assert not whole.covariance.flags.writeable


def test_a_later_measurement_takes_the_place_of_the_same_one_only(engine):
    with write_transaction(engine) as connection:
        write_as_built(connection, measured())
        write_as_built(connection, measured(part="F2"))
        write_as_built(connection, measured(material="PETG", touches=50))
        for changes in ({"printer": "x1"}, {"material": "PETG"}, {}, {"touches": 75}):
            write_as_built(connection, measured(object_id=None, **changes))
    with read_transaction(engine) as connection:
        found = (*read_as_built(connection, 1), *read_as_built(connection))
    assert [(one.part, one.printer, one.material, one.touches) for one in found] == [
        (None, "mk4", "PETG", 50),  # a part is printed of one material
        ("F2", "mk4", "PLA", 25),
        (None, "mk4", "PETG", 25),
        (None, "mk4", "PLA", 75),
        (None, "x1", "PLA", 25),
    ]


def test_a_removed_object_takes_its_prints_with_it_but_not_the_printers(engine):
    with write_transaction(engine) as connection:
        write_as_built(connection, measured())
        write_as_built(connection, measured(object_id=None))
        remove_object(connection, 1)
        assert read_as_built(connection, 1) == ()
        assert len(read_as_built(connection)) == 1


@pytest.mark.parametrize(
    "changes",
    [
        {"object_id": 2},
        {"object_id": None, "part": "F1"},
        {"scale_x": 0.0},
        {"scale_y": -1.0},
        {"stroke_mm": 0.0},
        {"touches": 0},
    ],
)
def test_what_cannot_be_is_refused(engine, changes):
    with pytest.raises(DatabaseError), write_transaction(engine) as connection:
        write_as_built(connection, measured(**changes))


@pytest.mark.parametrize("covariance", [np.eye(3), np.full((4, 4), np.nan)])
def test_a_covariance_is_a_finite_matrix_of_four(engine, covariance):
    with pytest.raises(ValueError, match="4x4"), write_transaction(engine) as connection:
        write_as_built(connection, measured(covariance=covariance))


def test_prints_go_with_their_object_to_another_lab(engine, new_database, monkeypatch):
    monkeypatch.setattr("generator.database.transfer.array_here", lambda *_: None)
    monkeypatch.setattr("generator.database.transfer.check_alphabet", lambda *_: None)
    monkeypatch.setattr("generator.database.transfer.check_cells", lambda *_: None)
    other = open_database(new_database("sqlite"))
    with write_transaction(engine) as connection:
        write_as_built(connection, measured())
    with read_transaction(engine) as source, write_transaction(other) as target:
        copy_objects(source, target)
        same(read_as_built(target, 1)[0], measured())
