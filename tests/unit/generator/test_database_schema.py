"""The schema itself: the thesis's tables, and what the database refuses without our help."""

import math
import sqlite3
import subprocess
import sys
from contextlib import closing

import pytest
from sqlalchemy import insert, select, text

from generator.database import tables
from generator.database.open import open_database
from generator.database.transaction import read_transaction, write_transaction
from generator.errors import DatabaseError

THESIS = {  # figure 6.16
    "objects": {"object_id", "object_type", "number_of_vertices", "number_of_faces"},
    "vertices": {"vertex_id", "object_id", "x_vertex", "y_vertex", "z_vertex"},
    "faces": {"face_id", "object_id", "face_type", "number_of_edges", "face_area"},
    "edges": {"edge_id", "face_id", "edge_length"},
    "faces_to_vertices": {"vertex_id", "face_id"},
    "edges_to_vertices": {"vertex_id", "edge_id"},
}


@pytest.fixture
def engine(lab_url):
    return open_database(lab_url)


@pytest.fixture
def filled(engine):
    """A database with one object: a single face of three vertices, and one cell."""
    one = {"object_id": 1}
    style = {"pitch_mm": 7, "height_mm": 1, "stroke_mm": 1.4, "draft_rad": 0.1, "chamfer_mm": 0}
    rows = [
        (tables.arrays, {"array_id": 1, "definition": "{}", "definition_sha256": "0",
                         "profile": "p", "rows": 2**62, "columns": 2**63 - 1, "window_rows": 3,
                         "window_columns": 2, "order": 4}),
        (tables.alphabets, {"alphabet_id": 1, "name": "a", "definition": "{}",
                            "definition_sha256": "0"}),
        (tables.objects, {**one, "name": "one", "object_type": "file", "number_of_vertices": 3,
                          "number_of_faces": 1, "array_id": 1, "alphabet_id": 1, "layout": "net",
                          "layout_warnings": "[]",
                          **style}),
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


def cell(**changes):
    row = {"array_id": 1, "row": 5, "column": 2**63 - 2, "object_id": 1, "face_id": 0}
    return {**row, "position": 0, "label": 3, "x_mm": 1.0, "y_mm": 2.0, **changes}


def test_a_cell_cannot_be_used_twice(filled):
    with (
        pytest.raises(DatabaseError, match="another object holds"),
        write_transaction(filled) as connection,
    ):
        connection.execute(insert(tables.cells), [cell(position=1)])


@pytest.mark.parametrize(
    "changes",
    [
        {"object_id": 2},
        {"array_id": 2},  # the object stands on array 1
        {"face_id": 1},  # not placed
        {"row": -1},
        {"label": -1},
    ],
)
def test_a_cell_of_nothing_is_refused(filled, changes):
    with pytest.raises(DatabaseError, match="refuses"), write_transaction(filled) as connection:
        connection.execute(insert(tables.cells), [cell(row=6, position=1) | changes])
    with read_transaction(filled) as connection:
        assert len(connection.execute(select(tables.cells)).all()) == 1


def test_links_to_missing_edges_are_refused_at_the_commit(filled):
    edge = {"object_id": 1, "edge_id": 0, "face_id": 0, "right_face_id": 0, "edge_length": 1.0}
    edge |= {"start_vertex_id": 0, "end_vertex_id": 1}
    links = dict.fromkeys(("left_previous_id", "left_next_id", "right_previous_id"), 0)
    with (
        pytest.raises(DatabaseError, match=r"(?i)foreign key"),
        write_transaction(filled) as connection,
    ):
        connection.execute(insert(tables.edges), [edge | links | {"right_next_id": 1}])
    with write_transaction(filled) as connection:
        connection.execute(insert(tables.edges), [edge | links | {"right_next_id": 0}])


def test_an_object_goes_as_a_whole_and_its_parts_do_not_go_alone(filled):
    for table in ("faces", "placements"):
        with (
            pytest.raises(DatabaseError, match=r"(?i)foreign key"),
            write_transaction(filled) as connection,
        ):
            connection.execute(text(f"DELETE FROM {table}"))
    with write_transaction(filled) as connection:
        connection.execute(text("DELETE FROM objects"))
        for table in (tables.vertices, tables.faces, tables.placements, tables.cells):
            assert connection.execute(select(table)).all() == []


def test_numbers_come_back_bit_for_bit(filled):
    with read_transaction(filled) as connection:
        row = connection.execute(select(tables.vertices)).first()
        assert math.copysign(1, row.y_vertex) == -1.0
        assert row.z_vertex == 0.1
        assert connection.execute(select(tables.cells.c.column)).scalar_one() == 2**63 - 2
        assert connection.execute(select(tables.arrays.c.columns)).scalar_one() == 2**63 - 1


def test_reading_imports_nothing_heavy():
    """The object-relational half of SQLAlchemy, the kernel and their like stay out."""
    heavy = "sqlalchemy.orm scipy shapely OCP matplotlib trimesh pymeshlab psycopg"
    script = (
        "import sys, generator.database.open, generator.database.read, generator.database.register;"
        f"print([m for m in {heavy.split()} if m in sys.modules])"
    )
    out = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "[]"


def test_the_same_schema_has_the_same_order_on_every_run(tmp_path):
    open_database(str(tmp_path / "lab.db"))
    with closing(sqlite3.connect(tmp_path / "lab.db")) as connection:
        made = connection.execute(
            "SELECT tbl_name, name FROM sqlite_master WHERE type = 'index' AND sql IS NOT NULL"
        ).fetchall()
    of_edges = [name for table, name in made if table == "edges"]
    assert len(of_edges) == 4
    assert of_edges == sorted(of_edges)
    assert len(made) == sum(len(table.indexes) for table in tables.metadata.tables.values())
