"""Whatever is registered comes back bit for bit, and no cell is ever held twice."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from random_shapes import random_nonconvex

from generator.alphabet.known import ALPHABETS
from generator.alphabet.outline import SymbolStyle
from generator.array.profiles import PROFILES
from generator.database.cells import faces_at, find_array, held_cells, occupied_cells
from generator.database.open import open_database
from generator.database.read import find_object, list_objects, object_names, read_object
from generator.database.register import ObjectRecord, register, remove_object, same_layout
from generator.database.registered import RegisteredPart, canonical
from generator.database.transaction import read_transaction, write_transaction
from generator.errors import DatabaseError
from generator.layout.placement import FaceLayout, Layout, Placement
from generator.polyhedron.shapes import tetrahedron

ARRAY = PROFILES["one-touch"].array()
CELLS = ARRAY.rows * ARRAY.columns
SOLID = tetrahedron(60.0)
FRAMES = [random_nonconvex(np.random.default_rng(seed)) for seed in (4, 8)]  # with holes

engines = st.sampled_from(["sqlite", "sqlite", "sqlite", "postgresql"])  # a server is slow
floats = st.floats(-1e4, 1e4)  # lengths in mm; a database refuses what no model has
angles = st.floats(-1.5, 1.5)
positive = st.floats(min_value=1e-300, max_value=1e4)
pitches = st.floats(min_value=0.03, max_value=1e4)
solids = st.sampled_from([SOLID, *FRAMES])
names = st.text(st.characters(blacklist_categories=["Cs"], blacklist_characters="\0"), min_size=1)
formats = st.sampled_from(["step", "stl"])
values = st.recursive(
    st.none() | st.booleans() | st.integers() | floats | names,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(names, inner, max_size=3),
    max_leaves=10,
)


@st.composite
def layouts(draw):
    cells = np.array(draw(st.lists(st.integers(0, CELLS - 1), unique=True, max_size=60)), np.int64)
    numbers = draw(st.lists(st.integers(0, 3), unique=True, min_size=1, max_size=4))
    cuts = sorted(draw(st.integers(0, len(cells))) for _ in numbers[1:])
    faces = []
    for number, part in zip(numbers, np.split(cells, cuts), strict=True):
        centres = draw(arrays.arrays(np.float64, (len(part), 2), elements=floats))
        row, column = draw(st.integers(0, 2**63 - 1)), draw(st.integers(0, 2**63 - 1))
        placement = Placement(row, column, draw(floats), draw(floats), draw(floats))
        rows, columns = part // ARRAY.columns, part % ARRAY.columns
        labels = ARRAY.symbols(rows, columns)
        places = draw(st.integers(0, 2**40))
        faces.append(FaceLayout(number, placement, rows, columns, labels, centres, places))
    blank = tuple(face.face for face in faces if len(face.rows) == 0)
    return Layout(
        draw(st.sampled_from(["net", "faces"])), draw(pitches), tuple(faces),
        tuple(sorted(blank)), tuple(draw(st.lists(names, max_size=2))),
    )  # fmt: skip


@st.composite
def registrations(draw):
    layout = draw(layouts())
    style = SymbolStyle(layout.pitch_mm, draw(floats), draw(positive), draw(angles), draw(floats))
    matrix = arrays.arrays(np.float64, (4, 4), elements=floats)
    parts = [
        RegisteredPart(name, draw(formats), draw(names), "0" * 64, draw(matrix))
        for name in draw(st.lists(names, unique=True, max_size=3))
    ]
    alphabet = draw(st.sampled_from(sorted(ALPHABETS)))
    return ObjectRecord(
        draw(names), draw(solids), layout, ARRAY, draw(names), ALPHABETS[alphabet], style,
        {"spec": draw(values)}, draw(names), tuple(parts),
    )  # fmt: skip


@settings(deadline=None, max_examples=30)
@given(engine=engines, registration=registrations())
def test_everything_comes_back_bit_for_bit(database_on, engine, registration):
    with database_on(engine) as url:
        opened = open_database(url)
        for _ in range(2):  # the same once more changes nothing
            with write_transaction(opened) as connection:
                register(connection, registration)
        with read_transaction(opened) as connection:
            known = read_object(connection, registration.name)
            for face in registration.layout.faces:
                objects, faces = faces_at(connection, 1, face.rows, face.columns)
                assert (objects == known.entry.object_id).all()
                assert (faces == face.face).all()
            free = sorted({*range(CELLS)} - {*occupied(connection)})[:3]
            assert (np.array(faces_at(connection, 1, *np.divmod(free, ARRAY.columns))) == -1).all()
    solid = registration.polyhedron
    assert known.polyhedron.vertices.tobytes() == solid.vertices.tobytes()
    assert (known.polyhedron.faces, known.polyhedron.edges) == (solid.faces, solid.edges)
    holes = [len(face.polygon_mm) for face in known.faces]
    assert holes == [len(face.loops) for face in solid.faces]
    assert same_layout(known.layout, registration.layout)
    assert repr(known.style) == repr(registration.style)  # repr tells -0.0 from 0.0
    assert canonical(known.spec) == canonical(dict(registration.spec))
    assert known.alphabet == registration.alphabet.definition()
    assert known.entry.profile == registration.profile
    found = [(part.name, part.format, part.file) for part in known.parts]
    assert found == [(part.name, part.format, part.file) for part in registration.parts]
    for part, given_part in zip(known.parts, registration.parts, strict=True):
        assert part.T_object_part.tobytes() == given_part.T_object_part.tobytes()


def occupied(connection):
    rows, columns = occupied_cells(connection, find_array(connection, ARRAY))
    return (rows * ARRAY.columns + columns).tolist()


steps = st.lists(
    st.tuples(
        st.sampled_from(["register", "replace", "remove"]),
        st.sampled_from(["a", "b", "c"]),
        st.integers(0, 30),  # first cell
        st.integers(0, 12),  # number of cells
    ),
    max_size=12,
)


def small(name, first, count):
    cells = np.arange(first, first + count)
    face = FaceLayout(
        0, Placement(0, first, 0.0, 0.0, 0.0), cells // 65, cells % 65,
        ARRAY.symbols(cells // 65, cells % 65), np.zeros((count, 2)), 0,
    )  # fmt: skip
    return ObjectRecord(
        name, SOLID, Layout("faces", 7.0, (face,)), ARRAY, "one-touch", ALPHABETS["dense-4"],
        SymbolStyle(), {"first": first, "count": count}, "0",
    )  # fmt: skip


@settings(deadline=None, max_examples=25)
@given(engine=engines, steps=steps)
def test_objects_never_share_a_cell(database_on, engine, steps):
    with database_on(engine) as url:
        shares_no_cell(open_database(url), steps)


def shares_no_cell(engine, steps):
    """Any run of registrations, replacements and removals against a dictionary of sets."""
    held: dict[str, range] = {}
    spec: dict[str, tuple[int, int]] = {}
    for step, name, first, count in steps:
        asked = range(first, first + count)  # equal to any other where it is empty
        others = {c for other, cells in held.items() if other != name for c in cells}
        try:
            with write_transaction(engine) as connection:
                if step == "remove":
                    entry = find_object(connection, name)
                    if entry is not None:
                        remove_object(connection, entry.object_id)
                else:
                    replace = step == "replace"
                    register(connection, small(name, first, count), replace=replace)
        except DatabaseError:
            changed = step == "register" and spec.get(name) not in (None, (first, count))
            assert changed or others & set(asked)
        else:
            assert step == "remove" or not others & set(asked)
            if step == "remove":
                held.pop(name, None)
                spec.pop(name, None)
            else:
                held[name], spec[name] = asked, (first, count)
        with read_transaction(engine) as connection:
            assert [e.name for e in list_objects(connection)] == sorted(held)
            assert object_names(connection) == tuple(sorted(held))
            cells = occupied(connection)
            assert cells == sorted(c for cells in held.values() for c in cells)
            assert held_cells(connection, 1)[:, :2].tolist() == [
                [cell // 65, cell % 65] for cell in cells
            ]  # the bits say what the cells say
