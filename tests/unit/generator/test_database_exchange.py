"""Objects between labs: the same there or refused by name, never shared; damage, everywhere."""

import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from generator.alphabet.known import alphabet_named
from generator.alphabet.outline import SymbolStyle
from generator.array.profiles import PROFILES
from generator.cad import encode
from generator.command import run
from generator.database.cells import find_array, held_cells, occupied_cells
from generator.database.exchange import export_objects, import_objects
from generator.database.lab import lab_key
from generator.database.open import database_exists, open_database
from generator.database.read import list_objects, read_object
from generator.database.register import ObjectRecord, register, remove, restore, retire
from generator.database.registered import RegisteredPart
from generator.database.transaction import read_transaction, write_transaction
from generator.errors import DatabaseError, LabKeyError
from generator.layout.layout import lay_out
from generator.polyhedron.shapes import cube, tetrahedron

FIRST = Path(__file__).parents[3] / "fixtures" / "database" / "v1.db"
SOLIDS = {"Cube": cube(30.0), "Tetra": tetrahedron(40.0), "Other": tetrahedron(50.0)}


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
        for number in {entry.array_id for entry in list_objects(connection)}:
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


def test_files_of_parts_are_named_from_the_database(tmp_path):
    for name in "ab":
        (tmp_path / name).mkdir()
    here, there, lab = (str(tmp_path / name) for name in ("a/lab.db", "b/exchange.db", "lab.db"))
    make(here, "Cube")
    export_objects(here, Path(there))
    import_objects(lab, there)
    export_objects(here, tmp_path / "above.db")
    found = [held(url, "Cube").parts[0].file for url in (there, lab, str(tmp_path / "above.db"))]
    assert found == ["out/F1.stl", "b/out/F1.stl", "a/out/F1.stl"]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("update objects set name = '../../evil'", "may not be called so"),
        ("update objects set name = char(27) || '[2J'", "may not be called so"),
        ("update objects set name = hex(randomblob(40))", "60 are allowed"),
        ("update parts set file = '/etc/passwd'", "lies elsewhere or is none: '/etc/passwd'"),
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
    assert (done.copied, [refused.name for refused in done.refused]) == (("Tetra",), ["Cube"])
    with write_transaction(open_database(lab_url)) as connection:
        remove(connection, "Other")
    done = import_objects(lab_url, str(file), names=["Cube"], renamed={"Cube": "Theirs"})
    assert done.copied == ("Theirs",)
    assert names(lab_url) == ["Tetra", "Theirs"]
    sound(lab_url)


def test_nothing_is_made_where_no_object_has_the_name(exported, tmp_path):
    with pytest.raises(DatabaseError, match="no object is called 'Ball'"):
        export_objects(str(exported), tmp_path / "out.db", names=["Ball"])
    with pytest.raises(DatabaseError, match="no object is called 'Ball'"):
        import_objects(str(tmp_path / "lab.db"), str(exported), names=["Ball"])
    assert list(tmp_path.iterdir()) == []


def test_a_failed_export_leaves_what_is_there(exported, file):
    file.write_text("notes")
    with pytest.raises(DatabaseError, match="there already"):
        export_objects(str(exported), file)
    assert file.read_text() == "notes"
    export_objects(str(exported), file, force=True)
    with pytest.raises(DatabaseError, match="into itself"):
        export_objects(str(file), file, force=True)
    assert names(str(file)) == ["Cube"]
    assert [path.name for path in file.parent.iterdir()] == ["exchange.db"]


def test_an_object_that_is_here_by_another_name_is_known(lab_url, exported):
    import_objects(lab_url, str(exported), renamed={"Cube": "Theirs"})
    make(lab_url, "Other", profile="large", solid=cube(60.0))
    again = ({}, {"Cube": "Third"}, {"Cube": "Theirs"}, {"Cube": "Other"})
    for renamed in again:
        done = import_objects(lab_url, str(exported), renamed=renamed)
        assert (done.copied, done.known, done.refused) == ((), ("Theirs",), ())
    assert names(lab_url) == ["Other", "Theirs"]


def test_a_lab_moves_with_its_key(lab_url, exported):
    key = "0123-4567-89AB-CDER"
    import_objects(lab_url, str(exported), lab_key=key.lower())
    with read_transaction(open_database(lab_url, writable=False)) as connection:
        assert lab_key(connection) == key
    assert import_objects(lab_url, str(exported), lab_key=key).known == ("Cube",)
    for wrong in ("0123-4567-89AB-CDEF", "5AFR-9W3K-2Z3R-HV0H"):
        with pytest.raises(LabKeyError):
            import_objects(lab_url, str(exported), lab_key=wrong)


def test_a_rehearsed_import_changes_nothing(lab_url, exported):
    make(lab_url, "Other", profile="large", solid=cube(60.0))
    assert import_objects(lab_url, str(exported), dry_run=True).copied == ("Cube",)
    assert names(lab_url) == ["Other"]


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
    with write_transaction(open_database(lab_url)) as connection:
        entry = retire(connection, "Cube")
        assert retire(connection, "Cube").retired_utc == entry.retired_utc != ""
    with pytest.raises(DatabaseError, match="'Cube' was retired") as caught:
        make(lab_url, "Cube")
    assert "--undo" in caught.value.fix
    make(lab_url, "Tetra")
    sound(lab_url)
    with write_transaction(open_database(lab_url)) as connection:
        assert restore(connection, "Cube").retired_utc == ""


@pytest.fixture(scope="module")
def cube_lab(tmp_path_factory):
    """Return a database that holds a cube."""
    path = tmp_path_factory.mktemp("lab") / "lab.db"
    text = "name: Cube\nshape: {cube: 40 mm}\n"
    encode(text, database=str(path), folder=path.parent, formats=())
    return path


DAMAGED = {
    "a definition that is no JSON": "UPDATE arrays SET definition = '{'",
    "a definition nested too deep": f"UPDATE arrays SET definition = '{'[' * 5000}'",
    "a definition of another type": "UPDATE arrays SET definition = '[]'",
    "an array that is gone": "DELETE FROM arrays",
    "an alphabet that is none": "UPDATE alphabets SET definition = 'null'",
    "a spec that is no JSON": "UPDATE provenance SET spec = ''",
    "a text where a number was": "UPDATE cells SET x_mm = 'x'",
    "bytes that are no text": "UPDATE objects SET name = CAST(x'ff' AS TEXT)",
    "a schema that is no text": "UPDATE sqlite_master SET sql = CAST(x'ff' AS TEXT), "
    "name = CAST(x'ff' AS TEXT) WHERE name = 'faces'",
    "a table that is gone": "DROP TABLE faces",
    "a view": "CREATE VIEW v AS WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT 1 FROM c) "
    "SELECT * FROM c",
    "a trigger": "CREATE TRIGGER t AFTER INSERT ON objects BEGIN DELETE FROM objects; END",
}


@pytest.mark.parametrize("damage", DAMAGED)
def test_a_damaged_database_says_so_at_every_command(damage, cube_lab, tmp_path, capsys):
    path = tmp_path / "lab.db"
    shutil.copy(cube_lab, path)
    with closing(sqlite3.connect(path)) as plain, plain:
        plain.execute("PRAGMA foreign_keys = OFF")
        plain.execute("PRAGMA writable_schema = ON")
        plain.execute(DAMAGED[damage])
    (tmp_path / "box.yaml").write_text("name: Box\nshape: {cube: 30 mm}\n")
    box = [str(tmp_path / "box.yaml"), "--dry-run", "-o", str(tmp_path / "out")]
    codes = set()
    commands = (["list"], ["show", "Cube"], ["lab"], ["export", str(tmp_path / "o.db")], box)
    for command in (*commands, ["import", str(path)]):
        lab = tmp_path / "new.db" if "import" in command else path
        code = run([*command, "--database", str(lab)])
        said = capsys.readouterr().err
        codes.add(code)
        assert code in (0, 4), said
        assert code == 0 or (f"{tmp_path}/" in said and "fix: " in said), said
        assert not list(tmp_path.glob(".*"))
    assert 4 in codes
