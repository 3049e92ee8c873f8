"""The size that a picture tells: of a can its diameter, not the facets' that stand for it."""

from pathlib import Path

import numpy as np
import pytest

from generator.pipeline.files import outer_size_mm, parts_of
from generator.pipeline.place import NO_CELLS, lay_out_object
from generator.pipeline.plan import plan_object
from generator.spec import read_specs

CAN = "shape: {cylinder: {diameter: 60 mm, height: 80 mm}}\nsymbols: {pitch: 14 mm}\n"
CUBE = "shape: {cube: 60 mm}\nsymbols: {pitch: 12 mm}\nprofile: thesis\n"


def made(folder: Path, text: str):
    (folder / "part.yaml").write_text("name: Part\n" + text)
    (located,) = read_specs([folder / "part.yaml"])
    plan = plan_object(located)
    return plan.polyhedron, parts_of(plan, lay_out_object(plan, NO_CELLS))[0]


def test_a_can_is_as_wide_as_it_is_round(tmp_path):
    polyhedron, parts = made(tmp_path, CAN)
    assert np.ptp(polyhedron.vertices, axis=0)[0] < 59.99
    assert outer_size_mm(polyhedron, parts) == pytest.approx([60, 60, 80], abs=1e-9)


def test_a_cube_is_the_box_of_its_corners(tmp_path):
    assert outer_size_mm(*made(tmp_path, CUBE)) == pytest.approx([60, 60, 60], abs=1e-9)
