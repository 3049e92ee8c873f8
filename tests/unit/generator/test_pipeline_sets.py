"""Sets: in parallel, resumable, on no cell twice; what is said of faces and of supports."""

import hashlib
import html
import pickle
import re
import shutil
import zipfile
from dataclasses import replace

import numpy as np
import pytest
from random_shapes import extruded
from reference.cells import listed

from encoded_objects.base.document import Problem
from generator.command.made_report import next_step, rate_lines
from generator.database.open import open_database
from generator.database.read import read_layout
from generator.database.transaction import read_transaction
from generator.errors import DatabaseError, PrintError, WriteError
from generator.layout.recognition_rate import LOW, percent
from generator.pipeline import encode
from generator.pipeline.faces import face_reports, whole_rate
from generator.pipeline.files import parts_of
from generator.pipeline.make import MakeJob, make_at, make_under_lock
from generator.pipeline.parallel import Task, Workers
from generator.pipeline.place import NO_CELLS, lay_out_object, place_object
from generator.pipeline.plan import plan_object
from generator.pipeline.progress import no_progress
from generator.printed.slicer import PlateCost, read_cost
from generator.spec import SpecError, read_specs
from generator.spec.read import tree_from

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


def check_cells(engine, symbols):
    """Check that A and B hold so many cells, none of them twice."""
    with read_transaction(engine) as connection:
        faces = [face for name in "AB" for face in read_layout(connection, name).faces]
    cells = [cell for face in faces for cell in listed((face.rows, face.columns))]
    assert len(set(cells)) == len(cells) == symbols


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
    check_cells(engine, first.symbols + second.symbols)
    again = make_at(engine, jobs[0], chosen[0])  # another writer made it meanwhile
    assert (again.reused, again.symbols) == (True, first.symbols)


def test_a_dry_build_counts_while_the_array_is_empty(tmp_path):
    engine, jobs = two_jobs(tmp_path)
    dry = [place_object(None, job.plan, replace=False) for job in jobs]
    dry = [
        replace(one, built=parts_of(job.plan, one.layout))
        for job, one in zip(jobs, dry, strict=True)
    ]
    first, second, again = (make_under_lock(engine, jobs[k], dry_build=dry[k]) for k in (0, 1, 0))
    assert first.layout is dry[0].layout
    assert second.layout is not dry[1].layout  # the first one's cells were free then
    assert again.layout is not dry[0].layout  # registered: its own cells
    assert again.reused
    check_cells(engine, first.symbols + second.symbols)


def test_errors_come_back_from_other_processes():
    tasks = [Task(str(k), int, (text,)) for k, text in enumerate(["1", "x", "3", "y"])]
    with Workers(2) as workers, pytest.raises(ValueError, match="'x'"):
        workers.done(tasks, no_progress)
    error = SpecError([Problem("a cause", "a fix", file="c.yaml")])
    assert str(pickle.loads(pickle.dumps(error))) == str(error)


def test_a_refused_set_leaves_no_database(tmp_path):
    text = "profile: one-touch\nobjects:\n- {name: A, shape: {cube: 60}}\n- {name: B, shape: %s}\n"
    for cannot_be_made_or_has_no_room in ("{box: [60, 60, 5]}", "{cube: 60}, copies: 12"):
        with pytest.raises(SpecError):
            run(tmp_path, text % cannot_be_made_or_has_no_room)
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


def reported(shape, profile="one-touch"):
    """Return what is said of an object on an empty array: faces by name, and the lines."""
    spec = {"name": "A", "shape": shape, "profile": profile}
    plan = plan_object(*read_specs([tree_from(spec)]))
    layout = lay_out_object(plan, NO_CELLS)
    faces = face_reports(plan, layout)
    return {one.name: one for one in faces}, rate_lines(faces, whole_rate(plan, layout, faces))


def bracket(width, height, t):
    """Return an L of two plates along y, `t` mm thick and deep."""
    outline = np.array([(0, 0), (width, 0), (width, t), (t, t), (t, height), (0, height)], float)
    solid = extruded([outline], t, pose=np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]]))
    faces = [list(face.loops[0]) for face in solid.faces]
    return {"polyhedron": {"vertices": solid.vertices.tolist(), "faces": faces}}


def test_a_bracket_of_narrow_legs_is_not_readable_and_says_so():
    faces, lines = reported(bracket(70, 60, 12))
    assert faces["F3"].place == "the 12 x 70 mm face at z = 0"
    assert faces["F6"].place == "the 12 x 48 mm face at x = 12"
    for name in ("F1", "F3", "F5", "F6", "F8"):
        assert faces[name].promise.one_row
        assert faces[name].promise.at_once < 0.25
    assert faces["F5"].promise.meets == ("F6",)  # the base and the wall on it
    assert faces["F6"].promise.meets == ("F5",)
    assert (faces["F4"].symbols, faces["F4"].promise.at_once) == (0, 0.0)
    said = "F4, the 12 x 12 mm face at x = 70 (and F7, as narrow): not readable: it is blank"
    assert said in "\n".join(lines)
    assert "not readable by single touches: one row of symbols" in "\n".join(lines)
    assert "of touches anywhere on the part" in lines[0]


def test_a_face_beside_a_wall_says_what_the_sensor_meets():
    faces, lines = reported(bracket(75, 80, 25), "auto")
    (line,) = [one for one in lines if one.startswith("  F5, ")]
    assert "the sensor meets F6 at " in line
    low = faces["F5"].promise
    assert low.blocked > 0.1
    assert low.at_once < 1 - low.blocked


def test_what_would_help_does_help():
    def narrow_face(width):
        faces, _ = reported({"box": [80, 40, width]})
        return next(f for f in faces.values() if sorted(f.size_mm) == pytest.approx([width, 80]))

    face = narrow_face(14)
    assert face.promise.at_once < LOW
    again = narrow_face(float(face.promise.remedy.split(" mm wide instead of 14")[0]))
    assert again.promise.at_once > LOW - 0.03
    assert again.promise.remedy == ""


def test_what_a_slicer_reckons():
    time = "; estimated printing time (normal mode) = 1d 2h 36m 45s\n"
    assert read_cost("; total filament used [g] = 22.41\n" + time) == PlateCost(1597, 22.41)
    assert str(PlateCost(157, 22.41)) == "2 h 37 min, 22 g"
    with pytest.raises(PrintError, match="no time"):
        read_cost("; nothing\n")


def encoded(folder, formats, *, dry_run=False, **settings):
    """Encode an object of these settings; return what is told of it, and of all."""
    specs = read_specs([tree_from({"name": "A", **settings})])
    here = {"folder": folder, "database": f"sqlite:///{folder}/lab.db", "jobs": 1}
    made = encode(specs, formats=formats, dry_run=dry_run, **here)
    return made.objects[0], made


@pytest.mark.parametrize(
    ("mount", "bought"),
    [
        ({"magnets": "6 x 3 mm"}, "4 magnets of 6 x 3 mm"),
        ({"screws": "M3"}, "4 screws M3"),
        ({"rod": 3}, "a rod of 3 mm"),
        ({"flange": "ISO 9409-1-31.5-4-M5"}, "4 screws M5; a pin of 5 mm"),
    ],
)
def test_a_sheet_names_what_to_buy_and_the_encoded_side(tmp_path, mount, bought):
    shape = {"tag": {"size": [60, 60], "thickness": 12}}
    one, _ = encoded(tmp_path, ("stl",), shape=shape, mount=mount)
    sheet = html.unescape((tmp_path / "A-build.html").read_text())
    assert f"g if solid; {bought}<" in sheet
    promise = percent(one.promise.at_once / one.promise.encoded)
    assert f"{promise} of touches on its encoded side are answered at once" in sheet


def test_panels_are_advised_only_where_they_can_be_made(tmp_path):
    for thick, advised in ((6, False), (40, True)):
        settings = {"shape": {"box": [60, 60, thick]}, "print": {"parts": "whole"}}
        one, _ = encoded(tmp_path, (), dry_run=True, **settings)
        assert ("parts: panels" in one.lying) == advised


@pytest.mark.parametrize(
    ("shape", "how", "said"),
    [
        ({"cube": 40}, {"parts": "whole"}, "no supports"),
        ({"dodecahedron": 25}, {"parts": "whole", "printer": {"overhang": 10}},
         "supports needed under F"),
        ({"box": "40 x 40 x 30 mm"}, {"parts": "panels"}, "no supports"),
    ],
)  # fmt: skip
def test_sheet_advice_and_slicer_project_agree_on_supports(tmp_path, shape, how, said):
    one, made = encoded(tmp_path, ("3mf",), shape=shape, print=how)
    sheet = (tmp_path / "A-build.html").read_text()
    assert said in sheet
    assert said in next_step(made)
    assert re.findall(r"(?:src|href)=\"(?!#|data:)([^\"]*)", sheet) == []  # no network
    wanted = "0" if said.startswith("no") else "1"
    for project in tmp_path.glob("*-prusaslicer.3mf"):
        with zipfile.ZipFile(project) as package:
            settings = package.read("Metadata/Slic3r_PE.config").decode()
            of_object = package.read("Metadata/Slic3r_PE_model.config").decode()
        assert f"; support_material = {wanted}\n" in settings
        assert set(re.findall(r'support_material" value="(.)"', of_object)) == {wanted}
    if shape == {"cube": 40}:
        way = r"F1 down, no supports needed, \d+ symbols stand out sideways; with  parts: .*"
        assert re.fullmatch(way, one.lying)
