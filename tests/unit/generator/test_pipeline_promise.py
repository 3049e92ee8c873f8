"""What faces promise, in values, and what would help; and what is said of it."""

from pathlib import Path

import pytest

from generator.command.made_report import face_values, rate_lines
from generator.layout.recognition_rate import LOW
from generator.pipeline.faces import face_reports
from generator.pipeline.place import NO_CELLS, lay_out_object
from generator.pipeline.plan import plan_object
from generator.spec.read import read_specs

BRACKET = """\
name: Bracket
shape:
  polyhedron:
    vertices: [[0, 0, 0], [70, 0, 0], [70, 0, 12], [12, 0, 12], [12, 0, 60], [0, 0, 60],
               [0, 12, 0], [70, 12, 0], [70, 12, 12], [12, 12, 12], [12, 12, 60], [0, 12, 60]]
    faces: [[0, 1, 2, 3, 4, 5], [6, 11, 10, 9, 8, 7], [0, 6, 7, 1], [1, 7, 8, 2],
            [2, 8, 9, 3], [3, 9, 10, 4], [4, 10, 11, 5], [5, 11, 6, 0]]
"""


def specs(text):
    Path("a.yaml").write_text(text)
    return read_specs([Path("a.yaml")])


def reports(text, profile="one-touch"):
    """Reports on the faces of one object, laid out on an empty array."""
    plan = plan_object(*specs(f"{text}profile: {profile}\n"))
    return face_reports(plan, lay_out_object(plan, NO_CELLS))


@pytest.fixture(autouse=True)
def _in_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def test_a_bracket_of_narrow_legs_is_not_readable_and_says_so():
    faces = reports(BRACKET)
    by_name = {face.name: face for face in faces}
    assert by_name["F3"].place == "the 12 x 70 mm face at z = 0"
    assert by_name["F6"].place == "the 12 x 48 mm face at x = 12"
    for name in ("F1", "F3", "F5", "F6", "F8"):
        assert by_name[name].promise.one_row
        assert by_name[name].promise.at_once < 0.25
    assert by_name["F4"].symbols == 0
    assert by_name["F4"].promise.at_once == 0.0
    text = "\n".join(rate_lines(faces))
    assert (
        "F4, the 12 x 12 mm face at x = 70 (and F7, as narrow): not readable: it is blank" in text
    )
    assert "not readable by single touches: one row of symbols" in text
    assert "% of touches are answered at once" in text.splitlines()[0]


def test_what_would_help_does_help():
    narrow = reports("name: Bar\nshape: {box: [80 mm, 40 mm, 14 mm]}\n")
    (face, *_) = [f for f in narrow if sorted(f.size_mm) == pytest.approx([14, 80])]
    assert face.promise.at_once < LOW
    width = float(face.promise.remedy.split(" mm wide instead of 14")[0])
    wide = reports(f"name: Bar\nshape: {{box: [80 mm, 40 mm, {width} mm]}}\n")
    (again, *_) = [f for f in wide if sorted(f.size_mm) == pytest.approx([width, 80])]
    assert again.promise.at_once > LOW - 0.03
    assert again.promise.remedy == ""


def test_a_large_cube_promises_more_than_a_small_one_and_names_no_face():
    shares = []
    for side in (20, 60, 200):
        faces = reports(f"name: Cube\nshape: {{cube: {side} mm}}\n", "auto")
        promised = [face.promise for face in faces]
        assert len(promised) == 6
        shares.append(promised[0].at_once)
        if side > 20:
            (line,) = rate_lines(faces)
            assert line.startswith(f"  {shares[-1]:.0%} of touches".replace("%", " %"))
            assert line.endswith(" of touches are answered at once, over 99 % within three")
            assert promised[0].within_three > 0.99
    assert shares[0] < 0.7 < shares[1] < 0.95 < shares[2] < 1


def test_round_faces_and_scans_promise_nothing():
    made = reports("name: Can\nshape: {cylinder: {diameter: 70 mm, height: 50 mm}}\n")
    kinds = {face.kind: face.promise for face in made}
    assert kinds["cylinder"] is None
    assert kinds["plane"].at_once > 0.5
    scan = reports("name: Cube\nshape: {cube: 100 mm}\n", "thesis")
    assert {face.promise for face in scan} == {None}
    assert rate_lines(scan) == []
    assert face_values(scan[0])["promise"] is None
