"""Registering and reading back."""

import dataclasses
import math

import numpy as np
import pytest

from generator.alphabet.known import alphabet_named
from generator.alphabet.outline import SymbolStyle
from generator.array.definition import array_from
from generator.array.profiles import PROFILES
from generator.database.cells import faces_at, find_array, occupied_cells
from generator.database.open import open_database
from generator.database.read import find_object, read_layout, read_object
from generator.database.register import ObjectRecord, register, same_layout
from generator.database.registered import RegisteredPart, canonical, spec_hash
from generator.database.rows import face_type
from generator.database.transaction import read_transaction, write_transaction
from generator.errors import DatabaseError
from generator.layout.placement import FaceLayout, Layout, Placement
from generator.polyhedron.shapes import cube
from generator.polyhedron.winged import polyhedron

ARRAY = PROFILES["one-touch"].array()


def layout_from(first, faces=6, symbols=64):
    """Consecutive cells from number `first`; centres that a decimal fraction cannot say."""
    made = []
    for face in range(faces):
        cells = first + face * symbols + np.arange(symbols)
        rows, columns = cells // ARRAY.columns, cells % ARRAY.columns
        made.append(
            FaceLayout(
                face=face,
                placement=Placement(
                    int(rows[0]), int(columns[0]), math.pi / (face + 1), -0.0, 1 / 3
                ),
                rows=rows,
                columns=columns,
                labels=ARRAY.symbols(rows, columns),
                centres_mm=np.stack([rows / 7, -columns * 0.0], axis=1),
                places=symbols - 3,
            )
        )
    return Layout("faces", 7.0, tuple(made))


def cube_on(first, name="Cube", **changes):
    registration = ObjectRecord(
        name=name,
        polyhedron=cube(60.0),
        layout=layout_from(first),
        array=ARRAY,
        profile="one-touch",
        alphabet=alphabet_named("dense-4"),
        style=SymbolStyle(),
        spec={"name": name, "shape": {"cube": 60.0}, "first": first},
        tool_version="0.1.0",
        parts=(RegisteredPart("F1", "stl", "cube/F1.stl", "ab" * 32, np.eye(4) / 3),),
    )
    return dataclasses.replace(registration, **changes)


def register_one(engine, registration, **options):
    with write_transaction(engine) as connection:
        return register(connection, registration, **options)


def held(engine):
    with read_transaction(engine) as connection:
        rows, columns = occupied_cells(connection, find_array(connection, ARRAY))
        return sorted((rows * ARRAY.columns + columns).tolist())


@pytest.fixture
def engine(lab_url):
    return open_database(lab_url)


def test_an_object_with_holes_and_a_layout_in_its_own_order(engine):
    """A square frame: faces with holes, genus 1; faces of the layout last to first."""
    corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    points = [(40 * s * x, 40 * s * y, z) for z in (0, 20) for s in (1, 0.5) for x, y in corners]
    ring = [0, 1, 2, 3]
    faces = [((3, 2, 1, 0), (4, 5, 6, 7)), ((8, 9, 10, 11), (15, 14, 13, 12))]
    faces += [((a, b, b + 8, a + 8),) for a, b in zip(ring, [1, 2, 3, 0], strict=True)]
    faces += [((b + 4, a + 4, a + 12, b + 12),) for a, b in zip(ring, [1, 2, 3, 0], strict=True)]
    frame = polyhedron("polyhedron", points, faces)
    layout = layout_from(0, faces=10, symbols=8)
    layout = dataclasses.replace(layout, faces=layout.faces[::-1])
    register_one(engine, cube_on(0, "Frame", polyhedron=frame, layout=layout))
    with read_transaction(engine) as connection:
        known = read_object(connection, "Frame")
    assert known.polyhedron.vertices.tobytes() == frame.vertices.tobytes()
    assert (known.polyhedron.faces, known.polyhedron.edges) == (frame.faces, frame.edges)
    assert known.polyhedron.genus == 1
    assert same_layout(known.layout, layout)
    assert [len(face.polygon_mm) for face in known.faces] == [2, 2] + 8 * [1]
    assert known.faces[0].face_type == "polygon"
    assert known.faces[0].area_mm2 == pytest.approx(80**2 - 40**2)


def test_the_same_spec_again_changes_nothing_but_its_parts(engine):
    first = register_one(engine, cube_on(100))
    with read_transaction(engine) as connection:
        utc = find_object(connection, "Cube").utc
        stored = read_layout(connection, "Cube")
    parts = (
        RegisteredPart("F1", "stl", "elsewhere/F1.stl", "cd" * 32, np.eye(4)),
        RegisteredPart("F1", "step", "elsewhere/F1.step", "ef" * 32, np.eye(4)),
    )
    assert register_one(engine, cube_on(100, layout=stored, parts=parts)) == first
    with read_transaction(engine) as connection:
        known = read_object(connection, "Cube")
    assert known.entry.utc == utc
    assert [(part.format, part.file) for part in known.parts] == [
        ("stl", "elsewhere/F1.stl"),
        ("step", "elsewhere/F1.step"),
    ]


def test_other_cells_are_refused_and_replaced_on_request(engine):
    number = register_one(engine, cube_on(0))
    with pytest.raises(DatabaseError, match="on other cells"):
        register_one(engine, cube_on(0, layout=layout_from(1)))
    assert register_one(engine, cube_on(200), replace=True) == number
    assert held(engine) == list(range(200, 584))


def test_an_error_of_the_caller_undoes_everything(engine):
    def interrupted():
        with write_transaction(engine) as connection:
            register(connection, cube_on(0))
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert held(engine) == []


def test_cells_name_object_and_face(engine):
    register_one(engine, cube_on(0))
    register_one(engine, cube_on(1000, "Other"))
    cells = np.array([0, 63, 64, 383, 384, 999, 1000, 1383, 0])
    with read_transaction(engine) as connection:
        array_id = find_array(connection, ARRAY)
        objects, faces = faces_at(connection, array_id, cells // 65, cells % 65)
        everything = faces_at(
            connection, array_id, np.arange(63)[:, None].repeat(65), np.tile(np.arange(65), 63)
        )
    assert objects.tolist() == [1, 1, 1, 1, -1, -1, 2, 2, 1]
    assert faces.tolist() == [0, 0, 1, 5, -1, -1, 0, 5, 0]
    assert [(everything[0] == number).sum() for number in (1, 2)] == [384, 384]


def test_objects_with_other_windows_stand_on_the_same_cells(engine):
    """A window changes no symbol, so it must not open the array a second time."""
    definition = ARRAY.definition()
    other = array_from(definition | {"window": [4, 3]})
    assert other.definition() != definition
    register_one(engine, cube_on(0))
    with pytest.raises(DatabaseError, match="another object holds"):
        register_one(engine, cube_on(0, "Other", array=other))


def test_impossible_registrations_are_refused_before_anything_is_written(engine):
    with pytest.raises(ValueError, match="beyond the array"):
        register_one(engine, cube_on(63 * 65 - 300))
    nowhere = layout_from(0)
    nowhere.faces[2].centres_mm[5, 1] = math.nan
    with pytest.raises(ValueError, match="no place"):
        register_one(engine, cube_on(0, layout=nowhere))
    with pytest.raises(ValueError, match="mm"):
        register_one(engine, cube_on(0, style=SymbolStyle(pitch_mm=6.0)))
    assert held(engine) == []


def test_canonical_text_is_one_for_equal_values():
    assert canonical({"b": 0.1, "a": [1, None, "µ"]}) == '{"a":[1,null,"µ"],"b":0.1}'
    assert spec_hash({"b": 1, "a": 2}) == spec_hash({"a": 2, "b": 1}) != spec_hash({"a": 2, "b": 2})
    with pytest.raises(ValueError, match="JSON"):
        canonical(math.nan)


@pytest.mark.parametrize(
    ("corners", "kind"),
    [
        ([(0, 0), (2, 0), (1, 1)], "triangle"),
        ([(0, 0), (2, 0), (2, 2), (0, 2)], "square"),
        ([(0, 0), (3, 0), (3, 2), (0, 2)], "rectangle"),
        ([(0, 0), (2, 0), (3, 1), (1, 1)], "quadrilateral"),
        ([(0, 0), (2, 1), (4, 0), (2, 3)], "quadrilateral"),
        ([(0, 0), (2, 0), (3, 1), (1, 3), (0, 1)], "polygon"),
    ],
)
def test_face_types(corners, kind):
    assert face_type([np.array(corners, dtype=float)]) == kind
    turn = np.array([[0.6, -0.8], [0.8, 0.6]]) * 1e3
    assert face_type([np.array(corners) @ turn]) == kind
