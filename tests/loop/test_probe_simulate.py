"""From a spec to a simulated touch: registered faces are the surfaces of the written parts."""

import json
from pathlib import Path

import numpy as np
import pytest
import shapely

from encoded_objects.base.sensor_type import SensorType
from generator.pipeline import encode
from generator.spec import read_specs
from probe.command import run
from probe.contact.contract import Touch
from probe.contact.press import press
from probe.recording.read import Recording
from probe.simulate.registered import registered_object, registered_surface
from probe.simulate.scene import pose_of
from probe.simulate.target import part_surface, surface_of

SET = """
objects:
- {name: Cube, shape: {cube: 40 mm}}
- {name: Whole, shape: {cube: 40 mm}, print: {parts: whole}}
- {name: Ball, shape: {dodecahedron: 30 mm}, print: {parts: whole}}
- {name: Can, shape: {cylinder: {diameter: 60 mm, height: 40 mm}}}
- name: Step
  shape:
    polyhedron:
      vertices: [[0,0,0],[60,0,0],[60,40,0],[0,40,0],[0,0,40],[30,0,40],[30,40,40],[0,40,40],
                 [30,0,60],[60,0,60],[60,40,60],[30,40,60]]
      faces: [[0,3,2,1],[4,5,6,7],[8,9,10,11],[5,8,11,6],[1,2,10,9],[0,4,7,3],
              [0,1,9,8,5,4],[2,3,7,6,11,10]]
  print: {parts: whole}
"""


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lab")
    (folder / "set.yaml").write_text(SET)
    for spec in read_specs([folder / "set.yaml"]):  # a set has files of its own besides
        encode([spec], folder=folder / "out", database=f"sqlite:///{folder / 'lab.db'}",
               formats=("stl",))  # fmt: skip
    return folder


def file_of(lab: Path, name: str) -> Path:
    return next((lab / "out").rglob(f"{name}.stl"))


def compared(scene, mesh, low, high, *, away_mm=0.0):
    """Heights of both at random points that lie 1e-3 mm beside every edge of the mesh."""
    points = np.random.default_rng(1).uniform(low, high, (6000, 2))
    if away_mm:
        inside = scene.region.contains(points) & (scene.region.distance_mm(points) > away_mm)
        points = points[inside]
    lines = shapely.STRtree([shapely.LinearRing(t) for t in mesh.corners[:, :, :2]])
    near = lines.query(shapely.points(points), predicate="dwithin", distance=1e-3)
    points = np.delete(points, near[0], axis=0)
    return scene.surface.heights_mm(points), mesh.heights_mm(points)


def assert_same(ours, written, size_mm):
    """A file's float32 is good to 1e-6 mm on flats, and on sides to an ulp times their slope."""
    assert (np.isfinite(ours) == np.isfinite(written)).all()
    off = np.abs(ours - written)[np.isfinite(ours)]
    ulp = float(np.spacing(np.float32(size_mm)))
    flat = (np.abs(ours[np.isfinite(ours)]) < 1e-9) | (ours[np.isfinite(ours)] > 1 - 1e-9)
    assert off[flat].max() < max(1e-6, ulp)
    assert off.max() < 8 * ulp


@pytest.mark.parametrize("face", ["F1", "F6"])
def test_panel_is_the_registered_face(lab, face):
    scene = registered_surface(str(lab / "lab.db"), "Cube", face)
    part = part_surface(file_of(lab, f"Cube-{face}"), database=str(lab / "lab.db"))
    assert part.face == face
    assert np.array_equal(part.T_object_surface, scene.T_object_surface)
    low, high = scene.region.box_mm
    ours, written = compared(scene, part.surface, low, high, away_mm=2.0)
    assert (ours > 0.5).mean() > 0.1
    assert_same(ours, written, 40.0)


@pytest.mark.parametrize(("name", "face"), [("Whole", "F4"), ("Ball", "F2"), ("Step", "F2")])
def test_whole_part_is_the_registered_face_with_all_that_lies_around_it(lab, name, face):
    scene = surface_of(f"{lab / 'lab.db'}#{name}/{face}")
    part = part_surface(file_of(lab, name), database=str(lab / "lab.db"), face=face)
    low, high = scene.region.box_mm
    ours, written = compared(scene, part.surface, low - 6.0, high + 6.0)
    deep = written < -7.0  # symbols of other faces that no touch can reach are left out
    assert_same(ours[~deep], written[~deep], 100.0)
    assert (ours[deep] <= written[deep] + 1e-4).all()
    if name == "Step":  # its reflex edge: the higher part stands over the face's own plane
        assert scene.surface.top_mm == pytest.approx(21.0)
        assert (ours > 19.0).any()


def test_file_alone_is_touched_as_it_lies(lab):
    scene = surface_of(str(file_of(lab, "Cube-F1")))
    assert scene.face == ""
    assert np.allclose(scene.centre_mm(), 0.0, atol=0.5)
    assert scene.surface.top_mm == pytest.approx(4.0)
    framed = surface_of(f"{file_of(lab, 'Cube-F1')}@{lab / 'lab.db'}")
    assert framed.surface.top_mm == pytest.approx(1.0)
    assert framed.object_name == "Cube"


def test_pose_of_a_touch_carries_sensor_points_onto_the_tips_plane(lab):
    scene = surface_of(f"{lab / 'lab.db'}#Cube")
    touch = Touch(20.0, 19.0, 0.8, 60.0, 0.02, -0.01)
    contact = press(scene.surface, SensorType(), touch, accuracy="tabs")
    T = pose_of(touch, contact)
    points = np.array([[5.0, -3.0], [0.0, 0.0], [-7.0, 8.0]])
    here = np.c_[points, np.zeros(3), np.ones(3)] @ T.T
    assert np.abs(here[:, :2] - touch.on_surface(points)).max() < 0.02
    zeta = contact.z_mm + contact.tilt_x_rad * points[:, 1] - contact.tilt_y_rad * points[:, 0]
    assert np.abs(here[:, 2] - zeta).max() < 1e-3
    assert np.allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3))


def test_a_round_face_is_scanned_from_all_around(lab, tmp_path):
    target, truth = f"{lab / 'lab.db'}", tmp_path / "a.json"
    (face,) = (face for face in registered_object(target, "Can").faces if face.round is not None)
    words = ["simulate", f"{target}#Can/{face.name}", "--scan", "raster", "--touches", "9"]
    assert run([*words, "-o", str(tmp_path / "a.h5"), "--truth", str(truth)]) == 0
    told, poses = json.loads(truth.read_text()), Recording(tmp_path / "a.h5").block().pose
    for one, pose in zip(told["touches"], poses, strict=True):
        in_object = np.linalg.inv(told["T_base_object"]) @ pose
        assert in_object == pytest.approx(np.array(one["T_object_probe"]), abs=1e-9)
    assert np.ptp(poses[:, 0, 2]) > 0.5, "it goes round"
    assert run([*words[:3], "kinesthetic"]) == 2
