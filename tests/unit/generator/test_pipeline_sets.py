"""Sets: in parallel, resumable, with plates, overview and packing list."""

from __future__ import annotations

import hashlib
import pickle
import shutil
from dataclasses import replace

import pytest

from encoded_objects.base.document import Problem
from generator.database.open import open_database
from generator.database.read import read_layout
from generator.database.transaction import read_transaction
from generator.errors import DatabaseError, WriteError
from generator.pipeline import encode
from generator.pipeline.files import parts_of
from generator.pipeline.make import MakeJob, make_at, make_under_lock
from generator.pipeline.parallel import Task, Workers
from generator.pipeline.place import place_object
from generator.pipeline.plan import plan_object
from generator.pipeline.progress import no_progress
from generator.spec import SpecError, read_specs

SET = """\
output: {formats: [stl]}
objects:
  - {name: A, shape: {cube: 30 mm}}
  - {name: B, shape: {box: [30, 35, 30]}}
  - {name: C, shape: {tetrahedron: 55 mm}, print: {printer: fdm-0.25}}
"""


def specs(folder, text=SET):
    file = folder / "lab-set.yaml"
    file.write_text(text)
    return read_specs([file])


def run(folder, text=SET, **options):
    url = f"sqlite:///{folder / 'lab.db'}"
    return encode(specs(folder, text), folder=folder / "out", database=url, **options)


def digests(folder):
    files = (path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder): hashlib.sha256(path.read_bytes()).digest() for path in files}


@pytest.fixture(scope="module")
def once(tmp_path_factory):
    """A set that was made here, with its database."""
    folder = tmp_path_factory.mktemp("set")
    return folder, run(folder, jobs=1, formats=("stl", "3mf"))


@pytest.fixture
def there(once, tmp_path):
    """A copy of it."""
    shutil.copytree(once[0], tmp_path, dirs_exist_ok=True)
    return tmp_path


def test_processes_make_the_same_files_on_the_same_cells(once, tmp_path):
    one = once[1]
    two = run(tmp_path, jobs=2, formats=("stl", "3mf"))
    assert digests(once[0] / "out") == digests(tmp_path / "out")
    assert one.used_cells == two.used_cells == sum(made.symbols for made in one.objects)
    assert [made.name for made in two.objects] == ["A", "B", "C"]


def test_the_next_run_makes_only_what_is_missing_or_changed(there):
    before = digests(there / "out")
    (there / "out" / "A" / "A-array.svg").unlink()
    (there / "out" / "B" / "B-F2.stl").write_bytes(b"damaged")
    (there / "out" / "lab-set-overview.pdf").unlink()
    said = []
    again = run(there, jobs=1, formats=("stl", "3mf"), progress=lambda what, _: said.append(what))
    assert [made.skipped for made in again.objects] == [False, False, True]
    assert all(made.reused for made in again.objects)
    assert "C is there, with all its files: skipped" in said
    assert digests(there / "out") == before
    proven = run(there, jobs=1, formats=("stl", "3mf"), verify=True)
    assert [made.skipped for made in proven.objects] == [False] * 3
    assert digests(there / "out") == before


def test_a_changed_spec_in_a_set_is_refused_and_the_rest_stays(there):
    before = digests(there / "out")
    changed = SET.replace("cube: 30 mm", "cube: 35 mm")
    with pytest.raises(DatabaseError, match="another spec"):
        run(there, changed, jobs=1)
    assert digests(there / "out") == before
    replaced = run(there, changed, jobs=1, replace=True)
    assert [made.reused for made in replaced.objects] == [False, True, True]


def cells_held(engine):
    """Every cell of A and B, as the database has them."""
    with read_transaction(engine) as connection:
        return [
            cell
            for name in "AB"
            for face in read_layout(connection, name).faces
            for cell in zip(face.rows.tolist(), face.columns.tolist(), strict=True)
        ]


def two_jobs(folder):
    """Return an empty database, and what makes A and B."""
    jobs = [MakeJob(plan_object(one), folder / one.name, ()) for one in specs(folder)[:2]]
    return open_database(f"sqlite:///{folder / 'lab.db'}"), jobs


def test_an_object_whose_cells_another_writer_took_is_placed_again(tmp_path):
    engine, jobs = two_jobs(tmp_path)
    with read_transaction(engine) as connection:
        chosen = [place_object(connection, job.plan, replace=False) for job in jobs]
    first = make_at(engine, jobs[0], chosen[0])
    second = make_at(engine, jobs[1], chosen[1])  # both chose the same corner
    assert first.layout is chosen[0].layout
    assert second.layout is not chosen[1].layout
    cells = cells_held(engine)
    assert len(set(cells)) == len(cells) == first.symbols + second.symbols
    again = make_at(engine, jobs[0], chosen[0])  # another writer made it meanwhile
    assert (again.reused, again.symbols) == (True, first.symbols)


def test_a_dry_build_counts_while_the_array_is_empty(tmp_path):
    engine, jobs = two_jobs(tmp_path)
    dry = []
    for job in jobs:
        placed = place_object(None, job.plan, replace=False)
        dry.append(replace(placed, built=parts_of(job.plan, placed.layout)))
    first = make_under_lock(engine, jobs[0], dry_build=dry[0])
    second = make_under_lock(engine, jobs[1], dry_build=dry[1])
    again = make_under_lock(engine, jobs[0], dry_build=dry[0])
    assert first.layout is dry[0].layout
    assert second.layout is not dry[1].layout  # the first one's cells were free then
    assert again.layout is not dry[0].layout  # registered: its own cells
    assert again.reused
    cells = cells_held(engine)
    assert len(set(cells)) == len(cells) == first.symbols + second.symbols


def test_errors_come_back_from_other_processes():
    tasks = [Task(str(k), int, (text,)) for k, text in enumerate(["1", "x", "3", "y"])]
    with Workers(2) as workers, pytest.raises(ValueError, match="'x'"):
        workers.done(tasks, no_progress)
    error = SpecError([Problem("a cause", "a fix", file="c.yaml")])
    assert str(pickle.loads(pickle.dumps(error))) == str(error)


@pytest.mark.parametrize(
    "second",
    ["{name: B, shape: {box: [60, 60, 5]}}", "{name: B, shape: {cube: 60}, copies: 12}"],
    ids=["cannot be made", "no room"],
)
def test_a_refused_set_leaves_no_database(tmp_path, second):
    with pytest.raises(SpecError):
        run(
            tmp_path,
            f"objects:\n- {{name: A, shape: {{cube: 60}}}}\n- {second}\nprofile: one-touch\n",
        )
    assert [file.name for file in tmp_path.iterdir()] == ["lab-set.yaml"]


def test_what_cannot_be_written_leaves_no_database_that_is_new(tmp_path):
    (tmp_path / "out").write_text("a file\n")
    for text in ("name: A\nshape: {cube: 60}\n", SET):
        with pytest.raises(WriteError):
            run(tmp_path, text)
        assert sorted(file.name for file in tmp_path.iterdir()) == ["lab-set.yaml", "out"]
    (tmp_path / "lab.db").touch()  # somebody's own
    with pytest.raises(WriteError):
        run(tmp_path)
    assert (tmp_path / "lab.db").exists()
