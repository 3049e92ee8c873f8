"""Stiff and extreme cases that belong to no single module; `docs/contact.md` lists all sixteen."""

import math
import re
from fractions import Fraction

import numpy as np
import pytest
from reference.cube_panels import embossed
from reference.indenters import half_plane

from encoded_objects.base.sensor_type import Overlay, SensorType, choose_sensor_type
from generator.export.meshes import stl_chunks
from generator.export.step import step_chunks
from generator.polyhedron.shapes import cube
from generator.polyhedron.winged import polyhedron
from generator.solid.triangulate import triangles
from probe.contact.contract import Touch, WristStiffness
from probe.contact.press import LEVELS, press
from probe.contact.tabs import tabs
from probe.errors import ContactError
from probe.surface.face import endless_face
from probe.surface.indenters import FlatPlate, RaisedStrip
from probe.surface.polygon import polygon
from recognizer.scan.mosaic.mosaic import add_touch, no_touches
from recognizer.scan.mosaic.planar import PlacedTouch, compose_poses, planar_belief
from recognizer.touch.options import ReaderOptions
from recognizer.touch.signal import signal_of

SENSORS = {kind: SensorType(overlay=Overlay(kind=kind)) for kind in ("tab", "pad")}
SENSORS["gel"] = choose_sensor_type("gel-24x32", "", None, "--sensor-type")
TAB = SENSORS["tab"]
P = TAB.pitch_mm
GLYPHS = (
    (((-1, 1), (-1, -1)), ((-1, -1), (1, -1))),
    (((1, -1), (-1, -1)), ((-1, -1), (-1, 0)), ((-1, 0), (0, 1)), ((0, -1), (0, 0))),
    (((-1, -1), (0, -1)), ((0, -1), (0, 0)), ((0, 0), (1, 1)), ((0, 0), (-1, 0))),
    (((-1, 1), (-1, -1)), ((-1, -1), (1, -1)), ((1, -1), (1, 1))),
)
EVERY_LEVEL = [(kind, level) for kind, levels in LEVELS.items() for level in levels]
OF_FORCES = [pair for pair in EVERY_LEVEL if pair[0] != "gel"]  #: a gel's image is of depths

FELT = ReaderOptions(contact_counts=0.1)  #: of newtons without a calibration


@pytest.mark.parametrize(("kind", "level"), EVERY_LEVEL)
def test_case_5_no_force_is_no_image_and_a_free_plate_off_its_ground_tips(kind, level):
    """Matter under x <= -2 mm alone: the centre of pressure lies outside the hull."""
    sensor = SENSORS[kind]
    assert not press(FlatPlate(), sensor, Touch(0, 0, 0, 0.0), accuracy=level).forces_n.any()
    if level == "footprint":  # knows of no moments
        return
    free = Touch(2.0, 0, 0, 5.0, wrist=WristStiffness(0.0, 0.0))
    with pytest.raises(ContactError, match="tips"):
        press(half_plane(), sensor, free, accuracy=level)


@pytest.mark.parametrize(("kind", "level"), OF_FORCES)
@pytest.mark.parametrize("width", [0.01, 0.05, 0.2])
def test_case_6_thin_strokes_are_felt_or_refused_at_every_level(kind, level, width):
    """Over nothing, and over a floor that would bear the force if the stroke were lost.

    Points on a tip are too far apart to meet every stroke of 0.01 mm, or with 7 of 0.05 mm.
    """
    lost = {"footprint": 1.0, "tabs-7": 0.1, "tabs-19": 0.02, "tabs-61": 0.02, "layer-2": 0.02}
    for floor in (-math.inf, -0.8)[: 1 + (width > lost.get(level, 0.0))]:
        for x in (P / 2, 0.31):
            surface, touch = RaisedStrip(width, floor_mm=floor), Touch(x, 0, 0.02, 1.0)
            try:
                found = press(surface, SENSORS[kind], touch, accuracy=level)
            except ContactError:
                continue
            assert found.forces_n.sum() == pytest.approx(1.0, rel=1e-5)
            assert found.forces_n[:, 6:10].sum() > 0.8


def test_case_8_slivers_and_squares_of_a_simulated_face():
    """The probe's own polygons: no interior point rejected, no sliver at 1000 mm misjudged."""
    rng = np.random.default_rng(8)
    square = polygon([[(0, 0), (80, 0), (80, 80), (0, 80)]])
    points = rng.uniform(1e-3, 79.999, (20_000, 2))
    assert square.contains(points).all()
    assert not square.contains(points + np.array([80, 0])).any()
    turn = np.array([[math.cos(0.3), -math.sin(0.3)], [math.sin(0.3), math.cos(0.3)]])
    sliver = np.array([(0, 0), (80, 0), (80, 0.008), (0, 0.008)]) @ turn.T + 1000
    points = rng.uniform((-1, -0.008), (81, 0.016), (500, 2)) @ turn.T + 1000
    ring = [tuple(map(Fraction, corner)) for corner in sliver.tolist()]
    sides = list(zip(ring, [*ring[1:], ring[0]], strict=True))
    exact = [
        all((b[0] - a[0]) * (y - a[1]) >= (b[1] - a[1]) * (x - a[0]) for a, b in sides)
        for x, y in (map(Fraction, point) for point in points.tolist())
    ]
    assert 0.2 < np.mean(exact) < 0.5
    assert polygon([sliver]).contains(points).tolist() == exact


@pytest.fixture(scope="module")
def far_panel():
    """A panel of a cube whose corner stands at (1000, 1000, 1000) mm."""
    near = cube(36.0)
    far = polyhedron("far", near.vertices + 1000.0, near.faces)
    return embossed(far, name="Far")[0]


def test_case_10_a_file_in_its_own_frame_keeps_the_facets(far_panel):
    """In 32-bit floats facets of 2 um and up turn by < 1e-3 degrees; at 1000 mm by far more."""
    mesh = triangles(far_panel)
    assert np.abs(mesh.vertices).max() < 40
    assert np.abs(far_panel.T_object_part[:3, 3]).max() > 900
    kind = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    written = b"".join(stl_chunks(mesh))[84:]
    corners = np.frombuffer(written, kind)["corners"].astype(float)
    true = mesh.vertices[mesh.triangles]
    assert turned_degrees(corners, true).max() < 1e-3
    at_place = (true + 1000).astype(np.float32).astype(float)
    assert turned_degrees(at_place, true).max() > 1e-2


def turned_degrees(corners, true):
    a, b = (np.cross(c[:, 1] - c[:, 0], c[:, 2] - c[:, 0]) for c in (corners, true))
    across = np.linalg.norm(np.cross(a, b), axis=1)
    return np.degrees(np.arctan2(across, np.einsum("ij,ij->i", a, b)))


def test_case_16_step_tolerance_is_far_below_the_part(far_panel):
    """1e-6 of the part's size at most, and coordinates written finer than that."""
    text = b"".join(step_chunks(far_panel)).decode("ascii")
    (tolerance,) = map(float, re.findall(r"LENGTH_MEASURE\(([^)]+)\),#\d+,'distance_acc", text))
    assert tolerance <= 1e-6 * np.ptp(far_panel.vertices, axis=0).max()
    found = re.findall(r"CARTESIAN_POINT\('',\(([^)]+)\)\)", text)
    points = np.array([[float(number) for number in point.split(",")] for point in found])
    for vertex in far_panel.vertices:
        assert np.abs(points - vertex).max(axis=1).min() <= tolerance / 100


@pytest.mark.parametrize("scene", ["clean", "gradient", "offset", "saturated"])
def test_case_12_registration_is_right_to_a_tactel_where_it_answers(scene):
    """75 % overlap, believed to +-1 tactel; raw products are wrong in a fifth of each scene."""
    rng = np.random.default_rng(12)
    faces = [endless_face(rng.integers(0, 4, (23, 25)), GLYPHS) for _ in range(2)]

    def felt(face, pose):
        forces = tabs(face, TAB, Touch(*pose, 80.0)).forces_n
        forces = np.maximum(forces + rng.normal(0, 0.02, (16, 16)), 0)
        if scene == "gradient":
            forces = forces * np.linspace(0.1, 1.9, 16)
        if scene == "offset":
            forces = forces + forces[forces > 0.1].mean()
        return np.minimum(forces, 0.3) if scene == "saturated" else forces

    wrong, answered, pairs = 0, 0, 20
    spread = (P, P, math.radians(0.5))
    for pair in range(pairs):
        place = np.array([*rng.uniform(20, 120, 2), rng.uniform(0, 2 * math.pi)])
        true = np.array([4.25 * P * rng.choice([-1, 1]), 0.3 * P, 0.0])
        believed = true + np.array([*rng.uniform(-P, P, 2), 0.0])
        images = [felt(faces[pair % 2], at) for at in (place, compose_poses(place, true))]
        first, second = (signal_of(image, floor=0.0, options=FELT) for image in images)
        origin = planar_belief(np.zeros(3), (1e-3, 1e-3, 1e-5))
        mosaic = add_touch(no_touches(TAB), PlacedTouch(first, origin))
        mosaic = add_touch(mosaic, PlacedTouch(second, planar_belief(believed, spread)))
        placed = mosaic.reasons == ("", "")
        answered += placed
        wrong += placed and math.hypot(*(mosaic.poses[1] - true)[:2]) > P
    assert wrong == 0
    assert answered >= 0.95 * pairs
