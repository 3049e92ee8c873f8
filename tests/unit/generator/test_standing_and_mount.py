"""What a part stands on, and by what it is held: blank faces, tags, holes."""

import math
from pathlib import Path

import numpy as np
import pytest
import trimesh
from random_shapes import extruded

from encoded_objects import encode
from generator.database.open import open_database
from generator.database.read import read_object
from generator.database.transaction import read_transaction
from generator.errors import DatabaseError
from generator.polyhedron import SHAPES, volume
from generator.polyhedron.frame import face_polygon
from generator.polyhedron.mount import FLANGES, SCREWS, Mount, with_mount
from generator.polyhedron.read import read_shape
from generator.polyhedron.shapes import cylinder, tag
from generator.polyhedron.standing import best_stance, bridges, stance_on
from generator.spec import SpecError, read_specs
from generator.spec.read import tree_from

SINE = math.sin(math.radians(45.0))
FIXTURES = Path(__file__).parents[3] / "fixtures"
WHOLE = {"parts": "whole"}


def made(folder, shape, formats=(), verify=False, **settings):
    spec = {"name": "Part", "shape": shape, **settings}
    return encode(spec, database=str(folder / "lab.db"), folder=folder / "out",
                  formats=formats, verify=verify)  # fmt: skip


def registered(folder):
    with read_transaction(open_database(f"sqlite:///{folder}/lab.db", writable=False)) as one:
        return read_object(one, "Part")


def bearing(folder):
    known = registered(folder)
    on = {face.face for face in known.layout.faces if len(face.labels)}
    return {known.polyhedron.faces[face].name for face in on}


TEE = [(10, 0), (10, 20), (30, 20), (30, 30), (-20, 30), (-20, 20), (0, 20), (0, 0)]


def along_y(outline, depth=30.0):
    """Return a prism along y over an outline (x, z), counter-clockwise as seen from -y."""
    pose = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
    return extruded([np.array(outline, float)], depth, pose=pose)


def stance(solid):
    flat = set(range(len(solid.faces))) - {f for s in solid.surfaces for f in s.facets}
    return best_stance(solid, flat, SINE)


def test_the_models_own_way_up_is_kept_where_little_hangs_over():
    for solid in (SHAPES["cube"](40), SHAPES["triangular_prism"](50, 40), cylinder(50, 40)):
        found = stance(solid)
        assert (solid.faces[found.face].name, found.as_modelled) == ("F1", True)
    bracket = read_shape(FIXTURES / "shapes/l_bracket.stl", 1.0)
    assert stance(bracket).as_modelled


def test_a_solid_that_would_hang_over_or_fall_is_turned():
    solid = along_y(TEE)
    found = stance(solid)
    assert (found.as_modelled, found.overhang_mm2) == (False, 0.0)
    up = solid.vertices @ found.R_bed_object[2]
    assert up[list(solid.faces[found.face].loops[0])] == pytest.approx(up.min())
    assert np.linalg.det(found.R_bed_object) == pytest.approx(1.0)
    # nothing stands on faces that others reach below
    assert all(stance_on(solid, ceiling, SINE) is None for ceiling in (3, 7))
    assert not stance(SHAPES["octahedron"](60)).as_modelled  # it stood on a corner
    assert stance(SHAPES["box"]((10.0, 40.0, 200.0))).contact_mm2 == pytest.approx(40 * 200)
    leaning = along_y([(10, 0), (70, 80), (60, 80), (0, 0)])
    assert not stance_on(leaning, stance(leaning).face, SINE).height_mm > 70


CUBE, TAG = {"cube": 40}, {"tag": [40, 40]}
ROD = {"cylinder": {"diameter": 50, "height": 30}}


@pytest.mark.parametrize(
    ("shape", "settings", "bears", "lies"),
    [
        ({"cube": 40}, WHOLE, "23456", "F1 down"),
        ({"cube": 40}, {**WHOLE, "down": "F4", "blank": "F6, F1"}, "235", "F4 down"),
        ({"cube": 40}, {**WHOLE, "down": "none"}, "123456", "F1 down"),
        ({"cube": 40}, {"blank": "f6"}, "12345", None),
        (ROD, {**WHOLE, "down": "F3", "blank": ["F2"]}, "1", "F3 down"),
    ],
)
def test_what_is_down_or_asked_stays_blank(tmp_path, shape, settings, bears, lies):
    lying = made(tmp_path, shape, print=settings).objects[0].lying
    assert bearing(tmp_path) == {f"F{number}" for number in bears}
    assert lying is None if lies is None else lying.startswith(lies)


def test_a_part_lies_on_the_face_that_is_down(tmp_path):
    made(tmp_path, {"box": [40, 50, 60]}, formats=("stl",), print={**WHOLE, "down": "F4"})
    (part,) = registered(tmp_path).parts
    T = part.T_object_part
    assert T[:3, :3] @ [0, 0, -1] == pytest.approx([0, 1, 0])  # F4 looks along +y
    corners = trimesh.load_mesh(tmp_path / "out/Part.stl").vertices
    assert corners[:, 2].min() == pytest.approx(0.0, abs=1e-5)
    low, high = corners @ T[:3, :3].T + T[:3, 3], np.array([20, 25, 60])
    assert (low.max(axis=0) > high).tolist() == [True, False, True]  # symbols, but none on F4


def test_saying_what_holds_already_means_the_same_object(tmp_path):
    made(tmp_path, {"cube": 40}, print=WHOLE)
    again = made(tmp_path, {"cube": 40}, print={**WHOLE, "down": "F1", "blank": ["F1"]})
    assert again.objects[0].reused
    with pytest.raises(DatabaseError, match="another spec"):
        made(tmp_path, {"cube": 40}, print={**WHOLE, "down": "F2"})


@pytest.mark.parametrize(
    ("shape", "settings", "cause"),
    [
        (CUBE, {"print": {"blank": ["F7"]}}, "the object has no face F7"),
        (CUBE, {"print": {"blank": "top"}}, "'top' is no name of a face"),
        (CUBE, {"print": {**WHOLE, "down": "F9"}}, "the object has no face F9"),
        (CUBE, {"print": {"down": "F1"}}, "every panel lies on its back"),
        (CUBE, {"print": {"blank": "F1,F2,F3,F4,F5,F6"}}, "all faces are blank"),
        (ROD, {"print": {"down": "F2"}}, "cannot stand"),
        (CUBE, {"print": {**WHOLE, "blank": "F2,F3,F4,F5,F6", "down": "F1"}}, "only F1"),
        (TAG, {"print": {"parts": "panels"}}, "a tag is printed in one piece"),
        ({"tag": [40]}, {}, "a tag has two sides, not 1"),
        (TAG, {"mount": {"screws": "M3", "rod": 6}}, "held in one way"),
        (TAG, {"mount": {"screws": "M3", "face": "F1"}}, "the mount takes F1, the only one"),
        (TAG, {"mount": {"screws": "M7"}}, "'M7' is no screw known here"),
        (TAG, {"mount": "ISO 9409-1-51-4-M6"}, "is no flange known here"),
        (TAG, {"mount": "50-4-M6"}, "the mount does not fit face F2"),
        ({"tag": {"size": [40, 40], "thickness": 3}}, {"mount": {"screws": "M6"}},
         "too thin to sink the head of M6"),
        (TAG, {"mount": {"rod": 6}}, "needs 11.5 mm behind face F2"),
        (CUBE, {"mount": {"screws": "M3"}, "print": {"parts": "panels"}}, "with a mount"),
        (TAG, {"mount": {"hole": 0.1}}, "a hole of 0.1 mm is too narrow"),
        (ROD, {"mount": {"rod": 6, "face": "F2"}}, "flat"),
        ({"pyramid": {"side": 60, "height": 50}}, {"mount": {"hole": "M8"}}, "one parallel face"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_with_a_way_out(tmp_path, shape, settings, cause):
    with pytest.raises(SpecError) as refused:
        made(tmp_path, shape, **settings)
    (problem,) = refused.value.problems
    assert cause in problem.cause
    assert problem.fix
    assert problem.mark is not None
    assert not list(tmp_path.iterdir())


def area(radius):
    """Return the area of the polygon that stands for a circle of a hole."""
    count = min(max(4 * math.ceil(math.pi * math.sqrt(radius / 0.04) / 4), 24), 240)
    return count / 2 * math.sin(2 * math.pi / count) * radius**2


def test_holes_take_what_they_should_of_the_solid():
    cube, screw = SHAPES["cube"](80.0), SCREWS["M6"]
    drilled = with_mount(cube, Mount("flange", "ISO 9409-1-50-4-M6"), 0)
    assert drilled.genus == 4
    wide, narrow = screw.head_mm / 2, screw.clear_mm / 2
    share = area(wide) / wide**2  # rings of one hole have one number of corners
    holes = 4 * share * (9.0 * narrow**2 + 71.0 * wide**2) + area(3.1) * 6.0
    assert volume(cube) - volume(drilled) == pytest.approx(holes, rel=1e-9)
    around = [np.hypot(*loop.mean(axis=0)) for loop in face_polygon(drilled, 5)[1:]]
    assert max(around) < 80 * math.sqrt(2)
    socket = with_mount(cylinder(60.0, 60.0), Mount("rod", 12.0), 0)
    gone = area(6.1) * (24.0 + 6.1 / 3)
    assert volume(cylinder(60.0, 60.0)) - volume(socket) == pytest.approx(gone, rel=1e-9)
    assert [s.kind for s in socket.surfaces] == ["cylinder", "cylinder", "cone"]
    down = np.array([0.0, 0.0, -1.0])
    assert not bridges(socket, down)  # a tip needs none, nor do ledges; ceilings of pockets do
    assert not bridges(along_y(TEE, 8.0), down)
    plate = with_mount(tag((60.0, 60.0), 4.0), Mount("magnets", (8.0, 2.0)), 1)
    assert len(bridges(plate, down)) == 4


def test_screws_of_a_flange_are_on_its_circle_and_the_pin_midway():
    for name, (circle, count, thread, _) in FLANGES.items():
        plate = with_mount(tag((160.0, 160.0), 12.0), Mount("flange", name), 1)
        outer, *loops = face_polygon(plate, 1)
        arms = np.array([loop.mean(axis=0) - outer.mean(axis=0) for loop in loops])
        assert np.hypot(*arms.T) == pytest.approx(circle / 2)
        turns = np.sort(np.degrees(np.arctan2(arms[:-1, 1], arms[:-1, 0])) % 360)
        assert np.diff(turns) == pytest.approx(360 / count)
        assert turns[0] == pytest.approx(180 / count)  # the pin is at 0
        wide = np.hypot(*(loops[0] - loops[0].mean(axis=0)).T)
        assert wide == pytest.approx(SCREWS[thread].clear_mm / 2)


def test_a_mount_may_be_a_text_and_a_tag_is_as_thick_as_it_needs():
    def spec(side, mount):
        shape = {"size": [abs(side)] * 2, "frame": 12} if side < 0 else [side, side]
        settings = {"name": "Tag", "shape": {"tag": shape}, "mount": mount}
        return read_specs([tree_from(settings)])[0]

    screws = [spec(40, text) for text in ("screws M3", "{screws: M3}", {"screws": "M3"})]
    assert {one.mount for one in screws} == {Mount("screws", "M3")}
    for side, mount, thick in (
        (40, {"magnets": [8, 1.5]}, 3.0), (40, {"magnets": [8, 3.0]}, 4.0),
        (40, {"screws": "M3"}, 3.0), (40, {"screws": "M6"}, 3.4),
        (70, {"flange": "ISO 9409-1-50-4-M6"}, 3.8), (-80, {"magnets": [8, 2.0]}, 4.0),
    ):  # fmt: skip
        assert spec(side, mount).shape.parameters["thickness"] == pytest.approx(thick)


def test_an_object_from_before_lies_as_it_did(tmp_path, monkeypatch):
    """Symbols were on the base then: the spec means the same object, and it keeps them."""
    with monkeypatch.context() as before:
        before.setattr("generator.pipeline.plan.best_stance", lambda *_: None)
        made(tmp_path, {"octahedron": 60}, print=WHOLE, formats=("stl",))
    again = made(tmp_path, {"octahedron": 60}, print=WHOLE, formats=("stl",)).objects[0]
    assert (again.reused, len(bearing(tmp_path))) == (True, 8)
    assert again.lying.startswith("as the file has it")
    assert (registered(tmp_path).parts[0].T_object_part[:3, :3] == np.eye(3)).all()
