"""What is said of an object: rates of its faces, what would help, its size, how to build it."""

from __future__ import annotations

import base64
import json
import re
import subprocess
import xml.etree.ElementTree as ET
import zipfile
from dataclasses import asdict

import numpy as np
import pytest
from bench_page import CHROMIUM, FLAGS

from generator.command import run
from generator.command.made_report import next_step, rate_lines
from generator.errors import PrintError
from generator.layout.recognition_rate import LOW
from generator.pipeline import encode
from generator.pipeline.faces import face_reports, whole_rate
from generator.pipeline.files import outer_size_mm, parts_of
from generator.pipeline.place import NO_CELLS, lay_out_object
from generator.pipeline.plan import plan_object
from generator.printed.slicer import PlateCost, read_cost
from generator.spec.read import read_specs, tree_from

BRACKET = """\
{polyhedron: {
    vertices: [[0, 0, 0], [70, 0, 0], [70, 0, 12], [12, 0, 12], [12, 0, 60], [0, 0, 60],
               [0, 12, 0], [70, 12, 0], [70, 12, 12], [12, 12, 12], [12, 12, 60], [0, 12, 60]],
    faces: [[0, 1, 2, 3, 4, 5], [6, 11, 10, 9, 8, 7], [0, 6, 7, 1], [1, 7, 8, 2],
            [2, 8, 9, 3], [3, 9, 10, 4], [4, 10, 11, 5], [5, 11, 6, 0]]}}"""


def laid_out(folder, shape, settings="profile: one-touch"):
    """Return the plan of an object, and its layout on an empty array."""
    (folder / "a.yaml").write_text(f"name: A\nshape: {shape}\n{settings}\n")
    plan = plan_object(*read_specs([folder / "a.yaml"]))
    return plan, lay_out_object(plan, NO_CELLS)


def test_a_bracket_of_narrow_legs_is_not_readable_and_says_so(tmp_path):
    laid = laid_out(tmp_path, BRACKET)
    faces = face_reports(*laid)
    by_name = {face.name: face for face in faces}
    assert by_name["F3"].place == "the 12 x 70 mm face at z = 0"
    assert by_name["F6"].place == "the 12 x 48 mm face at x = 12"
    for name in ("F1", "F3", "F5", "F6", "F8"):
        assert by_name[name].promise.one_row
        assert by_name[name].promise.at_once < 0.25
    assert by_name["F5"].promise.meets == ("F6",)  # the base and the wall on it
    assert by_name["F6"].promise.meets == ("F5",)
    assert by_name["F4"].symbols == 0
    assert by_name["F4"].promise.at_once == 0.0
    text = "\n".join(rate_lines(faces, whole_rate(*laid, faces)))
    assert (
        "F4, the 12 x 12 mm face at x = 70 (and F7, as narrow): not readable: it is blank" in text
    )
    assert "not readable by single touches: one row of symbols" in text
    assert "of touches anywhere on the part" in text.splitlines()[0]


def test_a_face_beside_a_wall_says_what_the_sensor_meets(tmp_path):
    sizes = {"70": "75", "60": "80", "12": "25"}
    thick = re.sub(r"\b(70|60|12)\b", lambda number: sizes[number[0]], BRACKET)
    laid = laid_out(tmp_path, thick, "profile: auto")
    faces = face_reports(*laid)
    text = rate_lines(faces, whole_rate(*laid, faces))
    (line,) = [one for one in text if one.startswith("  F5, ")]
    assert "the sensor meets F6 at " in line
    low = next(face.promise for face in faces if face.name == "F5")
    assert low.blocked > 0.1
    assert low.at_once < 1 - low.blocked


def test_what_would_help_does_help(tmp_path):
    narrow = face_reports(*laid_out(tmp_path, "{box: [80 mm, 40 mm, 14 mm]}"))
    (face, *_) = [f for f in narrow if sorted(f.size_mm) == pytest.approx([14, 80])]
    assert face.promise.at_once < LOW
    width = float(face.promise.remedy.split(" mm wide instead of 14")[0])
    wide = face_reports(*laid_out(tmp_path, f"{{box: [80 mm, 40 mm, {width} mm]}}"))
    (again, *_) = [f for f in wide if sorted(f.size_mm) == pytest.approx([width, 80])]
    assert again.promise.at_once > LOW - 0.03
    assert again.promise.remedy == ""


def test_a_large_cube_promises_more_than_a_small_one_and_names_no_face(tmp_path):
    shares = []
    for side in (20, 60, 200):
        laid = laid_out(tmp_path, f"{{cube: {side} mm}}", "profile: auto")
        faces = face_reports(*laid)
        shares.append(faces[0].promise.at_once)
        if side > 20:
            (line,) = rate_lines(faces, whole_rate(*laid, faces))
            said = "over 99" if shares[-1] > 0.99 else f"{100 * shares[-1]:.0f}"
            assert line == (
                f"  of touches anywhere on the part {said} % are answered at once, over 99 % "
                "within three; 100 % of its surface is encoded"
            )
            assert faces[0].promise.within_three > 0.99
    assert shares[0] < 0.9 < shares[1] < 0.99 < shares[2] < 1


def test_a_can_is_as_wide_as_it_is_round(tmp_path):
    """Not as its facets."""
    can = "{cylinder: {diameter: 60 mm, height: 80 mm}}"
    plan, layout = laid_out(tmp_path, can, "symbols: {pitch: 14 mm}")
    assert np.ptp(plan.polyhedron.vertices, axis=0)[0] < 59.99
    size = outer_size_mm(plan.polyhedron, parts_of(plan, layout)[0])
    assert size == pytest.approx([60, 60, 80], abs=1e-9)


SHAPES_MADE = {
    "Bar": {"shape": {"box": [60, 30, 12]}, "symbols": {"pitch": "7 mm", "alphabet": "dense-4"}},
    "Can": {"shape": {"cylinder": {"diameter": 40, "height": 30}}},
    "Old": {"shape": {"cube": 90}, "profile": "thesis"},
}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Return the folder, and what was reported of each object."""
    folder = tmp_path_factory.mktemp("rates")
    return folder, {
        name: encode(read_specs([tree_from(settings | {"name": name})]), folder=folder, formats=(),
                     database=f"{folder}/{name}.db")
        for name, settings in SHAPES_MADE.items()
    }  # fmt: skip


def shown(folder, name, capsys, *options):
    """Return both shares of each face that has some, as `show` prints them."""
    assert run(["show", name, "--database", f"{folder}/{name}.db", "--json", *options]) == 0
    faces = json.loads(capsys.readouterr().out)["faces"]
    return {one["name"]: one["promise"] for one in faces if one["promise"] is not None}


@pytest.mark.parametrize("name", SHAPES_MADE)
def test_the_database_gives_the_rates_that_were_reported(made, name, capsys):
    folder, reports = made
    (made_object,) = reports[name].objects
    reported = {
        face.name: json.loads(json.dumps(asdict(face.promise) | {"remedy": ""}))
        for face in made_object.face_reports
        if face.promise is not None and face.symbols
    }
    assert shown(folder, name, capsys) == reported
    assert bool(reported) == (name != "Old")
    if name == "Can":  # the mantle, with the seam of its symbols
        assert 0.5 < reported["F2"]["at_once"] < reported["F3"]["at_once"]
    run(["show", name, "--database", f"{folder}/{name}.db", "--json"])
    part = json.loads(capsys.readouterr().out)["surface"]
    said = ("at_once", "within_three", "encoded")
    promise = made_object.promise
    assert part == (promise and {key: getattr(promise, key) for key in said})


def test_another_sensor_has_the_rates_it_would_have_had_when_made(made, tmp_path, capsys):
    folder, _ = made
    spec = read_specs([tree_from(SHAPES_MADE["Bar"] | {"name": "Bar"})], sensor_type="mat-32x32")
    report = encode(spec, folder=tmp_path, formats=(), database=f"{tmp_path}/lab.db")
    reported = [face.promise.at_once for face in report.objects[0].face_reports if face.symbols]
    found = shown(folder, "Bar", capsys, "--sensor-type", "mat-32x32")
    assert sorted(one["at_once"] for one in found.values()) == sorted(reported)
    usual = {one["at_once"] for one in shown(folder, "Bar", capsys).values()}
    assert usual.isdisjoint(one["at_once"] for one in found.values())
    # it sees too few symbols at once
    assert shown(folder, "Bar", capsys, "--sensor-type", "gel-24x32") == {}


def test_what_a_slicer_reckons():
    text = "; total filament used [g] = 22.41\n"
    text += "; estimated printing time (normal mode) = 1d 2h 36m 45s\n"
    assert read_cost(text) == PlateCost(1597, 22.41)
    assert str(PlateCost(157, 22.41)) == "2 h 37 min, 22 g"
    with pytest.raises(PrintError, match="no time"):
        read_cost("; nothing\n")


def test_the_build_sheet_and_the_last_line_say_how_parts_lie(tmp_path):
    block = {"name": "Block", "shape": {"box": [40, 30, 30]}}
    whole = {"name": "Whole", "shape": {"cube": 40}, "print": {"parts": "whole"}}
    specs = read_specs([tree_from({"name": "Course", "objects": [block, whole]})])
    url = f"sqlite:///{tmp_path}/l.db"
    made = encode(specs, folder=tmp_path / "out", database=url, formats=("3mf",), jobs=1)
    page = next(f for f in made.files if f.name == "Block-build.html").read_text()
    marks = re.findall(r'<b class="mark">(.*?)</b>', page)
    code = re.search(r"backs say (\w+), which stands for Block on small parts", page)[1]
    assert all(mark.split()[0].startswith(("BLOCK", code)) for mark in marks)
    assert [mark[-1] for mark in marks] == list("123456")
    assert re.findall(r"(?:src|href)=\"(?!#|data:)([^\"]*)", page) == []  # no network
    for drawing in re.findall(r"<svg.*?</svg>", page):
        ET.fromstring(drawing)
    lying = made.objects[1].lying
    assert re.fullmatch(
        r"F1 down, no supports needed, \d+ symbols stand out "
        r"sideways; with  parts: panels  nothing hangs over",
        lying,
    )
    assert made.objects[0].lying is None
    line = next_step(made)
    assert "print Course-plate-1" in line
    assert "Course-build.html" in line
    assert "Whole: F1 down, no supports needed, " in line


def test_a_cube_takes_two_pages_of_paper_and_a_can_one(tmp_path):
    cube = {"name": "Cube", "shape": {"cube": 60}}
    can = {"name": "Can", "shape": {"cylinder": {"diameter": 60, "height": 80}}}
    pages = {}
    for spec in (cube, can):
        (read,) = read_specs([tree_from(spec)])
        url = f"sqlite:///{tmp_path}/l.db"
        made = encode([read], folder=tmp_path, database=url, formats=("3mf",), jobs=1)
        sheet = next(f for f in made.files if f.name.endswith("-build.html"))
        paper = tmp_path / f"{spec['name']}.pdf"
        printing = [CHROMIUM, "--headless", "--no-pdf-header-footer", f"--print-to-pdf={paper}"]
        subprocess.run([*printing, *FLAGS, sheet.as_uri()], check=True, capture_output=True)
        pages[spec["name"]] = len(re.findall(rb"/Type /Page\b", paper.read_bytes()))
        text = sheet.read_text()
        picture = re.search(r'<img alt="" src="data:image/png;base64,([^"]*)">', text)[1]
        assert base64.b64decode(picture) == (tmp_path / f"{spec['name']}.png").read_bytes()
        assert re.search(r"<th>to buy</th><td>PLA, \d+ cm3 in all", text)
        assert re.search(r"<th>printing</th><td>about \d h \d+ min, \d+ g \(estimated", text)
    assert pages == {"Cube": 2, "Can": 1}


@pytest.mark.parametrize(
    ("shape", "how", "said"),
    [
        ("{cone: {diameter: 40 mm, top_diameter: 30 mm, height: 30 mm}}", "whole", "no supports"),
        ("{dodecahedron: 25 mm}", "whole, printer: {overhang: 10 deg}", "supports needed under F"),
        ("{box: 40 x 40 x 30 mm}", "panels", "no supports"),
    ],
)
def test_sheet_advice_and_slicer_project_agree_on_supports(tmp_path, shape, how, said):
    spec = tmp_path / "a.yaml"
    spec.write_text(f"name: A\nshape: {shape}\nprint: {{parts: {how}}}\n")
    url = f"sqlite:///{tmp_path}/l.db"
    made = encode(read_specs([spec]), folder=tmp_path, database=url, formats=("3mf",), jobs=1)
    assert said in (tmp_path / "A-build.html").read_text()
    assert said in next_step(made)
    wanted = "0" if said.startswith("no") else "1"
    for project in tmp_path.glob("*-prusaslicer.3mf"):
        with zipfile.ZipFile(project) as package:
            settings = package.read("Metadata/Slic3r_PE.config").decode()
            of_object = package.read("Metadata/Slic3r_PE_model.config").decode()
        assert f"; support_material = {wanted}\n" in settings
        assert set(re.findall(r'support_material" value="(.)"', of_object)) == {wanted}
