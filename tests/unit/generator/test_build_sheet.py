"""The build sheet: order of gluing, checks, drawings, and what the last line advises."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from generator.command.made_report import next_step
from generator.errors import PrintError
from generator.pipeline.encode import encode
from generator.polyhedron import SHAPES
from generator.polyhedron.assembly import assembly_order, distinct_faces
from generator.polyhedron.frame import face_area, face_frame
from generator.printed.slicer import PlateCost, read_cost
from generator.spec import read_specs

SET = """objects:
  - name: Block
    shape: {box: [40 mm, 30 mm, 30 mm]}
    copies: 2
  - name: Whole
    shape: {cube: 40 mm}
    print: {parts: whole}
"""


@pytest.mark.parametrize("kind", ["cube", "dodecahedron", "tetrahedron"])
def test_every_panel_meets_one_that_is_there(kind):
    solid = SHAPES[kind](60.0)
    steps = assembly_order(solid)
    assert sorted(step.face for step in steps) == list(range(len(solid.faces)))
    there = {steps[0].face}
    for step in steps[1:]:
        for number in step.edges:
            edge = solid.edges[number]
            assert {edge.left, edge.right} - {step.face} <= there
        assert step.edges
        there.add(step.face)
    assert sum(len(step.edges) for step in steps) == len(solid.edges)


def test_the_largest_face_lies_down_and_three_directions_are_touched():
    solid = SHAPES["box"]((80.0, 60.0, 20.0))
    assert face_area(solid, assembly_order(solid)[0].face) == pytest.approx(4800.0)
    chosen = distinct_faces(solid, list(range(6)))
    normals = np.array([face_frame(solid, face)[:3, 2] for face in chosen])
    assert np.abs(normals @ normals.T).sum() == pytest.approx(3.0)  # a corner of the box
    assert distinct_faces(solid, [2]) == (2,)


def test_what_a_slicer_reckons():
    text = "; total filament used [g] = 22.41\n"
    text += "; estimated printing time (normal mode) = 1d 2h 36m 45s\n"
    assert read_cost(text) == PlateCost(1597, 22.41)
    assert str(PlateCost(157, 22.41)) == "2 h 37 min, 22 g"
    with pytest.raises(PrintError, match="no time"):
        read_cost("; nothing\n")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("set")
    (folder / "course.yaml").write_text(SET)
    specs = read_specs([folder / "course.yaml"])
    key = "0123-4567-89AB-CDER"
    return encode(specs, folder=folder / "out", database=f"sqlite:///{folder}/l.db", lab_key=key,
                  formats=("3mf",), jobs=1)  # fmt: skip


def page_of(made, name: str) -> str:
    return next(f for f in made.files if f.name == f"{name}-build.html").read_text()


def test_the_sheet_of_an_object_explains_every_mark(made):
    page = page_of(made, "Block-2")
    marks = re.findall(r'<b class="mark">(.*?)</b>', page)
    code = re.search(r"short code</th><td>(\w+)", page)[1]
    assert len(marks) == 6
    assert all(mark.split()[0].startswith(("BLOCK-2", code)) for mark in marks)
    assert [mark[-1] for mark in marks] == list("123456")
    assert page.count("Glue F") == 5
    assert "symbols down" in page
    assert re.search(r"must answer.*Block-2, F\d, near cell \[\d+, \d+\], turned by 0", page, re.S)
    outside = re.findall(r"(?:src|href)=\"(?!#)([^\"]*)", page)
    assert outside == []  # no network
    for drawing in re.findall(r"<svg.*?</svg>", page):
        ET.fromstring(drawing)


def test_the_last_line_says_what_to_print(made):
    line = next_step(made)
    assert "print course-plate-1.3mf" in line or "print course-plate-1.3mf ... " in line
    assert "course-build.html" in line
    assert "Whole: F1 down, supports needed under F1 (" in line
    whole = next(one for one in made.objects if one.name == "Whole")
    assert whole.lying is not None
    assert re.fullmatch(
        r"F1 down, supports needed under F1 \(\d+ symbols hang over\), \d+ symbols stand out "
        r"sideways; with  parts: panels  nothing hangs over",
        whole.lying,
    )
    assert made.objects[0].lying is None
