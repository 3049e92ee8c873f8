"""Objects between labs: the same on the other side or refused by name, and never shared."""

import json
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from generator.alphabet.known import alphabet_named
from generator.alphabet.outline import SymbolStyle
from generator.array.profiles import PROFILES
from generator.database.cells import find_array, held_cells, occupied_cells
from generator.database.exchange import export_objects, import_objects
from generator.database.open import database_exists, open_database
from generator.database.read import find_object, list_objects, read_object
from generator.database.register import ObjectRecord, register, remove, restore, retire, same_layout
from generator.database.registered import RegisteredPart
from generator.database.transaction import read_transaction, write_transaction
from generator.errors import DatabaseError
from generator.layout.layout import lay_out
from generator.polyhedron.shapes import cube, tetrahedron

FIRST = Path(__file__).parents[3] / "fixtures" / "database" / "v1.db"
SOLIDS = {"Cube": cube(30.0), "Tetra": tetrahedron(40.0), "Other": tetrahedron(50.0)}
ENGINES = ("sqlite", "postgresql")


def make(url, name, *, profile="one-touch", solid=None, **spec):
    """Place and register an object as a command would."""
    solid = solid or SOLIDS[name]
    ready = PROFILES[profile]
    array, style = ready.array(), SymbolStyle(pitch_mm=ready.pitch_mm)
    clearances = [[np.full(len(loop), 1.0) for loop in face.loops] for face in solid.faces]
    part = RegisteredPart("F1", "stl", "out/F1.stl", "ab" * 32, np.eye(4) / 3)
    with write_transaction(open_database(url)) as connection:
        taken = occupied_cells(connection, find_array(connection, array))
        layout = lay_out(solid, array, style.pitch_mm, 2.0, clearances, taken, "faces",
                         allow_blank_faces=True)  # fmt: skip
        register(connection, ObjectRecord(
            name, solid, layout, array, profile, alphabet_named(ready.alphabet), style,
            {"name": name, **spec}, "0.1", (part,),
        ))  # fmt: skip


def names(url):
    with read_transaction(open_database(url, writable=False)) as connection:
        return [entry.name for entry in list_objects(connection)]


def held(url, name):
    with read_transaction(open_database(url, writable=False)) as connection:
        return read_object(connection, name)


def sound(url):
    """Check that the bits of taken cells are those of the cells, and none is held twice."""
    with read_transaction(open_database(url, writable=False)) as connection:
        numbers = {entry.array_id for entry in list_objects(connection)}
        for number in numbers:
            cells = held_cells(connection, number)[:, :2]
            assert np.array_equal(np.stack(occupied_cells(connection, number), axis=1), cells)
            assert len(np.unique(cells, axis=0)) == len(cells)


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    """A file with a cube of another lab."""
    folder = tmp_path_factory.mktemp("exported")
    make(str(folder / "lab.db"), "Cube")
    export_objects(str(folder / "lab.db"), folder / "cube.db")
    return folder / "cube.db"


@pytest.fixture
def file(tmp_path):
    return tmp_path / "exchange.db"


@pytest.mark.parametrize(("ours", "theirs"), [ENGINES, ENGINES[::-1]])
def test_objects_come_over_as_they_are(new_database, file, ours, theirs):
    here, there = new_database(ours), new_database(theirs)
    make(here, "Cube")
    make(here, "Tetra", profile="thesis", solid=tetrahedron(150.0))
    make(there, "Other", solid=cube(60.0), profile="large")
    with write_transaction(open_database(here)) as connection:
        retire(connection, "Tetra")
    assert export_objects(here, file).copied == ("Cube", "Tetra")
    done = import_objects(there, str(file))
    assert (done.copied, done.known, done.refused) == (("Cube", "Tetra"), (), ())
    assert names(there) == ["Cube", "Other", "Tetra"]
    alike = ("utc", "tool_version", "spec_hash", "retired_utc")
    for name in ("Cube", "Tetra"):
        one, other = held(here, name), held(there, name)
        assert same_layout(one.layout, other.layout)
        for what in ("faces", "edges"):
            assert getattr(one.polyhedron, what) == getattr(other.polyhedron, what)
        assert one.polyhedron.vertices.tobytes() == other.polyhedron.vertices.tobytes()
        assert (one.style, one.alphabet, one.spec) == (other.style, other.alphabet, other.spec)
        assert one.array.definition == other.array.definition
        assert all(getattr(one.entry, what) == getattr(other.entry, what) for what in alike)
        assert (one.entry.imported_from, other.entry.imported_from) == ("", "exchange.db")
        assert other.entry.imported_utc
        assert one.parts[0].T_object_part.tobytes() == other.parts[0].T_object_part.tobytes()
    sound(there)
    again = import_objects(there, str(file))
    assert (again.copied, again.known, again.refused) == ((), ("Cube", "Tetra"), ())
    make(there, "New", solid=cube(30.0))  # where the imported objects end
    sound(there)
    assert export_objects(there, file, force=True).copied == ("Cube", "New", "Other", "Tetra")
    back = import_objects(here, str(file))
    assert (back.copied, back.known) == (("New", "Other"), ("Cube", "Tetra"))
    sound(here)


def test_files_of_parts_go_along_with_an_export_and_are_named_from_there(tmp_path):
    here, there = tmp_path / "a", tmp_path / "b"
    here.mkdir()
    there.mkdir()
    make(str(here / "lab.db"), "Cube")
    export_objects(str(here / "lab.db"), there / "exchange.db")
    import_objects(str(tmp_path / "lab.db"), str(there / "exchange.db"))
    assert held(str(there / "exchange.db"), "Cube").parts[0].file == "out/F1.stl"
    assert held(str(tmp_path / "lab.db"), "Cube").parts[0].file == "b/out/F1.stl"
    export_objects(str(here / "lab.db"), tmp_path / "above.db")
    assert held(str(tmp_path / "above.db"), "Cube").parts[0].file == "a/out/F1.stl"


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("update objects set name = '../../evil'", "may not be called so"),
        ("update objects set name = 'a/b'", "may not be called so"),
        ("update objects set name = char(27) || '[2J'", "may not be called so"),
        ("update objects set name = hex(randomblob(40))", "60 are allowed"),
        ("update parts set file = '/etc/passwd'", "lies elsewhere or is none: '/etc/passwd'"),
        ("update parts set file = '/tmp/F1.stl'", "lies elsewhere"),
        ("update parts set file = 'out/../../F1.stl'", "lies elsewhere"),
        ("update parts set file = 'lab.db'", "lies elsewhere or is none: 'lab.db'"),
        ("update parts set file = 'out/F1.step'", "lies elsewhere or is none"),
        ("update parts set format = 'db', file = 'lab.db'", "lies elsewhere or is none"),
        ("update parts set name = char(10)", "lies elsewhere or is none"),
        ("update faces set name = char(27) || '[2J' where name = 'F1'", "cannot be shown"),
    ],
)
def test_names_of_an_export_are_those_that_a_spec_may_give(exported, tmp_path, file, change, said):
    shutil.copy(exported, file)
    with closing(sqlite3.connect(file)) as plain:
        plain.execute(change)
        plain.commit()
    with pytest.raises(DatabaseError) as caught:
        import_objects(str(tmp_path / "lab.db"), str(file))
    assert said in str(caught.value)
    assert str(caught.value).replace("\n", "").isprintable()
    assert not (tmp_path / "lab.db").exists()


def test_an_object_of_a_bad_name_comes_over_under_another(exported, tmp_path, file):
    shutil.copy(exported, file)
    with closing(sqlite3.connect(file)) as plain:
        plain.execute("update objects set name = '../Cube'")
        plain.commit()
    lab = str(tmp_path / "lab.db")
    assert import_objects(lab, str(file), renamed={"../Cube": "Cube"}).copied == ("Cube",)


def test_an_object_on_cells_that_are_held_is_refused_by_name(new_database, lab_url, file):
    theirs = new_database("sqlite")
    make(theirs, "Cube")
    make(theirs, "Tetra", profile="thesis", solid=tetrahedron(150.0))
    export_objects(theirs, file)
    make(lab_url, "Other")
    with pytest.raises(DatabaseError, match="nothing was imported: 'Cube' needs") as caught:
        import_objects(lab_url, str(file))
    assert "Tetra" not in str(caught.value)
    assert names(lab_url) == ["Other"]
    done = import_objects(lab_url, str(file), skip_refused=True)
    assert done.copied == ("Tetra",)
    assert [refused.name for refused in done.refused] == ["Cube"]
    assert names(lab_url) == ["Other", "Tetra"]
    sound(lab_url)
    with write_transaction(open_database(lab_url)) as connection:
        remove(connection, "Other")
    assert import_objects(lab_url, str(file), names=["Cube"]).copied == ("Cube",)
    sound(lab_url)


def test_a_name_that_is_held_can_be_changed(lab_url, exported):
    make(lab_url, "Cube", solid=cube(40.0), profile="large")
    with pytest.raises(DatabaseError, match="'Cube' is the name of another object") as caught:
        import_objects(lab_url, str(exported))
    assert "--rename 'Cube=NEW'" in caught.value.fix
    for outcome in ("copied", "known"):
        done = import_objects(lab_url, str(exported), renamed={"Cube": "Their cube"})
        assert getattr(done, outcome) == ("Their cube",)
    assert names(lab_url) == ["Cube", "Their cube"]
    sound(lab_url)


def test_only_named_objects_go_out_and_come_in(new_database, file):
    here, there = new_database("sqlite"), new_database("sqlite")
    make(here, "Cube")
    make(here, "Tetra")
    with pytest.raises(DatabaseError, match="no object is called 'Ball'"):
        export_objects(here, file, names=["Ball"])
    assert not file.exists()
    export_objects(here, file, names=["Tetra"])
    with pytest.raises(DatabaseError, match="no object is called 'Cube'"):
        import_objects(there, str(file), names=["Cube"])
    assert not database_exists(there)
    assert import_objects(there, str(file), names=["Tetra"]).copied == ("Tetra",)


def test_a_failed_export_leaves_what_is_there(exported, file):
    file.write_text("notes")
    with pytest.raises(DatabaseError, match="there already"):
        export_objects(str(exported), file)
    assert file.read_text() == "notes"
    export_objects(str(exported), file, force=True)
    for itself in (lambda: export_objects(str(file), file, force=True),
                   lambda: import_objects(str(file), str(file))):  # fmt: skip
        with pytest.raises(DatabaseError, match="into itself"):
            itself()
    assert names(str(file)) == ["Cube"]
    assert [path.name for path in file.parent.iterdir()] == ["exchange.db"]


def test_a_rehearsed_import_changes_nothing(lab_url, exported):
    make(lab_url, "Other", profile="large", solid=cube(60.0))
    assert import_objects(lab_url, str(exported), dry_run=True).copied == ("Cube",)
    assert names(lab_url) == ["Other"]
    with read_transaction(open_database(lab_url)) as connection:
        assert len(occupied_cells(connection, 2)[0]) == 0


DAMAGE = {
    "a symbol": ("UPDATE cells SET label = (label + 1) % 4 WHERE position = 3", "has symbol"),
    "a cell": ('UPDATE cells SET "row" = "row" + 63 WHERE position = 3', "beyond its array"),
    "the array": (
        "UPDATE arrays SET definition = replace(definition, '63', '65')", "array",
    ),
    "its digest": ("UPDATE arrays SET definition_sha256 = 'x'", "definition was changed"),
    "its size": ('UPDATE arrays SET "rows" = 9', "definition was changed"),
    "the array's text": ("UPDATE arrays SET definition = '{}'", "cannot be made"),
    "the alphabet": ("UPDATE alphabets SET definition = '{}'", "alphabet"),
    "a foreign key": ("UPDATE faces_to_vertices SET vertex_id = 99 WHERE vertex_id = 1", "lost"),
}  # fmt: skip


@pytest.mark.parametrize("what", DAMAGE)
def test_a_damaged_file_brings_nothing_in(exported, file, what):
    statement, said = DAMAGE[what]
    shutil.copy(exported, file)
    with sqlite3.connect(file) as connection:
        connection.execute(statement)
    connection.close()
    there = str(file.with_name("lab.db"))
    with pytest.raises(DatabaseError, match=said) as caught:
        import_objects(there, str(file))
    assert "export it once more" in caught.value.fix
    assert not database_exists(there)


def test_a_file_of_the_first_version_is_imported_and_not_changed(lab_url, tmp_path, caplog):
    file = tmp_path / "old.db"
    shutil.copy(FIRST, file)
    file.chmod(0o444)
    make(lab_url, "Other", profile="large", solid=cube(60.0))
    done = import_objects(lab_url, str(file))
    assert done.copied == ("Cube", "Prism", "Small box-1", "Small box-2")
    assert file.read_bytes() == FIRST.read_bytes()
    assert [path.name for path in tmp_path.iterdir()] == ["old.db"]
    assert caplog.records == []
    sound(lab_url)


def test_retired_objects_keep_their_cells_and_are_not_made_again(lab_url):
    make(lab_url, "Cube")
    engine = open_database(lab_url)
    with write_transaction(engine) as connection:
        entry = retire(connection, "Cube")
        assert retire(connection, "Cube").retired_utc == entry.retired_utc != ""
    with pytest.raises(DatabaseError, match="'Cube' was retired") as caught:
        make(lab_url, "Cube")
    assert "--undo" in caught.value.fix
    before = held(lab_url, "Cube")
    make(lab_url, "Tetra")
    with write_transaction(engine) as connection:
        assert restore(connection, "Cube").retired_utc == ""
    after = held(lab_url, "Cube")
    assert same_layout(before.layout, after.layout)
    assert json.dumps(before.spec) == json.dumps(after.spec)
    with write_transaction(engine) as connection:
        assert remove(connection, "Cube").symbols == before.entry.symbols
        assert find_object(connection, "Cube") is None
    sound(lab_url)
