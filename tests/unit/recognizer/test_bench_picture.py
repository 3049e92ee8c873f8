"""Objects as small pictures, and the sheets and symbols that these are drawn of."""

from __future__ import annotations

import re
from xml.etree import ElementTree

import numpy as np
import pytest

from generator.database.open import open_database
from generator.database.read import read_object
from generator.database.transaction import read_transaction
from generator.pipeline import encode
from generator.spec import read_specs
from recognizer.bench.lab_json import drawn_faces, face_sheets, object_svg, symbol_poses

SHAPES = {"Cube": "{cube: 30 mm}", "Can": "{cylinder: {diameter: 40 mm, height: 30 mm}}"}


@pytest.fixture(scope="module")
def held(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pictures")
    for name, shape in SHAPES.items():
        (folder / f"{name}.yaml").write_text(f"name: {name}\nshape: {shape}\n")
        specs = read_specs([folder / f"{name}.yaml"])
        encode(specs, folder=folder, formats=(), database=f"{folder}/lab.db")
    with read_transaction(open_database(f"{folder}/lab.db", writable=False)) as connection:
        return {name: read_object(connection, name) for name in SHAPES}


def polygons(svg):
    """Return the polygons of a picture, and how many dots it has."""
    root = ElementTree.fromstring(svg)
    paths = [one.get("d") for one in root]
    flat = [np.array(re.findall(r"-?[\d.]+", d), float) for d in paths if d.endswith("z")]
    return flat, sum(d.count("h0") for d in paths if d.endswith("h0"))


def test_a_cube_shows_three_faces_and_their_symbols_alone(held):
    flat, dots = polygons(object_svg(held["Cube"]))
    assert [len(one) for one in flat] == [8, 8, 8]
    towards = [
        len(layout.labels)
        for face, layout in zip(held["Cube"].faces, held["Cube"].layout.faces, strict=True)
        if face.T_object_face[:3, 2] @ (0.55, -1.0, 0.6) > 0
    ]
    assert (len(towards), dots) == (3, sum(towards))


def test_a_round_face_is_drawn_in_its_facets_within_the_picture(held):
    svg = object_svg(held["Can"])
    flat, dots = polygons(svg)
    assert len(flat) > 20
    assert dots > 10
    x, y, w, h = map(float, re.search('viewBox="([^"]*)"', svg).group(1).split())
    points = np.concatenate([one.reshape(-1, 2) for one in flat])
    assert (points >= [x, y]).all()
    assert (points <= [x + w, y + h]).all()


@pytest.mark.parametrize("name", SHAPES)
def test_sheets_close_a_surface_and_symbols_stand_on_it(held, name):
    area = 0.0
    for number in drawn_faces(held[name]):
        face = held[name].faces[number]
        centres = held[name].layout.faces[number].centres_mm
        poses = symbol_poses(face, centres)
        normals = poses[:, :3, 2]
        assert np.allclose(np.linalg.norm(normals, axis=1), 1.0)
        for loops in face_sheets(face):
            outer = loops[0]
            cross = np.cross(outer - outer[0], np.roll(outer, -1, axis=0) - outer[0]).sum(axis=0)
            area += np.linalg.norm(cross) / 2
    wanted = 6 * 30**2 if name == "Cube" else np.pi * 40 * 30 + 2 * np.pi * 20**2
    assert area == pytest.approx(wanted, rel=5e-3)
