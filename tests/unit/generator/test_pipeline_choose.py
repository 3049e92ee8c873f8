"""`profile: auto`, and what is told of each face."""

from __future__ import annotations

import shutil
from contextlib import nullcontext
from pathlib import Path

import pytest

from generator.database import engine
from generator.database import open as open_module
from generator.database.open import open_if_there
from generator.database.transaction import read_transaction
from generator.pipeline import encode
from generator.pipeline.choose import choose_array
from generator.pipeline.lab import lab_of
from generator.pipeline.plan import plan_object
from generator.spec import SpecError, read_specs

DATABASES = Path(__file__).parents[3] / "fixtures" / "database"


def dry(folder: Path, text: str, **options):
    file = folder / "spec.yaml"
    file.write_text(text)
    url = f"sqlite:///{folder / 'lab.db'}"
    return encode(read_specs([file]), database=url, folder=folder / "out",
                  **({"dry_run": True} | options))  # fmt: skip


def choice(folder: Path, text: str):
    file = folder / "spec.yaml"
    file.write_text(text)
    lab = open_if_there(f"sqlite:///{folder / 'lab.db'}")
    with read_transaction(lab) if lab else nullcontext() as connection:
        specs = read_specs([file])
        return choose_array(specs, lab_of(specs, connection), connection)


def profiles(found) -> set[str]:
    return {one.spec.profile for one in found.specs}


def test_auto_takes_the_smallest_array_that_holds_the_objects(tmp_path):
    text = "name: A\nprofile: auto\nshape: {cube: 60 mm}\ncopies: "
    smallest = choice(tmp_path, text + "2")
    assert (profiles(smallest), smallest.notes) == ({"one-touch"}, ())
    large = choice(tmp_path, text + "9")
    assert profiles(large) == {"large"}
    (note,) = large.notes
    assert note.startswith("profile large is taken (window 4x2 in place of 3x2)")
    assert note.endswith("3456 cells are needed, and one-touch 63x65 has room for 3276")
    larger = choice(tmp_path, text + "200")
    assert profiles(larger) == {"large-511x513"}
    assert plan_object(larger.specs[0]).array.rows == 511
    (note,) = larger.notes
    assert "76800 cells are needed, and large 51x1285 has room for 52428" in note
    assert larger.specs[199].spec.name == "A-200"


@pytest.mark.parametrize("profile", ["auto", "one-touch"])
@pytest.mark.parametrize("copies", [1, 3])
def test_a_run_opens_the_database_once(tmp_path, monkeypatch, profile, copies):
    calls = []

    def connectable(*arguments, **options):
        calls.append(arguments)
        return engine.database_engine(*arguments, **options)

    monkeypatch.setattr(open_module, "database_engine", connectable)
    text = f"name: A\nprofile: {profile}\nshape: {{cube: 30 mm}}\ncopies: {copies}\n"
    dry(tmp_path, text)
    assert (calls, [file.name for file in tmp_path.iterdir()]) == ([], ["spec.yaml"])
    for options in ({"dry_run": False, "formats": ()}, {"dry_run": False, "formats": ()}, {}):
        calls.clear()
        dry(tmp_path, text, **options)
        assert len(calls) == 1


def test_auto_goes_on_where_the_database_is_full(tmp_path):
    text = "name: {}\nprofile: auto\nshape: {{cube: 140 mm}}\nprint: {{parts: whole}}\n"
    first = dry(tmp_path, text.format("A"), dry_run=False, formats=())
    assert (first.rows, first.columns) == (63, 65)
    second = choice(tmp_path, text.format("B"))
    assert profiles(second) == {"large"}
    assert "one-touch 63x65 has room for" in second.notes[0]  # beside A
    again = dry(tmp_path, text.format("A"))
    assert again.objects[0].reused
    assert (again.rows, again.columns) == (63, 65)


def test_a_database_goes_on_with_the_arrays_that_it_has(tmp_path):
    """Profile large was 255x257 when this one was made."""
    new = "name: {}\nprofile: {}\nshape: {{cube: 30 mm}}\n"
    assert dry(tmp_path, new.format("New", "large")).rows == 51
    shutil.copy(DATABASES / "v2.db", tmp_path / "lab.db")
    for profile in ("large", "fine"):
        result = dry(tmp_path, new.format(f"New {profile}", profile), dry_run=False, formats=())
        assert (result.rows, result.columns) == (255, 257)
        assert result.used_cells > result.objects[0].symbols  # beside the brick
    brick = "name: Brick\nprofile: {}\nshape: {{box: [40, 30, 20]}}\n"
    for profile in ("large", "auto"):
        (same,) = dry(tmp_path, brick.format(profile)).objects
        assert same.reused
    many = choice(tmp_path, new.format("Many", "auto") + "copies: 120\n")
    assert profiles(many) == {"large"}
    assert many.specs[0].spec.encoding["rows"] == 255
    assert dry(tmp_path, new.format("Other", "one-touch")).rows == 63


def test_auto_takes_finer_symbols_for_a_printer_that_makes_them(tmp_path):
    text = "name: A\nprofile: auto\nshape: {prism: {sides: 8, side: 14, height: 20}}\n"
    found = choice(tmp_path, text)
    assert profiles(found) == {"one-touch"}
    (note,) = found.notes
    assert note.startswith("profile fine, for resin printers, would show places on 8 of the 8")
    assert profiles(choice(tmp_path, text + "print: {printer: resin}\n")) == {"fine"}
    coarse = choice(tmp_path, text + "print: {printer: fdm-0.4}\n")
    assert (profiles(coarse), coarse.notes) == ({"one-touch"}, ())


def test_auto_follows_a_profile_that_the_set_names(tmp_path):
    text = "objects:\n- {name: A, shape: {cube: 60}, profile: large}\n"
    with pytest.raises(SpecError, match="on another array"):
        dry(tmp_path, text + "- {name: B, shape: {cube: 60}, profile: auto}\n")
    text = text.replace("large", "one-touch") + "- {name: B, shape: {cube: 60}, profile: auto}\n"
    assert dry(tmp_path, text).rows == 63


def test_each_face_is_told_with_the_least_size_that_shows_a_place(tmp_path):
    (made,) = dry(tmp_path, "name: A\nshape: {cube: 60 mm}\n").objects
    assert [face.name for face in made.face_reports] == [f"F{k}" for k in range(1, 7)]
    least = made.face_reports[0].smallest_mm[0]
    assert 18 < least < 24
    box = "name: A\nshape: {{box: [60, {0:.2f}, {0:.2f}]}}\nlayout: faces\n"
    (enough,) = dry(tmp_path, box.format(least + 0.5)).objects
    assert enough.face_reports[2].places > 0
    (short,) = dry(tmp_path, box.format(least - 1.5)).objects
    square = [face for face in short.face_reports if max(face.size_mm) < 59]
    assert square
    assert not any(face.places for face in square)


def test_a_round_face_is_told_as_one(tmp_path):
    text = "name: A\nshape: {cylinder: {diameter: 40 mm, height: 30 mm}}\n"
    (made,) = dry(tmp_path, text).objects
    assert made.faces == 3
    side, top = made.face_reports
    assert (side.name, side.kind, top.kind) == ("F2", "cylinder", "plane")
    assert side.size_mm == pytest.approx((125.66, 30.0), abs=0.01)
    assert side.smallest_mm[1] < 30
    assert "F1 stays blank" in made.warnings[0]


def test_panels_of_a_round_object_are_refused_where_they_are_asked_for(tmp_path):
    text = "name: A\nshape: {cylinder: {diameter: 40 mm, height: 30 mm}}\nprint: {parts: panels}\n"
    with pytest.raises(SpecError, match=r":3:16: error: a round face cannot be printed as a flat"):
        dry(tmp_path, text)


def test_what_is_made_with_a_larger_array_is_told(tmp_path):
    text = "name: A\nprofile: auto\nshape: {cube: 30 mm}\ncopies: 60\n"
    result = dry(tmp_path, text)
    assert (result.rows, result.columns) == (51, 1285)
    assert "profile large is taken" in result.objects[0].warnings[0]
    assert not any("is taken" in w for made in result.objects[1:] for w in made.warnings)


def test_a_set_too_large_for_the_profile_it_names_is_told_of_auto(tmp_path):
    with pytest.raises(SpecError, match="array 63x65 is full") as caught:
        dry(tmp_path, "name: A\nshape: {cube: 60 mm}\ncopies: 12\n")
    assert "or profile auto" in caught.value.problems[0].fix
