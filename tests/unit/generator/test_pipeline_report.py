"""What is said of an object: rates of its faces, what would help, how to build it."""

from __future__ import annotations

import html
import re
import zipfile

import pytest

from generator.command.made_report import next_step, rate_lines
from generator.errors import PrintError
from generator.layout.recognition_rate import LOW, percent
from generator.pipeline import encode
from generator.pipeline.faces import face_reports, whole_rate
from generator.pipeline.place import NO_CELLS, lay_out_object
from generator.pipeline.plan import plan_object
from generator.printed.slicer import PlateCost, read_cost
from generator.spec.read import read_specs, tree_from


def laid_out(shape, **settings):
    """Return the plan of an object, and its layout on an empty array."""
    settings = settings or {"profile": "one-touch"}
    plan = plan_object(*read_specs([tree_from({"name": "A", "shape": shape, **settings})]))
    return plan, lay_out_object(plan, NO_CELLS)


def bracket(width, height, thick):
    """Return an L of two plates along y, `thick` mm thick and deep."""
    t = thick
    outline = [(0, 0), (width, 0), (width, t), (t, t), (t, height), (0, height)]
    faces = [list(range(6)), list(range(11, 5, -1))]
    faces += [[k, k + 6, (k + 1) % 6 + 6, (k + 1) % 6] for k in range(6)]
    vertices = [[x, y, z] for y in (0, t) for x, z in outline]
    return {"polyhedron": {"vertices": vertices, "faces": faces}}


def test_a_bracket_of_narrow_legs_is_not_readable_and_says_so():
    laid = laid_out(bracket(70, 60, 12))
    faces = face_reports(*laid)
    by_name = {face.name: face for face in faces}
    assert by_name["F3"].place == "the 12 x 70 mm face at z = 0"
    assert by_name["F6"].place == "the 12 x 48 mm face at x = 12"
    for name in ("F1", "F3", "F5", "F6", "F8"):
        assert by_name[name].promise.one_row
        assert by_name[name].promise.at_once < 0.25
    assert by_name["F5"].promise.meets == ("F6",)  # the base and the wall on it
    assert by_name["F6"].promise.meets == ("F5",)
    assert (by_name["F4"].symbols, by_name["F4"].promise.at_once) == (0, 0.0)
    lines = rate_lines(faces, whole_rate(*laid, faces))
    said = "F4, the 12 x 12 mm face at x = 70 (and F7, as narrow): not readable: it is blank"
    assert said in "\n".join(lines)
    assert "not readable by single touches: one row of symbols" in "\n".join(lines)
    assert "of touches anywhere on the part" in lines[0]


def test_a_face_beside_a_wall_says_what_the_sensor_meets():
    laid = laid_out(bracket(75, 80, 25), profile="auto")
    faces = face_reports(*laid)
    text = rate_lines(faces, whole_rate(*laid, faces))
    (line,) = [one for one in text if one.startswith("  F5, ")]
    assert "the sensor meets F6 at " in line
    low = next(face.promise for face in faces if face.name == "F5")
    assert low.blocked > 0.1
    assert low.at_once < 1 - low.blocked


def test_what_would_help_does_help():
    def narrow_face(width):
        reports = face_reports(*laid_out({"box": [80, 40, width]}))
        return next(f for f in reports if sorted(f.size_mm) == pytest.approx([width, 80]))

    face = narrow_face(14)
    assert face.promise.at_once < LOW
    again = narrow_face(float(face.promise.remedy.split(" mm wide instead of 14")[0]))
    assert again.promise.at_once > LOW - 0.03
    assert again.promise.remedy == ""


def test_what_a_slicer_reckons():
    text = "; total filament used [g] = 22.41\n"
    text += "; estimated printing time (normal mode) = 1d 2h 36m 45s\n"
    assert read_cost(text) == PlateCost(1597, 22.41)
    assert str(PlateCost(157, 22.41)) == "2 h 37 min, 22 g"
    with pytest.raises(PrintError, match="no time"):
        read_cost("; nothing\n")


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
    specs = read_specs([tree_from({"name": "A", "shape": shape, "mount": mount})])
    url = f"sqlite:///{tmp_path}/lab.db"
    made = encode(specs, folder=tmp_path, database=url, formats=("stl",), jobs=1)
    sheet = html.unescape((tmp_path / "A-build.html").read_text())
    assert f"g if solid; {bought}<" in sheet
    promise = percent(made.objects[0].promise.at_once / made.objects[0].promise.encoded)
    assert f"{promise} of touches on its encoded side are answered at once" in sheet


def test_panels_are_advised_only_where_they_can_be_made(tmp_path):
    for thick, advised in ((6, False), (40, True)):
        shape = {"box": [60, 60, thick]}
        print_ = {"parts": "whole"}
        specs = read_specs([tree_from({"name": "A", "shape": shape, "print": print_})])
        url = f"sqlite:///{tmp_path}/{thick}.db"
        (one,) = encode(specs, folder=tmp_path, database=url, formats=(), dry_run=True).objects
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
    specs = read_specs([tree_from({"name": "A", "shape": shape, "print": how})])
    url = f"sqlite:///{tmp_path}/l.db"
    made = encode(specs, folder=tmp_path, database=url, formats=("3mf",), jobs=1)
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
        assert re.fullmatch(way, made.objects[0].lying)
