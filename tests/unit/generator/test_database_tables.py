"""The tables: what the database refuses without our help, taken cells as bits, prints."""

import sqlite3
from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest
from reference.cells import PLACES, listed
from sqlalchemy import func, insert, select, text

from generator.database import tables
from generator.database.as_built import AsBuilt, read_as_built, write_as_built
from generator.database.cells import mark_cells, occupied_cells
from generator.database.open import open_database
from generator.database.register import remove_object
from generator.database.transaction import read_transaction, write_transaction
from generator.database.transfer import copy_objects
from generator.errors import DatabaseError
from generator.layout.occupancy import TILE


def cell(**changes):
    row = {"array_id": 1, "row": 5, "column": 2**63 - 2, "object_id": 1, "face_id": 0}
    return {**row, "position": 0, "label": 3, "x_mm": 1.0, "y_mm": 2.0, **changes}


@pytest.fixture
def engine(lab_url):
    """A database with one object: a single face of three vertices, and one cell; two arrays."""
    engine = open_database(lab_url)
    one = {"object_id": 1}
    style = {"pitch_mm": 7, "height_mm": 1, "stroke_mm": 1.4, "draft_rad": 0.1, "chamfer_mm": 0}
    array = {"profile": "p", "rows": 2**63 - 1, "columns": 2**63 - 1, "window_rows": 3,
             "window_columns": 2, "order": 4, "definition": "{}"}  # fmt: skip
    rows = [
        *((tables.arrays, array | {"definition_sha256": str(k)}) for k in range(2)),
        (tables.alphabets, {"alphabet_id": 1, "name": "a", "definition": "{}",
                            "definition_sha256": "0"}),
        (tables.objects, {**one, "name": "one", "object_type": "file", "number_of_vertices": 3,
                          "number_of_faces": 1, "array_id": 1, "alphabet_id": 1, "layout": "net",
                          "layout_warnings": "[]", **style}),
        (tables.provenance, {**one, "tool_version": "1", "spec_hash": "0", "spec": "{}",
                             "utc": "2026-01-01"}),
        *((tables.vertices, {**one, "vertex_id": k, "x_vertex": k, "y_vertex": -0.0,
                             "z_vertex": 0.1}) for k in range(3)),
        (tables.faces, {**one, "face_id": 0, "name": "F1", "face_type": "triangle",
                        "number_of_edges": 3, "face_area": 2.0}),
        (tables.placements, {**one, "face_id": 0, "position": 0, "row": 0, "column": 0,
                             "rotation_rad": 0, "x_mm": 0, "y_mm": 0, "places": 1, "blank": 0}),
        (tables.cells, cell()),
    ]  # fmt: skip
    with write_transaction(engine) as connection:
        for table, row in rows:
            connection.execute(insert(table), [row])
    return engine


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"row": 5}, "another object holds"),
        ({"object_id": 2}, "refuses"),
        ({"array_id": 2}, "refuses"),  # the object stands on array 1
        ({"face_id": 1}, "refuses"),  # not placed
        ({"row": -1}, "refuses"),
        ({"label": -1}, "refuses"),
    ],
)
def test_a_cell_of_nothing_is_refused(engine, changes, said):
    with pytest.raises(DatabaseError, match=said), write_transaction(engine) as connection:
        connection.execute(insert(tables.cells), [cell(row=6, position=1) | changes])
    with read_transaction(engine) as connection:
        assert connection.execute(select(tables.cells.c.column)).scalars().all() == [2**63 - 2]


def test_links_to_missing_edges_are_refused_at_the_commit(engine):
    edge = {"object_id": 1, "edge_id": 0, "face_id": 0, "right_face_id": 0, "edge_length": 1.0}
    edge |= {"start_vertex_id": 0, "end_vertex_id": 1}
    links = dict.fromkeys(("left_previous_id", "left_next_id", "right_previous_id"), 0)
    with (
        pytest.raises(DatabaseError, match=r"(?i)foreign key"),
        write_transaction(engine) as connection,
    ):
        connection.execute(insert(tables.edges), [edge | links | {"right_next_id": 1}])
    with write_transaction(engine) as connection:
        connection.execute(insert(tables.edges), [edge | links | {"right_next_id": 0}])


def test_an_object_goes_as_a_whole_and_its_parts_do_not_go_alone(engine):
    for table in ("faces", "placements"):
        with (
            pytest.raises(DatabaseError, match=r"(?i)foreign key"),
            write_transaction(engine) as connection,
        ):
            connection.execute(text(f"DELETE FROM {table}"))
    with write_transaction(engine) as connection:
        connection.execute(text("DELETE FROM objects"))
        for table in (tables.vertices, tables.faces, tables.placements, tables.cells):
            assert connection.execute(select(table)).all() == []


def test_the_same_schema_has_the_same_order_on_every_run(tmp_path):
    open_database(str(tmp_path / "lab.db"))
    with closing(sqlite3.connect(tmp_path / "lab.db")) as connection:
        made = connection.execute(
            "SELECT tbl_name, name FROM sqlite_master WHERE type = 'index' AND sql IS NOT NULL"
        ).fetchall()
    of_edges = [name for table, name in made if table == "edges"]
    assert len(of_edges) == 4
    assert of_edges == sorted(of_edges)


# Taken cells: the same ones come back, wherever on the array


@pytest.mark.parametrize("place", PLACES)
def test_cells_come_back_sorted(engine, place):
    with write_transaction(engine) as connection:
        mark_cells(connection, 1, PLACES[place], taken=True)
        assert listed(occupied_cells(connection, 1)) == sorted(listed(PLACES[place]))
        assert listed(occupied_cells(connection, 2)) == []


def test_a_block_of_cells_is_few_rows(engine):
    block = tuple(index.ravel() for index in np.mgrid[10 : 10 + 4 * TILE, 0 : 4 * TILE])
    with write_transaction(engine) as connection:
        mark_cells(connection, 1, block, taken=True)
        count = connection.execute(select(func.count()).select_from(tables.occupancy)).scalar_one()
        assert count == 20
        assert len(occupied_cells(connection, 1)[0]) == 16 * TILE**2


# Prints as they came out: kept with their object, printer and material, and gone with it

COVARIANCE = np.diag([1e-8, 2e-8, 3e-8, 1e-4]) + 1e-10
MEASURED = AsBuilt(1, None, "mk4", "PLA", 0.997, 0.1 + 0.2, -0.0, 1.43, COVARIANCE, 25)


def same(one, other):
    fields = [name for name in AsBuilt.__slots__ if name != "covariance"]
    assert [repr(getattr(one, f)) for f in fields] == [repr(getattr(other, f)) for f in fields]
    assert one.covariance.tobytes() == other.covariance.tobytes()


def test_prints_are_read_bit_for_bit(engine):
    written = [MEASURED, replace(MEASURED, part="F2"), replace(MEASURED, object_id=None)]
    with write_transaction(engine) as connection:
        for one in written[::-1]:
            write_as_built(connection, one)
        found = (*read_as_built(connection, 1), *read_as_built(connection))
        for one, other in zip(found, written, strict=True):
            same(one, other)
        assert read_as_built(connection, 2) == ()
        assert not found[0].covariance.flags.writeable


def test_a_later_measurement_takes_the_place_of_the_same_one_only(engine):
    with write_transaction(engine) as connection:
        write_as_built(connection, MEASURED)
        write_as_built(connection, replace(MEASURED, part="F2"))
        write_as_built(connection, replace(MEASURED, material="PETG", touches=50))
        for changes in ({"printer": "x1"}, {"material": "PETG"}, {}, {"touches": 75}):
            write_as_built(connection, replace(MEASURED, object_id=None, **changes))
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
        write_as_built(connection, MEASURED)
        write_as_built(connection, replace(MEASURED, object_id=None))
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
        {"covariance": np.eye(3)},
        {"covariance": np.full((4, 4), np.nan)},
    ],
)
def test_prints_that_cannot_be_are_refused(engine, changes):
    with pytest.raises(DatabaseError), write_transaction(engine) as connection:
        write_as_built(connection, replace(MEASURED, **changes))


def test_prints_go_with_their_object_to_another_lab(engine, new_database, monkeypatch):
    for check in ("array_here", "check_alphabet", "check_cells", "check_readable"):
        monkeypatch.setattr(f"generator.database.transfer.{check}", lambda *_: None)
    other = open_database(new_database("sqlite"))
    with write_transaction(engine) as connection:
        write_as_built(connection, MEASURED)
    with read_transaction(engine) as source, write_transaction(other) as target:
        copy_objects(source, target)
        same(read_as_built(target, 1)[0], MEASURED)
