"""`profile: auto`, and what is told of each face."""

import shutil
from contextlib import nullcontext
from pathlib import Path

import pytest
from reference.cells import listed

from generator.database.open import existing_database, open_if_there
from generator.database.register import retire
from generator.database.transaction import read_transaction, write_transaction
from generator.errors import DatabaseError
from generator.pipeline import encode
from generator.pipeline.choose import choose_array, lab_of
from generator.spec import SpecError, read_specs

DATABASES = Path(__file__).parents[3] / "fixtures" / "database"
DENSE = "symbols: {alphabet: dense-4}\n"  #: on the smaller arrays


def specs(folder, text):
    file = folder / "spec.yaml"
    file.write_text(text)
    return read_specs([file])


def dry(folder, text, *, dry_run=True, **options):
    here = {"database": f"sqlite:///{folder / 'lab.db'}", "folder": folder / "out"}
    return encode(specs(folder, text), dry_run=dry_run, **here, **options)


def made(folder, text, *, formats=(), **options):
    return dry(folder, text, dry_run=False, formats=formats, **options)


def choice(folder, text):
    lab = open_if_there(f"sqlite:///{folder / 'lab.db'}")
    with read_transaction(lab) if lab else nullcontext() as connection:
        read = specs(folder, text)
        return choose_array(read, lab_of(read, connection), connection)


def profiles(found):
    return {one.spec.profile for one in found.plans}


def pitches(found):
    return {one.spec.style.pitch_mm for one in found.plans}


def test_auto_takes_letters_that_the_sensor_tells_apart(tmp_path):
    text = "name: {}\nshape: {{cube: 60 mm}}\n{}"
    for settings, profile, alphabet in (
        ("", "tactel-8", "tactel-8"),
        ("symbols: {alphabet: tactel-16}\n", "tactel-8", "tactel-16"),
        (DENSE, "large", "dense-4"),
        ("sensor_type: fsr-8x8\n", "large", "dense-4"),
        ("sensor_type: gel-24x32\nprint: {printer: resin}\n", "large", "dense-4"),
    ):
        (plan,) = choice(tmp_path, text.format("A", settings)).plans
        assert (plan.spec.profile, plan.spec.alphabet.name) == (profile, alphabet)
        assert plan.array.order <= plan.spec.alphabet.order
    both = "objects:\n- {{name: A, shape: {{cube: 60}}}}\n- {{name: B, shape: {{cube: 60}}, {}}}\n"
    found = choice(tmp_path, both.format(DENSE.strip()))
    assert [one.spec.alphabet.name for one in found.plans] == ["dense-4", "dense-4"]
    assert profiles(found) == {"large"}


def test_a_lab_goes_on_with_its_letters(tmp_path):
    text = "name: {}\nshape: {{cube: 40 mm}}\n{}"
    made(tmp_path, text.format("Old", "profile: large\n"))
    (new,) = choice(tmp_path, text.format("New", "")).plans
    assert (new.spec.profile, new.spec.alphabet.name) == ("large", "dense-4")
    assert (new.spec.style.pitch_mm, new.array.rows) == (5.0, 51)
    made(tmp_path, text.format("Letters", "profile: tactel-8\n"))
    (new,) = choice(tmp_path, text.format("New", "")).plans
    assert (new.spec.profile, new.spec.alphabet.name) == ("tactel-8", "tactel-8")


def test_auto_takes_the_smallest_array_that_holds_the_objects_beside_those_there(tmp_path):
    text = "name: {}\nshape: {{cube: 200 mm}}\nprint: {{parts: whole, down: none}}\n"
    text += DENSE.replace("{", "{{").replace("}", "}}") + "copies: {}\n"
    first = made(tmp_path, text.format("A", 2))
    assert (first.rows, first.columns) == (51, 1285)
    smallest = choice(tmp_path, text.format("B", 2))
    assert (profiles(smallest), smallest.notes) == ({"large"}, ())
    more = choice(tmp_path, text.format("B", 4))
    assert profiles(more) == {"large-511x513"}
    assert more.plans[0].array.rows == 511
    (note,) = more.notes
    assert note.startswith("profile large-511x513 is taken (window 3x3 in place of 4x2): ")
    assert "cells are needed, and large 51x1285 has room for" in note
    again = dry(tmp_path, text.format("A", 2))
    assert again.objects[0].reused
    assert (again.rows, again.columns) == (51, 1285)


def test_auto_takes_finer_symbols_where_the_usual_ones_show_no_place(tmp_path):
    small = choice(tmp_path, "name: A\nshape: {cube: 16 mm}\n")
    assert pitches(small) == {4.5}
    assert "shows places on 6 of the 6 faces" in small.notes[-1]
    with pytest.raises(SpecError) as refused:
        choice(tmp_path, "name: A\nshape: {cube: 10 mm}\n")
    (problem,) = refused.value.problems
    assert "5 mm pitch" in problem.cause
    assert "set pitch" not in problem.fix  # 2.7 mm, which no nozzle of .4 mm prints
    assert "1.7 times larger" in problem.fix
    for box, settings, pitch in (
        ("[60, 15, 15]", DENSE, 4.5),
        ("[60, 14, 14]", DENSE, 4.0),
        ("[160, 14, 14]", DENSE, 5.0),  # ends of 4 % of its surface stay blank
        # makes 4.5 mm, which show no more
        ("[60, 14, 14]", DENSE + "print: {printer: fdm-0.6}\n", 5.0),
        ("[60, 15, 15]", "symbols: {alphabet: dense-4, pitch: 5 mm}\n", 5.0),
        ("[60, 17, 17]", DENSE, 5.0),
    ):
        found = choice(tmp_path, f"name: A\nshape: {{box: {box}}}\n{settings}")
        assert pitches(found) == {pitch}
        assert bool(found.notes) == (pitch < 5)


def test_an_object_that_is_made_again_has_the_pitch_of_its_changed_spec(tmp_path):
    text = "name: A\nshape: {{cube: 60 mm}}\nsymbols: {}\n"
    found = []
    for symbols in ("{stroke: 2.4 mm}", "{}", "{}", "{stroke: 2.4 mm}"):
        (one,) = made(tmp_path, text.format(symbols), replace=True).objects
        found.append((one.layout.pitch_mm, one.reused))
        said = [note for note in one.warnings if note.startswith("pitch 10 mm is taken; at 5 mm: ")]
        assert bool(said) == (symbols != "{}")
    assert found == [(10.0, False), (5.0, False), (5.0, True), (10.0, False)]


def test_printed_parts_of_a_replaced_object_are_not_read_as_the_new_one(tmp_path):
    def cells_and_warnings(make, side, printer, *formats):
        text = f"name: A\nshape: {{cube: {side} mm}}\nprint: {{printer: {printer}}}\n"
        (one,) = make(tmp_path, text, replace=True, formats=formats).objects
        cells = {cell for face in one.layout.faces for cell in listed((face.rows, face.columns))}
        return cells, " ".join(one.warnings)

    first, said = cells_and_warnings(made, 60, "fdm-0.4", "step", "stl")
    assert said == ""
    again, said = cells_and_warnings(made, 60, "prusa-mini", "stl")  # printed ones stay good
    assert again == first
    assert "A-F1.step, A-F2.step" in said
    assert "destroy" not in said
    planned, said = cells_and_warnings(dry, 50, "prusa-mini", "stl")
    assert "destroy its printed parts" in said
    other, said = cells_and_warnings(made, 50, "prusa-mini", "stl")
    assert other == planned
    assert not other & first
    assert "destroy its printed parts" in said


def test_a_database_goes_on_with_the_arrays_that_it_has(tmp_path):
    """Profile large was 255x257 when this one was made."""
    shutil.copy(DATABASES / "v2.db", tmp_path / "lab.db")
    result = made(tmp_path, "name: New\nprofile: large\nshape: {cube: 30 mm}\n")
    assert (result.rows, result.columns) == (255, 257)
    assert result.used_cells > result.objects[0].symbols  # beside the brick
    brick = "name: Brick\nprofile: {}\nshape: {{box: [40, 30, 20]}}\n"
    for profile in ("large", "auto"):  # of 7 mm, as it is registered
        assert dry(tmp_path, brick.format(profile)).objects[0].reused
    beside = choice(tmp_path, f"objects:\n- {{{brick[:11]}, shape: {{box: [40, 30, 20]}}}}\n"
                    "- {name: Beside, shape: {cube: 30 mm}}\n")  # fmt: skip
    assert pitches(beside) == {7.0}


def test_auto_follows_a_profile_that_the_set_names(tmp_path):
    text = "objects:\n- {name: A, shape: {cube: 60}}\n- {name: B, shape: {cube: 60}, profile: %s}\n"
    for profile, rows in (("large", 51), ("one-touch", 63)):
        assert dry(tmp_path, text % profile).rows == rows
    two = text % "one-touch" + "- {name: C, shape: {cube: 60}, profile: large}\n"
    with pytest.raises(SpecError, match=r"'C' is on another array \(large\) than 'B' \(one-touch"):
        dry(tmp_path, two)


def test_the_least_size_of_a_face_shows_a_place(tmp_path):
    (cube,) = dry(tmp_path, "name: A\nshape: {cube: 60 mm}\nprofile: one-touch\n").objects
    least = cube.face_reports[0].smallest_mm[0]
    assert 18 < least < 24
    box = "name: A\nshape: {{box: [60, {0:.2f}, {0:.2f}]}}\nlayout: faces\nprofile: one-touch\n"
    for side, shows in ((least + 0.5, True), (least - 1.5, False)):
        (one,) = dry(tmp_path, box.format(side)).objects
        square = [face for face in one.face_reports if max(face.size_mm) < 59]
        assert [bool(face.places) for face in square] == [shows] * 2


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ("cube: 60 mm}\ncopies: 12\nprofile: one-touch\n",
         r"(?s)array 63x65 is full.*fix: .*set profile: auto"),
        ("cylinder: {diameter: 40 mm, height: 30 mm}}\nprint: {parts: panels}\n",
         r":3:16: error: a round face cannot be printed as a flat"),
        ("cube: 60 mm}\nprint: {printer: resin}\noutput: {formats: [bambu]}\n",
         r":3:18: error: Bambu Studio and OrcaSlicer print filament, and resin prints resin"),
        ("file: inch.obj}\n",
         r"(?s)no place can be identified.*it is 3 x 2 x 1.5 mm; in inches it needs scale: 25.4"),
    ],
)  # fmt: skip
def test_what_cannot_be_made_is_refused_where_it_is_asked_for(tmp_path, settings, said):
    box = [(x, y, z) for x in (0, 3) for y in (0, 2) for z in (0, 1.5)]
    faces = ("1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4")
    lines = [f"v {x} {y} {z}" for x, y, z in box] + [f"f {face}" for face in faces]
    (tmp_path / "inch.obj").write_text("\n".join(lines))
    with pytest.raises(SpecError, match=said):
        dry(tmp_path, f"name: A\nshape: {{{settings}")


def test_a_sharp_edge_that_stays_open_and_a_part_larger_than_the_bed_are_told(tmp_path):
    points = "[[0,0,0],[100,0,0],[100,0,20],[0,40,0],[100,40,0],[100,40,20]]"
    faces = "[[0,1,2],[3,5,4],[0,3,4,1],[1,4,5,2],[0,2,5,3]]"
    text = f"name: A\nshape:\n  polyhedron: {{vertices: {points}, faces: {faces}}}\n"
    for settings, said in (("", True), ("print: {parts: whole}\n", False)):
        (one,) = dry(tmp_path, text + settings).objects
        assert any("stays open: F3 and F5 (28 mm)" in note for note in one.warnings) == said
    (one,) = dry(tmp_path, "name: A\nshape: {tag: 400 x 20 mm}\n").objects
    assert "larger than the bed of fdm-0.4, 250 x 210 mm: A; take a larger printer" in one.warnings


def test_a_retired_name_is_refused_by_a_dry_run_too(tmp_path):
    text = "name: A\nshape: {{cube: {} mm}}\n"
    made(tmp_path, text.format(30))
    with write_transaction(existing_database(str(tmp_path / "lab.db"))) as connection:
        retire(connection, "A")
    with pytest.raises(DatabaseError, match="was retired"):
        dry(tmp_path, text.format(35), replace=True)
